//! Orientation of a body: six ways to write it, one result.
//!
//! Euler parameters (e0, e) of the rotation by an angle a about the unit vector u are e0 = cos(a/2),
//! e = u sin(a/2). They turn body axes into ground axes by the matrix (Haug 1989, section 9.3)
//! ```text
//! A = (2 e0^2 - 1) I + 2 e e^T + 2 e0 [e]x        [e]x y = e x y
//! ```
//! whose columns are the body's axes in ground.

use super::dimension::Dimension;
use super::raw::{RawKind, RawValue};
use super::reader::{Reader, Record, normalised};
use odyn_diagnostics::{Diagnostic, codes};

/// Euler parameters of the identity.
pub(super) const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// Deviation from a rotation that is more than rounding of what was written.
const ROUNDING: f64 = 1e-6;
/// Deviation from a rotation that cannot be meant as one.
const NOT_MEANT: f64 = 1e-3;

/// The keys of each way, those of one way together.
pub(super) const WAYS: [&[&str]; 6] =
    [&["axis", "angle"], &["euler_parameters"], &["x", "y"], &["rotation_vector"], &["euler_zyx"], &["matrix"]];

/// Reads `orientation`; `None` if it is wrong, which has been reported.
pub(super) fn read(raw: &RawValue, what: &str, reader: &mut Reader<'_>) -> Option<[f64; 4]> {
    let Some(table) = raw.as_table() else {
        reader.wrong_type("orientation", "a table such as `{ axis = [0, 0, 1], angle = \"30 deg\" }`", raw);
        return None;
    };
    let record = Record { table, what: format!("the orientation of {what}") };
    let way = choose_way(&record, raw, reader)?;
    for key in way {
        if table.get(key).is_none() {
            reader.diagnostics.push(
                Diagnostic::error(codes::CONFLICTING_KEYS, format!("{} has no `{key}`", record.what))
                    .at(raw.span.clone(), format!("`{key}` is missing here")),
            );
        }
    }
    let first = table.get(way[0])?;
    match way[0] {
        "axis" => {
            let angle = table.get("angle")?;
            let axis = reader.direction(first, "axis");
            warn_of_degrees(angle, reader);
            let angle = reader.quantity(angle, Dimension::ANGLE);
            Some(about(axis?, angle?))
        }
        "euler_parameters" => euler_parameters(first, reader),
        "x" => {
            let second = table.get("y")?;
            let x = reader.direction(first, "x");
            let y = reader.direction(second, "y");
            axes(x?, y?, second, reader)
        }
        "rotation_vector" => {
            warn_of_degrees(first, reader);
            let vector = reader.quantities(first, "rotation_vector", Dimension::ANGLE)?;
            let angle = vector.iter().fold(0.0_f64, |sum, x| sum.hypot(*x));
            Some(normalised(vector).map_or(IDENTITY, |axis| about(axis, angle)))
        }
        "euler_zyx" => {
            warn_of_degrees(first, reader);
            let [z, y, x]: [f64; 3] = reader.quantities(first, "euler_zyx", Dimension::ANGLE)?;
            let about_z = about([0.0, 0.0, 1.0], z);
            let about_y = about([0.0, 1.0, 0.0], y);
            let about_x = about([1.0, 0.0, 0.0], x);
            Some(product(product(about_z, about_y), about_x))
        }
        _ => matrix(first, reader),
    }
}

/// Warns of plain numbers that would be more than a turn: nobody writes these, but whoever means degrees.
fn warn_of_degrees(raw: &RawValue, reader: &mut Reader<'_>) {
    let number = |raw: &RawValue| match raw.kind {
        RawKind::Number(value) => Some(value),
        RawKind::Integer(value) => Some(value as f64),
        // `"30"` is as plain.
        RawKind::Text(ref text) => text.trim().parse().ok(),
        _ => None,
    };
    let turn = reader.scope.units.from_si(std::f64::consts::TAU, Dimension::ANGLE);
    let items = raw.as_array().unwrap_or(std::slice::from_ref(raw));
    // Digits are left out where a turn is written.
    let far = items.iter().find_map(|item| Some((item, number(item).filter(|value| value.abs() > 1.001 * turn)?)));
    let Some((item, value)) = far else { return };
    let label = reader.scope.units.label(Dimension::ANGLE);
    let help = if label == "rad" {
        format!("write `\"{value} deg\"` if degrees are meant, or `angle = \"deg\"` in [units] for all of the scene")
    } else {
        format!("leave whole turns of {turn} {label} out, or write the unit that is meant")
    };
    reader.diagnostics.push(
        Diagnostic::warning(codes::OTHER_UNIT, format!("an orientation of {value} {label} is more than a turn"))
            .at(item.span.clone(), format!("plain numbers are in {label}"))
            .help(help),
    );
}

/// The way that the keys of the table belong to.
fn choose_way(record: &Record<'_>, raw: &RawValue, reader: &mut Reader<'_>) -> Option<&'static [&'static str]> {
    let known: Vec<&str> = WAYS.iter().flat_map(|way| way.iter().copied()).collect();
    reader.check_keys(record, &known);
    let found: Vec<&'static [&'static str]> =
        WAYS.into_iter().filter(|way| way.iter().any(|key| record.table.get(key).is_some())).collect();
    match found.as_slice() {
        [way] => Some(way),
        [] => {
            if record.table.is_empty() {
                reader.diagnostics.push(
                    Diagnostic::error(codes::MISSING_KEY, format!("{} is empty", record.what))
                        .at(raw.span.clone(), "")
                        .help("write `{ axis = [0, 0, 1], angle = \"30 deg\" }`, or leave it out"),
                );
            }
            None
        }
        [first, second, ..] => {
            let key = |way: &[&'static str]| -> &'static str {
                let present = way.iter().find(|key| record.table.get(key).is_some());
                present.copied().unwrap_or(way[0])
            };
            reader.exclusive(record, key(first), key(second));
            None
        }
    }
}

fn euler_parameters(raw: &RawValue, reader: &mut Reader<'_>) -> Option<[f64; 4]> {
    let written: [f64; 4] = reader.quantities(raw, "euler_parameters", Dimension::DIMENSIONLESS)?;
    let Some(unit) = normalised(written) else {
        reader.diagnostics.push(
            Diagnostic::error(codes::NOT_A_ROTATION, "Euler parameters that are all zero describe no rotation")
                .at(raw.span.clone(), ""),
        );
        return None;
    };
    let length = written.iter().fold(0.0_f64, |sum, x| sum.hypot(*x));
    if (length - 1.0).abs() > ROUNDING {
        warn_normalised(raw, format!("their length is {length:.9}, not 1"), reader);
    }
    Some(unit)
}

/// Body x axis, and a direction in the plane of its x and y axes on the side of y.
fn axes(x: [f64; 3], y: [f64; 3], raw: &RawValue, reader: &mut Reader<'_>) -> Option<[f64; 4]> {
    let z = cross(x, y);
    if norm(z) < ROUNDING {
        reader.diagnostics.push(parallel("y", "x", raw));
        return None;
    }
    let z = normalised(z)?;
    let y = cross(z, x);
    Some(from_columns([x, y, z]))
}

fn matrix(raw: &RawValue, reader: &mut Reader<'_>) -> Option<[f64; 4]> {
    let rows = reader.entries::<3>(raw, "matrix")?;
    let mut a = [[0.0; 3]; 3];
    let mut complete = true;
    for (row, written) in a.iter_mut().zip(rows) {
        match reader.quantities(written, "matrix", Dimension::DIMENSIONLESS) {
            Some(values) => *row = values,
            None => complete = false,
        }
    }
    if !complete {
        return None;
    }
    let columns = [0, 1, 2].map(|j| [a[0][j], a[1][j], a[2][j]]);
    // A^T A = I and det A = +1 make a rotation.
    let mut deviation = (dot(columns[0], cross(columns[1], columns[2])) - 1.0).abs();
    for i in 0..3 {
        for j in 0..3 {
            let expected = if i == j { 1.0 } else { 0.0 };
            deviation = deviation.max((dot(columns[i], columns[j]) - expected).abs());
        }
    }
    if deviation.is_nan() || deviation > NOT_MEANT {
        reader.diagnostics.push(
            Diagnostic::error(codes::NOT_A_ROTATION, "this matrix is not a rotation")
                .at(raw.span.clone(), format!("deviates from a right-handed orthonormal matrix by {deviation:.1e}"))
                .help("its columns are the body's axes in ground; it is written row by row"),
        );
        return None;
    }
    if deviation > ROUNDING {
        warn_normalised(raw, format!("it deviates from a rotation by {deviation:.1e}"), reader);
    }
    Some(from_columns(columns))
}

fn warn_normalised(raw: &RawValue, label: String, reader: &mut Reader<'_>) {
    reader.diagnostics.push(
        Diagnostic::warning(codes::NORMALISED, "this orientation is normalised")
            .at(raw.span.clone(), label)
            .help("give more digits, or use `axis` and `angle`"),
    );
}

/// The error of a second direction that is parallel to the first one.
pub(super) fn parallel(second: &str, first: &str, raw: &RawValue) -> Diagnostic {
    Diagnostic::error(codes::NO_DIRECTION, format!("`{second}` is parallel to `{first}`")).at(raw.span.clone(), "")
}

/// True if two unit vectors span no plane.
pub(super) fn are_parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    norm(cross(a, b)) < ROUNDING
}

/// A rotation by an angle (rad) about a unit vector.
fn about(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let (sin, cos) = (angle / 2.0).sin_cos();
    [cos, axis[0] * sin, axis[1] * sin, axis[2] * sin]
}

/// The rotation `b` followed by `a`, both about ground axes: A = A_a A_b.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Euler parameters of the matrix with these columns (Shepperd 1978: start from the largest of the four, so
/// that nothing is divided by a small number), with e0 >= 0.
fn from_columns(columns: [[f64; 3]; 3]) -> [f64; 4] {
    let a = |i: usize, j: usize| columns[j][i];
    let trace = a(0, 0) + a(1, 1) + a(2, 2);
    // 4 e0^2 = 1 + trace and 4 e_i^2 = 1 + 2 a_ii - trace.
    let squares = [1.0 + trace, 1.0 + 2.0 * a(0, 0) - trace, 1.0 + 2.0 * a(1, 1) - trace, 1.0 + 2.0 * a(2, 2) - trace];
    let mut largest = 0;
    for i in 1..4 {
        if squares[i] > squares[largest] {
            largest = i;
        }
    }
    // 4 e0 e = vector of A - A^T; 4 e_i e_j = a_ij + a_ji. One row of the symmetric table below is
    // 4 e_largest times (e0, e1, e2, e3).
    let e01 = a(2, 1) - a(1, 2);
    let e02 = a(0, 2) - a(2, 0);
    let e03 = a(1, 0) - a(0, 1);
    let e12 = a(0, 1) + a(1, 0);
    let e23 = a(1, 2) + a(2, 1);
    let e31 = a(2, 0) + a(0, 2);
    let row = match largest {
        0 => [squares[0], e01, e02, e03],
        1 => [e01, squares[1], e12, e31],
        2 => [e02, e12, squares[2], e23],
        _ => [e03, e31, e23, squares[3]],
    };
    let unit = normalised(row).unwrap_or(IDENTITY);
    if unit[0] < 0.0 {
        return unit.map(|e| -e);
    }
    unit
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
