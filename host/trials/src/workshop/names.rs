//! Names that a crate, its elements and its types can have.

use super::WorkshopError;

/// Words of Rust, and what cargo keeps for itself or has a meaning on some system.
const TAKEN: &[&str] = &[
    "abstract",
    "alloc",
    "as",
    "async",
    "aux",
    "await",
    "become",
    "box",
    "break",
    "build",
    "con",
    "const",
    "continue",
    "core",
    "crate",
    "deps",
    "do",
    "dyn",
    "element-api",
    "else",
    "enum",
    "examples",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "incremental",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "nul",
    "override",
    "priv",
    "prn",
    "proc-macro",
    "pub",
    "ref",
    "return",
    "self",
    "static",
    "std",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "typeof",
    "union",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "yield",
];

/// Types that the sources of an element use under these names.
const TYPES: &[&str] = &[
    "ChannelSpec",
    "Configuration",
    "Constraint",
    "Control",
    "Default",
    "Element",
    "Err",
    "Force",
    "Frame",
    "FrameSpec",
    "Function",
    "InputSpec",
    "Mat3",
    "Motion",
    "NoParameters",
    "None",
    "Ok",
    "Option",
    "Options",
    "ParamError",
    "Parameters",
    "Pose",
    "Probe",
    "Random",
    "Reaction",
    "Result",
    "Rows",
    "Scalar",
    "Self",
    "Setting",
    "Some",
    "String",
    "Table",
    "Twist",
    "Values",
    "Vec",
    "Vec3",
    "Wrenches",
];

/// Most characters of a name; file names have bounds.
const LONGEST: usize = 64;

/// Checks the name of a crate, from which those of its element and type follow.
pub(super) fn check(name: &str) -> Result<(), WorkshopError> {
    let refused = |reason: &str, instead: Option<String>| {
        Err(WorkshopError::Name { name: name.into(), reason: reason.into(), instead })
    };
    if name.len() > LONGEST {
        return refused("it has more than 64 characters", None);
    }
    let sound = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(sound) {
        let similar: String = name.to_lowercase().chars().map(|c| if sound(c) { c } else { '-' }).collect();
        let similar = similar.trim_start_matches(|c: char| !c.is_ascii_lowercase()).trim_end_matches(['-', '_']);
        let usable = !similar.is_empty() && check(similar).is_ok();
        return refused(
            "names begin with a letter a-z and consist of a-z, 0-9, `-` and `_`",
            usable.then(|| similar.into()),
        );
    }
    if name.ends_with(['-', '_']) {
        return refused("it ends with a stroke", Some(name.trim_end_matches(['-', '_']).into()));
    }
    if TAKEN.contains(&name.replace('_', "-").as_str()) {
        return refused("the word has a meaning for Rust, cargo or a system", Some(format!("{name}-element")));
    }
    Ok(())
}

/// The name of the crate in Rust, and of its files.
pub(super) fn crate_name(name: &str) -> String {
    name.replace('-', "_")
}

/// The word for the element in scenes.
pub(super) fn element_name(name: &str) -> String {
    name.replace('_', "-")
}

/// The type of the element: `AcmeWobble` for `acme-wobble`.
pub(super) fn type_name(name: &str) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    let joined: String = name.split(['-', '_']).filter(|word| !word.is_empty()).map(capital).collect();
    if TYPES.contains(&joined.as_str()) { joined + "Element" } else { joined }
}
