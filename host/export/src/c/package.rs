//! All files of an export, and what a step costs.

use std::fmt::Write as _;

use super::Real;
use super::header::{comment, header, memory_of};
use super::source::{Source, source};
use crate::diagnostics::{Diagnostic, codes};
use crate::machine::Machine;
use crate::twin::TRIALS;

/// Bytes of a call on the stack beside the local numbers of the function: what gcc and clang take for x86-64 and Cortex-M is less.
const CALL: usize = 256;
/// Calls inside each other in a step.
const DEPTH: usize = 6;

/// What a step costs, constant by construction.
#[derive(Debug, Clone)]
pub struct Cost {
    /// Operations of each program by its name.
    pub programs: Vec<(&'static str, usize)>,
    /// Operations of a step without a switch and without samples; where sizes of steps follow from a tolerance, of one trial.
    pub step: usize,
    /// Operations of a step in which as many switches as possible are located and everything samples; of steps of variable size,
    /// whose number has no bound, of one.
    pub most: usize,
    /// Operations of a look at the outputs.
    pub outputs: usize,
    /// Bytes of the memory of one machine.
    pub memory: usize,
    /// Bytes on the stack at most, in optimised code.
    pub stack: usize,
    /// Functions of `math.h` besides the square root, whose last digits are those of the library in use.
    pub library: Vec<&'static str>,
}

/// Files by their names, and what a step costs.
#[derive(Debug, Clone)]
pub struct Package {
    /// Name and text of each file.
    pub files: Vec<(String, String)>,
    /// What a step costs.
    pub cost: Cost,
}

/// The example among the files, which is there to be changed.
pub const EXAMPLE: &str = "main.c";

/// A machine as C: the file, its header, an example that writes a table, a Makefile.
///
/// # Errors
/// Identifiers of two ports are the same in C.
pub fn package(machine: &Machine, real: Real) -> Result<Package, Diagnostic> {
    different(machine)?;
    let head = head(machine, real);
    let refused = || Diagnostic::error(codes::CANNOT_EXPORT, "a program calls an opaque element");
    let source = source(machine, real, &head).ok_or_else(refused)?;
    let cost = cost(machine, &source, real);
    let name = &machine.name;
    let files = vec![
        (format!("{name}.h"), header(machine, real, &source, &head)),
        (format!("{name}.c"), source.text.clone()),
        (EXAMPLE.to_string(), example(machine)),
        ("Makefile".to_string(), makefile(machine)),
    ];
    Ok(Package { files, cost })
}

/// Names that differ only in what C does not take would be one.
fn different(machine: &Machine) -> Result<(), Diagnostic> {
    for ports in [&machine.inputs, &machine.outputs] {
        let mut names: Vec<(String, &str)> =
            ports.iter().map(|port| (crate::machine::identifier(&port.name), port.name.as_str())).collect();
        names.sort();
        if let Some(pair) = names.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let message = format!("`{}` and `{}` are the same name in C: `{}`", pair[0].1, pair[1].1, pair[0].0);
            return Err(Diagnostic::error(codes::CANNOT_EXPORT, message).help("rename one of them"));
        }
    }
    Ok(())
}

/// The comment at the top of files.
fn head(machine: &Machine, real: Real) -> String {
    let kind = match machine.tolerance {
        Some(tolerance) => format!("steps of variable size (tolerance {tolerance:?})"),
        None => "steps of a fixed size".into(),
    };
    let digits = match real {
        Real::Double => "In double it computes the digits of O-DYN's interpreter.",
        Real::Float => "In float: about seven digits.",
    };
    format!(
        "/* The equations of motion of `{}`, with {kind} by {} (order {}). Written by `odyn export c`, O-DYN {}.\n   No allocation, no \
         state but what the caller keeps. {digits} */\n\n",
        comment(&machine.title),
        machine.method.name,
        machine.method.order,
        env!("CARGO_PKG_VERSION"),
    )
}

fn cost(machine: &Machine, source: &Source, real: Real) -> Cost {
    let of = |name: &str| source.operations.iter().find(|(known, _)| *known == name).map_or(0, |(_, count)| *count);
    let (n, stages) = (machine.dim(), machine.method.b.len());
    // Multiplications and additions of the method.
    let sums = n * (stages * (stages - 1) + 2 * stages + 2 * (stages + 1));
    let project = machine.corrections * of("position") + of("velocity") + 2 * machine.portable.coordinates.columns;
    let sums = if machine.method.implicit.is_some() {
        // Right sides, triangles, their solutions.
        sums + n * (stages * (stages + 3)) + (2 * n * n * n + 3 * n * n).div_ceil(3) + stages * 2 * n * n
    } else {
        sums
    };
    let advance = stages * (of("motion") + of("switches")) + sums + project;
    let solved = machine.switches.as_ref().is_some_and(|found| found.solved);
    let look = of("switches") + if solved { of("motion") } else { 0 };
    let accepted = of("angles") + of("watched");
    let linearised = if machine.method.implicit.is_some() { (n + 1) * of("tangent") } else { 0 };
    // Judging a step takes the rates at its end.
    let judged = if machine.tolerance.is_some() { of("motion") + 2 * n * (stages + 1) + of("angles") } else { 0 };
    let part = linearised + advance + judged + 2 * look + accepted;
    let located = if machine.switches.is_some() { machine.located } else { 0 };
    let sampled = &machine.sampled;
    let sample = of("samples") + if sampled.next.as_ref().is_some_and(|found| found.solved) { of("motion") } else { 0 };
    let parts = 1 + sampled.divisions(machine.step, machine.t_start);
    let samples = sampled.instants(machine.step) * sample;
    let outputs = of("outputs") + if machine.solves_for_outputs() { of("motion") } else { 0 };
    Cost {
        programs: source.operations.clone(),
        step: part,
        // A switch: up to it, over it, and what is left of the step.
        most: parts * (part + located * (2 * part + TRIALS * (advance + look))) + samples,
        outputs,
        memory: memory_of(machine, source, real),
        stack: source.locals * real.size() + DEPTH * CALL,
        library: source.library.clone(),
    }
}

fn makefile(machine: &Machine) -> String {
    let name = &machine.name;
    format!(
        "# Without -ffp-contract=off a compiler may fuse products and sums, which changes the last digits.\n\
         CC ?= cc\nCFLAGS ?= -O2\nOWN = -std=c99 -Wall -Wextra -pedantic -ffp-contract=off\n\n\
         {name}: main.o {name}.o\n\t$(CC) $(CFLAGS) -o $@ main.o {name}.o -lm\n\n\
         %.o: %.c {name}.h\n\t$(CC) $(CFLAGS) $(OWN) -c -o $@ $<\n\n\
         clean:\n\trm -f {name} main.o {name}.o\n\n.PHONY: clean\n"
    )
}

/// A program that steps a machine and writes a table.
fn example(machine: &Machine) -> String {
    let (name, upper) = (&machine.name, machine.name.to_uppercase());
    let (factor, unit) = &machine.time_unit;
    let text = |text: &str| text.replace('\\', "\\\\").replace('"', "\\\"");
    let mut columns = format!("time [{}]", text(unit));
    for port in &machine.outputs {
        let _ = write!(columns, ",{} [{}]", text(&port.name), text(&port.unit));
    }
    let columns = columns.replace('%', "%%").replace("??", "?\"\"?");
    format!(
        "/* Steps `{title}` from its start to its end and writes a table of the outputs: {name} [STEPS [EVERY]]. */\n\n\
         #include <stdio.h>\n#include <stdlib.h>\n\n#include \"{name}.h\"\n\n\
         static void row(const {name}_machine *m) {{\n    int i;\n    printf(\"%.17g\", (double)m->time / {factor:?});\n    \
         for (i = 0; i < {upper}_OUTPUTS; ++i) {{\n        printf(\",%.17g\", {value});\n    }}\n    printf(\"\\n\");\n}}\n\n\
         int main(int argc, char **argv) {{\n    static {name}_machine m;\n    \
         const double duration = (double){upper}_END_TIME - (double){upper}_START_TIME;\n    \
         long steps = (long)(duration / (double){upper}_STEP + 0.5);\n    long every = 1;\n    long k;\n    \
         if (argc > 1) {{\n        steps = strtol(argv[1], NULL, 10);\n    }}\n    \
         if (argc > 2) {{\n        every = strtol(argv[2], NULL, 10);\n    }}\n    \
         if (steps < 1 || every < 1) {{\n        fprintf(stderr, \"usage: {name} [STEPS [EVERY]]\\n\");\n        return 2;\n    }}\n    \
         printf(\"{columns}\\n\");\n    {name}_start(&m);\n    row(&m);\n    for (k = 1; k <= steps; ++k) {{\n        \
         int status = {name}_step(&m, ({name}_real)(duration / (double)steps));\n        \
         if (status != {upper}_OK) {{\n            \
         fprintf(stderr, \"at %g s: %s\\n\", (double)m.time, {name}_message(status));\n            return 1;\n        }}\n        \
         if (k % every == 0 || k == steps) {{\n            {name}_outputs(&m);\n            row(&m);\n        }}\n    }}\n    \
         return 0;\n}}\n",
        title = comment(&machine.title),
        value = if machine.outputs.is_empty() { "0.0 * i" } else { "(double)m->output[i]" },
    )
}
