//! The units in which a scene writes its plain numbers, and in which results are given.

use super::dimension::Dimension;
use super::units::{UnitError, is_of_torque, parse_unit};
use odyn_diagnostics::codes;

/// Base units of a scene (`[units]`), with names for its results.
///
/// One scene unit of a dimension is the coherent product of the base units, unless the scene gives a unit
/// of its own for force, torque, energy or pressure: that one holds for exactly this dimension and for no
/// product with it.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitSystem {
    /// Length, mass, time, angle.
    base: [Named; 4],
    /// Force, torque, energy, pressure, where the scene names one.
    overrides: [Option<Named>; 4],
}

/// A unit as written, with its size in SI.
#[derive(Clone, Debug, PartialEq)]
struct Named {
    symbol: String,
    factor: f64,
}

/// The keys of `[units]` and the dimension that their unit must have; the first four are base units.
pub(super) const UNIT_KEYS: [(&str, Dimension); 8] = [
    ("length", Dimension::LENGTH),
    ("mass", Dimension::MASS),
    ("time", Dimension::TIME),
    ("angle", Dimension::ANGLE),
    ("force", Dimension::FORCE),
    ("torque", Dimension::TORQUE),
    ("energy", Dimension::ENERGY),
    ("pressure", Dimension::PRESSURE),
];

/// SI units with a name of their own, which a product is called by if one of [`PREFIXES`] fits.
const WELL_KNOWN: [(Dimension, &str); 4] =
    [(Dimension::FORCE, "N"), (Dimension::ENERGY, "J"), (Dimension::POWER, "W"), (Dimension::PRESSURE, "Pa")];

const PREFIXES: [(f64, &str); 7] =
    [(1.0, ""), (1e3, "k"), (1e6, "M"), (1e9, "G"), (1e-3, "m"), (1e-6, "u"), (1e-9, "n")];

impl Default for UnitSystem {
    /// SI with angles in rad.
    fn default() -> Self {
        let base = ["m", "kg", "s", "rad"].map(|symbol| Named { symbol: symbol.to_owned(), factor: 1.0 });
        UnitSystem { base, overrides: [const { None }; 4] }
    }
}

impl UnitSystem {
    /// One scene unit of the dimension, in SI: multiply a scene number by it to get SI.
    pub fn factor(&self, dimension: Dimension) -> f64 {
        match self.overriding(dimension) {
            Some(named) => named.factor,
            None => self.coherent(dimension),
        }
    }

    /// A scene number in SI.
    pub fn to_si(&self, scene_value: f64, dimension: Dimension) -> f64 {
        scene_value * self.factor(dimension)
    }

    /// An SI value in scene units.
    pub fn from_si(&self, si_value: f64, dimension: Dimension) -> f64 {
        si_value / self.factor(dimension)
    }

    /// Name of one scene unit of the dimension: `kN`, `kN/mm`, `mm/ms^2`; `1` for a plain number.
    ///
    /// Torques have the dimension of an energy and would be called `J`; use
    /// [`UnitSystem::torque_label`] for them, or [`UnitSystem::label_as`].
    pub fn label(&self, dimension: Dimension) -> String {
        let named = match dimension {
            // A unit for torques is not meant to name energies, unless nothing else can.
            Dimension::ENERGY => self.overrides[2].as_ref(),
            _ => self.overriding(dimension),
        };
        if let Some(named) = named {
            return named.symbol.clone();
        }
        if let Some(symbol) = well_known(dimension, self.factor(dimension)) {
            return symbol;
        }
        if let Some(named) = self.overriding(dimension) {
            return named.symbol.clone();
        }
        self.force_label(dimension).unwrap_or_else(|| self.product(dimension, None))
    }

    /// Name of one scene unit of torque: what `[units] torque` says, else a force times a length, `N m`.
    ///
    /// It has the size of one [`Dimension::TORQUE`], so a scene in mm, ms and kg says `N m`, not `kN mm`.
    pub fn torque_label(&self) -> String {
        if let Some(named) = &self.overrides[1] {
            return named.symbol.clone();
        }
        match well_known(Dimension::ENERGY, self.factor(Dimension::TORQUE)) {
            Some(symbol) => symbol.replace('J', "N m"),
            None => self.label(Dimension::TORQUE),
        }
    }

    /// Name of one scene unit of the dimension of what `written` names in a unit: `N m` for a torque, `J` for an energy.
    pub fn label_as(&self, dimension: Dimension, written: &str) -> String {
        match dimension {
            Dimension::TORQUE if is_of_torque(written) => self.torque_label(),
            _ => self.label(dimension),
        }
    }

    /// True unless the scene names units of different size for torque and energy.
    pub(super) fn torque_and_energy_agree(&self) -> bool {
        match (&self.overrides[1], &self.overrides[2]) {
            (Some(torque), Some(energy)) => (torque.factor / energy.factor - 1.0).abs() < 1e-12,
            _ => true,
        }
    }

    /// Sets the unit of one key of `[units]`.
    pub(super) fn set(&mut self, key: &str, symbol: &str) -> Result<(), UnitError> {
        let (dimension, factor) = parse_unit(symbol)?;
        let position = UNIT_KEYS
            .iter()
            .position(|(name, _)| *name == key)
            .expect("the caller has checked the key against UNIT_KEYS");
        let wanted = UNIT_KEYS[position].1;
        // A unit must be of the dimension itself: a `1` is not an angle here.
        if dimension != wanted {
            return Err(UnitError {
                code: codes::DIMENSION,
                message: format!("`{key}` must be the unit of {wanted}, found {dimension}"),
                range: 0..symbol.len(),
                help: None,
            });
        }
        let named = Named { symbol: symbol.trim().to_owned(), factor };
        match self.base.get_mut(position) {
            Some(base) => *base = named,
            None => self.overrides[position - self.base.len()] = Some(named),
        }
        Ok(())
    }

    /// The unit that the scene names for exactly this dimension.
    fn overriding(&self, dimension: Dimension) -> Option<&Named> {
        let [force, torque, energy, pressure] = &self.overrides;
        match dimension {
            Dimension::FORCE => force.as_ref(),
            Dimension::ENERGY => energy.as_ref().or(torque.as_ref()),
            Dimension::PRESSURE => pressure.as_ref(),
            _ => None,
        }
    }

    fn coherent(&self, dimension: Dimension) -> f64 {
        let powers = self.base.iter().zip(dimension.exponents());
        powers.map(|(base, exponent)| base.factor.powi(i32::from(exponent))).product()
    }

    /// Stiffness, damping and their like contain a force: `kN/mm` says more than `kg/ms^2`.
    fn force_label(&self, dimension: Dimension) -> Option<String> {
        let Dimension { length, mass, time, angle } = dimension;
        let stiffness = time == -2;
        let damping = time == -1 && (length == 0 || angle == -1);
        if mass != 1 || !(stiffness || damping) {
            return None;
        }
        let force = well_known(Dimension::FORCE, self.coherent(Dimension::FORCE))?;
        Some(self.product(dimension.over(Dimension::FORCE)?, Some(&force)))
    }

    /// `first` times powers of the base units; negative powers behind a single quotient.
    fn product(&self, dimension: Dimension, first: Option<&str>) -> String {
        let mut above: Vec<String> = first.into_iter().map(str::to_owned).collect();
        let mut below: Vec<String> = Vec::new();
        let [length, mass, time, angle] = dimension.exponents();
        for (index, exponent) in [(1, mass), (0, length), (2, time), (3, angle)] {
            let written = &self.base[index].symbol;
            let symbol = if written.contains(|c: char| !c.is_alphabetic() && c != '°') {
                format!("({written})")
            } else {
                written.clone()
            };
            let power = exponent.unsigned_abs();
            let text = match power {
                0 => continue,
                1 => symbol,
                _ => format!("{symbol}^{power}"),
            };
            if exponent > 0 {
                above.push(text);
            } else {
                below.push(text);
            }
        }
        let numerator = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match below.as_slice() {
            [] => numerator,
            [only] => format!("{numerator}/{only}"),
            _ => format!("{numerator}/({})", below.join(" ")),
        }
    }
}

/// `kN` if a unit of this size in SI has such a name.
fn well_known(dimension: Dimension, factor: f64) -> Option<String> {
    let (_, symbol) = WELL_KNOWN.iter().find(|(own, _)| *own == dimension)?;
    let (_, prefix) = PREFIXES.iter().find(|(size, _)| (factor / size - 1.0).abs() < 1e-12)?;
    Some(format!("{prefix}{symbol}"))
}
