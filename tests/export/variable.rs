//! Steps of variable size in exported programs: the bits of the interpreter, errors that fall with the tolerance, FMUs.

use odyn::export::{Choices, Machine, Method, Twin};
use odyn::session::Session;

use super::fmus::judged;
use super::sampled::{HELD, off_from_run};
use super::{PENDULUM, compare, of_text};
use crate::support::{Scratch, open};

pub fn of(session: Session, step: Option<f64>, tolerance: f64) -> Machine {
    let method = Method::named("dopri5").unwrap();
    Machine::new(session, "variable", Choices { step, method, tolerance: Some(tolerance), ..Choices::default() })
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn variable_steps_have_the_bits_of_the_interpreter() {
    let folder = Scratch::new();
    compare(&of(open("compressor.toml", &[]), Some(0.4), 1e-7), folder.path(), 10);
    compare(&of(open("benchmarks/A04.toml", &[]), Some(0.1), 1e-8), folder.path(), 20);
    compare(&of(open("verification/bump-stop.toml", &[]), Some(0.05), 1e-6), folder.path(), 20);
    compare(&of(of_text(HELD), Some(0.05), 1e-6), folder.path(), 20);
    compare(&of(of_text(PENDULUM), Some(0.2), 1e-9), folder.path(), 10);
}

/// One communication step is divided as the tolerance asks for.
#[test]
fn errors_fall_with_the_tolerance() {
    let bricard = || {
        open("benchmarks/A04.toml", &["simulation.tolerance=1e-12", "simulation.t_end=2", "simulation.output_step=0.5"])
    };
    let held = || of_text(HELD);
    let pendulum = || of_text(&PENDULUM.replace("output_step = 0.5", "output_step = 0.5\ntolerance = 1e-12"));
    let scenes: [(&str, &dyn Fn() -> Session, f64); 3] = [
        ("Bricard's mechanism", &bricard, 1e-7),
        ("pendulum", &pendulum, 1e-7),
        ("a pendulum that is held", &held, 1e-5),
    ];
    for (name, make, most) in scenes {
        let offs = [1e-4, 1e-6, 1e-9].map(|tolerance| {
            let mut twin = Twin::new(of(make(), Some(1.0), tolerance));
            let off = off_from_run(make(), &mut twin, 1);
            println!("{name}, tolerance {tolerance:e}: {off:.1e}, {} steps rejected", twin.rejected());
            off
        });
        // Between samples steps are short enough for the larger ones.
        assert!(offs[1] <= offs[0] && offs[2] < 0.2 * offs[1] && offs[2] < most, "{name}: {offs:?}");
    }
}

#[test]
fn fmus_with_variable_steps_are_valid() {
    judged("variable-bricard", &of(open("benchmarks/A04.toml", &[]), Some(0.05), 1e-8), 1e-5);
    judged("variable-held", &of(of_text(HELD), Some(0.0137), 1e-8), 1e-4);
}

/// What no step can get over ends with a status, not in an endless loop: a pole of the equations ahead.
#[test]
fn tolerances_that_cannot_be_met_are_reported() {
    let text = PENDULUM.replace("inputs = { signal = \"torque\" }", "inputs = { signal = \"pole.output\" }")
        + "[[control]]\nname = \"pole\"\ntype = \"signal-source\"\nparams.function = \"1 / (0.3 - t)\"\n";
    let text = text.replace("\"forces\"]", "\"forces\", \"controls\"]");
    let mut twin = Twin::new(of(of_text(&text), Some(0.2), 1e-8));
    let failed = (0..3).find_map(|_| twin.step(0.2).err());
    println!("{failed:?} at {} s after {} rejected steps", twin.time(), twin.rejected());
    assert!(failed.is_some() && twin.time() < 0.3 + 1e-6);
}

#[test]
fn tolerances_are_for_methods_with_an_estimate() {
    for (method, tolerance, reason) in
        [("rk4", 1e-6, "has no estimate"), ("rodas", 1e-6, "has no estimate"), ("dopri5", 0.5, "cannot be met")]
    {
        let method = Method::named(method).unwrap();
        let choices = Choices { method, tolerance: Some(tolerance), ..Choices::default() };
        let error = Machine::new(of_text(PENDULUM), "refused", choices).unwrap_err();
        let first = &error.diagnostics[0];
        assert!(first.code.code == "ODY0841" && first.message.contains(reason), "{}", first.message);
    }
}
