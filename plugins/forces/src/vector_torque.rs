//! A torque given by its three components over time: about the axes of frame i, or (`follower`) about those of frame j,
//! turning with body j.
//!
//! ## Equations
//! ```text
//! M = A (Mx(t) + sx, My(t) + sy, Mz(t) + sz)      A = A_i, or A_j with `follower`      (1)
//! torque on j: M      torque on i: -M                                                  (2)
//! ```
//!
//! (Newton's third law; a component that is not given is zero; sx, sy, sz are what the inputs `x`, `y`, `z` give.) The
//! power is integrated as work done on the scene. With the ground as first body, the reaction goes into the ground.
//!
//! ## Signs
//! Components are right-handed about the axes; the torque acts on the second body.
//!
//! ## Singular cases
//! None.
//!
//! ## Example
//! ```toml
//! title = "Twisted block"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! t_end = 0.5
//! output_step = 0.1
//!
//! [[body]]
//! name = "block"
//! mass = 2
//! inertia = [1, 1, 1]
//!
//! [[force]]
//! name = "twister"
//! type = "vector-torque"
//! bodies = ["ground", "block"]
//! params.x = "20 cos(10 t)"
//! params.z = "5 N m"
//!
//! [[output]]
//! name = "omega_x"
//! quantity = "angular_velocity"
//! of = "block"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::value;

/// The element.
#[derive(Debug, Clone)]
pub struct VectorTorque(VectorTorqueParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct VectorTorqueParameters {
    /// Component about x over time.
    #[param(unit = "s -> N m", variable = "t")]
    pub x: Option<Function>,
    /// Component about y over time.
    #[param(unit = "s -> N m", variable = "t")]
    pub y: Option<Function>,
    /// Component about z over time.
    #[param(unit = "s -> N m", variable = "t")]
    pub z: Option<Function>,
    /// About the axes of frame j, turning with its body, instead of those of frame i.
    #[param(default = false)]
    pub follower: bool,
}

impl Element for VectorTorque {
    const NAME: &'static str = "vector-torque";
    const SUMMARY: &'static str = "torque by components over time, fixed or following the body";
    const DOC: &'static str = doc_of(include_str!("vector_torque.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new(
            "i",
            "on the body that takes the reaction, usually the ground; its axes are those of the components",
        ),
        FrameSpec::new("j", "on the body that is turned; with `follower`, its axes are those of the components"),
    ];
    type Parameters = VectorTorqueParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

impl VectorTorque {
    /// (1)
    fn torque<S: Scalar>(&self, at: &Motion<'_, S>) -> Vec3<S> {
        let (p, t) = (&self.0, at.time());
        let given = Vec3::new(value(&p.x, t), value(&p.y, t), value(&p.z, t));
        at.frames()[usize::from(p.follower)].rotation * (given + Vec3::new(at.inputs[0], at.inputs[1], at.inputs[2]))
    }
}

impl Force for VectorTorque {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::optional("x", "N m", 0.0, "added to the component about x"),
        InputSpec::optional("y", "N m", 0.0, "added to the component about y"),
        InputSpec::optional("z", "N m", 0.0, "added to the component about z"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, self.torque(at));
    }
}
