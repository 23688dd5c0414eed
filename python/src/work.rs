//! Work beside the interpreter: its lock is free meanwhile, and its main thread looks at Ctrl-C and at the progress.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;

/// How often signals and progress are looked at.
pub(crate) const GLANCE: Duration = Duration::from_millis(40);
/// Stack of the thread that works, as a main thread has it.
const STACK: usize = 8 << 20;

/// What ends the thread of work that is interrupted.
struct Interrupted;

/// What work is given: a flag that ends it early, and where it says how far it is.
pub(crate) struct Desk {
    /// Raised by Ctrl-C, and by a listener that fails.
    pub(crate) stop: Arc<AtomicBool>,
    share: Arc<AtomicU64>,
}

impl Desk {
    /// Takes the share of the work that is done, 0 to 1.
    pub(crate) fn listener(&self) -> impl Fn(f64) + Send + Sync + use<> {
        let share = Arc::clone(&self.share);
        move |done: f64| share.store(done.to_bits(), Ordering::Relaxed)
    }
}

impl Desk {
    /// The same for work that looks at no flag, which it ends: once the flag is raised, the next report does not return but
    /// unwinds the thread up to [`beside`], as panics do, without the words of one. Reports come from the thread of the work, between
    /// its steps, so nothing is left half done but what the work itself owns.
    pub(crate) fn interrupting(&self) -> impl Fn(f64) + Send + Sync + use<> {
        let (listen, stop) = (self.listener(), Arc::clone(&self.stop));
        move |done: f64| {
            listen(done);
            if stop.load(Ordering::Relaxed) {
                std::panic::resume_unwind(Box::new(Interrupted));
            }
        }
    }
}

/// Does `work` on a thread of its own. `progress` is called now and then with the share done. Ctrl-C raises the flag; what work that
/// `keeps` its results then gives is given. Where it does not, and where Ctrl-C is pressed again, `KeyboardInterrupt` follows when the
/// work has ended.
///
/// # Errors
/// `KeyboardInterrupt`, what `progress` raises, a thread that cannot be had.
pub(crate) fn beside<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    keeps: bool,
    work: impl FnOnce(&Desk) -> T + Send,
) -> PyResult<T> {
    let desk = Desk { stop: Arc::default(), share: Arc::default() };
    let mut raised = None;
    let raise = &mut raised;
    let result = py.detach(|| {
        thread::scope(|scope| {
            let (ended, ends) = channel::<()>();
            let desk = &desk;
            let worker = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || {
                // Whatever becomes of the work, the other end hears of it.
                let _ended = ended;
                work(desk)
            });
            let worker = worker.map_err(|error| PyRuntimeError::new_err(format!("no thread can be had: {error}")))?;
            while ends.recv_timeout(GLANCE) == Err(RecvTimeoutError::Timeout) {
                if raise.is_none() {
                    *raise = glance(desk, progress, keeps).err();
                }
            }
            worker.join().map_err(|payload| {
                if payload.is::<Interrupted>() {
                    return PyKeyboardInterrupt::new_err(());
                }
                PyRuntimeError::new_err("the solver panicked; this is a defect of O-DYN")
            })
        })
    });
    match raised {
        Some(error) => Err(error),
        None => result,
    }
}

/// Looks at signals, and reports the progress. What `keeps` its results ends early at the first Ctrl-C, without an error.
fn glance(desk: &Desk, progress: Option<&Py<PyAny>>, keeps: bool) -> PyResult<()> {
    Python::attach(|py| {
        let share = f64::from_bits(desk.share.load(Ordering::Relaxed));
        let told = || progress.map_or(Ok(()), |progress| progress.call1(py, (share,)).map(|_| ()));
        // Ctrl-C may also be seen by what is called.
        let Err(error) = py.check_signals().and_then(|()| told()) else { return Ok(()) };
        let before = desk.stop.swap(true, Ordering::Relaxed);
        let ends_early = keeps && !before && error.is_instance_of::<PyKeyboardInterrupt>(py);
        if ends_early { Ok(()) } else { Err(error) }
    })
}
