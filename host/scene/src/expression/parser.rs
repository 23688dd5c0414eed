//! The parser of expressions; the grammar is in the documentation of the module above.

use super::super::units::{Context, is_unit, read_unit};
use super::{Expression, ExpressionError, FUNCTIONS, Operation, Vocabulary, is_function, name_at};
use odyn_diagnostics::{codes, help_for};
use std::ops::Range;

/// Deepest nesting of parentheses, signs and powers.
const DEEPEST: u32 = 64;

/// How to write here what functions of other programs and languages do.
fn of_other_programs(name: &str) -> Option<&'static str> {
    Some(match name.to_lowercase().as_str() {
        "if" | "iif" | "ifelse" | "where" | "select" | "piecewise" => {
            "pieces are joined by `min` and `max`, as in `min(t, 2)`, which stays at 2 from there on; or they are points: \
             `{ points = [[0, 0], [2, 5]], interpolation = \"linear\" }`"
        }
        "step" | "step5" | "havsin" | "haversin" | "smoothstep" => {
            "a smooth step from 0 to 5 between t = 1 and t = 2 is `5 * (1 - cos(pi * min(max(t - 1, 0), 1))) / 2`"
        }
        "sign" | "sgn" | "heaviside" | "signum" => "`tanh(x / width)` changes its sign within a width",
        "mod" | "fmod" | "floor" | "ceil" | "round" | "sawtooth" => {
            "what repeats is given by points: `{ points = [[0, 0], [2, 5]], periodic = true }`"
        }
        "pow" | "power" => "powers are written `x^y`",
        "log" | "log10" => "`ln(x)` is the natural logarithm, `ln(x) / ln(10)` the one to base 10",
        "sinh" => "write `(exp(x) - exp(-x)) / 2`",
        "cosh" => "write `(exp(x) + exp(-x)) / 2`",
        _ => return None,
    })
}

/// Parses a text.
pub(crate) fn parse_with(text: &str, vocabulary: Vocabulary<'_>) -> Result<Expression, ExpressionError> {
    let mut parser = Parser { text, position: 0, depth: 0, operations: Vec::new(), vocabulary };
    parser.sum()?;
    let rest = parser.rest();
    if !rest.is_empty() {
        return Err(parser.unexpected());
    }
    Ok(Expression { operations: parser.operations })
}

struct Parser<'a> {
    text: &'a str,
    position: usize,
    depth: u32,
    operations: Vec<(Operation, Range<usize>)>,
    vocabulary: Vocabulary<'a>,
}

impl<'a> Parser<'a> {
    fn sum(&mut self) -> Result<(), ExpressionError> {
        self.term()?;
        loop {
            let operation = match self.rest().as_bytes().first() {
                Some(b'+') => Operation::Add,
                Some(b'-') => Operation::Subtract,
                _ => return Ok(()),
            };
            let operator = self.advance(1);
            self.term()?;
            self.operations.push((operation, operator));
        }
    }

    fn term(&mut self) -> Result<(), ExpressionError> {
        self.sign()?;
        loop {
            let rest = self.rest();
            let (operation, length) = match rest.chars().next() {
                Some('*') if !rest.starts_with("**") => (Operation::Multiply, 1),
                Some('·') => (Operation::Multiply, '·'.len_utf8()),
                Some('/') => (Operation::Divide, 1),
                _ if self.at_factor() => {
                    let start = self.here();
                    self.power()?;
                    self.operations.push((Operation::Multiply, start..self.position));
                    continue;
                }
                _ => return Ok(()),
            };
            let operator = self.advance(length);
            self.sign()?;
            self.operations.push((operation, operator));
        }
    }

    /// True if a factor follows whose product with the one in front needs no sign.
    fn at_factor(&self) -> bool {
        // An unknown name is better reported as such than as a missing sign.
        let named = self.vocabulary.products && self.rest().starts_with(|c: char| c.is_alphabetic() || c == '_');
        named || self.rest().starts_with('(') || self.vocabulary.multiplies(self.text, self.here())
    }

    fn sign(&mut self) -> Result<(), ExpressionError> {
        // Every recursion of this grammar passes here.
        if self.depth == DEEPEST {
            let start = self.here();
            return Err(ExpressionError::new(
                codes::EXPRESSION_TOO_DEEP,
                start..start,
                format!("the expression is nested more than {DEEPEST} deep"),
            ));
        }
        self.depth += 1;
        let result = match self.rest().as_bytes().first() {
            Some(b'-') => {
                let operator = self.advance(1);
                self.sign().map(|()| self.operations.push((Operation::Negate, operator)))
            }
            Some(b'+') => {
                self.advance(1);
                self.sign()
            }
            _ => self.power(),
        };
        self.depth -= 1;
        result
    }

    fn power(&mut self) -> Result<(), ExpressionError> {
        self.atom()?;
        let rest = self.rest();
        let length = if rest.starts_with("**") {
            2
        } else if rest.starts_with('^') {
            1
        } else {
            return Ok(());
        };
        let operator = self.advance(length);
        self.sign()?;
        self.operations.push((Operation::Power, operator));
        Ok(())
    }

    fn atom(&mut self) -> Result<(), ExpressionError> {
        let rest = self.rest();
        match rest.chars().next() {
            Some('(') => {
                let open = self.advance(1);
                self.sum()?;
                self.close(open)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || matches!(c, '_' | '%' | '°') => self.name(),
            _ => Err(self.unexpected()),
        }
    }

    fn number(&mut self) -> Result<(), ExpressionError> {
        let rest = self.rest();
        let length = number_length(rest);
        let range = self.advance(length);
        let digits: String = rest[..length].chars().filter(|c| *c != '_').collect();
        let Ok(number) = digits.parse::<f64>() else {
            return Err(ExpressionError::new(codes::EXPRESSION_SYNTAX, range, format!("`{digits}` is not a number")));
        };
        if !number.is_finite() {
            return Err(ExpressionError::new(codes::NOT_FINITE, range, "this number is too large"));
        }
        let rest = self.rest();
        let starts_unit = rest.chars().next().is_some_and(|c| c.is_alphabetic() || matches!(c, '%' | '°' | '1'));
        if !starts_unit || self.vocabulary.multiplies(self.text, self.here()) {
            self.operations.push((Operation::Number(number), range));
            return Ok(());
        }
        self.quantity(number, range)
    }

    /// A number whose unit starts at the current position.
    fn quantity(&mut self, number: f64, range: Range<usize>) -> Result<(), ExpressionError> {
        let start = self.here();
        let name = name_at(self.text, start);
        if (self.vocabulary.is_parameter)(name) && is_unit(name) && self.vocabulary.products {
            let message = format!("`{name}` is a unit as well as a parameter");
            return Err(ExpressionError::new(codes::AMBIGUOUS, start..start + name.len(), message)
                .advise(format!("write `{} * {name}` for the parameter, or rename it", &self.text[range])));
        }
        // `2 crank.radius`: a product without its sign.
        if (self.vocabulary.is_parameter)(name) && !is_unit(name) {
            return Err(ExpressionError::new(
                codes::EXPRESSION_SYNTAX,
                range.start..start + name.len(),
                format!("there is no operator between the number and `{name}`"),
            )
            .advise(format!("write `{} * {name}`", &self.text[range])));
        }
        let unit = match read_unit(self.text, start, Context::Expression(self.vocabulary)) {
            // `2 omga t`: rather a mistyped name than a unit.
            Err(error) if self.vocabulary.products && error.code == codes::UNKNOWN_UNIT && error.help.is_none() => {
                self.operations.push((Operation::Number(number), range));
                return Ok(());
            }
            result => result?,
        };
        // `50 1/s` has a unit; in `50 1` and `50 1/x` an operator is missing.
        if self.text[start..unit.end] == *"1" {
            return Err(self.unexpected());
        }
        self.position = unit.end;
        let operation =
            Operation::Quantity { si: number * unit.factor, dimension: unit.dimension, cycles: unit.cycles };
        self.operations.push((operation, range.start..unit.end));
        Ok(())
    }

    fn name(&mut self) -> Result<(), ExpressionError> {
        let start = self.here();
        let name = name_at(self.text, start);
        if name.is_empty() {
            return Err(self.unit_alone(start).unwrap_or_else(|| self.unexpected()));
        }
        let range = self.advance(name.len());
        let Vocabulary { is_parameter, is_variable, products } = self.vocabulary;
        let is_factor = is_variable(name) || name == "pi" || products && is_parameter(name);
        if self.rest().starts_with('(') && (is_function(name) || !is_factor) {
            return self.call(name, range);
        }
        if is_variable(name) || is_parameter(name) {
            self.operations.push((Operation::Parameter(name.to_owned()), range));
            return Ok(());
        }
        if name == "pi" {
            self.operations.push((Operation::Number(std::f64::consts::PI), range));
            return Ok(());
        }
        if let Some(error) = self.unit_alone(start) {
            return Err(error);
        }
        // Whether it is an unknown parameter is known only to evaluation, which also knows their names.
        self.operations.push((Operation::Parameter(name.to_owned()), range));
        Ok(())
    }

    /// The error of a unit without a number, if a unit starts at `start`.
    fn unit_alone(&self, start: usize) -> Option<ExpressionError> {
        let unit = read_unit(self.text, start, Context::Expression(self.vocabulary)).ok()?;
        let written = &self.text[start..unit.end];
        let error = ExpressionError::new(
            codes::EXPRESSION_SYNTAX,
            start..unit.end,
            format!("the unit `{written}` stands without a number"),
        );
        Some(error.advise(format!("write `1 {written}`")))
    }

    fn call(&mut self, name: &str, range: Range<usize>) -> Result<(), ExpressionError> {
        let Some((_, function, counts)) = FUNCTIONS.iter().find(|(known, ..)| *known == name) else {
            let names = FUNCTIONS.map(|(known, ..)| known);
            // `sind`: the function near to it takes radians.
            let of_degrees = name.strip_suffix('d').filter(|stem| ["sin", "cos", "tan"].contains(stem));
            let help = of_degrees.map(|stem| format!("degrees have a unit: `{stem}(30 deg)`, `{stem}(360 deg/s * t)`; of a plain number, `{stem}(x * pi / 180)`"));
            let help = help.or_else(|| of_other_programs(name).map(str::to_owned));
            return Err(ExpressionError {
                help: help.or_else(|| help_for(name, &names, "functions")),
                ..ExpressionError::new(codes::EXPRESSION_SYNTAX, range, format!("unknown function `{name}`"))
            });
        };
        let open = self.advance(1);
        let mut count = 0;
        loop {
            self.sum()?;
            count += 1;
            if !self.rest().starts_with(',') {
                break;
            }
            self.advance(1);
        }
        self.close(open)?;
        if !counts.contains(&count) {
            let needs = match counts.start {
                1 => "one argument",
                _ if counts.end == usize::MAX => "at least two arguments",
                _ => "two arguments",
            };
            return Err(ExpressionError::new(
                codes::EXPRESSION_SYNTAX,
                range,
                format!("`{name}` takes {needs}, found {count}"),
            ));
        }
        self.operations.push((Operation::Call(*function, count), range));
        Ok(())
    }

    fn close(&mut self, open: Range<usize>) -> Result<(), ExpressionError> {
        if self.rest().starts_with(')') {
            self.advance(1);
            return Ok(());
        }
        if self.rest().is_empty() {
            return Err(ExpressionError::new(codes::EXPRESSION_SYNTAX, open, "this parenthesis is not closed"));
        }
        Err(self.unexpected())
    }

    /// The text from the next character that is not blank.
    fn rest(&self) -> &'a str {
        self.text[self.position..].trim_start()
    }

    /// Offset of the next character that is not blank.
    fn here(&self) -> usize {
        self.text.len() - self.rest().len()
    }

    /// Goes over the next `length` bytes behind blanks and returns their range.
    fn advance(&mut self, length: usize) -> Range<usize> {
        let start = self.here();
        self.position = (start + length).min(self.text.len());
        start..self.position
    }

    fn unexpected(&self) -> ExpressionError {
        let rest = self.rest();
        let start = self.text.len() - rest.len();
        let Some(found) = rest.chars().next() else {
            return ExpressionError::new(
                codes::EXPRESSION_SYNTAX,
                start..start,
                if start == 0 || self.text.trim().is_empty() {
                    "the expression is empty"
                } else {
                    "the expression ends here, a value is missing"
                },
            );
        };
        let range = start..start + found.len_utf8();
        let message = match self.operations.is_empty() || "*/^,)".contains(found) {
            true => format!("`{found}` cannot stand here"),
            false => format!("`{found}` cannot stand here, is an operator missing?"),
        };
        let error = ExpressionError::new(codes::EXPRESSION_SYNTAX, range, message);
        match self.decimal_comma(start) {
            Some(number) => {
                error.advise(format!("decimals are behind a point, `{number}`, and thousands have no comma"))
            }
            None => error,
        }
    }

    /// The number with a point where a comma at `at` stands between digits, and none of its parts has a point.
    fn decimal_comma(&self, at: usize) -> Option<String> {
        let (front, behind) = (&self.text[..at], self.text[at..].strip_prefix(',')?);
        let before = front.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
        let whole = &front[before.len()..];
        let decimals = &behind[..behind.len() - behind.trim_start_matches(|c: char| c.is_ascii_digit()).len()];
        let begins = whole.starts_with(|c: char| c.is_ascii_digit());
        let is_number = begins && !decimals.is_empty() && !before.ends_with(|c: char| c == '.' || c.is_alphanumeric());
        is_number.then(|| format!("{whole}.{decimals}"))
    }
}

/// Length of the number a text starts with: digits, a point, digits, an exponent with digits.
fn number_length(text: &str) -> usize {
    let digits =
        |from: usize| -> usize { text[from..].bytes().take_while(|b| b.is_ascii_digit() || *b == b'_').count() };
    let mut length = digits(0);
    if text[length..].starts_with('.') {
        length += 1 + digits(length + 1);
    }
    if text[length..].starts_with(['e', 'E']) {
        let signed = text[length + 1..].starts_with(['+', '-']);
        let start = length + 1 + usize::from(signed);
        let exponent = digits(start);
        if exponent > 0 {
            length = start + exponent;
        }
    }
    length
}
