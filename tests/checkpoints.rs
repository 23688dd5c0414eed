//! Runs that are killed (SIGKILL) at any moment and resumed give the same bytes as those that are left alone.
//!
//! This program runs itself as the process that is killed. `ODYN_KILLS` says how often each scene is killed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use element_api::adapt::force;
use element_api::manifest::Library;
use element_api::prelude::*;
use odyn::catalog::{Catalog, SearchPath};
use odyn::diagnostics::Source;
use odyn::results::{CHECKPOINT_FILE, EVENTS_FILE, RESULTS_FILE, SUMMARY_FILE, Table, compare};
use odyn::scene::parse;
use odyn::session::{Checkpoint, RunOptions, Session};

use crate::support::{Scratch, kept};

/// Where the process that is killed finds its scene and puts its results.
const FOLDER: &str = "ODYN_TEST_CHECKPOINTS";
/// Kills per scene where nobody asks for another number.
const KILLS: usize = 3;

/// A brake that wears: it weakens with the fastest speed it ever saw, which only it remembers.
struct Brake {
    fastest: f64,
}

impl Element for Brake {
    const NAME: &'static str = "wearing-brake";
    const SUMMARY: &'static str = "drag that weakens with the fastest speed so far";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("on", "the body")];
    const OPAQUE: bool = true;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self { fastest: 0.0 })
    }
    fn accept(&mut self, at: &Motion<'_, f64>) {
        self.fastest = self.fastest.max(length(at.twists[0].velocity));
    }
    fn save(&self) -> Vec<u8> {
        self.fastest.to_le_bytes().to_vec()
    }
    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        let bytes = memory.try_into().map_err(|_| "eight bytes are expected")?;
        self.fastest = f64::from_le_bytes(bytes);
        Ok(())
    }
}

impl Force for Brake {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("fastest", "m/s", "so far")];
    // Smoothed from zero, so that what is remembered does not switch the force.
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(0, at.twists[0].velocity * S::from(-0.02 / (1.0 + self.fastest)));
    }
    fn channels<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(S::from(self.fastest));
    }
}

/// Two links with a bump stop or a hard stop between them, or friction in the upper joint.
fn links(keys: &str, kind: &str) -> String {
    let force = if kind == "hard stop" {
        "[[joint]]\nname = \"stop\"\ntype = \"rotational-stop\"\nbodies = [\"upper\", \"lower\"]\npoint = [0, 0, 0]\n\
         axis = [0, 0, 1]\nparams.lower = -1.5\nparams.upper = 1.5\nparams.restitution = 0.5\n"
    } else if kind == "friction" {
        "[[force]]\nname = \"friction\"\ntype = \"joint-friction\"\njoints = [\"shoulder\"]\nparams.kind = \"rotation\"\n\
         params.mu = 0.1\nparams.radius = 0.05\nparams.transition_speed = 0.01\n"
    } else {
        "[[force]]\nname = \"stop\"\ntype = \"rotational-bump-stop\"\nbodies = [\"upper\", \"lower\"]\npoint = [0, 0, 0]\n\
         axis = [0, 0, 1]\nparams.lower = -1.5\nparams.upper = 1.5\nparams.torque = 20\nparams.depth = 0.1\nparams.exponent = 1.5\n"
    };
    let body = |name: &str, x: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.01, 0.1, 0.1]\nposition = [{x}, 0, 0]\n")
    };
    let joint = |name: &str, bodies: &str, x: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = [{bodies}]\npoint = [{x}, 0, 0]\naxis = [0, 0, 1]\n"
        )
    };
    let output = |name: &str, of: &str, quantity: &str| {
        format!("[[output]]\nname = \"{name}\"\nquantity = \"{quantity}\"\nof = \"{of}\"\n")
    };
    format!("[simulation]\ngravity = [0, -9.81, 0]\noutput_step = 0.01\ncheckpoint_every = 0.37\n{keys}\n")
        + &body("upper", 0.5)
        + &body("lower", 1.5)
        + &joint("shoulder", "\"ground\", \"upper\"", 0.0)
        + &joint("elbow", "\"upper\", \"lower\"", 1.0)
        + force
        + "[[force]]\nname = \"brake\"\ntype = \"wearing-brake\"\nbodies = [\"lower\"]\n"
        + &output("a", "shoulder", "coordinate")
        + &output("b", "elbow", "coordinate")
        + &output("fastest", "brake", "value")
        + &output("load", "shoulder", "reaction_force")
        + "component = \"y\"\n"
}

fn open(text: &str) -> Session {
    let brake = Library {
        package: "brakes".into(),
        version: "1.0.0".into(),
        about: "brakes".into(),
        classes: vec![force::<Brake>()],
    };
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    catalog.add_library(brake).unwrap();
    let search = SearchPath::standard(&[], &[]);
    for library in ["odyn-joints", "odyn-forces"] {
        catalog.add(library, &search).unwrap();
    }
    let (scene, warnings) =
        parse(Source::new("scene.toml", text), &[]).unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    Session::with_catalog(scene, warnings, &catalog, &RunOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The process that is killed: runs the scene of its folder, or continues with it.
#[test]
#[ignore = "needs a process and a folder of its own; run by other tests"]
fn a_process() {
    let folder = PathBuf::from(std::env::var_os(FOLDER).expect("the folder of the run"));
    let mut session = open(&fs::read_to_string(folder.join("scene.toml")).unwrap());
    if folder.join(CHECKPOINT_FILE).exists() {
        session.resume(Checkpoint::read(&folder).unwrap()).unwrap();
    }
    let report =
        session.run(Some(&folder), Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.exit_code(), 0);
}

fn process(folder: &Path) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "checkpoints::a_process", "--ignored"]).env(FOLDER, folder);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// What is on the disk after a kill: whole rows, the same as those of the run that was left alone, or none yet.
fn check_readable(folder: &Path, alone: &Path) {
    let table = folder.join(RESULTS_FILE);
    if !table.exists() || fs::metadata(&table).unwrap().len() == 0 {
        return;
    }
    let read = Table::read(&table).unwrap_or_else(|error| panic!("{error}"));
    if !read.times.is_empty() {
        let apart = compare(&table, &alone.join(RESULTS_FILE)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((apart.rows, apart.worst().absolute), (read.times.len() as u64, 0.0));
    }
    let summary = fs::read_to_string(folder.join(SUMMARY_FILE)).unwrap();
    assert!(summary.contains("\"status\": \"running\"") || summary.contains("\"status\": \"completed\""));
}

/// Kills the run of a scene at moments spread over its length, and compares what comes out in the end.
fn kill_and_resume(text: &str, seed: u64) {
    let wanted = std::env::var("ODYN_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(KILLS);
    let (alone, killed) = (Scratch::new(), Scratch::new());
    let (alone, killed) = (alone.path(), killed.path());
    for folder in [alone, killed] {
        fs::write(folder.join("scene.toml"), text).unwrap();
    }
    let started = Instant::now();
    assert!(process(alone).wait().unwrap().success());
    let whole = started.elapsed();
    let expected = fs::read(alone.join(RESULTS_FILE)).unwrap();
    let mut bits = seed;
    let mut kills = 0;
    let mut resumed = 0;
    for _ in 0..20 * wanted.max(1) {
        let mut run = process(killed);
        if kills < wanted || (wanted > 0 && resumed == 0) {
            // Marsaglia 2003, "Xorshift RNGs".
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            std::thread::sleep(whole.mul_f64((bits >> 11) as f64 / (1_u64 << 53) as f64).max(Duration::from_millis(1)));
            if run.try_wait().unwrap().is_none() {
                kills += 1;
                run.kill().unwrap();
            }
        }
        if !run.wait().unwrap().success() {
            check_readable(killed, alone);
            resumed += usize::from(killed.join(CHECKPOINT_FILE).exists());
            continue;
        }
        assert!(fs::read(killed.join(RESULTS_FILE)).unwrap() == expected, "after {kills} kills");
        let events = [alone, killed].map(|folder| fs::read_to_string(folder.join(EVENTS_FILE)).ok());
        assert!(events[0] == events[1], "events after {kills} kills");
        if kills >= wanted && (wanted == 0 || resumed > 0) {
            return;
        }
    }
    panic!("{kills} of {wanted} kills, {resumed} with a checkpoint, and the run does not get to its end");
}

#[test]
fn joint_coordinates_with_stops() {
    kill_and_resume(
        &links("formulation = \"joint\"\nt_end = 30\ntolerance = 1e-9", "bump stop"),
        0x9e37_79b9_7f4a_7c15,
    );
}

#[test]
fn coordinates_of_bodies_with_friction() {
    kill_and_resume(&links("t_end = 12\ntolerance = 1e-8", "friction"), 0x1234_5678_9abc_def1);
}

#[test]
fn an_implicit_method() {
    kill_and_resume(&links("method = \"radau5\"\nt_end = 12\ntolerance = 1e-7", "bump stop"), 0x0fed_cba9_8765_4321);
}

#[test]
fn contacts() {
    kill_and_resume(&links("t_end = 12\ntolerance = 1e-9", "hard stop"), 0x2545_f491_4f6c_dd1d);
}
