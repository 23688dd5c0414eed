//! `odyn export`

use std::path::Path;

use odyn::diagnostics::{Diagnostic, codes, shown};
use odyn::results::{MOTION_FILE, Motion, glb, replace};
use odyn::scene::parse_unit;

use super::exit;
use super::export_args::GlbArgs;
use super::failure::Failure;
use super::terminal;

/// Writes the motion of a run as glTF.
pub(super) fn export_glb(args: &GlbArgs) -> Result<u8, Failure> {
    let path = args.folder.join(MOTION_FILE);
    let motion = Motion::read(&path)?;
    // A unit that is not known, of a file that somebody else wrote, is taken for a second.
    let unit = parse_unit(&motion.header.time_unit).map_or(1.0, |(_, factor)| factor);
    let bytes = glb(&motion, unit / args.speed).map_err(|reason| {
        Failure::new(Diagnostic::error(codes::CANNOT_WRITE, reason).help("run with fewer output times"))
            .exit(exit::FILES)
    })?;
    let file = args.output.clone().unwrap_or_else(|| args.folder.join("motion.glb"));
    replace(&file, &bytes, false)?;
    terminal::print(&told(&motion, &file))?;
    Ok(exit::DONE)
}

/// What was written.
fn told(motion: &Motion, file: &Path) -> String {
    let (bodies, samples) = (motion.header.moving(), motion.times.len());
    let bodies = if bodies == 1 { "1 body".to_owned() } else { format!("{bodies} bodies") };
    format!("{}: {bodies} in motion, {samples} samples\n", shown(&file.display().to_string()))
}
