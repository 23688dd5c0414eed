//! `odyn modes --over`

use std::fmt::Write as _;

use odyn::analyses::campbell::Campbell;
use odyn::analyses::modes::Modes;
use odyn::analyses::question::{Answer, Question};
use odyn::desk::page::chart::{Chart, Curve, INK, colored, file, linear_axis};
use odyn::diagnostics::Diagnostic;
use odyn::results::significant;
use odyn::scene::{Dimension, Override, number_and_unit, parse_unit};
use odyn::study::Vary;

use super::analyses::{folder_of, write};
use super::analyses_args::ModesArgs;
use super::exit;
use super::failure::Failure;
use super::interrupt::stop_on_interrupt;
use super::terminal::{self, Progress};

/// Orders of the speed that are drawn beside the frequencies.
const ORDERS: [f64; 3] = [1.0, 2.0, 3.0];

/// Modes over the values of a key.
pub(super) fn campbell(args: &ModesArgs, over: &str) -> Result<u8, Failure> {
    let usage = |diagnostic: Diagnostic| Failure::new(diagnostic).exit(exit::USAGE);
    // Written as values of a study are, under another option.
    let named = |diagnostic: Diagnostic| Diagnostic {
        message: diagnostic.message.replace("--vary", "--over"),
        help: vec!["write `--over rotor.speed=0rpm:6000rpm:31` (from, to, how many) or `--over spring.k=10,20`".into()],
        ..diagnostic
    };
    let vary = Vary::parse(over).map_err(named).map_err(usage)?;
    let place = &args.place;
    let question = Question::Modes { at: place.at.clone() };
    let stop = stop_on_interrupt();
    let progress = (!place.quiet && !place.scene.json).then(Progress::new);
    let mut listen = progress.as_ref().map(Progress::listener);
    let mut ended = 0_usize;
    let mut ask = |value: &str| {
        let mut options = place.scene.options(None);
        options.overrides.push(Override::new(format!("{}={value}", vary.key)));
        let answer = question.ask(&place.scene.scene, &options, &|_| (), &stop)?;
        ended += 1;
        if let Some(listen) = &mut listen {
            listen(ended as f64 / vary.values.len() as f64);
        }
        match answer {
            Answer::Modes(modes) => Ok(modes),
            _ => unreachable!("modes were asked for"),
        }
    };
    let found = Campbell::over(&vary.key, &vary.values, &mut ask)?;
    drop(listen);
    drop(progress);
    let folder = place.output.clone().unwrap_or_else(|| folder_of(&place.scene, "campbell"));
    let json = terminal::json(&found);
    write(&folder, "campbell.json", json.as_bytes())?;
    write(&folder, "campbell.csv", found.csv().as_bytes())?;
    let drawn = figure(&found);
    if let Some(drawn) = &drawn {
        write(&folder, "campbell.svg", drawn.as_bytes())?;
    }
    terminal::answer(place.scene.json, place.quiet, &json, || {
        let mut text = table(&found, args.most);
        let files =
            if drawn.is_some() { "campbell.csv, campbell.svg, campbell.json" } else { "campbell.csv, campbell.json" };
        let _ = writeln!(text, "results: {} ({files})", folder.display());
        text
    })?;
    Ok(exit::DONE)
}

/// Frequencies of the branches, a line for each value.
fn table(found: &Campbell, most: usize) -> String {
    let shown = found.branches.len().min(most);
    let mut text = format!("{:>16}", found.key);
    (1..=shown).for_each(|branch| {
        let _ = write!(text, " {:>12}", format!("f{branch} [Hz]"));
    });
    text.push_str("  stability\n");
    for (at, value) in found.values.iter().enumerate() {
        let _ = write!(text, "{value:>16}");
        for branch in 0..shown {
            let mode = found.branch(branch).find(|(number, _)| *number == at);
            let number = mode.map_or(String::new(), |(_, mode)| significant(mode.frequency, 6));
            let _ = write!(text, " {number:>12}");
        }
        let axes = if turns(&found.modes[at]) { " (in axes that turn)" } else { "" };
        let _ = writeln!(text, "  {}{axes}", found.modes[at].stability.words());
    }
    if found.branches.len() > shown {
        let _ = writeln!(text, "  and {} more branches", found.branches.len() - shown);
    }
    // Those of the first value that has any, and of the first in axes that turn: numbers in them are of that one.
    let any = found.modes.iter().position(|modes| !modes.notes.is_empty());
    let turned = found.modes.iter().position(turns).filter(|turned| any != Some(*turned));
    for at in any.into_iter().chain(turned) {
        found.modes[at].notes.iter().for_each(|note| {
            let _ = writeln!(text, "note: at {} = {}: {note}", found.key, found.values[at]);
        });
    }
    text
}

fn turns(modes: &Modes) -> bool {
    modes.turning != [0.0; 3]
}

/// Frequencies over the values, with multiples of the speed where the key is one; none where values are no numbers of one unit.
fn figure(found: &Campbell) -> Option<String> {
    let values: Vec<(f64, &str)> = found.values.iter().map(|value| number_and_unit(value)).collect::<Option<_>>()?;
    let (_, unit) = *values.first()?;
    if values.iter().any(|(_, other)| *other != unit) {
        return None;
    }
    let ends = values.iter().fold((f64::MAX, f64::MIN), |(low, high), (x, _)| (low.min(*x), high.max(*x)));
    let branches = (0..found.branches.len()).map(|branch| {
        let points = found.branch(branch).filter(|(_, mode)| mode.imaginary != 0.0);
        points.map(|(at, mode)| (values[at].0, mode.frequency)).collect::<Vec<_>>()
    });
    let mut curves = colored(branches.filter(|points| !points.is_empty()));
    let highest = curves.iter().flat_map(|curve| &curve.points).fold(0.0_f64, |most, point| most.max(point.1));
    if !(ends.1 > ends.0 && highest > 0.0) {
        return None;
    }
    let turns = parse_unit(unit).ok().filter(|(dimension, _)| *dimension == Dimension::ANGULAR_VELOCITY);
    if let Some((_, factor)) = turns {
        for order in ORDERS {
            let per = order * factor / std::f64::consts::TAU;
            // Down to where the line leaves the drawing.
            let last = ends.1.min(1.05 * highest / per);
            if last > ends.0 {
                curves.push(Curve { points: vec![(ends.0, per * ends.0), (last, per * last)], color: INK });
            }
        }
    }
    let label = if unit.is_empty() { found.key.clone() } else { format!("{} [{unit}]", found.key) };
    let (x, y) = (linear_axis(ends.0, ends.1, label), linear_axis(0.0, 1.05 * highest, "frequency [Hz]".into()));
    let chart = Chart { x: &x, y: &y, curves: &curves, dots: true, bound: None };
    let orders = ("1, 2, 3 times the speed", "currentColor");
    let names = if turns.is_some() { &[orders][..] } else { &[] };
    Some(file("Frequencies over a number of the scene", &chart, names))
}
