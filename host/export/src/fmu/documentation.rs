//! The page inside an FMU.

use std::fmt::Write as _;

use super::description::escaped;
use crate::c::Cost;
use crate::machine::{Machine, Port};

/// Writes the page.
pub(super) fn write(machine: &Machine, cost: &Cost) -> String {
    let title = escaped(&machine.title);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{title}</title></head>\n<body>\n<h1>{title}</h1>\n\
         <p>A multibody system in the coordinates of its joints, written by O-DYN {}. Co-simulation takes steps of {} (order {}) of at \
         most {:?} s: {} Each takes {} operations (at most {} where equations switch or elements sample in it) \
         and brings the state to the constraints. In model exchange an event does so where the constraints are off by 1e-9 of the \
         system's size.</p>\n\
         <p>States and parameters may be set before the initialisation ends; the state is brought to the constraints then. Parameters \
         that are tunable may be set later as well: between communication steps, and at events. Directional \
         derivatives are exact.</p>\n",
        env!("CARGO_PKG_VERSION"),
        machine.method.name,
        machine.method.order,
        machine.step,
        division(machine),
        cost.step,
        cost.most,
    );
    for (what, ports) in [("Inputs", &machine.inputs), ("Outputs", &machine.outputs)] {
        table(&mut text, what, ports);
    }
    parameters(&mut text, machine);
    text.push_str("</body>\n</html>\n");
    text
}

/// How a communication step is divided.
fn division(machine: &Machine) -> String {
    match machine.tolerance {
        Some(tolerance) => format!(
            "their sizes are chosen so that the estimated error of each is at most {tolerance:?} of the sizes of what moves, or the \
             tolerance that the environment gives."
        ),
        None => "a communication step is divided into equal ones.".into(),
    }
}

/// Those that can be set, with their ranges, and those that cannot, with the reasons.
fn parameters(text: &mut String, machine: &Machine) {
    let crate::Parameters { settable, fixed, .. } = &machine.parameters;
    if !settable.is_empty() {
        text.push_str(
            "<h2>Parameters</h2>\n<table>\n<tr><th>name</th><th>unit</th><th>start</th><th>range</th></tr>\n",
        );
        for one in settable {
            let ([name, unit], [low, high]) = ([&one.port.name, &one.port.unit].map(|text| escaped(text)), one.range);
            let start = one.port.start;
            let _ = writeln!(
                text,
                "<tr><td>parameters.{name}</td><td>{unit}</td><td>{start:?}</td><td>{low:?} to {high:?}</td></tr>"
            );
        }
        text.push_str("</table>\n");
    }
    if !fixed.is_empty() {
        text.push_str("<h2>Parameters of the scene that are fixed</h2>\n<table>\n<tr><th>name</th><th>why</th></tr>\n");
        for (name, reason) in fixed {
            let _ = writeln!(text, "<tr><td>{}</td><td>{}</td></tr>", escaped(name), escaped(reason));
        }
        text.push_str("</table>\n");
    }
}

fn table(text: &mut String, what: &str, ports: &[Port]) {
    let shown: Vec<&Port> = ports.iter().filter(|port| !port.is_fixed).collect();
    if shown.is_empty() {
        return;
    }
    let _ = write!(text, "<h2>{what}</h2>\n<table>\n<tr><th>name</th><th>unit</th><th>what</th></tr>\n");
    for port in shown {
        let [name, unit, about] = [&port.name, &port.unit, &port.about].map(|text| escaped(text));
        let _ = writeln!(text, "<tr><td>{name}</td><td>{unit}</td><td>{about}</td></tr>");
    }
    text.push_str("</table>\n");
}
