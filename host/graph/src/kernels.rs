//! Kernels: operations that many places of a scene repeat, written once and looped over the places.
//!
//! Inputs belong to *places* (a body with its coordinates, an element with its states), see [`Graph::with_places`].
//! Every operation has a *support*: the places its value depends on. Operations of equal support form a *cell*; what a cell
//! needs from others has a smaller support, so that cells run in the order of the size of their supports. Cells that do the
//! same operations in the same order, whatever numbers they contain, share one *kernel*: a short program of its own, with
//! lists of where each cell's numbers come from (the gather) and where its results go (the scatter).
//!
//! No operation is added, repeated or changed: a program with kernels gives the bits of the straight-line one, and both have
//! equally many operations. What depends on many places (sums over all bodies), on none (functions of time), or is done by
//! few cells only stays straight-line code between the kernels.

use element_api::Table;
use rustc_hash::FxHashMap;

use super::graph::{Expr, Graph, Node};
use super::interpreter::interpret_lanes;
use super::tape::{Program, Register};

/// Cells that run at the same time, each on its own lane of the registers.
pub(super) const LANES: usize = 8;
/// The largest support of a cell. Joints have two places, gears three; beyond are sums.
const MOST_PLACES: usize = 6;
/// Fewer cells of a kind are left as straight-line code.
const LEAST_CELLS: usize = LANES;

/// How programs are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Writing {
    /// With kernels where [`super::costs`] predicts that they are faster.
    #[default]
    Automatic,
    /// One straight line of operations.
    Straight,
    /// With kernels wherever there are any.
    Kernels,
}

/// The number of a place.
pub type Place = u32;
/// An input that belongs to no place, like the time.
pub const NO_PLACE: Place = u32::MAX;

/// A short program with the places it runs at.
#[derive(Debug, Clone)]
pub(super) struct Kernel {
    pub(super) program: Program,
    /// Registers of the whole program that the kernel's inputs are read from, cell after cell.
    pub(super) gather: Vec<Register>,
    /// Registers of the whole program that its outputs are written to, cell after cell.
    pub(super) scatter: Vec<Register>,
    pub(super) cells: usize,
}

impl Kernel {
    /// Runs all cells. `lanes` holds at least as many entries as the kernel has registers.
    pub(super) fn run(&self, tables: &[Table], numbers: &mut [f64], lanes: &mut [[f64; LANES]]) {
        let program = &self.program;
        let lanes = &mut lanes[..program.registers];
        for (lane, constant) in lanes.iter_mut().zip(&program.constants) {
            *lane = [*constant; LANES];
        }
        let (inputs, outputs) = (program.inputs.len(), program.outputs.len());
        for first in (0..self.cells).step_by(LANES) {
            let count = LANES.min(self.cells - first);
            for (lane, cell) in (first..first + LANES).enumerate() {
                // Lanes without a cell of their own repeat the last one.
                let cell = cell.min(self.cells - 1);
                let from = &self.gather[cell * inputs..(cell + 1) * inputs];
                for ((_, register), source) in program.inputs.iter().zip(from) {
                    lanes[*register as usize][lane] = numbers[*source as usize];
                }
            }
            interpret_lanes(program.instructions(), tables, lanes);
            for (lane, cell) in (first..first + count).enumerate() {
                let to = &self.scatter[cell * outputs..(cell + 1) * outputs];
                for (register, target) in program.outputs.iter().zip(to) {
                    numbers[*target as usize] = lanes[*register as usize][lane];
                }
            }
        }
    }

    /// The operations of one cell.
    pub(super) fn operations(&self) -> usize {
        self.program.operations()
    }
}

/// Operations whose supports have the same size.
#[derive(Debug, Default)]
pub(super) struct Level {
    /// Straight-line code, ascending.
    pub(super) straight: Vec<Node>,
    /// What the kernels will be.
    pub(super) shapes: Vec<Shape>,
}

/// A kernel before registers are given out.
#[derive(Debug)]
pub(super) struct Shape {
    /// The operations of one cell; inputs are numbered in the order of their first use.
    pub(super) graph: Graph,
    /// Nodes of `graph` that others need.
    pub(super) outputs: Vec<Node>,
    /// Nodes of the scene's graph that the inputs stand for, cell after cell.
    pub(super) imports: Vec<Node>,
    /// Nodes of the scene's graph that the outputs stand for, cell after cell.
    pub(super) exports: Vec<Node>,
    pub(super) cells: usize,
}

impl Shape {
    /// Operations of all cells together.
    pub(super) fn operations(&self) -> usize {
        let own = self.graph.nodes().filter(|node| !is_leaf(&self.graph, *node)).count();
        self.cells * own
    }
}

/// Sets of places, each once; number 0 is the empty set.
struct Supports {
    sets: Vec<Vec<Place>>,
    known: FxHashMap<Vec<Place>, u32>,
    united: FxHashMap<(u32, u32), u32>,
}

/// No set: more than [`MOST_PLACES`].
const WIDE: u32 = u32::MAX;

impl Supports {
    fn new() -> Self {
        Self { sets: vec![Vec::new()], known: FxHashMap::from_iter([(Vec::new(), 0)]), united: FxHashMap::default() }
    }

    fn number(&mut self, set: Vec<Place>) -> u32 {
        if set.len() > MOST_PLACES {
            return WIDE;
        }
        if let Some(number) = self.known.get(&set) {
            return *number;
        }
        let next = self.sets.len() as u32;
        self.sets.push(set.clone());
        self.known.insert(set, next);
        next
    }

    fn of_place(&mut self, place: Place) -> u32 {
        if place == NO_PLACE { 0 } else { self.number(vec![place]) }
    }

    fn union(&mut self, a: u32, b: u32) -> u32 {
        if a == b || b == 0 {
            return a;
        }
        if a == 0 {
            return b;
        }
        if a == WIDE || b == WIDE {
            return WIDE;
        }
        let key = (a.min(b), a.max(b));
        if let Some(known) = self.united.get(&key) {
            return *known;
        }
        let mut set = self.sets[a as usize].clone();
        set.extend(&self.sets[b as usize]);
        set.sort_unstable();
        set.dedup();
        let number = self.number(set);
        self.united.insert(key, number);
        number
    }

    fn size(&self, number: u32) -> usize {
        if number == WIDE { MOST_PLACES + 1 } else { self.sets[number as usize].len() }
    }
}

/// Splits the operations that `outputs` depend on (`live`, ascending) into levels, each of which needs only those before it
/// and constants and inputs. The graph must have places and no calls.
pub(super) fn levels(graph: &Graph, live: &[Node], outputs: &[Node]) -> Vec<Level> {
    let mut supports = Supports::new();
    // By node: its support.
    let mut support = vec![0_u32; live.last().map_or(0, |node| node.0 as usize + 1)];
    for node in live {
        support[node.0 as usize] = match graph.expr(*node) {
            Expr::Constant(_) => 0,
            Expr::Input(slot) => supports.of_place(graph.places.get(slot as usize).copied().unwrap_or(NO_PLACE)),
            _ => {
                let mut union = 0;
                graph.operands(*node, |operand| union = supports.union(union, support[operand.0 as usize]));
                union
            }
        };
    }
    let wanted = wanted_elsewhere(graph, live, outputs, &support);
    let mut members: Vec<Vec<Node>> = vec![Vec::new(); supports.sets.len()];
    let mut levels: Vec<Level> = Vec::new();
    levels.resize_with(MOST_PLACES + 2, Level::default);
    for node in live.iter().filter(|node| !is_leaf(graph, **node)) {
        match support[node.0 as usize] {
            WIDE => levels[MOST_PLACES + 1].straight.push(*node),
            0 => levels[0].straight.push(*node),
            set => members[set as usize].push(*node),
        }
    }
    let mut scratch = Scratch { place: vec![0; support.len()], imported_by: vec![0; support.len()] };
    for (size, level) in levels.iter_mut().enumerate().take(MOST_PLACES + 1).skip(1) {
        let mut sorter = Sorter::default();
        for (set, cell) in members.iter().enumerate() {
            if cell.is_empty() || supports.size(set as u32) != size {
                continue;
            }
            if cell.iter().any(|node| matches!(graph.expr(*node), Expr::Table { .. })) {
                // Each element has tables of its own.
                level.straight.extend(cell);
            } else {
                sorter.add(graph, set as u32, cell, &support, &wanted, &mut scratch);
            }
        }
        sorter.finish(graph, &members, level);
    }
    levels
}

/// Constants and inputs belong to no cell.
fn is_leaf(graph: &Graph, node: Node) -> bool {
    matches!(graph.expr(node), Expr::Constant(_) | Expr::Input(_))
}

/// By node: whether it is an output, or an operand of a node of another support.
fn wanted_elsewhere(graph: &Graph, live: &[Node], outputs: &[Node], support: &[u32]) -> Vec<bool> {
    let mut wanted = vec![false; support.len()];
    outputs.iter().for_each(|node| wanted[node.0 as usize] = true);
    for node in live {
        let own = support[node.0 as usize];
        graph.operands(*node, |operand| wanted[operand.0 as usize] |= support[operand.0 as usize] != own);
    }
    wanted
}

/// By node of the scene's graph, for the cell at hand.
struct Scratch {
    /// Its place among the operations of the cell.
    place: Vec<u32>,
    /// The support of the cell that took it as an input last.
    imported_by: Vec<u32>,
}

/// Sorts cells by what they do.
#[derive(Default)]
struct Sorter {
    /// Operations and places of the wanted ones, with the number of the shape.
    known: FxHashMap<(Vec<Expr>, Vec<u32>), usize>,
    shapes: Vec<Collected>,
}

/// Cells of one shape.
struct Collected {
    operations: Vec<Expr>,
    wanted: Vec<u32>,
    sets: Vec<u32>,
    imports: Vec<Node>,
    exports: Vec<Node>,
}

impl Sorter {
    fn add(&mut self, graph: &Graph, set: u32, cell: &[Node], support: &[u32], wanted: &[bool], scratch: &mut Scratch) {
        let (mut operations, mut imports) = (Vec::with_capacity(2 * cell.len()), Vec::new());
        let (mut outputs, mut exports) = (Vec::new(), Vec::new());
        for node in cell {
            graph.operands(*node, |operand| {
                let at = operand.0 as usize;
                let own = support[at] == set && !is_leaf(graph, operand);
                if !own && scratch.imported_by[at] != set {
                    scratch.imported_by[at] = set;
                    scratch.place[at] = operations.len() as u32;
                    operations.push(Expr::Input(imports.len() as u32));
                    imports.push(operand);
                }
            });
            let operation = graph.expr(*node).with_operands(|operand| Node(scratch.place[operand.0 as usize]));
            scratch.place[node.0 as usize] = operations.len() as u32;
            if wanted[node.0 as usize] {
                outputs.push(operations.len() as u32);
                exports.push(*node);
            }
            operations.push(operation);
        }
        let key = (operations, outputs);
        let at = match self.known.get(&key) {
            Some(at) => *at,
            None => {
                let (operations, wanted) = key.clone();
                let (sets, imports, exports) = (Vec::new(), Vec::new(), Vec::new());
                self.shapes.push(Collected { operations, wanted, sets, imports, exports });
                self.known.insert(key, self.shapes.len() - 1);
                self.shapes.len() - 1
            }
        };
        let shape = &mut self.shapes[at];
        shape.sets.push(set);
        shape.imports.extend(imports);
        shape.exports.extend(exports);
    }

    /// Kernels where there are enough cells, straight-line code of the rest.
    fn finish(self, graph: &Graph, members: &[Vec<Node>], level: &mut Level) {
        for shape in self.shapes {
            if shape.sets.len() < LEAST_CELLS {
                level.straight.extend(shape.sets.iter().flat_map(|set| &members[*set as usize]));
            } else {
                level.shapes.push(shape.finish(graph));
            }
        }
        level.straight.sort_unstable();
    }
}

impl Collected {
    /// Inputs that are the same constant in every cell become constants of the kernel.
    fn finish(self, graph: &Graph) -> Shape {
        let cells = self.sets.len();
        let count = self.imports.len() / cells;
        let same = |k: usize| self.imports.iter().skip(k).step_by(count).all(|node| *node == self.imports[k]);
        let fixed: Vec<Option<f64>> = (0..count).map(|k| graph.value(self.imports[k]).filter(|_| same(k))).collect();
        // The varying ones keep their order.
        let number = |k: usize| fixed[..k].iter().filter(|fixed| fixed.is_none()).count() as u32;
        let operations = self.operations.into_iter().map(|operation| match operation {
            Expr::Input(k) => match fixed[k as usize] {
                Some(value) => Expr::Constant(value.to_bits()),
                None => Expr::Input(number(k as usize)),
            },
            other => other,
        });
        let varying = self.imports.iter().enumerate().filter(|(at, _)| fixed[at % count].is_none());
        Shape {
            graph: Graph::of(operations.collect()),
            outputs: self.wanted.into_iter().map(Node).collect(),
            imports: varying.map(|(_, node)| *node).collect(),
            exports: self.exports,
            cells,
        }
    }
}
