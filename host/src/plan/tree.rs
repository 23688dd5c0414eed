//! [`SpanningTree`]: which joints' own coordinates carry the bodies.

use element_api::Kind;

use crate::model::Model;

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
}

/// Every body hangs on one joint, or floats. Parents come before children.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SpanningTree {
    /// The joints, one per body.
    pub joints: Vec<TreeJoint>,
}

impl SpanningTree {
    /// Chooses joints. `usable` tells which of those that offer coordinates may be used.
    ///
    /// The tree grows from the ground, next by the joint with the fewest coordinates, for it leaves most of the rows of
    /// others to be solved for; among equals by the one nearest to the ground, which keeps paths short. A part that nothing
    /// connects with the ground floats by its first body.
    #[must_use]
    pub fn new(model: &Model, usable: impl Fn(usize) -> bool) -> Self {
        let edges: Vec<Edge> =
            (0..model.elements.len()).filter_map(|e| Edge::new(model, e)).filter(|e| usable(e.element)).collect();
        let mut tree = Self::default();
        let mut depth: Vec<Option<usize>> = vec![None; model.bodies.len()];
        loop {
            tree.grow(&edges, &mut depth);
            let Some(floating) = depth.iter().position(Option::is_none) else { return tree };
            depth[floating] = Some(0);
            tree.joints.push(TreeJoint {
                element: None,
                parent: None,
                child: floating,
                reversed: false,
                coordinates: 3,
                rotates: !model.bodies[floating].particle,
            });
        }
    }

    /// Adds joints between what is reached and what is not, until there are none.
    fn grow(&mut self, edges: &[Edge], depth: &mut [Option<usize>]) {
        let reached = |depth: &[Option<usize>], body: Option<usize>| body.map_or(Some(0), |body| depth[body]);
        loop {
            let open = edges.iter().filter_map(|edge| {
                let (first, second) = (reached(depth, edge.bodies[0]), reached(depth, edge.bodies[1]));
                match (first, second) {
                    (Some(near), None) => Some((edge.freedoms, near, edge.element, edge, false)),
                    (None, Some(near)) => Some((edge.freedoms, near, edge.element, edge, true)),
                    _ => None,
                }
            });
            let Some((_, near, _, edge, reversed)) =
                open.min_by_key(|(freedoms, near, element, ..)| (*freedoms, *near, *element))
            else {
                return;
            };
            let (parent, child) = if reversed { (1, 0) } else { (0, 1) };
            let Some(carried) = edge.bodies[child] else { return };
            depth[carried] = Some(near + 1);
            self.joints.push(TreeJoint {
                element: Some(edge.element),
                parent: edge.bodies[parent],
                child: carried,
                reversed,
                coordinates: edge.coordinates,
                rotates: edge.rotates,
            });
        }
    }

    /// Whether an element's coordinates are used.
    #[must_use]
    pub fn uses(&self, element: usize) -> bool {
        self.joints.iter().any(|joint| joint.element == Some(element))
    }

    /// Number of velocities.
    #[must_use]
    pub fn freedoms(&self) -> usize {
        self.joints.iter().map(|joint| joint.coordinates + 3 * usize::from(joint.rotates)).sum()
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
    /// `None` where the element offers no coordinates, or some of the rows they stand for are switched off.
    fn new(model: &Model, element: usize) -> Option<Self> {
        let instance = &model.elements[element];
        let coordinates = instance.class.mobility?;
        let [first, second] = &instance.markers[..] else { return None };
        let complete = instance.rows.len() == instance.class.rows.len();
        let particle = |body: Option<usize>| body.is_some_and(|body| model.bodies[body].particle);
        let offered = instance.class.kind == Kind::Joint && !instance.class.opaque && complete;
        if !offered || first.body == second.body || particle(first.body) || particle(second.body) {
            return None;
        }
        let rotates = instance.class.turns_freely;
        let freedoms = coordinates + 3 * usize::from(rotates);
        Some(Self { element, bodies: [first.body, second.body], coordinates, rotates, freedoms })
    }
}
