//! [`DataClass`]: the class of an element that is data. An instance has its numbers in the place of the parameters; what follows from
//! them alone is computed here, so that its recording is that of the same element in Rust.

use std::cell::OnceCell;
use std::sync::Arc;

use element_api::descriptor::{Descriptor, Kind};
use element_api::params::{ParamError, ParamKind, ParamSpec, ParamType, Table as Params};
use element_api::recorded::{Recorded, input, record};
use element_api::recording::{Input, Recording, Role};
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault, Layout};
use element_api::{Function, Scalar, Surface};

use super::equations::{Equations, Operand, Step};
use crate::c_library::Evaluation;

struct Class {
    descriptor: Descriptor,
    equations: Equations,
    /// The rows on positions.
    rows: Vec<usize>,
    layout: Layout,
}

pub(super) struct DataClass(Arc<Class>);

impl DataClass {
    pub(super) fn new(descriptor: Descriptor, equations: Equations) -> Self {
        let rows = equations.rows(Role::Residual, descriptor.rows.len());
        let layout = Layout {
            frames: descriptor.frames.len(),
            angles: descriptor.angles,
            states: descriptor.states.len() + descriptor.unknowns.len(),
            memory: equations.memory.len(),
            signals: descriptor.inputs.len(),
            joints: descriptor.joints.len(),
            values: rows.len() + descriptor.channels.len(),
        };
        Self(Arc::new(Class { descriptor, equations, rows, layout }))
    }
}

impl ElementClass for DataClass {
    fn descriptor(&self) -> &Descriptor {
        &self.0.descriptor
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        Box::new(DataSet { class: Arc::clone(&self.0), instances: Vec::new() })
    }
}

/// A parameter, read.
enum Value {
    Numbers([f64; 3]),
    Function(Function),
    Surface(Surface),
}

impl Value {
    fn read(spec: &ParamSpec, params: &Params) -> Result<Self, ParamError> {
        let one = |number: f64| Self::Numbers([number, 0.0, 0.0]);
        let name = spec.name.as_str();
        let Some(value) = params.get(name) else { return Err(ParamError::new(name, "is missing")) };
        Ok(match spec.kind {
            // Equations have the number of the choice.
            ParamKind::Text => {
                let text = String::read_named(value, name)?;
                let number = spec.choices.iter().position(|choice| *choice == text);
                one(number.ok_or_else(|| ParamError::new(name, format!("is none of {}", spec.choices.join(", "))))?
                    as f64)
            }
            ParamKind::Boolean => one(f64::from(u8::from(bool::read_named(value, name)?))),
            ParamKind::Vector => Self::Numbers(<[f64; 3]>::read_named(value, name)?),
            ParamKind::Function => Self::Function(Function::read_named(value, name)?),
            ParamKind::Surface => Self::Surface(Surface::read_named(value, name)?),
            _ => one(f64::read_named(value, name)?),
        })
    }
}

struct Instance {
    values: Vec<Value>,
    /// Its equations once they were asked for.
    recording: OnceCell<Recording>,
}

struct DataSet {
    class: Arc<Class>,
    instances: Vec<Instance>,
}

impl Class {
    /// The equations of an instance.
    fn record(&self, values: &[Value]) -> Result<Recording, String> {
        let (d, equations) = (&self.descriptor, &self.equations);
        let known = known(equations, values);
        let live = live(equations, &known);
        let mut recording = record(|| {
            let mut nodes: Vec<Recorded> = Vec::with_capacity(equations.steps.len());
            for (k, step) in equations.steps.iter().enumerate() {
                let at = |operand: Operand| match operand {
                    Operand::Value(k) => nodes[k as usize],
                    Operand::Number(number) => Recorded::from(number),
                };
                let node = match known[k] {
                    Some(number) => Recorded::from(number),
                    None if live[k] => apply(equations, step, values, &known, at),
                    // Nothing asks for it.
                    None => Recorded::from(0.0),
                };
                nodes.push(node);
            }
            let at = |operand: Operand| match operand {
                Operand::Value(k) => nodes[k as usize],
                Operand::Number(number) => Recorded::from(number),
            };
            let mut results: Vec<(Role, Recorded)> =
                equations.results.iter().map(|(role, value)| (*role, at(*value))).collect();
            // What acts on no body; and of flexible coordinates q', while the host finds q''.
            let loads = if d.kind == Kind::Force { 3 * d.frames.len() as u32 } else { 0 };
            let loads = (0..loads).flat_map(|k| [Role::Force(k), Role::Torque(k)]);
            let zeros: Vec<Role> = loads.filter(|role| results.iter().all(|(given, _)| given != role)).collect();
            results.extend(zeros.into_iter().map(|role| (role, Recorded::from(0.0))));
            let flexible = equations.flexible() as u32;
            results.extend((0..flexible).map(|k| (Role::StateRate(k), input(Input::State(flexible + k)))));
            results
        });
        let number = |operand: &Operand| of_known(&known, *operand).unwrap_or(f64::NAN);
        recording.initial_states = equations.starts.iter().map(number).collect();
        recording.initial_discrete = equations.memory.iter().map(number).collect();
        recording.check(&d.limits())?;
        Ok(recording)
    }
}

fn of_known(known: &[Option<f64>], operand: Operand) -> Option<f64> {
    match operand {
        Operand::Value(k) => known[k as usize],
        Operand::Number(number) => Some(number),
    }
}

/// The values that follow from the parameters alone.
fn known(equations: &Equations, values: &[Value]) -> Vec<Option<f64>> {
    let mut known: Vec<Option<f64>> = Vec::with_capacity(equations.steps.len());
    for step in &equations.steps {
        let at = |operand: Operand| of_known(&known, operand);
        let value = match *step {
            Step::Parameter(parameter, component) => match &values[parameter] {
                Value::Numbers(numbers) => Some(numbers[component]),
                Value::Function(_) | Value::Surface(_) => None,
            },
            Step::Unary(operation, a) => at(a).map(|a| operation.of(a)),
            Step::Binary(operation, [a, b]) => at(a).zip(at(b)).map(|(a, b)| operation.of(a, b)),
            Step::Powi(a, n) => at(a).map(|a| a.powi(n)),
            Step::Powf([a, exponent]) => at(a).zip(at(exponent)).map(|(a, exponent)| a.powf(exponent)),
            Step::Select(all) => chosen(&known, all).and_then(at),
            Step::Input(_) | Step::Table(..) | Step::Function(..) | Step::Slope(..) | Step::Surface(..) => None,
        };
        known.push(value);
    }
    known
}

/// What a choice comes to that depends on parameters only.
fn chosen(known: &[Option<f64>], [a, b, x, y]: [Operand; 4]) -> Option<Operand> {
    let (a, b) = of_known(known, a).zip(of_known(known, b))?;
    Some(if a < b { x } else { y })
}

/// The values that a result needs.
fn live(equations: &Equations, known: &[Option<f64>]) -> Vec<bool> {
    let mut live = vec![false; equations.steps.len()];
    let mark = |live: &mut [bool], operand: Operand| {
        if let Operand::Value(k) = operand {
            live[k as usize] = true;
        }
    };
    equations.results.iter().for_each(|(_, value)| mark(&mut live, *value));
    for (k, step) in equations.steps.iter().enumerate().rev() {
        if !live[k] || known[k].is_some() {
            continue;
        }
        match step {
            Step::Select(all) if chosen(known, *all).is_some() => {
                chosen(known, *all).into_iter().for_each(|operand| mark(&mut live, operand));
            }
            step => step.operands().for_each(|operand| mark(&mut live, operand)),
        }
    }
    live
}

/// The value of a step that depends on the motion.
fn apply(
    equations: &Equations,
    step: &Step,
    values: &[Value],
    known: &[Option<f64>],
    at: impl Fn(Operand) -> Recorded,
) -> Recorded {
    // Parameters are known, and of the kind that the equations were read for.
    let nothing = Recorded::from(f64::NAN);
    match *step {
        Step::Input(which) => input(which),
        Step::Unary(operation, a) => operation.of(at(a)),
        Step::Binary(operation, [a, b]) => operation.of(at(a), at(b)),
        Step::Powi(a, n) => at(a).powi(n),
        Step::Powf([a, exponent]) => of_known(known, exponent).map_or(nothing, |exponent| at(a).powf(exponent)),
        Step::Select(all) => match chosen(known, all) {
            Some(operand) => at(operand),
            None => {
                let [a, b, x, y] = all.map(at);
                Recorded::select(a, b, x, y)
            }
        },
        Step::Table(table, a) => at(a).lookup(&equations.tables[table]),
        Step::Function(parameter, a) => match &values[parameter] {
            Value::Function(function) => function.at(at(a)),
            _ => nothing,
        },
        Step::Slope(parameter, a) => match &values[parameter] {
            Value::Function(function) => function.slope(at(a)),
            _ => nothing,
        },
        Step::Surface(parameter, [a, b]) => match &values[parameter] {
            Value::Surface(surface) => surface.at(at(a), at(b)),
            _ => nothing,
        },
        Step::Parameter(..) => nothing,
    }
}

impl DataSet {
    fn recording(&self, number: usize) -> Result<&Recording, Fault> {
        let count = self.instances.len();
        let absent = || Fault { instance: number, message: format!("instance {number} does not exist ({count} do)") };
        let instance = self.instances.get(number).ok_or_else(absent)?;
        if let Some(recording) = instance.recording.get() {
            return Ok(recording);
        }
        let recording = self.class.record(&instance.values).map_err(|message| Fault { instance: number, message })?;
        Ok(instance.recording.get_or_init(|| recording))
    }
}

impl ElementSet for DataSet {
    fn add(&mut self, params: &Params) -> Result<usize, CreateError> {
        let specs = &self.class.descriptor.params;
        let values = specs.iter().map(|spec| Value::read(spec, params));
        let values = values.collect::<Result<_, _>>().map_err(CreateError::Parameter)?;
        self.instances.push(Instance { values, recording: OnceCell::new() });
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        self.recording(instance).cloned()
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let Class { descriptor, rows, layout, .. } = &*self.class;
        let (kind, layout) = (descriptor.kind, *layout);
        let results = if kind == Kind::Joint { layout.joint_results() } else { layout.force_results() };
        let count = batch.instances.len();
        if batch.inputs.len() != count * layout.inputs() || out.len() != count * results {
            let message = format!("needs {} inputs and {results} results each", layout.inputs());
            return Err(Fault { instance: 0, message });
        }
        for (k, number) in batch.instances.iter().enumerate() {
            let recording = self.recording(*number as usize)?;
            let own = &mut out[k * results..][..results];
            own.fill(f64::NAN);
            if kind == Kind::Control {
                // It acts on no body; the places for loads are there all the same.
                own[..6 * layout.frames].fill(0.0);
            }
            let inputs = &batch.inputs[k * layout.inputs()..][..layout.inputs()];
            Evaluation { recording, kind, layout, rows }.evaluate(inputs, batch.wanted, own);
        }
        Ok(())
    }

    fn accept(&mut self, _: usize, _: &[f64]) -> Result<(), Fault> {
        Ok(())
    }

    fn save(&self, _: usize) -> Result<Vec<u8>, Fault> {
        Ok(Vec::new())
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        if memory.is_empty() {
            return Ok(());
        }
        Err(Fault { instance, message: "this element keeps no memory".into() })
    }
}
