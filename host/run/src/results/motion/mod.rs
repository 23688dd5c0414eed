//! `motion.bin`: where all bodies were at the samples, and what acted on them.
//!
//! One line of JSON ([`MotionHeader`]), padded with blanks so that what follows begins at a multiple of 8 bytes; then a record per
//! sample, little endian: the time (f64, in the scene's unit), per body that can move seven f32 (position of the origin of its
//! frame, m, ground axes; Euler parameters body -> ground, scalar first), per load six f32 (force, N; torque about the frame's
//! origin, N m; ground axes). A record that is not whole, which a run that is killed may leave, is none.

mod read;
mod write;

use serde::{Deserialize, Serialize};

use super::mesh::Mesh;

pub use read::Motion;
pub use write::MotionWriter;

/// What this version writes.
pub const MOTION_FORMAT: &str = "odyn-motion/1";

/// Numbers of a pose.
pub const POSE: usize = 7;
/// Numbers of a load.
pub const LOAD: usize = 6;

/// What a picture of a motion shows. Lengths in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionHeader {
    /// [`MOTION_FORMAT`].
    pub format: String,
    /// Title of the scene; may be empty.
    pub title: String,
    /// Unit of the times.
    pub time_unit: String,
    /// Diagonal of a box around all that is shown, where the run begins.
    pub length: f64,
    /// All bodies, in the order of the scene.
    pub bodies: Vec<ShownBody>,
    /// All elements that are switched on.
    pub elements: Vec<ShownElement>,
    /// The loads of each record.
    pub loads: Vec<ShownLoad>,
    /// Acceleration of gravity, m/s^2, ground axes.
    pub gravity: [f64; 3],
}

/// A body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownBody {
    /// Its name.
    pub name: String,
    /// Part of the ground: it has no poses, and all that belongs to it is given in ground.
    pub fixed: bool,
    /// Centre of mass in its frame.
    pub centre: [f64; 3],
    /// What it looks like.
    pub shapes: Vec<Shape>,
}

/// A shape of a body; it has the measures of its kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shape {
    /// `box`, `cylinder`, `sphere`, `capsule` or `mesh`.
    pub kind: String,
    /// Of a cylinder, sphere or capsule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Of a cylinder, or of a capsule without its caps, along its z axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// Edges of a box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 3]>,
    /// Origin of its frame in that of the body.
    pub r: [f64; 3],
    /// Euler parameters of its frame in that of the body, scalar first.
    pub p: [f64; 4],
    /// `#rrggbb`.
    pub color: Option<String>,
    /// Of a mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<Mesh>,
}

/// An element.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownElement {
    /// Its name.
    pub name: String,
    /// Its type, without the library.
    #[serde(rename = "type")]
    pub type_name: String,
    /// `joint`, `force` or `control`.
    pub kind: String,
    /// How it is drawn: `hinge`, `spring`, ...; `none`.
    pub glyph: String,
    /// Its frames.
    pub frames: Vec<ShownFrame>,
}

/// A frame of an element.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownFrame {
    /// Number of the body; -1 for the ground, of which fixed bodies are a part.
    pub body: i64,
    /// Origin in the frame of the body.
    pub r: [f64; 3],
    /// Euler parameters in the frame of the body, scalar first.
    pub p: [f64; 4],
}

/// A load of each record: on the body of a frame of an element.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownLoad {
    /// Which of the elements.
    pub element: usize,
    /// Which of its frames.
    pub frame: usize,
    /// `reaction` of a joint, or `force` of a force element.
    pub kind: String,
    /// Whether there is only one such load; of redundant joints one is named for many.
    pub unique: bool,
}

impl MotionHeader {
    /// Number of bodies with poses.
    #[must_use]
    pub fn moving(&self) -> usize {
        self.bodies.iter().filter(|body| !body.fixed).count()
    }

    /// Bytes of a record.
    fn record_size(&self) -> usize {
        8 + 4 * (POSE * self.moving() + LOAD * self.loads.len())
    }

    /// The line that the file begins with.
    fn line(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut line = serde_json::to_vec(self)?;
        line.resize((line.len() + 1).next_multiple_of(8) - 1, b' ');
        line.push(b'\n');
        Ok(line)
    }

    /// What is wrong with it, if it was written by somebody else.
    fn fault(&self) -> Option<&'static str> {
        let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        let positive = |number: f64| number > 0.0 && number.is_finite();
        let is_shape = |shape: &Shape| {
            let measured = match shape.kind.as_str() {
                "box" => shape.size.is_some_and(|size| size.into_iter().all(positive)),
                "cylinder" | "capsule" => shape.radius.is_some_and(positive) && shape.length.is_some_and(positive),
                "sphere" => shape.radius.is_some_and(positive),
                "mesh" => shape.mesh.as_ref().is_some_and(Mesh::is_sound),
                _ => true,
            };
            measured && finite(&shape.r) && finite(&shape.p)
        };
        let bodies = i64::try_from(self.bodies.len()).unwrap_or(i64::MAX);
        let is_frame = |frame: &ShownFrame| (-1..bodies).contains(&frame.body) && finite(&frame.r) && finite(&frame.p);
        let is_load =
            |load: &ShownLoad| self.elements.get(load.element).is_some_and(|element| load.frame < element.frames.len());
        if self.format != MOTION_FORMAT {
            return Some("it has another format");
        }
        if !self.bodies.iter().flat_map(|body| &body.shapes).all(is_shape) {
            return Some("a shape lacks its measures");
        }
        if !self.elements.iter().flat_map(|element| &element.frames).all(is_frame) {
            return Some("a frame is on no body");
        }
        (!self.loads.iter().all(is_load)).then_some("a load acts at no frame")
    }
}
