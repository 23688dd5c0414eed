//! What the unit tests of several of the host's crates share, which include this folder: elements that no library provides, and
//! scenes with them.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message
#![allow(dead_code, unused_imports)] // each crate takes what it needs

mod curves;
mod elements;
#[path = "../random.rs"]
mod random;
pub mod scenes;
mod signal_elements;
mod stored_elements;
mod troublesome_elements;

use curves::*;
use element_api::adapt::{control, force, joint};
use element_api::manifest::Library;
pub use elements::WELD_STEP;
use elements::*;
pub use random::Random;
use signal_elements::*;
use stored_elements::*;
use troublesome_elements::*;

use crate::catalog::Catalog;
use crate::diagnostics::Source;
use crate::scene::{Scene, parse};

/// The elements of the tests, as a crate would export them.
pub fn library(package: &str) -> Library {
    Library {
        package: package.into(),
        version: "1.0.0".into(),
        about: "foreign elements".into(),
        classes: vec![
            joint::<Hinge<false>>(),
            joint::<Hinge<true>>(),
            joint::<Screw<false>>(),
            joint::<Screw<true>>(),
            joint::<Ball>(),
            joint::<Slide>(),
            joint::<Weld>(),
            joint::<Drive>(),
            joint::<Forgetful>(),
            joint::<NoRows>(),
            force::<Strut<false>>(),
            force::<Strut<true>>(),
            force::<Friction>(),
            force::<Lag>(),
            force::<Relay>(),
            force::<Sill>(),
            force::<Drain>(),
            force::<Tally>(),
            force::<Echo>(),
            force::<Pull>(),
            force::<Early>(),
            joint::<Lead>(),
            force::<Panics>(),
            force::<Fails>(),
            force::<InMillimetres>(),
            force::<Push<false>>(),
            force::<Push<true>>(),
            force::<Rub<false>>(),
            force::<Rub<true>>(),
            force::<EndedSpring<DASHPOT>>(),
            force::<EndedSpring<CLOCK>>(),
            force::<EndedSpring<SIGNAL>>(),
            control::<Amplifier>(),
            control::<Smoother<false>>(),
            control::<Smoother<true>>(),
            control::<Follower>(),
        ],
    }
}

/// A catalog of the elements of the tests.
pub fn catalog() -> Catalog {
    let mut catalog = Catalog::new();
    catalog.add_library(library("foreign")).unwrap();
    catalog
}

/// A scene that must be readable; the section `[simulation]` is added unless it is there.
#[track_caller]
pub fn scene(text: &str) -> Scene {
    let simulation = if text.contains("[simulation]") { "" } else { "[simulation]\nt_end = 1\noutput_step = 0.1\n" };
    let source = Source::new("scene.toml", format!("{text}\n{simulation}"));
    parse(source, &[]).unwrap_or_else(|rejected| panic!("{:#?}", rejected.diagnostics)).0
}
