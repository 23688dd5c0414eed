//! Elastic stops that end a sliding motion: nothing happens while frame j is free along z of frame i, between `lower`
//! and `upper`; beyond them a rubber buffer pushes it back.
//!
//! ## Equations
//! With s = z_i . (p_j - p_i), s' its rate as seen from body i, the depths x = s - upper (x' = s') and x = lower - s
//! (x' = -s'),
//!
//! ```text
//! F = F0 (x / d)^n (1 + lambda x')  where x > 0, else 0                        (1)
//! force on j along z_i: F of the lower stop - F of the upper stop              (2)
//! V = F0 d (x / d)^(n+1) / (n + 1)      P_dissipated = F0 (x / d)^n lambda x'^2    (3)
//! ```
//!
//! on i the opposite along the same line (Hunt & Crossley, Coefficient of restitution interpreted as damping in
//! vibroimpact, J. Appl. Mech. 42, 1975). A mass that hits with the speed v leaves with w, where y - ln(1 + y) is the
//! same for y = lambda v and y = -lambda w, whatever the exponent.
//!
//! ## Signs
//! `force` is the force on body j, positive along z of frame i: positive at the lower stop, negative at the upper one.
//!
//! ## Singular cases
//! With exponent 1 the force has a kink at the touch; above 1 it is smooth there. A body that leaves faster than 1 /
//! lambda would be held back; a bounce never is.
//!
//! ## Example
//! ```toml
//! title = "Buffer"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! t_end = 0.05
//! output_step = 0.001
//!
//! [[body]]
//! name = "carriage"
//! mass = 3
//! inertia = [1, 1, 1]
//! velocity = [2, 0, 0]
//!
//! [[joint]]
//! name = "rail"
//! type = "translational"
//! bodies = ["ground", "carriage"]
//! point = [0, 0, 0]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "buffer"
//! type = "bump-stop"
//! bodies = ["ground", "carriage"]
//! axis = [1, 0, 0]
//! params.upper = "20 mm"
//! params.force = "5 kN"
//! params.depth = "10 mm"
//! params.damping = "0.1 s/m"
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "carriage"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::contact::{Contact, Stops};

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct BumpStop(Stops);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct BumpStopParameters {
    /// Displacement at which the lower stop is touched; none: there is no lower stop.
    #[param(unit = "m", example = -0.1)]
    pub lower: Option<f64>,
    /// Displacement at which the upper stop is touched; none: there is no upper stop.
    #[param(unit = "m", example = 0.2)]
    pub upper: Option<f64>,
    /// Force at the depth `depth`, F0.
    #[param(unit = "N", above = 0.0)]
    pub force: f64,
    /// Depth at which the stop pushes with `force`, d.
    #[param(unit = "m", above = 0.0)]
    pub depth: f64,
    /// Exponent of the force over the depth, n.
    #[param(min = 1.0, default = 1.5)]
    pub exponent: f64,
    /// Share by which the force grows per speed of approach, lambda.
    #[param(unit = "s/m", min = 0.0, default = 0.0)]
    pub damping: f64,
}

impl Element for BumpStop {
    const NAME: &'static str = "bump-stop";
    const SUMMARY: &'static str = "elastic stops of a displacement along z";
    const DOC: &'static str = doc_of(include_str!("bump_stop.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the direction of the displacement, its origin the zero"),
        FrameSpec::new("j", "its origin is what is stopped"),
    ];
    type Parameters = BumpStopParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let contact = Contact { load: p.force, depth: p.depth, exponent: p.exponent, damping: p.damping };
        Stops::new(contact, p.lower, p.upper).map(Self)
    }
}

impl Force for BumpStop {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("force", "N", "force on the second body along z of the first frame"),
        ChannelSpec::new("displacement", "m", "of the second origin along z of the first frame"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let (s, rate) = slide(at);
        out.force_pair(0, 1, at.frames()[0].z() * self.0.force(s, rate));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (s, rate) = slide(at);
        out.push(self.0.force(s, rate));
        out.push(s);
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.0.potential(slide(at).0))
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let (s, rate) = slide(at);
        Some(self.0.dissipation(s, rate))
    }
}

/// Displacement of origin j along z of frame i, and its rate as seen from body i, m and m/s.
pub(crate) fn slide<S: Scalar>(at: &Motion<'_, S>) -> (S, S) {
    let (i, j) = (&at.frames()[0], &at.frames()[1]);
    let d = j.position - i.position;
    let velocity = at.relative_velocity(0, 1) - at.twists[0].angular_velocity.cross(&d);
    (i.z().dot(&d), i.z().dot(&velocity))
}
