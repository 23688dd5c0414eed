//! [`Trial`]: what steps of a fixed size are good for, found by steps of half the size.

use crate::machine::Machine;
use crate::steps::Sizes;
use crate::twin::{Failed, Twin};

/// A run by steps of a fixed size beside one by twice as many, from the start, with inputs as they are there.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Steps that were made.
    pub steps: usize,
    /// The largest difference of the states, as a share of the sizes of what moves.
    pub off: f64,
    /// Where a step failed: the time, s, and why.
    pub failed: Option<(f64, Failed)>,
}

impl Trial {
    /// Share of the sizes beyond which results are not to be relied on.
    pub const MOST: f64 = 1e-2;

    /// Whether steps of this size do.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.failed.is_none() && self.off <= Self::MOST
    }
}

impl Machine {
    /// Tries so many steps, at most to the end of the scene.
    #[must_use]
    pub fn tried(&self, most: usize) -> Trial {
        let h = self.step;
        let steps = (((self.t_end - self.t_start) / h).round().max(1.0) as usize).min(most);
        let mut sizes = Sizes::of(self);
        let (mut coarse, mut fine) = (Twin::new(self.clone()), Twin::new(self.clone()));
        let mut differences = vec![0.0_f64; self.dim()];
        for step in 0..steps {
            let made = coarse.step(h).and_then(|()| fine.step(0.5 * h)).and_then(|()| fine.step(0.5 * h));
            if let Err(failed) = made {
                return Trial { steps: step, off: worst(&differences, &sizes), failed: Some((fine.time(), failed)) };
            }
            let states = coarse.state().iter().zip(fine.state());
            differences.iter_mut().zip(states).for_each(|(most, (a, b))| *most = most.max((a - b).abs()));
            sizes.grow(fine.state());
        }
        Trial { steps, off: worst(&differences, &sizes), failed: None }
    }
}

fn worst(differences: &[f64], sizes: &Sizes) -> f64 {
    let shares = differences.iter().zip(&sizes.of);
    let shares = shares.filter_map(|(difference, size)| Some(difference / sizes.least[(*size)?]));
    shares.fold(0.0, f64::max)
}
