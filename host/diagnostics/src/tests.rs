//! Tests of the room: table of codes, rendering, locations, suggestions.

use super::codes::{self, TABLE};
use super::*;

fn scene() -> Source {
    Source::new("a.toml", "[[body]]\nname = \"rotor\"\nvellocity = [0, 0, 0]\n")
}

#[test]
fn codes_are_unique_and_sorted() {
    for pair in TABLE.windows(2) {
        assert!(pair[0].code < pair[1].code, "{}", pair[1].code);
    }
}

#[test]
fn codes_are_well_formed() {
    for entry in TABLE {
        let digits = entry.code.strip_prefix("ODY").expect("prefix");
        assert!(digits.len() == 4 && digits.bytes().all(|b| b.is_ascii_digit()));
        assert!(("01".."09").contains(&&digits[..2]), "{}", entry.code);
        assert!(!entry.title.is_empty() && !entry.title.ends_with('.'));
        assert!(entry.text.ends_with('.'), "{}", entry.code);
    }
}

#[test]
fn every_code_is_on_the_page() {
    let page = codes::page();
    for entry in TABLE {
        let heading = format!("### {}: ", entry.code);
        assert!(page.contains(&heading) && page.contains(entry.text), "{} is not there", entry.code);
    }
}

#[test]
fn explain_ignores_case() {
    let entry = codes::explain(" ody0102 ").expect("known code");
    assert_eq!(entry, codes::UNKNOWN_KEY);
    assert!(codes::explain("ODY9999").is_none());
}

#[test]
fn renders_like_a_compiler() {
    let diagnostic = Diagnostic::error(codes::UNKNOWN_KEY, "unknown key `vellocity` in body `rotor`")
        .at(24..33, "not a key of a body")
        .context(0..8, "in this body")
        .help("did you mean `velocity`?");
    let expected = "\
error[ODY0102]: unknown key `vellocity` in body `rotor`
 --> a.toml:3:1
  |
1 | [[body]]
  | -------- in this body
2 | name = \"rotor\"
3 | vellocity = [0, 0, 0]
  | ^^^^^^^^^ not a key of a body
  |
  = help: did you mean `velocity`?

";
    assert_eq!(render(&[diagnostic], &scene(), false), expected);
}

#[test]
fn a_diagnostic_without_span_has_no_snippet() {
    let mut diagnostic = Diagnostic::warning(codes::INTERRUPTED, "interrupted at t = 3 ms");
    diagnostic.labels.push(Label { span: None, text: "results are kept".to_owned(), primary: true });
    assert_eq!(
        render(&[diagnostic], &scene(), false),
        "warning[ODY0603]: interrupted at t = 3 ms\n |\n = note: results are kept\n\n"
    );
}

#[test]
fn additions_are_rendered_as_their_own_text() {
    let mut source = scene();
    let start = source.add("command line", "--set rotor.mass=9mm");
    let diagnostic = Diagnostic::error(codes::DIMENSION, "expected a mass, found a length")
        .at(start + 17..start + 20, "this is a length")
        .context(0..8, "of this body");
    let text = render(&[diagnostic], &source, false);
    assert!(text.contains(" --> command line:1:18\n"), "{text}");
    assert!(text.contains("1 | --set rotor.mass=9mm\n"), "{text}");
    assert!(text.contains("::: a.toml:1:1\n"), "{text}");
}

#[test]
fn impossible_spans_do_not_panic() {
    let source = Source::new("ä.toml", "größe = 1");
    for (start, end) in [(0, 99), (3, 4), (4, 3), (11, 11), (12, 13), (500, 600), (5, 2)] {
        let diagnostic = Diagnostic::error(codes::SYNTAX, "x").at(Range { start, end }, "here");
        assert!(render(&[diagnostic], &source, true).contains("ODY0101"));
        source.locate(start);
    }
    let empty = Source::new("empty.toml", "");
    let diagnostic = Diagnostic::error(codes::SYNTAX, "x").at(0..0, "here");
    assert!(render(&[diagnostic], &empty, false).contains("empty.toml:1:1"));
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    let source = Source::new("a\u{1b}[2J.toml", "x = \"\u{1b}[2J\"");
    let diagnostic = Diagnostic::error(codes::SYNTAX, "m\u{1b}[2J").at(0..3, "l\u{1b}[2J").help("h\u{1b}[2J");
    assert!(!render(&[diagnostic], &source, false).contains('\u{1b}'));
}

#[test]
fn colour_is_only_where_asked_for() {
    let diagnostic = [Diagnostic::error(codes::SYNTAX, "x")];
    assert!(render(&diagnostic, &scene(), true).contains('\u{1b}'));
    assert!(!render(&diagnostic, &scene(), false).contains('\u{1b}'));
}

#[test]
fn summary_counts_errors_and_warnings() {
    let error = Diagnostic::error(codes::SYNTAX, "");
    let warning = Diagnostic::warning(codes::NORMALISED, "");
    let note = Diagnostic::note(codes::SYNTAX, "");
    assert_eq!(summary(&[]), "");
    assert_eq!(summary(&[note.clone(), warning.clone()]), "1 warning");
    assert_eq!(summary(&[error.clone(), warning.clone(), error.clone(), note, error]), "3 errors, 1 warning");
}

#[test]
fn columns_count_characters() {
    let source = Source::new("a", "größe = 1\r\nb = µ");
    assert_eq!(line_column(&source, 0), (1, 1));
    assert_eq!(line_column(&source, 4), (1, 4)); // inside `ß`: its start
    assert_eq!(line_column(&source, 8), (1, 7));
    assert_eq!(line_column(&source, source.text.len()), (2, 6));
}

#[test]
fn offsets_of_additions_never_meet() {
    let mut source = Source::new("a", "abc");
    let first = source.add("one", "");
    let second = source.add("two", "xy");
    assert_eq!(source.locate(3).name, "a");
    assert_eq!(source.locate(first).name, "one");
    assert_eq!(source.locate(second + 2).name, "two");
    assert_eq!(source.slice(second..second + 2), Some("xy"));
    assert_eq!(source.slice(1..3), Some("bc"));
    assert_eq!(source.slice(2..second), None);
}

#[test]
fn suggestions_find_typing_errors_only() {
    let words = ["velocity", "angular_velocity", "position", "com"];
    assert_eq!(suggest("vellocity", words).as_deref(), Some("velocity"));
    assert_eq!(suggest("Position", words).as_deref(), Some("position"));
    assert_eq!(suggest("angularVelocity", words).as_deref(), Some("angular_velocity"));
    assert_eq!(suggest("pos", words).as_deref(), Some("position"));
    assert_eq!(suggest("stiffness", words), None);
    assert_eq!(suggest("", words), None);
    assert_eq!(suggest(&"x".repeat(1_000_000), words), None);
}

#[test]
fn words_are_found_in_longer_names_whole() {
    let words = ["rotational-spring-damper", "translational-spring-damper", "spring_stop", "springy-damper"];
    assert_eq!(containing("spring-damper", words), words[..2]);
    assert_eq!(containing("Spring_Damper", words), words[..2]);
    assert_eq!(containing("spring", words), words[..3]);
    for word in ["damper-spring", "pring", "", "-", "of"] {
        assert_eq!(containing(word, words), [""; 0], "{word}");
    }
}

#[test]
fn help_lists_short_sets_of_words() {
    assert_eq!(help_for("zzz", &["at", "peak"], "words").as_deref(), Some("known words: `at`, `peak`"));
    assert_eq!(help_for("peek", &["at", "peak"], "words").as_deref(), Some("did you mean `peak`?"));
    assert_eq!(help_for("zzz", &[], "words"), None);
}
