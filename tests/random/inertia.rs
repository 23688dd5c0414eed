//! Elements that bring mass: inerters and added masses.

use super::mechanism::{Mechanism, Style};
use super::numbers::Random;
use super::relation::number;

impl Mechanism {
    /// Ties two bodies, or one to the ground, by an inerter, in one mechanism of seven.
    pub(super) fn inert(&mut self, style: Style, random: &mut Random) {
        let bodies = self.two_ends(random);
        if random.chance(0.15) {
            self.inerter(bodies, style, random);
        }
    }

    /// The same in all of them, where the bodies allow it.
    pub(super) fn tie_by_inerter(&mut self, style: Style, random: &mut Random) {
        let bodies = self.two_ends(random);
        self.inerter(bodies, style, random);
    }

    fn two_ends(&self, random: &mut Random) -> [Option<usize>; 2] {
        let (one, other) = (random.below(self.bodies.len()), random.below(self.bodies.len()));
        [(one != other && random.chance(0.5)).then_some(other), Some(one)]
    }

    fn inerter(&mut self, bodies: [Option<usize>; 2], style: Style, random: &mut Random) {
        // A force beside the axis of a thin rod would turn it very fast.
        if bodies.iter().flatten().any(|body| self.bodies[*body].thinner.y < 1.0) {
            return;
        }
        let frames = bodies.map(|body| self.frame(body, style, "", random));
        if (frames[1].origin - frames[0].origin).norm() < 0.5 {
            return;
        }
        let inertance = self.lightest(&bodies).0 * random.decades(-1.0, 1.0);
        self.part("force", "inerter", &bodies, &frames).params = vec![("inertance", number(inertance))];
    }

    /// Gives a body a mass that differs along three axes, away from its centre.
    pub(super) fn carry(&mut self, style: Style, random: &mut Random) {
        let bodies = [Some(random.below(self.bodies.len()))];
        if bodies.iter().flatten().any(|body| self.bodies[*body].thinner.y < 1.0) {
            return;
        }
        let frames = [self.frame(bodies[0], style, "", random)];
        let (mass, moment) = self.lightest(&bodies);
        let mut three = |size: f64| {
            let values = [0; 3].map(|_| number(size * random.decades(-1.0, 0.5)));
            format!("[{}]", values.join(", "))
        };
        let params = vec![("apparent_mass", three(mass)), ("inertia", three(moment))];
        self.part("force", "added-mass", &bodies, &frames).params = params;
    }
}
