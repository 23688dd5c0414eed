//! Elements that are broken on purpose: the test kit names each defect, and nothing else.

use std::any::{Any, TypeId};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::jet::Jet;
use crate::prelude::*;
use crate::recorded::Recorded;
use crate::testkit::{Check, Options, Report};
use crate::testkit::{examine_class, examine_control, examine_force_with, examine_joint_with};
use crate::tests::allocations::allocations_of;

/// What is wrong with an element.
#[derive(Parameters)]
struct Defect {
    /// Which defect.
    #[param(default = "none")]
    defect: String,
}

/// Different numbers with every call, far below what any comparison of numbers allows.
fn noise() -> f64 {
    static CALLS: AtomicU64 = AtomicU64::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed) + 1;
    1e-15 * (call.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 60) as f64
}

fn is<S: 'static, T: 'static>() -> bool {
    TypeId::of::<S>() == TypeId::of::<T>()
}

/// A jet without its second derivative; other scalars as they are.
fn without_second<S: Scalar>(x: S) -> S {
    let any: &dyn Any = &x;
    let Some(jet) = any.downcast_ref::<Jet>() else { return x };
    let cut: &dyn Any = &Jet::new(jet.value, jet.first, 0.0);
    cut.downcast_ref::<S>().copied().unwrap_or(x)
}

/// A screw; the second one is called at run time.
struct Thread<const CALLED: bool> {
    defect: String,
    offset: f64,
    wear: f64,
    evaluations: AtomicU64,
}

const PITCH: f64 = 0.2;

impl<const CALLED: bool> Element for Thread<CALLED> {
    const NAME: &'static str = "thread";
    const SUMMARY: &'static str = "advances along z as it turns";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "nut"), FrameSpec::new("j", "bolt")];
    const ANGLES: usize = 1;
    const OPAQUE: bool = CALLED;
    type Parameters = Defect;

    fn new(p: Defect) -> Result<Self, ParamError> {
        if p.defect == "refuses" {
            return Err(ParamError::new("defect", "not this one"));
        }
        let offset = if p.defect == "instances-differ" { noise() } else { 0.0 };
        Ok(Self { defect: p.defect, offset, wear: 0.0, evaluations: AtomicU64::new(0) })
    }
    fn accept(&mut self, _: &Motion<'_, f64>) {
        if self.has("wears") || self.has("forgets-wear") || self.has("loads-anything") {
            self.wear += 1e-3;
        }
    }
    fn save(&self) -> Vec<u8> {
        match self.defect.as_str() {
            "wears" | "loads-anything" => self.wear.to_le_bytes().to_vec(),
            "counts-evaluations" => self.evaluations.load(Ordering::Relaxed).to_le_bytes().to_vec(),
            _ => Vec::new(),
        }
    }
    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        if self.has("wears") {
            self.wear = f64::from_le_bytes(memory.try_into().map_err(|_| "not the memory of a thread")?);
        }
        Ok(())
    }
}

impl<const CALLED: bool> Thread<CALLED> {
    fn has(&self, defect: &str) -> bool {
        self.defect == defect
    }
}

impl<const CALLED: bool> Constraint for Thread<CALLED> {
    const ROWS: &'static [&'static str] = &["x", "y", "about y", "about x", "advance"];
    const COORDINATES: &'static [ChannelSpec] = &[ChannelSpec::new("angle", "rad", "of the bolt")];
    const MOBILITY: Option<usize> = Some(1);

    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        assert!(!self.has("panics"), "out of order");
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        let (i, j) = (&at.frames[0], &at.frames[1]);
        let d = j.position - i.position;
        let across = i.x().dot(&d);
        rows.push(if self.has("missing-term") { d.x } else { across });
        rows.push(if self.has("row-twice") { across } else { i.y().dot(&d) });
        blocks::parallel_z(i, j, rows);
        let angle = match self.defect.as_str() {
            "row-loses-turns" => j.x().dot(&i.y()).atan2(j.x().dot(&i.x())),
            _ => at.angle_about_z(0, 0, 1),
        };
        let advance = i.z().dot(&d);
        let row = match self.defect.as_str() {
            "unwritten-row" => return,
            "wrong-sign" => advance + angle * PITCH,
            "depends-on-time" => advance - angle * PITCH - at.time * 0.1,
            _ => advance - angle * PITCH + self.wear + self.offset,
        };
        rows.push(match self.defect.as_str() {
            "noise" => row + noise(),
            "number-differs" if is::<S, f64>() => row + across * 0.1,
            "jet-differs" if is::<S, Jet>() => row + across * 0.1,
            "recording-differs" if is::<S, Recorded>() => row + across * 0.1,
            "compares" if across == S::zero() => row * 2.0,
            "curvature-lost" => without_second(row),
            "allocates" => vec![row; 3][2],
            _ => row,
        });
    }
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames[0], &at.frames[1]);
        out.push(match self.defect.as_str() {
            "coordinate-loses-turns" => j.x().dot(&i.y()).atan2(j.x().dot(&i.x())),
            "unwritten-coordinate" => return,
            _ => at.angle_about_z(0, 0, 1),
        });
    }
    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        Pose::screw_z(q[0], q[0] * PITCH)
    }
}

fn thread<const CALLED: bool>(defect: &str) -> Report {
    let options = Options { count: Some(&allocations_of), ..Options::default() };
    examine_joint_with::<Thread<CALLED>>(&format!("defect = '{defect}'"), &options)
}

#[test]
fn a_class_is_examined_as_its_type_is() {
    for defect in ["none", "missing-term", "row-twice", "row-loses-turns"] {
        let class = crate::adapt::joint::<Thread<false>>();
        let options = Options { count: Some(&allocations_of), ..Options::default() };
        let report = examine_class(class, &format!("defect = '{defect}'"), &options);
        let of_type = thread::<false>(defect);
        assert_eq!((&report.examined, report.failed()), (&of_type.examined, of_type.failed()), "{defect}: {report}");
    }
}

fn assert_found(report: &Report, expected: &[Check], defect: &str) {
    assert_eq!(report.failed(), expected, "{defect}: {report}");
}

#[test]
fn each_defect_of_a_joint_is_named() {
    let defects: [(&str, &[Check]); 14] = [
        ("none", &[]),
        ("refuses", &[Check::Recording]),
        ("panics", &[Check::Recording]),
        ("unwritten-row", &[Check::UnwrittenOutput]),
        ("unwritten-coordinate", &[Check::UnwrittenOutput]),
        ("wrong-sign", &[Check::FreeMotion]),
        ("missing-term", &[Check::FrameInvariance, Check::BodySwap, Check::ThirdLaw, Check::FreeMotion]),
        ("row-twice", &[Check::BodySwap, Check::MobilityRank]),
        ("depends-on-time", &[Check::PowerBalance, Check::FreeMotion]),
        ("row-loses-turns", &[Check::AngleContinuity]),
        ("coordinate-loses-turns", &[Check::AngleContinuity]),
        ("instances-differ", &[Check::SaveLoad, Check::TwoThreads]),
        ("recording-differs", &[Check::Recording, Check::DualNumbers]),
        ("allocates", &[Check::Allocation]),
    ];
    for (defect, expected) in defects {
        assert_found(&thread::<false>(defect), expected, defect);
    }
}

/// While equations are written down there are no values to compare.
#[test]
fn comparing_what_is_not_known_is_named() {
    let report = thread::<false>("compares");
    assert_found(&report, &[Check::Recording], "compares");
    let said = &report.findings[0].detail;
    assert!(said.contains("`==` of a number that is not known") && said.contains("use `select`"), "{said}");
    assert!(said.contains("broken.rs"), "{said}");
}

#[test]
fn equations_that_tell_scalars_apart_are_found_by_their_derivatives() {
    let defects: [(&str, &[Check]); 3] = [
        ("number-differs", &[Check::Recording, Check::Jacobian, Check::Gamma, Check::PowerBalance]),
        ("jet-differs", &[Check::Jacobian, Check::DualNumbers, Check::Gamma, Check::PowerBalance]),
        ("curvature-lost", &[Check::DualNumbers, Check::Gamma]),
    ];
    for (defect, expected) in defects {
        assert_found(&thread::<false>(defect), expected, defect);
    }
}

#[test]
fn each_defect_of_an_element_called_at_run_time_is_named() {
    let defects: [(&str, &[Check]); 12] = [
        ("none", &[]),
        ("wears", &[]),
        ("panics", &[Check::Recording]),
        ("unwritten-row", &[Check::UnwrittenOutput]),
        ("unwritten-coordinate", &[Check::UnwrittenOutput]),
        ("wrong-sign", &[Check::FreeMotion]),
        ("jet-differs", &[Check::Jacobian, Check::Gamma, Check::PowerBalance]),
        ("curvature-lost", &[Check::Gamma]),
        ("noise", &[Check::Repeatability, Check::TwoThreads]),
        ("counts-evaluations", &[Check::Repeatability]),
        ("forgets-wear", &[Check::SaveLoad]),
        ("loads-anything", &[Check::SaveLoad]),
    ];
    for (defect, expected) in defects {
        assert_found(&thread::<true>(defect), expected, defect);
    }
}

#[test]
fn a_memory_that_the_host_never_asks_for_is_found() {
    for defect in ["wears", "forgets-wear"] {
        assert_found(&thread::<false>(defect), &[Check::SaveLoad], defect);
    }
}

/// Distances that contradict each other, or that depend on time much too fast.
struct Rods {
    defect: String,
}

impl Element for Rods {
    const NAME: &'static str = "rods";
    const SUMMARY: &'static str = "two rods between two points";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "one end"), FrameSpec::new("j", "other end")];
    type Parameters = Defect;
    fn new(p: Defect) -> Result<Self, ParamError> {
        Ok(Self { defect: p.defect })
    }
}

impl Constraint for Rods {
    const ROWS: &'static [&'static str] = &["first", "second"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let distance = length(at.frames[1].position - at.frames[0].position);
        rows.push(distance - 1.0);
        rows.push(match self.defect.as_str() {
            "contradicts" => distance - 2.0,
            "trembles" => distance - 1.0 + (at.time * 1e9).sin(),
            _ => (distance - 1.0) * 2.0,
        });
    }
}

#[test]
fn a_joint_without_mobility_is_assembled_and_moved() {
    for (defect, expected) in [("none", &[][..]), ("contradicts", &[Check::FreeMotion])] {
        let options = Options { symmetric: Some(defect == "none"), scleronomic: Some(true), ..Options::default() };
        assert_found(&examine_joint_with::<Rods>(&format!("defect = '{defect}'"), &options), expected, defect);
    }
}

#[test]
fn equations_that_no_difference_can_follow_are_not_passed_over() {
    let options = Options { scleronomic: Some(false), ..Options::default() };
    let report = examine_joint_with::<Rods>("defect = 'trembles'", &options);
    let words = "row `second` over time: in no setting is a step small enough for differences";
    assert!(report.findings.iter().any(|found| found.check == Check::Jacobian && found.detail == words), "{report}");
}

/// A spring and damper between two points, with a dial.
struct Strut {
    defect: String,
}

const STIFFNESS: f64 = 30.0;
const DAMPING: f64 = 4.0;

impl Element for Strut {
    const NAME: &'static str = "strut";
    const SUMMARY: &'static str = "spring and damper between two points";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "one end"), FrameSpec::new("j", "other end")];
    const ANGLES: usize = 1;
    type Parameters = Defect;
    fn new(p: Defect) -> Result<Self, ParamError> {
        Ok(Self { defect: p.defect })
    }
}

impl Strut {
    fn has(&self, defect: &str) -> bool {
        self.defect == defect
    }
    /// Rate of the length.
    fn speed<S: Scalar>(at: &Motion<'_, S>) -> S {
        let d = at.frames()[1].position - at.frames()[0].position;
        d.dot(&at.relative_velocity(0, 1)) / length(d)
    }
    fn damping(&self) -> f64 {
        if self.has("drives") { -DAMPING } else { DAMPING }
    }
}

impl Force for Strut {
    const CHANNELS: &'static [ChannelSpec] =
        &[ChannelSpec::new("angle", "rad", "of j against i"), ChannelSpec::new("tension", "N", "pull")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        let tension = (length(d) - 0.5) * STIFFNESS + Self::speed(at) * self.damping();
        let pull = d / length(d) * -tension;
        match self.defect.as_str() {
            "one-sided" => out.force(1, pull),
            "without-couple" => {
                out.force(0, at.frames()[0].x() * tension);
                out.force(1, at.frames()[0].x() * -tension);
            }
            "along-the-ground" => {
                let mut along = pull;
                along.y = S::zero();
                out.force_pair(0, 1, along);
            }
            "number-differs" if is::<S, f64>() => out.force_pair(0, 1, pull * S::from(1.001)),
            _ => out.force_pair(0, 1, pull),
        }
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let angle = at.configuration.angle_about_z(0, 0, 1);
        let principal = j.x().dot(&i.y()).atan2(j.x().dot(&i.x()));
        out.push(if self.has("loses-turns") { principal } else { angle });
        if !self.has("unwritten-channel") {
            out.push(length(j.position - i.position));
        }
    }
    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let stretch = length(at.frames()[1].position - at.frames()[0].position) - 0.5;
        let half = if self.has("half-forgotten") { 1.0 } else { 0.5 };
        Some(stretch * stretch * (half * STIFFNESS))
    }
    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.has("heat-forgotten") {
            return None;
        }
        Some(Self::speed(at).powi(2) * self.damping())
    }
}

#[test]
fn each_defect_of_a_force_is_named() {
    let defects: [(&str, &[Check]); 10] = [
        ("none", &[]),
        ("unwritten-channel", &[Check::UnwrittenOutput]),
        ("half-forgotten", &[Check::PowerBalance]),
        ("heat-forgotten", &[Check::PowerBalance]),
        ("drives", &[Check::DissipationSign]),
        ("one-sided", &[Check::BodySwap, Check::ThirdLaw, Check::PowerBalance]),
        ("without-couple", &[Check::BodySwap, Check::ThirdLaw, Check::PowerBalance]),
        ("along-the-ground", &[Check::FrameInvariance, Check::BodySwap, Check::PowerBalance]),
        ("number-differs", &[Check::Recording, Check::Jacobian, Check::PowerBalance]),
        ("loses-turns", &[Check::AngleContinuity]),
    ];
    for (defect, expected) in defects {
        let options = Options { symmetric: Some(true), count: Some(&allocations_of), ..Options::default() };
        let report = examine_force_with::<Strut>(&format!("defect = '{defect}'"), &options);
        assert_found(&report, expected, defect);
    }
}

#[test]
fn what_an_author_exempts_is_not_examined() {
    let options = Options { internal: false, accounted: false, invariant: false, ..Options::default() };
    for defect in ["one-sided", "without-couple", "along-the-ground", "half-forgotten"] {
        let report = examine_force_with::<Strut>(&format!("defect = '{defect}'"), &options);
        assert_found(&report, &[], defect);
        assert!(!report.examined.contains(&Check::ThirdLaw) && report.examined.contains(&Check::Jacobian), "{report}");
    }
}

/// A first-order lag of a signal.
struct Lag {
    defect: String,
}

impl Element for Lag {
    const NAME: &'static str = "lag";
    const SUMMARY: &'static str = "first-order lag";
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = Defect;
    fn new(p: Defect) -> Result<Self, ParamError> {
        Ok(Self { defect: p.defect })
    }
}

impl Control for Lag {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("value", "", "what is followed")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "follows the value")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("level", "", "the output")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        if self.defect != "unwritten-output" {
            out.push(at.states[0]);
        }
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let rate = (at.inputs[0] - at.states[0]) / 0.3;
        match self.defect.as_str() {
            "unwritten-rate" => {}
            "not-a-number" => out.push((at.states[0] - 10.0).sqrt()),
            "recording-differs" if is::<S, Recorded>() => out.push(rate * 2.0),
            _ => out.push(rate),
        }
    }
}

#[test]
fn each_defect_of_a_control_element_is_named() {
    let defects: [(&str, &[Check]); 5] = [
        ("none", &[]),
        ("unwritten-output", &[Check::UnwrittenOutput]),
        ("unwritten-rate", &[Check::UnwrittenOutput]),
        ("not-a-number", &[Check::UnwrittenOutput]),
        ("recording-differs", &[Check::Recording, Check::Jacobian]),
    ];
    for (defect, expected) in defects {
        assert_found(&examine_control::<Lag>(&format!("defect = '{defect}'")), expected, defect);
    }
}

#[test]
fn a_report_names_element_check_and_numbers() {
    let report = thread::<false>("wrong-sign");
    let text = report.to_string();
    assert!(
        text.starts_with("thread: 1 of 17 checks failed\n  free-motion      row `advance` is not zero where `pose`"),
        "{text}"
    );
    assert!(std::panic::catch_unwind(|| report.assert_sound()).is_err());
    let sound = thread::<false>("none");
    assert_eq!(sound.to_string(), "thread: 0 of 17 checks failed");
    let named: Vec<String> = sound.examined.iter().map(ToString::to_string).collect();
    assert_eq!(named.len(), 17);
    assert!(named.contains(&"mobility-rank".into()) && !named.contains(&"dissipation-sign".into()));
}
