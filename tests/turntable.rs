//! What begins to slide on a table that spins up: the slower it slides, the faster its direction turns after the load, so that the
//! equations are as stiff as can be where sliding begins, and less and less so from there on.

use odyn::session::RunReport;

use crate::contacts::run;
use crate::support::column;

/// Slides from 1.84 s on.
const TEXT: &str = r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 4
output_step = 0.1
[[body]]
name = "table"
mass = 10
inertia = [1, 1, 2]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "motor"
type = "rotation-driver"
bodies = ["ground", "table"]
point = [0, 0, 0]
axis = [0, 0, 1]
params.angle = "0.25 * t^2"
[[body]]
name = "puck"
mass = 0.2
particle = true
position = [0.5, 0, 0]
[[joint]]
name = "on"
type = "plane-contact"
bodies = ["table", "puck"]
frames = [{ axis = [0, 0, 1] }, {}]
params.mu = 0.05
[[output]]
name = "x"
quantity = "position"
of = "puck"
component = "x"
[[output]]
name = "v"
quantity = "velocity"
of = "puck"
component = "x"
"#;

#[test]
fn implicit_methods_follow_what_begins_to_slide() {
    let exact = run(TEXT, &["simulation.tolerance=1e-12", "simulation.method=\"radau9\""]);
    let explicit = run(TEXT, &["simulation.tolerance=1e-9"]);
    let off = |report: &RunReport, other: &RunReport| {
        let one = |name| column(report, name).iter().zip(column(other, name)).map(|(a, b)| (a - b).abs());
        one("x").chain(one("v")).fold(0.0, f64::max)
    };
    assert!(off(&explicit, &exact) < 1e-8, "{:e}", off(&explicit, &exact));
    for formulation in ["joint", "cartesian"] {
        for (method, tolerance) in
            [("radau5", 1e-6), ("radau5", 1e-8), ("radau5", 1e-10), ("radau9", 1e-10), ("auto", 1e-6), ("auto", 1e-10)]
        {
            let sets = [
                format!("simulation.tolerance={tolerance:e}"),
                format!("simulation.method={method:?}"),
                format!("simulation.formulation={formulation:?}"),
            ];
            let report = run(TEXT, &sets.each_ref().map(String::as_str));
            let (off, evaluations) = (off(&report, &exact), report.summary.evaluations);
            assert!(off < 3.0 * tolerance, "{formulation} {method} {tolerance:e}: {off:e}");
            // Explicit steps at 1e-10: 70 000.
            assert!(evaluations < 6000, "{formulation} {method} {tolerance:e}: {evaluations}");
        }
    }
}
