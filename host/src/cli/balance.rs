//! `odyn balance`

use std::fmt::Write as _;

use odyn::analyses::balance::{Balanced, Question, Shaking, balanced, size};
use odyn::analyses::linear::Port;
use odyn::analyses::prescribed;
use odyn::analyses::shown;
use odyn::desk::page::chart::{COLORS, Chart, Curve, file, linear_axis};
use odyn::diagnostics::{Diagnostic, codes};
use odyn::results::significant;
use odyn::scene::{Dimension, Override};
use odyn::session::{RunOptions, Session};

use super::analyses::{folder_of, listener, page, warn, write};
use super::exit;
use super::failure::Failure;
use super::motion_args::BalanceArgs;
use super::terminal::{self, Progress};

/// `odyn balance`
pub(super) fn balance(args: &BalanceArgs) -> Result<u8, Failure> {
    let options = args.scene.options(None);
    let session = Session::open(&args.scene.scene, &options)?;
    warn(&session, args.quiet);
    let length = session.scene.units.factor(Dimension::LENGTH);
    let radius = match &args.radius {
        None => None,
        Some(text) => {
            let found = prescribed::amount(text, Dimension::LENGTH, length).filter(|radius| *radius > 0.0);
            Some(found.ok_or_else(|| {
                let message = format!("`--radius {text}` is no length");
                let help = "give a positive number, in the scene's unit of length or with its own";
                Failure::new(Diagnostic::error(codes::UNKNOWN_WORD, message).help(help)).exit(exit::USAGE)
            })?)
        }
    };
    let about = std::array::from_fn(|k| args.about.get(k).copied().unwrap_or(0.0) * length);
    let question =
        Question { turn: args.turn.clone(), turns: args.turns.get(), harmonics: args.harmonics.get(), about };
    let progress = Progress::new();
    let mut listen = listener(&progress, args.quiet || args.scene.json);
    let open = |more: Option<&str>| {
        let mut overrides = options.overrides.clone();
        overrides.extend(more.map(Override::new));
        let options = RunOptions { overrides, ..args.scene.options(None) };
        Session::open(&args.scene.scene, &options)
    };
    let found = balanced(&session, &open, &question, radius, &mut listen)?;
    drop(listen);
    drop(progress);
    let folder = args.output.clone().unwrap_or_else(|| folder_of(&args.scene, "balance"));
    let json = terminal::json(&found);
    write(&folder, "balance.json", json.as_bytes())?;
    let (angles, curves) = shown::shaking(&found);
    let columns: Vec<(&Port, &[f64])> = curves.iter().map(|(port, values)| (port, values.as_slice())).collect();
    page(&folder, &session.scene, &shown::balance(&found), &angles, &columns)?;
    write(&folder, "harmonics.csv", harmonics(&found).as_bytes())?;
    write(&folder, "shaking.csv", over_angle(&found).as_bytes())?;
    write(&folder, "shaking.svg", figure(&found).as_bytes())?;
    terminal::answer(args.scene.json, args.quiet, &json, || {
        let mut text = told(&found);
        let _ = writeln!(text, "results: {} (harmonics.csv, shaking.csv, shaking.svg, balance.json)", folder.display());
        let (scene, set) = (terminal::word_of(&args.scene.scene), &found.counterweight.set);
        if !set.is_empty() {
            let _ = writeln!(text, "to run with it: odyn run {scene} --set '{set}'");
        }
        text
    })?;
    Ok(exit::DONE)
}

/// The force without its mean over the angle, before and after, as a file of its own.
fn figure(found: &Balanced) -> String {
    let all = [("before", &found.before), ("with the counterweight", &found.after)].map(|(name, one)| {
        let mean = one.harmonics.first().map_or([0.0; 3], |mean| mean.force);
        let first = one.angles.first().copied().unwrap_or(0.0);
        let points: Vec<(f64, f64)> = (one.angles.iter().zip(&one.force))
            .map(|(angle, force)| {
                let left = size(&std::array::from_fn(|c| force[c] - mean[c]));
                ((angle - first).abs().to_degrees(), left)
            })
            .collect();
        (name, points)
    });
    let most =
        |of: fn(&(f64, f64)) -> f64| all.iter().flat_map(|(_, points)| points.iter().map(of)).fold(0.0, f64::max);
    let x = linear_axis(0.0, most(|point| point.0).max(1.0), "angle [deg]".into());
    let y = linear_axis(0.0, 1.05 * most(|point| point.1).max(f64::MIN_POSITIVE), "force without its mean [N]".into());
    let names: Vec<(&str, &str)> = all.iter().zip(COLORS).map(|((name, _), (_, color))| (*name, color)).collect();
    let curves: Vec<Curve> =
        (all.into_iter().zip(COLORS)).map(|((_, points), (color, _))| Curve { points, color }).collect();
    let chart = Chart { x: &x, y: &y, curves: &curves, dots: false, bound: None };
    file("Shaking force over the angle, before and after", &chart, &names)
}

fn harmonics(found: &Balanced) -> String {
    let mut text = String::from("order");
    for when in ["before", "predicted", "after"] {
        for what in ["Fx", "Fy", "Fz"] {
            let _ = write!(text, ",{what} {when} [N]");
        }
        for what in ["Mx", "My", "Mz"] {
            let _ = write!(text, ",{what} {when} [N m]");
        }
    }
    text.push('\n');
    for k in 0..found.before.harmonics.len() {
        let _ = write!(text, "{k}");
        for shaking in [&found.before, &found.predicted, &found.after] {
            let one = &shaking.harmonics[k];
            one.force.iter().chain(&one.moment).for_each(|value| {
                let _ = write!(text, ",{value:?}");
            });
        }
        text.push('\n');
    }
    text
}

fn over_angle(found: &Balanced) -> String {
    let mut text =
        String::from("angle [rad],Fx before [N],Fy before [N],Fz before [N],Fx after [N],Fy after [N],Fz after [N]\n");
    for (k, angle) in found.before.angles.iter().enumerate() {
        let _ = write!(text, "{angle:?}");
        found.before.force[k].iter().chain(&found.after.force[k]).for_each(|value| {
            let _ = write!(text, ",{value:?}");
        });
        text.push('\n');
    }
    text
}

fn told(found: &Balanced) -> String {
    let number = |value: f64| significant(value, 5);
    let weight = &found.counterweight;
    let mut text = format!(
        "{} angles at {} rad/s; from turn to turn the speed changes by {:.1e}\n",
        found.before.angles.len(),
        number(found.before.speed),
        found.before.drift.abs()
    );
    if found.before.drift.abs() > 1e-3 {
        text += "note: the turning is not steady yet: harmonics are those of these turns; let the run last longer\n";
    }
    let _ = writeln!(
        text,
        "{:>6} {:>12} {:>12} {:>12}   {:>12} {:>12} {:>12}",
        "order", "force [N]", "predicted", "after", "moment [N m]", "predicted", "after"
    );
    for k in 0..found.before.harmonics.len() {
        let all = [&found.before, &found.predicted, &found.after].map(|shaking| &shaking.harmonics[k]);
        let _ = write!(text, "{k:>6}");
        all.iter().for_each(|one| {
            let _ = write!(text, " {:>12}", number(size(&one.force)));
        });
        text.push_str("  ");
        all.iter().for_each(|one| {
            let _ = write!(text, " {:>12}", number(size(&one.moment)));
        });
        text.push('\n');
    }
    let rows = [&found.before, &found.predicted, &found.after];
    let line = |of: &dyn Fn(&Shaking) -> f64| rows.map(|one| number(of(one))).join(", ");
    let _ = writeln!(text, "without the mean, before, predicted, after:");
    let _ = writeln!(
        text,
        "  force, root mean square: {} N; largest: {} N",
        line(&|one| one.force_rms),
        line(&|one| one.force_peak)
    );
    let _ = writeln!(text, "  moment, root mean square: {} N m", line(&|one| one.moment_rms));
    if weight.set.is_empty() {
        let _ = writeln!(text, "counterweight on {}: none makes the force less", weight.body);
        return text;
    }
    let _ = writeln!(
        text,
        "counterweight on {}: {} kg at {} m (unbalance {} kg m), {} deg from the x axis of the joint's frame there",
        weight.body,
        number(weight.mass),
        number(weight.radius),
        number(weight.unbalance),
        number(weight.phase.to_degrees())
    );
    text
}
