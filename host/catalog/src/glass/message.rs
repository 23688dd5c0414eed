//! What the host asks a recorder and what comes back: a length (4 bytes, little-endian), then that many bytes of `postcard`.
//! Both ends are the same program, so nothing here has versions. Numbers arrive bit by bit as they were sent.

use std::borrow::Cow;
use std::io::{self, Read, Write};
use std::path::PathBuf;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Largest message, bytes: the largest recording has 4 million operations of at most 25 bytes.
const LARGEST: u32 = 1 << 28;

/// What is asked. The first request is [`Request::Open`] or [`Request::OpenFmu`], which is answered by an [`Opening`].
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(super) enum Request<'a> {
    /// Load this file: `Opening`.
    Open { copy: PathBuf },
    /// Take the FMU that is unpacked in this folder: `Opening`.
    OpenFmu { folder: PathBuf },
    /// The descriptor of a class as TOML: `Result<String, String>`.
    Describe { class: u32 },
    /// The number of a new set: `Result<u32, String>`.
    NewSet { class: u32 },
    /// A set is not needed any more: `()`.
    DropSet { set: u32 },
    /// `Result<u32, CreateError>`.
    Add { set: u32, params: Cow<'a, str> },
    /// `Result<Recording, Fault>`.
    Record { set: u32, instance: u32 },
    /// Results are written over `out`: `Result<Vec<f64>, Fault>`.
    Evaluate {
        set: u32,
        instances: Cow<'a, [u32]>,
        inputs: Cow<'a, [f64]>,
        jacobian: bool,
        second: bool,
        out: Cow<'a, [f64]>,
    },
    /// `Result<(), Fault>`.
    Accept { set: u32, instance: u32, inputs: Cow<'a, [f64]> },
    /// The discrete states are written over: `Result<Vec<f64>, Fault>`.
    Communicate { set: u32, instance: u32, t: f64, begins: bool, memory: Cow<'a, [f64]> },
    /// `Result<Vec<u8>, Fault>`.
    Save { set: u32, instance: u32 },
    /// `Result<(), Fault>`.
    Load { set: u32, instance: u32, memory: Cow<'a, [u8]> },
}

impl Request<'_> {
    /// What a user calls it, as for a library in this process.
    pub(super) fn function(&self) -> &'static str {
        match self {
            Self::Open { .. } | Self::OpenFmu { .. } => "loading the library",
            Self::Describe { .. } => "describe",
            Self::NewSet { .. } => "new set",
            Self::DropSet { .. } => "destroy",
            Self::Add { .. } => "create",
            Self::Record { .. } => "record",
            Self::Evaluate { .. } => "evaluate",
            Self::Accept { .. } => "accept",
            Self::Communicate { .. } => "communicate",
            Self::Save { .. } => "save",
            Self::Load { .. } => "load",
        }
    }
}

/// How loading went.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Opening {
    /// Why the library can't be used.
    pub opened: Result<(), element_api::abi::OpenError>,
    /// Whether it left the floating-point control register as it was.
    pub kept: bool,
}

/// In place of a length: the library broke the recorder while it was at the instance whose number follows (4 bytes).
pub(super) const BROKEN: [u8; 4] = [0xff; 4];

/// Why no message came.
#[derive(Debug)]
pub(super) enum Lost {
    /// The other end is closed, or was.
    Closed,
    /// What came is no message.
    Nonsense,
    /// The library broke the recorder at this instance.
    Broken(u32),
}

impl From<io::Error> for Lost {
    fn from(_: io::Error) -> Self {
        Self::Closed
    }
}

/// Sends one message.
pub(super) fn send<T: Serialize>(to: &mut impl Write, message: &T) -> io::Result<()> {
    let mut bytes = postcard::to_extend(message, vec![0; 4]).map_err(io::Error::other)?;
    let length = u32::try_from(bytes.len() - 4).ok().filter(|length| *length <= LARGEST);
    let length = length.ok_or_else(|| io::Error::other("a message is too long"))?;
    bytes[..4].copy_from_slice(&length.to_le_bytes());
    to.write_all(&bytes)?;
    to.flush()
}

/// Receives one message; `buffer` is scratch.
pub(super) fn receive<T: DeserializeOwned>(from: &mut impl Read, buffer: &mut Vec<u8>) -> Result<T, Lost> {
    let mut length = [0; 4];
    from.read_exact(&mut length)?;
    if length == BROKEN {
        let mut instance = [0; 4];
        from.read_exact(&mut instance)?;
        return Err(Lost::Broken(u32::from_le_bytes(instance)));
    }
    let length = u32::from_le_bytes(length);
    if length > LARGEST {
        return Err(Lost::Nonsense);
    }
    buffer.clear();
    // Grows with what really comes.
    if from.take(u64::from(length)).read_to_end(buffer)? < length as usize {
        return Err(Lost::Closed);
    }
    match postcard::take_from_bytes(buffer) {
        Ok((message, [])) => Ok(message),
        _ => Err(Lost::Nonsense),
    }
}
