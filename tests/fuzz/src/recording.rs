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
const MOST_OPERATIONS: u32 = 60;

/// How far equations came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reached {
    /// The check refused them.
    Nothing,
    /// They were put into a scene, which was refused.
    Scene,
    /// They were interpreted, and run as machine code.
    Code,
    /// The scene ran to its end.
    End,
}

/// Equations, bit by bit, and the descriptor of the element that is said to have them. What passes the check is put into
/// scenes, interpreted, made to machine code by both makers, and run.
///
/// # Panics
/// When equations that passed the check break the program, or give other numbers as machine code.
pub fn recording(data: &[u8]) {
    reach(data);
}

/// The same, telling how far they came.
///
/// # Panics
/// As [`recording`].
pub fn reach(data: &[u8]) -> Reached {
    let mut bytes = Bytes::new(data);
    let descriptor = descriptor(&mut bytes);
    let choices = bytes.byte();
    let sent = sent(&mut bytes, &descriptor);
    let Ok(recording) = abi::decode(sent, &descriptor.limits()) else { return Reached::Nothing };
    let scene = scene_of(&descriptor, choices);
    let mut catalog = Catalog::new();
    let classes: Vec<Box<dyn ElementClass>> = vec![Box::new(Stranger { descriptor, recording }), joint::<Pin>()];
    let library = Library { package: "fuzz".into(), version: "1".into(), about: String::new(), classes };
    catalog.add_library(library).expect("the first library");
    let read = parse(Source::new("fuzz.toml", scene.as_str()), &[]);
    let (scene, warnings) = read.unwrap_or_else(|rejected| panic!("{:?}\n{scene}", rejected.diagnostics));
    let session = Session::with_catalog(scene, warnings, &catalog, &RunOptions::default());
    let Ok(session) = session else { return Reached::Scene };
    assert_same_bits(&session);
    drop(session.plan_report().to_string());
    match session.run(None, Box::new(|_| ()), &Default::default()) {
        Ok(report) if report.times.len() == 3 => Reached::End,
        Ok(_) => Reached::Code,
        Err(error) => {
            assert!(!error.render(false).is_empty(), "refused without a word");
            Reached::Code
        }
    }
}

/// Everything that the equations contain: the same interpreted and as machine code.
fn assert_same_bits(session: &Session) {
    let equations = &session.equations;
    let mut nodes: Vec<Node> = equations.loads.clone();
    nodes.extend(&equations.state_rates);
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in equations.rows.iter() {
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
        glyph: String::new(),
        frames: named('f', if kind == Kind::Control { up_to(3) } else { 1 + up_to(2) }),
        rows: names('r', up_to(7)).collect(),
        inputs: names('i', up_to(2))
            .map(|name| NamedInput { name, unit: String::new(), doc: String::new(), default: Some(0.5) })
            .collect(),
        joints: named('j', if kind == Kind::Joint { 0 } else { up_to(1) }),
        channels: named('c', up_to(3)),
        states: Vec::new(),
        params: Vec::new(),
        exempt: Vec::new(),
        checks: Vec::new(),
        catalog: String::new(),
        report: String::new(),
        parallel_axes: Vec::new(),
        unknowns: Vec::new(),
        values: Vec::new(),
        more_frames: None,
        most_frames: 0,
    }
}

/// A recording as it crosses the interface. Unless the first byte is zero, what it refers to is there; else anything goes.
fn sent(bytes: &mut Bytes<'_>, descriptor: &Descriptor) -> v1::RecordingV1 {
    let fits = bytes.byte() != 0;
    let limits = descriptor.limits();
    let most = if fits && descriptor.kind == Kind::Joint { 1 } else { 3 };
    let constants: Vec<f64> = (0..1 + bytes.byte() % 5).map_while(|_| bytes.number()).collect();
    let states: Vec<f64> = (0..bytes.byte() % most).map_while(|_| bytes.number()).collect();
    let discrete: Vec<f64> = (0..bytes.byte() % most).map_while(|_| bytes.number()).collect();
    let tables: Vec<v1::TableV1> = (0..bytes.byte() % 3).map(|_| table(bytes, fits)).collect();
    let count = 1 + u32::from(bytes.byte()) % MOST_OPERATIONS;
    // How many of each kind of input and of result there are, by their codes.
    let frames = [1, 3, 9, 3, 3].map(|each| each * limits.frames);
    let own = [limits.angles, states.len(), discrete.len(), limits.inputs, limits.mobility];
    let inputs = [&frames[..], &own, &[3 * limits.joints; 2]].concat();
    let loads = if descriptor.kind == Kind::Force { 3 * limits.frames } else { 0 };
    let joint = usize::from(descriptor.kind == Kind::Joint);
    let rows = joint * limits.rows;
    let poses = if limits.mobility > 0 { [3 * joint, 9 * joint] } else { [0; 2] };
    let [first, last] = [rows, 1 - joint];
    let results = [
        first,
        loads,
        loads,
        limits.angles,
        limits.coordinates,
        states.len(),
        discrete.len(),
        0,
        limits.channels,
        last,
        last,
        poses[0],
        poses[1],
    ];
    let mut ops = Vec::new();
    for k in 0..count {
        let (code, mut args) = (u32::from(bytes.byte()), [bytes.word(), bytes.word(), bytes.word(), bytes.word()]);
        let mut code = code % 19;
        if fits {
            code = if k == 0 || (code == 17 && tables.is_empty()) { 0 } else { code % 18 };
            match code {
                0 => args[0] = within(args[0], constants.len()),
                1 => {
                    let kind = args[0] as usize % inputs.len();
                    args = if inputs[kind] > 0 { [kind as u32, within(args[1], inputs[kind]), 0, 0] } else { [0; 4] };
                }
                14 => args[0] = within(args[0], k as usize),
                15 => args = [within(args[0], k as usize), within(args[1], constants.len()), 0, 0],
                17 => args = [within(args[0], tables.len()), within(args[1], k as usize), 0, 0],
                _ => args = args.map(|a| within(a, k as usize)),
            }
        }
        ops.push(v1::OpV1 { code, args });
    }
    let mut outputs = Vec::new();
    if fits {
        // Each result that is allowed; of those that may be left out, not all.
        for (role, number) in results.into_iter().enumerate() {
            for index in 0..number as u32 {
                let needed = matches!(role, 0 | 5);
                let wanted = bytes.byte();
                if needed || wanted > 60 {
                    outputs.push(v1::OutputV1 { role: role as u32, index, node: within(bytes.word(), count as usize) });
                }
            }
        }
    } else {
        while let Some(role) = bytes.next() {
            outputs.push(v1::OutputV1 { role: u32::from(role) % 14, index: bytes.word(), node: bytes.word() });
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

fn within(value: u32, size: usize) -> u32 {
    value % (size as u32).max(1)
}

/// A table, its arguments ascending if it is to fit.
fn table(bytes: &mut Bytes<'_>, fits: bool) -> v1::TableV1 {
    let pieces = 1 + bytes.byte() % 3;
    let mut breaks: Vec<f64> = (0..=pieces).map_while(|_| bytes.number()).collect();
    if fits {
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
    }
    let pieces = if fits { breaks.len().saturating_sub(1) } else { usize::from(pieces) };
    let numbers = (0..4 * pieces).map(|_| bytes.number().unwrap_or(0.25));
    v1::TableV1 {
        breaks: breaks.into(),
        pieces: numbers.collect(),
        outside: u32::from(bytes.byte() % if fits { 2 } else { 3 }),
    }
}

/// A scene with the element, between bodies that a joint of ours holds, for two steps.
fn scene_of(descriptor: &Descriptor, choices: u8) -> String {
    let pick = |list: [&'static str; 4], shift: u8| list[usize::from(choices >> shift) % 4];
    let engine = pick(["compiled", "interpreted", "reference", "compiled"], 0);
    let formulation = if engine == "reference" { "auto" } else { pick(["auto", "cartesian", "joint", "auto"], 2) };
    let method = pick(["rk4", "radau5", "dopri5", "dop853"], 4);
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
