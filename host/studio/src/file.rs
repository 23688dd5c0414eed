//! [`SceneFile`]: the file that the user pointed to. It is read at every look and replaced as a whole when it is saved.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use odyn_diagnostics::{Diagnostic, codes};
use odyn_run::results::checksum;

/// A scene begun from nothing.
const NEW: &str = include_str!("new.toml");

/// The scene file of a studio.
pub(crate) struct SceneFile {
    path: Option<PathBuf>,
}

/// What is in a scene file.
#[derive(Debug)]
pub(crate) struct Content {
    pub(crate) text: String,
    /// SHA-256 of the bytes on the disk; empty where there is no file yet.
    pub(crate) version: String,
}

/// Why a text was not saved.
#[derive(Debug)]
pub(crate) enum NotSaved {
    /// The file has changed since it was read: what is in it now.
    Changed(Content),
    /// In words.
    Failed(String),
}

impl SceneFile {
    pub(crate) fn new(path: Option<PathBuf>) -> Self {
        Self { path }
    }

    /// As the user gave it.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Where the file is, or would be: what the text names is looked for from there.
    pub(crate) fn place(&self) -> &Path {
        self.path().unwrap_or(Path::new("untitled.toml"))
    }

    /// The text on the disk, or a new one.
    pub(crate) fn read(&self) -> Result<Content, Diagnostic> {
        let new = || Content { text: NEW.into(), version: String::new() };
        let Some(path) = self.path() else { return Ok(new()) };
        match fs::read(path) {
            Ok(bytes) => {
                let version = checksum(&bytes);
                let unreadable =
                    |_| Diagnostic::error(codes::UNREADABLE, format!("`{}` is not UTF-8 text", path.display()));
                Ok(Content { text: String::from_utf8(bytes).map_err(unreadable)?, version })
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(new()),
            Err(error) => {
                Err(Diagnostic::error(codes::UNREADABLE, format!("cannot read `{}`: {error}", path.display())))
            }
        }
    }

    /// Replaces the file, unless it is another than `version` by now; gives the version saved. At every moment the file has either
    /// the old text or the new one.
    pub(crate) fn save(&self, text: &str, version: &str) -> Result<String, NotSaved> {
        let Some(path) = self.path() else {
            return Err(NotSaved::Failed(
                "the studio was started without a file; start it with one, or keep the text by \
                                         \"Save as file\""
                    .into(),
            ));
        };
        let failed = |error: io::Error| NotSaved::Failed(format!("cannot write `{}`: {error}", path.display()));
        // What a link leads to is replaced, not the link.
        let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let now = match fs::read(&path) {
            Ok(bytes) => Some(bytes),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(failed(error)),
        };
        let found = now.as_deref().map_or_else(String::new, checksum);
        if found != version {
            let text = String::from_utf8_lossy(&now.unwrap_or_default()).into_owned();
            return Err(NotSaved::Changed(Content { text, version: found }));
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut written = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
        written.write_all(text.as_bytes()).and_then(|()| written.as_file().sync_all()).map_err(failed)?;
        // Who may read it stays as it was.
        let permissions = fs::metadata(&path).map(|data| data.permissions()).ok();
        if let Some(permissions) = permissions.or_else(ordinary) {
            fs::set_permissions(written.path(), permissions).map_err(failed)?;
        }
        written.persist(&path).map_err(|error| failed(error.error))?;
        Ok(checksum(text.as_bytes()))
    }
}

/// Who may read a new file: a temporary file is for its owner only.
#[cfg(unix)]
fn ordinary() -> Option<fs::Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn ordinary() -> Option<fs::Permissions> {
    None
}
