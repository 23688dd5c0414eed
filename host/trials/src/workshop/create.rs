//! A new crate with elements: all of its files are written beside their place and moved there together.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use element_api::manifest::INTERFACE;

use super::error::WorkshopError;
use super::names;
use super::templates::{Template, fill};
use crate::catalog::Manifest;

/// A crate to be made.
#[derive(Debug, Clone)]
pub struct NewPlugin {
    /// Its folder, whose last part is the name of the crate and, but for [`Template::Library`], of its element.
    pub folder: PathBuf,
    /// What it provides.
    pub template: Template,
    /// Where `element-api` is; not asked for by [`Template::C`], which brings its header along.
    pub contract: Contract,
}

/// Where a crate takes `element-api` from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Contract {
    /// The folder of its sources.
    Folder(PathBuf),
    /// A version requirement, to be met by the package registry.
    Version(String),
}

impl Contract {
    /// From a text that is a folder or a version: what begins with a digit, or with an operator and a digit, and is no folder is
    /// a version.
    #[must_use]
    pub fn of_text(text: &str) -> Self {
        let digits = text.trim_start_matches(['=', '^', '~', '>', '<', ' ']);
        if digits.starts_with(|c: char| c.is_ascii_digit()) && !Path::new(text).is_dir() {
            Self::Version(text.into())
        } else {
            Self::Folder(text.into())
        }
    }

    /// The folder `element-api` of the sources that one of these paths lies in; without one, the version that this program
    /// was built with.
    #[must_use]
    pub fn found_from(places: &[PathBuf]) -> Self {
        let folders = places.iter().flat_map(|place| place.ancestors());
        let mut candidates = folders.map(|folder| folder.join("element-api"));
        match candidates.find(|folder| check_contract(folder).is_ok()) {
            Some(folder) => Self::Folder(folder),
            None => Self::Version(INTERFACE.into()),
        }
    }
}

/// What was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Created {
    /// Name of the crate.
    pub package: String,
    /// Names of its elements.
    pub elements: Vec<String>,
    /// Its folder, as given.
    pub folder: PathBuf,
    /// Its files, relative to the folder, and the lines that each has.
    pub files: Vec<(PathBuf, usize)>,
    /// Name of the file that cargo makes of it.
    pub library: String,
}

impl Created {
    /// What an author should know: names that libraries which can be found have already.
    #[must_use]
    pub fn collisions(&self, known: &[(PathBuf, Manifest)]) -> Vec<String> {
        let mut found = Vec::new();
        for (path, manifest) in known {
            if manifest.package == self.package {
                found.push(format!(
                    "another library is called `{}` ({}); a scene can name one of them only",
                    self.package,
                    path.display()
                ));
            }
            for element in self.elements.iter().filter(|name| manifest.elements.iter().any(|e| e.name == **name)) {
                let (own, other) = (&self.package, &manifest.package);
                found.push(format!(
                    "`{other}` has a `{element}`, too; scenes that name both libraries write `{own}/{element}`"
                ));
            }
        }
        found.sort();
        found.dedup();
        found
    }
}

/// Makes the crate. Its folder must not exist; the one that it is to lie in must.
///
/// # Errors
/// See [`WorkshopError`]; nothing is left behind then.
pub fn create(new: &NewPlugin) -> Result<Created, WorkshopError> {
    let package = new.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    names::check(&package)?;
    if new.folder.symlink_metadata().is_ok() {
        return Err(WorkshopError::Exists { path: new.folder.clone() });
    }
    let parent = match new.folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    let cannot = |path: &Path| {
        let path = path.to_path_buf();
        move |source: io::Error| WorkshopError::Write { path, source }
    };
    let place = parent.canonicalize().map_err(cannot(&parent))?.join(&package);
    let (dependency, lock) = match new.template {
        Template::C => Default::default(),
        _ => dependency(&new.contract, &place)?,
    };
    let made = Created {
        elements: match new.template.elements() {
            [] => vec![names::element_name(&package)],
            several => several.iter().map(ToString::to_string).collect(),
        },
        library: library_file(&package),
        folder: new.folder.clone(),
        files: Vec::new(),
        package,
    };
    let texts = texts(&made, new.template, &dependency);

    let beside = parent.join(format!(".{}.new-{}", made.package, std::process::id()));
    let written = write(&beside, &texts, lock.as_deref()).and_then(|()| {
        // An empty folder that came in between would be replaced without a word on some systems.
        if place.exists() {
            return Err(WorkshopError::Exists { path: new.folder.clone() });
        }
        fs::rename(&beside, &place).map_err(cannot(&new.folder))
    });
    if let Err(error) = written {
        // The first error is the one to tell.
        let _ = fs::remove_dir_all(&beside);
        return Err(error);
    }
    let files = texts.into_iter().map(|(path, text)| (path, text.lines().count())).collect();
    Ok(Created { files, ..made })
}

/// The file that cargo makes of a crate.
pub(super) fn library_file(package: &str) -> String {
    format!("{DLL_PREFIX}{}{DLL_SUFFIX}", names::crate_name(package))
}

/// The files with their texts.
fn texts(made: &Created, template: Template, dependency: &str) -> Vec<(PathBuf, String)> {
    let (type_name, name) = (names::type_name(&made.package), names::crate_name(&made.package));
    let linux_file = format!("lib{name}.so");
    let words: &[(&str, &str)] = &[
        ("package", &made.package),
        ("element", made.elements.first().map_or("", String::as_str)),
        ("Type", &type_name),
        ("about", template.about()),
        ("what", template.examined()),
        ("files", template.table()),
        ("crate", &name),
        ("built", template.built()),
        ("file", &made.library),
        ("linux_file", &linux_file),
        ("api", dependency),
    ];
    template.files().map(|(path, text)| (PathBuf::from(path), fill(text, words))).collect()
}

/// What the manifest says of `element-api`, seen from the crate's folder, and the lock file of the sources it lies in: with the
/// versions that the contract is tested with, the first build may need nothing from elsewhere.
fn dependency(contract: &Contract, place: &Path) -> Result<(String, Option<PathBuf>), WorkshopError> {
    let folder = match contract {
        Contract::Version(version) => return Ok((format!("version = {}", quoted(version)), None)),
        Contract::Folder(folder) => folder,
    };
    let bad = |reason: String| WorkshopError::NoContract { path: folder.clone(), reason };
    check_contract(folder).map_err(bad)?;
    let folder = folder.canonicalize().map_err(|error| bad(error.to_string()))?;
    let lock = folder.parent().map(|sources| sources.join("Cargo.lock")).filter(|lock| lock.is_file());
    Ok((format!("path = {}", quoted(&seen_from(&folder, place))), lock))
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

/// Whether a folder is that of the contract; if not, why.
fn check_contract(folder: &Path) -> Result<(), String> {
    let manifest = fs::read_to_string(folder.join("Cargo.toml")).map_err(|error| format!("its Cargo.toml: {error}"))?;
    let manifest: toml::Table = manifest.parse().map_err(|_| "its Cargo.toml is not TOML".to_string())?;
    let name = manifest.get("package").and_then(|package| package.get("name")).and_then(toml::Value::as_str);
    match name {
        Some("element-api") => Ok(()),
        Some(other) => Err(format!("it is that of `{other}`")),
        None => Err("its Cargo.toml names no package".into()),
    }
}

/// An absolute path as seen from a folder, with `/`; absolute where the two have nothing but the root in common.
fn seen_from(path: &Path, folder: &Path) -> String {
    let (path_parts, folder_parts): (Vec<_>, Vec<_>) = (path.components().collect(), folder.components().collect());
    let common = path_parts.iter().zip(&folder_parts).take_while(|(a, b)| a == b).count();
    let names_shared = path_parts[..common].iter().any(|part| matches!(part, Component::Normal(_)));
    if !names_shared {
        return path.display().to_string();
    }
    let up = folder_parts[common..].iter().map(|_| "..".to_string());
    let down = path_parts[common..].iter().map(|part| part.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}

fn write(folder: &Path, texts: &[(PathBuf, String)], lock: Option<&Path>) -> Result<(), WorkshopError> {
    let cannot = |path: &Path| {
        let path = path.to_path_buf();
        move |source: io::Error| WorkshopError::Write { path, source }
    };
    fs::create_dir(folder).map_err(cannot(folder))?;
    for (name, text) in texts {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(cannot(parent))?;
        fs::write(&path, text).map_err(cannot(&path))?;
    }
    if let Some(lock) = lock {
        let path = folder.join("Cargo.lock");
        fs::copy(lock, &path).map_err(cannot(&path))?;
    }
    Ok(())
}
