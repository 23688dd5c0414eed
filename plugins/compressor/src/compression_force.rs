//! The force of the gas in a cylinder on piston and cylinder head, given over the crank angle.
//!
//! ## Equations
//! The crank angle theta is that of the rotor frame against the housing frame about z, zero where their x axes are parallel (usually
//! the top dead centre). The force is either a curve over one turn, which repeats, or a Fourier series:
//! ```text
//! F = a_0 + sum over k >= 1 of a_k cos k theta + b_k sin k theta        (1)
//! cos k theta = 2 cos theta cos (k-1) theta - cos (k-2) theta           (2)
//! cos theta = x_rotor . x_housing     sin theta = x_rotor . y_housing   (3)
//! ```
//! (2), likewise for sin, needs no angle (Chebyshev's recurrence, Abramowitz & Stegun 1964, 22.7). The force on the piston is
//! -F z_cylinder at the piston frame's origin, and the opposite acts on the cylinder's body along the same line.
//!
//! ## Signs
//! The cylinder's z axis points along the piston's path towards the head. F > 0 is pressure: it drives the piston from the head.
//!
//! ## Singular cases
//! None. The z axes of housing and rotor must be kept parallel by a bearing. The force does work over a turn: it has no potential.
//!
//! ## Example
//! ```toml
//! title = "A piston driven by its gas force against a turning crank"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-compressor"]
//!
//! [simulation]
//! t_end = 0.1
//! output_step = 0.01
//!
//! [[body]]
//! name = "rotor"
//! mass = 1
//! inertia = [1e-3, 1e-3, 1e-3]
//! angular_velocity = [0, 0, 300]
//!
//! [[joint]]
//! name = "bearing"
//! type = "revolute"
//! bodies = ["ground", "rotor"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[body]]
//! name = "piston"
//! mass = 1
//! inertia = [1, 1, 1]
//!
//! [[joint]]
//! name = "cylinder"
//! type = "translational"
//! bodies = ["ground", "piston"]
//! point = [0, 0, 0]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "gas"
//! type = "compression-force"
//! bodies = ["ground", "piston", "ground", "rotor"]
//! axes = [[1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, 1]]
//! x_axes = [[0, 1, 0], [0, 1, 0], [1, 0, 0], [1, 0, 0]]
//! params.cosine = [45, 74]
//! params.sine = [-28]
//!
//! [[output]]
//! name = "force"
//! quantity = "value"
//! of = "gas"
//! channel = "force"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct CompressionForce {
    law: Law,
}

/// Its parameters: either the curve, or the Fourier coefficients.
#[derive(Debug, Clone, Parameters)]
pub struct CompressionForceParameters {
    /// Force over the crank angle, one turn; the last point repeats the first one.
    #[param(unit = "rad -> N")]
    pub curve: Option<Curve>,
    /// Fourier coefficients a_0, a_1, a_2 ... of the cosines; a_0 is the mean force.
    #[param(unit = "N", example = vec![100.0, 50.0])]
    pub cosine: Option<Vec<f64>>,
    /// Fourier coefficients b_1, b_2 ... of the sines.
    #[param(unit = "N", example = vec![20.0])]
    pub sine: Option<Vec<f64>>,
}

#[derive(Debug, Clone)]
enum Law {
    Curve(Table),
    /// Pairs (a_k, b_k) from k = 0, of which b_0 means nothing.
    Fourier(Vec<(f64, f64)>),
}

impl Element for CompressionForce {
    const NAME: &'static str = "compression-force";
    const SUMMARY: &'static str = "gas force between piston and cylinder as a periodic function of the crank angle";
    const DOC: &'static str = doc_of(include_str!("compression_force.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("cylinder", "on the body with the cylinder; its z axis is the piston's path, towards the head"),
        FrameSpec::new("piston", "on the piston; the force acts at its origin"),
        FrameSpec::new("housing", "on the body with the bearing; z is the crank axis, x shows where the angle is zero"),
        FrameSpec::new("rotor", "on the rotor; z is the crank axis, x shows the crank angle"),
    ];
    const PARALLEL_AXES: &'static [[usize; 2]] = &[[2, 3]];
    type Parameters = CompressionForceParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let fourier_given = p.cosine.is_some() || p.sine.is_some();
        let Some(curve) = p.curve else {
            if !fourier_given {
                return Err(ParamError::new("curve", "is missing: give `curve`, or `cosine` and `sine`"));
            }
            return Ok(Self { law: Law::Fourier(pairs(&p.cosine.unwrap_or_default(), &p.sine.unwrap_or_default())) });
        };
        if fourier_given {
            return Err(ParamError::new("curve", "is given together with `cosine` or `sine`: give one or the other"));
        }
        let table = crate::named(curve.table(Outside::Periodic), "curve")?;
        let span = table.breaks[table.breaks.len() - 1] - table.breaks[0];
        if (span / std::f64::consts::TAU - 1.0).abs() > 1e-9 {
            let degrees = span.to_degrees();
            return Err(ParamError::new("curve", format!("must span one turn (360 deg), it spans {degrees} deg")));
        }
        Ok(Self { law: Law::Curve(table) })
    }
}

fn pairs(cosine: &[f64], sine: &[f64]) -> Vec<(f64, f64)> {
    let count = cosine.len().max(sine.len() + 1);
    let sine_at = |k: usize| if k == 0 { 0.0 } else { sine.get(k - 1).copied().unwrap_or(0.0) };
    (0..count).map(|k| (cosine.get(k).copied().unwrap_or(0.0), sine_at(k))).collect()
}

impl CompressionForce {
    fn force<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        let (housing, rotor) = (&at.frames()[2], &at.frames()[3]);
        let (cos, sin) = (rotor.x().dot(&housing.x()), rotor.x().dot(&housing.y()));
        match &self.law {
            // The table repeats, so the angle within half a turn is enough.
            Law::Curve(table) => sin.atan2(cos).lookup(table),
            Law::Fourier(pairs) => series(pairs, cos, sin),
        }
    }
}

/// (1) by (2).
fn series<S: Scalar>(pairs: &[(f64, f64)], cos: S, sin: S) -> S {
    let mut sum = S::from(pairs[0].0);
    // cos and sin of (k-1) theta and of k theta.
    let (mut before, mut here) = ((S::one(), S::zero()), (cos, sin));
    for (a, b) in &pairs[1..] {
        sum += here.0 * *a + here.1 * *b;
        let next = |here: S, before: S| cos * here * 2.0 - before;
        (before, here) = (here, (next(here.0, before.0), next(here.1, before.1)));
    }
    sum
}

impl Force for CompressionForce {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("force", "N", "pressure on the piston")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, at.frames()[0].z() * -self.force(at));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.force(at));
    }
}
