//! Islands that run apart: what each gives by itself, put together; against common steps, closed forms and numbers of threads.

use super::*;

/// A mass of 1 kg on a spring from the ground along x, at the height y, 0.1 m out at the start: x = 1 + 0.1 cos(w t).
fn oscillator(name: &str, y: f64, w: f64) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1.1, {y:?}, 0]\n\
         [[force]]\nname = \"spring_{name}\"\ntype = \"strut\"\nbodies = [\"ground\", \"{name}\"]\n\
         points = [[0, {y:?}, 0], [1.1, {y:?}, 0]]\nparams = {{ stiffness = {:?} }}\n",
        w * w
    ) + &output(&format!("x_{name}"), &format!("quantity = \"position\"; of = \"{name}\"; component = \"x\""))
}

/// A rod of 2 `half` on a hinge at x = `at`, at an angle to the vertical (rad), at rest.
fn rod(name: &str, at: f64, half: f64, angle: f64) -> String {
    let (s, c) = angle.sin_cos();
    let inertia = half * half / 3.0;
    format!(
        "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\n\
         position = [{:?}, {:?}, 0]\n[[joint]]\nname = \"pivot_{name}\"\ntype = \"hinge\"\n\
         bodies = [\"ground\", \"{name}\"]\npoint = [{at:?}, 0, 0]\naxis = [0, 0, 1]\n",
        at + half * s,
        -half * c
    ) + &output(&format!("phi_{name}"), &format!("quantity = \"coordinate\"; of = \"pivot_{name}\""))
        + &output(
            &format!("F_{name}"),
            &format!("quantity = \"reaction_force\"; of = \"pivot_{name}\"; on = \"{name}\"; component = \"y\""),
        )
}

const SWING: &str = "gravity = [0, -9.81, 0]; t_end = 2; output_step = 0.1";

/// The scene with its islands apart.
fn parted(text: &str) -> String {
    text.replacen("t_end = ", "islands = \"apart\"\nt_end = ", 1)
}

/// A scene of other tests without its settings.
fn bare(text: &str) -> &str {
    &text[text.find("[[").unwrap_or(0)..]
}

/// Largest difference of the columns of two runs, each relative to its largest value (or 1 where that is smaller).
#[track_caller]
fn differ(a: &RunReport, b: &RunReport) -> f64 {
    assert_eq!((a.summary.status, b.summary.status), (Status::Completed, Status::Completed));
    assert_eq!((&a.times, a.columns.len()), (&b.times, b.columns.len()));
    let columns = a.columns.iter().zip(&b.columns).map(|(x, y)| {
        let size = y.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        x.iter().zip(y).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs() / size))
    });
    columns.fold(0.0, f64::max)
}

#[test]
fn each_island_takes_the_steps_that_it_needs() {
    let text = settings("t_end = 10; output_step = 0.5")
        + &oscillator("slow", 0.0, 1.0)
        + &oscillator("fast", 2.0, 100.0)
        + &output("E", "quantity = \"total_energy\"");
    let (apart, together) = (run(&parted(&text)), run(&text));
    for report in [&apart, &together] {
        let slow = off(report, "x_slow", |t| 1.0 + 0.1 * t.cos());
        let fast = off(report, "x_fast", |t| 1.0 + 0.1 * (100.0 * t).cos());
        let energy = off(report, "E", |_| 0.005 * (1.0 + 1e4));
        assert!(slow < 1e-9 && fast < 2e-8 && energy < 1e-6, "{slow:e} {fast:e} {energy:e}");
    }
    // Operations of all evaluations.
    let plan = open(&parted(&text)).plan_report().apart.unwrap();
    let works = plan.islands.iter().zip(&apart.summary.islands);
    let own: u64 = works.map(|(plan, ran)| plan.operations_per_evaluation as u64 * ran.evaluations).sum();
    let common = plan.together as u64 * together.summary.evaluations;
    let evaluations = [&apart.summary.islands[0], &apart.summary.islands[1]].map(|island| island.evaluations);
    assert_eq!((evaluations, together.summary.evaluations), ([476, 46102], 46102));
    // 13 and 18 operations an evaluation, 31 together.
    assert!(10 * own < 6 * common, "{own} of {common}");
    assert_eq!(apart.summary.evaluations, evaluations.iter().sum::<u64>());
    assert_eq!(apart.summary.islands[1].bodies, ["fast"]);
    assert!(together.summary.islands.is_empty() && apart.summary.audit.worst() < 1e-8, "{:?}", apart.summary.audit);
}

#[test]
fn apart_and_together_agree_to_the_tolerance() {
    let (four_bar, tangle, opaque) = (scenes::four_bar(1.1), scenes::tangle(), scenes::opaque_tangle());
    let lever = rod("lever", 5.0, 0.3, 1.0);
    let outputs = |body: &str| {
        output("p", &format!("quantity = \"position\"; of = \"{body}\"; component = \"y\""))
            + &output("a", &format!("quantity = \"acceleration\"; of = \"{body}\"; component = \"x\""))
            + &output("K", "quantity = \"kinetic_energy\"")
            + &output("V", "quantity = \"potential_energy\"")
    };
    for (text, body) in [(&four_bar, "coupler"), (&tangle, "b"), (&opaque, "b")] {
        let text = settings(SWING) + bare(text) + &lever + &outputs(body);
        for engine in ["auto", "reference"] {
            let text = text.replacen("t_end = ", &format!("engine = \"{engine}\"\nt_end = "), 1);
            let (apart, together) = (run(&parted(&text)), run(&text));
            assert_eq!(apart.summary.islands.len(), 2);
            let off = differ(&apart, &together);
            assert!(off < 1e-8, "{body} {engine} {off:e}");
            let (a, b) = (&apart.summary.audit, &together.summary.audit);
            let stored =
                [(a.kinetic_energy, b.kinetic_energy), (a.potential_energy, b.potential_energy), (a.work, b.work)];
            assert!(stored.iter().all(|(a, b)| (a - b).abs() < 1e-7), "{a:?} {b:?}");
        }
    }
}

/// The balance of many equal islands is as good as that of one.
#[test]
fn energies_of_many_islands_are_judged_as_those_of_one() {
    let of = |count: usize| {
        let all: String = (0..count).map(|k| oscillator(&format!("m{k}"), 0.0, 10.0)).collect();
        let audit = run(&parted(&(settings("t_end = 5; output_step = 0.1") + &all))).summary.audit;
        [audit.energy_error_relative, audit.sample_energy_error_relative]
    };
    let (two, many) = (of(2), of(30));
    assert!(two[0] > 0.0 && many.iter().zip(two).all(|(many, two)| *many < 3.0 * two), "{many:?} {two:?}");
}

#[test]
fn a_resting_island_is_judged_by_the_sizes_of_the_whole_scene() {
    // Beside one that moves from the start, and beside one that is as much at rest, but for round-off.
    for angle in [1.0, 1e-9] {
        let text = settings(SWING) + &rod("still", 0.0, 0.7, 0.0) + &rod("other", 3.0, 0.01, angle);
        let report = run(&parted(&text));
        assert_eq!(report.summary.status, Status::Completed, "{:?}", report.summary.islands);
        let still = &report.summary.islands[0];
        assert!(off(&report, "phi_still", |_| 0.0) < 1e-12);
        assert!(still.steps < 20 && still.rejected == 0, "{still:?}");
        assert!(report.summary.audit.worst() < 1e-9, "{:?}", report.summary.audit);
    }
}

/// A four-bar whose crank of 1 m is driven with 1 rad/s until rocker and coupler are stretched, at cos phi = 271 / 600.
fn driven_too_far() -> String {
    let (along, up) = (2.2025, 1.5_f64.mul_add(1.5, -1.2025 * 1.2025).sqrt());
    let body = |name: &str, x: f64, y: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x:?}, {y:?}, 0]\n")
    };
    let joint = |name: &str, kind: &str, i: &str, j: &str, x: f64, y: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\n\
             point = [{x:?}, {y:?}, 0]\naxis = [0, 0, 1]\n"
        )
    };
    body("crank", 0.5, 0.0)
        + &body("coupler", 0.5 * (1.0 + along), 0.5 * up)
        + &body("rocker", 0.5 * (3.0 + along), 0.5 * up)
        + &joint("O", "hinge", "ground", "crank", 0.0, 0.0)
        + &joint("A", "hinge", "crank", "coupler", 1.0, 0.0)
        + &joint("C", "hinge", "coupler", "rocker", along, up)
        + &joint("B", "hinge", "rocker", "ground", 3.0, 0.0)
        + &joint("motor", "drive", "ground", "crank", 0.0, 0.0)
            .replace("axis = [0, 0, 1]", "axis = [0, 0, 1]\nparams = { speed = 1 }")
        + &output("phi", "quantity = \"coordinate\"; of = \"O\"")
}

#[test]
fn an_island_that_ends_early_leaves_the_results_up_to_there() {
    let text = settings("t_end = 2; output_step = 0.1; method = \"dop853\"")
        + &oscillator("good", 5.0, 3.0)
        + &driven_too_far();
    for (text, apart) in [(parted(&text), true), (text, false)] {
        let report = run(&text);
        let summary = &report.summary;
        assert_eq!((summary.status, report.exit_code()), (Status::StoppedEarly, Exit::Integration as i32));
        let end = (271.0_f64 / 600.0).acos();
        assert!((summary.t_end_reached - end).abs() < 1e-3, "{} of {end}", summary.t_end_reached);
        assert_eq!((report.times.len(), summary.rows), (12, 12), "{:?}", report.times);
        assert!(off(&report, "phi", |t| t) < 1e-9 && off(&report, "x_good", |t| 1.0 + 0.1 * (3.0 * t).cos()) < 1e-9);
        assert_eq!(summary.islands.len(), if apart { 2 } else { 0 });
        let Some([good, bad]) = summary.islands.first_chunk() else { continue };
        assert!(summary.reason.starts_with("the island of `crank`: "), "{}", summary.reason);
        assert_eq!((good.status, good.t_end_reached, bad.status), (Status::Completed, 2.0, Status::StoppedEarly));
    }
}

#[test]
fn only_the_stiff_island_goes_over_to_an_implicit_method() {
    let stiff = oscillator("stiff", 4.0, 100.0).replace("stiffness = 10000.0", "stiffness = 1e4, damping = 1e4");
    let text = settings("t_end = 10; output_step = 0.5; method = \"auto\"; tolerance = 1e-6")
        + &oscillator("slow", 0.0, 1.0)
        + &oscillator("fast", 2.0, 20.0)
        + &stiff;
    let report = run(&parted(&text));
    let implicit: Vec<bool> = report.summary.islands.iter().map(|island| island.jacobians > 0).collect();
    assert_eq!(implicit, [false, false, true], "{:?}", report.summary.islands);
    assert_eq!(report.summary.stiff_from, report.summary.islands[2].stiff_from);
    assert!(off(&report, "x_slow", |t| 1.0 + 0.1 * t.cos()) < 1e-5);
    // Overdamped: the roots of s^2 + 1e4 s + 1e4, one of them next to -1.
    let slow = (25e6_f64 - 1e4).sqrt() - 5e3;
    let fast = -1e4 - slow;
    let exact = |t: f64| 1.0 + 0.1 * (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow);
    let error = off(&report, "x_stiff", exact);
    assert!(error < 1e-5, "{error:e}");
}

fn folder(name: &str) -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("odyn-islands-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Three islands, one of them with opaque elements that count steps, one with a state and many turns.
fn mixed(t_end: f64) -> String {
    settings(&SWING.replace("t_end = 2", &format!("t_end = {t_end:?}")))
        + &rod("lever", 9.0, 0.5, 1.0)
        + bare(&scenes::opaque_tangle())
        + "[[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.2]\nangular_velocity = [0, 0, 30]\n\
           [[joint]]\nname = \"axle\"\ntype = \"hinge\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0.1, 0, 0]\naxis = [0, 0, 1]\n\
           [[force]]\nname = \"lag\"\ntype = \"lag\"\nbodies = [\"wheel\"]\nparams.tau = 2.0\n\
           [[force]]\nname = \"tally\"\ntype = \"tally\"\nbodies = [\"wheel\"]\n"
        + &output("turns", "quantity = \"coordinate\"; of = \"axle\"")
        + &output("lagging", "quantity = \"value\"; of = \"lag\"")
        + &output("b_x", "quantity = \"position\"; of = \"b\"; component = \"x\"")
        + &output("E", "quantity = \"total_energy\"")
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let files = [1, 2, 5].map(|jobs| {
        let at = folder(&format!("jobs-{jobs}"));
        let options = RunOptions { jobs, ..RunOptions::default() };
        let session = Session::with_catalog(scene(&parted(&mixed(1.0))), Vec::new(), &catalog(), &options).unwrap();
        let mut told = Vec::new();
        let report = session.run(Some(&at), Box::new(|share| told.push(share)), &Arc::default()).unwrap();
        assert_eq!((report.exit_code(), report.summary.islands.len()), (0, 3));
        assert!(told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
        let read = |name: &str| std::fs::read(at.join(name)).unwrap();
        let found = (read("results.csv"), read("state.toml"), report.summary.evaluations);
        std::fs::remove_dir_all(&at).unwrap();
        found
    });
    assert!(files[0].0.len() > 1000 && files[0].1.len() > 100);
    assert!(files[0] == files[1] && files[0] == files[2]);
}

#[test]
fn a_run_in_two_parts_ends_where_one_run_ends() {
    // The first part apart or together, the second apart.
    for first in [parted(&mixed(1.0)), mixed(1.0)] {
        let at = folder("parts");
        let whole = run(&parted(&mixed(2.0)));
        open(&first).run(Some(&at), Box::new(|_| ()), &Arc::default()).unwrap();
        let state = Restart::read(&at).unwrap();
        std::fs::remove_dir_all(&at).unwrap();
        let mut second = open(&parted(&mixed(2.0)));
        second.go_on_from(state).unwrap();
        let second = second.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        assert_eq!((second.times[0], second.summary.islands.len()), (1.0, 3));
        for name in ["phi_lever", "F_lever", "turns", "lagging", "b_x"] {
            let (one, two) = (column(&whole, name), column(&second, name));
            let off = one[10..].iter().zip(two).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs() / x.abs().max(1.0)));
            assert!(off < 1e-8, "{name} {off:e}");
        }
    }
}

#[test]
fn a_stopped_run_of_islands_has_whole_rows() {
    let stop = Arc::new(AtomicBool::new(true));
    let report = open(&parted(&mixed(2.0))).run(None, Box::new(|_| ()), &stop).unwrap();
    assert_eq!((report.summary.status, report.exit_code()), (Status::StoppedEarly, 130));
    assert!(report.columns.iter().all(|column| column.len() == report.times.len()));
    assert!(report.summary.t_end_reached < 2.0);
    let earliest = report.summary.islands.iter().map(|island| island.t_end_reached).fold(2.0, f64::min);
    assert_eq!(report.summary.t_end_reached, earliest);
}

#[test]
fn figures_and_checks_see_the_columns_of_all_islands() {
    let check = "[[check]]\nname = \"sum\"\nkind = \"position\"\nvalue = \"x_a + x_b\"\n\
                 reference = \"2 + 0.1 cos(t) + 0.1 cos(2 t)\"\ntolerance = 1e-8\n\
                 [[figure]]\nname = \"ratio\"\nchannel = \"x_a\"\ntake = \"max\"\nover = \"x_b\"\n";
    let text =
        settings("t_end = 1; output_step = 0.1") + &oscillator("a", 0.0, 1.0) + &oscillator("b", 1.0, 2.0) + check;
    let report = run(&parted(&text));
    assert!(report.summary.checks_passed() && report.summary.checks[0].samples == 11, "{:?}", report.summary.checks);
    let ratio = report.summary.figures[0].value.unwrap();
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
}

#[test]
fn mistakes_name_the_island_and_unknown_words_are_refused() {
    let text = settings(SWING) + &rod("a", 0.0, 1.0, 1.0) + &rod("b", 7.0, 1.0, 1.0);
    let method = parted(&text).replacen("t_end = ", "method = \"rk4\"\nt_end = ", 1);
    let error = open(&method).run(None, Box::new(|_| ()), &Arc::default()).unwrap_err();
    let help = &error.diagnostics[0].help;
    assert!(help.iter().any(|line| line == "in the island of `a`, which runs apart"), "{help:?}");
    let word = text.replacen("t_end = ", "islands = \"alone\"\nt_end = ", 1);
    let error =
        Session::with_catalog(scene(&word), Vec::new(), &catalog(), &RunOptions::default()).map(|_| ()).unwrap_err();
    assert_eq!(error.diagnostics[0].message, "`islands` cannot be `alone`");
}

#[test]
fn the_plan_tells_what_islands_cost_by_themselves() {
    let text = settings(SWING) + &rod("lever", 5.0, 1.0, 1.0) + bare(&scenes::tangle());
    let plan = open(&text).plan_report();
    let apart = plan.apart.clone().unwrap();
    assert_eq!((apart.chosen, apart.together), (false, plan.operations_per_evaluation));
    assert_eq!((apart.islands[0].name.as_str(), apart.islands[0].velocities), ("lever", 1));
    assert!(apart.islands[0].operations_per_evaluation < apart.islands[1].operations_per_evaluation);
    assert!(
        format!("{plan}").contains(
            "each could take steps of its own (--islands apart):\n    lever: joint coordinates, 1 velocity, "
        )
    );
    assert!(format!("{}", open(&parted(&text)).plan_report()).contains("each takes steps of its own"));
    assert_eq!(open(&scenes::pendulum("")).plan_report().apart, None);
}

#[test]
fn what_is_connected_stays_together() {
    let count = |more: &str| {
        let text = settings(SWING) + &rod("a", 0.0, 1.0, 1.0) + &rod("b", 7.0, 1.0, 1.0) + more;
        run(&parted(&text)).summary.islands.len()
    };
    assert_eq!(count(""), 2);
    let strut = "[[force]]\nname = \"s\"\ntype = \"strut\"\nbodies = [\"a\", \"b\"]\npoints = [[2, 0, 0], [7, 0, 0]]\n\
                 params = { stiffness = 1 }\n";
    assert_eq!(count(strut), 0);
    assert_eq!(count(&strut.replace("\"strut\"", "\"opaque-strut\"")), 0);
    let seen = "quantity = \"velocity\"; of = \"a\"; component = \"x\"; frame = \"b\"";
    assert_eq!(count(&output("relative", seen)), 0);
    let push = "[[force]]\nname = \"p\"\ntype = \"push\"\nbodies = [\"ground\", \"b\"]\nparams.factor = 0.1\n\
                inputs.signal = \"SIGNAL\"\n";
    let energy = output("E", "quantity = \"kinetic_energy\"");
    let control = |taken: &str| {
        format!("[[control]]\nname = \"c\"\ntype = \"amplifier\"\nparams.factor = 1\ninputs.in = {taken}\n")
    };
    assert_eq!(count(&push.replace("SIGNAL", "phi_b")), 2);
    assert_eq!(count(&push.replace("SIGNAL", "phi_a")), 0);
    assert_eq!(count(&(push.replace("SIGNAL", "c.out") + &control("\"phi_a\""))), 0);
    assert_eq!(count(&(push.replace("SIGNAL", "E") + &energy)), 0);
    // What follows time alone is computed by all that take it, and reported once.
    let both = push.replace("SIGNAL", "c.out")
        + &push.replace("SIGNAL", "c.out").replace("\"p\"", "\"q\"").replace("\"b\"", "\"a\"");
    let both = both + &control("1") + &output("seen", "quantity = \"value\"; of = \"c\"; channel = \"out\"");
    let text = settings(SWING) + &rod("a", 0.0, 1.0, 1.0) + &rod("b", 7.0, 1.0, 1.0) + &both;
    let (apart, together) = (run(&parted(&text)), run(&text));
    assert_eq!(apart.summary.islands.len(), 2);
    assert!(differ(&apart, &together) < 1e-8);
    assert!(off(&apart, "seen", |_| 1.0) < 1e-15);
    let names = |report: &RunReport| report.summary.elements.iter().map(|one| one.element.clone()).collect::<Vec<_>>();
    assert_eq!(names(&apart), names(&together));
    // Energies that are only reported, and signals that nobody takes, connect nothing.
    assert_eq!(count(&(energy + &control("1"))), 2);
}

/// A table that turns with 2 rad/s, a cup that is welded to it, a strut that follows it; and two rods that hang on it, one of them by a strut, too.
fn turntable() -> String {
    let body = |name: &str, x: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = 3\ninertia = [0.3, 0.4, 0.5]\nposition = [{x:?}, 0, 0]\n")
    };
    let on = |name: &str, at: f64, half: f64, angle: f64| rod(name, at, half, angle).replace("\"ground\"", "\"table\"");
    let strut = |name: &str, i: &str, j: &str, x: f64| {
        format!(
            "[[force]]\nname = \"{name}\"\ntype = \"strut\"\nbodies = [\"{i}\", \"{j}\"]\n\
             points = [[0, 2, 0], [{x:?}, 0, 0]]\nparams = {{ stiffness = 30 }}\n"
        )
    };
    let seen = |quantity: &str, of: &str, on: &str| {
        let on = if on.is_empty() { String::new() } else { format!("; on = \"{on}\"") };
        output(&format!("{quantity}_{of}"), &format!("quantity = \"{quantity}\"; of = \"{of}\"; component = \"y\"{on}"))
    };
    body("table", 0.2)
        + &body("cup", 1.0)
        + "[[joint]]\nname = \"pin\"\ntype = \"hinge\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
           [[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
           params = { speed = 2 }\n\
           [[joint]]\nname = \"seat\"\ntype = \"weld\"\nbodies = [\"table\", \"cup\"]\nframes = [{ position = [0.8, 0, -0.125] }, { position = [0, 0, 0], axis = [0, 0, 1], x_axis = [0, 1, 0] }]\n"
        + &on("a", 1.0, 0.4, 1.0)
        + &on("b", -1.0, 0.6, 0.5)
        + &strut("guy", "ground", "table", 0.5)
        + &strut("stay", "table", "b", -0.9)
        + &output("turn", "quantity = \"coordinate\"; of = \"pin\"")
        + &output("torque", "quantity = \"reaction_torque\"; of = \"motor\"; on = \"table\"; component = \"z\"")
        + &output("K", "quantity = \"kinetic_energy\"")
        + &output("V", "quantity = \"potential_energy\"")
        + &output("aside", "quantity = \"velocity\"; of = \"a\"; component = \"x\"; frame = \"table\"")
        + &seen("reaction_force", "pin", "table")
        + &seen("reaction_force", "seat", "cup")
        + &seen("force", "guy", "table")
        + &seen("force", "stay", "b")
        + &seen("acceleration", "cup", "")
}

/// Each island has a copy of what follows the time, with a share of its mass; what the copies bear adds up.
#[test]
fn bodies_that_follow_the_time_connect_nothing() {
    let text = settings(SWING) + &turntable();
    let (apart, together) = (run(&parted(&text)), run(&text));
    let islands: Vec<_> = apart.summary.islands.iter().map(|island| island.bodies.clone()).collect();
    assert_eq!(islands, [["a"], ["b"]]);
    let off = differ(&apart, &together);
    assert!(off < 1e-8, "{off:e}");
    let (a, b) = (&apart.summary.audit, &together.summary.audit);
    let sums = [(a.kinetic_energy, b.kinetic_energy), (a.potential_energy, b.potential_energy), (a.work, b.work)];
    assert!(sums.iter().all(|(a, b)| (a - b).abs() < 1e-7) && b.work.abs() > 1.0, "{sums:?}");
}

/// What does not add up, and what others take, holds the islands together.
#[test]
fn bodies_whose_loads_do_not_add_up_connect() {
    let count = |text: &str| run(&parted(&(settings(SWING) + text))).summary.islands.len();
    let text = turntable();
    assert_eq!(count(&text), 2);
    let magnitude =
        output("m", "quantity = \"reaction_force\"; of = \"pin\"; on = \"table\"; component = \"magnitude\"");
    assert_eq!(count(&(text.clone() + &magnitude)), 0);
    let turned =
        output("m", "quantity = \"reaction_force\"; of = \"pin\"; on = \"table\"; component = \"x\"; frame = \"a\"");
    assert_eq!(count(&(text.clone() + &turned)), 0);
    let push = "[[force]]\nname = \"p\"\ntype = \"push\"\nbodies = [\"ground\", \"b\"]\nparams.factor = 0.1\ninputs.signal = \"SIGNAL\"\n";
    assert_eq!(count(&(text.clone() + &push.replace("SIGNAL", "turn"))), 2);
    assert_eq!(count(&(text.clone() + &push.replace("SIGNAL", "torque"))), 0);
    // Without its drive the table is one of the moving bodies.
    let motor = text.find("[[joint]]\nname = \"motor\"").unwrap();
    let seat = text.find("[[joint]]\nname = \"seat\"").unwrap();
    let torque = text.find("[[output]]\nname = \"torque\"").unwrap();
    let after = torque + text[torque + 1..].find("[[output]]").unwrap() + 1;
    let free = format!("{}{}{}", &text[..motor], &text[seat..torque], &text[after..]);
    assert_eq!(count(&free), 0);
}
