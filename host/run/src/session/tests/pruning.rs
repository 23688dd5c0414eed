//! Every saving of the plan: the same results with and without, its entry in the plan, and what it saves.

use super::*;

/// The scene with savings switched off.
pub(super) fn without(text: &str, names: &str) -> String {
    text.replacen("t_end = ", &format!("without = [{names}]\nt_end = "), 1)
}

/// The scene in the coordinates of bodies: those of joints leave nothing to some savings.
pub(super) fn in_bodies(text: &str) -> String {
    text.replacen("t_end = ", "formulation = \"cartesian\"\nt_end = ", 1)
}

/// Largest difference of the columns of two runs, each relative to its largest value (or 1 where that is smaller).
#[track_caller]
pub(super) fn apart(a: &RunReport, b: &RunReport) -> f64 {
    assert_eq!((a.summary.status, b.summary.status), (Status::Completed, Status::Completed));
    assert_eq!((a.times.len(), a.columns.len()), (b.times.len(), b.columns.len()));
    let mut worst = 0.0_f64;
    for (x, y) in a.columns.iter().zip(&b.columns) {
        let size = y.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        for (x, y) in x.iter().zip(y) {
            let off = (x - y).abs() / size;
            worst = if off <= worst { worst } else { off };
        }
    }
    worst
}

/// The entry of a saving in the plan: what it says that it saves.
pub(super) fn saved(text: &str, name: &str) -> Option<String> {
    let report = open(text).plan_report();
    report.skipped.into_iter().find(|skip| skip.without == Some(name)).map(|skip| skip.saved)
}

/// The four-bar with outputs of every kind.
fn four_bar() -> String {
    let parts = ["x", "y", "z"].map(|k| {
        output(&format!("v_{k}"), &format!("quantity = \"velocity\"; of = \"coupler\"; component = \"{k}\""))
            + &output(&format!("a_{k}"), &format!("quantity = \"acceleration\"; of = \"coupler\"; component = \"{k}\""))
            + &output(
                &format!("F_{k}"),
                &format!("quantity = \"reaction_force\"; of = \"C\"; on = \"coupler\"; component = \"{k}\""),
            )
    });
    in_bodies(&scenes::four_bar(1.1)) + &parts.concat() + &output("E", "quantity = \"total_energy\"")
}

#[test]
fn rows_may_stay_all_in_use_in_the_coordinates_of_joints() {
    let text = four_bar().replacen("cartesian", "joint", 1);
    let (chosen, safe) = (run(&text), run(&without(&text, "\"row-choice\"")));
    assert!(safe.summary.engine.contains("rank-safe") && !chosen.summary.engine.contains("rank-safe"));
    let off = apart(&chosen, &safe);
    assert!(off < 1e-9, "{off:e}");
}

#[test]
fn rows_may_stay_all_in_use() {
    let text = four_bar();
    let all = without(&four_bar(), "\"row-choice\"");
    let (chosen, safe) = (run(&text), run(&all));
    assert!(safe.summary.engine.contains("rank-safe") && !chosen.summary.engine.contains("rank-safe"));
    let off = apart(&chosen, &safe);
    assert!(off < 1e-9, "{off:e}");
    assert_eq!(saved(&text, "row-choice").as_deref(), Some("3 of 20 unknown multipliers"));
}

#[test]
fn unknown_savings_are_refused_with_the_nearest_name() {
    let text = without(&four_bar(), "\"kinematic\", \"rowchoice\"");
    let refused = Session::with_catalog(scene(&text), Vec::new(), &catalog(), &RunOptions::default());
    let error = refused.err().unwrap();
    assert_eq!(error.exit, Exit::Scene);
    let diagnostic = &error.diagnostics[0];
    assert_eq!(diagnostic.message, "there is no saving `rowchoice`");
    assert!(diagnostic.help.iter().any(|line| line == "did you mean `row-choice`?"), "{:?}", diagnostic.help);
    assert!(
        diagnostic
            .help
            .iter()
            .any(|line| line.contains("kinematic, row-choice, affine-loops, on-demand, audit, events"))
    );
}

/// A driven slider-crank: crank 0.3 m, rod 0.8 m, a strut that the slider pushes.
fn driven() -> String {
    let body = |name: &str, x: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1.1\ninertia = [0.02, 0.03, 0.04]\nposition = [{x}, 0, 0]\n")
    };
    let joint = |name: &str, kind: &str, bodies: [&str; 2], x: f64, axis: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = [{x}, 0, 0]\naxis = [{axis}]\n"
        )
    };
    settings("gravity = [0, -9.81, 0]; t_end = 2; output_step = 0.05")
        + &body("crank", 0.15)
        + &body("rod", 0.7)
        + &body("slider", 1.1)
        + &joint("bearing", "hinge", ["ground", "crank"], 0.0, "0, 0, 1")
        + &joint("pin", "hinge", ["crank", "rod"], 0.3, "0, 0, 1")
        + &joint("wrist", "hinge", ["rod", "slider"], 1.1, "0, 0, 1")
        + &joint("guide", "slide", ["ground", "slider"], 1.1, "1, 0, 0")
        + &joint("motor", "drive", ["ground", "crank"], 0.0, "0, 0, 1")
        + "params = { speed = 9 }\n"
        + "[[force]]\nname = \"strut\"\ntype = \"strut\"\nbodies = [\"ground\", \"slider\"]\n\
           points = [[3, 0, 0], [1.1, 0, 0]]\nparams = { stiffness = 50, damping = 4 }\n"
        + &output("x", "quantity = \"position\"; of = \"slider\"; component = \"x\"")
        + &output("a", "quantity = \"acceleration\"; of = \"rod\"; component = \"y\"")
        + &output("F", "quantity = \"reaction_force\"; of = \"wrist\"; on = \"slider\"; component = \"x\"")
        + &output("T", "quantity = \"reaction_torque\"; of = \"motor\"; on = \"crank\"; component = \"z\"")
        + &output("phi", "quantity = \"coordinate\"; of = \"bearing\"")
}

#[test]
fn a_driven_mechanism_is_found_not_integrated() {
    let (found, integrated) = (run(&driven()), run(&without(&driven(), "\"kinematic\"")));
    assert_eq!((found.summary.method.as_str(), integrated.summary.method.as_str()), ("kinematic", "dop853"));
    let off = apart(&found, &integrated);
    assert!(off < 1e-9, "{off:e}");
    assert!(2 * found.summary.evaluations < integrated.summary.evaluations, "{:?}", found.summary);
    let audit = &found.summary.audit;
    assert!(audit.position_violation < 1e-14 && audit.energy_error_relative < 1e-9, "{audit:?}");
    assert!(audit.work.abs() > 1.0 && (audit.work - integrated.summary.audit.work).abs() < 1e-8);
    // Against the formula: x = 0.3 cos 9 t + sqrt(0.8^2 - 0.3^2 sin^2 9 t).
    let exact = |t: f64| 0.3 * (9.0 * t).cos() + (0.64 - (0.3 * (9.0 * t).sin()).powi(2)).sqrt();
    assert!(super::off(&found, "x", exact) < 1e-14);
    assert!(super::off(&found, "phi", |t| 9.0 * t) < 1e-13, "turns are counted");
    let told = saved(&driven(), "kinematic").unwrap_or_default();
    assert!(told.starts_with("the error control of 39 states"), "{told}");
    // A scene that names its method gets it.
    let named = run(&driven().replacen("t_end", "method = \"dopri5\"\nt_end", 1));
    assert_eq!(named.summary.method, "dopri5");
}

#[test]
fn what_no_output_asks_for_is_not_solved_for() {
    let text = in_bodies(&scenes::four_bar(1.1))
        + &output("x", "quantity = \"position\"; of = \"coupler\"; component = \"x\"");
    let (asked, all) = (run(&text), run(&without(&text, "\"on-demand\"")));
    assert_eq!(apart(&asked, &all), 0.0);
    assert_eq!(saved(&text, "on-demand").as_deref(), Some("11 solutions"));
    // Rates at samples are solved with the factor of the projection before; those on steps' ends are known.
    assert_eq!(asked.summary.factorisations, all.summary.factorisations);
}

#[test]
fn constants_and_zeros_are_counted() {
    let report = open(&scenes::four_bar(1.1)).plan_report();
    let saved = |what: &str| {
        let entry = report.skipped.iter().find(|skip| skip.what == what);
        entry.map(|skip| skip.saved.clone()).unwrap_or_else(|| panic!("{:?}", report.skipped))
    };
    assert_eq!(saved("derivatives that are constant"), "6 of 106 entries of the Jacobian");
    assert_eq!(saved("derivatives that are zero"), "74 of 180 entries of the Jacobian");
    assert_eq!(saved("derivatives with respect to time"), "20 rows");
}

#[test]
fn interpolation_is_prepared_only_where_an_output_time_lies_inside_a_step() {
    let with = |times: &str| {
        run(&in_bodies(&scenes::pendulum(&settings(&format!("gravity = [0, -9.81, 0]; t_end = 1; {times}")))))
    };
    let (few, many) = (with("output_times = [1]").summary, with("output_step = 0.001").summary);
    assert_eq!(few.steps, many.steps);
    // Three stages more for the polynomial of dop853.
    assert_eq!(many.evaluations, few.evaluations + 3 * few.steps);
}

#[test]
fn violations_are_looked_at_in_some_states_only() {
    let text = scenes::four_bar(1.1);
    let [some, all] = [run(&text), run(&without(&text, "\"audit\""))];
    assert_eq!(some.columns, all.columns);
    let violation = |report: &RunReport| report.summary.audit.position_violation;
    assert!(0.0 < violation(&some) && violation(&some) <= violation(&all), "{} {}", violation(&some), violation(&all));
    assert_eq!(some.summary.audit.energy_error_relative, all.summary.audit.energy_error_relative);
    assert!(saved(&text, "audit").is_some() && saved(&without(&text, "\"audit\""), "audit").is_none());
}
