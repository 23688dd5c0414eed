//! A force given by its three components over time, at the origin of frame j: along the axes of frame i, or
//! (`follower`) along those of frame j, turning with body j like a thrust.
//!
//! ## Equations
//! ```text
//! F = A (Fx(t) + sx, Fy(t) + sy, Fz(t) + sz)      A = A_i, or A_j with `follower`      (1)
//! force on j at p_j: F      on i the opposite along the same line                      (2)
//! ```
//!
//! (Newton's third law; a component that is not given is zero; sx, sy, sz are what the inputs `x`, `y`, `z` give.) The
//! power is integrated as work done on the scene. With the ground as first body, the reaction goes into the ground.
//!
//! ## Signs
//! Components are positive along the axes; the force acts on the second body.
//!
//! ## Singular cases
//! None.
//!
//! ## Example
//! ```toml
//! title = "Shaken block"
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
//! name = "shaker"
//! type = "vector-force"
//! bodies = ["ground", "block"]
//! params.x = "20 cos(10 t)"
//! params.z = "5 N"
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "block"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::value;

/// The element.
#[derive(Debug, Clone)]
pub struct VectorForce(VectorForceParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct VectorForceParameters {
    /// Component along x over time.
    #[param(unit = "s -> N", variable = "t")]
    pub x: Option<Function>,
    /// Component along y over time.
    #[param(unit = "s -> N", variable = "t")]
    pub y: Option<Function>,
    /// Component along z over time.
    #[param(unit = "s -> N", variable = "t")]
    pub z: Option<Function>,
    /// Along the axes of frame j, turning with its body, instead of those of frame i.
    #[param(default = false)]
    pub follower: bool,
}

impl Element for VectorForce {
    const NAME: &'static str = "vector-force";
    const SUMMARY: &'static str = "force at a point by components over time, fixed or following the body";
    const DOC: &'static str = doc_of(include_str!("vector_force.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new(
            "i",
            "on the body that takes the reaction, usually the ground; its axes are those of the components",
        ),
        FrameSpec::new(
            "j",
            "its origin is where the force acts; with `follower`, its axes are those of the components",
        ),
    ];
    type Parameters = VectorForceParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

impl VectorForce {
    /// (1)
    fn force<S: Scalar>(&self, at: &Motion<'_, S>) -> Vec3<S> {
        let (p, t) = (&self.0, at.time());
        let given = Vec3::new(value(&p.x, t), value(&p.y, t), value(&p.z, t));
        at.frames()[usize::from(p.follower)].rotation * (given + Vec3::new(at.inputs[0], at.inputs[1], at.inputs[2]))
    }
}

impl Force for VectorForce {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::optional("x", "N", 0.0, "added to the component along x"),
        InputSpec::optional("y", "N", 0.0, "added to the component along y"),
        InputSpec::optional("z", "N", 0.0, "added to the component along z"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, self.force(at));
    }
}
