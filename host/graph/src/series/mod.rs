//! [`Series`]: what nodes of a graph are as power series of time, in [`DoubleDouble`]s.
//!
//! The coefficients of all nodes are computed order by order (Griewank & Walther, "Evaluating Derivatives", 2008, ch. 13), so that
//! those of inputs may follow from those of outputs one order below: the solution of a differential equation grows term by term.
//! Order 0 alone is the plain value with about 30 digits.

mod recurrences;
mod write;

use odyn_numerics::precise::DoubleDouble;

use super::graph::{Graph, Node};
use element_api::Table;
use recurrences::Coefficients;

/// A node, by its number in the list of coefficients.
type Place = usize;

/// How the coefficients of a place follow from those of places before it. Operations that need a second series beside their
/// result have it at the next place.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Operation {
    Add(Place, Place),
    Sub(Place, Place),
    Mul(Place, Place),
    /// The first times a constant.
    Scale(Place, Place),
    Div(Place, Place),
    Neg(Place),
    Sqrt(Place),
    /// The sine; the cosine follows.
    SinCos(Place),
    Exp(Place),
    Ln(Place),
    /// The hyperbolic tangent t; 1 - t^2 follows.
    Tanh(Place),
    /// The angle; the square of the distance follows.
    Atan2(Place, Place),
    Powf(Place, f64),
    /// See [`super::Expr::Select`]; the number is that of the choice.
    Select([Place; 4], usize),
    /// A derivative of some order of a table; the number is that of the piece. The distance from the left end of the piece and two
    /// partial sums follow.
    Table {
        at: Place,
        table: usize,
        order: u32,
        piece: usize,
    },
}

/// The piece of a table that was chosen where order 0 was computed last.
#[derive(Debug, Clone, Copy, Default)]
struct Piece {
    /// Coefficients in powers of the distance from its left end.
    powers: [DoubleDouble; 4],
    /// What is taken from the argument, to have that distance.
    origin: DoubleDouble,
    /// From where to where the distance runs.
    range: [f64; 2],
}

/// See the module documentation.
#[derive(Debug, Clone)]
pub struct Series {
    steps: Vec<(Place, Operation)>,
    /// Input slot and place.
    inputs: Vec<(usize, Place)>,
    outputs: Vec<Place>,
    tables: Vec<Table>,
    coefficients: Coefficients,
    /// Whether the first of two numbers was the smaller one where order 0 was computed last.
    choices: Vec<bool>,
    pieces: Vec<Piece>,
}

impl Series {
    /// Of `nodes`, up to an order; `None` where they depend on what an opaque element computes.
    #[must_use]
    pub fn new(graph: &Graph, nodes: &[Node], order: usize) -> Option<Self> {
        write::write(graph, nodes, order)
    }

    /// Number of operations.
    #[must_use]
    pub fn operations(&self) -> usize {
        self.steps.len()
    }

    /// Whether any output depends on an input in the given range of slots.
    #[must_use]
    pub fn uses_inputs(&self, slots: std::ops::Range<usize>) -> bool {
        self.inputs.iter().any(|(slot, _)| slots.contains(slot))
    }

    /// Computes the coefficients of an order, those below being known; `inputs` are the ones of this order. `[hot, no allocation]`
    pub fn run(&mut self, order: usize, inputs: &[DoubleDouble]) {
        for (slot, place) in &self.inputs {
            self.coefficients.set(*place, order, inputs[*slot]);
        }
        for number in 0..self.steps.len() {
            let (place, operation) = self.steps[number];
            self.step(place, operation, order);
        }
    }

    /// A coefficient of an output that was computed.
    #[must_use]
    pub fn output(&self, number: usize, order: usize) -> DoubleDouble {
        self.coefficients.get(self.outputs[number], order)
    }

    /// The coefficients of order 0 of all outputs: their values.
    pub fn values(&self) -> impl Iterator<Item = DoubleDouble> + '_ {
        self.outputs.iter().map(|place| self.coefficients.get(*place, 0))
    }

    /// Tells the conditions that the series hold under, up to an order: the coefficients of a function, and whether it is positive.
    /// Where that changes, another choice is made or another piece of a table begins.
    pub fn conditions(&self, order: usize, mut told: impl FnMut(&[DoubleDouble], bool)) {
        let of = |place: Place| &self.coefficients.of(place)[..=order];
        let mut function = vec![DoubleDouble::ZERO; order + 1];
        for (place, operation) in &self.steps {
            match *operation {
                Operation::Select([a, b, ..], choice) => {
                    function.iter_mut().zip(of(b).iter().zip(of(a))).for_each(|(c, (b, a))| *c = *b - *a);
                    told(&function, self.choices[choice]);
                }
                Operation::Table { piece, .. } => {
                    let [low, high] = self.pieces[piece].range;
                    for (end, sign, inside) in [(low, -1.0, false), (high, -1.0, true)] {
                        if !end.is_finite() {
                            continue;
                        }
                        let sign = DoubleDouble::from(sign);
                        function.iter_mut().zip(of(place + 1)).for_each(|(c, s)| *c = sign * *s);
                        function[0] += DoubleDouble::from(end);
                        told(&function, inside);
                    }
                }
                _ => {}
            }
        }
    }
}
