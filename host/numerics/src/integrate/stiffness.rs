//! [`Stiffness`]: whether stability, not accuracy, limits the steps of an explicit method.

/// Steps near the border of stability that make a problem stiff.
const HITS: u32 = 15;
/// Steps well inside, one after the other, that make it forget them.
const MISSES: u32 = 6;

/// Counts steps near the border of stability (Hairer & Wanner, "Solving Ordinary Differential Equations II", 2nd ed. 1996,
/// section IV.2, programs DOPRI5 and DOP853; there only now and then, here at every step).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stiffness {
    hits: u32,
    misses: u32,
}

impl Stiffness {
    /// Takes a step whose error is small enough, and whether it is near the border.
    pub(super) fn see(&mut self, near_border: bool) {
        if near_border {
            self.misses = 0;
            self.hits += 1;
            return;
        }
        self.misses += 1;
        if self.misses >= MISSES {
            self.hits = 0;
        }
    }

    /// Whether the problem is stiff.
    pub(super) fn is_found(&self) -> bool {
        self.hits >= HITS
    }
}
