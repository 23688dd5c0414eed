//! "Did you mean": the nearest of a list of words.

/// The candidate that is most probably meant by `word`, or `None` if none is near enough.
///
/// Near means: equal when case and `-`, `_` are ignored, or at most one typing error (insertion, deletion,
/// substitution, transposition) in three characters, or one word begins the other and at least three
/// characters agree. Among equally near candidates the first one wins. At most 2000 candidates are looked at.
pub fn suggest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    // A broken scene with thousands of names shall not take minutes to be reported.
    const MOST: usize = 2000;
    let wanted = normalised(word);
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates.into_iter().take(MOST) {
        let Some(distance) = distance(&wanted, &normalised(candidate)) else {
            continue;
        };
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate.to_owned())
}

/// The candidates that have a word among their parts between `-` and `_`, or several of these in a row: `spring-damper` is in
/// `translational-spring-damper`. At least three characters of it.
pub fn containing<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let parts = |text: &str| -> Vec<String> {
        text.split(['-', '_']).filter(|part| !part.is_empty()).map(str::to_lowercase).collect()
    };
    let wanted = parts(word);
    if wanted.iter().map(String::len).sum::<usize>() < 3 {
        return Vec::new();
    }
    let has = |candidate: &&str| parts(candidate).windows(wanted.len()).any(|some| some == wanted);
    candidates.into_iter().filter(has).map(str::to_owned).collect()
}

/// Advice on an unknown word: the nearest candidate, or the whole list if it is short.
///
/// `what` names the candidates in the plural, for example `"keys"`.
pub fn help_for(word: &str, candidates: &[&str], what: &str) -> Option<String> {
    if let Some(found) = suggest(word, candidates.iter().copied()) {
        return Some(format!("did you mean `{found}`?"));
    }
    if candidates.is_empty() || candidates.len() > 16 {
        return None;
    }
    let list: Vec<String> = candidates.iter().map(|name| format!("`{name}`")).collect();
    Some(format!("known {what}: {}", list.join(", ")))
}

/// Number of typing errors between two normalised words; `None` if they are too different.
fn distance(wanted: &str, candidate: &str) -> Option<usize> {
    // Work is quadratic in the length, and nobody mistypes a word of this length.
    const LONGEST: usize = 100;
    if wanted.len() > LONGEST || candidate.len() > LONGEST || wanted.is_empty() {
        return None;
    }
    let errors = strsim::damerau_levenshtein(wanted, candidate);
    let length = wanted.chars().count().max(candidate.chars().count());
    if errors <= (length / 3).max(1) && errors < length {
        return Some(errors);
    }
    let common = wanted.chars().count().min(candidate.chars().count());
    let begins = wanted.starts_with(candidate) || candidate.starts_with(wanted);
    (begins && common >= 3).then_some(errors)
}

fn normalised(word: &str) -> String {
    word.chars().filter(|c| !matches!(c, '-' | '_')).flat_map(char::to_lowercase).collect()
}
