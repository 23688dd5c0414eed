//! [`PreciseMotion`]: the recorded equations of motion with twice the digits of doubles, along the coordinates of joints.
//!
//! The operations are those of [`super::JointForm`]'s regular engine; what differs is the numbers that run through them. Constants of
//! the equations and the assembled start are taken as the doubles that they are.

use odyn_graph::Series;
use thiserror::Error;

use super::assembly::Assembly;
use super::joint_engines::{correction_nodes, motion_nodes};
use super::joint_plan::{JointPlan, LEAST_HEALTH};
use super::joint_start::JointStart;
use super::precise_outputs::PreciseOutputs;
use super::precise_state::PreciseState;
use crate::model::Model;
use crate::plan::Layout;
use crate::precise::{DoubleDouble, Expansion};
use crate::program::{Equations, Graph, Node, condense};

/// Corrections of positions beyond which joints cannot be closed.
const MOST_CORRECTIONS: usize = 8;
/// Corrections below this share of a scene's size leave violations of their square.
const CONVERGED: f64 = 1e-16;

/// Why equations cannot be evaluated with more digits.
#[derive(Debug, Error)]
pub enum NotPrecise {
    /// See the message.
    #[error("an element is opaque: its equations are called, not recorded, and have the digits of doubles")]
    Opaque,
    /// See the message.
    #[error("discrete states of elements change between the steps of a method")]
    Discrete,
    /// See the message.
    #[error("rows of contacts are unilateral: which of them hold changes between the steps of a method")]
    Unilateral,
    /// See the message.
    #[error("a joint may be released: which rows hold changes between the steps of a method")]
    Released,
    /// See the message.
    #[error("forces depend on reactions or accelerations, and are found by iterations in doubles")]
    Coupled,
    /// See the message.
    #[error("forces, states or outputs depend on what the coordinates of joints do not tell")]
    Coordinates,
    /// See the message.
    #[error("the start is next to a singular position")]
    Singular,
}

/// See the module documentation.
#[derive(Clone)]
pub struct PreciseMotion {
    /// Accelerations, then rates of element states.
    motion: Series,
    /// The same at one place, with multipliers between them, where outputs need them.
    solution: Option<Series>,
    /// Corrections of positions, and of velocities.
    corrections: Option<[Series; 2]>,
    outputs: PreciseOutputs,
    /// Angles that are counted, and which they are.
    angles: Option<(Series, Vec<usize>)>,
    /// Their coefficients, by order.
    turned: Vec<Vec<DoubleDouble>>,
    rows: Vec<usize>,
    state: PreciseState,
    order: usize,
    length: f64,
}

impl PreciseMotion {
    /// The motion of a planned scene by series of an order. The outputs of the model are given by [`PreciseMotion::read`].
    ///
    /// # Errors
    /// Why its equations cannot be evaluated so.
    pub fn new(
        equations: &mut Equations,
        model: &Model,
        layout: &Layout,
        plan: &JointPlan,
        assembly: &Assembly,
        order: usize,
    ) -> Result<Self, NotPrecise> {
        if !equations.graph.calls.is_empty() {
            return Err(NotPrecise::Opaque);
        }
        if !equations.releases.is_empty() {
            return Err(NotPrecise::Released);
        }
        if equations.switches_rows() {
            return Err(NotPrecise::Unilateral);
        }
        if layout.given_at > 0 {
            return Err(NotPrecise::Discrete);
        }
        if plan.equations.dependence.is_some() {
            return Err(NotPrecise::Coupled);
        }
        if plan.start.kept.min(plan.start.independence) < LEAST_HEALTH {
            return Err(NotPrecise::Singular);
        }
        let joint = &plan.equations;
        let rows: Vec<usize> = plan.independent.iter().map(|k| plan.rows[*k]).collect();
        let columns = joint.coordinates.columns;
        let (graph, mut nodes) = motion_nodes(joint, &rows, plan.solves_by_bodies());
        nodes.truncate(columns + rows.len() + layout.states);
        let solution = (&graph, nodes.clone());
        nodes.drain(columns..columns + rows.len());
        let corrections = if rows.is_empty() {
            None
        } else {
            let (graph, [position, velocity]) = correction_nodes(joint, &rows);
            Some([series(&graph, &position, 0)?, series(&graph, &velocity, 0)?])
        };
        let outputs = PreciseOutputs::new(equations, model, layout, plan, assembly)?;
        let solved = joint.coordinates.acceleration_slot..joint.coordinates.input_count;
        let multipliers = layout.multiplier_slot()..layout.inputs();
        let needs_solution = outputs.uses_inputs(solved) || outputs.uses_inputs(multipliers);
        let counted = equations.counted_angles(model, layout);
        let angles = if counted.is_empty() {
            None
        } else {
            let nodes: Vec<Node> = counted.iter().map(|angle| equations.angles[*angle]).collect();
            let (graph, nodes) = joint.carry(equations, layout, &nodes).ok_or(NotPrecise::Coordinates)?;
            Some((series(&graph, &nodes, order)?, counted))
        };
        Ok(Self {
            motion: series(&graph, &nodes, order)?,
            solution: needs_solution.then(|| series(solution.0, &solution.1, 0)).transpose()?,
            corrections,
            outputs,
            turned: vec![Vec::new(); order + 1],
            angles,
            rows,
            state: PreciseState::new(&joint.coordinates, layout, plan.length),
            order,
            length: plan.length,
        })
    }

    /// The assembled start, as it is in doubles.
    #[must_use]
    pub fn start(&mut self, model: &Model, plan: &JointPlan, assembly: &Assembly) -> Vec<DoubleDouble> {
        let found = JointStart::new(model, &plan.tree, plan.length).find(&assembly.working);
        let joints: Vec<_> = found.into_iter().map(Option::unwrap_or_default).collect();
        let positions = joints.iter().flat_map(|joint| &joint.positions);
        let velocities = joints.iter().flat_map(|joint| &joint.velocities);
        self.state.start(positions.chain(velocities), assembly)
    }

    /// A start as another assembly in doubles might round it: off by half a unit in the last place of each entry, of positions at
    /// least of 1 rad or the scene's size.
    #[must_use]
    pub fn rounded(&self, start: &[DoubleDouble]) -> Vec<DoubleDouble> {
        self.state.rounded(start)
    }

    /// The same by series of a lower order.
    #[must_use]
    pub fn at_order(&self, order: usize) -> Self {
        let turned = vec![Vec::new(); order + 1];
        Self { order, turned, ..self.clone() }
    }

    /// Operations of the right side.
    #[must_use]
    pub fn operations(&self) -> usize {
        self.motion.operations()
    }

    /// The outputs of the model at a state, SI, so long after the last expansion.
    pub fn read(
        &mut self,
        t: DoubleDouble,
        since: DoubleDouble,
        state: &[DoubleDouble],
    ) -> impl Iterator<Item = DoubleDouble> + '_ {
        self.count_turns(since);
        self.state.load(t, state);
        if let Some(solution) = &mut self.solution {
            solution.run(0, &self.state.inputs);
            let values: Vec<DoubleDouble> = solution.values().collect();
            self.state.publish(&values, &self.rows);
        }
        self.outputs.read(&self.state.inputs)
    }

    /// Lets references of angles follow the motion.
    fn count_turns(&mut self, since: DoubleDouble) {
        let Some((_, counted)) = &self.angles else { return };
        for (k, angle) in counted.iter().enumerate() {
            let terms = self.turned.iter().rev().filter_map(|list| list.get(k));
            let value = terms.fold(None, |sum: Option<DoubleDouble>, c| Some(sum.map_or(*c, |sum| sum * since + *c)));
            if let Some(value) = value {
                self.state.set_reference(*angle, value.to_f64());
            }
        }
    }

    fn correct(&mut self, which: usize) -> Option<&Series> {
        let series = &mut self.corrections.as_mut()?[which];
        series.run(0, &self.state.inputs);
        Some(series)
    }
}

impl Expansion for PreciseMotion {
    fn expand(&mut self, t: DoubleDouble, state: &[DoubleDouble], coefficients: &mut [Vec<DoubleDouble>]) {
        coefficients[0].copy_from_slice(state);
        for k in 0..=self.order {
            self.state.load_order(t, coefficients, k);
            if let Some((angles, counted)) = &mut self.angles {
                angles.run(k, &self.state.inputs);
                self.turned[k] = (0..counted.len()).map(|angle| angles.output(angle, k)).collect();
            }
            if k < self.order {
                self.motion.run(k, &self.state.inputs);
                self.state.grow(coefficients, k, &self.motion);
            }
        }
    }

    fn conditions(&self, told: &mut dyn FnMut(&[DoubleDouble], bool)) {
        self.motion.conditions(self.order - 1, told);
    }

    fn settle(&mut self, t: DoubleDouble, since: DoubleDouble, state: &mut [DoubleDouble]) -> Result<(), String> {
        self.count_turns(since);
        self.state.normalise(state);
        for correction in 0.. {
            self.state.load(t, state);
            let Some(found) = self.correct(0) else { break };
            let moves: Vec<DoubleDouble> = found.values().collect();
            let size = self.state.move_along(&moves, state, self.length);
            if size <= CONVERGED * self.length {
                break;
            }
            if correction == MOST_CORRECTIONS || !size.is_finite() {
                return Err("joints cannot be kept closed".into());
            }
        }
        self.state.load(t, state);
        if let Some(found) = self.correct(1) {
            let changes: Vec<DoubleDouble> = found.values().collect();
            self.state.change_velocities(&changes, state);
        }
        self.outputs.follow(&self.state.inputs);
        Ok(())
    }

    fn rates(&mut self, t: DoubleDouble, state: &[DoubleDouble], rates: &mut [DoubleDouble]) {
        self.state.load(t, state);
        self.motion.run(0, &self.state.inputs);
        let mut both = [state.to_vec(), vec![DoubleDouble::ZERO; state.len()]];
        self.state.grow(&mut both, 0, &self.motion);
        rates.copy_from_slice(&both[1]);
    }

    fn kinds(&self) -> &[usize] {
        &self.state.kinds
    }

    fn units(&self) -> &[f64] {
        &self.state.units
    }

    /// Positions are of the size of the scene; velocities that move by less while it runs are none. Nothing is known of element states.
    fn least(&self, kind: usize, duration: f64) -> f64 {
        match kind {
            0 => 1.0,
            1 if duration > 0.0 => 1.0 / duration,
            _ => 0.0,
        }
    }
}

pub(super) fn series(graph: &Graph, nodes: &[Node], order: usize) -> Result<Series, NotPrecise> {
    let series = match condense(graph, nodes) {
        Some((graph, nodes)) => Series::new(&graph, &nodes, order),
        None => Series::new(graph, nodes, order),
    };
    series.ok_or(NotPrecise::Opaque)
}
