//! [`Coverage`]: elements, and which of them no scene verifies.

use std::collections::BTreeSet;

use element_api::Descriptor;

use super::case::Case;
use crate::catalog::Catalog;

/// An element type of a library that a verified scene uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// `package/element`.
    pub name: String,
    /// Package of its library.
    pub library: String,
    /// Version of its library.
    pub version: String,
    /// What the library says of it.
    pub descriptor: Descriptor,
}

/// What a set of cases verifies.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coverage {
    /// Libraries that provide a verified element, sorted.
    pub libraries: Vec<String>,
    /// Full names of their elements that a scene verifies, sorted.
    pub verified: Vec<String>,
    /// Full names of their elements that no scene verifies, sorted.
    pub gaps: Vec<String>,
}

impl Coverage {
    /// The coverage of those libraries that the cases verify at least one element of.
    #[must_use]
    pub fn of(cases: &[Case], elements: &[Element]) -> Self {
        let named: BTreeSet<&str> = cases.iter().flat_map(|case| &case.elements).map(String::as_str).collect();
        let is_verified = |element: &&Element| named.contains(element.name.as_str());
        let libraries: BTreeSet<&str> =
            elements.iter().filter(is_verified).map(|element| element.library.as_str()).collect();
        let (mut verified, mut gaps) = (Vec::new(), Vec::new());
        for element in elements.iter().filter(|element| libraries.contains(element.library.as_str())) {
            let list = if is_verified(&element) { &mut verified } else { &mut gaps };
            list.push(element.name.clone());
        }
        verified.sort();
        gaps.sort();
        Self { libraries: libraries.into_iter().map(str::to_string).collect(), verified, gaps }
    }
}

/// Adds the elements of a catalog to a list, without those that are in it already; sorted by name.
pub(super) fn collect(elements: &mut Vec<Element>, catalog: &Catalog) {
    for handle in catalog.elements() {
        let name = handle.full_name();
        if let Err(at) = elements.binary_search_by(|known| known.name.cmp(&name)) {
            let element = Element {
                name,
                library: handle.library.package.clone(),
                version: handle.library.version.clone(),
                descriptor: handle.descriptor().clone(),
            };
            elements.insert(at, element);
        }
    }
}
