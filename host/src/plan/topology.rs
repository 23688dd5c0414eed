//! How a model hangs together.

use element_api::Kind;

use crate::model::Model;

/// Bodies that can influence each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Island {
    /// Its bodies.
    pub bodies: Vec<usize>,
    /// Its elements.
    pub elements: Vec<usize>,
    /// Number of independent closed loops of joints, ground counted as one body.
    pub loops: usize,
}

/// The islands of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    /// Islands in the order of their first body.
    pub islands: Vec<Island>,
}

impl Topology {
    /// Finds the islands: joints and force elements connect, ground does not.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let mut parent: Vec<usize> = (0..model.bodies.len()).collect();
        for element in &model.elements {
            let mut bodies = element.markers.iter().filter_map(|m| m.body);
            if let Some(first) = bodies.next() {
                for other in bodies {
                    let (a, b) = (root(&parent, first), root(&parent, other));
                    parent[a.max(b)] = a.min(b);
                }
            }
        }
        let mut islands: Vec<Island> = Vec::new();
        let mut island_of_root = vec![None; model.bodies.len()];
        for body in 0..model.bodies.len() {
            let at = *island_of_root[root(&parent, body)].get_or_insert_with(|| {
                islands.push(Island { bodies: Vec::new(), elements: Vec::new(), loops: 0 });
                islands.len() - 1
            });
            islands[at].bodies.push(body);
        }
        for (index, element) in model.elements.iter().enumerate() {
            let Some(body) = element.markers.iter().find_map(|m| m.body) else { continue };
            if let Some(at) = island_of_root[root(&parent, body)] {
                islands[at].elements.push(index);
            }
        }
        for island in &mut islands {
            island.loops = count_loops(model, island);
        }
        Self { islands }
    }
}

fn root(parent: &[usize], mut body: usize) -> usize {
    while parent[body] != body {
        body = parent[body];
    }
    body
}

/// Joints beyond a spanning forest over the island's bodies and ground close loops.
fn count_loops(model: &Model, island: &Island) -> usize {
    let ground = model.bodies.len();
    let mut parent: Vec<usize> = (0..=ground).collect();
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
            let (a, b) = (root(&parent, pair[0]), root(&parent, pair[1]));
            if a == b {
                loops += 1;
            } else {
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    loops
}
