//! What programs cost, for decisions before they are run; and why there may be no machine code.
//!
//! Measured on the right sides of the benchmark scenes (600 to 1800 operations) on a 2-core x86-64 machine: interpreted
//! 2.0 to 2.7 ns per operation, as machine code 0.3 to 0.4 ns; 3.5 to 5.5 us and 12 to 13 bytes per operation to make it.

use super::kernels::Writing;

/// Time to interpret an operation, s.
pub const INTERPRETED: f64 = 2.3e-9;
/// Time to run an operation as machine code, s.
pub const MACHINE: f64 = 0.4e-9;
/// Time to make machine code of an operation, s.
pub const COMPILING: f64 = 5e-6;
/// Machine code of an operation, bytes.
pub const CODE: f64 = 13.0;

/// Nodes of a program from which on it is written with kernels. As one line it would be a megabyte of machine code, which
/// takes half a second to make and is read from memory again and again; below, machine code is faster in long runs.
const LOOPS_FROM: usize = 100_000;

/// Why there is no machine code.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MachineError {
    /// This build makes none, or none for this processor.
    #[error("this build makes no machine code for this processor")]
    Unavailable,
    /// It is no longer wanted.
    #[error("no longer wanted")]
    Cancelled,
    /// The compiler, or the system when asked for memory that may be run.
    #[error("{0}")]
    Refused(String),
}

/// Runs of a program, of any length, after which making machine code of it would have paid for itself.
#[must_use]
pub fn runs_that_pay() -> f64 {
    COMPILING / (INTERPRETED - MACHINE)
}

/// Whether to look for kernels in a program of `live` nodes.
pub(super) fn may_loop(writing: Writing, live: usize) -> bool {
    match writing {
        Writing::Automatic => live >= LOOPS_FROM,
        Writing::Straight => false,
        Writing::Kernels => true,
    }
}

/// Whether kernels that do `looped` operations make a program of `live` nodes faster.
pub(super) fn loops_pay(writing: Writing, looped: usize, live: usize) -> bool {
    match writing {
        Writing::Automatic => 2 * looped >= live,
        Writing::Straight => false,
        Writing::Kernels => looped > 0,
    }
}
