//! The documentation of a file as an element's manual page.

use crate::documentation::{doc_of, manual_page, scenes_of};

const SOURCE: &str = "//! A hinge.\n//!\n//! ## Equations\n//!     d = 0   \n//!\n//! ## Example\n//! ```toml\n//! [scene]\n//! t_end = 0.1\n//! ```\n//! ```text\n//! not = 'a scene'\n//! ```\n\nuse nothing;\n//! not here\n";

#[test]
fn the_page_is_the_leading_documentation() {
    const DOC: &str = doc_of(SOURCE);
    let page = manual_page(DOC);
    assert!(page.starts_with("A hinge.\n\n## Equations\n    d = 0\n\n## Example"), "{page}");
    assert!(page.ends_with("not = 'a scene'\n```"), "{page}");
    assert!(!page.contains("//!") && !page.contains("not here"), "{page}");
}

#[test]
fn sources_without_documentation_and_documentation_without_end_are_read() {
    for (source, doc) in [
        ("", ""),
        ("use x;\n//! late", ""),
        ("//! only", "//! only"),
        ("//! a\n", "//! a\n"),
        ("// a\n", ""),
        ("//!", "//!"),
    ] {
        assert_eq!(doc_of(source), doc, "{source:?}");
    }
    // A character of several bytes is not cut.
    assert_eq!(manual_page(doc_of("//! \u{3c6} = \u{3c0}\nfn f() {}")), "\u{3c6} = \u{3c0}");
}

#[test]
fn a_text_without_markers_is_its_own_page() {
    assert_eq!(manual_page("A hinge.  \n\nTurns.\n\n"), "A hinge.\n\nTurns.");
}

#[test]
fn scenes_are_the_blocks_marked_toml() {
    let page = manual_page(doc_of(SOURCE));
    assert_eq!(scenes_of(&page), ["[scene]\nt_end = 0.1\n"]);
    assert_eq!(scenes_of("```toml\na = 1\n```\ntext\n```toml\nb = 2\n\nc = 3\n```"), ["a = 1\n", "b = 2\n\nc = 3\n"]);
    assert_eq!(scenes_of("```\na = 1\n```\nno scene"), Vec::<String>::new());
    // A block that is not closed is not a scene.
    assert_eq!(scenes_of("```toml\na = 1\n"), Vec::<String>::new());
}

#[test]
fn descriptors_carry_the_page() {
    let descriptor = crate::adapt::force::<crate::tests::signals::Governor>().descriptor().clone();
    assert_eq!(
        descriptor.doc,
        "Signals and reactions: a force with a signal as its input, and by how much joints are loaded."
    );
}
