//! A03: Andrews' squeezer, whose seven bars follow from the angle q of the crank by three intersections of circles. Everything
//! carries its first two derivatives with respect to q.

use std::ops::{Add, Mul, Sub};

use super::Mechanism;

const TORQUE: f64 = 0.033;
const STIFFNESS: f64 = 4530.0;
const FREE_LENGTH: f64 = 0.07785;
const CRANK: f64 = 0.007;
const A: [f64; 2] = [-0.06934, -0.00227];
const B: [f64; 2] = [-0.03635, 0.03273];
const C: [f64; 2] = [0.014, 0.072];
/// End of the spring on the bar from B to E: along it and across.
const D: [f64; 2] = [0.018, 0.020];

pub fn mechanism() -> Mechanism {
    Mechanism {
        problem: "A03",
        start: [-0.062, 0.0],
        rate: 1500.0,
        acceleration,
        columns: &["Fx", "Fy", "Ex", "Ey", "Gx", "Gy", "Hx", "Hy"],
        measured: |q| {
            let Points { f, e, g, h } = points(q);
            [f, e, g, h].iter().flat_map(|point| [point.x.value, point.y.value]).collect()
        },
    }
}

/// A number with its first two derivatives.
#[derive(Clone, Copy)]
struct Jet {
    value: f64,
    first: f64,
    second: f64,
}

impl Jet {
    fn constant(value: f64) -> Self {
        Self { value, first: 0.0, second: 0.0 }
    }

    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        let first = 0.5 * self.first / value;
        Self { value, first, second: (0.5 * self.second - first * first) / value }
    }

    fn reciprocal(self) -> Self {
        let value = 1.0 / self.value;
        let first = -self.first * value * value;
        Self { value, first, second: -(self.second * value + 2.0 * self.first * first) * value }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self { value: self.value + b.value, first: self.first + b.first, second: self.second + b.second }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Self { value: self.value - b.value, first: self.first - b.first, second: self.second - b.second }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            first: self.first * b.value + self.value * b.first,
            second: self.second * b.value + 2.0 * self.first * b.first + self.value * b.second,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        Self { value: self.value * b, first: self.first * b, second: self.second * b }
    }
}

#[derive(Clone, Copy)]
struct Point {
    x: Jet,
    y: Jet,
}

impl Point {
    fn fixed([x, y]: [f64; 2]) -> Self {
        Self { x: Jet::constant(x), y: Jet::constant(y) }
    }

    fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }

    /// `along` times a direction from here, and `across` times the same turned by a quarter to the left.
    fn offset(self, direction: Self, along: Jet, across: Jet) -> Self {
        Self {
            x: self.x + direction.x * along - direction.y * across,
            y: self.y + direction.y * along + direction.x * across,
        }
    }

    /// The point at distances `r` from here and `s` from `other`, to the left of the way there, or (`side` -1) to the right.
    fn meeting(self, r: f64, other: Self, s: f64, side: f64) -> Self {
        let way = other.minus(self);
        let over = (way.x * way.x + way.y * way.y).reciprocal();
        let along = over * (0.5 * (r * r - s * s)) + Jet::constant(0.5);
        let across = (over * (r * r) - along * along).sqrt() * side;
        self.offset(way, along, across)
    }
}

struct Points {
    f: Point,
    e: Point,
    g: Point,
    h: Point,
}

fn points(q: f64) -> Points {
    let (sin, cos) = q.sin_cos();
    let f = Point {
        x: Jet { value: CRANK * cos, first: -CRANK * sin, second: -CRANK * cos },
        y: Jet { value: CRANK * sin, first: CRANK * cos, second: -CRANK * sin },
    };
    let e = f.meeting(0.028, Point::fixed(B), 0.035, 1.0);
    let g = Point::fixed(A).meeting(0.040, e, 0.020, 1.0);
    let h = Point::fixed(A).meeting(0.040, e, 0.020, -1.0);
    Points { f, e, g, h }
}

/// Share of a bar in the reduced inertia and in half its derivative: from its first point, towards its second.
fn bar(from: Point, to: Point, length: f64, mass: f64, inertia: f64, com: [f64; 2]) -> [f64; 2] {
    let way = to.minus(from);
    let direction = Point { x: way.x * (1.0 / length), y: way.y * (1.0 / length) };
    let c = from.offset(direction, Jet::constant(com[0]), Jet::constant(com[1]));
    let turn = |u: f64, v: f64| direction.x.value * v - direction.y.value * u;
    let (angle1, angle2) = (turn(direction.x.first, direction.y.first), turn(direction.x.second, direction.y.second));
    [
        mass * (c.x.first * c.x.first + c.y.first * c.y.first) + inertia * angle1 * angle1,
        mass * (c.x.first * c.x.second + c.y.first * c.y.second) + inertia * angle1 * angle2,
    ]
}

fn acceleration(q: f64, rate: f64) -> f64 {
    let Points { f, e, g, h } = points(q);
    let (a, b) = (Point::fixed(A), Point::fixed(B));
    let bars = [
        bar(Point::fixed([0.0, 0.0]), f, CRANK, 0.04325, 2.194e-6, [0.00092, 0.0]),
        bar(f, e, 0.028, 0.00365, 4.410e-7, [0.0115, 0.0]),
        bar(b, e, 0.035, 0.02373, 5.255e-6, [0.01874, 0.01043]),
        bar(g, e, 0.020, 0.00706, 5.667e-7, [0.00579, 0.0]),
        bar(a, g, 0.040, 0.07050, 1.169e-5, [0.02308, 0.00916]),
        bar(h, e, 0.020, 0.00706, 5.667e-7, [0.00579, 0.0]),
        bar(a, h, 0.040, 0.05498, 1.912e-5, [0.01228, -0.00449]),
    ];
    let inertia: f64 = bars.iter().map(|bar| bar[0]).sum();
    let half_change: f64 = bars.iter().map(|bar| bar[1]).sum();
    let way = e.minus(b);
    let direction = Point { x: way.x * (1.0 / 0.035), y: way.y * (1.0 / 0.035) };
    let spring = b.offset(direction, Jet::constant(D[0]), Jet::constant(D[1])).minus(Point::fixed(C));
    let length = (spring.x * spring.x + spring.y * spring.y).sqrt();
    let force = STIFFNESS * (length.value - FREE_LENGTH);
    (TORQUE - force * length.first - half_change * rate * rate) / inertia
}
