//! Forces that let go: against closed forms, in every way, and what a run keeps of that.

use odyn::results::EventKind;
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run, try_run};
use crate::release::{G, body, head, output, released};
use crate::support::{Scratch, column, difference, leg, open_text};

/// A mass of 2 kg on a spring of 50 N/m, which leaves its place of rest with 3 m/s.
fn spring(release: &str) -> String {
    head(1.0)
        + &body("mass", 2.0, 1.0, [0.0; 3])
        + "velocity = [3, 0, 0]\n[[joint]]\nname = \"rail\"\ntype = \"translational\"\nbodies = [\"ground\", \"mass\"]\npoint = [0, 0, 0]\n\
           axis = [1, 0, 0]\n[[force]]\nname = \"spring\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"mass\"]\n\
           points = [[-1, 0, 0], [0, 0, 0]]\nparams = { stiffness = 50, free_length = 1 }\n"
        + &format!("release = {release}\n")
        + &output("x", "position", "mass", "x")
        + &output("v", "velocity", "mass", "x")
        + &output("F", "force", "spring", "magnitude")
        + "[[output]]\nname = \"tension\"\nquantity = \"value\"\nof = \"spring\"\nchannel = \"force\"\n[[output]]\nname = \"length\"\n\
           quantity = \"value\"\nof = \"spring\"\nchannel = \"length\"\n[[output]]\nname = \"V\"\nquantity = \"potential_energy\"\n"
}

fn breaks_at(report: &RunReport, t1: f64) {
    let [event] = released(report)[..] else { panic!("{:?}", report.events) };
    assert!((event.time - t1).abs() < 1e-11, "{} {t1}", event.time);
    let (x1, v1) = (3.0 / 5.0 * (5.0 * t1).sin(), 3.0 * (5.0 * t1).cos());
    for (k, t) in report.times.iter().enumerate() {
        let at = |name| column(report, name)[k];
        let (x, load) = match *t <= event.time {
            true => (0.6 * (5.0 * t).sin(), 30.0 * (5.0 * t).sin()),
            false => (x1 + v1 * (t - t1), 0.0),
        };
        assert!((at("x") - x).abs() < 1e-9, "{t}");
        assert!((at("tension") - load).abs() < 1e-7 && (at("F") - load.abs()).abs() < 1e-7, "{t}");
        assert!((at("V") - load * load / 100.0).abs() < 1e-7 && (at("length") - 1.0 - x).abs() < 1e-9);
    }
}

#[test]
fn a_spring_breaks_at_its_own_load() {
    let t1 = (24.0_f64 / 30.0).asin() / 5.0;
    for release in ["{ when = \"spring.force\", above = \"24 N\" }", "{ when = \"F\", above = 24 }"] {
        let report = every_way_agrees(&spring(release), 1e-8);
        breaks_at(&report, t1);
        let told = &report.summary.releases;
        assert_eq!((told.len(), told[0].joint.as_str()), (1, "spring"));
        assert!(told[0].by.ends_with("= 24 N"), "{told:?}");
    }
    breaks_at(&every_way_agrees(&spring("{ at = \"432.1 ms\" }"), 1e-8), 0.4321);
    breaks_at(&every_way_agrees(&spring("{ when = \"v\", below = -1 }"), 1e-8), (-1.0_f64 / 3.0).acos() / 5.0);
    let held = run(&spring("{ when = \"spring.force\", above = 31, below = -31 }"), &[]);
    assert!(held.events.is_empty());
    let plain = run(&spring("{ at = 5 }").replace("release =", "#"), &[]);
    assert!(held.columns.iter().zip(&plain.columns).all(|(a, b)| difference(a, b) < 1e-9));
}

#[test]
fn a_force_may_let_go_at_the_start() {
    for release in ["{ at = 0 }", "{ when = \"v\", above = 2 }"] {
        let report = every_way_agrees(&spring(release), 1e-10);
        assert_eq!(released(&report)[0].time, 0.0);
        for (t, x) in report.times.iter().zip(column(&report, "x")) {
            assert!((x - 3.0 * t).abs() < 1e-10);
        }
    }
}

/// Two springs side by side: what the first one held is taken by the second, which breaks for it by its swing.
#[test]
fn one_after_the_other() {
    let one = |name: &str, bound: f64| {
        format!(
            "[[force]]\nname = \"{name}\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"weight\"]\n\
             points = [[0, 0, 1], [0, 0, 0]]\nparams = {{ stiffness = 500, free_length = {:?} }}\n\
             release = {{ when = \"{name}.force\", above = {bound:?} }}\n",
            1.0 - 2.0 * G / 1000.0
        )
    };
    let text = head(1.0)
        + &body("weight", 2.0, 1.0, [0.0; 3])
        + "[[joint]]\nname = \"rail\"\ntype = \"translational\"\nbodies = [\"ground\", \"weight\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
           [[force]]\nname = \"pull\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"weight\"]\npoint = [0, 0, 0]\nparams.z = \"-20 * t\"\n"
        + &one("first", G + 3.0)
        + &one("second", 25.0)
        + &output("z", "position", "weight", "z");
    let report = every_way_agrees(&text, 1e-7);
    let [first, second] = released(&report)[..] else { panic!("{:?}", report.events) };
    assert_eq!((first.element.as_str(), second.element.as_str()), ("first", "second"));
    assert!(second.time > first.time && second.time < 0.8);
    let last = report.times.iter().position(|t| *t > second.time).unwrap();
    let z = column(&report, "z");
    // From there on the third difference of z is that of -20 / m.
    for k in last..z.len() - 3 {
        let third = z[k + 3] - 3.0 * z[k + 2] + 3.0 * z[k + 1] - z[k];
        assert!((third + 10.0 * 1e-6).abs() < 1e-10, "{third}");
    }
}

#[test]
fn what_is_broken_is_kept() {
    let text = spring("{ when = \"spring.force\", above = 24 }");
    let whole = run(&text, &[]);
    let mut run = open_text(&text, &[]).prepare().unwrap().start().unwrap();
    run.advance(0.1).unwrap();
    let before = run.save().unwrap();
    run.advance(0.5).unwrap();
    let behind = run.save().unwrap();
    run.advance(1.0).unwrap();
    let first = run.output("x").unwrap();
    for saved in [&behind, &before] {
        run.restore(saved).unwrap();
        run.advance(1.0).unwrap();
        assert!((run.output("x").unwrap() - first).abs() < 1e-11);
    }
    let scratch = Scratch::new();
    scratch.file("scene.toml", &text);
    let go = |set: &str, folder: &str, from: Option<&str>| leg(&scratch, set, folder, from);
    go("simulation.t_end = 0.5", "first", None);
    let rest = go("simulation.t_end = 1", "second", Some("first"));
    assert!(rest.events.is_empty() && column(&rest, "F").iter().all(|load| *load == 0.0));
    let legs = go("simulation.checkpoint_every = 0.13", "legs", None);
    assert_eq!(legs.events.iter().filter(|event| event.kind == EventKind::Releases).count(), 1);
    for other in [&rest, &legs] {
        assert!((column(other, "x").last().unwrap() - column(&whole, "x").last().unwrap()).abs() < 1e-10);
    }
}

#[test]
fn what_cannot_let_go_says_so() {
    let text = spring("{ at = 0.4 }");
    let fixed = try_run(&text, &["simulation.method = \"rk4\"", "simulation.fixed_step = 0.001"], None).unwrap_err();
    assert!(fixed.contains("`spring` may be released") && fixed.contains("fixed size"), "{fixed}");
    let right = open_text(&text, &[]).prepare().unwrap().right_side().map(drop).unwrap_err();
    assert!(right.to_string().contains("between steps only"), "{right}");
    let inert = head(1.0)
        + &body("mass", 2.0, 1.0, [1.0, 0.0, 0.0])
        + "[[force]]\nname = \"rotor\"\ntype = \"inerter\"\nbodies = [\"ground\", \"mass\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n\
           params.inertance = 1\nrelease = { at = 0.5 }\n";
    let error = try_run(&inert, &[], None).unwrap_err();
    assert!(error.contains("`rotor` cannot let go: it brings inertia"), "{error}");
}
