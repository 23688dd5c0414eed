//! A library as a file: what can be learned from its bytes without running anything.
//!
//! Opening a library runs code of its author, and opening a damaged one ends the process. So the file is parsed first,
//! and its manifest is read from its section.

use std::env::consts::DLL_SUFFIX;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use element_api::manifest::{Manifest, SECTION, SECTION_MACH_O};
use object::read::{Object, ObjectKind, ObjectSection, ObjectSegment, ReadCache, ReadRef};
use object::{Architecture, BinaryFormat};

use super::{CatalogError, element_file};

/// The manifest of a library file. Only the parts of the file that say where it is are read.
///
/// # Errors
/// [`CatalogError::NotALibrary`], [`CatalogError::NoManifest`] or [`CatalogError::BadManifest`].
pub fn read_manifest(path: &Path) -> Result<Manifest, CatalogError> {
    if element_file::is_one(path) {
        return element_file::manifest(path, &element_file::bytes(path)?);
    }
    let file = File::open(path).map_err(|error| not_read(path, &error))?;
    let cache = ReadCache::new(file);
    manifest(path, &cache)
}

/// The libraries of elements in a folder, by file name. Files without a manifest are left out, as are folders in it.
#[must_use]
pub fn scan(folder: &Path) -> Vec<(PathBuf, Result<Manifest, CatalogError>)> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.to_str().is_some_and(|p| p.ends_with(DLL_SUFFIX)) || element_file::is_one(path))
        .filter(|path| path.is_file())
        .collect();
    paths.sort();
    let manifests = paths.into_iter().map(|path| {
        let manifest = read_manifest(&path);
        (path, manifest)
    });
    let foreign =
        |error: &CatalogError| matches!(error, CatalogError::NoManifest { .. } | CatalogError::NotALibrary { .. });
    manifests.filter(|(_, manifest)| !manifest.as_ref().is_err_and(foreign)).collect()
}

/// The manifest of a file that is whole and for this machine.
pub(super) fn manifest<'data, R: ReadRef<'data>>(path: &Path, data: R) -> Result<Manifest, CatalogError> {
    if element_file::is_one(path) {
        let bytes = data.len().and_then(|length| data.read_bytes_at(0, length));
        return element_file::manifest(path, bytes.map_err(|()| not_a_library(path, "it can't be read"))?);
    }
    own_manifest(path, manifest_section(path, data)?)
}

/// The section with the manifests of a library file. Only the parts of the file that say where it is are read.
///
/// # Errors
/// [`CatalogError::NotALibrary`] or [`CatalogError::NoManifest`].
pub(super) fn section_of(path: &Path) -> Result<Vec<u8>, CatalogError> {
    let file = File::open(path).map_err(|error| not_read(path, &error))?;
    let cache = ReadCache::new(file);
    manifest_section(path, &cache).map(<[u8]>::to_vec)
}

/// The section with the manifests of a library that is whole and for this machine.
fn manifest_section<'data, R: ReadRef<'data>>(path: &Path, data: R) -> Result<&'data [u8], CatalogError> {
    let section = section(data).map_err(|reason| not_a_library(path, reason))?;
    section.ok_or_else(|| CatalogError::NoManifest { path: path.into() })
}

/// A library's own manifest among those of its section.
pub(super) fn own_manifest(path: &Path, section: &[u8]) -> Result<Manifest, CatalogError> {
    let bad = |reason| CatalogError::BadManifest { path: path.into(), reason };
    let mut manifests = Manifest::parse(section).map_err(bad)?;
    // A library that links other libraries of elements holds their manifests too. Its own is the one of its file name;
    // of a renamed file, the first, since compilers link a crate's own code first.
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let own = manifests.iter().position(|m| {
        let krate = m.package.replace('-', "_");
        stem == krate || stem.strip_prefix("lib") == Some(&krate)
    });
    Ok(manifests.swap_remove(own.unwrap_or(0)))
}

fn not_a_library(path: &Path, reason: impl ToString) -> CatalogError {
    CatalogError::NotALibrary { path: path.into(), unread: false, reason: reason.to_string() }
}

/// A file that the system does not let be read.
pub(super) fn not_read(path: &Path, error: &io::Error) -> CatalogError {
    CatalogError::NotALibrary { path: path.into(), unread: true, reason: error.to_string() }
}

/// The section with the manifest, of a file that is a whole library for this machine.
fn section<'data, R: ReadRef<'data>>(data: R) -> Result<Option<&'data [u8]>, String> {
    let length = data.len().map_err(|()| "it can't be read".to_string())?;
    if length == 0 {
        return Err("it is empty".into());
    }
    let file = object::File::parse(data).map_err(|error| format!("{error}; it may be truncated"))?;
    if file.format() != native_format() {
        return Err(format!("it is a {:?} file", file.format()));
    }
    if file.kind() != ObjectKind::Dynamic {
        return Err("it is not a dynamic library".into());
    }
    if native_architecture().is_some_and(|own| own != file.architecture()) {
        return Err(format!("it is for {:?} processors", file.architecture()));
    }
    // The loader of the system maps the segments without looking at the length of the file.
    let fits = |(offset, size): (u64, u64)| offset.checked_add(size).is_some_and(|end| end <= length);
    if !file.segments().all(|segment| fits(segment.file_range())) {
        return Err("it is truncated".into());
    }
    let section = file.section_by_name(SECTION).or_else(|| file.section_by_name(SECTION_MACH_O));
    section.map(|section| section.data().map_err(|_| "it is truncated".to_string())).transpose()
}

const fn native_format() -> BinaryFormat {
    if cfg!(windows) {
        BinaryFormat::Pe
    } else if cfg!(target_vendor = "apple") {
        BinaryFormat::MachO
    } else {
        BinaryFormat::Elf
    }
}

/// `None` where the names of the two worlds are not matched up here; the loader of the system then decides.
fn native_architecture() -> Option<Architecture> {
    match std::env::consts::ARCH {
        "x86_64" => Some(Architecture::X86_64),
        "x86" => Some(Architecture::I386),
        "aarch64" => Some(Architecture::Aarch64),
        _ => None,
    }
}
