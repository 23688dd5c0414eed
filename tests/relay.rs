//! Memories that jump at instants: relays, and elements of others that remember by conditions.

use odyn::results::{Event, EventKind};
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run, try_run};
use crate::release::{body, head, output};
use crate::support::{Scratch, bisected, column, difference, leg, open_text};

pub(crate) fn switched<'a>(report: &'a RunReport, of: &str) -> Vec<&'a Event> {
    report.events.iter().filter(|event| event.kind == EventKind::Switches && event.element == of).collect()
}

pub(crate) fn relay(name: &str, input: &str, params: &str) -> String {
    format!(
        "[[control]]\nname = \"{name}\"\ntype = \"relay\"\ninputs = {{ input = \"{input}\" }}\nparams = {{ {params} }}\n"
    )
}

fn source(name: &str, function: &str) -> String {
    format!("[[control]]\nname = \"{name}\"\ntype = \"signal-source\"\nparams.function = {function}\n")
}

fn value(name: &str, of: &str) -> String {
    format!("[[output]]\nname = \"{name}\"\nquantity = \"value\"\nof = \"{of}\"\nchannel = \"output\"\n")
}

fn bystander() -> String {
    body("bystander", 1.0, 1.0, [0.0; 3])
}

/// A room that a heater keeps between 19 and 21.
fn room(t_end: f64) -> String {
    head(t_end)
        + &bystander()
        + "[[control]]\nname = \"room\"\ntype = \"transfer-function\"\ninputs = { input = \"heater.output\" }\nparams.numerator = [1]\n\
           params.denominator = [2, 1]\n"
        + &relay("heater", "room.output", "lower = 19, upper = 21, on = 10, off = 30")
        + &value("T", "room")
        + &value("u", "heater")
}

#[test]
fn a_thermostat_switches_when_its_closed_form_says() {
    let report = every_way_agrees(&room(10.0), 1e-8);
    let events = switched(&report, "heater");
    assert!(events.len() > 15);
    for (k, event) in events.iter().enumerate() {
        let at = 2.0 * (30.0_f64 / 9.0).ln() + 2.0 * (11.0_f64 / 9.0).ln() * k as f64;
        assert!((event.time - at).abs() < 1e-10, "{k}: {} {at}", event.time);
        assert_eq!(event.row, if k % 2 == 0 { "memory = 1" } else { "memory = 0" });
    }
    assert!(column(&report, "T").iter().all(|temperature| *temperature < 21.0 + 1e-9));
}

/// Functions of time alone, in which nothing limits the steps: as exactly as the times are known.
#[test]
fn instants_of_functions_of_time_are_exact() {
    let text = head(20.0).replace("output_step = 0.01", "output_step = 1")
        + &bystander()
        + &source("wave", "\"sin(t)\"")
        + &relay("one", "wave.output", "lower = -0.5, upper = 0.5")
        + &value("on", "one");
    let report = every_way_agrees(&text, 1e-12);
    let events = switched(&report, "one");
    assert_eq!(events.len(), 7);
    for (k, event) in events.iter().enumerate() {
        let at = std::f64::consts::PI * (1.0 / 6.0 + k as f64);
        assert!((event.time - at).abs() < 1e-13 * at.max(1.0), "{k}: {} {at}", event.time);
    }
}

/// A pendulum that a relay pushes against its swing, and its own integrator: steps of fourth order up to the switch, which is bisected.
#[test]
fn a_pendulum_under_a_relay_does_as_its_own_integrator_says() {
    let text = head(6.0)
        + &body("bob", 1.0, 0.02, [1.0, 0.0, 0.0])
        + "[[joint]]\nname = \"pivot\"\ntype = \"revolute\"\nbodies = [\"ground\", \"bob\"]\npoint = [0, 0, 0]\naxis = [0, -1, 0]\n\
           [[force]]\nname = \"motor\"\ntype = \"rotational-actuator\"\nbodies = [\"ground\", \"bob\"]\npoint = [0, 0, 0]\n\
           axis = [0, -1, 0]\ninputs.signal = \"valve.output\"\n"
        + &relay("valve", "w", "lower = -0.7, upper = 0.4, on = -1.5, off = 1.1")
        + "[[output]]\nname = \"w\"\nquantity = \"coordinate_rate\"\nof = \"pivot\"\n"
        + &output("x", "position", "bob", "x");
    let report = every_way_agrees(&text, 1e-8);
    let rates = |[a, w]: [f64; 2], push: f64| [w, (push - 9.81 * a.cos()) / 1.02];
    let step = |y: [f64; 2], h: f64, push: f64| {
        let ahead = |k: [f64; 2], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
        let k1 = rates(y, push);
        let k2 = rates(ahead(k1, h / 2.0), push);
        let k3 = rates(ahead(k2, h / 2.0), push);
        let k4 = rates(ahead(k3, h), push);
        std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    };
    let (mut y, mut t, mut is_on, mut times) = ([0.0, 0.0], 0.0, false, Vec::new());
    while t < 6.0 {
        let push = if is_on { -1.5 } else { 1.1 };
        let left = |y: [f64; 2]| if is_on { y[1] + 0.7 } else { 0.4 - y[1] };
        let next = step(y, 1e-4, push);
        if left(next) >= 0.0 {
            (y, t) = (next, t + 1e-4);
            continue;
        }
        let h = bisected(0.0, 1e-4, |h| left(step(y, h, push)));
        (y, t, is_on) = (step(y, h, push), t + h, !is_on);
        times.push(t);
    }
    let events = switched(&report, "valve");
    assert_eq!(events.len(), times.iter().filter(|t| **t < 6.0).count());
    assert!(events.len() > 3, "{}", events.len());
    for (event, t) in events.iter().zip(times) {
        assert!((event.time - t).abs() < 1e-9, "{event:?} {t}");
    }
}

#[test]
fn a_signal_beyond_a_bound_at_the_start_switches_there() {
    let text = |level: f64, more: &str| {
        head(1.0)
            + &bystander()
            + &source("level", &format!("\"{level:?} + 0 * t\""))
            + &relay("one", "level.output", &format!("lower = -1, upper = 1{more}"))
            + &value("on", "one")
    };
    let on = |text: String| {
        let report = run(&text, &[]);
        let values = column(&report, "on").to_vec();
        assert!(values.iter().all(|value| *value == values[0]));
        (values[0], report.events.len())
    };
    assert_eq!(on(text(2.0, "")), (1.0, 1));
    assert_eq!(on(text(-2.0, "")), (0.0, 0));
    assert_eq!(on(text(-2.0, ", initially_on = true")), (0.0, 1));
    // At its bound, and between.
    assert_eq!(on(text(1.0, "")), (0.0, 0));
    assert_eq!(on(text(-1.0, ", initially_on = true")), (1.0, 0));
    assert_eq!(on(text(0.0, ", initially_on = true")), (1.0, 0));
}

/// A jump in time, a pulse between two samples and shorter than the steps, a controller that samples, a place at which a table jumps.
#[test]
fn signals_that_jump_and_pulses_switch() {
    let jump = source("s", "{ points = [[0, 0], [0.333, 1], [2, 1]], interpolation = \"steps\" }");
    let sampled = source("ramp", "\"t\"")
        + "[[control]]\nname = \"s\"\ntype = \"digital-pid\"\ninputs = { set_point = \"ramp.output\", measured = 0 }\n\
           params.period = \"0.1 s\"\nparams.kp = 1.3\n";
    let place = source("ramp", "\"t\"")
        + "[[control]]\nname = \"way\"\ntype = \"integral\"\ninputs = { input = 1 }\n[[control]]\nname = \"s\"\ntype = \"look-up\"\n\
           inputs = { input = \"way.output\" }\nparams.function = { points = [[-1, 0], [0.3217, 1], [2, 1]], interpolation = \"steps\" }\n";
    let pulse = source("s", "\"exp(-((t - 0.4777) * 2000)^2)\"");
    for (signal, at) in [(jump, 0.333), (sampled, 0.4), (place, 0.3217), (pulse, 0.4777 - 2_f64.ln().sqrt() / 2000.0)] {
        let text = head(1.0)
            + &bystander()
            + &signal
            + &relay("one", "s.output", "lower = 0.1, upper = 0.5")
            + &value("on", "one")
            + "[[control]]\nname = \"sum\"\ntype = \"integral\"\ninputs = { input = \"one.output\" }\n"
            + &value("sum", "sum");
        let report = every_way_agrees(&text, 1e-10);
        assert!((switched(&report, "one")[0].time - at).abs() < 1e-11, "{:?} {at}", report.events);
    }
}

/// One relay switches the next, which only remembers.
#[test]
fn relays_in_a_row_switch_at_one_instant() {
    let text = head(3.0)
        + &bystander()
        + &relay("third", "second.output", "lower = 2, upper = 3, on = 8, off = 9")
        + &relay("second", "first.output", "lower = 1, upper = 4, on = 7, off = -7")
        + &relay("first", "wave.output", "lower = -0.5, upper = 0.5, on = 5, off = 0")
        + &source("wave", "\"sin(2 * t)\"")
        + &value("on", "third");
    let report = every_way_agrees(&text, 1e-12);
    let times: Vec<f64> = report.events.iter().map(|event| event.time).collect();
    assert_eq!(times.len(), 6, "{:?}", report.events);
    assert!(times[..3].iter().all(|t| *t == times[0]) && times[3..].iter().all(|t| *t == times[3]));
    assert!((times[0] - std::f64::consts::PI / 12.0).abs() < 1e-13);
    for (t, on) in report.times.iter().zip(column(&report, "on")) {
        assert_eq!(*on, if *t > times[0] && *t <= times[3] { 8.0 } else { 9.0 });
    }
}

/// A stop and a valve: where the valve switches, what presses on the stop lets go.
#[test]
fn contacts_open_for_what_a_relay_does() {
    let text = head(1.5)
        + &body("slider", 2.0, 1.0, [0.0; 3])
        + "[[joint]]\nname = \"way\"\ntype = \"translational\"\nbodies = [\"ground\", \"slider\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
           [[joint]]\nname = \"stop\"\ntype = \"translational-stop\"\nbodies = [\"ground\", \"slider\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
           params.upper = 0\nparams.lower = -10\n[[force]]\nname = \"push\"\ntype = \"translational-actuator\"\nbodies = [\"ground\", \"slider\"]\n\
           axis = [1, 0, 0]\nparams.along = \"axis\"\ninputs.signal = \"valve.output\"\n"
        + &source("ramp", "\"t\"")
        + &relay("valve", "ramp.output", "lower = -1, upper = 0.4321, on = -6, off = 4")
        + &output("x", "position", "slider", "x");
    let report = every_way_agrees(&text, 1e-9);
    let opens = report.events.iter().find(|event| event.kind == EventKind::Opens).unwrap();
    assert!((opens.time - 0.4321).abs() < 1e-13);
    for (t, x) in report.times.iter().zip(column(&report, "x")) {
        assert!((x + 1.5 * (t - 0.4321).max(0.0).powi(2)).abs() < 1e-10);
    }
}

#[test]
fn what_is_on_is_kept() {
    let text = room(10.0);
    let whole = run(&text, &[]);
    let mut run = open_text(&text, &[]).prepare().unwrap().start().unwrap();
    run.advance(2.6).unwrap();
    assert_eq!(run.output("u").unwrap(), 10.0);
    let on = run.save().unwrap();
    run.advance(3.0).unwrap();
    assert_eq!(run.output("u").unwrap(), 30.0);
    run.restore(&on).unwrap();
    assert_eq!(run.output("u").unwrap(), 10.0);
    run.advance(10.0).unwrap();
    let last = |report: &RunReport| *column(report, "T").last().unwrap();
    assert!((run.output("T").unwrap() - last(&whole)).abs() < 1e-9);
    let scratch = Scratch::new();
    scratch.file("scene.toml", &text);
    let go = |set: &str, folder: &str, from: Option<&str>| leg(&scratch, set, folder, from);
    go("simulation.t_end = 2.6", "first", None);
    let rest = go("simulation.t_end = 10", "second", Some("first"));
    assert!((last(&rest) - last(&whole)).abs() < 1e-9);
    assert_eq!(column(&rest, "u")[0], 10.0);
    let legs = go("simulation.checkpoint_every = 0.7", "legs", None);
    assert_eq!(legs.events.len(), whole.events.len());
    assert!(difference(column(&legs, "T"), column(&whole, "T")) < 1e-9);
    // An end at the very instant, and on from there; beside another island, too.
    let at = format!("simulation.t_end = {:?}", 2.0 * (30.0_f64 / 9.0).ln());
    for (more, islands) in [("", "together"), ("far", "together"), ("far", "apart")] {
        scratch.file(
            "scene.toml",
            &(text.clone() + &if more.is_empty() { String::new() } else { body(more, 1.0, 1.0, [0.0; 3]) }),
        );
        go(&at, "third", None);
        let rest = go(&format!("simulation.islands = \"{islands}\""), "fourth", Some("third"));
        let behind = whole.events.len() - rest.events.len();
        assert!(behind < 2);
        for (a, b) in rest.events.iter().zip(&whole.events[behind..]) {
            assert!((a.time - b.time).abs() < 1e-11, "{a:?} {b:?}");
        }
    }
}

/// Steps end before a jump of a function of time; where the run, or a leg of it, ends there, too, nothing switches behind its end.
#[test]
fn a_jump_at_the_end_of_a_run_switches_there() {
    for (from, at, to) in [(0.25, 1.25, 1.25), (0.0, 1.9, 2.0), (-0.4, 0.3, 1.0), (1e4, 10000.3, 10001.0)] {
        let text = head(to)
            .replace("t_end", &format!("t_start = {from:?}\nt_end"))
            .replace("output_step = 0.01", "output_step = 0.1")
            + &bystander()
            + &source("s", &format!("{{ points = [[{from:?}, 0], [{at:?}, 1]], interpolation = \"steps\" }}"))
            + &relay("one", "s.output", "lower = 0.4, upper = 0.6")
            + &value("on", "one")
            + "[[control]]\nname = \"sum\"\ntype = \"integral\"\ninputs = { input = \"one.output\" }\n"
            + &value("sum", "sum");
        let check = |report: &RunReport, what: &str| {
            let events = switched(report, "one");
            // At the end of the scene it may, or does so where that is continued from.
            assert!(events.len() == 1 || events.is_empty() && at == to, "{what}: {events:?}");
            assert!(events.iter().all(|event| (event.time - at).abs() < 1e-9), "{what}: {events:?}");
            let sum = *column(report, "sum").last().unwrap();
            assert!((sum - (to - at)).abs() < 1e-8, "{what}: {sum}");
        };
        check(&run(&text, &[]), &format!("{at} of {from} to {to}"));
        // Legs that end there.
        let scratch = Scratch::new();
        scratch.file("scene.toml", &text);
        let every = (at - from) / 4.0;
        check(
            &leg(&scratch, &format!("simulation.checkpoint_every = {every:?}"), "legs", None),
            &format!("legs of {every}"),
        );
        let mut stepped = open_text(&text, &[]).prepare().unwrap().start().unwrap();
        for time in [at, at, to, to] {
            stepped.advance(time).unwrap();
        }
        check(&stepped.finish().unwrap(), "advanced to it");
        if at < to {
            leg(&scratch, &format!("simulation.t_end = {at:?}"), "first", None);
            let rest = leg(&scratch, &format!("simulation.t_end = {to:?}"), "rest", Some("first"));
            let sum = *column(&rest, "sum").last().unwrap();
            assert!((sum - (to - at)).abs() < 1e-8, "from there: {sum}");
        }
    }
}

/// A chain without feedback comes to rest, however long it is.
#[test]
fn a_long_chain_of_relays_switches_at_once() {
    let text = head(1.0)
        + &bystander()
        + &source("ramp", "\"t\"")
        + &(0..120)
            .map(|k| {
                let input = if k == 0 { "ramp".to_string() } else { format!("r{}", k - 1) };
                relay(&format!("r{k}"), &format!("{input}.output"), "lower = 0.3, upper = 0.5")
            })
            .collect::<String>();
    let report = run(&text, &[]);
    assert_eq!(report.events.len(), 120);
    assert!(report.events.iter().all(|event| (event.time - 0.5).abs() < 1e-12));
}

/// What a run that is brought back has reported of what it left is forgotten.
#[test]
fn events_that_were_taken_back_are_none() {
    let text = room(10.0);
    let whole = run(&text, &[]);
    let mut run = open_text(&text, &[]).prepare().unwrap().start().unwrap();
    run.advance(3.0).unwrap();
    let saved = run.save().unwrap();
    run.advance(9.0).unwrap();
    let late = run.save().unwrap();
    run.restore(&saved).unwrap();
    run.advance(10.0).unwrap();
    assert_eq!(run.finish().unwrap().events.len(), whole.events.len());
    // In another run, which did not see what was before.
    let mut other = open_text(&text, &[]).prepare().unwrap().start().unwrap();
    other.restore(&late).unwrap();
    other.advance(10.0).unwrap();
    let events = other.finish().unwrap().events;
    let behind = whole.events.iter().filter(|event| event.time > 9.0).count();
    assert!(behind > 0 && events.len() == behind, "{events:?}");
}

#[test]
fn islands_switch_by_themselves() {
    let other = |text: String| {
        text + &body("far", 2.0, 1.0, [5.0, 0.0, 0.0])
            + "[[joint]]\nname = \"rail\"\ntype = \"translational\"\nbodies = [\"ground\", \"far\"]\npoint = [5, 0, 0]\naxis = [1, 0, 0]\n\
               [[force]]\nname = \"spring\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"far\"]\n\
               points = [[2, 0, 0], [5, 0, 0]]\nparams.stiffness = 40\nparams.free_length = 2\n[[force]]\nname = \"push\"\n\
               type = \"translational-actuator\"\nbodies = [\"ground\", \"far\"]\npoint = [5, 0, 0]\naxis = [1, 0, 0]\n\
               params.along = \"axis\"\ninputs.signal = \"valve.output\"\n"
            + &relay("valve", "x", "lower = 3.5, upper = 4.5, on = -5, off = 5")
            + &output("x", "position", "far", "x")
    };
    let text = other(room(6.0));
    let (whole, apart) = (run(&text, &[]), run(&text, &["simulation.islands = \"apart\""]));
    assert!(switched(&whole, "valve").len() > 5);
    assert_eq!(whole.events.len(), apart.events.len());
    for (a, b) in whole.columns.iter().zip(&apart.columns) {
        assert!(difference(a, b) < 1e-7);
    }
}

#[test]
fn what_cannot_switch_says_so() {
    let refused = |sets: &[&str]| try_run(&room(1.0), sets, None).unwrap_err();
    let fixed = refused(&["simulation.method = \"rk4\"", "simulation.fixed_step = 0.001"]);
    assert!(fixed.contains("`heater` switches: steps of a fixed size"), "{fixed}");
    let right = open_text(&room(1.0), &[]).prepare().unwrap().right_side().map(drop).unwrap_err();
    assert!(right.to_string().contains("elements have states that change between steps only"), "{right}");
    let narrow = room(1.0).replace("upper = 21", "upper = 19");
    assert!(try_run(&narrow, &[], None).unwrap_err().contains("must be larger than `lower`"));
}
