//! `[units]`, `[plugins]` and `[simulation]`.

use super::dimension::Dimension;
use super::raw::{RawKind, RawTable, RawValue, Spanned};
use super::reader::{Reader, Record, inner_span, unusable};
use super::record::{AuditTolerance, LibraryRecord, MOST_SAMPLES, OutputTimes, PluginRequest, Simulation};
use super::unit_system::{UNIT_KEYS, UnitSystem};
use odyn_diagnostics::{Diagnostic, Source, codes, help_for};
use semver::VersionReq;

/// Reads `[units]`; comes before everything else, since plain numbers need it.
pub(super) fn read_units(root: &RawTable, source: &Source, diagnostics: &mut Vec<Diagnostic>) -> UnitSystem {
    let mut units = UnitSystem::default();
    let Some(raw) = root.get("units") else {
        return units;
    };
    let Some(table) = raw.as_table() else {
        diagnostics.push(
            Diagnostic::error(codes::WRONG_TYPE, "`units` must be a table `[units]`")
                .at(raw.span.clone(), format!("this is {}", raw.kind.describe())),
        );
        return units;
    };
    let known = UNIT_KEYS.map(|(key, _)| key);
    for (key, value) in &table.entries {
        if !known.contains(&key.value.as_str()) {
            diagnostics.push(
                Diagnostic::error(codes::UNKNOWN_KEY, format!("unknown key `{}` in `[units]`", key.value))
                    .at(key.span.clone(), "")
                    .help_if(help_for(&key.value, &known, "keys")),
            );
            continue;
        }
        let Some(symbol) = value.as_text() else {
            diagnostics.push(
                Diagnostic::error(codes::WRONG_TYPE, format!("`{}` must be a unit in quotes", key.value))
                    .at(value.span.clone(), format!("this is {}", value.kind.describe())),
            );
            continue;
        };
        if let Err(error) = units.set(&key.value, symbol) {
            diagnostics.push(
                Diagnostic::error(error.code, error.message)
                    .at(inner_span(value, &error.range, source), "")
                    .help_if(error.help),
            );
        }
    }
    check_torque_and_energy(table, &units, diagnostics);
    units
}

/// Torque and energy have one dimension, so they can have two names, but not two sizes.
fn check_torque_and_energy(table: &RawTable, units: &UnitSystem, diagnostics: &mut Vec<Diagnostic>) {
    let (Some((torque, _)), Some((energy, _))) = (table.entry("torque"), table.entry("energy")) else {
        return;
    };
    if units.torque_and_energy_agree() {
        return;
    }
    diagnostics.push(
        Diagnostic::error(codes::CONFLICTING_KEYS, "the units of torque and energy have different sizes")
            .at(energy.span.clone(), "of another size than the torque")
            .context(torque.span.clone(), "the torque")
            .help("a torque times an angle is an energy: use N m with J, or kN m with kJ"),
    );
}

pub(super) const PLUGIN_KEYS: &[&str] = &["libraries", "path", "trust"];
pub(super) const LIBRARY_KEYS: &[&str] = &["name", "version", "sha256"];

/// Reads `[plugins]`.
pub(super) fn read_plugins(root: &RawTable, reader: &mut Reader<'_>) -> PluginRequest {
    let Some(record) = reader.section(root, "plugins") else {
        return PluginRequest::default();
    };
    reader.check_keys(&record, PLUGIN_KEYS);
    let paths = record.table.get("path").map(|raw| reader.words(raw, "path")).unwrap_or_default();
    let libraries = record.table.get("libraries").and_then(|raw| reader.list(raw, "libraries", "a list of names"));
    let libraries = libraries.unwrap_or_default();
    let mut libraries: Vec<_> = libraries.iter().filter_map(|raw| read_library(raw, reader)).collect();
    for word in record.table.get("trust").map(|raw| reader.words(raw, "trust")).unwrap_or_default() {
        match libraries.iter_mut().find(|library| library.name.value == word.value) {
            Some(library) => library.trusted = true,
            None => reader.diagnostics.push(
                Diagnostic::error(codes::UNKNOWN_WORD, format!("`{}` is not one of the `libraries`", word.value))
                    .at(word.span, "")
                    .help("`trust` repeats names from `libraries`"),
            ),
        }
    }
    PluginRequest { libraries, paths }
}

/// A name, or a table with a name and what it is pinned to.
fn read_library(raw: &RawValue, reader: &mut Reader<'_>) -> Option<LibraryRecord> {
    let span = raw.span.clone();
    if let Some(text) = raw.as_text() {
        if text.is_empty() {
            reader.diagnostics.push(unusable("", span));
            return None;
        }
        return Some(LibraryRecord {
            name: Spanned::new(text.into(), span.clone()),
            version: None,
            sha256: None,
            trusted: false,
            span,
        });
    }
    let Some(table) = raw.as_table() else {
        reader.wrong_type("libraries", "a list of names or of tables `{ name = ..., version = ... }`", raw);
        return None;
    };
    let record = Record { table, what: "this library".into() };
    reader.check_keys(&record, LIBRARY_KEYS);
    let version = reader.word(&record, "version").and_then(|text| match VersionReq::parse(&text.value) {
        Ok(range) => Some(range),
        Err(error) => {
            let message = format!("`{}` is no version, nor a range of such: {error}", text.value);
            let diagnostic = Diagnostic::error(codes::UNKNOWN_WORD, message).at(text.span, "");
            reader
                .diagnostics
                .push(diagnostic.help("write \"1.2\" for 1.2.0 up to 2.0.0, \"=1.2.3\", or \">=1.2, <1.5\""));
            None
        }
    });
    let sha256 = reader.word(&record, "sha256").and_then(|text| {
        let hash = text.value.to_ascii_lowercase();
        if hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Some(hash);
        }
        let message = "`sha256` must have 64 hexadecimal digits";
        let diagnostic =
            Diagnostic::error(codes::UNKNOWN_WORD, message).at(text.span, format!("{} characters", hash.len()));
        reader
            .diagnostics
            .push(diagnostic.help("`odyn plugin list --pins` prints those of the libraries that are found"));
        None
    });
    let name = reader.required_word(&record, "name")?;
    Some(LibraryRecord { name, version, sha256, trusted: false, span })
}

pub(super) const SIMULATION_KEYS: &[&str] = &[
    "gravity",
    "t_start",
    "start",
    "t_end",
    "output_step",
    "output_times",
    "tolerance",
    "method",
    "engine",
    "formulation",
    "islands",
    "max_step",
    "fixed_step",
    "first_step",
    "max_steps",
    "checkpoint_every",
    "motion",
    "audit_tolerance",
    "without",
];

/// Largest relative tolerance: with errors as large as what is computed, there is no control of them.
const MOST_TOLERANCE: f64 = 0.1;
/// Acceleration of gravity on earth, m/s^2, as people write it.
const ON_EARTH: std::ops::RangeInclusive<f64> = 9.78..=9.84;
/// The same in mm/s^2, in/s^2 and ft/s^2.
const ON_EARTH_OTHERWISE: [(std::ops::RangeInclusive<f64>, &str); 3] =
    [(9780.0..=9840.0, "mm/s^2"), (385.0..=387.5, "in/s^2"), (32.08..=32.28, "ft/s^2")];
/// The word for `audit_tolerance` that switches judging off.
const NOT_JUDGED: &str = "none";

/// Reads `[simulation]`; `None` if it cannot be used.
pub(super) fn read_simulation(root: &RawTable, reader: &mut Reader<'_>) -> Option<Simulation> {
    if root.get("simulation").is_none() {
        reader.diagnostics.push(
            Diagnostic::error(codes::MISSING_KEY, "the scene has no `[simulation]`")
                .at(0..0, "")
                .help("add `[simulation]` with `t_end` and `output_step`"),
        );
    }
    let record = reader.section(root, "simulation")?;
    reader.check_keys(&record, SIMULATION_KEYS);
    let gravity = reader.vector_or_zero(&record, "gravity", Dimension::ACCELERATION);
    let t_start = reader.optional(&record, "t_start", Dimension::TIME);
    let begin = t_start.as_ref().map_or(0.0, |time| time.value);
    if record.table.get("t_end").is_none() {
        reader.missing(&record, "t_end");
    }
    let t_end = reader.optional(&record, "t_end", Dimension::TIME);
    if let Some(end) = &t_end
        && end.value <= begin
    {
        reader.out_of_range("`t_end` must be after `t_start`".to_owned(), end.span.clone(), "");
    }
    let span = begin..t_end.map_or(f64::INFINITY, |end| end.value);
    let output = read_output_times(&record, &span, reader);
    let start = reader.word(&record, "start");
    let tolerance = reader.positive(&record, "tolerance", Dimension::DIMENSIONLESS);
    if let Some(raw) = record.table.get("tolerance").filter(|_| tolerance.is_some_and(|value| value > MOST_TOLERANCE)) {
        let message = format!("`tolerance` is relative, at most {MOST_TOLERANCE}");
        reader.out_of_range(message, raw.span.clone(), "nothing would be right at all");
    }
    let method = reader.word(&record, "method");
    let engine = reader.word(&record, "engine");
    let formulation = reader.word(&record, "formulation");
    let islands = reader.word(&record, "islands");
    let max_step = reader.positive(&record, "max_step", Dimension::TIME);
    let first_step = reader.positive(&record, "first_step", Dimension::TIME);
    let fixed_step = reader.positive(&record, "fixed_step", Dimension::TIME);
    let max_steps = reader.whole(&record, "max_steps", 1);
    let checkpoint_every = reader.positive(&record, "checkpoint_every", Dimension::TIME);
    let motion = reader.flag(&record, "motion", false);
    let not_judged = record.table.get("audit_tolerance").and_then(RawValue::as_text) == Some(NOT_JUDGED);
    let audit_tolerance = if not_judged {
        Some(AuditTolerance::None)
    } else {
        reader.positive(&record, "audit_tolerance", Dimension::DIMENSIONLESS).map(AuditTolerance::Limit)
    };
    warn_of_gravity(&record, gravity, reader);
    for (key, beside) in [("max_step", "fixed_step"), ("first_step", "fixed_step")] {
        without_effect(&record, key, beside, "all steps have that size", reader);
    }
    let is = |key: &str, word: &str| record.table.get(key).and_then(RawValue::as_text) == Some(word);
    if is("engine", "reference") && is("formulation", "joint") {
        without_effect(&record, "formulation", "engine", "the reference engine has coordinates of its own", reader);
    }
    let without = record.table.get("without").map(|raw| reader.words(raw, "without")).unwrap_or_default();
    Some(Simulation {
        span: record.table.span.clone(),
        gravity,
        t_start: begin,
        start,
        t_end: span.end,
        output: output?,
        tolerance,
        method,
        engine,
        formulation,
        islands,
        max_step,
        fixed_step,
        first_step,
        max_steps: max_steps.map(|number| number.value),
        checkpoint_every,
        motion,
        audit_tolerance,
        without,
    })
}

/// Warns of a key that changes nothing beside another one.
fn without_effect(record: &Record<'_>, key: &str, beside: &str, why: &str, reader: &mut Reader<'_>) {
    let (Some((idle, _)), Some((other, _))) = (record.table.entry(key), record.table.entry(beside)) else { return };
    reader.diagnostics.push(
        Diagnostic::warning(codes::KEY_WITHOUT_EFFECT, format!("`{key}` has no effect beside `{beside}`"))
            .at(idle.span.clone(), why)
            .context(other.span.clone(), "the other one")
            .help(format!("leave `{key}` out, or `{beside}`")),
    );
}

/// Warns of the acceleration on earth in m/s^2 as plain numbers of a scene that measures in something else.
fn warn_of_gravity(record: &Record<'_>, gravity: [f64; 3], reader: &mut Reader<'_>) {
    let Some(raw) = record.table.get("gravity") else { return };
    let units = reader.scope.units;
    let plain = |raw: &RawValue| matches!(raw.kind, RawKind::Number(_) | RawKind::Integer(_));
    let size = gravity.iter().fold(0.0_f64, |sum, x| sum.hypot(*x));
    let written = units.from_si(size, Dimension::ACCELERATION);
    if ON_EARTH.contains(&size) || !raw.as_array().is_some_and(|items| items.iter().all(plain)) {
        return;
    }
    let others = ON_EARTH_OTHERWISE.iter().find(|(range, _)| range.contains(&written)).map(|(_, unit)| *unit);
    let Some(meant) = others.or(ON_EARTH.contains(&written).then_some("m/s^2")) else { return };
    let label = units.label(Dimension::ACCELERATION);
    reader.diagnostics.push(
        Diagnostic::warning(codes::OTHER_UNIT, format!("gravity is {written} {label} here"))
            .at(raw.span.clone(), format!("plain numbers are in {label}"))
            .help(format!("write the unit, as in `[0, 0, \"-{written} {meant}\"]`, if that of the earth is meant")),
    );
}

fn read_output_times(record: &Record<'_>, span: &std::ops::Range<f64>, reader: &mut Reader<'_>) -> Option<OutputTimes> {
    if reader.exclusive(record, "output_step", "output_times") {
        return None;
    }
    if let Some(raw) = record.table.get("output_times") {
        return read_times(raw, span, reader).map(OutputTimes::Times);
    }
    let Some(raw) = record.table.get("output_step") else {
        reader.diagnostics.push(
            Diagnostic::error(codes::MISSING_KEY, "`[simulation]` doesn't say when results are wanted")
                .at(record.table.span.clone(), "")
                .help("add `output_step`, or a list `output_times`"),
        );
        return None;
    };
    let step = reader.positive(record, "output_step", Dimension::TIME)?;
    let number = (span.end - span.start) / step;
    if span.end.is_finite() && number > MOST_SAMPLES {
        reader.out_of_range(
            format!("`output_step` asks for {number:.1e} samples, at most {MOST_SAMPLES:.0e} are possible"),
            raw.span.clone(),
            "",
        );
        return None;
    }
    if span.end > span.start && step > span.end - span.start {
        let message = "`output_step` is longer than the run";
        reader.diagnostics.push(
            Diagnostic::warning(codes::NO_LATER_SAMPLE, message)
                .at(raw.span.clone(), "results at the start only")
                .help("give a shorter step, or times: `output_times = [0.5, 1]`"),
        );
    }
    Some(OutputTimes::Step(step))
}

fn read_times(raw: &RawValue, span: &std::ops::Range<f64>, reader: &mut Reader<'_>) -> Option<Vec<f64>> {
    let items = reader.list(raw, "output_times", "a list of times")?;
    if items.is_empty() {
        reader.wrong_length(raw, "output_times", "at least one entry", 0);
    }
    let mut times: Vec<f64> = Vec::with_capacity(items.len());
    for item in items {
        let time = reader.quantity(item, Dimension::TIME)?;
        if time < span.start || time > span.end {
            reader.out_of_range("an output time is outside of the simulated time".to_owned(), item.span.clone(), "");
            return None;
        }
        if times.last().is_some_and(|last| *last >= time) {
            reader.out_of_range("output times must ascend".to_owned(), item.span.clone(), "not after the one before");
            return None;
        }
        times.push(time);
    }
    Some(times)
}
