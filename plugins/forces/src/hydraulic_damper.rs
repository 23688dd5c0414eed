//! A hydraulic damper between two points: its piston drives the oil through two passages side by side, each a pipe (laminar) and an
//! orifice (turbulent).
//!
//! ## Equations
//!
//! With the unit vector e from the origin of frame i to that of frame j, the speed v = e . (v_j - v_i) and the area A of the piston, the
//! pressure drop p and the flows q_1, q_2 are internal unknowns (Merritt, Hydraulic Control Systems, 1967, sections 3.3 and 3.4):
//!
//! | condition | equation |
//! |---|---|
//! | continuity | q_1 + q_2 - A v = 0 |
//! | first passage | r_1 q_1 + k_1 q_1 abs(q_1) - p = 0 |
//! | second passage | r_2 q_2 + k_2 q_2 abs(q_2) - p = 0 |
//!
//! Orifices alone (r_1 = r_2 = 0) share the flow in one proportion at any pressure: the second passage's condition is then
//! sqrt(k_1) q_1 - sqrt(k_2) q_2 = 0, which determines both flows where they are zero, too.
//!
//! Each passage needs a resistance. A damper with one passage, r and k, has two equal ones that do the same together: r_1 = r_2 = 2 r,
//! k_1 = k_2 = 4 k.
//!
//! The force on body `j` is -A p e, its opposite acts on body `i`; A p v turns into heat.
//!
//! ## Signs
//!
//! Pressure and flows are positive while the points move apart.
//!
//! ## Singular cases
//!
//! Where the points coincide the direction is not defined.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! gravity = [0, 0, 0]
//! t_end = 0.1
//! output_step = 0.05
//!
//! [[body]]
//! name = "mass"
//! mass = 100.0
//! inertia = [1, 1, 1]
//! position = [0.5, 0, 0]
//! velocity = [0.5, 0, 0]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "mass"]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "damper"
//! type = "hydraulic-damper"
//! bodies = ["ground", "mass"]
//! points = [[0, 0, 0], [0.5, 0, 0]]
//! params.area = "10 cm^2"
//! params.laminar_1 = 1e8
//! params.turbulent_1 = 4e12
//! params.laminar_2 = 2e9
//!
//! [[output]]
//! name = "p"
//! quantity = "value"
//! of = "damper"
//! channel = "pressure"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct HydraulicDamper(HydraulicDamperParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct HydraulicDamperParameters {
    /// Area of the piston, A.
    #[param(unit = "m^2", above = 0.0)]
    pub area: f64,
    /// Laminar resistance of the first passage, r_1.
    #[param(unit = "Pa*s/m^3", min = 0.0, default = 0.0, example = 2.0)]
    pub laminar_1: f64,
    /// Turbulent resistance of the first passage, k_1 = rho / (2 (cd A_1)^2).
    #[param(unit = "kg/m^7", min = 0.0, default = 0.0, example = 3.0)]
    pub turbulent_1: f64,
    /// Laminar resistance of the second passage, r_2.
    #[param(unit = "Pa*s/m^3", min = 0.0, default = 0.0, example = 1.0)]
    pub laminar_2: f64,
    /// Turbulent resistance of the second passage, k_2.
    #[param(unit = "kg/m^7", min = 0.0, default = 0.0)]
    pub turbulent_2: f64,
}

impl Element for HydraulicDamper {
    const NAME: &'static str = "hydraulic-damper";
    const SUMMARY: &'static str = "a piston drives oil through two passages side by side";
    const DOC: &'static str = doc_of(include_str!("hydraulic_damper.rs"));
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("i", "its origin is the first end"), FrameSpec::new("j", "its origin is the second end")];
    const UNKNOWNS: &'static [ChannelSpec] = &[
        ChannelSpec::new("pressure", "Pa", "pressure drop over the piston"),
        ChannelSpec::new("flow_1", "m^3/s", "flow through the first passage"),
        ChannelSpec::new("flow_2", "m^3/s", "flow through the second passage"),
    ];
    type Parameters = HydraulicDamperParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        for (name, laminar, turbulent) in
            [("laminar_1", p.laminar_1, p.turbulent_1), ("laminar_2", p.laminar_2, p.turbulent_2)]
        {
            if laminar + turbulent == 0.0 {
                return Err(ParamError::new(
                    name,
                    "a passage without any resistance: give it a laminar or a turbulent one; a single passage is written as two equal ones, \
                     each with twice its laminar and four times its turbulent resistance",
                ));
            }
        }
        Ok(Self(p))
    }

    fn initial_unknowns(&self) -> Vec<f64> {
        // Flows that are not zero: an orifice alone does not determine its flow there.
        vec![0.0, 1e-3 * self.0.area, 1e-3 * self.0.area]
    }

    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let p = &self.0;
        let (_, speed) = self.axis(at);
        let [pressure, first, second] = [at.unknowns()[0], at.unknowns()[1], at.unknowns()[2]];
        out.push(first + second - speed * p.area);
        out.push(first * p.laminar_1 + first * first.abs() * p.turbulent_1 - pressure);
        out.push(if p.laminar_1 + p.laminar_2 == 0.0 {
            first * p.turbulent_1.sqrt() - second * p.turbulent_2.sqrt()
        } else {
            second * p.laminar_2 + second * second.abs() * p.turbulent_2 - pressure
        });
    }
}

impl HydraulicDamper {
    /// Direction and speed of lengthening.
    fn axis<S: Scalar>(&self, at: &Motion<'_, S>) -> (Vec3<S>, S) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let e = d * (S::one() / length(d));
        (e, e.dot(&at.relative_velocity(0, 1)))
    }
}

impl Force for HydraulicDamper {
    const CHANNELS: &'static [ChannelSpec] = Self::UNKNOWNS;

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (e, _) = self.axis(at);
        out.force_pair(0, 1, e * (at.unknowns()[0] * -self.0.area));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.unknowns().iter().for_each(|unknown| out.push(*unknown));
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let (_, speed) = self.axis(at);
        Some(at.unknowns()[0] * speed * self.0.area)
    }
}
