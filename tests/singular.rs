//! Positions where constraints lose rank: passed in both formulations, at every tolerance, on the branch the motion is on.

use odyn::diagnostics::codes;
use odyn::results::{Remedy, Table};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, options, root};

/// Leaves all joint coordinates and the rows that close loops in use.
const ALL_ROWS: &str = "simulation.without=[\"affine-loops\"]";

const FORMULATIONS: [&str; 2] = ["joint", "cartesian"];

/// A run that reaches its end, whatever its checks say.
#[track_caller]
fn finished(path: &std::path::Path, formulation: &str, tolerance: f64) -> RunReport {
    finished_with(path, &[], formulation, tolerance)
}

#[track_caller]
fn finished_with(path: &std::path::Path, more: &[&str], formulation: &str, tolerance: f64) -> RunReport {
    let sets = [format!("simulation.formulation={formulation}"), format!("simulation.tolerance={tolerance:e}")];
    let sets: Vec<&str> = sets.iter().map(String::as_str).chain(more.iter().copied()).collect();
    let session = Session::open(path, &options(&sets, &[])).unwrap_or_else(|error| panic!("{error}"));
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    let summary = &report.summary;
    assert_eq!(summary.status, odyn::results::Status::Completed, "{formulation} {tolerance:e}: {}", summary.reason);
    let audit = &summary.audit;
    assert!(audit.position_violation < 1e-12, "{formulation} {tolerance:e}: {audit:?}");
    assert!(audit.velocity_violation < 1e-10, "{formulation} {tolerance:e}: {audit:?}");
    assert!(audit.energy_error_relative < 20.0 * tolerance + 1e-12, "{formulation} {tolerance:e}: {audit:?}");
    report
}

/// The error follows the tolerance down to 1e-10, where round-off at the places of interpolation and over the many steps is
/// left.
#[track_caller]
fn four_bars(count: usize, formulations: &[&str], tolerances: &[f64]) {
    let table = Table::read(&root().join(format!("scenes/reference/A02_N{count}.csv"))).unwrap();
    let path = root().join(format!("scenes/benchmarks/A02_N{count}.toml"));
    for formulation in formulations {
        let mut interpolated = 0;
        for tolerance in tolerances {
            // The bars are parallel: where that is used, nothing is singular.
            let ways: &[&[&str]] = if *formulation == "joint" { &[&[ALL_ROWS], &[]] } else { &[&[]] };
            for more in ways {
                let report = finished_with(&path, more, formulation, *tolerance);
                for name in ["B0x", "B0y"] {
                    let k = table.names.iter().position(|other| other == name).unwrap();
                    let pairs = column(&report, name).iter().zip(&table.columns[k]);
                    let off = pairs.map(|(ours, exact)| (ours - exact).abs()).fold(0.0, f64::max);
                    let what = format!("N = {count}, {formulation} {tolerance:e} {more:?}: {name} {off:e}");
                    assert!(off < 1000.0 * tolerance + 1e-10, "{what}");
                }
                let passages = report.summary.recoveries[Remedy::Passage];
                if *formulation == "joint" && more.is_empty() {
                    assert_eq!(passages, 0, "N = {count}, {tolerance:e}");
                }
                interpolated += passages;
            }
        }
        assert!(interpolated > 0, "N = {count}, {formulation}: nothing singular was met");
    }
}

#[test]
fn one_four_bar_at_every_tolerance() {
    four_bars(1, &FORMULATIONS, &[1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12]);
}

#[test]
fn two_four_bars_at_every_tolerance() {
    four_bars(2, &FORMULATIONS, &[1e-4, 1e-6, 1e-8, 1e-10, 1e-12]);
}

#[test]
fn forty_four_bars_that_lose_forty_ranks() {
    four_bars(40, &["joint"], &[1e-6, 1e-9, 1e-12]);
    four_bars(40, &["cartesian"], &[1e-6, 1e-9]);
}

fn body(name: &str, at: [f64; 2], more: &str) -> String {
    let [x, y] = at;
    format!(
        "[[body]]\nname = \"{name}\"\nmass = 1.3\ninertia = [0.1, 0.12, 0.15]\nposition = [{x:?}, {y:?}, 0]\n{more}\n"
    )
}

fn joint(name: &str, kind: &str, i: &str, j: &str, at: [f64; 2], axis: [f64; 3]) -> String {
    let [x, y] = at;
    format!(
        "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{x:?}, {y:?}, 0]\n\
         axis = {axis:?}\n"
    )
}

fn output(name: &str, quantity: &str, of: &str, component: &str) -> String {
    format!("[[output]]\nname = \"{name}\"\nquantity = \"{quantity}\"\nof = \"{of}\"\n{component}\n")
}

fn settings(gravity: f64, t_end: f64) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, {gravity:?}, 0]\nt_end = {t_end:?}\n\
         output_step = 0.05\n"
    )
}

const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Runs in both formulations agree with the tightest one to within their tolerance; gives that one.
#[track_caller]
fn converges(text: &str, names: &[&str]) -> RunReport {
    let folder = Scratch::new();
    let path = folder.file("scene.toml", text);
    let tightest = finished(&path, "joint", 1e-13);
    for formulation in FORMULATIONS {
        for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
            let report = finished(&path, formulation, tolerance);
            for name in names {
                let pairs = column(&report, name).iter().zip(column(&tightest, name));
                let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1000.0 * tolerance + 1e-9, "{formulation} {tolerance:e}: {name} {off:e}");
            }
        }
    }
    tightest
}

/// A crank and a rod of equal length: with the crank upright the slider is at the crank's pivot, and could stay there. It
/// continues, x = 2 cos q.
#[test]
fn a_slider_crank_of_equal_lengths() {
    let (s, c) = 0.7_f64.sin_cos();
    let text = settings(0.0, 6.0)
        + &body("crank", [0.5 * c, 0.5 * s], "angular_velocity = [0, 0, 2.3]")
        + &body("rod", [1.5 * c, 0.5 * s], "")
        + &body("slider", [2.0 * c, 0.0], "")
        + &joint("A", "revolute", "ground", "crank", [0.0, 0.0], Z)
        + &joint("B", "revolute", "crank", "rod", [c, s], Z)
        + &joint("C", "revolute", "rod", "slider", [2.0 * c, 0.0], Z)
        + &joint("rail", "translational", "ground", "slider", [2.0 * c, 0.0], [1.0, 0.0, 0.0])
        + &output("x", "position", "slider", "component = \"x\"")
        + &output("c", "position", "crank", "component = \"x\"")
        + &output("q_t", "angular_velocity", "crank", "component = \"z\"");
    let report = converges(&text, &["x", "c", "q_t"]);
    assert!(report.summary.recoveries[Remedy::Passage] > 0);
    let (m, j) = (1.3, 0.15);
    let twice_energy = |cosine: f64, speed: f64| {
        let square = 1.0 - cosine * cosine;
        (0.25 * m + j + m * (2.25 * square + 0.25 * cosine * cosine) + j + m * 4.0 * square) * speed * speed
    };
    let start = twice_energy(c, 2.3);
    let [xs, centres, speeds] = ["x", "c", "q_t"].map(|name| column(&report, name));
    for ((x, centre), speed) in xs.iter().zip(centres).zip(speeds) {
        let cosine = 2.0 * centre;
        assert!((x - 2.0 * cosine).abs() < 1e-11, "the slider is at {x}, the crank's end at {cosine}");
        assert!((twice_energy(cosine, *speed) - start).abs() < 1e-10 * start && *speed > 0.0);
    }
    assert!(xs.iter().any(|x| *x < -1.9), "it came to the other side");
}

/// The shortest link and the longest are as long together as the two others: with all links in line the rocker can continue
/// either way.
#[test]
fn a_four_bar_with_a_change_point() {
    let root5 = 5.0_f64.sqrt();
    let end = [2.0 + 2.0 / root5, 1.0 + 4.0 / root5];
    let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let (pivot, far, tip) = ([0.0, 0.0], [4.0, 0.0], [0.0, 2.0]);
    let text = settings(0.0, 6.0)
        + &body("crank", middle(pivot, tip), "angular_velocity = [0, 0, 3]")
        + &body("coupler", middle(tip, end), "")
        + &body("rocker", middle(far, end), "")
        + &joint("A", "revolute", "ground", "crank", pivot, Z)
        + &joint("B", "revolute", "crank", "coupler", tip, Z)
        + &joint("C", "revolute", "coupler", "rocker", end, Z)
        + &joint("D", "revolute", "ground", "rocker", far, Z)
        + &output("y", "position", "rocker", "component = \"y\"")
        + &output("c", "position", "crank", "component = \"x\"");
    let report = converges(&text, &["y", "c"]);
    assert!(report.summary.recoveries[Remedy::Passage] > 0);
    // On the same branch throughout, the rocker passes its line of centres each time that the crank does.
    let y = column(&report, "y");
    assert!(y.iter().any(|y| *y > 1.0) && y.iter().any(|y| *y < -1.0), "the rocker crosses over");
}

/// Three revolutes in series whose first and last axes come to lie in one line: the constraints of the gimbals keep their
/// rank, and so do the joint coordinates, since each ring has an inertia.
#[test]
fn gimbals_through_their_lock() {
    let o = [0.0, 0.0];
    let text = settings(-9.81, 4.0)
        + &body("outer", o, "angular_velocity = [0, 0, 0.3]")
        + &body("inner", o, "angular_velocity = [0, 2, 0.3]")
        + &body("rotor", o, "angular_velocity = [1.5, 2, 0.3]")
        + &joint("A", "revolute", "ground", "outer", o, Z)
        + &joint("B", "revolute", "outer", "inner", o, [0.0, 1.0, 0.0])
        + &joint("C", "revolute", "inner", "rotor", o, [1.0, 0.0, 0.0])
        + &output("x", "position", "rotor", "point = [1, 0, 0]\ncomponent = \"x\"")
        + &output("z", "position", "rotor", "point = [0, 1, 0]\ncomponent = \"z\"");
    let report = converges(&text, &["x", "z"]);
    let x = column(&report, "x");
    assert!(x.iter().any(|x| *x < 0.0), "the axis of the rotor passed that of the outer ring");
}

/// The end of a column in both formulations at the tolerance that is preset.
#[track_caller]
fn ends_at(what: &str, text: &str, name: &str, known: f64, bound: f64) {
    let folder = Scratch::new();
    let path = folder.file("scene.toml", text);
    for formulation in FORMULATIONS {
        let report = finished(&path, formulation, 1e-10);
        let end = *column(&report, name).last().unwrap();
        assert!((end - known).abs() < bound, "{what}, {formulation}: {end}, not {known}");
    }
}

/// A parallelogram whose coupler is too long or too short by 1e-8 to 1e-3 turns into its mirrored form with a whip of the rocker, the
/// faster the less: known from the equations in three angles (Dormand & Prince's method of order 8, 1e-11).
#[test]
fn a_parallelogram_that_is_none_by_a_little() {
    let bar = |name: &str, at: [f64; 2], spin: &str| {
        let inertia = if name == "coupler" { "[0.001, 0.08, 0.08]" } else { "[0.08, 0.08, 0.001]" };
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = {inertia}\nposition = [{:?}, 0, {:?}]\n\
             {spin}\n",
            at[0], at[1]
        )
    };
    let pin = |name: &str, i: &str, j: &str, points: [[f64; 2]; 2]| {
        let [[x, z], [u, w]] = points;
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = [\"{i}\", \"{j}\"]\naxis = [0, 1, 0]\n\
             points = [[{x:?}, 0, {z:?}], [{u:?}, 0, {w:?}]]\n"
        )
    };
    for (longer, known) in [
        (1e-3, 0.554151215659),
        (1e-4, 0.557033454465),
        (1e-5, 0.557821525201),
        (1e-6, 0.558058856043),
        (1e-8, 0.558156092649),
        (-1e-3, 0.816409653542),
        (-1e-5, 0.857037549459),
        (-1e-8, 0.861600892410),
    ] {
        let text = settings(0.0, 1.0).replace("gravity = [0, 0.0, 0]", "gravity = [0, 0, -9.81]")
            + &bar("crank", [0.0, 0.5], "angular_velocity = [0, 1, 0]")
            + &pin("A", "ground", "crank", [[0.0, 0.0]; 2])
            + &bar("rocker", [1.0, 0.5], "")
            + &pin("D", "ground", "rocker", [[1.0, 0.0]; 2])
            + &bar("coupler", [0.5, 1.0], "")
            + &pin("B", "crank", "coupler", [[0.0, 1.0]; 2])
            + &pin("C", "coupler", "rocker", [[1.0 + longer, 1.0], [1.0, 1.0]])
            + &output("x", "position", "rocker", "component = \"x\"");
        ends_at(&format!("{longer:e}"), &text, "x", known, 1e-8);
    }
}

/// A plate falls on a vertical guide, carried by two legs with knees, of lengths 0.6 m and a little more: it is stopped by the shorter
/// leg, through whose stretched position the knee of that one swings. Known from the equations in two angles (the same method, 1e-12);
/// with legs of equal lengths both knees swing through.
#[test]
fn legs_of_nearly_equal_lengths_are_stretched() {
    let (length, height) = (0.3_f64, -0.45_f64);
    for (longer, known) in
        [(3e-5, -0.473727317556), (1e-6, -0.474147335177), (1e-9, -0.474242415102), (0.0, -0.4742455466)]
    {
        let body = |name: &str, mass: f64, inertia: f64, x: f64, z: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\n\
                 position = [{x:?}, 0, {z:?}]\n"
            )
        };
        let joint = |name: &str, kind: &str, i: &str, j: &str, [x, z]: [f64; 2], axis: &str| {
            format!(
                "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{x:?}, 0, {z:?}]\n\
                 axis = {axis}\n"
            )
        };
        let mut text = settings(0.0, 0.3).replace("gravity = [0, 0.0, 0]", "gravity = [0, 0, -9.81]")
            + &body("plate", 3.0, 0.05, 0.0, height)
            + &joint("guide", "translational", "ground", "plate", [0.0, height], "[0, 0, 1]");
        for (leg, half, side) in [("p", length, 1.0), ("q", length + longer, -1.0)] {
            let knee = [side * (half * half - 0.25 * height * height).sqrt(), 0.5 * height];
            let names = ["1", "2"].map(|number| format!("{leg}{number}"));
            text += &body(&names[0], 0.5, 1e-3, 0.5 * knee[0], 0.5 * knee[1]);
            text += &body(&names[1], 0.5, 1e-3, 0.5 * knee[0], 0.5 * (knee[1] + height));
            text += &joint(&format!("{leg}a"), "revolute", "ground", &names[0], [0.0, 0.0], "[0, -1, 0]");
            text += &joint(&format!("{leg}b"), "revolute", &names[0], &names[1], knee, "[0, -1, 0]");
            text += &joint(&format!("{leg}c"), "revolute", &names[1], "plate", [0.0, height], "[0, -1, 0]");
        }
        text += &output("z", "position", "plate", "component = \"z\"");
        ends_at(&format!("{longer:e}"), &text, "z", known, 1e-8);
    }
}

/// A crank that is turned beyond where coupler and rocker are stretched, at sin(2 t) = (l^2 - 5) / 4 with their lengths l together: the
/// run ends just before, soon, with the motor and the joint named.
#[test]
fn a_drive_beyond_a_dead_centre_is_named() {
    let length = 1.3 + f64::hypot(0.7, 1.0);
    let dead = 0.5 * ((length * length - 5.0) / 4.0).asin();
    let turning = "[[body]]\nname = \"frame\"\nmass = 10\ninertia = [10, 10, 10]\nangular_velocity = [0, 0, 1]\n"
        .to_string()
        + &joint("base", "revolute", "ground", "frame", [0.0, 0.0], Z);
    for (frame, start, closer) in
        [("ground", "", "revolute"), ("frame", turning.as_str(), "revolute"), ("frame", turning.as_str(), "spherical")]
    {
        let text = settings(0.0, 2.0)
            + start
            + &body("crank", [0.0, 0.5], "")
            + &body("coupler", [0.5, 1.0], "")
            + &body("rocker", [1.6, 0.5], "")
            + &joint("A", "revolute", frame, "crank", [0.0, 0.0], Z)
            + &joint("motor", "rotation-driver", frame, "crank", [0.0, 0.0], Z)
            + "params.angle = \"2 * t\"\n"
            + &joint("B", "revolute", "crank", "coupler", [0.0, 1.0], Z)
            + &joint("C", closer, "coupler", "rocker", [1.3, 1.0], Z)
            + &joint("D", "revolute", frame, "rocker", [2.0, 0.0], Z)
            + &output("x", "position", "rocker", "component = \"x\"");
        let folder = Scratch::new();
        let path = folder.file("scene.toml", &text);
        for method in ["dop853", "radau5"] {
            let method = format!("simulation.method={method}");
            let sets = ["simulation.formulation=joint", method.as_str()];
            let session = Session::open(&path, &options(&sets, &[])).unwrap_or_else(|error| panic!("{error}"));
            let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
            let (summary, what) = (&report.summary, format!("{frame}, {closer}, {method}"));
            assert_eq!(summary.code, Some(codes::PROJECTION_FAILED), "{what}: {}", summary.reason);
            assert!(summary.reason.contains("motor: about z asks for more than can be reached"), "{}", summary.reason);
            let left = dead - summary.t_end_reached;
            assert!((0.0..1e-6).contains(&left), "{what}: {left:e} s before {dead}");
            assert!(summary.steps < 1000, "{what}: {} steps", summary.steps);
            assert!(summary.audit.energy_error_relative < 1e-8, "{what}: {:?}", summary.audit);
        }
    }
}

/// A body that tumbles on a constant-velocity joint past a bend of 180 deg, which generic motions cross: e_3 = 0 on both sides. Reference: its
/// equations for w . (z_i + z_j) = 0, DOP853 at 1e-12.
#[test]
fn shafts_keep_to_their_solution_past_a_bend_of_180_degrees() {
    let text = "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
                [[body]]\nname = \"b\"\nmass = 1\ninertia = [0.1, 0.2, 0.15]\nposition = [0, 0, 0.5]\nangular_velocity = [5, 1, \"free\"]\n\
                [[joint]]\nname = \"cv\"\ntype = \"constant-velocity\"\nbodies = [\"ground\", \"b\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
                x_axis = [1, 0, 0]\n\
                [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"b\"\ncomponent = \"x\"\n\
                [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"b\"\ncomponent = \"z\"\n\
                [[output]]\nname = \"e3\"\nquantity = \"orientation\"\nof = \"b\"\ncomponent = \"e3\"\n";
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", text);
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-9, 1e-11] {
            let report = finished(&path, formulation, tolerance);
            let last = |name: &str| *column(&report, name).last().unwrap();
            let off = (last("x") + 0.311_495_155).abs().max((last("z") - 0.141_616_510).abs());
            assert!(off < 10.0 * tolerance + 2e-9 && last("e3").abs() < 1e-12, "{formulation} {tolerance:e}: {off:e}");
        }
    }
}
