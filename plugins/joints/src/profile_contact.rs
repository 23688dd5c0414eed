//! A cam in contact with a follower: the profile of the first body, a closed plane curve given by its radius over the angle about z
//! (points of a file, or a function), touches a roller or a flat face on the second. The place of the contact is found, so that the
//! profile is that of the cam itself, not the path of a roller's centre. They stay in contact, or may part (`unilateral = true`). The
//! plane motion is held by other joints.
//!
//! ## Equations
//!
//! In the x-y plane of frame i, with the profile p(phi) = o_i + r(phi) (x_i cos phi + y_i sin phi), its outer
//! normal n across it; c the origin of frame j, R the radius of the roller, q = p + R n / abs(n) the centre of a roller that touches at phi, e the
//! x axis of frame j. The place phi is an internal unknown (Shabana, Zaazaa & Sugiyama, Railroad Vehicle Dynamics (2008), chapter 3; Norton, Cam
//! Design and Manufacturing Handbook, chapter 7):
//!
//! | | roller | flat face |
//! |---|---|---|
//! | condition: the angle, -pi to pi about z_i, is zero | from c - o_i to q - o_i | from e to n |
//! | row `gap` | n . (c - p) / abs(n) - R = 0 | e . (c - p) = 0 |
//!
//! The centres q are a closed curve around the pole that every ray from there meets once, since the roller fits into the profile: for every c
//! there is one place on its side of the pole, and the row has the sign of the distance, however far apart the bodies are. Where they touch
//! it is the distance. The normal of a convex profile points along e at one place, the nearest to the face. The far side of the cam
//! is no solution.
//!
//! With `unilateral` the row is positive while the bodies are apart and never negative; where it closes with a velocity they strike, with the
//! coefficient of restitution. There is no friction.
//!
//! ## Signs
//!
//! phi counts to the left about z_i, from x_i. The x axis of frame j points away from the cam across a flat face, whose origin lies on the
//! face. The row's reaction pushes the bodies apart. The coordinate `place` is phi.
//!
//! ## Singular cases
//!
//! A roller must fit into the profile: where this is hollow with a radius below R, or has an inner corner, the joint is refused, and so is a flat
//! face on a profile that is hollow anywhere: either would touch in two places. This is proved from bounds of the slope and its changes all
//! around; where it cannot be shown, the joint is refused, too. Outer corners are allowed, and an edge (R = 0) fits everywhere. The place is found from any `start`; it chooses no more than the turn in which `place` is
//! counted. A roller on the pole has no side. Points are joined by a cubic spline, so that forces are continuous; accelerations of a follower are no better than the second differences of the points: give many digits. `linear` and
//! `monotone` are refused.
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
//! output_step = 0.01
//!
//! [[body]]
//! name = "cam"
//! mass = 1.0
//! inertia = [0.001, 0.001, 0.002]
//! position = [0, 0, 0]
//!
//! [[body]]
//! name = "follower"
//! mass = 0.5
//! inertia = [0.001, 0.001, 0.001]
//! position = [0.07, 0, 0]
//!
//! [[joint]]
//! name = "motor"
//! type = "revolute"
//! bodies = ["ground", "cam"]
//! axis = [0, 0, 1]
//!
//! [[joint]]
//! name = "speed"
//! type = "rotation-driver"
//! bodies = ["ground", "cam"]
//! axis = [0, 0, 1]
//! params.angle = "30 * t"
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "follower"]
//! axis = [1, 0, 0]
//!
//! [[joint]]
//! name = "contact"
//! type = "profile-contact"
//! bodies = ["cam", "follower"]
//! points = [[0, 0, 0], [0.07, 0, 0]]
//! params.radius = "0.05 + 0.005 * cos(2 * phi)"
//! params.roller_radius = 0.015
//!
//! [[output]]
//! name = "lift"
//! quantity = "position"
//! of = "follower"
//! component = "x"
//! ```

use element_api::Jet;
use element_api::prelude::*;

use crate::profile::{Follower, Profile, turned, unlike_a_turn_later};

/// The joint.
#[derive(Debug, Clone)]
pub struct ProfileContact {
    profile: Profile,
    /// Radius of the roller; `None`: a flat face.
    roller: Option<f64>,
    start: f64,
    restitution: Option<f64>,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct ProfileContactParameters {
    /// Radius of the profile over the angle about z; repeats after a turn.
    #[param(unit = "rad -> m", variable = "phi", example = Function::constant(0.05))]
    pub radius: Function,
    /// What runs on it.
    #[param(choices = ["roller", "flat"], default = "roller")]
    pub follower: String,
    /// Radius of the roller; 0: an edge.
    #[param(unit = "m", min = 0.0, example = 0.01)]
    pub roller_radius: Option<f64>,
    /// Angle on the profile from which the contact is looked for at the start; it is found from any.
    #[param(unit = "rad", default = 0.0)]
    pub start: f64,
    /// The bodies may part; where they come together they strike.
    #[param(default = false)]
    pub unilateral: bool,
    /// Coefficient of restitution of a unilateral contact, 0 to 1.
    #[param(min = 0.0, max = 1.0, default = 0.0)]
    pub restitution: f64,
}

impl ProfileContact {
    /// Across the flat face. Where the bodies never part, x of frame j may as well point at the cam, whose pole is inside.
    fn away_from_cam<S: Scalar>(&self, i: &Frame<S>, j: &Frame<S>) -> Vec3<S> {
        let x = j.x();
        match self.restitution {
            Some(_) => x,
            None => x * select(x.dot(&(j.position - i.position)).below(0.0), S::from(-1.0), S::one()),
        }
    }
}

impl Element for ProfileContact {
    const NAME: &'static str = "profile-contact";
    const SUMMARY: &'static str = "a roller or a flat face touches a cam whose closed profile is given";
    const DOC: &'static str = doc_of(include_str!("profile_contact.rs"));
    const GLYPH: &'static str = "none";
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "on the cam; its origin is the pole of the profile, its z axis the normal of the plane"),
        FrameSpec::new(
            "j",
            "on the follower; its origin is the roller's centre, or lies on the flat face, across which x points away from the cam",
        ),
    ];
    const UNKNOWNS: &'static [ChannelSpec] =
        &[ChannelSpec::new("place", "rad", "angle on the profile at which the bodies touch")];
    type Parameters = ProfileContactParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let refused = |name: &str, why: String| Err(ParamError::new(name, why));
        let radius = &p.radius;
        let at = |degree: i32| radius.at(Jet::new(f64::from(degree).to_radians(), 1.0, 0.0));
        if let Some(degree) = (0..360).find(|degree| !(at(*degree).value > 0.0 && at(*degree).value.is_finite())) {
            return refused("radius", format!("must be above zero, at {degree} deg it is {}", at(degree).value));
        }
        let turned = |degree: i32| [at(degree), at(degree + 360)];
        let unlike = |degree: &i32| {
            let [one, other] = turned(*degree);
            (one.value - other.value).abs().max((one.first - other.first).abs()) > 1e-6 * one.value
        };
        if let Some(degree) = (-180..180).find(unlike) {
            let [one, other] = turned(degree);
            return refused("radius", unlike_a_turn_later(degree, (one.value - other.value).abs() > 1e-6 * one.value));
        }
        let roller = match (p.follower.as_str(), p.roller_radius) {
            ("flat", None) => None,
            ("flat", Some(_)) => return refused("roller_radius", "does not apply to a flat face".into()),
            (_, None) => return refused("roller_radius", "is missing: a roller needs one (0: an edge)".into()),
            (_, roller) => roller,
        };
        let profile = Profile::Polar(p.radius);
        let follower = roller.map_or(Follower::Flat, Follower::Round);
        match (profile.misfit(follower, 0.0, std::f64::consts::TAU), roller) {
            (None, _) => {
                Ok(Self { profile, roller, start: p.start, restitution: p.unilateral.then_some(p.restitution) })
            }
            (Some(misfit), Some(roller)) => refused("roller_radius", misfit.round(roller, "the roller", "rad")),
            (Some(misfit), None) => refused("radius", misfit.flat()),
        }
    }

    fn initial_unknowns(&self) -> Vec<f64> {
        vec![self.start]
    }

    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let place = self.profile.place(i, at.unknowns()[0]);
        out.push(match self.roller {
            Some(roller) => turned(i.z(), j.position - i.position, place.centre(roller) - i.position),
            None => turned(i.z(), self.away_from_cam(i, j), place.normal),
        });
    }
}

impl Constraint for ProfileContact {
    const ROWS: &'static [&'static str] = &["gap"];
    const COORDINATES: &'static [ChannelSpec] = Self::UNKNOWNS;

    fn unilateral(&self, _: usize) -> Option<f64> {
        self.restitution
    }

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let place = self.profile.place(i, at.unknowns()[0]);
        let apart = j.position - place.point;
        rows.push(match self.roller {
            Some(roller) => place.normal.dot(&apart) / length(place.normal) - roller,
            None => j.x().dot(&apart),
        });
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.unknowns()[0]);
    }
}
