//! Plots as drawings, where there are no scripts: one per quantity and unit.

use serde_json::Value;

use crate::page::chart::{COLORS, Chart, Curve, draw, drawing, linear_axis};
use crate::page::html::escape;
use crate::source::Source;

/// Curves in a drawing.
const MOST_CURVES: usize = COLORS.len();
/// Points of a curve in a drawing; of more, the lowest and the highest of each stretch are drawn.
const MOST_POINTS: usize = 1500;

/// The drawings of a run, with their keys.
pub(crate) fn curves(source: &Source) -> String {
    let text = |channel: &Value, key: &str| channel.get(key).and_then(Value::as_str).unwrap_or_default().to_string();
    let over = source.over();
    let unit = source.channels.first().map(|channel| text(channel, "unit")).unwrap_or_default();
    let axis = if unit.is_empty() { over.to_owned() } else { format!("{over} [{unit}]") };
    let mut groups: Vec<((String, String), Vec<usize>)> = Vec::new();
    for (k, channel) in source.channels.iter().skip(1).enumerate() {
        let key = (text(channel, "quantity"), text(channel, "unit"));
        match groups.iter_mut().find(|(other, members)| *other == key && members.len() < MOST_CURVES) {
            Some((_, members)) => members.push(k),
            None => groups.push((key, vec![k])),
        }
    }
    let drawn = groups.iter().map(|((quantity, unit), members)| {
        let words = quantity.replace('_', " ");
        let label = if unit.is_empty() { words } else { format!("{words} [{unit}]") };
        group(source, (over, &axis), &label, members)
    });
    drawn.collect()
}

fn group(source: &Source, (over, axis): (&str, &str), label: &str, members: &[usize]) -> String {
    let points = |column: &usize| -> Vec<(f64, f64)> {
        let pairs = source.table.times.iter().copied().zip(source.table.columns[*column].iter().copied());
        thinned(pairs.filter(|(t, value)| t.is_finite() && value.is_finite()).collect())
    };
    let all: Vec<Vec<(f64, f64)>> = members.iter().map(points).collect();
    let range = |of: fn(&(f64, f64)) -> f64| {
        let numbers = || all.iter().flatten().map(of);
        let (low, high) = (numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max));
        // A level line has its height in the middle.
        let level = if high == 0.0 { 1.0 } else { high.abs() };
        let margin = if high > low { 0.04 * (high - low) } else { level };
        (low, high, margin)
    };
    let ((from, to, _), (low, high, margin)) = (range(|point| point.0), range(|point| point.1));
    if !(from < to && low.is_finite() && high.is_finite()) {
        return String::new();
    }
    let (x, y) = (linear_axis(from, to, axis.into()), linear_axis(low - margin, high + margin, label.into()));
    let curves: Vec<Curve> = all.into_iter().zip(COLORS).map(|(points, (color, _))| Curve { points, color }).collect();
    let names = members.iter().map(|k| source.table.names[*k].as_str());
    let key: String = names
        .zip(COLORS)
        .map(|(name, (_, color))| format!("<li><i style=\"border-color:{color}\"></i>{}</li>", escape(name)))
        .collect();
    let chart = Chart { x: &x, y: &y, curves: &curves, dots: false, bound: None };
    let picture = drawing(&escape(&format!("{label} over {over}")), |area| draw(area, &chart));
    format!("<figure>{picture}<ul class=\"key\">{key}</ul></figure>\n")
}

/// So many points as a drawing has, peaks among them.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points;
    }
    let by_height = |k: &usize, other: &usize| points[*k].1.total_cmp(&points[*other].1);
    let ends = |first: usize, length: usize| {
        let all = first..(first + length).min(points.len());
        let (low, high) = (all.clone().min_by(by_height), all.max_by(by_height));
        [low.min(high), low.max(high)].into_iter().flatten()
    };
    let length = points.len().div_ceil(MOST_POINTS / 2);
    (0..points.len()).step_by(length).flat_map(|first| ends(first, length)).map(|k| points[k]).collect()
}
