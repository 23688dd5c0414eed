//! Rows that are a vector in the axes of a frame, written without the frame.
//!
//! A^T d = 0 and d = 0 are the same for a rotation A, but the derivatives of the latter are shorter: those of A come with d
//! and its rate, which vanish where the rows hold. Multipliers turn with the rows.

use std::sync::Arc;

use super::equations::{Equations, bodies_of};
use super::kinematics::frame_nodes;
use crate::model::Model;
use crate::plan::{Layout, SpanningTree};

/// Replaces three rows that are the vector between the origins of two of an element's frames, in the axes of one of them, by
/// that vector in ground axes; gives the number of such vectors. The rows of the tree's joints stay, and so do those in axes
/// that do not move.
pub(super) fn turn_rows(equations: &mut Equations, model: &Model, layout: &Layout, tree: &SpanningTree) -> usize {
    let mut turned = 0;
    let used = tree.used(model.elements.len());
    for (number, element) in model.elements.iter().enumerate() {
        let rows = layout.rows_of(number);
        if rows.len() < 3 || used[number] {
            continue;
        }
        let bodies = bodies_of(&element.markers);
        let frames: Vec<_> =
            element.markers.iter().map(|marker| frame_nodes(&mut equations.graph, marker, &equations.bodies)).collect();
        for first in rows.start..=rows.end - 3 {
            let values = [0, 1, 2].map(|k| equations.rows[first + k].value);
            let mut found = None;
            for i in frames.iter().filter(|frame| frame.body.is_some()) {
                for (from, to) in frames.iter().flat_map(|from| frames.iter().map(move |to| (from, to))) {
                    let d = equations.graph.sub3(to.position, from.position);
                    if equations.graph.apply_transposed(&i.rotation, d) == values {
                        found = Some(d);
                    }
                }
            }
            if let Some(d) = found.filter(|d| *d != values) {
                let straight = equations.traced_rows(&d, &bodies);
                Arc::make_mut(&mut equations.rows).splice(first..first + 3, straight);
                turned += 1;
            }
        }
    }
    turned
}
