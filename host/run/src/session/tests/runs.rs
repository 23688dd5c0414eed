//! Runs that are advanced, given values, asked, saved and brought back.

use super::*;
use crate::diagnostics::codes;

/// A body of 2 kg on a rail along x, pushed by an input.
fn cart(settings_text: &str) -> String {
    settings(settings_text)
        + "[[body]]\nname = \"cart\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n\
           [[joint]]\nname = \"rail\"\ntype = \"slide\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
           [[input]]\nname = \"motor.push\"\nvalue = \"0.5 kN\"\nunit = \"kN\"\n\
           [[force]]\nname = \"motor\"\ntype = \"push\"\nbodies = [\"ground\", \"cart\"]\nparams.factor = 1e-3\n\
           inputs.signal = \"motor.push\"\n"
        + &output("x", "quantity = \"position\"; of = \"cart\"; component = \"x\"")
        + &output("v", "quantity = \"velocity\"; of = \"cart\"; component = \"x\"")
        + &output("a", "quantity = \"acceleration\"; of = \"cart\"; component = \"x\"")
        + &output("load", "quantity = \"reaction_force\"; of = \"rail\"; component = \"y\"")
        + &output("push", "quantity = \"input\"; of = \"motor.push\"")
}

#[track_caller]
fn started(text: &str) -> Run<'static> {
    open(text).prepare().and_then(Prepared::start).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn advance(run: &mut Run<'_>, t: f64) {
    run.advance(t).unwrap_or_else(|error| panic!("{error}"));
}

#[track_caller]
fn outputs(run: &mut Run<'_>) -> Vec<u64> {
    let names: Vec<String> = run.session().model.channels.iter().map(|channel| channel.name.clone()).collect();
    names.iter().map(|name| run.output(name).unwrap_or_else(|error| panic!("{error}")).to_bits()).collect()
}

/// Times and columns, every bit.
fn bits(run: &Run<'_>) -> Vec<Vec<u64>> {
    let samples = run.samples();
    let columns = samples.columns.iter().map(|column| column.as_slice());
    std::iter::once(samples.times).chain(columns).map(|list| list.iter().map(|x| x.to_bits()).collect()).collect()
}

#[test]
fn an_input_acts_from_the_time_it_is_given_at() {
    for keys in
        ["formulation = \"joint\"", "formulation = \"cartesian\"", "engine = \"reference\"", "method = \"radau5\""]
    {
        let mut run = started(&cart(&format!("gravity = [0, -10, 0]; t_end = 3; output_step = 0.25; {keys}")));
        assert_eq!((run.inputs().collect::<Vec<_>>(), run.input("motor.push").unwrap()), (vec!["motor.push"], 0.5));
        assert_eq!((run.output("x").unwrap(), run.samples().times.len()), (0.0, 0), "{keys}");
        // 0.5 N on 2 kg.
        advance(&mut run, 1.1);
        run.set_input("motor.push", -1.0).unwrap();
        let (x1, v1) = (0.125 * 1.21, 0.25 * 1.1);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{keys}: {found}, {expected}");
        near(run.output("x").unwrap(), x1);
        near(run.output("v").unwrap(), v1);
        near(run.output("a").unwrap(), -0.5);
        near(run.output("load").unwrap(), 20.0);
        near(run.output("push").unwrap(), -1.0);
        advance(&mut run, 2.0);
        near(run.output("x").unwrap(), x1 + v1 * 0.9 - 0.25 * 0.81);
        assert_eq!(run.time(), 2.0);
        advance(&mut run, 3.0);
        let report = run.finish().unwrap();
        assert_eq!((report.summary.status, report.exit_code()), (Status::Completed, 0), "{}", report.summary.reason);
        assert_eq!(report.times, (0..=12).map(|k| 0.25 * f64::from(k)).collect::<Vec<_>>());
        let late = |t: f64| t - 1.1;
        let exact = |t: f64| if t < 1.1 { 0.125 * t * t } else { x1 + v1 * late(t) - 0.25 * late(t) * late(t) };
        assert!(off(&report, "x", exact) < 1e-12, "{keys}");
        assert_eq!(column(&report, "push")[4..6], [0.5, -1.0], "rows before and after the change");
    }
}

#[test]
fn a_run_that_is_advanced_once_is_a_run_by_itself() {
    let text = machine("method = \"auto\"");
    let whole = run(&text);
    let mut run = started(&text);
    assert_eq!((run.time(), run.end()), (0.0, 4.0));
    advance(&mut run, 4.0);
    let report = run.finish().unwrap();
    assert_eq!((&report.times, &report.columns), (&whole.times, &whole.columns));
    let (mut a, mut b) = (report.summary, whole.summary);
    let counts = |summary: &mut crate::results::Summary| {
        let all = summary.counts().into_iter().map(|(name, count)| (name, *count));
        // How many programs a thread has compiled in time is chance on some processors.
        all.filter(|(name, _)| *name != "machine_code_programs").collect::<Vec<_>>()
    };
    assert_eq!(counts(&mut a), counts(&mut b));
    assert_eq!((a.audit, a.status, a.t_end_reached), (b.audit, b.status, b.t_end_reached));
}

/// States, a private memory, angles over many turns, a body that a signal from outside pushes.
fn machine(keys: &str) -> String {
    super::checkpoints::machine(keys)
        + "[[input]]\nname = \"gust\"\n\
           [[force]]\nname = \"wind\"\ntype = \"push\"\nbodies = [\"ground\", \"arm\"]\nparams.factor = 3\ninputs.signal = \"gust\"\n"
        + &output("orientation", "quantity = \"orientation\"; of = \"arm\"; component = \"e3\"")
        + &output("wind", "quantity = \"value\"; of = \"wind\"")
}

const STOPS: [(f64, f64); 4] = [(0.7, 1.0), (1.3, -2.0), (2.08, -2.0), (3.1, 0.25)];

#[test]
fn a_run_that_is_brought_back_gives_the_same_bits() {
    for keys in [
        "formulation = \"joint\"",
        "formulation = \"cartesian\"",
        "formulation = \"joint\"; method = \"dopri5\"; tolerance = 1e-8",
        "formulation = \"cartesian\"; method = \"dopri5\"; tolerance = 1e-8",
        "formulation = \"joint\"; method = \"radau5\"; tolerance = 1e-8",
        "formulation = \"cartesian\"; method = \"radau5\"; tolerance = 1e-8",
        "formulation = \"joint\"; method = \"auto\"; engine = \"compiled\"",
        "formulation = \"cartesian\"; method = \"auto\"; engine = \"interpreted\"",
        "engine = \"reference\"; tolerance = 1e-6",
        "method = \"rk4\"; fixed_step = 0.002",
    ] {
        let text = machine(keys);
        let mut plain = started(&text);
        let mut ends = Vec::new();
        for (t, gust) in STOPS {
            advance(&mut plain, t);
            plain.set_input("gust", gust).unwrap();
        }
        advance(&mut plain, 4.0);
        ends.push((bits(&plain), outputs(&mut plain)));

        let mut wandering = started(&text);
        let mut third = None;
        for (k, (t, gust)) in STOPS.into_iter().enumerate() {
            let saved = wandering.save().unwrap();
            wandering.set_input("gust", 7.0).unwrap();
            advance(&mut wandering, 3.7);
            outputs(&mut wandering);
            wandering.restore(&saved).unwrap();
            advance(&mut wandering, t);
            outputs(&mut wandering);
            wandering.set_input("gust", gust).unwrap();
            if k == 2 {
                third = Some(wandering.save().unwrap());
            }
        }
        advance(&mut wandering, 4.0);
        ends.push((bits(&wandering), outputs(&mut wandering)));
        assert!(ends[0] == ends[1], "{keys}: brought back again and again");

        // What was saved, on its way through a file, in another run.
        let third = third.unwrap();
        let third: Saved = toml::from_str(&toml::to_string(&third).unwrap()).unwrap();
        let mut other = started(&text);
        other.restore(&third).unwrap();
        assert_eq!((other.time(), other.input("gust").unwrap()), (2.08, -2.0));
        advance(&mut other, 3.1);
        other.set_input("gust", 0.25).unwrap();
        advance(&mut other, 4.0);
        let rows = 17;
        let last: Vec<Vec<u64>> = ends[0].0.iter().map(|column| column[rows..].to_vec()).collect();
        assert!((bits(&other), outputs(&mut other)) == (last, ends.remove(0).1), "{keys}: another run");
    }
}

#[test]
fn energies_balance_across_changes_of_inputs() {
    let mut run = started(&machine(""));
    for (t, gust) in STOPS {
        advance(&mut run, t);
        run.set_input("gust", gust).unwrap();
    }
    advance(&mut run, 4.0);
    let report = run.finish().unwrap();
    assert_eq!(report.summary.status, Status::Completed, "{}", report.summary.reason);
    assert!(report.summary.audit.worst() < 1e-8, "{:?}", report.summary.audit);
}

/// The end of a spring jumps, and with it the energy that is stored in it.
#[test]
fn what_an_input_stores_at_once_is_work() {
    let text = cart("t_end = 2; output_step = 0.1")
        + "[[input]]\nname = \"end\"\nunit = \"cm\"\n[[force]]\nname = \"spring\"\ntype = \"pulled\"\n\
           bodies = [\"ground\", \"cart\"]\ninputs.end = \"end\"\n";
    let mut run = started(&text);
    for (t, end) in [(0.3, 20.0), (0.9, -50.0), (1.4, 35.0)] {
        advance(&mut run, t);
        run.set_input("end", end).unwrap();
    }
    advance(&mut run, 2.0);
    let report = run.finish().unwrap();
    assert_eq!(report.summary.status, Status::Completed, "{}", report.summary.reason);
    let audit = report.summary.audit;
    assert!(audit.energy_error_relative < 1e-8 && audit.work > 1.0, "{audit:?}");
}

#[test]
fn what_is_unknown_is_refused_with_the_nearest_name() {
    let mut run = started(&cart("t_end = 1; output_step = 0.1"));
    let help = |error: SessionError, code| {
        assert_eq!((error.exit, error.diagnostics[0].code), (Exit::Scene, code), "{error}");
        error.render(false)
    };
    let text = help(run.set_input("motor_push", 1.0).unwrap_err(), codes::UNKNOWN_TARGET);
    assert!(text.contains("no input `motor_push`") && text.contains("did you mean `motor.push`?"), "{text}");
    let text = help(run.output("lead").unwrap_err(), codes::UNKNOWN_TARGET);
    assert!(text.contains("no output `lead`") && text.contains("did you mean `load`?"), "{text}");
    help(run.input("brake").unwrap_err(), codes::UNKNOWN_TARGET);
    help(run.set_input("motor.push", f64::NAN).unwrap_err(), codes::NOT_FINITE);
    assert_eq!(run.input("motor.push").unwrap(), 0.5, "as it was");
    advance(&mut run, 0.5);
    for t in [0.4, 1.1, f64::NAN, f64::INFINITY] {
        let text = help(run.advance(t).unwrap_err(), codes::OUT_OF_RANGE);
        assert!(text.contains("the run is at 0.5 s, the scene ends at 1 s"), "{text}");
    }
    advance(&mut run, 0.5);
    assert_eq!((run.time(), run.samples().times.len()), (0.5, 6));
}

#[test]
fn a_run_can_only_be_brought_back_to_its_own_scene() {
    let saved = started(&cart("t_end = 1; output_step = 0.1")).save().unwrap();
    let mut other = started(&cart("t_end = 2; output_step = 0.1"));
    advance(&mut other, 0.5);
    let error = other.restore(&saved).unwrap_err();
    assert_eq!((error.exit, error.diagnostics[0].code), (Exit::Scene, codes::CANNOT_GO_ON), "{error}");
    assert_eq!(other.time(), 0.5, "as it was");
}

#[test]
fn a_run_that_cannot_go_on_can_be_brought_back() {
    let mut run = started(&cart("t_end = 1; output_step = 0.1; max_steps = 40; max_step = 0.01"));
    advance(&mut run, 0.2);
    let saved = run.save().unwrap();
    let error = run.advance(1.0).unwrap_err();
    assert_eq!((error.exit, error.diagnostics[0].code), (Exit::Integration, codes::TOO_MANY_STEPS), "{error}");
    assert!(run.time() > 0.3 && run.time() < 0.5, "{}", run.time());
    run.restore(&saved).unwrap();
    assert_eq!((run.time(), run.samples().times.len()), (0.2, 3));
    advance(&mut run, 0.3);
    let report = run.finish().unwrap();
    assert_eq!((report.summary.status, report.summary.code), (Status::StoppedEarly, Some(codes::INTERRUPTED)));
    assert!(off(&report, "x", |t| 0.125 * t * t) < 1e-12 && report.times.len() == 4);
}

#[test]
fn a_sink_takes_the_samples_of_a_run() {
    struct Count(Vec<(usize, f64)>);
    impl Sink for &mut Count {
        fn sample(&mut self, number: usize, values: &[f64]) -> std::io::Result<()> {
            self.0.push((number, values[0]));
            Ok(())
        }
    }
    let mut count = Count(Vec::new());
    let prepared = open(&cart("t_end = 1; output_step = 0.5")).prepare().unwrap();
    let mut run = prepared.start_into(Box::new(&mut count)).unwrap();
    advance(&mut run, 0.6);
    advance(&mut run, 1.0);
    assert!(run.samples().times.is_empty());
    drop(run);
    let numbers: Vec<usize> = count.0.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, [0, 1, 2]);
    assert!((count.0[2].1 - 0.125).abs() < 1e-12);
}

#[test]
fn islands_have_the_inputs_of_the_scene() {
    let text = cart("t_end = 1; output_step = 0.1; islands = \"apart\"")
        + "[[body]]\nname = \"stone\"\nmass = 1\ninertia = [1, 1, 1]\n\
           [[force]]\nname = \"kick\"\ntype = \"push\"\nbodies = [\"ground\", \"stone\"]\nparams.factor = 2e-3\n\
           inputs.signal = \"motor.push\"\n"
        + &output("z", "quantity = \"position\"; of = \"stone\"; component = \"x\"");
    let report = run(&text);
    assert_eq!(report.summary.islands.len(), 2);
    assert!(off(&report, "x", |t| 0.125 * t * t) < 1e-12 && off(&report, "z", |t| 0.5 * t * t) < 1e-12);
    assert!(off(&report, "push", |_| 0.5) == 0.0);
}
