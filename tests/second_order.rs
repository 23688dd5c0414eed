//! The generalized-alpha method on whole scenes: its order, what it takes and what it refuses.

use std::sync::Mutex;

use odyn::integrate::{GeneralizedAlpha, IntegrateError, Integrator, Method, Options, Outcome, Span, System};
use odyn::results::Status;
use odyn::session::{RunReport, Session};

use crate::support::{assert_same_motion, column, difference, options, root, run};

/// The multipliers at the end of the run that ended last.
static MULTIPLIERS: Mutex<Vec<f64>> = Mutex::new(Vec::new());

/// The method, with its multipliers left behind.
#[derive(Default)]
struct Recording(GeneralizedAlpha);

impl Integrator for Recording {
    fn name(&self) -> &'static str {
        "recording"
    }

    fn needs_fixed_step(&self) -> bool {
        self.0.needs_fixed_step()
    }

    fn needs_second_order(&self) -> bool {
        self.0.needs_second_order()
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        let outcome = self.0.integrate(system, y, span, options);
        *MULTIPLIERS.lock().unwrap() = self.0.multipliers().to_vec();
        outcome
    }
}

/// A run whose errors are looked at here: those that the scene allows are smaller.
#[track_caller]
fn run_with(scene: &str, sets: &[&str]) -> RunReport {
    let mut options = options(sets, &[]);
    let make = || -> Box<dyn Integrator> { Box::new(Recording::default()) };
    options.methods.add(Method { name: "recording", summary: "generalized-alpha", make });
    let session = Session::open(&root().join("scenes").join(scene), &options).unwrap_or_else(|e| panic!("{e}"));
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(report.summary.status, Status::Completed, "{scene}: {}", report.summary.reason);
    report
}

/// A run up to `t_end` with `steps` equal steps, and the multipliers at its end.
#[track_caller]
fn swing(scene: &str, t_end: f64, steps: u32) -> (RunReport, Vec<f64>) {
    let end = format!("simulation.t_end={t_end} s");
    let step = format!("simulation.fixed_step={:e} s", t_end / f64::from(steps));
    let report = run_with(scene, &["simulation.method=recording", &end, &step]);
    assert_eq!((report.summary.steps, report.summary.rejected), (u64::from(steps), 0));
    (report, MULTIPLIERS.lock().unwrap().clone())
}

fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

#[test]
fn it_has_order_two_on_the_pendulum_and_the_squeezer() {
    // One test, since the multipliers are left in one place.
    for (scene, t_end, steps, outputs) in [
        ("benchmarks/A01.toml", 2.0, 500, ["x", "y", "xd", "yd"]),
        ("benchmarks/A03.toml", 0.02, 2000, ["beta", "Fy", "Ex", "betad"]),
    ] {
        let exact = run(scene, &[&format!("simulation.t_end={t_end} s"), "simulation.tolerance=1e-12"]);
        let runs = [1, 2, 4].map(|factor| swing(scene, t_end, factor * steps));
        for name in outputs {
            let [coarse, fine] =
                [&runs[1], &runs[2]].map(|(run, _)| difference(column(run, name), column(&exact, name)));
            let found = order(coarse, fine);
            assert!((found - 2.0).abs() < 0.1, "{scene} {name}: order {found}, {coarse:e} to {fine:e}");
        }
        // What multipliers change by from one step size to half of it.
        let changes = [0, 1].map(|k| difference(&runs[k].1, &runs[k + 1].1));
        let found = order(changes[0], changes[1]);
        assert!((found - 2.0).abs() < 0.1, "{scene} multipliers: order {found}, {changes:?}");
    }
}

#[test]
fn every_kind_of_matrix_gives_the_motion_of_the_other_methods() {
    // Rotations in space with redundant rows; stiff forces; no joint at all; and a chain with more unknowns than are factored
    // densely.
    for (scene, t_end, steps, bound, work) in [
        ("benchmarks/A04.toml", 0.5, 1000, 1e-6, (3374, 7)),
        ("benchmarks/A05.toml", 0.2, 500, 2e-6, (1958, 20)),
        ("benchmarks/freebody.toml", 0.5, 1000, 1e-5, (2000, 1)),
        ("benchmarks/chain_N100.toml", 0.05, 50, 2e-6, (354, 49)),
    ] {
        let end = format!("simulation.t_end={t_end} s");
        let step = format!("simulation.fixed_step={:e} s", t_end / f64::from(steps));
        let exact = run_with(scene, &[&end]);
        let report = run_with(scene, &[&end, &step, "simulation.method=generalized-alpha"]);
        let summary = &report.summary;
        assert_eq!((summary.newton_iterations, summary.newton_factorisations), work, "{scene}");
        assert!(summary.audit.position_violation < 1e-10, "{scene}: {:?}", summary.audit);
        assert_same_motion(&report, &exact, bound);
    }
}

#[test]
fn what_it_cannot_do_is_refused_with_the_reason() {
    let refusal = |scene: &str, sets: &[&str]| {
        let sets: Vec<&str> = [&["simulation.method=generalized-alpha"], sets].concat();
        let opened = Session::open(&root().join("scenes").join(scene), &options(&sets, &[]));
        let run = |session: Session| session.run(None, Box::new(|_| ()), &Default::default()).map(|_| ());
        opened.and_then(run).unwrap_err().to_string()
    };
    for (scene, set, words) in [
        ("benchmarks/A01.toml", "simulation.t_end=1", "needs a step size"),
        ("benchmarks/A01.toml", "simulation.formulation=joint", "does not go with the formulation `joint`"),
        ("benchmarks/A01.toml", "simulation.engine=reference", "does not go with the engine `reference`"),
        ("compressor-speed-control.toml", "simulation.fixed_step=1e-5 s", "states of its own"),
    ] {
        let message = refusal(scene, &[set]);
        assert!(message.contains(words), "{scene} {set}: {message}");
    }
}

#[test]
fn the_plan_says_why_the_coordinates_are_those_of_bodies() {
    let sets = ["simulation.method=generalized-alpha", "simulation.fixed_step=1 ms"];
    let session = Session::open(&root().join("scenes/benchmarks/A03.toml"), &options(&sets, &[])).unwrap();
    let plan = session.plan_report();
    assert_eq!(plan.formulation, "cartesian");
    assert!(plan.formulation_why.contains("the method generalized-alpha"), "{}", plan.formulation_why);
}
