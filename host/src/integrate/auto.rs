//! The choice between an explicit and an implicit method, made while integrating.

use super::dop853::dop853;
use super::explicit::{End, Explicit};
use super::radau5::Radau5;
use super::run::Run;
use super::{IntegrateError, Integrator, Options, Outcome, Span, System};

/// [`super::dop853()`] until stability limits its steps, [`Radau5`] from there on; [`super::Counters::stiff_from`] says
/// where. There is no way back.
#[derive(Debug, Clone)]
pub struct Auto {
    explicit: Explicit,
    implicit: Radau5,
}

impl Default for Auto {
    fn default() -> Self {
        Self { explicit: dop853(), implicit: Radau5::default() }
    }
}

impl Integrator for Auto {
    fn name(&self) -> &'static str {
        "auto"
    }

    fn may_use_jacobian(&self) -> bool {
        true
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        let mut run = Run::new(system, y, span, options)?;
        let result = match self.explicit.whole_run(&mut run, y, true) {
            Ok(End::Completed) => Ok(()),
            Ok(End::Stiff(step)) => self.implicit.continue_run(&mut run, y, Some(step)),
            Err(trouble) => Err(trouble),
        };
        run.end(result)
    }
}
