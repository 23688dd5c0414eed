//! Quantities: the value of an expression with its dimension, and what is expected of it.

use super::dimension::Dimension;
use super::expression::{Expression, ExpressionError, Function, Operation};
use super::unit_system::UnitSystem;
use odyn_diagnostics::{codes, help_for};
use std::ops::Range;

/// A value in SI with its dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Value in SI.
    pub si: f64,
    /// Its dimension.
    pub dimension: Dimension,
    /// True for a number to which no unit has contributed, so that it may still be given one: `0.5`, `pi/2`,
    /// but not `2 mm / 1 mm`.
    pub plain: bool,
    /// True if it was written in `Hz`: cycles per time, which an angular velocity must not take for radians; also of such a
    /// quantity times another one, `1 Hz * t`. A plain number beside it may be the `2 pi` of a cycle.
    pub cycles: bool,
}

impl Quantity {
    /// A plain number.
    pub fn number(value: f64) -> Self {
        Quantity { si: value, dimension: Dimension::DIMENSIONLESS, plain: true, cycles: false }
    }

    /// A value with a dimension to which a unit has contributed.
    #[must_use]
    pub fn derived(si: f64, dimension: Dimension) -> Self {
        Quantity { si, dimension, plain: false, cycles: false }
    }

    /// The value in SI where a quantity of dimension `expected` is asked for.
    ///
    /// A plain number is taken in scene units of that dimension.
    ///
    /// # Errors
    /// The dimension is another one; `Hz` where an angular velocity is expected.
    pub(super) fn expect(
        self,
        expected: Dimension,
        units: &UnitSystem,
        range: Range<usize>,
    ) -> Result<f64, ExpressionError> {
        if self.plain {
            return Ok(units.to_si(self.si, expected));
        }
        if !self.dimension.compatible(expected) {
            let mut error =
                ExpressionError::new(codes::DIMENSION, range, format!("expected {expected}, found {}", self.dimension));
            error.label = format!("this is {}", self.dimension);
            return Err(error.advise(advice(expected, units)));
        }
        if self.cycles && self.dimension.angle == 0 && expected.angle != 0 {
            return Err(ExpressionError::new(
                codes::NEEDS_UNIT,
                range,
                format!("`Hz` counts cycles, but {expected} is expected"),
            )
            .advise("write `turn/s` for cycles, `rad/s` for radians"));
        }
        Ok(self.si)
    }
}

/// How to write a quantity of the expected dimension.
pub(super) fn advice(expected: Dimension, units: &UnitSystem) -> String {
    if expected == Dimension::DIMENSIONLESS {
        return "write a number without a unit".to_owned();
    }
    let label = match expected {
        Dimension::TORQUE => units.torque_label(),
        _ => units.label(expected),
    };
    format!("plain numbers are taken in {label} here")
}

/// Stands for a parameter whose definition has been reported as wrong. Evaluation stops at it without a
/// second report.
pub(super) const UNUSABLE: Quantity =
    Quantity { si: f64::NAN, dimension: Dimension::DIMENSIONLESS, plain: true, cycles: false };

/// What the names of an expression stand for.
pub(super) trait Names {
    /// The value of a parameter; `None` if it doesn't exist.
    fn value(&self, name: &str) -> Option<Quantity>;
    /// All names, for advice.
    fn names(&self) -> Vec<&str>;
}

/// Computes an expression.
///
/// # Errors
/// Unknown parameters, dimensions that don't fit, no finite value.
pub(super) fn evaluate(
    expression: &Expression,
    names: &dyn Names,
    units: &UnitSystem,
) -> Result<Quantity, ExpressionError> {
    let mut stack: Vec<Quantity> = Vec::new();
    for (operation, range) in &expression.operations {
        let operands = stack.split_off(first_operand(operation, stack.len()));
        let result = match operation {
            Operation::Parameter(name) => parameter(name, range, names)?,
            _ => apply(operation, range, &operands, units)?,
        };
        stack.push(finite(result, range)?);
    }
    Ok(stack.pop().expect("a parsed expression leaves one value"))
}

/// Where the operands of an operation begin on a stack of that many values.
pub(super) fn first_operand(operation: &Operation, values: usize) -> usize {
    let operands = match operation {
        Operation::Number(_) | Operation::Quantity { .. } | Operation::Parameter(_) => 0,
        Operation::Negate => 1,
        Operation::Call(_, count) => *count,
        _ => 2,
    };
    values.checked_sub(operands).expect("the parser puts operands first")
}

/// The quantity, unless it is no finite number.
pub(super) fn finite(quantity: Quantity, range: &Range<usize>) -> Result<Quantity, ExpressionError> {
    match quantity.si.is_finite() {
        true => Ok(quantity),
        false => Err(ExpressionError::new(codes::NO_VALUE, range.clone(), "the result of this is not a finite number")),
    }
}

/// One operation on its operands, which are not looked up here.
pub(super) fn apply(
    operation: &Operation,
    range: &Range<usize>,
    operands: &[Quantity],
    units: &UnitSystem,
) -> Result<Quantity, ExpressionError> {
    let calculation = Calculation { range, units };
    match (operation, operands) {
        (Operation::Number(value), []) => Ok(Quantity::number(*value)),
        (Operation::Quantity { si, dimension, cycles }, []) => {
            Ok(Quantity { cycles: *cycles, ..Quantity::derived(*si, *dimension) })
        }
        (Operation::Negate, [a]) => Ok(Quantity { si: -a.si, ..*a }),
        (Operation::Add, [a, b]) => calculation.like("add", *a, *b, a.si + b.si),
        (Operation::Subtract, [a, b]) => calculation.like("subtract", *a, *b, a.si - b.si),
        (Operation::Multiply, [a, b]) => {
            let product = calculation.scaled(*a, *b, a.si * b.si, a.dimension.times(b.dimension))?;
            Ok(Quantity { cycles: a.cycles && !b.plain || b.cycles && !a.plain, ..product })
        }
        (Operation::Divide, [a, b]) => {
            let quotient = calculation.scaled(*a, *b, a.si / b.si, a.dimension.over(b.dimension))?;
            Ok(Quantity { cycles: a.cycles && !b.plain && !b.cycles, ..quotient })
        }
        (Operation::Power, [a, b]) => calculation.power(*a, *b),
        (Operation::Call(function, _), arguments) => calculation.call(*function, arguments),
        _ => unreachable!("names are looked up by the caller, and the operands are those of the operation"),
    }
}

/// The value of a parameter.
pub(super) fn parameter(name: &str, range: &Range<usize>, names: &dyn Names) -> Result<Quantity, ExpressionError> {
    let error = |message: String| ExpressionError::new(codes::UNKNOWN_PARAMETER, range.clone(), message);
    match names.value(name) {
        Some(value) if value.si.is_nan() => {
            Err(ExpressionError { reported: true, ..error(format!("parameter `{name}` has no value")) })
        }
        Some(value) => Ok(value),
        None => Err(ExpressionError {
            help: help_for(name, &names.names(), "parameters"),
            ..error(format!("unknown parameter `{name}`"))
        }),
    }
}

/// One operation at its place in the text.
struct Calculation<'a> {
    range: &'a Range<usize>,
    units: &'a UnitSystem,
}

impl Calculation<'_> {
    /// The result `si` of an operation that needs two quantities of the same dimension.
    fn like(&self, verb: &str, a: Quantity, b: Quantity, si: f64) -> Result<Quantity, ExpressionError> {
        let (number, other) = if a.plain { (a, b) } else { (b, a) };
        if !a.dimension.compatible(b.dimension) {
            let message = format!("cannot {verb} {} and {}", a.dimension, b.dimension);
            let error = ExpressionError::new(codes::MIXED_DIMENSIONS, self.range.clone(), message);
            return Err(if number.plain {
                ExpressionError {
                    code: codes::NEEDS_UNIT,
                    ..error.advise(format!(
                        "give the number a unit, for example `1 {}`",
                        self.units.label(other.dimension)
                    ))
                }
            } else {
                error
            });
        }
        // Compatible with a plain number, yet not a number: an angle. Its plain number is unmistakable
        // only where angles are in rad.
        if number.plain && other.dimension != Dimension::DIMENSIONLESS {
            self.plain_angle()?;
        }
        let dimension = if a.dimension.angle == 0 { b.dimension } else { a.dimension };
        Ok(Quantity { si, dimension, plain: a.plain && b.plain, cycles: a.cycles || b.cycles })
    }

    fn scaled(
        &self,
        a: Quantity,
        b: Quantity,
        si: f64,
        dimension: Option<Dimension>,
    ) -> Result<Quantity, ExpressionError> {
        let dimension = dimension.ok_or_else(|| self.too_high())?;
        Ok(Quantity { plain: a.plain && b.plain, ..Quantity::derived(si, dimension) })
    }

    fn power(&self, base: Quantity, exponent: Quantity) -> Result<Quantity, ExpressionError> {
        if exponent.dimension != Dimension::DIMENSIONLESS {
            return Err(self.mixed(format!("the exponent must be a plain number, found {}", exponent.dimension)));
        }
        let dimension = base.dimension.power(exponent.si).ok_or_else(|| {
            self.mixed(format!("{} to the power {} has no dimension in whole numbers", base.dimension, exponent.si))
        })?;
        Ok(Quantity { plain: base.plain && exponent.plain, ..Quantity::derived(base.si.powf(exponent.si), dimension) })
    }

    fn call(&self, function: Function, arguments: &[Quantity]) -> Result<Quantity, ExpressionError> {
        let angle = |si: f64| Quantity::derived(si, Dimension::ANGLE);
        let a = arguments[0];
        match function {
            Function::Sqrt => self.power(a, Quantity::number(0.5)),
            Function::Sin => Ok(Quantity::number(self.angle(a)?.sin())),
            Function::Cos => Ok(Quantity::number(self.angle(a)?.cos())),
            Function::Tan => Ok(Quantity::number(self.angle(a)?.tan())),
            Function::Asin => Ok(angle(self.value(a)?.asin())),
            Function::Acos => Ok(angle(self.value(a)?.acos())),
            Function::Atan => Ok(angle(self.value(a)?.atan())),
            Function::Atan2 => {
                let b = arguments[1];
                self.like("combine", a, b, 0.0)?;
                Ok(angle(a.si.atan2(b.si)))
            }
            Function::Exp => Ok(Quantity::number(self.value(a)?.exp())),
            Function::Ln => Ok(Quantity::number(self.value(a)?.ln())),
            Function::Tanh => Ok(Quantity::number(self.value(a)?.tanh())),
            Function::Abs => Ok(Quantity { si: a.si.abs(), ..a }),
            Function::Min => self.fold(arguments, f64::min),
            Function::Max => self.fold(arguments, f64::max),
        }
    }

    fn fold(&self, arguments: &[Quantity], choose: fn(f64, f64) -> f64) -> Result<Quantity, ExpressionError> {
        let mut result = arguments[0];
        for next in &arguments[1..] {
            result = self.like("compare", result, *next, choose(result.si, next.si))?;
        }
        Ok(result)
    }

    /// The argument of a trigonometric function, rad.
    fn angle(&self, a: Quantity) -> Result<f64, ExpressionError> {
        if !a.dimension.is_number() || !matches!(a.dimension.angle, 0 | 1) {
            let error = self.mixed(format!("expected an angle, found {}", a.dimension));
            // Of a time, an angular velocity is missing: `sin(360 t)`.
            let rate = Dimension::ANGLE.over(a.dimension).filter(|_| a.dimension.exponents().iter().all(|e| *e >= 0));
            let Some(rate) = rate else { return Err(error) };
            let label = self.units.label(rate);
            return Err(error.advise(format!("give the number in front of it a unit: `360 {label}` for `360`")));
        }
        if a.cycles && a.dimension.angle == 0 {
            let message = "`Hz` counts cycles, but an angle is expected";
            return Err(ExpressionError::new(codes::NEEDS_UNIT, self.range.clone(), message).advise(
                "write `2 pi` in front: `sin(2 pi * 50 Hz * t)`; or `turn/s` for cycles, `rad/s` for radians",
            ));
        }
        if a.plain {
            self.plain_angle()?;
        }
        Ok(a.si)
    }

    /// The argument of a function of plain numbers.
    fn value(&self, a: Quantity) -> Result<f64, ExpressionError> {
        if a.dimension.is_number() {
            return Ok(a.si);
        }
        Err(self.mixed(format!("expected a plain number, found {}", a.dimension)))
    }

    /// Refuses a plain number in the place of an angle unless the scene's angles are in rad.
    fn plain_angle(&self) -> Result<(), ExpressionError> {
        if self.units.factor(Dimension::ANGLE) == 1.0 {
            return Ok(());
        }
        Err(ExpressionError::new(
            codes::NEEDS_UNIT,
            self.range.clone(),
            "this plain number could be radians or scene units",
        )
        .advise(format!("give it a unit: `1 rad` or `1 {}`", self.units.label(Dimension::ANGLE))))
    }

    fn mixed(&self, message: String) -> ExpressionError {
        ExpressionError::new(codes::MIXED_DIMENSIONS, self.range.clone(), message)
    }

    fn too_high(&self) -> ExpressionError {
        self.mixed("the dimension of this has too high powers".to_owned())
    }
}
