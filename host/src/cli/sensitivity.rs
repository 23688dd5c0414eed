//! `odyn sensitivity`

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use odyn::analyses::files;
use odyn::analyses::sensitivity::{Request, Sensitivities};
use odyn::results::ResultsError;

use super::exit;
use super::failure::Failure;
use super::fit_args::SensitivityArgs;
use super::run::stop_on_interrupt;
use super::scene_args::SceneArgs;
use super::terminal::{self, Progress};

/// `results/NAME-KIND`.
pub(super) fn folder(scene: &SceneArgs, kind: &str) -> PathBuf {
    let mut folder = scene.default_output();
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    folder.set_file_name(format!("{name}-{kind}"));
    folder
}

pub(super) fn write(folder: &Path, name: &str, content: &[u8]) -> Result<(), Failure> {
    files::write(folder, name, content).map_err(|error| ResultsError::write(folder, error).into())
}

/// A progress bar that any thread may move.
pub(super) fn listener(progress: &Progress, hidden: bool) -> impl Fn(f64) + Sync {
    let bar = (!hidden).then(|| Mutex::new(progress.listener()));
    move |share| {
        if let Some(Ok(mut bar)) = bar.as_ref().map(Mutex::lock) {
            bar(share);
        }
    }
}

/// `odyn sensitivity`
pub(super) fn sensitivity(args: &SensitivityArgs) -> Result<u8, Failure> {
    let request =
        Request { of: args.of.clone(), to: args.to.clone(), step: args.step, jobs: args.jobs.map_or(0, usize::from) };
    let progress = Progress::new();
    let told = listener(&progress, args.quiet || args.scene.json);
    let found = Sensitivities::of(&args.scene.scene, &args.scene.options(None), &request, &told, &stop_on_interrupt())?;
    drop(told);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder(&args.scene, "sensitivity"));
    let json = terminal::json(&found);
    write(&folder, "sensitivity.json", json.as_bytes())?;
    write(&folder, "sensitivity.csv", found.csv().as_bytes())?;
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let place = folder.join("sensitivity.csv");
        format!("{}results: {} (with sensitivity.json)\n", found.overview(), place.display())
    })?;
    Ok(u8::try_from(found.exit_code()).unwrap_or(exit::AUDIT))
}
