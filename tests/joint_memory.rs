//! Channels and memory of joints, and internal unknowns whose solution ends in the middle of a run: elements that are linked in.

use element_api::adapt::{force, joint};
use element_api::manifest::Library;
use element_api::prelude::*;
use odyn::catalog::Catalog;
use odyn::diagnostics::Source;
use odyn::scene::parse;
use odyn::session::{RunOptions, RunReport, Session};

use crate::support::{column, options};

const TWO: &[FrameSpec] = &[FrameSpec::new("i", "one end"), FrameSpec::new("j", "the other end")];

/// Speed of the second frame's origin, and the largest there was at an accepted step.
fn speed<S: Scalar>(at: &Motion<'_, S>) -> S {
    length(at.twists[1].velocity)
}

/// A rod of 1 m that remembers the largest speed of its end.
struct WatchedRod;

impl Element for WatchedRod {
    const NAME: &'static str = "watched-rod";
    const SUMMARY: &'static str = "rod that remembers";
    const FRAMES: &'static [FrameSpec] = TWO;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for WatchedRod {
    const ROWS: &'static [&'static str] = &["distance"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("length", "m", "distance of the ends")];
    const INPUTS: &'static [InputSpec] = &[InputSpec::optional("offset", "m/s", 0.0, "added to what it reports")];
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("largest", "m/s", "largest speed so far"), ChannelSpec::new("speed", "m/s", "speed now")];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(length(at.frames[1].position - at.frames[0].position) - 1.0);
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(length(at.frames[1].position - at.frames[0].position));
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0].max(speed(at)));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
        out.push(speed(at) + at.inputs[0]);
    }
}

/// The same memory in a force element that does nothing.
struct Watch;

impl Element for Watch {
    const NAME: &'static str = "watch";
    const SUMMARY: &'static str = "remembers";
    const FRAMES: &'static [FrameSpec] = TWO;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Force for Watch {
    const INPUTS: &'static [InputSpec] = &[InputSpec::optional("copied", "m/s", 0.0, "of another element")];
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("largest", "m/s", "largest speed so far"),
        ChannelSpec::new("copied", "m/s", "as it is taken"),
    ];

    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0].max(speed(at)));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
        out.push(at.inputs[0]);
    }
}

/// A rod whose length is memory: it would jump.
struct JumpingRod;

impl Element for JumpingRod {
    const NAME: &'static str = "jumping-rod";
    const SUMMARY: &'static str = "rod that jumps";
    const FRAMES: &'static [FrameSpec] = TWO;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for JumpingRod {
    const ROWS: &'static [&'static str] = &["distance"];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}
    fn residual_in_motion<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(length(at.frames()[1].position - at.frames()[0].position) - at.memory[0]);
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![1.0]
    }
}

/// Where the conditions of [`Fold`] lose their solution, s.
const END: f64 = 0.5;

/// A force along x of y newton, with y^2 = END - t.
struct Fold;

impl Element for Fold {
    const NAME: &'static str = "fold";
    const SUMMARY: &'static str = "its unknown ends";
    const FRAMES: &'static [FrameSpec] = TWO;
    const UNKNOWNS: &'static [ChannelSpec] = &[ChannelSpec::new("root", "N", "the upper of two solutions")];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
    fn initial_unknowns(&self) -> Vec<f64> {
        vec![1.0]
    }
    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.unknowns()[0] * at.unknowns()[0] + at.time() - END);
    }
}

impl Force for Fold {
    const CHANNELS: &'static [ChannelSpec] = Self::UNKNOWNS;

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(1, Vec3::new(at.unknowns()[0], S::zero(), S::zero()));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.unknowns()[0]);
    }
}

/// A slide along x to the place y, with y^3 - 3 y = 2 (t / END - 2): the branch from y = -2 ends at y = -1.
struct FoldingSlide;

impl Element for FoldingSlide {
    const NAME: &'static str = "folding-slide";
    const SUMMARY: &'static str = "its unknown ends";
    const FRAMES: &'static [FrameSpec] = TWO;
    const UNKNOWNS: &'static [ChannelSpec] = &[ChannelSpec::new("place", "m", "the lowest of three solutions")];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
    fn initial_unknowns(&self) -> Vec<f64> {
        vec![-2.0]
    }
    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let y = at.unknowns()[0];
        // From -2 at the start to the upper fold, 2 at y = -1, at the time END.
        out.push(y * y * y - y * 3.0 - (at.time() * (4.0 / END) - 2.0));
    }
}

impl Constraint for FoldingSlide {
    const ROWS: &'static [&'static str] = &["x"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.frames[1].position.x - at.frames[0].position.x - at.unknowns()[0] - 2.0);
    }
}

fn library() -> Library {
    Library {
        package: "own".into(),
        version: "1.0.0".into(),
        about: "Joints that remember".into(),
        classes: vec![
            joint::<WatchedRod>(),
            joint::<JumpingRod>(),
            joint::<FoldingSlide>(),
            force::<Watch>(),
            force::<Fold>(),
        ],
    }
}

fn try_run(text: &str, sets: &[&str]) -> Result<RunReport, String> {
    let mut catalog = Catalog::new();
    catalog.add_library(library()).unwrap();
    let options: RunOptions = options(sets, &[]);
    let (scene, warnings) = parse(Source::new("scene.toml", text), &options.overrides)
        .unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    let session = Session::with_catalog(scene, warnings, &catalog, &options).map_err(|error| error.to_string())?;
    session.run(None, Box::new(|_| ()), &Default::default()).map_err(|error| error.to_string())
}

/// A body at x = 1 m with an element between the ground and it.
fn scene(kind: &str, of: &str, more: &str) -> String {
    format!(
        "[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.05\ntolerance = 1e-9\n\
         [[body]]\nname = \"ball\"\nmass = 2\ninertia = [1, 1, 1]\nposition = [1, 0, 0]\n\
         [[{kind}]]\nname = \"own\"\ntype = \"{of}\"\nbodies = [\"ground\", \"ball\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n{more}"
    )
}

fn output(name: &str, quantity: &str, of: &str, channel: &str) -> String {
    format!("[[output]]\nname = \"{name}\"\nquantity = \"{quantity}\"\nof = \"{of}\"\nchannel = \"{channel}\"\n")
}

#[test]
fn joints_report_values_and_remember_as_forces_do() {
    let more = "inputs.offset = \"2 m/s\"\n\
         [[force]]\nname = \"watch\"\ntype = \"watch\"\nbodies = [\"ground\", \"ball\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n\
         inputs.copied = \"own.speed\"\n"
        .to_string()
        + &output("largest", "value", "own", "largest")
        + &output("same", "value", "watch", "largest")
        + &output("speed", "value", "own", "speed")
        + &output("copied", "value", "watch", "copied")
        + &output("length", "coordinate", "own", "length")
        + "[[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"z\"\n";
    let text = scene("joint", "watched-rod", &more);
    for sets in [
        &[][..],
        &["simulation.formulation=cartesian"],
        &["simulation.engine=reference"],
        &["simulation.engine=interpreted"],
        &["simulation.method=radau5"],
    ] {
        let report = try_run(&text, sets).unwrap();
        assert_eq!(report.exit_code(), 0, "{sets:?}: {}", report.summary.reason);
        assert_eq!(column(&report, "largest"), column(&report, "same"), "{sets:?}");
        assert_eq!(column(&report, "speed"), column(&report, "copied"), "{sets:?}");
        let lengths = column(&report, "length");
        assert!(lengths.iter().all(|length| (length - 1.0).abs() < 1e-9), "{sets:?}");
        // It falls by z: the speed of energy conservation, and the largest so far of accepted steps, which never falls.
        for ((z, speed), largest) in
            column(&report, "z").iter().zip(column(&report, "speed")).zip(column(&report, "largest"))
        {
            let expected = (-2.0 * 9.81 * z).max(0.0).sqrt();
            assert!((speed - 2.0 - expected).abs() < 1e-6, "{sets:?}: {speed} {expected}");
            assert!(*largest <= (2.0 * 9.81_f64).sqrt() + 1e-6);
        }
        assert!(column(&report, "largest").windows(2).all(|pair| pair[0] <= pair[1]), "{sets:?}");
        // Past the lowest point it has seen nearly the largest speed there is.
        let last = *column(&report, "largest").last().unwrap();
        assert!(last > 0.95 * (2.0 * 9.81_f64).sqrt(), "{sets:?}: {last}");
    }
}

#[test]
fn a_row_that_depends_on_memory_is_refused() {
    let error = try_run(&scene("joint", "jumping-rod", ""), &[]).map(|report| report.summary.reason).unwrap_err();
    assert!(error.contains("jumping-rod") && error.contains("memory"), "{error}");
}

#[test]
fn a_solution_that_ends_in_the_run_ends_it_with_its_name_and_keeps_what_came_before() {
    for (kind, of, unknown) in [("force", "fold", "root"), ("joint", "folding-slide", "place")] {
        let channel = if kind == "force" { output("y", "value", "own", "root") } else { String::new() };
        let text = scene(kind, of, &channel).replace("gravity = [0, 0, -9.81]", "gravity = [0, 0, 0]")
            + "[[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"x\"\n";
        let text = if kind == "joint" { text.replace("[1, 0, 0]", "[0, 0, 0]") } else { text };
        for sets in [
            &[][..],
            &["simulation.formulation=cartesian"],
            &["simulation.engine=reference"],
            &["simulation.method=radau5"],
            &["simulation.method=rk4", "simulation.fixed_step=0.001"],
        ] {
            let report = try_run(&text, sets).unwrap_or_else(|error| panic!("{of} {sets:?}: {error}"));
            let reason = &report.summary.reason;
            assert_ne!(report.exit_code(), 0, "{of} {sets:?}: {reason}");
            assert!(reason.contains("`own`") && reason.contains(&format!("`{unknown}`")), "{of} {sets:?}: {reason}");
            let last = *report.times.last().unwrap();
            assert!(last > 0.8 * END && last <= END, "{of} {sets:?}: {last}");
            // The samples before are the closed form.
            for (t, x) in report.times.iter().zip(column(&report, "x")) {
                let expected = if kind == "force" {
                    // m x'' = sqrt(END - t), from rest at 1.
                    let [a, b] = [END.powf(2.5), (END - t).max(0.0).powf(2.5)];
                    1.0 + 0.5 * (2.0 / 3.0 * END.powf(1.5) * t + 4.0 / 15.0 * (b - a))
                } else {
                    // The lowest root of y^3 - 3 y = s by trigonometry.
                    let s: f64 = t * (4.0 / END) - 2.0;
                    let angle = (0.5 * s).clamp(-1.0, 1.0).acos();
                    2.0 * (angle / 3.0 + 2.0 * std::f64::consts::PI / 3.0).cos() + 2.0
                };
                assert!((x - expected).abs() < 1e-5, "{of} {sets:?}: at {t} {x} {expected}");
            }
        }
    }
}
