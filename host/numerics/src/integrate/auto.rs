//! The choice between an explicit and an implicit method, made while integrating.

use super::Integrator;
use super::StopReason;
use super::dop853::dop853;
use super::explicit::Explicit;
use super::radau5::Radau5;
use super::rivals::{Defender, FEWEST_HITS, Stint, Suspect, Suspicion};
use super::run::{Run, Trouble};

/// How much harder it is to suspect stiffness after an implicit method has proved no better.
const PATIENCE: u32 = 4;

/// [`super::dop853()`] where it is cheaper, [`Radau5`] where that is.
///
/// Steps that are short for what the solution does make the explicit method suspect (`Suspicion`); the implicit one then
/// has to prove that it gets on at less cost, and keeps having to (`Defender`). Cost is counted, not timed, so that runs
/// are reproducible. [`super::Counters::stiff_from`] says when the implicit method first took over,
/// [`super::Counters::switches`] how often the methods changed.
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

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        let mut hits = FEWEST_HITS;
        let mut first_step = run.options.first_step;
        loop {
            let suspicion = Suspicion::new(run, hits);
            let suspect = match self.explicit.whole_run(run, y, first_step, Some(suspicion)) {
                Ok(Some(suspect)) => suspect,
                Ok(None) => return Ok(()),
                // Where decay is faster than time can be told apart, no explicit step is stable.
                Err(Trouble::Stop(StopReason::StepTooSmall { .. })) => Suspect::hopeless(run),
                Err(trouble) => return Err(trouble),
            };
            run.counters.stiff_from.get_or_insert(run.t);
            run.counters.switches += 1;
            let defender = Defender::new(run, suspect);
            let stint = Stint::new(run, suspect);
            let Some(step) = self.implicit.whole_run(run, y, Some(suspect.step), Some(defender))? else {
                return Ok(());
            };
            run.counters.switches += 1;
            first_step = Some(step);
            // After one that paid, what is to be suspected next is another part of the motion.
            hits = if stint.paid(run) { FEWEST_HITS } else { hits.saturating_mul(PATIENCE) };
        }
    }
}
