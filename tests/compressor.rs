//! The paper's example: its published figures, and what the host says about the model.

use insta::assert_snapshot;
use odyn::diagnostics::{Code, codes, render};

use crate::support::{open, run};

/// Piston accelerations at both dead centres in mm/ms^2 and the ratio of the peaks of the excitation forces, to the digits
/// that the paper gives.
#[test]
fn the_published_figures_come_out() {
    let report = run("compressor.toml", &[]);
    let figures = &report.summary.figures;
    let published: Vec<f64> = figures.iter().filter_map(|figure| figure.published).collect();
    assert_eq!(published, [1.03, 0.95, 3.0]);
    for (figure, half_a_digit) in figures.iter().zip([0.005, 0.005, 0.5]) {
        assert_eq!(figure.problem, None, "{}", figure.name);
        let off = figure.value.unwrap() - figure.published.unwrap();
        assert!(off.abs() <= half_a_digit, "{}: {:?}", figure.name, figure.value);
    }
}

#[test]
fn the_audit_is_clean() {
    let audit = run("compressor.toml", &[]).summary.audit;
    assert!(audit.position_violation < 1e-13, "{audit:?}");
    assert!(audit.velocity_violation < 1e-12, "{audit:?}");
    assert!(audit.energy_error_relative < 1e-8, "{audit:?}");
}

#[test]
fn check_names_mobility_and_redundant_rows() {
    let session = open("compressor.toml", &[]);
    let report = session.check_report();
    assert_eq!((report.mobility, report.redundant_rows.len()), (1, 2));
    assert_snapshot!(report);
}

#[test]
fn check_warns_of_two_inertias_and_changes_nothing() {
    let session = open("compressor.toml", &[]);
    let found: Vec<Code> = session.warnings.iter().map(|warning| warning.code).collect();
    assert_eq!(found, [codes::UNREAL_INERTIA; 2]);
    let root = format!("{}/", crate::support::root().display());
    assert_snapshot!(render(&session.warnings, &session.scene.source, false).replace(&root, ""));
    for (moment, printed) in session.model.bodies[0].inertia.diagonal().iter().zip([20.0, 0.05, 15.02]) {
        assert!((moment * 1e6 - printed).abs() < 1e-12 * printed, "{moment} kg m^2");
    }
}

#[test]
fn plan_tells_what_is_skipped() {
    let plan = open("compressor.toml", &[]).plan_report().to_string();
    // What machine code costs depends on the processor.
    let (costs, rest): (Vec<&str>, Vec<&str>) = plan.lines().partition(|line| line.starts_with("machine code: about "));
    assert_eq!(costs.len(), 1);
    assert_snapshot!(rest.join("\n"));
}

/// Nothing of the result depends on the moments of inertia that the paper gives block and connecting rod about other axes
/// than the crank's.
#[test]
fn the_unreal_inertias_have_no_influence() {
    let end = "simulation.t_end=20";
    let printed = run("compressor.toml", &[end]);
    let real = run("compressor.toml", &[end, "block.inertia=[20,20,20]", "conrod.inertia=[3.5,3.5,3.5]"]);
    crate::support::assert_same_motion(&real, &printed, 1e-12);
}
