//! [`Driven`]: a mechanism in which named quantities follow a wish: where its bodies are then, how fast, and how they accelerate.
//!
//! Each prescribed quantity y(q, t) is a row beside those of the joints, with exact derivatives. Positions solve Phi = 0, y = y*
//! by Newton's method; velocities Phi_q v = -Phi_t, y_q v = y*' - y_t; accelerations likewise with gamma (Haug 1989, ch. 3 and 9.2).
//! From one time to another it goes in steps that extrapolation by velocities and accelerations foresees: so it stays on its branch,
//! and passes dead points as a smooth motion does.
//!
//! | file | content |
//! |---|---|
//! | `driven/contacts.rs` | unilateral contacts: those that the motion leans on, and which touch on the way |
//! | `driven/states.rs` | element states that rows and loads depend on, integrated along the motion |

mod contacts;
mod states;

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::analysis::{Evaluator, Expansion, Freedom, Function, Local, Unknowns, start_inputs};
use crate::diagnostics::{Diagnostic, codes};
use crate::linear::{check_elements, refuse, rows_in_force};
use crate::moves;
use crate::plan::Layout;
use crate::prescribed::{Derivatives, Wanted};
use crate::program::{Equations, Friction};
use crate::session::{Session, SessionError};
use contacts::Contacts;
use states::States;

/// Violation of rows, as a share of the scene's size, that is round-off; that which passes where it gets no smaller.
const ROWS: f64 = 1e-14;
const MET: f64 = 1e-11;
/// The same for rates and accelerations, on the sizes of their terms.
const RATES: f64 = 1e-9;
/// Rates and accelerations below this share of the scene's size, per second, are round-off.
const LEAST: f64 = 1e-3;
/// Newton steps.
const CORRECTIONS: usize = 30;
/// Rows whose pivots are below this are next to a singular position, where positions are known to the root of round-off, and rates not at
/// all; and how far from that places are that are looked at instead, in sizes of the scene or rad.
const SINGULAR: f64 = 1e-5;
const BESIDE: f64 = 2e-3;
/// Longest step between two places, as a share of the scene's size or rad, and how far extrapolation may miss.
const LONGEST: f64 = 0.3;
const MISS: f64 = 0.01;
/// Share of a stretch below which it is not divided any more.
const SHORTEST: f64 = 1e-10;
/// Steps of less than this share of a stretch are a crawl, of which so many are made.
const CRAWL: f64 = 1e-6;
const MOST_CRAWLED: usize = 1000;
/// Speeds of sliding below this share of the scene's size per second are none.
const STILL: f64 = 1e-12;

/// See the module documentation.
pub(crate) struct Driven<'s> {
    pub(crate) session: &'s Session,
    /// The scene's layout with a row for each prescribed quantity at its end.
    pub(crate) layout: Layout,
    /// The equations with these rows.
    pub(crate) equations: Equations,
    /// The rows in force.
    pub(crate) rows: Rows,
    /// Those with other contacts closed, to come back to.
    other_rows: Vec<Rows>,
    /// Names of the prescribed quantities.
    pub(crate) names: Vec<String>,
    /// How many quantities are prescribed, and along how many others efforts act.
    counts: [usize; 2],
    pub(crate) length: f64,
    /// Time, positions, velocities, accelerations, multipliers.
    pub(crate) inputs: Vec<f64>,
    angles: Evaluator,
    sliding: Evaluator,
    frictions: Vec<Friction>,
    /// Frictions that stood still where they were looked at.
    pub(crate) still: Vec<bool>,
    unknowns: Unknowns,
    contacts: Contacts,
    states: States,
}

/// Rows in force: those of joints with some contacts closed, of prescribed quantities, and those along which efforts act.
pub(crate) struct Rows {
    /// The contacts, by their number.
    pub(crate) closed: Vec<usize>,
    pub(crate) local: Local,
    /// How many of the rows are those of joints.
    pub(crate) own: usize,
    /// How many are met: those of joints and of prescribed quantities. Further ones only say along what efforts act.
    pub(crate) held: usize,
}

/// What is wrong with a motion that is asked for.
pub(crate) fn cannot(session: &Session, message: String, help: &str) -> SessionError {
    refuse(session, Diagnostic::error(codes::NOT_THIS_MOTION, message).help(help))
}

impl Rows {
    fn new(
        session: &Session,
        equations: &Equations,
        layout: &Layout,
        closed: &[usize],
        [wanted, along]: [usize; 2],
    ) -> Self {
        let numbers = rows_in_force(equations, closed);
        let local = Local::new(equations, &session.model, layout, (&numbers, session.assembly.scales.length), &[]);
        let held = numbers.len() - along;
        Self { closed: closed.to_vec(), local, own: held - wanted, held }
    }
}

impl<'s> Driven<'s> {
    /// Of a scene, at its start, with quantities that are prescribed and others along which efforts act; `what` is done, in the
    /// plural; `loads`: what loads depend on matters, too.
    pub(crate) fn new(
        session: &'s Session,
        wanted: &[Wanted],
        along: &[Wanted],
        (what, loads): (&str, bool),
    ) -> Result<Self, SessionError> {
        check_elements(session, what)?;
        let model = &session.model;
        let mut layout = session.plan.layout.clone();
        let mut equations = session.equations.clone();
        for one in wanted.iter().chain(along) {
            let Some(row) = equations.prescribe(&one.quantity, model, &layout) else {
                let message = format!("`{}` cannot be prescribed: it is no function of positions alone", one.name);
                let help = "prescribe a coordinate of a joint or a position; their derivatives are the columns `name'` and `name''`";
                return Err(cannot(session, message, help));
            };
            Arc::make_mut(&mut equations.rows).push(row);
        }
        layout.rows += wanted.len() + along.len();
        let states = States::new(session, &equations, &layout, (what, loads))?;
        let contacts = Contacts::new(&mut equations, &layout);
        let length = session.assembly.scales.length;
        let counts = [wanted.len(), along.len()];
        let frictions = equations.frictions.clone();
        let rates: Vec<_> = frictions.iter().flat_map(|friction| friction.rates.iter().copied()).collect();
        Ok(Self {
            inputs: start_inputs(&layout, session.time_of_start(), &session.assembly),
            angles: Evaluator::new(&equations.graph, &equations.angles),
            sliding: Evaluator::new(&equations.graph, &rates),
            unknowns: Unknowns::new(&equations, model, &layout),
            still: vec![false; frictions.len()],
            rows: Rows::new(session, &equations, &layout, &[], counts),
            other_rows: Vec::new(),
            names: wanted.iter().map(|one| one.name.clone()).collect(),
            counts,
            frictions,
            contacts,
            states,
            session,
            layout,
            equations,
            length,
        })
    }

    /// Name of a row, by its place among those of [`Driven::local`].
    pub(crate) fn row_name(&self, place: usize) -> String {
        if place >= self.rows.own {
            return self.names[place - self.rows.own].clone();
        }
        let (element, k) = self.layout.element_of_row(self.rows.local.rows()[place]);
        self.session.model.elements[element].row_name(k)
    }

    pub(crate) fn time(&self) -> f64 {
        self.inputs[Layout::TIME]
    }

    /// The equations here, as far as the motion goes.
    pub(crate) fn expansion(&mut self) -> Result<Expansion, String> {
        self.expanded(true)
    }

    /// The equations here with all that acts.
    pub(crate) fn acting(&mut self) -> Result<Expansion, String> {
        self.expanded(false)
    }

    fn expanded(&mut self, rows_only: bool) -> Result<Expansion, String> {
        let model = &self.session.model;
        self.unknowns.solve(&mut self.inputs, model, rows_only).map_err(|error| error.to_string())?;
        let found = self.rows.local.at(&self.inputs).map_err(|error| error.to_string())?;
        let finite = |of: Function| found.value(of).iter().all(|value| value.is_finite());
        if finite(Function::Rows) && finite(Function::Rates) {
            Ok(found)
        } else {
            Err("a joint has no finite value on the way".into())
        }
    }

    /// The values of the prescribed quantities where the mechanism is.
    pub(crate) fn values(&mut self) -> Result<Vec<f64>, String> {
        let found = self.expansion()?;
        Ok(found.value(Function::Rows).rows(self.rows.own, self.names.len()).iter().copied().collect())
    }

    /// Largest of displacements, on the scene's size, and turns, rad.
    pub(crate) fn size(&self, step: &DVector<f64>) -> f64 {
        let part = |k: usize| if k % 6 < 3 { step[k].abs() / self.length } else { step[k].abs() };
        (0..step.len()).map(part).fold(0.0, f64::max)
    }

    /// Brings positions to the joints and to the wish. Gives how far that moved the bodies, at most so far.
    pub(crate) fn correct(&mut self, wish: &[f64], most: f64) -> Result<f64, String> {
        let mut last = f64::INFINITY;
        let mut moved = DVector::zeros(self.layout.velocities());
        for _ in 0..CORRECTIONS {
            moves::count(&self.layout, &mut self.angles, &mut self.inputs)?;
            let found = self.expansion()?;
            let rows = self.holonomic(&found);
            let mut values = found.value(Function::Rows);
            (0..wish.len()).for_each(|k| values[self.rows.own + k] -= wish[k]);
            let jacobian = found.jacobian().select_rows(rows.iter());
            let values = values.select_rows(rows.iter());
            let (worst, which) = moves::violation(&jacobian, &values, &found.scales);
            let worst = worst / self.length;
            if worst <= ROWS || worst >= 0.5 * last && worst <= MET {
                return Ok(self.size(&moved));
            }
            last = worst;
            let step = Freedom::shortest(&jacobian, &found.scales, &-values).map_err(|error| error.to_string())?;
            moved += &step;
            if self.size(&moved) > most || moved.iter().any(|part| !part.is_finite()) {
                return Err(format!("`{}` cannot be met near", self.row_name(rows[which])));
            }
            moves::go(&self.layout, &mut self.inputs, &step);
        }
        Err(format!("the joints and the prescribed motion miss each other by {last:.1e} of the scene's size"))
    }

    /// The rows that are met and constrain positions.
    fn holonomic(&self, found: &Expansion) -> Vec<usize> {
        found.holonomic().into_iter().filter(|row| *row < self.rows.held).collect()
    }

    /// All rows with those that mean nothing, and what they leave free.
    fn freedom(&self, found: &Expansion, rows: &[usize]) -> Result<Freedom, String> {
        let jacobian = found.jacobian();
        let n = jacobian.ncols();
        let mut all = DMatrix::zeros(rows.len() + found.idle.nrows(), n);
        all.rows_mut(0, rows.len()).copy_from(&jacobian.select_rows(rows.iter()));
        all.rows_mut(rows.len(), found.idle.nrows()).copy_from(&found.idle);
        Freedom::of(&all, &found.scales).map_err(|error| error.to_string())
    }

    /// What joints and prescribed quantities leave free at this place, in words.
    pub(crate) fn free(&mut self) -> Result<Option<String>, String> {
        let found = self.expansion()?;
        let freedom = self.freedom(&found, &self.holonomic(&found))?;
        if freedom.count() == 0 {
            return Ok(None);
        }
        Ok(Some(self.described(&freedom.basis.column(0).into_owned(), &found.scales)))
    }

    /// A motion in words: that of the body which takes part most.
    pub(crate) fn described(&self, motion: &DVector<f64>, scales: &DVector<f64>) -> String {
        let part = |at: usize| Vector3::new(motion[at], motion[at + 1], motion[at + 2]);
        let on = |at: usize| part(at).component_div(&scales.fixed_rows::<3>(at)).norm();
        let largest = (0..motion.len() / 3).max_by(|a, b| on(3 * a).total_cmp(&on(3 * b))).unwrap_or(0);
        let mut axis = part(3 * largest).try_normalize(0.0).unwrap_or_default();
        axis.iter_mut().filter(|entry| entry.abs() < 5e-4).for_each(|entry| *entry = 0.0);
        let name = &self.session.model.bodies[largest / 2].name;
        let verb = if largest % 2 == 0 { "moves along" } else { "turns about" };
        format!("`{name}` {verb} ({:.3}, {:.3}, {:.3})", axis.x, axis.y, axis.z)
    }

    /// Velocities and accelerations for the derivatives of the wish.
    pub(crate) fn derive(&mut self, wish: &[Derivatives]) -> Result<(), String> {
        for order in [1, 2] {
            let slot_of = |layout: &Layout, body: usize| match order {
                1 => layout.body_slot(body, 7),
                _ => layout.acceleration_slot() + 6 * body,
            };
            for body in 0..self.layout.bodies {
                let slot = slot_of(&self.layout, body);
                self.inputs[slot..slot + 6].fill(0.0);
            }
            let mut largest = 0.0_f64;
            for turn in 0..3 {
                let found = self.expansion()?;
                let mut left = match order {
                    1 => -found.value(Function::Rates),
                    _ => found.value(Function::Accelerations),
                };
                (0..wish.len()).for_each(|k| left[self.rows.own + k] += wish[k][order]);
                let rows: Vec<usize> = (0..self.rows.held).collect();
                let left = left.rows(0, self.rows.held).into_owned();
                let freedom = self.freedom(&found, &rows)?;
                if freedom.count() > 0 {
                    let motion = self.described(&freedom.basis.column(0).into_owned(), &found.scales);
                    let joints: Vec<usize> = (0..self.rows.own).collect();
                    let enough = wish.len() == 1 && self.freedom(&found, &joints)?.count() == 1;
                    return Err(match enough {
                        true => {
                            format!("what is prescribed is at a dead point, where it does not determine this: {motion}")
                        }
                        false => format!("joints, drivers and prescribed quantities leave this free: {motion}"),
                    });
                }
                let (miss, which) = moves::violation(&found.jacobian().select_rows(rows.iter()), &left, &found.scales);
                largest = largest.max(miss);
                if turn == 2 {
                    if miss > RATES * largest.max(LEAST * self.length) {
                        let what = if order == 1 { "speed" } else { "acceleration" };
                        return Err(format!(
                            "the {what} of `{}` cannot be had: the others determine it",
                            self.row_name(which)
                        ));
                    }
                    break;
                }
                let mut right = DVector::zeros(freedom.independent.len());
                for (k, row) in freedom.independent.iter().enumerate().filter(|(_, row)| **row < left.len()) {
                    right[k] = left[*row];
                }
                let change = &freedom.lift * right;
                match order {
                    1 => moves::hasten(&self.layout, &mut self.inputs, &change),
                    _ => moves::accelerate(&self.layout, &mut self.inputs, &change),
                }
            }
        }
        self.slide()
    }

    /// Frictions of their own limit act against the motion: their directions.
    fn slide(&mut self) -> Result<(), String> {
        let rates =
            self.sliding.run(&self.inputs, &self.session.model.sets).map_err(|error| error.to_string())?.to_vec();
        let mut rates = rates.as_slice();
        for (number, friction) in self.frictions.iter().enumerate() {
            let (own, rest) = rates.split_at(friction.rates.len());
            rates = rest;
            let speed = own.iter().map(|rate| rate * rate).sum::<f64>().sqrt();
            self.still[number] = speed <= STILL * self.length;
            for (k, rate) in own.iter().enumerate() {
                let slot = self.layout.discrete_slot() + friction.direction_at + k;
                self.inputs[slot] = if self.still[number] { 0.0 } else { rate / speed };
            }
        }
        Ok(())
    }

    /// Whether the mechanism is next to a singular position, in which it might as well move in another way.
    fn is_next_to_singular(&mut self) -> Result<bool, String> {
        let found = self.expansion()?;
        let rows: Vec<usize> = (0..self.rows.held).collect();
        Ok(self.freedom(&found, &rows)?.soundness < SINGULAR)
    }

    /// From where the mechanism is to the begin of a motion: along the straight line between both wishes, the time standing still.
    pub(crate) fn begin(&mut self, time: f64, wish: &[Derivatives]) -> Result<(), String> {
        moves::rest(&self.layout, &mut self.inputs);
        self.inputs[Layout::TIME] = time;
        self.lean(0)?;
        let from = self.values()?;
        let (mut done, mut step) = (0.0_f64, 1.0_f64);
        while done < 1.0 {
            let next = (done + step).min(1.0);
            let before = self.inputs.clone();
            let between: Vec<f64> = from
                .iter()
                .zip(wish)
                .map(|(from, to)| if next == 1.0 { to[0] } else { from + next * (to[0] - from) })
                .collect();
            match self.correct(&between, LONGEST) {
                Ok(_) => (done, step) = (next, 2.0 * step),
                Err(reason) => {
                    self.inputs = before;
                    step *= 0.5;
                    if step < SHORTEST {
                        return Err(format!(
                            "the begin of the motion cannot be reached from the scene's start: {reason}"
                        ));
                    }
                }
            }
        }
        self.derive(wish)
    }

    /// From where the mechanism is, in motion, to a later time, with the states that they have now.
    fn go(&mut self, to: f64, wish: &dyn Fn(f64) -> Vec<Derivatives>) -> Result<(), String> {
        let begin = self.time();
        let mut h = to - begin;
        let mut crawled = 0;
        while self.time() < to {
            let from = self.time();
            let next = if from + h < to { from + h } else { to };
            let step = next - from;
            let before = self.inputs.clone();
            let speeds = moves::velocities(&self.layout, &self.inputs);
            let ahead = speeds * step + moves::accelerations(&self.layout, &self.inputs) * (0.5 * step * step);
            let wished = wish(next);
            let values: Vec<f64> = wished.iter().map(|one| one[0]).collect();
            let size = self.size(&ahead);
            let reached = if size <= LONGEST {
                moves::go(&self.layout, &mut self.inputs, &ahead);
                self.inputs[Layout::TIME] = next;
                self.correct(&values, MISS).and_then(|_| self.derive(&wished))
            } else {
                Err(format!("bodies would move by {size:.1e} of the scene's size, or rad, in {step:.1e} s"))
            };
            let no_further = |reason: &str| {
                let what = "the motion leads no further: it meets a dead point here, or leaves what the joints allow";
                Err(format!("{what}: {reason}"))
            };
            match reached {
                Ok(()) => {
                    h = 2.0 * step;
                    crawled += usize::from(step < CRAWL * (to - begin));
                    // Next to a dead point what is hardly determined may move at any speed, and keep it.
                    if crawled > MOST_CRAWLED {
                        return no_further(&format!(
                            "bodies move by {size:.1e} of the scene's size, or rad, in {step:.1e} s"
                        ));
                    }
                }
                Err(reason) => {
                    self.inputs = before;
                    h = 0.5 * step;
                    if h < SHORTEST * (to - begin) {
                        return no_further(&reason);
                    }
                }
            }
        }
        Ok(())
    }
}

/// What is seen at a later time of a motion: next to a singular position that it passes, as a parallelogram does where its links are in
/// line, the limit from both sides, by a cubic through what is seen at two places before and two behind. `driven` is the mechanism
/// of `on`; it is at that time then, or a little later.
pub(crate) fn seen<'s, T>(
    on: &mut T,
    driven: &dyn Fn(&mut T) -> &mut Driven<'s>,
    (to, wish): (f64, &dyn Fn(f64) -> Vec<Derivatives>),
    look: &mut dyn FnMut(&mut T) -> Result<Vec<f64>, String>,
) -> Result<Vec<f64>, String> {
    let own = driven(on);
    let (from, before, step) = (own.time(), own.inputs.clone(), own.states.step);
    own.follow(to, wish)?;
    if !own.is_next_to_singular()? {
        return look(on);
    }
    (own.inputs, own.states.step) = (before, step);
    let speed = own.size(&moves::velocities(&own.layout, &own.inputs));
    let beside = (0.25 * (to - from)).min(BESIDE / speed.max(f64::MIN_POSITIVE));
    let mut limit: Vec<f64> = Vec::new();
    for (place, weight) in [(-2.0, -1.0), (-1.0, 4.0), (1.0, 4.0), (2.0, -1.0)] {
        driven(on).follow(to + place * beside, wish)?;
        let found = look(on)?;
        limit.resize(found.len(), 0.0);
        limit.iter_mut().zip(found).for_each(|(limit, found)| *limit += weight / 6.0 * found);
    }
    Ok(limit)
}
