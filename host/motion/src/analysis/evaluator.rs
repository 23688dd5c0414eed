//! [`Evaluator`]: a program with its scratch and results.

use super::formulation::AnalysisError;
use crate::program::{Graph, Node, Program, Sets, Source, Used, Wired, Workspace, condense};

/// See the module documentation.
pub struct Evaluator {
    program: Wired,
    workspace: Workspace,
    outputs: Vec<f64>,
}

impl Evaluator {
    /// Prepares the evaluation of nodes.
    #[must_use]
    pub fn new(graph: &Graph, nodes: &[Node]) -> Self {
        Self::of(Program::compile(graph, nodes).into(), nodes.len())
    }

    /// Prepares the evaluation of nodes some of whose inputs are read from a vector of entries ([`Evaluator::run_at`]): `entry_of`
    /// gives the entry of an input slot, if it is one.
    #[must_use]
    pub fn of_entries(graph: &Graph, nodes: &[Node], entry_of: impl Fn(usize) -> Option<usize>) -> Self {
        let outputs: Vec<Source> = (0..nodes.len()).map(Source::Output).collect();
        let wired = Wired::new(&Program::compile(graph, nodes), entry_of, &outputs, &[]);
        Self::of(wired.expect("nothing is kept"), nodes.len())
    }

    fn of(program: Wired, outputs: usize) -> Self {
        Self { workspace: program.workspace(), outputs: vec![0.0; outputs], program }
    }

    /// Prepares the evaluation of nodes by as few operations as can be found.
    #[must_use]
    pub fn condensed(graph: &Graph, nodes: &[Node]) -> Self {
        match condense(graph, nodes) {
            Some((graph, nodes)) => Self::new(&graph, &nodes),
            None => Self::new(graph, nodes),
        }
    }

    /// Evaluates. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn run(&mut self, inputs: &[f64], sets: &Sets) -> Result<&[f64], AnalysisError> {
        self.run_at((inputs, inputs), sets)
    }

    /// The same with inputs that are given, and entries. `[hot, no allocation]`
    ///
    /// # Errors
    /// As for [`Evaluator::run`].
    pub fn run_at(&mut self, (given, entries): (&[f64], &[f64]), sets: &Sets) -> Result<&[f64], AnalysisError> {
        self.program
            .run((given, entries), sets, &mut self.workspace, &mut self.outputs)
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
        self.program.used(&self.workspace, spare)
    }

    /// The program, for its counts.
    #[must_use]
    pub fn program(&self) -> &Program {
        self.program.program()
    }
}
