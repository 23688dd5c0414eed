//! Ctrl-C, and being asked to end, as by the end of a job's time (SIGTERM).

// A handler of a signal can't be set safely; each use says why it holds.
#![cfg_attr(unix, allow(unsafe_code))]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that Ctrl-C raises, which ends a run after its step; a second Ctrl-C ends the program at once.
pub(super) fn stop_on_interrupt() -> Arc<AtomicBool> {
    on_interrupt("interrupted: ending after this step; once more to end at once")
}

/// The same with other words for the user.
pub(super) fn on_interrupt(words: &'static str) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&stop);
    let handler = move || {
        if raised.swap(true, Ordering::Relaxed) {
            super::end(super::exit::INTERRUPTED);
        }
        eprintln!("{words}");
    };
    // Without a handler Ctrl-C ends the program; results up to there are whole rows all the same.
    if let Err(error) = ctrlc::set_handler(handler) {
        eprintln!("note: Ctrl-C will end the program at once: {error}");
    }
    #[cfg(unix)]
    on_termination(Arc::clone(&stop));
    stop
}

/// Raises the flag on SIGTERM as well, unless whoever started the program chose otherwise; a second one ends the program at once.
#[cfg(unix)]
fn on_termination(stop: Arc<AtomicBool>) {
    use std::ffi::c_int;
    use std::mem::MaybeUninit;
    use std::sync::OnceLock;

    static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();

    extern "C" fn asked(_: c_int) {
        // What is set before the handler is only read.
        if STOP.get().is_some_and(|stop| stop.swap(true, Ordering::Relaxed)) {
            // SAFETY: may be called in a handler; it does not return.
            unsafe { libc::_exit(super::exit::INTERRUPTED.into()) };
        }
    }

    if STOP.set(stop).is_err() {
        return;
    }
    // SAFETY: a `sigaction` of zeros is one without flags and with an empty mask.
    let [mut before, mut action]: [libc::sigaction; 2] = unsafe { MaybeUninit::zeroed().assume_init() };
    // SAFETY: asks only; the last pointer is to memory for an answer.
    if unsafe { libc::sigaction(libc::SIGTERM, std::ptr::null(), &mut before) } != 0
        || before.sa_sigaction != libc::SIG_DFL
    {
        return;
    }
    action.sa_sigaction = asked as extern "C" fn(c_int) as usize;
    action.sa_flags = libc::SA_RESTART;
    // SAFETY: the handler has the form of one without SA_SIGINFO, and does only what a handler may do.
    unsafe { libc::sigaction(libc::SIGTERM, &action, std::ptr::null_mut()) };
}
