//! The parts of a report that are text.

use serde_json::Value;

use crate::page::html::{Side, code, escape, table};
use crate::results::{checksum, significant};
use crate::source::Source;

/// Digits of a number for people.
const DIGITS: usize = 6;

/// How a run ended, what its audit found, its figures, checks and warnings.
pub(crate) fn verdict(source: &Source, several: bool) -> String {
    if !source.text("analysis").is_empty() {
        return answers(source, several);
    }
    let status = source.text("status");
    let good = status == "completed";
    let (mark, words) = match status {
        "completed" => ("good", "Completed: the audit found nothing to object to."),
        "suspect" => ("bad", "Suspect: the end was reached, but results are not to be trusted as they are."),
        "stopped_early" => ("bad", "Stopped early: results are valid up to the time below."),
        "failed" => ("bad", "Failed: results are valid up to the time below."),
        _ => ("bad", "Not ended, or killed: the table has the rows that were written."),
    };
    let number = |key: &str| source.summary.get(key).and_then(Value::as_f64);
    let unit = escape(source.text("time_unit"));
    let mut out = String::new();
    if several {
        out.push_str(&format!("<h2>{}</h2>\n", escape(&source.name)));
    }
    out.push_str(&format!("<p class=\"verdict {mark}\">{words}</p>\n"));
    if !source.text("reason").is_empty() {
        out.push_str(&format!("<p class=\"bad\">{}</p>\n", escape(source.text("reason"))));
    }
    let reached = number("t_end_reached").map_or_else(String::new, |t| significant(t, DIGITS));
    let end = number("t_end").map_or_else(String::new, |t| significant(t, DIGITS));
    let of = if good || reached == end { String::new() } else { format!(" of {end}") };
    out.push_str(&format!(
        "<p>{} of {}: t = {reached}{of} {unit}, {} by <b>{}</b>.</p>\n",
        plural(number("rows"), "row", "rows"),
        code(source.text("scene")),
        plural(number("steps"), "step", "steps"),
        escape(source.text("method")),
    ));
    out.push_str(&figures(source));
    out.push_str(&audit(source));
    out.push_str(&checks(source));
    let warnings = texts(source, "warnings");
    if !warnings.is_empty() {
        let list: String = warnings.iter().map(|text| format!("<li>{}</li>", escape(text))).collect();
        out.push_str(&format!("<h3>Warnings</h3>\n<ul class=\"warnings\">{list}</ul>\n"));
    }
    let not_unique = texts(source, "not_unique");
    if !not_unique.is_empty() {
        let list: Vec<String> = not_unique.iter().map(|name| code(name)).collect();
        out.push_str(&format!(
            "<p>Rigid bodies do not determine {}: one of infinitely many solutions is shown.</p>\n",
            list.join(", ")
        ));
    }
    out
}

/// What an analysis found: its sentence, what has to be known, its tables.
fn answers(source: &Source, several: bool) -> String {
    let mut out = String::new();
    if several {
        out.push_str(&format!("<h2>{}</h2>\n", escape(&source.name)));
    }
    let good = source.summary.get("good").and_then(Value::as_bool).unwrap_or(true);
    out.push_str(&format!(
        "<p class=\"verdict {}\">{}</p>\n<p>{} of {}.</p>\n",
        if good { "good" } else { "bad" },
        escape(source.text("words")),
        code(&format!("odyn {}", source.text("analysis"))),
        code(source.text("scene")),
    ));
    let notes = texts(source, "notes");
    if !notes.is_empty() {
        let list: String = notes.iter().map(|text| format!("<li>{}</li>", escape(text))).collect();
        out.push_str(&format!("<h3>Notes</h3>\n<ul class=\"warnings\">{list}</ul>\n"));
    }
    for shown in entries(source, "tables") {
        let cells = |row: &Value| -> Vec<String> {
            row.as_array().into_iter().flatten().map(|cell| cell.as_str().unwrap_or_default().to_owned()).collect()
        };
        let all = shown.get("rows").and_then(Value::as_array).into_iter().flatten().map(cells);
        let rows: Vec<Vec<String>> = all.map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
        // The head of a table is escaped there.
        let names = shown.get("head").map(cells).unwrap_or_default();
        let is_number = |cell: &String| cell.is_empty() || cell.replace('\u{2212}', "-").parse::<f64>().is_ok();
        let side = |k: usize| match rows.iter().all(|row| row.get(k).is_none_or(is_number)) {
            true => Side::Right,
            false => Side::Left,
        };
        let head: Vec<(&str, Side)> = names.iter().enumerate().map(|(k, name)| (name.as_str(), side(k))).collect();
        let title = shown.get("title").and_then(Value::as_str).unwrap_or_default();
        out.push_str(&format!("<h3>{}</h3>\n{}", escape(title), table(&head, &rows)));
    }
    out
}

/// Figures beside published ones.
fn figures(source: &Source) -> String {
    let rows: Vec<Vec<String>> = entries(source, "figures")
        .map(|figure| {
            let number = |key: &str| figure.get(key).and_then(Value::as_f64);
            let shown = |x: Option<f64>| x.map_or_else(|| "&ndash;".into(), |x| significant(x, DIGITS));
            let difference = match (number("value"), number("published")) {
                (Some(value), Some(published)) if published != 0.0 => {
                    format!("{:+.2} %", 100.0 * (value - published) / published.abs())
                }
                _ => String::new(),
            };
            let word = |key: &str| escape(figure.get(key).and_then(Value::as_str).unwrap_or_default());
            vec![
                word("name"),
                shown(number("value")),
                shown(number("published")),
                difference,
                word("unit"),
                word("remark"),
            ]
        })
        .collect();
    let head = [
        ("Figure", Side::Left),
        ("here", Side::Right),
        ("published", Side::Right),
        ("difference", Side::Right),
        ("unit", Side::Word),
        ("", Side::Left),
    ];
    table(&head, &rows)
}

/// What was checked without knowing the solution, in words.
fn audit(source: &Source) -> String {
    let (Some(audit), limits) = (source.summary.get("audit"), source.summary.get("audit_limits")) else {
        return String::new();
    };
    let measures = [
        (
            "Joints hold: the worst violation of a constraint, as a share of the scene's size",
            "position_violation",
            "constraints",
        ),
        ("They hold in motion: the worst violation of its rate", "velocity_violation", "constraints"),
        ("Energy is kept: what the balance of energy and work misses, as a share", "energy_error_relative", "energy"),
        ("The same at the samples", "sample_energy_error_relative", "energy"),
        ("Newton and Euler hold for every body, with the reactions reported", "load_imbalance", "loads"),
    ];
    let unit = escape(source.text("time_unit"));
    let factor = source.channels.first().and_then(|time| time.get("si_per_unit")?.as_f64()).unwrap_or(1.0);
    let rows: Vec<Vec<String>> = measures
        .iter()
        .filter_map(|(words, key, limit)| {
            let found = audit.get(*key)?.as_f64()?;
            let at = audit.get(format!("{}_at", key.trim_end_matches("_relative"))).and_then(Value::as_f64);
            let limit = limits.and_then(|limits| limits.get(*limit)?.as_f64());
            let fine = limit.is_none_or(|limit| found <= limit);
            Some(vec![
                (*words).into(),
                format!("{found:.1e}"),
                limit.map_or_else(|| "&ndash;".into(), |limit| format!("{limit:.0e}")),
                at.map_or_else(String::new, |at| format!("{} {unit}", significant(at / factor, 4))),
                if fine {
                    "<span class=\"good\">holds</span>".into()
                } else {
                    "<span class=\"bad\">violated</span>".into()
                },
            ])
        })
        .collect();
    let head = [
        ("Audit", Side::Left),
        ("found", Side::Right),
        ("limit", Side::Right),
        ("worst at", Side::Right),
        ("", Side::Word),
    ];
    let mobility = source.summary.get("mobility").and_then(Value::as_u64);
    let redundant = texts(source, "redundant_row_names");
    let mut out = table(&head, &rows);
    if let Some(mobility) = mobility {
        let freedoms = plural(Some(mobility as f64), "degree of freedom", "degrees of freedom");
        out.push_str(&format!("<p>{freedoms}"));
        if !redundant.is_empty() {
            let names: Vec<String> = redundant.iter().map(|name| code(name)).collect();
            out.push_str(&format!("; redundant: {}", names.join(", ")));
        }
        out.push_str(".</p>\n");
    }
    out
}

fn checks(source: &Source) -> String {
    let rows: Vec<Vec<String>> = entries(source, "checks")
        .map(|check| {
            let word = |key: &str| escape(check.get(key).and_then(Value::as_str).unwrap_or_default());
            let number =
                |key: &str| check.get(key).and_then(Value::as_f64).map_or_else(String::new, |x| format!("{x:.1e}"));
            let passed = check.get("passed").and_then(Value::as_bool).unwrap_or(false);
            vec![
                word("name"),
                number("largest"),
                number("tolerance"),
                word("unit"),
                crate::page::html::verdict(passed).into(),
            ]
        })
        .collect();
    let head = [
        ("Check", Side::Left),
        ("largest difference", Side::Right),
        ("allowed", Side::Right),
        ("unit", Side::Word),
        ("", Side::Word),
    ];
    table(&head, &rows)
}

/// Events and remedies, work, libraries, the text of the scene.
pub(crate) fn details(source: &Source, several: bool) -> String {
    let name = if several { format!(" of {}", escape(&source.name)) } else { String::new() };
    let mut out = format!("<section><h2>How it was computed{name}</h2>\n");
    let rows: Vec<Vec<String>> = [
        ("odyn_version", "O-DYN"),
        ("method", "method"),
        ("engine", "formulation and engine"),
        ("tolerance", "relative tolerance"),
        ("steps", "steps"),
        ("rejected", "rejected steps"),
        ("evaluations", "evaluations of the right side"),
        ("factorisations", "factorisations"),
        ("jacobians", "Jacobians"),
        ("projections", "projections"),
        ("load_time_s", "loading, s"),
        ("compile_time_s", "compiling, s"),
        ("integration_time_s", "integration, s"),
        ("wall_time_s", "in all, s"),
        ("results_sha256", "SHA-256 of the table"),
    ]
    .iter()
    .filter_map(|(key, words)| Some(vec![(*words).to_string(), escape(&plain(source.summary.get(*key)?)?)]))
    .collect();
    out.push_str(&table(&[("", Side::Word), ("", Side::Left)], &rows));
    let remedies: Vec<Vec<String>> = source
        .summary
        .get("recoveries")
        .and_then(Value::as_object)
        .into_iter()
        .flatten()
        .filter(|(_, count)| count.as_u64() != Some(0))
        .map(|(name, count)| vec![code(name), count.to_string()])
        .collect();
    if !remedies.is_empty() {
        out.push_str("<h3>Events and remedies</h3>\n");
        out.push_str(&table(&[("what (odyn explain NAME says more)", Side::Left), ("times", Side::Right)], &remedies));
    }
    let libraries: Vec<Vec<String>> = entries(source, "libraries")
        .map(|library| {
            let word = |key: &str| library.get(key).and_then(Value::as_str).unwrap_or_default();
            vec![escape(word("package")), escape(word("version")), code(word("sha256"))]
        })
        .collect();
    if !libraries.is_empty() {
        out.push_str("<h3>Libraries</h3>\n");
    }
    out.push_str(&table(&[("package", Side::Word), ("version", Side::Word), ("SHA-256", Side::Left)], &libraries));
    let overrides = texts(source, "overrides");
    if !overrides.is_empty() {
        let list: Vec<String> = overrides.iter().map(|text| code(text)).collect();
        out.push_str(&format!("<p>Set on the command line: {}.</p>\n", list.join(", ")));
    }
    if let Some(scene) = &source.scene {
        // What was not noted cannot be compared.
        let words = match source.text("scene_sha256") {
            "" => " as it was when this report was made",
            noted if noted == checksum(scene.as_bytes()) => "",
            _ => " <b class=\"bad\">as it is now: it was changed since the run</b>",
        };
        out.push_str(&format!(
            "<details><summary>The scene, {}{words}</summary>\n<pre tabindex=\"0\"><code>{}</code></pre></details>\n",
            code(source.text("scene")),
            escape(scene)
        ));
    }
    out.push_str("</section>\n");
    out
}

fn entries<'a>(source: &'a Source, key: &str) -> impl Iterator<Item = &'a Value> {
    source.summary.get(key).and_then(Value::as_array).into_iter().flatten()
}

fn texts<'a>(source: &'a Source, key: &str) -> Vec<&'a str> {
    entries(source, key).filter_map(Value::as_str).collect()
}

fn plain(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Number(number) if number.is_f64() => Some(significant(number.as_f64()?, 4)),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
}

fn plural(count: Option<f64>, one: &str, many: &str) -> String {
    let count = count.unwrap_or(0.0);
    format!("{} {}", significant(count, 12), if count == 1.0 { one } else { many })
}
