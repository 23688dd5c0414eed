//! A position controller that stands for a program written elsewhere, which knows numbers only and keeps a memory.
//!
//! After each step it receives position and speed, and answers with a force that is held during the next step. At steps of
//! size h its law brings a mass m to rest at the origin in two steps: F = -m (x / h^2 + 3 v / (2 h)).

use element_api::prelude::*;

/// The force.
pub struct Deadbeat {
    mass: f64,
    step: f64,
    /// What the program answered last, N.
    force: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct DeadbeatParameters {
    /// The mass that it moves.
    #[param(unit = "kg", above = 0.0)]
    mass: f64,
    /// Time between two answers: the `fixed_step` of the scene.
    #[param(unit = "s", above = 0.0)]
    step: f64,
}

/// The program written elsewhere.
fn program(mass: f64, step: f64, position: f64, speed: f64) -> f64 {
    -mass * (position / (step * step) + 1.5 * speed / step)
}

impl Element for Deadbeat {
    const NAME: &'static str = "deadbeat";
    const SUMMARY: &'static str = "brings a mass to rest in two steps";
    const DOC: &'static str = doc_of(include_str!("deadbeat.rs"));
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("base", "its z axis is the direction"), FrameSpec::new("slide", "its origin is moved")];
    // Its equations cannot be recorded: they depend on something outside.
    const OPAQUE: bool = true;
    type Parameters = DeadbeatParameters;

    fn new(p: DeadbeatParameters) -> Result<Self, ParamError> {
        Ok(Self { mass: p.mass, step: p.step, force: 0.0 })
    }

    // The only place where memory changes: evaluations also happen for steps that are rejected later.
    fn accept(&mut self, at: &Motion<'_, f64>) {
        let position = blocks::displacement_along_z(&at.frames()[0], &at.frames()[1]);
        let speed = at.frames()[0].z().dot(&at.relative_velocity(0, 1));
        self.force = program(self.mass, self.step, position, speed);
    }

    fn save(&self) -> Vec<u8> {
        self.force.to_le_bytes().to_vec()
    }

    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        let bytes = memory.try_into().map_err(|_| format!("{} bytes, not 8", memory.len()))?;
        self.force = f64::from_le_bytes(bytes);
        Ok(())
    }
}

impl Force for Deadbeat {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, at.frames()[0].z() * S::from(self.force));
    }
}
