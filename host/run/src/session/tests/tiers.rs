//! Machine code and interpreter: the same run bit for bit, and machine code only where that pays.

use std::thread::sleep;
use std::time::Duration;

use super::*;
use crate::program::{Graph, MachineCode, Maker, Program, Used, Workspace};
use crate::session::Tier;

/// A run of the scene with an engine, its step sizes and samples chosen for many steps.
#[track_caller]
fn with_engine(text: &str, engine: &str) -> RunReport {
    let outputs = (0..3).map(|k| {
        let axis = ["x", "y", "z"][k];
        output(axis, &format!("quantity = \"position\"; of = \"{}\"; component = \"{axis}\"", body(text)))
    });
    let text = text.replace("t_end = 1\n", &format!("t_end = 1\nengine = \"{engine}\"\n"));
    run(&(text + &outputs.collect::<String>()))
}

fn body(text: &str) -> &'static str {
    if text.contains("\"coupler\"") { "coupler" } else { "b" }
}

#[test]
fn every_engine_of_the_working_form_takes_the_same_steps_to_the_same_bits() {
    for text in [scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.1)] {
        let interpreted = with_engine(&text, "interpreted");
        assert_eq!(interpreted.summary.machine_code_programs, 0);
        assert!(interpreted.summary.engine.starts_with("interpreted, "), "{}", interpreted.summary.engine);
        for engine in ["auto", "compiled"] {
            let other = with_engine(&text, engine);
            assert_eq!(other.columns, interpreted.columns, "{engine}");
            let work = |report: &RunReport| {
                let s = &report.summary;
                (s.steps, s.rejected, s.evaluations, s.factorisations, s.recoveries, s.position_corrections)
            };
            assert_eq!((work(&other), other.summary.audit), (work(&interpreted), interpreted.summary.audit));
            if engine == "compiled" {
                let summary = &other.summary;
                assert!(summary.engine.starts_with("compiled, "), "{}", summary.engine);
                assert!(summary.machine_code_programs >= 2 && summary.machine_code_bytes > 1000);
                assert_eq!(summary.machine_code_from, Some(0.0));
                assert!(summary.machine_code_time_s <= summary.compile_time_s);
            }
        }
    }
}

#[test]
fn runs_that_share_code_are_those_alone() {
    let common = Common::default();
    let mut code = Vec::new();
    // Variants of one mechanism, then others, then the first again.
    let angles = [1.1, 1.0, 0.9, 1.3, 1.1];
    let texts = angles.map(scenes::four_bar).into_iter();
    for text in texts.chain([scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.1)]) {
        for engine in ["auto", "compiled"] {
            let text = text.replace("t_end = 1\n", &format!("t_end = 1\nengine = \"{engine}\"\n"));
            let alone = run(&text);
            let options = RunOptions { common: Some(common.clone()), ..RunOptions::default() };
            let session = Session::with_catalog(scene(&text), Vec::new(), &catalog(), &options).unwrap();
            let sharing = session.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
            assert_eq!(sharing.columns, alone.columns);
            let work = |report: &RunReport| (report.summary.steps, report.summary.evaluations, report.summary.audit);
            assert_eq!(work(&sharing), work(&alone));
            code.push((alone.summary.machine_code_programs, sharing.summary.machine_code_programs));
        }
    }
    if MachineCode::can_assemble() {
        assert!(code.iter().all(|(alone, sharing)| sharing >= alone), "{code:?}");
        let last = &code[code.len() - 2..];
        assert!(last.iter().any(|(alone, sharing)| sharing > alone), "{code:?}");
    }
}

/// A program of one operation, and how often it is said to have run.
struct Fake {
    program: Program,
    workspace: Workspace,
    runs: u64,
}

impl Fake {
    fn new() -> Self {
        let mut graph = Graph::default();
        let a = graph.input(0);
        let node = graph.tanh(a);
        let program = Program::compile(&graph, &[node]);
        Self { workspace: program.workspace(), program, runs: 0 }
    }

    fn value(&mut self, x: f64) -> f64 {
        let mut found = [0.0];
        self.program.run(&[x], &[], &mut self.workspace, &mut found).unwrap();
        found[0]
    }

    fn used(&mut self, spare: bool) -> Vec<Used<'_>> {
        vec![Used::new(&mut self.program, self.runs, spare)]
    }
}

/// What a run does after every step.
fn after_step<'p>(tier: &mut Tier, t: f64, samples: usize, programs: impl FnOnce() -> Vec<Used<'p>>) {
    if tier.counts_step() {
        tier.between_steps(t, samples, programs);
    }
}

/// Those that there are here.
fn makers() -> Vec<Maker> {
    let assembler = MachineCode::can_assemble().then_some(Maker::Assembler);
    assembler.into_iter().chain(MachineCode::can_compile().then_some(Maker::Compiler)).collect()
}

/// Whether an automatic run of `steps` equal steps with ten runs of its program each would compile it, and after how many.
fn compiles(maker: Maker, steps: u32) -> Option<u32> {
    let mut fake = Fake::new();
    let mut tier = Tier::by(maker, 2.0, 4.0);
    for step in 1..=steps {
        fake.runs += 10;
        let t = 2.0 + 2.0 * f64::from(step) / f64::from(steps);
        after_step(&mut tier, t, 0, || fake.used(false));
        if tier.is_compiling() || tier.made().programs > 0 {
            return Some(step);
        }
    }
    None
}

#[test]
fn only_what_pays_is_compiled() {
    for maker in makers() {
        let paying = (maker.runs_that_pay(1) / 10.0) as u32;
        // Not where compiling costs more than all runs, and not at a margin that a wrong prediction would eat up.
        assert_eq!(compiles(maker, paying / 2), None);
        assert_eq!(compiles(maker, 2 * paying), None);
        // As soon as there is proof, in a long run.
        let begun = compiles(maker, 100 * paying).unwrap();
        assert!((paying / 4..=paying).contains(&begun), "{begun} of {paying}");
    }
}

#[test]
fn what_every_step_runs_is_assembled_before_the_first_step() {
    for maker in makers() {
        let mut fake = Fake::new();
        let mut tier = Tier::by(maker, 0.0, 4.0);
        tier.begin(0.0, 0, || fake.used(false));
        assert_eq!(tier.made().programs, 0);
        tier = Tier::by(maker, 0.0, 4.0);
        tier.begin(0.0, 0, || fake.used(false).into_iter().map(Used::by_steps).collect());
        assert_eq!(tier.made().programs, u64::from(maker == Maker::Assembler));
        tier.begin(1.0, 0, || unreachable!("decided once, and never by a compiler"));
    }
}

#[test]
fn samples_to_come_pay_without_proof() {
    for maker in makers() {
        let paying = maker.runs_that_pay(1) as usize;
        for (samples, spare, compiled) in [(3 * paying, false, true), (paying, false, false), (3 * paying, true, false)]
        {
            let mut fake = Fake::new();
            let mut tier = Tier::by(maker, 0.0, 1e9);
            for step in 1..=10 {
                after_step(&mut tier, f64::from(step), samples, || {
                    fake.used(spare).into_iter().map(Used::by_samples).collect()
                });
            }
            assert_eq!(tier.is_compiling() || tier.made().programs > 0, compiled);
        }
    }
}

#[test]
fn a_compiled_program_is_taken_over_between_two_steps() {
    for maker in makers() {
        let mut fake = Fake::new();
        let before = fake.value(0.3);
        let mut tier = Tier::by(maker, 0.0, 1e9);
        fake.runs = 1_000_000;
        let mut t = 0.0;
        while tier.made().programs == 0 && t < 60_000.0 {
            t += 1.0;
            after_step(&mut tier, t, 0, || fake.used(false));
            sleep(Duration::from_millis(u64::from(tier.is_compiling())));
        }
        let made = *tier.made();
        assert_eq!((made.programs, made.since), (1, Some(t)));
        assert!(fake.program.is_machine_code() && made.bytes > 0 && made.seconds > 0.0);
        // At once, or by a thread meanwhile.
        assert_eq!(t == 1.0, maker == Maker::Assembler);
        assert_eq!(fake.value(0.3).to_bits(), before.to_bits());
        // Nothing is compiled twice.
        (0..100).for_each(|_| after_step(&mut tier, t, 0, || fake.used(false)));
        assert_eq!(*tier.made(), made);
    }
}

#[test]
fn what_stands_in_is_compiled_only_when_it_is_run_often() {
    let mut fake = Fake::new();
    let mut tier = Tier::fixed();
    tier.compile_now(0.0, fake.used(true)).unwrap();
    assert!(!fake.program.is_machine_code());
    after_step(&mut tier, 0.5, 0, || unreachable!("a fixed tier decides nothing"));
    tier.compile_now(0.0, fake.used(false)).unwrap();
    assert!(fake.program.is_machine_code());
}
