//! `motion.bin` and meshes, written and read back.

use super::super::{
    MOTION_FILE, MOTION_FORMAT, Mesh, Motion, MotionHeader, MotionWriter, Shape, ShownBody, ShownElement, ShownFrame,
    ShownLoad,
};
use super::*;

fn shape(kind: &str) -> Shape {
    Shape {
        kind: kind.into(),
        radius: Some(0.1),
        length: Some(0.4),
        size: Some([0.1, 0.2, 0.3]),
        r: [0.0; 3],
        p: [1.0, 0.0, 0.0, 0.0],
        color: None,
        mesh: None,
    }
}

/// A bench that is fixed, a body with shapes, one without.
pub(super) fn header() -> MotionHeader {
    let body = |name: &str, fixed: bool, kinds: &[&str]| ShownBody {
        name: name.into(),
        fixed,
        centre: [0.0; 3],
        shapes: kinds.iter().map(|kind| shape(kind)).collect(),
    };
    let frame = |body: i64| ShownFrame { body, r: [0.0, 0.0, 0.5], p: [1.0, 0.0, 0.0, 0.0] };
    MotionHeader {
        format: MOTION_FORMAT.into(),
        title: "a motion".into(),
        time_unit: "ms".into(),
        length: 1.0,
        bodies: vec![body("bench", true, &["box"]), body("a", false, &["cylinder", "sphere"]), body("b", false, &[])],
        elements: vec![ShownElement {
            name: "pin".into(),
            type_name: "some".into(),
            kind: "joint".into(),
            glyph: "hinge".into(),
            frames: vec![frame(1), frame(2)],
        }],
        loads: vec![ShownLoad { element: 0, frame: 1, kind: "reaction".into(), unique: true }],
        gravity: [0.0, 0.0, -9.81],
    }
}

/// Values of a record: positions x, the second body turned about z by an angle.
pub(super) fn values(x: f64, angle: f64) -> Vec<f64> {
    let (sine, cosine) = (0.5 * angle).sin_cos();
    let a = [x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let b = [-x, 0.0, 0.0, cosine, 0.0, 0.0, sine];
    let load = [1.0, 2.0, 3.0, 4.0, 5.0, f64::INFINITY];
    [a.as_slice(), &b, &load].concat()
}

#[test]
fn a_motion_reads_back_as_it_was_written() {
    let folder = Scratch::new("motion-back");
    let path = folder.join(MOTION_FILE);
    let mut writer = MotionWriter::create(&path, &header()).unwrap();
    writer.record(0.5, &values(1.0, 0.0)).unwrap();
    writer.record(1.5, &values(2.0, 1.0)).unwrap();
    drop(writer);
    let bytes = std::fs::read(&path).unwrap();
    let first = bytes.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    assert_eq!((first % 8, bytes.len() - first), (0, 2 * (8 + 28 * 2 + 24)));
    let motion = Motion::read(&path).unwrap();
    assert_eq!((&motion.header, motion.times.as_slice()), (&header(), [0.5, 1.5].as_slice()));
    assert_eq!(motion.pose(1, 0).unwrap(), [2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(motion.pose(1, 1).unwrap()[6], 0.5_f64.sin() as f32);
    let load = motion.load(1, 0).unwrap();
    assert!(load[..5] == [1.0, 2.0, 3.0, 4.0, 5.0] && load[5].is_nan(), "{load:?}");
    assert!(motion.pose(1, 2).is_none() && motion.pose(2, 0).is_none() && motion.load(0, 1).is_none());
}

#[test]
fn euler_parameters_go_on_from_record_to_record() {
    let folder = Scratch::new("motion-signs");
    let path = folder.join(MOTION_FILE);
    let mut writer = MotionWriter::create(&path, &header()).unwrap();
    for k in 0..40 {
        // Of the two sets of a rotation now one, now the other.
        let mut values = values(0.0, f64::from(k) * 0.4);
        if k % 3 == 0 {
            values[10..14].iter_mut().for_each(|e| *e = -*e);
        }
        writer.record(f64::from(k), &values).unwrap();
    }
    drop(writer);
    let motion = Motion::read(&path).unwrap();
    for k in 1..40 {
        let [was, is] = [k - 1, k].map(|sample| motion.pose(sample, 1).unwrap());
        assert!((3..7).map(|k| was[k] * is[k]).sum::<f32>() > 0.9, "{k}");
    }
}

#[test]
fn a_motion_goes_on_where_it_was_kept() {
    let folder = Scratch::new("motion-kept");
    let write = |writer: &mut MotionWriter, from: i32, to: i32| {
        (from..to).for_each(|k| writer.record(f64::from(k), &values(0.0, f64::from(k))).unwrap());
    };
    let [whole, broken] = ["whole.bin", "broken.bin"].map(|name| folder.join(name));
    write(&mut MotionWriter::create(&whole, &header()).unwrap(), 0, 12);
    let mut writer = MotionWriter::create(&broken, &header()).unwrap();
    write(&mut writer, 0, 7);
    let kept = writer.sync().unwrap();
    assert_eq!(kept.rows, 7);
    write(&mut writer, 7, 9);
    drop(writer);
    // The run is killed in the middle of a record.
    let mut bytes = std::fs::read(&broken).unwrap();
    bytes.truncate(bytes.len() - 5);
    std::fs::write(&broken, &bytes).unwrap();
    assert_eq!(Motion::read(&broken).unwrap().times.len(), 8);
    write(&mut MotionWriter::go_on(&broken, &header(), &kept).unwrap(), 7, 12);
    assert_eq!(std::fs::read(&whole).unwrap(), std::fs::read(&broken).unwrap());
    bytes[10] ^= 1;
    std::fs::write(&broken, &bytes).unwrap();
    let error = MotionWriter::go_on(&broken, &header(), &kept).unwrap_err();
    assert!(error.to_string().contains("damaged"), "{error}");
    std::fs::write(&broken, &bytes[..20]).unwrap();
    let error = MotionWriter::go_on(&broken, &header(), &kept).unwrap_err();
    assert!(error.to_string().contains("shorter"), "{error}");
}

#[test]
fn bad_bytes_are_refused_with_a_reason() {
    let folder = Scratch::new("motion-bad");
    let path = folder.join(MOTION_FILE);
    let mut writer = MotionWriter::create(&path, &header()).unwrap();
    writer.record(0.0, &values(0.0, 0.0)).unwrap();
    drop(writer);
    let bytes = std::fs::read(&path).unwrap();
    // Cut anywhere, and with any byte changed: read or refused, never a panic.
    for length in 0..bytes.len() {
        let _ = Motion::from_bytes(&bytes[..length]);
    }
    for at in 0..bytes.len() {
        for mask in [1, 16, 128] {
            let mut changed = bytes.clone();
            changed[at] ^= mask;
            let _ = Motion::from_bytes(&changed);
        }
    }
    let with = |change: &dyn Fn(&mut MotionHeader)| {
        let mut header = header();
        change(&mut header);
        MotionWriter::create(&path, &header).map(drop).unwrap();
        Motion::read(&path).unwrap_err().to_string()
    };
    assert!(with(&|header| header.format = "odyn-motion/9".into()).contains("another format"));
    assert!(with(&|header| header.bodies[1].shapes[0].radius = None).contains("lacks its measures"));
    assert!(with(&|header| header.bodies[0].shapes[0].kind = "mesh".into()).contains("lacks its measures"));
    assert!(with(&|header| header.elements[0].frames[0].body = 3).contains("on no body"));
    assert!(with(&|header| header.loads[0].frame = 2).contains("at no frame"));
    assert!(Motion::from_bytes(b"").unwrap_err().contains("does not end"));
    assert!(Motion::read(&path.with_file_name("missing")).unwrap_err().to_string().contains("cannot read"));
}

const TETRAHEDRON: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

#[test]
fn meshes_are_read_from_stl_and_obj() {
    let folder = Scratch::new("motion-meshes");
    let mut binary = b"solid by a program that begins so".to_vec();
    binary.resize(80, b' ');
    binary.extend(4_u32.to_le_bytes());
    let mut text = "solid tetrahedron\n".to_string();
    for face in FACES {
        binary.extend([0; 12]);
        text += "facet normal 0 0 0\nouter loop\n";
        for corner in face.map(|k| TETRAHEDRON[k]) {
            binary.extend(corner.iter().flat_map(|x| x.to_le_bytes()));
            text += &format!("vertex {} {} {}\n", corner[0], corner[1], corner[2]);
        }
        binary.extend([0; 2]);
        text += "endloop\nendfacet\n";
    }
    text += "endsolid tetrahedron\n";
    // With a quadrilateral face, materials and normals, which have no part in it.
    let obj = "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nusemtl red\nf 1//1 2//1 3//1 4//1\n";
    for (name, bytes) in [("a.STL", binary.as_slice()), ("b.stl", text.as_bytes()), ("c.obj", obj.as_bytes())] {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        let mesh = Mesh::read(&path, 0.001).unwrap();
        let (triangles, corners) = if name == "c.obj" { (2, 4) } else { (4, 4) };
        assert_eq!((mesh.triangles.len(), mesh.vertices.len()), (3 * triangles, 3 * corners), "{name}");
        assert_eq!(mesh.vertices.iter().copied().fold(0.0, f32::max), 0.001, "{name}");
        for length in 0..bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let _ = Mesh::read(&path, 1.0);
        }
    }
}

#[test]
fn a_text_has_any_number_of_solids() {
    let solid = |x: f32| {
        format!(
            "solid part at {x}\nfacet normal 0 0 1\nouter loop\nvertex {x} 0 0\nvertex {x} 1 0\nvertex {x} 0 1E0\nendloop\nendfacet\nendsolid\n"
        )
    };
    let folder = Scratch::new("motion-solids");
    let path = folder.join("a.stl");
    let read = |text: String| {
        std::fs::write(&path, text).unwrap();
        Mesh::read(&path, 1.0)
    };
    let mesh = read(solid(0.0) + "\n" + &solid(5.0).to_uppercase() + &solid(7.0)).unwrap();
    assert_eq!(mesh.triangles, (0..9).collect::<Vec<u32>>());
    let along_x: Vec<f32> = mesh.vertices.iter().copied().step_by(3).collect();
    assert_eq!(along_x, [0.0, 0.0, 0.0, 5.0, 5.0, 5.0, 7.0, 7.0, 7.0]);
    let half = solid(5.0);
    assert!(read(solid(0.0) + &half[..half.len() / 2]).unwrap_err().contains("no STL file"));
}

#[test]
fn what_is_no_mesh_is_refused_with_a_reason() {
    let folder = Scratch::new("motion-no-mesh");
    let refused = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        Mesh::read(&folder.join(name), 1.0).unwrap_err()
    };
    assert!(refused("a.step", b"").contains("neither with .stl nor with .obj"));
    assert!(refused("a.stl", b"solid nothing\nendsolid nothing\n").contains("no triangles"));
    assert!(refused("b.stl", b"not at all").contains("no STL file"));
    assert!(refused("a.obj", b"v 0 0 0\nf 1 2 3\n").contains("OBJ"));
    let mut endless = vec![0; 80];
    endless.extend(u32::MAX.to_le_bytes());
    assert!(refused("c.stl", &endless).contains("no STL file"));
    let mut no_number = vec![0; 80];
    no_number.extend(1_u32.to_le_bytes());
    no_number.extend(std::iter::repeat_n(f32::NAN.to_le_bytes(), 12).flatten().chain([0, 0]));
    assert!(refused("d.stl", &no_number).contains("finite"));
}
