//! Results: channels, files, figures, the audit, and what is reported at the end of a run.
//!
//! - **Takes**: numbers at sample times with the names, units and places of their channels; counters and times; paths of
//!   tables to compare, or to check against.
//! - **Gives**: `results.csv`, `channels.json` and `summary.json`, and `motion.bin` where it is asked for ([`Folder`]), the figures of a scene ([`Figure`]), its
//!   checks ([`Check`]), the end-of-run text ([`report`]), the comparison of two tables ([`compare`]).
//! - **May touch**: files in the folder of results, the tables it is asked to compare, meshes.
//! - **Must not know**: how numbers were obtained: no models, plans, integrators, plugins; no terminals.
//!
//! Numbers arrive in SI, except times, and leave in scene units. Files are valid at every moment: the table has whole rows
//! only, `summary.json` is replaced in one move and says `running` until the end.
//!
//! | file | content |
//! |---|---|
//! | `folder.rs` | the files of a run and their order |
//! | `csv.rs` | the table, row by row |
//! | `channels.rs` | what each column is |
//! | `summary.rs` | everything else about a run, as data |
//! | `audit.rs` | what can be checked without knowing the solution |
//! | `limits.rs` | what the audit may find before results are suspect |
//! | `events.rs` | what happened to contacts: `events.csv` |
//! | `checks.rs` | values against those they should have |
//! | `motion/` | `motion.bin`: where all bodies were, and what acted on them |
//! | `glb/` | a motion as glTF, for other programs |
//! | `archive.rs` | zip archives, for whoever writes several files as one |
//! | `mesh.rs` | triangles of a file |
//! | `figures.rs` | numbers derived from channels, for print beside published ones |
//! | `remedies.rs` | what was done where the plain way did not get on |
//! | `report.rs` | the text at the end of a run |
//! | `seal.rs` | checksums: what is read back is what was written |
//! | `table.rs`, `compare.rs` | tables read back, and the differences of two |
//! | `digits.rs` | digits of the outputs that are certain |
//! | `verified.rs` | the differences of two runs by different methods |
//! | `text.rs` | short numbers and aligned columns |

mod archive;
mod audit;
mod channels;
mod checks;
mod compare;
mod csv;
mod digits;
mod elements;
mod error;
mod events;
mod figures;
mod folder;
mod glb;
mod limits;
mod mesh;
mod motion;
mod remedies;
mod report;
mod seal;
mod summary;
mod table;
mod text;
mod verified;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use archive::{Packing, zip};
pub use audit::{Audit, AuditRecord};
pub use channels::ChannelInfo;
pub use checks::{Check, CheckResult, Expected};
pub use compare::{ColumnDifference, Comparison, compare};
pub use csv::{CsvWriter, Written};
pub use digits::{Digits, OutputDigits};
pub use elements::{ElementCheck, ElementRecord, GridRange, ValueRange};
pub use error::ResultsError;
pub use events::{EVENTS_FILE, Event, EventKind, Events};
pub use figures::{Crossing, Figure, FigureError, Samples, Take};
pub(crate) use folder::remove;
pub use folder::{
    CHANNELS_FILE, CHECKPOINT_FILE, DIGITS_FILE, Folder, Kept, MOTION_FILE, RESULTS_FILE, STATE_FILE, SUMMARY_FILE,
};
pub use glb::glb;
pub use limits::{AuditLimits, Excess, Measure};
pub use mesh::Mesh;
pub use motion::{
    LOAD, MOTION_FORMAT, Motion, MotionHeader, MotionWriter, POSE, Shape, ShownBody, ShownElement, ShownFrame,
    ShownLoad,
};
pub use remedies::{Recoveries, Remedy};
pub use report::report;
pub use seal::{checksum, checksum_of_file, seal, unseal};
pub use summary::{FigureResult, IslandWork, LibraryUsed, Released, StartVelocity, Status, Summary, Work};
pub use summary::{replace, replace_with};
pub use table::Table;
pub use text::significant;
pub use verified::Verified;
