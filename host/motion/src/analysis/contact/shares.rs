//! [`Shares`]: what contacts that are closed, and frictions that stick, take of what rigid bodies leave open.
//!
//! Forces in balance with each other change nothing of the motion: along the line through two feet that stick, one may push as much as
//! the other pulls; a ball between two others may be pressed the more; across a plane in which joints hold a body, friction need
//! hold nothing. All stick as long as there is any way to share in which no contact pulls and no friction takes more than it can. With f the
//! forces of one way, B the balances, and x how much of each is added, the margin is the largest m for which
//!
//! n >= m of each contact,   b - |t| >= m of each friction, b its limit: a share of n, or known,
//!
//! hold of f + B x with some |x| <= r. It is found along the central path of these cones (Boyd & Vandenberghe, Convex Optimization, 2004,
//! ch. 11) up to a small parameter, so that it is a smooth function of f. Rows that hold whatever it takes have no part in that, and
//! balances of such rows alone are left out: what they seem to change of others is round-off.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::friction::{Grip, norm};
use super::indeterminate::TAKES_PART;
use super::smallest::{block, blocks};
use super::{Meeting, RANK_TOLERANCE};
use crate::linalg::connected_blocks;

/// How much of balances is added at most, in the largest of the forces.
const MOST_ADDED: f64 = 2.0;
/// How exactly the margin is found, as a share of the largest force.
const FINE: f64 = 1e-11;
/// By how much the parameter of the path changes at once, and corrections after that.
const FURTHER: f64 = 30.0;
const MOST_CORRECTIONS: usize = 50;
/// Second derivatives below this share of the largest are round-off.
const FLAT: f64 = 4.0 * f64::EPSILON;
/// Newton's decrement below which a place is on the path.
const ON_PATH: f64 = 1e-8;

/// What holds: contacts that are closed, by their places among those that touch; frictions that stick; and those that slide, each into
/// its direction, whose forces follow from those of their contacts.
pub(super) struct Holding<'g> {
    pub(super) closed: &'g [usize],
    pub(super) sticking: Vec<&'g Grip>,
    pub(super) sliding: Vec<(&'g Grip, [f64; 2])>,
}

/// Forces in balance with each other, of contacts and frictions that hold together: a basis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shares {
    /// The contacts, by their numbers in the scene.
    pub contacts: Vec<usize>,
    /// The frictions likewise, each with the place of its contact in that list.
    pub frictions: Vec<(usize, Option<usize>)>,
    /// Length of the gradient of each contact, then of each friction: force times that is comparable.
    sizes: Vec<f64>,
    balances: Vec<Balance>,
}

/// What contacts press, and what frictions hold along their one row or their two.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    /// Along the normal of each contact.
    pub normals: Vec<f64>,
    /// Of each friction.
    pub forces: Vec<[f64; 2]>,
}

/// |t| <= h + s, with what each balance changes of t and h.
struct Cone {
    t: [f64; 2],
    h: f64,
    changes: Vec<([f64; 2], f64)>,
}

impl Shares {
    /// Those of what holds where contacts meet; and what each of them is along all rows.
    pub(super) fn new(meeting: &Meeting, holding: &Holding<'_>) -> (Self, Vec<DVector<f64>>) {
        let Holding { closed, sticking, sliding } = holding;
        // What each unknown acts along: a row, and with a normal force those of the friction that slides.
        let mut columns: Vec<Vec<(usize, f64)>> = Vec::new();
        for k in *closed {
            let rows = meeting.first[*k]..meeting.first[k + 1];
            columns.extend(rows.map(|row| vec![(row, 1.0)]));
            let normal = columns.len() - (meeting.first[k + 1] - meeting.first[*k]);
            for (grip, direction) in sliding.iter().filter(|(grip, _)| grip.contact == Some(*k)) {
                let parts = grip.rows.iter().zip(direction);
                columns[normal].extend(parts.map(|(row, along)| (*row, -grip.limit * along)));
            }
        }
        columns.extend(sticking.iter().flat_map(|grip| grip.rows.iter().map(|row| vec![(*row, 1.0)])));
        let place = |row: usize| columns.iter().position(|column| column[0].0 == row);
        let normals: Vec<usize> = closed.iter().filter_map(|k| place(meeting.first[*k])).collect();
        let forces: Vec<Vec<usize>> =
            sticking.iter().map(|grip| grip.rows.iter().filter_map(|row| place(*row)).collect()).collect();
        let limited: Vec<usize> = normals.iter().chain(forces.iter().flatten()).copied().collect();
        let found = meeting.balanced(&columns);
        let found = of_limited(found, &limited, |column| meeting.sizes[columns[column][0].0]);
        let balance = |one: &DVector<f64>| Balance {
            normals: normals.iter().map(|k| one[*k]).collect(),
            forces: forces.iter().map(|own| [0, 1].map(|k| own.get(k).map_or(0.0, |k| one[*k]))).collect(),
        };
        let size_of = |grip: &Grip| grip.largest(|row| meeting.sizes[row]);
        let in_list = |contact: usize| closed.iter().position(|k| *k == contact);
        let along_rows = |one: &DVector<f64>| {
            let mut forces = DVector::zeros(meeting.rows.len());
            let parts = columns.iter().zip(one.iter()).flat_map(|(column, x)| column.iter().map(move |part| (part, x)));
            parts.for_each(|((row, share), x)| forces[*row] += share * x);
            forces
        };
        let shares = Self {
            contacts: closed.iter().map(|k| meeting.touching[*k]).collect(),
            frictions: sticking.iter().map(|grip| (grip.number, grip.contact.and_then(in_list))).collect(),
            sizes: (closed.iter().map(|k| meeting.sizes[meeting.first[*k]]))
                .chain(sticking.iter().map(|grip| size_of(grip)))
                .collect(),
            balances: found.iter().map(balance).collect(),
        };
        (shares, found.iter().map(along_rows).collect())
    }

    /// Whether nothing is open.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.balances.is_empty()
    }

    /// Whether a contact, by its place in the list, takes part.
    fn shares_contact(&self, place: usize) -> bool {
        self.balances.iter().any(|one| one.normals[place].abs() * self.sizes[place] > TAKES_PART)
    }

    /// Whether a friction, by its place in the list, takes part, or its limit.
    fn shares_friction(&self, place: usize) -> bool {
        let size = self.sizes[self.contacts.len() + place];
        let is_part = |one: &Balance| norm(one.forces[place]) * size > TAKES_PART;
        self.frictions[place].1.is_some_and(|contact| self.shares_contact(contact)) || self.balances.iter().any(is_part)
    }

    /// Whether one of them could take less where others take more.
    pub(super) fn takes_part(&self, grip: &Grip) -> bool {
        let Some(place) = self.frictions.iter().position(|(number, _)| *number == grip.number) else { return false };
        let size = self.sizes[self.contacts.len() + place];
        self.balances.iter().any(|one| norm(grip.free(one.forces[place])) * size > TAKES_PART)
    }

    /// Those in which a contact, or a friction, has no part, which is not closed, or does not stick, any longer.
    pub fn leave_out(&mut self, contact: Option<usize>, friction: Option<usize>) {
        if let Some(place) = contact.and_then(|number| self.contacts.iter().position(|own| *own == number)) {
            self.keep_zero(|one| one.normals[place]);
        }
        if let Some(place) = friction.and_then(|number| self.frictions.iter().position(|(own, _)| *own == number)) {
            self.keep_zero(|one| one.forces[place][0]);
            self.keep_zero(|one| one.forces[place][1]);
        }
    }

    /// Combines them to those of which a part is zero.
    fn keep_zero(&mut self, part: impl Fn(&Balance) -> f64) {
        let most = |a: &usize, b: &usize| part(&self.balances[*a]).abs().total_cmp(&part(&self.balances[*b]).abs());
        let found = (0..self.balances.len()).max_by(most);
        let Some(pivot) = found.filter(|k| part(&self.balances[*k]).abs() > RANK_TOLERANCE) else { return };
        let pivot = self.balances.swap_remove(pivot);
        for balance in &mut self.balances {
            let share = -part(balance) / part(&pivot);
            balance.add(&pivot, share);
        }
    }

    /// Chooses among forces that have the same effect; `limits` are those of frictions, or shares of the reactions of contacts. Gives how
    /// much of each balance is added, and the margin of each of [`Shares::parts`], N: negative where there is no way. `None` where
    /// nothing is open. What has to do with each other by balances and conditions shares one margin; what is apart is decided by itself.
    pub fn choose(&self, forces: &mut Balance, limits: &[f64]) -> Option<(DVector<f64>, Vec<Option<f64>>)> {
        if self.is_empty() {
            return None;
        }
        let cones = self.cones(forces, limits);
        let changing = |cone: &Cone| -> Vec<usize> {
            let own = cone.changes.iter().enumerate().filter(|(_, (t, h))| norm(*t) > 0.0 || *h != 0.0);
            own.map(|(k, _)| k).collect()
        };
        let changing: Vec<Vec<usize>> = cones.iter().map(changing).collect();
        let pairs = changing.iter().flat_map(|own| own.windows(2).map(|pair| (pair[0], pair[1])));
        let mut added = DVector::zeros(self.balances.len());
        let mut margins = vec![None; cones.len()];
        for own in connected_blocks(self.balances.len(), pairs) {
            let is_own = |k: &usize| changing[*k].first().is_some_and(|first| own.contains(first));
            let mine: Vec<usize> = (0..cones.len()).filter(is_own).collect();
            let sizes = mine.iter().map(|k| cones[*k].h.abs().max(norm(cones[*k].t)));
            let largest = sizes.fold(0.0, f64::max);
            if largest <= 0.0 || !largest.is_finite() {
                continue;
            }
            let part = mine.iter().map(|k| cones[*k].part(&own, largest)).collect::<Vec<_>>();
            let Some(z) = widest(&part, own.len()) else { continue };
            let z = z * largest;
            own.iter().zip(z.iter()).for_each(|(k, share)| added[*k] = *share);
            mine.iter().for_each(|k| margins[*k] = Some(-z[own.len()]));
        }
        if margins.iter().all(Option::is_none) {
            return None;
        }
        self.balances.iter().zip(added.iter()).for_each(|(balance, share)| forces.add(balance, *share));
        Some((added, margins))
    }

    /// Those of contacts that take part, by their places in the list, then of frictions, each with the length of its gradient.
    pub fn parts(&self) -> (impl Iterator<Item = (usize, f64)>, impl Iterator<Item = (usize, f64)>) {
        let (of_contacts, of_frictions) = self.sizes.split_at(self.contacts.len());
        let contacts = of_contacts.iter().copied().enumerate().filter(|(place, _)| self.shares_contact(*place));
        let frictions = of_frictions.iter().copied().enumerate().filter(|(place, _)| self.shares_friction(*place));
        (contacts, frictions)
    }

    /// The conditions on those that take part.
    fn cones(&self, forces: &Balance, limits: &[f64]) -> Vec<Cone> {
        let contact = |place: usize| {
            let size = self.sizes[place];
            let changes = self.balances.iter().map(|one| ([0.0; 2], size * one.normals[place]));
            Cone { t: [0.0; 2], h: size * forces.normals[place], changes: changes.collect() }
        };
        let friction = |place: usize| {
            let size = self.sizes[self.contacts.len() + place];
            let (limit, contact) = (size * limits[place], self.frictions[place].1);
            let bound = |normals: &[f64], known: f64| contact.map_or(known, |contact| normals[contact]) * limit;
            let changes =
                self.balances.iter().map(|one| (one.forces[place].map(|x| size * x), bound(&one.normals, 0.0)));
            Cone {
                t: forces.forces[place].map(|x| size * x),
                h: bound(&forces.normals, 1.0),
                changes: changes.collect(),
            }
        };
        let (contacts, frictions) = self.parts();
        contacts.map(|(place, _)| contact(place)).chain(frictions.map(|(place, _)| friction(place))).collect()
    }
}

impl Cone {
    /// With some balances alone, in units of `unit`.
    fn part(&self, balances: &[usize], unit: f64) -> Self {
        let changes = balances.iter().map(|k| self.changes[*k]).collect();
        Self { t: self.t.map(|x| x / unit), h: self.h / unit, changes }
    }
}

impl Balance {
    fn add(&mut self, other: &Self, share: f64) {
        self.normals.iter_mut().zip(&other.normals).for_each(|(value, part)| *value += share * part);
        let pairs = self.forces.iter_mut().zip(&other.forces);
        pairs.for_each(|(force, part)| force.iter_mut().zip(part).for_each(|(value, part)| *value += share * part));
    }
}

/// Combinations of balances, orthonormal in what is limited; without those that change nothing of that but for round-off.
fn of_limited(found: Vec<DVector<f64>>, limited: &[usize], size: impl Fn(usize) -> f64) -> Vec<DVector<f64>> {
    let n = found.len();
    if n == 0 {
        return found;
    }
    let product =
        |a: &DVector<f64>, b: &DVector<f64>| -> f64 { limited.iter().map(|k| a[*k] * b[*k] * size(*k).powi(2)).sum() };
    let gram = DMatrix::from_fn(n, n, |i, j| product(&found[i], &found[j]));
    // What is apart stays so.
    let of_block = |own: Vec<usize>| {
        let eigen = SymmetricEigen::new(block(&gram, &own));
        let combined = |k: usize| {
            let parts = own.iter().enumerate().map(|(i, place)| &found[*place] * eigen.eigenvectors[(i, k)]);
            parts.sum::<DVector<f64>>() / eigen.eigenvalues[k].sqrt()
        };
        (0..own.len()).filter(|k| eigen.eigenvalues[*k] > TAKES_PART * TAKES_PART).map(combined).collect::<Vec<_>>()
    };
    blocks(&gram).into_iter().flat_map(of_block).collect()
}

/// x and s with the least s for which all cones hold and x is within bounds.
fn widest(cones: &[Cone], count: usize) -> Option<DVector<f64>> {
    let mut z = DVector::zeros(count + 1);
    z[count] = 1.0 + cones.iter().map(|cone| norm(cone.t) - cone.h).fold(f64::NEG_INFINITY, f64::max);
    // Each cone counts twice, as does the bound of x.
    let end = 2.0 * (cones.len() + 1) as f64 / FINE;
    let mut along = 1.0_f64;
    loop {
        for _ in 0..MOST_CORRECTIONS {
            let (mut gradient, mut hessian) = barrier(cones, &z);
            gradient[count] += along;
            // Along what limits hardly bend is next to nothing beside what they bend.
            let flat = FLAT * hessian.diagonal().amax();
            (0..=count).for_each(|k| hessian[(k, k)] += flat);
            let step = -hessian.cholesky()?.solve(&gradient);
            let decrement = (-gradient.dot(&step)).max(0.0).sqrt();
            if !decrement.is_finite() {
                return None;
            }
            z += &step * if decrement > 0.25 { 1.0 / (1.0 + decrement) } else { 1.0 };
            if decrement < ON_PATH {
                break;
            }
        }
        if along >= end {
            return Some(z);
        }
        along = (along * FURTHER).min(end);
    }
}

/// First and second derivatives of -log of what cones have left, and the bound of x.
fn barrier(cones: &[Cone], z: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let n = z.len();
    let (mut gradient, mut hessian) = (DVector::zeros(n), DMatrix::zeros(n, n));
    for cone in cones {
        let (mut t, mut u) = (cone.t, cone.h + z[n - 1]);
        for ((of_t, of_h), x) in cone.changes.iter().zip(z.iter()) {
            t = [t[0] + x * of_t[0], t[1] + x * of_t[1]];
            u += x * of_h;
        }
        // Along t and across it: of what is left, differences would be round-off where it is next to nothing.
        let size = norm(t);
        let [e, f] = if size > 0.0 { t.map(|part| part / size) } else { [1.0, 0.0] };
        let change = |k: usize| {
            let ([x, y], of_u) = cone.changes.get(k).copied().unwrap_or(([0.0; 2], 1.0));
            let along = e * x + f * y;
            [(of_u - along) / (u - size), (of_u + along) / (u + size), e * y - f * x]
        };
        let changes: Vec<[f64; 3]> = (0..n).map(change).collect();
        let across = 2.0 / ((u - size) * (u + size));
        for (i, one) in changes.iter().enumerate() {
            gradient[i] -= one[0] + one[1];
            for (j, other) in changes.iter().enumerate() {
                hessian[(i, j)] += one[0] * other[0] + one[1] * other[1] + across * one[2] * other[2];
            }
        }
    }
    let x = z.rows(0, n - 1);
    let left = MOST_ADDED * MOST_ADDED - x.norm_squared();
    for i in 0..n - 1 {
        gradient[i] += 2.0 * x[i] / left;
        hessian[(i, i)] += 2.0 / left;
        for j in 0..n - 1 {
            hessian[(i, j)] += 4.0 * x[i] * x[j] / (left * left);
        }
    }
    (gradient, hessian)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two discs of which the first, turned with `load`, is held by a brake `limits[2]`, and by what it presses the second with, which two
    /// brakes hold against that and 26. How much is pressed, and what each brake takes, is open.
    fn pressed(load: f64, limits: &[f64; 3]) -> (f64, f64) {
        let half = 0.5_f64.sqrt();
        let forces = |all: [f64; 3]| all.map(|force| [force, 0.0]).to_vec();
        let balances = vec![
            Balance { normals: vec![0.0], forces: forces([half, -half, 0.0]) },
            Balance {
                normals: vec![0.4_f64.sqrt()],
                forces: forces([0.1_f64.sqrt(), 0.1_f64.sqrt(), -0.4_f64.sqrt()]),
            },
        ];
        let frictions = (0..3).map(|number| (number, None)).collect();
        let shares = Shares { contacts: vec![0], frictions, sizes: vec![1.0; 4], balances };
        let mut found = Balance { normals: vec![0.0], forces: forces([26.0, 0.0, load]) };
        let (_, margins) = shares.choose(&mut found, limits).expect("something is open");
        let margin = margins.into_iter().flatten().fold(f64::INFINITY, f64::min);
        // Where the third brake and the two others have as much left, or all that the least of them has.
        let [one, other, third] = *limits;
        let pressing = (one + other - 26.0 - 2.0 * (third - load)) / 3.0;
        let expected = pressing.min(third - load + pressing).min(other);
        assert!((found.normals[0] + found.forces[2][0] - load).abs() < 1e-9 * load);
        (margin, expected)
    }

    /// Two pairs of brakes that have nothing to do with each other: each pair leaves half of what its limits are more than its load.
    #[test]
    fn what_is_apart_has_margins_of_its_own() {
        let half = 0.5_f64.sqrt();
        let forces = |all: [f64; 4]| all.map(|force| [force, 0.0]).to_vec();
        let balance = |all: [f64; 4]| Balance { normals: Vec::new(), forces: forces(all) };
        let balances = vec![balance([half, -half, 0.0, 0.0]), balance([0.0, 0.0, half, -half])];
        let frictions = (0..4).map(|number| (number, None)).collect();
        let shares = Shares { contacts: Vec::new(), frictions, sizes: vec![1.0; 4], balances };
        let mut found = balance([9.0, 0.0, 6e-3, 0.0]);
        let (_, margins) = shares.choose(&mut found, &[10.0, 6.0, 4e-3, 4e-3]).expect("something is open");
        for (margin, expected) in margins.into_iter().zip([3.5, 3.5, 1e-3, 1e-3]) {
            let margin = margin.expect("has a part");
            assert!((margin - expected).abs() < 1e-9 * expected, "{margin} in place of {expected}");
        }
        let load = |k: usize| found.forces[k][0] + found.forces[k + 1][0];
        assert!((load(0) - 9.0).abs() < 1e-12 && (load(2) - 6e-3).abs() < 1e-15, "{found:?}");
    }

    /// Where several limits are as near as each other, what they leave in other directions is next to nothing beside them: the margin was not
    /// found for a quarter of these loads.
    #[test]
    fn margins_are_found_where_what_is_open_is_hardly_limited() {
        for k in 0..2000 {
            let load = 103.0 + 0.01 * f64::from(k);
            let (margin, expected) = pressed(load, &[113.0, 41.0, 103.0]);
            assert!((margin - expected).abs() < 1e-8, "{load}: {margin} in place of {expected}");
        }
    }
}
