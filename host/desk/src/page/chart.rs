//! Curves over axes, linear or logarithmic, as SVG inside a page. Text and axes take the colour of the page, curves have
//! colours that are legible on light and dark.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::html::escape;
use crate::results::significant;

/// Size of a drawing. Coordinates are whole numbers, so it is drawn large; the page scales it.
pub const SIZE: (u32, u32) = (1800, 620);
/// Height of letters in a drawing.
const LETTERS: i32 = 30;
/// Stands for the colour of the page's text, which replaces it in the finished drawing.
pub const INK: RGBColor = RGBColor(1, 2, 3);
const INK_WRITTEN: &str = "#010203";
/// Colours that the colour-blind can tell apart (after Okabe and Ito 2008), middling in brightness.
pub const COLORS: [(RGBColor, &str); 8] = [
    (RGBColor(0x00, 0x84, 0xd1), "#0084d1"),
    (RGBColor(0xd5, 0x5e, 0x00), "#d55e00"),
    (RGBColor(0x00, 0x9e, 0x73), "#009e73"),
    (RGBColor(0xcc, 0x79, 0xa7), "#cc79a7"),
    (RGBColor(0xb8, 0x86, 0x0b), "#b8860b"),
    (RGBColor(0x8a, 0x6f, 0xd6), "#8a6fd6"),
    (RGBColor(0x1f, 0xa8, 0xb8), "#1fa8b8"),
    (RGBColor(0x88, 0x88, 0x88), "#888888"),
];
/// Ticks of an axis, at most.
const MOST_TICKS: u64 = 9;

/// A part of a drawing.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// How drawing ends.
pub type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// An axis; logarithmic ones have the exponents of ten as numbers.
pub struct Axis {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Numbers that are marked.
    pub ticks: Vec<f64>,
    /// What it shows, with its unit.
    pub label: String,
    /// A marked number as written beside it.
    pub text: fn(&f64) -> String,
}

/// Numbers along an axis, with ticks where we want them.
pub struct Scale {
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
pub struct Curve {
    /// Its points, in order.
    pub points: Vec<(f64, f64)>,
    /// Its colour.
    pub color: RGBColor,
}

/// A chart: axes, curves, and a dashed line across at some height.
pub struct Chart<'a> {
    /// The axis across.
    pub x: &'a Axis,
    /// The axis up.
    pub y: &'a Axis,
    /// What is drawn; heights outside the axis stand at its end.
    pub curves: &'a [Curve],
    /// Whether points are marked.
    pub dots: bool,
    /// Height of a dashed line.
    pub bound: Option<f64>,
}

/// Draws a chart into an area.
pub fn draw(area: &Area<'_>, chart: &Chart<'_>) -> Drawn {
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

/// An axis of exponents of ten.
pub fn log_axis(from: f64, to: f64, label: &str) -> Axis {
    Axis { from, to, ticks: whole_numbers(from, to), label: label.into(), text: ten_to }
}

/// An axis of plain numbers.
pub fn linear_axis(from: f64, to: f64, label: String) -> Axis {
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

/// A power of ten by its exponent.
pub fn ten_to(exponent: &f64) -> String {
    match exponent.round() as i64 {
        0 => "1".into(),
        whole => format!("1e{whole}"),
    }
}

/// A colour for each curve, in the order of [`COLORS`].
pub fn colored(curves: impl Iterator<Item = Vec<(f64, f64)>>) -> Vec<Curve> {
    curves.zip(COLORS.iter().cycle()).map(|(points, (color, _))| Curve { points, color: *color }).collect()
}

/// A chart as a file of its own, with names and their colours below.
pub fn file(title: &str, chart: &Chart<'_>, names: &[(&str, &str)]) -> String {
    let (width, height) = SIZE;
    let mut key = String::new();
    for (k, (name, color)) in names.iter().enumerate() {
        let (left, top) = (160 + 420 * k, height + 30);
        key.push_str(&format!(
            "<line x1=\"{left}\" y1=\"{top}\" x2=\"{}\" y2=\"{top}\" stroke=\"{color}\" stroke-width=\"6\"/>\
             <text x=\"{}\" y=\"{}\" font-family=\"sans-serif\" font-size=\"28\" fill=\"currentColor\">{}</text>\n",
            left + 50,
            left + 64,
            top + 10,
            escape(name)
        ));
    }
    let drawn = drawing("", |area| draw(area, chart));
    let content = drawn.split_once('>').map_or("", |(_, content)| content).trim_end().trim_end_matches("</svg>");
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {}\" style=\"color:#7d8590\" role=\"img\" \
         aria-label=\"{}\">{content}{key}</svg>\n",
        height + 60,
        escape(title)
    )
}

/// The drawing as an element of a page, in the page's colour.
pub fn drawing(title: &str, content: impl FnOnce(&Area<'_>) -> Drawn) -> String {
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
