//! `modelDescription.xml` (FMI 2.0.4 section 2.2, FMI 3.0.2 section 2.4): what of it co-simulation needs.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Document, Node, ParsingOptions};

use crate::Unusable;
use crate::unit::Unit;

/// Elements and attributes that are read.
const MOST_NODES: u32 = 2_000_000;
/// Bytes of the text.
pub(crate) const LONGEST: u64 = 256 << 20;

/// A version of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Version {
    Two,
    Three,
}

/// How a variable is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Storage {
    Float64,
    Float32,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Boolean,
    Text,
}

/// What a variable is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Causality {
    Input,
    Output,
    Parameter,
}

/// A variable that the host may set or ask for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Variable {
    pub(crate) name: String,
    /// The number by which the functions know it.
    pub(crate) reference: u32,
    pub(crate) storage: Storage,
    pub(crate) causality: Causality,
    pub(crate) unit: Unit,
    /// As written.
    pub(crate) start: Option<String>,
    pub(crate) doc: String,
}

/// What an FMU says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    pub(crate) version: Version,
    /// As written, such as `2.0`.
    pub fmi: String,
    /// Name of the model.
    pub model: String,
    /// Version of the model; may be empty.
    pub model_version: String,
    /// What made it; may be empty.
    pub tool: String,
    /// One sentence; may be empty.
    pub about: String,
    pub(crate) identifier: String,
    pub(crate) token: String,
    pub(crate) keeps_state: bool,
    pub(crate) only_once: bool,
    pub(crate) any_step: bool,
    /// The communication step that it asks for, s.
    pub(crate) step: Option<f64>,
    pub(crate) variables: Vec<Variable>,
}

/// A place in the text.
fn place(document: &Document<'_>, node: &Node<'_, '_>) -> String {
    let at = document.text_pos_at(node.range().start);
    format!("modelDescription.xml, line {}, column {}", at.row, at.col)
}

/// The text of a file that somebody's tool wrote, in one line and not endless.
fn tame(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(300).collect();
    text.trim().to_string()
}

impl Description {
    /// Reads the text.
    ///
    /// # Errors
    /// What is wrong, with line and column; an FMU without co-simulation, or of another version.
    pub(crate) fn read(text: &str) -> Result<Self, Unusable> {
        // Document types, and with them entities, are refused.
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options).map_err(|error| {
            let at = error.pos();
            Unusable::damaged(format!("modelDescription.xml, line {}, column {}: {error}", at.row, at.col))
        })?;
        let root = document.root_element();
        let wrong = |node: &Node<'_, '_>, what: &str| Unusable::damaged(format!("{}: {what}", place(&document, node)));
        if !root.has_tag_name("fmiModelDescription") {
            return Err(wrong(
                &root,
                &format!("the root is <{}>, not <fmiModelDescription>", tame(root.tag_name().name())),
            ));
        }
        let needed = |node: &Node<'_, '_>, name: &str| {
            let value = node.attribute(name).map(str::to_string);
            value.ok_or_else(|| wrong(node, &format!("<{}> has no attribute `{name}`", node.tag_name().name())))
        };
        let fmi = needed(&root, "fmiVersion")?;
        let version = match fmi.split('.').next() {
            Some("2") => Version::Two,
            Some("3") if !fmi.contains('-') => Version::Three,
            _ => {
                let message = format!("it is written for version {} of the interface", tame(&fmi));
                return Err(Unusable::here(message, "versions 2.0 and 3.0 can be used: export it for one of them"));
            }
        };
        let child = |node: &Node<'_, '_>, name: &str| {
            node.children().find(|child| child.is_element() && child.has_tag_name(name)).map(|found| found.id())
        };
        let Some(way) = child(&root, "CoSimulation").and_then(|id| document.get_node(id)) else {
            let others =
                ["ModelExchange", "ScheduledExecution"].into_iter().filter(|name| child(&root, name).is_some());
            let others: Vec<&str> = others.collect();
            let message = format!(
                "it has no co-simulation, only {}",
                if others.is_empty() { "nothing".into() } else { others.join(", ") }
            );
            return Err(Unusable::here(
                message,
                "export it for co-simulation: the element steps from one communication point to the next",
            ));
        };
        let flag = |node: &Node<'_, '_>, name: &str| matches!(node.attribute(name), Some("true" | "1"));
        if flag(&way, "needsExecutionTool") {
            let tool = tame(root.attribute("generationTool").unwrap_or("the tool that made it"));
            return Err(Unusable::here(
                format!("it needs {tool} while it runs (needsExecutionTool)"),
                "export it as one that stands alone",
            ));
        }
        let identifier = needed(&way, "modelIdentifier")?;
        if identifier.is_empty()
            || !identifier.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'))
        {
            return Err(wrong(&way, "`modelIdentifier` is no name of a library"));
        }
        let (keeps, serialises, token) = match version {
            Version::Two => ("canGetAndSetFMUstate", "canSerializeFMUstate", "guid"),
            Version::Three => ("canGetAndSetFMUState", "canSerializeFMUState", "instantiationToken"),
        };
        let experiment = child(&root, "DefaultExperiment").and_then(|id| document.get_node(id));
        let step = experiment.and_then(|node| node.attribute("stepSize")).or(way.attribute("fixedInternalStepSize"));
        let step = step.and_then(|text| text.trim().parse::<f64>().ok()).filter(|step| *step > 0.0 && step.is_finite());
        let units = units(&document, &root)?;
        let types = types(&root);
        let list = child(&root, "ModelVariables").and_then(|id| document.get_node(id));
        let list = list.ok_or_else(|| wrong(&root, "there is no <ModelVariables>"))?;
        let mut variables = Vec::new();
        let mut names = BTreeSet::new();
        for node in list.children().filter(Node::is_element) {
            let name = needed(&node, "name")?;
            if !names.insert(name.clone()) {
                return Err(wrong(&node, &format!("there are two variables `{}`", tame(&name))));
            }
            let causality = match node.attribute("causality") {
                Some("input") => Causality::Input,
                Some("output") => Causality::Output,
                Some("parameter") => Causality::Parameter,
                _ => continue,
            };
            let kind = match version {
                Version::Two => node.children().find(Node::is_element),
                Version::Three => Some(node),
            };
            let kind = kind.ok_or_else(|| wrong(&node, &format!("`{}` has no type", tame(&name))))?;
            // Arrays keep their start values.
            if child(&node, "Dimension").is_some() {
                continue;
            }
            let Some(storage) = storage(kind.tag_name().name(), version) else { continue };
            let reference = needed(&node, "valueReference")?;
            let reference =
                reference.trim().parse().map_err(|_| wrong(&node, "`valueReference` is no whole number"))?;
            let declared = kind.attribute("declaredType").and_then(|name| types.get(name).copied());
            let unit = kind.attribute("unit").or(declared.and_then(|node| node.attribute("unit")));
            let mut unit = match unit {
                Some(name) => units.get(name).cloned().unwrap_or_else(|| Unit::named(name)),
                None => Unit::unknown(),
            };
            let relative = |node: &Node<'_, '_>| flag(node, "relativeQuantity");
            if relative(&kind) || declared.as_ref().is_some_and(relative) {
                unit.offset = 0.0;
            }
            let start =
                child(&kind, "Start").and_then(|id| document.get_node(id)).and_then(|node| node.attribute("value"));
            let start = kind.attribute("start").or(start).map(str::to_string);
            let number = |text: &str| storage == Storage::Text || number(storage, text).is_some();
            if let Some(text) = start.as_deref().filter(|text| !number(text)) {
                return Err(wrong(
                    &node,
                    &format!("the start value \"{}\" of `{}` is no number of its type", tame(text), tame(&name)),
                ));
            }
            let doc = tame(node.attribute("description").unwrap_or_default());
            variables.push(Variable { name, reference, storage, causality, unit, start, doc });
        }
        Ok(Self {
            version,
            model: tame(&needed(&root, "modelName")?),
            model_version: tame(root.attribute("version").unwrap_or_default()),
            tool: tame(root.attribute("generationTool").unwrap_or_default()),
            about: tame(root.attribute("description").unwrap_or_default()),
            identifier,
            token: needed(&root, token)?,
            keeps_state: flag(&way, keeps) && flag(&way, serialises),
            only_once: flag(&way, "canBeInstantiatedOnlyOncePerProcess"),
            any_step: flag(&way, "canHandleVariableCommunicationStepSize"),
            step,
            variables,
            fmi,
        })
    }

    /// The variables of a causality.
    pub(crate) fn of(&self, causality: Causality) -> impl Iterator<Item = &Variable> {
        self.variables.iter().filter(move |variable| variable.causality == causality)
    }
}

fn storage(word: &str, version: Version) -> Option<Storage> {
    Some(match (word, version) {
        ("Real", Version::Two) | ("Float64", Version::Three) => Storage::Float64,
        ("Float32", Version::Three) => Storage::Float32,
        ("Integer" | "Enumeration", Version::Two) | ("Int32", Version::Three) => Storage::Int32,
        ("Int8", Version::Three) => Storage::Int8,
        ("UInt8", Version::Three) => Storage::UInt8,
        ("Int16", Version::Three) => Storage::Int16,
        ("UInt16", Version::Three) => Storage::UInt16,
        ("UInt32", Version::Three) => Storage::UInt32,
        ("Int64" | "Enumeration", Version::Three) => Storage::Int64,
        ("UInt64", Version::Three) => Storage::UInt64,
        ("Boolean", _) => Storage::Boolean,
        ("String", _) => Storage::Text,
        // Clocks and bytes.
        _ => return None,
    })
}

/// A start value as a number.
pub(crate) fn number(storage: Storage, text: &str) -> Option<f64> {
    let text = text.trim();
    match storage {
        Storage::Boolean => match text {
            "true" | "1" => Some(1.0),
            "false" | "0" => Some(0.0),
            _ => None,
        },
        Storage::Text => None,
        Storage::Float64 | Storage::Float32 => text.parse().ok().filter(|value: &f64| value.is_finite()),
        _ => text.parse::<i64>().ok().map(|value| value as f64),
    }
}

/// The units that are defined, by their names.
fn units(document: &Document<'_>, root: &Node<'_, '_>) -> Result<BTreeMap<String, Unit>, Unusable> {
    let mut units = BTreeMap::new();
    let lists = root.children().filter(|node| node.has_tag_name("UnitDefinitions"));
    for node in lists.flat_map(|list| list.children()).filter(|node| node.has_tag_name("Unit")) {
        let Some(name) = node.attribute("name") else { continue };
        let Some(base) = node.children().find(|child| child.has_tag_name("BaseUnit")) else { continue };
        let wrong = |attribute: &str| {
            Unusable::damaged(format!("{}: `{attribute}` of a unit is no number", place(document, &base)))
        };
        let power = |attribute: &str| match base.attribute(attribute) {
            None => Ok(0),
            Some(text) => text.trim().parse::<i32>().map_err(|_| wrong(attribute)),
        };
        let size = |attribute: &str, default: f64| match base.attribute(attribute) {
            None => Ok(default),
            Some(text) => {
                text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| wrong(attribute))
            }
        };
        let (factor, offset) = (size("factor", 1.0)?, size("offset", 0.0)?);
        if factor == 0.0 {
            return Err(wrong("factor"));
        }
        let others = ["A", "K", "mol", "cd"].map(power).into_iter().collect::<Result<Vec<_>, _>>()?;
        let unit = match others.iter().all(|power| *power == 0) {
            true => Unit::of_base([power("kg")?, power("m")?, power("s")?, power("rad")?], factor, offset),
            false => Unit::unknown(),
        };
        units.insert(name.to_string(), unit);
    }
    Ok(units)
}

/// The types that are defined, by their names: the nodes that may have a unit.
fn types<'a, 'i>(root: &Node<'a, 'i>) -> BTreeMap<&'a str, Node<'a, 'i>> {
    let lists = root.children().filter(|node| node.has_tag_name("TypeDefinitions"));
    let types = lists.flat_map(|list| list.children()).filter(Node::is_element);
    let named = types.filter_map(|node| {
        let inner = if node.has_tag_name("SimpleType") { node.children().find(Node::is_element)? } else { node };
        Some((node.attribute("name")?, inner))
    });
    named.collect()
}
