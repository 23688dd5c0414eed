//! A rubber bushing: holds frame j to frame i by three springs and dampers along and three about the axes of frame i.
//! Rotations may be large: they are measured by the rotation vector, which does not depend on an order of axes.
//!
//! ## Equations
//! With u = A_i^T (p_j - p_i), theta the rotation vector of frame j in the axes of frame i (axis times angle), theta'
//! its rate (Bauchau & Trainelli, Nonlinear Dynamics 32, 2003), k and c diagonal,
//!
//! ```text
//! f = k_u u + c_u u'      m = k_theta theta + c_theta theta'                          (1)
//! force on j at p_j: -A_i f      torque on j: -A_i T^-T m      theta' = T^-1 omega    (2)
//! V = (u . k_u u + theta . k_theta theta) / 2                                         (3)
//! P_dissipated = u' . c_u u' + theta' . c_theta theta'                                (4)
//! ```
//!
//! on i the opposite along the same line. T is the identity for small rotations; with it (2) is exactly the wrench of
//! V.
//!
//! ## Signs
//! The channels are displacement and rotation of frame j, and what the body of frame j exerts on the bushing, in axes
//! of frame i: positive displacement, positive force.
//!
//! ## Singular cases
//! The rotation vector is undefined at half a turn between the frames and jumps there: give a bushing that shall turn
//! freely about an axis no rotation at all by a joint, or keep it below half a turn (a run warns from 2.5 rad on,
//! ODY0750). Large stiffnesses make the equations stiff; a `fixed` joint is their limit.
//!
//! ## Example
//! ```toml
//! title = "Engine mount"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.1
//! output_step = 0.01
//!
//! [[body]]
//! name = "engine"
//! mass = 40
//! inertia = [1, 2, 2]
//!
//! [[force]]
//! name = "mount"
//! type = "bushing"
//! bodies = ["ground", "engine"]
//! point = [0, 0, -0.1]
//! params.stiffness = ["200 N/mm", "200 N/mm", "300 N/mm"]
//! params.damping = [300, 300, 400]
//! params.rotational_stiffness = [1e4, 1e4, 2e4]
//! params.rotational_damping = [10, 10, 20]
//!
//! [[output]]
//! name = "z"
//! quantity = "position"
//! of = "engine"
//! component = "z"
//! ```

use element_api::prelude::*;

use crate::deformation::{self, Six, SixBySix};

/// The element.
#[derive(Debug, Clone)]
pub struct Bushing {
    stiffness: SixBySix,
    damping: SixBySix,
    damped: bool,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct BushingParameters {
    /// Force per displacement along x, y, z of frame i.
    #[param(unit = "N/m", min = 0.0)]
    pub stiffness: [f64; 3],
    /// Torque per rotation about x, y, z of frame i.
    #[param(unit = "N m/rad", min = 0.0)]
    pub rotational_stiffness: [f64; 3],
    /// Force per velocity along x, y, z of frame i.
    #[param(unit = "N s/m", min = 0.0, default = [0.0; 3])]
    pub damping: [f64; 3],
    /// Torque per rate of rotation about x, y, z of frame i.
    #[param(unit = "N m s/rad", min = 0.0, default = [0.0; 3])]
    pub rotational_damping: [f64; 3],
}

fn diagonal(linear: [f64; 3], angular: [f64; 3]) -> SixBySix {
    let mut matrix = [[0.0; 6]; 6];
    for (k, value) in linear.into_iter().chain(angular).enumerate() {
        matrix[k][k] = value;
    }
    matrix
}

impl Element for Bushing {
    const NAME: &'static str = "bushing";
    const SUMMARY: &'static str = "springs and dampers along and about three axes, for finite rotations";
    const DOC: &'static str = doc_of(include_str!("bushing.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its axes are those of the stiffnesses"),
        FrameSpec::new("j", "on the second body; without load it coincides with the first"),
    ];
    type Parameters = BushingParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let damped = p.damping.iter().chain(&p.rotational_damping).any(|c| *c != 0.0);
        Ok(Self {
            stiffness: diagonal(p.stiffness, p.rotational_stiffness),
            damping: diagonal(p.damping, p.rotational_damping),
            damped,
        })
    }
}

impl Bushing {
    /// (1)
    fn load<S: Scalar>(&self, at: &Motion<'_, S>, e: &Six<S>) -> Six<S> {
        let elastic = deformation::product(&self.stiffness, e);
        if !self.damped {
            return elastic;
        }
        deformation::sum(&elastic, &deformation::product(&self.damping, &deformation::rate(at, e)))
    }
}

impl Force for Bushing {
    const CHANNELS: &'static [ChannelSpec] = crate::DEFORMATION_CHANNELS;

    const CHECKS: &'static [ChannelSpec] = deformation::TURNED;

    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let e = deformation::deformation(at, [0.0; 3]);
        out.push(if deformation::is_turned(&[&self.stiffness, &self.damping]) {
            deformation::room_to_turn(&e)
        } else {
            S::one()
        });
    }

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let e = deformation::deformation(at, [0.0; 3]);
        deformation::apply(at, &e, &self.load(at, &e), out);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let e = deformation::deformation(at, [0.0; 3]);
        let exerted = deformation::exerted(&e, &self.load(at, &e));
        exerted.into_iter().chain(e).for_each(|value| out.push(value));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let e = deformation::deformation(at, [0.0; 3]);
        Some(deformation::dot(&e, &deformation::product(&self.stiffness, &e)) * 0.5)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if !self.damped {
            return None;
        }
        let rate = deformation::rate(at, &deformation::deformation(at, [0.0; 3]));
        Some(deformation::dot(&rate, &deformation::product(&self.damping, &rate)))
    }
}
