//! Accelerations of [`JointForm`], and which of its engines is trusted with them.

use super::*;

/// Coordinates of a tree beyond which its mass matrix is not written down for a factorisation of the whole, where elimination
/// body by body comes upon a pivot that is not positive: millions of entries.
const MOST_TO_FACTOR: usize = 3000;

/// Step of difference quotients, as a share of the largest of what is differentiated along.
const DIFFERENCE: f64 = 1e-7;

impl JointForm {
    /// Accelerations, rates of states and power at the inputs' state.
    pub(super) fn solve(&mut self) -> Result<Used, AnalysisError> {
        let columns = self.motion.coordinates.columns;
        if let Some(regular) = &mut self.regular {
            if let Some(coupling) = &mut self.coupling {
                coupling.begin(&mut self.motion.inputs);
            }
            regular.motion.run(&self.motion.inputs, &self.bodies.sets)?;
            let ratio = pivot_ratio(regular.motion.outputs(), columns, &regular.squares);
            if self.is_trusted(ratio)? {
                self.agree()?;
                if let Some(regular) = &self.regular {
                    let outputs = regular.motion.outputs();
                    self.motion.accelerations.copy_from_slice(&outputs[..columns]);
                    let from = columns + regular.rows.len();
                    self.motion.rates.copy_from_slice(&outputs[from..from + self.motion.layout.states + 1]);
                    return Ok(Used::Regular);
                }
            }
        }
        if self.regular.is_some() {
            self.refuse_far_off()?;
            self.motion.counters.rank_safe += 1;
        }
        self.write_mass()?;
        self.safe.factor(&self.motion.inputs, &self.bodies.sets, &mut self.motion.counters)?;
        match &self.equations.dependence {
            Some(_) => self.agree_safely()?,
            None => self.safe.solve_motion()?,
        }
        self.safe.accept()?;
        self.motion.accelerations.copy_from_slice(&self.safe.accelerations);
        self.motion.rates.copy_from_slice(self.safe.loads().1);
        // Constraints that depend on time do work too: the power of -Phi_q^T lambda is lambda . Phi_t.
        let times = self.safe.function(Function::Time).iter();
        let driven: f64 = times.zip(&self.safe.multipliers).map(|(time, lambda)| time * lambda).sum();
        self.motion.rates[self.motion.layout.states] += driven;
        Ok(Used::Safe)
    }

    /// The rates of a state as [`passage::rates`] finds them, straight from the regular engine's results; `false` where that takes
    /// more than them.
    pub(in crate::analysis) fn plain_rates(
        &mut self,
        t: f64,
        state: &[f64],
        rates: &mut [f64],
    ) -> Result<bool, AnalysisError> {
        let (Some(direct), Some(regular)) = (&mut self.direct, &self.regular) else { return Ok(false) };
        if self.motion.careful {
            return Ok(false);
        }
        self.motion.inputs[Layout::TIME] = t;
        let sound = (self.least_health, &regular.squares[..]);
        let found = direct.rates((&self.motion.inputs, state), &self.bodies.sets, sound, rates)?;
        self.motion.counters.evaluations += u64::from(found);
        Ok(found)
    }

    /// See [`Formulation::traces`].
    pub(super) fn own_traces(&self) -> Traces {
        let Traces { guesses: [in_bodies, _], counters: [of_bodies, _], .. } = self.bodies.traces();
        Traces {
            guesses: [self.coupling.as_ref().and_then(Coupling::guess), in_bodies],
            counters: [self.motion.counters, of_bodies],
            look: Some(self.last_look()),
        }
    }

    /// See [`Formulation::forget_since`].
    pub(super) fn follow(&mut self, traces: &Traces) {
        let Traces { guesses: [own, in_bodies], counters: [counters, of_bodies], look } = traces;
        if let Some(coupling) = &mut self.coupling {
            coupling.start_from(own);
        }
        self.motion.counters = *counters;
        if let Some(look) = look {
            (self.last, self.trusted, self.is_look_due) = (look.0, look.1, false);
        }
        self.bodies.forget_since(&Traces {
            guesses: [in_bodies.clone(), None],
            counters: [*of_bodies, Counters::default()],
            look: None,
        });
    }

    /// Runs the regular engine until forces agree with the reactions and accelerations that they depend on. It was run once.
    pub(super) fn agree(&mut self) -> Result<(), AnalysisError> {
        let (Some(dependence), Some(coupling), Some(regular)) =
            (&self.equations.dependence, &mut self.coupling, &mut self.regular)
        else {
            return Ok(());
        };
        let from = self.motion.coordinates.columns + regular.rows.len() + self.motion.layout.states + 1;
        let (n, solved) = (dependence.slots.len(), dependence.solved.len());
        loop {
            let (found, rest) = regular.motion.outputs()[from..].split_at(solved);
            dependence.solved.iter().zip(found).for_each(|(slot, value)| self.motion.inputs[*slot] = *value);
            let slopes = |_: &mut [f64], matrix: &mut [f64]| {
                matrix.copy_from_slice(&rest[..n * n]);
                Ok(())
            };
            if coupling.advance(&mut self.motion.inputs, &mut self.motion.counters, slopes)? {
                return Ok(());
            }
            regular.motion.run(&self.motion.inputs, &self.bodies.sets)?;
        }
    }

    /// The same by the rank-safe engine, with difference quotients.
    pub(super) fn agree_safely(&mut self) -> Result<(), AnalysisError> {
        let (Some(dependence), Some(coupling)) = (&self.equations.dependence, &mut self.coupling) else {
            return Ok(());
        };
        let found = &dependence.found;
        let dependent = self.dependent.get_or_insert_with(|| Evaluator::new(&found.graph, &found.nodes));
        let (safe, sets) = (&mut self.safe, &self.bodies.sets);
        let (first, rows) = (self.motion.coordinates.acceleration_slot, self.motion.layout.multiplier_slot());
        // F(z) into the inputs, for the z that they hold.
        let mut solve = |inputs: &mut [f64]| -> Result<(), AnalysisError> {
            safe.terms.run(inputs, sets)?;
            safe.solve_motion()?;
            inputs[first..first + safe.accelerations.len()].copy_from_slice(&safe.accelerations);
            for (row, value) in safe.rows.iter().zip(&safe.multipliers) {
                inputs[rows + row] = *value;
            }
            let values = dependent.run(inputs, sets)?;
            dependence.solved.iter().zip(values).for_each(|(slot, value)| inputs[*slot] = *value);
            Ok(())
        };
        coupling.begin(&mut self.motion.inputs);
        loop {
            let guess: Vec<f64> = dependence.slots.iter().map(|slot| self.motion.inputs[*slot]).collect();
            solve(&mut self.motion.inputs)?;
            let steps = coupling.steps(&self.motion.inputs, DIFFERENCE);
            let slopes = |inputs: &mut [f64], matrix: &mut [f64]| -> Result<(), AnalysisError> {
                let mut there = inputs.to_vec();
                for ((k, step), column) in steps.iter().enumerate().zip(matrix.chunks_exact_mut(guess.len())) {
                    dependence.slots.iter().zip(&guess).for_each(|(slot, z)| there[*slot] = *z);
                    there[dependence.slots[k]] += step;
                    solve(&mut there)?;
                    for (slot, entry) in dependence.slots.iter().zip(column) {
                        *entry = (there[*slot] - inputs[*slot]) / step;
                    }
                }
                Ok(())
            };
            if coupling.advance(&mut self.motion.inputs, &mut self.motion.counters, slopes)? {
                break;
            }
        }
        // Rates of states and power may depend on more than was found in this way.
        solve(&mut self.motion.inputs)
    }

    /// Whether the regular engine's solution for a pivot ratio is trusted. Far from singular positions a ratio that has not
    /// fallen by far is enough; where it has, or next to them, what counts is what the masses have no part in, and how many digits
    /// elimination keeps.
    pub(super) fn is_trusted(&mut self, ratio: f64) -> Result<bool, AnalysisError> {
        if self.motion.careful {
            return Ok(self.trusted);
        }
        Ok(ratio >= self.least_health || self.safe.rows.is_empty() || self.look()?)
    }

    /// Looks at the regular engine in the position of the inputs; gives whether it is to be trusted there.
    pub(super) fn look(&mut self) -> Result<bool, AnalysisError> {
        let Some(regular) = &mut self.regular else { return Ok(false) };
        regular.velocity.run(&self.motion.inputs, &self.bodies.sets)?;
        self.is_look_due = true;
        Ok(self.take_look())
    }

    /// The look where velocities were corrected last, taken if it is due: whether the regular engine is trusted there.
    pub(super) fn take_look(&mut self) -> bool {
        (self.last, self.trusted) = self.last_look();
        self.is_look_due = false;
        self.trusted
    }

    /// [`JointForm::last`] and [`JointForm::trusted`], as they are or will be.
    fn last_look(&self) -> (Look, bool) {
        match self.regular.as_ref().filter(|_| self.is_look_due) {
            Some(regular) => {
                let look = regular.look(self.motion.coordinates.columns);
                let sound = look.kept >= ACCURATE && look.independence >= SICK_SHARE * self.first.independence;
                (look, sound)
            }
            None => (self.last, self.trusted),
        }
    }

    /// Makes the rank-safe engine ready for a tree whose mass matrix is not written yet.
    pub(super) fn write_mass(&mut self) -> Result<(), AnalysisError> {
        if self.equations.mass_is_written() {
            return Ok(());
        }
        if self.motion.coordinates.columns > MOST_TO_FACTOR || self.motion.inputs.iter().any(|input| !input.is_finite())
        {
            return Err(AnalysisError::NotFinite { what: "an acceleration".into() });
        }
        self.equations.write_mass();
        self.safe = Safe::new(&self.equations, &[], &[], self.motion.length, MOTION_RANK_TOLERANCE)?;
        self.safe.solver.set_rank_limit(self.motion.at_start.rank);
        Ok(())
    }
}

/// [`least_health`] before the first step.
pub(super) fn least_health_at_start(rows: &[usize], start: &Look) -> f64 {
    if rows.is_empty() { SICK_TREE } else { least_health(start, start) }
}

/// The pivot ratio below which a closer look is taken, from the regular engine at the start and where it was last: a ratio may
/// have fallen because of masses.
pub(super) fn least_health(first: &Look, last: &Look) -> f64 {
    if last.kept < ACCURATE {
        return f64::INFINITY;
    }
    SICK_SHARE * first.ratio.min(last.ratio / (APPROACH * APPROACH))
}
