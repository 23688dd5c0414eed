//! [`Sharp`]: what may change on a stretch much shorter than a step, other than by a switch: functions of time, and functions
//! of the motion that rise and fall (pulses, barriers, measured curves), by themselves or by what is made of them.
//!
//! A method sees its functions at a few places of a step. What happens between them is bounded where it may be sharp; smooth
//! functions of the coordinates (sines, products, roots) are left to error control.

use std::collections::BTreeMap;

use element_api::Table;
use element_api::table::Outside;
use odyn_graph::{Expr, Graph, Node, taylor};
use rustc_hash::FxHashSet;

use super::equations::Equations;
use crate::plan::Layout;

/// See the module documentation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sharp {
    /// Functions of the motion with peaks, steps or curves of points in them; each depends on the state.
    pub of_motion: Vec<Node>,
    /// The largest parts of the equations that depend on nothing but time (and what stays as it is during a step).
    pub of_time: Vec<Node>,
    /// Tables of arguments that depend on nothing but time.
    pub knots: Vec<(Node, Knots)>,
    /// Tables of arguments that depend on the motion, with functions that change their sign where the table is not smooth.
    pub corners: Vec<(Node, Table)>,
    /// Both sides of the conditions that depend on nothing but time.
    pub conditions: Vec<(Node, Node)>,
}

/// The break points of a table at which it is not smooth.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// Where, strictly increasing.
    pub breaks: Vec<f64>,
    /// Where they repeat, if they do: the first argument of the table, and the period.
    pub repeats: Option<(f64, f64)>,
}

impl Knots {
    /// Of a table with these break points.
    fn of(table: &Table, breaks: Vec<f64>) -> Self {
        Self { breaks, repeats: table.breaks.first().copied().zip(table.period()) }
    }

    /// The knots next to `x`: the largest one that is not above it, the smallest one above it. Of those that repeat it is the first
    /// number that the table, whose argument is reduced to one period with round-off, takes to be at or behind the knot.
    #[must_use]
    pub fn around(&self, x: f64) -> (f64, f64) {
        let passed = self.passed(x);
        (self.at(passed - 1.0), self.at(passed))
    }

    /// How many knots are not above `x`, counted from the first one of the table. As the table itself reduces its argument.
    fn passed(&self, x: f64) -> f64 {
        let (turns, reduced) = match self.repeats {
            Some((first, period)) => {
                let turns = ((x - first) / period).floor();
                (turns, (x - turns * period).max(first))
            }
            None => (0.0, x),
        };
        turns * self.breaks.len() as f64 + self.breaks.partition_point(|b| *b <= reduced) as f64
    }

    /// Where the knot of this number is.
    fn at(&self, number: f64) -> f64 {
        let count = self.breaks.len() as f64;
        let turns = (number / count).floor();
        let place = self.breaks.get((number - turns * count) as usize).copied();
        match (place, self.repeats) {
            (Some(place), Some((_, period))) => self.first_behind(number, place + turns * period),
            (Some(place), None) if turns == 0.0 => place,
            _ if number < 0.0 => f64::NEG_INFINITY,
            _ => f64::INFINITY,
        }
    }

    /// Functions that change their sign at the knots, each at every other of them: what leads across two of them that are close
    /// together is seen by both.
    fn sides(&self) -> impl Iterator<Item = Table> + '_ {
        let every_other = |from: usize| self.breaks.iter().copied().skip(from).step_by(2).collect();
        [0, 1].into_iter().filter_map(move |from| alternating(every_other(from), self.repeats))
    }

    /// The smallest number that has passed a knot, from one that is as close as round-off lets it be.
    fn first_behind(&self, number: f64, near: f64) -> f64 {
        let mut at = near;
        for _ in 0..MOST_ULP {
            if self.passed(at) > number {
                break;
            }
            at = at.next_up();
        }
        for _ in 0..MOST_ULP {
            if self.passed(at.next_down()) <= number {
                break;
            }
            at = at.next_down();
        }
        at
    }
}

/// What the place of a knot may be off by, in neighbours.
const MOST_ULP: usize = 32;

/// What a node depends on, as far as it changes during a step.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Depends {
    Nothing,
    Time,
    Motion,
}

impl Sharp {
    /// Looks through everything that accelerations, rates of states and joints depend on. Tables that are as close to a smooth function
    /// as this share of their range are smooth.
    #[must_use]
    pub fn find(equations: &Equations, layout: &Layout, share: f64) -> Self {
        let graph = &equations.graph;
        let mut roots = equations.loads.clone();
        roots.extend(&equations.state_rates);
        roots.extend(equations.releases.iter().map(|one| one.value));
        roots.extend(equations.latch_conditions().flat_map(|(a, b)| [a, b]));
        roots.extend(equations.rows.iter().flat_map(|row| [row.value, row.time, row.gamma]));
        let live = graph.live(&roots);
        if !live.iter().any(|node| is_source(graph, *node)) {
            return Self::default();
        }
        let depends = dependence(graph, &live, layout);
        let of = |node: Node| depends[node.0 as usize];
        let stretches = stretches(graph, &live, of);
        let chosen = only_chosen(graph, &live, &roots);
        let mut found = Self::default();
        let mut parts: FxHashSet<Node> = FxHashSet::default();
        let mut known: FxHashSet<(Node, Node)> = FxHashSet::default();
        // With the orders of the derivatives that are used.
        let mut tables: BTreeMap<(Node, u32), Vec<u32>> = BTreeMap::new();
        for node in &live {
            let expr = graph.expr(*node);
            if let Expr::Table { table, at, order } = expr {
                tables.entry((at, table)).or_default().push(order);
            }
            match of(*node) {
                Depends::Motion => {
                    if stretches[node.0 as usize] == Stretch::Rises {
                        found.of_motion.push(*node);
                    }
                    graph.operands(*node, |operand| {
                        if of(operand) == Depends::Time {
                            parts.insert(operand);
                        }
                    });
                }
                Depends::Time => {
                    // A pulse may be small beside what it is added to.
                    if stretches[node.0 as usize] == Stretch::Rises
                        || is_pulse(graph, expr, of) && !chosen[node.0 as usize]
                    {
                        parts.insert(*node);
                    }
                    if let Expr::Select(a, b, ..) = expr
                        && (of(a) == Depends::Time || of(b) == Depends::Time)
                        && known.insert((a.min(b), a.max(b)))
                    {
                        found.conditions.push((a, b));
                    }
                }
                Depends::Nothing => {}
            }
        }
        // A function of two variables is made of many tables over each.
        let mut places: Vec<(Node, Knots)> = Vec::new();
        for ((at, table), orders) in tables {
            let table = &graph.tables[table as usize];
            let one = Knots::of(table, bends(table, &orders, share));
            let mut of_it = places.iter_mut().rev().take_while(|(known, _)| *known == at);
            match of_it.find(|(_, knots)| knots.repeats == one.repeats) {
                Some((_, knots)) => knots.breaks.extend(one.breaks),
                None => places.push((at, one)),
            }
        }
        for (at, mut knots) in places {
            knots.breaks.sort_by(f64::total_cmp);
            knots.breaks.dedup();
            match of(at) {
                Depends::Motion => found.corners.extend(knots.sides().map(|sides| (at, sides))),
                Depends::Time if !knots.breaks.is_empty() => found.knots.push((at, knots)),
                _ => {}
            }
        }
        parts.extend(roots.iter().filter(|root| of(**root) == Depends::Time));
        found.of_time = parts.into_iter().filter(|node| !matches!(graph.expr(*node), Expr::Input(_))).collect();
        found.of_time.sort_unstable();
        found
    }
}

/// The break points at which a table, of which derivatives of these orders are used, is not smooth enough for steps to lead across:
/// where value or slope jumps, and where curvature or third derivative do so that what is used is further from a smooth function than
/// a share of its range. The jump of a derivative of order r at one point is taken away by a change of J d^r times `ROUNDED`\[r\]
/// within d / 2 of it.
fn bends(table: &Table, orders: &[u32], share: f64) -> Vec<f64> {
    if !table.is_sound() {
        return Vec::new();
    }
    let highest = orders.iter().copied().fold(2, u32::max);
    let kinks: Vec<f64> = table.kinks().filter(|(_, order)| *order < highest).map(|(at, _)| at).collect();
    let widths: Vec<f64> = table.breaks.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let derivative = |piece: usize, s: f64, order: u32| taylor(&table.pieces[piece], s)[order as usize];
    let range = |order: u32| {
        let values = (0..widths.len()).flat_map(|k| [0.0, 0.5, 1.0].map(|part| derivative(k, part * widths[k], order)));
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), y| (y.min(low), y.max(high)));
        high - low
    };
    let ranges: Vec<(u32, f64)> = orders.iter().map(|order| (*order, range(*order))).collect();
    let count = widths.len();
    let bends = |k: usize| {
        let around = match (k, table.period()) {
            (0, Some(_)) => [Some(count - 1), Some(0)],
            _ => [k.checked_sub(1), (k < count).then_some(k)],
        };
        let width = around.iter().flatten().map(|piece| widths[*piece]).fold(f64::MAX, f64::min);
        let jump = |order: u32| {
            let [left, right] = around;
            let left = left.map_or(0.0, |piece| derivative(piece, widths[piece], order));
            (right.map_or(0.0, |piece| derivative(piece, 0.0, order)) - left).abs()
        };
        ranges.iter().any(|(used, range)| {
            ((*used).max(2)..=3).any(|order| {
                let more = order - used;
                jump(order) * width.powi(more as i32) * ROUNDED[more as usize] > share * range
            })
        })
    };
    let places = table.breaks.iter().enumerate().take(if table.period().is_some() { count } else { count + 1 });
    let is_kink = |at: &f64| kinks.binary_search_by(|kink| kink.total_cmp(at)).is_ok();
    places.filter(|(k, at)| is_kink(at) || bends(*k)).map(|(_, at)| *at).collect()
}

/// See [`bends`].
const ROUNDED: [f64; 4] = [1.0 / 2.0, 1.0 / 8.0, 1.0 / 64.0, 1.0 / 384.0];

/// A function that is negative and positive by turns between places, which may repeat, and zero there; `None` without such places.
/// Between them it is a parabola of height 1.
fn alternating(mut at: Vec<f64>, repeats: Option<(f64, f64)>) -> Option<Table> {
    let first = *at.first()?;
    let outside = if repeats.is_some() { Outside::Periodic } else { Outside::Clamped };
    match repeats {
        Some((_, period)) => {
            if at.len() % 2 == 1 {
                // An odd number of changes comes out even after two periods.
                at.extend(at.clone().iter().map(|x| x + period));
                at.push(first + 2.0 * period);
            } else {
                at.push(first + period);
            }
        }
        None => {
            let last = *at.last()?;
            let width = if last > first { last - first } else { first.abs().max(1.0) };
            at.insert(0, first - width);
            at.push(last + width);
        }
    }
    let pieces = at.windows(2).enumerate().map(|(k, pair)| {
        let width = pair[1] - pair[0];
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        // Beyond the outermost places of a table that holds its ends, a straight line instead.
        match (outside, k) {
            (Outside::Clamped, 0) => [1.0, -1.0 / width, 0.0, 0.0],
            (Outside::Clamped, k) if k + 2 == at.len() => [0.0, sign / width, 0.0, 0.0],
            _ => [0.0, 4.0 * sign / width, -4.0 * sign / (width * width), 0.0],
        }
    });
    Some(Table { pieces: pieces.collect(), breaks: at.clone(), outside })
}

/// Whether a node brings in what may be sharp: time, or a function other than those of geometry.
fn is_source(graph: &Graph, node: Node) -> bool {
    match graph.expr(node) {
        Expr::Input(slot) => slot as usize == Layout::TIME,
        Expr::Exp(_) | Expr::Tanh(_) | Expr::Table { .. } | Expr::Div(..) | Expr::Atan2(..) => true,
        Expr::Powi(_, n) => n < 0 || f64::from(n) >= SHARP_POWER,
        Expr::Powf(..) => true,
        _ => false,
    }
}

/// What a function of time or of the motion may do on a short stretch.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Stretch {
    /// Nothing: it is as smooth as geometry.
    Smooth,
    /// It may step as the cosine of a direction does, x / sqrt(x^2 + h^2). Products of such are geometry.
    Turns,
    /// It may step from one value to another, which is seen wherever the step is; or it follows straight from what is watched.
    Steps,
    /// It may rise and fall: it is watched.
    Rises,
}

/// Powers from here on are sharp where their base has an extremum.
const SHARP_POWER: f64 = 16.0;

/// What each of these nodes may do on a short stretch: exponentials, transitions, curves of points, quotients like 1 / (1 + x^2) and
/// high powers are sharp, and so is what is made of them. Where two of them meet, or one goes through a function that is not
/// linear, steps make pulses: tanh(x) - tanh(x - w), 1 - tanh(x)^2. Lengths in denominators are geometry, and what is multiplied by
/// geometry is sharp no more than its factor, which is watched.
fn stretches(graph: &Graph, live: &[Node], of: impl Fn(Node) -> Depends) -> Vec<Stretch> {
    let mut known = vec![Stretch::Smooth; live.last().map_or(0, |node| node.0 as usize + 1)];
    for node in live {
        if of(*node) != Depends::Nothing {
            known[node.0 as usize] = stretch(graph, graph.expr(*node), &of, |node| known[node.0 as usize]);
        }
    }
    known
}

/// What a node may do on a short stretch, from what its operands may do.
fn stretch(graph: &Graph, expr: Expr, of: impl Fn(Node) -> Depends, known: impl Fn(Node) -> Stretch) -> Stretch {
    // A square, perhaps with a factor.
    let is_square = |node: Node| match graph.expr(node) {
        Expr::Mul(a, b) if a == b => true,
        Expr::Mul(a, b) => [a, b].into_iter().any(|x| matches!(graph.expr(x), Expr::Mul(y, z) if y == z)),
        Expr::Div(a, _) => matches!(graph.expr(a), Expr::Mul(y, z) if y == z),
        Expr::Powi(_, n) => n % 2 == 0,
        _ => false,
    };
    let moves = |node: Node| of(node) == Depends::Motion;
    let is_hill = |node: Node| match graph.expr(node) {
        Expr::Add(a, b) => (!moves(a) && is_square(b)) || (!moves(b) && is_square(a)),
        _ => false,
    };
    let has_hill = |node: Node| match graph.expr(node) {
        Expr::Powi(a, _) | Expr::Powf(a, _) => is_hill(a),
        Expr::Mul(a, b) => is_hill(a) || is_hill(b),
        _ => is_hill(node),
    };
    let is_distance = |node: Node| matches!(graph.expr(node), Expr::Sqrt(a) if is_hill(a));
    let changes = |node: Node| of(node) != Depends::Nothing;
    let is_sharp = |node: Node| known(node) >= Stretch::Steps;
    let follows = |node: Node| known(node).min(Stretch::Steps);
    let of_sharp = |sharp: bool| if sharp { Stretch::Rises } else { Stretch::Smooth };
    let power = |a: Node, n: f64| of_sharp(is_sharp(a) || n.abs() >= SHARP_POWER || n < 0.0 && moves(a) && is_hill(a));
    match expr {
        Expr::Exp(_) | Expr::Tanh(_) => Stretch::Rises,
        Expr::Table { order, at, .. } => of_sharp(order == 0 || is_sharp(at)),
        Expr::Powi(a, n) => power(a, f64::from(n)),
        Expr::Powf(a, n) => power(a, f64::from_bits(n)),
        Expr::Sqrt(a) | Expr::Sin(a) | Expr::Cos(a) | Expr::Ln(a) => of_sharp(is_sharp(a)),
        Expr::Atan2(a, b) if is_sharp(a) || is_sharp(b) => Stretch::Rises,
        Expr::Atan2(a, b) if changes(a) != changes(b) => Stretch::Turns,
        Expr::Div(_, b) if is_sharp(b) => Stretch::Rises,
        Expr::Div(a, b) if !moves(a) && moves(b) && (has_hill(b) || is_distance(b)) => Stretch::Rises,
        Expr::Div(_, b) if moves(b) && is_distance(b) => Stretch::Turns,
        Expr::Add(a, b) | Expr::Sub(a, b) if known(a).min(known(b)) != Stretch::Smooth => Stretch::Rises,
        Expr::Mul(a, b) if is_sharp(a) && is_sharp(b) => Stretch::Rises,
        // With what stays as it is, it is as sharp as before.
        Expr::Add(a, b) | Expr::Sub(a, b) | Expr::Mul(a, b) | Expr::Div(a, b) if !changes(b) => follows(a),
        Expr::Add(a, b) | Expr::Sub(a, b) | Expr::Mul(a, b) if !changes(a) => follows(b),
        Expr::Neg(a) => follows(a),
        Expr::Select(_, _, c, d) => follows(c).max(follows(d)),
        _ => Stretch::Smooth,
    }
}

/// Whether a function of time may rise and fall on a short stretch.
fn is_pulse(graph: &Graph, expr: Expr, of: impl Fn(Node) -> Depends) -> bool {
    match expr {
        Expr::Select(..) => true,
        Expr::Div(_, b) => of(b) == Depends::Time && !matches!(graph.expr(b), Expr::Input(_)),
        _ => false,
    }
}

/// Whether nodes serve as alternatives of choices alone, which are watched themselves.
fn only_chosen(graph: &Graph, live: &[Node], roots: &[Node]) -> Vec<bool> {
    let mut chosen = vec![true; live.last().map_or(0, |node| node.0 as usize + 1)];
    roots.iter().for_each(|root| chosen[root.0 as usize] = false);
    for node in live {
        match graph.expr(*node) {
            Expr::Select(a, b, ..) => [a, b].into_iter().for_each(|side| chosen[side.0 as usize] = false),
            _ => graph.operands(*node, |operand| chosen[operand.0 as usize] = false),
        }
    }
    chosen
}

/// What each of these nodes, and of those below them, depends on.
fn dependence(graph: &Graph, live: &[Node], layout: &Layout) -> Vec<Depends> {
    let still = layout.reference_slot()..layout.acceleration_slot();
    let mut depends = vec![Depends::Nothing; live.last().map_or(0, |node| node.0 as usize + 1)];
    for node in live {
        let own = match graph.expr(*node) {
            Expr::Input(slot) if slot as usize == Layout::TIME => Depends::Time,
            Expr::Input(slot) if still.contains(&(slot as usize)) => Depends::Nothing,
            Expr::Input(_) | Expr::Call { .. } => Depends::Motion,
            _ => {
                let mut most = Depends::Nothing;
                graph.operands(*node, |operand| most = most.max(depends[operand.0 as usize]));
                most
            }
        };
        depends[node.0 as usize] = own;
    }
    depends
}
