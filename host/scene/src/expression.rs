//! Expressions as text: `2*(crank.radius + 1 mm)`, parsed to a list of operations.
//!
//! ```text
//! sum     = term { ( "+" | "-" ) term }
//! term    = sign { ( "*" | "·" | "/" ) sign | power }    the latter: a product without its sign
//! sign    = ( "-" | "+" ) sign | power
//! power   = atom [ ( "^" | "**" ) sign ]                 so -2^2 = -4 and 2^3^2 = 2^9
//! atom    = number [ unit ] | name [ "(" sum { "," sum } ")" ] | "(" sum ")"
//! ```
//! A number directly followed by a unit is one quantity: `3 mm^2` is an area of 3 mm^2. The sign of a product may
//! be left out in front of a parenthesis, a function, `pi` and a variable: `20 sin(2 pi t)`. Its precedence is that
//! of `*`, so `1/2 t` is half of `t`. In functions and formulas it may also be left out in front of a parameter;
//! elsewhere `2 crank.radius` is rather a mistake. The operations are in the order of evaluation (operands first), so
//! evaluation needs a stack and no recursion; parsing recurses to a limited depth.

mod parser;

pub(super) use parser::parse_with;

use super::dimension::Dimension;
use super::units::{UnitError, is_unit};
use odyn_diagnostics::Code;
use std::ops::Range;

/// A parsed expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Expression {
    /// Operations, operands first, each with its byte range in the text.
    pub operations: Vec<(Operation, Range<usize>)>,
}

impl Expression {
    /// Names of the parameters it refers to, as often as they occur.
    pub(super) fn parameters(&self) -> impl Iterator<Item = &str> {
        self.operations.iter().filter_map(|(operation, _)| match operation {
            Operation::Parameter(name) => Some(name.as_str()),
            _ => None,
        })
    }
}

/// One operation on the stack of evaluation.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Operation {
    /// Pushes a plain number.
    Number(f64),
    /// Pushes a number with a unit, in SI; `cycles` as in [`super::units::Unit`].
    Quantity {
        /// Value in SI.
        si: f64,
        /// Its dimension.
        dimension: Dimension,
        /// Counted in cycles.
        cycles: bool,
    },
    /// Pushes the value of a parameter.
    Parameter(String),
    /// Changes the sign of the top.
    Negate,
    /// Adds the two topmost values.
    Add,
    /// Subtracts the top from the value below.
    Subtract,
    /// Multiplies the two topmost values.
    Multiply,
    /// Divides the value below by the top.
    Divide,
    /// Raises the value below to the top.
    Power,
    /// Applies a function to that many topmost values.
    Call(Function, usize),
}

/// Functions of expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    Sqrt,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Exp,
    Ln,
    Tanh,
    Abs,
    Min,
    Max,
}

/// Functions by name, with the number of arguments allowed.
pub(super) const FUNCTIONS: [(&str, Function, Range<usize>); 14] = [
    ("sqrt", Function::Sqrt, 1..2),
    ("sin", Function::Sin, 1..2),
    ("cos", Function::Cos, 1..2),
    ("tan", Function::Tan, 1..2),
    ("asin", Function::Asin, 1..2),
    ("acos", Function::Acos, 1..2),
    ("atan", Function::Atan, 1..2),
    ("atan2", Function::Atan2, 2..3),
    ("exp", Function::Exp, 1..2),
    ("ln", Function::Ln, 1..2),
    ("tanh", Function::Tanh, 1..2),
    ("abs", Function::Abs, 1..2),
    ("min", Function::Min, 2..usize::MAX),
    ("max", Function::Max, 2..usize::MAX),
];

/// What is wrong with an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ExpressionError {
    /// One of the codes ODY02xx.
    pub code: Code,
    /// One sentence.
    pub message: String,
    /// Byte range in the text.
    pub range: Range<usize>,
    /// Remark at the range; may be empty.
    pub label: String,
    /// Advice.
    pub help: Option<String>,
    /// True if the cause has a diagnostic of its own, so that this one would only repeat it.
    pub reported: bool,
}

impl ExpressionError {
    /// An error without label and advice.
    pub(super) fn new(code: Code, range: Range<usize>, message: impl Into<String>) -> Self {
        ExpressionError { code, message: message.into(), range, label: String::new(), help: None, reported: false }
    }

    /// The same error with advice.
    pub(super) fn advise(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl From<UnitError> for ExpressionError {
    fn from(error: UnitError) -> Self {
        ExpressionError {
            code: error.code,
            message: error.message,
            range: error.range,
            label: String::new(),
            help: error.help,
            reported: false,
        }
    }
}

/// What names mean to the parser. Unknown ones are reported by evaluation.
#[derive(Clone, Copy)]
pub(super) struct Vocabulary<'a> {
    /// Parameters. Behind a number, a unit of the same name goes first.
    pub is_parameter: &'a dyn Fn(&str) -> bool,
    /// Variables, which go before everything else of the same name. They are parsed as parameters.
    pub is_variable: &'a dyn Fn(&str) -> bool,
    /// Whether the sign of a product may be left out in front of a parameter.
    pub products: bool,
}

impl Vocabulary<'_> {
    /// Whether the word at `start` cannot continue a unit in front of it, but multiplies it.
    pub(super) fn multiplies(&self, text: &str, start: usize) -> bool {
        let name = name_at(text, start);
        let called = text[start + name.len()..].trim_start().starts_with('(');
        (self.is_variable)(name)
            || name == "pi"
            || called && is_function(name)
            || self.products && (self.is_parameter)(name) && !is_unit(name)
    }
}

/// Parses a text without variables; `is_parameter` says which names are parameters.
pub(super) fn parse(text: &str, is_parameter: &dyn Fn(&str) -> bool) -> Result<Expression, ExpressionError> {
    parse_with(text, Vocabulary { is_parameter, is_variable: &|_| false, products: false })
}

/// The dotted name that starts at `start`: letters, digits and `_`, joined by points.
fn name_at(text: &str, start: usize) -> &str {
    let rest = &text[start..];
    let end =
        rest.find(|c: char| !(c.is_alphabetic() || c.is_ascii_digit() || matches!(c, '_' | '.'))).unwrap_or(rest.len());
    rest[..end].trim_end_matches('.')
}

/// True if a text can be the name of a parameter (without points) in an expression.
pub(super) fn is_parameter_name(name: &str) -> bool {
    let starts = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    starts && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// True if the dotted name has a meaning of its own in expressions.
pub(super) fn is_reserved(name: &str) -> bool {
    name == "pi" || is_function(name)
}

fn is_function(name: &str) -> bool {
    FUNCTIONS.iter().any(|(known, ..)| *known == name)
}
