//! 6 x 6 matrices that a scene gives as 3 x 3 blocks.

use element_api::prelude::*;

use crate::deformation::SixBySix;

/// Rounding that is allowed in given matrices, relative to their largest number.
const ROUNDING: f64 = 1e-9;

/// The matrix of three blocks, given by name.
pub fn matrix(blocks: [(&str, &Option<Vec<f64>>); 3]) -> Result<SixBySix, ParamError> {
    let mut m = [[0.0; 6]; 6];
    for (block, (name, numbers)) in blocks.into_iter().enumerate() {
        let Some(numbers) = numbers else { continue };
        if numbers.len() != 9 {
            return Err(ParamError::new(name, format!("needs 9 numbers, row by row; found {}", numbers.len())));
        }
        let largest = numbers.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (k, value) in numbers.iter().enumerate() {
            let (row, column) = (k / 3, k % 3);
            let mirrored = numbers[3 * column + row];
            if block != 1 && (value - mirrored).abs() > ROUNDING * largest {
                let message = format!(
                    "must be symmetric: entry ({0}, {1}) is {value}, ({1}, {0}) is {mirrored}",
                    row + 1,
                    column + 1
                );
                return Err(ParamError::new(name, message));
            }
            match block {
                0 => m[row][column] = 0.5 * (value + mirrored),
                1 => (m[row][column + 3], m[column + 3][row]) = (*value, *value),
                _ => m[row + 3][column + 3] = 0.5 * (value + mirrored),
            }
        }
    }
    Ok(m)
}

/// Whether e . M e is negative for some e, by elimination without pivoting.
pub fn is_negative_somewhere(matrix: &SixBySix) -> bool {
    let mut m = *matrix;
    // Units differ: compare each entry with the diagonal entries that belong to it.
    let scale: [f64; 6] = std::array::from_fn(|k| matrix[k][k].abs());
    for k in 0..6 {
        let vanishes = m[k][k].abs() <= ROUNDING * scale[k];
        if !vanishes && m[k][k] < 0.0 {
            return true;
        }
        for row in k + 1..6 {
            if vanishes {
                if m[row][k].powi(2) > ROUNDING * scale[row] * scale[k] {
                    return true;
                }
                continue;
            }
            let (pivot_row, factor) = (m[k], m[row][k] / m[k][k]);
            for (entry, pivot) in m[row].iter_mut().zip(pivot_row).skip(k + 1) {
                *entry -= factor * pivot;
            }
        }
    }
    false
}
