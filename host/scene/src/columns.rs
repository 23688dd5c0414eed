//! How tables of numbers are written by hand and by other programs: what stands between their fields, and how a column of times is
//! called.

use std::borrow::Cow;
use std::ops::Range;

use super::dimension::Dimension;
use super::units::{name_and_unit, parse_unit};

/// What some programs write in front of UTF-8.
pub(super) const BYTE_ORDER_MARK: char = '\u{feff}';
/// Stands for any number of blanks between fields.
const BLANK: char = ' ';
const TIME_NAMES: [&str; 2] = ["t", "time"];

/// A line without what stands around it; `None` for one that is empty or a remark.
pub(super) fn content(line: &str) -> Option<&str> {
    let content = line.trim_start_matches(BYTE_ORDER_MARK).trim();
    (!content.is_empty() && !content.starts_with('#')).then_some(content)
}

/// What stands between the fields of a table whose first line has the names: a semicolon, a tab or a comma; blanks where that line has none
/// of them and the next one has several words.
pub(super) fn separator(text: &str) -> char {
    let mut lines = text.split(['\n', '\r']).filter(|line| content(line).is_some());
    let head = lines.next().unwrap_or_default();
    let mark = [';', '\t', ','].into_iter().find(|mark| head.contains(*mark));
    let has_words = |line: &str| line.split_whitespace().nth(1).is_some();
    mark.unwrap_or_else(|| if lines.next().is_some_and(has_words) { BLANK } else { ',' })
}

/// Where the fields of a line are in it; between blanks a unit in brackets belongs to the name before it.
pub(super) fn fields(line: &str, separator: char) -> Vec<Range<usize>> {
    let start = |field: &str| field.as_ptr() as usize - line.as_ptr() as usize;
    let range = |field: &str| start(field)..start(field) + field.len();
    if separator != BLANK {
        return line.split(separator).map(range).collect();
    }
    let mut inside = false;
    let words = line.split(|c: char| {
        inside = (inside || c == '[') && c != ']';
        !inside && (c.is_whitespace() || c == BYTE_ORDER_MARK)
    });
    let mut found: Vec<Range<usize>> = Vec::new();
    for word in words.filter(|word| !word.is_empty()) {
        match found.last_mut() {
            Some(name) if word.starts_with('[') => name.end = range(word).end,
            _ => found.push(range(word)),
        }
    }
    found
}

/// A table with commas between its fields where it has semicolons, tabs or blanks; line by line the same.
#[must_use]
pub fn with_commas(text: &str) -> Cow<'_, str> {
    let separator = separator(text);
    if separator == ',' {
        return Cow::Borrowed(text);
    }
    let mut commas = String::with_capacity(text.len() + 16);
    for line in text.lines() {
        if content(line).is_some() {
            for (k, range) in fields(line, separator).into_iter().enumerate() {
                let field = line[range].trim_matches(|c: char| c.is_whitespace() || c == BYTE_ORDER_MARK);
                let quote = if field.contains(',') && !field.starts_with('"') { "\"" } else { "" };
                let comma = if k > 0 { "," } else { "" };
                commas.extend([comma, quote, field, quote]);
            }
        }
        commas.push('\n');
    }
    Cow::Owned(commas)
}

/// Which column has the times: the first that is just called so, then one with a unit, then one in capitals.
#[must_use]
pub fn column_of_times<S: AsRef<str>>(heads: &[S]) -> Option<usize> {
    let exact = TIME_NAMES.iter().find_map(|name| heads.iter().position(|head| head.as_ref() == *name));
    let is_small = |head: &S| TIME_NAMES.contains(&name_and_unit(head.as_ref()).0);
    let small = || heads.iter().position(is_small);
    exact.or_else(small).or_else(|| heads.iter().position(|head| unit_of_times(head.as_ref()).is_some()))
}

/// The unit in the head of a column, if that is one of times: called `t` or `time`, or the same in capitals without a unit or with one of
/// time.
#[must_use]
pub fn unit_of_times(head: &str) -> Option<Option<&str>> {
    let (name, unit) = name_and_unit(head);
    let of_time = |unit: &str| parse_unit(unit).is_ok_and(|(dimension, _)| dimension == Dimension::TIME);
    let is_time = TIME_NAMES.contains(&name)
        || TIME_NAMES.iter().any(|one| one.eq_ignore_ascii_case(name)) && unit.is_none_or(of_time);
    is_time.then_some(unit)
}
