//! [`PreciseOutputs`]: the outputs of a model with twice the digits.

use odyn_graph::Series;

use super::assembly::Assembly;
use super::constraints::{mass_entries, mass_values};
use super::joint_plan::JointPlan;
use super::precise::{NotPrecise, series};
use super::working::BODY_STATES;
use crate::model::{Model, Quantity};
use crate::plan::Layout;
use crate::precise::DoubleDouble;
use crate::program::{Equations, Node, Working};

const ZERO: DoubleDouble = DoubleDouble::ZERO;

/// Where an output comes from.
#[derive(Clone, Copy)]
enum Source {
    /// A result of the program.
    Program(usize),
    /// A Euler parameter of one of the bodies that attitudes are found of.
    Attitude(usize, usize),
}

/// See the module documentation.
#[derive(Clone)]
pub(super) struct PreciseOutputs {
    program: Series,
    from: Vec<Source>,
    /// Rotation matrices, nine entries each.
    turns: Series,
    /// Euler parameters of the same bodies, as they were last.
    attitudes: Vec<[DoubleDouble; 4]>,
}

impl PreciseOutputs {
    pub(super) fn new(
        equations: &mut Equations,
        model: &Model,
        layout: &Layout,
        plan: &JointPlan,
        assembly: &Assembly,
    ) -> Result<Self, NotPrecise> {
        let (mut nodes, mut from, mut bodies) = (Vec::new(), Vec::new(), Vec::new());
        for channel in &model.channels {
            from.push(match channel.quantity {
                Quantity::EulerParameter { body, component } => {
                    let known = bodies.iter().position(|other| *other == body).unwrap_or_else(|| {
                        bodies.push(body);
                        bodies.len() - 1
                    });
                    Source::Attitude(known, component)
                }
                _ => {
                    nodes.push(equations.observe(&channel.quantity, model, layout));
                    Source::Program(nodes.len() - 1)
                }
            });
        }
        let joint = &plan.equations;
        let turns: Vec<Node> = bodies.iter().flat_map(|body| joint.bodies[*body].a.into_iter().flatten()).collect();
        let at_start = |body: &usize| {
            let p = &assembly.working[BODY_STATES * body + 3..][..4];
            [0, 1, 2, 3].map(|k| DoubleDouble::from(p[k]))
        };
        Ok(Self {
            program: program(equations, model, layout, plan, &nodes)?,
            from,
            turns: series(&joint.graph, &turns, 0)?,
            attitudes: bodies.iter().map(at_start).collect(),
        })
    }

    /// Whether an output depends on an input in the given range of slots.
    pub(super) fn uses_inputs(&self, slots: std::ops::Range<usize>) -> bool {
        self.program.uses_inputs(slots)
    }

    /// Lets attitudes follow the motion: of the two sets of Euler parameters of a rotation, the one that continues from the last.
    pub(super) fn follow(&mut self, inputs: &[DoubleDouble]) {
        self.turns.run(0, inputs);
        let entries: Vec<DoubleDouble> = self.turns.values().collect();
        for (last, a) in self.attitudes.iter_mut().zip(entries.chunks_exact(9)) {
            let found = attitude(a);
            let along = found.iter().zip(last.iter()).fold(ZERO, |sum, (a, b)| sum + *a * *b);
            *last = if along < ZERO { found.map(|e| -e) } else { found };
        }
    }

    /// The outputs, SI.
    pub(super) fn read(&mut self, inputs: &[DoubleDouble]) -> impl Iterator<Item = DoubleDouble> + '_ {
        self.follow(inputs);
        self.program.run(0, inputs);
        self.from.iter().map(|from| match *from {
            Source::Program(number) => self.program.output(number, 0),
            Source::Attitude(body, entry) => self.attitudes[body][entry],
        })
    }
}

/// Euler parameters of a rotation matrix by rows, the largest from its square (Shepperd, 1978).
fn attitude(a: &[DoubleDouble]) -> [DoubleDouble; 4] {
    let diagonal = [a[0], a[4], a[8]];
    let trace = diagonal[0] + diagonal[1] + diagonal[2];
    let largest = (0..3).max_by(|j, k| diagonal[*j].to_f64().total_cmp(&diagonal[*k].to_f64())).unwrap_or(0);
    let entry = |row: usize, column: usize| a[3 * (row % 3) + column % 3];
    let mut p = [ZERO; 4];
    if trace > diagonal[largest] {
        p[0] = DoubleDouble::ONE + trace;
        (0..3).for_each(|k| p[k + 1] = entry(k + 2, k + 1) - entry(k + 1, k + 2));
    } else {
        let k = largest;
        p[0] = entry(k + 2, k + 1) - entry(k + 1, k + 2);
        p[k + 1] = DoubleDouble::ONE + diagonal[k] + diagonal[k] - trace;
        p[(k + 1) % 3 + 1] = entry(k, k + 1) + entry(k + 1, k);
        p[(k + 2) % 3 + 1] = entry(k, k + 2) + entry(k + 2, k);
    }
    let length = p.iter().fold(ZERO, |sum, e| sum + *e * *e).sqrt();
    p.map(|e| e / length)
}

/// Nodes as functions of the coordinates, and of accelerations and multipliers where they depend on them.
fn program(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    plan: &JointPlan,
    nodes: &[Node],
) -> Result<Series, NotPrecise> {
    if let Some((graph, nodes)) = plan.equations.carry(equations, layout, nodes) {
        return series(&graph, &nodes, 0);
    }
    let mass = mass_entries(&mass_values(model));
    let working = Working { equations, layout, mass: &mass };
    let found = plan.equations.reactions(&working, &plan.tree, plan.length, nodes, &[]);
    let found = found.ok_or(NotPrecise::Coordinates)?;
    series(&found.graph, &found.nodes, 0)
}
