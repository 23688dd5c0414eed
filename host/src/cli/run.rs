//! `odyn run`

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use odyn::diagnostics::{Diagnostic, codes, render, shown};
use odyn::results::{DIGITS_FILE, SUMMARY_FILE, Status, report};
use odyn::session::{Afterwards, Checkpoint, Restart, RunOptions, RunReport, Session};

use super::exit;
use super::failure::Failure;
use super::inspect::refuse_warnings;
use super::interrupt::stop_on_interrupt;
use super::scene_args::RunArgs;
use super::terminal::{self, Preparing, Progress, Stream, word_of};
use super::watch;

/// Integrates a scene and writes its results; again and again with `--watch`.
pub(super) fn run(args: &RunArgs) -> Result<u8, Failure> {
    let stop = stop_on_interrupt();
    // What is said of the plan, and further runs to compare with, look at all of the equations.
    let runs_only = !(args.verbose || args.verify || args.digits);
    let thoroughly = args.verbose || args.strict;
    let options = RunOptions { jobs: args.jobs.map_or(0, usize::from), runs_only, thoroughly, ..args.options() };
    if args.watch { watch::watch(args, &options, &stop) } else { once(args, &options, &stop) }
}

/// One run.
pub(super) fn once(args: &RunArgs, options: &RunOptions, stop: &Arc<AtomicBool>) -> Result<u8, Failure> {
    let told = Told { json: args.scene.json, quiet: args.quiet };
    let preparing = told.preparing("opening the scene");
    let mut session = Session::open(&args.scene.scene, options)?;
    drop(preparing);
    let folder = args.output.clone().unwrap_or_else(|| args.scene.default_output());
    if let Some(from) = &args.from {
        if same_folder(from, &folder) {
            let message = "the results would replace those that the run continues from";
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message).help("name another folder with -o");
            return Err(Failure::new(diagnostic).exit(exit::USAGE));
        }
        session.go_on_from(Restart::read(from).map_err(|diagnostic| Failure::new(*diagnostic).exit(exit::FILES))?)?;
    }
    if args.strict {
        refuse_warnings(&session)?;
    }
    warn(&session, &told);
    if args.verbose {
        eprintln!("{}", shown(&session.plan_report().to_string()));
    }
    complete(session, args.afterwards(), &folder, &told, stop)
}

/// Runs a session into a folder, does with the run what is asked for, and tells how it went; its exit code.
pub(super) fn complete(
    session: Session,
    afterwards: Afterwards,
    folder: &Path,
    told: &Told,
    stop: &Arc<AtomicBool>,
) -> Result<u8, Failure> {
    let sharper = if afterwards.verify { Some(session.sharper()?) } else { None };
    let second = if afterwards.digits { Some(session.second()?) } else { None };
    let mut outcome = integrate(session, folder, told, stop)?;
    let ended = outcome.summary.status.reached_end();
    if let Some((session, how)) = sharper.filter(|_| ended) {
        let progress = Progress::new();
        let second = session.run(None, told.listener(&progress), stop);
        drop(progress);
        outcome.verify(&how, second.as_ref());
        outcome.summary.write(&folder.join(SUMMARY_FILE))?;
    }
    if let Some(second) = second.filter(|_| ended) {
        second.judge(&mut outcome, stop);
        if let Some(digits) = &outcome.summary.digits {
            digits.write(&folder.join(DIGITS_FILE))?;
        }
        outcome.summary.write(&folder.join(SUMMARY_FILE))?;
    }
    let mut code = told.end(&outcome, folder)?;
    let interrupted = stop.load(Ordering::Relaxed);
    if outcome.summary.digits.is_some() && interrupted {
        // The run has ended, but not what was asked of it.
        code = exit::INTERRUPTED;
    }
    if afterwards.report {
        let file = super::report::of_run(folder)?;
        told.note(&format!("report: {}\n", file.display()))?;
    } else {
        told.note(&format!("to see it: odyn report {}\n", word_of(folder)))?;
    }
    if ended && !interrupted {
        Checkpoint::done(folder)?;
    }
    Ok(code)
}

/// What the user wants to have reported.
pub(super) struct Told {
    pub(super) json: bool,
    pub(super) quiet: bool,
}

impl Told {
    /// What is shown while a run is made ready and while it lasts.
    fn listener(&self, progress: &Progress) -> Box<dyn FnMut(f64) + Send> {
        if self.quiet || self.json {
            return Box::new(|_| ());
        }
        let (mut listener, mut preparing) = (progress.listener(), self.preparing("writing the equations of motion"));
        Box::new(move |share| {
            drop(preparing.take());
            listener(share);
        })
    }

    /// What is shown while something is prepared, until it is dropped.
    fn preparing(&self, what: &'static str) -> Option<Preparing> {
        (!self.quiet && !self.json).then(|| Preparing::new(what))
    }

    /// A last line for people.
    fn note(&self, text: &str) -> Result<(), Failure> {
        if self.quiet || self.json { Ok(()) } else { Ok(terminal::print(text)?) }
    }

    /// Tells how a run went, and gives its exit code.
    fn end(&self, outcome: &RunReport, folder: &Path) -> Result<u8, Failure> {
        let summary = &outcome.summary;
        if self.json {
            terminal::print_as_it_is(&summary.to_json())?;
        } else if !self.quiet {
            terminal::print_as_it_is(&report(summary, Some(folder), terminal::color(Stream::Output)))?;
        } else if summary.status != Status::Completed {
            // Errors are reported even to those who want to hear nothing else.
            eprintln!("error: {}: {}", summary.status.words(), shown(&summary.reason));
        } else if !summary.checks_passed() {
            let failed = summary.checks.iter().filter(|check| !check.passed).map(|check| check.name.as_str());
            eprintln!("error: failed checks: {}", failed.collect::<Vec<_>>().join(", "));
        }
        Ok(u8::try_from(outcome.exit_code()).unwrap_or(exit::INTEGRATION))
    }
}

/// Prints the warnings of a scene.
pub(super) fn warn(session: &Session, told: &Told) {
    if !told.quiet {
        let color = terminal::color(Stream::Error);
        eprint!("{}", render(&session.warnings, &session.scene.source, color));
    }
}

/// A run into a folder, with its progress.
fn integrate(session: Session, folder: &Path, told: &Told, stop: &Arc<AtomicBool>) -> Result<RunReport, Failure> {
    let progress = Progress::new();
    let result = session.run(Some(folder), told.listener(&progress), stop);
    drop(progress);
    Ok(result?)
}

fn same_folder(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}
