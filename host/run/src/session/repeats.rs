//! Whether elements that are called at run time are functions: steps are tried, rejected and repeated.

use super::error::SessionError;
use crate::diagnostics::{Diagnostic, codes};
use crate::model::Model;
use crate::program::{Expr, Graph, Node, Program};
use crate::scene::Scene;

/// How often they are asked the same; the first answer does not count: what iterates begins the next time where it ended.
const TIMES: usize = 4;
/// Differences below this share of the largest result of a call are what iterations leave.
const SAME: f64 = 1e-9;
/// Results below this, SI, are nothing.
const NOTHING: f64 = 1e-12;

/// Refuses elements that give other results when they are asked once more. Those that fail are left to the run.
pub(super) fn refuse_whims(scene: &Scene, model: &Model, graph: &Graph, inputs: &[f64]) -> Result<(), SessionError> {
    if graph.calls.is_empty() {
        return Ok(());
    }
    let called = |node: Node| match graph.expr(node) {
        Expr::Call { call, .. } => Some((node, call as usize)),
        _ => None,
    };
    let (results, calls): (Vec<Node>, Vec<usize>) = graph.nodes().filter_map(called).unzip();
    let program = Program::compile(graph, &results);
    let mut workspace = program.workspace();
    let mut answer = || -> Option<Vec<f64>> {
        let mut values = vec![0.0; results.len()];
        program.run(inputs, &model.sets, &mut workspace, &mut values).ok()?;
        Some(values)
    };
    let (Some(_), Some(first)) = (answer(), answer()) else { return Ok(()) };
    let mut largest = vec![NOTHING; graph.calls.len()];
    for (value, call) in first.iter().zip(&calls).filter(|(value, _)| value.is_finite()) {
        largest[*call] = value.abs().max(largest[*call]);
    }
    for _ in 2..TIMES {
        let Some(again) = answer() else { return Ok(()) };
        let differs = |k: &usize| {
            let (one, other) = (first[*k], again[*k]);
            one.is_nan() != other.is_nan() || (one - other).abs() > SAME * largest[calls[*k]]
        };
        let Some(other) = (0..results.len()).find(differs) else { continue };
        let call = &graph.calls[calls[other]];
        let is_it = |e: &&crate::model::Instance| e.set == call.set && e.index == call.instance;
        let Some(element) = model.elements.iter().find(is_it) else { continue };
        let message = format!(
            "`{}` ({}/{}) gives different results for the same arguments: {:e}, then {:e}",
            element.name, element.library, element.class.name, first[other], again[other]
        );
        let help = "equations are functions of their arguments; what an element remembers changes in `accept`";
        return Err(SessionError::one(&scene.source, Diagnostic::error(codes::NOT_REPEATABLE, message).help(help)));
    }
    Ok(())
}
