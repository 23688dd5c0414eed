//! Mass matrix and right side in the coordinates of joints, two ways.
//!
//! By pairs: sum T^T M T and sum T^T (Q - M b), body by body, over all pairs of velocities that move it. Operations of a chain
//! grow like n^3.
//! By composites: everything that a joint carries counts as one body (composite-rigid-body and Newton-Euler algorithms,
//! Featherstone 2008, ch. 5 and 6). Operations of a chain grow like n^2.

use odyn_graph::{Graph, M6, Node, V3, V6};
use rustc_hash::FxHashMap;

use super::joint::Carried;
use super::spatial::Limb;
use crate::model::Model;

/// Lower triangle of a mass matrix: (row, column, node), by columns, then rows; entries that vanish are left out.
pub(super) type Mass = Vec<(usize, usize, Node)>;

/// How mass matrix and right side are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projecting {
    /// Each of the two by whichever way takes fewer operations, counted.
    Fewest,
    /// By pairs of velocities that move a body.
    Pairs,
    /// By all that a joint carries.
    Composites,
}

/// Pairs of velocities that move a body beyond which the way by pairs is not even tried: composites need fewer operations
/// by far.
const MANY_PAIRS: usize = 2000;

/// Mass matrix and right side. `shared` are nodes that are needed in any case.
pub(super) fn project(
    g: &mut Graph,
    model: &Model,
    bodies: &[Carried],
    limbs: &[Limb],
    body_loads: &[Node],
    shared: &[Node],
    how: Projecting,
) -> (Mass, Vec<Node>) {
    let columns = limbs.iter().map(|limb| limb.columns.len()).sum();
    let number = |body: &Carried| body.partials.len() * (body.partials.len() + 1) / 2;
    let by_composites = how == Projecting::Composites
        || how == Projecting::Fewest && bodies.iter().map(number).sum::<usize>() > MANY_PAIRS;
    if by_composites {
        return (composite_mass(g, limbs), composite_loads(g, limbs, columns));
    }
    let (pairs, pushes) = by_pairs(g, model, bodies, body_loads, columns);
    if how == Projecting::Pairs {
        return (pairs, pushes);
    }
    let (composites, sums) = (composite_mass(g, limbs), composite_loads(g, limbs, columns));
    let count = |mass: &Mass, loads: &[Node]| {
        let mut outputs = shared.to_vec();
        outputs.extend(mass.iter().map(|(_, _, node)| *node));
        outputs.extend(loads);
        g.live(&outputs).len()
    };
    let loads = if count(&pairs, &pushes) <= count(&pairs, &sums) { pushes } else { sums };
    let mass = if count(&pairs, &loads) <= count(&composites, &loads) { pairs } else { composites };
    (mass, loads)
}

/// Over the pairs of velocities of each body.
fn by_pairs(
    g: &mut Graph,
    model: &Model,
    bodies: &[Carried],
    body_loads: &[Node],
    columns: usize,
) -> (Mass, Vec<Node>) {
    let zero = g.constant(0.0);
    let mut loads = vec![zero; columns];
    let mut entries: FxHashMap<(usize, usize), Node> = FxHashMap::default();
    for (b, (body, carried)) in model.bodies.iter().zip(bodies).enumerate() {
        let inertia = g.matrix(&body.inertia);
        let mass = g.constant(body.mass);
        let turning = !body.particle;
        let force: V3 = std::array::from_fn(|k| body_loads[6 * b + k]);
        let moment: V3 = std::array::from_fn(|k| body_loads[6 * b + 3 + k]);
        let carry = g.scale3(mass, carried.bias);
        let force = g.sub3(force, carry);
        let turn = g.apply(&inertia, carried.spin_bias);
        let moment = g.sub3(moment, turn);
        let momenta: Vec<(V3, V3)> = carried
            .partials
            .iter()
            .map(|partial| (g.scale3(mass, partial.along), g.apply(&inertia, partial.about)))
            .collect();
        for (i, left) in carried.partials.iter().enumerate() {
            let push = g.dot3(left.along, force);
            loads[left.column] = g.add(loads[left.column], push);
            if turning {
                let twist = g.dot3(left.about, moment);
                loads[left.column] = g.add(loads[left.column], twist);
            }
            for (right, (linear, angular)) in carried.partials.iter().zip(&momenta).take(i + 1) {
                let mut entry = g.dot3(left.along, *linear);
                if turning {
                    let turned = g.dot3(left.about, *angular);
                    entry = g.add(entry, turned);
                }
                let at = (left.column.min(right.column), left.column.max(right.column));
                let sum = entries.get(&at).copied();
                let sum = sum.map_or(entry, |sum| g.add(sum, entry));
                entries.insert(at, sum);
            }
        }
    }
    (sorted(g, entries), loads)
}

/// The composite-rigid-body algorithm.
pub(super) fn composite_mass(g: &mut Graph, limbs: &[Limb]) -> Mass {
    let mut inertia: Vec<M6> = limbs.iter().map(|limb| limb.inertia).collect();
    let mut entries: FxHashMap<(usize, usize), Node> = FxHashMap::default();
    for (at, limb) in limbs.iter().enumerate().rev() {
        for (own, (column, motion)) in limb.columns.iter().enumerate() {
            let mut momentum = g.apply6(&inertia[at], *motion);
            let mut meets = |g: &mut Graph, other: usize, motion: &V6, momentum: V6| {
                let entry = g.dot6(*motion, momentum);
                entries.insert((other.min(*column), other.max(*column)), entry);
            };
            for (other, motion) in &limb.columns[..=own] {
                meets(g, *other, motion, momentum);
            }
            let mut carrier = limb;
            while let Some(parent) = carrier.parent {
                momentum = carrier.load_at_parent(g, momentum);
                carrier = &limbs[parent];
                for (other, motion) in &carrier.columns {
                    meets(g, *other, motion, momentum);
                }
            }
        }
        if let Some(parent) = limb.parent {
            let carried = limb.inertia_at_parent(g, &inertia[at]);
            inertia[parent] = g.add_symmetric(&inertia[parent], &carried);
        }
    }
    sorted(g, entries)
}

/// The Newton-Euler algorithm's way inwards.
pub(super) fn composite_loads(g: &mut Graph, limbs: &[Limb], columns: usize) -> Vec<Node> {
    let mut sums: Vec<V6> = limbs.iter().map(|limb| limb.load).collect();
    let mut loads = vec![g.constant(0.0); columns];
    for (at, limb) in limbs.iter().enumerate().rev() {
        for (column, motion) in &limb.columns {
            loads[*column] = g.dot6(*motion, sums[at]);
        }
        if let Some(parent) = limb.parent {
            let carried = limb.load_at_parent(g, sums[at]);
            sums[parent] = g.add6(sums[parent], carried);
        }
    }
    loads
}

fn sorted(g: &Graph, entries: FxHashMap<(usize, usize), Node>) -> Mass {
    let mut mass: Mass = entries
        .into_iter()
        .filter(|((column, row), node)| column == row || !g.is_zero(*node))
        .map(|((column, row), node)| (row, column, node))
        .collect();
    mass.sort_unstable_by_key(|(row, column, _)| (*column, *row));
    mass
}
