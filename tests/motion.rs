//! A motion that is written beside the table leaves no trace in it, whatever the scene; the shapes of the compressor are where its
//! parts are.

use std::path::Path;

use odyn::results::{MOTION_FILE, Motion, RESULTS_FILE, glb};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, open, options, root};

/// Runs a scene of `scenes/` into a folder.
#[track_caller]
fn run_into(scene: &str, sets: &[&str], folder: &Path) -> RunReport {
    let session = open(scene, sets);
    session.run(Some(folder), Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The report and the motion of a run of a scene of `scenes/` whose table is the same without it.
#[track_caller]
fn shown(scene: &str, sets: &[&str]) -> (RunReport, Motion) {
    let (plain, shown) = (Scratch::new(), Scratch::new());
    run_into(scene, sets, plain.path());
    let report = run_into(scene, &[sets, &["simulation.motion=true"]].concat(), shown.path());
    let table = |folder: &Scratch| std::fs::read(folder.path().join(RESULTS_FILE)).unwrap();
    assert!(table(&plain) == table(&shown), "{scene} {sets:?}: the table is not what it was");
    assert!(!plain.path().join(MOTION_FILE).exists());
    let motion = Motion::read(&shown.path().join(MOTION_FILE)).unwrap();
    assert_eq!(motion.times, report.times);
    (report, motion)
}

#[test]
fn tables_stay_as_they_are() {
    for (scene, sets) in [
        ("benchmarks/A03.toml", vec![]),
        ("benchmarks/A04.toml", vec!["simulation.t_end=2"]),
        ("benchmarks/A04.toml", vec!["simulation.t_end=1", "simulation.formulation=cartesian"]),
        // Stiff: the implicit method; with events; with friction, whose solutions start from those before.
        ("benchmarks/bushing_1e6.toml", vec!["simulation.method=radau5"]),
        ("stress/stick-slip.toml", vec![]),
        ("verification/joint-friction-loop.toml", vec![]),
        // Through singular positions.
        ("stress/four-bar-change-point.toml", vec![]),
        // Independent mechanisms, each with steps of its own.
        ("verification/cylindrical-as-revolute.toml", vec!["simulation.islands=apart"]),
    ] {
        let (_, motion) = shown(scene, &sets);
        assert!(motion.poses.iter().chain(&motion.loads).all(|number| number.is_finite()), "{scene}");
    }
}

/// Friction is found together with the reaction that it depends on, from the solution before; where no output asks for reactions,
/// only a picture does so at samples.
#[test]
fn what_is_solved_for_a_picture_does_not_show_in_what_follows() {
    let text = std::fs::read_to_string(root().join("scenes/verification/joint-friction-loop.toml")).unwrap();
    let (begin, end) = (text.find("[verification]").unwrap(), text.find("[plugins]").unwrap());
    let first = text.find("[[output]]").unwrap();
    let second = first + text[first + 1..].find("[[output]]").unwrap() + 1;
    let third = second + text[second + 1..].find("[[output]]").unwrap() + 1;
    let folder = Scratch::new();
    folder.file("scene.toml", [&text[..begin], &text[end..third]].concat());
    let tables = ["false", "true"].map(|motion| {
        let sets = [format!("simulation.motion={motion}"), "simulation.output_step=0.0137".into()];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let session =
            Session::open(&folder.path().join("scene.toml"), &options(&sets, &[])).unwrap_or_else(|e| panic!("{e}"));
        let into = folder.path().join(motion);
        session.run(Some(&into), Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
        std::fs::read_to_string(into.join(RESULTS_FILE)).unwrap()
    });
    assert!(tables[0].lines().count() > 30);
    assert_eq!(tables[0], tables[1]);
}

#[test]
fn the_motion_of_the_compressor_is_that_of_its_table() {
    let (report, motion) = shown("compressor.toml", &["simulation.t_end=40"]);
    let bodies: Vec<&str> = motion.header.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(bodies, ["block", "rotor", "conrod", "piston"]);
    assert!(motion.header.bodies.iter().all(|body| !body.shapes.is_empty()));
    let glyphs: Vec<&str> = motion.header.elements.iter().map(|element| element.glyph.as_str()).collect();
    assert_eq!(glyphs, ["weld", "hinge", "cylinder", "hinge", "slider", "torque", "torque", "arrow"]);
    let bearing = motion.header.loads.iter().position(|load| (load.element, load.frame) == (1, 1)).unwrap();
    assert_eq!((motion.header.loads[bearing].kind.as_str(), motion.header.time_unit.as_str()), ("reaction", "ms"));
    let (x, force) = (column(&report, "x_p"), column(&report, "Bx_block_on_rotor"));
    let largest = force.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
    for (sample, (x, force)) in x.iter().zip(force).enumerate() {
        // mm and kN there, m and N here.
        let pose = motion.pose(sample, 3).unwrap();
        assert!((f64::from(pose[0]) - 1e-3 * x).abs() < 1e-8, "{pose:?}, {x} mm");
        let load = motion.load(sample, bearing).unwrap();
        assert!((f64::from(load[0]) - 1e3 * force).abs() < 1e-3 * largest, "{load:?}, {force} kN");
    }
    let file = glb(&motion, 1e-3).unwrap();
    assert_eq!(u32::from_le_bytes(file[8..12].try_into().unwrap()) as usize, file.len());
}

#[test]
fn glyphs_are_found_from_what_elements_do_or_say() {
    let glyphs = |scene: &str| {
        let folder = Scratch::new();
        run_into(scene, &["simulation.motion=true"], folder.path());
        let motion = Motion::read(&folder.path().join(MOTION_FILE)).unwrap();
        let pair = |element: odyn::results::ShownElement| (element.type_name, element.glyph);
        motion.header.elements.into_iter().map(pair).collect::<Vec<_>>()
    };
    for (scene, of, glyph) in [
        ("spherical", "spherical", "ball"),
        ("universal", "universal", "universal"),
        ("cylindrical", "cylindrical", "cylinder"),
        ("translational", "translational", "slider"),
        ("planar", "planar", "plane"),
        ("screw", "screw", "screw"),
        ("distance-rod", "distance-rod", "rod"),
        ("gear", "gear", "gear"),
        ("point-on-line", "point-on-line", "curve"),
        ("bracket", "bracket", "weld"),
        ("rotation-driver", "rotation-driver", "torque"),
        ("translational-spring-damper", "translational-spring-damper", "spring"),
        ("rotational-spring-damper", "rotational-spring-damper", "torque"),
        ("bushing", "bushing", "spring"),
        // As it says itself: its loads are those of a bushing.
        ("beam", "beam", "rod"),
    ] {
        let found = glyphs(&format!("verification/{scene}.toml"));
        let own = found.iter().find(|(name, _)| name == of).unwrap_or_else(|| panic!("{scene}: {found:?}"));
        assert_eq!(own.1, glyph, "{scene}: {found:?}");
    }
}
