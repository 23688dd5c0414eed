//! What contacts on a profile have in common: a plane curve that a scene gives, with its normal and its bend.

use element_api::Jet;
use element_api::prelude::*;

use crate::enclosed::Enclosed;

/// At so many places a profile is looked at for the one where it bulges least.
const PLACES: u32 = 3600;
/// Stretches of a profile that are examined.
const MOST_STRETCHES: u32 = 100_000;
/// Stretches are halved down to this share of the profile.
const NARROWEST: f64 = 1.0 / (1 << 30) as f64;
/// A jump of the slope, rad, that is no kink.
const LEVEL: f64 = 1e-9;

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

    fn function(&self) -> &Function {
        let (Self::Polar(function) | Self::Graph(function)) = self;
        function
    }

    fn jet(&self, at: f64) -> Jet {
        self.function().at(Jet::new(at, 1.0, 0.0))
    }

    /// Bend, 1/m, of a profile with this value and these derivatives: positive where it bulges outwards (do Carmo, Differential Geometry of
    /// Curves and Surfaces, section 1-5).
    fn bend(&self, at: Jet) -> f64 {
        match self {
            Self::Polar(_) => {
                let squares = at.value * at.value + at.first * at.first;
                (squares + at.first * at.first - at.value * at.second) / (squares * squares.sqrt())
            }
            Self::Graph(_) => -at.second / (1.0 + at.first * at.first).powf(1.5),
        }
    }

    /// The place between two where it bulges least, of those that are looked at, and its bend there.
    fn least_bend(&self, from: f64, to: f64) -> (f64, f64) {
        let place = |k: u32| from + (to - from) * f64::from(k) / f64::from(PLACES);
        let bends = (0..=PLACES).map(|k| (place(k), self.bend(self.jet(place(k)))));
        bends.fold((from, f64::INFINITY), |least, one| if one.1 < least.1 { one } else { least })
    }

    /// Where and why this follower does not touch the profile in one place alone, if there is such a place between `from` and `to`.
    ///
    /// A stretch on which bounds of the derivatives say that the follower fits is done with; others are halved. Kinks are found so, and
    /// what lies between any places that could be looked at.
    pub fn misfit(&self, follower: Follower, from: f64, to: f64) -> Option<Misfit> {
        if follower == Follower::Round(0.0) {
            return None;
        }
        let hollow = |(place, bend): (f64, f64)| (!follower.fits(bend)).then_some(Misfit::Hollow { place, bend });
        let looked_at = hollow(self.least_bend(from, to));
        if looked_at.is_some() {
            return looked_at;
        }
        let narrow = (to - from) * NARROWEST;
        // A kink where a turn begins lies within where it ends.
        let beyond = match self {
            Self::Polar(_) => 0.001 * (to - from),
            Self::Graph(_) => 0.0,
        };
        let mut stretches = vec![(from, to + beyond)];
        let mut examined = 0;
        while let Some((low, high)) = stretches.pop() {
            examined += 1;
            if self.surely_fits(follower, low, high) {
                continue;
            }
            let middle = 0.5 * (low + high);
            let in_the_middle = hollow((middle, self.bend(self.jet(middle))));
            if in_the_middle.is_some() {
                return hollow(self.least_bend(low, high)).or(in_the_middle);
            }
            if high - low <= narrow {
                // A graph has no slope beyond its ends.
                let sides = match self {
                    Self::Polar(_) => [low - narrow, high + narrow],
                    Self::Graph(_) => [(low - narrow).max(from + 0.1 * narrow), (high + narrow).min(to - 0.1 * narrow)],
                };
                if !follower.fits(self.bend_between(sides)) {
                    return Some(Misfit::Kink { place: middle });
                }
                if self.on(low, high).value.is_bounded() {
                    continue;
                }
            }
            if high - low <= narrow || examined >= MOST_STRETCHES {
                return Some(Misfit::Unknown { place: middle });
            }
            stretches.extend([(middle, high), (low, middle)]);
        }
        None
    }

    /// Bounds on a stretch.
    fn on(&self, low: f64, high: f64) -> Enclosed {
        self.function().at(Enclosed::variable(low, high))
    }

    /// The bend that the slopes at two places next to each other make between them.
    fn bend_between(&self, sides: [f64; 2]) -> f64 {
        let [before, after] = sides.map(|side| self.jet(side));
        let first = if before.first * after.first > 0.0 { before.first } else { 0.0 };
        let second = (after.first - before.first) / (sides[1] - sides[0]);
        self.bend(Jet::new(before.value, first, second))
    }

    /// Whether bounds say that this follower fits all over a stretch.
    fn surely_fits(&self, follower: Follower, low: f64, high: f64) -> bool {
        let on = self.on(low, high);
        let (slope, second) = (on.first.smallest(), on.second.high);
        on.value.is_bounded()
            && match self {
                Self::Polar(_) => {
                    let r = on.value.low;
                    let squares = r * r + slope * slope;
                    let hollow = second * if second > 0.0 { on.value.high } else { r } - squares - slope * slope;
                    r > 0.0 && on.jump.high <= LEVEL * r && follower.has_room(hollow, squares * squares.sqrt())
                }
                Self::Graph(_) => on.jump.high <= LEVEL && follower.has_room(second, (1.0 + slope * slope).powf(1.5)),
            }
    }
}

/// What runs on a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Follower {
    /// A disc with this radius, m.
    Round(f64),
    Flat,
}

impl Follower {
    /// Whether it touches a profile with this bend in one place. True for no number.
    fn fits(self, bend: f64) -> bool {
        match self {
            Self::Round(radius) => radius * bend > -1.0 || bend.is_nan(),
            Self::Flat => bend > 0.0 || bend.is_nan(),
        }
    }

    /// Whether it fits where the profile is hollow with a bend of no more than `hollow / scale`.
    fn has_room(self, hollow: f64, scale: f64) -> bool {
        match self {
            Self::Round(radius) => radius * hollow < scale,
            Self::Flat => hollow < 0.0,
        }
    }
}

/// Why a follower does not fit a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Misfit {
    /// The profile has this bend, 1/m, there.
    Hollow { place: f64, bend: f64 },
    /// It has an inner corner, or jumps.
    Kink { place: f64 },
    /// It cannot be shown that it fits.
    Unknown { place: f64 },
}

impl Misfit {
    /// With its place as messages show it, without the sign of a zero.
    fn rounded(mut self) -> Self {
        let (Self::Hollow { place, .. } | Self::Kink { place } | Self::Unknown { place }) = &mut self;
        *place = (*place * 1e4).round() / 1e4 + 0.0;
        self
    }

    /// What is wrong under a flat face, in words that follow the profile's parameter.
    pub fn flat(self) -> String {
        match self.rounded() {
            Self::Hollow { place, .. } => {
                format!("is not convex at {place:.4} rad: a flat face touches such a profile in two places")
            }
            Self::Kink { place } => {
                format!("has an inner corner at {place:.4} rad: a flat face touches such a profile in two places")
            }
            Self::Unknown { place } => format!(
                "has no bounds near {place:.4} rad, or is too nearly straight: it cannot be shown that it is convex, as it must be under a \
                 flat face"
            ),
        }
    }

    /// What is wrong, in words that follow the parameter of the follower's size; `follower` with its article, `unit` that of a place.
    pub fn round(self, radius: f64, follower: &str, unit: &str) -> String {
        match self.rounded() {
            Self::Hollow { place, bend } => format!(
                "is {radius} m, but the profile is hollow with a radius of {:.4e} m at {place:.4} {unit}: {follower} does not reach its \
                 bottom and touches in two places",
                -1.0 / bend
            ),
            Self::Kink { place } => format!(
                "is {radius} m, but the profile has an inner corner at {place:.4} {unit}: {follower} touches both sides of it. Round it off \
                 with a radius above {radius} m"
            ),
            Self::Unknown { place } => format!(
                "is {radius} m, and it cannot be shown that {follower} fits into the profile, which has no bounds near {place:.4} {unit}, or is \
                 too long for its bends: give a shorter one, or a smaller radius"
            ),
        }
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
