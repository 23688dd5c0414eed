//! [`Vary`], [`Span`]: a key of the scene and the values it takes, or the range that its values are from.

use crate::diagnostics::{Diagnostic, codes};
use crate::scene::number_and_unit;

/// A key with all its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Vary {
    /// As in `--set KEY=VALUE`.
    pub key: String,
    /// Texts as in `--set KEY=VALUE`, in running order; at least one.
    pub values: Vec<String>,
}

impl Vary {
    /// Reads `KEY=FROM:TO:COUNT` (`COUNT` equidistant values, both ends included) or `KEY=A,B,...`.
    ///
    /// # Errors
    /// What cannot be understood, with a remedy.
    pub fn parse(text: &str) -> Result<Self, Diagnostic> {
        let bad = |what: String| {
            bad(text, &what)
                .help("write `--vary crank.radius=8mm:10mm:11` (from, to, how many) or `--vary piston.mass=0.03,0.04`")
        };
        let (key, values) = key_and_values(text).map_err(&bad)?;
        let parts: Vec<&str> = values.split(':').map(str::trim).collect();
        let values = match parts[..] {
            [list] => pieces(list),
            [from, to, count] => range(from, to, count).map_err(bad)?,
            _ => return Err(bad("a range has three parts: from, to, how many".into())),
        };
        if values.iter().any(String::is_empty) {
            return Err(bad("a value is missing".into()));
        }
        Ok(Self { key, values })
    }
}

/// A key with the range, or the list, that its values are taken from.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// As in `--set KEY=VALUE`.
    pub key: String,
    from: Among,
}

#[derive(Debug, Clone, PartialEq)]
enum Among {
    /// Numbers between two, both in one unit, which may be empty.
    Range { first: f64, last: f64, unit: String },
    /// One of these.
    List(Vec<String>),
}

impl Span {
    /// Reads `KEY=FROM:TO` or `KEY=A,B,...`.
    ///
    /// # Errors
    /// What cannot be understood, with a remedy.
    pub fn parse(text: &str) -> Result<Self, Diagnostic> {
        let bad = |what: String| {
            bad(text, &what)
                .help("write `--vary crank.radius=8mm:10mm` (from, to), or `--vary simulation.method=dop853,radau5`")
        };
        let (key, values) = key_and_values(text).map_err(&bad)?;
        let parts: Vec<&str> = values.split(':').map(str::trim).collect();
        let from = match parts[..] {
            [list] => Among::List(pieces(list)),
            [from, to] => {
                let (first, last, unit) = ends(from, to).map_err(&bad)?;
                Among::Range { first, last, unit: unit.into() }
            }
            [_, _, _] => return Err(bad("how many values there are is the number of points".into())),
            _ => return Err(bad("a range has two parts: from, to".into())),
        };
        if matches!(&from, Among::List(values) if values.iter().any(String::is_empty)) {
            return Err(bad("a value is missing".into()));
        }
        Ok(Self { key, from })
    }

    /// The value at a share of the range, in [0, 1).
    pub(super) fn at(&self, share: f64) -> String {
        match &self.from {
            Among::Range { first, last, unit } => {
                format!("{}{unit}", shortest(fifteen(first * (1.0 - share) + last * share)))
            }
            Among::List(values) => values[((share * values.len() as f64) as usize).min(values.len() - 1)].clone(),
        }
    }
}

fn bad(text: &str, what: &str) -> Diagnostic {
    Diagnostic::error(codes::BAD_OVERRIDE, format!("`--vary {text}`: {what}"))
}

/// The two sides of the first `=`.
fn key_and_values(text: &str) -> Result<(String, &str), String> {
    let (key, values) = text.split_once('=').ok_or("there is no `=` between key and values")?;
    let key = key.trim().to_string();
    if key.is_empty() { Err("there is no key before the `=`".into()) } else { Ok((key, values)) }
}

/// The parts of a list between commas that are inside no brackets and no quotes.
fn pieces(list: &str) -> Vec<String> {
    let (mut depth, mut quoted) = (0_i32, false);
    let mut all = vec![String::new()];
    for c in list.chars() {
        match c {
            '"' => quoted = !quoted,
            '[' | '{' | '(' => depth += 1,
            ']' | '}' | ')' => depth -= 1,
            _ => {}
        }
        match all.last_mut() {
            Some(last) if c != ',' || depth > 0 || quoted => last.push(c),
            _ => all.push(String::new()),
        }
    }
    all.iter().map(|piece| piece.trim().to_string()).collect()
}

/// Values of a range; each is a run.
const MOST_VALUES: u32 = 1_000_000;

/// Equidistant values, in the unit of both ends.
fn range(from: &str, to: &str, count: &str) -> Result<Vec<String>, String> {
    let (first, last, unit) = ends(from, to)?;
    let count: u32 = count.parse().map_err(|_| format!("`{count}` is no number of values"))?;
    if count < 2 {
        return Err("a range has two values at least".into());
    }
    if count > MOST_VALUES {
        return Err(format!("{count} values are asked for, at most {MOST_VALUES} are possible"));
    }
    let steps = f64::from(count - 1);
    let value = |k: u32| match k {
        k if k == count - 1 => last,
        k => fifteen((first * (steps - f64::from(k)) + last * f64::from(k)) / steps),
    };
    Ok((0..count).map(|k| format!("{}{unit}", shortest(value(k)))).collect())
}

/// The ends of a range, and their unit.
fn ends<'t>(from: &'t str, to: &'t str) -> Result<(f64, f64, &'t str), String> {
    let none = |text: &str| format!("`{text}` does not begin with a number");
    let (first, unit) = number_and_unit(from).ok_or_else(|| none(from))?;
    let (last, own) = number_and_unit(to).ok_or_else(|| none(to))?;
    if unit != own {
        return Err(format!("the ends of a range have one unit, not `{unit}` and `{own}`"));
    }
    Ok((first, last, unit))
}

/// To fifteen digits, so that 0.1 is not written as 0.10000000000000002.
fn fifteen(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// The fewest digits that give the number again.
fn shortest(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-4..1e7).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}
