//! `odyn check` and `odyn plan`

use serde::Serialize;

use odyn::diagnostics::{Severity, render, shown, summary};
use odyn::session::{RunOptions, Session};

use super::exit;
use super::failure::{Failure, Message, messages};
use super::scene_args::{CheckArgs, SceneArgs};
use super::terminal::{self, Stream};

/// A report for programs.
#[derive(Serialize)]
struct ForPrograms<'a, T> {
    scene: String,
    warnings: Vec<Message<'a>>,
    report: T,
}

/// Mobility, redundant rows, reactions that are not unique, warnings.
pub(super) fn check(args: &CheckArgs) -> Result<u8, Failure> {
    let options = RunOptions { thoroughly: true, ..args.scene.options(None) };
    let session = Session::open(&args.scene.scene, &options)?;
    if args.strict {
        refuse_warnings(&session)?;
    }
    let report = session.check_report();
    if args.scene.json {
        print_json(&session, report)?;
        return Ok(exit::DONE);
    }
    // Here the warnings are what was asked for.
    let mut text = render(&session.warnings, &session.scene.source, terminal::color(Stream::Output));
    text.push_str(&shown(&report.to_string()));
    terminal::print_as_it_is(&with_newline(text))?;
    Ok(exit::DONE)
}

/// How a scene would be computed.
pub(super) fn plan(args: &SceneArgs) -> Result<u8, Failure> {
    let session = Session::open(&args.scene, &RunOptions { thoroughly: true, ..args.options(None) })?;
    let report = session.plan_report();
    if args.json {
        print_json(&session, report)?;
        return Ok(exit::DONE);
    }
    eprint!("{}", render(&session.warnings, &session.scene.source, terminal::color(Stream::Error)));
    terminal::print(&with_newline(format!("{report}")))?;
    Ok(exit::DONE)
}

/// What `--strict` does.
pub(super) fn refuse_warnings(session: &Session) -> Result<(), Failure> {
    let warnings: Vec<_> = session.warnings.iter().filter(|w| w.severity == Severity::Warning).cloned().collect();
    if warnings.is_empty() {
        return Ok(());
    }
    eprintln!("refused by --strict: {}", summary(&warnings));
    Err(Failure::of_source(exit::SCENE, warnings, &session.scene.source))
}

fn print_json<T: Serialize>(session: &Session, report: T) -> Result<(), Failure> {
    let source = &session.scene.source;
    let whole = ForPrograms { scene: source.name.clone(), warnings: messages(&session.warnings, source), report };
    Ok(terminal::print_as_it_is(&terminal::json(&whole))?)
}

fn with_newline(mut text: String) -> String {
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}
