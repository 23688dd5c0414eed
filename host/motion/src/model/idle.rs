//! Parameters that are written and change nothing: the element makes the same equations of any value, as a restitution
//! without a contact that opens, or the gain of a signal that nobody connects.

use element_api::params::{FRAME_COUNT, ParamKind, ParamSpec, Table};
use element_api::recording::{Input, Op, Role};
use element_api::{Descriptor, Kind, Recording};
use odyn_graph::{Graph, Node, operation};
use rustc_hash::FxHashMap;
use toml::Value;

use super::types::{Instance, Source};
use crate::catalog::ElementHandle;
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::ElementRecord;

/// What was found of the elements of each class, by its full name: those of one shape lack the same.
#[derive(Default)]
pub(super) struct Found(FxHashMap<String, Vec<(Shape, Vec<bool>)>>);

/// What an element is given but for its numbers, on which what is found does not depend.
#[derive(PartialEq)]
struct Shape {
    written: Vec<bool>,
    unconnected: Vec<bool>,
    words: Table,
}

/// Recordings with more operations are not made again: of bodies with large matrices, where nothing is switched off.
const MOST_OPERATIONS: usize = 20_000;

/// Warnings of the parameters that a scene gives an element in vain. `params` is what it was created with, of which
/// `recording` came; `found` is what was found of elements before.
pub(super) fn check(
    record: &ElementRecord,
    handle: &ElementHandle,
    params: &Table,
    recording: &Recording,
    found: &mut Found,
) -> Vec<Diagnostic> {
    let class = handle.descriptor();
    let in_question = |spec: &ParamSpec| {
        let default = spec.default.as_ref();
        let is_default =
            default.is_some_and(|default| params.get(&spec.name).is_some_and(|value| same(value, default)));
        (spec.optional || default.is_some()) && record.params.get(&spec.name).is_some() && !is_default
    };
    let written: Vec<bool> = class.params.iter().map(in_question).collect();
    if class.opaque || !written.contains(&true) || recording.ops.len() > MOST_OPERATIONS {
        return Vec::new();
    }
    let given = |input: &str| record.inputs.iter().any(|given| given.name.value == input);
    let unconnected = class.inputs.iter().map(|input| !given(&input.name)).collect();
    let word = |value: &Value| match value {
        Value::Boolean(_) | Value::String(_) => value.clone(),
        _ => Value::Boolean(true),
    };
    let words = params.iter().map(|(name, value)| (name.clone(), word(value))).collect();
    let shape = Shape { written, unconnected, words };
    let known = found.0.entry(handle.full_name()).or_default();
    let at = known.iter().position(|(known, _)| *known == shape).unwrap_or_else(|| {
        let idle = idle(handle, record, params, (recording, &shape.written, &shape.unconnected));
        known.push((shape, idle));
        known.len() - 1
    });
    let idle = class.params.iter().zip(&known[at].1).filter(|(_, idle)| **idle);
    idle.map(|(spec, _)| warning(record, class, spec)).collect()
}

fn warning(record: &ElementRecord, class: &Descriptor, spec: &ParamSpec) -> Diagnostic {
    let (element, name) = (&record.name.value, &spec.name);
    let place = record.params.get(name).map_or_else(|| record.span.clone(), |raw| raw.span.clone());
    let message =
        format!("`{element}` does without its parameter `{name}`, with the other parameters and signals that it has");
    Diagnostic::warning(codes::IDLE_PARAMETER, message)
        .at(place, "changing it changes nothing")
        .help(format!("`{name}`: {}", spec.doc))
        .help(format!(
            "give what it works with, or leave it out; `odyn elements describe {}` has the equations",
            class.name
        ))
}

/// Which of the parameters that are `written` change nothing: neither with the others as they are, nor with other numbers for these
/// (a coefficient of zero switches a part of an element off, and what belongs to that part stays meant).
fn idle(
    handle: &ElementHandle,
    record: &ElementRecord,
    params: &Table,
    (recording, written, unconnected): (&Recording, &[bool], &[bool]),
) -> Vec<bool> {
    let class = handle.descriptor();
    let mut forms = Forms { class, unconnected, graph: Graph::default(), slots: FxHashMap::default() };
    let changes_nothing = |spec: &ParamSpec, params: &Table, recording: &Recording, forms: &mut Forms<'_>| {
        let mut others = others(spec, params).into_iter();
        others.all(|other| recorded(handle, &other).is_some_and(|other| forms.are_same(recording, &other)))
    };
    let check = |(spec, written): (&ParamSpec, &bool)| {
        if !written || !changes_nothing(spec, params, recording, &mut forms) {
            return false;
        }
        let mut elsewhere = params.clone();
        let others = class.params.iter().filter(|other| other.name != spec.name && other.kind == ParamKind::Number);
        for (k, other) in others.enumerate().filter(|(_, other)| record.params.get(&other.name).is_some()) {
            let values = params.get(&other.name).map_or_else(Vec::new, |value| changed(other, value));
            // Each in another way: two that are equal are so no more.
            if let Some(value) = values.iter().cycle().nth(k % values.len().max(1)) {
                elsewhere.insert(other.name.clone(), value.clone());
            }
        }
        let there = recorded(handle, &elsewhere);
        there.is_none_or(|there| changes_nothing(spec, &elsewhere, &there, &mut forms))
    };
    class.params.iter().zip(written).map(check).collect()
}

/// The equations of an element with these parameters; `None` where it refuses them.
fn recorded(handle: &ElementHandle, params: &Table) -> Option<Recording> {
    let class = handle.descriptor();
    let mut set = handle.class.new_set();
    let recording = set.add(params).ok().and_then(|index| set.record(index).ok())?;
    let frames = params.get(FRAME_COUNT).and_then(Value::as_integer);
    let limits = match frames {
        Some(count) => class.with_frames(count as usize).limits(),
        None => class.limits(),
    };
    recording.check(&limits).ok().map(|()| recording)
}

/// The parameters with others in the place of one: without it, and with changed values.
fn others(spec: &ParamSpec, params: &Table) -> Vec<Table> {
    let with = |value: Option<Value>| {
        let mut other = params.clone();
        match value {
            Some(value) => drop(other.insert(spec.name.clone(), value)),
            None => drop(other.remove(&spec.name)),
        }
        other
    };
    let values = params.get(&spec.name).map_or_else(Vec::new, |value| changed(spec, value));
    std::iter::once(spec.default.clone()).chain(values.into_iter().map(Some)).map(with).collect()
}

/// Other values that a parameter may have; none where nothing is known of what it may be.
fn changed(spec: &ParamSpec, value: &Value) -> Vec<Value> {
    let near = |x: f64| [1.5 * x, x + 1.0, 0.5 * x, x - 1.0].into_iter().filter(move |y| spec.contains(*y) && *y != x);
    match (spec.kind, value) {
        (ParamKind::Number, _) => near(number(value).unwrap_or(1.0)).map(Value::Float).collect(),
        (ParamKind::Integer, Value::Integer(n)) => {
            [n + 1, n - 1].into_iter().filter(|n| spec.contains(*n as f64)).map(Value::Integer).collect()
        }
        (ParamKind::Boolean, Value::Boolean(is)) => vec![Value::Boolean(!is)],
        (ParamKind::Text, Value::String(word)) => {
            spec.choices.iter().filter(|choice| *choice != word).cloned().map(Value::String).collect()
        }
        (ParamKind::Function, _) => [1.0, 2.0].into_iter().filter(|x| spec.contains(*x)).map(Value::Float).collect(),
        (ParamKind::Vector | ParamKind::List, Value::Array(items)) => {
            let all = |k: usize| items.iter().map(|item| near(number(item)?).nth(k).map(Value::Float)).collect();
            (0..2).filter_map(all).map(Value::Array).collect()
        }
        _ => Vec::new(),
    }
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|n| n as f64))
}

fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        _ => a == b || number(a).is_some_and(|x| number(b) == Some(x)),
    }
}

/// Force elements that are zero, whatever the motion: no law was given to them, coefficients are zero, or the signal that would drive them
/// is not connected. Those that have their equations in common, and constants for the same signals, are looked at once.
#[derive(Default)]
pub(super) struct Zeros(FxHashMap<(*const Recording, Vec<Option<u64>>), bool>);

impl Zeros {
    pub(super) fn contains(&mut self, instance: &Instance) -> bool {
        let (class, recording) = (&*instance.class, &*instance.recording);
        let is_in_question = class.kind == Kind::Force && !class.opaque && class.checks.is_empty();
        if !is_in_question || recording.ops.len() > MOST_OPERATIONS {
            return false;
        }
        let constant = |source: &Source| match source {
            Source::Constant(value) => Some(value.to_bits()),
            Source::Quantity(..) => None,
        };
        let key = (std::ptr::from_ref(recording), instance.inputs.iter().map(constant).collect());
        *self.0.entry(key).or_insert_with(|| acts_with_nothing(recording, &instance.inputs))
    }
}

/// Whether all that a recording gives is zero, but for what it reports.
fn acts_with_nothing(recording: &Recording, signals: &[Source]) -> bool {
    let mut graph = Graph::default();
    graph.tables.clone_from(&recording.tables);
    let mut slots = 0;
    let results = results(&mut graph, recording, 0, |graph, input| match input {
        Input::Signal(k) if let Some(Source::Constant(value)) = signals.get(k as usize) => Some(graph.constant(*value)),
        _ => {
            slots += 1;
            Some(graph.input(slots - 1))
        }
    });
    let zero = graph.constant(0.0);
    let is_nothing = |(role, node): (Role, Node)| {
        node == zero || matches!(role, Role::Channel(_) | Role::Potential | Role::Dissipation | Role::Angle(_))
    };
    results.is_some_and(|results| results.into_iter().all(is_nothing))
}

/// What a recording gives, as nodes of a graph that has its tables from `first_table` on; `input` makes the nodes of inputs. `None` of a
/// recording that cannot be read.
fn results(
    graph: &mut Graph,
    recording: &Recording,
    first_table: u32,
    mut input: impl FnMut(&mut Graph, Input) -> Option<Node>,
) -> Option<Vec<(Role, Node)>> {
    let mut nodes: Vec<Node> = Vec::with_capacity(recording.ops.len());
    for raw in &recording.ops {
        let node = match Op::decode(*raw)? {
            Op::Input(given) => input(graph, given)?,
            op => operation(graph, recording, op, first_table, |k| nodes[k as usize]),
        };
        nodes.push(node);
    }
    Some(recording.outputs.iter().map(|output| (output.role, nodes[output.node as usize])).collect())
}

/// Recordings of a class in the form in which the same is the same: nodes of one graph, where signals that are not connected are the
/// numbers that stand for them.
struct Forms<'a> {
    class: &'a Descriptor,
    unconnected: &'a [bool],
    graph: Graph,
    slots: FxHashMap<Input, usize>,
}

impl Forms<'_> {
    /// Whether two recordings give the same results. Of tables only equal ones are held for the same.
    fn are_same(&mut self, a: &Recording, b: &Recording) -> bool {
        if a == b {
            return true;
        }
        if (&a.initial_states, &a.initial_discrete, &a.tables) != (&b.initial_states, &b.initial_discrete, &b.tables) {
            return false;
        }
        let first_table = self.graph.tables.len() as u32;
        self.graph.tables.extend(a.tables.iter().cloned());
        self.results(a, first_table).is_some_and(|results| Some(results) == self.results(b, first_table))
    }

    fn results(&mut self, recording: &Recording, first_table: u32) -> Option<Vec<(Role, Node)>> {
        let (class, unconnected, slots) = (self.class, self.unconnected, &mut self.slots);
        results(&mut self.graph, recording, first_table, |graph, input| match input {
            Input::Signal(k) if unconnected.get(k as usize) == Some(&true) => {
                Some(graph.constant(class.inputs.get(k as usize)?.default?))
            }
            input => {
                let next = slots.len();
                Some(graph.input(*slots.entry(input).or_insert(next)))
            }
        })
    }
}
