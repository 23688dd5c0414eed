//! Checksums: what is read back is what was written.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest, Sha256};

/// What the last line of a sealed text begins with; a comment in TOML.
const MARK: &str = "# sha256 of the lines above: ";

/// SHA-256 of bytes that come piece by piece.
#[derive(Debug, Clone, Default)]
pub(super) struct Checksum(Sha256);

impl Checksum {
    pub(super) fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// In hexadecimal digits.
    pub(super) fn hex(&self) -> String {
        self.0.clone().finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// SHA-256 of bytes, in hexadecimal digits.
pub fn checksum(bytes: &[u8]) -> String {
    let mut checksum = Checksum::default();
    checksum.add(bytes);
    checksum.hex()
}

/// SHA-256 of a file, in hexadecimal digits.
///
/// # Errors
/// A file that cannot be read.
pub fn checksum_of_file(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut checksum = Checksum::default();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(checksum.hex()),
            count => checksum.add(&block[..count]),
        }
    }
}

/// The text, which ends with a line break, and a last line with its checksum.
pub fn seal(mut text: String) -> String {
    let sum = checksum(text.as_bytes());
    text.push_str(MARK);
    text.push_str(&sum);
    text.push('\n');
    text
}

/// The text without its last line.
///
/// # Errors
/// There is no checksum, or it is that of another text, in words.
pub fn unseal(sealed: &str) -> Result<&str, String> {
    let found = sealed.rfind(MARK).filter(|at| *at == 0 || sealed[..*at].ends_with('\n'));
    let at = found.ok_or("it has no checksum at its end: it was cut off, or edited")?;
    let (text, last) = sealed.split_at(at);
    if last[MARK.len()..].trim_end() != checksum(text.as_bytes()) {
        return Err("its checksum does not fit: it was damaged, or edited".into());
    }
    Ok(text)
}
