//! Scenes against references that are exact to more digits than double precision has (`scenes/reference/`, each with its source
//! in its first lines), and against the other formulation.
//!
//! A new case is a scene in `scenes/`, a reference, and a test that calls [`check`], which compares all columns of the
//! reference, or [`checked`], which trusts the scene's own `[[check]]`s. The tolerances of those are about three times the
//! errors that were seen.

use odyn::bench::{Runner, Settings};
use odyn::results::Table;
use odyn::session::RunReport;

use crate::support::{self, assert_same_motion, difference, root};

/// Largest differences from the reference, as shares of each column's peak.
struct Tolerances {
    /// For all columns without a tolerance of their own.
    every: f64,
    own: &'static [(&'static str, f64)],
}

impl Tolerances {
    const fn all(every: f64) -> Self {
        Self { every, own: &[] }
    }

    fn of(&self, column: &str) -> f64 {
        self.own.iter().find(|(name, _)| *name == column).map_or(self.every, |(_, tolerance)| *tolerance)
    }
}

/// Work done, exactly. A change here is a change of speed: regenerate the numbers by hand and say why in the commit.
#[derive(Debug, PartialEq, Eq)]
struct Work {
    steps: u64,
    rejected: u64,
    evaluations: u64,
    factorisations: u64,
}

/// Runs a scene and compares every column of the reference with the channel of its name, at every time of the reference.
#[track_caller]
fn check(scene: &str, reference: &str, sets: &[&str], tolerances: &Tolerances) -> RunReport {
    let report = support::run(scene, sets);
    let table = Table::read(&root().join("scenes/reference").join(reference)).unwrap();
    assert_eq!(report.times.len(), table.times.len(), "as many rows");
    for (ours, theirs) in report.times.iter().zip(&table.times) {
        assert!((ours - theirs).abs() <= 1e-12 * theirs.abs(), "a sample at {theirs}, not {ours}");
    }
    let mut failed = String::new();
    for (name, column) in table.names.iter().zip(&table.columns) {
        let off = difference(support::column(&report, name), column);
        let tolerance = tolerances.of(name);
        // Not a number is off, too.
        if off.is_nan() || off > tolerance {
            failed.push_str(&format!("\n{name}: off by {off:.2e} of its peak, allowed {tolerance:e}"));
        }
    }
    assert!(failed.is_empty(), "{scene} against {reference}:{failed}");
    report
}

/// Asserts the work of a run. Step counts depend on the last digits of the system's functions such as `sin`, so they are
/// pinned for one platform.
#[track_caller]
fn assert_work(report: &RunReport, expected: &Work) {
    let summary = &report.summary;
    let work = Work {
        steps: summary.steps,
        rejected: summary.rejected,
        evaluations: summary.evaluations,
        factorisations: summary.factorisations,
    };
    if cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        assert_eq!(&work, expected);
    }
}

#[test]
fn compressor() {
    let report = check("compressor.toml", "compressor.csv", &[], &Tolerances::all(1e-8));
    assert_work(&report, &Work { steps: 714, rejected: 65, evaluations: 10482, factorisations: 0 });
}

#[test]
fn compressor_at_a_tight_tolerance() {
    let report = check("compressor.toml", "compressor.csv", &["simulation.tolerance=1e-11"], &Tolerances::all(1e-10));
    assert_work(&report, &Work { steps: 939, rejected: 56, evaluations: 13083, factorisations: 0 });
}

#[test]
fn simple_pendulum() {
    let report = check("benchmarks/A01.toml", "A01.csv", &[], &Tolerances::all(1e-8));
    assert_work(&report, &Work { steps: 203, rejected: 0, evaluations: 3041, factorisations: 0 });
}

#[test]
fn one_four_bar_through_its_singular_positions() {
    let report = check("benchmarks/A02_N1.toml", "A02_N1.csv", &[], &Tolerances::all(1e-8));
    assert_work(&report, &Work { steps: 259, rejected: 0, evaluations: 3677, factorisations: 0 });
}

#[test]
fn two_four_bars_through_their_singular_positions() {
    let report = check("benchmarks/A02_N2.toml", "A02_N2.csv", &[], &Tolerances::all(1e-8));
    assert_work(&report, &Work { steps: 257, rejected: 0, evaluations: 3647, factorisations: 0 });
}

#[test]
fn bricard_mechanism() {
    let report = check("benchmarks/A04.toml", "A04.csv", &[], &Tolerances::all(1e-8));
    assert_work(&report, &Work { steps: 147, rejected: 0, evaluations: 2195, factorisations: 0 });
}

#[test]
fn free_rigid_body() {
    let report = check("benchmarks/freebody.toml", "freebody.csv", &[], &Tolerances::all(1e-8));
    assert_work(&report, &Work { steps: 1981, rejected: 0, evaluations: 24371, factorisations: 0 });
}

/// 2000 s, as the scene has it.
#[test]
fn simple_pendulum_for_long() {
    let work = Work { steps: 95167, rejected: 301, evaluations: 1145914, factorisations: 0 };
    checked("benchmarks/A01_2000s.toml", None, 2, &work);
}

/// Until before the first singular position.
#[test]
fn forty_four_bars() {
    let work = Work { steps: 4, rejected: 0, evaluations: 53, factorisations: 0 };
    checked("benchmarks/A02_N40.toml", Some("0.1 s"), 2, &work);
}

#[test]
fn squeezer_mechanism() {
    let work = Work { steps: 296, rejected: 4, evaluations: 4142, factorisations: 0 };
    checked("benchmarks/A03.toml", None, 9, &work);
}

#[test]
fn squeezer_mechanism_of_the_test_set() {
    let work = Work { steps: 143, rejected: 5, evaluations: 1954, factorisations: 0 };
    checked("benchmarks/A03_testset.toml", None, 9, &work);
}

/// The fast motions die within milliseconds, but the explicit method continues at their pace.
#[test]
fn stiff_governor() {
    let work = Work { steps: 2281, rejected: 4, evaluations: 27430, factorisations: 0 };
    checked("benchmarks/A05.toml", Some("0.25 s"), 3, &work);
}

#[test]
fn rod_on_a_stiff_bushing() {
    let work = Work { steps: 9430, rejected: 9, evaluations: 113368, factorisations: 0 };
    checked("benchmarks/bushing_1e6.toml", None, 7, &work);
}

#[test]
fn rod_on_a_very_stiff_bushing() {
    let work = Work { steps: 5199, rejected: 7, evaluations: 62476, factorisations: 0 };
    checked("benchmarks/bushing_1e8.toml", Some("0.2 s"), 7, &work);
}

#[test]
fn car_axis() {
    let work = Work { steps: 564, rejected: 1, evaluations: 6958, factorisations: 0 };
    checked("benchmarks/caraxis.toml", None, 4, &work);
}

#[test]
fn compressor_as_measured() {
    let work = Work { steps: 178, rejected: 16, evaluations: 2611, factorisations: 0 };
    checked("benchmarks/compressor.toml", Some("50 ms"), 5, &work);
}

#[test]
fn double_pendulum() {
    let work = Work { steps: 989, rejected: 15, evaluations: 12332, factorisations: 0 };
    checked("benchmarks/dpend.toml", None, 3, &work);
}

#[test]
fn double_pendulum_heavy_above_light() {
    let work = Work { steps: 131, rejected: 0, evaluations: 1691, factorisations: 0 };
    checked("benchmarks/massratio_heavy_light.toml", None, 3, &work);
}

#[test]
fn double_pendulum_light_above_heavy() {
    let work = Work { steps: 187, rejected: 4, evaluations: 2407, factorisations: 0 };
    checked("benchmarks/massratio_light_heavy.toml", None, 3, &work);
}

#[test]
fn chain_of_ten() {
    let work = Work { steps: 521, rejected: 0, evaluations: 6551, factorisations: 0 };
    checked("benchmarks/chain_N10.toml", None, 2, &work);
}

#[test]
fn tip_of_a_chain_of_a_hundred_falls_freely() {
    let work = Work { steps: 77, rejected: 0, evaluations: 938, factorisations: 0 };
    checked("benchmarks/chain_N100.toml", Some("0.05 s"), 1, &work);
}

/// The paper's seven coordinates per body, solved densely, move as the working form does. Ends are early because that
/// formulation is slow, and before the first singular position of A02, where it has no unique accelerations.
#[test]
fn the_formulation_of_the_paper_gives_the_same_motion() {
    for (scene, end) in [
        ("compressor.toml", "20 ms"),
        ("benchmarks/A01.toml", "1 s"),
        ("benchmarks/A02_N1.toml", "0.5 s"),
        ("benchmarks/A02_N2.toml", "0.5 s"),
        ("benchmarks/A04.toml", "0.5 s"),
        ("benchmarks/freebody.toml", "2.5 s"),
    ] {
        let end = format!("simulation.t_end={end}");
        let working = support::run(scene, &[&end]);
        let paper = support::run(scene, &[&end, "simulation.engine=reference"]);
        assert!(paper.summary.engine.starts_with("reference") && !working.summary.engine.starts_with("reference"));
        assert_same_motion(&paper, &working, 1e-9);
    }
}

/// Runs a scene to an earlier end (scene units) or its own, and wants its work; its checks are part of the run.
#[track_caller]
fn checked(scene: &str, t_end: Option<&str>, checks: usize, work: &Work) {
    let end = t_end.map(|end| format!("simulation.t_end={end}"));
    let report = support::run(scene, &end.as_deref().map_or(vec![], |end| vec![end]));
    let references = report.checks.iter().filter(|check| check.samples > 1 && check.passed).count();
    assert_eq!(references, checks, "checks that compared something");
    assert_work(&report, work);
}

#[test]
fn every_scene_has_a_test() {
    let here = std::fs::read_to_string(root().join("tests/benchmarks.rs")).unwrap();
    let mut scenes = 0;
    for folder in ["", "benchmarks/"] {
        for entry in std::fs::read_dir(root().join("scenes").join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".toml") {
                scenes += 1;
                // The one without a reference has a file of its own.
                let elsewhere = name == "compressor-speed-control.toml";
                let calls = ["check", "checked"].map(|call| format!("{call}(\"{folder}{name}\""));
                let tested = calls.iter().any(|call| here.contains(call)) || elsewhere;
                assert!(tested, "no test runs scenes/{folder}{name}");
            }
        }
    }
    assert!(scenes >= 20, "{scenes} scenes");
}

/// What `odyn bench` computes for a scene without checks has the digits of what is known of it.
#[test]
fn a_computed_reference_is_the_known_one() {
    for name in ["A01", "A03", "A04", "chain_N10", "compressor"] {
        let text = std::fs::read_to_string(root().join(format!("scenes/benchmarks/{name}.toml"))).unwrap();
        let scratch = support::Scratch::new();
        let folder = scratch.path();
        let scene = scratch.file(&format!("{name}.toml"), &text[..text.find("[[check]]").unwrap()]);
        let settings = Settings {
            methods: vec!["dop853".into()],
            tolerances: vec![1e-9],
            repeats: 1,
            library_copies: Some(support::kept("library-copies")),
            references: Some(folder.to_path_buf()),
            ..Settings::default()
        };
        let problem = Runner::new(settings).measure(&scene, |_| ());
        let error = problem.points[0].outcome.as_ref().unwrap_or_else(|reason| panic!("{name}: {reason}")).error;
        assert!(error < 1e-6, "{name}: {error:e}");
        let computed = Table::read(&folder.join(format!("{name}.reference.csv"))).unwrap();
        let known = Table::read(&root().join(format!("scenes/reference/{name}.csv"))).unwrap();
        assert_eq!(computed.times.len(), known.times.len());
        let mut compared = 0;
        for (column, values) in known.names.iter().zip(&known.columns) {
            let Some(own) = computed.column(column) else { continue };
            let off = difference(own, values);
            assert!(off < 1e-11, "{name}, {column}: {off:e}");
            compared += 1;
        }
        assert!(compared >= 2, "{name}");
    }
}
