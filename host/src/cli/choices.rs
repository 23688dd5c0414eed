//! Which libraries were passed over, for commands that run many scenes and show no warnings of each.

use std::path::{Path, PathBuf};

use odyn::catalog::{Request, SearchPath};
use odyn::diagnostics::{Diagnostic, Source, render};
use odyn::scene::{Override, read};
use odyn::session::{requests, search_path};

use super::terminal::{self, Stream};

/// Reports each choice between different libraries of one name once. Scenes that can't be read are reported elsewhere.
pub(super) fn tell<'a>(scenes: impl IntoIterator<Item = &'a Path>, overrides: &[Override], plugins: &[PathBuf]) {
    let mut seen: Vec<(SearchPath, Request)> = Vec::new();
    let mut notes: Vec<Diagnostic> = Vec::new();
    for path in scenes {
        let Ok((scene, _)) = read(path, overrides) else { continue };
        let search = search_path(&scene, path, plugins);
        for request in requests(&scene) {
            if seen.iter().any(|(s, r)| *s == search && *r == request) {
                continue;
            }
            let note = search.choose(&request).ok().and_then(|choice| choice.note(&request));
            notes.extend(note.filter(|note| !notes.contains(note)));
            seen.push((search.clone(), request));
        }
    }
    eprint!("{}", render(&notes, &Source::new("", ""), terminal::color(Stream::Error)));
}
