//! The actuators of a prescribed motion: which there are, and the units of their efforts.

use crate::diagnostics::suggest;
use crate::driven::cannot;
use crate::prescribed::{Motion, Wanted, quantity};
use crate::scene::Dimension;
use crate::session::{Session, SessionError};

/// The efforts along a quantity: their unit and its size.
pub(super) fn effort_unit(session: &Session, wanted: &Wanted) -> (String, f64, Dimension) {
    let units = &session.scene.units;
    if wanted.dimension == Dimension::ANGLE {
        return (units.torque_label(), units.factor(Dimension::TORQUE), Dimension::TORQUE);
    }
    let dimension = Dimension::ENERGY.over(wanted.dimension).unwrap_or(Dimension::ENERGY);
    (units.label(dimension), units.factor(dimension), dimension)
}

/// The actuators by name, or those that the scene suggests; then the quantities along which efforts act.
pub(super) fn choose(
    session: &Session,
    motion: &Motion,
    by: Option<&[String]>,
    notes: &mut Vec<String>,
) -> Result<(Vec<Option<usize>>, Vec<Wanted>), SessionError> {
    let inputs = &session.model.inputs;
    let Some(names) = by else {
        if inputs.is_empty() {
            let names: Vec<&str> = motion.wanted.iter().map(|one| one.name.as_str()).collect();
            notes.push(format!(
                "the scene has no [[input]]: each effort acts along its prescribed quantity ({})",
                names.join(", ")
            ));
            return Ok((vec![None; motion.wanted.len()], motion.wanted.clone()));
        }
        return Ok(((0..inputs.len()).map(Some).collect(), Vec::new()));
    };
    let (mut chosen, mut along) = (Vec::new(), Vec::new());
    for (k, name) in names.iter().enumerate() {
        if names[..k].contains(name) {
            return Err(cannot(session, format!("the actuator `{name}` is named twice"), "name each once"));
        }
        if let Some(input) = inputs.iter().position(|input| input.name == *name) {
            chosen.push(Some(input));
            continue;
        }
        let Ok(wanted) = quantity(session, name) else {
            let known: Vec<&str> = inputs.iter().map(|input| input.name.as_str()).collect();
            let nearest = suggest(name, known.iter().copied()).map(|one| format!("did you mean `{one}`? "));
            let help = format!(
                "{}name an [[input]], or a coordinate or position along which an effort acts",
                nearest.unwrap_or_default()
            );
            return Err(cannot(session, format!("there is no actuator `{name}`"), &help));
        };
        chosen.push(None);
        along.push(wanted);
    }
    Ok((chosen, along))
}
