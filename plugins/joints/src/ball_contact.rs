//! Two balls strike each other: they may touch and separate, and never overlap; they roll, slide and stick on each other. Or the second is in a
//! hollow ball of the first (`inside`): a ball in a bowl, a ball joint with clearance; in a plane a disc in a ring, a journal in a bearing.
//!
//! ## Equations
//!
//! One unilateral row: gap >= 0, normal force >= 0, one of them zero. With n the unit vector from p_i to p_j:
//!
//! | row | equation | |
//! |---|---|---|
//! | gap | abs(p_j - p_i) - r_i - r_j >= 0 | unilateral |
//! | gap, `inside` | (c - (p_j - p_i) . (p_j - p_i) / c) / 2 >= 0, c = r_i - r_j | unilateral |
//! | along s | s . (v_j + omega_j x (q - p_j) - v_i - omega_i x (q - p_i)) = 0 | while closed, if `rough`, or up to `mu` times the normal force |
//! | along t | t . (v_j + omega_j x (q - p_j) - v_i - omega_i x (q - p_i)) = 0 | likewise |
//!
//! `inside`, the gap is the distance of the surfaces where they are near each other, and half the clearance c where the centres coincide: it has
//! derivatives there too. So has n, which is (p_j - p_i) / c there: a unit vector where they touch.
//!
//! The contact is q = p_i + r_i n. Across a = (2, 3, 6) / 7 in frame i are (3, -6, 2) / 7 and (6, 2, -3) / 7: turned by the smallest
//! rotation that takes a to n these are s and t.
//!
//! Balls that approach with the velocity v separate with e v, e being the coefficient of restitution (Poisson's, as of
//! `plane-contact`, which is the same where nothing sticks). Where several contacts touch at the same time, impacts follow one another,
//! that which would take most energy by itself first and those that come as fast with it, until none approaches: as in a chain of
//! balls that touch, in which each strikes the next.
//!
//! With `mu` there is Coulomb friction, with the law of `plane-contact`: the contact sticks as long as that takes no more than mu times
//! the normal force, otherwise it slides against exactly that; the same for the impulses of an impact. With `rough` it does not slide
//! while it is closed, nor during an impact. Without either the contact is smooth.
//!
//! (Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996; Brogliato, Nonsmooth Mechanics, 2016.)
//!
//! ## Signs
//!
//! The reaction force on body `j` points from the centre of ball `i` to that of ball `j`, `inside` the other way round; its torque about the
//! centre is zero.
//!
//! ## Singular cases
//!
//! A scene in which the balls overlap at the start is refused. With friction, where
//! the centre of ball j comes to lie in the direction -a seen from frame i, s and t turn without bound: turn frame i.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! t_end = 0.5
//! output_step = 0.01
//!
//! [[body]]
//! name = "cue"
//! mass = 0.17
//! inertia = [5.6e-5, 5.6e-5, 5.6e-5]
//! velocity = [2, 0, 0]
//!
//! [[body]]
//! name = "object"
//! mass = 0.17
//! inertia = [5.6e-5, 5.6e-5, 5.6e-5]
//! position = [0.3, 0.02, 0]
//!
//! [[joint]]
//! name = "click"
//! type = "ball-contact"
//! bodies = ["cue", "object"]
//! frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
//! params.radius_i = "28.6 mm"
//! params.radius_j = "28.6 mm"
//! params.restitution = 0.95
//!
//! [[output]]
//! name = "vx"
//! quantity = "velocity"
//! of = "object"
//! component = "x"
//! ```

use element_api::prelude::*;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct BallContact(BallContactParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct BallContactParameters {
    /// Radius of the ball of the first body; `inside`: of the hollow.
    #[param(unit = "m", above = 0.0)]
    pub radius_i: f64,
    /// Radius of the ball of the second body; 0: a point.
    #[param(unit = "m", min = 0.0)]
    pub radius_j: f64,
    /// The ball of the second body is in a hollow of the first.
    #[param(default = false)]
    pub inside: bool,
    /// Coefficient of restitution, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
    /// The contact does not slide while it is closed.
    #[param(default = false)]
    pub rough: bool,
    /// Coefficient of friction; not given: smooth, or `rough`.
    #[param(min = 0.0, example = 0.3)]
    pub mu: Option<f64>,
}

/// a, and two axes across it: in no directions in which somebody lays out balls.
const AXES: [[f64; 3]; 3] =
    [[2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0], [3.0 / 7.0, -6.0 / 7.0, 2.0 / 7.0], [6.0 / 7.0, 2.0 / 7.0, -3.0 / 7.0]];

impl Element for BallContact {
    const NAME: &'static str = "ball-contact";
    const SUMMARY: &'static str = "two balls, or one in a hollow, strike each other, stick or slide, with restitution";
    const DOC: &'static str = doc_of(include_str!("ball_contact.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the first body; its origin is the centre of the first ball or hollow"),
        FrameSpec::new("j", "on the second body; its origin is the centre of the second ball"),
    ];
    type Parameters = BallContactParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if p.rough && p.mu.is_some() {
            return Err(ParamError::new("mu", "a `rough` contact does not slide: leave out one of the two"));
        }
        if p.inside && p.radius_j >= p.radius_i {
            return Err(ParamError::new(
                "radius_j",
                "what is `inside` is smaller than the hollow: less than `radius_i`",
            ));
        }
        Ok(Self(p))
    }
}

impl Constraint for BallContact {
    const ROWS: &'static [&'static str] = &["gap"];
    const VELOCITY_ROWS: &'static [&'static str] = &["along s", "along t"];

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
        let apart = at.frames[1].position - at.frames[0].position;
        if self.0.inside {
            let clearance = self.0.radius_i - self.0.radius_j;
            rows.push((-apart.dot(&apart) / clearance + clearance) * 0.5);
        } else {
            rows.push(length(apart) - self.0.radius_i - self.0.radius_j);
        }
    }

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let apart = j.position - i.position;
        // `inside`, a unit vector where they touch, and defined where the centres coincide.
        let n = apart / if self.0.inside { S::from(self.0.radius_i - self.0.radius_j) } else { length(apart) };
        let slip = at.relative_velocity_at(0, 1, i.position + n * S::from(self.0.radius_i));
        let [a, s, t] = AXES.map(|axis| i.rotation * Vec3::from(axis.map(S::from)));
        // The smallest rotation from a to n, of what is across a: x - (a + n) (n . x) / (1 + a . n).
        for x in [s, t] {
            let turned = x - (a + n) * (n.dot(&x) / (a.dot(&n) + 1.0));
            rows.push(turned.dot(&slip));
        }
    }
}
