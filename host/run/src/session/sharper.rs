//! The same run once more, by another method and with other steps, to see how far off the first is.

use std::time::Instant;

use super::error::SessionError;
use super::opened::Session;
use super::options::DEFAULT_METHOD;
use super::outcome::RunReport;
use crate::diagnostics::codes;
use crate::model::{Channel, Quantity};
use crate::results::{Samples, Verified, significant};
use crate::scene::{Dimension, OutputTimes, Scene, Spanned};

/// Ratio of the tolerances.
const SHARPER: f64 = 10.0;
/// The same where digits are counted; and the smallest tolerance for that.
const MUCH_SHARPER: f64 = 1000.0;
const LEAST_TOLERANCE: f64 = 1e-13;
/// Steps of the second run, at least. Longer ones may pass over what the first passed over.
const LEAST_STEPS: f64 = 200.0;
/// Methods for the second run: the first that is not the one of the first run. Both are fit for every scene, stiff or not.
const OTHER_METHODS: [&str; 2] = ["radau5", "auto"];

/// How a run is compared with a second one; from [`Session::sharper`].
#[derive(Debug, Clone)]
pub struct Sharper {
    /// What is different in the second run.
    how: String,
    sizes: NaturalSizes,
}

/// What is natural for the outputs of a scene; from [`Session::natural_sizes`].
#[derive(Debug, Clone)]
pub struct NaturalSizes {
    /// Dimension of each output, and its unit in SI.
    outputs: Vec<(Dimension, f64)>,
    /// Size of the scene, m.
    length: f64,
    /// Mass of all bodies, kg.
    mass: f64,
}

impl Session {
    /// A session of the same scene for a second run: by another method, at a tenth of the tolerance (or with steps of half the
    /// size where these are fixed), and with steps no longer than those between samples, nor than a two-hundredth of the whole.
    /// To be asked for before [`Session::run`].
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn sharper(&self) -> Result<(Self, Sharper), SessionError> {
        let (session, how) = self.sharper_by(SHARPER, self.scene.clone())?;
        Ok((session, Sharper { how, sizes: self.natural_sizes() }))
    }

    /// The same at a much smaller tolerance, in other coordinates where there are any; and how it differs.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub(super) fn much_sharper(&self) -> Result<(Self, String), SessionError> {
        let ratio = MUCH_SHARPER.min(self.tolerance() / LEAST_TOLERANCE).max(1.0);
        let used = if self.choose_formulation()?.joint.is_some() { "joint" } else { "cartesian" };
        let other = if used == "joint" { "cartesian" } else { "joint" };
        let mut scene = self.scene.clone();
        scene.simulation.formulation = Some(Spanned::new(other.to_owned(), 0..0));
        match self.sharper_by(ratio, scene) {
            Ok((session, how)) => Ok((session, format!("{other} coordinates instead of {used}, {how}"))),
            // There are no others.
            Err(_) => self.sharper_by(ratio, self.scene.clone()),
        }
    }

    /// A session of `scene`, which is this one's but for its coordinates, by another method and at a smaller tolerance.
    fn sharper_by(&self, ratio: f64, mut scene: Scene) -> Result<(Self, String), SessionError> {
        let name = scene.simulation.method.as_ref().map_or(DEFAULT_METHOD, |method| method.value.as_str()).to_owned();
        let needs_step = self.options.methods.make(&name).is_some_and(|method| method.needs_fixed_step());
        let settings = &mut scene.simulation;
        let time = |seconds: f64| {
            let units = &self.scene.units;
            format!("{} {}", significant(seconds / units.factor(Dimension::TIME), 6), units.label(Dimension::TIME))
        };
        // A method without error control takes the longest step it may.
        let fixed = settings.fixed_step.or(settings.max_step.filter(|_| needs_step));
        let steps = match fixed {
            Some(step) => {
                settings.fixed_step = Some(0.5 * step);
                format!("steps of {} instead of {}", time(0.5 * step), time(step))
            }
            None => {
                settings.tolerance = Some(self.tolerance() / ratio);
                let duration = settings.t_end - settings.t_start;
                let between = match &settings.output {
                    OutputTimes::Step(step) => *step,
                    OutputTimes::Times(times) => duration / times.len().max(1) as f64,
                };
                let longest = between.min(duration / LEAST_STEPS).min(settings.max_step.unwrap_or(f64::INFINITY));
                settings.max_step = Some(longest);
                settings.first_step = None;
                let [new, old] = [self.tolerance() / ratio, self.tolerance()].map(|number| significant(number, 3));
                format!("tolerance {new} instead of {old}, steps up to {}", time(longest))
            }
        };
        let known = |other: &&&str| **other != name && self.options.methods.make(other).is_some();
        let method = OTHER_METHODS.iter().find(known).map_or(name.as_str(), |other| *other);
        settings.method = Some(Spanned::new(method.to_owned(), 0..0));
        let how = format!("{method} instead of {}, {steps}", if self.determined { "kinematic" } else { &name });
        let mut sharper = Self::of_scene(scene, Vec::new(), &self.catalog, &self.options, None, Instant::now())?;
        if let Some(state) = &self.begins.state {
            sharper.go_on_from(state.clone())?;
        }
        Ok((sharper, how))
    }

    /// What is natural for the scene's outputs, whatever their values are.
    #[must_use]
    pub fn natural_sizes(&self) -> NaturalSizes {
        let natural = |channel: &Channel| match channel.quantity {
            // Half angles, one of which is of the size of 1.
            Quantity::EulerParameter { .. } => (Dimension::ANGLE, 1.0),
            _ => (channel.dimension, channel.factor),
        };
        NaturalSizes {
            outputs: self.model.channels.iter().map(natural).collect(),
            length: self.assembly.scales.length,
            mass: self.model.bodies.iter().map(|body| body.mass).sum(),
        }
    }
}

impl NaturalSizes {
    /// What is natural for each output, in its unit, in a scene of this size and mass in which so much energy (J) moved:
    /// L^a M^b T^c with T = L / sqrt(2 E / M). An output far smaller than that is made of numbers that large, and its error
    /// is a share of these.
    #[must_use]
    pub fn of(&self, energy: f64) -> Vec<f64> {
        let speed = (2.0 * energy / self.mass).sqrt();
        let size = |dimension: &Dimension| -> f64 {
            let mechanical = dimension.length != 0 || dimension.mass != 0 || dimension.time != 0;
            // Angles are of the size of 1; of plain numbers nothing is known.
            if !mechanical {
                return f64::from(dimension.angle.signum().abs());
            }
            let power = |base: f64, exponent: i8| base.powi(i32::from(exponent));
            let size = power(self.length, dimension.length) * power(self.mass, dimension.mass);
            // Time to the power c is (L / v)^c.
            let size = size * power(self.length, dimension.time) * power(speed, -dimension.time);
            if size.is_finite() { size } else { 0.0 }
        };
        self.outputs.iter().map(|(dimension, factor)| size(dimension) / factor).collect()
    }
}

impl RunReport {
    /// Compares the outputs with those of the second run and notes the differences in the summary. The run becomes suspect where
    /// they are more than its tolerance explains, or where there is nothing to compare with.
    pub fn verify(&mut self, sharper: &Sharper, second: Result<&Self, &SessionError>) {
        let names: Vec<String> = self.channels.iter().map(|channel| channel.name.clone()).collect();
        let own = Samples { times: &self.times, columns: &self.columns, names: &names };
        let (times, columns, problem): (&[f64], &[Vec<f64>], String) = match second {
            Ok(other) if other.summary.status.reached_end() => (&other.times, &other.columns, String::new()),
            Ok(other) => (&other.times, &other.columns, other.summary.reason.clone()),
            Err(error) => {
                let reason = error.diagnostics.first().map_or("it failed", |first| first.message.as_str());
                (&[], &[], reason.into())
            }
        };
        let other = Samples { times, columns, names: &names };
        let limit = self.summary.audit_limits.map(|limits| limits.energy);
        let sizes = sharper.sizes.of(self.summary.audit.largest_energy());
        let verified = Verified::new(sharper.how.clone(), &own, &other, problem, limit, &sizes);
        let unit = &self.summary.time_unit;
        let mut reasons = Vec::new();
        if let (Some(worst), Some(limit)) = (verified.worst_beyond(), limit) {
            let [difference, t, limit] =
                [(worst.absolute, 3), (worst.t, 6), (limit, 2)].map(|(x, n)| significant(x, n));
            let (name, how) = (&worst.name, &verified.how);
            reasons.push(format!(
                "a second run ({how}) differs in `{name}` by {difference} at t = {t} {unit}, more than {limit} of its size: try a \
                 smaller tolerance or smaller steps (`max_step`); if differences stay, the motion may be too sensitive to be \
                 computed that long"
            ));
        }
        if limit.is_some() && !verified.problem.is_empty() {
            let (how, problem) = (&verified.how, &verified.problem);
            reasons.push(format!("it could not be verified: the second run ({how}) ended early: {problem}"));
        }
        self.summary.verified = Some(verified);
        reasons.iter().for_each(|reason| self.summary.suspect(codes::NOT_VERIFIED, reason));
    }
}
