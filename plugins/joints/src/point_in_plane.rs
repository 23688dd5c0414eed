//! A point of the second body stays in a plane of the first, or at a given distance from it: a foot on a smooth floor, the
//! centre of a ball on a table.
//!
//! ## Equations
//!
//! With d = p_j - p_i and the distance h (Haug 1989, section 9.4: dot-2):
//!
//! | row | equation |
//! |---|---|
//! | z | z_i . d - h = 0 |
//!
//! ## Signs
//!
//! The plane goes through the origin of frame `i`, its normal is z_i; h is counted along z_i. The reaction force on body `j`
//! is along z_i, at the origin of its frame, and two-sided: the plane also pulls.
//!
//! ## Singular cases
//!
//! None.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 0.1
//! output_step = 0.05
//!
//! [[body]]
//! name = "foot"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0.2]
//! velocity = [1, 0, 0]
//!
//! [[joint]]
//! name = "floor"
//! type = "point-in-plane"
//! bodies = ["ground", "foot"]
//! axis = [0, 0, 1]
//! params.distance = "20 cm"
//!
//! [[output]]
//! name = "normal"
//! quantity = "reaction_force"
//! of = "floor"
//! on = "foot"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct PointInPlane(PointInPlaneParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct PointInPlaneParameters {
    /// Distance of the point from the plane, along the normal.
    #[param(unit = "m", default = 0.0)]
    pub distance: f64,
}

impl Element for PointInPlane {
    const NAME: &'static str = "point-in-plane";
    const SUMMARY: &'static str = "a point of the second body stays in a plane of the first";
    const DOC: &'static str = doc_of(include_str!("point_in_plane.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the normal of the plane, its origin lies in it"),
        FrameSpec::new("j", "on the second body; its origin is the point"),
    ];
    type Parameters = PointInPlaneParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for PointInPlane {
    const ROWS: &'static [&'static str] = &["z"];
    const MOBILITY: Option<usize> = Some(2);
    const TURNS_FREELY: bool = true;

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(blocks::displacement_along_z(&at.frames[0], &at.frames[1]) - self.0.distance);
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        let mut pose = Pose::identity();
        pose.position = Vec3::new(q[0], q[1], S::zero() + self.0.distance);
        pose
    }
}
