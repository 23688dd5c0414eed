//! Element states along a prescribed motion: y' = f(t, y, q, v), with q and v those that joints and prescribed quantities have at t
//! with these y. They are integrated by the methods of runs.

use super::{Driven, cannot};
use crate::analysis::Evaluator;
use crate::integrate::{Accepted, Failure, Flow, Options, Span, Status, System, by_name};
use crate::plan::Layout;
use crate::prescribed::Derivatives;
use crate::program::{Equations, Expr, Node};
use crate::session::{Session, SessionError};

/// The method, and its relative tolerance.
const METHOD: &str = "auto";
const TOLERANCE: f64 = 1e-11;
/// Sizes below this, SI, and changes within this time, s, count as none.
const LEAST: f64 = 1e-12;
const MOMENT: f64 = 1e-3;

/// See the module documentation.
pub(super) struct States {
    /// Those that rows depend on, and loads where these matter; by number, ascending.
    numbers: Vec<usize>,
    rates: Evaluator,
    /// Whether their rates depend on where bodies are and how they move: otherwise the mechanism need not follow each stage.
    of_bodies: bool,
    /// Signals from outside that their rates depend on.
    signals: Vec<usize>,
    /// Largest size of each so far.
    sizes: Vec<f64>,
    /// The step that was taken last, s.
    pub(super) step: Option<f64>,
}

impl States {
    /// # Errors
    /// Rows or loads that depend on what changes only between steps, or on states whose rates a motion alone does not determine.
    pub(super) fn new(
        session: &Session,
        equations: &Equations,
        layout: &Layout,
        (what, loads): (&str, bool),
    ) -> Result<Self, SessionError> {
        let graph = &equations.graph;
        let model = &session.model;
        let mut open: Vec<Node> = Vec::new();
        for row in equations.rows.iter() {
            open.extend([row.value, row.time, row.gamma]);
            open.extend(row.jacobian.iter().map(|(_, slope)| *slope));
        }
        if loads {
            open.extend(&equations.loads);
        }
        let directions: Vec<usize> = (equations.frictions.iter())
            .flat_map(|one| (0..if one.rows.len() > 1 { 3 } else { 1 }).map(|k| one.direction_at + k))
            .collect();
        let carried: Vec<usize> = (graph.solved.iter())
            .flat_map(|solved| (0..solved.unknowns.len()).map(|k| solved.slot - layout.state_slot() + k))
            .collect();
        let (mut numbers, mut signals): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
        let (mut of_rates, mut of_bodies) = (false, false);
        loop {
            let mut next = Vec::new();
            for node in graph.live(&open) {
                let Expr::Input(slot) = graph.expr(node) else { continue };
                let slot = slot as usize;
                if (layout.state_slot()..layout.reference_slot()).contains(&slot) {
                    let state = slot - layout.state_slot();
                    if !carried.contains(&state) && !numbers.contains(&state) {
                        numbers.push(state);
                        next.push(equations.state_rates[state]);
                    }
                }
                of_bodies |= of_rates
                    && ((Layout::TIME + 1..layout.state_slot()).contains(&slot)
                        || (layout.reference_slot()..layout.discrete_slot()).contains(&slot)
                        || slot >= layout.acceleration_slot());
                if of_rates && slot >= layout.multiplier_slot() {
                    let element = layout.element_of_state(numbers[0]);
                    let message = format!(
                        "the state of `{}` changes with reactions of joints, which its motion does not determine by itself",
                        model.elements[element].name
                    );
                    return Err(cannot(session, message, "take an element without that state in its place, or a run"));
                }
                if let Some(input) = (0..model.inputs.len()).find(|input| layout.given_slot(*input) == slot)
                    && of_rates
                {
                    signals.push(input);
                }
                let Some(at) = slot.checked_sub(layout.discrete_slot()) else { continue };
                if at >= layout.given_at || directions.contains(&at) {
                    continue;
                }
                if let Some(one) = (0..model.elements.len()).find(|one| layout.discrete_of(*one).contains(&at)) {
                    let message = format!(
                        "{what} cannot tell what `{}` does: it has a memory that changes only between the steps of a run",
                        model.elements[one].name
                    );
                    let help = "take a driver, or an element without memory, in its place; or drive the scene and look at a run";
                    return Err(cannot(session, message, help));
                }
            }
            if next.is_empty() {
                break;
            }
            (open, of_rates) = (next, true);
        }
        numbers.sort_unstable();
        let rates: Vec<Node> = numbers.iter().map(|state| equations.state_rates[*state]).collect();
        let count = numbers.len();
        Ok(Self {
            rates: Evaluator::new(graph, &rates),
            numbers,
            of_bodies,
            signals,
            sizes: vec![0.0; count],
            step: None,
        })
    }
}

impl Driven<'_> {
    /// Names of the elements whose states are integrated.
    pub(crate) fn elements_with_states(&self) -> Vec<&str> {
        let element = |state: &usize| self.layout.element_of_state(*state);
        let mut elements: Vec<usize> = self.states.numbers.iter().map(element).collect();
        elements.dedup();
        elements.into_iter().map(|element| self.session.model.elements[element].name.as_str()).collect()
    }

    /// Whether a state among them changes with a signal from outside.
    pub(crate) fn states_follow(&self, input: usize) -> bool {
        self.states.signals.contains(&input)
    }

    /// Whether a value depends on what is not followed: other states, and memories of elements.
    pub(crate) fn leaves_open(&self, equations: &Equations, node: Node) -> bool {
        let layout = &self.layout;
        let followed = |state: usize| {
            let solved = equations.graph.solved.iter().map(|one| (one.slot - layout.state_slot(), one.unknowns.len()));
            self.states.numbers.contains(&state)
                || solved.clone().any(|(first, count)| (first..first + count).contains(&state))
        };
        let friction = |at: usize| {
            self.frictions.iter().any(|one| (one.direction_at..one.direction_at + one.rows.len() + 1).contains(&at))
        };
        equations.graph.live(&[node]).into_iter().any(|node| match equations.graph.expr(node) {
            Expr::Input(slot) if (layout.state_slot()..layout.reference_slot()).contains(&(slot as usize)) => {
                !followed(slot as usize - layout.state_slot())
            }
            Expr::Input(slot)
                if (layout.discrete_slot()..layout.discrete_slot() + layout.given_at).contains(&(slot as usize)) =>
            {
                !friction(slot as usize - layout.discrete_slot())
            }
            _ => false,
        })
    }

    /// What has to be known about states and contacts; `touched`: how many contacts were closed, least and most.
    pub(crate) fn say(&self, touched: Option<[usize; 2]>, notes: &mut Vec<String>) {
        let elements = self.elements_with_states();
        if !elements.is_empty() {
            notes.push(format!(
                "states of {} begin as the scene gives them, and are integrated along the motion",
                elements.join(", ")
            ));
        }
        let lean: Vec<String> = self.leans_on().iter().map(|contact| self.contact_name(*contact)).collect();
        if !lean.is_empty() {
            notes
                .push(format!("contacts that touch at the start hold the mechanism as joints do: {}", lean.join(", ")));
        }
        if let Some([least, most]) = touched.filter(|_| !self.equations.contacts.is_empty()) {
            let number = if least == most { least.to_string() } else { format!("{least} to {most}") };
            notes.push(format!("of {} contacts, {number} press", self.equations.contacts.len()));
        }
    }

    fn slots(&self) -> impl Iterator<Item = usize> + use<> {
        let first = self.layout.state_slot();
        self.states.numbers.clone().into_iter().map(move |state| first + state)
    }

    /// From where the mechanism is, in motion, to a later time.
    pub(crate) fn follow(&mut self, to: f64, wish: &dyn Fn(f64) -> Vec<Derivatives>) -> Result<(), String> {
        if self.states.numbers.is_empty() {
            return self.go(to, wish);
        }
        // A stretch on which the mechanism cannot be followed at once is divided.
        let begin = self.time();
        let mut stretch = to - begin;
        while self.time() < to {
            let next = if self.time() + stretch < to { self.time() + stretch } else { to };
            let (before, step) = (self.inputs.clone(), self.states.step);
            match self.stretch(next, wish) {
                Ok(()) => stretch *= 2.0,
                Err(reason) => {
                    (self.inputs, self.states.step) = (before, step);
                    stretch *= 0.25;
                    if stretch < super::SHORTEST * (to - begin) {
                        return Err(reason);
                    }
                }
            }
        }
        Ok(())
    }

    fn stretch(&mut self, to: f64, wish: &dyn Fn(f64) -> Vec<Derivatives>) -> Result<(), String> {
        let from = self.time();
        let mut y: Vec<f64> = self.slots().map(|slot| self.inputs[slot]).collect();
        let first_step = self.states.step.map(|step| step.min(to - from));
        let base = self.inputs.clone();
        let names = self.elements_with_states().join("`, `");
        let mut along = Along { driven: self, wish, base, reason: None };
        let options = Options { first_step, ..Options::default() };
        let span = Span { t_start: from, t_end: to, sample_times: &[] };
        let mut method = by_name(METHOD).ok_or("no method of integration")?;
        let done = method.integrate(&mut along, &mut y, &span, &options).map_err(|error| error.to_string())?;
        let Along { base, reason, .. } = along;
        match done.status {
            Status::Completed => self.with_states(&base, (to, &y), wish),
            Status::StoppedEarly { t, reason: stop } => {
                // What the mechanism says where it cannot be followed is worth more than a step size.
                let why = reason.unwrap_or_else(|| stop.to_string());
                Err(format!("the states of `{names}` are followed no further than t = {t} s: {why}"))
            }
        }
    }

    /// The mechanism at a time, from a place before it, with these states.
    fn with_states(
        &mut self,
        base: &[f64],
        (t, y): (f64, &[f64]),
        wish: &dyn Fn(f64) -> Vec<Derivatives>,
    ) -> Result<(), String> {
        self.inputs.copy_from_slice(base);
        for (slot, value) in self.slots().zip(y) {
            self.inputs[slot] = *value;
        }
        if t > self.time() {
            return self.go(t, wish);
        }
        let wished = wish(t);
        let values: Vec<f64> = wished.iter().map(|one| one[0]).collect();
        self.correct(&values, super::MISS)?;
        self.derive(&wished)
    }
}

/// The states as a system of differential equations.
struct Along<'a, 's> {
    driven: &'a mut Driven<'s>,
    wish: &'a dyn Fn(f64) -> Vec<Derivatives>,
    /// The mechanism at the last accepted state.
    base: Vec<f64>,
    /// Why it could not be followed last.
    reason: Option<String>,
}

impl Along<'_, '_> {
    fn go(&mut self, t: f64, y: &[f64]) -> Result<(), Failure> {
        if !self.driven.states.of_bodies {
            self.driven.inputs[Layout::TIME] = t;
            let slots: Vec<usize> = self.driven.slots().collect();
            slots.into_iter().zip(y).for_each(|(slot, value)| self.driven.inputs[slot] = *value);
            return Ok(());
        }
        self.driven.with_states(&self.base, (t, y), self.wish).map_err(|reason| {
            self.reason = Some(reason.clone());
            Failure::Recoverable(reason.into())
        })
    }
}

impl System for Along<'_, '_> {
    fn dim(&self) -> usize {
        self.driven.states.numbers.len()
    }

    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure> {
        self.go(t, y)?;
        let (states, sets) = (&mut self.driven.states, &self.driven.session.model.sets);
        let found = states.rates.run(&self.driven.inputs, sets).map_err(|error| Failure::Fatal(Box::new(error)))?;
        dy.copy_from_slice(found);
        if dy.iter().any(|rate| !rate.is_finite()) {
            return Err(Failure::NotFinite("a state has no finite rate".into()));
        }
        for (size, (y, rate)) in states.sizes.iter_mut().zip(y.iter().zip(dy.iter())) {
            *size = size.max(y.abs()).max(MOMENT * rate.abs());
        }
        Ok(())
    }

    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64 {
        let share = |k: usize| {
            let size = y0[k].abs().max(y1[k].abs()).max(self.driven.states.sizes[k]);
            error[k].abs() / (TOLERANCE * size + LEAST * TOLERANCE)
        };
        (0..error.len()).map(share).fold(0.0, f64::max)
    }

    fn tolerance(&self) -> Option<f64> {
        Some(TOLERANCE)
    }

    fn accept(&mut self, t: f64, y: &mut [f64]) -> Result<Accepted, Failure> {
        if self.driven.states.of_bodies {
            self.go(t, y)?;
            self.base.clone_from(&self.driven.inputs);
        }
        Ok(Accepted::Unchanged)
    }

    fn step_done(&mut self, _t: f64, _y: &[f64], h: f64) -> Flow {
        let step = &mut self.driven.states.step;
        *step = Some(step.map_or(h, |before| if h < 0.5 * before { 0.5 * before } else { h }));
        Flow::Continue
    }
}
