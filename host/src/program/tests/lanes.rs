//! Lanes of the equations of scenes: each one the scalar interpreter's numbers, bit for bit, whatever the others hold.

#[path = "../../../testing/lanes.rs"]
mod twins;

use super::*;
use crate::tests::{Prepared, prepared, scenes};
use twins::assert_same;

/// Everything the equations of a scene contain.
#[test]
fn programs_of_scenes_give_the_same_bits_in_every_lane() {
    for text in [scenes::tangle(), scenes::four_bar(1.1), scenes::four_bar(0.7)] {
        let Prepared { equations, plan, .. } = prepared(&text);
        let program = Program::compile(&equations.graph, &every_output(&equations));
        let mut random = Random(37);
        assert_same::<4>(&program, || Motion::random(&plan.layout, &mut random).start);
        assert_same::<8>(&program, || Motion::random(&plan.layout, &mut random).start);
    }
}

#[test]
fn opaque_elements_have_no_lanes() {
    let Prepared { equations, .. } = prepared(&scenes::opaque_tangle());
    let program = Program::compile(&equations.graph, &every_output(&equations));
    assert!(program.calls() > 0 && program.lanes::<4>().is_none());
}

fn every_output(equations: &Equations) -> Vec<Node> {
    let mut nodes = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in &equations.rows {
        nodes.extend([row.value, row.time, row.gamma]);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    nodes
}
