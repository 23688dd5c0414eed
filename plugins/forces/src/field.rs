//! A general linear elastic connection of two frames: a full symmetric 6 x 6 stiffness and a full symmetric 6 x 6
//! damping, as they come out of a finite element analysis of a bracket, a mount or a flexure.
//!
//! ## Equations
//! With u = A_i^T (p_j - p_i) - offset, theta the rotation vector of frame j in the axes of frame i (axis times angle),
//! e = (u, theta), and K = [[translation, coupling], [coupling^T, rotation]], C likewise,
//!
//! ```text
//! load = K e + C e' + p                                                                   (1)
//! force on j at p_j: -A_i f      torque on j: -A_i T^-T m      (f, m) = load              (2)
//! V = e . K e / 2 + p . e      P_dissipated = e' . C e'                                   (3)
//! ```
//!
//! on i the opposite along the same line; theta' = T^-1 omega (Bauchau & Trainelli, Nonlinear Dynamics 32, 2003), so
//! that (2) is exactly the wrench of V for rotations of any size. Matrices are lists of nine numbers, row by row; a
//! block that is left out is zero.
//!
//! ## Signs
//! The channels are displacement and rotation of frame j, and what the body of frame j exerts on the element, in axes
//! of frame i: positive displacement, positive force. The preload p is the load at e = 0.
//!
//! ## Singular cases
//! The rotation vector is undefined at half a turn between the frames and jumps there (a run warns from 2.5 rad on,
//! ODY0750). The blocks `translation` and
//! `rotation` must be symmetric (else there is no energy), and the damping must not be negative in any direction. The
//! stiffness may be.
//!
//! ## Example
//! ```toml
//! title = "Flexure"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! t_end = 0.05
//! output_step = 0.005
//!
//! [[body]]
//! name = "table"
//! mass = 1
//! inertia = [0.01, 0.01, 0.01]
//! velocity = [0, 0.1, 0]
//!
//! [[force]]
//! name = "flexure"
//! type = "field"
//! bodies = ["ground", "table"]
//! point = [0, 0, 0]
//! params.translation = [1e4, 0, 0, 0, 2e3, 0, 0, 0, 2e3]
//! params.coupling = [0, 0, 0, 0, 0, -100, 0, 100, 0]
//! params.rotation = [5, 0, 0, 0, 10, 0, 0, 0, 10]
//!
//! [[output]]
//! name = "y"
//! quantity = "position"
//! of = "table"
//! component = "y"
//! ```

use element_api::prelude::*;

use crate::deformation::{self, Six, SixBySix};
use crate::matrix::{is_negative_somewhere, matrix};

/// The element.
#[derive(Debug, Clone)]
pub struct Field {
    stiffness: SixBySix,
    damping: Option<SixBySix>,
    preload: [f64; 6],
    offset: [f64; 3],
    /// Whether its load depends on rotation.
    is_turned: bool,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct FieldParameters {
    /// Force per displacement: nine numbers, symmetric.
    #[param(unit = "N/m")]
    pub translation: Option<Vec<f64>>,
    /// Force per rotation: nine numbers; its transpose is torque per displacement.
    #[param(unit = "N/rad")]
    pub coupling: Option<Vec<f64>>,
    /// Torque per rotation: nine numbers, symmetric.
    #[param(unit = "N m/rad")]
    pub rotation: Option<Vec<f64>>,
    /// Force per velocity: nine numbers, symmetric.
    #[param(unit = "N s/m")]
    pub translation_damping: Option<Vec<f64>>,
    /// Force per rate of rotation: nine numbers; its transpose is torque per velocity.
    #[param(unit = "N s/rad")]
    pub coupling_damping: Option<Vec<f64>>,
    /// Torque per rate of rotation: nine numbers, symmetric.
    #[param(unit = "N m s/rad")]
    pub rotation_damping: Option<Vec<f64>>,
    /// Force without deformation.
    #[param(unit = "N", default = [0.0; 3])]
    pub preload_force: [f64; 3],
    /// Moment without deformation.
    #[param(unit = "N m", default = [0.0; 3])]
    pub preload_torque: [f64; 3],
    /// Where the origin of frame j is without deformation, in frame i.
    #[param(unit = "m", default = [0.0; 3])]
    pub offset: [f64; 3],
}

impl Element for Field {
    const NAME: &'static str = "field";
    const SUMMARY: &'static str = "full 6 x 6 stiffness and damping between two frames";
    const DOC: &'static str = doc_of(include_str!("field.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its axes are those of the matrices"),
        FrameSpec::new("j", "on the second body; without deformation parallel to the first, at the offset"),
    ];
    type Parameters = FieldParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let stiffness =
            matrix([("translation", &p.translation), ("coupling", &p.coupling), ("rotation", &p.rotation)])?;
        let damping = matrix([
            ("translation_damping", &p.translation_damping),
            ("coupling_damping", &p.coupling_damping),
            ("rotation_damping", &p.rotation_damping),
        ])?;
        if is_negative_somewhere(&damping) {
            return Err(ParamError::new("", "the damping is negative in some direction: it would generate energy"));
        }
        let [fx, fy, fz] = p.preload_force;
        let [mx, my, mz] = p.preload_torque;
        Ok(Self {
            stiffness,
            is_turned: deformation::is_turned(&[&stiffness, &damping]) || p.preload_torque != [0.0; 3],
            damping: damping.iter().flatten().any(|c| *c != 0.0).then_some(damping),
            preload: [fx, fy, fz, mx, my, mz],
            offset: p.offset,
        })
    }
}

impl Field {
    fn deformation<S: Scalar>(&self, at: &Motion<'_, S>) -> Six<S> {
        deformation::deformation(at, self.offset)
    }

    /// (1)
    fn load<S: Scalar>(&self, at: &Motion<'_, S>, e: &Six<S>) -> Six<S> {
        let elastic = deformation::sum(&deformation::product(&self.stiffness, e), &self.preload.map(S::from));
        match &self.damping {
            None => elastic,
            Some(damping) => deformation::sum(&elastic, &deformation::product(damping, &deformation::rate(at, e))),
        }
    }
}

impl Force for Field {
    const CHANNELS: &'static [ChannelSpec] = crate::DEFORMATION_CHANNELS;

    const CHECKS: &'static [ChannelSpec] = deformation::TURNED;

    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let e = self.deformation(at);
        out.push(if self.is_turned { deformation::room_to_turn(&e) } else { S::one() });
    }

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let e = self.deformation(at);
        deformation::apply(at, &e, &self.load(at, &e), out);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let e = self.deformation(at);
        let exerted = deformation::exerted(&e, &self.load(at, &e));
        exerted.into_iter().chain(e).for_each(|value| out.push(value));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let e = self.deformation(at);
        let elastic = deformation::dot(&e, &deformation::product(&self.stiffness, &e)) * 0.5;
        Some(elastic + deformation::dot(&e, &self.preload.map(S::from)))
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let damping = self.damping.as_ref()?;
        let rate = deformation::rate(at, &self.deformation(at));
        Some(deformation::dot(&rate, &deformation::product(damping, &rate)))
    }
}
