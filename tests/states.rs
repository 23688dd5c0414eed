//! Elements with a past: continuous states, discrete memory, bytes of their own, and angles over many turns.

use std::marker::PhantomData;

use element_api::adapt::{force, joint};
use element_api::manifest::Library;
use element_api::prelude::*;

use crate::support::{column, run_linked};

/// Says whether an element is called at run time.
trait Form: Send + Sync + 'static {
    const OPAQUE: bool;
}
struct RecordedForm;
struct OpaqueForm;
impl Form for RecordedForm {
    const OPAQUE: bool = false;
}
impl Form for OpaqueForm {
    const OPAQUE: bool = true;
}

const ONE_FRAME: &[FrameSpec] = &[FrameSpec::new("on", "the body")];

/// A thrust along x that dies away: F' = -F / tau.
struct Thrust<F> {
    initial: f64,
    tau: f64,
    form: PhantomData<F>,
}

#[derive(Parameters)]
struct ThrustParameters {
    /// Thrust at the start.
    #[param(unit = "N")]
    initial: f64,
    /// Time constant.
    #[param(unit = "s", above = 0.0)]
    tau: f64,
}

impl<F: Form> Element for Thrust<F> {
    const NAME: &'static str = "thrust";
    const SUMMARY: &'static str = "thrust that dies away";
    const FRAMES: &'static [FrameSpec] = ONE_FRAME;
    const OPAQUE: bool = F::OPAQUE;
    type Parameters = ThrustParameters;

    fn new(p: ThrustParameters) -> Result<Self, ParamError> {
        Ok(Self { initial: p.initial, tau: p.tau, form: PhantomData })
    }
}

impl<F: Form> Force for Thrust<F> {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("thrust", "N", "along x")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("thrust", "N", "along x")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(0, Vec3::new(at.states[0], S::zero(), S::zero()));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn initial_states(&self) -> Vec<f64> {
        vec![self.initial]
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(-at.states[0] / self.tau);
    }
}

/// A spring to the ground that tears for good when a step ends with it longer than its strength allows, and that counts
/// the accepted steps.
struct Fuse<F>(PhantomData<F>);

impl<F: Form> Fuse<F> {
    const STRENGTH: f64 = 0.5;
}

impl<F: Form> Element for Fuse<F> {
    const NAME: &'static str = "fuse";
    const SUMMARY: &'static str = "spring of 4 N/m that tears at 0.5 m";
    const FRAMES: &'static [FrameSpec] = ONE_FRAME;
    const OPAQUE: bool = F::OPAQUE;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self(PhantomData))
    }
}

impl<F: Form> Force for Fuse<F> {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("steps", "1", "accepted steps"), ChannelSpec::new("whole", "1", "1 until it tears, then 0")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force(0, at.frames()[0].position * (at.memory[1] * -4.0));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory.iter().for_each(|m| out.push(*m));
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0, 1.0]
    }
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let x = at.frames()[0].position.x;
        out.push(at.memory[0] + 1.0);
        out.push(S::select(S::from(Self::STRENGTH), x, S::zero(), at.memory[1]));
    }
}

/// Counts accepted steps in memory of its own, which the host knows only as bytes.
struct Counter {
    accepted: u32,
}

impl Element for Counter {
    const NAME: &'static str = "counter";
    const SUMMARY: &'static str = "counts accepted steps";
    const FRAMES: &'static [FrameSpec] = ONE_FRAME;
    const OPAQUE: bool = true;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self { accepted: 0 })
    }
    fn accept(&mut self, _: &Motion<'_, f64>) {
        self.accepted += 1;
    }
    fn save(&self) -> Vec<u8> {
        self.accepted.to_le_bytes().to_vec()
    }
    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        let bytes = memory.try_into().map_err(|_| "not of a counter")?;
        self.accepted = u32::from_le_bytes(bytes);
        Ok(())
    }
}

impl Force for Counter {
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("steps", "1", "accepted steps")];

    fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn channels<S: Scalar>(&self, _: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(S::from(f64::from(self.accepted)));
    }
}

/// A joint of no rows but one, whose only purpose is its angle.
struct Turns<F>(PhantomData<F>);

impl<F: Form> Element for Turns<F> {
    const NAME: &'static str = "turns";
    const SUMMARY: &'static str = "keeps z and counts turns about it";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "first body"), FrameSpec::new("j", "second body")];
    const ANGLES: usize = 1;
    const OPAQUE: bool = F::OPAQUE;
    type Parameters = NoParameters;

    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self(PhantomData))
    }
}

impl<F: Form> Constraint for Turns<F> {
    const ROWS: &'static [&'static str] = &["z"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("angle", "rad", "rotation about z")];

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.frames[1].position.z - at.frames[0].position.z);
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.angle_about_z(0, 0, 1));
    }
}

fn library<F: Form>() -> Library {
    Library {
        package: "pasts".into(),
        version: "1.0.0".into(),
        about: "Elements with a past".into(),
        classes: vec![force::<Thrust<F>>(), force::<Fuse<F>>(), force::<Counter>(), joint::<Turns<F>>()],
    }
}

/// m v' = F0 exp(-t / tau): v = F0 tau / m (1 - exp(-t / tau)), x = F0 tau / m (t - tau (1 - exp(-t / tau))).
#[test]
fn a_continuous_state_follows_its_closed_form() {
    let scene = r#"
[simulation]
t_end = 3
output_step = 0.25
[[body]]
name = "rocket"
mass = 2
inertia = [1, 1, 1]
[[force]]
name = "engine"
type = "thrust"
bodies = ["rocket"]
params.initial = 10
params.tau = 0.5
[[output]]
name = "F"
quantity = "value"
of = "engine"
[[output]]
name = "v"
quantity = "velocity"
of = "rocket"
component = "x"
[[output]]
name = "x"
quantity = "position"
of = "rocket"
component = "x"
"#;
    for report in [run_linked(scene, library::<RecordedForm>()), run_linked(scene, library::<OpaqueForm>())] {
        for (k, t) in report.times.iter().enumerate() {
            let decay = (-t / 0.5).exp();
            for (name, exact) in
                [("F", 10.0 * decay), ("v", 2.5 * (1.0 - decay)), ("x", 2.5 * (t - 0.5 * (1.0 - decay)))]
            {
                let value = column(&report, name)[k];
                assert!((value - exact).abs() < 1e-8, "{name}({t}) = {value}, not {exact}");
            }
        }
    }
}

const FUSE: &str = r#"
[simulation]
t_end = 2
output_step = 0.05
tolerance = 1e-8
[[body]]
name = "ball"
mass = 1
inertia = [1, 1, 1]
velocity = [2, 0, 0]
[[force]]
name = "fuse"
type = "fuse"
bodies = ["ball"]
[[force]]
name = "counter"
type = "counter"
bodies = ["ball"]
[[output]]
name = "steps"
quantity = "value"
of = "fuse"
channel = "steps"
[[output]]
name = "counted"
quantity = "value"
of = "counter"
[[output]]
name = "whole"
quantity = "value"
of = "fuse"
channel = "whole"
[[output]]
name = "x"
quantity = "position"
of = "ball"
component = "x"
[[output]]
name = "v"
quantity = "velocity"
of = "ball"
component = "x"
"#;

/// Samples of a step are taken before it is accepted: the last one has seen all steps but the last. Rejected steps, of
/// which this scene must have some, don't count.
#[test]
fn memory_changes_with_accepted_steps_and_only_then() {
    // An opaque element takes no steps longer than between samples.
    let scene =
        FUSE.replace("tolerance", "first_step = 1.5\ntolerance").replace("output_step = 0.05", "output_step = 1");
    for report in [run_linked(&scene, library::<RecordedForm>()), run_linked(&scene, library::<OpaqueForm>())] {
        assert!(report.summary.rejected > 0, "a first step of 1.5 s is too long");
        let last = (report.summary.steps - 1) as f64;
        for name in ["steps", "counted"] {
            let steps = column(&report, name);
            assert_eq!((steps[0], steps[steps.len() - 1]), (0.0, last), "{name}: {steps:?}");
            assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]), "{name}: {steps:?}");
        }
    }
}

/// Before it tears x = sin(2 t), from then on the ball flies straight on.
#[test]
fn a_latch_stays_as_it_fell() {
    for report in [run_linked(FUSE, library::<RecordedForm>()), run_linked(FUSE, library::<OpaqueForm>())] {
        let [whole, x, v] = ["whole", "x", "v"].map(|name| column(&report, name));
        let torn = whole.iter().position(|value| *value == 0.0).expect("the ball is fast enough");
        assert!(torn > 0 && whole[..torn].iter().all(|w| *w == 1.0) && whole[torn..].iter().all(|w| *w == 0.0));
        for (t, x) in report.times[..torn].iter().zip(&x[..torn]) {
            assert!((x - (2.0 * t).sin()).abs() < 1e-6, "x({t}) = {x}");
        }
        assert!(x[torn] > Fuse::<RecordedForm>::STRENGTH);
        let speed = v[torn];
        assert!(speed > 0.5 && v[torn..].iter().all(|v| (v - speed).abs() < 1e-12), "{v:?}");
        assert!(x[x.len() - 1] > 1.0, "no spring holds the ball back");
    }
}

/// A body that turns at 50 rad/s about z, almost 80 turns: angle = 50 t - 2.5, counted from the angle at the start in
/// (-pi, pi].
#[test]
fn an_angle_counts_its_turns() {
    let scene = r#"
[simulation]
t_end = 10
output_step = 0.5
[[body]]
name = "wheel"
mass = 1
inertia = [1, 1, 2]
orientation = { axis = [0, 0, 1], angle = -2.5 }
angular_velocity = [0, 0, SPEED]
[[joint]]
name = "turns"
type = "turns"
bodies = ["ground", "wheel"]
frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
[[output]]
name = "angle"
quantity = "coordinate"
of = "turns"
[[output]]
name = "rate"
quantity = "coordinate_rate"
of = "turns"
"#;
    for speed in [50.0, -50.0] {
        let scene = scene.replace("SPEED", &speed.to_string());
        for report in [run_linked(&scene, library::<RecordedForm>()), run_linked(&scene, library::<OpaqueForm>())] {
            for (k, t) in report.times.iter().enumerate() {
                let (angle, rate) = (column(&report, "angle")[k], column(&report, "rate")[k]);
                assert!((angle - (speed * t - 2.5)).abs() < 1e-7, "angle({t}) = {angle}");
                assert!((rate - speed).abs() < 1e-9, "rate({t}) = {rate}");
            }
        }
    }
}
