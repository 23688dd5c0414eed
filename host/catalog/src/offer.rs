//! [`Offer`]: an element type of a library. Who it is is known from the library's manifest; what it is, is asked for when it is
//! needed, since a scene needs few of a library's types and their descriptions are long.

use std::sync::{Arc, OnceLock};

use element_api::descriptor::Kind;
use element_api::manifest::ManifestElement;
use element_api::set::ElementClass;

use super::CatalogError;

/// Asks a library for a class and judges what comes.
type Read = dyn Fn() -> Result<Arc<dyn ElementClass>, CatalogError> + Send + Sync;

/// See the module documentation.
pub(super) struct Offer {
    announced: ManifestElement,
    class: OnceLock<Arc<dyn ElementClass>>,
    read: Box<Read>,
    /// Whether its library is loaded only where an answer is not known.
    pub(super) at_rest: bool,
}

impl Offer {
    /// One whose class is at hand.
    pub(super) fn of(class: Arc<dyn ElementClass>) -> Self {
        let descriptor = class.descriptor();
        let announced = ManifestElement { kind: descriptor.kind.word().into(), name: descriptor.name.clone() };
        Self::unread(announced, move || Ok(Arc::clone(&class)))
    }

    /// One whose class is read when it is needed.
    pub(super) fn unread(
        announced: ManifestElement,
        read: impl Fn() -> Result<Arc<dyn ElementClass>, CatalogError> + Send + Sync + 'static,
    ) -> Self {
        Self { announced, class: OnceLock::new(), read: Box::new(read), at_rest: false }
    }

    /// Its short name.
    pub(super) fn name(&self) -> &str {
        &self.announced.name
    }

    /// What kind of element it is.
    pub(super) fn is(&self, kind: Option<Kind>) -> bool {
        kind.is_none_or(|kind| self.announced.kind == kind.word())
    }

    /// The word for its kind.
    pub(super) fn kind(&self) -> &str {
        &self.announced.kind
    }

    /// Its class.
    ///
    /// # Errors
    /// The library fails when it is asked, or gives something else.
    pub(super) fn class(&self) -> Result<&Arc<dyn ElementClass>, CatalogError> {
        if let Some(class) = self.class.get() {
            return Ok(class);
        }
        let class = (self.read)()?;
        Ok(self.class.get_or_init(|| class))
    }
}
