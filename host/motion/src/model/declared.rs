//! The units that elements declare: numbers reach them, and come from them, in SI.

use element_api::descriptor::Descriptor;
use element_api::params::{ParamKind, ParamSpec};

use crate::catalog::ElementHandle;
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::{ElementRecord, UnitSystem, parse_unit};

/// A unit that an element may not declare.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeclaredUnit {
    /// What has it, and why that is wrong.
    pub message: String,
    /// What to declare instead.
    pub remedy: String,
}

/// Units of parameters, inputs, reported values and checks that cannot be read, or are not those of SI: what numbers mean would not be
/// what is shown of them.
#[must_use]
pub fn declared_units(class: &Descriptor) -> Vec<DeclaredUnit> {
    let reported =
        class.channels.iter().map(|own| ("channel", own)).chain(class.values.iter().map(|own| ("value", own)));
    let reported = reported.chain(class.checks.iter().map(|own| ("check", own)));
    let reported = reported.filter_map(|(what, own)| wrong(&own.unit, &format!("{what} `{}`", own.name), false));
    let inputs = class.inputs.iter().filter_map(|own| wrong(&own.unit, &format!("input `{}`", own.name), false));
    let of_parameter = |spec: &ParamSpec| {
        let what = format!("parameter `{}`", spec.name);
        parts(spec).into_iter().filter_map(|unit| wrong(unit, &what, true)).collect::<Vec<_>>()
    };
    class.params.iter().flat_map(of_parameter).chain(inputs).chain(reported).collect()
}

/// An element of the scene whose class declares such units.
pub(super) fn refused(record: &ElementRecord, handle: &ElementHandle) -> Vec<Diagnostic> {
    let defect = format!("this is a defect of {} {}", handle.library.package, handle.library.version);
    let told = |DeclaredUnit { message, remedy }| {
        Diagnostic::error(codes::PLUGIN_MISBEHAVED, format!("`{}`: {message}", handle.full_name()))
            .at(record.type_name.span.clone(), format!("for `{}`", record.name.value))
            .help(remedy)
            .help(defect.clone())
    };
    declared_units(handle.descriptor()).into_iter().map(told).collect()
}

/// The units in the text of a parameter, `"m/s, m -> N"`; none of what has no dimension.
fn parts(spec: &ParamSpec) -> Vec<&str> {
    match spec.kind {
        ParamKind::Number | ParamKind::Vector | ParamKind::List => vec![spec.unit.as_str()],
        ParamKind::Curve | ParamKind::Function => spec.unit.split("->").collect(),
        ParamKind::Surface => spec.unit.split("->").flat_map(|part| part.split(',')).collect(),
        ParamKind::Integer | ParamKind::Boolean | ParamKind::Text => Vec::new(),
    }
}

fn wrong(unit: &str, what: &str, given: bool) -> Option<DeclaredUnit> {
    let unit = unit.trim();
    if unit.is_empty() {
        return None;
    }
    match parse_unit(unit) {
        Ok((_, factor)) if (factor - 1.0).abs() < 1e-12 => None,
        Ok((dimension, _)) => {
            let si = UnitSystem::default().label_as(dimension, unit);
            let (way, written) = match given {
                true => ("reach elements", format!("; scenes may still write `\"5 {unit}\"`")),
                false => ("of elements are", String::new()),
            };
            Some(DeclaredUnit {
                message: format!("its {what} is declared in `{unit}`, but numbers {way} in SI"),
                remedy: format!("declare `{si}` and compute in it{written}"),
            })
        }
        Err(error) => {
            let remedy = error.help.unwrap_or_else(|| "declare an SI unit, or none".into());
            Some(DeclaredUnit {
                message: format!("its {what} is declared in `{unit}`, which can't be read: {}", error.message),
                remedy,
            })
        }
    }
}
