//! [`Planar`]: the equations of a scene that is proved to move parallel to a plane of the ground.
//!
//! Let `n` be an axis of the ground. Coordinates along the plane are r_a, r_b and the rotation about n; coordinates across it
//! are r_n and the other two rotations. With the coordinates across held at their values at the start and their rates at
//! zero, every equation becomes a function of those along the plane alone. The proof looks at what is then left of them,
//! after constant folding:
//!
//! 1. A constraint row whose value is a number (zero) acts across the plane only: all its derivatives along the plane
//!    vanish, those with respect to time too. Every other row must have no derivative across the plane.
//! 2. Loads across the plane, gyroscopic ones included, are the number zero. No inertia couples the two.
//! 3. Positions and velocities of the start are in the plane.
//!
//! Then zero accelerations across, with zero multipliers of the rows that act across, solve the equations of motion at every
//! position in the plane; and accelerations are unique. So the motion stays there (mirror symmetry, without looking for it),
//! and the rows that act across bear nothing.

use odyn_graph::{Expr, Graph, Node};
use rustc_hash::FxHashMap;

use super::equations::{Equations, Form, Row};
use super::kinematics::BodyNodes;
use crate::model::Model;
use crate::plan::Layout;

/// Positions and velocities across the plane below this share of the scene's are round-off.
const ROUND_OFF: f64 = 1e-13;

/// Equations in which everything across a plane is a constant.
pub struct Planar {
    /// The axis of the ground across the plane: 0, 1, 2.
    pub normal: usize,
    /// The equations; rows that act across the plane have a value of zero and no derivatives.
    pub equations: Equations,
    /// Rows that act along the plane, ascending.
    pub rows: Vec<usize>,
    /// Entries of the working state (13 per body) that stay what they are: all across the plane.
    pub still: Vec<usize>,
    /// The start with positions and velocities exactly in the plane: round-off removed.
    pub start: Vec<f64>,
}

/// Why a scene is not known to move parallel to a plane.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotPlanar {
    /// The reason for each plane, in words.
    pub why: String,
}

impl Planar {
    /// Looks for a plane of the ground (x-y first, then y-z, z-x) to which the motion is parallel. `start` is the assembled
    /// working state (per body r, p, v, omega'; further entries are not looked at), `length` the size of the scene, m.
    ///
    /// # Errors
    /// Why there is none that can be proved.
    pub fn find(
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        start: &[f64],
        length: f64,
    ) -> Result<Self, NotPlanar> {
        if equations.form != Form::Working || !equations.graph.calls.is_empty() {
            return Err(NotPlanar { why: "equations of opaque elements are not known".into() });
        }
        let mut reasons = Vec::new();
        for normal in [2, 0, 1] {
            match Self::across(normal, equations, model, layout, start, length) {
                Ok(found) => return Ok(found),
                Err(reason) => reasons.push(format!("{}: {reason}", plane(normal))),
            }
        }
        Err(NotPlanar { why: reasons.join("; ") })
    }

    /// The equations in the plane across an axis, or why there are none.
    fn across(
        normal: usize,
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        start: &[f64],
        length: f64,
    ) -> Result<Self, String> {
        let attitudes = in_plane_start(normal, model, layout, start, length)?;
        let mut start = start.to_vec();
        let mut still = Vec::new();
        let mut inputs: FxHashMap<usize, f64> = FxHashMap::default();
        for (body, attitude) in attitudes.iter().enumerate() {
            let list = across_entries(normal, *attitude);
            for k in list {
                let at = 13 * body + k;
                if k > 2 {
                    start[at] = 0.0;
                }
                still.push(at);
                inputs.insert(layout.body_slot(body, k), start[at]);
            }
            for k in across_coordinates(normal) {
                inputs.insert(layout.acceleration_slot() + 6 * body + k, 0.0);
            }
        }
        let mut given: FxHashMap<Node, f64> = FxHashMap::default();
        for (body, attitude) in equations.bodies.iter().zip(&attitudes) {
            // A rotation about n leaves n where it is: p.p / p.p is not folded by itself.
            given.insert(body.a[normal][normal], attitude.sign());
        }
        // Which rows act across the plane; their multipliers are zero.
        let values: Vec<Node> = equations.rows.iter().map(|row| row.value).collect();
        let (graph, known) = substituted(&equations.graph, &values, &inputs, &given);
        let mut rows = Vec::new();
        for (row, value) in values.iter().enumerate() {
            match graph.value(known[value]) {
                None => rows.push(row),
                Some(value) if value.abs() <= ROUND_OFF * length.max(1.0) => {
                    inputs.insert(layout.multiplier_slot() + row, 0.0);
                }
                Some(_) => return Err(format!("`{}` does not hold", row_name(model, layout, row))),
            }
        }
        let mut nodes = equations.clone();
        let mut roots = Vec::new();
        visit(&mut nodes, &mut |node| roots.push(*node));
        let (graph, known) = substituted(&equations.graph, &roots, &inputs, &given);
        visit(&mut nodes, &mut |node| *node = known[node]);
        nodes.graph = graph;
        nodes.coupling.retain(|input| !inputs.contains_key(&input.slot));
        let mut found = Self { normal, equations: nodes, rows, still, start };
        found.check(model, layout)?;
        found.drop_across();
        Ok(found)
    }

    /// Points 1 and 2 of the proof, on the equations left.
    fn check(&self, model: &Model, layout: &Layout) -> Result<(), String> {
        let Self { normal, equations, .. } = self;
        let across = |k: usize| across_coordinates(*normal).contains(&(k % 6));
        for row in &self.rows {
            let entries = &equations.rows[*row].jacobian;
            if entries.iter().any(|(column, slope)| across(*column) && !equations.graph.is_zero(*slope)) {
                let name = row_name(model, layout, *row);
                return Err(format!("`{name}` holds along and across it"));
            }
        }
        for (k, load) in equations.loads.iter().enumerate() {
            if across(k) && !equations.graph.is_zero(*load) {
                let what = if k % 6 < 3 { "force" } else { "torque" };
                let body = &model.bodies[k / 6].name;
                return Err(format!("a {what} on `{body}` may act across it"));
            }
        }
        Ok(())
    }

    /// Drops what is zero: derivatives across the plane, and those of rows that act across.
    fn drop_across(&mut self) {
        let zero = self.equations.graph.constant(0.0);
        for row in 0..self.equations.rows.len() {
            let is_along = self.rows.binary_search(&row).is_ok();
            let own = &mut self.equations.rows[row];
            if is_along {
                let graph = &self.equations.graph;
                own.jacobian.retain(|(_, slope)| !graph.is_zero(*slope));
            } else {
                *own = Row { value: zero, time: zero, gamma: zero, jacobian: Vec::new() };
            }
        }
    }

    /// Whether a working state lies in the plane but for round-off, `length` being the size of the scene, m.
    #[must_use]
    pub fn contains(&self, working: &[f64], length: f64) -> bool {
        self.still.iter().all(|at| (working[*at] - self.start[*at]).abs() <= ROUND_OFF * length.max(1.0))
    }

    /// The plane, in words: `x-y`.
    #[must_use]
    pub fn plane(&self) -> &'static str {
        plane(self.normal)
    }
}

fn plane(normal: usize) -> &'static str {
    ["y-z", "z-x", "x-y"][normal]
}

/// How a body lies at the start: which Euler parameters can differ from zero when it turns about n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Attitude {
    /// Turned about n: e0 and e_n.
    Along,
    /// Turned over, by half a turn about an axis in the plane: the other two.
    Over,
}

impl Attitude {
    /// Which way the body's own axis n points.
    fn sign(self) -> f64 {
        match self {
            Self::Along => 1.0,
            Self::Over => -1.0,
        }
    }
}

/// Coordinates of a body (dr, dpi') across the plane. A body that is turned over has its own axis n along n all the same.
fn across_coordinates(normal: usize) -> [usize; 3] {
    [normal, 3 + (normal + 1) % 3, 3 + (normal + 2) % 3]
}

/// Entries of a body's working state across the plane: r_n, two Euler parameters, v_n, two of omega'.
fn across_entries(normal: usize, attitude: Attitude) -> [usize; 6] {
    let (a, b) = ((normal + 1) % 3, (normal + 2) % 3);
    let [p, q] = match attitude {
        Attitude::Along => [4 + a, 4 + b],
        Attitude::Over => [3, 4 + normal],
    };
    [normal, p, q, 7 + normal, 10 + a, 10 + b]
}

/// Point 3 of the proof, and inertias.
fn in_plane_start(
    normal: usize,
    model: &Model,
    layout: &Layout,
    start: &[f64],
    length: f64,
) -> Result<Vec<Attitude>, String> {
    let bodies = || (0..layout.bodies).map(|body| &start[13 * body..13 * (body + 1)]);
    let largest = |from: usize| bodies().flat_map(|y| &y[from..from + 3]).fold(0.0_f64, |m, x| m.max(x.abs()));
    let (speed, spin) = (largest(7), largest(10));
    let (speed, spin) = (speed.max(spin * length), spin.max(speed / length));
    let (a, b) = ((normal + 1) % 3, (normal + 2) % 3);
    let mut attitudes = Vec::with_capacity(layout.bodies);
    for (y, body) in bodies().zip(&model.bodies) {
        let name = &body.name;
        let small = |k: usize| y[k].abs() <= ROUND_OFF;
        attitudes.push(if small(4 + a) && small(4 + b) {
            Attitude::Along
        } else if small(3) && small(4 + normal) {
            Attitude::Over
        } else {
            return Err(format!("`{name}` is turned out of it at the start"));
        });
        let fast = y[7 + normal].abs() > ROUND_OFF * speed;
        if fast || y[10 + a].abs().max(y[10 + b].abs()) > ROUND_OFF * spin {
            return Err(format!("`{name}` moves out of it at the start"));
        }
        let product = body.inertia[(normal, a)].abs().max(body.inertia[(normal, b)].abs());
        if product > f64::EPSILON * body.inertia.trace() {
            return Err(format!("`{name}` has products of inertia with its normal"));
        }
    }
    Ok(attitudes)
}

fn row_name(model: &Model, layout: &Layout, row: usize) -> String {
    let (element, k) = layout.element_of_row(row);
    model.elements[element].row_name(k)
}

/// Shows every node that the equations name, once or more often.
fn visit(equations: &mut Equations, told: &mut impl FnMut(&mut Node)) {
    let Equations {
        bodies,
        rows,
        loads,
        state_rates,
        angles,
        next_discrete,
        kinetic,
        potential,
        power,
        dissipation,
        supplied,
        elements,
        coupling,
        graph: _,
        form: _,
        // Of the reference form.
        mass_p: _,
    } = equations;
    for BodyNodes { r, p, a, v, w, p_rate } in bodies {
        r.iter_mut().chain(p).chain(a.as_flattened_mut()).chain(v).chain(w).chain(p_rate).for_each(&mut *told);
    }
    let coordinates = elements.iter_mut().flat_map(|element| &mut element.coordinates);
    for Row { value, time, gamma, jacobian } in rows.iter_mut().chain(coordinates) {
        [value, time, gamma].into_iter().for_each(&mut *told);
        jacobian.iter_mut().for_each(|(_, slope)| told(slope));
    }
    for element in elements {
        let loads = element.loads.iter_mut().flat_map(|load| load.force.iter_mut().chain(&mut load.torque));
        loads.chain(&mut element.channels).for_each(&mut *told);
    }
    loads.iter_mut().chain(state_rates).chain(angles).chain(next_discrete).for_each(&mut *told);
    [kinetic, potential, power].into_iter().for_each(&mut *told);
    coupling.iter_mut().flat_map(|input| &mut input.slopes).for_each(&mut *told);
    dissipation.iter_mut().chain(supplied).for_each(told);
}

/// A graph of what `roots` need, with some inputs and some nodes replaced by numbers, and where each node went.
fn substituted(
    old: &Graph,
    roots: &[Node],
    inputs: &FxHashMap<usize, f64>,
    given: &FxHashMap<Node, f64>,
) -> (Graph, FxHashMap<Node, Node>) {
    let mut graph = Graph::default();
    graph.tables.clone_from(&old.tables);
    let mut known: FxHashMap<Node, Node> = FxHashMap::default();
    for node in old.ancestors(roots, |node| given.contains_key(&node)) {
        let g = &mut graph;
        let at = |a: Node| known[&a];
        let made = match (given.get(&node), old.expr(node)) {
            (Some(value), _) => g.constant(*value),
            (None, Expr::Constant(bits)) => g.constant(f64::from_bits(bits)),
            (None, Expr::Input(slot)) => match inputs.get(&(slot as usize)) {
                Some(value) => g.constant(*value),
                None => g.input(slot as usize),
            },
            (None, Expr::Add(a, b)) => g.add(at(a), at(b)),
            (None, Expr::Sub(a, b)) => g.sub(at(a), at(b)),
            (None, Expr::Mul(a, b)) => g.mul(at(a), at(b)),
            (None, Expr::Div(a, b)) => g.div(at(a), at(b)),
            (None, Expr::Neg(a)) => g.neg(at(a)),
            (None, Expr::Sqrt(a)) => g.sqrt(at(a)),
            (None, Expr::Sin(a)) => g.sin(at(a)),
            (None, Expr::Cos(a)) => g.cos(at(a)),
            (None, Expr::Atan2(a, b)) => g.atan2(at(a), at(b)),
            (None, Expr::Exp(a)) => g.exp(at(a)),
            (None, Expr::Ln(a)) => g.ln(at(a)),
            (None, Expr::Tanh(a)) => g.tanh(at(a)),
            (None, Expr::Powi(a, n)) => g.powi(at(a), n),
            (None, Expr::Powf(a, bits)) => g.powf(at(a), f64::from_bits(bits)),
            (None, Expr::Select(a, b, c, d)) => g.select(at(a), at(b), at(c), at(d)),
            (None, Expr::Table { table, order, at: x }) => g.table(table, order, at(x)),
            (None, Expr::Call { call, result }) => g.call_result(call as usize, result as usize),
        };
        known.insert(node, made);
    }
    (graph, known)
}
