//! [`Kinematics`]: where a mechanism goes, whatever its masses and forces.
//!
//! Three ways: over time, where the scene's own drivers determine the motion; over a range of a quantity that drives it, whose rate is
//! one, so that first derivatives of other quantities are their transmission ratios; or along all the motion of a mechanism with one
//! freedom. That path is followed by its tangent N, the motion that the joints leave free, so it passes the places where a quantity
//! stops and turns back: dy/dq N = 0. There y is at a limit, and would be dead as a driver: the Jacobian of joints and driver is
//! singular (Haug 1989, sec. 3.7).

mod path;

use nalgebra::DVector;
use serde::Serialize;

use crate::analysis::Function;
use crate::diagnostics::{Diagnostic, codes};
use crate::driven::{Driven, cannot, seen};
use crate::linear::{Port, refuse};
use crate::model::Quantity;
use crate::moves;
use crate::prescribed::{Derivatives, Wanted, amount, quantity};
use crate::results::significant;
use crate::scene::Dimension;
use crate::session::{Session, SessionError};
use path::{LEAST_STEP, NONE, Path, Place, SAME};

/// Step along the path: the largest displacement, in sizes of the scene, or turn, rad; cosine of the tangent's bend that shortens it.
const STEP: f64 = 0.03;
const BEND: f64 = 0.98;
/// Steps of a path at most, in each direction.
const MOST_STEPS: usize = 20_000;
/// Sizes of the scene, or turns, after which a path counts as without end.
const AWAY: f64 = 20.0;

/// What moves the mechanism.
#[derive(Debug, Clone)]
pub enum Drive {
    /// The scene's own drivers.
    Time,
    /// A quantity, from one value to another in so many places, SI.
    Over(Wanted, [f64; 2], usize),
    /// Along the whole motion; ratios are those to this quantity.
    Whole(Wanted),
}

impl Drive {
    /// `NAME`: the whole motion; `NAME=FROM:TO:COUNT`: a range of values, with units or in that of the quantity.
    ///
    /// # Errors
    /// A name that there is not, a text that is no range.
    pub fn read(session: &Session, text: &str) -> Result<Self, SessionError> {
        let (name, range) = match text.split_once('=') {
            Some((name, range)) => (name.trim(), Some(range)),
            None => (text.trim(), None),
        };
        let wanted = quantity(session, name)?;
        let Some(range) = range else { return Ok(Self::Whole(wanted)) };
        let parts: Vec<&str> = range.split(':').collect();
        let value = |text: &str| amount(text, wanted.dimension, wanted.factor);
        if let [from, to, count] = parts[..]
            && let (Some(from), Some(to)) = (value(from), value(to))
            && let Ok(count) = count.trim().parse::<usize>()
            && (2..=1_000_000).contains(&count)
            && from != to
        {
            return Ok(Self::Over(wanted, [from, to], count));
        }
        let message = format!("`--drive {text}` is no range of `{name}`");
        let help = "write NAME=FROM:TO:COUNT, such as \"crank.angle=0 deg:360 deg:361\", with two places or more";
        Err(refuse(session, Diagnostic::error(codes::UNKNOWN_WORD, message).help(help)).of_usage())
    }
}

/// The values that a quantity takes.
#[derive(Debug, Clone, Serialize)]
pub struct Extent {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Least and largest value.
    pub values: [f64; 2],
    /// Where that is: the drive's values, or times, in their unit.
    pub at: [f64; 2],
}

/// A place at which a quantity would not determine the motion as a driver.
#[derive(Debug, Clone, Serialize)]
pub struct DeadPoint {
    /// The quantity.
    pub of: String,
    /// All quantities there, in their units and order.
    pub values: Vec<f64>,
}

/// What a mechanism does.
#[derive(Debug, Clone, Serialize)]
pub struct Kinematics {
    /// What the rows stand for: time, or the drive.
    pub over: Port,
    /// Its values, in its unit.
    pub places: Vec<f64>,
    /// Quantities of positions; behind each, its first derivative (with a drive, its transmission ratio) as `name'`, and except along
    /// the whole motion its second as `name''`.
    pub columns: Vec<Port>,
    /// Their values, column by column, in their units; none (NaN) for ratios to a drive that stands still, at its dead points.
    pub values: Vec<Vec<f64>>,
    /// How far each quantity goes.
    pub extents: Vec<Extent>,
    /// Dead points, along the whole motion.
    pub dead_points: Vec<DeadPoint>,
    /// Along the whole motion: whether it comes back to its start without turning back.
    pub closed: bool,
    /// What has to be known about it.
    pub notes: Vec<String>,
}

/// Quantities of positions among the scene's outputs; the coordinates of its joints where it has none.
fn watched(session: &Session) -> Result<Vec<Wanted>, SessionError> {
    let (model, layout) = (&session.model, &session.plan.layout);
    let mut equations = session.equations.clone();
    let mut found = Vec::new();
    let of_places = |quantity: &Quantity| {
        matches!(quantity, Quantity::Point { .. } | Quantity::EulerParameter { .. } | Quantity::Coordinate { .. })
    };
    for channel in model.channels.iter().filter(|channel| of_places(&channel.quantity)) {
        if equations.prescribe(&channel.quantity, model, layout).is_some() {
            found.push(quantity(session, &channel.name)?);
        }
    }
    if found.is_empty() {
        for element in model.elements.iter().filter(|element| element.class.kind.word() == "joint") {
            for channel in &element.class.channels {
                let one = quantity(session, &format!("{}.{}", element.name, channel.name))?;
                if equations.prescribe(&one.quantity, model, layout).is_some() {
                    found.push(one);
                }
            }
        }
    }
    if found.is_empty() {
        let help = "add an [[output]] with the quantity `position` or `coordinate`";
        return Err(cannot(session, "the scene has no quantity of positions to follow".into(), help));
    }
    Ok(found)
}

/// Whether an enforced row depends on time.
fn moves_by_itself(session: &Session) -> bool {
    let equations = &session.equations;
    equations.enforced().any(|row| !equations.graph.is_zero(equations.rows[row].time))
}

/// The motion of a mechanism.
///
/// # Errors
/// Elements with a memory between steps; a motion that drivers do not determine; values that joints do not allow; dead points of the drive on the way.
pub fn kinematics(session: &Session, drive: &Drive, progress: &mut dyn FnMut(f64)) -> Result<Kinematics, SessionError> {
    let watched = watched(session)?;
    let by_itself = moves_by_itself(session);
    match drive {
        Drive::Time if !by_itself => {
            let help = "name what drives it: `--drive joint.channel`, or `--drive joint.channel=FROM:TO:COUNT`; or give the scene a driver";
            return Err(cannot(session, "no joint of the scene depends on time".into(), help));
        }
        Drive::Over(..) | Drive::Whole(_) if by_itself => {
            let help = "leave `--drive` out, or take the scene's driver away";
            return Err(cannot(session, "joints of the scene are driven over time already".into(), help));
        }
        _ => {}
    }
    let mut notes = Vec::new();
    if session.equations.enforced().any(|row| session.equations.rows[row].of_velocities)
        && !matches!(drive, Drive::Time)
    {
        let message =
            "rows on velocities (rolling, knife edges) determine no places: their motion is integrated".into();
        return Err(cannot(session, message, "look at a run"));
    }
    if !session.equations.frictions.is_empty() {
        notes.push("friction that could stick does not hold the mechanism here".into());
    }
    let mut found = match drive {
        Drive::Time => {
            let units = &session.scene.units;
            let times: Vec<f64> = session.scene.simulation.sample_times(units).iter().map(|time| time.si).collect();
            let dimension = Dimension::TIME;
            let over =
                Port { name: "t".into(), unit: units.label(dimension), factor: units.factor(dimension), value: 0.0 };
            prescribed(session, &[], &watched, over, &times, progress)?
        }
        Drive::Over(wanted, [from, to], count) => {
            let step = (to - from) / (*count).max(2).saturating_sub(1) as f64;
            let places: Vec<f64> = (0..(*count).max(2)).map(|k| from + k as f64 * step).collect();
            let over = Port { name: wanted.name.clone(), unit: wanted.unit.clone(), factor: wanted.factor, value: 0.0 };
            prescribed(session, std::slice::from_ref(wanted), &watched, over, &places, progress)?
        }
        Drive::Whole(wanted) => whole(session, wanted, &watched, progress)?,
    };
    found.notes.extend(notes);
    Ok(found)
}

/// A name with primes.
fn derived(wanted: &Wanted, over: &Port, order: usize) -> Port {
    let plain = over.unit.chars().all(char::is_alphanumeric);
    let by = if plain { over.unit.clone() } else { format!("({})", over.unit) };
    let unit = match order {
        0 => wanted.unit.clone(),
        1 => format!("{}/{by}", wanted.unit),
        _ => format!("{}/{by}^2", wanted.unit),
    };
    Port {
        name: format!("{}{}", wanted.name, "'".repeat(order)),
        unit,
        factor: wanted.factor / over.factor.powi(order as i32),
        value: 0.0,
    }
}

/// Over time, or over values of a drive in the place of the time.
fn prescribed(
    session: &Session,
    drive: &[Wanted],
    watched: &[Wanted],
    over: Port,
    places: &[f64],
    progress: &mut dyn FnMut(f64),
) -> Result<Kinematics, SessionError> {
    let mut driven = Driven::new(session, drive, watched, ("kinematics", false))?;
    let wish = |s: f64| -> Vec<Derivatives> { if drive.is_empty() { Vec::new() } else { vec![[s, 1.0, 0.0]] } };
    let (factor, unit) = (over.factor, over.unit.clone());
    let at = |place: f64, reason: &str| {
        let message = format!("at {} = {} {unit}: {reason}", over.name, significant(place / factor, 7));
        let help =
            "a shorter range ends before; `--drive NAME` alone follows the whole motion and finds its dead points";
        cannot(session, message, help)
    };
    // A drive that falls is followed as one that rises: the places in the other order.
    let backwards = places.len() > 1 && places[1] < places[0];
    let sign = if backwards { -1.0 } else { 1.0 };
    let along = |s: f64| -> Vec<Derivatives> {
        wish(sign * s).into_iter().map(|[value, slope, second]| [value, sign * slope, second]).collect()
    };
    let first = places[0];
    driven.begin(sign * first, &along(sign * first)).map_err(|reason| at(first, &reason))?;
    if let Some(motion) = driven.free().map_err(|reason| at(first, &reason))? {
        let message = format!("joints and drivers leave this free: {motion}");
        return Err(cannot(session, message, "drive it, too, or take a joint that holds it"));
    }
    let columns: Vec<Port> = watched.iter().flat_map(|one| (0..3).map(|order| derived(one, &over, order))).collect();
    let mut values = vec![Vec::with_capacity(places.len()); columns.len()];
    let mut passed = Passed::default();
    for (number, place) in places.iter().enumerate() {
        progress(number as f64 / places.len() as f64);
        let mut look = |driven: &mut Driven<'_>| {
            passed.look(driven, *place / factor)?;
            let e = driven.expansion()?;
            let orders = [e.value(Function::Rows), e.value(Function::Rates) * sign, -e.value(Function::Accelerations)];
            let held = driven.rows.held;
            Ok((0..watched.len()).flat_map(|k| orders.each_ref().map(|of| of[held + k])).collect())
        };
        let found: Result<Vec<f64>, String> = match number {
            0 => look(&mut driven),
            _ => seen(&mut driven, &|driven| driven, (sign * place, &along), &mut look),
        };
        // Where it has come to, which may be before the place that is asked for.
        let found = found.map_err(|reason| at(sign * driven.time(), &reason))?;
        for ((values, column), value) in values.iter_mut().zip(&columns).zip(found) {
            values.push(value / column.factor);
        }
    }
    let places: Vec<f64> = places.iter().map(|place| place / factor).collect();
    let extents = (0..watched.len()).map(|k| extent(&watched[k], &values[3 * k], &places)).collect();
    let mut notes = Vec::new();
    driven.say(None, &mut notes);
    passed.say(&driven, &over, &mut notes);
    Ok(Kinematics { over, places, columns, values, extents, dead_points: Vec::new(), closed: false, notes })
}

/// Contacts that a motion goes through: kinematics does not stop there.
#[derive(Default)]
struct Passed {
    /// Which, from where to where, and at how many places.
    contacts: Vec<(usize, [f64; 2], usize)>,
}

impl Passed {
    fn look(&mut self, driven: &mut Driven<'_>, place: f64) -> Result<(), String> {
        for contact in driven.beyond()? {
            match self.contacts.iter_mut().find(|one| one.0 == contact) {
                Some((_, range, count)) => (*range, *count) = ([range[0].min(place), range[1].max(place)], *count + 1),
                None => self.contacts.push((contact, [place; 2], 1)),
            }
        }
        Ok(())
    }

    fn say(&self, driven: &Driven<'_>, over: &Port, notes: &mut Vec<String>) {
        for (contact, [from, to], count) in &self.contacts {
            notes.push(format!(
                "the motion goes through `{}`, at {count} places between {} = {from} and {to} {}: what it stops is not seen here",
                driven.contact_name(*contact),
                over.name,
                over.unit
            ));
        }
    }
}

fn extent(wanted: &Wanted, values: &[f64], places: &[f64]) -> Extent {
    let mut found = Extent {
        name: wanted.name.clone(),
        unit: wanted.unit.clone(),
        values: [f64::INFINITY, f64::NEG_INFINITY],
        at: [f64::NAN; 2],
    };
    for (value, place) in values.iter().zip(places) {
        if *value < found.values[0] {
            (found.values[0], found.at[0]) = (*value, *place);
        }
        if *value > found.values[1] {
            (found.values[1], found.at[1]) = (*value, *place);
        }
    }
    found
}

/// Along all that the joints allow, from the start on.
fn whole(
    session: &Session,
    drive: &Wanted,
    watched: &[Wanted],
    progress: &mut dyn FnMut(f64),
) -> Result<Kinematics, SessionError> {
    let mut all = watched.to_vec();
    let own = all.iter().position(|one| one.name == drive.name).unwrap_or_else(|| {
        all.push(drive.clone());
        all.len() - 1
    });
    let driven = Driven::new(session, &[], &all, ("kinematics", false))?;
    let scales = DVector::from_element(driven.layout.velocities(), 1.0);
    let mut path = Path { driven, scales };
    let refused = |reason: String| {
        let help = "a mechanism with one freedom has a path; `odyn check` reports how many there are. Hold the others by joints";
        cannot(session, reason, help)
    };
    let layout = path.driven.layout.clone();
    moves::rest(&layout, &mut path.driven.inputs);
    path.driven.lean(1).map_err(refused)?;
    path.driven.correct(&[], 1.0).map_err(refused)?;
    let mut start = path.look(None).map_err(refused)?;
    if start.rates[own] < 0.0 {
        start.tangent = -start.tangent;
        start.rates.iter_mut().for_each(|rate| *rate = -*rate);
    }
    let (mut notes, mut dead): (Vec<String>, Vec<(usize, Place)>) = (Vec::new(), Vec::new());
    let mut places = vec![start.clone()];
    let mut closed = false;
    for direction in [1.0, -1.0] {
        let mut here = start.clone();
        let (mut step, mut far) = (STEP, 0.0_f64);
        let mut ahead = Vec::new();
        for _ in 0..MOST_STEPS {
            progress((far / (AWAY * 6.3)).min(1.0));
            let next = match path.step(&here, direction * step) {
                Ok(next) if path.cosine(&here.tangent, &next.tangent) >= BEND || step <= LEAST_STEP => next,
                Ok(_) => {
                    step *= 0.5;
                    continue;
                }
                Err(reason) if step <= LEAST_STEP => {
                    notes.push(format!(
                        "the path is followed no further than {} = {} {}: {reason}",
                        drive.name,
                        here.values[own] / drive.factor,
                        drive.unit
                    ));
                    break;
                }
                Err(_) => {
                    step *= 0.5;
                    continue;
                }
            };
            far += step;
            for k in 0..all.len() {
                if here.rates[k] * next.rates[k] < 0.0 && here.rates[k].abs().min(next.rates[k].abs()) > NONE {
                    dead.push((k, path.dead(&here, direction * step, k).map_err(refused)?));
                }
            }
            // Back at the start: this step goes past it.
            if far > 3.0 * STEP && path.apart(&next, &start) <= 1.5 * step {
                let past = path.towards(&next, &start) * direction <= 0.0;
                if past || path.apart(&next, &start) <= SAME {
                    ahead.push(path.back(&here, direction * step, &start).map_err(refused)?);
                    closed = true;
                    break;
                }
            }
            let gone = path.apart_translation(&next, &start);
            if gone > AWAY || far > AWAY * 6.3 {
                notes.push(format!("the motion has no end within {AWAY} sizes of the scene"));
                break;
            }
            ahead.push(next.clone());
            here = next;
            step = (2.0 * step).min(STEP);
        }
        if direction > 0.0 {
            places.extend(ahead);
        } else {
            ahead.reverse();
            ahead.append(&mut places);
            places = ahead;
        }
        if closed {
            break;
        }
    }
    path.add_met(&places, &mut dead);
    let over = Port { name: drive.name.clone(), unit: drive.unit.clone(), factor: drive.factor, value: 0.0 };
    let mut passed = Passed::default();
    for place in &places {
        path.driven.inputs.clone_from(&place.inputs);
        passed.look(&mut path.driven, place.values[own] / drive.factor).map_err(refused)?;
    }
    path.driven.say(None, &mut notes);
    passed.say(&path.driven, &over, &mut notes);
    if closed {
        notes.push("the mechanism comes back to its start: the path is a cycle".into());
    }
    Ok(described(drive, &all, own, &places, &dead, closed, notes))
}

fn described(
    drive: &Wanted,
    all: &[Wanted],
    own: usize,
    places: &[Place],
    dead: &[(usize, Place)],
    closed: bool,
    notes: Vec<String>,
) -> Kinematics {
    let over = Port { name: drive.name.clone(), unit: drive.unit.clone(), factor: drive.factor, value: 0.0 };
    let shown: Vec<usize> = (0..all.len()).filter(|k| *k != own || all.len() == 1).collect();
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for k in &shown {
        for order in 0..2 {
            let port = derived(&all[*k], &over, order);
            // Where the drive stops there is no ratio to it.
            let stops = |place: &Place| place.rates[own].abs() <= NONE;
            let of = |place: &Place| match order {
                0 => place.values[*k],
                _ if stops(place) => f64::NAN,
                _ => place.rates[*k] / place.rates[own],
            };
            values.push(places.iter().map(|place| of(place) / port.factor).collect());
            columns.push(port);
        }
    }
    let with_dead: Vec<&Place> = places.iter().chain(dead.iter().map(|(_, place)| place)).collect();
    let drives: Vec<f64> = with_dead.iter().map(|place| place.values[own] / drive.factor).collect();
    let extents = (0..all.len())
        .map(|k| {
            let own: Vec<f64> = with_dead.iter().map(|place| place.values[k] / all[k].factor).collect();
            extent(&all[k], &own, &drives)
        })
        .collect();
    let dead_points = dead
        .iter()
        .map(|(k, place)| DeadPoint {
            of: all[*k].name.clone(),
            values: all.iter().zip(&place.values).map(|(one, value)| value / one.factor).collect(),
        })
        .collect();
    Kinematics {
        places: places.iter().map(|place| place.values[own] / drive.factor).collect(),
        over,
        columns,
        values,
        extents,
        dead_points,
        closed,
        notes,
    }
}
