//! The equations of a scene are those of its elements; its programs give the same numbers however they are run.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod equations;
#[cfg(feature = "jit")]
mod machine;
mod rate_sizes;
mod reports;
mod sharp;
mod switches;

use nalgebra::Vector3;

use super::*;
use crate::model::Model;
use crate::plan::Layout;
use crate::tests::Random;

/// A motion of all bodies through random poses with random velocities and constant accelerations of the centres of mass and
/// of omega'. Element states, references and memory are random too and stay.
struct Motion {
    layout: Layout,
    /// The inputs at time zero of the motion.
    start: Vec<f64>,
}

impl Motion {
    fn random(layout: &Layout, random: &mut Random) -> Self {
        let mut start = random.vector(layout.inputs());
        for body in 0..layout.bodies {
            let slot = layout.body_slot(body, 3);
            start[slot..slot + 4].copy_from_slice(&random.euler_parameters());
        }
        let mut motion = Self { layout: layout.clone(), start };
        motion.start = motion.at(0.0);
        motion
    }

    fn three(&self, slot: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.start[slot..slot + 3])
    }

    /// The inputs a time `h` later, the rates of the Euler parameters included. Exact in r and v; the rotation vector
    /// omega' h + alpha h^2 / 2 is exact to the second order.
    fn at(&self, h: f64) -> Vec<f64> {
        let mut inputs = self.start.clone();
        inputs[Layout::TIME] += h;
        for body in 0..self.layout.bodies {
            let slot = |k| self.layout.body_slot(body, k);
            let accelerations = self.layout.acceleration_slot() + 6 * body;
            let (v, w) = (self.three(slot(7)), self.three(slot(10)));
            let (a, spin) = (self.three(accelerations), self.three(accelerations + 3));
            let r = self.three(slot(0)) + v * h + a * (0.5 * h * h);
            let p = turned(&self.start[slot(3)..slot(7)], w * h + spin * (0.5 * h * h));
            let (v, w) = (v + a * h, w + spin * h);
            inputs[slot(0)..slot(3)].copy_from_slice(r.as_slice());
            inputs[slot(3)..slot(7)].copy_from_slice(&p);
            inputs[slot(7)..slot(10)].copy_from_slice(v.as_slice());
            inputs[slot(10)..slot(13)].copy_from_slice(w.as_slice());
            inputs[slot(13)..slot(17)].copy_from_slice(&product(&p, &[0.0, 0.5 * w.x, 0.5 * w.y, 0.5 * w.z]));
        }
        inputs
    }
}

/// Product of two quaternions, scalar first.
fn product(p: &[f64], q: &[f64]) -> [f64; 4] {
    let (a, b) = (Vector3::new(p[1], p[2], p[3]), Vector3::new(q[1], q[2], q[3]));
    let v = b * p[0] + a * q[0] + a.cross(&b);
    [p[0] * q[0] - a.dot(&b), v.x, v.y, v.z]
}

/// Euler parameters after a further rotation about body axes, given as a rotation vector.
fn turned(p: &[f64], by: Vector3<f64>) -> [f64; 4] {
    let half = 0.5 * by.norm();
    let v = by * if half > 0.0 { 0.5 * half.sin() / half } else { 0.5 };
    product(p, &[half.cos(), v.x, v.y, v.z])
}

/// The numbers of some nodes of a scene, opaque elements included.
fn scene_values(equations: &Equations, model: &Model, nodes: &[Node], inputs: &[f64]) -> Vec<f64> {
    let program = Program::compile(&equations.graph, nodes);
    let mut found = vec![f64::NAN; nodes.len()];
    program.run(inputs, &model.sets, &mut program.workspace(), &mut found).unwrap();
    found
}

/// Largest difference, relative to the largest number of the second list or one.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let size = b.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    let off = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    off.fold(0.0_f64, |m, x| if x <= m { m } else { x }) / size
}
