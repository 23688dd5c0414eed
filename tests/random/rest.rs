//! Equilibria of random mechanisms: what `statics` finds stays where it is in runs of either formulation, its linear model is what
//! differences of their accelerations say, and no growing one is called stable.

use std::collections::BTreeMap;
use std::fmt;

use odyn::analyses::linear::Linear;
use odyn::analyses::modes::Stability;
use odyn::analyses::statics::{Equilibrium, equilibrium};
use odyn::diagnostics::codes;
use odyn::session::Session;

use super::checks::{Checks, Verdict, below, largest};
use super::mechanism::{Mechanism, Place};
use crate::analyses::miss;

pub const SETTINGS: &str = "t_end = 0.2\noutput_step = 0.05";
const FORMULATIONS: [&str; 2] = ["joint", "cartesian"];

/// Share of the largest entry that derivatives of runs may differ by: they are differences.
const APART: f64 = 1e-4;
/// What accelerates at an equilibrium, on what accelerates at the start of the scene.
const STILL: f64 = 1e-7;
/// Share of the scene's size, and angle, by which a start at equilibrium may differ from it.
const SETTLED: f64 = 1e-10;
/// Share of the largest entry of A that a real part must exceed to be growth for certain.
const GROWS: f64 = 1e-5;

/// What was found.
#[derive(Default)]
pub struct Found {
    pub scenes: u64,
    pub at_rest: u64,
    pub compared: u64,
    pub stabilities: BTreeMap<String, u64>,
    /// Causes of refusals, names left out, with the first seeds.
    pub refused: BTreeMap<String, (u64, Vec<u64>)>,
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} scenes, {} at rest: {:?}", self.scenes, self.at_rest, self.stabilities)?;
        writeln!(f, "compared with differences: {}", self.compared)?;
        self.refused
            .iter()
            .try_for_each(|(cause, (count, seeds))| writeln!(f, "  {count} refused ({seeds:?}): {cause}"))
    }
}

impl Checks {
    /// A scene that starts at its equilibrium has its bodies where that was found.
    fn starts_at_rest(&self, text: &str, base: &Equilibrium) -> Verdict {
        let settled = match self.session(text, &["start=equilibrium"]) {
            Ok(settled) => settled,
            // The velocities that the scene gives may be none that its joints allow there.
            Err(error) if error.diagnostics[0].code == codes::INCONSISTENT_VELOCITIES => return Ok(()),
            Err(error) => return Err(format!("starts at rest: {error}")),
        };
        let found = base.restart(&settled);
        let length = settled.assembly.scales.length;
        let bodies = settled.plan.layout.bodies;
        let pairs = settled.assembly.working[..13 * bodies].iter().zip(&found.working).enumerate();
        let apart =
            pairs.filter(|(k, _)| k % 13 < 7).map(|(k, (a, b))| (a - b) / if k % 13 < 3 { length } else { 1.0 });
        below("starts away from its equilibrium", largest(apart), SETTLED)?;
        match settled.assembly.references == found.references && settled.assembly.discrete == found.discrete {
            true => Ok(()),
            false => Err("angles and memories at the start are not those of the equilibrium".into()),
        }
    }

    /// Looks for the equilibrium of a mechanism.
    pub fn rests(&self, mechanism: &Mechanism, seed: u64, found: &mut Found) -> Verdict {
        found.scenes += 1;
        let text = mechanism.text(&Place::as_it_is(), SETTINGS);
        let session = self.session(&text, &[]).map_err(|error| error.to_string())?;
        let base = match equilibrium(&session, &mut |_| ()) {
            Ok(base) => base,
            Err(error) => {
                let cause = &error.diagnostics[0];
                if error.exit_code() != 5 && error.exit_code() != 3 {
                    return Err(format!("exit code {}: {error}", error.exit_code()));
                }
                let words = cause.message.split('`').step_by(2).collect::<Vec<_>>().join("..");
                let words: String = words.chars().filter(|c| !c.is_ascii_digit()).collect();
                let (count, seeds) = found.refused.entry(words).or_default();
                *count += 1;
                if seeds.len() < 5 {
                    seeds.push(seed);
                }
                return Ok(());
            }
        };
        found.at_rest += 1;
        self.starts_at_rest(&text, &base)?;
        *found.stabilities.entry(format!("{:?}", base.stability)).or_default() += 1;
        let linear = Linear::at(&session, &base.instant, Some(&[]), Some(&[])).map_err(|error| error.to_string())?;
        if !linear.at_rest {
            return Err(format!("at rest, and not at rest: {:?}", linear.notes));
        }
        if session.plan.undetermined.iter().any(|open| open.load) {
            return Ok(());
        }
        let growth = if linear.a.is_empty() {
            f64::NEG_INFINITY
        } else {
            linear.a.complex_eigenvalues().iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max)
        };
        if growth > GROWS * linear.a.amax().max(1.0) && base.stability != Stability::Unstable {
            return Err(format!("grows by {growth:.2e} 1/s, and is called {:?}", base.stability));
        }
        for formulation in FORMULATIONS {
            let set = format!("formulation={formulation}");
            let open = || self.session(&text, &[&set]).unwrap_or_else(|error| panic!("{error}"));
            let Ok(begin) = accelerations(open(), None) else { continue };
            let peak = largest(begin.iter().copied()).max(1e-3);
            let rest = accelerations(open(), Some(&base)).map_err(|why| format!("{formulation}: {why}"))?;
            below(&format!("{formulation}: accelerates at rest"), largest(rest.iter().copied()), STILL * peak)?;
            if (&linear.velocities * &linear.a).amax() <= 1e-9 {
                continue;
            }
            found.compared += 1;
            // Where things bend within that, less is to be taken.
            let off =
                [1e-6, 1e-7].map(|step| miss(&open, &linear, &base, step)).into_iter().fold(f64::INFINITY, f64::min);
            below(&format!("{formulation}: differences of accelerations"), off, APART)?;
        }
        Ok(())
    }
}

/// Accelerations of all bodies where a run starts.
fn accelerations(mut session: Session, from: Option<&Equilibrium>) -> Result<Vec<f64>, String> {
    if let Some(base) = from {
        let restart = base.restart(&session);
        session.go_on_from(restart).map_err(|error| error.to_string())?;
    }
    let layout = session.plan.layout.clone();
    let mut run = session.prepare().and_then(|prepared| prepared.start()).map_err(|error| error.to_string())?;
    let instant = run.instant().map_err(|error| error.to_string())?;
    Ok(instant.inputs[layout.acceleration_slot()..][..layout.velocities()].to_vec())
}
