//! A follower on a cam: a point of the second body (the centre of a roller, a pin in a groove) stays on a closed plane curve of
//! the first, given by its radius over the angle about z.
//!
//! ## Equations
//!
//! With (x, y, z) = A_i^T (p_j - p_i), r = sqrt(x^2 + y^2), phi = atan2(y, x), and the radius R(phi), which repeats after a turn
//! (Haug 1989, section 3.4, point-follower, in polar coordinates):
//!
//! | row | equation |
//! |---|---|
//! | radius | r - R(phi) = 0 |
//! | z | z = 0 (left out with `planar = false`) |
//!
//! ## Signs
//!
//! `angle` is phi in (-pi, pi], seen on the cam: a cam that turns to the left lets the follower run through it backwards. The
//! reaction force on body `j` is along the normal of the curve, at the origin of its frame, and two-sided: the cam also pulls.
//! For a roller give the path of its centre.
//!
//! ## Singular cases
//!
//! The radius stays above zero. Points are joined by a cubic spline where `interpolation` says nothing else, so that forces are continuous; jerks are
//! not. With `monotone` the forces jump at the points; `linear` and `steps` are refused.
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
//! name = "cam"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0, 0, 0]
//! angular_velocity = [0, 0, 20]
//!
//! [[body]]
//! name = "follower"
//! mass = 1.0
//! inertia = [0.1, 0.1, 0.1]
//! position = [0.11, 0, 0]
//!
//! [[joint]]
//! name = "shaft"
//! type = "revolute"
//! bodies = ["ground", "cam"]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "follower"]
//! axis = [1, 0, 0]
//!
//! [[joint]]
//! name = "contact"
//! type = "cam"
//! bodies = ["cam", "follower"]
//! points = [[0, 0, 0], [0.11, 0, 0]]
//! params.radius = "0.1 + 0.01 cos(2 phi)"
//!
//! [[output]]
//! name = "lift"
//! quantity = "position"
//! of = "follower"
//! component = "x"
//! ```

use element_api::Jet;
use element_api::prelude::*;

use crate::profile::unlike_a_turn_later;

/// The joint.
#[derive(Debug, Clone)]
pub struct Cam(CamParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct CamParameters {
    /// Radius over the angle about z; repeats after a turn.
    #[param(unit = "rad -> m", variable = "phi")]
    pub radius: Function,
    /// The point is also held in the plane of the curve.
    #[param(default = true)]
    pub planar: bool,
}

impl Element for Cam {
    const NAME: &'static str = "cam";
    const SUMMARY: &'static str = "a point of the second body stays on a closed curve of the first, in polar form";
    const DOC: &'static str = doc_of(include_str!("cam.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the cam; its x-y plane is that of the curve, its origin the pole"),
        FrameSpec::new("j", "on the follower; its origin is the point"),
    ];
    type Parameters = CamParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let at = |degree: i32| p.radius.at(f64::from(degree).to_radians());
        if let Some(degree) = (-180..180).find(|degree| at(*degree) <= 0.0 || !at(*degree).is_finite()) {
            return Err(ParamError::new("radius", format!("must be above zero, at {degree} deg it is {}", at(degree))));
        }
        let slope = |angle: f64| p.radius.at(Jet::new(angle, 1.0, 0.0)).first;
        let (start, end) = (-std::f64::consts::PI, std::f64::consts::PI);
        let jumps = (at(-180) - at(180)).abs() > 1e-6 * at(180);
        if jumps || (slope(start) - slope(end)).abs() > 1e-6 * at(180) {
            return Err(ParamError::new("radius", unlike_a_turn_later(180, jumps)));
        }
        Ok(Self(p))
    }
}

impl Constraint for Cam {
    const ROWS: &'static [&'static str] = &["radius", "z"];
    const COORDINATES: &'static [ChannelSpec] =
        &[ChannelSpec::new("angle", "rad", "where the follower is on the cam, within half a turn")];

    fn uses_row(&self, row: usize) -> bool {
        row == 0 || self.0.planar
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let (x, y) = in_plane(i, j);
        rows.push((x * x + y * y).sqrt() - self.0.radius.at(y.atan2(x)));
        if self.0.planar {
            blocks::no_offset_along(i.z(), i, j, rows);
        }
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (x, y) = in_plane(&at.frames[0], &at.frames[1]);
        out.push(y.atan2(x));
    }
}

fn in_plane<S: Scalar>(i: &Frame<S>, j: &Frame<S>) -> (S, S) {
    let d = j.position - i.position;
    (i.x().dot(&d), i.y().dot(&d))
}
