//! [`Exit`]: what the program ends with.

/// Exit codes of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// Done as asked.
    Done = 0,
    /// The command line is wrong.
    Usage = 2,
    /// The scene or the model has mistakes.
    Scene = 3,
    /// A library can't be had or is broken.
    Plugin = 4,
    /// The joints cannot be assembled.
    Assembly = 5,
    /// The integration ended before its end.
    Integration = 6,
    /// The audit, a comparison or a verification found more than was allowed.
    Audit = 7,
    /// Files can't be read or written.
    Files = 8,
    /// Interrupted by the user, as shells count: 128 + the number of the signal.
    Interrupted = 130,
}
