//! The loop over steps, the same for all methods that integrate: [`steps_of_one_size`], or [`adaptive_steps`] with error control.
//!
//! A method makes single steps ([`Stepper`]), and says how large the next one may be ([`Adaptive`]). When a step is accepted,
//! where it had better end, what becomes of one that failed, and when the run is given up are decided here.

use super::events::{Again, Events, Next};
use super::interpolation::{Interpolation, hermite};
use super::run::{Run, Trouble};
use super::stops::{Stops, Verdict};
use super::{Accepted, StopReason};

/// Step sizes shrink by this factor when a step fails other than by its error.
pub(super) const RECOVERY_FACTOR: f64 = 0.25;

/// A method, one step at a time: from the accepted state `y` at `run.t` to `t_new`.
pub(super) trait Stepper {
    /// Share of a step by which its interpolation may be continued.
    fn reach(&self) -> f64;

    /// Shares of a step at which the equations are evaluated so that the new state or the error shows it, ascending, both ends
    /// included.
    fn seen(&self) -> &[f64];

    /// The state at which the equations were evaluated at the share `seen()[number]` of the step made last.
    fn felt(&self, number: usize, out: &mut [f64]) {
        self.interpolate(self.seen()[number], out);
    }

    /// Takes the rates at an accepted state that no step of this method has led to.
    fn start(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<(), Trouble>;

    /// Makes a step up to, but not including, what makes it final: the new state, projected, the rates there, and the
    /// interpolation. The error is not looked at.
    fn make_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<(), Fault>;

    /// The step is final: its end is the start of the next. `h` is its size.
    fn go_on(&mut self, h: f64);

    /// The state at the end of the step made last.
    fn y_new(&self) -> &[f64];

    /// The rates at the start of the step made last, and at its end.
    fn rates(&self) -> [&[f64]; 2];

    /// Degree of the interpolation.
    fn degree(&self) -> usize;

    /// The state at a share of the step made last.
    fn interpolate(&self, share: f64, out: &mut [f64]);

    /// Gives the nodes of the method's own rule along the step made last, from `y` to `t_new`, which is about to become final
    /// ([`Run::add_node`]). Without them what is summed up is found by the interpolation.
    fn add_nodes(&mut self, _run: &mut Run<'_>, _y: &[f64], _t_new: f64) -> Result<(), Trouble> {
        Ok(())
    }

    /// Whether every step has its interpolation. Otherwise those have it in which there are samples, and those for which
    /// [`Stepper::expect_interpolation`] asked for it.
    fn always_interpolates(&self) -> bool {
        true
    }

    /// Whether the interpolation of the steps to come is needed, samples or not.
    fn expect_interpolation(&mut self, _needed: bool) {}
}

/// A method with error control.
pub(super) trait Adaptive: Stepper {
    /// As [`Stepper::make_step`], with the error of the step, 1 = what is allowed. The work beyond the error is spared where
    /// that is larger.
    fn try_step(&mut self, run: &mut Run<'_>, y: &[f64], t_new: f64) -> Result<f64, Fault>;

    /// Size of a first step, from the rates at an accepted state.
    fn first_step(&mut self, run: &mut Run<'_>, y: &[f64]) -> Result<f64, Trouble>;

    /// End of a step of about this size.
    fn step_end(&self, run: &Run<'_>, h: f64) -> f64 {
        run.step_end(h)
    }

    /// Whether [`Adaptive::step_end`] heeds samples, so that a step that is to end at one only needs to be made shorter.
    fn heeds_samples(&self) -> bool {
        false
    }

    /// Size of the step after one of size `tried` that was accepted with this error; `h` was asked for.
    fn size_after_acceptance(&mut self, tried: f64, h: f64, error: f64) -> f64;

    /// The same after one that is too inaccurate.
    fn size_after_rejection(&mut self, tried: f64, error: f64) -> f64;

    /// The last step was not accepted, for whatever reason.
    fn rejected(&mut self);

    /// The last step was accurate enough and is tried anew all the same: it missed something.
    fn discard(&mut self) {}

    /// The equations switched: what is known from the last steps does not hold for the next.
    fn forget(&mut self);

    /// The equations switched at this time: what acts from there on may begin as a broken power (Hertz, Hunt & Crossley), so near to which
    /// estimates of errors are not what they are along smooth solutions.
    fn doubt_from(&mut self, _t: f64) {}

    /// A guess of the end of the step that could not be made, as its new state; false where there is none.
    fn predict(&mut self, _y: &[f64], _h: f64) -> bool {
        false
    }

    /// Whether another method had better continue from here. Asked for after every accepted step.
    fn gives_way(&mut self, _run: &mut Run<'_>) -> bool {
        false
    }
}

/// Why a step was not made.
pub(super) enum Fault {
    /// Newton's method converges too slowly: try again with this share of the step.
    Slow(f64),
    Trouble(Trouble),
}

impl From<Trouble> for Fault {
    fn from(trouble: Trouble) -> Self {
        Self::Trouble(trouble)
    }
}

/// How an integration ended well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Completed,
    /// [`Adaptive::gives_way`] said so.
    GaveWay,
}

/// From an accepted state to the end, or until the method gives way; `first_step` is chosen by the method if absent.
pub(super) fn steps(
    method: &mut dyn Adaptive,
    run: &mut Run<'_>,
    y: &mut [f64],
    first_step: Option<f64>,
) -> Result<End, Trouble> {
    match (run.options.fixed_step, run.options.steps.clone()) {
        (Some(h), _) => steps_of_one_size(method, run, y, h).map(|()| End::Completed),
        (None, Some(ends)) => given_steps(method, run, y, &ends).map(|()| End::Completed),
        (None, None) => adaptive_steps(method, run, y, first_step),
    }
}

/// Steps to given ends, whatever their error: the internal differentiation of Bock (1981) follows the steps of one run with runs of
/// other parameters. Functions of time that jump still end steps, where they do for these parameters.
fn given_steps(method: &mut dyn Adaptive, run: &mut Run<'_>, y: &mut [f64], ends: &[f64]) -> Result<(), Trouble> {
    run.sample_start(y)?;
    if run.t == run.span.t_end {
        return Ok(());
    }
    method.start(run, y)?;
    let mut events = Events::new(run, method.reach());
    let mut scratch = vec![0.0; y.len()];
    while run.t < run.span.t_end {
        run.check_step_limit()?;
        let ahead = ends.partition_point(|end| *end <= run.t + run.smallest_step());
        let end = ends.get(ahead).copied().unwrap_or(f64::INFINITY);
        let left = run.span.t_end - run.smallest_step();
        let end = if end < left { end } else { run.span.t_end };
        let t_new = events.end_of_step(run, end, method.seen());
        ordered_step(method, run, y, t_new)?;
        finish_step(method, run, y, t_new, &mut scratch)?;
        events.beyond_break(run);
        if run.t != t_new && run.t < run.span.t_end {
            method.forget();
            method.start(run, y)?;
        }
    }
    Ok(())
}

/// A step to where it has to end: one that cannot be made is the end of the run.
fn ordered_step(method: &mut dyn Stepper, run: &mut Run<'_>, y: &mut [f64], t_new: f64) -> Result<(), Trouble> {
    run.system.begin_step(run.t, y, t_new - run.t);
    method.make_step(run, y, t_new).map_err(|fault| {
        run.counters.rejected += 1;
        match fault {
            Fault::Trouble(trouble) => trouble,
            Fault::Slow(_) => Trouble::Stop(StopReason::NoConvergence { step: t_new - run.t }),
        }
    })
}

/// Steps of one size, whatever their error: those of [`Run::next_equal_end`].
pub(super) fn steps_of_one_size(
    method: &mut dyn Stepper,
    run: &mut Run<'_>,
    y: &mut [f64],
    h: f64,
) -> Result<(), Trouble> {
    run.sample_start(y)?;
    if run.t == run.span.t_end {
        return Ok(());
    }
    method.start(run, y)?;
    let mut events = Events::new(run, method.reach());
    let mut scratch = vec![0.0; y.len()];
    method.expect_interpolation(events.watches_steps());
    while let Some(t_new) = run.next_equal_end(h) {
        run.check_step_limit()?;
        ordered_step(method, run, y, t_new)?;
        let inside = Inside::new(method, run, y, t_new, &events);
        let at = |share: f64, out: &mut [f64]| inside.state(share, out);
        let felt = |number: usize, out: &mut [f64]| inside.felt(number, out);
        events.note_missed(run, &inside.interpolation(&at, &felt))?;
        finish_step(method, run, y, t_new, &mut scratch)?;
    }
    Ok(())
}

/// Steps that pass the error test, as long as the method makes them.
pub(super) fn adaptive_steps(
    method: &mut dyn Adaptive,
    run: &mut Run<'_>,
    y: &mut [f64],
    first_step: Option<f64>,
) -> Result<End, Trouble> {
    run.sample_start(y)?;
    if run.t == run.span.t_end {
        return Ok(End::Completed);
    }
    method.start(run, y)?;
    let mut h = match first_step {
        Some(h) => h,
        None => method.first_step(run, y)?,
    };
    // Where the next step had better end.
    let mut end_at = None;
    let mut events = Events::new(run, method.reach());
    let mut stops = Stops::new(run);
    let mut scratch = vec![0.0; y.len()];
    // A time that no step led to yet, and why.
    let mut barred: Option<(f64, StopReason)> = None;
    while run.t < run.span.t_end {
        run.check_step_limit()?;
        h = h.min(run.longest_step(y));
        barred = barred.filter(|(time, _)| run.t < *time);
        let t_new = end_at.take().unwrap_or_else(|| method.step_end(run, h));
        let t_new = events.end_of_step(run, t_new, method.seen());
        let tried = t_new - run.t;
        if tried <= 0.0 {
            return Err(Trouble::Stop(StopReason::StepTooSmall { step: h }));
        }
        method.expect_interpolation(events.is_pending() || events.watches_steps());
        run.system.begin_step(run.t, y, tried);
        let reason = match method.try_step(run, y, t_new) {
            Ok(error) if error <= 1.0 => {
                if let Some(again) = missed(method, run, y, t_new, &mut events)? {
                    (h, end_at) = (again.h, again.end_at);
                    method.discard();
                    continue;
                }
                let start = run.t;
                match stopped(method, run, y, t_new, (&mut stops, &events))? {
                    Verdict::Pass => {}
                    Verdict::Again(again) => {
                        (h, end_at) = (again.h, again.end_at);
                        events.forget();
                        method.discard();
                        continue;
                    }
                    Verdict::End => {
                        finish_step(method, run, y, t_new, &mut scratch)?;
                        return Err(Trouble::Stop(StopReason::Event));
                    }
                    Verdict::Before => return Err(Trouble::Stop(StopReason::Event)),
                }
                if finish_step(method, run, y, t_new, &mut scratch)? == Accepted::Changed {
                    stops.forget();
                }
                h = method.size_after_acceptance(tried, h, error);
                let at = |share: f64, out: &mut [f64]| method.interpolate(share, out);
                let degree = method.degree();
                let step =
                    Interpolation { start, h: run.t - start, end: run.t, degree, at: &at, seen: &[], felt: &|_, _| () };
                let next = events.accepted(run, y, &mut stops, &step)?;
                if !matches!(next, Next::Plain) {
                    stops.forget();
                }
                match next {
                    Next::Plain => {}
                    Next::EndAt(time) => end_at = Some(time),
                    Next::Passed(size) => h = size,
                    Next::Resumed(size) => h = h.max(size),
                    Next::Crossed(size) => {
                        method.forget();
                        method.start(run, y)?;
                        method.doubt_from(run.t);
                        h = size.min(method.first_step(run, y)?);
                    }
                    Next::Jumped(size) if run.t < run.span.t_end => {
                        method.forget();
                        let before = method.rates()[0].to_vec();
                        method.start(run, y)?;
                        let continuous = is_continuous(run, y, tried, &before, method.rates()[0]);
                        h = if continuous { size } else { size.min(method.first_step(run, y)?) };
                    }
                    Next::Jumped(_) => {}
                }
                if method.gives_way(run) && run.t < run.span.t_end {
                    return Ok(End::GaveWay);
                }
                continue;
            }
            Ok(error) => {
                h = method.size_after_rejection(tried, error);
                end_at = events.rejected(run, y, method.rates()[0], t_new, method.y_new())?;
                StopReason::StepTooSmall { step: h }
            }
            Err(Fault::Slow(share)) => {
                h = tried * share;
                if method.predict(y, tried) {
                    end_at = events.rejected(run, y, method.rates()[0], t_new, method.y_new())?;
                }
                StopReason::NoConvergence { step: tried }
            }
            Err(Fault::Trouble(Trouble::EndAt(time))) => {
                run.counters.rejected += 1;
                run.counters.recoveries.sample_step += 1;
                h = time - run.t;
                end_at = Some(time).filter(|_| !method.heeds_samples());
                continue;
            }
            Err(Fault::Trouble(Trouble::Retry(reason))) => {
                h = tried * RECOVERY_FACTOR;
                reason
            }
            Err(Fault::Trouble(trouble)) => return Err(trouble),
        };
        run.reject(&reason);
        method.rejected();
        if h < run.smallest_step() {
            return Err(Trouble::Stop(why_none(reason, barred)));
        }
        if matches!(reason, StopReason::Failed { .. }) {
            barred = Some((t_new, reason));
        }
    }
    Ok(End::Completed)
}

/// Why no step is possible: the reason of the last one, unless that is its size alone and another time was not to be had before.
pub(super) fn why_none(reason: StopReason, barred: Option<(f64, StopReason)>) -> StopReason {
    let is_told = matches!(reason, StopReason::Failed { .. } | StopReason::NotFinite { .. });
    barred.filter(|_| !is_told).map_or(reason, |(_, failed)| failed)
}

/// Whether two derivatives at one state differ by less than the tolerance over a step of this size.
fn is_continuous(run: &mut Run<'_>, y: &[f64], h: f64, before: &[f64], after: &[f64]) -> bool {
    let difference: Vec<f64> = before.iter().zip(after).map(|(before, after)| h * (after - before)).collect();
    run.system.error_norm(y, y, &difference) <= 1.0
}

/// Whether the step just made missed something; then how it is to be tried again.
fn missed(
    method: &dyn Stepper,
    run: &mut Run<'_>,
    y: &[f64],
    t_new: f64,
    events: &mut Events,
) -> Result<Option<Again>, Trouble> {
    if !events.watches_anything() {
        return Ok(None);
    }
    let inside = Inside::new(method, run, y, t_new, events);
    let at = |share: f64, out: &mut [f64]| inside.state(share, out);
    let felt = |number: usize, out: &mut [f64]| inside.felt(number, out);
    events.missed(run, y, &inside.interpolation(&at, &felt))
}

/// Whether the integration ends within the step just made.
fn stopped(
    method: &dyn Stepper,
    run: &mut Run<'_>,
    y: &[f64],
    t_new: f64,
    (stops, events): (&mut Stops, &Events),
) -> Result<Verdict, Trouble> {
    if !stops.is_needed() {
        return Ok(Verdict::Pass);
    }
    let inside = Inside::new(method, run, y, t_new, events);
    let at = |share: f64, out: &mut [f64]| inside.state(share, out);
    stops.examine(run, y, &inside.interpolation(&at, &|_, _| ()))
}

/// Makes the step final: samples, `accept`, `step_done`; the rates anew where `accept` changed something.
fn finish_step(
    method: &mut dyn Stepper,
    run: &mut Run<'_>,
    y: &mut [f64],
    t_new: f64,
    scratch: &mut [f64],
) -> Result<Accepted, Trouble> {
    let (t, h) = (run.t, t_new - run.t);
    if run.system.sums_up() {
        method.add_nodes(run, y, t_new)?;
    }
    y.copy_from_slice(method.y_new());
    let accepted = run.finish_step(t_new, y, scratch, |time, out| method.interpolate((time - t) / h, out))?;
    method.go_on(h);
    if accepted == Accepted::Changed && t_new < run.span.t_end {
        method.start(run, y)?;
    }
    Ok(accepted)
}

/// What is known of the inside of a step that was made and is not yet final.
struct Inside<'a> {
    method: &'a dyn Stepper,
    y: &'a [f64],
    start: f64,
    t_new: f64,
    h: f64,
    /// Whether by the method's own interpolation. For angles the cubic through both ends will do, which takes no evaluations.
    own: bool,
}

impl<'a> Inside<'a> {
    fn new(method: &'a dyn Stepper, run: &Run<'_>, y: &'a [f64], t_new: f64, events: &Events) -> Self {
        let own = method.always_interpolates() || events.watches_steps();
        Self { method, y, start: run.t, t_new, h: t_new - run.t, own }
    }

    fn state(&self, share: f64, out: &mut [f64]) {
        if self.own {
            return self.method.interpolate(share, out);
        }
        hermite(share, self.h, [self.y, self.method.y_new()], self.method.rates(), out);
    }

    fn seen(&self) -> &'a [f64] {
        if self.own { self.method.seen() } else { &[0.0, 1.0] }
    }

    fn felt(&self, number: usize, out: &mut [f64]) {
        if self.own { self.method.felt(number, out) } else { self.state(self.seen()[number], out) }
    }

    fn interpolation<'b>(
        &'b self,
        at: &'b dyn Fn(f64, &mut [f64]),
        felt: &'b dyn Fn(usize, &mut [f64]),
    ) -> Interpolation<'b> {
        let degree = if self.own { self.method.degree() } else { 3 };
        Interpolation { start: self.start, h: self.h, end: self.t_new, degree, at, seen: self.seen(), felt }
    }
}
