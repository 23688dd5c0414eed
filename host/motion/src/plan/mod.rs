//! What has to be computed, and what not: decided once, stored as data, shown to the user.
//!
//! - **Takes**: a [`crate::model::Model`]; the constraint Jacobian at the assembled position.
//! - **Gives**: [`Layout`] (where every number lies) and [`Plan`] (independent rows, unique reactions, what depends on others, engine, what is
//!   skipped and why); how pictures show a joint.
//! - **May touch**: linear algebra for ranks.
//! - **Must not know**: integrators, values of the coordinates at run time, how the Jacobian was computed.

mod axes;
mod coordinates;
mod decide;
mod glyph;
mod layout;
mod led;
mod locked;
mod pruning;
mod topology;
mod tree;
mod undetermined;

#[cfg(test)]
mod tests;

pub use axes::Crosswise;
pub use coordinates::{Coordinates, Line, Measure, Rotation, body_scales};
pub use decide::{
    ACCURATE_REFINED, Determinacy, Plan, Probe, Reaction, RedundantRow, close_to_dependent, poses_of_bodies,
};
pub use glyph::Place;
pub use layout::{BODY_SLOTS, Layout};
pub use led::Led;
pub(crate) use locked::holds_always;
pub use locked::{Askew, Locked};
pub use pruning::{Pruning, SAVINGS};
pub use topology::{Island, Topology};
pub use tree::{Follower, SpanningTree, TreeJoint};
pub use undetermined::Undetermined;
