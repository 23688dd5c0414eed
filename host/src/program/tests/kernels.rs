//! Kernels in the equations of scenes: the straight line's numbers, bit for bit, with as many operations run and fewer written.

#[path = "../../../testing/kernels.rs"]
mod twins;

use super::*;
use crate::tests::{Prepared, prepared};
use twins::{assert_same, both};

/// A chain of hinges with slanted axes.
fn chain(links: usize) -> String {
    let mut text = String::new();
    for k in 0..links {
        let before = if k == 0 { "ground".to_string() } else { format!("b{}", k - 1) };
        let x = k as f64;
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = 2\ninertia = [0.2, 0.3, 0.4]\nposition = [{}, 0, 0]\n\
             [[joint]]\nname = \"j{k}\"\ntype = \"hinge\"\nbodies = [\"{before}\", \"b{k}\"]\npoint = [{x}, 0, 0]\n\
             axis = [0.1, 0.2, 1]\n",
            x + 0.5
        );
    }
    text
}

/// Everything the right side and the projection of a scene ask for.
fn wanted(equations: &Equations) -> Vec<Node> {
    let mut nodes = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in &equations.rows {
        nodes.extend([row.value, row.time, row.gamma]);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    nodes
}

#[test]
fn a_scene_with_kernels_gives_the_same_bits() {
    let Prepared { model, mut equations, plan, .. } = prepared(&chain(37));
    let nodes = wanted(&equations);
    let programs = both(&mut equations.graph, &nodes);
    assert_eq!(programs[0].operations(), programs[1].operations());
    let mut random = Random(37);
    for _ in 0..4 {
        assert_same(&programs, &Motion::random(&plan.layout, &mut random).start, &model.sets);
    }
}

/// What is run grows with the scene, what is written for its bodies does not.
#[test]
fn work_is_proportional_to_the_number_of_bodies() {
    let [small, large] = [200, 400].map(|links| {
        let Prepared { mut equations, .. } = prepared(&chain(links));
        equations.graph.writing = Writing::Kernels;
        let mut nodes = equations.loads.clone();
        for row in &equations.rows {
            nodes.push(row.gamma);
            nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
        }
        let program = Program::compile(&equations.graph, &nodes);
        assert!(program.kernel_count() > 0);
        (program.operations(), program.written_operations())
    });
    // All but the first and the last joint do the same.
    let per_link = (large.0 - small.0) / 200;
    assert_eq!(large.0 - small.0, 200 * per_link);
    assert!(small.0.abs_diff(200 * per_link) < 2 * per_link, "{small:?} {large:?}");
    assert_eq!(small.1, large.1);
    assert!(small.1 < 8 * per_link, "{small:?} {per_link}");
}
