//! A straight, massless, uniform beam clamped to two frames: the linear Timoshenko beam of twelve degrees of freedom,
//! carried along by its first frame, so that any rigid motion leaves it unloaded. The beam lies along x of frame i;
//! unloaded, frame j has the same axes and sits at x = L.
//!
//! ## Equations
//! The deformation is e = (u, theta): u = A_i^T (p_j - p_i) - (L, 0, 0), theta the rotation vector of frame j in the
//! axes of frame i (axis times angle). With the stiffness K of the clamped-free beam (Przemieniecki, Theory of Matrix
//! Structural Analysis, 1968, Eq. 5.116, the block of the second end; the other blocks follow from equilibrium),
//!
//! ```text
//! V = e . K e / 2      load = K (e + tau e')      P_dissipated = tau e' . K e'      (1)
//! force on j at p_j: -A_i f      torque on j: -A_i T^-T m      (f, m) = load       (2)
//! ```
//!
//! on i the opposite along the same line; theta' = T^-1 omega, so that (2) is exactly the wrench of V for rotations of
//! any size. With Phi_y = 12 E Iz / (ky G A L^2), Phi_z = 12 E Iy / (kz G A L^2), both zero where the factor ky or kz
//! is 0 (Euler-Bernoulli), the entries of K that are not zero are
//!
//! | entry | value |
//! |---|---|
//! | x, x | E A / L |
//! | y, y | 12 E Iz / (L^3 (1 + Phi_y)) |
//! | y, about z | -6 E Iz / (L^2 (1 + Phi_y)) |
//! | about z, about z | (4 + Phi_y) E Iz / (L (1 + Phi_y)) |
//! | z, z | 12 E Iy / (L^3 (1 + Phi_z)) |
//! | z, about y | 6 E Iy / (L^2 (1 + Phi_z)) |
//! | about y, about y | (4 + Phi_z) E Iy / (L (1 + Phi_z)) |
//! | about x, about x | G J / L |
//!
//! ## Signs
//! The channels are what the body of frame j exerts on the beam, in axes of frame i: `axial` is positive in tension,
//! the moments are right-handed. Iy resists bending about y, that is, deflection along z.
//!
//! ## Singular cases
//! Deformations are meant to be small: a chain of elements follows large deflections, one element does not, and does
//! not know of buckling or stiffening by tension. At half a turn between the frames the rotation vector is undefined.
//! The second end is where `length` says, not where the frames are at the start: a difference is an initial
//! deformation. The beam has no mass; give half of it to each body.
//!
//! ## Example
//! A plate at the end of a steel cantilever, struck:
//!
//! ```toml
//! title = "Cantilever"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! t_end = 0.02
//! output_step = 0.001
//!
//! [[body]]
//! name = "plate"
//! mass = 2
//! inertia = [0.02, 0.01, 0.01]
//! position = [0.5, 0, 0]
//! velocity = [0, 0.1, 0]
//!
//! [[force]]
//! name = "beam"
//! type = "beam"
//! bodies = ["ground", "plate"]
//! points = [[0, 0, 0], [0.5, 0, 0]]
//! axis = [0, 0, 1]
//! x_axis = [1, 0, 0]
//! params.length = "0.5 m"
//! params.young = "210 GPa"
//! params.shear = "80 GPa"
//! params.area = "400 mm^2"
//! params.iy = 1.3333e-8
//! params.iz = 1.3333e-8
//! params.torsion = 2.25e-8
//! params.ky = 0.8333
//! params.kz = 0.8333
//!
//! [[output]]
//! name = "deflection"
//! quantity = "position"
//! of = "plate"
//! component = "y"
//! ```

use element_api::prelude::*;

use crate::deformation::{self, Six, SixBySix};

/// The element.
#[derive(Debug, Clone)]
pub struct Beam {
    length: f64,
    stiffness: SixBySix,
    damping_time: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct BeamParameters {
    /// Length without load, L.
    #[param(unit = "m", above = 0.0)]
    pub length: f64,
    /// Young's modulus, E.
    #[param(unit = "Pa", above = 0.0)]
    pub young: f64,
    /// Shear modulus, G.
    #[param(unit = "Pa", above = 0.0)]
    pub shear: f64,
    /// Area of the cross section, A.
    #[param(unit = "m^2", above = 0.0)]
    pub area: f64,
    /// Second moment of area about y, Iy.
    #[param(unit = "m^4", above = 0.0)]
    pub iy: f64,
    /// Second moment of area about z, Iz.
    #[param(unit = "m^4", above = 0.0)]
    pub iz: f64,
    /// Torsion constant, J.
    #[param(unit = "m^4", above = 0.0)]
    pub torsion: f64,
    /// Share of the area that carries shear along y (5/6 for a rectangle); 0: no deformation by shear.
    #[param(min = 0.0, default = 0.0)]
    pub ky: f64,
    /// Share of the area that carries shear along z; 0: no deformation by shear.
    #[param(min = 0.0, default = 0.0)]
    pub kz: f64,
    /// Damping in proportion to the stiffness: damping matrix over stiffness matrix, tau.
    #[param(unit = "s", min = 0.0, default = 0.0)]
    pub damping_time: f64,
}

/// Deflection, coupling and rotation of bending with the stiffness `ei` over the length `l`.
fn bending(ei: f64, l: f64, shear_stiffness: f64) -> [f64; 3] {
    let phi = if shear_stiffness == 0.0 { 0.0 } else { 12.0 * ei / (shear_stiffness * l * l) };
    let unit = ei / (1.0 + phi);
    [12.0 * unit / (l * l * l), 6.0 * unit / (l * l), (4.0 + phi) * unit / l]
}

impl Element for Beam {
    const NAME: &'static str = "beam";
    const SUMMARY: &'static str = "linear Timoshenko beam between two frames, along x";
    const DOC: &'static str = doc_of(include_str!("beam.rs"));
    const GLYPH: &'static str = "rod";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "first end; its x axis is the axis of the beam"),
        FrameSpec::new("j", "second end; without load parallel to the first, at x = length"),
    ];
    type Parameters = BeamParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let mut k = [[0.0; 6]; 6];
        k[0][0] = p.young * p.area / p.length;
        k[3][3] = p.shear * p.torsion / p.length;
        let [deflection, coupling, rotation] = bending(p.young * p.iz, p.length, p.ky * p.shear * p.area);
        (k[1][1], k[1][5], k[5][1], k[5][5]) = (deflection, -coupling, -coupling, rotation);
        let [deflection, coupling, rotation] = bending(p.young * p.iy, p.length, p.kz * p.shear * p.area);
        (k[2][2], k[2][4], k[4][2], k[4][4]) = (deflection, coupling, coupling, rotation);
        Ok(Self { length: p.length, stiffness: k, damping_time: p.damping_time })
    }
}

impl Beam {
    fn deformation<S: Scalar>(&self, at: &Motion<'_, S>) -> Six<S> {
        deformation::deformation(at, [self.length, 0.0, 0.0])
    }

    /// (1)
    fn load<S: Scalar>(&self, at: &Motion<'_, S>, e: &Six<S>) -> Six<S> {
        if self.damping_time == 0.0 {
            return deformation::product(&self.stiffness, e);
        }
        let delayed = deformation::rate(at, e).map(|rate| rate * self.damping_time);
        deformation::product(&self.stiffness, &deformation::sum(e, &delayed))
    }
}

impl Force for Beam {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("axial", "N", "normal force, positive in tension"),
        ChannelSpec::new("shear_y", "N", "force on the second end along y"),
        ChannelSpec::new("shear_z", "N", "force on the second end along z"),
        ChannelSpec::new("torsion", "N m", "moment on the second end about x"),
        ChannelSpec::new("bending_y", "N m", "moment on the second end about y"),
        ChannelSpec::new("bending_z", "N m", "moment on the second end about z"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let e = self.deformation(at);
        deformation::apply(at, &e, &self.load(at, &e), out);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let e = self.deformation(at);
        deformation::exerted(&e, &self.load(at, &e)).into_iter().for_each(|value| out.push(value));
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let e = self.deformation(at);
        Some(deformation::dot(&e, &deformation::product(&self.stiffness, &e)) * 0.5)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.damping_time == 0.0 {
            return None;
        }
        let rate = deformation::rate(at, &self.deformation(at));
        Some(deformation::dot(&rate, &deformation::product(&self.stiffness, &rate)) * self.damping_time)
    }
}
