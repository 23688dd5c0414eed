//! Elements and attributes of an XML text, with their places; mistakes are collected.

use std::ops::Range;

use odyn_diagnostics::{Diagnostic, Severity, codes};
use roxmltree::{Attribute, Document, Node, ParsingOptions};

/// Elements and attributes of a file that are read.
const MOST_NODES: u32 = 2_000_000;
/// Elements within elements.
pub(crate) const DEEPEST: usize = 300;

/// Mistakes found so far.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub(crate) diagnostics: Vec<Diagnostic>,
}

/// Reads a text; entities and document types are refused.
pub(crate) fn parse(text: &str) -> Result<Document<'_>, Diagnostic> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let pos = error.pos();
        let line: usize = text.split_inclusive('\n').take(pos.row.saturating_sub(1) as usize).map(str::len).sum();
        let column = text[line..].chars().take(pos.col.saturating_sub(1) as usize).map(char::len_utf8).sum::<usize>();
        let at = (line + column).min(text.len());
        Diagnostic::error(codes::NOT_IMPORTED, format!("it is not valid XML: {error}")).at(at..at, "")
    })?;
    // Depths are limited, since what follows descends by recursion.
    let deep = document.descendants().find(|node| node.is_element() && node.ancestors().nth(DEEPEST).is_some());
    if let Some(node) = deep {
        let message = format!("more than {DEEPEST} elements within each other");
        return Err(Diagnostic::error(codes::NOT_IMPORTED, message).at(head(&node), "the first that is too deep"));
    }
    Ok(document)
}

/// A text whose XML declaration stands behind a byte order mark or blanks, as MuJoCo and ROS read it: everything before the root is made
/// blank, so that all places stay.
pub(crate) fn declared_late(text: String) -> String {
    let rest = text.trim_start_matches('\u{feff}').trim_start();
    let before = text.len() - rest.len();
    let declaration = rest.starts_with("<?xml").then(|| rest.find("?>").map(|end| end + 2)).flatten();
    match declaration {
        Some(length) if before > 0 => {
            let (head, root) = text.split_at(before + length);
            let blank = head.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' });
            blank.chain(root.chars()).collect()
        }
        _ => text,
    }
}

/// Where the name of an element stands.
pub(crate) fn head(node: &Node<'_, '_>) -> Range<usize> {
    let start = node.range().start;
    start..(start + 1 + node.tag_name().name().len()).min(node.range().end)
}

/// The elements inside of one.
pub(crate) fn children<'a, 'i: 'a>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

/// The first element of a name.
pub(crate) fn child<'a, 'i: 'a>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node).find(|child| child.has_tag_name(name))
}

/// What to do about a text that is not made of numbers.
fn no_numbers(text: &str) -> &'static str {
    if text.contains("${") || text.contains("$(") {
        "a .xacro file is expanded by its own program first: xacro FILE.xacro > FILE.urdf"
    } else if text.contains(',') {
        "numbers have a point before their decimals, and blanks between them, no commas"
    } else {
        "plain finite numbers with blanks between them, without units, names or expressions"
    }
}

impl Found {
    /// Reports a mistake at a place.
    pub(crate) fn error(&mut self, at: Range<usize>, message: impl Into<String>, help: &str) {
        let diagnostic = Diagnostic::error(codes::NOT_IMPORTED, message).at(at, "");
        self.diagnostics.push(if help.is_empty() { diagnostic } else { diagnostic.help(help) });
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|found| found.severity == Severity::Error)
    }

    /// The text of an attribute that has to be there.
    pub(crate) fn needed<'a>(&mut self, node: Node<'a, '_>, name: &str) -> Option<&'a str> {
        let value = node.attribute(name);
        if value.is_none() {
            let message = format!("<{}> has no attribute `{name}`", node.tag_name().name());
            self.error(head(&node), message, "");
        }
        value
    }

    /// All numbers of an attribute.
    pub(crate) fn numbers(&mut self, attribute: &Attribute<'_, '_>) -> Option<Vec<f64>> {
        let numbers: Option<Vec<f64>> = attribute
            .value()
            .split_whitespace()
            .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
            .collect();
        if numbers.is_none() {
            let message = format!("`{}` is not made of numbers: \"{}\"", attribute.name(), attribute.value());
            self.error(attribute.range_value(), message, no_numbers(attribute.value()));
        }
        numbers
    }

    /// An attribute of so many numbers; `None` where it is missing or wrong, which is reported.
    pub(crate) fn list<const N: usize>(&mut self, attribute: Option<Attribute<'_, '_>>) -> Option<[f64; N]> {
        let attribute = attribute?;
        let numbers = self.numbers(&attribute)?;
        let count = numbers.len();
        let list = numbers.try_into().ok();
        if list.is_none() {
            let message = format!("`{}` has {count} numbers, {N} are needed", attribute.name());
            self.error(attribute.range_value(), message, "");
        }
        list
    }

    /// An attribute of one number.
    pub(crate) fn number(&mut self, attribute: Option<Attribute<'_, '_>>) -> Option<f64> {
        self.list::<1>(attribute).map(|[number]| number)
    }

    /// An attribute of one number that is not negative.
    pub(crate) fn not_negative(&mut self, attribute: Option<Attribute<'_, '_>>) -> Option<f64> {
        let number = self.number(attribute)?;
        if number < 0.0 {
            let attribute = attribute?;
            self.error(attribute.range_value(), format!("`{}` is negative", attribute.name()), "");
            return None;
        }
        Some(number)
    }
}
