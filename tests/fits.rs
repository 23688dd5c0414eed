//! Numbers of scenes from measurements: known ones are found again within their intervals, as often as these say; combinations that
//! measurements leave open are named.

use std::fmt::Write as _;
use std::path::Path;

use odyn::analyses::fit::{Fit, Request, fitted_scene};
use odyn::session::{Session, SessionError};

use crate::support::{Scratch, options, root};

/// A block between springs, pulled by hand.
const OSCILLATOR: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[parameters]
stiffness = 50   # N/m
[simulation]
t_end = 2
output_step = 0.1
[[body]]
name = "block"
mass = 2
inertia = [1, 1, 1]
position = [0.5, 0, 0]
velocity = [0.3, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "block"]
frames = [{ position = [-1, 0, 0] }, { position = [0, 0, 0] }]
params = { stiffness = "stiffness", damping = 1.5, free_length = 1 }
[[output]]
name = "x"
quantity = "position"
of = "block"
component = "x"
[[output]]
name = "v"
quantity = "velocity"
of = "block"
component = "x"
[[figure]]
name = "end"
channel = "x"
take = "final"
[[figure]]
name = "least"
channel = "x"
take = "min"
"#;

/// Normal numbers from a seed: SplitMix64 (Steele, Lea & Flood 2014) and Box & Muller (1958).
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

/// What the scene gives with these changes, with noise in x and v, at times between its samples.
fn measured(path: &Path, sets: &[&str], noise: [f64; 2], seed: u64) -> String {
    let mut random = Normal(seed);
    let times: Vec<f64> = (0..40).map(|k| 0.05 * (f64::from(k) + 0.9 * random.uniform())).collect();
    let mut run = Session::open(path, &options(sets, &[])).unwrap().prepare().unwrap().start().unwrap();
    let mut text = String::from("t,x [mm],v\n");
    for t in times {
        run.advance(t).unwrap();
        let x = run.output("x").unwrap() + noise[0] * random.next();
        let v = run.output("v").unwrap() + noise[1] * random.next();
        writeln!(text, "{t:?},{:?},{v:?}", 1e3 * x).unwrap();
    }
    text
}

fn request(vary: &[&str]) -> Request {
    Request { vary: vary.iter().map(|text| (*text).to_owned()).collect(), ..Request::default() }
}

fn try_fit(scene: &Path, table: Option<&Path>, request: &Request, sets: &[&str]) -> Result<Fit, SessionError> {
    Fit::of(scene, table, &options(sets, &[]), request, &|_| (), &Default::default())
}

#[track_caller]
fn fit(scene: &Path, table: &Path, request: &Request) -> Fit {
    try_fit(scene, Some(table), request, &[]).unwrap_or_else(|error| panic!("{error}"))
}

const TRUE: [&str; 3] = ["stiffness=57", "spring.params.damping=2.1", "block.velocity.x=-0.4"];
const VARIED: [&str; 3] = ["stiffness=10:200", "spring.params.damping=0:", "block.velocity.x"];
const TRUE_VALUES: [f64; 3] = [57.0, 2.1, -0.4];

#[test]
fn without_noise_the_numbers_are_found_to_many_digits() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let table = scratch.file("measured.csv", measured(&scene, &TRUE, [0.0, 0.0], 1));
    for formulation in ["joint", "cartesian"] {
        let set = format!("simulation.formulation={formulation}");
        let found = try_fit(&scene, Some(&table), &request(&VARIED), &[&set]).unwrap();
        assert_eq!(found.status, "converged", "{found:?}");
        for (one, value) in found.parameters.iter().zip(TRUE_VALUES) {
            assert!((one.value / value - 1.0).abs() < 1e-7, "{formulation} {one:?}");
        }
    }
}

#[test]
fn times_may_have_a_unit_of_their_own() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let table = measured(&scene, &TRUE, [0.0, 0.0], 1);
    let row = |line: &str| {
        let (time, rest) = line.split_once(',').unwrap();
        format!("{:?},{rest}\n", 1e3 * time.parse::<f64>().unwrap())
    };
    let in_ms = table.lines().skip(1).fold(String::from("t [ms],x [mm],v\n"), |text, line| text + &row(line));
    let found = fit(&scene, &scratch.file("ms.csv", in_ms), &request(&VARIED));
    for (one, value) in found.parameters.iter().zip(TRUE_VALUES) {
        assert!((one.value / value - 1.0).abs() < 1e-7, "{one:?}");
    }
    for (unit, expected) in [("m", "the times are in m, which is no time"), ("blinks", "blinks")] {
        let table = scratch.file("wrong.csv", table.replacen("t,", &format!("t [{unit}],"), 1));
        let refused = try_fit(&scene, Some(&table), &request(&VARIED), &[]).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

/// A hundred fits of two columns with noise that is not known: each interval has the true value in 95 % of them. The least that chance
/// leaves of 300 is 285 - 4 sqrt(300 0.05 0.95) = 269; of a hundred of one parameter 95 - 4 * 2.18 = 86.
#[test]
fn intervals_have_the_true_values_as_often_as_they_say() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let mut inside = [0; 3];
    let mut noise = [0.0; 2];
    for seed in 0..100 {
        let table = scratch
            .file("measured.csv", measured(&scene, &TRUE, [0.01, 0.05], 0x1234_5678_9abc + 0x9876_5432_1111 * seed));
        let found = fit(&scene, &table, &request(&VARIED));
        assert_eq!(found.status, "converged", "{seed} {:?}", found.notes);
        for ((one, value), inside) in found.parameters.iter().zip(TRUE_VALUES).zip(&mut inside) {
            *inside += usize::from(one.low <= value && value <= one.high);
        }
        found.columns.iter().zip(&mut noise).for_each(|(column, noise)| *noise += column.noise / 100.0);
    }
    eprintln!("inside {inside:?}, noise {noise:?}");
    assert!(inside.iter().all(|inside| *inside >= 86) && inside.iter().sum::<usize>() >= 269, "{inside:?}");
    // Nor are they wider than they need to be.
    assert!(inside.iter().sum::<usize>() < 300, "{inside:?}");
    // 80 numbers less 3 parameters tell the noise to 8 %, their mean over a hundred to 1 %.
    assert!((noise[0] / 0.01 - 1.0).abs() < 0.04 && (noise[1] / 0.05 - 1.0).abs() < 0.04, "{noise:?}");
}

#[test]
fn noise_that_is_given_sets_the_intervals() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let table = scratch.file("measured.csv", measured(&scene, &TRUE, [0.01, 0.05], 7));
    let with = |share: f64| {
        let noise = vec![("x".to_owned(), 0.01 * share), ("v".to_owned(), 0.05 * share)];
        fit(&scene, &table, &Request { noise, ..request(&VARIED) })
    };
    let (once, twice) = (with(1.0), with(2.0));
    for (a, b) in once.parameters.iter().zip(&twice.parameters) {
        assert!((b.error / a.error - 2.0).abs() < 1e-3, "{a:?} {b:?}");
        assert!(((a.high - a.value) / a.error - 1.959_964).abs() < 1e-4, "{a:?}");
        assert!((a.value - b.value).abs() < 0.01 * a.error, "{a:?} {b:?}");
    }
    assert!((0.6..1.6).contains(&(once.chi_square / once.freedoms as f64)), "{once:?}");
}

/// From the motion of a block on a spring alone, mass, stiffness and damping can be known up to a common factor.
#[test]
fn a_combination_that_is_not_determined_is_named() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    for noise in [[0.0, 0.0], [0.01, 0.05]] {
        let table = scratch.file("measured.csv", measured(&scene, &["stiffness=57"], noise, 3));
        let vary = ["stiffness=10:200", "block.mass=0.5:10", "spring.params.damping=0:9", "block.velocity.x"];
        let found = fit(&scene, &table, &request(&vary));
        assert_eq!((found.status, found.exit_code()), ("undetermined", 7));
        let [open] = found.undetermined.as_slice() else { panic!("{:?}", found.undetermined) };
        let keys: Vec<&str> = open.parts.iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(keys, ["stiffness", "block.mass", "spring.params.damping"]);
        assert!(open.parts.iter().all(|(_, share)| (share - 1.0).abs() < 1e-5), "{open:?}");
        let known: Vec<bool> = found.parameters.iter().map(|one| !one.undetermined && one.error.is_finite()).collect();
        assert_eq!(known, [false, false, false, true]);
        // What is determined is right all the same.
        let [stiffness, mass] = [0, 1].map(|k| found.parameters[k].value);
        assert!((stiffness / mass / 28.5 - 1.0).abs() < 0.02, "{found:?}");
        assert!(found.overview().contains("together is not known at all"), "{}", found.overview());
    }
}

/// A velocity that is 0, without damping: x = x0 cos(w t) + v / w sin(w t). What is measured without noise gives all numbers, and with noise
/// errors are those of the covariance of all three, however the estimate of the velocity compares with its own error.
#[test]
fn a_number_that_is_zero_is_known_as_the_others_are() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR.replace("damping = 1.5", "damping = 0"));
    let truth = ["stiffness=57", "block.velocity.x=0"];
    let vary = ["stiffness=10:200", "block.position.x", "block.velocity.x=-1:1"];
    let columns = vec![("x".to_owned(), "x".to_owned())];
    let exact = scratch.file("exact.csv", measured(&scene, &truth, [0.0, 0.0], 1));
    for set in ["block.velocity.x=0.3", "block.velocity.x=0"] {
        let request = Request { columns: columns.clone(), ..request(&vary) };
        let found = try_fit(&scene, Some(&exact), &request, &[set]).expect("the scene runs");
        assert_eq!(found.status, "converged", "{set} {}", found.overview());
        let values: Vec<f64> = found.parameters.iter().map(|one| one.value).collect();
        let off = [values[0] / 57.0 - 1.0, values[1] / 0.5 - 1.0, values[2]];
        assert!(off.iter().all(|off| off.abs() < 1e-7), "{set} {values:?}");
    }
    for seed in [2, 3, 5, 8] {
        let text = measured(&scene, &truth, [0.002, 0.0], seed);
        let times = text.lines().skip(1).map(|line| line.split(',').next().and_then(|time| time.parse().ok()));
        let times: Vec<f64> = times.collect::<Option<_>>().expect("times are numbers");
        let table = scratch.file("measured.csv", text);
        let noise = vec![("x".to_owned(), 0.002)];
        let found = fit(&scene, &table, &Request { noise, columns: columns.clone(), ..request(&vary) });
        assert_eq!(found.status, "converged", "{seed} {}", found.overview());
        let [k, x, v] = [0, 1, 2].map(|one| found.parameters[one].value);
        let w = (k / 2.0).sqrt();
        let row = |t: f64| {
            let (sin, cos) = (w * t).sin_cos();
            [(-x * t * sin - v / (w * w) * sin + v / w * t * cos) / (4.0 * w), cos, sin / w]
        };
        let jacobian = nalgebra::DMatrix::from_fn(times.len(), 3, |at, one| row(times[at])[one] / 0.002);
        let covariance = jacobian.tr_mul(&jacobian).try_inverse().expect("all three are determined");
        for (one, fitted) in found.parameters.iter().enumerate() {
            let expected = covariance[(one, one)].sqrt();
            assert!((fitted.error / expected - 1.0).abs() < 1e-5, "{seed} {expected} {fitted:?}");
        }
    }
}

/// A direction that is known to no better than 100 % is reported; what it adds to the errors of numbers outside of it is in these.
#[test]
fn what_is_hardly_known_widens_the_intervals_beside_it() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let table = scratch.file("measured.csv", measured(&scene, &["block.velocity.x=0.002"], [0.0, 0.0], 4));
    let noise = vec![("x".to_owned(), 0.01), ("v".to_owned(), 0.05)];
    let with = |range: &str| {
        let vary = ["stiffness=10:200".to_owned(), "block.position.x".into(), format!("block.velocity.x={range}")];
        let request = Request { noise: noise.clone(), vary: vary.into(), ..Request::default() };
        try_fit(&scene, Some(&table), &request, &["block.velocity.x=0.002"]).expect("the scene runs")
    };
    // The size of the velocity is where it begins, or a thousandth of its range.
    let (hardly, well) = (with(":"), with("-500:500"));
    assert_eq!((hardly.status, well.status), ("undetermined", "converged"), "{}{}", hardly.overview(), well.overview());
    assert!(hardly.parameters[2].undetermined && hardly.parameters[2].error.is_nan(), "{hardly:?}");
    for (one, other) in hardly.parameters.iter().zip(&well.parameters).take(2) {
        assert!((one.error / other.error - 1.0).abs() < 1e-6, "{one:?} {other:?}");
    }
}

#[test]
fn a_bound_holds() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let table = scratch.file("measured.csv", measured(&scene, &TRUE, [0.001, 0.005], 5));
    let found = fit(&scene, &table, &request(&["stiffness=10:55", "block.velocity.x"]));
    let [stiffness, velocity] = found.parameters.as_slice() else { panic!() };
    assert!(stiffness.at_bound && stiffness.value == 55.0 && stiffness.error.is_nan(), "{stiffness:?}");
    assert!(!velocity.at_bound && velocity.error.is_finite(), "{velocity:?}");
}

#[test]
fn figures_alone_are_fitted_and_the_scene_is_written() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let session = Session::open(&scene, &options(&["stiffness=57", "spring.params.damping=2.1"], &[])).unwrap();
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    let figures = report.summary.figures.iter().map(|one| (one.name.clone(), one.value.unwrap(), Some(1e-3))).collect();
    let request = Request { figures, ..request(&["stiffness=10:200", "spring.params.damping=0.1:9"]) };
    let found = try_fit(&scene, None, &request, &[]).unwrap_or_else(|error| panic!("{error}"));
    for (one, value) in found.parameters.iter().zip([57.0, 2.1]) {
        assert!((one.value / value - 1.0).abs() < 1e-6 && one.error > 0.0, "{one:?}");
    }
    let text = fitted_scene(&scene, &[], &found).unwrap();
    assert!(text.contains("   # N/m") && text.contains("stiffness = \"stiffness\""), "{text}");
    let again = scratch.file("fitted.toml", text);
    let again = Session::open(&again, &options(&[], &[])).unwrap();
    assert_eq!(again.scene.parameters.get("stiffness").unwrap().value.si, found.parameters[0].value);
    // A number from the command line has no place in the file.
    let set = odyn::scene::Override::new("stiffness=50");
    assert!(fitted_scene(&scene, &[set], &found).unwrap_err().to_string().contains("from the command line"));
}

/// Beside a table, figures are those that a run of the scene prints: on its own samples, not on the measured times.
#[test]
fn figures_beside_a_table_are_those_of_a_run() {
    let scratch = Scratch::new();
    let more = "\n[[figure]]\nname = \"effective\"\nchannel = \"v\"\ntake = \"rms\"\n";
    let scene = scratch.file("scene.toml", OSCILLATOR.to_owned() + more);
    let session = Session::open(&scene, &options(&TRUE, &[])).expect("the scene is right");
    let report = session.run(None, Box::new(|_| ()), &Default::default()).expect("the scene runs");
    let figures: Vec<_> = report.summary.figures.iter().map(|one| (one.name.clone(), one.value)).collect();
    let figures = figures.into_iter().map(|(name, value)| (name, value.expect("it has a value"), Some(1e-3))).collect();
    let table = scratch.file("measured.csv", measured(&scene, &TRUE, [0.0, 0.0], 6));
    let noise = vec![("x".to_owned(), 1e-3), ("v".to_owned(), 1e-3)];
    let found = fit(&scene, &table, &Request { figures, noise, ..request(&VARIED) });
    for (one, value) in found.parameters.iter().zip(TRUE_VALUES) {
        assert!((one.value / value - 1.0).abs() < 1e-7, "{one:?}");
    }
    for one in found.columns.iter().filter(|column| column.output == "figure") {
        assert!((one.fitted[0] / one.measured[0] - 1.0).abs() < 1e-8, "{one:?}");
    }
}

/// Noise of a column is estimated from its rows less what the numbers take of these. A second block, measured beside the first, tells nothing
/// of it: errors and intervals are those of the first column alone.
#[test]
fn a_column_that_tells_nothing_changes_nothing() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let text = measured(&scene, &TRUE, [0.01, 0.0], 12);
    let mut random = Normal(77);
    let beside = text.lines().skip(1).take(8).map(|line| {
        let values: Vec<&str> = line.split(',').collect();
        format!("{},{},{:?}\n", values[0], values[1], 4.0 + 0.02 * random.next())
    });
    let table = scratch.file("measured.csv", String::from("t,x [mm],other\n") + &beside.collect::<String>());
    let other = "\n[[body]]\nname = \"other\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [4, 0, 0]\n\
                 [[output]]\nname = \"other\"\nquantity = \"position\"\nof = \"other\"\ncomponent = \"x\"\n";
    let scene = scratch.file("both.toml", OSCILLATOR.to_owned() + other);
    let with = |columns: &[&str], vary: &[&str]| {
        let columns = columns.iter().map(|name| ((*name).to_owned(), (*name).to_owned())).collect();
        fit(&scene, &table, &Request { columns, ..request(vary) })
    };
    let (alone, both) = (with(&["x"], &VARIED), with(&["x", "other"], &VARIED));
    for (a, b) in alone.parameters.iter().zip(&both.parameters) {
        assert!((b.error / a.error - 1.0).abs() < 1e-4 && (b.high / a.high - 1.0).abs() < 1e-3, "{a:?} {b:?}");
    }
    // All eight rows of what no number changes are for its noise.
    let other = &both.columns[1];
    assert!((other.noise / other.rms - 1.0).abs() < 1e-4, "{other:?}");
    // A number at its bound takes nothing.
    let bound = with(&["x"], &["stiffness=10:40", "block.velocity.x"]);
    assert!(bound.parameters[0].at_bound && !bound.parameters[1].at_bound, "{bound:?}");
    let x = &bound.columns[0];
    assert!((x.noise / x.rms / (8.0_f64 / 7.0).sqrt() - 1.0).abs() < 1e-6, "{x:?}");
}

/// Steps to where the scene does not run are shortened, and that is reported.
#[test]
fn trials_that_fail_are_shortened() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let table = scratch.file("measured.csv", measured(&scene, &["spring.params.damping=0.01"], [0.0, 0.0], 9));
    // Damping below zero is refused by the element; without a bound, steps from 20 try it.
    let found =
        try_fit(&scene, Some(&table), &request(&["spring.params.damping"]), &["spring.params.damping=8"]).unwrap();
    assert!(found.shortened > 0 && found.notes.iter().any(|note| note.contains("shortened")), "{found:?}");
    assert!((found.parameters[0].value - 0.01).abs() < 1e-6, "{found:?}");
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", OSCILLATOR);
    let told = |content: &str, request: &Request| {
        let table = scratch.file("measured.csv", content);
        try_fit(&scene, Some(&table), request, &[]).unwrap_err().to_string()
    };
    let one = request(&["stiffness=10:200"]);
    assert!(told("t,y\n0,1\n", &one).contains("no output `y`"));
    assert!(told("t,x [s]\n0,1\n", &one).contains("column `x` is in s, the output `x` in m"));
    assert!(told("t,x\n0,1\n", &request(&VARIED)).contains("1 measured numbers cannot determine 3"));
    assert!(told("t,x\n0,1\n3,1\n", &one).contains("t = 3 s is measured, the scene runs from 0 to 2 s"));
    assert!(told("t,x\n0,0.5\n1,0.1\n", &request(&["block.inertia.0=0.5:2"])).contains("changes nothing"));
    assert!(told("t,x\n0,0.5\n1,0.1\n", &request(&["stiffness=3:2"])).contains("leave no room"));
    assert!(told("t,x\n0,0.5\n1,0.1\n", &request(&["block.mass=1m:2m"])).contains("`1m` is no value"));
    let figures = vec![("no such".to_owned(), 1.0, None)];
    assert!(told("t,x\n0,0.5\n1,0.1\n", &Request { figures, ..one.clone() }).contains("no figure `no such`"));
    let noise = vec![("y".to_owned(), 1.0)];
    assert!(told("t,x\n0,0.5\n1,0.1\n", &Request { noise, ..one }).contains("no column `y`"));
}

/// The paper's fit: the friction of the main bearing from the mean and the ripple of the speed. What was measured is not printed
/// there; what the paper's coefficient gives stands for it.
#[test]
fn the_compressors_friction_is_found_from_speed_and_ripple() {
    let text = std::fs::read_to_string(root().join("scenes/compressor.toml")).unwrap();
    let figures = "\n[[figure]]\nname = \"mean speed\"\nchannel = \"omega\"\ntake = \"mean\"\nfrom = 100\n\
                   [[figure]]\nname = \"lowest speed\"\nchannel = \"omega\"\ntake = \"min\"\nfrom = 100\n\
                   [[figure]]\nname = \"highest speed\"\nchannel = \"omega\"\ntake = \"max\"\nfrom = 100\n";
    let scratch = Scratch::new();
    let scene = scratch.file("scene.toml", text + figures);
    let session = Session::open(&scene, &options(&[], &[])).unwrap();
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    let speeds = report.summary.figures.iter().filter(|figure| figure.name.ends_with("speed"));
    let figures = speeds.map(|one| (one.name.clone(), one.value.unwrap(), Some(1e-4))).collect();
    let key = "bearing_friction.params.damping";
    let request = Request { figures, ..request(&[&format!("{key}=0:50 N mm ms/rad")]) };
    let found = try_fit(&scene, None, &request, &[&format!("{key}=10 N mm ms/rad")]).unwrap_or_else(|e| panic!("{e}"));
    let one = &found.parameters[0];
    assert_eq!((found.status, one.unit.as_str()), ("converged", "kN mm ms/rad"));
    assert!((one.value / 2.5e-3 - 1.0).abs() < 1e-3, "{one:?}");
    // A speed known to 0.03 % leaves the coefficient open to a quarter: it changes the speed by 0.05 % for all of itself.
    assert!((0.2..0.4).contains(&(one.error / one.value)), "{one:?}");
}
