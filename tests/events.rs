//! Steps end where equations switch: results at least as accurate, found by less work, in both coordinates and by all engines.

use odyn::results::{Remedy, Status, Summary};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, difference, leg, open_text, options, root};

#[track_caller]
fn run(scene: &str, sets: &[&str]) -> RunReport {
    let path = root().join(format!("scenes/verification/{scene}.toml"));
    let session = Session::open(&path, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"));
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The largest error of the scene's checks in their tolerances.
fn worst(summary: &Summary) -> f64 {
    summary.checks.iter().map(|check| check.largest / check.tolerance).fold(0.0, f64::max)
}

const WITHOUT: &str = "simulation.without=[\"events\"]";

/// Scene, method, share of the evaluations that are left at most, and how often the largest error may be that without.
const SAVED: [(&str, &str, f64, f64); 6] = [
    ("bump-stop", "dop853", 0.7, 1.0),
    ("bump-stop", "dopri5", 0.95, 0.1),
    ("bump-stop", "radau5", 0.96, 1.0),
    ("integral", "dop853", 0.6, 1.0),
    ("integral", "radau5", 0.86, 0.05),
    ("pid-limits", "dop853", 0.9, 1.1),
];

#[test]
fn ending_steps_at_switches_saves_work_and_costs_no_accuracy() {
    for (scene, method, share, accuracy) in SAVED {
        let method_set = format!("simulation.method={method}");
        let (with, without) = (run(scene, &[&method_set]).summary, run(scene, &[&method_set, WITHOUT]).summary);
        let [ended, left] = [&with, &without].map(|summary| summary.recoveries[Remedy::Event]);
        assert!(ended > 0 && left == 0, "{scene} {method}: {ended} events, {left} without");
        let (ours, all) = (with.evaluations, without.evaluations);
        assert!((ours as f64) < share * all as f64, "{scene} {method}: {ours} of {all} evaluations");
        let (error, before) = (worst(&with), worst(&without));
        assert!(error <= accuracy * before, "{scene} {method}: {error:.2e} of the tolerance, without {before:.2e}");
    }
}

/// Masses on stops, and moments of inertia of a door, with which error estimates were small by chance across a switch or just beyond it:
/// by 35 to 150 tolerances.
const BY_CHANCE: [(f64, f64); 5] = [
    (3.3997806930605137, 0.20854915029697424),
    (3.8939209537263495, 7.671858207796849),
    (3.92910814807274, 0.18946754890707088),
    (0.10622540098902325, 0.2713061265208646),
    (0.7155407144114987, 0.4196929042019608),
];

#[test]
fn no_switch_is_crossed_by_chance() {
    for ((mass, inertia), formulation) in
        BY_CHANCE.into_iter().flat_map(|case| ["joint", "cartesian"].map(|formulation| (case, formulation)))
    {
        let sets = [
            format!("m={mass:?}"),
            format!("J={inertia:?}"),
            "simulation.method=\"dop853\"".into(),
            format!("simulation.formulation={formulation:?}"),
        ];
        let at = |tolerance: f64| {
            let tolerance = format!("simulation.tolerance={tolerance:e}");
            let sets: Vec<&str> = sets.iter().map(String::as_str).chain([tolerance.as_str()]).collect();
            run("bump-stop", &sets)
        };
        let exact = at(1e-13);
        for tolerance in [1e-6, 1e-8, 1e-10] {
            let report = at(tolerance);
            for name in ["x", "v", "X", "V", "phi", "u"] {
                let (ours, theirs) = (column(&report, name), column(&exact, name));
                let size = theirs.iter().fold(1.0_f64, |most, value| most.max(value.abs()));
                let off = ours.iter().zip(theirs).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / size;
                assert!(off < 15.0 * tolerance, "{mass} {inertia} {formulation} {name} {tolerance:e}: {off:e}");
            }
        }
    }
}

/// A mass on a spring whose characteristic has straight lines between many points, two of them close together, let go at one of them: most
/// steps begin just beyond a point and lead to the next or beyond it. The time from point to point is known in closed form.
#[test]
fn every_corner_of_a_characteristic_ends_a_step() {
    let mass = 2.0_f64;
    let law = |x: f64| (x, 1000.0 * x + 2e4 * x.powi(3));
    let mut points: Vec<(f64, f64)> = (1..=100).map(|k| law(f64::from(k) / 200.0)).collect();
    let (x, force) = points[19];
    points.insert(20, (x + 2e-6, force + 4e-3));
    let start = points[60].0;
    let (mut quarter, mut square) = (0.0, 0.0_f64);
    for k in (0..=60).rev() {
        let (right, left) = (points[k], if k > 0 { points[k - 1] } else { (0.0, 0.0) });
        let slope = (right.1 - left.1) / (right.0 - left.0);
        let (frequency, middle) = ((slope / mass).sqrt(), left.0 - left.1 / slope);
        let phase = |x: f64, square: f64| (square.sqrt() / frequency).atan2(x - middle);
        let next = square + (right.0 - left.0) * (right.1 + left.1) / mass;
        quarter += (phase(left.0, next) - phase(right.0, square)) / frequency;
        square = next;
    }
    let mirrored = points.iter().rev().map(|(x, force)| (-x, -force));
    let points = mirrored.chain([(0.0, 0.0)]).chain(points.iter().copied());
    let points: Vec<String> = points.map(|(x, force)| format!("[{x:?}, {force:?}]")).collect();
    let end = 21.0 * quarter;
    let text = format!(
        r#"
        plugins.libraries = ["odyn-joints", "odyn-forces"]
        simulation.t_end = {end:?}
        simulation.output_step = {end:?}
        [[body]]
        name = "mass"
        mass = {mass:?}
        particle = true
        position = [{start:?}, 0, 0]
        [[joint]]
        name = "rail"
        type = "translational"
        bodies = ["ground", "mass"]
        point = [0, 0, 0]
        axis = [1, 0, 0]
        [[force]]
        name = "spring"
        type = "translational-spring-damper"
        bodies = ["ground", "mass"]
        points = [[-1, 0, 0], [{start:?}, 0, 0]]
        params.free_length = 1
        params.stiffness = 0
        params.force_of_elongation = {{ points = [{}], interpolation = "linear" }}
        [[output]]
        name = "x"
        quantity = "position"
        of = "mass"
        component = "x"
        [[output]]
        name = "v"
        quantity = "velocity"
        of = "mass"
        component = "x"
        "#,
        points.join(", ")
    );
    let speed = square.sqrt();
    for method in ["dop853", "radau5", "radau9"] {
        for tolerance in [1e-5, 1e-6, 1e-7, 1e-8] {
            let sets = [format!("simulation.method={method:?}"), format!("simulation.tolerance={tolerance:e}")];
            let report = crate::contacts::run(&text, &sets.each_ref().map(String::as_str));
            let [x, v] = ["x", "v"].map(|name| *column(&report, name).last().unwrap());
            let off = (x / start).abs().max((v / speed + 1.0).abs());
            println!("{method} {tolerance:e}: {off:e} {}", report.summary.evaluations);
            assert!(off < 15.0 * tolerance, "{method} {tolerance:e}: {off:e}");
        }
    }
}

#[test]
fn engines_find_the_same_switches() {
    let of = |engine: &str| run("bump-stop", &[&format!("simulation.engine={engine}")]);
    let (interpreted, compiled) = (of("interpreted"), of("compiled"));
    assert!(interpreted.summary.recoveries[Remedy::Event] > 0);
    assert_eq!(interpreted.summary.recoveries[Remedy::Event], compiled.summary.recoveries[Remedy::Event]);
    assert_eq!(interpreted.columns, compiled.columns);
}

#[test]
fn coordinates_of_bodies_find_them_too() {
    let report = run("bump-stop", &["simulation.formulation=cartesian"]);
    let plain = run("bump-stop", &["simulation.formulation=cartesian", WITHOUT]);
    assert!(report.summary.recoveries[Remedy::Event] > 0 && report.summary.checks_passed());
    assert!(10 * report.summary.evaluations < 7 * plain.summary.evaluations);
}

#[test]
fn the_plan_names_what_switches() {
    let plan = |scene: &str| {
        let path = root().join(format!("scenes/verification/{scene}.toml"));
        Session::open(&path, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}")).plan_report()
    };
    let report = plan("bump-stop");
    assert_eq!(report.conditions, 4);
    assert_eq!(report.switches, ["stops (2 conditions)", "buffer (1 condition)", "door_stop (1 condition)"]);
    assert!(report.to_string().contains("switches: 4 conditions (stops (2 conditions), "));
    let smooth = plan("revolute");
    assert!(smooth.conditions == 0 && !smooth.to_string().contains("switches"));
}

#[test]
fn elements_sample_at_their_times_by_every_method() {
    for method in ["dop853", "dopri5", "radau5", "radau9", "auto"] {
        let report = run("digital-pid", &[&format!("simulation.method={method}")]);
        assert_eq!(report.summary.status, Status::Completed, "{method}: {}", report.summary.reason);
        assert!(worst(&report.summary) < 1.0, "{method}: {:?}", report.summary.checks);
    }
    // Steps of a fixed size end there, whether they fit or not.
    for (step, end) in [(0.01, 1.5), (0.03, 1.5), (0.05, 1.52), (0.3, 1.5), (0.0333333, 1.5)] {
        let [step, end] = [format!("simulation.fixed_step={step}"), format!("simulation.t_end={end}")];
        let summary = run("digital-pid", &["simulation.method=rk4", &step, &end]).summary;
        assert!(worst(&summary) < 1.0, "{step} up to {end}: {:?}", summary.checks);
    }
    // Legs end between samples and at them.
    let path = root().join("scenes/verification/digital-pid.toml");
    for (every, steps) in
        [(0.15, &[][..]), (0.3, &[]), (0.5, &[]), (0.33, &["simulation.method=rk4", "simulation.fixed_step=0.05"])]
    {
        let (folder, every) = (Scratch::new(), format!("simulation.checkpoint_every={every}"));
        let sets: Vec<&str> = steps.iter().copied().chain([every.as_str()]).collect();
        let session = Session::open(&path, &options(&sets, &[])).unwrap();
        let report = session.run(Some(folder.path()), Box::new(|_| ()), &Default::default()).unwrap();
        assert!(worst(&report.summary) < 1.0, "{sets:?}: {:?}", report.summary.checks);
        assert!(report.summary.checkpoints > 1);
    }
    let planned = Session::open(&path, &options(&[], &[])).unwrap().plan_report();
    assert_eq!(planned.sampled, ["p", "delayed", "pi", "limited"].map(|name| format!("{name} (every 0.1 s)")));
    assert!(planned.to_string().contains("limited (every 0.1 s); steps end at the samples"));
}

/// A controller that passes on what it samples of a function of time.
fn sampled(function: &str, period: f64, from: f64, times: &[f64], sets: &[&str]) -> Vec<f64> {
    let scene = format!(
        "[plugins]\nlibraries = [\"odyn-controls\"]\n[simulation]\nt_start = {from}\nt_end = {}\noutput_times = {times:?}\n\
         [[body]]\nname = \"bystander\"\nmass = 1\ninertia = [1, 1, 1]\n\
         [[control]]\nname = \"source\"\ntype = \"signal-source\"\nparams.function = {function}\n\
         [[control]]\nname = \"hold\"\ntype = \"digital-pid\"\ninputs = {{ set_point = \"source.output\" }}\n\
         params = {{ period = {period}, kp = 1 }}\n\
         [[output]]\nname = \"held\"\nquantity = \"value\"\nof = \"hold\"\nchannel = \"output\"\n",
        times.last().unwrap()
    );
    let report = open_text(&scene, sets).run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.summary.status, Status::Completed, "{}", report.summary.reason);
    column(&report, "held").to_vec()
}

const METHODS: [&str; 3] = ["simulation.method=dop853", "simulation.method=radau5", "simulation.method=dopri5"];

#[test]
fn a_run_that_starts_between_samples_begins_with_one() {
    for method in METHODS {
        let held = sampled("\"t\"", 0.1, 0.37, &[0.37, 0.39, 0.41, 0.49, 0.51], &[method]);
        for (found, expected) in held.iter().zip([0.37, 0.37, 0.4, 0.4, 0.5]) {
            assert!((found - expected).abs() < 1e-14, "{method}: {held:?}");
        }
    }
}

/// 7 * 0.1 is above 0.7, 100 * 0.29 below 29, 10 * 0.1 neither.
#[test]
fn a_jump_at_a_sampling_instant_is_sampled_after_it() {
    for (period, jump) in [(0.1, 0.7), (0.1, 1.0), (0.25, 1.0), (0.29, 29.0), (0.03, 2.67), (1.0 / 3.0, 1.0)] {
        let function = format!("{{ points = [[0, 0], [{jump}, 1]], interpolation = \"steps\" }}");
        let times = [0.0, jump - 0.5 * period, jump + 0.5 * period, jump + 1.5 * period];
        for method in METHODS {
            let held = sampled(&function, period, 0.0, &times, &[method]);
            assert_eq!(held, [0.0, 0.0, 1.0, 1.0], "{method}: every {period} s, jump at {jump} s");
        }
    }
}

#[test]
fn a_table_that_ends_with_the_run_does_not_stop_it_early() {
    let scene = "[plugins]\nlibraries = [\"odyn-controls\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
                 [[body]]\nname = \"bystander\"\nmass = 1\ninertia = [1, 1, 1]\n\
                 [[control]]\nname = \"roof\"\ntype = \"signal-source\"\n\
                 params.function = { points = [[0, 0], [0.5, 1], [1, 0]], interpolation = \"linear\" }\n\
                 [[control]]\nname = \"area\"\ntype = \"integral\"\ninputs = { input = \"roof.output\" }\n\
                 [[output]]\nname = \"area\"\nquantity = \"value\"\nof = \"area\"\nchannel = \"output\"\n";
    let folder = Scratch::new();
    let session = Session::open(&folder.file("scene.toml", scene), &options(&[], &[])).unwrap();
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!((report.summary.status, report.times.len()), (Status::Completed, 11), "{}", report.summary.reason);
    assert!((column(&report, "area")[10] - 0.5).abs() < 1e-14);
}

#[test]
fn elements_sample_once_at_each_time_however_a_run_is_taken() {
    let ends = |pieces: &[f64], sets: &[&str]| {
        let path = root().join("scenes/verification/digital-pid.toml");
        let session = Session::open(&path, &options(sets, &[])).unwrap();
        let mut run = session.prepare().unwrap().start().unwrap();
        let saved = run.save().unwrap();
        // What happened before is forgotten.
        run.advance(0.55).unwrap();
        run.restore(&saved).unwrap();
        for to in pieces {
            run.advance(*to).unwrap();
        }
        let report = run.finish().unwrap();
        assert!(worst(&report.summary) < 1.0, "{pieces:?}: {:?}", report.summary.checks);
    };
    for sets in [&[][..], &["simulation.method=rk4", "simulation.fixed_step=0.05"]] {
        ends(&[1.5], sets);
        ends(&[0.3, 0.45, 0.7, 1.5], sets);
        ends(&[0.07, 0.33, 0.99999, 1.5], sets);
    }
}

/// An integral that begins at its limit, and leaves it when the signal turns.
#[test]
fn what_rests_on_a_limit_leaves_it_by_every_method() {
    let scene = "[plugins]\nlibraries = [\"odyn-controls\"]\n[simulation]\nt_end = 1\noutput_step = 0.05\n\
                 [[body]]\nname = \"bystander\"\nmass = 1\ninertia = [1, 1, 1]\n\
                 [[control]]\nname = \"wave\"\ntype = \"state-space\"\ninputs = { input = 0 }\n\
                 params = { a = [0, 3, -3, 0], b = [0, 0], c = [1, 0], initial = [0.3, -1] }\n\
                 [[control]]\nname = \"tank\"\ntype = \"integral\"\ninputs = { input = \"wave.output\" }\n\
                 params = { initial = 1.038, high = 1.038 }\n\
                 [[output]]\nname = \"level\"\nquantity = \"value\"\nof = \"tank\"\nchannel = \"output\"\n";
    let turns = 0.3_f64.atan();
    let fallen = 0.1 * (3.0_f64.sin() - turns.sin()) + (3.0_f64.cos() - turns.cos()) / 3.0;
    for method in METHODS.into_iter().chain(["simulation.method=radau9"]) {
        let session = open_text(scene, &[method, "simulation.max_steps=1000"]);
        let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
        assert_eq!(report.summary.status, Status::Completed, "{method}: {}", report.summary.reason);
        let level = column(&report, "level")[20];
        assert!((level - 1.038 - fallen).abs() < 1e-9, "{method}: {level}");
    }
}

/// What an island has of where another run ended is all of it: elements that sample have done so there.
#[test]
fn islands_apart_continue_as_the_whole_does() {
    let mass = |name: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\n\
             [[joint]]\nname = \"rail_{name}\"\ntype = \"translational\"\nbodies = [\"ground\", \"{name}\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
             [[control]]\nname = \"pid_{name}\"\ntype = \"digital-pid\"\ninputs = {{ set_point = 1, measured = {{ signal = \"x_{name}\", gain = \"1 1/m\" }} }}\n\
             params = {{ period = 0.1, kp = 3, ki = 2, kd = 1 }}\n\
             [[force]]\nname = \"push_{name}\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"{name}\"]\n\
             inputs.x = {{ signal = \"pid_{name}.output\", gain = \"1 N\" }}\n\
             [[output]]\nname = \"x_{name}\"\nquantity = \"position\"\nof = \"{name}\"\ncomponent = \"x\"\n"
        )
    };
    let scratch = Scratch::new();
    let text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\", \"odyn-controls\"]\n[simulation]\nt_end = 1\noutput_step = 0.05\n{}{}",
        mass("a"),
        mass("b")
    );
    scratch.file("scene.toml", &text);
    let whole = leg(&scratch, "simulation.t_end = 1", "whole", None);
    leg(&scratch, "simulation.t_end = 0.5", "first", None);
    for islands in ["together", "apart"] {
        let rest = leg(&scratch, &format!("simulation.islands = \"{islands}\""), "rest", Some("first"));
        for name in ["x_a", "x_b"] {
            let off = difference(column(&rest, name), &column(&whole, name)[10..]);
            assert!(off < 1e-9, "{islands}: `{name}` differs by {off:.1e}");
        }
    }
}
