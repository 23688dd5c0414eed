//! Manual: verified cases as pages to read.
//!
//! - **Takes**: cases, elements and outcomes of the stress suite as plain data.
//! - **Gives**: a [`Manual`]: an overview and a page per element; a [`StressPage`]. HTML that needs nothing but itself; the
//!   same data gives the same bytes on every machine.
//! - **May touch**: the folder it is asked to write to.
//! - **Must not know**: how cases and trials were run.
//!
//! | file | content |
//! |---|---|
//! | `index.rs` | the overview |
//! | `element.rs` | the page of an element: its manual page, its tables, its cases |
//! | `analysis.rs` | the page of an analysis: its cases |
//! | `case.rs` | a case on a page |
//! | `plot.rs` | curves over time and tolerance, SVG |
//! | `stress.rs` | the page of the stress suite |

mod analysis;
mod case;
mod element;
mod index;
mod plot;
mod stress;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use crate::verification::{Case, Coverage, Element};

pub use stress::{STRESS_FILE, StressPage};

/// Name of the overview.
pub const INDEX_FILE: &str = "index.html";

/// The verification manual.
pub struct Manual<'a> {
    /// The cases, in the order in which they are shown.
    pub cases: &'a [Case],
    /// Elements that the cases may name.
    pub elements: &'a [Element],
    /// Which of them are verified, and which are not.
    pub coverage: &'a Coverage,
}

impl Manual<'_> {
    /// File names and contents of all pages, the overview first.
    #[must_use]
    pub fn pages(&self) -> Vec<(String, String)> {
        let mut pages = vec![(INDEX_FILE.to_string(), index::page(self))];
        for element in self.shown() {
            pages.push((page_name(&element.name), element::page(self, element)));
        }
        for analysis in self.analyses() {
            pages.push((page_name(&analysis::name(analysis)), analysis::page(self, analysis)));
        }
        pages
    }

    /// Writes all pages, making the folder where it is missing. Files of other names are left alone.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        for (name, text) in self.pages() {
            fs::write(folder.join(name), text)?;
        }
        Ok(())
    }

    /// The elements that have a page: those in the coverage, verified or not.
    fn shown(&self) -> impl Iterator<Item = &Element> {
        let Coverage { verified, gaps, .. } = self.coverage;
        self.elements.iter().filter(|element| verified.contains(&element.name) || gaps.contains(&element.name))
    }

    /// The analyses that cases verify, each once, sorted.
    fn analyses(&self) -> BTreeSet<&str> {
        self.cases.iter().filter_map(|case| case.analysis.as_deref()).collect()
    }

    /// The cases that verify an element.
    fn cases_of<'b>(&'b self, element: &'b str) -> impl Iterator<Item = &'b Case> {
        self.cases.iter().filter(move |case| case.elements.iter().any(|name| name == element))
    }

    /// The cases that no page shows: they name no element and no analysis, or could not even be read.
    fn homeless(&self) -> impl Iterator<Item = &Case> {
        let shown = |name: &String| self.shown().any(|element| element.name == *name);
        self.cases.iter().filter(move |case| case.analysis.is_none() && !case.elements.iter().any(shown))
    }
}

/// File name of the page of an element: `odyn-joints.revolute.html`.
fn page_name(element: &str) -> String {
    format!("{}.html", element.replace('/', "."))
}
