//! The command line.
//!
//! - **Takes**: arguments, Ctrl-C.
//! - **Gives**: results on standard output, everything else on standard error, an exit code ([`exit`]).
//! - **May touch**: the terminal, and the library through its public interface.
//! - **Must not know**: anything the library doesn't offer to everyone.
//!
//! | file | content |
//! |---|---|
//! | `args.rs`, `scene_args.rs` | what can be written on the command line; behind the commands that run a scene |
//! | `deferred.rs` | arguments that are described only when their command is given |
//! | `run.rs` | `run` |
//! | `analyses.rs`, `analyses_args.rs` | `modes`, `linearise`, `statics` |
//! | `campbell.rs` | `modes --over` |
//! | `sensitivity.rs`, `fit.rs`, `fit_args.rs` | `sensitivity`, `fit` |
//! | `motions.rs`, `loads.rs`, `balance.rs`, `motion_args.rs` | `inverse`, `kinematics`; `loads`; `balance` |
//! | `inspect.rs` | `check`, `plan` |
//! | `watch.rs` | `run --watch` |
//! | `interrupt.rs` | Ctrl-C |
//! | `elements.rs` | `elements list`, `elements describe` |
//! | `store.rs`, `store_args.rs` | `plugin pack`, `add`, `remove`, `list`, `verify` |
//! | `plugin.rs`, `workshop_args.rs` | `plugin new`, `plugin check` |
//! | `bench.rs`, `compare.rs`, `explain.rs`, `stress.rs`, `study.rs`, `verify.rs` | the commands of these names |
//! | `report.rs` | `report`, `run --report` |
//! | `export.rs`, `export_args.rs` | `export glb`, `export c`, `export fmu` |
//! | `hil/`, `hil_args.rs` | `hil` |
//! | `import.rs` | `import` |
//! | `schema.rs` | `schema` |
//! | `studio.rs` | `studio` |
//! | `shell.rs` | `completions`, `man` |
//! | `choices.rs` | which libraries were passed over |
//! | `failure.rs` | why a command failed |
//! | `terminal.rs` | colours, messages, the progress bar |

/// Writes to standard error. Where nobody reads it any more (`2>&1 | head`), that is no failure of the command.
macro_rules! eprint {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = write!(std::io::stderr(), $($words)*);
    }};
}

/// The same with the end of a line.
macro_rules! eprintln {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($words)*);
    }};
}

mod analyses;
mod analyses_args;
mod args;
mod balance;
mod bench;
mod campbell;
mod choices;
mod compare;
mod deferred;
mod elements;
mod explain;
mod export;
mod export_args;
mod failure;
mod fit;
mod fit_args;
mod hil;
mod hil_args;
mod import;
mod inspect;
mod interrupt;
mod loads;
mod motion_args;
mod motions;
mod plugin;
mod report;
mod resume;
mod run;
mod scene_args;
mod schema;
mod sensitivity;
mod shell;
mod store;
mod store_args;
mod stress;
mod studio;
mod study;
mod study_args;
mod study_scripts;
mod terminal;
mod verify;
mod watch;
mod workshop_args;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command, ElementsCommand, PluginCommand};
use export_args::ExportCommand;
use failure::Failure;

/// Exit codes.
mod exit {
    use odyn::diagnostics::Exit;

    /// Done.
    pub(super) const DONE: u8 = Exit::Done as u8;
    /// The command line is wrong.
    pub(super) const USAGE: u8 = Exit::Usage as u8;
    /// A scene or model with mistakes.
    pub(super) const SCENE: u8 = Exit::Scene as u8;
    /// A plugin that can't be had.
    pub(super) const PLUGIN: u8 = Exit::Plugin as u8;
    /// The integration ended before its end.
    pub(super) const INTEGRATION: u8 = Exit::Integration as u8;
    /// The audit, a comparison or a verification found more than was allowed.
    pub(super) const AUDIT: u8 = Exit::Audit as u8;
    /// Files can't be read or written.
    pub(super) const FILES: u8 = Exit::Files as u8;
    /// Interrupted by the user, as shells count: 128 + the number of the signal.
    pub(super) const INTERRUPTED: u8 = Exit::Interrupted as u8;
}

/// Runs the command of the command line.
pub(crate) fn main() -> ExitCode {
    #[cfg(unix)]
    if let Some(recorded) = odyn::catalog::record_if_asked() {
        return recorded;
    }
    let arguments = Arguments::parse();
    #[cfg(unix)]
    let _guard = odyn::catalog::ExitGuard::begin();
    #[cfg(unix)]
    if !arguments.in_process {
        odyn::catalog::put_up_glass();
    }
    let json = arguments.command.wants_json();
    terminal::reserve_output();
    let code = match dispatch(&arguments.command) {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            failure.tell(json);
            ExitCode::from(failure.exit)
        }
    };
    #[cfg(unix)]
    odyn::catalog::farewell();
    code
}

/// Ends the program at once, from any thread.
fn end(code: u8) -> ! {
    #[cfg(unix)]
    odyn::catalog::ExitGuard::lift();
    std::process::exit(i32::from(code))
}

/// The exit code of a command that had something to say.
fn dispatch(command: &Command) -> Result<u8, Failure> {
    match command {
        Command::Run(args) => run::run(args),
        Command::Resume(args) => resume::resume(args),
        Command::Study(args) => study::study(args),
        Command::Statics(args) => analyses::statics(args),
        Command::Modes(args) => analyses::modes(args),
        Command::Linearise(args) => analyses::linearise(args),
        Command::Sensitivity(args) => sensitivity::sensitivity(args),
        Command::Fit(args) => fit::fit(args),
        Command::Inverse(args) => motions::inverse(args),
        Command::Kinematics(args) => motions::kinematics(args),
        Command::Loads(args) => loads::loads(args),
        Command::Balance(args) => balance::balance(args),
        Command::Check(args) => inspect::check(args),
        Command::Plan(args) => inspect::plan(args),
        Command::Elements { command: ElementsCommand::List(args) } => elements::list(args),
        Command::Elements { command: ElementsCommand::Describe(args) } => elements::describe(args),
        Command::Elements { command: ElementsCommand::Named(words) } => elements::by_name(words),
        Command::Plugin { command: PluginCommand::Pack(args) } => store::pack(args),
        Command::Plugin { command: PluginCommand::Add(args) } => store::add(args),
        Command::Plugin { command: PluginCommand::Remove(args) } => store::remove(args),
        Command::Plugin { command: PluginCommand::List(args) } => store::list(args),
        Command::Plugin { command: PluginCommand::Verify(args) } => store::verify(args),
        Command::Plugin { command: PluginCommand::New(args) } => plugin::new(args),
        Command::Plugin { command: PluginCommand::Check(args) } => plugin::check(args),
        Command::Report(args) => report::report(args),
        Command::Studio(args) => studio::studio(args),
        Command::Compare(args) => compare::compare(args),
        Command::Export { command: ExportCommand::Glb(args) } => export::export_glb(args),
        Command::Export { command: ExportCommand::C(args) } => export::export_c(args),
        Command::Export { command: ExportCommand::Fmu(args) } => export::export_fmu(args),
        Command::Hil(args) => hil::hil(args),
        Command::Import(args) => import::import(args),
        Command::Verify(args) => verify::verify(args),
        Command::Stress(args) => stress::stress(args),
        Command::Bench(args) => bench::bench(args),
        Command::Explain(args) => explain::explain(args),
        Command::Schema(args) => schema::schema(args),
        Command::Completions(args) => shell::completions(args),
        Command::Man(args) => shell::man(args),
    }
}

impl Command {
    /// Whether standard output is for a program.
    pub(super) fn wants_json(&self) -> bool {
        match self {
            Command::Run(args) => args.scene.json,
            Command::Resume(args) => args.json,
            Command::Study(args) => args.json(),
            Command::Statics(args) => args.scene.json,
            Command::Modes(args) => args.place.scene.json,
            Command::Linearise(args) => args.place.scene.json,
            Command::Inverse(args) => args.scene.json,
            Command::Kinematics(args) => args.scene.json,
            Command::Loads(args) => args.scene.json,
            Command::Balance(args) => args.scene.json,
            Command::Sensitivity(args) => args.scene.json,
            Command::Fit(args) => args.scene.json,
            Command::Check(args) => args.scene.json,
            Command::Plan(args) => args.json,
            Command::Elements { command: ElementsCommand::List(args) } => args.json,
            Command::Elements { command: ElementsCommand::Describe(args) } => args.places.json,
            Command::Plugin { command: PluginCommand::List(args) } => args.places.json,
            Command::Plugin { command: PluginCommand::Check(args) } => args.json,
            Command::Hil(args) => args.json || args.describe,
            Command::Compare(args) => args.json,
            Command::Export { command: ExportCommand::C(args) } => args.machine.json,
            Command::Export { command: ExportCommand::Fmu(args) } => args.machine.json,
            _ => false,
        }
    }
}
