//! A01: a point mass on a link of 1 m; q = angle from +x.

use super::Mechanism;

const GRAVITY: f64 = 9.81;

pub fn mechanism() -> Mechanism {
    Mechanism {
        problem: "A01",
        start: [std::f64::consts::PI, 0.0],
        rate: 4.5,
        acceleration: |q, _| -GRAVITY * q.cos(),
        columns: &["x", "y"],
        measured: |q| vec![q.cos(), q.sin()],
    }
}
