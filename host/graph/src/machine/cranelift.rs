//! Machine code by Cranelift.
//!
//! Long lists are cut into functions of [`PIECE`] operations, since the cost of compiling a function grows faster than its
//! length; numbers that outlive a function stay in the workspace.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use cranelift_codegen::ir::{AbiParam, InstBuilder, MemFlagsData, SigRef, Value, condcodes::FloatCC, types};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Module, ModuleError};

use super::super::costs::MachineError;
use super::super::tape::{Instruction, Program, Register};
use super::calls::{INLINE_POWER, atan2, cos, exp, ln, look_up, powf, powi, sin, tanh};
use super::{Made, Piece, liveness};

/// Operations per function. Measured on the right sides of the benchmark scenes (x86-64, 600 to 1800 operations): 64 cost
/// as much to compile and run slower, 1024 take 1.4 times as long to compile and run equally fast.
pub(super) const PIECE: usize = 256;

/// Cranelift's settings. `opt_level` speed takes 1.4 times as long to compile and its code is not faster: the graph has
/// folded and shared already what could be. The single-pass register allocator saves no time and its code takes twice as
/// long to run.
const FLAGS: [(&str, &str); 3] =
    [("opt_level", "none"), ("regalloc_algorithm", "backtracking"), ("enable_verifier", "false")];

/// The memory of the functions; taken when it is given back.
pub(super) struct Memory(Mutex<Option<JITModule>>);

impl Drop for Memory {
    fn drop(&mut self) {
        let module = self.0.get_mut().ok().and_then(Option::take);
        if let Some(module) = module {
            // SAFETY: the functions are called through the `MachineCode` that holds this only, which nobody holds any more.
            unsafe { module.free_memory() };
        }
    }
}

/// Whether it makes code for this machine.
pub(super) fn is_available() -> bool {
    cfg!(any(target_arch = "x86_64", target_arch = "aarch64"))
}

/// Makes the functions of a program, of `piece` operations. `cancel` is looked at between functions.
pub(super) fn make(program: &Program, cancel: &AtomicBool, piece: usize) -> Result<Made<Memory>, MachineError> {
    if !is_available() {
        return Err(MachineError::Unavailable);
    }
    let builder = JITBuilder::with_flags(&FLAGS, cranelift_module::default_libcall_names());
    let mut maker = Maker {
        module: JITModule::new(builder.map_err(refused)?),
        frontend: FunctionBuilderContext::new(),
        piece,
        bytes: 0,
    };
    let functions = maker.functions(program, cancel);
    let finished = functions.and_then(|lists| {
        maker.module.finalize_definitions().map_err(refused)?;
        Ok(lists)
    });
    let Maker { module, bytes, .. } = maker;
    let functions = match finished {
        Ok(functions) => functions,
        Err(error) => {
            // SAFETY: no function of this module has been handed out.
            unsafe { module.free_memory() };
            return Err(error);
        }
    };
    let piece = |id: &FuncId| {
        let address = module.get_finalized_function(*id);
        // SAFETY: the function was made by `Maker::function` with just this signature and calling convention, and the
        // memory it lies in lives as long as the `Memory`.
        unsafe { std::mem::transmute::<*const u8, Piece>(address) }
    };
    let lists = functions.iter().map(|list| list.iter().map(piece).collect()).collect();
    Ok((lists, bytes, Memory(Mutex::new(Some(module)))))
}

/// Makes functions.
struct Maker {
    module: JITModule,
    frontend: FunctionBuilderContext,
    /// Operations per function.
    piece: usize,
    bytes: usize,
}

impl Maker {
    /// All functions of a program, by list.
    fn functions(&mut self, program: &Program, cancel: &AtomicBool) -> Result<Vec<Vec<FuncId>>, MachineError> {
        let mut made: Vec<Vec<FuncId>> = vec![Vec::new(); program.lists().count()];
        liveness::backwards(program, |number, list, live| {
            check(list, program);
            let mut functions: Vec<FuncId> = Vec::new();
            for instructions in list.rchunks(self.piece) {
                if cancel.load(Ordering::Relaxed) {
                    return Err(MachineError::Cancelled);
                }
                let stored = stored(instructions, live);
                functions.push(self.function(instructions, &stored, program.registers)?);
                before(instructions, live);
            }
            functions.reverse();
            made[number] = functions;
            Ok(())
        })?;
        Ok(made)
    }

    fn function(
        &mut self,
        instructions: &[Instruction],
        stored: &[bool],
        registers: usize,
    ) -> Result<FuncId, MachineError> {
        let pointer = self.module.target_config().pointer_type();
        let mut context = self.module.make_context();
        // Registers, tables; inputs and outputs, which are copied around it.
        context.func.signature.params.extend([AbiParam::new(pointer); 4]);
        let mut builder = FunctionBuilder::new(&mut context.func, &mut self.frontend);
        let block = builder.create_block();
        builder.append_block_params_for_function_params(block);
        builder.switch_to_block(block);
        builder.seal_block(block);
        let (x, tables) = (builder.block_params(block)[0], builder.block_params(block)[1]);
        let call_convention = self.module.target_config().default_call_conv;
        let mut body =
            Body { builder, x, tables, call_convention, pointer, values: vec![None; registers], signatures: [None; 4] };
        for (instruction, stored) in instructions.iter().zip(stored) {
            body.write(instruction, *stored);
        }
        body.builder.ins().return_(&[]);
        body.builder.finalize(self.module.target_config());
        let function = self.module.declare_anonymous_function(&context.func.signature).map_err(refused)?;
        self.module.define_function(function, &mut context).map_err(refused)?;
        self.bytes += context.compiled_code().map_or(0, |code| code.code_buffer().len());
        Ok(function)
    }
}

/// The function being written.
struct Body<'f> {
    builder: FunctionBuilder<'f>,
    x: Value,
    tables: Value,
    pointer: types::Type,
    call_convention: cranelift_codegen::isa::CallConv,
    /// Values of registers that this function has computed.
    values: Vec<Option<Value>>,
    signatures: [Option<SigRef>; 4],
}

/// Functions that are called, by what they take besides and return a number.
#[derive(Clone, Copy)]
enum Shape {
    One,
    Two,
    Whole,
    Table,
}

impl Body<'_> {
    fn read(&mut self, register: Register) -> Value {
        if let Some(value) = self.values[register as usize] {
            return value;
        }
        // Read anew at each use: cheaper to compile, and no slower, than keeping it.
        self.builder.ins().load(types::F64, MemFlagsData::trusted(), self.x, offset(register))
    }

    fn write(&mut self, instruction: &Instruction, stored: bool) {
        let value = match *instruction {
            Instruction::Add(_, a, b) => {
                let (a, b) = (self.read(a), self.read(b));
                self.builder.ins().fadd(a, b)
            }
            Instruction::Sub(_, a, b) => {
                let (a, b) = (self.read(a), self.read(b));
                self.builder.ins().fsub(a, b)
            }
            Instruction::Mul(_, a, b) => {
                let (a, b) = (self.read(a), self.read(b));
                self.builder.ins().fmul(a, b)
            }
            Instruction::Div(_, a, b) => {
                let (a, b) = (self.read(a), self.read(b));
                self.builder.ins().fdiv(a, b)
            }
            Instruction::Neg(_, a) => {
                let a = self.read(a);
                self.builder.ins().fneg(a)
            }
            Instruction::Sqrt(_, a) => {
                let a = self.read(a);
                self.builder.ins().sqrt(a)
            }
            Instruction::Select(_, ref all) => {
                let [a, b, c, d] = all.map(|register| self.read(register));
                // Ordered: false where one of them is not a number, as in Rust.
                let less = self.builder.ins().fcmp(FloatCC::LessThan, a, b);
                self.builder.ins().select(less, c, d)
            }
            // Apart: not every calling convention returns two numbers in registers.
            Instruction::Sin(_, a) | Instruction::Turn(_, a) => self.call_one(sin, a),
            Instruction::Cos(_, a) | Instruction::Turned(_, a) => self.call_one(cos, a),
            Instruction::Exp(_, a) => self.call_one(exp, a),
            Instruction::Ln(_, a) => self.call_one(ln, a),
            Instruction::Tanh(_, a) => self.call_one(tanh, a),
            Instruction::Atan2(_, a, b) => {
                let arguments = [self.read(a), self.read(b)];
                self.call(Shape::Two, atan2 as *const () as usize, &arguments)
            }
            Instruction::Powf(_, ref power) => {
                let arguments = [self.read(power.0), self.builder.ins().f64const(power.1)];
                self.call(Shape::Two, powf as *const () as usize, &arguments)
            }
            Instruction::Powi(_, a, n) if n.unsigned_abs() <= INLINE_POWER => self.power(a, n),
            Instruction::Powi(_, a, n) => {
                let arguments = [self.read(a), self.builder.ins().iconst(types::I32, i64::from(n as u32))];
                self.call(Shape::Whole, powi as *const () as usize, &arguments)
            }
            Instruction::Table(_, a, table, order) => {
                let whole = |body: &mut Self, n: u32| body.builder.ins().iconst(types::I32, i64::from(n));
                let arguments = [self.read(a), self.tables, whole(self, table), whole(self, u32::from(order))];
                self.call(Shape::Table, look_up as *const () as usize, &arguments)
            }
        };
        let register = instruction.result();
        if stored {
            self.builder.ins().store(MemFlagsData::trusted(), value, self.x, offset(register));
        }
        self.values[register as usize] = Some(value);
    }

    /// The products that `f64::powi` forms (`__powidf2` of the compiler's run time): squares, multiplied where the
    /// exponent has a bit; then the reciprocal of a negative power.
    fn power(&mut self, a: Register, n: i32) -> Value {
        let mut square = self.read(a);
        let mut product: Option<Value> = None;
        let mut bits = n.unsigned_abs();
        while bits != 0 {
            if bits & 1 == 1 {
                product = Some(product.map_or(square, |product| self.builder.ins().fmul(product, square)));
            }
            bits >>= 1;
            if bits != 0 {
                square = self.builder.ins().fmul(square, square);
            }
        }
        let product = product.unwrap_or_else(|| self.builder.ins().f64const(1.0));
        if n >= 0 {
            return product;
        }
        let one = self.builder.ins().f64const(1.0);
        self.builder.ins().fdiv(one, product)
    }

    fn call_one(&mut self, function: extern "C" fn(f64) -> f64, a: Register) -> Value {
        let a = self.read(a);
        self.call(Shape::One, function as *const () as usize, &[a])
    }

    fn call(&mut self, shape: Shape, address: usize, arguments: &[Value]) -> Value {
        let signature = self.signature(shape);
        let address = self.builder.ins().iconst(self.pointer, address as i64);
        let call = self.builder.ins().call_indirect(signature, address, arguments);
        self.builder.inst_results(call)[0]
    }

    fn signature(&mut self, shape: Shape) -> SigRef {
        if let Some(signature) = self.signatures[shape as usize] {
            return signature;
        }
        let mut signature = cranelift_codegen::ir::Signature::new(self.call_convention);
        let parameters: &[types::Type] = match shape {
            Shape::One => &[types::F64],
            Shape::Two => &[types::F64, types::F64],
            Shape::Whole => &[types::F64, types::I32],
            Shape::Table => &[types::F64, self.pointer, types::I32, types::I32],
        };
        signature.params.extend(parameters.iter().map(|t| AbiParam::new(*t)));
        signature.returns.push(AbiParam::new(types::F64));
        let reference = self.builder.import_signature(signature);
        self.signatures[shape as usize] = Some(reference);
        reference
    }
}

fn refused(error: ModuleError) -> MachineError {
    MachineError::Refused(error.to_string())
}

/// Place of a register in the workspace, bytes.
fn offset(register: Register) -> i32 {
    i32::try_from(u64::from(register) * 8).expect("fewer than 2^28 registers")
}

/// Which instructions must leave their result in the workspace: the last ones to write a register that is read later.
fn stored(instructions: &[Instruction], live_after: &[bool]) -> Vec<bool> {
    let mut wanted = live_after.to_vec();
    let mut stored: Vec<bool> = instructions
        .iter()
        .rev()
        .map(|instruction| std::mem::take(&mut wanted[instruction.result() as usize]))
        .collect();
    stored.reverse();
    stored
}

/// Turns the registers read after the instructions into those read by them or after.
fn before(instructions: &[Instruction], live: &mut [bool]) {
    for instruction in instructions.iter().rev() {
        live[instruction.result() as usize] = false;
        instruction.operands(|register| live[register as usize] = true);
    }
}

/// The instructions of a program are its own work; that they stay within it is what the machine code relies on.
fn check(instructions: &[Instruction], program: &Program) {
    let within = |register: Register| assert!((register as usize) < program.registers, "a register too many");
    for instruction in instructions {
        within(instruction.result());
        instruction.operands(within);
        if let Instruction::Table(_, _, table, _) = instruction {
            assert!((*table as usize) < program.tables.len(), "a table too many");
        }
    }
}
