//! The mechanism: what a scene says becomes bodies and elements, their equations, and their motion.
//!
//! - **Takes**: a [`scene`] and a [`catalog`] of element classes.
//! - **Gives**: a [`model::Model`], its [`program::Equations`], the [`plan::Plan`] of what is solved and what is skipped, and
//!   [`analysis::Formulation`]s that give rates of states and bring states back to the constraints.
//! - **Must not know**: step control, files, terminals.
//!
//! | room | takes -> gives | must not know |
//! |---|---|---|
//! | [`model`] | scene + catalog -> bodies, markers, elements with recorded equations, channels | vector offsets, solvers |
//! | [`plan`] | model + Jacobian at the start -> independent rows, unique reactions, what is skipped | equations |
//! | [`program`] | recorded equations -> one graph with derivatives; programs that evaluate parts | integrators, files |
//! | [`analysis`] | programs -> assembly, accelerations and multipliers, projection | step control, files |
//!
//! A room uses only those above it; a test guards that.

pub mod analysis;
pub mod model;
pub mod plan;
pub mod program;

pub(crate) use odyn_catalog as catalog;
pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_numerics::{linalg, precise};
pub(crate) use odyn_scene as scene;

#[cfg(test)]
mod tests;
