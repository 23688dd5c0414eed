//! [`Watched`]: what of an element is looked at while a scene runs, and warned of where it leaves its bounds.

use element_api::params::{ParamKind, ParamSpec, ParamType, Table as Params};
use element_api::recording::Op;
use element_api::{Descriptor, Kind, Recording};

use super::tables;
use super::types::{GridUse, Instance, Model};

/// A value of an element that is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchedValue {
    /// A value that it reports.
    Channel(usize),
    /// The margin of a check that it declares; may not become negative.
    Check(usize),
    /// An argument of a grid, or of a curve of a joint, [`Instance::grids`]; may not leave it.
    Grid(usize),
}

/// See the module documentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watched {
    /// Which element.
    pub element: usize,
    /// What of it.
    pub value: WatchedValue,
}

impl Model {
    /// What is looked at: arguments of grids and of curves of joints; checks; of elements with a section in reports, all they report.
    #[must_use]
    pub fn watched(&self) -> Vec<Watched> {
        let of = |(element, instance): (usize, &Instance)| {
            let channels = if instance.has_section() { instance.class.channels.len() } else { 0 };
            let channels = (0..channels).map(WatchedValue::Channel);
            let checks = if instance.class.kind == Kind::Joint { 0 } else { instance.class.checks.len() };
            let checks = (0..checks).map(WatchedValue::Check);
            let grids = (0..instance.grids.len()).map(WatchedValue::Grid);
            channels.chain(checks).chain(grids).map(move |value| Watched { element, value }).collect::<Vec<_>>()
        };
        self.elements.iter().enumerate().flat_map(of).collect()
    }
}

impl Instance {
    /// Whether it has a section of its own in reports.
    #[must_use]
    pub fn has_section(&self) -> bool {
        self.class.kind != Kind::Joint && !self.class.report.is_empty()
    }
}

/// The arguments with which an element looks up the grids that a scene gave it, and the curves that end with a kink.
pub(super) fn grids(class: &Descriptor, params: &Params, recording: &Recording) -> Vec<GridUse> {
    if class.opaque {
        return Vec::new();
    }
    let mut found = tables::kinked_ends(class, params, recording);
    if class.kind == Kind::Joint {
        return found;
    }
    for spec in class.params.iter().filter(|spec| spec.kind == ParamKind::Surface) {
        let axis = |key: &str| params.get(&spec.name)?.get(key).and_then(Vec::<f64>::read_value);
        let (Some(x), Some(y)) = (axis("x"), axis("y")) else { continue };
        for raw in &recording.ops {
            let Some(Op::Table(table, argument)) = Op::decode(*raw) else { continue };
            let Some(table) = recording.tables.get(table as usize) else { continue };
            let known = found.iter().filter(|known| known.parameter == spec.name);
            if known.clone().any(|known| known.argument == argument) {
                continue;
            }
            // Where both axes are alike, x is looked up first.
            let is_x = table.breaks == x && (x != y || known.count() % 2 == 0);
            if !is_x && table.breaks != y {
                continue;
            }
            let (name, list) = if is_x { ("x", &x) } else { ("y", &y) };
            let bounds = [list[0], list[list.len() - 1]];
            found.push(GridUse {
                parameter: spec.name.clone(),
                axis: name.into(),
                unit: unit_of(spec, is_x),
                argument,
                bounds,
            });
        }
    }
    found
}

/// The unit of an argument in `"rad/s, 1 -> N m"`.
fn unit_of(spec: &ParamSpec, is_x: bool) -> String {
    let arguments = spec.unit.split_once("->").map_or("", |(arguments, _)| arguments);
    let (x, y) = arguments.split_once(',').unwrap_or((arguments, ""));
    (if is_x { x } else { y }).trim().to_owned()
}
