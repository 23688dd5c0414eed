//! [`Request`]: a library that is asked for, and which builds of it will do.

use semver::VersionReq;

/// A library that is asked for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Request {
    /// A name such as `"joints"`, which stands for the packages `odyn-joints` and `joints`, or the path of a file.
    pub name: String,
    /// The versions that will do; any where absent.
    pub version: Option<VersionReq>,
    /// SHA-256 of the file that will do, 64 hexadecimal digits in lower case; any where absent.
    pub sha256: Option<String>,
    /// The user trusts it as far as this program: it need not be behind glass.
    pub trusted: bool,
}

impl Request {
    /// Any library of this name.
    #[must_use]
    pub fn named(name: impl Into<String>) -> Self {
        Self { name: name.into(), version: None, sha256: None, trusted: false }
    }

    /// Whether only some builds will do.
    #[must_use]
    pub fn is_pinned(&self) -> bool {
        self.version.is_some() || self.sha256.is_some()
    }

    /// What the pin asks for, in words; empty without one.
    #[must_use]
    pub fn pin(&self) -> String {
        let version = self.version.iter().map(|range| format!("version {range}"));
        let hash = self.sha256.iter().map(|hash| format!("SHA-256 {hash}"));
        version.chain(hash).collect::<Vec<_>>().join(" with ")
    }
}
