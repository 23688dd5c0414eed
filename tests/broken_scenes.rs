//! What a user reads when something is wrong. Every case is a sound scene with one change; the whole message is pinned in
//! `snapshots/`, so that a look into that folder is a look at the program from its unfriendly side.
//!
//! A new case is a line in [`CASES`]; `INSTA_UPDATE=always cargo test -p odyn-tests` writes its snapshot.

use std::path::{Path, PathBuf};

use odyn::catalog::Store;

use odyn::diagnostics::{Code, codes, render};
use odyn::session::{Exit, Session, SessionError};

use crate::fixtures;
use crate::support::{Scratch, options};

/// A pendulum with a spring.
const SOUND: &str = r#"title = "Pendulum"

[plugins]
libraries = ["joints", "forces"]

[parameters]
rod.length = "0.5 m"
rod.mass = "2 kg"

[simulation]
gravity = [0, -9.81, 0]
t_end = 0.1
output_step = 0.05

[[body]]
name = "rod"
mass = "rod.mass"
inertia = [0.01, 0.05, 0.05]
position = ["rod.length / 2", 0, 0]

[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "rod"]
point = [0, 0, 0]
axis = [0, 0, 1]

[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "rod"]
frames = [{ position = [0, 1, 0] }, { position = ["rod.length / 2", 0, 0] }]
params.stiffness = "20 N/m"
params.free_length = "40 cm"

[[output]]
name = "angle"
quantity = "coordinate"
of = "pivot"
channel = "angle"
"#;

/// Where further elements are put in.
const OUTPUTS: &str = "[[output]]";

/// A mistake and what becomes of it.
struct Case {
    name: &'static str,
    /// Texts of the sound scene and what stands there instead.
    changes: &'static [(&'static str, &'static str)],
    /// `--set` texts.
    sets: &'static [&'static str],
    /// Libraries of `fixtures/` whose folder is on the search path.
    fixtures: &'static [&'static str],
    exit: Exit,
    /// The codes found, in the order of the message.
    codes: &'static [Code],
}

const fn case(
    name: &'static str,
    changes: &'static [(&'static str, &'static str)],
    exit: Exit,
    codes: &'static [Code],
) -> Case {
    Case { name, changes, sets: &[], fixtures: &[], exit, codes }
}

impl Case {
    const fn set(mut self, sets: &'static [&'static str]) -> Self {
        self.sets = sets;
        self
    }
    const fn with(mut self, fixtures: &'static [&'static str]) -> Self {
        self.fixtures = fixtures;
        self
    }
}

use Exit::{Assembly, Integration, Plugin, Scene};

#[rustfmt::skip]
const CASES: &[Case] = &[
    // The text.
    case("not_toml", &[("mass = \"rod.mass\"", "mass = rod.mass")], Scene, &[codes::SYNTAX]),
    case("typo_in_a_key", &[("position = [\"", "positon = [\"")], Scene, &[codes::UNKNOWN_KEY]),
    case("typo_in_a_header", &[("[[joint]]", "[[joints]]")], Scene, &[codes::UNKNOWN_KEY]),
    case("key_given_twice", &[("t_end = 0.1", "t_end = 0.1\nt_end = 0.2")], Scene, &[codes::DUPLICATE_KEY]),
    case("missing_key", &[("mass = \"rod.mass\"\n", "")], Scene, &[codes::MISSING_KEY]),
    case("text_instead_of_a_list", &[("axis = [0, 0, 1]", "axis = \"z\"")], Scene, &[codes::WRONG_TYPE]),
    case("two_components", &[("axis = [0, 0, 1]", "axis = [0, 1]")], Scene, &[codes::WRONG_LENGTH]),
    case("duplicate_name", &[("name = \"spring\"", "name = \"pivot\"")], Scene, &[codes::DUPLICATE_NAME]),
    case("body_called_ground", &[("name = \"rod\"", "name = \"ground\"")], Scene, &[codes::BAD_NAME]),
    case("axis_of_no_length", &[("axis = [0, 0, 1]", "axis = [0, 0, 0]")], Scene, &[codes::NO_DIRECTION]),
    case("mirror_image", &[("inertia", "orientation = { matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]] }\ninertia")], Scene, &[codes::NOT_A_ROTATION]),
    case("end_before_the_start", &[("t_end = 0.1", "t_end = -1")], Scene, &[codes::OUT_OF_RANGE]),
    case("endless", &[("t_end = 0.1", "t_end = inf")], Scene, &[codes::NOT_FINITE]),
    // Quantities.
    case("unknown_unit", &[("2 kg", "2 kgs")], Scene, &[codes::UNKNOWN_UNIT]),
    case("unit_of_another_dimension", &[("t_end = 0.1", "t_end = \"10 cm\"")], Scene, &[codes::DIMENSION]),
    case("length_plus_mass", &[("rod.length / 2\", 0, 0]\n\n[[joint", "rod.length + rod.mass\", 0, 0]\n\n[[joint")], Scene, &[codes::MIXED_DIMENSIONS]),
    case("length_plus_number", &[("rod.length / 2\", 0, 0]\n\n[[joint", "rod.length + 1\", 0, 0]\n\n[[joint")], Scene, &[codes::NEEDS_UNIT]),
    case("unknown_parameter", &[("rod.length / 2\", 0, 0]\n\n[[joint", "rod.lenght / 2\", 0, 0]\n\n[[joint")], Scene, &[codes::UNKNOWN_PARAMETER]),
    case("incomplete_expression", &[("rod.length / 2\", 0, 0]\n\n[[joint", "rod.length /\", 0, 0]\n\n[[joint")], Scene, &[codes::EXPRESSION_SYNTAX]),
    case("function_of_other_programs", &[("params.stiffness = \"20 N/m\"", "params.stiffness = \"if(1, 20 N/m, 30 N/m)\"")], Scene, &[codes::EXPRESSION_SYNTAX]),
    case("division_by_zero", &[("\"2 kg\"", "\"2 kg / 0\"")], Scene, &[codes::NO_VALUE]),
    case("cyclic_parameters", &[("rod.length = \"0.5 m\"", "rod.length = \"2 * rod.half\"\nrod.half = \"rod.length / 2\"")], Scene, &[codes::PARAMETER_CYCLE]),
    // The model.
    case("signal_of_another_quantity", &[("[[output]]", "[[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\ninputs.x = \"angle\"\n\n[[output]]")], Scene, &[codes::DIMENSION]),
    case("inerter_of_no_length", &[("translational-spring-damper", "inerter"), ("{ position = [0, 1, 0] }, { position = [\"rod.length / 2\", 0, 0] }", "{}, { position = [\"-rod.length / 2\", 0, 0] }"), ("params.stiffness = \"20 N/m\"\nparams.free_length = \"40 cm\"", "params.inertance = 1")], Scene, &[codes::BAD_PLACEMENT]),
    case("missing_body", &[("bodies = [\"ground\", \"rod\"]\npoint", "bodies = [\"ground\", \"rood\"]\npoint")], Scene, &[codes::UNKNOWN_BODY]),
    case("typo_in_a_type", &[("\"revolute\"", "\"revolut\"")], Scene, &[codes::UNKNOWN_TYPE]),
    case("forgotten_library", &[("\"joints\", \"forces\"", "\"joints\"")], Scene, &[codes::UNKNOWN_TYPE]),
    case("force_as_a_joint", &[("\"revolute\"", "\"translational-spring-damper\"")], Scene, &[codes::WRONG_KIND]),
    case("control_element", &[("[[force]]", "[[control]]")], Scene, &[codes::WRONG_KIND]),
    case("joint_of_a_body_with_itself", &[("bodies = [\"ground\", \"rod\"]\npoint", "bodies = [\"rod\", \"rod\"]\npoint")], Scene, &[codes::SELF_JOINT]),
    case("joint_of_the_ground_with_itself", &[("bodies = [\"ground\", \"rod\"]\npoint", "bodies = [\"ground\", \"ground\"]\npoint")], Scene, &[codes::SELF_JOINT]),
    case("too_few_bodies", &[("bodies = [\"ground\", \"rod\"]\npoint", "bodies = [\"rod\"]\npoint")], Scene, &[codes::BODY_COUNT]),
    case("zero_mass", &[("2 kg", "0 kg")], Scene, &[codes::BAD_MASS]),
    case("negative_inertia", &[("[0.01, 0.05, 0.05]", "[0.01, -0.05, 0.05]")], Scene, &[codes::BAD_INERTIA]),
    case("typo_in_a_parameter", &[("params.stiffness", "params.stifness")], Scene, &[codes::UNKNOWN_ELEMENT_PARAMETER, codes::MISSING_ELEMENT_PARAMETER]),
    case("missing_parameter", &[("params.stiffness = \"20 N/m\"\n", "")], Scene, &[codes::MISSING_ELEMENT_PARAMETER]),
    case("parameter_out_of_range", &[("\"20 N/m\"", "\"-20 N/m\"")], Scene, &[codes::ELEMENT_PARAMETER_RANGE]),
    case("parameter_of_another_dimension", &[("\"20 N/m\"", "\"20 N\"")], Scene, &[codes::DIMENSION]),
    case("list_for_a_number", &[("\"20 N/m\"", "[20, 30]")], Scene, &[codes::WRONG_TYPE]),
    case("element_that_refuses", &[
        ("\"forces\"]", "\"forces\", \"compressor\"]"),
        (OUTPUTS, "[[force]]\nname = \"motor\"\ntype = \"motor-torque\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n[force.params]\ncurve = [[0, 1], [100, 0.5], [200, 0]]\nbreakdown_slip = 0.2\n\n[[output]]"),
    ], Scene, &[codes::ELEMENT_REFUSES]),
    case("parallel_axes", &[("axis = [0, 0, 1]", "axis = [0, 0, 1]\nx_axis = [0, 0, 2]")], Scene, &[codes::NO_DIRECTION]),
    case("unknown_quantity", &[("\"coordinate\"", "\"coordinat\"")], Scene, &[codes::UNKNOWN_QUANTITY]),
    case("output_of_nothing", &[("of = \"pivot\"", "of = \"pivott\"")], Scene, &[codes::UNKNOWN_TARGET]),
    case("unknown_component", &[("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"position\"\nof = \"rod\"\ncomponent = \"u\"")], Scene, &[codes::UNKNOWN_COMPONENT]),
    case("unknown_channel", &[("channel = \"angle\"", "channel = \"angel\"")], Scene, &[codes::UNKNOWN_CHANNEL]),
    case("figure_of_nothing", &[("channel = \"angle\"\n", "channel = \"angle\"\n\n[[figure]]\nname = \"f\"\nchannel = \"angel\"\ntake = \"at\"\nwhere = \"angle\"\nequals = \"2 m\"\nover = \"anglo\"\n")], Scene, &[codes::UNKNOWN_CHANNEL, codes::UNKNOWN_CHANNEL, codes::DIMENSION]),
    case("figure_in_another_unit", &[("channel = \"angle\"\n", "channel = \"angle\"\n\n[[figure]]\nname = \"f\"\nchannel = \"angle\"\ntake = \"max\"\nunit = \"deg\"\n")], Scene, &[codes::FIGURE_UNIT]),
    case("figure_in_an_unreadable_unit", &[("channel = \"angle\"\n", "channel = \"angle\"\n\n[[figure]]\nname = \"f\"\nchannel = \"angle\"\ntake = \"max\"\nunit = \"Nm\"\n")], Scene, &[codes::UNKNOWN_UNIT]),
    case("parameter_beside_params", &[("params.stiffness = \"20 N/m\"\n", "stiffness = \"20 N/m\"\n")], Scene, &[codes::UNKNOWN_KEY]),
    case("fixed_body_that_moves", &[("position = [\"rod.length / 2\", 0, 0]\n", "position = [\"rod.length / 2\", 0, 0]\nfixed = true\nvelocity = [1, 0, 0]\nangular_velocity = [0, 0, 0]\n")], Scene, &[codes::CONFLICTING_KEYS]),
    case("energy_of_one_body", &[("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"kinetic_energy\"\nof = \"rod\"")], Scene, &[codes::CONFLICTING_KEYS]),
    case("torque_about_a_point", &[("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"reaction_torque\"\nof = \"pivot\"\ncomponent = \"z\"\npoint = [1, 0, 0]")], Scene, &[codes::CONFLICTING_KEYS]),
    case("orientation_against_a_body", &[("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"orientation\"\nof = \"rod\"\ncomponent = \"e0\"\nframe = \"rod\"")], Scene, &[codes::CONFLICTING_KEYS]),
    case("component_of_an_angle", &[("channel = \"angle\"", "component = \"x\"\nchannel = \"angle\"")], Scene, &[codes::CONFLICTING_KEYS]),
    case("nothing_moves", &[("name = \"rod\"", "name = \"rod\"\nfixed = true"), ("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"total_energy\""), ("[[joint]]", "[[joint]]\nenabled = false"), ("[[force]]", "[[force]]\nenabled = false")], Scene, &[codes::NOTHING_TO_DO]),
    case("unknown_method", &[("t_end", "method = \"dop835\"\nt_end")], Scene, &[codes::UNKNOWN_METHOD]),
    case("unknown_engine", &[("t_end", "engine = \"referense\"\nt_end")], Scene, &[codes::UNKNOWN_METHOD]),
    case("several_mistakes_at_once", &[
        ("mass = \"rod.mass\"", "mas = \"rod.mass\""), ("[0.01, 0.05, 0.05]", "[0.01, \"0.05 m\", 0.05]"),
        ("axis = [0, 0, 1]", "axis = [0, 0]"), ("\"20 N/m\"", "\"20 N/m"), ("t_end", "t_edn"),
    ], Scene, &[codes::SYNTAX]),
    case("several_mistakes_of_meaning", &[
        ("mass = \"rod.mass\"", "mas = \"rod.mass\""), ("[0.01, 0.05, 0.05]", "[0.01, \"0.05 m\", 0.05]"),
        ("axis = [0, 0, 1]", "axis = [0, 0]"), ("t_end", "t_edn"),
    ], Scene, &[codes::MISSING_KEY, codes::UNKNOWN_KEY, codes::MISSING_KEY, codes::UNKNOWN_KEY, codes::DIMENSION, codes::WRONG_LENGTH]),
    // The command line.
    case("set_without_a_value", &[], Scene, &[codes::BAD_OVERRIDE]).set(&["rod.mass"]),
    case("set_of_something_unknown", &[], Scene, &[codes::BAD_OVERRIDE]).set(&["rodd.mass=3"]),
    case("set_to_another_dimension", &[], Scene, &[codes::DIMENSION]).set(&["simulation.t_end=3 kg"]),
    // Libraries.
    case("missing_library", &[("\"forces\"", "\"force\"")], Plugin, &[codes::PLUGIN_NOT_FOUND]),
    case("not_a_library", &[("\"forces\"", "\"./scene.toml\"]\npath = [\".\"")], Plugin, &[codes::NOT_A_LIBRARY]),
    case("library_of_another_interface", &[("\"forces\"", "\"other-abi-plugin\"")], Plugin, &[codes::ABI_VERSION]).with(&["other-abi-plugin"]),
    case("element_of_two_libraries", &[
        ("\"forces\"]", "\"good-plugin\", \"other/FILE\"]\npath = [\".\"]"),
    ], Plugin, &[codes::DUPLICATE_ELEMENT]).with(&["good-plugin"]),
    case("panic_in_new", &[
        ("\"forces\"", "\"forces\", \"panicking-plugin\""), ("\"revolute\"", "\"panicking-joint\"\nparams.place = \"new\""),
    ], Plugin, &[codes::PLUGIN_PANICKED]).with(&["panicking-plugin"]),
    case("panic_in_residual", &[
        ("\"forces\"", "\"forces\", \"panicking-plugin\""), ("\"revolute\"", "\"panicking-joint\"\nparams.place = \"residual\""),
    ], Plugin, &[codes::PLUGIN_PANICKED]).with(&["panicking-plugin"]),
    case("panic_while_running", &[
        ("\"forces\"", "\"forces\", \"panicking-plugin\""),
        (OUTPUTS, "[[force]]\nname = \"trap\"\ntype = \"panicking-force\"\nbodies = [\"ground\", \"rod\"]\nparams = { place = \"wrench\", after = 40 }\n\n[[output]]"),
    ], Plugin, &[codes::PLUGIN_PANICKED]).with(&["panicking-plugin"]),
    case("constant_that_is_no_number", &[
        ("\"forces\"", "\"forces\", \"nan-plugin\""), ("\"revolute\"", "\"nan-rod\"\nparams.square = \"-1 m^2\""),
        ("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"total_energy\""),
    ], Plugin, &[codes::PLUGIN_MISBEHAVED]).with(&["nan-plugin"]),
    case("forgotten_row", &[
        ("\"forces\"", "\"forces\", \"short-rows-plugin\""), ("\"revolute\"", "\"short-rows\""),
        ("\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"", "\"total_energy\""),
    ], Plugin, &[codes::PLUGIN_MISBEHAVED]).with(&["short-rows-plugin"]),
    // Functions, signals, checks, particles.
    case("typo_in_a_function", &[(OUTPUTS, "[[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\nparams.of_time = \"3 sin(2 pi tt)\"\n\n[[output]]")], Scene, &[codes::UNKNOWN_PARAMETER]),
    case("function_of_another_dimension", &[(OUTPUTS, "[[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\nparams.of_time = \"20 N sin(2 pi t/1 s)\"\n\n[[output]]")], Scene, &[codes::DIMENSION]),
    case("time_is_no_angle", &[(OUTPUTS, "[[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\nparams.of_time = \"20 N m * sin(t)\"\n\n[[output]]")], Scene, &[codes::MIXED_DIMENSIONS]),
    case("points_that_do_not_increase", &[(OUTPUTS, "[[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\nparams.of_speed = [[0, 1], [2, 0.5], [1, 0]]\n\n[[output]]")], Scene, &[codes::OUT_OF_RANGE]),
    case("unknown_choice", &[(OUTPUTS, "[[force]]\nname = \"friction\"\ntype = \"joint-friction\"\njoints = [\"pivot\"]\nparams = { kind = \"rotatoin\", mu = 0.1 }\n\n[[output]]")], Scene, &[codes::UNKNOWN_WORD]),
    case("friction_of_an_unknown_joint", &[(OUTPUTS, "[[force]]\nname = \"friction\"\ntype = \"joint-friction\"\njoints = [\"pivto\"]\nparams = { kind = \"rotation\", mu = 0.1, radius = 0.01 }\n\n[[output]]")], Scene, &[codes::UNKNOWN_TARGET]),
    case("signals_for_a_joint", &[("type = \"revolute\"", "type = \"revolute\"\ninputs.speed = \"angle\"")], Scene, &[codes::UNKNOWN_ELEMENT_PARAMETER]),
    case("unknown_signal", &[(OUTPUTS, "[[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\ninputs.signal = \"angel\"\n\n[[output]]")], Scene, &[codes::UNKNOWN_TARGET]),
    case("signal_of_another_dimension", &[("\"forces\"]", "\"forces\", \"controls\"]"), (OUTPUTS, "[[control]]\nname = \"lag\"\ntype = \"gain\"\ninputs.input = \"pivot.angel\"\n\n[[output]]")], Scene, &[codes::UNKNOWN_CHANNEL]),
    case("nothing_connected", &[("\"forces\"]", "\"forces\", \"controls\"]"), (OUTPUTS, "[[control]]\nname = \"half\"\ntype = \"gain\"\nparams.gain = 0.5\n\n[[output]]")], Scene, &[codes::MISSING_ELEMENT_PARAMETER]),
    case("signal_that_depends_on_itself", &[("\"forces\"]", "\"forces\", \"controls\"]"), (OUTPUTS, "[[control]]\nname = \"a\"\ntype = \"gain\"\ninputs.input = \"b.output\"\n[[control]]\nname = \"b\"\ntype = \"gain\"\ninputs.input = \"a.output\"\n\n\n[[output]]")], Scene, &[codes::SIGNAL_LOOP]),
    case("check_of_an_unknown_output", &[(OUTPUTS, "[[check]]\nname = \"swing\"\nkind = \"position\"\nvalue = \"angel\"\nreference = 0\ntolerance = 1\n\n[[output]]")], Scene, &[codes::UNKNOWN_PARAMETER]),
    case("check_of_an_unknown_kind", &[(OUTPUTS, "[[check]]\nname = \"swing\"\nkind = \"positon\"\nvalue = \"angle\"\nreference = 0\ntolerance = 1\n\n[[output]]")], Scene, &[codes::UNKNOWN_WORD]),
    case("particle_with_an_inertia", &[("inertia = [", "particle = true\ninertia = [")], Scene, &[codes::CONFLICTING_KEYS]),
    case("particle_that_has_to_turn", &[("inertia = [0.01, 0.05, 0.05]", "particle = true")], Integration, &[codes::TORQUE_ON_PARTICLE]),
    // Assembly.
    case("lengths_that_do_not_fit", &[
        (OUTPUTS, "[[joint]]\nname = \"far_end\"\ntype = \"spherical\"\nbodies = [\"ground\", \"rod\"]\nframes = [{ position = [2, 0, 0] }, { position = [\"rod.length / 2\", 0, 0] }]\n\n[[output]]"),
    ], Assembly, &[codes::CANNOT_ASSEMBLE]),
    case("pins_that_are_parallel", &[
        ("type = \"revolute\"", "type = \"universal\""),
        ("channel = \"angle\"", "channel = \"angle_i\""),
    ], Assembly, &[codes::CANNOT_ASSEMBLE]),
    case("joint_that_is_not_defined", &[
        (OUTPUTS, "[[joint]]\nname = \"drive\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\nparams.angle = \"1 rad * ln(t / 1 s)\"\n\n[[output]]"),
    ], Assembly, &[codes::CANNOT_ASSEMBLE]),
    case("joint_far_from_its_bodies", &[
        ("point = [0, 0, 0]\naxis = [0, 0, 1]", "frames = [{ position = [5, 0, 0] }, { position = [0, 0, 0] }]"),
    ], Assembly, &[codes::ASSEMBLY_JUMP]),
];

/// A scene in a folder of its own, with what it refers to.
struct Written {
    scratch: Scratch,
    scene: PathBuf,
    plugins: Vec<PathBuf>,
}

fn write(case: &Case) -> Written {
    let scratch = Scratch::new();
    let mut text = SOUND.to_string();
    for (old, new) in case.changes {
        assert!(text.contains(old), "{}: the scene has no `{old}`", case.name);
        text = text.replacen(old, new, 1);
    }
    let plugins: Vec<PathBuf> = case.fixtures.iter().map(|name| fixtures::build(name)).collect();
    if text.contains("other/FILE") {
        // Other bytes, or it would be the same library again. What follows the end of a library is never looked at.
        let other = scratch.path().join("other");
        std::fs::create_dir_all(&other).unwrap();
        let mut bytes = std::fs::read(fixtures::file(&plugins[0], "good-plugin")).unwrap();
        bytes.push(0);
        let file = fixtures::file(&other, "good-plugin");
        std::fs::write(&file, bytes).unwrap();
        text = text.replace("FILE", file.file_name().unwrap().to_str().unwrap());
    }
    let scene = scratch.file("scene.toml", text);
    Written { scratch, scene, plugins }
}

/// Opens and runs; the error of either.
fn fail(written: &Written, sets: &[&str]) -> Result<(), SessionError> {
    let session = Session::open(&written.scene, &options(sets, &written.plugins))?;
    session.run(Some(&written.scratch.path().join("out")), Box::new(|_| ()), &Default::default()).map(|_| ())
}

/// A message with what differs between machines replaced.
fn stable(text: &str, written: &Written) -> String {
    let program = std::env::current_exe().unwrap();
    let beside = program.parent().unwrap();
    let mut text = text.replace(&format!("{}/", written.scratch.path().display()), "");
    for plugins in &written.plugins {
        text = text.replace(&plugins.display().to_string(), "[strangers]");
    }
    // Whoever runs the tests may have installed libraries.
    if let Some(user) = Store::of_user() {
        text = text.replace(&format!("{}, ", user.folder().display()), "");
    }
    text = text.replace(&beside.display().to_string(), "[beside the program]");
    text = text.replace(&beside.parent().unwrap().display().to_string(), "[above the program]");
    // When an element fails depends on the steps taken.
    if let Some((before, after)) = text.split_once("failed at t = ") {
        let (_, after) = after.split_once(' ').unwrap();
        text = format!("{before}failed at t = [time] {after}");
    }
    text.replace(std::env::consts::DLL_SUFFIX, ".so")
}

#[test]
fn the_sound_scene_is_sound() {
    let written = write(&case("sound", &[], Scene, &[]));
    fail(&written, &[]).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn every_mistake_has_its_message() {
    assert!(CASES.len() >= 25);
    let mut failed = String::new();
    for case in CASES {
        let written = write(case);
        let Err(error) = fail(&written, case.sets) else {
            failed.push_str(&format!("\n{}: nothing is wrong with it", case.name));
            continue;
        };
        let text = stable(&error.render(false), &written);
        let found: Vec<Code> = error.diagnostics.iter().map(|diagnostic| diagnostic.code).collect();
        if found != case.codes || error.exit != case.exit {
            failed.push_str(&format!("\n{}: {found:?}, {:?}\n{text}", case.name, error.exit));
            continue;
        }
        check_place(case, &error, &written.scene);
        insta::assert_snapshot!(case.name, text);
    }
    assert!(failed.is_empty(), "{failed}");
}

/// The culprit of every error is named with file, line and column.
fn check_place(case: &Case, error: &SessionError, scene: &Path) {
    for diagnostic in &error.diagnostics {
        let place = diagnostic.span().unwrap_or_else(|| panic!("{}: `{}` has no place", case.name, diagnostic.message));
        let place = error.source.locate(place.start);
        assert!(place.line > 0 && place.column > 0);
        assert!(place.name == scene.display().to_string() || place.name == "command line", "{}", place.name);
        assert!(codes::explain(diagnostic.code.code).is_some(), "{}", diagnostic.code);
    }
    let text = error.render(false);
    assert!(!text.contains("stack backtrace") && !text.contains("RUST_BACKTRACE"), "{text}");
}

#[test]
fn names_of_cases_are_all_different() {
    let names: std::collections::BTreeSet<&str> = CASES.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), CASES.len());
}

#[test]
fn files_that_cannot_be_read_say_so() {
    let scratch = Scratch::new();
    let nowhere = Session::open(&scratch.path().join("nowhere.toml"), &options(&[], &[])).err().unwrap();
    let bytes = scratch.file("bytes.toml", b"title = \"\xff\"");
    let bytes = Session::open(&bytes, &options(&[], &[])).err().unwrap();
    let folder = Session::open(scratch.path(), &options(&[], &[])).err().unwrap();
    for error in [nowhere, bytes, folder] {
        assert_eq!(error.exit, Exit::Files);
        assert_eq!(error.diagnostics[0].code, codes::UNREADABLE);
        assert!(error.diagnostics[0].message.contains(&scratch.path().display().to_string()), "{error}");
    }
}

/// What is odd, but can be computed, is a warning with a place, and the run continues.
#[test]
fn velocities_that_contradict_the_joints_are_a_warning() {
    let velocities = &[("inertia", "velocity = [1, 0, 0]\nangular_velocity = [0, 0, 0]\ninertia")];
    let written = write(&Case { changes: velocities, ..case("velocities", &[], Scene, &[]) });
    let session = Session::open(&written.scene, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
    let found: Vec<Code> = session.warnings.iter().map(|warning| warning.code).collect();
    assert!(!found.is_empty() && found.iter().all(|code| *code == codes::INCONSISTENT_VELOCITIES), "{found:?}");
    insta::assert_snapshot!("velocities", stable(&render(&session.warnings, &session.scene.source, false), &written));
}

#[test]
fn positions_that_are_a_little_off_are_a_warning() {
    let position = &[("point = [0, 0, 0]\naxis", "points = [[0, 0, 0], [0.01, 0, 0]]\naxis")];
    let written = write(&Case { changes: position, ..case("position", &[], Scene, &[]) });
    let session = Session::open(&written.scene, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
    let found: Vec<Code> = session.warnings.iter().map(|warning| warning.code).collect();
    assert_eq!(found, [codes::ASSEMBLY_JUMP]);
    insta::assert_snapshot!("position", stable(&render(&session.warnings, &session.scene.source, false), &written));
}

/// Frames with axes alone are turned about these in some way: where that turns bodies, the warning names the key.
#[test]
fn x_axes_that_are_left_out_are_named_where_they_turn_bodies() {
    let joint = "type = \"constant-velocity\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxes = [[0, 0, 1], [3, 4, 12]]";
    let text = SOUND
        .replace("type = \"revolute\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]", joint)
        .replace(
            "\"coordinate\"\nof = \"pivot\"\nchannel = \"angle\"",
            "\"position\"\nof = \"rod\"\ncomponent = \"x\"",
        );
    let warnings_of = |text: &str| {
        let scratch = Scratch::new();
        let scene = scratch.file("scene.toml", text);
        Session::open(&scene, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}")).warnings
    };
    let found = warnings_of(&text);
    assert_eq!(found.iter().map(|warning| warning.code).collect::<Vec<_>>(), [codes::ASSEMBLY_JUMP]);
    assert!(found[0].help.iter().any(|help| help.starts_with("`pivot` has `axes` without `x_axes`")), "{found:?}");
    // The second frame is the first one, turned about an axis across both shafts.
    let fitting = text.replace("4, 12]]", "4, 12]]\nx_axes = [[1, 0, 0], [12.64, -0.48, -3]]");
    assert!(warnings_of(&fitting).is_empty());
}

/// Results up to the failure of an element are complete rows, and the summary says what happened.
#[test]
fn a_panic_while_running_leaves_valid_results() {
    let case = CASES.iter().find(|case| case.name == "panic_while_running").unwrap();
    let written = write(case);
    fail(&written, &["simulation.output_step=0.001"]).unwrap_err();
    let out = written.scratch.path().join("out");
    let table = odyn::results::Table::read(&out.join("results.csv")).unwrap();
    assert!(!table.times.is_empty() && table.times.len() < 101, "{} rows", table.times.len());
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"status\": \"failed\"") && summary.contains(codes::PLUGIN_PANICKED.code), "{summary}");
}

/// Stopping early is a result, not an error: exit code 6, and 7 where the audit is not content.
#[test]
fn ends_before_the_end_have_their_exit_codes() {
    let written = write(&case("sound", &[], Scene, &[]));
    let exit_of = |sets: &[&str]| {
        let session = Session::open(&written.scene, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"));
        session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
    };
    let stopped = exit_of(&["simulation.max_steps=1", "simulation.max_step=0.01"]);
    assert_eq!((stopped.exit_code(), stopped.summary.code), (6, Some(codes::TOO_MANY_STEPS)));
    assert!(stopped.summary.reason.contains("raise `max_steps`"), "{}", stopped.summary.reason);
    let stiff = exit_of(&["simulation.max_steps=300", "simulation.t_end=1000", "spring.params.damping=\"1e6 N s/m\""]);
    assert!(stiff.summary.reason.contains("`--method auto` takes few"), "{}", stiff.summary.reason);
    // A spring whose ends fall together has no direction.
    let directionless = exit_of(&["spring.frames=[{},{position=[-0.25,0,0]}]"]);
    assert_eq!((directionless.exit_code(), directionless.summary.code), (6, Some(codes::MOTION_NOT_FINITE)));
    let said = &directionless.summary.reason;
    assert!(said.contains("the points of `spring` on the ground and `rod` are together at t = 0 s"), "{said}");
    assert!(said.contains("not a finite number"), "{said}");
    assert_eq!(exit_of(&["simulation.audit_tolerance=1e-300"]).exit_code(), Exit::Audit as i32);
    assert_eq!(exit_of(&[]).exit_code(), 0);
}

/// What is wrong with an element's numbers is said at the element.
#[test]
fn numbers_that_cannot_be_computed_with_are_named_at_their_element() {
    let said = |element: &str| {
        let written = write(&case("more", &[], Scene, &[]));
        let text = format!("{}\n{element}\n", std::fs::read_to_string(&written.scene).unwrap());
        std::fs::write(&written.scene, text.replace("\"forces\"]", "\"forces\", \"controls\"]")).unwrap();
        fail(&written, &[]).expect_err("it cannot be computed").render(false)
    };
    let driver = "[[joint]]\nname = \"drive\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
                  params.angle = \"1/t\"";
    assert!(said(driver).contains("look at `angle = \"1/t\"`"), "{}", said(driver));
    let rod = "[[joint]]\nname = \"stay\"\ntype = \"distance-rod\"\nbodies = [\"ground\", \"rod\"]\npoints = [[0, 1, 0], [0.25, 0, 0]]\n\
               params.length = 1e300";
    assert!(said(rod).contains("`length` is too large to be computed with"), "{}", said(rod));
    let filter = "[[control]]\nname = \"filter\"\ntype = \"digital-filter\"\ninputs.input = \"angle\"\n\
                  params = { numerator = [1], denominator = [1], period = 1e-9 }";
    assert!(said(filter).contains("`filter` samples 1.0e8 times"), "{}", said(filter));
    let rotor = "[[body]]\nname = \"rotor\"\nmass = 2\ninertia = [0.02, 0.02, 0.02]\nposition = [0.1, 0, 0]\n\
                 angular_velocity = [0, 0, 20]\n[[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"ground\", \"rotor\"]\n\
                 point = [0, 0, 0]\n[[force]]\nname = \"rub\"\ntype = \"joint-friction\"\njoints = [\"bearing\"]\n\
                 params = { kind = \"rotation\", mu = 30, radius = 0.2, transition_speed = 1e-4 }";
    let rub = said(rotor);
    assert!(rub.contains("`rub` with mu = 30;"), "{rub}");
}

/// `point` puts the frames of a contact together, so that no place of the bodies helps.
#[test]
fn a_contact_whose_frames_are_at_one_place_is_told_of_points() {
    let scratch = Scratch::new();
    let text = "[plugins]\nlibraries = [\"joints\"]\n[units]\nlength = \"mm\"\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
         [[body]]\nname = \"ball\"\nmass = 1\ninertia = [100, 100, 100]\nposition = [0, 0, 100]\n\
         [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ball\"]\nparams.radius = 20\n";
    let said = |place: &str| {
        let scene = scratch.file("contact.toml", format!("{text}{place}\n"));
        let session = Session::open(&scene, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
        let run = session.run(None, Box::new(|_| ()), &Default::default());
        run.map(|_| ()).map_err(|error| error.to_string())
    };
    let together = said("point = [0, 0, 0]").unwrap_err();
    assert!(together.contains("-20") && together.contains(" mm at the start: on the wrong side"), "{together}");
    assert!(together.contains("give `points`, one for each body"), "{together}");
    assert!(!together.contains("move one of its bodies"), "{together}");
    assert_eq!(said("points = [[0, 0, 0], [0, 0, 100]]"), Ok(()));
}

/// A run that cannot begin does not leave a folder in which it seems to run for ever.
#[test]
fn a_run_that_does_not_begin_has_failed() {
    let scratch = Scratch::new();
    let scene = scratch.file(
        "sunk.toml",
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
         [[body]]\nname = \"ball\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [0, 0, 0.1]\n\
         [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"ball\"]\nparams.radius = 0.2\n\
         frames = [{}, {}]\n",
    );
    let out = scratch.path().join("out");
    let session = Session::open(&scene, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
    let error = session.run(Some(&out), Box::new(|_| ()), &Default::default()).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("on the wrong side"), "{error}");
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"status\": \"failed\"") && summary.contains("\"code\": \"ODY0501\""), "{summary}");
}
