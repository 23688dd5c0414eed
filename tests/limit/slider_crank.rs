//! The compressor: crank, rod and piston, driven by a motor against a gas force; q = angle of the crank. mm, ms, kg, kN.
//!
//! The rod is inclined by p with l sin p = r sin q, and the piston is at x = r cos q + l cos p.

use super::Mechanism;

const CRANK: f64 = 8.5;
const ROD: f64 = 42.0;
/// Centre of mass of the rod from the crank pin.
const ROD_COM: f64 = 15.75;
const ROTOR_INERTIA: f64 = 30.0;
const ROD_MASS: f64 = 0.03;
const ROD_INERTIA: f64 = 3.5;
const PISTON_MASS: f64 = 0.03;
const FRICTION: f64 = 0.0025;
const BREAKDOWN_TORQUE: f64 = 0.246;
const BREAKDOWN_SLIP: f64 = 0.2;
const SYNCHRONOUS_SPEED: f64 = 0.12 * std::f64::consts::PI;
const COSINES: [f64; 11] =
    [0.04541, 0.07434, 0.04551, 0.02472, 0.01162, 0.00455, 0.00150, 0.00063, 0.00058, 0.00056, 0.00034];
const SINES: [f64; 10] =
    [-0.02807, -0.03265, -0.02485, -0.01544, -0.00747, -0.00237, 0.00016, 0.00088, 0.00071, 0.00030];

pub fn mechanism() -> Mechanism {
    Mechanism {
        problem: "compressor",
        start: [0.0, 0.32],
        rate: 0.37,
        acceleration,
        columns: &["theta", "x_p"],
        measured: |q| {
            let sin_p = CRANK / ROD * q.sin();
            vec![q, CRANK * q.cos() + ROD * (1.0 - sin_p * sin_p).sqrt()]
        },
    }
}

fn acceleration(q: f64, rate: f64) -> f64 {
    let (sin, cos) = q.sin_cos();
    // Inclination of the rod and its derivatives with respect to q.
    let sin_p = CRANK / ROD * sin;
    let cos_p = (1.0 - sin_p * sin_p).sqrt();
    let p1 = CRANK / ROD * cos / cos_p;
    let p2 = (sin_p * p1 * p1 - sin_p) / cos_p;
    // Those of a point of the line through crank pin and piston pin, `a` from the crank pin: along x, and across.
    let along = |a: f64| (-CRANK * sin - a * sin_p * p1, -CRANK * cos - a * (cos_p * p1 * p1 + sin_p * p2));
    let (piston1, piston2) = along(ROD);
    let (rod_x1, rod_x2) = along(ROD_COM);
    let share = CRANK * (1.0 - ROD_COM / ROD);
    let (rod_y1, rod_y2) = (share * cos, -share * sin);
    let inertia = ROTOR_INERTIA
        + ROD_MASS * (rod_x1 * rod_x1 + rod_y1 * rod_y1)
        + ROD_INERTIA * p1 * p1
        + PISTON_MASS * piston1 * piston1;
    let half_change =
        ROD_MASS * (rod_x1 * rod_x2 + rod_y1 * rod_y2) + ROD_INERTIA * p1 * p2 + PISTON_MASS * piston1 * piston2;
    // Harmonics by turning on.
    let (mut cos_k, mut sin_k, mut force) = (1.0, 0.0, COSINES[0]);
    for (a, b) in COSINES[1..].iter().zip(&SINES) {
        (cos_k, sin_k) = (cos_k * cos - sin_k * sin, sin_k * cos + cos_k * sin);
        force += a * cos_k + b * sin_k;
    }
    let slip = 1.0 - rate / SYNCHRONOUS_SPEED;
    let motor = 2.0 * BREAKDOWN_TORQUE * BREAKDOWN_SLIP * slip / (slip * slip + BREAKDOWN_SLIP * BREAKDOWN_SLIP);
    (motor - FRICTION * rate - force * piston1 - half_change * rate * rate) / inertia
}
