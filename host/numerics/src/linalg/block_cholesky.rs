//! Cholesky factor of a symmetric positive definite matrix that falls apart into small blocks.

use super::{LinalgError, check_length};

/// `M = L L^T`, one dense factor per connected block of the pattern.
///
/// Two unknowns are in the same block if a chain of off-diagonal entries joins them; their
/// indices need not be neighbours. A diagonal matrix has `n` blocks of size one.
#[derive(Debug, Clone)]
pub struct BlockCholesky {
    blocks: Vec<Block>,
    /// Per pattern entry: block and place in that block's storage.
    places: Vec<(usize, usize)>,
    factored: bool,
}

#[derive(Debug, Clone)]
struct Block {
    /// Unknowns of the block, ascending.
    unknowns: Vec<usize>,
    /// `L`, dense, column-major, upper part unused.
    factor: Vec<f64>,
}

impl BlockCholesky {
    /// Finds the blocks of a pattern given as `(row, column)` of the lower triangle.
    /// Indices must be below `n` (see [`super::KktStructure::validate`]).
    pub fn new(n: usize, pattern: &[(usize, usize)]) -> Self {
        let members = connected_blocks(n, pattern.iter().copied());
        let mut place_of = vec![(0, 0); n];
        for (block, unknowns) in members.iter().enumerate() {
            unknowns.iter().enumerate().for_each(|(place, unknown)| place_of[*unknown] = (block, place));
        }
        let places = pattern
            .iter()
            .map(|&(row, column)| {
                let (block, place) = place_of[row];
                (block, place + members[block].len() * place_of[column].1)
            })
            .collect();
        let blocks = members
            .into_iter()
            .map(|unknowns| Block { factor: vec![0.0; unknowns.len() * unknowns.len()], unknowns })
            .collect();
        Self { blocks, places, factored: false }
    }

    /// Factors the matrix with these values, aligned with the pattern. Allocates nothing.
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`] with the first row whose pivot vanishes against
    /// its diagonal value, [`LinalgError::NotFinite`], a slice of the wrong length.
    pub fn factor(&mut self, values: &[f64]) -> Result<(), LinalgError> {
        self.factored = false;
        check_length("mass", self.places.len(), values.len())?;
        if !values.iter().all(|value| value.is_finite()) {
            return Err(LinalgError::NotFinite { what: "mass" });
        }
        for block in &mut self.blocks {
            block.factor.fill(0.0);
        }
        for (&(block, place), &value) in self.places.iter().zip(values) {
            self.blocks[block].factor[place] = value;
        }
        for block in &mut self.blocks {
            block.factor_in_place()?;
        }
        self.factored = true;
        Ok(())
    }

    /// Whether the last [`BlockCholesky::factor`] succeeded.
    pub fn is_factored(&self) -> bool {
        self.factored
    }

    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Unknowns of one block, ascending.
    pub fn unknowns(&self, block: usize) -> &[usize] {
        &self.blocks[block].unknowns
    }

    /// `x := L^-1 x`
    pub fn solve_lower(&self, x: &mut [f64]) {
        for block in &self.blocks {
            block.solve_lower(x);
        }
    }

    /// `x := L^-1 x` for the unknowns of one block only.
    pub fn solve_lower_block(&self, block: usize, x: &mut [f64]) {
        self.blocks[block].solve_lower(x);
    }

    /// `x := L^-T x`
    pub fn solve_upper(&self, x: &mut [f64]) {
        for block in &self.blocks {
            block.solve_upper(x);
        }
    }
}

impl Block {
    /// Right-looking Cholesky, column by column.
    fn factor_in_place(&mut self) -> Result<(), LinalgError> {
        let size = self.unknowns.len();
        for k in 0..size {
            // What is left of the diagonal after its own cancellation; below round-off of the
            // original value it carries no digit.
            let pivot = self.factor[k + size * k];
            let removed: f64 = (0..k).map(|j| self.factor[k + size * j].powi(2)).sum();
            let round_off = 4.0 * f64::EPSILON * (pivot + removed) * size as f64;
            if pivot <= round_off {
                return Err(LinalgError::NotPositiveDefinite { row: self.unknowns[k] });
            }
            let root = pivot.sqrt();
            self.factor[k + size * k] = root;
            for i in k + 1..size {
                self.factor[i + size * k] /= root;
            }
            for j in k + 1..size {
                let multiplier = self.factor[j + size * k];
                for i in j..size {
                    self.factor[i + size * j] -= self.factor[i + size * k] * multiplier;
                }
            }
        }
        Ok(())
    }

    fn solve_lower(&self, x: &mut [f64]) {
        let size = self.unknowns.len();
        for k in 0..size {
            let value = x[self.unknowns[k]] / self.factor[k + size * k];
            x[self.unknowns[k]] = value;
            for i in k + 1..size {
                x[self.unknowns[i]] -= self.factor[i + size * k] * value;
            }
        }
    }

    fn solve_upper(&self, x: &mut [f64]) {
        let size = self.unknowns.len();
        for k in (0..size).rev() {
            let mut value = x[self.unknowns[k]];
            for i in k + 1..size {
                value -= self.factor[i + size * k] * x[self.unknowns[i]];
            }
            x[self.unknowns[k]] = value / self.factor[k + size * k];
        }
    }
}

/// The blocks of `n` unknowns that `pattern` connects, directly or by others: the members of each, ascending, in the order of their first.
pub fn connected_blocks(n: usize, pattern: impl IntoIterator<Item = (usize, usize)>) -> Vec<Vec<usize>> {
    let mut parent: Vec<usize> = (0..n).collect();
    for (row, column) in pattern {
        let a = find_root(&mut parent, row);
        let b = find_root(&mut parent, column);
        // The smaller index becomes the root, so a block is named after its first unknown.
        parent[a.max(b)] = a.min(b);
    }
    let mut label = vec![0; n];
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    for unknown in 0..n {
        let root = find_root(&mut parent, unknown);
        if root == unknown {
            label[unknown] = blocks.len();
            blocks.push(vec![unknown]);
        } else {
            blocks[label[root]].push(unknown);
        }
    }
    blocks
}

/// Root of an element in a union-find forest; shortens the path behind it.
pub(super) fn find_root(parent: &mut [usize], mut element: usize) -> usize {
    while parent[element] != element {
        parent[element] = parent[parent[element]];
        element = parent[element];
    }
    element
}
