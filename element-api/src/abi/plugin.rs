//! The library's side: each class and set behind the tables of [`super::v1`], every call fenced.

use std::sync::atomic::AtomicU32;

use abi_stable::library::{__call_root_module_loader, CheckTypeLayout, LibHeader, RootModuleResult};
use abi_stable::prefix_type::PrefixTypeTrait;
use abi_stable::sabi_trait::TD_Opaque;
use abi_stable::std_types::{RNone, ROption, RResult, RSlice, RSliceMut, RSome, RStr, RString, RVec};

use super::v1::{
    BatchV1, ClassBoxV1, ClassV1, ClassV1_TO, ErrorV1, FAULT, JACOBIAN, OpV1, OutputV1, PARAMETER, PluginV1,
    PluginV1_Ref, RecordingV1, SECOND, SetBoxV1, SetV1, SetV1_TO, TableV1,
};
use crate::fence::{self, fenced};
use crate::manifest::{CONVENTIONS, Library};
use crate::recording::Recording;
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Fault, Wanted};

/// A crate that exports elements; implemented by [`export_plugin!`](crate::export_plugin).
pub trait Exported {
    /// Its elements.
    fn library() -> Library;
}

/// The header to export under the crate's symbol.
#[must_use]
pub const fn header<E: Exported>() -> LibHeader {
    // SAFETY: `root` gives a `PluginV1_Ref` or an error, as its type argument to the loader ensures.
    unsafe { LibHeader::from_constructor::<PluginV1_Ref>(root::<E>, CheckTypeLayout::Yes) }
}

extern "C" fn root<E: Exported>() -> RootModuleResult {
    __call_root_module_loader(|| -> PluginV1_Ref {
        PluginV1 { conventions: CONVENTIONS, classes: classes::<E>, extension: no_extension }.leak_into_prefix()
    })
}

extern "C" fn no_extension(_: RStr<'_>) -> *const () {
    std::ptr::null()
}

extern "C" fn classes<E: Exported>() -> RResult<RVec<ClassBoxV1>, ErrorV1> {
    give(0, || {
        let wrap = |class| ClassV1_TO::from_value(PluginClass(class), TD_Opaque);
        Ok(E::library().classes.into_iter().map(wrap).collect())
    })
}

struct PluginClass(Box<dyn ElementClass>);

impl ClassV1 for PluginClass {
    fn descriptor(&self) -> RResult<RString, ErrorV1> {
        give(0, || match toml::to_string(self.0.descriptor()) {
            Ok(text) => Ok(text.into()),
            Err(error) => Err(fault(0, format!("the descriptor can't be written as TOML: {error}"))),
        })
    }

    fn new_set(&self) -> RResult<SetBoxV1, ErrorV1> {
        give(0, || Ok(SetV1_TO::from_value(PluginSet(Some(self.0.new_set())), TD_Opaque)))
    }
}

/// Always `Some`, except while it is dropped.
struct PluginSet(Option<Box<dyn ElementSet>>);

impl PluginSet {
    fn set(&self) -> Result<&dyn ElementSet, ErrorV1> {
        self.0.as_deref().ok_or_else(|| fault(0, "the set is gone".into()))
    }
    fn set_mut(&mut self) -> Result<&mut Box<dyn ElementSet>, ErrorV1> {
        self.0.as_mut().ok_or_else(|| fault(0, "the set is gone".into()))
    }
}

impl Drop for PluginSet {
    fn drop(&mut self) {
        let set = self.0.take();
        // An element whose destructor panics has nobody to tell; what is left of it is leaked.
        let _ = fenced(|| drop(set));
    }
}

impl SetV1 for PluginSet {
    fn add(&mut self, params: RStr<'_>) -> RResult<u32, ErrorV1> {
        give(0, || {
            let table = params
                .parse::<toml::Table>()
                .map_err(|error| fault(0, format!("the parameters can't be read as TOML: {error}")))?;
            match self.set_mut()?.add(&table) {
                Ok(instance) => Ok(instance as u32),
                Err(CreateError::Fault(message)) => Err(fault(0, message)),
                Err(CreateError::Parameter(error)) => Err(ErrorV1 {
                    kind: PARAMETER,
                    instance: 0,
                    path: error.path.into(),
                    message: error.message.into(),
                }),
            }
        })
    }

    fn record(&self, instance: u32) -> RResult<RecordingV1, ErrorV1> {
        give(instance, || Ok(encode(self.set()?.record(instance as usize).map_err(error)?)))
    }

    fn evaluate(&self, batch: BatchV1<'_>, mut out: RSliceMut<'_, f64>) -> ROption<ErrorV1> {
        let wanted = Wanted { jacobian: batch.wanted & JACOBIAN != 0, second: batch.wanted & SECOND != 0 };
        // SAFETY: null, or the address of an atomic number of the host, which outlives this call. The longer lifetime
        // is not used: the fence forgets the reference before this function returns.
        let progress = (!batch.progress.is_null()).then(|| unsafe { AtomicU32::from_ptr(batch.progress) });
        let before = fence::watch(progress);
        fence::enter(0);
        let done = fenced(|| {
            let batch = Batch { instances: batch.instances.as_slice(), inputs: batch.inputs.as_slice(), wanted };
            self.set()?.evaluate(&batch, out.as_mut_slice()).map_err(error)
        });
        fence::watch(before);
        match done {
            Ok(Ok(())) => RNone,
            Ok(Err(error)) => RSome(error),
            Err(message) => RSome(fault(fence::instance() as u32, message)),
        }
    }

    fn accept(&mut self, instance: u32, inputs: RSlice<'_, f64>) -> ROption<ErrorV1> {
        give(instance, || self.set_mut()?.accept(instance as usize, inputs.as_slice()).map_err(error)).err()
    }

    fn save(&self, instance: u32) -> RResult<RVec<u8>, ErrorV1> {
        give(instance, || Ok(self.set()?.save(instance as usize).map_err(error)?.into()))
    }

    fn load(&mut self, instance: u32, memory: RSlice<'_, u8>) -> ROption<ErrorV1> {
        give(instance, || self.set_mut()?.load(instance as usize, memory.as_slice()).map_err(error)).err()
    }
}

/// Runs `body` inside a fence; a panic becomes a fault of `instance`.
fn give<T>(instance: u32, body: impl FnOnce() -> Result<T, ErrorV1>) -> RResult<T, ErrorV1> {
    fenced(body).unwrap_or_else(|message| Err(fault(instance, message))).into()
}

fn fault(instance: u32, message: String) -> ErrorV1 {
    ErrorV1 { kind: FAULT, instance, path: RString::new(), message: message.into() }
}

fn error(error: Fault) -> ErrorV1 {
    fault(error.instance as u32, error.message)
}

fn encode(recording: Recording) -> RecordingV1 {
    RecordingV1 {
        ops: recording.ops.iter().map(|op| OpV1 { code: op.code, args: op.args }).collect(),
        constants: recording.constants.into(),
        tables: recording
            .tables
            .into_iter()
            .map(|table| TableV1 {
                breaks: table.breaks.into(),
                pieces: table.pieces.into_iter().flatten().collect(),
                outside: table.outside.encode(),
            })
            .collect(),
        outputs: recording
            .outputs
            .iter()
            .map(|output| {
                let (role, index) = output.role.encode();
                OutputV1 { role, index, node: output.node }
            })
            .collect(),
        initial_states: recording.initial_states.into(),
        initial_discrete: recording.initial_discrete.into(),
    }
}
