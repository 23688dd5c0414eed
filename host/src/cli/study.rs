//! `odyn study`

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use odyn::diagnostics::{Diagnostic, codes, shown};
use odyn::study::{Design, Outcome, Points, Run, Series, Span, Study, StudyOptions, Taken, Vary, merge};

use super::choices;
use super::exit;
use super::failure::Failure;
use super::interrupt::stop_on_interrupt;
use super::study_args::{MergeArgs, StudyArgs, StudyCommand};
use super::study_scripts::emit;
use super::terminal;

/// Runs a study or a part of it, writes a script that does, or makes one table of parts.
pub(super) fn study(args: &StudyCommand) -> Result<u8, Failure> {
    match args {
        StudyCommand::Points(args) => run_points(args),
        StudyCommand::Merge(args) => merge_parts(args),
    }
}

/// The points that are asked for.
fn points(args: &StudyArgs) -> Result<Points, Diagnostic> {
    let design = match (args.lhs, args.sobol) {
        (Some(count), _) => Some(Design::LatinHypercube { count, seed: args.seed.unwrap_or(1) }),
        (None, Some(count)) => Some(Design::Sobol { count, seed: args.seed }),
        (None, None) => None,
    };
    match (&args.csv, design) {
        (Some(file), _) => Points::read(file),
        (None, Some(design)) => {
            let spans: Result<Vec<Span>, _> = args.vary.iter().map(|text| Span::parse(text)).collect();
            Points::designed(&spans?, design)
        }
        (None, None) if args.seed.is_some() => {
            let message = "`--seed` belongs to `--lhs` or `--sobol`";
            Err(Diagnostic::error(codes::BAD_OVERRIDE, message)
                .help("combinations of values are what they are: leave it out"))
        }
        (None, None) => {
            let varied: Result<Vec<Vary>, _> = args.vary.iter().map(|text| Vary::parse(text)).collect();
            Points::grid(varied?)
        }
    }
}

/// What does not fit in the options is a matter of usage; all else ends as its message does.
fn refused(diagnostic: Diagnostic) -> Failure {
    let of_options = [codes::BAD_OVERRIDE, codes::BAD_SERIES, codes::CANNOT_GO_ON].contains(&diagnostic.code);
    let failure = Failure::new(diagnostic);
    if of_options { failure.exit(exit::USAGE) } else { failure }
}

/// The outputs that are kept over time.
fn series(args: &StudyArgs) -> Result<Option<Series>, Diagnostic> {
    if args.series.is_empty() {
        return Ok(None);
    }
    let take = args.samples.map_or(Taken::Every(args.every.unwrap_or(1)), Taken::Spread);
    Series::parse(&args.series, take).map(Some)
}

/// Runs a scene with all points, or those of a shard, and writes the table, or the part.
fn run_points(args: &StudyArgs) -> Result<u8, Failure> {
    let points = points(args).map_err(refused)?;
    let series = series(args).map_err(refused)?;
    let folder = args.output.clone().unwrap_or_else(|| default_output(&args.scene.scene));
    if let Some(scheduler) = args.emit {
        return emit(args, scheduler, &folder, points.len());
    }
    let silent = args.quiet || args.scene.json;
    let options = StudyOptions {
        common: args.scene.options(args.audit_tol),
        points,
        shard: args.shard,
        jobs: args.jobs.map_or(0, usize::from),
        folder: args.results.then(|| folder.clone()),
        journal: Some(folder.clone()),
        series,
        resume: args.resume,
        retry_failed: args.retry_failed,
    };
    let refused = |diagnostic: Box<Diagnostic>| refused(*diagnostic);
    if let (Some(shard), true) = (args.shard, args.resume)
        && let Some(path) = shard.finished(&args.scene.scene, &options, &folder).map_err(refused)?
    {
        if !args.quiet {
            terminal::print(&format!("part: {} (finished before)\n", path.display()))?;
        }
        return Ok(exit::DONE);
    }
    let points = &options.points;
    let count = args.shard.map_or(points.len(), |shard| shard.range(points.len()).len());
    if !args.quiet {
        choices::tell([args.scene.scene.as_path()], &options.common.overrides, &args.scene.plugins);
    }
    let ended = AtomicUsize::new(0);
    let told = |number: usize, run: &Run| {
        if matches!(run.outcome, Outcome::NotBegun) {
            return;
        }
        let ended = ended.fetch_add(1, Ordering::Relaxed) + 1;
        if !silent {
            eprintln!("{ended}/{count} {}: {}", shown(&values(points, number)), shown(&verdict(run)));
        }
    };
    let mut study = Study::run(&args.scene.scene, &options, &told, &stop_on_interrupt()).map_err(refused)?;
    if args.shard.is_none() {
        study = study.any_results()?;
    }
    if study.kept() > 0 && !silent {
        eprintln!("{} of {count} runs were finished before", study.kept());
    }
    let not_begun = study.runs.iter().filter(|run| matches!(run.outcome, Outcome::NotBegun)).count();
    if not_begun > 0 {
        eprintln!("{not_begun} of {count} runs were not begun");
    }
    let table = study.table();
    let path = study.write(&folder)?;
    if args.scene.json {
        terminal::print_as_it_is(&terminal::json(&table))?;
    } else if !args.quiet {
        let (kind, shown) = if args.shard.is_some() { ("part", String::new()) } else { ("table", table.overview()) };
        if let Some(path) = &path {
            terminal::print(&format!("{shown}{kind}: {}\n", path.display()))?;
            print_series(study.series_file(&folder))?;
        }
    }
    if silent {
        // Errors are reported even to those who want to hear nothing else.
        let fine = |outcome: &Outcome| match outcome {
            Outcome::Ran(finished) => finished.exit_code == 0,
            Outcome::Kept(_) | Outcome::NotBegun => true,
            Outcome::Failed(_) => false,
        };
        for (k, run) in study.runs.iter().enumerate().filter(|(_, run)| !fine(&run.outcome)) {
            eprintln!("error: {}: {}", shown(&values(points, study.first + k)), shown(&verdict(run)));
        }
    }
    if args.shard.is_some() && path.is_some() {
        return Ok(exit::DONE);
    }
    Ok(u8::try_from(study.exit_code()).unwrap_or(exit::INTEGRATION))
}

/// Makes one table of the parts in a folder.
fn merge_parts(args: &MergeArgs) -> Result<u8, Failure> {
    let merged = merge(&args.folder).map_err(|diagnostic| refused(*diagnostic))?;
    if args.json {
        terminal::print_as_it_is(&terminal::json(&merged.table))?;
    } else if !args.quiet {
        let (rows, parts) = (merged.table.rows.len(), merged.parts);
        terminal::print(&format!("table: {} ({rows} runs of {parts} parts)\n", merged.path.display()))?;
        print_series(merged.series)?;
    }
    Ok(u8::try_from(merged.exit_code).unwrap_or(exit::INTEGRATION))
}

fn print_series(file: Option<PathBuf>) -> Result<(), Failure> {
    if let Some(file) = file {
        terminal::print(&format!("series: {}\n", file.display()))?;
    }
    Ok(())
}

/// `results/compressor-study` for `scenes/compressor.toml`.
fn default_output(scene: &Path) -> PathBuf {
    let stem = scene.file_stem().unwrap_or(scene.as_os_str()).to_string_lossy();
    Path::new("results").join(format!("{stem}-study"))
}

fn values(points: &Points, number: usize) -> String {
    let changes: Vec<String> = points.changes(number).map(|change| change.text).collect();
    changes.join(" ")
}

fn verdict(run: &Run) -> String {
    match &run.outcome {
        Outcome::Ran(finished) => match (finished.summary.status.words(), finished.summary.reason.as_str()) {
            (words, "") if finished.exit_code == 0 => words.to_string(),
            (words, "") => format!("{words}, but not within the limits of its checks"),
            (words, reason) => format!("{words}: {reason}"),
        },
        Outcome::Kept(_) => "finished before".into(),
        Outcome::Failed(error) => {
            let said = error.diagnostics.iter().find(|diagnostic| diagnostic.is_error());
            format!("failed: {}", said.map_or("", |said| said.message.as_str()))
        }
        Outcome::NotBegun => "not begun".into(),
    }
}
