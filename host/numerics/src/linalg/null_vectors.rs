//! Null vectors: what of the independent rows each dependent one is made of.

use super::sparse_rank::{gradient, times_mass};
use super::{Clusters, KktSolver, KktStructure, LinalgError, NullVector, SparseLdl, SparseRank, add_scaled};

/// What is left of a dependent row must be below this share of it, when it is looked at without squares.
const NOTHING_LEFT_OF_VECTOR: f64 = 1e-8;
/// Coefficients below this share of the largest one do not count in a null vector.
const NEGLIGIBLE: f64 = 1e-9;
/// Where there are more dependent rows, every so many-th of them are looked at together.
const STRIDE: usize = 64;

impl SparseRank {
    /// For each dependent row a vector `lambda` with `J^T lambda = 0`, as (row, value) with a one on the dependent row. `None`
    /// where one of them turns out not to depend on the others, by less than squares can show. One solution with the independent
    /// rows for each of them; where there are many, one for rows far apart from each other that turn out to have nothing to do with
    /// each other: as many as there are in a neighbourhood. `[report]`, allocates.
    ///
    /// # Errors
    /// See [`SparseLdl`].
    pub fn null_space(
        &self,
        structure: &KktStructure,
        clusters: &Clusters,
        mass: &[f64],
        jacobian: &[f64],
    ) -> Result<Option<Vec<NullVector>>, LinalgError> {
        if self.dependent.is_empty() {
            return Ok(Some(Vec::new()));
        }
        let mut search = Search::new(self, structure, clusters, (mass, jacobian))?;
        let count = self.dependent.len();
        let mut vectors: Vec<Option<NullVector>> = vec![None; count];
        if count > STRIDE {
            for first in 0..STRIDE {
                let rows: Vec<usize> = (first..count).step_by(STRIDE).map(|k| self.dependent[k]).collect();
                let found = search.together(&rows)?;
                if found.iter().all(Option::is_none) {
                    break;
                }
                found.into_iter().enumerate().for_each(|(k, vector)| vectors[first + STRIDE * k] = vector);
            }
        }
        for (row, vector) in self.dependent.iter().zip(&mut vectors) {
            if vector.is_none() {
                let Some(found) = search.together(&[*row])?.pop().flatten() else { return Ok(None) };
                *vector = Some(found);
            }
        }
        Ok(Some(vectors.into_iter().flatten().collect()))
    }
}

/// A factorisation of the independent rows, and what solutions with it need.
pub(super) struct Search<'a> {
    rank: &'a SparseRank,
    structure: &'a KktStructure,
    mass: &'a [f64],
    jacobian: &'a [f64],
    solver: SparseLdl,
    own: KktStructure,
}

impl<'a> Search<'a> {
    /// Factors.
    ///
    /// # Errors
    /// See [`SparseLdl`].
    pub(super) fn new(
        rank: &'a SparseRank,
        structure: &'a KktStructure,
        clusters: &Clusters,
        (mass, jacobian): (&'a [f64], &'a [f64]),
    ) -> Result<Self, LinalgError> {
        let (mut solver, own) = rank.engine(structure, clusters, mass, jacobian)?;
        solver.set_refinement(true);
        Ok(Self { rank, structure, mass, jacobian, solver, own })
    }

    /// The null vectors of dependent rows, by one solution for the sum of them. `None` for those whose vectors cannot be found
    /// apart; for all of them where something is left of the sum.
    ///
    /// # Errors
    /// See [`SparseLdl`].
    pub(super) fn together(&mut self, rows: &[usize]) -> Result<Vec<Option<NullVector>>, LinalgError> {
        let size = |x: &[f64]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut f = vec![0.0; self.own.n];
        let mut least = f64::INFINITY;
        for row in rows {
            let own = gradient(self.structure, self.jacobian, *row);
            least = least.min(size(&own));
            add_scaled(&mut f, -1.0, &own);
        }
        let (mut a, mut lambda) = (vec![0.0; self.own.n], vec![0.0; self.own.m]);
        // M a + J^T lambda = -j with J a = 0: a vanishes, since j is in the span.
        self.solver.solve(&f, &vec![0.0; self.own.m], &mut a, &mut lambda)?;
        if size(&times_mass(self.structure, self.mass, &a)) > NOTHING_LEFT_OF_VECTOR * least {
            return Ok(vec![None; rows.len()]);
        }
        let largest = lambda.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
        let independent = self.rank.independent.iter().copied().zip(lambda);
        let some: Vec<(usize, f64)> = independent.filter(|(_, x)| x.abs() > NEGLIGIBLE * largest).collect();
        if let [row] = rows {
            return Ok(vec![Some(some.into_iter().chain([(*row, 1.0)]).collect())]);
        }
        Ok(self.apart(rows, &some))
    }

    /// Sorts the coefficients of a sum by the dependent rows that they belong to: rows that have unknowns in common do. Those that
    /// are connected have no vectors.
    fn apart(&self, rows: &[usize], coefficients: &[(usize, f64)]) -> Vec<Option<NullVector>> {
        let mut above: Vec<usize> = (0..self.own.n).collect();
        for row in rows.iter().chain(coefficients.iter().map(|(row, _)| row)) {
            let mut columns = self.columns(*row);
            let Some(first) = columns.next() else { continue };
            for column in columns {
                let (a, b) = (root(&mut above, first), root(&mut above, column));
                above[a] = b;
            }
        }
        let mut place = |row: usize| self.columns(row).next().map(|column| root(&mut above, column));
        let of_rows: Vec<Option<usize>> = rows.iter().map(|row| place(*row)).collect();
        let mut number_at = vec![None; self.own.n];
        for (number, at) in of_rows.iter().enumerate() {
            let Some(at) = *at else { continue };
            // Two of them in one place: none.
            number_at[at] = if number_at[at].is_none() { Some(number) } else { Some(usize::MAX) };
        }
        let mut vectors: Vec<NullVector> = vec![Vec::new(); rows.len()];
        for (row, value) in coefficients {
            let number = place(*row).and_then(|at| number_at[at]);
            if let Some(vector) = number.and_then(|number| vectors.get_mut(number)) {
                vector.push((*row, *value));
            }
        }
        let is_alone = |number: usize, at: Option<usize>| at.is_some_and(|at| number_at[at] == Some(number));
        let pairs = vectors.into_iter().zip(rows).zip(of_rows).enumerate();
        let finish = |(number, ((mut vector, row), at)): (usize, ((NullVector, &usize), Option<usize>))| {
            let largest = vector.iter().fold(1.0_f64, |most, (_, x)| most.max(x.abs()));
            vector.retain(|(_, x)| x.abs() > NEGLIGIBLE * largest);
            vector.push((*row, 1.0));
            is_alone(number, at).then_some(vector)
        };
        pairs.map(finish).collect()
    }

    /// The unknowns of a row.
    fn columns(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.structure.jacobian[self.structure.row(row)].iter().map(|(_, column)| *column)
    }
}

/// The representative of a set (Tarjan 1975).
pub(super) fn root(above: &mut [usize], of: usize) -> usize {
    let mut at = of;
    while above[at] != at {
        above[at] = above[above[at]];
        at = above[at];
    }
    at
}
