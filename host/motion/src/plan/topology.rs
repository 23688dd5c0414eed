//! How a model hangs together.

use std::collections::{BTreeMap, BTreeSet};

use element_api::Kind;

use super::led::Led;
use crate::model::{Axes, Instance, Model, Quantity};

/// Bodies and elements that can influence each other, with the outputs about them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Island {
    /// Its bodies, ascending; never none. Among them those that follow the time, which other islands may have as well.
    pub bodies: Vec<usize>,
    /// Its elements, ascending; among them what follows time alone and acts on any of them, and the joints of bodies that follow the time,
    /// which other islands may have as well.
    pub elements: Vec<usize>,
    /// The channels that it has a share in, ascending: its own; those of bodies that other islands have as well, and of their joints;
    /// energies of the whole scene.
    pub channels: Vec<usize>,
    /// Number of independent closed loops of joints, ground counted as one body.
    pub loops: usize,
}

/// The islands of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    /// Islands in the order of their first body of their own. Each body is in one of them, and so is each element, but for those that follow time alone.
    pub islands: Vec<Island>,
    /// In how many islands each body is. Where there are several, each has a copy with an equal share of its mass.
    pub copies: Vec<usize>,
}

/// What belongs to an island that is being put together.
#[derive(Default)]
struct Members {
    bodies: Vec<usize>,
    elements: Vec<usize>,
    /// Groups of bodies that follow the time, by their roots.
    groups: BTreeSet<usize>,
}

impl Topology {
    /// Whether no loop of joints is closed.
    pub(super) fn is_tree(&self) -> bool {
        self.islands.iter().all(|island| island.loops == 0)
    }

    /// Finds the islands. Whatever can carry an influence connects: the bodies of an element, the signals that it takes, the
    /// joints whose reactions it takes; and an output that names two bodies, since somebody has to compute it. Ground, gravity,
    /// signals that follow time alone and bodies that follow the time do not connect.
    #[must_use]
    pub fn new(model: &Model, led: &Led) -> Self {
        let bodies = model.bodies.len();
        if bodies == 0 {
            return Self { islands: Vec::new(), copies: Vec::new() };
        }
        let of_time = of_time_alone(model);
        let is_led = |node: usize| if node < bodies { led.body(node) } else { led.holds(node - bodies) };
        // Bodies, then elements.
        let mut parent: Vec<usize> = (0..bodies + model.elements.len()).collect();
        // What is not led, with what is led that it depends on.
        let mut leaning: Vec<(usize, usize)> = Vec::new();
        let mut connect = |parent: &mut Vec<usize>, nodes: &[usize]| {
            let first = nodes.iter().copied().find(|node| !is_led(*node));
            for node in nodes {
                match first {
                    Some(first) if is_led(*node) => leaning.push((first, *node)),
                    _ => join(parent, first.unwrap_or(nodes[0]), *node),
                }
            }
        };
        for (index, element) in model.elements.iter().enumerate().filter(|(index, _)| !of_time[*index]) {
            let mut nodes = vec![bodies + index];
            nodes.extend(element.markers.iter().filter_map(|marker| marker.body));
            nodes.extend(element.joints.iter().map(|joint| bodies + joint));
            for quantity in element.signals() {
                // What comes from outside connects nothing, and anybody may compute what follows time.
                if follows_time(quantity, &of_time) {
                    continue;
                }
                match named(quantity, bodies) {
                    Some(named) => nodes.extend(named),
                    // An energy of the whole scene as a signal: everything acts on this element.
                    None => nodes.extend(0..parent.len()),
                }
            }
            connect(&mut parent, &nodes);
        }
        for nodes in model.channels.iter().filter_map(|channel| named(&channel.quantity, bodies)) {
            connect(&mut parent, &nodes);
        }
        // What has no body of its own but leans on some that follow the time goes with all of these.
        let floating: Vec<(usize, usize)> =
            leaning.iter().copied().filter(|(node, _)| root(&mut parent, *node) >= bodies).collect();
        floating.into_iter().for_each(|(node, on)| join(&mut parent, node, on));
        // What touches no body, such as a signal that nobody takes, goes with the first one. The root of a group is the
        // smallest of its numbers: a body, if it has one.
        for element in bodies..parent.len() {
            if !of_time[element - bodies] && root(&mut parent, element) >= bodies {
                join(&mut parent, element, 0);
            }
        }
        let mut members: BTreeMap<usize, Members> = BTreeMap::new();
        for node in (0..parent.len()).filter(|node| *node < bodies || !of_time[node - bodies]) {
            let own = members.entry(root(&mut parent, node)).or_default();
            if node < bodies { own.bodies.push(node) } else { own.elements.push(node - bodies) }
        }
        for (node, on) in leaning {
            let (node, on) = (root(&mut parent, node), root(&mut parent, on));
            if node != on
                && let Some(own) = members.get_mut(&node)
            {
                own.groups.insert(on);
            }
        }
        let (mut islands, islands_of_root) = put_together(&members, led);
        let home = spread(model, &of_time, &mut islands);
        for (number, channel) in model.channels.iter().enumerate() {
            let Some(nodes) = named(&channel.quantity, bodies) else {
                islands.iter_mut().for_each(|island| island.channels.push(number));
                continue;
            };
            let first = nodes.iter().copied().find(|node| !is_led(*node)).unwrap_or(nodes[0]);
            if let Some(island) = first.checked_sub(bodies).and_then(|element| home[element]) {
                islands[island].channels.push(number);
                continue;
            }
            // All that have a copy may take as a signal what it does.
            let all = &islands_of_root[&root(&mut parent, first)];
            let sharing = if is_led(first) { all.len() } else { 1 };
            all[..sharing].iter().for_each(|island| islands[*island].channels.push(number));
        }
        // Bodies, then the ground of the island at hand.
        let mut parent: Vec<usize> = (0..=bodies).collect();
        let mut copies = vec![0; bodies];
        for island in &mut islands {
            parent[bodies] = bodies;
            island.bodies.iter().for_each(|body| (parent[*body], copies[*body]) = (*body, copies[*body] + 1));
            island.loops = count_loops(model, island, &mut parent);
        }
        Self { islands, copies }
    }

    /// The bodies of an island that no other has, ascending; never none.
    pub fn own_bodies(&self, island: &Island) -> impl Iterator<Item = usize> {
        island.bodies.iter().copied().filter(|body| self.copies[*body] == 1)
    }
}

/// Islands of all members but groups that others lean on: these have copies of them. Gives the islands in which the members of each root
/// are, ascending; the first has what acts on a group alone.
fn put_together(members: &BTreeMap<usize, Members>, led: &Led) -> (Vec<Island>, BTreeMap<usize, Vec<usize>>) {
    let used: BTreeSet<usize> = members.values().flat_map(|own| &own.groups).copied().collect();
    let mut islands_of_root: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut islands = Vec::new();
    for (root, own) in members.iter().filter(|(root, _)| !used.contains(root)) {
        let mut island =
            Island { bodies: own.bodies.clone(), elements: own.elements.clone(), channels: Vec::new(), loops: 0 };
        for group in &own.groups {
            let is_first = !islands_of_root.contains_key(group);
            island.bodies.extend(&members[group].bodies);
            island.elements.extend(members[group].elements.iter().filter(|element| is_first || led.holds(**element)));
            islands_of_root.entry(*group).or_default().push(islands.len());
        }
        island.bodies.sort_unstable();
        island.elements.sort_unstable();
        islands_of_root.entry(*root).or_default().push(islands.len());
        islands.push(island);
    }
    (islands, islands_of_root)
}

/// Elements whose signals follow time alone, and what comes from outside: without bodies, states and memories, and what they take is
/// of such.
pub(super) fn of_time_alone(model: &Model) -> Vec<bool> {
    let by_itself = |element: &Instance| {
        let recording = &element.recording;
        element.class.kind == Kind::Control
            && !element.class.opaque
            && element.markers.iter().all(|marker| marker.body.is_none())
            && element.joints.is_empty()
            && recording.initial_states.is_empty()
            && recording.initial_discrete.is_empty()
    };
    let by_itself: Vec<bool> = model.elements.iter().map(by_itself).collect();
    let mut found = vec![false; model.elements.len()];
    loop {
        let is_new = |index: &usize| {
            let of_time = |quantity: &Quantity| follows_time(quantity, &found);
            by_itself[*index] && !found[*index] && model.elements[*index].signals().all(of_time)
        };
        let new: Vec<usize> = (0..found.len()).filter(is_new).collect();
        if new.is_empty() {
            return found;
        }
        new.into_iter().for_each(|index| found[index] = true);
    }
}

/// Whether a signal follows time alone, where elements do that are marked, or comes from outside.
pub(super) fn follows_time(quantity: &Quantity, of_time: &[bool]) -> bool {
    match quantity {
        Quantity::Given { .. } => true,
        Quantity::Value { element, .. } => of_time[*element],
        _ => false,
    }
}

/// Puts elements that follow time alone into all islands that take them; those that nobody takes into the first. Gives the first
/// island of each.
fn spread(model: &Model, of_time: &[bool], islands: &mut [Island]) -> Vec<Option<usize>> {
    let mut home = vec![None; of_time.len()];
    for (number, island) in islands.iter_mut().enumerate() {
        let mut taken = BTreeSet::new();
        let mut takers = island.elements.clone();
        while let Some(taker) = takers.pop() {
            for quantity in model.elements[taker].signals() {
                if let Quantity::Value { element, .. } = quantity
                    && of_time[*element]
                    && taken.insert(*element)
                {
                    takers.push(*element);
                }
            }
        }
        taken.iter().for_each(|element| _ = home[*element].get_or_insert(number));
        island.elements.extend(taken);
    }
    for element in (0..of_time.len()).filter(|element| of_time[*element]) {
        if home[element].is_none() {
            home[element] = Some(0);
            islands[0].elements.push(element);
        }
    }
    islands.iter_mut().for_each(|island| island.elements.sort_unstable());
    home
}

/// What a quantity is about: bodies, then elements, counted behind the bodies; never nothing. `None`: it is a sum over the
/// whole scene.
fn named(quantity: &Quantity, bodies: usize) -> Option<Vec<usize>> {
    let with = |node: usize, axes: &Axes| match axes {
        Axes::Ground => vec![node],
        Axes::Body(body) => vec![node, *body],
    };
    Some(match quantity {
        Quantity::Point { body, axes, .. } | Quantity::Angular { body, axes, .. } => with(*body, axes),
        Quantity::EulerParameter { body, .. } | Quantity::Balance { body, .. } => vec![*body],
        Quantity::Coordinate { element, .. } | Quantity::Value { element, .. } => vec![bodies + element],
        Quantity::Load { element, axes, .. } => with(bodies + element, axes),
        // Of no island: the first one reports it.
        Quantity::Given { .. } => vec![0],
        Quantity::KineticEnergy | Quantity::PotentialEnergy | Quantity::TotalEnergy => return None,
    })
}

fn join(parent: &mut [usize], one: usize, other: usize) {
    let (a, b) = (root(parent, one), root(parent, other));
    parent[a.max(b)] = a.min(b);
}

/// Paths are halved on the way (Tarjan & van Leeuwen 1984): chains listed from their tip are as long.
fn root(parent: &mut [usize], mut body: usize) -> usize {
    while parent[body] != body {
        parent[body] = parent[parent[body]];
        body = parent[body];
    }
    body
}

/// Joints beyond a spanning forest over the island's bodies and ground close loops. `parent`: of its bodies and the ground, each
/// by itself as yet.
fn count_loops(model: &Model, island: &Island, parent: &mut [usize]) -> usize {
    let ground = model.bodies.len();
    let mut loops = 0;
    for index in &island.elements {
        let element = &model.elements[*index];
        if element.class.kind != Kind::Joint {
            continue;
        }
        let mut bodies: Vec<usize> = element.markers.iter().map(|m| m.body.unwrap_or(ground)).collect();
        bodies.sort_unstable();
        bodies.dedup();
        for pair in bodies.windows(2) {
            let (a, b) = (root(parent, pair[0]), root(parent, pair[1]));
            if a == b {
                loops += 1;
            } else {
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    loops
}
