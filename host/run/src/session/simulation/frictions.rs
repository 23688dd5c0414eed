//! Rows that hold up to a limit, during a run: into which direction each slides, which is kept with the discrete states.

use super::Simulation;
use super::contacts::Touch;
use crate::analysis::{AnalysisError, Balance, Meeting, Pattern, Shares};
use crate::results::EventKind;

/// Speed in a plane below which its direction is left as it was, in tolerances.
const NO_DIRECTION: f64 = 10.0;

/// Share of the speeds in a scene that is a motion.
const STIRS: f64 = 1e-6;

/// Changes of gradients, as a share of the largest of their parts, that turn no balance of forces.
const TURNS: f64 = 1e-13;

/// What shares were found of, to be found again where it has moved: balances of forces turn with it.
#[derive(Debug, Default)]
pub(super) struct Shared {
    touching: Vec<usize>,
    pattern: Option<Pattern>,
    /// Contacts and frictions that have no part in it since: see [`Shares::leave_out`].
    left_out: Vec<[Option<usize>; 2]>,
    /// Where it was found last: see [`Contacts::gradients`](crate::analysis::Contacts::gradients).
    gradients: Vec<f64>,
}

/// Where some frictions slide to.
pub(super) type Sliding = Vec<(usize, [f64; 2])>;

impl Touch {
    /// Number of the first friction, behind the contacts.
    pub(super) fn first_friction(&self) -> usize {
        self.contacts.contacts().len()
    }

    /// Those that slide with these discrete states; those that creep have no direction there.
    pub(super) fn sliding(&self, discrete: &[f64]) -> Sliding {
        let frictions = self.contacts.frictions().iter().enumerate();
        let creeps = |one: &crate::program::Friction| one.rows.len() > 1 && discrete[one.direction_at + 2] < 0.0;
        let direction = |(number, friction): (usize, &crate::program::Friction)| {
            let mut direction = [0.0; 2];
            let own = discrete[friction.direction_at..].iter().take(friction.rows.len());
            direction.iter_mut().zip(own).for_each(|(x, value)| *x = *value);
            (direction != [0.0; 2] || creeps(friction)).then_some((number, direction))
        };
        frictions.filter_map(direction).collect()
    }

    /// What a contact that is closed presses with, and a friction behind the contacts may hold beyond what it holds.
    pub(super) fn left(&self, k: usize) -> f64 {
        let Some(number) = k.checked_sub(self.first_friction()) else { return self.normals[k] };
        let ([x, y], _) = self.holds[number];
        self.bound(k) - x.hypot(y)
    }

    /// What a contact that is closed presses with, and a friction behind the contacts may hold in all.
    pub(super) fn bound(&self, k: usize) -> f64 {
        let Some(number) = k.checked_sub(self.first_friction()) else { return self.normals[k] };
        let (_, limit) = self.holds[number];
        self.contacts.frictions()[number].contact.map_or(limit, |contact| limit * self.normals[contact])
    }

    /// The same of all that are closed and stick, which share what rigid bodies leave open: see [`Shares`](crate::analysis::Shares). Of
    /// those that have a part in that, it is what there is at least in the best of ways to share.
    pub(super) fn leave(&mut self, values: &mut [f64]) {
        let margins = self.share();
        for k in &self.closed {
            values[*k] = self.left(*k);
        }
        let Some(margins) = margins else { return };
        let first = self.first_friction();
        let (contacts, frictions) = self.shares.parts();
        let contacts = contacts.map(|(place, size)| (self.shares.contacts[place], size));
        let frictions = frictions.map(|(place, size)| (first + self.shares.frictions[place].0, size));
        for ((number, size), margin) in contacts.chain(frictions).zip(margins) {
            if let Some(margin) = margin {
                values[number] = margin / size;
            }
        }
    }

    /// Takes what is shared from here on, where contacts meet.
    pub(super) fn share_of(&mut self, meeting: &Meeting, pattern: &Pattern, speed: f64) {
        self.shares = meeting.shares(pattern, speed);
        self.shared = Shared {
            touching: meeting.touching.clone(),
            pattern: (!self.shares.is_empty()).then(|| pattern.clone()),
            left_out: Vec::new(),
            gradients: self.contacts.gradients(&meeting.touching),
        };
    }

    /// See [`Shares::leave_out`].
    fn leave_out(&mut self, contact: Option<usize>, friction: Option<usize>) {
        self.shared.left_out.push([contact, friction]);
        self.shares.leave_out(contact, friction);
    }

    /// Lets those that are closed and stick share what they hold. Gives the margin of each that has a part in it.
    fn share(&mut self) -> Option<Vec<Option<f64>>> {
        let Shares { contacts, frictions, .. } = &self.shares;
        // What acts is against the multipliers.
        let acts = |(number, _): &(usize, Option<usize>)| self.holds[*number].0.map(|x| -x);
        let forces = frictions.iter().map(acts).collect();
        // Where normal forces are not shared, the limits are known.
        let limit = |(number, shared): &(usize, Option<usize>)| {
            let (limit, known) = (self.holds[*number].1, shared.is_none());
            let contact = self.contacts.frictions()[*number].contact.filter(|_| known);
            contact.map_or(limit, |contact| limit * self.normals[contact])
        };
        let limits: Vec<f64> = frictions.iter().map(limit).collect();
        let mut found = Balance { normals: contacts.iter().map(|k| self.normals[*k]).collect(), forces };
        let (_, margins) = self.shares.choose(&mut found, &limits)?;
        contacts.iter().zip(&found.normals).for_each(|(k, normal)| self.normals[*k] = *normal);
        frictions.iter().zip(&found.forces).for_each(|((number, _), force)| self.holds[*number].0 = force.map(|x| -x));
        Some(margins)
    }

    /// What begins to slide or to stick: frictions by their numbers behind the contacts.
    pub(super) fn frictions_told(
        &self,
        (before, closed): (&[usize], &[usize]),
        (were, are): (&Sliding, &Sliding),
    ) -> Vec<(EventKind, usize)> {
        let first = self.first_friction();
        let sticks = closed.iter().filter(|k| **k >= first && !before.contains(k)).map(|k| (EventKind::Sticks, *k));
        let begins = |(number, [x, y]): &(usize, [f64; 2])| {
            let was = were.iter().find(|(other, _)| other == number);
            was.is_none_or(|(_, [u, v])| x * u + y * v < 0.0 || [*u, *v] == [0.0; 2])
        };
        let slides = are.iter().filter(|(number, _)| self.creep.speed_of(*number).is_none());
        let slides = slides.filter(|one| begins(one)).map(|(number, _)| (EventKind::Slides, first + number));
        sticks.chain(slides).collect()
    }
}

impl Simulation<'_> {
    /// Finds again at a state what is shared.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn share_anew(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let speed = self.speed();
        if self.touch.as_ref().is_none_or(|touch| touch.shared.pattern.is_none()) {
            return Ok(());
        }
        let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
        let velocities = self.layout.velocities_in(&inputs);
        let Some(touch) = &mut self.touch else { return Ok(()) };
        touch.contacts.look(&inputs, &velocities, self.formulation.sets())?;
        let Shared { touching, pattern, left_out, gradients } = &mut touch.shared;
        let now = touch.contacts.gradients(touching);
        let largest = now.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
        let is_turned = now.iter().zip(&*gradients).any(|(now, was)| (now - was).abs() > TURNS * largest);
        let Some(pattern) = pattern.as_ref().filter(|_| is_turned) else { return Ok(()) };
        let holds = &touch.holds;
        let creep = &touch.creep;
        let limit = |number: usize| (holds[number].1, true, creep.speed_of(number));
        let meeting = touch.contacts.meeting(touching, limit, &velocities)?;
        touch.shares = meeting.shares(pattern, speed);
        left_out.iter().for_each(|[contact, friction]| touch.shares.leave_out(*contact, *friction));
        *gradients = now;
        Ok(())
    }

    /// Those that slide now.
    pub(super) fn sliding(&self) -> Sliding {
        self.touch.as_ref().map_or_else(Vec::new, |touch| touch.sliding(&self.discrete))
    }

    /// Lets these slide, and no others.
    pub(super) fn let_slide(&mut self, sliding: &Sliding) {
        let still = NO_DIRECTION * self.tolerance * self.speed();
        let Some(touch) = &self.touch else { return };
        if touch.contacts.frictions().is_empty() {
            return;
        }
        for (number, friction) in touch.contacts.frictions().iter().enumerate() {
            let slides = sliding.iter().find(|(other, _)| *other == number);
            let creeps = slides.and_then(|_| touch.creep.speed_of(number));
            let direction = slides.filter(|_| creeps.is_none()).map_or([0.0; 2], |(_, found)| *found);
            let own = friction.direction_at..friction.direction_at + friction.rows.len();
            let behind = own.end;
            self.discrete[own].iter_mut().zip(direction).for_each(|(slot, x)| *slot = x);
            if friction.rows.len() > 1 {
                let size = touch.gradients[touch.first_friction() + number];
                self.discrete[behind] = creeps.map_or(still, |speed| -speed * size);
            }
        }
        self.tell_discrete();
    }

    /// Fails where a row that neither sticks nor slides moves after all.
    ///
    /// # Errors
    /// [`AnalysisError::Stirs`]; see [`AnalysisError`].
    pub(super) fn watch_idle(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let speed = self.speed();
        let Some(touch) = &mut self.touch else { return Ok(()) };
        if touch.idle.is_empty() {
            return Ok(());
        }
        let rates = touch.rates.at(self.formulation.as_mut(), &mut self.observed, t, state)?.to_vec();
        let mut first = 0;
        for (number, friction) in touch.contacts.frictions().iter().enumerate() {
            let own = &rates[first..first + friction.rows.len()];
            first += friction.rows.len();
            if touch.idle.contains(&number) && own.iter().any(|rate| rate.abs() > STIRS * speed) {
                return Err(AnalysisError::Stirs { row: touch.name(touch.first_friction() + number) });
            }
        }
        Ok(())
    }

    /// The limits of all of them at a state, or shares of the reactions of contacts.
    pub(super) fn limits(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(Vec::new()) };
        if touch.contacts.frictions().is_empty() {
            return Ok(Vec::new());
        }
        let limits = touch.limits.at(self.formulation.as_mut(), &mut self.observed, t, state)?.to_vec();
        let first = touch.first_friction();
        let is_none =
            |(k, limit): (usize, &f64)| (*limit < 0.0 || limit.is_nan()) && !touch.contacts.is_gone(first + k);
        match limits.iter().enumerate().position(is_none) {
            None => Ok(limits),
            Some(k) => Err(AnalysisError::Limit { row: touch.name(touch.first_friction() + k), value: limits[k] }),
        }
    }

    /// Those that are closed or stick, without what may hold nothing: a brake that is off.
    pub(in crate::session) fn closed_that_hold(&mut self, t: f64, state: &[f64]) -> Result<Vec<usize>, AnalysisError> {
        let limits = self.limits(t, state)?;
        let first = self.touch.as_ref().map_or(0, Touch::first_friction);
        let holds =
            |k: &usize| k.checked_sub(first).and_then(|number| limits.get(number)).is_none_or(|limit| *limit > 0.0);
        Ok(self.closed_contacts().iter().copied().filter(holds).collect())
    }

    /// A contact that was taken for closed is open: what depends on it neither sticks nor slides. Of rows that stick together, and whose
    /// shares rigid bodies do not determine, one that was given too large a share takes what it can.
    pub(in crate::session) fn release(&mut self, contact: usize, closed: &mut Vec<usize>) {
        closed.retain(|one| *one != contact);
        let mut sliding = self.sliding();
        let Some(touch) = &mut self.touch else { return };
        let first = touch.first_friction();
        if let Some(number) = contact.checked_sub(first) {
            let (held, _) = touch.holds[number];
            let size = held[0].hypot(held[1]);
            sliding.push((number, held.map(|x| x / size)));
            let contact = touch.contacts.frictions()[number].contact;
            touch.leave_out(contact, Some(number));
        } else {
            touch.leave_out(Some(contact), None);
            let frictions = touch.contacts.frictions().iter().enumerate();
            let own = frictions.filter(|(_, friction)| friction.contact == Some(contact)).map(|(number, _)| number);
            for number in own.collect::<Vec<_>>() {
                closed.retain(|one| *one != first + number);
                sliding.retain(|(other, _)| *other != number);
                touch.leave_out(Some(contact), Some(number));
            }
        }
        self.let_slide(&sliding);
    }
}
