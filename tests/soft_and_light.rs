//! Equilibria and modes where light bodies bear much and soft directions lie beside stiff ones: what round-off leaves open.

use std::sync::Arc;

use odyn::analyses::modes::Stability;
use odyn::analyses::statics::{self, Equilibrium};
use odyn::results::Status;

use crate::support::open_text;

fn rest(text: &str) -> Equilibrium {
    statics::equilibrium(&open_text(text, &[]), &mut |_| ()).unwrap_or_else(|error| panic!("{error}"))
}

fn head(gravity: [f64; 3]) -> String {
    format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = {gravity:?}\nt_end = 1\noutput_step = 0.1\n"
    )
}

fn body(name: &str, mass: f64, inertia: [f64; 3], position: [f64; 3]) -> String {
    format!("[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = {inertia:?}\nposition = {position:?}\n")
}

fn joint(name: &str, kind: &str, bodies: [&str; 2], point: [f64; 3], axis: [f64; 3]) -> String {
    let axis = if kind == "spherical" { String::new() } else { format!("axis = {axis:?}\n") };
    format!("[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = {point:?}\n{axis}")
}

fn spring(name: &str, bodies: [&str; 2], points: [[f64; 3]; 2], [stiffness, damping, length]: [f64; 3]) -> String {
    format!(
        "[[force]]\nname = \"{name}\"\ntype = \"translational-spring-damper\"\nbodies = {bodies:?}\npoints = {points:?}\n\
         params = {{ stiffness = {stiffness:?}, damping = {damping:?}, free_length = {length:?} }}\n"
    )
}

/// A bar on a torsion spring with 0.002 rad/s beside a load of a ton on a link of 0.1 g, whose loads would accelerate it by 1e8 m/s^2.
#[test]
fn a_slow_mode_beside_a_light_link_under_load_is_no_free_motion() {
    let text = head([0.0, 0.0, -9.81])
        + &body("link", 1e-4, [1e-6; 3], [0.0, 0.0, -0.5])
        + &joint("top", "revolute", ["ground", "link"], [0.0; 3], [0.0, 1.0, 0.0])
        + &body("load", 1e3, [1e2; 3], [0.0, 0.0, -1.5])
        + &joint("low", "revolute", ["link", "load"], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0])
        + &body("bar", 1.0, [1.0; 3], [0.0, 0.0, 1.0])
        + &joint("pivot", "revolute", ["ground", "bar"], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0])
        + "[[force]]\nname = \"fibre\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"bar\"]\npoint = [0, 0, 1]\n\
           axis = [0, 0, 1]\nparams = { stiffness = 4e-6, damping = 0, free_angle = 0 }\n";
    let modes = rest(&text).modes;
    assert_eq!((modes.zeros, modes.stability), (0, Stability::Undamped), "{:?}", modes.neutral);
    let slow = &modes.modes[0];
    assert!((slow.imaginary / 2e-3 - 1.0).abs() < 1e-12 && slow.uncertainty < 1e-8, "{slow:?}");
}

/// A thin rod between balls turns freely about itself, and so does what hangs on it: nothing drives either back, in whatever direction
/// it hangs. The others are those of the double pendulum, in proportion to the root of gravity.
#[test]
fn a_thin_rod_under_load_is_free_to_spin() {
    let hung = |gravity: [f64; 3]| {
        let text = head(gravity)
            + &body("rod", 1e-3, [8e-5, 8e-5, 8e-11], [0.0, 0.0, -0.5])
            + &body("load", 1e3, [100.0, 120.0, 150.0], [0.1, 0.05, -1.7])
            + &joint("top", "spherical", ["ground", "rod"], [0.0; 3], [0.0; 3])
            + &joint("low", "spherical", ["rod", "load"], [0.0, 0.0, -1.0], [0.0; 3]);
        let modes = rest(&text).modes;
        assert_eq!((modes.zeros, modes.modes.len()), (4, 4), "{gravity:?}: {:?}", modes.modes);
        let size = gravity.iter().map(|part| part * part).sum::<f64>().sqrt();
        modes.modes.iter().map(|mode| mode.imaginary / size.sqrt()).collect::<Vec<f64>>()
    };
    let straight = hung([0.0, 0.0, -9.81]);
    for gravity in [[1.3, -2.1, -9.81], [0.3, 0.7, -9.81], [-5.0, 3.0, -2.0]] {
        let found = hung(gravity);
        let same = found.iter().zip(&straight).all(|(a, b)| (a / b - 1.0).abs() < 1e-11);
        assert!(same, "{gravity:?}: {found:?} are not {straight:?}");
    }
}

/// Springs relax without weights: what is left of their loads at the end would hold what is free.
#[test]
fn springs_that_relax_hold_nothing() {
    let text = head([0.0; 3])
        + &body("arm", 1.0, [0.1, 0.2, 0.3], [0.5, 0.1, 0.0])
        + &body("slide", 2.0, [0.1; 3], [0.9, 0.6, 0.1])
        + &joint("ball", "spherical", ["ground", "arm"], [0.0; 3], [0.0; 3])
        + &joint("rail", "translational", ["arm", "slide"], [0.7, 0.3, 0.1], [1.0, 2.0, 0.5])
        + &spring("one", ["arm", "slide"], [[0.3, 0.2, 0.4], [1.2, 1.1, 0.2]], [1.2, 0.03, 0.4])
        + &spring("two", ["arm", "slide"], [[0.1, -0.2, 0.1], [1.0, 1.3, 0.4]], [0.5, 0.0, 1.9]);
    let found = rest(&text);
    assert_eq!((found.modes.zeros, found.modes.modes.len()), (6, 1), "{:?}", found.modes.modes);
    assert!(found.audit.balance < 1e-2, "{:?}", found.audit);
}

/// Springs that relax completely leave nothing to compare what is left with: bodies without loads bear the round-off of others.
#[test]
fn what_relaxes_completely_is_in_balance() {
    let ball = "[[joint]]\nname = \"shaft\"\ntype = \"universal\"\nbodies = [\"ground\", \"arm\"]\n\
                points = [[0.124, 0.453, 0.442], [0.124, 0.453, 0.442]]\naxes = [[0.0177, -0.56, 0.829], [0, 0.829, 0.56]]\n";
    let text = head([0.0; 3])
        + &body("arm", 0.103, [0.00472, 0.0049, 0.00416], [-0.187, -0.117, 0.794])
        + &body("end", 6.05, [0.149, 0.166, 0.154], [-0.334, -0.0895, 0.239])
        + ball
        + &joint("elbow", "revolute", ["arm", "end"], [-0.734, 0.189, 0.477], [-0.123, 0.246, -0.961])
        + &spring("one", ["ground", "arm"], [[1.21, -0.23, 0.136], [-0.075, 0.076, 0.58]], [5.34, 0.104, 0.309])
        + &spring("two", ["ground", "arm"], [[-0.286, 0.304, 1.05], [0.0852, 0.0499, 1.01]], [6.16, 0.0, 0.214]);
    let found = rest(&text);
    assert!(found.audit.balance <= 1.0, "{:?}", found.audit);
    assert_eq!(found.modes.zeros, 2, "{:?}", found.modes.modes);
}

/// Accelerations of what is held stiffly are round-off of places, more than that of the small forces that cancel. Steps that went by the
/// latter alone became ever shorter: eight thousand for ten seconds of nothing.
#[test]
fn what_a_bushing_holds_at_rest_costs_few_steps() {
    let text = "[plugins]\nlibraries = [\"forces\"]\n[simulation]\ngravity = [-1.2, 2.1, -1.9]\nt_end = 10\noutput_step = 0.1\n\
         start = \"equilibrium\"\n[[body]]\nname = \"block\"\nmass = 1\ninertia = [0.02, 0.035, 0.04]\n\
         position = [-0.1, -1.03, -1.22]\n\
         orientation = { axis = [1, 2, -1], angle = 1.1 }\n\
         [[force]]\nname = \"rubber\"\ntype = \"bushing\"\nbodies = [\"ground\", \"block\"]\npoint = [0.05, -1.2, -1.1]\n\
         axis = [2, 1, 3]\nx_axis = [1, 0, 0]\n\
         params = { stiffness = [45, 60, 75], rotational_stiffness = [15, 25, 35], damping = [2, 3, 4], rotational_damping = [2, 3, 4] }\n";
    for formulation in ["joint", "cartesian"] {
        let set = format!("simulation.formulation={formulation}");
        let report = open_text(text, &[&set]).run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        assert_eq!(report.summary.status, Status::Completed);
        assert!(report.summary.steps < 1500, "{formulation}: {} steps", report.summary.steps);
    }
}

fn place(found: &Equilibrium, name: &str) -> [f64; 3] {
    found.bodies.iter().find(|body| body.body == name).map(|body| body.position).unwrap()
}

/// A pendulum whose pivot is a bushing: however stiff that is, gravity brings it down. What is left across, in balance beside what round-off
/// does to the bushing, is not in balance beside gravity.
#[test]
fn a_pendulum_on_a_stiff_bushing_hangs_straight() {
    for (mass, stiffness) in [(1.0, 1e6), (1.0, 1e8), (1e-3, 1e9), (1.0, 1e11)] {
        for angle in [5e-8_f64, 5e-6, 1e-3, 0.1, 1.5] {
            let start = [angle.sin(), 0.0, -angle.cos()];
            let text = head([0.0, 0.0, -9.81])
                + &body("bob", mass, [0.01 * mass; 3], start)
                + &format!("orientation = {{ axis = [0, 1, 0], angle = {:?} }}\n", -angle)
                + &joint("plane", "planar", ["ground", "bob"], [0.0; 3], [0.0, 1.0, 0.0])
                + &format!(
                    "[[force]]\nname = \"pivot\"\ntype = \"bushing\"\nbodies = [\"ground\", \"bob\"]\n\
                     frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 1] }}]\n\
                     params = {{ stiffness = [{stiffness:e}, {stiffness:e}, {stiffness:e}], rotational_stiffness = [0, 0, 0] }}\n"
                );
            let found = rest(&text);
            let [x, ..] = place(&found, "bob");
            assert!(x.abs() < 1e-8, "{mass} kg, {stiffness:e} N/m from {angle}: {x:e}");
            assert!(found.steps < 30, "{mass} kg, {stiffness:e} N/m from {angle}: {} steps", found.steps);
        }
    }
}

/// Three weights on a string of four equal pieces between two hooks. The outer pieces have three times the slope of the inner ones:
/// 2 l (cos a + cos b) is the distance, with tan a = 3 tan b.
#[test]
fn weights_on_a_stiff_string_hang_as_on_one_that_does_not_stretch() {
    let piece = 0.275_f64;
    let angles = |w: f64| ((3.0 * w).atan(), w.atan());
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let (a, b) = angles(middle);
        if 2.0 * piece * (a.cos() + b.cos()) > 1.0 { low = middle } else { high = middle }
    }
    let (a, b) = angles(low);
    let outer = -piece * a.sin();
    for (stiffness, weight) in [(1e8, 1.0), (1e11, 10.0), (1e9, 1e-2), (1e6, 1e-5)] {
        let mut text = head([0.0, 0.0, -9.81]);
        let points: Vec<[f64; 3]> = (0..5).map(|k| [0.25 * f64::from(k), 0.0, 0.0]).collect();
        for (k, x) in [(1, 0.25), (2, 0.5), (3, 0.75)] {
            let sag = if k == 2 { 0.01 } else { 0.0075 };
            text += &format!(
                "[[body]]\nname = \"w{k}\"\nmass = {:e}\nparticle = true\nposition = [{x}, 0, {:?}]\n",
                weight / 9.81,
                -sag
            );
        }
        for k in 0..4 {
            let name = |k: usize| if k == 0 || k == 4 { "ground".to_owned() } else { format!("w{k}") };
            let at = |k: usize| if k == 0 || k == 4 { points[k] } else { [0.0; 3] };
            let (one, other) = (at(k), at(k + 1));
            text += &format!(
                "[[force]]\nname = \"s{k}\"\ntype = \"translational-spring-damper\"\nbodies = [{:?}, {:?}]\n\
                 frames = [{{ position = {one:?} }}, {{ position = {other:?} }}]\n\
                 params = {{ stiffness = {stiffness:e}, free_length = {piece} }}\n",
                name(k),
                name(k + 1)
            );
        }
        let found = rest(&text);
        let (side, middle) = (place(&found, "w1")[2], place(&found, "w2")[2]);
        let off = (side - outer).abs().max((middle - outer + piece * b.sin()).abs());
        assert!(off < 1e-7 + 10.0 * weight / stiffness, "{stiffness:e} N/m, {weight:e} N: off by {off:e}");
        assert!(found.steps < 60, "{stiffness:e} N/m, {weight:e} N: {} steps", found.steps);
    }
}

/// Beams along x from a wall, with half of the mass of each at its ends; loads follow.
fn cantilever(parts: usize, length: f64, young: f64, [area, second_moment]: [f64; 2], density: f64) -> String {
    let piece = length / parts as f64;
    let mut text = String::new();
    for k in 1..=parts {
        let mass = density * area * piece * if k == parts { 0.5 } else { 1.0 };
        text += &body(&format!("n{k}"), mass, [mass * piece * piece / 12.0; 3], [piece * k as f64, 0.0, 0.0]);
        let before = if k == 1 { "ground".to_owned() } else { format!("n{}", k - 1) };
        text += &format!(
            "[[force]]\nname = \"b{k}\"\ntype = \"beam\"\nbodies = [{before:?}, \"n{k}\"]\n\
             frames = [{{ position = [0, 0, 0], axis = [0, 0, 1], x_axis = [1, 0, 0] }}, \
             {{ position = [0, 0, 0], axis = [0, 0, 1], x_axis = [1, 0, 0] }}]\n\
             params = {{ length = {piece:e}, young = {young:e}, shear = {shear:e}, area = {area:e}, iy = {second_moment:e}, \
             iz = {second_moment:e}, torsion = {torsion:e}, ky = 0, kz = 0 }}\n",
            shear = young / 2.6,
            torsion = 2.0 * second_moment
        );
    }
    text
}

/// A load that bends a slender cantilever by a third of itself, over the stiffness, whatever stiffness it has along itself.
#[test]
fn a_slender_cantilever_bends_under_any_load() {
    for (along, load) in [(1e6, 1e-7), (1e8, 1e-3), (1e11, 0.1)] {
        let text = head([0.0; 3])
            + &cantilever(8, 1.0, along, [1.0, 1.0 / along], 1.0)
            + &format!(
                "[[force]]\nname = \"load\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"n8\"]\nparams = {{ y = {load:e} }}\n"
            );
        let found = rest(&text);
        let [_, y, _] = place(&found, "n8");
        // Lengths that bend get shorter: by the square.
        assert!((3.0 * y / load - 1.0).abs() < 1e-6 + 0.2 * load * load, "{along:e}, {load:e}: {y:e}");
        assert!(found.steps < 30, "{along:e}, {load:e}: {} steps", found.steps);
    }
}

/// A steel wire of 0.1 mm hangs by its weight from where it is clamped; its elastica (w L^3 / EI = 15.84, solved as a boundary
/// value problem to 1e-10) ends at 0.51299 and -0.79537 lengths. Steps along it turn what is stiff.
#[test]
fn a_thin_wire_hangs_by_its_weight() {
    let (d, length) = (1e-4_f64, 0.3);
    let (area, second_moment) = (std::f64::consts::PI * d * d / 4.0, std::f64::consts::PI * d.powi(4) / 64.0);
    let text = head([0.0, 0.0, -9.81]) + &cantilever(16, length, 2.1e11, [area, second_moment], 7850.0);
    let found = rest(&text);
    let [x, _, z] = place(&found, "n16");
    assert!((x / length - 0.51299).abs() < 1e-3 && (z / length + 0.79537).abs() < 1e-3, "{x} {z}");
    assert!(found.steps < 40, "{} steps", found.steps);
}

/// An arm whose weight a spring without free length bears at any angle, k h = m g, beside a very soft torsion spring: the arm goes all the
/// way to where that relaxes, though its torque is next to nothing beside the weight and steps are at most 0.2 rad.
#[test]
fn what_is_balanced_at_any_angle_follows_the_softest_spring() {
    for rest_angle in [-3.0, -1.0, 0.5] {
        let text = head([0.0, 0.0, -9.81])
            + &body("arm", 1.0, [0.1; 3], [1.0, 0.0, 0.0])
            + &joint("hinge", "revolute", ["ground", "arm"], [0.0; 3], [0.0, 1.0, 0.0])
            + &spring("balancer", ["ground", "arm"], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], [9.81, 0.0, 0.0])
            + &format!(
                "[[force]]\nname = \"soft\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\n\
                 axis = [0, 1, 0]\nparams = {{ stiffness = 1e-8, free_angle = {rest_angle:?} }}\n\
                 [[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"hinge\"\n"
            );
        let found = rest(&text);
        assert!(
            (found.outputs[0].value - rest_angle).abs() < 1e-6,
            "{} instead of {rest_angle}",
            found.outputs[0].value
        );
        assert!(found.steps < 60, "{} steps", found.steps);
    }
}

/// A filter of a day beside a spring of 1e9 N m/rad: states have steps of their own.
#[test]
fn slow_states_come_to_rest_beside_stiff_springs() {
    let text = "[plugins]\nlibraries = [\"joints\", \"forces\", \"controls\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.1\n".to_owned()
        + &body("arm", 1.0, [0.1; 3], [1.0, 0.0, 0.0])
        + &joint("hinge", "revolute", ["ground", "arm"], [0.0; 3], [0.0, 1.0, 0.0])
        + "[[force]]\nname = \"stiff\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\n\
           axis = [0, 1, 0]\nparams = { stiffness = 1e9 }\n\
           [[control]]\nname = \"lag\"\ntype = \"sensor\"\ninputs = { input = 1.0 }\nparams = { time_constant = 86400.0 }\n\
           [[output]]\nname = \"y\"\nquantity = \"value\"\nof = \"lag\"\n";
    let found = rest(&text);
    assert!((found.outputs[0].value - 1.0).abs() < 1e-9, "{}", found.outputs[0].value);
    assert!(found.steps < 60, "{} steps", found.steps);
}
