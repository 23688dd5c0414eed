//! [`Choices`]: what is exported of a scene, and how it is stepped.

use crate::method::Method;

/// Choices of an export.
#[derive(Debug, Clone)]
pub struct Choices {
    /// Size of a step, s; a thousandth of the duration if left out.
    pub step: Option<f64>,
    /// Method of integration.
    pub method: &'static Method,
    /// See [`crate::Machine::tolerance`]; for methods with an estimate of their error.
    pub tolerance: Option<f64>,
    /// Inputs by their names; all if left out. The others stay at their values at the start.
    pub inputs: Option<Vec<String>>,
    /// Outputs by their names; all if left out.
    pub outputs: Option<Vec<String>>,
    /// Whether exact derivatives along directions are wanted.
    pub derivatives: bool,
}

impl Default for Choices {
    fn default() -> Self {
        Self {
            step: None,
            method: &crate::METHODS[0],
            tolerance: None,
            inputs: None,
            outputs: None,
            derivatives: false,
        }
    }
}
