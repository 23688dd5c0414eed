//! Batched evaluation with plain numbers: order, lengths, instances that do not exist, opaque elements.

use crate::adapt;
use crate::prelude::*;
use crate::recording::Role;
use crate::set::{Batch, ElementSet, Wanted};
use crate::testkit::{Probe, Random, Setting, complete};
use crate::tests::{BELLOWS, Bellows, Screw};

const ALL: Wanted = Wanted { jacobian: true, second: true };

/// The same equations as [`Screw`], called at run time; counts accepted steps.
struct OpaqueScrew(Screw, u8);

impl Element for OpaqueScrew {
    const NAME: &'static str = "opaque-screw";
    const SUMMARY: &'static str = Screw::SUMMARY;
    const FRAMES: &'static [FrameSpec] = Screw::FRAMES;
    const ANGLES: usize = 1;
    const OPAQUE: bool = true;
    type Parameters = <Screw as Element>::Parameters;
    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(Screw::new(p)?, 0))
    }
    fn accept(&mut self, at: &Motion<'_, f64>) {
        assert!(at.time() >= 0.0, "time runs backwards");
        self.1 += 1;
    }
    fn save(&self) -> Vec<u8> {
        vec![self.1]
    }
    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        let [count] = memory else { return Err(format!("{} bytes instead of 1", memory.len())) };
        self.1 = *count;
        Ok(())
    }
}

impl Constraint for OpaqueScrew {
    const ROWS: &'static [&'static str] = Screw::ROWS;
    const COORDINATES: &'static [ChannelSpec] = Screw::COORDINATES;
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        self.0.residual(at, rows);
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        self.0.coordinates(at, out);
    }
}

#[test]
fn an_opaque_joint_records_no_equations_and_evaluates_to_the_same_numbers() {
    let params = "pitch = 0.2\nspeed = 0.1";
    let (traced, opaque) =
        (Probe::joint::<Screw>(params).expect("accepted"), Probe::joint::<OpaqueScrew>(params).expect("accepted"));
    assert!(opaque.descriptor.opaque && !traced.descriptor.opaque);
    assert_eq!(opaque.recording.ops.len(), 1);
    let roles: Vec<Role> = opaque.recording.outputs.iter().map(|o| o.role).collect();
    let rows = (0..5).map(Role::Residual);
    assert_eq!(roles, rows.chain([Role::Coordinate(0), Role::Angle(0)]).collect::<Vec<_>>());
    let mut random = Random::new(41);
    for _ in 0..10 {
        let setting = traced.random_setting(&mut random);
        assert_eq!(opaque.joint_values(&setting), traced.joint_values(&setting));
    }
}

#[test]
fn instances_of_a_batch_come_in_any_order_and_do_not_disturb_each_other() {
    let mut set = screws(&["pitch = 1.0", "pitch = 2.0", "pitch = 3.0"]);
    let mut random = Random::new(42);
    let settings: Vec<Setting> =
        (0..3).map(|_| Probe::joint::<Screw>("pitch = 1.0").expect("accepted").random_setting(&mut random)).collect();
    let inputs: Vec<f64> = settings.iter().flat_map(Setting::inputs).collect();
    let per_instance = 6 * (3 + 12) + 1;
    let mut together = vec![f64::NAN; 3 * per_instance];
    set.evaluate(&Batch { instances: &[2, 0, 1], inputs: &inputs, wanted: ALL }, &mut together).expect("fits");
    for (k, instance) in [2_u32, 0, 1].into_iter().enumerate() {
        let mut alone = vec![f64::NAN; per_instance];
        let inputs = settings[k].inputs();
        set.evaluate(&Batch { instances: &[instance], inputs: &inputs, wanted: ALL }, &mut alone).expect("fits");
        assert_eq!(together[k * per_instance..(k + 1) * per_instance], alone);
        assert!(alone.iter().all(|x| x.is_finite()), "every slot is written");
    }
    let empty = Batch { instances: &[], inputs: &[], wanted: ALL };
    assert_eq!(set.evaluate(&empty, &mut []), Ok(()));
    // Accepting one instance leaves the others alone.
    set.accept(0, &settings[0].inputs()).expect("accepted");
}

#[test]
fn derivatives_that_are_not_wanted_are_left_as_they_are() {
    let set = screws(&["pitch = 1.0"]);
    let inputs = setting().inputs();
    let mut out = vec![7.0; 6 * (3 + 12) + 1];
    let wanted = Wanted { jacobian: false, second: false };
    set.evaluate(&Batch { instances: &[0], inputs: &inputs, wanted }, &mut out).expect("fits");
    assert!(out[6..90].iter().all(|x| *x == 7.0));
    assert!(out[..6].iter().chain(&out[90..]).all(|x| *x != 7.0));
}

#[test]
fn batches_that_do_not_fit_are_refused_in_words() {
    let set = screws(&["pitch = 1.0", "pitch = 1.0\nheld = false"]);
    let inputs = setting().inputs();
    let refused = |instances: &[u32], inputs: &[f64], results: usize| {
        let mut out = vec![0.0; results];
        set.evaluate(&Batch { instances, inputs, wanted: ALL }, &mut out).expect_err("must be refused")
    };
    assert!(refused(&[0], &inputs[1..], 91).message.contains("a batch of 1 needs 38 inputs and 91 results"));
    assert!(refused(&[0], &inputs, 90).message.contains("found 38 and 90"));
    let unknown = refused(&[5], &inputs, 91);
    assert_eq!((unknown.instance, unknown.message.as_str()), (5, "instance 5 does not exist (2 do)"));
    let twice: Vec<f64> = inputs.iter().chain(&inputs).copied().collect();
    let unknown = refused(&[0, 5], &twice, 182);
    assert_eq!((unknown.instance, unknown.message.as_str()), (5, "instance 5 does not exist (2 do)"));
    let mixed = refused(&[0, 1], &twice, 182);
    assert_eq!(mixed.instance, 1);
    assert!(mixed.message.contains("a batch needs instances of one layout"), "{mixed}");
}

#[test]
fn forces_with_different_memories_do_not_share_a_batch() {
    let mut set = adapt::force::<Bellows>().new_set();
    let specs = adapt::force::<Bellows>().descriptor().params.clone();
    for latches in 1..=2 {
        set.add(&complete(&specs, &format!("{BELLOWS}\nlatches = {latches}"))).expect("accepted");
    }
    let probe = Probe::force::<Bellows>(BELLOWS).expect("accepted");
    let inputs = probe.random_setting(&mut Random::new(44)).inputs();
    let twice: Vec<f64> = inputs.iter().chain(&inputs).copied().collect();
    let mut out = vec![0.0; 2 * (12 + 1 + 1 + 1 + 2)];
    let fault =
        set.evaluate(&Batch { instances: &[0, 1], inputs: &twice, wanted: ALL }, &mut out).expect_err("refused");
    assert_eq!(fault.instance, 1);
}

#[test]
fn memory_of_an_opaque_element_changes_only_between_steps_and_can_be_put_back() {
    let specs = adapt::joint::<OpaqueScrew>().descriptor().params.clone();
    let mut set = adapt::joint::<OpaqueScrew>().new_set();
    let instance = set.add(&complete(&specs, "pitch = 1.0")).expect("accepted");
    let inputs = setting().inputs();
    let mut out = vec![0.0; 91];
    let before = set.save(instance).expect("saved");
    set.evaluate(&Batch { instances: &[0], inputs: &inputs, wanted: ALL }, &mut out).expect("fits");
    assert_eq!(set.save(instance), Ok(before.clone()));
    set.accept(instance, &inputs).expect("accepted");
    assert_ne!(set.save(instance), Ok(before.clone()));
    set.load(instance, &before).expect("its own bytes");
    assert_eq!(set.save(instance), Ok(before));
    let fault = set.load(instance, &[1, 2]).expect_err("not its bytes");
    assert_eq!(fault.message, "2 bytes instead of 1");
}

#[test]
fn an_element_without_memory_refuses_one() {
    let mut set = screws(&["pitch = 1.0"]);
    assert_eq!(set.save(0), Ok(Vec::new()));
    assert_eq!(set.load(0, &[]), Ok(()));
    assert!(set.load(0, &[1]).is_err());
}

fn screws(params: &[&str]) -> Box<dyn ElementSet> {
    let class = adapt::joint::<Screw>();
    let mut set = class.new_set();
    for text in params {
        set.add(&complete(&class.descriptor().params, text)).expect("accepted");
    }
    set
}

fn setting() -> Setting {
    Probe::joint::<Screw>("pitch = 1.0").expect("accepted").random_setting(&mut Random::new(43))
}
