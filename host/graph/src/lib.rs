//! Graphs of operations, and programs that evaluate parts of them.
//!
//! - **Takes**: operations on numbers, one by one or as a checked recording.
//! - **Gives**: a [`Graph`] in which every operation exists once, [`derivatives`] as further nodes of it, [`Program`]s (operations
//!   in running order), [`MachineCode`] for them.
//! - **May touch**: executable memory of its own; what a program calls while it runs, by [`element_api::set::ElementSet`].
//! - **Must not know**: bodies, joints, scenes, integrators, files.
//!
//! Constants are folded; whatever an output does not depend on is not in its program. However a program is run, its results are
//! the same, bit for bit.
//!
//! | file | content |
//! |---|---|
//! | `graph.rs` | nodes, each of them once, and what they depend on |
//! | `packed.rs` | operations in twelve bytes each |
//! | `operations.rs` | nodes of operations, simplified while they are made |
//! | `derivative.rs` | exact derivatives along a direction, as nodes |
//! | `tangent.rs` | the same along many directions, as numbers |
//! | `series/` | nodes as power series of time, with twice the digits |
//! | `magnitude.rs` | the sums of magnitudes that values are made of |
//! | `vector.rs` | vectors and matrices of nodes |
//! | `import.rs` | recordings to nodes |
//! | `rewrite.rs` | nodes of one graph carried over to another |
//! | `condense.rs` | the same numbers by fewer operations |
//! | `eliminate.rs` | linear systems solved operation by operation |
//! | `ranges.rs` | what nodes can be while their inputs run through ranges |
//! | `tape.rs` | programs |
//! | `compile.rs` | how parts of a graph become programs |
//! | `wired.rs` | programs that read and write vectors of another order |
//! | `listing.rs` | programs value by value, for other languages |
//! | `interpreter.rs` | what runs them without machine code |
//! | `turn.rs` | sine and cosine of an angle at once |
//! | `machine/` | programs as machine code (feature `jit`; without it `no_machine.rs`) |
//! | `shared.rs` | machine code for all programs of one structure |
//! | `structures.rs` | what variants have in common: programs of the same structure |
//! | `costs.rs` | what programs cost |

mod compile;
mod condense;
pub mod costs;
mod derivative;
mod eliminate;
mod graph;
mod import;
mod interpreter;
mod listing;
#[cfg_attr(not(feature = "jit"), path = "no_machine.rs")]
mod machine;
mod magnitude;
mod operations;
mod packed;
mod ranges;
mod rewrite;
mod series;
mod shared;
mod solved;
mod structures;
mod tangent;
mod tape;
mod turn;
mod vector;
mod wired;

#[cfg(test)]
mod tests;

pub use condense::condense;
pub use costs::{MachineError, Maker};
pub use derivative::{Below, Seeds, derivatives, derivatives_along_each, derivatives_among};
pub use eliminate::Elimination;
pub use graph::{Call, Expr, Graph, Node};
pub use import::{import, operation};
pub use listing::{Listing, Value};
pub use machine::MachineCode;
pub use magnitude::magnitudes;
pub use ranges::{Ranges, taylor};
pub use rewrite::Rewriting;
pub use series::Series;
pub use shared::SharedCode;
pub use solved::{Solved, largest_solution};
pub use structures::Structures;
pub use tangent::Tangents;
pub use tape::{Program, Sets, Used, Workspace};
pub use vector::{M3, M6, V3, V6};
pub use wired::{Source, Wired};
