//! Random mechanisms: trees and closed loops of all joints, with springs, dampers, drivers and masses over three decades.
//! What must hold of any mechanism is looked at in each of them (`random/checks.rs`).
//!
//! The short form is part of `cargo test`. The long form, and one mechanism alone, by number:
//!
//! ```sh
//! ODYN_RANDOM=20000 cargo test --release -p odyn-tests random
//! ODYN_RANDOM=1 ODYN_RANDOM_FIRST=1234 cargo test -p odyn-tests random::spatial
//! ```
//!
//! Furnished with elements of all kinds and with masses over 18 decades, they are run in several ways that must agree
//! (`random/differential.rs`; `every_way` in place of `spatial`, the long form with `ODYN_RANDOM=2000`). Runs that are refused or
//! doubtful are counted; `ODYN_RANDOM_HUNT="6 ODY0605"` makes a failure, to be made smaller, of each that ends so.
//!
//! A mechanism that fails is made smaller as long as it fails, and its scene is kept as a file, which `odyn run` takes. Those
//! that once failed are in `regressions/`, each with the cause.

pub mod checks;
mod damping;
mod differential;
mod furnish;
mod guided;
mod inertia;
pub mod mechanism;
mod numbers;
mod relation;
mod rest;
mod rubbing;
mod text;

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use checks::{Checks, Verdict};
use differential::{Seen, TOLERANCE, keys};
use mechanism::{Mechanism, Place, Style};

use crate::support::{kept, root};

/// Styles of furnished mechanisms, in turn.
const STYLES: [Style; 3] = [Style::Spatial, Style::Planar, Style::Spherical];
/// Mechanisms that are described in the message of a failed test.
const MOST_TOLD: usize = 5;

/// A number from the environment.
fn wanted(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} is no number: {text}")))
}

/// A check, a panic being a failure like others.
fn judged(mechanism: &Mechanism, check: &impl Fn(&Mechanism) -> Verdict) -> Verdict {
    let told = |panic: Box<dyn std::any::Any + Send>| {
        let text = panic.downcast_ref::<String>().cloned();
        text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_string())).unwrap_or_default()
    };
    catch_unwind(AssertUnwindSafe(|| check(mechanism))).unwrap_or_else(|panic| Err(format!("panic: {}", told(panic))))
}

/// The smallest mechanism that is found by leaving out one thing after the other and fails, too, and how it fails.
fn smallest(mut mechanism: Mechanism, mut why: String, check: &impl Fn(&Mechanism) -> Verdict) -> (Mechanism, String) {
    let mut number = mechanism.removable();
    while number > 0 {
        number -= 1;
        let Some(smaller) = mechanism.without(number) else { continue };
        if let Err(other) = judged(&smaller, check) {
            (mechanism, why) = (smaller, other);
            number = mechanism.removable();
        }
    }
    (mechanism, why)
}

/// Checks mechanisms of a style: `count` unless the environment says how many; one of `every` goes through all runs.
#[track_caller]
fn all(style: Style, count: u64, every: u64) {
    let checks = Checks::new();
    let first = wanted("ODYN_RANDOM_FIRST", 1);
    let count = wanted("ODYN_RANDOM", count);
    let (mut failed, mut told) = (0, String::new());
    let unfit = Cell::new(0);
    for seed in first..first + count {
        let runs = seed % every == 0 || count == 1;
        let check = |mechanism: &Mechanism| {
            let Some(settled) = checks.settled(mechanism)? else {
                unfit.set(unfit.get() + 1);
                return Ok(());
            };
            checks.equations(&settled, seed)?;
            if runs { checks.runs(&settled, seed) } else { Ok(()) }
        };
        let mechanism = Mechanism::new(seed, style);
        let Err(why) = judged(&mechanism, &check) else { continue };
        failed += 1;
        if failed <= MOST_TOLD {
            let (mechanism, why) = smallest(mechanism, why, &check);
            let settled = checks.settled(&mechanism).ok().flatten().unwrap_or(mechanism);
            let path = kept("random").join(format!("{style:?}-{seed}.toml").to_lowercase());
            std::fs::write(&path, settled.text(&Place::as_it_is(), checks::SHORT)).unwrap();
            told += &format!("{style:?} {seed}: {why}\n    odyn run {}\n", path.display());
        }
    }
    assert!(failed == 0, "{failed} of {count} mechanisms failed:\n{told}");
    let unfit = unfit.get();
    assert!(count < 20 || 5 * unfit < count, "{unfit} of {count} mechanisms start too near a singular position");
}

#[test]
fn spatial_mechanisms() {
    all(Style::Spatial, 240, 6);
}

#[test]
fn planar_mechanisms() {
    all(Style::Planar, 120, 6);
}

#[test]
fn spherical_mechanisms() {
    all(Style::Spherical, 90, 6);
}

/// Runs furnished mechanisms in several ways.
#[track_caller]
fn differential(count: u64, draw: fn(u64, Style) -> Mechanism) {
    let checks = Checks::new();
    let first = wanted("ODYN_RANDOM_FIRST", 1);
    let count = wanted("ODYN_RANDOM", count);
    let (mut failed, mut told) = (0, String::new());
    let (seen, unfit) = (RefCell::new(Seen::default()), Cell::new(0));
    for seed in first..first + count {
        let style = STYLES[(seed % 3) as usize];
        let attempt = |mechanism: &Mechanism, seen: &RefCell<Seen>| {
            let Some(settled) = checks.settled(mechanism)? else {
                unfit.set(unfit.get() + 1);
                return Ok(());
            };
            checks.differ(&settled, seed, &mut seen.borrow_mut())
        };
        let mechanism = draw(seed, style);
        let keep = |mechanism: &Mechanism, why: &str| {
            let settled = checks.settled(mechanism).ok().flatten().unwrap_or_else(|| mechanism.clone());
            let path = kept("random").join(format!("differential-{seed}.toml"));
            std::fs::write(&path, format!("# {why}\n\n{}", settled.text(&Place::as_it_is(), &keys()))).unwrap();
            path
        };
        if count == 1 {
            eprintln!("{style:?} {seed}: {}", keep(&mechanism, "as drawn").display());
        }
        let Err(why) = judged(&mechanism, &|mechanism| attempt(mechanism, &seen)) else { continue };
        failed += 1;
        let kind = why.split(':').next().unwrap_or_default().to_owned();
        let same = |mechanism: &Mechanism| match attempt(mechanism, &RefCell::default()) {
            Err(other) if !other.starts_with(&kind) => Ok(()),
            other => other,
        };
        let (mechanism, why) = smallest(mechanism, why, &same);
        let path = keep(&mechanism, &why);
        let words = format!("{style:?} {seed}: {why}\n    odyn run {}\n", path.display());
        eprint!("{words}");
        if failed <= MOST_TOLD {
            told += &words;
        }
    }
    let (seen, unfit) = (seen.into_inner(), unfit.get());
    eprintln!("{seen}\nstart too near a singular position: {unfit}");
    assert!(failed == 0, "{failed} of {count} scenes failed:\n{told}");
    assert!(count < 20 || 5 * unfit < count, "{unfit} of {count} mechanisms start too near a singular position");
    assert!(count < 20 || seen.refusals() < 0.1, "too many runs without a result: {seen}");
    assert!(count < 20 || 10 * seen.close > 8 * seen.scenes, "too few scenes compared closely: {seen}");
}

#[test]
fn all_standard_elements_are_drawn() {
    let draw = |seed| {
        let style = STYLES[(seed % 3) as usize];
        let made = [Mechanism::furnished, Mechanism::striking, Mechanism::rubbing, Mechanism::guided];
        made.map(|make| make(seed, style).parts).concat()
    };
    let drawn: BTreeSet<&str> = (1..2000).flat_map(draw).map(|part| part.kind).collect();
    let mut missing = Vec::new();
    for library in [odyn_joints::library(), odyn_forces::library(), odyn_controls::library()] {
        for class in &library.classes {
            let name = class.descriptor().name.clone();
            // A surface over two signals, and what samples: `scenes/verification/` has them, and `events.rs` every method. What only
            // looks: `margins.rs`. Read from files, or added as an inerter is: `inertia.rs`, `import.rs`.
            let apart = [
                "map",
                "digital-pid",
                "digital-filter",
                "relay",
                "bearing-rating",
                "modal-body",
                "added-mass",
                "rotational-inerter",
            ];
            if apart.iter().any(|one| one == &name) {
                continue;
            }
            if !drawn.contains(name.as_str()) {
                missing.push(name);
            }
        }
    }
    assert!(missing.is_empty(), "in no scene: {missing:?}");
}

#[test]
fn every_way_of_running_a_scene_agrees() {
    differential(60, Mechanism::furnished);
}

#[test]
fn every_way_of_running_a_scene_with_contacts_agrees() {
    differential(60, Mechanism::striking);
}

#[test]
fn every_way_of_running_a_scene_with_friction_agrees() {
    differential(60, Mechanism::rubbing);
}

/// Inerters and added masses take part in impacts, and in what sticks.
#[test]
fn every_way_of_running_a_scene_with_friction_and_elements_with_mass_agrees() {
    differential(40, Mechanism::rubbing_with_mass);
}

/// Equilibria of mechanisms of all kinds.
#[test]
fn equilibria_stay_and_are_judged_rightly() {
    let checks = Checks::new();
    let first = wanted("ODYN_RANDOM_FIRST", 1);
    let count = wanted("ODYN_RANDOM", 64);
    let found = RefCell::new(rest::Found::default());
    let (mut failed, mut told) = (0, String::new());
    for seed in first..first + count {
        let style = STYLES[(seed % 3) as usize];
        let mut mechanism = if seed % 2 == 0 { Mechanism::new(seed, style) } else { Mechanism::furnished(seed, style) };
        // Beside masses over 18 decades, round-off of the heavy moves the light.
        for body in &mut mechanism.bodies {
            (body.heavier, body.thinner) = (1.0, nalgebra::Vector3::repeat(1.0));
        }
        let keep = |mechanism: &Mechanism| {
            let settled = checks.settled(mechanism).ok().flatten().unwrap_or_else(|| mechanism.clone());
            let path = kept("random").join(format!("rest-{seed}.toml"));
            std::fs::write(&path, settled.text(&Place::as_it_is(), rest::SETTINGS)).unwrap();
            path
        };
        if count == 1 {
            eprintln!("{style:?} {seed}: {}", keep(&mechanism).display());
        }
        let check = |mechanism: &Mechanism| match checks.settled(mechanism)? {
            Some(settled) => checks.rests(&settled, seed, &mut found.borrow_mut()),
            None => Ok(()),
        };
        let Err(why) = judged(&mechanism, &check) else { continue };
        failed += 1;
        if failed <= MOST_TOLD {
            let kind = why.split(':').next().unwrap_or_default().to_owned();
            let same = |mechanism: &Mechanism| match check(mechanism) {
                Err(other) if !other.starts_with(&kind) => Ok(()),
                other => other,
            };
            let (mechanism, why) = smallest(mechanism, why, &same);
            told += &format!("{style:?} {seed}: {why}\n    odyn statics {}\n", keep(&mechanism).display());
        }
    }
    let found = found.into_inner();
    eprintln!("{found}");
    assert!(failed == 0, "{failed} of {count} failed:\n{told}");
    assert!(count < 20 || 4 * found.compared > found.scenes, "too few compared: {found}");
}

#[test]
fn every_way_of_running_a_scene_with_guides_agrees() {
    differential(60, Mechanism::guided);
}

/// Checks the scenes of a folder below `tests`; reports all that fail.
#[track_caller]
fn regressions(folder: &str, check: &dyn Fn(&str) -> Verdict) {
    let (mut count, mut told) = (0, String::new());
    for entry in std::fs::read_dir(root().join("tests").join(folder)).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        count += 1;
        if let Err(why) = check(&std::fs::read_to_string(&path).unwrap()) {
            told += &format!("{}: {why}\n", path.display());
        }
    }
    assert!(count > 0 && told.is_empty(), "{told}");
}

#[test]
fn mechanisms_that_once_failed() {
    let checks = Checks::new();
    regressions("regressions", &|text| checks.all_runs_agree(text));
}

/// A scene with velocities that are larger by the tolerance.
fn faster(text: &str) -> String {
    let line = |line: &str| match line.split_once("velocity = [") {
        Some((key, list)) => {
            let numbers: Vec<f64> = list.trim_end_matches(']').split(',').map(|x| x.trim().parse().unwrap()).collect();
            let numbers: Vec<f64> = numbers.iter().map(|x| x * (1.0 + TOLERANCE)).collect();
            format!("{key}velocity = {numbers:?}")
        }
        None => line.into(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn scenes_that_once_differed() {
    let checks = Checks::new();
    // Refusals are right for some of them; how many ways must have a result, a line of the scene says (`# sound: 5`).
    let agree = |text: &str| {
        let least = text.lines().find_map(|line| line.strip_prefix("# sound: ")?.parse().ok());
        let least: u64 = least.ok_or("no line `# sound: NUMBER`")?;
        (0..2).try_for_each(|seed| {
            let mut seen = Seen::default();
            checks.agree(text, &faster(text), 4 * seed, &mut seen)?;
            let found = seen.sound;
            if found < least { Err(format!("{found} sound runs, at least {least} expected: {seen}")) } else { Ok(()) }
        })
    };
    regressions("regressions/differential", &agree);
}
