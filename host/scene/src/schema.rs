//! The JSON schema of scene files, as far as it follows from the scene alone: keys, kinds of values, words.
//!
//! The keys stand in tables beside those of the reader; a test compares the two. What other rooms decide (element types and
//! their parameters, methods, quantities) they add.

use serde_json::{Map, Value, json};

use super::dimension::Dimension;
use super::elements::SCALED_KEYS;
use super::outputs::TAKES;
use super::rotation::WAYS;
use super::unit_system::UNIT_KEYS;
use super::verification::KINDS;

/// A key of a table: name, the schema of its value, a sentence for the user.
pub(super) type Key = (&'static str, Value, &'static str);

/// The schema of a table with these keys and no others.
fn table(keys: Vec<Key>, required: &[&str]) -> Value {
    let order: Vec<&str> = keys.iter().map(|(key, ..)| *key).collect();
    let mut properties = Map::new();
    for (key, mut schema, doc) in keys {
        schema["description"] = doc.into();
        properties.insert(key.into(), schema);
    }
    let mut table = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    table[ORDER] = order.into();
    if !required.is_empty() {
        table["required"] = required.into();
    }
    table
}

/// A number in the scene's units, or a text: with a unit, or an expression.
pub fn quantity() -> Value {
    json!({ "type": ["number", "string"] })
}

/// What an input is fed with: the name of a signal or a constant, or a signal times a quantity.
pub fn signal() -> Value {
    json!({ "oneOf": [quantity(), table(scaled_keys(), SCALED_KEYS)] })
}

/// Under this key, a schema says what a quantity is: `length`, `moment of inertia`.
pub(super) const DIMENSION: &str = "x-dimension";
/// Under this key, a table has its keys in the order in which people read them; JSON sorts them by name.
pub const ORDER: &str = "x-order";

/// A quantity of a dimension; a test holds it against what the reader expects.
fn of(dimension: Dimension) -> Value {
    measured_in(quantity(), dimension)
}

fn measured_in(mut schema: Value, dimension: Dimension) -> Value {
    schema[DIMENSION] = dimension.noun().into();
    schema
}

/// A quantity that is above zero. Nothing is known of the value of a text.
fn positive(dimension: Dimension) -> Value {
    let mut schema = of(dimension);
    schema["exclusiveMinimum"] = 0.into();
    schema
}

fn whole(least: u64) -> Value {
    json!({ "type": "integer", "minimum": least })
}

fn list(item: Value) -> Value {
    json!({ "type": "array", "items": item })
}

fn list_of(count: usize, item: Value) -> Value {
    json!({ "type": "array", "items": item, "minItems": count, "maxItems": count })
}

/// Three components.
pub fn vector() -> Value {
    list_of(3, quantity())
}

fn vector_of(dimension: Dimension) -> Value {
    list_of(3, of(dimension))
}

/// Three components, each of which is this where it is left out.
fn vector_or(left_out: Value, dimension: Dimension) -> Value {
    let mut schema = vector_of(dimension);
    schema["default"] = json!([left_out, left_out, left_out]);
    schema
}

fn direction() -> Value {
    vector_of(Dimension::DIMENSIONLESS)
}

fn text() -> Value {
    json!({ "type": "string" })
}

fn word() -> Value {
    json!({ "type": "string", "minLength": 1 })
}

fn flag(default: bool) -> Value {
    json!({ "type": "boolean", "default": default })
}

/// The name of a body, element or output.
fn name(more: &str) -> Value {
    json!({ "type": "string", "pattern": format!("^[A-Za-z0-9_{more}-]+$") })
}

/// A text that is one of some words. Editors show the sentence of each.
pub fn one_of<'a>(words: impl IntoIterator<Item = (&'a str, &'a str)>) -> Value {
    let (words, docs): (Vec<&str>, Vec<&str>) = words.into_iter().unzip();
    let mut schema = json!({ "type": "string", "enum": words });
    if docs.iter().any(|doc| !doc.is_empty()) {
        schema["x-taplo"] = json!({ "docs": { "enumValues": docs } });
    }
    schema
}

fn one_of_plain<'a>(words: impl IntoIterator<Item = &'a str>) -> Value {
    one_of(words.into_iter().map(|word| (word, "")))
}

/// Keys of a scene. `element` is the schema of the entries of `joint`, `force` and `control`, by that word.
pub(super) fn root_keys() -> Vec<Key> {
    vec![
        ("title", text(), "A title, printed and shown."),
        (
            "units",
            table(unit_keys(), &[]),
            "Units of plain numbers here and of results; SI with angles in rad where not given.",
        ),
        ("plugins", table(plugin_keys(), &[]), "Libraries of elements."),
        (
            "parameters",
            json!({ "$ref": "#/$defs/parameters" }),
            "Named quantities that expressions refer to; tables nest: `crank.radius`.",
        ),
        ("simulation", table(simulation_keys(), &["t_end"]), "Gravity, time, output times and how to integrate."),
        ("body", list(table(body_keys(), &["name"])), "Bodies. The ground needs none: it is called \"ground\"."),
        ("joint", list(element("joint")), "Joints: what constrains the motion of bodies."),
        ("force", list(element("force")), "Force elements: what acts on bodies."),
        ("control", list(element("control")), "Control elements: signals in, signals out."),
        (
            "input",
            list(table(input_keys(), &["name"])),
            "Signals that a program gives while the scene runs; elements take them by their names.",
        ),
        ("output", list(table(output_keys(), &["name", "quantity"])), "Columns of the results; also signals."),
        (
            "figure",
            list(table(figure_keys(), &["name", "channel", "take"])),
            "Numbers derived from outputs, printed at the end.",
        ),
        (
            "check",
            list(table(check_keys(), &["name", "kind", "value", "reference", "tolerance"])),
            "What is known of the results; a run fails where it does not hold.",
        ),
        (
            "verification",
            table(verification_keys(), &["elements", "text"]),
            "Makes the scene a page of the verification manual.",
        ),
    ]
}

fn unit_keys() -> Vec<Key> {
    let key =
        |(key, dimension)| (key, measured_in(word(), dimension), "A unit, such as \"mm\", \"ms\", \"deg\", \"kN\".");
    UNIT_KEYS.map(key).to_vec()
}

pub(super) fn plugin_keys() -> Vec<Key> {
    vec![
        (
            "libraries",
            list(json!({ "anyOf": [word(), table(library_keys(), &["name"])] })),
            "Libraries to load: a name such as \"joints\", a file, or a table with a name, a version and a hash.",
        ),
        ("path", list(word()), "Further folders to look in, relative to this file."),
        (
            "trust",
            list(word()),
            "Names of libraries that may run in the process of the solver, unless they come with this file.",
        ),
    ]
}

pub(super) fn library_keys() -> Vec<Key> {
    vec![
        ("name", word(), "Name of the library, or its file."),
        ("version", word(), "Range of versions, such as \"^1.2\" or \"=1.2.3\"."),
        ("sha256", json!({ "type": "string", "pattern": "^[0-9a-fA-F]{64}$" }), "SHA-256 of the file."),
    ]
}

pub(super) fn simulation_keys() -> Vec<Key> {
    vec![
        ("gravity", vector_or(0.into(), Dimension::ACCELERATION), "Acceleration of gravity, ground axes."),
        ("t_start", of(Dimension::TIME), "Start; zero if left out."),
        (
            "start",
            word(),
            "Where the bodies are at the start: as `given`, or at the `equilibrium` that `odyn statics` finds from there.",
        ),
        ("t_end", of(Dimension::TIME), "End, after the start."),
        (
            "output_step",
            positive(Dimension::TIME),
            "Results at the start, then every so often; this or `output_times` is needed.",
        ),
        ("output_times", list(of(Dimension::TIME)), "Results at these times, ascending; instead of `output_step`."),
        ("tolerance", positive(Dimension::DIMENSIONLESS), "Relative tolerance of the integration, at most 0.1."),
        ("method", word(), "Method of integration."),
        ("engine", word(), "How the equations are evaluated."),
        ("formulation", word(), "Coordinates of the equations of motion."),
        (
            "islands",
            word(),
            "Whether parts that share nothing take common steps or each its own; `auto`: each its own where many of them switch.",
        ),
        ("max_step", positive(Dimension::TIME), "Largest step."),
        (
            "fixed_step",
            positive(Dimension::TIME),
            "Equal steps of this size, without error control; shorter ones where it is no whole part of the run, or of what is between two \
             checkpoints or two samples of elements.",
        ),
        ("first_step", positive(Dimension::TIME), "First step."),
        ("max_steps", whole(1), "Number of steps after which to give up."),
        (
            "checkpoint_every",
            positive(Dimension::TIME),
            "Simulated time between two checkpoints of a run that writes results.",
        ),
        (
            "motion",
            flag(false),
            "Write `motion.bin`: poses of the bodies and loads of the elements at the output times.",
        ),
        (
            "audit_tolerance",
            json!({ "anyOf": [positive(Dimension::DIMENSIONLESS), { "const": "none" }] }),
            "Largest relative violation and energy error that the audit lets pass, or \"none\"; it belongs to the tolerance if left \
             out.",
        ),
        ("without", list(word()), "Savings to do without; results are the same, found by more work."),
    ]
}

pub(super) fn body_keys() -> Vec<Key> {
    let of_tensor = |key| (key, of(Dimension::INERTIA), "Entry of the inertia tensor.");
    let tensor = table(["xx", "yy", "zz", "xy", "yz", "zx"].map(of_tensor).to_vec(), &["xx", "yy", "zz"]);
    let inertia = json!({ "anyOf": [list_of(3, of(Dimension::INERTIA)), list_of(6, of(Dimension::INERTIA)), tensor] });
    let point_mass = vec![
        ("mass", of(Dimension::MASS), "Its mass."),
        ("position", vector_of(Dimension::LENGTH), "Its place in the body frame."),
    ];
    vec![
        ("name", name(""), "Its name."),
        ("mass", of(Dimension::MASS), "Mass; needed unless the body is fixed."),
        (
            "inertia",
            inertia,
            "Inertia about the centre of mass in body axes: principal moments, or xx, yy, zz, xy, yz, zx of the tensor; needed unless \
             the body is fixed or a particle.",
        ),
        ("com", vector_or(0.into(), Dimension::LENGTH), "Centre of mass in the body frame."),
        ("position", vector_or(0.into(), Dimension::LENGTH), "Origin of the body frame in ground at the start."),
        ("orientation", orientation(), "Orientation of the body frame at the start; that of the ground if left out."),
        (
            "velocity",
            vector_or("free".into(), Dimension::VELOCITY),
            "Velocity of the origin at the start, ground axes; \"free\" components are found by assembly, as is all of it if left out: those of least kinetic energy, with which the centre of mass of a free body is at rest.",
        ),
        (
            "angular_velocity",
            vector_or("free".into(), Dimension::ANGULAR_VELOCITY),
            "Angular velocity at the start, ground axes; \"free\" components are found by assembly, as is all of it if left out.",
        ),
        ("fixed", flag(false), "Part of the ground."),
        ("particle", flag(false), "A point mass without rotation and inertia."),
        ("point_masses", list(table(point_mass, &["mass"])), "Point masses that are part of the body."),
        ("shape", list(table(shape_keys(), &["kind"])), "What it looks like, of no influence on the motion."),
    ]
}

/// Keys of `[[body.shape]]`.
pub(super) fn shape_keys() -> Vec<Key> {
    let kinds = [
        ("box", "`size`"),
        ("cylinder", "`radius`, `length`"),
        ("sphere", "`radius`"),
        ("capsule", "`radius`, `length`"),
        ("mesh", "`file`, `unit`"),
    ];
    let color = json!({ "type": "string", "pattern": "^#[0-9a-fA-F]{6}$" });
    vec![
        (
            "kind",
            one_of(kinds),
            "What it is; the origin of its frame is in its middle, that of a mesh in that of the file.",
        ),
        ("size", list_of(3, positive(Dimension::LENGTH)), "Edges of a box along its x, y and z axes."),
        ("radius", positive(Dimension::LENGTH), "Radius of a cylinder, sphere or capsule."),
        (
            "length",
            positive(Dimension::LENGTH),
            "Length of a cylinder, or of a capsule without its caps, along its z axis.",
        ),
        ("file", word(), "Triangles of a mesh, relative to this file: STL (binary or text) or OBJ."),
        ("unit", word(), "Unit of the numbers in that file; m if left out."),
        (
            "point",
            vector_of(Dimension::LENGTH),
            "Origin of its frame at the start, in ground; that of the body if left out.",
        ),
        ("axis", direction(), "z axis of its frame at the start, in ground."),
        ("x_axis", direction(), "Direction near the x axis of its frame at the start, in ground."),
        ("frame", table(frame_keys(), &[]), "Its frame in the frame of the body; instead of point and axes."),
        ("color", color, "Its colour, such as \"#c0392b\"; one for each body if left out."),
    ]
}

/// Keys of a frame in the frame of a body.
fn frame_keys() -> Vec<Key> {
    vec![
        ("position", vector_of(Dimension::LENGTH), "Origin in the body frame; zero if left out."),
        ("axis", direction(), "z axis in body axes."),
        ("x_axis", direction(), "Direction near the x axis in body axes."),
    ]
}

/// One of the ways to write a rotation, each with its keys.
fn orientation() -> Value {
    let value = |key: &str| match key {
        "axis" | "x" | "y" => (direction(), "A direction; its length does not matter."),
        "angle" => (of(Dimension::ANGLE), "Angle about `axis`."),
        "euler_parameters" => (list_of(4, of(Dimension::DIMENSIONLESS)), "e0, e1, e2, e3, scalar first."),
        "rotation_vector" => (vector_of(Dimension::ANGLE), "Axis times angle."),
        "euler_zyx" => (vector_of(Dimension::ANGLE), "Angles about z, then the new y, then the new x."),
        _ => (list_of(3, direction()), "Rows of the matrix whose columns are the body's axes in ground."),
    };
    let way = |keys: &&'static [&'static str]| {
        let entries = keys.iter().map(|key| {
            let (schema, doc) = value(key);
            (*key, schema, doc)
        });
        table(entries.collect(), keys)
    };
    json!({ "oneOf": WAYS.iter().map(way).collect::<Vec<_>>() })
}

/// Keys of `[[joint]]`, and of the other elements where `signals` is true.
pub(super) fn element_keys(kind: &str) -> Vec<Key> {
    let mut keys = vec![
        ("name", name(""), "Its name."),
        ("type", word(), "Element type, with or without its library: \"revolute\", \"odyn-joints/revolute\"."),
        ("bodies", list(word()), "Bodies it connects, in the order of its frames; \"ground\" is one."),
        (
            "point",
            vector_of(Dimension::LENGTH),
            "Origin of its frames at the start, in ground; those of the bodies if left out.",
        ),
        ("points", list(vector_of(Dimension::LENGTH)), "Origins of its frames at the start, one per body, in ground."),
        ("axis", direction(), "z axis of its frames at the start, in ground."),
        ("axes", list(direction()), "z axes of its frames at the start, one per body, in ground."),
        ("x_axis", direction(), "Direction near the x axis of its frames at the start, in ground."),
        ("x_axes", list(direction()), "Directions near the x axes of its frames, one per body, in ground."),
        ("frames", list(table(frame_keys(), &[])), "Its frames in the frame of each body; instead of points and axes."),
        ("params", json!({ "type": "object" }), "Its parameters."),
        ("enabled", flag(true), "False leaves it out."),
    ];
    let source = signal();
    keys.push((
        "inputs",
        json!({ "type": "object", "additionalProperties": source }),
        "Signals it takes: the name of an output or an input, ELEMENT.CHANNEL, or a constant; or such a signal times a quantity: \
         { signal = \"pid.output\", gain = \"20 N\" }.",
    ));
    if kind != "joint" {
        keys.push(("joints", list(word()), "Joints whose reactions it depends on."));
    }
    if kind != "control" {
        keys.push((
            "release",
            table(release_keys(), &[]),
            "When it lets go of its bodies, for good: as soon as a signal leaves a range, or at a time.",
        ));
    }
    keys
}

/// Keys of an input that is a signal times a quantity.
fn scaled_keys() -> Vec<Key> {
    vec![
        ("signal", word(), "The name of an output or an input, or ELEMENT.CHANNEL."),
        ("gain", quantity(), "What it is multiplied by: a force for a plain number that is to be one."),
    ]
}

/// Keys of `release`.
pub(super) fn release_keys() -> Vec<Key> {
    vec![
        ("when", word(), "The signal that decides: the name of an output or an input, or ELEMENT.CHANNEL."),
        ("above", quantity(), "With `when`: it lets go as soon as the signal exceeds this."),
        ("below", quantity(), "With `when`: it lets go as soon as the signal falls short of this."),
        ("at", of(Dimension::TIME), "The time at which it lets go, instead of a signal."),
    ]
}

fn element(kind: &str) -> Value {
    table(element_keys(kind), &["name", "type"])
}

pub(super) fn input_keys() -> Vec<Key> {
    vec![
        ("name", name("."), "Its name, by which elements take it as a signal."),
        ("value", quantity(), "Its value until another is given; zero if left out."),
        ("unit", word(), "Unit of its values; that of `value` in the scene's units if left out."),
    ]
}

pub(super) fn output_keys() -> Vec<Key> {
    vec![
        ("name", name("."), "Its name: the column of the results, and a signal."),
        ("quantity", word(), "What it reports."),
        ("of", word(), "Body or element."),
        (
            "component",
            one_of_plain(["x", "y", "z", "magnitude", "e0", "e1", "e2", "e3"]),
            "Component of a vector; of forces and torques also their magnitude.",
        ),
        ("on", word(), "Body that a reaction or force acts on; the last one of the element if left out."),
        ("point", vector_or(0.into(), Dimension::LENGTH), "Point in body coordinates."),
        ("frame", word(), "Whose axes: \"ground\" or a body."),
        ("channel", word(), "Channel of an element; not needed where there is one."),
    ]
}

pub(super) fn figure_keys() -> Vec<Key> {
    vec![
        ("name", word(), "Its name, printed."),
        ("channel", word(), "Output it is taken from."),
        ("take", one_of_plain(TAKES.map(|(word, _)| word)), "Which figure."),
        ("abs", flag(false), "Its magnitude."),
        ("where", word(), "With \"at\": the output whose last crossing of `equals` is meant."),
        ("equals", quantity(), "With \"at\": the value that is crossed."),
        ("period", quantity(), "With \"at\": the value repeats with this period."),
        ("over", word(), "Output whose same figure divides this one."),
        ("from", of(Dimension::TIME), "Earlier samples are left out."),
        ("published", of(Dimension::DIMENSIONLESS), "A number to compare with, in the unit of the channel."),
        ("unit", text(), "Unit to print."),
        ("note", text(), "Remark to print."),
    ]
}

pub(super) fn check_keys() -> Vec<Key> {
    let csv = vec![("csv", word(), "A table with times, relative to this file."), ("column", word(), "Its column.")];
    let reference = json!({ "anyOf": [quantity(), table(csv, &["csv", "column"])] });
    let mut not_negative = of(Dimension::DIMENSIONLESS);
    not_negative["minimum"] = 0.into();
    vec![
        ("name", word(), "Its name, free text."),
        ("kind", one_of_plain(KINDS.map(|kind| kind.word())), "What kind of quantity is compared."),
        ("value", quantity(), "An output, or an expression of outputs, parameters and t."),
        ("reference", reference, "What it should be: an expression, or the column of a table."),
        ("tolerance", not_negative, "Largest allowed difference, in the unit of the value."),
        ("from", of(Dimension::TIME), "Earlier samples are left out."),
        ("to", of(Dimension::TIME), "Later samples are left out."),
    ]
}

pub(super) fn verification_keys() -> Vec<Key> {
    vec![
        ("elements", list(word()), "Full names of the elements that it verifies."),
        ("text", word(), "The problem, the derivation of its solution and its source, as Markdown."),
        ("analysis", word(), "The analysis that is judged, a command such as `modes`, where that is not a run."),
        ("options", json!({ "type": "object" }), "Its long options: `options = { at = \"equilibrium\" }`."),
        ("number", list(table(number_keys(), &["name", "of"])), "What the analysis must find."),
    ]
}

pub(super) fn number_keys() -> Vec<Key> {
    let mut not_negative = of(Dimension::DIMENSIONLESS);
    not_negative["minimum"] = 0.into();
    vec![
        ("name", word(), "Its name, free text."),
        ("of", word(), "Its place in what the command prints with `--json`: `modes/0/frequency`, `outputs/x/value`."),
        ("reference", quantity(), "What it should be: a number, or an expression of parameters."),
        ("tolerance", not_negative, "Largest allowed difference."),
        ("equals", word(), "The word that must stand there, in place of a number."),
        ("unit", word(), "Its unit, to be shown."),
    ]
}

/// The schema of scene files (JSON Schema, draft 2020-12), without what other rooms know.
#[must_use]
pub fn schema() -> Value {
    let mut schema = table(root_keys(), &["simulation"]);
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema["title"] = "O-DYN scene".into();
    schema["$defs"] = json!({
        "parameters": {
            "type": "object",
            "propertyNames": { "pattern": "^[A-Za-z_][A-Za-z0-9_]*$" },
            "additionalProperties": { "anyOf": [quantity(), { "$ref": "#/$defs/parameters" }] },
        },
    });
    schema
}
