//! What the contacts may not fall below: zero, or what of it is round-off.

use super::Simulation;
use super::contacts::LEAST_TOUCHING;
use crate::analysis::AnalysisError;

/// Share of the reactions of closed contacts below which one is none.
const NO_REACTION: f64 = 1e-9;
/// The same above which a closed contact that pulls is open.
const PULLS: f64 = 1e-6;

impl Simulation<'_> {
    /// Sets what the contacts may not fall below from here on. Gives closed ones that pull, and frictions that hold more than they
    /// can, the worst first.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn set_levels(&mut self, t: f64, state: &[f64]) -> Result<Option<usize>, AnalysisError> {
        let mut values = vec![0.0; self.stop_count()];
        if let Some(touch) = &mut self.touch {
            touch.levels.fill(0.0);
            touch.sizes.fill(1.0);
        }
        self.stop_values(t, state, &mut values)?;
        let (length, speed) = (self.scales.length, self.scales.speed_scale());
        let Some(touch) = &mut self.touch else { return Ok(None) };
        let reactions = touch.closed.iter().map(|k| values[*k].abs());
        let largest = reactions.fold(0.0, f64::max);
        let first = touch.first_friction();
        let pulls = touch.closed.iter().copied().filter(|k| values[*k] < -PULLS * largest);
        let worst = pulls.min_by(|a, b| values[*a].total_cmp(&values[*b]));
        for (k, value) in values.into_iter().enumerate() {
            let (size, noise) = match touch.closed.contains(&k) {
                true => (if largest > 0.0 { largest } else { 1.0 }, NO_REACTION),
                false if k >= first || touch.contacts.contacts()[k].of_velocities => (speed, LEAST_TOUCHING),
                // Wherever it starts, it may not get deeper.
                false => (length, f64::NEG_INFINITY),
            };
            touch.sizes[k] = size;
            touch.levels[k] = if value > noise * size { 0.0 } else { value.min(0.0) - noise * size };
        }
        Ok(worst)
    }
}
