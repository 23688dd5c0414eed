//! Files of elements: classes as data, `*.odyn-element`. Python writes them (`Rod.save("rod.odyn-element")`); they need no
//! compiler, are the same on every machine, and run no code of their author. They are found, hashed and pinned as libraries are.
//!
//! A file is TOML. For each element it has the [`Descriptor`] that a library would give, and a recording whose parameters are inputs:
//! one operation per line ([`equations`]), so that two versions of a file can be compared line by line. An instance puts its
//! numbers in the place of the parameters and then has the [`Recording`](element_api::Recording) that the same element in Rust has
//! ([`class`]).
//!
//! ```toml
//! odyn-element = 1          # version of this format
//! contract = "1.2.0"        # the `element-api` that its descriptions and meanings are those of
//! conventions = 1
//! package = "rod"
//! version = "0.1.0"
//! about = "a rod"
//!
//! [[element]]
//! [element.description]     # fields of `Descriptor`
//! name = "rod"
//! kind = "joint"
//! summary = "two points keep their distance along x"
//! frames = [{ name = "i" }, { name = "j" }]
//! rows = ["distance"]
//! [[element.description.params]]
//! name = "length"
//! kind = "number"
//! unit = "m"
//! doc = ""
//!
//! [element.recording]
//! equations = '''
//! v0 = position 1 0
//! v1 = position 0 0
//! v2 = sub v0 v1
//! v3 = param length
//! v4 = sub v2 v3
//! residual 0 = v4
//! '''
//! ```

mod class;
mod equations;

#[cfg(test)]
mod tests;

use std::fs;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use element_api::descriptor::{Descriptor, Kind};
use element_api::fence;
use element_api::manifest::{ABI, CONVENTIONS, EntryTable, INTERFACE, Manifest, ManifestElement, Profile};
use element_api::params::{ParamKind, ParamSpec};
use element_api::{Interpolation, Outside, Table};
use semver::Version;
use serde::Deserialize;
use toml::Spanned;

use self::class::DataClass;
use self::equations::Equations;
use super::c_library::check_element_name;
use super::declared::check_parameters;
use super::file::not_read;
use super::hash::sha256;
use super::loader::Opened;
use super::offer::Offer;
use super::package::is_package_name;
use super::search::ENDING;
use super::{CatalogError, LibraryInfo};

/// Version of the format.
const FORMAT: i64 = 1;
/// Bytes that a file may have.
const LARGEST: u64 = 64 << 20;
/// Elements that a file may have.
const MOST_ELEMENTS: usize = 1000;

/// Whether a file is one of elements, by its name.
pub(super) fn is_one(path: &Path) -> bool {
    path.to_str().is_some_and(|path| path.ends_with(ENDING))
}

/// The versions that a file is written for, whatever else is in it.
#[derive(Deserialize)]
struct Head {
    #[serde(rename = "odyn-element")]
    format: Spanned<i64>,
    contract: Spanned<String>,
    conventions: Spanned<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "odyn-element")]
    _format: i64,
    contract: String,
    conventions: u32,
    package: Spanned<String>,
    version: Spanned<String>,
    #[serde(default)]
    about: String,
    element: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    description: Spanned<Descriptor>,
    recording: Text,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    #[serde(default)]
    tables: Vec<Spanned<Points>>,
    equations: Spanned<String>,
}

/// A table that operations refer to, by its number.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Points {
    points: Vec<[f64; 2]>,
    #[serde(default)]
    interpolation: String,
    #[serde(default)]
    periodic: bool,
}

/// What is wrong with a file, and the byte where.
struct Mistake(Option<usize>, String);

impl From<toml::de::Error> for Mistake {
    fn from(error: toml::de::Error) -> Self {
        Self(error.span().map(|span| span.start), error.message().to_string())
    }
}

fn at(span: &Range<usize>, reason: impl Into<String>) -> Mistake {
    Mistake(Some(span.start), reason.into())
}

/// What a file says about itself, and its elements.
///
/// # Errors
/// [`CatalogError::BadElement`], with the line.
fn read(path: &Path, bytes: &[u8]) -> Result<(Manifest, Vec<DataClass>), CatalogError> {
    let bad = |line, reason| CatalogError::BadElement { path: path.into(), line, reason };
    if bytes.len() as u64 > LARGEST {
        return Err(bad(None, format!("it has {} bytes; at most {LARGEST} are read", bytes.len())));
    }
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        bad(Some(line), "it is not UTF-8 text".into())
    })?;
    parse(text).map_err(|Mistake(place, reason)| {
        let lines = |place| 1 + bytes.iter().take(place).filter(|byte| **byte == b'\n').count();
        bad(place.map(lines), reason)
    })
}

fn parse(text: &str) -> Result<(Manifest, Vec<DataClass>), Mistake> {
    let head: Head = toml::from_str(text)?;
    if *head.format.get_ref() != FORMAT {
        let reason = format!("its format is {}, this host reads format {FORMAT}", head.format.get_ref());
        return Err(at(&head.format.span(), reason));
    }
    let own = Version::parse(INTERFACE).map_err(|error| Mistake(None, error.to_string()))?;
    let contract = head.contract.get_ref();
    if !Version::parse(contract).is_ok_and(|c| c.major == own.major && c.minor <= own.minor) {
        let reason = format!("it is written for version {contract} of the contract, this host has version {own}");
        return Err(at(&head.contract.span(), reason));
    }
    if *head.conventions.get_ref() != CONVENTIONS {
        let found = head.conventions.get_ref();
        let reason = format!("it follows conventions number {found}, this host number {CONVENTIONS}");
        return Err(at(&head.conventions.span(), reason));
    }
    let file: File = toml::from_str(text)?;
    if !is_package_name(file.package.get_ref()) {
        let reason = format!("`{}` cannot be the name of a package", file.package.get_ref().escape_debug());
        return Err(at(&file.package.span(), reason));
    }
    if let Err(error) = Version::parse(file.version.get_ref()) {
        let reason = format!("its version `{}`: {error}", file.version.get_ref().escape_debug());
        return Err(at(&file.version.span(), reason));
    }
    if file.element.is_empty() || file.element.len() > MOST_ELEMENTS {
        let reason = format!("it has {} elements; 1 to {MOST_ELEMENTS} are accepted", file.element.len());
        return Err(Mistake(None, reason));
    }
    let mut classes: Vec<DataClass> = Vec::new();
    let mut elements: Vec<ManifestElement> = Vec::new();
    for entry in file.element {
        let span = entry.description.span();
        let descriptor = entry.description.into_inner();
        check(&descriptor).map_err(|reason| at(&span, reason))?;
        if elements.iter().any(|known| known.name == descriptor.name) {
            return Err(at(&span, format!("the element `{}` is described twice", descriptor.name)));
        }
        let tables = entry.recording.tables.iter().map(table).collect::<Result<_, _>>()?;
        let equations = entry.recording.equations;
        let read = Equations::parse(equations.get_ref(), &descriptor, tables)
            .map_err(|(line, reason)| line_in(text, &equations.span(), &descriptor.name, line, &reason))?;
        elements.push(ManifestElement { kind: descriptor.kind.word().into(), name: descriptor.name.clone() });
        classes.push(DataClass::new(descriptor, read));
    }
    let manifest = Manifest {
        package: file.package.into_inner(),
        version: file.version.into_inner(),
        about: file.about,
        abi: ABI,
        // There is no code, and nothing to be entered.
        table: EntryTable::Rust,
        conventions: file.conventions,
        interface: file.contract,
        entry: String::new(),
        features: Vec::new(),
        profile: Profile::Release,
        elements,
    };
    Ok((manifest, classes))
}

/// A mistake in a line of equations, counted from 0; the file has them as they are where they are in a literal text of several lines.
fn line_in(text: &str, span: &Range<usize>, element: &str, line: usize, reason: &str) -> Mistake {
    let raw = &text[span.clone()];
    let literal = ["'''\n", "'''\r\n"].iter().find(|opening| raw.starts_with(**opening));
    let place = literal.and_then(|opening| {
        let body = &raw[opening.len()..];
        let before: usize = body.split_inclusive('\n').take(line).map(str::len).sum();
        (before < body.len()).then_some(span.start + opening.len() + before)
    });
    let number = if place.is_none() { format!(", line {} of its equations", line + 1) } else { String::new() };
    Mistake(place.or(Some(span.start)), format!("element `{element}`{number}: {reason}"))
}

fn table(given: &Spanned<Points>) -> Result<Table, Mistake> {
    let (span, given) = (given.span(), given.get_ref());
    let known = || Interpolation::ALL.iter().find(|(name, _)| *name == given.interpolation).map(|(_, known)| *known);
    let interpolation = if given.interpolation.is_empty() { Some(Interpolation::default()) } else { known() };
    let Some(interpolation) = interpolation else {
        let names: Vec<&str> = Interpolation::ALL.iter().map(|(name, _)| *name).collect();
        return Err(at(&span, format!("`interpolation` of a table is one of {}", names.join(", "))));
    };
    let outside = if given.periodic { Outside::Periodic } else { Outside::Clamped };
    Table::through(&given.points, interpolation, outside)
        .map_err(|error| at(&span, format!("a table {}", error.message)))
}

/// What a description must not say of an element that is data.
fn check(d: &Descriptor) -> Result<(), String> {
    check_element_name(&d.name)?;
    d.check()?;
    let joint = d.kind == Kind::Joint;
    let rules = [
        (joint && d.frames.is_empty(), "is a joint without frames"),
        (d.opaque, "is opaque, and there is no code to call"),
        (d.more_frames.is_some(), "takes any number of frames, which only elements with code can"),
        (!joint && !d.rows.is_empty(), "has rows, but is no joint"),
        (!joint && !d.values.is_empty(), "has values, but is no joint: give channels"),
        (joint && !d.checks.is_empty(), "has checks, but is a joint"),
        (d.kind != Kind::Force && !d.joints.is_empty(), "takes reactions, but is no force"),
        (!joint && d.mobility.is_some(), "has a mobility, but is no joint"),
        (d.turns_freely && d.mobility.is_none(), "turns freely, but has no mobility"),
        (d.mobility.is_some() && d.frames.len() != 2, "has a mobility, which needs two frames"),
    ];
    if let Some((_, rule)) = rules.iter().find(|(broken, _)| *broken) {
        return Err(format!("`{}` {rule}", d.name));
    }
    let inside = |reason: String| format!("`{}`: {reason}", d.name);
    check_parameters(&d.params).map_err(inside)?;
    d.params.iter().try_for_each(|param| check_parameter(param).map_err(inside))
}

fn check_parameter(param: &ParamSpec) -> Result<(), String> {
    let name = param.name.escape_debug();
    // A text that is one of several is a choice between equations; others are no numbers.
    let choice = param.kind == ParamKind::Text && !param.choices.is_empty();
    if matches!(param.kind, ParamKind::Text | ParamKind::List | ParamKind::Curve) && !choice {
        return Err(format!("the parameter `{name}` is a {}, which equations cannot take", param.kind.text()));
    }
    if param.optional {
        return Err(format!("the parameter `{name}` may be missing: give it a default"));
    }
    match [param.min, param.max, param.above, param.below].into_iter().flatten().find(|bound| !bound.is_finite()) {
        Some(bound) => Err(format!("the parameter `{name}` has the bound {bound}")),
        None => Ok(()),
    }
}

/// What a file of elements says about itself.
///
/// # Errors
/// [`CatalogError::BadElement`].
pub(super) fn manifest(path: &Path, bytes: &[u8]) -> Result<Manifest, CatalogError> {
    read(path, bytes).map(|(manifest, _)| manifest)
}

/// The content of a file of elements.
///
/// # Errors
/// [`CatalogError::NotALibrary`], [`CatalogError::BadElement`].
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, CatalogError> {
    let size = fs::metadata(path).map_err(|error| not_read(path, &error))?.len();
    if size > LARGEST {
        let reason = format!("it has {size} bytes; at most {LARGEST} are read");
        return Err(CatalogError::BadElement { path: path.into(), line: None, reason });
    }
    fs::read(path).map_err(|error| not_read(path, &error))
}

/// The elements in a file; with `expected`, only of a file with this SHA-256. Nothing is run.
///
/// # Errors
/// [`CatalogError::NotALibrary`], [`CatalogError::BadElement`], [`CatalogError::Changed`].
pub(super) fn load(path: &Path, expected: Option<&str>) -> Result<Opened, CatalogError> {
    let bytes = bytes(path)?;
    let sha256 = sha256(&bytes);
    if let Some(expected) = expected.filter(|expected| *expected != sha256) {
        return Err(CatalogError::Changed { path: path.into(), found: sha256, expected: expected.into() });
    }
    let (manifest, classes) = read(path, &bytes)?;
    let offer = |class: DataClass| Arc::new(Offer::of(Arc::from(fence::class(Box::new(class)))));
    let info = LibraryInfo {
        package: manifest.package,
        version: manifest.version,
        about: manifest.about,
        path: Some(path.into()),
        sha256: Some(sha256),
        glass: false,
        abi: manifest.abi,
        conventions: manifest.conventions,
        interface: manifest.interface,
        profile: manifest.profile,
        features: manifest.features,
        elements: manifest.elements,
    };
    Ok(Opened { info, offers: classes.into_iter().map(offer).collect(), warnings: Vec::new() })
}
