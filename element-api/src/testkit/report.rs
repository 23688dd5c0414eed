//! What the kit found: [`Check`]s by name, [`Finding`]s, the [`Report`], and what an author says about the element.

use std::fmt;

use crate::testkit::{Random, Setting};

/// A property that every element must have, or that the author claims for this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Check {
    /// The element can be built, recorded and evaluated; the recording gives what the equations give with plain numbers.
    Recording,
    /// First derivatives are the five-point differences of the values.
    Jacobian,
    /// Derivatives of the recording by dual numbers (jets) are those that the element gives with jets.
    DualNumbers,
    /// The second derivative along a motion is the five-point difference of the values.
    Gamma,
    /// Moving the whole world changes no row, coordinate or channel, and carries forces and torques along.
    FrameInvariance,
    /// Exchanging the two frames changes nothing but the order: a joint constrains the same relative motions, a force
    /// element exchanges its loads.
    BodySwap,
    /// Action equals reaction: loads on all frames (of each row of a joint) have no resultant force and moment.
    ThirdLaw,
    /// Joint: the reaction of a row does no work but that of its explicit dependence on time. Force element: the power of
    /// the loads is -dV/dt - dissipation.
    PowerBalance,
    /// Dissipation is not negative.
    DissipationSign,
    /// Free motions leave the rows at zero: every pose of the mobility, or, without one, a tangent of an assembled
    /// configuration up to its curvature.
    FreeMotion,
    /// The rows leave as many freedoms as the mobility has coordinates.
    MobilityRank,
    /// Every declared result is given, and is a number.
    UnwrittenOutput,
    /// Evaluating again gives the same bits, and leaves the memory alone.
    Repeatability,
    /// What is saved and loaded into a new instance makes it behave like the old one.
    SaveLoad,
    /// Two threads that record and evaluate at the same time get the same bits.
    TwoThreads,
    /// Evaluations after the first allocate no memory.
    Allocation,
    /// Angles that follow a frame's rotation follow it over a thousand turns.
    AngleContinuity,
    /// Every row of a joint between bodies depends on at least two of its frames, and every frame matters.
    Dependence,
}

impl Check {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::Recording,
        Self::Jacobian,
        Self::DualNumbers,
        Self::Gamma,
        Self::FrameInvariance,
        Self::BodySwap,
        Self::ThirdLaw,
        Self::PowerBalance,
        Self::DissipationSign,
        Self::FreeMotion,
        Self::MobilityRank,
        Self::UnwrittenOutput,
        Self::Repeatability,
        Self::SaveLoad,
        Self::TwoThreads,
        Self::Allocation,
        Self::AngleContinuity,
        Self::Dependence,
    ];

    /// What is to hold, in a few words.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Recording => "it can be made and recorded, and the recording gives what plain numbers give",
            Self::Jacobian => "first derivatives are those of the values",
            Self::DualNumbers => "derivatives of the recording are those of the element",
            Self::Gamma => "the second derivative along a motion is that of the values",
            Self::FrameInvariance => "it does not matter where in the world the bodies are",
            Self::BodySwap => "the two bodies may be exchanged",
            Self::ThirdLaw => "action equals reaction",
            Self::PowerBalance => "loads do the work that they should: none, or what the energies say",
            Self::DissipationSign => "dissipation is not negative",
            Self::FreeMotion => "what the joint leaves free leaves its rows at zero",
            Self::MobilityRank => "the rows leave as many freedoms as the mobility has",
            Self::UnwrittenOutput => "every declared result is given, and is a number",
            Self::Repeatability => "the same inputs give the same bits",
            Self::SaveLoad => "a saved memory makes another instance the same",
            Self::TwoThreads => "two threads do not disturb each other",
            Self::Allocation => "evaluations allocate no memory",
            Self::AngleContinuity => "angles are counted over many turns",
            Self::Dependence => "every row depends on the bodies that it connects",
        }
    }

    /// The name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Recording => "recording",
            Self::Jacobian => "jacobian",
            Self::DualNumbers => "dual-numbers",
            Self::Gamma => "gamma",
            Self::FrameInvariance => "frame-invariance",
            Self::BodySwap => "body-swap",
            Self::ThirdLaw => "third-law",
            Self::PowerBalance => "power-balance",
            Self::DissipationSign => "dissipation-sign",
            Self::FreeMotion => "free-motion",
            Self::MobilityRank => "mobility-rank",
            Self::UnwrittenOutput => "unwritten-output",
            Self::Repeatability => "repeatability",
            Self::SaveLoad => "save-load",
            Self::TwoThreads => "two-threads",
            Self::Allocation => "allocation",
            Self::AngleContinuity => "angle-continuity",
            Self::Dependence => "dependence",
        }
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A property that the element lacks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Which property.
    pub check: Check,
    /// Where it was missed, with numbers.
    pub detail: String,
}

/// The outcome of an examination: all properties are looked at, not only up to the first that fails.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// Name of the element.
    pub element: String,
    /// Properties that were examined, in the order of [`Check`].
    pub examined: Vec<Check>,
    /// What was found; at most three of each kind.
    pub findings: Vec<Finding>,
}

/// Most findings of one kind that are kept.
const MOST: usize = 3;

impl Report {
    pub(super) fn new(element: &str) -> Self {
        Self { element: element.into(), examined: Vec::new(), findings: Vec::new() }
    }

    /// Whether nothing was found.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.findings.is_empty()
    }

    /// The properties that the element lacks, each once, in the order of [`Check`].
    #[must_use]
    pub fn failed(&self) -> Vec<Check> {
        let mut failed: Vec<Check> = self.findings.iter().map(|finding| finding.check).collect();
        failed.sort_unstable();
        failed.dedup();
        failed
    }

    /// # Panics
    /// With the whole report, when something was found.
    pub fn assert_sound(&self) {
        assert!(self.is_sound(), "{self}");
    }

    /// Notes that a property was looked at.
    pub(super) fn examine(&mut self, check: Check) {
        if let Err(place) = self.examined.binary_search(&check) {
            self.examined.insert(place, check);
        }
    }

    pub(super) fn add(&mut self, check: Check, detail: impl Into<String>) {
        let finding = Finding { check, detail: detail.into() };
        let of_kind = self.findings.iter().filter(|known| known.check == check).count();
        if of_kind < MOST && !self.findings.contains(&finding) {
            self.findings.push(finding);
        }
    }

    /// Notes something about `subject`, once.
    pub(super) fn add_about(&mut self, check: Check, subject: &str, detail: &str) {
        let known = |finding: &Finding| finding.check == check && finding.detail.starts_with(&format!("{subject}: "));
        if !self.findings.iter().any(known) {
            self.add(check, format!("{subject}: {detail}"));
        }
    }

    /// Notes a deviation of `value` from `expected` by more than `allowed`; not-a-number always deviates.
    pub(super) fn compare(&mut self, check: Check, value: f64, expected: f64, allowed: f64, what: impl Fn() -> String) {
        self.compare_in_words(check, (value, expected), allowed, ("found", "expected"), what);
    }

    /// [`Report::compare`] with other words in front of the two numbers.
    pub(super) fn compare_in_words(
        &mut self,
        check: Check,
        (value, expected): (f64, f64),
        allowed: f64,
        words: (&str, &str),
        what: impl Fn() -> String,
    ) {
        if deviates(value, expected, allowed) {
            let (value, expected) = pair(value, expected);
            self.add_about(check, &what(), &format!("{} {value}, {} {expected}", words.0, words.1));
        }
    }
}

/// Whether a value is off by more than `allowed`, or not a number.
pub(super) fn deviates(value: f64, expected: f64, allowed: f64) -> bool {
    let deviation = (value - expected).abs();
    deviation.is_nan() || deviation > allowed
}

/// A number with four digits.
pub(super) fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-3..1e5).contains(&rounded.abs()) { rounded.to_string() } else { format!("{rounded:e}") }
}

/// Two different numbers, with as many digits as it takes to see that.
pub(super) fn pair(a: f64, b: f64) -> (String, String) {
    let (short_a, short_b) = (number(a), number(b));
    if short_a == short_b { (format!("{a:e}"), format!("{b:e}")) } else { (short_a, short_b) }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} of {} checks failed", self.element, self.failed().len(), self.examined.len())?;
        self.findings.iter().try_for_each(|finding| write!(f, "\n  {:<16} {}", finding.check, finding.detail))
    }
}

/// Makes a random setting; angle references, states, and signals that are left out are filled in afterwards.
pub type MakeSetting<'a> = &'a dyn Fn(&mut Random) -> Setting;

/// Counts the memory allocations of what it is given to run, on its own thread.
pub type CountAllocations<'a> = &'a dyn Fn(&mut dyn FnMut()) -> usize;

/// What an author says about an element, as far as it differs from what is usual.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Whether the two frames may be exchanged ([`Check::BodySwap`]). `None`: expected of joints with a mobility (that do not turn freely) between
    /// two frames, and not examined otherwise.
    pub symmetric: Option<bool>,
    /// Whether action equals reaction ([`Check::ThirdLaw`]). Not so for a force that comes from outside.
    pub internal: bool,
    /// Whether nothing depends on where the ground frame is ([`Check::FrameInvariance`]).
    pub invariant: bool,
    /// Whether the rows of a joint must not depend on time. `None`: expected of joints with a mobility.
    pub scleronomic: Option<bool>,
    /// Whether potential and dissipation, if given, must account for the power of a force element
    /// ([`Check::PowerBalance`]).
    pub accounted: bool,
    /// Settings in which all checks are made, for an element that is not defined everywhere. `None`: frames anywhere.
    pub anywhere: Option<MakeSetting<'a>>,
    /// Settings in which an energy balance is made and angles are followed, and from which a joint is assembled, for an
    /// element that is made for axes kept aligned by a joint. `None`: as `anywhere`; for angles, all frames on one axis.
    pub aligned: Option<MakeSetting<'a>>,
    /// Counts allocations ([`Check::Allocation`]); without it they are not examined.
    pub count: Option<CountAllocations<'a>>,
    /// Number of random settings of each check.
    pub tries: usize,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            symmetric: None,
            internal: true,
            invariant: true,
            scleronomic: None,
            accounted: true,
            anywhere: None,
            aligned: None,
            count: None,
            tries: 20,
        }
    }
}

impl fmt::Debug for Options<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Options")
            .field("symmetric", &self.symmetric)
            .field("internal", &self.internal)
            .field("invariant", &self.invariant)
            .field("scleronomic", &self.scleronomic)
            .field("accounted", &self.accounted)
            .field("anywhere", &self.anywhere.is_some())
            .field("aligned", &self.aligned.is_some())
            .field("count", &self.count.is_some())
            .field("tries", &self.tries)
            .finish()
    }
}
