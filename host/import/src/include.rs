//! `<include file="...">` of MJCF: the elements of another file in its place.

use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use odyn_diagnostics::{Diagnostic, Source, codes};

use crate::{LONGEST, Refused, file_text, xml};

/// Files that are read for one scene.
const MOST_FILES: usize = 1000;

/// A text with all that it includes, whose places are known in the files that they come from.
#[derive(Debug)]
pub(crate) struct Whole {
    pub(crate) text: String,
    /// The file first, then those that it includes.
    pub(crate) source: Source,
    pieces: Vec<Piece>,
}

/// A part of the whole.
#[derive(Debug)]
struct Piece {
    /// Where it begins in the whole, and in the source.
    start: usize,
    at: usize,
    length: usize,
}

impl Whole {
    /// Takes the elements of all files that a text names, relative to `folder` (the folder of the first file, also for names
    /// within included files; MuJoCo, XML reference, "include").
    ///
    /// # Errors
    /// A file that cannot be read, is included twice, or is no XML.
    pub(crate) fn read(source: Source, folder: &Path) -> Result<Self, Box<Refused>> {
        let text = source.text.clone();
        let mut whole = Self { text: String::with_capacity(text.len()), source, pieces: Vec::new() };
        match whole.add(&text, 0, folder, &mut HashSet::new(), true) {
            Ok(()) => Ok(whole),
            Err(error) => Err(Box::new(Refused { diagnostics: vec![error], source: whole.source })),
        }
    }

    /// Adds a text that begins at `at` in the source; of an included one, what is inside of its root.
    fn add(
        &mut self,
        text: &str,
        at: usize,
        folder: &Path,
        seen: &mut HashSet<PathBuf>,
        first: bool,
    ) -> Result<(), Diagnostic> {
        let moved = |range: Range<usize>| at + range.start..at + range.end;
        let document = xml::parse(text).map_err(|mut error| {
            for span in error.labels.iter_mut().filter_map(|label| label.span.as_mut()) {
                *span = moved(span.clone());
            }
            error
        })?;
        let root = document.root_element();
        let range = match (first, root.first_child(), root.last_child()) {
            (true, ..) => 0..text.len(),
            (false, Some(a), Some(b)) => a.range().start..b.range().end,
            (false, ..) => return Ok(()),
        };
        let mut from = range.start;
        let mujoco = !first || root.has_tag_name("mujoco");
        for node in root.descendants().filter(|node| mujoco && node.has_tag_name("include")) {
            let wrong = |message: String, help: &str| {
                Err(Diagnostic::error(codes::NOT_IMPORTED, message).at(moved(xml::head(&node)), "").help(help))
            };
            let Some(name) = node.attribute("file") else {
                return wrong("<include> has no attribute `file`".into(), "name the file whose elements stand here");
            };
            self.piece(&text[from..node.range().start], at + from);
            from = node.range().end;
            let path = folder.join(name);
            if !seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone())) {
                return wrong(format!("`{name}` is included twice"), "a file can be included once");
            }
            if seen.len() > MOST_FILES {
                return wrong(format!("more than {MOST_FILES} files are included"), "write the model into fewer files");
            }
            let below = match file_text(&path) {
                Ok(below) => below,
                Err(reason) => return wrong(reason, "names of included files are relative to the first file"),
            };
            if self.text.len() as u64 + below.len() as u64 > LONGEST {
                return wrong(format!("the whole is longer than {} MB", LONGEST >> 20), "import a part of it");
            }
            let start = self.source.add(path.display().to_string(), below.clone());
            self.add(&below, start, folder, seen, false)?;
        }
        self.piece(&text[from..range.end], at + from);
        Ok(())
    }

    fn piece(&mut self, text: &str, at: usize) {
        self.pieces.push(Piece { start: self.text.len(), at, length: text.len() });
        self.text.push_str(text);
    }

    /// Points a message about the whole into the files that it is made of.
    pub(crate) fn place(&self, diagnostic: &mut Diagnostic) {
        for span in diagnostic.labels.iter_mut().filter_map(|label| label.span.as_mut()) {
            let (start, most) = self.at(span.start);
            *span = start..start + span.len().min(most);
        }
    }

    /// Where an offset of the whole is in the source, and how much of its file follows.
    fn at(&self, offset: usize) -> (usize, usize) {
        let last = self.pieces.partition_point(|piece| piece.start <= offset).saturating_sub(1);
        let Some(piece) = self.pieces.get(last) else { return (offset, usize::MAX) };
        let inside = (offset - piece.start).min(piece.length);
        (piece.at + inside, piece.length - inside)
    }

    /// The line of an offset, such as: line 3; of an included file with its name.
    pub(crate) fn line(&self, offset: usize) -> String {
        let at = self.source.locate(self.at(offset).0);
        let file = if at.name == self.source.name { String::new() } else { format!(" of {}", at.name) };
        format!("line {}{file}", at.line)
    }
}
