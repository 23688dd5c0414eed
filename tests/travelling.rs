//! A body that bends, while it travels: deformations are those of an observer who travels along.

use crate::inertia::craig_bampton::BEAM;
use crate::inertia::{try_text, tumbling};
use crate::support::column;

/// A cantilever along its way on a steady turn of radius R about z, driven by its root, with what damps its vibrations.
fn turn(radius: f64, speed: f64) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 3
output_step = 3
tolerance = 1e-9
method = "radau5"
[[body]]
name = "root"
mass = 1
inertia = [1, 1, 1]
position = [{radius:?}, 0, 0]
velocity = [0, {way:?}, 0]
angular_velocity = [0, 0, {speed:?}]
orientation = {{ x = [0, 1, 0], y = [-1, 0, 0] }}
[[body]]
name = "tip"
mass = 1e-4
inertia = [1e-7, 1e-7, 1e-7]
position = [{radius:?}, 1, 0]
velocity = [-{speed:?}, {way:?}, 0]
angular_velocity = [0, 0, {speed:?}]
orientation = {{ x = [0, 1, 0], y = [-1, 0, 0] }}
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "root"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "drive"
type = "rotation-driver"
bodies = ["ground", "root"]
point = [0, 0, 0]
axis = [0, 0, 1]
x_axis = [1, 0, 0]
params.angle = "{speed:?} * t"
[[force]]
name = "beam"
type = "modal-body"
bodies = ["root", "tip"]
frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]
[force.params]
matrices = {{ file = "beam.csv", columns = ["row", "column", "mass", "stiffness"] }}
points = [0, 0, 0, 1, 0, 0]
damping = 0.01
[[output]]
name = "x"
quantity = "position"
of = "tip"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "tip"
component = "y"
"#,
        way = radius * speed,
    )
}

#[test]
fn a_cantilever_bends_on_a_turn_as_by_its_weight() {
    let (line, rigidity) = (BEAM.density * BEAM.area, BEAM.young * BEAM.iz);
    let expected = 10.0 * (line / 8.0 + 1e-4 / 3.0) / rigidity;
    for radius in [1000.0_f64, 10.0] {
        let speed = (10.0 / radius).sqrt();
        let report = try_text(&turn(radius, speed), &[]).unwrap();
        assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
        let [x, y] = ["x", "y"].map(|name| *column(&report, name).last().unwrap());
        let (sin, cos) = (3.0 * speed).sin_cos();
        let bent = x * cos + y * sin - radius;
        // What it adds to the radius is left.
        assert!((bent / expected - 1.0).abs() < 1e-3 / radius + 1e-5, "{radius}: {bent} {expected}");
    }
}

/// What only stretches: modes across the beam's plane are zero but for round-off, and those of bending hardly more.
#[test]
fn modes_that_nothing_excites_do_not_choose_steps() {
    let stretched = "damping = 0.01\ngeometric = { file = \"stiffening.csv\", columns = \
                     [\"row\", \"column\", \"x\", \"y\", \"z\", \"xx\", \"yy\", \"zz\", \"xy\", \"yz\", \"zx\"] }\n";
    let text = turn(1000.0, 0.1).replace("damping = 0.01\n", stretched);
    let mut found = Vec::new();
    for (tolerance, most) in [("1e-6", 600), ("1e-9", 2000)] {
        let report = try_text(&text, &[&format!("simulation.tolerance={tolerance}")]).unwrap();
        assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
        assert!(report.summary.steps < most, "{tolerance}: {}", report.summary.steps);
        found.push(["x", "y"].map(|name| *column(&report, name).last().unwrap()));
    }
    let off = (found[0][0] - found[1][0]).hypot(found[0][1] - found[1][1]);
    assert!(off < 1e-6, "{off:e}");
}

#[test]
fn a_beam_tumbles_alike_however_fast_it_travels() {
    let text = tumbling();
    let shown = |text: &str| {
        let shown = "[[output]]\nname = \"a_y\"\nquantity = \"acceleration\"\nof = \"left\"\ncomponent = \"y\"\n";
        let report = try_text(&format!("{text}{shown}"), &["simulation.t_end=0.01"]).unwrap();
        assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
        column(&report, "a_y").to_vec()
    };
    let slow = shown(&text);
    let largest = slow.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
    for faster in [1.0, 100.0] {
        let fast = shown(
            &text.replace("vx = 0.3", &format!("vx = {faster:?}")).replace("vz = 0.5", &format!("vz = -{faster:?}")),
        );
        let off = slow.iter().zip(&fast).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(off < 1e-6 * largest, "{faster}: {off:e} of {largest}");
    }
}
