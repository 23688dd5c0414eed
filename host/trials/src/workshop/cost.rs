//! What an evaluation of an element costs: its recorded equations as a program of their own, and the call that an opaque
//! element gets.

use std::collections::HashMap;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use element_api::Recording;
use element_api::descriptor::Kind;
use element_api::params::Table;
use element_api::recording::{Input, Role};
use element_api::set::{Batch, ElementClass, Wanted};
use element_api::testkit::{Probe, Random};
use serde::Serialize;

use crate::program::{Graph, MachineCode, Maker, Program, import};

/// A time is the shortest of so many,
const REPEATS: usize = 5;
/// each of which takes at least this.
const LEAST: Duration = Duration::from_millis(4);

/// What an evaluation costs. Values are the rows and coordinates of a joint; loads, rates, channels and energies of others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Recorded equations; `None` for an opaque element.
    pub traced: Option<Traced>,
    /// A call for values, ns.
    pub called_ns: f64,
    /// A call for values with derivatives (the latter of a joint only), ns.
    pub called_derivatives_ns: f64,
}

/// Recorded equations as a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Traced {
    /// Operations of all values, constants folded and what is the same counted once.
    pub operations: usize,
    /// Time of an evaluation of the values, ns.
    pub ns: f64,
    /// Whether the program is machine code; interpreted otherwise.
    pub machine_code: bool,
}

/// Measures an instance with complete parameters; `None` when it cannot be made or fails.
pub(super) fn measure(class: &dyn ElementClass, params: &Table) -> Option<Cost> {
    let text = toml::to_string(params).ok()?;
    let probe = Probe::of(class, &text).ok()?;
    let setting = probe.random_setting(&mut Random::new(7));
    let layout = probe.layout();
    let joint = probe.descriptor.kind == Kind::Joint;
    let mut out = vec![f64::NAN; if joint { layout.joint_results() } else { layout.force_results() }];
    let inputs = setting.inputs();

    let mut set = class.new_set();
    set.add(params).ok()?;
    set.record(0).ok()?;
    let mut call = |derivatives: bool| {
        let wanted = Wanted { jacobian: derivatives, second: derivatives };
        let batch = Batch { instances: &[0], inputs: &inputs, wanted };
        set.evaluate(&batch, &mut out).ok()?;
        Some(shortest(&mut || {
            // It went well once.
            let _ = set.evaluate(black_box(&batch), &mut out);
        }))
    };
    let (called_ns, called_derivatives_ns) = (call(false)?, call(true)?);
    let read = |input: Input| setting.read(input, &[]);
    let traced = if probe.descriptor.opaque { None } else { Some(run(&probe.recording, &read)) };
    Some(Cost { traced, called_ns, called_derivatives_ns })
}

/// The values of a recording as a program.
fn run(recording: &Recording, read: &dyn Fn(Input) -> f64) -> Traced {
    let mut graph = Graph::default();
    let mut slots: HashMap<Input, usize> = HashMap::new();
    let mut inputs = Vec::new();
    let nodes = import(&mut graph, recording, |graph, input| {
        let slot = *slots.entry(input).or_insert_with(|| {
            inputs.push(read(input));
            inputs.len() - 1
        });
        graph.input(slot)
    });
    let value = |role: &Role| !matches!(role, Role::Angle(_) | Role::PosePosition(_) | Role::PoseRotation(_));
    let wanted = recording.outputs.iter().filter(|output| value(&output.role));
    let outputs: Vec<_> = wanted.map(|output| nodes[output.node as usize]).collect();
    let mut program = Program::compile(&graph, &outputs);
    if let Ok(code) = MachineCode::compile(&program, Maker::here(), &AtomicBool::new(false)) {
        program.install(Arc::new(code));
    }
    let (mut workspace, mut values) = (program.workspace(), vec![0.0; outputs.len()]);
    let ns = shortest(&mut || {
        // Nothing is called, so nothing fails.
        let _ = program.run(black_box(&inputs), &[], &mut workspace, &mut values);
    });
    black_box(&values);
    Traced { operations: program.operations(), ns, machine_code: program.is_machine_code() }
}

/// Time of one call, ns.
fn shortest(call: &mut dyn FnMut()) -> f64 {
    let mut timed = |count: u32| {
        let start = Instant::now();
        (0..count).for_each(|_| call());
        start.elapsed()
    };
    let mut count = 1;
    while timed(count) < LEAST && count < 1 << 24 {
        count *= 2;
    }
    let best = (0..REPEATS).map(|_| timed(count)).min().unwrap_or_default();
    best.as_secs_f64() * 1e9 / f64::from(count)
}
