//! The desk: what runs are shown on. A report is one file that needs no network and no other file.
//!
//! - **Takes**: folders of results.
//! - **Gives**: an HTML page with the verdict, motion, plots, table and provenance of runs ([`report`]); what other pages are made
//!   of ([`page`]).
//! - **May touch**: the files of the folders, and the scene file that a run names.
//! - **Must not know**: how results were obtained.
//!
//! | file | content |
//! |---|---|
//! | `source.rs` | a folder of results, read |
//! | `report.rs` | the page of one or several runs |
//! | `sections.rs` | its parts that are text: verdict, figures, audit, remedies, provenance |
//! | `events.rs` | how often contacts struck, closed and opened |
//! | `pack.rs` | its data for the scripts |
//! | `curves.rs` | plots as drawings, where there are no scripts |
//! | `page/` | the frame of a page, tables, charts |
//! | `../page/` | the scripts; third parties' are bundled with them when the crate is built, if npm is there |

mod curves;
mod elements;
mod events;
mod pack;
pub mod page;
mod report;
mod sections;
mod source;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use pack::pack as data;
pub use report::{Scripts, report, write};
pub use source::Source;

pub(crate) use odyn_diagnostics as diagnostics;
pub(crate) use odyn_run::results;
