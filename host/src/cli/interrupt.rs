//! Ctrl-C.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that Ctrl-C raises, which ends a run after its step; a second Ctrl-C ends the program at once.
pub(super) fn stop_on_interrupt() -> Arc<AtomicBool> {
    on_interrupt("interrupted: ending after this step; once more to end at once\n")
}

/// The same with another line for the user.
pub(super) fn on_interrupt(words: &'static str) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    // Without a handler Ctrl-C ends the program; results up to there are whole rows all the same.
    if let Err(error) = handle(Interrupt { stop: Arc::clone(&stop), words }) {
        eprintln!("note: Ctrl-C will end the program at once: {error}");
    }
    stop
}

/// What Ctrl-C does.
struct Interrupt {
    stop: Arc<AtomicBool>,
    words: &'static str,
}

#[cfg(target_os = "linux")]
use linux::handle;

/// By a handler of the signal, since a thread that waits for it takes longer to start than a twentieth of a short run.
#[cfg(target_os = "linux")]
mod linux {
    // Signals can't be handled safely; each use says why it holds.
    #![allow(unsafe_code)]

    use std::ffi::c_int;
    use std::mem::MaybeUninit;
    use std::ptr;
    use std::sync::OnceLock;

    use super::{Interrupt, Ordering, io};

    static INTERRUPT: OnceLock<Interrupt> = OnceLock::new();

    /// From now on, for the whole program.
    pub(super) fn handle(interrupt: Interrupt) -> io::Result<()> {
        INTERRUPT.set(interrupt).map_err(|_| io::Error::other("it is handled already"))?;
        // SAFETY: a `sigaction` of zeros is one without flags and with an empty mask.
        let mut action: libc::sigaction = unsafe { MaybeUninit::zeroed().assume_init() };
        let handler: extern "C" fn(c_int) = raised;
        action.sa_sigaction = handler as usize;
        action.sa_flags = libc::SA_RESTART | libc::SA_ONSTACK;
        // SAFETY: the handler has the form that is asked for without SA_SIGINFO and does only what a handler may do.
        match unsafe { libc::sigaction(libc::SIGINT, &action, ptr::null_mut()) } {
            0 => Ok(()),
            _ => Err(io::Error::last_os_error()),
        }
    }

    /// In the middle of anything: reads and writes an atomic, writes bytes, and leaves `errno` as it was.
    extern "C" fn raised(_: c_int) {
        let Some(Interrupt { stop, words }) = INTERRUPT.get() else { return };
        if stop.swap(true, Ordering::Relaxed) {
            // SAFETY: ends the process, whatever it was doing.
            unsafe { libc::_exit(c_int::from(crate::cli::exit::INTERRUPTED)) };
        }
        // SAFETY: the number belongs to this thread; pointer and length are those of a slice.
        unsafe {
            let before = *libc::__errno_location();
            let _ = libc::write(libc::STDERR_FILENO, words.as_ptr().cast(), words.len());
            *libc::__errno_location() = before;
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn handle(interrupt: Interrupt) -> io::Result<()> {
    let handler = move || {
        if interrupt.stop.swap(true, Ordering::Relaxed) {
            super::end(super::exit::INTERRUPTED);
        }
        eprint!("{}", interrupt.words);
    };
    ctrlc::set_handler(handler).map_err(io::Error::other)
}
