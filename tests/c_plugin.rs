//! A library in C, built as its author would build it, beside the same elements in Rust.

#[path = "c_plugin/recent.rs"]
pub mod recent;
#[path = "c_plugin/twins.rs"]
mod twins;

use twins::{Blade, Drag, Hinge, Rod, Strut, Wind};

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use element_api::adapt::{force, joint};
use element_api::manifest::Library;
use element_api::params::Table as Params;
use element_api::prelude::*;
use element_api::set::{Batch, CreateError, ElementClass, Layout, Wanted};
use odyn::catalog::{Catalog, SearchPath};
use odyn::session::{RunReport, Session};
use odyn::workshop::{Given, Verdict, examine};

use crate::support::{Scratch, column, difference, kept, options, root, run_linked};

/// With this set, what needs a compiler of C or C++ is left out where there is none.
const SKIP: &str = "ODYN_SKIP_C";

/// Builds `source` with the C compiler into a library of `package`; `None` where there is no compiler and [`SKIP`] is set.
fn cc(source: &Path, package: &str, flags: &[&str], folder: &Path) -> Option<PathBuf> {
    let flags = [&["-std=c99", "-pedantic"], flags].concat();
    compile("cc", source, package, &flags, folder)
}

fn compile(compiler: &str, source: &Path, package: &str, flags: &[&str], folder: &Path) -> Option<PathBuf> {
    if Command::new(compiler).arg("--version").output().is_err() {
        let skip = std::env::var_os(SKIP).is_some();
        assert!(skip, "there is no compiler `{compiler}`; set {SKIP}=1 to leave out the tests that need it");
        return None;
    }
    let library = folder.join(format!("{DLL_PREFIX}{}{DLL_SUFFIX}", package.replace('-', "_")));
    let output = Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"])
        .args(flags)
        .arg("-I")
        .arg(root().join("element-api/include"))
        .arg("-o")
        .arg(&library)
        .arg(source)
        .arg("-lm")
        .output()
        .expect("the compiler can be run");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(library)
}

/// As authors of small libraries build: whatever nobody refers to is dropped.
const FLAGS: &[&str] = if cfg!(target_os = "linux") {
    &["-O2", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-s"]
} else {
    &["-O2"]
};

/// The fixture, built once.
fn c_plugin() -> Option<&'static Path> {
    static BUILT: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = || root().join("tests/fixtures/c-plugin/c_plugin.c");
    BUILT.get_or_init(|| cc(&source(), "c-plugin", FLAGS, &kept("c-plugin"))).as_deref()
}

fn twins() -> Vec<Box<dyn ElementClass>> {
    vec![joint::<Rod>(), force::<Strut>(), joint::<Hinge>(), force::<Drag>(), joint::<Blade>(), force::<Wind>()]
}

/// The classes of the C library.
fn classes(library: &Path) -> Catalog {
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    catalog.add(library.to_str().unwrap(), &SearchPath::default()).unwrap_or_else(|error| panic!("{error}"));
    catalog
}

/// A hinged arm, a mass on a swinging rod, a strut and a drag.
const SCENE: &str = r#"
title = "Elements in C"
[plugins]
libraries = ["c-plugin"]
[simulation]
without = ["kinematic"]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.05
tolerance = 1e-11
[[body]]
name = "arm"
mass = 1
inertia = [0.1, 0.2, 0.3]
position = [0.5, 0, 0]
[[body]]
name = "bob"
mass = 2
inertia = [1, 1, 1]
position = [1.3, 0.4, 0.1]
[[joint]]
name = "hinge"
type = "HINGE"
bodies = ["ground", "arm"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "rod"
type = "rod"
bodies = ["arm", "bob"]
params.length = "0.9 m"
params.amplitude = "10 cm"
params.rate = 3
[[force]]
name = "strut"
type = "strut"
bodies = ["ground", "bob"]
params = { damping = 3, delay = 0.05, start = 1.0, bump = [[0, 0], [1, 0], [1.5, 4], [2, 5]], law = "30 (l - 1) + 5 sin(l)" }
DRAG
[[output]]
name = "x"
quantity = "position"
of = "bob"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "arm"
component = "y"
[[output]]
name = "load"
quantity = "reaction_force"
of = "rod"
component = "x"
[[output]]
name = "pull"
quantity = "value"
of = "strut"
channel = "pull"
"#;

const DRAG: &str = r#"
[[force]]
name = "drag"
type = "called-drag"
bodies = ["arm"]
params.factor = 0.5
[[output]]
name = "steps"
quantity = "value"
of = "drag"
channel = "steps"
"#;

/// A sleigh with a blade behind its centre, in a wind that is sampled.
const SLEIGH: &str = r#"
[plugins]
libraries = ["c-plugin"]
[simulation]
t_end = 2
output_step = 0.05
tolerance = 1e-11
[[body]]
name = "sleigh"
mass = 3
inertia = [0.5, 0.5, 0.5]
position = [0.4, 0, 0]
velocity = [1, 0.2, 0]
angular_velocity = [0, 0, 0.5]
[[joint]]
name = "blade"
type = "blade"
bodies = ["ground", "sleigh"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[force]]
name = "wind"
type = "wind"
bodies = ["sleigh"]
params.period = 0.25
[[output]]
name = "x"
quantity = "position"
of = "sleigh"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "sleigh"
component = "y"
[[output]]
name = "side"
quantity = "reaction_force"
of = "blade"
on = "sleigh"
component = "y"
[[output]]
name = "held"
quantity = "value"
of = "wind"
channel = "held"
"#;

const QUANTITIES: [&str; 4] = ["x", "y", "load", "pull"];

/// Runs a scene with the elements in C and with their twins, and gives the former.
fn compared(scene: &str, names: &[&str], library: &Path, bound: f64) -> RunReport {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", scene);
    let folder = library.parent().unwrap().to_path_buf();
    let session = Session::open(&path, &options(&[], &[folder])).unwrap_or_else(|error| panic!("{error}"));
    let in_c = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(in_c.exit_code(), 0, "{}", in_c.summary.reason);
    let package = Library { package: "twin".into(), version: "1".into(), about: String::new(), classes: twins() };
    let in_rust = run_linked(scene, package);
    for name in names {
        let off = difference(column(&in_c, name), column(&in_rust, name));
        assert!(off < bound, "{name}: {off:e}");
        let first = column(&in_c, name)[0];
        assert!(column(&in_c, name).iter().any(|value| (value - first).abs() > 0.05), "`{name}` stays where it is");
    }
    in_c
}

/// The arm hangs on a rod here instead of the called hinge, which is compared below.
#[test]
fn recorded_elements_in_c_move_like_those_in_rust() {
    let Some(library) = c_plugin() else { return };
    let welded = SCENE.replace("HINGE", "rod").replace("point = [0, 0, 0]\naxis = [0, 0, 1]", "params.length = 0.5");
    compared(&welded.replace("DRAG", ""), &QUANTITIES, library, 1e-12);
}

#[test]
fn called_elements_in_c_move_like_recorded_ones_in_rust() {
    let Some(library) = c_plugin() else { return };
    let scene = SCENE.replace("HINGE", "called-hinge").replace("DRAG", DRAG);
    let in_c = compared(&scene, &QUANTITIES, library, 1e-8);
    let steps = column(&in_c, "steps");
    assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]) && steps.last().is_some_and(|last| *last > 10.0));
}

#[test]
fn rows_on_velocities_and_samples_in_c_are_those_in_rust() {
    let Some(library) = c_plugin() else { return };
    let in_c = compared(SLEIGH, &["x", "y", "side", "held"], library, 1e-12);
    // Held between two samples.
    let held = column(&in_c, "held");
    assert!((2..=5).all(|k| held[k] == held[1]) && held[5] != held[6], "{held:?}");
}

/// The library says itself what its elements can be examined with.
#[test]
fn elements_in_c_pass_the_test_kit() {
    let Some(library) = c_plugin() else { return };
    for element in classes(library).elements() {
        let verdict: Verdict = examine(&element, &Given::default(), &[]).unwrap();
        assert!(verdict.passed(), "{verdict:?}");
    }
}

/// What is said of the fixture `faulty.c` with a mistake: when it is loaded, or when its equations are asked for.
fn said_of(fault: u32) -> Option<String> {
    let scratch = Scratch::new();
    let source = root().join("tests/fixtures/c-plugin/faulty.c");
    let define = format!("-DFAULT={fault}");
    // Functions and lists that a mistake leaves unused are its nature.
    let library = cc(&source, "faulty", &[&define, "-Wno-unused", "-O0"], scratch.path())?;
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    if let Err(error) = catalog.add(library.to_str().unwrap(), &SearchPath::default()) {
        return Some(error.to_string());
    }
    let handle = catalog.find("faulty", None).unwrap();
    let mut set = handle.class.new_set();
    // Two instances: the second one may use what the first one kept.
    for instance in 0..2 {
        match set.add(&Params::new()) {
            Err(CreateError::Fault(message)) => return Some(message),
            other => assert_eq!(other, Ok(instance)),
        }
        if let Err(fault) = set.record(instance) {
            return Some(fault.message);
        }
    }
    Some("nothing".into())
}

#[test]
fn mistakes_in_c_are_told_in_words() {
    for (fault, expected) in [
        (0, "nothing"),
        (1, "the row `along y` uses value number 4711, but only "),
        (2, "the row `along y` uses a value of another recording"),
        (3, "an operation `sin` uses a value that was never set (it goes into the row `along y`)"),
        (4, "uses the unknown operation 99 (it goes into the row `along y`)"),
        (5, "uses frame 7 of 2"),
        (6, "Residual(2) is outside what the element declares (2)"),
        (7, "the licence has expired"),
        (8, "asks for the function ``, which is no parameter of it"),
        (9, "Residual(0) is given twice"),
        (10, "gives a force or torque, which only forces do"),
        (11, "constant 0 is NaN"),
        (12, "records more than 4000000 values (it goes into the row `along y`)"),
        (13, "gives a table of 3 points that is a null pointer or too long"),
        (14, "declares the row `along y`, but does not set it"),
        (15, "sets the row `along y`, which `uses_row` leaves out"),
        (20, "the range `=> 0` of the parameter `length` can't be read"),
        (21, "the default `1 m` of the parameter `length` can't be read"),
        (22, "the parameter `length` has the unknown kind 77"),
        (23, "`odyn_element.size` of element 0 is 24, at least"),
        (24, "kind 9 is unknown"),
        (25, "`Faulty` can't be the name of an element"),
        (26, "a text that must be there is a null pointer: summary"),
        (27, "declares 2 frames, but the list is a null pointer"),
        (28, "declares 1000000 rows; at most 1000"),
        (29, "is opaque, but `evaluate` is null"),
        (30, "asks for the parameter `lenght`, which it does not declare"),
        (31, "element 0 is a null pointer"),
    ] {
        let Some(said) = said_of(fault) else { return };
        assert!(said.contains(expected), "mistake {fault}: {said} / {expected}");
    }
}

/// The joint of the guide is what it says.
#[test]
fn the_joint_of_the_guide_builds_and_loads() {
    let guide = fs::read_to_string(root().join("docs/c-plugins.md")).unwrap();
    let source = guide.split("\n```c\n").nth(1).and_then(|rest| rest.split("\n```").next()).unwrap();
    let scratch = Scratch::new();
    let Some(library) = cc(&scratch.file("bars.c", source), "bars", &["-O2"], scratch.path()) else { return };
    let catalog = classes(&library);
    let rod = catalog.find("bars/rod", None).unwrap();
    let mut set = rod.class.new_set();
    assert_eq!(set.add(&"length = 0.25".parse().unwrap()), Ok(0));
    assert!(set.record(0).is_ok());
    let long = set.add(&"length = 2e6".parse().unwrap());
    assert_eq!(long, Err(CreateError::Parameter(ParamError::new("length", "no rod is a thousand kilometres long"))));
}

/// What a library in C says of its elements is what the same elements in Rust say, and so are the equations.
#[test]
fn descriptors_and_memory_of_elements_in_c() {
    let Some(library) = c_plugin() else { return };
    let catalog = classes(library);
    for twin in twins() {
        let there = catalog.find(&twin.descriptor().name, None).unwrap();
        let mut descriptor = there.descriptor().clone();
        assert_eq!(descriptor.opaque, descriptor.name.starts_with("called"));
        descriptor.opaque = false;
        assert_eq!(&descriptor, twin.descriptor());
    }
    let drag = catalog.find("called-drag", None).unwrap();
    let mut set = drag.class.new_set();
    set.add(&"factor = 2.0".parse().unwrap()).unwrap();
    let layout = Layout { frames: 1, angles: 0, states: 0, memory: 0, signals: 0, joints: 0, values: 1 };
    let mut inputs = vec![0.0; layout.inputs()];
    inputs[layout.frames_at() + 12..][..3].copy_from_slice(&[1.0, 2.0, 3.0]);
    for _ in 0..3 {
        set.accept(0, &inputs).unwrap();
    }
    let memory = set.save(0).unwrap();
    set.add(&"factor = 3.0".parse().unwrap()).unwrap();
    set.load(1, &memory).unwrap();
    assert_eq!(set.load(1, &memory[1..]).unwrap_err().message, "not the memory of a drag");
    let inputs = inputs.repeat(2);
    let wanted = Wanted { jacobian: false, second: false };
    let mut out = vec![0.0; 2 * layout.force_results()];
    set.evaluate(&Batch { instances: &[1, 0], inputs: &inputs, wanted }, &mut out).unwrap();
    // Forces, torques, steps, no potential, dissipation.
    assert_eq!(out[..7], [-3.0, -6.0, -9.0, 0.0, 0.0, 0.0, 3.0]);
    assert!(out[7].is_nan() && out[8] == 42.0);
    assert_eq!(out[9..16], [-2.0, -4.0, -6.0, 0.0, 0.0, 0.0, 3.0]);
    let short = set.evaluate(&Batch { instances: &[0], inputs: &inputs[1..19], wanted }, &mut out[..9]);
    assert!(short.unwrap_err().message.contains("needs 19 inputs"));
}

#[test]
fn a_library_in_cpp_loads() {
    let source = r#"
        #include "odyn_element.h"
        namespace {
        int32_t record(const void *, const odyn_recorder *o, odyn_error *error) {
            try {
                odyn_rows_coincident(o, 0, 0, 1);
                return ODYN_OK;
            } catch (...) {
                return odyn_fail(error, "an exception");
            }
        }
        const odyn_named ends[] = {{"i", "", ""}, {"j", "", ""}};
        const char *const rows[] = {"x", "y", "z"};
        odyn_element describe() {
            odyn_element e = odyn_element();
            e.size = sizeof e;
            e.name = "ball";
            e.summary = "points coincide";
            e.frames = ends;
            e.frame_count = 2;
            e.rows = rows;
            e.row_count = 3;
            e.record = record;
            return e;
        }
        const odyn_element ball = describe();
        }
        ODYN_PLUGIN(balls, "balls", "0.1.0", "Balls", ODYN_LISTS_JOINT("ball"), &ball)
    "#;
    let scratch = Scratch::new();
    let source = scratch.file("balls.cpp", source);
    let Some(library) = compile("c++", &source, "balls", &["-std=c++11"], scratch.path()) else { return };
    let ball = classes(&library).find("ball", None).unwrap();
    let mut set = ball.class.new_set();
    set.add(&Params::new()).unwrap();
    assert_eq!(set.record(0).unwrap().outputs.len(), 3);
}
