//! Outputs over time: those of the run alone, at its samples, with the same bytes however a study is divided and interrupted.

use std::fs;
use std::sync::atomic::Ordering;

use super::*;

fn options(folder: &Path, varied: &str, series: &[&str], take: Taken) -> StudyOptions {
    StudyOptions {
        points: Points::grid(vec![Vary::parse(varied).unwrap()]).unwrap(),
        journal: Some(folder.into()),
        series: Some(Series::parse(series, take).unwrap()),
        jobs: 1,
        ..StudyOptions::default()
    }
}

/// Runs it, writes it, and gives what it wrote.
fn written(scene: &Path, options: &StudyOptions) -> Result<String, String> {
    let study = Study::run(scene, options, &|_, _| (), &Arc::default()).map_err(|error| error.message.clone())?;
    let folder = options.journal.as_deref().unwrap();
    study.write(folder).unwrap();
    Ok(fs::read_to_string(study.series_file(folder).unwrap()).unwrap())
}

/// The ball with an output every 10 ms.
fn fine(name: &str) -> std::path::PathBuf {
    let scene = ball(name);
    fs::write(&scene, BALL.replace("output_step = 0.5", "output_step = 0.01")).unwrap();
    scene
}

#[test]
fn rows_are_samples_of_the_run_alone() {
    let scene = fine("series-rows");
    let folder = scene.with_file_name("study");
    let mut run = options(&folder, "speed=1,3 m/s", &["x"], Taken::Every(1));
    run.folder = Some(folder.clone());
    let all = written(&scene, &run).unwrap();
    assert_eq!(all.lines().next(), Some("run,t [s],x [m]"));
    assert_eq!(all.lines().count(), 1 + 2 * 101);
    for (number, way) in [("1", 1.0), ("2", 3.0)] {
        let mut own = all.lines().filter_map(|line| line.strip_prefix(&format!("{number},")));
        let alone = fs::read_to_string(folder.join(format!("run-{number}/results.csv"))).unwrap();
        let bits = |line: &str| line.split(',').map(|cell| cell.parse::<f64>().unwrap().to_bits()).collect::<Vec<_>>();
        assert!(own.clone().map(bits).eq(alone.lines().skip(1).map(bits)), "run {number}");
        let last: f64 = own.next_back().unwrap().split_once(',').unwrap().1.parse().unwrap();
        assert!((last - way).abs() < 1e-12);
    }
    // Fewer samples are those of all.
    for (take, places) in [
        (Taken::Every(40), vec![0, 40, 80]),
        (Taken::Every(1000), vec![0]),
        (Taken::Spread(2), vec![0, 100]),
        (Taken::Spread(4), vec![0, 33, 67, 100]),
        (Taken::Spread(1000), (0..101).collect()),
    ] {
        let some = written(&scene, &options(&folder.join("some"), "speed=1,3 m/s", &["*"], take)).unwrap();
        let lines: Vec<&str> = all.lines().collect();
        let own = |run: usize| places.iter().map(|place| lines[1 + run + place]).collect::<Vec<_>>();
        let expected = [own(0), own(101)].concat();
        assert!(some.lines().skip(1).eq(expected), "{take:?}");
    }
    for count in 2..40 {
        for samples in count..200 {
            let taken: Vec<usize> = Taken::Spread(count).of(samples).collect();
            assert_eq!((taken.len(), taken[0], taken[count - 1]), (count, 0, samples - 1));
            assert!(taken.windows(2).all(|pair| pair[0] < pair[1]), "{count} of {samples}: {taken:?}");
        }
    }
    assert_eq!(Taken::Spread(2).of(1).collect::<Vec<_>>(), [0]);
    assert_eq!(Taken::Every(3).of(0).count(), 0);
    fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}

/// Runs that fail have no rows; what only some have in a unit has a column of its own; threads end in any order.
#[test]
fn parts_make_the_series_of_the_whole() {
    for (name, varied, header) in [
        ("series-failing", "speed=1 kg,2 kg,1,2,3 kg,4", "run,t [s],x [m]"),
        ("series-none", "speed=1 kg,2 kg", "run"),
        (
            "series-units",
            "output.x.quantity=\"position\",\"velocity\",\"acceleration\",\"velocity\",\"position\"",
            "run,t [s],x [m],x [m/s],x [m/s^2]",
        ),
    ] {
        let scene = fine(name);
        let folder = |name: &str| scene.with_file_name(name);
        let take = Taken::Spread(7);
        let whole = written(&scene, &options(&folder("whole"), varied, &["x"], take)).unwrap();
        assert_eq!(whole.lines().next(), Some(header), "{name}");
        assert!(whole.lines().all(|line| line.split(',').count() == header.split(',').count()), "{whole}");
        let several = StudyOptions { jobs: 3, ..options(&folder("several"), varied, &["x"], take) };
        assert_eq!(written(&scene, &several).unwrap(), whole);
        for count in [1, 2, 4, 7] {
            let parts = folder(&format!("parts-{count}"));
            for index in (1..=count).rev() {
                let shard = Shard::new(index, count);
                written(&scene, &StudyOptions { shard, ..options(&parts, varied, &["x"], take) }).unwrap();
            }
            let merged = merge(&parts).unwrap();
            assert_eq!(fs::read_to_string(merged.series.unwrap()).unwrap(), whole, "{name}, {count} parts");
            let table = |folder: &Path| fs::read_to_string(folder.join(STUDY_FILE)).unwrap();
            assert_eq!(table(&parts), table(&folder("whole")));
        }
        fs::remove_dir_all(scene.parent().unwrap()).unwrap();
    }
}

/// Stopped after some runs, and killed within a line of the journal.
#[test]
fn series_are_kept_where_a_study_is_interrupted() {
    let scene = fine("series-resumed");
    let folder = scene.with_file_name("study");
    let varied = "speed=1 kg,1,3,2,6,4,5";
    let whole = written(&scene, &options(&scene.with_file_name("whole"), varied, &["x"], Taken::Every(5))).unwrap();
    let resumed = StudyOptions { resume: true, ..options(&folder, varied, &["x"], Taken::Every(5)) };
    let stop = Arc::new(AtomicBool::new(false));
    let told = |number: usize, _: &Run| stop.store(number >= 3, Ordering::Relaxed);
    let study = Study::run(&scene, &resumed, &told, &stop).unwrap();
    assert!(!study.has_ended());
    study.write(&folder).unwrap();
    let so_far = fs::read_to_string(folder.join(SERIES_FILE)).unwrap();
    assert!(whole.starts_with(&so_far) && so_far.lines().count() == 1 + 3 * 21, "{so_far}");
    let journal = folder.join(JOURNAL_FILE);
    let bytes = fs::read(&journal).unwrap();
    fs::write(&journal, &bytes[..bytes.len() - 100]).unwrap();
    // Others are not of this study.
    let others = [
        StudyOptions { resume: true, ..options(&folder, varied, &["x"], Taken::Every(6)) },
        StudyOptions { series: None, ..resumed.clone() },
    ];
    for other in &others {
        let error = Study::run(&scene, other, &|_, _| (), &Arc::default()).unwrap_err();
        assert!(error.message.contains("other series"), "{}", error.message);
    }
    let done = std::sync::Mutex::new(Vec::new());
    let told = |number: usize, _: &Run| done.lock().unwrap().push(number);
    let study = Study::run(&scene, &resumed, &told, &Arc::default()).unwrap();
    // Another program that did the same has ended, and removed the journal.
    fs::remove_file(&journal).unwrap();
    study.write(&folder).unwrap();
    assert_eq!(*done.lock().unwrap(), [3, 4, 5, 6]);
    assert_eq!(fs::read_to_string(folder.join(SERIES_FILE)).unwrap(), whole);
    assert!(!journal.exists());
    // A study without series leaves none of another one beside its table.
    shards(&scene, &folder, "speed=1,2", None, false).unwrap();
    assert!(!folder.join(SERIES_FILE).exists());
    fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}

#[test]
fn series_that_were_changed_are_no_part() {
    let scene = fine("series-changed");
    let parts = scene.with_file_name("parts");
    let part = |index| StudyOptions {
        shard: Shard::new(index, 2),
        resume: true,
        ..options(&parts, "speed=1,2,3,4", &["x"], Taken::Spread(3))
    };
    written(&scene, &part(1)).unwrap();
    written(&scene, &part(2)).unwrap();
    merge(&parts).unwrap();
    let file = parts.join("series-00002-of-00002.csv");
    let rows = fs::read_to_string(&file).unwrap();
    fs::write(&file, rows.replacen("3,", "3,1", 1)).unwrap();
    let refused = |error: Box<crate::diagnostics::Diagnostic>| {
        assert!(error.message.contains("series-00002-of-00002.csv has no series of a part"), "{}", error.message);
    };
    refused(merge(&parts).unwrap_err());
    refused(Shard::new(2, 2).unwrap().finished(&scene, &part(2), &parts).unwrap_err());
    fs::remove_file(&file).unwrap();
    refused(merge(&parts).unwrap_err());
    assert_eq!(written(&scene, &part(2)).unwrap(), rows);
    merge(&parts).unwrap();
    fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}

#[test]
fn series_that_cannot_be_kept_are_refused() {
    let parse = |names: &[&str], take| Series::parse(names, take).unwrap_err().message;
    assert!(parse(&["x,,y"], Taken::Every(1)).contains("no name"));
    assert!(parse(&["x", "y, x"], Taken::Every(1)).contains("`x` is a series twice"));
    assert!(parse(&["x"], Taken::Every(0)).contains("every 0th"));
    assert!(parse(&["x"], Taken::Spread(1)).contains("two samples"));
    let scene = fine("series-refused");
    let folder = scene.with_file_name("study");
    let error = written(&scene, &options(&folder, "speed=1,2", &["y"], Taken::Every(1))).unwrap_err();
    assert!(error.contains("no output `y`"), "{error}");
    let without = StudyOptions { journal: None, ..options(&folder, "speed=1,2", &["x"], Taken::Every(1)) };
    let error = Study::run(&scene, &without, &|_, _| (), &Arc::default()).unwrap_err();
    assert!(error.message.contains("journal"), "{}", error.message);
    fs::remove_dir_all(scene.parent().unwrap()).unwrap();
}
