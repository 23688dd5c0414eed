//! Ctrl-C.

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
    stop
}
