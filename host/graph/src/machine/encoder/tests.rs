//! The bytes of instructions, against those of Cranelift's assembler.

use cranelift_assembler_x64::{Amode, AmodeOffset, AmodeOffsetPlusKnownOffset, Registers, XmmMem, inst};

use super::*;

#[derive(Debug, Clone, Copy)]
struct Numbered;

impl Registers for Numbered {
    type ReadGpr = u8;
    type ReadWriteGpr = u8;
    type WriteGpr = u8;
    type ReadXmm = u8;
    type ReadWriteXmm = u8;
    type WriteXmm = u8;
}

/// What one of them writes.
fn bytes(write: impl FnOnce(&mut Code)) -> Vec<u8> {
    let mut code = Code::with_room_for(0).expect("memory");
    code.make_room();
    write(&mut code);
    code.bytes().to_vec()
}

macro_rules! encoded {
    ($($instruction:ident($($operand:expr),*);)*) => {{
        let mut bytes: Vec<u8> = Vec::new();
        $(inst::$instruction::<Numbered>::new($($operand),*).encode(&mut bytes);)*
        bytes
    }};
}

fn places() -> Vec<Place> {
    let offsets = [0, 8, 120, 128, 1024, -8, -128, -136, 1 << 30];
    let memory =
        [RDI, RBX, RDX, RCX, RBP].into_iter().flat_map(|base| offsets.map(|offset| Place::Memory { base, offset }));
    (0..16).map(Place::Vector).chain(memory).collect()
}

fn location(place: Place) -> XmmMem<u8, u8> {
    match place {
        Place::Vector(register) => XmmMem::Xmm(register),
        Place::Memory { base, offset } => {
            let simm32 = AmodeOffsetPlusKnownOffset { simm32: AmodeOffset::new(offset), offset: None };
            XmmMem::Mem(Amode::ImmReg { base, simm32, trap: None })
        }
    }
}

#[test]
fn instructions_on_vectors() {
    for (to, first) in (0..16).flat_map(|to| (0..16).map(move |first| (to, first))) {
        for place in places() {
            let written = |operation| bytes(|code| code.vector(operation, to, first, place));
            let at = || location(place);
            assert_eq!(written(Operation::of_numbers(0x5C)), encoded! { vsubsd_b(to, first, at()); });
            assert_eq!(written(Operation::of_numbers(0x5E)), encoded! { vdivsd_b(to, first, at()); });
            assert_eq!(written(Operation::SQRT), encoded! { vsqrtsd_b(to, first, at()); });
            let mut compared = written(Operation::COMPARE);
            compared.push(1);
            assert_eq!(compared, encoded! { vcmpsd_b(to, first, at(), 1); });
            let mut blended = written(Operation::BLEND);
            blended.push(to << 4);
            assert_eq!(blended, encoded! { vblendvpd_rvmr(to, first, at(), to); });
            assert_eq!(written(Operation::of_numbers(0x58)), encoded! { vaddsd_b(to, first, at()); });
            assert_eq!(written(Operation::of_numbers(0x59)), encoded! { vmulsd_b(to, first, at()); });
            assert_eq!(written(Operation::XOR), encoded! { vxorpd_b(to, first, at()); });
        }
    }
}

#[test]
fn moves() {
    for to in 0..16 {
        for place in places() {
            let written = |operation| bytes(|code| code.vector(operation, to, 0, place));
            match location(place) {
                XmmMem::Xmm(from) => {
                    assert_eq!(written(Operation::COPY), encoded! { vmovapd_a(to, from); });
                }
                XmmMem::Mem(at) => {
                    assert_eq!(written(Operation::LOAD), encoded! { vmovsd_d(to, at); });
                    assert_eq!(written(Operation::STORE), encoded! { vmovsd_c_m(at, to); });
                    assert_eq!(written(Operation::LOAD_TWO), encoded! { vmovupd_a(to, location(place)); });
                    assert_eq!(written(Operation::STORE_TWO), encoded! { vmovupd_b(location(place), to); });
                }
            }
        }
        let constant = encoded! { movabsq_oi(0, (-0.3_f64).to_bits()); vmovq_a(to, 0); };
        assert_eq!(bytes(|code| code.constant(to, -0.3)), constant);
    }
}

#[test]
fn calls() {
    let entered =
        encoded! { pushq_o(RBX); pushq_o(12); pushq_o(RBP); movq_rm(RBX, RDI); movq_rm(12, 6); movq_rm(RBP, RCX); };
    assert_eq!(bytes(Code::enter), entered);
    let mut left = encoded! { popq_o(RBP); popq_o(12); popq_o(RBX); };
    inst::retq_zo::new().encode(&mut left);
    assert_eq!(
        bytes(|code| {
            code.leave();
            code.ret();
        }),
        left
    );
    let called = encoded! { movabsq_oi(0, 0x1234_5678_9ABC_u64); callq_m(0); };
    assert_eq!(bytes(|code| code.call(0x1234_5678_9ABC)), called);
    assert_eq!(bytes(|code| code.load_edi(-11)), encoded! { movl_oi(RDI, -11); });
    let at = Amode::ImmReg {
        base: RBX,
        simm32: AmodeOffsetPlusKnownOffset { simm32: AmodeOffset::new(4096), offset: None },
        trap: None,
    };
    let placed = encoded! { leaq_rm(RDI, at); movl_oi(6, 12_u32); };
    assert_eq!(bytes(|code| code.load_place(4096, 12)), placed);
    let looked_up = encoded! { movq_rm(RDI, 12); movl_oi(6, 3_u32); movl_oi(2, 70_000_u32); };
    assert_eq!(bytes(|code| code.load_table(3, 70_000)), looked_up);
}
