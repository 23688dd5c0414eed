//! [`Package`]: a library with all that belongs to it, as one file.
//!
//! The file is a `tar` archive, compressed by `gzip`, so that anybody can look into it without this program. It holds
//! plain files only, sorted by name, without times and owners: the same content gives the same bytes.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use super::CatalogError;
use super::file::{manifest, not_read};
use super::hash::sha256;
use super::package::{ELEMENTS_FILE, INFO_FILE, LARGEST, MOST_FILES, PackageInfo, check_file_name};

/// A package in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// What it says about itself.
    pub info: PackageInfo,
    /// The content of its files by name, all but `plugin.toml`.
    pub(super) files: BTreeMap<String, Vec<u8>>,
}

impl Package {
    /// A package of a library of this machine. `elements` becomes `elements.json`; `more` are other files (documentation,
    /// licence) by name. Nothing is run.
    ///
    /// # Errors
    /// The library cannot be read, or names, version or sizes are not those of a package.
    pub fn new(library: &Path, elements: String, more: Vec<(String, Vec<u8>)>) -> Result<Self, CatalogError> {
        let bad = |reason: String| CatalogError::BadPackage { path: library.into(), reason };
        let bytes = fs::read(library).map_err(|error| not_read(library, &error))?;
        let manifest = manifest(library, bytes.as_slice())?;
        let name = library.file_name().and_then(|name| name.to_str());
        let name = name.ok_or_else(|| bad("its file name is no text".into()))?.to_string();
        let mut files = BTreeMap::from([(name.clone(), bytes), (ELEMENTS_FILE.to_string(), elements.into_bytes())]);
        for (name, content) in more {
            check_file_name(&name).map_err(bad)?;
            if files.insert(name.clone(), content).is_some() {
                return Err(bad(format!("two files are called `{name}`")));
            }
        }
        if files.values().map(|content| content.len() as u64).sum::<u64>() > LARGEST {
            return Err(bad(too_large()));
        }
        let hashes = files.iter().map(|(name, content)| (name.clone(), sha256(content))).collect();
        let info = PackageInfo::new(&manifest, &name, hashes).map_err(bad)?;
        Ok(Self { info, files })
    }

    /// Reads a file; whatever it holds, nothing is written and nothing is run.
    ///
    /// # Errors
    /// [`CatalogError::BadPackage`]: the file is no package, or not the one that was made: files are missing, changed, too
    /// many, too large, no plain files, or called so that they would leave their folder.
    pub fn read(path: &Path) -> Result<Self, CatalogError> {
        let bad = |reason: String| CatalogError::BadPackage { path: path.into(), reason };
        let unreadable = |error: io::Error| bad(format!("it cannot be read: {error}"));
        // Before it is opened: opening a pipe waits for its other end.
        let data = fs::metadata(path).map_err(unreadable)?;
        if !data.is_file() || data.len() > LARGEST {
            return Err(bad(too_large()));
        }
        let file = File::open(path).map_err(unreadable)?;
        Self::from_reader(io::BufReader::new(file)).map_err(bad)
    }

    /// Reads the bytes of a package; the error is in words.
    pub(super) fn from_reader(bytes: impl Read) -> Result<Self, String> {
        let mut files = unpack(bytes)?;
        let info = files.remove(INFO_FILE).ok_or_else(|| format!("it has no `{INFO_FILE}`"))?;
        let info = String::from_utf8(info).map_err(|_| format!("its `{INFO_FILE}` is not UTF-8 text"))?;
        let info = PackageInfo::parse(&info).map_err(|reason| format!("its `{INFO_FILE}` cannot be used: {reason}"))?;
        let package = Self { info, files };
        if let Some(stray) = package.files.keys().find(|name| !package.info.files.contains_key(*name)) {
            return Err(format!("its `{INFO_FILE}` does not name the file `{stray}`"));
        }
        for (name, expected) in &package.info.files {
            let content = package.files.get(name).ok_or_else(|| format!("the file `{name}` is missing"))?;
            if sha256(content) != *expected {
                return Err(format!("the file `{name}` was changed: its SHA-256 is not the one of `{INFO_FILE}`"));
            }
        }
        Ok(package)
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// Names that do not fit into the archive.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let info = self.info.to_toml().into_bytes();
        let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
        // What describes the others comes first, for those who look into it.
        for (name, content) in std::iter::once((INFO_FILE, &info)).chain(self.contents()) {
            let mut header = tar::Header::new_ustar();
            header.set_path(name)?;
            header.set_size(content.len() as u64);
            header.set_mode(0o644);
            header.set_uid(0);
            header.set_gid(0);
            header.set_mtime(0);
            header.set_cksum();
            archive.append(&header, content.as_slice())?;
        }
        archive.into_inner()?.finish()
    }

    /// The files but `plugin.toml`, by name.
    fn contents(&self) -> impl Iterator<Item = (&str, &Vec<u8>)> {
        self.files.iter().map(|(name, content)| (name.as_str(), content))
    }

    /// The bytes of the library.
    pub(super) fn library(&self) -> &[u8] {
        self.files.get(&self.info.library).map_or(&[], Vec::as_slice)
    }

    /// Writes all files into a folder that is there and empty.
    pub(super) fn write_into(&self, folder: &Path) -> io::Result<()> {
        let info = self.info.to_toml().into_bytes();
        for (name, content) in std::iter::once((INFO_FILE, &info)).chain(self.contents()) {
            let path = folder.join(name);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            let mut file = File::options().write(true).create_new(true).open(&path)?;
            file.write_all(content)?;
            file.sync_all()?;
        }
        Ok(())
    }
}

/// The plain files of a compressed archive, if it holds nothing else.
fn unpack(bytes: impl Read) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let broken = |error: io::Error| format!("it is no package, or damaged: {error}");
    // Headers and padding take some more than the files.
    let mut archive = tar::Archive::new(GzDecoder::new(bytes).take(2 * LARGEST));
    let mut files = BTreeMap::new();
    let mut size = 0_u64;
    // Raw: extensions of the format, which may rename files, are seen as what they are, and refused.
    for entry in archive.entries().map_err(broken)?.raw(true) {
        let mut entry = entry.map_err(broken)?;
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        if entry.header().entry_type() != tar::EntryType::Regular {
            return Err(format!("`{}` is not a plain file", name.escape_debug()));
        }
        check_file_name(&name)?;
        size = size.saturating_add(entry.size());
        if size > LARGEST {
            return Err(too_large());
        }
        if files.len() > MOST_FILES {
            return Err(format!("it has more than {MOST_FILES} files"));
        }
        let mut content = Vec::new();
        entry.read_to_end(&mut content).map_err(broken)?;
        if content.len() as u64 != entry.size() {
            return Err(format!("it is truncated in `{name}`"));
        }
        if files.insert(name.clone(), content).is_some() {
            return Err(format!("it has two files `{name}`"));
        }
    }
    // To the end, where the checksum of the whole is.
    io::copy(&mut archive.into_inner(), &mut io::sink()).map_err(broken)?;
    Ok(files)
}

fn too_large() -> String {
    format!("it is no file, or larger than {} MB", LARGEST >> 20)
}
