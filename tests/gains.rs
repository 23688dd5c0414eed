//! Signals that a gain gives the dimension that is asked for.

use crate::contacts::{run, try_run};
use crate::support::column;

/// A rocket that spins about z, pushed along its own x axis by a plain number, and a block that an output of its own drives as a
/// spring: in these units.
fn scene(units: &str, [length, mass, inertia]: [f64; 3]) -> String {
    format!(
        "title = \"gains\"\nplugins.libraries = [\"odyn-controls\", \"odyn-forces\"]\n{units}\
         [simulation]\nt_end = \"2 s\"\noutput_step = \"0.25 s\"\ntolerance = 1e-11\n\
         [[body]]\nname = \"rocket\"\nmass = {mass}\ninertia = [{inertia}, {inertia}, {inertia}]\n\
         angular_velocity = [0, 0, \"1.5 rad/s\"]\n\
         [[body]]\nname = \"block\"\nmass = {mass}\ninertia = [{inertia}, {inertia}, {inertia}]\n\
         position = [0, {length}, 0]\n\
         [[control]]\nname = \"throttle\"\ntype = \"gain\"\ninputs = {{ input = 0.5 }}\nparams.gain = 4\n\
         [[force]]\nname = \"thrust\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"rocket\"]\nparams.follower = true\n\
         inputs.x = {{ signal = \"throttle.output\", gain = \"3 N\" }}\n\
         [[output]]\nname = \"height\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"y\"\n\
         [[force]]\nname = \"pull\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"block\"]\n\
         inputs.y = {{ signal = \"height\", gain = \"-18 N/m\" }}\n"
    ) + &["x", "y"]
        .map(|component| {
            format!(
                "[[output]]\nname = \"r{component}\"\nquantity = \"position\"\nof = \"rocket\"\n\
                 component = \"{component}\"\n"
            )
        })
        .concat()
}

#[test]
fn plain_numbers_and_lengths_drive_forces() {
    let small = "[units]\nlength = \"mm\"\nmass = \"g\"\ntime = \"ms\"\n";
    for (text, metre) in [(scene("", [0.5, 2.0, 0.1]), 1.0), (scene(small, [500.0, 2000.0, 1e8]), 1000.0)] {
        let report = run(&text, &[]);
        let (spin, push) = (1.5_f64, 0.5 * 4.0 * 3.0 / 2.0);
        for (k, t) in (0..9).map(|k| (k, 0.25 * f64::from(k as u8))) {
            let exact = [
                push / (spin * spin) * (1.0 - (spin * t).cos()),
                push / (spin * spin) * (spin * t - (spin * t).sin()),
                0.5 * (3.0 * t).cos(),
            ];
            for (name, exact) in ["rx", "ry", "height"].iter().zip(exact) {
                let off = column(&report, name)[k] / metre - exact;
                assert!(off.abs() < 1e-9, "{name} at {t}: {off:e}");
            }
        }
    }
}

#[test]
fn gains_of_another_dimension_are_refused_with_what_fits() {
    let text = scene("", [0.5, 2.0, 0.1]);
    let message = |from: &str, to: &str| {
        let changed = text.replace(from, to);
        assert_ne!(changed, text);
        try_run(&changed, &[], None).unwrap_err()
    };
    let found = message("gain = \"3 N\"", "gain = \"3 m\"");
    assert!(found.contains("expected a force, found a length"), "{found}");
    let found = message("{ signal = \"height\", gain = \"-18 N/m\" }", "\"height\"");
    assert!(
        found.contains("{ signal = \"height\", gain = \"1 kg/s^2\" }") || found.contains("gain = \"1 N/m\" }"),
        "{found}"
    );
    let found = message("signal = \"height\"", "signal = \"hight\"");
    assert!(found.contains("did you mean `height`?"), "{found}");
}

/// What a servo is to follow is a length, in the unit of the scene.
#[test]
fn a_demand_without_a_unit_is_in_that_of_the_scene() {
    let text = "[plugins]\nlibraries = [\"joints\"]\n[units]\nlength = \"mm\"\n[simulation]\nt_end = 2\noutput_step = 1\n[[body]]\n\
                name = \"slide\"\nmass = 1\ninertia = [100, 100, 100]\n[[joint]]\nname = \"guide\"\ntype = \"translational\"\n\
                bodies = [\"ground\", \"slide\"]\npoint = [0, 0, 0]\n[[joint]]\nname = \"servo\"\ntype = \"servo-displacement\"\n\
                bodies = [\"ground\", \"slide\"]\npoint = [0, 0, 0]\nparams.frequency = 20\ninputs.demand = 30\n[[output]]\n\
                name = \"z\"\nquantity = \"coordinate\"\nof = \"guide\"\n";
    let run = run(text, &[]);
    let reached = column(&run, "z").last().copied().expect("it has rows");
    assert!((reached - 30.0).abs() < 1e-6, "{reached}");
}
