//! The studio: a scene's text in an editor, with what the solver says of it beside it. The page is served on the loopback
//! address only; the host does the work, so that every library of elements is there.
//!
//! - **Takes**: a scene file, or none; requests of a browser on the same machine.
//! - **Gives**: messages at their places, the assembled mechanism, the plan, runs with progress, elements to insert; the scene
//!   file, when the user saves it.
//! - **May touch**: that file, and a temporary folder for results.
//! - **Must not know**: how scenes are computed, what pages look like.
//!
//! | file | content |
//! |---|---|
//! | `server.rs` | requests and answers |
//! | `http.rs` | how they arrive and leave, within bounds |
//! | `guard.rs` | who is answered: the own page, with its token |
//! | `check.rs` | what the solver says of a text |
//! | `runs.rs` | runs in the background |
//! | `elements.rs` | what can be inserted |
//! | `file.rs` | the scene file |
//! | `../../desk/page/src/studio` | the page |

mod check;
mod elements;
mod file;
mod guard;
mod http;
mod runs;
mod server;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use server::{Settings, Studio};
