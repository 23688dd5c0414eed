//! [`Mechanism::furnished`]: mechanisms with all standard elements, and with masses over 18 decades.
//!
//! Loads are in proportion to the lightest body they act on, so that motions stay of the order of metres and radians per
//! second whatever the masses.

use nalgebra::Vector3;

use super::mechanism::{Frame, Mechanism, Part, Style, list};
use super::numbers::Random;
use super::relation::number;

type V = Vector3<f64>;

/// Duration of the runs for which the laws of time are made, s.
pub const DURATION: f64 = 1.0;

const LOADS: [&str; 11] = [
    "translational-spring-damper",
    "bushing",
    "field",
    "beam",
    "bump-stop",
    "translational-actuator",
    "vector-force",
    "vector-torque",
    "drag",
    "point-gravity",
    "uniform-gravity",
];

fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

/// Nine numbers of a symmetric, positive definite matrix.
fn matrix(random: &mut Random, size: f64) -> String {
    let aside = random.vector(0.2 * size);
    let along = [1.0, 1.5, 0.7].map(|share| share * size);
    let rows = [along[0], aside.x, aside.y, aside.x, along[1], aside.z, aside.y, aside.z, along[2]];
    format!("{rows:?}")
}

/// Points of a curve over an argument of about this size.
fn points(random: &mut Random, argument: f64, size: f64) -> String {
    let count = 2 + random.below(5);
    let mut at = -argument * random.between(0.2, 1.0);
    let mut points = Vec::new();
    for _ in 0..=count {
        points.push(format!("[{at:?}, {:?}]", random.between(-size, size)));
        at += argument * random.between(0.1, 0.8);
    }
    format!("[{}]", points.join(", "))
}

/// A function of time of this size: waves, ramps, pulses, steps, curves.
pub(super) fn of_time(random: &mut Random, size: f64) -> String {
    let (pace, at) = (random.decades(0.0, 1.5), random.between(0.1, 0.9) * DURATION);
    let width = DURATION * random.decades(-2.0, -0.7);
    match random.below(7) {
        0 => number(size),
        1 => quoted(&format!("{size:?} sin({pace:?} t)")),
        2 => quoted(&format!("{size:?} t^2")),
        3 => quoted(&format!("{size:?} exp(-((t - {at:?}) / {width:?})^2)")),
        4 => quoted(&format!("{size:?} tanh((t - {at:?}) / {width:?})")),
        5 => quoted(&format!("{size:?} max(0, 1 - abs(t - {at:?}) / {width:?})")),
        _ => {
            let edges = [0.0, at, at + 0.2 * width, at + width, at + 1.2 * width, 2.0 * DURATION + at];
            let heights = [0.0, 0.0, size, size, 0.0, 0.0];
            let points: Vec<String> = edges.iter().zip(heights).map(|(t, y)| format!("[{t:?}, {y:?}]")).collect();
            format!("[{}]", points.join(", "))
        }
    }
}

/// A function of a length, an angle or a speed of about `argument`, of this size; against it if `against`.
fn of(random: &mut Random, variable: &str, argument: f64, size: f64, against: bool) -> String {
    let (near, sign) = (argument * random.decades(-1.0, 0.0), if against { "-" } else { "" });
    match random.below(4) {
        0 => quoted(&format!("{sign}{size:?} tanh({variable} / {near:?})")),
        1 => quoted(&format!("{sign}{:?} {variable} * abs({variable})", size / (argument * argument))),
        2 if against => {
            let (most, knee) = (size, near);
            format!(
                "[[{:?}, {most:?}], [{:?}, {most:?}], [{knee:?}, {:?}], [{:?}, {:?}]]",
                -4.0 * argument,
                -knee,
                -most,
                4.0 * argument,
                -most
            )
        }
        2 => quoted(&format!("{size:?} max(0, {variable} - {near:?}) / {argument:?}")),
        _ => points(random, argument, size),
    }
}

impl Mechanism {
    /// A mechanism of a style with one to five further elements; one of three has masses over many decades. The same for the
    /// same seed.
    pub fn furnished(seed: u64, style: Style) -> Self {
        let mut mechanism = Self::new(seed, style);
        let mut random = Random::new(seed ^ 0x0f0b_0e17);
        if random.chance(0.35) {
            mechanism.weigh(&mut random);
        }
        for _ in 0..1 + random.below(5) {
            match random.below(4) {
                0 => mechanism.furnish_hinge(&mut random),
                1 => mechanism.furnish_slide(&mut random),
                2 if random.chance(0.5) => mechanism.control(&mut random),
                _ => mechanism.furnish(style, &mut random),
            }
        }
        mechanism.measure(&mut Random::new(seed ^ 0x005e_2505));
        mechanism.dampen(style, &mut Random::new(seed ^ 0x0d0a_3b1e));
        mechanism.inert(style, &mut Random::new(seed ^ 0x11e7_7e25));
        mechanism
    }

    /// A mechanism of a style with one to four contacts: stops, freewheels, points that strike planes, balls. The same for the same
    /// seed.
    pub fn striking(seed: u64, style: Style) -> Self {
        let mut mechanism = Self::new(seed, style);
        let mut random = Random::new(seed ^ 0x57_12_1c_e5);
        for _ in 0..1 + random.below(4) {
            let restitution = ("restitution", number(random.of(&[0.0, 0.0, 0.4, 0.9])));
            match random.below(5) {
                kind @ (0 | 1) => {
                    let Some(hinge) = mechanism.one_of("revolute", &mut random) else { continue };
                    let frames = [hinge.frames[0], hinge.frames[0]];
                    if kind == 0 {
                        mechanism.part("joint", "freewheel", &hinge.bodies, &frames);
                        continue;
                    }
                    let mut params = vec![restitution, ("upper", number(random.decades(-2.0, 0.0)))];
                    if random.chance(0.5) {
                        params.push(("lower", number(-random.decades(-2.0, 0.0))));
                    }
                    mechanism.part("joint", "rotational-stop", &hinge.bodies, &frames).params = params;
                }
                2 => {
                    let Some(slide) = mechanism.one_of("translational", &mut random) else { continue };
                    let frames = [slide.frames[0], slide.frames[1]];
                    let along = frames[0].axes.column(2).dot(&(frames[1].origin - frames[0].origin));
                    let gap = random.decades(-2.0, 0.0);
                    let end = if random.chance(0.5) { ("upper", along + gap) } else { ("lower", along - gap) };
                    mechanism.part("joint", "translational-stop", &slide.bodies, &frames).params =
                        vec![restitution, (end.0, number(end.1))];
                }
                kind => {
                    let (one, other) = (random.below(mechanism.bodies.len()), random.below(mechanism.bodies.len()));
                    let first = (random.chance(0.5) && one != other).then_some(other);
                    let bodies = [first, Some(one)];
                    let (mut i, j) = (
                        mechanism.frame(first, style, "", &mut random),
                        mechanism.frame(Some(one), style, "", &mut random),
                    );
                    let apart = (j.origin - i.origin).norm();
                    if kind == 3 {
                        let radius = if random.chance(0.5) { 0.0 } else { random.decades(-2.0, -1.0) };
                        i.origin = j.origin - i.axes.column(2) * (radius + random.decades(-2.0, 0.0));
                        let is_rough = random.chance(0.3);
                        let rough = ("rough", is_rough.to_string());
                        mechanism.part("joint", "plane-contact", &bodies, &[i, j]).params =
                            vec![restitution, ("radius", number(radius)), rough];
                        if !is_rough && random.chance(0.5) {
                            let name = mechanism.parts.last().map(|part| part.name.clone());
                            let friction = mechanism.part("force", "contact-friction", &[], &[]);
                            friction.of = name;
                            friction.params = vec![
                                ("radius", number(radius)),
                                ("mu", number(random.between(0.05, 0.4))),
                                ("transition_speed", number(random.decades(-2.0, -1.0))),
                            ];
                        }
                    } else if apart > 0.1 {
                        let share = 0.5 * apart * random.between(0.5, 0.98);
                        mechanism.part("joint", "ball-contact", &bodies, &[i, j]).params =
                            vec![restitution, ("radius_i", number(share)), ("radius_j", number(share))];
                    }
                }
            }
        }
        let mut random = Random::new(seed ^ 0x0000_709e_5eed);
        if random.chance(0.3) {
            mechanism.tie(style, &mut random);
        }
        mechanism
    }

    /// Adds a slack rope over three to six points of any bodies.
    fn tie(&mut self, style: Style, random: &mut Random) {
        let count = 3 + random.below(4);
        let bodies: Vec<Option<usize>> =
            (0..count).map(|_| random.chance(0.7).then(|| random.below(self.bodies.len()))).collect();
        let frames: Vec<Frame> = bodies.iter().map(|body| self.frame(*body, style, "", random)).collect();
        let strands: Vec<f64> = frames.windows(2).map(|pair| (pair[1].origin - pair[0].origin).norm()).collect();
        let same = bodies.iter().all(|body| *body == bodies[0]);
        if same || strands.iter().any(|strand| *strand < 0.1) {
            return;
        }
        let length = strands.iter().sum::<f64>() + random.decades(-2.0, 0.0);
        self.part("joint", "rope", &bodies, &frames).params = vec![
            ("length", number(length)),
            ("slack", "true".into()),
            ("restitution", number(random.of(&[0.0, 0.0, 0.4, 0.9]))),
        ];
    }

    /// Adds sensors with a lag, from which nothing follows: of reactions and, less often since joint coordinates have none, of
    /// Euler parameters. Across a plane both are zero but for round-off.
    fn measure(&mut self, random: &mut Random) {
        let largest = (0..self.bodies.len()).map(|body| self.mass(Some(body))).fold(0.0, f64::max);
        for _ in 0..random.below(3) {
            let lag = ("time_constant", number(random.decades(-2.5, -0.5)));
            if random.chance(0.25) {
                let body = random.below(self.bodies.len());
                let e = random.of(&["e0", "e1", "e2", "e3"]);
                let part = self.part("control", "sensor", &[Some(body)], &[]);
                (part.inputs, part.params) = (vec![("input", format!("p_@_{e}"))], vec![lag]);
                continue;
            }
            let joints: Vec<&Part> = self.parts.iter().filter(|part| part.table == "joint").collect();
            if joints.is_empty() {
                return;
            }
            let joint = joints[random.below(joints.len())];
            let Some(body) = joint.bodies.iter().flatten().next().copied() else { continue };
            let (letter, c) = (random.of(&["F", "T"]), random.of(&["x", "y", "z"]));
            let signal = format!("{letter}_{}_@_{c}", joint.name);
            let part = self.part("control", "sensor", &[Some(body)], &[]);
            (part.inputs, part.params) = (vec![("input", signal)], vec![lag, ("gain", number(1.0 / (10.0 * largest)))]);
        }
    }

    /// Gives bodies any mass; forces that were in proportion to others are left out.
    fn weigh(&mut self, random: &mut Random) {
        self.parts.retain(|part| part.table != "force");
        for body in &mut self.bodies {
            if random.chance(0.6) {
                body.heavier = random.decades(-9.0, 9.0);
            }
            if random.chance(0.15) {
                let thin = random.decades(-8.0, -1.0);
                body.thinner = V::new(1.0, thin, thin);
            }
        }
    }

    fn mass(&self, body: Option<usize>) -> f64 {
        body.map_or(f64::INFINITY, |body| self.bodies[body].heavier * self.bodies[body].mass)
    }

    fn moment(&self, body: Option<usize>) -> f64 {
        body.map_or(f64::INFINITY, |body| self.bodies[body].moments().min())
    }

    /// The lightest of the bodies, and the smallest of their moments of inertia.
    pub(super) fn lightest(&self, bodies: &[Option<usize>]) -> (f64, f64) {
        let least =
            |size: &dyn Fn(Option<usize>) -> f64| bodies.iter().fold(f64::INFINITY, |least, b| least.min(size(*b)));
        (least(&|body| self.mass(body)), least(&|body| self.moment(body)))
    }

    /// One of the joints of the tree of a kind.
    pub(super) fn one_of(&self, kind: &str, random: &mut Random) -> Option<Part> {
        let found: Vec<&Part> = self.parts.iter().filter(|part| part.carries && part.kind == kind).collect();
        (!found.is_empty()).then(|| found[random.below(found.len())].clone())
    }

    /// Adds a force element at a hinge.
    fn furnish_hinge(&mut self, random: &mut Random) {
        let Some(hinge) = self.one_of("revolute", random) else { return };
        let (mass, moment) = self.lightest(&hinge.bodies);
        let pace = random.decades(0.0, 1.5);
        let (stiffness, torque) = (moment * pace * pace, 5.0 * moment);
        let kind =
            random.of(&["rotational-spring-damper", "rotational-bump-stop", "rotational-actuator", "joint-friction"]);
        let mut params = Vec::new();
        match kind {
            "rotational-spring-damper" => {
                params.push(("stiffness", number(stiffness)));
                params.push(("damping", number(moment * pace * random.between(0.0, 0.3))));
                if random.chance(0.4) {
                    params.push(("torque_of_deflection", of(random, "phi", 1.0, torque, true)));
                }
                if random.chance(0.4) {
                    params.push(("torque_of_speed", of(random, "omega", 2.0, torque, true).replace("\"-", "\"")));
                }
            }
            "rotational-bump-stop" => {
                let (lower, upper) = (-random.decades(-1.5, 0.3), random.decades(-1.5, 0.3));
                params.extend([("lower", number(lower)), ("upper", number(upper))]);
                params.extend([
                    ("torque", number(moment * random.decades(0.5, 2.5))),
                    ("depth", number(random.decades(-2.5, -1.0))),
                ]);
                params.extend([
                    ("exponent", random.of(&["1.0", "1.5", "2.0"]).into()),
                    ("damping", number(random.of(&[0.0, 0.2]))),
                ]);
            }
            "rotational-actuator" => {
                params.push(("of_time", of_time(random, torque)));
                if random.chance(0.5) {
                    params.push(("of_speed", of(random, "omega", 3.0, torque, true)));
                }
                if random.chance(0.3) {
                    params.push(("of_angle", of(random, "phi", 1.0, torque, true)));
                }
            }
            _ => return self.rub(&hinge, "rotation", &[("radius", 0.02)], mass, random),
        }
        self.part("force", kind, &hinge.bodies, &[hinge.frames[0], hinge.frames[0]]).params = params;
    }

    /// Adds friction to a joint.
    fn rub(&mut self, joint: &Part, kind: &str, more: &[(&'static str, f64)], mass: f64, random: &mut Random) {
        let mut params = vec![("kind", quoted(kind)), ("mu", number(random.between(0.05, 0.4)))];
        params.push(("transition_speed", number(random.decades(-2.5, -1.0))));
        if random.chance(0.5) {
            params.push(("preload", number(mass * random.between(0.0, 10.0))));
        }
        params.extend(more.iter().map(|(key, value)| (*key, number(*value))));
        let part = self.part("force", "joint-friction", &[], &[]);
        (part.params, part.of) = (params, Some(joint.name.clone()));
    }

    /// Adds a force element at a slide.
    fn furnish_slide(&mut self, random: &mut Random) {
        let Some(slide) = self.one_of("translational", random) else { return };
        let (mass, _) = self.lightest(&slide.bodies);
        if random.chance(0.3) {
            return self.rub(&slide, "translation", &[], mass, random);
        }
        let frames = [slide.frames[0], slide.frames[1]];
        let along = frames[0].axes.column(2).dot(&(frames[1].origin - frames[0].origin));
        if random.chance(0.5) {
            return self.stop(&slide.bodies, &frames, along, mass, random);
        }
        let mut params = vec![("along", quoted("axis")), ("of_time", of_time(random, 5.0 * mass))];
        if random.chance(0.5) {
            params.push(("of_speed", of(random, "v", 1.0, 5.0 * mass, true)));
        }
        self.part("force", "translational-actuator", &slide.bodies, &frames).params = params;
    }

    /// Adds a stop some way from where frame j is along z of frame i.
    fn stop(&mut self, bodies: &[Option<usize>], frames: &[Frame; 2], along: f64, mass: f64, random: &mut Random) {
        let gap = random.decades(-2.0, 0.0);
        let (key, place) = if random.chance(0.5) { ("upper", along + gap) } else { ("lower", along - gap) };
        let (exponent, damping) = (random.of(&["1.0", "1.5", "3.0"]), random.of(&[0.0, 0.0, 0.3]));
        self.part("force", "bump-stop", bodies, frames).params = vec![
            (key, number(place)),
            ("force", number(mass * random.decades(1.0, 3.0))),
            ("depth", number(random.decades(-2.5, -1.0))),
            ("exponent", exponent.into()),
            ("damping", number(damping)),
        ];
    }

    /// Adds a force element anywhere.
    fn furnish(&mut self, style: Style, random: &mut Random) {
        let kind = random.of(&LOADS);
        let j_body = random.below(self.bodies.len());
        let other = random.below(self.bodies.len());
        let i_body = (random.chance(0.4) && other != j_body).then_some(other);
        let bodies = [i_body, Some(j_body)];
        let (mass, moment) = self.lightest(&bodies);
        let pace = random.decades(-0.5, 1.5);
        let (stiffness, turning) = (mass * pace * pace, moment * pace * pace);
        let loss = if random.chance(0.5) { random.between(0.0, 0.3) / pace } else { 0.0 };
        let (mut i, mut j) = (self.frame(i_body, style, "", random), self.frame(Some(j_body), style, "", random));
        if self.bodies[j_body].thinner.y < 1.0 {
            // On the axis of a thin rod, about which anything else would turn it very fast.
            let body = &self.bodies[j_body];
            j.origin = body.origin + body.axes * (body.com + V::x() * random.between(-0.5, 0.5));
        }
        let com = self.bodies[j_body].origin + self.bodies[j_body].axes * self.bodies[j_body].com;
        let three = |value: f64| list(&V::new(value, 1.5 * value, 0.7 * value));
        let apart = (j.origin - i.origin).norm();
        let own = self.mass(Some(j_body));
        let mut inputs = Vec::new();
        let params = match kind {
            "translational-spring-damper" | "translational-actuator" | "point-gravity" if apart < 0.2 => return,
            "translational-spring-damper" => {
                let mut params = vec![("stiffness", number(stiffness)), ("damping", number(loss * stiffness))];
                params.push(("free_length", number(apart * random.between(0.7, 1.3))));
                if random.chance(0.5) {
                    params.push(("force_of_elongation", of(random, "x", 0.2, 3.0 * mass, true).replace("\"-", "\"")));
                }
                if random.chance(0.3) {
                    params.push(("force_of_speed", of(random, "v", 1.0, mass, true).replace("\"-", "\"")));
                }
                params
            }
            "bushing" => {
                i = j;
                vec![
                    ("stiffness", three(stiffness)),
                    ("damping", three(loss * stiffness)),
                    ("rotational_stiffness", three(turning)),
                    ("rotational_damping", three(loss * turning)),
                ]
            }
            "field" => {
                i = j;
                let preload = random.vector(mass);
                vec![
                    ("translation", matrix(random, stiffness)),
                    ("rotation", matrix(random, turning)),
                    ("rotation_damping", matrix(random, loss * turning + f64::MIN_POSITIVE)),
                    ("preload_force", list(&preload)),
                ]
            }
            "beam" => {
                let length = random.between(0.2, 1.0);
                i = Frame { origin: j.origin - j.axes * V::x() * length, axes: j.axes };
                // Stiffnesses of the free end: E A / L, and 4 E I / L about it.
                let (area, second) = (1e-4, 0.25 * turning * length);
                vec![
                    ("length", number(length)),
                    ("young", "1.0".into()),
                    ("shear", "1.0".into()),
                    ("area", number(stiffness * length + area * f64::MIN_POSITIVE)),
                    ("iy", number(second)),
                    ("iz", number(0.7 * second)),
                    ("torsion", number(turning * length)),
                    ("damping_time", number(0.1 * loss)),
                ]
            }
            "bump-stop" => {
                let along = i.axes.column(2).dot(&(j.origin - i.origin));
                return self.stop(&bodies, &[i, j], along, mass, random);
            }
            "translational-actuator" => {
                vec![("of_time", of_time(random, 3.0 * mass)), ("of_speed", of(random, "v", 1.0, 3.0 * mass, true))]
            }
            "vector-force" => {
                // What a spring measures, where all bodies are of one kind.
                let springs = self.parts.iter().find(|part| part.kind == "translational-spring-damper");
                let ordinary = self.bodies.iter().all(|body| body.heavier == 1.0);
                let measured = springs.filter(|_| ordinary).map(|spring| ("y", format!("{}.force", spring.name)));
                inputs.extend(measured);
                vec![
                    ("x", of_time(random, 4.0 * mass)),
                    ("z", of_time(random, 2.0 * mass)),
                    ("follower", random.chance(0.5).to_string()),
                ]
            }
            "vector-torque" => {
                vec![("y", of_time(random, 3.0 * moment)), ("follower", random.chance(0.5).to_string())]
            }
            "drag" => {
                let wind = random.vector(2.0);
                vec![
                    ("coefficient", number(random.between(0.2, 2.0))),
                    ("area", number(0.2 * mass)),
                    ("wind", list(&wind)),
                ]
            }
            "point-gravity" => {
                j.origin = com;
                let away = (com - i.origin).norm();
                if away < 0.5 {
                    return;
                }
                let pull = mass / own;
                vec![("gravitational_parameter", number(3.0 * pull * away * away)), ("mass", number(own))]
            }
            _ => {
                j.origin = com;
                vec![("mass", number(mass)), ("acceleration", list(&random.vector(5.0)))]
            }
        };
        let part = self.part("force", kind, &bodies, &[i, j]);
        (part.params, part.inputs) = (params, inputs);
    }

    /// Adds a control loop: a measured speed or place, a filter, a controller, a force.
    fn control(&mut self, random: &mut Random) {
        let body = random.below(self.bodies.len());
        let (mass, _) = self.lightest(&[Some(body)]);
        let c = random.of(&["x", "y", "z"]);
        let wire = |mechanism: &mut Self, kind: &'static str, inputs: Vec<(&'static str, String)>, params| {
            let part = mechanism.part("control", kind, &[Some(body)], &[]);
            (part.inputs, part.params) = (inputs, params);
            format!("{}.output", part.name)
        };
        let wanted = wire(self, "signal-source", vec![], vec![("function", of_time(random, 1.0))]);
        let measured = format!("{}_@_{c}", random.of(&["r", "v"]));
        let lag = if random.chance(0.5) { random.decades(-2.0, -0.5) } else { 0.0 };
        let mut params = vec![("gain", number(random.between(0.5, 1.5))), ("time_constant", number(lag))];
        if random.chance(0.3) {
            params.extend([("low", number(-1.0)), ("high", number(1.0))]);
        }
        let mut signal = wire(self, "sensor", vec![("input", measured)], params);
        for _ in 0..random.below(3) {
            let input = vec![("input", signal.clone())];
            let (a, b) = (random.decades(-1.5, 0.0), random.between(0.5, 2.0));
            let limits = [("low", number(-0.5)), ("high", number(0.8))];
            signal = match random.below(7) {
                0 => {
                    let denominator = format!("[{:?}, {:?}, 1.0]", a * a, a);
                    let numerator = format!("[{:?}, {b:?}]", 0.3 * a);
                    wire(self, "transfer-function", input, vec![("numerator", numerator), ("denominator", denominator)])
                }
                1 => {
                    let (a, b) = (format!("[{:?}, 5.0, -5.0, -0.5]", -1.0 / a), format!("[{b:?}, 0.0]"));
                    let c = "[0.7, 0.3]".to_string();
                    wire(self, "state-space", input, vec![("a", a), ("b", b), ("c", c), ("d", number(0.2))])
                }
                2 => wire(self, "gain", input, [&[("gain", number(b))], &limits[..]].concat()),
                3 => wire(self, "look-up", input, vec![("function", of(random, "x", 1.0, b, false))]),
                4 => wire(self, "integral", input, [&[("gain", number(2.0 * b))], &limits[..]].concat()),
                5 => {
                    let inputs = vec![("a", signal.clone()), ("b", wanted.clone())];
                    wire(self, "product", inputs, vec![("gain", number(b))])
                }
                _ => {
                    let inputs = vec![("a", signal.clone()), ("b", wanted.clone()), ("c", number(0.1))];
                    wire(self, "sum", inputs, vec![("gain_b", number(-b))])
                }
            };
        }
        if random.chance(0.7) {
            let mut params = vec![("kp", number(random.between(0.0, 3.0))), ("ki", number(random.between(0.0, 5.0)))];
            if random.chance(0.4) {
                params.extend([("kd", number(0.05)), ("filter_time", number(random.decades(-2.0, -1.0)))]);
            }
            if random.chance(0.5) {
                params.extend([("low", number(-1.0)), ("high", number(1.5))]);
            }
            signal = wire(self, "pid", vec![("set_point", wanted), ("measured", signal)], params);
        }
        let frame = self.frame(Some(body), Style::Spatial, "", random);
        let part = self.part("force", "translational-actuator", &[None, Some(body)], &[frame, frame]);
        part.params = vec![("along", quoted("axis")), ("gain", number(5.0 * mass))];
        part.inputs = vec![("signal", signal)];
    }
}
