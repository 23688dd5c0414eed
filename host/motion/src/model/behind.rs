//! What the results of a recording are made of.

use element_api::Recording;
use element_api::recording::{Input, Op, Role};

use super::types::Instance;

/// The operations that these are made of, and they themselves, ascending. What takes an internal unknown depends on all conditions, which
/// the unknowns are found from together.
#[must_use]
pub fn operations_behind(recording: &Recording, wanted: impl IntoIterator<Item = u32>) -> Vec<(u32, Op)> {
    let mut found: Vec<Option<Op>> = vec![None; recording.ops.len()];
    let mut open: Vec<u32> = wanted.into_iter().collect();
    while let Some(k) = open.pop() {
        let k = k as usize;
        if found.get(k) != Some(&None) {
            continue;
        }
        found[k] = Op::decode(recording.ops[k]);
        match found[k] {
            Some(Op::Input(Input::Unknown(_))) => open.extend(conditions(recording)),
            Some(op) => open.extend(op.operands()),
            None => {}
        }
    }
    found.into_iter().enumerate().filter_map(|(k, op)| Some((k as u32, op?))).collect()
}

/// The operations that are the conditions on internal unknowns.
pub fn conditions(recording: &Recording) -> impl Iterator<Item = u32> {
    let is_condition = |role: Role| matches!(role, Role::Condition(_));
    recording.outputs.iter().filter(move |output| is_condition(output.role)).map(|output| output.node)
}

/// The operations that are the rows of a joint, on positions and on velocities.
pub fn rows(recording: &Recording) -> impl Iterator<Item = u32> {
    let is_row = |role: Role| matches!(role, Role::Residual(_) | Role::VelocityResidual(_));
    recording.outputs.iter().filter(move |output| is_row(output.role)).map(|output| output.node)
}

impl Instance {
    /// The inputs that a result depends on, the last one first; `None`: not known.
    #[must_use]
    pub fn inputs_of(&self, role: Role) -> Option<Vec<Input>> {
        let input = |(_, op)| if let Op::Input(input) = op { Some(input) } else { None };
        let behind = || operations_behind(&self.recording, self.recording.output(role)).into_iter().rev();
        (!self.class.opaque).then(|| behind().filter_map(input).collect())
    }

    /// Whether anything that happens depends on where one of its frames is on the ground: not on where a force that has but directions from
    /// there has its reaction, nor on what is only reported.
    #[must_use]
    pub fn depends_on_place(&self, frame: usize) -> bool {
        let acts = |role: Role| match role {
            Role::Force(k) | Role::Torque(k) => self.markers[k as usize / 3].body.is_some(),
            Role::Angle(_) | Role::Coordinate(_) | Role::Channel(_) | Role::Signal(_) => false,
            _ => true,
        };
        let is_place =
            |(_, op): &(u32, Op)| matches!(op, Op::Input(Input::Position { frame: of, .. }) if *of as usize == frame);
        let wanted = self.recording.outputs.iter().filter(|output| acts(output.role)).map(|output| output.node);
        self.class.opaque || operations_behind(&self.recording, wanted).iter().any(is_place)
    }

    /// The signals that a result depends on, ascending.
    pub(super) fn signals_of(&self, role: Role) -> Vec<usize> {
        let Some(inputs) = self.inputs_of(role) else { return (0..self.class.inputs.len()).collect() };
        let signal = |input| if let Input::Signal(signal) = input { Some(signal as usize) } else { None };
        let mut signals: Vec<usize> = inputs.into_iter().filter_map(signal).collect();
        signals.sort_unstable();
        signals.dedup();
        signals
    }
}
