//! FMUs in model exchange, by the methods of FMPy at tolerances as importing tools have them.

use std::process::Command;

use odyn::export::Machine;
use odyn::export::fmu::{Kinds, Version};

use super::fmus::{python, written};
use super::{machine, of_text};
use crate::support::{Scratch, open};

/// Runs an FMU to a time, in model exchange, and prints its outputs there, or `refused`.
const RUN: &str = r#"
import sys
from fmpy import read_model_description, simulate_fmu
fmu, end = sys.argv[1], float(sys.argv[2])
outputs = [v.name for v in read_model_description(fmu).modelVariables if v.causality == "output"]
try:
    found = simulate_fmu(fmu, fmi_type="ModelExchange", stop_time=end, relative_tolerance=1e-5, output=outputs)
except Exception:
    print("refused")
else:
    print(*(repr(float(found[name][-1])) for name in outputs))
"#;

/// What an importing tool finds at a time, by version; `None` where there is none, or no compiler.
fn exchanged(machine: &Machine, end: f64) -> Option<[String; 2]> {
    let (python, folder) = (python()?, Scratch::new());
    let kinds = Kinds { co_simulation: false, model_exchange: true };
    let mut found = Vec::new();
    for (version, name) in [(Version::Two, "two.fmu"), (Version::Three, "three.fmu")] {
        let file = folder.path().join(name);
        if !written(machine, version, kinds, folder.path(), &file) {
            println!("left out: there is no compiler `cc`");
            return None;
        }
        let run = Command::new(&python).args(["-c", RUN]).arg(&file).arg(end.to_string()).output().unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        found.push(String::from_utf8_lossy(&run.stdout).trim().lines().last().unwrap_or_default().to_string());
    }
    found.try_into().ok()
}

/// A body that turns about nearly its middle axis, and a point of it.
const SPINNING: &str = r#"
[simulation]
t_end = 30
output_step = 1
[[body]]
name = "body"
mass = 1
inertia = [1, 2, 2.5]
angular_velocity = [0.1, 5, 0.2]
[[output]]
name = "x"
quantity = "position"
of = "body"
point = [1, 0, 0]
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "body"
point = [1, 0, 0]
component = "y"
[[output]]
name = "z"
quantity = "position"
of = "body"
point = [1, 0, 0]
component = "z"
"#;

#[test]
fn bodies_are_rigid_whatever_lengths_euler_parameters_have() {
    let Some(found) = exchanged(&machine(of_text(SPINNING), Some(1e-3), "rk4"), 30.0) else { return };
    for found in found {
        let place: Vec<f64> = found.split(' ').map(|text| text.parse().unwrap()).collect();
        let distance = place.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((distance - 1.0).abs() < 1e-12, "the point is {distance} m from the middle");
    }
}

#[test]
fn drivers_that_contradict_each_other_later_are_refused() {
    let machine = machine(open("stress/drivers-apart.toml", &[]), Some(1e-3), "rk4");
    let before = exchanged(&machine, 0.9);
    let Some(behind) = exchanged(&machine, 1.9) else { return };
    assert!(before.is_some_and(|found| found.iter().all(|text| text != "refused")));
    assert_eq!(behind, ["refused", "refused"]);
}
