//! SHA-256, by which contents are distinguished.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest, Sha256};

/// Bytes of a file that are in memory at a time; about what stays in a processor's cache.
pub(super) const PIECE: usize = 128 * 1024;

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// SHA-256 of a file in hexadecimal digits; `None` where it can't be read.
#[must_use]
pub fn sha256_of(path: &Path) -> Option<String> {
    sha256_of_pieces(path, |_| Ok(())).ok()
}

/// The same, read piece by piece; each of them is given to `take`.
///
/// # Errors
/// Where the file can't be read, or as `take`.
pub(super) fn sha256_of_pieces(path: &Path, mut take: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut piece = vec![0; PIECE];
    let mut hash = Sha256::new();
    loop {
        match file.read(&mut piece) {
            Ok(0) => return Ok(hexadecimal(&hash.finalize())),
            Ok(n) => {
                hash.update(&piece[..n]);
                take(&piece[..n])?;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
