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
//! | [`analyses`] | a scene -> equilibria, modes, linear models, efforts, kinematics, loads, balancing, sensitivities, fits | how they are shown |
//! | `fmu` | the bytes of an FMU of another tool -> its description, checked; a class of elements | scenes, how the host steps |
//! | [`export`] | a session -> the same as C with a constant cost per step, as an FMU | how the host steps its runs, files |
//! | [`study`] | a scene and values to vary -> a table of what comes out | how a scene is run |
//! | `page` | texts, tables, curves -> HTML (feature `manual`) | what pages are about |
//! | `manual` | cases and outcomes -> pages to read (feature `manual`) | how cases were run |
//! | [`mod@import`] | a file of another program -> the text of a scene | how scenes are read or run |
//! | `workshop` | a name -> a crate for elements; a library -> what is wrong with its elements (feature `workshop`) | scenes that are run |
//!
//! # The way in
//! A program opens a scene, prepares and starts it, and then has a [`session::Run`]: advanced as far as is wanted, given new
//! values of its inputs, asked for its outputs, saved and brought back. The example there is run by the tests.
//!
//! ```text
//! let mut run = Session::open(path, &options)?.prepare()?.start()?;
//! run.advance(t)?;  run.set_input("motor.torque", 3.0)?;  run.output("x_p")?;
//! let saved = run.save()?;  run.restore(&saved)?;  run.samples();
//! ```
//! The command line, checkpoints and islands step their scenes by the same run: it has the one loop, and informs a
//! [`session::Sink`] what comes.
//!
//! # The crates
//! Rooms live in crates beside this one's sources, taken in here under their names, so that the compiler guards what they must
//! not know. Each uses those above it, and no more than its manifest names.
//!
//! | crate | rooms |
//! |---|---|
//! | `host/diagnostics` | [`diagnostics`]: messages with places, and all codes |
//! | `host/numerics` | [`linalg`] (linear systems, ranks), [`interval`] (ranges of numbers and polynomials), [`precise`] (numbers of twice the digits), [`integrate`] |
//! | `host/scene` | [`scene`] |
//! | `host/catalog` | [`catalog`] |
//! | `host/graph` | the part of [`program`] that knows no bodies: the graph, its derivatives, programs, machine code |
//! | `host/motion` | [`model`], [`plan`], [`program`], [`analysis`] |
//! | `host/run` | [`results`], [`session`] |
//! | `host/desk` | `desk`: reports, and what pages are made of |
//! | `host/studio` | `studio`: scenes edited in the browser |
//! | `host/analyses` | [`analyses`] |
//! | `host/export` | [`export`] |
//! | `host/fmu` | `fmu` |
//! | `host/import` | [`mod@import`]: URDF and MJCF as scenes |
//! | `host/trials` | [`verification`], [`mod@bench`], [`stress`], [`study`], `manual`, `workshop` |
//!
//! Four types carry everything: [`scene::Scene`] (what was written), [`model::Model`] (resolved), [`plan::Plan`] with
//! [`program::Program`] (constant), [`program::Workspace`] (scratch, allocated once).

pub use odyn_analyses as analyses;
pub use odyn_catalog as catalog;
#[cfg(feature = "cli")]
pub use odyn_desk as desk;
pub use odyn_diagnostics as diagnostics;
pub use odyn_export as export;
#[cfg(feature = "abi")]
pub use odyn_fmu as fmu;
pub use odyn_import as import;
pub use odyn_motion::{analysis, model, plan, program};
pub use odyn_numerics::{integrate, interval, linalg, precise};
pub use odyn_run::{results, session};
pub use odyn_scene as scene;
#[cfg(feature = "cli")]
pub use odyn_studio as studio;
#[cfg(feature = "manual")]
pub use odyn_trials::manual;
#[cfg(feature = "workshop")]
pub use odyn_trials::workshop;
pub use odyn_trials::{bench, stress, study, verification};
