//! Functions through points are integrated as well as the tolerance asks, however smooth they are: steps end where a curve is bent
//! more than that, and lead across where it is as good as smooth.

use element_api::Table;
use element_api::table::{Interpolation, Outside};
use element_api::testkit::Random;
use odyn::session::RunReport;

use crate::contacts::run;
use crate::support::{column, difference};

const KINDS: [(&str, Interpolation); 2] = [("spline", Interpolation::Spline), ("monotone", Interpolation::Monotone)];

/// A cart on which a force acts that is a curve through points: over time, or of a spring that holds it.
fn cart(points: &[[f64; 2]], kind: &str, of_time: bool) -> String {
    let points: Vec<String> = points.iter().map(|[x, y]| format!("[{x:?}, {y:?}]")).collect();
    let curve = format!("{{ points = [{}], interpolation = \"{kind}\" }}", points.join(", "));
    let force = if of_time {
        format!("type = \"vector-force\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\nparams.x = {curve}\n")
    } else {
        format!(
            "type = \"translational-spring-damper\"\nbodies = [\"ground\", \"cart\"]\npoints = [[-10, 0, 0], [0, 0, 0]]\n\
             params = {{ stiffness = 0, free_length = 10, force_of_elongation = {curve} }}\n"
        )
    };
    format!(
        "[plugins]\nlibraries = [\"forces\"]\n[simulation]\nt_end = 10\noutput_step = 0.2\n\
         [[body]]\nname = \"cart\"\nmass = 1\nparticle = true\nvelocity = [1, 0, 0]\n\
         [[force]]\nname = \"push\"\n{force}\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"cart\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"v\"\nquantity = \"velocity\"\nof = \"cart\"\ncomponent = \"x\"\n"
    )
}

/// Points at equal distances over a range, with random values around a line.
fn random(seed: u64, count: u32, from: f64, to: f64, slope: f64) -> Vec<[f64; 2]> {
    let mut random = Random::new(seed);
    let x = |k: u32| from + (to - from) * f64::from(k) / f64::from(count - 1);
    (0..count).map(|k| [x(k), slope * x(k) + random.between(-0.3, 0.3)]).collect()
}

/// The integral of a table from its first point.
fn integral(table: &Table, to: f64) -> f64 {
    table
        .breaks
        .windows(2)
        .zip(&table.pieces)
        .map(|(ends, [c0, c1, c2, c3])| {
            let s = to.clamp(ends[0], ends[1]) - ends[0];
            s * (c0 + s * (c1 / 2.0 + s * (c2 / 3.0 + s * c3 / 4.0)))
        })
        .sum()
}

fn at(tolerance: f64, method: &str) -> [String; 2] {
    [format!("simulation.tolerance={tolerance:e}"), format!("simulation.method={method}")]
}

fn run_at(text: &str, tolerance: f64, method: &str) -> RunReport {
    run(text, &at(tolerance, method).each_ref().map(String::as_str))
}

/// The velocity is the integral of the curve. Steps across its points left errors of 12 to 12 000 tolerances (1000 points, 1e-10), in
/// four times as many evaluations.
#[test]
fn a_force_over_time_through_random_points_gives_its_impulse() {
    for (count, most) in [(30, 190), (1000, 1700)] {
        let points = random(11, count, 0.0, 10.0, 0.0);
        for (kind, interpolation) in KINDS {
            let table = Table::through(&points, interpolation, Outside::Clamped).unwrap();
            let text = cart(&points, kind, true);
            for (method, tolerance) in [("dop853", 1e-6), ("dop853", 1e-8), ("dop853", 1e-10), ("radau9", 1e-8)] {
                let report = run_at(&text, tolerance, method);
                assert!(report.summary.steps < most, "{kind} {method} {tolerance}: {} steps", report.summary.steps);
                for (t, v) in report.times.iter().zip(column(&report, "v")) {
                    let off = (v - 1.0 - integral(&table, *t)).abs();
                    assert!(off < tolerance, "{kind} {method} {tolerance} at {t}: {off:e}");
                }
            }
        }
    }
}

/// The energy is that of the start, with the integral of the spring's curve as potential. Steps across its points left errors of up to
/// 400 tolerances.
#[test]
fn a_spring_whose_curve_goes_through_random_points_keeps_its_energy() {
    for count in [12, 60] {
        let points = random(12, count, -3.0, 3.0, 1.0);
        for (kind, interpolation) in KINDS {
            let table = Table::through(&points, interpolation, Outside::Clamped).unwrap();
            let text = cart(&points, kind, false);
            for tolerance in [1e-6, 1e-8, 1e-10] {
                let report = run_at(&text, tolerance, "dop853");
                for (x, v) in column(&report, "x").iter().zip(column(&report, "v")) {
                    let off = (0.5 * (v * v - 1.0) + integral(&table, *x) - integral(&table, 0.0)).abs();
                    assert!(off < 3.0 * tolerance, "{count} {kind} {tolerance} at {x}: {off:e}");
                }
            }
        }
    }
}

/// Many points of a smooth function: no step ends at them, and the motion is that of the function.
#[test]
fn dense_points_of_a_smooth_function_take_no_steps() {
    let points: Vec<[f64; 2]> = (0..=10_000).map(|k| 1e-3 * f64::from(k)).map(|t| [t, (2.0 * t).sin()]).collect();
    for kind in ["spline", "monotone"] {
        let report = run_at(&cart(&points, kind, true), 1e-6, "dop853");
        assert!(report.summary.steps < 60, "{kind}: {} steps", report.summary.steps);
        let exact: Vec<f64> = report.times.iter().map(|t| 1.0 + 0.5 * (1.0 - (2.0 * t).cos())).collect();
        assert!(difference(column(&report, "v"), &exact) < 1e-6, "{kind}");
    }
}
