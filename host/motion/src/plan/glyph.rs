//! How a picture shows a joint: found from the motions that its rows leave, never from its name.

use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3, Vector6};

use super::layout::Layout;
use crate::linalg::SingularValues;
use crate::model::{Marker, Model, skew};

/// Singular values below this, of rows of length 1, are those of motions that are free.
const FREE: f64 = 1e-7;
/// Directions that differ by less are the same.
const ALONG: f64 = 1e-6;

/// A place of the motion where joints are looked at.
pub struct Place<'a> {
    /// `(row, column)` of the Jacobian of all rows, six columns per body.
    pub entries: &'a [(usize, usize)],
    /// Its values there.
    pub jacobian: &'a [f64],
    /// Rows that depend on time: they drive the motion, and do not say what is free.
    pub driven: &'a [bool],
    /// Positions of the bodies' centres of mass, m, ground axes.
    pub positions: &'a [Vector3<f64>],
    /// Rotations body -> ground.
    pub rotations: &'a [Matrix3<f64>],
    /// Size of the scene, m.
    pub length: f64,
}

impl Place<'_> {
    /// The word for a joint in pictures, by what its rows leave free between its first two frames.
    #[must_use]
    pub fn glyph(&self, model: &Model, layout: &Layout, element: usize) -> &'static str {
        let markers = &model.elements[element].markers;
        let Some(frame) = markers.iter().rposition(|marker| marker.body.is_some()) else { return "none" };
        let marker = &markers[frame];
        let Some(body) = marker.body else { return "none" };
        let at = self.origin(marker);
        let axes = self.rotations[body] * marker.rotation;
        let others: Vec<&Marker> = markers.iter().filter(|marker| marker.body != Some(body)).collect();
        let rows: Vec<usize> = layout.rows_of(element).filter(|row| !self.driven[*row]).collect();
        if rows.is_empty() {
            return self.driver(layout, element, body);
        }
        // What all of its bodies do together is free in a joint between them, not in a transmission.
        let mut moved: Vec<usize> = markers.iter().filter_map(|marker| marker.body).collect();
        moved.sort_unstable();
        moved.dedup();
        let own = self.rows_of(&rows, &[body], &at, &axes);
        let together = self.rows_of(&rows, &moved, &at, &axes);
        let on_ground = others.iter().any(|marker| marker.body.is_none());
        if markers.len() > 2 || !on_ground && together.norm() > FREE.sqrt() {
            return "gear";
        }
        let apart = others.first().map_or_else(Vector3::zeros, |other| axes.tr_mul(&(at - self.origin(other))));
        classify(&own, &(apart / self.length))
    }

    /// Origin of a frame, m, ground axes.
    #[must_use]
    pub fn origin(&self, marker: &Marker) -> Vector3<f64> {
        match marker.body {
            Some(body) => self.positions[body] + self.rotations[body] * marker.position,
            None => marker.position,
        }
    }

    /// Rows of length 1 of twists of bodies that move as one: velocity of a point, then angular velocity times the length of the
    /// scene, in these axes.
    fn rows_of(&self, rows: &[usize], bodies: &[usize], at: &Vector3<f64>, axes: &Matrix3<f64>) -> DMatrix<f64> {
        let mut found = DMatrix::zeros(rows.len(), 6);
        let mut sizes = vec![0.0_f64; rows.len()];
        for body in bodies {
            // v = axes v_m + omega x (r - at), omega' = A^T omega, omega = axes omega_m.
            let mut twist = Matrix6::zeros();
            twist.fixed_view_mut::<3, 3>(0, 0).copy_from(axes);
            let lever = -skew(&(self.positions[*body] - at)) * axes / self.length;
            twist.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
            let turned = self.rotations[*body].transpose() * axes / self.length;
            twist.fixed_view_mut::<3, 3>(3, 3).copy_from(&turned);
            for (k, row) in rows.iter().enumerate() {
                let mut slopes = Vector6::zeros();
                for ((_, column), value) in self.entries.iter().zip(self.jacobian).filter(|((r, _), _)| r == row) {
                    if column / 6 == *body {
                        slopes[column % 6] = *value;
                    }
                }
                let part = twist.transpose() * slopes;
                sizes[k] = sizes[k].max(part.norm());
                (0..6).for_each(|c| found[(k, c)] += part[c]);
            }
        }
        for (k, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
            found.row_mut(k).scale_mut(1.0 / size);
        }
        found
    }

    /// A joint that does nothing but drive: along a direction, or about one.
    fn driver(&self, layout: &Layout, element: usize, body: usize) -> &'static str {
        let rows = layout.rows_of(element);
        let mut entries = self.entries.iter().zip(self.jacobian);
        let shifts = entries.any(|((row, column), value)| {
            rows.contains(row) && column / 6 == body && column % 6 < 3 && value.abs() > FREE
        });
        match (rows.is_empty(), shifts) {
            (true, _) => "none",
            (_, true) => "arrow",
            (_, false) => "torque",
        }
    }
}

/// By the free motions: how many there are, how many of them only shift, how many only turn about the frame's origin.
fn classify(rows: &DMatrix<f64>, apart: &Vector3<f64>) -> &'static str {
    let Some(values) = SingularValues::of(rows) else { return "none" };
    let motions = values.null_space(FREE);
    let free: Vec<Vector6<f64>> =
        motions.column_iter().map(|motion| Vector6::from_iterator(motion.iter().copied())).collect();
    let part = |from: usize| DMatrix::from_fn(3, free.len(), |i, k| free[k][from + i]);
    let rank = |matrix: DMatrix<f64>| SingularValues::of(&matrix).map_or(0, |values| values.rank(ALONG));
    let count = free.len();
    let (shifts, turns) = (count - rank(part(3)), count - rank(part(0)));
    match (count, shifts, turns) {
        (0, ..) => "weld",
        (1, 1, 0) => "slider",
        (1, 0, 1) => "hinge",
        (1, 0, 0) if along(&free[0]) => "screw",
        (2, 1, 1) if [free[0], free[0] + free[1], free[0] - free[1]].iter().all(along) => "cylinder",
        (2, 0, 2) => "universal",
        (2, 2, 0) | (3, 2, 1) => "plane",
        (3, 0, 3) => "ball",
        (4, 1, 3) | (2, 1, 1) => "curve",
        (5, 2, 3) => {
            let row = Vector3::new(rows[(0, 0)], rows[(0, 1)], rows[(0, 2)]);
            let is_between = apart.norm() > ALONG && row.cross(apart).norm() < ALONG.sqrt() * row.norm() * apart.norm();
            if is_between { "rod" } else { "plane" }
        }
        _ => "none",
    }
}

/// Whether a motion shifts along the direction about which it turns, or does only one of these.
fn along(motion: &Vector6<f64>) -> bool {
    let (shift, turn) = (motion.fixed_rows::<3>(0).into_owned(), motion.fixed_rows::<3>(3).into_owned());
    shift.cross(&turn).norm() <= ALONG * shift.norm().max(ALONG) * turn.norm().max(ALONG)
}
