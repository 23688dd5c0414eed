//! Checks of rows on velocities.

use crate::geometry::{Twist, Vec3};
use crate::recording::Role;
use crate::testkit::examine::{Examination, ROUNDING};
use crate::testkit::report::Check;
use crate::testkit::{Probe, Setting, interpret};

/// Force and torque, ground axes.
type Load = (Vec3<f64>, Vec3<f64>);

impl Probe {
    /// The rows on velocities in use, by their number among all rows: a . v + b.
    #[must_use]
    pub fn velocity_rows(&self, setting: &Setting) -> Vec<(usize, f64)> {
        let coordinates = vec![0.0; self.descriptor.mobility.unwrap_or(0)];
        let row = |(role, value)| match role {
            Role::VelocityResidual(row) => Some((row as usize, value)),
            _ => None,
        };
        interpret(&self.recording, setting, &coordinates).into_iter().filter_map(row).collect()
    }

    /// Per row on velocities its name and what a unit multiplier does to each frame: force and torque, ground axes.
    pub(super) fn velocity_loads(&self, setting: &Setting) -> Vec<(String, Vec<Load>)> {
        let mut still = setting.clone();
        still.twists.fill(Twist { velocity: Vec3::zeros(), angular_velocity: Vec3::zeros() });
        let at_rest = self.velocity_rows(&still);
        let name = |row: usize| format!("velocity row `{}`", self.descriptor.rows[row]);
        let nothing = vec![(Vec3::zeros(), Vec3::zeros()); setting.frames.len()];
        let mut list: Vec<_> = at_rest.iter().map(|(row, _)| (name(*row), nothing.clone())).collect();
        for frame in 0..setting.frames.len() {
            for k in 0..6 {
                let mut moving = still.clone();
                let unit = Vec3::ith(k % 3, 1.0);
                let twist = &mut moving.twists[frame];
                if k < 3 {
                    twist.velocity = unit
                } else {
                    twist.angular_velocity = unit
                }
                for ((own, (_, rate)), (_, rest)) in list.iter_mut().zip(self.velocity_rows(&moving)).zip(&at_rest) {
                    let load = &mut own.1[frame];
                    let part = if k < 3 { &mut load.0 } else { &mut load.1 };
                    part[k % 3] = rate - rest;
                }
            }
        }
        list
    }
}

/// Loads of a row have no resultant: what is the same, it does not see motions of all bodies together.
pub(super) fn third_law(x: &mut Examination<'_>, setting: &Setting) {
    for (name, loads) in x.probe.velocity_loads(setting) {
        x.compare_resultants(setting, &loads, || format!("reaction of {name}: "));
    }
}

pub(super) fn frame_invariance(x: &mut Examination<'_>, setting: &Setting) {
    let values = x.probe.velocity_rows(setting);
    let moved = x.probe.velocity_rows(&setting.carried_by(&x.random.frame()));
    for ((_, moved), (row, value)) in moved.into_iter().zip(values) {
        let name = x.probe.descriptor.rows[row].clone();
        let what = || format!("velocity row `{name}` changes when all bodies are moved together");
        let allowed = 10.0 * ROUNDING * (1.0 + value.abs());
        x.report.compare_in_words(Check::FrameInvariance, (moved, value), allowed, ("it becomes", "it was"), what);
    }
}
