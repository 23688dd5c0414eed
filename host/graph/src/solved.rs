//! Unknowns that are found from conditions g(y, x) = 0: nodes that Newton's method makes, and their derivatives by the implicit
//! function theorem.

use rustc_hash::FxHashMap;

use super::derivative::{Below, Seeds, derivatives, derivatives_along_each};
use super::graph::{Expr, Graph, Node};

/// Newton steps that are written into the graph. They start at values that an integrator carries along, which are off by its error
/// in a step; two of them leave the fourth power of that.
const STEPS: usize = 2;

/// Unknowns with the conditions that they meet.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Input slot where the first one's carried value begins; one slot each.
    pub slot: usize,
    /// The unknowns y.
    pub unknowns: Vec<Node>,
    /// The conditions g there.
    pub conditions: Vec<Node>,
    /// g_y there, row after row.
    pub matrix: Vec<Node>,
    /// The conditions at the carried values, then their g_y, row after row.
    pub at_carried: Vec<Node>,
}

impl Graph {
    /// Writes down unknowns whose values are carried in the inputs from `slot` on: Newton steps from there, and g and g_y at
    /// their end. `conditions` gives g for nodes in place of the unknowns.
    pub fn solve(
        &mut self,
        slot: usize,
        count: usize,
        mut conditions: impl FnMut(&mut Self, &[Node]) -> Vec<Node>,
    ) -> &[Node] {
        let mut unknowns: Vec<Node> = (0..count).map(|k| self.input(slot + k)).collect();
        let mut at_carried = Vec::new();
        for step in 0..STEPS {
            let values = conditions(self, &unknowns);
            let matrix = slopes(self, &values, &unknowns);
            if step == 0 {
                at_carried = [&values[..], &matrix].concat();
            }
            let change = solution(self, &matrix, &values);
            for (unknown, change) in unknowns.iter_mut().zip(change) {
                *unknown = self.less(*unknown, change);
            }
        }
        let values = conditions(self, &unknowns);
        let matrix = slopes(self, &values, &unknowns);
        self.solved.push(Solved { slot, unknowns, conditions: values, matrix, at_carried });
        &self.solved[self.solved.len() - 1].unknowns
    }

    /// a - b as a node that the negation of it refers to. That of a difference is the difference the other way round, which does not
    /// depend on this node: derivatives along it would not know it.
    fn less(&mut self, a: Node, b: Node) -> Node {
        let negative = self.neg(b);
        match self.expr(negative) {
            Expr::Neg(_) => self.intern(Expr::Add(a.min(negative), a.max(negative))),
            _ => self.add(a, negative),
        }
    }

    /// The unknown whose value is carried at a slot.
    #[must_use]
    pub fn unknown_at(&self, slot: usize) -> Option<Node> {
        let found =
            self.solved.iter().find(|solved| (solved.slot..solved.slot + solved.unknowns.len()).contains(&slot));
        found.map(|solved| solved.unknowns[slot - solved.slot])
    }
}

/// How large x of A x = b may be for any b whose entries have these magnitudes; A row after row.
pub fn largest_solution(g: &mut Graph, matrix: &[Node], sizes: &[Node]) -> Vec<Node> {
    let [zero, one] = [0.0, 1.0].map(|value| g.constant(value));
    let mut largest = vec![zero; sizes.len()];
    for (row, size) in sizes.iter().enumerate() {
        let mut unit = vec![zero; sizes.len()];
        unit[row] = one;
        for (sum, entry) in largest.iter_mut().zip(solution(g, matrix, &unit)) {
            let entry = g.abs(entry);
            let part = g.mul(entry, *size);
            *sum = g.add(*sum, part);
        }
    }
    largest
}

/// Derivatives of nodes along variables, row after row.
fn slopes(g: &mut Graph, values: &[Node], variables: &[Node]) -> Vec<Node> {
    let columns = derivatives_along_each(g, values, variables);
    (0..values.len()).flat_map(|row| columns.iter().map(move |column| column[row]).collect::<Vec<_>>()).collect()
}

/// x of A x = b, by determinants (Cramer): no pivot is chosen that could be zero later.
fn solution(g: &mut Graph, matrix: &[Node], right: &[Node]) -> Vec<Node> {
    let n = right.len();
    let columns: Vec<Vec<Node>> = (0..n).map(|column| (0..n).map(|row| matrix[n * row + column]).collect()).collect();
    let whole = determinant(g, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
    let mut found = Vec::with_capacity(n);
    for k in 0..n {
        let mut replaced: Vec<&[Node]> = columns.iter().map(Vec::as_slice).collect();
        replaced[k] = right;
        let part = determinant(g, &replaced);
        found.push(g.div(part, whole));
    }
    found
}

/// Of a matrix given by columns: expansion along them, each minor once.
fn determinant(g: &mut Graph, columns: &[&[Node]]) -> Node {
    let n = columns.len();
    // By the set of rows in use: of the first as many columns.
    let mut minors: FxHashMap<usize, Node> = FxHashMap::from_iter([(0, g.constant(1.0))]);
    for column in columns {
        let mut larger: FxHashMap<usize, Node> = FxHashMap::default();
        let mut sets: Vec<usize> = minors.keys().copied().collect();
        sets.sort_unstable();
        for set in sets {
            for row in (0..n).filter(|row| set >> row & 1 == 0) {
                let product = g.mul(column[row], minors[&set]);
                if g.is_zero(product) {
                    continue;
                }
                let behind = (set >> row).count_ones();
                let sum = larger.get(&(set | 1 << row)).copied().unwrap_or_else(|| g.constant(0.0));
                let sum = if behind % 2 == 0 { g.add(sum, product) } else { g.sub(sum, product) };
                larger.insert(set | 1 << row, sum);
            }
        }
        minors = larger;
    }
    minors.get(&((1 << n) - 1)).copied().unwrap_or_else(|| g.constant(0.0))
}

/// The derivatives of unknowns among the nodes of `below` along the seeds, which count as seeds from then on.
pub(super) fn follow_solved(graph: &mut Graph, below: &Below, seeds: &Seeds, found: &mut [Node], is_seed: &mut [bool]) {
    if graph.solved.is_empty() {
        return;
    }
    let zero = graph.constant(0.0);
    for k in 0..graph.solved.len() {
        let own = &graph.solved[k].unknowns;
        let wanted = own.iter().any(|unknown| below.contains(*unknown));
        if !wanted || own.iter().any(|unknown| seeds.contains_key(unknown)) {
            continue;
        }
        let Solved { unknowns, conditions, matrix, .. } = graph.solved[k].clone();
        // g along the seeds with these unknowns held.
        let mut others = seeds.clone();
        others.extend(unknowns.iter().map(|unknown| (*unknown, zero)));
        let change = derivatives(graph, &conditions, &others);
        let rates = if change.iter().all(|change| graph.is_zero(*change)) {
            change
        } else {
            solution(graph, &matrix, &change).into_iter().map(|rate| graph.neg(rate)).collect()
        };
        for (unknown, rate) in unknowns.iter().zip(rates) {
            if let Some(place) = below.place(*unknown) {
                (found[place], is_seed[place]) = (rate, true);
            }
        }
    }
}
