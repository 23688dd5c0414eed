//! [`Evaluator`]: a program with its scratch and results.

use super::formulation::AnalysisError;
use crate::program::{Graph, Node, Program, Sets, Used, Workspace, condense};

/// See the module documentation.
pub struct Evaluator {
    program: Program,
    workspace: Workspace,
    outputs: Vec<f64>,
}

impl Evaluator {
    /// Prepares the evaluation of nodes.
    #[must_use]
    pub fn new(graph: &Graph, nodes: &[Node]) -> Self {
        let program = Program::compile(graph, nodes);
        Self { workspace: program.workspace(), outputs: vec![0.0; nodes.len()], program }
    }

    /// Prepares the evaluation of nodes by as few operations as can be found.
    #[must_use]
    pub fn condensed(graph: &Graph, nodes: &[Node]) -> Self {
        let (graph, nodes) = condense(graph, nodes);
        Self::new(&graph, &nodes)
    }

    /// Evaluates. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn run(&mut self, inputs: &[f64], sets: &Sets) -> Result<&[f64], AnalysisError> {
        self.program
            .run(inputs, sets, &mut self.workspace, &mut self.outputs)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
        Ok(&self.outputs)
    }

    /// What came out last.
    #[must_use]
    pub fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    /// The program, with how often it was run.
    pub fn used(&mut self, spare: bool) -> Used<'_> {
        Used::new(&mut self.program, self.workspace.runs(), spare)
    }

    /// The program, for its counts.
    #[must_use]
    pub fn program(&self) -> &Program {
        &self.program
    }
}
