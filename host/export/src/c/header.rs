//! The header of a machine: its memory, its functions, names and units.

use std::fmt::Write as _;

use super::Real;
use super::source::Source;
use crate::analysis::Group;
use crate::machine::{Machine, Port, identifier};
use crate::parameters::Parameter;
use crate::steps::Sizes;

/// Writes the header.
pub(super) fn header(machine: &Machine, real: Real, source: &Source, head: &str) -> String {
    let (name, upper) = (&machine.name, machine.name.to_uppercase());
    let mut text = head.to_string();
    let _ = write!(
        text,
        "#ifndef {upper}_H\n#define {upper}_H\n\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
         typedef {} {name}_real;\n\n",
        real.name()
    );
    let _ = writeln!(text, "/* All quantities of the state are in SI units; inputs and outputs are in their own. */");
    let _ = writeln!(text, "#define {upper}_STATES {}", machine.dim());
    let _ = writeln!(text, "#define {upper}_INPUTS {}", machine.inputs.len());
    let _ = writeln!(text, "#define {upper}_OUTPUTS {}", machine.outputs.len());
    let _ = writeln!(text, "#define {upper}_PARAMETERS {}", machine.parameters.settable.len());
    let switches = machine.switches.as_ref().map_or(0, |found| found.program.output_count());
    let _ = writeln!(text, "#define {upper}_SWITCHES {switches}");
    let _ = writeln!(
        text,
        "#define {upper}_COUNTED {} /* angles that are counted over full turns */",
        machine.references.len()
    );
    let _ = writeln!(text, "#define {upper}_IS_ADAPTIVE {}", u8::from(machine.tolerance.is_some()));
    let _ = writeln!(text, "#define {upper}_CLOCKS {}", machine.sampled.clocks.len());
    if machine.derivatives {
        let _ = writeln!(text, "#define {upper}_SEEDS {}", machine.seeds());
    }
    let _ = writeln!(text, "#define {upper}_MOST_TURN {} /* rad */", real.number(crate::twin::MOST_TURN));
    let _ = writeln!(text, "#define {upper}_START_TIME {} /* s */", real.number(machine.t_start));
    let _ = writeln!(text, "#define {upper}_END_TIME {} /* s */", real.number(machine.t_end));
    let longest = if machine.tolerance.is_some() { ", the longest" } else { "" };
    let _ = writeln!(text, "#define {upper}_STEP {} /* s{longest} */\n", real.number(machine.step));
    ports(&mut text, &machine.inputs, &format!("{upper}_INPUT"), "inputs");
    ports(&mut text, &machine.outputs, &format!("{upper}_OUTPUT"), "outputs");
    let ranged = |parameter: &Parameter| {
        let about = format!("{}, {}", parameter.port.about, parameter.span());
        Port { about, ..parameter.port.clone() }
    };
    let parameters: Vec<Port> = machine.parameters.settable.iter().map(ranged).collect();
    ports(&mut text, &parameters, &format!("{upper}_PARAMETER"), "parameters");
    states(&mut text, machine);
    let _ = write!(
        text,
        "enum {{\n    {upper}_OK = 0,\n    {upper}_SINGULAR = 1,\n    {upper}_NOT_FINITE = 2,\n    \
         {upper}_OFF_CONSTRAINTS = 3,\n    {upper}_CONTRADICTION = 4,\n    {upper}_TURNS_THIN_AXIS = 5,\n    {upper}_TURNS_TOO_FAR = 6,\n    {upper}_OUT_OF_RANGE = 7,\n    {upper}_STEP_TOO_SMALL = 8\n}};\n\n"
    );
    memory(&mut text, machine, source);
    let parameters = if machine.parameters.settable.is_empty() {
        String::new()
    } else {
        format!(
            "/* Lets the equations follow the parameters of m; time and state stay. A parameter outside of its range changes nothing. */\n\
             int {name}_follow_parameters({name}_machine *m);\n\n"
        )
    };
    let derivatives = if machine.derivatives {
        format!(
            "/* Exact derivatives of rates, outputs and switches at the state and time of m, along the direction in m->seed: along time,\n   \
             then states, then inputs. Outputs and switches may be NULL. */\n\
             void {name}_derivatives({name}_machine *m, {name}_real *rates, {name}_real *outputs, {name}_real *switches);\n\n"
        )
    } else {
        String::new()
    };
    let samples = if machine.sampled.clocks.is_empty() {
        String::new()
    } else {
        format!(
            "/* To the memories before the first sample; what is due at the time of m samples. Called by {name}_start, and before the\n   \
             first step, so that it takes what was set meanwhile. */\nvoid {name}_begin({name}_machine *m);\n\n\
             /* What is due samples; whether something was. Called by {name}_step where it begins and where it is divided. */\n\
             int {name}_sample({name}_machine *m);\n\n\
             /* Time until something samples next, s. */\n{name}_real {name}_until_sample(const {name}_machine *m);\n\n"
        )
    };
    let step = if machine.tolerance.is_some() {
        "In steps whose sizes follow from the tolerance, none longer than the one above"
    } else {
        "One step"
    };
    let _ = write!(
        text,
        "/* To the start of the scene, with outputs. */\nvoid {name}_start({name}_machine *m);\n\n\
         /* {step}, over h seconds; inputs stay as they are during it. Gives a status; unless it is {upper}_OK, time and state are\n   \
         where they were reached last. */\nint {name}_step({name}_machine *m, {name}_real h);\n\n\
         /* The outputs at the state and time of m. */\nvoid {name}_outputs({name}_machine *m);\n\n\
         /* The rates of a state y at time t, with the inputs of m. */\n\
         int {name}_rates({name}_machine *m, {name}_real t, const {name}_real *y, {name}_real *rates);\n\n\
         /* Brings a state to the constraints: after it was changed from outside. */\n\
         int {name}_project({name}_machine *m, {name}_real t, {name}_real *y);\n\n\
         /* The worst violation of the constraints at the state and time of m, as a share of the scene's length. */\n\
         {name}_real {name}_violation({name}_machine *m);\n\n\
         /* Lets the counted angles follow the state of m, after a step of another method than {name}_step. Gives the fastest of\n   \
         their rates, rad/s: steps that turn one by more than {upper}_MOST_TURN lose count. */\n\
         {name}_real {name}_follow({name}_machine *m);\n\n\
         /* Whether the state of m is one that the equations can follow, after a step of another method: rows that followed from others at\n   \
         the start still do, and nothing turns about an axis without moment of inertia. Gives a status. */\n\
         int {name}_watch({name}_machine *m);\n\n\
         /* Functions that change their sign where equations switch, {upper}_SWITCHES of them. */\n\
         void {name}_switches({name}_machine *m, {name}_real *found);\n\n\
         {samples}{parameters}{derivatives}/* A status in words. */\nconst char *{name}_message(int status);\n\n\
         #ifdef __cplusplus\n}}\n#endif\n\n#endif\n"
    );
    text
}

/// The memory of one machine.
fn memory(text: &mut String, machine: &Machine, source: &Source) {
    let (name, upper) = (&machine.name, machine.name.to_uppercase());
    let count =
        |found: &Option<crate::analysis::Quantities>| found.as_ref().map_or(0, |found| found.program.output_count());
    let m = machine.portable.rows.len();
    let correction =
        if m > 0 { machine.portable.position.output_count().max(machine.portable.velocity.output_count()) } else { 0 };
    let switches = count(&machine.switches);
    let _ = write!(
        text,
        "/* All memory of one machine: copied, it is another one at the same place. */\ntypedef struct {name}_machine {{\n    \
         {name}_real time; /* s */\n    {name}_real lost_time; /* what the sum of steps lost by rounding, s */\n    \
         {name}_real state[{upper}_STATES];\n"
    );
    let largest_kinetic = usize::from(!machine.thin.is_empty());
    for (field, size, about) in [
        ("input", machine.inputs.len(), "by the indices above, in their units"),
        ("output", machine.outputs.len(), "likewise"),
        (
            "parameter",
            machine.parameters.settable.len(),
            "likewise; behind a change, call the function that lets the equations follow",
        ),
        ("followed", machine.parameters.followed.len(), "numbers of the equations that follow them"),
        ("reference", machine.references.len(), "angles that are counted over full turns, rad"),
        ("memory", machine.sampled.start.len(), "memories of elements that sample, SI"),
        ("next_sample", machine.sampled.clocks.len(), "which multiple of its period each of them takes next"),
    ] {
        array(text, name, field, size, about);
    }
    if machine.tangents.is_some() {
        array(text, name, "seed", machine.seeds(), "a direction: along time, states, inputs");
    }
    if largest_kinetic > 0 {
        let _ = writeln!(text, "    {name}_real largest_kinetic; /* J */");
    }
    if machine.tolerance.is_some() {
        let _ = writeln!(text, "    {name}_real tolerance; /* share of sizes that the error of a step may be */");
        let _ = writeln!(text, "    {name}_real step_size; /* of the next step, s; 0: not known yet */");
        array(text, name, "sizes", Sizes::of(machine).least.len(), "that errors are measured by");
    }
    text.push_str("    /* Room for what is computed on the way. */\n");
    for (field, size) in [
        ("motion", machine.portable.motion.output_count()),
        ("correction", correction),
        ("angles", 2 * machine.references.len()),
        ("switches", switches),
        ("first", switches),
        ("last", switches),
        ("lower", switches),
        ("low", switches),
        ("high", switches),
        ("watched", count(&machine.watched)),
        ("samples", count(&machine.sampled.next)),
        ("scratch", source.scratch),
        ("stage", machine.dim()),
        ("next", machine.dim()),
        ("trial", if switches > 0 { machine.dim() } else { 0 }),
    ] {
        array(text, name, field, size, "");
    }
    if let Some(tangents) = &machine.tangents {
        let count = |found: &Option<crate::program::Program>| found.as_ref().map_or(0, |found| found.output_count());
        array(text, name, "tangent", tangents.motion.output_count(), "");
        array(text, name, "output_tangent", count(&tangents.outputs), "");
        array(text, name, "switch_tangent", count(&tangents.switches), "");
    }
    if machine.method.implicit.is_some() {
        array(text, name, "by_time", machine.dim(), "");
        for field in ["jacobian", "matrix"] {
            let _ = writeln!(text, "    {name}_real {field}[{upper}_STATES][{upper}_STATES];");
        }
    }
    let stages = machine.method.b.len();
    let _ = writeln!(text, "    {name}_real slopes[{stages}][{upper}_STATES];");
    if machine.method.implicit.is_some() {
        let _ = writeln!(text, "    int exchanged[{upper}_STATES];");
    }
    // Behind all that is narrower, so that nothing is made up in between.
    for (count, about) in counters(machine) {
        let _ = writeln!(text, "    unsigned long {count}; /* {about} */");
    }
    let _ = writeln!(text, "}} {name}_machine;\n");
}

/// Numbers of the struct.
pub(super) fn memory_of(machine: &Machine, source: &Source, real: Real) -> usize {
    let mut text = String::new();
    memory(&mut text, machine, source);
    let upper = machine.name.to_uppercase();
    let numbers: usize = text
        .lines()
        .filter(|line| line.contains("_real "))
        .map(|line| {
            let sizes = line.split('[').skip(1).filter_map(|part| part.split(']').next());
            let size =
                |text: &str| if *text == format!("{upper}_STATES") { machine.dim() } else { text.parse().unwrap_or(1) };
            sizes.map(size).product::<usize>()
        })
        .sum();
    let whole = counters(machine).len() * size_of::<usize>();
    let exchanged = if machine.method.implicit.is_some() { machine.dim() * size_of::<i32>() } else { 0 };
    // Numbers of 32 bits before and behind wider ones are made up to whole ones of these.
    (numbers * real.size() + whole + exchanged).next_multiple_of(real.size().max(if whole > 0 { 8 } else { 4 }))
}

/// Whole numbers that are counted, with what they say.
fn counters(machine: &Machine) -> Vec<(&'static str, &'static str)> {
    let mut found = Vec::new();
    if machine.switches.is_some() {
        found.push(("located", "switches at which steps were made to end"));
        found.push(("passed", "steps in which more fell than are located"));
    }
    if machine.tolerance.is_some() {
        found.push(("rejected", "steps that were tried and found too long"));
    }
    if !machine.sampled.clocks.is_empty() {
        found.push(("begun", "whether the first step was begun"));
    }
    found
}

fn array(text: &mut String, name: &str, field: &str, size: usize, about: &str) {
    if size > 0 {
        let about = if about.is_empty() { String::new() } else { format!(" /* {about} */") };
        let _ = writeln!(text, "    {name}_real {field}[{size}];{about}");
    }
}

fn ports(text: &mut String, ports: &[Port], prefix: &str, what: &str) {
    if ports.is_empty() {
        return;
    }
    let _ = writeln!(text, "/* Indices of {what}. */\nenum {{");
    for (number, port) in ports.iter().enumerate() {
        let comma = if number + 1 < ports.len() { "," } else { "" };
        let about = comment(&format!("{} [{}] {}", port.name, port.unit, port.about));
        let name = identifier(&port.name);
        let _ = writeln!(text, "    {prefix}_{name} = {number}{comma} /* {about} */");
    }
    text.push_str("};\n\n");
}

/// What the entries of the state are.
fn states(text: &mut String, machine: &Machine) {
    text.push_str("/* The state, by index:\n");
    for (number, group) in machine.portable.groups.iter().enumerate() {
        let what = match group {
            Group::Position => "coordinate of a joint, m",
            Group::Parameter => "coordinate of a joint, rad, or Euler parameter of one",
            Group::Velocity => "rate of a coordinate, m/s",
            Group::AngularVelocity => "rate of a coordinate, or angular velocity, rad/s",
            Group::State => "state of an element",
            Group::Work => "work done by everything without a potential, J",
        };
        let _ = writeln!(text, "   {number}: {what}");
    }
    text.push_str("*/\n\n");
}

/// Text that does not end a comment.
pub(super) fn comment(text: &str) -> String {
    text.replace("*/", "* /").replace("/*", "/ *").replace(['\n', '\r'], " ")
}
