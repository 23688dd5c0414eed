//! `motion.bin`: where bodies are and what acts on them, beside a table that stays as it is.

use std::fs;
use std::path::PathBuf;

use super::checkpoints::machine;
use super::*;
use crate::results::{MOTION_FILE, Motion, RESULTS_FILE};

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("odyn-pictures-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        Self(folder)
    }

    fn table(&self) -> Vec<u8> {
        fs::read(self.0.join(RESULTS_FILE)).unwrap()
    }

    fn motion(&self) -> Motion {
        Motion::read(&self.0.join(MOTION_FILE)).unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn with_motion(text: &str) -> String {
    text.replacen("t_end = ", "motion = true\nt_end = ", 1)
}

/// Runs with and without a motion, which must leave no trace in the table nor in the work that is counted.
#[track_caller]
fn both(name: &str, text: &str) -> (RunReport, Motion) {
    let (plain, shown) = (Scratch::new(&format!("{name}-plain")), Scratch::new(&format!("{name}-shown")));
    let without = go_on(text, &plain.0, 2.0);
    let with = go_on(&with_motion(text), &shown.0, 2.0);
    assert!(plain.table() == shown.table(), "{name}: the table is not what it was");
    assert!(!plain.0.join(MOTION_FILE).exists());
    let work = |report: &RunReport| {
        let summary = &report.summary;
        (summary.steps, summary.evaluations, summary.factorisations, summary.status)
    };
    assert_eq!(work(&without), work(&with), "{name}");
    let motion = shown.motion();
    assert_eq!(motion.times, with.times);
    (with, motion)
}

/// One component of a pose or load over all samples.
fn track(motion: &Motion, of: impl Fn(&Motion, usize) -> f32) -> Vec<f64> {
    (0..motion.times.len()).map(|sample| f64::from(of(motion, sample))).collect()
}

/// Largest difference of two lists, as a share of the largest of the second.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let size = b.iter().fold(1e-9_f64, |most, x| most.max(x.abs()));
    a.iter().zip(b).fold(0.0, |most, (a, b)| if (a - b).abs() / size <= most { most } else { (a - b).abs() / size })
}

#[test]
fn poses_and_loads_are_those_of_the_outputs() {
    for keys in ["formulation = \"joint\"", "formulation = \"cartesian\"", "engine = \"reference\"; tolerance = 1e-6"] {
        let text = machine(keys)
            + &output("x", "quantity = \"position\"; of = \"arm\"; component = \"x\"")
            + &output("y", "quantity = \"position\"; of = \"arm\"; component = \"y\"")
            + &output("e0", "quantity = \"orientation\"; of = \"arm\"; component = \"e0\"")
            + &output("e3", "quantity = \"orientation\"; of = \"arm\"; component = \"e3\"")
            + &output("Fx", "quantity = \"reaction_force\"; of = \"elbow\"; on = \"wheel\"; component = \"x\"")
            + &output("Tx", "quantity = \"reaction_torque\"; of = \"elbow\"; on = \"arm\"; component = \"x\"")
            + &output("Sy", "quantity = \"force\"; of = \"strut\"; on = \"arm\"; component = \"y\"");
        let (report, motion) = both("outputs", &text);
        let load = |element: &str, frame: usize| {
            let element = motion.header.elements.iter().position(|own| own.name == element).unwrap();
            motion.header.loads.iter().position(|load| (load.element, load.frame) == (element, frame)).unwrap()
        };
        for (k, name) in [(0, "x"), (1, "y")] {
            assert!(
                apart(&track(&motion, |m, s| m.pose(s, 1).unwrap()[k]), column(&report, name)) < 1e-6,
                "{keys} {name}"
            );
        }
        // Of either sign.
        let (e0, e3) = (column(&report, "e0"), column(&report, "e3"));
        for (sample, (e0, e3)) in e0.iter().zip(e3).enumerate() {
            let pose = motion.pose(sample, 1).unwrap().map(f64::from);
            assert!((pose[3] * e0 + pose[6] * e3).abs() > 1.0 - 1e-6, "{keys} {pose:?} {e0} {e3}");
        }
        let [elbow_on_wheel, elbow_on_arm, strut] = [load("elbow", 0), load("elbow", 1), load("strut", 1)];
        for (load, k, name) in [(elbow_on_wheel, 0, "Fx"), (elbow_on_arm, 3, "Tx"), (strut, 1, "Sy")] {
            let off = apart(&track(&motion, |m, s| m.load(s, load).unwrap()[k]), column(&report, name));
            assert!(off < 1e-6 || column(&report, name).iter().all(|x| x.abs() < 1e-9), "{keys} {name} {off:e}");
        }
        let kinds: Vec<&str> = motion.header.loads.iter().map(|load| load.kind.as_str()).collect();
        assert_eq!(kinds, ["reaction", "reaction", "reaction", "force", "force", "force"]);
    }
}

#[test]
fn frames_that_elements_join_stay_together() {
    // The frames of a hinge, put where the poses say that the bodies are: this holds bodies with a centre of mass elsewhere, too.
    let text = scenes::four_bar(1.1).replacen("mass = ", "com = [0.03, 0.02, 0]\nmass = ", 2);
    let (_, motion) = both("frames", &text);
    let movable: Vec<usize> =
        (0..motion.header.bodies.len()).filter(|body| !motion.header.bodies[*body].fixed).collect();
    let mut seen = 0;
    for sample in 0..motion.times.len() {
        for element in &motion.header.elements {
            let places: Vec<[f64; 3]> = element
                .frames
                .iter()
                .map(|frame| {
                    let Ok(body) = usize::try_from(frame.body) else { return frame.r };
                    let body = movable.iter().position(|own| *own == body).unwrap();
                    let pose = motion.pose(sample, body).unwrap().map(f64::from);
                    let turn = crate::model::rotation(&[pose[3], pose[4], pose[5], pose[6]]);
                    let place =
                        nalgebra::Vector3::new(pose[0], pose[1], pose[2]) + turn * nalgebra::Vector3::from(frame.r);
                    place.into()
                })
                .collect();
            assert_eq!(element.glyph, "hinge");
            let off = (0..3).map(|k| (places[0][k] - places[1][k]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{}: {places:?}", element.name);
            seen += 1;
        }
    }
    assert!(seen > 40, "{seen}");
    // Four hinges about parallel axes: what acts across the plane is one of many.
    assert!(motion.header.loads.iter().any(|load| !load.unique));
}

#[test]
fn a_run_that_is_resumed_has_the_motion_of_one_that_was_left_alone() {
    for keys in ["formulation = \"joint\"", "formulation = \"cartesian\"", "method = \"radau5\"; tolerance = 1e-8"] {
        let (alone, often) = (Scratch::new("alone"), Scratch::new("often"));
        let text = with_motion(&machine(keys));
        go_on(&text, &alone.0, 2.0);
        for until in [0.01, 0.3, 0.6, 0.95] {
            go_on(&text, &often.0, until);
            // Killed while a record was written.
            let path = often.0.join(MOTION_FILE);
            let mut bytes = fs::read(&path).unwrap();
            bytes.extend([1, 2, 3]);
            fs::write(&path, &bytes).unwrap();
            assert!(Motion::read(&path).unwrap().times.len() < alone.motion().times.len());
        }
        go_on(&text, &often.0, 2.0);
        let [one, other] = [&alone, &often].map(|folder| fs::read(folder.0.join(MOTION_FILE)).unwrap());
        assert!(one == other, "{keys}");
        assert_eq!(alone.motion().times.len(), 31);
        assert!(alone.table() == often.table(), "{keys}");
    }
}

#[test]
fn a_motion_that_was_damaged_is_not_gone_on_with() {
    let folder = Scratch::new("damaged");
    let text = with_motion(&machine(""));
    go_on(&text, &folder.0, 0.6);
    let path = folder.0.join(MOTION_FILE);
    let mut bytes = fs::read(&path).unwrap();
    bytes[3] ^= 1;
    fs::write(&path, &bytes).unwrap();
    let mut session = open(&text);
    session.resume(Checkpoint::read(&folder.0).unwrap()).unwrap();
    let error = session.run(Some(&folder.0), Box::new(|_| ()), &Arc::default()).err().unwrap().to_string();
    assert!(error.contains(MOTION_FILE) && error.contains("damaged"), "{error}");
}

#[test]
fn islands_apart_are_put_together_again() {
    let body = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x}, 0, 0]\n\
             [[joint]]\nname = \"pivot_{name}\"\ntype = \"hinge\"\nbodies = [\"ground\", \"{name}\"]\npoint = [{}, 0, 0]\n\
             axis = [0, 0, 1]\n",
            x - 1.0
        )
    };
    // Bodies of the two islands in turn; the joints of each come in their order.
    let text = settings("gravity = [0, -9.81, 0]; t_end = 1; output_step = 0.05")
        + &body("a", 0.0)
        + "[[body]]\nname = \"bench\"\nfixed = true\n[[body.shape]]\nkind = \"box\"\nsize = [1, 1, 1]\npoint = [0, 0, 3]\n"
        + &body("b", 5.0)
        + "[[body]]\nname = \"c\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nposition = [2, 0, 0]\n\
           [[joint]]\nname = \"elbow\"\ntype = \"hinge\"\nbodies = [\"a\", \"c\"]\npoint = [1, 0, 0]\naxis = [0, 0, 1]\n"
        + &output("x", "quantity = \"position\"; of = \"b\"; component = \"x\"");
    let (_, together) = both("together", &text);
    let (report, parted) = both("apart", &text.replacen("t_end = ", "islands = \"apart\"\nt_end = ", 1));
    assert_eq!(report.summary.islands.len(), 2);
    assert_eq!((&together.header, together.times.len()), (&parted.header, 21));
    let off = |a: &[f32], b: &[f32]| a.iter().zip(b).fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
    let largest = together.loads.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
    assert!(off(&together.poses, &parted.poses) < 1e-5 && largest > 10.0);
    assert!(off(&together.loads, &parted.loads) < 1e-5 * largest);
    let names: Vec<&str> = parted.header.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["a", "bench", "b", "c"]);
    // A fixed body is part of the ground, and has its shapes there.
    let bench = &parted.header.bodies[1];
    assert!(bench.fixed && bench.shapes[0].r == [0.0, 0.0, 3.0]);
    assert_eq!(parted.poses.len(), 21 * 3 * 7);
    let elbow = parted.header.elements.iter().find(|element| element.name == "elbow").unwrap();
    assert_eq!(elbow.frames.iter().map(|frame| frame.body).collect::<Vec<_>>(), [0, 3]);
}

#[test]
fn particles_and_scenes_without_elements_have_motions() {
    let text = settings("gravity = [0, 0, -10]; t_end = 1; output_step = 0.5")
        + "[[body]]\nname = \"ball\"\nmass = 1\nparticle = true\nposition = [1, 2, 3]\nvelocity = [1, 0, 0]\n\
           [[body.shape]]\nkind = \"sphere\"\nradius = 0.1\n";
    let (_, motion) = both("particle", &text);
    assert!(motion.loads.is_empty() && motion.header.elements.is_empty());
    let last = motion.pose(2, 0).unwrap();
    assert!([2.0, 2.0, -2.0].iter().zip(last).all(|(x, found)| (x - found).abs() < 1e-5), "{last:?}");
    assert_eq!((last[3].abs(), &last[4..]), (1.0, [0.0, 0.0, 0.0].as_slice()));
}

#[test]
fn shapes_are_where_the_frames_of_elements_would_be() {
    // The body is turned by a quarter about z, its x axis along y.
    let text = settings("t_end = 1; output_step = 0.5; motion = true")
        + "[[body]]\nname = \"rod\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1, 0, 0]\ncom = [0.5, 0, 0]\n\
           orientation = { axis = [0, 0, 1], angle = \"90 deg\" }\n\
           [[body.shape]]\nkind = \"cylinder\"\nradius = 0.1\nlength = 2\npoint = [1, 3, 0]\naxis = [0, 1, 0]\ncolor = \"#102030\"\n\
           [[body.shape]]\nkind = \"capsule\"\nradius = 0.1\nlength = 2\nframe = { position = [3, 0, 0], axis = [1, 0, 0] }\n\
           [[body.shape]]\nkind = \"sphere\"\nradius = 0.1\n";
    let shown = open(&text).picture().unwrap();
    let body = &shown.bodies[0];
    assert_eq!(body.centre, [0.5, 0.0, 0.0]);
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    for shape in &body.shapes[..2] {
        // Both along the rod, 3 m from its origin.
        let turn = crate::model::rotation(&shape.p);
        assert!(near(&shape.r, &[3.0, 0.0, 0.0]) && near(turn.column(2).as_slice(), &[1.0, 0.0, 0.0]), "{shape:?}");
    }
    assert_eq!(body.shapes[0].color.as_deref(), Some("#102030"));
    // A sphere at (1, 0, 0), and the farther ends of the others around (1, 3, 0): 1.1 m, at the same distance in every direction.
    let expected = [2.2, 4.2, 2.2].iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!((shown.length - expected).abs() < 1e-12, "{} {expected}", shown.length);
    assert!(near(&body.shapes[2].r, &[0.0; 3]) && near(&body.shapes[2].p, &[1.0, 0.0, 0.0, 0.0]));
}

#[test]
fn a_mesh_that_cannot_be_had_is_told_with_its_place() {
    let folder = Scratch::new("mesh");
    fs::create_dir_all(&folder.0).unwrap();
    let text = settings("t_end = 1; output_step = 0.5; motion = true")
        + "[[body]]\nname = \"ball\"\nmass = 1\ninertia = [1, 1, 1]\n[[body.shape]]\nkind = \"mesh\"\nfile = \"part.stl\"\n";
    let named = || {
        let mut scene = scene(&text);
        scene.source.name = folder.0.join("scene.toml").display().to_string();
        Session::with_catalog(scene, Vec::new(), &catalog(), &RunOptions::default())
    };
    let missing = named().err().unwrap();
    let told = missing.to_string();
    assert!(
        told.contains("ODY0327") && told.contains("part.stl") && told.contains("relative to the scene's folder"),
        "{told}"
    );
    assert!(told.contains("scene.toml:11:8"), "{told}");
    fs::write(folder.0.join("part.stl"), "solid nothing\nendsolid nothing\n").unwrap();
    let into = folder.0.join("results");
    let error = named().unwrap().run(Some(&into), Box::new(|_| ()), &Arc::default()).err().unwrap().to_string();
    assert!(error.contains("no triangles") && !into.exists(), "{error}");
}

#[test]
fn a_former_motion_does_not_stay_beside_a_new_table() {
    let folder = Scratch::new("former");
    let text = settings("t_end = 1; output_step = 0.5")
        + "[[body]]\nname = \"ball\"\nmass = 1\ninertia = [1, 1, 1]\nvelocity = [1, 0, 0]\n";
    go_on(&with_motion(&text), &folder.0, 2.0);
    assert!(folder.0.join(MOTION_FILE).exists());
    go_on(&text, &folder.0, 2.0);
    assert!(!folder.0.join(MOTION_FILE).exists());
}
