//! The flow from a scene file to results: read, resolve, plan, compile, assemble, integrate, report (the paper's Fig. 12).
//!
//! The one place that knows every room. Each step takes what the rooms before it gave; no room calls forward.

mod error;
mod open;
mod report;
mod run;
mod simulation;

#[cfg(test)]
mod tests;

pub use error::{Exit, SessionError};
pub use open::{RunOptions, Session};
pub use report::{CheckReport, PlanReport};
pub use run::RunReport;
pub use simulation::{Progress, Simulation, Sink};
