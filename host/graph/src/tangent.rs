//! [`Tangents`]: derivatives along many directions, as numbers.

use std::ops::Range;

use element_api::set::Fault;
use rustc_hash::FxHashMap;

use super::derivative::Seeds;
use super::graph::{Expr, Graph, Node};
use super::tape::{Program, Sets, Used, Workspace};

/// Directions that are taken at a time.
const LANES: usize = 8;

/// Derivatives of a node along the directions of a block.
type Lanes = [f64; LANES];

/// The place of what does not depend on any direction: its derivatives are zero.
const CONSTANT: u32 = 0;

/// In place of the second factor: one of the two operands is chosen.
const CHOICE: u32 = u32::MAX;

/// The chain rule for a node: its derivative is the sum of those of two nodes before it, each times a number; or one of the two,
/// the first where the number is not zero.
#[derive(Debug, Clone, Copy)]
struct Step {
    operands: [u32; 2],
    factors: [u32; 2],
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
    blocks: Vec<Block>,
    lanes: Vec<Lanes>,
}

impl Tangents {
    /// Of `functions`, along each of `directions`. What is seeded along one direction counts as a variable of its own along all of
    /// them. `graph` is added to.
    #[must_use]
    pub fn new(graph: &mut Graph, functions: &[Node], directions: &[Seeds]) -> Self {
        let mut numbers = Numbers::default();
        let mut place_of: FxHashMap<Node, u32> = FxHashMap::default();
        let seeded = directions.iter().flat_map(Seeds::keys);
        let seeded: FxHashMap<Node, ()> = seeded.map(|node| (*node, ())).collect();
        let nothing = Step { operands: [CONSTANT; 2], factors: [numbers.of(graph.constant(0.0)); 2] };
        let mut steps = vec![nothing];
        for node in graph.live(functions) {
            let step =
                if seeded.contains_key(&node) { Some(nothing) } else { step(graph, node, &place_of, &mut numbers) };
            if let Some(step) = step {
                place_of.insert(node, steps.len() as u32);
                steps.push(step);
            }
        }
        let places: Vec<u32> = functions.iter().map(|node| place_of.get(node).copied().unwrap_or(CONSTANT)).collect();
        let mut masks = vec![0_u8; steps.len()];
        let blocks = directions.chunks(LANES).map(|directions| {
            let mut block = Block::default();
            for (lane, seeds) in directions.iter().enumerate() {
                for (node, rate) in seeds {
                    if let Some(place) = place_of.get(node).filter(|_| !graph.is_zero(*rate)) {
                        block.seeds.push((*place, lane as u8, numbers.of(*rate)));
                    }
                }
            }
            block.reach(&steps, &places, &mut masks);
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
            blocks,
        };
        tangents.numbers.extend(constant.iter().filter_map(|node| graph.value(*node)));
        let place = varying.iter().chain(&constant).enumerate().map(|(place, node)| (*node, place as u32));
        let place: FxHashMap<Node, u32> = place.collect();
        let renumber = |number: &mut u32| {
            if *number != CHOICE {
                *number = place[&numbers.list[*number as usize]];
            }
        };
        tangents.steps.iter_mut().flat_map(|step| &mut step.factors).for_each(renumber);
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
        let steps = |block: &Block| block.runs.iter().map(|run| run.len()).sum::<usize>();
        2 * LANES * self.blocks.iter().map(steps).sum::<usize>()
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
        let Self { program, workspace, numbers, varying, steps, blocks, lanes } = self;
        program.run(inputs, sets, workspace, &mut numbers[..*varying])?;
        for (number, block) in blocks.iter().enumerate() {
            block.clear.iter().for_each(|run| lanes[run.start as usize..run.end as usize].fill([0.0; LANES]));
            for (place, lane, number) in &block.seeds {
                lanes[*place as usize][*lane as usize] = numbers[*number as usize];
            }
            for run in &block.runs {
                carry(run.clone(), steps, numbers, lanes);
            }
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

/// The chain rule through a run of steps.
fn carry(run: Range<u32>, steps: &[Step], numbers: &[f64], lanes: &mut [Lanes]) {
    for at in run.start as usize..run.end as usize {
        let Step { operands, factors } = steps[at];
        let [a, b] = operands.map(|operand| lanes[operand as usize]);
        let first = numbers[factors[0] as usize];
        if factors[1] == CHOICE {
            lanes[at] = if first == 0.0 { b } else { a };
            continue;
        }
        let second = numbers[factors[1] as usize];
        for ((slope, a), b) in lanes[at].iter_mut().zip(a).zip(b) {
            *slope = first * a + second * b;
        }
    }
}

impl Block {
    /// Finds what depends on the seeds. `masks` are room, zero before and after.
    fn reach(&mut self, steps: &[Step], functions: &[u32], masks: &mut [u8]) {
        let Some(first) = self.seeds.iter().map(|(place, ..)| *place).min() else { return };
        self.seeds.iter().for_each(|(place, lane, _)| masks[*place as usize] |= 1 << lane);
        for at in first..steps.len() as u32 {
            let [a, b] = steps[at as usize].operands;
            let mask = masks[a as usize] | masks[b as usize];
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

/// The chain rule for a node, if it depends on any direction.
fn step(g: &mut Graph, node: Node, place_of: &FxHashMap<Node, u32>, numbers: &mut Numbers) -> Option<Step> {
    let place = |operand: Node| place_of.get(&operand).copied();
    let mut moves = false;
    g.operands(node, |operand| moves |= place(operand).is_some());
    if !moves {
        return None;
    }
    if let Expr::Select(a, b, c, d) = g.expr(node) {
        let operands = [c, d].map(|operand| place(operand).unwrap_or(CONSTANT));
        if operands == [CONSTANT; 2] {
            return None;
        }
        let (one, zero) = (g.constant(1.0), g.constant(0.0));
        let first = g.select(a, b, one, zero);
        return Some(Step { operands, factors: [numbers.of(first), CHOICE] });
    }
    if let Expr::Call { .. } = g.expr(node) {
        // Opaque results are differentiated by whoever knows what they mean.
        return None;
    }
    let zero = numbers.of(g.constant(0.0));
    let mut step = Step { operands: [CONSTANT; 2], factors: [zero; 2] };
    let (mut places, mut count) = ([None; 2], 0);
    g.operands(node, |operand| {
        places[count] = place(operand);
        count += 1;
    });
    let mut found = 0;
    for (k, at) in places.into_iter().enumerate() {
        let Some(at) = at else { continue };
        let slope = partial(g, node, k);
        if !g.is_zero(slope) {
            (step.operands[found], step.factors[found]) = (at, numbers.of(slope));
            found += 1;
        }
    }
    (found > 0).then_some(step)
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
        (Expr::Sqrt(_), _) => {
            let half = g.constant(0.5);
            g.div(half, node)
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
            g.mul(factor, power)
        }
        (Expr::Table { table, order, at }, _) => g.table(table, order + 1, at),
        (Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } | Expr::Select(..), _) => g.constant(0.0),
    }
}
