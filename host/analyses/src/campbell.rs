//! [`Campbell`]: how the modes of a scene change with a number of it, such as the speed of a rotor.

use std::fmt::Write as _;

use nalgebra::Complex;
use serde::Serialize;

use crate::files::cell;
use crate::modes::{BodyShape, Mode, Modes};
use crate::session::SessionError;

/// Modes over values of a key.
#[derive(Debug, Clone, Serialize)]
pub struct Campbell {
    /// What is varied, as in `--set KEY=VALUE`.
    pub key: String,
    /// Its values, as they were given.
    pub values: Vec<String>,
    /// The modes at each of them.
    pub modes: Vec<Modes>,
    /// For each branch, which mode it is at each value (an index into `modes`), or none where no mode continues it.
    pub branches: Vec<Vec<Option<usize>>>,
}

impl Campbell {
    /// Asks for the modes at each value, and follows them by their shapes.
    ///
    /// # Errors
    /// Those of `ask`, at the first value that has one.
    pub fn over(
        key: &str,
        values: &[String],
        ask: &mut dyn FnMut(&str) -> Result<Modes, SessionError>,
    ) -> Result<Self, SessionError> {
        let modes = values.iter().map(|value| ask(value)).collect::<Result<Vec<_>, _>>()?;
        let branches = follow(&modes);
        Ok(Self { key: key.to_owned(), values: values.to_vec(), modes, branches })
    }

    /// The modes of a branch, with the index of the value that each belongs to.
    pub fn branch(&self, branch: usize) -> impl Iterator<Item = (usize, &Mode)> {
        let of = self.branches.get(branch).into_iter().flatten().enumerate();
        of.filter_map(|(value, mode)| Some((value, self.modes.get(value)?.modes.get((*mode)?)?)))
    }

    /// A line for each mode at each value: value, branch, frequency in Hz, damping ratio, real part in 1/s.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("value,branch,frequency [Hz],damping_ratio,real [1/s]\n");
        for (number, value) in self.values.iter().enumerate() {
            for branch in 0..self.branches.len() {
                for (_, mode) in self.branch(branch).filter(|(at, _)| *at == number) {
                    let Mode { frequency, damping_ratio, real, .. } = mode;
                    let _ = writeln!(text, "{},{},{frequency},{damping_ratio},{real}", cell(value), branch + 1);
                }
            }
        }
        text
    }
}

/// Joins each mode at a value with the one at the value before that it is most like.
fn follow(all: &[Modes]) -> Vec<Vec<Option<usize>>> {
    let mut branches: Vec<Vec<Option<usize>>> = Vec::new();
    for (at, modes) in all.iter().enumerate() {
        let before = at.checked_sub(1).and_then(|before| all.get(before));
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (branch, last) in branches.iter().enumerate() {
            let Some(last) = last.last().copied().flatten().and_then(|mode| before?.modes.get(mode)) else { continue };
            pairs.extend(
                modes.modes.iter().enumerate().map(|(mode, next)| (likeness(last, next, modes.length), branch, mode)),
            );
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut continues: Vec<Option<usize>> = vec![None; branches.len()];
        let mut taken = vec![false; modes.modes.len()];
        for (_, branch, mode) in pairs {
            if continues[branch].is_none() && !taken[mode] {
                continues[branch] = Some(mode);
                taken[mode] = true;
            }
        }
        branches.iter_mut().zip(continues).for_each(|(branch, mode)| branch.push(mode));
        let new = (0..modes.modes.len()).filter(|mode| !taken[*mode]);
        branches.extend(new.map(|mode| (0..at).map(|_| None).chain([Some(mode)]).collect()));
    }
    branches
}

/// The modal assurance criterion of two shapes (Allemang & Brown 1982), less the difference of the eigenvalues on their size. Turns
/// count by the displacements that they cause at a length.
fn likeness(a: &Mode, b: &Mode, length: f64) -> f64 {
    let value = |mode: &Mode| Complex::new(mode.real, mode.imaginary);
    let apart = (value(a) - value(b)).norm() / (value(a).norm() + value(b).norm()).max(f64::MIN_POSITIVE);
    let entries = |mode: &Mode| -> Vec<Complex<f64>> {
        let of_body = |body: &BodyShape| {
            let moved = |k: usize| Complex::new(body.displacement[k], body.displacement_imaginary[k]);
            let turned = |k: usize| Complex::new(body.turn[k], body.turn_imaginary[k]) * length;
            [0, 1, 2].map(|k| [moved(k), turned(k)]).concat()
        };
        mode.shape.iter().flat_map(of_body).collect()
    };
    let (a, b) = (entries(a), entries(b));
    let product: Complex<f64> = a.iter().zip(&b).map(|(a, b)| a.conj() * b).sum();
    let size = |v: &[Complex<f64>]| v.iter().map(Complex::norm_sqr).sum::<f64>();
    product.norm_sqr() / (size(&a) * size(&b)).max(f64::MIN_POSITIVE) - apart
}
