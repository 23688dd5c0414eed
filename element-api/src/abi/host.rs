//! The host's side: a library's root becomes classes that look as if they were linked in. A library is a stranger, so
//! everything it says is checked before it is used.

use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use abi_stable::StableAbi;
use abi_stable::library::{AbiHeader, AbiHeaderRef, LibraryError, RootModule, RootModuleError};
use abi_stable::std_types::{ROption, RResult};

use super::layout::explain_mismatch;
use super::v1::{
    BatchV1, ClassBoxV1, ErrorV1, JACOBIAN, PARAMETER, PluginV1_Ref, RecordingV1, SECOND, SetBoxV1, TableV1,
};
use crate::descriptor::Descriptor;
use crate::manifest::CONVENTIONS;
use crate::params::{ParamError, Table as Params};
use crate::recording::{Limits, Output, RawOp, Recording, Role};
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Fault};
use crate::table::{Outside, Table};

/// Why the root of a library can't be used.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum OpenError {
    /// The symbol is not the header of a library, or of one made with another `abi_stable`.
    Header,
    /// The library was built with another major version of `element-api`.
    Version {
        /// The host's version.
        host: String,
        /// The library's version.
        library: String,
    },
    /// A type has another layout; at most two lines that say which and how.
    Layout(String),
    /// The library has other conventions.
    Conventions(u32),
    /// The library failed while it gave its elements, or gave something impossible.
    Root(String),
}

impl std::fmt::Display for OpenError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Header => f.write_str("its entry is not the header of an O-DYN library"),
            Self::Version { host, library } => {
                write!(f, "it was built with element-api {library}, this host has {host}")
            }
            Self::Layout(text) => write!(f, "it does not fit this host:\n{text}"),
            Self::Conventions(found) => {
                write!(f, "it follows conventions number {found}, this host number {CONVENTIONS}")
            }
            Self::Root(message) => write!(f, "it failed while it gave its elements: {message}"),
        }
    }
}

impl std::error::Error for OpenError {}

/// The classes of a library, given the address of its entry symbol.
///
/// Version and layout are compared first; the library's own code runs only if they fit.
///
/// # Errors
/// See [`OpenError`].
///
/// # Safety
/// `entry` is null or the address of the symbol that [`export_plugin!`](crate::export_plugin) exports, in a library that
/// is never unloaded.
pub unsafe fn open(entry: *const ()) -> Result<Vec<Box<dyn ElementClass>>, OpenError> {
    // SAFETY: as the caller's.
    unsafe { open_unread(entry) }?.iter().map(|class| class.read().map_err(OpenError::Root)).collect()
}

/// A class of a library, of which nothing was asked yet.
pub struct UnreadClass(Arc<ClassBoxV1>);

impl UnreadClass {
    /// Asks for its descriptor, judges that, and gives the class. A few tens of microseconds, most of which go into text.
    ///
    /// # Errors
    /// Why the library failed, or what is impossible about what it gave.
    pub fn read(&self) -> Result<Box<dyn ElementClass>, String> {
        load_class(&self.0)
    }
}

/// As [`open`], but no class is asked for its descriptor: a scene needs few of a library's classes. They come in the order of
/// the library's manifest.
///
/// # Errors
/// See [`OpenError`].
///
/// # Safety
/// As for [`open`].
pub unsafe fn open_unread(entry: *const ()) -> Result<Vec<UnreadClass>, OpenError> {
    const _: () = assert!(size_of::<AbiHeaderRef>() == size_of::<*const ()>());
    if entry.is_null() {
        return Err(OpenError::Header);
    }
    // SAFETY: `AbiHeaderRef` is transparent over a pointer to an `AbiHeader`, which the exported header begins with.
    let found = unsafe { std::mem::transmute::<*const (), AbiHeaderRef>(entry.cast::<AbiHeader>().cast()) };
    let header = found.upgrade().map_err(|_| OpenError::Header)?;
    let root = header.init_root_module::<PluginV1_Ref>().map_err(|error| match error {
        LibraryError::AbiInstability(_) => {
            let found = header.layout().map(|layout| explain_mismatch(PluginV1_Ref::LAYOUT, layout));
            OpenError::Layout(found.unwrap_or_default())
        }
        LibraryError::IncompatibleVersionNumber { expected_version, actual_version, .. } => {
            OpenError::Version { host: expected_version.to_string(), library: actual_version.to_string() }
        }
        LibraryError::RootModule { err: RootModuleError::Unwound, .. } => {
            OpenError::Root(crate::fence::PANICKED.into())
        }
        LibraryError::ParseVersionError(_) => OpenError::Version {
            host: PluginV1_Ref::VERSION_STRINGS.to_string(),
            library: header.version_strings().to_string(),
        },
        _ => OpenError::Header,
    })?;
    if root.conventions() != CONVENTIONS {
        return Err(OpenError::Conventions(root.conventions()));
    }
    let classes = match (root.classes())() {
        RResult::ROk(classes) => classes,
        RResult::RErr(error) => return Err(OpenError::Root(error.message.into())),
    };
    Ok(classes.into_iter().map(|class| UnreadClass(Arc::new(class))).collect())
}

/// A class that came over the interface as one of the host's.
fn load_class(class: &Arc<ClassBoxV1>) -> Result<Box<dyn ElementClass>, String> {
    let text = match class.descriptor() {
        RResult::ROk(text) => text,
        RResult::RErr(error) => return Err(error.message.into()),
    };
    let descriptor: Descriptor = toml::from_str(&text).map_err(|e| format!("a descriptor can't be read: {e}"))?;
    descriptor.check()?;
    Ok(Box::new(LoadedClass { descriptor, class: Arc::clone(class) }))
}

struct LoadedClass {
    descriptor: Descriptor,
    class: Arc<ClassBoxV1>,
}

impl ElementClass for LoadedClass {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        let set = match self.class.new_set() {
            RResult::ROk(set) => Ok(set),
            RResult::RErr(error) => Err(error.message.into()),
        };
        Box::new(LoadedSet { set, limits: self.descriptor.limits(), count: 0, progress: Arc::default() })
    }
}

struct LoadedSet {
    /// Or why the library gave none.
    set: Result<SetBoxV1, String>,
    limits: Limits,
    /// Instances added so far.
    count: usize,
    /// The instance under evaluation, written by the library.
    progress: Arc<AtomicU32>,
}

impl LoadedSet {
    fn set(&self, instance: usize) -> Result<&SetBoxV1, Fault> {
        self.exists(instance)?;
        self.set.as_ref().map_err(|message| Fault { instance, message: message.clone() })
    }
    fn set_mut(&mut self, instance: usize) -> Result<&mut SetBoxV1, Fault> {
        self.exists(instance)?;
        self.set.as_mut().map_err(|message| Fault { instance, message: message.clone() })
    }
    fn exists(&self, instance: usize) -> Result<(), Fault> {
        if instance < self.count {
            return Ok(());
        }
        Err(Fault { instance, message: format!("instance {instance} does not exist ({} do)", self.count) })
    }
}

impl ElementSet for LoadedSet {
    fn progress(&self) -> Option<Arc<AtomicU32>> {
        Some(Arc::clone(&self.progress))
    }

    fn add(&mut self, params: &Params) -> Result<usize, CreateError> {
        let set = self.set.as_mut().map_err(|message| CreateError::Fault(message.clone()))?;
        let text = toml::to_string(params)
            .map_err(|error| CreateError::Fault(format!("the parameters can't be written as TOML: {error}")))?;
        let number = match set.add(text.as_str().into()) {
            RResult::ROk(number) => number as usize,
            RResult::RErr(ErrorV1 { kind: PARAMETER, path, message, .. }) => {
                return Err(CreateError::Parameter(ParamError { path: path.into(), message: message.into() }));
            }
            RResult::RErr(error) => return Err(CreateError::Fault(error.message.into())),
        };
        if number != self.count {
            return Err(CreateError::Fault(format!("instance {} was numbered {number}", self.count)));
        }
        self.count += 1;
        Ok(number)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let recording = answer(self.set(instance)?.record(instance as u32), instance)?;
        decode(recording, &self.limits).map_err(|message| Fault { instance, message })
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        if let Some(unknown) = batch.instances.iter().find(|k| **k as usize >= self.count) {
            return self.exists(*unknown as usize);
        }
        let Some(first) = batch.instances.first() else { return Ok(()) };
        let wanted = if batch.wanted.jacobian { JACOBIAN } else { 0 } + if batch.wanted.second { SECOND } else { 0 };
        let crossing = BatchV1 {
            instances: batch.instances.into(),
            inputs: batch.inputs.into(),
            wanted,
            progress: self.progress.as_ptr(),
        };
        match self.set(*first as usize)?.evaluate(crossing, out.into()) {
            ROption::RNone => Ok(()),
            ROption::RSome(error) => Err(Fault { instance: error.instance as usize, message: error.message.into() }),
        }
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        done(self.set_mut(instance)?.accept(instance as u32, inputs.into()), instance)
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        Ok(answer(self.set(instance)?.save(instance as u32), instance)?.into())
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        done(self.set_mut(instance)?.load(instance as u32, memory.into()), instance)
    }
}

fn answer<T>(result: RResult<T, ErrorV1>, instance: usize) -> Result<T, Fault> {
    result.into_result().map_err(|error| Fault { instance, message: error.message.into() })
}

fn done(result: ROption<ErrorV1>, instance: usize) -> Result<(), Fault> {
    match result {
        ROption::RNone => Ok(()),
        ROption::RSome(error) => Err(Fault { instance, message: error.message.into() }),
    }
}

/// Whatever a library sends becomes either a recording that [`Recording::check`] accepts or a sentence.
///
/// # Errors
/// What is wrong, in words.
pub fn decode(raw: RecordingV1, limits: &Limits) -> Result<Recording, String> {
    let outputs = raw.outputs.iter().map(|output| {
        let role = Role::decode(output.role, output.index)
            .ok_or_else(|| format!("a result has the unknown meaning {}", output.role))?;
        Ok(Output { role, node: output.node })
    });
    let recording = Recording {
        outputs: outputs.collect::<Result<_, String>>()?,
        ops: raw.ops.iter().map(|op| RawOp { code: op.code, args: op.args }).collect(),
        tables: raw.tables.into_iter().map(decode_table).collect::<Result<_, _>>()?,
        constants: raw.constants.into(),
        initial_states: raw.initial_states.into(),
        initial_discrete: raw.initial_discrete.into(),
    };
    recording.check(limits)?;
    Ok(recording)
}

fn decode_table(raw: TableV1) -> Result<Table, String> {
    let (pieces, rest) = raw.pieces.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(format!("a table has {} coefficients, which is not a multiple of 4", raw.pieces.len()));
    }
    let outside =
        Outside::decode(raw.outside).ok_or_else(|| format!("a table has the unknown continuation {}", raw.outside))?;
    Ok(Table { pieces: pieces.to_vec(), breaks: raw.breaks.into(), outside })
}
