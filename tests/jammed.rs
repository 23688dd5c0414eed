//! Contacts with much friction: a body jammed in a corner, sliding that an impact ends without an approach, feet that close while they slide,
//! rough ones that would have to pull.

use nalgebra::{Rotation3, Vector3};
use odyn::results::EventKind;
use odyn::session::RunReport;

use crate::contacts::{every_way_agrees, run, try_run};
use crate::support::{column, difference};

/// A plane of the ground, a point of the body that may touch it, and the parameters of that contact.
struct Touch {
    plane: usize,
    point: [f64; 2],
    parameters: String,
}

/// A body of mass 1 that joints hold in a plane. Its motion is that of the first numbers: x, y, and the speeds along and about.
struct Body {
    inertia: f64,
    gravity: [f64; 2],
    place: [f64; 2],
    speeds: [f64; 3],
    touches: Vec<Touch>,
}

/// A floor, and a wall at x = 0.7.
const PLANES: [([f64; 2], [f64; 2]); 2] = [([0.0, 0.0], [0.0, 1.0]), ([0.7, 0.0], [-1.0, 0.0])];

impl Body {
    /// Its scene, turned in space.
    fn scene(&self, turn: Rotation3<f64>) -> String {
        let list = |v: Vector3<f64>| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        let at = |[x, y]: [f64; 2]| list(turn * Vector3::new(x, y, 0.0));
        let across = list(turn * Vector3::z());
        let [vx, vy, spin] = self.speeds;
        let mut text = format!(
            "[plugins]\nlibraries = [\"joints\"]\n\
             [simulation]\ngravity = {}\nt_end = 1.0\noutput_step = 0.02\ntolerance = 1e-9\n\
             [[body]]\nname = \"body\"\nmass = 1\ninertia = [{i:?}, {i:?}, {i:?}]\nposition = {}\nvelocity = {}\nangular_velocity = {}\n\
             [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"body\"]\npoint = [0, 0, 0]\naxis = {across}\n",
            at(self.gravity),
            at(self.place),
            at([vx, vy]),
            list(turn * Vector3::new(0.0, 0.0, spin)),
            i = self.inertia,
        );
        for (k, Touch { plane, point, parameters }) in self.touches.iter().enumerate() {
            let (origin, normal) = PLANES[*plane];
            text += &format!(
                "[[joint]]\nname = \"touch{k}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"body\"]\n\
                 frames = [{{ position = {}, axis = {} }}, {{ position = {} }}]\nparams = {{ {parameters} }}\n",
                at(origin),
                at(normal),
                at(*point),
            );
        }
        text + "[[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"plane\"\nchannel = \"angle\"\n\
                [[output]]\nname = \"energy\"\nquantity = \"total_energy\"\n"
    }
}

fn straight() -> Rotation3<f64> {
    Rotation3::identity()
}

fn turned() -> Rotation3<f64> {
    Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7))
}

#[track_caller]
fn never_gains(report: &RunReport) {
    let energy = column(report, "energy");
    let most = energy.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    assert!(most < 1e-8, "gains {most:.1e}");
}

/// Three points of a body strike a floor and a wall with friction beyond one: what sticks and slides where it jams was not found by
/// pivoting, or is an impact.
#[test]
fn a_body_jams_in_a_corner_wherever_it_points() {
    let corners = [
        (0.02, [0.86, -9.81], [1.16, -1.59, 5.01], [[0.18, 0.03], [-0.18, 0.0], [-0.03, -0.18]], [3.83, 3.48]),
        (0.02, [4.87, -9.81], [1.53, -0.19, -3.84], [[0.16, 0.08], [-0.11, 0.01], [-0.07, -0.16]], [3.98, 2.06]),
        (0.02, [0.35, -9.81], [1.69, -0.2, 6.11], [[0.14, 0.09], [-0.16, -0.04], [-0.08, -0.15]], [0.87, 3.17]),
        (0.02, [1.67, -9.81], [1.45, -1.87, 3.17], [[0.14, 0.02], [-0.18, -0.03], [-0.05, -0.17]], [2.99, 3.75]),
        (0.03, [1.41, -9.81], [0.91, -0.58, 6.99], [[0.15, 0.05], [-0.13, 0.07], [-0.09, -0.18]], [3.99, 0.93]),
    ];
    for (number, (inertia, gravity, speeds, points, mu)) in corners.into_iter().enumerate() {
        let touch = |k: usize| Touch {
            plane: k / 3,
            point: points[k % 3],
            parameters: format!(
                "mu = {:?}, restitution = {:?}",
                mu[k / 3],
                if k.is_multiple_of(2) { 0.3 } else { 0.0 }
            ),
        };
        let body = Body { inertia, gravity, place: [0.4, 0.25], speeds, touches: (0..6).map(touch).collect() };
        let one = run(&body.scene(straight()), &[]);
        never_gains(&one);
        for (turn, formulation) in [(straight(), "cartesian"), (turned(), "joint"), (turned(), "cartesian")] {
            let other = run(&body.scene(turn), &[&format!("simulation.formulation=\"{formulation}\"")]);
            let off = difference(column(&one, "angle"), column(&other, "angle"));
            assert!(off < 1e-6, "{number}, {formulation}: {off:.1e}");
        }
    }
}

/// A foot bounces less and less and closes while it slides ever so slowly: that may turn the sliding back.
#[test]
fn feet_that_close_may_turn_their_sliding_back() {
    for (place, speeds, [x, y], mu) in [
        (0.26, [0.05, 0.0, -0.59], [0.18, -0.16], [0.61, 0.61]),
        (0.29, [0.25, 0.0, -0.07], [0.15, -0.19], [0.45, 0.49]),
        (0.27, [-0.05, 0.0, -0.11], [0.12, -0.17], [0.4, 0.53]),
    ] {
        let touch = |k: usize| Touch {
            plane: 0,
            point: [[-x, y], [x, y]][k],
            parameters: format!("mu = {:?}, restitution = 0.3", mu[k]),
        };
        let touches = (0..2).map(touch).collect();
        let body = Body { inertia: 0.02, gravity: [0.0, -9.81], place: [0.0, place], speeds, touches };
        never_gains(&every_way_agrees(&body.scene(straight()), 1e-6));
    }
}

/// A rough foot that a body tips over has to pull in the end, and would press if it slid: that is said, as soon as it hardly pushes.
#[test]
fn a_rough_foot_that_is_about_to_pull_is_reported() {
    for (height, speed, x) in [(0.29, -0.89, 0.29), (0.25, 0.92, 0.17)] {
        let foot = Touch { plane: 0, point: [x, -height], parameters: "rough = true".into() };
        let body = Body {
            inertia: 0.02,
            gravity: [0.0, -9.81],
            place: [0.0, height],
            speeds: [speed, 0.0, 0.0],
            touches: vec![foot],
        };
        let report = try_run(&body.scene(straight()), &[], None).unwrap();
        let reason = &report.summary.reason;
        assert!(
            report.exit_code() == 6 && reason.contains("`touch0: gap` is rough") && reason.contains("`mu`"),
            "{reason}"
        );
    }
}

/// Painleve's rod of mass 1 and length 1, at an angle to the floor along which its lower end slides.
fn rod(gravity: f64) -> String {
    let (s, c) = 1.2_f64.sin_cos();
    let end = Touch { plane: 0, point: [-0.5 * c, -0.5 * s], parameters: "mu = 3".into() };
    let body = Body {
        inertia: 1.0 / 12.0,
        gravity: [0.0, gravity],
        place: [0.0, 0.5 * s],
        speeds: [-1.0, 0.0, 0.0],
        touches: vec![end],
    };
    body.scene(straight()).replace("t_end = 1.0", "t_end = 0.2")
}

/// 1 + 3 cos^2 - 3 mu sin cos < 0: pressed down it has no acceleration, and an impact ends the sliding. About the end its momentum stays.
#[test]
fn sliding_without_accelerations_ends_in_an_impact() {
    let text =
        rod(-9.81) + "[[output]]\nname = \"w\"\nquantity = \"angular_velocity\"\nof = \"body\"\ncomponent = \"z\"\n";
    let report = every_way_agrees(
        &text.replace("output_step = 0.02", "output_step = 1e-6").replace("t_end = 0.2", "t_end = 1e-5"),
        1e-8,
    );
    let strike = report.events.iter().find(|event| event.kind == EventKind::Impact).unwrap();
    let spin = 1.5 * 1.2_f64.sin();
    let (before, after) = (0.5, 0.5 / 3.0 * spin * spin);
    assert!(strike.time == 0.0 && strike.rates[0].abs() < 1e-12 && strike.impulse > 0.0, "{strike:?}");
    assert!((strike.lost - (before - after)).abs() < 1e-10, "{strike:?}");
    assert!((column(&report, "w")[1] - spin).abs() < 1e-4, "{:?}", column(&report, "w"));
    never_gains(&run(&rod(-9.81), &[]));
}

/// Lifted, it may slide on with a reaction or without one.
#[test]
fn sliding_with_several_accelerations_is_reported() {
    let report = try_run(&rod(1.0), &[], None).unwrap();
    let reason = &report.summary.reason;
    assert!(report.exit_code() == 6 && reason.contains("`touch0: gap`") && reason.contains("Painleve"), "{reason}");
}

/// Two discs that joints hold in a plane, one on top of the other between a floor and a wall. Where nothing was found at a bounce off the wall
/// their frictions creep, ever faster towards where that of the discs presses them together as hard as it slows them, with reactions beyond all
/// bounds: the run stopped there ("do not settle"). By Coulomb's law an impact ends the sliding.
const BETWEEN: &str = r#"
    plugins.libraries = ["joints"]
    [simulation]
    gravity = [0, 0, -9.81]
    t_end = 0.001
    output_step = 0.0001
    tolerance = 1e-9
    [[body]]
    name = "below"
    mass = 0.2168709229430989
    inertia = [0.00012426692256511704, 0.00012426692256511704, 0.00012426692256511704]
    position = [0.010449555936485753, 0.0, 0.037848364027479486]
    velocity = [0.12350154167357892, 0.0, 0.0]
    angular_velocity = [0.0, 3.2630615102809912, 0.0]
    orientation = { euler_parameters = [0.9605927480457913, 0.0, 0.27795965966635333, 0.0] }
    [[body]]
    name = "above"
    mass = 0.6449079475388637
    inertia = [0.0007641574979575082, 0.0007641574979575082, 0.0007641574979575082]
    position = [-0.04557322616915742, 0.0, 0.11117058885892989]
    velocity = [0.0003035002862391719, 0.0, -0.0941310365902111]
    angular_velocity = [0.0, -5.095986778839342, 0.0]
    orientation = { euler_parameters = [0.8135506178910036, 0.0, -0.5814941032625923, 0.0] }
    [[joint]]
    name = "plane_below"
    type = "planar"
    bodies = ["ground", "below"]
    point = [0, 0, 0]
    axis = [0, 1, 0]
    [[joint]]
    name = "floor"
    type = "plane-contact"
    bodies = ["ground", "below"]
    frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0], axis = [0, 0, 1] }]
    params = { radius = 0.037848364027479486, mu = 0.8, restitution = 0.3 }
    [[joint]]
    name = "plane_above"
    type = "planar"
    bodies = ["ground", "above"]
    point = [0, 0, 0]
    axis = [0, 1, 0]
    [[joint]]
    name = "wall"
    type = "plane-contact"
    bodies = ["ground", "above"]
    frames = [{ position = [-0.1, 0, 0], axis = [1, 0, 0] }, { position = [0, 0, 0], axis = [0, 0, 1] }]
    params = { radius = 0.054426772217828406, mu = 0.8, restitution = 0.3 }
    [[joint]]
    name = "pair"
    type = "ball-contact"
    bodies = ["below", "above"]
    frames = [{ position = [0, 0, 0], axis = [0, 0, 1] }, { position = [0, 0, 0], axis = [0, 0, 1] }]
    params = { radius_i = 0.037848364027479486, radius_j = 0.054426772217828406, mu = 0.8, restitution = 0.3 }
    [[output]]
    name = "energy"
    quantity = "total_energy"
"#;

#[test]
fn what_creeps_where_its_reactions_have_no_bounds_is_seized() {
    let report = run(BETWEEN, &[]);
    let crept = report.events.iter().find(|event| event.kind == EventKind::Creeps).expect("it creeps after a bounce");
    let sticks = report.events.iter().any(|event| event.kind == EventKind::Sticks && event.time > crept.time);
    assert!(sticks, "{:?}", report.events);
    never_gains(&report);
}

/// A bracket around a pole, which its weight beside the pole jams on it: it could fall and press with nothing as well.
#[test]
fn a_bracket_stays_on_its_pole() {
    // Two points on either side of the pole, one above the other: they hold from height / (2 mu) on.
    for (reach, stays) in [(0.9, true), (0.6, true), (0.45, false)] {
        for turn in [straight(), turned()] {
            let list = |v: Vector3<f64>| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
            let at = |[x, y]: [f64; 2]| list(turn * Vector3::new(x, y, 0.0));
            let mut text = format!(
                "[plugins]\nlibraries = [\"joints\", \"forces\"]\n\
                 [simulation]\ngravity = {}\nt_end = 1.0\noutput_step = 0.1\n\
                 [[body]]\nname = \"body\"\nmass = 3\ninertia = [0.4, 0.4, 0.4]\nposition = {}\norientation = {{ x = {}, y = {} }}\n\
                 [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"body\"]\npoint = [0, 0, 0]\naxis = {}\n\
                 [[force]]\nname = \"load\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"body\"]\npoint = {}\naxis = {}\nx_axis = {}\n\
                 params.x = \"10 * sin(7 * t)\"\n",
                at([0.0, -9.81]),
                at([reach, 0.0]),
                at([1.0, 0.0]),
                at([0.0, 1.0]),
                list(turn * Vector3::z()),
                at([reach, 0.0]),
                list(turn * Vector3::z()),
                at([0.0, -1.0]),
            );
            for (name, side) in [("upper", -1.0), ("lower", 1.0)] {
                text += &format!(
                    "[[joint]]\nname = \"{name}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"body\"]\n\
                     frames = [{{ position = {}, axis = {} }}, {{ position = [{:?}, {:?}, 0] }}]\nparams.mu = 0.5\n",
                    at([0.02 * side, 0.0]),
                    at([side, 0.0]),
                    0.02 * side - reach,
                    -0.25 * side,
                );
            }
            text += "[[output]]\nname = \"y\"\nquantity = \"coordinate\"\nof = \"plane\"\nchannel = \"y\"\n\
                     [[output]]\nname = \"x\"\nquantity = \"coordinate\"\nof = \"plane\"\nchannel = \"x\"\n";
            let report = run(&text, &[]);
            let fell = |name: &str| column(&report, name).last().unwrap() - column(&report, name)[0];
            let fell = fell("x").hypot(fell("y"));
            assert_eq!(fell < 1e-12, stays, "{reach}: {fell:.1e}");
        }
    }
}

/// A rod, hinged on a floor, leans on a wall beside the plane of its weight: it presses the wall as it likes along its length.
#[test]
fn a_leaning_rod_stays_where_its_wall_holds_it() {
    let [foot, head] = [Vector3::new(0.4, 0.0, 0.0), Vector3::new(0.0, 0.2, 0.9)];
    for (mu, stays) in [(1.2, true), (0.02, false)] {
        for turn in [straight(), turned()] {
            let list = |v: Vector3<f64>| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
            let at = |v: Vector3<f64>| list(turn * v);
            let middle = (foot + head) / 2.0;
            let text = format!(
                "[plugins]\nlibraries = [\"joints\", \"forces\"]\n\
                 [simulation]\ngravity = {}\nt_end = 1.0\noutput_step = 0.1\n\
                 [[body]]\nname = \"rod\"\nmass = 2\ninertia = [0.2, 0.2, 0.2]\nposition = {}\n\
                 [[joint]]\nname = \"hinge\"\ntype = \"spherical\"\nbodies = [\"ground\", \"rod\"]\npoint = {}\n\
                 [[joint]]\nname = \"wall\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"rod\"]\npoints = [{}, {}]\n\
                 axes = [{}, {}]\nparams.mu = {mu:?}\n\
                 [[force]]\nname = \"load\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"rod\"]\npoint = {}\naxis = {}\nx_axis = {}\n\
                 params = {{ x = \"-3 * sin(5 * t)\", y = \"2 * sin(9 * t)\" }}\n\
                 [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"rod\"\ncomponent = \"z\"\n",
                at(Vector3::new(0.0, 0.0, -9.81)),
                at(middle),
                at(foot),
                at(Vector3::zeros()),
                at(head),
                at(Vector3::x()),
                at(Vector3::x()),
                at(middle),
                at(Vector3::z()),
                at(Vector3::x()),
            );
            let report = run(&text, &[]);
            let z = column(&report, "z");
            let moved = z.iter().map(|value| (value - z[0]).abs()).fold(0.0, f64::max);
            assert_eq!(moved < 1e-12, stays, "{mu}: {moved:.1e}");
            assert!(report.events.len() < 20, "{mu}: {} events", report.events.len());
        }
    }
}

/// A block that a force drives to and fro along a line across the axes of its contact. What is across that line is zero; friction turns it the
/// faster the slower the block is, so that round-off of a velocity next to rest grew within steps to 100 tolerances, and 2000 of the
/// friction. What is left of velocities is well below the tolerance; the direction of friction is as good as they are beside the speed,
/// which is small where the block turns back.
#[test]
fn a_block_that_turns_back_stays_on_its_line() {
    let azimuth = 0.7_f64;
    let (sin, cos) = azimuth.sin_cos();
    let text = format!(
        "title = \"to and fro\"\nplugins.libraries = [\"odyn-joints\", \"odyn-forces\"]\n\
         [simulation]\ngravity = [0, 0, -9.81]\nt_end = 2\noutput_step = 0.002\n\
         [[body]]\nname = \"block\"\nmass = 2\nparticle = true\n\
         [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"block\"]\n\
         frames = [{{ position = [0, 0, 0], axis = [0, 0, 1] }}, {{ position = [0, 0, 0] }}]\nparams.mu = 0.2\n\
         [[force]]\nname = \"shaker\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"block\"]\n\
         params = {{ x = \"{:?} * sin(20 t)\", y = \"{:?} * sin(20 t)\" }}\n\
         [[output]]\nname = \"vx\"\nquantity = \"velocity\"\nof = \"block\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"vy\"\nquantity = \"velocity\"\nof = \"block\"\ncomponent = \"y\"\n\
         [[output]]\nname = \"fx\"\nquantity = \"reaction_force\"\nof = \"floor\"\ncomponent = \"x\"\n\
         [[output]]\nname = \"fy\"\nquantity = \"reaction_force\"\nof = \"floor\"\ncomponent = \"y\"\n",
        16.0 * cos,
        16.0 * sin
    );
    for (tolerance, of_friction) in [(1e-6, 10.0), (1e-8, 20.0), (1e-10, 200.0)] {
        for formulation in ["joint", "cartesian"] {
            let sets =
                [format!("simulation.tolerance={tolerance:e}"), format!("simulation.formulation=\"{formulation}\"")];
            let report = run(&text, &sets.each_ref().map(String::as_str));
            let turned = report.events.iter().filter(|event| event.kind == EventKind::Slides).count();
            assert!(turned >= 12, "{tolerance:e} {formulation}: {turned}");
            for (x, y, bound) in [("vx", "vy", 1.0), ("fx", "fy", of_friction)] {
                let pairs = || column(&report, x).iter().zip(column(&report, y));
                let across = pairs().map(|(x, y)| (cos * y - sin * x).abs()).fold(0.0, f64::max);
                let size = pairs().map(|(x, y)| x.hypot(*y)).fold(0.0, f64::max);
                assert!(across < bound * tolerance * size, "{tolerance:e} {formulation} {x}: {across:e} of {size}");
            }
        }
    }
}
