//! Units: `N m/rad` as text, its dimension and its size in SI.
//!
//! Grammar (blanks between factors multiply):
//! ```text
//! unit   = factor { ( blank | "*" | "·" | "/" ) factor }      a quotient is followed by no blank product
//! factor = ( symbol | "%" | "°" | "1" | "(" unit ")" ) [ ( "^" | "**" ) integer | superscripts ]
//! ```
//! `1` stands only in front of a quotient, as in `1/s`.

use super::dimension::Dimension;
use super::expression::Vocabulary;
use odyn_diagnostics::{Code, codes, suggest};
use std::f64::consts::PI;
use std::ops::Range;

/// `8.5 mm` in its two parts; the unit may be empty. The longest beginning that is a finite number counts.
pub fn number_and_unit(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8()).rev();
    let parsed = ends.map(|end| (text[..end].parse::<f64>(), text[end..].trim()));
    parsed.filter_map(|(number, unit)| Some((number.ok().filter(|number| number.is_finite())?, unit))).next()
}

/// `x_p [mm]`, the head of a column, in its two parts.
#[must_use]
pub fn name_and_unit(text: &str) -> (&str, Option<&str>) {
    let text = text.trim();
    match text.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
        Some((name, unit)) if !name.trim().is_empty() => (name.trim(), Some(unit.trim())),
        _ => (text, None),
    }
}

/// Whether a text names a force and a length, as `N m` does: the unit of a torque, where `J` is one of an energy.
pub(super) fn is_of_torque(text: &str) -> bool {
    let words = text.split(|c: char| !starts_symbol(c)).filter_map(|word| parse_unit(word).ok());
    let has = |wanted| words.clone().any(|(dimension, _)| dimension == wanted);
    has(Dimension::FORCE) && has(Dimension::LENGTH)
}

/// Parses a whole text as a unit: its dimension, and how many SI units one of it is.
///
/// # Errors
/// The text is not a product of known units; the error has the byte range.
pub fn parse_unit(text: &str) -> Result<(Dimension, f64), UnitError> {
    let unit = read_unit(text, 0, Context::Alone)?;
    let rest = text[unit.end..].trim_start();
    if rest.is_empty() {
        return Ok((unit.dimension, unit.factor));
    }
    let start = text.len() - rest.len();
    Err(UnitError::syntax(start..text.len(), "this doesn't belong to a unit"))
}

/// Whether a unit counts cycles (`Hz`), which are not radians: none of an angular velocity.
#[must_use]
pub fn counts_cycles(text: &str) -> bool {
    read_unit(text, 0, Context::Alone).is_ok_and(|unit| unit.cycles)
}

/// Why a text is not a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitError {
    /// [`codes::UNKNOWN_UNIT`], [`codes::UNIT_SYNTAX`] or [`codes::AMBIGUOUS`].
    pub code: Code,
    /// One sentence.
    pub message: String,
    /// Byte range in the text.
    pub range: Range<usize>,
    /// Advice.
    pub help: Option<String>,
}

impl UnitError {
    fn syntax(range: Range<usize>, message: &str) -> Self {
        UnitError { code: codes::UNIT_SYNTAX, message: message.to_owned(), range, help: None }
    }
}

/// Who asks for a unit.
#[derive(Clone, Copy)]
pub(super) enum Context<'a> {
    /// The text is nothing but a unit.
    Alone,
    /// The unit follows a number in an expression with these names. Reading stops where the unit ends.
    Expression(Vocabulary<'a>),
}

/// A unit found in a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unit {
    /// Its dimension.
    pub dimension: Dimension,
    /// Its size in SI.
    pub factor: f64,
    /// True if it counts cycles (`Hz`), which are not radians.
    pub cycles: bool,
    /// Offset behind it.
    pub end: usize,
}

/// Reads the longest unit that starts at `start` (blanks in front allowed).
pub(super) fn read_unit(text: &str, start: usize, context: Context<'_>) -> Result<Unit, UnitError> {
    Reader { text, context, depth: 0 }.product(start).and_then(|unit| match unit.factor.is_normal() {
        true => Ok(unit),
        false => Err(too_high(start..unit.end)),
    })
}

/// True if the text is the symbol of a unit, possibly with a prefix.
pub(super) fn is_unit(symbol: &str) -> bool {
    look_up(symbol).is_some()
}

struct Reader<'a> {
    text: &'a str,
    context: Context<'a>,
    depth: u32,
}

impl Reader<'_> {
    fn product(&mut self, start: usize) -> Result<Unit, UnitError> {
        let mut unit = self.factor(self.skip_blanks(start), true)?;
        let mut divided: Option<usize> = None;
        loop {
            let next = self.skip_blanks(unit.end);
            let rest = &self.text[next..];
            let operator = match rest.chars().next() {
                Some('*') if !rest.starts_with("**") => Some('*'),
                Some('·') => Some('·'),
                Some('/') => Some('/'),
                Some(c) if next > unit.end && starts_symbol(c) && !self.multiplies(next) => None,
                _ => return Ok(unit),
            };
            if operator.is_none()
                && let Some(slash) = divided
            {
                return Err(UnitError {
                    help: Some("write `N/(m s)` or `N s/m`".to_owned()),
                    ..UnitError::syntax(
                        slash..next + symbol_at(self.text, next).len(),
                        "a blank behind a quotient can be read in two ways",
                    )
                });
            }
            let position = self.skip_blanks(next + operator.map_or(0, char::len_utf8));
            let factor = match (operator, self.context) {
                (Some(_), Context::Expression(vocabulary)) => match self.continuation(position, vocabulary)? {
                    Some(factor) => factor,
                    None => return Ok(unit),
                },
                _ => self.factor(position, false)?,
            };
            let combined = if operator == Some('/') {
                divided = Some(next);
                (unit.dimension.over(factor.dimension), unit.factor / factor.factor)
            } else {
                (unit.dimension.times(factor.dimension), unit.factor * factor.factor)
            };
            unit = Unit {
                dimension: combined.0.ok_or_else(|| too_high(start..factor.end))?,
                factor: combined.1,
                cycles: unit.cycles || factor.cycles,
                end: factor.end,
            };
        }
    }

    /// True if the word at `position` belongs to the expression around the unit.
    fn multiplies(&self, position: usize) -> bool {
        match self.context {
            Context::Alone => false,
            Context::Expression(vocabulary) => vocabulary.multiplies(self.text, position),
        }
    }

    /// In an expression: the factor at `position` if the operator in front of it belongs to the unit. It
    /// does if a known unit or a group of units follows.
    fn continuation(&mut self, position: usize, vocabulary: Vocabulary<'_>) -> Result<Option<Unit>, UnitError> {
        let Vocabulary { is_parameter, is_variable, .. } = vocabulary;
        if self.text[position..].starts_with('(') {
            let Ok(group) = self.factor(position, false) else {
                return Ok(None);
            };
            let words = || self.text[position..group.end].split(|c: char| !starts_symbol(c));
            if words().any(is_variable) {
                return Ok(None);
            }
            return match words().find(|word| is_parameter(word)) {
                Some(word) => Err(ambiguous(word, position..group.end)),
                None => Ok(Some(group)),
            };
        }
        let symbol = symbol_at(self.text, position);
        let end = position + symbol.len();
        let called = self.text[self.skip_blanks(end)..].starts_with('(');
        let dotted = self.text[end..].starts_with('.');
        if symbol.is_empty() || called || dotted || !is_unit(symbol) || is_variable(symbol) {
            return Ok(None);
        }
        if is_parameter(symbol) {
            return Err(ambiguous(symbol, position..end));
        }
        self.factor(position, false).map(Some)
    }

    fn factor(&mut self, start: usize, first: bool) -> Result<Unit, UnitError> {
        let rest = &self.text[start..];
        let base = if rest.starts_with('(') {
            self.group(start)?
        } else if first && rest.starts_with('1') {
            let end = start + 1;
            let next = self.skip_blanks(end);
            if self.text[end..].starts_with(|c: char| c.is_ascii_digit() || c == '.')
                || !(self.text[next..].starts_with('/') || self.text[next..].is_empty())
            {
                return Err(UnitError::syntax(start..end, "a number in a unit can only be the `1` of `1/s`"));
            }
            Unit { dimension: Dimension::DIMENSIONLESS, factor: 1.0, cycles: false, end }
        } else {
            self.symbol(start)?
        };
        let Some((exponent, end)) = self.exponent(base.end)? else {
            return Ok(base);
        };
        let dimension = base.dimension.power(f64::from(exponent));
        Ok(Unit {
            dimension: dimension.ok_or_else(|| too_high(start..end))?,
            factor: base.factor.powi(exponent),
            cycles: base.cycles,
            end,
        })
    }

    fn group(&mut self, start: usize) -> Result<Unit, UnitError> {
        const DEEPEST: u32 = 16;
        if self.depth == DEEPEST {
            return Err(UnitError::syntax(start..start + 1, "parentheses are nested too deeply"));
        }
        self.depth += 1;
        let inner = self.product(start + 1);
        self.depth -= 1;
        let mut unit = inner?;
        let close = self.skip_blanks(unit.end);
        if !self.text[close..].starts_with(')') {
            return Err(UnitError::syntax(start..start + 1, "this parenthesis is not closed"));
        }
        unit.end = close + 1;
        Ok(unit)
    }

    fn symbol(&self, start: usize) -> Result<Unit, UnitError> {
        let symbol = symbol_at(self.text, start);
        let end = start + symbol.len();
        if symbol.is_empty() {
            let length = self.text[start..].chars().next().map_or(0, char::len_utf8);
            return Err(UnitError::syntax(start..start + length, "a unit is missing here"));
        }
        let Some(found) = look_up(symbol) else {
            return Err(UnitError {
                code: codes::UNKNOWN_UNIT,
                message: format!("unknown unit `{symbol}`"),
                range: start..end,
                help: advice(symbol),
            });
        };
        Ok(Unit { dimension: found.dimension, factor: found.factor, cycles: symbol.ends_with("Hz"), end })
    }

    /// The exponent at `position` and the offset behind it.
    fn exponent(&self, position: usize) -> Result<Option<(i32, usize)>, UnitError> {
        // A blank in front of `^` must not change what is raised: `3 mm ^2` is an area, too.
        let after_blanks = self.skip_blanks(position);
        let raised = self.text[after_blanks..].starts_with(['^', '*']);
        let position = if raised { after_blanks } else { position };
        let rest = &self.text[position..];
        let marked = rest.strip_prefix("**").or_else(|| rest.strip_prefix('^'));
        let (digits, end) = match marked {
            Some(tail) => {
                let length = tail
                    .char_indices()
                    .find(|&(i, c)| !(c.is_ascii_digit() || i == 0 && matches!(c, '-' | '+')))
                    .map_or(tail.len(), |(i, _)| i);
                (tail[..length].to_owned(), self.text.len() - tail.len() + length)
            }
            None => {
                let digits: String = rest.chars().map_while(superscript).collect();
                let length: usize = rest.chars().take(digits.chars().count()).map(char::len_utf8).sum();
                (digits, position + length)
            }
        };
        if marked.is_none() && digits.is_empty() {
            return Ok(None);
        }
        let fraction = self.text[end..].starts_with('.');
        match digits.parse::<i32>() {
            Ok(exponent) if !fraction && exponent.abs() <= 12 => Ok(Some((exponent, end))),
            _ => Err(UnitError {
                help: Some("to raise a whole quantity to a power, write `(3 mm)^n`".to_owned()),
                ..UnitError::syntax(
                    position..end.max(position + 1),
                    "the power of a unit must be a whole number from -12 to 12",
                )
            }),
        }
    }

    fn skip_blanks(&self, position: usize) -> usize {
        let rest = &self.text[position..];
        self.text.len() - rest.trim_start().len()
    }
}

fn too_high(range: Range<usize>) -> UnitError {
    UnitError::syntax(range, "the powers in this unit are too high")
}

fn ambiguous(symbol: &str, range: Range<usize>) -> UnitError {
    UnitError {
        code: codes::AMBIGUOUS,
        message: format!("`{symbol}` is a unit as well as a parameter"),
        range,
        help: Some("rename the parameter, or put the quantity in parentheses: `(2 N)/m`".to_owned()),
    }
}

fn starts_symbol(c: char) -> bool {
    c.is_alphabetic() || matches!(c, '%' | '°' | '_')
}

/// The symbol that starts at `position`; empty if there is none. Digits are included so that `m1` is
/// reported as a whole.
fn symbol_at(text: &str, position: usize) -> &str {
    let rest = &text[position..];
    match rest.chars().next() {
        Some(sign @ ('%' | '°')) => &rest[..sign.len_utf8()],
        Some(c) if starts_symbol(c) => {
            let end = rest.find(|c: char| !(c.is_alphabetic() || c.is_ascii_digit() || c == '_')).unwrap_or(rest.len());
            &rest[..end]
        }
        _ => "",
    }
}

fn superscript(c: char) -> Option<char> {
    Some(match c {
        '⁻' => '-',
        '⁰' => '0',
        '¹' => '1',
        '²' => '2',
        '³' => '3',
        '⁴' => '4',
        '⁵' => '5',
        '⁶' => '6',
        '⁷' => '7',
        '⁸' => '8',
        '⁹' => '9',
        _ => return None,
    })
}

/// A unit of the table.
#[derive(Clone, Copy)]
pub(super) struct Known {
    pub symbol: &'static str,
    pub dimension: Dimension,
    /// Its size in SI.
    pub factor: f64,
    /// Whether it takes [`PREFIXES`].
    pub prefixed: bool,
}

const fn known(symbol: &'static str, dimension: Dimension, factor: f64, prefixed: bool) -> Known {
    Known { symbol, dimension, factor, prefixed }
}

/// Pound (avoirdupois), kg: exact by definition of 1959.
const POUND: f64 = 0.453_592_37;

#[rustfmt::skip]
pub(super) const KNOWN: &[Known] = &[
    known("m", Dimension::LENGTH, 1.0, true),
    known("g", Dimension::MASS, 1e-3, true),
    known("t", Dimension::MASS, 1e3, false),
    known("s", Dimension::TIME, 1.0, true),
    known("min", Dimension::TIME, 60.0, false),
    known("h", Dimension::TIME, 3600.0, false),
    known("N", Dimension::FORCE, 1.0, true),
    known("J", Dimension::ENERGY, 1.0, true),
    known("W", Dimension::POWER, 1.0, true),
    known("Pa", Dimension::PRESSURE, 1.0, true),
    known("bar", Dimension::PRESSURE, 1e5, true),
    known("Hz", Dimension::FREQUENCY, 1.0, true),
    known("rad", Dimension::ANGLE, 1.0, true),
    known("deg", Dimension::ANGLE, PI / 180.0, false),
    known("°", Dimension::ANGLE, PI / 180.0, false),
    known("turn", Dimension::ANGLE, 2.0 * PI, false),
    known("rev", Dimension::ANGLE, 2.0 * PI, false),
    known("rpm", Dimension::ANGULAR_VELOCITY, PI / 30.0, false),
    known("in", Dimension::LENGTH, 0.0254, false),
    known("ft", Dimension::LENGTH, 0.3048, false),
    known("lbm", Dimension::MASS, POUND, false),
    // Force of gravity on a pound at 9.80665 m/s^2.
    known("lbf", Dimension::FORCE, POUND * 9.806_65, false),
    known("%", Dimension::DIMENSIONLESS, 0.01, false),
];

pub(super) const PREFIXES: &[(&str, f64)] = &[
    ("p", 1e-12),
    ("n", 1e-9),
    ("u", 1e-6),
    ("µ", 1e-6), // micro sign, U+00B5
    ("μ", 1e-6), // Greek mu, U+03BC
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
    ("T", 1e12),
];

/// Finds a symbol as written first, then with a prefix, so that `min` is a minute and `kg` a kilogram.
fn look_up(symbol: &str) -> Option<Known> {
    // Exactly 1, not 1e3 * 1e-3 with its rounding.
    if symbol == "kg" {
        return Some(known("kg", Dimension::MASS, 1.0, false));
    }
    if let Some(found) = KNOWN.iter().find(|known| known.symbol == symbol) {
        return Some(*found);
    }
    PREFIXES.iter().find_map(|(prefix, size)| {
        let stem = symbol.strip_prefix(prefix)?;
        let found = KNOWN.iter().find(|known| known.prefixed && known.symbol == stem)?;
        Some(Known { factor: size * found.factor, ..*found })
    })
}

/// What the writer of an unknown symbol probably meant.
fn advice(symbol: &str) -> Option<String> {
    const OTHER_WORDS: &[(&str, &str)] = &[
        ("sec", "s"),
        ("second", "s"),
        ("seconds", "s"),
        ("msec", "ms"),
        ("minute", "min"),
        ("minutes", "min"),
        ("hour", "h"),
        ("hours", "h"),
        ("hr", "h"),
        ("meter", "m"),
        ("metre", "m"),
        ("meters", "m"),
        ("metres", "m"),
        ("micron", "um"),
        ("inch", "in"),
        ("inches", "in"),
        ("foot", "ft"),
        ("feet", "ft"),
        ("gram", "g"),
        ("grams", "g"),
        ("kilogram", "kg"),
        ("kilograms", "kg"),
        ("kilo", "kg"),
        ("kgs", "kg"),
        ("tonne", "t"),
        ("ton", "t"),
        ("newton", "N"),
        ("newtons", "N"),
        ("joule", "J"),
        ("watt", "W"),
        ("pascal", "Pa"),
        ("hertz", "Hz"),
        ("degree", "deg"),
        ("degrees", "deg"),
        ("radian", "rad"),
        ("radians", "rad"),
        ("revolution", "rev"),
        ("revolutions", "rev"),
        ("turns", "turn"),
        ("percent", "%"),
    ];
    let lower = symbol.to_lowercase();
    if matches!(lower.as_str(), "lb" | "lbs") {
        return Some("write `lbm` for a mass, `lbf` for a force".to_owned());
    }
    if matches!(lower.as_str(), "slug" | "slugs") {
        return Some("write it with others: a slug is `1 lbf s^2/ft`, 14.5939 kg".to_owned());
    }
    const SPELLED: [(&str, &str); 7] =
        [("milli", "m"), ("centi", "c"), ("kilo", "k"), ("micro", "u"), ("nano", "n"), ("mega", "M"), ("giga", "G")];
    let meant = |spelled: &str| OTHER_WORDS.iter().find(|(word, _)| *word == spelled).map(|(_, meant)| *meant);
    let prefixed = || {
        let prefixed = |(word, prefix): &(&str, &str)| Some(format!("{prefix}{}", meant(lower.strip_prefix(word)?)?));
        SPELLED.iter().find_map(prefixed).filter(|symbol| is_unit(symbol))
    };
    if let Some(meant) = meant(&lower).map(str::to_owned).or_else(prefixed) {
        return Some(format!("did you mean `{meant}`?"));
    }
    // `Nm`, `kNmm`: two symbols without the blank.
    for (middle, _) in symbol.char_indices().skip(1) {
        let (left, right) = symbol.split_at(middle);
        if is_unit(left) && is_unit(right) {
            return Some(format!("did you mean `{left} {right}`? a product needs a blank"));
        }
    }
    let same = KNOWN.iter().map(|known| known.symbol);
    let prefixed = ["mm", "um", "cm", "km", "kg", "ms", "us", "kN", "mN", "kPa", "MPa", "GPa"];
    suggest(symbol, same.chain(prefixed)).map(|found| format!("did you mean `{found}`?"))
}
