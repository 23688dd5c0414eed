//! The page: work-precision curves of every problem, all numbers, start-up.

use super::report::{Measured, Point, Problem, Report, Setting};
use super::summary::{LEVELS, Ratio};
use crate::page::chart::{Axis, COLORS, Chart, Curve, SIZE, colored, draw, drawing, log_axis};
use crate::page::html::{self, Side, escape, table};
use crate::results::significant;

/// Errors below this are drawn here: there is no less in double precision.
const LEAST: f64 = 1e-16;
/// Errors above this are drawn here.
const MOST: f64 = 1e3;

impl Report {
    /// The page, HTML that needs nothing but itself.
    #[must_use]
    pub fn page(&self) -> String {
        let mut body = format!("<h1>Accuracy and its price</h1>\n<p class=\"lead\">{}", escape(&self.machine.line()));
        if !self.date.is_empty() {
            body.push_str(&format!("; {}", escape(&self.date)));
        }
        body.push_str(
            "</p>\n<p>Error: the largest difference of a measured coordinate from its reference at any sample, absolute. Time: \
             the integration with its samples, median of the repeats; what comes before is in the table at the end. Every \
             time stands with the error of the same run; runs that failed are reported as failed.</p>\n",
        );
        body.push_str(&self.comparison());
        for problem in &self.problems {
            body.push_str(&self.section(problem));
        }
        body.push_str(&self.start_up());
        html::page("Accuracy and its price", &body)
    }

    /// Ours and the others' measurements of a problem.
    fn all<'a>(&'a self, problem: &'a Problem) -> Vec<&'a Point> {
        let peers = self.peers.iter().filter(|point| point.problem == problem.name);
        problem.points.iter().chain(peers).collect()
    }

    /// The curves of a problem with their key and the machine as an SVG file, legible on light and dark; `None` if no run came to its end.
    #[must_use]
    pub fn drawing(&self, problem: &Problem) -> Option<String> {
        const COLUMNS: usize = 4;
        const LINE: usize = 46;
        let points = self.all(problem);
        let series = series(&points);
        let svg = curves(&series, problem)?;
        let content = svg.split_once('>').map_or("", |(_, content)| content).trim_end();
        let content = content.strip_suffix("</svg>").unwrap_or(content);
        let (width, top) = (SIZE.0 as usize, SIZE.1 as usize);
        let mut key = String::new();
        for ((k, series), (_, color)) in series.iter().enumerate().zip(COLORS.iter().cycle()) {
            let (x, y) = (130 + (width - 130) / COLUMNS * (k % COLUMNS), top + LINE / 2 + LINE * (k / COLUMNS));
            let (cy, name) = (y - 10, escape(&series.name));
            key.push_str(&format!(
                "<circle cx=\"{x}\" cy=\"{cy}\" r=\"10\" fill=\"{color}\"/>\n<text x=\"{}\" y=\"{y}\" \
                 font-family=\"sans-serif\" font-size=\"28\" fill=\"currentColor\">{name}</text>\n",
                x + 24
            ));
        }
        let last = top + LINE * series.len().div_ceil(COLUMNS) + LINE / 2;
        key.push_str(&format!(
            "<text x=\"120\" y=\"{last}\" font-family=\"sans-serif\" font-size=\"24\" fill=\"currentColor\">{}</text>\n",
            escape(&self.machine.line())
        ));
        let height = last + LINE / 2;
        let title = escape(&problem.title);
        Some(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" style=\"color:#7d8590\" role=\"img\" \
             aria-label=\"Errors of {title} over time and work\">{content}{key}</svg>\n"
        ))
    }

    fn section(&self, problem: &Problem) -> String {
        let points = self.all(problem);
        let (title, name) = (escape(&problem.title), escape(&problem.name));
        let mut out = format!("<section id=\"{name}\">\n<h2>{title}</h2>\n");
        let unit = if problem.unit.is_empty() { String::new() } else { format!(", {}", escape(&problem.unit)) };
        let measured: Vec<String> = problem.measured.iter().map(|text| html::code(text)).collect();
        out.push_str(&format!("<p>Measured: {}{unit}.</p>\n", measured.join(", ")));
        if !problem.reference.is_empty() {
            out.push_str(&format!("<p>{}.</p>\n", escape(&problem.reference)));
        }
        out.push_str(&figure(&points, problem));
        out.push_str(&self.best_times(problem));
        out.push_str(&format!("<details>\n<summary>Numbers</summary>\n{}</details>\n</section>\n", numbers(&points)));
        out
    }

    /// The other programs beside ours; nothing where there are none.
    fn comparison(&self) -> String {
        let ratios = self.ratios();
        if ratios.is_empty() {
            return String::new();
        }
        let head = [
            ("program", Side::Word),
            ("its time / ours", Side::Right),
            ("compared", Side::Right),
            ("only ours", Side::Right),
            ("only theirs", Side::Right),
            ("least", Side::Left),
        ];
        let row = |ratio: &Ratio| {
            let least = ratio.least.as_ref().map_or_else(String::new, |(least, problem, level)| {
                format!("{} ({}, {level:e})", significant(*least, 2), escape(problem))
            });
            let mean = if ratio.mean.is_nan() { String::new() } else { significant(ratio.mean, 3) };
            let counts = [ratio.compared, ratio.only_ours, ratio.only_theirs].map(|count| count.to_string());
            let mut cells = vec![escape(&ratio.solver), mean];
            cells.extend(counts);
            cells.push(least);
            cells
        };
        format!(
            "<h2>Other programs</h2>\n<p>Geometric mean of the ratio of times of integration at errors of 1e-3, 1e-6 and \
             1e-9, each program with its best method at its best setting; above 1 ours is faster. Errors that only one of \
             the two reaches are counted, not averaged.</p>\n{}",
            table(&head, &ratios.iter().map(row).collect::<Vec<_>>())
        )
    }

    /// The best time of every method at some errors.
    fn best_times(&self, problem: &Problem) -> String {
        let mut head = vec![("method", Side::Word)];
        let titles = LEVELS.map(|level| format!("error ≤ {level:e}, ms"));
        head.extend(titles.iter().map(|title| (title.as_str(), Side::Right)));
        let rows: Vec<Vec<String>> = self
            .best(problem)
            .iter()
            .map(|best| {
                let mut cells = vec![escape(&format!("{} {}", best.solver, best.method))];
                cells.extend(best.times.map(|time| time.map_or_else(String::new, milliseconds)));
                cells
            })
            .collect();
        if rows.is_empty() { String::new() } else { table(&head, &rows) }
    }

    fn start_up(&self) -> String {
        let head = [
            ("problem", Side::Left),
            ("load, ms", Side::Right),
            ("compile, ms", Side::Right),
            ("machine code, ms", Side::Right),
            ("process besides integration, ms", Side::Right),
        ];
        let row = |problem: &Problem| {
            let first = problem.points.iter().find_map(|point| point.outcome.as_ref().ok());
            let time = |time: Option<f64>| time.map_or_else(String::new, milliseconds);
            vec![
                escape(&problem.title),
                time(first.map(|m| m.times.load)),
                time(first.map(|m| m.times.compile)),
                time(first.map(|m| m.times.machine_code)),
                time(problem.start_up),
            ]
        };
        let rows: Vec<Vec<String>> = self.problems.iter().map(row).collect();
        format!(
            "<h2>Start-up</h2>\n<p>Load: reading the scene, opening libraries (which this process has opened before), \
             resolving. Compile: writing and differentiating the equations, assembly. Machine code is made beside the run, \
             on a thread of its own, when that pays (0: it did not). The last column is a whole process from its start to \
             its end, with written results, minus the integration: the median of many.</p>\n{}",
            table(&head, &rows)
        )
    }
}

/// Points of one method of one program.
struct Series<'a> {
    name: String,
    runs: Vec<&'a Measured>,
}

fn series<'a>(points: &[&'a Point]) -> Vec<Series<'a>> {
    let mut all: Vec<Series<'a>> = Vec::new();
    for point in points {
        let name = format!("{} {}", point.solver, point.method);
        let k = all.iter().position(|series| series.name == name).unwrap_or_else(|| {
            all.push(Series { name, runs: Vec::new() });
            all.len() - 1
        });
        all[k].runs.extend(point.outcome.as_ref().ok());
    }
    all
}

/// Error over time and over evaluations; `None` if no run came to its end.
fn curves(series: &[Series<'_>], problem: &Problem) -> Option<String> {
    let height = |run: &Measured| run.error.clamp(LEAST, MOST).log10();
    let over = |across: fn(&Measured) -> Option<f64>| {
        let place = |run: &&Measured| across(run).filter(|x| *x > 0.0).map(|x| (x.log10(), height(run)));
        colored(series.iter().map(|series| series.runs.iter().filter_map(place).collect()))
    };
    let by_time = over(|run| Some(run.times.integrate));
    let by_work = over(|run| run.work.evaluations.map(|count| count as f64));
    if by_time.iter().all(|curve| curve.points.is_empty()) {
        return None;
    }
    let unit = if problem.unit.is_empty() { String::new() } else { format!(" [{}]", problem.unit) };
    let errors = axis(&by_time, |point| point.1, &format!("error{unit}"));
    let times = axis(&by_time, |point| point.0, "integration [s]");
    let counts = axis(&by_work, |point| point.0, "evaluations");
    Some(drawing(&format!("Errors of {} over time and work", escape(&problem.title)), |area| {
        let (left, right) = area.split_horizontally(SIZE.0 / 2);
        draw(&left, &Chart { x: &times, y: &errors, curves: &by_time, dots: true, bound: None })?;
        draw(&right, &Chart { x: &counts, y: &errors, curves: &by_work, dots: true, bound: None })
    }))
}

fn figure(points: &[&Point], problem: &Problem) -> String {
    let series = series(points);
    let Some(svg) = curves(&series, problem) else {
        return "<p class=\"bad\">No run came to its end.</p>\n".into();
    };
    let mut key = String::new();
    for (series, (_, color)) in series.iter().zip(COLORS.iter().cycle()) {
        key.push_str(&format!("<li><i style=\"border-color:{color}\"></i>{}</li>\n", escape(&series.name)));
    }
    format!(
        "<figure>\n{svg}<figcaption>Error over time of integration and over evaluations: lower and further left is better.\
         </figcaption>\n<ul class=\"key\">\n{key}</ul>\n</figure>\n"
    )
}

/// An axis of whole decades around all points, at least one.
fn axis(curves: &[Curve], of: fn(&(f64, f64)) -> f64, label: &str) -> Axis {
    let numbers = || curves.iter().flat_map(|curve| &curve.points).map(of);
    let (least, most) = (numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max));
    if !(most - least).is_finite() {
        return log_axis(0.0, 1.0, label);
    }
    let from = least.floor();
    log_axis(from, most.ceil().max(from + 1.0), label)
}

fn numbers(points: &[&Point]) -> String {
    let head = [
        ("solver", Side::Word),
        ("method", Side::Word),
        ("tolerance", Side::Right),
        ("error", Side::Right),
        ("energy", Side::Right),
        ("integrate, ms", Side::Right),
        ("machine code, ms", Side::Right),
        ("total, ms", Side::Right),
        ("steps", Side::Right),
        ("rejected", Side::Right),
        ("evaluations", Side::Right),
        ("factorisations", Side::Right),
    ];
    let row = |point: &&Point| {
        let setting = match point.setting {
            Setting::Tolerance(tolerance) => significant(tolerance, 3),
            Setting::Step(step) => format!("step {} s", significant(step, 3)),
        };
        let mut cells = vec![escape(&point.solver), escape(&point.method), setting];
        let small = |value: f64| if value.is_nan() { String::new() } else { significant(value, 3) };
        let count = |count: Option<u64>| count.map_or_else(String::new, |count| count.to_string());
        match &point.outcome {
            Ok(Measured { error, energy_error, work, times, .. }) => cells.extend([
                small(*error),
                small(*energy_error),
                milliseconds(times.integrate),
                milliseconds(times.machine_code),
                milliseconds(times.total),
                count(work.steps),
                count(work.rejected),
                count(work.evaluations),
                count(work.factorisations),
            ]),
            Err(reason) => {
                let line = reason.lines().next().unwrap_or_default();
                cells.push(format!("<span class=\"bad\">failed</span> {}", escape(line)));
                cells.resize(head.len(), String::new());
            }
        }
        cells
    };
    table(&head, &points.iter().map(row).collect::<Vec<_>>())
}

fn milliseconds(time: f64) -> String {
    if time.is_nan() { String::new() } else { significant(1e3 * time, 3) }
}
