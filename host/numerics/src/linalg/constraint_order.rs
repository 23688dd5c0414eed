//! Elimination orders for [`super::SparseLdl`]: sparse, and safe without pivoting.

use std::collections::{BTreeSet, VecDeque};

use super::block_cholesky::find_root;
use super::{BlockCholesky, KktStructure, LinalgError, check_length};

/// Which unknowns belong together and are eliminated together, by label. Labels are free
/// numbers, the same for unknowns of the same cluster; velocities and rows are labelled apart.
///
/// Handing clusters to [`constraint_order`] asserts two things about the values of `J`:
/// 1. the rows of one cluster, restricted to *any one* of the velocity clusters they touch,
///    are independent;
/// 2. rows that touch several velocity clusters are blind to a common motion of all of them.
///
/// Both hold for joints between rigid bodies, with one velocity cluster per body and one row
/// cluster per joint. Where they fail, [`super::Health`] shows it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Clusters {
    /// Label of each velocity, length `n`.
    pub velocities: Vec<usize>,
    /// Label of each row of `J`, length `m`.
    pub rows: Vec<usize>,
}

/// Computes an elimination order of the `n + m` unknowns (row `j` of `J` is unknown `n + j`)
/// in which every leading block is regular if `J` has full rank, so that no pivot vanishes.
///
/// A leading block is regular if its rows of `J`, restricted to its velocities, are
/// independent. Among the orders that ensure that, minimum degree keeps the factor sparse
/// (Tinney & Walker 1967, on clusters, weighted by their sizes, ties by lowest index).
///
/// - With clusters: rows and velocities form a graph, a row that touches one velocity cluster
///   only being an edge to the ground. A spanning forest of it, rooted at the ground, assigns
///   each tree row to the velocity clusters on its far side; it follows these. The rows that
///   close loops follow all velocity clusters of their loop but the one nearest to the root.
///   Chains and trees are factored without fill, like the articulated-body recursion.
/// - Without clusters nothing is known about the values, and each row follows all velocities
///   it touches.
///
/// # Errors
/// [`LinalgError::Pattern`] for an invalid structure, or clusters of the wrong length.
pub fn constraint_order(structure: &KktStructure, clusters: Option<&Clusters>) -> Result<Vec<usize>, LinalgError> {
    structure.validate()?;
    let graph = match clusters {
        Some(clusters) => ClusterGraph::from_labels(structure, clusters)?,
        None => ClusterGraph::from_pattern(structure),
    };
    let waits_for = match clusters {
        Some(_) => one_sided_rule(&graph),
        None => graph.touched.clone(),
    };
    Ok(minimum_degree(&graph, &waits_for))
}

/// Clusters by number: velocity clusters `0..velocity_count`, row clusters behind.
struct ClusterGraph {
    velocity_count: usize,
    /// Unknowns of every cluster, ascending.
    members: Vec<Vec<usize>>,
    /// Velocity clusters touched by each row cluster, ascending.
    touched: Vec<Vec<usize>>,
    /// Neighbours of every cluster in the graph of the matrix.
    neighbours: Vec<BTreeSet<usize>>,
}

impl ClusterGraph {
    fn from_labels(structure: &KktStructure, clusters: &Clusters) -> Result<Self, LinalgError> {
        check_length("velocity clusters", structure.n, clusters.velocities.len())?;
        check_length("row clusters", structure.m, clusters.rows.len())?;
        Ok(Self::new(structure, &clusters.velocities, &clusters.rows))
    }

    /// One velocity cluster per connected block of the mass matrix, one row cluster per row.
    fn from_pattern(structure: &KktStructure) -> Self {
        let blocks = BlockCholesky::new(structure.n, &structure.mass);
        let mut velocities = vec![0; structure.n];
        for block in 0..blocks.block_count() {
            for &unknown in blocks.unknowns(block) {
                velocities[unknown] = block;
            }
        }
        let rows: Vec<usize> = (0..structure.m).collect();
        Self::new(structure, &velocities, &rows)
    }

    fn new(structure: &KktStructure, velocity_labels: &[usize], row_labels: &[usize]) -> Self {
        let n = structure.n;
        let (velocity_count, velocity_clusters) = number_labels(velocity_labels);
        let (row_count, row_clusters) = number_labels(row_labels);
        let cluster_of = |unknown: usize| {
            if unknown < n { velocity_clusters[unknown] } else { velocity_count + row_clusters[unknown - n] }
        };
        let count = velocity_count + row_count;
        let mut members = vec![Vec::new(); count];
        for unknown in 0..n + structure.m {
            members[cluster_of(unknown)].push(unknown);
        }
        let mut neighbours = vec![BTreeSet::new(); count];
        let jacobian = structure.jacobian.iter().map(|&(row, col)| (n + row, col));
        for (i, j) in structure.mass.iter().copied().chain(jacobian) {
            let (a, b) = (cluster_of(i), cluster_of(j));
            if a != b {
                neighbours[a].insert(b);
                neighbours[b].insert(a);
            }
        }
        let touched = neighbours[velocity_count..].iter().map(|set| set.iter().copied().collect()).collect();
        Self { velocity_count, members, touched, neighbours }
    }
}

/// Numbers labels `0..count` in the order of first appearance.
fn number_labels(labels: &[usize]) -> (usize, Vec<usize>) {
    let mut number_of = std::collections::BTreeMap::new();
    let numbers = labels
        .iter()
        .map(|&label| {
            let next = number_of.len();
            *number_of.entry(label).or_insert(next)
        })
        .collect();
    (number_of.len(), numbers)
}

/// Velocity clusters that each row cluster has to wait for, see [`constraint_order`].
fn one_sided_rule(graph: &ClusterGraph) -> Vec<Vec<usize>> {
    let forest = SpanningForest::new(graph);
    graph
        .touched
        .iter()
        .enumerate()
        .map(
            |(row, touched)| {
                if forest.is_tree_row[row] { forest.far_side(touched) } else { forest.loop_below_top(touched) }
            },
        )
        .collect()
}

/// Spanning forest of the velocity clusters; the ground is vertex `velocity_count`.
struct SpanningForest {
    is_tree_row: Vec<bool>,
    /// Vertex towards the root; roots are their own parents.
    parent: Vec<usize>,
    depth: Vec<usize>,
    ground: usize,
}

impl SpanningForest {
    fn new(graph: &ClusterGraph) -> Self {
        let ground = graph.velocity_count;
        let mut forest = Self {
            is_tree_row: vec![false; graph.touched.len()],
            parent: (0..=ground).collect(),
            depth: vec![usize::MAX; ground + 1],
            ground,
        };
        forest.choose_tree_rows(graph);
        forest.root(graph);
        forest
    }

    /// Vertices of a row cluster: what it touches, and the ground if that is one cluster only.
    fn vertices(&self, touched: &[usize]) -> Vec<usize> {
        let mut vertices = touched.to_vec();
        if touched.len() == 1 {
            vertices.push(self.ground);
        }
        vertices
    }

    /// Kruskal's choice: a row cluster belongs to the forest if all its vertices are in
    /// different components so far; the largest clusters choose first.
    fn choose_tree_rows(&mut self, graph: &ClusterGraph) {
        let size_of = |row: usize| graph.members[graph.velocity_count + row].len();
        let mut by_size: Vec<usize> = (0..graph.touched.len()).collect();
        by_size.sort_by_key(|&row| std::cmp::Reverse(size_of(row)));

        let mut component: Vec<usize> = (0..=self.ground).collect();
        for row in by_size {
            let vertices = self.vertices(&graph.touched[row]);
            let mut roots: Vec<usize> = vertices.iter().map(|&vertex| find_root(&mut component, vertex)).collect();
            roots.sort_unstable();
            roots.dedup();
            if vertices.is_empty() || roots.len() < vertices.len() {
                continue;
            }
            self.is_tree_row[row] = true;
            for &root in &roots[1..] {
                component[root] = roots[0];
            }
        }
    }

    /// Breadth-first walk from the ground, then from the first vertex of what is left.
    fn root(&mut self, graph: &ClusterGraph) {
        let mut rows_at = vec![Vec::new(); self.ground + 1];
        for (row, touched) in graph.touched.iter().enumerate() {
            if self.is_tree_row[row] {
                for vertex in self.vertices(touched) {
                    rows_at[vertex].push(row);
                }
            }
        }
        let mut queue = VecDeque::new();
        for start in std::iter::once(self.ground).chain(0..self.ground) {
            if self.depth[start] != usize::MAX {
                continue;
            }
            self.depth[start] = 0;
            queue.push_back(start);
            while let Some(vertex) = queue.pop_front() {
                for &row in &rows_at[vertex] {
                    for next in self.vertices(&graph.touched[row]) {
                        if self.depth[next] == usize::MAX {
                            self.depth[next] = self.depth[vertex] + 1;
                            self.parent[next] = vertex;
                            queue.push_back(next);
                        }
                    }
                }
            }
        }
    }

    /// All touched clusters but the one nearest to the root.
    fn far_side(&self, touched: &[usize]) -> Vec<usize> {
        let vertices = self.vertices(touched);
        let top = vertices.iter().copied().min_by_key(|&v| self.depth[v]);
        touched.iter().copied().filter(|&v| Some(v) != top).collect()
    }

    /// Clusters on the tree paths between the vertices of a row, without their common ancestor.
    fn loop_below_top(&self, touched: &[usize]) -> Vec<usize> {
        let mut front: BTreeSet<usize> = self.vertices(touched).into_iter().collect();
        let mut passed = Vec::new();
        // Lift the deepest vertex until all have met.
        while front.len() > 1 {
            let deepest = front.iter().copied().max_by_key(|&v| self.depth[v]);
            let Some(vertex) = deepest else { break };
            if self.depth[vertex] == 0 {
                // Only roots are left: the row joins components that no tree row joins.
                passed.extend(front.iter().copied().filter(|&v| v != self.ground));
                break;
            }
            front.remove(&vertex);
            front.insert(self.parent[vertex]);
            passed.push(vertex);
        }
        passed
    }
}

/// Minimum degree on the graph of clusters; row cluster `r` becomes eligible when all of
/// `waits_for[r]` are eliminated.
fn minimum_degree(graph: &ClusterGraph, waits_for: &[Vec<usize>]) -> Vec<usize> {
    let count = graph.members.len();
    let first_row = graph.velocity_count;
    let mut neighbours = graph.neighbours.clone();
    let mut waiting = vec![0; count];
    let mut released_by = vec![Vec::new(); first_row];
    for (row, velocities) in waits_for.iter().enumerate() {
        waiting[first_row + row] = velocities.len();
        for &velocity in velocities {
            released_by[velocity].push(first_row + row);
        }
    }
    let weigh = |set: &BTreeSet<usize>| -> usize { set.iter().map(|&cluster| graph.members[cluster].len()).sum() };
    let mut degree: Vec<usize> = neighbours.iter().map(weigh).collect();
    let mut eligible: BTreeSet<(usize, usize)> =
        (0..count).filter(|&cluster| waiting[cluster] == 0).map(|cluster| (degree[cluster], cluster)).collect();

    let mut order = Vec::new();
    while let Some((_, cluster)) = eligible.pop_first() {
        order.extend_from_slice(&graph.members[cluster]);

        // The neighbours of an eliminated cluster become neighbours of each other.
        let around = std::mem::take(&mut neighbours[cluster]);
        for &other in &around {
            let was_eligible = eligible.remove(&(degree[other], other));
            neighbours[other].remove(&cluster);
            neighbours[other].extend(around.iter().copied().filter(|&next| next != other));
            degree[other] = weigh(&neighbours[other]);
            if was_eligible {
                eligible.insert((degree[other], other));
            }
        }
        if cluster >= first_row {
            continue;
        }
        for &row in &released_by[cluster] {
            waiting[row] -= 1;
            if waiting[row] == 0 {
                eligible.insert((degree[row], row));
            }
        }
    }
    order
}
