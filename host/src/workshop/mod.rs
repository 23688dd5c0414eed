//! Workshop: what the authors of elements need beside the contract (feature `workshop`).
//!
//! - **Takes**: a name and a kind of element.
//! - **Gives**: the folder of a crate that builds, passes its tests and runs a scene ([`create`]).
//! - **May touch**: the folder it makes.
//! - **Must not know**: how findings are shown, how scenes are run.
//!
//! | file | content |
//! |---|---|
//! | `create.rs` | a new crate, written as a whole or not at all |
//! | `names.rs` | names that crates, elements and types can have |
//! | `templates.rs`, `templates/` | its files |
//! | `error.rs` | why there is none |

mod create;
mod error;
mod names;
mod templates;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use create::{Contract, Created, NewPlugin, create};
pub use error::WorkshopError;
pub use templates::Template;
