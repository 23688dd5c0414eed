//! From words to indices and numbers: markers, parameters, channels, and one message per mistake.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod channels;
mod markers;
mod mistakes;
mod parameters;
mod tables;

use super::*;
use crate::tests::{model, resolved};

/// A body `a` and, behind it, whatever follows.
fn with_body(more: &str) -> String {
    format!("[[body]]\nname = \"a\"\nmass = 2\ninertia = [0.2, 0.3, 0.4]\n{more}")
}
