//! Tests of O-DYN as a whole. Each room of the host, the contract and each library of elements has its own tests beside its
//! code; here is what only shows when they work together.
//!
//! | file | what it shows |
//! |---|---|
//! | `benchmarks.rs` | scenes agree with references, in both formulations, and with the work pinned |
//! | `compressor.rs` | what the paper publishes, and what `check` and `plan` say of its example |
//! | `broken_scenes.rs` | what a user reads when a scene, a library or a motion is not as it should be |
//! | `plugins.rs` | libraries built outside the workspace load and run; bad ones are refused |
//! | `opaque.rs` | elements that are called at run time move as recorded ones do |
//! | `states.rs` | continuous and discrete states, memory, angles over many turns |
//! | `interleaved.rs` | models share nothing |
//! | `rooms.rs` | who may use whom in the host, and that it knows no element |
//!
//! `support.rs` has the doors to scenes and results; `fixtures.rs` builds the libraries of `fixtures/`.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod benchmarks;
mod broken_scenes;
mod compressor;
mod fixtures;
mod interleaved;
mod opaque;
mod plugins;
mod rooms;
mod states;
mod support;
