use abi_stable::StableAbi;

use super::host::decode;
use super::layout::{explain_mismatch, layout_text};
use super::v1::{OpV1, OutputV1, RecordingV1, TableV1};
use super::*;
use crate::adapt;
use crate::manifest::Library;
use crate::params::Table as Params;
use crate::prelude::*;
use crate::recording::{Limits, Role};
use crate::set::{Batch, CreateError, ElementClass, Wanted};
use crate::testkit::{Options, Probe, Random, examine_class};
use crate::tests::signals::{Governor, Shaper};

/// A joint that goes wrong where its parameter says.
struct Trap {
    place: String,
    offset: f64,
    accepted: f64,
}

#[derive(Parameters)]
struct TrapParameters {
    /// Where to panic.
    #[param(default = "nowhere")]
    place: String,
    /// Added to the row.
    #[param(unit = "m", default = 0.0)]
    offset: f64,
}

impl Trap {
    fn pass(&self, place: &str) {
        assert!(self.place != place, "trap in {place}");
    }
}

impl Element for Trap {
    const NAME: &'static str = "trap";
    const SUMMARY: &'static str = "goes wrong on purpose";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first"), FrameSpec::new("j", "second")];
    const OPAQUE: bool = true;
    type Parameters = TrapParameters;

    fn new(p: TrapParameters) -> Result<Self, ParamError> {
        if p.offset < 0.0 {
            return Err(ParamError::new("offset", "must not be negative"));
        }
        let trap = Self { place: p.place, offset: p.offset, accepted: 0.0 };
        trap.pass("new");
        Ok(trap)
    }
    fn accept(&mut self, at: &Motion<'_, f64>) {
        self.pass("accept");
        self.accepted = at.time();
    }
    fn save(&self) -> Vec<u8> {
        self.pass("save");
        self.accepted.to_le_bytes().to_vec()
    }
    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        self.pass("load");
        self.accepted = f64::from_le_bytes(memory.try_into().map_err(|_| "not a trap's memory")?);
        Ok(())
    }
}

impl Drop for Trap {
    fn drop(&mut self) {
        self.pass("drop");
    }
}

impl Constraint for Trap {
    const ROWS: &'static [&'static str] = &["along z"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        self.pass("residual");
        rows.push((at.frames[1].position - at.frames[0].position).dot(&at.frames[0].z()) + self.offset);
    }
}

/// A force whose equations use every kind of result, a table and a state.
struct Engine {
    curve: Table,
}

#[derive(Parameters)]
struct EngineParameters {
    /// Points of the curve.
    #[param(unit = "rad -> N m")]
    curve: Vec<[f64; 2]>,
}

impl Element for Engine {
    const NAME: &'static str = "engine";
    const SUMMARY: &'static str = "torque over angle";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "housing"), FrameSpec::new("j", "rotor")];
    const ANGLES: usize = 1;
    type Parameters = EngineParameters;
    fn new(p: EngineParameters) -> Result<Self, ParamError> {
        Table::periodic(&p.curve).map(|curve| Self { curve })
    }
}

impl Force for Engine {
    const CHANNELS: &'static [crate::ChannelSpec] = &[crate::ChannelSpec::new("torque", "N m", "on the rotor")];
    const STATES: &'static [crate::ChannelSpec] = &[crate::ChannelSpec::new("heat", "J", "given off")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let torque = at.configuration.angle_about_z(0, 0, 1).lookup(&self.curve);
        out.torque_pair(0, 1, at.frames()[0].z() * torque);
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.configuration.angle_about_z(0, 0, 1).lookup(&self.curve));
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(S::select(at.states[0], S::from(1.0), at.spin_about_z(0, 1).powi(2), S::zero()));
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![0.25]
    }
}

struct Exporter;

impl Exported for Exporter {
    fn library() -> Library {
        Library {
            package: "tests".into(),
            version: "0.0.0".into(),
            about: String::new(),
            classes: vec![
                adapt::joint::<Trap>(),
                adapt::force::<Engine>(),
                adapt::control::<Shaper>(),
                adapt::force::<Governor>(),
            ],
        }
    }
}

static HEADER: Header = header::<Exporter>();

/// The exported classes, once around the interface. No file is involved: a header in this program serves as well.
fn loaded() -> Vec<Box<dyn ElementClass>> {
    // SAFETY: the address of an exported header, which lives as long as the program.
    unsafe { open((&raw const HEADER).cast()) }.expect("the header is this very version's")
}

/// The text as a table, completed with the defaults as the host does it.
fn params(text: &str) -> Params {
    let mut table: Params = text.parse().expect("TOML");
    for spec in TrapParameters::specs() {
        let default = spec.default.expect("both parameters have one");
        table.entry(spec.name).or_insert(default);
    }
    table
}

const CURVE: &str = "curve = [[0.0, 1.0], [1.0, 0.1], [2.0, 1e-310], [6.283185307179586, 1.0]]";

#[test]
fn descriptors_arrive_unchanged() {
    let linked = Exporter::library().classes;
    for (loaded, linked) in loaded().iter().zip(&linked) {
        assert_eq!(loaded.descriptor(), linked.descriptor());
    }
}

#[test]
fn recordings_arrive_bit_by_bit() {
    for (class, text) in [(0, "offset = 0.1"), (1, CURVE), (2, "orders = 3"), (2, "orders = 0"), (3, "orders = 2")] {
        let mut here = Exporter::library().classes[class].new_set();
        let mut there = loaded()[class].new_set();
        assert_eq!(here.add(&params(text)), Ok(0));
        assert_eq!(there.add(&params(text)), Ok(0));
        let recording = here.record(0).expect("a recording");
        assert!(!recording.outputs.is_empty());
        assert_eq!(there.record(0).expect("a recording"), recording);
    }
}

#[test]
fn numbers_cross_as_text_without_loss() {
    #[derive(Parameters)]
    struct Numbers {
        /// Any.
        list: Vec<f64>,
    }
    let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
    let mut list = vec![0.0, -0.0, f64::MIN_POSITIVE, 5e-324, f64::MAX, f64::INFINITY, 0.1 + 0.2, 1e22, 123456789.0];
    for _ in 0..20_000 {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        list.push(f64::from_bits(bits));
    }
    list.retain(|x| !x.is_nan());
    let mut table = Params::new();
    table.insert("list".into(), toml::Value::try_from(&list).expect("a list"));
    let text = toml::to_string(&table).expect("TOML");
    let back = Numbers::read(&params(&text)).expect("the same list").list;
    assert!(list.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert_eq!(list.len(), back.len());
}

#[test]
fn evaluation_is_that_of_the_linked_class() {
    let inputs: Vec<f64> = (0..2 * (1 + 2 * 18)).map(|k| (k as f64 * 0.37).sin()).collect();
    let (mut here, mut there) = (Exporter::library().classes[0].new_set(), loaded()[0].new_set());
    for offset in ["offset = 0.1", "offset = 0.2"] {
        here.add(&params(offset)).expect("an instance");
        there.add(&params(offset)).expect("an instance");
    }
    for (jacobian, second) in [(false, false), (true, false), (false, true), (true, true)] {
        let batch = Batch { instances: &[1, 0], inputs: &inputs, wanted: Wanted { jacobian, second } };
        let (mut a, mut b) = (vec![7.0; 2 * 15], vec![7.0; 2 * 15]);
        here.evaluate(&batch, &mut a).expect("results");
        there.evaluate(&batch, &mut b).expect("results");
        assert_eq!(a, b);
        assert_eq!(a.iter().filter(|x| **x == 7.0).count(), 26 * usize::from(!jacobian) + 2 * usize::from(!second));
    }
}

#[test]
fn signals_reactions_and_control_elements_cross_the_interface() {
    for (class, params) in [(2, "orders = 0"), (2, "orders = 3"), (3, "orders = 1")] {
        let (linked, loaded) = (&Exporter::library().classes[class], &loaded()[class]);
        let here = Probe::of(linked.as_ref(), params).expect("accepted");
        let there = Probe::of(loaded.as_ref(), params).expect("accepted");
        let mut random = Random::new(7);
        for _ in 0..10 {
            let setting = here.random_setting(&mut random);
            assert_eq!(there.force_values(&setting), here.force_values(&setting), "{}", linked.descriptor().name);
            assert_eq!(there.recorded(&setting, &[]), here.recorded(&setting, &[]));
        }
    }
}

#[test]
fn a_loaded_class_fulfils_the_contract_as_a_linked_one_does() {
    let energy_is_not_kept = Options { accounted: false, ..Options::default() };
    for (class, params) in [(0, ""), (1, CURVE), (2, "orders = 2"), (3, "orders = 2")] {
        let loaded = loaded().swap_remove(class);
        let report = examine_class(loaded, params, &energy_is_not_kept);
        assert!(report.is_sound(), "{report}");
        let linked = examine_class(Exporter::library().classes.swap_remove(class), params, &energy_is_not_kept);
        assert_eq!(report, linked);
    }
}

#[test]
fn memory_is_saved_and_restored() {
    let mut set = loaded()[0].new_set();
    set.add(&params("")).expect("an instance");
    let mut inputs = vec![0.0; 37];
    inputs[0] = 1.5;
    set.accept(0, &inputs).expect("accepted");
    let memory = set.save(0).expect("memory");
    assert_eq!(memory, 1.5_f64.to_le_bytes());
    set.add(&params("")).expect("an instance");
    set.load(1, &memory).expect("restored");
    assert_eq!(set.save(1).expect("memory"), memory);
    assert_eq!(set.load(1, &[1, 2]).expect_err("two bytes").message, "not a trap's memory");
}

#[test]
fn refused_parameters_keep_their_path() {
    let mut set = loaded()[0].new_set();
    let error = set.add(&params("offset = -1.0")).expect_err("negative");
    assert_eq!(error, CreateError::Parameter(ParamError::new("offset", "must not be negative")));
    let error = set.add(&params("offset = true")).expect_err("no number");
    assert!(matches!(error, CreateError::Parameter(e) if e.path == "offset" && e.message.contains("must be a number")));
    assert_eq!(set.add(&params("")), Ok(0));
}

#[test]
fn a_panic_anywhere_becomes_a_fault_that_names_its_place() {
    let class = &loaded()[0];
    let inputs = [0.0; 74];
    let batch = Batch { instances: &[0, 1], inputs: &inputs, wanted: Wanted { jacobian: false, second: false } };
    let expect = |place: &str, message: String| {
        assert!(message.starts_with(&format!("panicked: trap in {place} at ")), "{message}");
        assert!(message.contains("tests.rs:"), "{message}");
    };
    let with = |place: &str| {
        let mut set = class.new_set();
        set.add(&params("")).expect("a sound instance");
        set.add(&params(&format!("place = '{place}'"))).map(|_| set)
    };
    match with("new") {
        Err(CreateError::Fault(message)) => expect("new", message),
        _ => panic!("creation must fail"),
    }
    for linked in [false, true] {
        let mut set = with("residual").expect("a set");
        if linked {
            set = crate::fence::class(adapt::joint::<Trap>()).new_set();
            set.add(&params("")).expect("a sound instance");
            set.add(&params("place = 'residual'")).expect("an instance");
        }
        let fault = set.evaluate(&batch, &mut [0.0; 30]).expect_err("a fault");
        assert_eq!(fault.instance, 1);
        expect("residual", fault.message);
    }
    expect("accept", with("accept").expect("a set").accept(1, &inputs[..37]).expect_err("a fault").message);
    expect("save", with("save").expect("a set").save(1).expect_err("a fault").message);
    expect("load", with("load").expect("a set").load(1, &[]).expect_err("a fault").message);
    // A destructor's panic is not reported, but the program lives.
    drop(with("drop").expect("a set"));
}

#[test]
fn instances_that_do_not_exist_are_not_asked_for() {
    let mut set = loaded()[0].new_set();
    set.add(&params("")).expect("an instance");
    assert!(set.record(1).expect_err("one instance").message.contains("instance 1 does not exist (1 do)"));
    let batch = Batch { instances: &[3], inputs: &[], wanted: Wanted { jacobian: false, second: false } };
    assert_eq!(set.evaluate(&batch, &mut []).expect_err("one instance").instance, 3);
    let batch = Batch { instances: &[0], inputs: &[1.0], wanted: Wanted { jacobian: false, second: false } };
    assert!(set.evaluate(&batch, &mut []).expect_err("lengths").message.contains("needs 37 inputs and 15 results"));
}

fn limits() -> Limits {
    let kind = crate::Kind::Joint;
    Limits {
        kind,
        frames: 2,
        rows: 1,
        angles: 0,
        coordinates: 0,
        mobility: 0,
        channels: 0,
        inputs: 0,
        joints: 0,
        checks: 0,
    }
}

fn raw() -> RecordingV1 {
    RecordingV1 {
        ops: vec![OpV1 { code: 0, args: [0; 4] }].into(),
        constants: vec![1.0].into(),
        tables: vec![TableV1 { breaks: vec![0.0, 1.0].into(), pieces: vec![0.0; 4].into(), outside: 0 }].into(),
        outputs: vec![OutputV1 { role: 0, index: 0, node: 0 }].into(),
        initial_states: Vec::new().into(),
        initial_discrete: Vec::new().into(),
    }
}

#[test]
fn nothing_a_stranger_sends_passes_unchecked() {
    assert_eq!(decode(raw(), &limits()).expect("sound").output(Role::Residual(0)), Some(0));
    type Spoil = fn(&mut RecordingV1);
    let spoilt: [(&str, Spoil); 8] = [
        ("unknown code 99", |r| r.ops[0].code = 99),
        ("unknown meaning 77", |r| r.outputs[0].role = 77),
        ("refers to operation 5", |r| r.outputs[0].node = 5),
        ("outside what the element declares", |r| r.outputs[0].index = 1),
        ("uses constant 3 of 1", |r| r.ops[0].args[0] = 3),
        ("constant 0 is NaN", |r| r.constants[0] = f64::NAN),
        ("not a multiple of 4", |r| r.tables[0].pieces.push(0.0)),
        ("unknown continuation 9", |r| r.tables[0].outside = 9),
    ];
    for (expected, spoil) in spoilt {
        let mut raw = raw();
        spoil(&mut raw);
        let error = decode(raw, &limits()).expect_err(expected);
        assert!(error.contains(expected), "{error} / {expected}");
    }
}

#[test]
fn an_entry_that_is_no_header_is_refused() {
    static ZEROS: [u64; 64] = [0; 64];
    // SAFETY: null is allowed, and zeros are read as a header whose magic does not fit.
    unsafe {
        assert_eq!(open(std::ptr::null()).err(), Some(OpenError::Header));
        assert_eq!(open((&raw const ZEROS).cast()).err(), Some(OpenError::Header));
    }
}

mod before {
    #[repr(C)]
    #[derive(abi_stable::StableAbi)]
    pub struct Body {
        pub r: [f64; 3],
        pub v: [f64; 6],
    }
}

mod renamed {
    #[repr(C)]
    #[derive(abi_stable::StableAbi)]
    pub struct Body {
        pub r: [f64; 3],
        pub vel: [f64; 6],
    }
}

mod longer {
    #[repr(C)]
    #[derive(abi_stable::StableAbi)]
    pub struct Body {
        pub r: [f64; 3],
        pub v: [f64; 6],
        pub w: [f64; 3],
    }
}

#[test]
fn a_mismatch_is_explained_in_two_lines() {
    assert_eq!(explain_mismatch(before::Body::LAYOUT, before::Body::LAYOUT), "");
    assert_eq!(
        explain_mismatch(before::Body::LAYOUT, renamed::Body::LAYOUT),
        "   in Body: host expects `v: [f64;6]`, library has `vel: [f64;6]`"
    );
    assert_eq!(
        explain_mismatch(before::Body::LAYOUT, longer::Body::LAYOUT),
        "   in Body: host expects 72 bytes, library has 96\n   in Body: host expects 2 fields, library has 3"
    );
}

#[test]
fn layout_texts_tell_types_apart() {
    assert_eq!(layout_text(before::Body::LAYOUT), layout_text(before::Body::LAYOUT));
    assert_ne!(layout_text(before::Body::LAYOUT), layout_text(renamed::Body::LAYOUT));
    for part in ["RecordingV1", "outputs", "progress", "evaluate", "extension"] {
        assert!(v1_layout_text().contains(part), "{part}");
    }
}

/// What v1 lets cross must not change: libraries that were built with it would not load any more. After a change that no
/// library can see (the name of a field that is not compared, say), `ODYN_WRITE_LAYOUT=1 cargo test -p element-api` writes
/// the text anew.
#[test]
#[cfg(target_pointer_width = "64")]
fn layout_of_v1_is_the_committed_one() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/abi-v1.layout.txt");
    if std::env::var_os("ODYN_WRITE_LAYOUT").is_some() {
        std::fs::write(path, v1_layout_text()).expect("the file can be written");
    }
    let committed = std::fs::read_to_string(path).expect("the file is committed").replace("\r\n", "\n");
    assert!(
        committed == v1_layout_text(),
        "types that cross the binary interface have changed; compare src/abi-v1.layout.txt with \
         ODYN_WRITE_LAYOUT=1 cargo test -p element-api"
    );
}
