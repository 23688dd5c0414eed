//! [`Shape`]: what two recordings of a scene must have in common, and the numbers in which they may differ.

use odyn_graph::{Listing, Value};

use crate::machine::Machine;
use crate::plan::{Coordinates, Layout};
use crate::program::Program;

const PLANNED: &str = "times, inputs, coordinates or rows of the scene follow it";

/// Difference of two starts, as a share of the largest number of one, that is rounding of how they were found.
const START_ROUNDING: f64 = 1e-13;

pub(crate) fn same_start(a: &[f64], b: &[f64]) -> bool {
    let size = a.iter().fold(f64::MIN_POSITIVE, |size, x| size.max(x.abs()));
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= START_ROUNDING * size)
}

/// What a machine is: operations, and numbers that may follow parameters.
pub(crate) struct Shape {
    operations: Vec<Operation>,
    tables: Vec<element_api::Table>,
    /// What has to be the same, bit for bit.
    same: Vec<u64>,
    /// What the entries of the state are, and where they lie.
    plan: (Coordinates, Layout),
    pub(crate) numbers: Vec<f64>,
    /// The first of the numbers that are no part of programs: of the start.
    pub(crate) start: usize,
}

/// An operation with its operands by what they are.
#[derive(PartialEq)]
struct Operation(Value, [Operand; 4]);

#[derive(Clone, Copy, PartialEq)]
enum Operand {
    Nothing,
    Number,
    Input(u32),
    Operation(u32),
}

impl Shape {
    pub(crate) fn of(machine: &Machine) -> Option<Self> {
        let mut shape = Self {
            operations: Vec::new(),
            tables: Vec::new(),
            same: Vec::new(),
            plan: (machine.portable.coordinates.clone(), machine.layout.clone()),
            numbers: Vec::new(),
            start: 0,
        };
        for program in programs(machine) {
            let listing = program.listing()?;
            shape.program(&listing);
            shape.tables.extend(listing.tables);
        }
        shape.start = shape.numbers.len();
        shape.numbers.extend(&machine.state);
        shape.numbers.extend(machine.references.iter().map(|(_, start)| *start));
        let inputs = machine.inputs.iter().flat_map(|port| [port.start, port.factor]);
        let axes = machine.thin.iter().flat_map(|axis| [axis.moment, axis.share]);
        let times = [machine.t_start, machine.t_end, machine.step];
        let sampled = &machine.sampled;
        let samples = sampled.clocks.iter().map(|clock| clock.period).chain(sampled.start.iter().copied());
        shape.same = inputs.chain(axes).chain(times).chain(samples).map(f64::to_bits).collect();
        let rows = machine.portable.rows.iter().chain(machine.portable.others.iter().map(|(row, _)| row));
        let references = machine.references.iter().map(|(number, _)| number);
        shape.same.extend(rows.chain(references).map(|count| *count as u64));
        let solved = [&machine.quantities, &machine.switches, &machine.angles, &machine.watched, &machine.sampled.next];
        shape.same.extend(solved.map(|found| found.as_ref().map_or(2, |found| u64::from(found.solved))));
        Some(shape)
    }

    fn program(&mut self, listing: &Listing) {
        let mut place = vec![u32::MAX; listing.values.len()];
        let operand = |value: u32, place: &[u32]| match listing.values[value as usize] {
            Value::Constant(_) => Operand::Number,
            Value::Input(slot) => Operand::Input(slot),
            _ => Operand::Operation(place[value as usize]),
        };
        let operations = listing.values.iter().enumerate().filter(|(_, value)| value.is_operation());
        for (count, (number, value)) in operations.enumerate() {
            let mut operands = [Operand::Nothing; 4];
            let mut k = 0;
            value.operands(|other| {
                operands[k] = operand(other, &place);
                k += 1;
            });
            if matches!(value, Value::Add(..) | Value::Mul(..)) && operands[0] == Operand::Number {
                operands.swap(0, 1);
            }
            self.operations.push(Operation(value.with_operands(|_| 0), operands));
            place[number] = count as u32;
        }
        for output in &listing.outputs {
            self.operations.push(Operation(
                Value::Neg(0),
                [operand(*output, &place), Operand::Nothing, Operand::Nothing, Operand::Nothing],
            ));
        }
        visit_numbers(listing, |_, _, number| self.numbers.push(number));
    }

    /// Whether states, start and times are those of the scene as it is.
    pub(crate) fn starts_as(&self, nominal: &Self) -> Result<(), String> {
        if self.plan != nominal.plan || self.same != nominal.same {
            return Err(PLANNED.into());
        }
        match same_start(&nominal.numbers[nominal.start..], &self.numbers[self.start..]) {
            true => Ok(()),
            false => Err("the start of the scene follows it".into()),
        }
    }

    /// The numbers of a recording, if nothing else differs.
    pub(crate) fn numbers_of(&self, other: Self) -> Result<Vec<f64>, String> {
        if self.operations != other.operations || self.numbers.len() != other.numbers.len() {
            return Err("the operations of the equations depend on it".into());
        }
        if self.tables != other.tables {
            return Err("a table follows it".into());
        }
        if self.same != other.same || self.plan != other.plan {
            return Err(PLANNED.into());
        }
        Ok(other.numbers)
    }
}

/// Calls `take` with each number of a program where it is used: by which value (that of an output is the number of all values), as
/// which operand.
pub(crate) fn visit_numbers(listing: &Listing, mut take: impl FnMut(usize, usize, f64)) {
    let number = |value: u32| match listing.values[value as usize] {
        Value::Constant(number) => Some(number),
        _ => None,
    };
    for (at, value) in listing.values.iter().enumerate() {
        let mut k = 0;
        value.operands(|operand| {
            if let Some(number) = number(operand) {
                take(at, k, number);
            }
            k += 1;
        });
    }
    for (k, output) in listing.outputs.iter().enumerate() {
        if let Some(number) = number(*output) {
            take(listing.values.len(), k, number);
        }
    }
}

fn programs(machine: &Machine) -> Vec<&Program> {
    let portable = &machine.portable;
    let optional = [&machine.quantities, &machine.switches, &machine.angles, &machine.watched, &machine.sampled.next];
    let optional = optional.into_iter().flatten().map(|found| &found.program);
    [&portable.motion, &portable.position, &portable.velocity].into_iter().chain(optional).collect()
}
