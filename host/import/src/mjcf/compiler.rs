//! What `<compiler>` says.

use std::path::Path;

use roxmltree::Node;

use crate::mechanism::Solid;
use crate::xml::{Found, children};

/// The words of `<compiler>` that change what others mean.
pub(super) struct Compiler<'f> {
    pub(super) folder: &'f Path,
    pub(super) mesh_folder: String,
    /// Factor of angles.
    pub(super) angle: f64,
    pub(super) euler: String,
    pub(super) auto_limits: bool,
    /// Whether masses follow from shapes: always, never, or where there is no `<inertial>`.
    pub(super) from_shapes: Option<bool>,
    /// Mass and principal moments of inertia that no body is below.
    pub(super) least_mass: f64,
    pub(super) least_inertia: f64,
    /// Whether moments of inertia that no body can have are made equal.
    pub(super) balance: bool,
    /// Mass of all bodies together.
    pub(super) total_mass: Option<f64>,
    /// Whether shapes that are fitted to a mesh get their size from its bounds.
    pub(super) fit_to_bounds: bool,
    /// Groups of shapes that have mass, from the first to the last.
    pub(super) groups: [f64; 2],
}

impl<'f> Compiler<'f> {
    pub(super) fn read(root: Node<'_, '_>, folder: &'f Path, found: &mut Found) -> Self {
        let mut compiler = Self {
            folder,
            mesh_folder: String::new(),
            angle: 1.0_f64.to_radians(),
            euler: "xyz".into(),
            auto_limits: true,
            from_shapes: None,
            least_mass: 0.0,
            least_inertia: 0.0,
            balance: false,
            total_mass: None,
            fit_to_bounds: false,
            groups: [0.0, f64::INFINITY],
        };
        for node in children(root).filter(|node| node.has_tag_name("compiler")) {
            for attribute in node.attributes() {
                match (attribute.name(), attribute.value()) {
                    ("angle", "radian") => compiler.angle = 1.0,
                    ("angle", "degree") => compiler.angle = 1.0_f64.to_radians(),
                    ("eulerseq", sequence) => {
                        if sequence.len() != 3 || !sequence.chars().all(|c| "xyzXYZ".contains(c)) {
                            found.error(attribute.range_value(), "`eulerseq` is three of x, y, z, X, Y, Z", "");
                            continue;
                        }
                        compiler.euler = sequence.to_owned();
                    }
                    ("meshdir" | "assetdir", folder) => compiler.mesh_folder = folder.to_owned(),
                    ("autolimits", word) => compiler.auto_limits = word == "true",
                    ("fitaabb", word) => compiler.fit_to_bounds = word == "true",
                    ("inertiafromgeom", word) => compiler.from_shapes = (word != "auto").then_some(word == "true"),
                    ("coordinate", "global") => {
                        found.error(
                            attribute.range(),
                            "global coordinates are of an older MJCF",
                            "have MuJoCo write it anew",
                        );
                    }
                    ("settotalmass", _) => {
                        compiler.total_mass = found.number(Some(attribute)).filter(|mass| *mass > 0.0);
                    }
                    ("boundmass", _) => compiler.least_mass = found.not_negative(Some(attribute)).unwrap_or(0.0),
                    ("boundinertia", _) => compiler.least_inertia = found.not_negative(Some(attribute)).unwrap_or(0.0),
                    ("balanceinertia", word) => compiler.balance = word == "true",
                    ("inertiagrouprange", _) => {
                        compiler.groups = found.list(Some(attribute)).unwrap_or(compiler.groups)
                    }
                    _ => {}
                }
            }
        }
        compiler
    }

    /// The mass of a body as it becomes.
    pub(super) fn changed(&self, solid: Solid) -> Solid {
        let solid = solid.at_least(self.least_mass, self.least_inertia);
        if self.balance { solid.balanced() } else { solid }
    }
}
