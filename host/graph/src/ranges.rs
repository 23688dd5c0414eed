//! [`Ranges`]: what nodes of the graph can be while their inputs run through ranges.
//!
//! Interval arithmetic, operation by operation, for the value of a node and for its slope along the stretch that the inputs run
//! through (Moore, Kearfott & Cloud, "Introduction to Interval Analysis", 2009, chapters 5 and 6). The slope is what makes it
//! sharp: with the value in the middle of the stretch it bounds the others, of every node (mean value form); with those at the ends
//! it does the same for what is asked for, and where it has one sign, values lie between those at the ends.

use std::cmp::Ordering;

use element_api::Table;
use element_api::table::Outside;
use odyn_numerics::interval::{Interval, Range};

use super::graph::{Expr, Graph, Node};
use super::tape::{Program, Workspace};

/// See the module documentation.
#[derive(Debug, Clone)]
pub struct Ranges {
    exprs: Vec<Expr>,
    /// What the operations become that are constants.
    ranges: Vec<Range>,
    /// For each operation the outputs that depend on it, see [`bit`].
    needed_by: Vec<u64>,
    tables: Vec<Table>,
    outputs: Vec<usize>,
    inputs: Vec<usize>,
    /// The same nodes at a point; `None` where opaque elements take part, of which nothing is known.
    points: Option<Points>,
}

#[derive(Debug, Clone)]
struct Points {
    program: Program,
    workspace: Workspace,
    /// By slot.
    inputs: Vec<f64>,
    outputs: Vec<f64>,
}

impl Points {
    fn new(graph: &Graph, nodes: &[Node], inputs: &[usize]) -> Option<Self> {
        let program = Program::compile(graph, nodes);
        let size = inputs.last().map_or(0, |last| last + 1);
        let known = program.calls() == 0;
        known.then(|| Self {
            workspace: program.workspace(),
            program,
            inputs: vec![0.0; size],
            outputs: vec![f64::NAN; nodes.len()],
        })
    }
}

/// The bit of an output in [`Ranges::needed_by`]: beyond 64 of them several have one in common.
fn bit(output: usize) -> u64 {
    1 << (output % u64::BITS as usize)
}

impl Ranges {
    /// Prepares the ranges of nodes. Results of opaque elements are unknown.
    #[must_use]
    pub fn new(graph: &Graph, nodes: &[Node]) -> Self {
        let live = graph.live(nodes);
        let place = |node: Node| live.binary_search(&node).unwrap_or_default();
        let mut exprs: Vec<Expr> =
            live.iter().map(|node| graph.expr(*node).with_operands(|operand| Node(place(operand) as u32))).collect();
        let mut inputs: Vec<usize> = exprs
            .iter()
            .filter_map(|expr| match expr {
                Expr::Input(slot) => Some(*slot as usize),
                _ => None,
            })
            .collect();
        inputs.sort_unstable();
        inputs.dedup();
        for expr in &mut exprs {
            if let Expr::Input(slot) = expr {
                *slot = inputs.binary_search(&(*slot as usize)).unwrap_or_default() as u32;
            }
        }
        let ranges = exprs.iter().map(|expr| match expr {
            Expr::Constant(bits) => Range::still(f64::from_bits(*bits)),
            _ => Range::UNKNOWN,
        });
        let mut needed_by = vec![0; live.len()];
        nodes.iter().enumerate().for_each(|(k, node)| needed_by[place(*node)] |= bit(k));
        for k in (0..live.len()).rev() {
            let by = needed_by[k];
            graph.operands(live[k], |operand| needed_by[place(operand)] |= by);
        }
        Self {
            ranges: ranges.collect(),
            needed_by,
            outputs: nodes.iter().map(|node| place(*node)).collect(),
            tables: graph.tables.clone(),
            points: Points::new(graph, nodes, &inputs),
            exprs,
            inputs,
        }
    }

    /// The slots of all inputs in use, ascending.
    #[must_use]
    pub fn inputs(&self) -> &[usize] {
        &self.inputs
    }

    /// The ranges of the nodes that are wanted, by their order; `input` gives those of the inputs, by place in [`Ranges::inputs`]. The
    /// other ones are left as they are in `found`, and what only they need is not evaluated. `[hot, no allocation]`
    pub fn evaluate(&mut self, input: impl Fn(usize) -> Range, wanted: impl Fn(usize) -> bool, found: &mut [Range]) {
        let all = self.outputs.len();
        let by = (0..all).filter(|k| wanted(*k)).fold(0, |by, k| by | bit(k));
        for k in 0..self.exprs.len() {
            if self.needed_by[k] & by == 0 {
                continue;
            }
            let made = match self.exprs[k] {
                Expr::Constant(_) => continue,
                Expr::Input(place) => input(place as usize),
                expr => self.one(expr),
            };
            self.ranges[k] = made;
        }
        for k in (0..all).filter(|k| wanted(*k)) {
            found[k] = self.ranges[self.outputs[k]];
        }
    }

    /// The values of the nodes, in their order, at a point: no-number where nothing is known of them. `[hot, no allocation]`
    pub fn values(&mut self, input: impl Fn(usize) -> f64, found: &mut [f64]) {
        found.fill(f64::NAN);
        let Some(Points { program, workspace, inputs, outputs }) = &mut self.points else { return };
        for (place, slot) in self.inputs.iter().enumerate() {
            inputs[*slot] = input(place);
        }
        if program.run(inputs, &[], workspace, outputs).is_ok() {
            found.copy_from_slice(outputs);
        }
    }

    fn one(&self, expr: Expr) -> Range {
        let at = |node: Node| self.ranges[node.0 as usize];
        // A function of one number, its derivative, and its value in the middle.
        let chain =
            |a: Range, value: Interval, slope: Interval, middle: f64| Range::new(value, slope * a.slope, middle);
        let one = Interval::point(1.0);
        match expr {
            Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } => Range::UNKNOWN,
            Expr::Add(a, b) => {
                let (a, b) = (at(a), at(b));
                Range::new(a.value + b.value, a.slope + b.slope, a.middle + b.middle)
            }
            Expr::Sub(a, b) => {
                let (a, b) = (at(a), at(b));
                Range::new(a.value - b.value, a.slope - b.slope, a.middle - b.middle)
            }
            Expr::Mul(a, b) if a == b => {
                let a = at(a);
                chain(a, a.value.square(), a.value.scaled(2.0), a.middle * a.middle)
            }
            Expr::Mul(a, b) => {
                let (a, b) = (at(a), at(b));
                Range::new(a.value * b.value, a.slope * b.value + a.value * b.slope, a.middle * b.middle)
            }
            Expr::Div(a, b) => {
                let (a, b) = (at(a), at(b));
                let middle = a.middle / b.middle;
                let value = Range::new(a.value / b.value, Interval::ALL, middle).value;
                Range::new(value, (a.slope - value * b.slope) / b.value, middle)
            }
            Expr::Neg(a) => {
                let a = at(a);
                Range { value: -a.value, slope: -a.slope, middle: -a.middle }
            }
            Expr::Sqrt(a) => {
                let a = at(a);
                let value = a.value.sqrt();
                chain(a, value, Interval::point(0.5) / value, a.middle.sqrt())
            }
            Expr::Sin(a) => {
                let a = at(a);
                chain(a, a.value.sin(), a.value.cos(), a.middle.sin())
            }
            Expr::Cos(a) => {
                let a = at(a);
                chain(a, a.value.cos(), -a.value.sin(), a.middle.cos())
            }
            Expr::Atan2(y, x) => {
                let (y, x) = (at(y), at(x));
                let square = x.value.square() + y.value.square();
                let cut = x.value.low <= 0.0 && y.value.contains(0.0);
                let slope = (x.value * y.slope - y.value * x.slope) / square;
                let slope = if cut { Interval::ALL } else { slope };
                Range::new(y.value.atan2(x.value), slope, y.middle.atan2(x.middle))
            }
            Expr::Exp(a) => {
                let a = at(a);
                let value = a.value.rising(f64::exp);
                chain(a, value, value, a.middle.exp())
            }
            Expr::Ln(a) => {
                let a = at(a);
                chain(a, a.value.ln(), one / a.value, a.middle.ln())
            }
            Expr::Tanh(a) => {
                let a = at(a);
                let value = a.value.rising(f64::tanh);
                chain(a, value, one - value.square(), a.middle.tanh())
            }
            Expr::Powi(a, n) => {
                let a = at(a);
                chain(a, a.value.powi(n), a.value.powi(n - 1).scaled(f64::from(n)), a.middle.powi(n))
            }
            Expr::Powf(a, bits) => {
                let (a, exponent) = (at(a), f64::from_bits(bits));
                let slope = a.value.powf(exponent - 1.0).scaled(exponent);
                chain(a, a.value.powf(exponent), slope, a.middle.powf(exponent))
            }
            Expr::Select(a, b, c, d) => self.select(a, b, c, d),
            Expr::Table { table, order, at: a } => {
                let a = at(a);
                let table = &self.tables[table as usize];
                let (value, slope) = table_range(table, order, a.value);
                chain(a, value, slope, table.derivative(a.middle, order))
            }
        }
    }

    fn select(&self, a: Node, b: Node, c: Node, d: Node) -> Range {
        let at = |node: Node| self.ranges[node.0 as usize];
        let (left, right) = (at(a).value, at(b).value);
        if left.high < right.low {
            return at(c);
        }
        if left.low >= right.high {
            return at(d);
        }
        let negative =
            |x: Node, y: Node| self.exprs[x.0 as usize] == Expr::Neg(y) || self.exprs[y.0 as usize] == Expr::Neg(x);
        let zero = |x: Node| self.exprs[x.0 as usize] == Expr::Constant(0);
        // Minima, maxima and magnitudes do not jump where they switch.
        let meets = ((c == a && d == b) || (c == b && d == a))
            || (zero(b) && (c == a || d == a) && negative(c, d))
            || (zero(a) && (c == b || d == b) && negative(c, d));
        let middle = match at(a).middle.partial_cmp(&at(b).middle) {
            Some(Ordering::Less) => at(c).middle,
            Some(_) => at(d).middle,
            None => f64::NAN,
        };
        let (c, d) = (at(c), at(d));
        let slope = if meets { c.slope.hull(d.slope) } else { Interval::ALL };
        Range::new(c.value.hull(d.value), slope, middle)
    }
}

/// Value and slope of a derivative of a table while its argument runs through a range.
fn table_range(table: &Table, order: u32, x: Interval) -> (Interval, Interval) {
    let (Some(&first), Some(&last)) = (table.breaks.first(), table.breaks.last()) else {
        return (Interval::ZERO, Interval::ZERO);
    };
    if order > 3 || table.pieces.is_empty() {
        return (Interval::ZERO, Interval::ZERO);
    }
    let mut gathered = Gathered { table, order, found: None };
    match table.outside {
        Outside::Periodic => {
            let period = last - first;
            if x.width().is_nan() || x.width() >= period {
                gathered.over(first, last);
                gathered.meet(last, first);
            } else {
                let from = x.low - ((x.low - first) / period).floor() * period;
                let to = from + x.width();
                gathered.over(from, to.min(last));
                if to > last {
                    gathered.over(first, first + (to - last));
                    gathered.meet(last, first);
                }
            }
        }
        Outside::Clamped => {
            let outside = |end: f64| if order == 0 { table.derivative(end, 0) } else { 0.0 };
            if x.low < first {
                gathered.take(Interval::point(outside(first)), Interval::ZERO);
            }
            if x.high > last {
                gathered.take(Interval::point(outside(last)), Interval::ZERO);
            }
            if x.high >= first && x.low <= last {
                gathered.over(x.low.max(first), x.high.min(last));
            }
            if order > 0 && ((x.low < first && x.high >= first) || (x.low <= last && x.high > last)) {
                gathered.jump();
            }
        }
    }
    gathered.found.unwrap_or((Interval::ALL, Interval::ALL))
}

/// The values and slopes of some pieces of a table.
struct Gathered<'t> {
    table: &'t Table,
    order: u32,
    found: Option<(Interval, Interval)>,
}

impl Gathered<'_> {
    fn take(&mut self, value: Interval, slope: Interval) {
        let (v, s) = self.found.unwrap_or((value, slope));
        self.found = Some((v.hull(value), s.hull(slope)));
    }

    /// The value jumps on the way.
    fn jump(&mut self) {
        let (value, _) = self.found.unwrap_or((Interval::ALL, Interval::ALL));
        self.found = Some((value, Interval::ALL));
    }

    /// Notes a jump from the end of the last piece before `from` to the start of the piece at `to`.
    fn meet(&mut self, from: f64, to: f64) {
        let piece = |x: f64, left: bool| {
            let behind = if left {
                self.table.breaks.partition_point(|b| *b < x)
            } else {
                self.table.breaks.partition_point(|b| *b <= x)
            };
            behind.clamp(1, self.table.pieces.len()) - 1
        };
        let (a, b) = (piece(from, true), piece(to, false));
        let value = |k: usize, x: f64| taylor(&self.table.pieces[k], x - self.table.breaks[k])[self.order as usize];
        let size = self.found.map_or(0.0, |(value, _)| value.magnitude());
        let (a, b) = (value(a, from), value(b, to));
        if (a - b).abs() > 1e-9 * size.max(a.abs()).max(b.abs()) {
            self.jump();
        }
    }

    /// The pieces between two arguments inside the range of the table.
    fn over(&mut self, from: f64, to: f64) {
        let breaks = &self.table.breaks;
        let first = breaks.partition_point(|b| *b <= from).clamp(1, self.table.pieces.len()) - 1;
        let mut jumps = Vec::new();
        for k in first..self.table.pieces.len() {
            if breaks[k] > to {
                break;
            }
            if k > first {
                jumps.push(breaks[k]);
            }
            let s = Interval::between(from.max(breaks[k]) - breaks[k], to.min(breaks[k + 1]) - breaks[k]);
            let c = self.table.pieces[k];
            self.take(cubic(derivative(&c, self.order), s), cubic(derivative(&c, self.order + 1), s));
        }
        jumps.into_iter().for_each(|at| self.meet(at, at));
    }
}

/// The value of a piece of a table and its derivatives, by order, at a place from its beginning.
#[must_use]
pub fn taylor([c0, c1, c2, c3]: &[f64; 4], s: f64) -> [f64; 4] {
    [c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + s * (3.0 * c3)), 2.0 * c2 + s * (6.0 * c3), 6.0 * c3]
}

/// Coefficients of a derivative of a cubic.
fn derivative(c: &[f64; 4], order: u32) -> [f64; 4] {
    let mut c = *c;
    for _ in 0..order {
        c = [c[1], 2.0 * c[2], 3.0 * c[3], 0.0];
    }
    c
}

/// The range of a cubic: its values at the ends and at the zeros of its derivative between them.
fn cubic(c: [f64; 4], s: Interval) -> Interval {
    let value = |s: f64| c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    let mut range = Interval::between(value(s.low), value(s.high));
    let mut see = |at: f64| {
        if s.contains(at) {
            range = range.hull(Interval::point(value(at)));
        }
    };
    let (a, b, d) = (3.0 * c[3], c[2], c[1]);
    let root = b * b - a * d;
    if root >= 0.0 {
        // Zeros of a s^2 + 2 b s + d, without cancellation.
        let q = -(b + root.sqrt().copysign(b));
        if a != 0.0 {
            see(q / a);
        }
        if q != 0.0 {
            see(d / q);
        }
    }
    range
}
