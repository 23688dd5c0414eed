//! Scenes as programs for other places: C99 with a constant cost per step.
//!
//! - **Takes**: a session that was opened.
//! - **Gives**: [`Machine`], the programs of a scene with everything that a step needs; the same as C ([`c::package`]); and run by the
//!   interpreter ([`Twin`]), bit for bit what the C program computes; an FMU ([`fmu::Fmu`]).
//! - **May touch**: the programs of a session by way of [`odyn_motion::analysis::Portable`].
//! - **Must not know**: the terminal, where files go, how the host steps its runs.
//!
//! | file | content |
//! |---|---|
//! | `choices.rs` | what is exported of a scene, and how it is stepped |
//! | `machine.rs` | what is exported: programs, start, names |
//! | `refused.rs` | what cannot be, and why |
//! | `method.rs` | methods with a fixed number of stages |
//! | `parameters.rs`, `shape.rs`, `laws.rs` | parameters that can be set: which numbers of the equations follow them, and how |
//! | `tangents.rs` | exact derivatives of what it computes along a direction |
//! | `sampled.rs` | memories that change at whole multiples of a period |
//! | `twin.rs`, `steps.rs`, `rosenbrock.rs` | the same steps by the interpreter: what the C programs are held against |
//! | `trial.rs` | what steps of a fixed size are good for |
//! | `c/listing.rs` | a program as functions in C |
//! | `c/source.rs`, `c/runtime.c` | the C file: programs, and what steps them |
//! | `c/sampled.c`, `c/control.c` | when elements sample; sizes of steps by their errors |
//! | `c/rosenbrock.c`, `c/tangents.c` | a step of a Rosenbrock method; derivatives along a direction |
//! | `c/header.rs` | its header |
//! | `c/package.rs` | all files of an export, and what a step costs |
//! | `fmu/mod.rs` | an FMU: description, sources, binaries in one archive |
//! | `fmu/instance.c`, `fmu/derivatives.c`, `fmu/fmi2.c`, `fmu/fmi3.c`, `fmu/both.c` | what stands between a machine and the functions of the interface |
//! | `fmu/description.rs`, `fmu/dependencies.rs` | `modelDescription.xml`; what outputs and rates depend on |
//! | `fmu/build.rs` | binaries by the compilers that are there |

pub mod c;
mod choices;
pub mod fmu;
mod laws;
mod machine;
mod method;
mod parameters;
mod refused;
mod rosenbrock;
mod sampled;
mod shape;
mod steps;
mod tangents;
mod trial;
mod twin;

pub use choices::Choices;
pub use laws::{Form, Law};
pub use machine::{Machine, Port, ThinAxis};
pub use method::{Implicit, METHODS, Method};
pub use parameters::{Parameter, Parameters, Reopen};
pub use rosenbrock::Slopes;
pub use sampled::{Clock, Sampled};
pub use tangents::Tangents;
pub use trial::Trial;
pub use twin::{Failed, Twin};

pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_motion::{analysis, model, plan, program};
pub(crate) use odyn_run::{results, session};
pub(crate) use odyn_scene as scene;
