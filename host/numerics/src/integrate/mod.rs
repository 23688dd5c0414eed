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
//! library may add their own; a further explicit pair is a table.
//!
//! | file | content |
//! |---|---|
//! | `mod.rs`, `system.rs`, `outcome.rs` | what goes in and comes out: methods, options, the system and its hooks, counters |
//! | `methods.rs` | the methods by name |
//! | `run.rs` | what all methods share: checks, counting, samples, the end of a step |
//! | `steps.rs` | the loop over steps: error control, steps tried again, steps of one size |
//! | `explicit.rs`, `pair.rs` | what explicit pairs share: stages, dense output, step control; their table |
//! | `dop853.rs`, `dop853_tableau.rs`, `dopri5.rs` | the pairs |
//! | `radau5.rs`, `radau5/` | Radau IIA of orders 5 and 9: Newton's method, coefficients, control of steps and iterations |
//! | `jacobian.rs`, `fill.rs`, `lu.rs` | the matrices of implicit steps |
//! | `rk4.rs` | the classical method, steps of one size |
//! | `auto.rs`, `rivals.rs`, `stiffness.rs` | the choice between dop853 and radau5 |
//! | `kinematic.rs` | motions that are found, not integrated |
//! | `events.rs`, `events/sides.rs` | steps that end where the right side switches |
//! | `sums.rs` | sums over stages, polynomials through steps |
//! | `stops.rs` | where the integration ends, for the state or the equations to be changed |
//! | `enclosure.rs`, `enclosure/of_time.rs` | nothing is stepped over: ranges over a step; functions of time, before it |
//! | `interpolation.rs` | the states inside a step |
//!
//! # Life of a step
//! In this order, and in no other:
//!
//! 1. `max_step_hint`, `begin_step`, then `rhs` at the stages of the method, `error_norm`. A step may be
//!    rejected and tried again smaller; discrete memory must not change here.
//! 2. `project`: the new state is brought back to its manifold. Then `rhs` there: it is the
//!    first stage of the next step, and the interpolation uses it.
//! 3. Where `sums_up` says so, `rate_summed` at the stages again and `sum_up`.
//! 4. `sample` at each requested time in the step, its end included, in ascending order. States
//!    inside the step are interpolated; the end is the step's own state.
//! 5. `accept`: the only place where discrete memory may change.
//! 6. `step_done`: progress, audit, the wish to stop.
//!
//! A sample at `t_start` is taken before the first step, and `accept` is not called for it.
//! Steps are not shortened to hit samples, only to hit `t_end`; except where the interpolation is known to be bad: where
//! stability limits an explicit method, and where an implicit method's error test says so. A step inside which
//! the right side switches is made to end there (`events.rs`).

use std::sync::Arc;

mod auto;
mod dop853;
mod dop853_tableau;
mod dopri5;
mod enclosure;
mod events;
mod explicit;
mod fill;
mod halves;
mod interpolation;
mod jacobian;
mod kinematic;
mod lu;
mod methods;
mod outcome;
mod pair;
mod radau5;
mod rivals;
mod rk4;
mod run;
mod steps;
mod stiffness;
mod stops;
mod sums;
mod system;

#[cfg(test)]
mod tests;

pub use auto::Auto;
pub use dop853::dop853;
pub use dopri5::dopri5;
pub use explicit::Explicit;
pub use kinematic::Kinematic;
pub use methods::{Method, Methods, by_name, names};
pub use outcome::{Counters, IntegrateError, Outcome, Recoveries, Status, StopReason};
pub use pair::{Estimate, Pair, Row};
pub use radau5::{Radau5, Radau9};
pub use rk4::Rk4;
pub use run::{Run, Trouble};
pub use stops::ZERO as STOPPED;
pub use system::{Accepted, Entries, Failure, Flow, Guard, GuardSet, Guards, Price, System, Watched};

impl Options {
    /// Whether steps are given, so that their error is not looked at.
    pub(crate) fn steps_are_given(&self) -> bool {
        self.fixed_step.is_some() || self.steps.is_some()
    }
}

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

    /// Takes the samples at the start and makes all steps, from the state `y` at `run.t`; [`Integrator::integrate`] does what
    /// comes before and after.
    ///
    /// # Errors
    /// [`Trouble`]: why the run ends before `span.t_end`.
    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble>;

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
    ) -> Result<Outcome, IntegrateError> {
        let mut run = Run::new(system, y, span, options)?;
        if self.needs_fixed_step() && options.fixed_step.is_none() {
            return Err(IntegrateError::Invalid(format!("the method {} needs a fixed step", self.name())));
        }
        let result = self.steps(&mut run, y);
        run.end(result)
    }
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
    /// Steps of these that were tried before this interval, where it continues from another.
    pub steps_before: usize,
    /// Steps of this size without error control, made a little smaller so that a whole number
    /// of them fills the interval, and what is between two times of [`System::next_end`]. `first_step`, `max_step` and hints are not looked at.
    pub fixed_step: Option<f64>,
    /// Ends of steps to be taken whatever their error, ascending: those of another run, whose equations differ a little, so that
    /// the result is a smooth function of what differs. Those that are not ahead are passed over; the last step ends at `t_end`.
    pub steps: Option<Arc<[f64]>>,
    /// Share of the predicted step size that is tried, 0..1. At 0.9 a fifth of the steps of the benchmark scenes is rejected, at 0.8
    /// with a weight of 0.04 of the previous error one in thirty.
    pub safety: f64,
    /// Limits of the ratio of successive step sizes.
    pub min_factor: f64,
    /// See `min_factor`.
    pub max_factor: f64,
    /// Weight of the previous error in the choice of step size (Gustafsson's PI control), 0 to
    /// about 0.06; 0 = none. The method's own if absent; explicit methods only.
    pub beta: Option<f64>,
}

impl Default for Options {
    /// The values of the program DOP853, but a smaller share of the predicted step size.
    fn default() -> Self {
        Self {
            first_step: None,
            max_step: None,
            max_steps: 1_000_000,
            steps_before: 0,
            fixed_step: None,
            steps: None,
            safety: 0.8,
            min_factor: 1.0 / 3.0,
            max_factor: 6.0,
            beta: None,
        }
    }
}
