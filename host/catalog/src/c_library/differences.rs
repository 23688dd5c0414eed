//! Derivatives of an opaque joint that gives none, by differences of fourth order.
//!
//! The steps balance what the formulas leave out against rounding: about 1e-12 of a value for first derivatives, 1e-10 for
//! second ones, where the rows bend over lengths and times like those of [`Scales`].

use element_api::set::{Layout, Wanted};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Step of first derivatives, as a share of the scale; in rad for rotations.
const FIRST: f64 = 1e-3;
/// Step of second derivatives.
const SECOND: f64 = 5e-3;

/// Over what the rows of a joint bend; 0: unknown.
#[derive(Debug, Clone, Copy)]
pub struct Scales {
    pub length: f64,
    pub time: f64,
}

/// Completes the results of a joint whose values and angles are there. `values` evaluates it with other inputs.
pub fn complete<E>(
    layout: &Layout,
    scales: Scales,
    inputs: &[f64],
    wanted: Wanted,
    results: &mut [f64],
    mut values: impl FnMut(&[f64], &mut [f64]) -> Result<(), E>,
) -> Result<(), E> {
    let (n, frames) = (layout.values, layout.frames);
    let length = if scales.length > 0.0 { scales.length } else { extent(layout, inputs) };
    let time = if scales.time > 0.0 { scales.time } else { 1.0 };
    let mut moved = inputs.to_vec();
    let mut found = vec![0.0; results.len()];
    // Weighted sums of the values at points along a motion.
    let mut sum = |weights: &[(f64, f64)], motion: &dyn Fn(f64, &mut [f64]), total: &mut [f64]| -> Result<(), E> {
        total.fill(0.0);
        for (step, weight) in weights {
            moved.copy_from_slice(inputs);
            motion(*step, &mut moved);
            found.fill(f64::NAN);
            values(&moved, &mut found)?;
            for (total, value) in total.iter_mut().zip(&found[..n]) {
                *total += weight * value;
            }
        }
        Ok(())
    };
    let mut total = vec![0.0; n];
    if wanted.jacobian {
        for direction in 0..6 * frames {
            let (frame, k) = (direction / 6, direction % 3);
            let step = if direction % 6 < 3 { FIRST * length } else { FIRST };
            let motion = |s: f64, inputs: &mut [f64]| {
                let axis = Vector3::ith(k, s);
                let zero = Vector3::zeros();
                let (shift, turn) = if direction % 6 < 3 { (axis, zero) } else { (zero, axis) };
                move_frame(&mut inputs[layout.frames_at() + 18 * frame..][..18], shift, turn);
            };
            sum(&first(step), &motion, &mut total)?;
            for (row, value) in total.iter().enumerate() {
                results[n + row * 6 * frames + direction] = *value;
            }
        }
        sum(&first(FIRST * time), &|s, inputs| inputs[0] += s, &mut total)?;
        results[n * (1 + 6 * frames)..][..n].copy_from_slice(&total);
    }
    if wanted.second {
        let speeds: Vec<[Vector3<f64>; 2]> = inputs[layout.frames_at()..]
            .chunks_exact(18)
            .map(|frame| {
                let rotation = Matrix3::from_row_slice(&frame[3..12]);
                let vector = |at: usize| Vector3::new(frame[at], frame[at + 1], frame[at + 2]);
                [vector(12), rotation.tr_mul(&vector(15))]
            })
            .collect();
        let fastest = speeds.iter().fold(1.0 / time, |most, [v, w]| most.max(v.norm() / length).max(w.norm()));
        let motion = |s: f64, inputs: &mut [f64]| {
            inputs[0] += s;
            for (frame, [velocity, spin]) in inputs[layout.frames_at()..].chunks_exact_mut(18).zip(&speeds) {
                move_frame(frame, velocity * s, spin * s);
            }
        };
        sum(&second(SECOND / fastest), &motion, &mut total)?;
        results[n * (2 + 6 * frames)..][..n].copy_from_slice(&total);
    }
    Ok(())
}

/// The largest distance of two frames; 1 m where all are in one place.
fn extent(layout: &Layout, inputs: &[f64]) -> f64 {
    let points: Vec<Vector3<f64>> =
        inputs[layout.frames_at()..].chunks_exact(18).map(|f| Vector3::new(f[0], f[1], f[2])).collect();
    let distances = points.iter().flat_map(|a| points.iter().map(move |b| (a - b).norm()));
    let size = points.iter().fold(0.0, |most: f64, point| most.max(point.norm()));
    // Below this, a distance is what rounding and assembly left.
    let largest = distances.fold(0.0, f64::max);
    if largest > 1e-6 * size && largest > 0.0 { largest } else { 1.0 }
}

/// Shifts the origin in ground directions and turns about the frame's own axes.
fn move_frame(frame: &mut [f64], shift: Vector3<f64>, turn: Vector3<f64>) {
    for k in 0..3 {
        frame[k] += shift[k];
    }
    let rotation = Matrix3::from_row_slice(&frame[3..12]) * Rotation3::new(turn).matrix();
    for (k, slot) in frame[3..12].iter_mut().enumerate() {
        *slot = rotation[(k / 3, k % 3)];
    }
}

/// Steps and weights of a first derivative.
fn first(h: f64) -> [(f64, f64); 4] {
    let w = 1.0 / (12.0 * h);
    [(-2.0 * h, w), (-h, -8.0 * w), (h, 8.0 * w), (2.0 * h, -w)]
}

/// Steps and weights of a second derivative.
fn second(h: f64) -> [(f64, f64); 5] {
    let w = 1.0 / (12.0 * h * h);
    [(-2.0 * h, -w), (-h, 16.0 * w), (0.0, -30.0 * w), (h, 16.0 * w), (2.0 * h, -w)]
}
