//! Times, counted: a histogram of whole microseconds with the largest and the sum. Adding costs the same every time.

use serde::Serialize;
use serde::ser::{SerializeStruct as _, Serializer};

/// Microseconds that are distinguished; longer ones are counted together.
const BINS: usize = 20_000;

/// See the module documentation.
#[derive(Debug, Clone)]
pub(super) struct Times {
    bins: Vec<u64>,
    count: u64,
    sum: f64,
    worst: f64,
}

impl Times {
    pub(super) fn new() -> Self {
        Self { bins: vec![0; BINS + 1], count: 0, sum: 0.0, worst: 0.0 }
    }

    /// One more, s. What is negative counts as zero.
    pub(super) fn add(&mut self, seconds: f64) {
        let us = (seconds * 1e6).max(0.0);
        self.bins[(us as usize).min(BINS)] += 1;
        self.count += 1;
        self.sum += us;
        self.worst = self.worst.max(us);
    }

    /// The time that this share of all does not exceed, us, rounded up to whole ones; beyond the bins the largest.
    pub(super) fn percentile(&self, share: f64) -> f64 {
        let rank = (share * self.count as f64).ceil() as u64;
        let mut so_far = 0;
        for (bin, count) in self.bins.iter().enumerate() {
            so_far += count;
            if so_far >= rank && *count > 0 {
                return if bin == BINS { self.worst } else { ((bin + 1) as f64).min(self.worst) };
            }
        }
        self.worst
    }

    /// us
    pub(super) fn mean(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum / self.count as f64 }
    }

    /// us
    pub(super) fn worst(&self) -> f64 {
        self.worst
    }

    /// How many are in each decade: up to 10 us, 100 us, and so on.
    fn decades(&self) -> [(&'static str, u64); 5] {
        let sum = |from: usize, to: usize| self.bins[from.min(BINS)..to.min(BINS)].iter().sum();
        [
            ("below_10_us", sum(0, 10)),
            ("below_100_us", sum(10, 100)),
            ("below_1_ms", sum(100, 1000)),
            ("below_10_ms", sum(1000, 10_000)),
            ("longer", sum(10_000, BINS) + self.bins[BINS]),
        ]
    }

    /// In one line.
    pub(super) fn words(&self) -> String {
        let p = |share| self.percentile(share);
        format!(
            "mean {:.1} us, half below {:.0} us, 99 % below {:.0} us, 99.9 % below {:.0} us, worst {:.1} us",
            self.mean(),
            p(0.5),
            p(0.99),
            p(0.999),
            self.worst()
        )
    }
}

impl Serialize for Times {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("Times", 7)?;
        fields.serialize_field("count", &self.count)?;
        fields.serialize_field("mean_us", &self.mean())?;
        fields.serialize_field("p50_us", &self.percentile(0.5))?;
        fields.serialize_field("p99_us", &self.percentile(0.99))?;
        fields.serialize_field("p999_us", &self.percentile(0.999))?;
        fields.serialize_field("worst_us", &self.worst())?;
        let decades: std::collections::BTreeMap<&str, u64> = self.decades().into_iter().collect();
        fields.serialize_field("histogram", &decades)?;
        fields.end()
    }
}
