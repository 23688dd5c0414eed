//! Machines as FMUs, by the Functional Mock-up Interface 2.0.4 and 3.0.2 (Modelica Association): description, sources, binaries.

mod build;
mod dependencies;
mod description;
mod documentation;

use crate::c::{Cost, Real, package};
use crate::diagnostics::{Diagnostic, codes};
use crate::machine::Machine;
use crate::results::{Packing, zip};

pub use build::{Binary, TARGETS, Target, build};

const INSTANCE: &str = include_str!("instance.c");
const SAVED: &str = include_str!("saved.c");
const DERIVATIVES: &str = include_str!("derivatives.c");
const FMI2: &str = include_str!("fmi2.c");
const FMI3: &str = include_str!("fmi3.c");
/// Functions that differ in the prefix of their names only.
const BOTH: &str = include_str!("both.c");

/// A version of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// 2.0
    Two,
    /// 3.0
    Three,
}

/// Ways in which an FMU can be run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kinds {
    /// With its own steps.
    pub co_simulation: bool,
    /// By somebody else's method.
    pub model_exchange: bool,
}

/// An FMU before its binaries are built.
#[derive(Debug, Clone)]
pub struct Fmu {
    /// Name that files and functions have.
    pub name: String,
    /// C files and headers, by their names.
    pub sources: Vec<(String, String)>,
    /// Everything else, by its path in the archive.
    pub files: Vec<(String, String)>,
    /// What a step costs.
    pub cost: Cost,
    version: Version,
}

impl Fmu {
    /// Writes description and sources.
    ///
    /// # Errors
    /// Names that C or the interface do not tell apart.
    pub fn new(machine: &Machine, version: Version, kinds: Kinds) -> Result<Self, Diagnostic> {
        let opaque = || Diagnostic::error(codes::CANNOT_EXPORT, "a program calls an opaque element");
        let machine = &machine.clone().with_derivatives().ok_or_else(opaque)?;
        description::different(machine)?;
        let c = package(machine, Real::Double)?;
        let name = machine.name.clone();
        let own = |file: &(String, String)| [format!("{name}.h"), format!("{name}.c")].contains(&file.0);
        let mut sources: Vec<(String, String)> = c.files.into_iter().filter(own).collect();
        let (of_version, prefix) = if version == Version::Two { (FMI2, "fmi2") } else { (FMI3, "fmi3") };
        let glue = format!("{INSTANCE}{SAVED}{DERIVATIVES}{of_version}{}", BOTH.replace("@fmi@", prefix));
        let guid = guid(&[&sources[0].1, &sources[1].1, &glue]);
        let tag: String = guid.chars().filter(char::is_ascii_hexdigit).take(15).collect();
        let tunable: Vec<String> =
            dependencies::tunable(machine).into_iter().map(|tunable| u8::from(tunable).to_string()).collect();
        let nominals: Vec<String> = machine.nominals().iter().map(|size| format!("{size:?}")).collect();
        let rotations = &machine.portable.coordinates.rotations;
        let euler: Vec<String> = rotations.iter().map(|rotation| rotation.position.to_string()).collect();
        let (rotations, euler) = (euler.len().to_string(), euler.join(", "));
        let (tunable, nominals, upper) = (tunable.join(", "), nominals.join(", "), name.to_uppercase());
        let filled = [
            ("@n@", name.as_str()),
            ("@N@", &upper),
            ("@guid@", &guid),
            ("@tag@", &tag),
            ("@tunable@", &tunable),
            ("@nominals@", &nominals),
            ("@rotations@", &rotations),
            ("@euler@", &euler),
        ];
        let glue = filled.iter().fold(glue.clone(), |text, (mark, value)| text.replace(mark, value));
        sources.push((format!("{name}_fmi.c"), glue));
        let mut files = vec![
            ("modelDescription.xml".to_string(), description::write(machine, version, kinds, &guid)),
            ("documentation/index.html".to_string(), documentation::write(machine, &c.cost)),
        ];
        if version == Version::Three {
            files.push(("sources/buildDescription.xml".to_string(), description::build(&name)));
        }
        Ok(Self { name, sources, files, cost: c.cost, version })
    }

    /// The archive with its binaries.
    ///
    /// # Errors
    /// An archive of more than 4 GB.
    pub fn archive(&self, binaries: &[Binary]) -> std::io::Result<Vec<u8>> {
        let mut entries: Vec<(String, &[u8])> =
            self.files.iter().map(|(path, text)| (path.clone(), text.as_bytes())).collect();
        entries.extend(self.sources.iter().map(|(file, text)| (format!("sources/{file}"), text.as_bytes())));
        for Binary { target, content } in binaries {
            let folder = match self.version {
                Version::Two => target.folder_2,
                Version::Three => target.folder_3,
            };
            entries.push((format!("binaries/{folder}/{}.{}", self.name, target.suffix), content));
        }
        zip(&entries, Packing::Deflated)
    }
}

/// A name for exactly these texts (FNV-1a, twice; Fowler, Noll & Vo).
fn guid(texts: &[&str]) -> String {
    let hash = |start: u64| {
        let bytes = texts.iter().flat_map(|text| text.bytes());
        bytes.fold(start, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    };
    let hex = format!("{:016x}{:016x}", hash(0xcbf2_9ce4_8422_2325), hash(0x6c62_272e_07bb_0142));
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}
