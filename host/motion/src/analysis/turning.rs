//! Which bodies can turn.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::constraints::Constraints;
use crate::model::Model;
use crate::plan::{Layout, holds_always};

/// Share of a row below which what is left of it is round-off.
const NONE: f64 = 1e-9;

/// By body, whether it can turn against the ground. It cannot where joints with the ground, or with what cannot turn, hold all its
/// rotations, each pair of bodies by itself: what only a closed loop holds counts as turning, and so does what time turns or what may give
/// way. `rows`: those of positions, evaluated; rotations are taken on `length`, m.
pub(super) fn turning(model: &Model, layout: &Layout, rows: &Constraints, length: f64) -> Vec<bool> {
    let ground = model.bodies.len();
    let pair = |element: usize| -> Option<[usize; 2]> {
        let instance = &model.elements[element];
        let mut bodies: Vec<usize> = instance.markers.iter().map(|marker| marker.body.unwrap_or(ground)).collect();
        bodies.sort_unstable();
        bodies.dedup();
        <[usize; 2]>::try_from(bodies).ok().filter(|_| holds_always(instance))
    };
    let pairs: Vec<Option<[usize; 2]>> = (0..model.elements.len()).map(pair).collect();
    // Rows of each pair, as they hold the first of its bodies while the other stands still.
    let mut held: BTreeMap<[usize; 2], BTreeMap<usize, [f64; 6]>> = BTreeMap::new();
    for ((row, column), value) in rows.structure.jacobian.iter().zip(rows.jacobian()) {
        let (element, _) = layout.element_of_row(rows.rows[*row]);
        if let Some(pair) = pairs[element].filter(|pair| column / 6 == pair[0]) {
            let scale = if column % 6 < 3 { 1.0 } else { 1.0 / length };
            held.entry(pair).or_default().entry(*row).or_default()[column % 6] = value * scale;
        }
    }
    held.retain(|_, rows| holds_rotations(rows.values()));
    let mut turning = vec![true; ground + 1];
    turning[ground] = false;
    while let Some([a, b]) = held.keys().find(|[a, b]| turning[*a] != turning[*b]) {
        (turning[*a], turning[*b]) = (false, false);
    }
    turning.truncate(ground);
    turning
}

/// Whether no motion that these rows leave has a rotation in it.
fn holds_rotations<'a>(rows: impl ExactSizeIterator<Item = &'a [f64; 6]>) -> bool {
    let count = rows.len();
    let entries: Vec<f64> = rows
        .flat_map(|row| {
            let size = row.iter().map(|x| x * x).sum::<f64>().sqrt();
            row.map(|x| if size > 0.0 { x / size } else { 0.0 })
        })
        .collect();
    let all = DMatrix::from_row_slice(count, 6, &entries);
    let rank = |matrix: DMatrix<f64>| matrix.svd(false, false).rank(NONE);
    count >= 3 && rank(all.clone()) == rank(all.columns(0, 3).into_owned()) + 3
}
