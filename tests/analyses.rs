//! Equilibria, modes and linear models: against closed forms, and against differences of the accelerations that runs find in the
//! coordinates of joints and of bodies.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Quaternion, SymmetricEigen, Vector3};
use odyn::analyses::campbell::Campbell;
use odyn::analyses::linear::Linear;
use odyn::analyses::modes::{Modes, Stability};
use odyn::analyses::statics::{Equilibrium, equilibria, equilibrium};
use odyn::diagnostics::codes;
use odyn::results::Status;
use odyn::session::{Instant, RunOptions, Session};

use crate::support::{Scratch, column, options, root};

fn session(path: &Path, sets: &[&str]) -> Session {
    Session::open(path, &options(sets, &[])).unwrap_or_else(|error| panic!("{error}"))
}

fn benchmark(name: &str, sets: &[&str]) -> Session {
    session(&root().join(format!("scenes/benchmarks/{name}.toml")), sets)
}

fn of_text(text: &str, sets: &[&str]) -> Session {
    let scratch = Scratch::new();
    session(&scratch.file("scene.toml", text), sets)
}

#[track_caller]
fn rest(session: &Session) -> Equilibrium {
    let found = equilibrium(session, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    assert!(found.audit.balance <= 100.0 && found.audit.rows < 1e-10, "{:?}", found.audit);
    found
}

fn at_start(session: Session, again: Session) -> (Session, Instant) {
    let mut run = session.prepare().unwrap().start().unwrap();
    (again, run.instant().unwrap())
}

fn modes(session: &Session, instant: &Instant) -> Modes {
    let linear = Linear::at(session, instant, Some(&[]), Some(&[])).unwrap_or_else(|error| panic!("{error}"));
    let modes = Modes::of(session, &linear).unwrap();
    assert!(modes.modes.iter().all(|mode| mode.residual < 1e-12), "{modes:?}");
    modes
}

const PENDULUM: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
angle = 1.0
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "rod"
mass = 2
inertia = [0.01, 0.5, 0.5]
position = ["0.7 * cos(angle)", "0.7 * sin(angle)", 0]
orientation = { axis = [0, 0, 1], angle = "angle" }
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "rod"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [-0.7, 0, 0], axis = [0, 0, 1] }]
"#;

#[test]
fn a_pendulum_hangs_and_one_that_stands_is_unstable() {
    let square: f64 = 2.0 * 9.81 * 0.7 / (0.5 + 2.0 * 0.49);
    let hanging = rest(&of_text(PENDULUM, &[]));
    assert_eq!(hanging.stability, Stability::Undamped);
    let [x, y, _] = hanging.bodies[0].position;
    assert!(x.abs() < 1e-12 && (y + 0.7).abs() < 1e-12, "{x:e} {y}");
    let mode = &hanging.modes.modes[0];
    assert!((mode.imaginary / square.sqrt() - 1.0).abs() < 1e-12, "{mode:?}");
    let standing = rest(&of_text(PENDULUM, &["angle=pi/2"]));
    assert_eq!(standing.stability, Stability::Unstable);
    let grows = standing.modes.modes.iter().find(|mode| mode.real > 0.0).unwrap();
    assert!((grows.real / square.sqrt() - 1.0).abs() < 1e-9, "{grows:?}");
    // From other starts both are found, or the stable one again and again.
    let all = equilibria(&of_text(PENDULUM, &["angle=pi/2"]), 6, &mut |_| ()).unwrap();
    assert!(all.failed.is_empty() && all.found.len() == 2, "{:?}", all.failed);
}

/// A cantilever of `n` beams along x, of length, E I and G J 1 m and 1 N m^2 and E A 1e6 N, with a load along x and one along y at its end.
fn strip(n: usize, along: f64, across: f64) -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, 0]\nt_end = 1\noutput_step = 0.1\n",
    );
    for k in 1..=n {
        let before = if k == 1 { "ground".to_owned() } else { format!("b{}", k - 1) };
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = 0.1\ninertia = [1e-4, 1e-4, 1e-4]\nposition = [{}, 0, 0]\n[[force]]\nname = \"beam{k}\"\n\
             type = \"beam\"\nbodies = [\"{before}\", \"b{k}\"]\nframes = [{{}}, {{}}]\nparams = {{ length = {}, young = 1e6, \
             shear = 1e6, area = 1, iy = 1e-5, iz = 1e-6, torsion = 1e-6 }}\n",
            k as f64 / n as f64,
            1.0 / n as f64,
        );
    }
    text + &format!(
        "[[force]]\nname = \"weight\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"b{n}\"]\npoint = [1, 0, 0]\n\
         params = {{ x = {along}, y = {across} }}\n"
    )
}

/// Beyond the critical load pi^2 E I / (4 L^2): beside the straight column, which falls, it rests bent to either side, near the elastica
/// (x = (2 E(k) / K(k) - 1) L, y = 2 k / K(k) L with K(k)^2 = P L^2 / (E I), k = 0.5582 for 1.2).
#[test]
fn a_column_that_buckles_is_found_bent_to_both_sides() {
    let all = equilibria(&of_text(&strip(8, -1.2 * PI.powi(2) / 4.0, 0.0), &[]), 3, &mut |_| ()).unwrap();
    assert!(all.failed.is_empty(), "{:?}", all.failed);
    let stability: Vec<Stability> = all.found.iter().map(|found| found.stability).collect();
    assert_eq!(stability, [Stability::Unstable, Stability::Undamped, Stability::Undamped]);
    // What grows is shown, however few modes are asked for; of what grows nowhere, no more than these.
    let unstable = &all.found[0].modes;
    assert!(unstable.foremost(0).iter().any(|mode| mode.decided && mode.real > 0.0));
    assert_eq!((unstable.foremost(1000).len(), all.found[1].modes.foremost(2).len()), (unstable.modes.len(), 2));
    let tips: Vec<[f64; 3]> = all.found.iter().map(|found| found.bodies[7].position).collect();
    assert!(tips[1][1] * tips[2][1] < 0.0, "{tips:?}");
    assert!((tips[1][0] - tips[2][0]).abs() < 1e-9 && (tips[1][1] + tips[2][1]).abs() < 1e-9, "{tips:?}");
    assert!((tips[1][0] - 0.6739).abs() < 2e-3 && (tips[1][1].abs() - 0.6488).abs() < 2e-3, "{tips:?}");
}

/// A cantilever under tension N with a small load P across: y = P / N (L - tanh(k L) / k), k^2 = N / (E I); and the load that buckles
/// it. By four beams, which were unstable from N L^2 / (E I) = 4 for each on while their axial strain was measured along their first ends.
#[test]
fn tension_stiffens_beams_and_compression_buckles_them() {
    for (pull, tolerance) in [(1.0_f64, 1e-5), (50.0, 2e-3), (200.0, 1e-2)] {
        let deflection = |n: usize| {
            let rest = rest(&of_text(&strip(n, pull, 1e-4), &[]));
            assert_eq!(rest.stability, Stability::Undamped, "{pull}, {n}");
            rest.bodies[n - 1].position[1] / 1e-4
        };
        let k = pull.sqrt();
        let exact = (1.0 - k.tanh() / k) / pull;
        let error = [4, 8].map(|n| (deflection(n) / exact - 1.0).abs());
        assert!(error[0] < tolerance && error[1] < error[0] / 8.0 + 2e-6, "{pull}: {error:?}");
    }
    // One beam alone is bent further than it may be.
    for (load, said) in [(1.0, true), (0.1, false)] {
        let notes = rest(&of_text(&strip(1, 0.0, load), &[])).modes.notes;
        assert_eq!(notes.iter().any(|note| note.starts_with("`beam1` is deformed by more")), said, "{notes:?}");
    }
    let critical = PI.powi(2) / 4.0;
    let stability = |load: f64| rest(&of_text(&strip(4, -load, 0.0), &[])).stability;
    assert_eq!([0.999, 1.001].map(|share| stability(share * critical)), [Stability::Undamped, Stability::Unstable]);
}

/// Nothing moves, so nothing decays either.
#[test]
fn what_has_no_degree_of_freedom_is_not_called_stable() {
    let frames = PENDULUM.lines().find(|line| line.starts_with("frames")).unwrap();
    let held = PENDULUM.replace("revolute", "bracket").replace(frames, "point = [0, 0, 0]");
    let held = rest(&of_text(&held, &[]));
    assert_eq!((held.stability, held.modes.coordinates, held.modes.modes.len()), (Stability::Immobile, 0, 0));
    assert!(held.stability.words().contains("no degree of freedom"));
}

#[test]
fn a_run_starts_at_the_equilibrium_with_the_velocities_of_the_scene() {
    let at_rest = ["simulation.start=equilibrium"];
    let hanging = rest(&of_text(PENDULUM, &[]));
    let started = of_text(PENDULUM, &at_rest);
    assert!(started.warnings.is_empty(), "{:?}", started.warnings);
    let apart = started.assembly.working.iter().zip(hanging.restart(&started).working).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-12, "{:?}", started.assembly.working);
    assert!(started.assembly.moves.is_empty());
    // What a driver carries has its velocity; what is given is kept.
    let driver = "[[joint]]\nname = \"slide\"\ntype = \"displacement-driver\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\n\
                  axis = [1, 0, 0]\nparams.displacement = \"0.3 * t\"\n";
    let cart = "[[body]]\nname = \"cart\"\nmass = 1\ninertia = [1, 1, 1]\n[[joint]]\nname = \"rail\"\ntype = \"translational\"\n\
                bodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n";
    let rod = PENDULUM.replace("bodies = [\"ground\", \"rod\"]", "bodies = [\"cart\", \"rod\"]");
    let rod = rod.replace("mass = 2\n", "mass = 2\nangular_velocity = [0, 0, 0]\n");
    let carried = of_text(&format!("{rod}{cart}{driver}"), &at_rest);
    for (body, at, speed) in [("rod", [0.0, -0.7], 0.3), ("cart", [0.0, 0.0], 0.3)] {
        let place = carried.model.bodies.iter().position(|one| one.name == body).unwrap();
        let state = &carried.assembly.working[13 * place..13 * (place + 1)];
        assert!((state[0] - at[0]).abs() + (state[1] - at[1]).abs() < 1e-10, "{body}: {state:?}");
        assert!((state[7] - speed).abs() + state[8].abs() + state[12].abs() < 1e-10, "{body}: {state:?}");
    }
    // One that stands is a start, too, and not a silent one.
    let standing = of_text(PENDULUM, &["angle=pi/2", at_rest[0]]);
    assert_eq!(standing.warnings.len(), 1);
    assert_eq!(standing.warnings[0].code, codes::UNSTABLE_START);
}

/// At rest accelerations are round-off of the forces that cancel in them, and no step has to resolve that.
#[test]
fn what_hangs_at_rest_costs_few_steps_and_stays() {
    for (formulation, most) in [("joint", 200), ("cartesian", 4000)] {
        let formulation = format!("simulation.formulation={formulation}");
        let resting = benchmark("chain_N10", &["simulation.start=equilibrium", &formulation]);
        let report = resting.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        assert_eq!(report.summary.status, Status::Completed);
        assert!(report.summary.steps < most, "{formulation}: {} steps", report.summary.steps);
        let tip = column(&report, "tip_x");
        assert!(tip.iter().all(|x| x.abs() < 1e-9), "{tip:?}");
    }
}

#[test]
fn a_start_at_equilibrium_that_cannot_be_is_refused() {
    let scratch = Scratch::new();
    let refused = |text: &str, sets: &[&str], find: bool| {
        let given = options(sets, &[]);
        let options = RunOptions { equilibrium: given.equilibrium.filter(|_| find), ..given };
        let error = Session::open(&scratch.file("scene.toml", text), &options).err().expect("refused");
        (error.exit_code(), error.to_string())
    };
    let at_rest = "simulation.start=equilibrium";
    let (code, message) = refused(PENDULUM.split("[[joint]]").next().unwrap(), &[at_rest], true);
    assert!(code == 5 && message.contains("nothing holds `rod`"), "{code} {message}");
    let (code, message) = refused(PENDULUM, &["simulation.start=rest"], true);
    assert!(code == 3 && message.contains("`start` cannot be `rest`"), "{code} {message}");
    // A program that does not look for equilibria does not run such a scene from elsewhere.
    let (code, message) = refused(PENDULUM, &[at_rest], false);
    assert!(code == 5 && message.contains("RunOptions::equilibrium"), "{code} {message}");
}

#[test]
fn what_nothing_holds_is_refused_by_name() {
    let text = PENDULUM.split("[[joint]]").next().unwrap();
    let error = equilibrium(&of_text(text, &[]), &mut |_| ()).unwrap_err();
    assert!(error.to_string().contains("nothing holds `rod`"), "{error}");
    assert_eq!(error.exit_code(), 5);
    // Without weight it floats, and is asked to.
    let floating = rest(&of_text(text, &["simulation.gravity=[0, 0, 0]"]));
    assert_eq!((floating.stability, floating.modes.zeros), (Stability::Undecided, 12));
    assert_eq!(floating.modes.neutral.len(), 6);
}

#[test]
fn a_chain_hangs_straight_and_swings_as_its_closed_form() {
    let (n, m, l, g) = (10, 0.1, 0.1, 9.81);
    let found = rest(&benchmark("chain_N10", &[]));
    for (k, body) in found.bodies.iter().enumerate() {
        assert!((body.position[1] + l * (k as f64 + 0.5)).abs() < 1e-10 && body.position[0].abs() < 1e-9, "{body:?}");
    }
    // Small angles: centres move by l (angles above) + l / 2 (own).
    let mut mass = DMatrix::from_diagonal_element(n, n, m * l * l / 12.0);
    for body in 0..n {
        let arm = DVector::from_fn(n, |k, _| {
            if k < body {
                l
            } else if k == body {
                0.5 * l
            } else {
                0.0
            }
        });
        mass += &arm * arm.transpose() * m;
    }
    let stiffness = DMatrix::from_diagonal(&DVector::from_fn(n, |k, _| m * g * l * (n as f64 - k as f64 - 0.5)));
    let half = DMatrix::from_diagonal(&stiffness.diagonal().map(|k| 1.0 / k.sqrt()));
    let squares = SymmetricEigen::new(&half * mass * &half).eigenvalues.map(|value| 1.0 / value);
    let mut expected: Vec<f64> = squares.iter().map(|square| square.sqrt()).collect();
    expected.sort_by(f64::total_cmp);
    let planar: Vec<f64> = found.modes.modes.iter().map(|mode| mode.imaginary).collect();
    assert_eq!(planar.len(), n);
    for (found, expected) in planar.iter().zip(&expected) {
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
}

#[test]
fn a_four_bar_at_rest_swings_or_falls_as_its_closed_form() {
    // Links 2 m l^2 / 3 and a coupler m l^2 that does not turn; weights 2 m g l. It starts upright.
    let square: f64 = 2.0 * 9.81 / (2.0 / 3.0 + 1.0);
    let found = equilibria(&benchmark("A02_N1", &[]), 8, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let upright = &found.found[0];
    assert!(!upright.not_unique.is_empty(), "planar loops of spatial joints are redundant");
    assert_eq!(upright.stability, Stability::Unstable);
    assert!(upright.modes.modes.iter().any(|mode| (mode.real / square.sqrt() - 1.0).abs() < 1e-9));
    let hangs = |one: &&Equilibrium| one.bodies.iter().all(|body| body.position[1] < -0.4);
    let hanging = found.found.iter().find(hangs).expect("it hangs, too");
    assert_eq!(hanging.stability, Stability::Undamped);
    assert!((hanging.modes.modes[0].imaginary / square.sqrt() - 1.0).abs() < 1e-9, "{:?}", hanging.modes);
}

#[test]
fn cantilevers_of_beams_tend_to_euler_and_bernoulli() {
    let path = root().join("scenes/verification/beam-chain.toml");
    let open = || session(&path, &[]);
    let found = rest(&open());
    let w = 1.875_104_068_711_961_f64.powi(2);
    let mut errors = Vec::new();
    for (n, allowed) in [(4, 0.1), (8, 0.025), (16, 0.007)] {
        let name = format!("n{n}_");
        // The lowest mode of this cantilever.
        let own = found.modes.modes.iter().find(|mode| mode.kinetic[0].name.starts_with(&name)).unwrap();
        errors.push(1.0 - own.imaginary / w);
        assert!((errors[errors.len() - 1]).abs() < allowed, "{n}: {errors:?}");
    }
    assert!((errors[0] / errors[1] - 4.0).abs() < 0.6 && (errors[1] / errors[2] - 4.0).abs() < 0.3, "{errors:?}");
}

/// A disc that spins in a housing, which tilts against springs about a point: J q'' - i Jz W q' + k q = 0.
const ROTOR: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
spin = 40.0
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "housing"
mass = 1
inertia = [0.2, 0.2, 0.3]
velocity = [0, 0, 0]
angular_velocity = [0, 0, 0]
[[body]]
name = "disc"
mass = 3
inertia = [0.4, 0.4, 0.7]
velocity = [0, 0, 0]
angular_velocity = [0, 0, "spin"]
[[joint]]
name = "point"
type = "spherical"
bodies = ["ground", "housing"]
point = [0, 0, 0]
[[joint]]
name = "shaft"
type = "revolute"
bodies = ["housing", "disc"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "springs"
type = "bushing"
bodies = ["ground", "housing"]
point = [0, 0, 0]
params = { stiffness = [0, 0, 0], rotational_stiffness = [300, 300, 50] }
"#;

#[test]
fn a_rotor_whirls_as_gyroscopic_terms_say() {
    let (session, instant) = at_start(of_text(ROTOR, &[]), of_text(ROTOR, &[]));
    let found = modes(&session, &instant);
    let (j, jz, k, w) = (0.6, 0.7, 300.0, 40.0);
    let half: f64 = jz * w / (2.0 * j);
    let root = (half * half + k / j).sqrt();
    let torsion = (50.0_f64 / 0.3).sqrt();
    let mut expected = [root - half, root + half, torsion];
    expected.sort_by(f64::total_cmp);
    let mut swings: Vec<f64> = found.modes.iter().map(|mode| mode.imaginary).collect();
    swings.sort_by(f64::total_cmp);
    assert_eq!((swings.len(), found.zeros), (3, 2), "{found:?}");
    for (found, expected) in swings.iter().zip(&expected) {
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
    assert!(found.notes.iter().any(|note| note.contains("the scene moves")), "{:?}", found.notes);
}

#[test]
fn branches_of_a_rotor_cross_each_other() {
    let speeds: Vec<f64> = (0..=12).map(|k| 5.0 * f64::from(k)).collect();
    let values: Vec<String> = speeds.iter().map(f64::to_string).collect();
    let mut ask = |value: &str| {
        let spin = format!("spin={value}");
        let (session, instant) = at_start(of_text(ROTOR, &[&spin]), of_text(ROTOR, &[&spin]));
        Ok(modes(&session, &instant))
    };
    let found = Campbell::over("spin", &values, &mut ask).unwrap();
    // The backward whirl falls through the torsion of the housing, which it does not know of.
    let (j, jz, k) = (0.6_f64, 0.7, 300.0_f64);
    let whirl = |spin: f64, side: f64| {
        let half = jz * spin / (2.0 * j);
        (half * half + k / j).sqrt() + side * half
    };
    let expected: [&dyn Fn(f64) -> f64; 3] = [&|w| whirl(w, -1.0), &|w| whirl(w, 1.0), &|_| (50.0_f64 / 0.3).sqrt()];
    assert!(expected[0](0.0) > expected[2](0.0) && expected[0](60.0) < expected[2](60.0));
    assert_eq!(found.branches.len(), 3, "{:?}", found.branches);
    for expected in expected {
        let follows = |branch: &usize| {
            let modes: Vec<_> = found.branch(*branch).collect();
            modes.len() == 13
                && modes.iter().all(|(at, mode)| (mode.imaginary / expected(speeds[*at]) - 1.0).abs() < 1e-9)
        };
        assert_eq!((0..3).filter(follows).count(), 1, "{}", found.csv());
    }
}

/// Largest difference between the accelerations that the linear model gives for small changes of each state, and those that
/// runs find for changes of some size, on the largest of them.
pub(crate) fn miss(open: &dyn Fn() -> Session, linear: &Linear, base: &Equilibrium, step: f64) -> f64 {
    let layout = open().plan.layout.clone();
    let (mut worst, mut size) = (0.0_f64, 0.0_f64);
    for state in 0..linear.states.len() {
        let mut found = [DVector::zeros(0), DVector::zeros(0)];
        for (side, found) in [step, -step].into_iter().zip(&mut found) {
            let mut session = open();
            let mut restart = base.restart(&session);
            for body in 0..layout.bodies {
                let y = &mut restart.working[13 * body..13 * body + 13];
                let part = |matrix: &DMatrix<f64>, at: usize| {
                    Vector3::from_fn(|k, _| side * matrix[(6 * body + at + k, state)])
                };
                let turn = part(&linear.positions, 3);
                let by = Quaternion::from_parts(1.0, turn * 0.5).normalize();
                let p = by * Quaternion::new(y[3], y[4], y[5], y[6]);
                let moved = [part(&linear.positions, 0), part(&linear.velocities, 0)];
                (0..3).for_each(|k| (y[k], y[7 + k]) = (y[k] + moved[0][k], moved[1][k]));
                (y[3], y[4], y[5], y[6]) = (p.w, p.i, p.j, p.k);
                let spin = odyn::model::rotation(&[p.w, p.i, p.j, p.k]).transpose() * part(&linear.velocities, 3);
                y[10..13].copy_from_slice(spin.as_slice());
            }
            if let Some(k) = state.checked_sub(linear.states.len() - linear.element_states) {
                let own = |element: usize| layout.state_at[element]..layout.unknown_at[element];
                let number = (0..layout.state_at.len()).flat_map(own).nth(k).unwrap();
                restart.working[13 * layout.bodies + number] += side;
            }
            session.go_on_from(restart).unwrap_or_else(|error| panic!("{error}"));
            let mut run = session.prepare().unwrap().start().unwrap();
            let instant = run.instant().unwrap();
            *found = DVector::from_column_slice(&instant.inputs[layout.acceleration_slot()..][..layout.velocities()]);
        }
        let difference = (&found[0] - &found[1]) / (2.0 * step);
        let mut expected = &linear.velocities * linear.a.column(state);
        // Angular accelerations of runs are in the axes of the bodies.
        for body in 0..layout.bodies {
            let p = &base.bodies[body].orientation;
            let local = odyn::model::rotation(p).transpose() * expected.fixed_rows::<3>(6 * body + 3).into_owned();
            expected.fixed_rows_mut::<3>(6 * body + 3).copy_from(&local);
        }
        size = size.max(expected.amax());
        worst = worst.max((difference - expected).amax());
    }
    worst / size.max(f64::MIN_POSITIVE)
}

#[test]
fn linear_models_are_what_differences_of_either_formulation_say() {
    for (name, gravity) in [("A04", true), ("A02_N1", true), ("chain_N10", true), ("A05", true)] {
        for formulation in ["joint", "cartesian"] {
            let set = format!("simulation.formulation={formulation}");
            let open = || benchmark(name, &[&set]);
            let session = open();
            let base = rest(&session);
            let linear = Linear::at(&session, &base.instant, Some(&[]), Some(&[])).unwrap();
            assert!(linear.at_rest && gravity, "{name}: {:?}", linear.notes);
            let off = miss(&open, &linear, &base, 1e-6);
            assert!(off < 1e-6, "{name}, {formulation}: {off:e}");
        }
    }
}

/// A table that may slide and turn on a floor: nothing holds it, and round-off of its weight is no stiffness.
#[test]
fn what_slides_freely_is_neutral_and_not_unstable() {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.1\n\
         [[body]]\nname = \"table\"\nmass = 10\ninertia = [1, 1, 1.5]\nposition = [0, 0, 0.7]\n",
    );
    for (k, [x, y]) in [[-0.5, -0.4], [0.6, -0.3], [0.1, 0.5]].iter().enumerate() {
        text += &format!(
            "[[joint]]\nname = \"leg_{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"table\"]\n\
             frames = [{{ position = [0, 0, 0] }}, {{ position = [{x:?}, {y:?}, -0.5] }}]\n"
        );
    }
    let found = rest(&of_text(&text, &[]));
    assert_eq!((found.stability, found.modes.zeros), (Stability::Undecided, 6), "{:?}", found.modes);
    assert_eq!(found.closed.len(), 3);
}

#[test]
fn internal_unknowns_and_rows_that_states_move_follow() {
    for scene in ["ellipse-contact", "servo-rotation", "servo-displacement"] {
        for formulation in ["joint", "cartesian"] {
            let set = format!("simulation.formulation={formulation}");
            let open = || session(&root().join(format!("scenes/verification/{scene}.toml")), &[&set]);
            let session = open();
            let base = rest(&session);
            let linear = Linear::at(&session, &base.instant, Some(&[]), Some(&[])).unwrap();
            let off = miss(&open, &linear, &base, 1e-6);
            assert!(linear.at_rest && off < 1e-6, "{scene}, {formulation}: {off:e}, {:?}", linear.notes);
        }
    }
}

/// A chain of rods in space, from joints with springs and dampers: `close` is what else holds it.
fn damped_chain(close: &str) -> String {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 40\n\
         output_step = 1\ntolerance = 1e-11\nmethod = \"radau5\"\n",
    );
    let axes = [[0, 1, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]];
    for (k, [x, y, z]) in axes.into_iter().enumerate() {
        let at = 0.4 * k as f64;
        let before = if k == 0 { "ground".into() } else { format!("rod{}", k - 1) };
        text += &format!(
            "[[body]]\nname = \"rod{k}\"\nmass = {}\ninertia = [0.004, 0.02, 0.021]\nposition = [{}, {}, 0]\n\
             [[joint]]\nname = \"pin{k}\"\ntype = \"revolute\"\nbodies = [\"{before}\", \"rod{k}\"]\npoint = [{at}, 0, 0]\n\
             axis = [{x}, {y}, {z}]\n\
             [[force]]\nname = \"spring{k}\"\ntype = \"rotational-spring-damper\"\nbodies = [\"{before}\", \"rod{k}\"]\n\
             axis = [{x}, {y}, {z}]\nparams = {{ stiffness = {}, damping = {} }}\n\
             [[output]]\nname = \"a{k}\"\nquantity = \"coordinate\"\nof = \"pin{k}\"\nchannel = \"angle\"\n",
            0.7 + 0.2 * k as f64,
            at + 0.2,
            0.03 * (k as f64 + 1.0),
            9.0 - 1.5 * k as f64,
            6.0 - k as f64
        );
    }
    text + close
}

/// Where a run with heavy dampers comes to rest is where `statics` says, to 1e-9: an open chain, and one that a rod closes to a loop.
#[test]
fn heavily_damped_runs_come_to_rest_at_the_equilibrium() {
    let rod = "[[joint]]\nname = \"stay\"\ntype = \"distance-rod\"\nbodies = [\"ground\", \"rod3\"]\n\
               points = [[0.6, 0.9, -0.4], [1.6, 0, 0]]\nparams.length = \"sqrt(1.97)\"\n";
    for close in ["", rod] {
        let open = || of_text(&damped_chain(close), &[]);
        let found = rest(&open());
        assert_eq!(found.stability, Stability::Stable);
        let moved = found.outputs.iter().map(|one| one.value.abs()).fold(0.0, f64::max);
        assert!(moved > 0.1, "it rests where it starts: {:?}", found.outputs);
        let mut run = open().prepare().unwrap().start().unwrap();
        run.advance(40.0).unwrap_or_else(|error| panic!("{error}"));
        for port in &found.outputs {
            let value = run.output(&port.name).unwrap();
            assert!((value - port.value).abs() < 1e-9, "{}: {value:?} is not {:?}", port.name, port.value);
        }
    }
}

/// The motion that a report shows of a mode is the mode: back at its start after a period, and bodies as far from the place as its shape says.
#[test]
fn modes_are_shown_along_a_period_of_each() {
    let session = benchmark("chain_N10", &[]);
    let found = rest(&session);
    let page = odyn::analyses::shown::modes(&session, &found.instant, &found.modes).unwrap();
    let moves = page.moves.as_ref().unwrap();
    assert_eq!(moves.parts.len(), found.modes.modes.len());
    let pictures = moves.records.len() / moves.parts.len();
    for (number, mode) in found.modes.modes.iter().enumerate() {
        let part = &moves.parts[number];
        assert_eq!((part.from, part.to), (number as f64, number as f64 + 1.0));
        let own = &moves.records[number * pictures..(number + 1) * pictures];
        let (first, last) = (&own[0].1, &own[pictures - 1].1);
        assert!(first.iter().zip(last).all(|(a, b)| (a - b).abs() < 1e-6), "mode {number} does not come back");
        let size = 0.1 * moves.header.length;
        for (body, shape) in mode.shape.iter().enumerate() {
            // Frames of this scene are at the centres of mass.
            for k in 0..3 {
                let away = own[0].1[7 * body + k] - found.bodies[body].position[k];
                assert!((away - size * shape.displacement[k]).abs() < 1e-12, "mode {number} body {body}: {away}");
            }
        }
    }
    assert_eq!(page.tables[0].rows.len(), found.modes.modes.len());
}

#[test]
fn steps_that_do_not_get_shorter_with_their_size_are_made_much_smaller() {
    for name in ["ball", "slide"] {
        rest(&session(&root().join(format!("tests/regressions/statics/{name}.toml")), &[]));
    }
}

/// A block of 2 kg on a spring along a guide, with a control element that has states.
fn controlled(gravity: f64, stiffness: f64, more: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["joints", "forces", "controls"]
[simulation]
gravity = [{gravity}, 0, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "block"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [0.1, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "block"]
frames = [{{ position = [-1, 0, 0] }}, {{ position = [0, 0, 0] }}]
params = {{ stiffness = {stiffness}, damping = 1, free_length = 1 }}
[[output]]
name = "x"
quantity = "position"
of = "block"
component = "x"
{more}
"#
    )
}

/// The second state of a filter is a rate, which is zero there: nothing but the noise of the first says how well it is met.
#[test]
fn states_that_are_zero_at_rest_are_found() {
    let filter = r#"
[[control]]
name = "filter"
type = "transfer-function"
inputs = { input = "x" }
params = { numerator = [1], denominator = [0.01, 0.14, 1] }
"#;
    for sets in [&[][..], &["simulation.start=equilibrium"]] {
        let found = rest(&of_text(&controlled(1.0, 50.0, filter), sets));
        assert!((found.outputs[0].value - 0.04).abs() < 1e-13, "{:?}", found.outputs);
    }
}

/// The derivative of a controller pushes against all that moves until its filter has followed: a step with the filter behind it goes downhill,
/// though loads turn against it.
#[test]
fn what_states_hold_back_moves_with_them() {
    let push = |kp: f64, kd: f64, filter: f64| {
        format!(
            r#"
[[force]]
name = "push"
type = "vector-force"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [0, 0, 1]
x_axis = [1, 0, 0]
inputs = {{ x = {{ signal = "pid.output", gain = "1 N" }} }}
[[control]]
name = "pid"
type = "pid"
inputs = {{ set_point = 0.0, measured = "x" }}
params = {{ kp = {kp}, ki = 0.0, kd = {kd}, filter_time = {filter} }}
"#
        )
    };
    for (gravity, stiffness, kp, kd, filter) in [
        (3.98, 1.79, 0.53, 1.5, 0.0139),
        (-1.0, 1.79, 0.53, 1.5, 0.0139),
        (9.81, 50.0, 20.0, 40.0, 1e-4),
        (9.81, 1e4, -20.0, 1.0, 1.0),
    ] {
        let session = of_text(&controlled(gravity, stiffness, &push(kp, kd, filter)), &[]);
        let (x, known) = (rest(&session).outputs[0].value, 2.0 * gravity / (stiffness + kp));
        assert!((x - known).abs() < 1e-11 * known.abs(), "{x} is not {known}");
    }
}

/// What is said of contacts is where they are: one that touches without a load, and friction of one that is open.
#[test]
fn contacts_that_touch_without_a_load_are_told_from_those_that_are_apart() {
    const FOUR: [[f64; 2]; 4] = [[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]];
    let text = crate::contacts::table(&FOUR, 0.0, "params.mu = 0.3");
    let (session, instant) = at_start(of_text(&text, &[]), of_text(&text, &[]));
    let found = modes(&session, &instant);
    let open: Vec<&String> = found.notes.iter().filter(|note| note.contains("is open")).collect();
    assert!(
        open.iter().all(|note| note.contains("it touches, and nothing presses it")) && open.len() == 1,
        "{:?}",
        found.notes
    );
    let above = format!(
        "{PENDULUM}[[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"rod\"]\nparams.mu = 0.2\n\
         frames = [{{ position = [0, -5, 0], axis = [0, 1, 0] }}, {{ position = [0, 0, 0] }}]\n"
    );
    let found = rest(&of_text(&above, &[]));
    assert!(found.notes.iter().all(|note| !note.contains("friction")), "{:?}", found.notes);
    assert!(found.modes.notes.iter().any(|note| note.ends_with("is open")), "{:?}", found.modes.notes);
}

/// Two carts in a row, with dampers that let nothing swing, or that swing one of them out of time: the springs have all of the potential
/// energy, whatever the kinetic energy is. By that, they had 9799 % and 1 % of the modes of a single cart.
#[test]
fn springs_have_all_potential_energy_however_a_mode_is_damped() {
    let cart = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{x:?}, 0, 0]\n\
             [[joint]]\nname = \"rail_{name}\"\ntype = \"translational\"\nbodies = [\"ground\", \"{name}\"]\naxis = [1, 0, 0]\n"
        )
    };
    let strut = |name: &str, bodies: [&str; 2], x: f64, damping: f64| {
        format!(
            "[[force]]\nname = \"{name}\"\ntype = \"translational-spring-damper\"\nbodies = [\"{}\", \"{}\"]\n\
             points = [[{x:?}, 0, 0], [{:?}, 0, 0]]\nparams = {{ stiffness = 1, damping = {damping:?}, free_length = 1 }}\n",
            bodies[0],
            bodies[1],
            x + 1.0
        )
    };
    for (first, second, swinging) in [(10.0, 20.0, 0), (0.3, 0.0, 2)] {
        let text =
            "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 1\noutput_step = 0.5\n"
                .to_owned()
                + &cart("one", 1.0)
                + &cart("two", 2.0)
                + &strut("near", ["ground", "one"], 0.0, first)
                + &strut("far", ["one", "two"], 1.0, second);
        let found = rest(&of_text(&text, &[])).modes;
        assert_eq!(found.modes.iter().filter(|mode| mode.imaginary > 0.0).count(), swinging);
        for mode in &found.modes {
            let sum: f64 = mode.potential.iter().map(|one| one.share).sum();
            assert!((sum - 1.0).abs() < 1e-9 && mode.potential.len() == 2, "{mode:?}");
            assert!(mode.potential.iter().all(|one| one.share > 0.0), "{mode:?}");
        }
    }
}

/// What a controller does is no potential energy: that of its force was up to 1500 times the kinetic energy.
#[test]
fn what_follows_signals_has_no_share_of_potential_energy() {
    let control = r#"
[[control]]
name = "pid"
type = "pid"
inputs = { set_point = 0.0, measured = "x" }
params = { kp = 100, ki = 50, kd = 20, filter_time = 0.05 }
[[force]]
name = "drive"
type = "translational-actuator"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.along = "axis"
inputs = { signal = "pid.output" }
"#;
    let session = of_text(&controlled(0.0, 50.0, control), &["block.position.x=0"]);
    let found = rest(&session).modes;
    let stored = || found.modes.iter().flat_map(|mode| &mode.potential);
    assert!(stored().all(|share| share.name == "spring") && stored().count() > 0, "{:?}", found.modes);
}
