//! Tests of the room, one drawer per subject.

mod expressions;
mod files;
mod functions;
mod hostile;
mod inputs;
mod messages;
mod overrides;
mod records;
mod rotations;
mod schema;
mod shapes;
mod signals;
mod slips;
mod units;
mod verification;

use super::*;
use odyn_diagnostics::{Code, render, summary};

/// A simulation that is in order, for scenes about something else.
const SIMULATION: &str = "[simulation]\nt_end = 1\noutput_step = 0.1\n";

/// Reads a text that must be in order and without warnings.
fn accept(text: &str) -> Scene {
    accept_with(text, &[])
}

fn accept_with(text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<Override> = overrides.iter().map(|text| Override::new(*text)).collect();
    match parse(Source::new("test.toml", text), &overrides) {
        Ok((scene, mut warnings)) => {
            // Tests use parameters in expressions of their own.
            warnings.retain(|warning| warning.code != codes::UNUSED_PARAMETER);
            assert!(warnings.is_empty(), "{}", render(&warnings, &scene.source, false));
            scene
        }
        Err(rejected) => panic!("{}", render(&rejected.diagnostics, &rejected.source, false)),
    }
}

/// Reads a text that must be wrong.
fn reject(text: &str) -> Box<Rejected> {
    reject_with(text, &[])
}

fn reject_with(text: &str, overrides: &[&str]) -> Box<Rejected> {
    let overrides: Vec<Override> = overrides.iter().map(|text| Override::new(*text)).collect();
    match parse(Source::new("test.toml", text), &overrides) {
        Ok(_) => panic!("this scene is accepted:\n{text}"),
        Err(rejected) => rejected,
    }
}

impl Rejected {
    fn rendered(&self) -> String {
        render(&self.diagnostics, &self.source, false)
    }

    /// Codes in the order of the text.
    fn codes(&self) -> Vec<Code> {
        self.diagnostics.iter().map(|one| one.code).collect()
    }

    /// The piece of text that the only diagnostic points to.
    fn culprit(&self) -> &str {
        assert_eq!(self.diagnostics.len(), 1, "{}", self.rendered());
        let span = self.diagnostics[0].span().expect("a place");
        self.source.slice(span).expect("inside of the text")
    }
}

/// A scene with the parameter `x` and nothing to compute.
fn with_parameter(units: &str, value: &str) -> String {
    format!("[units]\n{units}\n[parameters]\nx = {value}\n{SIMULATION}")
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-14 * a.abs().max(b.abs())
}
