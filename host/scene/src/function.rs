//! Functions of one variable: what a scene writes, as `element_api::Function` reads it, in SI.
//!
//! An expression is translated operation by operation. An operand is either known, then it is computed here, or it
//! depends on the variable, then only its dimension is known and its operations are collected in reverse Polish notation.
//!
//! There are two readings. If nothing in the text has a dimension, it is arithmetic in scene units: the variable and the
//! result are numbers of the scene's units, trigonometric functions take radians. Otherwise the variable is a quantity,
//! and dimensions are checked as in all expressions.

use super::dimension::Dimension;
use super::expression::{self, Expression, ExpressionError, Function, Operation, Vocabulary};
use super::formula::arithmetic;
use super::parameters::Parameters;
use super::quantity::{Names, Quantity, apply, evaluate, finite, first_operand, parameter};
use super::raw::{RawKind, RawTable, RawValue};
use super::reader::{Scope, expression_diagnostic};
use element_api::{Interpolation, Outside};
use odyn_diagnostics::{Diagnostic, codes, help_for};
use std::ops::Range;
use toml::Value;

/// A function that is to be read.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Name of the variable.
    pub variable: &'a str,
    /// Dimension of the variable.
    pub argument: Dimension,
    /// Dimension of the values.
    pub value: Dimension,
}

/// Reads a function. The error is `None` if its cause is reported elsewhere.
pub(super) fn read(raw: &RawValue, wanted: Wanted<'_>, scope: &Scope<'_>) -> Result<Value, Option<Diagnostic>> {
    match &raw.kind {
        RawKind::Number(_) | RawKind::Integer(_) | RawKind::Quantity(_) => {
            scope.quantity(raw, wanted.value).map(Value::Float)
        }
        RawKind::Text(text) => translate(text, wanted, scope)
            .map_err(|error| (!error.reported).then(|| expression_diagnostic(&error, raw, scope.source))),
        RawKind::Array(items) => points(raw, items, wanted, scope, LEAST_POINTS),
        RawKind::Table(table) => table_of_points(raw, table, &["points", "interpolation", "periodic"], wanted, scope),
        RawKind::Bool(_) => Err(Some(
            Diagnostic::error(codes::WRONG_TYPE, "expected a function, found true or false")
                .at(raw.span.clone(), "this is true or false")
                .help(format!(
                    "write a number, an expression in `{}`, or a list of [argument, value] pairs",
                    wanted.variable
                )),
        )),
    }
}

/// Points of a parameter whose element decides what is outside of them:
/// `{ points = [...], interpolation = "linear" }`. The variable has no name.
pub(super) fn read_curve(
    raw: &RawValue,
    table: &RawTable,
    wanted: Wanted<'_>,
    scope: &Scope<'_>,
) -> Result<Value, Option<Diagnostic>> {
    table_of_points(raw, table, &["points", "interpolation"], wanted, scope)
}

/// Points that are needed, whatever is made of them.
const LEAST_POINTS: usize = 2;

/// `{ points = [...], interpolation = "linear", periodic = true }`
fn table_of_points(
    raw: &RawValue,
    table: &RawTable,
    keys: &[&str],
    wanted: Wanted<'_>,
    scope: &Scope<'_>,
) -> Result<Value, Option<Diagnostic>> {
    if let Some((key, _)) = table.entries.iter().find(|(key, _)| !keys.contains(&key.value.as_str())) {
        if table.get("points").is_none() && table.get("z").is_some() {
            return Err(Some(
                Diagnostic::error(codes::UNKNOWN_KEY, "a function of one variable cannot be given by a grid")
                    .at(raw.span.clone(), "this has values over two arguments")
                    .help("of a file, name the columns of the argument and the value: `columns = [\"speed\", \"torque\"]`"),
            ));
        }
        return Err(Some(
            Diagnostic::error(codes::UNKNOWN_KEY, format!("unknown key `{}` in a function", key.value))
                .at(key.span.clone(), "")
                .help_if(help_for(&key.value, keys, "keys"))
                .help("a formula is written as a text: `\"2 * sin(3 * t)\"`; points in a file are `{ file = \"motor.csv\", columns = [\"speed\", \"torque\"] }`"),
        ));
    }
    let Some(list) = table.get("points") else {
        return Err(Some(
            Diagnostic::error(codes::MISSING_KEY, "a function given as a table needs `points`")
                .at(raw.span.clone(), "")
                .help("write `{ points = [[0, 0], [1, 5]], interpolation = \"linear\" }`"),
        ));
    };
    let periodic = match table.get("periodic").map(|flag| (flag, &flag.kind)) {
        None => false,
        Some((_, RawKind::Bool(value))) => *value,
        Some((flag, other)) => {
            let message = format!("`periodic` must be true or false, found {}", other.describe());
            return Err(Some(Diagnostic::error(codes::WRONG_TYPE, message).at(flag.span.clone(), "")));
        }
    };
    let interpolation = table.get("interpolation").map(interpolation).transpose()?;
    let Some(items) = list.as_array() else {
        let message = format!("`points` must be a list of [argument, value] pairs, found {}", list.kind.describe());
        return Err(Some(Diagnostic::error(codes::WRONG_TYPE, message).at(list.span.clone(), "")));
    };
    let outside = if periodic { Outside::Periodic } else { Outside::Clamped };
    let least = interpolation.unwrap_or_default().fewest(outside);
    let mut entries = toml::Table::new();
    entries.insert("points".into(), points(list, items, wanted, scope, least)?);
    if let Some(interpolation) = interpolation {
        entries.insert("interpolation".into(), Value::String(interpolation.name().into()));
    }
    if keys.contains(&"periodic") {
        entries.insert("periodic".into(), Value::Boolean(periodic));
    }
    Ok(Value::Table(entries))
}

/// One of the words for what is between points.
pub(super) fn interpolation(raw: &RawValue) -> Result<Interpolation, Option<Diagnostic>> {
    let words: Vec<&str> = Interpolation::ALL.iter().map(|(word, _)| *word).collect();
    let wrong = |code, message: String| Some(Diagnostic::error(code, message).at(raw.span.clone(), ""));
    let Some(word) = raw.as_text() else {
        let message = format!("`interpolation` must be a text, found {}", raw.kind.describe());
        return Err(wrong(codes::WRONG_TYPE, message).map(|d| d.help(format!("one of {}", words.join(", ")))));
    };
    word.parse().map_err(|()| {
        let unknown = wrong(codes::UNKNOWN_WORD, format!("there is no interpolation `{word}`"));
        unknown.map(|diagnostic| diagnostic.help_if(help_for(word, &words, "interpolations")))
    })
}

/// Pairs in SI with increasing arguments.
fn points(
    raw: &RawValue,
    items: &[RawValue],
    wanted: Wanted<'_>,
    scope: &Scope<'_>,
    least: usize,
) -> Result<Value, Option<Diagnostic>> {
    let mut pairs = Vec::with_capacity(items.len());
    let mut last = f64::NEG_INFINITY;
    for item in items {
        let Some([x, y]) = item.as_array() else {
            return Err(Some(
                Diagnostic::error(codes::WRONG_TYPE, "a function given by points is a list of pairs")
                    .at(item.span.clone(), "expected [argument, value]"),
            ));
        };
        let (argument, value) = (scope.quantity(x, wanted.argument)?, scope.quantity(y, wanted.value)?);
        if argument <= last {
            return Err(Some(
                Diagnostic::error(codes::OUT_OF_RANGE, "the arguments of a function given by points must increase")
                    .at(x.span.clone(), "not above the one before"),
            ));
        }
        last = argument;
        pairs.push(Value::Array(vec![Value::Float(argument), Value::Float(value)]));
    }
    if pairs.len() < least {
        let message = format!("a function through points needs at least {least} of them, found {}", pairs.len());
        return Err(Some(Diagnostic::error(codes::WRONG_LENGTH, message).at(raw.span.clone(), "")));
    }
    Ok(Value::Array(pairs))
}

/// An expression: a float without the variable, else `{ postfix = [...] }`.
fn translate(text: &str, wanted: Wanted<'_>, scope: &Scope<'_>) -> Result<Value, ExpressionError> {
    let is_parameter = |name: &str| scope.parameters.get(name).is_some();
    let is_variable = |name: &str| name == wanted.variable;
    let vocabulary = Vocabulary { is_parameter: &is_parameter, is_variable: &is_variable, products: true };
    let parsed = expression::parse_with(text, vocabulary)?;
    let whole = 0..text.len();
    let translator = Translator { wanted, scope, plain: is_plain(&parsed, wanted.variable, scope.parameters) };
    let result = translator.run(&parsed)?;
    let Some(mut words) = result.words else {
        let si = evaluate(&parsed, scope.parameters, scope.units)?.expect(wanted.value, scope.units, whole.clone())?;
        return match si.is_finite() {
            true => Ok(Value::Float(si)),
            false => Err(ExpressionError::new(codes::NOT_FINITE, whole, "this number is too large")),
        };
    };
    if translator.plain && result.angle == Angle::Radians && wanted.value.angle != 0 {
        translator.refuse_plain_angle(&whole)?;
    }
    // Checks the dimension; the number itself stands for nothing.
    result.quantity.expect(wanted.value, scope.units, whole)?;
    let scene_unit = scope.units.factor(wanted.value);
    if result.quantity.plain && scene_unit != 1.0 {
        words.extend([Value::Float(scene_unit), word("mul")]);
    }
    let mut entries = toml::Table::new();
    entries.insert("postfix".into(), Value::Array(words));
    Ok(Value::Table(entries))
}

/// Whether nothing in the text has a dimension.
fn is_plain(parsed: &Expression, variable: &str, parameters: &Parameters) -> bool {
    parsed.operations.iter().all(|(operation, _)| match operation {
        Operation::Quantity { .. } => false,
        Operation::Parameter(name) if name != variable => parameters.value(name).is_none_or(|value| value.plain),
        _ => true,
    })
}

/// What is known of a plain number in a scene whose angles are not in radians: there, a number that was computed from an
/// angle is no longer unmistakable.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Angle {
    /// Not an angle.
    No,
    /// The variable, in the scene's unit of angles, or a multiple of it.
    Scene,
    /// From an inverse trigonometric function.
    Radians,
}

/// An operand.
struct Operand {
    /// Value and dimension; only the dimension counts if there are words.
    quantity: Quantity,
    /// Operations that compute it, if it depends on the variable.
    words: Option<Vec<Value>>,
    angle: Angle,
}

struct Translator<'a> {
    wanted: Wanted<'a>,
    scope: &'a Scope<'a>,
    /// The reading in plain numbers.
    plain: bool,
}

impl Translator<'_> {
    fn run(&self, parsed: &Expression) -> Result<Operand, ExpressionError> {
        let mut stack: Vec<Operand> = Vec::new();
        for (operation, range) in &parsed.operations {
            let operands = stack.split_off(first_operand(operation, stack.len()));
            stack.push(match operation {
                Operation::Parameter(name) if name == self.wanted.variable => self.variable(),
                Operation::Parameter(name) => self.parameter(name, range)?,
                _ => self.apply(operation, range, operands)?,
            });
        }
        Ok(stack.pop().expect("a parsed expression leaves one value"))
    }

    fn variable(&self) -> Operand {
        let mut words = vec![word("x")];
        let unit = self.scope.units.factor(self.wanted.argument);
        if !self.plain {
            let quantity = Quantity::derived(1.0, self.wanted.argument);
            return Operand { quantity, words: Some(words), angle: Angle::No };
        }
        if unit != 1.0 {
            words.extend([Value::Float(unit), word("div")]);
        }
        let angle = if self.wanted.argument == Dimension::ANGLE { Angle::Scene } else { Angle::No };
        Operand { quantity: Quantity::number(1.0), words: Some(words), angle }
    }

    fn parameter(&self, name: &str, range: &Range<usize>) -> Result<Operand, ExpressionError> {
        let parameters = self.scope.parameters;
        let quantity = parameter(name, range, parameters).map_err(|error| {
            let names: Vec<&str> = parameters.names().into_iter().chain([self.wanted.variable]).collect();
            ExpressionError { help: help_for(name, &names, "names"), ..error }
        })?;
        Ok(Operand { quantity, words: None, angle: Angle::No })
    }

    fn apply(
        &self,
        operation: &Operation,
        range: &Range<usize>,
        operands: Vec<Operand>,
    ) -> Result<Operand, ExpressionError> {
        let quantities: Vec<Quantity> = operands.iter().map(|operand| operand.quantity).collect();
        let known = operands.iter().all(|operand| operand.words.is_none());
        let quantity = if self.plain {
            let numbers: Vec<f64> = quantities.iter().map(|quantity| quantity.si).collect();
            Quantity::number(arithmetic(operation, &numbers))
        } else if let (Operation::Power, [base, Operand { words: Some(_), .. }]) = (operation, operands.as_slice()) {
            variable_power(base.quantity, quantities[1], range)?
        } else {
            apply(operation, range, &quantities, self.scope.units)?
        };
        let angle = self.angle(operation, range, &operands)?;
        if known {
            return Ok(Operand { quantity: finite(quantity, range)?, words: None, angle });
        }
        let mut words = Vec::new();
        for operand in operands {
            match operand.words {
                Some(more) => words.extend(more),
                None => words.push(Value::Float(operand.quantity.si)),
            }
        }
        // `min` of three is `min` of two, twice.
        let times = if let Operation::Call(_, count @ 3..) = operation { count - 1 } else { 1 };
        words.extend(std::iter::repeat_n(word(name(operation)), times));
        // The number of an operand that depends on the variable stands for nothing, but must be one.
        Ok(Operand { quantity: Quantity { si: 1.0, ..quantity }, words: Some(words), angle })
    }

    /// Follows angles through plain numbers, where the scene's angles are not in radians.
    fn angle(
        &self,
        operation: &Operation,
        range: &Range<usize>,
        operands: &[Operand],
    ) -> Result<Angle, ExpressionError> {
        let first = operands.iter().map(|operand| operand.angle).find(|angle| *angle != Angle::No);
        let first = first.unwrap_or(Angle::No);
        if !self.plain || self.scope.units.factor(Dimension::ANGLE) == 1.0 {
            return Ok(Angle::No);
        }
        Ok(match operation {
            Operation::Call(Function::Sin | Function::Cos | Function::Tan, _) => {
                if first == Angle::Scene {
                    self.refuse_plain_angle(range)?;
                }
                Angle::No
            }
            Operation::Call(Function::Asin | Function::Acos | Function::Atan | Function::Atan2, _) => Angle::Radians,
            Operation::Negate | Operation::Add | Operation::Subtract | Operation::Multiply => first,
            Operation::Call(Function::Abs | Function::Min | Function::Max, _) => first,
            Operation::Divide if operands[1].angle == Angle::No => first,
            _ => Angle::No,
        })
    }

    fn refuse_plain_angle(&self, range: &Range<usize>) -> Result<(), ExpressionError> {
        if self.scope.units.factor(Dimension::ANGLE) == 1.0 {
            return Ok(());
        }
        let label = self.scope.units.label(Dimension::ANGLE);
        let Wanted { variable, argument, value } = self.wanted;
        let unit = |dimension| self.scope.units.label(dimension);
        let example = match (value.angle != 0, value.is_number()) {
            (false, false) => format!("1 {} * sin({variable})", unit(value)),
            (false, true) => format!("sin({variable} + 0 {label})"),
            (true, _) if argument.is_number() => format!("atan({variable}) + 0 rad"),
            (true, _) => format!("atan({variable} / 1 {})", unit(argument)),
        };
        Err(ExpressionError::new(
            codes::NEEDS_UNIT,
            range.clone(),
            format!("this angle could be meant in radians or in {label}"),
        )
        .advise(format!("give the expression units, as in `{example}`: then angles convert")))
    }
}

/// A power whose exponent depends on the variable has a dimension only if it is a number.
fn variable_power(base: Quantity, exponent: Quantity, range: &Range<usize>) -> Result<Quantity, ExpressionError> {
    for (what, quantity) in [("the exponent", exponent), ("the base of a power with a variable exponent", base)] {
        if !quantity.dimension.is_number() {
            let message = format!("{what} must be a plain number, found {}", quantity.dimension);
            return Err(ExpressionError::new(codes::MIXED_DIMENSIONS, range.clone(), message));
        }
    }
    Ok(Quantity { plain: base.plain && exponent.plain, ..Quantity::number(1.0) })
}

fn word(name: &str) -> Value {
    Value::String(name.into())
}

/// What `element_api::Function` calls an operation.
fn name(operation: &Operation) -> &'static str {
    match operation {
        Operation::Negate => "neg",
        Operation::Add => "add",
        Operation::Subtract => "sub",
        Operation::Multiply => "mul",
        Operation::Divide => "div",
        Operation::Power => "pow",
        Operation::Call(function, _) => match function {
            Function::Sqrt => "sqrt",
            Function::Sin => "sin",
            Function::Cos => "cos",
            Function::Tan => "tan",
            Function::Asin => "asin",
            Function::Acos => "acos",
            Function::Atan => "atan",
            Function::Atan2 => "atan2",
            Function::Exp => "exp",
            Function::Ln => "ln",
            Function::Tanh => "tanh",
            Function::Abs => "abs",
            Function::Min => "min",
            Function::Max => "max",
        },
        Operation::Number(_) | Operation::Quantity { .. } | Operation::Parameter(_) => {
            unreachable!("operands are known, or names")
        }
    }
}
