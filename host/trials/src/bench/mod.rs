//! Bench: what accuracy costs, for every method of integration.
//!
//! - **Takes**: paths of scene files whose `[[check]]`s tell what is measured and against what; methods, tolerances, how
//!   often to repeat; tables of other programs' measurements.
//! - **Gives**: a [`Report`]: for each scene, method and tolerance the error, the work and the times, as a table and as a page
//!   with work-precision curves (feature `manual`).
//! - **May touch**: the scene files, their references and libraries, by way of the rooms that read them; the clock; the program
//!   itself, which it starts to measure the start-up.
//! - **Must not know**: scenes, methods or other programs by name.
//!
//! The error of a run is the largest difference, at any sample, of a measured coordinate from its reference, absolute, in
//! the coordinate's unit. Measured coordinates are the checks of kind `position` and `orientation`, or all checks where
//! there are none of these; in a scene without checks all outputs, as shares of their sizes, against a reference that is
//! computed. The error belongs to the very run that is timed: no figure of speed stands without it. What fails is reported as failed.
//!
//! | file | content |
//! |---|---|
//! | `report.rs` | what came out, as plain data |
//! | `reference.rs` | what the outputs of a scene without checks are, computed once and kept |
//! | `runner.rs` | runs a scene with all methods and tolerances |
//! | `machine.rs` | where it ran |
//! | `summary.rs` | best times at some errors, and how programs compare |
//! | `table.rs` | measurements as CSV, written and read |
//! | `page.rs` | the page |

mod machine;
#[cfg(feature = "manual")]
mod page;
mod reference;
mod report;
mod runner;
mod summary;
mod table;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use machine::Machine;
pub use report::{Measured, Point, Problem, Report, Setting, Times, Work};
pub use runner::{Runner, Settings, TOLERANCES};
pub use summary::{Best, LEVELS, Ratio};
pub use table::{HEADER, read, write};
