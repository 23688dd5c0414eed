//! [`Taylor`]: differential equations solved by power series, with errors far below those of doubles.
//!
//! The series of the solution through a state gives the next state and everything in between (Jorba & Zou, "A software package
//! for the numerical integration of ODEs by means of high-order Taylor methods", 2005). It is no good for stiff equations: steps
//! are as short as for any explicit method.

use super::DoubleDouble;

const ZERO: DoubleDouble = DoubleDouble::ZERO;
/// Share by which a step that is too long is made shorter.
const SHORTER: f64 = 0.85;
/// Rates at the end of a step may be off by so many times what error control lets pass: the last term of a series of order 30
/// is 30 times larger in that of the rates.
const DEFECT: f64 = 1e4;
/// How often a step is halved because rates at its end are off.
const MOST_HALVINGS: usize = 60;
/// Places of a step at which conditions are looked at.
const LOOKS: usize = 32;
/// Halvings that find the place of a change, and share of the terms of a function below which its sign is round-off.
const BISECTIONS: usize = 100;
const NO_SIGN: f64 = 1e-28;

/// A system of differential equations whose solution can be expanded.
pub trait Expansion {
    /// Puts the coefficients of the solution through `state` at `t` into `coefficients`, by order, then by entry of the state;
    /// that of order 0 is the state.
    fn expand(&mut self, t: DoubleDouble, state: &[DoubleDouble], coefficients: &mut [Vec<DoubleDouble>]);

    /// Tells under which conditions the expansion holds: the coefficients of a function, and whether it is positive.
    fn conditions(&self, told: &mut dyn FnMut(&[DoubleDouble], bool));

    /// Makes a state the next one to expand at, so long after the last: brings it to what it has to meet.
    ///
    /// # Errors
    /// Why that cannot be.
    fn settle(&mut self, t: DoubleDouble, since: DoubleDouble, state: &mut [DoubleDouble]) -> Result<(), String>;

    /// The rates of a state, to be held against those of the series.
    fn rates(&mut self, t: DoubleDouble, state: &[DoubleDouble], rates: &mut [DoubleDouble]);

    /// Which entries of a state are of one kind, and judged by the largest of it: a number for each entry, without gaps.
    fn kinds(&self) -> &[usize];

    /// What one is of each entry, among those of its kind.
    fn units(&self) -> &[f64];

    /// Size below which a kind is judged as if it were of this size, for a solution over so long: what is less may be nothing but
    /// round-off, whose series has no end.
    fn least(&self, kind: usize, duration: f64) -> f64;
}

/// A state that was asked for.
pub struct Sampled<'a> {
    /// Its number.
    pub row: usize,
    /// Its time.
    pub t: DoubleDouble,
    /// The time since the last expansion.
    pub since: DoubleDouble,
    /// The state.
    pub state: &'a [DoubleDouble],
}

/// Why a solution ends early, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended {
    /// The time that was reached.
    pub t: f64,
    /// Why it went no further.
    pub why: String,
}

/// How a system is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taylor {
    /// Terms of the series besides the first, at least 4.
    pub order: usize,
    /// The last two of them are at most this share of the largest of its kind at the end of a step.
    pub tolerance: f64,
    /// The longest step.
    pub longest: f64,
    /// The most steps.
    pub most_steps: usize,
}

impl Taylor {
    /// Solves from a state at time `t` through all of `times`, ascending and not before it, and reports the states there. `go_on` is
    /// asked before each step, and given its time. Gives the number of steps.
    ///
    /// # Errors
    /// Where the solution cannot continue, or is not wanted any more.
    pub fn solve<S: Expansion>(
        &self,
        system: &mut S,
        t: f64,
        mut state: Vec<DoubleDouble>,
        times: &[f64],
        mut told: impl FnMut(&mut S, Sampled<'_>),
        mut go_on: impl FnMut(f64) -> bool,
    ) -> Result<usize, Ended> {
        let duration = times.last().map_or(0.0, |last| last - t);
        let mut t = DoubleDouble::from(t);
        let ended = |t: DoubleDouble, why: &str| Ended { t: t.to_f64(), why: why.into() };
        system.settle(t, ZERO, &mut state).map_err(|why| ended(t, &why))?;
        let mut coefficients = vec![vec![ZERO; state.len()]; self.order + 1];
        let (mut row, mut steps) = (0, 0);
        while row < times.len() {
            if !go_on(t.to_f64()) {
                return Err(ended(t, "interrupted"));
            }
            if steps == self.most_steps {
                return Err(ended(t, "it took too many steps"));
            }
            system.expand(t, &state, &mut coefficients);
            if !coefficients.iter().flatten().all(|c| c.is_finite()) {
                return Err(ended(
                    t,
                    "a value is not finite, as in a position where the equations have no single solution",
                ));
            }
            let h = self.step(system, (t, duration), &coefficients).map_err(|why| ended(t, &why))?;
            while let Some(time) = times.get(row).map(|time| DoubleDouble::from(*time)).filter(|time| *time <= t + h) {
                at(&coefficients, time - t, &mut state);
                told(system, Sampled { row, t: time, since: time - t, state: &state });
                row += 1;
            }
            at(&coefficients, h, &mut state);
            t += h;
            system.settle(t, h, &mut state).map_err(|why| ended(t, &why))?;
            steps += 1;
        }
        Ok(steps)
    }

    /// The size of a step on which the series holds.
    fn step<S: Expansion>(
        &self,
        system: &mut S,
        (t, duration): (DoubleDouble, f64),
        coefficients: &[Vec<DoubleDouble>],
    ) -> Result<DoubleDouble, String> {
        let sizes = sizes(coefficients, system, duration);
        let mut h = self.longest;
        while !sizes.iter().all(|terms| self.is_short_enough(terms, h)) {
            h *= SHORTER;
        }
        let mut end = vec![ZERO; coefficients[0].len()];
        let mut rates = end.clone();
        for _ in 0..MOST_HALVINGS {
            if let Some(change) = first_change(system, h) {
                return Ok(change);
            }
            at(coefficients, DoubleDouble::from(h), &mut end);
            system.rates(t + DoubleDouble::from(h), &end, &mut rates);
            let off =
                end_rates(coefficients, h).zip(&rates).map(|(series, found)| (series - *found).abs().to_f64() * h);
            let size = |kind: &usize| sum_of(&sizes[*kind], h);
            let mut entries = off.zip(system.kinds().iter().zip(system.units()));
            if entries.all(|(off, (kind, unit))| off <= DEFECT * self.tolerance * unit * size(kind)) {
                return Ok(DoubleDouble::from(h));
            }
            // What conditions hold under has to be that of the start again.
            system.rates(t, &coefficients[0], &mut rates);
            h *= 0.5;
        }
        Err("the equations do not hold over any step: a value jumps, or goes to infinity".into())
    }

    /// Whether the last terms of a kind are small enough.
    fn is_short_enough(&self, terms: &[f64], h: f64) -> bool {
        let last = |k: usize| terms[k] * h.powi(k as i32);
        last(self.order).max(last(self.order - 1)) <= self.tolerance * sum_of(&terms[..self.order - 1], h)
    }
}

/// The largest coefficient of each order, by kind, in the units of its entries.
fn sizes<S: Expansion>(coefficients: &[Vec<DoubleDouble>], system: &S, duration: f64) -> Vec<Vec<f64>> {
    let (kinds, units) = (system.kinds(), system.units());
    let mut sizes = vec![vec![0.0_f64; coefficients.len()]; kinds.iter().max().map_or(0, |kind| kind + 1)];
    for (kind, sizes) in sizes.iter_mut().enumerate() {
        sizes[0] = system.least(kind, duration);
    }
    for (order, list) in coefficients.iter().enumerate() {
        for (value, (kind, unit)) in list.iter().zip(kinds.iter().zip(units)) {
            let size = &mut sizes[*kind][order];
            *size = size.max(value.to_f64().abs() / unit);
        }
    }
    sizes
}

fn sum_of(terms: &[f64], h: f64) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * h + term)
}

/// The sum of a series.
fn sum(function: &[DoubleDouble], h: DoubleDouble) -> DoubleDouble {
    function.iter().rev().fold(ZERO, |sum, c| sum * h + *c)
}

/// The state after some time.
fn at(coefficients: &[Vec<DoubleDouble>], h: DoubleDouble, state: &mut [DoubleDouble]) {
    for (entry, value) in state.iter_mut().enumerate() {
        *value = coefficients.iter().rev().fold(ZERO, |sum, list| sum * h + list[entry]);
    }
}

/// The rates of the series after some time.
fn end_rates(coefficients: &[Vec<DoubleDouble>], h: f64) -> impl Iterator<Item = DoubleDouble> {
    let h = DoubleDouble::from(h);
    let rate = move |entry: usize| {
        let terms = coefficients.iter().enumerate().skip(1).rev();
        terms.fold(ZERO, |sum, (k, list)| sum * h + DoubleDouble::from(k as f64) * list[entry])
    };
    (0..coefficients[0].len()).map(rate)
}

/// Just behind the first place up to `h` where a condition changes, if one does.
fn first_change<S: Expansion>(system: &S, h: f64) -> Option<DoubleDouble> {
    let mut first: Option<DoubleDouble> = None;
    system.conditions(&mut |function, positive| {
        let changed = |t: DoubleDouble| {
            let value = sum(function, t);
            let terms = function.iter().rev().fold(0.0, |sum, c| sum * t.to_f64() + c.to_f64().abs());
            value.abs().to_f64() > NO_SIGN * terms && (value > ZERO) != positive
        };
        let end = first.unwrap_or(DoubleDouble::from(h));
        let look = |k: usize| end * DoubleDouble::from(k as f64 / LOOKS as f64);
        if let Some(k) = (1..=LOOKS).find(|k| changed(look(*k))) {
            let (mut before, mut behind) = (look(k - 1), look(k));
            for _ in 0..BISECTIONS {
                let middle = (before + behind) * DoubleDouble::from(0.5);
                if changed(middle) { behind = middle } else { before = middle }
            }
            first = Some(behind);
        }
    });
    first
}
