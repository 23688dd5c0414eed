//! [`Formula`]: arithmetic on results, in plain numbers.

use super::dimension::Dimension;
use super::expression::{self, Expression, ExpressionError, Function, Operation, Vocabulary};
use super::parameters::Parameters;
use super::quantity::{Names, Quantity, first_operand};
use super::raw::{RawKind, RawValue};
use super::reader::{Scope, expression_diagnostic};
use odyn_diagnostics::{Diagnostic, codes, help_for};
use std::collections::HashSet;
use std::ops::Range;

/// The name of the time.
const TIME: &str = "t";

/// An expression over the time `t`, outputs and parameters, as in `[[check]]`.
///
/// It is computed in plain numbers, everything in scene units: the time, outputs as in the table of results, parameters
/// and quantities converted. Trigonometric functions take and give radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    /// As written.
    text: String,
    /// Parameters are replaced by their numbers, so that names are the time and outputs.
    operations: Vec<Operation>,
}

impl Formula {
    /// As written in the scene.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The names whose values it needs, `t` and outputs, each once.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for operation in &self.operations {
            if let Operation::Parameter(name) = operation
                && !names.contains(&name.as_str())
            {
                names.push(name);
            }
        }
        names
    }

    /// Its value; NaN if a name has none.
    pub fn evaluate(&self, lookup: &dyn Fn(&str) -> Option<f64>) -> f64 {
        let mut stack: Vec<f64> = Vec::new();
        for operation in &self.operations {
            let first = first_operand(operation, stack.len());
            let result = match operation {
                Operation::Parameter(name) => lookup(name).unwrap_or(f64::NAN),
                _ => arithmetic(operation, &stack[first..]),
            };
            stack.truncate(first);
            stack.push(result);
        }
        stack.pop().expect("a parsed expression leaves one value")
    }

    /// Reads a formula; a plain number is one. The error is `None` if its cause is reported elsewhere.
    pub(super) fn read(raw: &RawValue, outputs: &HashSet<&str>, scope: &Scope<'_>) -> Result<Self, Option<Diagnostic>> {
        let constant = |number: f64| Formula { text: number.to_string(), operations: vec![Operation::Number(number)] };
        match &raw.kind {
            RawKind::Number(number) => Ok(constant(*number)),
            RawKind::Integer(number) => Ok(constant(*number as f64)),
            RawKind::Text(text) => Self::parse(text, outputs, scope)
                .map_err(|error| (!error.reported).then(|| expression_diagnostic(&error, raw, scope.source))),
            other => {
                let message = format!("expected a number or a formula, found {}", other.describe());
                Err(Some(Diagnostic::error(codes::WRONG_TYPE, message).at(raw.span.clone(), "")))
            }
        }
    }

    fn parse(text: &str, outputs: &HashSet<&str>, scope: &Scope<'_>) -> Result<Self, ExpressionError> {
        // Names of outputs may have a `-`; alone, such a name is no difference.
        if outputs.contains(text.trim()) && text.contains('-') {
            let operations = vec![Operation::Parameter(text.trim().to_owned())];
            return Ok(Formula { text: text.to_owned(), operations });
        }
        let is_signal = |name: &str| name == TIME || outputs.contains(name);
        let is_name = |name: &str| is_signal(name) || scope.parameters.get(name).is_some();
        let vocabulary = Vocabulary { is_parameter: &is_name, is_variable: &is_name, products: true };
        let Expression { operations } = expression::parse_with(text, vocabulary)?;
        let resolved = operations.into_iter().map(|(operation, range)| match operation {
            Operation::Parameter(name) if is_signal(&name) => match scope.parameters.get(&name) {
                // Taking either could make a check that compares a thing with itself.
                Some(_) => Err(ambiguous(&name, range)),
                None => Ok(Operation::Parameter(name)),
            },
            Operation::Parameter(name) => match scope.parameters.value(&name) {
                Some(value) if value.si.is_nan() => {
                    let error = ExpressionError::new(codes::UNKNOWN_PARAMETER, range, "this parameter has no value");
                    Err(ExpressionError { reported: true, ..error })
                }
                Some(value) => plain(value, range, scope).map(Operation::Number),
                None => Err(unknown(&name, range, outputs, scope.parameters)),
            },
            Operation::Quantity { si, dimension, .. } => {
                plain(Quantity::derived(si, dimension), range, scope).map(Operation::Number)
            }
            other => Ok(other),
        });
        Ok(Formula { text: text.to_owned(), operations: resolved.collect::<Result<_, _>>()? })
    }
}

/// The quantity in scene units.
fn plain(quantity: Quantity, range: Range<usize>, scope: &Scope<'_>) -> Result<f64, ExpressionError> {
    if quantity.plain {
        return Ok(quantity.si);
    }
    if quantity.dimension == Dimension::ANGLE && scope.units.factor(Dimension::ANGLE) != 1.0 {
        let message = "this angle could be meant in radians or in scene units";
        return Err(ExpressionError::new(codes::NEEDS_UNIT, range, message)
            .advise("write a plain number: radians as the argument of `sin`, scene units beside an output"));
    }
    Ok(scope.units.from_si(quantity.si, quantity.dimension))
}

fn ambiguous(name: &str, range: Range<usize>) -> ExpressionError {
    let what = if name == TIME { "the time" } else { "an output" };
    ExpressionError::new(codes::AMBIGUOUS, range, format!("`{name}` is {what} as well as a parameter"))
        .advise("rename one of them")
}

fn unknown(name: &str, range: Range<usize>, outputs: &HashSet<&str>, parameters: &Parameters) -> ExpressionError {
    let mut known: Vec<&str> = outputs.iter().copied().collect();
    known.sort_unstable();
    known.push(TIME);
    known.extend(parameters.names());
    let message = format!("`{name}` is neither an output nor a parameter");
    ExpressionError {
        help: help_for(name, &known, "names"),
        ..ExpressionError::new(codes::UNKNOWN_PARAMETER, range, message)
    }
}

/// One operation on plain numbers.
pub(super) fn arithmetic(operation: &Operation, operands: &[f64]) -> f64 {
    match (operation, operands) {
        (Operation::Number(value), []) => *value,
        (Operation::Negate, [a]) => -a,
        (Operation::Add, [a, b]) => a + b,
        (Operation::Subtract, [a, b]) => a - b,
        (Operation::Multiply, [a, b]) => a * b,
        (Operation::Divide, [a, b]) => a / b,
        (Operation::Power, [a, b]) => a.powf(*b),
        (Operation::Call(function, _), arguments) => call(*function, arguments),
        _ => unreachable!("names and quantities are replaced before, and the operands are those of the operation"),
    }
}

fn call(function: Function, arguments: &[f64]) -> f64 {
    let a = arguments[0];
    // Unlike `f64::min`, a NaN is never lost: a check must not pass because of it.
    let fold = |choose: fn(f64, f64) -> f64| {
        arguments[1..]
            .iter()
            .fold(a, |kept, next| if next.is_nan() || kept.is_nan() { f64::NAN } else { choose(kept, *next) })
    };
    match function {
        Function::Sqrt => a.sqrt(),
        Function::Sin => a.sin(),
        Function::Cos => a.cos(),
        Function::Tan => a.tan(),
        Function::Asin => a.asin(),
        Function::Acos => a.acos(),
        Function::Atan => a.atan(),
        Function::Atan2 => a.atan2(arguments[1]),
        Function::Exp => a.exp(),
        Function::Ln => a.ln(),
        Function::Tanh => a.tanh(),
        Function::Abs => a.abs(),
        Function::Min => fold(f64::min),
        Function::Max => fold(f64::max),
    }
}
