//! [`Articulated`]: accelerations of trees that no rows close, body by body.
//!
//! The articulated-body algorithm (Featherstone 2008, ch. 7): from the tips inwards each joint's velocities are eliminated
//! from the inertia that its branch shows at the joint, then accelerations are found from the ground outwards. Operations grow
//! like the number of bodies, where the mass matrix of a chain is dense. The pivots are those of eliminating that matrix from
//! the tips inwards.

use odyn_graph::{Graph, M6, Node, V6};

use super::spatial::Limb;

/// See the module documentation.
pub struct Articulated {
    /// u', by column.
    pub accelerations: Vec<Node>,
    /// Pivots: inertia against each velocity with those further outwards left free.
    pub pivots: Vec<Node>,
}

/// What elimination of a velocity leaves.
struct Eliminated {
    /// Inertia against its motion, over the pivot.
    scaled: V6,
    /// Its rate if the body that carries it did not accelerate.
    rate: Node,
}

/// Solves for the accelerations of trees. Limbs come after those that carry them.
pub(super) fn articulated(g: &mut Graph, limbs: &[Limb], columns: usize) -> Articulated {
    let (zero, one) = (g.constant(0.0), g.constant(1.0));
    let mut inertia: Vec<M6> = limbs.iter().map(|limb| limb.inertia).collect();
    let mut load: Vec<V6> = limbs.iter().map(|limb| limb.load).collect();
    let mut pivots = Vec::with_capacity(columns);
    let mut eliminated: Vec<Option<Eliminated>> = (0..columns).map(|_| None).collect();
    for (at, limb) in limbs.iter().enumerate().rev() {
        for (column, motion) in limb.columns.iter().rev() {
            let push = g.apply6(&inertia[at], *motion);
            let pivot = g.dot6(*motion, push);
            let reciprocal = g.div(one, pivot);
            let force = g.dot6(*motion, load[at]);
            let rate = g.mul(force, reciprocal);
            let scaled = push.map(|entry| g.mul(entry, reciprocal));
            for i in 0..6 {
                let part = g.mul(push[i], rate);
                load[at][i] = g.sub(load[at][i], part);
                for j in 0..=i {
                    let part = g.mul(scaled[i], push[j]);
                    let left = g.sub(inertia[at][i][j], part);
                    inertia[at][i][j] = left;
                    inertia[at][j][i] = left;
                }
            }
            pivots.push(pivot);
            eliminated[*column] = Some(Eliminated { scaled, rate });
        }
        if let Some(parent) = limb.parent {
            let carried = limb.inertia_at_parent(g, &inertia[at]);
            inertia[parent] = g.add_symmetric(&inertia[parent], &carried);
            let carried = limb.load_at_parent(g, load[at]);
            load[parent] = g.add6(load[parent], carried);
        }
    }
    let mut accelerations = vec![zero; columns];
    let mut moved: Vec<V6> = Vec::with_capacity(limbs.len());
    for limb in limbs {
        let mut acceleration = match limb.parent {
            Some(parent) => limb.motion_of_parent(g, moved[parent]),
            None => [zero; 6],
        };
        for (column, motion) in &limb.columns {
            let Some(Eliminated { scaled, rate }) = &eliminated[*column] else { continue };
            let part = g.dot6(*scaled, acceleration);
            let rate = g.sub(*rate, part);
            accelerations[*column] = rate;
            let own = motion.map(|entry| g.mul(entry, rate));
            acceleration = g.add6(acceleration, own);
        }
        moved.push(acceleration);
    }
    Articulated { accelerations, pivots }
}
