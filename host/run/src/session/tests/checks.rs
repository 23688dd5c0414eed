//! Checks of a scene against closed forms.

use super::*;
use crate::results::CheckResult;

/// A body in free fall: x = 3 t, y = -g t^2 / 2.
fn falling(checks: &str) -> String {
    "[units]\nlength = \"mm\"\n[parameters]\ng = \"2 m/s^2\"\n".to_owned()
        + &settings("gravity = [0, \"-g\", 0]; t_end = 1; output_step = 0.125")
        + "[[body]]\nname = \"stone\"\nmass = 1\ninertia = [1, 1, 1]\nvelocity = [3, 0, 0]\nangular_velocity = [0, 0, 0]\n"
        + &output("x", "quantity = \"position\"; of = \"stone\"; component = \"x\"")
        + &output("y", "quantity = \"position\"; of = \"stone\"; component = \"y\"")
        + checks
}

fn check(name: &str, value: &str, reference: &str, more: &str) -> String {
    format!(
        "[[check]]\nname = \"{name}\"\nkind = \"position\"\nvalue = \"{value}\"\nreference = {reference}\n\
         tolerance = 1e-9\n{more}\n"
    )
}

fn found<'a>(report: &'a RunReport, name: &str) -> &'a CheckResult {
    report.checks.iter().find(|check| check.name == name).unwrap()
}

#[test]
fn a_run_is_checked_in_scene_units() {
    let checks = check("x", "x", "\"3 t\"", "")
        + &check("y", "y", "\"-g t^2/2\"", "")
        + &check("parabola", "y + g/2 (x/3)^2", "0", "");
    let report = run(&falling(&checks));
    assert!(report.summary.checks_passed(), "{:?}", report.summary.checks);
    assert_eq!((report.exit_code(), report.checks.len()), (0, 3));
    let y = found(&report, "y");
    assert_eq!((y.unit.as_str(), y.samples), ("mm", 9));
    assert!(y.largest < 1e-11, "{:e}", y.largest);
    let (t, value, reference) = y.series[8];
    assert!(t == 1.0 && (value + 1000.0).abs() < 1e-9 && reference == -1000.0);
    assert_eq!(found(&report, "parabola").unit, "");
    assert!(report.summary.checks.iter().all(|check| check.series.is_empty()));
}

#[test]
fn a_failed_check_ends_like_a_failed_audit() {
    let report = run(&falling(&(check("good", "x", "\"3 t\"", "") + &check("bad", "x", "\"3.1 t\"", "to = 0.5"))));
    assert_eq!(report.summary.status, Status::Completed);
    assert!(!report.summary.checks_passed());
    assert_eq!(report.exit_code(), Exit::Audit as i32);
    let bad = found(&report, "bad");
    assert!((bad.largest - 0.05).abs() < 1e-12 && bad.at == 0.5);
}

#[test]
fn a_table_that_cannot_be_read_fails_the_check_and_keeps_the_run() {
    let report = run(&falling(&check("x", "x", "{ csv = \"no-such-file.csv\", column = \"x\" }", "")));
    assert_eq!(report.columns[0].len(), 9);
    assert_eq!(report.exit_code(), Exit::Audit as i32);
    assert!(found(&report, "x").problem.as_ref().is_some_and(|problem| problem.contains("no-such-file.csv")));
    let warned = &report.summary.warnings;
    assert!(warned.len() == 1 && warned[0].starts_with("ODY0120: cannot read `no-such-file.csv`"), "{warned:?}");
}

#[test]
fn a_column_that_is_not_there_is_warned_of_before_the_run() {
    let path = std::env::temp_dir().join(format!("odyn-column-{}.csv", std::process::id()));
    std::fs::write(&path, "t,speed\n0,1\n1,2\n").unwrap();
    let report = run(&falling(&check(
        "x",
        "x",
        &format!("{{ csv = {:?}, column = \"sped\" }}", path.display().to_string()),
        "",
    )));
    std::fs::remove_file(&path).unwrap();
    let warned = &report.summary.warnings;
    assert!(
        warned.len() == 1 && warned[0].contains("has no column `sped`, which the check `x` compares with"),
        "{warned:?}"
    );
}

#[test]
fn what_variants_have_in_common_is_read_once() {
    let common = Common::default();
    let folder = std::env::temp_dir().join(format!("odyn-common-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("table.csv");
    std::fs::write(&path, "t,x\n0,1\n").unwrap();
    let first = common.tables().read(&path, &[]);
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(first.is_ok() && Arc::ptr_eq(&first, &common.tables().read(&path, &[])));
    assert!(common.tables().read(&folder.join("other.csv"), &[]).is_err());

    let request = |name: &str| vec![crate::catalog::Request { name: name.into(), ..Default::default() }];
    let mut loaded = 0;
    for name in ["joints", "forces", "joints"] {
        let load = |_: &[_], _: &_| {
            loaded += 1;
            Ok::<_, ()>(catalog())
        };
        common.catalog(request(name), Default::default(), load).unwrap();
    }
    assert_eq!(loaded, 2);
    let failed = common.catalog(request("none"), Default::default(), |_, _| Err("not there"));
    assert_eq!(failed.err(), Some("not there"));
}
