//! A case on a page.

use super::plot;
use crate::page::html::{Side, code, escape, markdown, table, verdict};
use crate::results::{Work, significant};
use crate::verification::{BALANCE_BOUND, Balance, Case, Checked, LADDER, Measured};

/// Title, problem, checks, plots, work and source of a case.
pub(super) fn section(case: &Case) -> String {
    let mut out = format!("<section id=\"{}\">\n<h3>{}</h3>\n", escape(&case.name), escape(&case.title));
    out.push_str(&markdown(&case.text, 3));
    match &case.outcome {
        Ok(measured) => {
            out.push_str(&checks(measured));
            out.push_str(&plot::over_time(measured));
            out.push_str(&plot::over_tolerance(measured));
            if case.analysis.is_none() {
                out.push_str(&run(measured));
            }
        }
        Err(reason) => {
            let reason = escape(reason.trim_end());
            out.push_str(&format!("<p>{}: the scene did not run.</p>\n<pre>{reason}</pre>\n", verdict(false)));
        }
    }
    let (file, source) = (escape(&case.file), escape(&case.source));
    out.push_str(&format!(
        "<details>\n<summary>Scene <code>{file}</code></summary>\n<pre><code>{source}</code></pre>\n</details>\n</section>\n"
    ));
    out
}

fn checks(measured: &Measured) -> String {
    let head = [
        ("check", Side::Left),
        ("kind", Side::Word),
        ("value", Side::Left),
        ("reference", Side::Left),
        ("unit", Side::Word),
        ("tolerance", Side::Right),
        ("largest error", Side::Right),
        ("at t", Side::Right),
        ("", Side::Left),
    ];
    let mut rows: Vec<Vec<String>> = measured.checks.iter().map(|check| row(check, &measured.time_unit)).collect();
    rows.extend(measured.balance.as_ref().map(|balance| balance_row(balance, &measured.time_unit)));
    let mut out = table(&head, &rows);
    for check in &measured.checks {
        if let Some(problem) = &check.problem {
            out.push_str(&format!("<p class=\"bad\">{}: {}</p>\n", escape(&check.name), escape(problem)));
        }
    }
    out
}

fn row(check: &Checked, time_unit: &str) -> Vec<String> {
    vec![
        escape(&check.name),
        escape(&check.kind),
        code(&check.value),
        code(&check.reference),
        escape(&check.unit),
        significant(check.tolerance, 2),
        significant(check.largest, 2),
        time(check.at, time_unit),
        verdict(check.passed).into(),
    ]
}

/// The balance as one more check.
fn balance_row(balance: &Balance, time_unit: &str) -> Vec<String> {
    let what = if balance.torque { "torques on" } else { "forces on" };
    vec![
        "Newton-Euler balance".into(),
        "other".into(),
        format!("{what} {}, share of the largest load", code(&balance.body)),
        code("0"),
        String::new(),
        significant(BALANCE_BOUND, 2),
        significant(balance.share, 2),
        time(balance.at, time_unit),
        verdict(balance.passed()).into(),
    ]
}

fn time(t: f64, unit: &str) -> String {
    if !t.is_finite() {
        return String::new();
    }
    format!("{} {}", significant(t, 4), escape(unit)).trim_end().to_string()
}

fn run(measured: &Measured) -> String {
    let Work { steps, rejected, evaluations, factorisations, .. } = measured.work;
    let mut out = format!(
        "<p class=\"small\">At tolerance {} ({}, {}): {steps} steps, {rejected} rejected, {evaluations} evaluations, \
         {factorisations} factorisations.",
        significant(measured.tolerance, 2),
        escape(&measured.method),
        escape(&measured.engine)
    );
    let reached = |tolerance: &f64| measured.ladder.iter().any(|rung| rung.tolerance == *tolerance);
    let beyond: Vec<String> =
        LADDER.iter().filter(|tolerance| !reached(tolerance)).map(|tolerance| significant(*tolerance, 2)).collect();
    if !measured.ladder.is_empty() && !beyond.is_empty() {
        out.push_str(&format!(" Runs at tolerance {} did not reach their end.", beyond.join(", ")));
    }
    out.push_str("</p>\n");
    out
}
