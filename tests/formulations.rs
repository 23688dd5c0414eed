//! Joint coordinates and the coordinates of bodies describe the same motion, in every scene of the tree.

use std::path::{Path, PathBuf};

use odyn::session::{RunReport, Session};
use odyn::verification::scenes_in;

use crate::support::{options, root};

/// Scenes whose runs take long, or that are chaotic beyond their end, for this purpose.
const LEFT_OUT: [&str; 1] = ["many-turns"];

/// Share of a column's peak that two runs may differ by, in tolerances of their integration: each is off by some.
const TOLERANCES: f64 = 1000.0;
/// Columns that stay below this are zero but for rounding and errors of the integration (the energy of a scene that starts with
/// none), in scene units.
const ROUNDING: f64 = 1e-7;
/// The same where round-off decides.
const ROUND_OFF: f64 = 1e-10;

/// The largest difference of each column of two runs, as a share of the largest magnitude in the column or, for columns that
/// should be zero, in all columns of the unit.
fn worst(ours: &RunReport, theirs: &RunReport) -> (f64, String) {
    assert_eq!(ours.times, theirs.times);
    let peak = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut worst = (0.0, String::new());
    for (k, channel) in ours.channels.iter().enumerate() {
        if !channel.unique {
            continue;
        }
        let same_unit = ours.channels.iter().zip(&ours.columns).filter(|(other, _)| other.unit == channel.unit);
        let size = same_unit.map(|(_, column)| peak(column)).fold(0.0, f64::max);
        // What should be zero is so but for rounding.
        let size = if size > ROUNDING { size } else { 1.0 };
        let differences: Vec<f64> = ours.columns[k].iter().zip(&theirs.columns[k]).map(|(a, b)| a - b).collect();
        let off = peak(&differences) / size;
        if off > worst.0 || off.is_nan() {
            worst = (off, channel.name.clone());
        }
    }
    worst
}

fn scenes() -> Vec<PathBuf> {
    let mut scenes = scenes_in(&root().join("scenes/verification")).unwrap();
    scenes.extend(["compressor", "compressor-speed-control"].map(|name| root().join(format!("scenes/{name}.toml"))));
    scenes.retain(|path| !LEFT_OUT.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name)));
    scenes
}

/// The scene with settings, opened.
fn open(path: &Path, settings: &[&str]) -> Session {
    let settings: Vec<String> = settings.iter().map(|setting| format!("simulation.{setting}")).collect();
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    Session::open(path, &options(&settings, &[])).unwrap_or_else(|error| panic!("{error}"))
}

fn run(session: Session) -> RunReport {
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// What differs by more than the tolerance of the runs explains, in words; empty where nothing does.
fn difference(path: &Path, ours: &RunReport, theirs: &RunReport) -> String {
    let (off, column) = worst(ours, theirs);
    let allowed = (TOLERANCES * ours.summary.tolerance).max(ROUND_OFF);
    if off <= allowed {
        return String::new();
    }
    format!("{}: `{column}` differs by {off:.1e} of its peak, allowed {allowed:.1e}\n", path.display())
}

#[test]
fn joint_coordinates_and_those_of_bodies_give_the_same_results() {
    let mut in_joints = 0;
    let mut failed = String::new();
    for path in scenes() {
        let [ours, theirs] = ["formulation=auto", "formulation=cartesian"].map(|setting| run(open(&path, &[setting])));
        if !ours.summary.engine.contains("joint") {
            continue;
        }
        in_joints += 1;
        failed += &difference(&path, &ours, &theirs);
    }
    assert!(failed.is_empty(), "\n{failed}");
    assert!(in_joints > 50, "{in_joints}");
}
