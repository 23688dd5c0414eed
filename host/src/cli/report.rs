//! `odyn report`, and the report at the end of `odyn run`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::exit;
use super::failure::Failure;
use super::terminal;

/// The file of a report, unless another is named.
const REPORT_FILE: &str = "report.html";

#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// Folders of results; the first is what the others are compared with
    #[arg(value_name = "DIR", required = true)]
    pub(super) folders: Vec<PathBuf>,
    /// File to write; report.html in the first folder if not given
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
}

/// Writes the report of runs.
pub(super) fn report(args: &ReportArgs) -> Result<u8, Failure> {
    let first = &args.folders[0];
    let folder = if first.is_file() { first.parent().unwrap_or(first) } else { first.as_path() };
    let output = args.output.clone().unwrap_or_else(|| folder.join(REPORT_FILE));
    odyn::desk::write(&args.folders, &output)?;
    terminal::print(&format!("report: {}\n", output.display()))?;
    Ok(exit::DONE)
}

/// Writes the report of a run into its folder; gives the file.
pub(super) fn of_run(folder: &Path) -> Result<PathBuf, Failure> {
    let output = folder.join(REPORT_FILE);
    odyn::desk::write(&[folder.to_path_buf()], &output)?;
    Ok(output)
}
