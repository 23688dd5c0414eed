//! What is varied is read as written; failures stay with their runs; tables are complete.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::*;

mod series;

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
    let error = Points::grid(["a=0:1:2000", "b=0:1:2000"].map(|text| Vary::parse(text).unwrap()).into()).unwrap_err();
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
    let points = Points::grid(varied).unwrap();
    let options = StudyOptions { points, jobs: 1, ..StudyOptions::default() };
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

/// And no cell costs a look through all rows, of which there are many here.
#[test]
fn the_overview_of_many_runs_has_its_columns_under_each_other() {
    let columns = ["run", "speed", "status", "problem", "figure.way [m]"].map(String::from).to_vec();
    let row =
        |k: usize| [&k.to_string(), &(k as f64 / 7.0).to_string(), "completed", "", "1"].map(String::from).to_vec();
    let table = StudyTable { columns, rows: (1..=20_000).map(row).collect(), leading: 4, figures: 1 };
    let text = table.overview();
    let title = text.lines().next().unwrap();
    assert!(title.ends_with("figure.way [m]"), "{title}");
    assert_eq!(text.lines().filter(|line| line.len() == title.len()).count(), 20_001);
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
    let mut stopped = study(Path::new("none.toml"), &["speed=1,2"], true);
    assert!(stopped.runs.iter().all(|run| matches!(run.outcome, Outcome::NotBegun)));
    assert_eq!(stopped.exit_code(), 130);
    // Also where one failed before.
    stopped.runs[0] = study(&ball("none"), &["sped=1"], false).runs.remove(0);
    assert!(matches!(stopped.runs[0].outcome, Outcome::Failed(_)));
    assert_eq!(stopped.exit_code(), 130);
}

/// The numbers of a key of a design.
fn column(points: &Points, key: usize) -> Vec<f64> {
    (0..points.len()).map(|number| points.values(number)[key].trim_end_matches("mm").parse().unwrap()).collect()
}

/// How many of these numbers in [0, 1) are in each of so many parts.
fn counts(numbers: &[f64], parts: usize) -> Vec<usize> {
    let mut counts = vec![0; parts];
    numbers.iter().for_each(|x| counts[(x * parts as f64) as usize] += 1);
    counts
}

#[test]
fn every_part_of_a_range_has_one_point_of_a_latin_hypercube() {
    let spans = ["a=2mm:12mm", "b=1:0", "c=x,y,z"].map(|text| Span::parse(text).unwrap());
    let design = |seed| Points::designed(&spans, Design::LatinHypercube { count: 300, seed }).unwrap();
    let points = design(1);
    let a: Vec<f64> = column(&points, 0).iter().map(|a| (a - 2.0) / 10.0).collect();
    assert_eq!(counts(&a, 300), [1; 300]);
    assert_eq!(counts(&column(&points, 1), 300), [1; 300]);
    for value in ["x", "y", "z"] {
        assert_eq!((0..300).filter(|k| points.values(*k)[2] == value).count(), 100, "{value}");
    }
    assert!(points.values(0)[0].ends_with("mm"));
    assert_eq!(points, design(1));
    assert_ne!(points, design(2));
    // The keys are paired by lot: independent numbers have a correlation of 1/sqrt(300) = 0.06.
    let mean = a.iter().zip(column(&points, 1)).map(|(a, b)| (a - 0.5) * (b - 0.5) * 12.0).sum::<f64>() / 300.0;
    assert!(mean.abs() < 0.2, "{mean}");
}

#[test]
fn points_of_a_sobol_sequence_are_those_of_the_literature() {
    let spans = ["a=0:1", "b=0:1"].map(|text| Span::parse(text).unwrap());
    let points = Points::designed(&spans, Design::Sobol { count: 8, seed: None }).unwrap();
    // Joe & Kuo, the first points in two dimensions.
    assert_eq!(column(&points, 0), [0.0, 0.5, 0.75, 0.25, 0.375, 0.875, 0.625, 0.125]);
    assert_eq!(column(&points, 1), [0.0, 0.5, 0.25, 0.75, 0.375, 0.875, 0.125, 0.625]);
}

/// Sobol' (1967): with 2^m points, every part of each range has one, also when bits are turned over; in the first two dimensions
/// so have all boxes of one size, whatever their sides (a (0, m, 2)-net).
#[test]
fn points_of_a_sobol_sequence_are_even_in_all_dimensions() {
    let spans: Vec<Span> = (0..21).map(|k| Span::parse(&format!("k{k}=0:1")).unwrap()).collect();
    for seed in [None, Some(7)] {
        let points = Points::designed(&spans, Design::Sobol { count: 64, seed }).unwrap();
        for key in 0..21 {
            assert_eq!(counts(&column(&points, key), 64), [1; 64], "key {key}, seed {seed:?}");
        }
        for rows in [1, 2, 4, 8, 16, 32, 64] {
            let boxes: std::collections::HashSet<_> = column(&points, 0)
                .iter()
                .zip(column(&points, 1))
                .map(|(a, b)| ((a * rows as f64) as usize, (b * 64.0 / rows as f64) as usize))
                .collect();
            assert_eq!(boxes.len(), 64, "{rows} rows, seed {seed:?}");
        }
        let longer = Points::designed(&spans, Design::Sobol { count: 100, seed }).unwrap();
        assert!((0..64).all(|k| longer.values(k) == points.values(k)));
    }
    let one_more = [spans, vec![Span::parse("one more=0:1").unwrap()]].concat();
    let error = Points::designed(&one_more, Design::Sobol { count: 1, seed: None }).unwrap_err();
    assert!(error.message.contains("21 keys, not for 22"), "{}", error.message);
}

#[test]
fn points_are_read_from_a_table() {
    let scene = ball("points");
    let file = scene.with_file_name("points.csv");
    let read = |text: &str| {
        std::fs::write(&file, text).unwrap();
        Points::read(&file).map_err(|error| error.message)
    };
    let points = read("\u{feff}speed, simulation.gravity\n1 m/s,\"[0, 0, 0]\"\n2,\"[0, -1, 0]\"\n").unwrap();
    assert_eq!(points.keys(), ["speed", "simulation.gravity"]);
    assert_eq!(points.values(1), ["2", "[0, -1, 0]"]);
    assert_eq!(
        points.changes(0).map(|one| one.text).collect::<Vec<_>>(),
        ["speed=1 m/s", "simulation.gravity=[0, 0, 0]"]
    );
    let others = read("speed;simulation.gravity\n1 m/s;[0, 0, 0]\n2;[0, -1, 0]\n").unwrap();
    assert_eq!(others, points);
    assert_eq!(read("speed\tsimulation.gravity\n1 m/s\t[0, 0, 0]\n2\t[0, -1, 0]\n").unwrap(), points);
    assert_eq!(read("speed\n1 m/s\n").unwrap().values(0), ["1 m/s"]);
    for (text, what) in [
        ("a,b\n1\n", "1"),
        ("a,b\n1,\n", "no value for `b`"),
        ("a,a\n1,2\n", "varied twice"),
        ("a,\n1,2\n", "a key of the points is empty"),
        ("a\n", "no line below"),
        ("", "no line below"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(what), "{text:?}: {error}");
    }
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}

#[test]
fn every_run_is_in_one_shard() {
    for (runs, count) in [(0, 1), (1, 3), (7, 3), (64, 64), (1_000_000, 99_999)] {
        let mut next = 0;
        for index in 1..=count {
            let range = Shard::new(index, count).unwrap().range(runs);
            assert_eq!(range.start, next);
            assert!(range.len() == runs / count || range.len() == runs / count + 1);
            next = range.end;
        }
        assert_eq!(next, runs);
    }
    assert_eq!("17/64".parse(), Ok(Shard::new(17, 64).unwrap()));
    for text in ["0/4", "5/4", "1/0", "1", "1/4/2", "a/4", "1/100000"] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
}

/// A study of the ball in shards, `stop` after so many runs.
fn shards(scene: &Path, folder: &Path, varied: &str, shard: Option<Shard>, resume: bool) -> Result<Study, String> {
    let points = Points::grid(vec![Vary::parse(varied).unwrap()]).unwrap();
    let journal = Some(folder.to_path_buf());
    let options = StudyOptions { points, shard, journal, resume, jobs: 1, ..StudyOptions::default() };
    let study = Study::run(scene, &options, &|_, _| (), &Arc::default()).map_err(|error| error.message.clone())?;
    study.write(folder).unwrap();
    Ok(study)
}

/// The second half fails, so that some parts have no titles of their own; outputs change their unit on the way.
#[test]
fn parts_make_the_bytes_of_the_whole() {
    for (name, varied) in [
        ("failing", "speed=1 kg,2 kg,1,2,3 kg,4"),
        ("none", "speed=1 kg,2 kg"),
        ("titles", "output.x.quantity=\"position\",\"velocity\",\"acceleration\",\"velocity\",\"position\""),
    ] {
        let scene = ball(name);
        let folder = |name: &str| scene.with_file_name(name);
        let whole = shards(&scene, &folder("whole"), varied, None, false).unwrap();
        for count in [1, 2, 4, 7] {
            let parts = folder(&format!("parts-{count}"));
            for index in (1..=count).rev() {
                shards(&scene, &parts, varied, Shard::new(index, count), false).unwrap();
            }
            let merged = merge(&parts).unwrap();
            let bytes = |folder: &Path| std::fs::read_to_string(folder.join(STUDY_FILE)).unwrap();
            assert_eq!(bytes(&parts), bytes(&folder("whole")), "{name}, {count} parts");
            assert_eq!(merged.exit_code, whole.exit_code());
            assert_eq!((merged.parts, merged.table.rows.len()), (count, whole.runs.len()));
        }
        std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
    }
}

/// Values are never below the title of another unit.
#[test]
fn outputs_that_only_some_runs_have_get_columns_of_their_own() {
    let scene = ball("columns");
    let table = study(&scene, &["output.x.quantity=\"position\",\"velocity\""], false).table();
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
    let column = |title: &str| table.columns.iter().position(|column| column == title).unwrap();
    let (way, x, v) = (column("figure.way [m]"), column("final.x [m]"), column("final.x [m/s]"));
    let row = |k: usize| [way, x, v].map(|column| table.rows[k][column].parse::<f64>().ok().map(f64::round));
    assert_eq!(row(0), [Some(2.0), Some(2.0), None]);
    assert_eq!(row(1), [None, None, Some(2.0)]);
    assert!(table.rows.iter().all(|row| row.len() == table.columns.len() && !row[row.len() - 1].is_empty()));
}

#[test]
fn parts_that_do_not_belong_together_are_not_merged() {
    let scene = ball("apart");
    let parts = scene.with_file_name("parts");
    let shard = |index, count| Shard::new(index, count);
    let run = |varied: &str, shard| shards(&scene, &parts, varied, shard, true).map(drop);
    let refused = || merge(&parts).unwrap_err().message;
    let missing = |what: &str| std::fs::remove_file(parts.join(what)).unwrap();
    assert!(refused().contains("cannot merge"), "no folder");
    run("speed=1:3:9", shard(3, 5)).unwrap();
    assert!(refused().contains("4 of 5 are missing: 1-2, 4-5"), "{}", refused());
    // What is to be a part of the same folder is one of the same study.
    assert!(run("speed=1:4:9", shard(1, 5)).unwrap_err().contains("varies other keys or values"));
    assert!(run("speed=1:3:9", shard(1, 4)).unwrap_err().contains("is one of 5, not of 4"));
    for index in [1, 2, 4, 5] {
        run("speed=1:3:9", shard(index, 5)).unwrap();
    }
    merge(&parts).unwrap();
    // A digit that is another one.
    let file = parts.join("part-00002-of-00005.csv");
    let rows = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, rows.replacen("completed", "completes", 1)).unwrap();
    assert!(refused().contains("one of the two was changed"), "{}", refused());
    run("speed=1:3:9", shard(2, 5)).unwrap();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), rows);
    // A part in place of another.
    let stem = |k: usize, kind: &str| parts.join(format!("part-0000{k}-of-00005.{kind}"));
    for kind in ["csv", "json"] {
        std::fs::copy(stem(1, kind), stem(2, kind)).unwrap();
    }
    assert!(refused().contains("one of the two was changed"), "{}", refused());
    missing("part-00002-of-00005.json");
    assert!(refused().contains("cannot read `part-00002-of-00005.json`"), "{}", refused());
    missing("part-00002-of-00005.csv");
    assert!(refused().contains("1 of 5 are missing: 2"), "{}", refused());
    // The scene is another one.
    std::fs::write(&scene, BALL.replace("mass = 1", "mass = 2")).unwrap();
    assert!(run("speed=1:3:9", shard(2, 5)).unwrap_err().contains("the scene file is not what it was"));
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}

/// Runs that failed are rows like others, unless they are to be tried again, or all have failed.
#[test]
fn runs_that_failed_are_not_done_again_unless_they_are_asked_for() {
    let scene = ball("failed");
    let folder = scene.with_file_name("study");
    let run = |varied: &str, last: usize, retry_failed: bool| {
        let points = Points::grid(vec![Vary::parse(varied).unwrap()]).unwrap();
        let journal = Some(folder.clone());
        let options = StudyOptions { points, journal, jobs: 1, resume: true, retry_failed, ..StudyOptions::default() };
        let stop = Arc::new(AtomicBool::new(false));
        let done = std::sync::Mutex::new(Vec::new());
        let told = |number: usize, _: &Run| {
            done.lock().unwrap().push(number);
            stop.store(number >= last, std::sync::atomic::Ordering::Relaxed);
        };
        let study = Study::run(&scene, &options, &told, &stop).unwrap();
        (done.into_inner().unwrap(), study)
    };
    let varied = "speed=1 kg,2,3 kg,4,5";
    let (done, stopped) = run(varied, 2, false);
    // Those that were not begun are heard of, too.
    assert_eq!((&done[..3], stopped.has_ended()), (&[0, 1, 2][..], false));
    assert!(stopped.table().csv().contains("not begun") && !stopped.table().overview().contains("not begun"));
    let (done, again) = run(varied, 3, true);
    assert_eq!(&done[..3], [0, 2, 3]);
    assert!(!again.has_ended());
    let (done, study) = run(varied, usize::MAX, false);
    assert_eq!((done, study.kept(), study.has_ended()), (vec![4], 4, true));
    study.write(&folder).unwrap();
    let resumed = std::fs::read_to_string(folder.join(STUDY_FILE)).unwrap();
    assert!(!folder.join("study.journal").exists());
    let whole = shards(&scene, &scene.with_file_name("whole"), varied, None, false).unwrap();
    assert_eq!((resumed, study.exit_code()), (whole.table().csv(), whole.exit_code()));
    // A mistake in what all runs share is mended in the scene, and the study begun anew in the same folder.
    let (done, _) = run("speed=1 kg,2 kg,3", 1, false);
    assert_eq!(&done[..2], [0, 1]);
    let (done, _) = run("speed=1 kg,2 kg,3", 1, false);
    assert_eq!(&done[..2], [0, 1]);
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}

/// A part is whole or not there; what was finished is not done again.
#[test]
fn a_shard_that_is_stopped_continues_where_it_was() {
    let scene = ball("stopped");
    let folder = scene.with_file_name("parts");
    let points = Points::grid(vec![Vary::parse("speed=1:3:9").unwrap()]).unwrap();
    let options = StudyOptions {
        points,
        shard: Shard::new(2, 2),
        journal: Some(folder.clone()),
        jobs: 1,
        resume: true,
        ..StudyOptions::default()
    };
    let stop = Arc::new(AtomicBool::new(false));
    let told = |number: usize, _: &Run| {
        if number == 5 {
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
        }
    };
    let study = Study::run(&scene, &options, &told, &stop).unwrap();
    assert_eq!((study.first, study.runs.len(), study.has_ended()), (4, 5, false));
    assert_eq!(study.write(&folder).unwrap(), None);
    let done = std::sync::Mutex::new(Vec::new());
    let told = |number: usize, _: &Run| done.lock().unwrap().push(number);
    let study = Study::run(&scene, &options, &told, &Arc::default()).unwrap();
    assert_eq!(*done.lock().unwrap(), [6, 7, 8]);
    assert_eq!(study.kept(), 2);
    let path = study.write(&folder).unwrap().unwrap();
    assert!(path.ends_with("part-00002-of-00002.csv") && !folder.join("part-00002-of-00002.journal").exists());
    assert_eq!(options.shard.unwrap().finished(&scene, &options, &folder).unwrap(), Some(path));
    std::fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}
