//! The catalog: which element types there are, and which library provides each.
//!
//! - **Takes**: names of libraries with a [`SearchPath`], or libraries that are linked in.
//! - **Gives**: [`Catalog::find`]: the class behind a type name, and which library it is from.
//! - **May touch**: files of libraries, the user's cache folder, the loader of the system. `loader.rs` is the only file
//!   of the host that loads foreign code, `c_library` the one that calls into libraries in C; a library's text
//!   ([`Manifest`]) is read and judged before its code runs.
//! - **Must not know**: scenes, equations, bodies.
//!
//! Full names are `package/element`. The short name, the part behind the slash, is enough while it is unique among the
//! loaded libraries.
//!
//! | file | content |
//! |---|---|
//! | `offer.rs` | an element type, read when it is needed |
//! | `request.rs`, `search.rs` | what is asked for, where it is looked for, which one is taken |
//! | `hash.rs` | SHA-256 |
//! | `float_control.rs` | rounding, denormals and traps of the processor, kept as they were |
//! | `file.rs`, `loader.rs`, `private_copy.rs`, `known.rs`, `watchdog.rs` | a file judged, loaded, kept, known again, watched |
//! | `declared.rs` | parameters that no compiler looked at |
//! | `element_file/` | elements as data, `*.odyn-element`: read, given numbers |
//! | `fmu.rs` | FMUs, each a library with one class |
//! | `kept.rs`, `lazy.rs` | what was answered before; libraries that are loaded when they are needed |
//! | `glass/` | libraries that are not trusted, in processes of their own |
//! | `package.rs`, `archive.rs`, `store.rs` | a library with its papers as one file; the folders where such are installed |
//! | `error.rs` | why a library or an element type can't be had |
//!
//! Without the feature `abi` a catalog holds linked-in libraries only. With the feature `crashes` a program can tell whose code
//! broke it (`tell_crashes`).

#[cfg(feature = "abi")]
mod archive;
#[cfg(feature = "abi")]
mod c_library;
#[cfg(all(unix, feature = "crashes"))]
mod crash;
#[cfg(feature = "abi")]
mod declared;
#[cfg(feature = "abi")]
mod element_file;
mod error;
#[cfg(feature = "abi")]
mod file;
mod float_control;
#[cfg(feature = "abi")]
mod fmu;
#[cfg(all(unix, feature = "glass"))]
mod glass;
mod hash;
#[cfg(all(unix, feature = "glass"))]
mod kept;
#[cfg(feature = "abi")]
mod known;
#[cfg(all(unix, feature = "glass"))]
mod lazy;
#[cfg(feature = "abi")]
mod loader;
mod offer;
#[cfg(feature = "abi")]
mod package;
#[cfg(feature = "abi")]
mod private_copy;
mod request;
mod search;
#[cfg(feature = "abi")]
mod store;
mod watchdog;

#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use element_api::descriptor::{Descriptor, Kind};
use element_api::fence;
use element_api::manifest::{ABI, CONVENTIONS, INTERFACE, Library, ManifestElement, Profile};
use element_api::set::ElementClass;

#[cfg(feature = "abi")]
use self::loader::Side;
use self::offer::Offer;
use odyn_diagnostics::{Diagnostic, suggest};

#[cfg(feature = "abi")]
pub use archive::Package;
#[cfg(all(unix, feature = "crashes"))]
pub use crash::{ExitGuard, tell_crashes};
pub use element_api::manifest::Manifest;
pub use error::{CatalogError, fault_code};
#[cfg(feature = "abi")]
pub use file::{read_manifest, scan};
#[cfg(all(unix, feature = "glass"))]
pub use glass::{farewell, put_up_glass, record_if_asked};
pub use hash::{sha256, sha256_of};
#[cfg(feature = "abi")]
pub use package::{ENDING, INFO_FILE, PackageInfo, target};
pub use request::Request;
pub use search::{Choice, ENVIRONMENT, Found, Origin, Place, SearchPath, belongs_to};
#[cfg(feature = "abi")]
pub use store::{Installed, Store};
pub use watchdog::{Late, Watchdog};

/// Whether libraries that are not trusted get a process of their own.
#[cfg_attr(not(feature = "abi"), allow(dead_code))]
fn is_glass_up() -> bool {
    #[cfg(all(unix, feature = "glass"))]
    return glass::is_up();
    #[cfg(not(all(unix, feature = "glass")))]
    false
}

/// What this system cannot keep a library behind glass from, in words; empty where nothing is missing, or there is no glass.
#[must_use]
pub fn holes_in_glass() -> &'static str {
    #[cfg(all(unix, feature = "glass"))]
    if glass::is_up() {
        return glass::holes();
    }
    ""
}

/// The element types that a scene may use.
#[derive(Clone, Default)]
pub struct Catalog {
    libraries: Vec<Entry>,
    warnings: Vec<Diagnostic>,
    /// Where the libraries were looked for; also the place to look for the one a scene forgot to name.
    search: SearchPath,
    /// Where private copies of libraries go; `None`: the user's cache folder.
    copies: Option<PathBuf>,
    /// Who watches the calls into them.
    watchdog: Option<Watchdog>,
    /// FMUs that were read.
    #[cfg(feature = "abi")]
    fmus: fmu::Known,
}

/// One library of a catalog.
#[derive(Clone)]
struct Entry {
    info: Arc<LibraryInfo>,
    types: Vec<Type>,
}

/// An element type, with its class once that was needed.
#[derive(Clone)]
struct Type {
    offer: Arc<Offer>,
    /// As it is handed out: watched, where there is a watchdog.
    class: Arc<OnceLock<Arc<dyn ElementClass>>>,
    watchdog: Option<Watchdog>,
}

impl Type {
    /// # Errors
    /// See [`Offer::class`].
    fn handle(&self, library: &Arc<LibraryInfo>) -> Result<ElementHandle, CatalogError> {
        let class = match (self.class.get(), &self.watchdog) {
            (Some(class), _) => class,
            (None, None) => self.offer.class()?,
            (None, Some(watchdog)) => {
                let class = Arc::clone(watchdog.load(&library.origin(), || self.offer.class())?);
                self.class.get_or_init(|| watchdog.class(&library.package, class, self.offer.at_rest))
            }
        };
        Ok(ElementHandle { class: Arc::clone(class), library: Arc::clone(library) })
    }
}

/// What is known of a library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LibraryInfo {
    /// Name of its crate; the part before the slash in full element names.
    pub package: String,
    /// Version of its crate.
    pub version: String,
    /// One sentence for the user.
    pub about: String,
    /// The file it was loaded from; `None` when it is linked in.
    pub path: Option<PathBuf>,
    /// SHA-256 of that file, 64 hexadecimal digits; `None` when it is linked in.
    pub sha256: Option<String>,
    /// Whether its code runs in a process of its own.
    pub glass: bool,
    /// Version of the binary interface.
    pub abi: u32,
    /// Number of its conventions (axes, units, signs).
    pub conventions: u32,
    /// Version of `element-api` it was built with.
    pub interface: String,
    /// How it was compiled.
    pub profile: Profile,
    /// Processor features its compiler was allowed to use.
    pub features: Vec<String>,
    /// What it provides.
    pub elements: Vec<ManifestElement>,
}

/// An element type of a catalog.
#[derive(Clone)]
pub struct ElementHandle {
    /// The class.
    pub class: Arc<dyn ElementClass>,
    /// The library it is from.
    pub library: Arc<LibraryInfo>,
}

impl ElementHandle {
    /// Names, parameters, sizes.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        self.class.descriptor()
    }

    /// `package/element`.
    #[must_use]
    pub fn full_name(&self) -> String {
        format!("{}/{}", self.library.package, self.descriptor().name)
    }
}

impl std::fmt::Debug for ElementHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ElementHandle({})", self.full_name())
    }
}

impl std::fmt::Debug for Catalog {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.elements()).finish()
    }
}

impl Catalog {
    /// A catalog without libraries.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same catalog, keeping the private copies of libraries that are loaded from now on in this folder instead of the
    /// user's cache folder. Nobody else must be able to write there.
    #[must_use]
    pub fn with_copies_in(mut self, folder: impl Into<PathBuf>) -> Self {
        self.copies = Some(folder.into());
        self
    }

    /// The same catalog, the calls into libraries that are added from now on watched.
    #[must_use]
    pub fn watched_by(mut self, watchdog: Watchdog) -> Self {
        self.watchdog = Some(watchdog);
        self
    }

    /// A catalog of the requested libraries, each a name such as `"joints"` or the path of a file.
    ///
    /// # Errors
    /// Every request that failed, by its number, in their order.
    pub fn load<S: AsRef<str>>(requests: &[S], search: &SearchPath) -> Result<Self, Vec<(usize, CatalogError)>> {
        let mut catalog = Self::new();
        let mut errors = Vec::new();
        for (k, request) in requests.iter().enumerate() {
            if let Err(error) = catalog.add(request.as_ref(), search) {
                errors.push((k, error));
            }
        }
        if errors.is_empty() { Ok(catalog) } else { Err(errors) }
    }

    /// A catalog of every package that is found, and why libraries are left out.
    #[must_use]
    pub fn everything(search: &SearchPath) -> (Self, Vec<CatalogError>) {
        let mut catalog = Self::new();
        let add = |(path, _): &(PathBuf, Manifest)| catalog.add(&path.display().to_string(), search).err();
        let left_out = search.packages().iter().filter_map(add).collect();
        (catalog, left_out)
    }

    /// Adds a library that is looked for on the search path; `request` is a name or the path of a file. A file that is
    /// already in the catalog is not added again. All its element types are read.
    ///
    /// # Errors
    /// See [`CatalogError`]; the catalog is then as before.
    pub fn add(&mut self, request: &str, search: &SearchPath) -> Result<Arc<LibraryInfo>, CatalogError> {
        let before = self.libraries.len();
        let info = self.add_request(&Request::named(request), search)?;
        let read = |entry: &Entry| entry.types.iter().try_for_each(|one| one.handle(&entry.info).map(|_| ()));
        let read = self.libraries[before..].iter().try_for_each(read);
        if let Err(error) = read {
            self.libraries.truncate(before);
            return Err(error);
        }
        Ok(info)
    }

    /// The same for a request that may be pinned to versions or to a content; an element type is read when it is asked for. A
    /// choice between different libraries of the same name adds a note to [`Catalog::warnings`].
    ///
    /// # Errors
    /// See [`CatalogError`]; the catalog is then as before.
    #[cfg(feature = "abi")]
    pub fn add_request(&mut self, request: &Request, search: &SearchPath) -> Result<Arc<LibraryInfo>, CatalogError> {
        self.search = search.clone();
        let choice = search.choose(request)?;
        let path = choice.found.path.clone();
        let expected = request.sha256.as_deref().or(choice.found.sha256.as_deref());
        let side = match &choice.found {
            found if !found.is_trusted(request) => Side::Glass,
            found if is_glass_up() && found.is_own() => Side::Own,
            _ => Side::Here,
        };
        let load = || loader::load(&path, self.copies.as_deref(), expected, side);
        let opened = match &self.watchdog {
            Some(watchdog) => watchdog.load(&path.display().to_string(), load),
            None => load(),
        }?;
        let same = |entry: &&Entry| entry.info.sha256.is_some() && entry.info.sha256 == opened.info.sha256;
        if let Some(known) = self.libraries.iter().find(same) {
            return Ok(Arc::clone(&known.info));
        }
        let info = self.insert(opened.info, opened.offers)?;
        self.warnings.extend(opened.warnings);
        self.warnings.extend(choice.note(request));
        Ok(info)
    }

    /// Without the feature `abi` nothing can be loaded.
    ///
    /// # Errors
    /// [`CatalogError::NoLoader`], always.
    #[cfg(not(feature = "abi"))]
    pub fn add_request(&mut self, request: &Request, search: &SearchPath) -> Result<Arc<LibraryInfo>, CatalogError> {
        self.search = search.clone();
        Err(CatalogError::NoLoader { request: request.name.clone() })
    }

    /// Adds a library that is linked into this program. Panics of its elements are caught as for a loaded one.
    ///
    /// # Errors
    /// [`CatalogError::DuplicatePackage`].
    pub fn add_library(&mut self, library: Library) -> Result<Arc<LibraryInfo>, CatalogError> {
        let elements = library.classes.iter().map(|class| {
            let descriptor = class.descriptor();
            ManifestElement { kind: descriptor.kind.word().into(), name: descriptor.name.clone() }
        });
        let info = LibraryInfo {
            elements: elements.collect(),
            package: library.package,
            version: library.version,
            about: library.about,
            path: None,
            sha256: None,
            glass: false,
            abi: ABI,
            conventions: CONVENTIONS,
            interface: INTERFACE.into(),
            profile: Profile::OWN,
            features: Vec::new(),
        };
        let offers = library.classes.into_iter().map(|class| Arc::new(Offer::of(Arc::from(fence::class(class)))));
        self.insert(info, offers.collect())
    }

    /// Without the feature `abi` nothing can be loaded.
    ///
    /// # Errors
    /// [`CatalogError::NoLoader`], always.
    #[cfg(not(feature = "abi"))]
    pub fn fmu(&self, _: &std::path::Path, written: &str) -> Result<ElementHandle, CatalogError> {
        Err(CatalogError::NoLoader { request: written.into() })
    }

    fn insert(&mut self, info: LibraryInfo, offers: Vec<Arc<Offer>>) -> Result<Arc<LibraryInfo>, CatalogError> {
        if let Some(known) = self.libraries.iter().find(|entry| entry.info.package == info.package) {
            return Err(CatalogError::DuplicatePackage {
                package: info.package.clone(),
                first: known.info.origin(),
                second: info.origin(),
            });
        }
        let offered = |offer| Type { offer, class: Arc::default(), watchdog: self.watchdog.clone() };
        let types = offers.into_iter().map(offered).collect();
        let info = Arc::new(info);
        self.libraries.push(Entry { info: Arc::clone(&info), types });
        Ok(info)
    }

    /// The element type of this name, full or short. With `kind`, only types of this kind are meant.
    ///
    /// # Errors
    /// [`CatalogError::UnknownType`], [`CatalogError::AmbiguousType`] or [`CatalogError::WrongKind`].
    pub fn find(&self, name: &str, kind: Option<Kind>) -> Result<ElementHandle, CatalogError> {
        let (package, short) = match name.split_once('/') {
            Some((package, short)) => (Some(package), short),
            None => (None, name),
        };
        let named: Vec<(&Type, &Arc<LibraryInfo>)> = self
            .types()
            .filter(|(one, library)| one.offer.name() == short && package.is_none_or(|p| library.package == p))
            .collect();
        let mut fitting = named.iter().filter(|(one, _)| one.offer.is(kind));
        match (fitting.next(), fitting.next()) {
            (Some((only, library)), None) => only.handle(library),
            (Some(_), Some(_)) => Err(CatalogError::AmbiguousType {
                name: name.into(),
                candidates: named
                    .iter()
                    .filter(|(one, _)| one.offer.is(kind))
                    .map(|(one, library)| format!("{}/{}", library.package, one.offer.name()))
                    .collect(),
            }),
            (None, _) => Err(match named.first() {
                Some((other, _)) => CatalogError::WrongKind {
                    name: name.into(),
                    expected: kind.map_or("element", Kind::word),
                    found: other.offer.kind().into(),
                },
                None => self.unknown(name, package, short, kind),
            }),
        }
    }

    /// Why a name may be unknown: mistyped, or from a library that isn't loaded.
    fn unknown(&self, name: &str, package: Option<&str>, short: &str, kind: Option<Kind>) -> CatalogError {
        let known = self.types().filter(|(one, _)| one.offer.is(kind));
        let mut words: Vec<String> = known.map(|(one, _)| one.offer.name().to_string()).collect();
        words.sort();
        words.dedup();
        let provider = self.search.provider(package, short).filter(|(manifest, _)| !self.has(&manifest.package));
        CatalogError::UnknownType {
            name: name.into(),
            nearest: suggest(short, words.iter().map(String::as_str)),
            provided_by: provider.map(|(manifest, path)| (manifest.package, path)),
            known: words,
        }
    }

    fn has(&self, package: &str) -> bool {
        self.libraries.iter().any(|entry| entry.info.package == package)
    }

    fn types(&self) -> impl Iterator<Item = (&Type, &Arc<LibraryInfo>)> {
        self.libraries.iter().flat_map(|entry| entry.types.iter().map(move |one| (one, &entry.info)))
    }

    /// All element types that their libraries give, library after library in the order of loading.
    pub fn elements(&self) -> impl Iterator<Item = ElementHandle> + '_ {
        self.types().filter_map(|(one, library)| one.handle(library).ok())
    }

    /// The libraries in the order of loading.
    pub fn libraries(&self) -> impl Iterator<Item = &LibraryInfo> + '_ {
        self.libraries.iter().map(|entry| &*entry.info)
    }

    /// What the user should know about the loaded libraries.
    #[must_use]
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }
}

impl LibraryInfo {
    /// The file, or `linked into this program`.
    #[must_use]
    pub fn origin(&self) -> String {
        self.path.as_ref().map_or_else(|| "linked into this program".into(), |path| path.display().to_string())
    }
}
