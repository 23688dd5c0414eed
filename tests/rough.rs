//! Contacts that cannot slide, where a run begins: velocities that the scene leaves open roll, those that it gives are ended by an
//! impulse that is reported.

use odyn::results::EventKind;

use crate::contacts::{every_way_agrees, run};
use crate::support::{column, difference};

const HEAD: &str = "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 5\noutput_step = 0.05\n\
                    tolerance = 1e-11\n";

/// A ball of mass 2 and radius 0.1, J = 2/5 m r^2, that touches the plane z = 0 of a body.
fn ball(on: &str, given: &str) -> String {
    let mut text = format!(
        "[[body]]\nname = \"ball\"\nmass = 2\ninertia = [0.008, 0.008, 0.008]\nposition = [0.7, 0, 0.1]\n{given}\n\
         [[joint]]\nname = \"contact\"\ntype = \"plane-contact\"\nbodies = [\"{on}\", \"ball\"]\n\
         frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\nparams = {{ radius = 0.1, rough = true }}\n"
    );
    for (name, quantity, component) in [
        ("x", "position", "x"),
        ("y", "position", "y"),
        ("vx", "velocity", "x"),
        ("vy", "velocity", "y"),
        ("wy", "angular_velocity", "y"),
    ] {
        text += &format!(
            "[[output]]\nname = \"{name}\"\nquantity = \"{quantity}\"\nof = \"ball\"\ncomponent = \"{component}\"\n"
        );
    }
    text
}

#[track_caller]
fn all_near(found: &[f64], expected: f64) {
    assert!(found.iter().all(|value| (value - expected).abs() < 1e-12), "{expected}: {found:?}");
}

#[test]
fn a_ball_that_is_given_its_speed_alone_rolls_with_it() {
    for given in
        ["velocity = [1, 0, 0]", "velocity = [1, 0, 0]\nangular_velocity = [0, 10, 0]", "angular_velocity = [0, 10, 0]"]
    {
        let report = every_way_agrees(&(HEAD.to_owned() + &ball("ground", given)), 1e-9);
        all_near(column(&report, "vx"), 1.0);
        all_near(column(&report, "wy"), 10.0);
        let summary = &report.summary;
        assert!(summary.warnings.is_empty() && summary.audit.impacts == 0, "{given}: {:?}", summary.warnings);
    }
}

#[test]
fn a_ball_that_is_given_another_spin_is_stopped_by_an_impulse_that_is_reported() {
    let report = every_way_agrees(
        &(HEAD.to_owned() + &ball("ground", "velocity = [1, 0, 0]\nangular_velocity = [0, 0, 0]")),
        1e-9,
    );
    let (vx, wy) = (column(&report, "vx"), column(&report, "wy"));
    // The first row is what the scene gives; the plane takes m v / (1 + 5/2) away.
    assert!(vx[0] == 1.0 && wy[0] == 0.0, "{:?} {:?}", vx[0], wy[0]);
    all_near(&vx[1..], 5.0 / 7.0);
    all_near(&wy[1..], 50.0 / 7.0);
    let audit = &report.summary.audit;
    assert!(audit.impacts == 1 && (audit.lost_in_impacts - 2.0 / 7.0).abs() < 1e-12, "{audit:?}");
    let strike = report.events.iter().find(|event| event.kind == EventKind::Impact).unwrap();
    assert!(strike.time == 0.0 && (strike.lost - 2.0 / 7.0).abs() < 1e-12, "{strike:?}");
}

/// On a turntable a ball that rolls goes round a circle of its own, with 2/7 of the table's speed whatever its own (Gersten et al.,
/// Am. J. Phys. 60, 1992).
#[test]
fn on_a_turntable_a_ball_goes_round_two_sevenths_as_fast() {
    let spin = 2.0_f64;
    let table = format!(
        "[[body]]\nname = \"table\"\nmass = 10\ninertia = [1, 1, 1]\nposition = [0, 0, 0]\n\
         [[joint]]\nname = \"spindle\"\ntype = \"revolute\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"motor\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"table\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
         params.angle = \"{spin:?} * t\"\n"
    );
    let text = HEAD.to_owned()
        + &table
        + &ball("table", "velocity = [0.3, 0.2, 0]\nangular_velocity = [\"free\", \"free\", 0.5]");
    let report = every_way_agrees(&text, 1e-7);
    let w = 2.0 / 7.0 * spin;
    for (k, t) in report.times.iter().enumerate() {
        let (s, c) = (w * t).sin_cos();
        let x = 0.7 + (0.3 * s - 0.2 * (1.0 - c)) / w;
        let y = (0.2 * s + 0.3 * (1.0 - c)) / w;
        let off = (column(&report, "x")[k] - x).abs().max((column(&report, "y")[k] - y).abs());
        assert!(off < 1e-10, "{t}: {off:e}");
    }
}

/// Velocities that a scene leaves open are found so that what touches rolls, also where its centre of mass then rises or sinks: those of least
/// kinetic energy strike or part, and were taken for given ones that do.
#[test]
fn open_velocities_roll_where_the_centre_of_mass_rises() {
    let text = |spin: f64, velocity: &str| {
        let (sin, cos) = 20.0_f64.to_radians().sin_cos();
        let height = (0.1 * sin).hypot(0.015 * cos);
        format!(
            "title = \"tilted\"\nplugins.libraries = [\"odyn-joints\"]\n\
             [simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.05\noutput_step = 0.05\n\
             [[body]]\nname = \"stone\"\nmass = 0.2\ninertia = [4.4e-4, 4.4e-4, 4.4e-4]\nposition = [0, 0, {height:?}]\n\
             orientation = {{ axis = [0, 1, 0], angle = \"20 deg\" }}\nvelocity = {velocity}\nangular_velocity = [0, {spin:?}, 0]\n\
             [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"stone\"]\n\
             frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\n\
             params = {{ half_axes = [0.1, 0.02, 0.015], rough = true }}\n\
             [[output]]\nname = \"vx\"\nquantity = \"velocity\"\nof = \"stone\"\ncomponent = \"x\"\n\
             [[output]]\nname = \"vz\"\nquantity = \"velocity\"\nof = \"stone\"\ncomponent = \"z\"\n\
             [[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"stone\"\ncomponent = \"y\"\n"
        )
    };
    // The point below is at (x, -h) from the centre, where the ellipse has its lowest point: v = -w e_y x r.
    let (sin, cos) = 20.0_f64.to_radians().sin_cos();
    let height = (0.1 * sin).hypot(0.015 * cos);
    let along = -(0.1_f64.powi(2) - 0.015_f64.powi(2)) * sin * cos / height;
    for spin in [2.0, -2.0] {
        let (vx, vz) = (spin * height, -spin * along);
        let found = run(&text(spin, "[\"free\", \"free\", \"free\"]"), &[]);
        let start = |name: &str| column(&found, name)[0];
        let off = [start("vx") - vx, start("vz") - vz, start("w") - spin].map(f64::abs);
        assert!(off.iter().all(|off| *off < 1e-12), "{spin}: {off:?}");
        assert!(found.events.iter().all(|event| event.kind != EventKind::Impact), "{:?}", found.events);
        let given = run(&text(spin, &format!("[{vx:?}, 0, {vz:?}]")), &[]);
        for name in ["vx", "vz", "w"] {
            assert!(difference(column(&found, name), column(&given, name)) < 1e-9, "{name}");
        }
        // One that is given and strikes does so.
        let strikes = run(&text(spin, "[\"free\", \"free\", -0.5]"), &[]);
        assert!(strikes.events.iter().any(|event| event.kind == EventKind::Impact), "{:?}", strikes.events);
    }
}
