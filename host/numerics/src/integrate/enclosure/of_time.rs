//! What depends on time alone: known before a step is made, which then ends at knots of tables, before jumps, and before a
//! function gets sharp.

use super::{DEEPEST, Enclosure, MOST_PIECES, NEGLIGIBLE, is_seen, leaves};
use crate::integrate::run::Run;
use crate::integrate::{Guard, Watched};
use crate::interval::{Interval, Range};

/// Share of a step that is left of it where a function is sharp at its very start.
const SHORTER: f64 = 0.25;
/// Changes of a step's end for functions of time.
const MOST_CHANGES: usize = 60;

/// The place in time where functions of time jump: they are what they were up to the first time, and something else from
/// the second, next one on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::integrate) struct Jump {
    pub(in crate::integrate) before: f64,
    pub(in crate::integrate) after: f64,
}

impl Enclosure {
    /// The end of a step that is to go to `t_new`, and the jump behind it, as functions of time have it. `seen` are the shares
    /// of a step at which the method evaluates the equations.
    pub(in crate::integrate) fn ahead(&mut self, run: &mut Run<'_>, t_new: f64, seen: &[f64]) -> (f64, Option<Jump>) {
        if self.of_time.is_empty() || t_new <= run.t {
            return (t_new, None);
        }
        let (mut end, jump) = self.first_break(run, run.t, t_new);
        let shortest = Self::shortest(run);
        for _ in 0..MOST_CHANGES {
            if end - run.t <= shortest {
                break;
            }
            let Some(share) = self.first_sharp(run, run.t, end, seen) else { break };
            let h = end - run.t;
            end = run.t + if share > 0.0 { share * h } else { SHORTER * h };
        }
        (end, jump.filter(|jump| jump.before >= end))
    }

    /// Where a function of time first leaves what a method sees of it.
    fn first_sharp(&mut self, run: &mut Run<'_>, start: f64, end: f64, seen: &[f64]) -> Option<f64> {
        let n = self.of_time.len();
        let h = end - start;
        enclose_time(run, Range::even(start, end), &|_| true, &mut self.ranges[..n]);
        let feature = |guard: &Guard| matches!(guard, Guard::Feature);
        let sound = |k: usize, range: &Range, size: f64| {
            !feature(&self.of_time[k]) || range.is_monotone() || range.value.width() <= NEGLIGIBLE * size
        };
        if (0..n).all(|k| sound(k, &self.ranges[k], self.sizes_of_time[k])) {
            return None;
        }
        let mut lasts = vec![0.0; n];
        for (number, share) in seen.iter().enumerate() {
            // Several stages may be at one time.
            if number > 0 && *share == seen[number - 1] {
                continue;
            }
            values_at_time(run, start + share * h, &mut lasts);
            for ((value, hull), size) in lasts.iter().zip(&mut self.hulls).zip(&mut self.sizes_of_time) {
                let point = Interval::point(*value);
                *hull = if number == 0 { point } else { hull.hull(point) };
                if value.is_finite() {
                    *size = size.max(value.abs());
                }
            }
        }
        let mut pieces = vec![(0.0, 1.0, 0)];
        let mut count = 0;
        let mut firsts = vec![0.0; n];
        values_at_time(run, start, &mut firsts);
        while let Some((from, to, depth)) = pieces.pop() {
            count += 1;
            values_at_time(run, start + to * h, &mut lasts);
            enclose_time(run, Range::even(start + from * h, start + to * h), &|_| true, &mut self.ranges[..n]);
            let mut wide = false;
            for k in (0..n).filter(|k| feature(&self.of_time[*k])) {
                let (first, last) = (firsts[k], lasts[k]);
                if leaves(last, self.hulls[k], NEGLIGIBLE * self.sizes_of_time[k]) {
                    return Some(from);
                }
                let range = self.ranges[k];
                let value =
                    if first.is_finite() && last.is_finite() { range.between(first, last) } else { range.value };
                wide |= !is_seen(value, range, self.hulls[k], NEGLIGIBLE * self.sizes_of_time[k], true, true);
            }
            if wide && depth < DEEPEST && count < MOST_PIECES {
                let middle = 0.5 * (from + to);
                pieces.push((middle, to, depth + 1));
                pieces.push((from, middle, depth + 1));
                continue;
            }
            if wide && depth < DEEPEST {
                run.counters.leave_open([start + from * h, start + to * h]);
            }
            run.counters.unproven += usize::from(wide);
            std::mem::swap(&mut firsts, &mut lasts);
        }
        None
    }

    /// The first knot of a table or change of a condition between two times; without one, the later time.
    fn first_break(&mut self, run: &mut Run<'_>, start: f64, end: f64) -> (f64, Option<Jump>) {
        let n = self.of_time.len();
        if !self.of_time.iter().any(|guard| matches!(guard, Guard::Switch | Guard::Knots(_))) {
            return (end, None);
        }
        let mut values = vec![0.0; n];
        values_at_time(run, start, &mut values);
        let mut bounds: Vec<Option<Interval>> = Vec::with_capacity(n);
        for (k, value) in values.into_iter().enumerate() {
            bounds.push(match &self.of_time[k] {
                _ if !value.is_finite() => None,
                // The side that it is on.
                Guard::Switch if value < 0.0 => Some(Interval::new(f64::NEG_INFINITY, 0.0_f64.next_down())),
                Guard::Switch => Some(Interval::new(0.0, f64::INFINITY)),
                Guard::Knots(knots) => {
                    let (low, high) = knots(value);
                    Some(Interval::new(low, high))
                }
                Guard::Feature | Guard::Turn | Guard::Bound(_) => None,
            });
        }
        if bounds.iter().all(Option::is_none) {
            return (end, None);
        }
        let stays = |ranges: &[Range]| {
            let open = |k: usize| matches!(self.of_time[k], Guard::Knots(_));
            (0..n).all(|k| {
                let Some(bound) = bounds[k] else { return true };
                let value = ranges[k].value;
                value.low >= bound.low && if open(k) { value.high < bound.high } else { value.high <= bound.high }
            })
        };
        let mut ranges = std::mem::take(&mut self.ranges);
        let mut holds = |run: &mut Run<'_>, from: f64, to: f64| {
            let t = if from == to { Range::still(from) } else { Range::even(from, to) };
            enclose_time(run, t, &|k| bounds[k].is_some(), &mut ranges[..n]);
            stays(&ranges[..n])
        };
        // The pieces from the left; the first one that is not proved to stay is halved, down to neighbours.
        let mut pieces = vec![(start, end, 0)];
        let mut found = None;
        let mut count = 0;
        while let Some((from, to, depth)) = pieces.pop() {
            count += 1;
            if holds(run, from, to) {
                continue;
            }
            let middle = 0.5 * (from + to);
            if middle <= from || middle >= to {
                found = Some((from, to));
                break;
            }
            if depth >= DEEPEST || count >= MOST_PIECES {
                if holds(run, to, to) {
                    run.counters.unproven += 1;
                    continue;
                }
                // It has changed by then; the change is found on points.
                let (mut low, mut high) = (from, to);
                loop {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break;
                    }
                    if holds(run, middle, middle) { low = middle } else { high = middle }
                }
                found = Some((low, high));
                break;
            }
            pieces.push((middle, to, depth + 1));
            pieces.push((from, middle, depth + 1));
        }
        self.ranges = ranges;
        match found {
            None => (end, None),
            Some((before, after)) => {
                let jump = Jump { before, after };
                if before - run.t <= run.smallest_step() {
                    return (after.max(run.t + run.smallest_step()).min(end), None);
                }
                (before, Some(jump))
            }
        }
    }
}

/// The ranges of what depends on time alone, as far as they are wanted.
fn enclose_time(run: &mut Run<'_>, t: Range, wanted: &dyn Fn(usize) -> bool, found: &mut [Range]) {
    run.system.enclose(Watched::Time, t, &|_| Range::UNKNOWN, wanted, found);
}

/// Its values at a time.
fn values_at_time(run: &mut Run<'_>, t: f64, found: &mut [f64]) {
    run.system.values(Watched::Time, t, &|_| f64::NAN, found);
}
