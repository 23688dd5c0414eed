//! A program written as kernels against itself written straight.

use super::{Graph, Node, Program, Sets, Writing};

/// Both ways of writing the same outputs.
pub(super) fn both(graph: &mut Graph, outputs: &[Node]) -> [Program; 2] {
    [Writing::Straight, Writing::Kernels].map(|writing| {
        graph.writing = writing;
        Program::compile(graph, outputs)
    })
}

/// Runs both and compares every bit.
#[track_caller]
pub(super) fn assert_same(programs: &[Program; 2], inputs: &[f64], sets: &Sets) {
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
