//! Whether elements that are called at run time are functions: steps are tried, rejected and repeated.

use super::error::SessionError;
use crate::diagnostics::{Diagnostic, codes};
use crate::model::Model;
use crate::program::{Expr, Graph, Node, Program};
use crate::scene::Scene;

/// How often they are asked the same.
const TIMES: usize = 3;

/// Refuses elements that give other results, the bits of them, when they are asked once more. Those that fail are left to the run.
pub(super) fn refuse_whims(scene: &Scene, model: &Model, graph: &Graph, inputs: &[f64]) -> Result<(), SessionError> {
    if graph.calls.is_empty() {
        return Ok(());
    }
    let called = |node: &Node| matches!(graph.expr(*node), Expr::Call { .. });
    let results: Vec<Node> = graph.nodes().filter(called).collect();
    let program = Program::compile(graph, &results);
    let mut workspace = program.workspace();
    let mut answer = || -> Option<Vec<u64>> {
        let mut values = vec![0.0; results.len()];
        program.run(inputs, &model.sets, &mut workspace, &mut values).ok()?;
        Some(values.into_iter().map(f64::to_bits).collect())
    };
    let Some(first) = answer() else { return Ok(()) };
    for _ in 1..TIMES {
        let Some(again) = answer() else { return Ok(()) };
        let Some(other) = first.iter().zip(&again).position(|(one, other)| one != other) else { continue };
        let Expr::Call { call, .. } = graph.expr(results[other]) else { continue };
        let call = &graph.calls[call as usize];
        let is_it = |e: &&crate::model::Instance| e.set == call.set && e.index == call.instance;
        let Some(element) = model.elements.iter().find(is_it) else { continue };
        let message = format!(
            "`{}` ({}/{}) gives different results for the same arguments: {:e}, then {:e}",
            element.name,
            element.library,
            element.class.name,
            f64::from_bits(first[other]),
            f64::from_bits(again[other])
        );
        let help = "equations are functions of their arguments; what an element remembers changes in `accept`";
        return Err(SessionError::one(&scene.source, Diagnostic::error(codes::NOT_REPEATABLE, message).help(help)));
    }
    Ok(())
}
