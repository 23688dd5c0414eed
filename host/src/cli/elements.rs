//! `odyn elements` and `odyn plugin`

use std::fmt::Write;
use std::path::{Path, PathBuf};

use element_api::descriptor::{Descriptor, Kind, Named, NamedInput};
use element_api::documentation::manual_page;
use element_api::params::{ParamKind, ParamSpec};
use serde::Serialize;

use odyn::catalog::{Catalog, CatalogError, ElementHandle, Manifest, SearchPath, read_manifest, scan};
use odyn::diagnostics::suggest;

use super::args::{DescribeArgs, PlacesArgs};
use super::exit;
use super::failure::Failure;
use super::terminal;

/// Lists all element types by what the libraries say about themselves; nothing is run.
pub(super) fn list(args: &PlacesArgs) -> Result<u8, Failure> {
    let libraries = first_of_each(SearchPath::standard(&args.plugins, &[]).manifests());
    if args.json {
        #[derive(Serialize)]
        struct Element<'a> {
            name: String,
            kind: &'a str,
            library: &'a str,
            version: &'a str,
        }
        let elements = |manifest: &'_ Manifest| {
            let one = |element: &'_ element_api::manifest::ManifestElement| {
                (format!("{}/{}", manifest.package, element.name), element.kind.clone())
            };
            manifest.elements.iter().map(one).collect::<Vec<_>>()
        };
        let named: Vec<_> = libraries.iter().map(|(_, manifest)| (manifest, elements(manifest))).collect();
        let all = named.iter().flat_map(|(manifest, elements)| {
            elements.iter().map(|(name, kind)| Element {
                name: name.clone(),
                kind,
                library: &manifest.package,
                version: &manifest.version,
            })
        });
        terminal::print(&terminal::json(&all.collect::<Vec<_>>()))?;
        return Ok(exit::DONE);
    }
    let mut text = String::new();
    for (_, manifest) in &libraries {
        text.push_str(&format!("{} {}: {}\n", manifest.package, manifest.version, manifest.about));
        let width = manifest.elements.iter().map(|element| element.name.len()).max().unwrap_or(0);
        for element in &manifest.elements {
            text.push_str(&format!("  {:width$}  {}\n", element.name, element.kind));
        }
    }
    if libraries.is_empty() {
        eprintln!("{}", nothing_found());
    }
    terminal::print(&text)?;
    Ok(exit::DONE)
}

/// Shows one element type. The libraries that provide it are opened.
pub(super) fn describe(args: &DescribeArgs) -> Result<u8, Failure> {
    let search = SearchPath::standard(&args.places.plugins, &[]);
    let libraries = first_of_each(search.manifests());
    let (package, short) = match args.name.split_once('/') {
        Some((package, short)) => (Some(package), short),
        None => (None, args.name.as_str()),
    };
    let mut catalog = Catalog::new();
    for (path, manifest) in &libraries {
        let named = package.is_none_or(|package| package == manifest.package);
        if named && manifest.elements.iter().any(|element| element.name == short) {
            catalog.add(&path.display().to_string(), &search)?;
        }
    }
    if catalog.libraries().next().is_none() {
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

/// Lists all libraries, also those that can't be used, with the reason.
pub(super) fn plugins(args: &PlacesArgs) -> Result<u8, Failure> {
    #[derive(Serialize)]
    struct Plugin {
        path: PathBuf,
        package: Option<String>,
        version: Option<String>,
        about: Option<String>,
        abi: Option<u32>,
        interface: Option<String>,
        profile: Option<&'static str>,
        elements: Vec<String>,
        /// Another file of this package is found first.
        hidden: bool,
        problem: Option<String>,
    }
    let mut found: Vec<Plugin> = Vec::new();
    for (path, manifest) in everything(args) {
        let problem = manifest.as_ref().err().map(CatalogError::to_string);
        let manifest = manifest.ok();
        let of = |get: fn(&Manifest) -> &String| manifest.as_ref().map(|m| get(m).clone());
        // A build leaves copies of a library in two folders; they are one library.
        if found.iter().any(|known| same_content(&known.path, &path)) {
            continue;
        }
        found.push(Plugin {
            hidden: manifest.as_ref().is_some_and(|m| found.iter().any(|f| f.package.as_ref() == Some(&m.package))),
            package: of(|m| &m.package),
            version: of(|m| &m.version),
            about: of(|m| &m.about),
            interface: of(|m| &m.interface),
            abi: manifest.as_ref().map(|m| m.abi),
            profile: manifest.as_ref().map(|m| m.profile.word()),
            elements: manifest.map(|m| m.elements.into_iter().map(|e| e.name).collect()).unwrap_or_default(),
            path,
            problem,
        });
    }
    if args.json {
        terminal::print(&terminal::json(&found))?;
        return Ok(exit::DONE);
    }
    let mut text = String::new();
    for plugin in &found {
        let path = plugin.path.display();
        match (&plugin.package, &plugin.version, &plugin.problem) {
            (Some(package), Some(version), None) if plugin.hidden => {
                text.push_str(&format!("{package} {version}: hidden by the one above\n  {path}\n"));
            }
            (Some(package), Some(version), None) => {
                let about = plugin.about.as_deref().unwrap_or_default();
                let (abi, profile) = (plugin.abi.unwrap_or_default(), plugin.profile.unwrap_or_default());
                let elements = plugin.elements.join(", ");
                text.push_str(&format!(
                    "{package} {version}: {about}\n  {path}\n  interface {abi}, {profile} build\n  {elements}\n"
                ));
            }
            (_, _, problem) => {
                text.push_str(&format!("unusable: {}\n  {path}\n", problem.as_deref().unwrap_or_default()));
            }
        }
    }
    if found.is_empty() {
        eprintln!("{}", nothing_found());
    }
    terminal::print(&text)?;
    Ok(exit::DONE)
}

/// All libraries in the order in which they are found, and what is wrong with them.
fn everything(args: &PlacesArgs) -> Vec<(PathBuf, Result<Manifest, CatalogError>)> {
    let files = args.plugins.iter().filter(|place| place.is_file());
    let mut found: Vec<_> = files.map(|file| (file.clone(), read_manifest(file))).collect();
    let search = SearchPath::standard(&args.plugins, &[]);
    let folders: Vec<&Path> = search.folders().collect();
    found.extend(folders.into_iter().flat_map(scan));
    found
}

/// The library that a package's name leads to: the first one.
pub(super) fn first_of_each(found: Vec<(PathBuf, Manifest)>) -> Vec<(PathBuf, Manifest)> {
    let mut first: Vec<(PathBuf, Manifest)> = Vec::new();
    for (path, manifest) in found {
        if first.iter().all(|(_, known)| known.package != manifest.package) {
            first.push((path, manifest));
        }
    }
    first
}

fn same_content(a: &Path, b: &Path) -> bool {
    let size = |path: &Path| std::fs::metadata(path).map(|data| data.len()).ok();
    let content = |path: &Path| std::fs::read(path).ok();
    size(a).is_some() && size(a) == size(b) && content(a) == content(b)
}

fn nothing_found() -> &'static str {
    "no library of elements was found; name a folder with `--plugin`, or build the standard libraries with `cargo build`"
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
    }
    let Descriptor { kind, summary, opaque, frames, rows, inputs, joints, channels, states, params, .. } =
        element.descriptor();
    let Descriptor { angles, mobility, turns_freely, .. } = element.descriptor();
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
    section(&mut text, "constraint rows", descriptor.rows.iter().map(|row| (row.clone(), String::new())));
    section(&mut text, "inputs", descriptor.inputs.iter().map(input));
    section(&mut text, "joints whose reactions it takes", descriptor.joints.iter().map(named));
    section(&mut text, channels, descriptor.channels.iter().map(named));
    section(&mut text, "states", descriptor.states.iter().map(named));
    section(&mut text, "parameters", descriptor.params.iter().map(parameter));
    if let Some(mobility) = descriptor.mobility {
        let free = if descriptor.turns_freely { ", and turns freely" } else { "" };
        text.push_str(&format!("joint coordinates of its own: {mobility}{free}\n"));
    }
    if descriptor.opaque {
        text.push_str("called at run time: its equations are not compiled into the scene's\n");
    }
    text
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
