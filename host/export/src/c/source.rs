//! The C file of a machine: its programs as functions, then `runtime.c` with its numbers filled in.

use std::fmt::Write as _;

use odyn_graph::Listing;

use super::Real;
use super::listing::{Needs, Written, write};
use crate::laws::Form;
use crate::machine::{Machine, Slot};
use crate::plan::Measure;
use crate::program::Program;
use crate::sampled::{BEHIND, EARLY, Sampled};
use crate::steps::{LEAST, MOST_TRIALS, Sizes};
use crate::twin::{CONTRADICTION, OFF_CONSTRAINTS, TRIALS, WIDTH};

const DOUBLE: &str = include_str!("double.c");
const FLOAT: &str = include_str!("float.c");
const WHOLE_POWER: &str = include_str!("powers.c");
const REAL_POWER: &str = include_str!("real_power.c");
const TABLES: &str = include_str!("tables.c");
const RUNTIME: &str = include_str!("runtime.c");
const TANGENTS: &str = include_str!("tangents.c");
const PARAMETERS: &str = include_str!("parameters.c");
const EXPLICIT: &str = include_str!("explicit.c");
const SAMPLED: &str = include_str!("sampled.c");
const CONTROL: &str = include_str!("control.c");
const ROSENBROCK: &str = include_str!("rosenbrock.c");

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
        ("samples", &machine.sampled.next, "samples"),
    ];
    let optional = optional.into_iter().filter_map(|(name, found, out)| Some((name, &found.as_ref()?.program, out)));
    parts.extend(optional);
    if let Some(tangents) = &machine.tangents {
        parts.push(("tangent", &tangents.motion, "tangent"));
        let of = [("output_tangent", &tangents.outputs), ("switch_tangent", &tangents.switches)];
        parts.extend(of.into_iter().filter_map(|(name, found)| Some((name, found.as_ref()?, name))));
    }
    parts
}

/// What an input slot of programs is in C.
fn input(machine: &Machine, real: Real, slot: u32) -> String {
    let in_si = |text: String, number: usize| match machine.inputs[number].factor {
        1.0 => text,
        factor => format!("({text} * {})", real.number(factor)),
    };
    match machine.slot(slot as usize) {
        Slot::Time => "t".into(),
        Slot::State(entry) => format!("y[{entry}]"),
        Slot::Reference(number) => format!("m->reference[{number}]"),
        Slot::Memory(number) => format!("m->memory[{number}]"),
        Slot::Input(number) => in_si(format!("m->input[{number}]"), number),
        Slot::Solved(number) => format!("m->motion[{number}]"),
        Slot::Seed(number) => {
            let text = format!("m->seed[{number}]");
            match number.checked_sub(1 + machine.dim()) {
                Some(input) => in_si(text, input),
                None => text,
            }
        }
        Slot::SolvedTangent(number) => format!("m->tangent[{number}]"),
        Slot::Followed(number) => format!("m->followed[{number}]"),
        Slot::Unused => real.number(0.0),
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
    numbers(&mut text, machine, real, &upper);
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

/// When elements sample, and what they remember before.
fn samples(text: &mut String, machine: &Machine, real: Real) {
    let Sampled { start, clocks, .. } = &machine.sampled;
    let joined = |values: &mut dyn Iterator<Item = String>| values.collect::<Vec<_>>().join(", ");
    let [early, behind] = [EARLY, BEHIND].map(|shares| real.number(shares[usize::from(real == Real::Float)]));
    let _ = writeln!(text, "/* Share of a period by which a sample may be early. */\n#define EARLY {early}");
    let _ = writeln!(
        text,
        "/* Share of the time by which functions are looked at behind a sample. */\n#define BEHIND {behind}"
    );
    let periods = joined(&mut clocks.iter().map(|clock| real.number(clock.period)));
    let _ = writeln!(text, "static const real periods[CLOCKS] = {{{periods}}};");
    let ends = clocks.iter().map(|clock| clock.memory.end.to_string());
    let from = joined(&mut std::iter::once("0".to_string()).chain(ends));
    let _ = writeln!(text, "static const int memory_from[CLOCKS + 1] = {{{from}}};");
    let memory = joined(&mut start.iter().map(|value| real.number(*value)));
    let _ = writeln!(text, "static const real memory_start[{}] = {{{memory}}};", start.len());
}

/// Sizes and coefficients.
fn numbers(text: &mut String, machine: &Machine, real: Real, upper: &str) {
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
        ("TANGENTS", u8::from(machine.tangents.is_some()).to_string()),
        ("DERIVATIVES", u8::from(machine.derivatives).to_string()),
        ("PARAMETERS", machine.parameters.settable.len().to_string()),
        ("SEEDS", machine.seeds().to_string()),
        ("CLOCKS", machine.sampled.clocks.len().to_string()),
        ("SAMPLES_ARE_SOLVED", solved(&machine.sampled.next)),
        ("ADAPTIVE", u8::from(machine.tolerance.is_some()).to_string()),
        ("IMPLICIT", u8::from(machine.method.implicit.is_some()).to_string()),
        ("STAGES", machine.method.b.len().to_string()),
        ("CORRECTIONS", machine.corrections.to_string()),
        ("LOCATED", machine.located.to_string()),
        ("TRIALS", TRIALS.to_string()),
        ("WIDTH", number(if real == Real::Double { WIDTH[0] } else { WIDTH[1] })),
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
    let square = |text: &mut String, name: &str, rows: &[&[f64]]| {
        let _ = writeln!(text, "static const real {name}[STAGES][STAGES] = {{");
        for row in rows {
            let mut padded = row.iter().copied().chain(std::iter::repeat(0.0)).take(stages);
            let _ = writeln!(text, "    {{{}}},", list(&mut padded));
        }
        text.push_str("};\n");
    };
    square(text, "method_a", method.a);
    if let Some(implicit) = method.implicit {
        let _ = writeln!(text, "static const real method_gamma = {};", number(implicit.gamma));
        square(text, "method_coupling", implicit.coupling);
        let times = list(&mut implicit.times.iter().copied());
        let _ = writeln!(text, "static const real method_times[STAGES] = {{{times}}};");
    }
    if let Some(tolerance) = machine.tolerance {
        let Sizes { of, least } = Sizes::of(machine);
        let _ = writeln!(
            text,
            "#define TOLERANCE {}\n#define LEAST {}\n#define MOST_TRIALS {MOST_TRIALS}\n#define SIZES_FIXED {}",
            number(tolerance),
            number(LEAST),
            Sizes::FIXED
        );
        let error = list(&mut method.error.iter().copied());
        let _ = writeln!(text, "static const real method_error[STAGES + 1] = {{{error}}};");
        let of: Vec<String> = of.iter().map(|size| size.map_or_else(|| "-1".into(), |size| size.to_string())).collect();
        let _ = writeln!(text, "static const int size_of[{upper}_STATES] = {{{}}};", of.join(", "));
        let _ = writeln!(
            text,
            "static const real sizes_least[{}] = {{{}}};",
            least.len(),
            list(&mut least.iter().copied())
        );
    }
    if !machine.sampled.clocks.is_empty() {
        samples(text, machine, real);
    }
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
    if !machine.parameters.settable.is_empty() {
        let _ = writeln!(text, "static const real parameter_range[PARAMETERS][2] = {{");
        for parameter in &machine.parameters.settable {
            let [low, high] = parameter.range;
            let _ = writeln!(text, "    {{{}, {}}},", number(low), number(high));
        }
        text.push_str("};\n");
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

/// What follows parameters, as [`crate::Law::value`] computes it.
fn followed(machine: &Machine, real: Real) -> String {
    let mut text = String::new();
    for (number, law) in machine.parameters.followed.iter().enumerate() {
        let at = real.number(law.at);
        let base = |parameter: usize| real.number(machine.parameters.base[parameter]);
        if law.form == Form::Powers {
            let _ = writeln!(text, "    value = {at};");
            for (parameter, [power, _]) in &law.terms {
                let sign = if *power > 0.0 { '*' } else { '/' };
                for _ in 0..power.abs() as i32 {
                    let _ = writeln!(text, "    value = value {sign} (p[{parameter}] / {});", base(*parameter));
                }
            }
            let _ = writeln!(text, "    found[{number}] = value;");
            continue;
        }
        let _ = writeln!(text, "    value = {};", real.number(0.0));
        for (parameter, [a, b]) in &law.terms {
            let d = format!("(p[{parameter}] - {})", base(*parameter));
            let _ = writeln!(text, "    value += ({} + {} * {d}) * {d};", real.number(*a), real.number(*b));
        }
        let whole = match law.form {
            Form::Reciprocal => format!("{at} / ({} + value)", real.number(1.0)),
            Form::Polynomial | Form::Powers => format!("{at} + value"),
        };
        let _ = writeln!(text, "    found[{number}] = {whole};");
    }
    text
}

/// `runtime.c` with everything filled in that is written out.
fn runtime(machine: &Machine, real: Real, upper: &str) -> String {
    let coordinates = &machine.portable.coordinates;
    let (mut rates, mut moved, mut normalised, mut change, mut tangents) =
        (String::new(), String::new(), String::new(), String::new(), String::new());
    for line in &coordinates.lines {
        let (p, v, c) = (line.position, line.velocity, line.column);
        let _ = writeln!(rates, "    rates[{p}] = y[{v}];\n    rates[{v}] = m->motion[{c}];");
        let length = if line.measure == Measure::Length { "" } else { " * LENGTH" };
        let _ = writeln!(
            moved,
            "    y[{p}] += d[{c}];\n    step = F(fabs)(d[{c}]){length};\n    if (!(step <= size)) {{\n        size = step;\n    }}"
        );
        let _ = writeln!(change, "    y[{v}] += m->correction[{c}];");
        let _ = writeln!(tangents, "    found[{p}] = dy[{v}];\n    found[{v}] = m->tangent[{c}];");
    }
    for rotation in &coordinates.rotations {
        let (p, v, c) = (rotation.position, rotation.velocity, rotation.column);
        let _ = writeln!(rates, "    turning(y + {p}, y + {v}, rates + {p});");
        let _ = writeln!(
            tangents,
            "    turning(dy + {p}, y + {v}, found + {p});\n    turning(y + {p}, dy + {v}, moved);\n    \
             for (i = 0; i < 4; ++i) {{\n        found[{p} + i] += moved[i];\n    }}"
        );
        for k in 0..3 {
            let _ = writeln!(rates, "    rates[{}] = m->motion[{}];", v + k, c + k);
            let _ = writeln!(change, "    y[{}] += m->correction[{}];", v + k, c + k);
            let _ = writeln!(tangents, "    found[{}] = m->tangent[{}];", v + k, c + k);
        }
        let _ = writeln!(
            moved,
            "    turning(y + {p}, d + {c}, rate);\n    for (k = 0; k < 4; ++k) {{\n        y[{p} + k] += rate[k];\n    }}\n    \
             normalise(y + {p});\n    for (k = 0; k < 3; ++k) {{\n        step = F(fabs)(d[{c} + k]) * LENGTH;\n        \
             if (!(step <= size)) {{\n            size = step;\n        }}\n    }}"
        );
        let _ = writeln!(normalised, "    normalise(y + {p});");
    }
    let (mut outputs, mut output_tangents) = (String::new(), String::new());
    for (number, port) in machine.outputs.iter().enumerate().filter(|(_, port)| port.factor != 1.0) {
        let _ = writeln!(outputs, "    m->output[{number}] /= {};", real.number(port.factor));
        let _ = writeln!(output_tangents, "        outputs[{number}] /= {};", real.number(port.factor));
    }
    let start: String = machine.state.iter().map(|value| format!("        {},\n", real.number(*value))).collect();
    let mut inputs = String::new();
    for (number, (_, start)) in machine.references.iter().enumerate() {
        let _ = writeln!(inputs, "    m->reference[{number}] = {};", real.number(*start));
    }
    for (number, parameter) in machine.parameters.settable.iter().enumerate() {
        let _ = writeln!(inputs, "    m->parameter[{number}] = {};", real.number(parameter.port.start));
    }
    for (number, port) in machine.inputs.iter().enumerate() {
        let _ = writeln!(inputs, "    m->input[{number}] = {};", real.number(port.start));
    }
    let advance = if machine.method.implicit.is_some() { ROSENBROCK } else { EXPLICIT };
    let filled = [
        ("@tangents@", if machine.tangents.is_some() { TANGENTS.into() } else { String::new() }),
        ("@sampled@", if machine.sampled.clocks.is_empty() { String::new() } else { SAMPLED.into() }),
        ("@control@", if machine.tolerance.is_none() { String::new() } else { CONTROL.into() }),
        ("@parameters@", if machine.parameters.settable.is_empty() { String::new() } else { PARAMETERS.into() }),
        ("@followed@", followed(machine, real)),
        ("@advance@", advance.into()),
        ("@rate_tangents@", tangents),
        ("@output_tangents@", output_tangents),
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
