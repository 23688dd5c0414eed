//! A ball, a point or an ellipsoid strikes a plane of the first body and rests on it: it may leave, and never goes through.
//!
//! ## Equations
//!
//! One unilateral row: gap >= 0, normal force >= 0, one of them zero. With d = p_j - p_i, the radius r and, of an ellipsoid, the matrix A of its
//! half axes along the axes of frame j (diagonal there; zero for a ball), e leads from the centre to the contact:
//!
//! e = -r z_i - A A z_i / h, h = abs(A z_i)
//!
//! | row | equation | |
//! |---|---|---|
//! | gap | z_i . (d + e) >= 0 | unilateral |
//! | along x | x_i . (v_j + omega_j x e - v_i - omega_i x (d + e)) = 0 | while closed, if `rough`, or up to `mu` times the normal force |
//! | along y | y_i . (v_j + omega_j x e - v_i - omega_i x (d + e)) = 0 | likewise |
//!
//! h is how far the ellipsoid reaches towards the plane. With `radius` as well it is thicker by that all around: a coin with a round rim has half axes of
//! its radius, its radius and next to nothing, and the radius of its rim. What strikes with the normal velocity -v leaves with e v, e being the
//! coefficient of restitution (Poisson's: e is the share of the impulse of compression that is given back, which is the same where
//! nothing sticks). When what is left of its bouncing is lower than the tolerance of the run, it stays. The contact opens
//! when the plane would have to pull.
//!
//! With `mu` there is Coulomb friction: the contact point sticks as long as that takes no more than mu times the normal force, in any
//! direction of the plane; where it would take more it slides, with exactly mu times the normal force against its velocity, until that is
//! zero. Steps end where it begins to slide and to stick (`events.csv`). What sticks does not creep, and what rolls rolls exactly. In an
//! impact the same law holds for the impulses and the velocities afterwards: that of friction is against the sliding that is left, if
//! any is, and then mu times the normal impulse. Should this gain energy, less of the normal impulse is given back.
//!
//! With `rough` the contact point does not slide while it is closed, nor during an impact: the limit of much friction. Where a ball
//! rests on the plane at the start, velocities that the scene leaves open are found so that it rolls; given ones that slide are ended by an
//! impulse, an impact in `events.csv`. Without either the contact is smooth; `contact-friction` takes its reaction and adds sliding friction
//! of other laws.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996; Brogliato, Nonsmooth Mechanics, 2016.)
//!
//! ## Signs
//!
//! The ball is on the side of the plane that z_i points to. The reaction force on body `j` is that at the contact, positive along
//! z_i; its torque is about the origin of frame `j`, the centre: the force of an ellipsoid has an arm there.
//!
//! ## Singular cases
//!
//! A scene in which the ball starts inside the plane is refused. Half axes that differ by many decades make the contact travel as fast as
//! edges do: steps become short where it passes from side to side. More contacts of one body than it has freedoms share its
//! weight in a way that is not determined; then as many as are needed carry it. The same of friction: what is not determined is shared
//! such that all contacts stick, if there is a way to, and so are normal forces with it where only then nothing slides that does not move.
//!
//! A `rough` contact may have no solution: in order not to slide it would have to pull, and if it slid it would be pressed (a rod thrown
//! flat onto a floor, its point ahead). The run stops and says so; with `mu` it slides.
//!
//! Where friction presses what slides into the plane the more, the more it is pressed, there may be no normal force, or several
//! (Painleve's paradox): the run stops and says so.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, -9.81]
//! t_end = 1
//! output_step = 0.01
//!
//! [[body]]
//! name = "ball"
//! mass = 0.1
//! inertia = [4e-5, 4e-5, 4e-5]
//! position = [0, 0, 1]
//!
//! [[joint]]
//! name = "floor"
//! type = "plane-contact"
//! bodies = ["ground", "ball"]
//! frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
//! params.radius = "3 cm"
//! params.restitution = 0.8
//!
//! [[output]]
//! name = "height"
//! quantity = "position"
//! of = "ball"
//! component = "z"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct PlaneContact(PlaneContactParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct PlaneContactParameters {
    /// Radius of the ball; 0: a point. Of an ellipsoid: how much thicker it is all around.
    #[param(unit = "m", min = 0.0, default = 0.0)]
    pub radius: f64,
    /// Half axes of an ellipsoid along x, y, z of frame j; not given: a ball.
    #[param(unit = "m", above = 0.0)]
    pub half_axes: Option<[f64; 3]>,
    /// Coefficient of restitution, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
    /// The contact point does not slide while it is closed.
    #[param(default = false)]
    pub rough: bool,
    /// Coefficient of friction; not given: smooth, or `rough`.
    #[param(min = 0.0, example = 0.3)]
    pub mu: Option<f64>,
}

impl Element for PlaneContact {
    const NAME: &'static str = "plane-contact";
    const SUMMARY: &'static str =
        "a ball or an ellipsoid strikes a plane, rests on it, sticks or slides, with restitution";
    const DOC: &'static str = doc_of(include_str!("plane_contact.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new(
            "i",
            "on the first body; its origin lies in the plane, its z axis is the normal towards the ball",
        ),
        FrameSpec::new(
            "j",
            "on the second body; its origin is the centre of the ball, its axes are those of the ellipsoid",
        ),
    ];
    type Parameters = PlaneContactParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if p.rough && p.mu.is_some() {
            return Err(ParamError::new("mu", "a `rough` contact does not slide: leave out one of the two"));
        }
        Ok(Self(p))
    }
}

impl Constraint for PlaneContact {
    const ROWS: &'static [&'static str] = &["gap"];
    const VELOCITY_ROWS: &'static [&'static str] = &["along x", "along y"];

    fn unilateral(&self, row: usize) -> Option<f64> {
        (row == 0).then_some(self.0.restitution)
    }

    fn sticks_with(&self, row: usize) -> Option<usize> {
        (row > 0).then_some(0)
    }

    fn uses_row(&self, row: usize) -> bool {
        row == 0 || self.0.rough || self.0.mu.is_some()
    }

    fn limit<S: Scalar>(&self, row: usize, _: &Motion<'_, S>) -> Option<S> {
        self.0.mu.filter(|_| row == 1).map(S::from)
    }

    fn slides_with(&self, row: usize) -> Option<usize> {
        (row == 1 && self.0.mu.is_some()).then_some(2)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let reach = self.half_axes_towards(i, j).map_or_else(S::zero, length);
        rows.push(blocks::displacement_along_z(i, j) - reach - self.0.radius);
    }

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let mut contact = j.position - i.z() * S::from(self.0.radius);
        if let (Some(towards), Some(half_axes)) = (self.half_axes_towards(i, j), self.0.half_axes) {
            let place = towards.component_mul(&Vec3::from(half_axes.map(S::from))) / length(towards);
            contact -= j.rotation * place;
        }
        let slip = at.relative_velocity_at(0, 1, contact);
        rows.push(i.x().dot(&slip));
        rows.push(i.y().dot(&slip));
    }
}

impl PlaneContact {
    /// A `z_i`, in axes of frame j.
    fn half_axes_towards<S: Scalar>(&self, i: &Frame<S>, j: &Frame<S>) -> Option<Vec3<S>> {
        self.0.half_axes.map(|half_axes| {
            let normal = j.rotation.transpose() * i.z();
            normal.component_mul(&Vec3::from(half_axes.map(S::from)))
        })
    }
}
