//! `odyn plugin pack`, `add`, `remove`, `list` and `verify`

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use semver::Version;
use serde::Serialize;

use odyn::catalog::{
    Catalog, CatalogError, INFO_FILE, Manifest, Origin, Package, SearchPath, Store, read_manifest, sha256_of,
};
use odyn::diagnostics::{Diagnostic, codes};

use super::elements::{description_json, nothing_found};
use super::exit;
use super::failure::Failure;
use super::store_args::{AddArgs, ListArgs, PackArgs, RemoveArgs, StoreArgs, VerifyInstalledArgs};
use super::terminal;

/// Bytes that a folder of documentation may have; also the largest licence.
const LARGEST_PAPERS: u64 = 100 << 20;

/// Puts a library and its papers into one file. The library is opened: its descriptions are asked for.
pub(super) fn pack(args: &PackArgs) -> Result<u8, Failure> {
    let mut catalog = Catalog::new();
    catalog.add(&explicit(&args.library), &SearchPath::default())?;
    let descriptions: Vec<serde_json::Value> =
        catalog.elements().filter_map(|element| serde_json::from_str(&description_json(&element)).ok()).collect();
    let manifest = read_manifest(&args.library)?;
    let home = crate_folder(&args.library, &manifest.package);
    let more = papers(args, home.as_deref())?;
    let has = |what: fn(&str) -> bool| more.iter().any(|(name, _)| what(name));
    if !has(|name| name == "README.md" || name.starts_with("docs/")) {
        eprintln!("note: no README.md beside the Cargo.toml of `{}`; --docs DIR adds documentation", manifest.package);
    }
    if !has(is_licence) {
        eprintln!("note: no licence: who gets this file may not know what it may be used for; --licence FILE adds one");
    }
    if manifest.profile == element_api::manifest::Profile::Debug {
        eprintln!("note: this is a debug build: larger and slower than one with `--release`");
    }
    let package = Package::new(&args.library, terminal::json(&descriptions), more)?;
    let path = args.output.clone().unwrap_or_else(|| package.info.file_name().into());
    let written = package.to_bytes().and_then(|bytes| fs::write(&path, bytes));
    written.map_err(|error| cannot_write(&path, &error))?;
    let mut text = format!("{}: {} files, for {}\n", path.display(), package.info.files.len() + 1, package.info.target);
    for name in [INFO_FILE].into_iter().chain(package.info.files.keys().map(String::as_str)) {
        let _ = writeln!(text, "  {name}");
    }
    terminal::print(&text)?;
    Ok(exit::DONE)
}

/// Installs a package.
pub(super) fn add(args: &AddArgs) -> Result<u8, Failure> {
    let package = Package::read(&args.file)?;
    let store = store(&args.store)?;
    let (installed, new) = store.add(&package, None)?;
    let already = if new { "installed" } else { "was installed already" };
    let elements: Vec<&str> = package.info.elements.iter().filter_map(|e| e.split_once(' ').map(|(_, n)| n)).collect();
    terminal::print(&format!(
        "{} {}: {already} in {}\n  {}\n  SHA-256 of the library {}\n",
        installed.name,
        installed.version,
        installed.folder.display(),
        elements.join(", "),
        package.info.library_sha256(),
    ))?;
    Ok(exit::DONE)
}

/// Removes an installed library.
pub(super) fn remove(args: &RemoveArgs) -> Result<u8, Failure> {
    let (name, version) = match args.name.split_once('@') {
        Some((name, version)) => (name, Some(version)),
        None => (args.name.as_str(), None),
    };
    let version = version.map(Version::parse).transpose().map_err(|error| {
        let diagnostic =
            Diagnostic::error(codes::INSTALLATION, format!("`{}` has no version behind `@`: {error}", args.name));
        Failure::new(diagnostic.help("write NAME@1.2.3")).exit(exit::USAGE)
    })?;
    let removed = store(&args.store)?.remove(name, version.as_ref())?;
    terminal::print(&format!("{} {}: removed from {}\n", removed.name, removed.version, removed.folder.display()))?;
    Ok(exit::DONE)
}

/// Compares installed files with what was installed; nothing is run.
pub(super) fn verify(args: &VerifyInstalledArgs) -> Result<u8, Failure> {
    let search = match &args.project {
        Some(folder) => {
            SearchPath::default().with_store(Origin::Project, Some(Store::of_project(folder).folder().into()))
        }
        None => SearchPath::standard(&[], &[]),
    };
    let mut text = String::new();
    let mut problems = 0;
    let mut seen = 0;
    for place in search.places().filter(|place| place.is_store()) {
        for one in Store::new(&place.path).installed() {
            if args.name.as_ref().is_some_and(|name| *name != one.name) {
                continue;
            }
            seen += 1;
            let found = one.problems();
            problems += found.len();
            let verdict = if found.is_empty() { "ok" } else { "NOT AS INSTALLED" };
            let folder = one.folder.display();
            let _ = writeln!(text, "{} {}: {verdict}\n  {folder} ({})", one.name, one.version, place.origin.words());
            for problem in found {
                let _ = writeln!(text, "  {problem}");
            }
        }
    }
    terminal::print(&text)?;
    if seen == 0 {
        eprintln!(
            "nothing is installed{}",
            args.name.iter().map(|name| format!(" that is called `{name}`")).collect::<String>()
        );
    }
    Ok(if problems == 0 { exit::DONE } else { exit::PLUGIN })
}

/// A library that can be found.
#[derive(Serialize)]
struct Plugin {
    path: PathBuf,
    /// Who names its place.
    place: &'static str,
    package: Option<String>,
    version: Option<String>,
    about: Option<String>,
    abi: Option<u32>,
    interface: Option<String>,
    profile: Option<&'static str>,
    elements: Vec<String>,
    sha256: Option<String>,
    /// A name without a pin leads to another file of this package.
    hidden: bool,
    problem: Option<String>,
}

/// Lists all libraries, also those that can't be used, with the reason.
pub(super) fn list(args: &ListArgs) -> Result<u8, Failure> {
    let found = plugins(&SearchPath::standard(&args.places.plugins, &[]));
    if args.pins {
        terminal::print(&pins(&found))?;
        return Ok(exit::DONE);
    }
    if args.places.json {
        terminal::print_as_it_is(&terminal::json(&found))?;
        return Ok(exit::DONE);
    }
    let mut text = String::new();
    for plugin in &found {
        let (path, place) = (plugin.path.display(), plugin.place);
        match (&plugin.package, &plugin.version, &plugin.problem) {
            (Some(package), Some(version), None) if plugin.hidden => {
                let _ = writeln!(
                    text,
                    "{package} {version}: hidden by one above, unless a scene is pinned to this one\n  {path} ({place})"
                );
            }
            (Some(package), Some(version), None) => {
                let about = plugin.about.as_deref().unwrap_or_default();
                let (abi, profile) = (plugin.abi.unwrap_or_default(), plugin.profile.unwrap_or_default());
                let elements = plugin.elements.join(", ");
                let _ = writeln!(
                    text,
                    "{package} {version}: {about}\n  {path} ({place})\n  interface {abi}, {profile} build\n  {elements}"
                );
            }
            (_, _, problem) => {
                let _ = writeln!(text, "unusable: {}\n  {path} ({place})", problem.as_deref().unwrap_or_default());
            }
        }
    }
    if found.is_empty() {
        eprintln!("{}", nothing_found());
    }
    terminal::print(&text)?;
    let holes = odyn::catalog::holes_in_glass();
    if !holes.is_empty() {
        eprintln!("note: libraries that are not trusted run in processes of their own, but {holes}");
    }
    Ok(exit::DONE)
}

fn plugins(search: &SearchPath) -> Vec<Plugin> {
    let mut found: Vec<Plugin> = Vec::new();
    for (origin, path, manifest) in search.everything() {
        let problem = manifest.as_ref().err().map(CatalogError::to_string);
        let manifest = manifest.ok();
        let of = |get: fn(&Manifest) -> &String| manifest.as_ref().map(|m| get(m).clone());
        let sha256 = sha256_of(&path);
        // A build leaves copies of a library in two folders; they are one library.
        if sha256.is_some() && found.iter().any(|known| known.sha256 == sha256) {
            continue;
        }
        found.push(Plugin {
            hidden: manifest.as_ref().is_some_and(|m| found.iter().any(|f| f.package.as_ref() == Some(&m.package))),
            place: origin.words(),
            package: of(|m| &m.package),
            version: of(|m| &m.version),
            about: of(|m| &m.about),
            interface: of(|m| &m.interface),
            abi: manifest.as_ref().map(|m| m.abi),
            profile: manifest.as_ref().map(|m| m.profile.word()),
            elements: manifest.map(|m| m.elements.into_iter().map(|e| e.name).collect()).unwrap_or_default(),
            sha256,
            path,
            problem,
        });
    }
    found
}

/// The libraries that names lead to, as a scene may be pinned to them.
fn pins(found: &[Plugin]) -> String {
    let mut text = String::from("[plugins]\nlibraries = [\n");
    for plugin in found.iter().filter(|plugin| !plugin.hidden) {
        if let (Some(package), Some(version), Some(hash)) = (&plugin.package, &plugin.version, &plugin.sha256) {
            let _ = writeln!(text, "    {{ name = \"{package}\", version = \"={version}\", sha256 = \"{hash}\" }},");
        }
    }
    text.push_str("]\n");
    text
}

/// The store that the command line means.
fn store(args: &StoreArgs) -> Result<Store, Failure> {
    if let Some(folder) = &args.project {
        return Ok(Store::of_project(folder));
    }
    Store::of_user().ok_or_else(|| {
        let diagnostic = Diagnostic::error(codes::CANNOT_WRITE, "the system knows no home folder of this user");
        Failure::new(diagnostic.help("set HOME, or install into a project with --project DIR"))
    })
}

/// A path that is not taken for the name of a library.
fn explicit(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    path.display().to_string()
}

/// The folder of the crate that a library was built from: the working folder, or above the library, where the Cargo.toml is
/// that of this package.
fn crate_folder(library: &Path, package: &str) -> Option<PathBuf> {
    let library = std::path::absolute(library).ok()?;
    let here = std::env::current_dir().ok();
    let above = library.ancestors().skip(1).map(Path::to_path_buf);
    let is_home = |folder: &PathBuf| {
        let text = fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
        let manifest: toml::Table = text.parse().unwrap_or_default();
        manifest.get("package").and_then(|p| p.get("name")).and_then(toml::Value::as_str) == Some(package)
    };
    here.into_iter().chain(above).find(is_home)
}

/// Documentation and licence with their names in the package.
fn papers(args: &PackArgs, home: Option<&Path>) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let mut found = Vec::new();
    let beside = home.into_iter().flat_map(files_in).filter_map(|path| {
        let name = path.file_name()?.to_str()?.to_string();
        let wanted = name == "README.md" || (args.licence.is_none() && is_licence(&name));
        wanted.then_some((name, path))
    });
    let mut paths: Vec<(String, PathBuf)> = beside.collect();
    if let Some(licence) = &args.licence {
        let name = licence.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        paths.push((if is_licence(name) { name.into() } else { format!("LICENSE-{name}") }, licence.clone()));
    }
    if let Some(docs) = &args.docs {
        documentation(docs, "docs", &mut paths)?;
    }
    let mut size = 0;
    for (name, path) in paths {
        size += fs::metadata(&path).map_or(0, |data| data.len());
        if size > LARGEST_PAPERS {
            let message = format!(
                "documentation and licence have more than {} MB, with {}",
                LARGEST_PAPERS >> 20,
                path.display()
            );
            return Err(Failure::new(Diagnostic::error(codes::BAD_PACKAGE, message)).exit(exit::FILES));
        }
        found.push((name, fs::read(&path).map_err(|error| cannot_read(&path, &error))?));
    }
    Ok(found)
}

/// The files of a folder and those below, but for hidden ones and links.
fn documentation(folder: &Path, name: &str, paths: &mut Vec<(String, PathBuf)>) -> Result<(), Failure> {
    for entry in fs::read_dir(folder).map_err(|error| cannot_read(folder, &error))? {
        let entry = entry.map_err(|error| cannot_read(folder, &error))?;
        let own = entry.file_name().to_string_lossy().into_owned();
        if own.starts_with('.') {
            continue;
        }
        let name = format!("{name}/{own}");
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => documentation(&entry.path(), &name, paths)?,
            Ok(kind) if kind.is_file() => paths.push((name, entry.path())),
            _ => {}
        }
    }
    Ok(())
}

fn files_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect()
}

fn is_licence(name: &str) -> bool {
    let upper = name.to_uppercase();
    ["LICENSE", "LICENCE", "COPYING"].iter().any(|word| upper.starts_with(word))
}

fn cannot_read(path: &Path, error: &std::io::Error) -> Failure {
    let message = format!("cannot read `{}`: {error}", path.display());
    Failure::new(Diagnostic::error(codes::UNREADABLE, message))
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    let message = format!("cannot write `{}`: {error}", path.display());
    Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message))
}
