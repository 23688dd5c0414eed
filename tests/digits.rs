//! Computations with more digits than doubles have: against closed forms and references of 18 digits, and what they say of runs.

use odyn::diagnostics::codes;
use odyn::precise::DoubleDouble;
use odyn::results::{Digits, Table};
use odyn::session::RunReport;

use crate::support::{Scratch, open, open_text, options, root};

/// Half a unit of the last digit that doubles have of references, and of what scenes compute from their parameters.
const ROUNDING: f64 = 2e-15;

/// A run of a scene with its digits.
fn judged(scene: &str, sets: &[&str]) -> (RunReport, Digits) {
    let session = open(scene, sets);
    let second = session.second().unwrap();
    let mut report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    second.judge(&mut report, &Default::default());
    let digits = report.summary.digits.clone().unwrap();
    (report, digits)
}

/// The columns that a table of references has of a run: number of the output, reference.
fn known(scene: &str, report: &RunReport) -> Vec<(usize, Vec<f64>)> {
    let table = Table::read(&root().join(format!("scenes/reference/{scene}.csv"))).unwrap();
    // Some references are longer.
    assert_eq!(table.times[..report.times.len()], report.times, "{scene}");
    let column = |name: &str| table.names.iter().position(|known| known == name).map(|k| table.columns[k].clone());
    let outputs = report.channels.iter().enumerate();
    outputs.filter_map(|(k, channel)| Some((k, column(&channel.name)?))).collect()
}

/// A pendulum that passes its lowest place with twice its frequency for small angles: it swings to 60 degrees. A quarter of the
/// period is K(1/2) / 2, by the arithmetic-geometric mean. There the angle is greatest, after two quarters the velocity is:
/// what rounds the time does not matter. The velocity at the start is what assembly in doubles makes of it.
#[test]
fn a_pendulum_swings_as_its_closed_form_says() {
    let number = DoubleDouble::from;
    let half = number(0.5);
    let pi = DoubleDouble::ZERO.atan2(number(-1.0));
    let (mut a, mut b) = (DoubleDouble::ONE, number(0.75).sqrt());
    for _ in 0..8 {
        (a, b) = ((a + b) * half, (a * b).sqrt());
    }
    let quarter = (pi * half * half / a).to_f64();
    let scene = format!(
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [0, -8, 0]\nt_end = {0:?}\noutput_times = [0, {1:?}, {0:?}]\n\
         [[body]]\nname = \"bob\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [0, -1, 0]\nvelocity = [2, 0, 0]\n\
         angular_velocity = [0, 0, 2]\n\
         [[joint]]\nname = \"pivot\"\ntype = \"revolute\"\nbodies = [\"ground\", \"bob\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         [[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"\n\
         [[output]]\nname = \"rate\"\nquantity = \"coordinate_rate\"\nof = \"pivot\"\nchannel = \"angle\"\n",
        2.0 * quarter,
        quarter
    );
    let folder = Scratch::new();
    let path = folder.file("pendulum.toml", scene);
    let session = odyn::session::Session::open(&path, &options(&[], &[])).unwrap();
    let found = session.precise().unwrap().solve(&|| true);
    // sin^2 (greatest angle / 2) by the energy at the start.
    let [angle, rate] = [0, 1].map(|k| found.columns[k][0]);
    assert!(angle.abs().to_f64() < 1e-15 && (rate - number(2.0)).abs().to_f64() < 1e-15);
    let (sine, part) = ((angle * half).sin_cos().0, rate / number(4.0));
    let square = sine * sine + part * part;
    let greatest = number(2.0) * square.sqrt().atan2((DoubleDouble::ONE - square).sqrt());
    assert!((greatest - pi / number(3.0)).abs().to_f64() < 1e-15);
    let fastest = number(-4.0) * square.sqrt();
    for (value, exact) in [(found.columns[0][1], greatest), (found.columns[1][2], fastest)] {
        let error = (value - exact).abs().to_f64();
        assert!(error < 1e-25, "{value:?} is not {exact:?}: {error:e}");
    }
}

/// What is left is the rounding of what the scenes are made of (9.81, moments of inertia, lengths computed from parameters): about what
/// rounding the start makes.
#[test]
fn references_are_met_to_the_digits_of_doubles() {
    for scene in ["A01", "A03", "A04", "dpend", "freebody"] {
        let session = open(&format!("benchmarks/{scene}.toml"), &[]);
        let found = session.precise().unwrap().solve(&|| true);
        assert_eq!(found.ended, None, "{scene}");
        let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
        for (k, reference) in known(scene, &report) {
            let largest = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let (peak, rounded) = (largest(&reference), largest(&found.starts[k]));
            // The energy of the pendulum is zero there, counted from another height.
            let errors = found.columns[k].iter().zip(&reference).map(|(a, b)| (*a - DoubleDouble::from(*b)).to_f64());
            let error = largest(&errors.collect::<Vec<f64>>());
            let name = &report.channels[k].name;
            assert!(peak < 1e-9 || error < 10.0 * rounded + ROUNDING * peak, "{scene}, {name}: {error:e}, {rounded:e}");
            assert!(largest(&found.doubts[k]) < 1e-22 * peak.max(1.0), "{scene}, {name}");
        }
    }
}

/// At every tolerance, no digit that is said to be certain is wrong.
#[test]
fn certain_digits_are_those_of_the_references() {
    for scene in ["A01", "A03", "A04", "dpend", "compressor"] {
        let path = if scene == "compressor" { "compressor.toml".into() } else { format!("benchmarks/{scene}.toml") };
        for tolerance in ["1e-4", "1e-7", "1e-10", "1e-13"] {
            let (report, digits) = judged(&path, &[&format!("simulation.tolerance={tolerance}")]);
            assert!(digits.precise && digits.reason.is_empty(), "{scene}: {}", digits.reason);
            let known = known(scene, &report);
            assert!(!known.is_empty());
            for (k, reference) in known {
                let output = &digits.outputs[k];
                let certain = output.certain.unwrap();
                let wrong = report.columns[k].iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let allowed = (0.5 * 10_f64.powi(-(certain as i32)) + ROUNDING) * output.size;
                assert!(
                    wrong <= allowed,
                    "{scene} at {tolerance}, {}: {certain} digits, off by {wrong:e}",
                    output.name
                );
                // Nor are there many more than are reported.
                let share = 2.0 * wrong / output.size;
                assert!(
                    certain >= 12 || share > 0.02 * 10_f64.powi(-(certain as i32)),
                    "{scene}: {certain}, {share:e}"
                );
            }
        }
    }
}

#[test]
fn chaos_leaves_no_digits() {
    let (_, digits) = judged("benchmarks/dpend.toml", &["simulation.t_end=30", "simulation.tolerance=1e-9"]);
    assert!(digits.precise);
    assert_eq!(digits.code(), Some(codes::NO_DIGITS));
    let output = &digits.outputs[0];
    assert_eq!(output.certain, Some(0));
    assert!(output.none_from.unwrap() > 12.0, "{output:?}");
    assert!(digits.accuracy < 1e-6, "{digits:?}");
}

#[test]
fn where_it_ends_is_told() {
    // The constraints lose rank when the bars are in line.
    let (_, digits) = judged("benchmarks/A02_N2.toml", &["simulation.without=[\"affine-loops\"]"]);
    assert!(digits.precise && digits.t_last < 2.0 && !digits.reason.is_empty(), "{digits:?}");
    assert_eq!(digits.code(), Some(codes::NO_DIGITS));
}

#[test]
fn where_doubles_are_all_there_is_digits_are_estimates() {
    let (_, digits) = judged("verification/joint-friction.toml", &[]);
    assert!(!digits.precise && digits.reason.contains("reactions"), "{digits:?}");
    assert_eq!(digits.code(), Some(codes::DIGITS_ESTIMATED));
    assert!(digits.how.contains("cartesian coordinates instead of joint"), "{}", digits.how);
    assert!(digits.outputs.iter().any(|output| output.certain.is_some_and(|digits| digits > 4)), "{digits:?}");
}

/// A torque that is fed back from an acceleration is found by iteration, so that digits are estimated in doubles; by inertance, which does the
/// same, it is a part of the mass matrix, and they are certain. Outputs are off by no more than is reported, at any tolerance.
#[test]
fn outputs_are_off_by_no_more_than_is_estimated() {
    let body = |name: &str, x: f64| {
        let output = |axis: &str| {
            format!(
                "[[output]]\nname = \"{name}_{axis}\"\nquantity = \"position\"\nof = \"{name}\"\ncomponent = \"{axis}\"\n"
            )
        };
        format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.2, 0.3]\nposition = [{x:?}, 0.1, 0]\n")
            + &output("x")
            + &output("y")
    };
    let hinge = |name: &str, bodies: [&str; 2], x: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = {bodies:?}\npoint = [{x:?}, 0, 0]\naxis = [0, 0, 1]\n"
        )
    };
    let text = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 2\noutput_step = 0.1\n"
        .to_string()
        + &body("upper", 0.5)
        + &body("lower", 1.4)
        + &hinge("top", ["ground", "upper"], 0.0)
        + &hinge("low", ["upper", "lower"], 1.0)
        + "[[output]]\nname = \"alpha\"\nquantity = \"angular_acceleration\"\nof = \"lower\"\ncomponent = \"z\"\n";
    let on_lower = |kind: &str, more: &str| {
        format!(
            "[[force]]\nname = \"on_lower\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"lower\"]\npoint = [1, 0, 0]\n{more}\n"
        )
    };
    let fed_back = on_lower("vector-torque", "inputs.z = { signal = \"alpha\", gain = \"-0.4 N m s^2\" }");
    let inertance = on_lower("rotational-inerter", "axis = [0, 0, 1]\nparams.inertance = 0.4");
    for (force, precise) in [(fed_back, false), (inertance, true)] {
        are_off_by_no_more(&format!("{text}{force}"), precise);
    }
}

fn are_off_by_no_more(text: &str, precise: bool) {
    let sharp = open_text(text, &["simulation.tolerance=1e-13"]);
    let sharp = sharp.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    for tolerance in ["1e-5", "1e-6", "1e-7", "1e-8", "1e-9"] {
        let session = open_text(text, &[&format!("simulation.tolerance={tolerance}")]);
        let second = session.second().unwrap();
        let mut report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
        second.judge(&mut report, &Default::default());
        let digits = report.summary.digits.unwrap();
        assert_eq!(digits.precise, precise);
        for (output, (own, exact)) in digits.outputs.iter().zip(report.columns.iter().zip(&sharp.columns)) {
            let off = own.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The sharp run is off by round-off, too.
            assert!(
                off <= 1.000_1 * output.error,
                "{} at {tolerance}: {off:?} is more than {:?}",
                output.name,
                output.error
            );
        }
    }
}

/// Bearings keep a shaft where it is: what moves it there is nothing but round-off, whose series has no end. Steps became as short as that
/// asks for, and nothing was known after a minute.
#[test]
fn what_stands_still_but_for_round_off_does_not_shorten_steps() {
    let (_, digits) = judged("verification/constant-velocity.toml", &[]);
    assert!(digits.precise && digits.reason.is_empty() && digits.t_last == 2.0, "{} {}", digits.reason, digits.t_last);
    assert!(digits.accuracy < 1e-20, "{:e}", digits.accuracy);
}
