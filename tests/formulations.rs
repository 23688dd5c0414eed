//! Joint coordinates and the coordinates of bodies describe the same motion, in every scene of the tree.

use std::path::{Path, PathBuf};

use odyn::session::{RunReport, Session};
use odyn::verification::scenes_in;

use crate::support::{options, root};

/// Scenes whose runs take long, or that are chaotic beyond their end, for this purpose.
const LEFT_OUT: [&str; 1] = ["many-turns"];

/// Share of a column's peak that two runs may differ by, in tolerances of their integration: each is off by some.
const TOLERANCES: f64 = 1000.0;
/// Columns that stay below this are zero but for rounding and errors of the integration (the energy of a scene that starts with
/// none), in scene units.
const ROUNDING: f64 = 1e-7;
/// The same where round-off decides.
const ROUND_OFF: f64 = 1e-10;

/// The largest difference of each column of two runs, as a share of the largest magnitude in the column or, for columns that
/// should be zero, in all columns of the unit.
fn worst(ours: &RunReport, theirs: &RunReport) -> (f64, String) {
    assert_eq!(ours.times, theirs.times);
    let peak = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut worst = (0.0, String::new());
    for (k, channel) in ours.channels.iter().enumerate() {
        if !channel.unique {
            continue;
        }
        let same_unit = ours.channels.iter().zip(&ours.columns).filter(|(other, _)| other.unit == channel.unit);
        let size = same_unit.map(|(_, column)| peak(column)).fold(0.0, f64::max);
        // What should be zero is so but for rounding.
        let size = if size > ROUNDING { size } else { 1.0 };
        let differences: Vec<f64> = ours.columns[k].iter().zip(&theirs.columns[k]).map(|(a, b)| a - b).collect();
        let off = peak(&differences) / size;
        if off > worst.0 || off.is_nan() {
            worst = (off, channel.name.clone());
        }
    }
    worst
}

fn scenes() -> Vec<PathBuf> {
    let mut scenes = scenes_in(&root().join("scenes/verification")).unwrap();
    scenes.extend(["compressor", "compressor-speed-control"].map(|name| root().join(format!("scenes/{name}.toml"))));
    scenes.retain(|path| !LEFT_OUT.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name)));
    scenes
}

/// The scene with settings, opened.
fn open(path: &Path, settings: &[&str]) -> Session {
    let settings: Vec<String> = settings.iter().map(|setting| format!("simulation.{setting}")).collect();
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    Session::open(path, &options(&settings, &[])).unwrap_or_else(|error| panic!("{error}"))
}

fn run(session: Session) -> RunReport {
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// What differs by more than the tolerance of the runs explains, in words; empty where nothing does.
fn difference(path: &Path, ours: &RunReport, theirs: &RunReport) -> String {
    let (off, column) = worst(ours, theirs);
    let allowed = (TOLERANCES * ours.summary.tolerance).max(ROUND_OFF);
    if off <= allowed {
        return String::new();
    }
    format!("{}: `{column}` differs by {off:.1e} of its peak, allowed {allowed:.1e}\n", path.display())
}

#[test]
fn joint_coordinates_and_those_of_bodies_give_the_same_results() {
    let mut in_joints = 0;
    let mut failed = String::new();
    for path in scenes() {
        let [ours, theirs] = ["formulation=auto", "formulation=cartesian"].map(|setting| run(open(&path, &[setting])));
        if !ours.summary.engine.contains("joint") {
            continue;
        }
        in_joints += 1;
        failed += &difference(&path, &ours, &theirs);
    }
    assert!(failed.is_empty(), "\n{failed}");
    assert!(in_joints > 50, "{in_joints}");
}

/// A load on a thin rod between two ball joints, whose spin nothing turns: both centres and both joints are on its axis.
fn rod(load: f64, spin: f64) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 2\noutput_step = 0.1\n\
         [[body]]\nname = \"rod\"\nmass = 0.308\ninertia = [6.42e-3, 6.42e-3, {spin:e}]\nposition = [0, 0, -0.25]\n\
         [[body]]\nname = \"load\"\nmass = {load:e}\ninertia = [50, 60, 40]\nposition = [0.1, 0, -0.9]\nangular_velocity = [0.5, 1, 0.3]\n\
         [[joint]]\nname = \"top\"\ntype = \"spherical\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
         [[joint]]\nname = \"hook\"\ntype = \"spherical\"\nbodies = [\"rod\", \"load\"]\npoint = [0, 0, -0.5]\n\
         [[output]]\nname = \"spin\"\nquantity = \"angular_velocity\"\nof = \"rod\"\ncomponent = \"z\"\nframe = \"rod\"\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"load\"\ncomponent = \"x\"\n"
    )
}

/// What elimination has to remove of what a rod carries was left in its spin: 340 tolerances for 1 t on a steel rod, and 151 144 steps at
/// a tolerance of 1e-11, where there were 200 in coordinates of bodies.
#[test]
fn a_heavy_load_on_a_thin_rod_leaves_its_spin_alone() {
    for (load, spin) in [(1e3, 3.85e-6), (1e3, 1e-3), (1e4, 3.85e-6), (1.0, 3.85e-6)] {
        let mut steps = Vec::new();
        for formulation in ["joint", "cartesian"] {
            let sets = ["simulation.tolerance=1e-11", &format!("simulation.formulation={formulation}")];
            let report = run(crate::support::open_text(&rod(load, spin), &sets));
            assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
            let largest = crate::support::column(&report, "spin").iter().fold(0.0_f64, |most, w| most.max(w.abs()));
            assert!(largest < 1e-9, "{load}, {spin}, {formulation}: {largest:e}");
            steps.push(report.summary.steps);
        }
        assert!(steps[0] < 2 * steps[1], "{load}, {spin}: {steps:?}");
    }
}

/// A plate on a spring that spins, 10 m from the origin; its joint with the plane has its frames at this point.
fn plate(point: [f64; 2]) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 2\noutput_step = 0.1\n\
         [[body]]\nname = \"plate\"\nmass = 2\ninertia = [0.1, 0.1, 0.2]\nposition = [10, 0, 0.3]\ncom = [0.1, 0, 0.05]\n\
         velocity = [0, 1, 0]\nangular_velocity = [0, 0, 50]\n\
         [[joint]]\nname = \"table\"\ntype = \"planar\"\nbodies = [\"ground\", \"plate\"]\npoint = [{}, {}, 0]\naxis = [0, 0, 1]\n\
         [[force]]\nname = \"spring\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"plate\"]\n\
         points = [[10, 1, 0.3], [10.3, 0, 0.3]]\nparams = {{ stiffness = 30, free_length = 0.5 }}\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"plate\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"normal\"\nquantity = \"reaction_force\"\nof = \"table\"\non = \"plate\"\ncomponent = \"z\"\n\
         [[output]]\nname = \"tilting\"\nquantity = \"reaction_torque\"\nof = \"table\"\non = \"plate\"\ncomponent = \"x\"\n",
        point[0], point[1]
    )
}

/// Where in its plane a joint has its point is of no matter: coordinates follow the centre of mass, about which another point would circle
/// (100 times the steps for a ball in a drum).
#[test]
fn a_body_in_a_plane_moves_alike_wherever_its_joint_is() {
    let run = |point, formulation: &str| {
        let sets = [&format!("simulation.formulation={formulation}")[..], "simulation.tolerance=1e-10"];
        run(crate::support::open_text(&plate(point), &sets))
    };
    let centred = run([10.1, 0.0], "joint");
    for point in [[0.0, 0.0], [9.0, -30.0]] {
        let (joint, cartesian) = (run(point, "joint"), run(point, "cartesian"));
        assert!(joint.summary.steps < centred.summary.steps * 11 / 10, "{} steps", joint.summary.steps);
        for name in ["x", "normal"] {
            let [ours, bodies, there] =
                [&joint, &cartesian, &centred].map(|report| crate::support::column(report, name).to_vec());
            for ((a, b), c) in ours.iter().zip(&bodies).zip(&there) {
                assert!((a - b).abs() < 1e-7 && (a - c).abs() < 1e-8, "{name}: {a} {b} {c}");
            }
        }
        // About the joint's point, torques are others.
        let off = crate::support::column(&joint, "tilting").iter().zip(crate::support::column(&cartesian, "tilting"));
        assert!(off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-6);
    }
}
