//! [`Elimination`]: the equations of motion solved operation by operation, in an order fixed beforehand.
//!
//! [M J^T; J 0] = L D L^T by symmetric elimination. Columns of M may go at any time, for M is positive definite; a row of J
//! goes when all columns it touches have gone, for then its pivot is the negative of a squared length: what is left of the
//! row, in the metric of M^-1, across the rows that went before. Columns that a row is blind to it need not wait for: what hangs on one
//! body closes its loops before that body goes, and no loop meets another. Among those that may go, the one with the fewest entries
//! goes first (minimum degree), so that the order follows the topology. Entries that are known to be zero cost nothing.

use rustc_hash::FxHashMap;

use super::graph::{Graph, Node};

/// See the module documentation.
pub struct Elimination {
    order: Vec<usize>,
    /// Reciprocal pivots, by unknown.
    reciprocals: Vec<Node>,
    /// Entries of L below each pivot, by unknown: (unknown, entry).
    factors: Vec<Vec<(usize, Node)>>,
    /// Number of columns.
    columns: usize,
    /// Pivots of the columns of M.
    pub mass_pivots: Vec<Node>,
    /// What is left of each row of J across those that went before: squared length in the metric of M^-1.
    pub row_pivots: Vec<Node>,
    /// Sum of the magnitudes that each of [`Elimination::row_pivots`] is made of: what of it is left is known to round-off of this.
    pub row_magnitudes: Vec<Node>,
}

impl Elimination {
    /// Factors. `mass` is the lower triangle of M (row, column, node); `jacobian` gives for each row of J its entries
    /// (column, node).
    pub fn new(g: &mut Graph, columns: usize, mass: &[(usize, usize, Node)], jacobian: &[Vec<(usize, Node)>]) -> Self {
        Self::with_blind_rows(g, columns, mass, jacobian, |_, _| false)
    }

    /// The same for rows with entries that vanish wherever the rows hold: `is_blind` says so of a row and a column, whether there is
    /// an entry or not.
    pub fn with_blind_rows(
        g: &mut Graph,
        columns: usize,
        mass: &[(usize, usize, Node)],
        jacobian: &[Vec<(usize, Node)>],
        is_blind: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let unknowns = columns + jacobian.len();
        let mut matrix = Symmetric { entries: vec![FxHashMap::default(); unknowns] };
        for (row, column, node) in mass {
            matrix.set(g, *row, *column, *node);
        }
        for (k, row) in jacobian.iter().enumerate() {
            for (column, node) in row {
                matrix.set(g, columns + k, *column, *node);
            }
        }
        let zero = g.constant(0.0);
        let one = g.constant(1.0);
        let mut elimination = Self {
            order: Vec::with_capacity(unknowns),
            reciprocals: vec![zero; unknowns],
            factors: vec![Vec::new(); unknowns],
            columns,
            mass_pivots: Vec::with_capacity(columns),
            row_pivots: vec![zero; jacobian.len()],
            row_magnitudes: vec![zero; jacobian.len()],
        };
        let mut open: Vec<usize> = (0..unknowns).collect();
        let may_go = |matrix: &Symmetric, unknown: usize| match unknown.checked_sub(columns) {
            None => true,
            Some(row) => matrix.entries[unknown].keys().all(|other| *other >= columns || is_blind(row, *other)),
        };
        while let Some(pivot) = next(&matrix, &open, may_go) {
            open.retain(|unknown| *unknown != pivot);
            let mut below: Vec<(usize, Node)> =
                matrix.entries[pivot].iter().filter(|(other, _)| **other != pivot).map(|(k, n)| (*k, *n)).collect();
            below.sort_unstable_by_key(|(unknown, _)| *unknown);
            let diagonal = matrix.entries[pivot].get(&pivot).copied().unwrap_or(zero);
            let reciprocal = g.div(one, diagonal);
            elimination.reciprocals[pivot] = reciprocal;
            if pivot < columns {
                elimination.mass_pivots.push(diagonal);
            } else {
                elimination.row_pivots[pivot - columns] = g.neg(diagonal);
            }
            for (unknown, _) in &below {
                matrix.entries[*unknown].remove(&pivot);
            }
            let scaled: Vec<(usize, Node)> = below.iter().map(|(k, entry)| (*k, g.mul(*entry, reciprocal))).collect();
            for (at, (i, factor)) in scaled.iter().enumerate() {
                for (j, entry) in &below[at..] {
                    let product = g.mul(*factor, *entry);
                    matrix.subtract(g, *i, *j, product);
                    if i == j && *i >= columns {
                        // The pivots of columns are positive, those of rows negative.
                        let sum = &mut elimination.row_magnitudes[i - columns];
                        *sum = if pivot < columns { g.add(*sum, product) } else { g.sub(*sum, product) };
                    }
                }
            }
            elimination.factors[pivot] = scaled;
            elimination.order.push(pivot);
        }
        elimination
    }

    /// The solution (a, lambda) for a right side (f, g).
    pub fn solve(&self, g: &mut Graph, loads: &[Node], rows: &[Node]) -> (Vec<Node>, Vec<Node>) {
        let mut x: Vec<Node> = loads.iter().chain(rows).copied().collect();
        for pivot in &self.order {
            for (unknown, factor) in &self.factors[*pivot] {
                let product = g.mul(*factor, x[*pivot]);
                x[*unknown] = g.sub(x[*unknown], product);
            }
        }
        for pivot in self.order.iter().rev() {
            let mut value = g.mul(x[*pivot], self.reciprocals[*pivot]);
            for (unknown, factor) in &self.factors[*pivot] {
                let product = g.mul(*factor, x[*unknown]);
                value = g.sub(value, product);
            }
            x[*pivot] = value;
        }
        let multipliers = x.split_off(self.columns);
        (x, multipliers)
    }
}

/// A symmetric matrix of nodes, both halves stored; entries that are the constant zero are not.
struct Symmetric {
    entries: Vec<FxHashMap<usize, Node>>,
}

impl Symmetric {
    fn set(&mut self, g: &Graph, i: usize, j: usize, node: Node) {
        if g.is_zero(node) {
            return;
        }
        self.entries[i].insert(j, node);
        self.entries[j].insert(i, node);
    }

    fn subtract(&mut self, g: &mut Graph, i: usize, j: usize, node: Node) {
        let zero = g.constant(0.0);
        let before = self.entries[i].get(&j).copied().unwrap_or(zero);
        let after = g.sub(before, node);
        if g.is_zero(after) {
            self.entries[i].remove(&j);
            self.entries[j].remove(&i);
        } else {
            self.entries[i].insert(j, after);
            self.entries[j].insert(i, after);
        }
    }
}

/// The unknown to eliminate next: of those that may go, the one with the fewest entries; the last of them, so that the ends
/// of branches go before their roots.
fn next(matrix: &Symmetric, open: &[usize], may_go: impl Fn(&Symmetric, usize) -> bool) -> Option<usize> {
    let mut best: Option<(usize, usize)> = None;
    for unknown in open.iter().rev() {
        let entries = matrix.entries[*unknown].len();
        if best.is_none_or(|(fewest, _)| entries < fewest) && may_go(matrix, *unknown) {
            best = Some((entries, *unknown));
        }
    }
    best.map(|(_, unknown)| unknown)
}
