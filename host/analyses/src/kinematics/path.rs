//! [`Path`]: the places that a mechanism with one freedom goes through.

use nalgebra::DVector;

use crate::analysis::{Direction, Freedom, Function};
use crate::driven::Driven;
use crate::moves;

/// Shortest step.
pub(super) const LEAST_STEP: f64 = 1e-9;
/// Rates along the path below this share of their largest are none; m or rad per size of the scene.
const DEAD: f64 = 1e-9;
pub(super) const NONE: f64 = 1e-12;
/// Halvings that find a dead point.
const HALVINGS: usize = 60;
/// A place is the start again within this, in sizes of the scene or rad.
pub(super) const SAME: f64 = 1e-7;

/// A place of a path.
#[derive(Clone)]
pub(super) struct Place {
    pub(super) inputs: Vec<f64>,
    pub(super) tangent: DVector<f64>,
    /// The quantities and their rates along the tangent, SI; the drive last.
    pub(super) values: Vec<f64>,
    pub(super) rates: Vec<f64>,
}

/// See the module documentation.
pub(super) struct Path<'s> {
    pub(super) driven: Driven<'s>,
    pub(super) scales: DVector<f64>,
}

impl Path<'_> {
    /// What is at the place where the bodies are, with the tangent that continues in a direction.
    pub(super) fn look(&mut self, ahead: Option<&DVector<f64>>) -> Result<Place, String> {
        let e = self.driven.expansion()?;
        let own = self.driven.rows.own;
        let jacobian = e.jacobian();
        let mut rows = jacobian.rows(0, own).into_owned().resize_vertically(own + e.idle.nrows(), 0.0);
        rows.rows_mut(own, e.idle.nrows()).copy_from(&e.idle);
        let freedom = Freedom::of(&rows, &e.scales).map_err(|error| error.to_string())?;
        if freedom.count() != 1 {
            return Err(format!("the joints leave {} freedoms there, and a path needs one", freedom.count()));
        }
        self.scales = e.scales.clone();
        let mut tangent = freedom.basis.column(0).into_owned();
        tangent /= self.driven.size(&tangent);
        if ahead.is_some_and(|ahead| self.cosine(ahead, &tangent) < 0.0) {
            tangent = -tangent;
        }
        let rates = e.slope(Function::Rates, Direction::Velocities) * &tangent;
        let values = e.value(Function::Rows);
        Ok(Place {
            inputs: self.driven.inputs.clone(),
            values: values.rows(own, values.len() - own).iter().copied().collect(),
            rates: rates.rows(own, rates.len() - own).iter().copied().collect(),
            tangent,
        })
    }

    /// Of the angle between two motions, in coordinates scaled by what bodies move.
    pub(super) fn cosine(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let (a, b) = (a.component_div(&self.scales), b.component_div(&self.scales));
        let size = a.norm() * b.norm();
        if size > 0.0 { a.dot(&b) / size } else { 0.0 }
    }

    /// The place a step ahead.
    pub(super) fn step(&mut self, from: &Place, step: f64) -> Result<Place, String> {
        self.driven.inputs.clone_from(&from.inputs);
        moves::go(&self.driven.layout, &mut self.driven.inputs, &(&from.tangent * step));
        self.driven.correct(&[], 0.5 * step.abs().max(LEAST_STEP))?;
        self.look(Some(&from.tangent))
    }

    /// Where a quantity stops between a place and one a step ahead.
    pub(super) fn dead(&mut self, from: &Place, step: f64, k: usize) -> Result<Place, String> {
        let before = from.rates[k] > 0.0;
        self.between(from, step, &|_, place| (place.rates[k] > 0.0) == before)
    }

    /// The start again, which lies between a place and one a step ahead: quantities that turn go on from the place before.
    pub(super) fn back(&mut self, from: &Place, step: f64, start: &Place) -> Result<Place, String> {
        self.between(from, step, &|path, place| path.towards(place, start) * step > 0.0)
    }

    /// Whether a place is before another, in the sense of its tangent: above zero.
    pub(super) fn towards(&self, place: &Place, other: &Place) -> f64 {
        self.cosine(&difference(&self.driven.layout, place, other), &place.tangent)
    }

    /// The last place of a step that is `before` what is looked for, but for round-off. Steps may be below zero.
    fn between(&mut self, from: &Place, step: f64, before: &dyn Fn(&Self, &Place) -> bool) -> Result<Place, String> {
        let (mut low, mut high) = (0.0, step);
        let mut found = from.clone();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            found = self.step(from, middle)?;
            if before(self, &found) {
                low = middle
            } else {
                high = middle
            }
            if (high - low).abs() <= f64::EPSILON * step.abs() {
                break;
            }
        }
        Ok(found)
    }

    /// Distance of two places, in sizes of the scene or rad.
    pub(super) fn apart(&self, a: &Place, b: &Place) -> f64 {
        let layout = &self.driven.layout;
        (0..layout.bodies)
            .map(|body| {
                let at = layout.body_slot(body, 0);
                let far = (0..3).map(|k| (a.inputs[at + k] - b.inputs[at + k]).powi(2)).sum::<f64>().sqrt();
                let along: f64 = (3..7).map(|k| a.inputs[at + k] * b.inputs[at + k]).sum();
                (far / self.driven.length).max(2.0 * (1.0 - along.abs()).max(0.0).sqrt() * std::f64::consts::SQRT_2)
            })
            .fold(0.0, f64::max)
    }
}

/// Displacements and turns from one place to another, near.
fn difference(layout: &crate::plan::Layout, a: &Place, b: &Place) -> DVector<f64> {
    let mut found = DVector::zeros(layout.velocities());
    for body in 0..layout.bodies {
        let at = layout.body_slot(body, 0);
        (0..3).for_each(|k| found[6 * body + k] = b.inputs[at + k] - a.inputs[at + k]);
        let p =
            |inputs: &[f64]| nalgebra::Quaternion::new(inputs[at + 3], inputs[at + 4], inputs[at + 5], inputs[at + 6]);
        let by = p(&b.inputs) * p(&a.inputs).conjugate();
        let sign = if by.w < 0.0 { -2.0 } else { 2.0 };
        found.fixed_rows_mut::<3>(6 * body + 3).copy_from(&(by.imag() * sign));
    }
    found
}

impl Path<'_> {
    /// Adds dead points that places of the path have met by themselves, and leaves out what is there twice.
    pub(super) fn add_met(&self, places: &[Place], dead: &mut Vec<(usize, Place)>) {
        let count = places.first().map_or(0, |place| place.rates.len());
        for k in 0..count {
            let largest = places.iter().map(|place| place.rates[k].abs()).fold(0.0, f64::max);
            if largest > NONE {
                let met = places.iter().filter(|place| place.rates[k].abs() <= DEAD * largest);
                dead.extend(met.map(|place| (k, place.clone())));
            } else {
                dead.retain(|(own, _)| *own != k);
            }
        }
        let mut kept: Vec<(usize, Place)> = Vec::new();
        for (k, place) in dead.drain(..) {
            if !kept.iter().any(|(own, other)| *own == k && self.apart(other, &place) <= 10.0 * SAME) {
                kept.push((k, place));
            }
        }
        *dead = kept;
    }

    /// How far bodies are displaced, in sizes of the scene.
    pub(super) fn apart_translation(&self, a: &Place, b: &Place) -> f64 {
        let layout = &self.driven.layout;
        let far = |body: usize| {
            let at = layout.body_slot(body, 0);
            (0..3).map(|k| (a.inputs[at + k] - b.inputs[at + k]).powi(2)).sum::<f64>().sqrt() / self.driven.length
        };
        (0..layout.bodies).map(far).fold(0.0, f64::max)
    }
}
