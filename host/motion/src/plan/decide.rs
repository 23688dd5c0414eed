//! [`Plan`]: which rows are independent, which reactions are unique, what is skipped.

use std::collections::BTreeSet;
use std::ops::Range;

use element_api::recording::Role;
use nalgebra::{DMatrix, Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::axes::{Crosswise, crosswise, extend};
use super::layout::Layout;
use super::led::Led;
use super::locked::{Locked, locked};
use super::topology::Topology;
use super::undetermined::{NullLoads, Undetermined, undetermined};
use crate::linalg::{
    Clusters, DenseQr, Health, KktSolver, KktStructure, LIGHT, LinalgError, NullVector, SingularValues, SparseRank,
    TRUSTED,
};
use crate::model::{Axes, MAGNITUDE, Model, rotation};

/// Share of the largest pivot below which a constraint row counts as dependent on others at the assembled position.
pub const RANK_TOLERANCE: f64 = 1e-9;

/// Share of the largest load of redundant rows below which another one is round-off.
const SHOWS: f64 = 1e-7;

/// Below this pivot ratio at the start, whatever the masses, elimination without pivoting is not trusted with a scene at all. Of loops
/// in a row it falls with the fourth power of their number, of alike ones to this at 190.
const LEAST_HEALTH: f64 = 1e-8;

/// Pivot ratio, in the metric of the masses, from which elimination keeps enough digits where solutions are refined once.
pub const ACCURATE_REFINED: f64 = 1e-10;

/// A constraint row that follows from the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RedundantRow {
    /// Its number among all rows.
    pub row: usize,
    /// Joint and row, as in reports.
    pub name: String,
}

/// Whether a joint's reaction on a body is determined by the equations of motion, ground axes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reaction {
    /// Which element.
    pub element: usize,
    /// Which frame of it.
    pub frame: usize,
    /// Components of the force.
    pub force: [bool; 3],
    /// Components of the torque at the frame's origin.
    pub torque: [bool; 3],
}

impl Reaction {
    /// Whether everything is unique.
    #[must_use]
    pub fn is_unique(&self) -> bool {
        self.force.iter().chain(&self.torque).all(|unique| *unique)
    }
}

/// The directions of force and torque that are open of the load of an element's frame, ground axes, orthonormal.
pub(super) type OpenLoads = FxHashMap<(usize, usize), [Vec<Vector3<f64>>; 2]>;

/// What is open of reactions at a place, and the rotations of bodies there.
#[derive(Debug, Clone)]
struct OpenPlace {
    loads: OpenLoads,
    rotations: Vec<Matrix3<f64>>,
}

/// Centres of mass, m, and rotations body -> ground of the bodies in a working state, 13 numbers each.
#[must_use]
pub fn poses_of_bodies(working: &[f64], bodies: usize) -> (Vec<Vector3<f64>>, Vec<Matrix3<f64>>) {
    let pose = |y: &[f64]| (Vector3::new(y[0], y[1], y[2]), rotation(&[y[3], y[4], y[5], y[6]]));
    working.chunks_exact(13).take(bodies).map(pose).unzip()
}

/// The constraint equations at the assembled position, as numbers.
pub struct Probe<'a> {
    /// The rows that are enforced, by their number among all; ascending.
    pub rows: &'a [usize],
    /// Patterns of mass matrix and Jacobian (of these rows).
    pub structure: &'a KktStructure,
    /// Values of the mass matrix.
    pub mass: &'a [f64],
    /// Values of the Jacobian.
    pub jacobian: &'a [f64],
    /// Centre of mass of each body, m, ground axes.
    pub positions: &'a [Vector3<f64>],
    /// Rotation body -> ground of each body.
    pub rotations: &'a [Matrix3<f64>],
    /// A length typical of the scene, m.
    pub length: f64,
    /// What makes columns comparable, see [`super::body_scales`].
    pub scales: &'a [f64],
}

impl Probe<'_> {
    /// The entries of some rows, by their numbers among all: row, column, value.
    pub(super) fn entries(&self, rows: Range<usize>) -> impl Iterator<Item = (usize, usize, f64)> {
        let pattern = &self.structure.jacobian;
        let before = |row: usize| pattern.partition_point(|(k, _)| self.rows[*k] < row);
        let entries = before(rows.start)..before(rows.end);
        let pairs = pattern[entries.clone()].iter().zip(&self.jacobian[entries]);
        pairs.map(|((k, column), value)| (self.rows[*k], *column, *value))
    }
}

/// What was decided. Constant.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Where every number lies.
    pub layout: Layout,
    /// The rows that are enforced or follow from others; ascending. The others are those of contacts that are open.
    pub rows: Vec<usize>,
    /// How the model hangs together.
    pub topology: Topology,
    /// Rows that are enforced, ascending.
    pub independent_rows: Vec<usize>,
    /// Rows that follow from them.
    pub redundant_rows: Vec<RedundantRow>,
    /// Rank and conditioning of all rows at the assembled position, whatever the masses.
    pub health: Health,
    /// Pivot ratio of eliminating the rows that are enforced there, whatever the masses: of the size of a square.
    pub independence: f64,
    /// Degrees of freedom at the assembled position.
    pub mobility: usize,
    /// Per joint and frame on a body or ground, ascending: which components are unique.
    pub reactions: Vec<Reaction>,
    /// Elements whose results depend on components that are not unique.
    pub undetermined: Vec<Undetermined>,
    /// Use the rank-safe engine for every evaluation, and why; `None`: only where the rank falls.
    pub always_rank_safe: Option<String>,
    /// Pivot ratio of the sparse engine with those rows; zero where it has none.
    pub sparse_health: f64,
    /// Closed loops that cannot move.
    pub locked: Vec<Locked>,
    /// Elements whose axes do not stay parallel.
    pub crosswise: Vec<Crosswise>,
    /// Where reactions are not unique, here and at other places that were joined.
    open: Vec<OpenPlace>,
}

/// What the joints determine at a place of the motion: what of a [`Plan`] changes on the way.
#[derive(Debug, Clone)]
pub struct Determinacy {
    /// As [`Plan::health`].
    pub health: Health,
    independent_rows: Vec<usize>,
    reactions: Vec<Reaction>,
    open: Vec<OpenPlace>,
}

/// What is known at a place before anything is decided.
struct Found {
    topology: Topology,
    /// The sparse engine with all rows, where these are those of a sound tree.
    sound: Option<Health>,
    redundant: Vec<usize>,
    null_loads: Vec<NullLoads>,
    determinacy: Determinacy,
}

impl Found {
    fn new(
        model: &Model,
        layout: &Layout,
        probe: &Probe<'_>,
        sparse_health: &mut impl FnMut(&[usize], &[f64]) -> Result<Health, LinalgError>,
    ) -> Result<Self, LinalgError> {
        let topology = Topology::new(model, &Led::find(model, layout, probe));
        let all = probe.rows.to_vec();
        // Trees with pivots beyond doubt have no dependent rows; only other scenes need the dense rank.
        let sound = if topology.is_tree() {
            sparse_health(&all, probe.mass).ok().filter(|h| h.smallest_pivot_ratio >= TRUSTED)
        } else {
            None
        };
        let Rank { health, independent_rows, dependent_rows, null_space } = match sound {
            // The rank-safe engine's pivots are not known; nothing is compared with them.
            // Rank is a question about the joints, but rows that are far from dependent in one metric are so in all.
            Some(_) => Rank {
                health: Health { rank: all.len(), smallest_pivot_ratio: 0.0 },
                independent_rows: all,
                dependent_rows: Vec::new(),
                null_space: Vec::new(),
            },
            None => Rank::find(layout, probe, &of_positions(model, layout, probe.rows))?.among(probe.rows),
        };
        let (reactions, null_loads, loads) = unique_reactions(model, layout, probe, &null_space);
        let open = match loads.is_empty() {
            true => Vec::new(),
            false => vec![OpenPlace { loads, rotations: probe.rotations.to_vec() }],
        };
        let determinacy = Determinacy { health, independent_rows, reactions, open };
        Ok(Self { topology, sound, redundant: dependent_rows, null_loads, determinacy })
    }
}

impl Determinacy {
    /// From the model and its Jacobian at an assembled position; `sparse_health` as for [`Plan::decide`].
    ///
    /// # Errors
    /// As for [`Plan::decide`].
    pub fn find(
        model: &Model,
        layout: &Layout,
        probe: &Probe<'_>,
        mut sparse_health: impl FnMut(&[usize], &[f64]) -> Result<Health, LinalgError>,
    ) -> Result<Self, LinalgError> {
        Ok(Found::new(model, layout, probe, &mut sparse_health)?.determinacy)
    }
}

impl Plan {
    /// Decides from the model and its Jacobian at the assembled position.
    ///
    /// `sparse_health` tries the sparse engine on a choice of rows, with values of the mass matrix, and reports how well that went.
    /// `no_choice`: why all rows are for the rank-safe engine whatever that finds, if they are.
    ///
    /// # Errors
    /// When the mass matrix is not positive definite or a number is not finite.
    pub fn decide(
        model: &Model,
        layout: &Layout,
        probe: &Probe<'_>,
        no_choice: Option<&str>,
        mut sparse_health: impl FnMut(&[usize], &[f64]) -> Result<Health, LinalgError>,
    ) -> Result<Self, LinalgError> {
        let Found { topology, sound, redundant, null_loads, determinacy } =
            Found::new(model, layout, probe, &mut sparse_health)?;
        let Determinacy { health, independent_rows, reactions, open } = determinacy;
        let named = |row: usize| {
            let (element, k) = layout.element_of_row(row);
            RedundantRow { row, name: model.elements[element].row_name(k) }
        };
        let redundant_rows: Vec<RedundantRow> = redundant.into_iter().map(named).collect();
        let undetermined = undetermined(model, probe.rotations, &null_loads, &reactions);
        let alike = probe.structure.metric(probe.scales);
        let independence = sparse_health(&independent_rows, &alike).map_or(0.0, |health| health.smallest_pivot_ratio);
        // Of a sound tree that is known.
        let enforced = sound.map_or_else(|| sparse_health(&independent_rows, probe.mass), Ok);
        let always_rank_safe = match (no_choice, &enforced) {
            (Some(why), _) => Some(why.to_string()),
            (None, Ok(health)) if health.smallest_pivot_ratio >= ACCURATE_REFINED && independence >= LEAST_HEALTH => {
                None
            }
            (None, Ok(found)) => Some(close_to_dependent(found.smallest_pivot_ratio, independence)),
            (None, Err(error)) => Some(error.to_string()),
        };
        let locked = if topology.is_tree() { Vec::new() } else { locked(model, layout, probe, &redundant_rows) };
        Ok(Self {
            layout: layout.clone(),
            rows: probe.rows.to_vec(),
            topology,
            locked,
            crosswise: crosswise(model, layout, probe),
            open,
            independent_rows,
            redundant_rows,
            mobility: layout.velocities() - health.rank - free_rotations_of_particles(model, probe),
            health,
            independence,
            reactions,
            undetermined,
            always_rank_safe,
            sparse_health: enforced.map_or(0.0, |health| health.smallest_pivot_ratio),
        })
    }

    /// Takes for not unique, too, what is not at another place of the motion: what redundant rows leave open turns with the bodies,
    /// and comes into other components. A place of another rank says nothing.
    pub fn join(&mut self, there: &Determinacy) {
        if there.independent_rows.len() != self.independent_rows.len() {
            return;
        }
        for (here, there) in self.reactions.iter_mut().zip(&there.reactions) {
            let all = |mine: &mut [bool; 3], other: &[bool; 3]| mine.iter_mut().zip(other).for_each(|(a, b)| *a &= b);
            all(&mut here.force, &there.force);
            all(&mut here.torque, &there.torque);
        }
        self.open.extend_from_slice(&there.open);
    }

    /// Whether a component of a reaction is unique in these axes, wherever that was judged; the magnitude where all are.
    #[must_use]
    pub fn is_unique_in(&self, axes: Axes, element: usize, frame: usize, torque: bool, component: usize) -> bool {
        let Axes::Body(body) = axes else {
            return self.is_unique(element, frame, torque, Some(component).filter(|k| *k < MAGNITUDE));
        };
        let in_axes = |place: &OpenPlace| {
            let Some(open) = place.loads.get(&(element, frame)).map(|open| &open[usize::from(torque)]) else {
                return true;
            };
            let along = |direction: &Vector3<f64>| place.rotations[body].column(component).dot(direction).abs();
            if component < MAGNITUDE { open.iter().all(|direction| along(direction) <= SHOWS) } else { open.is_empty() }
        };
        self.open.iter().all(in_axes)
    }

    /// Whether a component of a reaction is unique; `true` for elements without rows.
    #[must_use]
    pub fn is_unique(&self, element: usize, frame: usize, torque: bool, component: Option<usize>) -> bool {
        let found = self.reactions.binary_search_by_key(&(element, frame), |r| (r.element, r.frame));
        let Some(reaction) = found.ok().map(|at| &self.reactions[at]) else { return true };
        let list = if torque { &reaction.torque } else { &reaction.force };
        component.map_or_else(|| list.iter().all(|u| *u), |k| list[k])
    }
}

/// The rotations of particles, which are none of the motion, as far as no rows hold them.
fn free_rotations_of_particles(model: &Model, probe: &Probe<'_>) -> usize {
    let particles: Vec<usize> = (0..model.bodies.len()).filter(|body| model.bodies[*body].particle).collect();
    if particles.is_empty() {
        return 0;
    }
    let place = |column: usize| (column % 6 >= 3).then(|| particles.binary_search(&(column / 6)).ok()).flatten();
    let held = probe.structure.jacobian.iter().zip(probe.jacobian).filter_map(|((row, column), value)| {
        Some((*row, 3 * place(*column)? + column % 3, value * probe.scales[*column])).filter(|held| held.2 != 0.0)
    });
    let held: Vec<(usize, usize, f64)> = held.collect();
    let numbers = |of: &dyn Fn(&(usize, usize, f64)) -> usize| held.iter().map(of).collect::<BTreeSet<usize>>();
    let (rows, columns) = (numbers(&|held| held.0), numbers(&|held| held.1));
    let (rows, columns): (Vec<usize>, Vec<usize>) = (rows.into_iter().collect(), columns.into_iter().collect());
    let mut matrix = DMatrix::zeros(rows.len(), columns.len());
    for (row, column, value) in &held {
        if let (Ok(row), Ok(column)) = (rows.binary_search(row), columns.binary_search(column)) {
            matrix[(row, column)] = *value;
        }
    }
    let rank = SingularValues::of(&matrix).map_or(0, |values| values.rank(RANK_TOLERANCE * values.largest()));
    3 * particles.len() - rank
}

/// Why elimination is not trusted with the rows in use, by its pivot ratio and by that of the rows whatever the masses.
#[must_use]
pub fn close_to_dependent(ratio: f64, independence: f64) -> String {
    let cause = if independence >= LEAST_HEALTH {
        "masses and inertias differ by too many decades"
    } else {
        "the constraints are close to dependent at the start"
    };
    format!("{cause} (pivot ratio {ratio:.1e})")
}

/// The places of rows that constrain positions.
fn of_positions(model: &Model, layout: &Layout, rows: &[usize]) -> Vec<usize> {
    let constrains = |place: &usize| {
        let (element, k) = layout.element_of_row(rows[*place]);
        let instance = &model.elements[element];
        instance.recording.output(Role::VelocityResidual(instance.rows[k] as u32)).is_none()
    };
    (0..rows.len()).filter(constrains).collect()
}

/// The rows of all joints, sorted out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rank {
    pub(super) health: Health,
    /// Ascending.
    pub(super) independent_rows: Vec<usize>,
    /// Ascending.
    pub(super) dependent_rows: Vec<usize>,
    /// Vectors lambda with Phi_q^T lambda = 0, as rows and values, one per dependent row.
    pub(super) null_space: Vec<NullVector>,
}

impl Rank {
    /// By the dense engine where that takes no time, or where elimination is in doubt; otherwise by elimination.
    fn find(layout: &Layout, probe: &Probe<'_>, of_positions: &[usize]) -> Result<Self, LinalgError> {
        let (n, m) = (probe.structure.n as f64, probe.structure.m as f64);
        if n * m * m > LIGHT
            && let Some(found) = Self::by_elimination(layout, probe)?
        {
            return Ok(found);
        }
        Self::dense(probe, of_positions)
    }

    /// The same with rows by their number among all.
    fn among(mut self, rows: &[usize]) -> Self {
        let lists = [&mut self.independent_rows, &mut self.dependent_rows];
        lists.into_iter().flatten().for_each(|row| *row = rows[*row]);
        self.null_space.iter_mut().flatten().for_each(|(row, _)| *row = rows[*row]);
        self
    }

    /// The twin of [`Rank::by_elimination`]: QR with column pivoting, rows on positions first. What follows from these holds as they do; a
    /// position that follows from velocities would drift away with the errors of integration.
    pub(super) fn dense(probe: &Probe<'_>, of_positions: &[usize]) -> Result<Self, LinalgError> {
        let mut qr = DenseQr::new(probe.structure, RANK_TOLERANCE)?;
        qr.set_measure(probe.scales)?;
        qr.set_first_rows(of_positions)?;
        qr.set_mass(probe.mass)?;
        let health = qr.refactor(probe.jacobian)?;
        let (mut independent_rows, mut dependent_rows) = (qr.independent_rows().to_vec(), qr.dependent_rows().to_vec());
        independent_rows.sort_unstable();
        dependent_rows.sort_unstable();
        let vectors = qr.null_space()?;
        let entries = |vector: &[f64]| vector.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect();
        let null_space = vectors.chunks_exact(probe.structure.m.max(1)).map(entries).collect();
        Ok(Self { health, independent_rows, dependent_rows, null_space })
    }

    /// Sparse elimination, one cluster per body and per joint; `None` in doubt.
    pub(super) fn by_elimination(layout: &Layout, probe: &Probe<'_>) -> Result<Option<Self>, LinalgError> {
        let clusters = Clusters {
            velocities: (0..layout.velocities()).map(|k| k / 6).collect(),
            rows: probe.rows.iter().map(|row| layout.element_of_row(*row).0).collect(),
        };
        let metric = probe.structure.metric(probe.scales);
        let Some(rank) = SparseRank::find(probe.structure, &clusters, &metric, probe.jacobian)? else {
            return Ok(None);
        };
        let Some(null_space) = rank.null_space(probe.structure, &clusters, &metric, probe.jacobian)? else {
            return Ok(None);
        };
        Ok(Some(Self {
            health: Health { rank: rank.independent.len(), smallest_pivot_ratio: rank.smallest_sine },
            independent_rows: rank.independent,
            dependent_rows: rank.dependent,
            null_space,
        }))
    }
}

/// A vector lambda0 of the null space of Phi_q^T can be added to the multipliers without any effect on the motion. The
/// components of a reaction in which some lambda0 shows are not unique.
pub(super) fn unique_reactions(
    model: &Model,
    layout: &Layout,
    probe: &Probe<'_>,
    null_space: &[NullVector],
) -> (Vec<Reaction>, Vec<NullLoads>, OpenLoads) {
    let mut taken = vec![false; model.elements.len()];
    model.elements.iter().flat_map(|element| &element.joints).for_each(|joint| taken[*joint] = true);
    let (mut null_loads, mut open) = (Vec::new(), OpenLoads::default());
    let mut reactions = Vec::new();
    let mut first_of = vec![0; model.elements.len()];
    for (element, instance) in model.elements.iter().enumerate() {
        first_of[element] = reactions.len();
        if instance.rows.is_empty() {
            continue;
        }
        for (frame, _) in instance.markers.iter().enumerate() {
            reactions.push(Reaction { element, frame, force: [true; 3], torque: [true; 3] });
        }
    }
    let mut lambda = vec![0.0; layout.rows];
    for vector in null_space {
        vector.iter().for_each(|(row, value)| lambda[*row] = *value);
        let mut elements: Vec<usize> = vector.iter().map(|(row, _)| layout.element_of_row(*row).0).collect();
        elements.sort_unstable();
        elements.dedup();
        // Only these carry any load.
        let frames = |element: &usize| first_of[*element]..first_of[*element] + model.elements[*element].markers.len();
        let touched: Vec<usize> = elements.iter().flat_map(frames).collect();
        let mut loads: Vec<(Vector3<f64>, Vector3<f64>)> =
            touched.iter().map(|k| null_load(model, layout, probe, &lambda, &reactions[*k])).collect();
        // The size of a load in newtons, torques taken on the scene's length.
        let size = |(f, n): &(Vector3<f64>, Vector3<f64>)| f.amax().max(n.amax() / probe.length);
        let largest = loads.iter().map(size).fold(0.0, f64::max);
        let shows = |x: f64| x.abs() > SHOWS * largest;
        for (k, (force, torque)) in touched.iter().zip(&mut loads) {
            let reaction = &mut reactions[*k];
            let parts = [(force, &mut reaction.force, 1.0), (torque, &mut reaction.torque, probe.length)];
            for (kind, (load, unique, length)) in parts.into_iter().enumerate() {
                for (part, unique) in load.iter_mut().zip(unique) {
                    match shows(*part / length) {
                        true => *unique = false,
                        // Round-off is no load.
                        false => *part = 0.0,
                    }
                }
                if *load != Vector3::zeros() {
                    let list = open.entry((reaction.element, reaction.frame)).or_default();
                    extend(&mut list[kind], *load / (length * largest), SHOWS);
                }
            }
        }
        let taken = touched.iter().zip(loads).filter(|(k, _)| taken[reactions[**k].element]);
        let of_frames: NullLoads =
            taken.map(|(k, load)| ((reactions[*k].element, reactions[*k].frame), load)).collect();
        null_loads.push(of_frames);
        vector.iter().for_each(|(row, _)| lambda[*row] = 0.0);
    }
    (reactions, null_loads, open)
}

/// Force and torque at a frame's origin, ground axes, that multipliers cause on the body of the frame (on ground: on all
/// others together).
fn null_load(
    model: &Model,
    layout: &Layout,
    probe: &Probe<'_>,
    lambda: &[f64],
    reaction: &Reaction,
) -> (Vector3<f64>, Vector3<f64>) {
    let instance = &model.elements[reaction.element];
    let rows = layout.rows_of(reaction.element);
    let marker = &instance.markers[reaction.frame];
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    // Torques are about the origin of the frame.
    let origin = match marker.body {
        Some(body) => probe.positions[body] + probe.rotations[body] * marker.position,
        None => marker.position,
    };
    for (row, column, value) in probe.entries(rows) {
        let body = column / 6;
        if marker.body.is_some_and(|own| own != body) {
            continue;
        }
        let load = -value * lambda[row];
        if column % 6 < 3 {
            force[column % 6] += load;
            let mut part = Vector3::zeros();
            part[column % 6] = load;
            torque += (probe.positions[body] - origin).cross(&part);
        } else {
            torque += probe.rotations[body].column(column % 6 - 3) * load;
        }
    }
    (force, torque)
}
