//! [`glb`]: a motion as glTF 2.0 in one binary file, which other programs show.
//!
//! Every body is a node that moves; its shapes are nodes below it. A body without shapes has lines from its origin to the
//! frames of its elements. The root turns what is above into the y axis, as glTF wants it.

mod geometry;

use serde_json::{Value, json};

use super::motion::{Motion, POSE, Shape, ShownBody};
use geometry::Surface;

/// Numbers of glTF for what they name.
const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;
/// Of buffer views with corners, and with their numbers.
const CORNERS: u32 = 34962;
const NUMBERS: u32 = 34963;

/// Colours of bodies that name none, one after the other.
const COLORS: [&str; 8] = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#b07aa1", "#76b7b2", "#edc948", "#9c755f"];
/// Half the size of the cross at the origin of a body without shapes, as a share of the scene.
const CROSS: f64 = 0.03;

/// A document under construction.
#[derive(Default)]
struct Document {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    /// Their colours.
    colors: Vec<String>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

/// A motion as the bytes of a GLB file. `second` is one unit of its times, in s of the animation.
///
/// # Errors
/// A motion whose file would be longer than the format allows (4 GB).
pub fn glb(motion: &Motion, second: f64) -> Result<Vec<u8>, String> {
    let header = &motion.header;
    let mut document = Document::default();
    let (mut below, mut moving) = (Vec::new(), Vec::new());
    // The root comes first, as all others are below it.
    document.nodes.push(Value::Null);
    for (number, body) in header.bodies.iter().enumerate() {
        let children = document.shapes_of(motion, number, body);
        let mut node = json!({ "name": body.name });
        if !children.is_empty() {
            node["children"] = children.into();
        }
        if !body.fixed {
            moving.push(document.nodes.len());
            if let Some(pose) = motion.pose(0, moving.len() - 1).filter(|pose| pose.iter().all(|x| x.is_finite())) {
                let [r, p] = parts(&pose);
                (node["translation"], node["rotation"]) = (json!(r), json!(p));
            }
        }
        below.push(document.nodes.len());
        document.nodes.push(node);
    }
    let title = if header.title.is_empty() { "motion" } else { header.title.as_str() };
    document.nodes[0] = json!({ "name": title, "rotation": upright(&header.gravity) });
    if !below.is_empty() {
        document.nodes[0]["children"] = below.into();
    }
    let animation = document.animation(motion, &moving, second);
    document.finish(animation)
}

/// Position, and rotation as glTF has it: scalar last, of length 1.
fn parts(pose: &[f32; POSE]) -> [Vec<f32>; 2] {
    let turn: [f64; 4] = std::array::from_fn(|k| f64::from(pose[3 + k]));
    let length = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [w, x, y, z] = if length > 0.0 { turn.map(|e| (e / length) as f32) } else { [1.0, 0.0, 0.0, 0.0] };
    [pose[..3].to_vec(), vec![x, y, z, w]]
}

/// The rotation that brings what is above into the y axis: against gravity, or along z where there is none.
fn upright(gravity: &[f64; 3]) -> [f64; 4] {
    let weight = gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    let [x, y, z] = if weight > 0.0 && weight.is_finite() { gravity.map(|g| -g / weight) } else { [0.0, 0.0, 1.0] };
    // Half way between both: q = (1 + u.y, u x y), made one of length 1.
    let (w, length) = (1.0 + y, (2.0 * (1.0 + y)).sqrt());
    if length < 1e-6 { [1.0, 0.0, 0.0, 0.0] } else { [-z / length, 0.0, x / length, w / length] }
}

impl Document {
    /// Nodes of what a body looks like.
    fn shapes_of(&mut self, motion: &Motion, number: usize, body: &ShownBody) -> Vec<usize> {
        let own = COLORS[number % COLORS.len()];
        let mut nodes = Vec::new();
        for shape in &body.shapes {
            if let Some(mesh) = self.surface(shape, shape.color.as_deref().unwrap_or(own)) {
                let [w, x, y, z] = shape.p;
                nodes.push(self.nodes.len());
                self.nodes.push(json!({ "mesh": mesh, "translation": shape.r, "rotation": [x, y, z, w] }));
            }
        }
        if body.shapes.is_empty() && !body.fixed {
            let mesh = self.skeleton(motion, number, own);
            nodes.push(self.nodes.len());
            self.nodes.push(json!({ "mesh": mesh }));
        }
        nodes
    }

    fn surface(&mut self, shape: &Shape, color: &str) -> Option<usize> {
        let Surface { corners, normals, triangles } = Surface::of(shape);
        if triangles.is_empty() {
            return None;
        }
        let mut attributes = json!({ "POSITION": self.vectors(&corners, Some(CORNERS), true) });
        if !normals.is_empty() {
            attributes["NORMAL"] = self.vectors(&normals, Some(CORNERS), false).into();
        }
        let indices = self.numbers(&triangles);
        let material = self.material(color);
        let primitive = json!({
            "attributes": attributes, "indices": indices, "material": material, "mode": TRIANGLES,
        });
        self.meshes.push(json!({ "primitives": [primitive] }));
        Some(self.meshes.len() - 1)
    }

    /// Lines from the origin of a body to the frames of its elements, and a cross.
    fn skeleton(&mut self, motion: &Motion, number: usize, color: &str) -> usize {
        let size = (CROSS * motion.header.length) as f32;
        let mut ends = Vec::new();
        for axis in 0..3 {
            for side in [-size, size] {
                let mut end = [0.0; 3];
                end[axis] = side;
                ends.push(end);
            }
        }
        let elements = motion.header.elements.iter().filter(|element| element.kind != "control");
        for frame in elements.flat_map(|element| &element.frames) {
            if usize::try_from(frame.body) == Ok(number) {
                ends.extend([[0.0; 3], frame.r.map(|x| x as f32)]);
            }
        }
        let attributes = json!({ "POSITION": self.vectors(&ends, Some(CORNERS), true) });
        let material = self.material(color);
        self.meshes.push(json!({
            "primitives": [{ "attributes": attributes, "material": material, "mode": LINES }],
        }));
        self.meshes.len() - 1
    }

    /// A material of a colour `#rrggbb`.
    fn material(&mut self, color: &str) -> usize {
        if let Some(known) = self.colors.iter().position(|known| known == color) {
            return known;
        }
        let part = |k: usize| color.get(k..k + 2).and_then(|digits| u8::from_str_radix(digits, 16).ok()).unwrap_or(128);
        // glTF wants linear light (IEC 61966-2-1).
        let linear = |k: usize| {
            let c = f64::from(part(k)) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        self.materials.push(json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [linear(1), linear(3), linear(5), 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.6,
            },
            "doubleSided": true,
        }));
        self.colors.push(color.into());
        self.colors.len() - 1
    }

    /// Tracks of position and rotation of the bodies at these nodes, if there is anything to see.
    fn animation(&mut self, motion: &Motion, nodes: &[usize], second: f64) -> Option<Value> {
        let first = *motion.times.first()?;
        let (mut times, mut samples): (Vec<f32>, Vec<usize>) = (Vec::new(), Vec::new());
        for (sample, time) in motion.times.iter().enumerate() {
            let poses = &motion.poses[sample * POSE * nodes.len()..][..POSE * nodes.len()];
            let time = ((time - first) * second) as f32;
            // Times ascend, also with the few digits that they have here.
            let is_next = time.is_finite() && times.last().is_none_or(|last| *last < time);
            if is_next && poses.iter().all(|number| number.is_finite()) {
                times.push(time);
                samples.push(sample);
            }
        }
        if samples.is_empty() || nodes.is_empty() {
            return None;
        }
        let input = self.scalars(&times);
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for (body, node) in nodes.iter().enumerate() {
            let poses: Vec<[Vec<f32>; 2]> =
                samples.iter().filter_map(|sample| motion.pose(*sample, body)).map(|pose| parts(&pose)).collect();
            let [r, p] = [0, 1].map(|k| poses.iter().flat_map(|pose| pose[k].iter().copied()).collect::<Vec<f32>>());
            for (path, output) in
                [("translation", self.floats(&r, "VEC3", 3, None)), ("rotation", self.floats(&p, "VEC4", 4, None))]
            {
                channels.push(json!({ "sampler": samplers.len(), "target": { "node": node, "path": path } }));
                samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
            }
        }
        Some(json!({ "name": "motion", "samplers": samplers, "channels": channels }))
    }

    /// An accessor of single numbers, with their range.
    fn scalars(&mut self, numbers: &[f32]) -> usize {
        let at = self.floats(numbers, "SCALAR", 1, None);
        let range = |pick: fn(f32, f32) -> f32| numbers.iter().copied().reduce(pick);
        (self.accessors[at]["min"], self.accessors[at]["max"]) = (json!([range(f32::min)]), json!([range(f32::max)]));
        at
    }

    /// An accessor of vectors, with their range if wanted.
    fn vectors(&mut self, vectors: &[[f32; 3]], target: Option<u32>, ranged: bool) -> usize {
        let at = self.floats(vectors.as_flattened(), "VEC3", 3, target);
        if ranged {
            let range = |pick: fn(f32, f32) -> f32| {
                [0, 1, 2].map(|k| vectors.iter().map(|vector| vector[k]).reduce(pick).unwrap_or(0.0))
            };
            (self.accessors[at]["min"], self.accessors[at]["max"]) = (json!(range(f32::min)), json!(range(f32::max)));
        }
        at
    }

    fn floats(&mut self, numbers: &[f32], kind: &str, size: usize, target: Option<u32>) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(&bytes, json!({ "componentType": FLOAT, "count": numbers.len() / size, "type": kind }), target)
    }

    fn numbers(&mut self, numbers: &[u32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let accessor = json!({ "componentType": UNSIGNED, "count": numbers.len(), "type": "SCALAR" });
        self.accessor(&bytes, accessor, Some(NUMBERS))
    }

    /// Everything is of 4 bytes, so that all is where it has to be.
    fn accessor(&mut self, bytes: &[u8], mut accessor: Value, target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        accessor["bufferView"] = self.views.len().into();
        self.views.push(view);
        self.bytes.extend_from_slice(bytes);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// The file: a head, the JSON, the bytes.
    fn finish(self, animation: Option<Value>) -> Result<Vec<u8>, String> {
        let mut root = json!({
            "asset": { "version": "2.0", "generator": format!("odyn {}", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": self.nodes,
        });
        // No list of the format may be empty.
        let lists = [
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
            ("animations", animation.into_iter().collect()),
        ];
        for (key, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root[key] = list.into();
        }
        if !self.bytes.is_empty() {
            root["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let size = 12 + 8 + text.len() + if self.bytes.is_empty() { 0 } else { 8 + self.bytes.len() };
        let long = |length: usize| {
            u32::try_from(length).map(u32::to_le_bytes).map_err(|_| "a GLB file cannot be longer than 4 GB".to_string())
        };
        let mut file = Vec::with_capacity(size);
        file.extend_from_slice(b"glTF");
        file.extend_from_slice(&2_u32.to_le_bytes());
        file.extend_from_slice(&long(size)?);
        for (kind, bytes) in
            [(b"JSON", &text), (b"BIN\0", &self.bytes)].into_iter().filter(|(_, bytes)| !bytes.is_empty())
        {
            file.extend_from_slice(&long(bytes.len())?);
            file.extend_from_slice(kind);
            file.extend_from_slice(bytes);
        }
        Ok(file)
    }
}
