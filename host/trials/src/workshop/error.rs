//! [`WorkshopError`] and its form for the user.

use std::path::PathBuf;

use crate::diagnostics::{Code, Diagnostic, codes};

/// Why a crate cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorkshopError {
    /// The name cannot be that of a crate and an element.
    #[error("a library cannot be called `{name}`: {reason}")]
    Name {
        /// The name as given.
        name: String,
        /// What is wrong with it.
        reason: String,
        /// A similar name that could be used.
        instead: Option<String>,
    },
    /// Something of this name is there already.
    #[error("`{}` exists already", path.display())]
    Exists {
        /// The folder or file.
        path: PathBuf,
    },
    /// The folder of the contract is none.
    #[error("`{}` is not the folder of `element-api`: {reason}", path.display())]
    NoContract {
        /// The folder as given.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// There is no crate that an element can be added to.
    #[error("no element can be added to `{}`: {reason}", path.display())]
    NoCrate {
        /// The folder as given.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// A file or folder cannot be written.
    #[error("cannot write `{}`: {source}", path.display())]
    Write {
        /// Which.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl WorkshopError {
    /// The stable code.
    #[must_use]
    pub fn code(&self) -> Code {
        match self {
            Self::Name { .. } | Self::Exists { .. } | Self::NoContract { .. } | Self::NoCrate { .. } => {
                codes::CANNOT_MAKE_PLUGIN
            }
            Self::Write { .. } => codes::CANNOT_WRITE,
        }
    }

    /// What to do about it, one line each.
    #[must_use]
    pub fn help(&self) -> Vec<String> {
        match self {
            Self::Name { instead, .. } => instead.iter().map(|name| format!("for example `{name}`")).collect(),
            Self::Exists { .. } => vec!["choose another name, or remove it; nothing was written".into()],
            Self::NoContract { .. } => {
                vec!["`--api` takes that folder, in a copy of O-DYN's sources, or a version such as 1.0".into()]
            }
            Self::NoCrate { .. } => {
                vec!["`--into` takes the folder of a crate that `odyn plugin new` made, or of one like it".into()]
            }
            Self::Write { .. } => vec!["nothing is left of what was written".into()],
        }
    }

    /// The error as a diagnostic.
    #[must_use]
    pub fn diagnostic(&self) -> Diagnostic {
        self.help().into_iter().fold(Diagnostic::error(self.code(), self.to_string()), Diagnostic::help)
    }
}
