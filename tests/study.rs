//! Studies: the same whatever the number of threads, and each run the one that would have been done alone.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use odyn::session::Session;
use odyn::study::{Design, Outcome, Points, Span, Study, StudyOptions, Vary};

use crate::support::{Scratch, open, options, root, run};

const SETS: [&str; 1] = ["simulation.t_end=20 ms"];

fn study(folder: &Path, jobs: usize) -> Study {
    let varied = ["crank.radius=8mm:9mm:3", "rod.length=42mm,4kg"].map(|text| Vary::parse(text).unwrap());
    let options = StudyOptions {
        common: options(&SETS, &[]),
        points: Points::grid(varied.to_vec()).unwrap(),
        jobs,
        folder: Some(folder.to_path_buf()),
        ..StudyOptions::default()
    };
    Study::run(&root().join("scenes/compressor.toml"), &options, &|_, _| (), &Arc::default()).unwrap()
}

/// Byte by byte: the tables of the study and the results of every run.
#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let (one, two) = (Scratch::new(), Scratch::new());
    let (alone, together) = (study(one.path(), 1), study(two.path(), 2));
    assert_eq!(alone.table().csv(), together.table().csv());
    let mut compared = 0;
    for k in 1..=6 {
        let results = |scratch: &Scratch| fs::read(scratch.path().join(format!("run-{k}/results.csv"))).ok();
        let (a, b) = (results(&one), results(&two));
        assert!(a == b, "run {k} depends on the threads");
        compared += usize::from(a.is_some());
    }
    // Every other run has a length in kg.
    assert_eq!(compared, 3);
    assert_eq!(alone.exit_code(), 3);
}

#[test]
fn a_run_of_a_study_is_the_run_alone() {
    let scratch = Scratch::new();
    let study = study(scratch.path(), 2);
    let alone = run("compressor.toml", &[SETS[0], "crank.radius=8.5mm"]);
    let folder = Scratch::new();
    let session = open("compressor.toml", &[SETS[0], "crank.radius=8.5mm"]);
    session.run(Some(folder.path()), Box::new(|_| ()), &Arc::default()).unwrap();
    // All but what took time.
    for file in ["results.csv", "channels.json"] {
        let bytes = |folder: &Path| fs::read(folder.join(file)).unwrap();
        assert!(bytes(folder.path()) == bytes(&scratch.path().join("run-3")), "{file}");
    }
    let table = study.table();
    let row = &table.rows[2];
    assert_eq!(row[1..4], ["8.5mm", "42mm", "completed"]);
    for (channel, column) in alone.channels.iter().zip(&alone.columns) {
        let title = format!("final.{} [{}]", channel.name, channel.unit);
        let k = table.columns.iter().position(|c| *c == title).unwrap_or_else(|| panic!("no column `{title}`"));
        assert_eq!(row[k], column.last().unwrap().to_string(), "{title}");
    }
}

/// What does not pay within a short run pays over many: later runs begin with the code that earlier ones made.
#[test]
fn machine_code_is_made_once_for_all_runs() {
    let options = StudyOptions {
        common: options(&["simulation.t_end=20 ms"], &[]),
        points: Points::grid(vec![Vary::parse("crank.radius=8mm:9mm:30").unwrap()]).unwrap(),
        jobs: 1,
        ..StudyOptions::default()
    };
    let study = Study::run(&root().join("scenes/compressor.toml"), &options, &|_, _| (), &Arc::default()).unwrap();
    let summaries = || {
        study.runs.iter().map(|run| match &run.outcome {
            Outcome::Ran(finished) => &finished.summary,
            other => panic!("{other:?}"),
        })
    };
    let programs: Vec<u64> = summaries().map(|summary| summary.machine_code_programs).collect();
    let (first, last) = (summaries().next().unwrap(), summaries().next_back().unwrap());
    if first.machine_code_programs > 0 {
        assert!(last.machine_code_programs > first.machine_code_programs, "{programs:?}");
        assert_eq!(last.machine_code_from, Some(0.0));
        assert_eq!(last.machine_code_time_s, 0.0, "nothing is made again");
    }
}

/// Each run of a study has the bits of the run that shares nothing, or fails with its words.
fn has_the_bits_of_runs_alone(scene: &str, fixed: &[&str], points: Points) {
    let path = root().join(format!("scenes/{scene}.toml"));
    let options = StudyOptions { common: options(fixed, &[]), points, jobs: 1, ..StudyOptions::default() };
    let study = Study::run(&path, &options, &|_, _| (), &Arc::default()).unwrap();
    for (number, run) in study.runs.iter().enumerate() {
        let place = format!("{scene}, run {}", number + 1);
        let mut own = crate::support::options(fixed, &[]);
        own.overrides.extend(options.points.changes(number));
        let alone = Session::open(&path, &own).and_then(|session| session.run(None, Box::new(|_| ()), &Arc::default()));
        let (alone, finished) = match (&alone, &run.outcome) {
            (Ok(alone), Outcome::Ran(finished)) => (alone, finished),
            (Err(alone), Outcome::Failed(error)) => {
                assert_eq!(error.to_string(), alone.to_string(), "{place}");
                continue;
            }
            other => panic!("{place}: {other:?}"),
        };
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let ends: Vec<f64> = alone.columns.iter().map(|column| column.last().copied().unwrap_or(f64::NAN)).collect();
        assert_eq!(bits(&finished.last), bits(&ends), "{place}");
        let (one, other) = (&finished.summary, &alone.summary);
        assert_eq!(one.evaluations, other.evaluations, "{place}");
        assert_eq!(one.steps, other.steps, "{place}");
        assert_eq!(format!("{:?}", one.audit), format!("{:?}", other.audit), "{place}");
        assert_eq!(format!("{:?}", one.figures), format!("{:?}", other.figures), "{place}");
    }
}

fn grid(varied: &[&str]) -> Points {
    Points::grid(varied.iter().map(|text| Vary::parse(text).unwrap()).collect()).unwrap()
}

/// Variants are written along the first one, as far as their numbers leave the operations what they are: contacts, friction, opaque
/// elements, islands, tables and states among them; gravity that vanishes, or is along one axis, leaves others.
#[test]
fn runs_of_a_study_have_the_bits_of_runs_that_share_nothing() {
    let scenes = [
        "compressor-speed-control",
        "verification/joint-friction-loop",
        "verification/plane-contact-friction",
        "verification/rope",
        "verification/cam-points",
        "verification/modal-body",
        "verification/integral",
        "verification/gear-planetary",
        "verification/motor-torque",
        "verification/beam",
    ];
    let fixed = ["simulation.t_end=\"5 ms\"", "simulation.output_step=\"1 ms\""];
    for scene in scenes {
        let gravities = "[0, 0, 0],[0.5, -9, 0.1],[0.4, -8, 0.2],[0, 0, -9.81],[0.4, -9, 0.3]";
        has_the_bits_of_runs_alone(scene, &fixed, grid(&[&format!("simulation.gravity={gravities}")]));
    }
}

/// Masses, lengths, places, coefficients; numbers that pass through zero and one, that become equal to others, and that change which
/// rows are independent.
#[test]
fn whatever_is_varied_runs_have_the_bits_of_runs_that_share_nothing() {
    let short = ["simulation.t_end=\"20 ms\""];
    let varied: [&[&str]; 7] = [
        &["body.piston.mass=0.025,0.03,0.04,1,0.5,0.026", "crank.radius=8mm,9mm"],
        &["rod.com=15.75mm,0mm,21mm,-3mm,42mm,10mm"],
        &["joint.cylinder.axis=[1,0,0],[2,0,0],[1,0,1e-9]", "body.rotor.inertia=[500,500,30],[1,1,1],[500,400,30]"],
        &["joint.main_bearing.point=[0,0,0],[0,0,1],[0,0.1,0],[0,0,-2]"],
        &["force.bearing_friction.params.damping=2.5 N mm ms/rad,0 N mm ms/rad,1 N m s/rad,-1 N mm ms/rad"],
        &["force.motor.params.breakdown_slip=0.2,0.5,1,0.1", "force.motor.params.breakdown_torque=0.246 N m,1 N m"],
        &["body.rotor.angular_velocity=[0,0,0.32],[0,0,0],[0,0,1],[0,0,-0.3]"],
    ];
    for varied in varied {
        has_the_bits_of_runs_alone("compressor", &short, grid(varied));
    }
    let oscillators = grid(&[
        "m=2,1",
        "force.strut.params.stiffness=50,0,1,70",
        "force.strut.params.free_length=1,0",
        "force.strut.params.damping=3,0",
    ]);
    has_the_bits_of_runs_alone("verification/translational-spring-damper", &["simulation.t_end=0.2"], oscillators);
}

/// Points that nobody has chosen, between ends that some numbers vanish or become one at.
#[test]
fn random_variants_have_the_bits_of_runs_that_share_nothing() {
    let designed = |spans: &[&str], count, seed| {
        let spans: Vec<Span> = spans.iter().map(|text| Span::parse(text).unwrap()).collect();
        Points::designed(&spans, Design::LatinHypercube { count, seed }).unwrap()
    };
    let spans = [
        "crank.radius=7mm:10mm",
        "rod.length=38mm:45mm",
        "rod.com=-10mm,0mm,15mm,20mm,40mm",
        "body.piston.mass=0.01:1",
        "joint.main_bearing.point=[0,0,0],[0,0,1],[0,0,-1.5]",
    ];
    has_the_bits_of_runs_alone("compressor", &["simulation.t_end=\"10 ms\""], designed(&spans, 16, 3));
    let spans = ["body.link1.mass=0.5:2", "rod.axial=1e-4:1e-2", "body.coupler2.mass=1,2,0.5"];
    has_the_bits_of_runs_alone("benchmarks/A02_N2", &["simulation.t_end=0.3"], designed(&spans, 10, 5));
}

/// Rows of cranks are parallel linkages, whose loops are written out, for some of these points only.
#[test]
fn variants_that_are_no_parallelograms_have_the_bits_of_runs_that_share_nothing() {
    let points =
        grid(&["joint.A1.point=[1,0,0],[1.01,0,0],[1,0,0],[1,-0.02,0],[1.01,0.01,0]", "body.link1.mass=1,1.5"]);
    has_the_bits_of_runs_alone("benchmarks/A02_N2", &["simulation.t_end=0.3"], points);
}
