//! Measurements as CSV: ours are written, those of other programs read in the same form.

use std::path::Path;

use super::report::{Measured, Point, Report, Setting, Times, Work};

/// The columns. `setting` says whether `value` is a tolerance or a step (s); times are in s. Fields of what is not known are
/// empty; `status` is `ok` or says why there are no numbers.
pub const HEADER: [&str; 19] = [
    "problem",
    "solver",
    "method",
    "setting",
    "value",
    "status",
    "error",
    "energy_error",
    "load_s",
    "compile_s",
    "machine_code_s",
    "integrate_s",
    "total_s",
    "steps",
    "rejected",
    "evaluations",
    "factorisations",
    "repeats",
    "unit",
];

/// All measurements of a report, after lines of comment about the machine.
#[must_use]
pub fn write(report: &Report) -> String {
    let mut text = format!("# {}\n", report.machine.line());
    if !report.date.is_empty() {
        text.push_str(&format!("# {}\n", report.date.replace(['\n', '\r'], " ")));
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(HEADER).expect("writing to memory does not fail");
    for point in report.points() {
        let problem = report.problems.iter().find(|problem| problem.name == point.problem);
        let unit = problem.map_or("", |problem| problem.unit.as_str());
        writer.write_record(row(point, unit)).expect("writing to memory does not fail");
    }
    let bytes = writer.into_inner().expect("writing to memory does not fail");
    text.push_str(&String::from_utf8_lossy(&bytes));
    text
}

fn row(point: &Point, unit: &str) -> [String; HEADER.len()] {
    let number = |value: f64| if value.is_finite() { format!("{value:e}") } else { String::new() };
    let count = |count: Option<u64>| count.map_or(String::new(), |count| count.to_string());
    let unknown = Measured {
        error: f64::NAN,
        energy_error: f64::NAN,
        times: Times {
            load: f64::NAN,
            compile: f64::NAN,
            machine_code: f64::NAN,
            integrate: f64::NAN,
            total: f64::NAN,
        },
        ..Measured::default()
    };
    let (status, measured) = match &point.outcome {
        Ok(measured) => ("ok".to_string(), *measured),
        Err(reason) => (reason.lines().next().unwrap_or("failed").trim().to_string(), unknown),
    };
    let Measured { error, energy_error, work, times, repeats } = measured;
    [
        point.problem.clone(),
        point.solver.clone(),
        point.method.clone(),
        point.setting.word().into(),
        number(point.setting.value()),
        status,
        number(error),
        number(energy_error),
        number(times.load),
        number(times.compile),
        number(times.machine_code),
        number(times.integrate),
        number(times.total),
        count(work.steps),
        count(work.rejected),
        count(work.evaluations),
        count(work.factorisations),
        if repeats > 0 { repeats.to_string() } else { String::new() },
        unit.into(),
    ]
}

/// Reads a table in the form of [`write()`]. Columns may come in any order; those after `status` may be left out.
///
/// # Errors
/// What is wrong, with the line.
pub fn read(path: &Path) -> Result<Vec<Point>, String> {
    let told = |what: &dyn std::fmt::Display| format!("`{}`: {what}", path.display());
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_path(path).map_err(|e| told(&e))?;
    let names = reader.headers().map_err(|e| told(&e))?.clone();
    let place = |name: &str| names.iter().position(|own| own == name);
    if let Some(missing) = HEADER[..6].iter().find(|name| place(name).is_none()) {
        return Err(told(&format!("no column is called `{missing}`")));
    }
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| told(&e))?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |name: &str| place(name).and_then(|k| record.get(k)).unwrap_or("");
        points.push(point(&field).map_err(|what| told(&format!("line {line}: {what}")))?);
    }
    Ok(points)
}

fn point<'a>(field: &dyn Fn(&str) -> &'a str) -> Result<Point, String> {
    let number = |name: &str| match field(name) {
        "" => Ok(f64::NAN),
        text => text.parse::<f64>().map_err(|_| format!("`{name}` is `{text}`, not a number")),
    };
    let count = |name: &str| match field(name) {
        "" => Ok(None),
        text => text.parse::<u64>().map(Some).map_err(|_| format!("`{name}` is `{text}`, not a whole number")),
    };
    let value = number("value")?;
    let setting = match field("setting") {
        "tolerance" => Setting::Tolerance(value),
        "step" => Setting::Step(value),
        other => return Err(format!("`setting` is `{other}`, neither `tolerance` nor `step`")),
    };
    let outcome = match field("status") {
        "ok" => Ok(Measured {
            error: number("error")?,
            energy_error: number("energy_error")?,
            work: Work {
                steps: count("steps")?,
                rejected: count("rejected")?,
                evaluations: count("evaluations")?,
                factorisations: count("factorisations")?,
            },
            times: Times {
                load: number("load_s")?,
                compile: number("compile_s")?,
                machine_code: number("machine_code_s")?,
                integrate: number("integrate_s")?,
                total: number("total_s")?,
            },
            repeats: count("repeats")?.map_or(0, |n| n as usize),
        }),
        reason => Err(reason.to_string()),
    };
    let text = |name: &str| field(name).to_string();
    Ok(Point { problem: text("problem"), solver: text("solver"), method: text("method"), setting, outcome })
}
