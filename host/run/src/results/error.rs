//! [`ResultsError`] and its form for the user.

use std::io;
use std::path::{Path, PathBuf};

use crate::diagnostics::{Code, Diagnostic, codes};

/// Why a file of results cannot be written, read or compared. The text names the file and the cause;
/// [`ResultsError::diagnostic`] adds the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// A file or folder of results cannot be made or written.
    #[error("cannot write `{}`: {cause}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A table cannot be opened or read.
    #[error("cannot read `{}`: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A file is not a table of numbers.
    #[error("`{}`{} is not a table of results: {reason}", path.display(), at_line(*line))]
    NotATable {
        /// The file.
        path: PathBuf,
        /// Line of the mistake, from 1; `None` if it is in no particular one.
        line: Option<u64>,
        /// What is wrong.
        reason: String,
    },
    /// A file is not the motion of a run.
    #[error("`{}` is not the motion of a run: {reason}", path.display())]
    NotAMotion {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A file is not what it was when its run, or a part of that, ended.
    #[error("`{}` cannot be used: {reason}", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
        /// How it differs.
        reason: String,
        /// What to do about it.
        help: &'static str,
    },
    /// Two tables share no times or no columns.
    #[error("`{}` and `{}` cannot be compared: {reason}", first.display(), second.display())]
    NothingToCompare {
        /// The first table.
        first: PathBuf,
        /// The second table.
        second: PathBuf,
        /// What they don't share.
        reason: String,
    },
}

fn at_line(line: Option<u64>) -> String {
    line.map_or_else(String::new, |line| format!(" (line {line})"))
}

impl ResultsError {
    /// A file or folder that cannot be written.
    pub fn write(path: &Path, cause: io::Error) -> Self {
        Self::Write { path: path.to_path_buf(), cause }
    }

    /// The stable code.
    #[must_use]
    pub fn code(&self) -> Code {
        match self {
            Self::Write { .. } => codes::CANNOT_WRITE,
            Self::Read { .. } | Self::NotATable { .. } | Self::NotAMotion { .. } | Self::Changed { .. } => {
                codes::CANNOT_READ_RESULTS
            }
            Self::NothingToCompare { .. } => codes::NOTHING_TO_COMPARE,
        }
    }

    /// What to do about it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::Write { cause, .. } => match cause.kind() {
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                    "make room on the disk, or write elsewhere with `-o DIR`"
                }
                io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                    "choose a folder that may be written with `-o DIR`"
                }
                io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => {
                    "a file stands where a folder is needed; choose another one with `-o DIR`"
                }
                io::ErrorKind::IsADirectory => {
                    "a folder stands where the file is needed; choose another one with `-o DIR`"
                }
                io::ErrorKind::FileTooLarge => "files may not grow that large here; write elsewhere with `-o DIR`",
                io::ErrorKind::WouldBlock => "wait until that run is over, or write elsewhere with `-o DIR`",
                io::ErrorKind::NotFound => {
                    "the file or its folder is not there any more; leave it alone while a run continues, or write elsewhere \
                     with `-o DIR`"
                }
                _ => "choose another folder with `-o DIR`",
            },
            Self::Read { path, .. } if path.ends_with(super::MOTION_FILE) => {
                "a run writes it with `motion = true` in [simulation], or with `--motion`"
            }
            Self::Read { path, .. } if path.ends_with(super::SUMMARY_FILE) => {
                "name the folder of results that a run or an analysis has written, `results/NAME`, not the scene; \
                 `odyn run SCENE --report` makes both"
            }
            Self::Read { .. } => "check the path; the table of a run is `results.csv` in its folder",
            Self::NotATable { .. } => {
                "a table has one header line with a column `t` or `time`, then a number per column in each line"
            }
            Self::NotAMotion { .. } => {
                "a run writes it with `motion = true` in [simulation], or with `--motion`; run anew"
            }
            Self::Changed { help, .. } => help,
            Self::NothingToCompare { .. } => {
                "columns are matched by name, rows by time; both tables need the same units"
            }
        }
    }

    /// As a message to the user.
    #[must_use]
    pub fn diagnostic(&self) -> Diagnostic {
        Diagnostic::error(self.code(), self.to_string()).help(self.help())
    }
}

/// For callbacks that speak of input and output only; [`std::io::Error::downcast`] gives the original back.
impl From<ResultsError> for io::Error {
    fn from(error: ResultsError) -> Self {
        Self::other(error)
    }
}
