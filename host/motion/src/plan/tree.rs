//! [`SpanningTree`]: which joints' own coordinates carry the bodies.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use element_api::Kind;

use super::layout::Layout;
use crate::model::{Marker, Model};

/// How a body hangs on the one before it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TreeJoint {
    /// The joint whose coordinates are used; `None`: the body floats freely against the ground.
    pub element: Option<usize>,
    /// The body that is nearer to the ground; `None`: the ground.
    pub parent: Option<usize>,
    /// The body that is carried.
    pub child: usize,
    /// Whether the body carried has the joint's first frame, not its second.
    pub reversed: bool,
    /// Number of coordinates.
    pub coordinates: usize,
    /// Whether a rotation in all directions follows the coordinates, described by Euler parameters.
    pub rotates: bool,
    /// Whether the joint is one of all displacements in a plane, so that it is of no matter to it where in that the origin of its second
    /// frame lies, and coordinates are those of the centre of mass of the body carried: another point would circle around that.
    pub centred: bool,
}

impl TreeJoint {
    /// The frames that coordinates are those of; `None` for a body that floats.
    #[must_use]
    pub fn markers(&self, model: &Model) -> Option<[Marker; 2]> {
        let markers = &model.elements[self.element?].markers;
        let mut frames = [markers[0].clone(), markers[1].clone()];
        if self.centred {
            let normal = frames[1].rotation.column(2).into_owned();
            frames[1].position = normal * normal.dot(&frames[1].position);
        }
        Some(frames)
    }
}

/// A coordinate of a tree that follows others wherever the mechanism is: q = offset + sum factor q_other.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    /// Its number among the coordinates of the tree's joints, free rotations left out.
    pub line: usize,
    /// The others, none of them a follower, with their factors.
    pub of: Vec<(usize, f64)>,
    /// m or rad
    pub offset: f64,
}

/// Every body hangs on one joint, or floats. Parents come before children.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpanningTree {
    /// The joints, one per body.
    pub joints: Vec<TreeJoint>,
    /// Coordinates that are none of the state's, by line.
    pub followers: Vec<Follower>,
}

impl SpanningTree {
    /// Chooses joints. `usable` says which of those that offer coordinates may be used.
    ///
    /// The tree grows from the ground, next by the joint with the fewest coordinates, for it leaves most of the rows of
    /// others to be solved for; among equals by the one nearest to the ground, which keeps paths short. A part that nothing
    /// connects with the ground floats by its first body.
    #[must_use]
    pub fn new(model: &Model, usable: impl Fn(usize) -> bool) -> Self {
        let edges: Vec<Edge> =
            (0..model.elements.len()).filter_map(|e| Edge::new(model, e)).filter(|e| usable(e.element)).collect();
        let mut growing = Growing::new(&edges, model.bodies.len());
        growing.reach(None, 0);
        let mut tree = Self::default();
        for floating in 0..model.bodies.len() {
            tree.grow(&mut growing);
            if growing.depth[floating].is_some() {
                continue;
            }
            growing.reach(Some(floating), 0);
            tree.joints.push(TreeJoint {
                element: None,
                parent: None,
                child: floating,
                reversed: false,
                coordinates: 3,
                rotates: !model.bodies[floating].particle,
                centred: false,
            });
        }
        tree.grow(&mut growing);
        tree
    }

    /// Adds joints between what is reached and what is not, until there are none.
    fn grow(&mut self, growing: &mut Growing<'_>) {
        while let Some(Reverse((_, near, _, number, reversed))) = growing.open.pop() {
            let edge = &growing.edges[number];
            let (parent, child) = if reversed { (1, 0) } else { (0, 1) };
            let Some(carried) = edge.bodies[child].filter(|body| growing.depth[*body].is_none()) else { continue };
            self.joints.push(TreeJoint {
                element: Some(edge.element),
                parent: edge.bodies[parent],
                child: carried,
                reversed,
                coordinates: edge.coordinates,
                rotates: edge.rotates,
                centred: false,
            });
            growing.reach(Some(carried), near + 1);
        }
    }

    /// For each of so many elements, whether its coordinates are used.
    #[must_use]
    pub fn used(&self, elements: usize) -> Vec<bool> {
        let mut used = vec![false; elements];
        self.joints.iter().filter_map(|joint| joint.element).for_each(|element| used[element] = true);
        used
    }

    /// Whether all rows are those of joints whose coordinates are used.
    #[must_use]
    pub fn closes_no_loop(&self, layout: &Layout) -> bool {
        let used = self.used(layout.row_at.len());
        (0..layout.rows).all(|row| used[layout.element_of_row(row).0])
    }

    /// For each joint and each of its coordinates, free rotations left out, whether it belongs to the state.
    #[must_use]
    pub fn kept(&self) -> Vec<Vec<bool>> {
        let mut lines = 0;
        let mut followers = self.followers.iter().peekable();
        let mut kept = |_| {
            lines += 1;
            followers.next_if(|follower| follower.line + 1 == lines).is_none()
        };
        self.joints.iter().map(|joint| (0..joint.coordinates).map(&mut kept).collect()).collect()
    }
}

/// A tree that grows.
struct Growing<'a> {
    edges: &'a [Edge],
    /// Edges by the bodies they end at, the ground first.
    at: Vec<Vec<usize>>,
    /// Joints between each body and the ground, of those that are reached.
    depth: Vec<Option<usize>>,
    open: BinaryHeap<Reverse<Reached>>,
}

/// An edge from what is reached: freedoms, depth there, element; number of the edge, whether it is met by its second end.
type Reached = (usize, usize, usize, usize, bool);

impl<'a> Growing<'a> {
    fn new(edges: &'a [Edge], bodies: usize) -> Self {
        let mut at = vec![Vec::new(); bodies + 1];
        for (number, edge) in edges.iter().enumerate() {
            edge.bodies.iter().for_each(|body| at[body.map_or(0, |body| body + 1)].push(number));
        }
        Self { edges, at, depth: vec![None; bodies], open: BinaryHeap::new() }
    }

    fn reach(&mut self, body: Option<usize>, depth: usize) {
        if let Some(body) = body {
            self.depth[body] = Some(depth);
        }
        for number in &self.at[body.map_or(0, |body| body + 1)] {
            let edge = &self.edges[*number];
            self.open.push(Reverse((edge.freedoms, depth, edge.element, *number, edge.bodies[1] == body)));
        }
    }
}

/// A joint that offers coordinates.
struct Edge {
    element: usize,
    bodies: [Option<usize>; 2],
    coordinates: usize,
    rotates: bool,
    freedoms: usize,
}

impl Edge {
    /// `None` where the element offers no coordinates, or some of the rows they stand for are switched off, or it may let go: the
    /// coordinates are the same before and after.
    fn new(model: &Model, element: usize) -> Option<Self> {
        let instance = &model.elements[element];
        let coordinates = instance.class.mobility?;
        let [first, second] = &instance.markers[..] else { return None };
        let complete = instance.rows.len() == instance.class.rows.len();
        let particle = |body: Option<usize>| body.is_some_and(|body| model.bodies[body].particle);
        let stays = instance.release.is_none();
        let offered = instance.class.kind == Kind::Joint && !instance.class.opaque && complete && stays;
        if !offered || first.body == second.body || particle(first.body) || particle(second.body) {
            return None;
        }
        let rotates = instance.class.turns_freely;
        let freedoms = coordinates + 3 * usize::from(rotates);
        Some(Self { element, bodies: [first.body, second.body], coordinates, rotates, freedoms })
    }
}
