//! [`Floor`]: what of the states of elements is round-off, and what of velocities: of a scene at rest, of one that time determines, and of
//! one that moves by little where positions are large.
//!
//! The rate of a state is known to round-off of the sum F of the magnitudes of its terms. No step of size h makes the state better
//! known than to `ROUND_OFF F h`, or to `ROUND_OFF F / w` where it forgets at the pace w what was longer ago. A state that is less
//! than this follows what is zero but for round-off, and there is nothing to resolve in it. An internal unknown is found at every
//! instant, to round-off of the terms of its conditions whatever the step.

use crate::analysis::{AnalysisError, Evaluator, Formulation, Group, Scales};
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Equations, RateSizes, sizes_of_drives, sizes_of_forces};
use odyn_numerics::draw::SplitMix64;

/// Errors of rates, as a share of what these are made of, that count as round-off: 45 times that of one operation. A hundred times as
/// much would show in true states at the tightest tolerances.
const ROUND_OFF: f64 = 1e-14;
/// Rounds, at most, in which states that follow other states take over what is round-off in those.
const ROUNDS: usize = 8;
/// Times, after the start, at which loads on what rests are looked at.
const TIMES: usize = 7;
/// Weights of a fourth difference.
const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Distance of the places that it is made of, as a share of the largest position, or in radians: thousands of units in the last place.
const LINE: f64 = 1e-12;
/// Errors of steps this many times what the noise of accelerations makes of velocities are round-off: error estimates add up several rates,
/// and steps get shorter until the estimate is well below what is allowed.
const NOISE: f64 = 64.0;
/// Shares of the largest position, in the whole time of a run, that motions go by which are small beside its round-off.
const LITTLE: f64 = 1e-4;
/// Steps whose floor is asked for, among which noise of states is measured once: it costs little more than one of them.
const LOOKS: usize = 64;
/// Differences along one line, and what of the noise that was known remains when it is measured again.
const WINDOWS: usize = 4;
const FADES: f64 = 0.5;
/// Growth in a round from which on there is another.
const GROWTH: f64 = 1.1;

/// See the module documentation.
pub(super) struct Floor {
    /// [`RateSizes`]; none where there are no states.
    evaluator: Option<Evaluator>,
    /// Whether accelerations or multipliers must be known for it.
    needs_dynamics: bool,
    layout: Layout,
    /// Beginning and size of the step under way.
    t: f64,
    y: Vec<f64>,
    h: f64,
    /// Round-off of accelerations, m/s^2, and of angular ones, rad/s^2, where the run starts at rest.
    at_rest: [f64; 2],
    /// Round-off of velocities, m/s, and of angular ones, rad/s, that functions of time give.
    driven: [f64; 2],
    /// Noise of accelerations, m/s^2, and of angular ones, rad/s^2, at the start ([`Floor::measure`]).
    noise: [f64; 2],
    /// A unit in the last place of positions, m, and of angles, rad.
    unit: [f64; 2],
    /// Up to which speed, m/s, these count.
    slow: f64,
    /// Noise of the rates of states ([`Floor::measure_states`]), and how often it was asked for.
    of_rates: Vec<f64>,
    looks: usize,
    /// What no error in it has to be below, per state, where that was asked for.
    errors: Vec<f64>,
    is_known: bool,
    inputs: Vec<f64>,
}

impl Floor {
    pub(super) fn new(equations: &Equations, model: &Model, layout: &Layout) -> Self {
        let evaluator = (layout.states > 0).then(|| {
            let RateSizes { graph, nodes } = RateSizes::new(equations, model, layout);
            Evaluator::new(&graph, &nodes)
        });
        let solved = layout.acceleration_slot()..layout.inputs();
        Self {
            needs_dynamics: evaluator.as_ref().is_some_and(|evaluator| evaluator.program().uses_inputs(solved)),
            evaluator,
            layout: layout.clone(),
            t: 0.0,
            y: Vec::new(),
            h: 0.0,
            at_rest: [0.0; 2],
            driven: [0.0; 2],
            noise: [0.0; 2],
            unit: [0.0; 2],
            slow: 0.0,
            of_rates: vec![0.0; layout.states],
            looks: 0,
            errors: vec![0.0; layout.states],
            is_known: true,
            inputs: Vec::with_capacity(RateSizes::inputs(layout)),
        }
    }

    /// A step begins.
    pub(super) fn begin_step(&mut self, t: f64, y: &[f64], h: f64) {
        self.h = h;
        if self.evaluator.is_none() {
            return;
        }
        (self.t, self.is_known) = (t, false);
        self.y.clear();
        self.y.extend_from_slice(y);
    }

    /// What the error of a state in the step under way does not have to be below; zero where no step is under way. Nothing of the
    /// question shows in what follows.
    pub(super) fn of(&mut self, state: usize, formulation: &mut dyn Formulation, scales: &Scales) -> f64 {
        if !self.is_known {
            self.is_known = true;
            let traces = formulation.traces();
            if self.find(formulation, scales).is_err() {
                // Whatever it is, the step will fail of it, too.
                self.errors.fill(0.0);
            }
            formulation.forget_since(&traces);
        }
        self.errors[state]
    }

    /// The largest force on a body at rest, N, from the time `t` on for `duration`, in a scene of the size `length`; torques count by
    /// the length.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn largest_load(
        &self,
        equations: &Equations,
        model: &Model,
        (t, y): (f64, &[f64]),
        (duration, length): (f64, f64),
        formulation: &mut dyn Formulation,
    ) -> Result<f64, AnalysisError> {
        let (graph, loads) = sizes_of_forces(equations, model, &self.layout);
        let mut evaluator = Evaluator::new(&graph, &loads);
        let mut largest = |t: f64, formulation: &mut dyn Formulation| -> Result<f64, AnalysisError> {
            let inputs = formulation.observe(t, y, true)?.inputs[..self.layout.inputs()].to_vec();
            let (forces, torques) = evaluator.run(&inputs, formulation.sets())?.split_at(self.layout.bodies);
            let torques = torques.iter().map(|torque| torque / length);
            Ok(forces.iter().copied().chain(torques).filter(|load| load.is_finite()).fold(0.0, f64::max))
        };
        let mut load = largest(t, formulation)?;
        // Loads over time may begin with zero. Where there is no answer, the run will fail or be elsewhere.
        for k in 1..=TIMES {
            let later = t + duration * k as f64 / TIMES as f64;
            load = load.max(largest(later, formulation).unwrap_or(0.0));
        }
        Ok(load)
    }

    /// How far accelerations, m/s^2, and angular ones, rad/s^2, are off at a state where its positions are off by round-off: what is
    /// stiff makes much of that, however small the forces are that it holds. Nothing of the question shows in what follows.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn shaken(
        &self,
        (t, y): (f64, &[f64]),
        formulation: &mut dyn Formulation,
    ) -> Result<[f64; 2], AnalysisError> {
        let groups = formulation.groups().to_vec();
        let (mut still, mut rates, mut moved) = (vec![0.0; y.len()], vec![0.0; y.len()], y.to_vec());
        formulation.rates(t, y, &mut still)?;
        let (mut draw, mut most) = (SplitMix64::new(1), [0.0_f64; 2]);
        for _ in 0..TIMES {
            for ((moved, y), group) in moved.iter_mut().zip(y).zip(&groups) {
                if matches!(group, Group::Position | Group::Parameter) {
                    *moved = y * (1.0 + ROUND_OFF * draw.either_way());
                }
            }
            formulation.rates(t, &moved, &mut rates)?;
            for ((rate, still), group) in rates.iter().zip(&still).zip(&groups) {
                match group {
                    Group::Velocity => most[0] = most[0].max((rate - still).abs()),
                    Group::AngularVelocity => most[1] = most[1].max((rate - still).abs()),
                    _ => {}
                }
            }
        }
        Ok(most.map(|rate| if rate.is_finite() { rate } else { 0.0 }))
    }

    /// Measures the noise of accelerations at the start, `far` from the origin, m: what fourth differences of them are along a short line
    /// of positions, of which nothing that is smooth is left (Hamming, Numerical Methods for Scientists and Engineers, 2nd ed. 1973, ch. 10;
    /// More & Wild, "Estimating computational noise", SIAM J. Sci. Comput. 33 (2011) 1292). The line begins beside the start, where there
    /// may be a kink. From here on [`Floor::of_speeds`] knows that, as long as the scene moves by little in a `duration`, s: where its speed is
    /// larger already, there is nothing to measure.
    pub(super) fn measure(
        &mut self,
        (t, y): (f64, &[f64]),
        (duration, far, speed): (f64, f64, f64),
        formulation: &mut dyn Formulation,
    ) {
        self.slow = LITTLE * far / duration;
        if speed > self.slow {
            return;
        }
        let groups = formulation.groups().to_vec();
        self.unit = [f64::EPSILON * far, f64::EPSILON];
        let most = |noise: &[f64], of: Group| {
            let own = noise.iter().zip(&groups).filter(|(_, group)| **group == of);
            own.fold(0.0_f64, |most, (noise, _)| most.max(*noise))
        };
        let kinds = |noise: &[f64]| [Group::Velocity, Group::AngularVelocity].map(|of| most(noise, of));
        // Where there is no answer, the first step will fail, too.
        let found = noise_beside((t, y), far, (1, 1), formulation).map(|sides| sides.map(|noise| kinds(&noise)));
        let found = found.filter(|sides| sides.iter().flatten().all(|noise| noise.is_finite()));
        self.noise = found.map_or([0.0; 2], |[a, b]| [0, 1].map(|k| a[k].min(b[k])));
    }

    /// At rest accelerations are round-off of the forces that cancel in them, of this size, N, and of positions ([`Floor::shaken`]). From
    /// here on [`Floor::of_speeds`] knows that.
    pub(super) fn balance(&mut self, load: f64, shaken: [f64; 2], model: &Model) {
        // Not by the mass of each: what holds a light body moves it with its neighbours.
        let mass: f64 = model.bodies.iter().map(|body| body.mass).sum();
        let turning = model.bodies.iter().filter(|body| !body.particle && body.thin.is_empty());
        let radius = turning.map(|body| (body.inertia.trace() / body.mass).sqrt()).fold(f64::INFINITY, f64::min);
        let size = load / mass;
        let cancelling = [size, size / radius].map(|size| if size.is_finite() { ROUND_OFF * size } else { 0.0 });
        self.at_rest = [0, 1].map(|k| cancelling[k].max(shaken[k]));
    }

    /// The velocities that drivers give are round-off of the terms that cancel in the rates of their functions: in that of `t - sin(t)`
    /// a step of 1.1e-16, however slow the motion begins. Looked at from the time `t` on for `duration`, with all bodies where they
    /// are at the start, in a scene of the size `length`. From here on [`Floor::of_speeds`] knows that. Where there is no answer, the run
    /// will fail or be elsewhere.
    pub(super) fn drive(
        &mut self,
        equations: &Equations,
        (t, y): (f64, &[f64]),
        (duration, length): (f64, f64),
        formulation: &mut dyn Formulation,
    ) {
        let (graph, nodes) = sizes_of_drives(equations);
        let mut evaluator = Evaluator::new(&graph, &nodes);
        let traces = formulation.traces();
        for k in 0..=TIMES {
            let time = t + duration * k as f64 / TIMES as f64;
            let observed = formulation.observe(time, y, false);
            let Ok(inputs) = observed.map(|observed| observed.inputs[..self.layout.inputs()].to_vec()) else {
                continue;
            };
            let Ok(sizes) = evaluator.run(&inputs, formulation.sets()) else { continue };
            for row in sizes.chunks_exact(3) {
                let (rate, displaced, turned) = (row[0], row[1], row[2]);
                let [speed, spin] = if displaced > 0.0 {
                    [rate / displaced, rate / displaced / length]
                } else {
                    [length * rate / turned, rate / turned]
                };
                for (known, size) in self.driven.iter_mut().zip([speed, spin]) {
                    *known = known.max(if size.is_finite() { ROUND_OFF * size } else { 0.0 });
                }
            }
        }
        formulation.forget_since(&traces);
    }

    /// What no error of a velocity, m/s, and of an angular one, rad/s, has to be below in the step under way, where the largest speed is
    /// this.
    pub(super) fn of_speeds(&self, speed: f64) -> [f64; 2] {
        let of = |k: usize| self.driven[k].max(self.at_rest[k] * self.h);
        if speed > self.slow {
            return [0, 1].map(of);
        }
        // What is so stiff that it swings within the step comes back to where it should be, to a unit of its position.
        let noise = |k: usize| NOISE * (self.noise[k] * self.h).min(self.unit[k] / self.h.max(f64::MIN_POSITIVE));
        [0, 1].map(|k| of(k).max(noise(k)))
    }

    /// What was found of the noise of states is no part of what is saved of a run: from here on it is found again.
    pub(super) fn forget_states(&mut self) {
        self.of_rates.fill(0.0);
        self.looks = 0;
    }

    /// Noise of the rates of states where the step under way begins, as [`Floor::measure`] finds that of accelerations: a sum of terms that
    /// cancel in an acceleration does not show in those of the states that follow it. What is stiff in one direction has a noise of few
    /// steps, and differences of these are often zero: there are several, along another line each time, and what was found before fades.
    fn measure_states(&mut self, far: f64, formulation: &mut dyn Formulation) {
        let first = self.y.len() - 1 - self.layout.states;
        let seed = 1 + (self.looks / LOOKS) as u64;
        let found = noise_beside((self.t, &self.y), far, (seed, WINDOWS), formulation);
        for (k, noise) in self.of_rates.iter_mut().enumerate() {
            let sides = found.as_ref().map_or(0.0, |[a, b]| a[first + k].min(b[first + k]));
            *noise = if sides.is_finite() { sides.max(FADES * *noise) } else { 0.0 };
        }
    }

    fn find(&mut self, formulation: &mut dyn Formulation, scales: &Scales) -> Result<(), AnalysisError> {
        if self.evaluator.is_none() {
            return Ok(());
        }
        if self.looks.is_multiple_of(LOOKS) {
            self.measure_states(scales.far, formulation);
        }
        self.looks += 1;
        let Some(evaluator) = &mut self.evaluator else { return Ok(()) };
        let observed = formulation.observe(self.t, &self.y, self.needs_dynamics)?;
        self.inputs.clear();
        self.inputs.extend_from_slice(&observed.inputs[..self.layout.inputs()]);
        let first = self.layout.state_slot();
        self.inputs.extend_from_within(first..first + self.layout.states);
        self.inputs.extend([scales.length, scales.speed_scale(), scales.spin_scale()]);
        let given = self.layout.inputs();
        self.inputs[given..given + self.layout.states].iter_mut().for_each(|state| *state = state.abs());
        for _ in 0..ROUNDS {
            let found = evaluator.run(&self.inputs, formulation.sets())?;
            let (sizes, rest) = found.split_at(self.layout.states);
            let (paces, values) = rest.split_at(self.layout.states);
            let mut grows = false;
            for (k, ((size, pace), value)) in sizes.iter().zip(paces).zip(values).enumerate() {
                // Where nothing is deformed, what a rotation is made of may be no number.
                let [size, value] = [*size, *value].map(|size| if size.is_finite() { size } else { 0.0 });
                let pace = if pace.is_nan() { 0.0 } else { *pace };
                // An unknown does not follow its rate.
                let noise = if value > 0.0 { 0.0 } else { NOISE / ROUND_OFF * self.of_rates[k] };
                let made = (size + noise) * self.h / (1.0 + pace * self.h);
                self.errors[k] = ROUND_OFF * (made + value);
                let state = &mut self.inputs[given + k];
                grows |= made > GROWTH * *state;
                *state = state.max(made);
                // An unknown is somewhere within its error, and others that depend on it have slopes of there: near zero q^2 has none.
                let unknown = &mut self.inputs[first + k];
                if value > 0.0 && unknown.abs() < self.errors[k] {
                    *unknown = self.errors[k];
                    grows = true;
                }
            }
            if !grows {
                break;
            }
        }
        Ok(())
    }
}

/// What fourth differences of rates are at most along a short line of positions, on both sides of a state, `far` from the origin, m: see
/// [`Floor::measure`]. As many differences as `windows`, which overlap, along a line that `seed` draws.
fn noise_beside(
    (t, y): (f64, &[f64]),
    far: f64,
    (seed, windows): (u64, usize),
    formulation: &mut dyn Formulation,
) -> Option<[Vec<f64>; 2]> {
    let mut draw = SplitMix64::new(seed);
    let line: Vec<f64> = formulation
        .groups()
        .iter()
        .map(|group| match group {
            Group::Position => LINE * far * draw.either_way(),
            Group::Parameter => LINE * draw.either_way(),
            _ => 0.0,
        })
        .collect();
    let mut along = |way: f64| -> Option<Vec<f64>> {
        let (mut rates, mut differences) = (vec![0.0; y.len()], vec![vec![0.0; y.len()]; windows]);
        for place in 0..FOURTH.len() + windows - 1 {
            let share = way * (place + 1) as f64;
            let moved: Vec<f64> = y.iter().zip(&line).map(|(y, along)| y + share * along).collect();
            formulation.rates(t, &moved, &mut rates).ok()?;
            for (window, differences) in differences.iter_mut().enumerate() {
                let Some(weight) = place.checked_sub(window).and_then(|k| FOURTH.get(k)) else { continue };
                differences.iter_mut().zip(&rates).for_each(|(sum, rate)| *sum += weight * rate);
            }
        }
        let most = |k: usize| differences.iter().fold(0.0_f64, |most, own| most.max(own[k].abs()));
        Some((0..y.len()).map(most).collect())
    };
    Some([along(1.0)?, along(-1.0)?])
}
