//! Elements with any number of frames: what is recorded and evaluated for each number, and what is refused.

use crate::adapt;
use crate::prelude::*;
use crate::recording::{Limits, Role};
use crate::set::CreateError;
use crate::testkit::{Probe, Random};

/// A string over two or more points, recorded or called.
macro_rules! string {
    ($name:ident, $opaque:expr, $more:expr, $most:expr) => {
        struct $name {
            count: usize,
        }
        impl Element for $name {
            const NAME: &'static str = "string";
            const SUMMARY: &'static str = "a string";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
            const MORE_FRAMES: Option<FrameSpec> = $more;
            const MOST_FRAMES: usize = $most;
            const OPAQUE: bool = $opaque;
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self { count: 0 })
            }
            fn with_frames(self, count: usize) -> Result<Self, ParamError> {
                if count == 4 { Err(ParamError::new("bodies", "not four")) } else { Ok(Self { count }) }
            }
        }
        impl Constraint for $name {
            const ROWS: &'static [&'static str] = &["length"];
            fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
                assert!($more.is_none() || at.frames().len() == self.count);
                let strands = at.frames().windows(2).map(|pair| length(pair[1].position - pair[0].position));
                rows.push(strands.fold(S::zero(), |sum, strand| sum + strand) - 3.0);
            }
        }
    };
}

const POINT: Option<FrameSpec> = Some(FrameSpec::new("point", "where it goes next"));

string!(Traced, false, POINT, 6);
string!(Called, true, POINT, 6);
string!(Fixed, false, None::<FrameSpec>, 6);
string!(NoRoom, false, POINT, 2);

fn with(count: usize) -> String {
    format!("'#frames' = {count}")
}

#[test]
fn every_number_of_frames_is_recorded_and_evaluated_alike() {
    for count in [2, 3, 5, 6] {
        let traced = Probe::joint::<Traced>(&with(count)).expect("accepted");
        let called = Probe::joint::<Called>(&with(count)).expect("accepted");
        assert_eq!((traced.layout().frames, called.layout().frames), (count, count));
        let setting = traced.random_setting(&mut Random::new(count as u64));
        assert_eq!(setting.frames.len(), count);
        let (found, told) = (traced.joint_values(&setting), called.joint_values(&setting));
        assert_eq!(found, told);
        assert_eq!(found.jacobian[0].len(), 6 * count);
        let points = setting.frames.windows(2).map(|pair| (pair[1].position - pair[0].position).norm());
        let recorded = traced.recorded(&setting, &[]);
        let residual = recorded.iter().find(|(role, _)| *role == Role::Residual(0)).expect("recorded").1;
        assert!((residual - (points.sum::<f64>() - 3.0)).abs() < 1e-13);
    }
    assert_eq!(Probe::joint::<Traced>("").expect("the fewest").layout().frames, 2);
}

#[test]
fn a_description_says_how_many_and_that_of_an_instance_names_them() {
    let class = adapt::joint::<Traced>();
    let all = class.descriptor();
    assert_eq!((all.frame_counts(), all.limits().frames, all.check()), ((2, 6), 6, Ok(())));
    let own = all.with_frames(4);
    let names: Vec<&str> = own.frames.iter().map(|frame| frame.name.as_str()).collect();
    assert_eq!((names, own.frame_counts()), (vec!["i", "j", "point 1", "point 2"], (4, 4)));
    let text = toml::to_string(all).expect("written");
    assert_eq!(toml::from_str::<crate::Descriptor>(&text).expect("read"), *all);
    let fixed = adapt::joint::<Fixed>();
    assert_eq!((fixed.descriptor().frame_counts(), &fixed.descriptor().with_frames(5)), ((2, 2), fixed.descriptor()));
    let error = adapt::joint::<NoRoom>().descriptor().check().expect_err("no room");
    assert!(error.contains("at most 2 in all"), "{error}");
}

#[test]
fn a_number_that_is_not_taken_is_refused_in_words() {
    for (count, words) in [(1, "takes 2 to 6 frames"), (7, "takes 2 to 6 frames"), (4, "not four")] {
        match Probe::joint::<Traced>(&with(count)) {
            Err(CreateError::Parameter(error)) => {
                assert!(error.path == "bodies" && error.message.contains(words), "{count}: {error:?}");
            }
            other => panic!("{count}: {other:?}"),
        }
    }
    // An element with its own frames only is not asked.
    assert_eq!(Probe::joint::<Fixed>(&with(7)).expect("accepted").layout().frames, 2);
}

#[test]
fn a_frame_that_an_instance_has_not_is_refused() {
    let probe = Probe::joint::<Traced>(&with(5)).expect("accepted");
    assert!(probe.recording.check(&probe.descriptor.limits()).is_ok());
    let fewer = Limits { frames: 3, ..probe.descriptor.limits() };
    assert!(probe.recording.check(&fewer).expect_err("frames 3 and 4").contains("frame"));
}
