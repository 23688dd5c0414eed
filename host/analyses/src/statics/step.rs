//! [`Step`]: implicit steps towards an equilibrium.

use nalgebra::{DMatrix, DVector};

use super::search::{GROWTH, LONGEST, Look, Search, WIDEST};
use crate::analysis::{Direction, Function};

/// Attempts at each step.
const MOST_ATTEMPTS: usize = 40;
/// Size, s^2, from which on states are where their rates are zero, however slow they are.
const SLOWEST: f64 = 1e24;
/// Share of the longest step that one is made to take which would be longer.
const NEARLY: f64 = 0.9;
/// Share of the step before that one is shorter than which gets shorter with its size.
const SHORTER: f64 = 0.95;
/// Corrections of a step along which stiff directions turn.
const MOST_TURNS: usize = 6;

/// A step that was taken: to where, what acts there, of which size, and how long as a share of the longest.
pub(super) struct Step {
    pub(super) inputs: Vec<f64>,
    pub(super) look: Look,
    pub(super) size: f64,
    pub(super) reach: f64,
    /// Whether the next may be longer: it says little of what steps can still gain.
    pub(super) held: bool,
}

/// The equations of implicit steps from a place, in free motions and then states.
struct System<'l> {
    look: &'l Look,
    /// Motions by which rows follow states.
    moved: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    mass: DMatrix<f64>,
    /// What is left, and rates of states.
    right: DVector<f64>,
    /// Size beyond which masses stay as they are: directions without stiffness keep some of theirs.
    most: f64,
}

impl<'l> System<'l> {
    fn of(look: &'l Look) -> Self {
        use Direction as D;
        use Function as F;
        let e = &look.expansion;
        let basis = &look.freedom.basis;
        let (q, s) = (basis.ncols(), look.rates.len());
        let moved = look.freedom.moved_by(&e.slope(F::Rows, D::States));
        let along_states = |of: F| e.slope(of, D::States) + e.slope(of, D::Positions) * &moved;
        let mut stiffness = DMatrix::zeros(q + s, q + s);
        stiffness.view_mut((0, 0), (q, q)).copy_from(&(basis.transpose() * e.slope(F::Balance, D::Positions) * basis));
        stiffness.view_mut((0, q), (q, s)).copy_from(&(basis.transpose() * along_states(F::Balance)));
        stiffness.view_mut((q, 0), (s, q)).copy_from(&(e.slope(F::States, D::Positions) * basis));
        stiffness.view_mut((q, q), (s, s)).copy_from(&along_states(F::States));
        let mass = basis.transpose() * &e.mass * basis;
        let mut right = DVector::zeros(q + s);
        right.rows_mut(0, q).copy_from(&(basis.transpose() * &look.left));
        right.rows_mut(q, s).copy_from(&look.rates);
        let stiffest = (0..q).map(|k| stiffness[(k, k)].abs() / mass[(k, k)]).fold(f64::MIN_POSITIVE, f64::max);
        Self { look, moved, stiffness, mass, right, most: (1e14 / stiffest).min(1e100) }
    }

    /// Displacements, six for each body, and changes of states in a step of some size, which has `gone` so far already.
    fn solve(&self, size: f64, gone: Option<(&DVector<f64>, &DVector<f64>)>) -> Option<(DVector<f64>, DVector<f64>)> {
        let basis = &self.look.freedom.basis;
        let (q, s) = (basis.ncols(), self.look.rates.len());
        let mut system = -self.stiffness.clone();
        let mut inertia = system.view_mut((0, 0), (q, q));
        let of_masses = size.min(self.most);
        inertia += &self.mass / of_masses;
        (0..s).for_each(|k| system[(q + k, q + k)] += 1.0 / size.sqrt());
        let mut right = self.right.clone();
        if let Some((step, states)) = gone {
            let mut pull = right.rows_mut(0, q);
            pull -= basis.transpose() * (&self.look.expansion.mass * step) / of_masses;
            let mut rates = right.rows_mut(q, s);
            rates -= states / size.sqrt();
        }
        let found = system.lu().solve(&right).filter(|found| found.iter().all(|value| value.is_finite()))?;
        let states = found.rows(q, s).into_owned();
        Some((basis * found.rows(0, q) + &self.moved * &states, states))
    }
}

impl Search<'_> {
    /// A step of some size, s^2: a mass that nothing else holds moves by so much of the acceleration that its load would give it.
    pub(super) fn step(&mut self, inputs: &[f64], look: &Look, size: Option<f64>) -> Result<Step, String> {
        let e = &look.expansion;
        let (q, s) = (look.freedom.basis.ncols(), look.rates.len());
        if q + s == 0 {
            return Err("nothing can move, and reactions cannot hold the loads to round-off".into());
        }
        let system = System::of(look);
        let pull = system.right.rows(0, q);
        let fastest = (0..q).map(|k| pull[k].abs() / system.mass[(k, k)]).fold(0.0, f64::max);
        let mut size = size.unwrap_or_else(|| if fastest > 0.0 { LONGEST * self.length / fastest } else { 1.0 });
        let whole = if s > 0 { SLOWEST.max(system.most) } else { system.most };
        size = size.min(whole);
        let asked = size;
        let most = system.most;
        let shorter = |size: f64| size.min(most) / GROWTH;
        let mut why = String::from("no step leads on");
        let mut reached = f64::INFINITY;
        for _ in 0..MOST_ATTEMPTS {
            let Some((step, states)) = system.solve(size, None) else {
                size = shorter(size);
                continue;
            };
            let (reach, far, wide) = self.length_of(&step);
            if reach > 1.0 {
                // What nothing holds moves in proportion. Beyond a size at which mass outweighs a stiffness that drives away, steps
                // are as long whatever their size.
                let share = if reach < SHORTER * reached { NEARLY / reach } else { 0.0 };
                (size, reached) = (size.min(most) * share.max(1.0 / GROWTH), reach);
                why = format!("steps of {far:.1e} m and {wide:.1e} rad do not get shorter");
                continue;
            }
            let mut from = inputs.to_vec();
            self.carry(&mut from, &states);
            let (next, after) = match self.moved(&from, &step) {
                Ok(moved) => moved,
                Err(reason) => {
                    (why, size) = (reason, shorter(size));
                    continue;
                }
            };
            // A state that comes back as fast as it went has been carried too far (limits of rates).
            let turned = |k: usize| {
                let (before, after) = (look.rates[k], after.rates[k]);
                before * states[k] > 0.0 && before * after < 0.0 && after.abs() > 0.9 * before.abs()
            };
            if let Some(k) = (0..s).find(|k| turned(*k)) {
                let element = self.layout.element_of_state(self.local.states()[k]);
                let name = &self.session.model.elements[element].name;
                why = format!("the rate of a state of `{name}` jumps where it would be zero");
                size = shorter(size);
                continue;
            }
            // Work done on the way: what is left must not turn against the step by more than it pushed it, be it that states follow it
            // or that it follows them.
            let noise = 1e-9 * e.sizes.iter().zip(step.iter()).map(|(size, step)| (size * step).abs()).sum::<f64>();
            let opposes = |step: &DVector<f64>, before: &DVector<f64>, after: &DVector<f64>| {
                let before = before.dot(step);
                before < -noise || 0.5 * (before + after.dot(step)) < -noise
            };
            if q > 0
                && opposes(&step, &look.left, &after.left)
                && (s == 0
                    || self.look(&mut from).map_or(true, |with_states| opposes(&step, &with_states.left, &after.left)))
            {
                let is_good = |step: &DVector<f64>, after: &Look| !opposes(step, &look.left, &after.left);
                if let Some(turned) = self.turned((next, after), (step, states), size, is_good) {
                    return Ok(turned);
                }
                why = "loads oppose every step, however short: they have no balance near".into();
                size = shorter(size);
                continue;
            }
            let held = reach > 1.0 / GROWTH || (asked..whole).contains(&size);
            return Ok(Step { inputs: next, look: after, size, reach, held });
        }
        Err(why)
    }

    /// Where a step ends that loads oppose since stiff directions turn along it: the step is implicit in them as they are at its start, and
    /// leaves their circle by its square. Newton's method goes on to where it is implicit in those of its end. `None` where loads oppose
    /// that, too.
    fn turned(
        &mut self,
        (mut inputs, mut look): (Vec<f64>, Look),
        (mut step, mut states): (DVector<f64>, DVector<f64>),
        size: f64,
        is_good: impl Fn(&DVector<f64>, &Look) -> bool,
    ) -> Option<Step> {
        for _ in 0..MOST_TURNS {
            let (more, more_states) = System::of(&look).solve(size, Some((&step, &states)))?;
            (step, states) = (step + &more, states + &more_states);
            self.carry(&mut inputs, &more_states);
            (inputs, look) = self.moved(&inputs, &more).ok()?;
            let (reach, ..) = self.length_of(&step);
            if reach > 1.0 {
                return None;
            }
            if is_good(&step, &look) {
                return Some(Step { inputs, look, size, reach, held: true });
            }
        }
        None
    }

    /// How long a step is as a share of the longest; its longest displacement, m, and turn, rad.
    fn length_of(&self, step: &DVector<f64>) -> (f64, f64, f64) {
        let (far, wide) = step.iter().enumerate().fold((0.0_f64, 0.0_f64), |(far, wide), (k, part)| {
            if k % 6 < 3 { (far.max(part.abs()), wide) } else { (far, wide.max(part.abs())) }
        });
        ((far / (LONGEST * self.length)).max(wide / WIDEST), far, wide)
    }

    fn carry(&self, inputs: &mut [f64], states: &DVector<f64>) {
        let own = self.local.states().iter().zip(states.iter());
        own.for_each(|(state, change)| inputs[self.layout.state_slot() + state] += change);
    }

    /// The place after a displacement, brought to the rows, and what acts there.
    fn moved(&mut self, from: &[f64], step: &DVector<f64>) -> Result<(Vec<f64>, Look), String> {
        let mut next = from.to_vec();
        self.go(&mut next, step);
        self.project(&mut next)?;
        let look = self.look(&mut next)?;
        Ok((next, look))
    }
}
