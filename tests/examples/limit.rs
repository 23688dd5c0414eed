//! Measures the mechanisms written by hand at several tolerances and prints the table that `odyn bench --peers` takes.

#[path = "../limit/mod.rs"]
mod limit;

use odyn::bench::{Machine, Measured, Point, Report, Setting, TOLERANCES, Times, Work, write};

/// Runs of which the time is the median; an odd number.
const REPEATS: usize = 21;

fn main() {
    let mut report = Report { machine: Machine::this(), ..Report::default() };
    for mechanism in limit::mechanisms() {
        let reference = mechanism.reference();
        for tolerance in TOLERANCES {
            let mut runs: Vec<limit::Run> = (0..REPEATS).map(|_| mechanism.run(tolerance, &reference)).collect();
            runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
            let run = &runs[REPEATS / 2];
            let [steps, rejected, evaluations] = run.work.map(|count| Some(count as u64));
            let unknown = f64::NAN;
            let measured = Measured {
                error: run.error,
                energy_error: unknown,
                work: Work { steps, rejected, evaluations, factorisations: None },
                times: Times {
                    load: unknown,
                    compile: unknown,
                    machine_code: unknown,
                    integrate: run.seconds,
                    total: unknown,
                },
                repeats: REPEATS,
            };
            report.peers.push(Point {
                problem: mechanism.problem.into(),
                solver: "by hand".into(),
                method: "dop853".into(),
                setting: Setting::Tolerance(tolerance),
                outcome: Ok(measured),
            });
        }
    }
    print!("{}", write(&report));
}
