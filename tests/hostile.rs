//! Input that somebody made to break the program: the kept inputs of `tests/fuzz/corpus`, and random changes of them. The functions
//! are those that libFuzzer calls; `tests/fuzz/README.md` explains how to let it search for longer.

use std::fs;

use element_api::testkit::Random;
use odyn::catalog::Catalog;
use odyn::diagnostics::{Source, codes};
use odyn::scene::parse;
use odyn::session::{RunOptions, Session};

use crate::support::root;

#[path = "fuzz/src/lib.rs"]
mod targets;

/// How many times as many random changes, from other seeds: `ODYN_HOSTILE_ROUNDS=100 cargo test -p odyn-tests hostile`.
const ROUNDS: &str = "ODYN_HOSTILE_ROUNDS";

/// Calls a target with the kept inputs and with `changes` random changes of them. The seeds are fixed: a failure comes back.
/// The input that broke something is left in the folder for temporary files.
#[track_caller]
fn assault(name: &str, changes: usize, target: fn(&[u8])) {
    let mut kept: Vec<_> =
        fs::read_dir(root().join("tests/fuzz/corpus").join(name)).unwrap().map(|e| e.unwrap().path()).collect();
    kept.sort();
    let kept: Vec<Vec<u8>> = kept.iter().map(|path| fs::read(path).unwrap()).collect();
    assert!(!kept.is_empty(), "no kept input of `{name}`");
    kept.iter().for_each(|input| target(input));
    let rounds = std::env::var(ROUNDS).map_or(1, |text| text.parse().unwrap());
    for seed in 0..rounds {
        let mut random = Random::new(1 + seed);
        for _ in 0..changes {
            let mut input = kept[below(&mut random, kept.len())].clone();
            for _ in 0..=below(&mut random, 4) {
                change(&mut input, &kept, &mut random);
            }
            let trace = Trace { name, input: &input };
            target(trace.input);
            std::mem::forget(trace);
        }
    }
}

/// Leaves the input behind when the target panics.
struct Trace<'a> {
    name: &'a str,
    input: &'a [u8],
}

impl Drop for Trace<'_> {
    fn drop(&mut self) {
        let path = std::env::temp_dir().join(format!("odyn-broken-by-{}-{:08x}", self.name, sum(self.input)));
        let _ = fs::write(&path, self.input);
        eprintln!("broken by {}", path.display());
    }
}

/// A number that distinguishes inputs (Fowler, Noll, Vo).
fn sum(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |sum, byte| (sum ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

fn below(random: &mut Random, end: usize) -> usize {
    random.between(0.0, end as f64) as usize
}

/// One random change: a byte, a piece lost, doubled, or taken from another input.
fn change(input: &mut Vec<u8>, others: &[Vec<u8>], random: &mut Random) {
    let other = &others[below(random, others.len())];
    let start = below(random, input.len() + 1);
    let end = (start + below(random, 12)).min(input.len());
    match below(random, 6) {
        0 if start < end => input[start] ^= 1 << below(random, 8),
        1 if start < end => input[start] = [0, 1, 0x7f, 0x80, 0xff, b'0', b'9', b'"', b'-', b'\n'][below(random, 10)],
        2 => drop(input.drain(start..end)),
        3 => {
            let piece = input[start..end].to_vec();
            input.splice(start..start, piece);
        }
        4 => {
            let from = below(random, other.len() + 1);
            let piece = other[from..(from + 40).min(other.len())].to_vec();
            input.splice(start..end, piece);
        }
        _ => input.insert(start, below(random, 256) as u8),
    }
}

#[test]
fn scenes() {
    assault("scene", 2000, targets::scene);
}

#[test]
fn expressions() {
    assault("expression", 3000, targets::expression);
}

#[test]
fn tables_of_results() {
    assault("csv", 1000, targets::csv);
}

#[test]
fn points_of_curves() {
    assault("table", 5000, targets::table);
}

#[test]
fn recorded_equations() {
    assault("recording", 600, targets::recording);
}

/// Otherwise the test above would show nothing but that equations are refused.
#[test]
fn kept_equations_come_far() {
    let folder = fs::read_dir(root().join("tests/fuzz/corpus/recording")).unwrap();
    let reached: Vec<_> = folder.map(|entry| targets::reach(&fs::read(entry.unwrap().path()).unwrap())).collect();
    let come = |far: targets::Reached| reached.iter().filter(|reached| **reached >= far).count();
    assert!(come(targets::Reached::Scene) >= 8, "{reached:?}");
    assert!(come(targets::Reached::Code) >= 4, "{reached:?}");
    assert!(come(targets::Reached::End) >= 2, "{reached:?}");
}

#[test]
fn states_to_go_on_from() {
    assault("state", 300, targets::state);
}

#[test]
fn manifests() {
    assault("manifest", 5000, targets::manifest);
}

#[test]
fn files_said_to_be_libraries() {
    assault("library", 2000, targets::library);
}

#[test]
fn files_of_elements() {
    assault("elements", 4000, targets::elements);
}

/// A million million samples; ten million of eleven columns.
#[test]
fn results_that_do_not_fit_into_memory_are_refused() {
    let mut text = String::from("[simulation]\nt_end = 10\noutput_step = STEP\n");
    text.push_str("[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n");
    for k in 0..10 {
        text.push_str(&format!(
            "[[output]]\nname = \"y{k}\"\nquantity = \"position\"\nof = \"b\"\ncomponent = \"x\"\n"
        ));
    }
    let rejected = parse(Source::new("scene.toml", text.replace("STEP", "1e-11")), &[]).expect_err("too many");
    assert!(rejected.diagnostics[0].message.contains("asks for 1.0e12 samples"), "{:?}", rejected.diagnostics);
    let open = |step: &str| {
        let (scene, warnings) = parse(Source::new("scene.toml", text.replace("STEP", step)), &[]).unwrap();
        Session::with_catalog(scene, warnings, &Catalog::new(), &RunOptions::default())
    };
    assert!(open("2e-6").is_ok());
    let Err(error) = open("1e-6") else { panic!("110 million numbers") };
    assert_eq!(error.diagnostics[0].code, codes::OUT_OF_RANGE);
    assert!(error.diagnostics[0].message.contains("10000001 samples of 11 columns"), "{error}");
}
