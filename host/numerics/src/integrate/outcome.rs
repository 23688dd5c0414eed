//! [`Outcome`]: how a run ended, and what it took.

use std::error::Error;

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
    /// [`super::System::step_done`] said so.
    #[error("stopped on request")]
    Requested,
    /// One of [`super::System::stopping`] became negative.
    #[error("a quantity that must not be negative becomes so")]
    Event,
    /// [`super::Options::max_steps`] is used up.
    #[error("the limit of {limit} steps is reached")]
    StepLimit {
        /// The limit.
        limit: usize,
        /// For how much time the second half of them went, where steps had become tiny beside those before.
        crept: Option<f64>,
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
    /// The system failed with [`super::Failure::Recoverable`] or [`super::Failure::NotFinite`], and no smaller step is possible.
    #[error("no step is possible beyond this time (last step tried {step:e}): {cause}")]
    Failed {
        /// Last step size tried; 0 if it failed at the last accepted state itself.
        step: f64,
        /// Whether it was [`super::Failure::NotFinite`].
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
    /// Calls of [`super::System::rhs`].
    pub evaluations: usize,
    /// Calls of [`super::System::project`].
    pub projections: usize,
    /// Calls of [`super::System::sample`].
    pub samples: usize,
    /// Jacobians of the right side, by implicit methods.
    pub jacobians: usize,
    /// Factorisations of the matrices of an implicit step, a real and a complex one each.
    pub factorisations: usize,
    /// Iterations of Newton's method in implicit steps.
    pub newton_iterations: usize,
    /// From when on stability limited the steps of an explicit method, or [`super::Auto`] tried an implicit one.
    pub stiff_from: Option<f64>,
    /// Changes between an explicit and an implicit method.
    pub switches: usize,
    /// Steps that were made to end where the right side switches ([`super::System::switching`]).
    pub events: usize,
    /// Steps whose enclosures were computed.
    pub enclosed: usize,
    /// Steps tried again because something happened within them that the method had not seen.
    pub stepped_over: usize,
    /// The same in steps of a fixed size, which cannot be made shorter: results may be wrong from there on.
    pub missed: usize,
    /// Pieces of steps on which nothing could be proved; decided by the values at their ends.
    pub unproven: usize,
    /// The longest stretch of time on which a function of time could not be shown to be what the method saw of it, s.
    pub open: Option<[f64; 2]>,
    /// How often switches followed each other so closely that steps were no longer made to end there, for a while.
    pub chatters: usize,
    /// Smallest accepted step; 0 without any.
    pub h_min: f64,
    /// Largest accepted step; 0 without any.
    pub h_max: f64,
    /// What was done where the plain way did not get on.
    pub recoveries: Recoveries,
}

impl Counters {
    /// Notes a stretch of time for [`Counters::open`].
    pub(super) fn leave_open(&mut self, stretch: [f64; 2]) {
        let length = |[from, to]: [f64; 2]| to - from;
        if self.open.is_none_or(|open| length(stretch) > length(open)) {
            self.open = Some(stretch);
        }
    }
}

impl std::ops::AddAssign for Counters {
    /// The work of an integration that continues from where the other ended.
    fn add_assign(&mut self, next: Self) {
        self.h_min = match (self.steps, next.steps) {
            (0, _) => next.h_min,
            (_, 0) => self.h_min,
            _ => self.h_min.min(next.h_min),
        };
        self.h_max = self.h_max.max(next.h_max);
        self.stiff_from = self.stiff_from.or(next.stiff_from);
        next.open.into_iter().for_each(|stretch| self.leave_open(stretch));
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
    /// Steps tried again smaller after [`super::Failure::Recoverable`].
    pub smaller_step: usize,
    /// Steps tried again smaller after [`super::Failure::NotFinite`], or because the result, or its error, was not finite.
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
