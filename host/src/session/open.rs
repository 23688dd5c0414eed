//! [`Session::open`]: everything before time starts.

use std::path::{Path, PathBuf};
use std::time::Instant;

use element_api::recording::Input;
use nalgebra::Matrix3;

use super::chain::Stretch;
use super::checkpoint::{Checkpoint, Origin};
use super::error::{Exit, SessionError};
use super::libraries::load_libraries;
use super::prune::{ALL_ROWS, MergedCase, PlanarCase, allowed, is_determined};
use super::restart::Restart;
use super::run::tolerance;
use crate::analysis::{
    self, Assembly, AssemblyError, Constraints, Gap, assemble, idle_axes, mass_values, sparse_engine,
};
use crate::catalog::{Catalog, LibraryInfo, Watchdog};
use crate::diagnostics::{Diagnostic, codes};
use crate::integrate::Methods;
use crate::linalg::KktSolver;
use crate::model::{Model, resolve, rotation};
use crate::plan::{Layout, Plan, Probe, Pruning, body_scales};
use crate::program::{Equations, Form, Writing};
use crate::results::significant;
use crate::scene::{AuditTolerance, Dimension, Override, Rejected, Scene, Spanned, read};

/// A scene with a body that assembly moves further than this share of the scene's size is refused.
const LARGEST_JUMP: f64 = 0.2;
/// Ratio of pivots below which constraints of full rank may be next to a singular position.
const NEAR: f64 = 0.01;
/// They are if the ratio is below this share of what it is where the motion goes.
const NEAR_SHARE: f64 = 0.5;
/// Numbers that results may have, all columns together: they stay in memory during the run, 8 bytes each.
const MOST_NUMBERS: usize = 100_000_000;

/// What the command line adds to a scene.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// `--set` texts, and options that stand for them.
    pub overrides: Vec<Override>,
    /// Files and folders of `--plugin`.
    pub plugins: Vec<PathBuf>,
    /// What the audit may find; the scene's own where absent.
    pub audit_tolerance: Option<AuditTolerance>,
    /// Folder for private copies of libraries; the user's cache folder where absent.
    pub library_copies: Option<PathBuf>,
    /// The methods of integration that scenes may ask for.
    pub methods: Methods,
    /// Threads for islands that run apart; 0 = as many as the machine has processors. Results do not depend on it.
    pub jobs: usize,
    /// Who watches the calls into libraries that are loaded.
    pub watchdog: Option<Watchdog>,
}

/// A scene ready to run.
pub struct Session {
    /// The scene as written.
    pub scene: Scene,
    /// What the user should know.
    pub warnings: Vec<Diagnostic>,
    /// Libraries in use.
    pub libraries: Vec<LibraryInfo>,
    /// The resolved scene.
    pub model: Model,
    /// The equations, in working coordinates.
    pub equations: Equations,
    /// What was decided.
    pub plan: Plan,
    /// The start.
    pub assembly: Assembly,
    /// Where the start is a singular position, or next to one: time and state of the place ahead where ranks were found.
    pub(super) ahead: Option<(f64, Assembly)>,
    /// Pivot ratio of the sparse engine at the start.
    pub(super) start_health: f64,
    pub(super) options: RunOptions,
    /// Where the elements come from, for the islands.
    pub(super) catalog: Catalog,
    /// Islands take steps of their own.
    pub(super) apart: bool,
    /// Private memories of opaque elements that the run goes on with: name and bytes.
    pub(super) memories: Vec<(String, Vec<u8>)>,
    /// Start of the scene, s, whatever the run goes on from.
    pub(super) opened_at: f64,
    /// The scene file and the options, where it was opened from a file.
    pub(super) origin: Option<Origin>,
    /// The state that the run goes on from, if it does.
    pub(super) gone_on_from: Option<Restart>,
    /// The checkpoint that the run is resumed from, if it is.
    pub(super) resumed_from: Option<Checkpoint>,
    /// The part of a run with checkpoints that comes next.
    pub(super) stretch: Option<Stretch>,
    /// Savings that are allowed.
    pub(super) pruning: Pruning,
    /// The time determines the motion: it is found, not integrated.
    pub(super) determined: bool,
    /// Bodies held together by joints without freedom as one, if there are any.
    pub(super) merged: Option<MergedCase>,
    /// The motion's plane, if one was found, with the equations of the merged bodies.
    pub(super) planar: Option<PlanarCase>,
    /// Reading, loading, resolving, s.
    pub load_time: f64,
    /// Writing the equations, planning, assembling, s.
    pub compile_time: f64,
}

impl Session {
    /// Time and state where ranks are found.
    pub(super) fn place_of_ranks(&self) -> (f64, &Assembly) {
        match &self.ahead {
            Some((t, place)) => (*t, place),
            None => (self.scene.simulation.t_start, &self.assembly),
        }
    }

    /// Reads a scene file and prepares everything.
    ///
    /// # Errors
    /// Mistakes in the scene, missing or broken libraries, joints that cannot be assembled.
    pub fn open(path: &Path, options: &RunOptions) -> Result<Self, SessionError> {
        let started = Instant::now();
        let (scene, mut warnings) = read(path, &options.overrides).map_err(|rejected| refused(*rejected))?;
        let catalog = load_libraries(&scene, path, options)?;
        warnings.extend(catalog.warnings().iter().cloned());
        let mut session = Self::prepare(scene, warnings, &catalog, options, None, started)?;
        session.origin = Some(Origin::new(path, options));
        Ok(session)
    }

    /// Prepares a scene with a catalog at hand.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn with_catalog(
        scene: Scene,
        warnings: Vec<Diagnostic>,
        catalog: &Catalog,
        options: &RunOptions,
    ) -> Result<Self, SessionError> {
        Self::prepare(scene, warnings, catalog, options, None, Instant::now())
    }

    /// Prepares a scene; `start` is its assembled state, where that is known.
    pub(super) fn prepare(
        scene: Scene,
        mut warnings: Vec<Diagnostic>,
        catalog: &Catalog,
        options: &RunOptions,
        start: Option<Assembly>,
        started: Instant,
    ) -> Result<Self, SessionError> {
        let pruning = allowed(&scene)?;
        let apart = apart(&scene)?;
        let (mut model, notes) = resolve(&scene, catalog).map_err(|diagnostics| {
            let plugin = diagnostics.iter().all(|d| !d.is_error() || d.code.starts_with("ODY04"));
            let exit = if plugin { Exit::Plugin } else { Exit::Scene };
            SessionError { exit, diagnostics, source: Box::new(scene.source.clone()) }
        })?;
        warnings.extend(notes);
        refuse_endless_results(&scene, &model)?;
        let load_time = started.elapsed().as_secs_f64();
        let compiling = Instant::now();
        let layout = Layout::new(&model);
        let mut equations = Equations::build(&model, &layout, Form::Working);
        equations.graph.writing = writing(&scene)?;
        let refuse = |error: AssemblyError| assembly_error(&error, &scene);
        let assembled = |equations: &Equations, model: &Model| match &start {
            Some(start) => Ok(start.clone()),
            None => assemble(equations, model, &layout, scene.simulation.t_start).map_err(refuse),
        };
        let mut assembly = assembled(&equations, &model)?;
        let idle = idle_axes(&equations, &model, &layout, scene.simulation.t_start, &assembly).map_err(refuse)?;
        if !idle.is_empty() {
            idle.iter().for_each(|(body, axis)| model.bodies[*body].calm(*axis));
            equations = Equations::build(&model, &layout, Form::Working);
            equations.graph.writing = writing(&scene)?;
            assembly = assembled(&equations, &model)?;
        }
        warnings.extend(assembly_warnings(&assembly, &scene)?);
        warnings.extend(super::started::warning(&assembly, &scene));
        warnings.extend(distance_warning(&assembly, &scene, &model));
        let mut start_health = 0.0;
        let t = scene.simulation.t_start;
        let mut plan = decide(&scene, &model, &equations, &layout, (t, &assembly), &mut start_health)?;
        let mut ahead = None;
        // Trees whose rows are beyond doubt have no ratio.
        let near = (f64::MIN_POSITIVE..NEAR).contains(&plan.health.smallest_pivot_ratio);
        if pruning.row_choice && (near || !plan.redundant_rows.is_empty()) {
            let duration = scene.simulation.t_end - t;
            ahead = analysis::ahead(&equations, &model, &layout, &assembly, t, duration)
                .map_err(|error| refuse(error.into()))?;
        }
        if let Some((t, place)) = &ahead {
            let mut health = 0.0;
            let other = decide(&scene, &model, &equations, &layout, (*t, place), &mut health)?;
            // In a singular position more rows depend on each other than where the motion goes; next to one they nearly do.
            let ratio = plan.health.smallest_pivot_ratio;
            let nearly =
                other.health.rank == plan.health.rank && ratio < NEAR_SHARE * other.health.smallest_pivot_ratio;
            if other.health.rank > plan.health.rank || nearly {
                (plan, start_health) = (other, health);
            } else {
                ahead = None;
            }
        }
        super::report::note_skips(&mut plan, &scene, &model, &equations);
        if !pruning.row_choice {
            plan.always_rank_safe = Some(ALL_ROWS.into());
        }
        let determined = is_determined(&scene, &model, &equations, &plan, pruning);
        super::report::note_determined(&mut plan, determined);
        warnings.extend(reaction_warnings(&plan, &model, &scene));
        let mut session = Self {
            warnings,
            libraries: catalog.libraries().cloned().collect(),
            model,
            equations,
            plan,
            assembly,
            ahead,
            start_health,
            pruning,
            determined,
            merged: None,
            planar: None,
            options: options.clone(),
            catalog: catalog.clone(),
            apart,
            memories: Vec::new(),
            opened_at: scene.simulation.t_start,
            origin: None,
            gone_on_from: None,
            resumed_from: None,
            stretch: None,
            load_time,
            compile_time: 0.0,
            scene,
        };
        // In the coordinates of joints, what lies across the plane of a planar mechanism folds away by itself.
        // Methods of second order take the equations as they are, in space.
        let whole = session.method_of_second_order()?.is_some();
        let wanted = session.pruning.planar || session.pruning.merged;
        if wanted && !whole && session.choose_tree()?.0.is_none() {
            session.merge_bodies()?;
            session.find_plane();
        }
        session.compile_time = compiling.elapsed().as_secs_f64();
        Ok(session)
    }
}

/// A scene that could not be read.
pub(super) fn refused(rejected: Rejected) -> SessionError {
    let unreadable = rejected.diagnostics.iter().any(|d| d.code == codes::UNREADABLE);
    SessionError {
        exit: if unreadable { Exit::Files } else { Exit::Scene },
        diagnostics: rejected.diagnostics,
        source: Box::new(rejected.source),
    }
}

/// The words for `kernels` of `[simulation]`.
pub(super) const KERNELS: [(&str, Writing); 3] =
    [("auto", Writing::Automatic), ("always", Writing::Kernels), ("never", Writing::Straight)];

/// The words for `islands` of `[simulation]`.
pub(super) const ISLANDS: [(&str, bool); 2] = [("together", false), ("apart", true)];

/// How programs are written, by `kernels` of `[simulation]`.
fn writing(scene: &Scene) -> Result<Writing, SessionError> {
    one_of("kernels", scene.simulation.kernels.as_ref(), &KERNELS, scene)
}

/// Whether islands take steps of their own, by `islands` of `[simulation]`.
fn apart(scene: &Scene) -> Result<bool, SessionError> {
    one_of("islands", scene.simulation.islands.as_ref(), &ISLANDS, scene)
}

/// Results that do not fit into memory are refused before anything is computed.
fn refuse_endless_results(scene: &Scene, model: &Model) -> Result<(), SessionError> {
    let (samples, columns) = (scene.simulation.sample_count(), model.channels.len() + 1);
    if samples.saturating_mul(columns) <= MOST_NUMBERS {
        return Ok(());
    }
    let message =
        format!("{samples} samples of {columns} columns are asked for, at most {MOST_NUMBERS:e} numbers are kept");
    let diagnostic =
        Diagnostic::error(codes::OUT_OF_RANGE, message).help("give a longer `output_step`, or fewer outputs");
    Err(SessionError::one(Exit::Scene, &scene.source, diagnostic))
}

/// What the word of a setting stands for; the first of all where none is given.
fn one_of<T: Copy>(
    key: &str,
    word: Option<&Spanned<String>>,
    known: &[(&str, T)],
    scene: &Scene,
) -> Result<T, SessionError> {
    let Some(word) = word else { return Ok(known[0].1) };
    if let Some((_, meant)) = known.iter().find(|(name, _)| *name == word.value) {
        return Ok(*meant);
    }
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("`{key}` cannot be `{}`", word.value))
        .at(word.span.clone(), "unknown")
        .help(format!("known are {}", names.join(", ")));
    Err(SessionError::one(Exit::Scene, &scene.source, diagnostic))
}

/// Decides what to compute, from the numbers at a time and assembled position.
pub(super) fn decide(
    scene: &Scene,
    model: &Model,
    equations: &Equations,
    layout: &Layout,
    (t, assembly): (f64, &Assembly),
    start_health: &mut f64,
) -> Result<Plan, SessionError> {
    let broken = |error: &dyn std::fmt::Display| {
        SessionError::one(
            Exit::Assembly,
            &scene.source,
            Diagnostic::error(codes::SINGULAR_MASS, format!("the equations of motion have no solution: {error}")),
        )
    };
    let all: Vec<usize> = (0..layout.rows).collect();
    let inputs = crate::analysis::start_inputs(layout, t, assembly);
    let mut rows = Constraints::new(equations, model, &all, &[], &[]).map_err(|e| broken(&e))?;
    rows.evaluate(&inputs, &model.sets).map_err(|e| broken(&e))?;
    let rotations: Vec<Matrix3<f64>> = (0..layout.bodies)
        .map(|body| {
            let y = &assembly.working[13 * body..];
            rotation(&[y[3], y[4], y[5], y[6]])
        })
        .collect();
    let mass = mass_values(model);
    let probe = Probe {
        structure: &rows.structure,
        mass: &mass,
        jacobian: rows.jacobian(),
        rotations: &rotations,
        length: assembly.scales.length,
        scales: &body_scales(model, assembly.scales.length),
    };
    Plan::decide(model, layout, &probe, |chosen, mass| {
        let mut solver = sparse_engine(equations, model, chosen, layout)?;
        solver.set_mass(mass)?;
        // The values of the chosen rows, picked from those of all.
        let entries = rows.structure.jacobian.iter().zip(rows.jacobian());
        let picked: Vec<f64> =
            entries.filter(|((row, _), _)| chosen.binary_search(row).is_ok()).map(|(_, value)| *value).collect();
        let health = solver.refactor(&picked)?;
        *start_health = health.smallest_pivot_ratio;
        Ok(health)
    })
    .map_err(|e| broken(&e))
}

/// Joints that are named where they contradict each other.
const MOST_JOINTS: usize = 12;

fn assembly_error(error: &AssemblyError, scene: &Scene) -> SessionError {
    match error {
        AssemblyError::Impossible { rows } => impossible(rows, scene),
        AssemblyError::Contradiction { rows } => contradiction(rows, scene),
        AssemblyError::Undefined { joint, row } => undefined(joint, row, scene),
        AssemblyError::Analysis(error) => {
            let diagnostic = Diagnostic::error(codes::CANNOT_ASSEMBLE, error.to_string());
            SessionError::one(Exit::Assembly, &scene.source, diagnostic)
        }
    }
}

/// A joint whose equation has no value where the bodies are.
fn undefined(joint: &str, row: &str, scene: &Scene) -> SessionError {
    let message = format!("`{joint}` is not defined where its bodies are");
    let mut diagnostic = Diagnostic::error(codes::CANNOT_ASSEMBLE, message);
    if let Some(record) = scene.elements.iter().find(|record| record.name.value == joint) {
        diagnostic = diagnostic.at(record.name.span.clone(), format!("row `{row}` or its derivative is not finite"));
        let kind = &record.type_name.value;
        diagnostic = diagnostic.help(format!("`odyn elements describe {kind}` tells where it is singular"));
    }
    let diagnostic = diagnostic
        .help("check positions, points and axes, of this joint and of those that pull its bodies there: without `point` or `frames`, a joint connects the origins of its bodies");
    SessionError::one(Exit::Assembly, &scene.source, diagnostic)
}

/// Joints that no position meets, each with the rows that contradict others.
fn impossible(gaps: &[Gap], scene: &Scene) -> SessionError {
    let size = |gap: &Gap| {
        let dimension = if gap.angular { Dimension::ANGLE } else { Dimension::LENGTH };
        format!("{} {}", significant(gap.size / scene.units.factor(dimension), 4), scene.units.label(dimension))
    };
    // Worst first, and so are the joints.
    let mut joints: Vec<(&str, Vec<String>)> = Vec::new();
    for gap in gaps {
        let text = format!("row `{}` misses by {}", gap.row, size(gap));
        match joints.iter_mut().find(|(joint, _)| *joint == gap.joint) {
            Some((_, texts)) => texts.push(text),
            None => joints.push((&gap.joint, vec![text])),
        }
    }
    let names: Vec<String> = joints.iter().take(MOST_JOINTS).map(|(joint, _)| format!("`{joint}`")).collect();
    let more = match joints.len().saturating_sub(MOST_JOINTS) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    let verb = if joints.len() == 1 { "cannot be met" } else { "contradict each other" };
    let message = format!("the joints cannot be assembled: {}{more} {verb}", names.join(", "));
    let mut diagnostic = Diagnostic::error(codes::CANNOT_ASSEMBLE, message);
    for (k, (joint, texts)) in joints.iter().take(MOST_JOINTS).enumerate() {
        let Some(record) = scene.elements.iter().find(|record| record.name.value == *joint) else { continue };
        let (span, text) = (record.name.span.clone(), texts.join(", "));
        diagnostic = if k == 0 { diagnostic.at(span, text) } else { diagnostic.context(span, text) };
    }
    let diagnostic = diagnostic
        .help("the gaps are those where the bodies miss least; other joints are not part of the conflict")
        .help("check lengths, points and axes of the joints named, or take one of them away; positions may be rough");
    SessionError::one(Exit::Assembly, &scene.source, diagnostic)
}

/// Joints whose velocities cannot all be had.
fn contradiction(rows: &[(String, f64)], scene: &Scene) -> SessionError {
    let unit = scene.units.factor(Dimension::VELOCITY);
    let label = scene.units.label(Dimension::VELOCITY);
    let message = "the joints ask for velocities that contradict each other";
    let mut diagnostic = Diagnostic::error(codes::CONFLICTING_CONSTRAINTS, message);
    let mut seen: Vec<&str> = Vec::new();
    for (name, off) in rows {
        let joint = name.split(':').next().unwrap_or(name);
        if seen.contains(&joint) || seen.len() == 6 {
            continue;
        }
        let Some(record) = scene.elements.iter().find(|record| record.name.value == joint) else { continue };
        let row = name.split(": ").nth(1).unwrap_or(name);
        let text = format!("row `{row}` stays off by {} {label}", significant(off / unit, 4));
        diagnostic = if seen.is_empty() {
            diagnostic.at(record.name.span.clone(), text)
        } else {
            diagnostic.context(record.name.span.clone(), text)
        };
        seen.push(joint);
    }
    let diagnostic = diagnostic
        .help("at this position, what is driven cannot move as it is told without breaking another joint")
        .help("take one of them away, or drive what the others leave free");
    SessionError::one(Exit::Assembly, &scene.source, diagnostic)
}

/// What assembly had to change; an error when a body jumped.
fn assembly_warnings(assembly: &Assembly, scene: &Scene) -> Result<Vec<Diagnostic>, SessionError> {
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
        if share > LARGEST_JUMP {
            let diagnostic = Diagnostic::error(
                codes::ASSEMBLY_JUMP,
                format!("assembly would move `{}` far from where the scene puts it", moved.body),
            )
            .at(span, text)
            .help(
                "give positions and orientations nearer to an assembled state, or correct the joint that pulls it away",
            );
            return Err(SessionError::one(Exit::Assembly, &scene.source, diagnostic));
        }
        warnings.push(
            Diagnostic::warning(codes::ASSEMBLY_JUMP, format!("`{}` was not where its joints need it", moved.body))
                .at(span, text),
        );
    }
    for miss in &assembly.velocity_misses {
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

/// The body furthest from the origin, if its position is known less exactly than the tolerance asks for.
fn distance_warning(assembly: &Assembly, scene: &Scene, model: &Model) -> Option<Diagnostic> {
    let norm = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>().sqrt();
    let distances = assembly.working.chunks_exact(13).map(|y| norm(&y[..3]));
    let (distance, body) = distances.zip(&model.bodies).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let tolerance = tolerance(scene);
    let (length, unknown) = (assembly.scales.length, distance * f64::EPSILON);
    if unknown <= tolerance * length {
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

/// Elements that depend on reactions which redundant rows leave open.
fn reaction_warnings(plan: &Plan, model: &Model, scene: &Scene) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for element in &model.elements {
        for (k, joint) in element.joints.iter().enumerate() {
            let last = model.elements[*joint].markers.len() - 1;
            let open = |torque: bool| {
                let used = |input: Input| match input {
                    Input::ReactionForce { joint, .. } => !torque && joint as usize == k,
                    Input::ReactionTorque { joint, .. } => torque && joint as usize == k,
                    _ => false,
                };
                !plan.is_unique(*joint, last, torque, None) && element.uses_input(used)
            };
            let what = match (open(false), open(true)) {
                (false, false) => continue,
                (true, false) => "force",
                (false, true) => "torque",
                (true, true) => "force and torque",
            };
            let record = scene.elements.iter().find(|record| record.name.value == element.name);
            let place = record.and_then(|record| record.joints.get(k)).map_or(0..0, |name| name.span.clone());
            let joint = &model.elements[*joint].name;
            let message = format!("`{}` depends on the reaction of `{joint}`, which is not unique", element.name);
            warnings.push(
                Diagnostic::warning(codes::REACTION_NOT_UNIQUE, message)
                    .at(place, format!("redundant joint equations leave its {what} open; one of many is used"))
                    .help("`odyn check` lists the redundant rows: free them with less restrictive joints"),
            );
        }
    }
    warnings
}

/// Where a body's name is written.
pub(super) fn place_of_body(scene: &Scene, name: &str) -> std::ops::Range<usize> {
    scene.bodies.iter().find(|body| body.name.value == name).map_or(0..0, |body| body.name.span.clone())
}
