//! Mass, centre and inertia of shapes of one density.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use odyn_run::results::Mesh;

use crate::mechanism::{Form, Shape, Solid, point_inertia};

/// Share of a volume below which what shows its back is round-off.
const HIDDEN: f64 = 1e-6;

/// The mass of a shape, in the frame of its link.
///
/// # Errors
/// In words, for a mesh that cannot be read or does not enclose a volume.
pub(crate) fn of_shape(shape: &Shape, density: f64) -> Result<Solid, String> {
    Ok(of_form(&shape.form, density)?.moved(&shape.pose))
}

/// Reads the file of a mesh whose numbers are metres.
///
/// # Errors
/// In words: where it was looked for, and what else [`Mesh::read`] says.
pub(crate) fn read_mesh(path: &Path) -> Result<Mesh, String> {
    if !path.exists() {
        return Err(format!("there is no file {}", path.display()));
    }
    Mesh::read(path, 1.0)
}

fn of_form(form: &Form, density: f64) -> Result<Solid, String> {
    use std::f64::consts::PI;
    let centred = |mass: f64, inertia: Vector3<f64>| Solid {
        mass,
        com: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&(inertia * mass)),
    };
    // Moments of inertia per mass, from the mean squares of x, y and z.
    let from_squares = |s: Vector3<f64>| Vector3::new(s.y + s.z, s.z + s.x, s.x + s.y);
    Ok(match form {
        Form::Box(edges) => centred(density * edges.product(), from_squares(edges.component_mul(edges) / 12.0)),
        Form::Sphere(radius) => of_form(&Form::Ellipsoid(Vector3::repeat(*radius)), density)?,
        Form::Ellipsoid(half) => {
            centred(density * 4.0 / 3.0 * PI * half.product(), from_squares(half.component_mul(half) / 5.0))
        }
        Form::Cylinder(radius, length) => centred(
            density * PI * radius * radius * length,
            from_squares(Vector3::new(radius * radius / 4.0, radius * radius / 4.0, length * length / 12.0)),
        ),
        Form::Capsule(radius, length) => {
            let tube = of_form(&Form::Cylinder(*radius, *length), density)?;
            let ball = of_form(&Form::Sphere(*radius), density)?;
            // Each half of the ball has its centre 3/8 of the radius from its flat face.
            let half = Solid {
                mass: ball.mass / 2.0,
                com: Vector3::z() * (length / 2.0 + 0.375 * radius),
                inertia: ball.inertia / 2.0 - point_inertia(ball.mass / 2.0, &(Vector3::z() * (0.375 * radius))),
            };
            tube.and(&half).and(&Solid { com: -half.com, ..half })
        }
        Form::Mesh { path, scale, .. } => of_mesh(&read_mesh(path)?, scale, density)?,
    })
}

/// The corners of each triangle of a mesh.
fn triangles<'m>(mesh: &'m Mesh, scale: &'m Matrix3<f64>) -> impl Iterator<Item = [Vector3<f64>; 3]> + Clone + 'm {
    let corner = move |number: u32| {
        let at = 3 * number as usize;
        let of = |k: usize| mesh.vertices.get(at + k).map_or(0.0, |x| f64::from(*x));
        scale * Vector3::new(of(0), of(1), of(2))
    };
    mesh.triangles.chunks_exact(3).map(move |triangle| [corner(triangle[0]), corner(triangle[1]), corner(triangle[2])])
}

/// Whether some of the surface of a mesh shows its back to the middle of the surface.
pub(crate) fn hides_from_its_middle(mesh: &Mesh, scale: &Matrix3<f64>) -> bool {
    let all = triangles(mesh, scale);
    let (mut area, mut middle) = (0.0, Vector3::zeros());
    for [a, b, c] in all.clone() {
        let own = (b - a).cross(&(c - a)).norm();
        area += own;
        middle += (a + b + c) * (own / 3.0);
    }
    middle /= area;
    let volumes = all.map(|[a, b, c]| (a - middle).dot(&(b - middle).cross(&(c - middle))));
    let (front, back) =
        volumes.fold((0.0_f64, 0.0_f64), |(front, back), volume| (front + volume.max(0.0), back - volume.min(0.0)));
    front.min(back) > HIDDEN * front.max(back)
}

/// The volume that triangles enclose, by tetrahedra from the origin to each (Mirtich 1996).
///
/// # Errors
/// In words, where they enclose none.
pub(crate) fn of_mesh(mesh: &Mesh, scale: &Matrix3<f64>, density: f64) -> Result<Solid, String> {
    let (mut volume, mut first, mut second, mut size) = (0.0, Vector3::zeros(), Matrix3::zeros(), 0.0_f64);
    for corners in triangles(mesh, scale) {
        let six = corners[0].dot(&corners[1].cross(&corners[2]));
        let sum = corners[0] + corners[1] + corners[2];
        volume += six / 6.0;
        first += sum * (six / 24.0);
        let squares: Matrix3<f64> = corners.iter().map(|c| c * c.transpose()).sum();
        second += (squares + sum * sum.transpose()) * (six / 120.0);
        size = corners.iter().fold(size, |size, c| size.max(c.amax()));
    }
    // A mirrored mesh encloses it inside out.
    let side = if scale.determinant() < 0.0 { -1.0 } else { 1.0 };
    let (volume, first, second) = (volume * side, first * side, second * side);
    if volume <= 1e-9 * size.powi(3) {
        return Err("its triangles do not enclose a volume".into());
    }
    let about_origin = Matrix3::identity() * second.trace() - second;
    let com = first / volume;
    let mass = density * volume;
    Ok(Solid { mass, com, inertia: about_origin * density - point_inertia(mass, &com) })
}
