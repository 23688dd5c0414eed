//! [`Fill`]: in which order the matrices of implicit steps are eliminated, and which entries they have then.

use super::halves::Halves;
use super::jacobian::Columns;

/// What an operation on scattered entries takes, in operations on entries side by side. Measured.
const SCATTERED: usize = 4;
/// Share of the operations of the dense elimination up to which it is left.
const WORTH: f64 = 0.5;

/// The order of elimination of `shift I - J` for a `J` with a certain pattern: of what [`Halves`] keep first unknowns of which rows
/// and columns are short, with pivots on the diagonal (Markowitz 1957); then all others as a dense matrix. Nothing is eliminated
/// ahead where that saves little.
#[derive(Debug, Clone, Default)]
pub(super) struct Fill {
    n: usize,
    /// Entries of `J` that were not zero at some time: by columns, a bit each.
    pattern: Vec<u64>,
    /// By column: where its entries begin among [`Fill::known`]; then where the last ends.
    first: Vec<usize>,
    /// These entries, by columns, then rows.
    known: Vec<f64>,
    /// One column of `J`; zero between uses.
    column: Vec<f64>,
    pub(super) halves: Halves,
    /// The unknown at each place of the matrix that is kept.
    pub(super) order: Vec<usize>,
    /// Places before the dense rest.
    pub(super) head: usize,
    /// By place: where the entries of that row come from.
    entries: Vec<Vec<Source>>,
    /// By place: the entries of that row.
    pub(super) values: Vec<Vec<Entry>>,
    /// Where kept rows have entries in the columns of positions, by columns.
    pub(super) through: Vec<Through>,
    /// These entries, one run after the other.
    pub(super) through_values: Vec<f64>,
    /// By place: places of the head before it that its row has entries at, ascending.
    pub(super) before: Vec<Vec<u32>>,
    /// By place of the head: places after it that its row has entries at, ascending.
    pub(super) after: Vec<Vec<u32>>,
}

/// An entry of a matrix `J_oo + J_op c / shift`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Its place in the row.
    pub(super) column: u32,
    /// `J_oo`.
    pub(super) own: f64,
    /// `J_op c`.
    pub(super) through: f64,
}

/// Entries of a column of a position in rows at places side by side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Through {
    pub(super) position: u32,
    /// The first place, and how many there are.
    pub(super) place: u32,
    pub(super) count: u32,
}

/// Where an entry comes from: places among [`Fill::known`], and the pair of the second.
#[derive(Debug, Clone, Copy)]
struct Source {
    column: u32,
    own: Option<u32>,
    through: Option<(u32, u32)>,
}

/// What matrices take, in operations of dense linear algebra.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Work {
    pub(super) factorisation: f64,
    /// For one right side.
    pub(super) solution: f64,
}

impl Work {
    /// Of all matrices of a step of [`super::Radau5`] with `n` unknowns, dense as they are: what is assumed before any is known.
    pub(super) fn dense_step(n: usize) -> Self {
        let n = n as f64;
        Self { factorisation: n.powi(3), solution: 5.0 * n.powi(2) }
    }
}

impl Fill {
    /// What a real matrix and so many complex ones take together, operations on complex numbers as four.
    pub(super) fn work(&self, complex: usize) -> Work {
        let matrices = (1 + 4 * complex) as f64;
        let rest = (self.order.len() - self.head) as f64;
        let behind = |k: &u32| self.after[*k as usize].len();
        let taken: usize = self.before.iter().flatten().map(behind).sum();
        let ahead: usize = self.before.iter().chain(&self.after).map(Vec::len).sum();
        let [taken, ahead] = [taken, ahead].map(|count| (SCATTERED * count) as f64);
        Work { factorisation: matrices * (taken + rest.powi(3) / 3.0), solution: matrices * (ahead + rest.powi(2)) }
    }

    /// For `n` unknowns; no entry is known yet.
    pub(super) fn resize(&mut self, n: usize) {
        *self = Self {
            n,
            pattern: vec![0; n * n.div_ceil(64)],
            first: vec![0; n + 1],
            column: vec![0.0; n],
            ..Self::default()
        };
        self.halves = Halves::none(n, &self.pattern);
        self.arrange(Vec::new(), &[]);
    }

    /// All of `jacobian`, which was taken last, in one dense matrix, in its own order.
    pub(super) fn leave_dense(&mut self, jacobian: &Columns) {
        self.halves = Halves::none(self.n, &self.pattern);
        self.arrange(Vec::new(), &[]);
        self.take(jacobian);
    }

    /// Unknowns that are not in the dense rest.
    pub(super) fn ahead(&self) -> usize {
        self.halves.saved() + self.head
    }

    /// Takes `jacobian`. True if it has entries that were zero up to now.
    pub(super) fn take(&mut self, jacobian: &Columns) -> bool {
        let words = self.n.div_ceil(64);
        let mut grown = false;
        for (column, known) in self.pattern.chunks_exact_mut(words.max(1)).enumerate() {
            for (row, _) in jacobian.column(column) {
                let bit = 1 << (row % 64);
                grown |= known[row / 64] & bit == 0;
                known[row / 64] |= bit;
            }
        }
        if grown {
            self.count();
            self.halves = Halves::of(self.n, &self.pattern);
            let (head, fill) = self.choose();
            self.arrange(head, &fill);
        }
        self.gather(jacobian);
        let Self { pattern, first, known, halves, .. } = self;
        let entry = |row: usize, column: usize| place(pattern, first, row, column).map_or(0.0, |place| known[place]);
        halves.take(entry);
        for (values, sources) in self.values.iter_mut().zip(&self.entries) {
            for (entry, source) in values.iter_mut().zip(sources) {
                entry.own = source.own.map_or(0.0, |at| known[at as usize]);
                if let Some((at, pair)) = source.through {
                    entry.through = known[at as usize] * halves.pairs[pair as usize].slope;
                }
            }
        }
        let places =
            self.through.iter().flat_map(|run| (run.place..run.place + run.count).map(move |place| (place, run)));
        for (value, (place, run)) in self.through_values.iter_mut().zip(places) {
            *value = entry(self.order[place as usize], run.position as usize);
        }
        grown
    }

    /// Counts the entries of the pattern.
    fn count(&mut self) {
        let words = self.n.div_ceil(64).max(1);
        for (column, entries) in self.pattern.chunks_exact(words).enumerate() {
            let count: u32 = entries.iter().map(|word| word.count_ones()).sum();
            self.first[column + 1] = self.first[column] + count as usize;
        }
        self.known = vec![0.0; self.first[self.n]];
    }

    /// Takes the values of the entries of the pattern.
    fn gather(&mut self, jacobian: &Columns) {
        let words = self.n.div_ceil(64).max(1);
        for (column, entries) in self.pattern.chunks_exact(words).enumerate() {
            jacobian.column(column).for_each(|(row, value)| self.column[row] = value);
            for (row, value) in bits(entries).zip(&mut self.known[self.first[column]..]) {
                *value = std::mem::take(&mut self.column[row]);
            }
        }
    }

    /// Which of the unknowns that are kept are eliminated ahead, in their order, and the rows with what they then have: a bit for
    /// each column.
    fn choose(&self) -> (Vec<usize>, Vec<u64>) {
        let n = self.halves.kept.len();
        let words = n.div_ceil(64);
        let mut columns = self.halves.pattern.clone();
        let mut rows = vec![0_u64; n * words];
        for k in 0..n {
            columns[words * k + k / 64] |= 1 << (k % 64);
        }
        for column in 0..n {
            for row in bits(&columns[words * column..words * (column + 1)]) {
                rows[words * row + column / 64] |= 1 << (column % 64);
            }
        }
        let count = |list: &[u64], k: usize| -> usize {
            list[words * k..words * (k + 1)].iter().map(|word| word.count_ones() as usize).sum()
        };
        let mut lengths: Vec<[usize; 2]> = (0..n).map(|k| [count(&rows, k) - 1, count(&columns, k) - 1]).collect();
        let (mut left, mut order, mut operations) = (vec![true; n], Vec::new(), 0);
        // What is left of rows and columns; eliminated ones are taken out of these, but stay in `fill`.
        let mut fill = rows.clone();
        while let Some(k) = (0..n).filter(|k| left[*k]).min_by_key(|k| lengths[*k][0] * lengths[*k][1]) {
            let cost = SCATTERED * lengths[k][0] * lengths[k][1];
            let others = n - order.len() - 1;
            if cost > others * others {
                break;
            }
            operations += cost;
            left[k] = false;
            order.push(k);
            let own_row: Vec<u64> = rows[words * k..words * (k + 1)].to_vec();
            let own_column: Vec<u64> = columns[words * k..words * (k + 1)].to_vec();
            for (own, list, across) in [(&own_column, &mut rows, &own_row), (&own_row, &mut columns, &own_column)] {
                for other in bits(own).filter(|other| left[*other]) {
                    let entries = &mut list[words * other..words * (other + 1)];
                    entries.iter_mut().zip(across).for_each(|(to, bits)| *to |= bits);
                    entries[k / 64] &= !(1 << (k % 64));
                }
            }
            for other in bits(&own_column).filter(|other| left[*other]) {
                let entries = &mut fill[words * other..words * (other + 1)];
                entries.iter_mut().zip(&own_row).for_each(|(to, bits)| *to |= bits);
                lengths[other][0] = count(&rows, other) - 1;
            }
            for other in bits(&own_row).filter(|other| left[*other]) {
                lengths[other][1] = count(&columns, other) - 1;
            }
        }
        let rest = (n - order.len()) as f64;
        let total = operations as f64 + rest.powi(3) / 3.0;
        if total > WORTH * (n as f64).powi(3) / 3.0 {
            order.clear();
        }
        (order, fill)
    }

    /// Makes the lists for an order of the head.
    fn arrange(&mut self, head: Vec<usize>, fill: &[u64]) {
        let n = self.halves.kept.len();
        let words = n.div_ceil(64);
        self.head = head.len();
        let mut place_of = vec![usize::MAX; n];
        head.iter().enumerate().for_each(|(place, unknown)| place_of[*unknown] = place);
        let mut order = head;
        for (unknown, place) in place_of.iter_mut().enumerate().filter(|(_, place)| **place == usize::MAX) {
            *place = order.len();
            order.push(unknown);
        }
        self.list_entries(&place_of);
        (self.before, self.after) = (vec![Vec::new(); n], vec![Vec::new(); self.head]);
        if self.head > 0 {
            for (place, unknown) in order.iter().enumerate() {
                let mut places: Vec<u32> =
                    bits(&fill[words * unknown..words * (unknown + 1)]).map(|column| place_of[column] as u32).collect();
                places.sort_unstable();
                let (end, head) = (place as u32, self.head as u32);
                self.before[place] = places.iter().copied().filter(|k| *k < end.min(head)).collect();
                if place < self.head {
                    self.after[place] = places.into_iter().filter(|k| *k > end).collect();
                }
            }
        }
        self.order = order.into_iter().map(|unknown| self.halves.kept[unknown]).collect();
    }

    /// Finds where entries come from, with the place of each unknown that is kept.
    fn list_entries(&mut self, place_of: &[usize]) {
        let (n, kept) = (self.n, &self.halves.kept);
        let mut position_of = vec![None; n];
        for (number, pair) in self.halves.pairs.iter().enumerate() {
            position_of[pair.velocity] = Some((number as u32, pair.position));
        }
        self.entries = vec![Vec::new(); kept.len()];
        self.through.clear();
        let mut throughs = 0;
        let words = kept.len().div_ceil(64);
        for (column, rows) in self.halves.pattern.chunks_exact(words.max(1)).enumerate() {
            for row in bits(rows) {
                let at = |column: usize| place(&self.pattern, &self.first, kept[row], column).map(|at| at as u32);
                let own = at(kept[column]);
                let mut source = Source { column: place_of[column] as u32, own, through: None };
                if let Some((pair, position)) = position_of[kept[column]]
                    && let Some(through) = at(position)
                {
                    source.through = Some((through, pair));
                    throughs += 1;
                    let (place, position) = (place_of[row] as u32, position as u32);
                    match self.through.last_mut() {
                        Some(run) if run.position == position && run.place + run.count == place => run.count += 1,
                        _ => self.through.push(Through { position, place, count: 1 }),
                    }
                }
                self.entries[place_of[row]].push(source);
            }
        }
        self.through_values = vec![0.0; throughs];
        let value = |source: &Source| Entry { column: source.column, own: 0.0, through: 0.0 };
        self.values = self.entries.iter().map(|sources| sources.iter().map(value).collect()).collect();
    }
}

/// The place of an entry among those of a pattern, the columns of which begin at `first`.
fn place(pattern: &[u64], first: &[usize], row: usize, column: usize) -> Option<usize> {
    let words = (first.len() - 1).div_ceil(64);
    let entries = &pattern[words * column..words * (column + 1)];
    let (before, own) = (&entries[..row / 64], entries[row / 64]);
    let ones = |word: u64| word.count_ones() as usize;
    let below = before.iter().map(|word| ones(*word)).sum::<usize>() + ones(own & ((1 << (row % 64)) - 1));
    (own >> (row % 64) & 1 == 1).then(|| first[column] + below)
}

/// The places of the bits that are set, ascending.
pub(super) fn bits(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    words.iter().enumerate().flat_map(|(at, word)| {
        let mut rest = *word;
        std::iter::from_fn(move || {
            let bit = rest.trailing_zeros() as usize;
            let found = (rest != 0).then_some(64 * at + bit);
            rest &= rest.wrapping_sub(1);
            found
        })
    })
}
