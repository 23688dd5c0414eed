//! Shapes of MJCF and their masses.

use std::collections::HashMap;
use std::path::PathBuf;

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};
use odyn_run::results::Mesh;
use roxmltree::Node;

use super::Reader;
use super::compiler::Compiler;
use super::defaults::{Classes, Of};
use crate::mechanism::{Form, Shape, Solid};
use crate::solid;
use crate::urdf::hex;
use crate::xml::{Found, children, head};

/// A mesh of `<asset>`.
pub(super) struct MeshFile {
    path: PathBuf,
    scale: Matrix3<f64>,
    /// Where the numbers of the file stand in the frame of the mesh, once they are scaled.
    place: Isometry3<f64>,
    /// How MuJoCo computes its mass.
    inertia: String,
}

/// All meshes that have a file.
pub(super) fn meshes<'a, 'i: 'a>(
    root: Node<'a, 'i>,
    compiler: &Compiler<'_>,
    classes: &Classes<'a, 'i>,
    found: &mut Found,
) -> HashMap<String, MeshFile> {
    let assets = children(root).filter(|node| node.has_tag_name("asset")).flat_map(children);
    let mut meshes = HashMap::new();
    for node in assets.filter(|node| node.has_tag_name("mesh")) {
        let of = classes.of(node, "mesh", None);
        let Some(file) = node.attribute("file") else { continue };
        let path = compiler.folder.join(&compiler.mesh_folder).join(file);
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let name = node.attribute("name").map_or(stem, str::to_owned);
        let scale = found.list(of.get("scale")).map_or(Vector3::repeat(1.0), Vector3::from);
        let at = found.list(of.get("refpos")).map_or(Vector3::zeros(), Vector3::from);
        let turn = found.list(of.get("refquat")).map_or(UnitQuaternion::identity(), |[w, x, y, z]| {
            UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
        });
        // MuJoCo scales along the axes of the mesh, about its origin: what is at v in the file comes to S R^T (v - p).
        let place = Translation3::from(-scale.component_mul(&(turn.inverse() * at)));
        let is_alike = scale.iter().all(|factor| *factor == scale.x);
        let (scale, place) = if is_alike {
            (Matrix3::from_diagonal(&scale), place * turn.inverse())
        } else {
            let turned = Matrix3::from_diagonal(&scale) * turn.inverse().to_rotation_matrix().matrix();
            (turned, place * UnitQuaternion::identity())
        };
        let inertia = of.text("inertia").unwrap_or("legacy").to_owned();
        meshes.insert(name, MeshFile { path, scale, place, inertia });
    }
    meshes
}

/// The least turn that takes z to a direction.
pub(super) fn from_z(z: &Vector3<f64>) -> UnitQuaternion<f64> {
    let turned = UnitQuaternion::rotation_between(&Vector3::z(), z);
    turned.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// Whether an `<inertial>` is in a body, or in frames of it.
fn has_inertial(node: Node<'_, '_>) -> bool {
    children(node).any(|below| below.has_tag_name("inertial") || below.has_tag_name("frame") && has_inertial(below))
}

/// What a shape gets its mass from.
#[derive(Debug, Clone, Copy)]
enum Weight {
    /// kg
    Mass(f64),
    /// kg/m^3
    Density(f64),
}

impl<'a, 'i: 'a> Reader<'_, 'a, 'i> {
    /// A shape, in the frame of its body, and its mass.
    pub(super) fn geom(
        &mut self,
        node: Node<'a, 'i>,
        frame: &Isometry3<f64>,
        class: Option<&'a str>,
    ) -> (Option<Shape>, Option<Solid>) {
        let of = self.classes.of(node, "geom", class);
        if ["contype", "conaffinity"].into_iter().any(|mask| self.found.number(of.get(mask)) != Some(0.0)) {
            let body = node.ancestors().find(|above| matches!(above.tag_name().name(), "body" | "worldbody"));
            self.touching.extend(body.map(|body| body.id()));
        }
        let (weight, mistakes) = (self.weight(&of), self.found.diagnostics.len());
        let Some((form, pose)) = self.form(node, &of) else {
            if weight.is_some() && of.text("type") != Some("plane") && self.found.diagnostics.len() == mistakes {
                self.mass_is_needed(
                    node,
                    "it has no file of its own, is fitted to a mesh, or is of a kind that is not read",
                );
            }
            return (None, None);
        };
        let color = self.found.list(of.get("rgba")).map(hex);
        let shape = Shape { form, pose: frame * pose, color };
        let mass = weight.and_then(|weight| self.mass(node, &of, &shape, weight));
        (Some(shape), mass)
    }

    fn mass(&mut self, node: Node<'a, 'i>, of: &Of<'a, 'i>, shape: &Shape, weight: Weight) -> Option<Solid> {
        if of.text("shellinertia") == Some("true") {
            self.left_out("mass on the surface of shapes (`shellinertia`): it is in their volume");
        }
        let density = if let Weight::Density(density) = weight { density } else { 1.0 };
        let found = match &shape.form {
            Form::Mesh { path, scale } => solid::read_mesh(path).and_then(|mesh| {
                if self.takes_mass_of_shapes(node) {
                    self.mass_of_mesh(of, &mesh, scale);
                }
                Ok(solid::of_mesh(&mesh, scale, density)?.moved(&shape.pose))
            }),
            _ => solid::of_shape(shape, density),
        };
        match found {
            Ok(solid) => Some(match weight {
                Weight::Mass(mass) => Solid { mass, inertia: solid.inertia * (mass / solid.mass), ..solid },
                Weight::Density(_) => solid,
            }),
            Err(reason) => {
                self.mass_is_needed(node, &reason);
                None
            }
        }
    }

    /// What gives a shape its mass, if it gives its body any.
    fn weight(&mut self, of: &Of<'a, 'i>) -> Option<Weight> {
        let density = self.found.not_negative(of.get("density")).unwrap_or(self.density);
        let weight = self.found.not_negative(of.get("mass")).map_or(Weight::Density(density), Weight::Mass);
        let group = self.found.number(of.get("group")).unwrap_or(0.0);
        let [first, last] = self.compiler.groups;
        let (Weight::Mass(amount) | Weight::Density(amount)) = weight;
        (amount != 0.0 && first <= group && group <= last).then_some(weight)
    }

    /// Reports a mesh whose mass MuJoCo does not take from the volume that it encloses, as is done here.
    fn mass_of_mesh(&mut self, of: &Of<'a, 'i>, file: &Mesh, scale: &Matrix3<f64>) {
        let name = of.text("mesh").unwrap_or_default();
        let inertia = self.meshes.get(name).map_or("exact", |mesh| mesh.inertia.as_str());
        let said = match inertia {
            "exact" => return,
            "legacy" if !solid::hides_from_its_middle(file, scale) => return,
            "legacy" => {
                "counts what is hidden from the middle of its surface more than once (`inertia` is \"legacy\")".into()
            }
            other => format!("takes another volume (`inertia` is \"{other}\")"),
        };
        self.left_out(format!("mass of mesh `{name}`: that of the volume it encloses, where MuJoCo {said}"));
    }

    /// Whether the mass of a body follows from its shapes.
    fn takes_mass_of_shapes(&self, shape: Node<'a, 'i>) -> bool {
        let body = shape.ancestors().find(|above| above.has_tag_name("body"));
        let given = body.is_some_and(has_inertial);
        body.is_some() && (!given || self.compiler.from_shapes == Some(true))
    }

    /// Reports a shape whose mass is not known, if its body has no other.
    fn mass_is_needed(&mut self, node: Node<'a, 'i>, reason: &str) {
        if self.takes_mass_of_shapes(node) {
            let message = format!("the mass of this shape is not known: {reason}");
            self.found.error(head(&node), message, "give the body an <inertial>");
        }
    }

    /// The sphere that MuJoCo fits to a mesh, about its centre of mass: the radius is the mean of the half edges of a box with the
    /// mesh's mass and moments of inertia. `None` where these are not known.
    fn sphere_of_mesh(&mut self, node: Node<'a, 'i>, of: &Of<'a, 'i>, name: &str) -> Option<(f64, Translation3<f64>)> {
        let scale = self.found.number(of.get("fitscale")).unwrap_or(1.0);
        let file = self.meshes.get(name)?;
        let (mesh, turned, place) = (solid::read_mesh(&file.path).ok()?, file.scale, file.place);
        let solid = solid::of_mesh(&mesh, &turned, 1.0).ok()?.moved(&place);
        if self.takes_mass_of_shapes(node) {
            self.mass_of_mesh(of, &mesh, &turned);
        }
        let moments = solid.inertia.symmetric_eigenvalues() / solid.mass;
        let half = moments.map(|own| (1.5 * (moments.sum() - 2.0 * own)).max(0.0).sqrt());
        let radius = scale * half.mean();
        (radius > 0.0).then(|| (radius, Translation3::from(solid.com)))
    }

    /// What a shape is and where, in the frame that it stands in.
    fn form(&mut self, node: Node<'a, 'i>, of: &Of<'a, 'i>) -> Option<(Form, Isometry3<f64>)> {
        let kind = of.text("type").unwrap_or("sphere");
        let size = self.numbers(of, "size");
        let mut pose = self.pose(of);
        if kind == "mesh" {
            let name = of.text("mesh").unwrap_or_default();
            let Some(mesh) = self.meshes.get(name) else {
                self.left_out(format!("mesh `{name}`: it has no file of its own"));
                return None;
            };
            let form = Form::Mesh { path: mesh.path.clone(), scale: mesh.scale };
            return Some((form, pose * mesh.place));
        }
        if let Some(name) = of.text("mesh") {
            if of.get("type").is_none() {
                let what = "sphere, as in MuJoCo, where it has no `type`; with type=\"mesh\" it is the mesh";
                self.left_out(format!("a shape of mesh `{name}` is a {what}"));
            }
            if kind == "sphere"
                && !self.compiler.fit_to_bounds
                && let Some((radius, at)) = self.sphere_of_mesh(node, of, name)
            {
                return Some((Form::Sphere(radius), pose * at));
            }
            self.left_out(format!("a {kind} that MuJoCo fits to mesh `{name}` (`mj_saveLastXML` writes its size)"));
            return None;
        }
        let ends = self.found.list::<6>(of.get("fromto"));
        let mut length = size.get(1).map(|half| 2.0 * half);
        if let Some([a, b, c, d, e, f]) = ends {
            let (first, second) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            let along = second - first;
            if Unit::try_new(along, 1e-12).is_none() {
                self.found.error(head(&node), "both ends of `fromto` are the same", "");
                return None;
            }
            length = Some(along.norm());
            // MuJoCo's z axis points from the second end to the first.
            pose = Isometry3::from_parts(Translation3::from((first + second) / 2.0), from_z(&-along));
        }
        let number = |k: usize| size.get(k).copied().filter(|x| *x > 0.0);
        let form = match kind {
            "plane" | "hfield" | "sdf" => {
                self.left_out(format!("shapes of type {kind}"));
                return None;
            }
            "sphere" => number(0).map(Form::Sphere),
            "capsule" => number(0).zip(length).map(|(radius, length)| Form::Capsule(radius, length)),
            "cylinder" => number(0).zip(length).map(|(radius, length)| Form::Cylinder(radius, length)),
            "box" | "ellipsoid" => {
                let half = match ends {
                    // MuJoCo takes the first number for both edges across, whatever the second is.
                    Some(_) => number(0).zip(length).map(|(x, length)| Vector3::new(x, x, length / 2.0)),
                    None => number(0).zip(number(1)).zip(number(2)).map(|((x, y), z)| Vector3::new(x, y, z)),
                };
                half.map(|half| if kind == "box" { Form::Box(half * 2.0) } else { Form::Ellipsoid(half) })
            }
            other => {
                self.found.error(head(&node), format!("unknown type of shape \"{other}\""), "");
                return None;
            }
        };
        if form.is_none() {
            self.found.error(head(&node), format!("a {kind} needs a `size` of positive numbers"), "");
        }
        Some((form?, pose))
    }
}
