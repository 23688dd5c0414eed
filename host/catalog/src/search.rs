//! [`SearchPath`]: where libraries are looked for, and which one is taken. A name leads to a file name, never the other way
//! round, and no folder is searched below its surface, so the same call finds the same file. Stores of installed libraries
//! are folders of another kind: they know each library's name and version.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use element_api::manifest::Manifest;
use semver::Version;

use super::hash::sha256_of;
use super::{CatalogError, Request};
use odyn_diagnostics::{Diagnostic, codes, suggest};

/// The environment variable with further folders, separated as in `PATH`.
pub const ENVIRONMENT: &str = "ODYN_PLUGIN_PATH";

/// The program of this host, where that is not the one that runs.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// From now on `program` counts as the running program in this process: libraries beside it are found and trusted as its own, and
/// it is what [`super::put_up_glass`] starts. For hosts that are libraries of another program, such as an interpreter; the first
/// call counts.
pub fn belongs_to(program: PathBuf) {
    let _ = PROGRAM.set(program);
}

/// The program whose neighbours are the own libraries.
pub(super) fn own_program() -> io::Result<PathBuf> {
    PROGRAM.get().map_or_else(std::env::current_exe, |program| Ok(program.clone()))
}

/// Whether [`belongs_to`] has named it.
#[cfg(feature = "glass")]
pub(super) fn is_guest() -> bool {
    PROGRAM.get().is_some()
}

/// The ending of files of elements.
pub(super) const ENDING: &str = ".odyn-element";

/// Who names a place, in the order in which they are asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// `--plugin`.
    CommandLine,
    /// `[plugins] path` of the scene.
    Scene,
    /// The project's store: `.odyn/plugins` beside the scene or above.
    Project,
    /// [`ENVIRONMENT`].
    Environment,
    /// The user's store.
    User,
    /// The folders of the running program.
    Program,
}

/// A file, a folder with files, or a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Who names it; those of a project and of the user are stores.
    pub origin: Origin,
    /// Where it is.
    pub path: PathBuf,
}

/// Places where libraries are looked for, in order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SearchPath {
    places: Vec<Place>,
    /// Folder of the scene, where paths of libraries begin.
    beside: PathBuf,
}

/// A file that answers to a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The library.
    pub path: PathBuf,
    /// Who named its place.
    pub origin: Origin,
    /// Its SHA-256 when it was installed; `None` where it is not from a store.
    pub sha256: Option<String>,
    /// Its package, where it is from a store.
    package: Option<String>,
    /// Why it can't be used, where that is known without opening it.
    broken: Option<CatalogError>,
}

/// What a request leads to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Choice {
    /// The library that is taken.
    pub found: Found,
    /// Others of the same name that would have done as well, and have another content.
    pub passed_over: Vec<Found>,
}

impl Origin {
    /// What users call it.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::CommandLine => "command line",
            Self::Scene => "scene",
            Self::Project => "project",
            Self::Environment => ENVIRONMENT,
            Self::User => "user",
            Self::Program => "program",
        }
    }
}

#[cfg(feature = "abi")]
impl Found {
    /// Whether its code may run in this process: where there is no glass, where it is beside the program, or where the request
    /// trusts or pins it. Who sends a scene with a library is not who says that it can be trusted.
    pub(super) fn is_trusted(&self, request: &Request) -> bool {
        let came_along = matches!(self.origin, Origin::Scene | Origin::Project);
        !super::is_glass_up() || (request.trusted || request.sha256.is_some()) && !came_along || self.is_own()
    }

    /// Whether it is beside the program.
    pub(super) fn is_own(&self) -> bool {
        let own = own_program().map(|program| folders_of(&program)).unwrap_or_default();
        let Some(folder) = self.path.parent() else { return false };
        if own.iter().any(|own| own == folder) {
            return true;
        }
        let folder = folder.canonicalize().ok();
        folder.is_some() && own.iter().any(|own| own.canonicalize().ok() == folder)
    }
}

impl Place {
    /// Whether it holds installed libraries, each with a description.
    #[must_use]
    pub fn is_store(&self) -> bool {
        matches!(self.origin, Origin::Project | Origin::User)
    }
}

impl SearchPath {
    /// The usual order, for commands without a scene: what the command line names (files or folders), the given folders,
    /// the store of the project that the working folder is in, [`ENVIRONMENT`], the user's store, the folders of the
    /// running program.
    #[must_use]
    pub fn standard(command_line: &[PathBuf], scene: &[PathBuf]) -> Self {
        Self::for_scene(command_line, scene, Path::new(""))
    }

    /// The usual order, for a scene in this folder: the project is the one that the scene's folder is in.
    #[must_use]
    pub fn for_scene(command_line: &[PathBuf], scene: &[PathBuf], folder: &Path) -> Self {
        let program = own_program().unwrap_or_default();
        let path = Self::of(command_line, scene, std::env::var_os(ENVIRONMENT).as_deref(), &program);
        let user = user_folder().filter(|folder| folder.is_dir());
        let path = path.with_store(Origin::Project, project_above(folder)).with_store(Origin::User, user);
        Self { beside: folder.to_path_buf(), ..path }
    }

    /// The same with nothing taken from the surroundings, and no stores. `program` is the path of the running program.
    #[must_use]
    pub fn of(command_line: &[PathBuf], scene: &[PathBuf], environment: Option<&OsStr>, program: &Path) -> Self {
        let environment = environment.into_iter().flat_map(std::env::split_paths).filter(|p| !p.as_os_str().is_empty());
        let all = [
            (Origin::CommandLine, command_line.to_vec()),
            (Origin::Scene, scene.to_vec()),
            (Origin::Environment, environment.collect()),
            (Origin::Program, folders_of(program)),
        ];
        let place = |(origin, paths): (Origin, Vec<PathBuf>)| paths.into_iter().map(move |path| Place { origin, path });
        Self { places: all.into_iter().flat_map(place).collect(), beside: PathBuf::new() }
    }

    /// The same with a store, of a project or of the user, at its place in the order.
    #[must_use]
    pub fn with_store(mut self, origin: Origin, folder: Option<PathBuf>) -> Self {
        self.places.extend(folder.map(|path| Place { origin, path }));
        self.places.sort_by_key(|place| place.origin);
        self
    }

    /// All places, in order.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        self.places.iter()
    }

    /// The file behind a request: a name such as `"joints"`, or a path.
    ///
    /// A name stands for the packages `odyn-NAME` and `NAME`. A path (anything with a separator or the ending of a
    /// library) is tried from the folder of the scene, as it stands, then from each folder; one of the command line as it stands.
    ///
    /// # Errors
    /// [`CatalogError::NotFound`], or why the installed library of this name is broken.
    pub fn locate(&self, request: &str) -> Result<PathBuf, CatalogError> {
        self.find(&Request::named(request))
    }

    /// The file that [`SearchPath::choose`] takes.
    ///
    /// # Errors
    /// As there.
    pub fn find(&self, request: &Request) -> Result<PathBuf, CatalogError> {
        self.ranked(request).map(|(found, _)| found.path)
    }

    /// The library that a request leads to. Without a pin: the first place that has one, and of a store the highest version.
    /// With a pin: the highest version that fits it, of all places; the first place where several have that.
    ///
    /// # Errors
    /// [`CatalogError::NotFound`], [`CatalogError::NoneFits`], or why the installed library that would be taken is broken.
    pub fn choose(&self, request: &Request) -> Result<Choice, CatalogError> {
        let (found, rest) = self.ranked(request)?;
        let other = |one: &Found| {
            // Versions side by side are what stores are for; a build leaves copies in both folders of its programs.
            let expected = one.origin == found.origin && (one.package.is_some() && one.package == found.package);
            let copy = one.origin == Origin::Program && found.origin == Origin::Program;
            // Of the folders that one scene lists, such as those of a release and of a debug build, the first is meant; but who
            // has just built the other one may have forgotten that.
            let both = one.origin == Origin::Scene && found.origin == Origin::Scene;
            let listed = both && !is_newer(&one.path, &found.path);
            !expected && !copy && !listed && !same_content(&one.path, &found.path)
        };
        let passed_over = if request.sha256.is_some() { Vec::new() } else { rest.into_iter().filter(other).collect() };
        Ok(Choice { found, passed_over })
    }

    /// The library that is taken, and the others that would do.
    fn ranked(&self, request: &Request) -> Result<(Found, Vec<Found>), CatalogError> {
        let mut all = self.all_of(&request.name);
        if all.is_empty() {
            return Err(self.not_found(&request.name));
        }
        if request.is_pinned() {
            all = fitting(all, request)?;
        }
        let found = all.remove(0);
        match &found.broken {
            Some(error) => Err(error.clone()),
            None => Ok((found, all)),
        }
    }

    /// Every file that answers to a name, in the order of the places, of a store the highest version first.
    fn all_of(&self, request: &str) -> Vec<Found> {
        let files = |origin: Origin, paths: Vec<PathBuf>| {
            let existing = paths.into_iter().filter(|path| path.is_file());
            existing.map(move |path| Found { path, origin, sha256: None, package: None, broken: None })
        };
        if is_path(request) {
            let of_command_line =
                |place: &Place| place.origin == Origin::CommandLine && place.path == Path::new(request);
            let beside = self.beside.join(request);
            let first = if self.places.iter().any(of_command_line) { request.into() } else { beside };
            let as_it_stands = files(Origin::Scene, vec![first, request.into()]);
            let below = self.places.iter().filter(|place| !place.is_store() && !place.path.is_file());
            return as_it_stands
                .chain(below.flat_map(|p| files(p.origin, vec![p.path.join(request)])))
                .take(1)
                .collect();
        }
        let names = file_names(request);
        let at = |place: &Place| -> Vec<Found> {
            if place.is_store() {
                return installed(place, request);
            }
            if place.path.is_file() {
                let own = place.path.file_name().and_then(OsStr::to_str).unwrap_or_default();
                let paths = if names.iter().any(|name| name == own) { vec![place.path.clone()] } else { Vec::new() };
                return files(place.origin, paths).collect();
            }
            files(place.origin, names.iter().map(|name| place.path.join(name)).collect()).collect()
        };
        self.places.iter().flat_map(at).collect()
    }

    fn not_found(&self, request: &str) -> CatalogError {
        let here = || PathBuf::from(".");
        let beside =
            is_path(request).then(|| Some(self.beside.clone()).filter(|at| *at != Path::new("")).unwrap_or_else(here));
        CatalogError::NotFound {
            nearest: self.nearest(request),
            unreadable: self.unreadable(request).into(),
            folders: (beside.into_iter())
                .chain(self.places.iter().filter(|p| !p.path.is_file()).map(|place| place.path.clone()))
                .collect(),
            files: file_names(request),
            request: request.into(),
        }
    }

    /// Folders that someone names and files of the right name that the system does not let be looked at, in words.
    fn unreadable(&self, request: &str) -> Vec<String> {
        let named = self.places.iter().filter(|place| place.origin != Origin::Program && !place.is_store());
        let folders = named.filter(|place| !place.path.is_file()).filter_map(|place| {
            let error = std::fs::read_dir(&place.path).err()?;
            Some(format!("`{}` ({}) cannot be read: {error}", place.path.display(), place.origin.words()))
        });
        let files = self.folders().flat_map(|folder| file_names(request).into_iter().map(|name| folder.join(name)));
        // A link is there, and what it leads to is not.
        let files = files.filter(|file| file.symlink_metadata().is_ok()).filter_map(|file| {
            let error = file.metadata().err()?;
            Some(format!("`{}` is a link that leads nowhere: {error}", file.display()))
        });
        folders.chain(files).collect()
    }

    /// The folders among the places but the stores, in order.
    pub fn folders(&self) -> impl Iterator<Item = &Path> {
        let folders = self.places.iter().filter(|place| !place.is_store() && !place.path.is_file());
        folders.map(|place| place.path.as_path())
    }

    /// All libraries of elements that can be seen from here, first the ones that are found first. Nothing is run.
    #[must_use]
    pub fn manifests(&self) -> Vec<(PathBuf, Manifest)> {
        self.everything().into_iter().filter_map(|(_, path, manifest)| manifest.ok().map(|m| (path, m))).collect()
    }

    /// The library that each package's name leads to: the first one. Nothing is run.
    #[must_use]
    pub fn packages(&self) -> Vec<(PathBuf, Manifest)> {
        let mut first: Vec<(PathBuf, Manifest)> = Vec::new();
        for (path, manifest) in self.manifests() {
            if first.iter().all(|(_, known)| known.package != manifest.package) {
                first.push((path, manifest));
            }
        }
        first
    }

    /// All libraries with those that can't be used, and who names the place of each.
    #[must_use]
    pub fn everything(&self) -> Vec<(Origin, PathBuf, Result<Manifest, CatalogError>)> {
        #[cfg(feature = "abi")]
        {
            use super::{file, store::Store};
            let at = |place: &Place| {
                let found = if place.is_store() {
                    let manifest = |path: &Path, info| Result::and_then(info, |_| file::read_manifest(path));
                    let one = |one: super::store::Installed| (one.library(), manifest(&one.library(), one.info));
                    Store::new(&place.path).installed().into_iter().map(one).collect()
                } else if place.path.is_file() {
                    vec![(place.path.clone(), file::read_manifest(&place.path))]
                } else {
                    file::scan(&place.path)
                };
                let origin = place.origin;
                found.into_iter().map(move |(path, manifest)| (origin, path, manifest)).collect::<Vec<_>>()
            };
            self.places.iter().flat_map(at).collect()
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

impl Choice {
    /// Which others of this name were passed over.
    #[must_use]
    pub fn note(&self, request: &Request) -> Option<Diagnostic> {
        if self.passed_over.is_empty() {
            return None;
        }
        let place = |found: &Found| format!("{} ({})", found.path.display(), found.origin.words());
        let message = format!("several libraries are called `{}`; taken is {}", request.name, place(&self.found));
        let note = Diagnostic::note(codes::PASSED_OVER, message);
        let note = self.passed_over.iter().fold(note, |note, one| note.help(format!("passed over: {}", place(one))));
        Some(note.help("pin version or sha256 in `[plugins] libraries` to say which one is meant"))
    }
}

/// Whether a file was written after another; not if that cannot be known.
fn is_newer(file: &Path, other: &Path) -> bool {
    let written = |path: &Path| path.metadata().and_then(|data| data.modified());
    matches!((written(file), written(other)), (Ok(one), Ok(other)) if one > other)
}

/// Those that a pin allows, the highest version first.
fn fitting(all: Vec<Found>, request: &Request) -> Result<Vec<Found>, CatalogError> {
    let mut fitting: Vec<(Version, Found)> = Vec::new();
    let mut others = Vec::new();
    let mut content = false;
    for found in all {
        let place = format!("{} ({})", found.path.display(), found.origin.words());
        let version = match version_of(&found) {
            Ok(version) => version,
            Err(reason) => {
                others.push(format!("{place}: {reason}"));
                continue;
            }
        };
        if request.version.as_ref().is_some_and(|range| !range.matches(&version)) {
            others.push(format!("version {version} in {place}"));
            continue;
        }
        match request.sha256.as_ref().map(|wanted| (wanted, hash_of(&found.path))) {
            Some((wanted, hash)) if *wanted != hash => {
                content = true;
                others.push(format!("version {version}, SHA-256 {hash}, in {place}"));
            }
            _ => fitting.push((version, found)),
        }
    }
    if fitting.is_empty() {
        let (name, pin) = (request.name.clone(), request.pin());
        return Err(CatalogError::NoneFits { request: name, pin, found: others, content });
    }
    // Stable: of equal versions the first place stays first. Lower versions are no rivals.
    fitting.sort_by(|(a, _), (b, _)| b.cmp(a));
    let highest = fitting[0].0.clone();
    Ok(fitting.into_iter().filter(|(version, _)| *version == highest).map(|(_, found)| found).collect())
}

/// The version of a library; the error is in words.
fn version_of(found: &Found) -> Result<Version, String> {
    if let Some(error) = &found.broken {
        return Err(error.to_string());
    }
    #[cfg(feature = "abi")]
    {
        let manifest = super::file::read_manifest(&found.path).map_err(|error| error.to_string())?;
        Version::parse(&manifest.version).map_err(|error| format!("its version `{}`: {error}", manifest.version))
    }
    #[cfg(not(feature = "abi"))]
    Err("this program was built without the feature `abi`".into())
}

/// SHA-256 of a file; empty where it can't be read, which equals no hash.
fn hash_of(path: &Path) -> String {
    sha256_of(path).unwrap_or_default()
}

/// The installed versions of the packages `odyn-NAME` and `NAME`, in this order, the highest first.
fn installed(place: &Place, request: &str) -> Vec<Found> {
    #[cfg(feature = "abi")]
    {
        let plain = |name: &str| name.replace('-', "_");
        let wanted = [format!("odyn_{}", plain(request)), plain(request)];
        let all = super::store::Store::new(&place.path).installed();
        let found = |one: &super::store::Installed| Found {
            path: one.library(),
            origin: place.origin,
            sha256: one.info.as_ref().ok().map(|info| info.library_sha256().to_string()),
            package: Some(one.name.clone()),
            broken: one.info.as_ref().err().cloned(),
        };
        wanted.iter().flat_map(|name| all.iter().filter(move |one| plain(&one.name) == *name).map(found)).collect()
    }
    #[cfg(not(feature = "abi"))]
    {
        let _ = (place, request);
        Vec::new()
    }
}

fn same_content(a: &Path, b: &Path) -> bool {
    let size = |path: &Path| std::fs::metadata(path).map(|data| data.len()).ok();
    let content = |path: &Path| std::fs::read(path).ok();
    size(a).is_some() && size(a) == size(b) && content(a) == content(b)
}

fn is_path(request: &str) -> bool {
    request.contains(['/', std::path::MAIN_SEPARATOR]) || request.ends_with(DLL_SUFFIX) || request.ends_with(ENDING)
}

/// The file names that cargo gives the libraries of the packages `odyn-NAME` and `NAME`, and that of a file of elements.
fn file_names(request: &str) -> Vec<String> {
    if is_path(request) {
        return vec![request.into()];
    }
    let name = request.replace('-', "_");
    let libraries = ["odyn_", ""].iter().map(|prefix| format!("{DLL_PREFIX}{prefix}{name}{DLL_SUFFIX}"));
    libraries.chain([format!("{request}{ENDING}")]).collect()
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

/// The folder with the user's installed libraries; `None` where the system knows no home.
#[cfg_attr(not(feature = "abi"), allow(dead_code))]
pub(super) fn user_folder() -> Option<PathBuf> {
    user_folders("XDG_DATA_HOME", "APPDATA", &[".local", "share"]).into_iter().next()
}

/// The user's folders for libraries, the best first: in those that two variables of the surroundings name (the second one on
/// Windows), and in one below the home.
#[cfg_attr(not(feature = "abi"), allow(dead_code))]
pub(super) fn user_folders(xdg: &str, windows: &str, below_home: &[&str]) -> Vec<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let home = variable("HOME").map(|home| below_home.iter().fold(home, |path, name| path.join(name)));
    let roots = [variable(xdg), variable(windows).filter(|_| cfg!(windows)), home];
    roots.into_iter().flatten().map(|root| root.join("odyn").join("plugins")).collect()
}

/// The folder with the installed libraries of the project in this folder.
pub(super) fn project_folder(folder: &Path) -> PathBuf {
    folder.join(".odyn").join("plugins")
}

/// The store of the project that a folder is in: the nearest one, in the folder or above. One that belongs to somebody else
/// than the folder does is none: on a shared machine anybody may write above.
fn project_above(folder: &Path) -> Option<PathBuf> {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = here.canonicalize().ok()?;
    folder.ancestors().map(project_folder).find(|store| store.is_dir() && same_owner(store, &folder))
}

#[cfg(unix)]
fn same_owner(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let owner = |path: &Path| std::fs::metadata(path).map(|data| data.uid()).ok();
    owner(a).is_some() && owner(a) == owner(b)
}

#[cfg(not(unix))]
fn same_owner(_: &Path, _: &Path) -> bool {
    true
}
