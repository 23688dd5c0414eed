//! Zip archives (PKWARE APPNOTE 4.3), read by their central directory within limits: sizes, ratios and paths of hostile archives
//! are refused before anything is unpacked.

use std::io::Read;

use flate2::Crc;
use flate2::read::DeflateDecoder;

use crate::Unusable;

/// Files in an archive.
const MOST_FILES: usize = 20_000;
/// Bytes of all files together, unpacked.
const MOST_BYTES: u64 = 2 << 30;
/// How much larger than packed a file may be; deflate itself ends at 1032.
const MOST_GROWTH: u64 = 1032;

/// One file of an archive.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) name: String,
    method: u16,
    crc: u32,
    packed: usize,
    size: u64,
    /// Where its own header is.
    at: usize,
}

impl Entry {
    /// Bytes, unpacked.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }
}

/// An archive whose list of files was read.
#[derive(Debug)]
pub(crate) struct Archive<'a> {
    bytes: &'a [u8],
    pub(crate) entries: Vec<Entry>,
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

impl<'a> Archive<'a> {
    /// Reads the list of files.
    ///
    /// # Errors
    /// What is no zip archive, or one with entries that cannot be unpacked safely.
    pub(crate) fn read(bytes: &'a [u8]) -> Result<Self, Unusable> {
        const END: usize = 22;
        let no_zip = || Unusable::damaged("it is no zip archive");
        let last = bytes.len().checked_sub(END).ok_or_else(no_zip)?;
        // A comment of at most 65535 bytes may follow.
        let end = (last.saturating_sub(65_535)..=last).rev().find(|at| bytes[*at..].starts_with(b"PK\x05\x06"));
        let end = end.ok_or_else(no_zip)?;
        let short = || Unusable::damaged("its central directory is cut short");
        let count = usize::from(u16_at(bytes, end + 10).ok_or_else(short)?);
        let mut at = u32_at(bytes, end + 16).ok_or_else(short)? as usize;
        if count == 0xffff || at == 0xffff_ffff {
            return Err(Unusable::damaged("it is a zip archive of more than 4 GB or 65535 files, which are not read"));
        }
        if count > MOST_FILES {
            return Err(Unusable::damaged(format!("it has {count} files; at most {MOST_FILES} are read")));
        }
        let mut entries: Vec<Entry> = Vec::with_capacity(count);
        let mut total = 0_u64;
        for number in 0..count {
            if !bytes.get(at..).is_some_and(|rest| rest.starts_with(b"PK\x01\x02")) {
                return Err(Unusable::damaged(format!("entry {number} of its central directory is damaged")));
            }
            let half = |offset: usize| u16_at(bytes, at + offset).ok_or_else(short);
            let whole = |offset: usize| u32_at(bytes, at + offset).ok_or_else(short);
            let (flags, method) = (half(8)?, half(10)?);
            let (length, extra, comment) = (half(28)?, half(30)?, half(32)?);
            let name = bytes.get(at + 46..at + 46 + usize::from(length)).ok_or_else(short)?;
            let name = String::from_utf8_lossy(name).replace('\\', "/");
            let entry = Entry {
                method,
                crc: whole(16)?,
                packed: whole(20)? as usize,
                size: u64::from(whole(24)?),
                at: whole(42)? as usize,
                name,
            };
            let refuse = |what: &str| Unusable::damaged(format!("`{}` in it {what}", entry.name));
            if flags & 1 != 0 {
                return Err(refuse("is encrypted"));
            }
            if method != 0 && method != 8 {
                return Err(refuse(&format!("is packed by method {method}; deflate (8) and none (0) are read")));
            }
            if leaves(&entry.name) {
                return Err(refuse("would be unpacked outside of its folder"));
            }
            if entry.size > (entry.packed as u64).saturating_mul(MOST_GROWTH) {
                return Err(refuse("grows more than deflate can make it: a zip bomb"));
            }
            total = total.saturating_add(entry.size);
            if total > MOST_BYTES {
                return Err(Unusable::damaged(format!(
                    "its files have more than {MOST_BYTES} bytes unpacked: a zip bomb"
                )));
            }
            if entries.iter().any(|known| known.name == entry.name) {
                return Err(refuse("is there twice"));
            }
            entries.push(entry);
            at += 46 + usize::from(length) + usize::from(extra) + usize::from(comment);
        }
        Ok(Self { bytes, entries })
    }

    /// The file of a name.
    pub(crate) fn find(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }

    /// The content of a file.
    ///
    /// # Errors
    /// A file that is damaged.
    pub(crate) fn content(&self, entry: &Entry) -> Result<Vec<u8>, Unusable> {
        let damaged = |what: &str| Unusable::damaged(format!("`{}` in it is damaged: {what}", entry.name));
        let header = self.bytes.get(entry.at..).filter(|rest| rest.starts_with(b"PK\x03\x04"));
        let header = header.ok_or_else(|| damaged("it has no header"))?;
        let lengths = u16_at(header, 26).zip(u16_at(header, 28)).ok_or_else(|| damaged("its header is cut short"))?;
        let start = 30 + usize::from(lengths.0) + usize::from(lengths.1);
        let packed = header.get(start..).and_then(|rest| rest.get(..entry.packed));
        let packed = packed.ok_or_else(|| damaged("it is cut short"))?;
        let content = if entry.method == 0 {
            packed.to_vec()
        } else {
            let mut content = Vec::new();
            // One byte more shows that there would be more.
            let read = DeflateDecoder::new(packed).take(entry.size + 1).read_to_end(&mut content);
            read.map_err(|error| damaged(&error.to_string()))?;
            content
        };
        if content.len() as u64 != entry.size {
            return Err(damaged("it has another size than its entry says"));
        }
        let mut crc = Crc::new();
        crc.update(&content);
        if crc.sum() != entry.crc { Err(damaged("its checksum is wrong")) } else { Ok(content) }
    }
}

/// Whether a path leads out of the folder that it is unpacked in.
fn leaves(name: &str) -> bool {
    name.starts_with('/') || name.contains([':', '\0']) || name.split('/').any(|part| part == "..") || name.is_empty()
}
