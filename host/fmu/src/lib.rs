//! FMUs of other tools (Functional Mock-up Interface 2.0 and 3.0, co-simulation) as elements.
//!
//! - **Takes**: the bytes of an FMU.
//! - **Gives**: [`Fmu`], read and checked; an [`element_api::set::ElementClass`] of it ([`Fmu::class`]), whose instances hold their
//!   outputs between communication points and compute from one to the next where the host says so
//!   ([`element_api::set::ElementSet::communicate`]).
//! - **May touch**: a folder for temporary files, the loader of the system. `library.rs`, `fmi2.rs`, `fmi3.rs` and `states.rs` call foreign code.
//! - **Must not know**: scenes, other elements, how the host steps. A communication step is never repeated here.
//!
//! | file | content |
//! |---|---|
//! | `archive.rs` | zip archives, read within limits |
//! | `description.rs`, `unit.rs` | `modelDescription.xml`: what there is, in which units |
//! | `files.rs` | an FMU unpacked, its binary for this machine |
//! | `library.rs`, `fmi2.rs`, `fmi3.rs`, `states.rs` | the functions of its binary |
//! | `instance.rs` | one instance from its start to its end |
//! | `class.rs` | the same as an element |

mod archive;
mod class;
mod description;
mod files;
mod fmi2;
mod fmi3;
mod instance;
mod library;
mod states;
mod unit;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use class::{DOC, FAILED, GENERAL, INSTANCE, NO_STATE, PARAMETERS, TYPE, general};
pub use description::Description;
pub use files::Fmu;

/// Why an FMU cannot be used, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unusable {
    /// What is wrong, and where in the file.
    pub message: String,
    /// What to do about it; may be empty.
    pub help: String,
    /// The file is damaged, or no FMU; otherwise it is one that cannot be used here.
    pub damaged: bool,
}

impl Unusable {
    fn damaged(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: String::new(), damaged: true }
    }

    fn here(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { message: message.into(), help: help.into(), damaged: false }
    }
}
