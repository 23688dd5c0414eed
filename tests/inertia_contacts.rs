//! Elements that bring kinetic energy meet impacts and friction that sticks: against closed forms, and as bodies of the same mass do.

use odyn::results::{Event, EventKind};
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run};
use crate::support::{column, difference};

fn impacts(report: &RunReport) -> Vec<&Event> {
    report.events.iter().filter(|event| event.kind == EventKind::Impact).collect()
}

/// The same events, and the same motion.
#[track_caller]
fn same(one: &RunReport, other: &RunReport, tolerance: f64) {
    assert_eq!(one.events.len(), other.events.len(), "{:?} {:?}", one.events, other.events);
    for (a, b) in one.events.iter().zip(&other.events) {
        assert_eq!((&a.element, a.kind), (&b.element, b.kind));
        let off = (a.time - b.time).abs() + (a.impulse - b.impulse).abs() + (a.lost - b.lost).abs();
        assert!(off < tolerance, "{a:?} {b:?}");
    }
    for (channel, (a, b)) in one.channels.iter().zip(one.columns.iter().zip(&other.columns)) {
        let off = difference(a, b);
        assert!(off < tolerance, "`{}` differs by {off:.1e}", channel.name);
    }
}

/// A slide of 2 kg with an inerter of 3 kg, and a ball of 1 kg that strikes it.
const SLIDE: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 1
output_step = 0.05
tolerance = 1e-10
[[body]]
name = "slide"
mass = 2
inertia = [1, 1, 1]
position = [1, 0, 0]
[[body]]
name = "ball"
mass = 1
inertia = [1, 1, 1]
position = [0, 0, 0]
velocity = [1.5, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "slide"]
point = [1, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "click"
type = "ball-contact"
bodies = ["slide", "ball"]
frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
params = { radius_i = 0.2, radius_j = 0.2, restitution = 0.6 }
[[force]]
name = "flywheel"
type = "inerter"
bodies = ["ground", "slide"]
points = [[5, 0, 0], [1, 0, 0]]
params.inertance = 3
[[output]]
name = "slide"
quantity = "velocity"
of = "slide"
component = "x"
[[output]]
name = "ball"
quantity = "velocity"
of = "ball"
component = "x"
"#;

#[test]
fn a_slide_with_an_inerter_is_struck_as_one_of_their_sum() {
    let report = every_way_agrees(SLIDE, 1e-9);
    let all = impacts(&report);
    assert_eq!(all.len(), 1);
    let (v, e, (slide, ball)) = (1.5, 0.6, (2.0 + 3.0, 1.0));
    let reduced = slide * ball / (slide + ball);
    let impulse = (1.0 + e) * reduced * v;
    assert!((all[0].time - 0.4).abs() < 1e-10 && (all[0].impulse - impulse).abs() < 1e-12, "{all:?}");
    assert!((all[0].lost - 0.5 * (1.0 - e * e) * reduced * v * v).abs() < 1e-12, "{all:?}");
    assert!((column(&report, "slide").last().unwrap() - impulse / slide).abs() < 1e-10);
    assert!((column(&report, "ball").last().unwrap() - (v - impulse / ball)).abs() < 1e-10);
    assert!(report.summary.audit.energy_error_relative < 1e-9, "{:?}", report.summary.audit);
}

/// A rod on a hinge, from which an inerter leads across; a ball strikes its end.
const ROD: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 0.25
output_step = 0.01
tolerance = 1e-10
[[body]]
name = "rod"
mass = 1.2
inertia = [0.01, 0.1, 0.1]
position = [0.5, 0, 0]
[[body]]
name = "ball"
mass = 0.7
inertia = [1e-3, 1e-3, 1e-3]
position = [1, 0.3, 0]
velocity = [0, -2, 0]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["ground", "rod"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "click"
type = "ball-contact"
bodies = ["rod", "ball"]
frames = [{ position = [0.5, 0, 0] }, { position = [0, 0, 0] }]
params = { radius_i = 0.05, radius_j = 0.05, restitution = 0.5 }
[[force]]
name = "flywheel"
type = "inerter"
bodies = ["ground", "rod"]
points = [[0.6, 1, 0], [0.6, 0, 0]]
params.inertance = 2.5
[[output]]
name = "w"
quantity = "angular_velocity"
of = "rod"
component = "z"
[[output]]
name = "F"
quantity = "reaction_force"
of = "hinge"
component = "y"
[[output]]
name = "v"
quantity = "velocity"
of = "ball"
component = "y"
"#;

#[test]
fn a_rod_with_an_inerter_is_struck_at_its_end() {
    let report = every_way_agrees(ROD, 1e-8);
    let all = impacts(&report);
    assert_eq!(all.len(), 1);
    let moment = 0.1 + 1.2 * 0.25 + 2.5 * 0.36;
    let reduced = 1.0 / (1.0 / moment + 1.0 / 0.7);
    let impulse = 1.5 * reduced * 2.0;
    assert!((all[0].time - 0.1).abs() < 1e-10 && (all[0].impulse - impulse).abs() < 1e-11, "{all:?}");
    let after = |name: &str| column(&report, name)[11];
    assert!((after("v") + 2.0 - impulse / 0.7).abs() < 1e-9, "{}", after("v"));
    // A hundredth of a second later the inerter has turned by some thousandths.
    assert!((after("w") + impulse / moment).abs() < 1e-3 && report.summary.audit.energy_error_relative < 1e-9);
}

/// A body that tumbles and bounces on a rough floor with what is said of a weight that is fixed to it.
fn tumbling(friction: &str, weight: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 0.8
output_step = 0.01
tolerance = 1e-10
[[body]]
name = "shell"
mass = 0.5
inertia = [2e-3, 3e-3, 4e-3]
position = [0, 0, 0.6]
velocity = [0.5, 0.2, 0]
angular_velocity = [2, -3, 1]
[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["ground", "shell"]
frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]
params = {{ radius = 0.1, restitution = 0.7{friction} }}
{weight}
[[output]]
name = "x"
quantity = "position"
of = "shell"
component = "x"
[[output]]
name = "z"
quantity = "position"
of = "shell"
component = "z"
[[output]]
name = "wy"
quantity = "angular_velocity"
of = "shell"
component = "y"
[[output]]
name = "energy"
quantity = "total_energy"
"#
    )
}

/// A weight as an element, and as a body that is fixed.
const WEIGHTS: [&str; 2] = [
    r#"
[[force]]
name = "weight"
type = "added-mass"
bodies = ["shell"]
point = [0.03, 0.02, 0.65]
params = { mass = 1.5, inertia = [1e-3, 2e-3, 1.5e-3], gravity = [0, 0, -9.81] }
"#,
    r#"
[[body]]
name = "weight"
mass = 1.5
inertia = [1e-3, 2e-3, 1.5e-3]
position = [0.03, 0.02, 0.65]
velocity = [0.33, 0.13, 0.13]
angular_velocity = [2, -3, 1]
[[joint]]
name = "weld"
type = "bracket"
bodies = ["shell", "weight"]
point = [0.03, 0.02, 0.65]
"#,
];

#[test]
fn a_ball_bounces_with_added_mass_as_with_a_welded_body() {
    for friction in ["", ", mu = 0.3", ", rough = true"] {
        let [added, welded] = WEIGHTS.map(|weight| every_way_agrees(&tumbling(friction, weight), 1e-6));
        assert!(impacts(&added).len() >= 2, "{:?}", added.events);
        same(&added, &welded, 1e-7);
        assert!(added.summary.audit.energy_error_relative < 1e-8, "{:?}", added.summary.audit);
    }
}

/// A block on a cart that shakes; the apparent mass on the block holds on while friction can.
const SHAKEN: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.05
tolerance = 1e-10
[[body]]
name = "cart"
mass = 10
inertia = [1, 1, 1]
[[body]]
name = "block"
mass = 1
inertia = [1, 1, 1]
position = [0, 0, 0.1]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "cart"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "drive"
type = "displacement-driver"
bodies = ["ground", "cart"]
point = [0, 0, 0]
axis = [1, 0, 0]
params.displacement = "0.1 t^3"
[[joint]]
name = "plane"
type = "planar"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "upright"
type = "perpendicular-axes"
bodies = ["ground", "block"]
axes = [[1, 0, 0], [0, 0, 1]]
[[joint]]
name = "floor"
type = "plane-contact"
bodies = ["cart", "block"]
frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0] }]
params = { radius = 0.1, mu = 0.15 }
[[force]]
name = "water"
type = "added-mass"
bodies = ["block"]
point = [0, 0, 0.1]
params = { apparent_mass = [3, 0, 3] }
[[output]]
name = "v"
quantity = "velocity"
of = "block"
component = "x"
"#;

#[test]
fn friction_holds_the_apparent_mass_too() {
    let report = every_way_agrees(SHAKEN, 1e-8);
    // (m + 3) 0.6 t = mu m g.
    let slides = report.events.iter().find(|event| event.kind == EventKind::Slides).expect("it slides");
    let expected = 0.15 * 9.81 / (4.0 * 0.6);
    assert!((slides.time - expected).abs() < 1e-9, "{slides:?} {expected}");
    let after = 0.3 * expected * expected + 0.15 * 9.81 / 4.0 * (1.0 - expected);
    assert!((column(&report, "v").last().unwrap() - after).abs() < 1e-8);
}

/// A cart that strikes a wall; on it, what is said of a mass on a spring.
fn bumper(spring: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 2
output_step = 0.01
tolerance = 1e-10
[[body]]
name = "cart"
mass = 0.8
inertia = [1, 1, 1]
velocity = [1, 0, 0]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "cart"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[joint]]
name = "wall"
type = "translational-stop"
bodies = ["ground", "cart"]
point = [0, 0, 0]
axis = [1, 0, 0]
params = {{ upper = 0.5, restitution = 0.8 }}
{spring}
[[output]]
name = "x"
quantity = "position"
of = "cart"
component = "x"
[[output]]
name = "energy"
quantity = "total_energy"
"#
    )
}

/// One mode of 1.3 kg on 90 N/m, and bodies for the same.
const SPRINGS: [&str; 2] = [
    r#"
[[force]]
name = "modes"
type = "modal-body"
bodies = ["cart"]
frames = [{ position = [0, 0, 0] }]
params = { points = [0, 0, 0], matrices = [1, 1, 1.3, 0, 2, 2, 1.3, 0, 3, 3, 1.3, 0, 7, 1, 1.3, 0, 7, 7, 1.3, 90] }
"#,
    r#"
[[body]]
name = "mass"
mass = 1.3
inertia = [1, 1, 1]
position = [-1, 0, 0]
velocity = [1, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["cart", "mass"]
point = [-1, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["cart", "mass"]
points = [[0, 0, 0], [-1, 0, 0]]
params = { stiffness = 90, free_length = 1 }
"#,
];

/// The wall stops the cart, not what is flexible.
#[test]
fn a_mode_keeps_its_momentum_in_an_impact_as_a_mass_on_a_spring_does() {
    let [modes, masses] = SPRINGS.map(|spring| every_way_agrees(&bumper(spring), 1e-7));
    let all = impacts(&modes);
    assert!(all.len() >= 2, "{:?}", modes.events);
    assert!((all[0].impulse - 1.8 * 0.8).abs() < 1e-10, "{all:?}");
    same(&modes, &masses, 1e-7);
}

#[test]
fn what_is_light_beside_the_mass_of_an_element_is_struck_all_the_same() {
    let light = SLIDE.replace("mass = 2", "mass = 2e-8").replace("inertia = [1, 1, 1]", "inertia = [1e-8, 1e-8, 1e-8]");
    let report = run(&light, &["simulation.formulation=\"cartesian\""]);
    let impulse = 1.6 * 1.5 / (1.0 / (3.0 + 2e-8) + 1.0);
    let found = impacts(&report)[0].impulse;
    assert!((found - impulse).abs() < 1e-8, "{found} {impulse}");
}

/// A chain whose rotors make it too long for coordinates of joints, unless no row closes it, keeps them where one of its joints meets
/// a stop.
#[test]
fn a_long_chain_keeps_its_coordinates_at_a_stop() {
    let mut scene = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 0.4\noutput_step = 0.1\n".to_owned();
    for k in 0..22 {
        let (before, x) = (if k == 0 { "ground".to_owned() } else { format!("link-{}", k - 1) }, 0.1 * f64::from(k));
        scene += &format!(
            "[[body]]\nname = \"link-{k}\"\nmass = 1\ninertia = [0.001, 0.002, 0.002]\nposition = [{:e}, 0, 0]\n\
             [[joint]]\nname = \"hinge-{k}\"\ntype = \"revolute\"\nbodies = [\"{before}\", \"link-{k}\"]\npoint = [{x:e}, 0, 0]\naxis = [0, 0, 1]\n",
            x + 0.05
        );
        scene += &format!(
            "[[force]]\nname = \"rotor-{k}\"\ntype = \"rotational-inerter\"\nbodies = [\"{before}\", \"link-{k}\"]\npoint = [{x:e}, 0, 0]\n\
             axis = [0, 0, 1]\nparams.inertance = 0.01\n"
        );
    }
    scene += "[[joint]]\nname = \"end\"\ntype = \"rotational-stop\"\nbodies = [\"ground\", \"link-0\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
              params = { lower = -0.2, upper = 1, restitution = 0.3 }\n\
              [[output]]\nname = \"first\"\nquantity = \"coordinate\"\nof = \"hinge-0\"\n[[output]]\nname = \"last\"\nquantity = \"coordinate\"\nof = \"hinge-3\"\n";
    let ways = ["auto", "joint", "cartesian"];
    let [auto, joint, cartesian] =
        ways.map(|way| run(&scene, &[&format!("simulation.formulation={way}"), "simulation.tolerance=1e-9"]));
    assert!(!impacts(&auto).is_empty());
    for (other, tolerance) in [(&joint, 1e-9), (&cartesian, 1e-6)] {
        assert_eq!(impacts(&auto).len(), impacts(other).len());
        for (a, b) in auto.columns.iter().zip(&other.columns) {
            assert!(difference(a, b) < tolerance, "{}", difference(a, b));
        }
    }
}

/// Two slides with an inerter between them, one of which is struck: `m_1 v_1 + b (v_1 - v_2) = P`, `m_2 v_2 = b (v_1 - v_2)`.
#[test]
fn a_blow_on_one_of_two_bodies_that_an_inerter_connects_moves_both() {
    let other = "[[body]]\nname = \"other\"\nmass = 5\ninertia = [1, 1, 1]\nposition = [3, 0, 0]\n\
                 [[joint]]\nname = \"guide-2\"\ntype = \"translational\"\nbodies = [\"ground\", \"other\"]\npoint = [3, 0, 0]\n\
                 axis = [1, 0, 0]\n[[output]]\nname = \"other\"\nquantity = \"velocity\"\nof = \"other\"\ncomponent = \"x\"\n";
    let between = SLIDE.replace(
        "bodies = [\"ground\", \"slide\"]\npoints = [[5, 0, 0], [1, 0, 0]]",
        "bodies = [\"slide\", \"other\"]\npoints = [[1, 0, 0], [3, 0, 0]]",
    );
    let report = every_way_agrees(&format!("{between}{other}"), 1e-9);
    let (v, e, [m_1, m_2, b]) = (1.5, 0.6, [2.0, 5.0, 3.0]);
    let determinant = m_1 * m_2 + b * (m_1 + m_2);
    let impulse = (1.0 + e) * v / (1.0 + (m_2 + b) / determinant);
    assert!((impacts(&report)[0].impulse - impulse).abs() < 1e-12);
    for (name, expected) in
        [("slide", impulse * (m_2 + b) / determinant), ("other", impulse * b / determinant), ("ball", v - impulse)]
    {
        let found = *column(&report, name).last().unwrap();
        assert!((found - expected).abs() < 1e-10, "{name}: {found} {expected}");
    }
}
