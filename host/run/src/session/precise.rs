//! [`Precise`]: the samples of a scene with more digits than doubles have.

use super::opened::Session;
use crate::analysis::{JointPlan, NotPrecise, PreciseMotion};
use crate::pool;
use crate::precise::{DoubleDouble, Ended, Taylor};
use crate::results::ChannelInfo;

/// Order and tolerance of the computation, of a second one that shows how well it is known, and of one that starts elsewhere.
const COMPUTATIONS: [(usize, f64); 3] = [(32, 1e-28), (26, 1e-26), (26, 1e-24)];
/// Products of coefficients that a computation may take: half a minute.
const MOST_PRODUCTS: f64 = 2e9;
/// Steps that it may take at least, and at most.
const STEPS: [f64; 2] = [200.0, 200_000.0];
/// Steps of the whole time, at least: so many places are looked at in vain where something switches for a moment.
const LEAST_STEPS: f64 = 50.0;

/// A scene ready to be computed with more digits; from [`Session::precise`].
pub struct Precise {
    system: PreciseMotion,
    start: Vec<DoubleDouble>,
    t: f64,
    /// Of the samples, s, and in the unit of the table.
    times: [Vec<f64>; 2],
    /// Factor of the unit of each output; [`ChannelInfo`] has more of it.
    channels: Vec<ChannelInfo>,
    longest: f64,
}

/// The samples of a scene with more digits than doubles have, as far as they go.
pub struct PreciseSamples {
    /// Times of the samples, scene units.
    pub times: Vec<f64>,
    /// Samples of each output, scene units.
    pub columns: Vec<Vec<DoubleDouble>>,
    /// By output and sample: the difference of a second computation with shorter series.
    pub doubts: Vec<Vec<f64>>,
    /// The same of one whose start is off by as much as doubles round it.
    pub starts: Vec<Vec<f64>>,
    /// How it was computed, in words.
    pub how: String,
    /// Why it ended early, if it did.
    pub ended: Option<Ended>,
}

impl Session {
    /// The same scene, to be computed by power series in numbers of twice the digits. To be asked for before [`Session::run`].
    ///
    /// # Errors
    /// Why that cannot be, in words.
    pub fn precise(&self) -> Result<Precise, String> {
        let refused = |reason: NotPrecise| reason.to_string();
        let none = || refused(NotPrecise::Coordinates);
        let tree = JointPlan::tree(&self.equations, &self.model, &self.assembly).ok_or_else(none)?;
        if !self.equations.graph.calls.is_empty() {
            return Err(refused(NotPrecise::Opaque));
        }
        let plan = self.joint_plan(tree, self.folding()).map_err(|error| error.to_string())?.ok_or_else(none)?;
        let mut equations = self.equations.clone();
        let order = COMPUTATIONS[0].0;
        let layout = &self.plan.layout;
        let mut system =
            PreciseMotion::new(&mut equations, &self.model, layout, &plan, &self.assembly, order).map_err(refused)?;
        let start = system.start(&self.model, &plan, &self.assembly);
        let times = self.sample_times();
        let duration = self.scene.simulation.t_end - self.begins.time;
        let longest = duration / LEAST_STEPS;
        Ok(Precise {
            system,
            start,
            t: self.begins.time,
            times: [times.iter().map(|time| time.si).collect(), times.iter().map(|time| time.scene).collect()],
            channels: self.no_samplings().channels,
            longest: self.scene.simulation.max_step.map_or(longest, |step| step.min(longest)),
        })
    }
}

impl Precise {
    /// Computes the samples, for as long as `go_on` says, which is asked before each step.
    #[must_use]
    pub fn solve(self, go_on: &(dyn Fn() -> bool + Sync)) -> PreciseSamples {
        let starts = [self.start.clone(), self.start.clone(), self.system.rounded(&self.start)];
        let jobs: Vec<_> = COMPUTATIONS.into_iter().zip(starts).collect();
        let solve = |((order, tolerance), start)| self.one(order, tolerance, start, go_on);
        let mut found = pool::each(jobs, 0, solve);
        let rows = found.iter().map(|(columns, _)| columns.first().map_or(0, Vec::len)).min().unwrap_or(0);
        found.iter_mut().flat_map(|(columns, _)| columns).for_each(|column| column.truncate(rows));
        let ended = found.iter().filter_map(|(_, ended)| ended.clone()).min_by(|a, b| a.t.total_cmp(&b.t));
        let apart = |other: usize| -> Vec<Vec<f64>> {
            let columns = found[0].0.iter().zip(&found[other].0);
            let apart = |(a, b): (&Vec<DoubleDouble>, &Vec<DoubleDouble>)| {
                a.iter().zip(b).map(|(a, b)| (*a - *b).abs().to_f64()).collect()
            };
            columns.map(apart).collect()
        };
        let (doubts, starts) = (apart(1), apart(2));
        let times = self.times[1][..rows.min(self.times[1].len())].to_vec();
        let [(order, _), (lower, _), _] = COMPUTATIONS;
        let how = format!("power series of order {order} and {lower} in numbers of 31 digits");
        PreciseSamples { times, columns: found.swap_remove(0).0, doubts, starts, how, ended }
    }

    /// The samples of one computation, and why it ended early.
    fn one(
        &self,
        order: usize,
        tolerance: f64,
        start: Vec<DoubleDouble>,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> (Vec<Vec<DoubleDouble>>, Option<Ended>) {
        let products = self.system.operations().max(1) as f64 * (order * order) as f64 / 2.0;
        let most_steps = (MOST_PRODUCTS / products).clamp(STEPS[0], STEPS[1]) as usize;
        let method = Taylor { order, tolerance, longest: self.longest, most_steps };
        let mut system = self.system.at_order(order);
        let mut columns = vec![Vec::with_capacity(self.times[0].len()); self.channels.len()];
        let ended = method.solve(
            &mut system,
            self.t,
            start,
            &self.times[0],
            |system, sampled| {
                let values = system.read(sampled.t, sampled.since, sampled.state);
                for ((column, channel), value) in columns.iter_mut().zip(&self.channels).zip(values) {
                    column.push(value / DoubleDouble::from(channel.factor));
                }
            },
            |_| go_on(),
        );
        (columns, ended.err())
    }
}
