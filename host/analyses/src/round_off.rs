//! [`RoundOff`]: what round-off of loads and places leaves open of a linear model.
//!
//! Loads on a body that are in balance leave round-off where they cancel, and its places are known to as much. A light body, or a thin
//! rod about its axis, gets accelerations from that which are far beyond round-off of the accelerations of others: they do not show in
//! the size of the matrix of the model. So the bound is taken where it arises, on the loads of each body: derivatives along its motion
//! and along that of its neighbours are open by a share of themselves and of what the loads on it would change by where they turn with
//! it.

use nalgebra::{DMatrix, DVector, Matrix3};

use crate::analysis::{Direction, Expansion, Freedom, Function};
use crate::eigen::{ComplexVector, Pair};
use crate::linalg::SingularValues;
use crate::linear::Linear;

/// Share of loads, and of their derivatives, that is round-off.
pub(crate) const ROUND_OFF: f64 = 1e-13;

/// Round-off of a motion that is none, times that of the response to loads along it.
const NEXT_TO_NOTHING: f64 = ROUND_OFF * f64::EPSILON;

/// See the module documentation.
#[derive(Debug, Clone)]
pub(crate) struct RoundOff {
    /// Rates of the velocities of a model by loads on bodies.
    responses: DMatrix<f64>,
    /// What derivatives of loads by positions of bodies are open by.
    slopes: DMatrix<f64>,
    /// What derivatives of rates are open by where bodies that nothing lets move move by round-off, per row.
    least: DVector<f64>,
}

/// A basis of motions that have no mass in common, heaviest first: what moves little mass is not mixed with what moves much, beside which
/// it would be lost.
pub(crate) fn by_mass(mut freedom: Freedom, mass: &DMatrix<f64>) -> Freedom {
    let mut roots = freedom.basis.clone();
    for at in (0..mass.nrows()).step_by(6) {
        (at..at + 3).for_each(|row| roots.row_mut(row).scale_mut(mass[(row, row)].sqrt()));
        let inertia = mass.fixed_view::<3, 3>(at + 3, at + 3).into_owned().symmetric_eigen();
        let root = Matrix3::from_diagonal(&inertia.eigenvalues.map(|moment| moment.max(0.0).sqrt()));
        let turned = root * inertia.eigenvectors.transpose() * freedom.basis.rows(at + 3, 3);
        roots.rows_mut(at + 3, 3).copy_from(&turned);
    }
    if let Some(values) = SingularValues::of(&roots) {
        freedom.basis *= values.right();
        freedom.components = values.right().transpose() * freedom.components;
    }
    freedom
}

impl RoundOff {
    /// At a state, for velocities along these motions of bodies.
    pub(crate) fn of(e: &Expansion, motions: &DMatrix<f64>) -> Self {
        let mut slopes = e.slope(Function::Balance, Direction::Positions).abs();
        let n = slopes.nrows();
        for body in (0..n).step_by(6) {
            let own = body..body + 6;
            let force = own.clone().map(|k| e.sizes[k] * e.scales[k]).fold(0.0, f64::max);
            let near = |other: usize| other == body || slopes.view((body, other), (6, 6)).amax() > 0.0;
            let neighbours: Vec<usize> = (0..n).step_by(6).filter(|other| near(*other)).collect();
            // A force that turns with the body; per length of what its elements hold.
            let stiffness = force * e.scales[body + 3];
            for (row, column) in own.flat_map(|row| neighbours.iter().map(move |other| (row, *other))) {
                (column..column + 6)
                    .for_each(|column| slopes[(row, column)] += stiffness / (e.scales[row] * e.scales[column]));
            }
        }
        let inertia = -(motions.transpose() * e.slope(Function::Balance, Direction::Accelerations) * motions);
        let none = DMatrix::zeros(motions.ncols(), n);
        let responses =
            if inertia.is_empty() { None } else { inertia.lu().solve(&motions.transpose()) }.unwrap_or(none);
        let stiffest = slopes.map_with_location(|row, column, slope| slope * e.scales[row] * e.scales[column]).amax();
        let response = |row: usize| (0..n).map(|k| (responses[(row, k)] / e.scales[k]).abs()).fold(0.0, f64::max);
        let least = DVector::from_fn(responses.nrows(), |row, _| NEXT_TO_NOTHING * stiffest * response(row));
        Self { responses, slopes: slopes * ROUND_OFF, least }
    }

    /// Of the rates of velocities, along independent motions of bodies, column by column.
    fn of_rates(&self, motions: &DMatrix<f64>) -> DMatrix<f64> {
        let mut open = self.responses.abs() * (&self.slopes * motions.abs());
        open.column_iter_mut().for_each(|mut column| column += &self.least);
        open
    }

    /// By how much it may have moved an eigenvalue, first order: `motion` is that of the bodies in its vector, and rates of velocities
    /// begin at `first` among the states.
    fn of_eigenvalue(&self, pair: &Pair, motion: &DVector<f64>, first: usize) -> f64 {
        let left = pair.left.rows(first, self.responses.nrows());
        let parts = |part: fn(&nalgebra::Complex<f64>) -> f64| self.responses.tr_mul(&left.map(|entry| part(&entry)));
        let (real, imaginary) = (parts(|entry| entry.re), parts(|entry| entry.im));
        let loads = &self.slopes * motion;
        loads.iter().enumerate().map(|(k, load)| real[k].hypot(imaginary[k]) * load).sum()
    }
}

impl Linear {
    /// Sets derivatives of accelerations by positions to zero where they are round-off of loads in balance: an eigenvalue made of them
    /// would grow or swing within millions of years.
    pub(crate) fn drop_round_off(&mut self) {
        let (p, q) = (self.coordinates, self.round_off.responses.nrows());
        let none = self.round_off.of_rates(&self.positions.columns(0, p).into_owned());
        let mut part = self.a.view_mut((p, 0), (q, p));
        let dropped = part.iter_mut().zip(none.iter()).filter(|(entry, none)| entry.abs() <= **none);
        dropped.for_each(|(entry, _)| *entry = 0.0);
    }

    /// By how much round-off of loads may have moved an eigenvalue, 1/s; with the displacements of its vector.
    pub(crate) fn open(&self, pair: &Pair, displacements: &ComplexVector) -> f64 {
        let motion = displacements.map(|entry| entry.norm());
        pair.moved(self.round_off.of_eigenvalue(pair, &motion, self.coordinates))
    }
}
