//! The text at the end of a run.

use crate::diagnostics::codes;
use crate::results::text::{Side, aligned, duration, significant};
use crate::results::{Audit, AuditLimits, FigureResult, Measure, Remedy, Status, Summary, report};
use std::path::Path;

fn compressor() -> Summary {
    let mut audit = Audit::default();
    audit.violation(0.1, (2.1e-16, Some(3)), (3.44e-15, Some(4)));
    Summary {
        status: Status::Completed,
        scene: "scenes/compressor.toml".into(),
        title: "Reciprocating compressor".into(),
        method: "dop853".into(),
        engine: "interpreted".into(),
        t_end: 200.0,
        t_end_reached: 200.0,
        time_unit: "ms".into(),
        steps: 402,
        rejected: 1,
        evaluations: 4873,
        factorisations: 4873,
        projections: 402,
        load_time_s: 0.00123456,
        compile_time_s: 0.00098765,
        integration_time_s: 0.0123,
        wall_time_s: 1.5,
        mobility: 1,
        redundant_rows: 2,
        redundant_row_names: vec!["cylinder: along x".into(), "cylinder: about z".into()],
        audit,
        audit_limits: Some(AuditLimits::all(1e-8)),
        figures: vec![
            FigureResult {
                name: "piston acceleration at 0 deg".into(),
                value: Some(1.031234567),
                published: Some(1.03),
                unit: "mm/ms^2".into(),
                ..FigureResult::default()
            },
            FigureResult {
                name: "ratio".into(),
                value: Some(2.9),
                published: Some(3.0),
                note: "read from a drawing".into(),
                ..FigureResult::default()
            },
            FigureResult {
                name: "peak".into(),
                problem: Some("there are no samples".into()),
                ..FigureResult::default()
            },
        ],
        ..Summary::default()
    }
}

#[test]
fn the_end_of_a_run_is_told() {
    let expected = "\
Reciprocating compressor: completed, t = 200 ms
audit: constraints 2.1e-16, rates 3.4e-15, energy 0; mobility 1; 2 redundant rows (cylinder: along x, cylinder: about z)
  figure                        published     here  difference
  piston acceleration at 0 deg       1.03  1.03123     +0.12 %  mm/ms^2
  ratio                                 3      2.9     -3.33 %  (read from a drawing)
  peak                                  -        -
  peak: there are no samples
work: 402 steps, 1 rejected, 4873 evaluations, 4873 factorisations, 402 projections (dop853, interpreted)
time: load 1.23 ms, compile 988 us, integrate 12.3 ms, in all 1.5 s
results: DIR/results.csv (with channels.json, summary.json)
";
    let text = report(&compressor(), Some(Path::new("DIR")), false).replace(std::path::MAIN_SEPARATOR, "/");
    assert_eq!(text, expected);
}

#[test]
fn an_early_end_says_where_and_why() {
    let summary = Summary {
        status: Status::StoppedEarly,
        t_end_reached: 81.25,
        reason: "the limit of 100 steps is reached".into(),
        code: Some(codes::TOO_MANY_STEPS),
        ..compressor()
    };
    let text = report(&summary, None, false);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "Reciprocating compressor: stopped early, t = 81.25 ms of 200 ms");
    assert_eq!(lines[1], "reason: [ODY0604] the limit of 100 steps is reached");
    assert!(!text.contains("results:"), "nothing was written");
}

#[test]
fn the_audit_line_judges_when_there_are_limits() {
    let with = |limit| Summary { audit_limits: Some(AuditLimits::all(limit)), ..compressor() };
    let passed = with(1e-10);
    assert!(passed.audit_passed());
    assert!(!report(&passed, None, false).contains("limit"));
    let failed = with(1e-16);
    assert!(!failed.audit_passed());
    let text = report(&failed, None, false);
    assert!(text.contains("; above its limits (constraints 1e-16, energy 1e-16, loads 1e-16)\n"), "{text}");
    let unjudged = Summary { audit_limits: None, ..compressor() };
    assert!(unjudged.audit_passed(), "no limits, no judgement");
    assert!(report(&unjudged, None, false).contains("; not judged\n"));
}

#[test]
fn limits_belong_to_the_tolerance_unless_steps_are_fixed() {
    let limits = |tolerance, fixed| {
        let AuditLimits { constraints, energy, loads } = AuditLimits::belonging_to(tolerance, fixed);
        assert_eq!(loads, 1e-6);
        (constraints, energy)
    };
    assert_eq!(limits(1e-12, false), (1e-8, 1e-6));
    assert_eq!(limits(1e-8, false), (1e-8, 1e-4));
    assert_eq!(limits(1e-12, true), (1e-3, 1e-3));
}

#[test]
fn an_audit_that_is_not_a_number_fails() {
    let mut summary = Summary { audit_limits: Some(AuditLimits::all(1e300)), ..compressor() };
    summary.audit.violation(0.3, (f64::NAN, Some(7)), (0.0, None));
    summary.audit.violation(0.4, (1.0, Some(8)), (0.0, None));
    assert!(!summary.audit_passed());
    let beyond = summary.audit.beyond(&AuditLimits::all(1e300));
    assert_eq!((beyond.len(), beyond[0].measure, beyond[0].at, beyond[0].row), (1, Measure::Position, 0.3, Some(7)));
}

#[test]
fn measures_tell_when_and_where_they_were_found() {
    let mut audit = Audit::default();
    for (t, position, kinetic) in [(0.0, 0.0, 1.0), (1.0, 3e-7, 1.5), (2.0, 2e-7, 1.25)] {
        audit.energy(t, kinetic, 0.0, 0.0);
        audit.violation(t, (position, Some(5)), (0.0, None));
    }
    audit.sample_energy(2.5, 4.0, 0.0, 0.0);
    audit.imbalance(2.5, 2e-6, 3);
    audit.imbalance(3.0, 1e-6, 4);
    let found = audit.beyond(&AuditLimits::belonging_to(1e-10, false));
    let found: Vec<_> = found.iter().map(|one| (one.measure, one.found, one.at, one.row)).collect();
    let expected = [
        // 3 J more than at the start, of 4 J.
        (Measure::SampleEnergy, 0.75, 2.5, None),
        // 0.5 J more, of 1.5 J.
        (Measure::Energy, 1.0 / 3.0, 1.0, None),
        (Measure::Position, 3e-7, 1.0, Some(5)),
        (Measure::Loads, 2e-6, 2.5, None),
    ];
    assert_eq!(audit.worst_body(), Some(3));
    assert_eq!(found, expected);
    assert_eq!(Audit::from(&crate::results::AuditRecord::from(&audit)), audit, "also in another process");
}

/// The work of a vibration, each of whose periods adds the same error.
#[test]
fn errors_of_work_count_as_shares_of_all_that_was_done_to_and_fro() {
    let after = |periods: u32, error: f64, kinetic: f64| {
        let mut audit = Audit::default();
        for k in 0..=2 * periods {
            let work = f64::from(k % 2) + error * f64::from(k);
            audit.energy(f64::from(k), f64::from(k % 2) + kinetic * f64::from(k), 0.0, work);
        }
        audit
    };
    let limits = AuditLimits::belonging_to(1e-10, false);
    for periods in [10, 1000, 100_000] {
        // Of 2 J in each period; a motion that takes as much without work being done counts as much.
        for (error, kinetic) in [(5e-9, 0.0), (0.0, 5e-9)] {
            assert!(after(periods, error, kinetic).beyond(&limits).is_empty(), "{periods}");
        }
        for (error, kinetic) in [(5e-7, 0.0), (0.0, -5e-7)] {
            let audit = after(periods, error, kinetic);
            assert_eq!(audit.beyond(&limits).len(), 1, "{periods}: {audit:?}");
            assert_eq!(Audit::from(&crate::results::AuditRecord::from(&audit)), audit, "also in another process");
        }
    }
    // What vibrates without work is judged as before.
    let mut audit = Audit::default();
    (0..=100_u32).for_each(|k| audit.energy(f64::from(k), 1.0 + 2e-8 * f64::from(k), 0.0, 0.0));
    assert_eq!(audit.beyond(&limits).len(), 1, "{audit:?}");
}

#[test]
fn only_a_run_that_reached_its_end_becomes_suspect() {
    let mut summary = compressor();
    summary.suspect(codes::AUDIT_ENERGY, "energy is lost");
    summary.suspect(codes::AUDIT_CONSTRAINTS, "a joint opened");
    assert_eq!((summary.status, summary.code), (Status::Suspect, Some(codes::AUDIT_ENERGY)));
    assert_eq!(summary.reason, "energy is lost; a joint opened");
    let text = report(&summary, None, false);
    let head = "Reciprocating compressor: suspect, t = 200 ms\nreason: [ODY0702] energy is lost; a joint opened\n";
    assert!(text.starts_with(head), "{text}");
    let mut summary = Summary { status: Status::Failed, reason: "no".into(), ..compressor() };
    summary.suspect(codes::AUDIT_ENERGY, "energy is lost");
    assert_eq!((summary.status, summary.reason.as_str()), (Status::Failed, "no"));
    assert_eq!(summary.warnings, ["ODY0702: energy is lost"]);
}

#[test]
fn color_changes_nothing_but_color() {
    let failed = Summary { status: Status::Failed, audit_limits: Some(AuditLimits::all(1e-16)), ..compressor() };
    for summary in [compressor(), failed] {
        let (plain, colored) = (report(&summary, None, false), report(&summary, None, true));
        assert!(!plain.contains('\x1b') && colored.contains('\x1b'));
        let mut stripped = String::new();
        for (k, part) in colored.split("\x1b[").enumerate() {
            stripped.push_str(if k == 0 { part } else { part.split_once('m').unwrap().1 });
        }
        assert_eq!(stripped, plain);
    }
}

#[test]
fn a_long_list_of_rows_is_cut() {
    let names: Vec<String> = (0..9).map(|k| format!("r{k}")).collect();
    let summary = Summary { redundant_rows: 9, redundant_row_names: names, ..compressor() };
    assert!(report(&summary, None, false).contains("; 9 redundant rows (r0, r1, r2, r3, r4, r5, and 3 more)\n"));
}

#[test]
fn a_figure_without_a_published_number_has_no_difference() {
    let figure = |value, published| FigureResult { value, published, ..FigureResult::default() };
    assert_eq!(figure(Some(2.0), None).relative_difference(), None);
    assert_eq!(figure(None, Some(2.0)).relative_difference(), None);
    assert_eq!(figure(Some(2.0), Some(0.0)).relative_difference(), None);
    assert_eq!(figure(Some(-1.5), Some(-2.0)).relative_difference(), Some(0.25));
}

#[test]
fn numbers_are_short() {
    let cases = [
        (0.0, "0"),
        (-0.0, "0"),
        (200.0, "200"),
        (9.9996, "10"),
        (0.99994, "0.9999"),
        (-1.25, "-1.25"),
        (123456.0, "123500"),
        (1234567.0, "1.235e6"),
        (0.00012341, "0.0001234"),
        (0.000012341, "1.234e-5"),
        (1.5e-9, "1.5e-9"),
        (1e300, "1e300"),
        (f64::NAN, "NaN"),
        (f64::NEG_INFINITY, "-inf"),
    ];
    for (value, text) in cases {
        assert_eq!(significant(value, 4), text, "{value:e}");
    }
    assert_eq!(significant(12345678.9, 9), "12345678.9");
}

#[test]
fn durations_have_a_fitting_unit() {
    let texts = [0.0, 12.345, 1.0, 0.0123, 1e-3, 4.2e-6].map(duration);
    assert_eq!(texts, ["0 s", "12.3 s", "1 s", "12.3 ms", "1 ms", "4.2 us"]);
}

#[test]
fn columns_are_aligned_by_characters_not_bytes() {
    let rows = [["ä", "1"], ["bbb", "100"]].map(|row| row.map(String::from).to_vec());
    assert_eq!(aligned(&[Side::Left, Side::Right], &rows), "  ä      1\n  bbb  100\n");
}

#[test]
fn recoveries_are_named_where_there_were_any() {
    let quiet = report(&compressor(), None, false);
    assert!(!quiet.contains("recoveries"), "{quiet}");
    let mut summary = Summary { resumed: 4, ..compressor() };
    let counts = [(Remedy::MethodSwitch, 1), (Remedy::SmallerStep, 31), (Remedy::RankSafe, 2)];
    counts.into_iter().for_each(|(remedy, count)| summary.recoveries[remedy] = count);
    let text = report(&summary, None, false);
    let lines = "recoveries (`odyn explain NAME` says more):
  smaller-step   31  steps made smaller because equations could not be solved
  method-switch   1  changes of method
  rank-safe       2  rank-safe solutions
";
    assert!(text.contains(lines) && text.contains("402 projections, 4 resumptions (dop853"), "{text}");
}

#[test]
fn every_remedy_has_a_name_of_its_own_and_is_explained() {
    for (k, remedy) in Remedy::ALL.into_iter().enumerate() {
        assert_eq!((remedy as usize, Remedy::named(remedy.name())), (k, Some(remedy)));
        assert!(remedy.name().chars().all(|letter| letter == '-' || letter.is_ascii_lowercase()), "{remedy:?}");
        assert!(
            include_str!("../../../../../docs/book/src/trouble.md").contains(&format!("\n| `{}` |", remedy.name())),
            "{remedy:?}"
        );
        for sentence in [remedy.meaning(), remedy.advice()] {
            assert!(sentence.ends_with('.') && sentence.len() > 20, "{remedy:?}");
        }
    }
    assert_eq!(Remedy::named("prayer"), None);
}

#[test]
fn outputs_that_are_not_unique_are_in_the_audit() {
    let text = report(&Summary { not_unique: vec!["Fx".into(), "Mz".into()], ..compressor() }, None, false);
    assert!(text.contains("along x, cylinder: about z); 2 outputs not unique (Fx, Mz)\n"), "{text}");
}

#[test]
fn the_error_of_heat_is_shown_where_it_is_in_what_is_printed() {
    let heated = |work: f64, error: f64| {
        let mut audit = Audit::default();
        for energy in [30.0, 11.7] {
            audit.heated(energy, -0.5 * error);
            audit.energy(1.0, 0.0, 0.0, work);
            audit.heat_is_told();
        }
        // Going on in another process.
        let record = crate::results::AuditRecord::from(&audit);
        assert_eq!(Audit::from(&record), audit);
        report(&Summary { audit, ..compressor() }, None, false)
    };
    for (work, error, said) in [
        (50.0, 0.2, "dissipated 41.7 J, work in 91.7 J\n"),
        (50.0, 0.3, "dissipated 41.7 J (to 0.3 J), work in 91.7 J\n"),
        (50.0, 3.0, "dissipated 41.7 J (to 3 J), work in 91.7 J (to 3 J)\n"),
        // Work that the heat is the larger part of.
        (-41.0, 0.02, "dissipated 41.7 J, work in 0.7 J (to 0.02 J)\n"),
    ] {
        let text = heated(work, error);
        assert!(text.contains(&format!("\nenergy at the end: kinetic 0 J, potential 0 J, {said}")), "{text}");
    }
}

#[test]
fn escapes_in_texts_of_a_scene_are_shown_and_not_obeyed() {
    let title = "a\u{1b}[31m: completed, t = 3\nb\u{7}\u{9b}5n \u{202e}c".to_owned();
    let mut summary = Summary { title, ..compressor() };
    summary.figures[0].note = "\u{1b}]0;owned\u{7}".into();
    summary.suspect(codes::AUDIT_ENERGY, "a fault of a library says \u{1b}[2J");
    let plain = report(&summary, None, false);
    assert!(plain.starts_with("a␛[31m: completed, t = 3␊b␇<009B>5n <202E>c: suspect, t = 200 ms\n"), "{plain}");
    assert!(plain.contains("␛]0;owned␇") && plain.contains("says ␛[2J"), "{plain}");
    assert!(!plain.chars().any(|c| c.is_control() && c != '\n'), "{plain}");
    let colored = report(&summary, None, true);
    assert!(colored.contains("<202E>c: \x1b[1;31msuspect\x1b[0m, t = 200 ms\n"), "{colored}");
}
