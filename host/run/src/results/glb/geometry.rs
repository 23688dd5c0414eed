//! Triangles of shapes, in their own frames.

use super::super::motion::Shape;

/// Sides of what is round.
const SIDES: u32 = 32;
/// Rings of a half sphere.
const RINGS: u32 = 8;

/// Triangles, with a normal per corner where these are not those of the triangles.
#[derive(Debug, Default)]
pub(super) struct Surface {
    pub(super) corners: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) triangles: Vec<u32>,
}

impl Surface {
    /// Of a shape with the measures of its kind; nothing of a kind that is not known.
    pub(super) fn of(shape: &Shape) -> Self {
        let mut surface = Self::default();
        let (radius, length) = (shape.radius.unwrap_or(0.0), shape.length.unwrap_or(0.0));
        match (shape.kind.as_str(), &shape.mesh) {
            ("box", _) => surface.cuboid(shape.size.unwrap_or_default()),
            ("cylinder", _) => {
                let half = 0.5 * length;
                surface.turned(&[([radius, -half], [1.0, 0.0]), ([radius, half], [1.0, 0.0])]);
                surface.turned(&[([0.0, -half], [0.0, -1.0]), ([radius, -half], [0.0, -1.0])]);
                surface.turned(&[([radius, half], [0.0, 1.0]), ([0.0, half], [0.0, 1.0])]);
            }
            (round @ ("sphere" | "capsule"), _) => {
                let half = if round == "sphere" { 0.0 } else { 0.5 * length };
                let arc = |ring: u32, at: f64| {
                    let angle = std::f64::consts::FRAC_PI_2 * (f64::from(ring) / f64::from(RINGS) - 1.0);
                    let (sine, cosine) = angle.sin_cos();
                    // From the pole to the equator; exactly on the axis at the pole.
                    let cosine = if ring == 0 { 0.0 } else { cosine };
                    ([radius * cosine, radius * sine - at], [cosine, sine])
                };
                let lower: Vec<Point> = (0..=RINGS).map(|ring| arc(ring, half)).collect();
                let upper = lower.iter().rev().map(|([r, z], [nr, nz])| ([*r, -z], [*nr, -nz]));
                let mut whole: Vec<Point> = lower.iter().copied().chain(upper).collect();
                whole.dedup();
                surface.turned(&whole);
            }
            (_, Some(mesh)) => {
                surface.corners =
                    mesh.vertices.chunks_exact(3).map(|corner| [corner[0], corner[1], corner[2]]).collect();
                surface.triangles = mesh.triangles.clone();
            }
            _ => {}
        }
        surface
    }

    /// Six faces.
    fn cuboid(&mut self, size: [f64; 3]) {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let first = self.corners.len() as u32;
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                // Counter-clockwise from outside.
                for (a, b) in [(-1.0, -1.0), (side, -side), (1.0, 1.0), (-side, side)] {
                    let (mut corner, mut normal) = ([0.0; 3], [0.0; 3]);
                    corner[axis] = (0.5 * side * size[axis]) as f32;
                    corner[u] = (0.5 * a * size[u]) as f32;
                    corner[v] = (0.5 * b * size[v]) as f32;
                    normal[axis] = side as f32;
                    self.corners.push(corner);
                    self.normals.push(normal);
                }
                self.triangles.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
            }
        }
    }

    /// A line of distances from the z axis and heights, with normals, turned about that axis; upwards is outside to the right.
    fn turned(&mut self, line: &[Point]) {
        let first = self.corners.len() as u32;
        for side in 0..=SIDES {
            let (sine, cosine) = (f64::from(side % SIDES) * std::f64::consts::TAU / f64::from(SIDES)).sin_cos();
            for ([r, z], [nr, nz]) in line {
                self.corners.push([(r * cosine) as f32, (r * sine) as f32, *z as f32]);
                self.normals.push([(nr * cosine) as f32, (nr * sine) as f32, *nz as f32]);
            }
        }
        let count = line.len() as u32;
        for side in 0..SIDES {
            for k in 0..count - 1 {
                let at = first + side * count + k;
                // Where the line begins or ends on the axis, there is one triangle.
                if line[k as usize].0[0] > 0.0 {
                    self.triangles.extend([at, at + count, at + count + 1]);
                }
                if line[k as usize + 1].0[0] > 0.0 {
                    self.triangles.extend([at, at + count + 1, at + 1]);
                }
            }
        }
    }
}

/// Distance from the axis and height, with the normal there.
type Point = ([f64; 2], [f64; 2]);
