//! [`Search`]: the way to an equilibrium.

use nalgebra::{DMatrix, DVector};

use super::Audit;
use super::audit::PLACES;
use super::friction::{Grips, Held};
use crate::analysis::{Evaluator, Expansion, Freedom, Function, Local, Unknowns};
use crate::linear::rows_in_force;
use crate::moves;
use crate::plan::Layout;
use crate::program::{Equations, Node};
use crate::session::Session;

/// Longest displacement of a step, as a share of the scene's size, and largest turn, rad.
pub(super) const LONGEST: f64 = 0.1;
pub(super) const WIDEST: f64 = 0.2;
/// Steps to an equilibrium.
const MOST_STEPS: usize = 600;
/// How much longer a step may be than the one before.
pub(super) const GROWTH: f64 = 4.0;
/// So many steps in turn that are about as long as they may be go where nothing holds.
const ONWARD: usize = 50;
/// Share of the best so far below which a place is better.
const BETTER: f64 = 0.9;
/// Steps that are as long as they can be and gain nothing after which round-off is all that is left.
const MOST_IDLE: usize = 2;
/// The same of steps that are held short.
const MOST_HELD: usize = 60;
/// What must be met at last, in these.
pub(super) const GOOD: f64 = 100.0;
/// Violation of rows, as a share of the scene's size, that Newton steps continue from.
const ROWS: f64 = 1e-13;
/// The same that lets a place pass.
const MET: f64 = 1e-10;
/// Newton steps to the rows.
const CORRECTIONS: usize = 30;
/// How much more than all loads at the start, or where they begin, what is left may accelerate a body; beyond, loads have no limit near.
const SUDDEN: f64 = 1e3;
/// Sizes of the scene from its start at which bodies have left it.
const AWAY: f64 = 20.0;
/// Share of what was left that a step leaves where steps gain.
const GAINS: f64 = 0.3;
/// Closings and openings of contacts.
const MOST_CHANGES: usize = 60;
/// Share of the forces below which a closed contact does not pull.
const PULLS: f64 = 1e-9;

/// Where loads are in balance.
pub(super) struct Place {
    pub(super) inputs: Vec<f64>,
    pub(super) closed: Vec<usize>,
    pub(super) steps: usize,
    pub(super) audit: Audit,
    pub(super) not_unique: Vec<String>,
    pub(super) friction: Vec<Held>,
}

/// How a search ends.
enum Down {
    At(Place),
    /// These frictions do not hold where it would be.
    Slips(Vec<Held>),
}

/// What is known at a place.
pub(super) struct Look {
    pub(super) expansion: Expansion,
    pub(super) freedom: Freedom,
    /// Jacobian of the rows, then of those that mean nothing.
    pub(super) rows: usize,
    /// What is left on the bodies, six each.
    pub(super) left: DVector<f64>,
    /// Rates of the states.
    pub(super) rates: DVector<f64>,
}

/// See the module documentation.
pub(super) struct Search<'s> {
    pub(super) session: &'s Session,
    pub(super) layout: &'s Layout,
    pub(super) local: Local,
    pub(super) closed: Vec<usize>,
    /// Rows in force: contacts that are closed and, behind their numbers, frictions that stick.
    in_force: Vec<usize>,
    pub(super) grips: Grips,
    angles: Evaluator,
    gaps: Evaluator,
    unknowns: Unknowns,
    pub(super) length: f64,
}

impl<'s> Search<'s> {
    pub(super) fn new(session: &'s Session) -> Self {
        let layout = &session.plan.layout;
        let mut equations: Equations = session.equations.clone();
        let contacts = equations.contacts.clone();
        let gaps: Vec<Node> = contacts.iter().map(|contact| equations.stop_of(contact, layout)).collect();
        let length = session.assembly.scales.length;
        Self {
            angles: Evaluator::new(&equations.graph, &equations.angles),
            gaps: Evaluator::new(&equations.graph, &gaps),
            unknowns: Unknowns::new(&equations, &session.model, layout),
            local: Self::local(session, &[]),
            closed: Vec::new(),
            in_force: Vec::new(),
            grips: Grips::new(&equations),
            session,
            layout,
            length,
        }
    }

    fn local(session: &Session, closed: &[usize]) -> Local {
        let rows = rows_in_force(&session.equations, closed);
        let length = session.assembly.scales.length;
        Local::new(&session.equations, &session.model, &session.plan.layout, (&rows, length), &[])
    }

    pub(super) fn contact_name(&self, contact: usize) -> String {
        self.row_name(self.session.equations.contacts[contact].row)
    }

    pub(super) fn row_name(&self, row: usize) -> String {
        let (element, k) = self.layout.element_of_row(row);
        self.session.model.elements[element].row_name(k)
    }

    pub(super) fn close(&mut self, closed: Vec<usize>) {
        let first = self.session.equations.contacts.len();
        let sticking = self.grips.sticking(&closed).into_iter().map(|number| first + number);
        let in_force: Vec<usize> = closed.iter().copied().chain(sticking).collect();
        if self.in_force != in_force {
            self.local = Self::local(self.session, &in_force);
            self.in_force = in_force;
        }
        self.closed = closed;
    }

    /// Equilibrium from a place, which is brought to rest and to the rows first. With friction, what can stick does so where it
    /// is as far as its limits hold: those that do not are taken as none, and the search begins again.
    pub(super) fn from(
        &mut self,
        start: &[f64],
        with_friction: bool,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Place, String> {
        let mut inputs = start.to_vec();
        self.rest(&mut inputs);
        self.grip(&mut inputs, with_friction)?;
        let mut overcome: Vec<Held> = Vec::new();
        let mut unfinished = false;
        loop {
            let found = self.down(&inputs, progress);
            let sticking = !self.grips.sticking(&self.closed).is_empty();
            match found {
                Ok(Down::At(mut place)) => {
                    // Where nothing is left to hold, whatever grips does.
                    if unfinished {
                        let mut again = place.inputs.clone();
                        self.grip(&mut again, with_friction)?;
                        self.close(Vec::new());
                        if let Ok(Down::At(held)) = self.down(&again, progress) {
                            place = Place { steps: place.steps + held.steps, ..held };
                        }
                    }
                    place.friction.append(&mut overcome);
                    return Ok(place);
                }
                Ok(Down::Slips(slips)) => {
                    overcome.retain(|one| slips.iter().all(|other| other.name != one.name));
                    overcome.extend(slips);
                }
                // Found without friction first.
                Err(_) if sticking => {
                    self.grips.released.fill(true);
                    unfinished = true;
                }
                Err(reason) => return Err(reason),
            }
            // The rows in force change with those released, though the contacts may not.
            self.close(Vec::new());
        }
    }

    fn down(&mut self, start: &[f64], progress: &mut dyn FnMut(f64)) -> Result<Down, String> {
        let mut inputs = start.to_vec();
        let touching = self.gap_values(&inputs)?;
        let closed = (0..touching.len()).filter(|k| touching[*k] <= MET * self.length).collect();
        self.close(closed);
        self.project(&mut inputs)?;
        let begin = inputs.clone();
        let (mut changes, mut onward) = (0, 0);
        let mut size: Option<f64> = None;
        let (mut best, mut before) = (f64::INFINITY, 0.0);
        let (mut idle, mut held) = (0, 0);
        let mut look = self.look(&mut inputs)?;
        let mut fastest = look.rates.abs();
        let mut lively = 0.0;
        for steps in 0..MOST_STEPS {
            // At the first place where there are loads.
            if lively == 0.0 {
                lively = self.fastest(&look.expansion.sizes).map_or(0.0, |body| body.1);
            }
            fastest = fastest.sup(&look.rates.abs());
            let audit = self.audit(&look, &inputs, &fastest)?;
            let worst = audit.balance.max(audit.states);
            progress((1.0 - (worst.max(1.0)).log10() / 16.0).clamp(0.0, 1.0));
            if worst < BETTER * best {
                (best, idle, held) = (worst, 0, 0);
            }
            // Where nothing is gained any more, round-off is all that is left.
            let stuck = worst <= GOOD && (idle > MOST_IDLE || held > MOST_HELD);
            // Steps continue to round-off: soft directions are far from balance where loads are near it.
            let gains = worst < GAINS * before;
            before = worst;
            let step = if stuck || worst <= 1.0 && !gains { None } else { Some(self.step(&inputs, &look, size)) };
            let next = match step {
                Some(Err(why)) if worst > 1.0 => return Err(self.why(&look, &inputs, &why)),
                step => step.and_then(Result::ok),
            };
            let Some(next) = next else {
                let friction = self.held(&look, &mut inputs)?;
                if friction.iter().any(|one| !one.holds) {
                    return Ok(Down::Slips(friction.into_iter().filter(|one| !one.holds).collect()));
                }
                if let Some(pulling) = self.pulling(&look, &inputs) {
                    changes += 1;
                    if changes > MOST_CHANGES {
                        return Err("contacts open and close without end".into());
                    }
                    let closed = self.closed.iter().copied().filter(|one| *one != pulling).collect();
                    self.close(closed);
                    look = self.look(&mut inputs)?;
                    (size, best, idle, held) = (None, f64::INFINITY, 0, 0);
                    continue;
                }
                if let Some(body) = self.fastest(&look.left).filter(|body| body.1 > SUDDEN * lively) {
                    let name = &self.session.model.bodies[body.0].name;
                    return Err(format!("loads on `{name}` grow without limit where they would be in balance"));
                }
                if audit.rows > MET {
                    return Err(format!("the joints are violated by {:.1e} of the scene's size", audit.rows));
                }
                let not_unique = self.not_unique(&look);
                let closed = self.in_force.clone();
                return Ok(Down::At(Place { inputs, closed, steps, audit, not_unique, friction }));
            };
            (inputs, look) = (next.inputs, next.look);
            size = Some(next.size * GROWTH);
            *(if next.held { &mut held } else { &mut idle }) += 1;
            onward = if next.reach > 1.0 / GROWTH { onward + 1 } else { 0 };
            let gaps = self.gap_values(&inputs)?;
            let struck: Vec<usize> =
                (0..gaps.len()).filter(|k| gaps[*k] < -MET * self.length && !self.closed.contains(k)).collect();
            if !struck.is_empty() {
                changes += 1;
                if changes > MOST_CHANGES {
                    return Err("contacts open and close without end".into());
                }
                let mut closed = self.closed.clone();
                closed.extend(struck);
                closed.sort_unstable();
                self.close(closed);
                self.project(&mut inputs)?;
                look = self.look(&mut inputs)?;
                (size, best, idle, held) = (None, f64::INFINITY, 0, 0);
            }
            let away = |body: usize| {
                let at = self.layout.body_slot(body, 0);
                (0..3).map(|k| (inputs[at + k] - begin[at + k]).powi(2)).sum::<f64>().sqrt() > AWAY * self.length
            };
            if let Some(body) = (0..self.layout.bodies).find(|body| away(*body)) {
                let name = &self.session.model.bodies[body].name;
                return Err(format!(
                    "nothing holds `{name}`: it goes away further than {AWAY} times the size of the scene; if something weak holds it \
                     beyond, begin nearer to there"
                ));
            }
        }
        let mut reason = format!("loads are not in balance after {MOST_STEPS} steps");
        if onward >= ONWARD {
            reason += &format!(
                ", and the last {onward} went about as far as a step may ({LONGEST} of the size of the scene or {WIDEST} rad): what moves is held \
                 by nothing, or very far from here"
            );
        }
        Err(self.why(&look, &inputs, &reason))
    }

    pub(super) fn rest(&self, inputs: &mut [f64]) {
        moves::rest(self.layout, inputs);
    }

    pub(super) fn go(&self, inputs: &mut [f64], step: &DVector<f64>) {
        moves::go(self.layout, inputs, step);
    }

    fn count(&mut self, inputs: &mut [f64]) -> Result<(), String> {
        moves::count(self.layout, &mut self.angles, inputs)
    }

    fn gap_values(&mut self, inputs: &[f64]) -> Result<Vec<f64>, String> {
        Ok(self.gaps.run(inputs, &[]).map_err(|error| error.to_string())?.to_vec())
    }

    fn expansion(&mut self, inputs: &mut [f64]) -> Result<Expansion, String> {
        self.unknowns.solve(inputs, &self.session.model, false).map_err(|error| error.to_string())?;
        let found = self.local.at(inputs).map_err(|error| error.to_string())?;
        let finite = |of: Function| found.value(of).iter().all(|value| value.is_finite());
        if finite(Function::Balance) && finite(Function::Rows) && finite(Function::States) {
            Ok(found)
        } else {
            Err("a load, joint or state has no finite value on the way".into())
        }
    }

    /// Brings positions to the rows.
    pub(super) fn project(&mut self, inputs: &mut [f64]) -> Result<(), String> {
        let mut last = f64::INFINITY;
        let mut sticks = !self.grips.sticking(&self.closed).is_empty();
        for _ in 0..CORRECTIONS {
            let found = self.expansion(inputs)?;
            let rows = found.holonomic();
            let whole = found.jacobian();
            let jacobian = whole.select_rows(rows.iter());
            let values = found.value(Function::Rows).select_rows(rows.iter());
            let worst = moves::violation(&jacobian, &values, &found.scales).0 / self.length;
            if worst <= ROWS || worst >= 0.5 * last && worst <= MET {
                return Ok(());
            }
            // What sticks is not moved, unless joints cannot be met otherwise.
            sticks &= worst < 0.5 * last;
            last = worst;
            let step = if sticks {
                let held = self.sticking_rows(&whole);
                let free = Freedom::of(&held, &found.scales).map_err(|error| error.to_string())?.basis;
                let ones = DVector::from_element(free.ncols(), 1.0);
                &free * Freedom::shortest(&(&jacobian * &free), &ones, &-values).map_err(|error| error.to_string())?
            } else {
                Freedom::shortest(&jacobian, &found.scales, &-values).map_err(|error| error.to_string())?
            };
            self.go(inputs, &step);
        }
        Err(format!("the joints cannot be met on the way: they miss by {last:.1e} of the scene's size"))
    }

    /// What acts at a place, with the reactions that hold best there.
    pub(super) fn look(&mut self, inputs: &mut [f64]) -> Result<Look, String> {
        self.count(inputs)?;
        let mut found = self.expansion(inputs)?;
        let n = found.mass.nrows();
        let jacobian = found.jacobian();
        let rows = jacobian.nrows();
        let mut all = DMatrix::zeros(rows + found.idle.nrows(), n);
        all.rows_mut(0, rows).copy_from(&jacobian);
        all.rows_mut(rows, found.idle.nrows()).copy_from(&found.idle);
        let freedom = Freedom::of(&all, &found.scales).map_err(|error| error.to_string())?;
        for (k, rate) in found.value(Function::Rates).iter().enumerate() {
            let (element, _) = self.layout.element_of_row(self.local.rows()[k]);
            // Rows that follow states come to rest with these.
            let follows = self.session.model.elements[element].is_joint_with_states();
            if !found.holonomic().contains(&k) && !follows && rate.abs() > PLACES * self.length {
                let name = self.row_name(self.local.rows()[k]);
                return Err(format!("`{name}` prescribes a velocity: what it drives is never at rest"));
            }
        }
        // Loads may depend on reactions.
        for _ in 0..3 {
            let change = freedom.lift.transpose() * found.value(Function::Balance);
            for (k, row) in freedom.independent.iter().enumerate().filter(|(_, row)| **row < rows) {
                inputs[self.layout.multiplier_slot() + self.local.rows()[*row]] += change[k];
            }
            found = self.expansion(inputs)?;
        }
        let (left, rates) = (found.value(Function::Balance), found.value(Function::States));
        Ok(Look { expansion: found, freedom, rows, left, rates })
    }

    /// The body that loads would accelerate most alone, and how much, m/s^2; turns on the size of the scene.
    pub(super) fn fastest(&self, loads: &DVector<f64>) -> Option<(usize, f64)> {
        let of = |(index, body): (usize, &crate::model::Body)| {
            let force = loads.fixed_rows::<3>(6 * index).norm() / body.mass;
            let moment = loads.fixed_rows::<3>(6 * index + 3).norm() * self.length;
            // Particles have no rotation.
            (index, if body.inertia.trace() > 0.0 { force.max(3.0 * moment / body.inertia.trace()) } else { force })
        };
        self.session.model.bodies.iter().enumerate().map(of).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// A closed contact that pulls most.
    fn pulling(&self, look: &Look, inputs: &[f64]) -> Option<usize> {
        let size = look.expansion.sizes.amax();
        let pull = |contact: &usize| {
            let row = self.session.equations.contacts[*contact].row;
            let place = self.local.rows().iter().position(|one| *one == row)?;
            let slope = look.expansion.jacobian().row(place).norm();
            Some(inputs[self.layout.multiplier_slot() + row] * slope)
        };
        let worst = self.closed.iter().filter_map(|contact| pull(contact).map(|value| (*contact, value)));
        worst.filter(|(_, value)| *value > PULLS * size).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(contact, _)| contact)
    }
}
