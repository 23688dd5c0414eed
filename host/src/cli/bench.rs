//! `odyn bench`

use std::path::Path;
use std::time::Duration;

use odyn::bench::{LEVELS, Machine, Point, Report, Runner, Setting, Settings, read, write};
use odyn::diagnostics::{Diagnostic, codes, suggest};
use odyn::integrate;
use odyn::results::significant;
use odyn::session::DEFAULT_METHOD;

use super::args::BenchArgs;
use super::choices;
use super::exit;
use super::failure::Failure;
use super::terminal;
use super::verify::scenes;

const TABLE_FILE: &str = "bench.csv";
const PAGE_FILE: &str = "index.html";

/// Runs all scenes with all methods and tolerances, prints the numbers, writes table, page and drawings.
pub(super) fn bench(args: &BenchArgs) -> Result<u8, Failure> {
    let (scenes, _) = scenes("bench", &args.scenes)?;
    let mut report = Report { machine: Machine::this(), date: args.date.clone(), ..Report::default() };
    for peer in &args.peers {
        report.peers.extend(read(peer).map_err(|message| {
            let diagnostic = Diagnostic::error(codes::UNREADABLE, format!("cannot read the measurements in {message}"));
            Failure::new(diagnostic)
        })?);
    }
    let runner = Runner::new(settings(args)?);
    choices::tell(scenes.iter().map(|scene| scene.as_path()), &[], &args.plugins);
    terminal::print(&format!("{}\n{}\n", report.machine.line(), line(&HEAD.map(String::from))))?;
    for scene in &scenes {
        let mut result = Ok(());
        let told = |point: &Point| {
            if result.is_ok() {
                result = terminal::print(&(line(&cells(point)) + "\n"));
            }
        };
        let problem = runner.measure(scene, told);
        result?;
        report.problems.push(problem);
    }
    terminal::print(&summary(&report))?;
    write_file(&args.output, TABLE_FILE, &write(&report))?;
    write_file(&args.output, PAGE_FILE, &report.page())?;
    for problem in &report.problems {
        if let Some(drawing) = report.drawing(problem) {
            write_file(&args.output, &format!("{}.svg", problem.name), &drawing)?;
        }
    }
    terminal::print(&format!("page: {}\n", args.output.join(PAGE_FILE).display()))?;
    Ok(if report.problems.iter().all(|problem| problem.solved()) { exit::DONE } else { exit::AUDIT })
}

fn settings(args: &BenchArgs) -> Result<Settings, Failure> {
    if let Some(unknown) = args.methods.iter().find(|name| integrate::by_name(name).is_none()) {
        let nearest = suggest(unknown, integrate::names());
        let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("there is no method `{unknown}`"))
            .help_if(nearest.map(|nearest| format!("did you mean `{nearest}`?")))
            .help(format!("known are {}", integrate::names().join(", ")));
        return Err(Failure::new(diagnostic));
    }
    let mut settings = Settings {
        repeats: args.repeats as usize,
        limit: Duration::try_from_secs_f64(args.limit).unwrap_or(Duration::MAX / 4),
        plugins: args.plugins.clone(),
        program: std::env::current_exe().ok(),
        t_end: args.t_end.clone(),
        references: Some(args.output.clone()),
        ..Settings::default()
    };
    if args.quick {
        settings.methods = vec![DEFAULT_METHOD.into()];
        settings.tolerances = vec![1e-6, 1e-9];
        settings.repeats = 1;
        settings.program = None;
    }
    if !args.methods.is_empty() {
        settings.methods.clone_from(&args.methods);
    }
    if !args.tols.is_empty() {
        settings.tolerances.clone_from(&args.tols);
        settings.tolerances.sort_by(|a, b| b.total_cmp(a));
    }
    Ok(settings)
}

/// Best times at some errors, and other programs beside ours.
fn summary(report: &Report) -> String {
    let mut text = format!("\n{:<24} {:<20}", "best ms at an error of", "");
    for level in LEVELS {
        text.push_str(&format!(" {level:>9e}"));
    }
    text.push('\n');
    for problem in &report.problems {
        for best in report.best(problem) {
            let mut line = format!("{:<24} {:<20}", problem.name, format!("{} {}", best.solver, best.method));
            for time in best.times {
                line.push_str(&format!(" {:>9}", time.map_or_else(|| "-".into(), |time| significant(1e3 * time, 3))));
            }
            text.push_str(&(line + "\n"));
        }
    }
    for problem in report.problems.iter().filter(|problem| !problem.reference.is_empty()) {
        text.push_str(&format!("{}: {}\n", problem.name, problem.reference));
    }
    for ratio in report.ratios() {
        let (solver, mean) = (&ratio.solver, significant(ratio.mean, 3));
        let (compared, ours, theirs) = (ratio.compared, ratio.only_ours, ratio.only_theirs);
        let least = ratio.least.map_or_else(String::new, |(least, problem, level)| {
            format!(", least {} ({problem}, {level:e})", significant(least, 3))
        });
        text.push_str(&format!(
            "{solver}: its time / ours {mean} (geometric mean of {compared}{least}); reached by us alone {ours}, by it alone \
             {theirs}\n"
        ));
    }
    text
}

const HEAD: [&str; 10] = [
    "problem",
    "method",
    "tolerance",
    "error",
    "energy",
    "evaluations",
    "load ms",
    "compile ms",
    "machine ms",
    "integrate ms",
];

fn cells(point: &Point) -> [String; 10] {
    let setting = match point.setting {
        Setting::Tolerance(tolerance) => significant(tolerance, 3),
        Setting::Step(step) => format!("h={}", significant(step, 2)),
    };
    let (problem, method) = (point.problem.clone(), point.method.clone());
    match &point.outcome {
        Ok(measured) => {
            let milliseconds = |time: f64| significant(1e3 * time, 3);
            [
                problem,
                method,
                setting,
                significant(measured.error, 3),
                significant(measured.energy_error, 2),
                measured.work.evaluations.map_or_else(String::new, |count| count.to_string()),
                milliseconds(measured.times.load),
                milliseconds(measured.times.compile),
                milliseconds(measured.times.machine_code),
                milliseconds(measured.times.integrate),
            ]
        }
        Err(reason) => {
            let mut cells: [String; 10] = Default::default();
            let line = reason.lines().next().unwrap_or_default();
            (cells[0], cells[1], cells[2], cells[3]) = (problem, method, setting, format!("FAILED: {line}"));
            cells
        }
    }
}

/// Columns under each other as they come: widths are fixed.
fn line(cells: &[String; 10]) -> String {
    let mut text = format!("{:<24} {:<10}", cells[0], cells[1]);
    for (cell, width) in cells[2..].iter().zip([10, 10, 10, 12, 10, 11, 11, 13]) {
        text.push_str(&format!(" {cell:>width$}"));
    }
    text.trim_end().to_string()
}

fn write_file(folder: &Path, name: &str, text: &str) -> Result<(), Failure> {
    let path = folder.join(name);
    std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, text)).map_err(|cause| {
        let message = format!("cannot write `{}`: {cause}", path.display());
        Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message).help("choose another folder with `-o DIR`"))
    })
}
