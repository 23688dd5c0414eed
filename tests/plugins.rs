//! Libraries that are built as strangers build them, outside the workspace, loaded for real.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use element_api::params::{ParamError, Table};
use element_api::recording::{Input, Op, Role};
use element_api::set::{Batch, CreateError, Wanted};
use odyn::catalog::{Catalog, CatalogError, ElementHandle, SearchPath};
use odyn::diagnostics::codes;
use odyn::session::Session;

use crate::fixtures::{build, build_at, build_sources, file};
use crate::support::{Scratch, column, kept, options, root};

fn catalog() -> Catalog {
    Catalog::new().with_copies_in(kept("library-copies"))
}

/// A search path of one folder.
fn only(folder: &Path) -> SearchPath {
    SearchPath::of(&[], &[folder.to_path_buf()], None, Path::new(""))
}

fn load(name: &str) -> Result<Catalog, CatalogError> {
    let mut catalog = catalog();
    catalog.add(name, &only(&build(name)))?;
    Ok(catalog)
}

fn element(library: &str, name: &str) -> ElementHandle {
    load(library).expect("a sound library").find(name, None).expect("an element of it")
}

fn params(text: &str) -> Table {
    text.parse().expect("TOML")
}

/// A mass on a rod, and one on a spring of zero free length, which swings as x = cos(sqrt(k/m) t).
pub const STRANGERS_SCENE: &str = r#"
title = "Elements of a stranger"
[plugins]
libraries = ["stranger"]
path = ["LIBRARIES"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 2
output_step = 0.1
[[body]]
name = "pendulum"
mass = 1
inertia = [1, 1, 1]
position = [0.25, 0, 0]
[[body]]
name = "bob"
mass = 2
inertia = [1, 1, 1]
position = [1, 0, 0]
[[joint]]
name = "rod"
type = "rod"
bodies = ["ground", "pendulum"]
params.length = "25 cm"
[[force]]
name = "spring"
type = "stranger/spring"
bodies = ["ground", "bob"]
params.stiffness = "18 N/m"
[[output]]
name = "x"
quantity = "position"
of = "pendulum"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "pendulum"
component = "y"
[[output]]
name = "swing"
quantity = "position"
of = "bob"
component = "x"
[[output]]
name = "energy"
quantity = "total_energy"
"#;

/// Everything outside the workspace: the folder of the library, the scene, and what the library depends on.
#[test]
fn a_library_built_outside_the_workspace_runs_in_a_scene() {
    let scratch = Scratch::new();
    let folder = build_at("good-plugin", "stranger", &scratch.path().join("stranger"));
    let scene = STRANGERS_SCENE.replace("\"LIBRARIES\"", &format!("'{}'", folder.display()));
    let session = Session::open(&scratch.file("scene.toml", scene), &options(&[], &[]));
    let session = session.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(session.check_report().mobility, 11);
    let out = scratch.path().join("out");
    let report = session.run(Some(&out), Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0);
    assert_eq!(report.summary.libraries[0].package, "stranger");
    assert!(out.join("results.csv").is_file() && out.join("summary.json").is_file());
    for (x, y) in column(&report, "x").iter().zip(column(&report, "y")) {
        assert!((x.hypot(*y) - 0.25).abs() < 1e-12, "the rod keeps its length: {x}, {y}");
    }
    assert!(column(&report, "y").iter().any(|y| *y < -0.24), "the pendulum swings through its lowest point");
    for (t, x) in report.times.iter().zip(column(&report, "swing")) {
        assert!((x - (3.0 * t).cos()).abs() < 1e-8, "x({t}) = {x}");
    }
    let energy = column(&report, "energy");
    assert!(energy.iter().all(|e| (e - energy[0]).abs() < 1e-8 * energy[0].abs()), "{energy:?}");
}

#[test]
fn the_plugin_of_the_readme_builds_and_its_scene_runs() {
    let read = |file: &str| fs::read_to_string(root().join(file)).unwrap();
    let [manifest, source, scene] =
        ["Cargo.toml", "src/lib.rs", "pendulum.toml"].map(|file| read(&format!("docs/book/examples/rod/{file}")));
    assert!(read("README.md").contains(&format!("\n```rust\n{source}```\n")), "the README shows another joint");
    let folder = build_sources(&manifest, "../../../../element-api", &source, &kept("strangers").join("bars"));
    let scratch = Scratch::new();
    let path = scratch.file("pendulum.toml", scene);
    let session = Session::open(&path, &options(&[], &[folder])).unwrap_or_else(|error| panic!("{error}"));
    assert!(session.warnings.is_empty(), "{:?}", session.warnings);
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0);
    // Released level, v^2 = 2 g |y|, so the tension is m v^2 / l + m g |y| / l = 3 m g |y| / l; its share along y is |y| / l.
    for (y, pull) in column(&report, "y").iter().zip(column(&report, "pull")) {
        let share = y / 0.4;
        assert!((pull + 3.0 * 0.25 * 9.81 * share * share).abs() < 1e-7, "y = {y}, pull {pull}");
    }
    assert!(column(&report, "y").iter().any(|y| *y < -0.39));
}

#[test]
fn a_strangers_library_gives_its_equations() {
    let catalog = load("good-plugin").expect("a sound library");
    let info = catalog.libraries().next().expect("one");
    assert_eq!((info.package.as_str(), info.version.as_str()), ("good-plugin", "0.3.1"));
    assert_eq!(info.sha256.as_deref().map(str::len), Some(64));
    let rod = catalog.find("good-plugin/rod", None).expect("full name");
    assert_eq!(rod.descriptor().params[0].above, Some(0.0));
    assert_eq!(rod.descriptor().params[0].doc, "Distance of the two points.");
    let mut set = rod.class.new_set();
    assert_eq!(set.add(&params("length = 0.1")), Ok(0));
    let recording = set.record(0).expect("a recording");
    assert_eq!(recording.outputs.len(), 1);
    assert!(recording.output(Role::Residual(0)).is_some());
    assert!(recording.constants.contains(&0.1));
    let reads = |input| recording.ops.iter().any(|op| Op::decode(*op) == Some(Op::Input(input)));
    assert!(reads(Input::Position { frame: 1, component: 2 }));
}

#[test]
fn refused_parameters_come_with_their_name() {
    let mut set = element("good-plugin", "rod").class.new_set();
    let error = set.add(&params("length = 2e6")).expect_err("too long");
    assert_eq!(error, CreateError::Parameter(ParamError::new("length", "no rod is a thousand kilometres long")));
    assert_eq!(set.add(&params("length = 2.0")), Ok(0));
}

#[test]
fn a_panic_is_an_error_that_names_its_place() {
    let expect = |message: String| {
        assert!(message.contains("the len is 0 but the index is 7"), "{message}");
        assert!(message.contains("lib.rs:"), "{message}");
    };
    let mut set = element("panicking-plugin", "panicking-joint").class.new_set();
    match set.add(&params("place = 'new'\nafter = 0")) {
        Err(CreateError::Fault(message)) => expect(message),
        other => panic!("{other:?}"),
    }
    set.add(&params("place = 'residual'\nafter = 0")).expect("new is sound");
    expect(set.record(0).expect_err("residual panics").message);

    let mut set = element("panicking-plugin", "panicking-force").class.new_set();
    // One call of `wrench` is the recording.
    for (instance, after) in [100, 3].into_iter().enumerate() {
        set.add(&params(&format!("place = 'wrench'\nafter = {after}"))).expect("new is sound");
        set.record(instance).expect("the first call goes well");
    }
    let inputs = vec![0.0; 2 * 37];
    let batch = Batch { instances: &[0, 1], inputs: &inputs, wanted: Wanted { jacobian: false, second: false } };
    let mut out = vec![0.0; 2 * 14];
    assert_eq!(set.evaluate(&batch, &mut out), Ok(()));
    assert_eq!(set.evaluate(&batch, &mut out), Ok(()));
    let fault = set.evaluate(&batch, &mut out).expect_err("the fourth call panics");
    assert_eq!(fault.instance, 1);
    expect(fault.message);
}

#[test]
fn constants_that_are_no_numbers_and_forgotten_rows_are_found() {
    let mut set = element("nan-plugin", "nan-rod").class.new_set();
    set.add(&params("square = -1.0")).expect("it does not look");
    let message = set.record(0).expect_err("NaN").message;
    assert!(message.contains("constant 0 is NaN"), "{message}");
    let mut set = element("short-rows-plugin", "short-rows").class.new_set();
    set.add(&Table::new()).expect("sound");
    let message = set.record(0).expect_err("a row is missing").message;
    assert_eq!(message, "declares the row `along y`, but does not set it");
}

#[test]
fn another_interface_version_is_refused_before_anything_runs() {
    let error = load("other-abi-plugin").expect_err("version 2");
    assert_eq!(error.code(), codes::ABI_VERSION);
    assert!(error.to_string().contains("interface version 2, this host version 1"), "{error}");
}

#[test]
fn a_file_is_loaded_once_per_process() {
    let (a, b) = (element("good-plugin", "rod"), element("good-plugin", "rod"));
    assert!(Arc::ptr_eq(&a.class, &b.class));
    let mut catalog = catalog();
    for name in ["good-plugin", "good_plugin"] {
        catalog.add(name, &only(&build("good-plugin"))).expect("a sound library");
    }
    assert_eq!(catalog.libraries().count(), 1);
}

/// Whatever is opened leaves a private copy. The libraries get an ending of their own, so that this process has not opened
/// them before.
#[test]
fn only_the_libraries_that_a_scene_names_are_opened() {
    let scratch = Scratch::new();
    let beside = SearchPath::standard(&[], &[]);
    for library in ["joints", "forces", "controls", "compressor"] {
        let path = beside.locate(library).expect("the standard libraries are beside this program");
        let mut bytes = fs::read(&path).unwrap();
        bytes.extend(b"opened once");
        scratch.file(path.file_name().unwrap().to_str().unwrap(), bytes);
    }
    let opened = |scene: &str| {
        let copies = scratch.path().join(scene.replace('/', "-"));
        let mut options = options(&[], &[scratch.path().to_path_buf()]);
        options.library_copies = Some(copies.clone());
        let session = Session::open(&root().join("scenes").join(scene), &options).unwrap_or_else(|e| panic!("{e}"));
        assert!(session.libraries.iter().all(|l| l.path.as_ref().is_some_and(|p| p.starts_with(scratch.path()))));
        let copied = fs::read_dir(&copies).map_or(0, Iterator::count);
        (session.libraries.len(), copied)
    };
    assert_eq!(opened("benchmarks/A01.toml"), (1, 1), "joints");
    // Joints are open already, which shows once they have been copied.
    assert_eq!(opened("benchmarks/compressor.toml"), (2, 2), "compressor and joints");
}

#[test]
fn a_library_may_be_overwritten_while_it_is_in_use() {
    let scratch = Scratch::new();
    let copy = file(scratch.path(), "good-plugin");
    fs::copy(file(&build("good-plugin"), "good-plugin"), &copy).unwrap();
    let mut catalog = catalog();
    catalog.add("good-plugin", &only(scratch.path())).expect("a sound library");
    let spring = catalog.find("spring", None).expect("known");
    fs::write(copy, b"gone").unwrap();
    let mut set = spring.class.new_set();
    set.add(&params("stiffness = 2.0")).expect("sound");
    assert!(set.record(0).is_ok());
}

#[test]
fn a_truncated_library_is_an_error() {
    let scratch = Scratch::new();
    let copy = file(scratch.path(), "good-plugin");
    let bytes = fs::read(file(&build("good-plugin"), "good-plugin")).unwrap();
    for part in [0, 1, 10, 50, 90, 99] {
        fs::write(&copy, &bytes[..bytes.len() * part / 100]).unwrap();
        let error = catalog().add("good-plugin", &only(scratch.path())).expect_err("truncated");
        assert_eq!(error.code(), codes::NOT_A_LIBRARY, "{part} %");
    }
}

/// The fixtures depend on `element-api` only, and so need nothing that the workspace does not have.
#[test]
fn strangers_need_one_dependency() {
    let mut seen = 0;
    for entry in fs::read_dir(root().join("tests/fixtures")).unwrap() {
        let path = entry.unwrap().path().join("Cargo.toml");
        // Libraries in C, and those of earlier versions, are no packages.
        let Ok(manifest) = fs::read_to_string(&path) else { continue };
        seen += 1;
        let manifest: toml::Table = manifest.parse().unwrap();
        let dependencies = manifest.get("dependencies").and_then(|d| d.as_table()).cloned().unwrap_or_default();
        assert!(dependencies.keys().all(|name| name == "element-api"), "{dependencies}");
    }
    assert!(seen > 5, "{seen} packages");
}
