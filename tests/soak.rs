//! Many runs in one process: what a run takes it gives back.
//!
//! The full form: `ODYN_SOAK_RUNS=10000 cargo test --release -p odyn-tests child_that_soaks -- --ignored --nocapture`.
#![cfg(target_os = "linux")]

use std::ffi::OsStr;
use std::fs;

use element_api::adapt::force;
use element_api::manifest::Library;
use element_api::prelude::*;

use crate::support::{child, column, run, run_linked};

/// How many runs.
const RUNS: &str = "ODYN_SOAK_RUNS";
/// Growth of resident memory after a third of the runs that is no leak, bytes: allocators round and keep. A leak of a
/// kilobyte in each run is found with 10 000 runs, one of 20 in the short form.
const MOST_GROWTH: u64 = 4 << 20;

/// A spring that is called at run time, its constants and a buffer on the heap.
struct Spring(Vec<f64>);

impl Element for Spring {
    const NAME: &'static str = "spring";
    const SUMMARY: &'static str = "linear spring";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "one end"), FrameSpec::new("j", "other end")];
    const OPAQUE: bool = true;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self(vec![-4.0; 4096]))
    }
}

impl Force for Spring {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, (at.frames()[1].position - at.frames()[0].position) * S::from(self.0[7]));
    }
}

const SPRING: &str = r#"
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "b"
mass = 1
inertia = [1, 1, 1]
position = [1, 0, 0]
[[force]]
name = "spring"
type = "spring"
bodies = ["ground", "b"]
[[output]]
name = "x"
quantity = "position"
of = "b"
component = "x"
"#;

/// Resident memory of this process, bytes.
fn resident() -> u64 {
    let text = fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    let kilobytes: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    1024 * kilobytes
}

/// One scene of loaded libraries as machine code, one with elements called at run time.
fn once() {
    let compressor = run("compressor.toml", &["simulation.engine=compiled", "simulation.t_end=20"]);
    assert!(!compressor.columns.is_empty());
    let classes = vec![force::<Spring>()];
    let report =
        run_linked(SPRING, Library { package: "soak".into(), version: "1".into(), about: String::new(), classes });
    assert!((column(&report, "x")[10] - 2.0_f64.cos()).abs() < 1e-8);
}

#[test]
#[ignore = "needs a process of its own; run by another test"]
fn child_that_soaks() {
    let runs: u64 = std::env::var(RUNS).unwrap().parse().unwrap();
    (0..runs / 3).for_each(|_| once());
    let before = resident();
    (runs / 3..runs).for_each(|_| once());
    let growth = resident().saturating_sub(before);
    println!("{runs} runs: {} kB resident, {} kB more than after a third of them", resident() / 1024, growth / 1024);
    assert!(growth < MOST_GROWTH, "resident memory grows by {growth} bytes in {} runs", runs - runs / 3);
}

#[test]
fn memory_stays_flat() {
    let output = child("soak::child_that_soaks", RUNS, OsStr::new("300"));
    assert!(
        output.status.success(),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}
