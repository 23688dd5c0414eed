//! [`Halves`]: which unknowns of the matrices of implicit steps others give at once.

use super::fill::bits;

/// Unknowns of `(shift I - J) x = b` that need no elimination. A position `p` whose rate is a multiple of one velocity `v`, so
/// that its row of `J` has one entry `c`, is `x_p = (b_p + c x_v) / shift`; put into the other rows, it leaves
/// `shift I - J_oo - J_op c / shift` with the second part in the columns of velocities: half the size for a mechanism in
/// coordinates of its joints (Hairer & Wanner II, section IV.8, "second order differential equations"). A sum that nothing depends on
/// follows from its row. All others are kept.
#[derive(Debug, Clone, Default)]
pub(super) struct Halves {
    pub(super) pairs: Vec<Pair>,
    pub(super) sums: Vec<Quadrature>,
    /// Unknowns of the matrix that is left, ascending.
    pub(super) kept: Vec<usize>,
    /// Its pattern, by columns: a bit for each of its rows; the diagonal where `J` has it.
    pub(super) pattern: Vec<u64>,
}

/// A position and what it follows from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) position: usize,
    pub(super) velocity: usize,
    /// The entry of the row of the position.
    pub(super) slope: f64,
}

/// A sum and its row.
#[derive(Debug, Clone)]
pub(super) struct Quadrature {
    pub(super) unknown: usize,
    /// Column and entry.
    pub(super) row: Vec<(u32, f64)>,
}

impl Halves {
    /// For `n` unknowns, all of which are kept, with this pattern of `J`, by columns.
    pub(super) fn none(n: usize, pattern: &[u64]) -> Self {
        Self { kept: (0..n).collect(), pattern: pattern.to_vec(), ..Self::default() }
    }

    /// For `n` unknowns with this pattern of `J`, by columns.
    pub(super) fn of(n: usize, pattern: &[u64]) -> Self {
        let words = n.div_ceil(64);
        let columns: Vec<&[u64]> = pattern.chunks_exact(words.max(1)).collect();
        // By row: entries, and the column of the last.
        let mut rows = vec![(0, 0); n];
        for (column, entries) in columns.iter().enumerate() {
            bits(entries).for_each(|row| rows[row] = (rows[row].0 + 1, column));
        }
        let (mut free, mut found) = (vec![true; n], Self::default());
        for (position, (entries, velocity)) in rows.into_iter().enumerate() {
            if entries == 1 && velocity != position && free[position] && free[velocity] {
                (free[position], free[velocity]) = (false, false);
                found.pairs.push(Pair { position, velocity, slope: 0.0 });
            }
        }
        let mut kept = vec![true; n];
        found.pairs.iter().for_each(|pair| kept[pair.position] = false);
        for unknown in (0..n).filter(|k| free[*k] && columns[*k].iter().all(|word| *word == 0)) {
            kept[unknown] = false;
            let row = (0..n).filter(|k| columns[*k][unknown / 64] >> (unknown % 64) & 1 == 1);
            found.sums.push(Quadrature { unknown, row: row.map(|column| (column as u32, 0.0)).collect() });
        }
        found.kept = (0..n).filter(|k| kept[*k]).collect();
        found.leave(n, &columns);
        found
    }

    /// Finds the pattern of what is kept.
    fn leave(&mut self, n: usize, columns: &[&[u64]]) {
        let mut place_of = vec![None; n];
        self.kept.iter().enumerate().for_each(|(place, unknown)| place_of[*unknown] = Some(place));
        let words = self.kept.len().div_ceil(64);
        self.pattern = vec![0; words * self.kept.len()];
        let own = self.kept.iter().map(|unknown| (*unknown, *unknown));
        for (from, to) in own.chain(self.pairs.iter().map(|pair| (pair.position, pair.velocity))) {
            let Some(place) = place_of[to] else { continue };
            for row in bits(columns[from]).filter_map(|row| place_of[row]) {
                self.pattern[words * place + row / 64] |= 1 << (row % 64);
            }
        }
    }

    /// How many unknowns are not kept.
    pub(super) fn saved(&self) -> usize {
        self.pairs.len() + self.sums.len()
    }

    /// Takes the entries of `J`, by row and column.
    pub(super) fn take(&mut self, jacobian: impl Fn(usize, usize) -> f64) {
        for Pair { position, velocity, slope } in &mut self.pairs {
            *slope = jacobian(*position, *velocity);
        }
        for Quadrature { unknown, row } in &mut self.sums {
            row.iter_mut().for_each(|(column, entry)| *entry = jacobian(*unknown, *column as usize));
        }
    }
}
