//! [`Mechanism::rubbing`]: mechanisms with rows that hold up to a limit.

use super::furnish::{DURATION, of_time};
use super::mechanism::{Mechanism, Style};
use super::numbers::Random;
use super::relation::number;

impl Mechanism {
    /// A mechanism with clutches, brakes and dry friction in its joints; one of two with contacts, of which some have friction. The
    /// same for the same seed.
    pub fn rubbing(seed: u64, style: Style) -> Self {
        let mut random = Random::new(seed ^ 0x0f21_c710);
        let mut mechanism = if random.chance(0.5) { Self::striking(seed, style) } else { Self::new(seed, style) };
        for part in mechanism.parts.iter_mut().filter(|part| part.kind == "plane-contact") {
            if part.params.iter().any(|(key, value)| *key == "rough" && value == "false") && random.chance(0.7) {
                part.params.push(("mu", number(random.decades(-1.5, 0.3))));
            }
        }
        let mut balls = Random::new(seed ^ 0xba11);
        for part in mechanism.parts.iter_mut().filter(|part| part.kind == "ball-contact") {
            match balls.below(4) {
                0 => part.params.push(("rough", "true".into())),
                1 | 2 => part.params.push(("mu", number(balls.decades(-1.5, 0.3)))),
                _ => {}
            }
        }
        for _ in 0..1 + random.below(3) {
            let kind = if random.chance(0.6) { "revolute" } else { "translational" };
            let Some(joint) = mechanism.one_of(kind, &mut random) else { continue };
            let (mass, moment) = mechanism.lightest(&joint.bodies);
            let frames = [joint.frames[0], joint.frames[0]];
            let size = random.decades(-1.5, 1.3);
            let (kind, params) = match kind {
                "revolute" if random.chance(0.5) => {
                    let pace = random.decades(0.0, 1.3);
                    let capacity = match random.below(4) {
                        0 => number(size * moment),
                        1 => format!("\"{:?} (1 + sin({pace:?} t))\"", size * moment),
                        2 => format!("\"{:?} max(0, {DURATION:?} / 2 - t)\"", size * moment),
                        _ => {
                            let text = of_time(&mut random, size * moment);
                            let inner = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
                            inner.map_or(text.clone(), |inner| format!("\"max(0, {inner})\""))
                        }
                    };
                    ("clutch", vec![("capacity", capacity)])
                }
                "revolute" => ("dry-friction", vec![("torque", number(size * moment))]),
                _ => ("dry-friction", vec![("force", number(size * mass))]),
            };
            mechanism.part("joint", kind, &joint.bodies, &frames).params = params;
        }
        mechanism
    }

    /// The same, with inerters and added masses.
    pub fn rubbing_with_mass(seed: u64, style: Style) -> Self {
        let mut mechanism = Self::rubbing(seed, style);
        let mut random = Random::new(seed ^ 0x3a55);
        mechanism.carry(style, &mut random);
        mechanism.tie_by_inerter(style, &mut random);
        mechanism
    }
}
