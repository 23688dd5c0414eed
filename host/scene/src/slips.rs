//! What is probably meant where a scene is no TOML: the remedy beside the parser's own words.

use std::ops::Range;

/// Signs of other programs and languages that look like those of TOML, and what to write.
const LOOKALIKES: [(&str, &str); 5] = [
    ("\u{201c}\u{201d}\u{201e}\u{ab}\u{bb}", "texts stand in straight quotes: `\"`, not `{}`"),
    ("\u{2018}\u{2019}\u{201a}\u{60}\u{b4}", "texts stand in straight quotes: `\"`, not `{}`"),
    ("\u{2212}\u{2013}\u{2014}\u{2010}\u{2011}", "the minus sign is `-`, not `{}`"),
    ("\u{a0}\u{2009}\u{202f}\u{3000}\u{200b}\u{feff}", "a blank here is not that of the space bar: type it again"),
    ("\u{d7}\u{b7}", "a product is written `*`, in quotes: \"2 * 3\""),
];
/// How other languages write true and false, and that there is nothing.
const FLAGS: [(&str, &str); 8] = [
    ("true", "true"),
    ("yes", "true"),
    ("on", "true"),
    (".true.", "true"),
    ("false", "false"),
    ("no", "false"),
    ("off", "false"),
    (".false.", "false"),
];
const NOTHING: [&str; 5] = ["none", "null", "nil", "nan", "undefined"];

/// The remedy for a place at which the text is no TOML, if one is known. `words` are those of the parser.
pub(super) fn remedy(text: &str, place: &Range<usize>, words: &str) -> Option<String> {
    let at = (0..=place.start.min(text.len())).rev().find(|at| text.is_char_boundary(*at))?;
    let begin = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    let line = text[begin..].lines().next().unwrap_or_default();
    let before = line.get(..at - begin).unwrap_or(line);
    let (key, value) = line.split_once('=').unwrap_or((line, ""));
    let (key, value) = (key.trim(), value.split('#').next().unwrap_or_default().trim());
    if words.contains("duplicate key") {
        return Some(duplicate(line.trim()));
    }
    if words.contains("string, expected") && line.matches('"').count() % 2 == 1 {
        return Some("a text ends with the quote that it began with, on the same line: `\"rod\"`".into());
    }
    if words.contains("unicode") || words.contains("escape") {
        return Some("in `\"` a `\\` begins a special character: write `/` between folders, or the text in `'`".into());
    }
    if let Some(help) = LOOKALIKES.iter().find_map(|(signs, help)| {
        let sign = line.chars().find(|sign| signs.contains(*sign))?;
        Some(help.replace("{}", &sign.to_string()))
    }) {
        return Some(help);
    }
    if line.trim_start().starts_with('[') && !line.contains('=') {
        return header(line.trim(), words);
    }
    if !line.contains('=') {
        let (name, given) = line.split_once(':')?;
        return Some(format!("write `{} = {}`", name.trim(), given.trim()));
    }
    if value.starts_with('=') {
        return Some(format!("one `=` is enough: `{key} = {}`", value.trim_start_matches('=').trim()));
    }
    if value.is_empty() {
        return Some(format!("write a value behind the `=`, or leave the line out, if `{key}` is not needed"));
    }
    if let Some((name, given)) = key.split_once(':') {
        return Some(format!("write `{} = {}`", name.trim(), given.trim()));
    }
    for mark in ["//", "%", ";", "--", "!"] {
        if let Some((value, remark)) = value.split_once(mark)
            && is_number(value.trim())
            && !remark.trim_start().starts_with(|c: char| c.is_ascii_digit())
        {
            return Some(format!("a remark begins with `#`, and nothing ends a line: `{key} = {}`", value.trim()));
        }
    }
    if value.starts_with('(') {
        return Some("lists stand in square brackets, with commas between: `[0.5, 0, 0]`".into());
    }
    let listed = value.starts_with(['[', '{']);
    if !listed
        && let Some((whole, rest)) = value.split_once(',')
        && is_whole(whole)
        && is_whole(rest.trim_end_matches(|c: char| !c.is_ascii_digit()))
    {
        return Some(format!(
            "decimals follow a point: `{}`; several numbers are a list in `[ ]`",
            format_args!("{whole}.{rest}")
        ));
    }
    let word = word(line, before.len());
    if listed && word_is_many_numbers(word) {
        return Some("entries of a list stand between commas: `[0.5, 0, 0]`".into());
    }
    if listed && words.contains("comma") {
        return Some("a `,` is missing between two entries, or a bracket at the end of the list or table".into());
    }
    of_word(word.trim())
}

/// Of a value as it stands between brackets and commas.
fn of_word(word: &str) -> Option<String> {
    let lower = word.to_ascii_lowercase();
    if let Some((_, meant)) = FLAGS.iter().find(|(written, _)| *written == lower) {
        return Some(format!("write `{meant}`, in lower case"));
    }
    if NOTHING.contains(&lower.as_str()) {
        return Some("where nothing is meant, leave the key out".into());
    }
    let (sign, bare) = match word.split_at_checked(1) {
        Some((sign @ ("-" | "+"), bare)) => (sign, bare),
        _ => ("", word),
    };
    if bare.starts_with('.') && is_number(bare) {
        return Some(format!("a digit stands before the point: `{sign}0{bare}`"));
    }
    if is_number(bare) {
        let zeros = bare.len() - bare.trim_start_matches('0').len();
        if zeros > 0 && bare[zeros..].starts_with(|c: char| c.is_ascii_digit()) {
            return Some(format!("numbers do not begin with zeros: `{sign}{}`", &bare[zeros..]));
        }
        if let Some((whole, rest)) = bare.split_once('.')
            && !rest.starts_with(|c: char| c.is_ascii_digit())
        {
            return Some(format!("a digit stands behind the point: `{sign}{whole}.0{rest}`"));
        }
    }
    let digits = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    if digits(word) && word.split(' ').all(is_whole) {
        return Some(format!("digits stand without blanks: `{}`", word.replace(' ', "")));
    }
    if digits(bare) && (bare.ends_with(['e', 'E', '-', '+'])) {
        return Some("write the exponent, `1e-3`, or leave the `e` out".into());
    }
    if word.is_empty() || word.contains(['"', '=', '[', '{', '\'']) {
        return None;
    }
    let what = if digits(bare) || word.contains(['*', '/', '+', '^', '(']) {
        "numbers with units, and expressions, stand in quotes"
    } else {
        "texts stand in quotes"
    };
    Some(format!("{what}: `\"{word}\"`"))
}

fn duplicate(line: &str) -> String {
    match line.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((name, _)) => {
            format!("`[{name}]` stands once in a scene: put the keys of both below one of them")
        }
        None => {
            "remove one of the two, or put the second below a `[[...]]` of its own, if it is of another body or element"
                .into()
        }
    }
}

fn header(line: &str, words: &str) -> Option<String> {
    if words.contains("comma") {
        return Some("a `]` is missing at the end of a list in the lines above".into());
    }
    let name = line.trim_matches(['[', ']', ' ']);
    let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'));
    let double = line.starts_with("[[") || line.ends_with("]]");
    plain.then(|| if double { format!("write `[[{name}]]`") } else { format!("write `[{name}]`") })
}

/// What stands at a byte of a line, between brackets, braces, commas, `=` and `#`.
fn word(line: &str, at: usize) -> &str {
    let ends = ['[', ']', '{', '}', ',', '=', '#'];
    let at = at.min(line.len());
    let begin = line[..at].rfind(ends).map_or(0, |end| end + 1);
    let rest = &line[begin..];
    &rest[..rest.find(ends).unwrap_or(rest.len())]
}

fn word_is_many_numbers(word: &str) -> bool {
    let parts: Vec<&str> = word.split([' ', ';', '\t']).filter(|part| !part.is_empty()).collect();
    parts.len() > 1 && parts.iter().all(|part| is_number(part))
}

fn is_whole(text: &str) -> bool {
    !text.is_empty() && text.trim_start_matches('-').chars().all(|c| c.is_ascii_digit())
}

fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok() && text.contains(|c: char| c.is_ascii_digit())
}
