//! [`Decision`]: which contacts are closed, and what sticks and slides.
//!
//! A [`Choice`] is taken if it meets all conditions. It is found by principal pivoting with the least index (Murty 1974; Judice & Pires
//! 1994 for bounds on both sides): with limits that are known it comes to an end, as long as all rows give way independently. With limits
//! that depend on reactions it may go round in circles; then all choices are tried, what sticks and is closed first.

use std::collections::HashMap;

use nalgebra::DVector;

use super::friction::{Grip, Held, is_active, norm, pair, unit};
use super::{Meeting, NO_ACCELERATION, Shares};

/// Contacts that are closed one after the other, for each that there is.
const MOST_DESCENTS: usize = 4;
/// Sweeps over all that touch, what changes in one that is nothing, and what is roughly zero then, as shares of the largest.
const MOST_SWEEPS: usize = 1000;
const SETTLED: f64 = 1e-13;
const ROUGHLY: f64 = 1e-7;
/// How often pivoting may come back to what is closed and sticks.
const MOST_RETURNS: usize = 10;
/// Choices that are tried one by one; and where one is known already: of two contacts in space, or three in a plane.
const MOST_CHOICES: usize = 10_000;
const FEW_CHOICES: usize = 64;
/// By how much a motion is another, in accelerations that are none.
const OTHERWISE: f64 = 1e3;

/// What is to be decided: w = A p + b >= 0, p >= 0, p w = 0 for the candidates; for the rows that stick with one, w = 0 while it is
/// closed; the law of friction for what is held.
pub(super) struct Decision<'m> {
    pub(super) meeting: &'m Meeting,
    pub(super) b: &'m DVector<f64>,
    /// Contacts that may be closed.
    pub(super) candidates: &'m [usize],
    /// What is none, of each row.
    pub(super) none: &'m [f64],
}

/// Contacts that are taken to be closed, and what is taken to stick and to slide.
#[derive(Debug, Clone)]
pub(super) struct Choice {
    pub(super) closed: Vec<usize>,
    pub(super) held: Vec<Held>,
    /// Whether normal forces are shared as well: see [`Decision::decide`].
    pub(super) wide: bool,
}

/// What a contact may do with its friction, or a row with a known limit: which is closed, and into which directions grips slide, by
/// their places.
#[derive(Debug, Clone, Default)]
struct Alternative {
    closed: Option<usize>,
    slides: Vec<(usize, [f64; 2])>,
}

impl Decision<'_> {
    /// The choice that meets all conditions, with what acts along the rows; `None` where none is found.
    pub(super) fn decide(&self, held: Vec<Held>) -> Option<(Choice, DVector<f64>)> {
        let only_pushes = |k: &usize| self.meeting.first[k + 1] - self.meeting.first[*k] == 1;
        if held.is_empty()
            && self.candidates.iter().all(only_pushes)
            && let Some(found) = self.descend()
        {
            return Some(found);
        }
        let start = self.start(held);
        let found = self.pivot(start.clone());
        if found.as_ref().is_some_and(|found| !self.hides_rest(found)) {
            return found;
        }
        // With normal forces that balance each other much could be held that moves apart: they are shared where nothing else is found.
        let widely = |start: Choice| Choice { wide: true, ..start };
        let found = self.pivot(widely(start.clone())).or(found);
        if found.is_some() {
            return found;
        }
        let near = self.approach(&start);
        let found = self.pivot(near.clone()).or_else(|| self.pivot(widely(near)));
        found.or_else(|| self.search(&start, |_| true))
    }

    /// What is at rest may be free to stay or to go: a bracket that its own weight jams on a pole presses with nothing while it falls.
    /// It stays: where what was found moves, the choice next to that in which all is closed and sticks is taken, if less moves with it. Only by
    /// what loads press with: a wedge could hold whatever it is touched by. Where there are few choices, all are tried. Gives the contacts
    /// that move otherwise with another choice, too, if not all rests: nothing decides between them.
    pub(super) fn hold(&self, held: Vec<Held>, found: (Choice, DVector<f64>)) -> (Choice, DVector<f64>, Vec<usize>) {
        let moving = |(choice, p): &(Choice, DVector<f64>)| self.moving(choice, p);
        let start = self.start(held);
        let rests = moving(&found) == 0;
        if rests && !self.hides_rest(&found) {
            return (found.0, found.1, Vec::new());
        }
        let mut closed = start.clone();
        closed.held.iter_mut().filter(|one| !one.moves && !one.is_drawn()).for_each(|one| one.direction = [0.0; 2]);
        closed.closed = self.candidates.iter().copied().filter(|k| self.meeting.gives_way(*k)).collect();
        let all_hold = self.pivot(closed).map(|found| self.determined(found));
        if let Some((choice, p)) = all_hold.clone().filter(|one| moving(one) == 0) {
            return (choice, p, Vec::new());
        }
        let mut all = vec![found];
        all.extend(all_hold);
        all.extend(self.choices(&start, FEW_CHOICES).filter_map(|choice| self.pivot(choice)));
        // Where all were tried: what is said to slide and does not move takes more than loads press with.
        if all.len() > 2 && all.iter().any(|one| !self.hides_rest(one)) {
            all.retain(|one| !self.hides_rest(one));
        }
        let least = (0..all.len()).min_by_key(|place| moving(&all[*place])).unwrap_or(0);
        let (choice, p) = all.swap_remove(least);
        let others = all.iter().filter(|one| self.moving(&choice, &p) > 0 && !self.hides_rest(one));
        let changes: Vec<DVector<f64>> = others.map(|(_, other)| &self.meeting.delassus * (other - &p)).collect();
        let size = |row: usize| OTHERWISE * self.none[row];
        let differs = |row: &usize| changes.iter().any(|change| change[*row].abs() > size(*row));
        let several =
            self.candidates.iter().copied().filter(|k| self.meeting.rows_with_friction(*k).iter().any(differs));
        let several = several.collect();
        (choice, p, several)
    }

    /// Without contacts that others imply: how hard each of them presses is open, and equations that hold all of them have no one answer to
    /// that. Where friction slides the motion depends on it.
    fn determined(&self, found: (Choice, DVector<f64>)) -> (Choice, DVector<f64>) {
        let (choice, p) = &found;
        if choice.wide {
            return found;
        }
        let slides = |one: &Held| one.is_of_contact() && !one.sticks() && is_active(one, &choice.closed);
        let depends = choice.held.iter().any(slides);
        let normal = |k: &usize| self.meeting.first[*k];
        let mut implied = self.meeting.implied(&choice.closed);
        implied.sort_by(|a, b| p[normal(a)].total_cmp(&p[normal(b)]));
        let less = implied.into_iter().find_map(|k| {
            let mut less = choice.clone();
            less.closed.retain(|other| *other != k);
            let is_less = |one: &Choice| one.closed.len() < choice.closed.len();
            self.pivot(less).filter(|(one, p)| is_less(one) && (depends || self.moving(one, p) == 0))
        });
        less.map_or(found, |less| self.determined(less))
    }

    /// How many of the contacts and frictions that are at rest begin to move with a choice.
    fn moving(&self, choice: &Choice, p: &DVector<f64>) -> usize {
        let w = &self.meeting.delassus * p + self.b;
        let moves = |one: &&Held| !one.moves && norm(one.rate(self.grip(one), &w)) > 2.0 * self.none(one, p).0;
        let opens = |k: &&usize| w[self.meeting.first[**k]] > self.none[self.meeting.first[**k]];
        choice.held.iter().filter(moves).count() + self.candidates.iter().filter(opens).count()
    }

    /// Whether something is taken to slide that would not move: it sticks, with what it takes elsewhere.
    fn hides_rest(&self, (choice, p): &(Choice, DVector<f64>)) -> bool {
        let w = &self.meeting.delassus * p + self.b;
        let rests = |one: &Held| {
            let rate = norm(pair(&self.grip(one).rows, |row| w[row]));
            rate <= 2.0 * self.none(one, p).0 && self.meeting.bound(one.bound, p) > 0.0
        };
        choice.held.iter().any(|one| !one.moves && !one.sticks() && is_active(one, &choice.closed) && rests(one))
    }

    /// From all that slides: then no row sticks that those that stick already hold.
    pub(super) fn start(&self, mut held: Vec<Held>) -> Choice {
        for one in held.iter_mut().filter(|one| !one.moves) {
            let grip = self.grip(one);
            let tends = one.rate(grip, self.b);
            let is_pushed = one.is_drawn() || norm(tends) > grip.largest(|row| self.none[row]);
            one.direction = if is_pushed { unit(tends) } else { [0.0; 2] };
            one.moves = grip.fixed && is_pushed;
        }
        held.retain(|one| one.moves || !self.grip(one).fixed);
        Choice { closed: Vec::new(), held, wide: false }
    }

    /// What contact after contact leads to, each of which takes what it can while the others stay as they are (Gauss-Seidel with projection;
    /// Jourdan, Alart & Jean, Comput. Methods Appl. Mech. Eng. 155, 1998): a choice to begin with where many hold together.
    fn approach(&self, start: &Choice) -> Choice {
        let Meeting { delassus, first, .. } = self.meeting;
        let (mut p, mut w) = (DVector::zeros(self.b.len()), self.b.clone());
        let mut largest = 0.0_f64;
        for _ in 0..MOST_SWEEPS {
            let mut changed = 0.0_f64;
            let mut put = |row: usize, value: f64, p: &mut DVector<f64>, w: &mut DVector<f64>| {
                let change = value - p[row];
                p[row] = value;
                w.axpy(change, &delassus.column(row), 1.0);
                changed = changed.max(change.abs());
                largest = largest.max(value.abs());
            };
            for k in self.candidates.iter().copied().filter(|k| self.meeting.gives_way(*k)) {
                let normal = first[k];
                let pressed: f64 = p[normal] - w[normal] / delassus[(normal, normal)];
                put(normal, pressed.max(0.0), &mut p, &mut w);
                for row in (normal + 1..first[k + 1]).filter(|row| delassus[(*row, *row)] > 0.0) {
                    let free = if p[normal] > 0.0 { p[row] - w[row] / delassus[(row, row)] } else { 0.0 };
                    put(row, free, &mut p, &mut w);
                }
            }
            for one in &start.held {
                let (rows, bound) = (&self.grip(one).rows, self.meeting.bound(one.bound, &p));
                let way: f64 = rows.iter().fold(0.0, |most, row| most.max(delassus[(*row, *row)]));
                let free = pair(rows, |row| if way > 0.0 { p[row] - w[row] / way } else { 0.0 });
                let share = if norm(free) > bound { bound / norm(free) } else { 1.0 };
                let taken = if one.moves { one.direction.map(|x| -bound * x) } else { free.map(|x| share * x) };
                rows.iter().zip(taken).for_each(|(row, value)| put(*row, value, &mut p, &mut w));
            }
            if changed <= SETTLED * largest {
                break;
            }
        }
        let mut choice = start.clone();
        choice.closed = self.candidates.iter().copied().filter(|k| p[first[*k]] > ROUGHLY * largest).collect();
        for one in choice.held.iter_mut().filter(|one| !one.moves) {
            let rate = one.rate(self.grip(one), &w);
            let slides = one.is_drawn() || norm(rate) > ROUGHLY * self.b.amax();
            one.direction = if slides { unit(rate) } else { [0.0; 2] };
        }
        choice
    }

    fn grip(&self, one: &Held) -> &Grip {
        &self.meeting.grips[one.grip]
    }

    /// What acts along the rows with a choice, and their accelerations.
    fn outcome(&self, choice: &mut Choice) -> (DVector<f64>, DVector<f64>) {
        let mut p = self.meeting.forces(self.b, &choice.closed, &mut choice.held);
        self.meeting.share(&mut p, choice);
        let w = &self.meeting.delassus * &p + self.b;
        (p, w)
    }

    /// Contacts alone, each of which does nothing but push: p makes p^T A p / 2 + b^T p least, which comes to an end also where rows do not
    /// give way independently of each other (Lawson & Hanson, Solving Least Squares Problems, 1974, ch. 23). Where rows that follow from
    /// each other would move apart there is no least along their balance: it is followed until one of them presses with nothing.
    pub(super) fn descend(&self) -> Option<(Choice, DVector<f64>)> {
        let Meeting { delassus, first, sizes, .. } = self.meeting;
        let mut closed: Vec<usize> = Vec::new();
        let mut p = DVector::zeros(self.b.len());
        for _ in 0..MOST_DESCENTS * (self.candidates.len() + 1) {
            let w = delassus * &p + self.b;
            let relative = |k: &usize| w[first[*k]] / sizes[first[*k]];
            let closes = |k: &usize| w[first[*k]] < -self.none[first[*k]];
            let open = self.candidates.iter().copied().filter(|k| !closed.contains(k) && closes(k));
            let Some(next) = open.min_by(|a, b| relative(a).total_cmp(&relative(b))) else {
                return Some((Choice { closed, held: Vec::new(), wide: false }, p));
            };
            if !self.meeting.gives_way(next) {
                return None;
            }
            closed.push(next);
            while !closed.is_empty() {
                let found = self.meeting.forces(self.b, &closed, &mut []);
                let w = delassus * &found + self.b;
                let contradicts = self.parts(&closed, (&found, &w)).is_some();
                let way = if contradicts { self.in_balance(&closed, &w) } else { &found - &p };
                let pulls = |k: &&usize| if contradicts { way[first[**k]] < 0.0 } else { found[first[**k]] <= 0.0 };
                let part = |k: &usize| p[first[*k]] / -way[first[*k]];
                let Some(part) = closed.iter().filter(pulls).map(part).min_by(f64::total_cmp) else {
                    p = found;
                    break;
                };
                // Zero by round-off: it is held by the others. Not a number: others take all of it away from what nothing gives way to.
                if part.is_nan() || part <= 0.0 {
                    return None;
                }
                p += part * way;
                let least = closed.iter().map(|k| p[first[*k]]).fold(f64::INFINITY, f64::min);
                let (open, left): (Vec<usize>, Vec<usize>) =
                    closed.iter().partition(|k| p[first[**k]] <= least.max(0.0));
                open.iter().for_each(|k| p[first[*k]] = 0.0);
                closed = left;
            }
        }
        None
    }

    /// Whether directions would have to be found, and no iterations are left for that.
    fn gives_up(&self, choice: &Choice) -> bool {
        let turns = |one: &Held| !one.moves && self.grip(one).rows.len() > 1;
        self.meeting.is_exhausted() && choice.held.iter().any(turns)
    }

    pub(super) fn pivot(&self, mut choice: Choice) -> Option<(Choice, DVector<f64>)> {
        let most = 100 * (self.candidates.len() + choice.held.len() + 1);
        let mut seen: HashMap<(Vec<usize>, Vec<bool>), usize> = HashMap::new();
        for _ in 0..most {
            if self.gives_up(&choice) {
                return None;
            }
            let (p, w) = self.outcome(&mut choice);
            let Choice { closed, held, wide } = &mut choice;
            let mut sorted = closed.clone();
            sorted.sort_unstable();
            let times = seen.entry((sorted, held.iter().map(Held::sticks).collect())).or_default();
            *times += 1;
            if *times > MOST_RETURNS {
                return None;
            }
            if let Some(k) = self.wrong_contact(closed, held, (&p, &w)) {
                match closed.iter().position(|one| *one == k) {
                    // What pulls while it slides may press if it sticks.
                    Some(_) if let Some(one) = held.iter_mut().find(|one| one.is_of(k) && one.may_rest()) => one.rest(),
                    Some(place) => {
                        closed.remove(place);
                    }
                    None if !self.meeting.gives_way(k) => return None,
                    None => closed.push(k),
                }
                continue;
            }
            // What others hold may take all it can without moving, and push others beyond their limits: they share it.
            let resting = self.resting((closed, held, *wide), (&p, &w));
            if !resting.is_empty() {
                resting.into_iter().for_each(|place| held[place].rest());
                continue;
            }
            if let Some((place, direction)) = self.wrong_grip(closed, held, (&p, &w)) {
                held[place].direction = direction;
                continue;
            }
            let Some(k) = self.parts(closed, (&p, &w)) else { return Some((choice, p)) };
            closed.retain(|one| *one != k);
        }
        None
    }

    /// All choices one by one; what acts along the rows must be of a kind.
    pub(super) fn search(
        &self,
        start: &Choice,
        is_wanted: impl Fn(&DVector<f64>) -> bool,
    ) -> Option<(Choice, DVector<f64>)> {
        let goes_on = |choice: &Choice| !self.gives_up(choice);
        self.choices(start, MOST_CHOICES).take_while(goes_on).find_map(|mut choice| {
            let (p, w) = self.outcome(&mut choice);
            let Choice { closed, held, .. } = &choice;
            let pulls = closed.iter().any(|k| self.pulls(*k, &p));
            let is_wrong = pulls
                || self.wrong_contact(closed, held, (&p, &w)).is_some()
                || self.wrong_grip(closed, held, (&p, &w)).is_some()
                || self.parts(closed, (&p, &w)).is_some();
            (!is_wrong && is_wanted(&p)).then_some((choice, p))
        })
    }

    /// All choices, if there are no more than so many.
    fn choices(&self, start: &Choice, most: usize) -> impl Iterator<Item = Choice> {
        let lists = self.alternatives(&start.held);
        let count = lists.iter().try_fold(1_usize, |count, list| count.checked_mul(list.len()));
        let count = count.filter(|count| *count <= most).unwrap_or(0);
        (0..count).map(move |number| {
            let mut choice = start.clone();
            let mut rest = number;
            for list in lists.iter().rev() {
                let Alternative { closed, slides } = &list[rest % list.len()];
                rest /= list.len();
                choice.closed.extend(closed);
                slides.iter().for_each(|(place, direction)| choice.held[*place].direction = *direction);
            }
            choice
        })
    }

    /// What each candidate, and each row with a known limit, may do: stick first, open last.
    fn alternatives(&self, held: &[Held]) -> Vec<Vec<Alternative>> {
        let free = |place: &usize| !held[*place].moves;
        let places = || (0..held.len()).filter(free);
        let of_contact = |k: &usize| {
            let own: Vec<usize> = places().filter(|place| held[*place].is_of(*k)).collect();
            let mut list = self.slides(held, &own);
            list.iter_mut().for_each(|one| one.closed = Some(*k));
            list.push(Alternative::default());
            list.retain(|one| one.closed.is_none() || self.meeting.gives_way(*k));
            list
        };
        let known = places().filter(|place| !held[*place].is_of_contact()).map(|place| self.slides(held, &[place]));
        self.candidates.iter().map(of_contact).chain(known).collect()
    }

    /// What these grips may do together.
    fn slides(&self, held: &[Held], places: &[usize]) -> Vec<Alternative> {
        let mut list = vec![Alternative::default()];
        for place in places {
            let ways = self.ways(&held[*place]);
            let with = |one: &Alternative| {
                let add = |way: &[f64; 2]| {
                    let mut one = one.clone();
                    one.slides.push((*place, *way));
                    one
                };
                ways.iter().map(add).collect::<Vec<_>>()
            };
            list = list.iter().flat_map(with).collect();
        }
        list
    }

    /// Directions to begin with: none, in which it sticks; those that are left where others leave one; all round in a plane.
    fn ways(&self, one: &Held) -> Vec<[f64; 2]> {
        let grip = self.grip(one);
        let [x, y] = match (grip.only, grip.rows.len()) {
            _ if one.is_drawn() => unit(one.across),
            (Some(only), _) => only,
            (None, 1) => [1.0, 0.0],
            (None, _) if one.sticks() => [1.0, 0.0],
            (None, _) => one.direction,
        };
        // What is drawn across slides that way, more or less to one side.
        if one.is_drawn() {
            return vec![[x, y], unit([x - y, x + y]), unit([x + y, y - x])];
        }
        let mut ways = vec![[0.0; 2], [x, y], [-x, -y]];
        if grip.only.is_none() && grip.rows.len() > 1 {
            ways.extend([[-y, x], [y, -x]]);
        }
        ways
    }

    fn pulls(&self, k: usize, p: &DVector<f64>) -> bool {
        let row = self.meeting.first[k];
        p[row] * self.meeting.delassus[(row, row)] < -self.none[row]
    }

    /// A candidate that is closed and pulls, or open and closes.
    fn wrong_contact(&self, closed: &[usize], held: &[Held], (p, w): (&DVector<f64>, &DVector<f64>)) -> Option<usize> {
        self.candidates.iter().copied().find(|k| {
            let row = self.meeting.first[*k];
            match closed.contains(k) {
                // What pulls in order to stick slides before it opens.
                true => {
                    let slides =
                        |one: &Held| one.is_of(*k) && one.sticks() && self.change_of(one, closed, (p, w)).is_some();
                    self.pulls(*k, p) && !held.iter().any(slides)
                }
                false => w[row] < -self.none[row],
            }
        })
    }

    /// A contact that is taken to be closed and that others which are closed move apart: their rows follow from each other, and contradict
    /// each other. Of several the one that first presses with nothing where reactions in balance are added that open them.
    fn parts(&self, closed: &[usize], (p, w): (&DVector<f64>, &DVector<f64>)) -> Option<usize> {
        let Meeting { delassus, first, .. } = self.meeting;
        let given = |row: usize| p[row] * delassus[(row, row)];
        let none = |row: usize| 2.0 * self.none[row] + NO_ACCELERATION * given(row).abs();
        let parts = |k: &usize| w[first[*k]] > none(first[*k]);
        let left = |k: &usize| given(first[*k]) / w[first[*k]];
        closed.iter().copied().filter(parts).min_by(|a, b| left(a).total_cmp(&left(b)))
    }

    /// Reactions of closed contacts in balance with each other, along which p^T A p / 2 + b^T p falls: what least squares leave of their
    /// accelerations is nothing that they give way to, all rows taken in the same units.
    fn in_balance(&self, closed: &[usize], w: &DVector<f64>) -> DVector<f64> {
        let Meeting { delassus, first, .. } = self.meeting;
        let mut way = DVector::zeros(w.len());
        closed.iter().map(|k| first[*k]).for_each(|row| way[row] = -w[row] / delassus[(row, row)]);
        way
    }

    /// The first grip of which something else is assumed than it does.
    fn wrong_grip(
        &self,
        closed: &[usize],
        held: &[Held],
        found: (&DVector<f64>, &DVector<f64>),
    ) -> Option<(usize, [f64; 2])> {
        held.iter().enumerate().find_map(|(place, one)| Some((place, self.change_of(one, closed, found)?)))
    }

    /// Where it slides instead, if what is assumed of it is wrong; zero: it sticks.
    fn change_of(&self, one: &Held, closed: &[usize], (p, w): (&DVector<f64>, &DVector<f64>)) -> Option<[f64; 2]> {
        if one.moves || !is_active(one, closed) {
            return None;
        }
        let grip = self.grip(one);
        let force = pair(&grip.rows, |row| p[row]);
        let bound = self.meeting.bound(one.bound, p);
        let (none, way) = self.none(one, p);
        if one.sticks() {
            // Others that are closed or stick may make it move, whatever it takes up.
            let moved = one.rate(grip, w);
            if norm(moved) > 2.0 * none {
                return Some(unit(moved));
            }
            let beyond = (norm(force) - bound) * way;
            // Where next to nothing can be held there is nothing to give way to yet.
            let gives_way = grip.stuck && bound * way > 2.0 * none;
            let slides = norm(force) > 0.0 && beyond > if gives_way { -none } else { none };
            let along = grip.free(force);
            return (slides && norm(along) > 0.0).then(|| unit(along).map(|x| -x));
        }
        let rate = if one.is_drawn() { one.rate(grip, w) } else { pair(&grip.rows, |row| w[row]) };
        let along = rate[0] * one.direction[0] + rate[1] * one.direction[1];
        (along < -2.0 * none).then(|| if one.is_drawn() { unit(rate) } else { [0.0; 2] })
    }

    /// What of its rates is none, and how much they give way.
    fn none(&self, one: &Held, p: &DVector<f64>) -> (f64, f64) {
        let (grip, meeting) = (self.grip(one), self.meeting);
        let (none, way) = (grip.largest(|row| self.none[row]), grip.largest(|row| meeting.delassus[(row, row)]));
        (none + NO_ACCELERATION * meeting.bound(one.bound, p) * way, way)
    }

    /// Those that are taken to slide and do not, and could share what they take with each other, or with those that stick.
    fn resting(
        &self,
        (closed, held, wide): (&[usize], &[Held], bool),
        (p, w): (&DVector<f64>, &DVector<f64>),
    ) -> Vec<usize> {
        let rests = |one: &Held| {
            let rate = norm(pair(&self.grip(one).rows, |row| w[row]));
            one.may_rest() && is_active(one, closed) && rate <= self.none(one, p).0
        };
        let mut places: Vec<usize> = (0..held.len()).filter(|place| rests(&held[*place])).collect();
        if !places.is_empty() {
            let further: Vec<&Grip> = places.iter().map(|place| self.grip(&held[*place])).collect();
            let (shares, _) = Shares::new(self.meeting, &self.meeting.holding(closed, held, wide, &further));
            places.retain(|place| shares.takes_part(self.grip(&held[*place])));
        }
        places
    }
}
