//! On which side of each condition a state is, as far as round-off tells, and where in a step one changes.
//!
//! A condition may be nothing but round-off: the speed at which the ends of a damper of constant length move apart. Its sign says
//! nothing then. How much of a value is round-off depends on all it is computed from, and on how; so it is measured, where a sign
//! has changed: values at places of the step so close together that what is smooth leaves no fifth difference, and so far apart
//! that all is rounded anew (More & Wild, "Estimating computational noise", SIAM J. Sci. Comput. 33, 2011). In short steps, and from
//! rest, states so close together are the same; so the last digit of every entry is set anew as well.

use std::f64::consts::SQRT_2;

use super::{Events, NOISE};
use crate::integrate::run::{Run, Trouble};

/// Looks at the conditions for one location.
const MOST_LOOKS: usize = 60;
/// Distance of the places at which round-off is measured, as a share of the step.
const NEAR: f64 = 1e-5;
/// Coefficients of a fifth difference.
const FIFTH: [f64; 6] = [1.0, -5.0, 10.0, -10.0, 5.0, -1.0];
/// Round-off that a value may have by the fifth difference, whose mean square is 252 times its own.
const MARGIN: f64 = 2.0;
/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_8;
/// What is left of an earlier measurement at the next one: differences of round-off may be small by chance.
const FADING: f64 = 0.5;

impl Events {
    /// The same as [`Events::changed`], where round-off is measured first if there seems to be a change: on the step of size `h`
    /// from the time `start`, at its share `from` and beyond, or before it with `by` negative.
    pub(super) fn surely_changed(
        &mut self,
        run: &mut Run<'_>,
        (start, h): (f64, f64),
        (from, by): (f64, f64),
        interpolate: impl Fn(f64, &mut [f64]),
    ) -> Result<bool, Trouble> {
        if !self.changed(&self.high) {
            return Ok(false);
        }
        self.differences.fill(0.0);
        for (number, coefficient) in FIFTH.iter().enumerate() {
            let share = from + by * NEAR * number as f64;
            interpolate(share, &mut self.state);
            round_anew(&mut self.state, number);
            if !run.switching(start + share * h, &self.state, &mut self.values)? {
                return Ok(true);
            }
            self.differences.iter_mut().zip(&self.values).for_each(|(sum, value)| *sum += coefficient * value);
        }
        for k in 0..self.noise.len() {
            if self.differs(k, &self.high) {
                self.noise[k] = (MARGIN * self.differences[k].abs()).max(FADING * self.noise[k]);
            }
        }
        Ok(self.changed(&self.high))
    }

    /// Shrinks an interval of shares of a step, at whose ends the conditions are `low` (as before) and `high` (changed), to
    /// the first of the changes: regula falsi with Illinois weights (Dowell & Jarratt 1971) over all conditions.
    pub(super) fn locate(
        &mut self,
        run: &mut Run<'_>,
        (start, h): (f64, f64),
        (mut from, mut to): (f64, f64),
        width: f64,
        interpolate: impl Fn(f64, &mut [f64]),
    ) -> Result<Option<(f64, f64)>, Trouble> {
        let mut moved = 0;
        for _ in 0..MOST_LOOKS {
            if to - from <= width {
                break;
            }
            let at = from + (to - from) * self.zero();
            interpolate(at, &mut self.state);
            if !run.switching(start + at * h, &self.state, &mut self.values)? {
                return Ok(None);
            }
            if self.changed(&self.values) {
                to = at;
                self.high.copy_from_slice(&self.values);
                if moved == 1 {
                    self.low.iter_mut().for_each(|value| *value *= 0.5);
                }
                moved = 1;
            } else {
                from = at;
                self.low.copy_from_slice(&self.values);
                if moved == -1 {
                    self.high.iter_mut().for_each(|value| *value *= 0.5);
                }
                moved = -1;
            }
        }
        Ok(Some((from, to)))
    }

    /// Share of the interval at which the first condition changes along straight lines.
    fn zero(&self) -> f64 {
        let changes = (0..self.before.len()).filter(|k| self.differs(*k, &self.high));
        let share = changes.map(|k| self.low[k] / (self.low[k] - self.high[k])).fold(1.0, f64::min);
        share.clamp(1e-3, 1.0 - 1e-3)
    }

    /// Whether a condition is on another side than at the start of the step, where it was on one.
    pub(super) fn differs(&self, k: usize, now: &[f64]) -> bool {
        let sides = [self.before[k], now[k]];
        (sides[0] < 0.0) != (sides[1] < 0.0) && sides.iter().all(|value| self.is_on_one_side(k, *value))
    }

    /// Whether a value of a condition is more than round-off.
    pub(super) fn is_on_one_side(&self, k: usize, value: f64) -> bool {
        value.abs() > self.noise[k].max(NOISE * self.sizes[k])
    }

    /// Whether any condition is.
    pub(super) fn changed(&self, now: &[f64]) -> bool {
        (0..now.len()).any(|k| self.differs(k, now))
    }
}

/// Changes every entry of a state by up to one unit of its last digit, each in another way and for each number in another way: by
/// shares of it that turn by the golden section, so that they have large differences of every order.
fn round_anew(state: &mut [f64], number: usize) {
    for (entry, value) in state.iter_mut().enumerate() {
        let share = (GOLDEN * number as f64 + SQRT_2 * entry as f64).fract();
        *value *= 1.0 + f64::EPSILON * (2.0 * share - 1.0);
    }
}
