//! [`Releasing`]: joints that let go of their bodies during a run, for good.

use std::ops::Range;

use element_api::Kind;
use odyn_graph::Node;

use super::equations::Equations;
use crate::model::Model;
use crate::plan::Layout;

/// A joint that may be released: its rows are enforced until then, and never again.
#[derive(Debug, Clone, PartialEq)]
pub struct Releasing {
    /// Which element.
    pub element: usize,
    /// Its rows among all.
    pub rows: Range<usize>,
    /// What decides, SI; the time where that does.
    pub value: Node,
    /// Bounds that it lets go beyond, SI, each with its sign: 1 of a largest value, -1 of a least one.
    pub bounds: Vec<(f64, f64)>,
    /// Whether it has let go.
    pub gone: bool,
}

impl Releasing {
    /// What is left of the least of its bounds at a value; not positive where it lets go.
    #[must_use]
    pub fn left(&self, value: f64) -> f64 {
        self.bounds.iter().map(|(sign, bound)| sign * (bound - value)).fold(f64::INFINITY, f64::min)
    }
}

impl Equations {
    /// The joints of the scene that may be released.
    pub(super) fn add_releases(&mut self, model: &Model, layout: &Layout) {
        let value = self.graph.input(Layout::TIME);
        for (element, instance) in model.elements.iter().enumerate() {
            let Some(release) = instance.release.as_ref().filter(|_| instance.class.kind == Kind::Joint) else {
                continue;
            };
            let bounds = [(1.0, release.above), (-1.0, release.below)];
            let bounds = bounds.into_iter().filter_map(|(sign, bound)| Some((sign, bound?))).collect();
            self.releases.push(Releasing { element, rows: layout.rows_of(element), value, bounds, gone: false });
        }
    }

    /// What decides, once everything is written.
    pub(super) fn watch_releases(&mut self, model: &Model, layout: &Layout) {
        for k in 0..self.releases.len() {
            let release = model.elements[self.releases[k].element].release.as_ref();
            if let Some(quantity) = release.and_then(|release| release.quantity.as_ref()) {
                self.releases[k].value = self.observe(quantity, model, layout);
            }
        }
    }

    /// Lets go of these joints, by their elements, and of no others: their rows are enforced no more, whatever else is.
    pub fn let_go(&mut self, elements: &[usize]) {
        self.releases.iter_mut().for_each(|one| one.gone = elements.contains(&one.element));
        self.of_rows = std::sync::OnceLock::new();
        self.set_open(&[]);
    }

    /// The joints that have let go, by their elements.
    #[must_use]
    pub fn released(&self) -> Vec<usize> {
        self.releases.iter().filter(|one| one.gone).map(|one| one.element).collect()
    }

    /// Whether a row is that of a joint that has let go.
    #[must_use]
    pub fn is_gone(&self, row: usize) -> bool {
        self.releases.iter().any(|one| one.gone && one.rows.contains(&row))
    }
}
