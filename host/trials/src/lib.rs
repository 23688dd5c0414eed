//! Many runs: what is tried with a scene, or with a folder of them, and the pages that show it.
//!
//! | room | takes -> gives | must not know |
//! |---|---|---|
//! | [`verification`] | scenes with checks -> cases: errors, balance, work | how cases are shown |
//! | [`mod@bench`] | scenes with references -> errors, work and times of all methods | how curves are drawn |
//! | [`stress`] | trials with what is expected of them -> outcomes: measures with their bounds | how outcomes are shown |
//! | [`study`] | a scene and values to vary -> a table of what comes out | how a scene is run |
//! | `manual` | cases and outcomes -> pages to read (feature `manual`) | how cases were run |
//! | `workshop` | a name -> a crate for elements; a library -> what is wrong with its elements (feature `workshop`) | scenes that are run |

pub mod bench;
#[cfg(feature = "manual")]
pub mod manual;
pub mod stress;
pub mod study;
pub mod verification;
#[cfg(feature = "workshop")]
pub mod workshop;

pub(crate) use odyn_analyses::{question, statics};
pub(crate) use odyn_catalog as catalog;
#[cfg(feature = "manual")]
pub(crate) use odyn_desk::page;
pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_motion::model;
#[cfg(feature = "workshop")]
pub(crate) use odyn_motion::program;
pub(crate) use odyn_numerics::integrate;
pub(crate) use odyn_run::{pool, results, session};
pub(crate) use odyn_scene as scene;

#[cfg(test)]
#[path = "../../testing/foreign/mod.rs"]
mod tests;
