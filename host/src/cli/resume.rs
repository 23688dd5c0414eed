//! `odyn resume`

use std::fs;
use std::path::Path;

use odyn::analyses::statics;
use odyn::results::{CHECKPOINT_FILE, SUMMARY_FILE};
use odyn::session::{Checkpoint, Session};

use super::exit;
use super::failure::{Failure, watchdog};
use super::interrupt::stop_on_interrupt;
use super::run::{Told, complete, warn};
use super::scene_args::ResumeArgs;
use super::terminal;

/// Goes on with a run from its last checkpoint.
pub(super) fn resume(args: &ResumeArgs) -> Result<u8, Failure> {
    let folder = &args.folder;
    if !folder.join(CHECKPOINT_FILE).exists()
        && let Some(status) = end_reached(folder)
    {
        let suspect = status == "suspect";
        if !args.quiet && !args.json {
            let how = if suspect { " with suspect results" } else { "" };
            let text = format!("{}: the run reached its end{how}, nothing is left to do\n", folder.display());
            terminal::print(&text)?;
        }
        return Ok(if suspect { exit::AUDIT } else { exit::DONE });
    }
    let point = Checkpoint::read(folder).map_err(|diagnostic| Failure::new(*diagnostic).exit(exit::FILES))?;
    let stop = stop_on_interrupt();
    let Some((scene, mut options)) = point.opened() else {
        return Err(Failure::new(*Checkpoint::without_scene(folder)).exit(exit::FILES));
    };
    options.plugins.extend(args.plugins.iter().cloned());
    options.equilibrium = Some(statics::start);
    options.watchdog = Some(watchdog(args.watchdog, args.json));
    let afterwards = options.afterwards;
    let mut session = Session::open(scene, &options)?;
    session.resume(point)?;
    let told = Told { json: args.json, quiet: args.quiet };
    warn(&session, &told);
    complete(session, afterwards, folder, &told, &stop)
}

/// The status that the summary in a folder of results gives to a run that reached its end.
fn end_reached(folder: &Path) -> Option<String> {
    let text = fs::read_to_string(folder.join(SUMMARY_FILE)).ok()?;
    let summary: serde_json::Value = serde_json::from_str(&text).ok()?;
    let status = summary["status"].as_str()?;
    ["completed", "suspect"].contains(&status).then(|| status.to_owned())
}
