//! [`Indeterminate`]: reactions of contacts that rigid bodies leave open.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

use super::friction::{norm, pair, unit as direction_of, way};
use super::smallest::{block, blocks};
use super::{Grip, Meeting, Pattern, RANK_TOLERANCE};

/// Share of a row in reactions that balance each other above which it takes part.
pub(super) const TAKES_PART: f64 = 1e-6;
/// Share of what friction could change of the motion above which it does.
const MOVES: f64 = 1e-9;

/// More contacts touch, or stick, than the motion determines the reactions of: reactions that balance each other may be added.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Indeterminate {
    /// What is open of whose load: the components of its force, ground directions, then its torque.
    pub loads: Vec<(Holder, [bool; 4])>,
    /// Frictions that slide, whose limits depend on these reactions, where the motion depends on them, too.
    pub moving: Vec<Holder>,
}

/// Whose rows hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holder {
    /// A contact: a place among those that touch.
    Contact(usize),
    /// A friction: its number.
    Friction(usize),
    /// A row that always holds: its number among all.
    Row(usize),
}

/// Rows along which something acts, with a share of each; it is measured by the first.
type Column = Vec<(usize, f64)>;

/// What rows that always hold take up of reactions in balance, whatever the masses.
#[derive(Debug, Clone, Default)]
pub(super) struct Bearing {
    rows: Vec<BearingRow>,
    /// What each takes up of a unit along each row of the contacts and frictions.
    taken: Vec<Vec<f64>>,
}

#[derive(Debug, Clone)]
struct BearingRow {
    number: usize,
    /// Length of its gradient, rotations taken on the length of the scene.
    size: f64,
    entries: Vec<(usize, f64)>,
}

impl Bearing {
    pub(super) fn new(
        rows: impl Iterator<Item = (usize, Vec<(usize, f64)>)>,
        size: impl Fn(&[(usize, f64)]) -> f64,
        taken: Vec<Vec<f64>>,
    ) -> Self {
        let row = |(number, entries): (usize, Vec<_>)| BearingRow { number, size: size(&entries), entries };
        Self { rows: rows.map(row).collect(), taken }
    }

    /// What is open of loads where these are in balance.
    fn open(&self, balanced: &[DVector<f64>], columns: &[Column]) -> Vec<(Holder, [bool; 4])> {
        let mark = |(k, row): (usize, &BearingRow)| {
            let mut open = [false; 4];
            for one in balanced {
                let least = TAKES_PART * one.amax();
                let of = |column: &Column| column.iter().map(|(row, part)| part * self.taken[*row][k]).sum::<f64>();
                let force: f64 = columns.iter().zip(one.iter()).map(|(column, share)| share * of(column)).sum();
                let acts = |entry: &&(usize, f64)| entry.0 % 6 < 3 && (entry.1 * force).abs() > least;
                row.entries.iter().filter(acts).for_each(|(column, _)| open[column % 6] = true);
                let turns = row.entries.iter().all(|(column, slope)| column % 6 >= 3 || *slope == 0.0);
                open[3] |= turns && (row.size * force).abs() > least;
            }
            open.contains(&true).then_some((Holder::Row(row.number), open))
        };
        self.rows.iter().enumerate().filter_map(mark).collect()
    }
}

impl Meeting {
    /// What the pattern leaves open, where rows have these accelerations while all contacts are open, and speeds are of this size. A table on four legs is the example.
    ///
    /// The rows that hold are dependent where their Delassus matrix is singular; its null vectors are reactions in balance. They
    /// can be added to the pattern's unless contacts without reaction would have to push and to pull for that.
    #[must_use]
    pub fn indeterminate(&self, pattern: &Pattern, of_rows: &DVector<f64>, speed: f64) -> Option<Indeterminate> {
        let silent = self.silent(pattern, of_rows, speed);
        let contacts: Vec<usize> = pattern.closed.iter().copied().chain(silent).collect();
        let w = &self.delassus * &pattern.forces + of_rows;
        let resting = self.resting(pattern, &w, speed);
        let sticking = || self.grips.iter().filter(|grip| resting.contains(&grip.number));
        let mut rows: Vec<usize> = contacts.iter().flat_map(|k| self.first[*k]..self.first[k + 1]).collect();
        rows.extend(sticking().flat_map(|grip| grip.rows.iter().copied()));
        let largest = rows.iter().fold(0.0_f64, |most, row| most.max(pattern.forces[*row].abs()));
        if rows.is_empty() || largest == 0.0 {
            return None;
        }
        let columns: Vec<Column> = rows.iter().map(|row| vec![(*row, 1.0)]).collect();
        let balanced = self.in_balance((&contacts, &columns), &pattern.forces)?;
        let frictions: Vec<Vec<usize>> = sticking().map(|grip| grip.rows.clone()).collect();
        let free = self.free_columns(&contacts, &frictions);
        let of_joints = self.in_balance((&contacts, &free), &pattern.forces).unwrap_or_default();
        let contacts = contacts.iter().map(|k| (Holder::Contact(*k), (self.first[*k]..self.first[k + 1]).collect()));
        let frictions = sticking().map(|grip| (Holder::Friction(grip.number), grip.rows.clone()));
        let all: Vec<(Holder, Vec<usize>)> = contacts.chain(frictions).collect();
        let open = |(holder, own): &(Holder, Vec<usize>)| {
            let mut open = [false; 4];
            balanced.iter().for_each(|one| self.mark(&mut open, one, &rows, own));
            open.contains(&true).then_some((*holder, open))
        };
        let mut loads: Vec<_> = all.iter().filter_map(open).collect();
        loads.extend(self.bearing.open(&of_joints, &free));
        let mut moving: Vec<usize> = Vec::new();
        for one in &balanced {
            let mut change = DVector::zeros(self.rows.len());
            let mut taking = Vec::new();
            for (place, grip) in self.taking((one, &rows)) {
                let found = pattern.sliding.iter().find(|(number, _)| *number == grip.number);
                let known = found.map(|(_, direction)| *direction).or_else(|| self.moving(grip, speed));
                // That of a contact that presses with nothing begins to slide as the others do.
                let direction = known.or_else(|| self.begins(grip, &w));
                let Some(direction) = direction else { continue };
                taking.push(grip.number);
                let parts = grip.rows.iter().zip(direction);
                parts.for_each(|(row, along)| change[*row] = -grip.limit * one[place] * along);
            }
            if self.moves(&change, &rows) {
                moving.extend(taking);
            }
        }
        moving.sort_unstable();
        moving.dedup();
        let moving = moving.into_iter().map(Holder::Friction).collect();
        (!loads.is_empty()).then_some(Indeterminate { loads, moving })
    }

    /// Contacts that are not closed and neither move nor begin to.
    pub(super) fn silent(&self, pattern: &Pattern, of_rows: &DVector<f64>, speed: f64) -> Vec<usize> {
        let w = &self.delassus * &pattern.forces + of_rows;
        let silent = |k: &usize| {
            let accelerates = w[self.first[*k]].abs() > self.no_acceleration(self.first[*k]);
            !pattern.closed.contains(k) && self.stays(*k, speed) && self.gives_way(*k) && !accelerates
        };
        (0..self.touching.len()).filter(silent).collect()
    }

    /// Frictions that stick, and those that act with their limit at rest: they neither move nor begin to, since others hold them, too.
    /// Those without a limit (`mu = 0`) hold nothing.
    /// `w`: accelerations of the rows.
    fn resting(&self, pattern: &Pattern, w: &DVector<f64>, speed: f64) -> Vec<usize> {
        let rests = |grip: &Grip| !grip.fixed && self.moving(grip, speed).is_none() && self.begins(grip, w).is_none();
        let slides = |grip: &Grip| pattern.sliding.iter().any(|(number, _)| *number == grip.number);
        let own =
            self.grips.iter().filter(|grip| pattern.sticking.contains(&grip.number) || slides(grip) && rests(grip));
        own.filter(|grip| grip.limit > 0.0).map(|grip| grip.number).collect()
    }

    /// Where a grip begins to slide to, if its rows have these accelerations.
    fn begins(&self, grip: &Grip, w: &DVector<f64>) -> Option<[f64; 2]> {
        let none = grip.largest(|row| self.no_acceleration(row));
        let rate = grip.motion(pair(&grip.rows, |row| w[row]), none);
        (norm(rate) > none).then(|| direction_of(rate))
    }

    /// Contacts that strike together and share the impulse in a way that rigid bodies leave open, if the motion depends on it: by friction
    /// that slides, or by coefficients of restitution that differ. `pattern`: that of the compression.
    pub(super) fn shared_in_impact(&self, together: &[usize], pattern: &Pattern, unit: f64) -> Vec<usize> {
        let w = &self.delassus * &pattern.forces + &self.rates;
        let ends = |k: &usize| w[self.first[*k]].abs() <= unit * self.sizes[self.first[*k]];
        let contacts: Vec<usize> = together.iter().copied().filter(ends).collect();
        let sticking = || self.grips.iter().filter(|grip| pattern.sticking.contains(&grip.number));
        let hard = contacts.iter().flat_map(|k| self.first[*k] + 1..self.first[*k + 1]);
        let held: Vec<usize> = hard.chain(sticking().flat_map(|grip| grip.rows.iter().copied())).collect();
        let mut rows: Vec<usize> = contacts.iter().map(|k| self.first[*k]).collect();
        rows.extend(&held);
        let mut shared = Vec::new();
        let columns: Vec<Column> = rows.iter().map(|row| vec![(*row, 1.0)]).collect();
        for one in self.in_balance((&contacts, &columns), &pattern.forces).unwrap_or_default() {
            let [mut compressed, mut whole] = [DVector::zeros(self.rows.len()), DVector::zeros(self.rows.len())];
            let parts = contacts.iter().enumerate().filter(|(place, _)| one[*place].abs() > TAKES_PART * one.amax());
            let taking: Vec<usize> = parts.map(|(_, k)| *k).collect();
            for (place, k) in contacts.iter().enumerate() {
                whole[self.first[*k]] = (1.0 + self.restitution[*k]) * one[place];
            }
            for (place, grip) in self.taking((&one, &rows)) {
                let found = pattern.sliding.iter().find(|(number, _)| *number == grip.number);
                // That of a contact that presses with nothing slides as the others do.
                let rate = grip.motion(pair(&grip.rows, |row| w[row]), self.no_slip(grip, unit / super::NO_SPEED));
                let slides = norm(rate) > unit * self.sizes[grip.rows[0]] && !pattern.sticking.contains(&grip.number);
                let Some(direction) = found.map(|(_, way)| *way).or(slides.then(|| direction_of(rate))) else {
                    continue;
                };
                let back = grip.contact.map_or(0.0, |k| self.restitution[k]);
                for (row, along) in grip.rows.iter().zip(direction) {
                    compressed[*row] = -grip.limit * one[place] * along;
                    whole[*row] = (1.0 + back) * compressed[*row];
                }
            }
            let gives_back = taking.iter().any(|k| self.restitution[*k] > 0.0);
            if self.moves(&compressed, &rows) || gives_back && self.moves(&whole, &held) {
                shared.extend(taking);
            }
        }
        shared
    }

    /// Frictions of contacts that have a part in reactions in balance with each other, each with the place of the contact's row.
    fn taking<'m>(
        &'m self,
        (one, rows): (&'m DVector<f64>, &'m [usize]),
    ) -> impl Iterator<Item = (usize, &'m Grip)> + 'm {
        let place = |grip: &Grip| grip.contact.and_then(|k| rows.iter().position(|row| *row == self.first[k]));
        let own = self.grips.iter().filter_map(move |grip| Some((place(grip)?, grip)));
        own.filter(|(place, _)| one[*place].abs() > TAKES_PART * one.amax())
    }

    /// What acts along the rows of contacts and frictions, where joints and drivers alone do not determine how they move: there nothing acts.
    fn free_columns(&self, contacts: &[usize], frictions: &[Vec<usize>]) -> Vec<Column> {
        let normals = contacts.iter().map(|k| self.first[*k]).filter(|row| self.row_gives_way(*row));
        let mut columns: Vec<Column> = normals.map(|row| vec![(row, 1.0)]).collect();
        let hard = contacts.iter().map(|k| (self.first[*k] + 1..self.first[*k + 1]).collect());
        for rows in hard.chain(frictions.iter().cloned()).collect::<Vec<Vec<usize>>>() {
            match way(&rows, &self.geometry, &self.sizes) {
                (true, _) => {}
                (false, Some(direction)) => columns.push(rows.into_iter().zip(direction).collect()),
                (false, None) => columns.extend(rows.into_iter().map(|row| vec![(row, 1.0)])),
            }
        }
        columns
    }

    /// Reactions along rows that hold which are in balance with each other: a basis. `None` where they cannot be added to those that there
    /// are, because contacts without reaction would have to push and to pull for that.
    fn in_balance(
        &self,
        (contacts, columns): (&[usize], &[Column]),
        forces: &DVector<f64>,
    ) -> Option<Vec<DVector<f64>>> {
        let largest = columns.iter().fold(0.0_f64, |most, column| most.max(forces[column[0].0].abs()));
        let balanced = self.balanced(columns);
        if let [one] = balanced.as_slice() {
            let idle = contacts.iter().filter_map(|k| {
                let place = columns.iter().position(|column| column[0].0 == self.first[*k])?;
                (forces[self.first[*k]] <= TAKES_PART * largest).then_some(one[place])
            });
            let size = one.amax();
            let signs: Vec<bool> = idle.filter(|x| x.abs() > TAKES_PART * size).map(|x| x > 0.0).collect();
            if signs.iter().any(|sign| *sign != signs[0]) {
                return None;
            }
        }
        Some(balanced)
    }

    /// Those of some contacts that keep their places while the others do.
    pub(super) fn implied(&self, contacts: &[usize]) -> Vec<usize> {
        let columns: Vec<Column> = contacts.iter().map(|k| vec![(self.first[*k], 1.0)]).collect();
        let balanced = self.balanced(&columns);
        let takes_part = |place: &usize| balanced.iter().any(|one| one[*place].abs() > TAKES_PART * one.amax());
        (0..contacts.len()).filter(takes_part).map(|place| contacts[place]).collect()
    }

    /// Whether forces along rows change the motion while some rows hold.
    fn moves(&self, change: &DVector<f64>, held: &[usize]) -> bool {
        let pushed = &self.delassus * change;
        let forces = self.stopping(held, &pushed);
        let absorbed: f64 = held.iter().zip(forces.iter()).map(|(row, force)| -force * pushed[*row]).sum();
        let apart: f64 = (0..self.rows.len()).map(|i| change[i].powi(2) * self.delassus[(i, i)]).sum();
        change.dot(&pushed) - absorbed > MOVES * apart
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
    pub(super) fn balanced(&self, columns: &[Column]) -> Vec<DVector<f64>> {
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
}
