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
         most {:?} s: a communication step is divided into equal ones. Each takes {} operations (at most {} where equations switch in it) \
         and brings the state to the constraints. In model exchange an event does so where the constraints are off by 1e-9 of the \
         system's size.</p>\n\
         <p>States may be set before the initialisation ends; they are brought to the constraints then. The parameters of the scene are \
         numbers in the equations: they are fixed.</p>\n",
        env!("CARGO_PKG_VERSION"),
        machine.method.name,
        machine.method.order,
        machine.step,
        cost.step,
        cost.most,
    );
    for (what, ports) in [("Inputs", &machine.inputs), ("Outputs", &machine.outputs)] {
        table(&mut text, what, ports);
    }
    text.push_str("</body>\n</html>\n");
    text
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
