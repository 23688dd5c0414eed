//! Libraries behind glass: loaded into a process of their own, which is asked through pipes.
//!
//! - **Takes**: the file of a library that is not trusted.
//! - **Gives**: its classes, as if it were loaded; equal bit by bit.
//! - **May touch**: processes, pipes.
//! - **Must not know**: what is asked for, and where the answers go.
//!
//! Equations cross once, as data, so glass costs nothing while a scene runs. Elements that are called cross at every evaluation.
//!
//! | file | content |
//! |---|---|
//! | `message.rs` | what is asked and answered |
//! | `process.rs` | a recorder seen from the host |
//! | `recorder.rs` | the program as a recorder |
//! | `shut_in.rs` | what a recorder may do |

mod message;
mod process;
mod recorder;
mod shut_in;

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use element_api::abi::OpenError;
use element_api::descriptor::Descriptor;
use element_api::params::Table;
use element_api::recording::{Limits, Recording};
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

use message::{Opening, Request};
use odyn_diagnostics::{Code, codes};
use process::Process;
pub use recorder::record_if_asked;

/// A call that takes longer is ended with its process.
const LIMIT: Duration = Duration::from_secs(60);

/// The program that is started as a recorder.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// From now on, libraries that are not trusted are loaded behind glass by all catalogs of this process. For programs that call
/// [`record_if_asked`] first of all: they start themselves. Trusted are libraries beside the program, and those that
/// [`Request`](crate::Request) says.
pub fn put_up_glass() {
    // The file may be replaced while the program runs.
    let own = if cfg!(target_os = "linux") { Ok("/proc/self/exe".into()) } else { std::env::current_exe() };
    if let Ok(program) = own {
        let _ = PROGRAM.set(program);
    }
}

/// Whether there is glass.
pub(super) fn is_up() -> bool {
    PROGRAM.get().is_some()
}

/// The code of what became of a process, from its sentence.
pub(super) fn code(message: &str) -> Option<Code> {
    let begins = |with: &str| message.starts_with(with);
    if begins(process::CRASHED) || begins(process::EXITED) {
        return Some(codes::PLUGIN_CRASHED);
    }
    begins(process::LATE).then_some(codes::PLUGIN_HANGS)
}

/// A library behind glass. Its process is started when it is needed, and again after it has ended.
pub(super) struct Glass {
    copy: PathBuf,
    /// For what it prints.
    package: String,
    process: Mutex<Option<Arc<Process>>>,
}

impl Glass {
    /// Loads the library in the file `copy`. Whether it left the floating-point control register as it was comes with it.
    pub(super) fn enter(copy: &Path, package: &str) -> (Result<Arc<Self>, OpenError>, bool) {
        let glass = Self { copy: copy.into(), package: package.into(), process: Mutex::new(None) };
        match glass.start() {
            Ok((process, kept)) => {
                glass.process.lock().unwrap_or_else(PoisonError::into_inner).replace(Arc::new(process));
                (Ok(Arc::new(glass)), kept)
            }
            Err(error) => (Err(error), true),
        }
    }

    fn start(&self) -> Result<(Process, bool), OpenError> {
        let program = PROGRAM.get().map_or(OsStr::new(""), |program| program.as_os_str());
        let mut command = Command::new(program);
        let process = Process::start(command.arg(recorder::WORD), &self.package, LIMIT);
        let process = process.map_err(|error| {
            OpenError::Root(format!("no process for it can be started: {error}; --in-process loads it into this one"))
        })?;
        let opening: Opening =
            process.ask(&Request::Open { copy: self.copy.clone() }).map_err(|gone| OpenError::Root(gone.into()))?;
        opening.opened.map(|()| (process, opening.kept))
    }

    /// The process, a new one where the last one has ended.
    fn process(&self) -> Result<Arc<Process>, String> {
        let mut process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        match &*process {
            Some(alive) if !alive.is_gone() => Ok(Arc::clone(alive)),
            _ => {
                let (again, _) = self.start().map_err(|error| error.to_string())?;
                Ok(Arc::clone(process.insert(Arc::new(again))))
            }
        }
    }

    /// The class of this number.
    ///
    /// # Errors
    /// Why the library gives none, or what is impossible about it.
    pub(super) fn class(self: &Arc<Self>, number: usize) -> Result<Arc<dyn ElementClass>, String> {
        let number = number as u32;
        let text = self.process()?.ask::<Result<String, String>>(&Request::Describe { class: number })??;
        let descriptor: Descriptor =
            toml::from_str(&text).map_err(|error| format!("a descriptor can't be read: {error}"))?;
        descriptor.check()?;
        Ok(Arc::new(GlassClass { glass: Arc::clone(self), number, descriptor }))
    }
}

struct GlassClass {
    glass: Arc<Glass>,
    number: u32,
    descriptor: Descriptor,
}

impl ElementClass for GlassClass {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        let made = self.glass.process().and_then(|process| {
            let set = process.ask::<Result<u32, String>>(&Request::NewSet { class: self.number })??;
            Ok((process, set))
        });
        Box::new(GlassSet { made, limits: self.descriptor.limits(), count: 0 })
    }
}

struct GlassSet {
    /// The process and the set's number there; or why there is none.
    made: Result<(Arc<Process>, u32), String>,
    limits: Limits,
    /// Instances so far.
    count: usize,
}

impl GlassSet {
    /// Asks for an instance.
    fn ask<'r, T: serde::de::DeserializeOwned>(
        &self,
        instance: usize,
        request: impl FnOnce(u32) -> Request<'r>,
    ) -> Result<T, Fault> {
        if instance >= self.count {
            let message = format!("instance {instance} does not exist ({} do)", self.count);
            return Err(Fault { instance, message });
        }
        let fault = |message: String| Fault { instance, message };
        let (process, set) = self.made.as_ref().map_err(|message| fault(message.clone()))?;
        let answer: Result<T, Fault> = process.ask(&request(*set)).map_err(|gone| Fault {
            instance: gone.instance.unwrap_or(instance).min(self.count - 1),
            message: gone.message,
        })?;
        answer.map_err(|fault| Fault { instance: fault.instance.min(self.count - 1), ..fault })
    }
}

impl Drop for GlassSet {
    fn drop(&mut self) {
        if let Ok((process, set)) = &self.made
            && !process.is_gone()
        {
            // Who breaks now is named when he is needed again.
            let _ = process.ask::<()>(&Request::DropSet { set: *set });
        }
    }
}

impl ElementSet for GlassSet {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let (process, set) = self.made.as_ref().map_err(|message| CreateError::Fault(message.clone()))?;
        let text = toml::to_string(params)
            .map_err(|error| CreateError::Fault(format!("the parameters can't be written as TOML: {error}")))?;
        let request = Request::Add { set: *set, params: Cow::Owned(text) };
        let number: Result<u32, CreateError> = process.ask(&request).map_err(|gone| CreateError::Fault(gone.into()))?;
        let number = number? as usize;
        if number != self.count {
            return Err(CreateError::Fault(format!("instance {} was numbered {number}", self.count)));
        }
        self.count += 1;
        Ok(number)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let recording: Recording = self.ask(instance, |set| Request::Record { set, instance: instance as u32 })?;
        recording.check(&self.limits).map_err(|message| Fault { instance, message })?;
        Ok(recording)
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let Some(first) = batch.instances.first().map(|first| *first as usize) else { return Ok(()) };
        let results: Vec<f64> = self.ask(first, |set| Request::Evaluate {
            set,
            instances: batch.instances.into(),
            inputs: batch.inputs.into(),
            jacobian: batch.wanted.jacobian,
            second: batch.wanted.second,
            out: Cow::Borrowed(out),
        })?;
        if results.len() != out.len() {
            let message = format!("it gave {} results instead of {}", results.len(), out.len());
            return Err(Fault { instance: first, message });
        }
        out.copy_from_slice(&results);
        Ok(())
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        self.ask(instance, |set| Request::Accept { set, instance: instance as u32, inputs: inputs.into() })
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        self.ask(instance, |set| Request::Save { set, instance: instance as u32 })
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        self.ask(instance, |set| Request::Load { set, instance: instance as u32, memory: memory.into() })
    }
}
