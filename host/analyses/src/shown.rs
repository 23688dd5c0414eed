//! What `odyn report` shows of each analysis: a sentence, tables, and for modes and equilibria the bodies in motion.

use nalgebra::{Complex, Quaternion, Vector3};

use crate::balance::{Balanced, size};
use crate::diagnostics::counted;
use crate::folder::{Moves, Page, Part, Shown};
use crate::inverse::Inverse;
use crate::kinematics::Kinematics;
use crate::linear::{Model, Port};
use crate::loads::{Attachment, Loads, Wrench};
use crate::model::rotation;
use crate::modes::{Modes, Share, Stability};
use crate::results::significant;
use crate::session::{Instant, Session, SessionError};
use crate::statics::{Equilibria, Held};

pub use crate::shown_fits::{fit, sensitivity};

/// Share of the largest below which a force is round-off, and shown as none.
const ROUND_OFF: f64 = 1e-13;
/// Digits for people.
const DIGITS: usize = 7;
/// Pictures of one period.
const PICTURES: usize = 60;
/// The largest displacement of a mode, as a share of what is shown.
const AMPLITUDE: f64 = 0.1;
/// Modes that are shown in motion.
const MOST_MOVING: usize = 40;
/// Bodies or elements that are named of a mode.
const NAMED: usize = 3;

pub(crate) fn number(value: f64) -> String {
    if value.is_finite() { significant(value, DIGITS) } else { String::new() }
}

pub(crate) fn words(list: &[&str]) -> Vec<String> {
    list.iter().map(|text| (*text).to_owned()).collect()
}

/// The bodies or elements with the largest shares.
#[must_use]
pub fn named(shares: &[Share]) -> String {
    let largest = shares.iter().take(NAMED).filter(|one| one.share.abs() >= 0.005);
    largest.map(|one| format!("{} {:.0} %", one.name, 100.0 * one.share)).collect::<Vec<_>>().join(", ")
}

/// Frequencies, damping and who takes part.
fn table_of_modes(modes: &Modes) -> Shown {
    let rows = modes.modes.iter().map(|mode| {
        let swings = mode.time_constant.is_none();
        let of = |value: f64| if swings { number(value) } else { String::new() };
        vec![
            mode.number.to_string(),
            of(mode.frequency),
            of(if mode.decided { mode.damping_ratio } else { 0.0 }),
            mode.time_constant.map_or_else(String::new, number),
            if mode.decided && mode.real > 0.0 { "grows".into() } else { String::new() },
            named(&mode.kinetic),
            named(&mode.potential),
        ]
    });
    Shown {
        title: "Modes".into(),
        head: words(&[
            "mode",
            "frequency [Hz]",
            "damping ratio",
            "time constant [s]",
            "",
            "kinetic energy",
            "potential energy of elements",
        ]),
        rows: rows.collect(),
    }
}

/// Poses of the frames of all bodies, displaced by a small motion.
fn poses(session: &Session, instant: &Instant, motion: &dyn Fn(usize) -> (Vector3<f64>, Vector3<f64>)) -> Vec<f64> {
    let layout = &session.plan.layout;
    let mut found = Vec::with_capacity(7 * layout.bodies);
    for (index, body) in session.model.bodies.iter().enumerate() {
        let at = |k: usize| instant.inputs[layout.body_slot(index, k)];
        let (shift, turn) = motion(index);
        let half = 0.5 * turn.norm();
        let share = if half > 0.0 { half.sin() / half } else { 1.0 };
        let by = Quaternion::from_parts(half.cos(), turn * (0.5 * share));
        let p = (by * Quaternion::new(at(3), at(4), at(5), at(6))).normalize();
        let p = [p.w, p.i, p.j, p.k];
        let origin = Vector3::new(at(0), at(1), at(2)) + shift - rotation(&p) * body.center_of_mass;
        found.extend(origin.iter().chain(&p));
    }
    found
}

/// Adds a period of each mode, one unit of time for each.
fn add_modes(session: &Session, instant: &Instant, modes: &Modes, moves: &mut Moves, before: &str) {
    let amplitude = AMPLITUDE * moves.header.length;
    for mode in modes.modes.iter().filter(|mode| !mode.shape.is_empty()).take(MOST_MOVING) {
        let from = moves.parts.last().map_or(0.0, |part| part.to);
        for picture in 0..=PICTURES {
            let share = picture as f64 / PICTURES as f64;
            let phase = Complex::from_polar(amplitude, std::f64::consts::TAU * share);
            let moved = |index: usize| {
                let shape = &mode.shape[index];
                let part =
                    |re: &[f64; 3], im: &[f64; 3]| Vector3::from_fn(|k, _| (Complex::new(re[k], im[k]) * phase).re);
                (part(&shape.displacement, &shape.displacement_imaginary), part(&shape.turn, &shape.turn_imaginary))
            };
            moves.records.push((from + share * (1.0 - 1e-9), poses(session, instant, &moved)));
        }
        let size = match mode.time_constant {
            None => format!("{} Hz", significant(mode.frequency, 4)),
            Some(value) => format!("time constant {} s", significant(value, 4)),
        };
        moves.parts.push(Part { name: format!("{before}mode {}: {size}", mode.number), from, to: from + 1.0 });
    }
}

/// Nothing yet.
fn moves(session: &Session) -> Result<Moves, SessionError> {
    let (mut header, _) = session.start_picture()?;
    // Loads are those of runs.
    header.loads.clear();
    Ok(Moves { header, records: Vec::new(), parts: Vec::new() })
}

/// Of modes: the bodies along a period of each.
///
/// # Errors
/// A mesh that cannot be read.
pub fn modes(session: &Session, instant: &Instant, modes: &Modes) -> Result<Page, SessionError> {
    let mut shown = moves(session)?;
    add_modes(session, instant, modes, &mut shown, "");
    let mut notes = modes.notes.clone();
    if modes.zeros > 0 {
        notes.push(format!(
            "{} eigenvalues are zero to within round-off: nothing drives back{}",
            modes.zeros,
            modes.neutral.iter().map(|one| format!("; {}: {}", one.words(), named(&one.bodies))).collect::<String>()
        ));
    }
    Ok(Page {
        analysis: "modes",
        words: format!(
            "{} coordinates at t = {} s: {}.",
            modes.coordinates,
            number(modes.time),
            modes.stability.words()
        ),
        good: modes.stability != Stability::Unstable,
        notes,
        tables: vec![table_of_modes(modes)],
        moves: (!shown.records.is_empty()).then_some(shown),
        ..Page::default()
    })
}

/// Of equilibria: the places, and the modes about each.
///
/// # Errors
/// A mesh that cannot be read.
pub fn statics(session: &Session, found: &Equilibria) -> Result<Page, SessionError> {
    let mut shown = moves(session)?;
    let mut page = Page { analysis: "statics", good: true, ..Page::default() };
    let rows = found.found.iter().enumerate().map(|(k, one)| {
        vec![
            (k + 1).to_string(),
            one.stability.words().into(),
            one.start.to_string(),
            one.steps.to_string(),
            significant(one.audit.balance, 2),
            format!("{:.1e}", one.audit.rows),
            one.closed.join(", "),
        ]
    });
    page.tables.push(Shown {
        title: "Equilibria".into(),
        head: words(&["", "stability", "start", "steps", "balance, of round-off's share", "joints", "closed contacts"]),
        rows: rows.collect(),
    });
    let first = found.found.first().map_or(&[][..], |one| &one.outputs);
    if !first.is_empty() {
        let mut head = words(&["output"]);
        head.extend((1..=found.found.len()).map(|k| format!("equilibrium {k}")));
        head.push("unit".into());
        let row = |k: usize| {
            let values = found.found.iter().map(|one| number(one.outputs[k].value));
            std::iter::once(first[k].name.clone()).chain(values).chain([first[k].unit.clone()]).collect()
        };
        page.tables.push(Shown { title: "Outputs".into(), head, rows: (0..first.len()).map(row).collect() });
    }
    let friction = found.found.iter().enumerate().flat_map(|(k, one)| {
        let row = move |held: &Held| {
            let holds = if held.holds { "holds" } else { "does not hold: taken as none" };
            vec![(k + 1).to_string(), held.name.clone(), number(100.0 * held.share), holds.into()]
        };
        one.friction.iter().map(row)
    });
    let (title, rows): (String, Vec<Vec<String>>) = ("Friction at rest".into(), friction.collect());
    if !rows.is_empty() {
        page.tables.push(Shown { title, head: words(&["equilibrium", "friction", "% of its limit", ""]), rows });
    }
    for (k, one) in found.found.iter().enumerate() {
        let from = shown.parts.last().map_or(0.0, |part| part.to);
        let still = poses(session, &one.instant, &|_| (Vector3::zeros(), Vector3::zeros()));
        shown.records.push((from, still.clone()));
        shown.records.push((from + (1.0 - 1e-9), still));
        let name = format!("equilibrium {}", k + 1);
        shown.parts.push(Part { name: name.clone(), from, to: from + 1.0 });
        add_modes(session, &one.instant, &one.modes, &mut shown, &format!("{name}, "));
        let mut table = table_of_modes(&one.modes);
        table.title = format!("Modes about equilibrium {}", k + 1);
        page.tables.push(table);
        page.notes.extend(one.modes.notes.iter().map(|note| format!("{name}: {note}")));
    }
    page.notes.extend(found.failed.iter().cloned());
    let unstable = found.found.iter().filter(|one| one.stability == Stability::Unstable).count();
    page.good = unstable < found.found.len();
    page.words = match (&found.found[..], unstable) {
        ([one], _) => format!("An equilibrium; {}.", one.stability.words()),
        (all, 0) => format!("{} equilibria from {} starts; none is unstable.", all.len(), found.starts),
        (all, _) => format!("{} equilibria from {} starts; {unstable} unstable.", all.len(), found.starts),
    };
    page.moves = Some(shown);
    Ok(page)
}

fn ports(title: &str, list: &[Port]) -> Shown {
    let rows = list.iter().map(|port| vec![port.name.clone(), number(port.value), port.unit.clone()]);
    Shown { title: title.into(), head: words(&["name", "value there", "unit"]), rows: rows.collect() }
}

fn matrix(title: &str, rows: &[Vec<f64>], names: &[String], columns: &[String]) -> Shown {
    let mut head = words(&[""]);
    head.extend(columns.iter().cloned());
    let row = |(name, row): (&String, &Vec<f64>)| {
        std::iter::once(name.clone()).chain(row.iter().map(|value| number(*value))).collect()
    };
    Shown { title: title.into(), head, rows: names.iter().zip(rows).map(row).collect() }
}

/// Of a linear model.
#[must_use]
pub fn linearise(model: &Model) -> Page {
    let names = |ports: &[Port]| ports.iter().map(|port| format!("{} [{}]", port.name, port.unit)).collect::<Vec<_>>();
    let (inputs, outputs) = (names(&model.inputs), names(&model.outputs));
    let rates: Vec<String> = model.states.iter().map(|state| format!("d/dt {state}")).collect();
    let mut tables = vec![ports("Inputs", &model.inputs), ports("Outputs", &model.outputs)];
    // Larger ones are in the files.
    if model.states.len() <= 12 {
        tables.push(matrix("A", &model.a, &rates, &model.states));
        tables.push(matrix("B", &model.b, &rates, &inputs));
        tables.push(matrix("C", &model.c, &outputs, &model.states));
        tables.push(matrix("D", &model.d, &outputs, &inputs));
    }
    tables.retain(|table| !table.rows.is_empty() && table.head.len() > 1);
    Page {
        analysis: "linearise",
        words: format!(
            "{}, {}, {} at t = {} s.",
            counted(model.states.len(), "state"),
            counted(inputs.len(), "input"),
            counted(outputs.len(), "output"),
            number(model.time)
        ),
        good: true,
        notes: model.notes.clone(),
        tables,
        ..Page::default()
    }
}

/// Of efforts: their sizes; the curves are those of the folder.
#[must_use]
pub fn inverse(found: &Inverse) -> Page {
    let rows = found.actuators.iter().zip(&found.efforts).map(|(port, values)| {
        let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let square = values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64;
        vec![port.name.clone(), number(least), number(most), number(square.sqrt()), port.unit.clone()]
    });
    Page {
        analysis: "inverse",
        words: format!(
            "Efforts of {} actuators for {} freedoms; loads balance to {:.1e}.",
            found.actuators.len(),
            found.freedoms,
            found.balance
        ),
        good: true,
        notes: found.notes.clone(),
        tables: vec![Shown {
            title: "Efforts".into(),
            head: words(&["actuator", "least", "largest", "root mean square", "unit"]),
            rows: rows.collect(),
        }],
        ..Page::default()
    }
}

/// Of a mechanism's motion; and the places of its rows, numbers along the path where what drives it turns back.
#[must_use]
pub fn kinematics(found: &Kinematics) -> (Page, Vec<f64>) {
    let ascends = found.places.windows(2).all(|pair| pair[0] < pair[1]);
    let mut page = page_of_kinematics(found);
    if ascends {
        // Times are written in s.
        let factor = page.over.as_ref().map_or(found.over.factor, |_| 1.0);
        return (page, found.places.iter().map(|place| place * factor).collect());
    }
    page.over = Some(Port { name: "place along the path".into(), unit: String::new(), factor: 1.0, value: 0.0 });
    (page, (1..=found.places.len()).map(|number| number as f64).collect())
}

fn page_of_kinematics(found: &Kinematics) -> Page {
    let over = &found.over;
    let extents = found.extents.iter().map(|one| {
        vec![
            one.name.clone(),
            number(one.values[0]),
            number(one.values[1]),
            one.unit.clone(),
            number(one.at[0]),
            number(one.at[1]),
        ]
    });
    let mut tables = vec![Shown {
        title: "Range of motion".into(),
        head: vec![
            String::new(),
            "least".into(),
            "largest".into(),
            "unit".into(),
            format!("least at {}", over.name),
            format!("largest at {}", over.name),
        ],
        rows: extents.collect(),
    }];
    if !found.dead_points.is_empty() {
        let mut head = words(&["turns back"]);
        head.extend(found.extents.iter().map(|one| format!("{} [{}]", one.name, one.unit)));
        let row = |dead: &crate::kinematics::DeadPoint| {
            std::iter::once(dead.of.clone()).chain(dead.values.iter().map(|value| number(*value))).collect()
        };
        let rows = found.dead_points.iter().map(row).collect();
        tables.push(Shown { title: "Dead points".into(), head, rows });
    }
    Page {
        analysis: "kinematics",
        words: format!("{} places over {} [{}].", found.places.len(), over.name, over.unit),
        good: true,
        notes: found.notes.clone(),
        tables,
        over: (over.name != "t").then(|| over.clone()),
        ..Page::default()
    }
}

/// Of shaking forces.
#[must_use]
pub fn balance(found: &Balanced) -> Page {
    let all = [&found.before, &found.predicted, &found.after];
    let rows = (0..found.before.harmonics.len()).map(|k| {
        let of = |moment: bool| {
            all.map(|one| {
                let harmonic = &one.harmonics[k];
                number(size(if moment { &harmonic.moment } else { &harmonic.force }))
            })
        };
        [vec![k.to_string()], of(false).to_vec(), of(true).to_vec()].concat()
    });
    let weight = &found.counterweight;
    let line = |what: &str, value: f64, unit: &str| vec![what.to_owned(), number(value), unit.to_owned()];
    let mut notes = Vec::new();
    if found.before.drift.abs() > 1e-3 {
        notes.push("the turning is not steady yet: harmonics are those of these turns; let the run last longer".into());
    }
    if weight.set.is_empty() {
        notes.push(format!("no counterweight on {} makes the force less", weight.body));
    }
    Page {
        analysis: "balance",
        words: format!(
            "The force on the ground without its mean: {} N before, {} N with the counterweight (root mean squares).",
            number(found.before.force_rms),
            number(found.after.force_rms)
        ),
        good: found.after.force_rms <= found.before.force_rms,
        notes,
        tables: vec![
            Shown {
                title: format!("Counterweight on {}", weight.body),
                head: words(&["", "", "unit"]),
                rows: vec![
                    line("mass", weight.mass, "kg"),
                    line("radius", weight.radius, "m"),
                    line("unbalance", weight.unbalance, "kg m"),
                    line("angle from the x axis of the joint's frame", weight.phase.to_degrees(), "deg"),
                ],
            },
            Shown {
                title: "Harmonics".into(),
                head: words(&[
                    "order",
                    "force before [N]",
                    "predicted",
                    "after",
                    "moment before [N m]",
                    "predicted",
                    "after",
                ]),
                rows: rows.collect(),
            },
        ],
        over: Some(Port { name: "angle".into(), unit: "deg".into(), factor: 1.0, value: 0.0 }),
        ..Page::default()
    }
}

/// The force on the ground over the turns that were looked at, deg from their beginning, whichever way they go, before and with the
/// counterweight: components that there are.
#[must_use]
pub fn shaking(found: &Balanced) -> (Vec<f64>, Vec<(Port, Vec<f64>)>) {
    let first = found.before.angles.first().copied().unwrap_or(0.0);
    let angles: Vec<f64> = found.before.angles.iter().map(|angle| (angle - first).abs().to_degrees()).collect();
    let all = [("before", &found.before), ("with the counterweight", &found.after)];
    let largest = all.iter().flat_map(|(_, one)| one.force.iter().flatten()).fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut curves = Vec::new();
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        if all.iter().all(|(_, one)| one.force.iter().all(|force| force[k].abs() <= ROUND_OFF * largest)) {
            continue;
        }
        for (when, one) in all {
            let port = Port { name: format!("F{axis} {when}"), unit: "N".into(), factor: 1.0, value: 0.0 };
            curves.push((port, one.force.iter().map(|force| force[k]).collect()));
        }
    }
    (angles, curves)
}

/// Of loads on a body.
#[must_use]
pub fn loads(found: &Loads) -> Page {
    let mut tables = Vec::new();
    for case in &found.cases {
        let wrenches = || case.wrenches.iter().chain([&case.inertia]);
        let most =
            |of: &dyn Fn(&Wrench) -> [f64; 3]| wrenches().flat_map(of).fold(0.0_f64, |most, part| most.max(part.abs()));
        let sizes = [most(&|wrench| wrench.force), most(&|wrench| wrench.moment)];
        let shown = |value: f64, size: f64| if value.abs() <= ROUND_OFF * size { "0".into() } else { number(value) };
        let row = |name: &str, force: &[f64; 3], moment: &[f64; 3]| {
            let forces = force.iter().map(|value| shown(*value, sizes[0]));
            let moments = moment.iter().map(|value| shown(*value, sizes[1]));
            std::iter::once(name.to_owned()).chain(forces).chain(moments).collect::<Vec<_>>()
        };
        // An element may hold a body at several of its frames.
        let name = |attachment: &Attachment| {
            let several = found.attachments.iter().filter(|one| one.element == attachment.element).count() > 1;
            let frame = if several { format!(", frame {}", attachment.frame) } else { String::new() };
            format!("{}{frame}", attachment.element)
        };
        let mut rows: Vec<Vec<String>> = (found.attachments.iter().zip(&case.wrenches))
            .map(|(attachment, wrench)| row(&name(attachment), &wrench.force, &wrench.moment))
            .collect();
        rows.push(row("weight", &case.weight, &[0.0; 3]));
        rows.push(row("inertia", &case.inertia.force, &case.inertia.moment));
        tables.push(Shown {
            title: format!("t = {} s: {}", number(case.time), case.why),
            head: words(&["", "Fx [N]", "Fy [N]", "Fz [N]", "Mx [N m]", "My [N m]", "Mz [N m]"]),
            rows,
        });
    }
    Page {
        analysis: "loads",
        words: format!(
            "Loads on {} in its own axes; {:.1e} of their sizes is left of their sum.",
            found.body,
            found.left()
        ),
        good: found.left() <= 1e-9,
        notes: found.notes.clone(),
        tables,
        ..Page::default()
    }
}
