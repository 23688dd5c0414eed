//! The contract between the O-DYN solver and the authors of its joints and forces.
//!
//! An author writes a parameter struct, the element's equations once, generic over [`Scalar`], and one line that exports
//! the library. No solver knowledge, no `unsafe`, no derivatives:
//!
//! ```
//! use element_api::prelude::*;
//!
//! /// Keeps two points at a fixed distance.
//! struct Rod {
//!     length: f64,
//! }
//!
//! #[derive(Parameters)]
//! struct RodParameters {
//!     /// Distance of the two points.
//!     #[param(unit = "m", above = 0.0)]
//!     length: f64,
//! }
//!
//! impl Element for Rod {
//!     const NAME: &'static str = "rod";
//!     const SUMMARY: &'static str = "massless rod between two points";
//!     const FRAMES: &'static [FrameSpec] =
//!         &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
//!     type Parameters = RodParameters;
//!     fn new(p: RodParameters) -> Result<Self, ParamError> {
//!         Ok(Self { length: p.length })
//!     }
//! }
//!
//! impl Constraint for Rod {
//!     const ROWS: &'static [&'static str] = &["distance"];
//!     fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
//!         let d = at.frames[1].position - at.frames[0].position;
//!         rows.push(length(d) - self.length);
//!     }
//! }
//! # fn main() { assert_eq!(element_api::adapt::joint::<Rod>().descriptor().rows.len(), 1); }
//! ```
//!
//! # Life of an element
//! | when | what is called | what it may do |
//! |---|---|---|
//! | describe | constants of the traits, [`Parameters::specs`] | nothing else exists yet |
//! | `[create]` | [`Element::new`] | anything; allocate, precompute, refuse parameters |
//! | `[record]` | `residual`, `wrench`, ... with the recording scalar, once per instance | no reading of values: equations switch with [`Scalar::select`] |
//! | run | nothing: the host runs the recorded equations | |
//! | `[hot]`, opaque elements only | the same functions with numbers, many times, also for steps that are rejected later | no change of memory |
//! | `[between steps]`, opaque elements only | [`Element::accept`], [`Element::save`], [`Element::load`] | memory changes only here |
//!
//! Instances belong to one model and one thread at a time; nothing is shared between models.
//!
#![doc = include_str!("../docs/notation.md")]

// The derive macro names this crate from outside.
#[cfg(test)]
extern crate self as element_api;

#[cfg(feature = "abi")]
pub mod abi;
pub mod adapt;
pub mod blocks;
pub mod curve;
pub mod descriptor;
pub mod documentation;
pub mod element;
mod export;
pub mod fence;
pub mod function;
pub mod geometry;
pub mod jet;
pub mod manifest;
mod motion;
pub mod params;
pub mod recorded;
pub mod recording;
pub mod scalar;
pub mod set;
mod slope;
mod specs;
pub mod surface;
pub mod table;
#[cfg(any(test, feature = "testkit"))]
pub mod testkit;
#[cfg(test)]
mod tests;

pub use curve::Curve;
pub use descriptor::{Descriptor, Kind, Named, NamedInput};
pub use documentation::doc_of;
pub use element::{
    ChannelSpec, Configuration, Constraint, Control, Element, Force, FrameSpec, InputSpec, Motion, Reaction, Rows,
    Values, Wrenches,
};
pub use element_api_derive::Parameters;
pub use function::Function;
pub use geometry::{Frame, Mat3, Pose, Twist, Vec3, length};
pub use jet::Jet;
pub use params::{NoParameters, ParamError, Parameters};
pub use recording::Recording;
pub use scalar::{Condition, Scalar, select};
pub use set::{ElementClass, ElementSet};
pub use surface::Surface;
pub use table::{Interpolation, Outside, Table};

/// `odyn_element.h`: the contract for elements in C.
pub const C_HEADER: &str = include_str!("../include/odyn_element.h");

/// Everything an element file needs: `use element_api::prelude::*;`
pub mod prelude {
    pub use crate::blocks;
    pub use crate::{
        ChannelSpec, Condition, Configuration, Constraint, Control, Curve, Element, Force, Frame, FrameSpec, Function,
        InputSpec, Interpolation, Mat3, Motion, NoParameters, Outside, ParamError, Parameters, Pose, Reaction, Rows,
        Scalar, Surface, Table, Twist, Values, Vec3, Wrenches, doc_of, length, select,
    };
}
