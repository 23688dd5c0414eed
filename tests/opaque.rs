//! Opaque elements: called at run time with plain numbers instead of being recorded. The same equations give the same
//! motion both ways.

use element_api::adapt::{force, joint};
use element_api::manifest::Library;
use element_api::prelude::*;
use odyn::session::RunReport;

use crate::support::{assert_same_motion, root, run_linked, try_run_linked};

/// A hinge with the equations of a revolute joint.
struct Hinge<const OPAQUE: bool>;

impl<const OPAQUE: bool> Element for Hinge<OPAQUE> {
    const NAME: &'static str = if OPAQUE { "opaque-hinge" } else { "recorded-hinge" };
    const SUMMARY: &'static str = "hinge";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first body"), FrameSpec::new("j", "second body")];
    const ANGLES: usize = 1;
    const OPAQUE: bool = OPAQUE;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl<const OPAQUE: bool> Constraint for Hinge<OPAQUE> {
    const ROWS: &'static [&'static str] = &["x", "y", "z", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("angle", "rad", "rotation about z")];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
        blocks::parallel_z(&at.frames[0], &at.frames[1], rows);
    }

    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
}

/// A joint that moves its second point along a circle in the ground, so that its rows depend on time.
struct Driver<const OPAQUE: bool>;

impl<const OPAQUE: bool> Element for Driver<OPAQUE> {
    const NAME: &'static str = if OPAQUE { "opaque-driver" } else { "recorded-driver" };
    const SUMMARY: &'static str = "moves a point along a circle of 0.1 m, one turn in 2 pi / 3 s";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "centre"), FrameSpec::new("j", "the point")];
    const OPAQUE: bool = OPAQUE;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl<const OPAQUE: bool> Constraint for Driver<OPAQUE> {
    const ROWS: &'static [&'static str] = &["x", "y"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        let phase = at.time * 3.0;
        rows.push(d.x - phase.cos() * 0.1);
        rows.push(d.y - phase.sin() * 0.1);
    }
}

/// A spring and damper between two points, with a state: the elongation after a first-order filter.
struct Strut<const OPAQUE: bool>;

impl<const OPAQUE: bool> Element for Strut<OPAQUE> {
    const NAME: &'static str = if OPAQUE { "opaque-strut" } else { "recorded-strut" };
    const SUMMARY: &'static str = "spring, damper and filter between two points";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first end"), FrameSpec::new("j", "second end")];
    const OPAQUE: bool = OPAQUE;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl<const OPAQUE: bool> Strut<OPAQUE> {
    const STIFFNESS: f64 = 200.0;
    const FREE_LENGTH: f64 = 0.8;

    fn elongation<S: Scalar>(at: &Motion<'_, S>) -> S {
        length(at.frames()[1].position - at.frames()[0].position) - Self::FREE_LENGTH
    }
}

impl<const OPAQUE: bool> Force for Strut<OPAQUE> {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("length", "m", "of the strut"), ChannelSpec::new("filtered", "m", "filtered elongation")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("filtered", "m", "filtered elongation")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let direction = d / length(d);
        let rate = direction.dot(&at.relative_velocity(0, 1));
        let tension = Self::elongation(at) * Self::STIFFNESS + at.states[0] * 50.0 + rate * 2.0;
        out.force_pair(0, 1, direction * (-tension));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(Self::elongation(at) + Self::FREE_LENGTH);
        out.push(at.states[0]);
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((Self::elongation(at) - at.states[0]) * 20.0);
    }
}

fn library() -> Library {
    Library {
        package: "twins".into(),
        version: "1.0.0".into(),
        about: "Each element in two forms".into(),
        classes: vec![
            joint::<Hinge<false>>(),
            joint::<Hinge<true>>(),
            joint::<Driver<false>>(),
            joint::<Driver<true>>(),
            force::<Strut<false>>(),
            force::<Strut<true>>(),
        ],
    }
}

/// Runs a scene with the recorded and with the opaque form of the elements whose type begins with `FORM-`.
#[track_caller]
fn assert_twins_move_alike(scene: &str) -> RunReport {
    // What is called at run time cannot be pruned; its twin is not either.
    let scene = &scene.replacen("[simulation]", "[simulation]\nwithout = [\"kinematic\"]", 1);
    let recorded = run_linked(&scene.replace("FORM-", "recorded-"), library());
    let opaque = run_linked(&scene.replace("FORM-", "opaque-"), library());
    assert_same_motion(&opaque, &recorded, 1e-12);
    // A scene in which nothing moves would prove nothing.
    let moves = |column: &Vec<f64>| column.iter().any(|value| (value - column[0]).abs() > 1e-3);
    assert!(recorded.columns.iter().any(moves));
    recorded
}

const PENDULUM: &str = r#"
[simulation]
gravity = [0, -9.81, 0]
t_end = 2
output_step = 0.05
[[body]]
name = "rod"
mass = 2
inertia = [0.01, 0.2, 0.2]
position = [0.5, 0, 0]
angular_velocity = [0, 0, 8]
[[joint]]
name = "pivot"
type = "FORM-hinge"
bodies = ["ground", "rod"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[output]]
name = "angle"
quantity = "coordinate"
of = "pivot"
[[output]]
name = "spin"
quantity = "coordinate_rate"
of = "pivot"
[[output]]
name = "angular_acceleration"
quantity = "coordinate_acceleration"
of = "pivot"
[[output]]
name = "a_x"
quantity = "acceleration"
of = "rod"
component = "x"
[[output]]
name = "force_y"
quantity = "reaction_force"
of = "pivot"
on = "rod"
component = "y"
[[output]]
name = "energy"
quantity = "total_energy"
"#;

#[test]
fn a_joint_with_motion_reactions_and_turns() {
    let report = assert_twins_move_alike(PENDULUM);
    let angle = crate::support::column(&report, "angle");
    assert!(angle.iter().any(|angle| *angle > 7.0), "the pendulum turns over");
}

/// Redundant rows, four joints called in one batch.
#[test]
fn a_closed_loop() {
    let scene = std::fs::read_to_string(root().join("scenes/benchmarks/A02_N1.toml")).unwrap();
    let scene = scene
        .replace("\"revolute\"", "\"FORM-hinge\"")
        .replace("libraries = [\"joints\"]", "")
        .replace("t_end = 10", "t_end = 0.5");
    // Its reference lies beside the scene's file.
    let scene = scene.split("[[check]]").next().unwrap();
    let report = assert_twins_move_alike(scene);
    assert_eq!(report.summary.redundant_rows, 3);
}

#[test]
fn rows_that_depend_on_time() {
    let report = assert_twins_move_alike(
        r#"
[simulation]
gravity = [0, -9.81, 0]
t_end = 2
output_step = 0.05
# What an opaque element does over time is not known, so that its steps are no longer than this in any case.
max_step = 0.05
[[body]]
name = "bob"
mass = 1
inertia = [0.1, 0.1, 0.1]
position = [0.1, -1, 0]
com = [0, 0, 0]
[[joint]]
name = "driver"
type = "FORM-driver"
bodies = ["ground", "bob"]
frames = [{ position = [0, 0, 0] }, { position = [0, 1, 0] }]
[[output]]
name = "x"
quantity = "position"
of = "bob"
component = "x"
[[output]]
name = "v_y"
quantity = "velocity"
of = "bob"
component = "y"
[[output]]
name = "driver_x"
quantity = "position"
of = "bob"
point = [0, 1, 0]
component = "x"
[[output]]
name = "driver_force"
quantity = "reaction_force"
of = "driver"
on = "bob"
component = "x"
"#,
    );
    for (t, x) in report.times.iter().zip(crate::support::column(&report, "driver_x")) {
        assert!((x - 0.1 * (3.0 * t).cos()).abs() < 1e-13, "driven point at {t}: {x}");
    }
}

#[test]
fn a_force_with_a_state() {
    assert_twins_move_alike(
        r#"
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.05
[[body]]
name = "a"
mass = 1
inertia = [0.1, 0.2, 0.3]
position = [1, 0.2, 0.1]
angular_velocity = [1, 2, 3]
[[body]]
name = "b"
mass = 3
inertia = [0.1, 0.2, 0.3]
position = [2, -0.4, 0]
[[force]]
name = "to_ground"
type = "FORM-strut"
bodies = ["ground", "a"]
frames = [{ position = [0, 0, 0] }, { position = [0.1, 0, 0.05] }]
[[force]]
name = "between"
type = "FORM-strut"
bodies = ["a", "b"]
frames = [{ position = [0, 0.1, 0] }, { position = [0, 0, 0.2] }]
[[output]]
name = "length"
quantity = "value"
of = "between"
channel = "length"
[[output]]
name = "filtered"
quantity = "value"
of = "between"
channel = "filtered"
[[output]]
name = "a_y"
quantity = "position"
of = "a"
component = "y"
[[output]]
name = "force_on_b"
quantity = "force"
of = "between"
on = "b"
component = "x"
[[output]]
name = "torque_on_a"
quantity = "torque"
of = "to_ground"
on = "a"
component = "z"
"#,
    );
}

#[test]
fn the_formulation_of_the_paper_takes_opaque_elements_too() {
    let reference = "t_end = 0.5\nengine = \"reference\"";
    let opaque = PENDULUM.replace("FORM-", "opaque-");
    let paper = run_linked(&opaque.replace("t_end = 2", reference), library());
    let working = run_linked(&opaque.replace("t_end = 2", "t_end = 0.5"), library());
    assert_same_motion(&paper, &working, 1e-9);
}

/// A joint whose code fails whenever it is called.
struct Broken;

impl Element for Broken {
    const NAME: &'static str = "broken";
    const SUMMARY: &'static str = "fails";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first body"), FrameSpec::new("j", "second body")];
    const OPAQUE: bool = true;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Broken {
    const ROWS: &'static [&'static str] = &["x"];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {
        panic!("out of order");
    }
}

/// Also where nothing moves yet it is the element that is named, with its place, and the library that is to blame.
#[test]
fn an_element_that_fails_at_the_start_is_named() {
    let text = "[simulation]\nt_end = 1\noutput_step = 0.5\n[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n\
                [[joint]]\nname = \"e\"\ntype = \"broken\"\nbodies = [\"ground\", \"b\"]\n";
    let classes = vec![joint::<Broken>()];
    let library = Library { package: "test".into(), version: "1.0.0".into(), about: "test".into(), classes };
    let error = try_run_linked(text, library).expect_err("it fails");
    let found = &error.diagnostics[0];
    assert!(found.message.starts_with("`e` (test/broken) failed at the start: "), "{}", found.message);
    assert!(!found.labels.is_empty() && error.exit_code() == 4, "{error}");
}
