//! MJCF: bodies within bodies, each with its joints; classes of defaults.
//!
//! (Format: mujoco.readthedocs.io, XML reference.)

mod actuator;
mod compiler;
mod defaults;
mod geometry;
mod switches;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::{Node, NodeId};

use crate::Options;
use crate::mechanism::{Closure, Coupling, Hold, Joint, Kind, Link, Mechanism, Solid};
use crate::xml::{Found, children, head};
use compiler::Compiler;
use defaults::{Classes, Of};

/// The ways to give an orientation; an element has one of them, which counts in place of that of its class.
const TURNS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// Gravity where a file has none, m/s^2.
const GRAVITY: f64 = -9.81;

/// Reads a `<mujoco>`. `folder` is where meshes are looked for.
pub(crate) fn read(root: Node<'_, '_>, folder: &Path, options: &Options, found: &mut Found) -> Mechanism {
    let only_mujoco =
        |node: &Node<'_, '_>| matches!(node.tag_name().name(), "replicate" | "composite" | "flexcomp" | "attach");
    for node in root.descendants().filter(only_mujoco) {
        let message = format!("<{}> is not expanded here", node.tag_name().name());
        let help = "MuJoCo writes the whole model into one file: mujoco.mj_saveLastXML(\"whole.xml\", model)";
        found.error(head(&node), message, help);
    }
    let title = root.attribute("model").unwrap_or("mechanism").to_owned();
    let mut mechanism = Mechanism { title, gravity: Vector3::new(0.0, 0.0, GRAVITY), ..Mechanism::default() };
    if found.has_errors() {
        return mechanism;
    }
    let compiler = Compiler::read(root, folder, found);
    let classes = Classes::read(root, found);
    classes.check(root, found);
    let meshes = geometry::meshes(root, &compiler, &classes, found);
    let mut reader = Reader {
        compiler,
        classes,
        meshes,
        density: options.density,
        found,
        mechanism: &mut mechanism,
        sites: HashMap::new(),
        touching: HashSet::new(),
    };
    reader.options(root);
    reader.others(root);
    for world in children(root).filter(|node| node.has_tag_name("worldbody")) {
        reader.inside(world, None, Isometry3::identity(), world.attribute("childclass"));
    }
    if let Some(wanted) = reader.compiler.total_mass {
        let factor = wanted / reader.mechanism.solids_mut().map(|solid| solid.mass).sum::<f64>();
        for solid in reader.mechanism.solids_mut().filter(|_| factor.is_finite()) {
            (solid.mass, solid.inertia) = (solid.mass * factor, solid.inertia * factor);
        }
    }
    for actuators in children(root).filter(|node| node.has_tag_name("actuator")) {
        for node in children(actuators) {
            reader.actuator(node);
        }
    }
    for equality in children(root).filter(|node| node.has_tag_name("equality")) {
        for node in children(equality) {
            reader.equality(node);
        }
    }
    let touching = reader.touching.len() > 1;
    switches::apply(root, touching, &mut mechanism);
    mechanism
}

struct Reader<'r, 'a, 'i> {
    compiler: Compiler<'r>,
    classes: Classes<'a, 'i>,
    meshes: HashMap<String, geometry::MeshFile>,
    density: f64,
    found: &'r mut Found,
    mechanism: &'r mut Mechanism,
    /// Places of sites: their link, and their frame in it.
    sites: HashMap<String, (Option<usize>, Isometry3<f64>)>,
    /// Bodies with shapes that others could touch.
    touching: HashSet<NodeId>,
}

impl<'a, 'i: 'a> Reader<'_, 'a, 'i> {
    fn left_out(&mut self, what: impl Into<String>) {
        self.mechanism.left_out.push(what.into());
    }

    fn options(&mut self, root: Node<'a, 'i>) {
        for node in children(root).filter(|node| node.has_tag_name("option")) {
            if let Some(gravity) = self.found.list(node.attribute_node("gravity")) {
                self.mechanism.gravity = Vector3::from(gravity);
            }
            for medium in ["density", "viscosity", "wind"] {
                let numbers = node.attribute_node(medium).and_then(|attribute| self.found.numbers(&attribute));
                if numbers.is_some_and(|numbers| numbers.iter().any(|x| *x != 0.0)) {
                    self.left_out(format!("the medium around (`{medium}` in <option>)"));
                }
            }
        }
    }

    /// What is in the file beside bodies and what ties them.
    fn others(&mut self, root: Node<'a, 'i>) {
        for node in children(root).filter(|node| children(*node).next().is_some()) {
            let name = node.tag_name().name();
            let count = children(node).count();
            let what = match name {
                "actuator" => {
                    "motors: give the scene rotational-actuator or translational-actuator elements; their armature and damping are there"
                }
                "tendon" => "ropes and linear combinations of joints",
                "sensor" => "measurements: outputs of the scene take their place",
                "keyframe" => "states: `--pose` sets one",
                "contact" => "pairs that touch, or do not",
                "deformable" => "flexible parts",
                "extension" | "plugin" => "extensions",
                _ => continue,
            };
            self.left_out(format!("<{name}>, {count} of them: {what}"));
        }
    }

    /// What is inside of a body, or of the world.
    fn inside(&mut self, node: Node<'a, 'i>, link: Option<usize>, frame: Isometry3<f64>, class: Option<&'a str>) {
        for below in children(node) {
            let class = below.attribute("childclass").or(class);
            match below.tag_name().name() {
                "body" => self.body(below, link, frame, class),
                "frame" => {
                    let pose = self.pose(&Of::alone(below));
                    self.inside(below, link, frame * pose, class);
                }
                "site" => {
                    let site = self.classes.of(below, "site", class);
                    let pose = frame * self.pose(&site);
                    if let Some(name) = below.attribute("name") {
                        self.sites.insert(name.to_owned(), (link, pose));
                    }
                }
                "geom" if link.is_none() => {
                    let (shape, _) = self.geom(below, &frame, class);
                    self.mechanism.ground.extend(shape);
                }
                _ => {}
            }
        }
    }

    fn body(&mut self, node: Node<'a, 'i>, parent: Option<usize>, frame: Isometry3<f64>, class: Option<&'a str>) {
        let number = self.mechanism.links.len();
        let name = node.attribute("name").map_or_else(|| format!("body-{}", number + 1), str::to_owned);
        if node.attribute("mocap") == Some("true") {
            self.left_out(format!("body `{name}`: moved from outside (mocap); it stands still"));
        }
        if self.found.number(node.attribute_node("gravcomp")).is_some_and(|share| share != 0.0) {
            self.left_out(format!("body `{name}`: compensation of gravity"));
        }
        let own = self.pose(&Of::alone(node));
        let pose = frame * own;
        let mut parts = Parts::default();
        self.parts(node, &Isometry3::identity(), class, &mut parts);
        let hold = match (parts.free, parts.joints.is_empty()) {
            (true, _) => Hold::Free,
            (false, true) => Hold::Fixed,
            (false, false) => Hold::Joints(parts.joints),
        };
        let solid = match self.compiler.from_shapes {
            // As MuJoCo, where no shape weighs anything.
            Some(true) => parts.solid.or(parts.given),
            Some(false) => parts.given,
            None => parts.given.or(parts.solid),
        };
        // Of a body without a mass of its own MuJoCo takes the centre to be at `pos` of the body, in the body's frame.
        let none = Solid { mass: 0.0, com: own.translation.vector, inertia: Matrix3::zeros() };
        let solid = Some(self.compiler.changed(solid.unwrap_or(none))).filter(Solid::is_something);
        self.mechanism.links.push(Link { name, parent, pose, hold, solid, shapes: parts.shapes, remark: None });
        self.inside(node, Some(number), Isometry3::identity(), class);
    }

    /// Joints, shapes and mass of a body, also within frames.
    fn parts(&mut self, node: Node<'a, 'i>, frame: &Isometry3<f64>, class: Option<&'a str>, parts: &mut Parts) {
        for below in children(node) {
            match below.tag_name().name() {
                "freejoint" => parts.free = true,
                "joint" if self.classes.of(below, "joint", class).text("type") == Some("free") => {
                    parts.free = true;
                    self.resistance_of_free(below, class);
                }
                "joint" => {
                    let count = parts.joints.len() + self.mechanism.joints().count() + 1;
                    let joint = self.joint(below, frame, class, count);
                    parts.joints.extend(joint);
                }
                "geom" => {
                    let (shape, solid) = self.geom(below, frame, class);
                    parts.shapes.extend(shape);
                    if let Some(solid) = solid {
                        parts.solid = Some(parts.solid.map_or(solid, |sum| sum.and(&solid)));
                    }
                }
                // Of several, one of them in a frame, the last counts.
                "inertial" => parts.given = self.inertial(below, frame),
                "frame" => {
                    let pose = frame * self.pose(&Of::alone(below));
                    self.parts(below, &pose, below.attribute("childclass").or(class), parts);
                }
                _ => {}
            }
        }
    }

    /// Reports what resists the motion of a free joint: a scene has no such element.
    fn resistance_of_free(&mut self, node: Node<'a, 'i>, class: Option<&'a str>) {
        let of = self.classes.of(node, "joint", class);
        if ["damping", "stiffness", "frictionloss", "armature"].into_iter().any(|name| self.first(&of, name) != 0.0) {
            let name = node.attribute("name").map_or_else(String::new, |name| format!(" `{name}`"));
            self.left_out(format!("free joint{name}: its damping, friction, stiffness and armature"));
        }
    }

    fn inertial(&mut self, node: Node<'a, 'i>, frame: &Isometry3<f64>) -> Option<Solid> {
        let of = Of::alone(node);
        let mass = self.found.not_negative(of.get("mass"))?;
        let inertia = if let Some([xx, yy, zz, xy, xz, yz]) = self.found.list(of.get("fullinertia")) {
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        } else {
            let diagonal = self.found.list(of.get("diaginertia")).unwrap_or_default();
            Matrix3::from_diagonal(&Vector3::from(diagonal))
        };
        let pose = frame * self.pose(&of);
        Some(Solid { mass, com: Vector3::zeros(), inertia }.moved(&pose))
    }

    fn joint(
        &mut self,
        node: Node<'a, 'i>,
        frame: &Isometry3<f64>,
        class: Option<&'a str>,
        count: usize,
    ) -> Option<Joint> {
        let of = self.classes.of(node, "joint", class);
        let name = node.attribute("name").map_or_else(|| format!("joint-{count}"), str::to_owned);
        let kind = match of.text("type").unwrap_or("hinge") {
            "hinge" => Kind::Hinge,
            "slide" => Kind::Slide,
            "ball" => Kind::Ball,
            other => {
                self.found.error(
                    head(&node),
                    format!("joint `{name}`: unknown type \"{other}\""),
                    "types are hinge, slide, ball, free",
                );
                return None;
            }
        };
        let axis = self.found.list(of.get("axis")).map_or(Vector3::z(), Vector3::from);
        let Some(axis) = Unit::try_new(frame.rotation * axis, 1e-12) else {
            self.found.error(head(&node), format!("the axis of joint `{name}` has no direction"), "");
            return None;
        };
        let mut joint = Joint::new(name, kind, axis);
        joint.place = frame * Point3::from(self.found.list(of.get("pos")).map_or(Vector3::zeros(), Vector3::from));
        let turn = if kind == Kind::Hinge { self.compiler.angle } else { 1.0 };
        joint.reference = self.found.number(of.get("ref")).unwrap_or(0.0) * turn;
        joint.relaxed = self.found.number(of.get("springref")).unwrap_or(0.0) * turn;
        joint.damping = self.first(&of, "damping");
        joint.stiffness = self.first(&of, "stiffness");
        joint.friction = self.first(&of, "frictionloss");
        joint.armature = self.first(&of, "armature");
        if of.get("springdamper").is_some() {
            self.left_out(format!(
                "joint `{}`: `springdamper`, from which MuJoCo takes stiffness and damping",
                joint.name
            ));
        }
        let range = of.get("range").and_then(|range| self.found.list::<2>(Some(range)));
        let limited = match of.text("limited") {
            Some("true") => true,
            Some("false") => false,
            // A class may have limits; an element of it has none with `range="0 0"`.
            _ => self.compiler.auto_limits && range.is_some_and(|range| range != [0.0; 2]),
        };
        if let Some([lower, upper]) = range.filter(|_| limited) {
            if lower < upper {
                joint.range = Some((lower * turn, upper * turn));
            } else {
                self.found.error(
                    head(&node),
                    format!("limits of joint `{}`: {lower} is not below {upper}", joint.name),
                    "",
                );
            }
        }
        Some(joint)
    }

    /// The numbers of an attribute that may have fewer of them than its class: those that follow are the ones of the class.
    pub(super) fn numbers(&mut self, of: &Of<'a, 'i>, name: &str) -> Vec<f64> {
        let mut numbers = Vec::new();
        for attribute in of.all(name) {
            let given = self.found.numbers(&attribute).unwrap_or_default();
            numbers.extend(given.into_iter().skip(numbers.len()));
        }
        numbers
    }

    /// A coefficient; further numbers are those of a polynomial.
    fn first(&mut self, of: &Of<'a, 'i>, name: &str) -> f64 {
        let Some(attribute) = of.get(name) else { return 0.0 };
        let numbers = self.numbers(of, name);
        if numbers.iter().skip(1).any(|x| *x != 0.0) {
            self.left_out(format!("`{name}` as a polynomial: its linear part is there"));
        }
        let first = numbers.first().copied().unwrap_or(0.0);
        if first < 0.0 {
            self.found.error(attribute.range_value(), format!("`{name}` is negative"), "");
        }
        first.max(0.0)
    }

    /// Place and orientation, in whichever way these are given.
    fn pose(&mut self, of: &Of<'a, 'i>) -> Isometry3<f64> {
        let at = self.found.list(of.get("pos")).map_or(Vector3::zeros(), Vector3::from);
        Isometry3::from_parts(Translation3::from(at), self.turn(of))
    }

    fn turn(&mut self, of: &Of<'a, 'i>) -> UnitQuaternion<f64> {
        let Some(of) = of.nearest(&TURNS) else { return UnitQuaternion::identity() };
        if let Some([w, x, y, z]) = self.found.list(of.get("quat")) {
            return UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        }
        if let Some([x, y, z, angle]) = self.found.list(of.get("axisangle")) {
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-12).unwrap_or(Vector3::x_axis());
            return UnitQuaternion::from_axis_angle(&axis, angle * self.compiler.angle);
        }
        if let Some([a, b, c, d, e, f]) = self.found.list(of.get("xyaxes")) {
            let x = Vector3::new(a, b, c).normalize();
            let y = Vector3::new(d, e, f);
            let y = (y - x * x.dot(&y)).normalize();
            let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
            return UnitQuaternion::from_rotation_matrix(&turn);
        }
        if let Some(z) = self.found.list(of.get("zaxis")) {
            return geometry::from_z(&Vector3::from(z));
        }
        let Some(angles) = self.found.list::<3>(of.get("euler")) else { return UnitQuaternion::identity() };
        let mut turn = UnitQuaternion::identity();
        for (letter, angle) in self.compiler.euler.chars().zip(angles) {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let step = UnitQuaternion::from_axis_angle(&axis, angle * self.compiler.angle);
            // Small letters turn about the axes that move, capitals about those that stand.
            turn = if letter.is_ascii_lowercase() { turn * step } else { step * turn };
        }
        turn
    }

    fn equality(&mut self, node: Node<'a, 'i>) {
        let of = self.classes.of(node, "equality", None);
        let kind = node.tag_name().name();
        let active = of.text("active") != Some("false");
        let number = self.mechanism.closures.len() + self.mechanism.couplings.len() + 1;
        let name = node.attribute("name").map_or_else(|| format!("{kind}-{number}"), str::to_owned);
        match kind {
            "connect" | "weld" => {
                let Some((links, frames)) = self.tied(node, &of, kind == "weld") else { return };
                let turns = self.found.number(of.get("torquescale"));
                if turns.is_some_and(|scale| scale != 0.0 && scale != 1.0) {
                    self.left_out(format!("equality `{name}`: `torquescale`, how soft MuJoCo holds its orientation"));
                }
                // With a scale of zero MuJoCo holds the point, and no orientation.
                let rigid = kind == "weld" && turns != Some(0.0);
                self.mechanism.closures.push(Closure { name, links, frames, rigid, active });
            }
            "joint" => {
                let (Some(second), Some(first)) = (node.attribute("joint1"), node.attribute("joint2")) else {
                    self.left_out(format!("equality `{name}`: a joint that is held where it is"));
                    return;
                };
                let poly =
                    of.get("polycoef").and_then(|attribute| self.found.numbers(&attribute)).unwrap_or(vec![0.0, 1.0]);
                if poly.iter().skip(2).any(|x| *x != 0.0) {
                    self.left_out(format!("equality `{name}`: a polynomial of two joints"));
                    return;
                }
                // The polynomial is of what joints are away from their references.
                let reference =
                    |name: &str| self.mechanism.joints().find(|joint| joint.name == name).map_or(0.0, |j| j.reference);
                let ratio = poly.get(1).copied().unwrap_or(1.0);
                let offset = poly.first().copied().unwrap_or(0.0) + reference(second) - ratio * reference(first);
                let (first, second) = (first.to_owned(), second.to_owned());
                self.mechanism.couplings.push(Coupling { name, first, second, ratio, offset, active });
            }
            _ => self.left_out(format!("equality `{name}`: <{kind}>")),
        }
    }

    /// The links that an equality ties, and where on them.
    #[allow(clippy::type_complexity)]
    fn tied(
        &mut self,
        node: Node<'a, 'i>,
        of: &Of<'a, 'i>,
        rigid: bool,
    ) -> Option<([Option<usize>; 2], [Isometry3<f64>; 2])> {
        if let (Some(first), Some(second)) = (node.attribute("site1"), node.attribute("site2")) {
            let mut site = |name: &str| {
                let site = self.sites.get(name).copied();
                if site.is_none() {
                    self.found.error(head(&node), format!("there is no site `{name}`"), "");
                }
                site
            };
            let (first, second) = (site(first)?, site(second)?);
            return Some(([first.0, second.0], [first.1, second.1]));
        }
        let first = self.found.needed(node, "body1")?;
        let first = self.link(node, first)?;
        let second = match node.attribute("body2") {
            Some(name) => self.link(node, name)?,
            None => None,
        };
        let poses = self.references();
        let pose = |link: Option<usize>| link.map_or(Isometry3::identity(), |link| poses[link]);
        let between = pose(second).inverse() * pose(first);
        if !rigid {
            let anchor = self.found.list(of.get("anchor")).map_or(Vector3::zeros(), Vector3::from);
            let frame = Isometry3::from_parts(Translation3::from(anchor), UnitQuaternion::identity());
            return Some(([first, second], [frame, between * frame]));
        }
        // Where the anchor is in the first, and the orientation of the second there; a quaternion of zeros is as at the references.
        let given = self.found.list::<7>(of.get("relpose")).filter(|pose| pose[3..] != [0.0; 4]);
        let anchor = self.found.list(of.get("anchor")).map_or(Vector3::zeros(), Vector3::from);
        let on_second = Isometry3::from_parts(Translation3::from(anchor), UnitQuaternion::identity());
        let on_first = given.map_or(between.inverse() * on_second, |[x, y, z, w, i, j, k]| {
            let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
            Isometry3::from_parts(Translation3::new(x, y, z), turn)
        });
        Some(([first, second], [on_first, on_second]))
    }

    fn link(&mut self, node: Node<'a, 'i>, name: &str) -> Option<Option<usize>> {
        if name == "world" {
            return Some(None);
        }
        let link = self.mechanism.links.iter().position(|link| link.name == name);
        if link.is_none() {
            self.found.error(head(&node), format!("there is no body `{name}`"), "");
        }
        Some(Some(link?))
    }

    /// Poses of all links where their joints are at their references.
    fn references(&self) -> Vec<Isometry3<f64>> {
        let mut poses: Vec<Isometry3<f64>> = Vec::new();
        for link in &self.mechanism.links {
            let parent = link.parent.map_or(Isometry3::identity(), |parent| poses[parent]);
            poses.push(parent * link.pose);
        }
        poses
    }
}

/// What a body is made of.
#[derive(Default)]
struct Parts {
    free: bool,
    joints: Vec<Joint>,
    shapes: Vec<crate::mechanism::Shape>,
    /// Mass of the shapes.
    solid: Option<Solid>,
    /// Mass that is given.
    given: Option<Solid>,
}
