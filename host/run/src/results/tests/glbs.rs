//! A motion as glTF, read back by a reader of others.

use super::super::{Mesh, Motion, glb};
use super::motions::{header, values};
use serde_json::Value;

fn motion(samples: u32) -> Motion {
    let mut header = header();
    header.bodies[0].shapes[0].color = Some("#ff0000".into());
    header.bodies[1].shapes[1].kind = "mesh".into();
    header.bodies[1].shapes[1].mesh =
        Some(Mesh { vertices: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], triangles: vec![0, 1, 2] });
    let mut motion = Motion { header, times: Vec::new(), poses: Vec::new(), loads: Vec::new() };
    for k in 0..samples {
        let values = values(f64::from(k), 0.1 * f64::from(k));
        motion.times.push(2.0 + f64::from(k));
        motion.poses.extend(values[..14].iter().map(|x| *x as f32));
        motion.loads.extend(values[14..].iter().map(|x| *x as f32));
    }
    motion
}

/// The parts of a file: the JSON and the bytes.
fn chunks(file: &[u8]) -> (Value, &[u8]) {
    let number = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&file[..4], number(4), number(8)), (b"glTF".as_slice(), 2, file.len()));
    let text = number(12);
    assert_eq!((&file[16..20], text % 4), (b"JSON".as_slice(), 0));
    let bytes = number(20 + text);
    assert_eq!((&file[24 + text..28 + text], bytes % 4), (b"BIN\0".as_slice(), 0));
    assert_eq!(28 + text + bytes, file.len());
    (serde_json::from_slice(&file[20..20 + text]).unwrap(), &file[28 + text..])
}

#[test]
fn what_is_in_the_file_lies_where_it_says() {
    let file = glb(&motion(5), 0.001).unwrap();
    let (root, bytes) = chunks(&file);
    assert_eq!(root["buffers"][0]["byteLength"], bytes.len());
    let mut covered = 0;
    for accessor in root["accessors"].as_array().unwrap() {
        let view = &root["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let size = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => panic!("{other}"),
        };
        let length = 4 * size * accessor["count"].as_u64().unwrap() as usize;
        let (from, given) =
            (view["byteOffset"].as_u64().unwrap() as usize, view["byteLength"].as_u64().unwrap() as usize);
        assert_eq!((from % 4, given), (0, length), "{accessor}");
        assert!(from + length <= bytes.len(), "{accessor}");
        covered += length;
        let Some(least) = accessor["min"].as_array() else { continue };
        for (k, least) in least.iter().enumerate() {
            let numbers = bytes[from..from + length].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()));
            let own: Vec<f64> = numbers.skip(k).step_by(size).map(f64::from).collect();
            let range = [own.iter().copied().fold(f64::MAX, f64::min), own.iter().copied().fold(f64::MIN, f64::max)];
            let told = [least, &accessor["max"][k]].map(|number| number.as_f64().unwrap() as f32);
            assert_eq!(range.map(|number| number as f32), told, "{accessor}");
        }
    }
    assert_eq!(covered, bytes.len());
    let nodes = root["nodes"].as_array().unwrap().len();
    let mut below = vec![0; nodes];
    for node in root["nodes"].as_array().unwrap() {
        node["children"].as_array().into_iter().flatten().for_each(|k| below[k.as_u64().unwrap() as usize] += 1);
    }
    assert_eq!((below[0], below[1..].iter().all(|count| *count == 1)), (0, true), "{below:?}");
}

#[test]
fn another_reader_finds_the_bodies_and_their_motion() {
    let file = glb(&motion(5), 0.001).unwrap();
    let found = gltf::Gltf::from_slice(&file).unwrap();
    let blob = found.blob.clone().unwrap();
    let bytes = |_: gltf::Buffer<'_>| Some(blob.as_slice());
    let root = found.default_scene().unwrap().nodes().next().unwrap();
    let bodies: Vec<gltf::Node<'_>> = root.children().collect();
    let names: Vec<&str> = bodies.iter().filter_map(gltf::Node::name).collect();
    assert_eq!(names, ["bench", "a", "b"]);
    assert_eq!(bodies.iter().map(|body| body.children().count()).collect::<Vec<_>>(), [1, 2, 1]);
    // z is above here, y there.
    let gltf::scene::Transform::Decomposed { rotation: [x, y, z, w], .. } = root.transform() else { panic!() };
    let half = 0.5_f32.sqrt();
    assert!([x + half, y, z, w - half].iter().all(|e| e.abs() < 1e-6), "{x} {y} {z} {w}");
    let red = found.materials().next().unwrap().pbr_metallic_roughness().base_color_factor();
    assert_eq!(red, [1.0, 0.0, 0.0, 1.0]);
    let animation = found.animations().next().unwrap();
    assert_eq!(animation.channels().count(), 4);
    for channel in animation.channels() {
        let reader = channel.reader(bytes);
        let times: Vec<f32> = reader.read_inputs().unwrap().collect();
        assert_eq!(times, [0.0, 0.001, 0.002, 0.003, 0.004]);
        match (channel.target().node().name().unwrap(), reader.read_outputs().unwrap()) {
            ("a", gltf::animation::util::ReadOutputs::Translations(track)) => {
                assert_eq!(track.map(|r| r[0]).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0]);
            }
            ("b", gltf::animation::util::ReadOutputs::Rotations(track)) => {
                let last = track.into_f32().last().unwrap();
                assert!((last[2] - 0.2_f32.sin()).abs() < 1e-6 && (last[3] - 0.2_f32.cos()).abs() < 1e-6, "{last:?}");
            }
            _ => {}
        }
    }
    let skeleton = bodies[2].children().next().unwrap().mesh().unwrap().primitives().next().unwrap();
    assert_eq!(skeleton.mode(), gltf::mesh::Mode::Lines);
    let ends: Vec<[f32; 3]> = skeleton.reader(bytes).read_positions().unwrap().collect();
    assert_eq!(ends[ends.len() - 1], [0.0, 0.0, 0.5]);
}

/// Volume inside of triangles (Gauss), and whether their normals point outwards.
fn volume(primitive: &gltf::Primitive<'_>, blob: &[u8]) -> f64 {
    let reader = primitive.reader(|_| Some(blob));
    let at: Vec<[f64; 3]> = reader.read_positions().unwrap().map(|p| p.map(f64::from)).collect();
    let normals: Vec<[f64; 3]> = reader.read_normals().unwrap().map(|n| n.map(f64::from)).collect();
    let numbers: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|k| k as usize).collect();
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let less = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let mut sum = 0.0;
    for corner in numbers.chunks_exact(3) {
        let [a, b, c] = [at[corner[0]], at[corner[1]], at[corner[2]]];
        let area = cross(less(b, a), less(c, a));
        assert!(dot(area, area) > 0.0, "no triangle without area");
        for k in corner {
            assert!((dot(normals[*k], normals[*k]) - 1.0).abs() < 1e-6 && dot(area, normals[*k]) > 0.0);
        }
        sum += dot(a, cross(b, c)) / 6.0;
    }
    sum
}

#[test]
fn shapes_are_closed_and_face_outwards() {
    use std::f64::consts::PI;
    let (ball, tube) = (4.0 / 3.0 * PI * 0.001, PI * 0.01 * 0.4);
    // Radius 0.1, length 0.4: what is round is of 32 sides.
    for (kind, whole) in [("box", 0.006), ("cylinder", tube), ("sphere", ball), ("capsule", ball + tube)] {
        let mut motion = motion(1);
        motion.header.bodies[1].shapes.truncate(1);
        motion.header.bodies[1].shapes[0].kind = kind.into();
        let file = glb(&motion, 1.0).unwrap();
        let found = gltf::Gltf::from_slice(&file).unwrap();
        let primitive = found.meshes().nth(1).unwrap().primitives().next().unwrap();
        let share = volume(&primitive, found.blob.as_ref().unwrap()) / whole;
        assert!(
            if kind == "box" { (share - 1.0).abs() < 1e-6 } else { (0.97..1.0).contains(&share) },
            "{kind}: {share}"
        );
    }
}

#[test]
fn samples_that_are_no_motion_are_left_out() {
    let mut motion = motion(5);
    motion.poses[14] = f32::NAN;
    motion.times[3] = motion.times[2];
    let file = glb(&motion, 1.0).unwrap();
    let (root, _) = chunks(&file);
    let input = root["animations"][0]["samplers"][0]["input"].as_u64().unwrap() as usize;
    assert_eq!((&root["accessors"][input]["count"], &root["accessors"][input]["max"][0]), (&3.into(), &4.0.into()));
    let file = glb(&self::motion(0), 1.0).unwrap();
    let (root, _) = chunks(&file);
    assert!(root.get("animations").is_none());
}
