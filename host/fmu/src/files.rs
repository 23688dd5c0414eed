//! An FMU unpacked: its description, its binary for this machine, its resources.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use element_api::set::ElementClass;
use tempfile::TempDir;

use crate::archive::Archive;
use crate::class::FmuClass;
use crate::description::{Description, LONGEST, Version};
use crate::library::Library;
use crate::{Unusable, class};

const DESCRIPTION: &str = "modelDescription.xml";

/// An FMU that was read and unpacked. Its files are removed with the last of its copies and classes.
#[derive(Clone)]
pub struct Fmu {
    /// What it says of itself.
    pub description: Arc<Description>,
    folder: PathBuf,
    /// Removes the folder, where this process unpacked it.
    _unpacked: Option<Arc<TempDir>>,
}

/// This machine, as FMI 2.0 and 3.0 call it, and the ending of its libraries.
fn platform(version: Version) -> (String, &'static str) {
    use std::env::consts::{ARCH, OS};
    let ending = match OS {
        "windows" => ".dll",
        "macos" => ".dylib",
        _ => ".so",
    };
    let bits = if cfg!(target_pointer_width = "64") { "64" } else { "32" };
    let name = match version {
        Version::Two => match OS {
            "windows" => format!("win{bits}"),
            "macos" => format!("darwin{bits}"),
            _ => format!("{OS}{bits}"),
        },
        Version::Three => {
            let system = if OS == "macos" { "darwin" } else { OS };
            format!("{ARCH}-{system}")
        }
    };
    (name, ending)
}

impl Fmu {
    /// Reads an FMU and unpacks what a run needs into a new folder for temporary files. Nothing of it is run.
    ///
    /// # Errors
    /// A file that is damaged, or none that can be used here; nothing is left on disk then.
    pub fn open(bytes: &[u8]) -> Result<Self, Unusable> {
        let archive = Archive::read(bytes)?;
        let entry = archive.find(DESCRIPTION).ok_or_else(|| {
            Unusable::damaged(format!("there is no `{DESCRIPTION}` in it: it is a zip archive, but no FMU"))
        })?;
        let text = if entry.size() > LONGEST { None } else { String::from_utf8(archive.content(entry)?).ok() };
        let text = text.ok_or_else(|| Unusable::damaged(format!("`{DESCRIPTION}` in it is too long, or not UTF-8")))?;
        let description = Description::read(&text)?;
        let binary = binary(&description);
        if archive.find(&binary).is_none() {
            return Err(missing(&archive, &description, &binary));
        }
        let failed = |error: std::io::Error| {
            Unusable::here(format!("it cannot be unpacked: {error}"), "make room for temporary files")
        };
        let folder = tempfile::Builder::new().prefix("odyn-fmu-").tempdir().map_err(failed)?;
        let below = binary.rsplit_once('/').map_or("", |(folder, _)| folder).to_string() + "/";
        let wanted = |name: &str| name == DESCRIPTION || name.starts_with(&below) || name.starts_with("resources/");
        for entry in archive.entries.iter().filter(|entry| wanted(&entry.name) && !entry.name.ends_with('/')) {
            let path = folder.path().join(&entry.name);
            let content = archive.content(entry)?;
            path.parent()
                .map_or(Ok(()), fs::create_dir_all)
                .and_then(|()| fs::write(&path, content))
                .map_err(failed)?;
        }
        fs::create_dir_all(folder.path().join("resources")).map_err(failed)?;
        Ok(Self {
            description: Arc::new(description),
            folder: folder.path().to_path_buf(),
            _unpacked: Some(Arc::new(folder)),
        })
    }

    /// One that was unpacked into a folder by [`Fmu::open`], also of another process.
    ///
    /// # Errors
    /// The folder is not such.
    pub fn unpacked(folder: &Path) -> Result<Self, Unusable> {
        let text = fs::read_to_string(folder.join(DESCRIPTION));
        let text = text.map_err(|error| Unusable::damaged(format!("its description cannot be read: {error}")))?;
        let description = Arc::new(Description::read(&text)?);
        Ok(Self { description, folder: folder.to_path_buf(), _unpacked: None })
    }

    /// Where it is unpacked.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its element. The binary is loaded with the first instance that starts.
    ///
    /// # Errors
    /// Sizes that no element may have.
    pub fn class(&self) -> Result<Arc<dyn ElementClass>, Unusable> {
        let descriptor = class::describe(&self.description);
        descriptor.check().map_err(|message| Unusable::here(message, "export it with fewer inputs and outputs"))?;
        Ok(Arc::new(FmuClass::new(self.clone(), descriptor)))
    }

    /// Loads the binary.
    ///
    /// # Errors
    /// What the system's loader says, or which function is missing.
    pub(crate) fn load(&self) -> Result<Library, String> {
        Library::load(&self.folder.join(binary(&self.description)), self.description.version)
    }
}

fn binary(description: &Description) -> String {
    let (name, ending) = platform(description.version);
    format!("binaries/{name}/{}{ending}", description.identifier)
}

/// There is no binary for this machine: which there are, and what to do.
fn missing(archive: &Archive<'_>, description: &Description, wanted: &str) -> Unusable {
    let folders = archive.entries.iter().filter_map(|entry| entry.name.strip_prefix("binaries/")?.split_once('/'));
    let mut inside: Vec<&str> = folders.map(|(folder, _)| folder).collect();
    inside.sort_unstable();
    inside.dedup();
    let inside = if inside.is_empty() {
        "it has none at all".to_string()
    } else {
        format!("it has some for {}", inside.join(", "))
    };
    let sources = archive.entries.iter().any(|entry| entry.name.starts_with("sources/") && entry.name.ends_with(".c"));
    let (platform, _) = platform(description.version);
    let help = if sources {
        format!(
            "its sources are inside: build them for {platform}, for example with `fmpy compile FILE`, and use that one"
        )
    } else {
        format!("export it for {platform}")
    };
    Unusable::here(format!("there is no binary for this machine (`{wanted}`); {inside}"), help)
}
