//! The resolved scene: indices instead of names, everything checked.
//!
//! - **Takes**: a [`crate::scene::Scene`] and a [`crate::catalog::Catalog`].
//! - **Gives**: a [`Model`]: bodies, markers, element instances with their recorded equations, output channels. Or every
//!   mistake found, each with its place in the scene.
//! - **May touch**: element classes (create, record).
//! - **Must not know**: offsets in vectors, solvers.
//!
//! | file | content |
//! |---|---|
//! | `types.rs` | the model |
//! | `bodies.rs` | masses and inertias, fixed bodies |
//! | `elements.rs` | markers, creation and recording of elements |
//! | `fmus.rs` | FMUs among the elements: a class for each file |
//! | `behind.rs` | what results of elements are made of |
//! | `inertia.rs` | kinetic energies that elements bring |
//! | `catalogue.rs` | rows of recommended parameters that libraries bring along |
//! | `parameters.rs` | parameters against their descriptions |
//! | `declared.rs` | units that elements declare |
//! | `doubtful.rs` | what is valid and most probably not meant |
//! | `idle.rs` | parameters that are written and change nothing |
//! | `tables.rs` | curves that leave their points, or that no joint can follow |
//! | `together.rs` | points of an element between which a line has no direction |
//! | `margins.rs` | what is looked at while a scene runs: checks of elements, arguments of grids |
//! | `channels.rs` | the words of requested outputs |
//! | `release.rs` | when joints let go |
//! | `picture.rs` | what a picture of the motion is made of |
//! | `schema.rs` | what elements add to the JSON schema of scenes |

mod behind;
mod bodies;
mod catalogue;
mod channels;
mod declared;
mod doubtful;
mod elements;
mod fmus;
mod idle;
mod inertia;
mod margins;
mod moved_rows;
mod parameters;
mod picture;
mod release;
pub mod schema;
mod signals;
mod tables;
mod together;
mod types;

#[cfg(test)]
mod tests;

use nalgebra::Vector3;

use crate::catalog::Catalog;
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::Scene;

pub use behind::{conditions, operations_behind, rows};
pub use catalogue::Catalogue;
pub use declared::{DeclaredUnit, declared_units};
pub(crate) use inertia::NO_ARM;
pub use inertia::{FramePose, flexible_diagonals, loads_along, mass_at, mass_of_element};
pub use margins::{Watched, WatchedValue};
pub use parameters::resolve as resolve_parameters;
pub use picture::{Place, Shown, movable_records, place_of_shape};
pub use release::Release;
pub use together::{needs_distance, origins, together};
pub use types::{
    Axes, Body, Channel, GridUse, Instance, Lent, Level, MAGNITUDE, Marker, Model, Quantity, Signal, Source, Thin,
    euler_parameters, rotation, skew,
};

/// A model and what the user should know about it.
pub type Resolved = (Model, Vec<Diagnostic>);

/// Resolves a scene; with `thoroughly`, parameters that change nothing are warned of, for which elements are recorded again with other
/// values.
///
/// # Errors
/// All mistakes found: unknown names, impossible masses, parameters out of range, elements that refuse, unknown outputs.
pub fn resolve(scene: &Scene, catalog: &Catalog, thoroughly: bool) -> Result<Resolved, Vec<Diagnostic>> {
    let mut found = Vec::new();
    let mut bodies = bodies::resolve(scene, &mut found);
    let mut elements = elements::resolve(scene, catalog, &bodies, thoroughly, &mut found);
    if bodies.movable.is_empty() && !found.iter().any(Diagnostic::is_error) {
        let place = scene.bodies.first().map_or(scene.simulation.span.clone(), |body| body.name.span.clone());
        found.push(
            Diagnostic::error(codes::NOTHING_TO_DO, "no body can move")
                .at(place, "")
                .help("add a `[[body]]` without `fixed = true`"),
        );
    }
    let channels = channels::resolve(scene, &bodies, &elements, &mut found);
    if !found.iter().any(Diagnostic::is_error) {
        signals::connect(scene, catalog, &channels, &mut elements.instances, &mut found);
        release::resolve(scene, &channels, &mut elements.instances, &mut found);
        signals::warn_of_unused(scene, &channels, &elements.instances, &mut found);
        doubtful::warn(scene, &bodies.movable, &elements.instances, &mut found);
    }
    if found.iter().any(Diagnostic::is_error) {
        return Err(found);
    }
    inertia::lend(&mut bodies.movable, &elements.instances);
    let model = Model {
        bodies: bodies.movable,
        elements: elements.instances,
        sets: elements.sets,
        fmus: elements.fmus,
        gravity: Vector3::from(scene.simulation.gravity),
        inputs: scene.inputs.iter().map(signals::given).collect(),
        channels,
    };
    Ok((model, found))
}
