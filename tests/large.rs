//! Scenes of many alike parts: closed forms, each part as the single one, and work that grows like their number.

use std::fmt::Write;

use odyn::analyses::modes::Stability;
use odyn::analyses::statics::equilibrium;
use odyn::results::Remedy;
use odyn::session::{RunOptions, Session};

use crate::contacts::run;
use crate::support::{Scratch, bisected, column, difference, open_text, options};

fn scene(libraries: &str, gravity: f64, settings: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"{libraries}\"]\n[simulation]\ngravity = [0, {:?}, 0]\noutput_step = 0.1\n{settings}\n",
        -gravity
    )
}

fn body(name: &str, place: [f64; 2], angle: f64, mass: f64, moments: [f64; 2]) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [{:?}, {:?}, {:?}]\nposition = [{:?}, {:?}, 0]\n\
         orientation = {{ axis = [0, 0, 1], angle = {angle:?} }}\n",
        moments[0], moments[1], moments[1], place[0], place[1]
    )
}

fn pin(name: &str, bodies: [&str; 2], place: [f64; 2]) -> String {
    format!(
        "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = [\"{}\", \"{}\"]\npoint = [{:?}, {:?}, 0]\naxis = [0, 0, 1]\n",
        bodies[0], bodies[1], place[0], place[1]
    )
}

fn output(name: &str, body: &str, point: f64, component: &str) -> String {
    format!(
        "[[output]]\nname = \"{name}\"\nquantity = \"position\"\nof = \"{body}\"\npoint = [{point:?}, 0, 0]\n\
         component = \"{component}\"\n"
    )
}

/// So many four-bars in a row: rods of 1 m and 1 kg, half of it where only one four-bar has the rod, the upper ends at 1 m/s. The
/// outputs are where the upper ends are.
fn four_bars(n: usize) -> String {
    let mut text = scene("joints", 9.81, "t_end = 2\ntolerance = 1e-11");
    let moments = [1e-3, 1.0 / 12.0];
    for k in 0..=n {
        let link = format!("link{k}");
        let share = if k == 0 || k == n { 0.5 } else { 1.0 };
        let own = moments.map(|moment| share * moment);
        text += &body(&link, [k as f64, 0.5], std::f64::consts::FRAC_PI_2, share, own);
        text += "velocity = [0.5, 0, 0]\nangular_velocity = [0, 0, -1]\n";
    }
    for k in 1..=n {
        text += &body(&format!("coupler{k}"), [k as f64 - 0.5, 1.0], 0.0, 1.0, moments);
        text += "velocity = [1, 0, 0]\nangular_velocity = [0, 0, 0]\n";
    }
    for k in 0..=n {
        let (link, x) = (format!("link{k}"), k as f64);
        text += &pin(&format!("A{k}"), ["ground", &link], [x, 0.0]);
        if k > 0 {
            text += &pin(&format!("left{k}"), [&format!("coupler{k}"), &link], [x, 1.0]);
        }
        if k < n {
            text += &pin(&format!("right{k}"), [&link, &format!("coupler{}", k + 1)], [x, 1.0]);
        }
        text += &output(&format!("x{k}"), &link, 0.5, "x");
        text += &output(&format!("y{k}"), &link, 0.5, "y");
    }
    text
}

/// All of them pass the horizontal at once, where the rank falls by their number.
#[test]
fn each_of_many_four_bars_moves_as_a_single_one() {
    let single = run(&four_bars(1), &[]);
    for (n, formulation) in [(40, "auto"), (8, "cartesian")] {
        let many = run(&four_bars(n), &[&format!("simulation.formulation={formulation}")]);
        assert_eq!(many.times, single.times);
        for k in 0..=n {
            for (name, shift) in [("x", k as f64), ("y", 0.0)] {
                let (ours, theirs) = (column(&many, &format!("{name}{k}")), column(&single, &format!("{name}0")));
                for ((t, ours), theirs) in many.times.iter().zip(ours).zip(theirs) {
                    let off = (ours - shift - theirs).abs();
                    assert!(off < 1e-9, "{formulation}, {name}{k} at {t}: off by {off:e}");
                }
            }
        }
    }
}

/// Four-bars that hang on one carrier, which hangs on a hinge.
fn hung(n: usize) -> String {
    let mut text = scene("joints", 9.81, "t_end = 0.1");
    let moments = [1e-3, 2e-3];
    text += &body("carrier", [0.0, 0.0], 0.0, 10.0, [1.0, 2.0]);
    text += &pin("main", ["ground", "carrier"], [0.0, 0.5]);
    for k in 0..n {
        let [crank, rod, rocker] = ["crank", "rod", "rocker"].map(|name| format!("{name}{k}"));
        text += &body(&crank, [0.3, -0.15], 0.0, 0.2, moments);
        text += &body(&rod, [0.5, -0.275], 0.0, 0.2, moments);
        text += &body(&rocker, [0.7, -0.125], 0.0, 0.2, moments);
        text += &pin(&format!("a{k}"), ["carrier", &crank], [0.3, 0.0]);
        text += &pin(&format!("b{k}"), [&crank, &rod], [0.3, -0.3]);
        text += &pin(&format!("c{k}"), [&rod, &rocker], [0.7, -0.25]);
        text += &pin(&format!("d{k}"), [&rocker, "carrier"], [0.7, 0.0]);
        text += &output(&format!("x{k}"), &rod, 0.0, "x");
        text += &output(&format!("y{k}"), &rod, 0.0, "y");
    }
    text
}

/// None of their loops meets another before the carrier they hang on, and in other coordinates they move alike.
#[test]
fn many_loops_on_one_body_take_work_like_their_number() {
    let joint = &["simulation.formulation=joint"];
    let operations = |n: usize| {
        let mut session = open_text(&hung(n), joint);
        let mut form = session.formulation("interpreted").unwrap_or_else(|error| panic!("{error}"));
        form.programs().iter().filter(|used| !used.spare).map(|used| used.program.operations()).sum::<usize>()
    };
    let [few, more, many] = [10, 20, 40].map(operations);
    assert!((many - more).abs_diff(2 * (more - few)) * 50 <= many - more, "{few} {more} {many}");
    let (ours, theirs) = (run(&hung(12), joint), run(&hung(12), &["simulation.formulation=cartesian"]));
    for name in ["x0", "y0", "x11", "y11"] {
        for (ours, theirs) in column(&ours, name).iter().zip(column(&theirs, name)) {
            assert!(
                (ours - theirs).abs() < 1e-8,
                "{name}: {ours} in coordinates of joints, {theirs} in those of bodies"
            );
        }
    }
}

/// A chain of rods of 1 kg between two supports, its ends pinned: on an arc of a circle at first.
fn hanging(n: usize, length: f64, span: f64) -> String {
    let mut text = scene("joints", 9.81, "t_end = 1");
    // n chords of a circle, one turned against the next by `turn`.
    let reach = |turn: f64| length * (0.5 * n as f64 * turn).sin() / (0.5 * turn).sin();
    let turn = bisected(1e-6, std::f64::consts::TAU / n as f64, |turn| reach(turn) - span);
    let angle = |k: usize| (k as f64 - 0.5 * (n - 1) as f64) * turn;
    let (mut x, mut y) = (0.0, 0.0);
    for k in 0..n {
        let along = [0.5 * length * angle(k).cos(), 0.5 * length * angle(k).sin()];
        let name = format!("rod{k}");
        let moment = length * length / 12.0;
        text += &body(&name, [x + along[0], y + along[1]], angle(k), 1.0, [0.1 * moment, moment]);
        let before = if k == 0 { "ground".to_string() } else { format!("rod{}", k - 1) };
        text += &pin(&format!("pin{k}"), [&before, &name], [x, y]);
        text += &output(&format!("x{k}"), &name, 0.0, "x");
        text += &output(&format!("y{k}"), &name, 0.0, "y");
        (x, y) = (x + 2.0 * along[0], y + 2.0 * along[1]);
    }
    text + &pin("end", [&format!("rod{}", n - 1), "ground"], [x, y])
}

/// With the horizontal pull H and the weight w of a rod, the moments about the ends of rod k give tan = (V_k + V_{k+1}) / 2 H with
/// V_k = w (k - n / 2): a catenary of rods.
#[test]
fn a_long_chain_between_two_supports_hangs_as_a_catenary_of_rods() {
    let (n, length, span) = (60, 0.05, 2.0);
    let session = open_text(&hanging(n, length, span), &[]);
    let found = equilibrium(&session, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(found.stability, Stability::Undamped);
    let slope = |pull: f64, k: usize| 9.81 * (k as f64 + 0.5 - 0.5 * n as f64) / pull;
    let along = |pull: f64, k: usize| length / slope(pull, k).hypot(1.0);
    let pull = bisected(1e-3, 1e6, |pull| span - (0..n).map(|k| along(pull, k)).sum::<f64>());
    let (mut x, mut y) = (0.0, 0.0);
    for k in 0..n {
        let step = [along(pull, k), along(pull, k) * slope(pull, k)];
        for (name, exact) in [("x", x + 0.5 * step[0]), ("y", y + 0.5 * step[1])] {
            let value = found.outputs.iter().find(|one| one.name == format!("{name}{k}")).unwrap().value;
            assert!((value - exact).abs() < 1e-9, "{name}{k}: {value} is not {exact}");
        }
        (x, y) = (x + step[0], y + step[1]);
    }
}

/// A cantilever of 1 m, 1 kg and E I = 1 N m^2 along x: so many beams with the mass at their ends.
fn cantilever(n: usize, gravity: f64, settings: &str) -> String {
    let mut text = scene("forces", gravity, settings);
    let length = 1.0 / n as f64;
    for k in 1..=n {
        let mass = if k < n { length } else { 0.5 * length };
        let moment = mass * length * length / 12.0;
        text += &body(&format!("b{k}"), [k as f64 * length, 0.0], 0.0, mass, [moment, moment]);
        let before = if k == 1 { "ground".to_string() } else { format!("b{}", k - 1) };
        let _ = write!(
            text,
            "[[force]]\nname = \"beam{k}\"\ntype = \"beam\"\nbodies = [\"{before}\", \"b{k}\"]\n\
             frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]\n\
             params = {{ length = {length:?}, young = 1e3, shear = 400, area = 1, iy = 1e-3, iz = 1e-3, torsion = 1e-3, \
             damping_time = 1e-5 }}\n"
        );
    }
    text + &output("tip", &format!("b{n}"), 0.0, "y")
}

/// Weights P at x bend the tip by P x^2 (3 L - x) / 6 E I; beams between them are exact.
#[test]
fn a_cantilever_of_many_beams_bends_under_its_weight_as_it_should() {
    let (n, gravity) = (30, 1e-4);
    let session = open_text(&cantilever(n, gravity, "t_end = 1"), &[]);
    let found = equilibrium(&session, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let bent = |k: usize| {
        let (x, weight) = (k as f64 / n as f64, if k < n { gravity / n as f64 } else { 0.5 * gravity / n as f64 });
        weight * x * x * (3.0 - x) / 6.0
    };
    let exact = -(1..=n).map(bent).sum::<f64>();
    let tip = found.outputs[0].value;
    assert!((tip / exact - 1.0).abs() < 1e-7, "{tip:e} is not {exact:e}");
    // Under the same load the continuous beam bends by w L^4 / 8 E I.
    assert!((tip / (-gravity / 8.0) - 1.0).abs() < 1.0 / (n * n) as f64, "{tip:e}");
}

/// Entries of the exact Jacobian at the start, in coordinates that are chosen.
fn entries(text: &str) -> usize {
    let mut session = open_text(text, &[]);
    let mut form = session.formulation("interpreted").unwrap_or_else(|error| panic!("{error}"));
    form.offer_jacobian(&session.equations);
    form.set_discrete(&session.assembly.references, &session.assembly.discrete);
    let mut state = vec![0.0; form.groups().len()];
    form.state_of(&session.assembly.working, &mut state);
    let mut count = 0;
    assert!(form.jacobian(0.0, &state, &mut |_, _, _| count += 1).unwrap());
    count
}

/// What implicit methods take of a beam does not grow with the number of others.
#[test]
fn derivatives_of_many_beams_grow_like_their_number() {
    let [few, more, many] = [10, 20, 40].map(|n| entries(&cantilever(n, 0.0, "t_end = 1")));
    // Some are zero for a beam that is straight.
    assert!((many - more).abs_diff(2 * (more - few)) * 50 <= many - more, "{few} {more} {many}");
}

/// Released from straight, the tip swings with the first frequency of the beam, 3.516 / s, and higher ones that are known, too. With the
/// mass at the nodes it is slower, by an error of order 1 / n^2.
#[test]
fn a_cantilever_of_many_beams_swings_as_the_continuous_one() {
    // Modes of the continuous beam: b with cos b cosh b = -1, frequency b^2, and the share of each in the deflection.
    let roots = [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613, 10.995_540_734_875_467];
    let swing = |t: f64| {
        let part = |(k, b): (i32, &f64)| {
            // The shape of unit norm is 2 (-1)^k at the tip, and its integral is 2 r / b.
            let r = (b.cosh() + b.cos()) / (b.sinh() + b.sin());
            (-1.0_f64).powi(k) * 4.0 * r / b.powi(5) * (1.0 - (b * b * t).cos())
        };
        -1e-4 * (0..).zip(&roots).map(part).sum::<f64>()
    };
    for n in [10, 20] {
        let settings = "t_end = 1.8\ntolerance = 1e-6\nmethod = \"radau5\"";
        let report = run(&cantilever(n, 1e-4, settings), &[]);
        for (t, tip) in report.times.iter().zip(column(&report, "tip")) {
            let off = (tip - swing(*t)).abs() / 2.5e-5 * (n * n) as f64;
            assert!(off < 2.6, "{n} beams at {t}: off by {off} / n^2 of the peak");
        }
    }
}

/// Stability holds an explicit method to steps of 3e-5 s; dense matrices of 960 unknowns would cost more than these.
#[test]
fn the_choice_of_the_method_knows_what_matrices_of_many_beams_take() {
    let text = |method: &str| cantilever(80, 1e-4, &format!("t_end = 0.2\ntolerance = 1e-6\nmethod = \"{method}\""));
    let [chosen, implicit] = ["auto", "radau5"].map(|method| run(&text(method), &[]));
    assert!(chosen.summary.stiff_from.is_some_and(|t| t < 0.05), "{:?}", chosen.summary.stiff_from);
    assert!(chosen.summary.evaluations < 2 * implicit.summary.evaluations);
    for (ours, theirs) in column(&chosen, "tip").iter().zip(column(&implicit, "tip")) {
        assert!((ours - theirs).abs() < 1e-9, "{ours:e} {theirs:e}");
    }
}

/// Their matrices are dense, so that work grows no faster than the square of the number of rods only if a matrix serves for many steps.
#[test]
fn factors_of_long_chains_are_few() {
    let share_of_steps = |n: usize| {
        let text = chain(n, false);
        let report = run(&text, &["simulation.method=radau5", "simulation.tolerance=1e-6", "simulation.t_end=2 s"]);
        let explicit = run(&text, &["simulation.tolerance=1e-9", "simulation.t_end=2 s"]);
        for name in ["x", "y"] {
            let off = difference(column(&report, name), column(&explicit, name));
            assert!(off < 1e-6, "{n}, {name}: off by {off:e}");
        }
        report.summary.newton_factorisations as f64 / report.summary.steps as f64
    };
    let [short, long] = [20, 120].map(share_of_steps);
    assert!(long < 0.25 * short, "{long} {short}");
}

/// A chain of rods of 1 kg that is released along x, or hangs still.
fn chain(n: usize, hangs: bool) -> String {
    let mut text = scene("joints", 9.81, if hangs { "t_end = 0.01" } else { "t_end = 0.2" });
    let (angle, along) = if hangs { (-std::f64::consts::FRAC_PI_2, [0.0, -1.0]) } else { (0.0, [1.0, 0.0]) };
    for k in 0..n {
        let name = format!("rod{k}");
        text += &body(&name, along.map(|share| share * (k as f64 + 0.5)), angle, 1.0, [0.01, 1.0 / 12.0]);
        let before = if k == 0 { "ground".to_string() } else { format!("rod{}", k - 1) };
        text += &pin(&format!("pin{k}"), [&before, &name], along.map(|share| share * k as f64));
    }
    text + &output("x", &format!("rod{}", n - 1), 0.5, "x") + &output("y", &format!("rod{}", n - 1), 0.5, "y")
}

/// The first asks for the coordinates of joints alone; the other, which starts at rest, for those of bodies later.
#[test]
fn long_trees_run_alike_whether_all_of_their_equations_are_written_at_once_or_not() {
    for hangs in [false, true] {
        let scratch = Scratch::new();
        let path = scratch.file("scene.toml", chain(500, hangs));
        let [whole, lean] = [false, true].map(|runs_only| {
            let options = RunOptions { runs_only, ..options(&[], &[]) };
            let session = Session::open(&path, &options).unwrap_or_else(|error| panic!("{error}"));
            let nodes = session.equations.graph.len();
            (nodes, session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}")))
        });
        assert!(10 * lean.0 < 6 * whole.0, "{} of {} nodes", lean.0, whole.0);
        assert_eq!(whole.1.summary.evaluations, lean.1.summary.evaluations);
        assert_eq!(whole.1.columns, lean.1.columns);
    }
}

/// Slider-cranks on one shaft: the rows of all loops wait for its angle, and then each has an entry with every other.
#[test]
fn many_loops_through_one_coordinate_are_not_written_in_it() {
    let chosen = |n: usize| {
        let mut text = scene("odyn-joints", 0.0, "t_end = 1");
        text += &body("shaft", [0.0, 0.0], 0.0, 5.0, [0.5, 0.5]);
        text += &pin("bearing", ["ground", "shaft"], [0.0, 0.0]);
        for k in 0..n {
            let turn = std::f64::consts::TAU * k as f64 / n as f64;
            let (x, y) = (0.1 * turn.cos(), 0.1 * turn.sin());
            let along = (0.25 - y * y).sqrt();
            let (rod, slider) = (format!("rod{k}"), format!("slider{k}"));
            text += &body(&rod, [x + 0.5 * along, 0.5 * y], -(y / along).atan(), 1.0, [0.01, 0.01]);
            text += &body(&slider, [x + along, 0.0], 0.0, 1.0, [0.01, 0.01]);
            text += &pin(&format!("crank{k}"), ["shaft", &rod], [x, y]);
            text += &pin(&format!("wrist{k}"), [&rod, &slider], [x + along, 0.0]);
            writeln!(
                text,
                "[[joint]]\nname = \"guide{k}\"\ntype = \"translational\"\nbodies = [\"ground\", \"{slider}\"]\n\
                 point = [{:?}, 0, 0]\naxis = [1, 0, 0]",
                x + along
            )
            .unwrap();
        }
        open_text(&text, &[]).plan_report().formulation
    };
    assert_eq!((chosen(8).as_str(), chosen(60).as_str()), ("joint", "cartesian"));
}

/// A chain of links on ball joints between two points 0.8 of its length apart, along an arc of a circle, at rest.
fn hung_at_both_ends(n: usize) -> String {
    let length = 1.0 / n as f64;
    // Half the angle of the arc, on which the links are chords.
    let half = bisected(0.01, 3.1, |half| length * half.sin() / (half / n as f64).sin() - 0.8);
    let radius = 0.5 * length / (half / n as f64).sin();
    let along = |k: f64| half * (2.0 * k / n as f64 - 1.0);
    let place = |k: usize| [0.4 + radius * along(k as f64).sin(), radius * (half.cos() - along(k as f64).cos())];
    let mut text = scene("joints", 9.81, "t_end = 1\nformulation = \"cartesian\"");
    let joint = |name: &str, bodies: [&str; 2], [x, y]: [f64; 2]| {
        format!("[[joint]]\nname = \"{name}\"\ntype = \"spherical\"\nbodies = {bodies:?}\npoint = [{x:?}, {y:?}, 0]\n")
    };
    let inertia = length.powi(3);
    for k in 0..n {
        let (from, to) = (place(k), place(k + 1));
        let before = if k == 0 { "ground".to_string() } else { format!("link{}", k - 1) };
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        text += &body(&format!("link{k}"), middle, along(k as f64 + 0.5), length, [1e-3 * inertia, inertia / 12.0]);
        text += &joint(&format!("ball{k}"), [&before, &format!("link{k}")], from);
    }
    text + &joint("end", [&format!("link{}", n - 1), "ground"], place(n))
}

#[test]
fn a_step_that_is_too_long_is_no_singular_position() {
    let summary = run(&hung_at_both_ends(80), &[]).summary;
    // Stages of the first attempt are off the joints by more than the chain's size: nothing is factored with care for them.
    let rank_safe = summary.recoveries[Remedy::RankSafe];
    assert!(summary.rejected > 0 && rank_safe == 0, "{} {rank_safe}", summary.rejected);
    let audit = summary.audit;
    assert!(audit.energy_error_relative < 1e-7 && audit.position_violation < 1e-12, "{audit:?}");
}

/// So many parallelograms below each other, each on the coupler of the one above: they hang, and gravity is oblique.
fn tower(n: usize, settings: &str) -> String {
    let mut text = scene("joints", 9.81, settings).replace("[0, -", "[1, -");
    let (mut above, mut axes) = ("ground".to_string(), String::new());
    for k in 0..n {
        let (top, below) = (-(k as f64), -(k as f64) - 1.0);
        let [left, right, coupler] = ["left", "right", "coupler"].map(|name| format!("{name}{k}"));
        for (name, place) in [(&left, [0.0, top - 0.5]), (&right, [1.0, top - 0.5]), (&coupler, [0.5, below])] {
            text += &body(name, place, 0.0, 1.0, [0.01, 0.01]);
        }
        for (link, x) in [(&left, 0.0), (&right, 1.0)] {
            axes += &pin(&format!("{link}_top"), [&above, link], [x, top]);
            axes += &pin(&format!("{link}_end"), [link, &coupler], [x, below]);
        }
        above = coupler;
    }
    text + &axes + &output("end", &above, 0.0, "x")
}

/// Pivots of loops in a row fall with the fourth power of their number: to 6e-9 of 120 of them, which all the same are no closer to
/// dependent than a few are.
#[test]
fn many_loops_in_a_row_are_eliminated() {
    let settings = "t_end = 0.2\ntolerance = 1e-8\nformulation = \"cartesian\"";
    let long = run(&tower(120, settings), &[]);
    let audit = &long.summary.audit;
    assert_eq!(long.summary.recoveries[Remedy::RankSafe], 0);
    assert!(audit.energy_error_relative < 1e-9 && audit.position_violation < 1e-12, "{audit:?}");
    // Of the first swing all but the lowest ones know nothing of how many there are above them.
    let short = run(&tower(60, &settings.replace("cartesian", "joint")), &[]);
    let off = difference(column(&long, "end"), column(&short, "end"));
    assert!(off < 1e-7, "{off:e}");
}

/// Where elimination is not used at all, every evaluation would factor a dense matrix.
#[test]
fn many_loops_that_are_not_eliminated_are_written_in_coordinates_of_joints() {
    let chosen = |without: &str| {
        let settings = format!("t_end = 1\nwithout = [{without}]");
        open_text(&tower(95, &settings), &[]).plan_report().formulation
    };
    assert_eq!([chosen(""), chosen("\"row-choice\"")], ["cartesian", "joint"]);
}
