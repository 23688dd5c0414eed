//! The functions of FMI 2.0.4 for co-simulation.

// Foreign functions cannot be called safely. Each call passes memory that lives until it returns.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::ptr;

use crate::description::Storage;
use crate::library::{Log, Making, Status, symbol, text};

type Component = *mut c_void;
type Set<T> = unsafe extern "C" fn(Component, *const c_uint, usize, *const T) -> c_int;
type Get<T> = unsafe extern "C" fn(Component, *const c_uint, usize, *mut T) -> c_int;
type Plain = unsafe extern "C" fn(Component) -> c_int;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> Component;

/// What an FMU may call. The logger takes further arguments behind these in C; they are not looked at, and the caller cleans up.
#[repr(C)]
struct Callbacks {
    logger: unsafe extern "C" fn(*const c_void, *const c_char, c_int, *const c_char, *const c_char),
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    step_finished: *const c_void,
    environment: *const c_void,
}

unsafe extern "C" fn log(
    log: *const c_void,
    _: *const c_char,
    status: c_int,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment that was given, and the text of the FMU.
    unsafe { Log::take(log, status, message) };
}

unsafe extern "C" fn allocate(number: usize, size: usize) -> *mut c_void {
    // SAFETY: plain numbers.
    unsafe { libc::calloc(number, size) }
}

unsafe extern "C" fn free(memory: *mut c_void) {
    // SAFETY: what `allocate` gave, or null.
    unsafe { libc::free(memory) };
}

/// Its functions for states.
pub(crate) const STATES: [&str; 6] = [
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
    "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate",
    "fmi2DeSerializeFMUstate",
];

/// See the module documentation.
pub(crate) struct Functions {
    instantiate: Instantiate,
    free_instance: unsafe extern "C" fn(Component),
    setup: unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> c_int,
    enter_initialization: Plain,
    exit_initialization: Plain,
    terminate: Plain,
    set_real: Set<f64>,
    set_integer: Set<c_int>,
    set_boolean: Set<c_int>,
    set_string: Set<*const c_char>,
    get_real: Get<f64>,
    get_integer: Get<c_int>,
    get_boolean: Get<c_int>,
    do_step: unsafe extern "C" fn(Component, f64, f64, c_int) -> c_int,
    boolean_status: Option<unsafe extern "C" fn(Component, c_int, *mut c_int) -> c_int>,
}

impl Functions {
    pub(crate) fn find(library: &libloading::Library) -> Result<Self, String> {
        // SAFETY: the types that the standard gives these functions.
        unsafe {
            Ok(Self {
                instantiate: symbol(library, "fmi2Instantiate")?,
                free_instance: symbol(library, "fmi2FreeInstance")?,
                setup: symbol(library, "fmi2SetupExperiment")?,
                enter_initialization: symbol(library, "fmi2EnterInitializationMode")?,
                exit_initialization: symbol(library, "fmi2ExitInitializationMode")?,
                terminate: symbol(library, "fmi2Terminate")?,
                set_real: symbol(library, "fmi2SetReal")?,
                set_integer: symbol(library, "fmi2SetInteger")?,
                set_boolean: symbol(library, "fmi2SetBoolean")?,
                set_string: symbol(library, "fmi2SetString")?,
                get_real: symbol(library, "fmi2GetReal")?,
                get_integer: symbol(library, "fmi2GetInteger")?,
                get_boolean: symbol(library, "fmi2GetBoolean")?,
                do_step: symbol(library, "fmi2DoStep")?,
                boolean_status: symbol(library, "fmi2GetBooleanStatus").ok(),
            })
        }
    }

    /// Makes an instance; the second pointer is memory that must outlive it.
    pub(crate) fn instantiate(&self, making: &Making<'_>) -> Result<(Component, Box<dyn Send>), String> {
        let callbacks = Box::new(Held(Callbacks {
            logger: log,
            allocate,
            free,
            step_finished: ptr::null(),
            environment: making.log,
        }));
        let resources = format!("file://{}", making.resources.display());
        let (name, token, resources) = (text(making.name)?, text(&making.description.token)?, text(&resources)?);
        const CO_SIMULATION: c_int = 1;
        // SAFETY: texts and callbacks live on; the log does, too.
        let made = unsafe {
            (self.instantiate)(
                name.as_ptr(),
                CO_SIMULATION,
                token.as_ptr(),
                resources.as_ptr(),
                &raw const callbacks.0,
                0,
                1,
            )
        };
        if made.is_null() { Err("fmi2Instantiate gave no instance".into()) } else { Ok((made, callbacks)) }
    }

    pub(crate) fn enter(&self, c: Component, start: f64) -> (&'static str, Status) {
        // SAFETY: an instance that is alive.
        let done = unsafe { (self.setup)(c, 0, 0.0, start, 0, 0.0) };
        if Status::of(done) != Status::Fine {
            return ("fmi2SetupExperiment", Status::of(done));
        }
        // SAFETY: the same.
        ("fmi2EnterInitializationMode", Status::of(unsafe { (self.enter_initialization)(c) }))
    }

    pub(crate) fn exit(&self, c: Component) -> (&'static str, Status) {
        // SAFETY: an instance that is alive.
        ("fmi2ExitInitializationMode", Status::of(unsafe { (self.exit_initialization)(c) }))
    }

    pub(crate) fn set(&self, c: Component, storage: Storage, reference: u32, value: f64) -> (&'static str, Status) {
        let at = &raw const reference;
        let whole = if storage == Storage::Boolean { c_int::from(value > 0.5) } else { value as c_int };
        // SAFETY: an instance that is alive, one reference, one value.
        let (name, done) = unsafe {
            match storage {
                Storage::Float64 => ("fmi2SetReal", (self.set_real)(c, at, 1, &raw const value)),
                Storage::Boolean => ("fmi2SetBoolean", (self.set_boolean)(c, at, 1, &raw const whole)),
                _ => ("fmi2SetInteger", (self.set_integer)(c, at, 1, &raw const whole)),
            }
        };
        (name, Status::of(done))
    }

    pub(crate) fn set_text(&self, c: Component, reference: u32, value: &str) -> Result<(&'static str, Status), String> {
        let value = text(value)?;
        let pointer = value.as_ptr();
        // SAFETY: an instance that is alive, one reference, one text.
        let done = unsafe { (self.set_string)(c, &raw const reference, 1, &raw const pointer) };
        Ok(("fmi2SetString", Status::of(done)))
    }

    pub(crate) fn get(
        &self,
        c: Component,
        storage: Storage,
        reference: u32,
        value: &mut f64,
    ) -> (&'static str, Status) {
        let at = &raw const reference;
        let mut whole: c_int = 0;
        // SAFETY: an instance that is alive, one reference, room for one value.
        let (name, done) = unsafe {
            match storage {
                Storage::Float64 => return ("fmi2GetReal", Status::of((self.get_real)(c, at, 1, value))),
                Storage::Boolean => ("fmi2GetBoolean", (self.get_boolean)(c, at, 1, &raw mut whole)),
                _ => ("fmi2GetInteger", (self.get_integer)(c, at, 1, &raw mut whole)),
            }
        };
        *value = f64::from(whole);
        (name, Status::of(done))
    }

    /// Whether it wants to end, where it says so, comes with the status.
    pub(crate) fn step(&self, c: Component, from: f64, step: f64) -> (&'static str, Status, bool) {
        const NOT_REPEATED: c_int = 1;
        const TERMINATED: c_int = 3;
        // SAFETY: an instance that is alive.
        let status = Status::of(unsafe { (self.do_step)(c, from, step, NOT_REPEATED) });
        let mut ends: c_int = 0;
        if let (Status::Discard, Some(ask)) = (status, self.boolean_status) {
            // SAFETY: an instance that is alive, room for one value.
            unsafe { ask(c, TERMINATED, &raw mut ends) };
        }
        ("fmi2DoStep", status, ends != 0)
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

/// Callbacks with the address of a log, which may be used from any thread.
struct Held(Callbacks);

// SAFETY: functions without state and the address of a log behind a lock.
unsafe impl Send for Held {}
