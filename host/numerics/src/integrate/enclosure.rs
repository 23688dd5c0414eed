//! [`Enclosure`]: nothing is stepped over.
//!
//! A method evaluates its equations at a few places of a step, and error control judges by these. What happens between them is
//! enclosed here: of every condition at which the equations switch, every function of time, every function of the motion that
//! may be sharp and every counted angle ([`Guard`]), the range over the step is computed by interval arithmetic from the ranges
//! of the step's interpolation. Where it is too wide to decide, the step is halved, and so on, until it is proved that nothing
//! was missed, or the place is found:
//!
//! - a condition that changes its sign and changes it back within the step: the step is made to end at the first change;
//! - a function that leaves what the method saw of it: the step is made to end before, and the next ones are short;
//! - a quantity that leaves its bounds: the step is made to end there;
//! - an angle that goes beyond half a turn from its reference: the step is made shorter.
//!
//! A condition that stays zero without being enforced (of a second contact where one is closed) cannot be decided, and is left as it
//! is wherever it is zero at some places in a row.
//!
//! Functions of time alone are known before the step is made. It ends at knots of tables, and just before expressions jump.
//!
//! The plain twin looks at many places of a step instead ([`System::look`]); it serves where ranges cannot be had.

mod of_time;

use std::f64::consts::PI;

pub(super) use of_time::Jump;

use super::interpolation::Interpolation;
use super::run::{Run, Trouble};
use super::{Guard, GuardSet, Watched};
use crate::interval::{Bernstein, Interval, Range};

/// How far a function may go beyond what a method has seen of it in the step, as a share of what it has seen.
const BEYOND: f64 = 0.25;
/// The same as a share of the largest value that was seen of it in the run: less is no part of the motion.
const NEGLIGIBLE: f64 = 1e-9;
/// How far a counted angle may go from its reference, rad: half a turn less a margin.
const MOST_TURNED: f64 = 2.8;
/// How far counted angles may turn in a step that is not looked at closely, rad, where they have gone [`USED_UP`] from their references;
/// otherwise the same share of what is left to half a turn.
const LITTLE_TURN: f64 = 1.5;
/// The farthest that a counted angle is from its reference when a step begins, rad.
const USED_UP: f64 = 1.0;
/// Halvings of a step.
const DEEPEST: u32 = 24;
/// Halvings after which a condition that is on neither side at the ends of a piece is taken to rest there.
const RESTS: u32 = 3;
/// Pieces of a step that are looked at.
const MOST_PIECES: usize = 300;
/// How much more a quantity may change in the worst direction than in the one that the twin tries.
const MANY_DIRECTIONS: f64 = 4.0;
/// Places of a step that the twin looks at.
const PLACES: usize = 32;
/// Steps below this share of the interval of integration are not made shorter for what is enclosed.
const SHORTEST: f64 = 1e-12;
/// Values of a condition below this share of its largest so far are on neither side.
const NOISE: f64 = 1e-14;

/// What was found in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found {
    /// Conditions change for the first time between these shares of the step, and change again later.
    Hidden(f64, f64),
    /// Conditions change between these shares of the step, which the signs at its ends do not show: it starts just beyond a switch, or
    /// ends nearly back.
    Changed(f64, f64),
    /// A function is sharp from this share of the step on, or a quantity leaves its bounds there.
    Sharp(f64),
    /// An angle goes too far.
    Turned,
}

/// A piece of a step that is still to be judged.
struct Piece {
    from: f64,
    to: f64,
    depth: u32,
    polynomials: Bernstein,
    /// The guards that are not decided yet.
    open: Vec<bool>,
}

/// By how much each quantity changes where the state is off by what its tolerance allows, at both ends of a piece: less cannot be judged.
#[derive(Debug)]
struct Noise {
    first: Vec<f64>,
    last: Vec<f64>,
    /// At which shares of the step.
    known: [Option<f64>; 2],
}

impl Noise {
    /// Nothing is noise until it is looked for.
    fn forget(&mut self) {
        self.first.fill(0.0);
        self.last.fill(0.0);
        self.known = [None; 2];
    }
}

/// What is known of a condition, from the start of the step on.
#[derive(Debug, Clone, Copy, Default)]
struct Side {
    /// Its value at the start, and whether it is on one side there.
    start: f64,
    begins: bool,
    /// Whether it is negative, and the share of the step, where it was on one side last.
    last: Option<(bool, f64)>,
    /// Its first change: the places on both sides of it.
    change: Option<(f64, f64)>,
}

/// See the module documentation.
#[derive(Debug)]
pub(super) struct Enclosure {
    of: Watched,
    within: Vec<Guard>,
    of_time: Vec<Guard>,
    entries: Vec<usize>,
    can_enclose: bool,
    /// Largest magnitudes of the guarded quantities that were seen.
    sizes: Vec<f64>,
    sizes_of_time: Vec<f64>,
    ranges: Vec<Range>,
    /// Values at the ends of a piece.
    first: Vec<f64>,
    last: Vec<f64>,
    /// What was seen of functions.
    hulls: Vec<Interval>,
    noise: Noise,
    along_noise: Vec<Range>,
    sides: Vec<Side>,
    state: Vec<f64>,
}

impl Enclosure {
    /// For the guards of a set, which depend on the state, and of those that depend on time alone.
    pub(super) fn new(of: Watched, set: GuardSet, of_time: Vec<Guard>, dim: usize) -> Self {
        let GuardSet { guards, entries, proved } = set;
        let n = guards.len();
        let all = n.max(of_time.len());
        Self {
            of,
            sizes: vec![0.0; n],
            sizes_of_time: vec![0.0; of_time.len()],
            ranges: vec![Range::UNKNOWN; all],
            first: vec![0.0; n],
            last: vec![0.0; n],
            hulls: vec![Interval::ZERO; all],
            noise: Noise { first: vec![0.0; n], last: vec![0.0; n], known: [None; 2] },
            along_noise: vec![Range::UNKNOWN; n],
            sides: vec![Side::default(); n],
            state: vec![0.0; if n > 0 { dim } else { 0 }],
            can_enclose: proved,
            within: guards,
            of_time,
            entries,
        }
    }

    /// Whether steps have to be looked at, so that their interpolation is needed.
    pub(super) fn is_needed(&self) -> bool {
        !self.within.is_empty()
    }

    /// Steps this short are left as they are.
    fn shortest(run: &Run<'_>) -> f64 {
        (SHORTEST * (run.span.t_end - run.span.t_start)).max(4.0 * run.smallest_step())
    }

    /// What a step stepped over, if anything.
    pub(super) fn examine(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> Result<Option<Found>, Trouble> {
        if self.within.is_empty() {
            return Ok(None);
        }
        if self.of == Watched::Turns && self.turns_little(run, step) {
            return Ok(None);
        }
        run.counters.enclosed += 1;
        if !self.can_enclose {
            return self.look(run, step);
        }
        let mut whole = Bernstein::default();
        let (state, entries) = (&mut self.state, &self.entries);
        whole.interpolate(step.degree, entries.len(), |share, values| {
            (step.at)(share, state);
            values.iter_mut().zip(entries).for_each(|(value, entry)| *value = state[*entry]);
        });
        let mut pieces =
            vec![Piece { from: 0.0, to: 1.0, depth: 0, polynomials: whole, open: vec![true; self.within.len()] }];
        self.noise.forget();
        let mut seen = false;
        let mut count = 0;
        self.point(run, step, &pieces[0].polynomials, 0.0, false);
        self.begin();
        while let Some(mut piece) = pieces.pop() {
            count += 1;
            self.point(run, step, &piece.polynomials, piece.to, true);
            self.enclose(run, step, &piece);
            if seen {
                self.find_noise(run, step, &piece);
            }
            if let Some(found) = self.decide_what_is_clear(&mut piece, seen) {
                return Ok(self.settled(run, step, found));
            }
            if self.has(&piece, |guard| matches!(guard, Guard::Switch | Guard::Feature)) {
                // Only now is it worth while to know what was seen, and what is noise.
                if !seen && self.has(&piece, |guard| matches!(guard, Guard::Feature)) {
                    self.see(run, step);
                }
                seen = true;
                self.find_noise(run, step, &piece);
            }
            if let Some(found) = self.judge(&mut piece) {
                return Ok(self.settled(run, step, found));
            }
            if !piece.open.contains(&true) {
                self.pass();
            } else if piece.depth < DEEPEST && count < MOST_PIECES {
                let mut left = Bernstein::default();
                piece.polynomials.halve(&mut left);
                let middle = 0.5 * (piece.from + piece.to);
                let depth = piece.depth + 1;
                let left = Piece { from: piece.from, to: middle, depth, polynomials: left, open: piece.open.clone() };
                pieces.push(Piece { from: middle, depth, ..piece });
                pieces.push(left);
            } else {
                run.counters.unproven += 1;
                // As the ends of the piece have it.
                let found = (0..piece.open.len()).filter(|k| piece.open[*k]).find_map(|k| match self.within[k] {
                    Guard::Turn => Some(Found::Turned),
                    _ => self.note_ends(k, &piece),
                });
                if let Some(found) = found {
                    return Ok(self.settled(run, step, found));
                }
                self.pass();
            }
        }
        Ok(self.unseen_change(&self.first))
    }

    /// The end of a piece is the start of the next.
    fn pass(&mut self) {
        std::mem::swap(&mut self.first, &mut self.last);
        std::mem::swap(&mut self.noise.first, &mut self.noise.last);
        self.noise.known.swap(0, 1);
    }

    /// Whether no angle can get near half a turn from its reference.
    fn turns_little(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> bool {
        let mut fastest = 0.0_f64;
        for share in [1.0, 0.5, 0.0] {
            (step.at)(share, &mut self.state);
            fastest = fastest.max(run.system.turning(&self.state));
        }
        let share = step.h * fastest / LITTLE_TURN;
        let may_go = |used_up: f64| share * (PI - USED_UP) <= PI - used_up;
        may_go(USED_UP) || self.can_enclose && may_go(0.0) && may_go(self.used_up(run, step))
    }

    /// The farthest that a counted angle is from its reference at the start of a step, whose state is at hand; infinite where one is
    /// not known.
    fn used_up(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> f64 {
        let of = |k: usize| self.state[self.entries[k]];
        run.system.values(self.of, step.start, &of, &mut self.first);
        let farthest = |most: f64, angle: &f64| if angle.is_nan() { f64::INFINITY } else { most.max(angle.abs()) };
        self.first.iter().fold(0.0, farthest)
    }

    /// A finding, unless the step is as short as can be.
    fn settled(&self, run: &Run<'_>, step: &Interpolation<'_>, found: Found) -> Option<Found> {
        let is_short = step.h <= Self::shortest(run);
        Some(found).filter(|found| !is_short || matches!(found, Found::Hidden(..) | Found::Changed(..)))
    }

    /// Whether one of the guards that are still open is of a kind.
    fn has(&self, piece: &Piece, kind: impl Fn(&Guard) -> bool) -> bool {
        self.within.iter().zip(&piece.open).any(|(guard, open)| *open && kind(guard))
    }

    /// The ranges of the guards that are still open, over a piece.
    fn enclose(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>, piece: &Piece) {
        let t = Range::even(step.time(piece.from), step.time(piece.to));
        let of = |k: usize| {
            let of = &piece.polynomials;
            Range::new(of.range(k), of.slope(k), of.middle(k))
        };
        run.system.enclose(self.of, t, &of, &|k| piece.open[k], &mut self.ranges[..self.within.len()]);
    }

    /// The values of all guards at an end of a piece, at this share of the step.
    fn point(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>, polynomials: &Bernstein, share: f64, last: bool) {
        let of = |k: usize| polynomials.end(k, last);
        let values = if last { &mut self.last } else { &mut self.first };
        run.system.values(self.of, step.time(share), &of, values);
        for (value, size) in values.iter().zip(&mut self.sizes) {
            if value.is_finite() {
                *size = size.max(value.abs());
            }
        }
    }

    /// [`Noise`] at both ends of a piece: to first order, the slopes along all differences of the state that its tolerance allows.
    fn find_noise(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>, piece: &Piece) {
        let off: Vec<f64> = self.entries.iter().map(|entry| run.system.resolution(*entry)).collect();
        for (end, share) in [piece.from, piece.to].into_iter().enumerate() {
            if self.noise.known[end].replace(share) == Some(share) {
                continue;
            }
            let state = |k: usize| piece.polynomials.end(k, end == 1);
            let of = |k: usize| Range { slope: Interval::new(-off[k], off[k]), ..Range::still(state(k)) };
            let t = Range::still(step.time(share));
            run.system.enclose(self.of, t, &of, &|k| piece.open[k], &mut self.along_noise);
            let found = if end == 0 { &mut self.noise.first } else { &mut self.noise.last };
            for (noise, range) in found.iter_mut().zip(&self.along_noise) {
                let size = range.slope.magnitude();
                *noise = if size.is_finite() { size } else { 0.0 };
            }
        }
    }

    /// The smallest difference of a quantity that means anything.
    fn least(&self, k: usize) -> f64 {
        (NEGLIGIBLE * self.sizes[k]).max(self.noise.first[k]).max(self.noise.last[k])
    }

    /// The same for a condition, whose value is near zero where it matters, at the start and at the end of a piece.
    fn least_sides(&self, k: usize) -> [f64; 2] {
        [&self.noise.first, &self.noise.last].map(|noise| (NOISE * self.sizes[k]).max(noise[k]))
    }

    /// What the method saw of functions.
    fn see(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) {
        let mut values = vec![0.0; self.within.len()];
        for (number, share) in step.seen.iter().enumerate() {
            (step.felt)(number, &mut self.state);
            let (state, entries) = (&self.state, &self.entries);
            let of = |k: usize| state[entries[k]];
            run.system.values(self.of, step.time(*share), &of, &mut values);
            for (hull, value) in self.hulls.iter_mut().zip(&values) {
                let value = Interval::point(*value);
                *hull = if number == 0 { value } else { hull.hull(value) };
            }
        }
    }

    /// The range of a guard over a piece, from the values at its ends too, where they are known.
    fn range_of(&self, k: usize) -> (Interval, bool) {
        let (range, first, last) = (self.ranges[k], self.first[k], self.last[k]);
        let known = first.is_finite() && last.is_finite();
        (if known { range.between(first, last) } else { range.value }, known)
    }

    /// Decides what needs no knowledge of noise: most guards over most steps.
    fn decide_what_is_clear(&mut self, piece: &mut Piece, seen: bool) -> Option<Found> {
        for k in 0..self.within.len() {
            if !piece.open[k] {
                continue;
            }
            let (value, known) = self.range_of(k);
            let is_clear = match self.within[k] {
                Guard::Switch => value.low >= 0.0 || value.high < 0.0,
                Guard::Feature => {
                    is_seen(value, self.ranges[k], self.hulls[k], NEGLIGIBLE * self.sizes[k], seen, known)
                }
                _ => false,
            };
            piece.open[k] = !is_clear;
            let found = if is_clear { self.note_ends(k, piece) } else { None };
            if found.is_some() {
                return found;
            }
        }
        None
    }

    /// Decides what the ranges over a piece, and the values at its ends, allow to decide.
    fn judge(&mut self, piece: &mut Piece) -> Option<Found> {
        for k in 0..self.within.len() {
            if !piece.open[k] {
                continue;
            }
            let range = self.ranges[k];
            let (first, last) = (self.first[k], self.last[k]);
            let (value, known) = self.range_of(k);
            match self.within[k] {
                Guard::Switch => {
                    let sides = self.least_sides(k);
                    let noise = sides[0].min(sides[1]);
                    let rests = piece.depth >= RESTS && first.abs() <= sides[0] && last.abs() <= sides[1];
                    if value.low >= -noise || value.high < noise || (known && range.is_monotone()) || rests {
                        piece.open[k] = false;
                        let found = self.note_ends(k, piece);
                        if found.is_some() {
                            return found;
                        }
                    }
                }
                Guard::Turn => {
                    if first.abs().max(last.abs()) > MOST_TURNED {
                        return Some(Found::Turned);
                    }
                    piece.open[k] = value.magnitude() > MOST_TURNED;
                }
                Guard::Feature => {
                    let least = self.least(k);
                    if leaves(last, self.hulls[k], least) {
                        return Some(Found::Sharp(piece.from));
                    }
                    piece.open[k] = !is_seen(value, range, self.hulls[k], least, true, known);
                }
                Guard::Bound(limit) => {
                    if last.abs() > limit {
                        return Some(Found::Sharp(piece.to));
                    }
                    piece.open[k] = value.magnitude() > limit;
                }
                Guard::Knots(_) => piece.open[k] = false,
            }
        }
        None
    }

    /// Begins to follow the conditions, whose values at the start of the step are at hand.
    fn begin(&mut self) {
        let sides = self.sides.iter_mut().zip(&self.first);
        sides.for_each(|(side, start)| *side = Side { start: *start, ..Side::default() });
    }

    /// Notes a condition at both ends of a piece.
    fn note_ends(&mut self, k: usize, piece: &Piece) -> Option<Found> {
        let ends = [(piece.from, self.first[k]), (piece.to, self.last[k])];
        let places = ends.into_iter().zip(self.least_sides(k));
        places.fold(None, |found, ((share, value), least)| found.or_else(|| self.note(k, share, value, least)))
    }

    /// Notes the value of a condition at a share of the step, where it is on one side; its second change is a finding.
    fn note(&mut self, k: usize, share: f64, value: f64, least: f64) -> Option<Found> {
        let is_on_one_side = matches!(self.within[k], Guard::Switch) && value.abs() > least;
        if !is_on_one_side {
            return None;
        }
        let side = &mut self.sides[k];
        side.begins |= share == 0.0;
        let before = side.last.replace((value < 0.0, share));
        let (_, from) = before.filter(|(negative, _)| *negative != (value < 0.0))?;
        match side.change {
            None => {
                side.change = Some((from, share));
                None
            }
            Some((from, to)) => Some(Found::Hidden(from, to)),
        }
    }

    /// A single change that a comparison of both ends of the step does not show; `end` are the values there.
    fn unseen_change(&self, end: &[f64]) -> Option<Found> {
        let is_shown = |k: usize, side: &Side| side.begins && (side.start < 0.0) != (end[k] < 0.0);
        let changes = self.sides.iter().enumerate().filter(|(k, side)| !is_shown(*k, side));
        changes.filter_map(|(_, side)| side.change).next().map(|(from, to)| Found::Changed(from, to))
    }

    /// The plain twin: looks at many places of the step.
    fn look(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> Result<Option<Found>, Trouble> {
        let mut shares: Vec<f64> = (0..=PLACES).map(|k| k as f64 / PLACES as f64).collect();
        let places = shares.len();
        shares.extend(step.seen);
        let mut known = Vec::with_capacity(shares.len());
        for (place, share) in shares.iter().enumerate() {
            match place.checked_sub(places) {
                Some(number) => (step.felt)(number, &mut self.state),
                None => (step.at)(*share, &mut self.state),
            }
            let mut values = vec![0.0; self.within.len()];
            if !run.look(self.of, step.time(*share), &self.state, &mut values)? {
                return Ok(None);
            }
            known.push(values);
        }
        for k in 0..self.within.len() {
            let seen = known[places..].iter().map(|values| values[k]);
            self.hulls[k] =
                Interval::new(seen.clone().fold(f64::INFINITY, f64::min), seen.fold(f64::NEG_INFINITY, f64::max));
            self.sizes[k] = known.iter().fold(self.sizes[k], |size, values| size.max(values[k].abs()));
        }
        // States that are off by what the tolerance allows, in some direction.
        (step.at)(1.0, &mut self.state);
        for (k, value) in self.state.iter_mut().enumerate() {
            *value += run.system.resolution(k) * if k % 2 == 0 { 1.0 } else { -1.0 };
        }
        let mut moved = vec![0.0; self.within.len()];
        if run.look(self.of, step.end, &self.state, &mut moved)? {
            let pairs = moved.iter().zip(&known[places - 1]);
            self.noise.first.iter_mut().zip(pairs).for_each(|(noise, (a, b))| *noise = MANY_DIRECTIONS * (a - b).abs());
            self.noise.last.clone_from(&self.noise.first);
        }
        self.first.copy_from_slice(&known[0]);
        self.begin();
        for place in 0..places {
            let (before, share) = (shares[place.saturating_sub(1)], shares[place]);
            let values = &known[place];
            let beyond = |k: usize| match self.within[k] {
                Guard::Feature => leaves(values[k], self.hulls[k], self.least(k)).then_some(Found::Sharp(before)),
                Guard::Bound(limit) => (values[k].abs() > limit).then_some(Found::Sharp(share)),
                Guard::Turn => (values[k].abs() > MOST_TURNED).then_some(Found::Turned),
                _ => None,
            };
            let found = (0..self.within.len()).filter(|_| place > 0).find_map(beyond);
            let found = found.or_else(|| {
                (0..self.within.len()).find_map(|k| self.note(k, share, values[k], self.least_sides(k)[0]))
            });
            if let Some(found) = found {
                return Ok(self.settled(run, step, found));
            }
        }
        Ok(self.unseen_change(&known[places - 1]))
    }
}

/// Whether a value lies beyond what was seen of a function.
fn leaves(value: f64, hull: Interval, least: f64) -> bool {
    let margin = BEYOND * hull.width() + least;
    value < hull.low - margin || value > hull.high + margin
}

/// Whether the values of a function over a piece of a step are what was seen of it. Where that is not known yet, the piece is the
/// whole step, whose ends are seen.
fn is_seen(value: Interval, range: Range, hull: Interval, least: f64, seen: bool, known: bool) -> bool {
    if !seen {
        return value.width() <= least || (known && range.is_monotone());
    }
    !leaves(value.low, hull, least) && !leaves(value.high, hull, least)
}
