//! Parameter studies: a scene run again and again with other values.
//!
//! - **Takes**: a scene file, the options of a run, the values of all runs ([`Points`]), how many runs may go on at the same time.
//! - **Gives**: a [`Study`]: for each point the figures, the final values of all channels and the work, or
//!   why there are none; as a table. With a folder, every run also leaves its own results there.
//! - **May touch**: the scene file and its libraries, by way of the rooms that read them; the folder of results; threads.
//! - **Must not know**: how a scene is run.
//!
//! Each run is the one that `odyn run` would do with the same `--set`s, alone with its session, so that nothing depends on
//! how many of them run at the same time or in which order they end; what they share ([`crate::session::Common`]) is no
//! part of what comes out. A run that fails is reported as failed; the others stay.
//! In a folder, the row of a run is on the disk as soon as the run has ended: a study that is killed is resumed with the runs
//! that are missing, and its table has the same bytes.
//!
//! A [`Shard`] is a part of the runs, done by itself on whichever machine: `StudyOptions { shard: Shard::new(17, 64), .. }`, then
//! [`Study::write`] into a folder that all shards have in common. [`merge`] makes the table of the parts, byte for byte that of the
//! study in one.
//!
//! ```no_run
//! # use std::path::Path;
//! # use odyn_trials::study::{Design, Points, Shard, Span, Study, StudyOptions, merge};
//! # fn main() -> Result<(), Box<odyn_diagnostics::Diagnostic>> {
//! let spans = [Span::parse("crank.radius=8mm:10mm")?, Span::parse("piston.mass=0.03:0.05")?];
//! let points = Points::designed(&spans, Design::LatinHypercube { count: 1000, seed: 1 })?;
//! let folder = Path::new("results/counterweights");
//! for shard in (1..=4).filter_map(|index| Shard::new(index, 4)) {
//!     let options = StudyOptions {
//!         points: points.clone(),
//!         shard: Some(shard),
//!         journal: Some(folder.into()),
//!         resume: true,
//!         ..StudyOptions::default()
//!     };
//!     let study = Study::run(Path::new("compressor.toml"), &options, &|_, _| (), &Default::default())?;
//!     study.write(folder).map_err(|error| error.diagnostic())?;
//! }
//! let table = merge(folder)?.table;
//! # Ok(()) }
//! ```
//!
//! | file | content |
//! |---|---|
//! | `vary.rs` | what is varied, as written on the command line |
//! | `points.rs` | the values of all runs: combinations, or a table |
//! | `design.rs`, `sobol.rs` | points that fill the ranges of several keys |
//! | `runner.rs` | the runs |
//! | `table.rs` | what came out |
//! | `series.rs` | outputs over time that are kept of every run |
//! | `head.rs` | what a study is |
//! | `journal.rs` | what has come out so far, on the disk |
//! | `shard.rs` | a part of a study |
//! | `merge.rs` | the table of all parts |

mod design;
mod head;
mod journal;
mod merge;
mod points;
mod runner;
mod series;
mod shard;
mod sobol;
mod table;
mod vary;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use design::Design;
pub use journal::{JOURNAL_FILE, Kept, STUDY_FILE};
pub use merge::{Merged, merge};
pub use points::Points;
pub use runner::{Finished, MOST_RUNS, Outcome, Run, Study, StudyOptions};
pub use series::{SERIES_FILE, Series, Taken};
pub use shard::{MOST_SHARDS, Shard};
pub use table::StudyTable;
pub use vary::{Span, Vary};
