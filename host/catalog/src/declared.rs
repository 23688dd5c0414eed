//! What a library declares of its parameters, looked at where no compiler did: names that a scene can write, each once, and values that
//! the element's own range and choices allow.

use element_api::params::{ParamKind, ParamSpec, ParamType};
use element_api::{Curve, Function, Surface};

/// The key of a scene that picks a row of a catalogue.
const USE: &str = "use";

/// The parameters of an element.
///
/// # Errors
/// In words, which name the parameter.
pub fn check_parameters(params: &[ParamSpec]) -> Result<(), String> {
    for (k, param) in params.iter().enumerate() {
        let name = param.name.escape_debug();
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if !param.name.starts_with(|c: char| c.is_ascii_alphabetic()) || !param.name.chars().all(good) {
            let rule = "letters, digits, `_` and `-`, beginning with a letter";
            return Err(format!("`{name}` can't be the name of a parameter: {rule}"));
        }
        if param.name == USE {
            return Err(format!("`{USE}` can't be the name of a parameter: it picks a row of a catalogue"));
        }
        if params[..k].iter().any(|other| other.name == param.name) {
            return Err(format!("has two parameters called `{name}`"));
        }
        let given = [("default", &param.default), ("example", &param.example)];
        for (what, value) in given.into_iter().filter_map(|(what, value)| Some((what, value.as_ref()?))) {
            check_value(param, value).map_err(|rule| format!("the {what} {value} of the parameter `{name}` {rule}"))?;
        }
    }
    Ok(())
}

/// What a value must be; numbers that an expression gives are not known.
fn check_value(param: &ParamSpec, value: &toml::Value) -> Result<(), String> {
    let numbers = match param.kind {
        ParamKind::Number => f64::read_value(value).map(|number| vec![number]),
        ParamKind::Integer => i64::read_value(value).map(|number| vec![number as f64]),
        ParamKind::Boolean => bool::read_value(value).map(|_| Vec::new()),
        ParamKind::Vector => <[f64; 3]>::read_value(value).map(Vec::from),
        ParamKind::List => Vec::<f64>::read_value(value),
        ParamKind::Curve => Curve::read_value(value).map(|curve| curve.points.iter().map(|point| point[1]).collect()),
        ParamKind::Function => Function::read_value(value).map(|_| f64::read_value(value).into_iter().collect()),
        ParamKind::Surface => Surface::read_value(value).map(|_| Vec::new()),
        ParamKind::Text => match value.as_str() {
            Some(text) if !param.choices.is_empty() && !param.choices.iter().any(|choice| choice == text) => {
                return Err(format!("must be one of {}", param.choices.join(", ")));
            }
            text => text.map(|_| Vec::new()),
        },
    };
    let numbers = numbers.ok_or_else(|| format!("must be a {}", param.kind.text()))?;
    match numbers.iter().all(|number| param.contains(*number)) {
        true => Ok(()),
        false => Err(format!("must be {}", param.range_text())),
    }
}
