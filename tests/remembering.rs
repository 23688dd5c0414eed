//! Elements of others whose memory jumps: what they count and keep, and one that has no end.

use element_api::adapt::control;
use element_api::manifest::Library;
use element_api::prelude::*;
use odyn::catalog::{Catalog, SearchPath};
use odyn::diagnostics::Source;
use odyn::scene::parse;
use odyn::session::{RunReport, Session};

use crate::support::{column, kept, options};

/// Counts how often its signal becomes positive, keeps when that was last, and the largest value that it had at an accepted step.
struct Counter;

impl Element for Counter {
    const NAME: &'static str = "counter";
    const SUMMARY: &'static str = "counts";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Control for Counter {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "what it looks at")];
    const OUTPUTS: &'static [ChannelSpec] = &[
        ChannelSpec::new("count", "", "how often"),
        ChannelSpec::new("sum", "", "the same, added up"),
        ChannelSpec::new("last", "", "when"),
        ChannelSpec::new("largest", "", "at a step"),
    ];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory[1..].iter().for_each(|value| out.push(*value));
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0, 0.0, 0.0, -1.0, -9.0]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let [was, count, sum, last] = [0, 1, 2, 3].map(|k| at.memory[k]);
        let (now, new) = (at.inputs[0].above(0.0), was.below(0.5));
        out.push(select(now, S::one(), S::zero()));
        out.push(select(now, select(new, count + 1.0, count), count));
        out.push(sum + select(now, select(new, S::one(), S::zero()), S::zero()));
        out.push(select(now, select(new, at.time(), last), last));
        out.push(at.memory[4].max(at.inputs[0]));
    }
}

/// A switch with one bound.
struct Ideal;

impl Element for Ideal {
    const NAME: &'static str = "ideal-switch";
    const SUMMARY: &'static str = "switches at zero";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Control for Ideal {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "what it looks at")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "one or minus one")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![1.0]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(select(at.inputs[0].above(0.0), -S::one(), S::one()));
    }
}

fn try_run(text: &str, sets: &[&str]) -> Result<RunReport, String> {
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    let library = Library {
        package: "own".into(),
        version: "1.0.0".into(),
        about: "Controls that remember".into(),
        classes: vec![control::<Counter>(), control::<Ideal>()],
    };
    catalog.add_library(library).unwrap();
    catalog.add("odyn-controls", &SearchPath::standard(&[], &[])).unwrap();
    let options = options(sets, &[]);
    let (scene, warnings) = parse(Source::new("scene.toml", text), &options.overrides)
        .unwrap_or_else(|rejected| panic!("{:?}", rejected.diagnostics));
    let session = Session::with_catalog(scene, warnings, &catalog, &options).map_err(|error| error.to_string())?;
    session.run(None, Box::new(|_| ()), &Default::default()).map_err(|error| error.to_string())
}

fn head(t_end: f64) -> String {
    format!(
        "[simulation]\nt_end = {t_end:?}\noutput_step = 0.37\n[[body]]\nname = \"bystander\"\nmass = 1\ninertia = [1, 1, 1]\n"
    )
}

/// sin(2 t) - 1/2, sent through an integral so that it is a state: it becomes positive at pi / 12 + k pi.
#[test]
fn what_is_counted_and_kept_at_an_instant_is_that_of_the_instant() {
    let output = |name: &str| {
        format!("[[output]]\nname = \"{name}\"\nquantity = \"value\"\nof = \"counter\"\nchannel = \"{name}\"\n")
    };
    let text = head(20.0)
        + "[[control]]\nname = \"rate\"\ntype = \"signal-source\"\nparams.function = \"2 * cos(2 * t)\"\n[[control]]\nname = \"wave\"\n\
           type = \"integral\"\ninputs = { input = \"rate.output\" }\nparams.initial = -0.5\n[[control]]\nname = \"counter\"\n\
           type = \"counter\"\ninputs = { input = \"wave.output\" }\n"
        + &["count", "sum", "last", "largest"].map(output).concat();
    for method in ["dop853", "dopri5", "radau5", "auto"] {
        let sets = [format!("simulation.method = \"{method}\""), "simulation.tolerance = 1e-12".into()];
        let report = try_run(&text, &sets.each_ref().map(String::as_str)).unwrap();
        assert_eq!(report.exit_code(), 0);
        for (k, t) in report.times.iter().enumerate() {
            let at = |name| column(&report, name)[k];
            let passed = ((t - std::f64::consts::PI / 12.0) / std::f64::consts::PI).floor();
            assert_eq!([at("count"), at("sum")], [passed + 1.0; 2], "{method} {t}");
            let last = if passed < 0.0 { -1.0 } else { std::f64::consts::PI * (passed + 1.0 / 12.0) };
            assert!((at("last") - last).abs() < 1e-10, "{method} {t}: {} {last}", at("last"));
        }
        let largest = column(&report, "largest").last().unwrap();
        assert!(*largest > 0.0 && *largest < 0.5 + 1e-9, "{largest}");
    }
}

#[test]
fn a_switch_that_drives_its_own_signal_back_ends_the_run() {
    let text = head(2.0)
        + "[[control]]\nname = \"plant\"\ntype = \"integral\"\ninputs = { input = \"switch.output\" }\nparams.initial = -0.6543\n\
           [[control]]\nname = \"switch\"\ntype = \"ideal-switch\"\ninputs = { input = \"plant.output\" }\n\
           [[output]]\nname = \"x\"\nquantity = \"value\"\nof = \"plant\"\nchannel = \"output\"\n";
    for method in ["dop853", "radau5"] {
        let report = try_run(&text, &[&format!("simulation.method = \"{method}\"")]).unwrap();
        assert_ne!(report.exit_code(), 0);
        let reason = &report.summary.reason;
        assert!(reason.contains("`switch`") && reason.contains("back and forth"), "{reason}");
        assert!((report.summary.t_end_reached - 0.6543).abs() < 1e-8, "{}", report.summary.t_end_reached);
    }
}
