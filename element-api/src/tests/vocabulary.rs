//! What authors have words for: numbers, conditions, velocities and forces at points.

use crate::element::{Configuration, Motion, Wrenches};
use crate::recorded::{Recorded, input, record};
use crate::recording::{Input, Role};
use crate::testkit::{Random, Setting, interpret};
use crate::{Jet, Scalar, Twist, Vec3, select};

type Pair = (&'static str, fn(f64) -> f64, fn(f64) -> f64, fn(Jet) -> Jet, fn(Recorded) -> Recorded);

/// The same words for all scalars, beside what the standard library gives.
macro_rules! words {
    ($($name:literal: $plain:expr, $word:ident;)*) => {
        [$(($name, $plain, $word::<f64>, $word::<Jet>, $word::<Recorded>)),*]
    };
}

fn tan<S: Scalar>(x: S) -> S {
    x.tan()
}
fn asin<S: Scalar>(x: S) -> S {
    x.asin()
}
fn acos<S: Scalar>(x: S) -> S {
    x.acos()
}
fn atan<S: Scalar>(x: S) -> S {
    (x * 3.0).atan()
}
fn hypot<S: Scalar>(x: S) -> S {
    x.hypot(x * x + 0.5)
}
fn above<S: Scalar>(x: S) -> S {
    select(x.above(0.25), x * x, -x)
}
fn below<S: Scalar>(x: S) -> S {
    select(x.below(x * x), S::one(), x * 2.0)
}

#[test]
fn words_mean_the_same_for_all_scalars() {
    let all: [Pair; 7] = words! {
        "tan": f64::tan, tan;
        "asin": f64::asin, asin;
        "acos": f64::acos, acos;
        "atan": |x| (3.0 * x).atan(), atan;
        "hypot": |x| x.hypot(x * x + 0.5), hypot;
        "above": |x| if x > 0.25 { x * x } else { -x }, above;
        "below": |x| if x < x * x { 1.0 } else { 2.0 * x }, below;
    };
    let mut random = Random::new(77);
    for (name, plain, number, jet, recorded) in all {
        let recording = record(|| vec![(Role::Channel(0), recorded(input(Input::Time)))]);
        for _ in 0..50 {
            let x = random.between(-0.98, 0.98);
            let expected = plain(x);
            assert!((number(x) - expected).abs() < 4e-16 * (1.0 + expected.abs()), "{name} at {x}");
            let setting = Setting { time: x, ..Setting::at_rest(Vec::new()) };
            let found = interpret(&recording, &setting, &[])[0].1;
            assert_eq!(found.to_bits(), number(x).to_bits(), "{name} at {x}");
            // Far from the ends, where derivatives have none.
            if x.abs() < 0.9 && (x - 0.25).abs() > 1e-3 && x.abs() > 1e-3 {
                let h = 1e-4;
                let slope = (number(x + h) - number(x - h)) / (2.0 * h);
                let curvature = (number(x + h) - 2.0 * number(x) + number(x - h)) / (h * h);
                let found = jet(Jet::new(x, 1.0, 0.0));
                assert!((found.first - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{name}' at {x}");
                assert!((found.second - curvature).abs() < 1e-4 * (1.0 + curvature.abs()), "{name}'' at {x}");
            }
        }
    }
    // Near the ends 1 - x^2 has no digits left.
    let angle = 1e-7_f64;
    assert!((Scalar::acos(angle.cos()) / angle.cos().acos() - 1.0).abs() < 1e-9);
}

/// The power of a force is force times velocity, at any point of the body.
#[test]
fn forces_at_points_do_the_work_of_velocities_there() {
    let mut random = Random::new(78);
    for _ in 0..20 {
        let frames = [random.frame(), random.frame()];
        let twists: [Twist<f64>; 2] = [random.twist(), random.twist()];
        let (point, force): (Vec3<f64>, Vec3<f64>) = (random.vector(2.0), random.vector(3.0));
        let configuration = Configuration { frames: &frames, time: 0.5, unknowns: &[], references: &[], angles: &[] };
        let at = Motion { configuration, twists: &twists, states: &[], memory: &[], inputs: &[], reactions: &[] };
        let given = |give: &dyn Fn(&mut Wrenches<'_, f64>)| {
            let (mut forces, mut torques) = ([Vec3::zeros(); 2], [Vec3::zeros(); 2]);
            give(&mut Wrenches { frames: &frames, forces: &mut forces, torques: &mut torques });
            (forces, torques)
        };
        let power = |(forces, torques): ([Vec3<f64>; 2], [Vec3<f64>; 2])| -> f64 {
            let one = |k: usize| forces[k].dot(&twists[k].velocity) + torques[k].dot(&twists[k].angular_velocity);
            one(0) + one(1)
        };
        let one = power(given(&|out| out.force_at(1, point, force)));
        assert!((one - force.dot(&at.velocity_at(1, point))).abs() < 1e-13 * (1.0 + one.abs()));
        let (forces, torques) = given(&|out| out.force_pair_at(0, 1, point, force));
        let pair = power((forces, torques));
        assert!((pair - force.dot(&at.relative_velocity_at(0, 1, point))).abs() < 1e-13 * (1.0 + pair.abs()));
        let moment = |k: usize| frames[k].position.cross(&forces[k]) + torques[k];
        assert!((moment(0) + moment(1)).norm() < 1e-13 && (forces[0] + forces[1]).norm() == 0.0);
        // A point goes with its body: its velocity is that of the frame there.
        let h = 1e-6;
        let turned = |s: f64| {
            let local = frames[1].rotation.transpose() * (point - frames[1].position);
            let setting = Setting { twists: twists.to_vec(), ..Setting::at_rest(frames.to_vec()) }.after(s);
            setting.frames[1].position + setting.frames[1].rotation * local
        };
        let rate = (turned(h) - turned(-h)) / (2.0 * h);
        assert!((rate - at.velocity_at(1, point)).norm() < 1e-7, "{rate} {}", at.velocity_at(1, point));
        assert_eq!((at.configuration.frames().len(), at.configuration.time(), at.frames().len()), (2, 0.5, 2));
    }
}
