//! Inerters, whose force is in proportion to accelerations.

use super::mechanism::{Mechanism, Style};
use super::numbers::Random;
use super::relation::number;

impl Mechanism {
    /// Ties two bodies, or one to the ground, by an inerter, in one mechanism of seven.
    pub(super) fn inert(&mut self, style: Style, random: &mut Random) {
        let (one, other) = (random.below(self.bodies.len()), random.below(self.bodies.len()));
        let bodies = [(one != other && random.chance(0.5)).then_some(other), Some(one)];
        // A force beside the axis of a thin rod would turn it very fast.
        if !random.chance(0.15) || bodies.iter().flatten().any(|body| self.bodies[*body].thinner.y < 1.0) {
            return;
        }
        let frames = bodies.map(|body| self.frame(body, style, "", random));
        if (frames[1].origin - frames[0].origin).norm() < 0.5 {
            return;
        }
        let inertance = self.lightest(&bodies).0 * random.decades(-1.0, 1.0);
        self.part("force", "inerter", &bodies, &frames).params = vec![("inertance", number(inertance))];
    }
}
