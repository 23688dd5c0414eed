//! Control elements `fmu`: a class for each file, and parameters that are those of the FMU.

use crate::catalog::{Catalog, ElementHandle};
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::{ElementKind, ElementRecord, Scene, Spanned};
use element_api::Kind;

/// Names of the element type, short and full.
const NAMES: [&str; 2] = ["fmu", "odyn-fmu/fmu"];
/// What stands for a library of them, where a catalog lists them.
pub(super) const GENERAL: &str = "odyn-fmu";
/// The table of the FMU's own parameters.
pub(super) const PARAMETERS: &str = "parameters";

/// Whether an element is an FMU: no library has a type of that name.
pub(super) fn is_one(record: &ElementRecord, catalog: &Catalog) -> bool {
    let name = record.type_name.value.as_str();
    record.kind == ElementKind::Control
        && NAMES.contains(&name)
        && catalog.find(name, Some(Kind::Control)).map_or(true, |known| known.library.package == GENERAL)
}

/// The class of the FMU that a record names.
pub(super) fn class_of(
    scene: &Scene,
    record: &ElementRecord,
    catalog: &Catalog,
) -> Result<ElementHandle, Box<Diagnostic>> {
    let Some(file) = record.params.get("file") else {
        let message = format!("`{}` names no FMU", record.name.value);
        let diagnostic = Diagnostic::error(codes::MISSING_ELEMENT_PARAMETER, message);
        return Err(Box::new(
            diagnostic.at(record.span.clone(), "").help("params.file = \"controller.fmu\"   # beside the scene"),
        ));
    };
    let Some(written) = file.as_text() else {
        let message = format!("`file` must be a text, found {}", file.kind.describe());
        return Err(Box::new(Diagnostic::error(codes::WRONG_TYPE, message).at(file.span.clone(), "")));
    };
    catalog.fmu(&scene.source.beside(written), written).map_err(|error| {
        Box::new(error.diagnostic().at(file.span.clone(), format!("the FMU of `{}`", record.name.value)))
    })
}

/// The record with the parameters of the FMU among its own, their names as the class describes them; `None`: it has none.
pub(super) fn flattened(record: &ElementRecord, handle: &ElementHandle) -> Option<ElementRecord> {
    if !handle.descriptor().params.iter().any(|spec| spec.name == "file")
        || !NAMES.contains(&record.type_name.value.as_str())
    {
        return None;
    }
    let (_, own) = record.params.entries.iter().find(|(key, _)| key.value == PARAMETERS)?;
    let own = own.as_table()?.clone();
    let mut flat = record.clone();
    flat.params.entries.retain(|(key, _)| key.value != PARAMETERS);
    let named = own.entries.into_iter().map(|(key, value)| {
        let name = format!("{PARAMETERS}.{}", key.value);
        (Spanned::new(name, key.span), value)
    });
    flat.params.entries.extend(named);
    Some(flat)
}
