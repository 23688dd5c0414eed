//! Parameters of a scene that stay parameters of what is exported: the scene is recorded again with other values of them, and the
//! numbers of the equations that change are written as functions of the parameters where they follow an exact law.
//!
//! Only numbers may change, not operations. A parameter that changes anything else (the start, the number of rows, a table), or
//! numbers by a law that is not known, is fixed. Laws are held against recordings over the whole range in which a parameter can be
//! set, alone and with others.

use odyn_graph::{Listing, Value};

use crate::analysis::Portable;
use crate::choices::Choices;
use crate::laws::{Alone, Law};
use crate::machine::{Machine, Port};
use crate::program::Program;
use crate::scene::Override;
use crate::session::{Session, SessionError};
use crate::shape::{Shape, same_start, visit_numbers};
use crate::twin::{Failed, Twin, at_most};

/// A parameter that can be set.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name, unit and value at the start.
    pub port: Port,
    /// The least and the largest value for which it was held against recordings, in its unit.
    pub range: [f64; 2],
}

impl Parameter {
    /// Its range with the unit, in words.
    #[must_use]
    pub fn span(&self) -> String {
        let [low, high] = self.range;
        format!("{low:?} to {high:?} {}", self.port.unit).trim_end().to_owned()
    }
}

/// Parameters that can be set, and what follows them.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    /// Those that can be set.
    pub settable: Vec<Parameter>,
    /// Where the equations were recorded, in their units: next to the values at the start, where no two numbers are equal by chance.
    pub base: Vec<f64>,
    /// Numbers of the equations that follow them.
    pub followed: Vec<Law>,
    /// Those that cannot, each with the reason.
    pub fixed: Vec<(String, String)>,
}

impl Parameters {
    /// Parameters, by their places, that a number of the equations follows.
    pub(crate) fn of(&self, followed: usize) -> impl Iterator<Item = usize> {
        self.followed[followed].terms.iter().map(|(parameter, _)| *parameter)
    }
}

/// Factors of the values at which a parameter is tried alone, widest ranges first.
const RANGES: [[f64; 4]; 2] = [[0.5, 0.8, 1.37, 2.0], [0.9, 0.96, 1.043, 1.1]];

/// Opens the scene with changes.
pub type Reopen<'a> = &'a mut dyn FnMut(&[Override]) -> Result<Session, SessionError>;

/// A parameter that is looked at.
struct Candidate {
    port: Port,
    base: f64,
    /// Behind the number in a change.
    unit: String,
    range: [f64; 2],
    /// What came out where it alone was changed.
    seen: Vec<(f64, Vec<f64>)>,
}

impl Candidate {
    fn set(&self, value: f64) -> Override {
        Override::new(format!("parameters.{}={value:?}{}", self.port.name, self.unit))
    }
}

impl Machine {
    /// The same with parameters that can be set: those named, or all. `reopen` opens the scene that the machine was made of.
    ///
    /// # Errors
    /// A name that no parameter has.
    pub fn with_parameters(
        self,
        reopen: Reopen<'_>,
        choices: &Choices,
        names: Option<&[String]>,
    ) -> Result<Self, SessionError> {
        let session = reopen(&[])?;
        // Derivatives are made from the programs in the end.
        let explicit = Choices { derivatives: false, method: &crate::METHODS[0], tolerance: None, ..choices.clone() };
        let mut fixed = Vec::new();
        let mut open = candidates(&session, names, &mut fixed)?;
        let mut record = |changes: &[Override]| -> Result<(Self, Shape), String> {
            let first = |error: SessionError| error.diagnostics.first().map_or_else(String::new, |d| d.message.clone());
            let machine = Self::new(reopen(changes).map_err(first)?, &self.title, explicit.clone()).map_err(first)?;
            let shape = Shape::of(&machine).ok_or("a program calls an opaque element")?;
            Ok((machine, shape))
        };
        let Some(nominal) = Shape::of(&self) else { return Ok(self) };
        open.retain_mut(|candidate| match candidate.alone(&nominal, &mut record) {
            Ok(()) => true,
            Err(reason) => {
                fixed.push((candidate.port.name.clone(), reason));
                false
            }
        });
        let (recorded, laws) = loop {
            if open.is_empty() {
                return Ok(Self { parameters: Parameters { fixed, ..Parameters::default() }, ..self });
            }
            match together(&mut open, &nominal, &mut record) {
                Ok(found) => break found,
                Err((number, reason)) => fixed.push((open.remove(number).port.name, reason)),
            }
        };
        let base = open.iter().map(|one| one.base).collect();
        let settable = open.into_iter().map(|one| Parameter { range: one.range, port: one.port }).collect();
        Ok(self.followed(recorded, Parameters { settable, base, followed: Vec::new(), fixed }, laws))
    }

    /// A recording with inputs in the place of numbers that follow parameters, and everything else as it is here.
    fn followed(self, mut recorded: Self, mut parameters: Parameters, laws: Laws) -> Self {
        let first = recorded.input_count();
        let mut laws = laws.into_iter();
        for program in programs_mut(&mut recorded) {
            if let Some(listing) = program.listing() {
                *program = replaced(&listing, first, &mut laws, &mut parameters.followed);
            }
        }
        let portable = Portable {
            length: self.portable.length,
            sizes: self.portable.sizes,
            squares: self.portable.squares,
            others: self.portable.others,
            ..recorded.portable
        };
        let Self { quantities, switches, angles, watched, sampled, .. } = recorded;
        let machine =
            Self { portable, quantities, switches, angles, watched, sampled, parameters, tangents: None, ..self };
        // No program calls an opaque element.
        machine.clone().differentiated().unwrap_or(machine)
    }
}

impl Twin {
    /// Sets all parameters, in their units, and what follows them; time and state stay.
    ///
    /// # Errors
    /// [`Failed::OutOfRange`]: they are as they were.
    pub fn set_parameters(&mut self, values: &[f64]) -> Result<(), Failed> {
        let ranges = self.machine.parameters.settable.iter().map(|parameter| parameter.range);
        if ranges.zip(values).any(|([low, high], value)| !(at_most(low, *value) && at_most(*value, high))) {
            return Err(Failed::OutOfRange);
        }
        self.parameters.copy_from_slice(values);
        self.follow_parameters();
        Ok(())
    }

    pub(crate) fn follow_parameters(&mut self) {
        let parameters = &self.machine.parameters;
        let first = self.given.len() - parameters.followed.len();
        for (slot, law) in self.given[first..].iter_mut().zip(&parameters.followed) {
            *slot = law.value(&self.parameters, &parameters.base);
        }
    }
}

/// The parameters that are numbers of their own.
fn candidates(
    session: &Session,
    names: Option<&[String]>,
    fixed: &mut Vec<(String, String)>,
) -> Result<Vec<Candidate>, SessionError> {
    let all = &session.scene.parameters;
    let known = || all.iter().map(|parameter| parameter.name.as_str());
    if let Some(name) = names.into_iter().flatten().find(|name| all.get(name).is_none()) {
        return Err(SessionError::one(&session.scene.source, crate::refused::unknown("parameter", name, known())));
    }
    let mut found = Vec::new();
    let is_wanted = |name: &String| names.is_none_or(|names| names.contains(name));
    let mut in_c = std::collections::HashSet::new();
    for parameter in all.iter().filter(|parameter| is_wanted(&parameter.name)) {
        let text = session.scene.source.slice(parameter.span.clone()).unwrap_or_default();
        let mut words = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.'));
        if let Some(other) = words.find(|word| all.get(word).is_some()) {
            fixed.push((parameter.name.clone(), format!("it is computed from `{other}`")));
            continue;
        }
        if !in_c.insert(crate::machine::identifier(&parameter.name)) {
            fixed.push((parameter.name.clone(), "in C it would have the name of another one".into()));
            continue;
        }
        let (units, quantity) = (&session.scene.units, parameter.value);
        let is_plain = quantity.plain || quantity.dimension == odyn_scene::Dimension::DIMENSIONLESS;
        let label = if is_plain { String::new() } else { units.label_as(quantity.dimension, text) };
        let factor = if is_plain { 1.0 } else { units.factor(quantity.dimension) };
        let start = quantity.si / factor;
        if !start.is_finite() || start == 0.0 {
            fixed.push((parameter.name.clone(), "it is zero, where operations fall away".into()));
            continue;
        }
        let port = Port {
            name: parameter.name.clone(),
            factor,
            dimension: quantity.dimension,
            start,
            about: "parameter of the scene".into(),
            is_fixed: false,
            unit: label.clone(),
        };
        let unit = if label.is_empty() { label } else { format!(" {label}") };
        // No two are changed by the same factor.
        let base = start * (1.02 + 0.05 * golden(found.len()));
        found.push(Candidate { port, base, unit, range: [start, start], seen: Vec::new() });
    }
    Ok(found)
}

/// Numbers between 0 and 1 that lie apart.
fn golden(number: usize) -> f64 {
    ((number as f64 + 1.0) * 0.618_033_988_749_895).fract()
}

/// The place of a parameter that has to be fixed, and the reason.
type Blamed = (usize, String);

/// Laws of all numbers, of those that follow parameters.
type Laws = Vec<Option<Law>>;

type Record<'a> = &'a mut dyn FnMut(&[Override]) -> Result<(Machine, Shape), String>;

impl Candidate {
    /// Finds the widest range in which only numbers change, and by known laws, where this parameter alone is changed.
    fn alone(&mut self, nominal: &Shape, record: Record<'_>) -> Result<(), String> {
        let mut reason = String::new();
        for range in RANGES {
            let (a, b) = (self.port.start * range[0], self.port.start * range[3]);
            self.range = [a.min(b), a.max(b)];
            let tried = record(&[self.set(self.base)]).and_then(|(_, shape)| {
                shape.starts_as(nominal)?;
                self.look(&shape, range, &[], record)?;
                laws(&[&*self], &shape).map_err(|(_, why)| why)
            });
            if tried.as_ref().is_ok_and(|laws| laws.iter().all(Option::is_none)) {
                return Err("no equation follows it".into());
            }
            match tried {
                Ok(_) => return Ok(()),
                Err(why) => reason = why,
            }
        }
        Err(reason)
    }

    /// Records the scene with this parameter at the places of a range, among other changes.
    fn look(&mut self, shape: &Shape, range: [f64; 4], others: &[Override], record: Record<'_>) -> Result<(), String> {
        let seen = range.iter().map(|factor| {
            let value = self.port.start * factor;
            let changes = [others, &[self.set(value)]].concat();
            Ok((value, shape.numbers_of(record(&changes)?.1)?))
        });
        self.seen = seen.collect::<Result<_, String>>()?;
        Ok(())
    }
}

/// The laws of all numbers; otherwise the parameter that a number does not follow by a known one, and why.
fn laws(open: &[&Candidate], shape: &Shape) -> Result<Laws, Blamed> {
    let mut found = Vec::with_capacity(shape.start);
    let start = &shape.numbers[shape.start..];
    for (k, one) in open.iter().enumerate() {
        if one.seen.iter().any(|(_, numbers)| !same_start(start, &numbers[shape.start..])) {
            return Err((k, "the start of the scene follows it".into()));
        }
    }
    for (number, at) in shape.numbers[..shape.start].iter().enumerate() {
        let seen: Vec<Vec<(f64, f64)>> = open
            .iter()
            .map(|one| one.seen.iter().map(|(value, numbers)| (*value, numbers[number])).collect())
            .collect();
        let moved = |seen: &[(f64, f64)]| seen.iter().any(|(_, there)| there.to_bits() != at.to_bits());
        let alone: Vec<Alone<'_>> = (0..open.len())
            .filter(|k| moved(&seen[*k]))
            .map(|k| Alone { parameter: k, base: open[k].base, seen: &seen[k] })
            .collect();
        let Some(last) = alone.last() else {
            found.push(None);
            continue;
        };
        match Law::of(*at, &alone) {
            Some(law) => found.push(Some(law)),
            None => {
                let others = if alone.len() > 1 { " together with others" } else { "" };
                return Err((
                    last.parameter,
                    format!("numbers of the equations follow it{others} by no law that is known"),
                ));
            }
        }
    }
    Ok(found)
}

/// A recording and the laws of its numbers, which hold where all parameters are changed at once.
fn together(open: &mut [Candidate], nominal: &Shape, record: Record<'_>) -> Result<(Machine, Laws), Blamed> {
    let last = open.len() - 1;
    let joint = |reason: String| (last, format!("with others changed as well, {reason}"));
    let at_base: Vec<Override> = open.iter().map(|one| one.set(one.base)).collect();
    let (machine, shape) = record(&at_base).map_err(joint)?;
    shape.starts_as(nominal).map_err(joint)?;
    for (k, one) in open.iter_mut().enumerate() {
        let range = RANGES.into_iter().find(|range| {
            let width = one.port.start.abs() * (range[3] - range[0]);
            (one.range[1] - one.range[0] - width).abs() < 1e-9 * width
        });
        one.look(&shape, range.unwrap_or(RANGES[1]), &at_base, record).map_err(|reason| (k, reason))?;
    }
    let all: Vec<&Candidate> = open.iter().collect();
    let laws = laws(&all, &shape)?;
    let base: Vec<f64> = open.iter().map(|one| one.base).collect();
    for turn in 0..2 {
        // Places in the ranges that no two parameters share.
        let place = |k: usize| (golden(k) + 0.37 * f64::from(turn)).fract();
        let within = |(k, one): (usize, &Candidate)| {
            let [low, high] = one.range;
            low + (0.05 + 0.9 * place(k)) * (high - low)
        };
        let values: Vec<f64> = open.iter().enumerate().map(within).collect();
        let changes: Vec<Override> = open.iter().zip(&values).map(|(one, value)| one.set(*value)).collect();
        let there = record(&changes).and_then(|(_, found)| shape.numbers_of(found)).map_err(joint)?;
        if !same_start(&shape.numbers[shape.start..], &there[shape.start..]) {
            return Err(joint("the start of the scene follows it".into()));
        }
        for (number, (law, seen)) in laws.iter().zip(&there).enumerate() {
            let follows = match law {
                Some(law) => law.gives(*seen, &values, &base),
                None => seen.to_bits() == shape.numbers[number].to_bits(),
            };
            if !follows {
                let blamed = law.as_ref().and_then(|law| law.terms.last()).map_or(last, |(parameter, _)| *parameter);
                return Err((
                    blamed,
                    "numbers of the equations follow it together with others by no law that is known".into(),
                ));
            }
        }
    }
    Ok((machine, laws))
}

/// A program that takes the numbers that follow parameters as inputs from slot `first` on. `laws`: of all its numbers; new ones are
/// added to `followed`.
fn replaced(
    listing: &Listing,
    first: usize,
    laws: &mut impl Iterator<Item = Option<Law>>,
    followed: &mut Vec<Law>,
) -> Program {
    // By value and operand, which of the followed numbers it is.
    let mut of: std::collections::HashMap<(usize, usize), usize> = std::collections::HashMap::new();
    visit_numbers(listing, |value, operand, _| {
        let Some(law) = laws.next().flatten() else { return };
        let place = followed.iter().position(|known| *known == law).unwrap_or_else(|| {
            followed.push(law);
            followed.len() - 1
        });
        of.insert((value, operand), place);
    });
    // Inputs come first.
    let count = followed.len();
    let mut values: Vec<Value> = (0..count).map(|k| Value::Input((first + k) as u32)).collect();
    let moved = |old: u32, known: Option<&usize>| known.map_or(old + count as u32, |place| *place as u32);
    for (at, value) in listing.values.iter().enumerate() {
        let mut operand = 0;
        values.push(value.with_operands(|old| {
            let known = of.get(&(at, operand));
            operand += 1;
            moved(old, known)
        }));
    }
    let end = listing.values.len();
    let outputs = listing.outputs.iter().enumerate().map(|(k, old)| moved(*old, of.get(&(end, k)))).collect();
    let listing = Listing { values, outputs, tables: listing.tables.clone() };
    let (graph, nodes) = listing.graph();
    let outputs: Vec<_> = listing.outputs.iter().map(|value| nodes[*value as usize]).collect();
    Program::compile(&graph, &outputs)
}

fn programs_mut(machine: &mut Machine) -> Vec<&mut Program> {
    let portable = &mut machine.portable;
    let optional = [
        &mut machine.quantities,
        &mut machine.switches,
        &mut machine.angles,
        &mut machine.watched,
        &mut machine.sampled.next,
    ];
    let optional = optional.into_iter().flatten().map(|found| &mut found.program);
    [&mut portable.motion, &mut portable.position, &mut portable.velocity].into_iter().chain(optional).collect()
}
