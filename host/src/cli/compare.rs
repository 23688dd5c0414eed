//! `odyn compare`

use std::path::{Path, PathBuf};

use odyn::diagnostics::shown;
use odyn::results::{self, RESULTS_FILE};

use super::args::CompareArgs;
use super::exit;
use super::failure::Failure;
use super::terminal;

/// Compares two tables, or folders of results.
pub(super) fn compare(args: &CompareArgs) -> Result<u8, Failure> {
    let found = results::compare(&table_of(&args.a), &table_of(&args.b))?;
    if args.json {
        terminal::print_as_it_is(&found.to_json())?
    } else {
        terminal::print(&found.to_string())?
    };
    let Some(limit) = args.tol else {
        return Ok(exit::DONE);
    };
    let beyond: Vec<&str> = found.beyond(limit).map(|column| column.name.as_str()).collect();
    if !beyond.is_empty() {
        eprintln!("beyond {limit:e}: {}", shown(&beyond.join(", ")));
    }
    let missing = found.missing().filter(|_| !args.allow_missing);
    if let Some(missing) = &missing {
        eprintln!("A lacks of B: {}", shown(missing));
    }
    Ok(if beyond.is_empty() && missing.is_none() { exit::DONE } else { exit::AUDIT })
}

/// The table in a folder of results, or the path itself.
fn table_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(RESULTS_FILE) } else { path.to_path_buf() }
}
