//! A02 with N = 2: three parallel links, on which two couplers translate along a circle; q = angle of the links from +x.
//!
//! With n links and c couplers, all of 1 m and 1 kg: M = n/3 + c, V = g (n/2 + c) sin q.

use super::Mechanism;

const GRAVITY: f64 = 9.81;
const LINKS: f64 = 3.0;
const COUPLERS: f64 = 2.0;

pub fn mechanism() -> Mechanism {
    Mechanism {
        problem: "A02_N2",
        start: [std::f64::consts::FRAC_PI_2, -1.0],
        rate: 7.0,
        acceleration: |q, _| -GRAVITY * (0.5 * LINKS + COUPLERS) / (LINKS / 3.0 + COUPLERS) * q.cos(),
        columns: &["B0x", "B0y"],
        measured: |q| vec![q.cos(), q.sin()],
    }
}
