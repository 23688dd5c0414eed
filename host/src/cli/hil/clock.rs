//! The clock of the system that nobody sets, and what the system gives programs for which time matters.

// Functions of the system that take plain numbers and structs.
#![allow(unsafe_code)]

use std::time::{Duration, Instant};

use serde::Serialize;

/// Ticks at whole multiples of a period.
pub(super) struct Clock {
    start: Instant,
    period: f64,
}

impl Clock {
    /// Its first tick is now.
    pub(super) fn start(period: f64) -> Self {
        Self { start: Instant::now(), period }
    }

    /// Since the start, s.
    pub(super) fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// The time of a tick, s.
    pub(super) fn at(&self, tick: u64) -> f64 {
        tick as f64 * self.period
    }

    /// Waits for a tick; false: it has passed.
    pub(super) fn wait_for(&self, tick: u64) -> bool {
        let ahead = self.at(tick) - self.now();
        if ahead <= 0.0 {
            return tick == 0;
        }
        sleep(ahead);
        // A system may wake a little early.
        while self.now() < self.at(tick) {
            std::hint::spin_loop();
        }
        true
    }
}

/// Sleeps for a time, s.
pub(super) fn sleep(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// What the system gave.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Rights {
    /// Priority among `SCHED_FIFO`; `None`: it was not given, or not asked for.
    priority: Option<i32>,
    /// Whether memory stays where it is.
    memory_locked: bool,
    /// Why not.
    refused: Vec<String>,
}

impl Rights {
    pub(super) fn words(&self) -> String {
        let priority = self.priority.map_or("ordinary priority".into(), |priority| format!("SCHED_FIFO {priority}"));
        let memory = if self.memory_locked { "memory locked" } else { "memory not locked" };
        let refused = if self.refused.is_empty() { String::new() } else { format!(" ({})", self.refused.join("; ")) };
        format!("{priority}, {memory}{refused}")
    }
}

/// Asks for a priority (0: none) and for memory that is not moved out.
#[cfg(target_os = "linux")]
pub(super) fn ask_for_rights(priority: i32) -> Rights {
    let mut rights = Rights { priority: None, memory_locked: false, refused: Vec::new() };
    if priority > 0 {
        let parameters = libc::sched_param { sched_priority: priority };
        // SAFETY: reads the struct; 0 is this thread.
        if unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) } == 0 {
            rights.priority = Some(priority);
        } else {
            rights
                .refused
                .push(format!("SCHED_FIFO: {}; `ulimit -r` says what is allowed", std::io::Error::last_os_error()));
        }
        // Sleeps end within 1 us of their time, where the system can.
        // SAFETY: plain numbers.
        unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1_000, 0, 0, 0) };
    }
    // SAFETY: plain numbers.
    if unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) } == 0 {
        rights.memory_locked = true;
    } else {
        rights.refused.push(format!("mlockall: {}; `ulimit -l` says what is allowed", std::io::Error::last_os_error()));
    }
    rights
}

/// Gives back what [`ask_for_rights`] got.
#[cfg(target_os = "linux")]
pub(super) fn give_back() {
    let parameters = libc::sched_param { sched_priority: 0 };
    // SAFETY: reads the struct; plain numbers.
    unsafe {
        libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const parameters);
        libc::munlockall();
    }
}

/// Other systems are not asked.
#[cfg(not(target_os = "linux"))]
pub(super) fn ask_for_rights(_: i32) -> Rights {
    Rights { priority: None, memory_locked: false, refused: vec!["not asked for on this system".into()] }
}

/// The reverse of nothing.
#[cfg(not(target_os = "linux"))]
pub(super) fn give_back() {}
