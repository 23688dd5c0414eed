//! The overview.

use super::{Manual, analysis, case, page_name};
use crate::page::html::{self, Side, escape, table, verdict};
use crate::results::{Work, significant};
use crate::verification::{Case, Element, Measured};

/// The overview: totals, a row per element, cases without a page.
pub(super) fn page(manual: &Manual<'_>) -> String {
    let mut body = String::from("<h1>Verification manual</h1>\n");
    let failed = manual.cases.iter().filter(|case| !case.passed()).count();
    let checks = manual.cases.iter().filter_map(|case| case.outcome.as_ref().ok()).map(|m| m.checks.len());
    let mut totals = format!(
        "{} of {} elements verified by {} scenes with {} checks",
        manual.coverage.verified.len(),
        manual.coverage.verified.len() + manual.coverage.gaps.len(),
        manual.cases.len(),
        checks.sum::<usize>()
    );
    match failed {
        0 => totals.push_str(&format!("; every scene: {}", verdict(true))),
        1 => totals.push_str("; <span class=\"bad\">1 scene failed</span>"),
        more => totals.push_str(&format!("; <span class=\"bad\">{more} scenes failed</span>")),
    }
    body.push_str(&format!("<p class=\"lead\">O-DYN {}: {totals}.</p>\n", env!("CARGO_PKG_VERSION")));
    body.push_str(
        "<p>Each scene compares results with an answer that is known independently: a closed form, or a computation of \
         another kind, as its page says. An error passes up to the tolerance stated in the scene; the table gives the \
         largest error as a share of its tolerance. The balance is the largest sum of all reported loads on a body, its \
         weight and its inertia, which is zero for exact arithmetic, as a share of the largest load. Work is counted over \
         all scenes of an element.</p>\n",
    );
    for library in &manual.coverage.libraries {
        let own: Vec<&Element> = manual.shown().filter(|element| element.library == *library).collect();
        let version = own.first().map_or("", |element| element.version.as_str());
        body.push_str(&format!("<h2>{} {}</h2>\n", escape(library), escape(version)));
        let head = [
            ("element", Side::Left),
            ("kind", Side::Left),
            ("scenes", Side::Right),
            ("error / tolerance", Side::Right),
            ("balance", Side::Right),
            ("steps", Side::Right),
            ("evaluations", Side::Right),
            ("factorisations", Side::Right),
            ("", Side::Left),
        ];
        let rows: Vec<Vec<String>> = own.iter().map(|element| row(manual, element)).collect();
        body.push_str(&table(&head, &rows));
    }
    body.push_str(&analysis::overview(manual));
    let others: Vec<&Case> = manual.homeless().collect();
    if !others.is_empty() {
        body.push_str("<h2>Other scenes</h2>\n");
        for other in others {
            body.push_str(&case::section(other));
        }
    }
    html::page("Verification manual", &body)
}

fn row(manual: &Manual<'_>, element: &Element) -> Vec<String> {
    let cases: Vec<&Case> = manual.cases_of(&element.name).collect();
    let measured: Vec<&Measured> = cases.iter().filter_map(|case| case.outcome.as_ref().ok()).collect();
    let mut work = Work::default();
    for one in &measured {
        work.steps += one.work.steps;
        work.evaluations += one.work.evaluations;
        work.factorisations += one.work.factorisations;
    }
    let number = |count: u64| if measured.is_empty() { String::new() } else { count.to_string() };
    let largest = |values: Vec<f64>| {
        let worst = values.into_iter().reduce(|a, b| if a.is_nan() || a > b { a } else { b });
        worst.map_or_else(String::new, |value| significant(value, 2))
    };
    let status = match cases.is_empty() {
        true => "<span class=\"bad\">not verified</span>",
        false => verdict(cases.iter().all(|case| case.passed())),
    };
    vec![
        format!("<a href=\"{}\">{}</a>", escape(&page_name(&element.name)), escape(&element.descriptor.name)),
        element.descriptor.kind.word().to_string(),
        cases.len().to_string(),
        largest(measured.iter().map(|one| one.worst()).collect()),
        largest(measured.iter().filter_map(|one| one.balance.as_ref().map(|b| b.share)).collect()),
        number(work.steps),
        number(work.evaluations),
        number(work.factorisations),
        status.to_string(),
    ]
}
