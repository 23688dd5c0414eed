//! Every function of [`Scalar`]: the three kinds of scalars agree, and jets carry the true derivatives.

use crate::recorded::{Recorded, input, record};
use crate::recording::{Input, Role};
use crate::slope::Dual;
use crate::testkit::{Random, Setting, interpret};
use crate::{Function, Interpolation, Jet, Outside, Scalar, Table};

/// Every operation once, for x > 0 and any y.
fn every<S: Scalar>(x: S, y: S) -> Vec<(&'static str, S)> {
    let table = Table::periodic(&[[0.0, 1.0], [0.3, 2.0], [0.7, -1.0], [1.0, 1.0]]).expect("sound");
    let mut added = x;
    added += y;
    let mut taken = x;
    taken -= y;
    let mut multiplied = x;
    multiplied *= y;
    let mut divided = y;
    divided /= x;
    vec![
        ("x + y", x + y),
        ("x - y", x - y),
        ("x y", x * y),
        ("y / x", y / x),
        ("-x", -x),
        ("x + 2", x + 2.0),
        ("x - 2", x - 2.0),
        ("2 x", x * 2.0),
        ("x / 2", x / 2.0),
        ("+=", added),
        ("-=", taken),
        ("*=", multiplied),
        ("/=", divided),
        ("sqrt", x.sqrt()),
        ("sin", (x * y).sin()),
        ("cos", (x * y).cos()),
        ("atan2(y, x)", y.atan2(x)),
        ("atan2(y, -x)", y.atan2(-x)),
        ("exp", y.exp()),
        ("ln", x.ln()),
        ("tanh", y.tanh()),
        ("y^0", y.powi(0)),
        ("y^1", y.powi(1)),
        ("y^3", y.powi(3)),
        ("x^-2", x.powi(-2)),
        ("x^1.7", x.powf(1.7)),
        ("select", S::select(y, x, x * x, y * y)),
        ("select the other", S::select(x + 9.0, y, x * x, y * y)),
        ("abs", y.abs()),
        ("min", y.min(x)),
        ("max", y.max(x)),
        ("clamp", (y * 3.0).clamp(-0.5, 0.5)),
        ("table", (y * 5.0).lookup(&table)),
    ]
}

#[test]
fn jets_carry_first_and_second_derivatives_of_every_function() {
    let mut random = Random::new(11);
    for _ in 0..20 {
        // x(t) and y(t), quadratic.
        let (x0, x1, x2) = (random.between(0.5, 2.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        let (y0, y1, y2) = (random.between(-2.0, 2.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        let at = |t: f64| every(x0 + x1 * t + 0.5 * x2 * t * t, y0 + y1 * t + 0.5 * y2 * t * t);
        let h = 1e-4;
        let (before, here, after) = (at(-h), at(0.0), at(h));
        for (k, (name, jet)) in every(Jet::new(x0, x1, x2), Jet::new(y0, y1, y2)).into_iter().enumerate() {
            let (b, f, a) = (before[k].1, here[k].1, after[k].1);
            assert_eq!(jet.value, f, "{name}");
            let first = (a - b) / (2.0 * h);
            let second = (a - 2.0 * f + b) / (h * h);
            assert!((jet.first - first).abs() < 1e-4 * (1.0 + first.abs()), "{name}: first {} {first}", jet.first);
            if name == "table" {
                // The second derivative has kinks; see the tests of tables.
                continue;
            }
            let error = (jet.second - second).abs();
            assert!(error < 1e-4 * (1.0 + second.abs()), "{name}: second {} {second}", jet.second);
        }
    }
}

#[test]
fn duals_carry_the_first_derivatives_that_jets_carry() {
    let mut random = Random::new(13);
    for _ in 0..20 {
        let (x, y) = (random.between(0.5, 2.0), random.between(-2.0, 2.0));
        let (dx, dy) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        let duals = every(Dual { value: x, slope: dx }, Dual { value: y, slope: dy });
        for ((name, jet), (_, dual)) in every(Jet::new(x, dx, 0.0), Jet::new(y, dy, 0.0)).into_iter().zip(duals) {
            assert_eq!(dual.value, jet.value, "{name}");
            let error = (dual.slope - jet.first).abs();
            assert!(error <= 1e-14 * (1.0 + jet.first.abs()), "{name}: {} {}", dual.slope, jet.first);
        }
    }
}

#[test]
fn slopes_of_functions_are_their_derivatives() {
    let points = [[0.0, 1.0], [0.3, 2.0], [0.7, -1.0], [1.0, 1.0]];
    for interpolation in [Interpolation::Spline, Interpolation::Monotone, Interpolation::Linear] {
        for outside in [Outside::Clamped, Outside::Periodic] {
            let function = Function::interpolated(&points, interpolation, outside).expect("sound points");
            for k in -20..30 {
                let x = 0.1 * f64::from(k) + 0.013;
                let expected = function.at(Jet::new(x, 1.0, 0.0)).first;
                let found = function.slope(x);
                assert!((found - expected).abs() <= 1e-13 * (1.0 + expected.abs()), "{x}: {found} {expected}");
            }
        }
    }
    assert_eq!(Function::constant(3.0).slope(0.5), 0.0);
}

#[test]
fn recorded_functions_compute_what_the_plain_ones_do() {
    let recording = record(|| {
        let x = input(Input::Position { frame: 0, component: 0 });
        let y = input(Input::Position { frame: 0, component: 1 });
        let results = every(x, y).into_iter().enumerate();
        results.map(|(k, (_, value))| (Role::Channel(k as u32), value)).collect()
    });
    let mut random = Random::new(12);
    for _ in 0..20 {
        let mut setting = Setting::at_rest(vec![random.frame()]);
        setting.frames[0].position.x = random.between(0.5, 2.0);
        let position = setting.frames[0].position;
        let found = interpret(&recording, &setting, &[]);
        for ((name, expected), (_, value)) in every(position.x, position.y).into_iter().zip(found) {
            assert_eq!(value, expected, "{name} at {position:?}");
        }
    }
}

#[test]
fn constants_are_computed_while_recording() {
    let recording = record(|| {
        let results = every(Recorded::from(1.5), Recorded::from(-0.4)).into_iter().enumerate();
        // A switch and a table are kept: the host sees where an equation may switch.
        let plain = results.filter(|(_, (_, value))| matches!(value, Recorded::Constant(_)));
        plain.map(|(k, (_, value))| (Role::Channel(k as u32), value)).collect()
    });
    let expected = every(1.5, -0.4);
    assert_eq!(recording.outputs.len(), 26);
    for (role, value) in interpret(&recording, &Setting::at_rest(Vec::new()), &[]) {
        let Role::Channel(k) = role else { panic!("{role:?}") };
        assert_eq!(value, expected[k as usize].1, "{}", expected[k as usize].0);
    }
}

#[test]
fn a_panic_while_recording_leaves_nothing_behind() {
    let result = std::panic::catch_unwind(|| {
        record(|| {
            let _ = input(Input::Time) + 1.0;
            std::panic::resume_unwind(Box::new("the author's mistake"))
        })
    });
    assert!(result.is_err());
    let recording = record(|| vec![(Role::Potential, input(Input::Time))]);
    assert_eq!((recording.ops.len(), recording.constants.len()), (1, 0));
}
