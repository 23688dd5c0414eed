//! [`Locked`]: closed loops whose joints leave each other no freedom.
//!
//! Four hinges in a loop move if their axes are parallel, and hold each other fast if one of them is off by the last digits that
//! somebody typed. Both are answers; the second is seldom what was meant. So it is with wheels whose ratios do not multiply to one around
//! a loop of gears.

use element_api::Kind;
use element_api::recording::{Input, Op, Role};

use super::axes::{Directions, directions};
use super::decide::{Probe, RedundantRow};
use super::layout::Layout;
use crate::model::{Instance, Model, operations_behind, rows};

/// Directions nearer than this to parallel, or to perpendicular, may have been meant to be so, rad.
const NEARLY: f64 = 0.2;
/// Directions nearer than this are, rad: rows that differ by less count as dependent.
const EXACTLY: f64 = 1e-9;
/// Rows of a joint that leaves two freedoms; those that leave more are found in structures as well.
const GUIDING: usize = 4;

/// Joints of closed loops that each leave some freedom, and none together.
#[derive(Debug, Clone, PartialEq)]
pub struct Locked {
    /// Which elements, ascending.
    pub joints: Vec<usize>,
    /// The joint that is least in line with the others, if any is nearly.
    pub askew: Option<Askew>,
    /// Whether gears are among them, or couplers.
    pub geared: bool,
}

/// A joint whose direction nearly fits those of others in its loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Askew {
    /// Which element.
    pub joint: usize,
    /// One that it does not fit.
    pub other: usize,
    /// Whether it slides; it nearly does so at right angles to the axis of `other`. Otherwise its axis is nearly parallel to that.
    pub slides: bool,
    /// By how much, rad.
    pub angle: f64,
}

/// The locked loops of a model at the position of the probe. Joints that time or states move, whose rows hold up to a limit or push only,
/// or that may be released, are left out: what they hold is no matter of the other joints.
///
/// Rows depend on each other only within a biconnected component of the graph of bodies and joints, so that counting the
/// dependent ones gives the freedom of each.
pub(super) fn locked(model: &Model, layout: &Layout, probe: &Probe<'_>, redundant: &[RedundantRow]) -> Vec<Locked> {
    let ground = model.bodies.len();
    let mut edges: Vec<(usize, [usize; 2])> = Vec::new();
    for (index, element) in model.elements.iter().enumerate().filter(|(_, element)| holds_always(element)) {
        let mut bodies: Vec<usize> = element.markers.iter().map(|marker| marker.body.unwrap_or(ground)).collect();
        bodies.sort_unstable();
        bodies.dedup();
        edges.extend(bodies.windows(2).map(|pair| (index, [pair[0], pair[1]])));
        if bodies.len() > 2 {
            edges.push((index, [bodies[0], bodies[bodies.len() - 1]]));
        }
    }
    let freedoms = |body: usize| match model.bodies.get(body) {
        Some(body) if body.particle => 3,
        Some(_) => 6,
        None => 0,
    };
    let is_redundant = |row: usize| redundant.binary_search_by_key(&row, |one| one.row).is_ok();
    let mut found = Vec::new();
    for block in components(ground + 1, &edges) {
        let mut joints: Vec<usize> = block.iter().map(|edge| edges[*edge].0).collect();
        let mut bodies: Vec<usize> = block.iter().flat_map(|edge| edges[*edge].1).collect();
        for list in [&mut joints, &mut bodies] {
            list.sort_unstable();
            list.dedup();
        }
        let rows = |joint: &usize| layout.rows_of(*joint);
        let of_all: usize = joints.iter().map(|joint| rows(joint).len()).sum();
        let dependent = joints.iter().flat_map(rows).filter(|row| is_redundant(*row)).count();
        // Without the ground the whole may still move.
        let as_one = if bodies.contains(&ground) { 0 } else { 6 };
        let columns = bodies.iter().map(|body| freedoms(*body)).sum::<usize>().saturating_sub(as_one);
        let leaves_some = |joint: &usize| rows(joint).len() < 6 && model.elements[*joint].markers.len() == 2;
        if of_all - dependent < columns || !joints.iter().any(leaves_some) {
            continue;
        }
        joints.retain(|joint| rows(joint).len() < 6);
        let askew = askew(model, layout, probe, &joints);
        // Gears relate motions of several pairs of bodies, and hold none.
        let couples = |joint: &usize| model.elements[*joint].markers.len() > 2;
        let geared = joints.iter().any(couples);
        let is_structure = of_all == columns || joints.iter().any(|joint| rows(joint).len() < GUIDING);
        if askew.is_none() && geared {
            joints.retain(couples);
        }
        if askew.is_some() || geared || !is_structure {
            found.push(Locked { joints, askew, geared });
        }
    }
    found
}

/// Whether a joint's rows are the same at all times.
pub(crate) fn holds_always(element: &Instance) -> bool {
    let gives_way = |role: &Role| matches!(role, Role::Unilateral(_) | Role::Limit(_) | Role::SticksWith(_));
    let recording = &element.recording;
    let of_time = || operations_behind(recording, rows(recording)).iter().any(|(_, op)| *op == Op::Input(Input::Time));
    element.class.kind == Kind::Joint
        && !element.class.opaque
        && !element.rows.is_empty()
        && element.release.is_none()
        && !element.has_states()
        && !recording.outputs.iter().any(|output| gives_way(&output.role))
        && !of_time()
}

/// Biconnected components of a graph with several edges, as lists of edges (Hopcroft & Tarjan 1973, algorithm 447), without recursion:
/// chains are long. Those of one edge are left out.
fn components(nodes: usize, edges: &[(usize, [usize; 2])]) -> Vec<Vec<usize>> {
    let mut at: Vec<Vec<(usize, usize)>> = vec![Vec::new(); nodes];
    for (edge, (_, [a, b])) in edges.iter().enumerate() {
        at[*a].push((edge, *b));
        at[*b].push((edge, *a));
    }
    // When each node was reached, from one on, and the earliest node that is reached from it or from behind it.
    let (mut reached, mut earliest, mut clock) = (vec![0; nodes], vec![0; nodes], 0);
    let (mut open, mut found): (Vec<usize>, Vec<Vec<usize>>) = (Vec::new(), Vec::new());
    for first in 0..nodes {
        if reached[first] > 0 {
            continue;
        }
        clock += 1;
        (reached[first], earliest[first]) = (clock, clock);
        // Nodes on the way, each with the edge that leads to it and how many of its own have been looked at.
        let mut way = vec![(first, usize::MAX, 0)];
        while let Some((node, through, seen)) = way.last_mut() {
            let (node, through) = (*node, *through);
            let Some((edge, next)) = at[node].get(*seen).copied() else {
                way.pop();
                let Some((before, ..)) = way.last() else { break };
                earliest[*before] = earliest[*before].min(earliest[node]);
                if earliest[node] >= reached[*before] {
                    let begin = open.iter().rposition(|edge| *edge == through).unwrap_or(0);
                    let block = open.split_off(begin);
                    found.extend((block.len() > 1).then_some(block));
                }
                continue;
            };
            *seen += 1;
            if reached[next] == 0 {
                clock += 1;
                (reached[next], earliest[next]) = (clock, clock);
                open.push(edge);
                way.push((next, edge, 0));
            } else if edge != through && reached[next] < reached[node] {
                open.push(edge);
                earliest[node] = earliest[node].min(reached[next]);
            }
        }
    }
    found
}

/// The joint with the most directions that nearly fit others, with the smallest of these angles.
fn askew(model: &Model, layout: &Layout, probe: &Probe<'_>, joints: &[usize]) -> Option<Askew> {
    let of = |joint: &usize| directions(model, layout, probe, *joint);
    let all: Vec<Directions> = joints.iter().filter_map(of).collect();
    let nearly = |angle: f64| (EXACTLY..NEARLY).contains(&angle).then_some(angle);
    let misfits = |one: &Directions| -> Vec<Askew> {
        let found = all.iter().filter(|other| other.joint != one.joint).filter_map(|other| {
            let axis = other.axis?;
            let fit = |slides, angle| {
                nearly(angle).map(|angle| Askew { joint: one.joint, other: other.joint, slides, angle })
            };
            let parallel = one.axis.and_then(|own| fit(false, own.cross(&axis).norm().min(1.0).asin()));
            parallel.or_else(|| one.slide.and_then(|own| fit(true, own.dot(&axis).abs().min(1.0).asin())))
        });
        found.collect()
    };
    let most = all.iter().map(misfits).max_by_key(Vec::len)?;
    most.into_iter().min_by(|a, b| a.angle.total_cmp(&b.angle))
}
