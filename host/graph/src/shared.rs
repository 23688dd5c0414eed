//! [`SharedCode`]: machine code for all programs of one structure.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::costs::Maker;
use super::machine::MachineCode;
use super::tape::{Program, Stage, Used};

/// Structures beyond which no others are kept: programs that do not come again need no code in store.
const MOST: usize = 256;

/// Machine code that runs share whose programs have the same structure: the same operations on the same registers, whatever
/// the constants, which machine code reads from the workspace. Copies share what they hold. What does not pay within one run
/// pays once several have run it often enough.
#[derive(Debug, Clone, Default)]
pub struct SharedCode(Arc<Mutex<Vec<Kept>>>);

/// A structure.
#[derive(Debug)]
struct Kept {
    /// A program that has it.
    program: Program,
    /// How often programs that have it were run without code.
    runs: u64,
    code: Option<Arc<MachineCode>>,
}

impl SharedCode {
    /// Code that does what a program does, if there is any.
    #[must_use]
    pub fn find(&self, program: &Program) -> Option<Arc<MachineCode>> {
        self.kept().iter().find(|kept| same_structure(&kept.program, program))?.code.clone()
    }

    /// Takes the programs of a run that has ended, and makes code for those structures that have been run so often by now that
    /// it would have paid.
    pub fn learn(&self, maker: Maker, programs: Vec<Used<'_>>) {
        for used in programs.into_iter().filter(|used| used.runs > 0 && used.program.listed() > 0) {
            let mut kept = self.kept();
            let known = kept.iter().position(|kept| same_structure(&kept.program, used.program));
            let at = match known {
                Some(at) => at,
                None if kept.len() < MOST => {
                    kept.push(Kept { program: used.program.clone(), runs: 0, code: None });
                    kept.len() - 1
                }
                None => continue,
            };
            let kept = &mut kept[at];
            if kept.code.is_some() {
                continue;
            }
            kept.code.clone_from(&used.program.code);
            kept.runs += used.runs;
            if kept.code.is_none() && kept.runs as f64 >= maker.runs_that_pay(used.program.listed()) {
                // Without code it is interpreted, as before.
                kept.code = MachineCode::compile(used.program, maker, &AtomicBool::new(false)).ok().map(Arc::new);
            }
        }
    }

    fn kept(&self) -> MutexGuard<'_, Vec<Kept>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether the machine code of one program does what the other one does: all that code is made from is the same.
fn same_structure(a: &Program, b: &Program) -> bool {
    let stage = |(a, b): (&Stage, &Stage)| {
        let turns = |stage: &Stage| (stage.turns.first, stage.turns.lanes);
        let batches = a.batches.iter().zip(&b.batches);
        turns(a) == turns(b)
            && a.turns.angles == b.turns.angles
            && a.batches.len() == b.batches.len()
            && batches.into_iter().all(|(a, b)| a.arguments == b.arguments && a.results == b.results)
            && a.operations == b.operations
    };
    a.registers == b.registers
        && a.tables.len() == b.tables.len()
        && a.stages.len() == b.stages.len()
        && a.inputs == b.inputs
        && a.outputs == b.outputs
        && a.passed == b.passed
        && a.kept == b.kept
        && a.block == b.block
        && a.after_calls == b.after_calls
        && a.stages.iter().zip(&b.stages).all(stage)
}
