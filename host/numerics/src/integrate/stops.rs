//! [`Stops`]: quantities that must not become negative. The integration ends where one does, so that whoever asked for it can
//! change the state or the equations there (a contact that closes or opens) and integrate on.
//!
//! Unlike a switch (`events.rs`), a stop may not be passed at all, whether or not error control notices anything: the
//! equations are smooth across it. So it is located on the interpolation of the step, and the step is made again to end there,
//! until it does; its state has the accuracy of the method.

use super::events::Again;
use super::interpolation::Interpolation;
use super::run::{Run, Trouble};

/// Values below this are zero.
const ZERO: f64 = 1e-13;
/// Accuracy of the location on an interpolation, as a share of the step.
const FINE: f64 = 1e-14;
/// Looks at the quantities for one location.
const MOST_LOOKS: usize = 80;
/// Times that a step is made again for one stop.
const MOST_TRIES: u32 = 8;
/// Where a step is looked at, besides its start, as shares of it.
const PLACES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// What is to become of a step.
pub(super) enum Verdict {
    /// Nothing stops within it.
    Pass,
    /// It has to end earlier.
    Again(Again),
    /// The integration ends with it.
    End,
    /// The integration ends before it.
    Before,
}

/// See the module documentation.
pub(super) struct Stops {
    first: Vec<f64>,
    values: Vec<f64>,
    /// Below what each of them stops: zero as soon as it was positive; until then, less than it was at the start.
    least: Vec<f64>,
    /// The same at the start of the step: steps that are made again have not happened.
    least_at_start: Vec<f64>,
    /// Which of them were positive in an earlier step.
    were_positive: Vec<bool>,
    /// Values at the start of the step, known at this time.
    known_at: Option<f64>,
    state: Vec<f64>,
    /// Times that a step to the same stop was made again.
    tries: u32,
}

impl Stops {
    pub(super) fn new(run: &Run<'_>) -> Self {
        let count = run.system.stops();
        let dim = if count > 0 { run.system.dim() } else { 0 };
        Self {
            first: vec![0.0; count],
            least: vec![f64::NEG_INFINITY; count],
            least_at_start: vec![f64::NEG_INFINITY; count],
            were_positive: vec![false; count],
            values: vec![0.0; count],
            known_at: None,
            state: vec![0.0; dim],
            tries: 0,
        }
    }

    /// Whether there are any.
    pub(super) fn is_needed(&self) -> bool {
        !self.values.is_empty()
    }

    /// Judges a step that error control has accepted, from the state `y`.
    pub(super) fn examine(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        step: &Interpolation<'_>,
    ) -> Result<Verdict, Trouble> {
        self.least.copy_from_slice(&self.least_at_start);
        if self.known_at != Some(step.start) {
            self.state.copy_from_slice(y);
            self.look(run, step.start)?;
            if self.least.contains(&f64::NEG_INFINITY) {
                self.least.iter_mut().zip(&self.values).for_each(|(least, value)| *least = value.min(0.0) - ZERO);
                self.note_positive();
            }
            self.first.copy_from_slice(&self.values);
            self.least_at_start.copy_from_slice(&self.least);
            self.known_at = Some(step.start);
            if self.is_beyond() {
                return Ok(Verdict::Before);
            }
        }
        // What came down to zero in an earlier step stops at its end.
        let reached = self.first.iter().zip(&self.were_positive).map(|(first, was)| *was && *first <= ZERO);
        let reached: Vec<bool> = reached.collect();
        let mut from = (0.0, self.first.clone());
        for place in PLACES {
            (step.at)(place, &mut self.state);
            self.look(run, step.start + place * step.h)?;
            if !self.is_beyond() {
                self.note_positive();
                from = (place, self.values.clone());
                continue;
            }
            let falls = |k: usize| reached[k] && self.values[k] < self.least[k];
            if (0..reached.len()).any(falls) {
                return Ok(Verdict::Before);
            }
            let share = self.locate(run, step, from, (place, self.values.clone()))?;
            if share * step.h <= run.smallest_step() {
                return Ok(Verdict::Before);
            }
            if place == 1.0 && (1.0 - share) * step.h <= run.smallest_step() || self.tries >= MOST_TRIES {
                return Ok(Verdict::End);
            }
            self.tries += 1;
            run.counters.rejected += 1;
            let end = step.start + share * step.h;
            return Ok(Verdict::Again(Again { h: end - step.start, end_at: Some(end) }));
        }
        // As near as can be known.
        let mut ends = self.values.iter().zip(&self.first);
        if self.tries > 0 && ends.any(|(value, first)| *value <= ZERO && first > value) {
            return Ok(Verdict::End);
        }
        self.tries = 0;
        self.least_at_start.copy_from_slice(&self.least);
        self.were_positive.iter_mut().zip(&self.least).for_each(|(was, least)| *was = *least == 0.0);
        self.first.copy_from_slice(&self.values);
        self.known_at = Some(step.start + step.h);
        Ok(Verdict::Pass)
    }

    /// The step was made final and something else changed since: what is known of its end does not hold.
    pub(super) fn forget(&mut self) {
        self.known_at = None;
    }

    fn is_beyond(&self) -> bool {
        self.values.iter().zip(&self.least).any(|(value, least)| value < least)
    }

    /// The values at a time and [`Stops::state`].
    fn look(&mut self, run: &mut Run<'_>, t: f64) -> Result<(), Trouble> {
        run.stopping(t, &self.state, &mut self.values)
    }

    /// Takes note of what has become positive where nothing stops; not behind a stop, from where places before it are looked at.
    fn note_positive(&mut self) {
        let seen = self.least.iter_mut().zip(&self.values).filter(|(least, value)| least.is_finite() && **value > ZERO);
        seen.for_each(|(least, _)| *least = 0.0);
    }

    /// The share of the step at which the first of them becomes negative, between two at which values are known: regula falsi with
    /// Illinois weights (Dowell & Jarratt 1971) over all of them.
    fn locate(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
        (mut from, mut low): (f64, Vec<f64>),
        (mut to, mut high): (f64, Vec<f64>),
    ) -> Result<f64, Trouble> {
        let width = FINE.max(2.0 * f64::EPSILON * step.start.abs() / step.h);
        let mut moved = 0;
        for _ in 0..MOST_LOOKS {
            if to - from <= width {
                break;
            }
            let negative = (0..high.len()).filter(|k| high[*k] < self.least[*k]);
            let zero = negative.map(|k| low[k].max(0.0) / (low[k].max(0.0) - high[k])).fold(1.0, f64::min);
            let at = from + (to - from) * zero.clamp(1e-3, 1.0 - 1e-3);
            (step.at)(at, &mut self.state);
            self.look(run, step.start + at * step.h)?;
            if self.is_beyond() {
                (to, high) = (at, self.values.clone());
                if moved == 1 {
                    low.iter_mut().for_each(|value| *value *= 0.5);
                }
                moved = 1;
            } else {
                self.note_positive();
                (from, low) = (at, self.values.clone());
                if moved == -1 {
                    high.iter_mut().for_each(|value| *value *= 0.5);
                }
                moved = -1;
            }
        }
        Ok(from)
    }
}
