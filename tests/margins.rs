//! Checks that elements declare, grids that a run leaves, catalogues that libraries bring along: what is said, and that the motion does
//! not depend on it.

use odyn::diagnostics::Source;
use odyn::results::{ElementCheck, ElementRecord};
use odyn::scene::parse;
use odyn::session::{RunReport, Session};

use element_api::adapt::{control, force};
use element_api::manifest::Library;
use element_api::prelude::*;

use crate::support::{Scratch, assert_same_motion, open_text, options, run_linked};

/// A pulley whose bearing is pulled across by 5 kN/s t and along by 2 kN/s t; `what` adds the bearing.
fn pulley(what: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 2\noutput_step = 0.1\n\
         [[body]]\nname = \"pulley\"\nmass = 40\ninertia = [1, 1, 1]\nangular_velocity = [0, 50, 0]\n\
         [[joint]]\nname = \"hub\"\ntype = \"revolute\"\nbodies = [\"ground\", \"pulley\"]\npoint = [0, 0, 0]\naxis = [0, 1, 0]\n\
         [[force]]\nname = \"pull\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"pulley\"]\nparams.x = \"5000 t\"\nparams.y = \"2000 t\"\n\
         [[output]]\nname = \"spin\"\nquantity = \"angular_velocity\"\nof = \"pulley\"\ncomponent = \"y\"\n{what}"
    )
}

fn bearing(params: &str) -> String {
    format!("[[force]]\nname = \"bearing\"\ntype = \"bearing-rating\"\njoints = [\"hub\"]\nparams = {{ {params} }}\n")
}

fn run(text: &str, sets: &[&str]) -> RunReport {
    let options = options(sets, &[]);
    let (scene, warnings) = parse(Source::new("scene.toml", text), &options.overrides)
        .unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    let catalog = {
        let mut catalog = odyn::catalog::Catalog::new().with_copies_in(crate::support::kept("library-copies"));
        let search = odyn::catalog::SearchPath::standard(&[], &[]);
        ["odyn-joints", "odyn-forces"].into_iter().for_each(|library| drop(catalog.add(library, &search).unwrap()));
        catalog
    };
    let session = Session::with_catalog(scene, warnings, &catalog, &options).unwrap_or_else(|error| panic!("{error}"));
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn check<'a>(report: &'a RunReport, name: &str) -> &'a ElementCheck {
    let [ElementRecord { checks, .. }] = &report.summary.elements[..] else { panic!("{:?}", report.summary.elements) };
    checks.iter().find(|check| check.name == name).unwrap()
}

#[test]
fn checks_are_told_alike_in_all_formulations_and_change_nothing() {
    let text = pulley(&bearing("use = \"6204\", static_safety = 1.5"));
    let plain = run(&pulley(""), &[]);
    assert!(plain.summary.elements.is_empty() && plain.summary.warnings.is_empty());
    for sets in [
        &[][..],
        &["simulation.formulation=cartesian"],
        &["simulation.engine=reference"],
        &["simulation.method=radau5"],
    ] {
        let report = run(&text, sets);
        assert_eq!((report.exit_code(), report.summary.reason.as_str()), (0, ""));
        // P0 = P = F_r = 5 kN/s t: C0 / 1.5 = 4.4 kN at t = 0.88 s, C / 2 = 6.4 kN at 1.28 s.
        for (name, limit, first) in [("static load", 4400.0, 0.88), ("dynamic load", 6400.0, 1.28)] {
            let check = check(&report, name);
            assert!(!check.holds && check.unique && check.unit == "N" && check.at == 2.0, "{sets:?}: {check:?}");
            assert!((check.margin - (limit - 1e4)).abs() < 1e-6, "{sets:?}: {check:?}");
            // To a sample or the end of a step behind.
            let told = check.first.unwrap();
            assert!(first < told && told <= first + 0.1, "{sets:?}: {check:?}");
        }
        let speed = check(&report, "speed");
        assert!(speed.holds && speed.first.is_none(), "{speed:?}");
        let of_checks = report.summary.warnings.iter().filter(|text| text.starts_with("ODY0750")).count();
        assert_eq!(of_checks, 2, "{:?}", report.summary.warnings);
        assert_same_motion(&report, &plain, 1e-9);
        let values = &report.summary.elements[0].values;
        let load = values.iter().find(|value| value.name == "load").unwrap();
        assert!((load.largest - 1e4).abs() < 1e-6 && load.largest_at == 2.0 && load.smallest_at == 0.0, "{load:?}");
    }
}

/// What was seen of margins in what a run that is brought back has left is forgotten.
#[test]
fn margins_of_what_was_taken_back_are_none() {
    let mut run =
        open_text(&pulley(&bearing("use = \"6204\", static_safety = 1.5")), &[]).prepare().unwrap().start().unwrap();
    run.advance(0.5).unwrap();
    let saved = run.save().unwrap();
    run.advance(2.0).unwrap();
    run.restore(&saved).unwrap();
    let report = run.finish().unwrap();
    // 4.4 kN - 5 kN/s t, and nothing of what was beyond.
    let check = check(&report, "static load");
    assert!(check.holds && check.first.is_none() && check.at == 0.5, "{check:?}");
    assert!((check.margin - 1900.0).abs() < 1e-6, "{check:?}");
    let load = report.summary.elements[0].values.iter().find(|value| value.name == "load").unwrap();
    assert!(load.largest_at == 0.5, "{load:?}");
}

#[test]
fn reactions_that_are_not_unique_are_told_as_such() {
    let second = "[[joint]]\nname = \"other\"\ntype = \"revolute\"\nbodies = [\"ground\", \"pulley\"]\npoint = [0, 1, 0]\naxis = [0, 1, 0]\n";
    let report = run(&pulley(&(bearing("use = \"6204\"") + second)), &[]);
    assert!(!check(&report, "static load").unique && check(&report, "speed").unique);
    assert!(report.summary.warnings.iter().any(|text| text.starts_with("ODY0322")), "{:?}", report.summary.warnings);
}

#[test]
fn rows_of_a_catalogue_are_parameters_and_the_scene_wins() {
    let margin = |params: &str| check(&run(&pulley(&bearing(params)), &[]), "dynamic load").margin;
    assert_eq!(
        margin("use = \"6204\""),
        margin("dynamic_rating = \"12.8 kN\", static_rating = \"6.6 kN\", factor = 13.1")
    );
    assert!((margin("use = \"6204\", dynamic_rating = \"30 kN\"") - 5e3).abs() < 1e-6);
    // All rows can be used.
    let rows = include_str!("../plugins/forces/src/bearings.csv").lines().filter(|line| line.starts_with('6'));
    let mut count = 0;
    for row in rows {
        let name = row.split(',').next().unwrap();
        assert!(margin(&format!("use = \"{name}\"")).is_finite());
        count += 1;
    }
    assert!(count > 20);
}

#[test]
fn unknown_rows_are_refused_with_the_nearest() {
    let scratch = Scratch::new();
    let refused = |params: &str| {
        let path = scratch.file("scene.toml", pulley(&bearing(params)));
        match Session::open(&path, &options(&[], &[])) {
            Ok(_) => panic!("{params} is accepted"),
            Err(error) => error.to_string(),
        }
    };
    let message = refused("use = \"6219\"");
    assert!(message.contains("ODY0330") && message.contains("6210"), "{message}");
    assert!(refused("use = 6204").contains("must be the name of a row"));
    let text = pulley("").replace("params.x", "params.use = \"6204\"\nparams.x");
    let error = Session::open(&scratch.file("scene.toml", text), &options(&[], &[])).err().unwrap().to_string();
    assert!(error.contains("unknown parameter `use` for `vector-force`"), "{error}");
}

/// A push by a map of place and time, with a check of its own.
struct Mapped(Surface);

#[derive(Parameters)]
struct MappedParameters {
    /// Force over place and time.
    #[param(unit = "m, s -> N")]
    map: Surface,
}

impl Element for Mapped {
    const NAME: &'static str = "mapped";
    const SUMMARY: &'static str = "pushes along x by a map of place and time";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("on", "the body")];
    type Parameters = MappedParameters;
    fn new(p: MappedParameters) -> Result<Self, ParamError> {
        Ok(Self(p.map))
    }
}

impl Mapped {
    fn value<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        self.0.at(at.frames()[0].position.x, at.time())
    }
}

impl Force for Mapped {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("force", "N", "along x")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let zero = S::zero();
        out.force(0, Vec3::new(self.value(at), zero, zero));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.value(at));
    }
}

/// A signal with a check that depends on a signal.
struct Watchman;

impl Element for Watchman {
    const NAME: &'static str = "watchman";
    const SUMMARY: &'static str = "says where a signal is above one";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Control for Watchman {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("signal", "", "what is looked at")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("signal", "", "the same")];
    const CHECKS: &'static [ChannelSpec] = &[ChannelSpec::new("limit", "", "sees too large a signal")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.inputs[0]);
    }
    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(S::from(1.0) - at.inputs[0]);
    }
}

fn mapped(map: &str, more: &str) -> RunReport {
    let library = Library {
        package: "maps".into(),
        version: "1.0.0".into(),
        about: "maps".into(),
        classes: vec![force::<Mapped>(), control::<Watchman>()],
    };
    let text = format!(
        "[units]\ntime = \"ms\"\n[simulation]\nt_end = 2000\noutput_step = 10\n[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n\
         velocity = [\"1 m/s\", 0, 0]\n[[force]]\nname = \"push\"\ntype = \"mapped\"\nbodies = [\"a\"]\nparams.map = {map}\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"a\"\ncomponent = \"x\"\n{more}"
    );
    run_linked(&text, library)
}

/// x'' = x t, by the power series of its solution from x = 0, x' = 1 (Airy's equation).
fn airy(t: f64) -> f64 {
    let (mut term, mut sum) = (t, t);
    for k in 1..40 {
        let n = 3.0 * f64::from(k) + 1.0;
        term *= t.powi(3) / (n * (n - 1.0));
        sum += term;
    }
    sum
}

#[test]
fn bilinear_maps_are_met_exactly_and_grids_that_are_left_are_told() {
    // x t at the corners of uneven cells, which a bilinear function meets; plain times are in ms.
    let map = |last: f64| {
        format!(
            "{{ x = [-1, 0, 0.7, {last}], y = [0, 300, 2000], z = [[0, \"-0.3 N\", \"-2 N\"], [0, 0, 0], [0, \"0.21 N\", \"1.4 N\"], \
             [0, \"{} N\", \"{} N\"]], interpolation = \"linear\" }}",
            0.3 * last,
            2.0 * last
        )
    };
    let report = mapped(&map(20.0), "");
    for (t, x) in report.times.iter().zip(&report.columns[0]) {
        let expected = airy(t / 1e3);
        assert!((x - expected).abs() <= 1e-9 * expected.abs().max(1.0), "t = {t}: {x}, not {expected}");
    }
    assert!(report.summary.warnings.is_empty(), "{:?}", report.summary.warnings);
    let left = mapped(&map(1.5), "");
    let [warning] = &left.summary.warnings[..] else { panic!("{:?}", left.summary.warnings) };
    assert!(warning.starts_with("ODY0751: `push`: x goes from 0 to "), "{warning}");
    assert!(warning.contains("the values of `map` end at -1 and 1.5 m"), "{warning}");
}

#[test]
fn signals_are_checked_in_scene_units_and_islands_together() {
    let watch = "[[control]]\nname = \"watch\"\ntype = \"watchman\"\ninputs = { signal = \"x\" }\n";
    let report = mapped("{ x = [-1, 9], y = [0, 5000], z = [[0, 0], [0, 0]] }", watch);
    let check = check(&report, "limit");
    // x = t.
    assert!(!check.holds && (check.margin + 1.0).abs() < 1e-9 && check.at == 2000.0, "{check:?}");
    assert!(check.first.is_some_and(|first| (1000.0..=1011.0).contains(&first)), "{check:?}");
    let apart = mapped(
        "{ x = [-1, 9], y = [0, 5000], z = [[0, 0], [0, 0]] }",
        &(watch.to_owned() + "[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n"),
    );
    assert_eq!(apart.summary.elements, report.summary.elements);
}

/// A body of 1 kg m^2 on a rotational stiffness of 1 N m/rad, by which it turns by its speed, rad/s, to either side; `what` is the spring.
fn turned(what: &str, speed: f64) -> Vec<String> {
    let text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 2\noutput_step = 0.1\n\
         [[body]]\nname = \"wheel\"\nmass = 1\ninertia = [1, 1, 1]\nangular_velocity = [0, 0, {speed}]\nposition = [0.5, 0, 0]\n\
         [[joint]]\nname = \"hub\"\ntype = \"revolute\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0.5, 0, 0]\naxis = [0, 0, 1]\n\
         [[force]]\nname = \"spring\"\nbodies = [\"ground\", \"wheel\"]\n{what}\n"
    );
    let report = run(&text, &[]);
    assert_eq!((report.exit_code(), report.summary.reason.as_str()), (0, ""));
    report.summary.warnings.iter().filter(|text| text.starts_with("ODY0750")).cloned().collect()
}

#[test]
fn springs_whose_rotation_jumps_at_half_a_turn_say_so_before() {
    let bushing = |about: &str| {
        format!(
            "type = \"bushing\"\npoint = [0.5, 0, 0]\nparams = {{ stiffness = [1, 1, 1], rotational_stiffness = {about} }}"
        )
    };
    let field = "type = \"field\"\npoint = [0.5, 0, 0]\nparams.rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]";
    for what in [bushing("[1, 1, 1]"), field.to_owned()] {
        assert_eq!(turned(&what, 2.4), [] as [&str; 0], "{what}");
        let warned = turned(&what, 4.0);
        assert!(matches!(&warned[..], [one] if one.contains("`spring`") && one.contains("half a turn")), "{warned:?}");
    }
    // What has no torque has none that jumps.
    assert_eq!(turned(&bushing("[0, 0, 0]"), 4.0), [] as [&str; 0]);
}

/// A beam that is laid out wrongly is deformed from the start; of many, the first is named, and some others.
#[test]
fn beams_beyond_their_law_say_so() {
    let beam = |keys: &str| {
        format!(
            "type = \"beam\"\n{keys}\nparams = {{ length = 0.5, young = 1e4, shear = 1e4, area = 1, iy = 1e-4, iz = 1e-4, torsion = 1e-4 }}"
        )
    };
    let right = "frames = [{}, {}]";
    assert_eq!(turned(&beam(right), 0.0), [] as [&str; 0]);
    // Its z axis along it, its ends exchanged, its length in another unit.
    let along = "points = [[0, 0, 0], [0.5, 0, 0]]\naxis = [1, 0, 0]";
    let exchanged = "frames = [{ position = [0.5, 0, 0] }, { position = [-0.5, 0, 0] }]";
    let long = beam(right).replace("length = 0.5", "length = 500");
    for what in [beam(along), beam(exchanged), long] {
        let warned = turned(&what, 0.0);
        assert!(
            matches!(&warned[..], [one] if one.contains("first at t = 0") && one.contains("`length`")),
            "{what}: {warned:?}"
        );
    }
    let several: String = (0..6)
        .map(|k| format!("[[force]]\nname = \"spring{k}\"\nbodies = [\"ground\", \"wheel\"]\n{}\n", beam(along)))
        .collect();
    let warned = turned(&format!("{}\n{several}", beam(along)), 0.0);
    assert!(
        matches!(&warned[..], [one] if one.contains("also `spring0`, `spring1`, `spring2` and 3 more")),
        "{warned:?}"
    );
}
