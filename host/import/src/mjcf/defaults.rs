//! Classes of defaults: what an element has that does not say so itself.

use std::collections::HashMap;

use roxmltree::{Attribute, Node};

use crate::xml::{Found, child, children, head};

/// The class that everything is of where no other is named.
const MAIN: &str = "main";

/// All classes by their names.
pub(super) struct Classes<'a, 'i> {
    classes: HashMap<&'a str, Class<'a, 'i>>,
}

struct Class<'a, 'i> {
    node: Node<'a, 'i>,
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
        self.nodes.iter().find_map(|node| node.attribute_node(name))
    }

    pub(super) fn text(&self, name: &str) -> Option<&'a str> {
        self.get(name).map(|attribute| attribute.value())
    }
}

impl<'a, 'i: 'a> Classes<'a, 'i> {
    pub(super) fn read(root: Node<'a, 'i>, found: &mut Found) -> Self {
        let mut classes = Self { classes: HashMap::new() };
        for node in children(root).filter(|node| node.has_tag_name("default")) {
            classes.add(node, None, found);
        }
        classes
    }

    fn add(&mut self, node: Node<'a, 'i>, parent: Option<&'a str>, found: &mut Found) {
        let name = match (node.attribute("class"), parent) {
            (Some(name), _) => name,
            (None, None) => MAIN,
            (None, Some(_)) => {
                found.error(head(&node), "a class of defaults within another needs a name", "");
                return;
            }
        };
        if self.classes.insert(name, Class { node, parent }).is_some() {
            found.error(head(&node), format!("the class `{name}` is there twice"), "");
            return;
        }
        for below in children(node).filter(|below| below.has_tag_name("default")) {
            self.add(below, Some(name), found);
        }
    }

    /// An element of a kind, in a body whose class is given.
    pub(super) fn of(&self, node: Node<'a, 'i>, kind: &str, class: Option<&'a str>) -> Of<'a, 'i> {
        let mut nodes = vec![node];
        let mut at = Some(node.attribute("class").or(class).unwrap_or(MAIN));
        while let Some(class) = at.and_then(|name| self.classes.get(name)) {
            nodes.extend(child(class.node, kind));
            at = class.parent;
        }
        Of { nodes }
    }
}
