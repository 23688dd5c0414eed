//! Directions that joints leave free, and elements that act about or along others.

use element_api::Kind;
use nalgebra::{DMatrix, Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::decide::Probe;
use super::layout::Layout;
use crate::linalg::SingularValues;
use crate::model::{Marker, Model};

/// Share of the largest part of a freedom below which another part is round-off.
const NOTHING: f64 = 1e-9;
/// Axes that are nearer than this to parallel are, rad.
const PARALLEL: f64 = 1e-6;

/// An element whose z axes do not stay parallel, which it takes for granted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crosswise {
    /// Which element.
    pub element: usize,
    /// Two of its frames.
    pub frames: [usize; 2],
    /// The joint that moves their bodies about or along another axis than the first frame's z; `None`: the z axes are not parallel at the start.
    pub joint: Option<usize>,
    /// Between the two axes, rad.
    pub angle: f64,
}

/// The elements that act about or along axes which are not those of the joints beside them.
pub(super) fn crosswise(model: &Model, layout: &Layout, probe: &Probe<'_>) -> Vec<Crosswise> {
    if model.elements.iter().all(|element| element.class.parallel_axes.is_empty()) {
        return Vec::new();
    }
    let mut between: FxHashMap<[Option<usize>; 2], Vec<usize>> = FxHashMap::default();
    for (joint, instance) in model.elements.iter().enumerate() {
        if let (Kind::Joint, [first, second]) = (instance.class.kind, &instance.markers[..]) {
            between.entry(in_order(first, second)).or_default().push(joint);
        }
    }
    let z = |marker: &Marker| {
        let own: Vector3<f64> = marker.rotation.column(2).into_owned();
        marker.body.map_or(own, |body| probe.rotations[body] * own)
    };
    let off = |one: &Vector3<f64>, other: &Vector3<f64>| one.cross(other).norm().min(1.0).asin();
    let mut found = Vec::new();
    for (element, instance) in model.elements.iter().enumerate() {
        for frames in &instance.class.parallel_axes {
            let [Some(first), Some(second)] = frames.map(|frame| instance.markers.get(frame)) else { continue };
            let axis = z(first);
            let apart = off(&axis, &z(second));
            if apart > PARALLEL {
                found.push(Crosswise { element, frames: *frames, joint: None, angle: apart });
                continue;
            }
            let beside = between.get(&in_order(first, second)).into_iter().flatten().filter(|joint| **joint != element);
            let turned = beside.filter_map(|joint| directions(model, layout, probe, *joint)).find_map(|joint| {
                let angle = off(&axis, &joint.axis.or(joint.slide)?);
                (angle > PARALLEL).then_some(Crosswise { element, frames: *frames, joint: Some(joint.joint), angle })
            });
            found.extend(turned);
        }
    }
    found
}

/// The bodies of two markers, the smaller number first.
fn in_order(first: &Marker, second: &Marker) -> [Option<usize>; 2] {
    [first.body.min(second.body), first.body.max(second.body)]
}

/// The directions in which a joint leaves its bodies free, ground axes.
pub(super) struct Directions {
    pub(super) joint: usize,
    /// The one axis that it turns about.
    pub(super) axis: Option<Vector3<f64>>,
    /// The one direction that it slides in without turning.
    pub(super) slide: Option<Vector3<f64>>,
}

/// From the motions of one of its bodies that its rows allow while the others stand still.
pub(super) fn directions(model: &Model, layout: &Layout, probe: &Probe<'_>, joint: usize) -> Option<Directions> {
    let rows = layout.rows_of(joint);
    let markers = &model.elements[joint].markers;
    let body = markers.iter().rev().find_map(|marker| marker.body).filter(|_| markers.len() == 2)?;
    let mut matrix = DMatrix::zeros(rows.len(), 6);
    for (row, column, value) in probe.entries(rows.clone()).filter(|(_, column, _)| column / 6 == body) {
        // Lengths in those of the scene, so that all rows are of one size.
        let scale = if column % 6 < 3 { 1.0 } else { probe.length };
        matrix[(row - rows.start, column % 6)] = value / scale;
    }
    for mut row in matrix.row_iter_mut() {
        let size = row.norm();
        row.unscale_mut(if size > 0.0 { size } else { 1.0 });
    }
    let free = SingularValues::of(&matrix)?.null_space(NOTHING);
    let turns = SingularValues::of(&free.rows(3, 3).into_owned())?;
    let rotation: &Matrix3<f64> = &probe.rotations[body];
    let axis = (turns.rank(NOTHING) == 1).then(|| rotation * turns.left().fixed_view::<3, 1>(0, 0));
    let slides = SingularValues::of(&(free.rows(0, 3) * turns.null_space(NOTHING)))?;
    let slide = (slides.rank(NOTHING) == 1).then(|| slides.left().fixed_view::<3, 1>(0, 0).into_owned());
    Some(Directions { joint, axis, slide })
}
