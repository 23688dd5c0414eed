//! Methods of integration that the host does not have, written here against its public interface.

use nalgebra::{DMatrix, DVector};
use odyn::integrate::{Accepted, Estimate, Explicit, Integrator, Method, Pair, Row, Run, StopReason, Trouble};
use odyn::results::Remedy;
use odyn::session::{RunReport, Session};

use crate::inertia::try_text;
use crate::support::{assert_same_motion, column, difference, options, root};

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

// ANCHOR: generalized_alpha
/// The generalized-alpha method for y' = f(t, y) (Jansen, Whiting & Hulbert, "A generalized-alpha method for integrating the
/// filtered Navier-Stokes equations with a stabilized finite element method", Comput. Methods Appl. Mech. Engrg. 190, 2000):
/// order 2, implicit, with steps of one size and a spectral radius of 0.9 for what is infinitely stiff.
///
/// It solves `r_m = f(t + A_F h, y + A_F (y_new - y))` with `r_m = r + A_M (r_new - r)` and
/// `y_new = y + h (r + GAMMA (r_new - r))` for the rates `r_new` by simplified Newton iterations; parabolas between its steps.
#[derive(Default)]
struct GeneralizedAlpha {
    rates: Vec<f64>,
    rates_new: Vec<f64>,
    y_new: Vec<f64>,
    work: Vec<f64>,
    found: Vec<f64>,
}

const RADIUS: f64 = 0.9;
const A_M: f64 = 0.5 * (3.0 - RADIUS) / (1.0 + RADIUS);
const A_F: f64 = 1.0 / (1.0 + RADIUS);
const GAMMA: f64 = 0.5 + A_M - A_F;

impl Integrator for GeneralizedAlpha {
    fn name(&self) -> &'static str {
        "generalized-alpha"
    }

    fn needs_fixed_step(&self) -> bool {
        true
    }

    fn may_use_jacobian(&self) -> bool {
        true
    }

    fn steps(&mut self, run: &mut Run<'_>, y: &mut [f64]) -> Result<(), Trouble> {
        let n = y.len();
        for vector in [&mut self.rates, &mut self.rates_new, &mut self.y_new, &mut self.work, &mut self.found] {
            vector.resize(n, 0.0);
        }
        run.sample_start(y)?;
        run.rhs(run.t, y, &mut self.rates, 0.0)?;
        let size = run.options.fixed_step.unwrap_or(f64::INFINITY);
        while let Some(t_new) = run.next_equal_end(size) {
            run.check_step_limit()?;
            let t = run.t;
            let h = t_new - t;
            self.solve(run, y, h)?;
            run.project(t_new, &mut self.y_new, h)?;
            let y_old = y.to_vec();
            y.copy_from_slice(&self.y_new);
            let (y_new, rates) = (&self.y_new, &self.rates);
            let accepted = run.finish_step(t_new, y, &mut self.work, |time, out| {
                let s = (time - t) / h;
                for (k, value) in out.iter_mut().enumerate() {
                    let straight = h * rates[k];
                    *value = y_old[k] + s * (straight + s * (y_new[k] - y_old[k] - straight));
                }
            })?;
            match accepted {
                Accepted::Unchanged => std::mem::swap(&mut self.rates, &mut self.rates_new),
                Accepted::Changed => run.rhs(t_new, y, &mut self.rates, 0.0)?,
            }
        }
        Ok(())
    }
}

impl GeneralizedAlpha {
    /// The rates and the state at the end of a step of size `h`. Without a Jacobian, the iterations are plain ones.
    fn solve(&mut self, run: &mut Run<'_>, y: &[f64], h: f64) -> Result<(), Trouble> {
        let n = y.len();
        let mut jacobian = DMatrix::zeros(n, n);
        run.counters.jacobians += 1;
        run.jacobian(run.t, y, &mut |row, column, value| jacobian[(row, column)] = value)?;
        run.counters.factorisations += 1;
        let matrix = (DMatrix::identity(n, n) * A_M - jacobian * (A_F * GAMMA * h)).lu();
        self.rates_new.copy_from_slice(&self.rates);
        for _ in 0..20 {
            run.counters.newton_iterations += 1;
            for (k, old) in y.iter().enumerate() {
                self.y_new[k] = old + h * (self.rates[k] + GAMMA * (self.rates_new[k] - self.rates[k]));
                self.work[k] = old + A_F * (self.y_new[k] - old);
            }
            run.rhs(run.t + A_F * h, &self.work, &mut self.found, h)?;
            let rest = |k: usize| self.found[k] - self.rates[k] - A_M * (self.rates_new[k] - self.rates[k]);
            let Some(change) = matrix.solve(&DVector::from_fn(n, |k, _| rest(k))) else { break };
            for k in 0..n {
                self.rates_new[k] += change[k];
                self.work[k] = GAMMA * h * change[k];
                self.y_new[k] += self.work[k];
            }
            if run.system.error_norm(y, &self.y_new, &self.work) < 0.01 {
                return Ok(());
            }
        }
        run.counters.rejected += 1;
        Err(Trouble::Stop(StopReason::NoConvergence { step: h }))
    }
}
// ANCHOR_END: generalized_alpha

// ANCHOR: use
fn with_method(scene: &str, method: &str, sets: &[&str]) -> RunReport {
    let set = format!("simulation.method={method}");
    let mut options = options(&[&[set.as_str()], sets].concat(), &[]);
    let make = || -> Box<dyn Integrator> { Box::new(Explicit::new("bogacki-shampine", &BOGACKI_SHAMPINE)) };
    options.methods.add(Method { name: "bogacki-shampine", summary: "explicit, 3(2)", make });
    options.methods.add(Method { name: "heun", summary: "explicit, 2(1)", make: || Box::new(Heun::default()) });
    let make = || -> Box<dyn Integrator> { Box::new(GeneralizedAlpha::default()) };
    options.methods.add(Method { name: "generalized-alpha", summary: "implicit, order 2, fixed steps", make });
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

/// Its order, and that stiffness does not limit its steps: with those of the governor, 1 ms, explicit methods do not reach the
/// end.
#[test]
fn generalized_alpha_from_outside_the_host_has_order_two_and_solves_stiff_scenes() {
    for (scene, end, outputs, steps) in [
        ("benchmarks/A01.toml", 2.0, ["x", "y", "xd", "yd"].as_slice(), 500),
        ("benchmarks/A03.toml", 0.02, &["beta", "betad"], 2000),
        ("benchmarks/A05.toml", 0.2, &["s"], 200),
    ] {
        let end_set = format!("simulation.t_end={end} s");
        let exact = with_method(scene, "dop853", &[&end_set, "simulation.tolerance=1e-12"]);
        let [coarse, fine] = [steps, 2 * steps].map(|steps| {
            let step = format!("simulation.fixed_step={:e} s", end / f64::from(steps));
            let report = with_method(scene, "generalized-alpha", &[&end_set, &step]);
            assert_eq!((report.summary.steps, report.summary.rejected), (steps as u64, 0), "{scene}");
            report
        });
        for name in outputs {
            let [coarse, fine] = [&coarse, &fine].map(|run| difference(column(run, name), column(&exact, name)));
            let order = (coarse / fine).log2();
            assert!((order - 2.0).abs() < 0.1, "{scene} {name}: order {order}, {coarse:e} to {fine:e}");
        }
    }
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

/// Undamped beams in large motion: the Jacobian of an earlier step no longer serves, and steps of one size cannot be made shorter.
#[test]
fn steps_of_one_size_take_a_new_jacobian_where_the_old_one_fails() {
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n\
         [simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.06\noutput_step = 0.01\nmethod = \"radau5\"\n\
         [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"n10\"\ncomponent = \"z\"\n",
    );
    for k in 1..=10 {
        let (at, before) = (0.1 * f64::from(k), 0.1 * f64::from(k - 1));
        let other = if k == 1 { "ground".into() } else { format!("n{}", k - 1) };
        text += &format!(
            "[[body]]\nname = \"n{k}\"\nmass = 0.027\ninertia = [4.5e-7, 2.2725e-5, 2.2725e-5]\nposition = [{at:?}, 0, 0]\n\
             [[force]]\nname = \"e{k}\"\ntype = \"beam\"\nbodies = [\"{other}\", \"n{k}\"]\n\
             points = [[{before:?}, 0, 0], [{at:?}, 0, 0]]\naxis = [0, 0, 1]\nx_axis = [1, 0, 0]\n\
             params = {{ length = 0.1, young = 7e10, shear = 2.7e10, area = 1e-4, iy = 8.333e-10, iz = 8.333e-10, torsion = 1.667e-9 }}\n"
        );
    }
    let of = |sets: &[&str]| column(&try_text(&text, sets).unwrap(), "z").to_vec();
    let [fixed, finer] = ["1 ms", "0.1 ms"].map(|step| of(&[&format!("simulation.fixed_step={step}")]));
    let largest = finer.iter().fold(0.0_f64, |most, z| most.max(z.abs()));
    let off = fixed.iter().zip(&finer).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    assert!(largest > 0.01 && off < 1e-3 * largest, "{off:e} of {largest}");
}
