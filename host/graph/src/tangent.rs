//! [`Tangents`]: derivatives along many directions, as numbers.

use std::ops::Range;

use element_api::set::Fault;
use rustc_hash::FxHashMap;

use super::derivative::Seeds;
use super::graph::{Expr, Graph, Node};
use super::tape::{Program, Sets, Used, Workspace};
use super::turn;

/// Directions that are taken at a time.
const LANES: usize = 8;

/// Derivatives of a node along the directions of a block.
type Lanes = [f64; LANES];

/// The place of what does not depend on any direction: its derivatives are zero.
const CONSTANT: u32 = 0;

/// Terms up to which a sum is written out where it is used, if only once.
const SHORT: usize = 8;

/// The derivative of a node before, times a number.
#[derive(Debug, Clone, Copy)]
struct Term {
    operand: u32,
    factor: u32,
}

/// The chain rule for a node: its derivative is a sum of terms, from the end of those of the node before to here; or that of one of
/// two nodes, the first where its number is not zero.
#[derive(Debug, Clone, Copy)]
struct Step {
    end: u32,
    is_choice: bool,
}

/// Directions that are taken together.
#[derive(Debug, Clone, Default)]
struct Block {
    /// Place, lane, number: what is given.
    seeds: Vec<(u32, u8, u32)>,
    /// Steps that depend on any of the directions, ascending.
    runs: Vec<Range<u32>>,
    /// What the block before leaves that is zero for this one: places that are not among the runs.
    clear: Vec<Range<u32>>,
    /// Function, its place, the lanes on which it depends.
    results: Vec<(u32, u32, u8)>,
}

/// Derivatives of functions along directions, in forward mode (Griewank & Walther, ch. 3): the same as
/// [`super::derivatives`], without writing them down. The partial derivatives of each operation are computed once, by a program;
/// then the chain rule is carried through a list of steps for eight directions at a time, past all steps that do not depend on
/// any of these. Storage grows with the operations and with the directions that each depends on.
#[derive(Debug, Clone)]
pub struct Tangents {
    program: Program,
    workspace: Workspace,
    /// Partial derivatives and seeds that vary, from the program; then those that are constant.
    numbers: Vec<f64>,
    varying: usize,
    /// By place.
    steps: Vec<Step>,
    terms: Vec<Term>,
    blocks: Vec<Block>,
    lanes: Vec<Lanes>,
}

impl Tangents {
    /// Of `functions`, along each of `directions`. What is seeded along one direction counts as a variable of its own along all of
    /// them. `graph` is added to.
    #[must_use]
    pub fn new(graph: &mut Graph, functions: &[Node], directions: &[Seeds]) -> Self {
        let mut rule = Rule { multiple_of: FxHashMap::default(), sums: vec![Total::default()] };
        let seeded = directions.iter().flat_map(Seeds::keys);
        let seeded: FxHashMap<Node, ()> = seeded.map(|node| (*node, ())).collect();
        for node in graph.live(functions) {
            if seeded.contains_key(&node) {
                rule.add(graph, node, Total { is_kept: true, ..Total::default() });
            } else {
                rule.take(graph, node);
            }
        }
        let places: Vec<u32> = functions.iter().map(|node| rule.place(graph, *node)).collect();
        rule.write_out(graph);
        let Rule { multiple_of, sums } = rule;
        let mut numbers = Numbers::default();
        let (mut steps, mut terms, mut new_place) = (Vec::new(), Vec::new(), vec![CONSTANT; sums.len()]);
        for (sum, place) in sums.iter().zip(0..).filter(|(sum, _)| !sum.is_written_out) {
            new_place[place] = steps.len() as u32;
            let term = |(operand, factor): &(u32, Node)| Term {
                operand: new_place[*operand as usize],
                factor: numbers.of(*factor),
            };
            terms.extend(sum.terms.iter().map(term));
            steps.push(Step { end: terms.len() as u32, is_choice: sum.is_choice });
        }
        let places: Vec<u32> = places.into_iter().map(|place| new_place[place as usize]).collect();
        let mut masks = vec![0_u8; steps.len()];
        let blocks = directions.chunks(LANES).map(|directions| {
            let mut block = Block::default();
            for (lane, seeds) in directions.iter().enumerate() {
                for (node, rate) in seeds {
                    if let Some((place, _)) = multiple_of.get(node).filter(|_| !graph.is_zero(*rate)) {
                        block.seeds.push((new_place[*place as usize], lane as u8, numbers.of(*rate)));
                    }
                }
            }
            block.reach(&steps, &terms, &places, &mut masks);
            block
        });
        let mut blocks: Vec<Block> = blocks.collect();
        for at in 0..blocks.len() {
            let before = (at + blocks.len() - 1) % blocks.len();
            blocks[at].clear = without(&blocks[before].runs, &blocks[at].runs);
        }
        let (varying, constant): (Vec<Node>, Vec<Node>) =
            numbers.list.iter().partition(|node| graph.value(**node).is_none());
        let program = Program::compile(graph, &varying);
        let mut tangents = Self {
            workspace: program.workspace(),
            program,
            varying: varying.len(),
            numbers: vec![0.0; varying.len()],
            lanes: vec![[0.0; LANES]; steps.len()],
            steps,
            terms,
            blocks,
        };
        tangents.numbers.extend(constant.iter().filter_map(|node| graph.value(*node)));
        let place = varying.iter().chain(&constant).enumerate().map(|(place, node)| (*node, place as u32));
        let place: FxHashMap<Node, u32> = place.collect();
        let renumber = |number: &mut u32| *number = place[&numbers.list[*number as usize]];
        tangents.terms.iter_mut().map(|term| &mut term.factor).for_each(renumber);
        tangents.blocks.iter_mut().flat_map(|block| &mut block.seeds).for_each(|(_, _, number)| renumber(number));
        tangents
    }

    /// The program of partial derivatives, with how often it was run.
    pub fn used(&mut self) -> Used<'_> {
        Used::new(&mut self.program, self.workspace.runs(), true)
    }

    /// Products of a number with a derivative that a run takes, over all directions: what it costs.
    #[must_use]
    pub fn work(&self) -> usize {
        let runs = self.blocks.iter().flat_map(|block| &block.runs);
        LANES * runs.map(|run| terms_of(&self.steps, run.clone()).len()).sum::<usize>()
    }

    /// Gives (direction, function, derivative) of all derivatives that are not zero everywhere, by directions. `[hot]`
    ///
    /// # Errors
    /// What an opaque element did wrong, with the set it belongs to.
    pub fn run(
        &mut self,
        inputs: &[f64],
        sets: &Sets,
        mut found: impl FnMut(usize, usize, f64),
    ) -> Result<(), (usize, Fault)> {
        let Self { program, workspace, numbers, varying, steps, terms, blocks, lanes } = self;
        program.run(inputs, sets, workspace, &mut numbers[..*varying])?;
        for (number, block) in blocks.iter().enumerate() {
            block.clear.iter().for_each(|run| lanes[run.start as usize..run.end as usize].fill([0.0; LANES]));
            for (place, lane, number) in &block.seeds {
                lanes[*place as usize][*lane as usize] = numbers[*number as usize];
            }
            turn::in_widest_lanes(Carry { runs: &block.runs, steps, terms, numbers, lanes });
            for (function, place, mask) in &block.results {
                let derivatives = &lanes[*place as usize];
                for lane in (0..LANES).filter(|lane| mask >> lane & 1 == 1) {
                    found(LANES * number + lane, *function as usize, derivatives[lane]);
                }
            }
            block.seeds.iter().for_each(|(place, ..)| lanes[*place as usize] = [0.0; LANES]);
        }
        Ok(())
    }
}

/// Places of the terms of some steps.
fn terms_of(steps: &[Step], run: Range<u32>) -> Range<usize> {
    let end = |at: u32| steps[at as usize].end as usize;
    // What comes first depends on nothing.
    end(run.start.max(1) - 1)..end(run.end.max(1) - 1)
}

/// The chain rule through the runs of a block.
struct Carry<'a> {
    runs: &'a [Range<u32>],
    steps: &'a [Step],
    terms: &'a [Term],
    numbers: &'a [f64],
    lanes: &'a mut [Lanes],
}

impl turn::Work for Carry<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Self { runs, steps, terms, numbers, lanes } = self;
        for run in runs {
            let mut from = terms_of(steps, run.clone()).start;
            for at in run.start as usize..run.end as usize {
                let Step { end, is_choice } = steps[at];
                let own = &terms[from..end as usize];
                from = end as usize;
                if is_choice {
                    let chosen = if numbers[own[0].factor as usize] == 0.0 { own[1] } else { own[0] };
                    lanes[at] = lanes[chosen.operand as usize];
                    continue;
                }
                let mut sums = [0.0; LANES];
                for Term { operand, factor } in own {
                    let factor = numbers[*factor as usize];
                    let slopes = &lanes[*operand as usize];
                    sums.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += factor * slope);
                }
                lanes[at] = sums;
            }
        }
    }
}

impl Block {
    /// Finds what depends on the seeds. `masks` are room, zero before and after.
    fn reach(&mut self, steps: &[Step], terms: &[Term], functions: &[u32], masks: &mut [u8]) {
        let Some(first) = self.seeds.iter().map(|(place, ..)| *place).min() else { return };
        self.seeds.iter().for_each(|(place, lane, _)| masks[*place as usize] |= 1 << lane);
        for at in first..steps.len() as u32 {
            let own = &terms[terms_of(steps, at..at + 1)];
            let mask = own.iter().fold(0, |mask, term| mask | masks[term.operand as usize]);
            if mask == 0 {
                continue;
            }
            masks[at as usize] |= mask;
            match self.runs.last_mut() {
                Some(run) if run.end == at => run.end += 1,
                _ => self.runs.push(at..at + 1),
            }
        }
        for (function, place) in functions.iter().enumerate() {
            let mask = masks[*place as usize];
            if mask != 0 {
                self.results.push((function as u32, *place, mask));
            }
        }
        masks[first as usize..].fill(0);
    }
}

/// What the first ranges have and the others have not; both ascending.
fn without(ranges: &[Range<u32>], others: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut left = Vec::new();
    let mut others = others.iter().peekable();
    for range in ranges {
        let mut from = range.start;
        while let Some(other) = others.next_if(|other| other.end <= range.end) {
            if other.start > from {
                left.push(from..other.start);
            }
            from = from.max(other.end);
        }
        let end = others.peek().map_or(range.end, |other| other.start.min(range.end));
        if end > from {
            left.push(from..end);
        }
    }
    left
}

/// Nodes that are numbers of the chain rule, each of them once.
#[derive(Default)]
struct Numbers {
    list: Vec<Node>,
    number_of: FxHashMap<Node, u32>,
}

impl Numbers {
    fn of(&mut self, node: Node) -> u32 {
        *self.number_of.entry(node).or_insert_with(|| {
            self.list.push(node);
            self.list.len() as u32 - 1
        })
    }
}

/// The chain rule for a node, while it is written.
#[derive(Default)]
struct Total {
    terms: Vec<(u32, Node)>,
    is_choice: bool,
    /// Whether it is asked for by itself.
    is_kept: bool,
    /// Whether it is part of another one instead.
    is_written_out: bool,
}

/// The chain rule, written node by node. What would be carried for all directions is spared where a few products of numbers do:
/// nodes with one edge in or out are eliminated (Griewank & Walther, ch. 9).
struct Rule {
    /// Nodes that depend on any direction: a place, and the number by which its derivative is multiplied.
    multiple_of: FxHashMap<Node, (u32, Node)>,
    /// By place.
    sums: Vec<Total>,
}

impl Rule {
    fn add(&mut self, g: &mut Graph, node: Node, sum: Total) -> u32 {
        let place = self.sums.len() as u32;
        self.sums.push(sum);
        self.multiple_of.insert(node, (place, g.constant(1.0)));
        place
    }

    /// The place with the derivative of a node itself.
    fn place(&mut self, g: &mut Graph, node: Node) -> u32 {
        let Some((place, factor)) = self.multiple_of.get(&node).copied() else { return CONSTANT };
        if g.value(factor) == Some(1.0) {
            self.sums[place as usize].is_kept = true;
            return place;
        }
        self.add(g, node, Total { terms: vec![(place, factor)], is_kept: true, ..Total::default() })
    }

    /// A node, if it depends on any direction.
    fn take(&mut self, g: &mut Graph, node: Node) {
        let (mut operands, mut count) = ([None; 4], 0);
        g.operands(node, |operand| {
            // Opaque results, with any number of operands, are differentiated by whoever knows what they mean.
            if let Some(place) = operands.get_mut(count) {
                *place = self.multiple_of.get(&operand).copied();
            }
            count += 1;
        });
        match g.expr(node) {
            Expr::Call { .. } => {}
            Expr::Select(a, b, c, d) => {
                if operands[2..].iter().any(Option::is_some) {
                    let (one, zero) = (g.constant(1.0), g.constant(0.0));
                    let first = g.select(a, b, one, zero);
                    let terms = [c, d].map(|operand| (self.place(g, operand), first)).to_vec();
                    self.add(g, node, Total { terms, is_choice: true, ..Total::default() });
                }
            }
            _ => self.sum(g, node, [operands[0], operands[1]]),
        }
    }

    /// A node with these multiples as operands.
    fn sum(&mut self, g: &mut Graph, node: Node, operands: [Option<(u32, Node)>; 2]) {
        let mut terms = Vec::new();
        for (k, operand) in operands.into_iter().enumerate() {
            let Some((place, factor)) = operand else { continue };
            let slope = partial(g, node, k);
            let slope = g.mul(slope, factor);
            add_term(g, &mut terms, (place, slope));
        }
        match terms[..] {
            [] => {}
            [only] => {
                self.multiple_of.insert(node, only);
            }
            _ => {
                self.add(g, node, Total { terms, ..Total::default() });
            }
        }
    }

    /// Puts short sums that are used once where they are used.
    fn write_out(&mut self, g: &mut Graph) {
        let mut users = vec![0_u32; self.sums.len()];
        self.sums.iter().flat_map(|sum| &sum.terms).for_each(|(operand, _)| users[*operand as usize] += 1);
        for at in 0..self.sums.len() {
            let (before, rest) = self.sums.split_at_mut(at);
            let own = &mut rest[0];
            if own.is_choice {
                continue;
            }
            let mut terms = Vec::new();
            for (operand, factor) in std::mem::take(&mut own.terms) {
                let of = &mut before.get_mut(operand as usize);
                match of {
                    Some(of) if users[operand as usize] == 1 && of.can_be_written_out() => {
                        of.is_written_out = true;
                        for (inner, slope) in std::mem::take(&mut of.terms) {
                            let slope = g.mul(factor, slope);
                            add_term(g, &mut terms, (inner, slope));
                        }
                    }
                    _ => add_term(g, &mut terms, (operand, factor)),
                }
            }
            own.terms = terms;
        }
    }
}

impl Total {
    fn can_be_written_out(&self) -> bool {
        !self.is_kept && !self.is_choice && (1..=SHORT).contains(&self.terms.len())
    }
}

/// Adds a term to others, of which none has the same operand.
fn add_term(g: &mut Graph, terms: &mut Vec<(u32, Node)>, (operand, factor): (u32, Node)) {
    if let Some((_, sum)) = terms.iter_mut().find(|(other, _)| *other == operand) {
        *sum = g.add(*sum, factor);
    } else if !g.is_zero(factor) {
        terms.push((operand, factor));
    }
}

/// The partial derivative of a node with respect to the first or second of its operands.
fn partial(g: &mut Graph, node: Node, operand: usize) -> Node {
    let one = g.constant(1.0);
    match (g.expr(node), operand) {
        (Expr::Add(..), _) | (Expr::Sub(..), 0) => one,
        (Expr::Sub(..) | Expr::Neg(_), _) => g.constant(-1.0),
        (Expr::Mul(_, b), 0) => b,
        (Expr::Mul(a, _), _) => a,
        (Expr::Div(_, b), 0) => g.div(one, b),
        (Expr::Div(_, b), _) => {
            let slope = g.div(node, b);
            g.neg(slope)
        }
        // Infinitely steep at zero, which a choice may hold it at (`max(x, 0)`): products with derivatives that are zero then have to be.
        (Expr::Sqrt(_), _) => {
            let (half, zero) = (g.constant(0.5), g.constant(0.0));
            let slope = g.div(half, node);
            g.select(zero, node, slope, zero)
        }
        (Expr::Sin(a), _) => g.cos(a),
        (Expr::Cos(a), _) => {
            let sine = g.sin(a);
            g.neg(sine)
        }
        (Expr::Atan2(y, x), _) => {
            let (yy, xx) = (g.mul(y, y), g.mul(x, x));
            let bottom = g.add(yy, xx);
            let top = if operand == 0 { x } else { g.neg(y) };
            g.div(top, bottom)
        }
        (Expr::Exp(_), _) => node,
        (Expr::Ln(a), _) => g.div(one, a),
        (Expr::Tanh(_), _) => {
            let square = g.mul(node, node);
            g.sub(one, square)
        }
        (Expr::Powi(a, n), _) => {
            let factor = g.constant(f64::from(n));
            // There is no power below the least one; a library may send it.
            let power = match n.checked_sub(1) {
                Some(below) => g.powi(a, below),
                None => g.div(node, a),
            };
            g.mul(factor, power)
        }
        (Expr::Powf(a, bits), _) => {
            let exponent = f64::from_bits(bits);
            let factor = g.constant(exponent);
            let power = g.powf(a, exponent - 1.0);
            let slope = g.mul(factor, power);
            let zero = g.constant(0.0);
            if exponent < 1.0 { g.select(zero, a, slope, zero) } else { slope }
        }
        (Expr::Table { table, order, at }, _) => g.table(table, order + 1, at),
        (Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } | Expr::Select(..), _) => g.constant(0.0),
    }
}
