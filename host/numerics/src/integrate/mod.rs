//! Time integration of `y' = f(t, y)`.
//!
//! - **Takes**: a [`System`], a start vector, a [`Span`] with the times at which samples are
//!   wanted, [`Options`].
//! - **Gives**: calls of the system's hooks (samples, accepted steps), the final vector, and an
//!   [`Outcome`] with a status and counters of all work done.
//! - **May touch**: the state vector, and the system through its trait.
//! - **Must not know**: mechanics, plugins, channels, files.
//!
//! A method is one file with one implementation of [`Integrator`] and one line in [`Methods`], where programs that use this
//! library may add their own. What all methods share (sampling, counting, the end of a step) is in [`Run`], the loop over
//! steps with its error control in `steps.rs`, what explicit pairs share in [`Explicit`]: a further pair is a table.
//!
//! # Life of a step
//! In this order, and in no other:
//!
//! 1. `max_step_hint`, then `rhs` at the stages of the method, `error_norm`. A step may be
//!    rejected and tried again smaller; discrete memory must not change here.
//! 2. `project`: the new state is brought back to its manifold. Then `rhs` there: it is the
//!    first stage of the next step, and the interpolation uses it.
//! 3. `sample` at each requested time in the step, its end included, in ascending order. States
//!    inside the step are interpolated; the end is the step's own state.
//! 4. `accept`: the only place where discrete memory may change.
//! 5. `step_done`: progress, audit, the wish to stop.
//!
//! A sample at `t_start` is taken before the first step, and `accept` is not called for it.
//! Steps are not shortened to hit samples, only to hit `t_end`; except where the interpolation is known to be bad: where
//! stability limits an explicit method, and where an implicit method's error test says so. A step that is rejected because
//! the right side switches inside it is made to end there (`events.rs`).

mod auto;
mod dop853;
mod dop853_tableau;
mod dopri5;
mod enclosure;
mod events;
mod explicit;
mod jacobian;
mod kinematic;
mod lu;
mod methods;
mod radau5;
mod rivals;
mod rk4;
mod run;
mod steps;
mod stiffness;

#[cfg(test)]
mod tests;

use std::error::Error;

use crate::interval::Range;

pub use auto::Auto;
pub use dop853::dop853;
pub use dopri5::dopri5;
pub use explicit::{Estimate, Explicit, Pair, Row};
pub use kinematic::Kinematic;
pub use methods::{Method, Methods, by_name, names};
pub use radau5::Radau5;
pub use rk4::Rk4;
pub use run::{Run, Trouble};

/// A method of integration.
pub trait Integrator: Send {
    /// Name under which [`by_name`] finds the method.
    fn name(&self) -> &'static str;

    /// Whether the method has no error control, so that [`Options::fixed_step`] must be given.
    fn needs_fixed_step(&self) -> bool {
        false
    }

    /// Whether the method may ask for [`System::jacobian`], so that preparing it is worth while.
    fn may_use_jacobian(&self) -> bool {
        false
    }

    /// Integrates from `span.t_start` to `span.t_end`. `y` is the state at the start, already
    /// on its manifold, and holds the last accepted state on return, whatever the result.
    ///
    /// Stopping early is not an error: the outcome then says where and why, and every sample
    /// up to there was delivered.
    ///
    /// # Errors
    /// [`IntegrateError::Invalid`] before anything is evaluated, or
    /// [`IntegrateError::System`] with the system's own [`Failure::Fatal`].
    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError>;
}

/// What is integrated, with the hooks that watch it. Only `dim`, `rhs` and `error_norm` are
/// required. The order of calls is in the room's documentation.
pub trait System {
    /// Length of the state vector; constant.
    fn dim(&self) -> usize;

    /// `dy := f(t, y)`, every entry. A function of `t`, `y` and the discrete memory, also for
    /// times of steps that are rejected later. `[hot]`
    ///
    /// # Errors
    /// See [`Failure`].
    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure>;

    /// Size of `error`, a small difference of states, such that 1 is the tolerance. `y0` and
    /// `y1` are the states at the ends of the step, for relative tolerances. It has to be a
    /// norm (homogeneous in `error`); the first step size relies on it too. `[hot]`
    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64;

    /// Size of a small difference of states at `y`, on any scale of its own, without regard to the step under way: ratios
    /// of two of them tell how fast derivatives change.
    fn size(&mut self, y: &[f64], difference: &[f64]) -> f64 {
        self.error_norm(y, y, difference)
    }

    /// The relative error that 1 in [`System::error_norm`] stands for, if it is known. Methods whose error estimate is of
    /// a much lower order than their result (Radau IIA) need it to aim at the tolerance.
    fn tolerance(&self) -> Option<f64> {
        None
    }

    /// What work costs, roughly, for methods that choose the cheaper of two.
    fn price(&self) -> Price {
        Price { evaluation: 100.0 * self.dim() as f64, jacobian: None, preparation: 0.0 }
    }

    /// The exact derivatives of `rhs` with respect to `y`, column by column: entry `(i, j)` at `i + dim * j`, every entry.
    /// `false` if there are none; implicit methods then take differences of `rhs`. Need not be the derivative of what
    /// projections inside `rhs` do.
    ///
    /// # Errors
    /// See [`Failure`].
    fn jacobian(&mut self, _t: f64, _y: &[f64], _matrix: &mut [f64]) -> Result<bool, Failure> {
        Ok(false)
    }

    /// Entries of the state from here on are sums that nothing depends on and error control does not look at (work done).
    fn sums_from(&self) -> usize {
        self.dim()
    }

    /// Brings a new state back to its manifold. `[hot]`
    ///
    /// # Errors
    /// See [`Failure`]; recoverable if the state is too far away.
    fn project(&mut self, _t: f64, _y: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// Number of conditions at which `f` may switch from one expression to another (contact, friction, limits). Methods with
    /// error control end steps there.
    fn conditions(&self) -> usize {
        0
    }

    /// A number for each condition that changes its sign where `f` switches; negative on one side, not negative on the other.
    /// Asked for where a step was too inaccurate, to find out whether a switch is why.
    ///
    /// # Errors
    /// See [`Failure`].
    fn switching(&mut self, _t: f64, _y: &[f64], _values: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// What is to hold throughout a step, beyond what error control judges by. Asked for once, before the first step.
    fn guards(&self) -> Guards {
        Guards::default()
    }

    /// The ranges of all guards of a set, in their order, while time and the entries of the state run through ranges on a
    /// stretch; `entry` gives those of [`GuardSet::entries`], by place in that list.
    fn enclose(&mut self, _of: Watched, _t: Range, _entry: &dyn Fn(usize) -> Range, _found: &mut [Range]) {}

    /// The values of all guards of a set at a point.
    fn values(&mut self, _of: Watched, _t: f64, _entry: &dyn Fn(usize) -> f64, _found: &mut [f64]) {}

    /// How fast counted angles can change at a state, rad/s: no step in which they cannot turn far is looked at closely.
    fn turning(&self, _y: &[f64]) -> f64 {
        0.0
    }

    /// How far an entry of the state may be off within the tolerance.
    fn resolution(&self, _entry: usize) -> f64 {
        0.0
    }

    /// The values of all guards of a set, in their order, at a state: for systems whose guards cannot be enclosed.
    ///
    /// # Errors
    /// See [`Failure`].
    fn look(&mut self, _of: Watched, _t: f64, _y: &[f64], _values: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// Longest step that is sensible from here, > 0.
    fn max_step_hint(&self, _t: f64, _y: &[f64]) -> f64 {
        f64::INFINITY
    }

    /// Takes the state at a requested time. Interpolated states are off their manifold by the
    /// interpolation error; who needs them on it projects a copy.
    ///
    /// # Errors
    /// See [`Failure`]; both kinds end the run, a recoverable one with an [`Outcome`].
    fn sample(&mut self, _t: f64, _y: &[f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// The step to `t` is final: discrete memory may change here, and `y` too (winding of
    /// angles, say), on its manifold.
    ///
    /// # Errors
    /// See [`Failure`]; both kinds end the run, a recoverable one with an [`Outcome`].
    fn accept(&mut self, _t: f64, _y: &mut [f64]) -> Result<Accepted, Failure> {
        Ok(Accepted::Unchanged)
    }

    /// A step of length `h` to `t` is over.
    fn step_done(&mut self, _t: f64, _y: &[f64], _h: f64) -> Flow {
        Flow::Continue
    }
}

/// What is watched throughout every step.
#[derive(Debug, Clone, Default)]
pub struct Guards {
    /// Switches and functions that depend on the state.
    pub within: GuardSet,
    /// Counted angles.
    pub turns: GuardSet,
    /// What depends on time alone.
    pub of_time: Vec<Guard>,
}

/// Quantities that are watched together.
#[derive(Debug, Clone, Default)]
pub struct GuardSet {
    /// How each of them is watched.
    pub guards: Vec<Guard>,
    /// Entries of the state that they depend on.
    pub entries: Vec<usize>,
    /// Whether [`System::enclose`] gives ranges; otherwise [`System::look`] is called at many places of each step.
    pub proved: bool,
}

/// One of the sets of [`Guards`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watched {
    /// [`Guards::within`].
    Within,
    /// [`Guards::turns`].
    Turns,
    /// [`Guards::of_time`], which take no entry of the state.
    Time,
}

/// How a quantity is watched.
#[derive(Clone)]
pub enum Guard {
    /// A condition that changes its sign where the equations switch: that is not to happen twice in a step unnoticed.
    Switch,
    /// A function that may be sharp: within a step it is not to leave what the method saw of it.
    Feature,
    /// A quantity that must stay within plus and minus a limit.
    Bound(f64),
    /// An angle less the reference it is counted from, rad: it has to stay within half a turn.
    Turn,
    /// The argument of a table, as a function of time: steps end at the knots. Gives the knots next to an argument, the lower
    /// one included.
    Knots(std::sync::Arc<dyn Fn(f64) -> (f64, f64) + Send + Sync>),
}

impl std::fmt::Debug for Guard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Switch => "Switch",
            Self::Feature => "Feature",
            Self::Bound(_) => "Bound",
            Self::Turn => "Turn",
            Self::Knots(_) => "Knots",
        })
    }
}

/// Cost of a system's work, in operations of dense linear algebra; only ratios matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// Of [`System::rhs`], and about that of [`System::project`].
    pub evaluation: f64,
    /// Of [`System::jacobian`]; without one, differences cost as many evaluations as the state has entries.
    pub jacobian: Option<f64>,
    /// Of what has still to be done before the first of them.
    pub preparation: f64,
}

/// Whether [`System::accept`] changed anything that `rhs` depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accepted {
    /// `y` and `f(t, y)` are what they were; the derivative at hand is used again.
    Unchanged,
    /// `y` or discrete memory changed; `f(t, y)` is evaluated anew.
    Changed,
}

/// Whether to go on after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// On with the next step.
    Continue,
    /// End the run here, with [`StopReason::Requested`].
    Stop,
}

/// Why a system could not do what it was asked for; carries the system's own error.
#[derive(Debug)]
pub enum Failure {
    /// A smaller step may help.
    Recoverable(Box<dyn Error + Send + Sync>),
    /// The same, where a number that was asked for is infinite or none.
    NotFinite(Box<dyn Error + Send + Sync>),
    /// A state that cannot be: no step may lead to it, or across it.
    Forbidden(Box<dyn Error + Send + Sync>),
    /// Nothing will help.
    Fatal(Box<dyn Error + Send + Sync>),
}

/// Interval of integration, `t_start <= t_end`, and the times at which samples are taken:
/// ascending (equal ones allowed), within the interval.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// First time.
    pub t_start: f64,
    /// Last time, reached exactly.
    pub t_end: f64,
    /// Requested times.
    pub sample_times: &'a [f64],
}

/// Options of all methods; the tolerance is part of [`System::error_norm`].
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Size of the first step; chosen by the method if absent.
    pub first_step: Option<f64>,
    /// Upper limit of all step sizes; the last one may be 1 % longer, to reach the end.
    pub max_step: Option<f64>,
    /// Steps tried, accepted or not, before the run is stopped.
    pub max_steps: usize,
    /// Steps of these that were tried before this interval, where it goes on from another.
    pub steps_before: usize,
    /// Steps of this size without error control, made a little smaller so that a whole number
    /// of them fills the interval. `first_step`, `max_step` and hints are not looked at.
    pub fixed_step: Option<f64>,
    /// Share of the predicted step size that is tried, 0..1.
    pub safety: f64,
    /// Limits of the ratio of successive step sizes.
    pub min_factor: f64,
    /// See `min_factor`.
    pub max_factor: f64,
    /// Weight of the previous error in the choice of step size (Gustafsson's PI control), 0 to
    /// about 0.04; 0 = none, the usual choice for high orders. The method's own if absent; explicit methods only.
    pub beta: Option<f64>,
}

impl Default for Options {
    /// The values of the program DOP853.
    fn default() -> Self {
        Self {
            first_step: None,
            max_step: None,
            max_steps: 1_000_000,
            steps_before: 0,
            fixed_step: None,
            safety: 0.9,
            min_factor: 1.0 / 3.0,
            max_factor: 6.0,
            beta: None,
        }
    }
}

/// How a run ended.
#[derive(Debug)]
pub struct Outcome {
    /// Whether it reached its end.
    pub status: Status,
    /// Work done.
    pub counters: Counters,
}

/// See [`Outcome`].
#[derive(Debug)]
pub enum Status {
    /// `t_end` was reached.
    Completed,
    /// The run ended before, with valid results up to `t`.
    StoppedEarly {
        /// Time of the last accepted state.
        t: f64,
        /// Why.
        reason: StopReason,
    },
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum StopReason {
    /// [`System::step_done`] said so.
    #[error("stopped on request")]
    Requested,
    /// [`Options::max_steps`] is used up.
    #[error("the limit of {limit} steps is reached")]
    StepLimit {
        /// The limit.
        limit: usize,
    },
    /// The error test asks for steps that do not advance time any more.
    #[error("the error tolerance asks for a step of {step:e}, too small to advance the time")]
    StepTooSmall {
        /// Step size that was not tried.
        step: f64,
    },
    /// The solution ceases to be finite, however small the step.
    #[error("the solution is not finite beyond this time (last step tried {step:e})")]
    NotFinite {
        /// Last step size tried.
        step: f64,
    },
    /// The equations of an implicit step have no solution that Newton's method finds, however small the step.
    #[error("the equations of a step could not be solved (last step tried {step:e})")]
    NoConvergence {
        /// Last step size tried.
        step: f64,
    },
    /// The system failed with [`Failure::Recoverable`] or [`Failure::NotFinite`], and no smaller step is possible.
    #[error("no step is possible beyond this time (last step tried {step:e}): {cause}")]
    Failed {
        /// Last step size tried; 0 if it failed at the last accepted state itself.
        step: f64,
        /// Whether it was [`Failure::NotFinite`].
        not_finite: bool,
        /// The system's error.
        #[source]
        cause: Box<dyn Error + Send + Sync>,
    },
}

/// Work done in a run: exact integers, the same on every machine for equal arithmetic.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Counters {
    /// Accepted steps.
    pub steps: usize,
    /// Steps tried and not accepted, for whatever reason.
    pub rejected: usize,
    /// Calls of [`System::rhs`].
    pub evaluations: usize,
    /// Calls of [`System::project`].
    pub projections: usize,
    /// Calls of [`System::sample`].
    pub samples: usize,
    /// Jacobians of the right side, by implicit methods.
    pub jacobians: usize,
    /// Factorisations of the matrices of an implicit step, a real and a complex one each.
    pub factorisations: usize,
    /// Iterations of Newton's method in implicit steps.
    pub newton_iterations: usize,
    /// From when on stability limited the steps of an explicit method, or [`Auto`] tried an implicit one.
    pub stiff_from: Option<f64>,
    /// Changes between an explicit and an implicit method.
    pub switches: usize,
    /// Steps that were made to end where the right side switches ([`System::switching`]).
    pub events: usize,
    /// Steps whose enclosures were computed.
    pub enclosed: usize,
    /// Steps tried again because something happened within them that the method had not seen.
    pub stepped_over: usize,
    /// The same in steps of a fixed size, which cannot be made shorter: results may be wrong from there on.
    pub missed: usize,
    /// Pieces of steps on which nothing could be proved; decided by the values at their ends.
    pub unproven: usize,
    /// How often switches followed each other so closely that steps were no longer made to end there, for a while.
    pub chatters: usize,
    /// Smallest accepted step; 0 without any.
    pub h_min: f64,
    /// Largest accepted step; 0 without any.
    pub h_max: f64,
    /// What was done where the plain way did not get on.
    pub recoveries: Recoveries,
}

impl std::ops::AddAssign for Counters {
    /// The work of an integration that goes on from where the other ended.
    fn add_assign(&mut self, next: Self) {
        self.h_min = match (self.steps, next.steps) {
            (0, _) => next.h_min,
            (_, 0) => self.h_min,
            _ => self.h_min.min(next.h_min),
        };
        self.h_max = self.h_max.max(next.h_max);
        self.stiff_from = self.stiff_from.or(next.stiff_from);
        for (sum, count) in [
            (&mut self.steps, next.steps),
            (&mut self.rejected, next.rejected),
            (&mut self.evaluations, next.evaluations),
            (&mut self.projections, next.projections),
            (&mut self.samples, next.samples),
            (&mut self.jacobians, next.jacobians),
            (&mut self.factorisations, next.factorisations),
            (&mut self.newton_iterations, next.newton_iterations),
            (&mut self.switches, next.switches),
            (&mut self.events, next.events),
            (&mut self.enclosed, next.enclosed),
            (&mut self.stepped_over, next.stepped_over),
            (&mut self.missed, next.missed),
            (&mut self.unproven, next.unproven),
            (&mut self.chatters, next.chatters),
            (&mut self.recoveries.smaller_step, next.recoveries.smaller_step),
            (&mut self.recoveries.not_finite, next.recoveries.not_finite),
            (&mut self.recoveries.no_convergence, next.recoveries.no_convergence),
            (&mut self.recoveries.sample_step, next.recoveries.sample_step),
            (&mut self.recoveries.fresh_jacobian, next.recoveries.fresh_jacobian),
        ] {
            *sum += count;
        }
    }
}

/// Named remedies taken, each counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Recoveries {
    /// Steps tried again smaller after [`Failure::Recoverable`].
    pub smaller_step: usize,
    /// Steps tried again smaller after [`Failure::NotFinite`], or because the result, or its error, was not finite.
    pub not_finite: usize,
    /// Steps tried again smaller because Newton's method did not converge.
    pub no_convergence: usize,
    /// Steps tried again so that they end at a sample that could not be interpolated well.
    pub sample_step: usize,
    /// Jacobians of an earlier state given up because Newton's method did not converge with them.
    pub fresh_jacobian: usize,
}

/// What ends a run without an outcome.
#[derive(Debug, thiserror::Error)]
pub enum IntegrateError {
    /// Span, options and system do not fit together.
    #[error("{0}")]
    Invalid(String),
    /// The system gave up.
    #[error("the system failed at t = {t}: {cause}")]
    System {
        /// Time of the call that failed.
        t: f64,
        /// The system's error.
        #[source]
        cause: Box<dyn Error + Send + Sync>,
    },
}
