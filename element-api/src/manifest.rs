//! What a library says about itself without being run: a text in a link section of its file.
//!
//! ```text
//! ODYN-MANIFEST 1
//! package=odyn-joints
//! version=0.1.0
//! about=Standard joints
//! abi=1
//! conventions=1
//! interface=1.2.0
//! entry=odyn_plugin_v1_odyn_joints
//! features=sse4.2 avx avx2 fma
//! profile=release
//! element=joint revolute
//! end
//! ```
//!
//! `abi` is the version of the interface; with a `c` before the number, that of the C table in `include/odyn_element.h`.
//! The number in the first line counts versions of this format; lines with unknown keys are skipped. The export macro
//! joins the text from constants at compile time, so it is always that of the code beside it. A file built from several
//! libraries holds one text for each.

use crate::descriptor::Kind;
use crate::set::ElementClass;

/// A library of elements that is linked into the program, as `library()` of its crate gives it.
pub struct Library {
    /// Name of the crate that exports it.
    pub package: String,
    /// Version of that crate.
    pub version: String,
    /// One sentence for the user.
    pub about: String,
    /// The elements.
    pub classes: Vec<Box<dyn ElementClass>>,
}

/// Version of the binary interface that this crate makes and understands.
pub const ABI: u32 = 1;
/// Version of the C table (`include/odyn_element.h`) that this host understands.
pub const C_ABI: u32 = 1;
/// Number of the conventions (axes, units, order of Euler parameters, signs): what no layout check can see.
pub const CONVENTIONS: u32 = 1;
/// Version of this crate.
pub const INTERFACE: &str = env!("CARGO_PKG_VERSION");
/// The section that holds the manifest in an ELF or PE file.
pub const SECTION: &str = ".odyn";
/// The section that holds the manifest in a Mach-O file, in segment `__DATA`.
pub const SECTION_MACH_O: &str = "__odyn";

const MAGIC: &str = "ODYN-MANIFEST ";
const FORMAT: &str = "1";
/// A manifest of a thousand elements has 50 kB; more is not one.
const LONGEST: usize = 1 << 20;

/// What a library says about itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Manifest {
    /// Name of the crate; the part before the slash in full element names.
    pub package: String,
    /// Version of the crate.
    pub version: String,
    /// One sentence for the user.
    pub about: String,
    /// Version of the binary interface; see [`ABI`] and [`C_ABI`].
    pub abi: u32,
    /// Which interface that is.
    pub table: EntryTable,
    /// See [`CONVENTIONS`].
    pub conventions: u32,
    /// Version of `element-api` it was built with.
    pub interface: String,
    /// Name of the exported symbol behind which the elements are found.
    pub entry: String,
    /// Processor features the compiler was allowed to use, of those that matter: `sse4.2`, `avx`, `avx2`, `fma`,
    /// `avx512f`, `neon`.
    pub features: Vec<String>,
    /// How it was compiled.
    pub profile: Profile,
    /// What it provides.
    pub elements: Vec<ManifestElement>,
}

/// What the entry symbol of a library leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EntryTable {
    /// What [`export_plugin!`](crate::export_plugin) exports.
    Rust,
    /// The C table of `include/odyn_element.h`.
    C,
}

/// How a library was compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// With debug assertions, usually unoptimised.
    Debug,
    /// Optimised.
    Release,
}

impl Profile {
    /// The profile of this very build.
    pub const OWN: Self = if cfg!(debug_assertions) { Self::Debug } else { Self::Release };

    /// The word used in manifests.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Release => "release",
        }
    }
}

/// An element named in a manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ManifestElement {
    /// `joint`, `force`, or a word of a later version.
    pub kind: String,
    /// Name without the package.
    pub name: String,
}

impl ManifestElement {
    /// Whether it names this element.
    #[must_use]
    pub fn is(&self, kind: Kind, name: &str) -> bool {
        self.kind == kind.word() && self.name == name
    }
}

impl Manifest {
    /// Reads the content of the link section. Zeros between and behind the manifests (padding of the linker) are skipped.
    ///
    /// # Errors
    /// What is wrong, in words: not a manifest, a later format, an incomplete or contradictory one.
    pub fn parse(section: &[u8]) -> Result<Vec<Self>, String> {
        if section.len() > LONGEST {
            return Err(format!("the manifest has {} bytes; at most {LONGEST} are accepted", section.len()));
        }
        let text = std::str::from_utf8(section).map_err(|_| "the manifest is not UTF-8 text")?;
        let mut rest = text.trim_matches('\0');
        let mut found = Vec::new();
        while !rest.is_empty() {
            let (manifest, length) = Self::parse_one(rest)?;
            found.push(manifest);
            rest = rest[length..].trim_matches('\0');
        }
        if found.is_empty() { Err("the manifest is empty".into()) } else { Ok(found) }
    }

    /// The first manifest of a text, and how many bytes it takes.
    fn parse_one(text: &str) -> Result<(Self, usize), String> {
        let mut lines = text.split_inclusive('\n');
        let first = lines.next().unwrap_or_default();
        let Some(format) = first.strip_prefix(MAGIC) else {
            return Err(format!("it does not begin with `{}`", MAGIC.trim_end()));
        };
        if format.trim_end() != FORMAT {
            return Err(format!("its format is {}, this host reads format {FORMAT}", format.trim_end()));
        }
        let mut length = first.len();
        let mut draft = Draft::default();
        for line in lines {
            length += line.len();
            if line.trim_end() == "end" {
                return Ok((draft.finish()?, length));
            }
            let line = line.trim_end_matches(['\n', '\r']);
            let Some((key, value)) = line.split_once('=') else {
                return Err(format!("the line `{line}` has no `=`"));
            };
            draft.set(key, value)?;
        }
        Err("it does not finish with `end`".into())
    }
}

/// A manifest while its lines are read.
#[derive(Default)]
struct Draft {
    package: Option<String>,
    version: Option<String>,
    about: Option<String>,
    abi: Option<(EntryTable, u32)>,
    conventions: Option<u32>,
    interface: Option<String>,
    entry: Option<String>,
    features: Option<Vec<String>>,
    profile: Option<Profile>,
    elements: Vec<ManifestElement>,
}

impl Draft {
    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        let whole =
            |text: &str| text.parse::<u32>().map_err(|_| format!("`{key}` is `{value}`, which is not a whole number"));
        let fresh = match key {
            "package" => self.package.replace(value.into()).is_none(),
            "version" => self.version.replace(value.into()).is_none(),
            "about" => self.about.replace(value.into()).is_none(),
            "abi" => {
                let abi = match value.strip_prefix('c') {
                    Some(number) => (EntryTable::C, whole(number)?),
                    None => (EntryTable::Rust, whole(value)?),
                };
                self.abi.replace(abi).is_none()
            }
            "conventions" => self.conventions.replace(whole(value)?).is_none(),
            "interface" => self.interface.replace(value.into()).is_none(),
            "entry" => self.entry.replace(value.into()).is_none(),
            "features" => self.features.replace(value.split_whitespace().map(Into::into).collect()).is_none(),
            "profile" => {
                let profile = match value {
                    "debug" => Profile::Debug,
                    "release" => Profile::Release,
                    _ => return Err(format!("the profile is `{value}`, expected debug or release")),
                };
                self.profile.replace(profile).is_none()
            }
            "element" => {
                let (kind, name) = value.split_once(' ').ok_or_else(|| format!("the element `{value}` has no kind"))?;
                if self.elements.iter().any(|known| known.name == name) {
                    return Err(format!("the element `{name}` is named twice"));
                }
                self.elements.push(ManifestElement { kind: kind.into(), name: name.into() });
                true
            }
            _ => true,
        };
        if fresh { Ok(()) } else { Err(format!("`{key}` is given twice")) }
    }

    fn finish(self) -> Result<Manifest, String> {
        fn needed<T>(value: Option<T>, key: &str) -> Result<T, String> {
            value.ok_or_else(|| format!("`{key}` is missing"))
        }
        let package = needed(self.package, "package")?;
        if package.is_empty() || !package.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_') {
            return Err(format!("`{package}` is not the name of a package"));
        }
        let (table, abi) = needed(self.abi, "abi")?;
        Ok(Manifest {
            package,
            version: needed(self.version, "version")?,
            about: self.about.unwrap_or_default(),
            abi,
            table,
            conventions: needed(self.conventions, "conventions")?,
            interface: self.interface.unwrap_or_default(),
            entry: needed(self.entry, "entry")?,
            features: self.features.unwrap_or_default(),
            profile: self.profile.unwrap_or(Profile::Release),
            elements: self.elements,
        })
    }
}

/// The part of every manifest that this crate decides.
#[doc(hidden)]
pub const OPENING: &str = concat!(
    "ODYN-MANIFEST 1\nabi=1\nconventions=1\ninterface=",
    // The constants ABI, CONVENTIONS and INTERFACE as text; a test compares them.
    env!("CARGO_PKG_VERSION"),
    "\npackage="
);

/// Number of bytes of the joined parts.
#[must_use]
pub const fn joined_len(parts: &[&str]) -> usize {
    let (mut length, mut k) = (0, 0);
    while k < parts.len() {
        length += parts[k].len();
        k += 1;
    }
    length
}

/// The joined parts; `N` is their [`joined_len`].
#[must_use]
pub const fn joined<const N: usize>(parts: &[&str]) -> [u8; N] {
    let mut bytes = [0; N];
    let (mut at, mut k) = (0, 0);
    while k < parts.len() {
        let part = parts[k].as_bytes();
        let mut i = 0;
        while i < part.len() {
            bytes[at] = part[i];
            at += 1;
            i += 1;
        }
        k += 1;
    }
    assert!(at == N, "the number of bytes is not that of the parts");
    bytes
}

/// The text itself; fails the build of the library when it spans several lines.
#[must_use]
pub const fn one_line(text: &'static str) -> &'static str {
    let bytes = text.as_bytes();
    let mut k = 0;
    while k < bytes.len() {
        assert!(bytes[k] != b'\n' && bytes[k] != b'\r', "`about` must be one line");
        k += 1;
    }
    text
}

/// Fails the build of the library when a name can't be used in scenes or is used twice.
pub const fn check_names(names: &[&str]) {
    let mut k = 0;
    while k < names.len() {
        let name = names[k].as_bytes();
        assert!(!name.is_empty() && name[0].is_ascii_lowercase(), "an element's NAME must begin with a letter a-z");
        let mut i = 0;
        while i < name.len() {
            let byte = name[i];
            assert!(
                byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-',
                "an element's NAME consists of a-z, 0-9 and `-`"
            );
            i += 1;
        }
        let mut other = 0;
        while other < k {
            assert!(!same(names[other].as_bytes(), name), "two elements of this library have the same NAME");
            other += 1;
        }
        k += 1;
    }
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let mut k = 0;
    while k < a.len() {
        if a[k] != b[k] {
            return false;
        }
        k += 1;
    }
    true
}

#[cfg(test)]
mod tests;
