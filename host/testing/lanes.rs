//! A program in lanes against itself run one instance after the other.

use super::Program;

/// Runs a program one instance after the other and in lanes; every bit must be the same. A lane that is not a number must
/// be none in both; which of the many is nobody's business.
#[track_caller]
pub(super) fn assert_same<const L: usize>(program: &Program, mut instance: impl FnMut() -> Vec<f64>) {
    let mut lanes = program.lanes::<L>().expect("a program without opaque calls");
    let mut workspace = program.workspace();
    let outputs = program.output_count();
    let mut found = vec![[f64::NAN; L]; outputs];
    for _ in 0..3 {
        let instances: Vec<Vec<f64>> = (0..L).map(|_| instance()).collect();
        let slots = instances[0].len();
        let inputs: Vec<[f64; L]> = (0..slots).map(|k| std::array::from_fn(|lane| instances[lane][k])).collect();
        program.run_lanes(&inputs, &mut lanes, &mut found);
        for (lane, inputs) in instances.iter().enumerate() {
            let mut expected = vec![f64::NAN; outputs];
            program.run(inputs, &[], &mut workspace, &mut expected).unwrap();
            for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let (a, b) = (found[lane], *expected);
                let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
                assert!(same, "output {k}, lane {lane} of {L}: {a:e} instead of {b:e}");
            }
        }
    }
}
