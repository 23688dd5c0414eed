//! The text a diagnostic points into.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A named text, together with the command-line texts that change it.
///
/// Spans are byte ranges of `text`. A text added with [`Source::add`] continues the numbering behind
/// it, so that one kind of span points into either and no room has to distinguish them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// What is printed in front of line and column, usually the path as the user gave it.
    pub name: String,
    /// The whole text, UTF-8. Copies of a source share it.
    pub text: Arc<str>,
    additions: Vec<Addition>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Addition {
    name: String,
    text: String,
    /// First offset of this text in the common numbering.
    start: usize,
}

/// A place as a user counts it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// Name of the text.
    pub name: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// One text with the part of a span that falls into it.
pub(super) struct Part<'a> {
    /// Name of the text.
    pub name: &'a str,
    /// The text.
    pub text: &'a str,
    /// First offset of the text in the common numbering; identifies it.
    pub start: usize,
    /// Range inside `text`, on character boundaries.
    pub range: Range<usize>,
}

impl Source {
    /// A file that this text names: beside it, if it is not absolute.
    #[must_use]
    pub fn beside(&self, file: impl AsRef<Path>) -> PathBuf {
        Path::new(&self.name).parent().unwrap_or(Path::new("")).join(file)
    }

    /// A source without additions.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let text: String = text.into();
        Source { name: name.into(), text: text.into(), additions: Vec::new() }
    }

    /// Adds a further text (such as a `--set` argument) and returns its first offset: the byte `k` of
    /// the added text has the offset `returned + k` in every span.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> usize {
        let start = self.end() + 1; // the gap keeps "end of one text" and "start of the next" apart
        self.additions.push(Addition { name: name.into(), text: text.into(), start });
        start
    }

    /// The bytes of a span; `None` if it lies outside of all texts or splits a character.
    pub fn slice(&self, span: Range<usize>) -> Option<&str> {
        if span.end <= self.text.len() {
            return self.text.get(span);
        }
        let found = self.addition(span.start)?;
        found.text.get(span.start - found.start..span.end.checked_sub(found.start)?)
    }

    /// Where an offset lies, as a user counts; offsets beyond all texts give the end of `text`.
    pub fn locate(&self, offset: usize) -> Location {
        let (name, text, inner) = match self.addition(offset) {
            Some(found) => (&found.name, &*found.text, offset - found.start),
            None => (&self.name, &*self.text, offset),
        };
        let inner = floor_char_boundary(text, inner);
        let before = &text[..inner];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Location {
            name: name.clone(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// The text a span falls into, with the span clamped to it; `None` if it falls into none.
    pub(super) fn part(&self, span: &Range<usize>) -> Option<Part<'_>> {
        let (name, text, start) = if span.start <= self.text.len() {
            (&self.name, &*self.text, 0)
        } else {
            let found = self.addition(span.start)?;
            (&found.name, &*found.text, found.start)
        };
        let first = floor_char_boundary(text, span.start - start);
        let last = floor_char_boundary(text, span.end.saturating_sub(start)).max(first);
        Some(Part { name, text, start, range: first..last })
    }

    fn addition(&self, offset: usize) -> Option<&Addition> {
        self.additions.iter().find(|addition| (addition.start..=addition.end()).contains(&offset))
    }

    fn end(&self) -> usize {
        self.additions.last().map_or(self.text.len(), Addition::end)
    }
}

impl Addition {
    fn end(&self) -> usize {
        self.start + self.text.len()
    }
}

/// Line and column of an offset, both from 1, the column in characters; see [`Source::locate`].
pub fn line_column(source: &Source, offset: usize) -> (usize, usize) {
    let location = source.locate(offset);
    (location.line, location.column)
}

/// The largest character boundary not above `offset`.
fn floor_char_boundary(text: &str, offset: usize) -> usize {
    let mut boundary = offset.min(text.len());
    while !text.is_char_boundary(boundary) {
        boundary -= 1;
    }
    boundary
}
