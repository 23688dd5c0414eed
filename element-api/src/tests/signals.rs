//! Signals and reactions: a force with a signal as its input, and by how much joints are loaded.

use crate::adapt;
use crate::descriptor::{Kind, Named, NamedInput};
use crate::prelude::*;
use crate::recording::{Input, Op, Role};
use crate::set::{Batch, Layout, Wanted};
use crate::testkit::{self, Probe, Random, Setting, complete};

/// A force with signals, two joints it listens to, and as many states as its parameter says.
pub(crate) struct Governor {
    orders: usize,
}

#[derive(Parameters)]
pub(crate) struct GovernorParameters {
    /// Number of lags in a row.
    #[param(min = 0.0, max = 5.0, default = 2)]
    orders: i64,
}

impl Element for Governor {
    const NAME: &'static str = "governor";
    const SUMMARY: &'static str = "pushes as told";
    const DOC: &'static str = doc_of(include_str!("signals.rs"));
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "one end"), FrameSpec::new("j", "other end")];
    type Parameters = GovernorParameters;
    fn new(p: GovernorParameters) -> Result<Self, ParamError> {
        let orders = usize::try_from(p.orders).map_err(|_| ParamError::new("orders", "must not be negative"))?;
        Ok(Self { orders })
    }
}

impl Force for Governor {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("told", "N", "by the signals"), ChannelSpec::new("felt", "N", "of the joints")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("first", "N", "the first lag")];
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::required("push", "N", "pushes"), InputSpec::optional("trim", "N", 0.5, "pushes too")];
    const JOINTS: &'static [FrameSpec] = &[FrameSpec::new("bearing", "loaded"), FrameSpec::new("pin", "loaded too")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let last = at.states.last().copied().unwrap_or(at.inputs[0]);
        out.force_pair(0, 1, at.frames()[0].z() * last);
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.inputs[0] + at.inputs[1] * 2.0);
        out.push(at.reactions[0].force.dot(&at.frames()[0].x()) + at.reactions[1].torque.dot(&at.frames()[1].y()));
    }
    fn initial_states(&self) -> Vec<f64> {
        (0..self.orders).map(|k| 0.5 + k as f64).collect()
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let mut before = at.inputs[0];
        for state in at.states {
            out.push(before - *state);
            before = *state;
        }
    }
}

/// A control element without frames, with memory, and as many states as its parameter says.
pub(crate) struct Shaper {
    orders: usize,
}

impl Element for Shaper {
    const NAME: &'static str = "shaper";
    const SUMMARY: &'static str = "shapes a signal";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = GovernorParameters;
    fn new(p: GovernorParameters) -> Result<Self, ParamError> {
        Governor::new(p).map(|governor| Self { orders: governor.orders })
    }
}

impl Control for Shaper {
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::required("value", "", "what is shaped"), InputSpec::optional("scale", "1", 3.0, "its factor")];
    const OUTPUTS: &'static [ChannelSpec] =
        &[ChannelSpec::new("shaped", "", "the lagging value"), ChannelSpec::new("largest", "", "so far, at steps")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("first", "", "the first lag")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states.last().copied().unwrap_or(at.inputs[0]) * at.inputs[1]);
        out.push(at.memory[0]);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![0.25; self.orders]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let mut before = at.inputs[0];
        for state in at.states {
            out.push(before - *state);
            before = *state;
        }
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![-1.0]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0].max(at.inputs[0]));
    }
}

#[test]
fn elements_with_signals_fulfil_the_contract_with_any_number_of_states() {
    for orders in 0..4 {
        let params = format!("orders = {orders}");
        testkit::check_force::<Governor>(&params);
        testkit::check_internal::<Governor>(&params);
        testkit::check_control::<Shaper>(&params);
    }
}

#[test]
fn descriptors_tell_signals_joints_and_outputs() {
    let named = |name: &str, unit: &str, doc: &str| Named { name: name.into(), unit: unit.into(), doc: doc.into() };
    let governor = adapt::force::<Governor>();
    let governor = governor.descriptor();
    assert_eq!(governor.kind, Kind::Force);
    let input = |name: &str, unit: &str, doc: &str, default| NamedInput {
        name: name.into(),
        unit: unit.into(),
        doc: doc.into(),
        default,
    };
    assert_eq!(governor.inputs, [input("push", "N", "pushes", None), input("trim", "N", "pushes too", Some(0.5))]);
    assert_eq!(governor.joints, [named("bearing", "", "loaded"), named("pin", "", "loaded too")]);
    let shaper = adapt::control::<Shaper>();
    let shaper = shaper.descriptor();
    assert_eq!((shaper.kind, shaper.kind.word()), (Kind::Control, "control"));
    let outputs = [named("shaped", "", "the lagging value"), named("largest", "", "so far, at steps")];
    assert_eq!((&shaper.channels[..], shaper.frames.len(), shaper.joints.len()), (&outputs[..], 0, 0));
    assert_eq!((shaper.limits().inputs, shaper.limits().channels, governor.limits().joints), (2, 2, 2));
    let text = toml::to_string(governor).expect("can be written");
    assert_eq!(&toml::from_str::<crate::Descriptor>(&text).expect("can be read"), governor);
}

#[test]
fn inputs_lie_in_a_batch_as_the_layout_says() {
    let mut set = adapt::force::<Governor>().new_set();
    let specs = adapt::force::<Governor>().descriptor().params.clone();
    set.add(&complete(&specs, "orders = 3")).expect("accepted");
    let layout = Layout { frames: 2, angles: 0, states: 3, memory: 0, signals: 2, joints: 2, values: 2 };
    assert_eq!((layout.inputs(), layout.frames_at(), layout.force_results()), (18 + 36, 18, 12 + 3 + 2 + 2));
    let mut inputs = vec![0.0; layout.inputs()];
    // Time; states; signals; force and torque of two joints; frames.
    inputs[0] = 9.0;
    inputs[1..4].copy_from_slice(&[1.0, 2.0, 3.0]);
    inputs[4..6].copy_from_slice(&[10.0, 20.0]);
    inputs[6..12].copy_from_slice(&[100.0, 200.0, 300.0, 400.0, 500.0, 600.0]);
    inputs[12..18].copy_from_slice(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
    for frame in 0..2 {
        for k in 0..3 {
            inputs[18 + 18 * frame + 3 + 4 * k] = 1.0;
        }
    }
    let mut out = vec![f64::NAN; layout.force_results()];
    let wanted = Wanted { jacobian: false, second: false };
    set.evaluate(&Batch { instances: &[0], inputs: &inputs, wanted }, &mut out).expect("fits");
    assert_eq!(out[..6], [0.0, 0.0, -3.0, 0.0, 0.0, 3.0], "forces");
    assert_eq!(out[6..12], [0.0; 6], "torques");
    assert_eq!(out[12..15], [9.0, -1.0, -1.0], "rates");
    // The force of the first joint along x, the torque of the second about y.
    assert_eq!(out[15..17], [50.0, 100.0 + 0.5], "channels");
    assert!(out[17].is_nan() && out[18].is_nan(), "neither potential nor dissipation");
}

#[test]
fn control_elements_give_outputs_rates_and_memory_but_no_loads() {
    let probe = Probe::control::<Shaper>("orders = 2").expect("accepted");
    assert_eq!(probe.recording.initial_states, [0.25, 0.25]);
    assert_eq!(probe.recording.initial_discrete, [-1.0]);
    let roles: Vec<Role> = probe.recording.outputs.iter().map(|output| output.role).collect();
    assert_eq!(
        roles,
        [Role::StateRate(0), Role::StateRate(1), Role::NextDiscrete(0), Role::Channel(0), Role::Channel(1)]
    );
    let mut setting = Setting { signals: vec![2.0], ..Setting::at_rest(Vec::new()) };
    // The second signal takes its default.
    probe.settle(&mut setting);
    let found = probe.force_values(&setting);
    assert_eq!((&found.channels[..], &found.rates[..]), (&[0.75, -1.0][..], &[1.75, 0.0][..]));
    assert_eq!(found.memory, [2.0]);
    assert_eq!((found.forces.len(), found.potential, found.dissipation), (0, None, None));
}

#[test]
fn recordings_read_signals_and_reactions() {
    let probe = Probe::force::<Governor>("").expect("accepted");
    let read: Vec<Input> = probe
        .recording
        .ops
        .iter()
        .filter_map(|raw| match Op::decode(*raw) {
            Some(Op::Input(input)) => Some(input),
            _ => None,
        })
        .collect();
    for input in [
        Input::Signal(0),
        Input::Signal(1),
        Input::ReactionForce { joint: 1, component: 2 },
        Input::ReactionTorque { joint: 0, component: 1 },
    ] {
        assert!(read.contains(&input), "{input:?}");
    }
    let setting = probe.random_setting(&mut Random::new(61));
    assert_eq!((setting.signals.len(), setting.reactions.len(), setting.states.len()), (2, 2, 2));
    let mut limits = probe.descriptor.limits();
    limits.joints = 1;
    assert!(probe.recording.check(&limits).expect_err("one joint").contains("joint 1 of 1"));
    limits.joints = 2;
    limits.inputs = 1;
    assert!(probe.recording.check(&limits).expect_err("one signal").contains("signal 1 of 1"));
}

#[test]
fn instances_with_different_numbers_of_states_do_not_share_a_batch() {
    let class = adapt::control::<Shaper>();
    let mut set = class.new_set();
    for orders in [1, 2] {
        set.add(&complete(&class.descriptor().params, &format!("orders = {orders}"))).expect("accepted");
    }
    let layout = Layout { frames: 0, angles: 0, states: 1, memory: 1, signals: 2, joints: 0, values: 2 };
    let inputs = vec![0.5; 2 * layout.inputs()];
    let mut out = vec![0.0; 2 * layout.force_results()];
    let wanted = Wanted { jacobian: false, second: false };
    let fault = set.evaluate(&Batch { instances: &[0, 1], inputs: &inputs, wanted }, &mut out).expect_err("mixed");
    assert_eq!(fault.instance, 1);
    assert!(fault.message.contains("a batch needs instances of one layout"), "{fault}");
}
