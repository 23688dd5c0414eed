//! Unilateral rows during a run: where steps must end, and which rows are enforced from then on. What happens there: `settle.rs`.

use super::creep::Creep;
use super::frictions::{Shared, Sliding};
use super::latched::Latched;
use super::levels::{Pressed, TOUCHING};
use super::releases::Releases;
use super::speeds::Speeds;
use super::watch::RowValues;
use super::{Part, Simulation};
use crate::analysis::{AnalysisError, Constraints, Contacts, Counters, Formulation, Shares};
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Equations, Node};
use crate::results::{Event, EventKind};

/// Equations that are kept beside those in use.
const MOST_MODES: usize = 64;

/// How exactly times are known, as a share of them: what moves fast is not located to round-off of its position.
pub(super) const INSTANT: f64 = 64.0 * f64::EPSILON;
/// The same of the time that steps lead up to: no step is smaller than 10/16 of that.
const LAST_INSTANT: f64 = 16.0 * f64::EPSILON;
/// Height below which bouncing is none, as a share of the size of the scene, where the tolerance is smaller.
pub(super) const LOW: f64 = 1e-10;
/// How deep a contact may be at the start, as a share of the size of the scene.
const DEEP: f64 = 1e-9;
/// The same after a step, beyond which it was not seen that a contact closed.
const PASSED: f64 = 1e-6;
/// Instants with events that follow each other without time advancing.
const MOST_AT_ONCE: u32 = 50;

/// The equations with a choice of closed contacts.
pub(in crate::session) struct Mode {
    /// Numbers of the contacts that are closed, ascending; behind those of contacts, of frictions that stick.
    pub(in crate::session) closed: Vec<usize>,
    pub(in crate::session) formulation: Box<dyn Formulation>,
    pub(in crate::session) rows: Constraints,
    /// See [`Equations::pressing`]; of what is closed.
    pub(in crate::session) pressing: Option<Part>,
    /// Whether a Jacobian was offered.
    pub(in crate::session) has_jacobian: bool,
}

/// The contacts of a scene.
pub(super) struct Touch {
    pub(super) contacts: Contacts,
    /// Element and row of each; then of each friction.
    pub(super) names: Vec<(String, String)>,
    /// Of all elements.
    elements: Vec<String>,
    /// Those that are closed now, ascending.
    pub(super) closed: Vec<usize>,
    /// Whether the equations in use offer a Jacobian, and those are to that are taken next.
    has_jacobian: bool,
    wants_jacobian: bool,
    /// Those that were closed when events were reported last.
    pub(super) told: Vec<usize>,
    /// Loads that were reported as open: see [`Simulation::open_loads`].
    pub(super) open_loads: Vec<usize>,
    /// Equations that were in use, and are not now, each with the values of its rows; the last ones last.
    others: Vec<(Mode, Option<RowValues>)>,
    /// Work of those that are not to be used any more.
    past: Counters,
    /// Joints that may let go.
    pub(super) releases: Releases,
    /// The value of each contact; of rows on velocities the rate.
    open: Part,
    /// The speed of each friction in the direction of sliding.
    speeds: Speeds,
    /// See [`Equations::pressing`]; of what is closed now.
    pressing: Option<Part>,
    /// The limit of each friction.
    pub(super) limits: Part,
    /// The rates of their rows.
    pub(super) rates: Part,
    /// Those that neither stick nor slide, since others determine how they move.
    pub(super) idle: Vec<usize>,
    /// What frictions that stick share.
    pub(super) shares: Shares,
    /// What that was found of.
    pub(super) shared: Shared,
    /// What each contact presses with, where it was looked last.
    pub(super) normals: Vec<f64>,
    /// What each friction holds, and what it may hold, or which share of the reaction of its contact, where it was looked last.
    pub(super) holds: Vec<([f64; 2], f64)>,
    /// See [`Contacts::sizes`]; those at the last event.
    pub(super) gradients: Vec<f64>,
    /// What each of these may not fall below, and what it is typically like.
    pub(super) levels: Vec<f64>,
    pub(super) sizes: Vec<f64>,
    /// What contacts have pressed with.
    pub(super) pressed: Pressed,
    /// Frictions that creep.
    pub(super) creep: Creep,
    /// Below what force of each of these nothing is decided by it, where they met last.
    pub(super) undecided: Vec<f64>,
    /// By these: what of them has to do with each other has one number, where they met last.
    pub(super) parts: Vec<usize>,
    /// Size of gravity, m/s^2, and the weights of bodies, six each.
    pub(super) gravity: f64,
    pub(super) weights: Vec<f64>,
    /// Time of the last event, how exactly that is known, s, and how many there were before it at the same time.
    met_at: f64,
    pub(super) instant: f64,
    pub(super) at_once: u32,
}

impl Touch {
    /// `None` where a scene has none.
    pub(super) fn new(
        equations: &mut Equations,
        model: &Model,
        layout: &Layout,
        formulation: &dyn Formulation,
        length: f64,
    ) -> Result<Option<Self>, AnalysisError> {
        if !equations.switches_rows() {
            return Ok(None);
        }
        let contacts = equations.contacts.clone();
        let values: Vec<Node> = contacts.iter().map(|contact| equations.stop_of(contact, layout)).collect();
        let frictions = equations.frictions.clone();
        let speeds: Vec<Node> = frictions.iter().map(|friction| equations.sliding_speed(friction, layout)).collect();
        let rates: Vec<Node> = frictions.iter().flat_map(|friction| friction.rates.iter().copied()).collect();
        let limits: Vec<Node> = frictions.iter().map(|friction| friction.limit).collect();
        let name = |row: usize| {
            let (element, k) = layout.element_of_row(row);
            (model.elements[element].name.clone(), model.elements[element].row(k).to_string())
        };
        Ok(Some(Self {
            names: equations.switching_rows().map(name).collect(),
            elements: model.elements.iter().map(|element| element.name.clone()).collect(),
            closed: Vec::new(),
            has_jacobian: false,
            wants_jacobian: false,
            told: Vec::new(),
            open_loads: Vec::new(),
            others: Vec::new(),
            past: Counters::default(),
            releases: Releases::new(equations, model, layout, formulation),
            open: Part::near(formulation, equations, &values, layout),
            speeds: Speeds::new(formulation, equations, &speeds),
            pressing: None,
            limits: Part::near(formulation, equations, &limits, layout),
            rates: Part::near(formulation, equations, &rates, layout),
            idle: Vec::new(),
            shares: Shares::default(),
            shared: Shared::default(),
            normals: vec![0.0; contacts.len()],
            holds: vec![([0.0; 2], 0.0); frictions.len()],
            gradients: vec![1.0; contacts.len() + frictions.len()],
            levels: vec![0.0; contacts.len() + frictions.len()],
            sizes: vec![1.0; contacts.len() + frictions.len()],
            contacts: Contacts::new(equations, model, layout, length)?,
            pressed: Pressed::default(),
            creep: Creep::default(),
            undecided: vec![0.0; contacts.len() + frictions.len()],
            parts: vec![0; contacts.len() + frictions.len()],
            gravity: model.gravity.norm(),
            weights: weights(model),
            met_at: f64::NAN,
            instant: 0.0,
            at_once: 0,
        }))
    }

    /// The values of contacts, and behind them the speeds of frictions in their directions, at a state; `inputs` is room for those of
    /// the working form.
    fn open_values(
        &mut self,
        formulation: &mut dyn Formulation,
        inputs: &mut Vec<f64>,
        discrete: &[f64],
        (t, state): (f64, &[f64]),
        values: &mut [f64],
    ) -> Result<(), AnalysisError> {
        let (values, speeds) = values.split_at_mut(self.first_friction());
        values.copy_from_slice(self.open.at(formulation, inputs, t, state)?);
        let frictions = self.contacts.frictions();
        self.speeds.at(formulation, inputs, (frictions, discrete), (t, state), speeds)
    }

    pub(super) fn counters(&self) -> Counters {
        self.others.iter().fold(self.past, |sum, (mode, _)| sum + mode.formulation.counters())
    }

    /// Whether something was met at this time.
    pub(super) fn was_met_at(&self, t: f64) -> bool {
        self.met_at == t
    }

    /// What is met next is not met once more.
    pub(super) fn forget_meeting(&mut self) {
        self.met_at = f64::NAN;
    }

    /// Drops equations that are not in use.
    pub(super) fn forget_modes(&mut self) {
        self.past = self.counters();
        self.others.clear();
        self.idle.clear();
        (self.shares, self.shared) = Default::default();
    }

    /// The programs of its own and of equations that are not in use.
    pub(super) fn used(&mut self) -> Vec<crate::program::Used<'_>> {
        let mut list: Vec<_> =
            self.open.used().chain(self.speeds.used()).chain(self.limits.used()).chain(self.rates.used()).collect();
        list.extend(self.releases.used());
        list.push(self.contacts.used());
        list.extend(self.pressing.iter_mut().flat_map(Part::used));
        for (mode, _) in &mut self.others {
            list.extend(mode.formulation.programs());
            list.extend(mode.pressing.iter_mut().flat_map(Part::used));
        }
        list
    }

    /// Something that happened to a contact, a friction behind the contacts, or an element behind these.
    pub(super) fn event(&self, time: f64, kind: EventKind, k: usize) -> Event {
        let element = || (self.elements[k - self.names.len()].clone(), String::new());
        let (element, row) = self.names.get(k).cloned().unwrap_or_else(element);
        Event { time, element, row, kind, rates: [0.0; 2], impulse: 0.0, lost: 0.0 }
    }

    pub(super) fn name(&self, contact: usize) -> String {
        let (element, row) = &self.names[contact];
        format!("{element}: {row}")
    }
}

/// Forces and torques of gravity on the bodies, six each.
fn weights(model: &Model) -> Vec<f64> {
    let weight = |body: &crate::model::Body| {
        let force = body.own_mass() * model.gravity;
        [force.x, force.y, force.z, 0.0, 0.0, 0.0]
    };
    model.bodies.iter().flat_map(weight).collect()
}

impl Simulation<'_> {
    /// Number of quantities that must not become negative.
    pub(super) fn stop_count(&self) -> usize {
        let count =
            |touch: &Touch| touch.levels.len() + touch.releases.count() + usize::from(touch.creep.is_possible());
        let of_touch = self.touch.as_ref().map_or(0, count);
        of_touch + self.latched.as_ref().map_or(0, Latched::count)
    }

    /// Their values.
    pub(super) fn stop_values(&mut self, t: f64, y: &[f64], values: &mut [f64]) -> Result<(), AnalysisError> {
        let jumps = self.latched.as_ref().map_or(0, Latched::count);
        let (values, jumps) = values.split_at_mut(values.len() - jumps);
        self.left_until_jumps(t, y, jumps)?;
        let Some(touch) = &mut self.touch else { return Ok(()) };
        let (values, left) = values.split_at_mut(touch.levels.len());
        let (left, creeps) = left.split_at_mut(touch.releases.count());
        creeps.fill(touch.creep.left(t));
        if touch.closed.len() < values.len() {
            touch.open_values(self.formulation.as_mut(), &mut self.observed, &self.discrete, (t, y), values)?;
        }
        let first = touch.first_friction();
        if let Some(pressing) = &mut touch.pressing {
            let found = pressing.at(self.formulation.as_mut(), &mut self.observed, t, y)?;
            touch.pressed.note(&touch.closed, first, found);
            touch.normals.copy_from_slice(&found[..first]);
            for (own, [limit, x, y]) in touch.holds.iter_mut().zip(found[first..].as_chunks().0) {
                *own = ([*x, *y], *limit);
            }
            self.share_anew(t, y)?;
        }
        let Some(touch) = &mut self.touch else { return Ok(()) };
        if !touch.closed.is_empty() {
            touch.leave(values);
        }
        for (value, (level, size)) in values.iter_mut().zip(touch.levels.iter().zip(&touch.sizes)) {
            *value = (*value - level) / size;
        }
        for (k, value) in values.iter_mut().enumerate().filter(|(k, _)| touch.contacts.is_gone(*k)) {
            (*value, touch.levels[k], touch.sizes[k]) = (1.0, 0.0, 1.0);
        }
        self.left_until_release(t, y, left)
    }

    /// Fails where an open contact is on the wrong side after a step, whatever the method should have done.
    ///
    /// # Errors
    /// [`AnalysisError::Passed`].
    pub(super) fn watch_contacts(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(()) };
        let mut values = vec![0.0; touch.levels.len()];
        touch.open_values(self.formulation.as_mut(), &mut self.observed, &self.discrete, (t, state), &mut values)?;
        if self.passed(&values).is_some() {
            // The gradients are those of the last meeting, and may have been next to nothing there: what is in the middle of a hollow
            // is as far from its wall on all sides.
            let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
            let Some(touch) = &mut self.touch else { return Ok(()) };
            touch.contacts.look(&inputs, &self.layout.velocities_in(&inputs), self.formulation.sets())?;
            touch.gradients = touch.contacts.sizes();
        }
        if let Some(passed) = self.passed(&values) {
            return Err(passed);
        }
        let least = self.same() * self.scales.length_scale();
        if let Some(touch) = &mut self.touch {
            let first = touch.first_friction();
            let speeds = values[first..].iter().zip(&touch.gradients[first..]).map(|(rate, size)| rate / size);
            touch.creep.note(t, speeds, least);
        }
        self.limits(t, state)?;
        self.watch_idle(t, state)
    }

    /// An open contact that is on the wrong side.
    fn passed(&self, values: &[f64]) -> Option<AnalysisError> {
        let touch = self.touch.as_ref()?;
        let sizes = [self.scales.length, self.speed()];
        let is_off = |k: &usize| !touch.closed.contains(k) && !touch.contacts.is_gone(*k);
        let is_passed = |k: &usize| values[*k] < -PASSED * touch.size_of(*k, sizes) && is_off(k);
        let found = (0..values.len()).find(is_passed);
        found.map(|k| AnalysisError::Passed { row: touch.name(k), value: values[k] })
    }

    /// Whether steps end where something happens: rows that come and go, memories that jump.
    pub(in crate::session) fn has_events(&self) -> bool {
        self.touch.is_some() || self.latched.is_some()
    }

    /// Whether there are unilateral rows.
    pub(in crate::session) fn has_contacts(&self) -> bool {
        self.touch.is_some()
    }

    /// Fails where a contact starts on the wrong side.
    ///
    /// # Errors
    /// [`AnalysisError::Penetrates`].
    pub(in crate::session) fn examine_contacts(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
        let Some(touch) = &mut self.touch else { return Ok(()) };
        let velocities = self.layout.velocities_in(&inputs);
        let gaps = touch.contacts.look(&inputs, &velocities, self.formulation.sets())?;
        let deepest = gaps.iter().enumerate().min_by(|a, b| a.1.apart().total_cmp(&b.1.apart()));
        match deepest {
            Some((k, gap)) if gap.apart() < -DEEP * self.scales.length => {
                let (element, row) = touch.names[k].clone();
                Err(AnalysisError::Penetrates { element, row, value: gap.value })
            }
            _ => Ok(()),
        }
    }

    /// Whether contacts that touch at a state approach, or slide although they cannot.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn strikes_at(&mut self, t: f64, state: &[f64]) -> Result<bool, AnalysisError> {
        let inputs = self.formulation.observe(t, state, false)?.inputs.to_vec();
        let (near, instant, speed) = (self.near(), INSTANT * t.abs(), self.speed());
        let Some(touch) = &mut self.touch else { return Ok(false) };
        let gaps = touch.contacts.look(&inputs, &self.layout.velocities_in(&inputs), self.formulation.sets())?;
        Ok(gaps.iter().any(|gap| gap.touches(near, instant) && (gap.approaches(speed) || gap.grips(speed))))
    }

    /// What happens to the contacts at an accepted state of a run that goes up to a time, s: impacts change its velocities. Gives those that
    /// are closed from here on.
    ///
    /// # Errors
    /// [`AnalysisError::NotSettled`]; see [`AnalysisError`].
    pub(in crate::session) fn meet(
        &mut self,
        (t, to): (f64, f64),
        state: &mut [f64],
    ) -> Result<Vec<usize>, AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(Vec::new()) };
        touch.at_once = if touch.met_at == t { touch.at_once + 1 } else { 0 };
        touch.met_at = t;
        touch.instant = (INSTANT * t.abs()).max(LAST_INSTANT * to.abs());
        touch.pressed.meet(touch.at_once > 0);
        self.note_changes(t, state)?;
        let Some(touch) = &mut self.touch else { return Ok(Vec::new()) };
        let (before, beyond) = (touch.closed.clone(), touch.at_once.saturating_sub(MOST_AT_ONCE));
        let stuck: Vec<usize> = before.iter().filter_map(|k| k.checked_sub(touch.first_friction())).collect();
        // Everything is said from where all contacts are open, and nothing slides.
        let slid = self.sliding();
        self.let_slide(&Sliding::new());
        self.adopt(&[], t, state)?;
        let all: Vec<usize> = slid.iter().map(|(number, _)| *number).chain(stuck).collect();
        // What does not creep yet does from here on; once, what does is tried without.
        let goes_on = beyond == 0 || self.let_creep(&all, t) || (beyond == 1 && self.try_without_creeping(t));
        let result = if goes_on { self.settle(t, state, &slid) } else { Err(self.endless(t, state)) };
        if result.is_err() {
            self.let_slide(&slid);
            self.adopt(&before, t, state)?;
        }
        result
    }

    /// Takes note of how far the rates of what touches and slides are known where they meet, by how these changed until then.
    fn note_changes(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let inputs = self.formulation.observe(t, state, true)?.inputs.to_vec();
        let slot = self.layout.acceleration_slot();
        let accelerations = &inputs[slot..slot + self.layout.velocities()];
        let Some(touch) = &mut self.touch else { return Ok(()) };
        let instant = (touch.instant, touch.at_once > 0);
        touch.contacts.note_changes((&inputs, accelerations), self.formulation.sets(), instant)
    }

    /// Reports what happened at an instant.
    pub(super) fn report_events(
        &mut self,
        t: f64,
        strikes: &[crate::analysis::Strike],
        closed: &[usize],
        (slid, sliding): (&Sliding, &Sliding),
        speed: f64,
    ) -> Result<(), AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(()) };
        let before = std::mem::replace(&mut touch.told, closed.to_vec());
        let event = |kind: EventKind, k: usize| touch.event(t, kind, k);
        let mut events = Vec::new();
        let least = TOUCHING * TOUCHING * TOUCHING;
        let counts = |strike: &&crate::analysis::Strike| {
            // What cannot slide may be made to at the start, without an approach.
            strike.rates[0] < -least * speed || strike.lost > least * self.largest_kinetic
        };
        for strike in strikes.iter().filter(counts) {
            let rates = strike.rates;
            let (impulse, lost) = (strike.impulse, strike.lost);
            events.push(Event { rates, impulse, lost, ..event(EventKind::Impact, strike.contact) });
        }
        self.audit.struck(events.len() as u64, 0.0);
        let first = touch.first_friction();
        let now = |k: &&usize| **k < first;
        events.extend(closed.iter().filter(now).filter(|k| !before.contains(k)).map(|k| event(EventKind::Closes, *k)));
        events.extend(before.iter().filter(now).filter(|k| !closed.contains(k)).map(|k| event(EventKind::Opens, *k)));
        let frictions = touch.frictions_told((&before, closed), (slid, sliding));
        events.extend(frictions.into_iter().map(|(kind, k)| event(kind, k)));
        let creep = touch.creep.untold();
        events.extend(creep.into_iter().map(|number| touch.event(t, EventKind::Creeps, first + number)));
        self.send(&events)
    }

    /// Those that are closed.
    pub(in crate::session) fn closed_contacts(&self) -> &[usize] {
        self.touch.as_ref().map_or(&[], |touch| &touch.told)
    }

    /// The largest reactions that they have given lately.
    pub(super) fn pressed(&self) -> Pressed {
        self.touch.as_ref().map_or_else(Pressed::default, |touch| touch.pressed.clone())
    }

    /// Which frictions creep, and what is known of how they change.
    pub(super) fn creep(&self) -> Creep {
        self.touch.as_ref().map_or_else(Creep::default, |touch| touch.creep.clone())
    }

    /// Those that were closed where the run was left, what they had pressed with, and which frictions crept.
    pub(in crate::session) fn contacts_were(&mut self, closed: &[usize], pressed: &Pressed, creep: &Creep) {
        if let Some(touch) = &mut self.touch {
            touch.told = closed.to_vec();
            touch.pressed = pressed.clone();
            if touch.creep.is_possible() {
                touch.creep = creep.clone();
            }
        }
    }

    /// Frictions that change over and over creep from here on, the start of the run: where steps have error control.
    pub(in crate::session) fn may_creep(&mut self, began: f64) {
        if let Some(touch) = &mut self.touch
            && touch.contacts.frictions().iter().any(|friction| friction.rows.len() > 1)
        {
            touch.creep = Creep::of(touch.contacts.frictions().len(), began);
        }
    }

    /// Whether equations with closed contacts are to offer a Jacobian from here on.
    pub(in crate::session) fn want_jacobian(&mut self, wanted: bool) {
        if let Some(touch) = &mut self.touch {
            touch.wants_jacobian = wanted;
        }
    }

    /// Takes the equations in which these contacts are closed, if they are at hand, with a Jacobian if that is wanted.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn adopt(&mut self, closed: &[usize], t: f64, state: &[f64]) -> Result<bool, AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(true) };
        let wanted = touch.wants_jacobian;
        let fits = |own: &[usize], has_jacobian| own == closed && (closed.is_empty() || has_jacobian == wanted);
        if fits(&touch.closed, touch.has_jacobian) {
            return Ok(true);
        }
        let Some(place) = touch.others.iter().position(|(mode, _)| fits(&mode.closed, mode.has_jacobian)) else {
            return Ok(false);
        };
        let (mode, values) = touch.others.remove(place);
        let working = self.working_state(t, state)?;
        self.change(mode, values, &working);
        Ok(true)
    }

    /// Takes other equations; `working` is where it is.
    fn change(&mut self, mode: Mode, values: Option<RowValues>, working: &[f64]) {
        let Mode { closed, mut formulation, rows, pressing, has_jacobian } = mode;
        let mut sets = Vec::new();
        self.formulation.trade_sets(&mut sets);
        formulation.trade_sets(&mut sets);
        let Some(touch) = &mut self.touch else { return };
        let was = Mode {
            closed: std::mem::replace(&mut touch.closed, closed),
            formulation: std::mem::replace(&mut self.formulation, formulation),
            rows: std::mem::replace(&mut self.rows, rows),
            pressing: std::mem::replace(&mut touch.pressing, pressing),
            has_jacobian: std::mem::replace(&mut touch.has_jacobian, has_jacobian),
        };
        touch.others.push((was, std::mem::replace(&mut self.values, values)));
        // Frictions of many joints stick in ever other combinations.
        if touch.others.len() > MOST_MODES {
            let (oldest, _) = touch.others.remove(0);
            touch.past = touch.past + oldest.formulation.counters();
        }
        self.row_right.resize(self.rows.rows.len(), 0.0);
        self.formulation.forget(working);
        self.formulation.bound_corrections(self.most_off);
        self.tell_discrete();
        self.remedies = self.formulation.counters().remedies();
    }

    /// Brings an accepted state to the rows that are enforced now, and takes note of it.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn bring_to_rows(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        self.formulation.project(t, state)?;
        self.formulation.next_step(t, state)
    }

    /// The opaque elements, to be given back by [`Simulation::take_mode`].
    pub(in crate::session) fn lend_sets(&mut self) -> Vec<Box<dyn element_api::ElementSet>> {
        let mut sets = Vec::new();
        self.formulation.trade_sets(&mut sets);
        sets
    }

    /// See [`Simulation::lend_sets`].
    pub(in crate::session) fn return_sets(&mut self, mut sets: Vec<Box<dyn element_api::ElementSet>>) {
        self.formulation.trade_sets(&mut sets);
    }

    /// Takes equations that were not at hand, which hold the opaque elements.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn take_mode(
        &mut self,
        mut mode: Mode,
        equations: &Equations,
        t: f64,
        state: &[f64],
    ) -> Result<(), AnalysisError> {
        let mut sets = Vec::new();
        mode.formulation.trade_sets(&mut sets);
        self.formulation.trade_sets(&mut sets);
        let working = self.working_state(t, state)?;
        self.change(mode, None, &working);
        self.watch_rows_left_out(equations, t, state)?;
        Ok(())
    }
}
