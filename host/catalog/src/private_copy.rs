//! Private copies of libraries, named after their content.
//!
//! A library that is overwritten while it is in use (by the next build, say) crashes the program, and one that is
//! exchanged between the check and the loading was not checked. So what was checked is written where nobody else writes,
//! and that is loaded.

use std::env::consts::DLL_SUFFIX;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime};

use super::search::user_folders;

/// Copies that were not used for this long are removed.
const KEPT: Duration = Duration::from_secs(14 * 24 * 3600);
/// Copies younger than this are not marked as used: their times stay, by which they are known (`known.rs`).
const FRESH: Duration = Duration::from_secs(24 * 3600);
/// Bytes compared at a time; about what stays in a processor's cache.
const PIECE: usize = 128 * 1024;

/// The path of a file with exactly these bytes in `folder`, if one is given, else in the user's cache folder, or, where
/// there is none, in a new folder for temporary files. `sha256`: their hash in hexadecimal digits.
pub(super) fn private_copy(bytes: &[u8], sha256: &str, folder: Option<&Path>) -> io::Result<PathBuf> {
    if let Some(folder) = folder {
        return copy_into(folder, bytes, sha256);
    }
    for folder in copy_folders(None) {
        if let Ok(path) = copy_into(&folder, bytes, sha256) {
            return Ok(path);
        }
    }
    copy_into(&temporary_folder()?, bytes, sha256)
}

/// Where copies are kept from start to start: in `folder`, if one is given, else in the user's cache.
pub(super) fn copy_folders(folder: Option<&Path>) -> Vec<PathBuf> {
    folder.map_or_else(|| user_folders("XDG_CACHE_HOME", "LOCALAPPDATA", &[".cache"]), |folder| vec![folder.into()])
}

/// The name of the copy of a content.
pub(super) fn name(sha256: &str) -> String {
    format!("{sha256}{DLL_SUFFIX}")
}

/// Writes the copy unless it is there already.
pub(super) fn copy_into(folder: &Path, bytes: &[u8], sha256: &str) -> io::Result<PathBuf> {
    fs::create_dir_all(folder)?;
    let path = folder.join(name(sha256));
    if holds(&path, bytes) {
        let now = SystemTime::now();
        let age = fs::metadata(&path).and_then(|data| data.modified()).map(|then| now.duration_since(then));
        if !age.is_ok_and(|age| age.is_ok_and(|age| age < FRESH)) {
            // Not essential: it only keeps the copy from being taken for an old one.
            let _ = File::options().write(true).open(&path).and_then(|file| file.set_modified(now));
        }
        return Ok(path);
    }
    put(&path, bytes)?;
    remove_old(folder, SystemTime::now());
    Ok(path)
}

/// Writes a file under another name and renames it, so that no other process ever sees half of it.
pub(super) fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let draft = path.with_extension(format!("{}.{:?}.draft", std::process::id(), std::thread::current().id()));
    let written =
        File::create(&draft).and_then(|mut file| file.write_all(bytes)).and_then(|()| fs::rename(&draft, path));
    if written.is_err() {
        let _ = fs::remove_file(&draft);
    }
    written
}

/// Whether a file has exactly these bytes. Read in pieces: libraries are large, and this is done at every start.
fn holds(path: &Path, bytes: &[u8]) -> bool {
    let Ok(mut file) = File::open(path) else { return false };
    if !file.metadata().is_ok_and(|data| data.len() == bytes.len() as u64) {
        return false;
    }
    let mut piece = vec![0; PIECE];
    let mut rest = bytes;
    loop {
        match file.read(&mut piece) {
            Ok(0) => return rest.is_empty(),
            Ok(n) if rest.get(..n) == Some(&piece[..n]) => rest = &rest[n..],
            Ok(_) => return false,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return false,
        }
    }
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
