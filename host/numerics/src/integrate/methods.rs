//! [`Methods`]: the methods of integration by name.

use super::{Auto, Integrator, Radau5, Radau9, Rk4, dop853, dopri5};

/// A method of integration that can be asked for by name.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// As in scenes and on the command line.
    pub name: &'static str,
    /// What it is, in a few words.
    pub summary: &'static str,
    /// Makes one, ready for a run.
    pub make: fn() -> Box<dyn Integrator>,
}

/// Those of this library.
const STANDARD: [Method; 6] = [
    Method {
        name: "auto",
        summary: "dop853 or radau5, whichever gets on at less cost; changes on the way",
        make: || Box::new(Auto::default()),
    },
    Method { name: "dop853", summary: "explicit, Dormand & Prince 8(5,3)", make: || Box::new(dop853()) },
    Method {
        name: "dopri5",
        summary: "explicit, Dormand & Prince 5(4), for loose tolerances",
        make: || Box::new(dopri5()),
    },
    Method {
        name: "radau5",
        summary: "implicit, Radau IIA of order 5, for stiff scenes",
        make: || Box::new(Radau5::default()),
    },
    Method {
        name: "radau9",
        summary: "implicit, Radau IIA of order 9, for stiff scenes at tight tolerances",
        make: || Box::new(Radau9::default()),
    },
    Method { name: "rk4", summary: "classical Runge-Kutta, steps of one size", make: || Box::new(Rk4::default()) },
];

/// The methods that can be asked for: those of this library, and any added.
#[derive(Debug, Clone)]
pub struct Methods(Vec<Method>);

impl Default for Methods {
    fn default() -> Self {
        Self(STANDARD.to_vec())
    }
}

impl Methods {
    /// Adds a method; it takes the place of one of the same name.
    pub fn add(&mut self, method: Method) {
        self.0.retain(|known| known.name != method.name);
        self.0.push(method);
    }

    /// A method of its own for a run.
    #[must_use]
    pub fn make(&self, name: &str) -> Option<Box<dyn Integrator>> {
        self.0.iter().find(|method| method.name == name).map(|method| (method.make)())
    }

    /// All methods.
    #[must_use]
    pub fn list(&self) -> &[Method] {
        &self.0
    }
}

/// A method of this library.
#[must_use]
pub fn by_name(name: &str) -> Option<Box<dyn Integrator>> {
    Methods::default().make(name)
}

/// The names of the methods of this library.
#[must_use]
pub fn names() -> Vec<&'static str> {
    STANDARD.iter().map(|method| method.name).collect()
}
