//! Libraries whose content is known from an earlier start: they are not read again. What they say of themselves is kept, too.
//!
//! A file with the same place on the disk, size, time of its last change and time of the last change of what the system keeps
//! of it (`ctime`, which nobody can set) has the content that was hashed. The same holds for its private copy. Where either
//! differs, or the content itself is asked about (a pin), everything is read and compared as at the first start.

use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::time::Duration;

use element_api::manifest::Manifest;

use super::file::own_manifest;
use super::private_copy::{copy_folders, name, put};

/// Files that were changed less long ago are not taken as known: a second change may bear the same time.
const SETTLED: Duration = Duration::from_secs(2);

/// What distinguishes a state of a file from all others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity(String);

/// A library whose content is known.
pub(super) struct Known {
    pub(super) sha256: String,
    /// Its private copy.
    pub(super) copy: PathBuf,
    /// What it says of itself.
    pub(super) manifest: Manifest,
}

impl std::fmt::Display for Identity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Identity {
    /// That of a file; `None` where the system has none.
    #[cfg(unix)]
    pub(super) fn of(path: &Path) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        let data: Metadata = fs::metadata(path).ok()?;
        let changed = (data.mtime(), data.mtime_nsec(), data.ctime(), data.ctime_nsec());
        Some(Self(format!(
            "{}-{}-{}-{}.{:09}-{}.{:09}",
            data.dev(),
            data.ino(),
            data.len(),
            changed.0,
            changed.1,
            changed.2,
            changed.3
        )))
    }

    #[cfg(not(unix))]
    pub(super) fn of(_: &Path) -> Option<Self> {
        None
    }

    fn entry(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.known", self.0))
    }
}

/// Whether a file was not changed lately.
#[cfg(unix)]
fn is_settled(path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    use std::time::{SystemTime, UNIX_EPOCH};
    let Ok(data) = fs::metadata(path) else { return false };
    let last = data.mtime().max(data.ctime());
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(last).is_ok_and(|last| now.as_secs() > last + SETTLED.as_secs())
}

#[cfg(not(unix))]
fn is_settled(_: &Path) -> bool {
    false
}

/// What is known of a library whose private copies are in `copies`, or in the user's cache folder.
pub(super) fn find(path: &Path, copies: Option<&Path>) -> Option<Known> {
    let identity = Identity::of(path)?;
    let text = copy_folders(copies).iter().find_map(|folder| {
        let text = fs::read_to_string(identity.entry(folder)).ok()?;
        Some((folder.clone(), text))
    });
    let (folder, text) = text?;
    let (first, section) = text.split_once('\n')?;
    let (sha256, copy_identity) = first.split_once(' ')?;
    let copy = folder.join(name(sha256));
    if Identity::of(&copy)?.0 != copy_identity {
        return None;
    }
    let manifest = own_manifest(path, section.as_bytes()).ok()?;
    Some(Known { sha256: sha256.into(), copy, manifest })
}

/// Notes what the content of a library is, if it still is the one that `before` was taken of, and its section with manifests. Not
/// essential.
pub(super) fn note(path: &Path, before: Option<&Identity>, (sha256, section): (&str, &[u8]), copy: &Path) {
    if is_settled(path) && before.is_some() && Identity::of(path).as_ref() == before {
        write(before, (sha256, section), copy);
    }
}

/// Keeps what the content of a file of this identity is.
pub(super) fn write(identity: Option<&Identity>, (sha256, section): (&str, &[u8]), copy: &Path) {
    let (Some(before), Some(folder), Some(copy_identity)) = (identity, copy.parent(), Identity::of(copy)) else {
        return;
    };
    let first = format!("{sha256} {}\n", copy_identity.0);
    let _ = put(&before.entry(folder), &[first.as_bytes(), section].concat());
}
