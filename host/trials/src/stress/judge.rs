//! [`judge`]: what came out against what was expected.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::outcome::{Measure, Outcome};
use super::suite::{Bounds, Equals, Expected, Message, Reactions, Trial};
use crate::diagnostics::{Diagnostic, Source, render};
use crate::results::{ChannelInfo, Remedy, Status, Summary};
use crate::scene::Dimension;
use crate::session::{CheckReport, RunReport, Session, SessionError};

/// The outputs of a run in SI.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    /// Times of the samples, s.
    times: Vec<f64>,
    outputs: Vec<Output>,
}

/// An output in SI.
#[derive(Debug, Clone)]
struct Output {
    name: String,
    dimension: Dimension,
    values: Vec<f64>,
}

/// Judges a scene that was opened or refused, running it if that is expected. Gives its outputs if it was run.
pub(super) fn judge(
    trial: &Trial,
    session: Result<Session, SessionError>,
    other: Option<&Columns>,
    stop: &Arc<AtomicBool>,
    outcome: &mut Outcome,
) -> Option<Columns> {
    let refused = match &trial.expected {
        Expected::Refused(message) => Some(message),
        _ => None,
    };
    let session = match session {
        Ok(session) => session,
        Err(error) => {
            refusal(refused, &error, outcome);
            return None;
        }
    };
    if let Some(message) = &trial.warns {
        warned(message, &session, outcome);
    }
    reactions(&trial.reactions, &session.check_report(), outcome);
    let seconds = session.scene.units.factor(Dimension::TIME);
    let described: Vec<(f64, Dimension)> =
        session.model.channels.iter().map(|channel| (channel.factor, channel.dimension)).collect();
    let report = match session.run(None, Box::new(|_| ()), stop) {
        Ok(report) => report,
        Err(error) => {
            refusal(refused, &error, outcome);
            return None;
        }
    };
    let summary = &report.summary;
    outcome.work = summary.work();
    match &trial.expected {
        Expected::Refused(message) => {
            outcome.faults.push(format!("not refused with {}: {}", message.code, ending(summary)));
        }
        Expected::Completed(bounds) => {
            if summary.status != Status::Completed {
                outcome.faults.push(ending(summary));
            }
            measure(bounds, &report, outcome);
        }
        Expected::Stopped(message, bounds) => {
            stopped(message, summary, outcome);
            measure(bounds, &report, outcome);
        }
    }
    let columns = in_si(&report, seconds, &described);
    if let Some(equals) = &trial.equals {
        match other {
            Some(other) => equal(equals, &columns, other, outcome),
            None => outcome.faults.push(format!("`{}` left nothing to compare with", equals.trial)),
        }
    }
    Some(columns)
}

/// A scene that was refused.
fn refusal(expected: Option<&Message>, error: &SessionError, outcome: &mut Outcome) {
    let text = error.render(false);
    match expected {
        Some(message) => {
            outcome.said = text.trim_end().to_owned();
            if !error.diagnostics.iter().any(|diagnostic| *diagnostic.code == *message.code) {
                outcome.faults.push(format!("refused without {}", message.code));
            }
            missing_words(message, &text, outcome);
        }
        None => outcome.faults.push(format!("refused: {}", text.trim_end())),
    }
}

/// A run that is to end early.
fn stopped(message: &Message, summary: &Summary, outcome: &mut Outcome) {
    if summary.status == Status::Completed || summary.code.is_none_or(|code| *code != *message.code) {
        let violation = summary.audit.worst();
        outcome.faults.push(format!(
            "not stopped with {}: {}; the audit's worst number is {violation:.1e}",
            message.code,
            ending(summary)
        ));
        return;
    }
    outcome.said = ending(summary);
    missing_words(message, &summary.reason, outcome);
}

/// Warnings that must have been given.
fn warned(message: &Message, session: &Session, outcome: &mut Outcome) {
    let source: &Source = &session.scene.source;
    let meant = session.warnings.iter().filter(|warning| *warning.code == *message.code);
    let meant: Vec<Diagnostic> = meant.cloned().collect();
    let text = render(&meant, source, false);
    if meant.is_empty() {
        outcome.faults.push(format!("no warning {}", message.code));
    } else {
        outcome.said = text.trim_end().to_owned();
        missing_words(message, &text, outcome);
    }
}

fn missing_words(message: &Message, text: &str, outcome: &mut Outcome) {
    for words in message.words.iter().filter(|words| !text.contains(words.as_str())) {
        outcome.faults.push(format!("{} does not say `{words}`: {}", message.code, text.trim_end()));
    }
}

/// Reactions that must be unique, and such that must be marked.
fn reactions(expected: &Reactions, report: &CheckReport, outcome: &mut Outcome) {
    let marked = report.non_unique_reactions.iter().flat_map(|reaction| {
        let frame = format!("{} on {}", reaction.joint, reaction.on);
        reaction.components.iter().map(move |component| format!("{frame}: {component}"))
    });
    let marked: Vec<String> = marked.collect();
    for name in expected.unique.iter().filter(|name| marked.contains(name)) {
        outcome.faults.push(format!("`{name}` is unique, but marked as not determined"));
    }
    for name in expected.shared.iter().filter(|name| !marked.contains(name)) {
        outcome.faults.push(format!("`{name}` is not determined, but not marked so"));
    }
}

/// The audit and the checks of the scene.
fn measure(bounds: &Bounds, report: &RunReport, outcome: &mut Outcome) {
    let audit = &report.summary.audit;
    let chatters = report.summary.recoveries[Remedy::Chatter] as f64;
    let numbers = [
        ("violation of joints", audit.position_violation, bounds.position),
        ("violation of rates", audit.velocity_violation, bounds.velocity),
        ("energy balance", audit.energy_error_relative, bounds.energy),
        ("switches left to error control", chatters, bounds.chatters),
    ];
    for (what, found, bound) in numbers {
        outcome.measures.extend(bound.map(|bound| Measure { what: what.into(), found, bound }));
    }
    for check in &report.checks {
        match &check.problem {
            Some(problem) => outcome.faults.push(format!("`{}`: {problem}", check.name)),
            None => outcome.measures.push(Measure {
                what: check.name.clone(),
                found: check.largest,
                bound: check.tolerance,
            }),
        }
    }
}

/// Compares outputs with those of another trial, each as a share of its largest value, in units of the two machines.
fn equal(equals: &Equals, here: &Columns, there: &Columns, outcome: &mut Outcome) {
    let size = |dimension: Dimension| {
        let power = |size: f64, exponent: i8| size.powi(i32::from(exponent));
        power(equals.length, dimension.length) * power(equals.mass, dimension.mass) * power(equals.time, dimension.time)
    };
    let end = there.times.iter().fold(0.0_f64, |end, t| end.max(t.abs()));
    let moved = largest(&there.times, &here.times, 1.0 / equals.time);
    if here.times.len() != there.times.len() || moved.is_nan() || moved > 1e-9 * end {
        outcome.faults.push(format!("sampled at other times than `{}`", equals.trial));
        return;
    }
    for output in &here.outputs {
        let Some(other) = there.outputs.iter().find(|other| other.name == output.name) else {
            outcome.faults.push(format!("`{}` has no output `{}`", equals.trial, output.name));
            continue;
        };
        let peak = other.values.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
        let off = largest(&other.values, &output.values, 1.0 / size(output.dimension));
        let found = if off == 0.0 { 0.0 } else { off / peak };
        let what = format!("`{}` against {}", output.name, equals.trial);
        outcome.measures.push(Measure { what, found, bound: equals.within });
    }
}

/// The largest difference of a column from another one that is multiplied; NaN wins.
fn largest(a: &[f64], b: &[f64], factor: f64) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - factor * b).abs());
    differences.fold(0.0, |largest: f64, x| if x.is_nan() || x > largest { x } else { largest })
}

fn in_si(report: &RunReport, seconds: f64, described: &[(f64, Dimension)]) -> Columns {
    let output = |channel: &ChannelInfo, values: &[f64], (factor, dimension): (f64, Dimension)| {
        let values = values.iter().map(|value| factor * value).collect();
        Output { name: channel.name.clone(), dimension, values }
    };
    let columns = report.channels.iter().zip(&report.columns).zip(described);
    Columns {
        times: report.times.iter().map(|t| seconds * t).collect(),
        outputs: columns.map(|((channel, values), described)| output(channel, values, *described)).collect(),
    }
}

/// How a run ended.
fn ending(summary: &Summary) -> String {
    let (words, reached, unit) = (summary.status.words(), summary.t_end_reached, &summary.time_unit);
    match summary.reason.is_empty() {
        true => format!("{words}, t = {reached} {unit}"),
        false => format!("{words} at t = {reached} {unit}: {}", summary.reason),
    }
}
