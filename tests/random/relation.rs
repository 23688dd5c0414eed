//! [`Relation`]: how the frames of a joint may stand and move against each other, for every joint.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::numbers::Random;

type V = Vector3<f64>;
type M = Matrix3<f64>;

/// How frame j of a joint stands and moves against frame i, in the axes of frame i.
pub struct Relation {
    pub place: V,
    pub turn: M,
    pub velocity: V,
    pub spin: V,
    pub params: Vec<(&'static str, String)>,
    pub rows: usize,
}

/// Turns by an angle about z.
pub fn about_z(angle: f64) -> M {
    Rotation3::new(V::z() * angle).into_inner()
}

/// A number as TOML reads it.
pub fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A standing and motion that the equations of a joint allow.
pub fn relation(kind: &'static str, random: &mut Random) -> Relation {
    let (angle, shift) = (random.between(-1.0, 1.0), random.vector(0.5));
    let (rate, speed, spin) = (random.between(-2.0, 2.0), random.vector(0.5), random.vector(2.0));
    let (o, i) = (V::zeros(), M::identity());
    let (place, turn, velocity, spin) = match kind {
        "revolute" => (o, about_z(angle), o, V::z() * rate),
        "cylindrical" => (V::z() * shift.z, about_z(angle), V::z() * speed.z, V::z() * rate),
        "translational" => (V::z() * shift.z, i, V::z() * speed.z, o),
        "spherical" => (o, random.rotation(), o, spin),
        "planar" => (V::new(shift.x, shift.y, 0.0), about_z(angle), V::new(speed.x, speed.y, 0.0), V::z() * rate),
        "universal" => {
            let pins = M::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
            let turn = about_z(angle) * pins * about_z(random.between(-1.0, 1.0));
            (o, turn, o, V::z() * rate + turn.column(2) * spin.x)
        }
        "constant-velocity" => {
            let bend = random.between(0.1, 1.0);
            let across = about_z(angle) * V::x();
            let turn = Rotation3::new(across * bend).into_inner();
            let halfway = (V::z() + turn.column(2)).normalize();
            (o, turn, o, spin - halfway * halfway.dot(&spin))
        }
        "point-in-plane" => (V::new(shift.x, shift.y, 0.0), random.rotation(), V::new(speed.x, speed.y, 0.0), spin),
        "point-on-line" => (V::z() * shift.z, random.rotation(), V::z() * speed.z, spin),
        "parallel-axes" => (shift, about_z(angle), speed, V::z() * rate),
        "perpendicular-axes" => {
            let turn = about_z(angle) * Rotation3::new(V::x() * 0.5 * std::f64::consts::PI).into_inner();
            let barred = V::z().cross(&turn.column(2).into_owned());
            (shift, turn * about_z(rate), speed, spin - barred * barred.dot(&spin))
        }
        "bracket" | "ground" => (o, i, o, o),
        _ => return relation_with_parameters(kind, random),
    };
    let rows = match kind {
        "point-in-plane" | "perpendicular-axes" => 1,
        "point-on-line" | "parallel-axes" => 2,
        "spherical" | "planar" => 3,
        "cylindrical" | "universal" | "constant-velocity" => 4,
        "bracket" | "ground" => 6,
        _ => 5,
    };
    Relation { place, turn, velocity, spin, params: Vec::new(), rows }
}

/// The same for joints that have parameters.
fn relation_with_parameters(kind: &'static str, random: &mut Random) -> Relation {
    let (spin, turn, rate) = (random.vector(2.0), random.rotation(), random.between(-1.0, 1.0));
    let with = |place: V, velocity: V, params: Vec<(&'static str, String)>, rows: usize| Relation {
        place,
        turn,
        velocity,
        spin,
        params,
        rows,
    };
    let text = |text: String| format!("\"{text}\"");
    match kind {
        "screw" => {
            let (pitch, angle) = (random.between(0.1, 0.6), random.between(-1.0, 1.0));
            let lead = pitch / std::f64::consts::TAU;
            Relation {
                turn: about_z(angle),
                spin: V::z() * rate,
                ..with(V::z() * lead * angle, V::z() * lead * rate, vec![("pitch", number(pitch))], 5)
            }
        }
        "distance-rod" => {
            let (along, length) = (random.direction(), random.between(0.4, 1.5));
            let speed = random.vector(0.5);
            with(along * length, speed - along * along.dot(&speed), vec![("length", number(length))], 1)
        }
        "point" => {
            let held = random.of(&["x", "y", "z", "xy", "xz", "yz", "xyz"]);
            let free = ["x", "y", "z"].map(|name| if held.contains(name) { 0.0 } else { 1.0 });
            let free = V::from_column_slice(&free);
            let (shift, speed) = (random.vector(0.5), random.vector(0.5));
            let params = vec![("directions", text(held.into()))];
            with(shift.component_mul(&free), speed.component_mul(&free), params, held.len())
        }
        "point-on-curve" => {
            let (bow, x, planar) = (random.between(0.1, 0.8), random.between(-0.5, 0.5), random.chance(0.5));
            let (slope, aside) = (bow * x.cos(), if planar { 0.0 } else { random.between(-0.5, 0.5) });
            let params = vec![("height", text(format!("{bow:?} sin(x)"))), ("planar", planar.to_string())];
            let place = V::new(x, bow * x.sin(), aside);
            with(place, V::new(rate, slope * rate, 0.0), params, 1 + usize::from(planar))
        }
        "knife-edge" => {
            let (speed, across) = (random.vector(0.5), turn.column(2).into_owned());
            with(random.vector(0.5), speed - across * across.dot(&speed), Vec::new(), 1)
        }
        "rolling-disc" => {
            let (radius, tilt, heading) =
                (random.between(0.1, 0.5), random.between(0.4, 2.7), random.between(-3.0, 3.0));
            let turn = about_z(heading) * Rotation3::new(V::x() * tilt).into_inner() * about_z(rate);
            let normal = V::z() - turn.column(2) * turn[(2, 2)];
            let contact = -normal * (radius / normal.norm());
            let shift = random.vector(0.5);
            let place = V::new(shift.x, shift.y, radius * normal.norm());
            Relation { turn, ..with(place, contact.cross(&spin), vec![("radius", number(radius))], 3) }
        }
        "cam" => {
            let (mean, wave) = (random.between(0.4, 0.8), random.between(0.02, 0.1));
            let (phi, planar) = (random.between(-3.0, 3.0), random.chance(0.5));
            let (r, slope) = (mean + wave * (2.0 * phi).cos(), -2.0 * wave * (2.0 * phi).sin());
            let (s, c) = phi.sin_cos();
            let aside = if planar { 0.0 } else { random.between(-0.5, 0.5) };
            let radius = text(format!("{mean:?} + {wave:?} cos(2 phi)"));
            let velocity = V::new(slope * c - r * s, slope * s + r * c, 0.0) * rate;
            let params = vec![("radius", radius), ("planar", planar.to_string())];
            with(V::new(r * c, r * s, aside), velocity, params, 1 + usize::from(planar))
        }
        // Driven in some or all coordinates.
        _ => {
            let mut params = vec![("x", text("0.1 sin(2 t)".into())), ("y", number(0.0)), ("z", number(0.0))];
            let whole = random.chance(0.5);
            if whole {
                params.extend([("about_x", number(0.0)), ("about_y", number(0.0)), ("about_z", text("0.5 t".into()))]);
            }
            let mut relation = with(V::x() * 0.0, V::x() * 0.2, params, if whole { 6 } else { 3 });
            if whole {
                (relation.turn, relation.spin) = (M::identity(), V::z() * 0.5);
            }
            relation
        }
    }
}
