//! A mechanism as bodies with one joint each, and where they are at the start.

use std::collections::HashMap;

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::mechanism::{Hold, Joint, Kind, Link, Mechanism, Solid};
use crate::write::usable;

/// Mass and moments of inertia of what is between two joints of one link, and has none, by those of the link.
const TINY: f64 = 1e-12;

/// Moments of inertia per mass, m^2, below which a link is a point.
const POINT: f64 = 1e-15;

/// Where a link is and how it moves, ground axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    pub(crate) pose: Isometry3<f64>,
    /// Of the origin.
    pub(crate) velocity: Vector3<f64>,
    pub(crate) angular_velocity: Vector3<f64>,
}

/// The coordinate direction that is least along a vector.
pub(crate) fn across(axis: &Unit<Vector3<f64>>) -> Vector3<f64> {
    let mut direction = Vector3::zeros();
    direction[axis.iamin()] = 1.0;
    direction
}

/// A mechanism in which every link has a mass and one joint at most: links without mass are joined with those that they are fixed
/// to, and several joints in a row get links in between.
pub(crate) fn of_bodies(mut mechanism: Mechanism) -> Mechanism {
    join_massless(&mut mechanism);
    let links = std::mem::take(&mut mechanism.links);
    // The number of each link, behind those that come in between.
    let mut numbers: Vec<usize> = Vec::with_capacity(links.len());
    for mut link in links {
        link.parent = link.parent.and_then(|parent| numbers.get(parent).copied());
        let (bare, tiny) = (link.is_bare(), Matrix3::identity() * TINY);
        let solid = link.solid.get_or_insert(Solid { mass: 0.0, com: Vector3::zeros(), inertia: tiny });
        if bare {
            let message = "has no mass; without mass nothing moves by its own, so it has next to none here";
            mechanism.left_out.push(format!("link `{}` {message}", link.name));
            solid.mass = TINY;
        }
        if solid.inertia.amax() <= POINT * solid.mass {
            let message = "has mass and no extent: a point, with next to no moment of inertia about itself";
            mechanism.left_out.push(format!("link `{}` {message}", link.name));
            solid.inertia = tiny * solid.mass;
        }
        if let Hold::Joints(joints) = &mut link.hold
            && let Some(last) = joints.pop()
        {
            let before = std::mem::replace(joints, vec![last]);
            let count = before.len();
            for (k, joint) in before.into_iter().enumerate() {
                let name = format!("{}_{}", usable(&link.name), k + 1);
                let remark = format!("between the {} joints of `{}`, with next to no mass", count + 1, link.name);
                mechanism.links.push(Link {
                    name,
                    parent: link.parent,
                    pose: std::mem::replace(&mut link.pose, Isometry3::identity()),
                    solid: link.solid.map(|solid| small(&solid, &joint)),
                    hold: Hold::Joints(vec![joint]),
                    shapes: Vec::new(),
                    remark: Some(remark),
                });
                link.parent = Some(mechanism.links.len() - 1);
            }
        }
        numbers.push(mechanism.links.len());
        mechanism.links.push(link);
    }
    for closure in &mut mechanism.closures {
        closure.links = closure.links.map(|link| link.and_then(|link| numbers.get(link).copied()));
    }
    mechanism
}

/// A part of next to no mass at a joint of a link.
fn small(solid: &Solid, joint: &Joint) -> Solid {
    let arm = (solid.com - joint.place.coords).norm_squared();
    let moment = (solid.inertia.trace() / 3.0 + solid.mass * arm) * TINY;
    Solid { mass: solid.mass * TINY, com: joint.place.coords, inertia: Matrix3::identity() * moment }
}

/// Joins each link without mass with the link that it is fixed to, or with such that are fixed to it.
fn join_massless(mechanism: &mut Mechanism) {
    let count = mechanism.links.len();
    // What a link became part of, with its pose there.
    let mut into: Vec<Option<(Option<usize>, Isometry3<f64>)>> = vec![None; count];
    for number in (0..count).rev() {
        let link = &mechanism.links[number];
        let Hold::Fixed = link.hold else { continue };
        let carrier = link.parent.map(|parent| &mechanism.links[parent]);
        let bare = link.is_bare();
        // A carrier without mass that moves takes the mass of what is fixed to it.
        let carrier_is_bare = carrier.is_some_and(|carrier| carrier.is_bare() && !matches!(carrier.hold, Hold::Fixed));
        if !bare && !carrier_is_bare {
            continue;
        }
        let (parent, pose, solid, shapes) = (link.parent, link.pose, link.solid, link.shapes.clone());
        let moved = shapes.into_iter().map(|mut shape| {
            shape.pose = pose * shape.pose;
            shape
        });
        match parent {
            None => mechanism.ground.extend(moved),
            Some(parent) => {
                let carrier = &mut mechanism.links[parent];
                let solid = solid.map(|solid| solid.moved(&pose));
                carrier.solid = match (carrier.solid, solid) {
                    (Some(a), Some(b)) => Some(a.and(&b)),
                    (a, b) => a.or(b),
                };
                carrier.shapes.extend(moved);
            }
        }
        into[number] = Some((parent, pose));
    }
    // Followed to what is left.
    let resolve = |number: Option<usize>| {
        let (mut at, mut pose) = (number, Isometry3::identity());
        while let Some(Some((parent, its))) = at.map(|number| into[number]) {
            (at, pose) = (parent, its * pose);
        }
        (at, pose)
    };
    let mut numbers = HashMap::new();
    let links = std::mem::take(&mut mechanism.links);
    for (number, mut link) in links.into_iter().enumerate().filter(|(number, _)| into[*number].is_none()) {
        let (parent, pose) = resolve(link.parent);
        link.parent = parent.map(|parent| numbers[&parent]);
        link.pose = pose * link.pose;
        numbers.insert(number, mechanism.links.len());
        mechanism.links.push(link);
    }
    for closure in &mut mechanism.closures {
        for (link, frame) in closure.links.iter_mut().zip(&mut closure.frames) {
            let (at, pose) = resolve(*link);
            *link = at.map(|at| numbers[&at]);
            *frame = pose * *frame;
        }
    }
}

/// Where all links are at the values and speeds of their joints. Parents stand before their children.
pub(crate) fn at_start(mechanism: &Mechanism) -> Vec<Placed> {
    let rest = Placed { pose: Isometry3::identity(), velocity: Vector3::zeros(), angular_velocity: Vector3::zeros() };
    let mut placed: Vec<Placed> = Vec::with_capacity(mechanism.links.len());
    for link in &mechanism.links {
        let parent = link.parent.map_or(rest, |parent| placed[parent]);
        let mut pose = parent.pose * link.pose;
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        if let Hold::Joints(joints) = &link.hold {
            for joint in joints {
                let axis = pose.rotation * joint.axis.into_inner();
                let place = pose * joint.place;
                match joint.kind {
                    Kind::Hinge => {
                        let turn = UnitQuaternion::from_axis_angle(&joint.axis, joint.value - joint.reference);
                        let about = Translation3::from(joint.place.coords);
                        pose *= about * turn * about.inverse();
                        angular += axis * joint.speed;
                        linear += (axis * joint.speed).cross(&(pose.translation.vector - place.coords));
                    }
                    Kind::Slide => {
                        let shift = joint.axis.into_inner() * (joint.value - joint.reference);
                        pose *= Translation3::from(shift);
                        linear += axis * joint.speed;
                    }
                    Kind::Ball => {}
                }
            }
        }
        let arm = pose.translation.vector - parent.pose.translation.vector;
        placed.push(Placed {
            pose,
            velocity: parent.velocity + parent.angular_velocity.cross(&arm) + linear,
            angular_velocity: parent.angular_velocity + angular,
        });
    }
    placed
}
