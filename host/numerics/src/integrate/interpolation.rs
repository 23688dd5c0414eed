//! [`Interpolation`]: the states inside a step, as what looks into it sees them.

/// The interpolation of a step.
pub(super) struct Interpolation<'a> {
    /// Start, size and end of the step.
    pub(super) start: f64,
    pub(super) h: f64,
    pub(super) end: f64,
    /// Its degree.
    pub(super) degree: usize,
    /// The state at a share of the step.
    pub(super) at: &'a dyn Fn(f64, &mut [f64]),
    /// The shares of the step at which the method has felt the equations, as [`super::steps::Stepper::seen`].
    pub(super) seen: &'a [f64],
    /// The states at which it did, by number. The interpolation may be elsewhere there where it was taken in by something that the
    /// method has not felt.
    pub(super) felt: &'a dyn Fn(usize, &mut [f64]),
}

impl Interpolation<'_> {
    /// The time at a share of the step. Functions of time may jump behind its end, which round-off of the sum must not reach.
    pub(super) fn time(&self, share: f64) -> f64 {
        if share == 1.0 { self.end } else { (self.start + share * self.h).min(self.end) }
    }
}

/// Cubic that has the values and derivatives of both ends of a step of size `h`, at the share `s` of it, also outside.
pub(super) fn hermite(s: f64, h: f64, y: [&[f64]; 2], f: [&[f64]; 2], out: &mut [f64]) {
    let ends = y[0].iter().zip(y[1]).zip(f[0].iter().zip(f[1]));
    for (value, ((start, end), (start_rate, end_rate))) in out.iter_mut().zip(ends) {
        let rise = end - start;
        let start_bend = h * start_rate - rise;
        let end_bend = rise - h * end_rate;
        let bend = (1.0 - s) * start_bend + s * end_bend;
        *value = start + s * (rise + (1.0 - s) * bend);
    }
}
