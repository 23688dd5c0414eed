//! What came to C with contract 1.2, against the same elements in Rust (`fixtures/recent-plugin`).

use element_api::params::FRAME_COUNT;
use element_api::set::ElementSet;

use super::*;
use crate::fixtures::{build, file};

/// A mass on a winch, tied to a second one by a string through four points, with a choke between them.
pub const SCENE: &str = r#"
[plugins]
libraries = ["c-recent"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.05
tolerance = 1e-11
[[body]]
name = "hook"
mass = 3
inertia = [0.5, 0.5, 0.5]
position = [0.6, 0, -0.8]
[[body]]
name = "weight"
mass = 2
inertia = [0.5, 0.5, 0.5]
position = [1.5, 0.2, -1]
[[joint]]
name = "winch"
type = "winch"
bodies = ["ground", "hook"]
points = [[0, 0, 0], [0.6, 0, -0.8]]
params = { length = 1, frequency = 8, notch = 0.02, period = 0.1 }
inputs.more = "0.05 m"
[[joint]]
name = "line"
type = "line"
bodies = ["ground", "hook", "ground", "weight"]
points = [[0.4, 0, 0], [0.6, 0, -0.8], [1, 0, 0], [1.5, 0.2, -1]]
params.length = "sqrt(0.68) + sqrt(0.8) + sqrt(1.29)"
[[force]]
name = "choke"
type = "choke"
bodies = ["hook", "weight"]
points = [[0.6, 0, -0.8], [1.5, 0.2, -1]]
params.use = "small"
params.map = { x = [-5, 0, 5], y = [0, 1, 2], z = [[-9, -10, -8], [0, 1, 0], [9, 10, 12]] }
params.law = { points = [[0, 0], [0.5, 1], [1, 1.5], [2, 4], [3, 5]], interpolation = "spline" }
[[output]]
name = "hook_x"
quantity = "position"
of = "hook"
component = "x"
[[output]]
name = "weight_z"
quantity = "position"
of = "weight"
component = "z"
[[output]]
name = "lag"
quantity = "value"
of = "winch"
channel = "lag"
[[output]]
name = "notches"
quantity = "value"
of = "winch"
channel = "notches"
[[output]]
name = "length"
quantity = "coordinate"
of = "winch"
channel = "length"
[[output]]
name = "pull"
quantity = "reaction_force"
of = "line"
on = "weight"
component = "z"
[[output]]
name = "q"
quantity = "value"
of = "choke"
channel = "q"
"#;

/// A ball that is thrown on a floor, strikes, slides and comes to rest.
pub const STRIKING: &str = r#"
[plugins]
libraries = ["recent-plugin"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 2
output_step = 0.05
tolerance = 1e-9
[[body]]
name = "ball"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [0, 0, 0.5]
velocity = [1, 0.5, 0]
[[joint]]
name = "floor"
type = "skid"
bodies = ["ground", "ball"]
points = [[0, 0, 0], [0, 0, 0.5]]
params = { mu = 0.3, restitution = 0.4 }
[[output]]
name = "x"
quantity = "position"
of = "ball"
component = "x"
[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"
[[output]]
name = "push"
quantity = "reaction_force"
of = "floor"
on = "ball"
component = "z"
"#;

fn recent() -> Option<&'static Path> {
    static BUILT: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = || root().join("tests/fixtures/c-plugin/recent.c");
    BUILT.get_or_init(|| cc(&source(), "c-recent", FLAGS, &kept("c-recent"))).as_deref()
}

/// Runs a scene with a library.
pub fn run_with(scene: &str, package: &str, library: &Path) -> RunReport {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", scene.replace("c-recent", package));
    let folder = library.parent().unwrap().to_path_buf();
    let session = Session::open(&path, &options(&[], &[folder])).unwrap_or_else(|error| panic!("{error}"));
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn in_rust() -> PathBuf {
    file(&build("recent-plugin"), "recent-plugin")
}

#[test]
fn recent_elements_in_c_move_like_those_in_rust() {
    let Some(library) = recent() else { return };
    let (in_c, in_rust) = (run_with(SCENE, "c-recent", library), run_with(SCENE, "recent-plugin", &in_rust()));
    assert_eq!((in_c.exit_code(), in_rust.exit_code()), (0, 0), "{} {}", in_c.summary.reason, in_rust.summary.reason);
    for name in ["hook_x", "weight_z", "lag", "notches", "length", "pull", "q"] {
        let (own, other) = (column(&in_c, name), column(&in_rust, name));
        let off = difference(own, other);
        assert!(off < 1e-12, "{name}: {off:e}");
        assert!(own.iter().any(|value| (value - own[0]).abs() > 0.01), "`{name}` stays where it is: {own:?}");
    }
    // The check of the catalogue's row, in the words of the library.
    let warnings = format!("{:?}", in_c.summary.warnings);
    assert!(warnings.contains("is loaded beyond its rating"), "{warnings}");
}

/// A double pendulum with a mass on a spring in its lower arm, which strikes a stop.
const SHAKEN: &str = r#"
[plugins]
libraries = ["c-recent", "odyn-joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.05
tolerance = 1e-11
[[body]]
name = "upper"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0.5, 0, 0]
[[body]]
name = "lower"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [1.5, 0, 0]
[[joint]]
name = "shoulder"
type = "revolute"
bodies = ["ground", "upper"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "elbow"
type = "revolute"
bodies = ["upper", "lower"]
point = [1, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "stop"
type = "rotational-stop"
bodies = ["ground", "upper"]
point = [0, 0, 0]
axis = [0, 1, 0]
params = { upper = 1.2, restitution = 0.5 }
[[force]]
name = "shaker"
type = "shaker"
bodies = ["lower"]
point = [1.9, 0, 0]
params = { mass = 0.8, stiffness = 60, damping = 0.5, start = 0.03 }
[[output]]
name = "x"
quantity = "position"
of = "lower"
component = "x"
[[output]]
name = "q"
quantity = "value"
of = "shaker"
channel = "q"
[[output]]
name = "energy"
quantity = "total_energy"
"#;

#[test]
fn an_element_in_c_brings_mass_and_a_flexible_coordinate() {
    let Some(library) = recent() else { return };
    let (in_c, in_rust) = (run_with(SHAKEN, "c-recent", library), run_with(SHAKEN, "recent-plugin", &in_rust()));
    assert_eq!((in_c.exit_code(), in_rust.exit_code()), (0, 0), "{} {}", in_c.summary.reason, in_rust.summary.reason);
    assert!(in_c.events.len() == in_rust.events.len() && in_c.summary.audit.impacts > 0, "{:?}", in_c.events);
    for name in ["x", "q", "energy"] {
        let off = difference(column(&in_c, name), column(&in_rust, name));
        assert!(off < 1e-11, "{name}: {off:e}");
    }
    assert!(in_c.summary.audit.energy_error_relative < 1e-8, "{:?}", in_c.summary.audit);
}

#[test]
fn recent_elements_in_c_are_described_as_in_rust_and_pass_the_test_kit() {
    let Some(library) = recent() else { return };
    let (in_c, in_rust) = (classes(library), classes(&in_rust()));
    assert_eq!(in_c.elements().count(), 4);
    for element in in_c.elements() {
        let twin = in_rust.find(&element.descriptor().name, None).unwrap();
        let mut described = element.descriptor().clone();
        // Examples are texts in C: the number 4 is a whole one.
        let pairs = described.params.iter_mut().zip(&twin.descriptor().params);
        pairs.for_each(|(own, other)| own.example.clone_from(&other.example));
        assert_eq!(&described, twin.descriptor());
        for one in [&element, &twin] {
            let verdict: Verdict = examine(one, &Given::default(), &[]).unwrap();
            assert!(verdict.passed(), "{verdict:?}");
        }
    }
}

#[test]
fn a_number_of_frames_that_an_element_in_c_refuses_is_told() {
    let Some(library) = recent() else { return };
    let line = classes(library).find("line", None).unwrap();
    let mut set = line.class.new_set();
    let told = |set: &mut dyn ElementSet, count: i64| {
        let mut params = Params::new();
        params.insert("length".into(), 4.0.into());
        params.insert(FRAME_COUNT.into(), count.into());
        match set.add(&params) {
            Ok(_) => String::new(),
            Err(CreateError::Parameter(error)) => error.to_string(),
            Err(CreateError::Fault(text)) => text,
        }
    };
    assert_eq!(told(set.as_mut(), 4), "");
    assert_eq!(told(set.as_mut(), 5), "bodies: five points are not for this string");
    assert_eq!(told(set.as_mut(), 7), "bodies: `line` takes 2 to 6 frames");
}
