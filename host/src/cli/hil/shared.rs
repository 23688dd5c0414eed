//! Packets in shared memory (POSIX): a head, then an area for each direction.
//!
//! | bytes | content |
//! |---|---|
//! | 0..4 | `ODYN`, written when all else is ready |
//! | 4..8 | version of this format: 1 |
//! | 8..16 | where the area of inputs begins, where that of outputs does (4 bytes each) |
//!
//! An area is a counter (8 bytes) and behind it a packet. Who writes makes the counter odd, writes the packet, and makes it even; who
//! reads takes a packet only if the counter was the same even number before and after. A counter that has not changed: no new packet.

// Memory that two programs share is read and written through pointers; each word that synchronizes it is atomic.
#![allow(unsafe_code)]

use std::io;

use super::packet::Packet;
#[cfg(unix)]
use super::packet::{HEAD, VERSION};

/// See the module documentation.
pub(super) struct Shared {
    name: String,
    #[cfg(unix)]
    memory: Memory,
    #[cfg(unix)]
    inputs: (usize, usize),
    #[cfg(unix)]
    outputs: usize,
    #[cfg(unix)]
    seen: u64,
}

#[cfg(not(unix))]
impl Shared {
    pub(super) fn create(_: &str, _: usize, _: usize) -> io::Result<Self> {
        Err(io::Error::other("this system has none of POSIX; use --udp"))
    }
    pub(super) fn name(&self) -> &str {
        &self.name
    }
    pub(super) fn receive(&mut self, _: &mut Packet) -> bool {
        false
    }
    pub(super) fn send(&mut self, _: &Packet) {}
}

#[cfg(unix)]
struct Memory {
    at: *mut u8,
    length: usize,
    path: std::ffi::CString,
}

#[cfg(unix)]
impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: what `create` mapped; nobody uses it any more here.
        unsafe {
            libc::munmap(self.at.cast(), self.length);
            libc::shm_unlink(self.path.as_ptr());
        }
    }
}

#[cfg(unix)]
impl Shared {
    /// Makes new shared memory of a name that nobody has.
    ///
    /// # Errors
    /// The system's reason.
    pub(super) fn create(name: &str, inputs: usize, outputs: usize) -> io::Result<Self> {
        if name.is_empty() || name.contains('/') || name.len() > 200 {
            return Err(io::Error::other("it is no name: letters, digits, `-` and `_`, no slash"));
        }
        let path = std::ffi::CString::new(format!("/{name}")).map_err(io::Error::other)?;
        const FIRST: usize = 64;
        // An area is a multiple of 64 bytes, so that no two share a line of the cache.
        let area = |values: usize| (8 + HEAD + 8 * values).next_multiple_of(64);
        let (inputs_at, outputs_at) = (FIRST, FIRST + area(inputs));
        let length = outputs_at + area(outputs);
        // SAFETY: a text and plain numbers.
        let file = unsafe { libc::shm_open(path.as_ptr(), libc::O_CREAT | libc::O_EXCL | libc::O_RDWR, 0o600) };
        if file < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: a file that was opened, which the mapping outlives.
        let at = unsafe {
            let sized = libc::ftruncate(file, length as libc::off_t);
            let at = if sized == 0 {
                libc::mmap(std::ptr::null_mut(), length, libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED, file, 0)
            } else {
                libc::MAP_FAILED
            };
            libc::close(file);
            at
        };
        if at == libc::MAP_FAILED {
            let error = io::Error::last_os_error();
            // SAFETY: a text.
            unsafe { libc::shm_unlink(path.as_ptr()) };
            return Err(error);
        }
        let memory = Memory { at: at.cast(), length, path };
        let shared =
            Self { name: name.into(), memory, inputs: (inputs_at, HEAD + 8 * inputs), outputs: outputs_at, seen: 0 };
        shared.write(4, &u32::from(VERSION).to_le_bytes());
        shared.write(8, &(inputs_at as u32).to_le_bytes());
        shared.write(12, &(outputs_at as u32).to_le_bytes());
        std::sync::atomic::fence(std::sync::atomic::Ordering::SeqCst);
        shared.write(0, b"ODYN");
        Ok(shared)
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    fn counter(&self, at: usize) -> &std::sync::atomic::AtomicU64 {
        // SAFETY: inside the mapping, a multiple of 64 from a page's start; only atomic words are read there.
        unsafe { std::sync::atomic::AtomicU64::from_ptr(self.memory.at.add(at).cast()) }
    }

    fn write(&self, at: usize, bytes: &[u8]) {
        assert!(at + bytes.len() <= self.memory.length);
        for (k, byte) in bytes.iter().enumerate() {
            // SAFETY: inside the mapping.
            unsafe { self.memory.at.add(at + k).write_volatile(*byte) };
        }
    }

    /// The packet of inputs, if there is another one than last time.
    pub(super) fn receive(&mut self, packet: &mut Packet) -> bool {
        use std::sync::atomic::{Ordering, fence};
        let (at, length) = self.inputs;
        let before = self.counter(at).load(Ordering::Acquire);
        if before == self.seen || !before.is_multiple_of(2) {
            return false;
        }
        for k in 0..length {
            // SAFETY: inside the mapping. What is torn is not used.
            packet.bytes[k] = unsafe { self.memory.at.add(at + 8 + k).read_volatile() };
        }
        fence(Ordering::Acquire);
        if self.counter(at).load(Ordering::Relaxed) != before {
            return false;
        }
        (self.seen, packet.length) = (before, length);
        true
    }

    /// Puts a packet of outputs there.
    pub(super) fn send(&mut self, packet: &Packet) {
        use std::sync::atomic::{Ordering, fence};
        let counter = self.counter(self.outputs);
        let now = counter.load(Ordering::Relaxed) | 1;
        counter.store(now, Ordering::Relaxed);
        fence(Ordering::Release);
        self.write(self.outputs + 8, &packet.bytes[..packet.length]);
        counter.store(now.wrapping_add(1), Ordering::Release);
    }
}
