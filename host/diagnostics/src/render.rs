//! Rendering in the style of a compiler.

use super::source::Part;
use super::{Diagnostic, Label, Severity, Source};
use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet, normalize_untrusted_str};
use std::collections::HashMap;

/// Renders diagnostics one after the other, with an empty line behind each; `color` adds terminal escapes.
///
/// A diagnostic whose labels have no span is printed without a snippet. Control characters of the
/// source, messages and advice are made visible and never reach the terminal.
pub fn render(diagnostics: &[Diagnostic], source: &Source, color: bool) -> String {
    let renderer = if color { Renderer::styled() } else { Renderer::plain() };
    let mut lines = Lines::new();
    let mut out = String::new();
    for diagnostic in diagnostics {
        out.push_str(&renderer.render(&[group(diagnostic, source, &mut lines)]));
        out.push_str("\n\n");
    }
    out
}

/// `"3 errors, 1 warning"`; empty if there is neither. Notes are not counted.
pub fn summary(diagnostics: &[Diagnostic]) -> String {
    let count = |severity: Severity| diagnostics.iter().filter(|diagnostic| diagnostic.severity == severity).count();
    let parts: Vec<String> = [Severity::Error, Severity::Warning]
        .into_iter()
        .map(|severity| (count(severity), severity.word()))
        .filter(|(number, _)| *number > 0)
        .map(|(number, word)| match number {
            1 => format!("1 {word}"),
            _ => format!("{number} {word}s"),
        })
        .collect();
    parts.join(", ")
}

fn group<'a>(diagnostic: &'a Diagnostic, source: &'a Source, lines: &mut Lines) -> Group<'a> {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let mut group = Group::with_title(level.primary_title(diagnostic.message.as_str()).id(diagnostic.code.code));
    for snippet in snippets(&diagnostic.labels, source, lines) {
        group = group.element(snippet);
    }
    for label in diagnostic.labels.iter().filter(|label| !is_placed(label, source)) {
        group = group.element(Level::NOTE.message(normalize_untrusted_str(&label.text)));
    }
    for line in &diagnostic.help {
        group = group.element(Level::HELP.message(normalize_untrusted_str(line)));
    }
    group
}

fn is_placed(label: &Label, source: &Source) -> bool {
    match &label.span {
        Some(span) => source.part(span).is_some(),
        None => label.text.is_empty(),
    }
}

/// Offsets at which the lines of each text start, by the first offset of the text.
type Lines = HashMap<usize, Vec<usize>>;

/// One snippet per text that the labels point into, in the order of the labels.
fn snippets<'a>(labels: &'a [Label], source: &'a Source, lines: &mut Lines) -> Vec<Snippet<'a, Annotation<'a>>> {
    let mut texts: Vec<Vec<(Part<'a>, &'a Label)>> = Vec::new();
    for label in labels {
        let Some(part) = label.span.as_ref().and_then(|span| source.part(span)) else {
            continue;
        };
        match texts.iter_mut().find(|text| text[0].0.start == part.start) {
            Some(text) => text.push((part, label)),
            None => texts.push(vec![(part, label)]),
        }
    }
    texts.iter().map(|text| snippet(text, lines)).collect()
}

/// The snippet of one text, cut to the lines between the first and the last label: the renderer looks at all
/// lines it is given, which for thousands of messages on a large text takes minutes.
fn snippet<'a>(labelled: &[(Part<'a>, &'a Label)], lines: &mut Lines) -> Snippet<'a, Annotation<'a>> {
    let Part { name, text, start, .. } = labelled[0].0;
    let line_starts = lines.entry(start).or_insert_with(|| {
        let newlines = text.match_indices('\n').map(|(newline, _)| newline + 1);
        std::iter::once(0).chain(newlines).collect()
    });
    let ranges = || labelled.iter().map(|(part, _)| &part.range);
    let first = ranges().map(|range| range.start).min().unwrap_or(0);
    let last = ranges().map(|range| range.end).max().unwrap_or(0);
    let first_line = line_starts.partition_point(|&line| line <= first) - 1;
    let next_line = line_starts.partition_point(|&line| line <= last);
    let cut_start = line_starts[first_line];
    let cut_end = line_starts.get(next_line).copied().unwrap_or(text.len());
    let annotations = labelled.iter().map(|(part, label)| {
        let kind = if label.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
        let annotation = kind.span(part.range.start - cut_start..part.range.end - cut_start);
        match label.text.as_str() {
            "" => annotation,
            text => annotation.label(normalize_untrusted_str(text)),
        }
    });
    Snippet::source(&text[cut_start..cut_end])
        .line_start(first_line + 1)
        .path(normalize_untrusted_str(name))
        .annotations(annotations)
}
