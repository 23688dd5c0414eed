//! Curves over time and over the tolerance of the run, as SVG inside a page.
//!
//! Errors of all kinds share one axis as multiples of the tolerance of their check; what passes stays below the dashed
//! line at 1. Text and axes take the colour of the page, curves have colours that are legible on light and dark.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::html::escape;
use crate::results::significant;
use crate::verification::{Checked, Measured, Rung};

/// Size of a drawing. Coordinates are whole numbers, so it is drawn large; the page scales it.
const SIZE: (u32, u32) = (1800, 620);
/// Height of letters in a drawing.
const LETTERS: i32 = 30;
/// Stands for the colour of the page's text, which replaces it in the finished drawing.
const INK: RGBColor = RGBColor(1, 2, 3);
const INK_WRITTEN: &str = "#010203";
/// Colours that the colour-blind can tell apart (after Okabe and Ito 2008), middling in brightness.
const COLORS: [(RGBColor, &str); 8] = [
    (RGBColor(0x00, 0x84, 0xd1), "#0084d1"),
    (RGBColor(0xd5, 0x5e, 0x00), "#d55e00"),
    (RGBColor(0x00, 0x9e, 0x73), "#009e73"),
    (RGBColor(0xcc, 0x79, 0xa7), "#cc79a7"),
    (RGBColor(0xb8, 0x86, 0x0b), "#b8860b"),
    (RGBColor(0x8a, 0x6f, 0xd6), "#8a6fd6"),
    (RGBColor(0x1f, 0xa8, 0xb8), "#1fa8b8"),
    (RGBColor(0x88, 0x88, 0x88), "#888888"),
];
/// Points of a curve; of more, the largest of neighbours are drawn.
const MOST_POINTS: usize = 400;
/// Ticks of an axis, at most.
const MOST_TICKS: u64 = 9;
/// Decades below and above 1 that are drawn; what is smaller or larger stands at the end.
const DECADES: (f64, f64) = (-6.0, 9.0);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// An axis; logarithmic ones have the exponents of ten as numbers.
struct Axis {
    from: f64,
    to: f64,
    ticks: Vec<f64>,
    label: String,
    text: fn(&f64) -> String,
}

/// Numbers along an axis, with ticks where we want them.
struct Scale {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl From<&Axis> for Scale {
    fn from(axis: &Axis) -> Self {
        Self { range: axis.from..axis.to, ticks: axis.ticks.clone() }
    }
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl AsRangedCoord for &Axis {
    type CoordDescType = Scale;
    type Value = f64;
}

/// A curve in the numbers of its axes.
struct Curve {
    points: Vec<(f64, f64)>,
    color: RGBColor,
}

/// A chart: axes, curves, and a dashed line across at some height.
struct Chart<'a> {
    x: &'a Axis,
    y: &'a Axis,
    curves: &'a [Curve],
    dots: bool,
    bound: Option<f64>,
}

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

fn draw(area: &Area<'_>, chart: &Chart<'_>) -> Drawn {
    let Chart { x, y, curves, dots, bound } = chart;
    let mut context = ChartBuilder::on(area)
        .margin(12)
        .margin_right(30)
        .x_label_area_size(86)
        .y_label_area_size(130)
        .build_cartesian_2d(*x, *y)?;
    let letters = ("sans-serif", LETTERS).into_font().color(&INK);
    context
        .configure_mesh()
        .axis_style(INK.mix(0.4))
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.15).stroke_width(2))
        .label_style(letters.clone())
        .axis_desc_style(letters.pos(Pos::new(HPos::Center, VPos::Top)))
        .x_desc(&x.label)
        .y_desc(&y.label)
        .x_label_formatter(&x.text)
        .y_label_formatter(&y.text)
        .draw()?;
    for curve in *curves {
        let inside = |(a, b): &(f64, f64)| (*a, b.clamp(y.from, y.to));
        let points: Vec<(f64, f64)> = curve.points.iter().map(inside).collect();
        context.draw_series(LineSeries::new(points.iter().copied(), curve.color.stroke_width(4)))?;
        if *dots {
            context.draw_series(points.iter().map(|point| Circle::new(*point, 8, curve.color.filled())))?;
        }
    }
    if let Some(height) = bound {
        let ends = [(x.from, *height), (x.to, *height)];
        context.draw_series(DashedLineSeries::new(ends, 16, 12, INK.stroke_width(3)))?;
    }
    Ok(())
}

/// Errors as multiples of tolerances, with the bound in sight. What is zero is drawn at the lower end.
fn error_axis(curves: &[Curve]) -> Axis {
    let heights = || curves.iter().flat_map(|curve| &curve.points).map(|(_, y)| *y).filter(|y| y.is_finite());
    let lowest = heights().fold(-1.0, f64::min).floor();
    let highest = heights().fold(0.0, f64::max).ceil();
    log_axis(lowest, highest + 0.5, "error / tolerance")
}

fn log_axis(from: f64, to: f64, label: &str) -> Axis {
    Axis { from, to, ticks: whole_numbers(from, to), label: label.into(), text: ten_to }
}

fn linear_axis(from: f64, to: f64, label: String) -> Axis {
    // Ticks at multiples of 1, 2 or 5 times a power of ten.
    let rough = (to - from) / MOST_TICKS as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    let (first, last) = ((from / step - 1e-9).ceil(), (to / step + 1e-9).floor());
    let ticks = (0..=(last - first) as usize).map(|k| ((first + k as f64) * step).clamp(from, to));
    Axis { from, to, ticks: ticks.collect(), label, text: |t| significant(*t, 6) }
}

/// The whole numbers of a range, or every second one, third one and so on if there are too many.
fn whole_numbers(from: f64, to: f64) -> Vec<f64> {
    let (first, last) = (from.ceil() as i64, to.floor() as i64);
    let step = 1 + (last - first).unsigned_abs() / MOST_TICKS;
    (first..=last).filter(|k| k.unsigned_abs().is_multiple_of(step)).map(|k| k as f64).collect()
}

fn ten_to(exponent: &f64) -> String {
    match exponent.round() as i64 {
        0 => "1".into(),
        whole => format!("1e{whole}"),
    }
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

fn colored(curves: impl Iterator<Item = Vec<(f64, f64)>>) -> Vec<Curve> {
    curves.zip(COLORS.iter().cycle()).map(|(points, (color, _))| Curve { points, color: *color }).collect()
}

/// The drawing as an element of a page, in the page's colour.
fn drawing(title: &str, content: impl FnOnce(&Area<'_>) -> Drawn) -> String {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        content(&area).and_then(|()| area.present()).expect("a drawing into memory cannot fail");
    }
    let (width, height) = SIZE;
    let opening = svg.find('>').map_or(0, |end| end + 1);
    let content = svg[opening..].replace(INK_WRITTEN, "currentColor");
    format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\">{content}")
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
