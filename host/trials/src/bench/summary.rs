//! What a reader wants first: the best time at some errors, and how programs compare.

use super::report::{Point, Problem, Report};
use super::runner::SOLVER;

/// Errors at which times are compared.
pub const LEVELS: [f64; 3] = [1e-3, 1e-6, 1e-9];

/// Best times of one method of one program for one problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// The program.
    pub solver: String,
    /// The method.
    pub method: String,
    /// For each of [`LEVELS`]: the shortest integration (s) with an error not above it; `None` if no run is as accurate.
    pub times: [Option<f64>; 3],
}

/// A program compared with ours.
#[derive(Debug, Clone, PartialEq)]
pub struct Ratio {
    /// The other program.
    pub solver: String,
    /// Geometric mean, over problems and [`LEVELS`], of its time divided by ours, each with its best method: above 1 we are
    /// faster. NaN if there is nothing to compare.
    pub mean: f64,
    /// The least of these ratios, with its problem and level.
    pub least: Option<(f64, String, f64)>,
    /// Problems at levels that both reach.
    pub compared: usize,
    /// Those that only we reach.
    pub only_ours: usize,
    /// Those that only the other program reaches.
    pub only_theirs: usize,
}

impl Report {
    /// Best times for a problem, in the order of the points, methods without any left out.
    #[must_use]
    pub fn best(&self, problem: &Problem) -> Vec<Best> {
        let mut all: Vec<Best> = Vec::new();
        let peers = self.peers.iter().filter(|point| point.problem == problem.name);
        for point in problem.points.iter().chain(peers) {
            let same = |best: &Best| best.solver == point.solver && best.method == point.method;
            let k = all.iter().position(same).unwrap_or_else(|| {
                all.push(Best { solver: point.solver.clone(), method: point.method.clone(), times: [None; 3] });
                all.len() - 1
            });
            for (time, level) in all[k].times.iter_mut().zip(LEVELS) {
                *time = least(*time, time_at(point, level));
            }
        }
        all.retain(|best| best.times.iter().any(Option::is_some));
        all
    }

    /// Every other program compared with ours, in the order of the tables.
    #[must_use]
    pub fn ratios(&self) -> Vec<Ratio> {
        let mut solvers: Vec<&str> = Vec::new();
        for peer in &self.peers {
            if !solvers.contains(&peer.solver.as_str()) {
                solvers.push(&peer.solver);
            }
        }
        solvers.into_iter().map(|solver| self.ratio(solver)).collect()
    }

    fn ratio(&self, solver: &str) -> Ratio {
        let mut ratio =
            Ratio { solver: solver.into(), mean: f64::NAN, least: None, compared: 0, only_ours: 0, only_theirs: 0 };
        let mut logarithms = 0.0;
        for problem in &self.problems {
            // A problem that the other program was not given says nothing about it.
            if !self.peers.iter().any(|point| point.solver == solver && point.problem == problem.name) {
                continue;
            }
            let best = self.best(problem);
            let fastest = |own: &str, k: usize| {
                best.iter().filter(|best| best.solver == own).fold(None, |time, best| least(time, best.times[k]))
            };
            for (k, level) in LEVELS.into_iter().enumerate() {
                match (fastest(SOLVER, k), fastest(solver, k)) {
                    (Some(ours), Some(theirs)) => {
                        let here = theirs / ours;
                        ratio.compared += 1;
                        logarithms += here.ln();
                        if ratio.least.as_ref().is_none_or(|(least, ..)| here < *least) {
                            ratio.least = Some((here, problem.name.clone(), level));
                        }
                    }
                    (Some(_), None) => ratio.only_ours += 1,
                    (None, Some(_)) => ratio.only_theirs += 1,
                    (None, None) => {}
                }
            }
        }
        if ratio.compared > 0 {
            ratio.mean = (logarithms / ratio.compared as f64).exp();
        }
        ratio
    }
}

/// Time of integration of a point whose error is not above a level.
fn time_at(point: &Point, level: f64) -> Option<f64> {
    let run = point.outcome.as_ref().ok()?;
    Some(run.times.integrate).filter(|time| run.error <= level && *time > 0.0)
}

fn least(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}
