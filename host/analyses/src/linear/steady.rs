//! How fast a linear model changes along the motion that it is of, and the axes in which it changes least.
//!
//! Eigenvalues say what becomes of small changes where the model stays the same while the scene moves: in axes of the ground, as those
//! of rotors about axes of symmetry and of what travels straight on, or in axes that turn, where the scene turns as one (a relative
//! equilibrium: Marsden, "Lectures on Mechanics", 1992, ch. 4), as a governor, a rotor with blades, a satellite on its orbit or a
//! vehicle in a steady bend. So it is made once more at some later times, where a run from here takes the scene, and compared, whatever
//! bases the two have: with S displacements and velocities of all bodies by states, in these axes, S1 P = S0 has a solution P, and
//! D = A0 - P^-1 A1 P is nothing.
//!
//! What D does is seen mode by mode: (l + e - A0)^-1 D x says by how much it moves an eigenvalue l and turns its vector x, first order,
//! with an e beside l that is a share of it, so that equal eigenvalues are no matter (the resolvent on a contour about l: Kato,
//! "Perturbation Theory for Linear Operators", 1966, ch. 2). Changes of stiff directions, which soft modes follow, so count for what they
//! are.

use nalgebra::{Complex, DMatrix, DVector, Matrix3, Rotation3, Vector3};

use super::{Linear, SLOW, reduce};
use crate::analysis::Local;
use crate::eigen::{ComplexVector, Spectrum, spectrum};
use crate::energies::complex;
use crate::linalg::{DEFAULT_RANK_TOLERANCE, PivotedQr};
use crate::plan::Layout;
use crate::session::Instant;

/// The first look ahead: share of a radian that the fastest motion turns by, displacements in sizes of the scene.
const FIRST: f64 = 0.02;
/// The last one: share of a radian of the slowest mode.
const LAST: f64 = 0.3;
/// Looks are no further apart than by this factor, unless there would be more of them than that.
const APART: f64 = 20.0;
const MOST_LOOKS: usize = 5;
/// Modes are compared over no less than this share of a radian, if there is a look so far ahead.
const LEAST: f64 = 1e-4;
/// Slowest modes that are compared, and directions that nothing drives back: of large models as many as can be factored in about a second.
const MOST_COMPARED: usize = 32;
const WORK: usize = 100_000_000;
/// Changes below this are round-off.
const NONE: f64 = 1e-8;
/// The same of sums of rates, as a share of their terms.
const ROUND_OFF: f64 = 4e-15;
/// Multiples of what round-off may have moved an eigenvalue by.
const MARGIN: f64 = 4.0;
/// How far beside an eigenvalue its changes are looked at, as a share of it.
const BESIDE: f64 = 0.3;
/// What changes in axes of the ground may change by this share of it in others that are better.
const BETTER: f64 = 1e-2;
/// Share of its size by which the motion of a body may be another than with axes that are worth a look.
const NEARLY: f64 = 3e-2;
/// Share of the fastest below which a motion is none.
const NO_MOTION: f64 = 1e-9;
/// Share of the largest below which a direction of the turning is not determined by how bodies move.
const DETERMINED: f64 = 1e-6;
/// Angular velocities of axes that are looked at.
const MOST_AXES: usize = 8;

/// Axes, and the model in them.
#[derive(Default)]
pub(super) struct Axes {
    /// Their angular velocity, rad/s.
    pub(super) turning: Vector3<f64>,
    /// Rates of states by states in them, where they turn.
    pub(super) turned: Option<DMatrix<f64>>,
    /// The eigenvalues in axes of the ground, where they are known.
    pub(super) of_ground: Option<Spectrum>,
    /// The largest change of a mode, on its size, while it turns by one radian.
    pub(super) unsteadiness: f64,
}

/// The scene a time later, of which the last that is asked for is known; `None` where a run does not get there.
pub(super) type Later<'a> = dyn FnMut(f64, f64) -> Option<Instant> + 'a;

impl Linear {
    /// Rates of states by states that are seen in axes with this angular velocity W: less W x (delta x, delta v).
    fn in_axes(&self, turning: Vector3<f64>) -> DMatrix<f64> {
        let (mut a, mut first) = (self.a.clone(), 0);
        if turning == Vector3::zeros() {
            return a;
        }
        for (components, of) in self.components.iter().zip([&self.positions, &self.velocities]) {
            let mut with_axes = of.clone();
            for at in (0..of.nrows()).step_by(3) {
                with_axes.rows_mut(at, 3).copy_from(&(turning.cross_matrix() * of.rows(at, 3)));
            }
            let mut rates = a.rows_mut(first, components.nrows());
            rates -= components * with_axes;
            first += components.nrows();
        }
        a
    }
}

/// The axes in which a model changes least, at an instant of a scene of a size, m. Those of the ground where it stays the same in them.
pub(super) fn axes(
    here: &Linear,
    instant: &Instant,
    local: &mut Local,
    (layout, length): (&Layout, f64),
    later: &mut Later<'_>,
) -> Axes {
    if here.a.is_empty() {
        return Axes::default();
    }
    let unknown = Axes { unsteadiness: f64::INFINITY, ..Axes::default() };
    let motions = motions(&instant.inputs, layout, length);
    let fastest = motions.iter().map(|motion| motion.speed(length) / length).fold(0.0, f64::max);
    let Some(ground) = Frame::new(here, Vector3::zeros()) else { return unknown };
    let mut looks: Vec<(f64, Linear)> = Vec::new();
    let times = times(&ground.spectrum, fastest);
    for time in &times {
        let Some(there) = later(*time, times[times.len() - 1]) else { break };
        // Contacts that open or close on the way are another matter.
        let expansion = if there.closed == instant.closed { local.at(&there.inputs).ok() } else { None };
        let Some(there) = expansion.and_then(|expansion| reduce(&expansion).ok()) else { break };
        looks.push((*time, there));
    }
    if looks.is_empty() {
        return Axes { of_ground: Some(ground.spectrum), ..unknown };
    }
    let change = |frame: &Frame<'_>| frame.change(&looks, fastest, length);
    let mut best = Axes { unsteadiness: change(&ground), ..Axes::default() };
    for turning in turnings(&motions, fastest, length) {
        if best.unsteadiness == 0.0 {
            break;
        }
        let Some(frame) = Frame::new(here, turning) else { continue };
        let unsteadiness = change(&frame);
        if unsteadiness <= SLOW && unsteadiness < BETTER * best.unsteadiness {
            best = Axes { turning, turned: Some(frame.a), unsteadiness, of_ground: None };
        }
    }
    best.of_ground = Some(ground.spectrum);
    best
}

/// How far ahead models are compared, s, ascending: from what moves fastest to the slowest mode.
fn times(modes: &Spectrum, fastest: f64) -> Vec<f64> {
    let sizes = || modes.pairs.iter().filter(|pair| pair.value.norm() > MARGIN * pair.uncertainty);
    let slowest = sizes().map(|pair| pair.value.norm()).fold(f64::INFINITY, f64::min);
    let quickest = if fastest > 0.0 { fastest } else { sizes().map(|pair| pair.value.norm()).fold(0.0, f64::max) };
    let last = if slowest.is_finite() { LAST / slowest } else { LAST / quickest };
    let first = (FIRST / quickest).min(last);
    if !(first.is_finite() && last.is_finite() && first > 0.0) {
        return Vec::new();
    }
    let looks = ((last / first).ln() / APART.ln()).ceil().clamp(1.0, MOST_LOOKS as f64 - 1.0);
    (0..=looks as usize).map(|k| first * (last / first).powf(k as f64 / looks)).collect()
}

/// A model in axes, with its modes.
struct Frame<'l> {
    here: &'l Linear,
    turning: Vector3<f64>,
    a: DMatrix<f64>,
    spectrum: Spectrum,
}

/// What a model becomes on the way, as seen in axes.
struct Change {
    /// A0 - P^-1 A1 P.
    rates: DMatrix<f64>,
    /// Its terms.
    terms: DMatrix<f64>,
    /// Displacements and velocities that cannot be said in the other's states, by states.
    left: [DMatrix<f64>; 2],
}

impl<'l> Frame<'l> {
    fn new(here: &'l Linear, turning: Vector3<f64>) -> Option<Self> {
        let a = here.in_axes(turning);
        Some(Self { here, turning, spectrum: spectrum(&a)?, a })
    }

    /// The largest change of a mode, on its size, while it turns by one radian; of what is no mode, while the scene turns by one.
    fn change(&self, looks: &[(f64, Linear)], fastest: f64, length: f64) -> f64 {
        let changes = looks.iter().map(|(time, there)| Some((*time, self.until(there, *time, length)?)));
        let Some(changes) = changes.collect::<Option<Vec<_>>>() else { return f64::INFINITY };
        let n = self.a.nrows();
        let most = (WORK / (n * n * n)).clamp(2, MOST_COMPARED);
        let mut largest = 0.0_f64;
        for pair in self.spectrum.pairs.iter().take(most) {
            let displacements = complex(&self.here.positions, &pair.vector);
            let open = MARGIN * (pair.uncertainty + self.here.open(pair, &displacements)) / pair.value.norm();
            largest =
                largest.max(self.of_vectors(&changes, (pair.value, pair.value.norm()), &[&pair.vector], open, length));
        }
        if fastest > 0.0 {
            let free = self.free();
            let free: Vec<&ComplexVector> = free.iter().collect();
            largest = largest.max(self.of_vectors(&changes, (Complex::ZERO, fastest), &free, 0.0, length));
        }
        largest
    }

    /// Displacements that nothing drives back, and velocities along them.
    fn free(&self) -> Vec<ComplexVector> {
        let (p, rates) = (self.here.coordinates, self.a.nrows() - self.here.coordinates - self.here.element_states);
        let mut found: Vec<DVector<f64>> = Vec::new();
        for null in self.spectrum.null.column_iter().take(MOST_COMPARED) {
            found.push(null.into_owned());
            if p == rates {
                let mut velocity = DVector::zeros(self.a.nrows());
                velocity.rows_mut(p, p).copy_from(&null.rows(0, p));
                found.push(velocity);
            }
        }
        found.retain(|vector| vector.norm() > 0.0);
        found.iter().map(|vector| vector.map(Complex::from)).collect()
    }

    /// The largest of what changes do to vectors of an eigenvalue of a size, 1/s, on its size and a radian of it; `open`: what round-off
    /// leaves open of it.
    fn of_vectors(
        &self,
        changes: &[(f64, Change)],
        (value, size): (Complex<f64>, f64),
        vectors: &[&ComplexVector],
        open: f64,
        length: f64,
    ) -> f64 {
        let n = self.a.nrows();
        let beside = value + BESIDE * size;
        let shifted = DMatrix::from_fn(n, n, |row, column| {
            let own = if row == column { beside } else { Complex::ZERO };
            own - self.a[(row, column)]
        });
        let factored = shifted.lu();
        let parts =
            |states: &ComplexVector| [&self.here.positions, &self.here.velocities].map(|of| complex(of, states));
        let norm = |states: &ComplexVector| self.size(&parts(states), states, size, length);
        let longest = changes.iter().map(|(time, _)| *time).fold(0.0, f64::max);
        let mut largest = 0.0_f64;
        for (time, change) in changes.iter().filter(|(time, _)| size * time >= LEAST || *time == longest) {
            for vector in vectors {
                let whole = norm(vector);
                let answer = |rates: &ComplexVector| factored.solve(rates).map_or(f64::INFINITY, |z| norm(&z) / whole);
                let sizes = &change.terms * vector.map(|entry| entry.norm());
                let signed = |k: usize| if k * 7919 % 101 < 50 { -ROUND_OFF } else { ROUND_OFF };
                let none = answer(&ComplexVector::from_fn(n, |k, _| Complex::from(sizes[k] * signed(k))));
                let left = change.left.each_ref().map(|of| complex(of, vector));
                let unsaid = self.size(&left, &ComplexVector::zeros(n), size, length) / whole;
                let found = answer(&complex(&change.rates, vector)).max(unsaid) - open / BESIDE - MARGIN * none;
                largest = largest.max(if found > NONE { found / (size * time) } else { 0.0 });
            }
        }
        largest
    }

    /// The size of displacements and velocities of bodies, m: turns on the size of the scene, velocities in the time of a rate. Of states
    /// alone where no body moves.
    fn size(&self, [x, v]: &[ComplexVector; 2], states: &ComplexVector, rate: f64, length: f64) -> f64 {
        let norm = |of: &ComplexVector| {
            let parts = of.iter().enumerate();
            parts.map(|(k, entry)| entry.norm_sqr() * if k % 6 < 3 { 1.0 } else { length * length }).sum::<f64>()
        };
        let moved = (norm(x) + norm(v) / (rate * rate)).sqrt();
        let own = states.rows(states.len() - self.here.element_states, self.here.element_states).norm();
        if moved > 0.0 || own == 0.0 { moved } else { own }
    }

    /// What a model becomes until a later one; `None` where they have other states.
    fn until(&self, there: &Linear, time: f64, length: f64) -> Option<Change> {
        let (n, p, s) = (self.a.nrows(), self.here.coordinates, self.here.element_states);
        if (there.a.nrows(), there.coordinates) != (n, p) {
            return None;
        }
        let back = Rotation3::new(-self.turning * time);
        let seen = |of: &DMatrix<f64>, turn: &Rotation3<f64>| {
            let mut seen = of.clone();
            for at in (0..of.nrows()).step_by(3) {
                let turned = turn.matrix() * of.rows(at, 3) * if at % 6 == 3 { length } else { 1.0 };
                seen.rows_mut(at, 3).copy_from(&turned);
            }
            seen
        };
        let here = [&self.here.positions, &self.here.velocities].map(|of| seen(of, &Rotation3::identity()));
        let then = [&there.positions, &there.velocities].map(|of| seen(of, &back));
        let mut by = DMatrix::zeros(n, n);
        by.view_mut((n - s, n - s), (s, s)).fill_with_identity();
        // Coordinates from displacements, then their rates from velocities.
        for (of, range) in [(0, 0..p), (1, p..n - s)] {
            let right = &here[of] - &then[of] * &by;
            let own = then[of].columns_range(range.clone()).into_owned();
            by.rows_range_mut(range).copy_from(&closest(&own, &right)?);
        }
        let then_a = there.in_axes(self.turning) * &by;
        let factored = by.clone().lu();
        let moved = factored.solve(&then_a)?;
        let terms = self.a.abs() + moved.abs();
        let unscaled = |mut left: DMatrix<f64>| {
            (0..left.nrows()).filter(|row| row % 6 >= 3).for_each(|row| left.row_mut(row).unscale_mut(length));
            left
        };
        let left = [0, 1].map(|of| unscaled(&here[of] - &then[of] * &by));
        Some(Change { rates: &self.a - moved, terms, left })
    }
}

/// How a body moves: velocity, angular velocity and their rates, ground axes, turns times the size of the scene.
struct Motion([Vector3<f64>; 4]);

fn motions(inputs: &[f64], layout: &Layout, length: f64) -> Vec<Motion> {
    let vector = |slot: usize| Vector3::new(inputs[slot], inputs[slot + 1], inputs[slot + 2]);
    let of = |body: usize| {
        let turn = crate::model::rotation(&std::array::from_fn(|k| inputs[layout.body_slot(body, 3 + k)]));
        let at = layout.acceleration_slot() + 6 * body;
        let [spin, alpha] = [layout.body_slot(body, 10), at + 3].map(|slot| turn * vector(slot) * length);
        Motion([vector(layout.body_slot(body, 7)), spin, vector(at), alpha])
    };
    (0..layout.bodies).map(of).collect()
}

impl Motion {
    /// The larger of its speeds, m/s, or what its accelerations make of it.
    fn speed(&self, length: f64) -> f64 {
        let [v, spin, a, alpha] = self.0.each_ref().map(Vector3::norm);
        v.max(spin).max((a.max(alpha) * length).sqrt())
    }
}

/// The angular velocities W with which bodies may turn as one: a = W x v and alpha = W x omega of all, or, where they travel as well,
/// of what moves beside the mean. Each body counts by the direction in which it moves, however slowly: a gyroscope that precesses turns
/// with its precession. Where all that moves so is along one direction, W is along it, too, and as that of one of the bodies.
fn turnings(motions: &[Motion], fastest: f64, length: f64) -> Vec<Vector3<f64>> {
    let count = motions.len() as f64;
    let mean = |k: usize| motions.iter().map(|motion| motion.0[k]).sum::<Vector3<f64>>() / count;
    let (v, a) = (mean(0), mean(2));
    let none = NO_MOTION * fastest * length;
    let mut found: Vec<Vector3<f64>> = Vec::new();
    for (v, a) in [(Vector3::zeros(), Vector3::zeros()), (v, a)] {
        let rates: Vec<(Vector3<f64>, Vector3<f64>)> = (motions.iter())
            .flat_map(|Motion([own, spin, rate, alpha])| [(own - v, rate - a), (*spin, *alpha)])
            .filter(|(of, _)| of.norm() > none)
            .map(|(of, rate)| (of.normalize(), rate / of.norm()))
            .collect();
        found.extend(turning_of(&rates, motions, length));
    }
    let mut different: Vec<Vector3<f64>> = Vec::new();
    for turning in found {
        let same = |known: &Vector3<f64>| (known - turning).norm() <= DETERMINED * turning.norm();
        if turning.norm() > NONE * fastest && !different.iter().any(same) {
            different.push(turning);
        }
    }
    different.truncate(MOST_AXES);
    different
}

/// From directions of unit length and their rates.
fn turning_of(rates: &[(Vector3<f64>, Vector3<f64>)], motions: &[Motion], length: f64) -> Vec<Vector3<f64>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (of, rate) in rates {
        matrix += Matrix3::identity() - of * of.transpose();
        right += of.cross(rate);
    }
    // Where speeds have no square.
    if rates.is_empty() || !(matrix.sum() + right.sum()).is_finite() {
        return Vec::new();
    }
    let found = matrix.symmetric_eigen();
    let largest = found.eigenvalues.max();
    let (mut own, mut open) = (Vector3::zeros(), None);
    for (value, direction) in found.eigenvalues.iter().zip(found.eigenvectors.column_iter()) {
        if *value > DETERMINED * largest {
            own += direction * (direction.dot(&right) / value);
        } else {
            open = Some(direction.into_owned());
        }
    }
    let clean = |turning: Vector3<f64>| turning.map(|part| if part.abs() > NONE * turning.norm() { part } else { 0.0 });
    let with = |turning: &Vector3<f64>| {
        let off = |(of, rate): &(Vector3<f64>, Vector3<f64>)| (rate - turning.cross(of)).norm();
        rates.iter().all(|one| off(one) <= NEARLY * turning.norm().max(one.1.norm()))
    };
    let mut found: Vec<Vector3<f64>> = match open {
        None => vec![clean(own)],
        Some(open) => {
            motions.iter().map(|Motion([_, spin, ..])| clean(own + open * (open.dot(spin) / length))).collect()
        }
    };
    found.retain(with);
    found
}

/// The least squares solution of A X ~ B, zero where columns of A follow from others; none of numbers that are not finite.
fn closest(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut factored = PivotedQr::new(a.nrows(), a.ncols(), DEFAULT_RANK_TOLERANCE);
    factored.clear();
    (0..a.ncols()).for_each(|column| (0..a.nrows()).for_each(|row| factored.set(row, column, a[(row, column)])));
    factored.factor().ok()?;
    let mut x = DMatrix::zeros(a.ncols(), b.ncols());
    for (column, mut own) in b.column_iter().zip(x.column_iter_mut()) {
        factored.least_squares(column.into_owned().as_slice(), own.as_mut_slice()).ok()?;
    }
    x.iter().all(|value| value.is_finite()).then_some(x)
}
