//! [`Events`]: steps that end where the right side switches from one expression to another.
//!
//! A step across a switch (a contact, a limit, a friction that changes its sign) has none of its method's order. Error control
//! notices, and gets across with many small steps. Here, where a step is rejected and conditions differ at its ends
//! (Hairer, Norsett & Wanner, "Solving Ordinary Differential Equations I", 2nd ed. 1993, section II.6; Shampine & Thompson,
//! "Event location for ordinary differential equations", 2000):
//!
//! 1. the switch is located roughly, on the parabola through the start, its derivative and the end of the rejected step, and
//!    the step is tried again so that it ends somewhat short of it;
//! 2. no stage of that step has seen the other side, so that its interpolation, continued a little, shows exactly where the
//!    switch is, and the state there;
//! 3. this state, projected, becomes an accepted one, just beyond the switch, and the method starts anew from it; unless
//!    something stops ([`super::stops`]) before the switch.
//!
//! Conditions are looked at at both ends of every step, accepted ones as well: stages may lie on one side, and an error estimate
//! across a switch is small by chance (with DOP853 in a third of the runs of stops with random masses, which were off by 9 to 94
//! tolerances then). They are looked at within a step where one may change there and back ([`super::enclosure`]), and where a step
//! begins just beyond a switch, so that its start tells of no side: where the condition is first counts then. A wrong guess
//! costs a few steps. A jump of the right side at a tolerance of 1e-10 takes some 40 evaluations of the explicit method of order 8
//! this way, instead of 500, and the result is more accurate (`tests/events.rs` of this room).

mod sides;

use super::enclosure::{Enclosure, Found, Jump};
use super::interpolation::Interpolation;
use super::run::{Run, Trouble};
use super::stops::Stops;
use super::{Accepted, Watched};

/// Accuracy of the first location, as a share of the step.
const ROUGH: f64 = 0.01;
/// Share of the way to the switch, as located first, that is left.
const SHORT: f64 = 0.05;
/// Values of a condition below this share of its largest so far are on neither side: a state that rests on a limit.
const NOISE: f64 = 1e-14;
/// How far beyond a step its interpolation is looked at, as a share of the step.
const AHEAD: f64 = 0.5;
/// Accuracy of the last location, as a share of the step.
const FINE: f64 = 1e-13;
/// Steps towards one switch.
const MOST_TRIES: u32 = 8;
/// Share of the way left per share of a step that the interpolation was continued by.
const DOUBT: f64 = 0.05;
/// Attempts to get to the other side of a switch after projection, each twice as far as the one before.
const MOST_NUDGES: i32 = 30;
/// Share of a step that is tried again where a function is sharp right at its start.
const SHARP_START: f64 = 0.1;
/// Where conditions go away from zero between switches by more than this share of their largest values, time passes from one to the
/// next.
const AWAY: f64 = 0.02;
/// Switches closer to the last than this share of the longest step so far follow each other closely; where conditions go away, than
/// [`CLOSE_AND_AWAY`].
const CLOSE: f64 = 0.02;
const CLOSE_AND_AWAY: f64 = 1e-5;
/// As many of them one after the other are too many: they are left to error control for the length of the longest step.
const MOST_CLOSE: u32 = 8;

/// A switch that a step is aimed at.
#[derive(Debug, Clone, Copy)]
struct Pending {
    /// Size of the step that was tried first: to continue with.
    resume: f64,
    /// By this time conditions have changed.
    until: f64,
    tries: u32,
}

/// What to do after a step towards a switch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Next {
    /// Nothing in particular.
    Plain,
    /// The next step ends at this time.
    EndAt(f64),
    /// Functions of time made the step shorter than this size, which the next one may have.
    Resumed(f64),
    /// The step ended before a place in time where functions of time are not smooth, and the run is beyond it now: rates have to
    /// be evaluated, and the next step may have this size.
    Jumped(f64),
    /// The step itself went across and was accurate enough; the next step may have this size.
    Passed(f64),
    /// The run is just beyond the switch now, by a further step: rates have to be evaluated, and the next step may have this
    /// size.
    Crossed(f64),
}

/// See the module documentation.
#[derive(Debug)]
pub(super) struct Events {
    /// Share of a step by which its interpolation may be continued to find the state at a switch.
    reach: f64,
    pending: Option<Pending>,
    /// Values of the conditions at the start of the step; known at this time.
    before: Vec<f64>,
    known_at: Option<f64>,
    /// Largest magnitudes so far, of accepted states; and since the last switch.
    sizes: Vec<f64>,
    swings: Vec<f64>,
    /// Their round-off, as measured where they seemed to change.
    noise: Vec<f64>,
    differences: Vec<f64>,
    /// Values at the ends of the interval in which a switch is known to be.
    low: Vec<f64>,
    high: Vec<f64>,
    values: Vec<f64>,
    state: Vec<f64>,
    scratch: Vec<f64>,
    /// Time of the last switch, and how many followed each other closely.
    last: Option<f64>,
    close: u32,
    blind_until: f64,
    enclosure: Enclosure,
    turns: Enclosure,
    /// The jump in time before which the step under way ends.
    jump: Option<Jump>,
    /// Size of the step that was wanted, where functions of time made it shorter.
    wanted: Option<f64>,
}

/// How a step is to be tried again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Again {
    /// Its size.
    pub(super) h: f64,
    /// Where it had better end.
    pub(super) end_at: Option<f64>,
}

impl Events {
    /// For a method whose interpolation may be continued by the share `reach` of a step.
    pub(super) fn new(run: &Run<'_>, reach: f64) -> Self {
        let conditions = run.system.conditions();
        let guards = run.system.guards();
        let whole = run.system.dim();
        let dim = if conditions > 0 { whole } else { 0 };
        Self {
            enclosure: Enclosure::new(Watched::Within, guards.within, guards.of_time, whole),
            turns: Enclosure::new(Watched::Turns, guards.turns, Vec::new(), whole),
            reach,
            pending: None,
            before: vec![0.0; conditions],
            known_at: None,
            sizes: vec![0.0; conditions],
            swings: vec![0.0; conditions],
            noise: vec![0.0; conditions],
            differences: vec![0.0; conditions],
            low: vec![0.0; conditions],
            high: vec![0.0; conditions],
            values: vec![0.0; conditions],
            state: vec![0.0; dim],
            scratch: vec![0.0; dim],
            last: None,
            close: 0,
            blind_until: f64::NEG_INFINITY,
            jump: None,
            wanted: None,
        }
    }

    /// Whether the interpolation of every step is needed.
    pub(super) fn watches_steps(&self) -> bool {
        self.enclosure.is_needed()
    }

    /// Whether steps are looked at at all, by whatever interpolation there is.
    pub(super) fn watches_anything(&self) -> bool {
        self.enclosure.is_needed() || self.turns.is_needed()
    }

    /// The end of a step that would end at `t_new`, as functions of time have it. `seen` are the shares of a step at which the
    /// method evaluates the equations.
    pub(super) fn end_of_step(&mut self, run: &mut Run<'_>, t_new: f64, seen: &[f64]) -> f64 {
        let t_new = run.before_barrier(t_new);
        let (end, jump) = self.enclosure.ahead(run, t_new, seen);
        self.jump = jump;
        self.wanted = (end < t_new).then_some(t_new - run.t);
        end
    }

    /// Whether something happens within a step that error control has accepted and that the method has not seen; then how it is
    /// to be tried again. `y` and `rates` are those at its start.
    pub(super) fn missed(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        step: &Interpolation<'_>,
    ) -> Result<Option<Again>, Trouble> {
        let found = match self.enclosure.examine(run, step)? {
            None => self.turns.examine(run, step)?,
            found => found,
        };
        let again = match found {
            None => None,
            // Where steps are not to end at switches, at least none is to span two of them.
            Some(Found::Hidden(from, to)) => {
                self.aim_within(run, y, step, (from, to), Some(halfway(step, (from, to))))?
            }
            Some(Found::Changed(from, to)) if self.ends_steps() => self.aim_within(run, y, step, (from, to), None)?,
            Some(Found::Changed(..)) => None,
            Some(Found::Sharp(share)) if share > SHARP_START => {
                Some(Again { h: step.h * share, end_at: Some(step.time(share)) })
            }
            Some(Found::Sharp(_)) => Some(Again { h: SHARP_START * step.h, end_at: None }),
            Some(Found::Turned) => Some(Again { h: 0.5 * step.h, end_at: None }),
        };
        let again = match again {
            None if self.ends_steps() && self.is_across(run, y, step)? => self.aim(run, step, (0.0, 1.0))?,
            again => again,
        };
        let Some(again) = again.filter(|again| again.h > run.smallest_step()) else { return Ok(None) };
        run.counters.rejected += 1;
        run.counters.stepped_over += 1;
        Ok(Some(again))
    }

    /// Whether steps are to end at switches: by what continues them.
    fn ends_steps(&self) -> bool {
        self.reach > 0.0
    }

    /// Whether conditions differ at the ends of a step that error control has accepted. Their values there are [`Events::low`] and
    /// [`Events::high`] then.
    fn is_across(&mut self, run: &mut Run<'_>, y: &[f64], step: &Interpolation<'_>) -> Result<bool, Trouble> {
        if self.before.is_empty() || run.t < self.blind_until || !self.know_start(run, y)? {
            return Ok(false);
        }
        (step.at)(1.0, &mut self.state);
        if !run.switching(step.end, &self.state, &mut self.high)? {
            return Ok(false);
        }
        let sizes = self.sizes.iter_mut().zip(self.before.iter().zip(&self.high));
        sizes.for_each(|(size, (start, end))| *size = size.max(start.abs()).max(end.abs()));
        self.low.copy_from_slice(&self.before);
        self.surely_changed(run, (step.start, step.h), (1.0, -1.0), step.at)
    }

    /// The conditions at the start `y` of the step under way; false where they are not to be had.
    fn know_start(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<bool, Trouble> {
        if self.known_at != Some(run.t) {
            self.known_at = None;
            if !run.switching(run.t, y, &mut self.before)? {
                return Ok(false);
            }
            self.known_at = Some(run.t);
        }
        self.swings.iter_mut().zip(&self.before).for_each(|(swing, value)| *swing = swing.max(value.abs()));
        Ok(true)
    }

    /// Gives up what the next step was aimed at.
    pub(super) fn forget(&mut self) {
        self.pending = None;
    }

    /// After a step of a method that does not end steps at switches: goes beyond a place in time where functions of time are not
    /// smooth, if the step ended there. Gives the size that the next step may have.
    pub(super) fn beyond_break(&mut self, run: &mut Run<'_>) -> Option<f64> {
        let jump = self.jump.take().filter(|jump| jump.before == run.t);
        if let Some(jump) = jump {
            run.t = jump.after;
        }
        self.wanted.take()
    }

    /// Steps of a fixed size cannot be tried again: what they missed is counted.
    pub(super) fn note_missed(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> Result<(), Trouble> {
        let (end, _) = self.enclosure.ahead(run, step.end, step.seen);
        let within = self.enclosure.examine(run, step)?;
        let found = within.or(self.turns.examine(run, step)?);
        // A switch that the step goes across is no more missed than by any other of its size.
        let missed = found.is_some_and(|found| !matches!(found, Found::Changed(..)));
        if missed || end < step.end {
            run.counters.missed += 1;
        }
        Ok(())
    }

    /// Makes the next step end before conditions that change between two shares of this one, which its ends do not show. Without
    /// conditions that do, the next step is to be `otherwise`.
    fn aim_within(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        step: &Interpolation<'_>,
        (mut from, mut to): (f64, f64),
        otherwise: Option<Again>,
    ) -> Result<Option<Again>, Trouble> {
        if self.before.is_empty() || !self.know_start(run, y)? {
            return Ok(otherwise);
        }
        (step.at)(from, &mut self.state);
        let known = run.switching(step.time(from), &self.state, &mut self.low)?;
        (step.at)(to, &mut self.state);
        let known = known && run.switching(step.time(to), &self.state, &mut self.high)?;
        for (size, start) in self.sizes.iter_mut().zip(&self.before) {
            *size = size.max(start.abs());
        }
        if !known {
            return Ok(otherwise);
        }
        self.take_sides_of_low();
        if self.changed(&self.low) {
            self.high.copy_from_slice(&self.low);
            self.low.copy_from_slice(&self.before);
            (from, to) = (0.0, from);
            (step.at)(to, &mut self.state);
        }
        if !self.changed(&self.high) {
            return Ok(otherwise);
        }
        // What changes may be the interpolation alone: between its ends a step may be off its manifold.
        let known = run.switching_inside(step.time(to), &mut self.state, &mut self.high)?;
        if known && !self.surely_changed(run, (step.start, step.h), (to, -1.0), step.at)? {
            return Ok(None);
        }
        self.aim(run, step, (from, to))
    }

    /// Makes the next step end before conditions that change between two shares of this one, where their values are known.
    fn aim(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
        (from, to): (f64, f64),
    ) -> Result<Option<Again>, Trouble> {
        let located = self.locate(run, (step.start, step.h), (from, to), ROUGH * (to - from), step.at)?;
        let Some((_, share)) = located else { return Ok(Some(halfway(step, (from, to)))) };
        let end = step.start + (1.0 - SHORT) * share * step.h;
        if end - step.start < run.smallest_step() {
            return Ok(None);
        }
        self.pending = Some(Pending { resume: step.h, until: step.time(share), tries: 0 });
        Ok(Some(Again { h: step.h, end_at: Some(end) }))
    }

    /// Where the start of a step tells of no side, or barely of one, since it lies just beyond a switch, [`Events::low`] does, up to where
    /// nothing has changed.
    fn take_sides_of_low(&mut self) {
        for k in 0..self.before.len() {
            let (start, low) = (self.before[k], self.low[k]);
            let is_same = (start < 0.0) == (low < 0.0) || !self.is_on_one_side(k, start);
            if is_same && low.abs() > start.abs() {
                self.before[k] = low;
            }
        }
    }

    /// Whether the step under way is aimed at a switch; its interpolation will be needed.
    pub(super) fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// A step from `y`, with these rates, to `t_new` was too inaccurate. Where it had better end if a switch is why.
    pub(super) fn rejected(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        rates: &[f64],
        t_new: f64,
        y_new: &[f64],
    ) -> Result<Option<f64>, Trouble> {
        if self.before.is_empty() || run.t < self.blind_until {
            return Ok(None);
        }
        self.wanted = None;
        let (t, h) = (run.t, t_new - run.t);
        let last = self.pending.take();
        let tries = last.map_or(0, |pending| pending.tries);
        if let Some(pending) = last.filter(|pending| pending.tries >= MOST_TRIES) {
            self.blind_until = pending.until;
            return Ok(None);
        }
        if !self.know_start(run, y)? {
            return Ok(None);
        }
        self.low.copy_from_slice(&self.before);
        if !run.switching(t_new, y_new, &mut self.high)? {
            return Ok(None);
        }
        // The end of a rejected step may be anywhere: it is used for step sizes only while nothing else does.
        for (size, (start, end)) in self.sizes.iter_mut().zip(self.before.iter().zip(&self.high)) {
            *size = size.max(if *start == 0.0 && *size == 0.0 { end.abs() } else { start.abs() });
        }
        let parabola = |s: f64, out: &mut [f64]| {
            for (k, value) in out.iter_mut().enumerate() {
                let straight = h * rates[k];
                *value = y[k] + s * (straight + s * (y_new[k] - y[k] - straight));
            }
        };
        // Where the step led may be so far away that round-off there is more than what is here.
        let tangent = |s: f64, out: &mut [f64]| {
            let states = out.iter_mut().zip(y.iter().zip(rates));
            states.for_each(|(value, (y, rate))| *value = y + s * h * rate);
        };
        if !self.surely_changed(run, (t, h), (0.0, 1.0), tangent)? {
            // The switch is not why: error control chooses the next step.
            return Ok(None);
        }
        let Some((_, share)) = self.locate(run, (t, h), (0.0, 1.0), ROUGH, parabola)? else { return Ok(None) };
        let end = t + (1.0 - SHORT) * share * h;
        if end - t < run.smallest_step() {
            return Ok(None);
        }
        let resume = last.map_or(h, |pending| pending.resume);
        self.pending = Some(Pending { resume, until: t_new, tries: tries + 1 });
        Ok(Some(end))
    }

    /// A step to the state `y` is accepted, and nothing stops within it. Its interpolation is continued beyond its end.
    pub(super) fn accepted(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        stops: &mut Stops,
        step: &Interpolation<'_>,
    ) -> Result<Next, Trouble> {
        let (start, h) = (step.start, step.h);
        let wanted = self.wanted.take();
        if let Some(jump) = self.jump.take().filter(|jump| jump.before == run.t) {
            // The state is the same on both sides.
            run.t = jump.after;
            self.known_at = None;
            self.pending = None;
            return Ok(Next::Jumped(wanted.unwrap_or(jump.after - start)));
        }
        let Some(pending) = self.pending.take() else { return Ok(wanted.map_or(Next::Plain, Next::Resumed)) };
        let t = run.t;
        if !run.switching(t, y, &mut self.low)? {
            return Ok(Next::Plain);
        }
        self.sizes.iter_mut().zip(&self.low).for_each(|(size, value)| *size = size.max(value.abs()));
        if self.changed(&self.low) {
            let went_away = self.went_away(&self.low);
            self.count(run, went_away);
            return Ok(Next::Passed(pending.resume));
        }
        self.take_sides_of_low();
        let furthest = ((pending.until - start) / h).min(1.0 + AHEAD);
        (step.at)(furthest, &mut self.state);
        let known = run.switching(start + furthest * h, &self.state, &mut self.high)?;
        if !known || furthest <= 1.0 || !self.changed(&self.high) {
            return Ok(Next::Plain);
        }
        let width = FINE.max(4.0 * f64::EPSILON * t.abs() / h);
        let located = self.locate(run, (start, h), (1.0, furthest), width, step.at)?;
        let Some((_, share)) = located else { return Ok(Next::Plain) };
        if share - 1.0 <= self.reach {
            let beyond = share - 1.0;
            let at = |part: f64, out: &mut [f64]| (step.at)(1.0 + part * beyond, out);
            let rest = Interpolation { start: t, h: beyond * h, end: t + beyond * h, seen: &[], at: &at, ..*step };
            let stop = stops.ahead(run, &rest)?.filter(|stop| (1.0 - stop) * beyond > width);
            let sooner = match stop {
                // The next step ends between both, so that the stop is found in it.
                Some(stop) => Some(0.5 * (stop + 1.0)),
                None => match self.enclosure.examine(run, &rest)? {
                    Some(Found::Hidden(from, to)) => Some(0.5 * (from + to)),
                    _ => None,
                },
            };
            if let Some(end) = sooner.map(|part| t + part * rest.h).filter(|end| end - t >= run.smallest_step()) {
                return Ok(Next::EndAt(end));
            }
            return self.cross(run, y, step, (share, width), pending);
        }
        if pending.tries >= MOST_TRIES {
            return Ok(Next::Plain);
        }
        // So much nearer that the step after this one may reach it.
        let gap = (share - 1.0) * h;
        let left = (0.5 * self.reach).max(DOUBT * (share - 1.0));
        let end = t + (1.0 - left) * gap;
        if end - t < run.smallest_step() {
            // As near as time can tell: the next step goes across.
            return Ok(Next::Resumed(pending.resume));
        }
        self.pending = Some(Pending { until: t + 1.5 * gap, tries: pending.tries + 1, ..pending });
        Ok(Next::EndAt(end))
    }

    /// Makes the state just beyond a switch, at this share of the last step, an accepted one.
    fn cross(
        &mut self,
        run: &mut Run<'_>,
        y: &mut [f64],
        step: &Interpolation<'_>,
        (share, width): (f64, f64),
        pending: Pending,
    ) -> Result<Next, Trouble> {
        // The projection may move the state back across.
        for nudge in 0..MOST_NUDGES {
            let share = share + width * (f64::from(nudge).exp2() - 1.0);
            let t_new = step.start + share * step.h;
            if share - 1.0 > self.reach || t_new <= run.t || t_new > run.span.t_end {
                break;
            }
            (step.at)(share, &mut self.state);
            match run.project(t_new, &mut self.state, step.h) {
                Ok(()) => {}
                Err(Trouble::Retry(_)) => break,
                Err(trouble) => return Err(trouble),
            }
            if !run.switching(t_new, &self.state, &mut self.values)? {
                break;
            }
            if !self.changed(&self.values) {
                continue;
            }
            let went_away = self.went_away(&self.values);
            y.copy_from_slice(&self.state);
            let accepted =
                run.finish_step(t_new, y, &mut self.scratch, |time, out| (step.at)((time - step.start) / step.h, out))?;
            self.before.copy_from_slice(&self.values);
            self.known_at = (accepted != Accepted::Changed).then_some(t_new);
            self.count(run, went_away);
            return Ok(Next::Crossed(pending.resume));
        }
        Ok(Next::Plain)
    }

    /// Whether a condition that has changed had gone away from zero before, so that time passes from switch to switch: along a table of
    /// many points, say.
    fn went_away(&self, now: &[f64]) -> bool {
        let swing = |k: usize| self.swings[k].max(self.before[k].abs());
        (0..now.len()).any(|k| self.differs(k, now) && swing(k) > AWAY * self.sizes[k])
    }

    /// Notes a switch, and whether they follow each other too closely.
    fn count(&mut self, run: &mut Run<'_>, went_away: bool) {
        run.counters.events += 1;
        let longest = run.counters.h_max;
        let close = if went_away { CLOSE_AND_AWAY } else { CLOSE };
        let near = self.last.is_some_and(|last| run.t - last < close * longest);
        self.last = Some(run.t);
        self.swings.fill(0.0);
        self.close = if near { self.close + 1 } else { 0 };
        if self.close >= MOST_CLOSE {
            self.close = 0;
            self.blind_until = run.t + longest;
            run.counters.chatters += 1;
        }
    }
}

/// A step to the middle between two shares of this one.
fn halfway(step: &Interpolation<'_>, (from, to): (f64, f64)) -> Again {
    let middle = step.start + 0.5 * (from + to) * step.h;
    Again { h: middle - step.start, end_at: Some(middle) }
}
