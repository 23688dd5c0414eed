//! Derivatives along a direction, and steps of a Rosenbrock method, by the interpreter: what `c/tangents.c` and `c/rosenbrock.c` do.

use super::twin::{Failed, Run, Twin, turned};
use crate::machine::Machine;
use crate::method::Implicit;

/// What a Rosenbrock method keeps.
pub(crate) struct Linear {
    by_time: Vec<f64>,
    /// Row by row.
    jacobian: Vec<f64>,
    matrix: Vec<f64>,
    exchanged: Vec<usize>,
}

/// Programs of derivatives.
pub(crate) struct TangentRuns {
    pub(crate) motion: Run,
    pub(crate) outputs: Option<Run>,
    pub(crate) switches: Option<Run>,
}

impl TangentRuns {
    pub(crate) fn of(machine: &Machine) -> Option<Self> {
        let tangents = machine.tangents.as_ref()?;
        let run = |program| Run::new(program, false);
        Some(Self {
            motion: run(&tangents.motion),
            outputs: tangents.outputs.as_ref().map(run),
            switches: tangents.switches.as_ref().map(run),
        })
    }
}

impl Linear {
    pub(crate) fn of(machine: &Machine) -> Option<Self> {
        let n = machine.dim();
        let squared = || vec![0.0; n * n];
        let kept = Self { by_time: vec![0.0; n], jacobian: squared(), matrix: squared(), exchanged: vec![0; n] };
        machine.method.implicit.map(|_| kept)
    }

    /// See `factor` in `c/rosenbrock.c`.
    fn factor(&mut self, h: f64, gamma: f64) -> Result<(), Failed> {
        let (n, diagonal) = (self.by_time.len(), 1.0 / (h * gamma));
        let a = &mut self.matrix;
        for i in 0..n {
            for j in 0..n {
                a[i * n + j] = -self.jacobian[i * n + j];
            }
            a[i * n + i] += diagonal;
        }
        for k in 0..n {
            let mut best = k;
            for i in k + 1..n {
                if a[i * n + k].abs() > a[best * n + k].abs() {
                    best = i;
                }
            }
            self.exchanged[k] = best;
            for j in 0..n {
                a.swap(k * n + j, best * n + j);
            }
            let pivot = a[k * n + k];
            if pivot == 0.0 || !pivot.is_finite() {
                return Err(Failed::NotFinite);
            }
            for i in k + 1..n {
                let share = a[i * n + k] / pivot;
                a[i * n + k] = share;
                for j in k + 1..n {
                    a[i * n + j] -= share * a[k * n + j];
                }
            }
        }
        Ok(())
    }

    fn solve(&self, x: &mut [f64]) {
        let (n, a) = (x.len(), &self.matrix);
        for i in 0..n {
            x.swap(i, self.exchanged[i]);
        }
        for i in 0..n {
            for j in 0..i {
                x[i] -= a[i * n + j] * x[j];
            }
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                x[i] -= a[i * n + j] * x[j];
            }
            x[i] /= a[i * n + i];
        }
    }
}

/// Derivatives along a direction.
#[derive(Debug, Clone, Default)]
pub struct Slopes {
    /// Of the rates of the state.
    pub rates: Vec<f64>,
    /// Of the outputs, in their units.
    pub outputs: Vec<f64>,
    /// Of the functions that change their sign where equations switch.
    pub switches: Vec<f64>,
}

impl Twin {
    /// Exact derivatives where it is along a direction: along time, then states, then inputs in their units; `None` where the
    /// machine has none.
    pub fn derivatives(&mut self, seed: &[f64]) -> Option<Slopes> {
        let mut tangents = self.tangents.take()?;
        let state = self.state().to_vec();
        let mut slopes = Slopes { rates: self.rate_tangents(&mut tangents, seed), ..Slopes::default() };
        let (motion, m) = (tangents.motion.found.clone(), self.machine());
        let first = m.portable.coordinates.input_count + m.seeds();
        let solved = m.portable.coordinates.columns + m.portable.rows.len();
        let factors: Vec<f64> = m.outputs.iter().map(|port| port.factor).collect();
        for (run, found) in
            [(&mut tangents.outputs, &mut slopes.outputs), (&mut tangents.switches, &mut slopes.switches)]
        {
            let Some(run) = run else { continue };
            self.solve_for(self.time(), &state, true);
            self.load(self.time(), &state);
            self.load_seed(seed);
            self.given[first..first + solved].copy_from_slice(&motion[..solved]);
            found.extend_from_slice(run.at(&self.given));
        }
        slopes
            .outputs
            .iter_mut()
            .zip(factors)
            .filter(|(_, factor)| *factor != 1.0)
            .for_each(|(x, factor)| *x /= factor);
        self.tangents = Some(tangents);
        Some(slopes)
    }

    fn load_seed(&mut self, seed: &[f64]) {
        let machine = &self.machine;
        let (first, inputs) = (machine.portable.coordinates.input_count, 1 + machine.dim());
        self.given[first..first + inputs].copy_from_slice(&seed[..inputs]);
        for ((slot, seed), port) in self.given[first + inputs..].iter_mut().zip(&seed[inputs..]).zip(&machine.inputs) {
            *slot = seed * port.factor;
        }
    }

    fn rate_tangents(&mut self, tangents: &mut TangentRuns, seed: &[f64]) -> Vec<f64> {
        let y = self.state().to_vec();
        self.load(self.time(), &y);
        self.load_seed(seed);
        let found = tangents.motion.at(&self.given);
        let (coordinates, dy) = (&self.machine.portable.coordinates, &seed[1..]);
        let mut rates = vec![0.0; y.len()];
        for line in &coordinates.lines {
            rates[line.position] = dy[line.velocity];
            rates[line.velocity] = found[line.column];
        }
        for rotation in &coordinates.rotations {
            let (p, v, c) = (rotation.position, rotation.velocity, rotation.column);
            let four = |x: &[f64]| [x[p], x[p + 1], x[p + 2], x[p + 3]];
            let three = |x: &[f64]| [x[v], x[v + 1], x[v + 2]];
            let (turns, moved) = (turned(four(dy), three(&y)), turned(four(&y), three(dy)));
            for k in 0..4 {
                rates[p + k] = turns[k] + moved[k];
            }
            rates[v..v + 3].copy_from_slice(&found[c..c + 3]);
        }
        let from = coordinates.columns + self.machine.portable.rows.len();
        rates[coordinates.motion..].copy_from_slice(&found[from..]);
        rates
    }

    /// Derivatives of the rates with respect to time and states, where it is.
    pub(super) fn linearise(&mut self) {
        // Explicit methods need none.
        let Some(mut linear) = self.linear.take() else { return };
        let Some(mut tangents) = self.tangents.take() else { return };
        let n = linear.by_time.len();
        let mut seed = vec![0.0; self.machine.seeds()];
        for k in 0..=n {
            seed[k] = 1.0;
            let found = self.rate_tangents(&mut tangents, &seed);
            seed[k] = 0.0;
            if k == 0 {
                linear.by_time.copy_from_slice(&found);
            } else {
                found.iter().enumerate().for_each(|(i, value)| linear.jacobian[i * n + k - 1] = *value);
            }
        }
        (self.tangents, self.linear) = (Some(tangents), Some(linear));
    }

    /// A step of the method from where it is, brought to the constraints.
    pub(super) fn advance_implicitly(
        &mut self,
        implicit: &Implicit,
        y: &[f64],
        h: f64,
        next: &mut [f64],
    ) -> Result<(), Failed> {
        let Some(mut linear) = self.linear.take() else { return Err(Failed::NotFinite) };
        let done = self.stages(&mut linear, implicit, y, h, next);
        self.linear = Some(linear);
        done?;
        self.project(self.time() + h, next)
    }

    fn stages(
        &mut self,
        linear: &mut Linear,
        implicit: &Implicit,
        y: &[f64],
        h: f64,
        next: &mut [f64],
    ) -> Result<(), Failed> {
        let (method, t, n) = (self.machine.method, self.time(), y.len());
        linear.factor(h, implicit.gamma)?;
        self.last.clone_from(&self.first);
        let mut slopes = vec![vec![0.0; n]; method.b.len()];
        let mut stage = vec![0.0; n];
        let summed = |weights: &[f64], slopes: &[Vec<f64>], i: usize| {
            let mut sum = 0.0;
            for (weight, slope) in weights.iter().zip(slopes) {
                sum += weight * slope[i];
            }
            sum
        };
        for s in 0..method.b.len() {
            for i in 0..n {
                stage[i] = y[i] + summed(method.a[s], &slopes, i);
            }
            let mut found = vec![0.0; n];
            self.rates(t + method.c[s] * h, &stage, &mut found)?;
            self.reach(t + method.c[s] * h, &stage);
            for (i, found) in found.iter_mut().enumerate() {
                *found += summed(implicit.coupling[s], &slopes, i) / h + implicit.times[s] * h * linear.by_time[i];
            }
            linear.solve(&mut found);
            slopes[s] = found;
        }
        for i in 0..n {
            next[i] = y[i] + summed(method.b, &slopes, i);
        }
        Ok(())
    }
}
