//! [`Stops`]: quantities that must not become negative. The integration ends where one does, so that whoever asked for it can
//! change the state or the equations there (a contact that closes or opens) and integrate on.
//!
//! Unlike a switch (`events.rs`), a stop may not be passed at all, whether or not error control notices anything: the
//! equations are smooth across it. So it is located on the interpolation of the step, and the step is made again to end there,
//! until it does; its state has the accuracy of the method.
//!
//! A quantity may depend on forces that the state does not show: what rests under a load over time takes steps of any size, and
//! its reaction passes its limit and comes back within one. So the polynomial through the places that are looked at has to agree
//! with the quantity at two further ones, and to stay positive by more than its error; otherwise the step is looked at in halves.

use super::events::Again;
use super::interpolation::Interpolation;
use super::run::{Run, Trouble};

/// Values of [`System::stopping`](super::System::stopping) below this are zero.
pub const ZERO: f64 = 1e-13;
/// Accuracy of the location on an interpolation, as a share of the step.
const FINE: f64 = 1e-14;
/// Looks at the quantities for one location.
const MOST_LOOKS: usize = 80;
/// Times that a step is made again for one stop.
const MOST_TRIES: u32 = 8;
/// Where a step is looked at, besides its start, as shares of it.
const PLACES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Where the polynomial through these places is compared with the quantity: near its largest errors, and not as even as what is
/// compared may be.
const COMPARED: [f64; 2] = [0.08, 0.91];
/// Largest error of the polynomial by its errors at these places, with a margin.
const WORST: f64 = 2.0;
/// Largest error of a polynomial that shows which way a quantity goes, by how much that changes.
const SHOWN: f64 = 0.05;
/// How far the polynomial goes beyond values that it is made of, at most, by how far these are apart.
const BEYOND: f64 = 0.61;
/// Places at which the polynomial is looked at.
const FINELY: usize = 32;
/// Looks at a step for quantities that may become negative between two places and are not at both.
const MOST_FOR_DIPS: usize = 200;

/// What is to become of a step.
pub(super) enum Verdict {
    /// Nothing stops within it.
    Pass,
    /// It has to end earlier.
    Again(Again),
    /// The integration ends with it.
    End,
    /// The integration ends before it.
    Before,
}

/// A share of a step, and the values there.
type Place = (f64, Vec<f64>);
/// Places at even distances.
type Places = [Place; PLACES.len() + 1];
/// The values that the polynomial through them is compared with.
type Compared = [Vec<f64>; COMPARED.len()];
type Looked = (Places, Compared);

/// See the module documentation.
pub(super) struct Stops {
    first: Vec<f64>,
    values: Vec<f64>,
    /// Below what each of them stops: zero as soon as it was positive; until then, less than it was at the start.
    least: Vec<f64>,
    /// The same at the start of the step: steps that are made again have not happened.
    least_at_start: Vec<f64>,
    least_at_end: Vec<f64>,
    /// Which of them were positive in an earlier step.
    were_positive: Vec<bool>,
    /// Values at the start of the step, known at this time.
    known_at: Option<f64>,
    state: Vec<f64>,
    /// Which of them came down to zero in an earlier step.
    reached: Vec<bool>,
    /// What is seen of a whole step.
    looked: Looked,
    /// Times that a step to the same stop was made again.
    tries: u32,
}

impl Stops {
    pub(super) fn new(run: &Run<'_>) -> Self {
        let count = run.system.stops();
        let dim = if count > 0 { run.system.dim() } else { 0 };
        Self {
            first: vec![0.0; count],
            least: vec![f64::NEG_INFINITY; count],
            least_at_start: vec![f64::NEG_INFINITY; count],
            least_at_end: vec![f64::NEG_INFINITY; count],
            were_positive: vec![false; count],
            values: vec![0.0; count],
            reached: vec![false; count],
            looked: Looked::default(),
            known_at: None,
            state: vec![0.0; dim],
            tries: 0,
        }
    }

    /// Whether there are any.
    pub(super) fn is_needed(&self) -> bool {
        !self.values.is_empty()
    }

    /// Judges a step that error control has accepted, from the state `y`.
    pub(super) fn examine(
        &mut self,
        run: &mut Run<'_>,
        y: &[f64],
        step: &Interpolation<'_>,
    ) -> Result<Verdict, Trouble> {
        self.least.copy_from_slice(&self.least_at_start);
        if self.known_at != Some(step.start) {
            self.state.copy_from_slice(y);
            run.stopping(step.start, &self.state, &mut self.values)?;
            if self.least.contains(&f64::NEG_INFINITY) {
                self.least.iter_mut().zip(&self.values).for_each(|(least, value)| *least = value.min(0.0) - ZERO);
                self.note_positive();
            }
            self.first.copy_from_slice(&self.values);
            self.least_at_start.copy_from_slice(&self.least);
            self.known_at = Some(step.start);
            if self.is_beyond() {
                return Ok(Verdict::Before);
            }
        }
        // What came down to zero in an earlier step stops at its end.
        let starts = self.first.iter().zip(&self.were_positive);
        self.reached.iter_mut().zip(starts).for_each(|(reached, (first, was))| *reached = *was && *first <= ZERO);
        if let Some((from, to)) = self.passage(run, step)? {
            let falls = |k: usize| self.reached[k] && to.1[k] < self.least[k];
            if (0..self.reached.len()).any(falls) {
                return Ok(Verdict::Before);
            }
            let place = to.0;
            let mut share = self.locate(run, step, from, to)?;
            if place == 1.0 && (1.0 - share) * step.h <= run.smallest_step() {
                match self.dip_before_end(run, step)? {
                    Some((from, to)) => share = self.locate(run, step, from, to)?,
                    None => return Ok(Verdict::End),
                }
            }
            if share * step.h <= run.smallest_step() {
                return Ok(Verdict::Before);
            }
            if self.tries >= MOST_TRIES {
                return Ok(Verdict::End);
            }
            self.tries += 1;
            run.counters.rejected += 1;
            let end = step.time(share);
            return Ok(Verdict::Again(Again { h: end - step.start, end_at: Some(end) }));
        }
        // As near as can be known.
        let mut ends = self.values.iter().zip(&self.first);
        if self.tries > 0 && ends.any(|(value, first)| *value <= ZERO && first > value) {
            return Ok(Verdict::End);
        }
        self.tries = 0;
        self.least_at_start.copy_from_slice(&self.least);
        self.were_positive.iter_mut().zip(&self.least).for_each(|(was, least)| *was = *least == 0.0);
        self.first.copy_from_slice(&self.values);
        self.known_at = Some(step.end);
        Ok(Verdict::Pass)
    }

    /// The share at which the first of them becomes negative of what continues the last step as if it were a step.
    pub(super) fn ahead(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> Result<Option<f64>, Trouble> {
        if !self.is_needed() {
            return Ok(None);
        }
        self.least.copy_from_slice(&self.least_at_start);
        if self.known_at != Some(step.start) {
            self.look_at(run, step, 0.0)?;
            self.first.copy_from_slice(&self.values);
        }
        let passage = self.passage(run, step)?;
        passage.map(|(from, to)| self.locate(run, step, from, to)).transpose()
    }

    /// The step was made final and something else changed since: what is known of its end does not hold.
    pub(super) fn forget(&mut self) {
        self.known_at = None;
    }

    fn is_beyond(&self) -> bool {
        self.values.iter().zip(&self.least).any(|(value, least)| value < least)
    }

    /// The values at a share of a step.
    fn look_at(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>, share: f64) -> Result<(), Trouble> {
        (step.at)(share, &mut self.state);
        run.stopping(step.time(share), &self.state, &mut self.values)
    }

    /// Takes note of what has become positive where nothing stops; not behind a stop, from where places before it are looked at.
    fn note_positive(&mut self) {
        let seen = self.least.iter_mut().zip(&self.values).filter(|(least, value)| least.is_finite() && **value > ZERO);
        seen.for_each(|(least, _)| *least = 0.0);
    }

    /// Two places between which the first of them becomes negative, if one does within the step; otherwise [`Stops::values`] are
    /// those at its end.
    fn passage(&mut self, run: &mut Run<'_>, step: &Interpolation<'_>) -> Result<Option<(Place, Place)>, Trouble> {
        let mut looked = std::mem::take(&mut self.looked);
        let passage = self.look_along(run, step, &mut looked);
        self.looked = looked;
        passage
    }

    fn look_along(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
        (places, compared): &mut Looked,
    ) -> Result<Option<(Place, Place)>, Trouble> {
        keep(&mut places[0], 0.0, &self.first);
        for (before, share) in PLACES.into_iter().enumerate() {
            self.look_at(run, step, share)?;
            if self.is_beyond() {
                return Ok(Some((places[before].clone(), (share, self.values.clone()))));
            }
            keep(&mut places[before + 1], share, &self.values);
            self.note_positive();
        }
        // Earlier in the step than it was looked at for this.
        std::mem::swap(&mut self.least, &mut self.least_at_end);
        let passage = self.first_dip(run, step, places, compared)?;
        if passage.is_none() {
            self.values.copy_from_slice(&places[PLACES.len()].1);
            std::mem::swap(&mut self.least, &mut self.least_at_end);
        }
        Ok(passage)
    }

    /// The same where a quantity has just become negative at the end of a step, and at none of the places before it.
    fn dip_before_end(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
    ) -> Result<Option<(Place, Place)>, Trouble> {
        self.look_at(run, step, 1.0)?;
        self.values.iter_mut().zip(&self.least).for_each(|(value, least)| *value = value.max(*least));
        let mut looked = std::mem::take(&mut self.looked);
        let (places, compared) = &mut looked;
        keep(&mut places[PLACES.len()], 1.0, &self.values);
        let passage = self.first_dip(run, step, places, compared);
        self.looked = looked;
        passage
    }

    /// The same between five places at which nothing is negative.
    fn first_dip(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
        places: &Places,
        compared: &mut Compared,
    ) -> Result<Option<(Place, Place)>, Trouble> {
        self.least.copy_from_slice(&self.least_at_start);
        let mut halves = Vec::new();
        let mut looks = 0;
        let mut passage = self.dip(run, step, places, compared, (&mut halves, &mut looks))?;
        while passage.is_none()
            && let Some(half) = halves.pop()
        {
            passage = self.dip(run, step, &half, compared, (&mut halves, &mut looks))?;
        }
        Ok(passage)
    }

    /// The same as far as it shows at once; halves that are still to be looked at are added.
    fn dip(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
        piece: &Places,
        compared: &mut Compared,
        (halves, looks): (&mut Vec<Places>, &mut usize),
    ) -> Result<Option<(Place, Place)>, Trouble> {
        for ((share, before), values) in COMPARED.into_iter().zip([0, 3]).zip(compared.iter_mut()) {
            let share = piece[0].0 + share * (piece[4].0 - piece[0].0);
            self.look_at(run, step, share)?;
            if self.is_beyond() {
                return Ok(Some((piece[before].clone(), (share, self.values.clone()))));
            }
            values.clone_from(&self.values);
        }
        *looks += COMPARED.len();
        if *looks >= MOST_FOR_DIPS || !(0..self.values.len()).any(|k| self.may_dip(piece, compared, k)) {
            return Ok(None);
        }
        let mut middles = [const { (0.0, Vec::new()) }; PLACES.len()];
        for (pair, middle) in piece.windows(2).zip(&mut middles) {
            let share = 0.5 * (pair[0].0 + pair[1].0);
            self.look_at(run, step, share)?;
            if self.is_beyond() {
                return Ok(Some((pair[0].clone(), (share, self.values.clone()))));
            }
            keep(middle, share, &self.values);
            *looks += 1;
        }
        let [first, second, third, fourth] = middles;
        let [start, early, centre, late, end] = piece.clone();
        halves.push([centre.clone(), third, late, fourth, end]);
        halves.push([start, first, early, second, centre]);
        Ok(None)
    }

    /// Whether a quantity may become negative between five places at even distances, as far as they and the values at the places
    /// that are compared show.
    fn may_dip(&self, piece: &Places, compared: &Compared, k: usize) -> bool {
        let known = [0, 1, 2, 3, 4].map(|place| piece[place].1[k]);
        let (low, high) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let errors = COMPARED.iter().zip(compared).map(|(at, values)| (values[k] - quartic(known, *at)).abs());
        let error = WORST * errors.fold(0.0, f64::max);
        let least = self.least[k] - ZERO + error;
        if low - BEYOND * (high - low) >= least {
            return false;
        }
        let lowest = (1..FINELY).map(|at| quartic(known, at as f64 / FINELY as f64)).fold(f64::INFINITY, f64::min);
        let is_at_ends = error <= SHOWN * (high - low) && lowest >= known[0].min(known[4]) - error;
        lowest < least && !is_at_ends
    }

    /// The share of the step at which the first of them becomes negative, between two at which values are known: regula falsi with
    /// Illinois weights (Dowell & Jarratt 1971) over all of them.
    fn locate(
        &mut self,
        run: &mut Run<'_>,
        step: &Interpolation<'_>,
        (mut from, mut low): (f64, Vec<f64>),
        (mut to, mut high): (f64, Vec<f64>),
    ) -> Result<f64, Trouble> {
        let width = FINE.max(2.0 * f64::EPSILON * step.start.abs() / step.h);
        let mut moved = 0;
        for _ in 0..MOST_LOOKS {
            if to - from <= width {
                break;
            }
            let negative = (0..high.len()).filter(|k| high[*k] < self.least[*k]);
            let zero = negative.map(|k| low[k].max(0.0) / (low[k].max(0.0) - high[k])).fold(1.0, f64::min);
            let at = from + (to - from) * zero.clamp(1e-3, 1.0 - 1e-3);
            self.look_at(run, step, at)?;
            if self.is_beyond() {
                (to, high) = (at, self.values.clone());
                if moved == 1 {
                    low.iter_mut().for_each(|value| *value *= 0.5);
                }
                moved = 1;
            } else {
                self.note_positive();
                (from, low) = (at, self.values.clone());
                if moved == -1 {
                    high.iter_mut().for_each(|value| *value *= 0.5);
                }
                moved = -1;
            }
        }
        Ok(from)
    }
}

/// The polynomial of degree four through values at 0, 1/4, 1/2, 3/4 and 1, by forward differences.
fn quartic(values: [f64; 5], at: f64) -> f64 {
    let mut differences = values;
    for order in 1..differences.len() {
        for k in (order..differences.len()).rev() {
            differences[k] -= differences[k - 1];
        }
    }
    let places = 4.0 * at;
    (1..differences.len()).rev().fold(differences[4], |sum, order| {
        let next = order - 1;
        differences[next] + sum * (places - next as f64) / order as f64
    })
}

/// Takes values as those at a share of a step.
fn keep(place: &mut Place, share: f64, values: &[f64]) {
    place.0 = share;
    place.1.clear();
    place.1.extend_from_slice(values);
}
