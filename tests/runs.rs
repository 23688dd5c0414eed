//! Runs that are saved and brought back, also in another run, give the same bytes: in both formulations, by all adaptive methods.

use odyn::session::{Prepared, Run, Saved};

use crate::support::open;

/// Scenes of several kinds, and their ends, s.
const SCENES: [(&str, f64); 10] = [
    ("compressor.toml", 0.02),
    // A controller with states.
    ("compressor-speed-control.toml", 0.02),
    // Links that pass singular positions.
    ("benchmarks/A02_N2.toml", 2.0),
    ("benchmarks/A03.toml", 0.01),
    // Redundant rows in space.
    ("benchmarks/A04.toml", 1.0),
    ("stress/bennett.toml", 2.0),
    // Stiff.
    ("benchmarks/bushing_1e6.toml", 0.02),
    ("stress/four-bar-change-point.toml", 2.0),
    // Forces that depend on reactions.
    ("stress/friction-decay.toml", 1.0),
    // Contacts.
    ("stress/bounce.toml", 1.0),
];
const STOPS: [f64; 3] = [0.3, 0.55, 0.8];

fn started(scene: &str, sets: &[&str]) -> Run<'static> {
    open(scene, sets).prepare().and_then(Prepared::start).unwrap_or_else(|error| panic!("{scene} {sets:?}: {error}"))
}

#[track_caller]
fn advance(run: &mut Run<'_>, share: f64) {
    let t = share * run.end();
    run.advance(t).unwrap_or_else(|error| panic!("{error}"));
}

/// Every bit of the rows from a time on.
fn bits(run: &Run<'_>, from: f64) -> Vec<Vec<u64>> {
    let samples = run.samples();
    let first = samples.times.partition_point(|t| *t <= from);
    let columns = samples.columns.iter().map(Vec::as_slice);
    std::iter::once(samples.times)
        .chain(columns)
        .map(|list| list[first..].iter().map(|x| x.to_bits()).collect())
        .collect()
}

/// Whether a run that is brought back, and another that is brought to where it was, agree with one that never was.
fn stays_itself(scene: &str, sets: &[&str]) {
    let mut plain = started(scene, sets);
    let mut wandering = started(scene, sets);
    let mut saved: Vec<Saved> = Vec::new();
    for share in STOPS {
        advance(&mut plain, share);
        let here = wandering.save().unwrap();
        advance(&mut wandering, 0.9);
        wandering.restore(&here).unwrap();
        advance(&mut wandering, share);
        saved.push(wandering.save().unwrap());
    }
    advance(&mut plain, 1.0);
    advance(&mut wandering, 1.0);
    assert!(bits(&plain, -1.0) == bits(&wandering, -1.0), "{scene} {sets:?}: brought back");
    assert!(plain.samples().times.len() > 10);

    let mut other = started(scene, sets);
    other.restore(&saved[1]).unwrap();
    let from = other.time();
    advance(&mut other, STOPS[2]);
    advance(&mut other, 1.0);
    assert!(bits(&plain, from) == bits(&other, from), "{scene} {sets:?}: another run");
}

#[test]
fn what_is_saved_is_all_that_the_future_depends_on() {
    for (scene, end) in SCENES {
        // Where forces depend on reactions, there are only coordinates of bodies.
        let formulations = if scene.contains("friction") { &["cartesian"][..] } else { &["joint", "cartesian"] };
        for formulation in formulations {
            for method in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
                let sets = [
                    format!("simulation.t_end={end} s"),
                    format!("simulation.output_step={} s", end / 40.0),
                    format!("simulation.formulation={formulation}"),
                    format!("simulation.method={method}"),
                    "simulation.tolerance=1e-6".into(),
                ];
                let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
                stays_itself(scene, &sets);
            }
        }
    }
}
