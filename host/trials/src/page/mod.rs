//! Page: what pages to read are made of.
//!
//! - **Takes**: texts, numbers, tables, curves.
//! - **Gives**: HTML and SVG that need nothing but themselves; the same data gives the same bytes on every machine.
//! - **May touch**: nothing.
//! - **Must not know**: what the pages are about.
//!
//! | file | content |
//! |---|---|
//! | `html.rs` | the frame of a page, tables, escaping, Markdown |
//! | `chart.rs` | curves over axes |

pub(crate) mod chart;
pub(crate) mod html;
