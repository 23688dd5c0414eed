//! Loading a library: everything that can be checked before its code runs is checked before.
//!
//! Order: manifest -> interface, conventions, processor -> private copy (unless known from an earlier start) -> system loader -> layout
//! -> elements.
//! A library is never unloaded: what it once gave may still be in use anywhere.

// Loading foreign code can't be expressed safely.
#![allow(unsafe_code)]

use std::collections::HashMap;
use std::ffi::OsStr;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use element_api::abi::{self, OpenError};
use element_api::manifest::{ABI, C_ABI, CONVENTIONS, EntryTable, INTERFACE, Manifest, ManifestElement, Profile};
use element_api::set::ElementClass;

use super::c_library;
use super::element_file;
use super::file::{own_manifest, section_of};
use super::float_control;
#[cfg(all(unix, feature = "glass"))]
use super::glass::Glass;
use super::hash::sha256_of;
use super::known::{self, Identity, Known};
use super::offer::Offer;
use super::private_copy::{PrivateCopy, private_copy};
use super::watchdog::wake;
use super::{CatalogError, LibraryInfo};
use odyn_diagnostics::{Diagnostic, codes};

/// A library that has been loaded.
pub(super) struct Opened {
    pub info: LibraryInfo,
    pub offers: Offers,
    pub warnings: Vec<Diagnostic>,
}

/// Where the code of a library runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Side {
    /// In a process of its own.
    Glass,
    /// In this process, if anything is asked that is not known from an earlier start: that of a library of the program itself.
    Own,
    /// In this process.
    Here,
}

/// The libraries of this process by the hash of their content, and where their code runs; a second load gives the same classes.
static LOADED: Mutex<Option<HashMap<(String, Side), Offers>>> = Mutex::new(None);

pub(super) type Offers = Vec<Arc<Offer>>;

/// Loads the library in a file; what is loaded is a private copy, in `copies` or the user's cache folder. With `expected`, only a
/// file with this SHA-256.
pub(super) fn load(
    path: &Path,
    copies: Option<&Path>,
    expected: Option<&str>,
    side: Side,
) -> Result<Opened, CatalogError> {
    if element_file::is_one(path) {
        // Data: there is no code to keep, to load or to keep away from.
        return element_file::load(path, expected);
    }
    let known = if expected.is_none() { known::find(path, copies) } else { None };
    let Known { sha256, copy, manifest } = match known {
        Some(known) => {
            check(path, &known.manifest)?;
            known
        }
        None => read(path, copies, expected)?,
    };
    let mut warnings = Vec::new();
    if manifest.profile == Profile::Debug && Profile::OWN == Profile::Release {
        let text = format!("`{}` ({}) is a debug build", manifest.package, path.display());
        warnings.push(
            Diagnostic::warning(codes::DEBUG_PLUGIN, text)
                .help("elements that are called at run time are a hundred times slower; build it with `--release`"),
        );
    }
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    let loaded = loaded.get_or_insert_with(HashMap::new);
    let offers = match loaded.get(&(sha256.clone(), side)) {
        Some(offers) => Offers::clone(offers),
        None => {
            let offers = open(path, &copy, &manifest, side, &mut warnings)?;
            loaded.insert((sha256.clone(), side), offers.clone());
            offers
        }
    };
    let info = LibraryInfo {
        package: manifest.package,
        version: manifest.version,
        about: manifest.about,
        path: Some(path.into()),
        sha256: Some(sha256),
        glass: side == Side::Glass,
        abi: manifest.abi,
        conventions: manifest.conventions,
        interface: manifest.interface,
        profile: manifest.profile,
        features: manifest.features,
        elements: manifest.elements,
    };
    Ok(Opened { info, offers, warnings })
}

/// Reads a library and makes its private copy, if what can be learned without running anything speaks for it.
fn read(path: &Path, copies: Option<&Path>, expected: Option<&str>) -> Result<Known, CatalogError> {
    // Reading may take long, too.
    wake();
    let unreadable = |reason: String| CatalogError::NotALibrary { path: path.into(), unread: true, reason };
    let before = Identity::of(path);
    let section = section_of(path)?;
    let manifest = own_manifest(path, &section)?;
    check(path, &manifest)?;
    let is_wanted = |found: &str| match expected {
        Some(expected) if expected != found => {
            Err(CatalogError::Changed { path: path.into(), found: found.into(), expected: expected.into() })
        }
        _ => Ok(()),
    };
    // Where contents are looked at again at every start, the copy is likely to be there.
    let likely = if expected.is_some() || before.is_none() { sha256_of(path) } else { None };
    likely.as_deref().map_or(Ok(()), is_wanted)?;
    let made = private_copy(path, copies, likely.as_deref());
    let PrivateCopy { path: copy, sha256 } =
        made.map_err(|error| unreadable(format!("no private copy of it can be written: {error}")))?;
    is_wanted(&sha256)?;
    // What was judged is what was copied.
    if section_of(&copy).ok().as_ref() != Some(&section) {
        return Err(unreadable("it was changed while it was read".into()));
    }
    known::note(path, before.as_ref(), (&sha256, &section), &copy);
    Ok(Known { sha256, copy, manifest })
}

/// What is known from the manifest alone.
pub(super) fn check(path: &Path, manifest: &Manifest) -> Result<(), CatalogError> {
    let (path, package) = (path.to_path_buf(), manifest.package.clone());
    let (prefix, expected) = match manifest.table {
        EntryTable::Rust => ("", ABI),
        EntryTable::C => ("c", C_ABI),
    };
    if manifest.abi != expected {
        let [found, expected] = [manifest.abi, expected].map(|version| format!("{prefix}{version}"));
        return Err(CatalogError::AbiVersion { path, package, found, expected });
    }
    // Major 1 of the contract goes with interface 1; the first libraries do not say which they are written for.
    let major = |version: &str| version.split('.').next().map(str::to_owned);
    if !manifest.interface.is_empty() && major(&manifest.interface) != major(INTERFACE) {
        let (found, expected) = (manifest.interface.clone(), INTERFACE.into());
        return Err(CatalogError::AbiVersion { path, package, found, expected });
    }
    if manifest.conventions != CONVENTIONS {
        return Err(CatalogError::Conventions { path, package, found: manifest.conventions, expected: CONVENTIONS });
    }
    let missing: Vec<String> = manifest.features.iter().filter(|f| !processor_has(f)).cloned().collect();
    if !missing.is_empty() {
        return Err(CatalogError::Processor { path, package, missing });
    }
    Ok(())
}

/// Whether this processor can do what the feature stands for; features this host doesn't know are taken on trust.
#[cfg(target_arch = "x86_64")]
fn processor_has(feature: &str) -> bool {
    match feature {
        "sse4.2" => is_x86_feature_detected!("sse4.2"),
        "avx" => is_x86_feature_detected!("avx"),
        "avx2" => is_x86_feature_detected!("avx2"),
        "fma" => is_x86_feature_detected!("fma"),
        "avx512f" => is_x86_feature_detected!("avx512f"),
        "neon" => false,
        _ => true,
    }
}

/// Whether this processor can do what the feature stands for. 64-bit ARM processors always have `neon`.
#[cfg(not(target_arch = "x86_64"))]
fn processor_has(_: &str) -> bool {
    true
}

/// Opens the private copy of a checked file.
fn open(
    path: &Path,
    copy: &Path,
    manifest: &Manifest,
    side: Side,
    warnings: &mut Vec<Diagnostic>,
) -> Result<Offers, CatalogError> {
    let package = || manifest.package.clone();
    let (offers, kept) = match side {
        Side::Glass => enter_behind_glass(path, copy, manifest),
        Side::Own => enter_when_needed(path, copy, manifest),
        Side::Here => enter(path, copy, manifest),
    };
    if !kept {
        let text = format!(
            "`{}` ({}) changed the rounding or denormal mode of the processor while it was loaded",
            manifest.package,
            path.display()
        );
        warnings.push(
            Diagnostic::warning(codes::PLUGIN_MISBEHAVED, text)
                .help("the mode was restored; the library, or one it uses, was built with -Ofast or -ffast-math"),
        );
    }
    let failed = |message: String| CatalogError::Failed { path: path.into(), package: package(), message };
    offers.map_err(|error| match error {
        OpenError::Layout(differences) => CatalogError::Layout { path: path.into(), package: package(), differences },
        OpenError::Version { host, library } => {
            CatalogError::AbiVersion { path: path.into(), package: package(), found: library, expected: host }
        }
        OpenError::Conventions(found) => {
            CatalogError::Conventions { path: path.into(), package: package(), found, expected: CONVENTIONS }
        }
        OpenError::Root(message) => failed(message),
        other => failed(other.to_string()),
    })
}

/// What a library offers, loaded into this process, and whether it left the floating-point control register as it was.
pub(super) fn enter(path: &Path, copy: &Path, manifest: &Manifest) -> (Result<Offers, OpenError>, bool) {
    wake();
    let (entry, kept) = float_control::kept(|| entry(copy, &manifest.entry));
    let entry = match entry {
        Ok(entry) => entry,
        Err(error) => return (Err(OpenError::Root(with_cause(&error))), kept),
    };
    let announced = &manifest.elements;
    let offers = match manifest.table {
        // SAFETY: the symbol that the manifest of an O-DYN library names is its header, and `entry` never unloads.
        EntryTable::Rust => unsafe { abi::open_unread(entry) }.and_then(|classes| {
            let fits = classes.len() == announced.len();
            let offers = announced.iter().zip(classes).map(|(announced, class)| {
                Arc::new(offer(announced, path, &manifest.package, move || class.read().map(Arc::from)))
            });
            fits.then(|| offers.collect()).ok_or_else(|| OpenError::Root(OTHERS.into()))
        }),
        // SAFETY: as above; the manifest says that it is the function of the C header.
        EntryTable::C => unsafe { c_library::open(entry) }.and_then(|classes| {
            let is_announced = |class: &dyn ElementClass| {
                let descriptor = class.descriptor();
                announced.iter().any(|element| element.is(descriptor.kind, &descriptor.name))
            };
            let fits = classes.len() == announced.len() && classes.iter().all(|class| is_announced(&**class));
            let offers = classes.into_iter().map(|class| Arc::new(Offer::of(Arc::from(class))));
            fits.then(|| offers.collect()).ok_or_else(|| OpenError::Root(OTHERS.into()))
        }),
    };
    (offers, kept)
}

/// The same from a process of its own.
#[cfg(all(unix, feature = "glass"))]
fn enter_behind_glass(path: &Path, copy: &Path, manifest: &Manifest) -> (Result<Offers, OpenError>, bool) {
    let (glass, kept) = Glass::enter(copy, &manifest.package);
    let offers = glass.map(|glass| {
        let offered = |(k, announced): (usize, &ManifestElement)| {
            let glass = Arc::clone(&glass);
            Arc::new(offer(announced, path, &manifest.package, move || glass.class(k)))
        };
        manifest.elements.iter().enumerate().map(offered).collect()
    });
    (offers, kept)
}

#[cfg(not(all(unix, feature = "glass")))]
fn enter_behind_glass(path: &Path, copy: &Path, manifest: &Manifest) -> (Result<Offers, OpenError>, bool) {
    enter(path, copy, manifest)
}

/// The same of a library that is loaded when something is asked of it that is not known.
#[cfg(all(unix, feature = "glass"))]
fn enter_when_needed(path: &Path, copy: &Path, manifest: &Manifest) -> (Result<Offers, OpenError>, bool) {
    let Some(program) = super::glass::program() else { return enter(path, copy, manifest) };
    let (file, own, announced) = (path.to_path_buf(), copy.to_path_buf(), manifest.clone());
    let load = move || enter(&file, &own, &announced);
    super::lazy::enter(super::kept::Kept::of(copy, program), path, manifest, load)
}

#[cfg(not(all(unix, feature = "glass")))]
fn enter_when_needed(path: &Path, copy: &Path, manifest: &Manifest) -> (Result<Offers, OpenError>, bool) {
    enter(path, copy, manifest)
}

/// Why a library is refused that offers something else than its manifest says.
const OTHERS: &str = "its elements are not the ones that its manifest names";

/// A class that is asked for its descriptor when it is needed.
pub(super) fn offer(
    announced: &ManifestElement,
    path: &Path,
    package: &str,
    read: impl Fn() -> Result<Arc<dyn ElementClass>, String> + Send + Sync + 'static,
) -> Offer {
    let (expected, path, package) = (announced.clone(), path.to_path_buf(), package.to_string());
    Offer::unread(announced.clone(), move || {
        let failed = |message: String| CatalogError::Failed { path: path.clone(), package: package.clone(), message };
        let class = read().map_err(&failed)?;
        let descriptor = class.descriptor();
        if !expected.is(descriptor.kind, &descriptor.name) {
            return Err(failed(OTHERS.into()));
        }
        Ok(class)
    })
}

/// The system's own words are in the cause.
fn with_cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |cause| format!("{error}: {cause}"))
}

/// The address of a symbol in a library that stays loaded.
fn entry(copy: &Path, symbol: &str) -> Result<*const (), libloading::Error> {
    // SAFETY: runs the initialisers of the library. That is what loading means; the file was checked as far as it can be.
    let library = unsafe { open_now(copy.as_os_str()) }?;
    // SAFETY: only the address is taken.
    let address = unsafe { library.get::<*const ()>(symbol.as_bytes()).map(|symbol| *symbol) };
    std::mem::forget(library);
    address
}

/// Resolves all symbols at once: one that is missing is an error now and not a crash later.
#[cfg(unix)]
unsafe fn open_now(path: &OsStr) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: as the caller's.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map(Into::into)
}

#[cfg(not(unix))]
unsafe fn open_now(path: &OsStr) -> Result<libloading::Library, libloading::Error> {
    // SAFETY: as the caller's.
    unsafe { libloading::Library::new(path) }
}
