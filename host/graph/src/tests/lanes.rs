//! Lanes: each one the scalar interpreter's numbers, bit for bit, whatever the others hold.

#[path = "../../../testing/lanes.rs"]
mod twins;

use super::*;
use twins::assert_same;

#[test]
fn random_programs_give_the_same_bits_in_every_lane() {
    let mut random = Random(31);
    for round in 0..20 {
        let (graph, nodes) = tape::random_graph(&mut random, 5, 40 + 20 * round);
        let outputs: Vec<Node> = (0..12).map(|_| nodes[random.below(nodes.len())]).collect();
        let program = Program::compile(&graph, &outputs);
        assert_same::<4>(&program, || random.vector(5).iter().map(|x| 3.0 * x).collect());
        assert_same::<8>(&program, || random.vector(5).iter().map(|x| 3.0 * x).collect());
    }
}
