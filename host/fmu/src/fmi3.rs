//! The functions of FMI 3.0.2 for co-simulation.

// Foreign functions cannot be called safely. Each call passes memory that lives until it returns.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_void};
use std::ptr;

use crate::description::Storage;
use crate::library::{Log, Making, Status, symbol, text};

type Component = *mut c_void;
type Set<T> = unsafe extern "C" fn(Component, *const u32, usize, *const T, usize) -> c_int;
type Get<T> = unsafe extern "C" fn(Component, *const u32, usize, *mut T, usize) -> c_int;
type Plain = unsafe extern "C" fn(Component) -> c_int;
type Logger = unsafe extern "C" fn(*const c_void, c_int, *const c_char, *const c_char);
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_char,
    bool,
    bool,
    bool,
    bool,
    *const u32,
    usize,
    *const c_void,
    Logger,
    *const c_void,
) -> Component;

unsafe extern "C" fn log(log: *const c_void, status: c_int, _: *const c_char, message: *const c_char) {
    // SAFETY: the environment that was given, and the text of the FMU.
    unsafe { Log::take(log, status, message) };
}

/// Functions that set and get numbers of one type; those of types without variables may be missing.
struct Access<T> {
    set: Option<Set<T>>,
    get: Option<Get<T>>,
}

impl<T: Copy + Default> Access<T> {
    /// # Safety
    /// `T` is the type that the standard gives the functions.
    unsafe fn find(library: &libloading::Library, word: &str) -> Self {
        // SAFETY: the caller's word.
        unsafe {
            Self {
                set: symbol(library, &format!("fmi3Set{word}")).ok(),
                get: symbol(library, &format!("fmi3Get{word}")).ok(),
            }
        }
    }

    fn set(&self, c: Component, reference: u32, value: T) -> Status {
        // SAFETY: an instance that is alive, one reference, one value.
        self.set
            .map_or(Status::Error, |set| Status::of(unsafe { set(c, &raw const reference, 1, &raw const value, 1) }))
    }

    fn get(&self, c: Component, reference: u32) -> (T, Status) {
        let mut value = T::default();
        // SAFETY: an instance that is alive, one reference, room for one value.
        let done = self
            .get
            .map_or(Status::Error, |get| Status::of(unsafe { get(c, &raw const reference, 1, &raw mut value, 1) }));
        (value, done)
    }
}

/// Its functions for states.
pub(crate) const STATES: [&str; 6] = [
    "fmi3GetFMUState",
    "fmi3SetFMUState",
    "fmi3FreeFMUState",
    "fmi3SerializedFMUStateSize",
    "fmi3SerializeFMUState",
    "fmi3DeserializeFMUState",
];

/// See the module documentation.
pub(crate) struct Functions {
    instantiate: Instantiate,
    free_instance: unsafe extern "C" fn(Component),
    enter_initialization: unsafe extern "C" fn(Component, bool, f64, f64, bool, f64) -> c_int,
    exit_initialization: Plain,
    terminate: Plain,
    float64: Access<f64>,
    float32: Access<f32>,
    int8: Access<i8>,
    uint8: Access<u8>,
    int16: Access<i16>,
    uint16: Access<u16>,
    int32: Access<i32>,
    uint32: Access<u32>,
    int64: Access<i64>,
    uint64: Access<u64>,
    /// C's `bool` is a byte; nothing but 0 and 1 is passed on.
    boolean: Access<u8>,
    set_string: Option<Set<*const c_char>>,
    do_step: unsafe extern "C" fn(Component, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> c_int,
}

impl Functions {
    pub(crate) fn find(library: &libloading::Library) -> Result<Self, String> {
        // SAFETY: the types that the standard gives these functions.
        unsafe {
            Ok(Self {
                instantiate: symbol(library, "fmi3InstantiateCoSimulation")?,
                free_instance: symbol(library, "fmi3FreeInstance")?,
                enter_initialization: symbol(library, "fmi3EnterInitializationMode")?,
                exit_initialization: symbol(library, "fmi3ExitInitializationMode")?,
                terminate: symbol(library, "fmi3Terminate")?,
                float64: Access::find(library, "Float64"),
                float32: Access::find(library, "Float32"),
                int8: Access::find(library, "Int8"),
                uint8: Access::find(library, "UInt8"),
                int16: Access::find(library, "Int16"),
                uint16: Access::find(library, "UInt16"),
                int32: Access::find(library, "Int32"),
                uint32: Access::find(library, "UInt32"),
                int64: Access::find(library, "Int64"),
                uint64: Access::find(library, "UInt64"),
                boolean: Access::find(library, "Boolean"),
                set_string: symbol(library, "fmi3SetString").ok(),
                do_step: symbol(library, "fmi3DoStep")?,
            })
        }
    }

    /// Makes an instance; what comes with it must outlive it.
    pub(crate) fn instantiate(&self, making: &Making<'_>) -> Result<(Component, Box<dyn Send>), String> {
        let resources = format!("{}/", making.resources.display());
        let (name, token, resources) = (text(making.name)?, text(&making.description.token)?, text(&resources)?);
        // SAFETY: texts live until it returns, the log as long as the instance. No event mode, no early return.
        let made = unsafe {
            (self.instantiate)(
                name.as_ptr(),
                token.as_ptr(),
                resources.as_ptr(),
                false,
                true,
                false,
                false,
                ptr::null(),
                0,
                making.log,
                log,
                ptr::null(),
            )
        };
        if made.is_null() {
            Err("fmi3InstantiateCoSimulation gave no instance".into())
        } else {
            Ok((made, Box::new(())))
        }
    }

    pub(crate) fn enter(&self, c: Component, start: f64) -> (&'static str, Status) {
        // SAFETY: an instance that is alive.
        let done = unsafe { (self.enter_initialization)(c, false, 0.0, start, false, 0.0) };
        ("fmi3EnterInitializationMode", Status::of(done))
    }

    pub(crate) fn exit(&self, c: Component) -> (&'static str, Status) {
        // SAFETY: an instance that is alive.
        ("fmi3ExitInitializationMode", Status::of(unsafe { (self.exit_initialization)(c) }))
    }

    pub(crate) fn set(&self, c: Component, storage: Storage, at: u32, value: f64) -> (&'static str, Status) {
        match storage {
            Storage::Float64 => ("fmi3SetFloat64", self.float64.set(c, at, value)),
            Storage::Float32 => ("fmi3SetFloat32", self.float32.set(c, at, value as f32)),
            Storage::Int8 => ("fmi3SetInt8", self.int8.set(c, at, value as i8)),
            Storage::UInt8 => ("fmi3SetUInt8", self.uint8.set(c, at, value as u8)),
            Storage::Int16 => ("fmi3SetInt16", self.int16.set(c, at, value as i16)),
            Storage::UInt16 => ("fmi3SetUInt16", self.uint16.set(c, at, value as u16)),
            Storage::Int32 => ("fmi3SetInt32", self.int32.set(c, at, value as i32)),
            Storage::UInt32 => ("fmi3SetUInt32", self.uint32.set(c, at, value as u32)),
            Storage::Int64 | Storage::Text => ("fmi3SetInt64", self.int64.set(c, at, value as i64)),
            Storage::UInt64 => ("fmi3SetUInt64", self.uint64.set(c, at, value as u64)),
            Storage::Boolean => ("fmi3SetBoolean", self.boolean.set(c, at, u8::from(value > 0.5))),
        }
    }

    pub(crate) fn set_text(&self, c: Component, reference: u32, value: &str) -> Result<(&'static str, Status), String> {
        let value = text(value)?;
        let pointer = value.as_ptr();
        let set = self.set_string.ok_or("its binary has no function `fmi3SetString`")?;
        // SAFETY: an instance that is alive, one reference, one text.
        let done = unsafe { set(c, &raw const reference, 1, &raw const pointer, 1) };
        Ok(("fmi3SetString", Status::of(done)))
    }

    pub(crate) fn get(&self, c: Component, storage: Storage, at: u32, value: &mut f64) -> (&'static str, Status) {
        let (name, (number, status)) = match storage {
            Storage::Float64 => ("fmi3GetFloat64", self.float64.get(c, at)),
            Storage::Float32 => ("fmi3GetFloat32", wide(self.float32.get(c, at))),
            Storage::Int8 => ("fmi3GetInt8", wide(self.int8.get(c, at))),
            Storage::UInt8 => ("fmi3GetUInt8", wide(self.uint8.get(c, at))),
            Storage::Int16 => ("fmi3GetInt16", wide(self.int16.get(c, at))),
            Storage::UInt16 => ("fmi3GetUInt16", wide(self.uint16.get(c, at))),
            Storage::Int32 => ("fmi3GetInt32", wide(self.int32.get(c, at))),
            Storage::UInt32 => ("fmi3GetUInt32", wide(self.uint32.get(c, at))),
            Storage::Int64 | Storage::Text => {
                let (number, status) = self.int64.get(c, at);
                ("fmi3GetInt64", (number as f64, status))
            }
            Storage::UInt64 => {
                let (number, status) = self.uint64.get(c, at);
                ("fmi3GetUInt64", (number as f64, status))
            }
            Storage::Boolean => ("fmi3GetBoolean", wide(self.boolean.get(c, at))),
        };
        *value = number;
        (name, status)
    }

    /// Whether it wants to end comes with the status.
    pub(crate) fn step(&self, c: Component, from: f64, step: f64) -> (&'static str, Status, bool) {
        let (mut event, mut ends, mut early, mut last) = (0, 0, 0, 0.0);
        // SAFETY: an instance that is alive, room for what it gives.
        let done = unsafe {
            (self.do_step)(c, from, step, true, &raw mut event, &raw mut ends, &raw mut early, &raw mut last)
        };
        // Early return was not allowed: whoever does it all the same has not made the step.
        let status = match Status::of(done) {
            Status::Fine if early != 0 && ends == 0 => Status::Discard,
            status => status,
        };
        ("fmi3DoStep", status, ends != 0)
    }

    /// Ends an instance, which is not used any more.
    pub(crate) fn end(&self, c: Component, terminate: bool) {
        // SAFETY: an instance that is alive.
        unsafe {
            if terminate {
                (self.terminate)(c);
            }
            (self.free_instance)(c);
        }
    }
}

fn wide<T: Into<f64>>((number, status): (T, Status)) -> (f64, Status) {
    (number.into(), status)
}
