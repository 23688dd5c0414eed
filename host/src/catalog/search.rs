//! [`SearchPath`]: where libraries are looked for. A name leads to a file name, never the other way round, and no folder
//! is searched below its surface, so the same call finds the same file.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use element_api::manifest::Manifest;

use super::CatalogError;
use crate::diagnostics::suggest;

/// The environment variable with further folders, separated as in `PATH`.
pub const ENVIRONMENT: &str = "ODYN_PLUGIN_PATH";

/// Folders and files among which libraries are looked for, in order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SearchPath {
    /// Files stand for themselves, everything else is taken for a folder.
    places: Vec<PathBuf>,
}

impl SearchPath {
    /// The usual order: what the command line names (files or folders), the scene's folders, [`ENVIRONMENT`], the
    /// folders of the running program.
    #[must_use]
    pub fn standard(command_line: &[PathBuf], scene: &[PathBuf]) -> Self {
        let program = std::env::current_exe().unwrap_or_default();
        Self::of(command_line, scene, std::env::var_os(ENVIRONMENT).as_deref(), &program)
    }

    /// The same with nothing taken from the surroundings. `program` is the path of the running program.
    #[must_use]
    pub fn of(command_line: &[PathBuf], scene: &[PathBuf], environment: Option<&OsStr>, program: &Path) -> Self {
        let mut places: Vec<PathBuf> = command_line.iter().chain(scene).cloned().collect();
        places.extend(environment.into_iter().flat_map(std::env::split_paths).filter(|p| !p.as_os_str().is_empty()));
        places.extend(folders_of(program));
        Self { places }
    }

    /// The file behind a request: a name such as `"joints"`, or a path.
    ///
    /// A name stands for the packages `odyn-NAME` and `NAME`. A path (anything with a separator or the ending of a
    /// library) is tried as it stands, then from each folder.
    ///
    /// # Errors
    /// [`CatalogError::NotFound`].
    pub fn locate(&self, request: &str) -> Result<PathBuf, CatalogError> {
        let names = file_names(request);
        let found = if is_path(request) {
            let as_it_stands = std::iter::once(PathBuf::from(request));
            as_it_stands.chain(self.folders().map(|folder| folder.join(request))).find(|path| path.is_file())
        } else {
            self.places.iter().find_map(|place| find_in(place, &names))
        };
        found.ok_or_else(|| CatalogError::NotFound {
            nearest: self.nearest(request),
            folders: self.folders().map(Path::to_path_buf).collect(),
            files: names,
            request: request.into(),
        })
    }

    /// The folders among the places, in order.
    pub fn folders(&self) -> impl Iterator<Item = &Path> {
        self.places.iter().map(PathBuf::as_path).filter(|place| !place.is_file())
    }

    /// All libraries of elements that can be seen from here, first the ones that are found first. Nothing is run.
    #[must_use]
    pub fn manifests(&self) -> Vec<(PathBuf, Manifest)> {
        #[cfg(feature = "abi")]
        {
            let files_in = |place: &PathBuf| match super::file::read_manifest(place) {
                Ok(manifest) => vec![(place.clone(), Ok(manifest))],
                Err(_) => super::file::scan(place),
            };
            let all = self.places.iter().flat_map(files_in);
            all.filter_map(|(path, manifest)| manifest.ok().map(|m| (path, m))).collect()
        }
        #[cfg(not(feature = "abi"))]
        Vec::new()
    }

    /// A library that provides the element.
    pub(super) fn provider(&self, package: Option<&str>, element: &str) -> Option<(Manifest, PathBuf)> {
        let fits = |manifest: &Manifest| {
            package.is_none_or(|p| manifest.package == p) && manifest.elements.iter().any(|e| e.name == element)
        };
        self.manifests().into_iter().find(|(_, manifest)| fits(manifest)).map(|(path, manifest)| (manifest, path))
    }

    /// A library whose name is similar to the requested one.
    fn nearest(&self, request: &str) -> Option<String> {
        let found = self.manifests();
        let short = |package: &'_ str| package.strip_prefix("odyn-").unwrap_or(package).to_string();
        let names: Vec<String> = found.iter().map(|(_, manifest)| short(&manifest.package)).collect();
        suggest(&short(request), names.iter().map(String::as_str))
    }
}

fn is_path(request: &str) -> bool {
    request.contains(['/', std::path::MAIN_SEPARATOR]) || request.ends_with(DLL_SUFFIX)
}

/// The file names that cargo gives the libraries of the packages `odyn-NAME` and `NAME`.
fn file_names(request: &str) -> Vec<String> {
    if is_path(request) {
        return vec![request.into()];
    }
    let name = request.replace('-', "_");
    ["odyn_", ""].iter().map(|prefix| format!("{DLL_PREFIX}{prefix}{name}{DLL_SUFFIX}")).collect()
}

fn find_in(place: &Path, names: &[String]) -> Option<PathBuf> {
    if place.is_file() {
        let own = place.file_name()?.to_str()?;
        return names.iter().any(|name| name == own).then(|| place.to_path_buf());
    }
    names.iter().map(|name| place.join(name)).find(|path| path.is_file())
}

/// Where libraries lie relative to a program: beside it. cargo puts the programs of tests and benchmarks, and the
/// libraries they depend on, into `deps`, and everything else one folder above.
fn folders_of(program: &Path) -> Vec<PathBuf> {
    let Some(folder) = program.parent().filter(|folder| !folder.as_os_str().is_empty()) else { return Vec::new() };
    match folder.file_name().and_then(OsStr::to_str) {
        Some("deps" | "examples") => {
            let above = folder.parent().map(Path::to_path_buf);
            std::iter::once(folder.to_path_buf()).chain(above).collect()
        }
        _ => vec![folder.to_path_buf(), folder.join("deps")],
    }
}
