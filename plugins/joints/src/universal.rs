//! A Hooke (Cardan) joint: a cross with two perpendicular pins, one in each body. Body `i` turns about z_i on the cross, the
//! cross carries body `j`, which turns about z_j.
//!
//! ## Equations
//!
//! With d = p_j - p_i (Haug 1989, section 9.4: three point rows, dot-1):
//!
//! | row | equation |
//! |---|---|
//! | x, y, z | A_i^T d = 0 |
//! | pins | z_i . z_j = 0 |
//!
//! Coordinates and pose, with P = [e_2 e_3 e_1] (z_j on x_i where both angles are zero):
//!
//! A_i^T A_j = R_z(angle_i) P R_z(angle_j)
//!
//! ## Signs
//!
//! The axes of the frames are the PINS, not the shafts: give them with `axes`, perpendicular to each other. `angle_i` turns the
//! cross against body `i`: from x_i to z_j about z_i. `angle_j` turns body `j` against the cross: from z_i to y_j about z_j.
//! Both count over many turns. An input shaft along z_s that turns by a and an output shaft bent by b turn as
//! tan(a_out) = tan(a) / cos(b) or tan(a) cos(b), depending on which pin is across the plane of the shafts at a = 0.
//!
//! ## Singular cases
//!
//! Parallel pins, as one `axis` for both frames gives, cannot be assembled: no small motion brings them nearer to perpendicular.
//! Otherwise none of its own. With shafts bent by 90 deg a drive line through it is locked or free: the whole mechanism is singular.
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
//! name = "arm"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, -0.5]
//! angular_velocity = [1, 2, 0]
//!
//! [[joint]]
//! name = "cross"
//! type = "universal"
//! bodies = ["ground", "arm"]
//! point = [0, 0, 0]
//! axes = [[1, 0, 0], [0, 1, 0]]
//!
//! [[output]]
//! name = "swing"
//! quantity = "coordinate"
//! of = "cross"
//! channel = "angle_j"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct Universal;

impl Element for Universal {
    const NAME: &'static str = "universal";
    const SUMMARY: &'static str = "Hooke joint: two perpendicular pins through a common point";
    const DOC: &'static str = doc_of(include_str!("universal.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its z axis is the pin in that body"),
        FrameSpec::new("j", "on the second body; its z axis is the pin in that body, perpendicular to the first"),
    ];
    const ANGLES: usize = 2;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Universal {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "pins"];
    const COORDINATES: &'static [ChannelSpec] = &[
        ChannelSpec::new("angle_i", "rad", "rotation of the cross about the first pin, counted over many turns"),
        ChannelSpec::new("angle_j", "rad", "rotation of the second body about its pin, counted over many turns"),
    ];
    const MOBILITY: Option<usize> = Some(2);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::coincident(i, j, rows);
        blocks::perpendicular(i.z(), j.z(), rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        out.push(at.angle(0, j.z().dot(&i.y()), j.z().dot(&i.x())));
        out.push(at.angle(1, i.z().dot(&j.x()), i.z().dot(&j.y())));
    }

    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        let (o, l) = (S::zero(), S::one());
        let pins = Mat3::new(o, o, l, l, o, o, o, l, o);
        let rotation = Pose::screw_z(q[0], o).rotation * pins * Pose::screw_z(q[1], o).rotation;
        Pose { rotation, ..Pose::identity() }
    }
}
