//! An FMU as an element: a control element that samples. Its memory is its outputs, held between communication points, and behind
//! them the inputs that the next communication step takes.

use std::sync::{Arc, Mutex, PoisonError};

use element_api::descriptor::{Descriptor, Kind, Named, NamedInput};
use element_api::manifest::Library as Linked;
use element_api::params::{ParamKind, ParamSpec, Table};
use element_api::recorded::{Recorded, input, record};
use element_api::recording::{Input, Recording, Role};
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

use crate::description::{Causality, Description, Storage, number};
use crate::files::Fmu;
use crate::instance::{Given, Instance, signals};
use crate::library::Library;

/// Name of the element type.
pub const TYPE: &str = "fmu";
/// What stands for a library of elements.
pub const GENERAL: &str = "odyn-fmu";
/// The table of the FMU's own parameters in a scene; the names of their descriptions begin with it and a dot.
pub const PARAMETERS: &str = "parameters";
/// The name of an instance among its parameters, where nobody announces it: in another process.
pub const INSTANCE: &str = "instance";
/// What messages about failures of FMUs begin with.
pub const FAILED: &str = "the FMU failed: ";
/// What messages begin with where an FMU cannot save or restore its state.
pub const NO_STATE: &str = "the FMU keeps no state: ";
/// Manual page of the element.
pub const DOC: &str = include_str!("manual.md");

const SUMMARY: &str =
    "FMU of another tool (FMI 2.0 or 3.0, co-simulation) that computes from one communication point to the next";

/// The element type without a file: what is known of all FMUs.
#[must_use]
pub fn general() -> Linked {
    struct General(Descriptor);
    impl ElementClass for General {
        fn descriptor(&self) -> &Descriptor {
            &self.0
        }
        fn new_set(&self) -> Box<dyn ElementSet> {
            Box::new(NoFile)
        }
    }
    Linked {
        package: GENERAL.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        about: "FMUs of other tools as control elements".into(),
        classes: vec![Box::new(General(descriptor(own_params(None), Vec::new(), Vec::new())))],
    }
}

struct NoFile;

impl NoFile {
    fn fault<T>(instance: usize) -> Result<T, Fault> {
        Err(Fault { instance, message: "there is no FMU without a file".into() })
    }
}

impl ElementSet for NoFile {
    fn add(&mut self, _: &Table) -> Result<usize, CreateError> {
        Err(CreateError::Fault("there is no FMU without a file".into()))
    }
    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        Self::fault(instance)
    }
    fn evaluate(&self, _: &Batch<'_>, _: &mut [f64]) -> Result<(), Fault> {
        Self::fault(0)
    }
    fn accept(&mut self, instance: usize, _: &[f64]) -> Result<(), Fault> {
        Self::fault(instance)
    }
    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        Self::fault(instance)
    }
    fn load(&mut self, instance: usize, _: &[u8]) -> Result<(), Fault> {
        Self::fault(instance)
    }
}

fn own_params(step: Option<f64>) -> Vec<ParamSpec> {
    let mut period = ParamSpec::new::<f64>("period", "s", "Time from one communication point to the next").above(0.0);
    period.default = step.map(Into::into);
    if step.is_none() {
        period = period.example_value(1e-3.into());
    }
    let file = ParamSpec::new::<String>("file", "", "The FMU, beside the scene if the path is not absolute");
    vec![file.example_value("controller.fmu".into()), period]
}

fn descriptor(params: Vec<ParamSpec>, inputs: Vec<NamedInput>, channels: Vec<Named>) -> Descriptor {
    Descriptor {
        name: TYPE.into(),
        kind: Kind::Control,
        summary: SUMMARY.into(),
        doc: DOC.into(),
        opaque: false,
        angles: 0,
        mobility: None,
        turns_freely: false,
        glyph: String::new(),
        frames: Vec::new(),
        more_frames: None,
        most_frames: 0,
        rows: Vec::new(),
        inputs,
        joints: Vec::new(),
        channels,
        states: Vec::new(),
        params,
        exempt: Vec::new(),
        checks: Vec::new(),
        catalog: String::new(),
        report: String::new(),
        parallel_axes: Vec::new(),
        unknowns: Vec::new(),
        values: Vec::new(),
    }
}

/// A name as the signals of a scene are written: `x[1]` is `x_1`.
fn written(name: &str) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    let text: String = name.chars().map(|c| if fits(c) { c } else { '_' }).collect();
    text.trim_end_matches('_').to_string()
}

/// What a scene may say to an FMU, and take from it.
pub(crate) fn describe(fmu: &Description) -> Descriptor {
    let mut params = own_params(fmu.step);
    params.extend(fmu.of(Causality::Parameter).map(|variable| {
        let mut spec =
            ParamSpec::new::<f64>(&format!("{PARAMETERS}.{}", variable.name), &variable.unit.si, &variable.doc);
        spec.kind = match variable.storage {
            Storage::Text => ParamKind::Text,
            Storage::Boolean => ParamKind::Boolean,
            Storage::Float64 | Storage::Float32 => ParamKind::Number,
            _ => ParamKind::Integer,
        };
        // What is not given stays as the FMU has it.
        spec.optional = true;
        spec
    }));
    let inputs = signals(fmu, Causality::Input).map(|variable| {
        let start = variable.start.as_deref().and_then(|text| number(variable.storage, text)).unwrap_or(0.0);
        NamedInput {
            name: variable.name.clone(),
            unit: variable.unit.si.clone(),
            doc: variable.doc.clone(),
            default: Some(variable.unit.to_si(start)),
        }
    });
    let mut channels: Vec<Named> = Vec::new();
    for variable in signals(fmu, Causality::Output) {
        let name = written(&variable.name);
        let taken = name.is_empty() || channels.iter().any(|known| known.name == name);
        let name = if taken { variable.name.clone() } else { name };
        channels.push(Named { name, unit: variable.unit.si.clone(), doc: variable.doc.clone() });
    }
    descriptor(params, inputs.collect(), channels)
}

/// An FMU as a class of elements.
pub(crate) struct FmuClass {
    fmu: Fmu,
    descriptor: Descriptor,
    /// Its binary, once it was needed.
    library: Arc<Mutex<Option<Arc<Library>>>>,
}

impl FmuClass {
    pub(crate) fn new(fmu: Fmu, descriptor: Descriptor) -> Self {
        Self { fmu, descriptor, library: Arc::default() }
    }
}

impl ElementClass for FmuClass {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        Box::new(FmuSet {
            fmu: self.fmu.clone(),
            library: Arc::clone(&self.library),
            entries: Vec::new(),
            next: String::new(),
        })
    }
}

struct Entry {
    name: String,
    period: f64,
    parameters: Vec<(usize, Given)>,
    /// Behind a lock, since saving a state calls the FMU.
    running: Mutex<Option<Instance>>,
}

struct FmuSet {
    fmu: Fmu,
    library: Arc<Mutex<Option<Arc<Library>>>>,
    entries: Vec<Entry>,
    /// Name of the instance that is added next.
    next: String,
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl FmuSet {
    fn entry(&self, instance: usize) -> Result<&Entry, Fault> {
        self.entries.get(instance).ok_or_else(|| Fault { instance, message: "there is no such instance".into() })
    }

    fn sizes(&self) -> [usize; 2] {
        [Causality::Output, Causality::Input].map(|causality| signals(&self.fmu.description, causality).count())
    }

    /// A new instance at a time, s.
    fn start(&self, entry: &Entry, t: f64) -> Result<Instance, String> {
        let library = {
            let mut known = lock(&self.library);
            match &*known {
                Some(library) => Arc::clone(library),
                None => Arc::clone(known.insert(Arc::new(self.fmu.load()?))),
            }
        };
        let resources = self.fmu.folder().join("resources");
        Instance::start(&library, &self.fmu.description, (&entry.name, &resources), t, &entry.parameters)
    }
}

impl ElementSet for FmuSet {
    fn announce(&mut self, name: &str) {
        self.next = name.into();
    }

    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let period = params.get("period").and_then(toml_number).unwrap_or(0.0);
        if period <= 0.0 {
            return Err(CreateError::Fault("there is no period".into()));
        }
        let mut parameters = Vec::new();
        for (place, variable) in self.fmu.description.variables.iter().enumerate() {
            if variable.causality != Causality::Parameter {
                continue;
            }
            let Some(value) = params.get(&format!("{PARAMETERS}.{}", variable.name)) else { continue };
            let given = match (value.as_str(), value.as_bool()) {
                (Some(text), _) => Given::Text(text.into()),
                (None, Some(flag)) => Given::Number(f64::from(u8::from(flag))),
                _ => Given::Number(variable.unit.of_si(toml_number(value).unwrap_or(f64::NAN))),
            };
            parameters.push((place, given));
        }
        let announced = std::mem::take(&mut self.next);
        let named = params.get(INSTANCE).and_then(toml::Value::as_str).map_or(announced, ToOwned::to_owned);
        // FMUs refuse to be called nothing.
        let name = if named.is_empty() { self.fmu.description.model.clone() } else { named };
        self.entries.push(Entry { name, period, parameters, running: Mutex::new(None) });
        Ok(self.entries.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let entry = self.entry(instance)?;
        let [outputs, inputs] = self.sizes();
        let mut recording = record(|| {
            let held = |k: usize| input(Input::Discrete(k as u32));
            let channels = (0..outputs).map(|k| (Role::Channel(k as u32), held(k)));
            let mut results: Vec<(Role, Recorded)> = channels.collect();
            results.extend((0..outputs).map(|k| (Role::NextDiscrete(k as u32), held(k))));
            let taken = (0..inputs).map(|k| (Role::NextDiscrete((outputs + k) as u32), input(Input::Signal(k as u32))));
            results.extend(taken);
            results.push((Role::SamplePeriod, Recorded::from(entry.period)));
            results
        });
        let start = |causality: Causality| {
            signals(&self.fmu.description, causality).map(|variable| {
                let start = variable.start.as_deref().and_then(|text| number(variable.storage, text)).unwrap_or(0.0);
                variable.unit.to_si(start)
            })
        };
        recording.initial_discrete = start(Causality::Output).chain(start(Causality::Input)).collect();
        Ok(recording)
    }

    fn evaluate(&self, _: &Batch<'_>, _: &mut [f64]) -> Result<(), Fault> {
        Err(Fault { instance: 0, message: "an FMU is not evaluated between communication points".into() })
    }

    fn accept(&mut self, _: usize, _: &[f64]) -> Result<(), Fault> {
        Ok(())
    }

    fn communicates(&self) -> bool {
        true
    }

    fn communicate(&mut self, instance: usize, t: f64, begins: bool, memory: &mut [f64]) -> Result<(), Fault> {
        let failed = |message: String| Fault { instance, message: FAILED.to_owned() + &message };
        let [outputs, inputs] = self.sizes();
        if memory.len() != outputs + inputs {
            return Err(failed("the host gives it a memory of another size".into()));
        }
        let entry = self.entry(instance)?;
        let mut running = lock(&entry.running);
        let (outputs, inputs) = memory.split_at_mut(outputs);
        if begins && running.is_none() {
            *running = Some(self.start(entry, t).map_err(failed)?);
        }
        let Some(running) = &mut *running else {
            let why = "the state to continue from has none of this FMU: start the run anew";
            return Err(Fault { instance, message: NO_STATE.to_owned() + why });
        };
        let done =
            if begins { running.settle(inputs, outputs) } else { running.step(t, entry.period, inputs, outputs) };
        done.map_err(failed)
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        let entry = self.entry(instance)?;
        let mut running = lock(&entry.running);
        let Some(running) = &mut *running else { return Ok(Vec::new()) };
        let refused = |message: String| Fault { instance, message: NO_STATE.to_owned() + &message };
        if !self.fmu.description.keeps_state {
            let why = "it says that its state cannot be saved (canGetAndSetFMUstate, canSerializeFMUstate)";
            return Err(refused(why.into()));
        }
        let mut bytes = running.time.to_le_bytes().to_vec();
        bytes.extend(running.save().map_err(refused)?);
        Ok(bytes)
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        let entry = self.entry(instance)?;
        if memory.is_empty() {
            return Ok(());
        }
        let refused = |message: String| Fault { instance, message: NO_STATE.to_owned() + &message };
        let (time, state) = memory.split_first_chunk::<8>().ok_or_else(|| refused("its bytes are cut short".into()))?;
        let time = f64::from_le_bytes(*time);
        let mut running = lock(&entry.running);
        if running.is_none() {
            *running = Some(self.start(entry, time).map_err(refused)?);
        }
        let Some(running) = &mut *running else { return Ok(()) };
        running.load(time, state).map_err(refused)
    }
}

fn toml_number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}
