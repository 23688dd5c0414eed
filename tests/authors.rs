//! Mistakes of authors that only a run shows: it ends, or is suspect, and names the element.

use std::sync::atomic::{AtomicU32, Ordering};

use element_api::adapt::{control, force, joint};
use element_api::manifest::Library;
use element_api::prelude::*;
use odyn::catalog::Catalog;
use odyn::diagnostics::Source;
use odyn::scene::parse;
use odyn::session::{RunOptions, RunReport, Session, SessionError};

const FRAMES: &[FrameSpec] = &[FrameSpec::new("i", "first"), FrameSpec::new("j", "second")];

/// Its second point is on the line through the first along z, which is somewhere else from z = 0.2 on.
struct Jumps<const BY_ANGLE: bool>;

impl<const BY_ANGLE: bool> Element for Jumps<BY_ANGLE> {
    const NAME: &'static str = if BY_ANGLE { "wraps" } else { "jumps" };
    const SUMMARY: &'static str = "a line with a jump";
    const FRAMES: &'static [FrameSpec] = FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl<const BY_ANGLE: bool> Constraint for Jumps<BY_ANGLE> {
    const ROWS: &'static [&'static str] = &["x", "y"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames[1].position - at.frames[0].position;
        rows.push(d.x);
        // An angle within half a turn, taken for one over many.
        let angle = d.z * 15.0;
        let within = angle.sin().atan2(angle.cos());
        let jump =
            if BY_ANGLE { (within - angle) * 0.01 } else { select(d.z.above(S::from(0.2)), S::from(0.05), S::zero()) };
        rows.push(d.y - jump);
    }
}

/// A force that no function gives, or that is no number from t = 0.5 s on.
struct Whim<const COUNTS: bool>(AtomicU32);

impl<const COUNTS: bool> Element for Whim<COUNTS> {
    const NAME: &'static str = if COUNTS { "counts" } else { "ends" };
    const SUMMARY: &'static str = "a force by its own count";
    const FRAMES: &'static [FrameSpec] = FRAMES;
    const OPAQUE: bool = true;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self(AtomicU32::new(0)))
    }
}

impl<const COUNTS: bool> Force for Whim<COUNTS> {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let calls = f64::from(self.0.fetch_add(1, Ordering::Relaxed));
        let pull = if COUNTS { S::from(1e-3 * calls) } else { (S::from(0.5) - at.time()).sqrt() };
        out.force_pair(0, 1, at.frames()[0].z() * pull);
    }
}

/// The limit of what it holds is no number from t = 0.5 s on.
struct Grip;

impl Element for Grip {
    const NAME: &'static str = "grip";
    const SUMMARY: &'static str = "friction with a limit that ends";
    const FRAMES: &'static [FrameSpec] = FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Grip {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["along z"];

    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}

    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.frames()[0].z().dot(&at.relative_velocity(0, 1)));
    }

    fn limit<S: Scalar>(&self, _: usize, at: &Motion<'_, S>) -> Option<S> {
        Some((S::from(0.5) - at.time()).sqrt())
    }
}

/// A signal that is no number from t = 0.5 s on.
struct Root;

impl Element for Root {
    const NAME: &'static str = "root";
    const SUMMARY: &'static str = "a root";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Control for Root {
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the root")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((S::from(0.5) - at.time()).sqrt());
    }
}

/// Pushes by its signal.
struct Pushed;

impl Element for Pushed {
    const NAME: &'static str = "pushed";
    const SUMMARY: &'static str = "a force by a signal";
    const FRAMES: &'static [FrameSpec] = FRAMES;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Force for Pushed {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the force")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, at.frames()[0].z() * at.inputs[0]);
    }
}

fn run(elements: &str, settings: &str) -> Result<RunReport, SessionError> {
    let mut catalog = Catalog::new();
    let library = Library {
        package: "authors".into(),
        version: "1.0.0".into(),
        about: "Mistakes of authors".into(),
        classes: vec![
            joint::<Jumps<false>>(),
            joint::<Jumps<true>>(),
            joint::<Grip>(),
            force::<Whim<false>>(),
            force::<Whim<true>>(),
            force::<Pushed>(),
            control::<Root>(),
        ],
    };
    catalog.add_library(library).unwrap();
    let text = format!(
        "[simulation]\nt_end = 1\noutput_step = 0.01\ngravity = [0, 0, -0.5]\n{settings}\n[[body]]\nname = \"ball\"\nmass = 1\n\
         inertia = [0.1, 0.1, 0.1]\nvelocity = [0, 0, 1]\n{elements}\n[[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"ball\"\n\
         component = \"y\"\n"
    );
    let (scene, warnings) =
        parse(Source::new("scene.toml", &text), &[]).unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    let session = Session::with_catalog(scene, warnings, &catalog, &RunOptions::default())?;
    session.run(None, Box::new(|_| ()), &Default::default())
}

fn element(kind: &str, class: &str) -> String {
    format!(
        "[[{kind}]]\nname = \"wrong\"\ntype = \"{class}\"\nbodies = [\"ground\", \"ball\"]\naxis = [0, 0, 1]\npoint = [0, 0, 0]\n"
    )
}

const WAYS: [&str; 4] =
    ["method = \"dop853\"", "method = \"radau5\"", "formulation = \"cartesian\"", "formulation = \"joint\""];

#[test]
fn rows_that_jump_end_the_run_where_they_do() {
    for way in WAYS {
        for class in ["jumps", "wraps"] {
            let report = run(&element("joint", class), way).unwrap();
            let reason = &report.summary.reason;
            assert_eq!(report.exit_code(), 6, "{way}, {class}: {reason}");
            assert!(reason.contains("wrong: y is off by"), "{way}, {class}: {reason}");
            assert!(report.columns[0].iter().all(|y| y.abs() < 1e-6), "{way}, {class}: it has jumped");
        }
    }
}

#[test]
fn called_elements_that_are_no_functions_are_refused() {
    for way in WAYS {
        let error = run(&element("force", "counts"), way).unwrap_err().to_string();
        assert!(error.contains("`wrong` (authors/counts) gives different results for the same arguments"), "{error}");
    }
}

#[test]
fn who_gives_what_is_no_number_is_named() {
    let push = "[[control]]\nname = \"wrong\"\ntype = \"root\"\n[[force]]\nname = \"push\"\ntype = \"pushed\"\n\
                bodies = [\"ground\", \"ball\"]\ninputs.input = \"wrong.output\"\n";
    for way in WAYS {
        for elements in [element("force", "ends"), element("joint", "grip"), push.to_owned()] {
            let report = run(&elements, way).unwrap();
            let reason = &report.summary.reason;
            assert_eq!(report.exit_code(), 6, "{way}: {reason}\n{elements}");
            assert!(reason.contains("`wrong` is not a finite number"), "{way}: {reason}\n{elements}");
        }
    }
}

#[test]
fn outputs_that_are_no_numbers_make_a_run_suspect() {
    let root = "[[control]]\nname = \"wrong\"\ntype = \"root\"\n[[output]]\nname = \"root\"\nquantity = \"value\"\nof = \"wrong\"\n";
    let report = run(root, "").unwrap();
    let reason = &report.summary.reason;
    assert_eq!(report.exit_code(), 7, "{reason}");
    assert!(
        reason.contains("the output `root` is not a finite number in 50 of 101 rows, first at t = 0.51 s"),
        "{reason}"
    );
    let let_pass = run(root, "audit_tolerance = \"none\"").unwrap();
    assert_eq!(let_pass.exit_code(), 0, "{}", let_pass.summary.reason);
    assert!(
        let_pass.summary.warnings.iter().any(|warning| warning.contains("ODY0708")),
        "{:?}",
        let_pass.summary.warnings
    );
}
