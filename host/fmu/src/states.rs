//! States of instances as bytes: six functions that both versions of the interface have, with other names.

// Foreign functions cannot be called safely. Each call passes memory that lives until it returns.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};
use std::ptr;

use crate::library::{Status, symbol};

type Component = *mut c_void;
type Made = unsafe extern "C" fn(Component, *mut *mut c_void) -> c_int;

/// Bytes that a state may have.
const MOST: usize = 1 << 28;

/// The functions of a binary that has them.
pub(crate) struct States {
    names: &'static [&'static str; 6],
    get: Option<Made>,
    set: Option<unsafe extern "C" fn(Component, *mut c_void) -> c_int>,
    free: Option<Made>,
    size: Option<unsafe extern "C" fn(Component, *mut c_void, *mut usize) -> c_int>,
    serialize: Option<unsafe extern "C" fn(Component, *mut c_void, *mut u8, usize) -> c_int>,
    deserialize: Option<unsafe extern "C" fn(Component, *const u8, usize, *mut *mut c_void) -> c_int>,
}

impl States {
    /// The functions of these names: get, set, free, size, serialise, deserialise.
    ///
    /// # Safety
    /// They are those of the standard.
    pub(crate) unsafe fn find(library: &libloading::Library, names: &'static [&'static str; 6]) -> Self {
        // SAFETY: the types that the standard gives these functions.
        unsafe {
            Self {
                names,
                get: symbol(library, names[0]).ok(),
                set: symbol(library, names[1]).ok(),
                free: symbol(library, names[2]).ok(),
                size: symbol(library, names[3]).ok(),
                serialize: symbol(library, names[4]).ok(),
                deserialize: symbol(library, names[5]).ok(),
            }
        }
    }

    pub(crate) fn save(&self, c: Component) -> Result<Vec<u8>, String> {
        let (Some(get), Some(size), Some(write), Some(free)) = (self.get, self.size, self.serialize, self.free) else {
            return Err("its binary lacks the functions that save its state".into());
        };
        let mut state = ptr::null_mut();
        let mut length = 0;
        // SAFETY: an instance that is alive; the state is freed below, by the one that made it.
        unsafe {
            checked(self.names[0], get(c, &raw mut state))?;
            let written = checked(self.names[3], size(c, state, &raw mut length)).and_then(|()| {
                if length > MOST {
                    return Err(format!("its state has {length} bytes; at most {MOST} are kept"));
                }
                let mut bytes = vec![0; length];
                checked(self.names[4], write(c, state, bytes.as_mut_ptr(), length)).map(|()| bytes)
            });
            free(c, &raw mut state);
            written
        }
    }

    pub(crate) fn load(&self, c: Component, bytes: &[u8]) -> Result<(), String> {
        let (Some(read), Some(set), Some(free)) = (self.deserialize, self.set, self.free) else {
            return Err("its binary lacks the functions that restore its state".into());
        };
        let mut state = ptr::null_mut();
        // SAFETY: an instance that is alive, bytes of this length; the state is freed by the one that made it.
        unsafe {
            checked(self.names[5], read(c, bytes.as_ptr(), bytes.len(), &raw mut state))?;
            let done = checked(self.names[1], set(c, state));
            free(c, &raw mut state);
            done
        }
    }
}

fn checked(function: &str, status: c_int) -> Result<(), String> {
    match Status::of(status) {
        Status::Fine => Ok(()),
        other => Err(format!("{function} returned {}", other.words())),
    }
}
