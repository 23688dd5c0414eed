//! What `odyn plan` says of islands that share nothing.

use serde::Serialize;

use super::error::SessionError;
use super::opened::Session;
use super::savings::{plural, some};

/// Islands that are named.
const SHOWN: usize = 12;

/// What islands cost, each by itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Apart {
    /// Whether they run apart.
    pub chosen: bool,
    /// Operations per evaluation of all of them together.
    pub together: usize,
    /// Bodies that follow the time, of which several islands have copies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shared: Vec<String>,
    /// Each by itself.
    pub islands: Vec<OwnSteps>,
}

/// What an island costs by itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OwnSteps {
    /// Its first body.
    pub name: String,
    /// The coordinates of its equations of motion: `cartesian` or `joint`.
    pub formulation: String,
    /// Velocities.
    pub velocities: usize,
    /// Operations per evaluation of its right side.
    pub operations_per_evaluation: usize,
    /// Its motion is found at each time, not integrated.
    pub determined: bool,
}

impl Session {
    /// What islands cost, each by itself; `together`: operations per evaluation of all of them. Nothing for a single one.
    ///
    /// # Errors
    /// Where an island cannot be a scene of its own.
    pub(super) fn apart_report(&self, together: usize) -> Result<Option<Apart>, SessionError> {
        if self.plan.topology.islands.len() < 2 {
            return Ok(None);
        }
        let sessions = self.islands()?;
        let islands = self.plan.topology.islands.iter().zip(&sessions).map(|(island, own)| {
            let solving = own.solving();
            OwnSteps {
                name: self.name_of(island).to_string(),
                formulation: solving.formulation,
                velocities: solving.velocities,
                operations_per_evaluation: solving.counts.operations,
                determined: own.determined,
            }
        });
        let shared = self.model.bodies.iter().zip(&self.plan.topology.copies).filter(|(_, copies)| **copies > 1);
        let shared = shared.map(|(body, _)| body.name.clone()).collect();
        Ok(Some(Apart { chosen: self.runs_apart(), together, shared, islands: islands.collect() }))
    }
}

impl std::fmt::Display for Apart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shared: Vec<&str> = self.shared.iter().map(String::as_str).collect();
        let nothing = match shared.is_empty() {
            true => "nothing".to_string(),
            false => format!("nothing but what follows the time ({})", some(&shared)),
        };
        let each = match self.chosen {
            true => "and each takes steps of its own (--islands together: common steps)",
            false => "each could take steps of its own (--islands apart)",
        };
        writeln!(f, "the islands share {nothing}{} {each}:", if self.chosen { "," } else { ";" })?;
        for island in self.islands.iter().take(SHOWN) {
            let velocities = plural(island.velocities, "velocity", "velocities");
            let found = if island.determined { ", found instead of integrated" } else { "" };
            writeln!(
                f,
                "    {}: {} coordinates, {velocities}, {} operations per evaluation{found}",
                island.name, island.formulation, island.operations_per_evaluation
            )?;
        }
        if self.islands.len() > SHOWN {
            writeln!(f, "    and {} more", self.islands.len() - SHOWN)?;
        }
        let then = if self.chosen { "would be" } else { "are" };
        writeln!(
            f,
            "    together, at the steps of the one that needs most, {then} {} of all; what follows is for that",
            self.together
        )
    }
}
