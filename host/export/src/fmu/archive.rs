//! Zip archives (PKWARE APPNOTE 4.3), deflated by `flate2`.

use std::io::{self, Write as _};

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

/// Files by their paths as an archive, all of 1 January 1980: the same files give the same bytes.
pub(super) fn write(entries: &[(String, &[u8])]) -> io::Result<Vec<u8>> {
    let short = |length: usize| u32::try_from(length).map_err(|_| io::Error::other("more than 4 GB"));
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in entries {
        let mut crc = Crc::new();
        crc.update(content);
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(content)?;
        let packed = encoder.finish()?;
        let mut entry = Vec::new();
        // Version 2.0, names in UTF-8, deflated, 1 January 1980.
        for value in [20_u16, 1 << 11, 8, 0, 0x21] {
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
        archive.extend(&packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&entry);
        // No comment, disk 0, no attributes.
        directory.extend([0_u8; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (at, length, count) = (short(archive.len())?, short(directory.len())?, entries.len() as u16);
    archive.extend(&directory);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend(count.to_le_bytes());
    archive.extend(count.to_le_bytes());
    archive.extend(length.to_le_bytes());
    archive.extend(at.to_le_bytes());
    archive.extend([0, 0]);
    Ok(archive)
}
