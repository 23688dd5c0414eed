//! Building blocks: most joints are a few of these.
//!
//! Source: Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems (1989), sections 9.4.2-9.4.4. Each sets the
//! next rows of the constraint.

use crate::element::Rows;
use crate::geometry::{Frame, Vec3};
use crate::scalar::Scalar;

/// Two points coincide: three rows, p_j - p_i in the axes of frame `i`, m.
///
/// Rows in the axes of a frame keep their meaning however the mechanism stands in the ground frame.
pub fn coincident<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    let d = j.position - i.position;
    rows.push_vector(i.rotation.tr_mul(&d));
}

/// Two directions are perpendicular (Haug's dot-1): one row, a . b.
pub fn perpendicular<S: Scalar>(a: Vec3<S>, b: Vec3<S>, rows: &mut Rows<'_, S>) {
    rows.push(a.dot(&b));
}

/// The vector between the frames' origins is perpendicular to `a` (Haug's dot-2): one row, a . (p_j - p_i), m.
pub fn no_offset_along<S: Scalar>(a: Vec3<S>, i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    rows.push(a.dot(&(j.position - i.position)));
}

/// The z axes are parallel (Haug's parallel-1): two rows, x_i . z_j and y_i . z_j.
///
/// Also satisfied by opposite axes; the start decides which.
pub fn parallel_z<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    perpendicular(i.x(), j.z(), rows);
    perpendicular(i.y(), j.z(), rows);
}

/// The second origin lies on the z axis of the first frame (with [`parallel_z`], Haug's parallel-2): two rows, m.
pub fn on_z_axis<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    no_offset_along(i.x(), i, j, rows);
    no_offset_along(i.y(), i, j, rows);
}

/// All axes are parallel: three rows. Valid while the frames are less than a quarter turn apart.
pub fn same_orientation<S: Scalar>(i: &Frame<S>, j: &Frame<S>, rows: &mut Rows<'_, S>) {
    parallel_z(i, j, rows);
    perpendicular(i.y(), j.x(), rows);
}
