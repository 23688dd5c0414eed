//! Derivatives by parameters of the verification scenes, against differences of high order of the closed forms that these scenes state.
//!
//! A closed form counts for a parameter where it holds beside its value, too: the checks of the scene pass there.

use std::fs;
use std::path::Path;

use odyn::analyses::sensitivity::{Request, Sensitivities};
use odyn::scene::{Formula, Reference};
use odyn::session::Session;

use crate::support::{options, root};

/// Parameters of a scene that are looked at; `ODYN_PARAMETERS` for more.
const MOST: usize = 1;
/// Whose runs take long.
const LONG: [&str; 2] = ["profile-contact", "start-at-equilibrium"];
/// Share of the largest derivative by which one may be off. Those whose own error is said to be larger may be off by ten times that,
/// and are few.
const OFF: f64 = 1e-8;
const FEW: f64 = 2e-3;
/// Accuracy of closed forms that count, as a share of their largest value, and of their differences, of the largest.
const CLOSED: f64 = 1e-9;
const SURE: f64 = 1e-10;
/// Derivatives below this share of values over the parameter are none.
const NONE: f64 = 1e-7;
/// Those below this share are taken as shares of it: OFF of that is less than what runs leave of the values themselves.
const SLIGHT: f64 = 1e-3;

/// A closed form over time: its output, its formula, and the samples for which it holds.
struct Form {
    check: String,
    output: String,
    formula: Formula,
    from: f64,
    to: f64,
}

fn forms(session: &Session) -> Vec<Form> {
    let known = |name: &str| session.model.channels.iter().any(|channel| channel.name == name);
    let form = |record: &odyn::scene::CheckRecord| {
        let output = record.value.text().trim().to_owned();
        let Reference::Formula(formula) = &record.reference else { return None };
        (known(&output) && formula.names().iter().all(|name| *name == "t")).then(|| Form {
            check: record.name.value.clone(),
            output,
            formula: formula.clone(),
            from: record.from.unwrap_or(f64::NEG_INFINITY),
            to: record.to.unwrap_or(f64::INFINITY),
        })
    };
    session.scene.checks.iter().filter_map(form).collect()
}

/// Values at times with a parameter at a value.
type Values<'v> = dyn Fn(f64) -> Option<Vec<f64>> + 'v;

/// The derivative with its error, at each time: central differences, extrapolated (Ridders 1982, Adv. Eng. Software 4, 75).
fn differentiated(values: &Values<'_>, at: f64) -> Option<Vec<[f64; 2]>> {
    const LEVELS: usize = 7;
    let mut h = 0.04 * at.abs();
    let mut differences: Vec<Vec<f64>> = Vec::new();
    for _ in 0..LEVELS {
        let (above, below) = (values(at + h)?, values(at - h)?);
        differences.push(above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * h)).collect());
        h *= 0.5;
    }
    let extrapolated = |time: usize| {
        let mut before: Vec<f64> = Vec::new();
        let mut best = [f64::NAN, f64::INFINITY];
        for level in &differences {
            let mut row = vec![level[time]];
            let mut factor = 4.0;
            for old in &before {
                let last = row[row.len() - 1];
                let next = last + (last - old) / (factor - 1.0);
                let error = (next - last).abs().max((next - old).abs());
                if error <= best[1] {
                    best = [next, error];
                }
                row.push(next);
                factor *= 4.0;
            }
            before = row;
        }
        best
    };
    Some((0..differences[0].len()).map(extrapolated).collect())
}

#[derive(Default)]
struct Judged {
    scenes: Vec<String>,
    compared: usize,
    told: usize,
    wrong: Vec<String>,
    worst: f64,
}

/// Compares all closed forms of a scene by one parameter.
fn judge(path: &Path, own: &Session, key: &str, value: f64, judged: &mut Judged) -> bool {
    let name = path.file_stem().unwrap().to_string_lossy().into_owned();
    let with = |value: f64| Session::open(path, &options(&[&format!("{key}={value:?}")], &[])).ok();
    // Where forms hold beside the value, and how large they are.
    let mut good: Vec<Form> = forms(own);
    for beside in [value * (1.0 + 1e-3), value * (1.0 - 1e-3)] {
        let Some(session) = with(beside) else { return false };
        let Ok(run) = session.run(None, Box::new(|_| ()), &Default::default()) else { return false };
        good.retain(|form| {
            run.checks.iter().find(|check| check.name == form.check).is_some_and(|check| {
                let size = check.series.iter().fold(0.0_f64, |most, (_, _, reference)| most.max(reference.abs()));
                check.passed && check.tolerance <= CLOSED * size
            })
        });
    }
    let names: Vec<String> = good.iter().map(|form| form.output.clone()).collect();
    if names.is_empty() {
        return false;
    }
    let request = Request { of: names, to: vec![key.to_owned()], ..Request::default() };
    let Ok(found) = Sensitivities::of(path, &options(&[], &[]), &request, &|_| (), &Default::default()) else {
        return false;
    };
    let mut any = false;
    for form in &good {
        let values = |value: f64| {
            let session = with(value)?;
            let own = forms(&session).into_iter().find(|one| one.check == form.check)?;
            Some(found.times.iter().map(|t| own.formula.evaluate(&|_| Some(*t))).collect::<Vec<f64>>())
        };
        let Some(exact) = differentiated(&values, value) else { continue };
        let Some(one) = found.outputs.iter().find(|one| one.output == form.output) else { continue };
        let within = |k: &usize| (form.from..=form.to).contains(&found.times[*k]) && exact[*k][0].is_finite();
        let places: Vec<usize> = (0..exact.len()).filter(within).collect();
        let size = places.iter().fold(0.0_f64, |most, k| most.max(exact[*k][0].abs()));
        let plain = values(value).unwrap_or_default();
        let largest = places.iter().fold(0.0_f64, |most, k| most.max(plain[*k].abs()));
        if size <= NONE * largest / value.abs() {
            continue;
        }
        let size = size.max(SLIGHT * largest / value.abs());
        for k in places {
            if exact[k][1] > SURE * size || !one.derivative[k].is_finite() {
                continue;
            }
            let off = (one.derivative[k] - exact[k][0]).abs() / size;
            judged.compared += 1;
            any = true;
            let told = one.error[k] > OFF * size;
            if told {
                judged.told += 1;
            } else {
                judged.worst = judged.worst.max(off);
            }
            let most = if told { 10.0 * one.error[k] / size } else { OFF };
            if off > most || off.is_nan() {
                judged.wrong.push(format!(
                    "{name}, {} by {key} at {}: {:?} is not {:?}, off by {off:.1e}, error {:.1e}, {}",
                    form.output, found.times[k], one.derivative[k], exact[k][0], one.error[k], found.status
                ));
                break;
            }
        }
    }
    any
}

#[test]
fn derivatives_of_verification_scenes_are_those_of_their_closed_forms() {
    let mut judged = Judged::default();
    let mut paths: Vec<_> =
        fs::read_dir(root().join("scenes/verification")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|kind| kind == "toml"));
    let most = std::env::var("ODYN_PARAMETERS").ok().and_then(|most| most.parse().ok()).unwrap_or(MOST);
    paths.sort();
    for path in paths {
        let text = fs::read_to_string(&path).unwrap();
        let table: toml::Table = text.parse().unwrap();
        let Some(parameters) = table.get("parameters").and_then(toml::Value::as_table) else { continue };
        let Ok(session) = Session::open(&path, &options(&[], &[])) else { continue };
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if forms(&session).is_empty() || most == MOST && LONG.contains(&name.as_str()) {
            continue;
        }
        let mut count = 0;
        for (key, value) in parameters {
            let Some(value) = value.as_float().or_else(|| value.as_integer().map(|value| value as f64)) else {
                continue;
            };
            if value == 0.0 || count == most {
                continue;
            }
            count += usize::from(judge(&path, &session, key, value, &mut judged));
        }
        if count > 0 {
            judged.scenes.push(name);
        }
    }
    let Judged { scenes, compared, told, wrong, worst } = judged;
    eprintln!(
        "{} scenes, {compared} values, worst {worst:.1e}; {told} said to be less exact: {scenes:?}",
        scenes.len()
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(told as f64 <= FEW * compared as f64, "{told} of {compared}");
    assert!(scenes.len() >= 55 && compared > 10_000, "{scenes:?}, {compared}");
}
