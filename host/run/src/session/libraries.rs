//! The libraries of a scene: where they are looked for, which ones are asked for.

use std::path::{Path, PathBuf};

use super::error::SessionError;
use super::options::RunOptions;
use crate::catalog::{Catalog, Request, SearchPath};
use crate::scene::{Rejected, Scene, read};

/// Where the libraries of a scene are looked for. `file` is the file of the scene; `plugins` are the files and folders of
/// `--plugin`.
#[must_use]
pub fn search_path(scene: &Scene, file: &Path, plugins: &[PathBuf]) -> SearchPath {
    let folder = file.parent().unwrap_or(Path::new(""));
    let own: Vec<PathBuf> = scene.plugins.paths.iter().map(|path| folder.join(&path.value)).collect();
    SearchPath::for_scene(plugins, &own, folder)
}

/// The libraries that a scene asks for.
#[must_use]
pub fn requests(scene: &Scene) -> Vec<Request> {
    let request = |library: &crate::scene::LibraryRecord| Request {
        name: library.name.value.clone(),
        version: library.version.clone(),
        sha256: library.sha256.clone(),
        trusted: library.trusted,
    };
    scene.plugins.libraries.iter().map(request).collect()
}

/// The libraries that a scene file names, loaded.
///
/// # Errors
/// The scene cannot be read, or a library cannot be loaded.
pub fn catalog_of_scene(path: &Path, options: &RunOptions) -> Result<Catalog, SessionError> {
    let (scene, _) = read(path, &options.overrides).map_err(|rejected| *rejected)?;
    load_libraries(&scene, path, options)
}

/// The catalog of the libraries that a scene and the command line name.
pub(super) fn load_libraries(scene: &Scene, path: &Path, options: &RunOptions) -> Result<Catalog, SessionError> {
    let common = options.common.clone().unwrap_or_default();
    let search = search_path(scene, path, &options.plugins);
    common.catalog(requests(scene), search, |requests, search| load(scene, options, requests, search))
}

fn load(
    scene: &Scene,
    options: &RunOptions,
    requests: &[Request],
    search: &SearchPath,
) -> Result<Catalog, SessionError> {
    let mut catalog = match &options.library_copies {
        Some(folder) => Catalog::new().with_copies_in(folder),
        None => Catalog::new(),
    };
    if let Some(watchdog) = &options.watchdog {
        catalog = catalog.watched_by(watchdog.clone());
    }
    let mut diagnostics = Vec::new();
    for (library, request) in scene.plugins.libraries.iter().zip(requests) {
        if let Err(error) = catalog.add_request(request, search) {
            diagnostics.push(error.diagnostic().at(library.span.clone(), "asked for here"));
        }
    }
    // A library named on the command line is wanted even if the scene does not name it; one that is not there is an error.
    for file in options.plugins.iter().filter(|path| !path.is_dir()) {
        if let Err(error) = catalog.add(&file.display().to_string(), search) {
            diagnostics.push(error.diagnostic());
        }
    }
    if diagnostics.is_empty() {
        return Ok(catalog);
    }
    Err(SessionError::new(&scene.source, diagnostics))
}

impl From<Rejected> for SessionError {
    /// A scene that could not be read.
    fn from(rejected: Rejected) -> Self {
        Self::new(&rejected.source, rejected.diagnostics)
    }
}
