//! The numbers of an analysis beside those that a scene says it must find.

use std::path::Path;
use std::sync::Arc;

use serde_json::Value;

use super::case::{Checked, Measured};
use super::verifier::Settings;
use crate::diagnostics::{Diagnostic, codes, render};
use crate::question::{Question, at};
use crate::results::significant;
use crate::scene::{AnalysisRecord, Expected, NumberRecord, Scene};
use crate::session::RunOptions;
use crate::statics;

/// Answers the question of a scene and judges its numbers.
///
/// # Errors
/// Mistakes in the question or in places of the answer, with their places in the scene; what the analysis refuses.
pub(super) fn judge(
    settings: &Settings,
    path: &Path,
    scene: &Scene,
    asked: &AnalysisRecord,
    numbers: &[NumberRecord],
) -> Result<Measured, String> {
    let source = &scene.source;
    let mut mistakes: Vec<Diagnostic> = Vec::new();
    let question = Question::read(asked.question.clone()).map_err(|reason| {
        let help =
            "`analysis` names a command of odyn, `options` are its long options; `odyn verify --help` lists them";
        render(&[Diagnostic::error(codes::UNKNOWN_WORD, reason).at(asked.span.clone(), "").help(help)], source, false)
    })?;
    let options = RunOptions {
        jobs: 1,
        plugins: settings.plugins.clone(),
        library_copies: settings.library_copies.clone(),
        equilibrium: Some(statics::start),
        ..RunOptions::default()
    };
    let answer = question.ask(path, &options, &|_| (), &Arc::default()).map_err(|error| error.render(false))?;
    let answer = answer.value().map_err(|error| error.to_string())?;
    let mut checks = Vec::with_capacity(numbers.len());
    for number in numbers {
        match at(&answer, &number.of.value).and_then(|found| checked(number, found)) {
            Ok(check) => checks.push(check),
            Err(reason) => {
                let help = format!("`of` is a place in what `odyn {} --json` prints", question.analysis());
                let mistake = Diagnostic::error(codes::UNKNOWN_TARGET, reason);
                mistakes.push(mistake.at(number.of.span.clone(), "").help(help));
            }
        }
    }
    if !mistakes.is_empty() {
        return Err(render(&mistakes, source, false));
    }
    Ok(Measured { method: format!("odyn {}", question.analysis()), checks, ..Measured::default() })
}

fn checked(number: &NumberRecord, found: &Value) -> Result<Checked, String> {
    let plain = Checked {
        name: number.name.value.clone(),
        kind: "other".into(),
        value: number.of.value.clone(),
        unit: number.unit.clone(),
        at: f64::NAN,
        ..Checked::default()
    };
    match &number.expected {
        Expected::Word(word) => {
            let text = match found {
                Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            let passed = text == *word;
            let problem = (!passed).then(|| format!("it is `{text}`"));
            let largest = if passed { 0.0 } else { f64::INFINITY };
            Ok(Checked { reference: word.clone(), largest, passed, problem, ..plain })
        }
        Expected::Value { reference, tolerance } => {
            // What is not known is `null`, and passes nothing.
            let value = match found {
                Value::Null => f64::NAN,
                Value::Number(value) => value.as_f64().unwrap_or(f64::NAN),
                _ => return Err(format!("`{}` is no number: `equals` compares words", number.of.value)),
            };
            let wanted = reference.evaluate(&|_| None);
            let largest = (value - wanted).abs();
            let passed = largest <= *tolerance;
            let problem = (!passed)
                .then(|| format!("it is {}, and {} was expected", significant(value, 12), significant(wanted, 12)));
            Ok(Checked { reference: reference.text().into(), tolerance: *tolerance, largest, passed, problem, ..plain })
        }
    }
}
