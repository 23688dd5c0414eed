//! From nodes of a graph to the steps of a [`Series`].

use odyn_numerics::precise::DoubleDouble;
use rustc_hash::FxHashMap;

use super::recurrences::Coefficients;
use super::{Operation, Piece, Place, Series};
use crate::graph::{Expr, Graph, Node};

/// Whole powers up to this one are products.
const MOST_FACTORS: f64 = 64.0;

/// See [`Series::new`].
pub(super) fn write(graph: &Graph, nodes: &[Node], order: usize) -> Option<Series> {
    let mut writer = Writer::new(graph);
    for node in graph.live(nodes) {
        writer.node(node)?;
    }
    let mut coefficients = Coefficients::new(writer.places, order);
    for (place, value) in &writer.constants {
        coefficients.set(*place, 0, DoubleDouble::from(*value));
    }
    Some(Series {
        steps: writer.steps,
        inputs: writer.inputs,
        outputs: nodes.iter().map(|node| writer.place_of[node]).collect(),
        tables: graph.tables.clone(),
        coefficients,
        choices: vec![false; writer.choices],
        pieces: vec![Piece::default(); writer.pieces],
    })
}

struct Writer<'g> {
    graph: &'g Graph,
    places: usize,
    place_of: FxHashMap<Node, Place>,
    /// Places of sine and cosine by their angle.
    turns: FxHashMap<Node, Place>,
    steps: Vec<(Place, Operation)>,
    inputs: Vec<(usize, Place)>,
    constants: Vec<(Place, f64)>,
    choices: usize,
    pieces: usize,
}

impl<'g> Writer<'g> {
    fn new(graph: &'g Graph) -> Self {
        Self {
            graph,
            places: 0,
            place_of: FxHashMap::default(),
            turns: FxHashMap::default(),
            steps: Vec::new(),
            inputs: Vec::new(),
            constants: Vec::new(),
            choices: 0,
            pieces: 0,
        }
    }

    fn take(&mut self, count: usize) -> Place {
        self.places += count;
        self.places - count
    }

    /// A place for the result of an operation, and for so many series beside it.
    fn push(&mut self, operation: Operation, beside: usize) -> Place {
        let place = self.take(1 + beside);
        self.steps.push((place, operation));
        place
    }

    fn constant(&mut self, value: f64) -> Place {
        let place = self.take(1);
        self.constants.push((place, value));
        place
    }

    /// `None` for a result of an opaque element.
    fn node(&mut self, node: Node) -> Option<()> {
        let at = |node: Node| self.place_of[&node];
        let is_constant = |node: Node| self.graph.value(node).is_some();
        let place = match self.graph.expr(node) {
            Expr::Call { .. } => return None,
            Expr::Constant(bits) => self.constant(f64::from_bits(bits)),
            Expr::Input(slot) => {
                let place = self.take(1);
                self.inputs.push((slot as usize, place));
                place
            }
            Expr::Sin(a) => self.turn(a),
            Expr::Cos(a) => self.turn(a) + 1,
            Expr::Powi(a, n) => self.power(self.place_of[&a], n),
            Expr::Add(a, b) => self.push(Operation::Add(at(a), at(b)), 0),
            Expr::Sub(a, b) => self.push(Operation::Sub(at(a), at(b)), 0),
            Expr::Mul(a, b) if is_constant(b) => self.push(Operation::Scale(at(a), at(b)), 0),
            Expr::Mul(a, b) if is_constant(a) => self.push(Operation::Scale(at(b), at(a)), 0),
            Expr::Mul(a, b) => self.push(Operation::Mul(at(a), at(b)), 0),
            Expr::Div(a, b) => self.push(Operation::Div(at(a), at(b)), 0),
            Expr::Neg(a) => self.push(Operation::Neg(at(a)), 0),
            Expr::Sqrt(a) => self.push(Operation::Sqrt(at(a)), 0),
            Expr::Exp(a) => self.push(Operation::Exp(at(a)), 0),
            Expr::Ln(a) => self.push(Operation::Ln(at(a)), 0),
            Expr::Tanh(a) => self.push(Operation::Tanh(at(a)), 1),
            Expr::Atan2(a, b) => self.push(Operation::Atan2(at(a), at(b)), 1),
            Expr::Powf(a, bits) => {
                let p = f64::from_bits(bits);
                match p as i32 {
                    n if f64::from(n) == p && p.abs() <= MOST_FACTORS => self.power(at(a), n),
                    _ => self.push(Operation::Powf(at(a), p), 0),
                }
            }
            Expr::Select(a, b, c, d) => {
                let places = [a, b, c, d].map(at);
                self.choices += 1;
                self.push(Operation::Select(places, self.choices - 1), 0)
            }
            Expr::Table { table, order, at: argument } => {
                let argument = at(argument);
                self.pieces += 1;
                let piece = self.pieces - 1;
                self.push(Operation::Table { at: argument, table: table as usize, order, piece }, 3)
            }
        };
        self.place_of.insert(node, place);
        Some(())
    }

    /// The place of the sine of an angle; the cosine follows.
    fn turn(&mut self, angle: Node) -> Place {
        if let Some(known) = self.turns.get(&angle) {
            return *known;
        }
        let place = self.push(Operation::SinCos(self.place_of[&angle]), 1);
        self.turns.insert(angle, place);
        place
    }

    /// A whole power by products, which are exact series wherever the base is zero, too.
    fn power(&mut self, base: Place, n: i32) -> Place {
        let (mut left, mut square, mut found) = (n.unsigned_abs(), base, None);
        while left > 0 {
            if left % 2 == 1 {
                found = Some(match found {
                    Some(found) => self.push(Operation::Mul(found, square), 0),
                    None => square,
                });
            }
            left /= 2;
            if left > 0 {
                square = self.push(Operation::Mul(square, square), 0);
            }
        }
        let one = (found.is_none() || n < 0).then(|| self.constant(1.0));
        match (found, one) {
            (Some(found), Some(one)) => self.push(Operation::Div(one, found), 0),
            (found, one) => found.or(one).unwrap_or(base),
        }
    }
}
