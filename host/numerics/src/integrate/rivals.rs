//! When an explicit method gives way to an implicit one, and when that gives way again.

use super::Price;
use super::fill::Work;
use super::jacobian::{Columns, Jacobian};
use super::run::Run;

/// Suspicious steps, less others, that it takes to suspect stiffness.
pub(super) const FEWEST_HITS: u32 = 15;
/// Share of the border of stability from which on a step is near it.
const NEAR_BORDER: f64 = 0.75;
/// The same where the solution changes much more slowly than the equations could.
const FAR_FROM_BORDER: f64 = 0.1;
/// That much more slowly: the ratio of the rate at which differences die out to that at which the solution's derivative
/// changes.
const SLOWER: f64 = 20.0;
/// Accepted steps after which an implicit method is judged.
const WINDOW: usize = 8;
/// In its first window, which begins with a step of explicit size, it may cost more by this factor.
const FIRST_WINDOW: f64 = 4.0;
/// Multiplications of a vector by the Jacobian to find its largest eigenvalue, in two halves: the second is looked at.
const POWERS: usize = 10;

/// Cost of work, in operations.
#[derive(Debug, Clone, Copy)]
struct Tariff {
    price: Price,
    size: f64,
}

impl Tariff {
    fn of(run: &Run<'_>) -> Self {
        Self { price: run.system.price(), size: run.system.dim() as f64 }
    }

    /// The cost of all work so far, as that of evaluations, Jacobians, and the matrices of [`super::Radau5`].
    fn total(&self, run: &Run<'_>) -> f64 {
        let evaluations = (run.counters.evaluations + run.counters.projections) as f64;
        // Differences are among the evaluations.
        let jacobians = self.price.jacobian.unwrap_or(0.0) * run.counters.jacobians as f64;
        self.price.evaluation * evaluations + jacobians + run.matrix_work
    }
}

/// Evaluations a step of an explicit method, and of the implicit one with its iterations and their number.
const EXPLICIT_EVALUATIONS: f64 = 13.0;
const IMPLICIT_EVALUATIONS: f64 = 11.0;
const ITERATIONS: f64 = 3.0;
/// Its complex matrices, besides a real one.
const COMPLEX_MATRICES: usize = 1;
/// Near the border of stability, an implicit method may take steps that are longer by this factor, even where the
/// solution's derivative is nothing but noise, as at rest.
const LONGER: f64 = 100.0;

impl Tariff {
    /// The cost of an implicit step with its own Jacobian over that of an explicit one: how much longer it has to be.
    fn ratio(&self, matrices: Work) -> f64 {
        let evaluation = self.price.evaluation;
        let jacobian = self.price.jacobian.unwrap_or(self.size * evaluation);
        let matrices = matrices.factorisation + ITERATIONS * matrices.solution;
        (IMPLICIT_EVALUATIONS * evaluation + jacobian + matrices) / (EXPLICIT_EVALUATIONS * evaluation)
    }
}

/// What is known of an explicit method's step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Signs {
    /// Its size.
    pub(super) step: f64,
    /// `h |lambda|`, estimated, as a share of the border of stability.
    pub(super) share: f64,
    /// `h |lambda|` over the relative change of the derivative during the step.
    pub(super) slowness: f64,
}

/// An explicit method suspected of stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Suspect {
    /// Size of its last step.
    pub(super) step: f64,
    /// Its cost per time.
    rate: f64,
}

impl Suspect {
    /// One that cannot make a step, at whatever cost.
    pub(super) fn hopeless(run: &Run<'_>) -> Self {
        Self { step: run.smallest_step(), rate: f64::INFINITY }
    }
}

/// The time that an implicit method has been at work.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stint {
    tariff: Tariff,
    suspect: Suspect,
    /// Time and cost at its beginning.
    since: (f64, f64),
}

impl Stint {
    /// It begins now, in place of the suspect.
    pub(super) fn new(run: &Run<'_>, suspect: Suspect) -> Self {
        let tariff = Tariff::of(run);
        Self { tariff, suspect, since: (run.t, tariff.total(run)) }
    }

    /// Whether it has cost less, up to now, than the suspect would have with the steps it took last.
    pub(super) fn paid(&self, run: &Run<'_>) -> bool {
        let (t, cost) = self.since;
        self.tariff.total(run) - cost < self.suspect.rate * (run.t - t)
    }
}

/// Watches the steps of an explicit method. Corners, as of contacts, make few steps suspicious and those in between not;
/// motions that are fast, but followed, make the derivative change as fast as differences die out.
#[derive(Debug, Clone)]
pub(super) struct Suspicion {
    tariff: Tariff,
    /// How much longer implicit steps have to be.
    ratio: f64,
    /// Whether matrices that would take much if they were dense are not known yet: steps are suspected all the same.
    is_guess: bool,
    /// Cost before which preparing an implicit method does not pay.
    least: f64,
    enough: u32,
    hits: u32,
    /// Time and cost when the first of the hits was counted.
    since: (f64, f64),
}

impl Suspicion {
    pub(super) fn new(run: &Run<'_>, enough: u32) -> Self {
        let tariff = Tariff::of(run);
        let least = tariff.price.preparation;
        let ratio = tariff.ratio(run.matrices.unwrap_or(Work::dense_step(run.system.dim())));
        let is_guess = run.matrices.is_none() && tariff.price.jacobian.is_some() && ratio > SLOWER;
        let ratio = if is_guess { 0.0 } else { ratio };
        Self { tariff, ratio, is_guess, least, enough, hits: 0, since: (run.t, 0.0) }
    }

    /// Takes an accepted step to `y`, from which it continues at `rates`.
    pub(super) fn see(&mut self, run: &mut Run<'_>, signs: Signs, y: &[f64], rates: &[f64]) -> Option<Suspect> {
        let slow = signs.share > FAR_FROM_BORDER && signs.slowness > SLOWER.max(self.ratio);
        let near = signs.share > NEAR_BORDER && LONGER > self.ratio;
        if !slow && !near {
            self.hits = self.hits.saturating_sub(1);
            return None;
        }
        if self.hits == 0 {
            self.since = (run.t, self.tariff.total(run));
        }
        self.hits += 1;
        let (t, cost) = self.since;
        let total = self.tariff.total(run);
        if self.hits < self.enough || run.t <= t || total < self.least {
            return None;
        }
        if self.is_guess {
            self.look(run, y, rates);
            return None;
        }
        Some(Suspect { step: signs.step, rate: (total - cost) / (run.t - t) })
    }

    /// Finds out what the matrices of an implicit method take, by a Jacobian. Steps are looked at anew then.
    fn look(&mut self, run: &mut Run<'_>, y: &[f64], rates: &[f64]) {
        let mut jacobian = Jacobian::default();
        jacobian.resize(y.len());
        run.matrices = Some(match jacobian.take(run, y, rates) {
            Ok(()) => jacobian.fill.work(COMPLEX_MATRICES),
            Err(_) => Work::dense_step(y.len()),
        });
        *self = Self::new(run, self.enough);
    }
}

/// Watches the steps of an implicit method: whether it gets on at less cost than the explicit one would. The cost of that is
/// what it was, in proportion to the largest eigenvalue of the Jacobian, which limits its steps.
#[derive(Debug, Clone)]
pub(super) struct Defender {
    tariff: Tariff,
    suspect: Suspect,
    /// Largest eigenvalue at the beginning, and now.
    eigenvalues: Option<(f64, f64)>,
    /// Jacobians seen.
    jacobians: usize,
    /// Time, cost and steps at the beginning of the window.
    since: (f64, f64, usize),
    leniency: f64,
    vectors: [Vec<f64>; 2],
}

impl Defender {
    pub(super) fn new(run: &Run<'_>, suspect: Suspect) -> Self {
        let tariff = Tariff::of(run);
        let cost = tariff.total(run);
        Self {
            tariff,
            suspect,
            eigenvalues: None,
            jacobians: run.counters.jacobians,
            since: (run.t, cost, run.counters.steps),
            leniency: FIRST_WINDOW,
            vectors: [vec![0.0; run.system.dim()], vec![0.0; run.system.dim()]],
        }
    }

    /// Takes an accepted step, after which the Jacobian is `matrix`. The step with which the explicit
    /// method had better continue, if it had.
    pub(super) fn see(&mut self, run: &Run<'_>, matrix: &Columns) -> Option<f64> {
        if self.jacobians != run.counters.jacobians {
            self.jacobians = run.counters.jacobians;
            let now = self.largest_eigenvalue(matrix);
            self.eigenvalues = Some((self.eigenvalues.map_or(now, |(first, _)| first), now));
        }
        let (t, cost, steps) = self.since;
        if run.counters.steps < steps + WINDOW {
            return None;
        }
        let (first, now) = self.eigenvalues.unwrap_or((1.0, 1.0));
        let share = if first > 0.0 { now / first } else { 1.0 };
        let total = self.tariff.total(run);
        let rate = (total - cost) / (run.t - t);
        if rate > self.leniency * share * self.suspect.rate {
            return Some(self.suspect.step / share.max(1e-3));
        }
        self.leniency = 1.0;
        self.since = (run.t, total, run.counters.steps);
        None
    }

    /// By powers of the matrix, from a vector without symmetries; pairs of complex ones make the growth vary, so that its mean
    /// is taken.
    fn largest_eigenvalue(&mut self, matrix: &Columns) -> f64 {
        let [x, product] = &mut self.vectors;
        x.iter_mut().enumerate().for_each(|(k, value)| *value = 1.0 + 0.37 * (k % 7) as f64);
        let mut growth = 0.0;
        for power in 0..2 * POWERS {
            product.fill(0.0);
            for (column, factor) in x.iter().enumerate() {
                matrix.column(column).for_each(|(row, entry)| product[row] += entry * factor);
            }
            let length = |vector: &[f64]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
            let (before, after) = (length(x), length(product));
            if after == 0.0 || !after.is_finite() {
                return 0.0;
            }
            growth += if power < POWERS { 0.0 } else { (after / before).ln() };
            x.iter_mut().zip(&*product).for_each(|(value, new)| *value = new / after);
        }
        (growth / POWERS as f64).exp()
    }
}
