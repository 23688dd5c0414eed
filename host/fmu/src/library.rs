//! The binary of an FMU: loaded, its functions found; what is alike in both versions of the interface.

// Foreign functions cannot be found and called safely. Each call passes memory that lives until it returns.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_void};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicUsize;

use crate::description::{Description, Storage, Version};
use crate::states::States;
use crate::{fmi2, fmi3};

/// Messages of an FMU that are kept for the next failure.
const MOST_MESSAGES: usize = 6;
/// Characters of each.
const LONGEST: usize = 400;

/// The functions of a binary. It stays loaded: what it has started may still run.
pub(crate) enum Functions {
    Two(fmi2::Functions),
    Three(fmi3::Functions),
}

/// A binary that is loaded.
pub(crate) struct Library {
    pub(crate) functions: Functions,
    pub(crate) states: States,
    /// Instances that are alive.
    pub(crate) alive: AtomicUsize,
}

impl Library {
    pub(crate) fn load(path: &Path, version: Version) -> Result<Self, String> {
        // SAFETY: runs the library's initialisers, which is what naming an FMU in a scene asks for.
        let library = unsafe { libloading::Library::new(path) }
            .map_err(|error| format!("its binary cannot be loaded: {error}"))?;
        let functions = match version {
            Version::Two => Functions::Two(fmi2::Functions::find(&library)?),
            Version::Three => Functions::Three(fmi3::Functions::find(&library)?),
        };
        let names = match version {
            Version::Two => &fmi2::STATES,
            Version::Three => &fmi3::STATES,
        };
        // SAFETY: the names that the standard gives.
        let states = unsafe { States::find(&library, names) };
        std::mem::forget(library);
        Ok(Self { functions, states, alive: AtomicUsize::new(0) })
    }
}

/// A function of a binary, of a type that its standard gives it.
///
/// # Safety
/// `F` is that type.
pub(crate) unsafe fn symbol<F: Copy>(library: &libloading::Library, name: &str) -> Result<F, String> {
    let text = CString::new(name).map_err(|error| error.to_string())?;
    // SAFETY: the caller's word; the library is never unloaded.
    let found = unsafe { library.get::<F>(text.as_bytes_with_nul()) };
    found.map(|found| *found).map_err(|_| format!("its binary has no function `{name}`"))
}

/// What a function returns, in either version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    Fine,
    Discard,
    Error,
    Fatal,
    Strange(i32),
}

impl Status {
    pub(crate) fn of(number: i32) -> Self {
        match number {
            0 | 1 => Self::Fine,
            2 => Self::Discard,
            3 => Self::Error,
            4 => Self::Fatal,
            other => Self::Strange(other),
        }
    }

    pub(crate) fn words(self) -> String {
        match self {
            Self::Fine => "ok".into(),
            Self::Discard => "discard".into(),
            Self::Error => "error".into(),
            Self::Fatal => "fatal".into(),
            Self::Strange(number) => format!("status {number}"),
        }
    }
}

/// What an instance has logged lately. Its address goes to the FMU.
#[derive(Debug, Default)]
pub(crate) struct Log(Mutex<Vec<String>>);

impl Log {
    /// Called from the functions that an FMU logs with.
    ///
    /// # Safety
    /// `log` is null or the address of a log that is alive; `message` is null or a text that ends with a zero.
    pub(crate) unsafe fn take(log: *const c_void, status: i32, message: *const c_char) {
        if log.is_null() || message.is_null() || Status::of(status) == Status::Fine {
            return;
        }
        // SAFETY: the caller's word.
        let (log, text) = unsafe { (&*log.cast::<Self>(), CStr::from_ptr(message)) };
        let text: String =
            text.to_string_lossy().chars().map(|c| if c.is_control() { ' ' } else { c }).take(LONGEST).collect();
        let mut kept = log.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if kept.len() == MOST_MESSAGES {
            kept.remove(0);
        }
        kept.push(text.trim().to_string());
    }

    /// What was logged since, in words.
    pub(crate) fn said(&self) -> String {
        let kept = std::mem::take(&mut *self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
        if kept.is_empty() { String::new() } else { format!("; it says: {}", kept.join(" | ")) }
    }
}

/// A place in memory as C expects it.
pub(crate) fn text(text: &str) -> Result<CString, String> {
    CString::new(text)
        .map_err(|_| format!("\"{}\" has a zero in it, which no text of an FMU may have", text.escape_debug()))
}

/// How an instance is made.
pub(crate) struct Making<'a> {
    pub(crate) description: &'a Description,
    pub(crate) name: &'a str,
    pub(crate) resources: &'a Path,
    pub(crate) log: *const c_void,
}

/// The least and largest number of a type of whole numbers.
pub(crate) fn limits(storage: Storage) -> Option<(f64, f64)> {
    Some(match storage {
        Storage::Int8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        Storage::UInt8 => (0.0, f64::from(u8::MAX)),
        Storage::Int16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        Storage::UInt16 => (0.0, f64::from(u16::MAX)),
        Storage::Int32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        Storage::UInt32 => (0.0, f64::from(u32::MAX)),
        // Beyond 2^53 a number of 64 bits does not tell whole numbers apart.
        Storage::Int64 => (-9_007_199_254_740_992.0, 9_007_199_254_740_992.0),
        Storage::UInt64 => (0.0, 9_007_199_254_740_992.0),
        _ => return None,
    })
}
