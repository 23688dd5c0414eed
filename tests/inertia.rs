//! Elements that bring kinetic energy: by every formulation and method, against bodies, finite elements and closed forms.

use nalgebra::DMatrix;
use odyn::analyses::linear::Linear;
use odyn::analyses::modes::{Modes, Share};
use odyn::analyses::statics::equilibrium;
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, assert_same_motion, column, difference, options, root, run};

#[path = "examples/craig_bampton.rs"]
#[allow(dead_code)]
pub(crate) mod craig_bampton;

use craig_bampton::{BEAM, Beam, MODES};

const WAYS: [&[&str]; 6] = [
    &["simulation.formulation=\"cartesian\""],
    &["simulation.formulation=\"joint\""],
    &["simulation.method=\"radau5\""],
    &["simulation.engine=\"reference\""],
    &["simulation.engine=\"interpreted\""],
    &["simulation.formulation=\"cartesian\"", "simulation.method=\"radau5\""],
];

/// A run by all ways; the motion of the first.
fn all_ways(scene: &str, t_end: &str, tolerance: f64) -> RunReport {
    let first = run(scene, &[t_end]);
    for way in WAYS {
        let sets = [way, &[t_end]].concat();
        assert_same_motion(&run(scene, &sets), &first, tolerance);
    }
    first
}

#[test]
fn every_formulation_and_method_gives_the_same_motion() {
    all_ways("verification/inerter.toml", "simulation.t_end=1", 1e-7);
    all_ways("verification/added-mass.toml", "simulation.t_end=0.4", 1e-6);
    all_ways("verification/modal-body.toml", "simulation.t_end=0.02", 1e-5);
}

/// Motors with inertia in the hinges of a chain, geared so that they turn against the links before: in coordinates of joints a part of the
/// mass matrix, and nothing is iterated.
#[test]
fn inertia_in_joints_is_a_part_of_the_mass_matrix() {
    let mut scene = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.5\noutput_step = 0.1\n"
        .to_owned();
    for k in 0..5 {
        let (before, axis) =
            (if k == 0 { "ground".into() } else { format!("b{}", k - 1) }, ["[0, 1, 0]", "[1, 0.2, 0]"][k % 2]);
        scene += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = 1\ninertia = [0.01, 0.02, 0.03]\nposition = [{x}, 0, 0]\n\
             [[joint]]\nname = \"j{k}\"\ntype = \"revolute\"\nbodies = [\"{before}\", \"b{k}\"]\npoint = [{k}, 0, 0]\naxis = {axis}\n\
             [[force]]\nname = \"m{k}\"\ntype = \"rotational-inerter\"\nbodies = [\"{before}\", \"b{k}\"]\npoint = [{k}, 0, 0]\n\
             axis = {axis}\nparams.inertance = {inertance}\n\
             [[output]]\nname = \"q{k}\"\nquantity = \"coordinate\"\nof = \"j{k}\"\n\
             [[output]]\nname = \"r{k}\"\nquantity = \"reaction_torque\"\nof = \"j{k}\"\ncomponent = \"x\"\n",
            x = k as f64 + 0.5,
            inertance = 0.1 * (k + 1) as f64,
        );
    }
    let by = |formulation: &str| try_text(&scene, &[&format!("simulation.formulation={formulation:?}")]).unwrap();
    let (joint, cartesian) = (by("joint"), by("cartesian"));
    assert_same_motion(&joint, &cartesian, 1e-8);
    assert!(joint.summary.coupling_iterations == 0 && cartesian.summary.coupling_iterations > 0);
}

/// Of axes that are nearly those of the ground, some velocities have next to no share in the energy: it is never negative for that.
#[test]
fn an_axis_that_is_nearly_that_of_the_ground_is_an_axis() {
    let scene = |lean: f64| {
        format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 0.2\noutput_step = 0.1\n\
             [[body]]\nname = \"arm\"\nmass = 2\ninertia = [0.01, 0.06, 0.06]\nposition = [0.3, 0, 0]\n\
             [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\naxis = [{lean:e}, {lean:e}, 1]\n\
             [[force]]\nname = \"rotor\"\ntype = \"rotational-inerter\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\n\
             axis = [{lean:e}, {lean:e}, 1]\nparams.inertance = 0.2\n[[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"hinge\"\n"
        )
    };
    let end = |lean: f64| *column(&try_text(&scene(lean), &[]).unwrap(), "angle").last().unwrap();
    let straight = end(0.0);
    for power in [7, 8, 9, 12, 14, 15, 16, 17, 20, 40, 150, 300] {
        let leaning = end(10.0_f64.powi(-power));
        assert!((leaning - straight).abs() < 1e-8, "1e-{power}: {leaning} {straight}");
    }
}

/// Of points that are next to their line, turns have next to no share in the energy, and it is never negative for that.
#[test]
fn points_that_are_nearly_on_their_line_are_on_it() {
    let scene = |off: f64| {
        format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 0.2\noutput_step = 0.1\n\
             [[body]]\nname = \"slider\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\nposition = [0.3, 0.7, -0.4]\n\
             [[joint]]\nname = \"slide\"\ntype = \"translational\"\nbodies = [\"ground\", \"slider\"]\npoint = [0.3, 0.7, -0.4]\naxis = [3, -7, 5]\n\
             [[force]]\nname = \"rotor\"\ntype = \"inerter\"\nbodies = [\"ground\", \"slider\"]\n\
             points = [[0, 1.4, -0.9], [{:.17}, 0.7, -0.4]]\naxis = [3, -7, 5]\nparams = {{ inertance = 5, guided = true }}\n\
             [[output]]\nname = \"s\"\nquantity = \"coordinate\"\nof = \"slide\"\n",
            0.3 + off
        )
    };
    let end = |off: f64| *column(&try_text(&scene(off), &[]).unwrap(), "s").last().unwrap();
    let straight = end(0.0);
    for power in [4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16] {
        let aside = end(10.0_f64.powi(-power));
        assert!((aside - straight).abs() < 1e-9, "1e-{power}: {aside} {straight}");
    }
}

/// A slide that turns about the ground, with a guided inerter along it: off the line of its points or on it, where it is the same.
#[test]
fn a_guided_inerter_follows_its_slide_wherever_its_points_are() {
    let scene = |i: &str, j: &str| {
        format!(
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1\noutput_step = 0.1\n\
             [[body]]\nname = \"arm\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nangular_velocity = [0, 0, 3]\n\
             [[body]]\nname = \"slider\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\nangular_velocity = [0, 0, 3]\n\
             [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"arm\"]\naxis = [0, 0, 1]\n\
             [[joint]]\nname = \"slide\"\ntype = \"translational\"\nbodies = [\"arm\", \"slider\"]\naxis = [1, 0, 0]\n\
             [[force]]\nname = \"rotor\"\ntype = \"inerter\"\nbodies = [\"arm\", \"slider\"]\n\
             frames = [{{ position = {i}, axis = [1, 0, 0] }}, {{ position = {j}, axis = [1, 0, 0] }}]\n\
             params = {{ inertance = 5, guided = true }}\n\
             [[output]]\nname = \"s\"\nquantity = \"coordinate\"\nof = \"slide\"\n"
        )
    };
    let along = column(&try_text(&scene("[0, 0, 0]", "[0, 0, 0]"), &[]).unwrap(), "s").to_vec();
    assert!(along.iter().any(|s| s.abs() > 0.1), "{along:?}");
    for (i, j) in [("[0.1, 0, 0]", "[-0.3, 0, 0]"), ("[0, 0.7, 0]", "[0.2, -0.4, 0.3]"), ("[0.5, 0, 0.2]", "[0, 2, 0]")]
    {
        for formulation in ["cartesian", "joint"] {
            let sets = [&*format!("simulation.formulation=\"{formulation}\"")];
            let found = column(&try_text(&scene(i, j), &sets).unwrap(), "s").to_vec();
            for (here, there) in along.iter().zip(found) {
                assert!((here - there).abs() < 1e-8, "{i} {j} {formulation}: {here} {there}");
            }
        }
    }
}

/// What the scenes here read.
pub(crate) fn write_files(scratch: &Scratch) {
    std::fs::write(scratch.path().join("beam.csv"), craig_bampton::lines(&BEAM, MODES)).unwrap();
    let geometric = craig_bampton::geometric_lines(&BEAM, MODES);
    std::fs::write(scratch.path().join("stiffening.csv"), geometric).unwrap();
}

pub(crate) fn try_text(text: &str, sets: &[&str]) -> Result<RunReport, String> {
    let scratch = Scratch::new();
    write_files(&scratch);
    let session = Session::open(&scratch.file("scene.toml", text), &options(sets, &[])).map_err(|e| e.to_string())?;
    session.run(None, Box::new(|_| ()), &Default::default()).map_err(|error| error.to_string())
}

/// A double pendulum in a vertical plane; a rotor, a screw and added masses ride on it.
const MACHINE: &str = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 1
output_step = 0.05
tolerance = 1e-10
[[body]]
name = "upper"
mass = 1
inertia = [0.01, 0.1, 0.1]
position = [0.5, 0, 0]
angular_velocity = [0, 0, 1]
[[body]]
name = "lower"
mass = 0.5
inertia = [0.01, 0.05, 0.05]
position = [1, -0.4, 0]
orientation = { axis = [0, 0, 1], angle = "-90 deg" }
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "upper"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "elbow"
type = "revolute"
bodies = ["upper", "lower"]
point = [1, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "screw"
type = "inerter"
bodies = ["ground", "lower"]
points = [[0, -1, 0], [1, -0.6, 0]]
params.inertance = 4
[[force]]
name = "load"
type = "added-mass"
bodies = ["lower"]
point = [1, -0.8, 0.1]
params = { mass = 3, apparent_mass = [1, 0, 2], inertia = [0.1, 0.2, 0.1], gravity = [0, -9.81, 0] }
[[output]]
name = "y"
quantity = "position"
of = "lower"
component = "y"
[[output]]
name = "w"
quantity = "angular_velocity"
of = "lower"
component = "z"
[[output]]
name = "F"
quantity = "reaction_force"
of = "pivot"
component = "x"
[[output]]
name = "M"
quantity = "reaction_torque"
of = "elbow"
component = "x"
[[output]]
name = "screw_F"
quantity = "force"
of = "screw"
on = "lower"
component = "y"
[[output]]
name = "balance"
quantity = "balance_force"
of = "lower"
component = "x"
[[output]]
name = "energy"
quantity = "total_energy"
"#;

#[test]
fn loads_balance_and_energy_stays_where_masses_ride_on_a_mechanism() {
    let first = try_text(MACHINE, &[]).unwrap();
    assert_eq!(first.exit_code(), 0, "{}", first.summary.reason);
    let energy = column(&first, "energy");
    assert!(energy.iter().all(|e| (e - energy[0]).abs() < 1e-7), "{energy:?}");
    assert!(column(&first, "balance").iter().all(|force| force.abs() < 1e-9));
    for way in WAYS {
        let other = try_text(MACHINE, way).unwrap();
        assert_eq!(other.exit_code(), 0, "{way:?} {}", other.summary.reason);
        for (channel, (a, b)) in first.channels.iter().zip(first.columns.iter().zip(&other.columns)) {
            let off = difference(a, b);
            assert!(off < 1e-6 || channel.name == "balance", "{way:?} `{}` differs by {off:.1e}", channel.name);
        }
    }
}

/// A cantilever by so many elements `beam`, with lumped masses, and a body at the tip.
fn chain(count: usize) -> String {
    let (l, line) = (BEAM.length / count as f64, BEAM.density * BEAM.area);
    let mut text = String::from(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 0.1\noutput_step = 0.1\n",
    );
    for k in 1..=count {
        let (mut mass, mut moment) = (line * l, line * l.powi(3) / 12.0);
        if k == count {
            (mass, moment) = (0.5 * mass + 0.054, 0.5 * moment + 1e-4);
        }
        let x = l * k as f64;
        text += &format!(
            "[[body]]\nname = \"n{k}\"\nmass = {mass:?}\ninertia = [1e-4, {moment:?}, {moment:?}]\nposition = [{x:?}, 0, 0]\n"
        );
        let before = if k == 1 { "ground".into() } else { format!("n{}", k - 1) };
        let Beam { young, shear, area, iy, iz, torsion, .. } = BEAM;
        text += &format!(
            "[[force]]\nname = \"b{k}\"\ntype = \"beam\"\nbodies = [\"{before}\", \"n{k}\"]\n\
             frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]\n\
             params = {{ length = {l:?}, young = {young:?}, shear = {shear:?}, area = {area:?}, iy = {iy:?}, iz = {iz:?}, torsion = {torsion:?} }}\n"
        );
    }
    text
}

/// The same by a modal body.
pub(crate) fn modal(mode: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 0.1
output_step = 0.1
[[body]]
name = "tip"
mass = 0.054
inertia = [1e-4, 1e-4, 1e-4]
position = [1, 0, 0]
[[force]]
name = "beam"
type = "modal-body"
bodies = ["ground", "tip"]
frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]
[force.params]
matrices = {{ file = "beam.csv", columns = ["row", "column", "mass", "stiffness"] }}
points = [0, 0, 0, 1, 0, 0]
{mode}
[[output]]
name = "z"
quantity = "position"
of = "tip"
component = "z"
"#
    )
}

/// The beam of `modal-body-free`, as [`try_text`] reads it, without the checks.
pub(crate) fn tumbling() -> String {
    let text = std::fs::read_to_string(root().join("scenes/verification/modal-body-free.toml")).unwrap();
    text.split("[[check]]").next().unwrap().replace("modal-body-beam.csv", "beam.csv")
}

/// Modes where a scene starts.
fn modes(text: &str) -> Modes {
    let scratch = Scratch::new();
    write_files(&scratch);
    let path = scratch.file("scene.toml", text);
    let make = || Session::open(&path, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
    let mut started = make().prepare().unwrap().start().unwrap();
    let instant = started.instant().unwrap();
    let session = make();
    let linear = Linear::at(&session, &instant, Some(&[]), Some(&[])).unwrap_or_else(|error| panic!("{error}"));
    Modes::of(&session, &linear).unwrap()
}

/// Frequencies where a scene starts, rad/s, ascending.
pub(crate) fn frequencies(text: &str) -> Vec<f64> {
    modes(text).modes.iter().map(|mode| mode.imaginary).filter(|w| *w > 0.0).collect()
}

/// Energies of a mode add up, and are those of their elements.
#[test]
fn modes_say_whose_energy_they_are() {
    let share = |list: &[Share], name: &str| list.iter().find(|one| one.name == name).map_or(0.0, |one| one.share);
    let sum = |list: &[Share]| list.iter().map(|one| one.share).sum::<f64>();
    // A slide of 2 kg and an inerter of 3 kg on a spring.
    let slide = std::fs::read_to_string(root().join("plugins/forces/src/inerter.rs")).unwrap();
    let slide: String =
        slide.lines().filter_map(|line| line.strip_prefix("//! ")).fold(String::new(), |text, line| text + line + "\n");
    let slide = slide.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let found = modes(slide);
    let own = found.modes.iter().find(|mode| mode.imaginary > 0.0).unwrap();
    assert!(
        (share(&own.kinetic, "slide") - 0.4).abs() < 1e-12 && (share(&own.kinetic, "flywheel") - 0.6).abs() < 1e-12
    );
    assert!((share(&own.potential, "spring") - 1.0).abs() < 1e-9, "{own:?}");
    // Of the cantilever, each mode's.
    let found = modes(&modal("").replace("gravity = [0, 0, -9.81]", ""));
    assert!(found.modes.len() >= 10);
    for mode in &found.modes {
        assert!((sum(&mode.kinetic) - 1.0).abs() < 1e-5 && (sum(&mode.potential) - 1.0).abs() < 1e-5, "{mode:?}");
        assert!(share(&mode.potential, "beam") > 0.999, "{mode:?}");
    }
    // The tip has a mass of 0.1 m: Rayleigh's beam with a mass at its end.
    let (line, tip) = (BEAM.density * BEAM.area, 0.054);
    let lowest = &found.modes[0];
    let about = tip / (tip + 33.0 / 140.0 * line);
    assert!((share(&lowest.kinetic, "tip") - about).abs() < 0.02, "{lowest:?} {about}");
}

/// beta L of a cantilever of Euler and Bernoulli with a mass and a moment of inertia at the tip (shares of those of the beam, m L^2).
fn lowest_root(mass: f64, moment: f64, from: f64, to: f64) -> f64 {
    let determinant = |b: f64| {
        let (s, c, sh, ch) = (b.sin(), b.cos(), b.sinh(), b.cosh());
        // W = a (sin - sinh) + b (cos - cosh), its derivatives over beta^k.
        let (w, slope) = ([s - sh, c - ch], [c - ch, -s - sh]);
        let (bending, shear) = ([-s - sh, -c - ch], [-c - ch, s - sh]);
        let row = |k: usize| (bending[k] - b.powi(3) * moment * slope[k], shear[k] + b * mass * w[k]);
        row(0).0 * row(1).1 - row(1).0 * row(0).1
    };
    let (mut low, mut high) = (from, to);
    assert!(determinant(low) * determinant(high) < 0.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if determinant(low) * determinant(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_cantilever_has_the_frequencies_of_the_closed_form_and_of_a_chain_of_beams() {
    let line = BEAM.density * BEAM.area;
    let (mass, moment) = (0.054 / line, 1e-4 / line);
    let first = lowest_root(mass, moment, 1.5, 1.9);
    let closed = |second: f64| first.powi(2) * (BEAM.young * second / line).sqrt();
    let modal = frequencies(&modal("").replace("gravity = [0, 0, -9.81]", ""));
    for (found, second) in modal.iter().zip([BEAM.iy, BEAM.iz]) {
        let off = found / closed(second) - 1.0;
        assert!((0.0..2e-5).contains(&off), "{found} rad/s, {off:e} above the closed form");
    }
    // Elements with shear, masses in points.
    let chain = frequencies(&chain(16));
    for (found, expected) in modal.iter().zip(&chain).take(2) {
        assert!((found / expected - 1.0).abs() < 3e-3, "{modal:?} {chain:?}");
    }
    // The same by the matrices alone.
    let (omega, _, _) = craig_bampton::lowest(&BEAM, MODES, (0.054, 1e-4));
    assert!((modal[1] / omega - 1.0).abs() < 1e-9, "{} {omega}", modal[1]);
}

#[test]
fn a_cantilever_hangs_by_its_weight_as_the_closed_form_says() {
    let scratch = Scratch::new();
    write_files(&scratch);
    for g in [9.81, 0.0981, 9.81e-6] {
        let text = modal("gravity = [0, 0, -9.81]").replace("-9.81]", &format!("-{g:?}]"));
        let path = scratch.file("scene.toml", text);
        let session = Session::open(&path, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
        let found = equilibrium(&session, &mut |_| ()).unwrap_or_else(|error| panic!("{g}: {error}"));
        let z = found.outputs[0].value;
        let (line, rigidity) = (BEAM.density * BEAM.area * g, BEAM.young * BEAM.iy);
        let expected = -(0.054 * g / (3.0 * rigidity) + line / (8.0 * rigidity));
        assert!((z / expected - 1.0).abs() < 1e-9, "{g}: {z} {expected}");
    }
}

#[test]
fn the_file_of_the_verification_scenes_is_that_of_the_example() {
    let kept = std::fs::read_to_string(root().join("scenes/verification/modal-body-beam.csv")).unwrap();
    let numbers = |text: &str| -> Vec<Vec<f64>> {
        let lines = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        lines.map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect()
    };
    let (kept, made) = (numbers(&kept), numbers(&craig_bampton::lines(&BEAM, MODES)));
    assert_eq!(kept.len(), made.len());
    for (kept, made) in kept.iter().zip(&made) {
        assert_eq!(kept[..2], made[..2]);
        assert!(kept.iter().zip(made).all(|(a, b)| (a - b).abs() <= 1e-8 * b.abs()), "{kept:?} {made:?}");
    }
}

#[test]
fn the_reduction_keeps_the_rigid_body() {
    let (mass, stiffness) = BEAM.reduce(MODES);
    let mut turn = DMatrix::zeros(mass.nrows(), 1);
    [(5, 1.0), (7, BEAM.length), (11, 1.0)].iter().for_each(|(k, value)| turn[(*k, 0)] = *value);
    let moment = (turn.transpose() * &mass * &turn)[(0, 0)];
    let expected = BEAM.density * BEAM.area * BEAM.length.powi(3) / 3.0;
    assert!((moment / expected - 1.0).abs() < 1e-9, "{moment} {expected}");
    assert!((stiffness * turn).amax() < 1e-6);
}

#[test]
fn a_run_goes_on_from_a_checkpoint() {
    let whole = run("verification/modal-body.toml", &["simulation.t_end=0.02"]);
    let by_parts = run("verification/modal-body.toml", &["simulation.t_end=0.02", "simulation.checkpoint_every=0.006"]);
    assert_same_motion(&by_parts, &whole, 1e-7);
}

#[test]
fn bodies_may_be_lighter_than_what_an_element_brings_by_many_decades() {
    let line = BEAM.density * BEAM.area;
    let closed = lowest_root(0.0, 0.0, 1.5, 2.0).powi(2) * (BEAM.young * BEAM.iy / line).sqrt();
    for (mass, moment) in [(1e-7, 1e-9), (1e-13, 1e-15)] {
        let light = modal("").replace("0.054", &format!("{mass:?}")).replace("1e-4", &format!("{moment:?}"));
        let found = frequencies(&light);
        assert!((found[0] / closed - 1.0).abs() < 3e-5, "{} {closed}", found[0]);
        let sets = [
            format!("mt={mass:?}"),
            format!("Jt={moment:?}"),
            "simulation.t_end=0.01".to_owned(),
            "simulation.formulation=\"cartesian\"".to_owned(),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let bodies = run("verification/modal-body-free.toml", &sets);
        assert_same_motion(&run("verification/modal-body-free.toml", &sets[..3]), &bodies, 1e-6);
        // (m + 2 m_t) v + omega x d.
        let momentum = column(&bodies, "p_z");
        let expected = 0.54 * 0.5 - 12e-4 * 3.052780156471e-1;
        assert!(momentum.iter().all(|p| (p - expected).abs() < 1e-7 + mass), "{momentum:?}");
    }
}

/// Two bodies hang in balance, to round-off: nothing accelerates, and inertia has to be found all the same.
#[test]
fn what_rests_in_balance_starts() {
    let text = r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[parameters]
m = 3.3
k = 1234.5
[simulation]
gravity = [0, 0, -9.81]
t_end = 2
output_step = 0.5
[[body]]
name = "weight"
mass = "m"
inertia = [0.1, 0.1, 0.1]
position = [0, 0, -0.7]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "weight"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "weight"]
points = [[0, 0, 0], [0, 0, -0.7]]
params = { stiffness = "k", free_length = "0.7 - 9.81 * m / k" }
[[force]]
name = "inerter"
type = "inerter"
bodies = ["ground", "weight"]
points = [[0.3, 0, 0], [0.3, 0, -0.7]]
params.inertance = 7.7
[[output]]
name = "z"
quantity = "position"
of = "weight"
component = "z"
"#;
    for way in WAYS.iter().filter(|way| !way[0].contains("reference")) {
        let report = try_text(text, way).unwrap_or_else(|error| panic!("{way:?}: {error}"));
        assert_eq!(report.exit_code(), 0, "{way:?}: {}", report.summary.reason);
        assert!(column(&report, "z").iter().all(|z| (z + 0.7).abs() < 1e-12), "{way:?}");
    }
}

/// Two links of 1 kg, of which the second's angular velocity is given, with a rotor of b between them. With w of the first link:
/// 2 T = (0.1 + 1) w^2 + (2 w + 1)^2 + 0.1 + b (1 - w)^2, which is least where (1.1 + 4 + b) w = b - 2.
#[test]
fn open_velocities_are_those_of_least_energy_with_elements_between_bodies() {
    let text = |element: &str| {
        let mut text =
            "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = 1e-9\noutput_step = 1e-9\n"
                .to_owned();
        for (name, x, more) in [("a", 1, ""), ("b", 3, "angular_velocity = [0, 0, 1]")] {
            text += &format!(
                "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x}, 0, 0]\n{more}\n"
            );
        }
        for (name, bodies, x) in [("ja", ["ground", "a"], 0), ("jb", ["a", "b"], 2)] {
            text += &format!(
                "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = {bodies:?}\npoint = [{x}, 0, 0]\n"
            );
        }
        text + element
            + "[[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"a\"\ncomponent = \"z\"\n\
               [[output]]\nname = \"T\"\nquantity = \"kinetic_energy\"\n"
    };
    let rotor = |b: f64| {
        format!(
            "[[force]]\nname = \"rotor\"\ntype = \"rotational-inerter\"\nbodies = [\"a\", \"b\"]\nparams.inertance = {b:e}\n"
        )
    };
    for b in [1e-3, 1.0, 100.0, 1e5] {
        let report = try_text(&text(&rotor(b)), &[]).unwrap();
        let w = (b - 2.0) / (5.1 + b);
        let energy = 0.5 * (1.1 * w * w + (2.0 * w + 1.0).powi(2) + 0.1 + b * (7.1 / (5.1 + b)).powi(2));
        let [w_found, found] = ["w", "T"].map(|name| column(&report, name)[0]);
        assert!((w_found - w).abs() < 1e-11 * b.max(1.0).sqrt(), "{b}: {w_found} {w}");
        assert!((found - energy).abs() < 1e-6 * energy, "{b}: {found} {energy}");
    }
    // A mass at the tip of the first link, with 2 w there: (1.1 + 4 + 4 m) w = -2.
    let bob =
        "[[force]]\nname = \"bob\"\ntype = \"added-mass\"\nbodies = [\"a\"]\npoint = [2, 0, 0]\nparams.mass = 3\n";
    let found = column(&try_text(&text(bob), &[]).unwrap(), "w")[0];
    assert!((found + 2.0 / 17.1).abs() < 1e-13, "{found}");
}

/// On one axis nothing but the rotor moves the second wheel: J w + b (w - 1) = 0. Large scenes take what is asked for with rest elsewhere
/// as it is, if that is what has the least energy.
#[test]
fn what_only_an_element_moves_is_found_at_the_start() {
    let wheel = |name: &str, x: usize, more: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [{x}, 0, 0]\n{more}\n\
             [[joint]]\nname = \"of-{name}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"{name}\"]\npoint = [{x}, 0, 0]\n"
        )
    };
    let driven = "velocity = [0, 0, 0]\nangular_velocity = [0, 0, 1]";
    let two = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\nt_end = 1e-9\noutput_step = 1e-9\n"
        .to_owned()
        + &wheel("a", 0, driven)
        + &wheel("b", 0, "")
        + "[[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"b\"\ncomponent = \"z\"\n";
    let many: String = (1..60).map(|k| wheel(&format!("far{k}"), k, driven)).collect();
    for b in [1e-3, 3.0, 1e3] {
        let rotor = format!(
            "[[force]]\nname = \"rotor\"\ntype = \"rotational-inerter\"\nbodies = [\"a\", \"b\"]\nparams.inertance = {b:e}\n"
        );
        for text in [two.clone() + &rotor, two.clone() + &many + &rotor] {
            let found = column(&try_text(&text, &[]).unwrap(), "w")[0];
            assert!((found - b / (1.0 + b)).abs() < 1e-12, "{b}: {found}");
        }
    }
}

/// A body that is next to nothing, with a rotor, between a heavy one and the ground: the sizes of a scene are those of bodies, whatever
/// moments of inertia elements lend them.
#[test]
fn a_light_body_with_a_rotor_is_assembled_and_moves_as_a_heavier_one() {
    let text = |mass: f64| {
        let moment = mass / 10.0;
        format!(
            r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 1
output_step = 0.1
formulation = "cartesian"
[[body]]
name = "light"
mass = {mass:e}
inertia = [{moment:e}, {moment:e}, {moment:e}]
[[body]]
name = "heavy"
mass = 1
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["light", "heavy"]
point = [0.1, 0, 0]
[[joint]]
name = "ball"
type = "spherical"
bodies = ["ground", "heavy"]
frames = [{{ position = [0.05, 0.2, 0.3] }}, {{ position = [0, 0.2, 0.3] }}]
[[force]]
name = "rotor"
type = "rotational-inerter"
bodies = ["light", "heavy"]
point = [0.1, 0, 0]
params.inertance = 0.02
[[output]]
name = "z"
quantity = "position"
of = "heavy"
component = "z"
"#
        )
    };
    let [heavier, light] = [1e-9, 1e-12].map(|mass| try_text(&text(mass), &[]).unwrap());
    assert!(difference(column(&light, "z"), column(&heavier, "z")) < 1e-8);
    assert_eq!(light.summary.steps, heavier.summary.steps);
}

/// A heavy mass on a light body that nothing accelerates.
#[test]
fn inertia_that_nothing_accelerates_moves_on() {
    for velocity in ["[0, 0, 0]", "[1, 2, 0]"] {
        let text = format!(
            "[plugins]\nlibraries = [\"forces\"]\n[simulation]\nt_end = 0.1\noutput_step = 0.1\n\
             [[body]]\nname = \"hull\"\nmass = 1\ninertia = [1, 1, 1]\nvelocity = {velocity}\n\
             [[force]]\nname = \"water\"\ntype = \"added-mass\"\nbodies = [\"hull\"]\nparams.apparent_mass = [30, 40, 20]\n\
             [[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"hull\"\ncomponent = \"y\"\n"
        );
        let first = try_text(&text, &[]).unwrap();
        for way in WAYS {
            assert_same_motion(&try_text(&text, way).unwrap(), &first, 1e-7);
        }
    }
}

/// A mass in the middle of a bar holds back a body at its end, not at once: inertia of the ends and of the modes cancels but for round-off,
/// and a push on one end leaves the other without a load in whose size that could be seen.
#[test]
fn loads_that_are_round_off_of_inertia_are_in_balance() {
    let (m, k): (f64, f64) = (0.3, 1e4);
    let mut entries = Vec::new();
    for d in 1..=3 {
        let (mass, mode, along) = (m / 4.0, m.sqrt() / 2.0, if d == 1 { k } else { 0.0 });
        for (row, column, mass, stiffness) in [
            (d, d, mass, along),
            (6 + d, d, mass, -along),
            (6 + d, 6 + d, mass, along),
            (12 + d, d, mode, 0.0),
            (12 + d, 6 + d, mode, 0.0),
            (12 + d, 12 + d, 0.9999999999999999, k),
        ] {
            entries.push(format!("{row}, {column}, {mass:?}, {stiffness:?}"));
        }
    }
    let text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 0.01\noutput_step = 0.005\ntolerance = 1e-6\n\
         [[body]]\nname = \"a\"\nmass = 0.3\ninertia = [0.001, 0.002, 0.003]\n\
         [[body]]\nname = \"b\"\nmass = 0.2\ninertia = [0.002, 0.001, 0.0015]\nposition = [1, 0, 0]\n\
         [[force]]\nname = \"bar\"\ntype = \"modal-body\"\nbodies = [\"a\", \"b\"]\n\
         frames = [{{ position = [0, 0, 0] }}, {{ position = [0, 0, 0] }}]\n\
         params.points = [0, 0, 0, 1, 0, 0]\nparams.matrices = [{}]\n\
         [[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"a\"]\nparams.y = \"0.001\"\n\
         [[output]]\nname = \"y\"\nquantity = \"acceleration\"\nof = \"b\"\ncomponent = \"y\"\n",
        entries.join(", ")
    );
    for formulation in ["joint", "cartesian"] {
        let sets = [&*format!("simulation.formulation=\"{formulation}\"")];
        let report = try_text(&text, &sets).expect("runs");
        // 0.064 and 0.57 before.
        let found = report.summary.audit.load_imbalance;
        assert!(found < 1e-9, "{formulation}: {found:e}");
    }
}

/// Two bodies with the beam between them, pushed across: what moves along is the round-off of the places of the ends, against 14 MN/m.
#[test]
fn modes_that_hardly_move_are_not_resolved() {
    for (tolerance, push) in [(1e-8, 1e-3), (1e-10, 1.0)] {
        let left =
            "[[body]]\nname = \"left\"\nmass = 0.054\ninertia = [1e-4, 1e-4, 1e-4]\nposition = [0.1, 0.2, 0.3]\n";
        let text = modal("")
            .replace("gravity = [0, 0, -9.81]\nt_end = 0.1\noutput_step = 0.1", "t_end = 0.02\noutput_step = 0.001")
            .replace("[\"ground\", \"tip\"]", "[\"left\", \"tip\"]")
            .replace("position = [1, 0, 0]", "position = [1.1, 0.2, 0.3]");
        let text = text.replacen("[[body]]", &format!("{left}[[body]]"), 1)
            + "[[force]]\nname = \"push\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"tip\"]\n"
            + &format!("params = {{ z = \"{push:?} * sin(20 * t)^2\" }}\n");
        let report = try_text(&text, &[&format!("simulation.tolerance={tolerance:?}")]).expect("runs");
        // 12 968 and 25 795 before.
        assert!(report.summary.steps < 500, "{tolerance:e}: {}", report.summary.steps);
    }
}

/// A block with an inerter comes to rest by the friction of its slide: nothing is left of its accelerations, which friction and inertia
/// depend on, and it is found that nothing is left.
#[test]
fn what_friction_brings_to_rest_stays_there_with_inertia() {
    let slide = "bodies = [\"ground\", \"block\"]\naxis = [1, 2, 2]\n";
    let text = format!(
        "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\n\
         gravity = [-8.620070849344637, 4.669205043395012, -0.3591696187226932]\nt_end = 1\noutput_step = 0.1\n\
         [[body]]\nname = \"block\"\nmass = 10\ninertia = [1, 1, 1]\n\
         velocity = [0.3333333333333333, 0.6666666666666666, 0.6666666666666666]\n\
         [[joint]]\nname = \"slide\"\ntype = \"translational\"\npoint = [0, 0, 0]\n{slide}\
         [[force]]\nname = \"inerter\"\ntype = \"inerter\"\npoints = [[0.3, 0.1, 0.2], [0.9, 1.3, 1.4]]\n{slide}\
         params = {{ inertance = 3, guided = true }}\n\
         [[force]]\nname = \"rub\"\ntype = \"joint-friction\"\njoints = [\"slide\"]\npoint = [0, 0, 0]\n{slide}\
         params = {{ kind = \"translation\", mu = 0.3 }}\n\
         [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"block\"\ncomponent = \"x\"\n"
    );
    for formulation in ["joint", "cartesian"] {
        let report = try_text(&text, &[&format!("simulation.formulation=\"{formulation}\"")]).unwrap();
        let summary = &report.summary;
        assert_eq!(report.exit_code(), 0, "{formulation}: {}", summary.reason);
        // v^2 / 2 = mu N s / (m + b), a third of it along x.
        let x = *column(&report, "x").last().unwrap();
        assert!((x - 13.0 / (2.0 * 0.3 * 98.1) / 3.0).abs() < 1e-5, "{formulation}: {x}");
        let [iterations, evaluations] = [summary.coupling_iterations, summary.evaluations];
        assert!(iterations <= 8 * evaluations, "{formulation}: {iterations} iterations in {evaluations} evaluations");
    }
}
