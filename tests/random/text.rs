//! Scenes of [`Mechanism`]s, as text.

use std::fmt::Write;

use nalgebra::Vector3;

use super::mechanism::{Body, Mechanism, Part, Place, list, lists};

type V = Vector3<f64>;

impl Body {
    /// Principal moments as the scene has them.
    pub fn moments(&self) -> V {
        // Second moments along the axes: what is thin has none across.
        let sum = 0.5 * self.inertia.sum();
        let second = self.inertia.map(|moment| sum - moment).component_mul(&self.thinner) * self.heavier;
        let ordinary = self.thinner == V::repeat(1.0);
        let thin = V::new(second.y + second.z, second.z + second.x, second.x + second.y);
        if ordinary { self.inertia * self.heavier } else { thin }
    }
}

impl Part {
    /// The channel that is reported beside loads.
    fn told(&self) -> Option<&'static str> {
        Some(match self.kind {
            _ if self.table == "control" => "output",
            "bump-stop" | "translational-actuator" => "force",
            "rotational-bump-stop" | "rotational-actuator" => "torque",
            "joint-friction" => "friction",
            _ => return None,
        })
    }

    /// A signal as the scene names it; `@` stands for the body that is measured.
    fn signal(&self, signal: &str) -> String {
        if signal.parse::<f64>().is_ok() {
            return signal.into();
        }
        let body = self.bodies.iter().flatten().next();
        format!("\"{}\"", body.map_or_else(|| signal.into(), |body| signal.replace('@', &body.to_string())))
    }
}

impl Mechanism {
    /// The scene, with keys of `[simulation]`.
    pub fn text(&self, place: &Place, settings: &str) -> String {
        let at = |point: &V| place.turn * point + place.shift;
        let along = |vector: &V| place.turn * vector;
        let name = |body: &Option<usize>| body.map_or("\"ground\"".into(), |body| format!("\"body_{body}\""));
        let controls = self.parts.iter().any(|part| part.table == "control");
        let controls = if controls { ", \"odyn-controls\"" } else { "" };
        let mut out = format!(
            "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"{controls}]\n\n[simulation]\ngravity = {}\n{settings}\n",
            list(&along(&self.gravity))
        );
        for (k, body) in self.bodies.iter().enumerate() {
            let axes = place.turn * body.axes;
            let _ = write!(
                out,
                "\n[[body]]\nname = \"body_{k}\"\nmass = {:?}\ninertia = {}\ncom = {}\nposition = {}\n\
                 orientation = {{ x = {}, y = {} }}\nvelocity = {}\nangular_velocity = {}\n",
                body.heavier * body.mass,
                list(&body.moments()),
                list(&body.com),
                list(&at(&body.origin)),
                list(&axes.column(0).into_owned()),
                list(&axes.column(1).into_owned()),
                list(&along(&body.velocity)),
                list(&along(&body.spin)),
            );
        }
        for part in &self.parts {
            let _ = write!(out, "\n[[{}]]\nname = \"{}\"\ntype = \"{}\"\n", part.table, part.name, part.kind);
            if let Some(joint) = &part.of {
                let _ = writeln!(out, "joints = [\"{joint}\"]");
            }
            if !part.frames.is_empty() {
                let bodies: Vec<String> = part.bodies.iter().map(name).collect();
                let axis = |k: usize| lists(part.frames.iter().map(|frame| along(&frame.axes.column(k).into_owned())));
                let _ = write!(
                    out,
                    "bodies = [{}]\npoints = {}\naxes = {}\nx_axes = {}\n",
                    bodies.join(", "),
                    lists(part.frames.iter().map(|frame| at(&frame.origin))),
                    axis(2),
                    axis(0),
                );
            }
            for (key, signal) in &part.inputs {
                let _ = writeln!(out, "inputs.{key} = {}", part.signal(signal));
            }
            for (key, value) in &part.params {
                let _ = writeln!(out, "params.{key} = {value}");
            }
        }
        out + &self.outputs()
    }

    /// Centres of mass, spins, energy, balances, and the loads to judge balances by.
    fn outputs(&self) -> String {
        let mut out = String::new();
        let mut output = |name: String, keys: &str| {
            let _ = write!(out, "\n[[output]]\nname = \"{name}\"\n{keys}\n");
        };
        output("energy".into(), "quantity = \"total_energy\"");
        output("energy_of_motion".into(), "quantity = \"kinetic_energy\"");
        for (k, body) in self.bodies.iter().enumerate() {
            for c in ["x", "y", "z"] {
                let of = format!("of = \"body_{k}\"\ncomponent = \"{c}\"");
                let com = list(&body.com);
                output(format!("r_{k}_{c}"), &format!("quantity = \"position\"\npoint = {com}\n{of}"));
                output(format!("v_{k}_{c}"), &format!("quantity = \"velocity\"\npoint = {com}\n{of}"));
                output(format!("w_{k}_{c}"), &format!("quantity = \"angular_velocity\"\n{of}"));
                output(format!("f_{k}_{c}"), &format!("quantity = \"balance_force\"\n{of}"));
                output(format!("t_{k}_{c}"), &format!("quantity = \"balance_torque\"\n{of}"));
            }
            for e in ["e0", "e1", "e2", "e3"] {
                let keys = format!("quantity = \"orientation\"\nof = \"body_{k}\"\ncomponent = \"{e}\"");
                output(format!("p_{k}_{e}"), &keys);
            }
        }
        for part in &self.parts {
            if let Some(channel) = part.told() {
                let keys = format!("quantity = \"value\"\nof = \"{}\"\nchannel = \"{channel}\"", part.name);
                output(format!("y_{}", part.name), &keys);
            }
            if part.frames.is_empty() {
                continue;
            }
            let (force, torque) = match part.table {
                "joint" => ("reaction_force", "reaction_torque"),
                _ => ("force", "torque"),
            };
            let mut on: Vec<usize> = part.bodies.iter().flatten().copied().collect();
            on.sort_unstable();
            on.dedup();
            for (body, c) in on.iter().flat_map(|body| ["x", "y", "z"].map(|c| (body, c))) {
                for (letter, quantity) in [("F", force), ("T", torque)] {
                    let name = format!("{letter}_{}_{body}_{c}", part.name);
                    let of = &part.name;
                    let keys =
                        format!("quantity = \"{quantity}\"\nof = \"{of}\"\non = \"body_{body}\"\ncomponent = \"{c}\"");
                    output(name, &keys);
                }
            }
        }
        out
    }
}
