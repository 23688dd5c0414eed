//! Analyses of a scene beside its runs: where it is at rest, how it vibrates, what it looks like to a controller.
//!
//! - **Takes**: a session, and of a run the instant at which it is looked at.
//! - **Gives**: [`statics::Equilibrium`], [`modes::Modes`], [`linear::Linear`], as they are and as files.
//! - **May touch**: the equations of a session by way of [`odyn_motion::analysis::Local`]; the folder of its results.
//! - **Must not know**: how runs are stepped, the terminal.
//!
//! | room | takes -> gives | must not know |
//! |---|---|---|
//! | [`eigen`] | a matrix -> eigenvalues with vectors, residuals and what round-off leaves open | mechanics |
//! | [`linear`] | a session at an instant -> A, B, C, D in independent coordinates | how they are shown |
//! | [`modes`] | that -> frequencies, damping, shapes, energies, stability | how the instant was found |
//! | [`statics`] | a session -> an equilibrium, or the reason why there is none | files |
//! | [`sensitivity`] | a scene file, outputs, numbers of the scene -> derivatives with their errors | how runs are stepped |
//! | [`fit`] | a scene file, measurements, numbers of the scene with bounds -> these numbers with intervals | how runs are stepped |
//! | [`files`] | matrices and reports -> JSON, CSV, `.npz` | mechanics |
//!
//! Every derivative is exact, by the recorded operations of the elements ([`odyn_motion::analysis::Local`]), whatever coordinates a
//! run of the scene takes.

pub mod eigen;
pub mod files;
pub mod fit;
pub mod linear;
pub mod modes;
pub mod sensitivity;
pub mod statics;

pub(crate) use odyn_catalog as catalog;
pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_motion::{analysis, model, plan, program};
pub(crate) use odyn_run::{pool, results, session};
pub(crate) use odyn_scene as scene;
