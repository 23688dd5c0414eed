//! [`Parameter`]: a number of a scene that `--set` can set, with its value and unit.

use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::scene::{Dimension, Document, Override, RawKind, RawValue, parse_unit};
use crate::session::Session;

/// A number of a scene: a parameter, a key of a body or element, an entry of a list.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// As for `--set`.
    pub key: String,
    /// Its value, in its unit.
    pub value: f64,
    /// Its unit. Empty for a pure number, and where a plain number stands in `[parameters]`, which takes the scene's unit of where it is
    /// used.
    pub unit: String,
    /// One unit in SI; 1 where the unit is not known.
    factor: f64,
    dimension: Option<Dimension>,
    /// Whether the scene gives a plain number, in the scene's unit.
    plain: bool,
}

impl Parameter {
    /// The number that a session has at a key. `document` and `changes` are what the session was made of.
    ///
    /// # Errors
    /// The scene has no such key, gives nothing there, or no number.
    pub fn read(
        key: &str,
        document: &Document,
        changes: &[Override],
        session: &Session,
    ) -> Result<Self, Box<Diagnostic>> {
        let key = key.trim();
        let refused = |message: String| Diagnostic::error(codes::BAD_OVERRIDE, message);
        let placeless = |error: Box<Diagnostic>| {
            let again = Diagnostic::error(error.code, error.message.clone());
            Box::new(error.help.iter().fold(again, |again, help| again.help(help.clone())))
        };
        // What can be named instead, before advice that is not about numbers.
        let advised = |diagnostic: Diagnostic| {
            let advice = instead(key, document, changes, session);
            Box::new(Diagnostic { help: advice.map_or(diagnostic.help, |advice| vec![advice]), ..diagnostic })
        };
        let found = document.setting(key, changes).map_err(|error| advised(*placeless(error)))?;
        let Some(raw) = found else {
            let message = format!("the scene gives no value for `{key}`, so that there is none to start from");
            let help = format!("write it in the scene, or add `--set {key}=VALUE`");
            return Err(Box::new(refused(message).help_if(instead(key, document, changes, session)).help(help)));
        };
        let plain = match raw.kind {
            RawKind::Number(value) => Some(value),
            RawKind::Integer(value) => Some(value as f64),
            _ => None,
        };
        if let Some(value) = plain {
            let (dimension, declared) = dimension_of(key, session).unzip();
            let units = &session.scene.units;
            let factor = dimension.map_or(1.0, |dimension| units.factor(dimension));
            let declared = declared.flatten().unwrap_or_default();
            let unit =
                dimension.filter(|one| *one != Dimension::DIMENSIONLESS).map(|one| units.label_as(one, declared));
            return Ok(Self { key: key.into(), value, unit: unit.unwrap_or_default(), factor, dimension, plain: true });
        }
        let (si, dimension) = session.scene.any_quantity(&raw).map_err(|error| {
            // A word is no expression with a parameter of that name.
            let reason = match raw.as_text().filter(|_| error.code == codes::UNKNOWN_PARAMETER) {
                Some(text) => format!("it is the text \"{text}\""),
                None => error.message,
            };
            advised(refused(format!("`{key}` is no number: {reason}")))
        })?;
        if dimension == Dimension::DIMENSIONLESS {
            let (unit, dimension) = (String::new(), Some(dimension));
            return Ok(Self { key: key.into(), value: si, unit, factor: 1.0, dimension, plain: true });
        }
        let units = &session.scene.units;
        let written = raw.as_text().unwrap_or_default();
        let (unit, factor) = (units.label_as(dimension, written), units.factor(dimension));
        Ok(Self { key: key.into(), value: si / factor, unit, factor, dimension: Some(dimension), plain: false })
    }

    /// The change that gives it a value, in its unit.
    #[must_use]
    pub fn set(&self, value: f64) -> Override {
        let unit = if self.plain || self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        Override::new(format!("{}={value:?}{unit}", self.key))
    }

    /// A value for it that is written with a unit of its own, or without one, in its unit.
    ///
    /// # Errors
    /// It is no number, or has another dimension.
    pub fn value_of(&self, text: &str, session: &Session) -> Result<f64, Box<Diagnostic>> {
        let text = text.trim();
        if let Ok(value) = text.parse::<f64>()
            && value.is_finite()
        {
            return Ok(value);
        }
        let refused = |message: String| Box::new(Diagnostic::error(codes::BAD_OVERRIDE, message));
        let raw = RawValue { span: 0..0, kind: RawKind::Text(text.into()) };
        let found = session.scene.any_quantity(&raw);
        let (si, dimension) =
            found.map_err(|error| refused(format!("`{text}` is no value for `{}`: {}", self.key, error.message)))?;
        if self.dimension != Some(dimension) {
            let own = if self.unit.is_empty() { "a plain number".to_owned() } else { format!("in {}", self.unit) };
            return Err(refused(format!("`{text}` is no value for `{}`, which is {own}", self.key)));
        }
        Ok(si / self.factor)
    }

    /// What the derivative of something in `unit` is measured in.
    #[must_use]
    pub fn unit_of_derivative(&self, unit: &str) -> String {
        let grouped = |unit: &str| if unit.contains([' ', '/', '*']) { format!("({unit})") } else { unit.to_owned() };
        match (unit, self.unit.as_str()) {
            (unit, "") => unit.to_owned(),
            ("", own) => format!("1/{}", grouped(own)),
            (unit, own) if unit == own => "1".to_owned(),
            (unit, own) => format!("{}/{}", grouped(unit), grouped(own)),
        }
    }

    /// Its value with its unit.
    #[must_use]
    pub fn shown(&self, value: f64, digits: usize) -> String {
        let number = odyn_run::results::significant(value, digits);
        if self.unit.is_empty() { number } else { format!("{number} {}", self.unit) }
    }
}

/// Dimension of a plain number at a key, where it is known.
fn dimension_of<'a>(key: &str, session: &'a Session) -> Option<(Dimension, Option<&'a str>)> {
    let of_scene = |dimension| Some((dimension, None));
    let path: Vec<&str> = key.split('.').collect();
    if path[0] == "simulation" {
        return match *path.get(1)? {
            "gravity" => of_scene(Dimension::ACCELERATION),
            "t_start" | "t_end" | "output_step" | "max_step" | "fixed_step" | "first_step" => of_scene(Dimension::TIME),
            _ => None,
        };
    }
    if session.scene.parameters.get(key.strip_prefix("parameters.").unwrap_or(key)).is_some() {
        return None;
    }
    let path = if ["body", "joint", "force", "control"].contains(&path[0]) { &path[1..] } else { &path[..] };
    let (name, rest) = path.split_first()?;
    let word = *rest.first()?;
    if session.scene.bodies.iter().any(|body| body.name.value == *name) {
        return match word {
            "mass" => of_scene(Dimension::MASS),
            "inertia" => of_scene(Dimension::INERTIA),
            "position" | "com" => of_scene(Dimension::LENGTH),
            "velocity" => of_scene(Dimension::VELOCITY),
            "angular_velocity" => of_scene(Dimension::ANGULAR_VELOCITY),
            "orientation" if rest.last() == Some(&"angle") => of_scene(Dimension::ANGLE),
            _ => None,
        };
    }
    let element = session.model.elements.iter().find(|element| element.name == *name)?;
    match (word, rest.get(1)) {
        ("point", _) => of_scene(Dimension::LENGTH),
        ("params", Some(parameter)) if rest.len() == 2 => {
            let spec = element.class.params.iter().find(|spec| spec.name == **parameter)?;
            let (dimension, _) = parse_unit(&spec.unit).ok().filter(|_| !spec.unit.is_empty())?;
            Some((dimension, Some(spec.unit.as_str())))
        }
        _ => None,
    }
}

/// Keys that are listed where none is near.
const LISTED: usize = 8;

/// What may be meant by a key that has no number: the numbers inside of it, the nearest one, those of the same owner, or some.
fn instead(key: &str, document: &Document, changes: &[Override], session: &Session) -> Option<String> {
    let is_number = |(key, raw): &(String, RawValue)| match &raw.kind {
        RawKind::Number(_) | RawKind::Integer(_) => true,
        // `parameters.a = "2 * b"` is one, the name of a body as that of a parameter is not meant.
        RawKind::Text(_) => !key.ends_with(".name") && session.scene.any_quantity(raw).is_ok(),
        _ => false,
    };
    let numbers: Vec<String> = document.settings(changes).into_iter().filter(is_number).map(|(key, _)| key).collect();
    let listed = |found: &[&String]| {
        let shown: Vec<String> = found.iter().take(LISTED).map(|key| format!("`{key}`")).collect();
        format!("{}{}", shown.join(", "), if found.len() > LISTED { ", ..." } else { "" })
    };
    let within =
        |prefix: &str| -> Vec<&String> { numbers.iter().filter(|number| number.starts_with(prefix)).collect() };
    let inside = within(&format!("{key}."));
    if !inside.is_empty() {
        return Some(format!("numbers in it are {}", listed(&inside)));
    }
    if let Some(nearest) = suggest(key, numbers.iter().map(String::as_str)) {
        return Some(format!("did you mean `{nearest}`?"));
    }
    let owner = key.split('.').next().unwrap_or_default();
    let (own, all) = (within(&format!("{owner}.")), within(""));
    match (own.is_empty(), all.is_empty()) {
        (false, _) => Some(format!("numbers of `{owner}` are {}", listed(&own))),
        (true, false) => Some(format!("numbers of the scene are {}", listed(&all))),
        (true, true) => None,
    }
}
