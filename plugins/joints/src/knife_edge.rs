//! A point of the second body moves over the first only along its blade: a skate, a sled, the wheel of a cart seen from above.
//!
//! ## Equations
//!
//! A row on velocities, which leaves positions free (Haug 1989, section 11.6; Neimark & Fufaev 1972). With d = p_j - p_i:
//!
//! | row | equation |
//! |---|---|
//! | across | z_j . (v_j - v_i - omega_i x d) = 0 |
//!
//! ## Signs
//!
//! z_j is the direction across the blade. The reaction force on body `j` is along z_j, at the origin of its frame; it does no work.
//!
//! ## Singular cases
//!
//! None by itself. Blades of one body that cross each other's lines leave it less than they seem to.
//!
//! ## Example
//!
//! A skater that turns while gliding, on a plane:
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 0.1
//! output_step = 0.05
//!
//! [[body]]
//! name = "skater"
//! mass = 70
//! inertia = [10, 10, 2]
//! velocity = [3, 0, 0]
//! angular_velocity = [0, 0, 1]
//!
//! [[joint]]
//! name = "ice"
//! type = "planar"
//! bodies = ["ground", "skater"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "skate"
//! type = "knife-edge"
//! bodies = ["ground", "skater"]
//! point = [0, 0, 0]
//! axis = [0, 1, 0]
//!
//! [[output]]
//! name = "side_force"
//! quantity = "reaction_force"
//! of = "skate"
//! on = "skater"
//! component = "y"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct KnifeEdge;

impl Element for KnifeEdge {
    const NAME: &'static str = "knife-edge";
    const SUMMARY: &'static str = "a point of the second body does not move across its blade";
    const DOC: &'static str = doc_of(include_str!("knife_edge.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body, which the blade runs on"),
        FrameSpec::new("j", "on the second body; its origin is the blade, its z axis points across"),
    ];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for KnifeEdge {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["across"];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let carried = at.twists[0].angular_velocity.cross(&(j.position - i.position));
        rows.push(j.z().dot(&(at.relative_velocity(0, 1) - carried)));
    }
}
