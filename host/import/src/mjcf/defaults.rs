//! Classes of defaults: what an element has that does not say so itself.

use std::collections::HashMap;

use odyn_diagnostics::{Diagnostic, codes, help_for};
use roxmltree::{Attribute, Node};

use crate::xml::{Found, children, head};

/// The class that everything is of where no other is named, unless the file calls it otherwise.
const MAIN: &str = "main";

/// All classes by their names.
pub(super) struct Classes<'a, 'i> {
    classes: HashMap<&'a str, Class<'a, 'i>>,
    main: &'a str,
}

#[derive(Default)]
struct Class<'a, 'i> {
    /// The last of them counts.
    nodes: Vec<Node<'a, 'i>>,
    parent: Option<&'a str>,
}

/// An element with its class, and those that the class is made from.
pub(super) struct Of<'a, 'i> {
    /// The element itself first.
    nodes: Vec<Node<'a, 'i>>,
}

impl<'a, 'i> Of<'a, 'i> {
    /// An element that has no defaults.
    pub(super) fn alone(node: Node<'a, 'i>) -> Self {
        Self { nodes: vec![node] }
    }

    /// The attribute, of the element or of the nearest class that has it.
    pub(super) fn get(&self, name: &str) -> Option<Attribute<'a, 'i>> {
        self.all(name).next()
    }

    /// The attribute of the element and of each class that has it, the nearest first.
    pub(super) fn all(&self, name: &str) -> impl Iterator<Item = Attribute<'a, 'i>> {
        self.nodes.iter().filter_map(move |node| node.attribute_node(name))
    }

    pub(super) fn text(&self, name: &str) -> Option<&'a str> {
        self.get(name).map(|attribute| attribute.value())
    }

    /// The element, or the nearest class, that has one of some attributes, by itself: of several ways to say one thing it says which.
    pub(super) fn nearest(&self, names: &[&str]) -> Option<Self> {
        let has_one = |node: &&Node<'a, 'i>| names.iter().any(|name| node.has_attribute(*name));
        self.nodes.iter().find(has_one).map(|node| Self::alone(*node))
    }
}

impl<'a, 'i: 'a> Classes<'a, 'i> {
    pub(super) fn read(root: Node<'a, 'i>, found: &mut Found) -> Self {
        let mut top = children(root).filter(|node| node.has_tag_name("default"));
        let main = top.find_map(|node| node.attribute("class")).unwrap_or(MAIN);
        let mut classes = Self { classes: HashMap::from([(main, Class::default())]), main };
        for node in children(root).filter(|node| node.has_tag_name("default")) {
            classes.add(node, None, found);
        }
        classes
    }

    fn add(&mut self, node: Node<'a, 'i>, parent: Option<&'a str>, found: &mut Found) {
        let name = match (node.attribute("class"), parent) {
            (Some(name), _) => name,
            (None, None) => self.main,
            (None, Some(_)) => {
                found.error(head(&node), "a class of defaults within another needs a name", "");
                return;
            }
        };
        // The outermost class may be given in parts, as included files do.
        if name != self.main && self.classes.contains_key(name) {
            found.error(head(&node), format!("the class `{name}` is there twice"), "");
            return;
        }
        let class = self.classes.entry(name).or_default();
        class.nodes.push(node);
        class.parent = parent;
        for below in children(node).filter(|below| below.has_tag_name("default")) {
            self.add(below, Some(name), found);
        }
    }

    /// An element of a kind, in a body whose class is given.
    pub(super) fn of(&self, node: Node<'a, 'i>, kind: &str, class: Option<&'a str>) -> Of<'a, 'i> {
        self.of_one_of(node, &[kind], class)
    }

    /// The same where several kinds of elements have their defaults in common: the last counts.
    pub(super) fn of_one_of(&self, node: Node<'a, 'i>, kinds: &[&str], class: Option<&'a str>) -> Of<'a, 'i> {
        let mut nodes = vec![node];
        let mut at = Some(node.attribute("class").or(class).unwrap_or(self.main));
        while let Some(class) = at.and_then(|name| self.classes.get(name)) {
            let wanted = |node: &Node<'_, '_>| kinds.contains(&node.tag_name().name());
            for class in class.nodes.iter().rev() {
                let mut given: Vec<Node<'_, '_>> = children(*class).filter(wanted).collect();
                given.reverse();
                nodes.extend(given);
            }
            at = class.parent;
        }
        Of { nodes }
    }

    /// Reports elements of classes that are not there.
    pub(super) fn check(&self, root: Node<'a, 'i>, found: &mut Found) {
        let known: Vec<&str> = self.classes.keys().copied().collect();
        let outside = root.descendants().filter(|node| node.is_element() && !node.has_tag_name("default"));
        for named in outside.flat_map(|node| ["class", "childclass"].map(|name| node.attribute_node(name))).flatten() {
            if !self.classes.contains_key(named.value()) {
                let unknown = Diagnostic::error(codes::NOT_IMPORTED, format!("there is no class `{}`", named.value()));
                let unknown = unknown.at(named.range_value(), "").help_if(help_for(named.value(), &known, "classes"));
                found.diagnostics.push(unknown);
            }
        }
    }
}
