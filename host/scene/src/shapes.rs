//! `[[body.shape]]`: what a body looks like. Shapes have no influence on any motion.

use std::ops::Range;
use std::path::PathBuf;

use super::dimension::Dimension;
use super::elements::read_frame;
use super::raw::Spanned;
use super::reader::{Reader, Record};
use super::record::Placement;
use super::rotation::{are_parallel, parallel};
use super::units::parse_unit;
use odyn_diagnostics::{Diagnostic, codes, help_for};

/// Keys of a shape.
pub(super) const KEYS: &[&str] =
    &["kind", "size", "radius", "length", "file", "unit", "point", "axis", "x_axis", "frame", "color"];

/// The words for `kind`, each with the keys that it needs and those that it may have.
pub(super) const KINDS: [(&str, &[&str], &[&str]); 5] = [
    ("box", &["size"], &[]),
    ("cylinder", &["radius", "length"], &[]),
    ("sphere", &["radius"], &[]),
    ("capsule", &["radius", "length"], &[]),
    ("mesh", &["file"], &["unit"]),
];

/// Keys that only some kinds of shapes have.
const OF_KINDS: [&str; 5] = ["size", "radius", "length", "file", "unit"];

/// A shape of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeRecord {
    /// What it is.
    pub kind: ShapeKind,
    /// Where its own frame is, as of an element with one frame; the span is that of the decisive key, or of the table.
    pub placement: Spanned<Placement>,
    /// Red, green, blue, 0 to 255; chosen by whoever draws it where absent.
    pub color: Option<[u8; 3]>,
    /// Byte range of the table.
    pub span: Range<usize>,
}

/// What a shape is, in its own frame, m.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeKind {
    /// Edges along its x, y and z axes; the origin is in its middle.
    Box {
        /// Lengths of the edges, positive.
        size: [f64; 3],
    },
    /// About its z axis; the origin is in its middle.
    Cylinder {
        /// Positive.
        radius: f64,
        /// Positive.
        length: f64,
    },
    /// About its origin.
    Sphere {
        /// Positive.
        radius: f64,
    },
    /// A cylinder about its z axis with half spheres at both ends; the origin is in its middle.
    Capsule {
        /// Positive.
        radius: f64,
        /// Of the cylinder, without the half spheres; positive.
        length: f64,
    },
    /// Triangles of a file. Not read here.
    Mesh {
        /// The file, relative to the scene's folder.
        file: Spanned<PathBuf>,
        /// One of its numbers, m.
        unit: f64,
    },
}

/// Reads the shapes of a body.
pub(super) fn read(body: &Record<'_>, reader: &mut Reader<'_>) -> Vec<ShapeRecord> {
    let mut shapes = Vec::new();
    for (index, shape) in reader.records(body.table, "shape").into_iter().enumerate() {
        let record = Record { what: format!("shape {} of {}", index + 1, body.what), ..shape };
        shapes.extend(read_shape(&record, reader));
    }
    shapes
}

fn read_shape(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<ShapeRecord> {
    reader.check_keys(record, KEYS);
    let word = reader.required_word(record, "kind");
    let size = read_size(record, reader);
    let radius = reader.positive(record, "radius", Dimension::LENGTH);
    let length = reader.positive(record, "length", Dimension::LENGTH);
    let file = reader.word(record, "file").map(|file| Spanned::new(PathBuf::from(file.value), file.span));
    let unit = read_unit(record, reader);
    let placement = read_placement(record, reader);
    let color = read_color(record, reader);
    let word = word?;
    let Some((name, needed, possible)) = KINDS.into_iter().find(|(name, ..)| *name == word.value) else {
        let known = KINDS.map(|(name, ..)| name);
        reader.diagnostics.push(
            Diagnostic::error(codes::UNKNOWN_WORD, format!("`kind` cannot be `{}`", word.value))
                .at(word.span, "")
                .help_if(help_for(&word.value, &known, "kinds of shapes")),
        );
        return None;
    };
    for key in needed.iter().filter(|key| record.table.get(key).is_none()) {
        reader.missing(record, key);
    }
    for key in OF_KINDS.iter().filter(|key| !needed.contains(key) && !possible.contains(key)) {
        if let Some((found, _)) = record.table.entry(key) {
            reader.diagnostics.push(
                Diagnostic::error(codes::CONFLICTING_KEYS, format!("a {name} has no `{key}`"))
                    .at(found.span.clone(), "")
                    .context(word.span.clone(), "the kind of this shape")
                    .help(format!("a {name} has {}", listed(needed, possible))),
            );
        }
    }
    let kind = match name {
        "box" => ShapeKind::Box { size: size? },
        "cylinder" => ShapeKind::Cylinder { radius: radius?, length: length? },
        "sphere" => ShapeKind::Sphere { radius: radius? },
        "capsule" => ShapeKind::Capsule { radius: radius?, length: length? },
        _ => ShapeKind::Mesh { file: file?, unit: unit? },
    };
    Some(ShapeRecord { kind, placement, color, span: record.table.span.clone() })
}

/// `radius` and `length`; `file` and, if wanted, `unit`.
fn listed(needed: &[&str], possible: &[&str]) -> String {
    let quoted = |keys: &[&str]| keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(" and ");
    match possible {
        [] => quoted(needed),
        _ => format!("{} and, if wanted, {}", quoted(needed), quoted(possible)),
    }
}

/// Three lengths above zero.
fn read_size(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<[f64; 3]> {
    let raw = record.table.get("size")?;
    let size = reader.quantities(raw, "size", Dimension::LENGTH)?;
    if size.iter().all(|edge| *edge > 0.0) {
        return Some(size);
    }
    reader.out_of_range("every entry of `size` must be above zero".to_owned(), raw.span.clone(), "");
    None
}

/// The unit of the numbers of a file, m.
fn read_unit(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<f64> {
    if record.table.get("unit").is_none() {
        return Some(1.0);
    }
    let word = reader.word(record, "unit")?;
    let diagnostic = match parse_unit(&word.value) {
        Ok((Dimension::LENGTH, factor)) => return Some(factor),
        Ok((other, _)) => {
            Diagnostic::error(codes::DIMENSION, format!("expected a unit of length, found that of {other}"))
                .help("write what one of the numbers of the file is, for example \"mm\"")
        }
        Err(error) => Diagnostic::error(error.code, error.message).help_if(error.help),
    };
    reader.diagnostics.push(diagnostic.at(word.span, ""));
    None
}

/// As the frames of elements are read: in ground at the start, or in the frame of the body.
fn read_placement(record: &Record<'_>, reader: &mut Reader<'_>) -> Spanned<Placement> {
    let point = record.table.get("point").and_then(|raw| reader.quantities(raw, "point", Dimension::LENGTH));
    let axis = record.table.get("axis").and_then(|raw| reader.direction(raw, "axis"));
    let x_axis = record.table.get("x_axis").and_then(|raw| reader.direction(raw, "x_axis"));
    if let (Some(z), Some(x), Some(raw)) = (axis, x_axis, record.table.get("x_axis"))
        && are_parallel(z, x)
    {
        reader.diagnostics.push(parallel("x_axis", "axis", raw));
    }
    let first = ["point", "axis", "x_axis"].into_iter().find_map(|key| record.table.get(key));
    if let Some(raw) = record.table.get("frame") {
        for key in ["point", "axis", "x_axis"] {
            reader.exclusive(record, key, "frame");
        }
        let what = format!("the frame of {}", record.what);
        let frame = read_frame(raw, what, ("frame", "a table such as `{ position = [0, 0, 1] }`"), reader);
        return Spanned::new(Placement::Local(frame.into_iter().collect()), raw.span.clone());
    }
    let Some(first) = first else { return Spanned::new(Placement::Absent, record.table.span.clone()) };
    let list = |vector: Option<[f64; 3]>| vector.into_iter().collect();
    Spanned::new(Placement::Global { points: list(point), axes: list(axis), x_axes: list(x_axis) }, first.span.clone())
}

/// `#rrggbb`.
fn read_color(record: &Record<'_>, reader: &mut Reader<'_>) -> Option<[u8; 3]> {
    let word = reader.word(record, "color")?;
    let digits = word.value.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
    let part = |k: usize| u8::from_str_radix(digits?.get(k..k + 2)?, 16).ok();
    if let (Some(red), Some(green), Some(blue)) = (part(0), part(2), part(4)) {
        return Some([red, green, blue]);
    }
    reader.diagnostics.push(
        Diagnostic::error(codes::UNKNOWN_WORD, format!("`{}` is no colour", word.value))
            .at(word.span, "")
            .help("write red, green and blue with two hexadecimal digits each, for example \"#c0392b\""),
    );
    None
}
