//! [`Speeds`]: how fast frictions slide in their directions.

use std::ops::Range;

use crate::analysis::{AnalysisError, Evaluator, Formulation};
use crate::program::{Equations, Friction, Graph, Node, Rewriting, Used};

/// Programs for the speeds of frictions. Few of many slide at a time: where their speeds have little in common, each has a program of
/// its own, which is made when it slides for the first time.
pub(super) struct Speeds {
    graph: Graph,
    nodes: Vec<Node>,
    /// Whether the graph takes the inputs of the formulation, not those of the working form.
    own: bool,
    /// One for each friction, or one for all of them.
    parts: Vec<Option<Evaluator>>,
}

impl Speeds {
    pub(super) fn new(formulation: &dyn Formulation, equations: &Equations, nodes: &[Node]) -> Self {
        let carried = formulation.carry(equations, nodes);
        let own = carried.is_some();
        let (mut graph, nodes) = carried.unwrap_or_else(|| {
            let mut graph = Graph::default();
            let nodes = Rewriting::new(&equations.graph, &mut graph, Default::default()).carry_all(&mut graph, nodes);
            (graph, nodes)
        });
        graph.rest();
        let parts = if graph.are_apart(&nodes) { nodes.len() } else { 1 };
        Self { graph, nodes, own, parts: (0..parts).map(|_| None).collect() }
    }

    /// The frictions of a part.
    fn of_part(&self, part: usize) -> Range<usize> {
        if self.parts.len() == 1 { 0..self.nodes.len() } else { part..part + 1 }
    }

    /// The speeds at a state, by friction; of those that slide into no direction they are zero. `inputs` is room for those of the
    /// working form.
    pub(super) fn at(
        &mut self,
        formulation: &mut dyn Formulation,
        inputs: &mut Vec<f64>,
        (frictions, discrete): (&[Friction], &[f64]),
        (t, state): (f64, &[f64]),
        speeds: &mut [f64],
    ) -> Result<(), AnalysisError> {
        speeds.fill(0.0);
        let slides = |one: &Friction| discrete[one.direction_at..][..one.rows.len()].iter().any(|part| *part != 0.0);
        let mut is_observed = self.own;
        for part in 0..self.parts.len() {
            let own = self.of_part(part);
            if !frictions[own.clone()].iter().any(slides) {
                continue;
            }
            let (graph, nodes) = (&self.graph, &self.nodes[own.clone()]);
            let program = self.parts[part].get_or_insert_with(|| match self.own {
                true => Evaluator::of_entries(graph, nodes, |slot| formulation.entry_of(slot)),
                false => Evaluator::new(graph, nodes),
            });
            if !std::mem::replace(&mut is_observed, true) {
                inputs.clear();
                inputs.extend_from_slice(formulation.observe(t, state, false)?.inputs);
            }
            let found = match self.own {
                true => formulation.run_own(t, state, program)?,
                false => program.run(inputs, formulation.sets())?,
            };
            speeds[own].copy_from_slice(found);
        }
        Ok(())
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        self.parts.iter_mut().flatten().map(|program| program.used(false))
    }
}
