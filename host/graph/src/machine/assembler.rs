//! Machine code in one pass, for x86-64 with AVX on systems with the System V calling convention.
//!
//! A list of operations has no branches, so that the next use of every number is known when it is computed. Numbers stay in
//! the processor's registers as long as there is room; the one whose next use is farthest makes way (Belady 1966), into the
//! register of the workspace that the list gives it anyway. What is in the workspace already is read from there, mostly as
//! the operand of the instruction that needs it.
//!
//! Each list is gone through twice: backwards for the next uses ([`uses`]), then forwards, writing ([`writer`]). A value is known by
//! its register of the workspace: before another one is written there, it has been read for the last time.
//!
//! Where no opaque element is called between them, the lists of a program are one function, which has sines and cosines computed on
//! the way.

mod copies;
mod room;
mod uses;
mod writer;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::super::costs::MachineError;
use super::super::tape::{Instruction, Program};
use super::calls::{INLINE_POWER, Pair, atan2, cos, exp, ln, sin, sin_cos, tanh};
use super::encoder::Code;
use super::{Made, Piece, liveness};
use copies::Copies;
pub(super) use copies::copied;
use room::Room;
use uses::Lookout;
use writer::Writer;

/// The mapping that the code lies in, with that of all programs made together; none for no code.
pub(super) type Memory = Option<Arc<memmap2::Mmap>>;

/// Functions begin at multiples of this, bytes.
const ALIGNMENT: usize = 16;

/// Whether this machine runs what the assembler makes.
pub(super) fn is_available() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    return std::arch::is_x86_feature_detected!("avx");
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

/// Makes the functions of programs, all in one mapping. `cancel` is looked at between lists.
pub(super) fn make(programs: &[&Program], cancel: &AtomicBool) -> Result<Vec<Made<Memory>>, MachineError> {
    if !is_available() {
        return Err(MachineError::Unavailable);
    }
    let refused = |error: std::io::Error| MachineError::Refused(format!("no memory for machine code: {error}"));
    let mut code = Code::with_room_for(programs.iter().map(|program| program.listed()).sum()).map_err(refused)?;
    let registers = programs.iter().map(|program| program.registers).max().unwrap_or(0);
    let mut lookout = Lookout::new(registers);
    let mut room = Room::new(registers);
    let mut places = Vec::with_capacity(programs.len());
    for program in programs {
        let from = code.bytes().len();
        lookout.begin(program);
        liveness::backwards(program, |number, list, live| {
            if cancel.load(Ordering::Relaxed) {
                return Err(MachineError::Cancelled);
            }
            lookout.look(number, list, program.tables.len(), live);
            Ok(())
        })?;
        places.push((functions(program, &lookout, &mut room, &mut code), code.bytes().len() - from));
    }
    let memory = if code.bytes().is_empty() { None } else { Some(Arc::new(code.finish().map_err(refused)?)) };
    let piece = |entry: usize| {
        let memory = memory.as_ref().expect("what has an entry has a mapping");
        // SAFETY: `functions` put a function of this signature and of the System V calling convention there; the mapping may be
        // run, and lives as long as the last `MachineCode` in it.
        unsafe { std::mem::transmute::<*const u8, Piece>(memory[entry..].as_ptr()) }
    };
    let lists = |entries: Vec<Option<usize>>| entries.into_iter().map(|entry| entry.map(piece).into_iter().collect());
    Ok(places.into_iter().map(|(entries, bytes)| (lists(entries).collect(), bytes, memory.clone())).collect())
}

/// Writes the functions of a program; gives where each begins: one for all lists, or one for each that has something to do.
fn functions(program: &Program, lookout: &Lookout, room: &mut Room, code: &mut Code) -> Vec<Option<usize>> {
    let copied = copied(program);
    let lists: Vec<_> = program.lists().enumerate().collect();
    room.take(program, copied);
    let per_function = if copied.whole { lists.len() } else { 1 };
    let function = |lists: &[(usize, &[Instruction])]| {
        let copies = || lists.iter().map(|(number, _)| Copies::of(program, *number));
        if lists.iter().all(|(_, list)| list.is_empty()) && copies().all(|copies| copies.is_empty()) {
            return None;
        }
        let entry = code.align(ALIGNMENT);
        let calls = lists.iter().any(|(_, list)| list.iter().any(|instruction| called(instruction).is_some()))
            || copied.whole && copies().any(|copies| copies.turns.is_some());
        let mut writer = Writer::new(code, room, lookout.choices(), calls);
        for ((number, list), copies) in lists.iter().zip(copies()) {
            writer.list(list, lookout.of(*number), &copies, copied.whole);
        }
        writer.end();
        Some(entry)
    };
    lists.chunks(per_function).map(function).collect()
}

/// Functions that are called, by what they take besides numbers.
enum Called {
    One(extern "C" fn(f64) -> f64),
    Both(extern "C" fn(f64) -> Pair),
    Two(extern "C" fn(f64, f64) -> f64),
    Power(f64),
    Whole(i32),
    Table(u32, u32),
}

/// What is called for an operation that is no instruction of the processor.
fn called(instruction: &Instruction) -> Option<Called> {
    match *instruction {
        Instruction::Sin(..) => Some(Called::One(sin)),
        Instruction::Cos(..) => Some(Called::One(cos)),
        Instruction::Turn(..) => Some(Called::Both(sin_cos)),
        Instruction::Exp(..) => Some(Called::One(exp)),
        Instruction::Ln(..) => Some(Called::One(ln)),
        Instruction::Tanh(..) => Some(Called::One(tanh)),
        Instruction::Atan2(..) => Some(Called::Two(atan2)),
        Instruction::Powf(_, ref power) => Some(Called::Power(power.1)),
        Instruction::Powi(_, _, n) if n.unsigned_abs() > INLINE_POWER => Some(Called::Whole(n)),
        Instruction::Table(_, _, table, order) => Some(Called::Table(table, u32::from(order))),
        _ => None,
    }
}
