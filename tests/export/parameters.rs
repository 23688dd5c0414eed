//! Parameters that can be set: an export with a parameter changed is the export of the scene with that parameter changed.

use odyn::export::{Choices, Machine, Method, Parameters, Twin};
use odyn::scene::Override;
use odyn::session::{Session, SessionError};

use super::compare;
use crate::support::{Scratch, open, options};

fn with_parameters(choices: &Choices, mut reopen: impl FnMut(&[Override]) -> Result<Session, SessionError>) -> Machine {
    let machine = Machine::new(reopen(&[]).unwrap(), "with parameters", choices.clone()).unwrap();
    machine.with_parameters(&mut reopen, choices, None).unwrap()
}

pub(super) fn of_file(scene: &str, step: f64, method: &str) -> Machine {
    let method = Method::named(method).unwrap();
    let choices = Choices { step: Some(step), method, ..Choices::default() };
    with_parameters(&choices, |changes| {
        let texts: Vec<&str> = changes.iter().map(|change| change.text.as_str()).collect();
        Ok(open(scene, &texts))
    })
}

fn names(parameters: &Parameters) -> Vec<&str> {
    parameters.settable.iter().map(|one| one.port.name.as_str()).collect()
}

fn reason<'a>(parameters: &'a Parameters, name: &str) -> &'a str {
    parameters.fixed.iter().find(|(fixed, _)| fixed == name).map_or("it can be set", |(_, reason)| reason)
}

/// Both after some steps.
fn equal(what: &str, a: &mut Twin, b: &mut Twin, steps: usize) {
    let h = a.machine().step;
    for _ in 0..steps {
        a.step(h).unwrap();
        b.step(h).unwrap();
    }
    let ports = b.machine().outputs.clone();
    for ((x, y), port) in a.outputs().iter().zip(b.outputs()).zip(&ports) {
        assert!((x - y).abs() < 1e-10 * y.abs().max(1.0), "{what}: {} is {x} instead of {y}", port.name);
    }
}

/// Each parameter in both halves of its range, then all of them, against the scene that is exported with these values.
fn settable(scene: &str, step: f64, steps: usize, expected: &[&str]) -> Machine {
    let machine = of_file(scene, step, "rk4");
    println!("{scene}: {:?}\n  fixed: {:?}", names(&machine.parameters), machine.parameters.fixed);
    assert_eq!(names(&machine.parameters), expected, "{scene}: {:?}", machine.parameters.fixed);
    let choices = Choices { step: Some(step), ..Choices::default() };
    let start: Vec<f64> = machine.parameters.settable.iter().map(|one| one.port.start).collect();
    let shares = [0.31, 0.83];
    let mut places: Vec<Vec<f64>> = vec![start.clone()];
    for share in shares {
        let within = |k: usize| {
            let [low, high] = machine.parameters.settable[k].range;
            low + share * (high - low)
        };
        for k in 0..start.len() {
            let mut place = start.clone();
            place[k] = within(k);
            places.push(place);
        }
        places.push((0..start.len()).map(within).collect());
    }
    for place in places {
        let mut twin = Twin::new(machine.clone());
        twin.set_parameters(&place).unwrap();
        let sets: Vec<String> = machine
            .parameters
            .settable
            .iter()
            .zip(&place)
            .map(|(one, value)| format!("parameters.{}={value:?} {}", one.port.name, one.port.unit))
            .collect();
        let sets: Vec<&str> = sets.iter().map(|set| set.trim()).collect();
        let other = Machine::new(open(scene, &sets), "changed", choices.clone()).unwrap();
        equal(&format!("{scene} with {sets:?}"), &mut twin, &mut Twin::new(other), steps);
    }
    machine
}

#[test]
fn what_follows_parameters_follows_exactly() {
    let machine = settable("benchmarks/A05.toml", 1e-5, 20, &["stiffness", "damping", "hinge"]);
    assert!(reason(&machine.parameters, "spin").contains("the start"), "{:?}", machine.parameters.fixed);
    assert!(reason(&machine.parameters, "tip.mass").contains("no law"), "its share of the mass of a rod is no product");
    assert!(reason(&machine.parameters, "rod.mass").contains("computed from `box.mass`"));
    let machine = settable("verification/bump-stop.toml", 1e-3, 300, &["m", "s", "J"]);
    assert!(reason(&machine.parameters, "l").contains("the start"), "a speed at the start is computed from it");
    // The same by the program in C.
    let folder = Scratch::new();
    compare(&machine.with_derivatives().unwrap(), folder.path(), 150);
}

#[test]
fn parameters_have_ranges_and_known_names() {
    let machine = of_file("verification/bump-stop.toml", 1e-3, "rk4");
    let mut twin = Twin::new(machine.clone());
    let mut values: Vec<f64> = machine.parameters.settable.iter().map(|one| one.port.start).collect();
    values[0] *= 2.5;
    assert!(twin.set_parameters(&values).is_err());
    let again = |_: &[Override]| Ok(open("verification/bump-stop.toml", &[]));
    let wrong = [String::from("mm")];
    let error = machine.with_parameters(&mut { again }, &Choices::default(), Some(&wrong)).unwrap_err();
    assert!(error.diagnostics[0].message.contains("no parameter `mm`"), "{}", error.diagnostics[0].message);
}

/// A kinked law is none, nor one that more than numbers follow.
#[test]
fn what_follows_in_no_known_way_is_fixed() {
    let text = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.5
[parameters]
m = 1
k = 50
c = 2
stiffer = 3
kinked = 10
unused = 7
[[body]]
name = "bob"
mass = "m"
inertia = [0.1, 0.1, 0.1]
position = [1, 0, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "bob"]
points = [[1, 1, 0], [1, 0, 0]]
params = { stiffness = "k * exp(stiffer) + max(kinked, 10)", damping = "c", free_length = 0.8 }
"#;
    let folder = Scratch::new();
    let file = folder.file("scene.toml", text);
    let machine = with_parameters(&Choices::default(), |changes| {
        let texts: Vec<&str> = changes.iter().map(|change| change.text.as_str()).collect();
        Session::open(&file, &options(&texts, &[]))
    });
    assert_eq!(names(&machine.parameters), ["m", "k", "c"], "{:?}", machine.parameters.fixed);
    assert!(reason(&machine.parameters, "unused").contains("no equation"), "{:?}", machine.parameters.fixed);
    for name in ["stiffer", "kinked"] {
        assert!(reason(&machine.parameters, name).contains("no law that is known"), "{:?}", machine.parameters.fixed);
    }
}
