//! The page of the stress suite.

use std::fs;
use std::io;
use std::path::Path;

use crate::page::html::{self, Side, code, escape, table, verdict};
use crate::results::significant;
use crate::stress::{Measure, Outcome};

/// Name of the page.
pub const STRESS_FILE: &str = "stress.html";

/// The outcomes of the stress suite, to be read beside the manual.
pub struct StressPage<'a> {
    /// The outcomes, in the order in which they are shown.
    pub outcomes: &'a [Outcome],
    /// Whether the trials were run in their full form.
    pub full: bool,
}

impl StressPage<'_> {
    /// The page. The same outcomes give the same bytes, however long they took.
    #[must_use]
    pub fn html(&self) -> String {
        let mut body = String::from("<h1>Numerical stress suite</h1>\n");
        let failed = self.outcomes.iter().filter(|outcome| !outcome.passed()).count();
        let result = match failed {
            0 => format!("every one: {}", verdict(true)),
            more => format!("<span class=\"bad\">{more} failed</span>"),
        };
        let form = if self.full { "full" } else { "short" };
        let (version, count) = (env!("CARGO_PKG_VERSION"), self.outcomes.len());
        body.push_str(&format!("<p class=\"lead\">O-DYN {version}: {count} runs in the {form} form; {result}.</p>\n"));
        body.push_str(
            "<p>Scenes that are hard to compute, each with what is known of it independently, and with bounds for what must come \
             out: violations of joints and of their rates (as shares of the scene's size and speed), the energy balance (as a \
             share of the largest energy), differences from closed forms. Some must be refused, or end early, with a message \
             that names the cause. The table shows the measure nearest to its bound.</p>\n",
        );
        for family in self.families() {
            let own: Vec<&Outcome> = self.outcomes.iter().filter(|outcome| outcome.family == family).collect();
            body.push_str(&format!("<h2>{}</h2>\n", escape(family)));
            body.push_str(&overview(&own));
            own.chunk_by(|a, b| a.trial == b.trial).for_each(|runs| body.push_str(&section(runs)));
        }
        html::page("Numerical stress suite", &body)
    }

    /// Writes the page, making the folder where it is missing.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        fs::write(folder.join(STRESS_FILE), self.html())
    }

    /// The families in the order of their first outcome.
    fn families(&self) -> Vec<&str> {
        let mut families: Vec<&str> = Vec::new();
        for outcome in self.outcomes {
            if !families.contains(&outcome.family.as_str()) {
                families.push(&outcome.family);
            }
        }
        families
    }
}

/// A row per run.
fn overview(outcomes: &[&Outcome]) -> String {
    let head = [
        ("trial", Side::Left),
        ("coordinates", Side::Word),
        ("nearest to its bound", Side::Left),
        ("found", Side::Right),
        ("bound", Side::Right),
        ("steps", Side::Right),
        ("evaluations", Side::Right),
        ("", Side::Left),
    ];
    let row = |outcome: &&Outcome| {
        let worst = outcome.worst();
        let what = worst.map_or(outcome.expected.as_str(), |measure| measure.what.as_str());
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 2));
        let count = |count: u64| if outcome.work.evaluations == 0 { String::new() } else { count.to_string() };
        vec![
            format!("<a href=\"#{0}\">{0}</a>", escape(&outcome.trial)),
            escape(&outcome.formulation),
            escape(what),
            number(worst.map(|measure| measure.found)),
            number(worst.map(|measure| measure.bound)),
            count(outcome.work.steps),
            count(outcome.work.evaluations),
            verdict(outcome.passed()).to_owned(),
        ]
    };
    table(&head, &outcomes.iter().map(row).collect::<Vec<_>>())
}

/// What a trial is about, and everything that was found in its runs.
fn section(runs: &[&Outcome]) -> String {
    let Some(first) = runs.first() else { return String::new() };
    let mut out =
        format!("<section id=\"{0}\">\n<h3>{0}</h3>\n<p>{1}</p>\n", escape(&first.trial), escape(&first.text));
    let changes: Vec<String> = first.set.iter().map(|change| code(change)).collect();
    let changes = if changes.is_empty() { String::new() } else { format!(" with {}", changes.join(", ")) };
    out.push_str(&format!(
        "<p class=\"small\">Scene {}{changes}. Expected: {}.",
        code(&first.scene),
        escape(&first.expected)
    ));
    if !first.why.is_empty() {
        out.push_str(&format!(" Bounds: {}.", escape(&first.why)));
    }
    out.push_str("</p>\n");
    for run in runs {
        for fault in &run.faults {
            let (where_, fault) = (escape(&run.formulation), escape(fault));
            out.push_str(&format!("<p class=\"bad\">{where_}:</p>\n<pre>{fault}</pre>\n"));
        }
    }
    out.push_str(&measures(runs));
    if !first.said.is_empty() {
        out.push_str(&format!("<p>It says:</p>\n<pre>{}</pre>\n", escape(&first.said)));
    }
    out.push_str("</section>\n");
    out
}

/// All measures, with a column per formulation.
fn measures(runs: &[&Outcome]) -> String {
    let mut head = vec![("measure", Side::Left), ("bound", Side::Right)];
    head.extend(runs.iter().map(|run| (run.formulation.as_str(), Side::Right)));
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut known: Vec<&str> = Vec::new();
    for measure in runs.iter().flat_map(|run| &run.measures) {
        if known.contains(&measure.what.as_str()) {
            continue;
        }
        known.push(&measure.what);
        let mut row = vec![escape(&measure.what), significant(measure.bound, 2)];
        row.extend(runs.iter().map(|run| run.measure(&measure.what).map_or_else(String::new, number)));
        rows.push(row);
    }
    if rows.is_empty() {
        return String::new();
    }
    format!("<details>\n<summary>{} measures</summary>\n{}</details>\n", rows.len(), table(&head, &rows))
}

fn number(measure: &Measure) -> String {
    let text = significant(measure.found, 2);
    if measure.passed() { text } else { format!("<span class=\"bad\">{text}</span>") }
}
