//! The flow from a scene file to results: read, resolve, plan, compile, assemble, integrate, report (the paper's Fig. 12).
//!
//! - **Takes**: a scene file or a [`crate::scene::Scene`], options, somebody to tell the progress to, a flag that stops.
//! - **Gives**: a [`Session`] ready to run, what `check` and `plan` report, a [`RunReport`]; or a [`SessionError`] with its
//!   exit code.
//! - **May touch**: every room. It is the one place that knows all of them; each step takes what the rooms before it gave,
//!   and no room calls forward.
//! - **Must not know**: elements by name, the terminal, arguments of the command line.
//!
//! | file | content |
//! |---|---|
//! | `open.rs` | everything before time starts |
//! | `libraries.rs` | which libraries a scene asks for, and where they are looked for |
//! | `formulation.rs` | which coordinates the equations of motion are written in |
//! | `begin.rs` | a run that lacks nothing but its steps |
//! | `run.rs` | from the start to results |
//! | `started.rs` | which velocities are given at the start, which were chosen |
//! | `islands.rs` | parts that share nothing, each with steps of its own |
//! | `apart.rs` | what the plan says of them |
//! | `prune.rs` | which savings are allowed; merged bodies; motions parallel to a plane |
//! | `simulation.rs` | the equations of motion as the integrators see them |
//! | `guards.rs` | what is watched throughout every step |
//! | `tier.rs` | when programs turn into machine code |
//! | `restart.rs` | the state at the end of a run, from which another goes on |
//! | `checkpoint.rs` | what a run that was killed is resumed from |
//! | `chain.rs` | a run with checkpoints: stretches, each from one to the next |
//! | `judge.rs` | whether the audit lets the results pass |
//! | `sharper.rs` | the same run by another method, at a tenth of the tolerance |
//! | `culprit.rs` | which element gives what is not a number |
//! | `checks.rs` | the checks of a scene on its samples |
//! | `report.rs` | what `check` and `plan` say |
//! | `watch.rs` | whether the files that a run depends on have changed |
//! | `schema.rs` | the JSON schema of scene files |
//! | `error.rs` | why there is no result |

mod apart;
mod begin;
mod chain;
mod checkpoint;
mod checks;
mod culprit;
mod error;
mod formulation;
mod guards;
mod islands;
mod judge;
mod libraries;
mod open;
mod prune;
mod report;
mod restart;
mod run;
mod schema;
mod sharper;
mod simulation;
mod started;
mod tier;
#[cfg(feature = "abi")]
mod watch;

#[cfg(test)]
mod tests;

pub use crate::results::STATE_FILE;
pub use apart::{Apart, OwnSteps};
pub use checkpoint::Checkpoint;
pub use error::{Exit, SessionError};
pub use formulation::FORMULATIONS;
pub use libraries::{catalog_of_scene, requests, search_path};
pub use open::{RunOptions, Session};
pub use report::{CheckReport, PlanReport};
pub use restart::Restart;
pub use run::{DEFAULT_METHOD, ENGINES, RunReport};
pub use schema::scene_schema;
pub use sharper::Sharper;
pub use simulation::{Progress, Simulation, Sink};
pub use tier::{Made, Tier};
#[cfg(feature = "abi")]
pub use watch::Watched;
