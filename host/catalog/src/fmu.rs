//! FMUs as libraries with one class of elements: read, unpacked and known again; behind glass where there is glass.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use element_api::manifest::{ABI, CONVENTIONS, ManifestElement, Profile};

use super::{Catalog, CatalogError, ElementHandle, LibraryInfo, hash};

/// Largest file that is read, bytes.
const LARGEST: u64 = 2 << 30;

/// The FMUs that a catalog and its copies have read, by their files.
pub(super) type Known = Arc<Mutex<BTreeMap<PathBuf, ElementHandle>>>;

impl Catalog {
    /// The same catalog with the element type `fmu` among the others, for lists of what there is; scenes need no entry for it.
    #[must_use]
    pub fn with_fmus(mut self) -> Self {
        // A library that has taken the name stays.
        let _ = self.add_library(odyn_fmu::general());
        self
    }

    /// The element that an FMU is, `path` its file, `written` what the scene calls it. A file is read once.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged, or has an FMU that cannot be used here.
    pub fn fmu(&self, path: &Path, written: &str) -> Result<ElementHandle, CatalogError> {
        let mut known = self.fmus.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(handle) = known.get(path) {
            return Ok(handle.clone());
        }
        let unusable = |error: odyn_fmu::Unusable| CatalogError::Fmu {
            path: path.into(),
            reason: error.message,
            help: error.help,
            damaged: error.damaged,
        };
        let read = || {
            let length = std::fs::metadata(path)?.len();
            if length > LARGEST { Err(std::io::Error::other("it is larger than 2 GB")) } else { std::fs::read(path) }
        };
        let bytes = read().map_err(|error| {
            let (message, help) = (format!("it cannot be read: {error}"), String::new());
            unusable(odyn_fmu::Unusable { message, help, damaged: true })
        })?;
        let fmu = odyn_fmu::Fmu::open(&bytes).map_err(unusable)?;
        #[cfg_attr(not(all(unix, feature = "glass")), allow(unused_mut))]
        let mut class = fmu.class().map_err(unusable)?;
        #[cfg(all(unix, feature = "glass"))]
        if super::glass::is_up() {
            class = super::glass::fmu(&fmu, class, written);
        }
        let class = match &self.watchdog {
            Some(watchdog) => watchdog.class(written, class, false),
            None => class,
        };
        let description = &fmu.description;
        let or = |text: &str, other: &str| if text.is_empty() { other.to_string() } else { text.to_string() };
        let library = LibraryInfo {
            package: written.into(),
            version: or(&description.model_version, "without a version"),
            about: or(&description.about, &description.model),
            path: Some(path.into()),
            sha256: Some(hash::sha256(&bytes)),
            glass: super::is_glass_up(),
            abi: ABI,
            conventions: CONVENTIONS,
            interface: format!("FMI {}", description.fmi),
            profile: Profile::OWN,
            features: Vec::new(),
            elements: vec![ManifestElement { kind: "control".into(), name: odyn_fmu::TYPE.into() }],
        };
        let handle = ElementHandle { class, library: Arc::new(library) };
        known.insert(path.into(), handle.clone());
        Ok(handle)
    }
}
