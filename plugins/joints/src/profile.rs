//! What contacts on a profile have in common: a plane curve that a scene gives, with its normal and its bend.

use element_api::Jet;
use element_api::prelude::*;

/// At so many places a profile is examined when the joint is made.
const PLACES: u32 = 3600;

/// A plane curve of the x-y plane of a frame, its material below or inside.
#[derive(Debug, Clone)]
pub enum Profile {
    /// Radius over the angle about z.
    Polar(Function),
    /// y over x.
    Graph(Function),
}

/// A place on a profile: the point, the outer normal, not of length one.
pub struct Place<S> {
    pub point: Vec3<S>,
    pub normal: Vec3<S>,
}

impl<S: Scalar> Place<S> {
    /// Where the centre of a round body of this radius is that touches here from outside.
    pub fn centre(&self, radius: f64) -> Vec3<S> {
        self.point + self.normal * (S::from(radius) / length(self.normal))
    }
}

/// The angle from one direction to another about `axis`, rad, in (-pi, pi]. As a condition it has one solution in a turn, where the product
/// across has two, and no place from which Newton's method does not lead to it while one of the directions turns with the unknown.
pub fn turned<S: Scalar>(axis: Vec3<S>, from: Vec3<S>, to: Vec3<S>) -> S {
    axis.dot(&from.cross(&to)).atan2(from.dot(&to))
}

impl Profile {
    pub fn place<S: Scalar>(&self, frame: &Frame<S>, at: S) -> Place<S> {
        let (x, y) = (frame.x(), frame.y());
        match self {
            Self::Polar(radius) => {
                let (sin, cos) = (at.sin(), at.cos());
                let (r, slope) = (radius.at(at), radius.slope(at));
                let (outwards, onwards) = (x * cos + y * sin, y * cos - x * sin);
                Place { point: frame.position + outwards * r, normal: outwards * r - onwards * slope }
            }
            Self::Graph(height) => {
                let (h, slope) = (height.at(at), height.slope(at));
                Place { point: frame.position + x * at + y * h, normal: y - x * slope }
            }
        }
    }

    /// Bend at a place, 1/m: positive where the profile bulges outwards (do Carmo, Differential Geometry of Curves and Surfaces,
    /// section 1-5).
    fn bend(&self, at: f64) -> f64 {
        let jet = |function: &Function| function.at(Jet::new(at, 1.0, 0.0));
        match self {
            Self::Polar(radius) => {
                let r = jet(radius);
                let squares = r.value * r.value + r.first * r.first;
                (squares + r.first * r.first - r.value * r.second) / (squares * squares.sqrt())
            }
            Self::Graph(height) => {
                let h = jet(height);
                -h.second / (1.0 + h.first * h.first).powf(1.5)
            }
        }
    }

    /// The place between two where it bulges least, and its bend there.
    pub fn least_bend(&self, from: f64, to: f64) -> (f64, f64) {
        let place = |k: u32| from + (to - from) * f64::from(k) / f64::from(PLACES);
        let bends = (0..=PLACES).map(|k| (place(k), self.bend(place(k))));
        bends.fold((from, f64::INFINITY), |least, one| if one.1 < least.1 { one } else { least })
    }
}

/// What is wrong with a profile that is not the same a turn later; else, where it is, its slope is not.
pub fn unlike_a_turn_later(degree: i32, jumps: bool) -> String {
    match jumps {
        true => "must repeat after a turn: give points over one turn with `periodic = true`".into(),
        false => format!(
            "has a kink at {degree} deg, where its slope is not what it is a turn later: round it off, or give points over one turn with \
             `periodic = true`"
        ),
    }
}
