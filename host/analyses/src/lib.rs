//! Analyses of a scene beside its runs: where it is at rest, how it vibrates, what it looks like to a controller.
//!
//! - **Takes**: a session, and of a run the instant at which it is looked at.
//! - **Gives**: [`statics::Equilibrium`], [`modes::Modes`], [`linear::Linear`], [`inverse::Inverse`], as they are and as files.
//! - **May touch**: the equations of a session by way of [`odyn_motion::analysis::Local`]; the folder of its results.
//! - **Must not know**: how runs are stepped, the terminal.
//!
//! | room | takes -> gives | must not know |
//! |---|---|---|
//! | [`eigen`] | a matrix -> eigenvalues with vectors, residuals and what round-off leaves open | mechanics |
//! | [`linear`] | a session at an instant -> A, B, C, D in independent coordinates | how they are shown |
//! | `round_off` | the state that was linearised -> what round-off of its loads leaves open of eigenvalues | files |
//! | [`modes`] | that -> frequencies, damping, shapes, energies, stability | how the instant was found |
//! | [`campbell`] | modes at values of a key -> branches that continue from value to value | how they are shown |
//! | `energies` | a linear model, a vector of states -> whose energy that is | how they are shown |
//! | [`statics`] | a session -> an equilibrium, or the reason why there is none | files |
//! | [`sensitivity`] | a scene file, outputs, numbers of the scene -> derivatives with their errors | how runs are stepped |
//! | [`fit`] | a scene file, measurements, numbers of the scene with bounds -> these numbers with intervals | how runs are stepped |
//! | [`prescribed`] | a motion file -> quantities over time with two derivatives | mechanics |
//! | [`kinematics`] | a session and what drives it -> places, ratios, limits, dead points | files |
//! | [`inverse`] | a session and a prescribed motion -> the efforts of actuators that cause it | files |
//! | [`loads`] | instants of a run -> all loads on one body, as tables and decks for finite elements | how they were reached |
//! | [`balance`] | a scene that turns -> harmonics of what shakes the ground, a counterweight | files |
//! | [`place`] | the start, the equilibrium or a time -> a session at that instant | files |
//! | [`question`] | any of these, as data -> its answer, as data | how it is shown |
//! | [`shown`] | what an analysis found -> a sentence, tables, motions of modes | files |
//! | [`folder`] | these, quantities over time -> a folder that `odyn report` shows | mechanics |
//! | [`files`] | matrices and reports -> JSON, CSV, `.npz` | mechanics |
//!
//! Every derivative is exact, by the recorded operations of the elements ([`odyn_motion::analysis::Local`]), whatever coordinates a
//! run of the scene takes.

pub mod balance;
pub mod campbell;
mod driven;
pub mod eigen;
mod energies;
pub mod files;
pub mod fit;
pub mod folder;
pub mod inverse;
pub mod kinematics;
pub mod linear;
pub mod loads;
pub mod modes;
mod moves;
pub mod place;
mod plain;
pub mod prescribed;
pub mod question;
mod round_off;
pub mod sensitivity;
pub mod shown;
mod shown_fits;
pub mod statics;

pub(crate) use odyn_catalog as catalog;
pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_motion::{analysis, model, plan, program};
pub(crate) use odyn_numerics::{integrate, linalg};
pub(crate) use odyn_run::{pool, results, session};
pub(crate) use odyn_scene as scene;
