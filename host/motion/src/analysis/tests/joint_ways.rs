//! Joint coordinates written in several ways, which must give the same numbers.

use super::joint::{all_scenes, branches, chain, joint_plan};
use super::*;
use crate::analysis::joint_engines::{Solving, Unrolled};
use crate::program::{JointEquations, Projecting};

#[test]
fn composites_give_the_mass_matrix_and_the_loads_of_all_pairs() {
    let mut random = Random(409);
    for text in all_scenes().into_iter().chain([chain(6)]) {
        let (Prepared { model, equations, plan, .. }, planned) = joint_plan(&text);
        let columns = planned.equations.coordinates.columns;
        let whole = |(how, far): (Projecting, f64)| {
            let written = JointEquations::build_about(&equations, &model, &plan.layout, &planned.tree, how, far);
            let mut nodes = written.loads.clone();
            nodes.extend(written.mass.iter().map(|(_, _, node)| *node));
            let places: Vec<(usize, usize)> = written.mass.iter().map(|(row, column, _)| (*row, *column)).collect();
            (Evaluator::new(&written.graph, &nodes), places)
        };
        let (one, own) = (f64::INFINITY, 0.0);
        let mut ways = [
            (Projecting::Pairs, one),
            (Projecting::Composites, one),
            (Projecting::Composites, own),
            (Projecting::Fewest, one),
        ]
        .map(whole);
        for _ in 0..5 {
            let inputs = random.vector(planned.equations.coordinates.input_count);
            let found: Vec<Vec<f64>> = ways
                .iter_mut()
                .map(|(evaluator, places)| {
                    let outputs = evaluator.run(&inputs, &model.sets).unwrap();
                    let mut dense = vec![0.0; columns * (columns + 1)];
                    dense[..columns].copy_from_slice(&outputs[..columns]);
                    for ((row, column), value) in places.iter().zip(&outputs[columns..]) {
                        dense[columns * (row + 1) + column] = *value;
                    }
                    dense
                })
                .collect();
            for other in &found[1..] {
                let off = difference(&found[0], other);
                assert!(off < 1e-12, "{off:e}");
            }
        }
    }
}

#[test]
fn accelerations_body_by_body_are_those_of_elimination() {
    let mut random = Random(411);
    for text in [branches(), chain(6), chain(1)] {
        let (Prepared { model, equations, plan, .. }, planned) = joint_plan(&text);
        assert!(planned.rows.is_empty());
        let how = Projecting::Fewest;
        let solve = |(solving, far): (Solving, f64)| {
            let written = JointEquations::build_about(&equations, &model, &plan.layout, &planned.tree, how, far);
            Unrolled::new(&written, &[], Default::default(), 1.0, solving).motion
        };
        let mut eliminated = solve((Solving::Eliminated, f64::INFINITY));
        let mut ways = [f64::INFINITY, 0.0].map(|far| solve((Solving::Articulated, far)));
        for _ in 0..10 {
            let inputs = random.vector(planned.equations.coordinates.input_count);
            let expected = eliminated.run(&inputs, &model.sets).unwrap().to_vec();
            for articulated in &mut ways {
                let found = articulated.run(&inputs, &model.sets).unwrap();
                // Pivots depend on the order.
                let n = found.len() - planned.equations.coordinates.columns;
                let off = difference(&found[..n], &expected[..n]);
                assert!(off < 1e-11, "{off:e}");
                assert!(found[n..].iter().all(|pivot| *pivot > 0.0));
                let determinant = |pivots: &[f64]| pivots.iter().product::<f64>();
                let (ours, theirs) = (determinant(&found[n..]), determinant(&expected[n..]));
                assert!((ours / theirs - 1.0).abs() < 1e-10, "{ours} {theirs}");
            }
        }
    }
}
