//! An examination: one element, its report, and the checks that all kinds of elements share.

mod behaviour;

use std::collections::HashMap;
use std::sync::Barrier;

use crate::adapt;
use crate::descriptor::{Descriptor, GLYPHS, Kind};
use crate::element::{Constraint, Control, Force, Reaction};
use crate::fence::fenced;
use crate::geometry::Vec3;
use crate::recording::{Recording, Role};
use crate::set::{Batch, CreateError, ElementClass, Wanted};
use crate::testkit::differences::DIFFERENCE;
use crate::testkit::joints::Mobility;
use crate::testkit::report::{Check, Options, Report, deviates, number};
use crate::testkit::setting::{Random, Setting, on_common_axis};
use crate::testkit::variation::Variation;
use crate::testkit::{Probe, acting, complete, joints};

/// Allowed rounding, relative to 1 + size.
pub(super) const ROUNDING: f64 = 1e-12;
/// Angles are followed over this many turns.
const TURNS: f64 = 1000.0;

/// Examines a joint with the parameters written as TOML text in SI units.
///
/// # Panics
/// When the text is not TOML, has keys that the element doesn't know, or numbers outside their ranges.
#[must_use]
pub fn examine_joint<T: Constraint>(params: &str) -> Report {
    examine_joint_with::<T>(params, &Options::default())
}

/// [`examine_joint`] with what its author says about it.
///
/// # Panics
/// As [`examine_joint`].
#[must_use]
pub fn examine_joint_with<T: Constraint>(params: &str, options: &Options<'_>) -> Report {
    let (report, examination) = Examination::begin(adapt::joint::<T>(), params, options);
    let Some(mut x) = examination else { return report };
    let mobility = joints::mobility::<T>(params);
    joints::examine(&mut x, mobility.as_ref());
    x.examine_what_all_have(mobility.as_ref());
    x.judged()
}

/// Examines a force element; see [`examine_joint`].
///
/// # Panics
/// As [`examine_joint`].
#[must_use]
pub fn examine_force<T: Force>(params: &str) -> Report {
    examine_force_with::<T>(params, &Options::default())
}

/// [`examine_force`] with what its author says about it.
///
/// # Panics
/// As [`examine_joint`].
#[must_use]
pub fn examine_force_with<T: Force>(params: &str, options: &Options<'_>) -> Report {
    examine_class(adapt::force::<T>(), params, options)
}

/// Examines a control element; see [`examine_joint`].
///
/// # Panics
/// As [`examine_joint`].
#[must_use]
pub fn examine_control<T: Control>(params: &str) -> Report {
    examine_control_with::<T>(params, &Options::default())
}

/// [`examine_control`] with what its author says about it.
///
/// # Panics
/// As [`examine_joint`].
#[must_use]
pub fn examine_control_with<T: Control>(params: &str, options: &Options<'_>) -> Report {
    examine_class(adapt::control::<T>(), params, options)
}

/// Examines an element of any class, for example one that was loaded from a library; see [`examine_joint`].
///
/// # Panics
/// As [`examine_joint`].
#[must_use]
pub fn examine_class(class: Box<dyn ElementClass>, params: &str, options: &Options<'_>) -> Report {
    let joint = class.descriptor().kind == Kind::Joint;
    let (report, examination) = Examination::begin(class, params, options);
    let Some(mut x) = examination else { return report };
    let mobility = joints::recorded_mobility(&x.probe);
    if joint {
        joints::examine(&mut x, mobility.as_ref());
    } else {
        acting::examine(&mut x);
    }
    x.examine_what_all_have(mobility.as_ref());
    x.judged()
}

/// One element under examination.
pub(super) struct Examination<'a> {
    class: Box<dyn ElementClass>,
    params: &'a str,
    pub(super) probe: Probe,
    pub(super) options: &'a Options<'a>,
    pub(super) report: Report,
    /// Begins anew with every check, so that one does not depend on another.
    pub(super) random: Random,
    /// Per value and variation, whether its differences settled in some setting of the check under way.
    settled: HashMap<(usize, Variation), bool>,
}

impl<'a> Examination<'a> {
    /// What was found but for the checks that its author says do not apply.
    pub(super) fn judged(self) -> Report {
        let Self { class, mut report, .. } = self;
        for (name, _) in &class.descriptor().exempt {
            match Check::ALL.into_iter().find(|check| check.name() == name) {
                Some(check) => report.findings.retain(|finding| finding.check != check),
                None => report.add(Check::Recording, format!("EXEMPT names `{name}`, which is no check")),
            }
        }
        report
    }

    /// Builds the element. When that fails, or results are missing, there is nothing more to examine.
    pub(super) fn begin(
        class: Box<dyn ElementClass>,
        params: &'a str,
        options: &'a Options<'a>,
    ) -> (Report, Option<Self>) {
        let mut report = Report::new(&class.descriptor().name);
        // An author's mistake in the text is not one of the element.
        let table = complete(&class.descriptor().params, params);
        report.examine(Check::Recording);
        report.examine(Check::UnwrittenOutput);
        let glyph = &class.descriptor().glyph;
        if !glyph.is_empty() && !GLYPHS.contains(&glyph.as_str()) {
            report.add(Check::Recording, format!("GLYPH is `{glyph}`; pictures know {}", GLYPHS.join(", ")));
        }
        match fenced(|| Probe::from_table(class.as_ref(), &table)).unwrap_or_else(|text| Err(CreateError::Fault(text)))
        {
            Ok(probe) => {
                let random = Random::new(0);
                let mut x = Self { class, params, probe, options, report, random, settled: HashMap::new() };
                let checks = [Check::Recording, Check::UnwrittenOutput];
                x.each_setting(&checks, |x, setting| x.results_are_given(setting));
                if x.report.is_sound() { (x.report.clone(), Some(x)) } else { (x.report, None) }
            }
            Err(error) => {
                let text = match error {
                    CreateError::Parameter(error) => format!("the parameters are refused: {error}"),
                    CreateError::Fault(text) => text,
                };
                // The adapter's words for a result that is declared and not given.
                let check = if text.starts_with("declares ") { Check::UnwrittenOutput } else { Check::Recording };
                report.add(check, text);
                (report, None)
            }
        }
    }

    fn examine_what_all_have(&mut self, mobility: Option<&Mobility>) {
        self.each_setting(&[Check::Repeatability], |x, setting| x.repeatability(setting));
        // What is not repeatable is not expected to be the same after loading either.
        if !self.report.failed().contains(&Check::Repeatability) {
            self.fenced(&[Check::SaveLoad], Self::save_load);
        }
        self.fenced(&[Check::TwoThreads], Self::two_threads);
        if self.options.count.is_some() {
            self.fenced(&[Check::Allocation], Self::allocation);
        }
        if self.probe.descriptor.angles > 0 {
            self.fenced(&[], |x| x.angle_continuity(mobility));
        }
    }

    /// Runs checks; a panic is a finding of the first of them, or of none in particular.
    pub(super) fn fenced(&mut self, checks: &[Check], body: impl FnOnce(&mut Self)) {
        let first = checks.first().copied().unwrap_or(Check::AngleContinuity);
        checks.iter().for_each(|check| self.report.examine(*check));
        self.random = Random::new(1 + first as u64);
        self.settled.clear();
        if let Err(text) = fenced(|| body(self)) {
            let text = match self.probe.take_fault() {
                Some(fault) => format!("fails when it is called: {fault}"),
                None => text,
            };
            self.report.add(first, text);
        }
        // An author who chooses the settings may have chosen a kink; then only something must have settled.
        let chosen = self.options.anywhere.is_some() && self.settled.values().any(|settled| *settled);
        let missed = self.settled.iter().filter(|(_, settled)| !chosen && !**settled);
        let text = |(value, variation): &(usize, Variation)| {
            format!(
                "{} over {}: in no setting is a step small enough for differences",
                self.name(*value),
                variation.text(&self.probe.descriptor)
            )
        };
        let mut missed: Vec<String> = missed.map(|(of, _)| text(of)).collect();
        missed.sort_unstable();
        missed.into_iter().for_each(|text| self.report.add(first, text));
    }

    /// Runs checks on random settings.
    pub(super) fn each_setting(&mut self, checks: &[Check], one: impl Fn(&mut Self, &Setting)) {
        self.fenced(checks, |x| {
            for _ in 0..x.options.tries {
                let setting = x.setting();
                one(x, &setting);
            }
        });
    }

    /// A random setting in which the element is defined.
    pub(super) fn setting(&mut self) -> Setting {
        match self.options.anywhere {
            Some(make) => self.completed(make),
            None => {
                let mut setting = self.probe.random_setting(&mut self.random);
                self.disturb_states(&mut setting);
                setting
            }
        }
    }

    /// A random setting for what holds with aligned axes only. Where nobody says which, the two frames of a force element that follows
    /// an angle between them have one z axis.
    pub(super) fn aligned_setting(&mut self) -> Setting {
        if let Some(make) = self.options.aligned {
            return self.completed(make);
        }
        let mut setting = self.setting();
        let descriptor = &self.probe.descriptor;
        if descriptor.kind == Kind::Force && descriptor.angles > 0 && setting.frames.len() == 2 {
            setting.frames[1] =
                on_common_axis(&setting.frames[0], self.random.between(-2.0, 2.0), self.random.between(-1.0, 1.0));
            self.probe.refer(&mut setting);
        }
        setting
    }

    fn completed(&mut self, make: &dyn Fn(&mut Random) -> Setting) -> Setting {
        let mut setting = make(&mut self.random);
        while setting.signals.len() < self.probe.descriptor.inputs.len() {
            setting.signals.push(self.random.between(-1.0, 1.0));
        }
        while setting.reactions.len() < self.probe.descriptor.joints.len() {
            setting.reactions.push(Reaction { force: self.random.vector(1.0), torque: self.random.vector(1.0) });
        }
        self.probe.settle(&mut setting);
        self.disturb_states(&mut setting);
        setting
    }

    /// States a little off their start, where equations may have a kink.
    fn disturb_states(&mut self, setting: &mut Setting) {
        for state in &mut setting.states {
            *state += 0.01 * (1.0 + state.abs()) * self.random.between(0.0, 1.0);
        }
        self.probe.refer(setting);
    }

    /// What a result is called.
    pub(super) fn name(&self, k: usize) -> String {
        match self.probe.descriptor.kind {
            Kind::Joint => value_name(&self.probe.recording, k, &self.probe.descriptor),
            Kind::Force | Kind::Control => acting::value_name(&self.probe, k),
        }
    }

    fn results_are_given(&mut self, setting: &Setting) {
        let descriptor = &self.probe.descriptor;
        let missing = |value: &f64| !value.is_finite();
        if descriptor.kind == Kind::Joint {
            let values = self.probe.joint_plain(setting);
            let names = values.iter().enumerate().filter(|(_, value)| missing(value));
            for (k, value) in names {
                let subject = format!("{} is not given, or not a number", self.name(k));
                self.report.add_about(
                    Check::UnwrittenOutput,
                    &subject,
                    &format!("{value}{}", place(descriptor, setting)),
                );
            }
            return;
        }
        let found = self.probe.force_values(setting);
        let loads: Vec<f64> = found.forces.iter().chain(&found.torques).flat_map(|v| v.iter().copied()).collect();
        for (what, list) in [
            ("load component", &loads),
            ("rate of state", &found.rates),
            ("discrete state", &found.memory),
            ("channel", &found.channels),
        ] {
            if let Some(k) = list.iter().position(missing) {
                let named = match what {
                    "channel" => descriptor.channels.get(k),
                    "rate of state" => descriptor.states.get(k),
                    _ => None,
                };
                let subject = match named {
                    Some(named) => format!("{what} `{}` is not given, or not a number", named.name),
                    None => format!("{what} {k} is not given, or not a number"),
                };
                let text = format!("{}{}", list[k], place(descriptor, setting));
                self.report.add_about(Check::UnwrittenOutput, &subject, &text);
            }
        }
    }

    /// The recording's results against `expected` (without angles) and `angles`.
    pub(super) fn compare_recording(&mut self, setting: &Setting, expected: &[f64], sizes: &[f64], angles: &[f64]) {
        if self.probe.descriptor.opaque {
            return;
        }
        let mut count = 0;
        for (role, value) in self.probe.recorded(setting, &[]) {
            let (expected, size) = match role {
                // These are never evaluated otherwise.
                Role::PosePosition(_)
                | Role::PoseRotation(_)
                | Role::VelocityResidual(_)
                | Role::SamplePeriod
                | Role::Unilateral(_)
                | Role::SticksWith(_)
                | Role::Limit(_)
                | Role::SlidesWith(_)
                | Role::Check(_)
                | Role::Kinetic
                | Role::Guess(_) => continue,
                Role::Condition(_) if self.probe.descriptor.kind == Kind::Joint => continue,
                Role::StateRate(_) | Role::NextDiscrete(_) | Role::Channel(_)
                    if self.probe.descriptor.kind == Kind::Joint =>
                {
                    continue;
                }
                Role::Angle(k) => (angles[k as usize], angles[k as usize].abs()),
                _ => {
                    count += 1;
                    let k = count - 1;
                    (expected.get(k).copied().unwrap_or(f64::NAN), sizes.get(k).copied().unwrap_or(0.0))
                }
            };
            if deviates(value, expected, ROUNDING * (1.0 + size)) {
                let name = match role {
                    Role::Angle(k) => format!("angle {k}"),
                    _ => self.name(count - 1),
                };
                let words = ("the recording gives", "plain numbers give");
                self.report.compare_in_words(Check::Recording, (value, expected), 0.0, words, || name.clone());
            }
        }
        if count != expected.len() {
            let text = format!("{count} results are recorded, {} are given with plain numbers", expected.len());
            self.report.add(Check::Recording, text);
        }
    }

    /// Derivatives against differences where these have settled.
    pub(super) fn compare_slopes(
        &mut self,
        check: Check,
        derivatives: &[f64],
        differences: &[Option<f64>],
        sizes: &[f64],
        variation: Variation,
    ) {
        for (k, (derivative, difference)) in derivatives.iter().zip(differences).enumerate() {
            let what = |x: &Self| {
                let (name, over) = (x.name(k), variation.text(&x.probe.descriptor));
                match variation {
                    Variation::Motion => format!("second derivative of {name} along {over}"),
                    _ => format!("derivative of {name} for {over}"),
                }
            };
            match difference {
                Some(difference) => {
                    self.settled.insert((k, variation), true);
                    let allowed = DIFFERENCE * (1.0 + difference.abs() + sizes[k]);
                    if deviates(*derivative, *difference, allowed) {
                        let (what, words) = (what(self), ("the element gives", "differences of its values give"));
                        let pair = (*derivative, *difference);
                        self.report.compare_in_words(check, pair, allowed, words, || what.clone());
                    }
                }
                None if derivative.is_finite() => {
                    self.settled.entry((k, variation)).or_insert(false);
                }
                None => {
                    let what = what(self);
                    self.report.add_about(check, &what, &format!("the element gives {derivative}"));
                }
            }
        }
    }

    /// Loads on all frames against the balance of forces and moments.
    pub(super) fn compare_resultants(
        &mut self,
        setting: &Setting,
        loads: &[(Vec3<f64>, Vec3<f64>)],
        of: impl Fn() -> String,
    ) {
        let arms = setting.frames.iter().map(|frame| frame.position);
        let moments: Vec<Vec3<f64>> = arms.zip(loads).map(|(arm, (force, torque))| arm.cross(force) + torque).collect();
        let size: f64 = loads.iter().map(|(f, m)| f.norm() + m.norm()).sum::<f64>()
            + moments.iter().map(|moment| moment.norm()).sum::<f64>();
        let force = loads.iter().map(|(force, _)| force).sum::<Vec3<f64>>().norm();
        let moment = moments.iter().sum::<Vec3<f64>>().norm();
        let allowed = ROUNDING * (1.0 + size);
        // A row has forces per unit of its reaction.
        let joint = self.probe.descriptor.kind == Kind::Joint;
        let (newton, newton_metre) = if joint { ("", "") } else { (" N", " N m") };
        if deviates(force, 0.0, allowed) {
            let subject = format!("{}the forces on its bodies do not add up to zero", of());
            self.report.add_about(
                Check::ThirdLaw,
                &subject,
                &format!("a resultant of {}{newton} remains", number(force)),
            );
        } else if deviates(moment, 0.0, allowed) {
            let subject = format!("{}the torques are not the moment of the forces", of());
            let advice =
                if joint { "" } else { "; forces that are not on one line need a couple (`force_pair` adds it)" };
            let text = format!("a resultant of {}{newton_metre} remains{advice}", number(moment));
            self.report.add_about(Check::ThirdLaw, &subject, &text);
        }
    }
}

/// Where the frames are, for a finding that depends on it.
fn place(descriptor: &Descriptor, setting: &Setting) -> String {
    let (Some(base), Some(other)) = (setting.frames.first(), setting.frames.get(1)) else { return String::new() };
    let (Some(first), Some(second)) = (descriptor.frames.first(), descriptor.frames.get(1)) else {
        return String::new();
    };
    let d = base.rotation.tr_mul(&(other.position - base.position));
    let [x, y, z] = [d.x, d.y, d.z].map(number);
    format!(", for example with frame `{}` at ({x}, {y}, {z}) of frame `{}`", second.name, first.name)
}

/// What a row or coordinate is called.
pub(super) fn value_name(recording: &Recording, k: usize, descriptor: &Descriptor) -> String {
    match recording.outputs.get(k).map(|output| output.role) {
        Some(Role::Residual(row)) => format!("row `{}`", descriptor.rows[row as usize]),
        Some(Role::Coordinate(k)) => format!("coordinate `{}`", descriptor.channels[k as usize].name),
        _ => format!("value {k}"),
    }
}

/// Numbers for a comparison that sees every bit, also of what is not a number.
fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}
