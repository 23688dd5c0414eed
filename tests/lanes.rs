//! Programs of the scenes of this repository, evaluated in lanes: the bits of the scalar interpreter in each lane.

use std::fs;

use odyn::analysis::start_inputs;
use odyn::program::{Node, Program};
use odyn::session::Session;

use crate::support::{options, root};

const LANES: usize = 8;

/// Everything that a scene's equations contain, at its start and at neighbours of it.
#[track_caller]
fn assert_same_bits(session: &Session) {
    let equations = &session.equations;
    let mut nodes: Vec<Node> = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in &equations.rows {
        nodes.extend([row.value, row.time, row.gamma]);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    let program = Program::compile(&equations.graph, &nodes);
    let mut lanes = program.lanes::<LANES>().expect("no scene here has opaque elements");
    let start = start_inputs(&session.plan.layout, session.scene.simulation.t_start, &session.assembly);
    // Far enough from each other that no lane could stand for its neighbour.
    let value = |k: usize, lane: usize| start[k] + 1e-3 * ((k * 7 + lane * 13) % 29) as f64;
    let inputs: Vec<[f64; LANES]> = (0..start.len()).map(|k| std::array::from_fn(|lane| value(k, lane))).collect();
    let mut found = vec![[f64::NAN; LANES]; nodes.len()];
    program.run_lanes(&inputs, &mut lanes, &mut found);
    let (mut workspace, mut expected) = (program.workspace(), vec![f64::NAN; nodes.len()]);
    for lane in 0..LANES {
        let inputs: Vec<f64> = inputs.iter().map(|all| all[lane]).collect();
        program.run(&inputs, &session.model.sets, &mut workspace, &mut expected).unwrap();
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let (a, b) = (found[lane], *expected);
            assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "output {k}, lane {lane}: {a:e}, {b:e}");
        }
    }
}

#[test]
fn every_scene_gives_the_same_bits_in_every_lane() {
    // Long, and made of what the short ones are made of.
    const LONG: [&str; 2] = ["A02_N40", "chain_N100"];
    let mut seen = 0;
    for folder in ["scenes", "scenes/benchmarks", "verification"] {
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            if path.extension().is_none_or(|ending| ending != "toml") || LONG.contains(&stem.as_str()) {
                continue;
            }
            assert_same_bits(&Session::open(&path, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}")));
            seen += 1;
        }
    }
    assert!(seen > 80, "{seen} scenes were seen: is this test still reading the right folders?");
}
