//! `modelDescription.xml`, for both versions, and the build description.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use odyn_scene::Dimension;

use super::dependencies::{Dependencies, Known, tunable};
use super::{Kinds, Version};
use crate::analysis::Group;
use crate::diagnostics::{Diagnostic, codes};
use crate::machine::{Machine, Port};

/// A variable.
struct Variable {
    name: String,
    reference: usize,
    causality: &'static str,
    variability: &'static str,
    initial: &'static str,
    range: Option<[f64; 2]>,
    start: Option<f64>,
    nominal: Option<f64>,
    unit: String,
    about: String,
    /// The value reference of what it is the rate of.
    rate_of: Option<usize>,
}

impl Variable {
    /// What both versions say of it.
    fn attributes(&self) -> String {
        let mut attributes = format!(
            "name=\"{}\" valueReference=\"{}\" causality=\"{}\" variability=\"{}\"",
            escaped(&self.name),
            self.reference,
            self.causality,
            self.variability
        );
        if !self.initial.is_empty() {
            let _ = write!(attributes, " initial=\"{}\"", self.initial);
        }
        if !self.about.is_empty() {
            let _ = write!(attributes, " description=\"{}\"", escaped(&self.about));
        }
        attributes
    }
}

/// First value references: of inputs, outputs, states, rates, event indicators; as in `instance.c`.
struct References {
    input: usize,
    output: usize,
    state: usize,
    rate: usize,
    switch: usize,
    switches: usize,
    parameter: usize,
}

impl References {
    fn of(machine: &Machine) -> Self {
        let (input, n) = (1, machine.dim());
        let output = input + machine.inputs.len();
        let state = output + machine.outputs.len();
        let switches = machine.switches.as_ref().map_or(0, |found| found.program.output_count());
        let switch = state + 2 * n;
        Self { input, output, state, rate: state + n, switch, switches, parameter: switch + switches }
    }
}

/// Names that the variables of an FMU would share.
pub(super) fn different(machine: &Machine) -> Result<(), Diagnostic> {
    let mut names: Vec<String> = variables(machine).into_iter().map(|variable| variable.name).collect();
    names.push("time".into());
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => {
            let message = format!("two variables of the FMU would have the name `{}`", pair[0]);
            Err(Diagnostic::error(codes::CANNOT_EXPORT, message).help("rename the input or output, or choose others"))
        }
        None => Ok(()),
    }
}

fn variables(machine: &Machine) -> Vec<Variable> {
    let at = References::of(machine);
    let port = |reference: usize, port: &Port, causality: &'static str| Variable {
        name: port.name.clone(),
        reference,
        causality,
        variability: "continuous",
        range: None,
        initial: if causality == "output" { "calculated" } else { "" },
        start: (causality == "input").then_some(port.start),
        nominal: None,
        unit: port.unit.clone(),
        about: port.about.clone(),
        rate_of: None,
    };
    let mut list = Vec::new();
    let (tunable, nominals) = (tunable(machine), machine.nominals());
    list.extend(machine.parameters.settable.iter().enumerate().map(|(k, one)| Variable {
        name: format!("parameters.{}", one.port.name),
        causality: "parameter",
        variability: if tunable[k] { "tunable" } else { "fixed" },
        initial: "exact",
        start: Some(one.port.start),
        range: Some(one.range),
        ..port(at.parameter + k, &one.port, "")
    }));
    let inputs = machine.inputs.iter().enumerate().filter(|(_, input)| !input.is_fixed);
    list.extend(inputs.map(|(k, input)| port(at.input + k, input, "input")));
    list.extend(machine.outputs.iter().enumerate().map(|(k, output)| port(at.output + k, output, "output")));
    for (k, group) in machine.portable.groups.iter().enumerate() {
        let (unit, about) = of_group(*group);
        list.push(Variable {
            name: format!("machine.state[{}]", k + 1),
            reference: at.state + k,
            causality: "local",
            variability: "continuous",
            range: None,
            initial: "exact",
            start: Some(machine.state[k]),
            nominal: Some(nominals[k]),
            unit: unit.into(),
            about: about.into(),
            rate_of: None,
        });
    }
    for k in 0..machine.dim() {
        list.push(Variable {
            name: format!("der(machine.state[{}])", k + 1),
            reference: at.rate + k,
            causality: "local",
            variability: "continuous",
            range: None,
            initial: "calculated",
            start: None,
            nominal: None,
            unit: String::new(),
            about: String::new(),
            rate_of: Some(at.state + k),
        });
    }
    list
}

fn of_group(group: Group) -> (&'static str, &'static str) {
    match group {
        Group::Position => ("m", "coordinate of a joint"),
        Group::Parameter => ("", "coordinate of a joint (rad), or Euler parameter of one"),
        Group::Velocity => ("m/s", "rate of a coordinate"),
        Group::AngularVelocity => ("rad/s", "rate of a coordinate, or angular velocity"),
        Group::State => ("", "state of an element, in SI units"),
        Group::Work => ("J", "work done by everything without a potential"),
    }
}

/// Text as the value of an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut found = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => found.push_str("&amp;"),
            '<' => found.push_str("&lt;"),
            '>' => found.push_str("&gt;"),
            '"' => found.push_str("&quot;"),
            c if c < ' ' => found.push(' '),
            c => found.push(c),
        }
    }
    found
}

/// Units with what they are in SI.
fn units(machine: &Machine) -> String {
    let mut known: BTreeMap<String, (f64, Dimension)> = BTreeMap::new();
    let parameters = machine.parameters.settable.iter().map(|parameter| &parameter.port);
    for port in machine.inputs.iter().chain(&machine.outputs).chain(parameters) {
        if !port.unit.is_empty() {
            known.insert(port.unit.clone(), (port.factor, port.dimension));
        }
    }
    for (unit, dimension) in [
        ("m", Dimension::new(1, 0, 0, 0)),
        ("m/s", Dimension::new(1, 0, -1, 0)),
        ("rad/s", Dimension::new(0, 0, -1, 1)),
        ("J", Dimension::new(2, 1, -2, 0)),
    ] {
        known.entry(unit.into()).or_insert((1.0, dimension));
    }
    let mut text = String::from("  <UnitDefinitions>\n");
    for (unit, (factor, dimension)) in known {
        let exponents =
            [("kg", dimension.mass), ("m", dimension.length), ("s", dimension.time), ("rad", dimension.angle)];
        let base: String = exponents
            .iter()
            .filter(|(_, exponent)| *exponent != 0)
            .map(|(name, exponent)| format!(" {name}=\"{exponent}\""))
            .collect();
        let factor = if factor == 1.0 { String::new() } else { format!(" factor=\"{factor:?}\"") };
        let _ = writeln!(text, "    <Unit name=\"{}\"><BaseUnit{base}{factor}/></Unit>", escaped(&unit));
    }
    text.push_str("  </UnitDefinitions>\n");
    text
}

/// The description of an FMU.
pub(super) fn write(machine: &Machine, version: Version, kinds: Kinds, guid: &str) -> String {
    match version {
        Version::Two => version_2(machine, kinds, guid),
        Version::Three => version_3(machine, kinds, guid),
    }
}

fn experiment(machine: &Machine) -> String {
    format!(
        "  <DefaultExperiment startTime=\"{:?}\" stopTime=\"{:?}\" stepSize=\"{:?}\"/>\n",
        machine.t_start, machine.t_end, machine.step
    )
}

fn version_2(machine: &Machine, kinds: Kinds, guid: &str) -> String {
    let (name, title) = (&machine.name, escaped(&machine.title));
    let at = References::of(machine);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{title}\" \
         guid=\"{guid}\" generationTool=\"O-DYN {}\" variableNamingConvention=\"structured\" numberOfEventIndicators=\"{}\">\n",
        env!("CARGO_PKG_VERSION"),
        if kinds.model_exchange { at.switches } else { 0 }
    );
    let common = format!(
        "modelIdentifier=\"{name}\" canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\" \
         canSerializeFMUstate=\"true\" providesDirectionalDerivative=\"true\""
    );
    let sources = format!(
        "    <SourceFiles>\n      <File name=\"{name}.c\"/>\n      <File name=\"{name}_fmi.c\"/>\n    </SourceFiles>\n"
    );
    if kinds.model_exchange {
        let _ = write!(text, "  <ModelExchange {common}>\n{sources}  </ModelExchange>\n");
    }
    if kinds.co_simulation {
        let _ = write!(
            text,
            "  <CoSimulation {common} canHandleVariableCommunicationStepSize=\"true\">\n{sources}  </CoSimulation>\n"
        );
    }
    text.push_str(&units(machine));
    text.push_str("  <LogCategories>\n    <Category name=\"logStatusError\"/>\n    <Category name=\"logStatusWarning\"/>\n    <Category name=\"logAll\"/>\n  </LogCategories>\n");
    text.push_str(&experiment(machine));
    text.push_str("  <ModelVariables>\n");
    let variables = variables(machine);
    let index = |reference: usize| {
        variables.iter().position(|variable| variable.reference == reference).map_or(0, |place| place + 1)
    };
    for variable in &variables {
        let attributes = variable.attributes();
        let _ = writeln!(
            text,
            "    <ScalarVariable {attributes}><Real{}{}{}{}{}/></ScalarVariable>",
            start(variable.start),
            nominal(variable.nominal),
            range(variable.range),
            unit(&variable.unit),
            variable.rate_of.map_or(String::new(), |state| format!(" derivative=\"{}\"", index(state)))
        );
    }
    text.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let (found, first) = (Dependencies::of(machine), Dependencies::initially(machine));
    let listed = |known: &Known, initially: bool| listed(machine, known, &index, initially);
    let mut unknowns = Vec::new();
    if !machine.outputs.is_empty() {
        text.push_str("    <Outputs>\n");
        for (k, known) in found.outputs.iter().enumerate() {
            let _ = writeln!(text, "      <Unknown index=\"{}\"{}/>", index(at.output + k), listed(known, false));
            unknowns.push(index(at.output + k));
        }
        text.push_str("    </Outputs>\n");
    }
    text.push_str("    <Derivatives>\n");
    for (k, known) in found.rates.iter().enumerate() {
        let _ = writeln!(text, "      <Unknown index=\"{}\"{}/>", index(at.rate + k), listed(known, false));
        unknowns.push(index(at.rate + k));
    }
    text.push_str("    </Derivatives>\n    <InitialUnknowns>\n");
    for (unknown, known) in unknowns.iter().zip(first.outputs.iter().chain(&first.rates)) {
        let _ = writeln!(text, "      <Unknown index=\"{unknown}\"{}/>", listed(known, true));
    }
    text.push_str("    </InitialUnknowns>\n  </ModelStructure>\n</fmiModelDescription>\n");
    text
}

fn version_3(machine: &Machine, kinds: Kinds, guid: &str) -> String {
    let (name, title) = (&machine.name, escaped(&machine.title));
    let at = References::of(machine);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{title}\" \
         instantiationToken=\"{guid}\" generationTool=\"O-DYN {}\" variableNamingConvention=\"structured\">\n",
        env!("CARGO_PKG_VERSION")
    );
    let common = format!(
        "modelIdentifier=\"{name}\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" \
         providesDirectionalDerivatives=\"true\" providesAdjointDerivatives=\"true\""
    );
    if kinds.model_exchange {
        // Behind each step constraints and counted angles are looked at; version 2.0 takes that for granted.
        let _ = writeln!(text, "  <ModelExchange {common} needsCompletedIntegratorStep=\"true\"/>");
    }
    if kinds.co_simulation {
        let _ = writeln!(text, "  <CoSimulation {common} canHandleVariableCommunicationStepSize=\"true\"/>");
    }
    text.push_str(&units(machine));
    text.push_str("  <LogCategories>\n    <Category name=\"logStatusError\"/>\n    <Category name=\"logStatusWarning\"/>\n    <Category name=\"logAll\"/>\n  </LogCategories>\n");
    text.push_str(&experiment(machine));
    text.push_str(
        "  <ModelVariables>\n    <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\"/>\n",
    );
    let mut list = variables(machine);
    let indicators = if kinds.model_exchange { at.switches } else { 0 };
    list.extend((0..indicators).map(|k| Variable {
        name: format!("machine.switch[{}]", k + 1),
        reference: at.switch + k,
        causality: "local",
        variability: "continuous",
        range: None,
        initial: "calculated",
        start: None,
        nominal: None,
        unit: String::new(),
        about: "changes its sign where equations switch".into(),
        rate_of: None,
    }));
    for variable in &list {
        let attributes = variable.attributes();
        let rate = variable.rate_of.map_or(String::new(), |state| format!(" derivative=\"{state}\""));
        let _ = writeln!(
            text,
            "    <Float64 {attributes}{}{}{}{}{rate}/>",
            start(variable.start),
            nominal(variable.nominal),
            range(variable.range),
            unit(&variable.unit)
        );
    }
    text.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let (found, first) = (Dependencies::of(machine), Dependencies::initially(machine));
    let listed = |known: &Known, initially: bool| listed(machine, known, &|reference| reference, initially);
    let outputs = found.outputs.iter().enumerate().map(|(k, known)| (at.output + k, known));
    let rates = found.rates.iter().enumerate().map(|(k, known)| (at.rate + k, known));
    for (reference, known) in outputs.clone() {
        let _ = writeln!(text, "    <Output valueReference=\"{reference}\"{}/>", listed(known, false));
    }
    for (reference, known) in rates.clone() {
        let _ =
            writeln!(text, "    <ContinuousStateDerivative valueReference=\"{reference}\"{}/>", listed(known, false));
    }
    let references = outputs.chain(rates).map(|(reference, _)| reference);
    for (reference, known) in references.zip(first.outputs.iter().chain(&first.rates)) {
        let _ = writeln!(text, "    <InitialUnknown valueReference=\"{reference}\"{}/>", listed(known, true));
    }
    for k in 0..indicators {
        let _ = writeln!(text, "    <EventIndicator valueReference=\"{}\"/>", at.switch + k);
    }
    text.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
    text
}

/// How the sources are built.
pub(super) fn build(name: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  \
         <BuildConfiguration modelIdentifier=\"{name}\">\n    <SourceFileSet language=\"C99\" compilerOptions=\"-ffp-contract=off\">\n      \
         <SourceFile name=\"{name}.c\"/>\n      <SourceFile name=\"{name}_fmi.c\"/>\n    </SourceFileSet>\n  \
         </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
}

fn start(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!(" start=\"{value:?}\""))
}

fn nominal(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!(" nominal=\"{value:?}\""))
}

fn range(range: Option<[f64; 2]>) -> String {
    range.map_or(String::new(), |[low, high]| format!(" min=\"{low:?}\" max=\"{high:?}\""))
}

fn unit(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" unit=\"{}\"", escaped(unit)) }
}

/// What something depends on: states and inputs; where it is found by the initialisation, parameters as well.
fn listed(machine: &Machine, known: &Known, index: &dyn Fn(usize) -> usize, with_parameters: bool) -> String {
    let at = References::of(machine);
    let (n, inputs) = (machine.dim(), &machine.inputs);
    let last = n + inputs.len();
    let reference = |k: usize| match k {
        k if k < n => at.state + k,
        k if k < last => at.input + k - n,
        k => at.parameter + k - last,
    };
    let is_shown = |k: &usize| match *k {
        k if k < n => true,
        k if k < last => !inputs[k - n].is_fixed,
        _ => with_parameters,
    };
    let shown = (0..known.len()).filter(|k| known[*k]).filter(is_shown);
    let mut found: Vec<usize> = shown.map(|k| index(reference(k))).collect();
    found.sort_unstable();
    let words: Vec<String> = found.iter().map(usize::to_string).collect();
    format!(" dependencies=\"{}\"", words.join(" "))
}
