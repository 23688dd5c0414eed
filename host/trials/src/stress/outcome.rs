//! [`Outcome`]: what came out of a trial, as plain data.

use crate::results::Work;

/// A trial in one formulation, and how it came out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Name of the trial.
    pub trial: String,
    /// Family of the trial.
    pub family: String,
    /// What the trial is about.
    pub text: String,
    /// Where its bounds come from; may be empty.
    pub why: String,
    /// The scene file as the suite names it.
    pub scene: String,
    /// Changes of the scene, those of the short form included.
    pub set: Vec<String>,
    /// The coordinates asked for.
    pub formulation: String,
    /// What must come out, in words.
    pub expected: String,
    /// What was measured, each with its bound.
    pub measures: Vec<Measure>,
    /// What else was not as expected; empty if nothing.
    pub faults: Vec<String>,
    /// What the program said, where a message was expected.
    pub said: String,
    /// Work of the run; zero where nothing was run.
    pub work: Work,
    /// Time from reading the scene to the verdict, s.
    pub seconds: f64,
}

/// Something measured, and the most it may be.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// What it is, in words.
    pub what: String,
    /// The value found.
    pub found: f64,
    /// The largest value that passes.
    pub bound: f64,
}

impl Outcome {
    /// Whether everything is as expected.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.faults.is_empty() && self.measures.iter().all(Measure::passed)
    }

    /// The measure nearest to its bound, or furthest beyond it.
    #[must_use]
    pub fn worst(&self) -> Option<&Measure> {
        let mut worst: Option<&Measure> = None;
        for measure in &self.measures {
            let share = measure.share();
            if worst.is_none_or(|worst| share.is_nan() || share > worst.share()) {
                worst = Some(measure);
            }
            if share.is_nan() {
                break;
            }
        }
        worst
    }

    /// A measure by its name.
    #[must_use]
    pub fn measure(&self, what: &str) -> Option<&Measure> {
        self.measures.iter().find(|measure| measure.what == what)
    }
}

impl Measure {
    /// Whether it is within its bound; NaN is not.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.found <= self.bound
    }

    /// The value as a share of its bound; zero is nothing of any bound.
    #[must_use]
    pub fn share(&self) -> f64 {
        if self.found == 0.0 { 0.0 } else { self.found / self.bound }
    }
}
