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
//! | `options.rs` | what the command line adds to a scene; the words that scenes choose by |
//! | `common.rs` | what variants of one scene have in common |
//! | `libraries.rs` | which libraries a scene asks for, and where they are looked for |
//! | `opened.rs` | a scene that was opened: all that was found out and decided about it |
//! | `open.rs` | from a scene file to that |
//! | `decide.rs` | what is decided from the numbers at one place |
//! | `prune.rs` | which savings are allowed |
//! | `savings.rs` | what the plan says of them |
//! | `objections.rs` | what is wrong with the start, or worth a warning |
//! | `started.rs` | which velocities are given at the start, which were chosen |
//! | `formulation.rs` | which coordinates the equations of motion are written in |
//! | `place.rs` | where a run begins: at the end of another, or at a checkpoint |
//! | `prepared.rs` | a scene with everything that is chosen before time starts |
//! | `run.rs` | a scene in motion, and the one loop that steps it |
//! | `right_side.rs` | its equations of motion for integrators that are not ours |
//! | `instant.rs` | where a run is, for analyses of that state |
//! | `modes.rs` | the equations for a choice of closed contacts; contacts met at an instant |
//! | `simulation.rs` | the equations of motion as the integrators see them |
//! | `guards.rs` | what is watched throughout every step |
//! | `tier.rs` | when programs turn into machine code |
//! | `saved.rs` | a run at one of its times, to which it can be brought back |
//! | `sink.rs` | who takes the results of a run as they come |
//! | `samplings.rs` | rows in the scene's units, kept and written |
//! | `picture.rs` | what `motion.bin` begins with: bodies with shapes, elements, loads |
//! | `batch.rs` | a scene by itself, from its start to results |
//! | `crew.rs`, `islands.rs`, `island_scenes.rs` | what is integrated side by side: the whole, or parts that share nothing |
//! | `leg.rs` | a part of a run, from one time to another |
//! | `keeper.rs` | keeps a run at its checkpoints, and continues from them |
//! | `checkpoint.rs` | what a run that was killed is resumed from |
//! | `restart.rs` | the state at the end of a run, from which another continues |
//! | `summary.rs` | what is known before a run, what was done, and how it ended |
//! | `figures.rs`, `checks.rs` | the figures and checks of a scene on its samples |
//! | `judge.rs` | whether the audit lets the results pass |
//! | `elements.rs` | what elements say of a run, and how far their conditions held |
//! | `repeats.rs` | whether elements that are called are functions |
//! | `culprit.rs` | which element gives what is not a number |
//! | `met.rs` | points of an element that have come together |
//! | `outcome.rs` | what a run gives |
//! | `sharper.rs` | the same run by another method, at a tenth of the tolerance |
//! | `precise.rs`, `digits.rs` | the same with more digits than doubles have; which digits of a run are certain |
//! | `report.rs`, `apart.rs` | what `check` and `plan` say; of islands |
//! | `watch.rs` | whether the files that a run depends on have changed |
//! | `schema.rs` | the JSON schema of scene files |
//! | `error.rs` | why there is no result |

mod apart;
mod batch;
mod checkpoint;
mod checks;
mod clocks;
mod common;
mod crew;
mod culprit;
mod decide;
mod digits;
mod elements;
mod error;
mod figures;
mod formulation;
mod guards;
mod instant;
mod island_scenes;
mod islands;
mod judge;
mod keeper;
mod leg;
mod libraries;
mod met;
mod modes;
mod objections;
mod open;
mod opened;
mod options;
mod outcome;
mod picture;
mod place;
mod precise;
mod prepared;
mod prune;
mod repeats;
mod report;
mod restart;
mod right_side;
mod run;
mod samplings;
mod saved;
mod savings;
mod schema;
mod sharper;
mod simulation;
mod sink;
mod started;
mod summary;
mod tier;
#[cfg(feature = "abi")]
mod watch;

#[cfg(test)]
mod tests;

pub use crate::diagnostics::Exit;
pub use crate::results::STATE_FILE;
pub use apart::{Apart, OwnSteps};
pub use checkpoint::Checkpoint;
pub use common::Common;
pub use digits::Second;
pub use error::SessionError;
pub use instant::Instant;
pub use libraries::{catalog_of_scene, requests, search_path};
pub use opened::Session;
pub use options::{Afterwards, DEFAULT_METHOD, ENGINES, FORMULATIONS, FindStart, RunOptions};
pub use outcome::RunReport;
pub use precise::{Precise, PreciseSamples};
pub use prepared::Prepared;
pub use report::{CheckReport, PlanReport};
pub use restart::Restart;
pub use right_side::RightSide;
pub use run::{Run, RunSamples};
pub use saved::Saved;
pub use schema::{scene_page, scene_schema};
pub use sharper::{NaturalSizes, Sharper};
pub use sink::Sink;
pub use tier::{Made, Tier};
#[cfg(feature = "abi")]
pub use watch::Watched;
