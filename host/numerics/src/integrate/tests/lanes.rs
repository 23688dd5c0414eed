//! Entries of a state that are summed side by side have the bits of each alone.

use super::fixtures::Probe;
use crate::integrate::{Options, Span, by_name};

/// Samples of as many entries as there are starts, none of which acts on another.
fn samples(name: &str, starts: &[f64]) -> Vec<Vec<f64>> {
    let rhs = |t: f64, y: &[f64], dy: &mut [f64]| {
        dy.iter_mut().zip(y).for_each(|(rate, value)| *rate = t.cos() - value * value * value);
    };
    let mut probe = Probe::new(rhs, starts.len(), 1e-6);
    let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
    let span = Span { t_start: 0.0, t_end: 2.0, sample_times: &times };
    let options = Options { fixed_step: Some(0.25), ..Options::default() };
    let mut method = by_name(name).unwrap();
    method.integrate(&mut probe, &mut starts.to_vec(), &span, &options).unwrap();
    probe.samples.into_iter().map(|(_, state)| state).collect()
}

#[test]
fn what_is_summed_side_by_side_is_what_is_summed_alone() {
    for name in ["dop853", "dopri5"] {
        let starts: Vec<f64> = (0..27).map(|k| 0.2 + 0.03 * f64::from(k)).collect();
        let alone: Vec<Vec<Vec<f64>>> = starts.iter().map(|start| samples(name, &[*start])).collect();
        for n in 2..=starts.len() {
            for (row, state) in samples(name, &starts[..n]).iter().enumerate() {
                for (k, value) in state.iter().enumerate() {
                    assert_eq!(value.to_bits(), alone[k][row][0].to_bits(), "{name}: {k} of {n} at sample {row}");
                }
            }
        }
    }
}
