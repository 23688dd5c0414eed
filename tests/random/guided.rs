//! [`Mechanism::guided`]: trees with servos and stepping motors at their joints, gears with play, and profiles that touch.

use nalgebra::{Matrix3, Vector3};

use super::furnish::of_time;
use super::mechanism::{Frame, Mechanism, Part, Style};
use super::numbers::Random;
use super::relation::{about_z, number};

type V = Vector3<f64>;

impl Mechanism {
    /// A tree with one to three joints that a servo or a stepping motor moves, two wheels with play, or (in a plane) a contact of
    /// profiles. The same for the same seed.
    pub fn guided(seed: u64, style: Style) -> Self {
        let mut mechanism = Self::new(seed, style);
        let mut random = Random::new(seed ^ 0x5e_1f_0a_11);
        mechanism.parts.retain(|part| part.table == "force" || part.carries);
        let mut taken: Vec<String> = Vec::new();
        if style == Style::Planar && random.chance(0.7) {
            mechanism.touch(&mut random);
        } else if random.chance(0.4) {
            mechanism.mesh(&mut random, &mut taken);
        }
        for _ in 0..1 + random.below(3) {
            mechanism.serve(&mut random, &mut taken);
        }
        mechanism
    }

    /// A joint of the tree of a kind that nothing else guides.
    fn free_one(&self, kind: &str, random: &mut Random, taken: &mut Vec<String>) -> Option<Part> {
        let found = self.one_of(kind, random).filter(|part| !taken.contains(&part.name))?;
        taken.push(found.name.clone());
        Some(found)
    }

    fn serve(&mut self, random: &mut Random, taken: &mut Vec<String>) {
        // What a contact holds is not to be moved as well.
        if self
            .parts
            .iter()
            .any(|part| part.kind.ends_with("-contact") && !part.params.iter().any(|p| p.0 == "unilateral"))
        {
            return;
        }
        let turns = random.chance(0.6);
        let kind = if turns { "revolute" } else { "translational" };
        let Some(joint) = self.free_one(kind, random, taken) else { return };
        let frames = [joint.frames[0], joint.frames[if turns { 0 } else { 1 }]];
        let (pace, damping) = (random.decades(0.5, 1.7), random.of(&[0.2, 0.7, 1.0]));
        let common = [("frequency", number(pace)), ("damping", number(damping))];
        let mut params = common.to_vec();
        let kind = match (turns, random.below(3)) {
            (true, 0) => {
                params.extend([("angle", of_time(random, 0.5)), ("step", number(random.between(0.02, 0.2)))]);
                params.push(("period", number(random.of(&[0.01, 0.037, 0.1]))));
                "stepper-rotation"
            }
            (true, _) => {
                params.push(("angle", of_time(random, 0.5)));
                "servo-rotation"
            }
            (false, _) => {
                // Where it stands at the start.
                let along = frames[0].axes.column(2).dot(&(frames[1].origin - frames[0].origin));
                params.extend([("displacement", of_time(random, 0.3)), ("start", number(along))]);
                "servo-displacement"
            }
        };
        if kind != "stepper-rotation" && random.chance(0.3) {
            params.push(("rate_limit", number(random.decades(-1.0, 0.3))));
        }
        self.part("joint", kind, &joint.bodies, &frames).params = params;
    }

    /// Two hinges of the tree are those of wheels with play.
    fn mesh(&mut self, random: &mut Random, taken: &mut Vec<String>) {
        let (Some(one), Some(other)) =
            (self.free_one("revolute", random, taken), self.free_one("revolute", random, taken))
        else {
            return;
        };
        let bodies = [&one.bodies[..], &other.bodies[..]].concat();
        let frames = [one.frames[0], one.frames[0], other.frames[0], other.frames[0]];
        self.part("joint", "gear-backlash", &bodies, &frames).params = vec![
            ("teeth_1", "20".into()),
            ("teeth_2", random.of(&["20", "33", "57"]).into()),
            ("internal", random.chance(0.5).to_string()),
            ("play", number(random.decades(-2.0, -0.3))),
            ("restitution", number(random.of(&[0.0, 0.0, 0.4, 0.9]))),
        ];
    }

    /// Two bodies touch, or nearly do.
    fn touch(&mut self, random: &mut Random) {
        let freedoms = self.parts.iter().map(|part| match part.kind {
            "revolute" | "translational" => 1,
            "distance-rod" => 2,
            _ => 0,
        });
        let freedoms: usize = freedoms.sum();
        let j_body = random.below(self.bodies.len());
        let i_body = if random.chance(0.5) { None } else { Some(random.below(self.bodies.len())) };
        let apart = random.chance(0.6);
        if i_body == Some(j_body) || (freedoms < 3 && !apart) {
            return;
        }
        let i = self.frame(i_body, Style::Planar, "", random);
        let gap = if apart { random.decades(-2.0, -0.5) } else { 0.0 };
        let (place, roller) = (random.between(-3.0, 3.0), random.decades(-1.7, -0.5));
        let (sin, cos) = place.sin_cos();
        let mut params = Vec::new();
        // The place and the outer normal, in the axes of frame i.
        let (kind, point, normal) = match random.below(3) {
            0 => {
                let (mean, wave) = (random.between(0.1, 0.4), random.between(0.0, 0.05));
                let (r, slope) = (mean + 0.5 * wave * (2.0 * place).cos(), -wave * (2.0 * place).sin());
                params.extend([("radius", format!("\"{mean:?} + {:?} cos(2 phi)\"", 0.5 * wave))]);
                params.extend([("roller_radius", number(roller)), ("start", number(place))]);
                let point = V::new(r * cos, r * sin, 0.0);
                ("profile-contact", point, V::new(r * cos + slope * sin, r * sin - slope * cos, 0.0))
            }
            1 => {
                let bow = random.between(0.05, 0.5);
                params.extend([("height", format!("\"{bow:?} cos(x)\"")), ("wheel_radius", number(roller))]);
                params.extend([("from", number(-30.0)), ("to", number(30.0)), ("start", number(place))]);
                ("rail-contact", V::new(place, bow * cos, 0.0), V::new(bow * sin, 1.0, 0.0))
            }
            _ => {
                let [a, b] = [random.between(0.1, 0.4), random.between(0.1, 0.4)];
                params.extend([
                    ("a_i", number(a)),
                    ("b_i", number(b)),
                    ("a_j", number(roller)),
                    ("b_j", number(roller)),
                ]);
                ("ellipse-contact", V::new(a * cos, b * sin, 0.0), V::new(b * cos, a * sin, 0.0))
            }
        };
        let normal = normal.normalize();
        let axes: Matrix3<f64> = about_z(random.between(-3.0, 3.0));
        if kind == "ellipse-contact" {
            // The place on the round disc, seen from its own axes: against the normal.
            let back = (i.axes * axes).transpose() * (i.axes * -normal);
            params.extend([("start_i", number(place)), ("start_j", number(back.y.atan2(back.x)))]);
        }
        let j = Frame { origin: i.origin + i.axes * (point + normal * (roller + gap)), axes: i.axes * axes };
        if apart {
            params.extend([("unilateral", "true".into()), ("restitution", number(random.of(&[0.0, 0.4, 0.9])))]);
        }
        self.part("joint", kind, &[i_body, Some(j_body)], &[i, j]).params = params;
    }
}
