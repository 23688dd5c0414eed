//! Runs that are interrupted and resumed.

use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use crate::results::{RESULTS_FILE, SUMMARY_FILE, seal, unseal};

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("odyn-checkpoint-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        Self(folder)
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.join(name)).unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Continuous and discrete states, an angle over many turns, friction that switches, a loop-free and a merged body.
pub(super) fn machine(keys: &str) -> String {
    settings(&format!("gravity = [0, -9.81, 0]; t_end = 4; output_step = 0.13; checkpoint_every = 0.5; {keys}"))
        + "[[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.2]\nangular_velocity = [0, 0, 30]\n\
           [[body]]\nname = \"arm\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [0.5, 0, 0]\n\
           [[joint]]\nname = \"pivot\"\ntype = \"hinge\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0.1, 0, 0]\naxis = [0, 0, 1]\n\
           [[joint]]\nname = \"elbow\"\ntype = \"hinge\"\nbodies = [\"wheel\", \"arm\"]\npoint = [0.4, 0, 0]\naxis = [0, 0, 1]\n\
           [[force]]\nname = \"lag\"\ntype = \"lag\"\nbodies = [\"wheel\"]\nparams.tau = 2.0\n\
           [[force]]\nname = \"strut\"\ntype = \"strut\"\nbodies = [\"ground\", \"arm\"]\npoints = [[0, -1, 0], [0.5, 0, 0]]\n\
           params = { stiffness = 5, damping = 0.2 }\n\
           [[force]]\nname = \"tally\"\ntype = \"tally\"\nbodies = [\"wheel\"]\n"
        + &output("phi", "quantity = \"coordinate\"; of = \"pivot\"")
        + &output("psi", "quantity = \"coordinate\"; of = \"elbow\"")
        + &output("steps", "quantity = \"value\"; of = \"tally\"; channel = \"steps\"")
        + &output("lagging", "quantity = \"value\"; of = \"lag\"")
        + &output("load", "quantity = \"reaction_force\"; of = \"pivot\"; component = \"y\"")
}

#[test]
fn a_run_that_is_resumed_gives_the_same_bytes_and_counters() {
    for keys in [
        "formulation = \"joint\"",
        "formulation = \"cartesian\"",
        "method = \"radau5\"; tolerance = 1e-8",
        "method = \"auto\"; engine = \"compiled\"",
        "engine = \"reference\"; tolerance = 1e-6",
        "fixed_step = 0.002; method = \"rk4\"",
    ] {
        let (alone, often) = (Scratch::new("alone"), Scratch::new("often"));
        let text = machine(keys);
        let whole = go_on(&text, &alone.0, 2.0);
        assert_eq!((whole.summary.status, whole.summary.checkpoints, whole.summary.resumed), (Status::Completed, 7, 0));
        // Before the first checkpoint, between two, and in the last stretch.
        for until in [0.01, 0.3, 0.31, 0.6, 0.9, 0.95] {
            let part = go_on(&text, &often.0, until);
            assert_eq!(part.summary.status, Status::StoppedEarly, "{keys}");
            assert!(part.columns[0].len() < whole.columns[0].len());
        }
        let resumed = go_on(&text, &often.0, 2.0);
        assert_eq!((resumed.summary.status, resumed.summary.resumed), (Status::Completed, 6));
        assert!(often.read(RESULTS_FILE) == alone.read(RESULTS_FILE), "{keys}");
        assert!(often.read(STATE_FILE) == alone.read(STATE_FILE), "{keys}");
        assert_eq!(
            (&resumed.times, &resumed.columns),
            (&whole.times, &whole.columns),
            "figures and checks see all rows"
        );
        let (mut a, mut b) = (resumed.summary, whole.summary);
        let counts = |summary: &mut crate::results::Summary| {
            let all = summary.counts().into_iter().map(|(name, count)| (name, *count));
            all.filter(|(name, _)| *name != "machine_code_programs").collect::<Vec<_>>()
        };
        // When programs are compiled depends on the work to come, not the results.
        let (a_counts, b_counts) = (counts(&mut a), counts(&mut b));
        assert_eq!(a_counts, b_counts, "{keys}");
        assert_eq!(a.audit, b.audit, "{keys}");
        assert!(!often.0.join(CHECKPOINT_FILE).exists(), "nothing is left to resume");
    }
}

#[test]
fn checkpoints_change_a_run_by_less_than_its_tolerance() {
    let folder = Scratch::new("same");
    let text = machine("");
    let with = go_on(&text, &folder.0, 2.0);
    // Without a folder there are no checkpoints.
    let without = run(&text);
    assert_eq!((without.summary.checkpoints, with.summary.checkpoints), (0, 7));
    for name in ["phi", "psi", "lagging"] {
        let pairs = column(&with, name).iter().zip(column(&without, name));
        let off = pairs.map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f64::max);
        assert!(off < 1e-8, "{name}: {off:e}");
    }
    assert_eq!(with.times, without.times);
    // The audit goes over the whole run.
    assert!(with.summary.audit.worst() < 1e-8, "{:?}", with.summary.audit);
    let (a, b) = (with.summary.audit.work, without.summary.audit.work);
    assert!((a - b).abs() < 1e-7 * b.abs() && b != 0.0, "{a} or {b}");
}

#[test]
fn a_run_that_went_on_from_another_is_resumed_from_there() {
    let (first, alone, often) = (Scratch::new("first"), Scratch::new("from-alone"), Scratch::new("from-often"));
    go_on(&machine("").replace("t_end = 4", "t_end = 1"), &first.0, 2.0);
    let state = Restart::read(&first.0).unwrap();
    let mut session = open(&machine(""));
    session.go_on_from(state.clone()).unwrap();
    session.run(Some(&alone.0), Box::new(|_| ()), &Arc::default()).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let mut session = open(&machine(""));
    session.go_on_from(state).unwrap();
    let half = move |share: f64| flag.store(share > 0.5, Ordering::Relaxed);
    session.run(Some(&often.0), Box::new(half), &stop).unwrap();
    go_on(&machine(""), &often.0, 2.0);
    assert!(often.read(RESULTS_FILE) == alone.read(RESULTS_FILE));
}

#[test]
fn the_limit_of_steps_is_that_of_the_whole_run() {
    let folder = Scratch::new("limit");
    let all = go_on(&machine(""), &folder.0, 2.0).summary;
    let limit = (all.steps + all.rejected) / 2;
    let summary = go_on(&machine(&format!("max_steps = {limit}")), &folder.0, 2.0).summary;
    assert_eq!((summary.status, summary.steps + summary.rejected), (Status::StoppedEarly, limit));
    assert!(summary.reason.contains(&format!("limit of {limit} steps")), "{}", summary.reason);
}

#[test]
fn a_checkpoint_that_does_not_fit_is_refused_with_what_differs() {
    let folder = Scratch::new("other");
    let text = machine("");
    go_on(&text, &folder.0, 0.4);
    let point = Checkpoint::read(&folder.0).unwrap();
    let refusal = |text: &str, point: &Checkpoint| open(text).resume(point.clone()).map_err(|e| e.to_string());
    assert!(refusal(&text, &point).is_ok());
    let other = refusal(&text.replace("mass = 1", "mass = 2"), &point).unwrap_err();
    assert!(other.contains("ODY0804") && other.contains("the scene file"), "{other}");
    let changed = |from: &str, to: &str| {
        let text = point.to_text().unwrap();
        assert!(text.contains(from), "{text}");
        Checkpoint::from_text(&seal(unseal(&text).unwrap().replace(from, to)))
    };
    let library = refusal(&text, &changed("version = \"1.0.0\"", "version = \"0.9.0\"").unwrap()).unwrap_err();
    assert!(library.contains("`foreign` is 1.0.0") && library.contains("it was 0.9.0"), "{library}");
    let program = changed(&format!("odyn = \"{}\"", env!("CARGO_PKG_VERSION")), "odyn = \"0.0.1\"").unwrap();
    assert!(refusal(&text, &program).unwrap_err().contains("one of odyn 0.0.1"));
    assert!(
        changed("format = 6\ntaken", "format = 9\ntaken").unwrap_err().contains("format is 9, that of a newer odyn")
    );
    // Whatever else an older one had.
    let older = changed("format = 6\ntaken", "format = 1\nhad").unwrap_err();
    assert!(older.contains("format is 1, that of an older odyn; this one knows 6"), "{older}");
    // The same without a new checksum, and without any.
    let text = point.to_text().unwrap();
    for (text, why) in [
        (text.replacen("taken = ", "taken = 1", 1), "its checksum does not fit"),
        (unseal(&text).unwrap().to_owned(), "it has no checksum at its end"),
    ] {
        assert!(Checkpoint::from_text(&text).unwrap_err().contains(why));
    }
    let missing = Checkpoint::read(Path::new("no such folder")).unwrap_err();
    assert!(missing.message.contains("cannot resume from"), "{missing:?}");
}

#[test]
fn a_table_that_is_not_the_one_of_the_checkpoint_is_refused_and_kept() {
    let folder = Scratch::new("table");
    let text = machine("");
    go_on(&text, &folder.0, 0.4);
    let table = folder.0.join(RESULTS_FILE);
    let good = fs::read(&table).unwrap();
    let resume = || {
        let mut session = open(&text);
        session.resume(Checkpoint::read(&folder.0).unwrap()).unwrap();
        session.run(Some(&folder.0), Box::new(|_| ()), &Arc::default()).map(|_| ()).map_err(|e| (e.exit, e.to_string()))
    };
    let mut odd = good.clone();
    // A digit in the last row before the checkpoint.
    let (at, _) = good.iter().enumerate().rev().filter(|(_, c)| **c == b'1').nth(40).unwrap();
    odd[at] = b'7';
    for (bad, why) in [(&good[..20], "shorter"), (&odd[..], "not what it was")] {
        fs::write(&table, bad).unwrap();
        let (exit, told) = resume().unwrap_err();
        assert!(exit == Exit::Files && told.contains(RESULTS_FILE) && told.contains(why), "{told}");
        assert_eq!(fs::read(&table).unwrap(), bad, "nothing is lost");
    }
    // A part of a row, as a kill may leave it, is cut off; the run had no chance to complete its summary.
    fs::write(folder.0.join(SUMMARY_FILE), "{ \"status\": \"running\" }").unwrap();
    fs::write(&table, [&good[..], b"3.9,1."].concat()).unwrap();
    assert_eq!(
        crate::results::Table::read(&table).unwrap().times.len(),
        good.iter().filter(|c| **c == b'\n').count() - 1
    );
    resume().unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&folder.read(SUMMARY_FILE)).unwrap();
    assert_eq!(summary["status"], "completed");
}

#[cfg(unix)]
#[test]
fn two_runs_do_not_write_one_folder() {
    let folder = Scratch::new("two");
    let text = machine("");
    let (inner, path) = (text.clone(), folder.0.clone());
    let mut told = None;
    let progress = |_| {
        told.get_or_insert_with(|| {
            let second = open(&inner).run(Some(&path), Box::new(|_| ()), &Arc::default());
            second.map(|_| ()).map_err(|error| (error.exit, error.to_string()))
        });
    };
    open(&text).run(Some(&folder.0), Box::new(progress), &Arc::default()).unwrap();
    let (exit, told) = told.unwrap().unwrap_err();
    assert!(exit == Exit::Files && told.contains("another run writes it"), "{told}");
    assert_eq!(folder.read(RESULTS_FILE).iter().filter(|c| **c == b'\n').count(), 32);
}

#[test]
fn islands_apart_have_no_checkpoints() {
    let folder = Scratch::new("apart");
    let text = machine("islands = \"apart\"") + "[[body]]\nname = \"stone\"\nmass = 1\ninertia = [1, 1, 1]\n";
    let error = open(&text).run(Some(&folder.0), Box::new(|_| ()), &Arc::default()).unwrap_err();
    assert!(error.exit == Exit::Scene && error.to_string().contains("islands apart"), "{error}");
    assert!(!folder.0.exists());
}

#[test]
fn a_run_is_verified_by_a_sharper_one() {
    let verified = |keys: &str| {
        let session = open(&machine(keys));
        let (second, how) = session.sharper().unwrap();
        let mut report = session.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        let second = second.run(None, Box::new(|_| ()), &Arc::default());
        report.verify(&how, second.as_ref());
        report.summary.verified.unwrap()
    };
    let rough = verified("tolerance = 1e-5");
    assert_eq!(
        (rough.how.as_str(), rough.problem.as_str()),
        ("radau5 instead of dop853, tolerance 1e-6 instead of 1e-5, steps up to 0.02 s", "")
    );
    let names: Vec<&str> = rough.outputs.iter().map(|output| output.name.as_str()).collect();
    assert_eq!(names, ["phi", "psi", "steps", "lagging", "load"]);
    // What it reports is the error: against a run that is sharper by far.
    let exact = column(&run(&machine("tolerance = 1e-12")), "psi").to_vec();
    let own = run(&machine("tolerance = 1e-5"));
    let error = column(&own, "psi").iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let told = rough.outputs[1].absolute;
    assert!(told > 0.3 * error && told < 3.0 * error && error > 0.0, "told {told:e}, is {error:e}");
    let fine = verified("tolerance = 1e-9");
    assert!(fine.outputs[1].absolute < 0.01 * told, "{:e}", fine.outputs[1].absolute);
    let fixed = verified("method = \"rk4\"; fixed_step = 0.004");
    assert_eq!(fixed.how, "radau5 instead of rk4, steps of 0.002 s instead of 0.004 s");
    assert!(fixed.outputs[1].absolute > 0.0);
}
