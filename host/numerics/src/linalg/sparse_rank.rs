//! Which rows depend on others, found by sparse elimination.

use std::collections::BTreeMap;

use super::null_vectors::root;
use super::{
    BlockCholesky, Clusters, KktSolver, KktStructure, LinalgError, SparseLdl, TRUSTED, add_scaled, check_length,
    constraint_order, dot, two_norm,
};

/// Share of a row that is left after elimination, squared, at or below which nothing is left but round-off. Between this and
/// [`TRUSTED`] elimination cannot tell: squares of sines are what is seen.
const NOTHING_LEFT: f64 = 1e-13;
/// Sine of the angle between a row in doubt and the span of the others, seen without squares, from which on it is independent of
/// them, and up to which it depends on them. Chains of loops have rows with sines like one by the number of loops.
const APART: f64 = 1e-7;
const WITHIN: f64 = 1e-9;
/// Rows in doubt, of a part of the system that has nothing in common with the others, beyond which none is looked at.
const MOST_DOUBTS: usize = 64;

/// A vector `lambda` with `J^T lambda = 0`, as rows and values.
pub type NullVector = Vec<(usize, f64)>;

/// The rows of `J`, sorted out; see [`SparseRank::find`].
#[derive(Debug, Clone, PartialEq)]
pub struct SparseRank {
    /// Independent rows, ascending.
    pub independent: Vec<usize>,
    /// Rows that depend on them, ascending.
    pub dependent: Vec<usize>,
    /// Smallest share of an independent row that is not in the span of those before it: a sine.
    pub smallest_sine: f64,
}

/// Unknowns that are eliminated together, with what they are coupled to further on.
#[derive(Default)]
struct Front {
    /// Unknowns as in [`constraint_order`].
    unknowns: Vec<usize>,
    /// Own block, column-major.
    diagonal: Vec<f64>,
    /// Sum of the magnitudes that made each entry of the diagonal.
    magnitude: Vec<f64>,
    /// Blocks with later fronts: as many rows as that one has unknowns, column-major.
    later: BTreeMap<usize, Vec<f64>>,
}

/// Unknowns that have nothing in common with the others, and the rows of them that are in doubt.
#[derive(Default)]
struct Part {
    columns: Vec<usize>,
    rows: Vec<usize>,
    open: Vec<Doubt>,
}

/// A row in doubt: its length, and what is left of it, in the metric of M^-1.
struct Doubt {
    row: usize,
    length: f64,
    left: Vec<f64>,
}

impl Doubt {
    fn sine(&self) -> f64 {
        if self.length > 0.0 { two_norm(&self.left) / self.length } else { 0.0 }
    }
}

/// By unknown: the part of the system that it belongs to.
fn parts(structure: &KktStructure) -> Vec<usize> {
    let mut above: Vec<usize> = (0..structure.n).collect();
    let of_rows =
        structure.jacobian.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| (pair[0].1, pair[1].1));
    for (a, b) in of_rows.chain(structure.mass.iter().copied()) {
        let (a, b) = (root(&mut above, a), root(&mut above, b));
        above[a.max(b)] = a.min(b);
    }
    (0..structure.n).map(|column| root(&mut above, column)).collect()
}

impl SparseRank {
    /// Eliminates cluster after cluster in the order of [`constraint_order`], with pivoting inside each cluster of rows. Rows
    /// of which nothing is left depend on those before them. Those that cannot be distinguished from round-off are left out, and
    /// looked at without squares against all that are beyond doubt. `None` where that does not tell either, or a cluster has to be
    /// eliminated too early: the dense engine then decides. Costs as much as a factorisation of [`SparseLdl`], and two
    /// solutions with it for each row in doubt of the part of the system that has most of them.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`], a slice of the wrong length.
    pub fn find(
        structure: &KktStructure,
        clusters: &Clusters,
        mass: &[f64],
        jacobian: &[f64],
    ) -> Result<Option<Self>, LinalgError> {
        check_length("mass", structure.mass.len(), mass.len())?;
        check_length("jacobian", structure.jacobian.len(), jacobian.len())?;
        let n = structure.n;
        let mut fronts = fronts(structure, clusters, mass, jacobian)?;
        let mut found = Self { independent: Vec::new(), dependent: Vec::new(), smallest_sine: 1.0 };
        let mut doubtful = Vec::new();
        for at in 0..fronts.len() {
            let mut front = std::mem::take(&mut fronts[at]);
            let is_rows = front.unknowns[0] >= n;
            let factored = front.factor(if is_rows { -1.0 } else { 1.0 }, is_rows, &mut found.smallest_sine);
            let Some((pivots, nothing_left)) = factored else { return Ok(None) };
            if is_rows {
                for (k, unknown) in front.unknowns.iter().enumerate() {
                    let left = if nothing_left { &mut found.dependent } else { &mut doubtful };
                    let list = if pivots.contains(&k) { &mut found.independent } else { left };
                    list.push(unknown - n);
                }
            }
            let eliminated = front.eliminate(&pivots);
            let sign = if is_rows { -1.0 } else { 1.0 };
            for (j, (near, left)) in eliminated.iter().enumerate() {
                for (far, right) in &eliminated[j..] {
                    update(&mut fronts, (*near, left), (*far, right), pivots.len(), sign);
                }
            }
        }
        found.independent.sort_unstable();
        let settled = doubtful.is_empty() || found.settle(doubtful, structure, clusters, (mass, jacobian))?;
        found.independent.sort_unstable();
        found.dependent.sort_unstable();
        Ok(settled.then_some(found))
    }

    /// Sorts out rows in doubt by what projection leaves of them: off the span of the independent rows, then off each other. `false`
    /// where that does not tell. One solution serves one row of each part of the system that has nothing in common with the others.
    fn settle(
        &mut self,
        doubtful: Vec<usize>,
        structure: &KktStructure,
        clusters: &Clusters,
        (mass, jacobian): (&[f64], &[f64]),
    ) -> Result<bool, LinalgError> {
        let part_of = parts(structure);
        let mut parts: BTreeMap<usize, Part> = BTreeMap::new();
        for row in doubtful {
            let first = structure.jacobian[structure.row(row)].first().map(|(_, column)| part_of[*column]);
            // A row without entries depends on any others.
            let Some(part) = first else {
                self.dependent.push(row);
                continue;
            };
            parts.entry(part).or_default().rows.push(row);
        }
        if parts.values().any(|part| part.rows.len() > MOST_DOUBTS) {
            return Ok(false);
        }
        for (column, part) in part_of.iter().enumerate() {
            if let Some(part) = parts.get_mut(part) {
                part.columns.push(column);
            }
        }
        let (mut solver, own) = self.engine(structure, clusters, mass, jacobian)?;
        solver.set_refinement(true);
        let mut metric = BlockCholesky::new(structure.n, &structure.mass);
        metric.factor(mass)?;
        let (mut a, mut lambda, g) = (vec![0.0; own.n], vec![0.0; own.m], vec![0.0; own.m]);
        let rounds = parts.values().map(|part| part.rows.len()).max().unwrap_or(0);
        for round in 0..rounds {
            let mut left = vec![0.0; structure.n];
            for row in parts.values().filter_map(|part| part.rows.get(round)) {
                structure.row(*row).for_each(|entry| left[structure.jacobian[entry].1] = jacobian[entry]);
            }
            let mut whole = left.clone();
            metric.solve_lower(&mut whole);
            // M a + J^T lambda = j with J a = 0: M a is what is left. Once more, since what is left may be small against j.
            for _ in 0..2 {
                solver.solve(&left, &g, &mut a, &mut lambda)?;
                left = times_mass(structure, mass, &a);
            }
            metric.solve_lower(&mut left);
            for part in parts.values_mut().filter(|part| part.rows.len() > round) {
                let own = |vector: &[f64]| part.columns.iter().map(|column| vector[*column]).collect::<Vec<f64>>();
                let doubt = Doubt { row: part.rows[round], length: two_norm(&own(&whole)), left: own(&left) };
                part.open.push(doubt);
            }
        }
        for part in parts.into_values() {
            if !self.settle_part(part.open) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The same for the rows of one part.
    fn settle_part(&mut self, mut open: Vec<Doubt>) -> bool {
        loop {
            let best = (0..open.len()).max_by(|a, b| open[*a].sine().total_cmp(&open[*b].sine()));
            let Some(best) = best else { return true };
            let largest = open[best].sine();
            if largest <= WITHIN {
                self.dependent.extend(open.iter().map(|doubt| doubt.row));
                return true;
            }
            if largest.is_nan() || largest < APART {
                return false;
            }
            self.smallest_sine = self.smallest_sine.min(largest);
            let Doubt { row, left: taken, .. } = open.swap_remove(best);
            self.independent.push(row);
            let square = dot(&taken, &taken);
            for Doubt { left, .. } in &mut open {
                let along = dot(left, &taken) / square;
                add_scaled(left, -along, &taken);
            }
        }
    }

    /// The engine of the independent rows alone, factored, with its structure. Allocates.
    ///
    /// # Errors
    /// See [`SparseLdl`].
    pub(super) fn engine(
        &self,
        structure: &KktStructure,
        clusters: &Clusters,
        mass: &[f64],
        jacobian: &[f64],
    ) -> Result<(SparseLdl, KktStructure), LinalgError> {
        let entries = || structure.jacobian.iter().zip(jacobian);
        let kept = |row: usize| self.independent.binary_search(&row).ok();
        let pattern = entries().filter_map(|((row, column), _)| Some((kept(*row)?, *column))).collect();
        let values: Vec<f64> =
            entries().filter(|((row, _), _)| kept(*row).is_some()).map(|(_, value)| *value).collect();
        let own = KktStructure::new(structure.n, self.independent.len(), structure.mass.clone(), pattern)?;
        let labels = self.independent.iter().map(|row| clusters.rows[*row]).collect();
        let clusters = Clusters { velocities: clusters.velocities.clone(), rows: labels };
        let mut solver = SparseLdl::with_computed_order(&own, Some(&clusters))?;
        solver.set_mass(mass)?;
        solver.refactor(&values)?;
        Ok((solver, own))
    }
}

/// A row of `J`.
pub(super) fn gradient(structure: &KktStructure, jacobian: &[f64], row: usize) -> Vec<f64> {
    let mut values = vec![0.0; structure.n];
    structure.row(row).for_each(|entry| values[structure.jacobian[entry].1] = jacobian[entry]);
    values
}

/// M a
pub(super) fn times_mass(structure: &KktStructure, mass: &[f64], a: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; a.len()];
    for ((i, j), value) in structure.mass.iter().zip(mass) {
        product[*i] += value * a[*j];
        if i != j {
            product[*j] += value * a[*i];
        }
    }
    product
}

/// The matrix as fronts in the order of elimination.
fn fronts(
    structure: &KktStructure,
    clusters: &Clusters,
    mass: &[f64],
    jacobian: &[f64],
) -> Result<Vec<Front>, LinalgError> {
    let n = structure.n;
    let order = constraint_order(structure, Some(clusters))?;
    let label = |unknown: usize| {
        if unknown < n { (false, clusters.velocities[unknown]) } else { (true, clusters.rows[unknown - n]) }
    };
    let mut fronts: Vec<Front> = Vec::new();
    // Front and number inside it, by unknown.
    let mut place = vec![(0, 0); order.len()];
    let mut last = None;
    for unknown in order {
        if last != Some(label(unknown)) {
            fronts.push(Front::default());
        }
        last = Some(label(unknown));
        let at = fronts.len() - 1;
        place[unknown] = (at, fronts[at].unknowns.len());
        fronts[at].unknowns.push(unknown);
    }
    for front in &mut fronts {
        front.diagonal = vec![0.0; front.unknowns.len() * front.unknowns.len()];
        front.magnitude = vec![0.0; front.unknowns.len()];
    }
    let of_mass = structure.mass.iter().copied().zip(mass);
    let of_rows = structure.jacobian.iter().map(|(row, column)| (n + row, *column)).zip(jacobian);
    for ((i, j), value) in of_mass.chain(of_rows) {
        let (mut near, mut far) = (place[i], place[j]);
        if near.0 > far.0 {
            std::mem::swap(&mut near, &mut far);
        }
        let rows = fronts[far.0].unknowns.len();
        if near.0 == far.0 {
            fronts[near.0].diagonal[near.1 + rows * far.1] = *value;
            fronts[near.0].diagonal[far.1 + rows * near.1] = *value;
            if near.1 == far.1 {
                fronts[near.0].magnitude[near.1] = value.abs();
            }
        } else {
            let columns = fronts[near.0].unknowns.len();
            let block = fronts[near.0].later.entry(far.0).or_insert_with(|| vec![0.0; rows * columns]);
            block[far.1 + rows * near.1] = *value;
        }
    }
    Ok(fronts)
}

impl Front {
    /// Cholesky factor of `sign` times the own block, in place, for the pivots returned in their order; `None` in doubt. With
    /// `may_drop` the rows of which little is left are no pivots; whether nothing is left of them comes with the pivots.
    fn factor(&mut self, sign: f64, may_drop: bool, smallest_sine: &mut f64) -> Option<(Vec<usize>, bool)> {
        let size = self.unknowns.len();
        let mut pivots: Vec<usize> = Vec::with_capacity(size);
        self.diagonal.iter_mut().for_each(|x| *x *= sign);
        while pivots.len() < size {
            let ratio = |k: usize| {
                let magnitude = self.magnitude[k];
                if magnitude > 0.0 { self.diagonal[k + size * k] / magnitude } else { 0.0 }
            };
            let open = (0..size).filter(|k| !pivots.contains(k));
            let best = open.max_by(|a, b| ratio(*a).total_cmp(&ratio(*b)))?;
            let share = ratio(best);
            if share < TRUSTED {
                // All that is left of the others is less still.
                let nothing_left = share <= NOTHING_LEFT && self.is_alone(&pivots);
                return may_drop.then_some((pivots, nothing_left));
            }
            if may_drop {
                // |d| / sum of magnitudes is s^2 / (2 - s^2).
                *smallest_sine = smallest_sine.min((2.0 * share / (1.0 + share)).sqrt());
            }
            let root = self.diagonal[best + size * best].sqrt();
            for i in (0..size).filter(|i| !pivots.contains(i) && *i != best) {
                self.diagonal[i + size * best] /= root;
            }
            self.diagonal[best + size * best] = root;
            pivots.push(best);
            for j in (0..size).filter(|j| !pivots.contains(j)) {
                let factor = self.diagonal[j + size * best];
                for i in (0..size).filter(|i| !pivots.contains(i)) {
                    self.diagonal[i + size * j] -= self.diagonal[i + size * best] * factor;
                }
                self.magnitude[j] += factor * factor;
            }
        }
        Some((pivots, true))
    }

    /// Whether the unknowns that are no pivots are coupled to nothing further on, so that nothing later can save them.
    fn is_alone(&self, pivots: &[usize]) -> bool {
        let size = self.unknowns.len();
        self.later.values().all(|block| {
            let rows = block.len() / size;
            let largest = block.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let part = |k: usize| &block[rows * k..rows * (k + 1)];
            let mut left: Vec<Vec<f64>> = (0..size).map(|k| part(k).to_vec()).collect();
            // What elimination of the pivots takes off.
            for (number, pivot) in pivots.iter().enumerate() {
                let scaled: Vec<f64> = left[*pivot].iter().map(|x| x / self.diagonal[pivot + size * pivot]).collect();
                for k in (0..size).filter(|k| !pivots[..=number].contains(k)) {
                    let factor = self.diagonal[k + size * pivot];
                    left[k].iter_mut().zip(&scaled).for_each(|(x, y)| *x -= factor * y);
                }
            }
            let rest = (0..size).filter(|k| !pivots.contains(k));
            rest.flat_map(|k| &left[k]).all(|x| x.abs() <= TRUSTED * largest)
        })
    }

    /// The blocks with later fronts times the inverse of the factor: one column per pivot.
    fn eliminate(&self, pivots: &[usize]) -> Vec<(usize, Vec<f64>)> {
        let size = self.unknowns.len();
        let solved = self.later.iter().map(|(later, block)| {
            let rows = block.len() / size;
            let mut result: Vec<f64> = Vec::with_capacity(rows * pivots.len());
            for (number, pivot) in pivots.iter().enumerate() {
                let mut column = block[rows * pivot..rows * (pivot + 1)].to_vec();
                for (k, before) in pivots[..number].iter().enumerate() {
                    let factor = self.diagonal[pivot + size * before];
                    let done = &result[rows * k..rows * (k + 1)];
                    column.iter_mut().zip(done).for_each(|(x, y)| *x -= factor * y);
                }
                column.iter_mut().for_each(|x| *x /= self.diagonal[pivot + size * pivot]);
                result.extend(column);
            }
            (*later, result)
        });
        solved.collect()
    }
}

/// Takes `sign` right left^T off the block of two later fronts (near not after far).
fn update(fronts: &mut [Front], near: (usize, &[f64]), far: (usize, &[f64]), pivots: usize, sign: f64) {
    let (columns, rows) = (fronts[near.0].unknowns.len(), fronts[far.0].unknowns.len());
    let target = &mut fronts[near.0];
    let block = if near.0 == far.0 {
        for k in 0..rows {
            target.magnitude[k] += (0..pivots).map(|p| far.1[k + rows * p].powi(2)).sum::<f64>();
        }
        &mut target.diagonal
    } else {
        target.later.entry(far.0).or_insert_with(|| vec![0.0; rows * columns])
    };
    for p in 0..pivots {
        for j in 0..columns {
            let factor = sign * near.1[j + columns * p];
            for i in 0..rows {
                block[i + rows * j] -= far.1[i + rows * p] * factor;
            }
        }
    }
}
