//! Numbers with so many decimal digits as people write.

/// Powers of ten that are numbers of their own, up to the last.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// The nearest number with 15 decimal digits, which undoes the rounding of a unit conversion.
pub(crate) fn round_to_15_digits(value: f64) -> f64 {
    scaled(value).unwrap_or_else(|| by_text(value))
}

/// The same by writing and reading it.
fn by_text(value: f64) -> f64 {
    format!("{value:.14e}").parse().expect("a formatted number is a number")
}

/// A whole number of 15 digits over a power of ten: both are exact, so that their quotient is rounded once, as by reading. `None`
/// where that is not so, or where the product is so near to the middle between two whole numbers that its own rounding could tell.
fn scaled(value: f64) -> Option<f64> {
    let size = value.abs();
    if !size.is_normal() {
        return None;
    }
    // The decimal exponent of the power of two below, rounded down: that of the number, or one less.
    let binary = (size.to_bits() >> 52) as i64 - 1023;
    let exponent = usize::try_from(14 - (binary * 30_103).div_euclid(100_000)).ok()?;
    let powers = [Some(exponent), exponent.checked_sub(1)].map(|exponent| exponent.and_then(|k| POWERS.get(k)));
    let power = *powers.into_iter().flatten().find(|power| size * **power < 1e15)?;
    let product = size * power;
    let whole = product.round();
    // Powers next to a power of ten may have one digit more or less.
    let has_15_digits = (1e14..1e15).contains(&product) && (1e14..1e15).contains(&whole);
    let is_clear = ((product - product.floor()) - 0.5).abs() > 0.1;
    (has_15_digits && is_clear).then(|| (whole / power).copysign(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_by_a_product_is_rounding_by_text() {
        let (mut taken, mut all) = (0, 0);
        let mut same = |value: f64| {
            all += 1;
            if let Some(found) = scaled(value) {
                taken += 1;
                assert_eq!(found.to_bits(), by_text(value).to_bits(), "{value:e}");
            }
        };
        for k in 0..20_000_i32 {
            let k = f64::from(k);
            for step in [0.001, 0.01, 1.0 / 3.0, 5e-5, 0.7, 1e-7, 123.456, 2.5e9] {
                same(k * step);
                same(-(k * step + 1e-3));
                same((k * step).next_up());
            }
            // Any digits, over 30 decades; and next to powers of ten.
            same(
                (1.0 + (k * 0.618_033_988_749_895).fract() * 9.0)
                    * 10f64.powf((k * 0.754_877_666_246_693).fract() * 30.0 - 15.0),
            );
        }
        for exponent in -7..15 {
            let power: f64 = format!("1e{exponent}").parse().expect("a number");
            let near = [power, power.next_up(), power.next_down(), power * (1.0 - 4e-16), power * (1.0 + 5e-15)];
            near.into_iter().for_each(&mut same);
        }
        assert!(taken > all / 3, "{taken} of {all}");
        for value in [0.0, -0.0, 1e300, 5e-324, 1e-9, 7e15] {
            assert_eq!(round_to_15_digits(value).to_bits(), by_text(value).to_bits());
        }
    }
}
