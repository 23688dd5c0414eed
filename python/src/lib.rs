//! `odyn._odyn`: what the Python package `odyn` is made of. Its Python part (`python/odyn`) gives names, units and conversions;
//! here scenes are opened and run.
//!
//! - **Takes**: paths, texts of scenes, `--set` texts, numbers.
//! - **Gives**: arrays that own what a run left, JSON for everything else, `odyn.Error`.
//! - **May touch**: the host through its public interface; the interpreter.
//! - **Must not know**: anything the library doesn't offer to everyone.
//!
//! | file | content |
//! |---|---|
//! | `array.rs` | numbers that NumPy sees where they are |
//! | `error.rs` | errors and warnings as Python has them |
//! | `work.rs` | work beside the interpreter: its lock is free, Ctrl-C and progress are seen |
//! | `model.rs` | a scene with what is set of it |
//! | `run.rs` | what a run gave |
//! | `analyses.rs` | statics, modes, linear models, efforts, kinematics, loads, balancing, sensitivities, fits |
//! | `simulation.rs` | a scene that is stepped from outside |
//! | `system.rs` | the equations of motion for integrators of others |

mod analyses;
mod array;
mod error;
mod model;
mod run;
mod simulation;
mod system;
mod work;

use pyo3::prelude::*;

/// The compiled part of the package `odyn`.
#[pymodule]
mod _odyn {
    use std::path::PathBuf;

    use pyo3::prelude::*;

    #[pymodule_export]
    use super::analyses::{balance, fitted, inverse, kinematics, linearise, loads, modes, sensitivity, statics};
    #[pymodule_export]
    use super::array::Array;
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::run::Run;
    #[pymodule_export]
    use super::simulation::{Saved, Simulation};
    #[pymodule_export]
    use super::system::System;

    /// Version of the host.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// Names the program that came with the package: libraries beside it are the own ones, and it loads those of strangers.
    #[pyfunction]
    fn belongs_to(program: PathBuf) {
        odyn::catalog::belongs_to(program);
        #[cfg(unix)]
        odyn::catalog::put_up_glass();
    }

    /// Ends the processes that were started for libraries of strangers.
    #[pyfunction]
    fn farewell(py: Python<'_>) {
        #[cfg(unix)]
        py.detach(odyn::catalog::farewell);
        #[cfg(not(unix))]
        let _ = py;
    }

    /// Whether a text is a unit, such as `mm` or `N s/m`.
    #[pyfunction]
    fn is_unit(text: &str) -> bool {
        odyn::scene::parse_unit(text).is_ok()
    }

    /// The page of runs in folders of results.
    #[pyfunction]
    fn report(py: Python<'_>, folders: Vec<PathBuf>) -> PyResult<String> {
        super::report(py, &folders)
    }
}

/// The page of runs in folders of results.
fn report(py: Python<'_>, folders: &[std::path::PathBuf]) -> PyResult<String> {
    use odyn::desk::{Scripts, Source, report};
    let page = py.detach(|| {
        let sources = folders.iter().map(|folder| Source::read(folder)).collect::<Result<Vec<_>, _>>()?;
        Ok(report(&sources, Scripts::BuiltIn))
    });
    page.map_err(|error: odyn::results::ResultsError| error::of_diagnostic(py, error.diagnostic()))
}
