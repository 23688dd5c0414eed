//! What a library answered before: equations belong to a library's content, a class and parameters, so they need not be asked for
//! twice. Kept in memory, and from start to start beside the private copy of the library.
//!
//! On disk there are [`SLOTS`] places per class, which are overwritten: studies of thousands of variants do not fill disks. Each
//! holds what it is the answer to, and begins with the checksum of all that. What is older than two weeks is removed with old
//! copies.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use element_api::descriptor::Descriptor;
use element_api::recording::{Limits, Recording};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::hash::sha256;
use crate::known::Identity;
use crate::private_copy::put;

/// The place of the answer whether a library can be opened: whether it left the floating-point control register as it was.
pub(super) const OPENED: &str = "opened";
/// Bytes of a checksum.
const CHECKSUM: usize = 32;
/// Places on disk per class.
const SLOTS: u8 = 64;
/// Recordings in memory; with more, all are forgotten.
const MOST: usize = 4096;
/// Larger answers are not kept on disk, bytes.
const LARGEST: usize = 1 << 20;

/// See the module documentation.
pub(super) struct Kept {
    /// The private copy, named after its content.
    copy: PathBuf,
    /// This very build of the program, whose form the answers have; `None`: nothing is kept on disk.
    program: Option<String>,
    recordings: Mutex<HashMap<(u32, String), Arc<Recording>>>,
}

impl Kept {
    /// For the library with this private copy, asked by this program.
    pub(super) fn of(copy: &Path, program: &Path) -> Self {
        let program = Identity::of(program).map(|identity| identity.to_string());
        Self { copy: copy.into(), program, recordings: Mutex::default() }
    }

    /// What an earlier start got in answer to `asked`.
    pub(super) fn read<T: DeserializeOwned>(&self, place: &str, asked: &str) -> Option<T> {
        let whose = self.whose(place)?;
        let bytes = fs::read(self.file(place)).ok()?;
        let (checksum, content) = bytes.split_at_checked(CHECKSUM)?;
        if Sha256::digest(content)[..] != *checksum {
            return None;
        }
        match postcard::from_bytes::<(String, String, T)>(content) {
            Ok((by, what, answer)) if by == whose && what == asked => Some(answer),
            _ => None,
        }
    }

    /// Keeps an answer. Not essential.
    pub(super) fn write<T: Serialize>(&self, place: &str, asked: &str, answer: &T) {
        let Some(whose) = self.whose(place) else { return };
        if let Ok(content) = postcard::to_stdvec(&(whose, asked, answer))
            && content.len() <= LARGEST
        {
            let _ = put(&self.file(place), &[&Sha256::digest(&content)[..], &content].concat());
        }
    }

    /// What a class says of itself, if that is known.
    pub(super) fn descriptor(&self, class: u32) -> Option<Descriptor> {
        let text: String = self.read(&class.to_string(), "")?;
        descriptor_of(&text).filter(|found| found.check().is_ok())
    }

    /// Keeps what a class says of itself, as JSON; not where that has no form for its numbers.
    pub(super) fn keep_descriptor(&self, class: u32, descriptor: &Descriptor) {
        if let Ok(text) = serde_json::to_string(descriptor)
            && descriptor_of(&text).as_ref() == Some(descriptor)
        {
            self.write(&class.to_string(), "", &text);
        }
    }

    /// The equations of an instance with these parameters, if they are known. What comes from the disk is within the `limits` of the
    /// class.
    pub(super) fn recording(&self, class: u32, params: &str, limits: &Limits) -> Option<Arc<Recording>> {
        let key = (class, params.to_string());
        if let Some(known) = self.recordings().get(&key) {
            return Some(Arc::clone(known));
        }
        let recording: Arc<Recording> = Arc::new(self.read(&slot(class, params), params)?);
        recording.check(limits).ok()?;
        self.recordings().insert(key, Arc::clone(&recording));
        Some(recording)
    }

    /// Keeps the equations of an instance with these parameters.
    pub(super) fn keep(&self, class: u32, params: &str, recording: &Arc<Recording>) {
        self.write(&slot(class, params), params, &**recording);
        let mut recordings = self.recordings();
        if recordings.len() >= MOST {
            recordings.clear();
        }
        recordings.insert((class, params.to_string()), Arc::clone(recording));
    }

    fn recordings(&self) -> std::sync::MutexGuard<'_, HashMap<(u32, String), Arc<Recording>>> {
        self.recordings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Program, library and place: an answer that is found elsewhere is none.
    fn whose(&self, place: &str) -> Option<String> {
        let library = self.copy.file_name()?.to_str()?;
        Some(format!("{} {library} {place}", self.program.as_ref()?))
    }

    fn file(&self, place: &str) -> PathBuf {
        self.copy.with_extension(format!("{place}.recorded"))
    }
}

fn descriptor_of(text: &str) -> Option<Descriptor> {
    serde_json::from_str(text).ok()
}

/// Where on disk the equations of an instance are.
fn slot(class: u32, params: &str) -> String {
    let hash = sha256(params.as_bytes());
    let number = u8::from_str_radix(&hash[..2], 16).unwrap_or(0) % SLOTS;
    format!("{class}-{number}")
}
