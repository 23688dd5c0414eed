//! The equations of a whole scene as one graph of operations, and programs that evaluate parts of it.
//!
//! - **Takes**: a [`crate::model::Model`] with its recorded elements, a [`crate::plan::Layout`].
//! - **Gives**: [`Equations`] (nodes with a meaning) and [`Program`]s (operations in running order).
//! - **May touch**: the elements' recordings; opaque elements while a program runs.
//! - **Must not know**: integrators, solvers, files.
//!
//! Every operation exists once; constants are folded; whatever an output does not depend on is not in its program.
//! Derivatives are further nodes of the same graph, so they share everything with the equations they come from.
//!
//! | file | content |
//! |---|---|
//! | `graph.rs` | nodes, simplified while they are made |
//! | `derivative.rs` | exact derivatives along a direction |
//! | `vector.rs` | vectors and matrices of nodes |
//! | `import.rs` | recordings to nodes |
//! | `kinematics.rs` | bodies and frames |
//! | `opaque.rs` | elements called at run time |
//! | `equations.rs` | bodies and joints: rows, Jacobians, gamma, loads, energies |
//! | `acting.rs` | force and control elements, and the signals between them |
//! | `coupling.rs` | forces that depend on accelerations and reactions |
//! | `observe.rs` | requested output channels |
//! | `tape.rs` | programs and their interpreter |
//! | `kernels.rs` | operations that many bodies or joints repeat, looped over them |
//! | `machine.rs` | programs as machine code (feature `jit`; without it `no_machine.rs`) |
//! | `costs.rs` | what programs cost |

mod acting;
pub mod costs;
mod coupling;
mod derivative;
mod equations;
mod graph;
mod import;
mod kernels;
mod kinematics;
#[cfg_attr(not(feature = "jit"), path = "no_machine.rs")]
mod machine;
mod observe;
mod opaque;
mod tape;
mod vector;

#[cfg(test)]
mod tests;

pub use costs::MachineError;
pub use coupling::CoupledInput;
pub use derivative::{Seeds, derivatives};
pub use equations::{ElementEquations, Equations, Form, FrameLoad, Row};
pub use graph::{Call, Expr, Graph, Node};
pub use kernels::{NO_PLACE, Place, Writing};
pub use kinematics::BodyNodes;
pub use machine::MachineCode;
pub use tape::{Program, Sets, Used, Workspace};
