//! Page: what pages to read are made of.
//!
//! - **Takes**: texts, numbers, tables, curves.
//! - **Gives**: HTML and SVG that need nothing but themselves; the same data gives the same bytes on every machine.
//! - **May touch**: nothing.
//! - **Must not know**: what the pages are about.
//!
//! | file | content |
//! |---|---|
//! | `html.rs`, `style.css` | the frame of a page, tables, escaping, Markdown; its look |
//! | `chart.rs` | curves over axes |

pub mod chart;
pub mod html;
