//! Motions whose answers are known.

use super::*;

/// A body that only slides along x, held by a strut: a linear oscillator of 2 kg.
fn oscillator(settings_text: &str, stiffness: f64, damping: f64) -> String {
    settings(settings_text)
        + "[[body]]\nname = \"mass\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nposition = [1.5, 0, 0]\n\
           [[joint]]\nname = \"rail\"\ntype = \"slide\"\nbodies = [\"ground\", \"mass\"]\npoint = [1.5, 0, 0]\naxis = [1, 0, 0]\n"
        + &format!(
            "[[force]]\nname = \"strut\"\ntype = \"strut\"\nbodies = [\"ground\", \"mass\"]\n\
             points = [[0, 0, 0], [1.5, 0, 0]]\nparams = {{ stiffness = {stiffness:?}, damping = {damping:?} }}\n"
        )
        + &output("x", "quantity = \"position\"; of = \"mass\"; component = \"x\"")
        + &output("v", "quantity = \"velocity\"; of = \"mass\"; component = \"x\"")
}

/// x - 1 = 0.5 exp(-d t) (cos w t + d / w sin w t) for k = 50, c, m = 2.
fn damped(t: f64, damping: f64) -> f64 {
    let d = damping / 4.0;
    let w = (25.0 - d * d).sqrt();
    1.0 + 0.5 * (-d * t).exp() * ((w * t).cos() + d / w * (w * t).sin())
}

#[test]
fn a_pendulum_conserves_its_energy() {
    let text = scenes::pendulum(&settings("gravity = [0, -9.81, 0]; t_end = 5; output_step = 0.1"))
        + &output("E", "quantity = \"total_energy\"")
        + &output("omega", "quantity = \"coordinate_rate\"; of = \"pivot\"")
        + &output("phi", "quantity = \"coordinate\"; of = \"pivot\"");
    let report = run(&text);
    let audit = report.summary.audit;
    assert_eq!(report.summary.status, Status::Completed);
    assert!(audit.energy_error_relative < 1e-9, "{:e}", audit.energy_error_relative);
    assert!(audit.position_violation < 1e-14 && audit.velocity_violation < 1e-13 && audit.work == 0.0);
    let energies = column(&report, "E");
    assert!(energies.iter().all(|e| (e - energies[0]).abs() < 1e-8));
    // (1/2) J omega^2 = -m g s sin phi, with J = 0.1 + 1.2 / 4 and s = 0.5.
    for (phi, omega) in column(&report, "phi").iter().zip(column(&report, "omega")) {
        assert!((0.5 * 0.4 * omega * omega + 1.2 * 9.81 * 0.5 * phi.sin()).abs() < 1e-8);
    }
    assert!(column(&report, "phi").iter().any(|phi| *phi < -3.0), "swings to the other side");
}

#[test]
fn a_damped_oscillator_moves_as_its_formula_and_accounts_for_the_heat() {
    let report = run(&oscillator("t_end = 4; output_step = 0.05", 50.0, 3.0));
    assert!(off(&report, "x", |t| damped(t, 3.0)) < 1e-9);
    let audit = report.summary.audit;
    // Energy at the start: (1/2) 50 N/m (0.5 m)^2.
    let left = audit.kinetic_energy + audit.potential_energy;
    assert!(audit.work < -6.0 && (left - 6.25 - audit.work).abs() < 1e-9, "{audit:?}");
    assert!(audit.energy_error_relative < 1e-10);
}

#[test]
fn results_get_better_with_the_tolerance() {
    let errors = [1e-4, 1e-6, 1e-8, 1e-10].map(|tolerance| {
        let text = oscillator(&format!("t_end = 4; output_step = 0.05; tolerance = {tolerance:e}"), 50.0, 0.5);
        let report = run(&text);
        let error = off(&report, "x", |t| damped(t, 0.5));
        // Tolerances are relative to the size of the scene, 1.5 m, and hold for steps.
        assert!(error < 20.0 * tolerance, "{tolerance:e}: {error:e}");
        (error, report.summary.steps)
    });
    assert!(errors.windows(2).all(|pair| pair[1].0 < 0.1 * pair[0].0 && pair[1].1 > pair[0].1), "{errors:?}");
}

#[test]
fn the_work_is_the_same_in_all_units_of_length_and_mass() {
    let work = |units: &str| {
        let summary = run(&(units.to_string() + &scenes::tangle())).summary;
        (summary.steps, summary.rejected, summary.evaluations, summary.position_corrections)
    };
    // Lengths by 1e-3, masses by 1e6: torque per spin, a constant of the drag, stays what it is. (Not by time: the usual
    // choice of the first step compares y' with y''.)
    let (one, other) = (work(""), work("[units]\nlength = \"mm\"\nmass = \"Gg\"\n"));
    assert_eq!((one.0, one.1, one.2), (other.0, other.1, other.2));
    // Whether one of them is needed can depend on round-off.
    assert!(one.3.abs_diff(other.3) <= 1, "{} {}", one.3, other.3);
}

#[test]
fn element_states_follow_their_equations() {
    let text = settings("t_end = 2; output_step = 0.1")
        + "[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n\
           [[force]]\nname = \"lag\"\ntype = \"lag\"\nbodies = [\"a\"]\nparams = { tau = 0.25 }\n"
        + &output("x", "quantity = \"value\"; of = \"lag\"");
    let report = run(&text);
    assert!(off(&report, "x", |t| 1.0 + 2.0 * (-t / 0.25).exp()) < 1e-9);
}

#[test]
fn angles_count_a_hundred_turns_either_way() {
    for speed in [100.0, -100.0] {
        let text = settings("t_end = 7; output_step = 0.7")
            + &format!(
                "[[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.2]\nangular_velocity = [0, 0, {speed:?}]\n"
            )
            + "[[joint]]\nname = \"axle\"\ntype = \"hinge\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0, 0, 0]\n"
            + &output("angle", "quantity = \"coordinate\"; of = \"axle\"");
        let report = run(&text);
        assert!(column(&report, "angle").last().unwrap().abs() > 100.0 * std::f64::consts::TAU);
        assert!(off(&report, "angle", |t| speed * t) < 1e-6, "{:e}", off(&report, "angle", |t| speed * t));
    }
}

#[test]
fn a_drive_keeps_its_speed_and_its_work_is_accounted_for() {
    let text = scenes::pendulum(&settings("gravity = [0, -9.81, 0]; t_end = 2; output_step = 0.1"))
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
           axis = [0, 0, 1]\nparams = { speed = 3 }\n"
        + &output("angle", "quantity = \"coordinate\"; of = \"pivot\"")
        + &output("torque", "quantity = \"reaction_torque\"; of = \"motor\"; component = \"z\"");
    let report = run(&text);
    assert_eq!(report.summary.mobility, 0);
    assert!(off(&report, "angle", |t| 3.0 * t) < 1e-12);
    // The motor bears the weight's moment.
    assert!(off(&report, "torque", |t| 1.2 * 9.81 * 0.5 * (3.0 * t).cos()) < 1e-9);
    let audit = report.summary.audit;
    assert!(audit.energy_error_relative < 1e-9 && audit.work.abs() > 0.1, "{audit:?}");
}

#[test]
fn both_engines_run_the_tangle_alike() {
    let wanted = output("b.x", "quantity = \"position\"; of = \"b\"; component = \"x\"")
        + &output("force", "quantity = \"reaction_force\"; of = \"between\"; component = \"y\"");
    let text = scenes::tangle() + &wanted;
    let (working, reference) = (run(&text), run(&text.replace("t_end = 1", "t_end = 1\nengine = \"reference\"")));
    assert_ne!(working.summary.engine, reference.summary.engine);
    for name in ["b.x", "force"] {
        let peak = column(&working, name).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in column(&working, name).iter().zip(column(&reference, name)) {
            assert!((a - b).abs() < 1e-8 * peak, "{name}: {a} {b}");
        }
    }
    for audit in [working.summary.audit, reference.summary.audit] {
        assert!(audit.energy_error_relative < 1e-8, "{audit:?}");
    }
}

#[test]
fn a_flat_four_bar_leaves_its_singular_position() {
    // Both cranks turn alike: a parallelogram moves on as a parallelogram.
    let crank = "[[body]]\nangular_velocity = [0, 0, 3]\nname = \"NAME\"";
    let mut text = scenes::four_bar(0.0).replace("gravity = [0, -9.81, 0]", "gravity = [0, 0, 0]");
    for name in ["left", "right"] {
        text = text.replace(&format!("[[body]]\nname = \"{name}\""), &crank.replace("NAME", name));
    }
    text += &output("left", "quantity = \"coordinate\"; of = \"A\"");
    text += &output("right", "quantity = \"coordinate\"; of = \"B\"");
    for keys in ["", "formulation = \"cartesian\""] {
        let report = run(&text.replace("t_end = 1", &format!("t_end = 1\n{keys}")));
        assert_eq!(report.summary.status, Status::Completed, "{keys}: {}", report.summary.reason);
        // It is one mechanism in which one crank moves the other.
        assert_eq!(report.summary.mobility, 1, "{keys}");
        // Without gravity the speed stays.
        let (left, right) = (off(&report, "left", |t| 3.0 * t), off(&report, "right", |t| 3.0 * t));
        assert!(left < 1e-8 && right < 1e-8, "{keys}: {left:e} {right:e}");
        assert!(report.summary.audit.position_violation < 1e-12, "{keys}: {:?}", report.summary.audit);
    }
}

/// A wheel with two drives, by their parameters.
pub(super) fn driven_twice(keys: &str, first: &str, second: &str) -> String {
    let drive = |name: &str, params: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"drive\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0, 0, 0]\n\
             axis = [0, 0, 1]\nparams = {{ {params} }}\n"
        )
    };
    settings(&format!("t_end = 1; output_step = 0.01; {keys}"))
        + "[[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
           [[joint]]\nname = \"axle\"\ntype = \"hinge\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0, 0, 0]\n\
           axis = [0, 0, 1]\n"
        + &drive("one", first)
        + &drive("other", second)
        + &output("phi", "quantity = \"coordinate\"; of = \"axle\"")
}

#[test]
fn drives_that_come_to_contradict_each_other_stop_the_run() {
    let kinds = [
        "",
        "method = \"dop853\"",
        "method = \"radau5\"",
        "method = \"dop853\"; formulation = \"cartesian\"",
        "method = \"dop853\"; without = [\"row-choice\"]",
        "method = \"dop853\"; engine = \"reference\"",
        "engine = \"reference\"",
    ];
    for keys in kinds {
        // Alike in angle, speed and acceleration at the start; 0.1 t^3 apart.
        let report = run(&driven_twice(keys, "speed = 1, jerk = 1.2", "speed = 1, jerk = 1.8"));
        let summary = &report.summary;
        assert_eq!(summary.status, Status::StoppedEarly, "{keys}: {:?}", summary.audit);
        assert!(summary.reason.contains("one: angle") || summary.reason.contains("other: angle"), "{}", summary.reason);
        // What was written is good to where it is noticed: 0.1 t^3 is 1e-6 of the size at 0.02 s.
        assert!(summary.t_end_reached < 0.05, "{keys}: {}", summary.t_end_reached);
        assert!(off(&report, "phi", |t| t + 0.2 * t.powi(3)) < 1e-5, "{keys}");
        let alike = run(&driven_twice(keys, "speed = 1, jerk = 1.2", "speed = 1, jerk = 1.2"));
        assert_eq!(alike.summary.status, Status::Completed, "{keys}: {}", alike.summary.reason);
    }
}

#[test]
fn drives_at_different_speeds_are_refused() {
    let text = driven_twice("", "speed = 1", "speed = 2");
    let error = Session::with_catalog(scene(&text), Vec::new(), &catalog(), &RunOptions::default()).err().unwrap();
    assert_eq!(error.exit, Exit::Assembly);
    let text = error.to_string();
    assert!(text.contains("contradict each other"), "{text}");
    assert!(
        error.diagnostics.iter().any(|found| format!("{found:?}").contains("row `angle` stays off by 1 rad/s")),
        "{text}"
    );
}

/// Energy turned into heat is distinguished from work that is done otherwise.
#[test]
fn heat_is_told_apart_from_work() {
    let settings = "t_end = 2; output_step = 0.1; tolerance = 1e-9";
    // 6.25 J are in the strut; all that is lost is lost in its damper.
    let audit = run(&oscillator(settings, 50.0, 2.0)).summary.audit;
    let lost = 6.25 - audit.kinetic_energy - audit.potential_energy;
    assert!(lost > 1.0 && (audit.dissipated - lost).abs() < 1e-7 && audit.work_in == 0.0, "{audit:?}");
    let audit = run(&oscillator(settings, 50.0, 0.0)).summary.audit;
    assert_eq!((audit.dissipated, audit.work_in), (0.0, 0.0));
    // Friction that does not say what it is counts as work; both act at the same time.
    let both = oscillator(settings, 50.0, 2.0)
        + "[[body]]\nname = \"rotor\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nangular_velocity = [0, 0, 5]\n\
           [[force]]\nname = \"rubbing\"\ntype = \"friction\"\nbodies = [\"ground\", \"rotor\"]\n";
    let audit = run(&both).summary.audit;
    let left = audit.kinetic_energy + audit.potential_energy;
    assert!((audit.dissipated - lost).abs() < 1e-7 * lost, "{} or {lost}", audit.dissipated);
    assert!((audit.work_in - audit.dissipated - (left - 6.25 - 1.25)).abs() < 1e-7, "{audit:?}");
    assert!(audit.work_in < 0.0, "{audit:?}");
}

/// Two links; the speed of the first is given, that of the second is left open or given, too.
fn links(lower: &str) -> String {
    let link = |name: &str, x: f64, spin: &str| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x:?}, 0, 0]\n{spin}\n")
    };
    let hinge = |name: &str, i: &str, j: &str, x: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"hinge\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{x:?}, 0, 0]\n\
             axis = [0, 0, 1]\n"
        )
    };
    settings("t_end = 0.1; output_step = 0.1")
        + &link("upper", 0.5, "angular_velocity = [0, 0, 2]")
        + &link("lower", 1.5, lower)
        + &hinge("pivot", "ground", "upper", 0.0)
        + &hinge("elbow", "upper", "lower", 1.0)
}

#[test]
fn a_velocity_that_was_chosen_is_reported_with_the_rule() {
    let session = open(&links(""));
    // The elbow moves at 2 m/s, without a blow to turn the lower link: J w + m (2 + w / 2) / 2 = 0.
    let report = session.check_report();
    let spin = report.chosen_velocities.iter().find(|one| one.quantity == "angular velocity").unwrap();
    assert_eq!((spin.body.as_str(), spin.component, spin.unit.as_str()), ("lower", "z", "rad/s"));
    assert!((spin.value - -1.0 / 0.35).abs() < 1e-12, "{spin}");
    assert!(report.chosen_velocities.iter().all(|one| one.body == "lower"), "{:?}", report.chosen_velocities);
    assert_eq!(report.given_velocities.len(), 1);
    let text = report.to_string();
    assert!(
        text.contains("least change in the metric of mass") && text.contains("upper: angular velocity z = 2 rad/s"),
        "{text}"
    );
    let warning = session.warnings.iter().find(|warning| *warning.code == *"ODY0509").unwrap();
    assert!(warning.labels[0].text.contains("lower: angular velocity z = -2.857 rad/s"), "{warning:?}");
    let run = session.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
    let text = crate::results::report(&run.summary, None, false);
    assert!(text.contains("start: velocities chosen by least kinetic energy: lower: "), "{text}");
}

#[test]
fn velocities_that_are_determined_were_not_chosen() {
    // Given, at rest, or following from the joints: a four-bar has one freedom.
    let driven = scenes::four_bar(1.0).replacen("mass = 1.5", "angular_velocity = [0, 0, 3]\nmass = 1.5", 1);
    for text in [links("angular_velocity = [0, 0, 0]"), links("").replace("[0, 0, 2]", "[0, 0, 0]"), driven] {
        let session = open(&text);
        assert_eq!(session.assembly.chosen, [], "{text}");
        assert!(session.warnings.iter().all(|warning| *warning.code != *"ODY0509"));
    }
}

/// Masses have no influence on what is determined: the metric that decides has none.
#[test]
fn light_and_heavy_links_are_told_apart_from_determined_ones() {
    for mass in ["1e-9", "1e9"] {
        let text = links("").replace(
            "mass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [1.5",
            &format!("mass = {mass}\ninertia = [{mass}, {mass}, {mass}]\nposition = [1.5"),
        );
        let chosen = open(&text).assembly.chosen;
        assert!(
            chosen.iter().any(|one| one.body == "lower" && one.angular && one.component == 2),
            "{mass}: {chosen:?}"
        );
        assert!(chosen.iter().all(|one| one.body == "lower"), "{mass}: {chosen:?}");
    }
}
