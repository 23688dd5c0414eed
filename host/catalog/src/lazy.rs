//! Libraries of the program itself whose answers are known from an earlier start: they are loaded when something else is asked of
//! them, which for most runs is never.
//!
//! Known are ([`Kept`]) that the library could be opened, the descriptors of its classes, and the equations of instances by class
//! and parameters: what libraries behind glass are remembered by, too. Instances with free text among their parameters are asked
//! at every start, since text may name a file; so are elements that are called. Where anything is missing, damaged, or from another
//! build of library or program, the library is loaded and asked.

use std::cell::OnceCell;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use element_api::abi::OpenError;
use element_api::descriptor::Descriptor;
use element_api::manifest::{Manifest, ManifestElement};
use element_api::params::{ParamSpec, Table};
use element_api::recording::{Limits, Recording};
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

use super::kept::{Kept, OPENED};
use super::loader::{Offers, offer};

/// Loads the library: what it offers, and whether it left the floating-point control register as it was.
type Load = dyn Fn() -> (Result<Offers, OpenError>, bool) + Send + Sync;

/// A library that is loaded when it is needed.
struct Lazy {
    kept: Kept,
    load: Box<Load>,
    loaded: OnceLock<Result<Offers, String>>,
}

/// What a library offers, as by `load`, which is called at once if it was not opened before.
pub(super) fn enter(
    kept: Kept,
    path: &Path,
    manifest: &Manifest,
    load: impl Fn() -> (Result<Offers, OpenError>, bool) + Send + Sync + 'static,
) -> (Result<Offers, OpenError>, bool) {
    let loaded = OnceLock::new();
    if kept.read(OPENED, "") != Some(true) {
        match load() {
            (Ok(offers), true) => {
                kept.write(OPENED, "", &true);
                let _ = loaded.set(Ok(offers));
            }
            other => return other,
        }
    }
    let lazy = Arc::new(Lazy { kept, load: Box::new(load), loaded });
    let offered = |(number, announced): (usize, &ManifestElement)| {
        let (lazy, element) = (Arc::clone(&lazy), announced.clone());
        let mut offer = offer(announced, path, &manifest.package, move || lazy.class(number, &element));
        offer.at_rest = true;
        Arc::new(offer)
    };
    (Ok(manifest.elements.iter().enumerate().map(offered).collect()), true)
}

impl Lazy {
    /// The class itself; the library is loaded if it is not yet.
    fn real(&self, announced: &ManifestElement) -> Result<Arc<dyn ElementClass>, String> {
        let loaded = self.loaded.get_or_init(|| (self.load)().0.map_err(|error| error.to_string()));
        let offers = loaded.as_ref().map_err(Clone::clone)?;
        let offer = offers.iter().find(|offer| offer.name() == announced.name && offer.kind() == announced.kind);
        let class = offer.ok_or("it does not have the element that its manifest names")?.class();
        class.map(Arc::clone).map_err(|error| error.to_string())
    }

    /// The class as it is handed out.
    fn class(self: &Arc<Self>, number: usize, announced: &ManifestElement) -> Result<Arc<dyn ElementClass>, String> {
        let number = number as u32;
        let descriptor = match self.kept.descriptor(number) {
            Some(known) => known,
            None => {
                let descriptor = self.real(announced)?.descriptor().clone();
                self.kept.keep_descriptor(number, &descriptor);
                descriptor
            }
        };
        let (lazy, announced) = (Arc::clone(self), announced.clone());
        Ok(Arc::new(LazyClass { lazy, number, announced, descriptor }))
    }
}

struct LazyClass {
    lazy: Arc<Lazy>,
    number: u32,
    announced: ManifestElement,
    descriptor: Descriptor,
}

impl ElementClass for LazyClass {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        let set = LazySet {
            lazy: Arc::clone(&self.lazy),
            number: self.number,
            announced: self.announced.clone(),
            specs: self.descriptor.params.clone(),
            limits: self.descriptor.limits(),
            instances: Vec::new(),
            real: OnceCell::new(),
        };
        // Elements that are called have no equations to know.
        match self.descriptor.opaque.then(|| self.lazy.real(&self.announced)) {
            Some(Ok(class)) => class.new_set(),
            _ => Box::new(set),
        }
    }
}

/// Instances whose equations are known are made in the library only when something else is asked of them.
struct LazySet {
    lazy: Arc<Lazy>,
    number: u32,
    announced: ManifestElement,
    specs: Vec<ParamSpec>,
    limits: Limits,
    /// The parameters of the instances; as text where their equations may be known.
    instances: Vec<(Table, Option<String>)>,
    /// The library's own set, with all instances so far, or why there is none.
    real: OnceCell<Result<Box<dyn ElementSet>, String>>,
}

impl LazySet {
    fn make(&self) -> Result<Box<dyn ElementSet>, String> {
        let mut set = self.lazy.real(&self.announced)?.new_set();
        for (params, _) in &self.instances {
            set.add(params).map_err(|_| "it refuses parameters that it took before")?;
        }
        Ok(set)
    }

    fn real(&self, instance: usize) -> Result<&dyn ElementSet, Fault> {
        let made = self.real.get_or_init(|| self.make());
        made.as_deref().map_err(|message| Fault { instance, message: message.clone() })
    }

    fn real_mut(&mut self, instance: usize) -> Result<&mut dyn ElementSet, Fault> {
        self.real(instance)?;
        match self.real.get_mut() {
            Some(Ok(set)) => Ok(&mut **set),
            _ => Err(Fault { instance, message: "there is no set".into() }),
        }
    }

    /// The equations of instances with these parameters, if they are known.
    fn known(&self, text: &str) -> Option<Arc<Recording>> {
        self.lazy.kept.recording(self.number, text, &self.limits)
    }
}

/// Whether there is text among parameters that is none of a few words.
fn has_text(params: &Table, specs: &[ParamSpec]) -> bool {
    let is_word = |name: &str| specs.iter().any(|spec| spec.name == name && !spec.choices.is_empty());
    params.iter().any(|(name, value)| is_text(value) && !(value.is_str() && is_word(name)))
}

fn is_text(value: &toml::Value) -> bool {
    match value {
        toml::Value::String(_) => true,
        toml::Value::Array(values) => values.iter().any(is_text),
        toml::Value::Table(table) => table.values().any(is_text),
        _ => false,
    }
}

impl ElementSet for LazySet {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let count = self.instances.len();
        let text = if has_text(params, &self.specs) { None } else { toml::to_string(params).ok() };
        let known = self.real.get().is_none() && text.as_ref().is_some_and(|text| self.known(text).is_some());
        if !known {
            let real = self.real_mut(count).map_err(|fault| CreateError::Fault(fault.message))?;
            let number = real.add(params)?;
            if number != count {
                return Err(CreateError::Fault(format!("instance {count} was numbered {number}")));
            }
        }
        self.instances.push((params.clone(), text));
        Ok(count)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let text = self.instances.get(instance).and_then(|(_, text)| text.as_ref());
        if let Some(known) = text.and_then(|text| self.known(text)) {
            return Ok(Recording::clone(&known));
        }
        let recording = self.real(instance)?.record(instance)?;
        if let Some(text) = text {
            self.lazy.kept.keep(self.number, text, &Arc::new(recording.clone()));
        }
        Ok(recording)
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let first = batch.instances.first().map_or(0, |first| *first as usize);
        self.real(first)?.evaluate(batch, out)
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        self.real_mut(instance)?.accept(instance, inputs)
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        self.real(instance)?.save(instance)
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        self.real_mut(instance)?.load(instance, memory)
    }
}
