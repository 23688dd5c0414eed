//! [`shown`]: texts of others on a terminal.

use std::borrow::Cow;

/// A text with its control characters made visible, so that a terminal shows them and does not obey: those of ASCII as their
/// pictures (`␛`), those of the upper half and those that turn the direction of writing by their numbers. Line ends and tabs
/// stay.
#[must_use]
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.chars().any(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match u32::from(c) {
            _ if !is_obeyed(c) => out.push(c),
            // The pictures stand in the order of the characters.
            code @ 0..=0x1f => out.push(char::from_u32(0x2400 + code).unwrap_or('?')),
            0x7f => out.push('\u{2421}'),
            code => out.push_str(&format!("<{code:04X}>")),
        }
    }
    Cow::Owned(out)
}

/// The same for a text that must stay on one line.
#[must_use]
pub fn shown_on_one_line(text: &str) -> String {
    shown(text).replace('\n', "\u{240a}")
}

/// `1 element`, `2 elements`
#[must_use]
pub fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Whether a terminal may do something else than show it.
fn is_obeyed(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{061c}');
    (c.is_control() && c != '\n' && c != '\t') || turns
}
