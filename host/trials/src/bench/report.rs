//! [`Report`]: measurements as plain data.

use super::Machine;

/// Everything that was measured.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Where.
    pub machine: Machine,
    /// When, as the user put it; empty if not given.
    pub date: String,
    /// The problems, in the order of the scenes.
    pub problems: Vec<Problem>,
    /// What other programs needed for the same problems.
    pub peers: Vec<Point>,
}

/// A scene and all its runs.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// File name without its ending.
    pub name: String,
    /// Title of the scene; the name where it has none.
    pub title: String,
    /// What is measured, as the scene writes it.
    pub measured: Vec<String>,
    /// What the errors are measured by, in words; empty where the scene says it.
    pub reference: String,
    /// Unit of the errors; empty if there is none, or more than one.
    pub unit: String,
    /// Time of a whole process that runs the scene with its own settings, besides the integration, s; `None` if it was not
    /// measured.
    pub start_up: Option<f64>,
    /// The runs: methods in the order of the settings, from loose to tight.
    pub points: Vec<Point>,
}

/// A problem solved by one method at one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Name of the problem.
    pub problem: String,
    /// The program.
    pub solver: String,
    /// The method of integration.
    pub method: String,
    /// How accurate it was asked to be.
    pub setting: Setting,
    /// What came out, or why nothing did.
    pub outcome: Result<Measured, String>,
}

/// How accurate a method is asked to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setting {
    /// Relative tolerance of a method that controls its error.
    Tolerance(f64),
    /// Step size, s, of one that does not.
    Step(f64),
}

/// A run as measured.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measured {
    /// Largest error of a measured coordinate.
    pub error: f64,
    /// Largest error of the energy balance, relative; NaN if not known.
    pub energy_error: f64,
    /// Work.
    pub work: Work,
    /// Median times.
    pub times: Times,
    /// Number of runs of which the times are the medians.
    pub repeats: usize,
}

/// Work of a run; `None` where it is not known.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted steps.
    pub steps: Option<u64>,
    /// Steps tried and not accepted.
    pub rejected: Option<u64>,
    /// Evaluations of the right side.
    pub evaluations: Option<u64>,
    /// Factorisations.
    pub factorisations: Option<u64>,
}

/// Times of a run, s; NaN where not known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Times {
    /// Reading the scene and its libraries, resolving.
    pub load: f64,
    /// Writing and compiling the equations, assembly.
    pub compile: f64,
    /// Making machine code: part of `compile` if it was made before the first step, else beside the integration, on a
    /// thread of its own.
    pub machine_code: f64,
    /// Integration with its samples.
    pub integrate: f64,
    /// From reading to the last check.
    pub total: f64,
}

impl Report {
    /// All measurements, our own first.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.problems.iter().flat_map(|problem| &problem.points).chain(&self.peers)
    }
}

impl Problem {
    /// Whether any run came to its end.
    #[must_use]
    pub fn solved(&self) -> bool {
        self.points.iter().any(|point| point.outcome.is_ok())
    }
}

impl Setting {
    /// `tolerance` or `step`.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Tolerance(_) => "tolerance",
            Self::Step(_) => "step",
        }
    }

    /// Its number.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Tolerance(value) | Self::Step(value) => value,
        }
    }
}

/// The middle one of some numbers; of an even number, the mean of the two in the middle. NaN of none.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        _ => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}
