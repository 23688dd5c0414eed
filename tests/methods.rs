//! Methods of integration that the host does not have, written here against its public interface.

use odyn::integrate::{
    Accepted, Estimate, Explicit, IntegrateError, Integrator, Method, Options, Outcome, Pair, Row, Run, Span,
    StopReason, System, Trouble,
};
use odyn::results::Remedy;
use odyn::session::{RunReport, Session};

use crate::support::{assert_same_motion, options, root};

// ANCHOR: pair
/// Bogacki & Shampine 3(2) (1989), with cubic interpolation.
static BOGACKI_SHAMPINE: Pair = {
    const A: [Row; 3] = [&[], &[(0, 0.5)], &[(1, 0.75)]];
    const B: Row = &[(0, 2.0 / 9.0), (1, 1.0 / 3.0), (2, 4.0 / 9.0)];
    const E: Row = &[(0, -5.0 / 72.0), (1, 1.0 / 12.0), (2, 1.0 / 9.0), (3, -1.0 / 8.0)];
    Pair {
        c: &[0.0, 0.5, 0.75, 1.0],
        a: &A,
        b: B,
        error: Estimate::Single(E),
        a_dense: &[],
        d: &[],
        order: 3.0,
        beta: 0.0,
        beta_share: 0.0,
        stability: 2.51,
    }
};
// ANCHOR_END: pair

// ANCHOR: heun
/// Heun's method of order 2 with the error of Euler's, and straight lines between its steps.
#[derive(Default)]
struct Heun {
    start: Vec<f64>,
    end: Vec<f64>,
    y_new: Vec<f64>,
    work: Vec<f64>,
}

impl Integrator for Heun {
    fn name(&self) -> &'static str {
        "heun"
    }

    fn integrate(
        &mut self,
        system: &mut dyn System,
        y: &mut [f64],
        span: &Span<'_>,
        options: &Options,
    ) -> Result<Outcome, IntegrateError> {
        let mut run = Run::new(system, y, span, options)?;
        let result = self.steps(&mut run, y);
        run.end(result)
    }
}

impl Heun {
    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        for vector in [&mut self.start, &mut self.end, &mut self.y_new, &mut self.work] {
            vector.resize(y.len(), 0.0);
        }
        run.sample_start(y)?;
        run.rhs(run.t, y, &mut self.start, 0.0)?;
        let mut h = run.options.first_step.unwrap_or(1e-3 * (run.span.t_end - run.span.t_start));
        while run.t < run.span.t_end {
            run.check_step_limit()?;
            let (t, t_new) = (run.t, run.step_end(h.min(run.longest_step(y))));
            let tried = t_new - t;
            self.y_new.iter_mut().zip(&*y).zip(&self.start).for_each(|((new, old), rate)| *new = old + tried * rate);
            run.rhs(t_new, &self.y_new, &mut self.end, tried)?;
            for k in 0..y.len() {
                self.work[k] = 0.5 * tried * (self.end[k] - self.start[k]);
                self.y_new[k] += self.work[k];
            }
            let error = run.system.error_norm(y, &self.y_new, &self.work);
            h = tried * (0.9 / error.sqrt()).clamp(0.2, 5.0);
            if error > 1.0 {
                run.reject(&StopReason::StepTooSmall { step: h });
                continue;
            }
            run.project(t_new, &mut self.y_new, tried)?;
            let y_old = y.to_vec();
            y.copy_from_slice(&self.y_new);
            let y_new = &self.y_new;
            let accepted = run.finish_step(t_new, y, &mut self.work, |time, out| {
                let share = (time - t) / tried;
                out.iter_mut().enumerate().for_each(|(k, value)| *value = y_old[k] + share * (y_new[k] - y_old[k]));
            })?;
            let _: Accepted = accepted;
            run.rhs(t_new, y, &mut self.start, 0.0)?;
        }
        Ok(())
    }
}
// ANCHOR_END: heun

// ANCHOR: use
fn with_method(scene: &str, method: &str, sets: &[&str]) -> RunReport {
    let set = format!("simulation.method={method}");
    let mut options = options(&[&[set.as_str()], sets].concat(), &[]);
    let make = || -> Box<dyn Integrator> { Box::new(Explicit::new("bogacki-shampine", &BOGACKI_SHAMPINE)) };
    options.methods.add(Method { name: "bogacki-shampine", summary: "explicit, 3(2)", make });
    options.methods.add(Method { name: "heun", summary: "explicit, 2(1)", make: || Box::new(Heun::default()) });
    let session = Session::open(&root().join("scenes").join(scene), &options).unwrap_or_else(|error| panic!("{error}"));
    session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
}
// ANCHOR_END: use

#[test]
fn a_pair_from_outside_the_host_runs_a_scene() {
    let sets = ["simulation.t_end=10 ms", "simulation.tolerance=1e-7"];
    let reference = with_method("compressor.toml", "dop853", &["simulation.t_end=10 ms"]);
    let report = with_method("compressor.toml", "bogacki-shampine", &sets);
    assert_eq!((report.summary.method.as_str(), report.summary.t_end_reached), ("bogacki-shampine", 10.0));
    assert_same_motion(&report, &reference, 1e-5);
    // A method of low order at a tight tolerance.
    assert!(report.summary.steps > 4 * reference.summary.steps, "{}", report.summary.steps);
}

#[test]
fn a_method_from_outside_the_host_runs_a_scene() {
    let sets = ["simulation.t_end=5 ms", "simulation.tolerance=1e-6"];
    let reference = with_method("compressor.toml", "dop853", &["simulation.t_end=5 ms"]);
    let report = with_method("compressor.toml", "heun", &sets);
    assert_eq!(report.summary.t_end_reached, 5.0);
    assert_same_motion(&report, &reference, 1e-3);
}

/// Work of a run in evaluations: those of dense matrices, Jacobians and iterations weighed as in a scene of a few bodies.
fn cost(report: &RunReport) -> f64 {
    let s = &report.summary;
    (s.evaluations + s.projections + 15 * (s.jacobians + s.newton_factorisations) + s.newton_iterations) as f64
}

#[test]
fn the_choice_of_the_method_costs_little_more_than_the_better_one() {
    for (scene, end) in
        [("bushing_1e6", "2 s"), ("bushing_1e8", "0.3 s"), ("A05", "1 s"), ("dpend", "1 s"), ("A03", "0.01 s")]
    {
        for tolerance in ["1e-4", "1e-6", "1e-8", "1e-10"] {
            let path = format!("benchmarks/{scene}.toml");
            let sets = [format!("simulation.t_end={end}"), format!("simulation.tolerance={tolerance}")];
            let of = |method: &str| with_method(&path, method, &[&sets[0], &sets[1]]);
            let (auto, explicit, implicit) = (of("auto"), of("dop853"), of("radau5"));
            let better = cost(&explicit).min(cost(&implicit));
            let text = format!("{scene} {tolerance}: {} {} {}", cost(&auto), cost(&explicit), cost(&implicit));
            assert!(cost(&auto) <= 1.5 * better, "{text}");
            if matches!(scene, "dpend" | "A03") {
                assert_eq!(
                    (auto.summary.recoveries[Remedy::MethodSwitch], auto.columns == explicit.columns),
                    (0, true),
                    "{text}"
                );
            }
        }
    }
}
