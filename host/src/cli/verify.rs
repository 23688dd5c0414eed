//! `odyn verify`

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use odyn::diagnostics::{Diagnostic, codes};
use odyn::manual::{INDEX_FILE, Manual};
use odyn::results::significant;
use odyn::verification::{BALANCE_BOUND, Case, Coverage, Settings, Verifier, scenes_in};

use super::args::VerifyArgs;
use super::choices;
use super::exit;
use super::failure::Failure;
use super::terminal;

/// Runs all scenes, judges them, writes the manual.
pub(super) fn verify(args: &VerifyArgs) -> Result<u8, Failure> {
    let (scenes, whole_folder) = scenes("verify", &args.scenes)?;
    let settings = Settings { plugins: args.plugins.clone(), ladder: !args.quick, ..Settings::default() };
    choices::tell(scenes.iter().map(PathBuf::as_path), &[], &args.plugins);
    let mut verifier = Verifier::new(settings);
    let ended = AtomicUsize::new(0);
    let told = |case: &Case| {
        let verdict = if case.passed() { "ok" } else { "FAILED" };
        let number = ended.fetch_add(1, Ordering::Relaxed) + 1;
        eprintln!("{number}/{} {}: {verdict}", scenes.len(), case.name);
    };
    let cases = verifier.verify_all(&scenes, args.jobs.map_or(0, usize::from), &told);
    let mut coverage = Coverage::of(&cases, verifier.elements());
    if !whole_folder {
        // What single scenes leave out is no gap.
        coverage.gaps.clear();
    }
    terminal::print(&report(&cases, &coverage, whole_folder))?;
    let manual = Manual { cases: &cases, elements: verifier.elements(), coverage: &coverage };
    manual.write(&args.output).map_err(|cause| {
        let message = format!("cannot write the manual to `{}`: {cause}", args.output.display());
        Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message).help("choose another folder with `-o DIR`"))
    })?;
    terminal::print(&format!("manual: {}\n", args.output.join(INDEX_FILE).display()))?;
    let failed = cases.iter().any(|case| !case.passed());
    Ok(if failed || (!coverage.gaps.is_empty() && !args.allow_gaps) { exit::AUDIT } else { exit::DONE })
}

/// The scenes that are meant, and whether a folder is among them; `purpose` is what is to be done with them.
pub(super) fn scenes(purpose: &str, paths: &[PathBuf]) -> Result<(Vec<PathBuf>, bool), Failure> {
    let mut found: Vec<PathBuf> = Vec::new();
    for path in paths {
        let these = match path.is_dir() {
            true => scenes_in(path),
            false => std::fs::metadata(path).map(|_| vec![path.clone()]),
        };
        let these = these.map_err(|cause| unreadable(purpose, path, &cause.to_string()))?;
        if these.is_empty() {
            return Err(unreadable(purpose, path, "there is no scene in it"));
        }
        found.extend(these.into_iter().filter(|scene| !found.contains(scene)).collect::<Vec<_>>());
    }
    Ok((found, paths.iter().any(|path| path.is_dir())))
}

fn unreadable(purpose: &str, path: &Path, why: &str) -> Failure {
    let message = format!("cannot {purpose} `{}`: {why}", path.display());
    let diagnostic = Diagnostic::error(codes::UNREADABLE, message);
    Failure::new(diagnostic.help("name scene files with [[check]], or a folder of such"))
}

/// A line per scene, then what failed and why, then what is covered.
fn report(cases: &[Case], coverage: &Coverage, whole_folder: bool) -> String {
    let titles = ["scene", "checks", "error/tolerance", "balance", "steps", "evaluations", ""];
    let mut rows = vec![titles.map(String::from)];
    rows.extend(cases.iter().map(row));
    let mut text = aligned(&rows);
    for case in cases {
        text.push_str(&failures(case));
    }
    let failed = cases.iter().filter(|case| !case.passed()).count();
    let plural = if cases.len() == 1 { "" } else { "s" };
    let verdict = if failed == 0 { "all ok".into() } else { format!("{failed} FAILED") };
    text.push_str(&format!("{} scene{plural}, {verdict}\n", cases.len()));
    if whole_folder && !coverage.libraries.is_empty() {
        let (verified, gaps) = (coverage.verified.len(), &coverage.gaps);
        let libraries = coverage.libraries.join(", ");
        text.push_str(&format!("coverage: {verified} of {} elements of {libraries}\n", verified + gaps.len()));
        if !gaps.is_empty() {
            text.push_str(&format!("no scene verifies {}\n", gaps.join(", ")));
        }
    }
    text
}

fn row(case: &Case) -> [String; 7] {
    let verdict = if case.passed() { "ok" } else { "FAILED" };
    let Ok(measured) = &case.outcome else {
        return [case.name.as_str(), "", "", "", "", "", verdict].map(String::from);
    };
    let balance = measured.balance.as_ref().map(|balance| significant(balance.share, 2));
    [
        case.name.clone(),
        measured.checks.len().to_string(),
        significant(measured.worst(), 2),
        balance.unwrap_or_default(),
        measured.work.steps.to_string(),
        measured.work.evaluations.to_string(),
        verdict.into(),
    ]
}

/// Why a case failed; nothing if it passed.
fn failures(case: &Case) -> String {
    let measured = match &case.outcome {
        Ok(measured) => measured,
        Err(reason) => return format!("\n{}: {}\n", case.name, reason.trim_end()),
    };
    let mut text = String::new();
    for check in measured.checks.iter().filter(|check| !check.passed) {
        let why = check.problem.clone().unwrap_or_else(|| {
            let (largest, at, tolerance) = (significant(check.largest, 3), significant(check.at, 6), check.tolerance);
            let (unit, time) = (&check.unit, &measured.time_unit);
            format!("off by {largest} {unit} at t = {at} {time}, allowed {tolerance:e}")
        });
        text.push_str(&format!("{}: `{}`: {why}\n", case.name, check.name));
    }
    if let Some(balance) = measured.balance.as_ref().filter(|balance| !balance.passed()) {
        let what = if balance.torque { "torques" } else { "forces" };
        let (share, at) = (significant(balance.share, 3), significant(balance.at, 6));
        text.push_str(&format!(
            "{}: {what} reported on `{}` do not balance at t = {at} {}: {share} of the largest is left, allowed {BALANCE_BOUND:e}\n",
            case.name, balance.body, measured.time_unit
        ));
    }
    text
}

/// Columns under each other: words to the left, numbers to the right.
fn aligned(rows: &[[String; 7]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 7] = std::array::from_fn(width);
    let mut text = String::new();
    for row in rows {
        let mut line = format!("{:w$}", row[0], w = widths[0]);
        for (cell, w) in row[1..6].iter().zip(&widths[1..6]) {
            line.push_str(&format!("  {cell:>w$}"));
        }
        line.push_str(&format!("  {}", row[6]));
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
