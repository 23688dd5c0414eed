//! A program as machine code against itself interpreted.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{MachineCode, Maker, Program};

/// Equal bits, or both not a number: which of the many is nobody's business.
#[track_caller]
pub(super) fn assert_same(machine: &[f64], interpreted: &[f64]) {
    for (k, (a, b)) in machine.iter().zip(interpreted).enumerate() {
        assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "output {k}: {a:e} instead of {b:e}");
    }
}

/// Who makes the machine code.
#[derive(Debug, Clone, Copy)]
pub(super) enum By {
    Assembler,
    /// Cranelift, in pieces of so many operations.
    Cranelift(usize),
}

/// Those that there are here: Cranelift with the feature `cranelift`, or where there is no assembler.
pub(super) fn makers(pieces: &[usize]) -> Vec<By> {
    let assembler = MachineCode::can_assemble().then_some(By::Assembler);
    let compiler = pieces.iter().filter(|_| MachineCode::can_compile()).map(|piece| By::Cranelift(*piece));
    assembler.into_iter().chain(compiler).collect()
}

/// A program of the same outputs that runs as machine code.
pub(super) fn by_machine(program: &Program, maker: By) -> Program {
    let mut program = program.clone();
    let never = AtomicBool::new(false);
    let code = match maker {
        By::Assembler => MachineCode::compile(&program, Maker::Assembler, &never),
        By::Cranelift(piece) => MachineCode::in_pieces(&program, &never, piece),
    };
    let code = code.unwrap();
    assert!(code.bytes() > 0 || program.operations() == 0);
    program.install(Arc::new(code));
    assert!(program.is_machine_code());
    program
}
