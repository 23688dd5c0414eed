//! Tests of the command line that need no process; `host/tests/cli.rs` has the others.

use clap::{CommandFactory, Parser};
use element_api::params::ParamSpec;
use std::path::Path;

use super::args::{Arguments, Command, RunArgs};

fn run_args(line: &str) -> RunArgs {
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
    let options = args.scene.options(Some(0.5));
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
    assert_eq!(options.audit_tolerance, Some(0.5));
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
