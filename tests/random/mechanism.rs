//! [`Mechanism`]: a scene made of random numbers that can be assembled, since its joints are put where the bodies are.
//!
//! Bodies are placed one after the other along a tree of joints with random coordinates and rates; further joints, which
//! close loops, get one frame anywhere and the other one where the joint's equations hold. So everything fits at the start,
//! and in trees the velocities do too.

use nalgebra::{Matrix3, Vector3};

use super::numbers::Random;
use super::relation::{Relation, about_z, number, relation};

type V = Vector3<f64>;
type M = Matrix3<f64>;

/// What the joints of a mechanism have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Nothing.
    Spatial,
    /// They move parallel to a plane: loops have three redundant rows each.
    Planar,
    /// All axes meet in one point: the same.
    Spherical,
}

/// A frame in ground at the start.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub origin: V,
    pub axes: M,
}

/// A body at the start; `com`, `inertia` in its own axes.
#[derive(Debug, Clone)]
pub struct Body {
    /// Of an ordinary body; that of the scene is `heavier` times as much.
    pub mass: f64,
    /// Principal moments of an ordinary body.
    pub inertia: V,
    /// Factor of mass and inertia.
    pub heavier: f64,
    /// Further factor of its second moments along its own axes: a thin rod has two small ones.
    pub thinner: V,
    pub com: V,
    pub origin: V,
    pub axes: M,
    /// Of the origin.
    pub velocity: V,
    pub spin: V,
}

/// A joint, force or control element.
#[derive(Debug, Clone)]
pub struct Part {
    pub name: String,
    pub table: &'static str,
    pub kind: &'static str,
    /// Those it acts on; of a control element, those it measures.
    pub bodies: Vec<Option<usize>>,
    pub frames: Vec<Frame>,
    pub params: Vec<(&'static str, String)>,
    /// Signals it takes: `part.channel`, the name of an output, or a number.
    pub inputs: Vec<(&'static str, String)>,
    /// The joint whose reaction it takes, in place of bodies and frames.
    pub of: Option<String>,
    /// Whether bodies were placed by it.
    pub carries: bool,
}

impl Part {
    /// Whether it takes a signal or the reaction of another part.
    fn needs(&self, other: &str) -> bool {
        // `part.channel`, or one of its loads: `F_part_body_x`.
        let load = |signal: &str| {
            let name =
                signal.strip_prefix("F_").or(signal.strip_prefix("T_")).and_then(|rest| rest.strip_prefix(other));
            name.is_some_and(|rest| rest.starts_with('_'))
        };
        let from =
            |signal: &String| signal.strip_prefix(other).is_some_and(|rest| rest.starts_with('.')) || load(signal);
        self.of.as_deref() == Some(other) || self.inputs.iter().any(|(_, signal)| from(signal))
    }
}

/// See the module documentation.
#[derive(Debug, Clone)]
pub struct Mechanism {
    pub gravity: V,
    pub bodies: Vec<Body>,
    pub parts: Vec<Part>,
    /// Nothing is attached to the ground, and nothing acts from outside.
    pub floats: bool,
}

/// Where a scene is put as a whole.
pub struct Place {
    pub turn: M,
    pub shift: V,
}

impl Place {
    pub fn as_it_is() -> Self {
        Self { turn: M::identity(), shift: V::zeros() }
    }

    pub fn random(random: &mut Random) -> Self {
        Self { turn: random.rotation(), shift: random.vector(3.0) }
    }
}

const SPATIAL: [&str; 19] = [
    "revolute",
    "cylindrical",
    "translational",
    "spherical",
    "universal",
    "planar",
    "screw",
    "constant-velocity",
    "distance-rod",
    "point-in-plane",
    "point-on-line",
    "parallel-axes",
    "perpendicular-axes",
    "point",
    "point-on-curve",
    "cam",
    "bracket",
    "knife-edge",
    "rolling-disc",
];
const PLANAR: [&str; 5] = ["revolute", "revolute", "translational", "distance-rod", "bracket"];
const SPHERICAL: [&str; 4] = ["revolute", "revolute", "universal", "spherical"];

pub(super) fn list(v: &V) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

pub(super) fn lists(vectors: impl Iterator<Item = V>) -> String {
    let texts: Vec<String> = vectors.map(|v| list(&v)).collect();
    format!("[{}]", texts.join(", "))
}

impl Mechanism {
    /// A mechanism of a style; the same for the same seed.
    pub fn new(seed: u64, style: Style) -> Self {
        let mut random = Random::new(seed);
        let floats = style == Style::Spatial && random.chance(0.25);
        let gravity = match style {
            _ if floats => V::zeros(),
            Style::Planar => about_z(random.between(0.0, 6.0)) * V::x() * 9.81,
            _ => random.direction() * 9.81,
        };
        let mut mechanism = Self { gravity, bodies: Vec::new(), parts: Vec::new(), floats };
        let count = 1 + random.below(5);
        let mut freedoms = 0;
        for _ in 0..count {
            freedoms += mechanism.grow(style, &mut random);
        }
        for _ in 0..random.below(3) {
            mechanism.close(style, &mut random, &mut freedoms);
        }
        if random.chance(0.3) {
            mechanism.couple(&mut random, &mut freedoms);
        }
        for _ in 0..random.below(4) {
            mechanism.push(style, &mut random);
        }
        mechanism
    }

    /// A frame on a body, or anywhere in ground.
    pub(super) fn frame(&self, body: Option<usize>, style: Style, kind: &str, random: &mut Random) -> Frame {
        let near = body.map_or(V::zeros(), |body| self.bodies[body].origin);
        let origin = near + random.vector(0.6);
        match style {
            Style::Spatial => Frame { origin, axes: random.rotation() },
            Style::Spherical => Frame { origin: V::zeros(), axes: random.rotation() },
            Style::Planar => {
                let along = about_z(random.between(-3.0, 3.0));
                // A slide's axis lies in the plane, with the frame's x axis across it.
                let axes = match kind {
                    "translational" => M::from_columns(&[V::z(), along * -V::y(), along * V::x()]),
                    _ => along,
                };
                Frame { origin: V::new(origin.x, origin.y, 0.0), axes }
            }
        }
    }

    fn relation(kind: &'static str, style: Style, random: &mut Random) -> Relation {
        let mut found = relation(kind, random);
        if style == Style::Planar && kind == "distance-rod" {
            let along = about_z(random.between(-3.0, 3.0));
            found.place = along * V::x() * found.place.norm();
            found.velocity = along * V::y() * found.velocity.norm();
            found.turn = about_z(random.between(-3.0, 3.0));
            found.spin = V::z() * found.spin.z;
        }
        found
    }

    pub(super) fn part(
        &mut self,
        table: &'static str,
        kind: &'static str,
        bodies: &[Option<usize>],
        frames: &[Frame],
    ) -> &mut Part {
        self.parts.push(Part {
            name: format!("{}_{}", kind.replace('-', "_"), self.parts.len()),
            table,
            kind,
            bodies: bodies.to_vec(),
            frames: frames.to_vec(),
            params: Vec::new(),
            inputs: Vec::new(),
            of: None,
            carries: false,
        });
        self.parts.last_mut().unwrap()
    }

    /// Adds a body on a joint; gives its freedoms.
    fn grow(&mut self, style: Style, random: &mut Random) -> i64 {
        let first = self.bodies.is_empty();
        let alone = first && self.floats;
        let parent = match self.bodies.len() {
            0 => None,
            _ if !self.floats && random.chance(0.25) => None,
            count => Some(random.below(count)),
        };
        let kind = match style {
            Style::Spatial if parent.is_none() && !alone && random.chance(0.08) => "position",
            Style::Spatial if parent.is_none() && !alone && random.chance(0.05) => "ground",
            Style::Spatial => random.of(&SPATIAL),
            Style::Planar => random.of(&PLANAR),
            Style::Spherical => random.of(&SPHERICAL),
        };
        let i = self.frame(parent, style, kind, random);
        let mut relation = Self::relation(kind, style, random);
        let driven = parent.is_none() && !alone && random.chance(0.2) && ["revolute", "translational"].contains(&kind);
        if driven {
            // As its driver asks for.
            (relation.spin, relation.velocity) =
                if kind == "revolute" { (V::z() * 1.3, V::zeros()) } else { (V::zeros(), V::z() * 0.2) };
        }
        let j = Frame { origin: i.origin + i.axes * relation.place, axes: i.axes * relation.turn };
        let (turning, moving) = match parent {
            Some(parent) => {
                let body = &self.bodies[parent];
                (body.spin, body.velocity + body.spin.cross(&(j.origin - body.origin)))
            }
            None => (V::zeros(), V::zeros()),
        };
        let spin = turning + i.axes * relation.spin;
        let at_joint = moving + i.axes * relation.velocity;
        let (offset, axes) = match style {
            Style::Planar => {
                let v = random.vector(0.5);
                (V::new(v.x, v.y, 0.0), about_z(random.between(-3.0, 3.0)))
            }
            _ => (random.vector(0.5), random.rotation()),
        };
        let mass = random.decades(-1.5, 1.5);
        let second = V::from_fn(|_, _| mass * 0.09 * random.between(0.1, 1.0));
        let mut com = random.vector(0.2);
        if style == Style::Planar {
            com.z = 0.0;
        }
        let child = self.bodies.len();
        self.bodies.push(Body {
            mass,
            inertia: V::new(second.y + second.z, second.z + second.x, second.x + second.y),
            heavier: 1.0,
            thinner: V::repeat(1.0),
            com,
            origin: j.origin + offset,
            axes,
            velocity: at_joint + spin.cross(&offset),
            spin,
        });
        if alone {
            return 6;
        }
        let part = self.part("joint", kind, &[parent, Some(child)], &[i, j]);
        part.params = relation.params;
        part.carries = true;
        if driven {
            let (kind, key, law) = match kind {
                "revolute" => ("rotation-driver", "angle", "\"0.7 t + 0.2 sin(3 t)\""),
                _ => ("displacement-driver", "displacement", "\"0.1 sin(2 t)\""),
            };
            self.part("joint", kind, &[parent, Some(child)], &[i, i]).params = vec![(key, law.into())];
        }
        self.own(style) - self.rows(style, relation.rows) - i64::from(driven)
    }

    /// Whether a joint depends on time: a loop would often not let it.
    fn is_driven(&self) -> bool {
        self.parts.iter().any(|part| part.kind.ends_with("driver") || part.kind == "position")
    }

    /// Freedoms of a body alone.
    fn own(&self, style: Style) -> i64 {
        if style == Style::Spatial { 6 } else { 3 }
    }

    /// Freedoms that a joint of so many rows takes away.
    fn rows(&self, style: Style, rows: usize) -> i64 {
        // Of six freedoms, three are not there to be taken away: a hinge takes two, a weld all three.
        if style == Style::Spatial { rows as i64 } else { (rows as i64 - 3).max(i64::from(rows == 1)) }
    }

    /// Adds a joint that closes a loop, if enough freedoms are left.
    fn close(&mut self, style: Style, random: &mut Random, freedoms: &mut i64) {
        let kinds: &[&'static str] = match style {
            Style::Spatial => &SPATIAL[..SPATIAL.len() - 1],
            Style::Planar => &PLANAR[..4],
            Style::Spherical => &SPHERICAL[..3],
        };
        let kind = random.of(kinds);
        let j_body = random.below(self.bodies.len());
        let i_body = if !self.floats && random.chance(0.6) { None } else { Some(random.below(self.bodies.len())) };
        let i = self.frame(i_body, style, kind, random);
        let relation = Self::relation(kind, style, random);
        let taken = self.rows(style, relation.rows);
        if i_body == Some(j_body) || *freedoms - taken < 1 || self.is_driven() {
            return;
        }
        *freedoms -= taken;
        let j = Frame { origin: i.origin + i.axes * relation.place, axes: i.axes * relation.turn };
        self.part("joint", kind, &[i_body, Some(j_body)], &[i, j]).params = relation.params;
    }

    /// Ties the coordinates of two joints of the tree.
    fn couple(&mut self, random: &mut Random, freedoms: &mut i64) {
        let of = |kind: &str| -> Vec<Part> {
            self.parts.iter().filter(|part| part.carries && part.kind == kind).cloned().collect()
        };
        let (turns, slides) = (of("revolute"), of("translational"));
        if *freedoms < 2 || self.is_driven() {
            return;
        }
        let ratio = random.between(0.3, 2.0);
        let words = |first: &str, second: &str, key: &'static str| {
            vec![("first", format!("\"{first}\"")), ("second", format!("\"{second}\"")), (key, number(ratio))]
        };
        let (kind, params, first, second) = match (turns.as_slice(), slides.as_slice()) {
            ([one, .., two], _) if random.chance(0.5) => {
                let teeth = vec![("teeth_1", "20".into()), ("teeth_2", "33".into()), ("internal", "true".into())];
                ("gear", teeth, one, two)
            }
            ([one, .., two], _) => ("coupler", words("rotation", "rotation", "ratio"), one, two),
            ([one], [two, ..]) if random.chance(0.5) => {
                ("rack-and-pinion", vec![("radius", number(0.2 * ratio))], one, two)
            }
            ([one], [two, ..]) => ("coupler", words("rotation", "translation", "lead"), one, two),
            (_, [one, .., two]) => ("coupler", words("translation", "translation", "ratio"), one, two),
            _ => return,
        };
        *freedoms -= 1;
        let (bodies, frames) = ([&first.bodies[..], &second.bodies[..]].concat(), [first.frames[0], second.frames[0]]);
        let frames = [frames[0], frames[0], frames[1], frames[1]];
        self.part("joint", kind, &bodies, &frames).params = params;
    }

    /// Adds a force element.
    fn push(&mut self, style: Style, random: &mut Random) {
        let j_body = random.below(self.bodies.len());
        let i_body = if self.floats { Some(random.below(self.bodies.len())) } else { None };
        let i_body = if random.chance(0.5) { Some(random.below(self.bodies.len())) } else { i_body };
        if i_body == Some(j_body) {
            return;
        }
        let mass = i_body.map_or(f64::INFINITY, |body| self.bodies[body].mass).min(self.bodies[j_body].mass);
        let (pace, loss) = (random.decades(0.0, 1.3), if random.chance(0.5) { random.between(0.0, 0.5) } else { 0.0 });
        let (stiffness, damping) = (mass * pace * pace, loss * mass * pace);
        let (mut i, mut j) = (self.frame(i_body, style, "", random), self.frame(Some(j_body), style, "", random));
        if style == Style::Spherical {
            // Apart from the point that does not move.
            i.origin = i_body.map_or_else(|| random.vector(0.8), |body| self.bodies[body].origin);
            j.origin = self.bodies[j_body].origin;
        }
        let three = |value: f64| list(&V::new(value, 1.5 * value, 0.7 * value));
        let inside = ["translational-spring-damper", "bushing", "rotational-spring-damper"];
        let outside = ["vector-force", "uniform-gravity", "drag", "vector-torque"];
        let from_outside = !self.floats && i_body.is_none() && style != Style::Planar && random.chance(0.5);
        let kind = if from_outside { random.of(&outside) } else { random.of(&inside) };
        let mut bodies = vec![i_body, Some(j_body)];
        let mut frames = vec![i, j];
        let params = match kind {
            "translational-spring-damper" => {
                let length = (j.origin - i.origin).norm();
                if length < 0.2 {
                    return;
                }
                let free = number(length * random.between(0.7, 1.3));
                vec![("stiffness", number(stiffness)), ("damping", number(damping)), ("free_length", free)]
            }
            "bushing" => {
                frames[0] = frames[1];
                vec![
                    ("stiffness", three(stiffness)),
                    ("damping", three(damping)),
                    ("rotational_stiffness", three(0.05 * stiffness)),
                    ("rotational_damping", three(0.05 * damping)),
                ]
            }
            "rotational-spring-damper" => {
                let Some(hinge) = self.parts.iter().find(|part| part.carries && part.kind == "revolute") else {
                    return;
                };
                bodies.clone_from(&hinge.bodies);
                frames = vec![hinge.frames[0]; 2];
                vec![("stiffness", number(0.05 * stiffness)), ("damping", number(0.05 * damping))]
            }
            "uniform-gravity" => {
                j.origin = self.bodies[j_body].origin + self.bodies[j_body].axes * self.bodies[j_body].com;
                frames[1] = j;
                vec![("mass", number(mass)), ("acceleration", list(&random.vector(5.0)))]
            }
            "drag" => vec![("coefficient", number(random.between(0.2, 2.0))), ("area", number(0.1 * mass))],
            _ => {
                let law = |size: f64| format!("\"{size:?} cos(5 t)\"");
                let size = if kind == "vector-force" { 5.0 * mass } else { 0.2 * mass };
                vec![("x", law(size)), ("z", number(0.5 * size)), ("follower", random.chance(0.5).to_string())]
            }
        };
        self.part("force", kind, &bodies, &frames).params = params;
    }

    /// The same without one of the parts, with one of the bodies ordinary, or without it and all that hangs on it; `None`
    /// where there is nothing to leave out. Numbers count parts first, then bodies twice.
    pub fn without(&self, number: usize) -> Option<Self> {
        let mut smaller = self.clone();
        if let Some(part) = self.parts.get(number) {
            if part.carries || self.parts.iter().any(|other| other.needs(&part.name)) {
                return None;
            }
            smaller.parts.remove(number);
            return Some(smaller);
        }
        let number = number - self.parts.len();
        if let Some(body) = smaller.bodies.get_mut(number) {
            let ordinary = (1.0, V::repeat(1.0));
            if (body.heavier, body.thinner) == ordinary {
                return None;
            }
            (body.heavier, body.thinner) = ordinary;
            return Some(smaller);
        }
        let body = number - self.bodies.len();
        if self.bodies.len() < 2 {
            return None;
        }
        // Its joint goes with it; those that hang on it must have gone before.
        let is_free = |part: &Part| !part.bodies.contains(&Some(body)) || part.carries && part.bodies[1] == Some(body);
        let goes = |name: &str| self.parts.iter().any(|part| part.name == name && part.bodies.contains(&Some(body)));
        let needed = |part: &Part| part.of.as_deref().is_some_and(goes);
        if !self.parts.iter().all(is_free) || self.parts.iter().any(needed) || (self.floats && body == 0) {
            return None;
        }
        smaller.bodies.remove(body);
        smaller.parts.retain(|part| !part.bodies.contains(&Some(body)));
        let index = |own: &mut Option<usize>| *own = own.map(|own| if own > body { own - 1 } else { own });
        smaller.parts.iter_mut().flat_map(|part| &mut part.bodies).for_each(index);
        Some(smaller)
    }

    /// How many numbers [`Mechanism::without`] knows.
    pub fn removable(&self) -> usize {
        self.parts.len() + 2 * self.bodies.len()
    }
}
