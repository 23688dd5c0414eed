//! [`Indeterminate`]: reactions of contacts that rigid bodies leave open.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

use super::{Grip, Meeting, Pattern, RANK_TOLERANCE, block, blocks};

/// Share of a row in reactions that balance each other above which it takes part.
pub(super) const TAKES_PART: f64 = 1e-6;
/// Share of what friction could change of the motion above which it does.
const MOVES: f64 = 1e-9;

/// More contacts touch, or stick, than the motion determines the reactions of: reactions that balance each other may be added.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Indeterminate {
    /// What is open of whose load: the components of its force, ground directions, then its torque.
    pub loads: Vec<(Holder, [bool; 4])>,
    /// Numbers of frictions that slide, whose limits depend on these reactions, where the motion depends on them, too.
    pub moving: Vec<usize>,
}

/// Whose rows hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holder {
    /// A contact: a place among those that touch.
    Contact(usize),
    /// A friction: its number.
    Friction(usize),
}

impl Meeting {
    /// What the pattern leaves open, where rows have these accelerations while all contacts are open, and speeds and accelerations are
    /// of these sizes. A table on four legs is the example.
    ///
    /// The rows that hold are dependent where their Delassus matrix is singular; its null vectors are reactions in balance. They
    /// can be added to the pattern's unless contacts without reaction would have to push and to pull for that.
    #[must_use]
    pub fn indeterminate(
        &self,
        pattern: &Pattern,
        of_rows: &DVector<f64>,
        [speed, acceleration]: [f64; 2],
    ) -> Option<Indeterminate> {
        let w = &self.delassus * &pattern.forces + of_rows;
        let silent = |k: &usize| {
            let accelerates = w[self.first[*k]].abs() > self.no_acceleration(*k, acceleration);
            !pattern.closed.contains(k) && self.stays(*k, speed) && self.gives_way(*k) && !accelerates
        };
        let silent = (0..self.touching.len()).filter(silent);
        let contacts: Vec<usize> = pattern.closed.iter().copied().chain(silent).collect();
        let sticking = || self.grips.iter().filter(|grip| pattern.sticking.contains(&grip.number));
        let mut rows: Vec<usize> = contacts.iter().flat_map(|k| self.first[*k]..self.first[k + 1]).collect();
        rows.extend(sticking().flat_map(|grip| grip.rows.iter().copied()));
        let largest = rows.iter().fold(0.0_f64, |most, row| most.max(pattern.forces[*row].abs()));
        if rows.is_empty() || largest == 0.0 {
            return None;
        }
        let balanced = self.balanced(&rows.iter().map(|row| vec![(*row, 1.0)]).collect::<Vec<_>>());
        if let [one] = balanced.as_slice() {
            let idle = contacts.iter().filter_map(|k| {
                let place = rows.iter().position(|row| *row == self.first[*k])?;
                (pattern.forces[self.first[*k]] <= TAKES_PART * largest).then_some(one[place])
            });
            let size = one.amax();
            let signs: Vec<bool> = idle.filter(|x| x.abs() > TAKES_PART * size).map(|x| x > 0.0).collect();
            if signs.iter().any(|sign| *sign != signs[0]) {
                return None;
            }
        }
        let contacts = contacts.iter().map(|k| (Holder::Contact(*k), (self.first[*k]..self.first[k + 1]).collect()));
        let frictions = sticking().map(|grip| (Holder::Friction(grip.number), grip.rows.clone()));
        let all: Vec<(Holder, Vec<usize>)> = contacts.chain(frictions).collect();
        let open = |(holder, own): &(Holder, Vec<usize>)| {
            let mut open = [false; 4];
            balanced.iter().for_each(|one| self.mark(&mut open, one, &rows, own));
            open.contains(&true).then_some((*holder, open))
        };
        let loads: Vec<_> = all.iter().filter_map(open).collect();
        let moving = self.moved_by(&balanced, &rows, |grip| {
            let found = pattern.sliding.iter().find(|(number, _)| *number == grip.number);
            found.map(|(_, direction)| *direction).or_else(|| self.moving(grip, speed))
        });
        (!loads.is_empty()).then_some(Indeterminate { loads, moving })
    }

    /// Marks the components of the force of some rows, and its torque, that reactions in balance change.
    fn mark(&self, open: &mut [bool; 4], one: &DVector<f64>, rows: &[usize], own: &[usize]) {
        let largest = one.amax();
        // On one of the bodies; on the other the opposite acts.
        let body = |row: usize| self.jacobian[row].first().map(|(column, _)| column / 6);
        let mut load = [0.0; 6];
        for row in own {
            let Some(place) = rows.iter().position(|other| other == row) else { continue };
            open[3] |= (one[place] * self.sizes[*row]).abs() > TAKES_PART * largest;
            let entries = self.jacobian[*row].iter().filter(|(column, _)| Some(column / 6) == body(*row));
            entries.for_each(|(column, slope)| load[column % 6] += slope * one[place]);
        }
        open.iter_mut().zip(&load[..3]).for_each(|(open, part)| *open |= part.abs() > TAKES_PART * largest);
    }

    /// How much of these must act together so that they are in balance with each other: a basis. Each acts along some rows, with a share
    /// of each; it is measured by the first.
    pub(super) fn balanced(&self, columns: &[Vec<(usize, f64)>]) -> Vec<DVector<f64>> {
        if columns.is_empty() {
            return Vec::new();
        }
        let scale: Vec<f64> = columns.iter().map(|column| 1.0 / self.sizes[column[0].0]).collect();
        let entry = |i: usize, j: usize| {
            let pairs = columns[i].iter().flat_map(|a| columns[j].iter().map(move |b| (a, b)));
            let sum: f64 = pairs.map(|((i, a), (j, b))| a * b * self.geometry[(*i, *j)]).sum();
            scale[i] * sum * scale[j]
        };
        let n = columns.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| 0.5 * (entry(i, j) + entry(j, i)));
        let parts = blocks(&matrix).into_iter().map(|own| {
            let found = SymmetricEigen::new(block(&matrix, &own));
            (own, found)
        });
        let parts: Vec<(Vec<usize>, SymmetricEigen<f64, Dyn>)> = parts.collect();
        let most = parts.iter().map(|(_, found)| found.eigenvalues.max()).fold(0.0, f64::max);
        let null = parts.iter().flat_map(|(own, found)| {
            let null = (0..own.len()).filter(|k| found.eigenvalues[*k] <= RANK_TOLERANCE * most);
            null.map(|k| {
                let mut one = DVector::zeros(n);
                own.iter().enumerate().for_each(|(i, place)| one[*place] = scale[*place] * found.eigenvectors[(i, k)]);
                one
            })
        });
        null.collect()
    }

    /// Frictions that slide whose change with reactions in balance changes the motion while the rows hold.
    fn moved_by(
        &self,
        balanced: &[DVector<f64>],
        rows: &[usize],
        direction: impl Fn(&Grip) -> Option<[f64; 2]>,
    ) -> Vec<usize> {
        let mut moving = Vec::new();
        for one in balanced {
            let mut change = DVector::zeros(self.rows.len());
            let mut taking = Vec::new();
            for grip in &self.grips {
                let normal = grip.contact.and_then(|k| rows.iter().position(|row| *row == self.first[k]));
                let (Some(place), Some(direction)) = (normal, direction(grip)) else { continue };
                if one[place].abs() > TAKES_PART * one.amax() {
                    taking.push(grip.number);
                    let parts = grip.rows.iter().zip(direction);
                    parts.for_each(|(row, along)| change[*row] = -grip.limit * one[place] * along);
                }
            }
            let pushed = &self.delassus * &change;
            let held = self.stopping(rows, &pushed);
            let absorbed: f64 = rows.iter().zip(held.iter()).map(|(row, force)| -force * pushed[*row]).sum();
            let apart: f64 = (0..self.rows.len()).map(|i| change[i].powi(2) * self.delassus[(i, i)]).sum();
            if change.dot(&pushed) - absorbed > MOVES * apart {
                moving.extend(taking);
            }
        }
        moving.sort_unstable();
        moving.dedup();
        moving
    }
}
