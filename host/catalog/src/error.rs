//! [`CatalogError`] and its form for the user.

use std::path::PathBuf;

use element_api::fence::is_panic;
use odyn_diagnostics::{Code, Diagnostic, codes, containing};

/// The code of a fault of a library: it panicked, its process ended, or it gave something unusable.
#[must_use]
pub fn fault_code(message: &str) -> Code {
    #[cfg(all(unix, feature = "glass"))]
    if let Some(code) = super::glass::code(message) {
        return code;
    }
    #[cfg(feature = "abi")]
    if message.starts_with(odyn_fmu::FAILED) {
        return codes::FMU_FAILED;
    }
    #[cfg(feature = "abi")]
    if message.starts_with(odyn_fmu::NO_STATE) {
        return codes::FMU_WITHOUT_STATE;
    }
    if is_panic(message) { codes::PLUGIN_PANICKED } else { codes::PLUGIN_MISBEHAVED }
}

/// Why a library or an element type can't be had. The text names the file, what was found and what was expected;
/// [`CatalogError::help`] says what to do about it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogError {
    /// No folder holds the library.
    #[error("the library `{request}` was not found")]
    NotFound {
        /// What was asked for.
        request: String,
        /// The folders looked in, in their order.
        folders: Vec<PathBuf>,
        /// File names tried in each.
        files: Vec<String>,
        /// Which of the folders and files cannot be looked at, and why.
        unreadable: Box<[String]>,
        /// A library of a similar name that is there.
        nearest: Option<String>,
    },
    /// The file is not a dynamic library for this machine, or damaged.
    #[error("`{}` {}: {reason}", path.display(), if *unread { "cannot be read" } else { "is not a library for this machine" })]
    NotALibrary {
        /// Whether the system does not let it be read.
        unread: bool,
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A library, but not one of elements.
    #[error("`{}` is not an O-DYN element library: it has no manifest", path.display())]
    NoManifest {
        /// The file.
        path: PathBuf,
    },
    /// The manifest can't be read.
    #[error("the manifest of `{}` can't be read: {reason}", path.display())]
    BadManifest {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file of elements that can't be used.
    #[error("`{}`{} is no file of elements that can be used: {reason}", path.display(), line_text(*line))]
    BadElement {
        /// The file.
        path: PathBuf,
        /// The line, from 1, where there is one.
        line: Option<usize>,
        /// What is wrong there.
        reason: String,
    },
    /// Built for another version of the binary interface.
    #[error("`{package}` ({}) has interface version {found}, this host version {expected}", path.display())]
    AbiVersion {
        /// The file.
        path: PathBuf,
        /// Its package.
        package: String,
        /// The library's version; a number of the interface or a version of `element-api`.
        found: String,
        /// The host's version.
        expected: String,
    },
    /// Types have another layout.
    #[error("`{package}` ({}) does not fit this host:\n{differences}", path.display())]
    Layout {
        /// The file.
        path: PathBuf,
        /// Its package.
        package: String,
        /// At most two lines.
        differences: String,
    },
    /// Written for other conventions.
    #[error("`{package}` ({}) follows conventions number {found}, this host number {expected}", path.display())]
    Conventions {
        /// The file.
        path: PathBuf,
        /// Its package.
        package: String,
        /// The library's number.
        found: u32,
        /// The host's number.
        expected: u32,
    },
    /// Compiled for a processor with more features.
    #[error("`{package}` ({}) needs a processor with {}", path.display(), missing.join(", "))]
    Processor {
        /// The file.
        path: PathBuf,
        /// Its package.
        package: String,
        /// The features that this processor lacks.
        missing: Vec<String>,
    },
    /// The library failed while it was loaded.
    #[error("`{package}` ({}) failed while it was loaded: {message}", path.display())]
    Failed {
        /// The file.
        path: PathBuf,
        /// Its package.
        package: String,
        /// What happened.
        message: String,
    },
    /// Two libraries of the same package.
    #[error("two libraries are called `{package}`: {first} and {second}")]
    DuplicatePackage {
        /// The package.
        package: String,
        /// Where the first is from.
        first: String,
        /// Where the second is from.
        second: String,
    },
    /// There are libraries of this name, but none that the request is pinned to.
    #[error("no library `{request}` is of {pin}")]
    NoneFits {
        /// What was asked for.
        request: String,
        /// The versions or the content that would do.
        pin: String,
        /// What there is, and where, one line each.
        found: Vec<String>,
        /// A version would do, but not its content.
        content: bool,
    },
    /// The file has another content than it was installed with, or was pinned to.
    #[error("`{}` is not the file that was asked for: its SHA-256 is {found}, not {expected}", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
        /// Its hash.
        found: String,
        /// The hash it should have.
        expected: String,
    },
    /// A package, or an installed library, that can't be used.
    #[error("`{}` cannot be used as a package: {reason}", path.display())]
    BadPackage {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// Another package of this version is installed.
    #[error("another package of `{name}` {version} is installed in `{}`, or it was changed", folder.display())]
    AlreadyInstalled {
        /// Name of the package.
        name: String,
        /// Its version.
        version: String,
        /// Where it is.
        folder: PathBuf,
        /// The project that it is in.
        project: Option<PathBuf>,
    },
    /// What is to be removed is not there, or is not one library.
    #[error("`{name}` is not one library of `{}`", store.display())]
    NotInstalled {
        /// What was asked for.
        name: String,
        /// The store.
        store: PathBuf,
        /// What it has of this name, `NAME@VERSION` each.
        installed: Vec<String>,
    },
    /// An FMU that cannot be used.
    #[error("`{}` cannot be used as an FMU: {reason}", path.display())]
    Fmu {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        reason: String,
        /// What to do about it; may be empty.
        help: String,
        /// The file is damaged, or no FMU.
        damaged: bool,
    },
    /// A folder can't be written.
    #[error("cannot write `{}`: {reason}", path.display())]
    Files {
        /// The folder.
        path: PathBuf,
        /// The system's words.
        reason: String,
    },
    /// This program was built without the loader.
    #[error("the library `{request}` can't be loaded: this program was built without the feature `abi`")]
    NoLoader {
        /// What was asked for.
        request: String,
    },
    /// No loaded library provides the element type.
    #[error("unknown element type `{name}`")]
    UnknownType {
        /// The name as written.
        name: String,
        /// The most similar name that is known.
        nearest: Option<String>,
        /// Package and file of a library that provides it but isn't loaded.
        provided_by: Option<(String, PathBuf)>,
        /// The short names that are known.
        known: Vec<String>,
    },
    /// Several loaded libraries provide the short name.
    #[error("the element type `{name}` is provided by several libraries")]
    AmbiguousType {
        /// The name as written.
        name: String,
        /// The full names.
        candidates: Vec<String>,
    },
    /// The element type is of another kind.
    #[error("`{name}` is a {found}, not a {expected}")]
    WrongKind {
        /// The name as written.
        name: String,
        /// Kind that was asked for.
        expected: &'static str,
        /// Kind that it is.
        found: String,
    },
}

fn line_text(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!(", line {line},"))
}

impl CatalogError {
    /// The stable code.
    #[must_use]
    pub fn code(&self) -> Code {
        match self {
            Self::NotFound { .. } | Self::NoLoader { .. } => codes::PLUGIN_NOT_FOUND,
            Self::NotALibrary { .. } => codes::NOT_A_LIBRARY,
            Self::NoManifest { .. } | Self::BadManifest { .. } => codes::NO_MANIFEST,
            Self::BadElement { .. } => codes::BAD_ELEMENT_FILE,
            Self::AbiVersion { .. } => codes::ABI_VERSION,
            Self::Layout { .. } => codes::ABI_LAYOUT,
            Self::Conventions { .. } => codes::ABI_CONVENTIONS,
            Self::Processor { .. } => codes::CPU_FEATURES,
            Self::Failed { message, .. } => fault_code(message),
            Self::DuplicatePackage { .. } => codes::DUPLICATE_ELEMENT,
            Self::NoneFits { content: false, .. } => codes::PLUGIN_VERSION,
            Self::NoneFits { .. } | Self::Changed { .. } => codes::PLUGIN_CONTENT,
            Self::BadPackage { .. } => codes::BAD_PACKAGE,
            Self::AlreadyInstalled { .. } | Self::NotInstalled { .. } => codes::INSTALLATION,
            Self::Fmu { damaged: true, .. } => codes::BAD_FMU,
            Self::Fmu { .. } => codes::FMU_NOT_USABLE,
            Self::Files { .. } => codes::CANNOT_WRITE,
            Self::UnknownType { .. } => codes::UNKNOWN_TYPE,
            Self::AmbiguousType { .. } => codes::AMBIGUOUS_TYPE,
            Self::WrongKind { .. } => codes::WRONG_KIND,
        }
    }

    /// What to do about it, one line each.
    #[must_use]
    pub fn help(&self) -> Vec<String> {
        let rebuild = "build the library again with the `element-api` of this host".to_string();
        match self {
            Self::NotFound { request, folders, files, unreadable, nearest } => {
                let mut help: Vec<String> = nearest.iter().map(|name| format!("did you mean `{name}`?")).collect();
                if folders.is_empty() {
                    help.push("there is no folder to look in".into());
                } else {
                    let list: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
                    help.push(format!("looked for {} in {}", files.join(" and "), list.join(", ")));
                }
                help.extend(unreadable.iter().cloned());
                // A name stands for two files, a path for itself.
                let package = if files.len() > 1 { format!("{request}-VERSION-TARGET") } else { "FILE".into() };
                help.push(format!("install it with `odyn plugin add {package}.odynplugin`"));
                help.push("or name its folder with `--plugin` or in `[plugins] path`".into());
                help.push(
                    "in a source tree, `cargo build` (or `cargo build --release`) builds the standard libraries".into(),
                );
                help
            }
            Self::NotALibrary { unread: true, .. } => Vec::new(),
            Self::NotALibrary { .. } => vec!["build it or copy it again".into()],
            Self::NoManifest { .. } => {
                vec![
                    "a library of elements is made with `export_plugin!` of `element-api`, in C with `ODYN_PLUGIN` of \
                     `odyn_element.h`"
                        .into(),
                ]
            }
            Self::BadManifest { .. } | Self::AbiVersion { .. } | Self::Layout { .. } | Self::Conventions { .. } => {
                vec![rebuild]
            }
            Self::BadElement { .. } => vec![
                "write it again from Python (`save` of its element), with a version of `odyn` that is not newer than this program".into(),
            ],
            Self::Processor { .. } => vec!["build it without `-C target-cpu=native`, or on this machine".into()],
            Self::Failed { package, .. } => vec![format!("report it to the author of `{package}`")],
            Self::NoneFits { request, pin, found, .. } => {
                let mut help: Vec<String> = found.iter().map(|line| format!("found: {line}")).collect();
                help.push(format!("install one of {pin}: `odyn plugin add {request}-VERSION-TARGET.odynplugin`"));
                help.push("or change the pin in `[plugins] libraries`; `odyn plugin list --pins` prints those of what is found".into());
                help
            }
            Self::Changed { .. } => {
                vec!["`odyn plugin verify` lists what was changed; remove it and install it again".into()]
            }
            Self::BadPackage { .. } => {
                vec!["get it again from its author, who makes it with `odyn plugin pack`".into()]
            }
            Self::AlreadyInstalled { name, version, project, .. } => {
                let of = project.as_ref().map_or_else(String::new, |folder| format!(" --project {}", folder.display()));
                vec![
                    format!("to replace it, first remove it: `odyn plugin remove {name}@{version}{of}`"),
                    "two packages that differ need two versions".into(),
                ]
            }
            Self::NotInstalled { installed, .. } if installed.is_empty() => {
                vec!["`odyn plugin list` shows what is installed where; --project DIR names a project".into()]
            }
            Self::NotInstalled { installed, .. } => vec![format!("installed are {}", installed.join(", "))],
            Self::Fmu { help, .. } => (!help.is_empty()).then(|| help.clone()).into_iter().collect(),
            Self::Files { .. } => Vec::new(),
            Self::DuplicatePackage { .. } => {
                vec!["remove one of them from `[plugins] libraries`, or from the command line".into()]
            }
            Self::NoLoader { .. } => Vec::new(),
            Self::UnknownType { name, nearest, provided_by, known } => {
                if let Some((package, path)) = provided_by {
                    return vec![format!(
                        "`{name}` is provided by `{package}` ({}), which `[plugins] libraries` does not name",
                        path.display()
                    )];
                }
                let short = name.rsplit('/').next().unwrap_or_default();
                let parts = containing(short, known.iter().map(String::as_str));
                match nearest {
                    Some(nearest) => vec![format!("did you mean `{nearest}`?")],
                    None if !parts.is_empty() => {
                        let parts: Vec<String> = parts.iter().map(|name| format!("`{name}`")).collect();
                        vec![format!("did you mean {}?", parts.join(" or "))]
                    }
                    None if known.is_empty() => {
                        vec![
                            "no library is loaded: write those of its elements under `[plugins]`; the standard ones are \
                             `libraries = [\"joints\", \"forces\", \"controls\"]`"
                                .into(),
                        ]
                    },
                    None => vec![format!("known types: {}", known.join(", "))],
                }
            }
            Self::AmbiguousType { candidates, .. } => vec![format!("write one of {}", candidates.join(", "))],
            Self::WrongKind { found, .. } => vec![format!("write it below `[[{found}]]`")],
        }
    }

    /// The error as a diagnostic without a place; the caller knows where in the scene it belongs.
    #[must_use]
    pub fn diagnostic(&self) -> Diagnostic {
        self.help().into_iter().fold(Diagnostic::error(self.code(), self.to_string()), Diagnostic::help)
    }
}
