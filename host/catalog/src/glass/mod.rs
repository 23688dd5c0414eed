//! Libraries behind glass: loaded into a process of their own, which is asked through pipes.
//!
//! - **Takes**: the file of a library that is not trusted.
//! - **Gives**: its classes, as if it were loaded; equal bit by bit.
//! - **May touch**: processes, pipes.
//! - **Must not know**: what is asked for, and where the answers go.
//!
//! Equations cross once, as data, so glass costs nothing while a scene runs, and are kept: a second start with the same library and
//! parameters starts no process. Elements that are called cross at every evaluation.
//!
//! | file | content |
//! |---|---|
//! | `fmu.rs` | FMUs, whose code runs in such a process |
//! | `message.rs` | what is asked and answered |
//! | `process.rs` | a recorder seen from the host |
//! | `recorder.rs` | the program as a recorder |
//! | `shut_in.rs` | what a recorder may do |

mod fmu;
mod message;
mod process;
mod recorder;
mod shut_in;

use std::borrow::Cow;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use element_api::abi::OpenError;
use element_api::descriptor::Descriptor;
use element_api::params::Table;
use element_api::recording::{Limits, Recording};
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

use crate::kept::{Kept, OPENED};
use crate::search::{is_guest, own_program};
pub(super) use fmu::fmu;
use message::{Opening, Request};
use odyn_diagnostics::{Code, codes};
pub use process::farewell;
use process::{Gone, Process};
pub use recorder::record_if_asked;
use serde::de::DeserializeOwned;

/// A call that takes longer is ended with its process.
const LIMIT: Duration = Duration::from_secs(60);

/// The program that is started as a recorder.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// From now on, libraries that are not trusted are loaded behind glass by all catalogs of this process. For programs that call
/// [`record_if_asked`] first of all: they start themselves, or the one that [`belongs_to`](crate::belongs_to) names. Trusted are libraries beside the program, and those that
/// [`Request`](crate::Request) says.
pub fn put_up_glass() {
    // The file may be replaced while the program runs.
    let own = match cfg!(target_os = "linux") && !is_guest() {
        true => Ok("/proc/self/exe".into()),
        false => own_program(),
    };
    if let Ok(program) = own {
        let _ = PROGRAM.set(program);
    }
}

/// What this system cannot keep a recorder from, in words; empty where nothing is missing.
pub(super) fn holes() -> &'static str {
    shut_in::missing()
}

/// The program that may be started as a recorder; `None`: there is no glass.
pub(super) fn program() -> Option<&'static Path> {
    PROGRAM.get().map(PathBuf::as_path)
}

/// Whether there is glass.
pub(super) fn is_up() -> bool {
    PROGRAM.get().is_some()
}

/// The code of what became of a process, from its sentence.
pub(super) fn code(message: &str) -> Option<Code> {
    let begins = |with: &str| message.starts_with(with);
    if [process::CRASHED, process::EXITED, process::REACHED].into_iter().any(begins) {
        return Some(codes::PLUGIN_CRASHED);
    }
    begins(process::LATE).then_some(codes::PLUGIN_HANGS)
}

/// A library behind glass. Its process is started when it is needed, and again after it has ended.
pub(super) struct Glass {
    /// The file of the library, or the folder of an FMU.
    copy: PathBuf,
    is_fmu: bool,
    /// For what it prints.
    package: String,
    process: Mutex<Option<Arc<Process>>>,
    kept: Kept,
}

impl Glass {
    /// Loads the library in the file `copy`. Whether it left the floating-point control register as it was comes with it.
    pub(super) fn enter(copy: &Path, package: &str) -> (Result<Arc<Self>, OpenError>, bool) {
        let kept = Kept::of(copy, program().unwrap_or(Path::new("")));
        let glass = Self { copy: copy.into(), is_fmu: false, package: package.into(), process: Mutex::new(None), kept };
        if let Some(kept) = glass.kept.read(OPENED, "") {
            return (Ok(Arc::new(glass)), kept);
        }
        match glass.start() {
            Ok((process, kept)) => {
                glass.kept.write(OPENED, "", &kept);
                glass.process.lock().unwrap_or_else(PoisonError::into_inner).replace(Arc::new(process));
                (Ok(Arc::new(glass)), kept)
            }
            Err(error) => (Err(error), true),
        }
    }

    fn start(&self) -> Result<(Process, bool), OpenError> {
        let mut command = Command::new(program().unwrap_or(Path::new("")));
        let process = Process::start(command.arg(recorder::WORD), &self.package, LIMIT);
        let process = process.map_err(|error| {
            OpenError::Root(format!("no process for it can be started: {error}; --in-process loads it into this one"))
        })?;
        let copy = self.copy.clone();
        let request = if self.is_fmu { Request::OpenFmu { folder: copy } } else { Request::Open { copy } };
        let opening: Opening = process.ask(&request).map_err(|gone| OpenError::Root(gone.into()))?;
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
        let descriptor = match self.kept.descriptor(number) {
            Some(known) => known,
            None => {
                let text = self.process()?.ask::<Result<String, String>>(&Request::Describe { class: number })??;
                let descriptor: Descriptor =
                    toml::from_str(&text).map_err(|error| format!("a descriptor can't be read: {error}"))?;
                descriptor.check()?;
                self.kept.keep_descriptor(number, &descriptor);
                descriptor
            }
        };
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
        Box::new(self.new_glass_set())
    }
}

impl GlassClass {
    fn new_glass_set(&self) -> GlassSet {
        GlassSet {
            glass: Arc::clone(&self.glass),
            class: self.number,
            opaque: self.descriptor.opaque,
            limits: self.descriptor.limits(),
            params: Vec::new(),
            made: OnceCell::new(),
        }
    }
}

/// Instances whose equations are known are made in the process only when something else is asked of them.
struct GlassSet {
    glass: Arc<Glass>,
    class: u32,
    opaque: bool,
    limits: Limits,
    /// The parameters of the instances, as TOML.
    params: Vec<String>,
    /// The process and the set's number there, or why there is none.
    made: OnceCell<Result<(Arc<Process>, u32), Gone>>,
}

impl GlassSet {
    /// The process and the number of the set there, with all instances so far.
    fn made(&self) -> Result<(&Process, u32), Gone> {
        let made = self.made.get_or_init(|| {
            let process = self.glass.process()?;
            let set = process.ask::<Result<u32, String>>(&Request::NewSet { class: self.class })??;
            for params in &self.params {
                let request = Request::Add { set, params: Cow::Borrowed(params) };
                if process.ask::<Result<u32, CreateError>>(&request)?.is_err() {
                    return Err("it refuses parameters that it took before".to_string().into());
                }
            }
            Ok((process, set))
        });
        made.as_ref().map(|(process, set)| (&**process, *set)).map_err(Gone::clone)
    }

    /// Asks for an instance.
    fn ask<'r, T: DeserializeOwned>(
        &self,
        instance: usize,
        request: impl FnOnce(u32) -> Request<'r>,
    ) -> Result<T, Fault> {
        let count = self.params.len();
        if instance >= count {
            let message = format!("instance {instance} does not exist ({count} do)");
            return Err(Fault { instance, message });
        }
        let asked = self.made().and_then(|(process, set)| process.ask::<Result<T, Fault>>(&request(set)));
        match asked {
            Ok(answer) => answer.map_err(|fault| Fault { instance: fault.instance.min(count - 1), ..fault }),
            Err(Gone { message, instance: at }) => {
                Err(Fault { instance: at.unwrap_or(instance).min(count - 1), message })
            }
        }
    }
}

impl Drop for GlassSet {
    fn drop(&mut self) {
        if let Some(Ok((process, set))) = self.made.get()
            && !process.is_gone()
        {
            // Who breaks now is named when he is needed again.
            let _ = process.ask::<()>(&Request::DropSet { set: *set });
        }
    }
}

impl ElementSet for GlassSet {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let text = toml::to_string(params)
            .map_err(|error| CreateError::Fault(format!("the parameters can't be written as TOML: {error}")))?;
        let count = self.params.len();
        let kept = || self.glass.kept.recording(self.class, &text, &self.limits).is_some();
        let known = !self.opaque && self.made.get().is_none() && kept();
        if !known {
            let asked = self.made().and_then(|(process, set)| {
                process.ask::<Result<u32, CreateError>>(&Request::Add { set, params: Cow::Borrowed(&text) })
            });
            let number = asked.map_err(|gone| CreateError::Fault(gone.into()))?? as usize;
            if number != count {
                return Err(CreateError::Fault(format!("instance {count} was numbered {number}")));
            }
        }
        self.params.push(text);
        Ok(count)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let params = self.params.get(instance).map_or("", String::as_str);
        if !self.opaque
            && let Some(known) = self.glass.kept.recording(self.class, params, &self.limits)
        {
            return Ok(Recording::clone(&known));
        }
        let recording: Recording = self.ask(instance, |set| Request::Record { set, instance: instance as u32 })?;
        recording.check(&self.limits).map_err(|message| Fault { instance, message })?;
        if !self.opaque {
            self.glass.kept.keep(self.class, params, &Arc::new(recording.clone()));
        }
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
