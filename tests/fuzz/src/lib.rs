//! What hostile input may reach: one function per kind of input. Each takes any bytes, and panics if the program would, or if
//! what it answers is impossible.
//!
//! | function | stands for |
//! |---|---|
//! | [`scene`] | a scene file with `--set` texts, read and, if it has no mistakes, prepared for a run |
//! | [`expression`] | an expression in a scene, a unit, a formula of a check |
//! | [`csv`] | a table of results, or a reference, read back |
//! | [`table`] | points of a curve that an element is given |
//! | [`recording`] | equations that a library sends, bit by bit, with a descriptor of any sizes |
//! | [`state`] | `state.toml`, from which a run continues |
//! | [`manifest`] | the text by which a library says what it is |
//! | [`library`] | a file that is said to be a library |
//! | [`elements`] | a file of elements as data |
//!
//! libFuzzer calls them (`fuzz_targets/`), and so does `tests/hostile.rs`, with the kept inputs of `corpus/` and with random
//! changes of these.

mod recording;

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use element_api::Table as Curve;
use element_api::params::{ParamKind, ParamType};
use odyn::catalog::{Catalog, SearchPath, read_manifest};
use odyn::diagnostics::{Source, render};
use odyn::results::{self, compare};
use odyn::scene::{Override, parse, parse_unit};
use odyn::session::{Restart, RunOptions, STATE_FILE, Session};

pub use recording::{Reached, reach, recording};

/// Bodies of a scene that is still prepared; the work grows with them, what can go wrong does not.
const MOST_BODIES: usize = 12;

/// A scene file; texts for `--set` follow it behind zero bytes.
///
/// # Panics
/// When a mistake is refused without a word, or a scene breaks the program.
pub fn scene(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut parts = text.split('\0');
    let own = parts.next().unwrap_or_default();
    let sets: Vec<Override> = parts.take(8).map(Override::new).collect();
    let (scene, warnings) = match parse(Source::new("fuzz.toml", own), &sets) {
        Ok(accepted) => accepted,
        Err(rejected) => {
            assert!(rejected.diagnostics.iter().any(|d| d.is_error()), "refused without an error");
            assert!(!render(&rejected.diagnostics, &rejected.source, false).is_empty(), "refused without a word");
            return;
        }
    };
    let _ = render(&warnings, &scene.source, false);
    if scene.bodies.len() > MOST_BODIES {
        return;
    }
    match Session::with_catalog(scene, warnings, &Catalog::new(), &RunOptions::default()) {
        Ok(session) => drop(session.plan_report().to_string()),
        Err(error) => assert!(!error.render(false).is_empty(), "refused without a word"),
    }
}

/// An expression, with its unit, as a parameter, as a quantity with a dimension and as the formula of a check.
///
/// # Panics
/// When one breaks the program.
pub fn expression(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    if let Ok((_, factor)) = parse_unit(&text) {
        assert!(factor.is_normal() && factor > 0.0, "a unit of {factor:e}");
    }
    let quoted = toml::Value::String(text.into_owned()).to_string();
    let whole = format!(
        "[parameters]\na = 2\nx = {quoted}\n[simulation]\nt_end = 1\noutput_step = 0.1\ngravity = [{quoted}, 0, 0]\n\
         [[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n\
         [[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"b\"\ncomponent = \"x\"\n\
         [[check]]\nname = \"c\"\nkind = \"position\"\nvalue = \"y\"\nreference = {quoted}\ntolerance = 1\n"
    );
    match parse(Source::new("fuzz.toml", whole), &[]) {
        Ok((scene, _)) => {
            let known = scene.parameters.get("x").map(|x| x.value.si);
            assert!(known.is_some_and(f64::is_finite), "the parameter is {known:?}");
            assert!(scene.simulation.gravity.iter().all(|x| x.is_finite()), "{:?}", scene.simulation.gravity);
        }
        Err(rejected) => assert!(!render(&rejected.diagnostics, &rejected.source, false).is_empty()),
    }
}

/// A table in the form of `results.csv`.
///
/// # Panics
/// When a table that is accepted has holes.
pub fn csv(data: &[u8]) {
    let file = Temporary::file("table.csv", data);
    let Ok(table) = results::Table::read(&file.path()) else { return };
    assert_eq!(table.names.len(), table.columns.len());
    assert!(table.columns.iter().all(|column| column.len() == table.times.len()));
    assert!(table.times.windows(2).all(|pair| pair[0] <= pair[1]), "times go back");
    // Anything but a panic: columns that are not numbers may be refused.
    let _ = compare(&file.path(), &file.path());
}

/// Points of a curve: eight bytes each for argument and value; and where to look.
///
/// # Panics
/// When a curve that is accepted does not stay level outside, or a curve reads beside its pieces.
pub fn table(data: &[u8]) {
    let mut bytes = recording::Bytes::new(data);
    let periodic = bytes.byte() % 2 == 1;
    let numbers: Vec<f64> = (0..64).map_while(|_| bytes.number()).collect();
    let (pairs, _) = numbers.as_chunks::<2>();
    let made = if periodic { Curve::periodic(pairs) } else { Curve::clamped(pairs) };
    if let Ok(curve) = made {
        for x in numbers.iter().copied().chain([f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -0.0]) {
            for order in 0..5 {
                let value = curve.derivative(x, order);
                let outside = curve.outside == element_api::Outside::Clamped && curve.is_sound() && x.is_infinite();
                assert!(!outside || order == 0 || value == 0.0, "slope {value} at {x}");
            }
        }
    }
    // Pieces that fit nothing, as a library may send them.
    let breaks = numbers.iter().copied().take(numbers.len() / 2).collect();
    let pieces = numbers.as_chunks::<4>().0.to_vec();
    let outside = if periodic { element_api::Outside::Periodic } else { element_api::Outside::Clamped };
    let curve = Curve { breaks, pieces, outside };
    if curve.is_sound() {
        for x in numbers {
            let _ = curve.derivative(x, 0);
        }
    }
}

/// A scene for states to belong to.
const SCENE: &str =
    "[simulation]\nt_end = 1\noutput_step = 0.5\n[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n";

/// `state.toml` in a folder of results, and a scene that is to continue from it.
///
/// # Panics
/// When a state is taken that is not one.
pub fn state(data: &[u8]) {
    let file = Temporary::file(STATE_FILE, data);
    let Ok(state) = Restart::read(&file.folder) else { return };
    let (scene, warnings) = parse(Source::new("fuzz.toml", SCENE), &[]).expect("a scene without mistakes");
    let session = Session::with_catalog(scene, warnings, &Catalog::new(), &RunOptions::default());
    let mut session = session.expect("a body that flies");
    let numbers = [&state.working[..], &state.references, &state.discrete].concat();
    let finite = state.time.is_finite() && numbers.iter().all(|x| x.is_finite());
    if session.go_on_from(state).is_ok() {
        assert!(finite, "goes on from {numbers:?}");
    }
}

/// The text in the section of a library.
///
/// # Panics
/// When a manifest is accepted that names nobody.
pub fn manifest(data: &[u8]) {
    for manifest in element_api::manifest::Manifest::parse(data).unwrap_or_default() {
        assert!(!manifest.package.is_empty());
        for (k, element) in manifest.elements.iter().enumerate() {
            assert!(manifest.elements[..k].iter().all(|other| other.name != element.name), "named twice");
        }
    }
}

/// A file that is said to be a library. It is read, never loaded.
///
/// # Panics
/// When a refusal does not name the file.
pub fn library(data: &[u8]) {
    let file = Temporary::file(&format!("lib.{}", std::env::consts::DLL_EXTENSION), data);
    if let Err(error) = read_manifest(&file.path()) {
        assert!(error.to_string().contains("lib."), "{error}");
    }
}

/// A file of elements as data: read, and each of its elements given numbers and recorded.
///
/// # Panics
/// When a refusal does not name the file, or an element that was accepted breaks the program.
pub fn elements(data: &[u8]) {
    let file = Temporary::file("some.odyn-element", data);
    let mut catalog = Catalog::new();
    if let Err(error) = catalog.add(&file.path().display().to_string(), &SearchPath::default()) {
        assert!(error.to_string().contains("some.odyn-element"), "{error}");
        return;
    }
    for element in catalog.elements() {
        let value = |kind| match kind {
            ParamKind::Boolean => true.write(),
            ParamKind::Vector => [0.1, 0.2, 0.3].write(),
            _ => 0.5.write(),
        };
        let params = element.descriptor().params.iter().map(|param| (param.name.clone(), value(param.kind))).collect();
        let mut set = element.class.new_set();
        if let Ok(number) = set.add(&params)
            && let Ok(recording) = set.record(number)
        {
            recording.check(&element.descriptor().limits()).expect("a recording is checked");
        }
    }
}

/// A file in a folder of its own, removed at the end.
struct Temporary {
    folder: PathBuf,
    name: String,
}

impl Temporary {
    fn file(name: &str, content: &[u8]) -> Self {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("odyn-fuzz-{}-{number}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        let file = Self { folder, name: name.into() };
        fs::write(file.path(), content).expect("a temporary file");
        file
    }

    fn path(&self) -> PathBuf {
        self.folder.join(&self.name)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}
