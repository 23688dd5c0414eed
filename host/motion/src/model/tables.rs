//! What the tables of a recording do between their points and beyond them: what the user should know, and what no joint can
//! follow.

use element_api::params::{ParamKind, ParamSpec, ParamType, Table as Params};
use element_api::recording::{Input, Op};
use element_api::{Descriptor, Interpolation, Kind, Outside, Recording, Table};

use super::behind::{operations_behind, rows};
use super::parameters;
use super::types::GridUse;
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::{Dimension, ElementRecord, Scene, UnitSystem, parse_unit};

/// A curve may leave the values of two neighbouring points by this part of the range of all its values without a word: the
/// crest of a sine that is given by 16 points, or more, of each period is not reported.
const TOLERATED: f64 = 0.01;

/// A curve over time of which a run uses less than this is most probably in another unit.
const LEAST_USED: f64 = 0.01;
/// A run may go on beyond the end of a curve for this share of its length.
const MOST_BEYOND: f64 = 0.05;
/// Points of a curve from which on it is the course of something, not a ramp.
const LEAST_POINTS: usize = 4;

/// What is to be said of the tables of an instance; `params` is what it was given.
pub(super) fn check(
    scene: &Scene,
    record: &ElementRecord,
    class: &Descriptor,
    params: &Params,
    recording: &Recording,
) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let subject = Subject { scene, record, class, params };
    let results = recording.outputs.iter().map(|output| output.node);
    let of_time = tables_of(recording, results).into_iter().filter(|(_, argument)| is_time(recording, *argument));
    let of_time: Vec<&Table> = of_time.filter_map(|(k, _)| recording.tables.get(k)).collect();
    let tables: Vec<&Table> = recording.tables.iter().filter(|table| table.is_sound()).collect();
    for (k, table) in tables.iter().enumerate() {
        if tables[..k].contains(table)
            || tables.iter().any(|other| other.breaks == table.breaks && other.slope() == **table)
        {
            continue;
        }
        let curve = subject.curve_of(table);
        if curve.spec.is_none() {
            // No curve of the scene: a factor of a map, or one that the element makes for itself.
            continue;
        }
        found.extend(subject.interpolated_otherwise(&curve, table));
        found.extend(subject.leaves_its_points(&curve, table));
        if of_time.contains(table) {
            found.extend(subject.beside_the_run(&curve, table));
        }
    }
    if class.kind == Kind::Joint {
        found.extend(subject.kinks_of_rows(recording));
    }
    found
}

struct Subject<'a> {
    scene: &'a Scene,
    record: &'a ElementRecord,
    class: &'a Descriptor,
    params: &'a Params,
}

/// A unit in which numbers of a curve are shown.
struct Shown {
    factor: f64,
    label: String,
    /// The largest number, SI: others are zero where they are round-off beside it.
    size: f64,
}

impl Shown {
    fn of(dimension: Dimension, written: &str, size: f64, scene: &UnitSystem) -> Self {
        let label = match dimension {
            Dimension::DIMENSIONLESS => String::new(),
            _ => format!(" {}", scene.label_as(dimension, written)),
        };
        Self { factor: scene.factor(dimension), label, size }
    }

    /// Without the unit.
    fn number(&self, si: f64) -> String {
        let is_round_off = si.abs() <= 1e-12 * self.size;
        short(if is_round_off { 0.0 } else { si / self.factor })
    }

    fn value(&self, si: f64) -> String {
        self.number(si) + &self.label
    }
}

/// The parameter that a table was made of, as far as can be known: the one whose arguments it has.
struct Curve<'a> {
    spec: Option<&'a ParamSpec>,
    points: Vec<[f64; 2]>,
    interpolation: Option<Interpolation>,
}

impl Curve<'_> {
    /// `the curve of ``torque```
    fn name(&self) -> String {
        self.spec.map_or_else(|| "a curve".into(), |spec| format!("the curve of `{}`", spec.name))
    }

    /// Whether a table passes through its points.
    fn passes(&self, table: &Table) -> bool {
        self.points.iter().all(|[x, y]| near(table.derivative(*x, 0), *y, 1.0))
    }

    /// Whether a table joins its points as it says.
    fn is(&self, table: &Table) -> bool {
        let expected = self.interpolation.and_then(|wanted| Table::through(&self.points, wanted, table.outside).ok());
        expected.is_none_or(|expected| joined_alike(table, &expected))
    }

    /// An argument, a value and a slope in the scene's units.
    fn units(&self, scene: &UnitSystem) -> [Shown; 3] {
        let unit = self.spec.map_or("", |spec| spec.unit.as_str());
        let (argument, value) = unit.split_once("->").unwrap_or(("", ""));
        let units = [argument.trim(), value.trim()];
        let dimensions =
            units.map(|unit| parse_unit(unit).map_or(Dimension::DIMENSIONLESS, |(dimension, _)| dimension));
        let size = |k: usize| self.points.iter().map(|point| point[k].abs()).fold(0.0, f64::max);
        let [argument, value] = [0, 1].map(|k| Shown::of(dimensions[k], units[k], size(k), scene));
        let slope = dimensions[1].over(dimensions[0]).unwrap_or(Dimension::DIMENSIONLESS);
        [argument, value, Shown::of(slope, "", 0.0, scene)]
    }
}

fn curve_of<'a>(class: &'a Descriptor, params: &Params, table: &Table) -> Curve<'a> {
    let given = |spec: &ParamSpec| {
        if !matches!(spec.kind, ParamKind::Function | ParamKind::Curve) {
            return None;
        }
        let value = params.get(&spec.name)?;
        let points = Vec::<[f64; 2]>::read_value(value.get("points").unwrap_or(value))?;
        let same = points.len() <= table.breaks.len() && points.iter().zip(&table.breaks).all(|(p, x)| p[0] == *x);
        same.then_some((points, value))
    };
    let curve = |spec| {
        let (points, value) = given(spec)?;
        let word = value.get("interpolation").and_then(toml::Value::as_str);
        Some(Curve { spec: Some(spec), points, interpolation: word.and_then(|word| word.parse().ok()) })
    };
    // Several curves of an element may have the same arguments, and the same values: that which is joined as the table comes first.
    let mut curves: Vec<Curve<'_>> = class.params.iter().filter_map(curve).collect();
    curves.sort_by_cached_key(|curve| (!curve.passes(table), !curve.is(table)));
    curves.into_iter().next().unwrap_or(Curve { spec: None, points: Vec::new(), interpolation: None })
}

/// The tables that results look up, each with the operation of its argument, ascending.
fn tables_of(recording: &Recording, results: impl IntoIterator<Item = u32>) -> Vec<(usize, u32)> {
    if recording.tables.is_empty() {
        return Vec::new();
    }
    let table = |(_, op)| if let Op::Table(table, argument) = op { Some((table as usize, argument)) } else { None };
    let mut used: Vec<(usize, u32)> = operations_behind(recording, results).into_iter().filter_map(table).collect();
    used.sort_unstable();
    used.dedup();
    used
}

fn is_time(recording: &Recording, argument: u32) -> bool {
    recording.ops.get(argument as usize).and_then(|raw| Op::decode(*raw)) == Some(Op::Input(Input::Time))
}

/// Slopes at both ends of a table.
fn end_slopes(table: &Table) -> [f64; 2] {
    [table.pieces[0][1], Piece::of(table, table.pieces.len() - 1).last_slope]
}

/// Curves over the motion that end with a slope, beyond which they are held: their arguments should not pass these ends, and those of rows
/// of a joint may not.
pub(super) fn kinked_ends(class: &Descriptor, params: &Params, recording: &Recording) -> Vec<GridUse> {
    let kinked = |(k, argument): (usize, u32)| {
        let table = recording.tables.get(k).filter(|table| table.is_sound() && table.outside == Outside::Clamped)?;
        let (curve, slopes) = (curve_of(class, params, table), end_slopes(table));
        let spec = curve.spec.filter(|_| slopes != [0.0; 2] && !is_time(recording, argument))?;
        let ends = [table.breaks[0], table.breaks[table.breaks.len() - 1]];
        let bounds =
            [0, 1].map(|end| if slopes[end] == 0.0 { [-f64::INFINITY, f64::INFINITY][end] } else { ends[end] });
        let unit = spec.unit.split_once("->").map_or("", |(unit, _)| unit).trim().to_owned();
        Some(GridUse { parameter: spec.name.clone(), axis: spec.variable.clone(), unit, argument, bounds })
    };
    let used = match class.kind {
        Kind::Joint => tables_of(recording, rows(recording)),
        Kind::Force => tables_of(recording, recording.outputs.iter().map(|output| output.node)),
        // Those of signals are often there to hold them: limits, dead zones.
        Kind::Control => Vec::new(),
    };
    used.into_iter().filter_map(kinked).collect()
}

impl Subject<'_> {
    fn curve_of(&self, table: &Table) -> Curve<'_> {
        curve_of(self.class, self.params, table)
    }

    fn place(&self, curve: &Curve<'_>) -> std::ops::Range<usize> {
        parameters::place(self.record, curve.spec.map_or("", |spec| spec.name.as_str()))
    }

    /// A library of an earlier contract knows splines only.
    fn interpolated_otherwise(&self, curve: &Curve<'_>, table: &Table) -> Option<Diagnostic> {
        let (spec, wanted) = (curve.spec?, curve.interpolation?);
        if !curve.passes(table) || curve.is(table) {
            return None;
        }
        let written = self.record.params.get(&spec.name).and_then(|raw| raw.as_table());
        let asked = written.is_some_and(|table| table.get("interpolation").is_some());
        let message = format!(
            "`{}` joins the points of `{}` otherwise than by the interpolation `{}`",
            self.record.name.value,
            spec.name,
            wanted.name()
        );
        let made = if asked { Diagnostic::error } else { Diagnostic::warning };
        Some(
            made(codes::INTERPOLATION_IGNORED, message)
                .at(self.place(curve), if asked { "" } else { "which is meant where nothing else is written" })
                .help("its library is older than the choice of interpolations; built again, it follows")
                .help("splines are what it makes: `{ points = [...], interpolation = \"spline\" }` agrees with it"),
        )
    }

    /// The largest excess over the values of two neighbouring points.
    fn leaves_its_points(&self, curve: &Curve<'_>, table: &Table) -> Option<Diagnostic> {
        let pieces: Vec<Piece> = (0..table.pieces.len()).map(|k| Piece::of(table, k)).collect();
        let low = pieces.iter().map(|p| p.ends[0].min(p.ends[1])).fold(f64::INFINITY, f64::min);
        let high = pieces.iter().map(|p| p.ends[0].max(p.ends[1])).fold(f64::NEG_INFINITY, f64::max);
        let worst = pieces.iter().max_by(|a, b| a.excess().total_cmp(&b.excess()))?;
        if worst.excess() <= TOLERATED * (high - low) {
            return None;
        }
        let [argument, value, _] = curve.units(&self.scene.units);
        let message = format!(
            "`{}`: {} reaches {} between its points at {} and {}, where it is {} and {}",
            self.record.name.value,
            curve.name(),
            value.value(worst.farthest()),
            argument.value(worst.from),
            argument.value(worst.to),
            value.value(worst.ends[0]),
            value.value(worst.ends[1]),
        );
        let least = pieces.iter().map(|p| p.low).fold(f64::INFINITY, f64::min);
        let most = pieces.iter().map(|p| p.high).fold(f64::NEG_INFINITY, f64::max);
        let label = format!(
            "points from {} to {}, the curve through them from {} to {}",
            value.number(low),
            value.value(high),
            value.number(least),
            value.value(most)
        );
        let other = match self.class.kind {
            Kind::Joint => {
                "`interpolation = \"monotone\"` stays between the points; joints follow no \"linear\" and \"steps\""
            }
            _ => "`interpolation = \"monotone\"` stays between the points, and so does \"linear\"",
        };
        Some(
            Diagnostic::warning(codes::CURVE_LEAVES_POINTS, message)
                .at(self.place(curve), label)
                .help(other)
                .help("a spline is for points of a smooth function: give more of them where it bends or rises quickly"),
        )
    }

    /// A curve over time of which the run uses next to nothing, or which ends before the run does, somewhere on its way.
    fn beside_the_run(&self, curve: &Curve<'_>, table: &Table) -> Option<Diagnostic> {
        let simulation = &self.scene.simulation;
        let (first, last) = (*table.breaks.first()?, *table.breaks.last()?);
        let [time, value, _] = curve.units(&self.scene.units);
        let name = &self.record.name.value;
        let used = (simulation.t_end.min(last) - simulation.t_start.max(first)).max(0.0);
        if table.outside != Outside::Clamped {
            return None;
        }
        if used < LEAST_USED * (last - first) {
            let message = format!(
                "`{name}`: the run is {} % of {}, which goes from t = {} to {}",
                short(100.0 * used / (last - first)),
                curve.name(),
                time.number(first),
                time.value(last),
            );
            return Some(Diagnostic::warning(codes::CURVE_BESIDE_RUN, message).at(self.place(curve), "").help(
                "where its times are in another unit, name that: in the head of the column, `t [ms]`, or with `units` beside `file`",
            ));
        }
        let length = simulation.t_end - simulation.t_start;
        let [before, at_last] = Piece::of(table, table.pieces.len() - 1).ends;
        // A force that has ended, a level one, and what three points say, such as a ramp, are meant to be held.
        let held = at_last == 0.0 || near(at_last, before, 0.0) || curve.points.len() < LEAST_POINTS;
        // Joints have a message of their own.
        if held || self.class.kind == Kind::Joint || last >= simulation.t_end - MOST_BEYOND * length {
            return None;
        }
        let message = format!(
            "`{name}`: {} ends at t = {}, and the run at {}: from there on it is held at {}",
            curve.name(),
            time.number(last),
            time.value(simulation.t_end),
            value.value(at_last),
        );
        Some(Diagnostic::warning(codes::CURVE_BESIDE_RUN, message).at(self.place(curve), "").help(
            "give points for the whole run, or end it sooner; two equal values at the end say that it is to be held",
        ))
    }

    /// Constraint equations are differentiated twice: a jump of value or slope asks for infinite forces.
    fn kinks_of_rows(&self, recording: &Recording) -> Vec<Diagnostic> {
        let used =
            tables_of(recording, rows(recording)).into_iter().map(|(k, argument)| (k, is_time(recording, argument)));
        let mut used: Vec<(usize, bool)> = used.collect();
        used.sort_unstable();
        used.dedup();
        used.iter().filter_map(|(k, of_time)| self.kink(recording.tables.get(*k)?, *of_time)).collect()
    }

    /// The first jump of value or slope inside a table; else, of a table over time, the one at an end within the run.
    fn kink(&self, table: &Table, of_time: bool) -> Option<Diagnostic> {
        let curve = self.curve_of(table);
        let [argument, _, slope] = curve.units(&self.scene.units);
        let (first, last) = (*table.breaks.first()?, *table.breaks.last()?);
        let is_end = |x: f64| table.outside == Outside::Clamped && (x == first || x == last);
        let name = &self.record.name.value;
        if let Some((x, order)) = table.kinks().find(|(x, order)| *order < 2 && !is_end(*x)) {
            let what = if order == 0 { "jumps" } else { "has a kink" };
            let message = format!("`{name}`: {} {what} at {}", curve.name(), argument.value(x));
            return Some(
                Diagnostic::error(codes::CURVE_NOT_SMOOTH, message)
                    .at(self.place(&curve), "a joint would need infinite forces to follow it")
                    .help("`interpolation = \"monotone\"` has no kinks and stays between the points; its forces jump there")
                    .help("without `interpolation`, the curve of a joint is a spline, which is for points of a smooth function"),
            );
        }
        let simulation = &self.scene.simulation;
        let within = |x: f64| simulation.t_start < x && x < simulation.t_end;
        let (x, _) = table.kinks().find(|(x, order)| of_time && *order == 1 && is_end(*x) && within(*x))?;
        let inner = end_slopes(table)[usize::from(x != first)];
        let (before, after) = if x == first { (0.0, inner) } else { (inner, 0.0) };
        let message = format!(
            "`{name}`: {} {} at t = {}, where the speed jumps from {} to {}",
            curve.name(),
            if x == first { "begins" } else { "ends" },
            argument.value(x),
            slope.number(before),
            slope.value(after),
        );
        Some(
            Diagnostic::warning(codes::CURVE_NOT_SMOOTH, message)
                .at(self.place(&curve), "the value is held outside of the points")
                .help("give points for the whole run, or let them begin and end level: two equal values"),
        )
    }
}

/// A piece of a table: its ends and what it reaches between them.
struct Piece {
    from: f64,
    to: f64,
    ends: [f64; 2],
    low: f64,
    high: f64,
    last_slope: f64,
}

impl Piece {
    fn of(table: &Table, k: usize) -> Self {
        let (from, to) = (table.breaks[k], table.breaks[k + 1]);
        let h = to - from;
        let [c0, c1, c2, c3] = table.pieces[k];
        let value = |s: f64| c0 + s * (c1 + s * (c2 + s * c3));
        let ends = [c0, value(h)];
        // Zeros of the slope c1 + 2 c2 s + 3 c3 s^2, in the form that does not cancel.
        let root = (c2 * c2 - 3.0 * c3 * c1).max(0.0).sqrt();
        let q = -(c2 + root.copysign(c2));
        let inside = [q / (3.0 * c3), c1 / q].into_iter().filter(|s| *s > 0.0 && *s < h).map(value);
        let all: Vec<f64> = inside.chain(ends).collect();
        Self {
            from,
            to,
            ends,
            low: all.iter().copied().fold(f64::INFINITY, f64::min),
            high: all.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            last_slope: c1 + h * (2.0 * c2 + h * 3.0 * c3),
        }
    }

    fn below(&self) -> f64 {
        self.ends[0].min(self.ends[1]) - self.low
    }

    fn above(&self) -> f64 {
        self.high - self.ends[0].max(self.ends[1])
    }

    fn excess(&self) -> f64 {
        self.below().max(self.above())
    }

    fn farthest(&self) -> f64 {
        if self.below() > self.above() { self.low } else { self.high }
    }
}

fn near(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= 1e-9 * (size.abs() + a.abs() + b.abs())
}

/// Whether two tables with the same points are the same in the middle of their pieces.
fn joined_alike(a: &Table, b: &Table) -> bool {
    a.breaks.windows(2).all(|w| {
        let x = 0.5 * (w[0] + w[1]);
        near(a.derivative(x, 0), b.derivative(x, 0), b.derivative(w[0], 0))
    })
}

/// Four digits.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}
