//! Closed-form answers, equal systems by different elements, limits and refusals of the control elements.

use element_api::Control;
use element_api::recording::Role;
use element_api::set::CreateError;
use element_api::testkit::{self, ForceValues, Probe, Random, Setting};

use crate::digital_filter::DigitalFilter;
use crate::digital_pid::DigitalPid;
use crate::gain::Gain;
use crate::integral::Integral;
use crate::look_up::LookUp;
use crate::map::Map;
use crate::pid::Pid;
use crate::product::Product;
use crate::sensor::Sensor;
use crate::signal_source::SignalSource;
use crate::state_space::StateSpace;
use crate::sum::Sum;
use crate::transfer_function::TransferFunction;

const PI_LIMITED: &str = "kp = 2.0\nki = 5.0\nlow = -1.0\nhigh = 1.0";
const PID: &str = "kp = 2.0\nki = 5.0\nkd = 0.3\nfilter_time = 0.01";
const GRID: &str = "a = [-1, 0, 2]\nb = [-0.5, 1]\nvalues = [1, 2, 4, -3, 0, 5]";
const RESONANT: &str = "numerator = [3.0, 2.0, 50.0]\ndenominator = [2.0, 1.0, 8.0, 40.0]";

mod contract {
    use super::*;

    /// What every control element must fulfil; and the recording's results are those of plain evaluation also far from
    /// the states at the start and beyond the limits.
    #[track_caller]
    fn fulfilled<T: Control>(params: &str) {
        testkit::check_control::<T>(params);
        let probe = accepted::<T>(params);
        let mut random = Random::new(11);
        for _ in 0..40 {
            let mut setting = probe.random_setting(&mut random);
            setting.signals.iter_mut().for_each(|signal| *signal *= 3.0);
            setting.states.iter_mut().for_each(|state| *state = random.between(-2.0, 2.0));
            let ForceValues { rates, memory, channels, .. } = probe.force_values(&setting);
            let expected: Vec<f64> = rates.into_iter().chain(memory).chain(channels).collect();
            let computed = |(role, value)| (role != Role::SamplePeriod).then_some(value);
            let found: Vec<f64> = probe.recorded(&setting, &[]).into_iter().filter_map(computed).collect();
            assert_eq!(found, expected, "{params}");
            assert!(found.iter().all(|value| value.is_finite()), "{params}");
        }
    }

    #[test]
    fn digital_pid() {
        fulfilled::<DigitalPid>("period = 0.01\nkp = 2.0\nki = 5.0\nkd = 0.3\nlow = -1.0\nhigh = 1.0");
        fulfilled::<DigitalPid>("period = 0.01\nkp = 2.0\ndelay = true");
        assert_eq!(accepted::<DigitalPid>("period = 0.02").recording.sample_period(), Some(0.02));
    }

    #[test]
    fn digital_filter() {
        const BIQUAD: &str = "numerator = [0.5, 0.2, -0.3]\ndenominator = [2.0, -1.0, 0.8]";
        for params in [
            "numerator = [1.0]",
            "numerator = [1.0]\ndelay = 0.03",
            "denominator = [1.0, -0.5]\nnumerator = [0.5]",
            BIQUAD,
        ] {
            fulfilled::<DigitalFilter>(&format!("period = 0.01\n{params}"));
        }
        fulfilled::<DigitalFilter>(&format!("period = 0.01\ndelay = 0.02\ninitial_input = 3.0\n{BIQUAD}"));
        assert_eq!(accepted::<DigitalFilter>("period = 0.02\nnumerator = [1.0]").recording.sample_period(), Some(0.02));
    }

    #[test]
    fn every_element_fulfils_the_contract() {
        fulfilled::<SignalSource>("function = [[0, 0], [0.5, 1], [1, -2]]");
        fulfilled::<SignalSource>("function = { postfix = [2.0, \"x\", \"mul\", \"sin\"] }");
        fulfilled::<Sensor>("gain = 3.0\noffset = 0.5");
        fulfilled::<Sensor>("time_constant = 0.1\ninitial = 2.0\nlow = -1.0\nhigh = 1.0");
        fulfilled::<Sum>("gain_b = -1.0\ngain_d = 0.5");
        fulfilled::<Gain>("gain = 2.0\nlow = -1.0\nhigh = 3.0");
        fulfilled::<Product>("gain = 0.5");
        fulfilled::<LookUp>("function = [[-1, 0], [0, 1], [1, 5]]");
        for word in ["monotone", "linear", "spline"] {
            fulfilled::<Map>(&format!("{GRID}\ninterpolation = \"{word}\""));
        }
        fulfilled::<Integral>("gain = 2.0\nlow = -1.0\nhigh = 1.0");
        for params in ["kp = 2.0", "kd = 1.0\nfilter_time = 0.1", PI_LIMITED, PID] {
            fulfilled::<Pid>(params);
        }
        for params in
            ["numerator = [2.0]\ndenominator = [4.0]", "numerator = [1.0]\ndenominator = [1.0, 0.0, 0.0]", RESONANT]
        {
            fulfilled::<TransferFunction>(params);
        }
        fulfilled::<StateSpace>("a = [0.0, 1.0, -4.0, -0.5]\nb = [0.0, 1.0]\nc = [1.0, 0.0]\nd = 2.0");
    }

    #[test]
    fn states_are_as_many_as_the_parameters_need() {
        let states = |probe: Probe| probe.recording.initial_states;
        assert_eq!(states(accepted::<Sensor>("")), [0.0; 0]);
        assert_eq!(states(accepted::<Sensor>("time_constant = 0.1\ninitial = 4.0")), [4.0]);
        assert_eq!(states(accepted::<Pid>("kp = 1.0")), [0.0; 0]);
        assert_eq!(states(accepted::<Pid>("ki = 1.0\ninitial_integral = 3.0")), [3.0]);
        // What nothing changes is no state: it would be a mode that never decays.
        assert_eq!(states(accepted::<Pid>("kp = 1.0\nlow = -9.0\ninitial_integral = 3.0")), [0.0; 0]);
        assert_eq!(states(accepted::<Pid>("kp = 1.0\nlow = -9.0\ntracking_time = 1.0\ninitial_integral = 3.0")), [3.0]);
        assert_eq!(states(accepted::<Pid>("kd = 1.0\nfilter_time = 0.1")), [0.0]);
        assert_eq!(states(accepted::<Pid>(&format!("{PID}\ninitial_integral = 3.0"))), [3.0, 0.0]);
        assert_eq!(states(accepted::<TransferFunction>(RESONANT)), [0.0; 3]);
        assert_eq!(states(accepted::<TransferFunction>("numerator = [0.0, 0.0, 2.0]\ndenominator = [4.0]")), [0.0; 0]);
    }
}

mod memoryless {
    use super::*;

    #[test]
    fn sum_product_gain_and_sensor_are_their_formulas() {
        assert_eq!(answer::<Sum>("", &[1.0, 2.0, 3.0, 4.0]), 10.0);
        assert_eq!(answer::<Sum>("gain_a = 2.0\ngain_b = -1.0\ngain_c = 0.5", &[1.0, 2.0, 3.0]), 1.5);
        assert_eq!(answer::<Sum>("", &[]), 0.0);
        assert_eq!(answer::<Product>("gain = 0.5", &[3.0, -4.0]), -6.0);
        assert_eq!(answer::<Gain>("gain = -2.0", &[3.0]), -6.0);
        assert_eq!(answer::<Sensor>("gain = 3.0\noffset = 1.0", &[2.0]), 7.0);
    }

    #[test]
    fn limits_act_alone_and_together() {
        for (params, low, high) in [
            ("low = -1.0", -1.0, f64::INFINITY),
            ("high = 2.0", f64::NEG_INFINITY, 2.0),
            ("low = -1.0\nhigh = 2.0", -1.0, 2.0),
        ] {
            for signal in [-5.0, -1.0, 0.3, 2.0, 5.0] {
                assert_eq!(answer::<Gain>(params, &[signal]), signal.clamp(low, high), "{params}");
                assert_eq!(answer::<Sensor>(params, &[signal]), signal.clamp(low, high), "{params}");
            }
        }
    }

    #[test]
    fn maps_pass_through_their_values_and_point_at_what_is_wrong() {
        assert_close(answer::<Map>(GRID, &[0.0, 1.0]), -3.0, 1e-14);
        assert_close(answer::<Map>(GRID, &[9.0, -9.0]), 0.0, 1e-14);
        for (params, path) in [
            (GRID.replace("[-1, 0, 2]", "[-1, 2, 0]"), "a"),
            (GRID.replace("[-0.5, 1]", "[1, 1]"), "b"),
            (GRID.replace("0, 5]", "0]"), "values"),
        ] {
            match Probe::control::<Map>(&params) {
                Err(CreateError::Parameter(error)) => assert_eq!(error.path, path, "{params}"),
                _ => panic!("{params} is accepted"),
            }
        }
    }

    #[test]
    fn functions_pass_through_their_points_and_hold_the_ends() {
        let points = "function = [[0, 1], [1, 3], [2, 2]]";
        for (x, y) in [(-4.0, 1.0), (0.0, 1.0), (1.0, 3.0), (2.0, 2.0), (9.0, 2.0)] {
            assert_close(answer::<LookUp>(points, &[x]), y, 1e-14);
            let source = accepted::<SignalSource>(points);
            assert_close(source.force_values(&setting(&source, &[], x)).channels[0], y, 1e-14);
        }
    }
}

mod dynamic {
    use super::*;

    #[test]
    fn sensor_lags_as_a_system_of_first_order() {
        let sensor = accepted::<Sensor>("gain = 2.0\ntime_constant = 0.5\ninitial = 1.0");
        let (_, reading) = simulated(&sensor, 1.3, |_| vec![3.0]);
        // From 1 towards 6.
        assert_close(reading[0], 6.0 - 5.0 * (-1.3_f64 / 0.5).exp(), 1e-11);
    }

    #[test]
    fn integral_of_a_cosine_is_a_sine() {
        let integral = accepted::<Integral>("gain = 2.0\ninitial = 1.0");
        let (_, level) = simulated(&integral, 0.9, |t| vec![(3.0 * t).cos()]);
        assert_close(level[0], 1.0 + 2.0 / 3.0 * (2.7_f64).sin(), 1e-11);
    }

    #[test]
    fn integral_stops_at_its_limits_and_leaves_them_at_once() {
        let integral = accepted::<Integral>("low = -0.5\nhigh = 1.0");
        let rate = |x: f64, u: f64| {
            let mut setting = setting(&integral, &[u], 0.0);
            setting.states = vec![x];
            let found = integral.force_values(&setting);
            (found.rates[0], found.channels[0])
        };
        assert_eq!(rate(0.2, 3.0), (3.0, 0.2));
        assert_eq!(rate(1.1, 3.0), (0.0, 1.0));
        assert_eq!(rate(1.1, -3.0), (-3.0, 1.0));
        assert_eq!(rate(-0.6, -3.0), (0.0, -0.5));
        assert_eq!(rate(-0.6, 3.0), (3.0, -0.5));
    }

    #[test]
    fn transfer_function_of_second_order_answers_a_step_as_the_book_says() {
        // omega^2 / (s^2 + 2 zeta omega s + omega^2), with a common factor that must not matter.
        let (omega, zeta) = (40.0_f64, 0.3_f64);
        let [b, a2, a1, a0] = [omega * omega, 1.0, 2.0 * zeta * omega, omega * omega].map(|value| 7.0 * value);
        let system =
            accepted::<TransferFunction>(&format!("numerator = [{b:?}]\ndenominator = [{a2:?}, {a1:?}, {a0:?}]"));
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        for t in [0.01, 0.05, 0.2] {
            let (_, found) = simulated(&system, t, |_| vec![1.0]);
            let (sin, cos) = (damped * t).sin_cos();
            assert_close(found[0], 1.0 - (-zeta * omega * t).exp() * (cos + zeta * omega / damped * sin), 1e-10);
        }
    }

    #[test]
    fn transfer_function_with_as_many_zeros_as_poles_has_a_direct_part() {
        // (s + 3) / (s + 1) = 1 + 2 / (s + 1).
        let system = accepted::<TransferFunction>("numerator = [1.0, 3.0]\ndenominator = [1.0, 1.0]");
        for t in [0.0, 0.7] {
            let (_, found) = simulated(&system, t, |_| vec![1.0]);
            assert_close(found[0], 3.0 - 2.0 * (-t).exp(), 1e-11);
        }
    }

    #[test]
    fn transfer_function_at_a_frequency_is_the_complex_ratio() {
        // After the start has died away, sin w t has become Re G sin w t + Im G cos w t with G = G(i w).
        let system = accepted::<TransferFunction>("numerator = [1.0, 2.0]\ndenominator = [0.5, 3.0, 10.0]");
        let w = 4.0_f64;
        // G(iw) = (2 + iw) / (10 - 0.5 w^2 + 3 i w).
        let (re, im) = (10.0 - 0.5 * w * w, 3.0 * w);
        let size = re * re + im * im;
        let (real, imaginary) = ((2.0 * re + w * im) / size, (w * re - 2.0 * im) / size);
        let t = 12.0;
        let (_, found) = simulated(&system, t, |t| vec![(w * t).sin()]);
        assert_close(found[0], real * (w * t).sin() + imaginary * (w * t).cos(), 1e-9);
    }

    #[test]
    fn double_integrator_has_a_ramp_and_a_parabola() {
        let system = accepted::<TransferFunction>("numerator = [2.0]\ndenominator = [1.0, 0.0, 0.0]");
        let (_, found) = simulated(&system, 1.5, |_| vec![1.0]);
        assert_close(found[0], 1.5 * 1.5, 1e-12);
    }

    #[test]
    fn state_space_turns_like_its_matrix() {
        let system =
            accepted::<StateSpace>("a = [0.0, 3.0, -3.0, 0.0]\nb = [0.0, 0.0]\nc = [1.0, 2.0]\ninitial = [1.0, 0.5]");
        let (_, found) = simulated(&system, 2.0, |_| vec![9.0]);
        let (sin, cos) = 6.0_f64.sin_cos();
        assert_close(found[0], (cos + 0.5 * sin) + 2.0 * (0.5 * cos - sin), 1e-10);
    }

    #[test]
    fn transfer_function_equals_its_state_space_form() {
        // Unscaled controllable form of (3 s^2 + 2 s + 50) / (2 s^3 + s^2 + 8 s + 40).
        let companion = "a = [0, 1, 0, 0, 0, 1, -20, -4, -0.5]\nb = [0, 0, 1]\nc = [25, 1, 1.5]";
        let input = |t: f64| vec![(5.0 * t).sin() + 0.3];
        let (_, a) = simulated(&accepted::<TransferFunction>(RESONANT), 1.7, input);
        let (_, b) = simulated(&accepted::<StateSpace>(companion), 1.7, input);
        assert!(a[0].abs() > 0.1);
        assert_close(a[0], b[0], 1e-10);
    }
}

mod pid {
    use super::*;

    #[test]
    fn parts_answer_a_ramp_of_the_error_in_closed_form() {
        // e = t: P = 2 t, I = 5 t^2 / 2, D = kd (1 - exp(-t / T_f)).
        let (_, found) = simulated(&accepted::<Pid>(PID), 0.8, |t| vec![t + 1.0, 1.0, 7.0]);
        let expected = 2.0 * 0.8 + 2.5 * 0.64 + 0.3 * (1.0 - (-80.0_f64).exp()) + 7.0;
        assert_close(found[0], expected, 1e-10);
        assert_close(found[1], 0.8, 1e-14);
        assert_close(found[2], expected, 1e-10);
    }

    #[test]
    fn back_calculation_leads_the_integral_to_where_the_limit_begins() {
        // e = 4: v = 8 + I, u = 1; T_t = kp / ki = 0.4, so I' = 20 + (1 - 8 - I) / 0.4 from 0, which ends at I = 1.
        let probe = accepted::<Pid>(PI_LIMITED);
        for t in [0.1, 0.5, 2.0] {
            let (states, found) = simulated(&probe, t, |_| vec![4.0, 0.0]);
            assert_close(states[0], 1.0 - (-t / 0.4).exp(), 1e-10);
            assert_eq!(found[0], 1.0);
            assert_close(found[2], 9.0 - (-t / 0.4).exp(), 1e-10);
        }
    }

    #[test]
    fn integral_without_anti_windup_would_leave_the_limit_late() {
        // After 10 s at e = 4 the error turns to -1: the output leaves its limit with the error; an integral that had
        // wound up to 5 * 4 * 10 = 200 would keep it there for some 40 s.
        let error = |t: f64| if t < 10.0 { 4.0 } else { -1.0 };
        let (_, led) = simulated(&accepted::<Pid>(PI_LIMITED), 10.01, |t| vec![error(t), 0.0]);
        assert!(led[0] < 0.0, "{led:?}");
        let slow = format!("{PI_LIMITED}\ntracking_time = 1e6");
        let (_, wound) = simulated(&accepted::<Pid>(&slow), 10.01, |t| vec![error(t), 0.0]);
        assert!(wound[2] > 190.0 && wound[0] == 1.0, "{wound:?}");
    }

    #[test]
    fn integral_at_the_start_stays_where_it_does_not_grow() {
        let parts = |params: &str| {
            let probe = accepted::<Pid>(&format!("kp = 2.0\nlow = -4.0\nhigh = 4.0\ninitial_integral = 3.0\n{params}"));
            let ForceValues { rates, channels, .. } = probe.force_values(&setting(&probe, &[1.0, 0.0], 0.0));
            (rates.first().copied(), channels[2])
        };
        assert_eq!(parts(""), (None, 5.0));
        // The limit of ever smaller gains, with which the rule leads back ever slower.
        assert_close(parts("ki = 1e-6").0.expect("a state") / 0.5e-6, 1.0, 1e-12);
        assert_eq!(parts("tracking_time = 0.5"), (Some(-2.0), 5.0));
    }

    #[test]
    fn tracking_time_follows_the_rule_unless_given() {
        // At rest with e = 0 and I beyond the limit: I' = (u - v) / T_t.
        let rate = |params: &str| {
            let probe = accepted::<Pid>(&format!("{params}\nlow = -1.0\nhigh = 1.0\ninitial_integral = 3.0"));
            probe.force_values(&setting(&probe, &[0.0, 0.0], 0.0)).rates[0]
        };
        assert_close(rate("kp = 2.0\nki = 5.0"), -2.0 / 0.4, 1e-14);
        assert_close(rate("kp = 2.0\nki = 5.0\nkd = 0.2\nfilter_time = 0.1"), -2.0 / 0.2, 1e-14);
        assert_close(rate("kp = -2.0\nki = -5.0"), -2.0 / 0.4, 1e-14);
        assert_close(rate("ki = 5.0\ntracking_time = 0.1"), -2.0 / 0.1, 1e-14);
    }

    #[test]
    fn closed_loop_on_an_integrating_plant_is_a_system_of_second_order() {
        // Plant x' = u and PI: e'' + kp e' + ki e = 0 with e(0) = r, e'(0) = -kp r.
        let (kp, ki, r) = (2.0_f64, 5.0_f64, 3.0);
        let probe = accepted::<Pid>("kp = 2.0\nki = 5.0");
        let (mut x, mut integral, steps, end) = (0.0, 0.0, 2000, 1.5);
        let h = end / f64::from(steps);
        let rates = |x: f64, integral: f64| {
            let mut setting = setting(&probe, &[r, x], 0.0);
            setting.states = vec![integral];
            let found = probe.force_values(&setting);
            (found.channels[0], found.rates[0])
        };
        for _ in 0..steps {
            let k1 = rates(x, integral);
            let k2 = rates(x + 0.5 * h * k1.0, integral + 0.5 * h * k1.1);
            let k3 = rates(x + 0.5 * h * k2.0, integral + 0.5 * h * k2.1);
            let k4 = rates(x + h * k3.0, integral + h * k3.1);
            x += h / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
            integral += h / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
        }
        let damped = (ki - 0.25 * kp * kp).sqrt();
        let (sin, cos) = (damped * end).sin_cos();
        assert_close(r - x, r * (-0.5 * kp * end).exp() * (cos - 0.5 * kp / damped * sin), 1e-10);
    }
}

#[test]
fn parameters_that_can_not_be_used_are_refused_by_name() {
    let limits = "low = 2.0\nhigh = 1.0";
    for (refused, name, words) in [
        (refusal::<Gain>(limits), "high", "must be larger than `low`"),
        (refusal::<Sensor>(limits), "high", "must be larger than `low`"),
        (refusal::<Integral>("initial = 3.0\nhigh = 1.0"), "initial", "between"),
        (
            refusal::<Map>("grid = { x = [0, 1], y = [0, 1], z = [[1, 2], [3, 4]] }\ninterpolation = \"linear\""),
            "interpolation",
            "`grid.interpolation`",
        ),
        (refusal::<Pid>("kd = 1.0"), "filter_time", "needs a filter"),
        (refusal::<Pid>("ki = 1.0\nhigh = 1.0"), "tracking_time", "is missing"),
        (refusal::<Pid>("kp = -1.0\nki = 1.0\nhigh = 1.0"), "tracking_time", "is missing"),
        (refusal::<TransferFunction>("numerator = []\ndenominator = [1.0]"), "numerator", "at least one"),
        (refusal::<TransferFunction>("numerator = [1.0]\ndenominator = []"), "denominator", "not zero"),
        (refusal::<TransferFunction>("numerator = [1.0]\ndenominator = [0.0, 1.0]"), "denominator", "not zero"),
        (refusal::<TransferFunction>("numerator = [1.0, 0.0]\ndenominator = [1.0]"), "numerator", "higher powers"),
        (refusal::<DigitalFilter>("period = 0.1\nnumerator = []"), "numerator", "at least one"),
        (refusal::<DigitalFilter>("period = 0.1\nnumerator = [1.0]\ndenominator = [0.0]"), "denominator", "not zero"),
        (refusal::<DigitalFilter>("period = 0.1\nnumerator = [1.0]\ndelay = 0.25"), "delay", "whole number of periods"),
        (refusal::<DigitalFilter>("period = 0.1\nnumerator = [1.0]\ndelay = 1e4"), "delay", "a longer period"),
        (
            refusal::<DigitalFilter>("period = 0.1\nnumerator = [1.0]\ndenominator = [1.0, -1.0]\ninitial_input = 1.0"),
            "initial_input",
            "settles at nothing",
        ),
        (refusal::<StateSpace>("a = []\nb = []\nc = []"), "b", "at least one"),
        (refusal::<StateSpace>("a = [1.0]\nb = [1.0, 2.0]\nc = [1.0, 2.0]"), "a", "needs 4 numbers"),
        (refusal::<StateSpace>("a = [1.0]\nb = [1.0]\nc = [1.0, 2.0]"), "c", "needs 1 numbers"),
        (refusal::<StateSpace>("a = [1.0]\nb = [1.0]\nc = [1.0]\ninitial = []"), "initial", "it has 0"),
    ] {
        let CreateError::Parameter(error) = refused else { panic!("{refused:?}") };
        assert_eq!(error.path, name, "{error}");
        assert!(error.message.contains(words), "{error}");
    }
}

#[track_caller]
fn accepted<T: Control>(params: &str) -> Probe {
    Probe::control::<T>(params).expect("the parameters are accepted")
}

#[track_caller]
fn refusal<T: Control>(params: &str) -> CreateError {
    Probe::control::<T>(params).expect_err("the parameters are refused")
}

/// The states at the start, with these signals; the others take their defaults.
fn setting(probe: &Probe, signals: &[f64], time: f64) -> Setting {
    let mut setting = Setting::at_rest(Vec::new());
    setting.signals = signals.to_vec();
    setting.time = time;
    probe.settle(&mut setting);
    setting
}

/// First output at the start.
#[track_caller]
fn answer<T: Control>(params: &str, signals: &[f64]) -> f64 {
    let probe = accepted::<T>(params);
    probe.force_values(&setting(&probe, signals, 0.0)).channels[0]
}

/// States and outputs at the time `end`, by the classical Runge-Kutta method with 4000 steps.
fn simulated(probe: &Probe, end: f64, signals: impl Fn(f64) -> Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let steps = 4000;
    let h = end / f64::from(steps);
    let mut states = probe.recording.initial_states.clone();
    let at = |states: &[f64], t: f64| {
        let mut setting = setting(probe, &signals(t), t);
        setting.states = states.to_vec();
        probe.force_values(&setting)
    };
    let moved = |states: &[f64], rates: &[f64], h: f64| -> Vec<f64> {
        states.iter().zip(rates).map(|(x, rate)| x + h * rate).collect()
    };
    for step in 0..steps {
        let t = f64::from(step) * h;
        let k1 = at(&states, t).rates;
        let k2 = at(&moved(&states, &k1, 0.5 * h), t + 0.5 * h).rates;
        let k3 = at(&moved(&states, &k2, 0.5 * h), t + 0.5 * h).rates;
        let k4 = at(&moved(&states, &k3, h), t + h).rates;
        for k in 0..states.len() {
            states[k] += h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
        }
    }
    let outputs = at(&states, end).channels;
    (states, outputs)
}

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * (1.0 + expected.abs()), "found {found:e}, expected {expected:e}");
}
