//! `odyn elements`

use std::fmt::Write;

use element_api::descriptor::{Descriptor, Kind, Named, NamedInput};
use element_api::documentation::manual_page;
use element_api::manifest::ManifestElement;
use element_api::params::{ParamKind, ParamSpec};
use serde::Serialize;

use odyn::catalog::{Catalog, CatalogError, ElementHandle, SearchPath};
use odyn::diagnostics::{Diagnostic, codes, suggest};
use odyn::model::Catalogue;

use super::args::{DescribeArgs, PlacesArgs};
use super::exit;
use super::failure::Failure;
use super::terminal;

/// A library in a list.
struct Listed<'a> {
    package: &'a str,
    version: &'a str,
    about: &'a str,
    elements: &'a [ManifestElement],
}

/// Lists all element types by what the libraries say about themselves; nothing is run.
pub(super) fn list(args: &PlacesArgs) -> Result<u8, Failure> {
    let found = SearchPath::standard(&args.plugins, &[]).packages();
    // Part of the program, like a library.
    let fmus = Catalog::new().with_fmus();
    let own = fmus.libraries().map(|one| Listed {
        package: &one.package,
        version: &one.version,
        about: &one.about,
        elements: &one.elements,
    });
    let named = found.iter().map(|(_, one)| Listed {
        package: &one.package,
        version: &one.version,
        about: &one.about,
        elements: &one.elements,
    });
    let libraries: Vec<Listed<'_>> = named.chain(own).collect();
    if args.json {
        #[derive(Serialize)]
        struct Element<'a> {
            name: String,
            kind: &'a str,
            library: &'a str,
            version: &'a str,
        }
        let all = libraries.iter().flat_map(|library| {
            library.elements.iter().map(|element| Element {
                name: format!("{}/{}", library.package, element.name),
                kind: &element.kind,
                library: library.package,
                version: library.version,
            })
        });
        terminal::print_as_it_is(&terminal::json(&all.collect::<Vec<_>>()))?;
        return Ok(exit::DONE);
    }
    let mut text = String::new();
    for manifest in &libraries {
        text.push_str(&format!("{} {}: {}\n", manifest.package, manifest.version, manifest.about));
        let width = manifest.elements.iter().map(|element| element.name.len()).max().unwrap_or(0);
        for element in manifest.elements {
            text.push_str(&format!("  {:width$}  {}\n", element.name, element.kind));
        }
    }
    if found.is_empty() {
        eprintln!("{}", nothing_found());
    }
    terminal::print(&text)?;
    Ok(exit::DONE)
}

/// `odyn elements NAME`, which is as clear as `odyn elements describe NAME`.
pub(super) fn by_name(words: &[String]) -> Result<u8, Failure> {
    if let [name] = words {
        let places = PlacesArgs { plugins: Vec::new(), json: false };
        return describe(&DescribeArgs { name: name.clone(), places });
    }
    let message = format!("`odyn elements` does not know `{}`", words.join(" "));
    let help = "write `odyn elements list`, or `odyn elements describe NAME` with options behind it";
    Err(Failure::new(Diagnostic::error(codes::UNKNOWN_WORD, message).help(help)).exit(exit::USAGE))
}

/// Shows one element type. The libraries that provide it are opened.
pub(super) fn describe(args: &DescribeArgs) -> Result<u8, Failure> {
    let search = SearchPath::standard(&args.places.plugins, &[]);
    let libraries = search.packages();
    let (package, short) = match args.name.split_once('/') {
        Some((package, short)) => (Some(package), short),
        None => (None, args.name.as_str()),
    };
    let mut catalog = Catalog::new().with_fmus();
    for (path, manifest) in &libraries {
        let named = package.is_none_or(|package| package == manifest.package);
        if named && manifest.elements.iter().any(|element| element.name == short) {
            catalog.add(&path.display().to_string(), &search)?;
        }
    }
    if catalog.libraries().nth(1).is_none() && catalog.find(&args.name, None).is_err() {
        let known: Vec<String> =
            libraries.iter().flat_map(|(_, m)| m.elements.iter().map(|e| e.name.clone())).collect();
        let nearest = suggest(short, known.iter().map(String::as_str));
        return Err(CatalogError::UnknownType { name: args.name.clone(), nearest, provided_by: None, known }.into());
    }
    let element = catalog.find(&args.name, None)?;
    let text = if args.places.json { description_json(&element) } else { description(&element) };
    terminal::print(&text)?;
    Ok(exit::DONE)
}

pub(super) fn nothing_found() -> &'static str {
    "no library of elements was found; install one with `odyn plugin add FILE`, name a folder with `--plugin`, or build the standard libraries with `cargo build`"
}

pub(super) fn description_json(element: &ElementHandle) -> String {
    #[derive(Serialize)]
    struct Described<'a> {
        name: String,
        library: &'a str,
        version: &'a str,
        #[serde(flatten)]
        descriptor: Flat<'a>,
    }
    /// The descriptor without its short name.
    #[derive(Serialize)]
    struct Flat<'a> {
        kind: &'a str,
        summary: &'a str,
        doc: String,
        opaque: bool,
        angles: usize,
        mobility: Option<usize>,
        turns_freely: bool,
        frames: &'a [Named],
        rows: &'a [String],
        inputs: &'a [NamedInput],
        joints: &'a [Named],
        channels: &'a [Named],
        states: &'a [Named],
        params: &'a [ParamSpec],
        #[serde(skip_serializing_if = "<[_]>::is_empty")]
        checks: &'a [Named],
        #[serde(skip_serializing_if = "str::is_empty")]
        catalog: &'a str,
        #[serde(skip_serializing_if = "str::is_empty")]
        report: &'a str,
    }
    let Descriptor { kind, summary, opaque, frames, rows, inputs, joints, channels, states, params, .. } =
        element.descriptor();
    let Descriptor { angles, mobility, turns_freely, checks, catalog, report, .. } = element.descriptor();
    let descriptor = Flat {
        kind: kind.word(),
        summary,
        doc: manual_page(&element.descriptor().doc),
        opaque: *opaque,
        angles: *angles,
        mobility: *mobility,
        turns_freely: *turns_freely,
        frames,
        rows,
        inputs,
        joints,
        channels,
        states,
        params,
        checks,
        catalog,
        report,
    };
    let (library, version) = (&element.library.package, &element.library.version);
    terminal::json(&Described { name: element.full_name(), library, version, descriptor })
}

/// What an author of scenes needs to know about an element type: its manual page, then what follows from its definition.
pub(super) fn description(element: &ElementHandle) -> String {
    let descriptor = element.descriptor();
    let mut text = format!(
        "{} ({}, {} {})\n  {}\n",
        element.full_name(),
        descriptor.kind.word(),
        element.library.package,
        element.library.version,
        descriptor.summary
    );
    let page = manual_page(&descriptor.doc);
    if !page.is_empty() {
        text.push_str(&format!("\n{page}\n\n"));
    }
    let channels = match descriptor.kind {
        Kind::Joint => "joint coordinates",
        Kind::Force => "channels",
        Kind::Control => "gives",
    };
    section(&mut text, "frames, one body each", descriptor.frames.iter().map(named));
    let further = format!("further frames, up to {} in all", descriptor.most_frames);
    section(&mut text, &further, descriptor.more_frames.iter().map(named));
    section(&mut text, "constraint rows", descriptor.rows.iter().map(|row| (row.clone(), String::new())));
    section(&mut text, "inputs", descriptor.inputs.iter().map(input));
    section(&mut text, "joints whose reactions it takes", descriptor.joints.iter().map(named));
    section(&mut text, channels, descriptor.channels.iter().map(named));
    section(&mut text, "channels", descriptor.values.iter().map(named));
    section(&mut text, "states", descriptor.states.iter().map(named));
    section(&mut text, "parameters", descriptor.params.iter().map(parameter));
    section(&mut text, "checks", descriptor.checks.iter().map(named));
    text.push_str(&catalogue(&descriptor.catalog));
    if !descriptor.report.is_empty() {
        text.push_str(&format!("in reports:\n  {}\n", descriptor.report.replace('\n', "\n  ")));
    }
    if let Some(mobility) = descriptor.mobility {
        let free = if descriptor.turns_freely { ", and turns freely" } else { "" };
        text.push_str(&format!("joint coordinates of its own: {mobility}{free}\n"));
    }
    if descriptor.opaque {
        text.push_str("called at run time: its equations are not compiled into the scene's\n");
    }
    text
}

/// The rows of a catalogue under the names of its columns; nothing without one.
fn catalogue(text: &str) -> String {
    let catalogue = match Catalogue::read(text) {
        Ok(Some(catalogue)) => catalogue,
        Ok(None) => return String::new(),
        Err(problem) => return format!("catalogue: cannot be used: {problem}\n"),
    };
    let head = catalogue.columns.into_iter();
    let head = head.map(|(name, unit)| if unit.is_empty() { name } else { format!("{name} [{unit}]") }).collect();
    let lines: Vec<Vec<String>> = std::iter::once(head).chain(catalogue.rows).collect();
    let width = |k: usize| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    let mut out = "catalogue, `params = { use = \"...\" }`:\n".to_owned();
    for line in &lines {
        let cells = line.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        out.push_str(format!("  {}", cells.collect::<Vec<_>>().join("  ")).trim_end());
        out.push('\n');
    }
    out
}

/// A heading and aligned pairs; nothing without pairs.
fn section(text: &mut String, title: &str, pairs: impl Iterator<Item = (String, String)>) {
    let pairs: Vec<(String, String)> = pairs.collect();
    if pairs.is_empty() {
        return;
    }
    let width = pairs.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    text.push_str(&format!("{title}:\n"));
    for (name, remark) in pairs {
        text.push_str(format!("  {name:width$}  {remark}").trim_end());
        text.push('\n');
    }
}

fn named(named: &Named) -> (String, String) {
    (named.name.clone(), format!("{}{}", in_brackets(&named.unit), named.doc))
}

fn input(input: &NamedInput) -> (String, String) {
    let unconnected = match input.default {
        Some(default) => format!("{default} where nothing is connected"),
        None => "must be connected".to_owned(),
    };
    (input.name.clone(), format!("{}{unconnected}: {}", in_brackets(&input.unit), input.doc))
}

/// `[m] `; nothing for what has no unit.
fn in_brackets(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!("[{unit}] ") }
}

pub(super) fn parameter(spec: &ParamSpec) -> (String, String) {
    let mut remark = match spec.kind {
        ParamKind::Function => {
            let variable = if spec.variable.is_empty() { "x" } else { &spec.variable };
            format!("number, expression in {variable} or list of [argument, value] pairs")
        }
        kind => kind.text().to_owned(),
    };
    // Writing to a text does not fail.
    let has_unit = !matches!(spec.kind, ParamKind::Text | ParamKind::Boolean);
    if has_unit && !spec.unit.is_empty() {
        let _ = write!(remark, " [{}]", spec.unit);
    }
    if !spec.choices.is_empty() {
        let _ = write!(remark, ", one of {}", spec.choices.join(", "));
    }
    match (&spec.default, spec.optional) {
        (Some(default), _) => {
            let _ = write!(remark, ", default {default}");
        }
        (None, true) => remark.push_str(", may be left out"),
        (None, false) => remark.push_str(", required"),
    }
    for (relation, bound) in [(">=", spec.min), ("<=", spec.max), (">", spec.above), ("<", spec.below)] {
        if let Some(bound) = bound {
            let _ = write!(remark, ", {relation} {bound}");
        }
    }
    let _ = write!(remark, ": {}", spec.doc);
    (spec.name.clone(), remark)
}
