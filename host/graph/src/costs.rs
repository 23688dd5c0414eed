//! What programs cost, for decisions before they are run; and why there may be no machine code.
//!
//! Measured on the right sides of the benchmark scenes (20 to 2300 operations) on a 2-core x86-64 machine: interpreted
//! 2.0 to 2.7 ns per operation, as machine code 0.3 to 0.4 ns; to make it see [`Maker`].

use super::machine::MachineCode;

/// Time to interpret an operation, s.
pub const INTERPRETED: f64 = 2.3e-9;
/// Time to run an operation as machine code, s.
pub const MACHINE: f64 = 0.4e-9;
/// Who makes machine code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Maker {
    /// In one pass, at once.
    Assembler,
    /// Cranelift, for processors that the assembler doesn't know, where it is built in.
    Compiler,
}

impl Maker {
    /// The better one that this machine has.
    #[must_use]
    pub fn here() -> Self {
        if MachineCode::can_assemble() { Self::Assembler } else { Self::Compiler }
    }

    /// Time for a program of so many operations, s.
    #[must_use]
    pub fn time(self, operations: usize) -> f64 {
        // Per program, memory from the system above all; per operation.
        let (program, operation) = match self {
            Self::Assembler => (6e-6, 0.045e-6),
            Self::Compiler => (100e-6, 5e-6),
        };
        program + operation * operations as f64
    }

    /// Size of the code of so many operations, bytes.
    #[must_use]
    pub fn bytes(self, operations: usize) -> f64 {
        let operation = match self {
            Self::Assembler => 9.0,
            Self::Compiler => 13.0,
        };
        operation * operations as f64
    }

    /// Runs of a program after which making machine code of it would have paid for itself.
    #[must_use]
    pub fn runs_that_pay(self, operations: usize) -> f64 {
        self.time(operations) / ((INTERPRETED - MACHINE) * operations.max(1) as f64)
    }
}

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
