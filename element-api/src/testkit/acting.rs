//! Checks of force and control elements.

use crate::descriptor::Kind;
use crate::geometry::Vec3;
use crate::recording::Role;
use crate::testkit::differences::{DIFFERENCE, slopes};
use crate::testkit::examine::{Examination, ROUNDING};
use crate::testkit::report::{Check, deviates, number, pair};
use crate::testkit::variation::Variation;
use crate::testkit::{ForceValues, Probe, Setting, interpret_with};

/// All checks that only force and control elements have.
pub(super) fn examine(x: &mut Examination<'_>) {
    examine_equations(x);
    if x.probe.descriptor.kind == Kind::Control {
        return;
    }
    if x.options.internal {
        examine_third_law(x);
    }
    if x.options.accounted {
        examine_power(x, false);
    }
    if x.options.symmetric == Some(true) {
        x.each_setting(&[Check::BodySwap], |x, setting| body_swap(x, setting));
    }
}

/// Recording, derivatives, invariance.
pub(super) fn examine_equations(x: &mut Examination<'_>) {
    x.each_setting(&[Check::Recording], |x, setting| {
        let found = results(x, setting);
        x.compare_recording(setting, &numbers(&found), &sizes(&found), &found.angles);
    });
    if !x.probe.descriptor.opaque {
        x.each_setting(&[Check::Jacobian], |x, setting| jacobian(x, setting));
    }
    if x.options.invariant && !x.probe.descriptor.frames.is_empty() {
        x.each_setting(&[Check::FrameInvariance], |x, setting| frame_invariance(x, setting));
    }
}

/// Action equals reaction.
pub(super) fn examine_third_law(x: &mut Examination<'_>) {
    x.each_setting(&[Check::ThirdLaw], |x, setting| {
        let found = results(x, setting);
        let loads: Vec<(Vec3<f64>, Vec3<f64>)> = found.forces.into_iter().zip(found.torques).collect();
        x.compare_resultants(setting, &loads, String::new);
    });
}

/// Power balance and dissipation, if the element gives potential or dissipation, or must.
pub(super) fn examine_power(x: &mut Examination<'_>, required: bool) {
    let gives = |role: Role| x.probe.recording.output(role).is_some();
    let (potential, dissipation) = (gives(Role::Potential), gives(Role::Dissipation));
    if gives(Role::Kinetic) {
        x.each_setting(&[Check::PowerBalance], kinetic_energy);
    }
    if !potential && !dissipation {
        if required {
            x.report.examine(Check::PowerBalance);
            x.report.add(Check::PowerBalance, "neither potential nor dissipation");
        }
        return;
    }
    each_solved(x, Check::PowerBalance, power_balance);
    if dissipation {
        each_solved(x, Check::DissipationSign, |x, setting| {
            let found = results(x, setting);
            let dissipation = found.dissipation.unwrap_or(f64::NAN);
            // A sum of squares may round to a little below zero.
            if dissipation.is_nan() || dissipation < -ROUNDING * (1.0 + load(&found)) {
                let text = format!("{} W", number(dissipation));
                x.report.add_about(Check::DissipationSign, "the dissipation is negative", &text);
            }
        });
    }
}

/// A check in random settings in which internal unknowns meet their conditions; too few of them are a finding.
fn each_solved(x: &mut Examination<'_>, check: Check, one: impl Fn(&mut Examination<'_>, &Setting)) {
    x.fenced(&[check], |x| {
        let mut solved = 0;
        for _ in 0..x.options.tries {
            let mut setting = x.aligned_setting();
            if x.probe.solve_unknowns(&mut setting) {
                solved += 1;
                one(x, &setting);
            }
        }
        if 4 * solved < x.options.tries {
            let text = format!(
                "the internal unknowns could be found from their starting guesses in {solved} of {} random settings",
                x.options.tries
            );
            x.report.add(check, text);
        }
    });
}

/// Derivatives of the recording by jets, with respect to everything it may depend on, against differences of the values.
fn jacobian(x: &mut Examination<'_>, setting: &Setting) {
    let sizes = sizes(&results(x, setting));
    for variation in Variation::all(setting, true) {
        let recorded = interpret_with(&x.probe.recording, |input| variation.jet(setting, input));
        let jets = recorded
            .into_iter()
            .filter(|(role, _)| !matches!(role, Role::Angle(_) | Role::SamplePeriod | Role::Kinetic));
        let derivatives: Vec<f64> = jets.map(|(_, jet)| jet.first).collect();
        let differences = slopes(|h| numbers(&results(x, &variation.step(setting, h))), &sizes);
        x.compare_slopes(Check::Jacobian, &derivatives, &differences, &sizes, variation);
    }
}

fn frame_invariance(x: &mut Examination<'_>, setting: &Setting) {
    let world = x.random.frame();
    let mut carried = results(x, setting);
    let sizes = sizes(&carried);
    for vector in carried.forces.iter_mut().chain(&mut carried.torques) {
        *vector = world.rotation * *vector;
    }
    let moved = results(x, &setting.carried_by(&world));
    for (k, (value, expected)) in numbers(&moved).into_iter().zip(numbers(&carried)).enumerate() {
        let allowed = 10.0 * ROUNDING * (1.0 + sizes[k]);
        let name = x.name(k);
        let words = ("it becomes", "expected is");
        x.report.compare_in_words(Check::FrameInvariance, (value, expected), allowed, words, || {
            format!("{name} does not go along when all bodies are moved together")
        });
    }
}

/// The rule of [`crate::Force::potential`]: power of the loads = -dV/dt - dissipation, along the motion, the element's own states
/// moving at their rates, time and signals held.
fn power_balance(x: &mut Examination<'_>, setting: &Setting) {
    let found = results(x, setting);
    let powers = setting.twists.iter().zip(found.forces.iter().zip(&found.torques));
    let mut power: f64 = powers.map(|(t, (f, m))| f.dot(&t.velocity) + m.dot(&t.angular_velocity)).sum();
    let flexible = x.probe.recording.flexible();
    power += (0..flexible).map(|k| found.rates[flexible + k] * setting.states[flexible + k]).sum::<f64>();
    let potential = |h: f64| {
        let mut later = Setting { time: setting.time, ..setting.after(h) };
        for (state, rate) in later.states.iter_mut().zip(&found.rates) {
            *state += rate * h;
        }
        if !x.probe.solve_unknowns(&mut later) {
            return vec![f64::NAN];
        }
        vec![results(x, &later).potential.unwrap_or(0.0)]
    };
    let size = found.potential.unwrap_or(0.0).abs() + load(&found);
    // Near a kink of the potential there is nothing to compare.
    let Some(stored) = slopes(potential, &[size])[0] else { return };
    let dissipation = found.dissipation.unwrap_or(0.0);
    let allowed = DIFFERENCE * (1.0 + power.abs() + stored.abs() + dissipation.abs() + size);
    let expected = -stored - dissipation;
    if deviates(power, expected, allowed) {
        let (power, expected) = pair(power, expected);
        let (stored, dissipation) = (number(stored), number(dissipation));
        let text = format!(
            "their power is {power} W; with {stored} W stored in the potential and {dissipation} W dissipated it should be {expected} W"
        );
        let subject = "the loads make or lose energy that nothing accounts for";
        x.report.add_about(Check::PowerBalance, subject, &text);
    }
}

/// A kinetic energy is not negative.
fn kinetic_energy(x: &mut Examination<'_>, setting: &Setting) {
    let found = x.probe.recorded(setting, &[]).into_iter().find(|(role, _)| *role == Role::Kinetic);
    if let Some((_, energy)) = found.filter(|(_, energy)| energy.is_nan() || *energy < -ROUNDING * (1.0 + energy.abs()))
    {
        x.report.add_about(Check::PowerBalance, "the kinetic energy is negative", &format!("{} J", number(energy)));
    }
}

fn body_swap(x: &mut Examination<'_>, setting: &Setting) {
    let found = results(x, setting);
    let mut exchanged = setting.exchanged();
    x.probe.refer(&mut exchanged);
    let mut other = results(x, &exchanged);
    other.forces.reverse();
    other.torques.reverse();
    let loads = |values: &ForceValues| -> Vec<f64> {
        values.forces.iter().chain(&values.torques).flat_map(|v| v.iter().copied()).collect()
    };
    let allowed = 10.0 * ROUNDING * (1.0 + load(&found));
    for (k, (value, expected)) in loads(&other).into_iter().zip(loads(&found)).enumerate() {
        x.report.compare(Check::BodySwap, value, expected, allowed, || format!("load component {k}, frames exchanged"));
    }
}

/// What the element gives; a control element gives no loads.
fn results(x: &Examination<'_>, setting: &Setting) -> ForceValues {
    let mut found = x.probe.force_values(setting);
    if x.probe.descriptor.kind == Kind::Control {
        found.forces.clear();
        found.torques.clear();
    }
    found
}

/// What a result of [`numbers`] is called.
pub(super) fn value_name(probe: &Probe, k: usize) -> String {
    let descriptor = &probe.descriptor;
    let control = descriptor.kind == Kind::Control;
    let frames = if control { 0 } else { descriptor.frames.len() };
    let axis = ["x", "y", "z"][k % 3];
    let mut k = k;
    for (what, count) in [("force", 3 * frames), ("torque", 3 * frames)] {
        if k < count {
            return format!("component {axis} of the {what} on body `{}`", descriptor.frames[k / 3].name);
        }
        k -= count;
    }
    let states = probe.recording.initial_states.len();
    let flexible = probe.recording.flexible();
    if (flexible..2 * flexible).contains(&k) {
        return format!("the force on flexible coordinate {}", k - flexible);
    }
    if k < states {
        let name = descriptor.states.get(k).map_or_else(|| k.to_string(), |named| format!("`{}`", named.name));
        return format!("the rate of state {name}");
    }
    k -= states;
    let unknowns = probe.recording.unknowns();
    if k < unknowns {
        return format!("condition {}", unknowns - 1 - k);
    }
    k -= unknowns;
    let memory = probe.recording.initial_discrete.len();
    if k < memory {
        return format!("discrete state {k}");
    }
    k -= memory;
    if let Some(named) = descriptor.channels.get(k) {
        return format!("{} `{}`", if control { "output" } else { "channel" }, named.name);
    }
    match k - descriptor.channels.len() {
        0 if probe.recording.output(Role::Potential).is_some() => "the potential".into(),
        _ => "the dissipation".into(),
    }
}

/// The results in the order in which they are recorded, angles left out.
fn numbers(found: &ForceValues) -> Vec<f64> {
    let vectors = found.forces.iter().chain(&found.torques).flat_map(|v| v.iter().copied());
    let lists = [&found.rates, &found.memory, &found.channels].into_iter().flatten().copied();
    vectors.chain(lists).chain(found.potential).chain(found.dissipation).collect()
}

/// Sizes of the [`numbers`]: of loads the largest, because each of them may come from large ones that cancel.
fn sizes(found: &ForceValues) -> Vec<f64> {
    let load = load(found);
    let loads = std::iter::repeat_n(load, 6 * found.forces.len());
    loads.chain(numbers(found)[6 * found.forces.len()..].iter().map(|value| value.abs() + load)).collect()
}

fn load(found: &ForceValues) -> f64 {
    found.forces.iter().chain(&found.torques).map(|v| v.amax()).fold(0.0, f64::max)
}
