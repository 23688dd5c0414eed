//! A rope over a ring, whose strands can be assembled to no length: there the direction of a strand is undefined.

use crate::prelude::*;
use crate::testkit::{Check, Options, Probe, Random, Setting, examine_joint, examine_joint_with};

struct Strands {
    length: f64,
}

#[derive(Parameters)]
struct StrandsParameters {
    /// Sum of the two strands.
    #[param(unit = "m")]
    length: f64,
}

impl Element for Strands {
    const NAME: &'static str = "strands";
    const SUMMARY: &'static str = "rope over a ring";
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("i", "one end"), FrameSpec::new("ring", "the ring"), FrameSpec::new("j", "the other end")];
    type Parameters = StrandsParameters;
    fn new(p: StrandsParameters) -> Result<Self, ParamError> {
        Ok(Self { length: p.length })
    }
}

impl Constraint for Strands {
    const ROWS: &'static [&'static str] = &["length"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let [a, ring, b] = [0, 1, 2].map(|k| at.frames[k].position);
        rows.push(length(a - ring) + length(b - ring) - self.length);
    }
}

#[test]
fn a_rope_that_cannot_be_put_together_is_reported_and_the_search_ends() {
    // No sum of lengths is negative.
    let report = examine_joint::<Strands>("length = -0.5");
    let found = report.findings.iter().find(|finding| finding.check == Check::FreeMotion).expect("found");
    assert!(found.detail.starts_with("no setting found: could be assembled from 0 of 20"), "{report}");
    examine_joint::<Strands>("length = 1").assert_sound();
}

#[test]
fn a_strand_without_length_is_no_setting() {
    // The row is zero, but the direction of a strand is not a number: the decomposition of such rows never ended.
    let folded = |random: &mut Random| {
        let [mut a, ring, mut b] = [0, 1, 2].map(|_| random.frame());
        a.position = ring.position;
        b.position = ring.position + Vec3::new(0.0, 1.0, 0.0);
        Setting::at_rest(vec![a, ring, b])
    };
    let options = Options { aligned: Some(&folded), ..Options::default() };
    let report = examine_joint_with::<Strands>("length = 1", &options);
    assert_eq!(report.failed(), [Check::FreeMotion], "{report}");
    assert!(report.findings[0].detail.starts_with("no setting found: "), "{report}");
    let probe = Probe::joint::<Strands>("length = 1").expect("accepted");
    assert!(!probe.assemble(&mut folded(&mut Random::new(0))));
}
