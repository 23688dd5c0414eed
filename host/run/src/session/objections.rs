//! What is wrong with the start of a scene, or worth a warning.

use super::culprit::functions_of;
use super::error::{SessionError, fault_of_element};
use super::options::tolerance;
use crate::analysis::{AnalysisError, Assembly, AssemblyError, Gap, Move};
use crate::diagnostics::{Diagnostic, codes};
use crate::model::{Model, operations_behind, rows};
use crate::plan::{Askew, Crosswise, Layout, Locked, Plan, Undetermined};
use crate::program::Equations;
use crate::results::significant;
use crate::scene::{Dimension, ElementKind, ElementRecord, Placement, Scene};
use element_api::recording::{Input, Op};

/// A scene with a body that assembly moves further than this share of the scene's size is refused.
const LARGEST_JUMP: f64 = 0.2;
/// Velocities that take nothing further in a whole run than this share of the scene's size, to which positions are assembled, are rest.
const LEAST_WAY: f64 = 1e-12;
/// Rotations by assembly below this are round-off, rad.
const LEAST_TURN: f64 = 1e-9;
/// Joints that are named where they contradict each other.
const MOST_JOINTS: usize = 12;

pub(super) fn assembly_error(error: &AssemblyError, scene: &Scene, model: &Model) -> SessionError {
    match error {
        AssemblyError::Impossible { rows } => impossible(rows, scene),
        AssemblyError::Contradiction { rows } => contradiction(rows, scene),
        AssemblyError::Undefined { joint, row } => undefined(joint, row, scene),
        AssemblyError::Analysis(error) => {
            let fault = fault_of_element(scene, model, error, "at the start");
            let general = || Diagnostic::error(codes::CANNOT_ASSEMBLE, error.to_string());
            let mut diagnostic = fault.unwrap_or_else(general);
            if let AnalysisError::Unsolved { element, .. } = error {
                diagnostic = of_unsolved(diagnostic, element, scene);
            }
            SessionError::one(&scene.source, diagnostic)
        }
    }
}

/// Where an element stands whose internal unknowns are not found, and what says where they are looked for.
fn of_unsolved(diagnostic: Diagnostic, element: &str, scene: &Scene) -> Diagnostic {
    let Some(record) = scene.elements.iter().find(|record| record.name.value == element) else { return diagnostic };
    let kind = &record.type_name.value;
    diagnostic
        .at(record.name.span.clone(), "where its bodies are, or with its parameters")
        .help("check positions, points and axes of this element, and its parameters")
        .help(format!(
            "`odyn elements describe {kind}` says where it is singular, and which parameters the search starts from"
        ))
}

/// A joint whose equation has no value where the bodies are.
fn undefined(joint: &str, row: &str, scene: &Scene) -> SessionError {
    let message = format!("`{joint}` is not defined where its bodies are");
    let mut diagnostic = Diagnostic::error(codes::CANNOT_ASSEMBLE, message);
    if let Some(record) = scene.elements.iter().find(|record| record.name.value == joint) {
        diagnostic = diagnostic.at(record.name.span.clone(), format!("row `{row}` or its derivative is not finite"));
        let functions = functions_of(record);
        if !functions.is_empty() {
            diagnostic = diagnostic.help(format!("look at {}", functions.join(", ")));
        }
        let kind = &record.type_name.value;
        diagnostic = diagnostic.help(format!("`odyn elements describe {kind}` says where it is singular"));
    }
    let diagnostic = diagnostic
        .help("check positions, points and axes, of this joint and of those that pull its bodies there: without `point` or `frames`, a joint connects the origins of its bodies");
    SessionError::one(&scene.source, diagnostic)
}

/// By how much a row is missed, in the scene's unit.
fn size_of(gap: &Gap, scene: &Scene) -> String {
    if gap.flat {
        return "what no small motion changes".into();
    }
    let dimension = if gap.angular { Dimension::ANGLE } else { Dimension::LENGTH };
    format!("{} {}", significant(gap.size / scene.units.factor(dimension), 4), scene.units.label(dimension))
}

/// Joints that no position meets, each with the rows that contradict others.
fn impossible(gaps: &[Gap], scene: &Scene) -> SessionError {
    // Worst first, and so are the joints.
    let mut joints: Vec<(&str, Vec<String>)> = Vec::new();
    for gap in gaps {
        let text = match gap.flat {
            true => format!("no small motion changes row `{}`", gap.row),
            false => format!("row `{}` misses by {}", gap.row, size_of(gap, scene)),
        };
        match joints.iter_mut().find(|(joint, _)| *joint == gap.joint) {
            Some((_, texts)) => texts.push(text),
            None => joints.push((&gap.joint, vec![text])),
        }
    }
    let names = joints_named(joints.iter().map(|(joint, _)| *joint));
    let verb = if joints.len() == 1 { "cannot be met" } else { "contradict each other" };
    let message = format!("the joints cannot be assembled: {names} {verb}");
    let mut diagnostic = Diagnostic::error(codes::CANNOT_ASSEMBLE, message);
    for (k, (joint, texts)) in joints.iter().take(MOST_JOINTS).enumerate() {
        let Some(record) = scene.elements.iter().find(|record| record.name.value == *joint) else { continue };
        let (span, text) = (record.name.span.clone(), texts.join(", "));
        diagnostic = if k == 0 { diagnostic.at(span, text) } else { diagnostic.context(span, text) };
    }
    let others = match joints.len() {
        1 => {
            "the gaps are those where the bodies miss least; those of other joints that it contradicts are round-off beside them"
        }
        _ => "the gaps are those where the bodies miss least; other joints are not part of the conflict",
    };
    let flat = gaps.iter().find(|gap| gap.flat).and_then(|gap| {
        let record = scene.elements.iter().find(|record| record.name.value == gap.joint)?;
        let (row, kind) = (&gap.row, &record.type_name.value);
        Some(format!(
            "row `{row}` has directions that are as wrong as can be, parallel where they must be perpendicular: one `axis` for both \
             frames may be what is wrong; `odyn elements describe {kind}` says which `axes` it takes"
        ))
    });
    let diagnostic = diagnostic
        .help_if(flat)
        .help(others)
        .help("check lengths, points and axes of the joints named, or take one of them away; positions may be rough")
        .help("joints that hold again what others hold must agree with them to twelve digits: `point` and `axis` place them so, `frames` only as far as their numbers are written");
    SessionError::one(&scene.source, diagnostic)
}

/// Joints whose velocities cannot all be had.
fn contradiction(gaps: &[Gap], scene: &Scene) -> SessionError {
    let message = "the joints ask for velocities that contradict each other";
    let mut diagnostic = Diagnostic::error(codes::CONFLICTING_CONSTRAINTS, message);
    let mut seen: Vec<&str> = Vec::new();
    let mut no_axis = Vec::new();
    for gap in gaps {
        let joint = gap.joint.as_str();
        if seen.contains(&joint) || seen.len() == 6 {
            continue;
        }
        let Some(record) = scene.elements.iter().find(|record| record.name.value == joint) else { continue };
        let dimension = if gap.angular { Dimension::ANGULAR_VELOCITY } else { Dimension::VELOCITY };
        let off = significant(gap.size / scene.units.factor(dimension), 4);
        let text = format!("row `{}` stays off by {off} {}", gap.row, scene.units.label(dimension));
        if gap.angular && is_without_axis(record) {
            no_axis.push(joint);
        }
        diagnostic = if seen.is_empty() {
            diagnostic.at(record.name.span.clone(), text)
        } else {
            diagnostic.context(record.name.span.clone(), text)
        };
        seen.push(joint);
    }
    let diagnostic = diagnostic
        .help_if(axis_left_out(&no_axis))
        .help("at this position, what is driven cannot move as it is prescribed without breaking another joint")
        .help("take one of them away, or drive what the others leave free; axes of a planar mechanism must be parallel to nine digits");
    SessionError::one(&scene.source, diagnostic)
}

/// Whether the axes of an element's frames are those of the ground because nothing else is written.
fn is_without_axis(record: &ElementRecord) -> bool {
    match &record.placement.value {
        Placement::Global { axes, .. } => axes.is_empty(),
        Placement::Local(_) => false,
        Placement::Absent => true,
    }
}

/// The remedy where these joints may need an axis.
fn axis_left_out(joints: &[&str]) -> Option<String> {
    let have = if joints.len() == 1 { "has" } else { "have" };
    let whose = if joints.len() == 1 { "its axis is" } else { "the axis of each is" };
    let names = joints_named(joints.iter().copied());
    (!joints.is_empty()).then(|| format!("{names} {have} no `axis`; without one, {whose} z of the ground"))
}

/// Joints that hold directions of their bodies without an `axis`, beside others that have one.
fn without_axis<'a>(joints: &[usize], model: &'a Model, scene: &Scene) -> Vec<&'a str> {
    let record = |joint: &usize| scene.elements.iter().find(|one| one.name.value == model.elements[*joint].name);
    let holds_directions = |joint: &&usize| {
        let recording = &model.elements[**joint].recording;
        let frame = |(_, op)| if let Op::Input(Input::Rotation { frame, .. }) = op { Some(frame) } else { None };
        let mut frames: Vec<u32> =
            operations_behind(recording, rows(recording)).into_iter().filter_map(frame).collect();
        frames.sort_unstable();
        frames.dedup();
        frames.len() > 1
    };
    let (without, with): (Vec<&usize>, Vec<&usize>) =
        joints.iter().filter(holds_directions).partition(|joint| record(joint).is_some_and(is_without_axis));
    let without = without.into_iter().filter(|_| !with.is_empty());
    without.map(|joint| model.elements[*joint].name.as_str()).collect()
}

/// What assembly had to change; an error when a body jumped.
pub(super) fn assembly_warnings(
    assembly: &Assembly,
    scene: &Scene,
    model: &Model,
) -> Result<Vec<Diagnostic>, SessionError> {
    let mut warnings = Vec::new();
    let factor = scene.units.factor(Dimension::LENGTH);
    let label = scene.units.label(Dimension::LENGTH);
    for moved in &assembly.moves {
        let share = (moved.distance / assembly.scales.length).max(moved.angle);
        if share < 1e-9 {
            continue;
        }
        let text = format!(
            "moved by {} {label} and {} deg to meet the joints",
            significant(moved.distance / factor, 4),
            significant(moved.angle.to_degrees(), 4)
        );
        let span = place_of_body(scene, &moved.body);
        let hint = placed_by_axes_alone(scene, moved).map(|joint| {
            format!(
                "`{joint}` has `axes` without `x_axes`: how its frames are turned about these follows from ground's x axis; \
                 give `x_axes` that fit the bodies as they are"
            )
        });
        let hint = hint.or_else(|| {
            let joint = placed_by_origins(scene, moved)?;
            Some(format!(
                "`{joint}` has no `point`: it joins the origins of its bodies; give the `point` where they meet"
            ))
        });
        if share > LARGEST_JUMP {
            let missed = assembly.missed.as_ref().map(|gap| {
                let (joint, row, by) = (&gap.joint, &gap.row, size_of(gap, scene));
                format!("where the scene puts the bodies, the row `{row}` of `{joint}` is missed most, by {by}")
            });
            let driven = assembly.missed.as_ref().filter(|gap| follows_time(&gap.joint, model)).map(|gap| {
                let (joint, by) = (&gap.joint, size_of(gap, scene));
                format!(
                    "`{joint}` prescribes a motion, which at the start is {by} away from where the bodies are: put them where it begins, \
                     or let it begin where they are"
                )
            });
            let diagnostic = Diagnostic::error(
                codes::ASSEMBLY_JUMP,
                format!("assembly would move `{}` far from where the scene puts it", moved.body),
            )
            .at(span, text)
            .help(
                "give positions and orientations nearer to an assembled state, or correct the joint that pulls it away",
            );
            return Err(SessionError::one(&scene.source, diagnostic.help_if(missed).help_if(driven).help_if(hint)));
        }
        let message = format!("`{}` was not where its joints need it", moved.body);
        warnings.push(Diagnostic::warning(codes::ASSEMBLY_JUMP, message).at(span, text).help_if(hint));
    }
    let duration = scene.simulation.t_end - scene.simulation.t_start;
    for miss in &assembly.velocity_misses {
        // A function of time that begins smoothly is hardly ever at rest: exp(-128) is its speed.
        let way = (miss.found - miss.given).abs() * duration / if miss.angular { 1.0 } else { assembly.scales.length };
        if duration > 0.0 && way <= LEAST_WAY {
            continue;
        }
        let (what, dimension) = match miss.angular {
            true => ("angular velocity", Dimension::ANGULAR_VELOCITY),
            false => ("velocity", Dimension::VELOCITY),
        };
        let number = |value: f64| significant(value / scene.units.factor(dimension), 6);
        let text = format!("{} as given, {} as the joints make it", number(miss.given), number(miss.found));
        let component = ["x", "y", "z"][miss.component];
        let message = format!("the joints do not allow the {what} {component} of `{}`", miss.body);
        warnings.push(
            Diagnostic::warning(codes::INCONSISTENT_VELOCITIES, message)
                .at(place_of_body(scene, &miss.body), format!("{text}, {}", scene.units.label(dimension)))
                .help("leave velocities out that follow from others; assembly finds them"),
        );
    }
    Ok(warnings)
}

/// Whether rows of a joint depend on time.
fn follows_time(joint: &str, model: &Model) -> bool {
    model.elements.iter().filter(|instance| instance.name == joint).any(|instance| {
        let behind = operations_behind(&instance.recording, rows(&instance.recording));
        behind.into_iter().any(|(_, op)| op == Op::Input(Input::Time))
    })
}

/// The first joint of a body that was turned whose frames have axes in several directions and no x axes.
fn placed_by_axes_alone<'a>(scene: &'a Scene, moved: &Move) -> Option<&'a str> {
    if moved.angle < LEAST_TURN {
        return None;
    }
    let is_so = |record: &&ElementRecord| match &record.placement.value {
        Placement::Global { axes, x_axes, .. } => x_axes.is_empty() && axes.iter().any(|axis| *axis != axes[0]),
        _ => false,
    };
    let joints = scene.elements.iter().filter(|record| record.kind == ElementKind::Joint).filter(is_so);
    let mut own = joints.filter(|record| record.bodies.value.iter().any(|body| body.value == moved.body));
    own.next().map(|record| record.name.value.as_str())
}

/// The first joint of a body that was shifted which has no points.
fn placed_by_origins<'a>(scene: &'a Scene, moved: &Move) -> Option<&'a str> {
    let is_so = |record: &&ElementRecord| match &record.placement.value {
        Placement::Global { points, .. } => points.is_empty(),
        Placement::Local(_) => false,
        Placement::Absent => true,
    };
    let joints = scene.elements.iter().filter(|record| record.kind == ElementKind::Joint).filter(is_so);
    let mut own = joints.filter(|record| record.bodies.value.iter().any(|body| body.value == moved.body));
    own.next().filter(|_| moved.distance > 0.0).map(|record| record.name.value.as_str())
}

/// Whether a tolerance asks for more digits than any place or time has.
fn is_below_numbers(tolerance: f64) -> bool {
    tolerance < 2.0 * f64::EPSILON
}

/// The body furthest from the origin, if its position is known less exactly than the tolerance asks for.
pub(super) fn distance_warning(assembly: &Assembly, scene: &Scene, model: &Model) -> Option<Diagnostic> {
    let norm = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>().sqrt();
    let distances = assembly.working.chunks_exact(13).map(|y| norm(&y[..3]));
    let (distance, body) = distances.zip(&model.bodies).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let tolerance = tolerance(scene);
    let (length, unknown) = (assembly.scales.length, distance * f64::EPSILON);
    if unknown <= tolerance * length || is_below_numbers(tolerance) {
        return None;
    }
    let number = |value: f64| significant(value / scene.units.factor(Dimension::LENGTH), 3);
    let label = scene.units.label(Dimension::LENGTH);
    let message = format!("`{}` is too far from the origin for a tolerance of {tolerance:e}", body.name);
    let text = format!(
        "{} {label} away, where numbers are {} {label} apart; the scene is {} {label} large",
        number(distance),
        number(unknown),
        number(length)
    );
    let help = format!("put the origin near the bodies, or raise `tolerance` to {:.0e}", unknown / length * 2.0);
    let diagnostic = Diagnostic::warning(codes::FAR_FROM_ORIGIN, message).at(place_of_body(scene, &body.name), text);
    Some(diagnostic.help(help))
}

/// A run whose times are known less exactly than the tolerance asks for, or any numbers.
pub(super) fn time_warning(scene: &Scene) -> Option<Diagnostic> {
    let simulation = &scene.simulation;
    let (length, far) = (simulation.t_end - simulation.t_start, simulation.t_start.abs().max(simulation.t_end.abs()));
    let (tolerance, unknown) = (tolerance(scene), far * f64::EPSILON);
    if is_below_numbers(tolerance) {
        let message = format!("a tolerance of {tolerance:e} is below what numbers can hold");
        let warning =
            Diagnostic::warning(codes::OUT_OF_RANGE, message).at(simulation.span.clone(), "numbers have 16 digits");
        return Some(warning.help("raise `tolerance` to 1e-13, or leave it out"));
    }
    if unknown <= tolerance * length {
        return None;
    }
    let number = |value: f64| significant(value / scene.units.factor(Dimension::TIME), 3);
    let label = scene.units.label(Dimension::TIME);
    let message = format!("the run is too far from t = 0 for a tolerance of {tolerance:e}");
    let text = format!("times are {} {label} apart there; the run lasts {} {label}", number(unknown), number(length));
    let help = format!("count times from the start of the run, or raise `tolerance` to {:.0e}", unknown / length * 2.0);
    Some(Diagnostic::warning(codes::FAR_FROM_TIME_ZERO, message).at(simulation.span.clone(), text).help(help))
}

/// What a row may hold is decided together with what it holds: it cannot be made of accelerations and reactions of the same instant.
pub(super) fn refuse_solved_limit(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    layout: &Layout,
) -> Result<(), SessionError> {
    let Some(row) = equations.solved_limit(layout) else { return Ok(()) };
    let name = &model.elements[layout.element_of_row(row).0].name;
    let message =
        format!("what `{name}` may hold follows a signal made of accelerations or reactions of the same instant");
    let mut diagnostic = Diagnostic::error(codes::SIGNAL_LOOP, message);
    if let Some(record) = scene.elements.iter().find(|record| record.name.value == *name) {
        diagnostic = diagnostic.at(record.name.span.clone(), "its limit would depend on what it holds");
    }
    let help = "put a `sensor` with a time constant, or a transfer function, between";
    Err(SessionError::one(&scene.source, diagnostic.help(help)))
}

/// Elements that depend on reactions which redundant rows leave open.
pub(super) fn reaction_warnings(plan: &Plan, model: &Model, scene: &Scene) -> Vec<Diagnostic> {
    let warning = |open: &Undetermined| {
        let element = &model.elements[open.element];
        let record = scene.elements.iter().find(|record| record.name.value == element.name);
        let of = |joint: usize, torque| !plan.is_unique(joint, model.elements[joint].markers.len() - 1, torque, None);
        let joints = element.joints.iter().enumerate();
        let (place, cause) = joints
            .map(|(k, joint)| (k, *joint, of(*joint, false), of(*joint, true)))
            .find(|(.., force, torque)| *force || *torque)
            .map(|(k, joint, force, torque)| {
                let what = if force && torque { "force and torque" } else { ["torque", "force"][usize::from(force)] };
                let place = record.and_then(|record| record.joints.get(k)).map_or(0..0, |name| name.span.clone());
                (place, format!("redundant joint equations leave the {what} of `{}` open", model.elements[joint].name))
            })
            .unwrap_or_else(|| {
                let place = record.map_or(0..0, |record| record.name.span.clone());
                if element.release.is_some() {
                    return (place, "is released by a load that redundant joint equations leave open".into());
                }
                (place, "takes signals that redundant joint equations leave open".into())
            });
        let (open, then) = if open.load {
            ("the motion is not determined", "one of many motions is computed, and the run is `suspect`")
        } else {
            ("it reports one of many values", "the motion is determined, its channels are not")
        };
        let message = format!("`{}` depends on a reaction that is not unique: {open}", element.name);
        Diagnostic::warning(codes::REACTION_NOT_UNIQUE, message)
            .at(place, format!("{cause}; {then}"))
            .help("`odyn check` lists the redundant rows: free them with less restrictive joints")
    };
    plan.undetermined.iter().map(warning).collect()
}

/// Closed loops that cannot move, at the joint that is out of line.
pub(super) fn locked_warnings(plan: &Plan, model: &Model, scene: &Scene) -> Vec<Diagnostic> {
    let name = |joint: usize| model.elements[joint].name.as_str();
    let (unit, label) = (scene.units.factor(Dimension::ANGLE), scene.units.label(Dimension::ANGLE));
    let warning = |locked: &Locked| {
        let names = joints_named(locked.joints.iter().map(|joint| name(*joint)));
        let message = format!("the closed loop of {names} cannot move: its joints lock each other");
        let diagnostic = Diagnostic::warning(codes::LOCKED_LOOP, message);
        let Some(Askew { joint, other, slides, angle }) = locked.askew else {
            let no_axis = without_axis(&locked.joints, model, scene);
            let first = no_axis.first().copied().or_else(|| locked.joints.first().map(|joint| name(*joint)));
            let first = first.map_or(0..0, |joint| place_of_element(scene, joint));
            let help = if locked.geared {
                "around a loop of gears the ratios must multiply to one, with their signs: external wheels turn opposite ways; check teeth, \
                 ratios and what is held; leave it if it is not meant to turn"
            } else {
                "check the axes and points of these joints; leave it if it is meant as a structure"
            };
            return diagnostic.at(first, "together they leave no freedom").help_if(axis_left_out(&no_axis)).help(help);
        };
        let (angle, other) = (format!("{} {label}", significant(angle / unit, 3)), name(other));
        let text = match slides {
            false => format!("its axis is {angle} off that of `{other}`"),
            true => format!("it slides {angle} off the plane that the axis of `{other}` is normal to"),
        };
        diagnostic
            .at(place_of_element(scene, name(joint)), text)
            .help("axes of a planar mechanism must be parallel to nine digits: give all of them the same `axis`, or use joints that hold less, such as `cylindrical` and `spherical`")
            .help("leave it if it is meant as a structure")
    };
    plan.locked.iter().map(warning).collect()
}

/// Elements that act about or along axes which are not those of the joints beside them.
pub(super) fn crosswise_warnings(plan: &Plan, model: &Model, scene: &Scene) -> Vec<Diagnostic> {
    let (unit, label) = (scene.units.factor(Dimension::ANGLE), scene.units.label(Dimension::ANGLE));
    let warning = |one: &Crosswise| {
        let element = &model.elements[one.element];
        let [first, second] = one.frames.map(|frame| &element.class.frames[frame].name);
        let angle = format!("{} {label}", significant(one.angle / unit, 3));
        let message = format!("`{}` acts about or along another axis than its joint", element.name);
        let text = match one.joint.map(|joint| &model.elements[joint].name) {
            Some(joint) if one.slides => {
                format!("the z axis of its frame `{first}` is {angle} off where `{joint}` slides")
            }
            Some(joint) => format!("the z axis of its frame `{first}` is {angle} off the axis of `{joint}`"),
            None => format!("the z axes of its frames `{first}` and `{second}` are {angle} apart"),
        };
        Diagnostic::warning(codes::CROSSWISE, message)
            .at(place_of_element(scene, &element.name), text)
            .help("give it the `axis` of the joint; without one, its axis is z of the ground")
    };
    plan.crosswise.iter().map(warning).collect()
}

/// Joints in a sentence, the first of many.
fn joints_named<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = match names.len().saturating_sub(MOST_JOINTS) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    let shown: Vec<String> = names.take(MOST_JOINTS).map(|name| format!("`{name}`")).collect();
    shown.join(", ") + &more
}

/// Where an element's name is written.
pub(super) fn place_of_element(scene: &Scene, name: &str) -> std::ops::Range<usize> {
    let record = scene.elements.iter().find(|record| record.name.value == name);
    record.map_or(0..0, |record| record.name.span.clone())
}

/// Where a body's name is written.
pub(super) fn place_of_body(scene: &Scene, name: &str) -> std::ops::Range<usize> {
    scene.bodies.iter().find(|body| body.name.value == name).map_or(0..0, |body| body.name.span.clone())
}
