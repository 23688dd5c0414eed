//! Tests of the contract, one file per promise.

mod allocations;
mod batches;
mod broken;
mod documentation;
mod expressions;
mod forgotten;
mod functions;
mod interpolations;
mod joints;
mod kinetic;
mod more_frames;
mod parameters;
mod recordings;
mod refusals;
mod rotations;
pub(crate) mod signals;
mod strands;
mod surfaces;
mod tables;
mod unilateral;
mod unknowns;
mod vocabulary;

use crate::prelude::*;

/// A joint that uses everything a joint may: time, an angle, optional rows, coordinates, a mobility.
pub(crate) struct Screw {
    pitch: f64,
    speed: f64,
    held: bool,
}

#[derive(Parameters)]
pub(crate) struct ScrewParameters {
    /// Advance per angle.
    #[param(unit = "m/rad")]
    pitch: f64,
    /// Additional advance per time.
    #[param(unit = "m/s", default = 0.0)]
    speed: f64,
    /// Whether the axes are held parallel.
    #[param(default = true)]
    held: bool,
}

impl Element for Screw {
    const NAME: &'static str = "screw";
    const SUMMARY: &'static str = "advances along z as it turns";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "nut"), FrameSpec::new("j", "bolt")];
    const ANGLES: usize = 1;
    type Parameters = ScrewParameters;
    fn new(p: ScrewParameters) -> Result<Self, ParamError> {
        Ok(Self { pitch: p.pitch, speed: p.speed, held: p.held })
    }
}

impl Constraint for Screw {
    const ROWS: &'static [&'static str] = &["x", "y", "advance", "about y", "about x"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("angle", "rad", "of the bolt")];
    const MOBILITY: Option<usize> = Some(1);
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        blocks::on_z_axis(i, j, rows);
        let advance = i.z().dot(&(j.position - i.position));
        rows.push(advance - at.angle_about_z(0, 0, 1) * self.pitch - at.time * self.speed);
        if self.held {
            blocks::parallel_z(i, j, rows);
        }
    }
    fn uses_row(&self, row: usize) -> bool {
        self.held || row < 3
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(q[0], q[0] * self.pitch)
    }
}

/// A force that uses everything a force may: states, memory, a table, a switch, channels, energies.
pub(crate) struct Bellows {
    curve: Table,
    latches: usize,
    relaxation: f64,
}

#[derive(Parameters)]
pub(crate) struct BellowsParameters {
    /// Force over length.
    #[param(unit = "m -> N")]
    curve: Vec<[f64; 2]>,
    /// Time constant of the pressure.
    #[param(unit = "s", above = 0.0, default = 0.5)]
    relaxation: f64,
    /// Number of latches.
    #[param(min = 0.0, max = 3.0, default = 1)]
    latches: i64,
}

impl Element for Bellows {
    const NAME: &'static str = "bellows";
    const SUMMARY: &'static str = "pushes two points apart";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "one end"), FrameSpec::new("j", "other end")];
    type Parameters = BellowsParameters;
    fn new(p: BellowsParameters) -> Result<Self, ParamError> {
        let curve = Table::clamped(&p.curve).map_err(|e| ParamError::new("curve", e.message))?;
        let latches = usize::try_from(p.latches).map_err(|_| ParamError::new("latches", "must not be negative"))?;
        Ok(Self { curve, latches, relaxation: p.relaxation })
    }
}

impl Bellows {
    fn push<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        length(at.frames()[1].position - at.frames()[0].position).lookup(&self.curve)
    }
}

impl Force for Bellows {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("push", "N", "force on j away from i")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("pressure", "N", "lagging force")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let open = S::select(length(d), S::from(0.7), at.states[0], S::zero());
        out.force_pair(0, 1, d / length(d) * (length(d).lookup(&self.curve) + open));
        out.torque_pair(0, 1, at.frames()[0].z() * at.spin_about_z(0, 1));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(self.push(at));
    }
    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(at.spin_about_z(0, 1).powi(2))
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![0.25]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((self.push(at) - at.states[0]) / self.relaxation);
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![1.0; self.latches]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory.iter().for_each(|m| out.push(*m * at.time()));
    }
}

/// Parameters of a [`Bellows`].
pub(crate) const BELLOWS: &str = "curve = [[0.0, 3.0], [0.5, 2.5], [1.0, 1.0], [2.0, 0.5]]";
