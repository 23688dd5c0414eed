//! [`Function`]: a function of one variable that a scene gives: a number, an expression, or points.

use crate::params::{ParamError, ParamKind, ParamType};
use crate::scalar::Scalar;
use crate::slope::Dual;
use crate::table::{Interpolation, Outside, Table};

/// A function of one variable, evaluated with any [`Scalar`], so that its derivatives are exact.
///
/// In a scene it is a number (`5`, `"3 N"`), an expression in the variable that [`crate::params::ParamSpec::variable`]
/// names (`"20 sin(2 pi t)"`), a list of points (`[[0, 0], [1, 5]]`, end values held outside), or
/// `{ points = [...], interpolation = "linear", periodic = true }` with an [`Interpolation`]. Where the scene names none,
/// the host chooses `spline` for joints, whose equations are differentiated twice, and `monotone` for all others; so does
/// this type, read without a host, except that it knows of no joints. The host turns all of them into SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    form: Form,
}

#[derive(Debug, Clone, PartialEq)]
enum Form {
    Constant(f64),
    /// Operations in the order of evaluation (reverse Polish notation).
    Expression(Vec<Step>),
    Table(Table, Interpolation),
}

/// One operation on a stack of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Number(f64),
    Variable,
    Unary(Unary),
    Binary(Binary),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Unary {
    Neg,
    Sqrt,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Exp,
    Ln,
    Tanh,
    Abs,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Pow,
    Atan2,
    Min,
    Max,
}

const UNARY: [(&str, Unary); 12] = [
    ("neg", Unary::Neg),
    ("sqrt", Unary::Sqrt),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("asin", Unary::Asin),
    ("acos", Unary::Acos),
    ("atan", Unary::Atan),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("tanh", Unary::Tanh),
    ("abs", Unary::Abs),
];

const BINARY: [(&str, Binary); 8] = [
    ("add", Binary::Add),
    ("sub", Binary::Sub),
    ("mul", Binary::Mul),
    ("div", Binary::Div),
    ("pow", Binary::Pow),
    ("atan2", Binary::Atan2),
    ("min", Binary::Min),
    ("max", Binary::Max),
];

impl Function {
    /// The same value everywhere.
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self { form: Form::Constant(value) }
    }

    /// The natural cubic spline through points, its end values held outside, or the periodic one.
    ///
    /// # Errors
    /// As [`Table::clamped`] and [`Table::periodic`].
    pub fn through(points: &[[f64; 2]], periodic: bool) -> Result<Self, ParamError> {
        let outside = if periodic { Outside::Periodic } else { Outside::Clamped };
        Self::interpolated(points, Interpolation::Spline, outside)
    }

    /// The function that [`Table::through`] makes of points.
    ///
    /// # Errors
    /// As [`Table::through`].
    pub fn interpolated(
        points: &[[f64; 2]],
        interpolation: Interpolation,
        outside: Outside,
    ) -> Result<Self, ParamError> {
        Ok(Self { form: Form::Table(Table::through(points, interpolation, outside)?, interpolation) })
    }

    /// Operations in reverse Polish notation: numbers, the word `x` for the variable, and the words `add`, `sub`, `mul`,
    /// `div`, `pow`, `atan2`, `min`, `max`, `neg`, `sqrt`, `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `exp`, `ln`,
    /// `tanh`, `abs`.
    ///
    /// # Errors
    /// Unknown words, too few operands, or more than one result.
    pub fn postfix(words: &[toml::Value]) -> Result<Self, ParamError> {
        let mut steps = Vec::with_capacity(words.len());
        let mut depth = 0_usize;
        for word in words {
            let step = step(word).ok_or_else(|| ParamError::new("", format!("{word} is no operation")))?;
            let (takes, gives) = match step {
                Step::Number(_) | Step::Variable => (0, 1),
                Step::Unary(_) => (1, 1),
                Step::Binary(_) => (2, 1),
            };
            if depth < takes {
                return Err(ParamError::new("", format!("{word} lacks operands")));
            }
            depth = depth - takes + gives;
            steps.push(step);
        }
        if depth != 1 {
            return Err(ParamError::new("", format!("the operations leave {depth} results")));
        }
        Ok(Self { form: Form::Expression(steps) })
    }

    /// The value at `x`. Real powers with an exponent that depends on `x` are exp(b ln a).
    #[must_use]
    pub fn at<S: Scalar>(&self, x: S) -> S {
        match &self.form {
            Form::Constant(value) => S::from(*value),
            Form::Table(table, _) => x.lookup(table),
            Form::Expression(steps) => run(steps, x),
        }
    }

    /// The derivative at `x`, for equations that contain it (the tangent of a profile). Where it jumps, the one that [`Function::at`] has
    /// there. Contract 1.2.
    #[must_use]
    pub fn slope<S: Scalar>(&self, x: S) -> S {
        self.at(Dual::variable(x)).slope
    }

    /// Whether it is the same everywhere as far as can be seen without evaluating.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        match &self.form {
            Form::Constant(_) => true,
            Form::Table(..) => false,
            Form::Expression(steps) => !steps.contains(&Step::Variable),
        }
    }
}

fn step(word: &toml::Value) -> Option<Step> {
    if let Some(number) = f64::read_value(word) {
        return Some(Step::Number(number));
    }
    let word = word.as_str()?;
    if word == "x" {
        return Some(Step::Variable);
    }
    let unary = UNARY.iter().find(|(name, _)| *name == word).map(|(_, operation)| Step::Unary(*operation));
    unary.or_else(|| BINARY.iter().find(|(name, _)| *name == word).map(|(_, operation)| Step::Binary(*operation)))
}

/// A value on the stack; constants are kept apart, for exponents.
#[derive(Clone, Copy)]
struct Entry<S> {
    value: S,
    constant: Option<f64>,
}

/// Deepest stack that needs no allocation.
const DEPTH: usize = 32;

fn run<S: Scalar>(steps: &[Step], x: S) -> S {
    let zero = Entry { value: S::zero(), constant: Some(0.0) };
    let mut short = [zero; DEPTH];
    let mut long = if steps.len() > DEPTH { vec![zero; steps.len()] } else { Vec::new() };
    let stack: &mut [Entry<S>] = if steps.len() > DEPTH { &mut long } else { &mut short };
    let mut top = 0;
    for step in steps {
        match *step {
            Step::Number(number) => {
                stack[top] = Entry { value: S::from(number), constant: Some(number) };
                top += 1;
            }
            Step::Variable => {
                stack[top] = Entry { value: x, constant: None };
                top += 1;
            }
            Step::Unary(operation) => {
                let a = stack[top - 1];
                let constant = a.constant.map(|a| unary(operation, a));
                stack[top - 1] = Entry { value: constant.map_or_else(|| unary(operation, a.value), S::from), constant };
            }
            Step::Binary(operation) => {
                top -= 1;
                let (a, b) = (stack[top - 1], stack[top]);
                let constant = a.constant.zip(b.constant).map(|(a, b)| binary(operation, a, b, Some(b)));
                let value = constant.map_or_else(|| binary(operation, a.value, b.value, b.constant), S::from);
                stack[top - 1] = Entry { value, constant };
            }
        }
    }
    stack[0].value
}

fn unary<S: Scalar>(operation: Unary, a: S) -> S {
    match operation {
        Unary::Neg => -a,
        Unary::Sqrt => a.sqrt(),
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Tan => a.tan(),
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Exp => a.exp(),
        Unary::Ln => a.ln(),
        Unary::Tanh => a.tanh(),
        Unary::Abs => a.abs(),
    }
}

fn binary<S: Scalar>(operation: Binary, a: S, b: S, exponent: Option<f64>) -> S {
    match operation {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Atan2 => a.atan2(b),
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        Binary::Pow => match exponent {
            Some(n) if n == n.trunc() && n.abs() <= 64.0 => a.powi(n as i32),
            Some(e) => a.powf(e),
            None => (b * a.ln()).exp(),
        },
    }
}

impl ParamType for Function {
    const KIND: ParamKind = ParamKind::Function;

    fn read_value(value: &toml::Value) -> Option<Self> {
        Self::read_named(value, "").ok()
    }

    fn read_named(value: &toml::Value, name: &str) -> Result<Self, ParamError> {
        let about = |error: ParamError| ParamError::new(name, error.message);
        if let Some(number) = f64::read_value(value) {
            return Ok(Self::constant(number));
        }
        if let Some(points) = Vec::<[f64; 2]>::read_value(value) {
            return Self::interpolated(&points, Interpolation::default(), Outside::Clamped).map_err(about);
        }
        let wrong = || {
            ParamError::new(
                name,
                "must be a number, a list of [argument, value] pairs, `{ points = [...], interpolation = \"linear\", periodic = true }`, or an expression",
            )
        };
        let table = value.as_table().ok_or_else(wrong)?;
        if let Some(words) = table.get("postfix").and_then(toml::Value::as_array) {
            return Self::postfix(words).map_err(about);
        }
        let points = table.get("points").and_then(Vec::<[f64; 2]>::read_value).ok_or_else(wrong)?;
        let interpolation = Interpolation::of(table).map_err(about)?.unwrap_or_default();
        let periodic = table.get("periodic").and_then(toml::Value::as_bool).unwrap_or(false);
        let outside = if periodic { Outside::Periodic } else { Outside::Clamped };
        Self::interpolated(&points, interpolation, outside).map_err(about)
    }

    fn write(&self) -> toml::Value {
        match &self.form {
            Form::Constant(value) => value.write(),
            Form::Table(table, interpolation) => {
                // Steps whose last value is held have a piece behind the last point.
                let held_steps = *interpolation == Interpolation::Steps && table.outside == Outside::Clamped;
                let count = table.pieces.len() + usize::from(!held_steps);
                let value = |k: usize| match table.pieces.get(k) {
                    Some(piece) => piece[0],
                    None => table.end(),
                };
                let points: Vec<[f64; 2]> = (0..count).map(|k| [table.breaks[k], value(k)]).collect();
                let mut entry = toml::Table::new();
                entry.insert("points".into(), points.write());
                entry.insert("interpolation".into(), interpolation.name().into());
                entry.insert("periodic".into(), (table.outside == Outside::Periodic).write());
                toml::Value::Table(entry)
            }
            Form::Expression(steps) => {
                let words = steps.iter().map(|step| match step {
                    Step::Number(number) => toml::Value::Float(*number),
                    Step::Variable => toml::Value::String("x".into()),
                    Step::Unary(operation) => word(&UNARY, *operation),
                    Step::Binary(operation) => word(&BINARY, *operation),
                });
                let mut entry = toml::Table::new();
                entry.insert("postfix".into(), toml::Value::Array(words.collect()));
                toml::Value::Table(entry)
            }
        }
    }
}

fn word<T: PartialEq + Copy>(list: &[(&str, T)], operation: T) -> toml::Value {
    let name = list.iter().find(|(_, known)| *known == operation).map_or("", |(name, _)| *name);
    toml::Value::String(name.into())
}

impl From<f64> for Function {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}
