//! Checks of joints.

use crate::element::Constraint;
use crate::geometry::{Frame, Mat3, Pose, Vec3};
use crate::params::Parameters;
use crate::recording::Role;
use crate::testkit::assembly::{free_directions, rank, rank_at};
use crate::testkit::differences::{DIFFERENCE, curvatures, slopes};
use crate::testkit::examine::{Examination, ROUNDING, value_name};
use crate::testkit::report::{Check, deviates, number};
use crate::testkit::variation::Variation;
use crate::testkit::{JointValues, Probe, Random, Setting, complete, interpret, interpret_with, velocity_rows};

/// The pose of frame 1 in frame 0 for joint coordinates.
type PoseOf = Box<dyn Fn(&[f64]) -> Pose<f64>>;

/// The mobility of a joint.
pub(super) struct Mobility {
    /// Number of joint coordinates.
    pub(super) count: usize,
    pose: PoseOf,
}

impl Mobility {
    /// Where frame 1 is for joint coordinates `q`.
    pub(super) fn place(&self, base: &Frame<f64>, q: &[f64]) -> Frame<f64> {
        let pose = (self.pose)(q);
        Frame { position: base.position + base.rotation * pose.position, rotation: base.rotation * pose.rotation }
    }
}

/// What an element offers.
pub(super) fn mobility<T: Constraint>(params: &str) -> Option<Mobility> {
    let count = T::MOBILITY?;
    let element = T::Parameters::read(&complete(&T::Parameters::specs(), params)).and_then(T::new).ok()?;
    Some(Mobility { count, pose: Box::new(move |q| element.pose(q)) })
}

/// What a recording offers.
pub(super) fn recorded_mobility(probe: &Probe) -> Option<Mobility> {
    let count = probe.descriptor.mobility?;
    let recording = probe.recording.clone();
    recording.output(Role::PosePosition(0))?;
    let setting = probe.random_setting(&mut Random::new(0));
    let pose = move |q: &[f64]| {
        let mut pose = Pose { position: Vec3::zeros(), rotation: Mat3::zeros() };
        for (role, value) in interpret(&recording, &setting, q) {
            match role {
                Role::PosePosition(k) => pose.position[k as usize] = value,
                Role::PoseRotation(k) => pose.rotation[(k as usize / 3, k as usize % 3)] = value,
                _ => {}
            }
        }
        pose
    };
    Some(Mobility { count, pose: Box::new(pose) })
}

/// All checks that only joints have.
pub(super) fn examine(x: &mut Examination<'_>, mobility: Option<&Mobility>) {
    x.each_setting(&[Check::Recording], |x, setting| recording(x, setting));
    x.each_setting(&[Check::Jacobian], |x, setting| jacobian(x, setting));
    if x.options.internal && x.probe.descriptor.frames.len() > 1 {
        x.fenced(&[Check::Dependence], dependence);
    }
    if !x.probe.descriptor.opaque {
        x.each_setting(&[Check::DualNumbers], |x, setting| dual_numbers(x, setting));
    }
    x.each_setting(&[Check::Gamma], |x, setting| gamma(x, setting));
    if x.options.invariant {
        x.each_setting(&[Check::FrameInvariance], |x, setting| {
            frame_invariance(x, setting);
            velocity_rows::frame_invariance(x, setting);
        });
    }
    if x.options.internal {
        x.each_setting(&[Check::ThirdLaw], |x, setting| {
            third_law(x, setting);
            velocity_rows::third_law(x, setting);
        });
    }
    let scleronomic = x.options.scleronomic.unwrap_or(mobility.is_some());
    x.each_setting(&[Check::PowerBalance], |x, setting| power_balance(x, setting, scleronomic));
    let two_frames = x.probe.descriptor.frames.len() == 2;
    if two_frames && x.options.symmetric.unwrap_or(mobility.is_some() && !x.probe.descriptor.turns_freely) {
        x.fenced(&[Check::BodySwap], |x| each_assembled(x, Check::BodySwap, body_swap));
    }
    match mobility {
        Some(mobility) => x.fenced(&[Check::FreeMotion, Check::MobilityRank], |x| free_poses(x, mobility)),
        None => x.fenced(&[Check::FreeMotion], |x| each_assembled(x, Check::FreeMotion, tangent_motion)),
    }
}

fn recording(x: &mut Examination<'_>, setting: &Setting) {
    let found = x.probe.joint_values(setting);
    x.compare_recording(setting, &found.values, &sizes(&found.values), &found.angles);
}

fn jacobian(x: &mut Examination<'_>, setting: &Setting) {
    let found = x.probe.joint_values(setting);
    for variation in Variation::all(setting, false) {
        let Some(derivatives) = first_derivatives(&found, variation) else { continue };
        let differences = slopes(|h| x.probe.joint_plain(&variation.step(setting, h)), &sizes(&found.values));
        x.compare_slopes(Check::Jacobian, &derivatives, &differences, &sizes(&found.values), variation);
    }
}

/// What the element says about a variation.
fn first_derivatives(found: &JointValues, variation: Variation) -> Option<Vec<f64>> {
    match variation {
        Variation::Time => Some(found.time_derivative.clone()),
        Variation::Frame(frame, direction) => {
            Some(found.jacobian.iter().map(|row| row[6 * frame + direction]).collect())
        }
        _ => None,
    }
}

/// What the values depend on in any of the settings.
fn dependence(x: &mut Examination<'_>) {
    let count = x.probe.descriptor.frames.len();
    let mut uses: Vec<Vec<bool>> = Vec::new();
    let mut of_velocities: Vec<(String, Vec<bool>)> = Vec::new();
    let mut rows = 0;
    for _ in 0..x.options.tries {
        let setting = x.setting();
        let found = x.probe.joint_values(&setting);
        rows = found.rows;
        uses.resize(found.jacobian.len(), vec![false; count]);
        for (seen, derivatives) in uses.iter_mut().zip(&found.jacobian) {
            for (seen, part) in seen.iter_mut().zip(derivatives.chunks_exact(6)) {
                *seen |= part.iter().any(|derivative| *derivative != 0.0);
            }
        }
        for (k, (name, loads)) in x.probe.velocity_loads(&setting).into_iter().enumerate() {
            if of_velocities.len() <= k {
                of_velocities.push((name, vec![false; count]));
            }
            for (seen, (force, torque)) in of_velocities[k].1.iter_mut().zip(loads) {
                *seen |= force.iter().chain(&torque).any(|load| *load != 0.0);
            }
        }
    }
    let names: Vec<String> = x.probe.descriptor.frames.iter().map(|frame| format!("`{}`", frame.name)).collect();
    let mut listed: Vec<(String, Vec<bool>)> =
        uses[..rows].iter().enumerate().map(|(row, seen)| (x.name(row), seen.clone())).collect();
    listed.extend(of_velocities.iter().cloned());
    for (row, seen) in &listed {
        let used: Vec<&str> =
            names.iter().zip(seen).filter(|(_, seen)| **seen).map(|(name, _)| name.as_str()).collect();
        let unused: Vec<&str> =
            names.iter().zip(seen).filter(|(_, seen)| !**seen).map(|(name, _)| name.as_str()).collect();
        match used[..] {
            [] => x.report.add(Check::Dependence, format!("{row} depends on no body: nothing can make it zero")),
            [only] => {
                let missing = unused.join(" and ");
                let plural = if unused.len() == 1 { "body" } else { "bodies" };
                let text = format!(
                    "{row} does not depend on {plural} {missing}: only frame {only} moves it, and it acts on that body only"
                );
                x.report.add(Check::Dependence, text);
            }
            _ => {}
        }
    }
    // A row that depends on one frame gives the others.
    if x.report.failed().contains(&Check::Dependence) {
        return;
    }
    for (frame, name) in names.iter().enumerate() {
        if uses.iter().chain(of_velocities.iter().map(|(_, seen)| seen)).all(|seen| !seen[frame]) {
            x.report.add(Check::Dependence, format!("nothing depends on body {name}"));
        }
    }
}

fn dual_numbers(x: &mut Examination<'_>, setting: &Setting) {
    let found = x.probe.joint_values(setting);
    let along = |variation: Variation| {
        let results = interpret_with(&x.probe.recording, |input| variation.jet(setting, input));
        let values = results.into_iter().filter(|(role, _)| matches!(role, Role::Residual(_) | Role::Coordinate(_)));
        values.map(|(_, jet)| jet).collect::<Vec<_>>()
    };
    let mut missed = Vec::new();
    let mut compare = |what: &str, variation: Variation, recorded: &[f64], own: &[f64]| {
        for (k, (recorded, own)) in recorded.iter().zip(own).enumerate() {
            let allowed = ROUNDING * (1.0 + own.abs() + found.values[k].abs());
            let over = variation.text(&x.probe.descriptor);
            missed.push((format!("{what} of {} for {over}", x.name(k)), *recorded, *own, allowed));
        }
    };
    for variation in Variation::all(setting, false) {
        let Some(own) = first_derivatives(&found, variation) else { continue };
        let recorded: Vec<f64> = along(variation).iter().map(|jet| jet.first).collect();
        compare("derivative", variation, &recorded, &own);
    }
    let recorded: Vec<f64> = along(Variation::Motion).iter().map(|jet| jet.second).collect();
    compare("second derivative", Variation::Motion, &recorded, &found.second);
    for (what, recorded, own, allowed) in missed {
        let words = ("the recording gives", "the element gives");
        x.report.compare_in_words(Check::DualNumbers, (recorded, own), allowed, words, || what.clone());
    }
}

fn gamma(x: &mut Examination<'_>, setting: &Setting) {
    let found = x.probe.joint_values(setting);
    let sizes = sizes(&found.values);
    let differences = curvatures(|h| x.probe.joint_plain(&setting.after(h)), &sizes);
    // Rounding of second differences is 1e6 times that of the values.
    x.compare_slopes(Check::Gamma, &found.second, &differences, &sizes, Variation::Motion);
}

fn frame_invariance(x: &mut Examination<'_>, setting: &Setting) {
    let values = x.probe.joint_plain(setting);
    let moved = x.probe.joint_plain(&setting.carried_by(&x.random.frame()));
    for (k, (moved, value)) in moved.iter().zip(&values).enumerate() {
        let what = || {
            let name = value_name(&x.probe.recording, k, &x.probe.descriptor);
            format!("{name} changes when all bodies are moved together")
        };
        let (pair, allowed) = ((*moved, *value), 10.0 * ROUNDING * (1.0 + value.abs()));
        x.report.compare_in_words(Check::FrameInvariance, pair, allowed, ("it becomes", "it was"), what);
    }
}

/// Loads of a unit multiplier of one row: force and torque per frame, ground axes.
fn loads(found: &JointValues, row: usize, setting: &Setting) -> Vec<(Vec3<f64>, Vec3<f64>)> {
    let parts = found.jacobian[row].chunks_exact(6).zip(&setting.frames);
    let load = |(part, frame): (&[f64], &Frame<f64>)| {
        (Vec3::from_column_slice(&part[..3]), frame.rotation * Vec3::from_column_slice(&part[3..]))
    };
    parts.map(load).collect()
}

fn third_law(x: &mut Examination<'_>, setting: &Setting) {
    let found = x.probe.joint_values(setting);
    for row in 0..found.rows {
        let loads = loads(&found, row, setting);
        let name = x.name(row);
        x.compare_resultants(setting, &loads, || format!("reaction of {name}: "));
    }
}

/// The power of the loads of a row is the row's rate, less what an explicit dependence on time contributes.
fn power_balance(x: &mut Examination<'_>, setting: &Setting, scleronomic: bool) {
    let found = x.probe.joint_values(setting);
    let rows = found.rows;
    let sizes = sizes(&found.values);
    let rates = slopes(|h| x.probe.joint_plain(&setting.after(h)), &sizes);
    for row in 0..rows {
        if scleronomic {
            let rate = found.time_derivative[row];
            let name = x.name(row);
            x.report.compare(Check::PowerBalance, rate, 0.0, 0.0, || format!("{name} depends on time, its rate"));
        }
        let loads = loads(&found, row, setting);
        let powers = loads.iter().zip(&setting.twists);
        let power: f64 = powers.map(|((f, m), t)| f.dot(&t.velocity) + m.dot(&t.angular_velocity)).sum();
        let Some(rate) = rates[row] else { continue };
        let expected = rate - found.time_derivative[row];
        let allowed = DIFFERENCE * (1.0 + expected.abs() + rate.abs() + sizes[row]);
        let name = x.name(row);
        x.report.compare(Check::PowerBalance, power, expected, allowed, || format!("power of the reaction of {name}"));
    }
}

/// Makes assembled settings; too few of them are a finding.
fn each_assembled(x: &mut Examination<'_>, check: Check, one: fn(&mut Examination<'_>, &Setting, &JointValues)) {
    let mut assembled = 0;
    for _ in 0..x.options.tries {
        let mut setting = x.aligned_setting();
        if x.probe.assemble(&mut setting) {
            assembled += 1;
            let found = x.probe.joint_values(&setting);
            one(x, &setting, &found);
        }
    }
    if 4 * assembled < x.options.tries {
        let text = format!(
            "{}could be assembled from {assembled} of {} random settings",
            if assembled == 0 { "no setting found: " } else { "" },
            x.options.tries
        );
        x.report.add(check, text);
    }
}

/// The rows of the joint and those with frames exchanged span the same space.
fn body_swap(x: &mut Examination<'_>, setting: &Setting, found: &JointValues) {
    let mut exchanged = setting.exchanged();
    x.probe.refer(&mut exchanged);
    let other = x.probe.joint_values(&exchanged);
    let rows = found.jacobian[..found.rows].to_vec();
    let swapped = other.jacobian[..other.rows].iter().map(|row| [&row[6..], &row[..6]].concat());
    let one = rank(&rows);
    let both: Vec<Vec<f64>> = rows.iter().cloned().chain(swapped).collect();
    let together = rank_at(&both, 1e-7);
    if one != together {
        let text = format!(
            "the rows have rank {one}, with those of exchanged frames {together}; \
             an unsymmetric joint says so: Options {{ symmetric: Some(false), .. }}"
        );
        x.report.add(Check::BodySwap, text);
    }
}

/// Frame 1 where the pose says: the rows are zero and leave as many freedoms as there are coordinates.
fn free_poses(x: &mut Examination<'_>, mobility: &Mobility) {
    let count = mobility.count;
    for _ in 0..x.options.tries {
        let base = x.random.frame();
        let q: Vec<f64> = (0..count).map(|_| x.random.between(-3.0, 3.0)).collect();
        let mut carried = mobility.place(&base, &q);
        let turns_freely = x.probe.descriptor.turns_freely;
        if turns_freely {
            carried.rotation *= x.random.frame().rotation;
        }
        let mut setting = Setting::at_rest(vec![base, carried]);
        setting.time = x.random.between(0.0, 1.0);
        x.probe.settle(&mut setting);
        let found = x.probe.joint_values(&setting);
        for (row, value) in found.residual().iter().enumerate() {
            if deviates(*value, 0.0, 10.0 * ROUNDING) {
                let subject = format!("{} is not zero where `pose` puts the second body", x.name(row));
                let q: Vec<String> = q.iter().map(|q| number(*q)).collect();
                let text = format!("{} for coordinates [{}]", number(*value), q.join(", "));
                x.report.add_about(Check::FreeMotion, &subject, &text);
            }
        }
        // The freedoms the rows leave to frame 1.
        let rows: Vec<Vec<f64>> = found.jacobian[..found.rows].iter().map(|row| row[6..12].to_vec()).collect();
        let rank = rank(&rows);
        let count = if turns_freely { count + 3 } else { count };
        if rank + count != 6 {
            let text = format!("the rows leave {} freedoms, the mobility has {count} coordinates", 6 - rank);
            x.report.add(Check::MobilityRank, text);
        }
        if x.probe.descriptor.opaque {
            continue;
        }
        let pose = (mobility.pose)(&q);
        for (role, value) in x.probe.recorded(&setting, &q) {
            let expected = match role {
                Role::PosePosition(k) => pose.position[k as usize],
                Role::PoseRotation(k) => pose.rotation[(k as usize / 3, k as usize % 3)],
                _ => continue,
            };
            x.report.compare(Check::Recording, value, expected, ROUNDING, || format!("{role:?} of the mobility"));
        }
    }
}

/// A step along a direction that the rows leave free moves them by its square only, and the next assembly finds the same
/// number of freedoms.
fn tangent_motion(x: &mut Examination<'_>, setting: &Setting, found: &JointValues) {
    let rows = &found.jacobian[..found.rows];
    let free = free_directions(rows, 6 * setting.frames.len());
    let Some(first) = free.first() else { return };
    let mut direction = first * 0.0;
    for each in &free {
        direction += each * x.random.between(-1.0, 1.0);
    }
    let rows_at = |h: f64| {
        let values = x.probe.joint_plain(&setting.moved((&direction * h).as_slice()));
        values[..found.rows].to_vec()
    };
    let sizes = sizes(found.residual());
    for (row, rate) in slopes(rows_at, &sizes).into_iter().enumerate() {
        if let Some(rate) = rate {
            let what =
                || format!("rate of {} along a free motion", value_name(&x.probe.recording, row, &x.probe.descriptor));
            x.report.compare(Check::FreeMotion, rate, 0.0, DIFFERENCE * (1.0 + sizes[row]), what);
        }
    }
    let mut further = setting.moved((&direction * 1e-2).as_slice());
    if !x.probe.assemble(&mut further) {
        x.report.add(Check::FreeMotion, "cannot be put together again after a small free motion");
        return;
    }
    let again = x.probe.joint_values(&further);
    let (before, after) = (rank(rows), rank(&again.jacobian[..again.rows]));
    if before != after {
        x.report.add(Check::FreeMotion, format!("{before} independent rows become {after} by a small free motion"));
    }
}

fn sizes(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| value.abs()).collect()
}

/// A random setting that satisfies a joint's rows, for tests of one's own.
///
/// # Panics
/// When none of 100 starts leads to one.
#[must_use]
pub fn assembled_setting(probe: &Probe, random: &mut Random) -> Setting {
    for _ in 0..100 {
        let mut setting = probe.random_setting(random);
        if probe.assemble(&mut setting) {
            return setting;
        }
    }
    panic!("{} cannot be assembled", probe.descriptor.name)
}
