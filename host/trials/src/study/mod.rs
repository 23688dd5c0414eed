//! Parameter studies: a scene run again and again with other values.
//!
//! - **Takes**: a scene file, the options of a run, what is varied ([`Vary`]), how many runs may go on at the same time.
//! - **Gives**: a [`Study`]: for each combination of values the figures, the final values of all channels and the work, or
//!   why there are none; as a table. With a folder, every run also leaves its own results there.
//! - **May touch**: the scene file and its libraries, by way of the rooms that read them; the folder of results; threads.
//! - **Must not know**: how a scene is run.
//!
//! Each run is the one that `odyn run` would do with the same `--set`s, alone with its session, so that nothing depends on
//! how many of them go on at the same time or in which order they end; what they share ([`crate::session::Common`]) is no
//! part of what comes out. A run that fails is told as failed; the others stay.
//! In a folder, the row of a run is on the disk as soon as the run has ended: a study that is killed is resumed with the runs
//! that are missing, and its table has the same bytes.
//!
//! | file | content |
//! |---|---|
//! | `vary.rs` | what is varied, as written on the command line |
//! | `runner.rs` | the runs |
//! | `table.rs` | what came out |
//! | `journal.rs` | what has come out so far, on the disk |

mod journal;
mod runner;
mod table;
mod vary;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use journal::{JOURNAL_FILE, Kept, STUDY_FILE};
pub use runner::{Finished, MOST_RUNS, Outcome, Run, Study, StudyOptions};
pub use table::StudyTable;
pub use vary::Vary;
