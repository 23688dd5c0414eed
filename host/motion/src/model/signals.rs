//! What is connected to the signal inputs of force and control elements.

use std::ops::Range;

use element_api::recording::Role;
use element_api::{Descriptor, Kind, NamedInput};
use rustc_hash::FxHashMap;

use super::bodies::quoted;
use super::channels::switched_off;
use super::idle::Zeros;
use super::moved_rows;
use super::parameters::dimension_of;
use super::types::{Channel, Instance, Level, Quantity, Signal, Source};
use crate::catalog::Catalog;
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::scene::{Dimension, ElementRecord, ExternalInput, InputRecord, InputSource, RawValue, Scene, Spanned};

type Found<T> = Result<T, Box<Diagnostic>>;

/// A signal from outside, as a scene has it.
pub(super) fn given(record: &ExternalInput) -> Signal {
    Signal {
        name: record.name.value.clone(),
        value: record.value,
        dimension: record.dimension,
        unit: record.unit.clone(),
        factor: record.factor,
    }
}

/// Fills in [`Instance::inputs`]. Mistakes are added to `found`: unknown sources, dimensions, signals that depend on
/// themselves, and signals that change nothing.
pub(super) fn connect(
    scene: &Scene,
    catalog: &Catalog,
    channels: &[Channel],
    instances: &mut [Instance],
    found: &mut Vec<Diagnostic>,
) {
    let before = found.len();
    let named = |record: &ElementRecord| !record.inputs.is_empty();
    let any_named = scene.elements.iter().any(named);
    let records: FxHashMap<&str, &ElementRecord> =
        scene.elements.iter().map(|record| (record.name.value.as_str(), record)).collect();
    for index in 0..instances.len() {
        if !any_named && instances[index].class.inputs.is_empty() {
            continue;
        }
        let Some(record) = records.get(instances[index].name.as_str()) else { continue };
        let (sources, mut mistakes) = sources_of(record, &instances[index], (scene, catalog), channels, instances);
        found.append(&mut mistakes);
        instances[index].inputs = sources;
    }
    if found[before..].iter().any(Diagnostic::is_error) {
        return;
    }
    match first_loop(instances) {
        Some(round) => found.push(loop_error(&round, instances, scene)),
        None => moved_rows::check(scene, instances, found),
    }
}

fn sources_of(
    record: &ElementRecord,
    instance: &Instance,
    (scene, catalog): (&Scene, &Catalog),
    channels: &[Channel],
    instances: &[Instance],
) -> (Vec<Source>, Vec<Diagnostic>) {
    let class = &instance.class;
    let names: Vec<&str> = class.inputs.iter().map(|input| input.name.as_str()).collect();
    let mut mistakes = Vec::new();
    for given in &record.inputs {
        if names.contains(&given.name.value.as_str()) {
            continue;
        }
        let help = match suggest(&given.name.value, names.iter().copied()) {
            Some(nearest) => format!("did you mean `{nearest}`?"),
            None if names.is_empty() => format!("`{}` takes no signals", class.name),
            None => format!("its inputs are {}", quoted(&names)),
        };
        mistakes.push(
            Diagnostic::error(
                codes::UNKNOWN_ELEMENT_PARAMETER,
                format!("unknown input `{}` for `{}`", given.name.value, class.name),
            )
            .at(given.name.span.clone(), format!("not an input of `{}`", class.name))
            .help(help),
        );
    }
    let mut sources = Vec::with_capacity(class.inputs.len());
    for (k, input) in class.inputs.iter().enumerate() {
        let unit = || if input.unit.is_empty() { Ok(None) } else { dimension_of(&input.unit).map(Some) };
        let given = record.inputs.iter().find(|given| given.name.value == input.name);
        let source = match (given, input.default) {
            (Some(given), _) => {
                let takers = |dimension| takers(catalog, class.kind, dimension);
                unit().and_then(|unit| source(&given.source, (unit, &takers), scene, channels, instances))
            }
            (None, Some(default)) => Ok(Source::Constant(default)),
            (None, None) => Err(Box::new(
                Diagnostic::error(
                    codes::MISSING_ELEMENT_PARAMETER,
                    format!("nothing is connected to the input `{}` of `{}`", input.name, record.name.value),
                )
                .at(record.span.clone(), format!("`{}` needs this signal", class.name))
                .help(format!("inputs.{} = \"...\"   # {}", input.name, input.doc)),
            )),
        };
        match source {
            Ok(source) => {
                mistakes.extend(given.and_then(|given| unused(given, k, instance)));
                sources.push(source);
            }
            Err(diagnostic) => mistakes.push(*diagnostic),
        }
    }
    (sources, mistakes)
}

/// Warns of what changes nothing: what is given from outside and goes nowhere, control elements likewise, and forces that are zero.
pub(super) fn warn_of_unused(scene: &Scene, channels: &[Channel], instances: &[Instance], found: &mut Vec<Diagnostic>) {
    let mut used = vec![false; scene.inputs.len()];
    let mut heard = vec![false; instances.len()];
    for quantity in instances.iter().flat_map(Instance::signals).chain(channels.iter().map(|channel| &channel.quantity))
    {
        match quantity {
            Quantity::Given { input } => used[*input] = true,
            Quantity::Value { element, .. } | Quantity::Load { element, .. } => heard[*element] = true,
            _ => {}
        }
    }
    // What is called may do something else, and what has checks says something by itself.
    let only_signals = |instance: &Instance| {
        instance.class.kind == Kind::Control && !instance.class.opaque && instance.class.checks.is_empty()
    };
    // Where a signal is not understood, it may be the one that takes this.
    let wrong = found.iter().any(Diagnostic::is_error);
    let mut zeros = Zeros::default();
    // Who is asked for something may be there to measure it.
    for (instance, _) in instances.iter().zip(heard).filter(|(_, heard)| !wrong && !heard) {
        let (name, class) = (&instance.name, &instance.class);
        let (code, message, text, help) = if zeros.contains(instance) {
            let message = format!("the force `{name}` is zero, whatever the motion");
            let help = format!(
                "give it its law, coefficients or signal, or take it away; `odyn elements describe {}` has its parameters",
                class.name
            );
            (codes::FORCE_OF_NOTHING, message, "leaving it out changes nothing", help)
        } else if only_signals(instance) {
            let channel = class.channels.first().map_or("output", |channel| channel.name.as_str());
            let message = format!("no element and no output takes a signal of `{name}`");
            let help = format!("name it under `inputs` of an element, as `\"{name}.{channel}\"`, or take it away");
            (codes::UNUSED_CONTROL, message, "it changes nothing", help)
        } else {
            continue;
        };
        if let Some(record) = scene.elements.iter().find(|record| record.name.value == *name) {
            found.push(Diagnostic::warning(code, message).at(record.name.span.clone(), text).help(help));
        }
    }
    for (input, _) in scene.inputs.iter().zip(used).filter(|(_, used)| !wrong && !used) {
        let message = format!("no element and no output takes the input `{}`", input.name.value);
        found.push(
            Diagnostic::warning(codes::UNUSED_INPUT, message)
                .at(input.name.span.clone(), "changing it changes nothing")
                .help("name it under `inputs` of an element, or take it away"),
        );
    }
}

/// A warning, where a signal is connected to an input that an element does without.
fn unused(given: &InputRecord, input: usize, instance: &Instance) -> Option<Diagnostic> {
    let mut outputs = instance.recording.outputs.iter();
    if instance.class.opaque || outputs.any(|output| instance.signals_of(output.role).contains(&input)) {
        return None;
    }
    let message =
        format!("`{}` does without its input `{}` with the parameters that it has", instance.name, given.name.value);
    let warning = Diagnostic::warning(codes::UNUSED_INPUT, message)
        .at(given.name.span.clone(), "this signal changes nothing")
        .help(format!("`odyn elements describe {}` says what takes it", instance.class.name));
    Some(warning)
}

/// Which elements of this kind take a signal of a dimension.
fn takers(catalog: &Catalog, kind: Kind, given: Dimension) -> Option<String> {
    let takes = |input: &NamedInput| {
        input.unit.is_empty() || dimension_of(&input.unit).is_ok_and(|dimension| given.compatible(dimension))
    };
    let mut found = Vec::new();
    for element in catalog.elements().filter(|element| element.descriptor().kind == kind) {
        let Descriptor { name, inputs, .. } = element.descriptor();
        let inputs: Vec<&str> = inputs.iter().filter(|input| takes(input)).map(|input| input.name.as_str()).collect();
        if !inputs.is_empty() {
            found.push(format!("`{name}` ({})", quoted(&inputs)));
        }
    }
    (!found.is_empty()).then(|| format!("{given} is taken by {}", found.join(", ")))
}

/// What a source stands for. `dimension` is what is expected, if anything; `takers` says what else takes another.
fn source(
    written: &Spanned<InputSource>,
    (dimension, takers): (Option<Dimension>, &dyn Fn(Dimension) -> Option<String>),
    scene: &Scene,
    channels: &[Channel],
    instances: &[Instance],
) -> Found<Source> {
    let value = |raw: &RawValue, dimension: Option<Dimension>| match dimension {
        Some(dimension) => scene.quantity(raw, dimension).map_err(Box::new),
        None => scene.any_quantity(raw).map(|(value, _)| value),
    };
    let name = match &written.value {
        InputSource::Value(raw) => return Ok(Source::Constant(value(raw, dimension)?)),
        InputSource::Scaled { signal, gain } => {
            let (quantity, given) = named(&signal.value, &signal.span, scene, channels, instances)?;
            let left = dimension.and_then(|expected| expected.over(given));
            return Ok(Source::Quantity(quantity, value(gain, left)?));
        }
        InputSource::Reference(name) => name,
    };
    let (quantity, given) = named(name, &written.span, scene, channels, instances)?;
    match dimension {
        Some(expected) if !given.compatible(expected) => Err(Box::new(
            Diagnostic::error(codes::DIMENSION, format!("expected {expected}, found {given}"))
                .at(written.span.clone(), format!("`{name}` is {given}"))
                .help_if(takers(given))
                .help_if(expected.over(given).map(|gain| {
                    format!("times a quantity: {{ signal = \"{name}\", gain = \"1 {}\" }}", gain.si_unit())
                })),
        )),
        _ => Ok(Source::Quantity(quantity, 1.0)),
    }
}

/// What a name stands for: an output, an input, `ELEMENT.CHANNEL`.
pub(super) fn named(
    name: &str,
    written: &Range<usize>,
    scene: &Scene,
    channels: &[Channel],
    instances: &[Instance],
) -> Found<(Quantity, Dimension)> {
    let output = channels.iter().find(|channel| channel.name == *name);
    let input = scene.inputs.iter().position(|input| input.name.value == *name);
    match (output, input) {
        (Some(channel), _) => Ok((channel.quantity.clone(), channel.dimension)),
        (None, Some(input)) => Ok((Quantity::Given { input }, scene.inputs[input].dimension)),
        (None, None) => element_channel(name, written, scene, channels, instances),
    }
}

/// `ELEMENT.CHANNEL`: a signal, a reported value, a joint coordinate.
fn element_channel(
    name: &str,
    written: &Range<usize>,
    scene: &Scene,
    channels: &[Channel],
    instances: &[Instance],
) -> Found<(Quantity, Dimension)> {
    let owner = |e: &Instance| name.strip_prefix(e.name.as_str()).is_some_and(|rest| rest.starts_with('.'));
    // The longest name wins where one is the beginning of another.
    let element = (0..instances.len()).filter(|k| owner(&instances[*k])).max_by_key(|k| instances[*k].name.len());
    if let Some(element) = element {
        let instance = &instances[element];
        let word = &name[instance.name.len() + 1..];
        let all = || instance.class.channels.iter().chain(&instance.class.values);
        let known: Vec<&str> = all().map(|channel| channel.name.as_str()).collect();
        if let Some((channel, own)) = all().enumerate().find(|(_, known)| known.name == word) {
            let coordinates = instance.class.channels.len();
            let quantity = match instance.class.kind {
                Kind::Joint if channel < coordinates => {
                    Quantity::Coordinate { element, coordinate: channel, level: Level::Position }
                }
                Kind::Joint => Quantity::Value { element, channel: channel - coordinates },
                Kind::Force | Kind::Control => Quantity::Value { element, channel },
            };
            return Ok((quantity, dimension_of(&own.unit)?));
        }
        let message = format!("`{}` ({}) has no channel `{word}`", instance.name, instance.class.name);
        let help = match suggest(word, known.iter().copied()) {
            Some(nearest) => format!("did you mean `{}.{nearest}`?", instance.name),
            None => format!("it has {}", quoted(&known)),
        };
        return Err(Box::new(
            Diagnostic::error(codes::UNKNOWN_CHANNEL, message).at(written.clone(), "unknown").help(help),
        ));
    }
    if let Some((element, _)) = name.rsplit_once('.')
        && let element = (Spanned { value: element.to_owned(), span: written.clone() })
        && let Some(off) = switched_off(scene, &element, "its signal is wanted here")
    {
        return Err(off);
    }
    let mut known: Vec<String> = channels.iter().map(|channel| channel.name.clone()).collect();
    known.extend(scene.inputs.iter().map(|input| input.name.value.clone()));
    for instance in instances {
        let all = instance.class.channels.iter().chain(&instance.class.values);
        known.extend(all.map(|channel| format!("{}.{}", instance.name, channel.name)));
    }
    let nearest = suggest(name, known.iter().map(String::as_str)).map(|n| format!("did you mean `{n}`?"));
    Err(Box::new(
        Diagnostic::error(codes::UNKNOWN_TARGET, format!("there is no signal `{name}`"))
            .at(written.clone(), "unknown")
            .help_if(nearest)
            .help("a signal is the name of an `[[output]]` or an `[[input]]`, or ELEMENT.CHANNEL, or a constant"),
    ))
}

/// A result of an element.
pub(super) type Result_ = (usize, Role);

/// The first elements found whose results depend on themselves, in order. States break such loops: their rates may depend
/// on anything, but nothing depends on a rate at once. Reactions and accelerations are no part of it: they are solved for.
fn first_loop(instances: &[Instance]) -> Option<Vec<usize>> {
    let mut known: FxHashMap<Result_, bool> = FxHashMap::default();
    for (index, instance) in instances.iter().enumerate() {
        // What takes no signal of another element is part of none.
        let follows = instance.inputs.iter().any(|source| source.quantity().is_some());
        for output in instance.recording.outputs.iter().filter(|_| follows) {
            let mut path = Vec::new();
            if visit((index, output.role), instances, &mut known, &mut path) {
                let start = path.last().copied()?;
                let from = path.iter().position(|result| *result == start)?;
                let mut round: Vec<usize> = path[from..].iter().map(|(element, _)| *element).collect();
                round.dedup();
                return Some(round);
            }
        }
    }
    None
}

/// Depth first; true when `result` is reached again, which then ends the path.
fn visit(
    result: Result_,
    instances: &[Instance],
    known: &mut FxHashMap<Result_, bool>,
    path: &mut Vec<Result_>,
) -> bool {
    path.push(result);
    match known.get(&result) {
        // Finished before.
        Some(true) => {
            path.pop();
            return false;
        }
        // On the path.
        Some(false) => return true,
        None => {}
    }
    known.insert(result, false);
    for input in instances[result.0].signals_of(result.1) {
        let Some(quantity) = instances[result.0].inputs.get(input).and_then(Source::quantity) else { continue };
        for next in results_behind(quantity, instances) {
            if visit(next, instances, known, path) {
                return true;
            }
        }
    }
    known.insert(result, true);
    path.pop();
    false
}

/// The results of elements that a quantity is made of.
pub(super) fn results_behind(quantity: &Quantity, instances: &[Instance]) -> Vec<Result_> {
    match quantity {
        Quantity::Value { element, channel } => vec![(*element, Role::Channel(*channel as u32))],
        Quantity::Load { element, frame, torque, .. } if instances[*element].class.kind == Kind::Force => {
            let role = |k: usize| {
                let k = (3 * frame + k) as u32;
                if *torque { Role::Torque(k) } else { Role::Force(k) }
            };
            // What the inertia of flexible coordinates does to the bodies depends on the forces that drive them.
            let flexible = instances[*element].recording.flexible() as u32;
            (0..3).map(role).chain((0..flexible).map(Role::FlexibleForce)).map(|role| (*element, role)).collect()
        }
        Quantity::PotentialEnergy | Quantity::TotalEnergy => {
            let forces = (0..instances.len()).filter(|k| instances[*k].class.kind == Kind::Force);
            forces.map(|k| (k, Role::Potential)).collect()
        }
        _ => Vec::new(),
    }
}

fn loop_error(round: &[usize], instances: &[Instance], scene: &Scene) -> Diagnostic {
    let names: Vec<&str> = round.iter().map(|k| instances[*k].name.as_str()).collect();
    let place = |name: &str| {
        let record = scene.elements.iter().find(|record| record.name.value == name);
        record.map_or(0..0, |record| record.name.span.clone())
    };
    let first = names.first().copied().unwrap_or_default();
    Diagnostic::error(codes::SIGNAL_LOOP, format!("the signal of `{first}` depends on itself at the same instant"))
        .at(place(first), format!("by way of {}", names.join(" -> ")))
        .help("put something with a state into the loop: a sensor with a time constant, a transfer function, a body")
}
