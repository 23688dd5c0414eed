//! [`Mesh`]: triangles of a file.

use std::io::Cursor;
use std::path::Path;

use serde::{Deserialize, Serialize};

/// Bytes of a file that are read.
const LONGEST: u64 = 256 << 20;
/// Bytes before the triangles of a binary STL file, and of each of them.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: u64 = 50;

/// Triangles with common corners.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// x, y, z of each corner, m.
    pub vertices: Vec<f32>,
    /// Numbers of the corners of each triangle, counter-clockwise from outside.
    pub triangles: Vec<u32>,
}

impl Mesh {
    /// Reads a file: STL (binary or text) or OBJ, as its name ends. `unit` is one of its numbers, m.
    ///
    /// # Errors
    /// In words: a file that cannot be read, of another kind, damaged, or without triangles.
    pub fn read(path: &Path, unit: f64) -> Result<Self, String> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let parse: fn(&[u8]) -> Result<Found, String> = match ending.as_str() {
            "stl" => stl,
            "obj" => obj,
            _ => return Err("its name ends neither with .stl nor with .obj".into()),
        };
        let length = path.metadata().map_err(|error| error.to_string())?.len();
        if length > LONGEST {
            return Err(format!("it is longer than {} MB", LONGEST >> 20));
        }
        let (numbers, triangles) = parse(&std::fs::read(path).map_err(|error| error.to_string())?)?;
        let vertices: Vec<f32> = numbers.iter().map(|number| (f64::from(*number) * unit) as f32).collect();
        let mesh = Self { vertices, triangles };
        if mesh.triangles.is_empty() {
            return Err("it has no triangles".into());
        }
        mesh.is_sound().then_some(mesh).ok_or_else(|| "it has corners that are no finite numbers, or missing".into())
    }

    /// Whether all numbers are finite and all corners are there.
    pub(super) fn is_sound(&self) -> bool {
        let corners = self.vertices.len() / 3;
        self.vertices.len().is_multiple_of(3)
            && self.triangles.len().is_multiple_of(3)
            && self.vertices.iter().all(|number| number.is_finite())
            && self.triangles.iter().all(|corner| (*corner as usize) < corners)
    }
}

/// Numbers of the corners, and which of them make up triangles.
type Found = (Vec<f32>, Vec<u32>);

fn stl(bytes: &[u8]) -> Result<Found, String> {
    let mut bytes = bytes.to_vec();
    let count = bytes.get(80..STL_HEAD).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    let is_binary = count.is_some_and(|count| bytes.len() as u64 == STL_HEAD as u64 + STL_TRIANGLE * u64::from(count));
    // Some programs begin binary files with the word that text files begin with.
    if is_binary && let Some(first) = bytes.first_mut() {
        *first = 0;
    }
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for solid in if is_binary { vec![bytes] } else { solids(&bytes) } {
        let mesh = stl_io::read_stl(&mut Cursor::new(solid)).map_err(|error| format!("it is no STL file: {error}"))?;
        let first = vertices.len() / 3;
        vertices.extend(mesh.vertices.iter().flat_map(|vertex| vertex.0));
        let corners = mesh.faces.iter().flat_map(|face| face.vertices).map(|corner| u32::try_from(first + corner));
        triangles.extend(corners.collect::<Result<Vec<_>, _>>().map_err(|_| "it has too many corners")?);
    }
    Ok((vertices, triangles))
}

/// The solids of a text, which may have several, with their words as the library reads them; the whole text where it has none.
fn solids(bytes: &[u8]) -> Vec<Vec<u8>> {
    let text = String::from_utf8_lossy(bytes).to_lowercase();
    let mut solids = vec![Vec::new()];
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let solid = solids.last_mut().expect("there is one at least");
        solid.extend_from_slice(line.as_bytes());
        solid.push(b'\n');
        if line.starts_with("endsolid") {
            solids.push(Vec::new());
        }
    }
    if solids.len() > 1 && solids.last().is_some_and(Vec::is_empty) {
        solids.pop();
    }
    solids
}

fn obj(bytes: &[u8]) -> Result<Found, String> {
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    // Materials have no part in it.
    let loaded = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, |_| Err(tobj::LoadError::OpenFileFailed));
    let (models, _) = loaded.map_err(|error| format!("it is no OBJ file: {error}"))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for model in models {
        let first = u32::try_from(vertices.len() / 3).map_err(|_| "it has too many corners")?;
        let corners =
            model.mesh.indices.iter().map(|corner| corner.checked_add(first).ok_or("it has too many corners"));
        triangles.extend(corners.collect::<Result<Vec<_>, _>>()?);
        vertices.extend(model.mesh.positions);
    }
    Ok((vertices, triangles))
}
