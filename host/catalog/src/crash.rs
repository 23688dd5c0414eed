//! The last words of a program that a library breaks: [`tell_crashes`].
//!
//! An invalid access, a stack that overflows or `abort` in foreign code ends the process; nothing can be repaired then. But
//! whose code it was can be reported: each watched call leaves a pointer to its [`Post`] for its thread, and a handler of the
//! signals that end a process reads it.
//!
//! The handler runs in the middle of anything, on the alternate stack that the standard library gives each of its threads. So
//! it does nothing but reading atomic numbers, trying one lock, and writing bytes.

// Signals can't be handled safely; each use says why it holds.
#![allow(unsafe_code)]

use std::cell::Cell;
use std::ffi::{c_int, c_void};
use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Once, OnceLock};

use super::watchdog::Post;
use odyn_diagnostics::{Exit, codes};

/// A signal, and what it says to a user.
struct Signal {
    number: c_int,
    words: &'static str,
    /// What was to be done before, and is done after the last words.
    before: OnceLock<libc::sigaction>,
}

impl Signal {
    const fn new(number: c_int, words: &'static str) -> Self {
        Self { number, words, before: OnceLock::new() }
    }
}

/// What ends a process from inside.
static SIGNALS: [Signal; 5] = [
    Signal::new(libc::SIGSEGV, "SIGSEGV: an invalid access to memory, or recursion without end"),
    Signal::new(libc::SIGBUS, "SIGBUS: an invalid access to memory"),
    Signal::new(libc::SIGILL, "SIGILL: an instruction that this processor does not know"),
    Signal::new(libc::SIGFPE, "SIGFPE: a division of integers by zero, or a floating-point trap that was switched on"),
    Signal::new(libc::SIGABRT, "SIGABRT: it ended itself, or recursion without end"),
];

/// What a signal says to a user.
#[cfg(feature = "glass")]
pub(super) fn words(number: c_int) -> &'static str {
    SIGNALS.iter().find(|signal| signal.number == number).map_or("a signal that it sent itself", |signal| signal.words)
}

thread_local! {
    // Without a destructor and with a constant at the start, so that reading it is nothing but reading memory.
    static HERE: Cell<*const Post> = const { Cell::new(ptr::null()) };
}

/// While it lives, the thread works in a library for this post.
pub(super) struct Here<'a> {
    before: *const Post,
    post: PhantomData<&'a Post>,
}

impl<'a> Here<'a> {
    /// `[hot, no allocation]`
    pub(super) fn enter(post: &'a Post) -> Self {
        Self { before: HERE.replace(post), post: PhantomData }
    }
}

impl Drop for Here<'_> {
    fn drop(&mut self) {
        HERE.set(self.before);
    }
}

/// From now on, a crash of this process (SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT) while a watched call into a library is under
/// way is reported on standard error, with library, element, instance and function. What happens then is what happened before: the
/// process ends by that signal.
///
/// An `exit` during such a call is reported, too, and ends the program with [`Exit::Plugin`], whatever the library asked for;
/// [`ExitGuard`] does so for threads that a library started.
///
/// For programs, which own the signals of their process; a library that uses O-DYN does not call this. A second call changes
/// nothing.
pub fn tell_crashes() {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        // SAFETY: a function without arguments that may be called at any time. Where it can't be registered, `exit` is not reported.
        let _ = unsafe { libc::atexit(at_exit) };
    });
    for signal in &SIGNALS {
        let mut before = MaybeUninit::uninit();
        // SAFETY: asks only; the second pointer is to memory for an answer.
        if unsafe { libc::sigaction(signal.number, ptr::null(), before.as_mut_ptr()) } != 0 {
            continue;
        }
        // SAFETY: the call above wrote it. It is kept before the handler, which reads it, can be called.
        if signal.before.set(unsafe { before.assume_init() }).is_err() {
            continue;
        }
        // SAFETY: a `sigaction` of zeros is one without flags and with an empty mask.
        let mut action: libc::sigaction = unsafe { MaybeUninit::zeroed().assume_init() };
        let handler: extern "C" fn(c_int, *mut libc::siginfo_t, *mut c_void) = last_words;
        action.sa_sigaction = handler as usize;
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        // SAFETY: the handler has the form that SA_SIGINFO asks for and does only what a handler may do.
        unsafe { libc::sigaction(signal.number, &action, ptr::null_mut()) };
    }
}

static GUARDED: AtomicBool = AtomicBool::new(false);

/// While it lives, an `exit` anywhere in the program is taken for a library's, provided that [`tell_crashes`] was called. For
/// programs that end by returning from `main`, where it lives.
#[derive(Debug)]
pub struct ExitGuard(());

impl ExitGuard {
    /// From now on.
    #[must_use]
    pub fn begin() -> Self {
        GUARDED.store(true, Ordering::Release);
        Self(())
    }

    /// Before the program ends itself by `exit`.
    pub fn lift() {
        GUARDED.store(false, Ordering::Release);
    }
}

impl Drop for ExitGuard {
    fn drop(&mut self) {
        Self::lift();
    }
}

/// Called by `exit`, on the thread that calls it. A library that ends the program must not end it as if all were well.
extern "C" fn at_exit() {
    // SAFETY: set by a call that is under way on this very thread and borrows the post.
    match unsafe { HERE.get().as_ref() } {
        Some(post) => tell(post, "ended the program", "by `exit`"),
        None if GUARDED.load(Ordering::Acquire) => {
            begin();
            write(b"a library ended the program by `exit`, from a thread of its own");
            help();
        }
        None => return,
    }
    // SAFETY: ends the process, whatever it was doing.
    unsafe { libc::_exit(Exit::Plugin as c_int) };
}

/// The handler.
extern "C" fn last_words(number: c_int, info: *mut libc::siginfo_t, _: *mut c_void) {
    // An overflow of the stack becomes an `abort` in the standard library's handler: once is enough.
    static BEGUN: AtomicBool = AtomicBool::new(false);
    static TOLD: AtomicBool = AtomicBool::new(false);
    let Some(signal) = SIGNALS.iter().find(|signal| signal.number == number) else { return };
    // SAFETY: set by a call that is under way on this very thread and borrows the post.
    let post = unsafe { HERE.get().as_ref() };
    if let Some(post) = post
        && !BEGUN.swap(true, Ordering::Relaxed)
    {
        tell(post, "crashed", signal.words);
        TOLD.store(true, Ordering::Release);
    } else if BEGUN.load(Ordering::Relaxed) {
        // Another thread crashed at the same time: what it reports is not cut short by the end of this one. A crash of the
        // report itself ends here, too, after the last wait.
        for _ in 0..200 {
            if TOLD.load(Ordering::Acquire) {
                break;
            }
            let wait = libc::timespec { tv_sec: 0, tv_nsec: 5_000_000 };
            // SAFETY: allowed in a handler; the time is read, none is written.
            unsafe { libc::nanosleep(&wait, ptr::null_mut()) };
        }
    }
    if let Some(before) = signal.before.get() {
        // SAFETY: gives back what the system gave.
        unsafe { libc::sigaction(number, before, ptr::null_mut()) };
    }
    // A fault happens again when this returns, and is then treated as before. A signal that was sent does not.
    // SAFETY: the system hands over a valid description; raising a signal is allowed here, it is delivered when this returns.
    unsafe {
        if (*info).si_code <= 0 {
            libc::raise(number);
        }
    }
}

/// Where it is reported in place of standard error, if anywhere, and what such a report begins with.
static PIPE: OnceLock<(c_int, [u8; 4])> = OnceLock::new();

/// As [`tell_crashes`], but only `beginning` and the number of the instance (4 bytes) are written, and not to standard error.
#[cfg(feature = "glass")]
pub(super) fn report_to(pipe: &impl std::os::fd::AsRawFd, beginning: [u8; 4]) {
    let _ = PIPE.set((pipe.as_raw_fd(), beginning));
    tell_crashes();
}

/// Writes who was called, for what, and what came of it, piece by piece.
fn tell(post: &Post, what: &str, how: &str) {
    let (function, instance) = post.at();
    if let Some((pipe, beginning)) = PIPE.get() {
        write_to(*pipe, beginning);
        write_to(*pipe, &(instance as u32).to_le_bytes());
        return;
    }
    begin();
    write(b"`");
    // Who holds this lock holds it for a moment only; but nothing may be waited for here.
    let names = post.names.try_lock().ok();
    let name = names.as_ref().and_then(|names| names.get(instance)).filter(|name| !name.is_empty());
    if let Some(name) = name {
        write(name.as_bytes());
        write(b"` (");
    }
    write(post.library.as_bytes());
    if !post.element.is_empty() {
        write(b"/");
        write(post.element.as_bytes());
    }
    write(if name.is_some() { b") " } else { b"` " });
    write(what.as_bytes());
    write(b" in `");
    write(function.as_bytes());
    write(b"`, ");
    write(how.as_bytes());
    help();
}

fn begin() {
    write(b"\nerror[");
    write(codes::PLUGIN_CRASHED.code.as_bytes());
    write(b"]: ");
}

fn help() {
    write(b"\n  = help: the code of the library broke the program; report it to the author of the library");
    write(b"\n  = help: rows of results up to there are on disk, but for the last moments\n");
}

/// To standard error.
fn write(bytes: &[u8]) {
    write_to(libc::STDERR_FILENO, bytes);
}

/// Whether that works or not.
fn write_to(file: c_int, bytes: &[u8]) {
    // SAFETY: pointer and length are those of a slice.
    let _ = unsafe { libc::write(file, bytes.as_ptr().cast(), bytes.len()) };
}
