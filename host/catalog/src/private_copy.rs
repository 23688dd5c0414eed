//! Private copies of libraries, named after their content.
//!
//! A library that is overwritten while it is in use (by the next build, say) crashes the program, and one that is
//! exchanged between the check and the loading was not checked. So what was checked is written where nobody else writes,
//! and that is loaded.

use std::env::consts::DLL_SUFFIX;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime};

use super::hash::{PIECE, sha256_of_pieces};
use super::search::user_folders;

/// Copies that were not used for this long are removed.
const KEPT: Duration = Duration::from_secs(14 * 24 * 3600);
/// Copies younger than this are not marked as used: their times stay, by which they are known (`known.rs`).
const FRESH: Duration = Duration::from_secs(24 * 3600);

/// A private copy of a library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PrivateCopy {
    pub(super) path: PathBuf,
    /// The hash of its content, in hexadecimal digits.
    pub(super) sha256: String,
}

/// The copy of a library in `folder`, if one is given, else in the user's cache folder, or, where there is none, in a new folder for
/// temporary files. `likely`: the hash that its content has, where that was looked at before.
pub(super) fn private_copy(library: &Path, folder: Option<&Path>, likely: Option<&str>) -> io::Result<PrivateCopy> {
    if let Some(folder) = folder {
        return copy_into(folder, library, likely);
    }
    for folder in copy_folders(None) {
        if let Ok(copy) = copy_into(&folder, library, likely) {
            return Ok(copy);
        }
    }
    copy_into(&temporary_folder()?, library, likely)
}

/// Where copies are kept from start to start: in `folder`, if one is given, else in the user's cache.
pub(super) fn copy_folders(folder: Option<&Path>) -> Vec<PathBuf> {
    folder.map_or_else(|| user_folders("XDG_CACHE_HOME", "LOCALAPPDATA", &[".cache"]), |folder| vec![folder.into()])
}

/// The name of the copy of a content.
pub(super) fn name(sha256: &str) -> String {
    format!("{sha256}{DLL_SUFFIX}")
}

/// Copies the library unless a copy is there already. It is read once, in pieces that are hashed and written while a cache holds them;
/// only where a copy is likely to be there it is looked for first.
pub(super) fn copy_into(folder: &Path, library: &Path, likely: Option<&str>) -> io::Result<PrivateCopy> {
    fs::create_dir_all(folder)?;
    if let Some(found) = likely.and_then(|sha256| found(folder, sha256, library)) {
        return Ok(found);
    }
    let draft = draft_of(&folder.join(name("library")));
    let copied = File::create(&draft)
        .and_then(|mut file| sha256_of_pieces(library, |piece| file.write_all(piece)))
        .and_then(|sha256| {
            if let Some(found) = found(folder, &sha256, &draft) {
                fs::remove_file(&draft)?;
                return Ok(found);
            }
            let path = folder.join(name(&sha256));
            fs::rename(&draft, &path)?;
            remove_old(folder, SystemTime::now());
            Ok(PrivateCopy { path, sha256 })
        });
    if copied.is_err() {
        let _ = fs::remove_file(&draft);
    }
    copied
}

/// The copy of the content that a file with this hash has, if it is there and whole.
fn found(folder: &Path, sha256: &str, like: &Path) -> Option<PrivateCopy> {
    let path = folder.join(name(sha256));
    if !same_bytes(&path, like).unwrap_or(false) {
        return None;
    }
    let now = SystemTime::now();
    let age = fs::metadata(&path).and_then(|data| data.modified()).map(|then| now.duration_since(then));
    if !age.is_ok_and(|age| age.is_ok_and(|age| age < FRESH)) {
        // Not essential: it only keeps the copy from being taken for an old one.
        let _ = File::options().write(true).open(&path).and_then(|file| file.set_modified(now));
    }
    Some(PrivateCopy { path, sha256: sha256.into() })
}

/// Whether two files have exactly the same bytes.
fn same_bytes(one: &Path, other: &Path) -> io::Result<bool> {
    let (one, other) = (File::open(one)?, File::open(other)?);
    if one.metadata()?.len() != other.metadata()?.len() {
        return Ok(false);
    }
    let [mut one, mut other] = [one, other].map(|file| BufReader::with_capacity(PIECE, file));
    loop {
        let (a, b) = (one.fill_buf()?, other.fill_buf()?);
        let length = a.len().min(b.len());
        if length == 0 || a[..length] != b[..length] {
            return Ok(a.is_empty() && b.is_empty());
        }
        one.consume(length);
        other.consume(length);
    }
}

/// A name beside a file that nobody else writes to.
fn draft_of(path: &Path) -> PathBuf {
    path.with_extension(format!("{}.{:?}.draft", std::process::id(), std::thread::current().id()))
}

/// Writes a file under another name and renames it, so that no other process ever sees half of it.
pub(super) fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let draft = draft_of(path);
    let written =
        File::create(&draft).and_then(|mut file| file.write_all(bytes)).and_then(|()| fs::rename(&draft, path));
    if written.is_err() {
        let _ = fs::remove_file(&draft);
    }
    written
}

/// Removes what has not been used lately; whatever can't be removed stays.
pub(super) fn remove_old(folder: &Path, now: SystemTime) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.filter_map(Result::ok) {
        let modified = entry.metadata().and_then(|data| data.modified());
        if modified.is_ok_and(|then| now.duration_since(then).is_ok_and(|age| age > KEPT)) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A folder of this process among the temporary files. Others write there too, so it must be new and closed to them.
fn temporary_folder() -> io::Result<PathBuf> {
    static FOLDER: Mutex<Option<PathBuf>> = Mutex::new(None);
    let mut folder = FOLDER.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = &*folder {
        return Ok(known.clone());
    }
    let time = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_nanos();
    let path = std::env::temp_dir().join(format!("odyn-plugins-{}-{time}", std::process::id()));
    create_closed(&path)?;
    *folder = Some(path.clone());
    Ok(path)
}

#[cfg(unix)]
fn create_closed(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    fs::DirBuilder::new().mode(0o700).create(path)
}

#[cfg(not(unix))]
fn create_closed(path: &Path) -> io::Result<()> {
    fs::create_dir(path)
}
