//! Symbols of units, as far as a derive must know them: which are SI, which are known. A scene knows the rest.

/// SI units, of which one is one.
const SI: [&str; 9] = ["m", "kg", "s", "N", "J", "W", "Pa", "Hz", "rad"];
/// Others that scenes know, with the SI unit to write instead.
const OTHERS: [(&str, &str); 15] = [
    ("g", "kg"),
    ("t", "kg"),
    ("min", "s"),
    ("h", "s"),
    ("bar", "Pa"),
    ("deg", "rad"),
    ("°", "rad"),
    ("turn", "rad"),
    ("rev", "rad"),
    ("rpm", "rad/s"),
    ("in", "m"),
    ("ft", "m"),
    ("lbm", "kg"),
    ("lbf", "N"),
    ("%", "1"),
];
/// Those that take prefixes.
const PREFIXED: [&str; 9] = ["m", "g", "s", "N", "J", "W", "Pa", "bar", "Hz"];
const PREFIXES: [&str; 12] = ["p", "n", "u", "µ", "μ", "m", "c", "d", "k", "M", "G", "T"];

/// What a symbol is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Symbol {
    /// An SI unit.
    Si,
    /// Another one; the SI unit to write instead.
    Other(&'static str),
    /// None; what was probably meant, or empty.
    Unknown(String),
}

/// Looks a symbol up as scenes do: as written first, then with a prefix.
pub(crate) fn look_up(symbol: &str) -> Symbol {
    if SI.contains(&symbol) {
        return Symbol::Si;
    }
    if let Some((_, si)) = OTHERS.iter().find(|(other, _)| *other == symbol) {
        return Symbol::Other(si);
    }
    let stem = |prefix: &&str| symbol.strip_prefix(prefix).filter(|stem| PREFIXED.contains(stem) || *stem == "rad");
    if let Some(stem) = PREFIXES.iter().find_map(stem) {
        let si = OTHERS.iter().find(|(other, _)| *other == stem).map(|(_, si)| *si);
        return Symbol::Other(si.or_else(|| SI.into_iter().find(|si| *si == stem)).unwrap_or("1"));
    }
    let two = symbol.char_indices().skip(1).map(|(middle, _)| symbol.split_at(middle));
    let known = |text: &str| look_up_one(text);
    let meant = two.into_iter().find(|(left, right)| known(left) && known(right));
    Symbol::Unknown(meant.map(|(left, right)| format!("{left} {right}")).unwrap_or_default())
}

fn look_up_one(symbol: &str) -> bool {
    SI.contains(&symbol) || OTHERS.iter().any(|(other, _)| *other == symbol)
}

/// The first symbol of a unit (or of `argument -> value`) that is no SI unit.
pub(crate) fn not_si(unit: &str) -> Option<(&str, Symbol)> {
    let is_part = |c: char| c.is_alphabetic() || matches!(c, '%' | '°' | '_');
    let symbols = unit.split(|c: char| !is_part(c)).filter(|symbol| !symbol.is_empty());
    let judged = symbols.map(|symbol| (symbol, look_up(symbol)));
    // What nobody knows is worse than what is not SI.
    let mut found: Vec<_> = judged.filter(|(_, what)| *what != Symbol::Si).collect();
    found.sort_by_key(|(_, what)| matches!(what, Symbol::Other(_)));
    found.into_iter().next()
}
