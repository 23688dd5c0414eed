//! The generalized-alpha method on a pendulum with a string of length 1: two coordinates, one constraint.

use super::*;

const GRAVITY: f64 = 9.81;

/// Positions, velocities, and the integral of y in the state. Mass 1, damping 0; a spring of `stiffness` holds x.
struct Pendulum {
    stiffness: f64,
    /// Leave the stiffness out of the matrix.
    rough: bool,
    position: [f64; 2],
    multiplier: f64,
    shares: [f64; 2],
    residuals: usize,
    samples: Vec<(f64, Vec<f64>)>,
}

impl Pendulum {
    fn new(stiffness: f64) -> Self {
        Self {
            stiffness,
            rough: false,
            position: [0.0; 2],
            multiplier: 0.0,
            shares: [1.0; 2],
            residuals: 0,
            samples: Vec::new(),
        }
    }

    fn force(&self, y: &[f64]) -> [f64; 2] {
        [-self.stiffness * y[0], -GRAVITY]
    }

    /// Index 1: q.q = 1 differentiated twice gives v.v + q.a = 0 with a = f - 2 lambda q.
    fn multiplier_at(&self, y: &[f64]) -> f64 {
        let f = self.force(y);
        let square = y[0] * y[0] + y[1] * y[1];
        (y[2] * y[2] + y[3] * y[3] + y[0] * f[0] + y[1] * f[1]) / (2.0 * square)
    }
}

impl System for Pendulum {
    fn dim(&self) -> usize {
        5
    }

    fn rhs(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        let (f, lambda) = (self.force(y), self.multiplier_at(y));
        dy.copy_from_slice(&[y[2], y[3], f[0] - 2.0 * lambda * y[0], f[1] - 2.0 * lambda * y[1], y[1]]);
        Ok(())
    }

    fn error_norm(&mut self, _y0: &[f64], _y1: &[f64], error: &[f64]) -> f64 {
        error[..4].iter().fold(0.0, |m: f64, e| if e.abs() <= m { m } else { e.abs() })
    }

    fn second_order(&mut self) -> Option<&mut dyn SecondOrder> {
        Some(self)
    }

    fn project(&mut self, _t: f64, _y: &mut [f64]) -> Result<(), Failure> {
        panic!("constraints are met without")
    }

    fn sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        self.samples.push((t, y.to_vec()));
        Ok(())
    }
}

impl SecondOrder for Pendulum {
    fn velocities(&self) -> usize {
        2
    }

    fn multipliers(&self) -> usize {
        1
    }

    fn sums_from(&self) -> usize {
        4
    }

    fn velocities_of(&self, y: &[f64], velocities: &mut [f64]) {
        velocities.copy_from_slice(&y[2..4]);
    }

    fn place(&self, y0: &[f64], increment: &[f64], velocities: &[f64], y: &mut [f64]) {
        y.copy_from_slice(&[y0[0] + increment[0], y0[1] + increment[1], velocities[0], velocities[1], y0[4]]);
    }

    fn residual(
        &mut self,
        at: &Instant<'_>,
        forces: &mut [f64],
        rows: &mut [f64],
        dy: &mut [f64],
    ) -> Result<(), Failure> {
        self.residuals += 1;
        let (y, a, lambda) = (at.y, at.accelerations, at.multipliers[0]);
        let f = self.force(y);
        for k in 0..2 {
            forces[k] = a[k] + 2.0 * lambda * y[k] - f[k];
        }
        rows[0] = y[0] * y[0] + y[1] * y[1] - 1.0;
        dy.copy_from_slice(&[y[2], y[3], a[0], a[1], y[1]]);
        (self.position, self.multiplier) = ([y[0], y[1]], lambda);
        Ok(())
    }

    fn factor(&mut self, mass_share: f64, _damping_share: f64) -> Result<(), Failure> {
        let (known, lambda) = (f64::from(u8::from(!self.rough)), self.multiplier);
        self.shares = [mass_share + known * (2.0 * lambda + self.stiffness), mass_share + known * 2.0 * lambda];
        Ok(())
    }

    fn solve(&mut self, forces: &[f64], rows: &[f64], moves: &mut [f64], changes: &mut [f64]) -> Result<(), Failure> {
        // D moves + J changes = -forces, J . moves = -row.
        let (d, j) = (self.shares, self.position.map(|x| 2.0 * x));
        let schur = j[0] * j[0] / d[0] + j[1] * j[1] / d[1];
        changes[0] = (rows[0] - j[0] * forces[0] / d[0] - j[1] * forces[1] / d[1]) / schur;
        for k in 0..2 {
            moves[k] = (-forces[k] - j[k] * changes[0]) / d[k];
        }
        Ok(())
    }
}

const START: [f64; 5] = [1.0, 0.0, 0.0, 0.0, 0.0];
const END: f64 = 1.7;

/// The state and the multiplier at the end.
fn swing(pendulum: &mut Pendulum, steps: u32, samples: &[f64]) -> ([f64; 5], f64, Outcome) {
    let mut y = START;
    let mut method = GeneralizedAlpha::default();
    let span = Span { t_start: 0.0, t_end: END, sample_times: samples };
    let outcome = method.integrate(pendulum, &mut y, &span, &fixed(END / f64::from(steps))).unwrap();
    assert!(matches!(outcome.status, Status::Completed), "{outcome:?}");
    (y, method.multipliers()[0], outcome)
}

/// The same by angle, to round-off: phi'' = -g cos(phi) + k sin(phi) cos(phi), with x = cos(phi), y = sin(phi).
fn exact(stiffness: f64) -> ([f64; 5], f64) {
    struct Angle(f64);
    impl System for Angle {
        fn dim(&self) -> usize {
            3
        }
        fn rhs(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
            let (sin, cos) = y[0].sin_cos();
            dy.copy_from_slice(&[y[1], -GRAVITY * cos + self.0 * sin * cos, sin]);
            Ok(())
        }
        fn error_norm(&mut self, _: &[f64], _: &[f64], error: &[f64]) -> f64 {
            error.iter().fold(0.0, |m: f64, e| m.max(e.abs())) / 1e-13
        }
    }
    let mut y = [0.0; 3];
    let span = Span { t_start: 0.0, t_end: END, sample_times: &[] };
    dop853().integrate(&mut Angle(stiffness), &mut y, &span, &Options::default()).unwrap();
    let (sin, cos) = y[0].sin_cos();
    let state = [cos, sin, -sin * y[1], cos * y[1], y[2]];
    (state, Pendulum::new(stiffness).multiplier_at(&state))
}

#[test]
fn generalized_alpha_has_order_two_in_positions_velocities_and_multipliers() {
    let (state, multiplier) = exact(3.0);
    let errors = |steps| {
        let (y, lambda, outcome) = swing(&mut Pendulum::new(3.0), steps, &[]);
        assert_eq!((outcome.counters.steps, outcome.counters.rejected), (steps as usize, 0));
        [
            distance(&y[..2], &state[..2]),
            distance(&y[2..4], &state[2..4]),
            (lambda - multiplier).abs(),
            (y[4] - state[4]).abs(),
        ]
    };
    let (coarse, fine) = (errors(400), errors(800));
    for (what, (coarse, fine)) in ["position", "velocity", "multiplier", "sum"].iter().zip(coarse.into_iter().zip(fine))
    {
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() < 0.05, "{what}: order {order}, {coarse:e} to {fine:e}");
    }
    assert!(fine[0] < 2e-4, "{fine:?}");
}

#[test]
fn positions_meet_the_constraints_and_velocities_nearly() {
    let (y, _, _) = swing(&mut Pendulum::new(0.0), 400, &[]);
    assert!((y[0] * y[0] + y[1] * y[1] - 1.0).abs() < 1e-14);
    let drift = (y[0] * y[2] + y[1] * y[3]).abs();
    assert!(drift > 1e-9 && drift < 1e-3, "index 3: {drift:e}");
}

#[test]
fn samples_inside_steps_are_as_good_as_steps() {
    let times = [0.0, 0.4003, 0.8, 1.2999];
    let mut coarse = Pendulum::new(0.0);
    swing(&mut coarse, 200, &times);
    let mut fine = Pendulum::new(0.0);
    swing(&mut fine, 1600, &times);
    assert_eq!(coarse.samples.len(), 4);
    assert_eq!(coarse.samples[0].1, START);
    for ((t, a), (_, b)) in coarse.samples.iter().zip(&fine.samples) {
        assert!(distance(&a[..2], &b[..2]) < 2e-3, "{t}: {a:?} {b:?}");
    }
}

#[test]
fn a_rough_matrix_gives_the_same_motion_in_more_iterations() {
    let mut rough = Pendulum::new(40.0);
    rough.rough = true;
    let (a, lambda_a, known) = swing(&mut Pendulum::new(40.0), 300, &[]);
    let (b, lambda_b, guessed) = swing(&mut rough, 300, &[]);
    assert!(distance(&a, &b) < 1e-8 && (lambda_a - lambda_b).abs() < 1e-7, "{a:?} {b:?}");
    let iterations = [known.counters.newton_iterations, guessed.counters.newton_iterations];
    assert!(iterations[0] < iterations[1], "{iterations:?}");
    assert!(known.counters.factorisations < known.counters.steps, "the matrix is kept: {:?}", known.counters);
}

#[test]
fn a_step_whose_equations_have_no_solution_ends_the_run() {
    // Without the stiffness in the matrix, corrections grow.
    let mut rough = Pendulum::new(1e7);
    rough.rough = true;
    let span = Span { t_start: 0.0, t_end: END, sample_times: &[] };
    let mut y = [0.6, -0.8, 0.0, 0.0, 0.0];
    let outcome = GeneralizedAlpha::default().integrate(&mut rough, &mut y, &span, &fixed(0.05)).unwrap();
    assert!(
        matches!(outcome.status, Status::StoppedEarly { reason: StopReason::NoConvergence { .. }, .. }),
        "{outcome:?}"
    );
    assert_eq!(outcome.counters.rejected, 1);
}

#[test]
fn it_says_what_it_needs() {
    let refusal = |system: &mut dyn System, y: &mut [f64], options: &Options| {
        let span = Span { t_start: 0.0, t_end: 1.0, sample_times: &[] };
        GeneralizedAlpha::default().integrate(system, y, &span, options).unwrap_err().to_string()
    };
    let refused = refusal(&mut Pendulum::new(0.0), &mut START.clone(), &Options::default());
    assert!(refused.contains("needs a fixed step"), "{refused}");
    let mut probe = Probe::new(oscillator, 2, 1e-9);
    let refused = refusal(&mut probe, &mut [1.0, 0.0], &fixed(0.1));
    assert!(refused.contains("second order"), "{refused}");
}
