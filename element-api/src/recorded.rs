//! [`Recorded`]: the scalar that writes equations down instead of computing them.

use std::cell::RefCell;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::recording::{Input, Op, Output, Recording, Role};
use crate::scalar::Scalar;
use crate::table::Table;

thread_local! {
    /// The tape of the recording under way on this thread.
    static TAPE: RefCell<Recording> = RefCell::new(Recording::default());
}

/// A number in a recording: either a constant known now, or the result of an operation on the tape.
///
/// Operations between constants are carried out at once; everything else is written down as it stands, also `x + 0` and
/// `1 x`, so that the list of operations does not depend on the values of an instance's parameters. The host simplifies.
///
/// Comparison with `==` (which linear algebra libraries ask for) panics where the value of one is not known yet: it can't be used
/// to branch on the motion.
#[derive(Debug, Clone, Copy)]
pub enum Recorded {
    /// A constant.
    Constant(f64),
    /// Operation number on the tape.
    Node(u32),
}

/// Runs `equations` with an empty tape and gives back what it recorded.
///
/// The closure returns the results with their meaning. Recordings don't nest.
pub fn record(equations: impl FnOnce() -> Vec<(Role, Recorded)>) -> Recording {
    // A panic in an earlier recording may have left a tape behind.
    TAPE.with(|tape| *tape.borrow_mut() = Recording::default());
    let results = equations();
    let outputs = results.into_iter().map(|(role, value)| Output { role, node: value.node() }).collect();
    let mut recording = TAPE.with(|tape| std::mem::take(&mut *tape.borrow_mut()));
    recording.outputs = outputs;
    recording
}

/// A number the host provides.
#[must_use]
pub fn input(input: Input) -> Recorded {
    push(Op::Input(input))
}

fn push(op: Op) -> Recorded {
    TAPE.with(|tape| {
        let ops = &mut tape.borrow_mut().ops;
        ops.push(op.encode());
        Recorded::Node(ops.len() as u32 - 1)
    })
}

fn constant(value: f64) -> u32 {
    TAPE.with(|tape| {
        let constants = &mut tape.borrow_mut().constants;
        constants.push(value);
        constants.len() as u32 - 1
    })
}

impl Recorded {
    /// The entry on the tape; a constant gets one now.
    fn node(self) -> u32 {
        match self {
            Self::Node(node) => node,
            Self::Constant(value) => {
                let Self::Node(node) = push(Op::Constant(constant(value))) else { return 0 };
                node
            }
        }
    }

    fn unary(self, f: fn(f64) -> f64, op: fn(u32) -> Op) -> Self {
        match self {
            Self::Constant(a) => Self::Constant(f(a)),
            Self::Node(a) => push(op(a)),
        }
    }

    fn binary(self, other: Self, f: fn(f64, f64) -> f64, op: fn(u32, u32) -> Op) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::Constant(f(a, b)),
            (a, b) => {
                let (a, b) = (a.node(), b.node());
                push(op(a, b))
            }
        }
    }
}

impl From<f64> for Recorded {
    fn from(value: f64) -> Self {
        Self::Constant(value)
    }
}

impl PartialEq for Recorded {
    #[track_caller]
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => a == b,
            (Self::Node(a), Self::Node(b)) if a == b => true,
            _ => panic!(
                "`==` of a number that is not known while equations are written down: where they switch, use `select`"
            ),
        }
    }
}

impl Zero for Recorded {
    fn zero() -> Self {
        Self::Constant(0.0)
    }
    /// Whether this is the literal constant zero. False for everything that depends on an input.
    fn is_zero(&self) -> bool {
        matches!(self, Self::Constant(value) if *value == 0.0)
    }
}

impl One for Recorded {
    fn one() -> Self {
        Self::Constant(1.0)
    }
}

impl Neg for Recorded {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(|a| -a, Op::Neg)
    }
}

impl Add for Recorded {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        self.binary(o, |a, b| a + b, Op::Add)
    }
}

impl Sub for Recorded {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self.binary(o, |a, b| a - b, Op::Sub)
    }
}

impl Mul for Recorded {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        self.binary(o, |a, b| a * b, Op::Mul)
    }
}

impl Div for Recorded {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        self.binary(o, |a, b| a / b, Op::Div)
    }
}

impl Add<f64> for Recorded {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        self + Self::Constant(o)
    }
}

impl Sub<f64> for Recorded {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        self - Self::Constant(o)
    }
}

impl Mul<f64> for Recorded {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        self * Self::Constant(o)
    }
}

impl Div<f64> for Recorded {
    type Output = Self;
    fn div(self, o: f64) -> Self {
        self / Self::Constant(o)
    }
}

impl AddAssign for Recorded {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for Recorded {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl MulAssign for Recorded {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl DivAssign for Recorded {
    fn div_assign(&mut self, o: Self) {
        *self = *self / o;
    }
}

impl Scalar for Recorded {
    fn sqrt(self) -> Self {
        self.unary(f64::sqrt, Op::Sqrt)
    }
    fn sin(self) -> Self {
        self.unary(f64::sin, Op::Sin)
    }
    fn cos(self) -> Self {
        self.unary(f64::cos, Op::Cos)
    }
    fn atan2(self, x: Self) -> Self {
        self.binary(x, f64::atan2, Op::Atan2)
    }
    fn exp(self) -> Self {
        self.unary(f64::exp, Op::Exp)
    }
    fn ln(self) -> Self {
        self.unary(f64::ln, Op::Ln)
    }
    fn tanh(self) -> Self {
        self.unary(f64::tanh, Op::Tanh)
    }
    fn powi(self, n: i32) -> Self {
        match self {
            Self::Constant(a) => Self::Constant(a.powi(n)),
            Self::Node(a) => push(Op::Powi(a, n)),
        }
    }
    fn powf(self, exponent: f64) -> Self {
        match self {
            Self::Constant(a) => Self::Constant(a.powf(exponent)),
            Self::Node(a) => push(Op::Powf(a, constant(exponent))),
        }
    }
    fn select(a: Self, b: Self, x: Self, y: Self) -> Self {
        let (a, b, x, y) = (a.node(), b.node(), x.node(), y.node());
        push(Op::Select(a, b, x, y))
    }
    fn lookup(self, table: &Table) -> Self {
        let node = self.node();
        let index = TAPE.with(|tape| {
            let tables = &mut tape.borrow_mut().tables;
            // One copy per table however often it is used.
            tables.iter().position(|known| known == table).unwrap_or_else(|| {
                tables.push(table.clone());
                tables.len() - 1
            })
        });
        push(Op::Table(index as u32, node))
    }
}
