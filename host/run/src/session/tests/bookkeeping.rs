//! Memory between steps, stopping, sinks, exit codes.

use super::super::samplings::Rows;
use super::super::simulation::Simulation;
use super::*;
use crate::analysis::WorkingForm;
use crate::diagnostics::{Code, codes};
use crate::integrate::{self, IntegrateError, Options, Span};

/// A stone thrown upwards, with a tally on it.
fn thrown() -> String {
    settings("gravity = [0, -10, 0]; t_end = 1; output_step = 0.05")
        + "[[body]]\nname = \"stone\"\nmass = 1\ninertia = [1, 1, 1]\nvelocity = [0, 5, 0]\n\
           [[force]]\nname = \"tally\"\ntype = \"tally\"\nbodies = [\"stone\"]\n"
        + &output("steps", "quantity = \"value\"; of = \"tally\"; channel = \"steps\"")
        + &output("top", "quantity = \"value\"; of = \"tally\"; channel = \"top\"")
        + &output("y", "quantity = \"position\"; of = \"stone\"; component = \"y\"")
}

#[test]
fn memory_changes_once_per_accepted_step() {
    let report = run(&thrown().replace("t_end = 1", "t_end = 1\nmax_step = 0.013"));
    let steps = column(&report, "steps");
    assert_eq!(steps[0], 0.0);
    assert!(steps.windows(2).all(|pair| pair[0] <= pair[1] && pair[1].fract() == 0.0));
    // The last sample is taken before its own step is accepted.
    assert_eq!(*steps.last().unwrap(), (report.summary.steps - 1) as f64);
    let (top, y) = (column(&report, "top"), column(&report, "y"));
    // The highest end of a step is next to the highest point, 1.25 m after 0.5 s.
    assert!((1.25 - top.last().unwrap()).abs() < 0.5 * 10.0 * 0.013_f64.powi(2));
    assert!(y.iter().zip(top).all(|(y, top)| *top <= 1.25 && *y <= 1.25));
}

#[test]
fn a_run_can_be_stopped_between_steps() {
    let stop = Arc::new(AtomicBool::new(false));
    let text = thrown().replace("t_end = 1", "t_end = 1\nmax_step = 0.01");
    let mut told = Vec::new();
    let flag = Arc::clone(&stop);
    let progress = |share: f64| {
        told.push(share);
        flag.store(share > 0.3, Ordering::Relaxed);
    };
    let report = open(&text).run(None, Box::new(progress), &stop).unwrap();
    assert!(told.is_sorted() && told.iter().filter(|share| **share > 0.3).count() == 1, "no step after the wish");
    assert_eq!((report.summary.status, report.summary.code), (Status::StoppedEarly, Some(codes::INTERRUPTED)));
    assert_eq!((report.exit_code(), report.summary.t_end_reached), (130, *told.last().unwrap()));
    // All samples up to there, valid ones.
    assert_eq!(report.times.len(), 7, "{:?}", report.times);
    assert!(off(&report, "y", |t| 5.0 * t - 5.0 * t * t) < 1e-12);
}

#[test]
fn progress_ends_at_one() {
    let mut told = 0.0;
    open(&thrown()).run(None, Box::new(|share| told = share), &Arc::default()).unwrap();
    assert_eq!(told, 1.0);
}

/// Full after three rows.
struct Disk<'a>(&'a mut Vec<(usize, usize)>);

impl Sink for Disk<'_> {
    fn sample(&mut self, number: usize, values: &[f64]) -> std::io::Result<()> {
        self.0.push((number, values.len()));
        if number == 3 { Err(std::io::Error::other("the disk is full")) } else { Ok(()) }
    }
}

#[test]
fn a_sink_that_fails_ends_the_run() {
    let Session { mut model, mut equations, plan, assembly, .. } = open(&thrown());
    let length = assembly.scales.length;
    let form = WorkingForm::new(&equations, &mut model, &plan, length).unwrap();
    let mut taken = Vec::new();
    let rows = Rows::Sent(Box::new(Disk(&mut taken)));
    let mut system =
        Simulation::new(&mut equations, &model, &plan.layout, &assembly, Box::new(form), 1e-8, rows).unwrap();
    let mut state = system.start(0.0, &assembly).unwrap();
    system.watch(0.0, &state).unwrap();
    let times: Vec<f64> = (0..=10).map(|k| 0.1 * f64::from(k)).collect();
    let span = Span { t_start: 0.0, t_end: 1.0, sample_times: &times };
    let mut method = integrate::by_name("auto").unwrap();
    let error = method.integrate(&mut system, &mut state, &span, &Options::default()).unwrap_err();
    let IntegrateError::System { cause, .. } = error else { panic!("{error}") };
    assert_eq!(cause.to_string(), "the disk is full");
    drop(system);
    assert_eq!(taken, [(0, 3), (1, 3), (2, 3), (3, 3)], "and no sample after it");
}

#[test]
fn samples_do_not_steer_the_steps() {
    let counters = |step: &str| {
        let report = run(&scenes::tangle().replace("output_step = 0.1", &format!("output_step = {step}")));
        (report.summary.steps, report.summary.evaluations, report.times.len())
    };
    let (few, many) = (counters("0.5"), counters("0.002"));
    assert_eq!((few.0, few.2, many.0, many.2), (many.0, 3, few.0, 501));
}

#[test]
fn velocities_and_energies_in_coordinates_of_joints_are_those_of_the_bodies() {
    let with = |keys: &str| run(&scenes::tangle().replace("t_end = 1", &format!("t_end = 1\n{keys}")));
    let plain = with("formulation = \"joint\"; without = [\"audit\"]".replace("; ", "\n").as_str());
    let report = with("formulation = \"joint\"");
    assert_eq!((&report.times, &report.columns), (&plain.times, &plain.columns));
    assert_eq!((report.summary.steps, report.summary.evaluations), (plain.summary.steps, plain.summary.evaluations));
    let (a, b) = (&report.summary.audit, &plain.summary.audit);
    assert!(b.largest_energy() > 0.0);
    for (a, b) in [(a.kinetic_energy, b.kinetic_energy), (a.potential_energy, b.potential_energy), (a.work, b.work)] {
        assert!((a - b).abs() < 1e-12 * report.summary.audit.largest_energy(), "{a:e} {b:e}");
    }
}

#[test]
fn a_step_limit_ends_a_run_with_what_it_has() {
    let report = run(&scenes::tangle().replace("t_end = 1", "t_end = 1\nmax_steps = 3\nmax_step = 0.06"));
    assert_eq!((report.summary.status, report.summary.code), (Status::StoppedEarly, Some(codes::TOO_MANY_STEPS)));
    assert_eq!((report.exit_code(), report.summary.steps + report.summary.rejected), (Exit::Integration as i32, 3));
    assert_eq!(report.times.len() as u64, report.summary.rows);
    assert!(report.summary.t_end_reached <= 0.18 && report.summary.t_end_reached > 0.0);
}

#[test]
fn every_method_takes_steps_of_one_size_when_asked_to() {
    let reference = run(&thrown());
    for method in crate::integrate::names() {
        let report =
            run(&thrown().replace("t_end = 1", &format!("t_end = 1\nmethod = \"{method}\"\nfixed_step = 0.04")));
        assert_eq!((report.summary.steps, report.summary.rejected), (25, 0), "{method}");
        let (y, exact) = (&report.columns[2], &reference.columns[2]);
        let off = y.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{method} {off:e}: a parabola");
    }
}

#[test]
fn an_audit_above_its_limit_is_an_exit_code() {
    let text = scenes::tangle().replace("t_end = 1", "t_end = 1\ntolerance = 1e-3\naudit_tolerance = 1e-12");
    let report = run(&text);
    assert_eq!((report.summary.status, report.exit_code()), (Status::Suspect, Exit::Audit as i32));
    assert_eq!(run(&text.replace("1e-12", "1e-1")).exit_code(), 0);
}

#[track_caller]
fn refused(text: &str) -> (Exit, Code) {
    let opened = Session::with_catalog(scene(text), Vec::new(), &catalog(), &RunOptions::default());
    let error = match opened {
        Err(error) => error,
        Ok(session) => session.run(None, Box::new(|_| ()), &Arc::default()).unwrap_err(),
    };
    (error.exit, error.diagnostics[0].code)
}

#[test]
fn what_cannot_run_says_why_with_its_exit_code() {
    let pendulum = |keys: &str| scenes::pendulum(&settings(&format!("t_end = 1; output_step = 0.1; {keys}")));
    assert_eq!(refused(&pendulum("method = \"eulr\"")), (Exit::Scene, codes::UNKNOWN_METHOD));
    assert_eq!(refused(&pendulum("engine = \"steam\"")), (Exit::Scene, codes::UNKNOWN_METHOD));
    assert_eq!(refused(&pendulum("method = \"rk4\"")), (Exit::Scene, codes::UNKNOWN_METHOD));
    assert_eq!(refused(&pendulum("").replace("\"hinge\"", "\"forgetful\"")), (Exit::Plugin, codes::PLUGIN_MISBEHAVED));
    // A joint far from where the body is: assembly would throw it.
    let torn = pendulum("").replace("point = [0, 0, 0]\naxis = [0, 0, 1]", "frames = [{ position = [9, 0, 0] }, {}]");
    assert_eq!(refused(&torn), (Exit::Assembly, codes::ASSEMBLY_JUMP));
    let far = "[[joint]]\nname = \"far\"\ntype = \"ball\"\nbodies = [\"ground\", \"rod\"]\n\
               frames = [{ position = [0, 9, 0] }, { position = [0.5, 0, 0] }]\n";
    assert_eq!(refused(&(pendulum("") + far)), (Exit::Assembly, codes::CANNOT_ASSEMBLE));
}

/// At the start and later.
#[test]
fn a_library_that_fails_has_one_exit_code() {
    let text = scenes::pendulum(&settings("t_end = 1; output_step = 0.1"));
    let opened = |after: usize| {
        let force = format!("[[force]]\nname = \"it\"\ntype = \"fails\"\nbodies = [\"rod\"]\nparams.after = {after}\n");
        let scene = scene(&(text.clone() + &force));
        Session::with_catalog(scene, Vec::new(), &catalog(), &RunOptions::default())
    };
    // Elements are evaluated before a run, too.
    let least = (0..100).find(|after| opened(*after).is_ok()).unwrap();
    let fails = |after: usize| opened(after).unwrap().run(None, Box::new(|_| ()), &Arc::default()).unwrap_err();
    let is_at_start = |error: &SessionError| error.diagnostics[0].message.contains("failed at t = 0 s");
    let first = (least..least + 100).map(fails).find(is_at_start).unwrap();
    let later = fails(least + 100);
    for error in [&first, &later] {
        assert_eq!((error.exit, error.diagnostics[0].code), (Exit::Plugin, codes::PLUGIN_PANICKED), "{error}");
    }
    assert!(!is_at_start(&later), "{later}");
}

#[test]
fn reports_before_the_run_count_what_the_plan_found() {
    let session = open(&scenes::four_bar(1.1));
    let check = session.check_report();
    assert_eq!((check.bodies, check.joints, check.forces, check.rows), (3, 4, 0, 20));
    assert_eq!((check.rank, check.mobility, check.redundant_rows.len()), (17, 1, 3));
    assert!(check.moved_bodies.is_empty() && check.non_unique_reactions.len() == 8);
    let first = &check.non_unique_reactions[0];
    assert_eq!((first.joint.as_str(), first.on.as_str()), ("A", "ground"));
    assert_eq!(first.components, ["force z", "torque x", "torque y"]);
    let plan = session.plan_report();
    assert_eq!(plan.islands.len(), 1);
    assert!(plan.operations_distinct < plan.operations_requested && plan.operations_per_evaluation > 0);
    assert!(plan.opaque.is_empty());
    assert_eq!(open(&scenes::opaque_tangle()).plan_report().opaque.len(), 3);
}

#[test]
fn of_many_bodies_the_plan_names_some() {
    let mut text = settings("gravity = [0, -10, 0]; t_end = 1; output_step = 1");
    for k in 0..20 {
        let before = if k == 0 { "ground".to_string() } else { format!("b{}", k - 1) };
        let reach = if k == 0 { -0.5 } else { 0.5 };
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{k}, 0, 0]\n\
             [[joint]]\nname = \"j{k}\"\ntype = \"ball\"\nbodies = [\"{before}\", \"b{k}\"]\n\
             frames = [{{ position = [{reach}, 0, 0] }}, {{ position = [-0.5, 0, 0] }}]\n"
        );
    }
    let plan = open(&text).plan_report();
    let names = "b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, ..., b19";
    assert_eq!(plan.islands, [format!("20 bodies ({names}), 20 elements, 0 closed loops")]);
}

#[test]
fn numbers_too_coarse_for_the_tolerance_are_told() {
    let far = |x: f64, tolerance: f64| {
        let text = format!(
            "[simulation]\nt_end = 1\noutput_step = 1\ntolerance = {tolerance:e}\n[[body]]\nname = \"near\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\n\
             [[body]]\nname = \"far\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\nposition = [{x:e}, 0, 0]\n"
        );
        let moved = text.replace("name = \"near\"\n", &format!("name = \"near\"\nposition = [{x:e}, 1, 0]\n"));
        open(&moved).warnings
    };
    assert!(far(1e5, 1e-10).is_empty() && far(1e7, 1e-8).is_empty());
    let warnings = far(1e6, 1e-10);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert_eq!(warnings[0].code, "ODY0508");
    let help = warnings[0].help.join(" ");
    assert!(warnings[0].message.contains("`near`") && help.contains("4e-10"), "{:?}", warnings[0]);
}
