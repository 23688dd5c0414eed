//! The equations of a whole scene as one graph of operations. The graph and its programs are `host/graph`.
//!
//! - **Takes**: a [`crate::model::Model`] with its recorded elements, a [`crate::plan::Layout`].
//! - **Gives**: [`Equations`] (nodes with a meaning) and [`Program`]s (operations in running order).
//! - **May touch**: the elements' recordings; opaque elements while a program runs.
//! - **Must not know**: integrators, solvers, files.
//!
//! Every operation exists once. Derivatives are further nodes of the same graph, so they share everything with the equations
//! they come from.
//!
//! | file | content |
//! |---|---|
//! | `kinematics.rs` | bodies and frames |
//! | `opaque.rs` | elements called at run time |
//! | `equations.rs` | bodies and joints: rows, Jacobians, gamma, loads, energies |
//! | `traced_rows.rs` | rows from recorded functions: their derivatives |
//! | `velocity_rows.rs` | rows on velocities |
//! | `contacts.rs` | unilateral rows, and which rows are enforced |
//! | `sliding.rs` | rows that hold up to a limit: friction |
//! | `releases.rs` | joints that let go for good |
//! | `latches.rs` | memories that jump at instants, forces that let go |
//! | `acting.rs` | force and control elements, and the signals between them |
//! | `inertia.rs` | kinetic energy that elements bring, and their flexible coordinates |
//! | `coupling.rs` | forces that depend on accelerations and reactions |
//! | `joint.rs` | the equations of motion in the coordinates of joints |
//! | `carry.rs` | other quantities in these coordinates |
//! | `reactions.rs` | accelerations and reactions in these coordinates |
//! | `projection.rs` | their mass matrix and right side, by pairs of velocities or by composite bodies |
//! | `spatial.rs` | bodies of a tree at one point: motions, inertias, loads of six numbers |
//! | `turned_rows.rs` | their rows, without the frames they were seen from |
//! | `articulated.rs` | accelerations of open trees, body by body |
//! | `rate_sizes.rs` | what the rates of element states are made of |
//! | `observe.rs` | requested output channels |
//! | `switches.rs` | where equations switch |
//! | `prescribed.rs` | quantities as rows that prescribe them |
//! | `unknowns.rs` | internal unknowns of elements |
//! | `sharp.rs` | functions of time, and functions that rise and fall on a short stretch |

mod acting;
mod articulated;
mod carry;
mod contacts;
mod coupling;
mod equations;
mod inertia;
mod joint;
mod kinematics;
mod latches;
mod moved_rows;
mod observe;
mod opaque;
mod prescribed;
mod projection;
mod rate_sizes;
mod reactions;
mod releases;
mod sharp;
mod sliding;
mod spatial;
mod switches;
mod traced_rows;
mod turned_rows;
mod unknowns;
mod velocity_rows;

#[cfg(test)]
mod tests;

pub use odyn_graph::{
    Call, Elimination, Expr, Graph, Listing, MachineCode, MachineError, Maker, Node, Program, Ranges, Rewriting, Seeds,
    Sets, SharedCode, Solved, Source, Structures, Tangents, Used, Wired, Workspace, condense, costs, derivatives,
    import,
};

pub use articulated::Articulated;
pub use contacts::Contact;
pub use coupling::{CoupledInput, Dependence};
pub use equations::{ElementEquations, Equations, Form, FrameLoad, Row};
pub use inertia::ElementMass;
pub use joint::{JointEquations, JointPose};
pub use kinematics::{BodyNodes, turned_parameters};
pub use latches::Latch;
pub use projection::Projecting;
pub use rate_sizes::{OF_TERMS, RateSizes, sizes_of_drives, sizes_of_forces, sizes_of_terms};
pub use reactions::{Reactions, Working};
pub use releases::Releasing;
pub use sharp::{Knots, Sharp};
pub use sliding::Friction;
#[cfg(test)]
pub use spatial::FAR;
pub use switches::Switches;
