//! A program as functions in C, none of them longer than what compilers digest well.
//!
//! Values that are used only in the function that computes them are local; all others live in the scratch of the machine, where
//! places are used again once nothing needs them any more.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use odyn_graph::{Listing, Value};

use super::Real;

/// Operations of a function.
const LONGEST: usize = 300;

/// What a program was written as.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Written {
    /// Operations that are run.
    pub(super) operations: usize,
    /// Numbers in the scratch.
    pub(super) scratch: usize,
    /// The most local numbers of a function.
    pub(super) locals: usize,
}

/// What several programs need.
#[derive(Debug, Default)]
pub(super) struct Needs {
    pub(super) turn: bool,
    pub(super) whole_power: bool,
    pub(super) real_power: bool,
    /// Other functions of `math.h` than the square root.
    pub(super) library: BTreeSet<&'static str>,
    /// Tables, as they are in C.
    pub(super) tables: Vec<element_api::Table>,
}

/// Writes `name(m, t, y)`, which puts the outputs into the array `out`. `input` gives what an input slot is in C.
pub(super) fn write(
    text: &mut String,
    listing: &Listing,
    (name, machine, out): (&str, &str, &str),
    real: Real,
    input: &dyn Fn(u32) -> String,
    needs: &mut Needs,
) -> Written {
    let order = live(listing);
    let chunks: Vec<&[u32]> = order.chunks(LONGEST).collect();
    let places = Places::new(listing, &chunks);
    let mut written = Written { operations: order.len(), scratch: places.size, locals: 0 };
    let parts = chunks.len().max(1);
    for part in 0..parts {
        let chunk = chunks.get(part).copied().unwrap_or_default();
        let mut body = String::new();
        let mut writer =
            Writer { listing, places: &places, real, input, needs, part, locals: 0, paired: BTreeSet::new() };
        chunk.iter().for_each(|value| writer.operation(&mut body, *value));
        for (slot, value) in listing.outputs.iter().enumerate() {
            let own = places.part[*value as usize];
            if own == part as u32 || own == NOWHERE && part + 1 == parts {
                let value = writer.text(*value);
                let _ = writeln!(body, "    m->{out}[{slot}] = {value};");
            }
        }
        written.locals = written.locals.max(writer.locals);
        let suffix = if parts > 1 { format!("_{part}") } else { String::new() };
        let _ = writeln!(text, "static void {name}{suffix}({machine} *m, real t, const real *y) {{");
        if !body.contains("w[") {
            text.push_str("    (void)t;\n    (void)y;\n");
        } else {
            text.push_str("    real *const w = m->scratch;\n    (void)t;\n    (void)y;\n");
        }
        text.push_str(&body);
        text.push_str("}\n\n");
    }
    if parts > 1 {
        let _ = writeln!(text, "static void {name}({machine} *m, real t, const real *y) {{");
        for part in 0..parts {
            let _ = writeln!(text, "    {name}_{part}(m, t, y);");
        }
        text.push_str("}\n\n");
    }
    written
}

/// Operations that outputs depend on, in running order.
fn live(listing: &Listing) -> Vec<u32> {
    let mut used = vec![false; listing.values.len()];
    listing.outputs.iter().for_each(|output| used[*output as usize] = true);
    for at in (0..listing.values.len()).rev() {
        if used[at] {
            listing.values[at].operands(|operand| used[operand as usize] = true);
        }
    }
    let is_live = |at: &u32| used[*at as usize] && listing.values[*at as usize].is_operation();
    (0..listing.values.len() as u32).filter(is_live).collect()
}

const NOWHERE: u32 = u32::MAX;

/// Where each value lives.
struct Places {
    /// The function that computes it.
    part: Vec<u32>,
    /// Its place in the scratch, if it is used in other functions.
    scratch: Vec<u32>,
    size: usize,
}

impl Places {
    fn new(listing: &Listing, chunks: &[&[u32]]) -> Self {
        let number = listing.values.len();
        let mut part = vec![NOWHERE; number];
        for (at, chunk) in chunks.iter().enumerate() {
            chunk.iter().for_each(|value| part[*value as usize] = at as u32);
        }
        let mut last = part.clone();
        for (at, chunk) in chunks.iter().enumerate() {
            for value in *chunk {
                listing.values[*value as usize].operands(|operand| last[operand as usize] = at as u32);
            }
        }
        let (mut scratch, mut size, mut free) = (vec![NOWHERE; number], 0, Vec::new());
        let mut ends: Vec<Vec<u32>> = vec![Vec::new(); chunks.len()];
        for (at, chunk) in chunks.iter().enumerate() {
            for value in *chunk {
                let end = last[*value as usize];
                if end != at as u32 {
                    let place = free.pop().unwrap_or_else(|| {
                        size += 1;
                        size as u32 - 1
                    });
                    scratch[*value as usize] = place;
                    ends[end as usize].push(place);
                }
            }
            // What is read here for the last time may be overwritten from the next function on.
            free.append(&mut ends[at]);
        }
        Self { part, scratch, size }
    }
}

struct Writer<'a> {
    listing: &'a Listing,
    places: &'a Places,
    real: Real,
    input: &'a dyn Fn(u32) -> String,
    needs: &'a mut Needs,
    part: usize,
    locals: usize,
    /// Sines and cosines that came with the other one.
    paired: BTreeSet<u32>,
}

impl Writer<'_> {
    /// A value where it is used.
    fn text(&self, value: u32) -> String {
        match self.listing.values[value as usize] {
            Value::Constant(number) => self.real.number(number),
            Value::Input(slot) => (self.input)(slot),
            _ if self.places.part[value as usize] == self.part as u32 => format!("v{value}"),
            _ => format!("w[{}]", self.places.scratch[value as usize]),
        }
    }

    fn keep(&mut self, body: &mut String, value: u32) {
        let place = self.places.scratch[value as usize];
        if place != NOWHERE {
            let _ = writeln!(body, "    w[{place}] = v{value};");
        }
        self.locals += 1;
    }

    /// The other of sine and cosine of the same angle, in the same function.
    fn other(&self, value: u32, wanted: impl Fn(u32) -> Value, angle: u32) -> Option<u32> {
        let wanted = wanted(angle);
        let same = |at: &usize| self.listing.values[*at] == wanted && self.places.part[*at] == self.part as u32;
        // Pairs lie next to each other.
        let near = (value as usize).saturating_sub(2)..(value as usize + 3).min(self.listing.values.len());
        near.into_iter().find(same).map(|at| at as u32)
    }

    fn turn(&mut self, body: &mut String, value: u32, angle: u32, is_sine: bool) {
        if !self.paired.insert(value) {
            self.keep(body, value);
            return;
        }
        self.needs.turn = true;
        let other = self.other(value, if is_sine { Value::Cos } else { Value::Sin }, angle);
        let at = self.text(angle);
        match other {
            Some(other) => {
                let (sine, cosine) = if is_sine { (value, other) } else { (other, value) };
                let _ = writeln!(body, "    real v{sine}, v{cosine};\n    turn({at}, &v{sine}, &v{cosine});");
                self.paired.insert(other);
            }
            None => {
                let (sine, cosine) = if is_sine { ("v", "u") } else { ("u", "v") };
                let _ = writeln!(
                    body,
                    "    real v{value}, u{value};\n    turn({at}, &{sine}{value}, &{cosine}{value});\n    (void)u{value};"
                );
                self.locals += 1;
            }
        }
        self.keep(body, value);
    }

    fn operation(&mut self, body: &mut String, value: u32) {
        let of = |writer: &Self, a: u32| writer.text(a);
        let infix = |writer: &Self, a: u32, sign: &str, b: u32| format!("{} {sign} {}", writer.text(a), writer.text(b));
        let text = match self.listing.values[value as usize] {
            Value::Constant(_) | Value::Input(_) => return,
            Value::Sin(angle) => return self.turn(body, value, angle, true),
            Value::Cos(angle) => return self.turn(body, value, angle, false),
            Value::Add(a, b) => infix(self, a, "+", b),
            Value::Sub(a, b) => infix(self, a, "-", b),
            Value::Mul(a, b) => infix(self, a, "*", b),
            Value::Div(a, b) => infix(self, a, "/", b),
            Value::Neg(a) => format!("-{}", of(self, a)),
            Value::Sqrt(a) => format!("{}({})", self.real.function("sqrt"), of(self, a)),
            Value::Exp(a) => self.library("exp", &[a]),
            Value::Ln(a) => self.library("log", &[a]),
            Value::Tanh(a) => self.library("tanh", &[a]),
            Value::Atan2(a, b) => self.library("atan2", &[a, b]),
            Value::Powi(a, n) => {
                self.needs.whole_power = true;
                format!("whole_power({}, {n})", of(self, a))
            }
            Value::Powf(a, exponent) => {
                self.needs.real_power = true;
                self.needs.library.insert("pow");
                format!("real_power({}, {})", of(self, a), self.real.number(exponent))
            }
            Value::Select([a, b, c, d]) => {
                let [a, b, c, d] = [a, b, c, d].map(|operand| of(self, operand));
                format!("{a} < {b} ? {c} : {d}")
            }
            Value::Table(a, table, order) => {
                let table = self.table(table as usize);
                let periodic = self.needs.tables[table].period().is_some();
                let number = self.needs.tables[table].pieces.len();
                let at = of(self, a);
                format!("look_up(breaks_{table}, pieces_{table}, {number}, {}, {at}, {order})", u8::from(periodic))
            }
        };
        let _ = writeln!(body, "    const real v{value} = {text};");
        self.keep(body, value);
    }

    fn library(&mut self, name: &'static str, operands: &[u32]) -> String {
        self.needs.library.insert(name);
        let operands: Vec<String> = operands.iter().map(|operand| self.text(*operand)).collect();
        format!("{}({})", self.real.function(name), operands.join(", "))
    }

    /// The number of a table in C.
    fn table(&mut self, number: usize) -> usize {
        let table = &self.listing.tables[number];
        let known = self.needs.tables.iter().position(|known| known == table);
        known.unwrap_or_else(|| {
            self.needs.tables.push(table.clone());
            self.needs.tables.len() - 1
        })
    }
}
