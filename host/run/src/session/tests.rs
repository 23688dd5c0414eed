//! Whole runs against closed forms, and the bookkeeping around them.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod bookkeeping;
mod checkpoints;
mod checks;
mod curves;
mod floors;
mod islands;
mod judged;
mod motions;
mod particles;
mod pictures;
mod pruning;
mod recoveries;
mod restarts;
mod right_sides;
mod runs;
mod signals;
mod starts;
#[cfg(feature = "jit")]
mod tiers;
mod welded;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use crate::results::{CHECKPOINT_FILE, Status};
use crate::tests::{catalog, scene, scenes};

#[track_caller]
fn open(text: &str) -> Session {
    Session::with_catalog(scene(text), Vec::new(), &catalog(), &RunOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn run(text: &str) -> RunReport {
    open(text).run(None, Box::new(|_| ()), &Arc::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// A column of results.
#[track_caller]
fn column<'a>(report: &'a RunReport, name: &str) -> &'a [f64] {
    let k = report.channels.iter().position(|c| c.name == name);
    &report.columns[k.unwrap_or_else(|| panic!("no channel `{name}`"))]
}

fn output(name: &str, keys: &str) -> String {
    format!("[[output]]\nname = \"{name}\"\n{}\n", keys.replace("; ", "\n"))
}

fn settings(keys: &str) -> String {
    format!("[simulation]\n{}\n", keys.replace("; ", "\n"))
}

/// Largest difference between a column and a function of time.
fn off(report: &RunReport, name: &str, expected: impl Fn(f64) -> f64) -> f64 {
    let pairs = report.times.iter().zip(column(report, name));
    pairs.map(|(t, x)| (x - expected(*t)).abs()).fold(0.0, |m: f64, x| if x <= m { m } else { x })
}

/// Runs into a folder, from its checkpoint if it has one; stopped after a share of the run.
fn go_on(text: &str, folder: &Path, until: f64) -> RunReport {
    let stop = Arc::new(AtomicBool::new(false));
    let mut session = open(text);
    if folder.join(CHECKPOINT_FILE).exists() {
        session.resume(Checkpoint::read(folder).unwrap()).unwrap();
    }
    let flag = Arc::clone(&stop);
    let progress = move |share: f64| flag.store(share > until, Ordering::Relaxed);
    session.run(Some(folder), Box::new(progress), &stop).unwrap_or_else(|error| panic!("{error}"))
}
