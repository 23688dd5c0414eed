//! URDF: links and joints by their names, each joint in the frame of its parent link.
//!
//! (Format: wiki.ros.org/urdf/XML.)

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};
use odyn_diagnostics::{Diagnostic, codes};
use roxmltree::Node;

use crate::mechanism::{Coupling, Form, Hold, Joint, Kind, Link, Mechanism, Shape, Solid};
use crate::place::across;
use crate::solid;
use crate::write::usable;
use crate::xml::{Found, child, children, head};
use crate::{Base, Options};

/// Gravity where a file has none, m/s^2.
const GRAVITY: f64 = -9.81;

/// Reads a `<robot>`. `folder` is where meshes are looked for.
pub(crate) fn read(robot: Node<'_, '_>, folder: &Path, options: &Options, found: &mut Found) -> Mechanism {
    let mut reader =
        Reader { folder, density: options.density, colors: colors(robot, found), found, left_out: Vec::new() };
    let links: Vec<Node<'_, '_>> = children(robot).filter(|node| node.has_tag_name("link")).collect();
    let joints: Vec<Node<'_, '_>> = children(robot).filter(|node| node.has_tag_name("joint")).collect();
    let ends: Vec<Option<(&str, &str)>> = joints.iter().map(|joint| reader.ends(*joint)).collect();
    reader.others(robot);
    let mut mechanism = Mechanism {
        title: robot.attribute("name").unwrap_or("robot").to_owned(),
        gravity: Vector3::new(0.0, 0.0, GRAVITY),
        ..Mechanism::default()
    };
    let Some(order) = reader.order(&links, &joints, &ends) else { return mechanism };
    let mut places: HashMap<&str, Option<usize>> = HashMap::new();
    let mut roots = Vec::new();
    for (link, joint) in order {
        let name = link.attribute("name").unwrap_or_default();
        let (solid, shapes) = reader.link(link);
        let (pose, hold, parent) = match joint {
            // The root: "world" is what stands still by its name.
            None if name == "world" && solid.is_none() => {
                mechanism.ground.extend(shapes);
                places.insert(name, None);
                continue;
            }
            None => {
                roots.push(format!("`{name}`"));
                let hold = if options.base == Base::Free { Hold::Free } else { Hold::Fixed };
                (Isometry3::identity(), hold, None)
            }
            Some(number) => {
                let pose = reader.pose(child(joints[number], "origin"));
                let hold = reader.hold(joints[number]);
                mechanism.couplings.extend(reader.mimic(joints[number]));
                let parent = ends[number].and_then(|(parent, _)| places.get(parent).copied().flatten());
                (pose, hold, parent)
            }
        };
        places.insert(name, Some(mechanism.links.len()));
        mechanism.links.push(Link { name: name.to_owned(), parent, pose, hold, solid, shapes, remark: None });
    }
    if roots.len() > 1 {
        let held = if options.base == Base::Free { "moves freely" } else { "stands on the ground" };
        let roots = roots.join(", ");
        reader
            .left_out
            .push(format!("links that are no joint's child: {roots}; each {held}, where a URDF has one of them"));
    }
    mechanism.left_out = reader.left_out;
    mechanism
}

/// Colours of materials that have a name.
fn colors(robot: Node<'_, '_>, found: &mut Found) -> HashMap<String, String> {
    let named = robot.descendants().filter(|node| node.has_tag_name("material"));
    let color = |node: Node<'_, '_>| {
        let rgba = found.list::<4>(child(node, "color")?.attribute_node("rgba"))?;
        Some((node.attribute("name")?.to_owned(), hex(rgba)))
    };
    named.filter_map(color).collect()
}

/// A colour of four numbers from 0 to 1 as `#rrggbb`.
pub(crate) fn hex(rgba: [f64; 4]) -> String {
    let [red, green, blue] = [0, 1, 2].map(|k| (rgba[k].clamp(0.0, 1.0) * 255.0).round() as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}

struct Reader<'r> {
    folder: &'r Path,
    density: f64,
    colors: HashMap<String, String>,
    found: &'r mut Found,
    left_out: Vec<String>,
}

impl Reader<'_> {
    /// Parent and child of a joint.
    fn ends<'a>(&mut self, joint: Node<'a, '_>) -> Option<(&'a str, &'a str)> {
        let mut end = |name: &str| {
            let Some(node) = child(joint, name) else {
                self.found.error(head(&joint), format!("{} has no <{name}>", called(joint)), "");
                return None;
            };
            self.found.needed(node, "link")
        };
        Some((end("parent")?, end("child")?))
    }

    /// Links behind the links that carry them, each with the number of its joint. `None` where it is no tree, which is reported.
    fn order<'a, 'i>(
        &mut self,
        links: &[Node<'a, 'i>],
        joints: &[Node<'a, 'i>],
        ends: &[Option<(&str, &str)>],
    ) -> Option<Vec<(Node<'a, 'i>, Option<usize>)>> {
        let mut named: HashMap<&str, Node<'a, 'i>> = HashMap::new();
        for link in links {
            let name = self.found.needed(*link, "name")?;
            if named.insert(name, *link).is_some() {
                self.found.error(head(link), format!("a second link `{name}`"), "");
            }
        }
        let mut names = HashSet::new();
        let mut carriers: HashMap<&str, usize> = HashMap::new();
        let mut carried: HashMap<&str, Vec<(&str, usize)>> = HashMap::new();
        for (number, (joint, ends)) in joints.iter().zip(ends).enumerate() {
            let name = self.found.needed(*joint, "name")?;
            if !names.insert(name) {
                self.found.error(head(joint), format!("a second joint `{name}`"), "");
            }
            let (parent, below) = (*ends)?;
            for end in [parent, below].into_iter().filter(|end| !named.contains_key(end)) {
                self.found.error(head(joint), format!("joint `{name}`: there is no link `{end}`"), "");
            }
            if carriers.insert(below, number).is_some() {
                let help = "a URDF is a tree; a loop is closed in the scene, by a joint more";
                self.found.error(head(joint), format!("link `{below}` is carried by two joints"), help);
            }
            carried.entry(parent).or_default().push((below, number));
        }
        if self.found.has_errors() {
            return None;
        }
        let roots = links.iter().filter(|link| link.attribute("name").is_some_and(|name| !carriers.contains_key(name)));
        let mut order: Vec<(Node<'a, 'i>, Option<usize>)> = roots.map(|link| (*link, None)).collect();
        let mut at = 0;
        while let Some((link, _)) = order.get(at) {
            let below = link.attribute("name").and_then(|name| carried.get(name));
            let below: Vec<_> =
                below.into_iter().flatten().map(|(name, number)| (named[name], Some(*number))).collect();
            order.extend(below);
            at += 1;
        }
        if order.len() < links.len() {
            let reached: HashSet<_> = order.iter().map(|(link, _)| link.id()).collect();
            if let Some(link) = links.iter().find(|link| !reached.contains(&link.id())) {
                self.found.error(head(link), format!("{} hangs on itself: its joints form a ring", called(*link)), "");
            }
            return None;
        }
        Some(order)
    }

    /// What is in the file beside links and joints.
    fn others(&mut self, robot: Node<'_, '_>) {
        for node in children(robot) {
            match node.tag_name().name() {
                "link" | "joint" | "material" => {}
                "transmission" => {
                    self.left_out.push(format!("transmission `{}`: motors are not described by it", named(node)))
                }
                "gazebo" | "mujoco" | "drake" => {
                    let name = node.tag_name().name().to_owned();
                    self.left_out.push(format!("<{name}>: extensions of other programs"));
                }
                "sensor" => self.left_out.push("<sensor>".into()),
                _ => {}
            }
        }
    }

    fn pose(&mut self, origin: Option<Node<'_, '_>>) -> Isometry3<f64> {
        let Some(origin) = origin else { return Isometry3::identity() };
        let [x, y, z] = self.found.list(origin.attribute_node("xyz")).unwrap_or_default();
        let [roll, pitch, yaw] = self.found.list(origin.attribute_node("rpy")).unwrap_or_default();
        Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    }

    /// Mass and shapes of a link.
    fn link(&mut self, link: Node<'_, '_>) -> (Option<Solid>, Vec<Shape>) {
        let seen = |kind: &'static str| children(link).filter(move |node| node.has_tag_name(kind));
        let mut shapes: Vec<Shape> = seen("visual").filter_map(|node| self.shape(node)).collect();
        let touching: Vec<Shape> = seen("collision").filter_map(|node| self.shape(node)).collect();
        if !touching.is_empty() && !self.left_out.iter().any(|what| what.starts_with("collision")) {
            self.left_out.push("collision shapes: links do not touch each other".into());
        }
        let solid = match child(link, "inertial") {
            Some(inertial) => self.inertial(inertial),
            None => {
                let of = if touching.is_empty() { &shapes } else { &touching };
                self.mass_of_shapes(&called(link), of)
            }
        };
        if shapes.is_empty() {
            shapes = touching;
        }
        (solid, shapes)
    }

    fn inertial(&mut self, inertial: Node<'_, '_>) -> Option<Solid> {
        let pose = self.pose(child(inertial, "origin"));
        let mass = self.found.not_negative(child(inertial, "mass")?.attribute_node("value"))?;
        let tensor = child(inertial, "inertia");
        let mut of = |name: &str| self.found.number(tensor?.attribute_node(name)).or(Some(0.0));
        let [xx, xy, xz, yy, yz, zz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|name| of(name).unwrap_or(0.0));
        let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Some(Solid { mass, com: Vector3::zeros(), inertia }.moved(&pose)).filter(Solid::is_something)
    }

    /// The mass of a link without any, from its shapes.
    fn mass_of_shapes(&mut self, whose: &str, shapes: &[Shape]) -> Option<Solid> {
        let mut sum: Option<Solid> = None;
        for shape in shapes {
            match solid::of_shape(shape, self.density) {
                Ok(part) => sum = Some(sum.map_or(part, |sum| sum.and(&part))),
                Err(reason) => {
                    let shown = if let Form::Mesh { path, .. } = &shape.form { path.file_name() } else { None };
                    let name = shown.map(|name| format!(" `{}`", name.to_string_lossy())).unwrap_or_default();
                    self.left_out.push(format!("mass of mesh{name} of {whose}: {reason}"));
                }
            }
        }
        if let Some(sum) = sum {
            let density = self.density;
            self.left_out.push(format!(
                "{whose} has no <inertial>: {:.6} kg from its shapes, of {density} kg/m^3 (--density)",
                sum.mass
            ));
        }
        sum
    }

    fn shape(&mut self, node: Node<'_, '_>) -> Option<Shape> {
        let pose = self.pose(child(node, "origin"));
        let color = child(node, "material").and_then(|material| {
            let own = child(material, "color").and_then(|color| self.found.list(color.attribute_node("rgba")));
            own.map(hex).or_else(|| self.colors.get(material.attribute("name")?).cloned())
        });
        let geometry = children(child(node, "geometry")?).next()?;
        let mut number = |name: &str| self.found.not_negative(geometry.attribute_node(name)).filter(|x| *x > 0.0);
        let form = match geometry.tag_name().name() {
            "box" => {
                let size = self.found.list::<3>(geometry.attribute_node("size"))?;
                Form::Box(Vector3::from(size))
            }
            "sphere" => Form::Sphere(number("radius")?),
            "cylinder" => Form::Cylinder(number("radius")?, number("length")?),
            "capsule" => Form::Capsule(number("radius")?, number("length")?),
            "mesh" => {
                let file = self.found.needed(geometry, "filename")?;
                let scale = self.found.list::<3>(geometry.attribute_node("scale")).unwrap_or([1.0; 3]);
                Form::Mesh { path: self.mesh_file(file), scale: Matrix3::from_diagonal(&Vector3::from(scale)) }
            }
            _ => return None,
        };
        Some(Shape { form, pose, color })
    }

    /// `package://NAME/FILE` is looked for in the folders above the file, with NAME and without.
    fn mesh_file(&mut self, name: &str) -> PathBuf {
        let Some(inside) = name.strip_prefix("package://") else {
            return self.folder.join(name.strip_prefix("file://").unwrap_or(name));
        };
        let (_, rest) = inside.split_once('/').unwrap_or(("", inside));
        let folders = self.folder.ancestors().take(8);
        let mut candidates = folders.flat_map(|folder| [folder.join(inside), folder.join(rest)]);
        candidates.find(|path| path.is_file()).unwrap_or_else(|| {
            let folders = "the folder of the file and the seven above it";
            self.left_out.push(format!("`{name}`: there is neither `{inside}` nor `{rest}` in {folders}"));
            self.folder.join(rest)
        })
    }

    /// What a joint leaves free.
    fn hold(&mut self, node: Node<'_, '_>) -> Hold {
        let name = named(node);
        let kind = match node.attribute("type").unwrap_or_default() {
            "revolute" | "continuous" => Kind::Hinge,
            "prismatic" => Kind::Slide,
            "spherical" | "ball" => Kind::Ball,
            "fixed" => return Hold::Fixed,
            "floating" => {
                self.unresisted(node, "floating");
                return Hold::Free;
            }
            "planar" => {
                self.unresisted(node, "planar");
                return self.plane(node, &name);
            }
            other => {
                let message = format!("joint `{name}`: unknown type \"{other}\"");
                let help = "types are revolute, continuous, prismatic, fixed, floating, planar";
                self.found.error(head(&node), message, help);
                return Hold::Fixed;
            }
        };
        let mut joint = Joint::new(name.clone(), kind, self.axis(node));
        if let Some(dynamics) = child(node, "dynamics") {
            joint.damping = self.found.not_negative(dynamics.attribute_node("damping")).unwrap_or(0.0);
            joint.friction = self.found.not_negative(dynamics.attribute_node("friction")).unwrap_or(0.0);
        }
        let limit = child(node, "limit").filter(|_| node.attribute("type") != Some("continuous"));
        if let Some(limit) = limit {
            let mut number = |name: &str| self.found.number(limit.attribute_node(name)).unwrap_or(0.0);
            let (lower, upper) = (number("lower"), number("upper"));
            match lower.partial_cmp(&upper) {
                Some(std::cmp::Ordering::Less) => joint.range = Some((lower, upper)),
                Some(std::cmp::Ordering::Equal) => {
                    self.left_out.push(format!("limits of joint `{name}`: both are {lower}"));
                }
                // Programs that read URDF take this as a joint without limits.
                _ => self.left_out.push(format!("limits of joint `{name}`: {lower} is above {upper}")),
            }
        }
        if child(node, "limit").is_some_and(|limit| limit.has_attribute("effort") || limit.has_attribute("velocity"))
            && !self.left_out.iter().any(|what| what.starts_with("effort"))
        {
            self.left_out.push("effort and velocity in <limit>: bounds for a controller".into());
        }
        Hold::Joints(vec![joint])
    }

    /// Reports what resists or bounds a motion of several coordinates: the format does not say in which of them.
    fn unresisted(&mut self, node: Node<'_, '_>, kind: &str) {
        let number = |of: &str, name: &str| {
            let value = child(node, of).and_then(|of| of.attribute(name)?.trim().parse::<f64>().ok());
            value.is_some_and(|value| value != 0.0)
        };
        let dropped = [
            ("damping", number("dynamics", "damping")),
            ("friction", number("dynamics", "friction")),
            ("limits", number("limit", "lower") || number("limit", "upper")),
        ];
        let dropped: Vec<&str> = dropped.into_iter().filter_map(|(what, is_there)| is_there.then_some(what)).collect();
        if !dropped.is_empty() {
            self.left_out.push(format!("{kind} joint `{}`: its {}", named(node), dropped.join(" and ")));
        }
    }

    /// Two slides across the axis and a hinge about it.
    fn plane(&mut self, node: Node<'_, '_>, name: &str) -> Hold {
        let axis = self.axis(node);
        let x = Unit::new_normalize(axis.cross(&across(&axis)));
        let y = Unit::new_normalize(axis.cross(&x));
        let parts = [("x", Kind::Slide, x), ("y", Kind::Slide, y), ("angle", Kind::Hinge, axis)];
        let joint = |(part, kind, axis)| Joint { is_part: true, ..Joint::new(format!("{name}.{part}"), kind, axis) };
        Hold::Joints(parts.map(joint).into())
    }

    fn axis(&mut self, node: Node<'_, '_>) -> Unit<Vector3<f64>> {
        let attribute = child(node, "axis").and_then(|axis| axis.attribute_node("xyz"));
        let axis = self.found.list(attribute).map_or(Vector3::x(), Vector3::from);
        Unit::try_new(axis, 1e-9).unwrap_or_else(|| {
            self.found.error(head(&node), format!("the axis of joint `{}` has no direction", named(node)), "");
            Vector3::x_axis()
        })
    }

    fn mimic(&mut self, node: Node<'_, '_>) -> Option<Coupling> {
        let mimic = child(node, "mimic")?;
        let first = self.found.needed(mimic, "joint")?.to_owned();
        let ratio = self.found.number(mimic.attribute_node("multiplier")).unwrap_or(1.0);
        let offset = self.found.number(mimic.attribute_node("offset")).unwrap_or(0.0);
        let second = named(node);
        Some(Coupling { name: format!("{}_mimic", usable(&second)), first, second, ratio, offset, active: true })
    }
}

fn named(node: Node<'_, '_>) -> String {
    node.attribute("name").unwrap_or_default().to_owned()
}

/// Such as: link `arm`.
fn called(node: Node<'_, '_>) -> String {
    format!("{} `{}`", node.tag_name().name(), named(node))
}

/// A diagnostic for a file that is of neither format.
pub(crate) fn not_known(root: Node<'_, '_>) -> Diagnostic {
    let message = format!("the file begins with <{}>", root.tag_name().name());
    Diagnostic::error(codes::NOT_IMPORTED, message)
        .at(head(&root), "")
        .help("URDF begins with <robot>, MJCF with <mujoco>; a .xacro file is expanded by its own program first")
}
