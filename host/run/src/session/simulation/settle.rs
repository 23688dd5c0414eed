//! What happens to contacts at one instant: impacts, and which contacts are closed and which rows stick after them.

use nalgebra::DVector;

use super::Simulation;
use super::contacts::Touch;
use super::frictions::Sliding;
use super::levels::LEAST_TOUCHING;
use crate::analysis::{
    AnalysisError, ContactGap, Grip, Group, Holder, Indeterminate, Meeting, NoSolution, Pattern, Strike,
};

/// Rounds of impacts and contacts that close at one instant.
const MOST_ROUNDS: usize = 50;
/// How long after an instant, as a share of the time, a limit is looked at that may be falling through zero there.
const SOON: f64 = 1e-9;

/// Velocities that impacts change at an instant.
struct Jump {
    /// Six per body.
    velocities: Vec<f64>,
    /// What impulses have changed of them so far.
    change: Vec<f64>,
}

/// The frictions of a meeting.
fn numbers(meeting: &Meeting) -> Vec<usize> {
    meeting.grips.iter().map(|grip| grip.number).collect()
}

impl Simulation<'_> {
    /// Lets contacts strike and decides which are closed from here on, where all are open and nothing slides; `slid` did before.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn settle(&mut self, t: f64, state: &mut [f64], slid: &Sliding) -> Result<Vec<usize>, AnalysisError> {
        let mut strikes: Vec<Strike> = Vec::new();
        let mut slid = slid.clone();
        let mut grips: Vec<usize> = Vec::new();
        self.end_creeping(t);
        for round in 0..MOST_ROUNDS {
            let Some((mut meeting, mut jump)) = self.meeting(t, state)? else { return Ok(Vec::new()) };
            if meeting.touching.is_empty() && meeting.grips.is_empty() {
                self.report_events(t, &strikes, &[], (&slid, &Sliding::new()), 0.0)?;
                return Ok(Vec::new());
            }
            let stalled = self.touch.as_mut().and_then(|touch| touch.creep.take_stalled(t));
            if stalled.is_some_and(|number| self.let_creep(&meeting.coupled(number), t)) {
                continue;
            }
            let speed = self.speed();
            if round == 0 {
                meeting.turned(&mut slid, speed);
            }
            // What comes from no higher than round-off of places was never open: it closes together with what is.
            if round > 0 || !self.comes_from_nowhere(&meeting, speed) {
                self.strike(&mut meeting, speed)?;
            }
            let moving = std::mem::take(&mut meeting.shared);
            self.report_indeterminate(t, &meeting.touching, &Indeterminate { moving, ..Indeterminate::default() })?;
            self.give_velocities(t, state, &meeting, &mut jump)?;
            let accelerations = self.accelerations(t, state, &mut meeting)?;
            let mut pattern = self.pattern(&meeting, &accelerations, speed)?;
            while pattern.as_ref().is_some_and(|pattern| meeting.lets_move(pattern, &accelerations, speed)) {
                pattern = self.pattern(&meeting, &accelerations, speed)?;
            }
            match &pattern {
                Some(pattern) => meeting.come_to_rest(pattern, &accelerations, speed),
                None if meeting.seize(speed) || self.let_creep(&numbers(&meeting), t) => {}
                None => return Err(self.undecided(&meeting, &accelerations, speed)),
            }
            self.give_velocities(t, state, &meeting, &mut jump)?;
            if let Some(work) = state.last_mut() {
                *work += meeting.work;
            }
            self.audit.struck(0, meeting.strikes.iter().map(|strike| strike.lost).sum());
            strikes.append(&mut meeting.strikes);
            let Some(pattern) = pattern else { continue };
            let approaches = (0..meeting.touching.len()).any(|k| meeting.approaches(k, speed));
            grips = numbers(&meeting);
            if !approaches && !meeting.slides_back(&pattern, speed) {
                let gains = |number: usize| meeting.gain(number, &pattern, &accelerations);
                let mut creeping = self.chattering(t, (&meeting, &pattern), gains, &slid);
                if meeting.is_exhausted() {
                    creeping.extend(&grips);
                }
                if self.let_creep(&creeping, t) {
                    continue;
                }
                let closed = self.take_pattern(&meeting, &pattern, speed);
                self.report_events(t, &strikes, &closed, (&slid, &pattern.sliding), speed)?;
                let mut open = meeting.indeterminate(&pattern, &accelerations, speed).unwrap_or_default();
                open.moving.extend(pattern.several.iter().map(|k| Holder::Contact(*k)));
                self.report_indeterminate(t, &meeting.touching, &open)?;
                return Ok(closed);
            }
        }
        if self.let_creep(&grips, t) {
            return self.settle(t, state, &slid);
        }
        Err(self.endless(t, state))
    }

    /// Why contacts have no end of events at an instant, where all are open and nothing slides: where a limit becomes negative then, that.
    pub(super) fn endless(&mut self, t: f64, state: &[f64]) -> AnalysisError {
        if let Err(limit @ AnalysisError::Limit { .. }) = self.limits(t + SOON * t.abs(), state) {
            return limit;
        }
        self.look_again(t, state).unwrap_or_else(|error| error)
    }

    /// Why nothing is decided at a state.
    fn look_again(&mut self, t: f64, state: &[f64]) -> Result<AnalysisError, AnalysisError> {
        let Some((mut meeting, _)) = self.meeting(t, state)? else {
            return Ok(AnalysisError::NotSettled { rows: String::new() });
        };
        let accelerations = self.accelerations(t, state, &mut meeting)?;
        Ok(self.undecided(&meeting, &accelerations, self.speed()))
    }

    /// Contacts that touch at a state, and what holds up to a limit there.
    fn meeting(&mut self, t: f64, state: &[f64]) -> Result<Option<(Meeting, Jump)>, AnalysisError> {
        let (near, speed, same, length) = (self.near(), self.speed(), self.same(), self.scales.length_scale());
        let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
        let velocities = self.layout.velocities_in(&inputs);
        let limits = self.limits(t, state)?;
        let Some(touch) = &mut self.touch else { return Ok(None) };
        let gaps = touch.contacts.look(&inputs, &velocities, self.formulation.sets())?;
        touch.gradients = touch.contacts.sizes();
        let touches = |gap: &ContactGap| gap.touches(near, touch.instant);
        // Those that come as fast as the fastest that strikes, and are as near as places are known, strike with it.
        let relative = |gap: &ContactGap| gap.rate / gap.size;
        let striking = gaps.iter().filter(|gap| touches(gap) && gap.approaches(speed));
        let fastest = striking.min_by(|a, b| relative(a).total_cmp(&relative(b)));
        let comes = |gap: &ContactGap| fastest.is_some_and(|fastest| gap.comes_with(fastest, same * speed));
        let strikes = |gap: &ContactGap| gap.apart() <= same * length && comes(gap);
        let touching: Vec<usize> = (0..gaps.len()).filter(|k| touches(&gaps[*k]) || strikes(&gaps[*k])).collect();
        let first = touch.first_friction();
        let (told, creep) = (&touch.told, &touch.creep);
        let limit = |number: usize| (limits[number], told.contains(&(first + number)), creep.speed_of(number));
        let mut meeting = touch.contacts.meeting(&touching, limit, &velocities)?;
        meeting.still = same;
        let change = vec![0.0; velocities.len()];
        Ok(Some((meeting, Jump { velocities, change })))
    }

    /// Whether those that approach come from no height that is known, by what weighs and has pressed on them.
    fn comes_from_nowhere(&self, meeting: &Meeting, speed: f64) -> bool {
        let Some(touch) = &self.touch else { return false };
        let pressed = meeting.acceleration_by(|contact| touch.pressed.of(contact));
        let (height, contacts) = (LEAST_TOUCHING * self.scales.length_scale(), touch.contacts.contacts());
        // What bounces bounces off again, however slowly it comes.
        let falls = |k: usize| !contacts[k].of_velocities && contacts[k].restitution == 0.0;
        meeting.comes_from_below(height, [speed, touch.gravity.max(pressed)], falls)
    }

    /// Lets those that approach strike.
    fn strike(&self, meeting: &mut Meeting, speed: f64) -> Result<(), AnalysisError> {
        let name = |touching: &[usize], k: usize| self.switching_name(touching[k]);
        meeting.strike_all(speed, self.same()).map_err(|problem| match problem {
            NoSolution::Pulls(k) => AnalysisError::Pulls { row: name(&meeting.touching, k) },
            NoSolution::Undecided(k) => AnalysisError::NotSettled { rows: name(&meeting.touching, k) },
        })?;
        let mut stuck = (0..meeting.touching.len()).filter(|k| !meeting.gives_way(*k));
        match stuck.any(|k| meeting.approaches(k, speed)).then(|| self.jammed(meeting)).flatten() {
            Some(jammed) => Err(jammed),
            None => Ok(()),
        }
    }

    /// A contact that nothing gives way to.
    fn jammed(&self, meeting: &Meeting) -> Option<AnalysisError> {
        let found = (0..meeting.touching.len()).find(|k| !meeting.gives_way(*k));
        found.map(|k| AnalysisError::Jammed { row: self.switching_name(meeting.touching[k]) })
    }

    fn switching_name(&self, k: usize) -> String {
        self.touch.as_ref().map_or_else(String::new, |touch| touch.name(k))
    }

    /// The accelerations of all rows with all contacts open, at the velocities after impacts.
    fn accelerations(&mut self, t: f64, state: &[f64], meeting: &mut Meeting) -> Result<DVector<f64>, AnalysisError> {
        let inputs = self.formulation.observe(t, state, true)?.inputs.to_vec();
        let slot = self.layout.acceleration_slot();
        let found = &inputs[slot..slot + self.layout.velocities()];
        let Some(touch) = &mut self.touch else { return Ok(DVector::zeros(0)) };
        let gammas = touch.contacts.gammas(&inputs, self.formulation.sets())?;
        let unit = |k: usize| if k % 6 < 3 { 1.0 } else { self.scales.length };
        let largest = found.iter().enumerate().map(|(k, a)| (a * unit(k)).abs()).fold(touch.gravity, f64::max);
        let pressed = |contact: usize| touch.pressed.of(contact);
        Ok(meeting.accelerations((found, gammas), &touch.weights, pressed, largest))
    }

    /// Which contacts are closed and what sticks and slides, if there is but one such choice.
    ///
    /// # Errors
    /// [`AnalysisError::Paradox`].
    fn pattern(
        &self,
        meeting: &Meeting,
        accelerations: &DVector<f64>,
        speed: f64,
    ) -> Result<Option<Pattern>, AnalysisError> {
        let Some(touch) = &self.touch else { return Ok(None) };
        let height = self.same() * self.scales.length_scale();
        let contacts = touch.contacts.contacts();
        let pattern = meeting.closed(accelerations, [speed, height], |k| !contacts[k].of_velocities);
        match meeting.paradox(speed).filter(|_| pattern.is_some()) {
            Some(k) => Err(AnalysisError::Paradox { row: touch.name(meeting.touching[k]) }),
            None => Ok(pattern),
        }
    }

    /// Why nothing was decided.
    fn undecided(&self, meeting: &Meeting, accelerations: &DVector<f64>, speed: f64) -> AnalysisError {
        if let Some(jammed) = self.jammed(meeting) {
            return jammed;
        }
        let name = |k: usize| self.switching_name(meeting.touching[k]);
        if let Some(k) = meeting.pulling(accelerations, speed) {
            return AnalysisError::Pulls { row: name(k) };
        }
        if let Some(k) = meeting.paradox(speed) {
            return AnalysisError::Paradox { row: name(k) };
        }
        let first = self.touch.as_ref().map_or(0, Touch::first_friction);
        let frictions = meeting.grips.iter().map(|grip| first + grip.number);
        let rows = meeting.touching.iter().copied().chain(frictions).map(|k| self.switching_name(k));
        AnalysisError::NotSettled { rows: rows.collect::<Vec<_>>().join(", ") }
    }

    /// Takes over what was decided. Gives what is closed and sticks.
    fn take_pattern(&mut self, meeting: &Meeting, pattern: &Pattern, speed: f64) -> Vec<usize> {
        let is_idle = |grip: &&Grip| {
            let acts = grip.contact.is_none_or(|contact| pattern.closed.contains(&contact));
            let slides = pattern.sliding.iter().any(|(number, _)| *number == grip.number);
            acts && !slides && !pattern.sticking.contains(&grip.number)
        };
        let mut closed: Vec<usize> = pattern.closed.iter().map(|k| meeting.touching[*k]).collect();
        if let Some(touch) = &mut self.touch {
            closed.extend(pattern.sticking.iter().map(|number| touch.first_friction() + number));
            closed.sort_unstable();
            touch.idle = meeting.grips.iter().filter(is_idle).map(|grip| grip.number).collect();
            touch.undecided_of(meeting, pattern);
            touch.share_of(meeting, pattern, speed);
        }
        self.let_slide(&pattern.sliding);
        closed
    }

    /// Gives a state the velocities after impulses: those of bodies meet the rows that always hold, flexible ones follow.
    fn give_velocities(
        &mut self,
        t: f64,
        state: &mut [f64],
        meeting: &Meeting,
        jump: &mut Jump,
    ) -> Result<(), AnalysisError> {
        let change = meeting.change();
        let rest: Vec<f64> = change.iter().zip(&jump.change).map(|(now, was)| now - was).collect();
        jump.velocities.iter_mut().zip(&rest).for_each(|(v, change)| *v += change);
        jump.change = change;
        let mut working = self.working_state(t, state)?;
        let (bodies, states) = working.split_at_mut(13 * self.layout.bodies);
        for (y, v) in bodies.chunks_exact_mut(13).zip(jump.velocities.chunks_exact(6)) {
            y[7..13].copy_from_slice(v);
        }
        if let Some(touch) = &self.touch {
            touch.contacts.flexible_jumps(&rest).for_each(|(k, jump)| states[k] += jump);
        }
        let mut found = state.to_vec();
        self.formulation.state_of(&working, &mut found);
        for ((value, found), group) in state.iter_mut().zip(found).zip(self.formulation.groups()) {
            if matches!(group, Group::Velocity | Group::AngularVelocity | Group::State) {
                *value = found;
            }
        }
        Ok(())
    }
}
