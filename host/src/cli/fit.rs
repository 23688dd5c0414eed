//! `odyn fit`

use odyn::analyses::fit::{Fit, Request, fitted_scene};
use odyn::analyses::linear::Port;
use odyn::analyses::shown;
use odyn::diagnostics::{Diagnostic, codes};
use odyn::scene::{self, Dimension};
use odyn::session::SessionError;

use super::analyses::{folder_of, page, write};
use super::exit;
use super::failure::{Failure, cannot_write};
use super::fit_args::FitArgs;
use super::interrupt::stop_on_interrupt;
use super::sensitivity::listener;
use super::terminal::{self, Progress};

fn usage(message: String, help: &str) -> Failure {
    Failure::new(Diagnostic::error(codes::BAD_OVERRIDE, message).help(help)).exit(exit::USAGE)
}

fn pair<'a>(option: &str, text: &'a str, form: &str) -> Result<(&'a str, &'a str), Failure> {
    let parts = text.rsplit_once('=').map(|(a, b)| (a.trim(), b.trim()));
    let good = parts.filter(|(a, b)| !a.is_empty() && !b.is_empty());
    good.ok_or_else(|| usage(format!("`{option} {text}` has no two sides"), &format!("write `{option} {form}`")))
}

fn number(option: &str, text: &str, value: &str) -> Result<f64, Failure> {
    let read = value.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    read.ok_or_else(|| {
        usage(format!("`{option} {text}`: `{value}` is no number"), "numbers are in the unit of the output or figure")
    })
}

/// `odyn fit`
pub(super) fn fit(args: &FitArgs) -> Result<u8, Failure> {
    let mut request = Request {
        vary: args.vary.clone(),
        most_iterations: args.iterations.map(usize::from),
        jobs: args.jobs.map_or(0, usize::from),
        ..Request::default()
    };
    for text in &args.columns {
        let (column, output) = pair("--columns", text, "MEASURED=OUTPUT")?;
        request.columns.push((column.into(), output.into()));
    }
    for text in &args.noise {
        let (column, value) = pair("--noise", text, "COLUMN=VALUE")?;
        request.noise.push((column.into(), number("--noise", text, value)?));
    }
    for text in &args.figures {
        let (figure, value) = pair("--figure", text, "NAME=VALUE[:NOISE]")?;
        let (value, noise) = value.split_once(':').map_or((value, None), |(value, noise)| (value, Some(noise)));
        let noise = noise.map(|noise| number("--figure", text, noise)).transpose()?;
        if noise.is_some_and(|noise| noise <= 0.0) {
            return Err(usage(format!("`--figure {text}`: the noise is not positive"), "leave it out to estimate it"));
        }
        request.figures.push((figure.into(), number("--figure", text, value)?, noise));
    }
    let progress = Progress::new();
    let told = listener(&progress, args.quiet || args.scene.json);
    let options = args.scene.options(None);
    let found = Fit::of(&args.scene.scene, args.measured.as_deref(), &options, &request, &told, &stop_on_interrupt())?;
    drop(told);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "fit"));
    let json = terminal::json(&found);
    write(&folder, "fit.json", json.as_bytes())?;
    write(&folder, "fit.csv", found.csv().as_bytes())?;
    let (scene, _) =
        scene::read(&args.scene.scene, &options.overrides).map_err(|rejected| SessionError::from(*rejected))?;
    let factor = scene.units.factor(Dimension::TIME);
    let times: Vec<f64> = found.times.iter().map(|time| time * factor).collect();
    let curves = found.curves();
    let columns: Vec<(&Port, &[f64])> = curves.iter().map(|(port, values)| (port, values.as_slice())).collect();
    page(&folder, &scene, &shown::fit(&found), &times, &columns)?;
    if let Some(path) = &args.write {
        let text = fitted_scene(&args.scene.scene, &options.overrides, &found)?;
        std::fs::write(path, text).map_err(|error| cannot_write(path, &error))?;
    }
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let place = folder.join("fit.csv");
        format!("{}results: {} (with fit.json)\n", found.overview(), place.display())
    })?;
    Ok(u8::try_from(found.exit_code()).unwrap_or(exit::AUDIT))
}
