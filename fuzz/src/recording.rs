//! Equations that a library sends: any operations, any sizes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use element_api::abi::{self, v1};
use element_api::adapt::joint;
use element_api::manifest::Library;
use element_api::params::Table as Parameters;
use element_api::prelude::*;
use element_api::set::{Batch, CreateError, Fault};
use element_api::{Descriptor, ElementClass, ElementSet, Kind, Named, NamedInput, Recording};
use odyn::analysis::start_inputs;
use odyn::catalog::Catalog;
use odyn::diagnostics::Source;
use odyn::program::{MachineCode, Maker, Node, Program};
use odyn::scene::parse;
use odyn::session::{RunOptions, Session};

/// Operations of one input; what can go wrong does so with few.
const MOST_OPERATIONS: usize = 60;

/// Equations, bit by bit, and the descriptor of the element that is said to have them. What passes the check is put into
/// scenes, interpreted, made to machine code by both makers, and run.
///
/// # Panics
/// When equations that passed the check break the program, or give other numbers as machine code.
pub fn recording(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let descriptor = descriptor(&mut bytes);
    let choices = bytes.byte();
    let sent = sent(&mut bytes, &descriptor);
    let Ok(recording) = abi::decode(sent, &descriptor.limits()) else { return };
    let scene = scene_of(&descriptor, choices);
    let mut catalog = Catalog::new();
    let classes: Vec<Box<dyn ElementClass>> = vec![Box::new(Stranger { descriptor, recording }), joint::<Pin>()];
    let library = Library { package: "fuzz".into(), version: "1".into(), about: String::new(), classes };
    catalog.add_library(library).expect("the first library");
    let read = parse(Source::new("fuzz.toml", scene.as_str()), &[]);
    let (scene, warnings) = read.unwrap_or_else(|rejected| panic!("{:?}\n{scene}", rejected.diagnostics));
    let Ok(session) = Session::with_catalog(scene, warnings, &catalog, &RunOptions::default()) else { return };
    assert_same_bits(&session);
    drop(session.plan_report().to_string());
    if let Err(error) = session.run(None, Box::new(|_| ()), &Default::default()) {
        assert!(!error.render(false).is_empty(), "refused without a word");
    }
}

/// Everything that the equations contain: the same interpreted and as machine code.
fn assert_same_bits(session: &Session) {
    let equations = &session.equations;
    let mut nodes: Vec<Node> = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in &equations.rows {
        nodes.extend([row.value, row.time, row.gamma]);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    let program = Program::compile(&equations.graph, &nodes);
    let inputs = start_inputs(&session.plan.layout, session.scene.simulation.t_start, &session.assembly);
    let numbers = |program: &Program| {
        let (mut workspace, mut found) = (program.workspace(), vec![f64::NAN; nodes.len()]);
        program.run(&inputs, &session.model.sets, &mut workspace, &mut found).expect("no call fails");
        found
    };
    let expected = numbers(&program);
    for maker in [Maker::Assembler, Maker::Compiler] {
        let mut compiled = program.clone();
        let Ok(code) = MachineCode::compile(&compiled, maker, &AtomicBool::new(false)) else { continue };
        compiled.install(Arc::new(code));
        for (k, (a, b)) in numbers(&compiled).iter().zip(&expected).enumerate() {
            let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            assert!(same, "output {k} by {maker:?}: {a:e} instead of {b:e}");
        }
    }
}

/// A descriptor of small sizes.
fn descriptor(bytes: &mut Bytes<'_>) -> Descriptor {
    let mut up_to = |most: usize| usize::from(bytes.byte()) % (most + 1);
    let names = |letter: char, count: usize| (0..count).map(move |k| format!("{letter}{k}"));
    let named = |letter: char, count: usize| -> Vec<Named> {
        names(letter, count).map(|name| Named { name, unit: String::new(), doc: String::new() }).collect()
    };
    let kind = [Kind::Joint, Kind::Force, Kind::Control][up_to(2)];
    let mobility = up_to(7);
    Descriptor {
        name: "stranger".into(),
        kind,
        summary: String::new(),
        doc: String::new(),
        opaque: up_to(7) == 0,
        angles: up_to(2),
        mobility: (kind == Kind::Joint).then(|| mobility.checked_sub(1)).flatten(),
        turns_freely: up_to(3) == 0,
        frames: named('f', if kind == Kind::Control { up_to(3) } else { 1 + up_to(2) }),
        rows: names('r', up_to(7)).collect(),
        inputs: names('i', up_to(2))
            .map(|name| NamedInput { name, unit: String::new(), doc: String::new(), default: Some(0.5) })
            .collect(),
        joints: named('j', if kind == Kind::Joint { 0 } else { up_to(1) }),
        channels: named('c', up_to(3)),
        states: Vec::new(),
        params: Vec::new(),
    }
}

/// A recording as it crosses the interface. Most arguments are made to fit, so that what fits is found at all.
fn sent(bytes: &mut Bytes<'_>, descriptor: &Descriptor) -> v1::RecordingV1 {
    let fits = bytes.byte() != 0;
    let constants: Vec<f64> = (0..bytes.byte() % 6).map_while(|_| bytes.number()).collect();
    let most = if fits && descriptor.kind == Kind::Joint { 1 } else { 3 };
    let states: Vec<f64> = (0..bytes.byte() % most).map_while(|_| bytes.number()).collect();
    let discrete: Vec<f64> = (0..bytes.byte() % most).map_while(|_| bytes.number()).collect();
    let tables: Vec<v1::TableV1> = (0..bytes.byte() % 3)
        .map(|_| {
            let pieces = bytes.byte() % 4;
            v1::TableV1 {
                breaks: (0..=pieces).map_while(|_| bytes.number()).collect(),
                pieces: (0..4 * pieces).map_while(|_| bytes.number()).collect(),
                outside: u32::from(bytes.byte() % 3),
            }
        })
        .collect();
    let mut outputs = Vec::new();
    let count = usize::from(bytes.byte()) % MOST_OPERATIONS;
    let mut ops = Vec::new();
    for k in 0..count as u32 {
        let code = u32::from(bytes.byte()) % 19;
        let mut args = [bytes.word(), bytes.word(), bytes.word(), bytes.word()];
        let limits = descriptor.limits();
        let within = |value: u32, size: usize| value % (size as u32).max(1);
        if fits {
            // Which arguments are operations: all but numbers of constants and tables, and exponents.
            match code {
                0 => args[0] = within(args[0], constants.len()),
                1 => {
                    args[0] %= 12;
                    let sizes = [1, 3, 9, 3, 3].map(|size: usize| size * limits.frames);
                    let own = [limits.angles, states.len(), discrete.len(), limits.inputs, limits.mobility];
                    let reactions = [3 * limits.joints; 2];
                    let size = [&sizes[..], &own, &reactions].concat()[args[0] as usize];
                    args[1] = within(args[1], size);
                }
                14 => args[0] = within(args[0], k as usize),
                15 => args = [within(args[0], k as usize), within(args[1], constants.len()), 0, 0],
                17 => args = [within(args[0], tables.len()), within(args[1], k as usize), 0, 0],
                _ => args = args.map(|a| within(a, k as usize)),
            }
        }
        ops.push(v1::OpV1 { code, args });
    }
    // Each row must be given; the rest comes as it comes.
    if fits {
        let rows = if descriptor.kind == Kind::Joint { descriptor.rows.len() as u32 } else { 0 };
        for row in 0..rows {
            outputs.push(v1::OutputV1 { role: 0, index: row, node: bytes.word() % (count as u32).max(1) });
        }
        for state in 0..states.len() as u32 {
            outputs.push(v1::OutputV1 { role: 5, index: state, node: bytes.word() % (count as u32).max(1) });
        }
    }
    while let Some(role) = bytes.next() {
        let (index, node) = (u32::from(bytes.byte()), bytes.word());
        let node = if fits { node % (count as u32).max(1) } else { node };
        let role = u32::from(role) % 14;
        if !fits || !outputs.iter().any(|o: &v1::OutputV1| (o.role, o.index) == (role, index)) {
            outputs.push(v1::OutputV1 { role, index, node });
        }
    }
    v1::RecordingV1 {
        ops: ops.into(),
        constants: constants.into(),
        tables: tables.into(),
        outputs: outputs.into(),
        initial_states: states.into(),
        initial_discrete: discrete.into(),
    }
}

/// A scene with the element, between bodies that a joint of ours holds, for two steps.
fn scene_of(descriptor: &Descriptor, choices: u8) -> String {
    let pick = |list: [&'static str; 4], shift: u8| list[usize::from(choices >> shift) % 4];
    let engine = pick(["compiled", "interpreted", "reference", "compiled"], 0);
    let formulation = if engine == "reference" { "auto" } else { pick(["auto", "cartesian", "joint", "auto"], 2) };
    let method = pick(["rk4", "radau5", "rodas5p", "dop853"], 4);
    let mut text = format!(
        "[simulation]\ngravity = [0, -9.81, 0]\nt_end = 2e-3\noutput_step = 1e-3\nfixed_step = 1e-3\n\
         engine = \"{engine}\"\nformulation = \"{formulation}\"\nmethod = \"{method}\"\n"
    );
    for (name, x) in [("a", 0.3), ("b", 0.7)] {
        text.push_str(&format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.2, 0.25]\nposition = [{x}, 0.1, 0.2]\n"
        ));
    }
    text.push_str("[[joint]]\nname = \"pin\"\ntype = \"pin\"\nbodies = [\"ground\", \"a\"]\npoint = [0, 0.1, 0]\n");
    let bodies = match descriptor.frames.len() {
        0 => "",
        1 => "bodies = [\"b\"]",
        2 => "bodies = [\"a\", \"b\"]",
        _ => "bodies = [\"ground\", \"a\", \"b\"]",
    };
    let kind = descriptor.kind.word();
    text.push_str(&format!("[[{kind}]]\nname = \"it\"\ntype = \"stranger\"\n{bodies}\n"));
    if !descriptor.joints.is_empty() {
        text.push_str("joints = [\"pin\"]\n");
    }
    text.push_str(
        "[[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"b\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"r\"\nquantity = \"reaction_force\"\nof = \"pin\"\non = \"a\"\ncomponent = \"y\"\n\
         [[output]]\nname = \"e\"\nquantity = \"total_energy\"\n",
    );
    text
}

/// An element whose equations somebody else wrote.
struct Stranger {
    descriptor: Descriptor,
    recording: Recording,
}

impl ElementClass for Stranger {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }
    fn new_set(&self) -> Box<dyn ElementSet> {
        Box::new(Strangers { recording: self.recording.clone(), count: 0 })
    }
}

struct Strangers {
    recording: Recording,
    count: usize,
}

impl ElementSet for Strangers {
    fn add(&mut self, _: &Parameters) -> Result<usize, CreateError> {
        self.count += 1;
        Ok(self.count - 1)
    }
    fn record(&self, _: usize) -> Result<Recording, Fault> {
        Ok(self.recording.clone())
    }
    /// Called only where the descriptor says so; any numbers will do.
    fn evaluate(&self, _: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        out.iter_mut().enumerate().for_each(|(k, x)| *x = (k * 7 % 11) as f64 / 8.0 - 0.5);
        Ok(())
    }
    fn accept(&mut self, _: usize, _: &[f64]) -> Result<(), Fault> {
        Ok(())
    }
    fn save(&self, _: usize) -> Result<Vec<u8>, Fault> {
        Ok(Vec::new())
    }
    fn load(&mut self, _: usize, _: &[u8]) -> Result<(), Fault> {
        Ok(())
    }
}

/// Two points that coincide.
struct Pin;

impl Element for Pin {
    const NAME: &'static str = "pin";
    const SUMMARY: &'static str = "two points that coincide";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "one"), FrameSpec::new("j", "other")];
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Pin {
    const ROWS: &'static [&'static str] = &["x", "y", "z"];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        blocks::coincident(&at.frames[0], &at.frames[1], rows);
    }
}

/// Bytes, read one after the other; zeros behind their end.
pub(crate) struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self(data)
    }

    fn next(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.next().unwrap_or(0)
    }

    /// A small number from one byte, or any from four behind 255.
    fn word(&mut self) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(std::array::from_fn(|_| self.byte())),
            small => u32::from(small),
        }
    }

    /// A small number from one byte, or any bits from eight behind 255. `None` at the end.
    pub(crate) fn number(&mut self) -> Option<f64> {
        Some(match self.next()? {
            255 => f64::from_le_bytes(std::array::from_fn(|_| self.byte())),
            small => f64::from(small.cast_signed()) / 8.0,
        })
    }
}
