//! `odyn study`

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use odyn::diagnostics::{Diagnostic, shown};
use odyn::study::{Outcome, Run, Study, StudyOptions, Vary};

use super::choices;
use super::exit;
use super::failure::Failure;
use super::run::stop_on_interrupt;
use super::scene_args::StudyArgs;
use super::terminal;

/// Runs a scene with all combinations of values and writes the table.
pub(super) fn study(args: &StudyArgs) -> Result<u8, Failure> {
    let varied: Result<Vec<Vary>, Diagnostic> = args.vary.iter().map(|text| Vary::parse(text)).collect();
    let varied = varied.map_err(|diagnostic| Failure::new(diagnostic).exit(exit::USAGE))?;
    let folder = args.output.clone().unwrap_or_else(|| default_output(&args.scene.scene));
    let options = StudyOptions {
        common: args.scene.options(args.audit_tol),
        varied,
        jobs: args.jobs.map_or(0, usize::from),
        folder: args.results.then(|| folder.clone()),
        journal: Some(folder.clone()),
        resume: args.resume,
    };
    let count: usize = options.varied.iter().map(|vary| vary.values.len()).fold(1, usize::saturating_mul);
    let silent = args.quiet || args.scene.json;
    if !args.quiet {
        choices::tell([args.scene.scene.as_path()], &options.common.overrides, &args.scene.plugins);
    }
    let ended = AtomicUsize::new(0);
    let told = |_: usize, run: &Run| {
        let ended = ended.fetch_add(1, Ordering::Relaxed) + 1;
        if !silent {
            eprintln!("{ended}/{count} {}: {}", shown(&values(&options.varied, run)), shown(&verdict(run)));
        }
    };
    let study = Study::run(&args.scene.scene, &options, &told, &stop_on_interrupt());
    let study = study.map_err(|diagnostic| Failure::new(*diagnostic).exit(exit::USAGE))?.any_results()?;
    if study.kept() > 0 && !silent {
        eprintln!("{} of {count} runs were finished before", study.kept());
    }
    let table = study.table();
    let path = study.write(&folder)?;
    if args.scene.json {
        terminal::print_as_it_is(&terminal::json(&table))?;
    } else if !args.quiet {
        terminal::print(&format!("{}table: {}\n", table.overview(), path.display()))?;
    }
    if silent {
        // Errors are told even to those who want to hear nothing else.
        let fine = |outcome: &Outcome| match outcome {
            Outcome::Ran(finished) => finished.exit_code == 0,
            Outcome::Kept(_) => true,
            Outcome::Failed(_) | Outcome::NotBegun => false,
        };
        for run in study.runs.iter().filter(|run| !fine(&run.outcome)) {
            eprintln!("error: {}: {}", shown(&values(&options.varied, run)), shown(&verdict(run)));
        }
    }
    Ok(u8::try_from(study.exit_code()).unwrap_or(exit::INTEGRATION))
}

/// `results/compressor-study` for `scenes/compressor.toml`.
fn default_output(scene: &Path) -> PathBuf {
    let stem = scene.file_stem().unwrap_or(scene.as_os_str()).to_string_lossy();
    Path::new("results").join(format!("{stem}-study"))
}

fn values(varied: &[Vary], run: &Run) -> String {
    let pairs = varied.iter().zip(&run.values).map(|(vary, value)| format!("{}={value}", vary.key));
    pairs.collect::<Vec<_>>().join(" ")
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
