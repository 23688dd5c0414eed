//! [`Turns`]: which of the two sets of Euler parameters of each body continues from those at the start.
//!
//! The rotations of a joint that turns by angles about axes, one after the other, are a product of Euler parameters with half of each
//! angle: functions of the joint's coordinates that are continuous however far these are from where they were seen last. So are the
//! products of these along the tree, up to the sign that each body has at the start.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::joint_start::JointStart;
use crate::model::{Marker, Model, euler_parameters};
use crate::plan::{Coordinates, SpanningTree};

/// The sets of the bodies of a tree.
pub(super) struct Turns {
    /// In the order of the tree.
    joints: Vec<Joint>,
    /// By body: the continuous set, up to its sign. Not a number where a joint of it turns in another way.
    found: Vec<Quaternion<f64>>,
    /// By body: the sign that it has, once it was seen.
    signs: Vec<Option<f64>>,
}

/// How a body turns on its tree.
struct Joint {
    parent: Option<usize>,
    child: usize,
    /// The rotation at zero of the first frame on the body before, and back from the second to the body carried.
    frames: [Quaternion<f64>; 2],
    reversed: bool,
    /// What the second frame turns by in the first; `None` where that is another way of turning.
    turn: Option<Turn>,
}

struct Turn {
    /// Coordinates that turn, each about an axis in the first frame, one after the other.
    angles: Vec<(Vector3<f64>, Angle)>,
    /// What they turn.
    rest: Quaternion<f64>,
    /// Where the Euler parameters of the rotation behind them are in the state.
    rotation: Option<usize>,
}

/// A coordinate of the tree: a constant, and entries of the state with factors.
struct Angle {
    offset: f64,
    of: Vec<(usize, f64)>,
}

impl Angle {
    fn at(&self, state: &[f64]) -> f64 {
        self.of.iter().fold(self.offset, |sum, (entry, factor)| sum + factor * state[*entry])
    }
}

impl Turn {
    fn at(&self, state: &[f64]) -> Quaternion<f64> {
        let own = product(self.angles.iter().map(|(axis, angle)| (axis, angle.at(state))), self.rest);
        self.rotation.map_or(own, |at| own * quaternion(&state[at..at + 4]))
    }
}

impl Turns {
    pub(super) fn new(start: &mut JointStart, tree: &SpanningTree, coordinates: &Coordinates, model: &Model) -> Self {
        let (mut lines, mut rotations) = (coordinates.lines.iter(), coordinates.rotations.iter());
        let kept = tree.kept();
        let entries: Vec<Option<usize>> =
            kept.iter().flatten().map(|kept| kept.then(|| lines.next().map(|line| line.position)).flatten()).collect();
        let angle = |line: usize| match tree.followers.iter().find(|follower| follower.line == line) {
            None => Angle { offset: 0.0, of: entries[line].iter().map(|entry| (*entry, 1.0)).collect() },
            Some(follower) => {
                let of = follower.of.iter().filter_map(|(other, factor)| Some((entries[*other]?, *factor)));
                Angle { offset: follower.offset, of: of.collect() }
            }
        };
        let mut first = 0;
        let joint = |(number, joint): (usize, &crate::plan::TreeJoint)| {
            let rotation = joint.rotates.then(|| rotations.next().map(|rotation| rotation.position)).flatten();
            let own = first..first + joint.coordinates;
            first = own.end;
            let given = |body: usize| euler_parameters(&model.bodies[body].given().1);
            let turn = match joint.element {
                Some(_) => start.turns(number).map(|(rest, axes)| (quaternion(&rest), axes)),
                None if joint.rotates => Some((Quaternion::identity(), Vec::new())),
                None => Some((quaternion(&given(joint.child)), Vec::new())),
            };
            let turn = turn.map(|(rest, axes)| {
                let axes = axes.into_iter().zip(own).filter(|(axis, _)| *axis != Vector3::zeros());
                Turn { angles: axes.map(|(axis, line)| (axis, angle(line))).collect(), rest, rotation }
            });
            let frame = |marker: &Marker| quaternion(&euler_parameters(&marker.rotation));
            let frames =
                joint.markers(model).map_or([Quaternion::identity(); 2], |markers| markers.each_ref().map(frame));
            Joint { parent: joint.parent, child: joint.child, frames, reversed: joint.reversed, turn }
        };
        let bodies = model.bodies.len();
        let joints = tree.joints.iter().enumerate().map(joint).collect();
        Self { joints, found: vec![Quaternion::identity(); bodies], signs: vec![None; bodies] }
    }

    /// What bodies had is not what they continue from.
    pub(super) fn forget(&mut self) {
        self.signs.fill(None);
    }

    /// Looks at a state.
    pub(super) fn look(&mut self, state: &[f64]) {
        for joint in &self.joints {
            let before = joint.parent.map_or(Quaternion::identity(), |parent| self.found[parent]);
            let [first, second] = joint.frames;
            let turn = joint.turn.as_ref().map_or(Quaternion::identity() * f64::NAN, |turn| turn.at(state));
            self.found[joint.child] = match joint.reversed {
                false => before * first * turn * second.conjugate(),
                true => before * second * turn.conjugate() * first.conjugate(),
            };
        }
    }

    /// Of both sets of a body the one that continues, where [`Turns::look`] looked last: from `last`, where that is all that is known.
    pub(super) fn choose(&mut self, body: usize, p: &mut [f64; 4], last: &[f64]) {
        let along = |other: [f64; 4]| p.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
        let [i, j, k, w] = self.found[body].coords.into();
        let found = along([w, i, j, k]);
        let sign = match self.signs[body] {
            Some(sign) if !found.is_nan() => sign * found,
            _ => along([last[0], last[1], last[2], last[3]]),
        };
        if sign < 0.0 {
            p.iter_mut().for_each(|e| *e = -*e);
        }
        if self.signs[body].is_none() && !found.is_nan() {
            self.signs[body] = Some(if (sign < 0.0) == (found < 0.0) { 1.0 } else { -1.0 });
        }
    }
}

/// Euler parameters, scalar first.
pub(super) fn quaternion(p: &[f64]) -> Quaternion<f64> {
    Quaternion::new(p[0], p[1], p[2], p[3])
}

/// Turns about axes, as far as these are long for each angle of 1, one after the other, of what is turned by `rest`.
pub(super) fn product<'a>(
    turns: impl Iterator<Item = (&'a Vector3<f64>, f64)>,
    rest: Quaternion<f64>,
) -> Quaternion<f64> {
    let turned = |before, (axis, angle): (&Vector3<f64>, f64)| {
        before * UnitQuaternion::from_scaled_axis(axis * angle).into_inner()
    };
    turns.fold(Quaternion::identity(), turned) * rest
}
