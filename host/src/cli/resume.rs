//! `odyn resume`

use std::fs;
use std::path::Path;

use odyn::results::{CHECKPOINT_FILE, SUMMARY_FILE};
use odyn::session::{Checkpoint, Session};

use super::args::ResumeArgs;
use super::exit;
use super::failure::Failure;
use super::run::{Told, integrate, stop_on_interrupt, warn};
use super::terminal;

/// Goes on with a run from its last checkpoint.
pub(super) fn resume(args: &ResumeArgs) -> Result<u8, Failure> {
    let folder = &args.folder;
    if !folder.join(CHECKPOINT_FILE).exists() && is_completed(folder) {
        if !args.quiet && !args.json {
            terminal::print(&format!("{}: the run reached its end, nothing is left to do\n", folder.display()))?;
        }
        return Ok(exit::DONE);
    }
    let point = Checkpoint::read(folder).map_err(|diagnostic| Failure::new(exit::FILES, *diagnostic))?;
    let stop = stop_on_interrupt();
    let Some((scene, mut options)) = point.opened() else {
        return Err(Failure::new(exit::FILES, *Checkpoint::without_scene(folder)));
    };
    options.plugins.extend(args.plugins.iter().cloned());
    let mut session = Session::open(scene, &options)?;
    session.resume(point)?;
    let told = Told { json: args.json, quiet: args.quiet };
    warn(&session, &told);
    let result = integrate(session, folder, &told, &stop);
    told.end(&result?, folder)
}

/// Whether the summary in a folder of results says so.
fn is_completed(folder: &Path) -> bool {
    let text = fs::read_to_string(folder.join(SUMMARY_FILE)).unwrap_or_default();
    serde_json::from_str::<serde_json::Value>(&text).is_ok_and(|summary| summary["status"] == "completed")
}
