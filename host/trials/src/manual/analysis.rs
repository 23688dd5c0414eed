//! The page of an analysis.

use super::{INDEX_FILE, Manual, case, page_name};
use crate::page::html::{self, Side, escape, table, verdict};
use crate::results::significant;
use crate::verification::{Case, Measured};

/// Its name among those of elements: `odyn/modes`.
pub(super) fn name(analysis: &str) -> String {
    format!("odyn/{analysis}")
}

fn cases<'a>(manual: &'a Manual<'_>, analysis: &'a str) -> impl Iterator<Item = &'a Case> {
    manual.cases.iter().filter(move |case| case.analysis.as_deref() == Some(analysis))
}

/// Its cases.
pub(super) fn page(manual: &Manual<'_>, analysis: &str) -> String {
    let title = escape(analysis);
    let mut body = format!(
        "<p class=\"small\"><a href=\"{INDEX_FILE}\">Verification manual</a></p>\n<h1>{title}</h1>\n\
         <p class=\"lead\">What <code>odyn {title}</code> finds, beside answers that are known independently.</p>\n"
    );
    cases(manual, analysis).for_each(|one| body.push_str(&case::section(one)));
    html::page(&format!("{analysis} - verification"), &body)
}

/// The table of analyses in the overview; empty without any.
pub(super) fn overview(manual: &Manual<'_>) -> String {
    let row = |analysis: &str| {
        let of = || cases(manual, analysis);
        let measured: Vec<&Measured> = of().filter_map(|case| case.outcome.as_ref().ok()).collect();
        let worst = measured.iter().map(|one| one.worst()).reduce(|a, b| if a.is_nan() || a > b { a } else { b });
        vec![
            format!("<a href=\"{}\">{}</a>", escape(&page_name(&name(analysis))), escape(analysis)),
            of().count().to_string(),
            measured.iter().map(|one| one.checks.len()).sum::<usize>().to_string(),
            worst.map_or_else(String::new, |value| significant(value, 2)),
            verdict(of().all(Case::passed)).into(),
        ]
    };
    let rows: Vec<Vec<String>> = manual.analyses().into_iter().map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let head = [
        ("analysis", Side::Left),
        ("scenes", Side::Right),
        ("numbers", Side::Right),
        ("error / tolerance", Side::Right),
        ("", Side::Left),
    ];
    format!("<h2>Analyses</h2>\n{}", table(&head, &rows))
}
