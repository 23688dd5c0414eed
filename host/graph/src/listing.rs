//! [`Listing`]: a program written out value by value, for those who write it in another language.

use element_api::Table;

use super::graph::{Graph, Node};
use super::tape::{Instruction, Program, Register};

/// What a value is. Operands are numbers of values, all of them smaller than that of the value itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A number.
    Constant(f64),
    /// A slot of the inputs.
    Input(u32),
    /// a + b
    Add(u32, u32),
    /// a - b
    Sub(u32, u32),
    /// a b
    Mul(u32, u32),
    /// a / b
    Div(u32, u32),
    /// -a
    Neg(u32),
    /// Square root, correctly rounded.
    Sqrt(u32),
    /// Sine, as in `turn.rs`.
    Sin(u32),
    /// Cosine, as in `turn.rs`.
    Cos(u32),
    /// Angle of the point (b, a).
    Atan2(u32, u32),
    /// Exponential.
    Exp(u32),
    /// Natural logarithm.
    Ln(u32),
    /// Hyperbolic tangent.
    Tanh(u32),
    /// Whole power, by squaring.
    Powi(u32, i32),
    /// Real power.
    Powf(u32, f64),
    /// c where a < b, otherwise d: `[a, b, c, d]`.
    Select([u32; 4]),
    /// Derivative of some order of a table: the argument, the table, the order.
    Table(u32, u32, u32),
}

impl Value {
    /// Calls `take` with each operand.
    pub fn operands(&self, mut take: impl FnMut(u32)) {
        match *self {
            Self::Constant(_) | Self::Input(_) => {}
            Self::Add(a, b) | Self::Sub(a, b) | Self::Mul(a, b) | Self::Div(a, b) | Self::Atan2(a, b) => {
                take(a);
                take(b);
            }
            Self::Neg(a) | Self::Sqrt(a) | Self::Sin(a) | Self::Cos(a) | Self::Exp(a) | Self::Ln(a) => take(a),
            Self::Tanh(a) | Self::Powi(a, _) | Self::Powf(a, _) | Self::Table(a, ..) => take(a),
            Self::Select(all) => all.into_iter().for_each(take),
        }
    }

    /// The same operation of other operands.
    #[must_use]
    pub fn with_operands(self, mut other: impl FnMut(u32) -> u32) -> Self {
        match self {
            Self::Constant(_) | Self::Input(_) => self,
            Self::Add(a, b) => Self::Add(other(a), other(b)),
            Self::Sub(a, b) => Self::Sub(other(a), other(b)),
            Self::Mul(a, b) => Self::Mul(other(a), other(b)),
            Self::Div(a, b) => Self::Div(other(a), other(b)),
            Self::Neg(a) => Self::Neg(other(a)),
            Self::Sqrt(a) => Self::Sqrt(other(a)),
            Self::Sin(a) => Self::Sin(other(a)),
            Self::Cos(a) => Self::Cos(other(a)),
            Self::Atan2(a, b) => Self::Atan2(other(a), other(b)),
            Self::Exp(a) => Self::Exp(other(a)),
            Self::Ln(a) => Self::Ln(other(a)),
            Self::Tanh(a) => Self::Tanh(other(a)),
            Self::Powi(a, n) => Self::Powi(other(a), n),
            Self::Powf(a, exponent) => Self::Powf(other(a), exponent),
            Self::Select(all) => Self::Select(all.map(other)),
            Self::Table(a, table, order) => Self::Table(other(a), table, order),
        }
    }

    /// Whether it is computed.
    #[must_use]
    pub fn is_operation(&self) -> bool {
        !matches!(self, Self::Constant(_) | Self::Input(_))
    }
}

/// See the module documentation. Evaluated in order, one operation at a time, it gives the bits of [`Program::run`].
#[derive(Debug, Clone)]
pub struct Listing {
    /// All values: constants and inputs first.
    pub values: Vec<Value>,
    /// The value of each output.
    pub outputs: Vec<u32>,
    /// Tables that values refer to.
    pub tables: Vec<Table>,
}

impl Listing {
    /// The values as nodes of a graph of their own, and which node each of them is.
    #[must_use]
    pub fn graph(&self) -> (Graph, Vec<Node>) {
        let mut g = Graph::default();
        g.tables.clone_from(&self.tables);
        let mut nodes: Vec<Node> = Vec::with_capacity(self.values.len());
        for value in &self.values {
            let at = |operand: u32| nodes[operand as usize];
            let node = match *value {
                Value::Constant(number) => g.constant(number),
                Value::Input(slot) => g.input(slot as usize),
                Value::Add(a, b) => g.add(at(a), at(b)),
                Value::Sub(a, b) => g.sub(at(a), at(b)),
                Value::Mul(a, b) => g.mul(at(a), at(b)),
                Value::Div(a, b) => g.div(at(a), at(b)),
                Value::Neg(a) => g.neg(at(a)),
                Value::Sqrt(a) => g.sqrt(at(a)),
                Value::Sin(a) => g.sin(at(a)),
                Value::Cos(a) => g.cos(at(a)),
                Value::Atan2(a, b) => g.atan2(at(a), at(b)),
                Value::Exp(a) => g.exp(at(a)),
                Value::Ln(a) => g.ln(at(a)),
                Value::Tanh(a) => g.tanh(at(a)),
                Value::Powi(a, n) => g.powi(at(a), n),
                Value::Powf(a, exponent) => g.powf(at(a), exponent),
                Value::Select([a, b, c, d]) => g.select(at(a), at(b), at(c), at(d)),
                Value::Table(a, table, order) => g.table(table, order, at(a)),
            };
            nodes.push(node);
        }
        (g, nodes)
    }
}

impl Program {
    /// The program value by value; `None` where it calls opaque elements.
    #[must_use]
    pub fn listing(&self) -> Option<Listing> {
        if self.calls() > 0 {
            return None;
        }
        let mut writer = Writer { values: Vec::new(), at: vec![u32::MAX; self.registers] };
        for (register, value) in self.constants.iter().enumerate() {
            writer.put(register as Register, Value::Constant(*value));
        }
        for (slot, register) in &self.inputs {
            writer.put(*register, Value::Input(*slot));
        }
        for stage in &self.stages {
            stage.operations.iter().for_each(|operation| writer.write(operation));
            let turns = &stage.turns;
            for (place, angle) in turns.angles.iter().enumerate() {
                let angle = writer.at[*angle as usize];
                let register = turns.first + place as Register;
                writer.put(register, Value::Sin(angle));
                writer.put(register + turns.lanes as Register, Value::Cos(angle));
            }
        }
        self.after_calls.iter().for_each(|operation| writer.write(operation));
        let outputs = self.outputs.iter().map(|register| writer.at[*register as usize]).collect();
        Some(Listing { values: writer.values, outputs, tables: self.tables.clone() })
    }
}

/// Values, and which of them each register holds.
struct Writer {
    values: Vec<Value>,
    at: Vec<u32>,
}

impl Writer {
    fn put(&mut self, register: Register, value: Value) {
        self.at[register as usize] = self.values.len() as u32;
        self.values.push(value);
    }

    fn write(&mut self, instruction: &Instruction) {
        let at = |register: Register| self.at[register as usize];
        let (register, value) = match *instruction {
            Instruction::Add(d, a, b) => (d, Value::Add(at(a), at(b))),
            Instruction::Sub(d, a, b) => (d, Value::Sub(at(a), at(b))),
            Instruction::Mul(d, a, b) => (d, Value::Mul(at(a), at(b))),
            Instruction::Div(d, a, b) => (d, Value::Div(at(a), at(b))),
            Instruction::Neg(d, a) => (d, Value::Neg(at(a))),
            Instruction::Sqrt(d, a) => (d, Value::Sqrt(at(a))),
            Instruction::Sin(d, a) | Instruction::Turn(d, a) => (d, Value::Sin(at(a))),
            // The operand of the second of a pair may have been overwritten by the first.
            Instruction::Turned(d, _) => (d, Value::Cos(self.turned())),
            Instruction::Cos(d, a) => (d, Value::Cos(at(a))),
            Instruction::Atan2(d, a, b) => (d, Value::Atan2(at(a), at(b))),
            Instruction::Exp(d, a) => (d, Value::Exp(at(a))),
            Instruction::Ln(d, a) => (d, Value::Ln(at(a))),
            Instruction::Tanh(d, a) => (d, Value::Tanh(at(a))),
            Instruction::Powi(d, a, n) => (d, Value::Powi(at(a), n)),
            Instruction::Powf(d, ref power) => (d, Value::Powf(at(power.0), power.1)),
            Instruction::Select(d, ref all) => (d, Value::Select(all.map(at))),
            Instruction::Table(d, a, table, order) => (d, Value::Table(at(a), table, u32::from(order))),
        };
        self.put(register, value);
    }

    /// The angle of the sine that was written last.
    fn turned(&self) -> u32 {
        match self.values.last() {
            Some(Value::Sin(angle)) => *angle,
            _ => u32::MAX,
        }
    }
}
