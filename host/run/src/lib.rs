//! Runs: a scene is opened, prepared, started and advanced; what comes is sampled, audited and written.
//!
//! - **Takes**: the path or the text of a scene, and options.
//! - **Gives**: [`session::Prepared`], [`session::Run`], outcomes with their audit, folders of results, reports.
//! - **Must not know**: the command line.
//!
//! | room | takes -> gives | must not know |
//! |---|---|---|
//! | [`results`] | numbers -> files, figures, audit, report | how numbers were obtained |
//! | [`session`] | all rooms before it, in their order | the terminal |
//! | [`pool`] | pieces of work -> their results, on several threads | what work is |

pub mod pool;
pub mod results;
pub mod session;

pub(crate) use odyn_catalog as catalog;
pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_motion::{analysis, model, plan, program};
pub(crate) use odyn_numerics::{integrate, interval, linalg, precise};
pub(crate) use odyn_scene as scene;

#[cfg(test)]
#[path = "../../testing/foreign/mod.rs"]
mod tests;
