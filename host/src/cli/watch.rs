//! `odyn run --watch`: runs a scene again when its file or a library changes.
//!
//! Files are looked at a few times a second: that works on every system and over networks.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use odyn::session::{RunOptions, Watched};

use super::exit;
use super::failure::Failure;
use super::run::once;
use super::scene_args::RunArgs;

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(300);

/// Runs, and runs again after each change, until Ctrl-C.
pub(super) fn watch(args: &RunArgs, options: &RunOptions, stop: &Arc<AtomicBool>) -> Result<u8, Failure> {
    let mut watched = Watched::new(&args.scene.scene, options);
    loop {
        // What is wrong is reported, and may be put right.
        if let Err(failure) = once(args, options, stop) {
            failure.tell(args.scene.json);
        }
        if !args.quiet && !stop.load(Ordering::Relaxed) {
            eprintln!("watching {}; Ctrl-C ends", watched.names());
        }
        let Some(changed) = wait(&mut watched, stop) else { return Ok(exit::INTERRUPTED) };
        if !args.quiet {
            eprintln!("{changed} changed: running again");
        }
    }
}

/// Waits for a change that is complete, and gives what changed in words; `None` after Ctrl-C.
fn wait(watched: &mut Watched, stop: &AtomicBool) -> Option<String> {
    loop {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        if let Some(changed) = watched.look(Instant::now()) {
            return Some(changed);
        }
        std::thread::sleep(PAUSE);
    }
}
