//! The files of a new crate. Words in double braces stand for what differs between crates.

/// What a new crate provides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Template {
    /// A joint with a parameter.
    Joint,
    /// A force with a potential.
    Force,
    /// A control element with a state.
    Control,
    /// Several elements, one of them with a state, and a machine made of them.
    Library,
    /// A joint in C, with all that its compiler needs.
    C,
}

/// Path in the crate and text of a file.
type File = (&'static str, &'static str);

const COMMON: &[File] = &[
    ("Cargo.toml", include_str!("templates/common/Cargo.toml.txt")),
    ("README.md", include_str!("templates/common/README.md.txt")),
    ("rustfmt.toml", include_str!("templates/common/rustfmt.toml.txt")),
    (".gitignore", include_str!("templates/common/gitignore.txt")),
    (".github/workflows/ci.yml", include_str!("templates/common/ci.yml.txt")),
];

const JOINT: &[File] = &[
    ("src/lib.rs", include_str!("templates/joint/lib.rs.txt")),
    ("src/tests.rs", include_str!("templates/joint/tests.rs.txt")),
    ("scene.toml", include_str!("templates/joint/scene.toml.txt")),
];

const FORCE: &[File] = &[
    ("src/lib.rs", include_str!("templates/force/lib.rs.txt")),
    ("src/tests.rs", include_str!("templates/force/tests.rs.txt")),
    ("scene.toml", include_str!("templates/force/scene.toml.txt")),
];

const CONTROL: &[File] = &[
    ("src/lib.rs", include_str!("templates/control/lib.rs.txt")),
    ("src/tests.rs", include_str!("templates/control/tests.rs.txt")),
    ("scene.toml", include_str!("templates/control/scene.toml.txt")),
];

const C: &[File] = &[
    ("src/element.c", include_str!("templates/c/element.c.txt")),
    ("include/odyn_element.h", element_api::C_HEADER),
    ("Makefile", include_str!("templates/c/Makefile.txt")),
    ("README.md", include_str!("templates/c/README.md.txt")),
    (".gitignore", include_str!("templates/c/gitignore.txt")),
    ("scene.toml", include_str!("templates/joint/scene.toml.txt")),
];

const LIBRARY: &[File] = &[
    ("src/lib.rs", include_str!("templates/library/lib.rs.txt")),
    ("src/rod.rs", include_str!("templates/library/rod.rs.txt")),
    ("src/motor.rs", include_str!("templates/library/motor.rs.txt")),
    ("src/gas.rs", include_str!("templates/library/gas.rs.txt")),
    ("src/tests.rs", include_str!("templates/library/tests.rs.txt")),
    ("scene.toml", include_str!("templates/library/scene.toml.txt")),
];

impl Template {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Joint, Self::Force, Self::Control, Self::Library, Self::C];

    /// The word for it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Force => "force",
            Self::Control => "control",
            Self::Library => "library",
            Self::C => "c",
        }
    }

    /// The template of this word.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|template| template.word() == word)
    }

    /// One sentence about the crate.
    pub(super) const fn about(self) -> &'static str {
        match self {
            Self::Joint => "A joint",
            Self::Force => "A force",
            Self::Control => "A control element",
            Self::Library => "Elements of a compressor",
            Self::C => "A joint in C",
        }
    }

    /// What its tests examine.
    pub(super) const fn examined(self) -> &'static str {
        match self {
            Self::Joint | Self::C => "the joint",
            Self::Force => "the force",
            Self::Control => "the element",
            Self::Library => "the elements",
        }
    }

    /// Names of its elements, where they are not that of the crate.
    pub(super) const fn elements(self) -> &'static [&'static str] {
        match self {
            Self::Library => &["rod", "motor", "gas"],
            _ => &[],
        }
    }

    /// Where its library is built, as a scene names such places.
    pub(super) const fn built(self) -> &'static str {
        match self {
            Self::C => "\".\"",
            _ => "\"target/release\", \"target/debug/deps\"",
        }
    }

    /// The command that builds and tests it, and where its library is then.
    #[must_use]
    pub const fn next(self) -> (&'static str, &'static str) {
        match self {
            Self::C => ("make", ""),
            _ => ("cargo test && cargo build --release", "target/release/"),
        }
    }

    /// The list of `export_plugin!` that its element is in.
    pub(super) const fn list(self) -> &'static str {
        match self {
            Self::Joint | Self::Library | Self::C => "joints",
            Self::Force => "forces",
            Self::Control => "controls",
        }
    }

    /// Source and tests of its element, where it is one in Rust.
    pub(super) fn element(self) -> Option<(&'static str, &'static str)> {
        let own = match self {
            Self::Joint => JOINT,
            Self::Force => FORCE,
            Self::Control => CONTROL,
            Self::Library | Self::C => return None,
        };
        let text = |name: &str| own.iter().find(|(path, _)| *path == name).map(|(_, text)| *text);
        Some((text("src/lib.rs")?, text("src/tests.rs")?))
    }

    /// Rows of the table of files in its README.
    pub(super) const fn table(self) -> &'static str {
        match self {
            Self::Library => {
                "| `src/lib.rs` | the list of elements |\n\
                 | `src/rod.rs`, `src/motor.rs`, `src/gas.rs` | an element each |\n\
                 | `src/tests.rs` | their tests |\n"
            }
            Self::C => "| `src/element.c` | the element |\n",
            _ => "| `src/lib.rs` | the element |\n| `src/tests.rs` | its tests |\n",
        }
    }

    /// All files of its crate.
    pub(super) fn files(self) -> impl Iterator<Item = File> {
        let own = match self {
            Self::Joint => JOINT,
            Self::Force => FORCE,
            Self::Control => CONTROL,
            Self::Library => LIBRARY,
            Self::C => C,
        };
        let common = if self == Self::C { &[] } else { COMMON };
        common.iter().chain(own).copied()
    }
}

/// A text with its words in double braces replaced.
pub(super) fn fill(text: &str, words: &[(&str, &str)]) -> String {
    let replace = |text: String, (word, value): &(&str, &str)| text.replace(&format!("{{{{{word}}}}}"), value);
    words.iter().fold(text.to_owned(), replace)
}
