//! Velocities before time starts.

use std::collections::BTreeMap;

use nalgebra::Matrix6;

use super::*;
use crate::analysis::constraints::masses;
use crate::model::{Instance, mass_of_element};
use crate::plan::poses_of_bodies;

/// The velocities of least kinetic energy that meet the joints, and what the scene prescribes as far as they allow. `free` takes
/// what is chosen so, and the largest speed that is not.
#[expect(clippy::too_many_arguments, reason = "called once, where everything is at hand")]
pub(super) fn velocities(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    t: f64,
    state: &mut [f64],
    inputs: &mut [f64],
    length: f64,
    (chosen, given_speed): (&mut Vec<Chosen>, &mut f64),
) -> Result<Vec<VelocityMiss>, AssemblyError> {
    load(layout, t, state, inputs);
    let mut rows = Constraints::of_all(equations)?;
    rows.evaluate(inputs, &model.sets)?;
    let enforced = rows.rows.len();
    let mut pattern = rows.structure.jacobian.clone();
    let mut values = rows.jacobian().to_vec();
    let mut right: Vec<f64> = rows.rates_in_time().iter().map(|x| -x).collect();
    let mut asked: Vec<(usize, bool, usize, f64)> = Vec::new();
    for (index, body) in model.bodies.iter().enumerate() {
        let y = &state[BODY_STATES * index..BODY_STATES * index + 7];
        let a = rotation(&[y[3], y[4], y[5], y[6]]);
        // Velocity of the body frame's origin: v + A (omega' x (-c)) = v + A c~ omega'.
        let swept = a * skew(&body.center_of_mass);
        for k in 0..3 {
            let mut prescribe = |value: Option<f64>, entries: &[(usize, f64)], angular: bool| {
                let Some(value) = value else { return };
                let row = right.len();
                for (column, entry) in entries {
                    pattern.push((row, 6 * index + column));
                    values.push(*entry);
                }
                right.push(value);
                asked.push((index, angular, k, value));
            };
            let turning = [(3, swept[(k, 0)]), (4, swept[(k, 1)]), (5, swept[(k, 2)])];
            let mut entries = vec![(k, 1.0)];
            entries.extend(turning);
            prescribe(body.velocity[k], &entries, false);
            let turning = [(3, a[(k, 0)]), (4, a[(k, 1)]), (5, a[(k, 2)])];
            prescribe(body.angular_velocity[k], &turning, true);
        }
    }
    let count = right.len();
    let n = layout.velocities();
    if n as f64 * (count as f64).powi(2) > LIGHT
        && let Some(v) = as_asked(&rows, model, state)
    {
        set_velocities(state, &v);
        return Ok(Vec::new());
    }
    if right.iter().all(|rate| *rate == 0.0) {
        // Rest meets everything, and nothing has less kinetic energy.
        set_velocities(state, &vec![0.0; n]);
        return Ok(Vec::new());
    }
    let structure = KktStructure::new(n, count, rows.structure.mass.clone(), pattern).map_err(AnalysisError::from)?;
    // What is asked of a body is a cluster of its own.
    let mut clusters = clusters(layout, &rows.rows);
    clusters.rows.extend(asked.iter().map(|(body, ..)| model.elements.len() + body));
    let (mut v, mut multipliers) = (vec![0.0; n], vec![0.0; count]);
    // Gives the number of independent rows.
    let mut solve = |structure: &KktStructure, mass: &[f64], v: &mut [f64]| -> Result<usize, LinalgError> {
        let mut solver = SparseFirst::new(structure, &clusters, ASSEMBLY_RANK_TOLERANCE)?;
        solver.set_measure(&body_scales(model, length));
        solver.set_mass(mass)?;
        // The joints come first; what the scene asks for is met as far as they leave it open.
        solver.set_first_rows(&(0..enforced).collect::<Vec<_>>());
        let rank = solver.refactor(&values)?.rank;
        solver.solve(&vec![0.0; n], &right, v, &mut multipliers)?;
        Ok(rank)
    };
    let rank = solve(&structure, &mass_values(model), &mut v).map_err(AnalysisError::from)?;
    // What the joints and the scene determine does not depend on the metric: here all bodies and elements count differently.
    let uneven = (&structure.mass[..], uneven_metric(model.bodies.len(), length));
    let (pattern, uneven) = with_elements(uneven, (model, layout, state), |parts| 1.0 / size(parts, length));
    let uneven_structure = KktStructure { mass: pattern, ..structure.clone() };
    let mut other = None;
    if model.elements.iter().any(Instance::brings_kinetic) {
        let other = other.insert(vec![0.0; n]);
        solve(&uneven_structure, &uneven, other).map_err(AnalysisError::from)?;
        // It keeps its digits by the masses of bodies. Nothing in one of them may be something in the other.
        let pairs = [[&v[..], &other[..]], [&other[..], &v[..]]];
        if pairs.into_iter().any(|pair| !differing(model, state, pair, length).is_empty()) {
            // What elements lend to bodies stands for a part of it only, and they couple bodies.
            let own =
                (&structure.mass[..], masses(model.bodies.iter().map(|body| (body.own_mass(), body.own_inertia()))));
            let (mass, values) = with_elements(own, (model, layout, state), |_| 1.0);
            match solve(&KktStructure { mass, ..structure.clone() }, &values, &mut v) {
                // Bodies are too light beside the mass of elements: what these lend them counts.
                Err(LinalgError::NotPositiveDefinite { .. }) => {}
                found => {
                    found.map_err(AnalysisError::from)?;
                }
            }
        }
    }
    set_velocities(state, &v);
    let mut reached = vec![0.0; count];
    for ((row, column), value) in structure.jacobian.iter().zip(&values) {
        reached[*row] += value * v[*column];
    }
    // Rows that do not depend on time are met by rest, whatever else they are.
    let driven = rows.worst(rows.rates_in_time(), length).0;
    let off: Vec<f64> = (0..enforced).map(|row| reached[row] - right[row]).collect();
    let mut contradicting: Vec<(usize, f64)> = Vec::new();
    rows.violations(&off, length, |row, violation| {
        if violation > CONTRADICTION * driven {
            contradicting.push((row, violation));
        }
    });
    if driven > 0.0 && !contradicting.is_empty() {
        contradicting.sort_by(|a, b| b.1.total_cmp(&a.1));
        let measure = Measure::new(&rows);
        let places = contradicting.iter().filter_map(|(row, _)| rows.rows.iter().position(|one| one == row));
        let rows = places.map(|k| measure.gap(k, rows.rows[k], off[k], model, layout)).collect();
        return Err(AssemblyError::Contradiction { rows });
    }
    *given_speed = asked
        .iter()
        .map(|(_, angular, _, value)| if *angular { value * length } else { *value }.abs())
        .fold(driven, f64::max);
    // As many rows as velocities leave nothing open.
    if *given_speed > 0.0 && rank < n {
        let other = match other {
            Some(other) => other,
            None => {
                let mut other = vec![0.0; n];
                solve(&uneven_structure, &uneven, &mut other).map_err(AnalysisError::from)?;
                other
            }
        };
        *chosen = differing(model, state, [&v, &other], length);
    }
    let mut misses = Vec::new();
    for (row, (body, angular, component, given)) in asked.into_iter().enumerate() {
        let found = reached[enforced + row];
        let size = if angular { *given_speed / length } else { *given_speed };
        if (found - given).abs() > VELOCITY_MISS * size {
            let body = model.bodies[body].name.clone();
            misses.push(VelocityMiss { body, angular, component, given, found });
        }
    }
    Ok(misses)
}

/// Entries of a matrix, row and column, and their values.
type Entries = (Vec<(usize, usize)>, Vec<f64>);

/// Pattern and values of a metric of bodies with shares of the mass matrices of elements, which couple bodies. `share` is that of an
/// element, by its blocks.
fn with_elements(
    (pattern, own): (&[(usize, usize)], Vec<f64>),
    (model, layout, state): (&Model, &Layout, &[f64]),
    share: impl Fn(&[([usize; 2], Matrix6<f64>)]) -> f64,
) -> Entries {
    // By column and row, as patterns are sorted.
    let mut entries: BTreeMap<(usize, usize), f64> =
        pattern.iter().zip(own).map(|((row, column), value)| ((*column, *row), value)).collect();
    let (positions, rotations) = poses_of_bodies(state, layout.bodies);
    let place = |body: usize| (positions[body], rotations[body]);
    for (index, element) in model.elements.iter().enumerate().filter(|(_, element)| element.brings_kinetic()) {
        let states = layout.states_of(index);
        let parts = mass_of_element(element, &place, &state[BODY_STATES * layout.bodies..][states]);
        let share = share(&parts);
        for ([body, other], part) in parts {
            for (row, column) in (0..6).flat_map(|row| (0..6).map(move |column| (row, column))) {
                let place = (6 * other + column, 6 * body + row);
                if place.0 <= place.1 && part[(row, column)] != 0.0 {
                    *entries.entry(place).or_default() += share * part[(row, column)];
                }
            }
        }
    }
    entries.into_iter().map(|((column, row), value)| ((row, column), value)).unzip()
}

/// The largest entry of the mass matrix of an element, rotations taken on `length`.
fn size(parts: &[([usize; 2], Matrix6<f64>)], length: f64) -> f64 {
    let arm = |k: usize| if k < 3 { 1.0 } else { length };
    let entries = parts.iter().flat_map(|(_, part)| part.iter().enumerate());
    entries.fold(f64::MIN_POSITIVE, |most, (k, entry)| most.max(entry.abs() / (arm(k % 6) * arm(k / 6))))
}

/// A metric without masses in which every body counts differently, aligned as [`mass_values`].
fn uneven_metric(bodies: usize, length: f64) -> Vec<f64> {
    // Multiples of the golden ratio, modulo 1, fill an interval evenly (Knuth, TAOCP 3, 6.4).
    let weight = |k: usize| 1.0 + (0.618_033_988_749_895 * k as f64).fract();
    let mut values = Vec::with_capacity(9 * bodies);
    for body in 0..bodies {
        let turning = weight(2 * body + 1) * length * length;
        values.extend([weight(2 * body); 3]);
        values.extend([turning, 0.0, 0.0, turning, 0.0, turning]);
    }
    values
}

/// The velocities of origins and bodies that differ between two solutions, with their values in the first; none of zeros.
fn differing(model: &Model, state: &[f64], solutions: [&[f64]; 2], length: f64) -> Vec<Chosen> {
    let of_body = |v: &[f64], index: usize| -> [f64; 6] {
        let y = &state[BODY_STATES * index..];
        let a = rotation(&[y[3], y[4], y[5], y[6]]);
        let (center, spin) = (Vector3::from_column_slice(&v[..3]), Vector3::from_column_slice(&v[3..6]));
        let origin = center - a * spin.cross(&model.bodies[index].center_of_mass);
        let turning = a * spin;
        [origin.x, origin.y, origin.z, turning.x, turning.y, turning.z]
    };
    let pairs: Vec<[[f64; 6]; 2]> =
        (0..model.bodies.len()).map(|index| solutions.map(|v| of_body(&v[6 * index..6 * index + 6], index))).collect();
    let speed = |k: usize, value: f64| if k < 3 { value.abs() } else { value.abs() * length };
    let largest = pairs.iter().flat_map(|pair| pair.iter().flat_map(|v| v.iter().enumerate()));
    let largest = largest.fold(0.0_f64, |most, (k, value)| most.max(speed(k, *value)));
    let mut chosen = Vec::new();
    for (body, [v, other]) in model.bodies.iter().zip(&pairs) {
        for k in 0..6 {
            let is_open = speed(k, v[k] - other[k]) > OPEN * largest && speed(k, v[k]) > OPEN * largest;
            // A particle has no rotation to tell of.
            if is_open && !(k >= 3 && body.particle) {
                chosen.push(Chosen { body: body.name.clone(), angular: k >= 3, component: k % 3, value: v[k] });
            }
        }
    }
    chosen
}

fn set_velocities(state: &mut [f64], v: &[f64]) {
    for (y, v) in state.chunks_exact_mut(BODY_STATES).zip(v.chunks_exact(6)) {
        y[7..].copy_from_slice(v);
    }
}

/// The velocities that are asked for, with rest where nothing is, if that meets the joints: then nothing has to be solved, since
/// each body has the only velocity it may have, or the one without kinetic energy. `None` where it does not, or where a body's
/// velocity is given in part, or an element with kinetic energy couples one that is free to one that moves. `rows` are evaluated,
/// with their derivatives by time as function 0.
pub(in crate::analysis) fn as_asked(rows: &Constraints, model: &Model, state: &[f64]) -> Option<Vec<f64>> {
    let mut v = Vec::with_capacity(6 * model.bodies.len());
    for (body, y) in model.bodies.iter().zip(state.chunks_exact(BODY_STATES)) {
        let given: Vec<f64> = body.velocity.iter().chain(&body.angular_velocity).flatten().copied().collect();
        match given[..] {
            [] => v.extend([0.0; 6]),
            [x, y_, z, wx, wy, wz] => {
                let a = rotation(&[y[3], y[4], y[5], y[6]]);
                let spin = a.tr_mul(&Vector3::new(wx, wy, wz));
                let center = Vector3::new(x, y_, z) + a * spin.cross(&body.center_of_mass);
                v.extend(center.iter().chain(spin.iter()));
            }
            _ => return None,
        }
    }
    let is_free = |body: &usize| model.bodies[*body].velocity[0].is_none();
    let moves = |body: &usize| v[6 * body..6 * body + 6].iter().any(|v| *v != 0.0);
    let couples = |element: &Instance| {
        let bodies = || element.markers.iter().filter_map(|marker| marker.body);
        element.brings_kinetic() && bodies().any(|body| is_free(&body)) && bodies().any(|body| moves(&body))
    };
    if model.elements.iter().any(couples) {
        return None;
    }
    // Round-off of a component is that of the largest one of its kind.
    let mut largest = [0.0_f64; 2];
    v.iter().enumerate().for_each(|(k, v)| largest[k % 6 / 3] = largest[k % 6 / 3].max(v.abs()));
    let mut off = rows.rates_in_time().to_vec();
    let mut size: Vec<f64> = off.iter().map(|time| time.abs()).collect();
    for ((row, column), slope) in rows.structure.jacobian.iter().zip(rows.jacobian()) {
        off[*row] += slope * v[*column];
        size[*row] += slope.abs() * largest[column % 6 / 3];
    }
    off.iter().zip(&size).all(|(off, size)| off.abs() <= AS_ASKED * size).then_some(v)
}
