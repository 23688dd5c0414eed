//! [`Scales`]: lengths and speeds typical of a scene, so that no tolerance has a unit.

use crate::model::Model;

/// Share of the scene's size, or of the largest velocity that joints ask for, by which rows that depend on others may be off before
/// they contradict each other. In a sound scene they are off by round-off.
pub const CONTRADICTION: f64 = 1e-6;

/// Share of a scene's size below which an extent is round-off of places that are one.
const NO_EXTENT: f64 = 1e-12;

/// Moves in the whole time of a simulation that are none, in radians or lengths of the scene.
pub(super) const AT_REST: f64 = 1e-6;

/// Typical sizes, SI. They grow with the motion and never shrink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Size of the scene, m.
    pub length: f64,
    /// The same without the radii of gyration of bodies that cannot turn, m.
    pub extent: f64,
    /// Largest distance of a centre of mass from where a run began, so far, m; zero where `extent` is the size.
    pub way: f64,
    /// Largest distance of a centre of mass or marker from the origin of the ground frame, m: positions have its round-off.
    pub far: f64,
    /// Largest speed of a centre of mass so far, m/s.
    pub speed: f64,
    /// Largest angular velocity so far, rad/s.
    pub spin: f64,
    /// Largest kinetic energy so far, or change of potential energy, J.
    pub energy: f64,
}

impl Scales {
    /// The size of a scene: diagonal of the box around all centres of mass and markers, but for those on the ground whose place has no say,
    /// or the largest radius of gyration where that is larger. `working` is the assembled state.
    #[must_use]
    pub fn new(model: &Model, working: &[f64]) -> Self {
        let found = Self::where_turn(model, working, |_| true);
        let length = if found.length > 0.0 { found.length } else { 1.0 };
        Self { length, extent: length, ..found }
    }

    /// The same where only some bodies count by their radii of gyration; there may be no length.
    pub(super) fn where_turn(model: &Model, working: &[f64], turns: impl Fn(usize) -> bool) -> Self {
        let mut points = Vec::new();
        let mut length = 0.0_f64;
        let pose = |body: usize| {
            let y = &working[13 * body..13 * body + 7];
            (nalgebra::Vector3::new(y[0], y[1], y[2]), crate::model::rotation(&[y[3], y[4], y[5], y[6]]))
        };
        for (index, body) in model.bodies.iter().enumerate() {
            points.push(pose(index).0);
            if turns(index) {
                length = length.max(body.gyration());
            }
        }
        for element in &model.elements {
            for (frame, marker) in element.markers.iter().enumerate() {
                match marker.body {
                    Some(body) => {
                        let (r, a) = pose(body);
                        points.push(r + a * marker.position);
                    }
                    None if element.depends_on_place(frame) => points.push(marker.position),
                    None => {}
                }
            }
        }
        if let Some(first) = points.first() {
            let low = points.iter().fold(*first, |m, p| m.inf(p));
            let high = points.iter().fold(*first, |m, p| m.sup(p));
            length = length.max((high - low).norm());
        }
        let far = points.iter().map(nalgebra::Vector3::norm).fold(0.0, f64::max);
        Self { length, extent: length, way: 0.0, far, speed: 0.0, spin: 0.0, energy: 0.0 }
    }

    /// Takes note of the size without what cannot turn, unless nothing is left of it.
    pub(super) fn without_still(&mut self, others: &Self) {
        if others.length > NO_EXTENT * self.length {
            self.extent = others.length.min(self.length);
        }
    }

    /// Takes in the velocities of a working state.
    pub fn grow(&mut self, working: &[f64], bodies: usize) {
        let norm = |v: &[f64]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        for body in 0..bodies {
            let y = &working[13 * body..13 * (body + 1)];
            self.speed = self.speed.max(norm(&y[7..10]));
            self.spin = self.spin.max(norm(&y[10..13]));
        }
    }

    /// Takes in velocities of bodies, six each; gives the largest angular velocity among them, rad/s.
    pub fn grow_to(&mut self, velocities: &[f64]) -> f64 {
        let norm = |v: &[f64]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        let mut fastest = 0.0_f64;
        for body in velocities.chunks_exact(6) {
            self.speed = self.speed.max(norm(&body[..3]));
            fastest = fastest.max(norm(&body[3..]));
        }
        self.spin = self.spin.max(fastest);
        fastest
    }

    /// Takes in the accelerations at the start (six per body): a scene that starts at rest will reach speeds of about
    /// sqrt(a L) and spins of about sqrt(alpha).
    pub fn anticipate(&mut self, accelerations: &[f64]) {
        let norm = |v: &[f64]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        for a in accelerations.chunks_exact(6) {
            self.speed = self.speed.max((norm(&a[..3]) * self.length_scale()).sqrt());
            self.spin = self.spin.max(norm(&a[3..]).sqrt());
        }
    }

    /// Takes in the slowest motion that counts in a time (s): one that moves by a millionth of the scene's size. Where nothing
    /// moves, what round-off makes of speeds would otherwise be resolved to the tolerance.
    pub fn anticipate_rest(&mut self, duration: f64) {
        let slowest = self.rest_speed(duration);
        self.speed = self.speed.max(slowest);
        self.spin = self.spin.max(slowest / self.length);
    }

    /// The slowest motion that counts in a time (s), m/s.
    #[must_use]
    pub fn rest_speed(&self, duration: f64) -> f64 {
        let slowest = AT_REST / duration * self.length_scale();
        if slowest.is_finite() { slowest } else { 0.0 }
    }

    /// Takes in the sizes of other parts of the same scene.
    pub fn widen(&mut self, other: &Self) {
        self.length = self.length.max(other.length);
        self.extent = self.extent.max(other.extent);
        self.way = self.way.max(other.way);
        self.far = self.far.max(other.far);
        self.speed = self.speed.max(other.speed);
        self.spin = self.spin.max(other.spin);
        self.energy = self.energy.max(other.energy);
    }

    /// Length to compare errors of positions with, m. A body that cannot turn is no larger for them than its way, whatever its moments of
    /// inertia.
    #[must_use]
    pub fn length_scale(&self) -> f64 {
        self.extent.max(self.way.min(self.length))
    }

    /// Speed to compare velocity errors with, m/s: never below a thousandth of what the rotation alone would give.
    #[must_use]
    pub fn speed_scale(&self) -> f64 {
        positive(self.speed.max(1e-3 * self.spin * self.length))
    }

    /// Angular velocity to compare errors with, rad/s.
    #[must_use]
    pub fn spin_scale(&self) -> f64 {
        positive(self.spin.max(1e-3 * self.speed / self.length))
    }
}

/// A scene in which nothing moves has no speed; any scale does.
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 1.0 }
}
