//! What is valid in a scene and most probably not meant.

use element_api::Kind;

use super::bodies::in_digits;
use super::types::{Body, Instance, Marker};
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::{Dimension, Scene};

/// A radius of gyration beyond this many sizes of the scene, and beyond this length, m, is one of another unit. The points of a rotor on its
/// axis may all be next to the origin.
const MOST_SIZES: f64 = 30.0;
const MOST_RADIUS: f64 = 10.0;
/// A radius of gyration below this share of the size of the scene is that of another unit, if it is more than `FITTING` of that size in SI.
const LEAST_SIZES: f64 = 2e-3;
const FITTING: f64 = 0.2;
/// Share of positions that is round-off.
const ROUND_OFF: f64 = 1e-9;

/// Warns of it.
pub(super) fn warn(scene: &Scene, bodies: &[Body], instances: &[Instance], found: &mut Vec<Diagnostic>) {
    found.extend(weightless(scene, instances));
    found.extend(loose(scene, bodies, instances));
    found.extend(foreign_inertias(scene, bodies, instances));
    found.extend(beside_particles(scene, bodies, instances));
}

/// Joints that are attached beside particles, which their reactions would turn, unless these point at them.
fn beside_particles(scene: &Scene, bodies: &[Body], instances: &[Instance]) -> Vec<Diagnostic> {
    let reach = bodies.iter().map(|body| body.position.norm()).fold(0.0, f64::max);
    let warning = |instance: &Instance| {
        let is_beside = |marker: &&Marker| {
            marker.body.is_some_and(|body| {
                let arm = marker.position - bodies[body].center_of_mass;
                bodies[body].particle && arm.norm() > ROUND_OFF * (reach + arm.norm())
            })
        };
        let holds = instance.class.kind == Kind::Joint && !instance.rows.is_empty();
        let marker = instance.markers.iter().filter(|_| holds).find(is_beside)?;
        let body = &bodies[marker.body?];
        let record = scene.elements.iter().find(|record| record.name.value == instance.name)?;
        let arm = (marker.position - body.center_of_mass).norm();
        let message = format!("`{}` is attached beside the particle `{}`", instance.name, body.name);
        let text = format!(
            "{} away from it; a reaction across that would turn it, and it has no rotation",
            length(scene, arm)
        );
        let help =
            format!("attach it at the position of `{}`, or give that an `inertia` in place of `particle`", body.name);
        let warning =
            Diagnostic::warning(codes::TORQUE_ON_PARTICLE, message).at(record.name.span.clone(), text).help(help);
        Some(warning.help("a mass at the end of a light rod is a body with that mass, and an inertia however small"))
    };
    instances.iter().filter_map(warning).collect()
}

/// Elements whose mass has no weight in a scene with gravity.
fn weightless(scene: &Scene, instances: &[Instance]) -> Vec<Diagnostic> {
    if scene.simulation.gravity == [0.0; 3] {
        return Vec::new();
    }
    let warning = |instance: &Instance| {
        let has = |name: &str| instance.class.params.iter().any(|param| param.name == name);
        if !has("gravity") || !instance.brings_kinetic() {
            return None;
        }
        let record = scene.elements.iter().find(|record| record.name.value == instance.name)?;
        let given = |name: &str| record.params.get(name).is_some();
        ((!has("mass") || given("mass")) && !given("gravity")).then(|| {
            let message = format!("the mass of `{}` has no weight, though the scene has gravity", instance.name);
            Diagnostic::warning(codes::WEIGHTLESS, message)
                .at(record.name.span.clone(), "its own `gravity` is left out, and zero")
                .help("give it `params.gravity`, that of `[simulation]`; or `[0, 0, 0]` if it is to weigh nothing")
        })
    };
    instances.iter().filter_map(warning).collect()
}

/// Bodies that fall by themselves beside others that are connected.
fn loose(scene: &Scene, bodies: &[Body], instances: &[Instance]) -> Vec<Diagnostic> {
    let mut held = vec![false; bodies.len()];
    let acts = |instance: &&Instance| instance.class.kind != Kind::Control;
    for marker in instances.iter().filter(acts).flat_map(|instance| &instance.markers) {
        if let Some(body) = marker.body {
            held[body] = true;
        }
    }
    if scene.simulation.gravity == [0.0; 3] || !held.contains(&true) {
        return Vec::new();
    }
    let warning = |(body, _): (&Body, &bool)| {
        let span = scene.bodies.iter().find(|record| record.name.value == body.name)?.name.span.clone();
        let message = format!("no joint and no force is attached to `{}`", body.name);
        let warning = Diagnostic::warning(codes::LOOSE_BODY, message).at(span, "it falls by itself");
        Some(warning.help("attach it with a `[[joint]]`, or take it away; leave it if it is to fall"))
    };
    bodies.iter().zip(&held).filter(|(_, held)| !**held).filter_map(warning).collect()
}

/// Moments of inertia that fit no body of the scene's size, or that fit one in kg m^2 only.
fn foreign_inertias(scene: &Scene, bodies: &[Body], instances: &[Instance]) -> Vec<Diagnostic> {
    let markers = instances.iter().flat_map(|instance| &instance.markers);
    let on_bodies = markers.map(|marker| match marker.body {
        Some(body) => (marker.position - bodies[body].center_of_mass).norm(),
        None => marker.position.norm(),
    });
    let size = bodies.iter().map(|body| body.position.norm()).chain(on_bodies).fold(0.0, f64::max);
    let warning = |body: &Body| {
        let radius = (body.inertia.diagonal().max() / body.mass).sqrt();
        // What the numbers are if they are meant in SI, where they are plain and the scene's units are others.
        let otherwise = radius / scene.units.factor(Dimension::LENGTH);
        let is_of_si = radius < LEAST_SIZES * size && (FITTING * size..size).contains(&otherwise);
        let is_large = radius > MOST_RADIUS.max(MOST_SIZES * size);
        if body.particle || size == 0.0 || !(is_large || is_of_si) {
            return None;
        }
        let record = scene.bodies.iter().find(|record| record.name.value == body.name)?;
        let span = record.inertia.as_ref()?.span.clone();
        if !is_large && scene.source.slice(span.clone()).is_none_or(|written| written.contains('"')) {
            return None;
        }
        let message = format!("the moment of inertia of `{}` is that of a body of another size", body.name);
        let text = format!(
            "a radius of gyration of {}; no point of the scene is further than {} from the origin",
            length(scene, radius),
            length(scene, size)
        );
        let label = scene.units.label(Dimension::INERTIA);
        let warning = Diagnostic::warning(codes::OTHER_UNIT, message).at(span, text);
        Some(
            warning
                .help(format!("plain numbers are in {label}; write the unit, as in `\"120 g mm^2\"`, if they are not")),
        )
    };
    bodies.iter().filter_map(warning).collect()
}

/// A length in the scene's unit, with four digits.
fn length(scene: &Scene, value: f64) -> String {
    let units = &scene.units;
    format!("{} {}", in_digits(units.from_si(value, Dimension::LENGTH)), units.label(Dimension::LENGTH))
}
