//! An inerter: a massless device between two points whose force is in proportion to their relative acceleration, as that of a
//! flywheel on a screw or a rack. To motion along its line it is a mass of `inertance`, which neither point carries as weight.
//!
//! ## Equations
//! With l the distance of the two points and b the inertance, the kinetic energy is that of the flywheel,
//!
//! ```text
//! T = b l'^2 / 2      l' = n . (v_j - v_i)      n = (p_j - p_i) / l      (1)
//! ```
//!
//! and the force along the line is b l'' against the points' drawing apart. It follows from (1) by differentiation and is solved for
//! together with the accelerations (Smith, IEEE Transactions on Automatic Control 47, 2002).
//!
//! With `guided`, n is the z axis of frame i, along which a joint guides p_j, and l = n . (p_j - p_i) may pass through zero: for the
//! coordinate of a slide. The points need not lie on one line along n.
//!
//! ## Signs
//! The quantity `force` at frame j is what the inerter does to body j: against l''. Channels are the distance, its rate, and T.
//!
//! ## Singular cases
//! The line has no direction where the points meet; a `guided` inerter has its own. Bodies may be as light as they are beside b.
//!
//! ## Example
//! ```toml
//! title = "Mass on a spring, with an inerter"
//!
//! [plugins]
//! libraries = ["odyn-forces", "odyn-joints"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.01
//!
//! [[body]]
//! name = "slide"
//! mass = 2
//! inertia = [1, 1, 1]
//! position = [1, 0, 0]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "slide"]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "spring"
//! type = "translational-spring-damper"
//! bodies = ["ground", "slide"]
//! points = [[0, 0, 0], [1, 0, 0]]
//! params = { stiffness = 80, free_length = 0.9 }
//!
//! [[force]]
//! name = "flywheel"
//! type = "inerter"
//! bodies = ["ground", "slide"]
//! points = [[0, 0, 0], [1, 0, 0]]
//! params.inertance = 3
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "slide"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct Inerter {
    inertance: f64,
    guided: bool,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct InerterParameters {
    /// Force per relative acceleration, b; of a flywheel on a screw J (2 pi / pitch)^2.
    #[param(unit = "kg", min = 0.0)]
    pub inertance: f64,
    /// The displacement along the z axis of frame i counts, in place of the distance.
    #[param(default = false)]
    pub guided: bool,
}

impl Element for Inerter {
    const NAME: &'static str = "inerter";
    const SUMMARY: &'static str = "force in proportion to the relative acceleration of two points along their line";
    const DOC: &'static str = doc_of(include_str!("inerter.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "its origin is the first point; its z axis is the line of a guided inerter"),
        FrameSpec::new("j", "its origin is the second point"),
    ];
    type Parameters = InerterParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { inertance: p.inertance, guided: p.guided })
    }
}

impl Inerter {
    /// l and its rate.
    fn length<S: Scalar>(&self, at: &Motion<'_, S>) -> (S, S) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let (d, velocity) = (j.position - i.position, at.relative_velocity(0, 1));
        if self.guided {
            let carried = at.twists[0].angular_velocity.cross(&d);
            return (d.dot(&i.z()), (velocity - carried).dot(&i.z()));
        }
        let length = d.dot(&d).sqrt();
        (length, d.dot(&velocity) / length)
    }
}

impl Force for Inerter {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("length", "m", "distance of the points; displacement of a guided inerter"),
        ChannelSpec::new("rate", "m/s", "its rate"),
        ChannelSpec::new("energy", "J", "kinetic energy"),
    ];

    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (length, rate) = self.length(at);
        out.push(length);
        out.push(rate);
        out.push(rate * rate * (0.5 * self.inertance));
    }

    fn kinetic<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let (_, rate) = self.length(at);
        Some(rate * rate * (0.5 * self.inertance))
    }
}
