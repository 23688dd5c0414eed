//! The documentation of an element's file as its manual page.

/// The leading `//!` lines of a source file, for [`crate::Element::DOC`]:
///
/// ```ignore
/// const DOC: &'static str = doc_of(include_str!("revolute.rs"));
/// ```
///
/// Evaluated by the compiler; only these lines end up in the library. [`manual_page`] takes the markers away.
#[must_use]
pub const fn doc_of(source: &'static str) -> &'static str {
    let bytes = source.as_bytes();
    let mut end = 0;
    while end + 2 < bytes.len() && bytes[end] == b'/' && bytes[end + 1] == b'/' && bytes[end + 2] == b'!' {
        while end < bytes.len() && bytes[end] != b'\n' {
            end += 1;
        }
        if end < bytes.len() {
            end += 1;
        }
    }
    // A line ends here, hence a character.
    source.split_at(end).0
}

/// A text as it is meant to be read: without the `//! ` of [`doc_of`], where there are any.
#[must_use]
pub fn manual_page(doc: &str) -> String {
    let mut page = String::with_capacity(doc.len());
    for line in doc.lines() {
        let text = line.strip_prefix("//!").map_or(line, |rest| rest.strip_prefix(' ').unwrap_or(rest));
        page.push_str(text.trim_end());
        page.push('\n');
    }
    page.truncate(page.trim_end().len());
    page.drain(..page.len() - page.trim_start().len());
    page
}

/// The fenced blocks of a manual page that are marked `toml`: minimal scenes.
#[must_use]
pub fn scenes_of(page: &str) -> Vec<String> {
    let mut scenes = Vec::new();
    let mut open: Option<String> = None;
    for line in page.lines() {
        match &mut open {
            None if line.trim() == "```toml" => open = Some(String::new()),
            None => {}
            Some(_) if line.trim() == "```" => scenes.extend(open.take()),
            Some(scene) => {
                scene.push_str(line);
                scene.push('\n');
            }
        }
    }
    scenes
}
