//! Curves over time and over the tolerance of the run, as SVG inside a page.
//!
//! Errors of all kinds share one axis as multiples of the tolerance of their check; what passes stays below the dashed
//! line at 1.

use crate::page::chart::{
    Axis, COLORS, Chart, Curve, INK, SIZE, colored, draw, drawing, linear_axis, log_axis, ten_to,
};
use crate::page::html::escape;
use crate::verification::{Checked, Measured, Rung};

/// Points of a curve; of more, the largest of neighbours are drawn.
const MOST_POINTS: usize = 400;
/// Decades below and above 1 that are drawn; what is smaller or larger stands at the end.
const DECADES: (f64, f64) = (-6.0, 9.0);

/// Errors over time; empty where there is nothing to draw.
pub(super) fn over_time(measured: &Measured) -> String {
    let times = || measured.checks.iter().flat_map(|check| &check.errors).map(|(t, _)| *t);
    let (start, end) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
    // A check at one instant has its number in the table.
    if !(end - start).is_finite() || end <= start {
        return String::new();
    }
    let groups = groups(measured);
    let curves = colored(groups.iter().map(|group| thinned(&group.over_time())));
    let unit = if measured.time_unit.is_empty() { String::new() } else { format!(" [{}]", measured.time_unit) };
    let x = linear_axis(start, end, format!("t{unit}"));
    let y = error_axis(&curves);
    let svg = drawing("Errors over time", |area| {
        draw(area, &Chart { x: &x, y: &y, curves: &curves, dots: false, bound: Some(0.0) })
    });
    figure("Errors over time, as multiples of the tolerances of the checks (dashed).", &groups, &svg)
}

/// Largest errors and evaluations over the tolerance of the run; empty without runs at several tolerances.
pub(super) fn over_tolerance(measured: &Measured) -> String {
    let ladder = &measured.ladder;
    if ladder.len() < 2 {
        return String::new();
    }
    // Tighter tolerances stand further to the right.
    let tightness = |rung: &Rung| -rung.tolerance.log10();
    let (loosest, tightest) = (tightness(&ladder[0]), tightness(&ladder[ladder.len() - 1]));
    let (from, to) = (loosest.floor() - 0.5, tightest.ceil() + 0.5);
    let x = Axis {
        ticks: ladder.iter().map(|rung| tightness(rung).round()).collect(),
        from,
        to,
        label: "tolerance of the run".into(),
        text: |x| ten_to(&-x),
    };
    let groups = groups(measured);
    let share = |group: &Group<'_>| -> Vec<(f64, f64)> {
        ladder.iter().filter_map(|rung| Some((tightness(rung), exponent(group.at(rung)?)))).collect()
    };
    let curves = colored(groups.iter().map(share));
    let y = error_axis(&curves);
    let count = |rung: &Rung| (tightness(rung), (rung.work.evaluations.max(1) as f64).log10());
    let work = [Curve { points: ladder.iter().map(count).collect(), color: INK }];
    let lowest = work[0].points.iter().map(|(_, y)| y.floor()).fold(f64::INFINITY, f64::min);
    let highest = work[0].points.iter().map(|(_, y)| y.ceil()).fold(lowest + 1.0, f64::max);
    let counts = log_axis(lowest, highest, "evaluations");
    let svg = drawing("Errors and work over the tolerance of the run", |area| {
        let (left, right) = area.split_horizontally(SIZE.0 * 3 / 5);
        draw(&left, &Chart { x: &x, y: &y, curves: &curves, dots: true, bound: Some(0.0) })?;
        draw(&right, &Chart { x: &x, y: &counts, curves: &work, dots: true, bound: None })
    });
    figure(
        "Largest errors as multiples of the tolerances of the checks, and work, over the tolerance of the run.",
        &groups,
        &svg,
    )
}

/// Checks that share a curve.
struct Group<'a> {
    name: &'a str,
    /// Each with its number in the scene.
    checks: Vec<(usize, &'a Checked)>,
}

/// Each check by itself where there are colours for all; else all of a kind together.
fn groups(measured: &Measured) -> Vec<Group<'_>> {
    let apart = measured.checks.len() <= COLORS.len();
    let mut groups: Vec<Group<'_>> = Vec::new();
    for one in measured.checks.iter().enumerate() {
        let name = if apart { &one.1.name } else { &one.1.kind };
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.checks.push(one),
            None => groups.push(Group { name, checks: vec![one] }),
        }
    }
    groups
}

impl Group<'_> {
    /// At each time the exponent of the largest error of the checks, over its tolerance.
    fn over_time(&self) -> Vec<(f64, f64)> {
        let shares = |check: &Checked| -> Vec<(f64, f64)> {
            check.errors.iter().map(|(t, error)| (*t, exponent(check.share(*error)))).collect()
        };
        let mut all: Vec<(f64, f64)> = self.checks.iter().flat_map(|(_, check)| shares(check)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
        all.dedup_by(|next, kept| next.0 == kept.0);
        all
    }

    /// The largest error of the checks over its tolerance in a run.
    fn at(&self, rung: &Rung) -> Option<f64> {
        let shares = self.checks.iter().filter_map(|(number, check)| Some(check.share(*rung.largest.get(*number)?)));
        shares.reduce(|a, b| if a.is_nan() || a > b { a } else { b })
    }
}

/// Errors as multiples of tolerances, with the bound in sight. What is zero is drawn at the lower end.
fn error_axis(curves: &[Curve]) -> Axis {
    let heights = || curves.iter().flat_map(|curve| &curve.points).map(|(_, y)| *y).filter(|y| y.is_finite());
    let lowest = heights().fold(-1.0, f64::min).floor();
    let highest = heights().fold(0.0, f64::max).ceil();
    log_axis(lowest, highest + 0.5, "error / tolerance")
}

/// The exponent of ten of a number, within the decades that are drawn; what is not a number is drawn on top. Zero has
/// none: minus infinity.
fn exponent(value: f64) -> f64 {
    match value {
        v if v.is_nan() => DECADES.1,
        0.0 => f64::NEG_INFINITY,
        v => v.log10().clamp(DECADES.0, DECADES.1),
    }
}

/// A curve of few points that keeps the peaks.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let together = points.len().div_ceil(MOST_POINTS).max(1);
    let highest = |some: &[(f64, f64)]| some.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
    points.chunks(together).filter_map(highest).collect()
}

/// A drawing with its caption and the names of its curves.
fn figure(caption: &str, groups: &[Group<'_>], svg: &str) -> String {
    let mut key = String::new();
    for (group, (_, color)) in groups.iter().zip(COLORS.iter().cycle()) {
        let name = match group.checks.len() {
            1 => escape(group.name),
            several => format!("{}, largest of {several}", escape(group.name)),
        };
        key.push_str(&format!("<li><i style=\"border-color:{color}\"></i>{name}</li>\n"));
    }
    format!("<figure>\n{svg}<figcaption>{caption}</figcaption>\n<ul class=\"key\">\n{key}</ul>\n</figure>\n")
}
