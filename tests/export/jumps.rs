//! Forces that jump: in time, at the end of a step too, and where a speed is reached. Stages of a step that lie behind a jump would leave
//! a share of the step as error for good.

use element_api::testkit::Random;
use odyn::export::{METHODS, Twin};

use super::{compare, machine, of_text};
use crate::support::Scratch;

/// A carriage of 1 kg that 2 N push until the jump and 0.5 N from there on.
const CARRIAGE: &str = r#"
[plugins]
libraries = ["joints", "forces", "controls"]
[simulation]
t_end = 2
output_step = 0.05
[[body]]
name = "carriage"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[control]]
name = "law"
@law@
[[force]]
name = "drive"
type = "translational-actuator"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.along = "axis"
inputs.signal = "law.output"
[[output]]
name = "v"
quantity = "velocity"
of = "carriage"
component = "x"
[[output]]
name = "x"
quantity = "position"
of = "carriage"
component = "x"
"#;

const IN_TIME: &str = r#"
type = "signal-source"
params.function = { points = [[0, 2], [0.5, 0.5], [10, 0.5]], interpolation = "steps" }
"#;

const AT_A_SPEED: &str = r#"
type = "look-up"
inputs.input = "v"
params.function = { points = [[-10, 2], [1, 0.5], [10, 0.5]], interpolation = "steps" }
"#;

/// v = 1 at t = 0.5 s, x = 1/4 there; v = 1 + 0.75 and x = 1/4 + 1.5 + 1.125 / 2 at t = 2 s.
const AT_THE_END: [f64; 2] = [1.75, 2.3125];

#[test]
fn jumps_of_forces_cost_no_accuracy() {
    let folder = Scratch::new();
    for (law, allowed) in [(IN_TIME, 1e-12), (AT_A_SPEED, 1e-9)] {
        for method in METHODS {
            let machine = machine(of_text(&CARRIAGE.replace("@law@", law)), Some(0.05), method.name);
            // 0.5 s is the end of a step in most of these, to round-off.
            for steps in [40, 80, 120, 150, 160, 280, 400, 1000] {
                let mut twin = Twin::new(machine.clone());
                for _ in 0..steps {
                    twin.step(2.0 / f64::from(steps)).unwrap();
                }
                assert_eq!(twin.passed, 0);
                for (found, exact) in twin.outputs().iter().zip(AT_THE_END) {
                    let off = (found - exact).abs();
                    assert!(off < allowed, "{} in {steps} steps: {found} instead of {exact}", method.name);
                }
            }
            compare(&machine, folder.path(), 40);
        }
    }
}

/// Steps end where a curve over time is bent much; of very many such points only where it jumps or has a corner, as at its ends.
#[test]
fn of_many_bends_only_corners_are_ends_of_steps() {
    for (count, kind, expected) in
        [(12, "spline", 9..=12), (12, "monotone", 12..=12), (100, "spline", 2..=2), (100, "linear", 0..=0)]
    {
        let mut random = Random::new(5);
        let at = |k: u32| 1.5 * f64::from(k) / f64::from(count - 1);
        let points: Vec<String> =
            (0..count).map(|k| format!("[{:?}, {:?}]", at(k), random.between(-1.0, 1.0))).collect();
        let law = format!(
            "type = \"signal-source\"\nparams.function = {{ points = [{}], interpolation = \"{kind}\" }}\n",
            points.join(", ")
        );
        let machine = machine(of_text(&CARRIAGE.replace("@law@", &law)), Some(0.05), "rk4");
        let found = machine.switches.map_or(0, |switches| switches.program.output_count());
        assert!(expected.contains(&found), "{count} points, {kind}: {found}");
    }
}
