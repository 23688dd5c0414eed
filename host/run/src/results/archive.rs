//! Zip archives (PKWARE APPNOTE 4.3).

use std::borrow::Cow;
use std::io::{self, Write as _};

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

/// How the files of an archive are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    /// As they are.
    Stored,
    /// Deflated, their names in UTF-8.
    Deflated,
}

/// Files by their paths as an archive, all of 1 January 1980: the same files give the same bytes.
///
/// # Errors
/// An archive of more than 4 GB.
pub fn zip(files: &[(String, &[u8])], packing: Packing) -> io::Result<Vec<u8>> {
    let short = |length: usize| u32::try_from(length).map_err(|_| io::Error::other("more than 4 GB"));
    let (flags, method) = match packing {
        Packing::Stored => (0, 0),
        Packing::Deflated => (1 << 11, 8),
    };
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let mut crc = Crc::new();
        crc.update(content);
        let packed = match packing {
            Packing::Stored => Cow::Borrowed(*content),
            Packing::Deflated => {
                let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(content)?;
                Cow::Owned(encoder.finish()?)
            }
        };
        let mut entry = Vec::new();
        // Version 2.0, 1 January 1980.
        for value in [20_u16, flags, method, 0, 0x21] {
            entry.extend(value.to_le_bytes());
        }
        for value in [crc.sum(), short(packed.len())?, short(content.len())?] {
            entry.extend(value.to_le_bytes());
        }
        entry.extend((name.len() as u16).to_le_bytes());
        entry.extend(0_u16.to_le_bytes());
        let at = short(archive.len())?;
        archive.extend(b"PK\x03\x04");
        archive.extend(&entry);
        archive.extend(name.as_bytes());
        archive.extend(&*packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&entry);
        // No comment, disk 0, no attributes.
        directory.extend([0_u8; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (at, length, count) = (short(archive.len())?, short(directory.len())?, files.len() as u16);
    archive.extend(&directory);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend(count.to_le_bytes());
    archive.extend(count.to_le_bytes());
    archive.extend(length.to_le_bytes());
    archive.extend(at.to_le_bytes());
    archive.extend([0, 0]);
    Ok(archive)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standard() {
        for packing in [Packing::Stored, Packing::Deflated] {
            let archive = zip(&[("name".into(), b"123456789")], packing).unwrap();
            assert_eq!(archive[14..18], 0xcbf4_3926_u32.to_le_bytes(), "{packing:?}");
        }
    }
}
