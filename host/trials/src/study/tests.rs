//! What is varied is read as written; failures stay with their runs; tables are complete.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::*;

fn values(text: &str) -> Vec<String> {
    Vary::parse(text).unwrap().values
}

#[test]
fn ranges_have_both_ends_and_short_values() {
    assert_eq!(values("crank.radius=8mm:9mm:6"), ["8mm", "8.2mm", "8.4mm", "8.6mm", "8.8mm", "9mm"]);
    assert_eq!(values("a = 1 : -1 : 3"), ["1", "0", "-1"]);
    assert_eq!(values("a=1e-7 m:3e-7 m:3"), ["1e-7m", "2e-7m", "3e-7m"]);
    assert_eq!(values("a=0.1:0.4:4"), ["0.1", "0.2", "0.3", "0.4"]);
    assert_eq!(Vary::parse("crank.radius=8mm:9mm:6").unwrap().key, "crank.radius");
}

#[test]
fn lists_are_split_at_commas_outside_brackets() {
    assert_eq!(values("rod.length=40mm, 42mm"), ["40mm", "42mm"]);
    assert_eq!(values("simulation.gravity=[0,0,0],[0,-9.81,0]"), ["[0,0,0]", "[0,-9.81,0]"]);
    assert_eq!(values("simulation.method=dop853"), ["dop853"]);
    assert_eq!(values("a=\"atan2(1, 2)\",3"), ["\"atan2(1, 2)\"", "3"]);
}

#[test]
fn what_cannot_be_varied_is_said() {
    let message = |text: &str| Vary::parse(text).unwrap_err().message;
    assert!(message("radius").contains("no `=`"));
    assert!(message("=1,2").contains("no key"));
    assert!(message("a=1:2").contains("three parts"));
    assert!(message("a=1mm:2cm:3").contains("one unit"));
    assert!(message("a=x:2:3").contains("`x` does not begin with a number"));
    assert!(message("a=inf:2:3").contains("`inf`"));
    assert!(message("a=1:2:x").contains("`x`"));
    assert!(message("a=1:2:1").contains("two values"));
    assert!(message("a=1:2:4000000000").contains("at most 1000000"));
    assert!(message("a=1,,2").contains("missing"));
}

#[test]
fn too_many_runs_are_taken_for_a_mistake() {
    let vary = Vary::parse("a=0:1:2000").unwrap();
    let options = StudyOptions { varied: vec![vary.clone(), vary], ..StudyOptions::default() };
    let error = Study::run(Path::new("none.toml"), &options, &|_, _| (), &Arc::default()).unwrap_err();
    assert!(error.message.contains("more than 1000000 runs"), "{}", error.message);
}

/// A scene without elements needs no library.
const BALL: &str = r#"
[parameters]
speed = "2 m/s"
[simulation]
gravity = [0, -10, 0]
t_end = 1
output_step = 0.5
[[body]]
name = "ball"
mass = 1
inertia = [1, 1, 1]
position = [0, 0, 0]
velocity = ["speed", 0, 0]
[[output]]
name = "x"
quantity = "position"
of = "ball"
component = "x"
[[figure]]
name = "way"
channel = "x"
take = "final"
"#;

/// The scene in a folder of its own.
fn ball(name: &str) -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("odyn-study-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("ball.toml");
    std::fs::write(&path, BALL).unwrap();
    path
}

fn study(scene: &Path, varied: &[&str], stop: bool) -> Study {
    let varied = varied.iter().map(|text| Vary::parse(text).unwrap()).collect();
    let options = StudyOptions { varied, jobs: 1, ..StudyOptions::default() };
    Study::run(scene, &options, &|_, _| (), &Arc::new(AtomicBool::new(stop))).unwrap()
}

#[test]
fn the_last_key_changes_fastest_and_failures_stay_with_their_runs() {
    let scene = ball("runs");
    let study = study(&scene, &["speed=2,1 kg", "ball.mass=1,3"], false);
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
    assert_eq!(study.exit_code(), 3, "the unit is a mistake in the scene");
    let table = study.table();
    assert_eq!(table.columns[..6], ["run", "speed", "ball.mass", "status", "problem", "figure.way [m]"]);
    let cells = |k: usize, columns: std::ops::Range<usize>| table.rows[k][columns].join(";");
    assert_eq!(cells(0, 0..5), "1;2;1;completed;");
    assert_eq!(cells(1, 0..5), "2;2;3;completed;");
    assert_eq!(table.columns[6], "final.x [m]");
    for cell in [&table.rows[0][5], &table.rows[1][6]] {
        assert!((cell.parse::<f64>().unwrap() - 2.0).abs() < 1e-12, "{cell}");
    }
    assert!(cells(2, 0..5).starts_with("3;1 kg;1;failed;ODY0"), "{}", cells(2, 0..5));
    assert!(table.rows.iter().all(|row| row.len() == table.columns.len()));
    assert_eq!(table.csv().lines().count(), 5);
    assert!(study.any_results().is_ok());
}

#[test]
fn a_study_without_any_result_is_an_error() {
    let scene = ball("none");
    let study = study(&scene, &["sped=1,2"], false);
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
    assert!(study.any_results().unwrap_err().to_string().contains("sped"));
}

#[test]
fn a_stopped_study_begins_no_run() {
    let study = study(Path::new("none.toml"), &["speed=1,2"], true);
    assert!(study.runs.iter().all(|run| matches!(run.outcome, Outcome::NotBegun)));
    assert_eq!(study.exit_code(), 130);
}
