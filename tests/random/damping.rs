//! Hydraulic dampers, whose pressure and flows are internal unknowns.

use super::mechanism::{Mechanism, Style};
use super::numbers::Random;
use super::relation::number;

/// Area of their pistons, m^2.
const AREA: f64 = 1e-3;

impl Mechanism {
    /// Ties some body to the ground by a damper, in one mechanism of seven.
    pub(super) fn dampen(&mut self, style: Style, random: &mut Random) {
        let body = random.below(self.bodies.len());
        // A force beside the axis of a thin rod would turn it very fast.
        if !random.chance(0.15) || self.bodies[body].thinner.y < 1.0 {
            return;
        }
        let bodies = [None, Some(body)];
        let frames = bodies.map(|body| self.frame(body, style, "", random));
        if (frames[1].origin - frames[0].origin).norm() < 0.2 {
            return;
        }
        let damping = self.lightest(&bodies).0 * random.decades(-1.0, 1.0);
        let [laminar, turbulent] = [damping / AREA.powi(2), damping / AREA.powi(3)];
        self.part("force", "hydraulic-damper", &bodies, &frames).params = vec![
            ("area", number(AREA)),
            ("laminar_1", number(laminar * random.decades(-1.0, 1.0))),
            ("turbulent_1", number(turbulent * random.decades(-1.0, 1.0))),
            ("laminar_2", number(laminar * random.decades(-1.0, 1.0))),
            ("turbulent_2", number(turbulent * random.of(&[0.0, 0.1, 1.0]))),
        ];
    }
}
