//! `odyn stress`

use std::sync::atomic::{AtomicUsize, Ordering};

use odyn::diagnostics::{Diagnostic, codes};
use odyn::manual::{STRESS_FILE, StressPage};
use odyn::results::significant;
use odyn::stress::{Outcome, Settings, Suite, run};

use super::args::StressArgs;
use super::choices;
use super::exit;
use super::failure::Failure;
use super::interrupt::stop_on_interrupt;
use super::terminal;

/// Columns of the table.
const COLUMNS: usize = 8;

/// Runs the trials, judges them, writes the page.
pub(super) fn stress(args: &StressArgs) -> Result<u8, Failure> {
    let suite = Suite::read(&args.suite)?;
    let settings = Settings {
        plugins: args.plugins.clone(),
        full: args.full,
        jobs: args.jobs.map_or(0, usize::from),
        ..Settings::default()
    };
    let ended = AtomicUsize::new(0);
    let told = |outcome: &Outcome| {
        let number = ended.fetch_add(1, Ordering::Relaxed) + 1;
        let (verdict, seconds) = (verdict(outcome), significant(outcome.seconds, 2));
        eprintln!("{number} {} ({}): {verdict}, {seconds} s", outcome.trial, outcome.formulation);
    };
    choices::tell(suite.trials.iter().map(|trial| trial.scene.as_path()), &[], &args.plugins);
    let stop = stop_on_interrupt();
    let outcomes = run(&suite, &args.names, &settings, &told, &stop);
    let outcomes = outcomes.map_err(|diagnostic| Failure::new(*diagnostic).exit(exit::USAGE))?;
    terminal::print(&report(&outcomes))?;
    let page = StressPage { outcomes: &outcomes, full: args.full };
    page.write(&args.output).map_err(|cause| {
        let message = format!("cannot write the page to `{}`: {cause}", args.output.display());
        let diagnostic = Diagnostic::error(codes::CANNOT_WRITE, message);
        Failure::new(diagnostic.help("choose another folder with `-o DIR`"))
    })?;
    terminal::print(&format!("page: {}\n", args.output.join(STRESS_FILE).display()))?;
    if stop.load(Ordering::Relaxed) {
        return Ok(exit::INTERRUPTED);
    }
    Ok(if outcomes.iter().all(Outcome::passed) { exit::DONE } else { exit::AUDIT })
}

/// A line per run, by families, then what failed and why.
fn report(outcomes: &[Outcome]) -> String {
    let titles = ["trial", "coordinates", "nearest to its bound", "found", "bound", "steps", "evaluations", ""];
    let mut rows = vec![titles.map(String::from)];
    rows.extend(outcomes.iter().map(row));
    let lines = aligned(&rows);
    let mut text = format!("{}\n", lines[0]);
    let mut family = "";
    for (outcome, line) in outcomes.iter().zip(&lines[1..]) {
        if outcome.family != family {
            family = &outcome.family;
            text.push_str(&format!("{family}\n"));
        }
        text.push_str(&format!("{line}\n"));
    }
    outcomes.iter().for_each(|outcome| text.push_str(&failures(outcome)));
    let failed = outcomes.iter().filter(|outcome| !outcome.passed()).count();
    let plural = if outcomes.len() == 1 { "" } else { "s" };
    let verdict = if failed == 0 { "all ok".into() } else { format!("{failed} FAILED") };
    text.push_str(&format!("{} run{plural}, {verdict}\n", outcomes.len()));
    text
}

fn verdict(outcome: &Outcome) -> &'static str {
    if outcome.passed() { "ok" } else { "FAILED" }
}

fn row(outcome: &Outcome) -> [String; COLUMNS] {
    let worst = outcome.worst();
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 2));
    let count = |count: u64| if outcome.work.evaluations == 0 { String::new() } else { count.to_string() };
    [
        format!("  {}", outcome.trial),
        outcome.formulation.clone(),
        worst.map_or(&outcome.expected, |measure| &measure.what).clone(),
        number(worst.map(|measure| measure.found)),
        number(worst.map(|measure| measure.bound)),
        count(outcome.work.steps),
        count(outcome.work.evaluations),
        verdict(outcome).into(),
    ]
}

/// Why a run failed; nothing if it passed.
fn failures(outcome: &Outcome) -> String {
    let name = format!("{} ({})", outcome.trial, outcome.formulation);
    let mut text = String::new();
    for fault in &outcome.faults {
        text.push_str(&format!("{name}: {fault}\n"));
    }
    for measure in outcome.measures.iter().filter(|measure| !measure.passed()) {
        let (found, bound) = (significant(measure.found, 3), measure.bound);
        text.push_str(&format!("{name}: `{}` is {found}, allowed {bound:e}\n", measure.what));
    }
    text
}

/// Columns under each other: words to the left, numbers to the right.
fn aligned(rows: &[[String; COLUMNS]]) -> Vec<String> {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; COLUMNS] = std::array::from_fn(width);
    let line = |row: &[String; COLUMNS]| {
        let mut line = String::new();
        for (column, (cell, w)) in row.iter().zip(&widths).enumerate() {
            match column {
                0 => line.push_str(&format!("{cell:w$}")),
                1 | 2 | 7 => line.push_str(&format!("  {cell:w$}")),
                _ => line.push_str(&format!("  {cell:>w$}")),
            }
        }
        line.trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}
