//! Units of FMUs: a factor and an offset from SI, and the dimension as a text.

use odyn_scene::{Dimension, parse_unit};

/// What a number of an FMU means in SI: `factor * number + offset`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unit {
    /// The SI unit, as elements name theirs; empty: none is known, any fits.
    pub(crate) si: String,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

impl Unit {
    /// A number without a unit that is known here. Temperatures, currents and what is made of them count as such: they keep the
    /// unit of the FMU.
    pub(crate) fn unknown() -> Self {
        Self { si: String::new(), factor: 1.0, offset: 0.0 }
    }

    /// By exponents of kg, m, s and rad.
    pub(crate) fn of_base([kg, m, s, rad]: [i32; 4], factor: f64, offset: f64) -> Self {
        let powers = [("kg", kg), ("m", m), ("s", s), ("rad", rad)].into_iter().filter(|(_, power)| *power != 0);
        let words: Vec<String> = powers
            .map(|(symbol, power)| if power == 1 { symbol.to_string() } else { format!("{symbol}^{power}") })
            .collect();
        let si = if words.is_empty() { "1".into() } else { words.join(" ") };
        if parse_unit(&si).is_err() { Self::unknown() } else { Self { si, factor, offset } }
    }

    /// By its name alone, where that is a unit that scenes know.
    pub(crate) fn named(name: &str) -> Self {
        let Ok((Dimension { length, mass, time, angle }, factor)) = parse_unit(name) else { return Self::unknown() };
        Self::of_base([mass, length, time, angle].map(i32::from), factor, 0.0)
    }

    /// A number of the FMU in SI.
    pub(crate) fn to_si(&self, number: f64) -> f64 {
        if self.factor == 1.0 && self.offset == 0.0 { number } else { number * self.factor + self.offset }
    }

    /// The reverse.
    pub(crate) fn of_si(&self, value: f64) -> f64 {
        if self.factor == 1.0 && self.offset == 0.0 { value } else { (value - self.offset) / self.factor }
    }
}
