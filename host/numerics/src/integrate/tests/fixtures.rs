//! Problems with known solutions, and a system that records every hook.

use crate::integrate::{Accepted, Entries, Failure, Flow, Price, System};

pub type Rhs = fn(f64, &[f64], &mut [f64]);

/// A system that records every hook. The norm is the usual mixed one, root mean square.
pub struct Probe {
    pub rhs: Rhs,
    pub dim: usize,
    pub tolerance: f64,
    pub projection: Option<fn(&mut [f64])>,
    /// `rhs` fails recoverably at or beyond this time.
    pub wall: f64,
    pub fatal: bool,
    pub stop_at: f64,
    pub accepted: Accepted,
    pub hint: f64,
    pub samples: Vec<(f64, Vec<f64>)>,
    pub steps: Vec<(f64, f64, Vec<f64>)>,
    pub accepts: usize,
    /// The exact Jacobian, column by column, if it is known.
    pub jacobian: Option<Rhs>,
    /// Of the work, if not the usual one.
    pub price: Option<Price>,
    /// Absolute tolerance as a share of the relative one.
    pub absolute: f64,
    /// Conditions at which `rhs` switches, and how many.
    pub switching: Option<(usize, Rhs)>,
    /// A rate that is summed up along the steps, and the sums of its integrals and of the magnitudes of their differences.
    pub summed: Option<fn(f64, &[f64]) -> f64>,
    pub sums: [f64; 2],
}

impl Probe {
    pub fn new(rhs: Rhs, dim: usize, tolerance: f64) -> Self {
        Self {
            rhs,
            dim,
            tolerance,
            projection: None,
            wall: f64::INFINITY,
            fatal: false,
            stop_at: f64::INFINITY,
            accepted: Accepted::Unchanged,
            hint: f64::INFINITY,
            samples: Vec::new(),
            steps: Vec::new(),
            accepts: 0,
            jacobian: None,
            price: None,
            absolute: 1.0,
            switching: None,
            summed: None,
            sums: [0.0; 2],
        }
    }

    pub fn sample_times(&self) -> Vec<f64> {
        self.samples.iter().map(|(t, _)| *t).collect()
    }
}

impl System for Probe {
    fn dim(&self) -> usize {
        self.dim
    }

    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        if t >= self.wall {
            let cause = format!("there is a wall at {}", self.wall).into();
            return Err(if self.fatal { Failure::Fatal(cause) } else { Failure::Recoverable(cause) });
        }
        (self.rhs)(t, y, dy);
        Ok(())
    }

    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, e) in error.iter().enumerate() {
            let scale = self.tolerance * (self.absolute + y0[i].abs().max(y1[i].abs()));
            sum += (e / scale) * (e / scale);
        }
        (sum / error.len() as f64).sqrt()
    }

    fn tolerance(&self) -> Option<f64> {
        Some(self.tolerance)
    }

    fn price(&self) -> Price {
        self.price.unwrap_or(Price { evaluation: 100.0 * self.dim as f64, jacobian: None, preparation: 0.0 })
    }

    fn jacobian(&mut self, t: f64, y: &[f64], found: Entries<'_>) -> Result<bool, Failure> {
        let Some(jacobian) = self.jacobian else { return Ok(false) };
        let n = y.len();
        let mut matrix = vec![0.0; n * n];
        jacobian(t, y, &mut matrix);
        matrix.into_iter().enumerate().for_each(|(at, value)| found(at % n, at / n, value));
        Ok(true)
    }

    fn project(&mut self, _t: f64, y: &mut [f64]) -> Result<(), Failure> {
        if let Some(projection) = self.projection {
            projection(y);
        }
        Ok(())
    }

    fn sums_up(&self) -> bool {
        self.summed.is_some()
    }

    fn rate_summed(&mut self, t: f64, y: &[f64]) -> Result<f64, Failure> {
        Ok(self.summed.map_or(0.0, |rate| rate(t, y)))
    }

    fn sum_up(&mut self, integral: f64, difference: f64) {
        self.sums[0] += integral;
        self.sums[1] += difference.abs();
    }

    fn conditions(&self) -> usize {
        self.switching.map_or(0, |(count, _)| count)
    }

    fn switching(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), Failure> {
        if let Some((_, switching)) = self.switching {
            switching(t, y, values);
        }
        Ok(())
    }

    fn max_step_hint(&self, _t: f64, _y: &[f64]) -> f64 {
        self.hint
    }

    fn sample(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        assert_eq!(self.accepts, self.steps.len(), "samples come before accept");
        self.samples.push((t, y.to_vec()));
        Ok(())
    }

    fn accept(&mut self, _t: f64, _y: &mut [f64]) -> Result<Accepted, Failure> {
        self.accepts += 1;
        Ok(self.accepted)
    }

    fn step_done(&mut self, t: f64, y: &[f64], h: f64) -> Flow {
        self.steps.push((t, h, y.to_vec()));
        if t >= self.stop_at { Flow::Stop } else { Flow::Continue }
    }
}

/// `y' = y cos t` with the solution `exp(sin t)`, and an oscillator `u'' = -u` beside it.
pub fn smooth(t: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = y[0] * t.cos();
    dy[1] = y[2];
    dy[2] = -y[1];
}

pub fn smooth_solution(t: f64) -> [f64; 3] {
    [t.sin().exp(), t.cos(), -t.sin()]
}

pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub fn oscillator(_t: f64, y: &[f64], dy: &mut [f64]) {
    dy[0] = y[1];
    dy[1] = -y[0];
}

/// Restricted three-body problem; the orbit closes after [`ARENSTORF_PERIOD`].
pub fn arenstorf(_t: f64, y: &[f64], dy: &mut [f64]) {
    const MOON: f64 = 0.012277471;
    const EARTH: f64 = 1.0 - MOON;
    let earth_cubed = ((y[0] + MOON).powi(2) + y[1] * y[1]).powf(1.5);
    let moon_cubed = ((y[0] - EARTH).powi(2) + y[1] * y[1]).powf(1.5);
    dy[0] = y[2];
    dy[1] = y[3];
    dy[2] = y[0] + 2.0 * y[3] - EARTH * (y[0] + MOON) / earth_cubed - MOON * (y[0] - EARTH) / moon_cubed;
    dy[3] = y[1] - 2.0 * y[2] - EARTH * y[1] / earth_cubed - MOON * y[1] / moon_cubed;
}

pub const ARENSTORF_START: [f64; 4] = [0.994, 0.0, 0.0, -2.0015851063790825];
pub const ARENSTORF_PERIOD: f64 = 17.065216560157964;
