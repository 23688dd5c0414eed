//! [`Formulation`]: what a way of writing the equations of motion offers to a simulation.

use element_api::set::Fault;

use super::balance::Imbalance;
use super::evaluator::Evaluator;
use super::joint_engines::Look;
use super::solved::SolvedProgram;
use crate::linalg::LinalgError;
use crate::program::{Equations, Graph, Node, Used};

/// Takes the entries of a matrix one by one: row, column, value.
pub(super) type Entries<'a> = &'a mut dyn FnMut(usize, usize, f64);

/// What one entry of the state vector is; error control scales each group by its own size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Position of a centre of mass, m.
    Position,
    /// Euler parameter.
    Parameter,
    /// Velocity, m/s.
    Velocity,
    /// Angular velocity, rad/s, or rate of an Euler parameter, 1/s.
    AngularVelocity,
    /// State of an element.
    State,
    /// Work done by everything without a potential, J; watched, not controlled.
    Work,
}

/// Magnitudes of the entries of a state that are angular velocities, rad/s.
pub(super) fn angular_velocities(groups: &[Group], state: &[f64]) -> impl Iterator<Item = f64> {
    groups.iter().zip(state).filter(|(group, _)| **group == Group::AngularVelocity).map(|(_, rate)| rate.abs())
}

/// Work done so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Evaluations of the right side.
    pub evaluations: u64,
    /// Factorisations of the system for accelerations and multipliers; those for samples included.
    pub factorisations: u64,
    /// Factorisations reused because position and time had not changed.
    pub reused: u64,
    /// Evaluations for which the rank-safe engine was called in.
    pub rank_safe: u64,
    /// Newton corrections of positions.
    pub position_corrections: u64,
    /// Evaluations brought to the constraints first, because the rows in use get close to dependent.
    pub stage_projections: u64,
    /// Evaluations and projections next to a singular position, by interpolation between places on both sides of it.
    pub interpolated: u64,
    /// States refused because rows that followed from others at the start contradict them there; counted by the simulation.
    pub contradictions: u64,
    /// Iterations for forces that depend on accelerations and reactions.
    pub coupling_iterations: u64,
}

impl Counters {
    /// How often a rank-safe solution or a passage stood in for a plain solution.
    #[must_use]
    pub fn remedies(&self) -> u64 {
        self.rank_safe + self.interpolated
    }
}

impl std::ops::Add for Counters {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            evaluations: self.evaluations + other.evaluations,
            factorisations: self.factorisations + other.factorisations,
            reused: self.reused + other.reused,
            rank_safe: self.rank_safe + other.rank_safe,
            position_corrections: self.position_corrections + other.position_corrections,
            stage_projections: self.stage_projections + other.stage_projections,
            interpolated: self.interpolated + other.interpolated,
            contradictions: self.contradictions + other.contradictions,
            coupling_iterations: self.coupling_iterations + other.coupling_iterations,
        }
    }
}

/// Roughly the operations that work takes, on the scale of dense linear algebra (some 1 ns each).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// [`Formulation::rates`].
    pub rates: f64,
    /// [`Formulation::jacobian`], if there are exact derivatives.
    pub jacobian: Option<f64>,
    /// Writing them down, before the first.
    pub preparation: f64,
}

/// What can go wrong while an analysis runs.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The linear algebra gave up.
    #[error("{0}")]
    Linalg(#[from] LinalgError),
    /// An opaque element failed.
    #[error("element set {set}, instance {}: {}", fault.instance, fault.message)]
    Element {
        /// Which set of the model.
        set: usize,
        /// What it did.
        fault: Fault,
    },
    /// Forces that depend on reactions or accelerations have no solution together with them that was found.
    #[error(
        "forces that depend on reactions or accelerations (friction, inertia of elements, signals) were not found together with them: \
         there may be no solution, or several, as with too much friction (Painleve)"
    )]
    NoCommonSolution,
    /// A torque acts on a point mass.
    #[error("a torque acts on the particle `{body}`, which has no rotation to take it")]
    TorqueOnParticle {
        /// The particle.
        body: String,
    },
    /// A torque acts about an axis without moment of inertia.
    #[error("a torque acts about an axis of `{body}` about which it has no moment of inertia")]
    TorqueOnThin {
        /// The body.
        body: String,
    },
    /// A result is not a finite number.
    #[error("{what} is not a finite number")]
    NotFinite {
        /// What was computed.
        what: String,
    },
    /// What was asked for lies next to a position where the constraints lose rank, and is interpolated instead.
    #[error("the constraints lose rank there (singular position)")]
    NextToSingular,
    /// Internal unknowns that no values were found for.
    #[error("`{element}`: its internal unknown `{unknown}` is not found: {why}")]
    Unsolved {
        /// The element's name.
        element: String,
        /// The unknown's name, or its number.
        unknown: String,
        /// Why.
        why: &'static str,
    },
    /// Whoever takes the results of a run refuses them.
    #[error("{message}")]
    Told {
        /// Why.
        message: String,
    },
    /// A unilateral row is negative at the start.
    #[error("`{element}` is unilateral, and its row `{row}` is {value:.3e} at the start (SI units): on the wrong side")]
    Penetrates {
        /// Its name.
        element: String,
        /// The row's name.
        row: String,
        /// Its value, m or rad.
        value: f64,
    },
    /// A step that did not end where a contact closed.
    #[error("`{row}` is unilateral, and is {value:.3e} (SI units) after a step that should have ended where it closes")]
    Passed {
        /// Element and row.
        row: String,
        /// Its value, m or rad; its rate, if it is a row on velocities.
        value: f64,
    },
    /// A contact that other joints drive on.
    #[error("`{row}` closes, but joints and drivers determine how it moves, and nothing can give way")]
    Jammed {
        /// Element and row.
        row: String,
    },
    /// A limit that is not one.
    #[error("the limit up to which `{row}` holds is {value:.3e} (SI units): it must not be negative")]
    Limit {
        /// Element and row.
        row: String,
        /// Its value.
        value: f64,
    },
    /// A row that stood still without a share of the forces has begun to move.
    #[error(
        "`{row}` stood still, with other joints and drivers determining how it moves, so that what it holds is not determined; now it \
         moves: start it with an acceleration, or give what drives it some elasticity"
    )]
    Stirs {
        /// Element and row.
        row: String,
    },
    /// Friction at a contact without a solution, or with several.
    #[error(
        "`{row}` slides with so much friction that its reaction has no value, or several (Painleve): give it less friction, or a \
         stiffness (`bump-stop`)"
    )]
    Paradox {
        /// Element and row of the contact.
        row: String,
    },
    /// A rough contact without a solution.
    #[error(
        "`{row}` is rough: in order not to slide it would have to pull, and if it slid it would be pressed; give it `mu` in \
         place of `rough`"
    )]
    Pulls {
        /// Element and row of the contact.
        row: String,
    },
    /// Impacts that do not come to an end, or contacts that are neither open nor closed.
    #[error(
        "the contacts {rows} do not settle: impacts at one instant without end, or no set of closed contacts that only \
         push and of rows that stick and slide; give them less friction, or a stiffness (`bump-stop`)"
    )]
    NotSettled {
        /// Elements and rows.
        rows: String,
    },
    /// Memories that jump without end.
    #[error(
        "what {elements} keeps jumps back and forth at one instant without end: what it switches drives its own signal back at once. \
         Give it bounds that are further apart, or let what it switches act through a lag"
    )]
    Flutters {
        /// Names of the elements.
        elements: String,
    },
    /// Rows that were left out because they followed from others do so no longer.
    #[error(
        "joints contradict each other: equations that followed from others at the start do so no longer: {what} is off by \
         {violation:.1e} of the scene's size"
    )]
    Contradiction {
        /// Joints and rows.
        what: String,
        /// The worst violation, as a share of the scene's length.
        violation: f64,
    },
    /// What stands in for a plain solution does not meet the equations that it stands for.
    #[error("{remedy} misses the equations that it stands for: {what} by {share:.1e} of what it is made of")]
    Uncertified {
        /// Which remedy.
        remedy: &'static str,
        /// The constraint, or the balance that is missed worst.
        what: String,
        /// By how much, as a share of the sum of the magnitudes of its terms.
        share: f64,
    },
    /// Functions of time carry the mechanism into a position beyond which they cannot be met.
    #[error(
        "{drives} asks for more than can be reached: the mechanism is carried into a singular position (it is stretched, or a joint is bent \
         to its end), beyond which {what} cannot be met, and speeds grow without limit towards it; drive it less far, change lengths, \
         or let a force move it that may give way (a servo, an actuator)"
    )]
    OutOfReach {
        /// Joints and rows that depend on time, the first the most to blame.
        drives: String,
        /// Joint and row.
        what: String,
    },
    /// Positions could not be brought back to the constraints.
    #[error("the constraints can no longer be met: {what} is off by {violation:.1e} of the scene's size")]
    LeftConstraints {
        /// Joint and row.
        what: String,
        /// Share of the scene's length.
        violation: f64,
    },
}

/// The motion at one instant, in working coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Observed<'a> {
    /// The inputs of every program, accelerations and multipliers included.
    pub inputs: &'a [f64],
    /// How well they meet the equations of motion; zero where that is not looked at.
    pub imbalance: Imbalance,
}

/// What a solution of forces that depend on accelerations and reactions starts from; `None`: from nothing.
pub(super) type Guess = Option<Vec<f64>>;

/// What a formulation has learned so far, as far as it shows in what it does next and in the work that it counts.
#[derive(Debug, Clone, Default)]
pub struct Traces {
    /// Own, and in coordinates of bodies beside those of joints.
    pub(super) guesses: [Guess; 2],
    /// The same.
    pub(super) counters: [Counters; 2],
    /// How the engine in joint coordinates was found last, and whether it is trusted.
    pub(super) look: Option<(Look, bool)>,
}

/// A way of writing the equations of motion. States are plain slices; `dim` numbers each.
pub trait Formulation: Send {
    /// Short name for reports.
    fn name(&self) -> &'static str;
    /// Whether the state is that of joints, not of bodies.
    fn is_joint(&self) -> bool {
        false
    }
    /// What each entry of the state vector is.
    fn groups(&self) -> &[Group];
    /// The state for positions and velocities in working coordinates (per body r, p, v, omega'; then element states; then
    /// work).
    fn state_of(&mut self, working: &[f64], state: &mut [f64]);
    /// Forgets all that it learned on the way. What it does next depends on time, state and [`Formulation::set_discrete`] alone,
    /// as at the start; `working` is where it is, as [`Formulation::state_of`] takes it. To be called between steps.
    fn forget(&mut self, working: &[f64]);
    /// Angle references, discrete element states and signals from outside, which stay as they are during a step.
    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]);
    /// The rates of the state. `[hot, no allocation]`
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError>;
    /// Brings positions and velocities back to the constraints, moving as little as possible in the metric of the mass.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError>;
    /// Refuses from now on to bring positions back that are off by more than this share of the scene's size: after a step with
    /// error control that is no error of the step, but a row that jumps.
    fn bound_corrections(&mut self, share: f64) {
        let _ = share;
    }
    /// Whether there is nothing that states could be off: [`Formulation::project`] leaves them as they are.
    fn is_free(&self) -> bool {
        false
    }
    /// Accepted states from one look at the violation of all rows to the next. More than one where most rows hold by the
    /// choice of coordinates, and projection judges the others at every step.
    fn states_per_audit(&self) -> u64 {
        1
    }
    /// Whether projection may leave rows to themselves that followed from others at the start.
    fn leaves_rows_out(&self) -> bool {
        false
    }
    /// Prepares for a step from an accepted state.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn next_step(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let _ = (t, state);
        Ok(())
    }
    /// Where a remedy was called in, examines whether the rates of a state on the constraints meet the equations: what a
    /// rank-safe solution or a passage through a singular position gives is put into them.
    ///
    /// # Errors
    /// [`AnalysisError::Uncertified`], and what [`Formulation::rates`] fails with.
    fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let _ = (t, state);
        Ok(())
    }
    /// Everything a report may ask for at this state. With `dynamics`, accelerations and multipliers too.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError>;
    /// Nodes of the working form written in the formulation's own inputs, in a graph of their own; `None` where they can't be.
    fn carry(&self, equations: &Equations, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        let _ = (equations, nodes);
        None
    }
    /// A program of such nodes; `None` where there is none. It is run by [`Formulation::run_own`], and takes the place of
    /// [`Formulation::observe`] with a program of the working form.
    fn own_program(&self, equations: &Equations, nodes: &[Node]) -> Option<Evaluator> {
        let _ = (equations, nodes);
        None
    }
    /// A program of nodes that need accelerations or multipliers, in the formulation's own inputs; `None` where there is none. It
    /// is run by [`Formulation::run_solved`].
    fn solved_program(&self, equations: &Equations, nodes: &[Node]) -> Option<SolvedProgram> {
        let _ = (equations, nodes);
        None
    }
    /// Runs such a program at a state, and gives how well the equations of motion hold; `None` where that is better done by way of
    /// [`Formulation::observe`]. `[hot, no allocation]`
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn run_solved(
        &mut self,
        t: f64,
        state: &[f64],
        program: &mut SolvedProgram,
    ) -> Result<Option<Imbalance>, AnalysisError> {
        let _ = (t, state, program);
        Ok(None)
    }
    /// The accelerations of the bodies at a state, six each, to about 1e-8 of the largest: for what is asked once, no program is worth
    /// its writing. `None` where that is better done by way of [`Formulation::observe`].
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn accelerations(&mut self, t: f64, state: &[f64]) -> Result<Option<Vec<f64>>, AnalysisError> {
        let _ = (t, state);
        Ok(None)
    }
    /// What it has learned; see [`Formulation::forget_since`].
    fn traces(&self) -> Traces {
        Traces::default()
    }
    /// What was asked for since leaves no trace in what follows, nor in the work that is counted.
    fn forget_since(&mut self, traces: &Traces) {
        let _ = traces;
    }
    /// The entry of the state that an input of programs is a copy of, if it is one; see [`Formulation::written_in_state`].
    fn entry_of(&self, slot: usize) -> Option<usize> {
        let _ = slot;
        None
    }
    /// The rate, rad/s, that no angle between two bodies exceeds at a state.
    fn turning(&self, state: &[f64]) -> f64 {
        // Two bodies, three components each.
        2.0 * 3.0_f64.sqrt() * angular_velocities(self.groups(), state).fold(0.0, f64::max)
    }
    /// Nodes of the working form in a graph whose inputs are copies of the state ([`Formulation::entry_of`]), of time and of what
    /// stays as it is during a step; `None` where they can't be written so.
    fn written_in_state(&self, equations: &Equations, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        self.carry(equations, nodes)
    }
    /// Runs such a program. `[hot, no allocation]`
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn run_own<'e>(&mut self, t: f64, state: &[f64], own: &'e mut Evaluator) -> Result<&'e [f64], AnalysisError> {
        let inputs = self.observe(t, state, false)?.inputs.to_vec();
        own.run(&inputs, self.sets())
    }
    /// The programs that are run, for machine code to be made of them.
    fn programs(&mut self) -> Vec<Used<'_>> {
        Vec::new()
    }
    /// Keeps what [`Formulation::jacobian`] needs; for methods that ask for it.
    fn offer_jacobian(&mut self, equations: &Equations) {
        let _ = equations;
    }
    /// The exact derivatives of the rates with respect to the state: row, column and value of every entry that is not zero,
    /// column after column. `false` where there are none to be had.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn jacobian(&mut self, t: f64, state: &[f64], found: Entries<'_>) -> Result<bool, AnalysisError> {
        let _ = (t, state, found);
        Ok(false)
    }
    /// Roughly what work costs.
    fn price(&self) -> Price {
        Price { rates: 100.0 * self.groups().len() as f64, jacobian: None, preparation: 0.0 }
    }
    /// Work done so far.
    fn counters(&self) -> Counters;
    /// Changes the opaque elements for others.
    fn trade_sets(&mut self, sets: &mut Vec<Box<dyn element_api::ElementSet>>);
    /// The opaque elements, for the call between steps.
    fn sets_mut(&mut self) -> &mut [Box<dyn element_api::ElementSet>];
    /// The opaque elements.
    fn sets(&self) -> &[Box<dyn element_api::ElementSet>];
}
