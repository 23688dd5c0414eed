//! [`Portable`]: the programs of a mechanism in the coordinates of joints, for those who write them in another language.

use super::*;
use crate::plan::Coordinates;
use crate::program::Program;

/// A program of quantities in the inputs of the formulation.
#[derive(Debug, Clone)]
pub struct Quantities {
    /// The program.
    pub program: Program,
    /// Whether it takes accelerations and multipliers, which [`Portable::motion`] gives, among its inputs.
    pub solved: bool,
}

/// See the module documentation. All programs take one vector of inputs: see [`Portable::coordinates`] and the layout of the scene.
#[derive(Debug, Clone)]
pub struct Portable {
    /// What the entries of the state are, and where they lie among the inputs.
    pub coordinates: Coordinates,
    /// What kind each entry of the state is.
    pub groups: Vec<Group>,
    /// Length of the scene, m.
    pub length: f64,
    /// Rows that are solved with.
    pub rows: Vec<usize>,
    /// Rows beyond these that are to hold by themselves, each with the size of its gradient, 1 for rows in metres.
    pub others: Vec<(usize, f64)>,
    /// Sizes of the gradients of [`Portable::rows`] likewise.
    pub sizes: Vec<f64>,
    /// Accelerations, multipliers of [`Portable::rows`], rates of element states, power; then pivots: of each velocity, of each row.
    pub motion: Program,
    /// The smallest move that meets the rows to first order; values of the rows; pivots.
    pub position: Program,
    /// The smallest change of velocities that meets the rows; then pivots: of each velocity, of each row; magnitudes that these are
    /// made of, alike; pivots of the rows whatever the masses.
    pub velocity: Program,
    /// By how little the pivots of rows whatever the masses may fall: below this share of the square of a row's gradient the rows
    /// count as dependent.
    pub least_independence: f64,
    /// Squares of the gradients of the rows, to which that share belongs.
    pub squares: Vec<f64>,
    /// Share of the magnitudes that a pivot is made of below which elimination has lost its digits.
    pub least_kept: f64,
}

/// A row with the size of its gradient along the bodies' coordinates.
type Named = (usize, f64);

impl JointForm {
    /// The programs of the regular engine; `None` where the rank-safe engine solves throughout, or where forces depend on
    /// accelerations or reactions.
    #[must_use]
    pub fn portable(&self) -> Option<Portable> {
        let regular = self.regular.as_ref()?;
        if self.equations.dependence.is_some() {
            return None;
        }
        let sized: Vec<Named> = self.safe.rows.iter().copied().zip(self.row_sizes.iter().copied()).collect();
        let (used, others) = sized.iter().partition(|(row, _)| regular.rows.contains(row));
        let used: Vec<Named> = used;
        Some(Portable {
            coordinates: self.motion.coordinates.clone(),
            groups: self.motion.groups.clone(),
            length: self.motion.length,
            rows: regular.rows.clone(),
            others,
            sizes: used.iter().map(|(_, size)| *size).collect(),
            motion: regular.motion.program().clone(),
            position: regular.position.program().clone(),
            velocity: regular.velocity.program().clone(),
            least_independence: SICK_SHARE * self.first.independence,
            squares: regular.square_sizes().to_vec(),
            least_kept: ACCURATE,
        })
    }

    /// A program of nodes of the working form in the inputs of this form; `None` where they depend on what these do not tell.
    #[must_use]
    pub fn quantities(&self, equations: &Equations, nodes: &[Node]) -> Option<Quantities> {
        if let Some((graph, nodes)) = self.carry(equations, nodes) {
            return Some(Quantities { program: Program::compile(&graph, &nodes), solved: false });
        }
        let mass = mass_entries(self.bodies.masses());
        let working = Working { equations, layout: &self.motion.layout, mass: &mass };
        let found = self.equations.reactions(&working, &self.tree, self.motion.length, nodes, &[])?;
        Some(Quantities { program: Program::compile(&found.graph, &found.nodes), solved: true })
    }
}
