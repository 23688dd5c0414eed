//! Matrices as files: `.npz` for NumPy, CSV.

use std::io::{self, Write};
use std::path::Path;

use nalgebra::DMatrix;

use crate::results::{Packing, zip};

/// A matrix in NumPy's format 1.0: little-endian doubles, column by column.
fn npy(matrix: &DMatrix<f64>) -> Vec<u8> {
    let mut header =
        format!("{{'descr': '<f8', 'fortran_order': True, 'shape': ({}, {}), }}", matrix.nrows(), matrix.ncols());
    // What follows begins at a multiple of 64 bytes.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    matrix.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

/// Matrices with their names as an `.npz` archive: a zip file whose entries are stored as they are.
///
/// # Errors
/// An archive of more than 4 GB.
pub fn npz(matrices: &[(&str, &DMatrix<f64>)]) -> io::Result<Vec<u8>> {
    let files: Vec<(String, Vec<u8>)> =
        matrices.iter().map(|(name, matrix)| (format!("{name}.npy"), npy(matrix))).collect();
    let files: Vec<(String, &[u8])> = files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice())).collect();
    zip(&files, Packing::Stored)
}

/// A name as a cell of CSV.
pub(crate) fn cell(name: &str) -> String {
    if name.contains([',', '"', '\n']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

/// A matrix as CSV, with a name for each row and column.
#[must_use]
pub fn csv(matrix: &DMatrix<f64>, rows: &[String], columns: &[String]) -> String {
    let mut text = String::new();
    columns.iter().for_each(|name| text.push_str(&format!(",{}", cell(name))));
    text.push('\n');
    for (name, row) in rows.iter().zip(matrix.row_iter()) {
        text.push_str(&cell(name));
        row.iter().for_each(|value| text.push_str(&format!(",{value:?}")));
        text.push('\n');
    }
    text
}

/// Writes a file of a folder, which is made where it is not there.
///
/// # Errors
/// What the system says, with the path.
pub fn write(folder: &Path, name: &str, content: &[u8]) -> io::Result<()> {
    let path = folder.join(name);
    let named = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
    std::fs::create_dir_all(folder).map_err(named)?;
    std::fs::File::create(&path).and_then(|mut file| file.write_all(content)).map_err(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_begin_at_multiples_of_64_and_are_column_by_column() {
        let bytes = npy(&DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        assert_eq!((bytes.len() - 48) % 64, 0);
        let data: Vec<f64> = bytes[bytes.len() - 48..]
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap_or([0; 8])))
            .collect();
        assert_eq!(data, [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    }
}
