//! FMUs inside scenes: one made by hand in C for both versions of the interface, and what this program exports, against the same
//! physics from elements.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use odyn::export::fmu::{Fmu, Kinds, TARGETS, Version, build};
use odyn::results::{Packing, zip};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, difference, options, root};

/// With this set, what needs a compiler of C is left out where there is none.
const SKIP: &str = "ODYN_SKIP_C";

/// A carriage with a brake that grows with its speed, led to 1 m by a controller.
const CARRIAGE: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces", "odyn-controls"]

[simulation]
t_end = 1
output_step = 0.025

[[body]]
name = "carriage"
mass = 2
inertia = [1, 1, 1]

[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]

[[force]]
name = "motor"
type = "translational-actuator"
bodies = ["ground", "carriage"]
axis = [1, 0, 0]
inputs = { signal = "controller.@output@" }
params.along = "axis"
params.of_speed = "-3 v"

[[output]]
name = "x"
quantity = "position"
of = "carriage"
component = "x"

[[output]]
name = "u"
quantity = "value"
of = "controller"
channel = "@output@"

[[control]]
name = "controller"
inputs = { set_point = 1, measured = "x" }
"#;

const OWN: &str = r#"
type = "digital-pid"
params = { period = 0.01, kp = 40.0, ki = 30.0, delay = true }
"#;

const FOREIGN: &str = r#"
type = "fmu"
params = { file = "model.fmu", period = 0.01, parameters = { kp = 40.0, ki = 30.0, label = "left" } }
"#;

fn carriage(controller: &str) -> String {
    let output = if controller.contains("digital-pid") { "output" } else { "u" };
    CARRIAGE.replace("@output@", output) + controller
}

/// The FMU by hand, of a version of the interface, with changes to its description; `false` where there is no compiler.
fn make(folder: &Scratch, version: Version, change: &dyn Fn(String) -> String) -> bool {
    if Command::new("cc").arg("--version").output().is_err() {
        assert!(std::env::var_os(SKIP).is_some(), "there is no compiler `cc`; set {SKIP}=1 to leave out what needs it");
        return false;
    }
    let source = root().join("tests/fmu/model.c");
    let library = folder.path().join("model.so");
    let (flags, text, place): (&[&str], _, _) = match version {
        Version::Two => (&[], "two.xml", "linux64"),
        Version::Three => (&["-DTHREE"], "three.xml", "x86_64-linux"),
    };
    let output = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-o"])
        .args([&library, &source])
        .args(flags)
        .arg("-lm")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = change(fs::read_to_string(root().join("tests/fmu").join(text)).unwrap());
    let binary = fs::read(&library).unwrap();
    let place = format!("binaries/{place}/model.so");
    let files = [("modelDescription.xml".to_string(), text.as_bytes()), (place, binary.as_slice())];
    folder.file("model.fmu", zip(&files, Packing::Deflated).unwrap());
    true
}

fn open(folder: &Scratch, text: &str, sets: &[&str]) -> Result<Session, String> {
    let path = folder.file("scene.toml", text);
    Session::open(&path, &options(sets, &[])).map_err(|error| error.to_string())
}

fn run(folder: &Scratch, text: &str, sets: &[&str]) -> Result<RunReport, String> {
    let report = open(folder, text, sets)?.run(None, Box::new(|_| ()), &Default::default());
    let report = report.map_err(|error| error.to_string())?;
    assert_eq!(report.exit_code(), 0, "{} {:?}", report.summary.reason, report.summary.audit);
    Ok(report)
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// The controller of the standard library, which samples with the same period and gives out what it computed one period later, has
/// the same equations: the same bits, by every way of computing.
#[test]
fn a_controller_in_an_fmu_moves_a_machine_as_the_element_does() {
    let folder = Scratch::new();
    for version in [Version::Two, Version::Three] {
        if !make(&folder, version, &|text| text) {
            return;
        }
        for sets in [
            &[][..],
            &["simulation.method=radau5"],
            &["simulation.formulation=cartesian"],
            &["simulation.engine=reference"],
            &["simulation.method=rk4", "simulation.fixed_step=0.0025"],
        ] {
            let own = run(&folder, &carriage(OWN), sets).unwrap();
            let foreign = run(&folder, &carriage(FOREIGN), sets).unwrap();
            let again = run(&folder, &carriage(FOREIGN), sets).unwrap();
            assert!(column(&own, "u").iter().any(|u| *u > 20.0), "something moves");
            for name in ["x", "u"] {
                assert!(same_bits(column(&own, name), column(&foreign, name)), "{version:?} {sets:?}: {name}");
                assert!(same_bits(column(&again, name), column(&foreign, name)), "{version:?} {sets:?}: {name} again");
            }
        }
    }
}

/// A mass on a spring hangs on the carriage. Inside the scene it is a body; outside, an FMU that takes the place of the carriage and
/// gives the force of the spring. The difference falls in proportion to the communication interval.
#[test]
fn a_mechanism_in_two_parts_converges_with_the_interval() {
    let folder = Scratch::new();
    if !make(&folder, Version::Two, &|text| text) {
        return;
    }
    let base = CARRIAGE.split("[[force]]").next().unwrap().to_string()
        + "[[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"carriage\"\ncomponent = \"x\"\n";
    let base = base.replace("inertia = [1, 1, 1]", "inertia = [1, 1, 1]\nvelocity = [1, 0, 0]");
    let whole = base.clone()
        + r#"
[[body]]
name = "mass"
mass = 0.5
inertia = [1, 1, 1]
[[joint]]
name = "second"
type = "translational"
bodies = ["ground", "mass"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "translational-actuator"
bodies = ["carriage", "mass"]
axis = [1, 0, 0]
params.along = "axis"
params.of_length = "-20 l"
"#;
    let split = base
        + r#"
[[force]]
name = "spring"
type = "translational-actuator"
bodies = ["ground", "carriage"]
axis = [1, 0, 0]
inputs = { signal = "mass.u" }
params.along = "axis"
[[control]]
name = "mass"
type = "fmu"
inputs = { measured = "x" }
params = { file = "model.fmu", period = 0.01, parameters = { kp = 20.0, ki = 0.5, mode = 1 } }
"#;
    let exact = run(&folder, &whole, &[]).unwrap();
    let errors = [8e-3, 4e-3, 2e-3, 1e-3].map(|period| {
        let period = format!("mass.params.period={period}");
        difference(column(&run(&folder, &split, &[&period]).unwrap(), "x"), column(&exact, "x"))
    });
    println!("{errors:?}");
    assert!(errors[0] < 0.05, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((1.8..2.2).contains(&(pair[0] / pair[1])), "of first order: {errors:?}");
    }
}

/// A pendulum with a torque as input, exported by this program, swings inside a scene as it does by itself.
#[test]
fn what_is_exported_runs_inside() {
    let folder = Scratch::new();
    let pendulum = r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
t_end = 1
output_step = 0.05
gravity = [0, 0, -9.81]
fixed_step = 0.001
method = "rk4"
[[body]]
name = "arm"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0.5, 0, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "arm"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[output]]
name = "z"
quantity = "position"
of = "arm"
component = "z"
"#;
    let alone = run(&folder, pendulum, &[]).unwrap();
    let machine = crate::export::machine(open(&folder, pendulum, &[]).unwrap(), None, "rk4");
    let scene = CARRIAGE.split("[[force]]").next().unwrap().replace("0.025", "0.05")
        + r#"
[[control]]
name = "arm"
type = "fmu"
params = { file = "pendulum.fmu", period = 0.01 }
[[output]]
name = "z"
quantity = "value"
of = "arm"
channel = "z"
"#;
    for version in [Version::Two, Version::Three] {
        let fmu = Fmu::new(&machine, version, Kinds { co_simulation: true, model_exchange: true });
        let fmu = fmu.unwrap_or_else(|error| panic!("{}", error.message));
        let Some(binary) = build(&fmu, &TARGETS[0], folder.path()).unwrap() else { return };
        folder.file("pendulum.fmu", fmu.archive(&[binary]).unwrap());
        let inside = run(&folder, &scene, &[]).unwrap();
        let (own, held) = (column(&alone, "z"), column(&inside, "z"));
        // A row at a communication point has what was held until then: that of one period earlier.
        let finer = run(&folder, pendulum, &["simulation.output_step=0.01"]).unwrap();
        let finer = column(&finer, "z");
        let late: Vec<f64> = (0..own.len()).map(|k| finer[(5 * k).saturating_sub(1)]).collect();
        let off = difference(held, &late);
        assert!(off < 1e-9, "{version:?}: {off:e}");
    }
}

/// A run that is saved and brought back, one with checkpoints, and one that continues from another have the FMU's state.
#[test]
fn the_state_of_an_fmu_is_saved_and_restored() {
    let folder = Scratch::new();
    if !make(&folder, Version::Three, &|text| text) {
        return;
    }
    let text = carriage(FOREIGN);
    let started = |text: &str| open(&folder, text, &[]).unwrap().prepare().unwrap().start().unwrap();
    let mut run = started(&text);
    run.advance(0.333).unwrap();
    let saved = run.save().unwrap();
    run.advance(0.8).unwrap();
    let first = run.output("x").unwrap();
    run.restore(&saved).unwrap();
    run.advance(0.8).unwrap();
    assert_eq!(first.to_bits(), run.output("x").unwrap().to_bits());
    let mut other = started(&text);
    other.restore(&saved).unwrap();
    other.advance(0.8).unwrap();
    assert_eq!(first.to_bits(), other.output("x").unwrap().to_bits(), "in another run");
    // Legs between checkpoints change digits by less than the tolerance.
    let whole = self::run(&folder, &text, &[]).unwrap();
    let results = folder.path().join("results");
    let legs = open(&folder, &text, &["simulation.checkpoint_every=0.3"]).unwrap();
    let legs = legs.run(Some(&results), Box::new(|_| ()), &Default::default()).unwrap();
    assert!(difference(column(&legs, "x"), column(&whole, "x")) < 1e-8);
    assert_eq!(legs.summary.checkpoints, 3);
    // On from the end of another run, also where islands run apart.
    let beside = text.clone() + "[[body]]\nname = \"stone\"\nmass = 1\ninertia = [1, 1, 1]\n";
    let first = open(&folder, &beside, &["simulation.t_end=0.325"]).unwrap();
    first.run(Some(&results), Box::new(|_| ()), &Default::default()).unwrap();
    for islands in ["together", "apart"] {
        let mut rest = open(&folder, &beside, &[&format!("simulation.islands=\"{islands}\"")]).unwrap();
        rest.go_on_from(odyn::session::Restart::read(&results).unwrap()).unwrap();
        let rest = rest.run(None, Box::new(|_| ()), &Default::default()).unwrap();
        let last = |report: &RunReport| *column(report, "x").last().unwrap();
        let off = (last(&rest) - last(&whole)).abs();
        assert!(off < 1e-8, "{islands}: {off:.1e}");
    }

    assert!(make(&folder, Version::Three, &|text| text.replace("canSerializeFMUState=\"true\"", "")));
    let error = started(&text).save().map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("ODY0853") || error.contains("keeps no state"), "{error}");
    let legs = open(&folder, &text, &["simulation.checkpoint_every=0.3"]).unwrap();
    let error = legs.run(Some(&results), Box::new(|_| ()), &Default::default()).unwrap_err().to_string();
    assert!(error.contains("canSerializeFMUstate"), "{error}");
}

/// What an FMU returns ends the run with its name, that of its element, and the rows so far.
#[test]
fn failures_of_fmus_end_the_run_in_words() {
    let folder = Scratch::new();
    for version in [Version::Two, Version::Three] {
        if !make(&folder, version, &|text| text) {
            return;
        }
        for (fault, word) in
            [(2, "discard"), (3, "error"), (4, "fatal"), (5, "ended the simulation"), (6, "not a finite number")]
        {
            let text = carriage(&FOREIGN.replace("label = \"left\"", &format!("fault = {fault}")));
            let results = folder.path().join(format!("results-{fault}"));
            let session = open(&folder, &text, &[]).unwrap();
            let error = session.run(Some(&results), Box::new(|_| ()), &Default::default()).unwrap_err();
            let error = &error.diagnostics[0];
            assert_eq!(error.code.code, "ODY0852");
            for word in ["`controller` (model.fmu/fmu) failed at t = 0.11 s", word] {
                assert!(error.message.contains(word), "{version:?}: {}", error.message);
            }
            assert!(fault > 4 || error.message.contains("it says: the step cannot be made"), "{}", error.message);
            let rows = fs::read_to_string(results.join("results.csv")).unwrap().lines().count();
            assert_eq!(rows, 1 + 5, "up to 0.1 s");
        }
    }
}

fn refused(folder: &Scratch, text: &str) -> (String, String) {
    let path = folder.file("scene.toml", text);
    let error = Session::open(&path, &options(&[], &[])).map(|_| ()).unwrap_err();
    let error = &error.diagnostics[0];
    (error.code.code.into(), format!("{} {}", error.message, error.help.join(" ")))
}

#[test]
fn scenes_that_use_an_fmu_wrongly_are_refused() {
    let folder = Scratch::new();
    if !make(&folder, Version::Two, &|text| text) {
        return;
    }
    for (from, to, word) in [
        ("kp = 40.0", "kq = 40.0", "did you mean `parameters.kp`? Output per error"),
        ("kp = 40.0", "kp = \"left\"", "left"),
        ("model.fmu", "other.fmu", "other.fmu` cannot be used as an FMU: it cannot be read"),
        ("file = \"model.fmu\", ", "", "`controller` names no FMU"),
        ("period = 0.01", "period = -0.01", "`period` is out of range"),
        ("controller.u", "controller.v", "`controller` (fmu) has no channel `v`"),
    ] {
        let (found, message) = refused(&folder, &carriage(FOREIGN).replace(from, to));
        println!("{found} {message}");
        assert!(message.contains(word), "{from} -> {to}: {found} {message}");
    }
    let session = open(&folder, &carriage(FOREIGN), &[]).unwrap();
    let error = odyn::analyses::statics::equilibrium(&session, &mut |_| ()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("those of the FMU `controller` are not known"), "{error}");
    let text = carriage(FOREIGN).replace("measured =", "mesured =");
    assert!(refused(&folder, &text).1.contains("did you mean `measured`?"));
}

/// Archives and descriptions that are damaged, hostile or of no use here.
#[test]
fn fmus_that_cannot_be_used_are_refused() {
    let folder = Scratch::new();
    let text = carriage(FOREIGN);
    let good = fs::read_to_string(root().join("tests/fmu/two.xml")).unwrap();
    let archive = |xml: &str, files: &[(&str, &str)]| {
        let all = [("modelDescription.xml", xml)].into_iter().chain(files.iter().copied());
        let all: Vec<(String, &[u8])> = all.map(|(name, text)| (name.to_string(), text.as_bytes())).collect();
        zip(&all, Packing::Deflated).unwrap()
    };
    let mut long = archive(&good, &[("resources/big", &"0".repeat(1 << 20))]);
    // Its size in the central directory: more than deflate can make.
    let entry = long.windows(4).rposition(|four| four == b"PK\x01\x02").unwrap();
    long[entry + 24..entry + 28].copy_from_slice(&0x7fff_ffff_u32.to_le_bytes());
    let mut broken = archive(&good, &[]);
    let middle = broken.len() / 3;
    broken[middle] ^= 0x55;
    let billion =
        "<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]>".to_string() + good.split_once('\n').unwrap().1;
    let deep = format!("<fmiModelDescription>{}", "<a>".repeat(100_000));
    let me = good.replace("CoSimulation", "ModelExchange");
    let mac = [("binaries/darwin64/model.dylib", "x"), ("sources/model.c", "x")];
    for (bytes, code, words) in [
        (b"no zip".to_vec(), "ODY0850", &["no zip archive"][..]),
        (archive(&good, &[])[..200].to_vec(), "ODY0850", &["no zip archive"]),
        (zip(&[("a.txt".into(), b"a".as_slice())], Packing::Stored).unwrap(), "ODY0850", &["no FMU"]),
        (broken, "ODY0850", &["`modelDescription.xml` in it is damaged"]),
        (long, "ODY0850", &["`resources/big`", "zip bomb"]),
        (archive(&good, &[("../../evil", "x")]), "ODY0850", &["`../../evil`", "outside"]),
        (archive(&billion, &[]), "ODY0850", &["modelDescription.xml, line 1", "DTD"]),
        (archive(&deep, &[]), "ODY0850", &["modelDescription.xml, line"]),
        (archive("<robot/>", &[]), "ODY0850", &["line 1, column 1", "<robot>"]),
        (
            archive(&good.replace("valueReference=\"3\"", "valueReference=\"x\""), &[]),
            "ODY0850",
            &["line 9", "`valueReference`"],
        ),
        (archive(&good.replace("name=\"kp\"", "name=\"ki\""), &[]), "ODY0850", &["two variables `ki`"]),
        (archive(&good.replace("<Real start=\"1\"/>", "<Real start=\"one\"/>"), &[]), "ODY0850", &["\"one\" of `kp`"]),
        (archive(&good.replace("\"2.0\"", "\"1.0\""), &[]), "ODY0851", &["version 1.0"]),
        (archive(&me, &[]), "ODY0851", &["only ModelExchange"]),
        (archive(&good.replace("canGetAndSetFMUstate", "needsExecutionTool"), &[]), "ODY0851", &["needs by hand"]),
        (archive(&good, &mac), "ODY0851", &["linux64/model.so", "darwin64", "its sources are inside", "fmpy compile"]),
    ] {
        folder.file("model.fmu", &bytes);
        let (found, message) = refused(&folder, &text);
        assert_eq!(found, code, "{message}");
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
    }
}

/// The Reference FMUs of the Modelica Association, where a folder with some is named: `ODYN_REFERENCE_FMUS`, with `2.0` and `3.0` below.
#[test]
fn reference_fmus_run() {
    let Some(place) = std::env::var_os("ODYN_REFERENCE_FMUS").map(PathBuf::from) else {
        println!("left out: name a folder with the Reference FMUs, built, in ODYN_REFERENCE_FMUS");
        return;
    };
    let folder = Scratch::new();
    let base = CARRIAGE.split("[[force]]").next().unwrap().to_string();
    for version in ["2.0", "3.0"] {
        let copy = |name: &str| fs::copy(place.join(version).join(name), folder.path().join(name)).unwrap();
        copy("Dahlquist.fmu");
        let text = base.clone()
            + "[[control]]\nname = \"d\"\ntype = \"fmu\"\nparams = { file = \"Dahlquist.fmu\", period = 0.1, parameters = { k = 2.0 } }\n\
               [[output]]\nname = \"y\"\nquantity = \"value\"\nof = \"d\"\nchannel = \"x\"\n";
        let report = run(&folder, &text, &["simulation.output_step=0.05"]).unwrap();
        // It takes Euler's steps of 0.1 s: x = (1 - 0.1 k)^n. Between two points the row has the value of the first.
        for (k, y) in column(&report, "y").iter().enumerate().filter(|(k, _)| k % 2 == 1) {
            let exact = 0.8_f64.powi((k as i32 - 1) / 2);
            assert!((y - exact).abs() < 1e-12, "{version}: row {k}: {y}, {exact}");
        }
        copy("Feedthrough.fmu");
        let input = |name: &str| format!("Float64_{name}");
        let text = base.clone()
            + &format!(
                "[[control]]\nname = \"f\"\ntype = \"fmu\"\ninputs.{} = \"wave.output\"\nparams = {{ file = \"Feedthrough.fmu\", period = 0.1 }}\n\
                 [[control]]\nname = \"wave\"\ntype = \"signal-source\"\nparams.function = \"sin(3 t)\"\n\
                 [[output]]\nname = \"y\"\nquantity = \"value\"\nof = \"f\"\nchannel = \"{}\"\n",
                input("continuous_input"),
                input("continuous_output"),
            );
        let report = run(&folder, &text, &["simulation.output_step=0.05"]).unwrap();
        for (k, y) in column(&report, "y").iter().enumerate().filter(|(k, _)| k % 2 == 1) {
            let taken = 0.1 * (((k - 1) / 2) as f64 - 1.0).max(0.0);
            assert!((y - (3.0 * taken).sin()).abs() < 1e-12, "{version}: row {k}: {y}");
        }
        copy("BouncingBall.fmu");
        let text = base.clone()
            + "[[control]]\nname = \"ball\"\ntype = \"fmu\"\nparams = { file = \"BouncingBall.fmu\", period = 0.01 }\n\
               [[output]]\nname = \"h\"\nquantity = \"value\"\nof = \"ball\"\nchannel = \"h\"\n";
        let report = run(&folder, &text, &["simulation.output_step=0.005", "simulation.t_end=0.3"]).unwrap();
        let h = column(&report, "h");
        // Falling from 1 m; the FMU takes Euler's steps of 0.01 s.
        assert!((h[41] - (1.0 - 9.81 / 2.0 * 0.2_f64.powi(2))).abs() < 0.02, "{version}: {}", h[41]);
    }
}
