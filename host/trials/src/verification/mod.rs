//! Verification: scenes with checks, run and judged.
//!
//! - **Takes**: paths of scene files, where to look for libraries.
//! - **Gives**: a [`Case`] per scene: the errors of its checks over time and over the tolerance of the run, the
//!   Newton-Euler balance of its bodies, the work; and which elements no scene verifies ([`Coverage`]).
//! - **May touch**: the scene files, their references and libraries, by way of the rooms that read them.
//! - **Must not know**: elements by name, how cases are shown.
//!
//! A scene that cannot be run is a failed case with the reason, never the end of a verification.
//!
//! | file | content |
//! |---|---|
//! | `case.rs` | what came out, as plain data |
//! | `verifier.rs` | runs a scene |
//! | `numbers.rs` | an analysis in place of a run: its numbers against those that the scene gives |
//! | `balance.rs` | reported loads of every body against its acceleration |
//! | `coverage.rs` | elements and the scenes that verify them |

mod balance;
mod case;
mod coverage;
mod numbers;
mod verifier;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use case::{BALANCE_BOUND, Balance, Case, Checked, Measured, Rung};
pub use coverage::{Coverage, Element};
pub use verifier::{LADDER, Settings, Verifier, scenes_in};
