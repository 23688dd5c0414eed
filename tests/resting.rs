//! Equilibria that friction holds: closed forms, shares that rigid bodies leave open, runs that start there and stay.

use odyn::analyses::modes::{Modes, Stability};
use odyn::analyses::place::{At, place};
use odyn::analyses::statics::{self, Equilibrium};
use odyn::results::EventKind;

use crate::contacts::run;
use crate::support::{column, open_text};

fn rest(text: &str) -> Equilibrium {
    statics::equilibrium(&open_text(text, &[]), &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}

const HEAD: &str = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 2\n\
                    output_step = 0.1\n";

/// A particle on a plane that falls along x with the angle a.
fn on_a_slope(a: f64, mu: f64, more: &str) -> String {
    let (s, c) = a.sin_cos();
    format!(
        "{HEAD}[[body]]\nname = \"block\"\nmass = 2\nparticle = true\nposition = [{:?}, 0.3, {:?}]\n\
         [[joint]]\nname = \"slope\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"block\"]\n\
         frames = [{{ position = [0, 0, 0], axis = [{s:?}, 0, {c:?}] }}, {{ position = [0, 0, 0] }}]\nparams.mu = {mu:?}\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"y\"\n{more}",
        0.4 * c,
        -0.4 * s
    )
}

/// A run that starts at the equilibrium does not leave it.
#[track_caller]
fn stays(text: &str, names: &[&str]) {
    let found = rest(text);
    let mut run = open_text(text, &["simulation.start=equilibrium"]).prepare().unwrap().start().unwrap();
    run.advance(2.0).unwrap_or_else(|error| panic!("{error}"));
    for name in names {
        let port = found.outputs.iter().find(|port| port.name == *name).unwrap();
        let value = run.output(name).unwrap();
        assert!((value - port.value).abs() < 1e-9, "{name}: {value:?} is not {:?}", port.value);
    }
}

#[test]
fn a_block_stays_on_a_slope_up_to_its_angle_of_friction() {
    let a = 0.3_f64;
    for mu in [0.31, 0.5, 2.0] {
        let text = on_a_slope(a, mu, "");
        let found = rest(&text);
        let [one] = found.friction.as_slice() else { panic!("{:?}", found.friction) };
        assert!(one.holds && (one.share - a.tan() / mu).abs() < 1e-9, "{mu}: {one:?}");
        assert!((found.outputs[0].value - 0.4 * a.cos()).abs() < 1e-12 && (found.outputs[1].value - 0.3).abs() < 1e-12);
        assert!(found.modes.notes.iter().any(|note| note.contains("friction holds the scene where it stands")));
        assert!(found.modes.modes.is_empty() && found.closed.len() == 1, "{:?}", found.modes);
        // It does not move along the plane, but next to this it rests as well.
        assert_eq!((found.stability, found.modes.zeros), (Stability::Held, 2), "{:?}", found.modes);
        assert!(found.modes.neutral.len() == 2 && found.modes.neutral.iter().all(|one| one.held));
        stays(&text, &["x", "y"]);
    }
    // Nothing else holds it.
    let error = statics::equilibrium(&open_text(&on_a_slope(a, 0.3, ""), &[]), &mut |_| ()).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("nothing holds `block`"), "{error}");
}

/// Beside a held block: what hangs from it swings, what nothing drives back is free, and each is said of itself.
#[test]
fn what_friction_holds_is_told_from_what_is_free() {
    let hung = |damping: f64| {
        format!(
            "[[body]]\nname = \"bob\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{:?}, 0.3, {:?}]\n\
             [[joint]]\nname = \"hook\"\ntype = \"revolute\"\nbodies = [\"block\", \"bob\"]\npoint = [{:?}, 0.3, {:?}]\naxis = [0, 1, 0]\n\
             [[force]]\nname = \"rubs\"\ntype = \"rotational-spring-damper\"\nbodies = [\"block\", \"bob\"]\naxis = [0, 1, 0]\n\
             params = {{ stiffness = 0, damping = {damping:?} }}\n",
            0.4 * 0.3_f64.cos(),
            -0.4 * 0.3_f64.sin() - 0.5,
            0.4 * 0.3_f64.cos(),
            -0.4 * 0.3_f64.sin()
        )
    };
    let block = |text: String| text.replace("particle = true", "inertia = [0.1, 0.1, 0.1]");
    let orient = "[[joint]]\nname = \"upright\"\ntype = \"parallel-axes\"\nbodies = [\"ground\", \"block\"]\naxis = [0, 1, 0]\n\
                  [[joint]]\nname = \"level\"\ntype = \"perpendicular-axes\"\nbodies = [\"ground\", \"block\"]\naxes = [[1, 0, 0], [0, 0, 1]]\n";
    let text = |damping: f64| block(on_a_slope(0.3, 0.5, &(orient.to_owned() + &hung(damping))));
    let (damped, undamped) = (rest(&text(0.3)), rest(&text(0.0)));
    assert_eq!((damped.stability, undamped.stability), (Stability::Held, Stability::Undamped), "{:?}", damped.modes);
    assert!(damped.modes.modes.len() == 1 && damped.modes.neutral.iter().all(|one| one.held), "{:?}", damped.modes);
    // A wheel that turns freely about the block.
    let wheel = text(0.3)
        + &format!(
            "[[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{0:?}, 0.3, {1:?}]\n\
             [[joint]]\nname = \"hub\"\ntype = \"revolute\"\nbodies = [\"block\", \"wheel\"]\npoint = [{0:?}, 0.3, {1:?}]\naxis = [0, 1, 0]\n",
            0.4 * 0.3_f64.cos(),
            -0.4 * 0.3_f64.sin()
        );
    let found = rest(&wheel);
    assert_eq!((found.stability, found.modes.zeros), (Stability::Undecided, 4), "{:?}", found.modes);
    let free: Vec<_> = found.modes.neutral.iter().filter(|one| !one.held).collect();
    assert!(free.len() == 1 && free[0].bodies[0].name == "wheel" && free[0].bodies.len() == 1, "{free:?}");
}

/// With a spring that is too soft to hold it and a friction that is too weak: to where the spring holds it alone, which is said.
#[test]
fn where_friction_gives_way_the_equilibrium_is_that_without_it() {
    let a = 0.3_f64;
    let (s, c) = a.sin_cos();
    let spring = format!(
        "[[force]]\nname = \"spring\"\ntype = \"bushing\"\nbodies = [\"ground\", \"block\"]\n\
         frames = [{{ position = [{:?}, 0.3, {:?}] }}, {{ position = [0, 0, 0] }}]\nparams = {{ stiffness = [80, 80, 80], rotational_stiffness = [0, 0, 0] }}\n",
        0.4 * c,
        -0.4 * s
    );
    let found = rest(&on_a_slope(a, 0.2, &spring));
    let [one] = found.friction.as_slice() else { panic!("{:?}", found.friction) };
    assert!(!one.holds && (one.share - a.tan() / 0.2).abs() < 1e-9, "{one:?}");
    let moved = 2.0 * 9.81 * s / 80.0;
    assert!((found.outputs[0].value - (0.4 + moved) * c).abs() < 1e-9, "{:?}", found.outputs);
    assert!(found.modes.notes.iter().any(|note| note.contains("cannot hold the scene where it stands")));
    // The same with enough: the spring is not stretched at all.
    let found = rest(&on_a_slope(a, 0.4, &spring));
    assert!((found.outputs[0].value - 0.4 * c).abs() < 1e-12 && found.friction[0].holds, "{:?}", found.friction);
    stays(&on_a_slope(a, 0.4, &spring), &["x", "y"]);
    stays(&on_a_slope(a, 0.2, &spring), &["x", "y"]);
}

/// A body in the plane y = 0 with feet on planes of the ground: per foot its place on the body, the plane's place and normal.
fn on_feet(body: [f64; 2], center: [f64; 2], feet: &[([f64; 2], [f64; 2], [f64; 2])], mu: f64) -> String {
    let [x, z] = center;
    let mut text = format!(
        "{HEAD}[[body]]\nname = \"body\"\nmass = {:?}\ninertia = [{1:?}, {1:?}, {1:?}]\nposition = [{x:?}, 0, {z:?}]\n\
         [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"body\"]\npoint = [0, 0, 0]\naxis = [0, 1, 0]\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"body\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"body\"\ncomponent = \"z\"\n",
        body[0], body[1]
    );
    for (k, ([px, pz], [ox, oz], [nx, nz])) in feet.iter().enumerate() {
        text += &format!(
            "[[joint]]\nname = \"foot{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"body\"]\n\
             frames = [{{ position = [{ox:?}, 0, {oz:?}], axis = [{nx:?}, 0, {nz:?}] }}, {{ position = [{:?}, 0, {:?}] }}]\n\
             params.mu = {mu:?}\n",
            px - x,
            pz - z
        );
    }
    text
}

/// Two feet on a slope share what rigid bodies leave open: together they need the tangent of its angle, whatever each takes.
#[test]
fn feet_that_share_a_load_hold_together() {
    let a = 0.25_f64;
    let (s, c) = a.sin_cos();
    let at = |along: f64, up: f64| [along * c + up * s, -along * s + up * c];
    let feet = [(at(-0.2, 0.0), [0.0, 0.0], [s, c]), (at(0.3, 0.0), [0.0, 0.0], [s, c])];
    let text = on_feet([3.0, 0.2], at(0.0, 0.15), &feet, 0.3);
    let found = rest(&text);
    let most = found.friction.iter().map(|one| one.share).fold(0.0, f64::max);
    assert!(found.friction.len() == 2 && found.friction.iter().all(|one| one.holds), "{:?}", found.friction);
    assert!((most - a.tan() / 0.3).abs() < 1e-6, "{:?}", found.friction);
    stays(&text, &["x", "z"]);
    let error = statics::equilibrium(&open_text(&on_feet([3.0, 0.2], at(0.0, 0.15), &feet, 0.25), &[]), &mut |_| ());
    assert!(error.is_err());
}

/// A ladder between floor and wall, friction at both: with the same mu it stands as long as tan(angle) >= (1 - mu^2) / (2 mu), which says
/// what share of the friction it needs.
#[test]
fn a_ladder_needs_what_the_closed_form_says() {
    let (angle, length) = (0.9_f64, 2.0);
    let (s, c) = angle.sin_cos();
    let feet = [([0.0, 0.0], [0.0, 0.0], [0.0, 1.0]), ([length * c, length * s], [length * c, 0.0], [-1.0, 0.0])];
    // tan = (1 - m^2) / (2 m): m = sqrt(tan^2 + 1) - tan.
    let needed = (angle.tan().powi(2) + 1.0).sqrt() - angle.tan();
    for mu in [0.36, 0.5, 0.9] {
        let text = on_feet([8.0, 2.7], [0.5 * length * c, 0.5 * length * s], &feet, mu);
        if mu < needed {
            continue;
        }
        let found = rest(&text);
        let most = found.friction.iter().map(|one| one.share).fold(0.0, f64::max);
        assert!((most - needed / mu).abs() < 1e-6, "{mu}: {:?}, {}", found.friction, needed / mu);
        stays(&text, &["x", "z"]);
    }
    assert!(needed < 0.5);
    let slips = on_feet([8.0, 2.7], [0.5 * length * c, 0.5 * length * s], &feet, 0.9 * needed);
    // It slips, and lies on the floor or has nothing to hold it: not where it stood.
    if let Ok(found) = statics::equilibrium(&open_text(&slips, &[]), &mut |_| ()) {
        assert!(found.friction.iter().any(|one| !one.holds), "{:?}", found.friction);
    }
}

/// A friction with a limit of its own beside a spring; others of the scene go to where they rest.
#[test]
fn what_sticks_stays_and_the_rest_goes_to_its_equilibrium() {
    let text = |limit: f64| {
        format!(
            "{HEAD}[[body]]\nname = \"slide\"\nmass = 2\ninertia = [1, 1, 1]\nposition = [0.1, 0, 0]\n\
             [[joint]]\nname = \"guide\"\ntype = \"translational\"\nbodies = [\"ground\", \"slide\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
             [[joint]]\nname = \"rubs\"\ntype = \"dry-friction\"\nbodies = [\"ground\", \"slide\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
             params.force = {limit:?}\n\
             [[force]]\nname = \"spring\"\ntype = \"bushing\"\nbodies = [\"ground\", \"slide\"]\nframes = [{{ position = [0, 0, 0] }}, \
             {{ position = [0, 0, 0] }}]\nparams = {{ stiffness = [50, 0, 0], rotational_stiffness = [0, 0, 0] }}\n\
             [[body]]\nname = \"bob\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\nposition = [0.4, 0, 0]\n\
             [[joint]]\nname = \"pivot\"\ntype = \"revolute\"\nbodies = [\"slide\", \"bob\"]\npoint = [0.1, 0, 0]\naxis = [0, 1, 0]\n\
             [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"slide\"\ncomponent = \"x\"\n\
             [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"bob\"\ncomponent = \"z\"\n"
        )
    };
    let found = rest(&text(8.0));
    assert!((found.friction[0].share - 5.0 / 8.0).abs() < 1e-9 && found.friction[0].holds, "{:?}", found.friction);
    assert!(
        (found.outputs[0].value - 0.1).abs() < 1e-12 && (found.outputs[1].value + 0.3).abs() < 1e-9,
        "{:?}",
        found.outputs
    );
    stays(&text(8.0), &["x", "z"]);
    let found = rest(&text(4.0));
    assert!((found.friction[0].share - 5.0 / 4.0).abs() < 1e-9 && !found.friction[0].holds, "{:?}", found.friction);
    assert!(found.outputs[0].value.abs() < 1e-9 && (found.outputs[1].value + 0.3).abs() < 1e-9, "{:?}", found.outputs);
}

/// A ball that rolls in a hollow swings with sqrt(5 g / (7 (R - r))), wherever the search for its rest begins.
#[test]
fn a_ball_rests_where_it_rolls_to() {
    for x in [0.001, 0.01, 0.08, 0.12] {
        let text = format!(
            "{HEAD}[[body]]\nname = \"ball\"\nmass = 1\ninertia = [0.004, 0.004, 0.004]\nposition = [{x:?}, 0, {z:?}]\n\
             [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"ball\"]\npoint = [0.1, 0, -0.38]\naxis = [0, 1, 0]\n\
             [[joint]]\nname = \"hollow\"\ntype = \"ball-contact\"\nbodies = [\"ground\", \"ball\"]\n\
             frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]\n\
             params = {{ radius_i = 0.5, radius_j = 0.1, inside = true, mu = 0.4 }}\n",
            z = -0.4_f64.mul_add(0.4, -x * x).sqrt()
        );
        let found = rest(&text);
        let [one] = found.friction.as_slice() else { panic!("{x}: {:?}", found.friction) };
        assert!(one.holds && one.share < 1e-6, "{x}: {one:?}");
        let rolls = (5.0 * 9.81 / (7.0 * 0.4_f64)).sqrt() / std::f64::consts::TAU;
        let [mode] = found.modes.modes.as_slice() else { panic!("{x}: {:?}", found.modes.modes) };
        assert!((mode.frequency - rolls).abs() < 1e-9, "{x}: {} for {rolls}", mode.frequency);
    }
}

/// Small motions at an equilibrium say what it takes friction for.
#[test]
fn small_motions_say_what_friction_does() {
    for (limit, words) in [(2.0, "friction cannot hold the scene"), (20.0, "friction holds the scene where it stands")]
    {
        let text = format!(
            "{HEAD}[[body]]\nname = \"block\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n\
             [[joint]]\nname = \"guide\"\ntype = \"translational\"\nbodies = [\"ground\", \"block\"]\naxis = [1, 0, -1]\n\
             [[joint]]\nname = \"grip\"\ntype = \"dry-friction\"\nbodies = [\"ground\", \"block\"]\naxis = [1, 0, -1]\nparams.force = {limit:?}\n\
             [[force]]\nname = \"spring\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"block\"]\n\
             points = [[-1, 0, 1], [0, 0, 0]]\nparams = {{ stiffness = 100, free_length = 1.4142135623730951 }}\n"
        );
        let placed = place(&|| Ok(open_text(&text, &[])), At::Equilibrium, &mut |_| ()).unwrap();
        let linear = placed.linear(Some(&[]), Some(&[])).unwrap();
        let modes = Modes::of(&placed.session, &linear).unwrap();
        assert!(modes.notes.iter().any(|note| note.contains(words)), "{limit}: {:?}", modes.notes);
        assert_eq!(modes.notes, rest(&text).modes.notes);
    }
}

/// A weight that slides, or screws itself, down an upright axis: how far a step may go does not decide whether it is found out.
#[test]
fn what_falls_along_a_joint_is_held_by_nothing() {
    for (joint, reason) in [
        ("type = \"translational\"", "nothing holds `weight`: it goes away"),
        ("type = \"screw\"\nparams.pitch = 0.05", "what moves is held by nothing, or very far from here; `weight`"),
    ] {
        for x in [0.3, 1.0, 2.0] {
            let text = format!(
                "{HEAD}[[body]]\nname = \"weight\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{x:?}, 0, 0]\n\
                 [[joint]]\nname = \"guide\"\n{joint}\nbodies = [\"ground\", \"weight\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n"
            );
            let error = statics::equilibrium(&open_text(&text, &[]), &mut |_| ()).map(|_| ()).unwrap_err();
            assert!(error.to_string().contains(reason), "{joint}: {error}");
        }
    }
}

/// Discs on bearings, each with its inertia and speed, and what else there is.
fn discs(end: f64, discs: &[(f64, f64)], more: &str) -> String {
    let disc = |(k, (inertia, speed)): (usize, &(f64, f64))| {
        format!(
            "[[body]]\nname = \"d{k}\"\nmass = 1\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\nangular_velocity = [0, 0, {speed:?}]\n\
             [[joint]]\nname = \"b{k}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"d{k}\"]\naxis = [0, 0, 1]\n\
             [[output]]\nname = \"w{k}\"\nquantity = \"coordinate_rate\"\nof = \"b{k}\"\n"
        )
    };
    let all: String = discs.iter().enumerate().map(disc).collect();
    format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = {end:?}\noutput_step = {:?}\n{all}{more}",
        end / 100.0
    )
}

/// A disc that a freewheel holds under a load over time, with another at a clutch that sticks. Where a step ended where it opens, an
/// earlier place in that step at which it does so was not seen.
#[test]
fn a_freewheel_opens_each_time_that_its_load_turns_round() {
    let more = r#"[[force]]
name = "s"
type = "rotational-spring-damper"
bodies = ["ground", "d0"]
axis = [0, 0, 1]
params.stiffness = 0.257
[[joint]]
name = "clutch"
type = "clutch"
bodies = ["d1", "d0"]
axis = [0, 0, 1]
params.capacity = 2.96
[[joint]]
name = "wheel"
type = "freewheel"
bodies = ["d1", "ground"]
axis = [0, 0, 1]
[[force]]
name = "m0"
type = "vector-torque"
bodies = ["ground", "d0"]
params.z = 1.1
[[force]]
name = "m1"
type = "vector-torque"
bodies = ["ground", "d1"]
params.z = "3.93 - 6.66 * sin(3.13 * t + PHASE)"
"#;
    for k in 0..16 {
        let text = discs(8.5, &[(0.37, 0.0), (9.8, -0.35)], more);
        let text = text.replace("PHASE", &format!("{:?}", 5.8 + 0.02 * f64::from(k)));
        let of = |formulation: &str| {
            let report = run(&text, &[&format!("simulation.formulation=\"{formulation}\"")]);
            let opens = report.events.iter().filter(|event| event.kind == EventKind::Opens).count();
            (opens, column(&report, "w1").to_vec())
        };
        let ((opens, one), (also, other)) = (of("joint"), of("cartesian"));
        assert_eq!((opens, also), (4, 4), "{k}");
        assert!(one.iter().zip(&other).all(|(a, b)| (a - b).abs() < 1e-8), "{k}");
    }
}

/// Two discs at rest with a stop between them, two brakes on one and one on the other: under a load beyond that of its own brake the first
/// leans on the second. How much each holds is open, and there is always a way.
#[test]
fn discs_that_brakes_and_a_stop_hold_stay_where_they_are() {
    for (inertias, amplitude, phase, load) in [
        ([260.02120779, 265.35200237], 92.14503450220354, 3.2362445233446517, 21.078614047633128),
        ([408.08216248, 7.251897], 104.43835207300447, 3.7877703823238087, 34.32149259207131),
        ([119.73747729, 280.18916309], 86.12095439226047, 2.16287443893914, 31.43194514067462),
        ([12.56147812, 3.96174153], 101.329792190023, 0.5561465840808316, 29.186740894878938),
    ] {
        let brake = |name: &str, disc: &str, capacity: &str| {
            format!(
                "[[joint]]\nname = \"{name}\"\ntype = \"clutch\"\nbodies = [\"ground\", \"{disc}\"]\naxis = [0, 0, 1]\nparams.capacity = \"{capacity}\"\n"
            )
        };
        let torque = |name: &str, disc: &str, torque: String| {
            format!(
                "[[force]]\nname = \"{name}\"\ntype = \"vector-torque\"\nbodies = [\"ground\", \"{disc}\"]\nparams.z = \"{torque}\"\n"
            )
        };
        let more = [
            "[[joint]]\nname = \"stop\"\ntype = \"rotational-stop\"\nbodies = [\"d0\", \"d1\"]\naxis = [0, 0, 1]\nparams.upper = 0\n".to_owned(),
            brake("one", "d1", "113.34"),
            brake("other", "d1", "39.6 * (1 + 0.388 * sin(2.0962 * t))"),
            brake("third", "d0", "102.96"),
            torque("m0", "d0", format!("-(26.45 + {amplitude:?} * sin(1.194 * t + {phase:?}))")),
            torque("m1", "d1", format!("-{load:?}")),
        ];
        let report = run(&discs(6.0, &[(inertias[0], 0.0), (inertias[1], 0.0)], &more.concat()), &[]);
        assert!(["w0", "w1"].iter().all(|name| column(&report, name).iter().all(|w| w.abs() < 1e-12)));
    }
}

/// Nothing acts where the search begins: the load comes with the state of a filter.
#[test]
fn a_load_that_a_filter_has_still_to_bring_is_in_balance_where_it_has() {
    let text = "[plugins]\nlibraries = [\"joints\", \"forces\", \"controls\"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n\
                [[body]]\nname = \"mass\"\nmass = 1\ninertia = [1, 1, 1]\n\
                [[joint]]\nname = \"rail\"\ntype = \"translational\"\nbodies = [\"ground\", \"mass\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
                [[force]]\nname = \"spring\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"mass\"]\n\
                points = [[-1, 0, 0], [0, 0, 0]]\nparams = { stiffness = 10, damping = 1, free_length = 1 }\n\
                [[control]]\nname = \"lag\"\ntype = \"transfer-function\"\ninputs.input = 3\nparams = { numerator = [1], denominator = [5, 1] }\n\
                [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"mass\"]\npoint = [0, 0, 0]\n\
                inputs.x = { signal = \"lag.output\", gain = \"1 N\" }\n\
                [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"mass\"\ncomponent = \"x\"\n";
    let found = rest(text);
    assert!((found.outputs[0].value - 0.3).abs() < 1e-12, "{:?}", found.outputs);
    assert_eq!(found.stability, Stability::Stable);
}

/// A ten-millionth of a metre, ten metres from the origin, and something that looks at where that is: velocities are made of round-off of the
/// place, which no step resolves.
#[test]
fn what_moves_by_little_far_from_the_origin_costs_few_steps() {
    let text = r#"
[plugins]
libraries = ["joints", "forces", "controls"]
[simulation]
t_end = 5
output_step = 0.1
[[body]]
name = "block"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [10.0000001, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "block"]
point = [10, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "bushing"
bodies = ["ground", "block"]
frames = [{ position = [10, 0, 0] }, { position = [0, 0, 0] }]
params = { stiffness = [50, 0, 0], rotational_stiffness = [0, 0, 0], damping = [1, 0, 0] }
[[control]]
name = "sensor"
type = "sensor"
inputs = { input = "x" }
params = { time_constant = 0.1, initial = 10 }
[[output]]
name = "x"
quantity = "position"
of = "block"
component = "x"
"#;
    let report = run(text, &[]);
    // 97 000 before.
    assert!(report.summary.steps < 10_000, "{}", report.summary.steps);
    let (damping, turn) = (0.25, (25.0_f64 - 0.25 * 0.25).sqrt());
    for (t, x) in report.times.iter().zip(column(&report, "x")) {
        let swing = (turn * t).cos() + damping / turn * (turn * t).sin();
        let off = (x - 10.0 - 1e-7 * (-damping * t).exp() * swing).abs();
        assert!(off < 1e-14, "{off:e} at {t}");
    }
}
