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
//! | `joint.rs` | the equations of motion in the coordinates of joints |
//! | `carry.rs` | other quantities in these coordinates |
//! | `projection.rs` | their mass matrix and right side, by pairs of velocities or by composite bodies |
//! | `spatial.rs` | bodies of a tree at one point: motions, inertias, loads of six numbers |
//! | `turned_rows.rs` | their rows, without the frames they were seen from |
//! | `articulated.rs` | accelerations of open trees, body by body |
//! | `rewrite.rs` | nodes of one graph carried over to another |
//! | `condense.rs` | the same numbers by fewer operations |
//! | `eliminate.rs` | linear systems solved operation by operation |
//! | `observe.rs` | requested output channels |
//! | `switches.rs` | where equations switch |
//! | `sharp.rs` | functions of time, and functions that rise and fall on a short stretch |
//! | `ranges.rs` | what nodes can be while their inputs run through ranges |
//! | `planar.rs` | the equations of a motion that stays parallel to a plane |
//! | `tape.rs` | programs |
//! | `interpreter.rs` | what runs them without machine code |
//! | `turn.rs` | sine and cosine of an angle at once |
//! | `lanes.rs` | programs for several instances at once |
//! | `kernels.rs` | operations that many bodies or joints repeat, looped over them |
//! | `machine/` | programs as machine code (feature `jit`; without it `no_machine.rs`) |
//! | `costs.rs` | what programs cost |

mod acting;
mod articulated;
mod carry;
mod condense;
pub mod costs;
mod coupling;
mod derivative;
mod eliminate;
mod equations;
mod graph;
mod import;
mod interpreter;
mod joint;
mod kernels;
mod kinematics;
mod lanes;
#[cfg_attr(not(feature = "jit"), path = "no_machine.rs")]
mod machine;
mod observe;
mod opaque;
mod planar;
mod projection;
mod ranges;
mod rewrite;
mod sharp;
mod spatial;
mod switches;
mod tape;
mod turn;
mod turned_rows;
mod vector;

#[cfg(test)]
mod tests;

pub use articulated::Articulated;
pub use condense::condense;
pub use costs::{MachineError, Maker};
pub use coupling::CoupledInput;
pub use derivative::{Seeds, derivatives};
pub use eliminate::Elimination;
pub use equations::{ElementEquations, Equations, Form, FrameLoad, Row};
pub use graph::{Call, Expr, Graph, Node};
pub use import::import;
pub use joint::{JointEquations, JointPose};
pub use kernels::{NO_PLACE, Place, Writing};
pub use kinematics::BodyNodes;
pub use lanes::Lanes;
pub use machine::MachineCode;
pub use planar::{NotPlanar, Planar};
pub use projection::Projecting;
pub use ranges::Ranges;
pub use sharp::{Knots, Sharp};
#[cfg(test)]
pub(crate) use spatial::FAR;
pub use switches::Switches;
pub use tape::{Program, Sets, Used, Workspace};
