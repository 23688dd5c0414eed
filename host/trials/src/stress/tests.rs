//! Tests of what is read, chosen and judged, with scenes that need no library. `tests/stress.rs` runs the real suite.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::*;
use crate::diagnostics::{Diagnostic, Source, codes};

/// A body that spins about a principal axis: all numbers are known.
const SPIN: &str = r#"
[simulation]
t_end = 1
output_step = 0.25
[parameters]
L = 1
[[body]]
name = "top"
mass = 2
inertia = ["L^2", "2 * L^2", "3 * L^2"]
position = ["3 * L", 0, 0]
velocity = ["L", 0, 0]
angular_velocity = [0, 0, 4]
[[output]]
name = "x"
quantity = "position"
of = "top"
component = "x"
[[output]]
name = "E"
quantity = "kinetic_energy"
[[check]]
name = "place"
kind = "position"
value = "x"
reference = "L * (3 + t)"
tolerance = 1e-12
"#;

/// A folder with the scene, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("odyn-stress-{}-{number}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("spin.toml"), SPIN).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A trial of the scene.
fn trial(name: &str, more: &str) -> String {
    format!("[[trial]]\nname = \"{name}\"\nfamily = \"f\"\ntext = \"t\"\nscene = \"spin.toml\"\n{more}\n")
}

fn suite(text: &str, folder: &Folder) -> Suite {
    Suite::parse(Source::new("suite.toml", text), &folder.0).unwrap_or_else(|error| panic!("{error}"))
}

/// The outcomes of a suite of that text.
#[track_caller]
fn outcomes(text: &str) -> Vec<Outcome> {
    let folder = Folder::new();
    run(&suite(text, &folder), &[], &Settings::default(), &|_| (), &Arc::default()).unwrap()
}

/// What is wrong with a suite of that text.
#[track_caller]
fn refused(text: &str) -> Vec<Diagnostic> {
    let error = Suite::parse(Source::new("suite.toml", text), "".as_ref()).err().unwrap();
    assert!(error.diagnostics.iter().all(|diagnostic| diagnostic.code == codes::BAD_SUITE), "{error}");
    error.diagnostics
}

/// The only fault of the only outcome.
#[track_caller]
fn fault(text: &str) -> String {
    let outcomes = outcomes(text);
    let [outcome] = &outcomes[..] else { panic!("{outcomes:?}") };
    let [fault] = &outcome.faults[..] else { panic!("{outcome:?}") };
    assert!(!outcome.passed());
    fault.clone()
}

const BOUNDS: &str = "bounds = { position = 0, velocity = 0, energy = 1e-14 }";

#[test]
fn what_is_as_expected_passes() {
    let outcomes = outcomes(&trial("spin", BOUNDS));
    let [outcome] = &outcomes[..] else { panic!("{outcomes:?}") };
    assert!(outcome.passed(), "{outcome:?}");
    let names: Vec<&str> = outcome.measures.iter().map(|measure| measure.what.as_str()).collect();
    assert_eq!(names, ["violation of joints", "violation of rates", "energy balance", "place"]);
    assert!(outcome.work.steps > 0 && outcome.formulation == "auto");
}

#[test]
fn a_broken_bound_is_told() {
    let folder = Folder::new();
    let text = trial("spin", &format!("{BOUNDS}\nset = [\"check.place.reference=L * (3.01 + t)\"]"));
    let outcomes = run(&suite(&text, &folder), &[], &Settings::default(), &|_| (), &Arc::default()).unwrap();
    let outcome = &outcomes[0];
    assert!(!outcome.passed() && outcome.faults.is_empty(), "{outcome:?}");
    let worst = outcome.worst().unwrap();
    assert_eq!(worst.what, "place");
    assert!((worst.found - 0.01).abs() < 1e-12 && worst.bound == 1e-12 && !worst.passed(), "{worst:?}");
}

#[test]
fn what_is_no_number_is_the_worst_and_does_not_pass() {
    let measure = |found: f64| Measure { what: found.to_string(), found, bound: 1.0 };
    let outcome = Outcome { measures: vec![measure(7.0), measure(f64::NAN), measure(9.0)], ..Outcome::default() };
    assert!(!outcome.passed() && outcome.worst().unwrap().found.is_nan());
    let zero = Measure { what: String::new(), found: 0.0, bound: 0.0 };
    assert!(zero.passed() && zero.share() == 0.0);
}

#[test]
fn a_scene_that_is_refused_must_say_what_is_expected() {
    let broken = "set = [\"top.mass=-1\"]\nrefused = { code = \"ODY0307\", words = [\"top\"] }";
    let passed = outcomes(&trial("mass", broken));
    assert!(passed[0].passed() && passed[0].said.contains("ODY0307"), "{passed:?}");
    let said = fault(&trial("mass", &broken.replace("ODY0307", "ODY0308")));
    assert!(said.contains("refused without ODY0308"), "{said}");
    let said = fault(&trial("mass", &broken.replace("\"top\"]", "\"wheel\"]")));
    assert!(said.contains("does not say `wheel`"), "{said}");
    let said = fault(&trial("mass", "refused = { code = \"ODY0307\" }\nset = [\"check.place.tolerance=1\"]"));
    assert!(said.contains("not refused with ODY0307: completed"), "{said}");
    let said = fault(&trial("mass", "set = [\"top.mass=-1\"]\nbounds = {}"));
    assert!(said.starts_with("refused: error[ODY0307]"), "{said}");
}

#[test]
fn a_run_that_ends_early_must_say_what_is_expected() {
    let short = "set = [\"simulation.max_steps=1\", \"simulation.fixed_step=0.1\"]";
    let stopped = format!("{short}\nstopped = {{ code = \"ODY0604\", words = [\"limit of 1 step\"] }}");
    let passed = outcomes(&trial("steps", &stopped));
    assert!(passed[0].passed() && passed[0].said.contains("stopped early"), "{passed:?}");
    let said = fault(&trial("steps", &format!("{short}\nbounds = {{}}")));
    assert!(said.starts_with("stopped early at t = 0.1 s"), "{said}");
    let said = fault(&trial("steps", "stopped = { code = \"ODY0604\" }"));
    assert!(said.contains("not stopped with ODY0604: completed"), "{said}");
}

#[test]
fn warnings_must_be_given() {
    let unreal = "set = [\"top.inertia=[1, 1, 5]\"]\nbounds = {}\n";
    let passed = outcomes(&trial("inertia", &format!("{unreal}warns = {{ code = \"ODY0309\", words = [\"top\"] }}")));
    assert!(passed[0].passed() && passed[0].said.contains("ODY0309"), "{passed:?}");
    let said = fault(&trial("inertia", "bounds = {}\nwarns = { code = \"ODY0309\" }"));
    assert_eq!(said, "no warning ODY0309");
}

#[test]
fn reactions_must_be_marked() {
    let said = fault(&trial(
        "none",
        "bounds = {}\nreactions = { shared = [\"a on b: force x\"], unique = [\"c on d: force x\"] }",
    ));
    assert_eq!(said, "`a on b: force x` is not determined, but not marked so");
}

#[test]
fn machines_of_another_size_are_compared() {
    let first = trial("one", "bounds = {}");
    let larger = |length: f64, within: f64| {
        let equals = format!("equals = {{ trial = \"one\", within = {within:e}, length = {length:?} }}");
        outcomes(&(first.clone() + &trial("two", &format!("set = [\"L=10\"]\nbounds = {{}}\n{equals}"))))
    };
    let passed = larger(10.0, 1e-14);
    assert!(passed.iter().all(Outcome::passed), "{passed:?}");
    assert_eq!(passed[1].measures.len(), 3, "a check and two outputs");
    let failed = larger(1.0, 1e-14);
    let broken: Vec<&str> =
        failed[1].measures.iter().filter(|measure| !measure.passed()).map(|measure| measure.what.as_str()).collect();
    assert_eq!(broken, ["`x` against one", "`E` against one"]);
    assert!(failed[1].measure("`x` against one").is_some_and(|measure| (measure.found - 9.0).abs() < 1e-12));
}

#[test]
fn samples_at_other_times_are_not_compared() {
    let equals = "equals = { trial = \"one\", within = 1 }";
    let other = trial("two", &format!("set = [\"simulation.output_step=0.2\"]\nbounds = {{}}\n{equals}"));
    let outcomes = outcomes(&(trial("one", "bounds = {}") + &other));
    assert_eq!(outcomes[1].faults, ["sampled at other times than `one`"]);
}

#[test]
fn forms_and_names_choose_trials() {
    let folder = Folder::new();
    let text = trial("base", "bounds = {}\nshort = [\"simulation.t_end=0.5\"]")
        + &trial("long", "bounds = {}\nonly_full = true")
        + &trial("same", "bounds = {}\nequals = { trial = \"base\", within = 0 }\nshort = [\"simulation.t_end=0.5\"]")
        + &trial("other", "bounds = {}\nformulations = [\"joint\", \"cartesian\"]");
    let suite = suite(&text, &folder);
    let names = |names: &[&str], full: bool| {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let settings = Settings { full, jobs: 1, ..Settings::default() };
        let outcomes = run(&suite, &names, &settings, &|_| (), &Arc::default()).unwrap();
        assert!(outcomes.iter().all(Outcome::passed), "{outcomes:?}");
        outcomes.iter().map(|outcome| format!("{} {}", outcome.trial, outcome.formulation)).collect::<Vec<_>>()
    };
    assert_eq!(names(&[], false), ["base auto", "same auto", "other joint", "other cartesian"]);
    assert_eq!(names(&[], true), ["base auto", "long auto", "same auto", "other joint", "other cartesian"]);
    assert_eq!(names(&["same"], false), ["base auto", "same auto"]);
    assert_eq!(names(&["long"], false), ["long auto"]);
    let unknown = run(&suite, &["bse".into()], &Settings::default(), &|_| (), &Arc::default()).err().unwrap();
    assert!(unknown.help.iter().any(|help| help.contains("`base`")), "{unknown:?}");
}

#[test]
fn a_grid_is_a_trial_for_each_combination() {
    let folder = Folder::new();
    let grid = "grid = [[\"L=1\", \"L=2\"], [\"simulation.method=dop853\", \"simulation.method=radau5\"]]";
    let text = trial("base", &format!("bounds = {{}}\n{grid}"))
        + &trial(
            "other",
            &format!(
                "bounds = {{}}\n{grid}\nformulations = [\"cartesian\"]\n\
                 equals = {{ trial = \"base\", formulation = \"auto\", within = 1e-14 }}"
            ),
        );
    let suite = suite(&text, &folder);
    let ran = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        run(&suite, &names, &Settings::default(), &|_| (), &Arc::default()).unwrap()
    };
    let all = ran(&[]);
    assert!(all.iter().all(Outcome::passed), "{all:?}");
    let names: Vec<&str> = all.iter().map(|outcome| outcome.trial.as_str()).collect();
    let places = ["L=1/method=dop853", "L=1/method=radau5", "L=2/method=dop853", "L=2/method=radau5"];
    let of = |name: &str| places.map(|place| format!("{name}/{place}"));
    assert_eq!(names, [of("base"), of("other")].concat());
    // By the name of the grid, and by a part of the place; with what it is compared with.
    assert_eq!(ran(&["base"]).len(), 4);
    let one = ran(&["other/L=2/method=radau5"]);
    assert_eq!(one.len(), 2);
    let measure = one[1].measures.iter().find(|measure| measure.what.starts_with("`x` against"));
    assert_eq!(measure.unwrap().what, "`x` against base/L=2/method=radau5", "{:?}", one[1]);
    assert_eq!(ran(&["other/L=2"]).len(), 4);
    // Not by a part of a word.
    assert!(suite.select(&["bas".into()], false).is_err());
}

#[test]
fn a_suite_that_is_stopped_begins_nothing() {
    let folder = Folder::new();
    let stop = Arc::new(AtomicBool::new(true));
    let outcomes = run(&suite(&trial("spin", BOUNDS), &folder), &[], &Settings::default(), &|_| (), &stop).unwrap();
    assert_eq!(outcomes[0].faults, ["not begun"]);
}

#[test]
fn contradictions_are_told_with_their_place() {
    let text = trial("a", "")
        + &trial("b", "bounds = {}\nrefused = { code = \"ODY0307\" }")
        + &trial("c", "bounds = {}")
        + &trial("c", "bounds = {}")
        + &trial("d", "bounds = {}\nequals = { trial = \"z\", within = 1 }")
        + &trial("e", "bounds = { energy = -1 }")
        + &trial("g", "formulations = [\"joint\"]\nbounds = {}\nequals = { trial = \"c\", within = 1 }")
        + &trial("h", "refused = { code = \"ODY0307\" }\nwarns = { code = \"ODY0307\" }");
    let found = refused(&text);
    let says = |k: usize, words: &str| found[k].message.contains(words) && found[k].span().is_some();
    let expected = [
        "`a` needs `bounds`",
        "`b` needs",
        "two trials `c`",
        "no trial `z` before `d`",
        "a bound of `e`",
        "`c`, which `g`",
        "`h` is to be refused",
    ];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (k, words) in expected.into_iter().enumerate() {
        assert!(says(k, words), "{words}: {:?}", found[k]);
    }
    let unknown = refused(&trial("a", "bonds = {}"));
    assert!(unknown[0].message.contains("unknown field `bonds`") && unknown[0].span().is_some(), "{unknown:?}");
    assert_eq!(Suite::read("nowhere/suite.toml".as_ref()).err().unwrap().diagnostics[0].code, codes::UNREADABLE);
}
