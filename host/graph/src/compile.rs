//! How a part of the graph becomes a [`Program`]: its order, its calls in stages, its registers.

use std::sync::Arc;

use element_api::set::Wanted;
use rustc_hash::FxHashMap;

use super::graph::{Expr, Graph, Node};
use super::structures;
use super::tape::{BatchPlan, Instruction, Program, Register, Stage, Turns};
use super::turn::{first_angles, lanes, pairs_together};

impl Program {
    /// Brings everything `outputs` depend on into running order and drops the rest.
    ///
    /// Registers are reused once their last user has run. Calls run in stages: together with all that need the results of
    /// equally many calls one after the other, between the operations that feed them and the operations that use them.
    #[must_use]
    pub fn compile(graph: &Graph, outputs: &[Node]) -> Self {
        structures::program(graph, outputs, || Self::compile_anew(graph, outputs))
    }

    /// The same, known or not.
    fn compile_anew(graph: &Graph, outputs: &[Node]) -> Self {
        let live = graph.live(outputs);
        let calls = used_calls(graph, &live);
        if calls.is_empty() && FEW * live.len() < graph.len() {
            // Of a large graph, what its nodes would need room for.
            let (excerpt, outputs) = graph.excerpt(&live, outputs);
            return Self::compile_anew(&excerpt, &outputs);
        }
        let arguments: Vec<Node> =
            calls.iter().flat_map(|(call, _)| graph.calls[*call].arguments.iter().copied()).collect();
        let mut builder = Builder::new(graph, &live, outputs, &arguments);
        let mut stages: Vec<Stage> = builder.turns(&live).into_iter().collect();
        for level in by_level(graph, calls) {
            let given = |(call, _): &UsedCall| graph.calls[*call].arguments.iter().copied();
            let arguments: Vec<Node> = level.iter().flat_map(given).collect();
            let operations = Arc::new(builder.instructions(&graph.ancestors(&arguments, |_| false)));
            stages.push(Stage { operations, turns: Turns::default(), batches: builder.batches(&level) });
        }
        let after_calls = builder.instructions(&live);
        builder.program(outputs, stages, after_calls)
    }
}

/// A call with the results that are used: number and node.
type UsedCall = (usize, Vec<(usize, Node)>);

/// Calls that need no other call, then those that need only these, and so on. A call comes after those it needs.
fn by_level(graph: &Graph, calls: Vec<UsedCall>) -> Vec<Vec<UsedCall>> {
    let mut level_of: FxHashMap<u32, usize> = FxHashMap::default();
    let mut levels: Vec<Vec<UsedCall>> = Vec::new();
    for used in calls {
        let call = used.0;
        // Behind another call is what that one has counted already.
        let feeding =
            graph.ancestors(&graph.calls[call].arguments, |node| matches!(graph.expr(node), Expr::Call { .. }));
        let below = feeding.iter().filter_map(|node| match graph.expr(*node) {
            Expr::Call { call, .. } => level_of.get(&call).map(|level| level + 1),
            _ => None,
        });
        let level = below.max().unwrap_or(0);
        level_of.insert(call as u32, level);
        if levels.len() <= level {
            levels.resize_with(level + 1, Vec::new);
        }
        levels[level].push(used);
    }
    levels
}

/// The calls among `live`, each with the results used, in order of the call.
fn used_calls(graph: &Graph, live: &[Node]) -> Vec<UsedCall> {
    let mut calls: FxHashMap<usize, Vec<(usize, Node)>> = FxHashMap::default();
    for node in live {
        if let Expr::Call { call, result } = graph.expr(*node) {
            calls.entry(call as usize).or_default().push((result as usize, *node));
        }
    }
    let mut list: Vec<_> = calls.into_iter().collect();
    list.sort_unstable_by_key(|(call, _)| *call);
    list
}

/// The nodes (ascending) in another order: functions that the processor calls, with all they need, before the rest. As machine
/// code every number must leave the processor's registers for a call; early there are few.
fn calls_first(graph: &Graph, nodes: &[Node]) -> Vec<Node> {
    let mut early = vec![false; nodes.last().map_or(0, |node| node.0 as usize + 1)];
    for node in nodes.iter().rev() {
        let called = matches!(
            graph.expr(*node),
            Expr::Sin(_)
                | Expr::Cos(_)
                | Expr::Atan2(..)
                | Expr::Exp(_)
                | Expr::Ln(_)
                | Expr::Tanh(_)
                | Expr::Powf(..)
                | Expr::Table { .. }
        );
        if called || early[node.0 as usize] {
            early[node.0 as usize] = true;
            if !matches!(graph.expr(*node), Expr::Call { .. }) {
                graph.operands(*node, |operand| early[operand.0 as usize] = true);
            }
        }
    }
    let (mut first, rest): (Vec<Node>, Vec<Node>) = nodes.iter().partition(|node| early[node.0 as usize]);
    first.extend(rest);
    first
}

/// How many times as many nodes a graph has as are compiled where few are.
const FEW: usize = 8;
/// Outputs that get registers side by side, in their order.
const MANY: usize = 8;
/// Inputs side by side that are copied one by one where there are fewer: machine code does so itself, two at a time.
const MANY_INPUTS: usize = 32;

/// An input: its slot and its register.
pub(super) type Loaded = (u32, Register);

/// Inputs side by side: first slot, first register, length.
pub(super) type LoadedRange = (u32, Register, u32);

/// Inputs (ascending) as ranges that lie side by side in slots and registers; and those of short ranges.
pub(super) fn in_ranges(inputs: &[Loaded]) -> (Vec<LoadedRange>, Vec<Loaded>) {
    let beside = |a: &Loaded, b: &Loaded| a.0 + 1 == b.0 && a.1 + 1 == b.1;
    let (long, short): (Vec<_>, Vec<_>) = inputs.chunk_by(beside).partition(|range| range.len() >= MANY_INPUTS);
    (long.into_iter().map(|range| (range[0].0, range[0].1, range.len() as u32)).collect(), short.concat())
}

/// No register.
const NONE: Register = Register::MAX;
/// Users of what keeps its register.
const HELD: u16 = u16::MAX;
/// With this bit, the register that a node is to be written to.
const RESERVED: Register = 1 << (Register::BITS - 1);

/// Gives out registers while instructions are written.
struct Builder<'g> {
    graph: &'g Graph,
    /// By node; [`NONE`] where it has none yet, [`RESERVED`] with that of an output that is still to be written.
    register_of: Vec<Register>,
    /// By node: how many users are still to come; [`HELD`] for outputs, call arguments and what has more.
    users: Vec<u16>,
    free: Vec<Register>,
    registers: Register,
    constants: Vec<f64>,
    inputs: Vec<(u32, Register)>,
    /// The first of as many registers as there are outputs, side by side in their order.
    block: Register,
}

impl<'g> Builder<'g> {
    fn new(graph: &'g Graph, live: &[Node], outputs: &[Node], arguments: &[Node]) -> Self {
        let end = live.last().map_or(0, |node| node.0 as usize + 1);
        let mut users = vec![0_u16; end];
        for node in live {
            if !matches!(graph.expr(*node), Expr::Call { .. }) {
                graph.operands(*node, |operand| {
                    let users = &mut users[operand.0 as usize];
                    *users = users.saturating_add(1);
                });
            }
        }
        for held in outputs.iter().chain(arguments) {
            users[held.0 as usize] = HELD;
        }
        let mut builder = Self {
            graph,
            register_of: vec![NONE; end],
            users,
            free: Vec::new(),
            registers: 0,
            constants: Vec::new(),
            inputs: Vec::new(),
            block: 0,
        };
        // Constants come first and are never overwritten; inputs follow.
        for node in live {
            if let Some(value) = graph.value(*node) {
                let register = builder.fresh();
                builder.constants.push(value);
                builder.register_of[node.0 as usize] = register;
                builder.users[node.0 as usize] = HELD;
            }
        }
        // In the order of their slots, so that they are copied many at a time.
        let slot = |node: &Node| if let Expr::Input(slot) = graph.expr(*node) { Some((slot, *node)) } else { None };
        let mut inputs: Vec<(u32, Node)> = live.iter().filter_map(slot).collect();
        inputs.sort_unstable_by_key(|(slot, _)| *slot);
        for (slot, node) in inputs {
            let register = builder.fresh();
            builder.inputs.push((slot, register));
            builder.register_of[node.0 as usize] = register;
        }
        builder.block = builder.registers;
        for node in outputs {
            let register = builder.fresh();
            if !builder.is_written(*node) {
                builder.register_of[node.0 as usize] = RESERVED | register;
            }
        }
        builder
    }

    /// The finished program.
    fn program(self, outputs: &[Node], stages: Vec<Stage>, after_calls: Vec<Instruction>) -> Program {
        let outputs: Arc<[Register]> = outputs.iter().map(|node| self.register_of[node.0 as usize]).collect();
        let (first, many) = (self.block as usize, outputs.len() >= MANY);
        let slots = outputs.iter().enumerate().map(|(slot, register)| (slot as u32, *register));
        let is_elsewhere = |(slot, register): &(u32, Register)| many && self.block + slot != *register;
        let (input_ranges, single_inputs) = in_ranges(&self.inputs);
        Program {
            id: Program::next_id(),
            block: first..first + if many { outputs.len() } else { 0 },
            elsewhere: slots.filter(is_elsewhere).collect(),
            outputs,
            passed: Vec::new(),
            kept: Vec::new(),
            constants: self.constants,
            input_ranges,
            single_inputs,
            taken: self.inputs.iter().map(|(slot, _)| *slot).collect(),
            inputs: self.inputs,
            stages,
            after_calls: Arc::new(after_calls),
            registers: self.registers as usize,
            tables: self.graph.tables.clone(),
            code: None,
        }
    }

    /// Whether a node has its number already.
    fn is_written(&self, node: Node) -> bool {
        self.register_of[node.0 as usize] & RESERVED == 0
    }

    fn fresh(&mut self) -> Register {
        self.registers += 1;
        self.registers - 1
    }

    fn take(&mut self) -> Register {
        self.free.pop().unwrap_or_else(|| self.fresh())
    }

    /// Sines and cosines that need no others, with what feeds them.
    fn turns(&mut self, live: &[Node]) -> Option<Stage> {
        let found = first_angles(self.graph, live);
        if found.is_empty() {
            return None;
        }
        let angles: Vec<Node> = found.iter().map(|(angle, _)| *angle).collect();
        let operations = Arc::new(self.instructions(&self.graph.ancestors(&angles, |_| false)));
        let lanes = lanes(angles.len());
        // Angles, sines, cosines.
        let first = self.registers + lanes as Register;
        self.registers += 3 * lanes as Register;
        let mut used = 0;
        for (place, (_, both)) in found.iter().enumerate() {
            for (node, from) in both.iter().zip([0, lanes]) {
                if let Some(node) = node {
                    // Results keep their register for the rest of the program.
                    self.register_of[node.0 as usize] = first + (from + place) as Register;
                    self.users[node.0 as usize] = HELD;
                    used += 1;
                }
            }
        }
        let angles = angles.iter().map(|angle| self.register_of[angle.0 as usize]).collect();
        Some(Stage { operations, turns: Turns { angles, first, lanes, used }, batches: Vec::new() })
    }

    fn instructions(&mut self, nodes: &[Node]) -> Vec<Instruction> {
        let mut operands = Vec::with_capacity(4);
        let open: Vec<Node> =
            calls_first(self.graph, nodes).into_iter().filter(|node| !self.is_written(*node)).collect();
        let mut list = Vec::with_capacity(open.len());
        for (node, turned) in pairs_together(self.graph, &open) {
            let expr = self.graph.expr(node);
            if matches!(expr, Expr::Call { .. }) {
                continue;
            }
            // Operands that nobody else needs give back their register, which the result may take at once.
            operands.clear();
            self.graph.operands(node, |operand| operands.push(operand));
            let mut at = [NONE; 4];
            for (operand, register) in operands.iter().zip(&mut at) {
                *register = self.register_of[operand.0 as usize];
            }
            for (operand, register) in operands.iter().zip(&at) {
                let users = &mut self.users[operand.0 as usize];
                if *users != HELD {
                    *users -= 1;
                    if *users == 0 {
                        self.free.push(*register);
                    }
                }
            }
            let d = match self.register_of[node.0 as usize] {
                NONE => self.take(),
                reserved => reserved & !RESERVED,
            };
            self.register_of[node.0 as usize] = d;
            list.push(match expr {
                Expr::Add(..) => Instruction::Add(d, at[0], at[1]),
                Expr::Sub(..) => Instruction::Sub(d, at[0], at[1]),
                Expr::Mul(..) => Instruction::Mul(d, at[0], at[1]),
                Expr::Div(..) => Instruction::Div(d, at[0], at[1]),
                Expr::Neg(_) => Instruction::Neg(d, at[0]),
                Expr::Sqrt(_) => Instruction::Sqrt(d, at[0]),
                Expr::Sin(_) if turned => Instruction::Turn(d, at[0]),
                Expr::Cos(_) if turned => Instruction::Turned(d, at[0]),
                Expr::Sin(_) => Instruction::Sin(d, at[0]),
                Expr::Cos(_) => Instruction::Cos(d, at[0]),
                Expr::Atan2(..) => Instruction::Atan2(d, at[0], at[1]),
                Expr::Exp(_) => Instruction::Exp(d, at[0]),
                Expr::Ln(_) => Instruction::Ln(d, at[0]),
                Expr::Tanh(_) => Instruction::Tanh(d, at[0]),
                Expr::Powi(_, n) => Instruction::Powi(d, at[0], n),
                Expr::Powf(_, bits) => Instruction::Powf(d, Box::new((at[0], f64::from_bits(bits)))),
                Expr::Select(..) => Instruction::Select(d, Box::new(at)),
                Expr::Table { table, order, .. } => Instruction::Table(d, at[0], table, order as u16),
                Expr::Constant(_) | Expr::Input(_) | Expr::Call { .. } => continue,
            });
        }
        list
    }

    /// One batch per set and per length of results.
    fn batches(&mut self, calls: &[UsedCall]) -> Vec<BatchPlan> {
        let mut batches: Vec<BatchPlan> = Vec::new();
        let mut key_of: Vec<(usize, usize)> = Vec::new();
        for (call, used) in calls {
            let description = &self.graph.calls[*call];
            let key = (description.set, description.results);
            let position = key_of.iter().position(|known| *known == key).unwrap_or_else(|| {
                key_of.push(key);
                batches.push(BatchPlan {
                    set: description.set,
                    instances: Vec::new(),
                    wanted: Wanted { jacobian: false, second: false },
                    arguments: Vec::new(),
                    results: Vec::new(),
                });
                batches.len() - 1
            });
            let mut results = vec![None; description.results];
            for (result, node) in used {
                // Results keep their register for the rest of the program.
                let register = self.fresh();
                self.register_of[node.0 as usize] = register;
                self.users[node.0 as usize] = HELD;
                results[*result] = Some(register);
                let batch = &mut batches[position];
                batch.wanted.jacobian |= (description.jacobian_from..description.second_from).contains(result);
                batch.wanted.second |= (description.second_from..description.second_to).contains(result);
            }
            let batch = &mut batches[position];
            batch.instances.push(description.instance);
            batch.arguments.extend(description.arguments.iter().map(|node| self.register_of[node.0 as usize]));
            batch.results.extend(results);
        }
        batches
    }
}
