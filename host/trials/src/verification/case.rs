//! [`Case`]: a verified scene as plain data.

use crate::results::Work;

/// Largest imbalance of a body's equations of motion that passes, as a share of the largest load.
pub const BALANCE_BOUND: f64 = 1e-9;

/// A scene with checks, and what came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// File name without its ending.
    pub name: String,
    /// File name.
    pub file: String,
    /// Title of the scene; the name where it has none.
    pub title: String,
    /// Full names of the elements it verifies.
    pub elements: Vec<String>,
    /// The analysis that it verifies; absent: a run.
    pub analysis: Option<String>,
    /// The problem and the derivation of its reference, Markdown.
    pub text: String,
    /// The scene file.
    pub source: String,
    /// What was measured, or why nothing was.
    pub outcome: Result<Measured, String>,
}

/// What was measured in a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measured {
    /// Unit of all times.
    pub time_unit: String,
    /// Method of integration.
    pub method: String,
    /// Formulation of the equations; not whether machine code was made, which no result depends on.
    pub engine: String,
    /// Relative tolerance of the run that is judged.
    pub tolerance: f64,
    /// The checks, in the order of the scene.
    pub checks: Vec<Checked>,
    /// The worst imbalance of any body; `None` in a scene without moving bodies.
    pub balance: Option<Balance>,
    /// Work of the run that is judged.
    pub work: Work,
    /// The same scene at other tolerances, largest first; may be empty.
    pub ladder: Vec<Rung>,
}

/// A check and how it came out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Checked {
    /// Its name.
    pub name: String,
    /// What kind of quantity is checked, a word of scene files.
    pub kind: String,
    /// What is checked, as written in the scene.
    pub value: String,
    /// What it is checked against, as written in the scene.
    pub reference: String,
    /// Unit of value, reference and errors; may be empty.
    pub unit: String,
    /// Largest error that passes, absolute.
    pub tolerance: f64,
    /// Largest error.
    pub largest: f64,
    /// Time of the largest error.
    pub at: f64,
    /// Whether the largest error passes.
    pub passed: bool,
    /// Why nothing could be checked.
    pub problem: Option<String>,
    /// Times and magnitudes of the errors there.
    pub errors: Vec<(f64, f64)>,
}

/// The worst imbalance of the equations of motion of any body: the sum of all loads that joints and force elements report,
/// and of its weight, against its acceleration (Newton) or the rate of its angular momentum about the centre of mass (Euler).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    /// Largest component that is left, as a share of the largest load in the scene.
    pub share: f64,
    /// The body.
    pub body: String,
    /// Whether torques are out of balance, not forces.
    pub torque: bool,
    /// The time.
    pub at: f64,
}

/// A scene at one tolerance of the integration.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rung {
    /// Relative tolerance of the run.
    pub tolerance: f64,
    /// Largest error of each check.
    pub largest: Vec<f64>,
    /// Work of the run.
    pub work: Work,
}

impl Case {
    /// Whether everything about it is as it should be.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.outcome.as_ref().is_ok_and(Measured::passed)
    }

    /// The largest error over tolerance among all checks; `None` where nothing was measured.
    #[must_use]
    pub fn worst(&self) -> Option<f64> {
        self.outcome.as_ref().ok().map(Measured::worst)
    }
}

impl Measured {
    /// Whether all checks and the balance pass.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed) && self.balance.as_ref().is_none_or(Balance::passed)
    }

    /// The largest error over tolerance among all checks; NaN wins.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.checks.iter().map(Checked::ratio).fold(0.0, larger)
    }
}

impl Checked {
    /// The largest error as a multiple of the tolerance.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.share(self.largest)
    }

    /// An error as a multiple of the tolerance; no error is nothing of any tolerance, also of zero.
    #[must_use]
    pub fn share(&self, error: f64) -> f64 {
        if error == 0.0 { 0.0 } else { error / self.tolerance }
    }
}

impl Balance {
    /// Whether the imbalance is within [`BALANCE_BOUND`].
    #[must_use]
    pub fn passed(&self) -> bool {
        self.share <= BALANCE_BOUND
    }
}

/// The larger of two numbers; NaN wins.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
