//! `odyn sensitivity`

use std::sync::Mutex;

use odyn::analyses::linear::Port;
use odyn::analyses::sensitivity::{OutputSensitivity, Request, Sensitivities};
use odyn::analyses::shown;
use odyn::scene::{self, Dimension};
use odyn::session::SessionError;

use super::analyses::{folder_of, page, write};
use super::exit;
use super::failure::Failure;
use super::fit_args::SensitivityArgs;
use super::interrupt::stop_on_interrupt;
use super::terminal::{self, Progress};

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
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "sensitivity"));
    let json = terminal::json(&found);
    write(&folder, "sensitivity.json", json.as_bytes())?;
    write(&folder, "sensitivity.csv", found.csv().as_bytes())?;
    let (scene, _) = scene::read(&args.scene.scene, &args.scene.options(None).overrides)
        .map_err(|rejected| SessionError::from(*rejected))?;
    let factor = scene.units.factor(Dimension::TIME);
    let times: Vec<f64> = found.times.iter().map(|time| time * factor).collect();
    let named = |one: &OutputSensitivity| format!("d {} / d {}", one.output, one.parameter);
    let port = |one| Port { name: named(one), unit: one.unit.clone(), factor: 1.0, value: 0.0 };
    let ports: Vec<Port> = found.outputs.iter().map(port).collect();
    let columns: Vec<(&Port, &[f64])> =
        ports.iter().zip(&found.outputs).map(|(port, one)| (port, one.derivative.as_slice())).collect();
    page(&folder, &scene, &shown::sensitivity(&found), &times, &columns)?;
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let place = folder.join("sensitivity.csv");
        format!("{}results: {} (with sensitivity.json)\n", found.overview(), place.display())
    })?;
    Ok(u8::try_from(found.exit_code()).unwrap_or(exit::AUDIT))
}
