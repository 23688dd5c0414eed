//! Elements that were written in Python: the file that `python/examples/elements.py` writes, beside the same elements in Rust. There is
//! no Python here; `python/tests` holds the file to its source.

use std::fs;
use std::path::PathBuf;

use element_api::adapt::{control, force};
use element_api::manifest::Library;
use element_api::prelude::*;
use odyn::catalog::{Catalog, Package, SearchPath, Store, sha256_of};
use odyn::diagnostics::Source;
use odyn::scene::parse;
use odyn::session::{RunReport, Session};
use odyn::workshop::{Given, examine};

use crate::support::{Scratch, kept, options, root};

fn folder() -> PathBuf {
    root().join("python/examples")
}

/// The standard libraries, the file from Python, and the twins below.
fn catalog() -> Catalog {
    let search = SearchPath::standard(&[], &[folder()]);
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    for library in ["joints", "forces", "mechanics"] {
        catalog.add(library, &search).unwrap();
    }
    let classes = vec![force::<Motor>(), control::<SpeedController>()];
    let (package, version) = ("twins".into(), "0.1.0".into());
    catalog.add_library(Library { package, version, about: String::new(), classes }).unwrap();
    catalog
}

fn run(text: &str, sets: &[&str]) -> (RunReport, String) {
    let sets = options(sets, &[]);
    let (scene, warnings) = parse(Source::new("scene.toml", text), &sets.overrides)
        .unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    let session = Session::with_catalog(scene, warnings, &catalog(), &sets).unwrap_or_else(|error| panic!("{error}"));
    let plan = session.plan_report().to_string();
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.exit_code(), 0, "{} {:?}", report.summary.reason, report.summary.audit);
    (report, plan)
}

/// The same scene with the words of one and of the other: the same bits, by the same work.
#[track_caller]
fn compare(text: &str, words: &[(&str, &str)], sets: &[&str]) {
    let mut own = text.to_string();
    for (rust, python) in words {
        let (rust, python) = (format!("type = \"{rust}\""), format!("type = \"{python}\""));
        assert!(own.contains(&rust), "{rust}");
        own = own.replace(&rust, &python);
    }
    let ((rust, plan), (python, own_plan)) = (run(text, sets), run(&own, sets));
    // How many operations were written down differs: Rust writes all inputs.
    let work = |plan: &str| -> Option<String> {
        let line = plan.lines().find(|line| line.starts_with("operations:"))?;
        Some(line.split_once("written, ")?.1.to_string())
    };
    assert!(work(&plan).is_some(), "{plan}");
    assert_eq!(work(&own_plan), work(&plan), "{sets:?}");
    assert_eq!(
        (python.summary.steps, python.summary.rejected),
        (rust.summary.steps, rust.summary.rejected),
        "{sets:?}"
    );
    let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&python.times), bits(&rust.times), "{sets:?}");
    assert!(rust.times.len() > 50 && rust.columns.iter().any(|column| column[0] != column[50]), "nothing moves");
    for (k, channel) in rust.channels.iter().enumerate() {
        assert_eq!(bits(&python.columns[k]), bits(&rust.columns[k]), "{} {sets:?}", channel.name);
    }
}

const WAYS: [&[&str]; 4] = [
    &["simulation.formulation=joint"],
    &["simulation.formulation=cartesian"],
    &["simulation.formulation=joint", "simulation.method=radau5"],
    &["simulation.formulation=cartesian", "simulation.engine=interpreted"],
];

/// Two rods of different lengths, and a spring and damper with laws.
const RODS: &str = r#"
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.01
[[body]]
name = "a"
mass = 1.0
inertia = [0.1, 0.1, 0.1]
position = [0.4, 0, 0]
[[body]]
name = "b"
mass = 0.5
inertia = [0.05, 0.05, 0.05]
position = [0.4, 0.3, 0.1]
[[joint]]
name = "first"
type = "distance-rod"
bodies = ["ground", "a"]
params.length = "40 cm"
[[joint]]
name = "second"
type = "distance-rod"
bodies = ["a", "b"]
params.length = "31.622776601683793 cm"
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "b"]
[force.params]
stiffness = "120 N/m"
damping = "0.7 N s/m"
free_length = "0.2 m"
preload = "1 N"
force_of_elongation = "900 x^3"
force_of_speed = "0.3 v^3"
[[output]]
name = "x"
quantity = "position"
of = "a"
component = "x"
[[output]]
name = "z"
quantity = "position"
of = "b"
component = "z"
[[output]]
name = "pull"
quantity = "reaction_force"
of = "second"
on = "b"
component = "x"
[[output]]
name = "tension"
quantity = "value"
of = "spring"
channel = "force"
"#;

#[test]
fn rods_and_springs_move_as_those_in_rust_bit_for_bit() {
    for sets in WAYS {
        compare(RODS, &[("distance-rod", "rod"), ("translational-spring-damper", "spring-damper")], sets);
    }
}

/// A pendulum with a flywheel, driven by a motor whose speed a sampling controller sets.
const DRIVE: &str = r#"
[simulation]
tolerance = 1e-8
gravity = [0, 0, 0]
t_end = 1
output_step = 0.01
[[body]]
name = "wheel"
mass = 2
inertia = [0.1, 0.1, 0.2]
[[joint]]
name = "pin"
type = "revolute"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "rotor"
type = "rotational-inerter"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.inertance = "0.3 kg m^2"
[[force]]
name = "motor"
type = "motor-twin"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
params = { time_constant = "20 ms", limit = "4 N m" }
inputs.demand = "controller.torque"
[[control]]
name = "controller"
type = "speed-controller-twin"
inputs.speed = "speed"
params = { target = "12 rad/s", gain = "1.5 N m s/rad", integral = "4 N m/rad", period = "50 ms" }
[[output]]
name = "angle"
quantity = "coordinate"
of = "pin"
[[output]]
name = "speed"
quantity = "coordinate_rate"
of = "pin"
[[output]]
name = "torque"
quantity = "value"
of = "controller"
channel = "torque"
"#;

/// A ball that bounces, and then slides until it rolls.
const BALL: &str = r#"
[simulation]
gravity = [0, 0, -9.81]
t_end = 1.5
output_step = 0.01
[[body]]
name = "ball"
mass = 2
inertia = [0.01, 0.01, 0.01]
position = [0, 0, 0.3]
velocity = [2, 0.5, 0]
[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["ground", "ball"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
params = { radius = "10 cm", restitution = 0.4, mu = 0.3 }
[[output]]
name = "z"
quantity = "position"
of = "ball"
component = "z"
[[output]]
name = "spin"
quantity = "angular_velocity"
of = "ball"
component = "y"
"#;

/// The twin of the motor in Python.
struct Motor(MotorParameters);

#[derive(Debug, Clone, Copy, Parameters)]
struct MotorParameters {
    /// How late.
    #[param(unit = "s", above = 0.0)]
    time_constant: f64,
    /// Largest torque.
    #[param(unit = "N m", above = 0.0)]
    limit: f64,
}

impl Element for Motor {
    const NAME: &'static str = "motor-twin";
    const SUMMARY: &'static str = "a torque that follows late";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
    type Parameters = MotorParameters;
    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Force for Motor {
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("torque", "N m", "")];
    const INPUTS: &'static [InputSpec] = &[InputSpec::optional("demand", "N m", 0.0, "")];
    const CHECKS: &'static [ChannelSpec] = &[ChannelSpec::new("reserve", "N m", "is asked for more")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.torque_pair(0, 1, at.frames()[0].z() * at.states[0]);
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let wanted = at.inputs[0].clamp(-self.0.limit, self.0.limit);
        out.push((wanted - at.states[0]) / self.0.time_constant);
    }
    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(S::from(self.0.limit) - at.inputs[0].abs());
    }
}

/// The twin of the controller in Python.
struct SpeedController(SpeedControllerParameters);

#[derive(Debug, Clone, Copy, Parameters)]
struct SpeedControllerParameters {
    /// Speed.
    #[param(unit = "rad/s")]
    target: f64,
    /// Torque per error.
    #[param(unit = "N m s/rad")]
    gain: f64,
    /// Torque per sum.
    #[param(unit = "N m/rad", default = 0.0)]
    integral: f64,
    /// Period.
    #[param(unit = "s", above = 0.0)]
    period: f64,
}

impl Element for SpeedController {
    const NAME: &'static str = "speed-controller-twin";
    const SUMMARY: &'static str = "a controller that samples";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = SpeedControllerParameters;
    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Control for SpeedController {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("speed", "rad/s", "")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("torque", "N m", "")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0; 2]
    }
    fn sample_period(&self) -> Option<f64> {
        Some(self.0.period)
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let error = S::from(self.0.target) - at.inputs[0];
        let total = at.memory[1] + error * self.0.period;
        out.push(S::from(self.0.gain) * error + S::from(self.0.integral) * total);
        out.push(total);
    }
}

#[test]
fn angles_masses_states_signals_and_memory_are_those_in_rust_bit_for_bit() {
    let words = [
        ("revolute", "hinge"),
        ("rotational-inerter", "flywheel"),
        ("motor-twin", "motor"),
        ("speed-controller-twin", "speed-controller"),
    ];
    for sets in WAYS {
        compare(DRIVE, &words, sets);
    }
}

#[test]
fn contacts_with_friction_are_those_in_rust_bit_for_bit() {
    for sets in WAYS {
        compare(BALL, &[("plane-contact", "floor")], sets);
    }
}

#[test]
fn every_element_of_the_file_passes_the_test_kit_and_costs_what_it_does_in_rust() {
    let catalog = catalog();
    let verdict = |name: &str, given: &[&str]| {
        let element = catalog.find(name, None).unwrap();
        let texts: Vec<String> = given.iter().map(ToString::to_string).collect();
        examine(&element, &Given::read(&texts).unwrap_or_else(|_| panic!("{given:?}")), &[])
            .unwrap_or_else(|_| panic!("{name}"))
    };
    let own = catalog.elements().filter(|element| element.library.package == "mechanics");
    let names: Vec<String> = own.map(|element| element.full_name()).collect();
    assert_eq!(names.len(), 7);
    for name in &names {
        let found = verdict(name, &[]);
        assert!(found.passed(), "{name}: {:?}", found.checks);
    }
    let laws = ["damping=1", "force_of_elongation=3 x^3", "force_of_speed=2 v^3"];
    for (rust, python, given) in [
        ("distance-rod", "rod", &[][..]),
        ("translational-spring-damper", "spring-damper", &laws[..]),
        ("revolute", "hinge", &[]),
        ("plane-contact", "floor", &["mu=0.3"]),
    ] {
        let operations = |name: &str| verdict(name, given).cost.unwrap().traced.unwrap().operations;
        assert_eq!(operations(python), operations(rust), "{python}");
    }
}

#[test]
fn a_file_is_pinned_packed_and_installed_like_a_library_for_every_machine() {
    let scratch = Scratch::new();
    let file = folder().join("mechanics.odyn-element");
    let hash = sha256_of(&file).unwrap();
    let scene = |pin: &str| {
        let head = format!("[plugins]\nlibraries = [{{ name = \"mechanics\", {pin} }}]\n");
        let own = RODS.replace("distance-rod", "rod").replace("translational-spring-damper", "spring-damper");
        scratch.file("scene.toml", head + &own)
    };
    let open = |pin: &str| Session::open(&scene(pin), &options(&[], &[]));
    assert!(open("version = \"0.1\"").is_err_and(|error| error.to_string().contains("ODY0401")));
    let package = Package::new(&file, "[]".into(), vec![("LICENSE".into(), b"MIT".to_vec())]).unwrap();
    assert_eq!(package.info.target, "any");
    let archive = scratch.file(&package.info.file_name(), package.to_bytes().unwrap());
    let store = Store::new(scratch.path().join(".odyn/plugins"));
    let (installed, new) = store.add(&Package::read(&archive).unwrap(), None).unwrap();
    assert!(new && installed.problems().is_empty());
    let session = open(&format!("version = \"0.1\", sha256 = \"{hash}\"")).unwrap_or_else(|error| panic!("{error}"));
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0);
    let wrong = format!("sha256 = \"{}\"", hash.chars().rev().collect::<String>());
    assert!(open(&wrong).is_err_and(|error| error.to_string().contains("ODY0421")));
}

#[test]
fn a_damaged_file_is_refused_with_its_line() {
    let scratch = Scratch::new();
    let text = fs::read_to_string(folder().join("mechanics.odyn-element")).unwrap();
    let line = 1 + text.lines().position(|line| line.contains("= powi v0 2")).unwrap();
    scratch.file("mechanics.odyn-element", text.replacen("powi v0 2", "powi v99 2", 1));
    let scene = scratch.file("scene.toml", format!("[plugins]\nlibraries = [\"mechanics\"]\npath = [\".\"]\n{RODS}"));
    let error = Session::open(&scene, &options(&[], &[])).err().unwrap().to_string();
    for part in ["ODY0830", &format!("line {line}"), "`v99` is no value that comes before", "mechanics.odyn-element"] {
        assert!(error.contains(part), "{part}: {error}");
    }
}
