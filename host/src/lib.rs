//! O-DYN: multibody dynamics with joints and forces from plugins.
//!
//! The host knows no joint. A scene names libraries; their elements hand over their equations as data, once; the host
//! prunes, differentiates and evaluates the equations of the whole scene as one graph, and integrates them.
//!
//! # The flow, and the rooms
//! scene file -> [`scene`] -> [`catalog`] -> [`model`] -> [`plan`] -> [`program`] -> [`analysis`] -> [`integrate`] ->
//! [`results`], put together by [`session`].
//!
//! | room | takes -> gives | must not know |
//! |---|---|---|
//! | [`scene`] | text -> plain records with places, in SI units; all mistakes at once | plugins, mathematics |
//! | [`catalog`] | library names -> element classes, loaded and checked | scenes, equations |
//! | [`model`] | scene + catalog -> bodies, markers, elements with recorded equations, channels | vector offsets, solvers |
//! | [`plan`] | model + Jacobian at the start -> independent rows, unique reactions, what is skipped | integrators |
//! | [`program`] | recorded equations -> one graph with derivatives; programs that evaluate parts | integrators, files |
//! | [`analysis`] | programs -> assembly, accelerations and multipliers, projection | step control, files |
//! | [`integrate`] | a system of differential equations -> steps, samples | mechanics, plugins |
//! | [`results`] | numbers -> files, figures, audit, report | how numbers were obtained |
//! | [`session`] | all of them, in this order | |
//! | [`verification`] | scenes with checks -> cases: errors, balance, work | how cases are shown |
//! | [`mod@bench`] | scenes with references -> errors, work and times of all methods | how curves are drawn |
//! | [`stress`] | trials with what is expected of them -> outcomes: measures with their bounds | how outcomes are shown |
//! | [`study`] | a scene and values to vary -> a table of what comes out | how a scene is run |
//! | `page` | texts, tables, curves -> HTML (feature `manual`) | what pages are about |
//! | `manual` | cases and outcomes -> pages to read (feature `manual`) | how cases were run |
//! | `workshop` | a name -> a crate for elements; a library -> what is wrong with its elements (feature `workshop`) | scenes that are run |
//!
//! Leaves that any room may use: [`diagnostics`] (messages with places), [`linalg`] (linear systems, ranks) and
//! [`interval`] (ranges of numbers and polynomials). A room
//! uses only rooms before it and the leaves; a test guards the edges.
//!
//! Four types carry everything: [`scene::Scene`] (what was written), [`model::Model`] (resolved), [`plan::Plan`] with
//! [`program::Program`] (constant), [`program::Workspace`] (scratch, allocated once).

pub mod analysis;
pub mod bench;
pub mod catalog;
pub mod diagnostics;
pub mod integrate;
pub mod interval;
pub mod linalg;
#[cfg(feature = "manual")]
pub mod manual;
pub mod model;
#[cfg(feature = "manual")]
mod page;
pub mod plan;
pub mod program;
pub mod results;
pub mod scene;
pub mod session;
pub mod stress;
pub mod study;
pub mod verification;
#[cfg(feature = "workshop")]
pub mod workshop;

#[cfg(test)]
mod tests;
