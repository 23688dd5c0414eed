#![allow(clippy::unwrap_used)] // in a test, the panic is the message
#![allow(unsafe_code)] // structs of a library are made here

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::fs;
use std::mem::offset_of;
use std::process::Command;

use element_api::adapt;
use element_api::prelude::*;
use element_api::recording::{Input, RawOp};

use super::table::{Element as RawElement, Plugin};
use super::*;

const HEADER: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../element-api/include/odyn_element.h"));

/// The numbers of the enumerations and simple macros of the header.
fn header_numbers() -> BTreeMap<String, u32> {
    let mut numbers = BTreeMap::new();
    for line in HEADER.lines() {
        let line = line.trim().trim_start_matches("enum {").trim_end_matches("};");
        for part in line.strip_prefix("#define ").unwrap_or(line).split(',') {
            let mut words = part.split_whitespace().filter(|word| *word != "=");
            if let (Some(name), Some(number)) = (words.next(), words.next())
                && let (true, Ok(number)) = (name.starts_with("ODYN_"), number.parse())
            {
                assert_eq!(numbers.insert(name.to_string(), number), None, "{name} twice");
            }
        }
    }
    numbers
}

#[test]
fn numbers_of_the_header_are_those_of_the_contract() {
    let mut header = header_numbers();
    let mut expect = |name: &str, number: u32| {
        assert_eq!(header.remove(name), Some(number), "{name}");
    };
    expect("ODYN_C_ABI", element_api::manifest::C_ABI);
    expect("ODYN_CONVENTIONS", element_api::manifest::CONVENTIONS);
    for (name, op) in [
        ("ADD", Op::Add(0, 0)),
        ("SUB", Op::Sub(0, 0)),
        ("MUL", Op::Mul(0, 0)),
        ("DIV", Op::Div(0, 0)),
        ("NEG", Op::Neg(0)),
        ("SQRT", Op::Sqrt(0)),
        ("SIN", Op::Sin(0)),
        ("COS", Op::Cos(0)),
        ("ATAN2", Op::Atan2(0, 0)),
        ("EXP", Op::Exp(0)),
        ("LN", Op::Ln(0)),
        ("TANH", Op::Tanh(0)),
        ("SELECT", Op::Select(0, 0, 0, 0)),
    ] {
        expect(&format!("ODYN_OP_{name}"), op.encode().code);
    }
    // Indices as the comments of the header give them, with frame (joint) 2, row 1, column (component) 2.
    for (name, input, index) in [
        ("TIME", Input::Time, 0),
        ("POSITION", Input::Position { frame: 2, component: 2 }, 8),
        ("ROTATION", Input::Rotation { frame: 2, row: 1, column: 2 }, 23),
        ("VELOCITY", Input::Velocity { frame: 2, component: 2 }, 8),
        ("ANGULAR_VELOCITY", Input::AngularVelocity { frame: 2, component: 2 }, 8),
        ("ANGLE_REFERENCE", Input::AngleReference(2), 2),
        ("STATE", Input::State(2), 2),
        ("MEMORY", Input::Discrete(2), 2),
        ("SIGNAL", Input::Signal(2), 2),
        ("COORDINATE", Input::Coordinate(2), 2),
        ("REACTION_FORCE", Input::ReactionForce { joint: 2, component: 2 }, 8),
        ("REACTION_TORQUE", Input::ReactionTorque { joint: 2, component: 2 }, 8),
        ("UNKNOWN", Input::Unknown(2), 2),
    ] {
        let RawOp { args, .. } = Op::Input(input).encode();
        expect(&format!("ODYN_IN_{name}"), args[0]);
        assert_eq!(args[1], index, "{name}");
    }
    for (name, role) in [
        ("ROW", Role::Residual(0)),
        ("FORCE", Role::Force(0)),
        ("TORQUE", Role::Torque(0)),
        ("ANGLE", Role::Angle(0)),
        ("COORDINATE", Role::Coordinate(0)),
        ("RATE", Role::StateRate(0)),
        ("MEMORY", Role::NextDiscrete(0)),
        ("CHANNEL", Role::Channel(0)),
        ("POTENTIAL", Role::Potential),
        ("DISSIPATION", Role::Dissipation),
        ("POSE_POSITION", Role::PosePosition(0)),
        ("POSE_ROTATION", Role::PoseRotation(0)),
        ("VELOCITY_ROW", Role::VelocityResidual(0)),
        ("SAMPLE_PERIOD", Role::SamplePeriod),
        ("UNILATERAL", Role::Unilateral(0)),
        ("STICKS_WITH", Role::SticksWith(0)),
        ("LIMIT", Role::Limit(0)),
        ("SLIDES_WITH", Role::SlidesWith(0)),
        ("KINETIC", Role::Kinetic),
        ("FLEXIBLE_FORCE", Role::FlexibleForce(0)),
        ("CONDITION", Role::Condition(0)),
        ("CHECK", Role::Check(0)),
    ] {
        expect(&format!("ODYN_OUT_{name}"), role.encode().0);
    }
    expect("ODYN_CLAMPED", element_api::Outside::Clamped.encode());
    expect("ODYN_PERIODIC", element_api::Outside::Periodic.encode());
    for (code, interpolation) in table::INTERPOLATIONS {
        expect(&format!("ODYN_{}", interpolation.name().to_uppercase()), code);
    }
    for (name, number) in [
        ("OK", table::OK as u32),
        ("FAULT", table::FAULT as u32),
        ("REFUSED", table::REFUSED as u32),
        ("ABSENT", table::ABSENT as u32),
        ("OPAQUE", table::OPAQUE),
        ("GIVES_DERIVATIVES", table::GIVES_DERIVATIVES),
        ("HAS_MOBILITY", table::HAS_MOBILITY),
        ("TURNS_FREELY", table::TURNS_FREELY),
        ("GIVES_POTENTIAL", table::GIVES_POTENTIAL),
        ("GIVES_DISSIPATION", table::GIVES_DISSIPATION),
        ("WANT_JACOBIAN", table::WANT_JACOBIAN),
        ("WANT_SECOND", table::WANT_SECOND),
    ] {
        expect(&format!("ODYN_{name}"), number);
    }
    // Kinds: what `describe` makes of each number is tested below.
    for (number, name) in ["JOINT", "FORCE", "CONTROL"].iter().enumerate() {
        expect(&format!("ODYN_{name}"), number as u32);
    }
    let kinds = ["NUMBER", "INTEGER", "BOOLEAN", "TEXT", "VECTOR", "LIST", "CURVE", "FUNCTION", "SURFACE"];
    for (number, name) in kinds.iter().enumerate() {
        expect(&format!("ODYN_{name}"), number as u32);
    }
    assert!(header.is_empty(), "numbers of the header that nothing holds: {header:?}");
    let interface = format!("#define ODYN_INTERFACE \"{}\"", element_api::manifest::INTERFACE);
    assert!(HEADER.contains(&interface), "the header is not of this version of element-api: {interface}");
}

/// The compiler itself compares: a program of assertions is checked, not run.
#[test]
fn structs_of_the_header_lie_in_memory_as_here() {
    let mut program = "#include \"odyn_element.h\"\n".to_string();
    let mut check = |name: &str, size: usize, fields: &[(&str, usize)]| {
        let mut assert = |what: String, value: usize| {
            program += &format!("_Static_assert({what} == {value}, \"{what}\");\n");
        };
        assert(format!("sizeof({name})"), size);
        for (field, offset) in fields {
            assert(format!("offsetof({name}, {field})"), *offset);
        }
        let body = HEADER.split(&format!("typedef struct {name} {{")).nth(1).expect("a struct of the header");
        let body = body.split(&format!("}} {name};")).next().expect("its end");
        let code: String = body.split("/*").map(|part| part.split_once("*/").map_or(part, |(_, code)| code)).collect();
        assert_eq!(code.matches(';').count(), fields.len(), "fields of {name}:{code}");
    };
    use table::{Error, Named, Parameter, Parameters, Recorder, Signal, Text, Value};
    // No macros here: each field is written once for its name and once for its place.
    let f = |name: &'static str, offset: usize| (name, offset);
    check(
        "odyn_plugin",
        size_of::<Plugin>(),
        &[
            f("size", offset_of!(Plugin, size)),
            f("abi", offset_of!(Plugin, abi)),
            f("conventions", offset_of!(Plugin, conventions)),
            f("reserved", offset_of!(Plugin, reserved)),
            f("elements", offset_of!(Plugin, elements)),
            f("element_count", offset_of!(Plugin, element_count)),
            f("manifest", offset_of!(Plugin, manifest)),
        ],
    );
    check(
        "odyn_named",
        size_of::<Named>(),
        &[f("name", offset_of!(Named, name)), f("unit", offset_of!(Named, unit)), f("doc", offset_of!(Named, doc))],
    );
    check(
        "odyn_signal",
        size_of::<Signal>(),
        &[
            f("name", offset_of!(Signal, name)),
            f("unit", offset_of!(Signal, unit)),
            f("doc", offset_of!(Signal, doc)),
            f("value", offset_of!(Signal, value)),
        ],
    );
    check(
        "odyn_parameter",
        size_of::<Parameter>(),
        &[
            f("name", offset_of!(Parameter, name)),
            f("kind", offset_of!(Parameter, kind)),
            f("optional", offset_of!(Parameter, optional)),
            f("unit", offset_of!(Parameter, unit)),
            f("doc", offset_of!(Parameter, doc)),
            f("value", offset_of!(Parameter, value)),
            f("range", offset_of!(Parameter, range)),
            f("choices", offset_of!(Parameter, choices)),
            f("variable", offset_of!(Parameter, variable)),
        ],
    );
    check("odyn_text", size_of::<Text>(), &[f("name", offset_of!(Text, name)), f("text", offset_of!(Text, text))]);
    check(
        "odyn_error",
        size_of::<Error>(),
        &[
            f("size", offset_of!(Error, size)),
            f("reserved", offset_of!(Error, reserved)),
            f("parameter", offset_of!(Error, parameter)),
            f("message", offset_of!(Error, message)),
        ],
    );
    check("odyn_value", size_of::<Value>(), &[f("tape", offset_of!(Value, tape)), f("node", offset_of!(Value, node))]);
    check(
        "odyn_parameters",
        size_of::<Parameters>(),
        &[
            f("size", offset_of!(Parameters, size)),
            f("reserved", offset_of!(Parameters, reserved)),
            f("context", offset_of!(Parameters, context)),
            f("number", offset_of!(Parameters, number)),
            f("integer", offset_of!(Parameters, integer)),
            f("text", offset_of!(Parameters, text)),
            f("numbers", offset_of!(Parameters, numbers)),
        ],
    );
    check(
        "odyn_recorder",
        size_of::<Recorder>(),
        &[
            f("size", offset_of!(Recorder, size)),
            f("reserved", offset_of!(Recorder, reserved)),
            f("context", offset_of!(Recorder, context)),
            f("constant", offset_of!(Recorder, constant)),
            f("input", offset_of!(Recorder, input)),
            f("operation", offset_of!(Recorder, operation)),
            f("power", offset_of!(Recorder, power)),
            f("real_power", offset_of!(Recorder, real_power)),
            f("table", offset_of!(Recorder, table)),
            f("function", offset_of!(Recorder, function)),
            f("result", offset_of!(Recorder, result)),
            f("surface", offset_of!(Recorder, surface)),
            f("slope", offset_of!(Recorder, slope)),
        ],
    );
    check(
        "odyn_element",
        size_of::<RawElement>(),
        &[
            f("size", offset_of!(RawElement, size)),
            f("kind", offset_of!(RawElement, kind)),
            f("name", offset_of!(RawElement, name)),
            f("summary", offset_of!(RawElement, summary)),
            f("doc", offset_of!(RawElement, doc)),
            f("flags", offset_of!(RawElement, flags)),
            f("angles", offset_of!(RawElement, angles)),
            f("mobility", offset_of!(RawElement, mobility)),
            f("memory", offset_of!(RawElement, memory)),
            f("frames", offset_of!(RawElement, frames)),
            f("frame_count", offset_of!(RawElement, frame_count)),
            f("rows", offset_of!(RawElement, rows)),
            f("row_count", offset_of!(RawElement, row_count)),
            f("channels", offset_of!(RawElement, channels)),
            f("channel_count", offset_of!(RawElement, channel_count)),
            f("states", offset_of!(RawElement, states)),
            f("state_count", offset_of!(RawElement, state_count)),
            f("inputs", offset_of!(RawElement, inputs)),
            f("input_count", offset_of!(RawElement, input_count)),
            f("joints", offset_of!(RawElement, joints)),
            f("joint_count", offset_of!(RawElement, joint_count)),
            f("parameters", offset_of!(RawElement, parameters)),
            f("parameter_count", offset_of!(RawElement, parameter_count)),
            f("difference_length", offset_of!(RawElement, difference_length)),
            f("difference_time", offset_of!(RawElement, difference_time)),
            f("create", offset_of!(RawElement, create)),
            f("destroy", offset_of!(RawElement, destroy)),
            f("uses_row", offset_of!(RawElement, uses_row)),
            f("start", offset_of!(RawElement, start)),
            f("record", offset_of!(RawElement, record)),
            f("evaluate", offset_of!(RawElement, evaluate)),
            f("accept", offset_of!(RawElement, accept)),
            f("save", offset_of!(RawElement, save)),
            f("load", offset_of!(RawElement, load)),
            f("velocity_row_count", offset_of!(RawElement, velocity_row_count)),
            f("examples", offset_of!(RawElement, examples)),
            f("example_count", offset_of!(RawElement, example_count)),
            f("exempt", offset_of!(RawElement, exempt)),
            f("exempt_count", offset_of!(RawElement, exempt_count)),
            f("unknowns", offset_of!(RawElement, unknowns)),
            f("unknown_count", offset_of!(RawElement, unknown_count)),
            f("guess", offset_of!(RawElement, guess)),
            f("more_frames", offset_of!(RawElement, more_frames)),
            f("most_frames", offset_of!(RawElement, most_frames)),
            f("reserved", offset_of!(RawElement, reserved)),
            f("with_frames", offset_of!(RawElement, with_frames)),
            f("checks", offset_of!(RawElement, checks)),
            f("check_count", offset_of!(RawElement, check_count)),
            f("catalog", offset_of!(RawElement, catalog)),
            f("report", offset_of!(RawElement, report)),
            f("values", offset_of!(RawElement, values)),
            f("value_count", offset_of!(RawElement, value_count)),
        ],
    );
    let include = concat!(env!("CARGO_MANIFEST_DIR"), "/../../element-api/include");
    let path = std::env::temp_dir().join(format!("odyn-layout-{}.c", std::process::id()));
    fs::write(&path, program).unwrap();
    let output = Command::new("cc").args(["-std=c11", "-fsyntax-only", "-I", include]).arg(&path).output();
    let _ = fs::remove_file(&path);
    match output {
        Err(_) if std::env::var_os("ODYN_SKIP_C").is_some() => (),
        Err(error) => panic!("`cc`: {error}; set ODYN_SKIP_C=1 to leave out the tests that need a C compiler"),
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
    }
}

extern "C-unwind" fn empty_record(_: *const c_void, _: *const table::Recorder, _: *mut table::Error) -> i32 {
    table::OK
}

extern "C-unwind" fn never(_: *const c_void, _: *const f64, _: u32, _: *mut f64, _: *mut table::Error) -> i32 {
    table::FAULT
}

/// A sound joint without rows.
fn sound() -> RawElement {
    // SAFETY: null pointers, no functions, and zeros are values of all its fields.
    let mut element: RawElement = unsafe { std::mem::zeroed() };
    element.size = size_of::<RawElement>() as u32;
    (element.name, element.summary) = (c"still".as_ptr(), c"does nothing".as_ptr());
    const FRAMES: &[table::Named] =
        &[table::Named { name: c"i".as_ptr(), unit: std::ptr::null(), doc: std::ptr::null() }];
    (element.frames, element.frame_count) = (FRAMES.as_ptr(), FRAMES.len());
    element.record = Some(empty_record);
    element
}

/// What [`describe::elements`] makes of a root with one element, at the given address.
fn read(element: *const RawElement, change: impl FnOnce(&mut Plugin)) -> Result<usize, OpenError> {
    let list = [element];
    let size = size_of::<Plugin>() as u32;
    let mut plugin = Plugin {
        size,
        abi: 1,
        conventions: 1,
        reserved: 0,
        elements: list.as_ptr(),
        element_count: 1,
        manifest: c"".as_ptr(),
    };
    change(&mut plugin);
    // SAFETY: a root like that of the header, or one that it must refuse.
    unsafe { describe::elements(&raw const plugin) }.map(|found| found.len())
}

#[test]
fn roots_that_do_not_fit_are_refused() {
    let element = sound();
    let told = |result: Result<usize, OpenError>| result.expect_err("refused").to_string();
    assert_eq!(read(&raw const element, |_| ()), Ok(1));
    assert_eq!(read(&raw const element, |plugin| plugin.size += 16), Ok(1));
    assert!(told(read(&raw const element, |plugin| plugin.size = 8)).contains("`odyn_plugin.size` is 8, at least 40"));
    assert!(told(read(&raw const element, |plugin| plugin.abi = 2)).contains("element-api c2, this host has c1"));
    assert_eq!(read(&raw const element, |plugin| plugin.conventions = 3), Err(OpenError::Conventions(3)));
    assert!(told(read(std::ptr::null(), |_| ())).contains("element 0 is a null pointer"));
    assert!(told(read(&raw const element, |plugin| plugin.elements = std::ptr::null())).contains("null pointer"));
    assert!(told(read(&raw const element, |plugin| plugin.element_count = 5000)).contains("5000 elements; at most"));
    // SAFETY: null is one of the pointers that it takes.
    let nothing = unsafe { describe::elements(std::ptr::null()) };
    assert!(nothing.is_err_and(|error| error.to_string().contains("gave a null pointer")));
}

#[test]
fn an_element_of_a_later_header_is_longer_and_loads() {
    #[repr(C)]
    struct Later {
        known: RawElement,
        more: [u64; 8],
    }
    let mut later = Later { known: sound(), more: [u64::MAX; 8] };
    later.known.size = size_of::<Later>() as u32;
    assert_eq!(read((&raw const later).cast(), |_| ()), Ok(1));
    // One of contract 1.0 ends before what came in 1.2; nothing behind its end is read.
    later.known.size = RawElement::SHORTEST as u32;
    later.known.velocity_row_count = usize::MAX;
    assert_eq!(read((&raw const later).cast(), |_| ()), Ok(1));
    let list = [(&raw const later).cast::<RawElement>()];
    let plugin = Plugin {
        size: size_of::<Plugin>() as u32,
        abi: 1,
        conventions: 1,
        reserved: 0,
        elements: list.as_ptr(),
        element_count: 1,
        manifest: c"".as_ptr(),
    };
    // SAFETY: a root like that of the header.
    let found = unsafe { describe::elements(&raw const plugin) }.unwrap();
    assert_eq!((found[0].velocity_row_count, found[0].exempt.is_null()), (0, true));
    later.known.size = RawElement::SHORTEST as u32 - 8;
    assert!(read((&raw const later).cast(), |_| ()).is_err());
}

fn parameter(name: &CStr, value: &CStr) -> table::Parameter {
    table::Parameter {
        name: name.as_ptr(),
        kind: 0,
        optional: 0,
        unit: c"m".as_ptr(),
        doc: std::ptr::null(),
        value: value.as_ptr(),
        range: c"> 0 and <= 1e3".as_ptr(),
        choices: c"a|b".as_ptr(),
        variable: c"t".as_ptr(),
    }
}

/// An element that has these.
fn with_parameters(list: &[table::Parameter]) -> RawElement {
    extern "C-unwind" fn create(_: *const table::Parameters, _: *mut *mut c_void, _: *mut table::Error) -> i32 {
        table::OK
    }
    let mut element = sound();
    (element.parameters, element.parameter_count) = (list.as_ptr(), list.len());
    element.create = Some(create);
    element
}

/// Names that no scene can write, and values that the element's own range and choices exclude.
#[test]
fn parameters_that_no_scene_could_give_are_refused() {
    let refused = |list: &[table::Parameter]| {
        // SAFETY: an element like one of the header.
        unsafe { describe::describe(&with_parameters(list)) }.expect_err("refused")
    };
    let text = |value| table::Parameter { kind: 3, ..parameter(c"way", value) };
    let vector = |value| table::Parameter { kind: 4, ..parameter(c"e", value) };
    let whole = |value| table::Parameter { kind: 1, ..parameter(c"n", value) };
    for (list, expected) in [
        (vec![parameter(c"k", c"1"), parameter(c"k", c"2")], "`still`: has two parameters called `k`"),
        (vec![parameter(c"A b", c"1")], "`A b` can't be the name of a parameter: letters"),
        (vec![parameter(c"", c"1")], "`` can't be the name of a parameter"),
        (vec![parameter(c"use", c"1")], "`use` can't be the name of a parameter: it picks a row"),
        (vec![parameter(c"k", c"-1")], "the default -1 of the parameter `k` must be > 0 and <= 1000"),
        (vec![parameter(c"k", c"nan")], "the default nan of the parameter `k` must be > 0"),
        (vec![parameter(c"k", c"'5 mm'")], "the default \"5 mm\" of the parameter `k` must be a number"),
        (vec![whole(c"1.5")], "the default 1.5 of the parameter `n` must be a whole number"),
        (vec![text(c"'z'")], "the default \"z\" of the parameter `way` must be one of a, b"),
        (vec![vector(c"[1, 2]")], "of the parameter `e` must be a list of 3 numbers"),
        (vec![vector(c"[1, 2, 0]")], "of the parameter `e` must be > 0 and <= 1000"),
    ] {
        let error = refused(&list);
        assert!(error.starts_with("`still`: ") && error.contains(expected), "{error}");
    }
}

#[test]
fn flags_that_are_not_known_and_joints_without_frames_are_refused() {
    // SAFETY: an element like one of the header.
    let refused = |element: &RawElement| unsafe { describe::describe(element) }.expect_err("refused");
    let flags = RawElement { flags: 4096, ..sound() };
    assert_eq!(refused(&flags), "`still`: has flags that this host does not know");
    let alone = RawElement { frame_count: 0, ..sound() };
    assert_eq!(refused(&alone), "`still`: is a joint without frames");
}

#[test]
fn kinds_flags_and_parameters_are_described() {
    let named = [
        (c"a", c"1.5"),
        (c"b", c"2"),
        (c"c", c"true"),
        (c"d", c"'b'"),
        (c"e", c"[1, 2, 2.5]"),
        (c"f", c"[1, 2.5]"),
        (c"g", c"[[0, 1], [1, 2]]"),
        (c"h", c"[[-1, 1], [1, 2]]"),
    ];
    let parameter = |(kind, (name, value))| table::Parameter { kind, ..parameter(name, value) };
    let list: Vec<table::Parameter> = (0..).zip(named).map(parameter).collect();
    let mut element = with_parameters(&list);
    // SAFETY: an element like one of the header.
    let describe = |element: &RawElement| unsafe { describe::describe(element) };
    let described = describe(&element).expect("sound");
    use element_api::params::ParamKind;
    let kinds = [
        ParamKind::Number,
        ParamKind::Integer,
        ParamKind::Boolean,
        ParamKind::Text,
        ParamKind::Vector,
        ParamKind::List,
        ParamKind::Curve,
        ParamKind::Function,
    ];
    assert!(described.params.iter().map(|p| p.kind).eq(kinds));
    let p = &described.params[0];
    assert_eq!((p.range_text().as_str(), p.unit.as_str(), p.variable.as_str()), ("> 0 and <= 1000", "m", "t"));
    assert_eq!(p.choices, ["a", "b"]);
    assert_eq!(described.params[5].default.as_ref().and_then(|v| v.as_array()).map(Vec::len), Some(2));
    for (number, kind) in [Kind::Joint, Kind::Force, Kind::Control].into_iter().enumerate() {
        element.kind = number as u32;
        assert_eq!(describe(&element).expect("sound").kind, kind);
    }
    element.state_count = 1;
    assert!(describe(&element).expect_err("no list").contains("`still`: declares 1 states, but the list is a null"));
    element.kind = 0;
    element.flags = table::OPAQUE;
    element.evaluate = Some(never);
    assert!(describe(&element).expect_err("a joint").contains("is an opaque joint, which has no states"));
}

/// Rows that bend in every direction and in time, with an angle.
struct Bent;

impl element_api::Element for Bent {
    const NAME: &'static str = "bent";
    const SUMMARY: &'static str = "nothing of use";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
    const ANGLES: usize = 1;
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Bent {
    const ROWS: &'static [&'static str] = &["distance", "unused", "slope"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("angle", "rad", "")];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        rows.set(0, length(d) - (at.time * 3.0).sin() * 0.1);
        rows.set(2, at.frames[0].y().dot(&at.frames[1].z()) * (at.time * 0.5).exp() + d.x * d.y);
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
    fn uses_row(&self, row: usize) -> bool {
        row != 1
    }
}

/// Time, an angle reference, and two frames in motion, lengths in units of `size`.
fn inputs(size: f64) -> Vec<f64> {
    let mut inputs = vec![0.7, 12.0];
    for (shift, turn) in [([0.3, -0.2, 0.5], [0.2, 0.3, 1.1]), ([-0.4, 0.6, 0.1], [-0.3, 0.1, 0.4])] {
        let rotation = nalgebra::Rotation3::new(nalgebra::Vector3::from(turn));
        inputs.extend(shift.map(|x| x * size));
        inputs.extend(rotation.matrix().transpose().iter());
        inputs.extend([0.7, -0.4, 0.9].map(|v| v * size));
        inputs.extend([1.3, 0.2, -2.1]);
    }
    inputs
}

const LAYOUT: Layout = Layout { frames: 2, angles: 1, states: 0, memory: 0, signals: 0, joints: 0, values: 3 };
const ALL: Wanted = Wanted { jacobian: true, second: true };

fn oracle(inputs: &[f64], wanted: Wanted, out: &mut [f64]) {
    let mut set = adapt::joint::<Bent>().new_set();
    set.add(&Params::new()).unwrap();
    set.evaluate(&Batch { instances: &[0], inputs, wanted }, out).unwrap();
}

#[test]
fn differences_are_derivatives() {
    for size in [1.0, 1e-3, 1e3] {
        let inputs = inputs(size);
        let mut exact = vec![f64::NAN; LAYOUT.joint_results()];
        oracle(&inputs, ALL, &mut exact);
        let mut found = vec![f64::NAN; LAYOUT.joint_results()];
        let none = Wanted { jacobian: false, second: false };
        oracle(&inputs, none, &mut found);
        let scales = differences::Scales { length: 0.0, time: 0.0 };
        let values = |inputs: &[f64], out: &mut [f64]| -> Result<(), Fault> {
            oracle(inputs, none, out);
            Ok(())
        };
        differences::complete(&LAYOUT, scales, &inputs, ALL, &mut found, values).unwrap();
        for (k, (a, b)) in found.iter().zip(&exact).enumerate() {
            // Rows have sizes of 1 (angles) and size^2; shifts are steps of a share of `size`.
            let bound = if (3 * 14..3 * 15).contains(&k) { 1e-8 } else { 1e-10 };
            assert!(
                (a - b).abs() < bound * (1.0 + b.abs() + size * size + 1.0 / size),
                "size {size}, number {k}: {a} / {b}"
            );
        }
    }
}

#[test]
fn recordings_are_evaluated_as_the_element_is() {
    let mut set = adapt::joint::<Bent>().new_set();
    set.add(&Params::new()).unwrap();
    let recording = set.record(0).unwrap();
    let inputs = inputs(1.0);
    let mut exact = vec![f64::NAN; LAYOUT.joint_results()];
    oracle(&inputs, ALL, &mut exact);
    let mut found = vec![f64::NAN; LAYOUT.joint_results()];
    let rows = &[0, 2];
    let recorded = interpret::Recorded { recording: &recording, kind: Kind::Joint, layout: LAYOUT, rows };
    recorded.evaluate(&inputs, ALL, &mut found);
    for (k, (a, b)) in found.iter().zip(&exact).enumerate() {
        assert!((a - b).abs() < 1e-13 * (1.0 + b.abs()), "number {k}: {a} / {b}");
    }
}
