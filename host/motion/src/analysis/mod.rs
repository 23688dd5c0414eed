//! Questions to the equations: where are the bodies, how fast, how do they accelerate, what holds them.
//!
//! - **Takes**: programs, a plan, numbers.
//! - **Gives**: assembled positions and velocities with a report; accelerations and multipliers; projection onto the
//!   constraints; the audit's measures.
//! - **May touch**: programs, linear algebra, and the opaque elements a program calls.
//! - **Must not know**: step control, files.
//!
//! | file | content |
//! |---|---|
//! | `formulation.rs` | what a way of writing the equations of motion offers to a simulation |
//! | `working.rs`, `working/` | six velocities per body, sparse elimination, rank-safe where needed |
//! | `joint.rs`, `joint/` | coordinates of joints along a spanning tree, eliminated operation by operation |
//! | `joint_plan.rs` | which rows are needed in the coordinates of joints |
//! | `joint_engines.rs` | their elimination, and the rank-safe factorisation |
//! | `direct.rs` | rates by a program that reads the state and writes them itself |
//! | `joint_start.rs` | from bodies to the coordinates of joints |
//! | `in_bodies.rs` | a scene in coordinates of bodies, beside its form in those of joints |
//! | `evaluator.rs` | a program with its scratch and results |
//! | `motion.rs` | a mechanism in any coordinates at some state; what it asks of the engines of those two |
//! | `newton.rs` | positions and velocities brought to the constraints, in any coordinates |
//! | `passage.rs` | through positions where the constraints lose rank |
//! | `precise.rs`, `precise_state.rs`, `precise_outputs.rs` | the same equations with twice the digits, as power series |
//! | `reference.rs` | the paper's Eq. (6) as printed: the twin and oracle |
//! | `assembly.rs` | positions and velocities before time starts |
//! | `conflict.rs` | which joints contradict each other, where not all can be met |
//! | `coupling.rs`, `closing.rs` | forces that depend on accelerations and reactions, solved together with them |
//! | `constraints.rs` | rows, Jacobian values and violations at a configuration |
//! | `contact.rs` | unilateral rows where they touch: impacts, and which are closed afterwards |
//! | `contact/friction.rs` | rows that hold up to a limit: which stick, and where the others slide to |
//! | `linearisation.rs` | exact derivatives of a formulation's rates |
//! | `unknowns.rs` | values of internal unknowns at the start, and where a search goes |
//! | `local.rs` | the equations at one state, with all their derivatives; what rows leave free |
//! | `scales.rs`, `turning.rs` | lengths and speeds typical of a scene; which bodies can turn |
//! | `turns.rs` | which of the two sets of Euler parameters of a body on a tree continues from the start |

mod assembly;
mod balance;
mod closing;
mod conflict;
mod constraints;
mod contact;
mod coupling;
mod direct;
mod evaluator;
mod followers;
mod formulation;
mod in_bodies;
mod joint;
mod joint_engines;
mod joint_plan;
mod joint_start;
mod linearisation;
mod local;
mod motion;
mod newton;
mod overshadowed;
mod passage;
mod precise;
mod precise_outputs;
mod precise_state;
mod reference;
mod scales;
mod solved;
mod turning;
mod turns;
mod unknowns;
mod working;

#[cfg(test)]
mod tests;

pub use assembly::{
    Assembly, AssemblyError, Chosen, Move, VelocityMiss, ahead, assemble, assemble_from, idle_axes, start_inputs,
};
pub use balance::Imbalance;
pub use conflict::Gap;
pub use constraints::{Constraints, mass_values};
pub use contact::{
    Balance, Contacts, Gap as ContactGap, Grip, Holder, Indeterminate, Meeting, NoSolution, Pattern, Shares, Strike,
};
pub use evaluator::Evaluator;
pub use formulation::{AnalysisError, Counters, Formulation, Group, Observed, Price, Traces};
pub use joint::{JointForm, Portable, Quantities, STATES_PER_AUDIT};
pub use joint_plan::{Folding, JointPlan};
pub use local::{Direction, Expansion, Freedom, Function, Local};
pub use precise::{NotPrecise, PreciseMotion};
pub use reference::ReferenceForm;
pub use scales::{CONTRADICTION, Scales};
pub use solved::SolvedProgram;
pub use unknowns::{Unknowns, determinant, unknown_name};
pub use working::{WorkingForm, WorkingParts, sparse_engine};
