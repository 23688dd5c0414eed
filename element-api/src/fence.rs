//! The fence around an author's code: a panic becomes a message with its place, and prints nothing.
//!
//! A library loaded at run time has its own standard library, hence its own panic hook; one that is linked in shares the
//! host's. Both are served by a hook that looks whether the thread is inside a fence and otherwise passes on to the hook
//! that was there before.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::descriptor::Descriptor;
use crate::params::Table;
use crate::recording::Recording;
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
    static CAUGHT: RefCell<Option<String>> = const { RefCell::new(None) };
    static INSTANCE: Cell<usize> = const { Cell::new(0) };
    static PROGRESS: Cell<Option<&'static AtomicU32>> = const { Cell::new(None) };
}

/// What the message of a panic begins with. The binary interface carries faults as text, so this is how one is known behind it.
pub(crate) const PANICKED: &str = "panicked";

/// Whether the message of a fault is that of a panic.
#[must_use]
pub fn is_panic(message: &str) -> bool {
    message.starts_with(PANICKED)
}

/// Runs `body`; a panic inside it becomes `Err` with its message and place.
///
/// The first call in a process puts the hook described above in place.
///
/// # Errors
/// The panic's message and place in the source.
pub fn fenced<T>(body: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let outer = take_hook();
        set_hook(Box::new(move |info| if DEPTH.with(Cell::get) > 0 { keep(info) } else { outer(info) }));
    });
    DEPTH.with(|depth| depth.set(depth.get() + 1));
    let result = catch_unwind(AssertUnwindSafe(body));
    DEPTH.with(|depth| depth.set(depth.get() - 1));
    result.map_err(|payload| {
        // Dropping a payload may run any code of the author, which may panic again.
        std::mem::forget(payload);
        let kept = CAUGHT.with(|caught| caught.try_borrow_mut().ok().and_then(|mut slot| slot.take()));
        kept.unwrap_or_else(|| PANICKED.into())
    })
}

/// Called by the hook while the panicking thread is inside a fence.
fn keep(info: &PanicHookInfo<'_>) {
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    let message = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message");
    let place = info.location().map_or_else(String::new, |at| format!(" at {at}"));
    CAUGHT.with(|caught| {
        if let Ok(mut slot) = caught.try_borrow_mut() {
            *slot = Some(format!("{PANICKED}: {message}{place}"));
        }
    });
}

/// `[hot]` Notes which instance the thread works on, for faults and for a watchdog.
pub(crate) fn enter(instance: usize) {
    INSTANCE.with(|current| current.set(instance));
    if let Some(progress) = PROGRESS.with(Cell::get) {
        progress.store(instance as u32, Ordering::Relaxed);
    }
}

/// The instance of the last [`enter`] of this thread.
pub(crate) fn instance() -> usize {
    INSTANCE.with(Cell::get)
}

/// Also writes the instances of later [`enter`]s of this thread to `progress`; gives back what was there before.
#[cfg(feature = "abi")]
pub(crate) fn watch(progress: Option<&'static AtomicU32>) -> Option<&'static AtomicU32> {
    PROGRESS.with(|slot| slot.replace(progress))
}

/// The same class with every call into it fenced. For classes that are linked in; loaded ones are fenced on their side.
#[must_use]
pub fn class(inner: Box<dyn ElementClass>) -> Box<dyn ElementClass> {
    Box::new(FencedClass(inner))
}

struct FencedClass(Box<dyn ElementClass>);

impl ElementClass for FencedClass {
    fn descriptor(&self) -> &Descriptor {
        self.0.descriptor()
    }
    fn new_set(&self) -> Box<dyn ElementSet> {
        Box::new(FencedSet(self.0.new_set()))
    }
}

struct FencedSet(Box<dyn ElementSet>);

/// A fenced call about one instance.
fn about<T>(instance: usize, body: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    fenced(body).unwrap_or_else(|message| Err(Fault { instance, message }))
}

impl ElementSet for FencedSet {
    fn announce(&mut self, name: &str) {
        self.0.announce(name);
    }
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        fenced(|| self.0.add(params)).unwrap_or_else(|message| Err(CreateError::Fault(message)))
    }
    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        about(instance, || self.0.record(instance))
    }
    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        fenced(|| self.0.evaluate(batch, out))
            .unwrap_or_else(|message| Err(Fault { instance: self::instance(), message }))
    }
    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        about(instance, || self.0.accept(instance, inputs))
    }
    fn communicates(&self) -> bool {
        self.0.communicates()
    }
    fn communicate(&mut self, instance: usize, t: f64, begins: bool, memory: &mut [f64]) -> Result<(), Fault> {
        about(instance, || self.0.communicate(instance, t, begins, memory))
    }
    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        about(instance, || self.0.save(instance))
    }
    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        about(instance, || self.0.load(instance, memory))
    }
}

#[cfg(test)]
mod tests;
