//! [`Part`]: a program of a simulation, in the inputs that it takes.

use crate::analysis::{AnalysisError, Evaluator, Formulation, Imbalance, SolvedProgram};
use crate::plan::Layout;
use crate::program::{Equations, Node, Used};

/// A program, and whether accelerations or multipliers must be known for it.
pub(in crate::session) struct Part {
    pub(super) evaluator: Evaluator,
    pub(super) needs_dynamics: bool,
    /// Whether it takes the inputs of the formulation, not those of the working form.
    pub(super) own: bool,
    /// The same with accelerations and multipliers found by the formulation itself, where it can; what it could not do last is
    /// done by way of the working form.
    pub(super) solved: Option<Box<SolvedProgram>>,
    pub(super) is_solved: bool,
    /// How well the accelerations and multipliers that it took last meet the equations of motion.
    pub(super) imbalance: Imbalance,
}

impl Part {
    pub(super) fn new(equations: &Equations, nodes: &[Node], layout: &Layout) -> Self {
        let evaluator = Evaluator::new(&equations.graph, nodes);
        let needs_dynamics = evaluator.program().uses_inputs(layout.acceleration_slot()..layout.inputs());
        Self { needs_dynamics, ..Self::of(evaluator, false) }
    }

    /// One that no accelerations or multipliers must be known for.
    pub(super) fn of(evaluator: Evaluator, own: bool) -> Self {
        let imbalance = Imbalance::default();
        Self { evaluator, needs_dynamics: false, own, solved: None, is_solved: false, imbalance }
    }

    /// In the coordinates of the formulation, where that can be.
    pub(in crate::session) fn near(
        formulation: &dyn Formulation,
        equations: &Equations,
        nodes: &[Node],
        layout: &Layout,
    ) -> Self {
        match formulation.own_program(equations, nodes) {
            Some(evaluator) => Self::of(evaluator, true),
            None => {
                let mut part = Self::new(equations, nodes, layout);
                if part.needs_dynamics {
                    part.solved = formulation.solved_program(equations, nodes).map(Box::new);
                }
                part
            }
        }
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        let spare = self.solved.is_some();
        std::iter::once(self.evaluator.used(spare)).chain(self.solved.iter_mut().map(|solved| solved.used()))
    }

    /// What came out last.
    pub(super) fn outputs(&self) -> &[f64] {
        match &self.solved {
            Some(solved) if self.is_solved => solved.outputs(),
            _ => self.evaluator.outputs(),
        }
    }

    pub(super) fn run(
        &mut self,
        inputs: &[f64],
        sets: &[Box<dyn element_api::ElementSet>],
    ) -> Result<&[f64], AnalysisError> {
        self.evaluator.run(inputs, sets)
    }

    /// Its results at a state; `inputs` is room for those of the working form.
    pub(super) fn at(
        &mut self,
        formulation: &mut dyn Formulation,
        inputs: &mut Vec<f64>,
        t: f64,
        state: &[f64],
    ) -> Result<&[f64], AnalysisError> {
        self.is_solved = false;
        if let Some(solved) = &mut self.solved
            && let Some(imbalance) = formulation.run_solved(t, state, solved)?
        {
            (self.imbalance, self.is_solved) = (imbalance, true);
            return Ok(self.outputs());
        }
        if self.needs_dynamics || !self.own {
            inputs.clear();
            let observed = formulation.observe(t, state, self.needs_dynamics)?;
            inputs.extend_from_slice(observed.inputs);
            self.imbalance = observed.imbalance;
        }
        if self.own {
            return formulation.run_own(t, state, &mut self.evaluator);
        }
        self.evaluator.run(inputs, formulation.sets())
    }
}
