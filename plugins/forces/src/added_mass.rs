//! A mass at a point of a body, with as much inertia as it is given: a bolt, a load that is carried, the water that a hull takes along. Other
//! than `point_masses` of a body it is an element: it may be switched off, made by a study, and its load on the body reported. It may
//! weigh, or not, and differ along three axes.
//!
//! ## Equations
//! In the axes of frame i, with v its origin's velocity and omega its angular velocity,
//!
//! ```text
//! T = (v . m v + omega . J omega) / 2      m, J diagonal      (1)
//! F = mass g      at the origin of frame i                    (2)
//! V = -mass g . p                                             (3)
//! ```
//!
//! with g the `gravity` given here. Without `apparent_mass`, m = mass in all directions, and the element is a rigid body of this mass and
//! inertia, fixed to its body at the frame. With it, m = mass + apparent_mass: the apparent mass of a fluid, which differs along the axes of a hull
//! and weighs nothing (Lamb, Hydrodynamics, 1932, section 121; of an added mass that differs with direction, (1) contains the Munk moment).
//!
//! ## Signs
//! The quantity `force` at frame i is what weight and inertia together do to the body, at the frame's origin.
//!
//! ## Singular cases
//! None: the body may be as light as it is beside the mass.
//!
//! ## Example
//! ```toml
//! title = "Pendulum with a bob"
//!
//! [plugins]
//! libraries = ["odyn-forces", "odyn-joints"]
//!
//! [simulation]
//! gravity = [0, -9.81, 0]
//! t_end = 1
//! output_step = 0.01
//!
//! [[body]]
//! name = "rod"
//! mass = 0.3
//! inertia = [0.001, 0.1, 0.1]
//! position = [0.5, 0, 0]
//!
//! [[joint]]
//! name = "pivot"
//! type = "revolute"
//! bodies = ["ground", "rod"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[force]]
//! name = "bob"
//! type = "added-mass"
//! bodies = ["rod"]
//! point = [1, 0, 0]
//! params = { mass = 2, gravity = [0, -9.81, 0] }
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "rod"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct AddedMass {
    weight: [f64; 3],
    mass: [f64; 3],
    inertia: [f64; 3],
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct AddedMassParameters {
    /// Mass that weighs.
    #[param(unit = "kg", min = 0.0, default = 0.0)]
    pub mass: f64,
    /// Further mass that does not weigh, along x, y, z of frame i.
    #[param(unit = "kg", min = 0.0, default = [0.0; 3])]
    pub apparent_mass: [f64; 3],
    /// Moments of inertia about the axes of frame i.
    #[param(unit = "kg m^2", min = 0.0, default = [0.0; 3])]
    pub inertia: [f64; 3],
    /// Gravity, ground axes; that of the scene is not known to elements.
    #[param(unit = "m/s^2", default = [0.0; 3])]
    pub gravity: [f64; 3],
}

impl Element for AddedMass {
    const NAME: &'static str = "added-mass";
    const SUMMARY: &'static str = "mass and inertia at a frame of a body, also the added mass of a fluid";
    const DOC: &'static str = doc_of(include_str!("added_mass.rs"));
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("i", "its origin is the point; its axes those of the masses")];
    type Parameters = AddedMassParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let mass = p.apparent_mass.map(|added| p.mass + added);
        Ok(Self { weight: p.gravity.map(|g| p.mass * g), mass, inertia: p.inertia })
    }
}

/// m v . v for masses along the axes of the frame; where they are alike, without them.
fn square<S: Scalar>(masses: [f64; 3], v: Vec3<S>, frame: &Frame<S>) -> S {
    if masses[0] == masses[1] && masses[1] == masses[2] {
        return v.dot(&v) * masses[0];
    }
    let own = frame.rotation.tr_mul(&v);
    own.x * own.x * masses[0] + own.y * own.y * masses[1] + own.z * own.z * masses[2]
}

impl AddedMass {
    fn energy<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let (frame, twist) = (&at.frames()[0], &at.twists[0]);
        let along = square(self.mass, twist.velocity, frame);
        if self.inertia == [0.0; 3] {
            return along * 0.5;
        }
        (along + square(self.inertia, twist.angular_velocity, frame)) * 0.5
    }
}

impl Force for AddedMass {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("energy", "J", "kinetic energy")];

    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        if self.weight != [0.0; 3] {
            out.force(0, Vec3::from(self.weight.map(S::from)));
        }
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.energy(at));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(-at.frames()[0].position.dot(&Vec3::from(self.weight.map(S::from))))
    }

    fn kinetic<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(self.energy(at))
    }
}
