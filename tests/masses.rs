//! Rank is geometry: with one body's mass and inertia many decades away from those of the others, mobility, redundancy and
//! unique reactions stay what they were, nothing new counts as a singular position, and both formulations agree or the run is
//! refused with a reason that speaks of masses.
//!
//! The short form takes one body of each scene of the tree. The long form takes all of them, nine decades up and down:
//!
//! ```sh
//! ODYN_MASSES=long cargo test --release -p odyn-tests masses
//! ```

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use odyn::analyses::linear::Linear;
use odyn::analyses::modes::Modes;
use odyn::results::{Remedy, Status};
use odyn::scene::{Dimension, Scene};
use odyn::session::{RunReport, Session, SessionError};
use odyn::verification::scenes_in;

use crate::support::{Scratch, options, root};

/// Time that runs are looked at, s, or a tenth of the scene's, whichever is shorter.
const LONGEST: f64 = 0.1;
/// Tolerance of the runs, and how many of it two of them may differ by.
const TOLERANCE: f64 = 1e-9;
const TOLERANCES: f64 = 100.0;
/// Steps that a run may take: light bodies on springs are fast.
const MOST_STEPS: u64 = 3000;

/// Scenes that are there to be refused, and so have no decisions to compare.
const REFUSED: [&str; 1] = ["door-hinges-apart"];

fn scenes() -> Vec<PathBuf> {
    let folders = ["scenes/verification", "scenes/benchmarks", "scenes/stress"];
    let mut scenes: Vec<PathBuf> = folders.iter().flat_map(|folder| scenes_in(&root().join(folder)).unwrap()).collect();
    // The suite is no scene. In `sizes` a pendulum of 1 mm swings beside one of 1 km, by whose size errors are judged. In
    // `point-gravity` a lighter body falls into the centre: the force is written with a mass of its own. The others take long.
    let left_out = ["suite", "sizes", "point-gravity", "A02_N40", "chain_N100", "A01_2000s", "tables"];
    scenes.retain(|path| !left_out.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name)));
    scenes
}

/// Settings that multiply mass and inertia of a body.
fn heavier(scene: &Scene, body: usize, factor: f64) -> Vec<String> {
    let record = scene.bodies.iter().filter(|body| !body.fixed).nth(body).unwrap();
    let name = &record.name.value;
    let mut sets = Vec::new();
    if let Some(mass) = &record.mass {
        sets.push(format!("body.{name}.mass={:e}", mass.value * factor / scene.units.factor(Dimension::MASS)));
    }
    if let Some(inertia) = &record.inertia {
        let unit = scene.units.factor(Dimension::INERTIA);
        let moments = inertia.value.map(|x| format!("{:e}", x * factor / unit));
        sets.push(format!("body.{name}.inertia=[{}]", moments.join(", ")));
    }
    sets
}

/// What the joints alone decide.
fn geometry(session: &Session) -> String {
    let plan = &session.plan;
    let redundant: Vec<&str> = plan.redundant_rows.iter().map(|row| row.name.as_str()).collect();
    let shared: Vec<_> = plan.reactions.iter().filter(|reaction| !reaction.is_unique()).collect();
    format!("mobility {}, redundant {redundant:?}, not unique {shared:?}", plan.mobility)
}

fn open(path: &Path, sets: &[String]) -> Result<Session, SessionError> {
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    Session::open(path, &options(&sets, &[]))
}

fn run(path: &Path, sets: &[String], formulation: &str, t_end: f64) -> Result<RunReport, SessionError> {
    let time_unit = open(path, sets)?.scene.units.factor(Dimension::TIME);
    let mut sets = sets.to_vec();
    sets.extend([
        format!("simulation.formulation={formulation}"),
        format!("simulation.tolerance={TOLERANCE:e}"),
        format!("simulation.t_end={:e}", t_end / time_unit),
        format!("simulation.output_step={:e}", t_end / 8.0 / time_unit),
        format!("simulation.max_steps={MOST_STEPS}"),
    ]);
    open(path, &sets)?.run(None, Box::new(|_| ()), &Default::default())
}

/// The largest difference of two runs in places, lengths and angles, as a share of the largest of its unit.
fn apart(ours: &RunReport, theirs: &RunReport) -> (f64, String) {
    let peak = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut worst = (0.0, String::new());
    for (k, channel) in ours.channels.iter().enumerate() {
        if !["m", "mm", "rad", "deg", ""].contains(&channel.unit.as_str()) {
            continue;
        }
        let alike = ours.channels.iter().zip(&ours.columns).filter(|(other, _)| other.unit == channel.unit);
        let size = alike.map(|(_, column)| peak(column)).fold(1e-3, f64::max);
        let differences: Vec<f64> = ours.columns[k].iter().zip(&theirs.columns[k]).map(|(a, b)| a - b).collect();
        let off = peak(&differences) / size;
        if off > worst.0 || off.is_nan() {
            worst = (off, channel.name.clone());
        }
    }
    worst
}

/// What became of a scene with other masses.
enum Found {
    Agrees,
    /// Ended early because of masses or of steps, refused, or suspect by its own audit.
    Refused,
    Wrong(String),
}

fn judge(path: &Path, body: usize, factor: f64) -> Found {
    let plain = open(path, &[]).unwrap_or_else(|error| panic!("{error}"));
    let sets = heavier(&plain.scene, body, factor);
    let simulation = &plain.scene.simulation;
    let t_end = simulation.t_start + LONGEST.min(0.1 * (simulation.t_end - simulation.t_start));
    let scaled = match open(path, &sets) {
        Ok(scaled) => scaled,
        Err(error) => return Found::Wrong(format!("refused: {error}")),
    };
    let (before, after) = (geometry(&plain), geometry(&scaled));
    if before != after {
        return Found::Wrong(format!("{before} became {after}"));
    }
    let passages = |report: &RunReport| report.summary.recoveries[Remedy::Passage];
    let mut reports = Vec::new();
    for formulation in ["auto", "cartesian"] {
        let report = match run(path, &sets, formulation, t_end) {
            Ok(report) => report,
            Err(error) if error.to_string().contains("mass") => return Found::Refused,
            Err(error) => return Found::Wrong(format!("{formulation}: {error}")),
        };
        let summary = &report.summary;
        if summary.status != Status::Completed {
            let known = summary.status == Status::Suspect
                || summary.reason.contains("mass")
                || summary.steps + summary.rejected >= MOST_STEPS;
            let told = || Found::Wrong(format!("{formulation}: {}", summary.reason));
            return if known { Found::Refused } else { told() };
        }
        if passages(&report) > 0 {
            let usual = run(path, &[], formulation, t_end).unwrap_or_else(|error| panic!("{error}"));
            if passages(&usual) == 0 {
                return Found::Wrong(format!("{formulation}: {} passages", passages(&report)));
            }
        }
        reports.push(report);
    }
    let (off, channel) = apart(&reports[0], &reports[1]);
    if off <= TOLERANCES * TOLERANCE {
        Found::Agrees
    } else {
        Found::Wrong(format!("`{channel}` differs by {off:.1e}"))
    }
}

#[test]
fn no_decision_depends_on_the_mass_of_a_body() {
    let long = std::env::var("ODYN_MASSES").is_ok_and(|form| form == "long");
    let mut trials: Vec<(PathBuf, usize, i32)> = Vec::new();
    let mut passed_over = Vec::new();
    for (number, path) in scenes().into_iter().enumerate() {
        let Ok(plain) = open(&path, &[]) else {
            passed_over.push(path.file_stem().unwrap().display().to_string());
            continue;
        };
        let bodies = plain.scene.bodies.iter().filter(|body| !body.fixed).count();
        let decades = [-9, 6, -4, 9, -6, 3];
        if long {
            let all = (0..bodies).flat_map(|body| (-9..=9).filter(|k| *k != 0).map(move |k| (body, k)));
            trials.extend(all.map(|(body, decade)| (path.clone(), body, decade)));
        } else {
            trials.push((path, number % bodies, decades[number % decades.len()]));
        }
    }
    let (mut agree, mut refused, mut wrong) = (0, 0, String::new());
    let next = AtomicUsize::new(0);
    let threads = if long { std::thread::available_parallelism().map_or(1, usize::from) } else { 1 };
    std::thread::scope(|scope| {
        let (sender, found) = std::sync::mpsc::channel();
        for _ in 0..threads {
            let (sender, trials, next) = (sender.clone(), &trials, &next);
            scope.spawn(move || {
                while let Some(trial) = trials.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let (path, body, decade) = trial;
                    sender.send((trial, judge(path, *body, 10_f64.powi(*decade)))).unwrap();
                }
            });
        }
        drop(sender);
        for (number, ((path, body, decade), found)) in found.iter().enumerate() {
            match found {
                Found::Agrees => agree += 1,
                Found::Refused => refused += 1,
                Found::Wrong(why) => {
                    let line = format!("{}: body {body} times 1e{decade}: {why}\n", path.display());
                    print!("{line}");
                    wrong += &line;
                }
            }
            if number % 500 == 499 {
                println!("{} of {}", number + 1, trials.len());
            }
        }
    });
    println!("{agree} agree, {refused} refused");
    assert_eq!(passed_over, REFUSED);
    assert!(wrong.is_empty(), "\n{wrong}");
    assert!(agree > 5 * refused, "{agree} agree, {refused} refused");
}

/// A body of a mass whose inertia is that of a ball of 0.2 m.
fn body(name: &str, mass: f64, at: [f64; 3], more: &str) -> String {
    let j = 0.4 * mass * 0.04;
    format!(
        "[[body]]\nname = \"{name}\"\nmass = {mass:e}\ninertia = [{j:e}, {j:e}, {j:e}]\nposition = {at:?}\n{more}\n"
    )
}

fn joint(name: &str, kind: &str, [i, j]: [&str; 2], at: [f64; 3], axis: [f64; 3]) -> String {
    let axis = if kind == "spherical" { String::new() } else { format!("axis = {axis:?}\n") };
    format!("[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\npoint = {at:?}\n{axis}")
}

fn rod(name: &str, [i, j]: [&str; 2], [from, to]: [[f64; 3]; 2]) -> String {
    let length = from.iter().zip(to).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    format!(
        "[[joint]]\nname = \"{name}\"\ntype = \"distance-rod\"\nbodies = [\"{i}\", \"{j}\"]\n\
         points = [{from:?}, {to:?}]\nparams.length = {length:?}\n"
    )
}

fn watched(bodies: &[&str]) -> String {
    let output = |body: &&str| {
        ["x", "y", "z"].map(|k| {
            format!(
                "[[output]]\nname = \"{body}_{k}\"\nquantity = \"position\"\nof = \"{body}\"\ncomponent = \"{k}\"\n"
            )
        })
    };
    bodies.iter().flat_map(output).collect()
}

const SETTINGS: &str = "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1.5\n\
                        output_step = 0.05\n";
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Both formulations agree with each other and with a run a hundred times sharper, without a passage.
#[track_caller]
fn moves_as_it_should(text: &str) {
    let folder = Scratch::new();
    let path = folder.file("scene.toml", text);
    let runs = [("joint", 1e-12), ("joint", 1e-10), ("cartesian", 1e-10)].map(|(formulation, tolerance)| {
        let sets = [format!("simulation.formulation={formulation}"), format!("simulation.tolerance={tolerance:e}")];
        let report = open(&path, &sets).unwrap_or_else(|error| panic!("{error}"));
        let report = report.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
        let summary = &report.summary;
        assert_eq!(summary.status, Status::Completed, "{formulation} {tolerance:e}: {}", summary.reason);
        assert_eq!(summary.recoveries[Remedy::Passage], 0, "{formulation} {tolerance:e}");
        report
    });
    for report in &runs[1..] {
        let (off, channel) = apart(report, &runs[0]);
        assert!(off < 1e-8, "{}: `{channel}` differs by {off:.1e}", report.summary.engine);
    }
}

/// A jib that turns about an upright axis, with a load on a rope, let go aside.
#[test]
fn a_heavy_load_on_a_light_jib() {
    for (jib, load) in [(3.0, 5e3), (1e-3, 70.0), (1e3, 1e-3)] {
        let load = format!("[[body]]\nname = \"load\"\nmass = {load:e}\nparticle = true\nposition = [4, -2.4, 0.7]\n");
        let text = SETTINGS.to_string()
            + &body("jib", jib, [2.0, 0.0, 0.0], "")
            + &load
            + &joint("mast", "revolute", ["ground", "jib"], [0.0; 3], Y)
            + &rod("rope", ["jib", "load"], [[4.0, 0.0, 0.0], [4.0, -2.4, 0.7]])
            + &watched(&["jib", "load"]);
        moves_as_it_should(&text);
    }
}

/// A four-bar mechanism whose coupler weighs nothing beside its cranks, or all.
#[test]
fn a_light_coupler_between_heavy_cranks() {
    for (cranks, coupler) in [(50.0, 1e-4), (1e-4, 30.0), (1e4, 1e-6)] {
        let ends = [[0.3, 0.9, 0.0], [2.6, 1.4, 0.0]];
        let text = SETTINGS.to_string()
            + &body("left", cranks, [0.15, 0.45, 0.0], "angular_velocity = [0, 0, 1.5]")
            + &body("middle", coupler, [1.45, 1.15, 0.0], "")
            + &body("right", cranks, [2.3, 0.7, 0.0], "")
            + &joint("A", "revolute", ["ground", "left"], [0.0; 3], Z)
            + &joint("B", "revolute", ["left", "middle"], ends[0], Z)
            + &joint("C", "revolute", ["middle", "right"], ends[1], Z)
            + &joint("D", "revolute", ["ground", "right"], [2.0, 0.0, 0.0], Z)
            + &watched(&["middle", "right"]);
        moves_as_it_should(&text);
    }
}

/// Two cranks about crossing axes with a rod on ball joints and one on a universal joint.
#[test]
fn a_spatial_loop_with_a_light_rod() {
    for (cranks, coupler) in [(20.0, 1e-3), (1e-3, 5.0)] {
        let ends = [[0.5, 0.0, 0.3], [1.6, 0.9, 0.2]];
        let text = SETTINGS.to_string()
            + &body("first", cranks, [0.2, 0.0, 0.1], "angular_velocity = [0, 2, 0]")
            + &body("link", coupler, [1.05, 0.45, 0.25], "")
            + &body("second", cranks, [1.7, 0.4, 0.1], "")
            + &joint("A", "revolute", ["ground", "first"], [0.0; 3], Y)
            + &joint("B", "spherical", ["first", "link"], ends[0], Z)
            + &format!(
                "[[joint]]\nname = \"C\"\ntype = \"universal\"\nbodies = [\"link\", \"second\"]\npoint = {:?}\n\
                 axes = [[0, 0, 1], [1, 0, 0]]\n",
                ends[1]
            )
            + &joint("D", "revolute", ["ground", "second"], [1.8, 0.0, 0.0], X)
            + &watched(&["link", "second"]);
        moves_as_it_should(&text);
    }
}

/// A rod of 1 m on a ball joint, with this moment of inertia about its length.
fn pole(axial: f64, more: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 3
output_step = 0.1
[[body]]
name = "rod"
mass = 2
inertia = [{axial:?}, 0.16666666666666666, 0.16666666666666666]
position = [0.5, 0, 0]
velocity = [0, 1, 0]
angular_velocity = [0, 0, 2]
[[joint]]
name = "ball"
type = "spherical"
bodies = ["ground", "rod"]
point = [0, 0, 0]
[[output]]
name = "x"
quantity = "position"
of = "rod"
component = "x"
{more}
"#
    )
}

#[test]
fn a_rod_without_thickness_moves_as_a_thick_one_that_does_not_turn_about_its_length() {
    let scratch = Scratch::new();
    for formulation in ["joint", "cartesian"] {
        let run = |axial: f64| {
            let path = scratch.file("rod.toml", pole(axial, ""));
            let session = open(&path, &[format!("simulation.formulation={formulation}")]).unwrap();
            session.run(None, Box::new(|_| ()), &Default::default()).unwrap()
        };
        let (thick, thin) = (run(0.03), run(0.0));
        assert_eq!(thin.summary.status, Status::Completed, "{formulation}: {}", thin.summary.reason);
        assert!(thin.summary.steps < 2 * thick.summary.steps, "{formulation}: {} steps", thin.summary.steps);
        let pairs = thick.columns[0].iter().zip(&thin.columns[0]);
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-8, "{formulation}: {off:e}");
    }
}

#[test]
fn a_torque_about_an_axis_without_moment_of_inertia_is_refused() {
    let scratch = Scratch::new();
    let twist =
        "[[force]]\nname = \"twist\"\ntype = \"vector-torque\"\nbodies = [\"ground\", \"rod\"]\nparams = { x = 1.0 }\n";
    let path = scratch.file("rod.toml", pole(0.0, twist));
    let error = open(&path, &[]).unwrap().run(None, Box::new(|_| ()), &Default::default()).unwrap_err();
    let found = error.to_string();
    assert!(found.contains("ODY0606") && found.contains("`rod`"), "{found}");
}

/// Errors of steps turn a thin rod about its length as they turn everything, within the tolerance. Two of them on an arm were refused from
/// a tolerance of 1e-7 on, with "a torque acts".
#[test]
fn errors_of_steps_about_an_axis_without_moment_of_inertia_are_none_of_torques() {
    let rod = |name: &str, at: [f64; 2], angle: f64, more: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0, 0.0833, 0.0833]\nposition = [{:?}, {:?}, 0]\n\
             orientation = {{ axis = [0, 0, 1], angle = \"{angle:?} deg\" }}\n\
             [[output]]\nname = \"{name}\"\nquantity = \"position\"\nof = \"{name}\"\ncomponent = \"z\"\n{more}",
            at[0], at[1]
        )
    };
    let ball = |name: &str, bodies: [&str; 2], x: f64| {
        format!("[[joint]]\nname = \"{name}\"\ntype = \"spherical\"\nbodies = {bodies:?}\npoint = [{x:?}, 0, 0]\n")
    };
    let text = |more: &str| {
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 5\noutput_step = 0.1\n"
            .to_owned()
            + &rod("first", [0.5, 0.0], 0.0, "")
            + &rod("second", [1.0, 0.5], 90.0, more)
            + &ball("shoulder", ["ground", "first"], 0.0)
            + &ball("elbow", ["first", "second"], 1.0)
    };
    let scratch = Scratch::new();
    let run = |more: &str, tolerance: f64, formulation: &str| {
        let sets = [format!("simulation.formulation={formulation}"), format!("simulation.tolerance={tolerance:e}")];
        let session = open(&scratch.file("rods.toml", text(more)), &sets).expect("a scene");
        session.run(None, Box::new(|_| ()), &Default::default())
    };
    let exact = run("", 1e-12, "joint").expect("a run");
    for formulation in ["joint", "cartesian"] {
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-7, 1e-9] {
            let found = run("", tolerance, formulation).unwrap_or_else(|error| panic!("{tolerance:e}: {error}"));
            assert_eq!(found.summary.status, Status::Completed, "{tolerance:e}: {}", found.summary.reason);
            for (a, b) in found.columns.iter().zip(&exact.columns) {
                let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 100.0 * tolerance, "{formulation}, {tolerance:e}: {off:e}");
            }
        }
        // What really turns it does so far beyond that.
        for (tolerance, torque) in [(1e-3, 1.0), (1e-6, 0.01)] {
            let twist = format!(
                "[[force]]\nname = \"twist\"\ntype = \"vector-torque\"\nbodies = [\"ground\", \"second\"]\nparams.y = {torque:?}\n"
            );
            let error = run(&twist, tolerance, formulation).map(|report| report.summary.reason).expect_err("refused");
            assert!(error.to_string().contains("ODY0606"), "{error}");
        }
    }
}

/// A platform on three legs in a plane that lies askew in space; a spring at the foot of each.
fn platform(size: f64, mass: f64) -> String {
    let [along, across, normal] =
        [[2.0, -2.0, 1.0], [1.0, 2.0, 2.0], [-2.0, -1.0, 2.0]].map(|axis| axis.map(|x| x / 3.0));
    let place = |[x, y]: [f64; 2]| -> [f64; 3] { std::array::from_fn(|k| size * (x * along[k] + y * across[k])) };
    let middle = |a: [f64; 2], b: [f64; 2]| place([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
    let part = |name: &str, share: f64, at: [f64; 3]| {
        let (mass, j) = (share * mass, 0.03 * mass * size * size);
        format!("[[body]]\nname = \"{name}\"\nmass = {mass:e}\ninertia = [{j:e}, {j:e}, {j:e}]\nposition = {at:?}\n")
    };
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 1\noutput_step = 1\n",
    );
    text += &part("platform", 2.0, [0.0; 3]);
    for leg in 0..3 {
        let (s, c) = (std::f64::consts::TAU / 3.0 * f64::from(leg)).sin_cos();
        let turned = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
        let [foot, knee, hip] = [[1.0, 0.0], [0.75, 0.4], [0.4, 0.0]].map(turned);
        let [lower, upper] = ["lower", "upper"].map(|name| format!("{name}{leg}"));
        text += &(part(&lower, 1.0, middle(foot, knee)) + &part(&upper, 0.7, middle(knee, hip)));
        text += &joint(&format!("foot{leg}"), "revolute", ["ground", &lower], place(foot), normal);
        text += &joint(&format!("knee{leg}"), "revolute", [&lower, &upper], place(knee), normal);
        text += &joint(&format!("hip{leg}"), "revolute", [&upper, "platform"], place(hip), normal);
        text += &format!(
            "[[force]]\nname = \"spring{leg}\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"{lower}\"]\n\
             point = {:?}\naxis = {normal:?}\nparams = {{ stiffness = {:e}, damping = {:e} }}\n",
            place(foot),
            10.0 * mass * size * size,
            0.1 * mass * size * size
        );
    }
    text
}

/// Masses far below one beside rows of joints of order one: eigenvalues are those of the twin of a metre and a kilogramme.
#[test]
fn modes_do_not_depend_on_units_of_length_and_mass() {
    let found = [(1.0, 1.0), (1e-3, 1e-9), (1e-8, 1e-20), (1e4, 1e14)].map(|(size, mass)| {
        let folder = Scratch::new();
        let path = folder.file("scene.toml", platform(size, mass));
        let session = open(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        let instant = open(&path, &[]).unwrap().prepare().unwrap().start().unwrap().instant().unwrap();
        let linear = Linear::at(&session, &instant, Some(&[]), Some(&[])).unwrap_or_else(|error| panic!("{error}"));
        assert!(linear.at_rest, "{:?}", linear.notes);
        let modes = Modes::of(&session, &linear).unwrap().modes;
        modes.iter().map(|mode| [mode.real, mode.imaginary]).collect::<Vec<_>>()
    });
    assert_eq!(found[0].len(), 3);
    for other in &found[1..] {
        assert_eq!(other.len(), 3);
        for (own, twin) in other.iter().flatten().zip(found[0].iter().flatten()) {
            assert!((own - twin).abs() < 1e-10, "{found:?}");
        }
    }
}

#[test]
fn moments_of_inertia_of_what_cannot_turn_change_nothing() {
    // A stiffening spring between two slides, the second on the first, which swing by a billionth of a metre.
    let text = |inertia: &str| {
        let body = |name: &str, at: &str| {
            format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = {inertia}\nposition = {at}\n")
        };
        let slide = |on: &str, name: &str, at: &str| {
            format!(
                "[[joint]]\nname = \"{name}_rail\"\ntype = \"translational\"\nbodies = [\"{on}\", \"{name}\"]\npoint = {at}\naxis = [1, 0, 0]\n\
                 [[force]]\nname = \"{name}_spring\"\ntype = \"translational-actuator\"\nbodies = [\"{on}\", \"{name}\"]\n\
                 points = [[0, 0, 0], {at}]\naxis = [1, 0, 0]\nparams = {{ along = \"axis\", of_length = \"-l - 1e18 * l^3\" }}\n\
                 [[output]]\nname = \"{name}\"\nquantity = \"position\"\nof = \"{name}\"\ncomponent = \"x\"\n"
            )
        };
        let [first, second] = ["[1e-9, 0, 0]", "[2e-9, 0, 0]"];
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = 20\noutput_step = 0.5\ntolerance = 1e-6\n".to_owned()
            + &[body("first", first), body("second", second), slide("ground", "first", first), slide("first", "second", second)].concat()
    };
    let scratch = Scratch::new();
    let run = |inertia: &str, sets: &[&str]| {
        let session = Session::open(&scratch.file("scene.toml", text(inertia)), &options(sets, &[])).unwrap();
        session.run(None, Box::new(|_| ()), &Default::default()).unwrap()
    };
    let exact = run("[1e-20, 1e-20, 1e-20]", &["simulation.tolerance=1e-11"]);
    for formulation in ["joint", "cartesian"] {
        let found = run("[1, 1, 1]", &[&format!("simulation.formulation={formulation}")]);
        for (found, exact) in found.columns.iter().zip(&exact.columns) {
            let apart = found.iter().zip(exact).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(apart < 1e-4 * 1e-9, "{formulation} {apart:e}");
        }
    }
}
