//! A straight, massless, uniform beam clamped to two frames: the Timoshenko beam of twelve degrees of freedom, carried
//! along by its first frame, so that any rigid motion leaves it unloaded. It bends linearly, and stretches by its chord and
//! its bow, so that tension stiffens and compression buckles it. The beam lies along x of frame i; unloaded, frame j has the
//! same axes and sits at x = L.
//!
//! ## Equations
//! The deformation is e = (u, theta): u = A_i^T (p_j - p_i) - (L, 0, 0), theta the rotation vector of frame j in the
//! axes of frame i (axis times angle). With the stiffness K of the clamped-free beam in bending and torsion (Przemieniecki,
//! Theory of Matrix Structural Analysis, 1968, Eq. 5.116, the block of the second end; the other blocks follow from
//! equilibrium) and the stretch s along its axis,
//!
//! ```text
//! V = e . K e / 2 + (E A / L) s^2 / 2      N = (E A / L) (s + tau s')
//! load = K (e + tau e') + N ds/de      P_dissipated = tau (e' . K e' + (E A / L) s'^2)      (1)
//! force on j at p_j: -A_i f      torque on j: -A_i T^-T m      (f, m) = load       (2)
//! ```
//!
//! on i the opposite along the same line; theta' = T^-1 omega, so that (2) is exactly the wrench of V for rotations of
//! any size. The stretch is that of the chord and what the axis needs to bow away from it, by which its ends are turned,
//! a = -u_y / L, b = theta_z - u_y / L about z and a = u_z / L, b = theta_y + u_z / L about y:
//!
//! ```text
//! s = |(L, 0, 0) + u| - L + sum over both of L / (1 + Phi)^2 (p (a^2 + b^2) / 2 + q a b)
//! p = 2 / 15 + Phi / 6 + Phi^2 / 12      q = -1 / 30 - Phi / 6 - Phi^2 / 12                  (3)
//! ```
//!
//! Its second derivatives are those of the geometric stiffness matrix (Przemieniecki, section 15.3; with shear as in
//! Kosmatka, Commun. Numer. Methods Eng. 11 (1995)). With Phi_y = 12 E Iz / (ky G A L^2), which goes with bending about z,
//! Phi_z = 12 E Iy / (kz G A L^2), both zero where the factor ky or kz is 0 (Euler-Bernoulli), the entries of K that are
//! not zero are
//!
//! | entry | value |
//! |---|---|
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
//! Deformations are meant to be small: a chain of elements follows large deflections, one element does not. Four elements
//! have the buckling load of a cantilever to 1e-4, and the frequencies of a string under tension to some percent. Beyond
//! a fifth of the length or 0.3 rad a run warns of it (ODY0750). At half a turn between the frames the rotation vector is
//! undefined. The second end is where `length` says, not where the frames are at the start: a difference is an initial
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

/// Displacement of the second end, in lengths, and its rotation, rad, from which on a linear beam is off by some percent.
const FARTHEST: f64 = 0.2;
const WIDEST: f64 = 0.3;

/// The element.
#[derive(Debug, Clone)]
pub struct Beam {
    length: f64,
    /// E A / L.
    axial: f64,
    /// In bending and torsion.
    stiffness: SixBySix,
    /// Of bending about y and about z.
    bows: [Bow; 2],
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

/// What bowing takes of the length: factors p and q of (3), with L / (1 + Phi)^2.
#[derive(Debug, Clone, Copy)]
struct Bow {
    p: f64,
    q: f64,
}

impl Bow {
    fn new((ei, l, shear_stiffness): (f64, f64, f64)) -> Self {
        let phi = shear_share(ei, l, shear_stiffness);
        let (factor, shear) = (l / ((1.0 + phi) * (1.0 + phi)), phi / 6.0 + phi * phi / 12.0);
        Self { p: factor * (2.0 / 15.0 + shear), q: -factor * (1.0 / 30.0 + shear) }
    }

    /// Its term of the stretch, and the slopes of that along a and b.
    fn of<S: Scalar>(&self, a: S, b: S) -> (S, S, S) {
        let (by_a, by_b) = (a * self.p + b * self.q, a * self.q + b * self.p);
        ((a * by_a + b * by_b) * 0.5, by_a, by_b)
    }
}

/// Phi.
fn shear_share(ei: f64, l: f64, shear_stiffness: f64) -> f64 {
    if shear_stiffness == 0.0 { 0.0 } else { 12.0 * ei / (shear_stiffness * l * l) }
}

/// Deflection, coupling and rotation of bending with the stiffness `ei` over the length `l`.
fn bending((ei, l, shear_stiffness): (f64, f64, f64)) -> [f64; 3] {
    let unit = ei / (1.0 + shear_share(ei, l, shear_stiffness));
    [12.0 * unit / (l * l * l), 6.0 * unit / (l * l), (3.0 * unit + ei) / l]
}

impl Element for Beam {
    const NAME: &'static str = "beam";
    const SUMMARY: &'static str = "Timoshenko beam between two frames, along x";
    const DOC: &'static str = doc_of(include_str!("beam.rs"));
    const GLYPH: &'static str = "rod";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "first end; its x axis is the axis of the beam"),
        FrameSpec::new("j", "second end; without load parallel to the first, at x = length"),
    ];
    type Parameters = BeamParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let mut k = [[0.0; 6]; 6];
        let (about_z, about_y) =
            ((p.young * p.iz, p.length, p.ky * p.shear * p.area), (p.young * p.iy, p.length, p.kz * p.shear * p.area));
        k[3][3] = p.shear * p.torsion / p.length;
        let [deflection, coupling, rotation] = bending(about_z);
        (k[1][1], k[1][5], k[5][1], k[5][5]) = (deflection, -coupling, -coupling, rotation);
        let [deflection, coupling, rotation] = bending(about_y);
        (k[2][2], k[2][4], k[4][2], k[4][4]) = (deflection, coupling, coupling, rotation);
        Ok(Self {
            length: p.length,
            axial: p.young * p.area / p.length,
            stiffness: k,
            bows: [Bow::new(about_y), Bow::new(about_z)],
            damping_time: p.damping_time,
        })
    }
}

/// The stretch (3) and its slopes along the deformation.
struct Stretch<S> {
    value: S,
    slopes: Six<S>,
}

impl Beam {
    fn deformation<S: Scalar>(&self, at: &Motion<'_, S>) -> Six<S> {
        deformation::deformation(at, [self.length, 0.0, 0.0])
    }

    /// (3)
    fn stretch<S: Scalar>(&self, e: &Six<S>) -> Stretch<S> {
        let [x, y, z, _, theta_y, theta_z] = *e;
        let along = x + self.length;
        let chord = (along * along + y * y + z * z).sqrt();
        // The difference of two lengths, without their digits in common.
        let longer = (x * (2.0 * self.length) + x * x + y * y + z * z) / (chord + self.length);
        let (turned_y, turned_z) = (z / self.length, -(y / self.length));
        let (bow_y, y_by_a, y_by_b) = self.bows[0].of(turned_y, theta_y + turned_y);
        let (bow_z, z_by_a, z_by_b) = self.bows[1].of(turned_z, theta_z + turned_z);
        let slopes = [
            along / chord,
            y / chord - (z_by_a + z_by_b) / self.length,
            z / chord + (y_by_a + y_by_b) / self.length,
            S::zero(),
            y_by_b,
            z_by_b,
        ];
        Stretch { value: longer + bow_y + bow_z, slopes }
    }

    /// (1)
    fn load<S: Scalar>(&self, at: &Motion<'_, S>, e: &Six<S>) -> Six<S> {
        let stretch = self.stretch(e);
        let (mut strained, mut stretched) = (*e, stretch.value);
        if self.damping_time > 0.0 {
            let rate = deformation::rate(at, e);
            strained = deformation::sum(e, &rate.map(|rate| rate * self.damping_time));
            stretched += deformation::dot(&stretch.slopes, &rate) * self.damping_time;
        }
        let pull = stretched * self.axial;
        deformation::sum(&deformation::product(&self.stiffness, &strained), &stretch.slopes.map(|slope| slope * pull))
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

    const CHECKS: &'static [ChannelSpec] = &[ChannelSpec::new(
        "small",
        "1",
        "is deformed by more than a fifth of its length, or 0.3 rad: it bends linearly, and a chain of shorter ones follows large deflections \
         (if it is so at the start, look at its `length`, at the order of its ends, and at its axes: it lies along x)",
    )];

    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let [x, y, z, about @ ..] = self.deformation(at);
        let (u, theta) =
            (Vec3::new(x, y, z) * S::from(1.0 / (FARTHEST * self.length)), Vec3::from(about) * S::from(1.0 / WIDEST));
        out.push(S::from(1.0) - u.dot(&u).max(theta.dot(&theta)));
    }

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
        let stretch = self.stretch(&e).value;
        Some((deformation::dot(&e, &deformation::product(&self.stiffness, &e)) + stretch * stretch * self.axial) * 0.5)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.damping_time == 0.0 {
            return None;
        }
        let e = self.deformation(at);
        let rate = deformation::rate(at, &e);
        let stretching = deformation::dot(&self.stretch(&e).slopes, &rate);
        let bending = deformation::dot(&rate, &deformation::product(&self.stiffness, &rate));
        Some((bending + stretching * stretching * self.axial) * self.damping_time)
    }
}
