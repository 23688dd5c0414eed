//! What cannot be exported, each with its name, the reason and the remedy.

use crate::choices::Choices;
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::model::Instance;
use crate::session::Session;

/// The first of all reasons why a scene cannot be exported that is known before its equations are written in coordinates of joints.
pub(crate) fn before(session: &Session) -> Option<Diagnostic> {
    let Session { model, equations, plan, .. } = session;
    let layout = &plan.layout;
    for element in &model.elements {
        if let Some((what, help)) = of_element(session, element) {
            return Some(refusal(session, element, &what, help));
        }
    }
    let of_row = |row: usize| &model.elements[layout.element_of_row(row).0];
    if let Some(contact) = equations.contacts.first() {
        let what = "has a row that only pushes: where a contact closes, velocities jump";
        return Some(refusal(session, of_row(contact.row), what, "a force that grows with the depth has no impacts"));
    }
    if let Some(friction) = equations.frictions.first() {
        let what = "has a row that holds up to a limit: whether it sticks or slides is found between steps";
        let help = "friction as a smooth function of the velocity can be exported";
        return Some(refusal(session, of_row(friction.rows[0]), what, help));
    }
    let joints = equations.releases.iter().map(|one| one.element);
    let forces = equations.latches.iter().filter(|latch| latch.releases).map(|latch| latch.element);
    if let Some(element) = joints.chain(forces).next() {
        let what = "may be released: other equations of motion hold from then on";
        let help = "export the mechanism before the release (`release` left out) or after it (the element disabled)";
        return Some(refusal(session, &model.elements[element], what, help));
    }
    if session.starts_singular() {
        let message = "the scene starts in a singular position, or next to one";
        let help = "steps of a fixed size need rows that are independent: start the scene at another place";
        return Some(Diagnostic::error(codes::CANNOT_EXPORT, message).help(help));
    }
    None
}

/// A tolerance without an estimate of the error.
pub(crate) fn tolerance(choices: &Choices) -> Option<Diagnostic> {
    let tolerance = choices.tolerance?;
    if choices.method.error.is_empty() {
        let message =
            format!("{} has no estimate of its error that a tolerance could be held against", choices.method.name);
        let help = "steps of variable size are those of dopri5; leave the tolerance out for steps of a fixed size";
        return Some(Diagnostic::error(codes::NO_VARIABLE_STEPS, message).help(help));
    }
    let is_one = (1e-13..=0.1).contains(&tolerance);
    let message = format!("a tolerance of {tolerance:?} cannot be met");
    (!is_one).then(|| Diagnostic::error(codes::NO_VARIABLE_STEPS, message).help("choose one from 1e-13 to 0.1"))
}

fn of_element(session: &Session, element: &Instance) -> Option<(String, &'static str)> {
    let opaque = session.equations.graph.calls.iter();
    if opaque.clone().any(|call| call.set == element.set && call.instance == element.index) {
        let what = "is opaque: the library computes its equations, so that there are none to write down";
        return Some((what.into(), "record its equations (see the book on writing elements), or replace it"));
    }
    if session.model.sets[element.set].communicates() {
        let what = "is an FMU, which computes by itself";
        return Some((what.into(), "leave it out, and give its outputs from outside as `[[input]]`s"));
    }
    if !element.recording.initial_discrete.is_empty() && element.recording.sample_period().is_none() {
        let what = "has a memory that changes at instants or after every step, so that what it does depends on how steps are chosen";
        return Some((what.into(), "give it a sampling period, or leave it out and give its output as an `[[input]]`"));
    }
    if element.recording.unknowns() > 0 {
        let what = "has internal unknowns, which are found by iterations whose number is not fixed";
        return Some((what.into(), "an element with explicit equations can be exported"));
    }
    None
}

/// Why the equations of a session without a form in coordinates of joints cannot be had.
pub(crate) fn no_joint_form(session: &Session) -> Diagnostic {
    let (message, help) = if session.equations.needs_solution() {
        (
            "forces depend on accelerations or reactions, and are found together with them by iterations",
            "friction from reactions, loads from accelerations and flexible bodies cannot be exported; `odyn plan` names them",
        )
    } else {
        (
            "the equations cannot be written in the coordinates of joints",
            "`odyn check --formulation joint` says why: a particle that something may turn, or forces that depend on Euler parameters",
        )
    };
    Diagnostic::error(codes::CANNOT_EXPORT, message).help(help)
}

/// A quantity that the coordinates of joints do not tell.
pub(crate) fn no_output(session: &Session, name: &str, what: &str) -> Diagnostic {
    let message = format!("{what} `{name}` cannot be written in the coordinates of joints");
    let diagnostic = Diagnostic::error(codes::CANNOT_EXPORT, message);
    let record = session.scene.outputs.iter().find(|record| record.name.value == name);
    let help = "Euler parameters of bodies, for example, cannot be had there; choose others by --outputs";
    match record {
        Some(record) => diagnostic.at(record.name.span.clone(), "asked for here").help(help),
        None => diagnostic.help(help),
    }
}

/// A name that was chosen and is not there.
pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Diagnostic {
    let known: Vec<&str> = known.collect();
    let nearest = suggest(name, known.iter().copied()).map(|nearest| format!("did you mean `{nearest}`?"));
    let list =
        if known.is_empty() { format!("the scene has no {what}s") } else { format!("known are {}", known.join(", ")) };
    Diagnostic::error(codes::UNKNOWN_WORD, format!("the scene has no {what} `{name}`")).help_if(nearest).help(list)
}

fn refusal(session: &Session, element: &Instance, what: &str, help: &str) -> Diagnostic {
    let message = format!("`{}` cannot be exported: `{}` {what}", element.name, element.class.name);
    let record = session.scene.elements.iter().find(|record| record.name.value == element.name);
    let diagnostic = Diagnostic::error(codes::CANNOT_EXPORT, message);
    match record {
        Some(record) => diagnostic.at(record.name.span.clone(), "this element").help(help),
        None => diagnostic.help(help),
    }
}
