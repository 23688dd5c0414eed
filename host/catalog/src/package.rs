//! [`PackageInfo`]: what a package of a library says about itself, in its `plugin.toml`; and what its files may be called.

use std::collections::BTreeMap;

use element_api::manifest::Manifest;
use semver::Version;
use serde::{Deserialize, Serialize};

/// The file of a package that describes the others.
pub const INFO_FILE: &str = "plugin.toml";
/// The file of a package with the descriptions of its elements, a list of what `odyn elements describe --json` gives.
pub const ELEMENTS_FILE: &str = "elements.json";
/// The ending of a package's file name.
pub const ENDING: &str = "odynplugin";

/// The target of a package whose library is data.
pub(super) const ANY_TARGET: &str = "any";

/// Version of the format of packages.
const FORMAT: u32 = 1;
/// Files that a package may have.
pub(super) const MOST_FILES: usize = 1000;
/// Bytes that the files of a package may have together. Debug builds of large libraries have some 50 MB.
pub(super) const LARGEST: u64 = 512 << 20;
/// Bytes of a file's name: what the header of a `tar` archive holds without extensions.
const LONGEST_NAME: usize = 100;

/// What a package says about itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackageInfo {
    /// Version of this format.
    pub format: u32,
    /// Name of the library's crate; the part before the slash in full element names.
    pub name: String,
    /// Its version, by the rules of semver.org.
    pub version: Version,
    /// One sentence for the user.
    pub about: String,
    /// Version of the contract (`element-api`) that it was built with.
    pub contract: String,
    /// Version of the binary interface.
    pub abi: u32,
    /// Number of its conventions (axes, units, signs).
    pub conventions: u32,
    /// The system and processor it was built for, such as `x86_64-unknown-linux-gnu`; `any` for elements that are data.
    pub target: String,
    /// How it was compiled: `debug` or `release`.
    pub profile: String,
    /// The library among the files.
    pub library: String,
    /// What it provides, kind and name: `joint rod`.
    pub elements: Vec<String>,
    /// The files but this one: SHA-256 by name, 64 hexadecimal digits in lower case.
    pub files: BTreeMap<String, String>,
}

impl PackageInfo {
    /// The description of a library of this machine with its files.
    ///
    /// # Errors
    /// In words, when its name or version can't be those of a package.
    pub(super) fn new(manifest: &Manifest, library: &str, files: BTreeMap<String, String>) -> Result<Self, String> {
        let version = Version::parse(&manifest.version).map_err(|error| {
            format!("its version `{}` does not follow the rules of semver.org: {error}", manifest.version)
        })?;
        let info = Self {
            format: FORMAT,
            name: manifest.package.clone(),
            version,
            about: manifest.about.clone(),
            contract: manifest.interface.clone(),
            abi: manifest.abi,
            conventions: manifest.conventions,
            target: if library.ends_with(super::search::ENDING) { ANY_TARGET.into() } else { target() },
            profile: manifest.profile.word().into(),
            library: library.into(),
            elements: manifest.elements.iter().map(|e| format!("{} {}", e.kind, e.name)).collect(),
            files,
        };
        info.check().map(|()| info)
    }

    /// Reads a `plugin.toml`.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let table: toml::Table = text.parse().map_err(|error: toml::de::Error| error.message().to_string())?;
        match table.get("format").and_then(toml::Value::as_integer) {
            Some(format) if format == i64::from(FORMAT) => {}
            Some(format) => return Err(format!("its format is {format}, this host reads format {FORMAT}")),
            None => return Err("it has no `format`".into()),
        }
        let info: Self = table.try_into().map_err(|error: toml::de::Error| error.message().to_string())?;
        info.check().map(|()| info)
    }

    /// The text of the file, the same for the same content.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a table of texts, numbers and a table of texts has a TOML form")
    }

    /// The library's hash.
    #[must_use]
    pub fn library_sha256(&self) -> &str {
        self.files.get(&self.library).map_or("", String::as_str)
    }

    /// `NAME-VERSION-TARGET.odynplugin`.
    #[must_use]
    pub fn file_name(&self) -> String {
        format!("{}-{}-{}.{ENDING}", self.name, self.version, self.target)
    }

    fn check(&self) -> Result<(), String> {
        if !is_package_name(&self.name) {
            return Err(format!("`{}` cannot be the name of a package", self.name));
        }
        if self.files.len() > MOST_FILES {
            return Err(format!("it has {} files; at most {MOST_FILES} are accepted", self.files.len()));
        }
        for (name, hash) in &self.files {
            check_file_name(name)?;
            if !is_sha256(hash) {
                return Err(format!("the SHA-256 of `{name}` is not one: `{hash}`"));
            }
        }
        let mut names: Vec<String> = self.files.keys().map(|name| name.to_lowercase()).collect();
        names.push(INFO_FILE.into());
        names.sort();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("two of its files are called `{}`, but for capitals", twice[0]));
        }
        if !self.files.contains_key(&self.library) || self.library.contains('/') {
            return Err(format!("its library `{}` is not among its files", self.library));
        }
        Ok(())
    }
}

/// Names of packages become names of folders: letters, digits, `-` and `_`.
pub(super) fn is_package_name(name: &str) -> bool {
    (1..=64).contains(&name.len()) && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'))
}

/// 64 hexadecimal digits in lower case.
pub(super) fn is_sha256(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

/// Names of files stay inside of the folder that they are put into, and can be written on every system.
///
/// # Errors
/// What is wrong with the name.
pub(super) fn check_file_name(name: &str) -> Result<(), String> {
    let sound = |part: &str| {
        let first_and_last = !part.is_empty() && !part.starts_with('.') && !part.ends_with(['.', ' ']);
        first_and_last && !part.chars().any(|c| c.is_control() || "\\:*?\"<>|".contains(c))
    };
    if name.len() > LONGEST_NAME {
        return Err(format!("the name of the file `{name}` is longer than {LONGEST_NAME} bytes"));
    }
    if !name.split('/').all(sound) {
        return Err(format!("a file of a package cannot be called `{}`", name.escape_debug()));
    }
    Ok(())
}

/// The system and processor that this program was built for, as compilers call them.
#[must_use]
pub fn target() -> String {
    let system = match std::env::consts::OS {
        "macos" => "apple-darwin".to_string(),
        "windows" => format!("pc-windows-{}", if cfg!(target_env = "gnu") { "gnu" } else { "msvc" }),
        "linux" => format!("unknown-linux-{}", if cfg!(target_env = "musl") { "musl" } else { "gnu" }),
        other => format!("unknown-{other}"),
    };
    let processor = match std::env::consts::ARCH {
        "x86" => "i686",
        other => other,
    };
    format!("{processor}-{system}")
}
