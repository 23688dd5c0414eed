//! A mechanism as the text of a scene.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

use crate::Imported;
use crate::mechanism::{Closure, Coupling, Form, Hold, Joint, Kind, Link, Mechanism, Shape, Solid};
use crate::place::{Placed, across, at_start};
use crate::solid::read_mesh;

/// Digits that are written; what is behind them is round-off of turning frames.
const DIGITS: usize = 15;
/// Moments of inertia of a part that has none, by its mass, m^2.
const TINY: f64 = 1e-12;

/// Writes a mechanism whose links have one joint each, for a scene in `folder`.
pub(crate) fn scene(mechanism: Mechanism, folder: &Path) -> Imported {
    let mut writer = Writer {
        text: String::new(),
        folder,
        left_out: mechanism.left_out.clone(),
        taken: HashSet::from(["ground".to_owned()]),
        coordinates: Vec::new(),
        joints: HashMap::new(),
        renamed: Vec::new(),
    };
    writer.whole(&mechanism);
    if !writer.renamed.is_empty() {
        let what = "names of a scene are of letters, digits, `_` and `-`, each once, and `t` is the time";
        writer.left_out.push(format!("{what}: {}", writer.renamed.join(", ")));
    }
    let Writer { text, mut left_out, coordinates, .. } = writer;
    let mut said = HashSet::new();
    left_out.retain(|what| said.insert(what.clone()));
    let mut lines: String = format!("# {}\n", mechanism.title.replace(['\n', '\r'], " "));
    if !left_out.is_empty() {
        lines.push_str("#\n# Not carried over, or decided on the way:\n");
        for what in &left_out {
            let _ = writeln!(lines, "# - {}", what.replace(['\n', '\r'], " "));
        }
    }
    Imported { scene: format!("{lines}\n{text}"), joints: coordinates, bodies: mechanism.links.len(), left_out }
}

struct Writer<'f> {
    text: String,
    folder: &'f Path,
    left_out: Vec<String>,
    /// Names of bodies and elements.
    taken: HashSet<String>,
    /// Joints that have a coordinate.
    coordinates: Vec<String>,
    /// Name in the scene of a joint, its bodies, and its frames on them.
    joints: HashMap<String, Written>,
    /// Names of the file that are others in the scene, in words.
    renamed: Vec<String>,
}

/// A joint with one coordinate in the scene.
struct Written {
    kind: Kind,
    bodies: [String; 2],
    frames: [Frame; 2],
}

/// Origin, z axis, and a direction near the x axis, in the axes of a body.
#[derive(Clone, Copy)]
struct Frame {
    origin: Vector3<f64>,
    z: Vector3<f64>,
    x: Vector3<f64>,
}

impl Frame {
    fn of(pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation;
        Self { origin: pose.translation.vector, z: turn * Vector3::z(), x: turn * Vector3::x() }
    }

    fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self { origin: (pose * Point3::from(self.origin)).coords, z: pose.rotation * self.z, x: pose.rotation * self.x }
    }

    /// Shifted along its own z axis.
    fn along(&self, distance: f64) -> Self {
        Self { origin: self.origin + self.z * distance, ..*self }
    }

    fn text(&self) -> String {
        let mut keys = Vec::new();
        if list(&self.origin) != list(&Vector3::zeros()) {
            keys.push(format!("position = {}", list(&self.origin)));
        }
        if list(&self.z) != list(&Vector3::z()) || list(&self.x) != list(&Vector3::x()) {
            keys.push(format!("axis = {}, x_axis = {}", list(&self.z), list(&self.x)));
        }
        if keys.is_empty() { "{}".into() } else { format!("{{ {} }}", keys.join(", ")) }
    }
}

impl Writer<'_> {
    fn whole(&mut self, mechanism: &Mechanism) {
        self.line(&format!("title = {}", quoted(&mechanism.title)));
        self.line("\n[plugins]\nlibraries = [\"joints\", \"forces\"]\n\n[simulation]");
        self.line(&format!("gravity = {}", list(&mechanism.gravity)));
        self.line("t_end = 1\noutput_step = 0.01");
        if !mechanism.ground.is_empty() {
            let name = free_name(&mut self.taken, "surroundings", "");
            self.line(&format!("\n[[body]]\nname = {}\nfixed = true", quoted(&name)));
            self.shapes(&mechanism.ground);
        }
        let placed = at_start(mechanism);
        let moves = placed.iter().any(|at| at.velocity != Vector3::zeros() || at.angular_velocity != Vector3::zeros());
        // Bodies are named first: a joint of the same name is the one that gets another.
        let names: Vec<String> = mechanism.links.iter().map(|link| self.name_for("body", &link.name, "")).collect();
        // Joints have outputs of their names, beside the column of times.
        self.taken.insert("t".to_owned());
        let mut fixed: Vec<bool> = Vec::new();
        for ((link, name), at) in mechanism.links.iter().zip(&names).zip(&placed) {
            let stands = matches!(link.hold, Hold::Fixed) && link.parent.is_none_or(|parent| fixed[parent]);
            let parent = link.parent.map_or("ground".to_owned(), |parent| names[parent].clone());
            self.body(link, name, at, stands, moves);
            if !stands {
                self.hold(link, &parent, name);
            }
            fixed.push(stands);
        }
        let name_of = |link: Option<usize>| link.map_or("ground".to_owned(), |link| names[link].clone());
        for closure in &mechanism.closures {
            let [first, second] = closure.links.map(|link| link.filter(|link| !fixed[*link]));
            if first == second {
                let nothing = "nothing moves between what it ties";
                self.left_out.push(format!("`{}`: {nothing}", closure.name));
                continue;
            }
            self.closure(closure, closure.links.map(name_of));
        }
        for coupling in &mechanism.couplings {
            self.coupling(coupling);
        }
        for name in self.coordinates.clone() {
            let name = quoted(&name);
            self.line(&format!("\n[[output]]\nname = {name}\nquantity = \"coordinate\"\nof = {name}"));
        }
    }

    fn line(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn body(&mut self, link: &Link, name: &str, at: &Placed, stands: bool, moves: bool) {
        let remark = link.remark.as_ref().map_or(String::new(), |remark| format!("   # {remark}"));
        self.line(&format!("\n[[body]]{remark}\nname = {}", quoted(name)));
        if stands {
            self.line("fixed = true");
        } else if let Some(solid) = &link.solid {
            self.solid(link, solid);
        }
        if at.pose.translation.vector.amax() > 0.0 {
            self.line(&format!("position = {}", list(&at.pose.translation.vector)));
        }
        if let Some(turn) = orientation(&at.pose.rotation) {
            self.line(&format!("orientation = {{ euler_parameters = {turn} }}"));
        }
        if moves && !stands {
            self.line(&format!("velocity = {}", list(&at.velocity)));
            self.line(&format!("angular_velocity = {}", list(&at.angular_velocity)));
        }
        self.shapes(&link.shapes);
    }

    fn solid(&mut self, link: &Link, solid: &Solid) {
        let mut inertia = solid.inertia;
        if inertia.amax() == 0.0 {
            inertia = Matrix3::identity() * (TINY * solid.mass);
            self.left_out.push(format!("link `{}` has no moments of inertia; it has next to none here", link.name));
        }
        self.line(&format!("mass = {}", number(solid.mass)));
        if solid.com.amax() > 0.0 {
            self.line(&format!("com = {}", list(&solid.com)));
        }
        let i = clean(&[inertia.m11, inertia.m22, inertia.m33, inertia.m12, inertia.m23, inertia.m13]);
        let count = if i[3..].iter().all(|product| *product == 0.0) { 3 } else { 6 };
        let numbers: Vec<String> = i[..count].iter().map(|x| number(*x)).collect();
        let note = if count == 6 { "   # xx, yy, zz, xy, yz, zx" } else { "" };
        self.line(&format!("inertia = [{}]{note}", numbers.join(", ")));
    }

    fn shapes(&mut self, shapes: &[Shape]) {
        for shape in shapes {
            if let Some(form) = self.form(&shape.form) {
                self.line(&format!("\n[[body.shape]]\n{form}"));
                if shape.pose != Isometry3::identity() {
                    self.line(&format!("frame = {}", Frame::of(&shape.pose).text()));
                }
                if let Some(color) = &shape.color {
                    self.line(&format!("color = {}", quoted(color)));
                }
            }
        }
    }

    /// The keys of a shape; `None` where scenes have none for it, which is said.
    fn form(&mut self, form: &Form) -> Option<String> {
        Some(match form {
            Form::Box(edges) => format!("kind = \"box\"\nsize = {}", list(edges)),
            Form::Sphere(radius) => format!("kind = \"sphere\"\nradius = {}", number(*radius)),
            Form::Cylinder(radius, length) => {
                format!("kind = \"cylinder\"\nradius = {}\nlength = {}", number(*radius), number(*length))
            }
            Form::Capsule(radius, length) => {
                format!("kind = \"capsule\"\nradius = {}\nlength = {}", number(*radius), number(*length))
            }
            Form::Ellipsoid(_) => {
                self.left_out.push("ellipsoids as shapes (their masses are there)".into());
                return None;
            }
            Form::Mesh { path, scale } => {
                let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
                let units = [(1.0, "m"), (0.1, "dm"), (0.01, "cm"), (0.001, "mm"), (1e-6, "um"), (0.0254, "in")];
                let is_unit = |factor: f64| (scale / factor - Matrix3::identity()).amax() < 1e-9;
                let unit = units.into_iter().find(|(factor, _)| is_unit(*factor));
                let Some((_, unit)) = unit else {
                    let is_turned = Matrix3::from_diagonal(&scale.diagonal()) != *scale;
                    let factors =
                        if is_turned { Vector3::from_fn(|k, _| scale.row(k).norm()) } else { scale.diagonal() };
                    self.left_out.push(format!("mesh `{file}`: its scale {} is that of no unit", list(&factors)));
                    return None;
                };
                if let Err(reason) = read_mesh(path) {
                    self.left_out.push(format!("mesh `{file}`: {reason}"));
                    return None;
                }
                let unit = if unit == "m" { String::new() } else { format!("\nunit = \"{unit}\"") };
                format!("kind = \"mesh\"\nfile = {}{unit}", quoted(&relative(path, self.folder)))
            }
        })
    }

    /// What holds a link on its parent.
    fn hold(&mut self, link: &Link, parent: &str, name: &str) {
        match &link.hold {
            Hold::Free => {}
            Hold::Fixed => {
                let element = self.element_name(&format!("{name}-mount"));
                let frames = [Frame::of(&link.pose), Frame::of(&Isometry3::identity())];
                self.element("joint", &element, "bracket", &[parent, name], &frames, "");
            }
            Hold::Joints(joints) => {
                for joint in joints {
                    self.joint(joint, &link.pose, [parent, name]);
                }
            }
        }
    }

    /// A name for what has one in the file; another one is said.
    fn name_for(&mut self, what: &str, wanted: &str, ending: &str) -> String {
        let name = free_name(&mut self.taken, wanted, ending);
        if name != wanted {
            self.renamed.push(format!("{what} `{wanted}` is `{name}`"));
        }
        name
    }

    fn element_name(&mut self, wanted: &str) -> String {
        free_name(&mut self.taken, wanted, "-joint")
    }

    /// An element with its frames on its bodies.
    fn element(&mut self, list: &str, name: &str, kind: &str, bodies: &[&str], frames: &[Frame], params: &str) {
        let bodies: Vec<String> = bodies.iter().map(|body| quoted(body)).collect();
        let frames: Vec<String> = frames.iter().map(|frame| format!("  {},\n", frame.text())).collect();
        let name = quoted(name);
        let bodies = bodies.join(", ");
        self.line(&format!("\n[[{list}]]\nname = {name}\ntype = \"{kind}\"\nbodies = [{bodies}]"));
        self.line(&format!("frames = [\n{}]", frames.concat()));
        if !params.is_empty() {
            self.line(&format!("params = {{ {params} }}"));
        }
    }

    fn joint(&mut self, joint: &Joint, pose: &Isometry3<f64>, bodies: [&str; 2]) {
        let name =
            if joint.is_part { self.element_name(&joint.name) } else { self.name_for("joint", &joint.name, "-joint") };
        let z = joint.axis.into_inner();
        let own = Frame { origin: joint.place.coords, z, x: across(&joint.axis) };
        let on_parent = own.moved(pose);
        // Where the coordinate is zero, the frames are on each other; the pose is that at the reference.
        let on_child = match joint.kind {
            Kind::Hinge => {
                let turn = UnitQuaternion::from_axis_angle(&joint.axis, joint.reference);
                Frame { x: turn * own.x, ..own }
            }
            Kind::Slide => own.along(joint.reference),
            Kind::Ball => own,
        };
        let frames = [on_parent, on_child];
        let kind = match joint.kind {
            Kind::Hinge => "revolute",
            Kind::Slide => "translational",
            Kind::Ball => "spherical",
        };
        self.element("joint", &name, kind, &bodies, &frames, "");
        if !joint.has_coordinate() {
            if joint.damping + joint.friction + joint.stiffness + joint.armature > 0.0 || joint.range.is_some() {
                let what = "damping, friction, stiffness, armature and limits of a ball joint";
                self.left_out.push(format!("joint `{}`: {what}", joint.name));
            }
            return;
        }
        self.resistance(joint, &name, &bodies, &frames);
        self.coordinates.push(name);
        let bodies = bodies.map(str::to_owned);
        self.joints.insert(joint.name.clone(), Written { kind: joint.kind, bodies, frames });
    }

    /// Spring, damper, rotor, friction and stops of a joint.
    fn resistance(&mut self, joint: &Joint, name: &str, bodies: &[&str; 2], frames: &[Frame; 2]) {
        let is_hinge = joint.kind == Kind::Hinge;
        if joint.stiffness > 0.0 || joint.damping > 0.0 {
            let what = if joint.stiffness > 0.0 { "spring" } else { "damper" };
            let element = self.element_name(&format!("{name}-{what}"));
            let (stiffness, damping) = (number(joint.stiffness), number(joint.damping));
            if is_hinge {
                let mut params = format!("stiffness = {stiffness}");
                if joint.damping > 0.0 {
                    let _ = write!(params, ", damping = {damping}");
                }
                if joint.relaxed != 0.0 && joint.stiffness > 0.0 {
                    let _ = write!(params, ", free_angle = {}", number(joint.relaxed));
                }
                self.element("force", &element, "rotational-spring-damper", bodies, frames, &params);
            } else {
                // A bushing has a direction where its frames meet, as coordinates do where they are zero.
                let params = format!(
                    "stiffness = [0, 0, {stiffness}], damping = [0, 0, {damping}], rotational_stiffness = [0, 0, 0]"
                );
                let relaxed = [frames[0].along(joint.relaxed), frames[1]];
                self.element("force", &element, "bushing", bodies, &relaxed, &params);
            }
        }
        if joint.armature > 0.0 {
            let element = self.element_name(&format!("{name}-rotor"));
            let inertance = format!("inertance = {}", number(joint.armature));
            if is_hinge {
                self.element("force", &element, "rotational-inerter", bodies, frames, &inertance);
            } else {
                self.element("force", &element, "inerter", bodies, frames, &format!("{inertance}, guided = true"));
            }
        }
        if joint.friction > 0.0 {
            let element = self.element_name(&format!("{name}-friction"));
            let key = if is_hinge { "torque" } else { "force" };
            let params = format!("{key} = {}", number(joint.friction));
            self.element("joint", &element, "dry-friction", bodies, frames, &params);
        }
        if let Some((lower, upper)) = joint.range {
            let element = self.element_name(&format!("{name}-stop"));
            let kind = if is_hinge { "rotational-stop" } else { "translational-stop" };
            let params = format!("lower = {}, upper = {}", number(lower), number(upper));
            self.element("joint", &element, kind, bodies, frames, &params);
        }
    }

    fn closure(&mut self, closure: &Closure, bodies: [String; 2]) {
        let name = self.name_for("equality", &closure.name, "-joint");
        let kind = if closure.rigid { "bracket" } else { "spherical" };
        let frames = closure.frames.map(|frame| Frame::of(&frame));
        self.element("joint", &name, kind, &[&bodies[0], &bodies[1]], &frames, "");
        self.inactive(closure.active);
    }

    fn coupling(&mut self, coupling: &Coupling) {
        let (Some(first), Some(second)) = (self.joints.get(&coupling.first), self.joints.get(&coupling.second)) else {
            let missing = format!(
                "`{}` follows `{}`, and one of the two is no joint with a coordinate",
                coupling.second, coupling.first
            );
            self.left_out.push(missing);
            return;
        };
        if coupling.ratio == 0.0 {
            self.left_out.push(format!("`{}` follows `{}` with the ratio zero", coupling.second, coupling.first));
            return;
        }
        let kind = |kind: Kind| if kind == Kind::Hinge { "rotation" } else { "translation" };
        let mut params = format!("first = \"{}\", second = \"{}\"", kind(first.kind), kind(second.kind));
        // The element's `lead` is displacement by angle, whichever comes first.
        let ratio = match (first.kind, second.kind) {
            (Kind::Slide, Kind::Hinge) => format!("lead = {}", number(1.0 / coupling.ratio)),
            (Kind::Hinge, Kind::Slide) => format!("lead = {}", number(coupling.ratio)),
            _ => format!("ratio = {}", number(coupling.ratio)),
        };
        let _ = write!(params, ", {ratio}");
        if coupling.offset != 0.0 {
            let key = if second.kind == Kind::Hinge { "angle_offset" } else { "displacement_offset" };
            let _ = write!(params, ", {key} = {}", number(coupling.offset));
        }
        let bodies = [first, second].map(|written| written.bodies.clone()).concat();
        let frames = [first, second].map(|written| written.frames).concat();
        let bodies: Vec<&str> = bodies.iter().map(String::as_str).collect();
        let name = self.name_for("equality", &coupling.name, "-joint");
        self.element("joint", &name, "coupler", &bodies, &frames, &params);
        self.inactive(coupling.active);
    }

    fn inactive(&mut self, active: bool) {
        if !active {
            self.line("enabled = false");
        }
    }
}

/// A name with `_` for what is no letter, digit, `_` or `-`.
pub(crate) fn usable(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-') { c } else { '_' }).collect()
}

/// A usable name that is not taken, with an ending where it is; it is taken then.
fn free_name(taken: &mut HashSet<String>, wanted: &str, ending: &str) -> String {
    let name = usable(wanted);
    let name = if name.is_empty() { "unnamed".to_owned() } else { name };
    let others = (2..).map(|count| format!("{name}{ending}-{count}"));
    let mut candidates = [name.clone(), format!("{name}{ending}")].into_iter().chain(others);
    candidates.find(|free| taken.insert(free.clone())).unwrap_or(name)
}

/// A text of TOML.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// A number as it is written: without round-off behind its last digits.
pub(crate) fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.*e}", DIGITS - 1).parse().unwrap_or(x);
    let rounded = if rounded == 0.0 { 0.0 } else { rounded };
    let plain = format!("{rounded}");
    if plain.len() > 20 { format!("{rounded:e}") } else { plain }
}

/// Numbers without those that are round-off of the others.
fn clean(numbers: &[f64]) -> Vec<f64> {
    let largest = numbers.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    numbers.iter().map(|x| if x.abs() < 1e-15 * largest { 0.0 } else { *x }).collect()
}

fn list(vector: &Vector3<f64>) -> String {
    let numbers: Vec<String> = clean(vector.as_slice()).into_iter().map(number).collect();
    format!("[{}]", numbers.join(", "))
}

/// Euler parameters; `None` for the orientation of the ground.
fn orientation(turn: &UnitQuaternion<f64>) -> Option<String> {
    let sign = if turn.w < 0.0 { -1.0 } else { 1.0 };
    let numbers = clean(&[turn.w * sign, turn.i * sign, turn.j * sign, turn.k * sign]);
    (numbers[1..] != [0.0; 3]).then(|| {
        let numbers: Vec<String> = numbers.into_iter().map(number).collect();
        format!("[{}]", numbers.join(", "))
    })
}

/// A file as seen from a folder.
fn relative(file: &Path, folder: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = if folder.as_os_str().is_empty() { whole(Path::new(".")) } else { whole(folder) };
    let (file, folder): (Vec<_>, Vec<_>) =
        (whole(file).components().map(owned).collect(), folder.components().map(owned).collect());
    let common = file.iter().zip(&folder).take_while(|(a, b)| a == b).count();
    let up = folder[common..].iter().map(|_| PathBuf::from(".."));
    let path: PathBuf = up.chain(file[common..].iter().cloned()).collect();
    path.to_string_lossy().replace('\\', "/")
}

fn owned(component: Component<'_>) -> PathBuf {
    Path::new(component.as_os_str()).to_owned()
}
