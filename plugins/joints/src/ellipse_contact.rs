//! Two discs, round or elliptic, touch in a plane: a cam and its roller, an eccentric, an ellipse on an ellipse. They slide on each
//! other without friction; they stay together, or may part and strike (`unilateral`).
//!
//! ## Equations
//!
//! The places of the contact are internal unknowns: the eccentric angles u on the first and v on the second ellipse. With
//! P_i = c_i + a_i cos u x_i + b_i sin u y_i, the outer normal N_i = b_i cos u x_i + a_i sin u y_i, the same for j with v, and Q the centre of
//! the second ellipse where it touches the first at u, Q = P_i + (a_j^2 n_x x_j + b_j^2 n_y y_j) / sqrt(a_j^2 n_x^2 + b_j^2 n_y^2) with the
//! parts n_x = N_i . x_j and n_y = N_i . y_j (Haug 1989, section 3.4; Pfeiffer & Glocker 1996, chapter 4):
//!
//! | condition: the angle, -pi to pi about z_i, is zero | |
//! |---|---|
//! | offset | from c_j - c_i to Q - c_i |
//! | common tangent | from -N_i to N_j |
//!
//! | row | equation | |
//! |---|---|---|
//! | gap | N_i . (P_j - P_i) / abs(N_i) = 0, or >= 0 with `unilateral` | |
//!
//! The centres Q are a convex curve around c_i that every ray from there meets once: for every c_j there is one pair of places, and the row has the
//! sign of the distance, however far apart the discs are. Where they touch it is the distance.
//!
//! Other joints hold the bodies in the plane (`planar`, revolutes and guides with parallel axes): this one only keeps the discs
//! together.
//!
//! ## Signs
//!
//! `u` and `v` are the eccentric angles, in radians, seen in the frames' x-y planes. The reaction force on body `j` is along the normal of
//! the first disc, positive outwards.
//!
//! ## Singular cases
//!
//! The places are found from any `start_i` and `start_j`; these choose no more than the turns in which u and v are counted. Discs with one
//! centre have no sides. Discs that never part may also run in each other: where the centre of one lies inside the larger other one, the smaller
//! touches from inside, with N_i for -N_i, and the sum of Q a difference, if it fits everywhere as they are turned: a round one if its radius is at
//! most b^2 / a of the half axes a >= b around it. One that does not fit has no place in the other one: the scene is refused, or the run ends, and
//! the message names the joint and its unknown `u`. A disc without size has no tangent.
//!
//! ## Example
//!
//! ```toml
//! [plugins]
//! libraries = ["odyn-joints"]
//!
//! [simulation]
//! gravity = [0, 0, 0]
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
//! position = [0.15, 0, 0]
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
//! type = "ellipse-contact"
//! bodies = ["cam", "follower"]
//! points = [[0, 0, 0], [0.15, 0, 0]]
//! params.a_i = 0.1
//! params.b_i = 0.08
//! params.a_j = 0.05
//! params.b_j = 0.05
//!
//! [[output]]
//! name = "lift"
//! quantity = "position"
//! of = "follower"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::profile::turned;

/// The joint.
#[derive(Debug, Clone, Copy)]
pub struct EllipseContact(EllipseContactParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Copy, Parameters)]
pub struct EllipseContactParameters {
    /// Half axis of the first ellipse along x of its frame.
    #[param(unit = "m", above = 0.0)]
    pub a_i: f64,
    /// Half axis of the first ellipse along y of its frame.
    #[param(unit = "m", above = 0.0)]
    pub b_i: f64,
    /// Half axis of the second ellipse along x of its frame.
    #[param(unit = "m", above = 0.0)]
    pub a_j: f64,
    /// Half axis of the second ellipse along y of its frame.
    #[param(unit = "m", above = 0.0)]
    pub b_j: f64,
    /// Eccentric angle on the first ellipse from which the contact is looked for at the start; it is found from any.
    #[param(unit = "rad", default = 0.0)]
    pub start_i: f64,
    /// The same on the second ellipse.
    #[param(unit = "rad", default = std::f64::consts::PI)]
    pub start_j: f64,
    /// The discs may part; where they come together they strike.
    #[param(default = false)]
    pub unilateral: bool,
    /// Coefficient of restitution of a unilateral contact, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

/// A place on an ellipse: the point, the outer normal, not of length one.
struct Place<S> {
    point: Vec3<S>,
    normal: Vec3<S>,
}

fn place<S: Scalar>(frame: &Frame<S>, a: f64, b: f64, angle: S) -> Place<S> {
    let (sin, cos) = (angle.sin(), angle.cos());
    let (x, y) = (frame.x(), frame.y());
    Place { point: frame.position + x * (cos * a) + y * (sin * b), normal: x * (cos * b) + y * (sin * a) }
}

/// From the centre of an ellipse to where its outer normal has this direction.
fn towards<S: Scalar>(frame: &Frame<S>, a: f64, b: f64, normal: Vec3<S>) -> Vec3<S> {
    let (x, y) = (frame.x() * S::from(a), frame.y() * S::from(b));
    let parts = (x.dot(&normal), y.dot(&normal));
    (x * parts.0 + y * parts.1) / (parts.0 * parts.0 + parts.1 * parts.1).sqrt()
}

impl EllipseContact {
    fn places<S: Scalar>(&self, frames: &[Frame<S>], unknowns: &[S]) -> [Place<S>; 2] {
        let p = &self.0;
        [place(&frames[0], p.a_i, p.b_i, unknowns[0]), place(&frames[1], p.a_j, p.b_j, unknowns[1])]
    }

    /// 1 where the discs touch from outside, -1 where the smaller runs in the larger one, no number where it does not fit into it as they
    /// are turned.
    fn side<S: Scalar>(&self, i: &Frame<S>, j: &Frame<S>) -> S {
        let p = &self.0;
        if p.unilateral {
            return S::one();
        }
        let (on_i, on_j) = ((i, p.a_i, p.b_i), (j, p.a_j, p.b_j));
        let ((larger, a, b), smaller) = if p.a_i.max(p.b_i) > p.a_j.max(p.b_j) { (on_i, on_j) } else { (on_j, on_i) };
        let between = j.position - i.position;
        let (x, y) = (larger.x().dot(&between) / a, larger.y().dot(&between) / b);
        let within = x * x + y * y;
        // Where it does not fit, a root of what is negative.
        let from_inside = match Room::of((smaller.1, smaller.2), (a, b)) {
            Room::Always => S::from(-1.0),
            Room::Never => (within - 1.0).sqrt(),
            Room::Turned { most, product } => {
                let (cos, sin) = (larger.x().dot(&smaller.0.x()), larger.x().dot(&smaller.0.y()));
                let room = S::from(most) - (sin * sin - cos * cos) * product;
                select(room.below(0.0), room.sqrt(), S::from(-1.0))
            }
        };
        select(within.below(1.0), from_inside, S::one())
    }
}

/// Whether an ellipse fits everywhere into another one: where it touches with any normal n, its radius of curvature a^2 b^2 / q^(3/2) with
/// q = a^2 n_x^2 + b^2 n_y^2 must not be above the other one's (Blaschke, Kreis und Kugel (1916), section 24).
enum Room {
    Always,
    Never,
    /// Where `product` times the cosine of twice the angle between the x axes is at least -`most`.
    Turned {
        most: f64,
        product: f64,
    },
}

impl Room {
    /// Of the one with these half axes in the other. With t = (a b)^(4/3) of it over that of the other, q - t q_other must be negative
    /// for no n: a quadratic form, whose mean is above the length of what turns in it, the difference of two parts with an angle between.
    fn of(inner: (f64, f64), outer: (f64, f64)) -> Self {
        let t = (inner.0 * inner.1 / (outer.0 * outer.1)).powf(4.0 / 3.0);
        let halves = |(a, b): (f64, f64)| (0.5 * (a * a + b * b), 0.5 * (a * a - b * b));
        let ((mean, part), (other_mean, other_part)) = (halves(inner), halves(outer));
        let (mean, other_part) = (mean - t * other_mean, t * other_part);
        if mean < (part.abs() - other_part.abs()).abs() {
            Self::Never
        } else if mean >= part.abs() + other_part.abs() {
            Self::Always
        } else {
            let most = mean * mean - part * part - other_part * other_part;
            Self::Turned { most, product: 2.0 * part * other_part }
        }
    }
}

impl Element for EllipseContact {
    const NAME: &'static str = "ellipse-contact";
    const SUMMARY: &'static str = "two discs, round or elliptic, touch and slide on each other";
    const DOC: &'static str = doc_of(include_str!("ellipse_contact.rs"));
    const GLYPH: &'static str = "none";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new(
            "i",
            "on the first body; its origin is the centre of the first ellipse, its z axis the normal of the plane",
        ),
        FrameSpec::new("j", "on the second body; its origin is the centre of the second ellipse"),
    ];
    const UNKNOWNS: &'static [ChannelSpec] = &[
        ChannelSpec::new("u", "rad", "eccentric angle of the contact on the first ellipse"),
        ChannelSpec::new("v", "rad", "eccentric angle of the contact on the second ellipse"),
    ];
    type Parameters = EllipseContactParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }

    fn initial_unknowns(&self) -> Vec<f64> {
        vec![self.0.start_i, self.0.start_j]
    }

    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let [on_i, on_j] = self.places(at.frames(), at.unknowns());
        let side = self.side(i, j);
        let touching = on_i.point - i.position + towards(j, self.0.a_j, self.0.b_j, on_i.normal) * side;
        out.push(turned(i.z(), j.position - i.position, touching));
        out.push(turned(i.z(), -on_i.normal * side, on_j.normal));
    }
}

impl Constraint for EllipseContact {
    const ROWS: &'static [&'static str] = &["gap"];
    const COORDINATES: &'static [ChannelSpec] = Self::UNKNOWNS;

    fn unilateral(&self, _: usize) -> Option<f64> {
        self.0.unilateral.then_some(self.0.restitution)
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let [i, j] = self.places(at.frames(), at.unknowns());
        rows.push(i.normal.dot(&(j.point - i.point)) / i.normal.dot(&i.normal).sqrt());
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        at.unknowns().iter().for_each(|angle| out.push(*angle));
    }
}
