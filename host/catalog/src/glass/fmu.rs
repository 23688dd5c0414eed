//! FMUs behind glass: what is known from their description is answered here, their code runs in a process.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use element_api::descriptor::Descriptor;
use element_api::params::Table;
use element_api::recording::Recording;
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

use super::message::Request;
use super::{Glass, GlassClass, Kept};
use std::borrow::Cow;
use std::path::Path;

/// The class of an FMU, its code behind glass; `class` is the same here, `package` what messages call it.
pub(crate) fn fmu(fmu: &odyn_fmu::Fmu, class: Arc<dyn ElementClass>, package: &str) -> Arc<dyn ElementClass> {
    let folder: PathBuf = fmu.folder().into();
    // Nothing is kept on disk: the folder goes with the FMU.
    let kept = Kept::of(&folder, Path::new(""));
    let glass = Glass { copy: folder, is_fmu: true, package: package.into(), process: Mutex::new(None), kept };
    let descriptor = class.descriptor().clone();
    let remote = GlassClass { glass: Arc::new(glass), number: 0, descriptor };
    Arc::new(FmuClass { here: class, remote: Arc::new(remote), _fmu: fmu.clone() })
}

struct FmuClass {
    here: Arc<dyn ElementClass>,
    remote: Arc<GlassClass>,
    /// Its files stay.
    _fmu: odyn_fmu::Fmu,
}

impl ElementClass for FmuClass {
    fn descriptor(&self) -> &Descriptor {
        self.here.descriptor()
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        let set = FmuSet {
            here: self.here.new_set(),
            remote: self.remote.new_glass_set(),
            glass: Arc::clone(&self.remote.glass),
            next: String::new(),
        };
        Box::new(set)
    }
}

struct FmuSet {
    here: Box<dyn ElementSet>,
    remote: super::GlassSet,
    glass: Arc<Glass>,
    /// Name of the instance that is added next.
    next: String,
}

impl ElementSet for FmuSet {
    fn announce(&mut self, name: &str) {
        self.next = name.into();
    }

    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let mut params = params.clone();
        params.insert(odyn_fmu::INSTANCE.into(), std::mem::take(&mut self.next).into());
        let params = &params;
        let number = self.here.add(params)?;
        let recording = self.here.record(number).map_err(|fault| CreateError::Fault(fault.message))?;
        // What is known needs no process.
        let text = toml::to_string(params).map_err(|error| CreateError::Fault(error.to_string()))?;
        self.glass.kept.keep(0, &text, &Arc::new(recording));
        self.remote.add(params)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        self.here.record(instance)
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        self.here.evaluate(batch, out)
    }

    fn accept(&mut self, _: usize, _: &[f64]) -> Result<(), Fault> {
        Ok(())
    }

    fn communicates(&self) -> bool {
        true
    }

    fn communicate(&mut self, instance: usize, t: f64, begins: bool, memory: &mut [f64]) -> Result<(), Fault> {
        let given = Cow::Borrowed(&*memory);
        let request = |set| Request::Communicate { set, instance: instance as u32, t, begins, memory: given };
        let found: Vec<f64> = self.remote.ask(instance, request)?;
        if found.len() != memory.len() {
            return Err(Fault { instance, message: "it gave another number of results".into() });
        }
        memory.copy_from_slice(&found);
        Ok(())
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        // Who has not begun has no state.
        if self.remote.made.get().is_none() { Ok(Vec::new()) } else { self.remote.save(instance) }
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        if memory.is_empty() { Ok(()) } else { self.remote.load(instance, memory) }
    }
}
