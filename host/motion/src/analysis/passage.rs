//! [`Passage`]: through positions where the constraints lose rank.
//!
//! Along a branch of the constraints positions, velocities and accelerations are smooth through such a position. It is
//! solving for them there that is ill-conditioned: at a distance `d` round-off reaches the positions divided by `d`, the
//! velocities by `d^2`, the accelerations by `d^3`, and a state off the constraints by `e` is accelerated by `e / d`. So
//! nothing is solved there. What is asked for is asked for at places on both sides, along the velocity,
//! `(t + s, q + s q', v)`, brought to the constraints, and the polynomial through the answers is evaluated at `s = 0`.
//!
//! The places are Chebyshev points of the two intervals `1 <= |s - c| / g <= 4`, where `c` is the singular position and `g`
//! the distance at which solving is sound (the image of Chebyshev points in `(s - c)^2`). With `r` the distance of the next
//! singularity in the complex plane, in units of `g`, the error is about `1.1e5 / r^14`; round-off at the places reaches the
//! result 16 times. Loads are interpolated with the rest: one that switches on this stretch is smoothed.
//!
//! Links whose lengths miss those of a mechanism with a singular position by little do not pass: the branches, which would cross,
//! turn away from each other. The polynomial then misses the constraints in the middle by as much ([`Way::Round`]); what is asked
//! for is solved for, and error control resolves the turn.

use super::formulation::AnalysisError;
use super::motion::{Engines, NEAR_SINGULAR, Used};
use super::newton::project_plainly;
use crate::linalg::Health;

/// Places on each side.
const PLACES: usize = 7;
/// The outermost place lies about this many times as far away as the innermost one.
const OUTERMOST: f64 = 4.0;
/// Pivot ratio at the innermost places, as a share of that at the start of the scene.
const SOUND: f64 = 0.042;
/// First distance at which the pivot ratio is looked at: a change of positions, in radians or lengths of the scene.
const FIRST_LOOK: f64 = 0.05;
/// Looks, each twice as far away, before the singular position counts as not passed over by the velocity.
const MOST_LOOKS: usize = 6;

/// Violation of the constraints, as a share of the scene's size, from which on what was interpolated is as good as it gets; and
/// the largest that is accepted after [`MOST_PROJECTIONS`].
const MET: f64 = 1e-14;
const MOST_MISSED: f64 = 1e-9;
const MOST_PROJECTIONS: usize = 2;
/// The largest violation, as a share of the scene's size, in the middle between the places of what leads through. Round-off and the
/// error of the polynomial are less: if not at first, then over this share of the gap.
const MOST_CROSSED: f64 = 1e-12;
const CLOSER: f64 = 0.5;
/// Pivot ratio, as a share of that at the start of the scene, below which a motion that cannot lead on in time ends.
const LOST: f64 = 1e-3;
/// Share of the blame of the first below which drives are not named, and how many are.
const LEAST_BLAMED: f64 = 0.1;
const MOST_BLAMED: usize = 4;

/// What a polynomial is put through a singular position of.
pub(super) trait Passing {
    /// Largest rate of the positions, in radians or lengths of the scene, 1/s.
    fn fastest(&self, state: &[f64]) -> f64;
    /// `moved := (q + s q', v)`
    fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]);
    /// Pivot ratio of the constraints at a state, as a share of that at the start of the scene.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn share(&mut self, t: f64, state: &[f64]) -> Result<f64, AnalysisError>;
    /// Largest violation of the constraints at a state whose Euler parameters it normalises, as a share of the scene's size.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn missed(&mut self, t: f64, state: &mut [f64]) -> Result<f64, AnalysisError>;
    /// Joints and rows that depend on time at a state, most to blame first for what cannot be met next to it; empty where there are
    /// none.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn drives(&mut self, t: f64, state: &[f64]) -> Result<String, AnalysisError>;
}

impl<F: Engines> Passing for F {
    fn fastest(&self, state: &[f64]) -> f64 {
        self.motion().fastest(state)
    }

    fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]) {
        self.motion().shift(state, s, moved);
    }

    fn share(&mut self, t: f64, state: &[f64]) -> Result<f64, AnalysisError> {
        self.motion_mut().load(t, state);
        let Health { rank, smallest_pivot_ratio } = self.factor_safely(false)?;
        let at_start = self.motion().at_start;
        Ok(if rank < at_start.rank { 0.0 } else { smallest_pivot_ratio / at_start.smallest_pivot_ratio })
    }

    fn missed(&mut self, t: f64, state: &mut [f64]) -> Result<f64, AnalysisError> {
        self.motion().normalise(state);
        self.motion_mut().load(t, state);
        Ok(self.worst_violation()?.0 / self.motion().length)
    }

    fn drives(&mut self, t: f64, state: &[f64]) -> Result<String, AnalysisError> {
        self.motion_mut().load(t, state);
        let mut rows = self.asked_by_time()?;
        rows.sort_by(|a, b| b.1.total_cmp(&a.1));
        let least = LEAST_BLAMED * rows.first().map_or(0.0, |row| row.1);
        let names = rows.iter().filter(|(_, share)| *share >= least).take(MOST_BLAMED);
        let names: Vec<String> = names.map(|(row, _)| self.motion().row_name(Some(*row))).collect();
        Ok(names.join(", "))
    }
}

/// The rates of a state, as they are asked for from outside; `[hot, no allocation]`.
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn rates<F: Engines>(form: &mut F, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
    form.motion_mut().counters.evaluations += 1;
    let mut stage = std::mem::take(&mut form.motion_mut().passage.stage);
    let result = rates_of_stage(form, t, state, &mut stage, rates);
    form.motion_mut().passage.stage = stage;
    result?;
    // Without a way out, several at a time.
    if rates.iter().fold(true, |finite, rate| finite & rate.is_finite()) {
        return Ok(());
    }
    Err(AnalysisError::NotFinite { what: "an acceleration or the rate of a state".into() })
}

/// The rates at a stage of a step, which may be moved to the constraints; `stage` is room for that.
fn rates_of_stage<F: Engines>(
    form: &mut F,
    t: f64,
    state: &[f64],
    stage: &mut [f64],
    rates: &mut [f64],
) -> Result<(), AnalysisError> {
    let careful = form.motion().careful;
    let found = if careful {
        stage.copy_from_slice(state);
        form.motion_mut().counters.stage_projections += 1;
        project_plainly(form, t, stage, true).and_then(|()| rates_plainly(form, t, stage, rates, true))
    } else {
        rates_plainly(form, t, state, rates, true)
    };
    match found {
        Err(AnalysisError::NextToSingular) => {}
        result => return result,
    }
    if !careful {
        stage.copy_from_slice(state);
    }
    let mut passage = std::mem::take(&mut form.motion_mut().passage);
    let passed = passage.interpolate(form, t, stage, rates, |form, t, place, rates| {
        project_plainly(form, t, place, false)?;
        rates_plainly(form, t, place, rates, false)
    });
    form.motion_mut().passage = passage;
    let way = passed?;
    if way == Way::Through {
        form.motion_mut().counters.interpolated += 1;
        return Ok(());
    }
    // Brought to the constraints, what the motion turns before would have round-off divided by the cube of the distance in its
    // accelerations; there is no pole.
    if way == Way::Round {
        return rates_plainly(form, t, state, rates, false);
    }
    if careful {
        project_plainly(form, t, stage, false)?;
    }
    rates_plainly(form, t, stage, rates, false)
}

/// Brings a state next to a singular position to the constraints. One that the motion turns before is no reason to stay off them:
/// a shorter step meets them.
///
/// # Errors
/// See [`AnalysisError`].
fn project_next_to<F: Engines>(form: &mut F, t: f64, state: &mut [f64], way: Way) -> Result<(), AnalysisError> {
    project_plainly(form, t, state, false)?;
    if way != Way::Round {
        return Ok(());
    }
    form.motion_mut().load(t, state);
    let (worst, row) = form.worst_violation()?;
    let violation = worst / form.motion().length;
    if violation <= MOST_CROSSED {
        return Ok(());
    }
    Err(AnalysisError::LeftConstraints { what: form.motion().row_name(row), violation })
}

/// Brings positions and velocities to the constraints, next to a singular position too. What is interpolated there is looked at:
/// where the constraints are not met then, the rest is interpolated once more, and what is left after that must be small.
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn project<F: Engines>(form: &mut F, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
    match project_plainly(form, t, state, true) {
        Err(AnalysisError::NextToSingular) => {}
        result => return result,
    }
    let (mut violation, mut what) = (0.0, String::new());
    for _ in 0..MOST_PROJECTIONS {
        let mut passage = std::mem::take(&mut form.motion_mut().passage);
        let mut correction = std::mem::take(&mut passage.correction);
        let passed = passage.interpolate(form, t, state, &mut correction, |form, t, place, correction| {
            correction.copy_from_slice(place);
            project_plainly(form, t, place, false)?;
            correction.iter_mut().zip(place).for_each(|(before, after)| *before = *after - *before);
            Ok(())
        });
        passage.correction = correction;
        form.motion_mut().passage = passage;
        let way = passed?;
        if way != Way::Through {
            return project_next_to(form, t, state, way);
        }
        form.motion_mut().counters.interpolated += 1;
        state.iter_mut().zip(&form.motion_mut().passage.correction).for_each(|(value, by)| *value += by);
        form.motion().normalise(state);
        form.motion_mut().load(t, state);
        let (worst, row) = form.worst_violation()?;
        (violation, what) = (worst / form.motion().length, form.motion().row_name(row));
        if violation <= MET {
            return Ok(());
        }
    }
    if violation <= MOST_MISSED { Ok(()) } else { Err(AnalysisError::LeftConstraints { what, violation }) }
}

/// The rates of a state as it is; with `keep_away`, refused next to a singular position.
///
/// # Errors
/// See [`AnalysisError`].
fn rates_plainly<F: Engines>(
    form: &mut F,
    t: f64,
    state: &[f64],
    rates: &mut [f64],
    keep_away: bool,
) -> Result<(), AnalysisError> {
    form.motion_mut().load(t, state);
    let used = form.solve_dynamics()?;
    if used == Used::Safe && keep_away && form.is_singular(NEAR_SINGULAR) {
        return Err(AnalysisError::NextToSingular);
    }
    form.motion().write_rates(state, rates);
    Ok(())
}

/// Puts interpolated rates into the equations at their state.
///
/// # Errors
/// [`AnalysisError::Uncertified`] where they do not hold.
pub(super) fn try_rates<F: Engines>(form: &mut F, t: f64, state: &[f64], rates: &[f64]) -> Result<(), AnalysisError> {
    form.motion_mut().load(t, state);
    let motion = form.motion();
    let power = rates[motion.coordinates.motion + motion.layout.states];
    let accelerations = motion.accelerations_of(rates);
    form.try_motion(&accelerations, power)
}

/// See [`super::Formulation::certify`].
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn certify<F: Engines>(form: &mut F, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
    let before = form.motion_mut().counters.interpolated;
    let mut slopes = std::mem::take(&mut form.motion_mut().passage.slopes);
    slopes.resize(state.len(), 0.0);
    let mut result = rates(form, t, state, &mut slopes);
    if result.is_ok() && form.motion_mut().counters.interpolated > before {
        result = try_rates(form, t, state, &slopes);
    }
    form.motion_mut().passage.slopes = slopes;
    result
}

/// Its places, and scratch; see the module documentation.
#[derive(Debug, Default)]
pub(super) struct Passage {
    /// The state that is evaluated.
    stage: Vec<f64>,
    /// What brings a state to the constraints.
    correction: Vec<f64>,
    /// Rates that are examined.
    slopes: Vec<f64>,
    /// Distances of the places on one side, ascending from 1.
    places: Vec<f64>,
    place: Vec<f64>,
    answer: Vec<f64>,
    /// The state in the middle between the places.
    middle: Vec<f64>,
}

/// How the motion goes on next to a singular position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// Through it: what was asked for is found.
    Through,
    /// The velocity does not lead to it.
    Past,
    /// The constraints are not met at a place, or in the middle between them: the motion turns before it gets there.
    Round,
}

/// A singular position ahead or behind, s.
struct Gap {
    centre: f64,
    half: f64,
}

impl Passage {
    /// For states of a length, and answers up to a length.
    pub(super) fn new(dim: usize, answers: usize) -> Self {
        let (low, high) = (1.0, OUTERMOST * OUTERMOST);
        let square = |i: usize| {
            let angle = (2 * i + 1) as f64 * std::f64::consts::PI / (2 * PLACES) as f64;
            0.5 * (low + high - (high - low) * angle.cos())
        };
        let places = (0..PLACES).map(|i| (square(i) / square(0)).sqrt()).collect();
        Self {
            stage: vec![0.0; dim],
            correction: vec![0.0; dim],
            slopes: Vec::new(),
            places,
            place: vec![0.0; dim],
            answer: vec![0.0; answers],
            middle: vec![0.0; dim],
        }
    }

    /// Evaluates the polynomial through the answers to a question, which is asked for the states at the places (to change as
    /// it likes, and to bring to the constraints). Found is something only where the motion leads through the singular position.
    ///
    /// # Errors
    /// What the question fails with at a place.
    pub(super) fn interpolate<F: Passing>(
        &mut self,
        form: &mut F,
        t: f64,
        state: &[f64],
        sum: &mut [f64],
        mut ask: impl FnMut(&mut F, f64, &mut [f64], &mut [f64]) -> Result<(), AnalysisError>,
    ) -> Result<Way, AnalysisError> {
        let Some(gap) = self.find(form, t, state)? else { return Ok(Way::Past) };
        for half in [gap.half, CLOSER * gap.half, CLOSER * CLOSER * gap.half] {
            match self.interpolate_over(form, t, state, &Gap { half, ..gap }, sum, &mut ask) {
                Ok(missed) if missed <= MOST_CROSSED => return Ok(Way::Through),
                Ok(_) => {}
                Err(AnalysisError::LeftConstraints { .. }) => return self.turns(form, t, state, &gap, sum, &mut ask),
                Err(error) => return Err(error),
            }
        }
        Ok(Way::Round)
    }

    /// [`Way::Round`], unless it is time alone that does not lead on: the nearest place ahead is met at the time of the state, not
    /// soon after it. Drives continue whatever the mechanism does; speeds then grow without limit, with one over the square root of
    /// the time that is left, and what is left of that is not worth its steps.
    ///
    /// # Errors
    /// [`AnalysisError::OutOfReach`], and what the question fails with.
    fn turns<F: Passing>(
        &mut self,
        form: &mut F,
        t: f64,
        state: &[f64],
        gap: &Gap,
        sum: &mut [f64],
        ask: &mut impl FnMut(&mut F, f64, &mut [f64], &mut [f64]) -> Result<(), AnalysisError>,
    ) -> Result<Way, AnalysisError> {
        if gap.centre <= 0.0 {
            return Ok(Way::Round);
        }
        let drives = form.drives(t, state)?;
        if drives.is_empty() || form.share(t, state)? >= LOST {
            return Ok(Way::Round);
        }
        // Towards a time that cannot be passed, half of `centre` is left. Where the motion is about to turn back it is slow, and `s` is
        // long after that: between them, by ratio, is what the drives ask for next.
        let s = gap.centre + gap.half;
        let next = (s * gap.centre).sqrt();
        let mut meet = |form: &mut F, time: f64| {
            form.shift(state, s, &mut self.place);
            ask(form, time, &mut self.place, &mut self.answer[..sum.len()])
        };
        let Err(AnalysisError::LeftConstraints { what, .. }) = meet(form, t + next) else { return Ok(Way::Round) };
        match meet(form, t) {
            Ok(()) => Err(AnalysisError::OutOfReach { drives, what }),
            Err(AnalysisError::LeftConstraints { .. }) => Ok(Way::Round),
            Err(error) => Err(error),
        }
    }

    /// Evaluates the polynomial over a gap; gives by how much the constraints are missed in its middle.
    fn interpolate_over<F: Passing>(
        &mut self,
        form: &mut F,
        t: f64,
        state: &[f64],
        gap: &Gap,
        sum: &mut [f64],
        ask: &mut impl FnMut(&mut F, f64, &mut [f64], &mut [f64]) -> Result<(), AnalysisError>,
    ) -> Result<f64, AnalysisError> {
        sum.fill(0.0);
        self.middle.fill(0.0);
        for number in 0..2 * PLACES {
            let s = gap.centre + gap.half * self.node(number);
            form.shift(state, s, &mut self.place);
            let answer = &mut self.answer[..sum.len()];
            ask(form, t + s, &mut self.place, answer)?;
            let weight = self.weight(number, -gap.centre / gap.half);
            sum.iter_mut().zip(&self.answer).for_each(|(sum, value)| *sum += weight * value);
            let weight = self.weight(number, 0.0);
            self.middle.iter_mut().zip(&self.place).for_each(|(sum, value)| *sum += weight * value);
        }
        form.missed(t + gap.centre, &mut self.middle)
    }

    /// Distance from the singular position, in units of the gap.
    fn node(&self, number: usize) -> f64 {
        if number < PLACES { self.places[number] } else { -self.places[number - PLACES] }
    }

    /// Lagrange's polynomial of a place.
    fn weight(&self, number: usize, x: f64) -> f64 {
        let own = self.node(number);
        let others = (0..2 * PLACES).filter(|other| *other != number).map(|other| self.node(other));
        others.map(|other| (x - other) / (own - other)).product()
    }

    /// Where the pivot ratio vanishes along the velocity, and how far from there it is large enough. The ratio goes with the
    /// distance: `|s - centre| * slope`.
    fn find(&mut self, form: &mut impl Passing, t: f64, state: &[f64]) -> Result<Option<Gap>, AnalysisError> {
        let fastest = form.fastest(state);
        let mut look = FIRST_LOOK / fastest;
        if !look.is_finite() {
            return Ok(None);
        }
        for _ in 0..MOST_LOOKS {
            form.shift(state, -look, &mut self.place);
            let behind = form.share(t - look, &self.place)?;
            form.shift(state, look, &mut self.place);
            let ahead = form.share(t + look, &self.place)?;
            if behind.min(ahead) >= SOUND {
                let slope = (behind + ahead) / (2.0 * look);
                let gap = Gap { centre: look * (behind - ahead) / (behind + ahead), half: SOUND / slope };
                return Ok(Some(gap).filter(|gap| gap.centre.abs() <= gap.half));
            }
            look *= 2.0;
        }
        Ok(None)
    }
}
