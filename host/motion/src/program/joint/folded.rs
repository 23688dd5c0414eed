//! Coordinates that follow others, written out of the equations.

use super::*;

/// What stands for a velocity of the tree: velocities of the state, with factors.
type Combined = Vec<(usize, f64)>;

/// Writes equations in all coordinates of a tree in those that follow no others. `joints` are the measures of each joint's
/// coordinates, and whether a rotation follows. With q' = A u', the mass matrix becomes A^T M A, loads A^T Q, gradients of rows
/// Phi_q A; what the tree itself needs, A is constant for.
pub(super) fn folded(
    mut all: JointEquations,
    tree: &SpanningTree,
    joints: &[(Vec<Measure>, bool)],
    layout: &Layout,
) -> JointEquations {
    let kept = tree.kept();
    let left: Vec<(Vec<Measure>, bool)> = joints
        .iter()
        .zip(&kept)
        .map(|((measures, rotates), kept)| {
            (measures.iter().zip(kept).filter(|(_, kept)| **kept).map(|(measure, _)| *measure).collect(), *rotates)
        })
        .collect();
    let coordinates = Coordinates::of_joints(&left, layout);
    // By line of the tree.
    let mut lines = coordinates.lines.iter();
    let of_state: Vec<Option<_>> = kept.iter().flatten().map(|kept| kept.then(|| lines.next()).flatten()).collect();
    let mut offsets = vec![0.0; of_state.len()];
    let mut parts: Vec<Vec<(usize, f64)>> = (0..of_state.len()).map(|line| vec![(line, 1.0)]).collect();
    for follower in &tree.followers {
        offsets[follower.line] = follower.offset;
        parts[follower.line].clone_from(&follower.of);
    }
    let mut g = Graph::default();
    let mut replaced: FxHashMap<Node, Node> = FxHashMap::default();
    let mut columns: Vec<Combined> = vec![Vec::new(); all.coordinates.columns];
    for (number, line) in all.coordinates.lines.iter().enumerate() {
        let mut position = g.constant(offsets[number]);
        let mut velocity = g.constant(0.0);
        for (other, factor) in &parts[number] {
            let Some(other) = of_state[*other] else { continue };
            let scale = g.constant(*factor);
            for (sum, entry) in [(&mut position, other.position), (&mut velocity, other.velocity)] {
                let input = g.input(coordinates.slot_of(entry));
                let part = g.mul(scale, input);
                *sum = g.add(*sum, part);
            }
            columns[line.column].push((other.column, *factor));
        }
        replaced.insert(all.graph.input(all.coordinates.slot_of(line.position)), position);
        replaced.insert(all.graph.input(all.coordinates.slot_of(line.velocity)), velocity);
    }
    for (old, new) in all.coordinates.rotations.iter().zip(&coordinates.rotations) {
        let parameters = (0..4).map(|k| (old.position + k, new.position + k));
        let velocities = (0..3).map(|k| (old.velocity + k, new.velocity + k));
        for (from, to) in parameters.chain(velocities) {
            replaced.insert(all.graph.input(all.coordinates.slot_of(from)), g.input(coordinates.slot_of(to)));
        }
        (0..3).for_each(|k| columns[old.column + k].push((new.column + k, 1.0)));
    }
    let mut own = Rewriting::new(&all.graph, &mut g, replaced);
    let mut carry = |g: &mut Graph, node: &mut Node| *node = own.carry(g, *node);
    for body in &mut all.bodies {
        let BodyNodes { r, p, a, v, w, p_rate } = body;
        let nodes = r.iter_mut().chain(p).chain(a.iter_mut().flatten()).chain(v).chain(w).chain(p_rate);
        nodes.for_each(|node| carry(&mut g, node));
    }
    all.rotations.iter_mut().flatten().flatten().for_each(|node| carry(&mut g, node));
    let others = all.body_loads.iter_mut().chain(&mut all.state_rates).chain([&mut all.power]);
    others.for_each(|node| carry(&mut g, node));
    all.row_slopes.iter_mut().flatten().for_each(|(_, node)| carry(&mut g, node));
    for (Row { jacobian, .. }, common) in all.rows.iter().zip(&mut all.common) {
        *common = folded_common(jacobian, common, &columns);
    }
    for Row { value, time, gamma, jacobian, of_velocities: _ } in &mut all.rows {
        [value, time, gamma].into_iter().for_each(|node| carry(&mut g, node));
        let mut sums = Sums::default();
        for (column, slope) in std::mem::take(jacobian) {
            let mut slope = slope;
            carry(&mut g, &mut slope);
            columns[column].iter().for_each(|(to, factor)| sums.add(&mut g, *to, *factor, slope));
        }
        *jacobian = sums.sorted(&g);
    }
    let mut loads = Sums::default();
    for (column, load) in std::mem::take(&mut all.loads).into_iter().enumerate() {
        let mut load = load;
        carry(&mut g, &mut load);
        columns[column].iter().for_each(|(to, factor)| loads.add(&mut g, *to, *factor, load));
    }
    let zero = g.constant(0.0);
    all.loads = (0..coordinates.columns).map(|column| loads.0.get(&column).copied().unwrap_or(zero)).collect();
    let mut mass = Sums::default();
    for (row, column, entry) in std::mem::take(&mut all.mass) {
        let mut entry = entry;
        carry(&mut g, &mut entry);
        for (i, left) in &columns[row] {
            for (j, right) in &columns[column] {
                // The other half of the matrix meets the same coordinate once more.
                let twice = if row != column && i == j { 2.0 } else { 1.0 };
                let upper = row == column && i < j;
                if !upper {
                    mass.add(&mut g, (*i.max(j), *i.min(j)), twice * left * right, entry);
                }
            }
        }
    }
    let mut entries: Vec<(usize, usize, Node)> =
        mass.sorted(&g).into_iter().map(|((row, column), node)| (row, column, node)).collect();
    entries.sort_unstable_by_key(|(row, column, _)| (*column, *row));
    let mut shared = [&all.loads[..], &all.state_rates, &[all.power]].concat();
    shared.extend(entries.iter().map(|(_, _, node)| *node));
    for row in &all.rows {
        shared.push(row.gamma);
        shared.extend(row.jacobian.iter().map(|(_, slope)| *slope));
    }
    let size = g.live(&shared).len();
    JointEquations { graph: g, coordinates, mass: entries, size, limbs: None, ..all }
}

/// What becomes of the velocities that move all of a row together: those that come into it in no other way.
fn folded_common(jacobian: &[(usize, Node)], common: &[usize], columns: &[Combined]) -> Vec<usize> {
    let of = |column: usize| columns[column].iter().map(|(to, _)| *to);
    let mut found: Vec<usize> = common.iter().flat_map(|column| of(*column)).collect();
    let others = jacobian.iter().filter(|(column, _)| common.binary_search(column).is_err());
    let seen: Vec<usize> = others.flat_map(|(column, _)| of(*column)).collect();
    found.retain(|column| !seen.contains(column));
    found.sort_unstable();
    found.dedup();
    found
}

/// Sums of nodes with factors, by place.
struct Sums<K>(FxHashMap<K, Node>);

impl<K> Default for Sums<K> {
    fn default() -> Self {
        Self(FxHashMap::default())
    }
}

impl<K: std::hash::Hash + Ord + Copy> Sums<K> {
    fn add(&mut self, g: &mut Graph, at: K, factor: f64, node: Node) {
        let factor = g.constant(factor);
        let part = g.mul(factor, node);
        let sum = self.0.get(&at).map_or(part, |sum| g.add(*sum, part));
        self.0.insert(at, sum);
    }

    /// What is not zero, by place.
    fn sorted(self, g: &Graph) -> Vec<(K, Node)> {
        let mut list: Vec<(K, Node)> = self.0.into_iter().filter(|(_, node)| !g.is_zero(*node)).collect();
        list.sort_unstable_by_key(|(at, _)| *at);
        list
    }
}
