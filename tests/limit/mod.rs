//! The limit: mechanisms with one degree of freedom written by hand, in one coordinate and plain numbers, the way a specialist
//! would for this one mechanism. No general program can do less work per evaluation, so its run times are measured against
//! these. They are integrated by the host's own Dormand-Prince 8(5,3), and their errors are measured as `odyn bench` does,
//! against the same references.
//!
//! The equation of motion of each is Lagrange's in one coordinate q, with the reduced inertia M(q) and the generalised force Q:
//! M q'' + M_q q'^2 / 2 = Q(q, q').

mod andrews;
mod four_bar;
mod pendulum;
mod slider_crank;

use std::path::Path;
use std::time::Instant;

use odyn::integrate::{self, Failure, Options, Span, System};
use odyn::results::Table;

/// A mechanism and how it starts.
pub struct Mechanism {
    /// Name of the scene of the same mechanism in `scenes/benchmarks`, and of its reference in `scenes/reference`.
    pub problem: &'static str,
    /// Coordinate and its rate at the start.
    pub start: [f64; 2],
    /// Size of the rate, for the error control; the coordinate is an angle of size 1.
    pub rate: f64,
    /// q'' for q and q'.
    pub acceleration: fn(f64, f64) -> f64,
    /// The columns of the reference that the scene's checks compare.
    pub columns: &'static [&'static str],
    /// Their values for q.
    pub measured: fn(f64) -> Vec<f64>,
}

/// All of them.
pub fn mechanisms() -> [Mechanism; 4] {
    [pendulum::mechanism(), four_bar::mechanism(), andrews::mechanism(), slider_crank::mechanism()]
}

/// What an integration came to.
#[allow(dead_code, reason = "tests, benches and the table of the limit look at different parts of it")]
pub struct Run {
    /// Largest difference of a measured coordinate from its reference.
    pub error: f64,
    /// Time of the integration with its samples, s.
    pub seconds: f64,
    /// Accepted steps, rejected ones, evaluations.
    pub work: [usize; 3],
}

impl Mechanism {
    /// The times of the reference, and its columns that are compared.
    pub fn reference(&self) -> (Vec<f64>, Vec<Vec<f64>>) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/reference");
        let table = Table::read(&folder.join(format!("{}.csv", self.problem))).expect("the references are there");
        let place = |name: &&str| table.names.iter().position(|own| own == name).expect("a column of the reference");
        let columns = self.columns.iter().map(|name| table.columns[place(name)].clone()).collect();
        (table.times, columns)
    }

    /// Integrates over all times of the reference.
    pub fn run(&self, tolerance: f64, (times, columns): &(Vec<f64>, Vec<Vec<f64>>)) -> Run {
        let mut system = Moving { mechanism: self, tolerance, samples: Vec::with_capacity(times.len()) };
        let span = Span { t_start: times[0], t_end: times[times.len() - 1], sample_times: times };
        let mut state = self.start;
        let started = Instant::now();
        let mut method = integrate::by_name("dop853").expect("the host has this method");
        let outcome = method.integrate(&mut system, &mut state, &span, &Options::default());
        let seconds = started.elapsed().as_secs_f64();
        let counters = outcome.expect("the equations have no failures").counters;
        assert_eq!(system.samples.len(), times.len(), "{} stopped early", self.problem);
        let mut error = 0.0_f64;
        for (k, q) in system.samples.iter().enumerate() {
            for (value, column) in (self.measured)(*q).iter().zip(columns) {
                error = error.max((value - column[k]).abs());
            }
        }
        Run { error, seconds, work: [counters.steps, counters.rejected, counters.evaluations] }
    }
}

/// A mechanism under way.
struct Moving<'a> {
    mechanism: &'a Mechanism,
    tolerance: f64,
    samples: Vec<f64>,
}

impl System for Moving<'_> {
    fn dim(&self) -> usize {
        2
    }

    fn rhs(&mut self, _: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        dy[0] = y[1];
        dy[1] = (self.mechanism.acceleration)(y[0], y[1]);
        Ok(())
    }

    fn error_norm(&mut self, _: &[f64], _: &[f64], error: &[f64]) -> f64 {
        error[0].abs().max(error[1].abs() / self.mechanism.rate) / self.tolerance
    }

    fn sample(&mut self, _: f64, y: &[f64]) -> Result<(), Failure> {
        self.samples.push(y[0]);
        Ok(())
    }
}

/// The equations are right, and cost what they did: the limit must not move unnoticed.
#[test]
fn mechanisms_by_hand_agree_with_the_references() {
    let evaluations = mechanisms().each_ref().map(|mechanism| {
        let run = mechanism.run(1e-12, &mechanism.reference());
        assert!(run.error < 5e-10, "{}: {:e}", mechanism.problem, run.error);
        run.work[2]
    });
    // Step sizes depend on the last digits of the system's functions such as `sin`.
    if cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        assert_eq!(evaluations, [4382, 3884, 5300, 14462]);
    }
}
