//! `--set`.

use super::*;

const SCENE: &str = r#"
[units]
length = "mm"
[parameters]
crank.radius = "8.5 mm"
twice = "2*crank.radius"
both.mass = 1
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "rotor"
mass = 1
inertia = [1, 1, 1]
position = ["crank.radius", 0, 0]
[[body]]
name = "both"
fixed = true
[[joint]]
name = "bearing"
type = "revolute"
bodies = ["ground", "rotor"]
params = { friction = 1 }
"#;

#[test]
fn parameters_are_replaced_before_they_are_used() {
    for text in ["crank.radius=9mm", "crank.radius=9", "crank.radius = '9 mm'", "parameters.crank.radius=9 mm"] {
        let scene = accept_with(SCENE, &[text]);
        assert!(near(scene.bodies[0].position[0], 9e-3), "{text}");
        let twice = scene.parameters.get("twice").unwrap().value;
        assert!(near(twice.si, 18e-3) || near(twice.si, 18.0), "{text}");
    }
    let scene = accept_with(SCENE, &["crank.radius=1mm", "crank.radius=twice/twice*7 mm", "twice=3mm"]);
    assert!(near(scene.bodies[0].position[0], 7e-3));
}

#[test]
fn settings_bodies_and_elements_are_changed() {
    let overrides = [
        "simulation.t_end=50",
        "simulation.tolerance=1e-6",
        "plugins.libraries=[\"mine\"]",
        "title=Study 3",
        "rotor.mass=0.05",
        "rotor.orientation.axis=[0,0,1]",
        "rotor.orientation.angle=90 deg",
        "bearing.params.friction=0",
        "bearing.params.stick.speed=1 mm/s",
        "bearing.enabled=false",
        "body.both.mass=7",
    ];
    let scene = accept_with(SCENE, &overrides);
    assert_eq!(scene.simulation.t_end, 50.0);
    assert_eq!(scene.simulation.tolerance, Some(1e-6));
    assert_eq!(scene.plugins.libraries[0].name.value, "mine");
    assert_eq!(scene.title, "Study 3");
    assert_eq!(scene.bodies[0].mass.as_ref().unwrap().value, 0.05);
    assert!(near(scene.bodies[0].orientation[3], 0.5_f64.sqrt()));
    assert_eq!(scene.bodies[1].mass.as_ref().unwrap().value, 7.0);
    let bearing = &scene.elements[0];
    assert!(!bearing.enabled);
    assert_eq!(bearing.params.get("friction").unwrap().kind, RawKind::Integer(0));
    let speed = bearing.params.get("stick").unwrap().as_table().unwrap().get("speed").unwrap();
    assert!(near(scene.quantity(speed, Dimension::VELOCITY).unwrap(), 1e-3));
    // A later room that points at the value points at the command line.
    let error = scene.quantity(speed, Dimension::MASS).unwrap_err();
    let text = render(&[error], &scene.source, false);
    assert!(text.contains("--> command line:1:34"), "{text}");
    assert!(text.contains("--set bearing.params.stick.speed=1 mm/s"), "{text}");
}

#[test]
fn what_cannot_be_set_is_reported_with_advice() {
    for (text, help) in [
        ("crank.raduis=9mm", "did you mean `crank.radius`?"),
        ("parameters.crank.raduis=9mm", "did you mean `parameters.crank.radius`?"),
        ("rotr.mass=1", "did you mean `rotor.mass`?"),
        ("simulaton.t_end=1", "did you mean `simulation.t_end`?"),
        ("crank=1", "did you mean `crank.radius`?"),
        ("zzzzzz=1", "set a parameter, `simulation.t_end`, or `NAME.KEY` of a body or element"),
        ("x", "write `--set crank.radius=9mm`"),
        ("both.mass=1", "write `parameters.both.mass` or `body.both.mass`"),
    ] {
        let rejected = reject_with(SCENE, &[text]);
        assert_eq!(rejected.codes(), [codes::BAD_OVERRIDE], "{text}");
        assert_eq!(rejected.diagnostics[0].help, [help], "{text}");
        assert!(rejected.rendered().contains(&format!("--set {text}")), "{text}");
    }
    for text in ["=1", "a..b=1", "rotor.mass.x=1", ""] {
        assert_eq!(reject_with(SCENE, &[text]).codes(), [codes::BAD_OVERRIDE], "{text}");
    }
}

#[test]
fn values_are_checked_like_those_of_the_file() {
    for (text, code, culprit) in [
        ("rotor.mas=1", codes::UNKNOWN_KEY, "rotor.mas"),
        ("simulation.t_end=-1", codes::OUT_OF_RANGE, "-1"),
        ("rotor.com=[0,0", codes::WRONG_TYPE, "[0,0"),
        ("rotor.com=[0,0,\"1 s\"]", codes::DIMENSION, "1 s"),
        ("rotor.com=[0,0,nan]", codes::NOT_FINITE, "nan"),
        ("crank.radius=9 ms + 1", codes::NEEDS_UNIT, "+"),
        ("crank.radius=", codes::EXPRESSION_SYNTAX, ""),
        ("units.length=ms", codes::DIMENSION, "ms"),
    ] {
        let rejected = reject_with(SCENE, &[text]);
        assert_eq!(rejected.codes(), [code], "{text}: {}", rejected.rendered());
        assert_eq!(rejected.culprit(), culprit, "{text}");
    }
}

#[test]
fn a_parameter_that_lost_its_unit_is_named_where_it_is_used() {
    let scene = SCENE.replace("[\"crank.radius\", 0, 0]", "[\"crank.radius + 1 mm\", 0, 0]");
    let rejected = reject_with(&scene, &["crank.radius=25"]);
    assert_eq!(rejected.codes(), [codes::NEEDS_UNIT]);
    let remedy = "`--set crank.radius=25` gives `crank.radius` no unit: write `--set \"crank.radius=25 mm\"`";
    assert!(rejected.diagnostics[0].help.iter().any(|line| line == remedy), "{}", rejected.rendered());
    // Not where it is not used, and not where the scene itself has no unit.
    let rejected = reject_with(
        &scene.replace("mass = 1\ninertia", "mass = \"1 mm\"\ninertia"),
        &["crank.radius=25 mm", "twice=1"],
    );
    assert!(!rejected.rendered().contains("gives"), "{}", rejected.rendered());
}

#[test]
fn an_entry_of_a_list_that_is_left_out_can_be_set() {
    let scene = |set: &[&str]| {
        accept_with(
            "[[body]]\nname = \"disc\"\nmass = 1\ninertia = [1, 1, 1]\n",
            &[set, &["simulation.t_end=1", "simulation.output_step=1"]].concat(),
        )
    };
    let disc = &scene(&["disc.com.x=0.25", "disc.com.z=2", "disc.velocity.y=3"]).bodies[0];
    assert_eq!(disc.com, [0.25, 0.0, 2.0]);
    assert_eq!(disc.velocity.value, [None, Some(3.0), None]);
    assert_eq!(scene(&["simulation.gravity.z=-9.81"]).simulation.gravity, [0.0, 0.0, -9.81]);
    // What a joint without a point has there is not known here.
    let rejected = reject_with(SCENE, &["bearing.point.x=2"]);
    assert_eq!(rejected.codes(), [codes::BAD_OVERRIDE]);
    let [help] = &rejected.diagnostics[0].help[..] else { panic!() };
    assert!(help.contains("`--set \"bearing.point=[...]\"`"), "{help}");
}

#[test]
fn a_parameter_of_an_element_set_without_params_is_told_where_it_stands() {
    let rejected = reject_with(SCENE, &["bearing.friction=2"]);
    assert_eq!(rejected.codes(), [codes::UNKNOWN_KEY]);
    assert!(
        rejected
            .rendered()
            .contains("it stands under `params`: `params.friction`; `odyn elements describe revolute` lists them"),
        "{}",
        rejected.rendered()
    );
}

#[test]
fn a_scene_without_the_table_can_be_completed() {
    let scene = accept_with("", &["simulation.t_end=1", "simulation.output_step=0.5"]);
    assert_eq!(scene.simulation.t_end, 1.0);
}

#[test]
fn entries_of_lists_are_set_and_read() {
    let overrides =
        ["rotor.position.y=2 mm", "rotor.inertia.2=7", "rotor.point_masses=[{ mass = 1, position = [0, 0, 0] }]"];
    let further = [&overrides[..], &["rotor.point_masses.0.position.z=3"]].concat();
    let scene = accept_with(SCENE, &further);
    assert!(near(scene.bodies[0].position[1], 2e-3) && near(scene.bodies[0].position[0], 8.5e-3));
    assert!(near(scene.bodies[0].point_masses[0].position[2], 3e-3));
    let document = Document::parse(Source::new("scene.toml", SCENE)).unwrap();
    let changes: Vec<Override> = further.iter().map(|text| Override::new(*text)).collect();
    let get = |key: &str| document.setting(key, &changes).unwrap().map(|raw| raw.kind);
    assert_eq!(get("rotor.inertia.2"), Some(RawKind::Integer(7)));
    assert_eq!(get("body.rotor.inertia.0"), Some(RawKind::Integer(1)));
    assert_eq!(get("rotor.position.y"), Some(RawKind::Text("2 mm".into())));
    assert_eq!(get("bearing.params.friction"), Some(RawKind::Integer(1)));
    assert_eq!(get("crank.radius"), Some(RawKind::Text("8.5 mm".into())));
    assert_eq!(get("simulation.t_end"), Some(RawKind::Integer(1)));
    // Nothing is given there.
    assert_eq!([get("rotor.velocity.x"), get("rotor.inertia.3"), get("rotor.mass.x")], [None, None, None]);
    let told = document.setting("rotr.mass", &changes).unwrap_err();
    assert!(told.message.contains("there is no `rotr.mass`"), "{told:?}");
    assert!(document.setting("rotor..mass", &changes).is_err());
    assert_eq!(reject_with(SCENE, &["rotor.inertia.3=7"]).codes(), [codes::BAD_OVERRIDE]);
}
