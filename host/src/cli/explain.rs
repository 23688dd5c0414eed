//! `odyn explain`

use odyn::diagnostics::{codes, suggest};
use odyn::results::Remedy;

use super::args::ExplainArgs;
use super::exit;
use super::failure::Failure;
use super::terminal;

/// Explains one code or remedy, or lists all.
pub(super) fn explain(args: &ExplainArgs) -> Result<u8, Failure> {
    if args.markdown {
        terminal::print(&format!("{}{}", codes::page(), Remedy::page()))?;
        return Ok(exit::DONE);
    }
    let Some(code) = &args.code else {
        let lines = codes::TABLE.iter().map(|entry| format!("{}  {}\n", entry.code, entry.title));
        let remedies = Remedy::ALL.iter().map(|remedy| format!("{:22}{}\n", remedy.name(), remedy.counted()));
        let remedies: String = remedies.collect();
        terminal::print(&format!(
            "{}\nRemedies of a run, counted in its report:\n{remedies}",
            lines.collect::<String>()
        ))?;
        return Ok(exit::DONE);
    };
    if let Some(remedy) = Remedy::named(code) {
        let (meaning, advice) = (wrapped(remedy.meaning()), wrapped(remedy.advice()));
        terminal::print(&format!("{}: {}\n\n{meaning}\n\n{advice}\n", remedy.name(), remedy.counted()))?;
        return Ok(exit::DONE);
    }
    let Some(entry) = codes::explain(code) else {
        let names = codes::TABLE.iter().map(|entry| entry.code).chain(Remedy::ALL.iter().map(|remedy| remedy.name()));
        let near = suggest(code, names);
        let advice = near.map_or_else(String::new, |near| format!("did you mean `{near}`? "));
        eprintln!("error: there is no code or remedy `{code}`\nhelp: {advice}`odyn explain` lists all");
        return Ok(exit::USAGE);
    };
    terminal::print(&format!("{}: {}\n\n{}\n", entry.code, entry.title, wrapped(entry.text)))?;
    Ok(exit::DONE)
}

/// Lines of at most 100 characters, broken at blanks.
fn wrapped(text: &str) -> String {
    const WIDTH: usize = 100;
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("there is always a line");
        if line.is_empty() {
            line.push_str(word);
        } else if line.chars().count() + 1 + word.chars().count() <= WIDTH {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines.join("\n")
}
