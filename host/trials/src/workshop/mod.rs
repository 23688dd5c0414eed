//! Workshop: what the authors of elements need beside the contract (feature `workshop`).
//!
//! - **Takes**: a name and a kind of element; or the library of an author, and parameters for its elements.
//! - **Gives**: the folder of a crate that builds, passes its tests and runs a scene ([`create()`]); what the test kit finds in
//!   the library through its binary interface, and what its elements cost ([`examine()`]).
//! - **May touch**: the folder it makes; the elements of the library.
//! - **Must not know**: how findings are shown, how scenes are run.
//!
//! | file | content |
//! |---|---|
//! | `create.rs` | a new crate, written as a whole or not at all |
//! | `into.rs` | an element more in a crate that is there |
//! | `names.rs` | names that crates, elements and types can have |
//! | `templates.rs`, `templates/` | its files |
//! | `error.rs` | why there is none |
//! | `examine.rs` | an element of a library under the test kit |
//! | `values.rs` | the parameters that it is examined with |
//! | `cost.rs` | what its evaluations cost |

mod cost;
mod create;
mod error;
mod examine;
mod into;
mod names;
mod templates;
mod values;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use cost::{Cost, Traced};
pub use create::{Contract, Created, NewPlugin, create};
pub use error::WorkshopError;
pub use examine::{CheckVerdict, Exemption, Outcome, Verdict, cost, examine};
pub use into::add;
pub use templates::Template;
pub use values::{BadValues, Given, Origin, Value};
