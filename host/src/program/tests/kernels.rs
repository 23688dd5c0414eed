//! Kernels: the straight line's numbers, bit for bit, with as many operations run and fewer written.

use super::*;
use crate::tests::{Prepared, prepared};

/// Both ways of writing the same outputs.
fn both(graph: &mut Graph, outputs: &[Node]) -> [Program; 2] {
    [Writing::Straight, Writing::Kernels].map(|writing| {
        graph.writing = writing;
        Program::compile(graph, outputs)
    })
}

/// Runs both and compares every bit.
#[track_caller]
fn assert_same(programs: &[Program; 2], inputs: &[f64], sets: &Sets) {
    let [straight, looped] = programs.each_ref().map(|program| {
        let mut found = vec![f64::NAN; program.output_count()];
        let mut workspace = program.workspace();
        // Twice: nothing may be left over from the run before.
        for _ in 0..2 {
            program.run(inputs, sets, &mut workspace, &mut found).unwrap();
        }
        found
    });
    for (k, (a, b)) in straight.iter().zip(&looped).enumerate() {
        assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "output {k}: {b:e} instead of {a:e}");
    }
}

/// The same random operations at every place of a row of places with three inputs each, some of them on numbers of the
/// neighbour, on a constant that differs from place to place and on the time; and sums over all places. Outputs are taken
/// anywhere.
fn repeated(random: &mut Random, places: usize, operations: usize) -> (Graph, Vec<Node>) {
    let mut owners = vec![NO_PLACE];
    owners.extend((0..3 * places).map(|k| (k / 3) as Place));
    let mut g = Graph::with_places(owners);
    let recipe: Vec<[usize; 5]> = (0..operations)
        .map(|k| [random.below(14), random.below(8 + k), random.below(8 + k), random.below(8 + k), 0])
        .collect();
    let time = g.input(0);
    let tick = g.sin(time);
    let mut outputs = Vec::new();
    let mut sum = g.constant(0.0);
    for place in 0..places {
        let input = |g: &mut Graph, place: usize, k: usize| g.input(1 + 3 * (place % places) + k);
        let mut nodes: Vec<Node> = (0..3).map(|k| input(&mut g, place, k)).collect();
        nodes.extend((0..2).map(|k| input(&mut g, place + 1, k)));
        nodes.extend([g.constant(0.5 + 0.1 * place as f64), g.constant(1.7), tick]);
        for [what, a, b, c, _] in &recipe {
            let (a, b, c) = (nodes[*a], nodes[*b], nodes[*c]);
            nodes.push(match what {
                0..=2 => g.add(a, b),
                3 | 4 => g.sub(a, b),
                5..=7 => g.mul(a, b),
                8 => g.div(a, b),
                9 => g.neg(a),
                10 => g.tanh(a),
                11 => g.cos(a),
                12 => g.powi(a, 3),
                _ => g.select(a, b, c, a),
            });
        }
        outputs.extend(nodes.iter().rev().step_by(3).copied());
        for node in nodes.iter().rev().take(2) {
            sum = g.add(sum, *node);
        }
    }
    outputs.extend([sum, tick, time]);
    (g, outputs)
}

#[test]
fn random_programs_with_kernels_give_the_same_bits() {
    let mut random = Random(31);
    let mut kernels = 0;
    for round in 0..60 {
        // Whole numbers of lanes, and not.
        let places = 8 + random.below(20);
        let (mut graph, outputs) = repeated(&mut random, places, 5 + 2 * round);
        let programs = both(&mut graph, &outputs);
        assert_eq!(programs[0].kernel_count(), 0);
        assert_eq!(programs[0].operations(), programs[1].operations());
        kernels += programs[1].kernel_count();
        for _ in 0..3 {
            assert_same(&programs, &random.vector(1 + 3 * places), &[]);
        }
    }
    assert!(kernels > 60, "{kernels}");
}

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

/// Machine code of what lies between the kernels.
#[cfg(feature = "jit")]
#[test]
fn machine_code_around_kernels_gives_the_same_bits() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    let mut random = Random(41);
    for round in 0..10 {
        let (mut graph, outputs) = repeated(&mut random, 11, 20 + 5 * round);
        let mut programs = both(&mut graph, &outputs);
        let code = MachineCode::compile(&programs[1], Maker::here(), &AtomicBool::new(false)).unwrap();
        programs[1].install(Arc::new(code));
        assert_same(&programs, &random.vector(1 + 3 * 11), &[]);
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
