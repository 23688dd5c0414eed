//! [`Store`]: a folder with installed libraries, several versions of each side by side in `NAME/VERSION/`.
//!
//! A version appears in one step (it is written beside and renamed), so that no other process ever sees half of one.

use std::fs;
use std::path::{Path, PathBuf};

use semver::Version;

use super::CatalogError;
use super::archive::Package;
use super::file::manifest;
use super::hash::sha256;
use super::loader;
use super::loader::Side;
use super::package::{ANY_TARGET, INFO_FILE, PackageInfo, is_package_name, target};
use super::search::{project_folder, user_folder};

/// A folder with installed libraries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Store {
    folder: PathBuf,
    /// The folder of the project whose store it is.
    project: Option<PathBuf>,
}

/// A version of a library in a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Installed {
    /// Name of its package.
    pub name: String,
    /// Its version.
    pub version: Version,
    /// The folder with its files.
    pub folder: PathBuf,
    /// What it says about itself; or why that can't be read.
    pub info: Result<PackageInfo, CatalogError>,
}

impl Store {
    /// The store in this folder, which need not be there yet.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), project: None }
    }

    /// The store of the user; `None` where the system knows no home.
    #[must_use]
    pub fn of_user() -> Option<Self> {
        user_folder().map(Self::new)
    }

    /// The store of the project in this folder.
    #[must_use]
    pub fn of_project(folder: &Path) -> Self {
        Self { project: Some(folder.into()), ..Self::new(project_folder(folder)) }
    }

    /// Where it is.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What is installed, by name, the highest version first.
    #[must_use]
    pub fn installed(&self) -> Vec<Installed> {
        let mut found = Vec::new();
        for (name, folder) in folders_in(&self.folder).filter(|(name, _)| is_package_name(name)) {
            for (version, folder) in folders_in(&folder) {
                let Ok(version) = Version::parse(&version) else { continue };
                let info = read_info(&folder, &name, &version);
                found.push(Installed { name: name.clone(), version, folder, info });
            }
        }
        found.sort_by(|a, b| a.name.cmp(&b.name).then_with(|| b.version.cmp(&a.version)));
        found
    }

    /// Installs a package, after its library was loaded for trial (which runs its code). `copies`: the folder for private copies of
    /// libraries, the user's cache folder where absent. True if it was not there before.
    ///
    /// # Errors
    /// It is for another machine, its library does not load, another package of this version is installed, or the folder can't
    /// be written. Nothing is left then.
    pub fn add(&self, package: &Package, copies: Option<&Path>) -> Result<(Installed, bool), CatalogError> {
        let info = &package.info;
        let folder = self.folder.join(&info.name).join(info.version.to_string());
        let bad = |reason: String| CatalogError::BadPackage { path: info.file_name().into(), reason };
        if info.target != target() && info.target != ANY_TARGET {
            return Err(bad(format!("it is for {}, this machine is {}", info.target, target())));
        }
        let own = manifest(Path::new(&info.library), package.library())?;
        if own.package != info.name || own.version != info.version.to_string() {
            let reason = format!("its library is `{}` {}, not what its `{INFO_FILE}` says", own.package, own.version);
            return Err(bad(reason));
        }
        let whole = || Installed {
            name: info.name.clone(),
            version: info.version.clone(),
            folder: folder.clone(),
            info: Ok(info.clone()),
        };
        if folder.exists() {
            let there = read_info(&folder, &info.name, &info.version);
            if there.as_ref() == Ok(info) && whole().problems().is_empty() {
                return Ok((whole(), false));
            }
            let (name, version) = (info.name.clone(), info.version.to_string());
            return Err(CatalogError::AlreadyInstalled { name, version, folder, project: self.project.clone() });
        }
        let draft = self.folder.join(format!(".draft-{}-{}", info.name, std::process::id()));
        let result = self.write(package, &draft, &folder, copies);
        if result.is_err() {
            let _ = fs::remove_dir_all(&draft);
        }
        result.map(|()| (whole(), true))
    }

    fn write(&self, package: &Package, draft: &Path, folder: &Path, copies: Option<&Path>) -> Result<(), CatalogError> {
        let cannot = |error: std::io::Error| CatalogError::Files { path: folder.into(), reason: error.to_string() };
        fs::create_dir_all(&self.folder).map_err(cannot)?;
        // Left by a process of the same number that was killed.
        let _ = fs::remove_dir_all(draft);
        fs::create_dir(draft).map_err(cannot)?;
        package.write_into(draft).map_err(cannot)?;
        loader::load(
            &draft.join(&package.info.library),
            copies,
            Some(package.info.library_sha256()),
            if super::is_glass_up() { Side::Glass } else { Side::Here },
        )?;
        if let Some(parent) = folder.parent() {
            fs::create_dir_all(parent).map_err(cannot)?;
        }
        fs::rename(draft, folder).map_err(cannot)
    }

    /// Removes a version; without one, the only one that is installed.
    ///
    /// # Errors
    /// It is not installed, several versions are and none is named, or the folder can't be written.
    pub fn remove(&self, name: &str, version: Option<&Version>) -> Result<Installed, CatalogError> {
        let all = self.installed();
        let versions: Vec<&Installed> = all.iter().filter(|one| one.name == name).collect();
        let fitting: Vec<&&Installed> =
            versions.iter().filter(|one| version.is_none_or(|v| one.version == *v)).collect();
        let [only] = fitting.as_slice() else {
            return Err(CatalogError::NotInstalled {
                name: version.map_or_else(|| name.to_string(), |version| format!("{name}@{version}")),
                store: self.folder.clone(),
                installed: versions.iter().map(|one| format!("{name}@{}", one.version)).collect(),
            });
        };
        let cannot =
            |error: std::io::Error| CatalogError::Files { path: only.folder.clone(), reason: error.to_string() };
        // First out of sight, in one step.
        let draft = self.folder.join(format!(".draft-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&draft);
        fs::rename(&only.folder, &draft).map_err(cannot)?;
        fs::remove_dir_all(&draft).map_err(cannot)?;
        // Fails while other versions are there.
        let _ = fs::remove_dir(self.folder.join(name));
        Ok((**only).clone())
    }
}

impl Installed {
    /// The library; the folder where that is not known.
    #[must_use]
    pub fn library(&self) -> PathBuf {
        self.info.as_ref().map_or_else(|_| self.folder.clone(), |info| self.folder.join(&info.library))
    }

    /// What is not as it was installed, in words: files that are missing, changed or strange. Nothing is run.
    #[must_use]
    pub fn problems(&self) -> Vec<String> {
        let info = match &self.info {
            Ok(info) => info,
            Err(error) => return vec![error.to_string()],
        };
        let mut problems = Vec::new();
        for (name, expected) in &info.files {
            match fs::read(self.folder.join(name)) {
                Ok(content) if sha256(&content) == *expected => {}
                Ok(_) => problems.push(format!("`{name}` was changed")),
                Err(error) => problems.push(format!("`{name}` cannot be read: {error}")),
            }
        }
        for path in files_below(&self.folder) {
            let name = path.strip_prefix(&self.folder).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            if name != INFO_FILE && !info.files.contains_key(&name) {
                problems.push(format!("`{name}` does not belong to it"));
            }
        }
        problems
    }
}

/// The description in a folder of a store, if it is the one of this name and version.
fn read_info(folder: &Path, name: &str, version: &Version) -> Result<PackageInfo, CatalogError> {
    let path = folder.join(INFO_FILE);
    let bad = |reason: String| CatalogError::BadPackage { path: path.clone(), reason };
    let text = fs::read_to_string(&path).map_err(|error| bad(format!("it cannot be read: {error}")))?;
    let info = PackageInfo::parse(&text).map_err(bad)?;
    if info.name != name || info.version != *version {
        return Err(bad(format!("it is that of `{}` {}", info.name, info.version)));
    }
    Ok(info)
}

/// The folders in a folder, with their names; links are none.
fn folders_in(folder: &Path) -> impl Iterator<Item = (String, PathBuf)> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .filter_map(|entry| entry.file_name().into_string().ok().map(|name| (name, entry.path())))
}

/// Everything below a folder that is no folder, sorted.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().filter_map(Result::ok) {
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => folders.push(entry.path()),
                _ => found.push(entry.path()),
            }
        }
    }
    found.sort();
    found
}
