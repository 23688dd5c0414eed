//! A modal body that is given its geometric stiffness: turning blades, columns under their weight, against closed forms.

use nalgebra::DMatrix;

use crate::inertia::craig_bampton::{BEAM, MODES};
use crate::inertia::{frequencies, modal, try_text, tumbling};
use crate::support::column;

const GEOMETRIC: &str = "geometric = { file = \"stiffening.csv\", columns = [\"row\", \"column\", \"x\", \"y\", \"z\", \
                         \"xx\", \"yy\", \"zz\", \"xy\", \"yz\", \"zx\"] }";

/// The lowest motion along z of the beam, clamped at frame 0, whose stiffness has these shares of the geometric ones on top: omega^2, rotation
/// about y and amplitudes of the modes where the end has moved by one.
fn stiffened([uniform, turning]: [f64; 2]) -> (f64, f64, Vec<f64>) {
    let [mass, stiffness, g, c] = BEAM.reduce_all(MODES);
    let stiffness = stiffness + g * uniform + c * turning;
    let free: Vec<usize> = [8, 10].into_iter().chain(12..12 + MODES).collect();
    let part = |matrix: &DMatrix<f64>| DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
    let c = nalgebra::Cholesky::new(part(&mass)).unwrap().l();
    let half = c.solve_lower_triangular(&part(&stiffness)).unwrap();
    let whole = c.solve_lower_triangular(&half.transpose()).unwrap();
    let eigen = (0.5 * (&whole + whole.transpose())).symmetric_eigen();
    let place = eigen.eigenvalues.imin();
    let shape = c.tr_solve_lower_triangular(&eigen.eigenvectors.column(place).into_owned()).unwrap();
    let shape = &shape / shape[0];
    (eigen.eigenvalues[place], shape[1], shape.iter().skip(2).copied().collect())
}

/// omega over that of sqrt(E I / (m L^4)), of a beam that turns with a multiple of the same: Wright, Smith, Thresher & Wang, Vibration modes of
/// centrifugally stiffened beams, Journal of Applied Mechanics 49 (1982).
const TURNING: [(f64, f64); 4] = [(1.0, 3.6816), (2.0, 4.1373), (3.0, 4.7973), (6.0, 7.3604)];

#[test]
fn a_beam_that_turns_is_stiffer() {
    let unit = (BEAM.young * BEAM.iy / (BEAM.density * BEAM.area)).sqrt();
    for (spin, expected) in TURNING {
        let found = stiffened([0.0, (spin * unit).powi(2)]).0.sqrt() / unit;
        assert!((found / expected - 1.0).abs() < 2e-4, "{spin}: {found} {expected}");
    }
    let a = 1e-3;
    for radius in [0.0, 0.4] {
        let spin = 3.0 * unit;
        let (square, turn, amplitudes) = stiffened([radius * spin * spin, spin * spin]);
        let text = format!(
            r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 0.12
output_step = 0.002
tolerance = 1e-9
[[body]]
name = "hub"
mass = 1
inertia = [1, 1, 1]
angular_velocity = [0, 0, {spin:?}]
[[body]]
name = "tip"
mass = 1e-6
inertia = [1e-8, 1e-8, 1e-8]
position = [{reach:?}, 0, {a:?}]
orientation = {{ axis = [0, 1, 0], angle = {angle:?} }}
velocity = [0, {speed:?}, 0]
angular_velocity = [0, 0, {spin:?}]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "hub"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "hub"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "{spin:?} t"
[[force]]
name = "blade"
type = "modal-body"
bodies = ["hub", "tip"]
frames = [{{ position = [{radius:?}, 0, 0] }}, {{ position = [0, 0, 0] }}]
[force.params]
matrices = {{ file = "beam.csv", columns = ["row", "column", "mass", "stiffness"] }}
points = [0, 0, 0, 1, 0, 0]
amplitudes = {amplitudes:?}
{GEOMETRIC}
[[output]]
name = "z"
quantity = "position"
of = "tip"
component = "z"
"#,
            reach = radius + 1.0,
            angle = a * turn,
            speed = spin * (radius + 1.0),
            amplitudes = amplitudes.iter().map(|q| q * a).collect::<Vec<f64>>(),
        );
        for way in [&[][..], &["simulation.formulation=\"cartesian\""]] {
            let report = try_text(&text, way).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
            let off = farthest(&report.times, column(&report, "z"), |t| a * (square.sqrt() * t).cos());
            assert!(off < 2e-3 * a, "{radius} {way:?}: {off:e}");
        }
        // Beside what it would do without.
        let soft = try_text(&text.replace(GEOMETRIC, ""), &[]).unwrap();
        let off = farthest(&soft.times, column(&soft, "z"), |t| a * (square.sqrt() * t).cos());
        assert!(off > 0.5 * a, "{off:e}");
    }
}

fn farthest(times: &[f64], found: &[f64], expected: impl Fn(f64) -> f64) -> f64 {
    times.iter().zip(found).map(|(t, z)| (z - expected(*t)).abs()).fold(0.0, f64::max)
}

/// Greenhill: a column stands as long as its weight per length is below 7.8373 E I / L^3.
#[test]
fn a_column_gives_way_under_its_weight() {
    let line = BEAM.density * BEAM.area;
    let most = 7.8373 * BEAM.young * BEAM.iy / line;
    let free = stiffened([0.0; 2]).0;
    assert!((stiffened([-most, 0.0]).0 / free).abs() < 1e-4);
    let light = |g: f64| {
        let weight = format!("gravity = [{:?}, 0, 0]\n{GEOMETRIC}", -g);
        modal(&weight).replace("0.054", "1e-7").replace("1e-4", "1e-9")
    };
    for share in [-1.0, 0.5, 0.9] {
        let found = frequencies(&light(share * most));
        let expected = stiffened([-share * most, 0.0]).0.sqrt();
        assert!((found[0] / expected - 1.0).abs() < 1e-3, "{share}: {found:?} {expected}");
    }
}

/// The beam of `modal-body-free` keeps its momenta and its energy with what shortens, too.
#[test]
fn what_shortens_keeps_momentum_and_energy() {
    let text = tumbling().replace("amplitudes = [4e-4, -3e-4,", &format!("{GEOMETRIC}\namplitudes = [4e-4, -3e-4,"));
    let report = try_text(&text, &["wx=20", "wy=10", "wz=30"]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
    assert!(report.summary.audit.energy_error_relative < 1e-7, "{:?}", report.summary.audit);
    let at = |name: String, k: usize| column(&report, &name)[k];
    let (mass, moment) = (0.054, 1e-4);
    for (axis, [b, c]) in [("x", ["y", "z"]), ("y", ["z", "x"]), ("z", ["x", "y"])] {
        let of_all = |k: usize| {
            let body = |end: &str| {
                let value = |what: &str, axis: &str| at(format!("{end}_{what}{axis}"), k);
                let along = mass * value("v", axis);
                let lever = mass * (value("", b) * value("v", c) - value("", c) * value("v", b));
                [along, lever + moment * value("w", axis)]
            };
            let (l, r) = (body("l"), body("r"));
            [at(format!("p_{axis}"), k) + l[0] + r[0], at(format!("h_{axis}"), k) + l[1] + r[1]]
        };
        let first = of_all(0);
        for k in 1..report.times.len() {
            let now = of_all(k);
            let off = [0, 1].map(|i| (now[i] - first[i]).abs());
            assert!(off[0] < 1e-8 && off[1] < 1e-8, "{axis} at {}: {off:?}", report.times[k]);
        }
    }
}
