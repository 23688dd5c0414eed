//! [`fitted_scene`]: the text of a scene with fitted numbers in the places of those that it had.

use std::path::Path;

use super::Fit;
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::{Document, Override};
use crate::session::SessionError;

/// The text of a scene file with the numbers of a fit. Comments, formulas of other numbers and all else stay.
///
/// # Errors
/// The file cannot be read, or one of the numbers was given by `overrides` and is not in it.
pub fn fitted_scene(path: &Path, overrides: &[Override], fit: &Fit) -> Result<String, SessionError> {
    let document = Document::open(path).map_err(|rejected| SessionError::from(*rejected))?;
    let source = document.source().clone();
    let mut text = source.text.to_string();
    let refused = |key: &str| {
        let message = format!("the fitted scene cannot be written: `{key}` has its value from the command line");
        let help = "write it in the scene, or use the `--set` texts of the fit";
        SessionError::one(&source, Diagnostic::error(codes::BAD_OVERRIDE, message).help(help))
    };
    let mut changes = Vec::new();
    for (fitted, set) in fit.parameters.iter().zip(&fit.sets) {
        // Spans of what overrides give are behind the file's text.
        let found = document.setting(&fitted.key, overrides).ok().flatten();
        let place = found.map(|raw| raw.span).filter(|span| span.end <= source.text.len() && !span.is_empty());
        let place = place.ok_or_else(|| refused(&fitted.key))?;
        let (_, value) = set.split_once('=').ok_or_else(|| refused(&fitted.key))?;
        let value = if value.parse::<f64>().is_ok() { value.to_owned() } else { format!("\"{value}\"") };
        changes.push((place, value));
    }
    changes.sort_by_key(|(place, _)| std::cmp::Reverse(place.start));
    changes.into_iter().for_each(|(place, value)| text.replace_range(place, &value));
    Ok(text)
}
