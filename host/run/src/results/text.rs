//! Short numbers and aligned columns, for people.

/// A number for people, with so many significant digits at most: `0.00123`, `1.5e-9`, `200`.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return format!("{value}");
    }
    // Without the sign of a zero; rounding first, so that 9.9996 with four digits counts as 10.00.
    let scientific = format!("{:.*e}", digits.saturating_sub(1), value + 0.0);
    let (mantissa, exponent) = scientific.split_once('e').expect("the format writes an exponent");
    let exponent: i32 = exponent.parse().expect("the format writes a whole exponent");
    let digits = i32::try_from(digits).unwrap_or(17);
    if (-4..digits.max(6)).contains(&exponent) {
        let decimals = digits - 1 - exponent;
        let rounded: f64 = scientific.parse().expect("a formatted number is a number");
        return without_zeros(&format!("{rounded:.*}", usize::try_from(decimals).unwrap_or(0))).to_owned();
    }
    format!("{}e{exponent}", without_zeros(mantissa))
}

/// A decimal number without zeros at the end of its fraction.
fn without_zeros(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// A duration with three digits and a fitting unit: `3.21 ms`.
pub(super) fn duration(seconds: f64) -> String {
    let (factor, unit) = match seconds {
        s if s >= 1.0 || s == 0.0 || s.is_nan() => (1.0, "s"),
        s if s >= 1e-3 => (1e3, "ms"),
        _ => (1e6, "us"),
    };
    format!("{} {unit}", significant(seconds * factor, 3))
}

/// `1 step`, `2 steps`.
pub(super) fn count(number: u64, noun: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{ending}")
}

/// Where the texts of a column stand.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// Rows of texts under each other, two blanks between columns, two in front, no blanks at ends of lines.
pub(super) fn aligned(sides: &[Side], rows: &[Vec<String>]) -> String {
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..sides.len()).map(|column| width(column).unwrap_or(0)).collect();
    let mut out = String::new();
    for row in rows {
        let mut line = String::new();
        for ((cell, side), width) in row.iter().zip(sides).zip(&widths) {
            let blanks = " ".repeat(width - cell.chars().count());
            let parts = if *side == Side::Left { ["  ", cell, &blanks] } else { ["  ", &blanks, cell] };
            line.extend(parts);
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}
