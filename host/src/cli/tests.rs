//! Tests of the command line that need no process; `host/tests/cli.rs` has the others.

use clap::{CommandFactory, Parser};
use element_api::params::ParamSpec;
use std::path::Path;

use odyn::scene::AuditTolerance;

use super::args::{Arguments, Command};
use super::deferred::Deferred;
use super::scene_args::RunArgs;

fn run_args(line: &str) -> Deferred<RunArgs> {
    let words = std::iter::once("odyn").chain(line.split(' '));
    match Arguments::try_parse_from(words).unwrap().command {
        Command::Run(args) => args,
        other => panic!("{other:?} is not a run"),
    }
}

#[test]
fn the_definition_of_the_command_line_is_sound() {
    Arguments::command().debug_assert();
}

#[test]
fn the_help_names_all_savings_that_can_be_left_out() {
    let command = Arguments::command();
    for name in ["run", "check", "linearise"] {
        let mut command = command.find_subcommand(name).unwrap().clone();
        let help = command.render_long_help().to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        let names: Vec<&str> = odyn::plan::SAVINGS.iter().map(|(name, _)| *name).collect();
        assert!(help.contains(&format!("scene's own list: {}.", names.join(", "))), "{help}");
    }
}

#[test]
fn every_command_has_examples() {
    fn check(command: &clap::Command) {
        for inner in command.get_subcommands() {
            if inner.has_subcommands() {
                check(inner);
            } else {
                let help = inner.get_after_help().map(ToString::to_string).unwrap_or_default();
                assert!(help.contains("odyn "), "`{}` has no examples", inner.get_name());
            }
        }
    }
    check(&Arguments::command());
}

/// Commands that pages show, without what the shell does with them.
fn commands_of(page: &str) -> Vec<String> {
    let shown = page.lines().filter_map(|line| line.strip_prefix("$ odyn "));
    shown.map(|line| line.split(['#', '>', '|']).next().unwrap().trim().to_owned()).collect()
}

/// The words of a command; spaces between double quotes are part of one.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    let joined: String =
        parts.map(|(k, part)| if k % 2 == 1 { part.replace(' ', "\0") } else { part.to_owned() }).collect();
    joined.split_whitespace().map(|word| word.replace('\0', " ")).collect()
}

#[test]
fn the_commands_of_the_book_can_be_given() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let (mut seen, mut faults) = (0, Vec::new());
    for folder in ["docs", "docs/book/src"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "md") {
                continue;
            }
            for line in commands_of(&std::fs::read_to_string(&path).unwrap()) {
                seen += 1;
                let words = std::iter::once("odyn".to_owned()).chain(words(&line));
                if let Err(error) = Arguments::try_parse_from(words) {
                    faults.push(format!("{}: odyn {line}: {error}", path.display()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(seen > 10, "{seen} commands were seen: is this test still reading the right files?");
}

#[test]
fn every_exit_code_is_in_the_help() {
    let help = Arguments::command().get_after_help().unwrap().to_string();
    use super::exit::{AUDIT, DONE, FILES, INTEGRATION, INTERRUPTED, PLUGIN, SCENE, USAGE};
    let assembly = odyn::session::Exit::Assembly as u8;
    for code in [DONE, USAGE, SCENE, PLUGIN, assembly, INTEGRATION, AUDIT, FILES, INTERRUPTED] {
        assert!(help.lines().any(|line| line.trim_start().starts_with(&format!("{code} "))), "{code} is missing");
    }
}

#[test]
fn options_with_a_key_of_their_own_come_behind_all_sets() {
    let args =
        run_args("run s.toml --tol 1e-11 --t-end 50ms --set simulation.tolerance=1 --method rk4 --engine reference");
    let options = args.scene.options(Some(AuditTolerance::Limit(0.5)));
    let texts: Vec<&str> = options.overrides.iter().map(|one| one.text.as_str()).collect();
    assert_eq!(
        texts,
        [
            "simulation.tolerance=1",
            "simulation.tolerance=1e-11",
            "simulation.t_end=50ms",
            "simulation.method=rk4",
            "simulation.engine=reference"
        ]
    );
    assert_eq!(options.audit_tolerance, Some(AuditTolerance::Limit(0.5)));
}

#[test]
fn times_before_zero_are_taken_with_and_without_a_unit() {
    for time in ["-0.5", "-100 ms", "-2e-3s", "0.2 s"] {
        for command in [
            "run s.toml --t-end",
            "bench s.toml --t-end",
            "modes s.toml --at",
            "linearise s.toml --at",
            "loads s.toml --body b --at",
        ] {
            let words = std::iter::once("odyn").chain(command.split(' ')).chain([time]);
            assert!(Arguments::try_parse_from(words).is_ok(), "{command} {time}");
        }
    }
    let args = Arguments::try_parse_from(["odyn", "run", "s.toml", "--t-end", "-100 ms", "--json"]).unwrap();
    let Command::Run(args) = args.command else { panic!("another command") };
    assert!(args.scene.json);
    assert_eq!(args.scene.t_end.as_deref(), Some("-100 ms"));
}

#[test]
fn results_go_below_the_name_of_the_scene() {
    assert_eq!(run_args("run a/compressor.toml").scene.default_output(), Path::new("results").join("compressor"));
    assert_eq!(run_args("run compressor").scene.default_output(), Path::new("results").join("compressor"));
}

#[test]
fn limits_must_be_sensible_numbers() {
    for limit in ["0", "-1", "nan", "inf", "much"] {
        let words = ["odyn", "run", "s.toml", "--tol", limit];
        let text = Arguments::try_parse_from(words).unwrap_err().to_string();
        assert!(text.contains("not a positive number"), "{limit}: {text}");
    }
    assert!(Arguments::try_parse_from(["odyn", "compare", "a", "b", "--tol", "0"]).is_ok());
    let negative = Arguments::try_parse_from(["odyn", "compare", "a", "b", "--tol", "-1"]).unwrap_err();
    assert!(negative.to_string().contains("neither zero nor a positive number"), "{negative}");
}

#[test]
fn quiet_and_verbose_exclude_each_other() {
    assert!(Arguments::try_parse_from(["odyn", "run", "s.toml", "-q", "-v"]).is_err());
}

#[test]
fn descriptions_show_units_defaults_and_ranges() {
    let text = |spec: ParamSpec| super::elements::parameter(&spec).1;
    let stiffness = ParamSpec::new::<f64>("stiffness", "N/m", "Stiffness, c.").min(0.0);
    assert_eq!(text(stiffness), "number [N/m], required, >= 0: Stiffness, c.");
    let length = ParamSpec::new::<f64>("free_length", "m", "Length without load.").default_value(0.5.into());
    assert_eq!(text(length), "number [m], default 0.5: Length without load.");
    let share = ParamSpec::new::<Option<f64>>("share", "", "A share.").above(0.0).below(1.0);
    assert_eq!(text(share), "number, may be left out, > 0, < 1: A share.");
}

mod descriptions {
    //! `odyn elements describe` of one element that has everything.

    use element_api::prelude::*;
    use element_api::{adapt, manifest};
    use odyn::catalog::{Catalog, ElementHandle};

    use super::super::elements::{description, description_json};

    /// An element for these tests.
    struct Everything;

    #[derive(Parameters)]
    struct EverythingParameters {
        /// What it is about.
        #[param(choices = ["rotation", "translation"])]
        about: String,
        /// How it varies.
        #[param(unit = "s -> N", variable = "t")]
        course: Option<Function>,
        /// How much.
        #[param(unit = "N/m", default = 2.5, min = 0.0)]
        amount: f64,
    }

    impl Element for Everything {
        const NAME: &'static str = "everything";
        const SUMMARY: &'static str = "all that can be described";
        const DOC: &'static str = "//! A picture in words.\n//!\n//! ## Equations\n//! y = x\n";
        const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "where it begins")];
        type Parameters = EverythingParameters;

        fn new(p: Self::Parameters) -> Result<Self, ParamError> {
            let _ = (p.about, p.course, p.amount);
            Ok(Self)
        }
    }

    impl Force for Everything {
        const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("pull", "N", "the force")];
        const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("heat", "J", "what is stored")];
        const INPUTS: &'static [InputSpec] =
            &[InputSpec::required("speed", "rad/s", "how fast"), InputSpec::optional("trim", "", 0.5, "shifts it")];
        const JOINTS: &'static [FrameSpec] = &[FrameSpec::new("bearing", "what it rubs in")];

        fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    }

    impl Control for Everything {
        const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the signal")];

        fn outputs<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Values<'_, S>) {
            out.push(S::zero());
        }
    }

    fn handle(class: Box<dyn element_api::ElementClass>) -> ElementHandle {
        let (package, version) = ("odyn-everything".to_owned(), "1.2.3".to_owned());
        let library = manifest::Library { package, version, about: String::new(), classes: vec![class] };
        let mut catalog = Catalog::new();
        catalog.add_library(library).unwrap();
        catalog.find("everything", None).unwrap()
    }

    #[test]
    fn a_description_is_the_manual_page_and_the_definition() {
        let expected = "\
odyn-everything/everything (force, odyn-everything 1.2.3)
  all that can be described

A picture in words.

## Equations
y = x

frames, one body each:
  i  where it begins
inputs:
  speed  [rad/s] must be connected: how fast
  trim   0.5 where nothing is connected: shifts it
joints whose reactions it takes:
  bearing  what it rubs in
channels:
  pull  [N] the force
states:
  heat  [J] what is stored
parameters:
  about   text, one of rotation, translation, required: What it is about.
  course  number, expression in t or list of [argument, value] pairs [s -> N], may be left out: How it varies.
  amount  number [N/m], default 2.5, >= 0: How much.
";
        assert_eq!(description(&handle(adapt::force::<Everything>())), expected);
    }

    #[test]
    fn signals_of_a_control_element_are_given() {
        let text = description(&handle(adapt::control::<Everything>()));
        assert!(text.contains("\ngives:\n  output  the signal\n") && !text.contains("channels"), "{text}");
    }

    #[test]
    fn a_description_as_json_has_the_same() {
        let text = description_json(&handle(adapt::force::<Everything>()));
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["name"], "odyn-everything/everything");
        assert_eq!(json["doc"], "A picture in words.\n\n## Equations\ny = x");
        assert_eq!((&json["inputs"][0]["default"], &json["inputs"][1]["default"]), (&().into(), &0.5.into()));
        assert_eq!(json["joints"][0]["name"], "bearing");
        assert_eq!(json["channels"][0]["unit"], "N");
        assert_eq!(json["params"][0]["choices"][1], "translation");
        assert_eq!(json["params"][1]["variable"], "t");
    }
}

#[test]
fn a_late_call_is_told_with_what_happens_next() {
    use super::failure::late_diagnostic;
    let late = odyn::catalog::Late {
        library: "lib".into(),
        element: "rod".into(),
        instance: Some("it".into()),
        function: "evaluate",
        seconds: 10.0,
    };
    let (waits, ends) = (late_diagnostic(&late, false), late_diagnostic(&late, true));
    assert_eq!(waits.message, "`it` (lib/rod) has not come back from `evaluate` for 10.0 s");
    assert!(!waits.is_error() && waits.help[0].starts_with("waiting;"), "{waits:?}");
    assert!(ends.is_error() && ends.help[0].starts_with("ended as --watchdog asks"), "{ends:?}");
    assert_eq!(run_args("run s.toml --watchdog 0.5").scene.watchdog, Some(0.5));
    assert!(Arguments::try_parse_from("odyn run s.toml --watchdog 1e99".split(' ')).is_err());
    assert!(Arguments::try_parse_from("odyn resume out --watchdog 0.5".split(' ')).is_ok());
}

#[test]
fn a_point_may_have_negative_numbers_in_any_form() {
    let line = "balance s.toml --turn a.angle --about -8.2e-07 -1 3e-7";
    let words = std::iter::once("odyn").chain(line.split(' '));
    assert!(Arguments::try_parse_from(words).is_ok());
}
