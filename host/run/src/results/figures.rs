//! [`Figure`]: a number derived from sampled channels, for print beside a published one.

use std::ops::Range;

/// Points of the interpolating polynomial: its error falls with the sixth power of the sample step.
const POINTS: usize = 6;

/// Which number of a channel is taken. Samples are taken as they are; only crossings are interpolated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Take {
    /// The value where another channel crosses a value for the last time.
    At(Crossing),
    /// The value of largest magnitude, with its sign; the first of several.
    Peak,
    /// The smallest value.
    Min,
    /// The largest value.
    Max,
    /// The last value.
    Final,
    /// The mean over time, by trapezoids.
    Mean,
    /// The root of the mean square over time, by trapezoids.
    Rms,
}

/// Where a channel passes a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Index of the channel.
    pub channel: usize,
    /// The value, in the channel's unit.
    pub equals: f64,
    /// The value repeats with this period, positive, in the channel's unit.
    pub period: Option<f64>,
}

/// What to compute. Channels by their index among the columns; all numbers in the units of the columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// The channel the number is taken from.
    pub channel: usize,
    /// Which number.
    pub take: Take,
    /// The magnitude of it.
    pub absolute: bool,
    /// Divide by the same number of this channel.
    pub over: Option<usize>,
    /// Earlier samples are left out.
    pub from: Option<f64>,
}

/// The samples of a run, in the units of the columns.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// Times, ascending.
    pub times: &'a [f64],
    /// One column per channel, each at least as long as `times`.
    pub columns: &'a [Vec<f64>],
    /// Names of the channels, for messages.
    pub names: &'a [String],
}

/// Why a figure has no value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FigureError {
    /// No sample is left to take it from.
    #[error("there are no samples{}", from.map_or_else(String::new, |from| format!(" from t = {from}")))]
    NoSamples {
        /// Earlier samples were left out.
        from: Option<f64>,
    },
    /// The crossing does not happen.
    #[error(
        "`{channel}` does not cross {equals}{} between t = {start} and t = {end}",
        period.map_or_else(String::new, |period| format!(" (modulo {period})"))
    )]
    NoCrossing {
        /// The channel that should cross.
        channel: String,
        /// The value.
        equals: f64,
        /// Its period.
        period: Option<f64>,
        /// First time looked at.
        start: f64,
        /// Last time looked at.
        end: f64,
    },
    /// A sample is not a number to compute with.
    #[error("`{channel}` is not finite at t = {time}")]
    NotFinite {
        /// The channel.
        channel: String,
        /// Time of the first such sample.
        time: f64,
    },
    /// The divisor is zero.
    #[error("the same figure of `{channel}` is zero and cannot divide")]
    ZeroDivisor {
        /// The channel that divides.
        channel: String,
    },
}

impl Figure {
    /// The number.
    ///
    /// # Errors
    /// See [`FigureError`].
    ///
    /// # Panics
    /// If a channel is not one of the columns.
    pub fn compute(&self, samples: &Samples<'_>) -> Result<f64, FigureError> {
        let kept = self.kept(samples.times)?;
        let value = self.of_channel(samples, kept.clone(), self.channel)?;
        let Some(over) = self.over else {
            return Ok(value);
        };
        let divisor = self.of_channel(samples, kept, over)?;
        if divisor == 0.0 {
            return Err(FigureError::ZeroDivisor { channel: name(samples, over) });
        }
        Ok(value / divisor)
    }

    /// Samples that are not left out.
    fn kept(&self, times: &[f64]) -> Result<Range<usize>, FigureError> {
        // A start that went through a conversion of units must not lose its own sample to rounding.
        let first = self.from.map_or(0, |from| times.partition_point(|t| *t < from - 1e-12 * from.abs()));
        if first == times.len() {
            return Err(FigureError::NoSamples { from: self.from });
        }
        Ok(first..times.len())
    }

    fn of_channel(&self, samples: &Samples<'_>, kept: Range<usize>, channel: usize) -> Result<f64, FigureError> {
        let times = &samples.times[kept.clone()];
        let values = finite(samples, kept.clone(), channel)?;
        let last = values[values.len() - 1];
        let value = match self.take {
            Take::At(crossing) => {
                let (time, interval) = last_crossing(samples, kept, &crossing)?;
                interpolate(times, values, stencil(interval, times.len()), time)
            }
            Take::Peak => values.iter().fold(0.0_f64, |peak, v| if v.abs() > peak.abs() { *v } else { peak }),
            Take::Min => values.iter().copied().fold(f64::INFINITY, f64::min),
            Take::Max => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            Take::Final => last,
            Take::Mean => mean(times, values, |v| v),
            Take::Rms => mean(times, values, |v| v * v).sqrt(),
        };
        Ok(if self.absolute { value.abs() } else { value })
    }
}

fn name(samples: &Samples<'_>, channel: usize) -> String {
    samples.names.get(channel).cloned().unwrap_or_else(|| format!("channel {channel}"))
}

/// The kept values of a channel, all finite.
fn finite<'a>(samples: &Samples<'a>, kept: Range<usize>, channel: usize) -> Result<&'a [f64], FigureError> {
    let values = &samples.columns[channel][kept.clone()];
    match values.iter().position(|v| !v.is_finite()) {
        Some(k) => Err(FigureError::NotFinite { channel: name(samples, channel), time: samples.times[kept.start + k] }),
        None => Ok(values),
    }
}

/// Mean over time of a function of the values, by trapezoids: the integral over the samples divided by their span.
fn mean(times: &[f64], values: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let span = times[times.len() - 1] - times[0];
    if span <= 0.0 {
        return f(values[values.len() - 1]);
    }
    let areas = times.windows(2).zip(values.windows(2)).map(|(t, v)| 0.5 * (t[1] - t[0]) * (f(v[0]) + f(v[1])));
    areas.sum::<f64>() / span
}

/// Time of the last crossing, and the number of the interval among the kept samples it lies in.
fn last_crossing(samples: &Samples<'_>, kept: Range<usize>, crossing: &Crossing) -> Result<(f64, usize), FigureError> {
    let times = &samples.times[kept.clone()];
    let values = finite(samples, kept, crossing.channel)?;
    for interval in (0..times.len().saturating_sub(1)).rev() {
        if let Some(target) = last_target(values[interval], values[interval + 1], crossing) {
            let stencil = stencil(interval, times.len());
            let miss = |t: f64| interpolate(times, values, stencil.clone(), t) - target;
            return Ok((bisect(times[interval], times[interval + 1], miss), interval));
        }
    }
    // A start on the value counts, unless a later sample does.
    if last_target(values[0], values[0], crossing).is_some() {
        return Ok((times[0], 0));
    }
    Err(FigureError::NoCrossing {
        channel: name(samples, crossing.channel),
        equals: crossing.equals,
        period: crossing.period,
        start: times[0],
        end: times[times.len() - 1],
    })
}

/// Of the values `equals + k period`, the one that is met last on the way from `start` (not counted, unless nothing moves)
/// to `end`.
fn last_target(start: f64, end: f64, crossing: &Crossing) -> Option<f64> {
    let met = |target: &f64| {
        if start == end {
            *target == end
        } else if start < end {
            start < *target && *target <= end
        } else {
            end <= *target && *target < start
        }
    };
    let Some(period) = crossing.period else {
        return Some(crossing.equals).filter(met);
    };
    let (whole, forward) = {
        let turns = (end - crossing.equals) / period;
        if start <= end { (turns.floor(), 1.0) } else { (turns.ceil(), -1.0) }
    };
    // One more and one less, since `turns` may be rounded to either side of a whole number.
    [forward, 0.0, -forward].into_iter().map(|k| crossing.equals + (whole + k) * period).find(met)
}

/// The samples around an interval that the interpolation uses: as many on both sides where there are.
fn stencil(interval: usize, samples: usize) -> Range<usize> {
    let points = POINTS.min(samples);
    let first = (interval + 1).saturating_sub(points / 2).min(samples - points);
    first..first + points
}

/// Lagrange's interpolation in time: `sum_i v_i prod_(j != i) (t - t_j) / (t_i - t_j)`.
fn interpolate(times: &[f64], values: &[f64], stencil: Range<usize>, t: f64) -> f64 {
    let (times, values) = (&times[stencil.clone()], &values[stencil]);
    // Exact at the samples.
    if let Some(k) = times.iter().position(|own| *own == t) {
        return values[k];
    }
    let mut sum = 0.0;
    for (i, value) in values.iter().enumerate() {
        let others = times.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| *other);
        sum += value * others.map(|other| (t - other) / (times[i] - other)).product::<f64>();
    }
    sum
}

/// The root of a function that changes sign between `a` and `b`, to the last bit.
fn bisect(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    if f(b) == 0.0 {
        return b;
    }
    let negative = f(a) < 0.0;
    loop {
        let middle = a + 0.5 * (b - a);
        if middle <= a || middle >= b {
            return b;
        }
        let value = f(middle);
        if value == 0.0 {
            return middle;
        }
        if (value < 0.0) == negative {
            a = middle;
        } else {
            b = middle;
        }
    }
}
