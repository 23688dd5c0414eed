//! The same run once more, sharper, to see how far off the first is.

use std::time::Instant;

use super::error::SessionError;
use super::open::Session;
use super::run::{DEFAULT_METHOD, RunReport};
use crate::results::{Samples, Verified, significant};
use crate::scene::Dimension;

/// Ratio of the tolerances.
const SHARPER: f64 = 10.0;

impl Session {
    /// A session of the same scene at a tenth of the tolerance, or with steps of half the size where these are fixed; to be
    /// asked for before [`Session::run`]. The text says what is sharper.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn sharper(&self) -> Result<(Self, String), SessionError> {
        let mut scene = self.scene.clone();
        scene.simulation.t_start = self.opened_at;
        let name = scene.simulation.method.as_ref().map_or(DEFAULT_METHOD, |method| method.value.as_str());
        let needs_step = self.options.methods.make(name).is_some_and(|method| method.needs_fixed_step());
        let settings = &mut scene.simulation;
        // A method without error control takes the longest step it may.
        let fixed = settings.fixed_step.or(settings.max_step.filter(|_| needs_step));
        let how = match fixed {
            Some(step) => {
                settings.fixed_step = Some(0.5 * step);
                let unit = self.scene.units.factor(Dimension::TIME);
                let label = self.scene.units.label(Dimension::TIME);
                let [new, old] = [0.5 * step, step].map(|step| significant(step / unit, 6));
                format!("steps of {new} {label} instead of {old} {label}")
            }
            None => {
                settings.tolerance = Some(self.tolerance() / SHARPER);
                let [new, old] = [self.tolerance() / SHARPER, self.tolerance()].map(|number| significant(number, 3));
                format!("tolerance {new} instead of {old}")
            }
        };
        let mut sharper = Self::prepare(scene, Vec::new(), &self.catalog, &self.options, None, Instant::now())?;
        if let Some(state) = &self.gone_on_from {
            sharper.go_on_from(state.clone())?;
        }
        Ok((sharper, how))
    }
}

impl RunReport {
    /// Compares the outputs with those of the sharper run and notes the differences in the summary.
    pub fn verify(&mut self, how: String, sharper: Result<&RunReport, &SessionError>) {
        let names: Vec<String> = self.channels.iter().map(|channel| channel.name.clone()).collect();
        let own = Samples { times: &self.times, columns: &self.columns, names: &names };
        let (times, columns, problem): (&[f64], &[Vec<f64>], String) = match sharper {
            Ok(other) if other.summary.status.reached_end() => (&other.times, &other.columns, String::new()),
            Ok(other) => (&other.times, &other.columns, other.summary.reason.clone()),
            Err(error) => {
                let reason = error.diagnostics.first().map_or("it failed", |first| first.message.as_str());
                (&[], &[], reason.into())
            }
        };
        let other = Samples { times, columns, names: &names };
        self.summary.verified = Some(Verified::new(how, &own, &other, problem));
    }
}
