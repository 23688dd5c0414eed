//! The C file of a machine: its programs as functions, then `runtime.c` with its numbers filled in.

use std::fmt::Write as _;

use odyn_graph::Listing;

use super::Real;
use super::listing::{Needs, Written, write};
use crate::machine::Machine;
use crate::plan::Measure;
use crate::program::Program;
use crate::twin::{CONTRADICTION, OFF_CONSTRAINTS, TRIALS};

const DOUBLE: &str = include_str!("double.c");
const FLOAT: &str = include_str!("float.c");
const WHOLE_POWER: &str = include_str!("powers.c");
const REAL_POWER: &str = include_str!("real_power.c");
const TABLES: &str = include_str!("tables.c");
const RUNTIME: &str = include_str!("runtime.c");

/// A C file, and what it is made of.
pub(super) struct Source {
    pub(super) text: String,
    /// Operations of each program by its name.
    pub(super) operations: Vec<(&'static str, usize)>,
    /// Numbers in the scratch.
    pub(super) scratch: usize,
    /// The most local numbers of a function.
    pub(super) locals: usize,
    /// Functions of `math.h` besides the square root.
    pub(super) library: Vec<&'static str>,
}

/// A program with its name and the array that it writes.
type Part<'a> = (&'static str, &'a Program, &'static str);

/// The programs of a machine.
fn parts(machine: &Machine) -> Vec<Part<'_>> {
    let portable = &machine.portable;
    let mut parts: Vec<Part<'_>> = vec![("motion", &portable.motion, "motion")];
    if !portable.rows.is_empty() {
        parts.push(("position", &portable.position, "correction"));
        parts.push(("velocity", &portable.velocity, "correction"));
    }
    let optional = [
        ("outputs", &machine.quantities, "output"),
        ("angles", &machine.angles, "angles"),
        ("switches", &machine.switches, "switches"),
        ("watched", &machine.watched, "watched"),
    ];
    let optional = optional.into_iter().filter_map(|(name, found, out)| Some((name, &found.as_ref()?.program, out)));
    parts.extend(optional);
    parts
}

/// What an input slot of programs is in C.
fn input(machine: &Machine, real: Real, slot: u32) -> String {
    let (slot, layout, coordinates) = (slot as usize, &machine.layout, &machine.portable.coordinates);
    if slot == crate::plan::Layout::TIME {
        return "t".into();
    }
    if let Some(entry) = coordinates.entry_of(slot, layout) {
        return format!("y[{entry}]");
    }
    if let Some(place) = machine.references.iter().position(|(number, _)| layout.reference_slot() + number == slot) {
        return format!("m->reference[{place}]");
    }
    let first = layout.given_slot(0);
    if (first..first + machine.inputs.len()).contains(&slot) {
        let factor = machine.inputs[slot - first].factor;
        return match factor {
            1.0 => format!("m->input[{}]", slot - first),
            factor => format!("(m->input[{}] * {})", slot - first, real.number(factor)),
        };
    }
    let accelerations = coordinates.acceleration_slot..coordinates.acceleration_slot + coordinates.columns;
    if accelerations.contains(&slot) {
        return format!("m->motion[{}]", slot - accelerations.start);
    }
    let row = slot.checked_sub(layout.multiplier_slot());
    match row.and_then(|row| machine.portable.rows.iter().position(|used| *used == row)) {
        Some(place) => format!("m->motion[{}]", coordinates.columns + place),
        // Of rows that are not solved with.
        None => real.number(0.0),
    }
}

/// Writes the C file; `None` where a program calls opaque elements.
pub(super) fn source(machine: &Machine, real: Real, head: &str) -> Option<Source> {
    let mut needs = Needs::default();
    let mut programs = String::new();
    let mut operations = Vec::new();
    let mut most = Written::default();
    for (name, program, out) in parts(machine) {
        let listing: Listing = program.listing()?;
        // No name of a scene ends with an underscore, so that none of its functions is one of these.
        let function = format!("run__{name}");
        let slot = |slot| input(machine, real, slot);
        let written = write(
            &mut programs,
            &listing,
            (&function, &format!("{}_machine", machine.name), out),
            real,
            &slot,
            &mut needs,
        );
        operations.push((name, written.operations));
        most.scratch = most.scratch.max(written.scratch);
        most.locals = most.locals.max(written.locals);
    }
    let upper = machine.name.to_uppercase();
    let mut text = head.to_string();
    let _ = write!(
        text,
        "#include \"{name}.h\"\n\n#include <float.h>\n#include <math.h>\n#include <stdint.h>\n#include <string.h>\n\n",
        name = machine.name
    );
    text.push_str(exact(real));
    let _ = writeln!(text, "typedef {}_real real;\n", machine.name);
    match real {
        Real::Double => text.push_str("#define R(number) number\n#define F(function) function\n\n"),
        Real::Float => text.push_str("#define R(number) number##f\n#define F(function) function##f\n\n"),
    }
    numbers(&mut text, machine, real);
    let pieces = [
        (needs.turn, if real == Real::Double { DOUBLE } else { FLOAT }),
        (needs.whole_power, WHOLE_POWER),
        (needs.real_power, REAL_POWER),
        (!needs.tables.is_empty(), TABLES),
    ];
    for (_, piece) in pieces.into_iter().filter(|(needed, _)| *needed) {
        text.push_str(&piece.replace("@N@", &upper));
        text.push('\n');
    }
    tables(&mut text, &needs, real);
    text.push_str("/* ---- the equations ---- */\n\n");
    text.push_str(&programs);
    text.push_str(&runtime(machine, real, &upper));
    Some(Source {
        text,
        operations,
        scratch: most.scratch,
        locals: most.locals,
        library: needs.library.into_iter().collect(),
    })
}

/// What keeps compilers from other digits.
fn exact(real: Real) -> &'static str {
    match real {
        Real::Double => {
            "/* Nothing may be fused or kept with more digits: compile with -ffp-contract=off, and never with -ffast-math. */\n\
             #if defined(__FAST_MATH__)\n\
             #error \"-ffast-math changes the results\"\n\
             #endif\n\
             #if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 1\n\
             #error \"numbers with more digits than a double has change the results: use SSE2, -msse2 -mfpmath=sse\"\n\
             #endif\n\
             #if defined(__clang__) || !defined(__GNUC__)\n\
             #pragma STDC FP_CONTRACT OFF\n\
             #endif\n\n"
        }
        Real::Float => "",
    }
}

/// Sizes and coefficients.
fn numbers(text: &mut String, machine: &Machine, real: Real) {
    let portable = &machine.portable;
    let (columns, m) = (portable.coordinates.columns, portable.rows.len());
    let solved = |found: &Option<crate::analysis::Quantities>| {
        u8::from(found.as_ref().is_some_and(|found| found.solved)).to_string()
    };
    let number = |value: f64| real.number(value);
    let defined = [
        ("COLUMNS", columns.to_string()),
        ("ROWS", m.to_string()),
        ("ROTATIONS", portable.coordinates.rotations.len().to_string()),
        ("MOTION_STATES", portable.coordinates.motion.to_string()),
        ("RATES_FROM", (columns + m).to_string()),
        ("PIVOTS_FROM", machine.pivots_from().to_string()),
        ("PIVOTS_TO", portable.motion.output_count().to_string()),
        ("REFERENCES", machine.references.len().to_string()),
        ("OUTPUTS", machine.outputs.len().to_string()),
        ("OUTPUTS_ARE_SOLVED", solved(&machine.quantities)),
        ("SWITCHES", count(&machine.switches).to_string()),
        ("SWITCHES_ARE_SOLVED", solved(&machine.switches)),
        ("OTHERS", count(&machine.watched).to_string()),
        ("ROWS_LEFT_OUT", portable.others.len().to_string()),
        ("THIN", machine.thin.len().to_string()),
        ("STAGES", machine.method.b.len().to_string()),
        ("CORRECTIONS", machine.corrections.to_string()),
        ("LOCATED", machine.located.to_string()),
        ("TRIALS", TRIALS.to_string()),
        ("LENGTH", number(portable.length)),
        ("OFF_CONSTRAINTS", number(OFF_CONSTRAINTS)),
        // Of numbers with 7 digits fewer are left.
        ("LEAST_KEPT", number(if real == Real::Double { portable.least_kept } else { 1e-3 })),
    ];
    for (name, value) in defined {
        let _ = writeln!(text, "#define {name} {value}");
    }
    let list = |values: &mut dyn Iterator<Item = f64>| values.map(number).collect::<Vec<_>>().join(", ");
    let method = machine.method;
    let stages = method.b.len();
    let _ = writeln!(text, "\n/* {}, order {} */", method.name, method.order);
    let _ = writeln!(text, "static const real method_c[STAGES] = {{{}}};", list(&mut method.c.iter().copied()));
    let _ = writeln!(text, "static const real method_b[STAGES] = {{{}}};", list(&mut method.b.iter().copied()));
    let _ = writeln!(text, "static const real method_a[STAGES][STAGES] = {{");
    for row in method.a {
        let mut padded = row.iter().copied().chain(std::iter::repeat(0.0)).take(stages);
        let _ = writeln!(text, "    {{{}}},", list(&mut padded));
    }
    text.push_str("};\n");
    if m > 0 {
        let least = portable.squares.iter().map(|square| portable.least_independence * square);
        let _ =
            writeln!(text, "static const real row_sizes[ROWS] = {{{}}};", list(&mut portable.sizes.iter().copied()));
        let _ = writeln!(text, "static const real least_independence[ROWS] = {{{}}};", list(&mut { least }));
    }
    if !portable.others.is_empty() {
        let off = portable.others.iter().map(|(_, size)| CONTRADICTION * portable.length * size);
        let _ = writeln!(text, "static const real most_off[ROWS_LEFT_OUT] = {{{}}};", list(&mut { off }));
    }
    if !machine.thin.is_empty() {
        let _ = writeln!(text, "static const real thin[THIN][2] = {{");
        for axis in &machine.thin {
            let _ = writeln!(text, "    {{{}, {}}},", number(axis.moment), number(axis.share));
        }
        text.push_str("};\n");
    }
    text.push('\n');
}

fn count(found: &Option<crate::analysis::Quantities>) -> usize {
    found.as_ref().map_or(0, |found| found.program.output_count())
}

fn tables(text: &mut String, needs: &Needs, real: Real) {
    for (number, table) in needs.tables.iter().enumerate() {
        let breaks: Vec<String> = table.breaks.iter().map(|value| real.number(*value)).collect();
        let _ = writeln!(text, "static const real breaks_{number}[{}] = {{{}}};", breaks.len(), breaks.join(", "));
        let _ = writeln!(text, "static const real pieces_{number}[{}][4] = {{", table.pieces.len());
        for piece in &table.pieces {
            let [a, b, c, d] = piece.map(|value| real.number(value));
            let _ = writeln!(text, "    {{{a}, {b}, {c}, {d}}},");
        }
        text.push_str("};\n\n");
    }
}

/// `runtime.c` with everything filled in that is written out.
fn runtime(machine: &Machine, real: Real, upper: &str) -> String {
    let coordinates = &machine.portable.coordinates;
    let (mut rates, mut moved, mut normalised, mut change) =
        (String::new(), String::new(), String::new(), String::new());
    for line in &coordinates.lines {
        let (p, v, c) = (line.position, line.velocity, line.column);
        let _ = writeln!(rates, "    rates[{p}] = y[{v}];\n    rates[{v}] = m->motion[{c}];");
        let length = if line.measure == Measure::Length { "" } else { " * LENGTH" };
        let _ = writeln!(
            moved,
            "    y[{p}] += d[{c}];\n    step = F(fabs)(d[{c}]){length};\n    if (!(step <= size)) {{\n        size = step;\n    }}"
        );
        let _ = writeln!(change, "    y[{v}] += m->correction[{c}];");
    }
    for rotation in &coordinates.rotations {
        let (p, v, c) = (rotation.position, rotation.velocity, rotation.column);
        let _ = writeln!(rates, "    turning(y + {p}, y + {v}, rates + {p});");
        for k in 0..3 {
            let _ = writeln!(rates, "    rates[{}] = m->motion[{}];", v + k, c + k);
            let _ = writeln!(change, "    y[{}] += m->correction[{}];", v + k, c + k);
        }
        let _ = writeln!(
            moved,
            "    turning(y + {p}, d + {c}, rate);\n    for (k = 0; k < 4; ++k) {{\n        y[{p} + k] += rate[k];\n    }}\n    \
             normalise(y + {p});\n    for (k = 0; k < 3; ++k) {{\n        step = F(fabs)(d[{c} + k]) * LENGTH;\n        \
             if (!(step <= size)) {{\n            size = step;\n        }}\n    }}"
        );
        let _ = writeln!(normalised, "    normalise(y + {p});");
    }
    let mut outputs = String::new();
    for (number, port) in machine.outputs.iter().enumerate().filter(|(_, port)| port.factor != 1.0) {
        let _ = writeln!(outputs, "    m->output[{number}] /= {};", real.number(port.factor));
    }
    let start: String = machine.state.iter().map(|value| format!("        {},\n", real.number(*value))).collect();
    let mut inputs = String::new();
    for (number, (_, start)) in machine.references.iter().enumerate() {
        let _ = writeln!(inputs, "    m->reference[{number}] = {};", real.number(*start));
    }
    for (number, port) in machine.inputs.iter().enumerate() {
        let _ = writeln!(inputs, "    m->input[{number}] = {};", real.number(port.start));
    }
    let filled = [
        ("@rates@", rates),
        ("@move@", moved),
        ("@normalise@", normalised),
        ("@change@", change),
        ("@outputs@", outputs),
        ("@start@", start),
        ("@start_inputs@", inputs),
        ("@t_start@", real.number(machine.t_start)),
        ("@n@", machine.name.clone()),
        ("@N@", upper.to_string()),
    ];
    filled.iter().fold(RUNTIME.to_string(), |text, (mark, value)| text.replace(mark, value.trim_end_matches('\n')))
}
