//! [`report`]: the page of one or several runs.

use std::path::{Path, PathBuf};

use crate::curves::curves;
use crate::elements;
use crate::events;
use crate::pack::pack;
use crate::page::html::{escape, page_with};
use crate::results::{ResultsError, replace};
use crate::sections;
use crate::source::Source;

/// The scripts of a page, bundled when this crate was built; empty where they could not be.
const BUNDLE: &str = include_str!(concat!(env!("OUT_DIR"), "/report.js"));

/// The scripts of the studio's page, likewise.
const STUDIO: &str = include_str!(concat!(env!("OUT_DIR"), "/studio.js"));

/// Which scripts a page gets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scripts {
    /// Those that are built in, if there are any.
    #[default]
    BuiltIn,
    /// None: plots are drawings, and there is no motion.
    Without,
}

impl Scripts {
    /// Whether reports of this build move.
    #[must_use]
    pub fn are_built_in() -> bool {
        !BUNDLE.is_empty()
    }

    /// The scripts of the studio's page; empty where they were not built in.
    #[must_use]
    pub fn studio() -> &'static str {
        STUDIO
    }

    fn text(self) -> Option<&'static str> {
        (self == Self::BuiltIn && Self::are_built_in()).then_some(BUNDLE)
    }
}

/// Reads folders of results and writes their report.
///
/// # Errors
/// Folders that cannot be read, a file that cannot be written.
pub fn write(folders: &[PathBuf], output: &Path) -> Result<(), ResultsError> {
    let sources = folders.iter().map(|folder| Source::read(folder)).collect::<Result<Vec<_>, _>>()?;
    replace(output, report(&sources, Scripts::BuiltIn).as_bytes(), false)
}

/// The page of runs, the first of which the others are compared with. It needs no other file and no network.
#[must_use]
pub fn report(sources: &[Source], scripts: Scripts) -> String {
    let titles: Vec<&str> = sources.iter().map(Source::title).collect();
    let title = match titles[..] {
        [] => "Report",
        [first, ..] => first,
    };
    let several = sources.len() > 1;
    let mut body = format!("<header><h1>{}</h1></header>\n<main>\n", escape(title));
    body.push_str("<section aria-label=\"Verdict\">\n");
    for source in sources {
        body.push_str(&sections::verdict(source, several));
    }
    body.push_str("</section>\n");
    let moves = sources.iter().any(|source| source.motion.is_some());
    let bundle = scripts.text();
    // Analyses may have nothing that moves, and nothing over time.
    if moves || sources.iter().any(|source| source.text("analysis").is_empty()) {
        body.push_str("<section><h2>Motion</h2>\n");
        body.push_str(match (moves, bundle) {
            (true, Some(_)) => "<div id=\"motion\"></div>\n",
            (true, None) => {
                "<p class=\"note\">This copy of odyn was built without the scripts that show motion. Build it where npm is \
                 installed, and make the report again.</p>\n"
            }
            (false, _) => {
                "<p class=\"note\">The run wrote no motion. Run it with <code>--motion</code>, or with <code>motion = true</code> in \
                 <code>[simulation]</code>, and make the report again.</p>\n"
            }
        });
        body.push_str("</section>\n");
    }
    let has_curves = |source: &Source| !source.table.columns.is_empty() || source.text("analysis").is_empty();
    if sources.iter().any(has_curves) {
        body.push_str("<section><h2>Plots</h2>\n<div id=\"plots\">");
        if bundle.is_none() {
            body.extend(sources.iter().map(|source| {
                let name = if several { format!("<h3>{}</h3>\n", escape(&source.name)) } else { String::new() };
                name + &curves(source)
            }));
        }
        body.push_str("</div></section>\n");
        let happened: String = sources.iter().map(|source| events::summary(source, several)).collect();
        if !happened.is_empty() {
            body.push_str(&format!("<section><h2>Events</h2>\n{happened}<div id=\"events\"></div></section>\n"));
        }
        if bundle.is_some() {
            body.push_str("<section><h2>Table</h2>\n<div id=\"table\"></div></section>\n");
        }
    }
    for source in sources {
        body.push_str(&elements::sections(source, several));
    }
    for source in sources {
        body.push_str(&sections::details(source, several));
    }
    body.push_str("</main>\n");
    if let Some(bundle) = bundle {
        body.push_str(&format!("<script type=\"text/plain\" id=\"odyn-data\">{}</script>\n", pack(sources)));
        body.push_str(&format!("<script>{bundle}</script>\n"));
    }
    page_with(title, &body, "report")
}
