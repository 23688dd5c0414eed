//! [`Grip`]: rows that hold up to a limit, among the contacts that touch: which of them stick, and where the others slide to.
//!
//! With p = -lambda what acts along a row, w its acceleration (in an impact: its rate afterwards) and b the limit: |p| <= b, and w = 0
//! or p = -b w / |w|. A row that moves slides against its motion whatever w is. Of a contact b is mu times the normal reaction, in an
//! impact mu times the normal impulse. All is found at once with the contacts that close: see [`Decision`]. Where two rows share a
//! limit, the direction of sliding is found by projection onto the circle.
//!
//! An impact with friction is compressed until the normal rate is zero, with the law of friction for the rates afterwards; then the
//! impulse of restitution is added, with the law for the sum. Should that gain energy, less is given back. (Without restitution none
//! can be gained: P . (u + u') / 2 = P . u' - P . A P / 2, and P . u' <= 0.)

use nalgebra::{DMatrix, DVector};

use super::decision::{Choice, Decision};
use super::shares::{Balance, Holding};
use super::smallest::block;
use super::{DETERMINED, Meeting, RANK_TOLERANCE, Shares};

/// Iterations for the direction of sliding in a plane, and how well it is known then.
const MOST_TURNS: usize = 2000;
/// The same of all choices at one instant together: what takes more is not found that way.
pub(super) const MOST_IN_ALL: usize = 20_000;
const TURNED: f64 = 1e-14;
/// As many of them, and directions are turned at once: by so many of Newton's steps, with slopes over a small turn, none larger than a large
/// one, and what is left then by round-off.
const FEW_TURNS: usize = 40;
const MOST_NEWTON: usize = 30;
const SMALL_TURN: f64 = 1e-7;
const LARGE_TURN: f64 = 0.5;
const NEARLY_TURNED: f64 = 1e-13;
/// How often a row that was taken to slide is let stick, in one decision.
const MOST_RESTS: u32 = 3;
/// Bisections of a restitution that gains energy.
const MOST_HALVES: usize = 60;
/// How exactly impacts are decided, in the speed that is none.
const FINER: f64 = 1e-3;

/// A row, or two with one limit, that holds up to it, at a position.
#[derive(Debug, Clone)]
pub struct Grip {
    /// Its number among the frictions of the scene.
    pub number: usize,
    /// The limit, or the share of a contact's reaction.
    pub limit: f64,
    /// The contact, as a place among those that touch.
    pub contact: Option<usize>,
    /// Whether it stuck before: where its reaction is at the limit, it slides.
    pub stuck: bool,
    /// Whether it moves, however slowly: see [`Meeting::lets_move`].
    pub moves: bool,
    /// The speed, m/s, that it creeps with at a good half of its limit, where it does: it neither sticks nor comes to rest.
    pub creeps: Option<f64>,
    pub(super) rows: Vec<usize>,
    /// The only direction in which other rows let it move, if there is but one of two.
    pub(super) only: Option<[f64; 2]>,
    /// Whether other rows determine how it moves. What it takes up is not determined where it stands still: nothing.
    pub(super) fixed: bool,
}

impl Grip {
    /// Takes note of where geometry lets it move: see [`Meeting::geometry`]; `sizes` are those of the rows.
    pub(super) fn look(&mut self, geometry: &DMatrix<f64>, sizes: &[f64]) {
        (self.fixed, self.only) = way(&self.rows, geometry, sizes);
    }

    /// What of a vector in the plane is a motion: in directions that others leave free, and across these.
    pub(super) fn motion(&self, v: [f64; 2], none: f64) -> [f64; 2] {
        if self.across(v, none) == [0.0; 2] { self.free(v) } else { v }
    }

    /// The largest of what its rows have.
    pub(super) fn largest(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.rows.iter().fold(0.0, |most, row| most.max(of(*row)))
    }

    /// What of it is across these, if that is more than `none`.
    fn across(&self, v: [f64; 2], none: f64) -> [f64; 2] {
        let [x, y] = self.free(v);
        let across = [v[0] - x, v[1] - y];
        if norm(across) > none { across } else { [0.0; 2] }
    }

    /// What of it is in directions that others leave free.
    pub(super) fn free(&self, v: [f64; 2]) -> [f64; 2] {
        match self.only {
            None => v,
            Some([x, y]) => {
                let along = v[0] * x + v[1] * y;
                [along * x, along * y]
            }
        }
    }
}

/// Whether others determine how rows move, one or two, and the only direction in which they let them, if there is but one of two.
pub(super) fn way(rows: &[usize], geometry: &DMatrix<f64>, sizes: &[f64]) -> (bool, Option<[f64; 2]>) {
    let most = rows.iter().fold(0.0_f64, |most, row| most.max(sizes[*row].powi(2)));
    let [xx, yy] = pair(rows, |row| geometry[(row, row)]);
    let xy = if let [x, y] = rows[..] { geometry[(x, y)] } else { 0.0 };
    let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let fixed = mean + half <= DETERMINED * most;
    let only = (rows.len() == 2 && !fixed && mean - half <= DETERMINED * most).then(|| {
        let angle = 0.5 * xy.atan2(0.5 * (xx - yy));
        [angle.cos(), angle.sin()]
    });
    (fixed, only)
}

/// What limits a row.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bound {
    Known(f64),
    /// A share of the reaction of a contact.
    Share(f64, usize),
}

/// A grip that takes part in a decision.
#[derive(Debug, Clone)]
pub(super) struct Held {
    pub(super) grip: usize,
    pub(super) bound: Bound,
    /// Whether it slides in a direction that is known.
    pub(super) moves: bool,
    /// Where it slides; zero where it sticks.
    pub(super) direction: [f64; 2],
    /// How others move it across the only direction in which they let it move, whatever acts; it does not stick then. Zero where they do not.
    pub(super) across: [f64; 2],
    /// How often it was let stick: see [`Held::may_rest`].
    rested: u32,
}

impl Held {
    pub(super) fn sticks(&self) -> bool {
        self.direction == [0.0; 2]
    }

    /// Whether its limit is a share of the reaction of a contact.
    pub(super) fn is_of_contact(&self) -> bool {
        matches!(self.bound, Bound::Share(..))
    }

    /// Whether it is the friction of this contact.
    pub(super) fn is_of(&self, contact: usize) -> bool {
        matches!(self.bound, Bound::Share(_, of) if of == contact)
    }

    /// Whether others keep it from sticking: see [`Held::across`].
    pub(super) fn is_drawn(&self) -> bool {
        self.across != [0.0; 2]
    }

    /// How it moves where its rows have these rates; in directions that others leave, and as they move it.
    pub(super) fn rate(&self, grip: &Grip, w: &DVector<f64>) -> [f64; 2] {
        let [x, y] = grip.free(pair(&grip.rows, |row| w[row]));
        [x + self.across[0], y + self.across[1]]
    }

    /// Whether it is taken to slide, and may be let stick instead.
    pub(super) fn may_rest(&self) -> bool {
        !self.moves && !self.sticks() && !self.is_drawn() && self.rested < MOST_RESTS
    }

    pub(super) fn rest(&mut self) {
        self.direction = [0.0; 2];
        self.rested += 1;
    }
}

/// What was decided.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// Contacts that are closed: places among those that touch.
    pub closed: Vec<usize>,
    /// Numbers of frictions that stick.
    pub sticking: Vec<usize>,
    /// Numbers of frictions that slide, and where to.
    pub sliding: Vec<(usize, [f64; 2])>,
    /// Contacts that move otherwise with another choice that meets all conditions, too.
    pub several: Vec<usize>,
    /// What acts along the rows.
    pub(super) forces: DVector<f64>,
    /// Whether normal forces are shared as well.
    wide: bool,
}

impl Meeting {
    /// The rows of a contact, with those of its friction.
    pub(super) fn rows_with_friction(&self, k: usize) -> Vec<usize> {
        let grips = self.grips.iter().filter(|grip| grip.contact == Some(k));
        (self.first[k]..self.first[k + 1]).chain(grips.flat_map(|grip| grip.rows.iter().copied())).collect()
    }

    /// A contact that stays and slides such that its normal reaction would push it open the less, the more it presses (Painleve): there
    /// is no reaction, or there are several.
    #[must_use]
    pub fn paradox(&self, speed: f64) -> Option<usize> {
        (0..self.touching.len()).filter(|k| self.stays(*k, speed)).find(|k| {
            let normal = self.first[*k];
            let own = self.grips.iter().filter(|grip| grip.contact == Some(*k));
            let part = own.map(|grip| match self.moving(grip, speed) {
                Some(direction) => grip.limit * dot(&grip.rows, direction, |row| self.delassus[(normal, row)]),
                None => 0.0,
            });
            let (free, part) = (self.delassus[(normal, normal)], part.sum::<f64>());
            part > 0.0 && free - part <= RANK_TOLERANCE * free
        })
    }

    /// Where a grip slides to, if it moves; what creeps does, with a direction that is shorter the slower it is.
    pub(super) fn moving(&self, grip: &Grip, speed: f64) -> Option<[f64; 2]> {
        if let Some(creeps) = grip.creeps {
            let [x, y] = pair(&grip.rows, |row| self.rates[row]);
            let size = norm([norm([x, y]), creeps * grip.largest(|row| self.sizes[row])]);
            // Nothing that sticks, also where it stands still.
            return Some([x / size + f64::MIN_POSITIVE, y / size]);
        }
        let none = self.no_slip(grip, speed);
        let rates = grip.motion(pair(&grip.rows, |row| self.rates[row]), none);
        (norm(rates) > none).then(|| unit(rates))
    }

    /// Whether directions of sliding were given up.
    #[must_use]
    pub fn is_exhausted(&self) -> bool {
        self.turns.get() == 0
    }

    /// That of a friction, if it takes part.
    pub(super) fn grip(&self, number: usize) -> Option<&Grip> {
        self.grips.iter().find(|grip| grip.number == number)
    }

    /// Numbers of the grips that have to do with one of them, itself among them.
    #[must_use]
    pub fn coupled(&self, number: usize) -> Vec<usize> {
        let Some(own) = self.grip(number) else { return Vec::new() };
        let is_in = |rows: &Vec<usize>, grip: &Grip| rows.binary_search(&grip.rows[0]).is_ok();
        let with = |rows: &&Vec<usize>| is_in(rows, own);
        let block = self.blocks.iter().find(with).into_iter();
        block.flat_map(|rows| self.grips.iter().filter(|grip| is_in(rows, grip)).map(|grip| grip.number)).collect()
    }

    /// How fast the rows of a grip gain speed with a pattern, where they have these accelerations while all contacts are open, m/s^2.
    #[must_use]
    pub fn gain(&self, number: usize, pattern: &Pattern, of_rows: &DVector<f64>) -> f64 {
        let w = &self.delassus * &pattern.forces + of_rows;
        self.grip(number).map_or(0.0, |grip| norm(pair(&grip.rows, |row| w[row] / self.sizes[row])))
    }

    /// Where those that slide in a plane do so by now, as far as they move.
    pub fn turned(&self, sliding: &mut [(usize, [f64; 2])], speed: f64) {
        for (number, direction) in sliding {
            let own = self.grip(*number).filter(|grip| grip.rows.len() > 1);
            *direction = own.and_then(|grip| self.moving(grip, speed)).unwrap_or(*direction);
        }
    }

    /// How much the rows of a grip give way to what acts along them, together.
    fn way_in_plane(&self, grip: &Grip) -> f64 {
        grip.rows.iter().map(|row| self.delassus[(*row, *row)]).sum()
    }

    /// How fast the rows of a grip may move without doing so, where speeds are of this size.
    pub(super) fn no_slip(&self, grip: &Grip, speed: f64) -> f64 {
        let size = grip.largest(|row| self.sizes[row]);
        let none = if grip.rows.len() > 1 && !grip.moves { self.still.max(super::NO_SPEED) } else { super::NO_SPEED };
        (none * speed * size).max(self.unresolved_of(grip))
    }

    /// What the rates of its rows may be off by: see [`Contacts::note_changes`](super::Contacts::note_changes).
    pub(super) fn unresolved_of(&self, grip: &Grip) -> f64 {
        grip.largest(|row| self.unresolved[row])
    }

    /// Those that take part in a decision about accelerations, which are `of_rows` while nothing acts along these; `none` is what is none.
    pub(super) fn held(&self, speed: f64, of_rows: &DVector<f64>, none: &[f64]) -> Vec<Held> {
        let held = |(place, grip): (usize, &Grip)| {
            let moving = self.moving(grip, speed);
            let none = grip.largest(|row| none[row]);
            Held {
                grip: place,
                bound: grip.contact.map_or(Bound::Known(grip.limit), |contact| Bound::Share(grip.limit, contact)),
                moves: moving.is_some(),
                direction: moving.unwrap_or([0.0; 2]),
                across: grip.across(pair(&grip.rows, |row| of_rows[row]), none),
                rested: 0,
            }
        };
        self.grips.iter().enumerate().map(held).collect()
    }

    /// Those that take part in an impact of some contacts, where speeds are of this size.
    pub(super) fn held_in_impact(&self, contacts: &[usize], speed: f64) -> Vec<Held> {
        let all = self.grips.iter().enumerate();
        let held = all.filter_map(|(place, grip)| {
            let contact = grip.contact.filter(|contact| contacts.contains(contact))?;
            let bound = Bound::Share(grip.limit, contact);
            let across = grip.across(pair(&grip.rows, |row| self.rates[row]), self.no_slip(grip, speed));
            Some(Held { grip: place, bound, moves: false, direction: [0.0; 2], across, rested: 0 })
        });
        held.collect()
    }

    /// What is decided: see [`Decision`]; `none` is what is none, of each row.
    pub(super) fn complementary(
        &self,
        b: &DVector<f64>,
        candidates: &[usize],
        held: Vec<Held>,
        none: &[f64],
    ) -> Option<Pattern> {
        self.apart(candidates, &held, |candidates, held| {
            let (choice, forces) = Decision { meeting: self, b, candidates, none }.decide(held)?;
            Some((choice, forces, Vec::new()))
        })
    }

    /// The same of accelerations, or of several contacts that strike together: what is at rest stays so if it can, or comes to rest.
    pub(super) fn at_rest(
        &self,
        b: &DVector<f64>,
        candidates: &[usize],
        held: Vec<Held>,
        none: &[f64],
    ) -> Option<Pattern> {
        self.apart(candidates, &held, |candidates, held| {
            let decision = Decision { meeting: self, b, candidates, none };
            let found = decision.decide(held.clone())?;
            Some(decision.hold(held, found))
        })
    }

    /// Decides of rows that have to do with each other, block by block.
    fn apart(
        &self,
        candidates: &[usize],
        held: &[Held],
        decide: impl Fn(&[usize], Vec<Held>) -> Option<(Choice, DVector<f64>, Vec<usize>)>,
    ) -> Option<Pattern> {
        let mut all = Choice { closed: Vec::new(), held: Vec::new(), wide: false };
        let (mut forces, mut several) = (DVector::zeros(self.rows.len()), Vec::new());
        for rows in &self.blocks {
            let of_rows = |row: usize| rows.binary_search(&row).is_ok();
            let own: Vec<usize> = candidates.iter().copied().filter(|k| of_rows(self.first[*k])).collect();
            let held: Vec<Held> = held.iter().filter(|one| of_rows(self.grips[one.grip].rows[0])).cloned().collect();
            if own.is_empty() && held.is_empty() {
                continue;
            }
            let (choice, found, with_others) = decide(&own, held)?;
            all.closed.extend(choice.closed);
            all.held.extend(choice.held);
            all.wide |= choice.wide;
            forces += found;
            several.extend(with_others);
        }
        Some(Pattern { several, ..self.pattern(all, forces) })
    }

    /// What is none of each row where sizes of rows count.
    pub(super) fn none(&self, unit: f64) -> Vec<f64> {
        self.sizes.iter().map(|size| unit * size).collect()
    }

    /// A choice in numbers of the scene.
    pub(super) fn pattern(&self, Choice { mut closed, held, wide }: Choice, forces: DVector<f64>) -> Pattern {
        closed.sort_unstable();
        let active = held.iter().filter(|one| is_active(one, &closed));
        let (sticking, sliding): (Vec<&Held>, Vec<&Held>) = active.partition(|one| one.sticks());
        let number = |one: &Held| self.grips[one.grip].number;
        let sticking = sticking.into_iter().map(number).collect();
        let sliding = sliding.into_iter().map(|one| (number(one), one.direction)).collect();
        Pattern { closed, sticking, sliding, several: Vec::new(), forces, wide }
    }

    /// What frictions that stick have in balance with each other, and where that is shared as well, with contacts that are closed; where
    /// speeds are of this size.
    #[must_use]
    pub fn shares(&self, pattern: &Pattern, speed: f64) -> Shares {
        let sliding = pattern.sliding.iter().filter_map(|(number, way)| {
            let grip = self.grip(*number)?;
            Some((grip, self.moving(grip, speed).unwrap_or(*way)))
        });
        let holding = Holding {
            closed: if pattern.wide { &pattern.closed } else { &[] },
            sticking: pattern.sticking.iter().filter_map(|number| self.grip(*number)).collect(),
            sliding: sliding.filter(|_| pattern.wide).collect(),
        };
        Shares::new(self, &holding).0
    }

    /// What holds with a choice, normal forces or not, and with other grips that stick.
    pub(super) fn holding<'g>(
        &'g self,
        closed: &'g [usize],
        held: &[Held],
        wide: bool,
        further: &[&'g Grip],
    ) -> Holding<'g> {
        let is_further = |one: &&Held| further.iter().any(|grip| grip.number == self.grips[one.grip].number);
        let sliding = held.iter().filter(|one| wide && is_active(one, closed) && !one.sticks() && !is_further(one));
        Holding {
            closed: if wide { closed } else { &[] },
            sticking: sticking(held, closed).map(|one| &self.grips[one.grip]).chain(further.iter().copied()).collect(),
            sliding: sliding.map(|one| (&self.grips[one.grip], one.direction)).collect(),
        }
    }

    /// Lets those that stick, and contacts with them, share what their rows leave open, as far within their limits as they can be, unless
    /// they are.
    pub(super) fn share(&self, p: &mut DVector<f64>, Choice { closed, held, wide }: &Choice) {
        let holding = self.holding(closed, held, *wide, &[]);
        let bounds: Vec<f64> = sticking(held, closed).map(|one| self.bound(one.bound, p)).collect();
        let normals: Vec<f64> = holding.closed.iter().map(|k| p[self.first[*k]]).collect();
        let forces: Vec<[f64; 2]> = holding.sticking.iter().map(|grip| pair(&grip.rows, |row| p[row])).collect();
        let is_within = |(force, bound): (&[f64; 2], &f64)| norm(*force) <= *bound;
        if normals.iter().all(|normal| *normal >= 0.0) && forces.iter().zip(&bounds).all(is_within) {
            return;
        }
        let limits = if *wide { holding.sticking.iter().map(|grip| grip.limit).collect() } else { bounds };
        let (shares, along_rows) = Shares::new(self, &holding);
        if let Some((added, _)) = shares.choose(&mut Balance { normals, forces }, &limits) {
            along_rows.iter().zip(added.iter()).for_each(|(balance, share)| *p += balance * *share);
        }
    }

    pub(super) fn bound(&self, bound: Bound, p: &DVector<f64>) -> f64 {
        match bound {
            Bound::Known(limit) => limit,
            Bound::Share(share, contact) => share * p[self.first[contact]].max(0.0),
        }
    }

    /// What acts along the rows, where some contacts are closed, and of what is held some stick and the others slide. Finds the
    /// directions in planes of those that begin to.
    pub(super) fn forces(&self, b: &DVector<f64>, closed: &[usize], held: &mut [Held]) -> DVector<f64> {
        let mut p = self.forces_for(b, closed, held);
        for turn in 1..=MOST_TURNS {
            if self.turns.get() == 0 {
                break;
            }
            let w = &self.delassus * &p + b;
            let mut turned = 0.0_f64;
            for place in self.turning(closed, held) {
                let one = &mut held[place];
                let grip = &self.grips[one.grip];
                let bound = self.bound(one.bound, &p);
                let way = self.way_in_plane(grip);
                let rate = one.rate(grip, &w);
                let moved = [0, 1].map(|k| bound * one.direction[k] + rate[k] / way);
                // Across it at most: what would turn back sticks.
                let ahead = moved[0] * one.direction[0] + moved[1] * one.direction[1];
                if ahead > 0.0 && way > 0.0 {
                    let direction = unit(if one.is_drawn() { moved } else { grip.free(moved) });
                    turned = turned.max(norm([0, 1].map(|k| direction[k] - one.direction[k])));
                    one.direction = direction;
                }
            }
            if turned == 0.0 {
                break;
            }
            self.turns.update(|turns| turns.saturating_sub(1));
            if turn.is_multiple_of(FEW_TURNS) && turned >= TURNED {
                self.turn_at_once(b, closed, held);
            }
            p = self.forces_for(b, closed, held);
            if turned < TURNED {
                break;
            }
        }
        p
    }

    /// Places of those that begin to slide in a plane.
    fn turning(&self, closed: &[usize], held: &[Held]) -> Vec<usize> {
        let turns = |one: &Held| {
            let in_plane = self.grips[one.grip].rows.len() > 1;
            in_plane && !one.moves && !one.sticks() && is_active(one, closed)
        };
        (0..held.len()).filter(|place| turns(&held[*place])).collect()
    }

    /// Turns all directions of those that begin to slide at once, by Newton's method: where what slides hardly moves, or hardly turns, projection
    /// gets there in thousands of turns. They are left as they are where that leads nowhere.
    fn turn_at_once(&self, b: &DVector<f64>, closed: &[usize], held: &mut [Held]) {
        let mut places = self.turning(closed, held);
        places.retain(|place| held[*place].is_drawn() || self.grips[held[*place].grip].only.is_none());
        let given: Vec<[f64; 2]> = places.iter().map(|place| held[*place].direction).collect();
        // How far each rate is from its direction, and whether all are along it.
        let off = |held: &[Held]| -> (DVector<f64>, bool) {
            self.turns.update(|turns| turns.saturating_sub(1));
            let p = self.forces_for(b, closed, held);
            let w = &self.delassus * &p + b;
            let of = |place: &usize| {
                let one = &held[*place];
                let grip = &self.grips[one.grip];
                let ([x, y], [u, v]) = (one.direction, one.rate(grip, &w));
                let way = self.way_in_plane(grip);
                let size = self.bound(one.bound, &p) * way + norm([u, v]);
                if size > 0.0 { [(x * v - y * u) / size, (x * u + y * v) / size] } else { [0.0; 2] }
            };
            let found: Vec<[f64; 2]> = places.iter().map(of).collect();
            let ahead = found.iter().all(|[_, along]| *along >= -TURNED);
            (DVector::from_iterator(found.len(), found.iter().map(|[across, _]| *across)), ahead)
        };
        let turned = |[x, y]: [f64; 2], by: f64| [x * by.cos() - y * by.sin(), x * by.sin() + y * by.cos()];
        let (mut now, _) = off(held);
        for _ in 0..MOST_NEWTON {
            let mut slopes = DMatrix::zeros(places.len(), places.len());
            for (k, place) in places.iter().enumerate() {
                let was = held[*place].direction;
                held[*place].direction = turned(was, SMALL_TURN);
                slopes.set_column(k, &((off(held).0 - &now) / SMALL_TURN));
                held[*place].direction = was;
            }
            let Some(by) = slopes.lu().solve(&-&now) else { break };
            let share = (LARGE_TURN / by.amax()).min(1.0);
            for (place, by) in places.iter().zip(by.iter()) {
                held[*place].direction = turned(held[*place].direction, share * by);
            }
            let (next, ahead) = off(held);
            if by.amax() < TURNED && ahead {
                return;
            }
            // As near as round-off lets it be.
            if next.amax() >= now.amax() {
                if ahead && now.amax() < NEARLY_TURNED {
                    return;
                }
                break;
            }
            now = next;
        }
        places.iter().zip(given).for_each(|(place, direction)| held[*place].direction = direction);
    }

    fn forces_for(&self, b: &DVector<f64>, closed: &[usize], held: &[Held]) -> DVector<f64> {
        let mut rows: Vec<usize> = closed.iter().flat_map(|k| self.first[*k]..self.first[k + 1]).collect();
        rows.extend(sticking(held, closed).flat_map(|one| self.grips[one.grip].rows.iter().copied()));
        let mut p = DVector::zeros(self.rows.len());
        let mut matrix = block(&self.delassus, &rows);
        let sliding = || held.iter().filter(|one| is_active(one, closed) && !one.sticks());
        for one in sliding() {
            let own = &self.grips[one.grip].rows;
            match one.bound {
                Bound::Known(limit) => {
                    own.iter().zip(one.direction).for_each(|(row, direction)| p[*row] = -limit * direction);
                }
                Bound::Share(share, contact) => self.drag(&mut matrix, &rows, contact, (own, share, one.direction)),
            }
        }
        let known = &self.delassus * &p + b;
        let found = self.solve(&rows, &matrix, DVector::from_fn(rows.len(), |i, _| -known[rows[i]]));
        rows.iter().zip(found.iter()).for_each(|(row, value)| p[*row] = *value);
        for one in sliding() {
            if let Bound::Share(share, contact) = one.bound {
                let pressing = p[self.first[contact]];
                let own = self.grips[one.grip].rows.iter();
                own.zip(one.direction).for_each(|(row, direction)| p[*row] = -share * pressing * direction);
            }
        }
        p
    }

    /// Adds to a block of Delassus' matrix, of some rows, that what acts along the row of a contact brings friction with it, along rows
    /// that slide in a direction: a share of it, against that.
    pub(super) fn drag(
        &self,
        matrix: &mut DMatrix<f64>,
        rows: &[usize],
        contact: usize,
        (own, share, direction): (&[usize], f64, [f64; 2]),
    ) {
        let Some(normal) = rows.iter().position(|row| *row == self.first[contact]) else { return };
        for (i, at) in rows.iter().enumerate() {
            matrix[(i, normal)] -= share * dot(own, direction, |row| self.delassus[(*at, row)]);
        }
    }

    /// The impulses of an impact of some contacts together, and what was decided for its compression; `unit` is the speed that is none.
    pub(super) fn struck(&self, together: &[usize], unit: f64) -> Option<(DVector<f64>, Pattern)> {
        let speed = unit / super::NO_SPEED;
        let held = self.held_in_impact(together, speed);
        let found = self.struck_with(together, unit, held.clone());
        if found.is_some() || held.is_empty() {
            return found;
        }
        // Against the sliding before it, where nothing better is found.
        let moves = |one: Held| {
            let moving = self.moving(&self.grips[one.grip], speed);
            Held { moves: true, direction: moving.unwrap_or([f64::MIN_POSITIVE, 0.0]), ..one }
        };
        self.struck_with(together, unit, held.into_iter().map(moves).collect())
    }

    fn struck_with(&self, together: &[usize], unit: f64, held: Vec<Held>) -> Option<(DVector<f64>, Pattern)> {
        let none = self.none(FINER * unit);
        let pattern = match together {
            [_] => self.complementary(&self.rates, together, held.clone(), &none)?,
            _ => self.at_rest(&self.rates, together, held.clone(), &none)?,
        };
        let hard: Vec<usize> = together.iter().flat_map(|k| self.first[*k] + 1..self.first[*k + 1]).collect();
        let with = |share: f64| {
            let mut impulses = DVector::zeros(self.rows.len());
            for k in together {
                let normal = self.first[*k];
                let (compressed, back) = (pattern.forces[normal], share * self.restitution[*k]);
                // The same but for round-off, on which the work hangs that is pinned.
                impulses[normal] =
                    if held.is_empty() { compressed + back * compressed } else { (1.0 + back) * compressed };
            }
            let known = &self.delassus * &impulses + &self.rates;
            let fixed =
                || held.iter().map(|one| Held { bound: Bound::Known(self.bound(one.bound, &impulses)), ..one.clone() });
            // Friction and rows that hold whatever it takes, in turn: one contact does not have both.
            let (mut parts, mut taken) = (DVector::zeros(self.rows.len()), DVector::zeros(self.rows.len()));
            for _ in 0..MOST_TURNS {
                let rates = &self.delassus * &taken + &known;
                parts = self.complementary(&rates, &[], fixed().collect(), &none)?.forces;
                let before = taken.clone();
                let found = self.stopping(&hard, &(&self.delassus * &parts + &known));
                hard.iter().zip(found.iter()).for_each(|(row, value)| taken[*row] = *value);
                if held.is_empty() || (&taken - before).amax() <= TURNED * taken.amax() {
                    break;
                }
            }
            Some(impulses + parts + taken)
        };
        let gain = |impulses: &DVector<f64>| {
            let after = &self.delassus * impulses + &self.rates;
            0.5 * impulses.dot(&(after + &self.rates))
        };
        let whole = with(1.0)?;
        if gain(&whole) <= 0.0 {
            return Some((whole, pattern));
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..MOST_HALVES {
            let middle = 0.5 * (low + high);
            if gain(&with(middle)?) <= 0.0 { low = middle } else { high = middle }
        }
        Some((with(low)?, pattern))
    }
}

/// Those that are taken to stick.
pub(super) fn sticking<'h>(held: &'h [Held], closed: &'h [usize]) -> impl Iterator<Item = &'h Held> {
    held.iter().filter(|one| one.sticks() && is_active(one, closed))
}

/// Whether it acts: not where it is of a contact that is open.
pub(super) fn is_active(one: &Held, closed: &[usize]) -> bool {
    match one.bound {
        Bound::Known(_) => true,
        Bound::Share(_, contact) => closed.contains(&contact),
    }
}

pub(super) fn pair(rows: &[usize], of: impl Fn(usize) -> f64) -> [f64; 2] {
    [rows.first(), rows.get(1)].map(|row| row.map_or(0.0, |row| of(*row)))
}

fn dot(rows: &[usize], direction: [f64; 2], of: impl Fn(usize) -> f64) -> f64 {
    rows.iter().zip(direction).map(|(row, direction)| of(*row) * direction).sum()
}

pub(super) fn norm([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

pub(super) fn unit(v: [f64; 2]) -> [f64; 2] {
    let size = norm(v);
    v.map(|x| x / size)
}
