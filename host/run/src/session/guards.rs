//! [`Guarded`]: what is watched throughout every step, and its ranges.
//!
//! Conditions, sharp functions and counted angles are nodes of the equations. Where they can be written in the coordinates that
//! are integrated, their ranges over a step are computed; elsewhere they are looked at in many places of it.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;

use super::clocks::around;
use crate::analysis::Formulation;
use crate::integrate::{Guard, GuardSet, Guards, Watched as Set};
use crate::interval::Range as Stretch;
use crate::plan::Layout;
use crate::program::{Contact, Equations, Expr, Friction, Graph, Node, Ranges, Releasing, Sharp, Switches};

/// See the module documentation.
pub(super) struct Guarded {
    pub(super) guards: Guards,
    /// Whether something cannot be watched: conditions on accelerations or reactions.
    pub(super) is_partial: bool,
    pub(super) within: Bank,
    pub(super) turns: Bank,
    of_time: Bank,
}

/// The nodes of a set of guards in the equations, and their ranges where they are to be had.
#[derive(Default)]
pub(super) struct Bank {
    pub(super) nodes: Vec<Node>,
    /// What is evaluated together. A friction whose nodes are its own is a part of its own: most slide at few times.
    parts: Vec<Part>,
    openings: Vec<Opening>,
    /// By node: whether it is held at zero, see [`Bank::hold`].
    held: Vec<bool>,
}

/// Nodes that a unilateral row, or behind these one with a limit, is opened or slides by.
struct Opening {
    /// Place of the node.
    place: usize,
    /// Number of the row among those that are unilateral, then those with a limit; behind these, of a joint that may be released.
    row: usize,
    /// Where the direction of sliding is among the discrete states; nothing of a unilateral row.
    direction: Range<usize>,
}

/// Ranges of some of the nodes.
struct Part {
    /// Their places, in the order of the ranges.
    places: Range<usize>,
    ranges: Ranges,
    /// For each input of the ranges what it is.
    sources: Vec<Source>,
    found: Vec<Stretch>,
    values: Vec<f64>,
}

/// Where an input of the ranges comes from.
#[derive(Debug, Clone, Copy)]
enum Source {
    Time,
    /// Place among the entries that are asked for.
    Entry(usize),
    /// Angle reference.
    Reference(usize),
    /// Discrete state.
    Discrete(usize),
}

impl Source {
    /// The input, from what time, entries and values between steps are; `still` makes one of the latter.
    fn take<T>(self, t: T, entry: &dyn Fn(usize) -> T, between_steps: [&[f64]; 2], still: impl Fn(f64) -> T) -> T {
        let [references, discrete] = between_steps;
        match self {
            Self::Time => t,
            Self::Entry(k) => entry(k),
            Self::Reference(k) => still(references[k]),
            Self::Discrete(k) => still(discrete[k]),
        }
    }
}

/// How close to a smooth function a table is that steps lead across, on its range and the tolerance.
const SMOOTH: f64 = 0.1;

/// What is to be watched in a scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Watching {
    /// Functions that change their sign where the equations switch, or where a table jumps or has a corner.
    conditions: Vec<Node>,
    sharp: Sharp,
    /// Functions that change their sign where memories jump.
    jumps: Vec<Node>,
    /// Counted angles, each with its reference.
    angles: Vec<(Node, usize)>,
    /// Periods at whose multiples steps end, s, and the end of the run.
    pub(super) periods: (Vec<f64>, f64),
    /// Rows whose values must stay within plus and minus a limit.
    pub(super) rows: Vec<(usize, Node, f64)>,
    /// Unilateral rows.
    pub(super) contacts: Vec<Contact>,
    /// Rows that hold up to a limit.
    pub(super) frictions: Vec<Friction>,
    /// What decides on the releases of joints.
    pub(super) releases: Vec<Releasing>,
}

impl Watching {
    /// Looks for it in the equations, which gain the nodes to watch; of the angles, at those that are counted
    /// ([`Equations::counted_angles`]).
    pub(super) fn find(equations: &mut Equations, counted: &[usize], layout: &Layout, tolerance: f64) -> Self {
        let sharp = Sharp::find(equations, layout, SMOOTH * tolerance);
        let mut switches = Switches::find(equations, layout);
        // What depends on time alone is known before a step.
        let of_time: BTreeSet<(Node, Node)> = sharp.conditions.iter().map(|(a, b)| (*a.min(b), *a.max(b))).collect();
        switches.conditions.retain(|(a, b)| !of_time.contains(&(*a.min(b), *a.max(b))));
        let g = &mut equations.graph;
        let mut conditions: Vec<Node> = switches.conditions.iter().map(|(a, b)| g.sub(*a, *b)).collect();
        for (at, sides) in &sharp.corners {
            g.tables.push(sides.clone());
            conditions.push(g.table(g.tables.len() as u32 - 1, 0, *at));
        }
        let sides: Vec<(Node, Node)> = equations.latch_conditions().collect();
        let jumps = sides.into_iter().map(|(a, b)| equations.graph.sub(a, b)).collect();
        let angles = counted.iter().map(|reference| (equations.angles[*reference], *reference)).collect();
        Self { conditions, sharp, jumps, angles, ..Self::default() }
    }

    /// Functions that change their sign where steps had better end.
    pub(super) fn conditions(&self) -> &[Node] {
        &self.conditions
    }

    /// What is watched, in words: within every step, known beforehand, and what cannot be watched.
    pub(super) fn in_words(&self, equations: &Equations, layout: &Layout) -> Watched {
        let count = |number: usize, one: &str, many: &str| match number {
            0 => None,
            1 => Some(format!("1 {one}")),
            _ => Some(format!("{number} {many}")),
        };
        let list = |parts: Vec<Option<String>>| parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        let angles = self.angles.iter().map(|(angle, _)| angle);
        let all = self.conditions.iter().chain(&self.sharp.of_motion).chain(angles);
        let unknown = all.filter(|node| !is_of_motion(equations, layout, **node)).count();
        Watched {
            within: list(vec![
                count(self.conditions.len(), "switch", "switches"),
                count(self.sharp.of_motion.len(), "sharp function", "sharp functions"),
                count(self.angles.len(), "counted angle", "counted angles"),
            ]),
            ahead: list(vec![
                count(self.sharp.of_time.len(), "function of time", "functions of time"),
                count(self.sharp.knots.len(), "set of points in time", "sets of points in time"),
                count(self.sharp.conditions.len(), "switch in time", "switches in time"),
            ]),
            bounded: list(vec![
                count(
                    unknown,
                    "that depends on accelerations or reactions",
                    "that depend on accelerations or reactions",
                ),
                (!equations.graph.calls.is_empty()).then(|| "what opaque elements do".to_string()),
            ]),
        }
    }

    /// Prepares the ranges in the coordinates of a formulation.
    pub(super) fn guard(&self, equations: &mut Equations, layout: &Layout, formulation: &dyn Formulation) -> Guarded {
        let mut guards = Guards::default();
        let switches = self.conditions.iter().chain(&self.jumps).map(|node| (*node, Guard::Switch));
        let features = self.sharp.of_motion.iter().map(|node| (*node, Guard::Feature));
        // They do not any more where their joint has let go.
        let first = self.contacts.len() + self.frictions.len();
        let gone_with = |row: usize| self.releases.iter().position(|one| one.rows.contains(&row)).map(|k| first + k);
        let rows = self.rows.iter().map(|(row, node, limit)| (*node, Guard::Bound(*limit), gone_with(*row)));
        // No step is to open and close one again unnoticed.
        let mut gaps: Vec<Node> = self.contacts.iter().map(|contact| equations.stop_of(contact, layout)).collect();
        gaps.extend(self.frictions.iter().map(|friction| equations.sliding_speed(friction, layout)));
        let g = &mut equations.graph;
        for one in &self.releases {
            let bounds = one.bounds.iter().map(|(_, bound)| g.constant(*bound)).collect::<Vec<_>>();
            // Both bounds are passed where the product changes its sign.
            let parts = bounds.into_iter().map(|bound| g.sub(bound, one.value)).collect::<Vec<_>>();
            gaps.push(parts.into_iter().reduce(|a, b| g.mul(a, b)).unwrap_or(one.value));
        }
        let gaps = gaps.into_iter().enumerate().map(|(row, node)| (node, Guard::Switch, Some(row)));
        let others = switches.chain(features).map(|(node, guard)| (node, guard, None)).chain(rows);
        let mut all: Vec<(Node, Guard, Option<usize>)> = others.chain(gaps).collect();
        let number = all.len();
        all.retain(|(node, ..)| is_of_motion(equations, layout, *node));
        let is_partial = all.len() < number;
        let openings = all.iter().enumerate().filter_map(|(place, (.., row))| Some(self.opening(place, (*row)?)));
        let openings: Vec<Opening> = openings.collect();
        let known = of_carried(equations, all.into_iter().map(|(node, guard, _)| (node, guard)).collect());
        let g = &mut equations.graph;
        let angles = self.angles.iter().map(|(angle, reference)| {
            let reference = g.input(layout.reference_slot() + reference);
            (g.sub(*angle, reference), Guard::Turn)
        });
        let angles: Vec<(Node, Guard)> = angles.collect();
        let angles = of_carried(equations, angles);
        let g = &mut equations.graph;
        let mut of_time = Vec::new();
        for (a, b) in &self.sharp.conditions {
            of_time.push(g.sub(*a, *b));
            guards.of_time.push(Guard::Switch);
        }
        for (at, knots) in self.sharp.knots.iter().cloned() {
            of_time.push(at);
            guards.of_time.push(Guard::Knots(Arc::new(move |x| knots.around(x))));
        }
        for node in &self.sharp.of_time {
            of_time.push(*node);
            guards.of_time.push(Guard::Feature);
        }
        let (periods, end) = self.periods.clone();
        if !periods.is_empty() {
            of_time.push(equations.graph.input(Layout::TIME));
            guards.of_time.push(Guard::Knots(Arc::new(move |t| around(&periods, end, t))));
        }
        let of_time = Bank::of_time(of_time, equations, layout);
        let (within, turns);
        (within, guards.within) = Bank::new(known, openings, equations, layout, formulation);
        (turns, guards.turns) = Bank::new(angles, Vec::new(), equations, layout, formulation);
        Guarded { guards, is_partial, within, turns, of_time }
    }

    fn opening(&self, place: usize, row: usize) -> Opening {
        let friction = row.checked_sub(self.contacts.len()).and_then(|number| self.frictions.get(number));
        let direction = friction.map_or(0..0, |own| own.direction_at..own.direction_at + own.rows.len());
        Opening { place, row, direction }
    }
}

/// The same of the carried values of internal unknowns, which are as good within a step as the rest of the state.
fn of_carried(equations: &mut Equations, watched: Vec<(Node, Guard)>) -> Vec<(Node, Guard)> {
    let (nodes, guards): (Vec<Node>, Vec<Guard>) = watched.into_iter().unzip();
    equations.of_carried(&nodes).into_iter().zip(guards).collect()
}

/// What is watched of a scene, in words; empty where there is nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Watched {
    pub(super) within: String,
    pub(super) ahead: String,
    pub(super) bounded: String,
}

/// Whether a node is known within a step: not what depends on the solution of the equations of motion, or on opaque elements.
fn is_of_motion(equations: &Equations, layout: &Layout, node: Node) -> bool {
    let solved = layout.acceleration_slot()..layout.inputs();
    equations.graph.ancestors(&[node], |_| false).into_iter().all(|node| match equations.graph.expr(node) {
        Expr::Input(slot) => !solved.contains(&(slot as usize)),
        Expr::Call { .. } => false,
        _ => true,
    })
}

impl Bank {
    fn new(
        all: Vec<(Node, Guard)>,
        openings: Vec<Opening>,
        equations: &Equations,
        layout: &Layout,
        formulation: &dyn Formulation,
    ) -> (Self, GuardSet) {
        let (nodes, guards): (Vec<Node>, Vec<Guard>) = all.into_iter().unzip();
        let mut bank = Self { held: vec![false; nodes.len()], nodes, openings, ..Self::default() };
        let entries = bank.write(equations, layout, formulation);
        let set = GuardSet { guards, proved: entries.is_some(), entries: entries.unwrap_or_default() };
        (bank, set)
    }

    /// For nodes that depend on no entry of the state.
    fn of_time(nodes: Vec<Node>, equations: &Equations, layout: &Layout) -> Self {
        let mut bank = Self { held: vec![false; nodes.len()], nodes, ..Self::default() };
        bank.take(&equations.graph, &bank.nodes.clone(), layout, |_| None);
        bank
    }

    /// Writes the ranges; gives the entries of the state that they take, or `None` where they can't be written.
    fn write(&mut self, equations: &Equations, layout: &Layout, formulation: &dyn Formulation) -> Option<Vec<usize>> {
        if self.nodes.is_empty() {
            return None;
        }
        let (graph, nodes) = formulation.written_in_state(equations, &self.nodes)?;
        self.take(&graph, &nodes, layout, |slot| formulation.entry_of(slot))
    }

    /// Takes ranges of nodes, the entries of whose inputs are given by slot; gives these, or `None` where an input is none.
    fn take(
        &mut self,
        graph: &Graph,
        nodes: &[Node],
        layout: &Layout,
        entry_of: impl Fn(usize) -> Option<usize>,
    ) -> Option<Vec<usize>> {
        let (references, discrete) = (layout.reference_slot(), layout.discrete_slot());
        let (mut entries, mut numbers) = (Vec::new(), HashMap::new());
        for places in self.divided(graph, nodes) {
            let ranges = Ranges::new(graph, &nodes[places.clone()]);
            let mut sources = Vec::with_capacity(ranges.inputs().len());
            for slot in ranges.inputs() {
                sources.push(match *slot {
                    Layout::TIME => Source::Time,
                    slot if (references..discrete).contains(&slot) => Source::Reference(slot - references),
                    slot if (discrete..layout.acceleration_slot()).contains(&slot) => Source::Discrete(slot - discrete),
                    slot => {
                        let entry = entry_of(slot)?;
                        Source::Entry(*numbers.entry(entry).or_insert_with(|| {
                            entries.push(entry);
                            entries.len() - 1
                        }))
                    }
                });
            }
            let (found, values) = (vec![Stretch::UNKNOWN; places.len()], vec![f64::NAN; places.len()]);
            self.parts.push(Part { places, ranges, sources, found, values });
        }
        Some(entries)
    }

    /// The places of the nodes of each part.
    fn divided(&self, graph: &Graph, nodes: &[Node]) -> Vec<Range<usize>> {
        let frictions = self.openings.iter().filter(|opening| !opening.direction.is_empty());
        // They are the last ones.
        let first = frictions.map(|friction| friction.place).next().unwrap_or(nodes.len());
        let (others, frictions) = (0..first, first..nodes.len());
        let mut parts = vec![others];
        if graph.are_apart(&nodes[first..]) {
            parts.extend(frictions.map(|place| place..place + 1))
        } else {
            parts.push(frictions)
        }
        parts.retain(|places| !places.is_empty());
        parts
    }

    /// What rows that are closed, or stick, are opened or slide by stays zero: the equations enforce it. Interval arithmetic
    /// would have to find that from differences of what is equal. So does what has no direction to slide into.
    fn hold(&mut self, closed: &[usize], discrete: &[f64]) {
        for Opening { place, row, direction } in &self.openings {
            let has_none = !direction.is_empty() && discrete[direction.clone()].iter().all(|part| *part == 0.0);
            self.held[*place] = has_none || closed.binary_search(row).is_ok();
        }
    }

    /// The ranges of the guards that are wanted; the others are left as they are. `closed` are the rows that are closed or stick.
    pub(super) fn enclose(
        &mut self,
        t: Stretch,
        entry: &dyn Fn(usize) -> Stretch,
        between_steps: [&[f64]; 2],
        closed: &[usize],
        wanted: &dyn Fn(usize) -> bool,
        all: &mut [Stretch],
    ) {
        self.hold(closed, between_steps[1]);
        let held = &self.held;
        for Part { places, ranges, sources, found, .. } in &mut self.parts {
            let open = |place: usize| wanted(place) && !held[place];
            if places.clone().any(open) {
                let input = |k: usize| sources[k].take(t, entry, between_steps, Stretch::still);
                ranges.evaluate(input, |k| open(places.start + k), found);
            }
            for place in places.clone().filter(|place| wanted(*place)) {
                all[place] = if held[place] { Stretch::still(0.0) } else { found[place - places.start] };
            }
        }
    }

    /// Their values at a point.
    pub(super) fn values(
        &mut self,
        t: f64,
        entry: &dyn Fn(usize) -> f64,
        between_steps: [&[f64]; 2],
        closed: &[usize],
        all: &mut [f64],
    ) {
        self.hold(closed, between_steps[1]);
        let held = &self.held;
        for Part { places, ranges, sources, values, .. } in &mut self.parts {
            if places.clone().any(|place| !held[place]) {
                ranges.values(|k| sources[k].take(t, entry, between_steps, |x| x), values);
            }
            for (place, value) in places.clone().zip(values) {
                all[place] = if held[place] { 0.0 } else { *value };
            }
        }
    }
}

impl Guarded {
    /// What a set of guards is watched by.
    pub(super) fn bank(&mut self, of: Set) -> &mut Bank {
        match of {
            Set::Within => &mut self.within,
            Set::Turns => &mut self.turns,
            Set::Time => &mut self.of_time,
        }
    }
}
