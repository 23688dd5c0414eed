//! The structs of `odyn_element.h`, field by field; what they mean is written there. A test holds the layouts together.

use std::ffi::{c_char, c_void};

use element_api::Interpolation;

/// `ODYN_OK`
pub const OK: i32 = 0;
/// `ODYN_FAULT`
pub const FAULT: i32 = 1;
/// `ODYN_REFUSED`
pub const REFUSED: i32 = 2;
/// `ODYN_ABSENT`
pub const ABSENT: i32 = 3;

/// `ODYN_SPLINE` and so on: above the four bits of the continuation.
pub const INTERPOLATIONS: [(u32, Interpolation); 4] = [
    (0x00, Interpolation::Spline),
    (0x10, Interpolation::Monotone),
    (0x20, Interpolation::Linear),
    (0x30, Interpolation::Steps),
];

/// `ODYN_OPAQUE`
pub const OPAQUE: u32 = 1;
/// `ODYN_GIVES_DERIVATIVES`
pub const GIVES_DERIVATIVES: u32 = 2;
/// `ODYN_HAS_MOBILITY`
pub const HAS_MOBILITY: u32 = 4;
/// `ODYN_TURNS_FREELY`
pub const TURNS_FREELY: u32 = 8;
/// `ODYN_GIVES_POTENTIAL`
pub const GIVES_POTENTIAL: u32 = 16;
/// `ODYN_GIVES_DISSIPATION`
pub const GIVES_DISSIPATION: u32 = 32;

/// All of them.
pub const FLAGS: u32 = OPAQUE | GIVES_DERIVATIVES | HAS_MOBILITY | TURNS_FREELY | GIVES_POTENTIAL | GIVES_DISSIPATION;

/// `ODYN_WANT_JACOBIAN`
pub const WANT_JACOBIAN: u32 = 1;
/// `ODYN_WANT_SECOND`
pub const WANT_SECOND: u32 = 2;

/// `odyn_plugin`
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Plugin {
    pub size: u32,
    pub abi: u32,
    pub conventions: u32,
    pub reserved: u32,
    pub elements: *const *const Element,
    pub element_count: usize,
    pub manifest: *const c_char,
}

/// `odyn_named`
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Named {
    pub name: *const c_char,
    pub unit: *const c_char,
    pub doc: *const c_char,
}

/// `odyn_signal`
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Signal {
    pub name: *const c_char,
    pub unit: *const c_char,
    pub doc: *const c_char,
    pub value: *const c_char,
}

/// `odyn_parameter`
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Parameter {
    pub name: *const c_char,
    pub kind: u32,
    pub optional: u32,
    pub unit: *const c_char,
    pub doc: *const c_char,
    pub value: *const c_char,
    pub range: *const c_char,
    pub choices: *const c_char,
    pub variable: *const c_char,
}

/// `odyn_text`
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Text {
    pub name: *const c_char,
    pub text: *const c_char,
}

/// `odyn_error`
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Error {
    pub size: u32,
    pub reserved: u32,
    pub parameter: [u8; 64],
    pub message: [u8; 1024],
}

/// `odyn_value`
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Value {
    pub tape: u32,
    pub node: u32,
}

/// `odyn_parameters`
#[repr(C)]
pub struct Parameters {
    pub size: u32,
    pub reserved: u32,
    pub context: *mut c_void,
    pub number: extern "C" fn(*mut c_void, *const c_char, *mut f64) -> i32,
    pub integer: extern "C" fn(*mut c_void, *const c_char, *mut i64) -> i32,
    pub text: extern "C" fn(*mut c_void, *const c_char, *mut *const c_char) -> i32,
    pub numbers: extern "C" fn(*mut c_void, *const c_char, *mut *const f64, *mut usize) -> i32,
}

/// `odyn_recorder`
#[repr(C)]
pub struct Recorder {
    pub size: u32,
    pub reserved: u32,
    pub context: *mut c_void,
    pub constant: extern "C" fn(*mut c_void, f64) -> Value,
    pub input: extern "C" fn(*mut c_void, u32, u32) -> Value,
    pub operation: extern "C" fn(*mut c_void, u32, Value, Value, Value, Value) -> Value,
    pub power: extern "C" fn(*mut c_void, Value, i32) -> Value,
    pub real_power: extern "C" fn(*mut c_void, Value, f64) -> Value,
    pub table: extern "C" fn(*mut c_void, Value, *const f64, usize, u32) -> Value,
    pub function: extern "C" fn(*mut c_void, *const c_char, Value) -> Value,
    pub result: extern "C" fn(*mut c_void, u32, u32, Value),
    pub surface: extern "C" fn(*mut c_void, *const c_char, Value, Value) -> Value,
    pub slope: extern "C" fn(*mut c_void, *const c_char, Value) -> Value,
}

/// `odyn_element`. Calls may unwind (C++ exceptions), which ends the program with a message instead of anything worse.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Element {
    pub size: u32,
    pub kind: u32,
    pub name: *const c_char,
    pub summary: *const c_char,
    pub doc: *const c_char,
    pub flags: u32,
    pub angles: u32,
    pub mobility: u32,
    pub memory: u32,
    pub frames: *const Named,
    pub frame_count: usize,
    pub rows: *const *const c_char,
    pub row_count: usize,
    pub channels: *const Named,
    pub channel_count: usize,
    pub states: *const Named,
    pub state_count: usize,
    pub inputs: *const Signal,
    pub input_count: usize,
    pub joints: *const Named,
    pub joint_count: usize,
    pub parameters: *const Parameter,
    pub parameter_count: usize,
    pub difference_length: f64,
    pub difference_time: f64,
    pub create: Option<extern "C-unwind" fn(*const Parameters, *mut *mut c_void, *mut Error) -> i32>,
    pub destroy: Option<extern "C-unwind" fn(*mut c_void)>,
    pub uses_row: Option<extern "C-unwind" fn(*const c_void, u32) -> i32>,
    pub start: Option<extern "C-unwind" fn(*const c_void, *mut f64, *mut f64)>,
    pub record: Option<extern "C-unwind" fn(*const c_void, *const Recorder, *mut Error) -> i32>,
    pub evaluate: Option<extern "C-unwind" fn(*const c_void, *const f64, u32, *mut f64, *mut Error) -> i32>,
    pub accept: Option<extern "C-unwind" fn(*mut c_void, *const f64, *mut Error) -> i32>,
    pub save: Option<extern "C-unwind" fn(*const c_void, *mut u8, usize) -> usize>,
    pub load: Option<extern "C-unwind" fn(*mut c_void, *const u8, usize, *mut Error) -> i32>,
    pub velocity_row_count: usize,
    pub examples: *const Text,
    pub example_count: usize,
    pub exempt: *const Text,
    pub exempt_count: usize,
    pub unknowns: *const Named,
    pub unknown_count: usize,
    pub guess: Option<extern "C-unwind" fn(*const c_void, *mut f64)>,
    pub more_frames: *const Named,
    pub most_frames: u32,
    pub reserved: u32,
    pub with_frames: Option<extern "C-unwind" fn(*mut c_void, u32, *mut Error) -> i32>,
    pub checks: *const Named,
    pub check_count: usize,
    pub catalog: *const c_char,
    pub report: *const c_char,
    pub values: *const Named,
    pub value_count: usize,
}

impl Element {
    /// The size that it had in contract 1.0.
    pub const SHORTEST: usize = std::mem::offset_of!(Self, velocity_row_count);
}

impl Error {
    /// An empty one, as functions get it.
    pub fn empty() -> Self {
        Self { size: size_of::<Self>() as u32, reserved: 0, parameter: [0; 64], message: [0; 1024] }
    }

    /// What a function wrote: the parameter and the message.
    pub fn texts(&self) -> (String, String) {
        let message = text(&self.message);
        (text(&self.parameter), if message.is_empty() { "failed without a message".into() } else { message })
    }
}

/// The text up to the first zero, or all of it.
fn text(bytes: &[u8]) -> String {
    let bytes = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(bytes).into_owned()
}
