//! Stress: scenes that are hard to compute, and what must come out of them.
//!
//! - **Takes**: a [`Suite`] of trials, read from a file: scenes with changes, and bounds, refusals, ends or equalities that are
//!   expected of each; which of them, and whether in their short or full form.
//! - **Gives**: an [`Outcome`] per trial and formulation: every measure with its bound, what else was not as expected, the work.
//! - **May touch**: the suite's file, scene files, their references and libraries, by way of the rooms that read them; threads.
//! - **Must not know**: scenes or elements by name, how outcomes are shown.
//!
//! A trial that goes wrong is an outcome with the reason, never the end of the suite. Outcomes do not depend on how many trials
//! run at the same time.
//!
//! | file | content |
//! |---|---|
//! | `suite.rs` | the trials, and how they are read |
//! | `runner.rs` | runs the trials |
//! | `judge.rs` | what came out against what was expected |
//! | `outcome.rs` | what came out, as plain data |

mod judge;
mod outcome;
mod runner;
mod suite;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use outcome::{Measure, Outcome};
pub use runner::{Settings, run};
pub use suite::{Bounds, Equals, Expected, Message, Reactions, Suite, Trial};
