//! What an accepted scene contains, and each check of the tables.

use super::*;

const COMPRESSOR: &str = r#"
title = "Reciprocating compressor"
[units]
length = "mm"
time = "ms"
mass = "kg"
[plugins]
libraries = ["joints", "odyn-forces"]
path = ["../my-plugins"]
[parameters]
crank.radius = "8.5 mm"
[simulation]
gravity = [0, "-9.81 m/s^2", 0]
t_end = 200
output_step = 0.5
tolerance = 1e-9
method = "dop853"
engine = "interpreted"
max_step = 1
first_step = "1 us"
max_steps = 100000
audit_tolerance = 1e-6
[[body]]
name = "rotor"
mass = 0.04
inertia = [500, 500, 30]
com = [1, 0, 0]
position = ["crank.radius", 0, 0]
velocity = [0, "free", "2 m/s"]
angular_velocity = [0, 0, 0.32]
[[body]]
name = "block"
fixed = true
inertia = { zz = 3, yy = 2, xx = 1, zx = 0.5 }
[[joint]]
name = "bearing"
type = "odyn-joints/revolute"
bodies = ["block", "rotor"]
point = [1, 2, 3]
axis = [0, 0, 5]
x_axis = [1, 0, 0]
[[control]]
name = "timer"
type = "clock"
[[force]]
name = "spring"
type = "spring"
bodies = ["ground", "rotor"]
frames = [{ position = [1, 0, 0], axis = [0, 2, 0] }, {}]
params = { stiffness = "20 N/mm", curve = [[0, 1], [1, 2]], on = true }
enabled = false
[[output]]
name = "rotor.Fx"
quantity = "reaction_force"
of = "bearing"
component = "x"
on = "block"
point = [0, 0, 1]
frame = "ground"
channel = "torque"
[[figure]]
name = "a_p at 0 deg, |F|"
channel = "a_p"
take = "at"
where = "theta"
equals = "0 deg"
period = "360 deg"
over = "Fy"
from = 100
published = 1.03
abs = true
unit = "mm/ms^2"
note = "Fig. 19"
"#;

#[test]
fn settings_are_converted() {
    let scene = accept(COMPRESSOR);
    assert_eq!(scene.title, "Reciprocating compressor");
    let libraries = scene.plugins.libraries.iter();
    let libraries: Vec<&str> = libraries.map(|name| name.name.value.as_str()).collect();
    assert_eq!(libraries, ["joints", "odyn-forces"]);
    assert_eq!(scene.plugins.paths[0].value, "../my-plugins");
    let simulation = &scene.simulation;
    assert_eq!(simulation.gravity, [0.0, -9.81, 0.0]);
    assert_eq!(simulation.t_start, 0.0);
    assert!(near(simulation.t_end, 0.2));
    assert_eq!(simulation.output, OutputTimes::Step(0.5e-3));
    assert_eq!(simulation.tolerance, Some(1e-9));
    let fixed = accept(&COMPRESSOR.replace("max_step = 1\nfirst_step = \"1 us\"", "fixed_step = 2")).simulation;
    assert_eq!((simulation.max_step, fixed.fixed_step), (Some(1e-3), Some(2e-3)));
    assert_eq!(simulation.first_step, Some(1e-6));
    assert_eq!(simulation.max_steps, Some(100_000));
    assert_eq!(simulation.audit_tolerance, Some(AuditTolerance::Limit(1e-6)));
    assert_eq!(simulation.method.as_ref().unwrap().value, "dop853");
    assert_eq!(simulation.engine.as_ref().unwrap().value, "interpreted");
}

#[test]
fn bodies_are_converted() {
    let scene = accept(COMPRESSOR);
    let [rotor, block] = scene.bodies.as_slice() else {
        panic!("two bodies");
    };
    assert_eq!(rotor.mass.as_ref().unwrap().value, 0.04);
    let inertia = rotor.inertia.as_ref().unwrap().value;
    for (found, expected) in inertia.iter().zip([5e-4, 5e-4, 3e-5, 0.0, 0.0, 0.0]) {
        assert!(near(*found, expected));
    }
    assert_eq!(rotor.com, [1e-3, 0.0, 0.0]);
    assert!(near(rotor.position[0], 8.5e-3));
    assert_eq!(rotor.velocity.value, [Some(0.0), None, Some(2.0)]);
    assert!(near(rotor.angular_velocity.value[2].unwrap(), 320.0));
    assert_eq!(scene.source.slice(rotor.span.clone()), Some("[[body]]"));
    assert!(block.fixed && block.mass.is_none());
    assert_eq!(block.velocity.value, [None; 3]);
    let inertia = block.inertia.as_ref().unwrap().value;
    for (found, expected) in inertia.iter().zip([1e-6, 2e-6, 3e-6, 0.0, 0.0, 0.5e-6]) {
        assert!(near(*found, expected));
    }
}

#[test]
fn elements_keep_what_is_not_known_here() {
    let scene = accept(COMPRESSOR);
    let [bearing, spring, timer] = scene.elements.as_slice() else {
        panic!("three elements, joints first, control elements last");
    };
    assert_eq!(bearing.kind, ElementKind::Joint);
    assert_eq!(bearing.type_name.value, "odyn-joints/revolute");
    assert_eq!(bearing.bodies.value[1].value, "rotor");
    assert_eq!(
        bearing.placement.value,
        Placement::Global {
            points: vec![[1e-3, 2e-3, 3e-3]],
            axes: vec![[0.0, 0.0, 1.0]],
            x_axes: vec![[1.0, 0.0, 0.0]],
        }
    );
    assert!(bearing.enabled && bearing.params.is_empty());
    let Placement::Local(frames) = &spring.placement.value else {
        panic!("frames on the bodies");
    };
    assert_eq!(frames[0].position, [1e-3, 0.0, 0.0]);
    assert_eq!(frames[0].axis, Some([0.0, 1.0, 0.0]));
    assert_eq!((frames[1].position, frames[1].axis), ([0.0; 3], None));
    assert!(!spring.enabled);
    assert_eq!(timer.placement.value, Placement::Absent);
    assert_eq!((timer.kind.key(), timer.bodies.value.len()), ("control", 0));
}

#[test]
fn raw_parameters_are_resolved_on_demand() {
    let scene = accept(COMPRESSOR);
    let params = &scene.elements[1].params;
    let keys: Vec<&str> = params.entries.iter().map(|(key, _)| key.value.as_str()).collect();
    assert_eq!(keys, ["stiffness", "curve", "on"]);
    let stiffness = params.get("stiffness").unwrap();
    let found = scene.quantity(stiffness, Dimension::STIFFNESS).unwrap();
    assert!(near(found, 20_000.0));
    let error = scene.quantity(stiffness, Dimension::DAMPING).unwrap_err();
    assert_eq!(scene.source.slice(error.span().unwrap()), Some("20 N/mm"));
    let row = &params.get("curve").unwrap().as_array().unwrap()[1];
    let entry = &row.as_array().unwrap()[1];
    assert!(near(scene.quantity(entry, Dimension::FORCE).unwrap(), 2000.0));
    assert_eq!(params.get("on").unwrap().kind, RawKind::Bool(true));
}

#[test]
fn outputs_and_figures_are_read() {
    let scene = accept(COMPRESSOR);
    let output = &scene.outputs[0];
    assert_eq!(output.name.value, "rotor.Fx");
    assert_eq!(output.quantity.value, "reaction_force");
    assert_eq!(output.point.as_ref().unwrap().value, [0.0, 0.0, 1e-3]);
    let figure = &scene.figures[0];
    assert_eq!((figure.take, figure.absolute), (Take::At, true));
    assert_eq!((figure.from, figure.published), (Some(0.1), Some(1.03)));
    let at = figure.at.as_ref().unwrap();
    assert_eq!(at.channel.value, "theta");
    let period = scene.quantity(at.period.as_ref().unwrap(), Dimension::ANGLE);
    assert!(near(period.unwrap(), 2.0 * std::f64::consts::PI));
    assert_eq!((figure.unit.value.as_str(), figure.note.as_str()), ("mm/ms^2", "Fig. 19"));
}

#[test]
fn sample_times_are_round_in_scene_units() {
    let scene = accept(COMPRESSOR);
    let times = scene.simulation.sample_times(&scene.units);
    assert_eq!(times.len(), 401);
    for (k, time) in times.iter().enumerate() {
        assert_eq!(time.scene, 0.5 * k as f64);
        assert!(near(time.si, 0.5e-3 * k as f64));
    }
    assert_eq!(times[400].si, scene.simulation.t_end);
    let text = "[units]\ntime = \"ms\"\n[simulation]\nt_start = 1\nt_end = 1.95\noutput_step = 0.1\n";
    let scene = accept(text);
    let times = scene.simulation.sample_times(&scene.units);
    let found: Vec<f64> = times.iter().map(|time| time.scene).collect();
    assert_eq!(found, [1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9]);
    let text = "[units]\ntime = \"ms\"\n[simulation]\nt_end = 3\noutput_times = [0.3, \"1 ms\"]\n";
    let scene = accept(text);
    let times = scene.simulation.sample_times(&scene.units);
    assert_eq!((times[0].scene, times[1].scene, times.len()), (0.3, 1.0, 2));
}

#[test]
fn a_small_scene_needs_little() {
    let scene = accept(SIMULATION);
    assert_eq!(scene.units, UnitSystem::default());
    assert!(scene.bodies.is_empty() && scene.elements.is_empty() && scene.title.is_empty());
    assert_eq!(scene.simulation.gravity, [0.0; 3]);
    assert_eq!(scene.simulation.tolerance, None);
}

/// Checks single mistakes: each line of a table gives exactly this code at exactly this piece of text.
fn each_gives(header: &str, cases: &[(&str, Code, &str)]) {
    for (lines, code, culprit) in cases {
        let rejected = reject(&format!("{header}\n{lines}\n"));
        assert_eq!(rejected.codes(), [*code], "{lines}: {}", rejected.rendered());
        assert_eq!(rejected.culprit(), *culprit, "{lines}");
    }
}

#[test]
fn mistakes_in_a_simulation() {
    each_gives(
        "[simulation]",
        &[
            ("t_end = 1", codes::MISSING_KEY, "[simulation]"),
            ("output_step = 1", codes::MISSING_KEY, "[simulation]"),
            ("t_end = 0\noutput_step = 1", codes::OUT_OF_RANGE, "0"),
            ("t_start = 2\nt_end = 1\noutput_step = 1", codes::OUT_OF_RANGE, "1"),
            ("t_end = 1\noutput_step = 0", codes::OUT_OF_RANGE, "0"),
            ("t_end = 1\noutput_step = 1e-9", codes::OUT_OF_RANGE, "1e-9"),
            ("t_end = 1\noutput_step = 1\noutput_times = [1]", codes::CONFLICTING_KEYS, "output_times"),
            ("t_end = 1\noutput_times = []", codes::WRONG_LENGTH, "[]"),
            ("t_end = 1\noutput_times = [0, 2]", codes::OUT_OF_RANGE, "2"),
            ("t_end = 1\noutput_times = [0, 0.5, 0.5]", codes::OUT_OF_RANGE, "0.5"),
        ],
    );
    each_gives(
        SIMULATION,
        &[
            ("tolerance = -1e-9", codes::OUT_OF_RANGE, "-1e-9"),
            ("tolerance = 0", codes::OUT_OF_RANGE, "0"),
            ("max_step = \"1 mm\"", codes::DIMENSION, "1 mm"),
            ("max_steps = 0", codes::OUT_OF_RANGE, "0"),
            ("max_steps = 1.5", codes::WRONG_TYPE, "1.5"),
            ("gravity = 9.81", codes::WRONG_TYPE, "9.81"),
            ("gravity = [0, -9.81]", codes::WRONG_LENGTH, "[0, -9.81]"),
            ("method = 853", codes::WRONG_TYPE, "853"),
            ("method = \"\"", codes::BAD_NAME, "\"\""),
            ("tend = 1", codes::UNKNOWN_KEY, "tend"),
        ],
    );
}

#[test]
fn mistakes_in_a_body() {
    each_gives(
        &format!("{SIMULATION}[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]"),
        &[
            ("vellocity = [0, 0, 0]", codes::UNKNOWN_KEY, "vellocity"),
            ("com = [0, 0]", codes::WRONG_LENGTH, "[0, 0]"),
            ("com = [0, true, 0]", codes::WRONG_TYPE, "true"),
            ("position = { x = 1 }", codes::WRONG_TYPE, "{ x = 1 }"),
            ("velocity = [0, \"fre\", 0]", codes::UNKNOWN_PARAMETER, "fre"),
            ("fixed = 1", codes::WRONG_TYPE, "1"),
            ("com = [nan, 0, 0]", codes::NOT_FINITE, "nan"),
            ("com = [0, -inf, 0]", codes::NOT_FINITE, "-inf"),
            ("com = [0, 1e999, 0]", codes::NOT_FINITE, "1e999"),
            ("com = [0, 1979-05-27, 0]", codes::WRONG_TYPE, "1979-05-27"),
        ],
    );
    each_gives(
        &format!("{SIMULATION}[[body]]"),
        &[
            ("mass = 1\ninertia = [1, 1, 1]", codes::MISSING_KEY, "[[body]]"),
            ("name = \"b\"\ninertia = [1, 1, 1]", codes::MISSING_KEY, "[[body]]"),
            ("name = \"b\"\nmass = 1", codes::MISSING_KEY, "[[body]]"),
            ("name = \"\"\nfixed = true", codes::BAD_NAME, "\"\""),
            ("name = \"a b\"\nfixed = true", codes::BAD_NAME, "\"a b\""),
            ("name = \"ä\"\nfixed = true", codes::BAD_NAME, "\"ä\""),
            ("name = \"a.b\"\nfixed = true", codes::BAD_NAME, "\"a.b\""),
            ("name = \"ground\"\nfixed = true", codes::BAD_NAME, "\"ground\""),
            ("name = 5\nfixed = true", codes::WRONG_TYPE, "5"),
            ("name = \"b\"\nmass = 1\ninertia = [1, 1]", codes::WRONG_LENGTH, "[1, 1]"),
            ("name = \"b\"\nmass = 1\ninertia = { xx = 1, yy = 1 }", codes::MISSING_KEY, "{ xx = 1, yy = 1 }"),
            ("name = \"b\"\nfixed = true\n[[body]]\nname = \"b\"\nfixed = true", codes::DUPLICATE_NAME, "\"b\""),
        ],
    );
}

#[test]
fn mistakes_in_an_element() {
    each_gives(
        &format!("{SIMULATION}[[joint]]\nname = \"j\"\ntype = \"t\"\nbodies = [\"a\", \"b\"]"),
        &[
            ("point = [0, 0, 0]\npoints = [[0, 0, 0]]", codes::CONFLICTING_KEYS, "points"),
            ("axis = [0, 0, 1]\naxes = [[0, 0, 1]]", codes::CONFLICTING_KEYS, "axes"),
            ("point = [0, 0, 0]\nframes = [{}]", codes::CONFLICTING_KEYS, "frames"),
            ("axis = [0, 0, 0]", codes::NO_DIRECTION, "[0, 0, 0]"),
            ("axes = [[0, 0, 1], [0, 0, 0]]", codes::NO_DIRECTION, "[0, 0, 0]"),
            ("points = []", codes::WRONG_LENGTH, "[]"),
            ("points = [0, 0, 0]", codes::WRONG_TYPE, "[0, 0, 0]"),
            ("axis = [0, 0, 1]\nx_axis = [0, 0, -3]", codes::NO_DIRECTION, "[0, 0, -3]"),
            ("axes = [[1, 0, 0], [0, 1, 0]]\nx_axis = [0, 1, 0]", codes::NO_DIRECTION, "[0, 1, 0]"),
            ("axis = [0, 0, \"1 mm\"]", codes::DIMENSION, "1 mm"),
            ("frames = [{ axis = [1, 0, 0], x_axis = [1, 0, 0] }]", codes::NO_DIRECTION, "[1, 0, 0]"),
            ("frames = [{ point = [1, 0, 0] }]", codes::UNKNOWN_KEY, "point"),
            ("frames = [1]", codes::WRONG_TYPE, "1"),
            ("params = 5", codes::WRONG_TYPE, "5"),
            ("params = { x = inf }", codes::NOT_FINITE, "inf"),
            ("enabled = \"no\"", codes::WRONG_TYPE, "\"no\""),
            ("ratio = 2", codes::UNKNOWN_KEY, "ratio"),
        ],
    );
    each_gives(
        &format!("{SIMULATION}[[force]]\nname = \"f\""),
        &[
            ("bodies = [\"a\"]", codes::MISSING_KEY, "[[force]]"),
            ("type = \"t\"", codes::MISSING_KEY, "[[force]]"),
            ("type = \"\"\nbodies = [\"a\"]", codes::BAD_NAME, "\"\""),
            ("type = \"t\"\nbodies = \"a\"", codes::WRONG_TYPE, "\"a\""),
            ("type = \"t\"\nbodies = [\"a\", 1]", codes::WRONG_TYPE, "1"),
            ("type = \"t\"\nbodies = [\"\"]", codes::BAD_NAME, "\"\""),
            ("type = \"t\"\nbodies = [\"a\"]\n[[body]]\nname = \"f\"\nfixed = true", codes::DUPLICATE_NAME, "\"f\""),
        ],
    );
}

#[test]
fn mistakes_in_outputs_and_figures() {
    each_gives(
        &format!("{SIMULATION}[[output]]\nname = \"o\""),
        &[
            ("of = \"b\"", codes::MISSING_KEY, "[[output]]"),
            ("quantity = \"q\"\npoint = [1, 2]", codes::WRONG_LENGTH, "[1, 2]"),
            ("quantity = \"q\"\nbody = \"b\"", codes::UNKNOWN_KEY, "body"),
            ("quantity = \"q\"\n[[output]]\nname = \"o\"\nquantity = \"q\"", codes::DUPLICATE_NAME, "\"o\""),
        ],
    );
    each_gives(
        &format!("{SIMULATION}[[figure]]\nname = \"f\"\nchannel = \"c\""),
        &[
            ("published = 1", codes::MISSING_KEY, "[[figure]]"),
            ("take = \"peek\"", codes::UNKNOWN_WORD, "\"peek\""),
            ("take = \"at\"\nwhere = \"w\"", codes::MISSING_KEY, "[[figure]]"),
            ("take = \"at\"\nequals = 0", codes::MISSING_KEY, "[[figure]]"),
            ("take = \"peak\"\nequals = 0", codes::CONFLICTING_KEYS, "equals"),
            ("take = \"peak\"\npublished = \"1 mm\"", codes::DIMENSION, "1 mm"),
        ],
    );
}

#[test]
fn mistakes_in_the_whole() {
    each_gives(
        SIMULATION,
        &[
            ("[bodies]\nx = 1", codes::UNKNOWN_KEY, "bodies"),
            ("[body]\nname = \"b\"", codes::WRONG_TYPE, "[body]"),
            ("[plugins]\nlibraries = \"joints\"", codes::WRONG_TYPE, "\"joints\""),
            ("[plugins]\nlibrary = []", codes::UNKNOWN_KEY, "library"),
            ("[[parameters]]\na = 1", codes::WRONG_TYPE, "[[parameters]]"),
            ("[[units]]\na = 1", codes::WRONG_TYPE, "[[units]]"),
        ],
    );
    for line in ["title = 5", "body = 5", "body = [5]", "plugins = 5"] {
        let rejected = reject(&format!("{line}\n{SIMULATION}"));
        assert_eq!(rejected.codes(), [codes::WRONG_TYPE], "{line}");
        assert!(rejected.culprit().ends_with('5'), "{line}");
    }
    let rejected = reject("simulation = 5");
    assert_eq!(rejected.codes(), [codes::WRONG_TYPE]);
}

#[test]
fn libraries_are_named_or_pinned() {
    let hash = "0123456789abcdefABCDEF0123456789abcdef0123456789abcdef0123456789";
    let table = format!("{{ name = \"acme-wobble\", version = \"^1.2\", sha256 = \"{hash}\" }}");
    let scene = accept(&format!("[plugins]\nlibraries = [\"joints\", {table}]\n{SIMULATION}"));
    let [joints, wobble] = scene.plugins.libraries.as_slice() else { panic!("two libraries") };
    assert_eq!((joints.name.value.as_str(), &joints.version, &joints.sha256), ("joints", &None, &None));
    assert_eq!(wobble.name.value, "acme-wobble");
    assert!(wobble.version.as_ref().unwrap().matches(&"1.9.0".parse().unwrap()));
    assert!(!wobble.version.as_ref().unwrap().matches(&"2.0.0".parse().unwrap()));
    assert_eq!(wobble.sha256.as_ref().unwrap(), &hash.to_lowercase());
    assert_eq!(scene.source.slice(wobble.span.clone()).unwrap(), table);
}

#[test]
fn pins_that_mean_nothing_are_reported() {
    let pinned = |library: &str| format!("[plugins]\nlibraries = [{library}]\n{SIMULATION}");
    for (library, code, culprit) in [
        ("{ name = \"x\", version = \"new\" }", codes::UNKNOWN_WORD, "\"new\""),
        ("{ name = \"x\", sha256 = \"12\" }", codes::UNKNOWN_WORD, "\"12\""),
        ("{ name = \"x\", hash = \"12\" }", codes::UNKNOWN_KEY, "hash"),
        ("{ version = \"1\" }", codes::MISSING_KEY, "{ version = \"1\" }"),
        ("{ name = \"\" }", codes::BAD_NAME, "\"\""),
        ("7", codes::WRONG_TYPE, "7"),
        ("\"\"", codes::BAD_NAME, "\"\""),
    ] {
        let rejected = reject(&pinned(library));
        assert_eq!((rejected.codes(), rejected.culprit()), (vec![code], culprit), "{library}");
    }
}

/// What is valid, and most probably not meant, or changes nothing beside something else.
#[test]
fn what_is_probably_not_meant_is_warned_of() {
    let warned = |text: &str| {
        let (_, warnings) = parse(Source::new("test.toml", text), &[]).unwrap();
        warnings.into_iter().map(|one| (one.code, one.help.concat())).collect::<Vec<_>>()
    };
    let body = |orientation: &str| {
        format!("{SIMULATION}[[body]]\nname = \"a\"\nfixed = true\norientation = {{ {orientation} }}\n")
    };
    for orientation in ["axis = [0, 0, 1], angle = 30", "euler_zyx = [0, -90, 0]", "rotation_vector = [45, 0, 0]"] {
        let found = warned(&body(orientation));
        assert!(
            matches!(&found[..], [(code, help)] if *code == codes::OTHER_UNIT && help.contains("deg\"`")),
            "{found:?}"
        );
        assert!(warned(&format!("units.angle = \"deg\"\n{}", body(orientation))).is_empty());
    }
    assert!(warned(&body("axis = [0, 0, 1], angle = \"30 rad\"")).is_empty());
    assert!(warned(&body("axis = [0, 0, 1], angle = 6.2832")).is_empty());
    let falling = |units: &str, gravity: &str| warned(&format!("{units}\n{SIMULATION}gravity = {gravity}\n"));
    let found = falling("units.length = \"mm\"", "[0, 0, -9.81]");
    assert!(
        matches!(&found[..], [(code, help)] if *code == codes::OTHER_UNIT && help.contains("\"-9.81 m/s^2\"")),
        "{found:?}"
    );
    assert!(falling("units.length = \"mm\"", "[0, 0, -9810]").is_empty());
    assert!(falling("units.length = \"mm\"", "[0, 0, \"-9.81 m/s^2\"]").is_empty());
    assert!(falling("", "[0, 0, -9.81]").is_empty());
    for keys in [
        "max_step = 1e-3\nfixed_step = 1e-2",
        "fixed_step = 1e-2\nfirst_step = 1e-3",
        "engine = \"reference\"\nformulation = \"joint\"",
    ] {
        let found = warned(&format!("{SIMULATION}{keys}\n"));
        assert!(matches!(&found[..], [(code, _)] if *code == codes::KEY_WITHOUT_EFFECT), "{keys}: {found:?}");
    }
    assert!(warned(&format!("{SIMULATION}engine = \"reference\"\nformulation = \"cartesian\"\n")).is_empty());
}

#[test]
fn a_file_that_is_not_there_is_looked_for_beside() {
    let folder = std::env::temp_dir().join(format!("odyn-beside-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("pendulum.toml"), "").unwrap();
    let help = |path: &std::path::Path| Document::open(path).unwrap_err().diagnostics[0].help.concat();
    assert!(help(&folder.join("pendlum.toml")).contains("did you mean"));
    assert!(help(&folder.join("pendulum")).contains("pendulum.toml"));
    assert!(help(&folder).contains("pendulum.toml"), "{}", help(&folder));
    assert!(help(&folder.join("nowhere/pendulum.toml")).contains("there is no folder"));
    std::fs::write(folder.join("latin.toml"), b"title = \"f\xfcr\"").unwrap();
    assert!(help(&folder.join("latin.toml")).contains("UTF-8"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn an_unknown_unit_brings_no_warning_of_other_units() {
    let text = "[units]\nlength = \"millimeter\"\n[simulation]\ngravity = [0, 0, -9810]\nt_end = 1\noutput_step = 1\n";
    assert_eq!(reject(text).codes(), [codes::UNKNOWN_UNIT]);
}
