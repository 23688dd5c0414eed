//! `[[body]]`.

use super::dimension::Dimension;
use super::raw::{RawKind, RawTable, RawValue, Spanned};
use super::reader::{NamesTaken, Reader, Record};
use super::record::BodyRecord;
use super::{rotation, shapes};
use odyn_diagnostics::{Diagnostic, codes};

/// The name of the ground, which no body may have.
pub const GROUND: &str = "ground";

pub(super) const KEYS: &[&str] = &[
    "name",
    "mass",
    "inertia",
    "com",
    "position",
    "orientation",
    "velocity",
    "angular_velocity",
    "fixed",
    "particle",
    "point_masses",
    "shape",
];

/// A point mass on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMass {
    /// Mass, kg. Not checked here.
    pub mass: Spanned<f64>,
    /// Position in the body frame, m.
    pub position: [f64; 3],
}

/// Keys that a particle has not.
const OF_RIGID_BODIES: [&str; 5] = ["inertia", "com", "orientation", "angular_velocity", "point_masses"];

/// Keys of an inertia table in the order of the list.
const INERTIA_KEYS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "zx"];

/// Reads all bodies; one with an unusable name is left out, which has been reported.
pub(super) fn read(root: &RawTable, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Vec<BodyRecord> {
    let mut bodies = Vec::new();
    for record in reader.records(root, "body") {
        bodies.extend(read_body(&record, names, reader));
    }
    bodies.shrink_to_fit();
    bodies
}

fn read_body(record: &Record<'_>, names: &mut NamesTaken, reader: &mut Reader<'_>) -> Option<BodyRecord> {
    reader.check_keys(record, KEYS);
    let name = reader.name(record, "");
    if let Some(name) = &name {
        check_not_ground(name, reader);
        names.take(name, &mut reader.diagnostics);
    }
    let fixed = reader.flag(record, "fixed", false);
    let particle = reader.flag(record, "particle", false);
    let without = [
        ("mass", "a body that does not move needs none: `fixed = true`"),
        ("inertia", "a body that does not move needs none: `fixed = true`; nor does a point mass: `particle = true`"),
    ];
    for (key, help) in without {
        if !fixed && record.table.get(key).is_none() && !(particle && key == "inertia") {
            reader.missing_with(record, key, Some(help));
        }
    }
    for key in OF_RIGID_BODIES.iter().filter(|_| particle) {
        reader.exclusive(record, key, "particle");
    }
    let mass = reader.optional(record, "mass", Dimension::MASS);
    let inertia = record.table.get("inertia").and_then(|raw| read_inertia(raw, &record.what, reader));
    let point_masses = read_point_masses(record, reader);
    let shapes = shapes::read(record, reader);
    let com = reader.vector_or_zero(record, "com", Dimension::LENGTH);
    let position = reader.vector_or_zero(record, "position", Dimension::LENGTH);
    let orientation = match record.table.get("orientation") {
        Some(raw) => rotation::read(raw, &record.what, reader),
        None => Some(rotation::IDENTITY),
    };
    let velocity = read_motion(record, "velocity", Dimension::VELOCITY, reader);
    let angular_velocity = read_motion(record, "angular_velocity", Dimension::ANGULAR_VELOCITY, reader);
    for (key, motion) in [("velocity", &velocity), ("angular_velocity", &angular_velocity)] {
        if fixed && motion.value.iter().flatten().any(|rate| *rate != 0.0) {
            reader.exclusive(record, key, "fixed");
        }
    }
    Some(BodyRecord {
        name: name?,
        span: record.table.span.clone(),
        mass,
        inertia,
        com,
        position,
        orientation: orientation?,
        velocity,
        angular_velocity,
        fixed,
        particle,
        point_masses,
        shapes,
    })
}

fn read_point_masses(record: &Record<'_>, reader: &mut Reader<'_>) -> Vec<PointMass> {
    let Some(raw) = record.table.get("point_masses") else { return Vec::new() };
    let form = "a list of tables such as `{ mass = 5, position = [1, 0, 0] }`";
    let Some(items) = reader.list(raw, "point_masses", form) else { return Vec::new() };
    let mut masses = Vec::new();
    for (index, item) in items.iter().enumerate() {
        let Some(table) = item.as_table() else {
            reader.wrong_type("point_masses", form, item);
            continue;
        };
        let point = Record { table, what: format!("point mass {} of {}", index + 1, record.what) };
        reader.check_keys(&point, &["mass", "position"]);
        if table.get("mass").is_none() {
            reader.missing(&point, "mass");
        }
        let position = reader.vector_or_zero(&point, "position", Dimension::LENGTH);
        let mass = reader.optional(&point, "mass", Dimension::MASS);
        masses.extend(mass.map(|mass| PointMass { mass, position }));
    }
    masses
}

/// Reports a body or element that is called like the ground.
pub(super) fn check_not_ground(name: &Spanned<String>, reader: &mut Reader<'_>) {
    if name.value != GROUND {
        return;
    }
    reader.diagnostics.push(
        Diagnostic::error(codes::BAD_NAME, "`ground` is the name of the ground")
            .at(name.span.clone(), "")
            .help("the ground needs no `[[body]]`; refer to it as \"ground\""),
    );
}

/// Three principal moments, six entries of the tensor, or a table of entries.
fn read_inertia(raw: &RawValue, what: &str, reader: &mut Reader<'_>) -> Option<Spanned<[f64; 6]>> {
    let values = match &raw.kind {
        RawKind::Array(items) if items.len() == 3 => {
            let [xx, yy, zz]: [f64; 3] = reader.quantities(raw, "inertia", Dimension::INERTIA)?;
            [xx, yy, zz, 0.0, 0.0, 0.0]
        }
        RawKind::Array(items) if items.len() == 6 => reader.quantities(raw, "inertia", Dimension::INERTIA)?,
        RawKind::Array(items) => {
            let needs = "3 entries (principal moments) or 6 (xx, yy, zz, xy, yz, zx)";
            reader.wrong_length(raw, "inertia", needs, items.len());
            return None;
        }
        RawKind::Table(table) => read_inertia_table(table, what, reader)?,
        _ => {
            reader.wrong_type("inertia", "a list of 3 or 6", raw);
            return None;
        }
    };
    Some(Spanned::new(values, raw.span.clone()))
}

fn read_inertia_table(table: &RawTable, what: &str, reader: &mut Reader<'_>) -> Option<[f64; 6]> {
    let record = Record { table, what: format!("the inertia of {what}") };
    reader.check_keys(&record, &INERTIA_KEYS);
    let mut values = [0.0; 6];
    let mut complete = true;
    for (index, key) in INERTIA_KEYS.iter().enumerate() {
        match table.get(key) {
            Some(raw) => match reader.quantity(raw, Dimension::INERTIA) {
                Some(value) => values[index] = value,
                None => complete = false,
            },
            None if index < 3 => {
                reader.missing(&record, key);
                complete = false;
            }
            None => {}
        }
    }
    complete.then_some(values)
}

/// A velocity at the start: given components are prescribed, `"free"` and absent ones are found by assembly.
fn read_motion(
    record: &Record<'_>,
    key: &str,
    dimension: Dimension,
    reader: &mut Reader<'_>,
) -> Spanned<[Option<f64>; 3]> {
    let Some(raw) = record.table.get(key) else {
        return Spanned::new([None; 3], record.table.span.clone());
    };
    let mut values = [None; 3];
    if let Some(items) = reader.entries::<3>(raw, key) {
        for (value, item) in values.iter_mut().zip(items) {
            if item.as_text() != Some("free") {
                *value = reader.quantity(item, dimension);
            }
        }
    }
    Spanned::new(values, raw.span.clone())
}
