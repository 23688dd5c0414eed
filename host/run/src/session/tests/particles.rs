//! Bodies without rotation, and point masses on bodies.

use super::*;

const PARTICLE: &str = "[[body]]\nname = \"p\"\nmass = 2\nparticle = true\nposition = [1.5, 0, 0]\n";
const STRUT: &str = "[[force]]\nname = \"strut\"\ntype = \"strut\"\nbodies = [\"ground\", \"p\"]\n\
                     points = [[0, 0, 0], [1.5, 0, 0]]\nparams = { stiffness = 50.0 }\n";

#[test]
fn a_particle_moves_without_an_inertia() {
    let text = settings("t_end = 2; output_step = 0.05")
        + PARTICLE
        + STRUT
        + &output("x", "quantity = \"position\"; of = \"p\"; component = \"x\"")
        + &output("spin", "quantity = \"angular_velocity\"; of = \"p\"; component = \"z\"");
    assert_eq!(open(&text).plan.mobility, 3);
    let report = run(&text);
    // 2 x'' = 50 (1 - x).
    assert!(off(&report, "x", |t| 1.0 + 0.5 * (5.0 * t).cos()) < 1e-9);
    assert!(off(&report, "spin", |_| 0.0) < 1e-12);
}

#[test]
fn a_torque_on_a_particle_is_named() {
    // Held at a point 10 cm from where it is, it would have to turn.
    let text = settings("gravity = [0, -9.81, 0]; t_end = 1; output_step = 0.1")
        + PARTICLE
        + "[[joint]]\nname = \"ball\"\ntype = \"ball\"\nbodies = [\"ground\", \"p\"]\npoint = [1.4, 0, 0]\n";
    let error = open(&text).run(None, Box::new(|_| ()), &Arc::default()).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("a torque acts on the particle `p`"), "{text}");
    assert_eq!(error.exit, Exit::Integration);
}

/// A hinge is where the scene puts it, however the point masses move the centre of mass: a massless-looking rod with a
/// ball at its end is a pendulum.
#[test]
fn joints_stay_where_they_are_when_point_masses_move_the_centre() {
    let pendulum = |body: &str| {
        settings("gravity = [0, -10, 0]; t_end = 1; output_step = 0.1")
            + "[[body]]\nname = \"rod\"\n"
            + body
            + "[[joint]]\nname = \"pivot\"\ntype = \"hinge\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
               axis = [0, 0, 1]\n"
            + &output("tip", "quantity = \"position\"; of = \"rod\"; component = \"y\"; point = [1, 0, 0]")
    };
    // 1 kg about its middle at 0.5 m, 3 kg at 1 m: centre at 0.875 m, there 0.1 + 1 (0.375)^2 + 3 (0.125)^2 = 0.2875.
    let composed = "mass = 1\ninertia = [0.1, 0.1, 0.1]\ncom = [0.5, 0, 0]\n\
                    point_masses = [{ mass = 3, position = [1, 0, 0] }]\n";
    let whole = "mass = 4\ninertia = [0.1, 0.2875, 0.2875]\ncom = [0.875, 0, 0]\n";
    let (a, b) = (run(&pendulum(composed)), run(&pendulum(whole)));
    for (a, b) in column(&a, "tip").iter().zip(column(&b, "tip")) {
        assert!((a - b).abs() < 1e-11, "{a} {b}");
    }
    assert!(column(&a, "tip").iter().any(|y| *y < -0.9), "it swings through");
}

#[test]
fn a_body_with_point_masses_is_their_composition() {
    // A dumbbell: 1 kg with 0.02 kg m^2, and twice 2 kg at 0.5 m: along y and z 0.02 + 2 * 2 * 0.25.
    let dumbbell = |more: &str| {
        settings("gravity = [0, -10, 0]; t_end = 1; output_step = 0.1")
            + "[[body]]\nname = \"b\"\nangular_velocity = [0.3, 0.2, 2]\n"
            + more
            + &output("x", "quantity = \"orientation\"; of = \"b\"; component = \"e1\"")
            + &output("y", "quantity = \"position\"; of = \"b\"; component = \"y\"; point = [0.5, 0.1, 0]")
    };
    let composed = dumbbell(
        "mass = 1\ninertia = [0.02, 0.02, 0.02]\npoint_masses = [{ mass = 2, position = [0.5, 0, 0] }, \
         { mass = 2, position = [-0.5, 0, 0] }]\n",
    );
    let whole = dumbbell("mass = 5\ninertia = [0.02, 1.02, 1.02]\n");
    let one_sided = dumbbell(
        "mass = 3\ninertia = [0.02, 0.52, 0.52]\ncom = [-0.33333333333333333, 0, 0]\n\
         point_masses = [{ mass = 2, position = [0.5, 0, 0] }]\n",
    );
    // The lighter part alone: 1 kg at 0 and 2 kg at -0.5, about -1/3: 1/9 + 2/36 = 1/6.
    let one_sided = one_sided.replace("0.52", "0.18666666666666667");
    let (a, b, c) = (run(&composed), run(&whole), run(&one_sided));
    for name in ["x", "y"] {
        for ((a, b), c) in column(&a, name).iter().zip(column(&b, name)).zip(column(&c, name)) {
            assert!((a - b).abs() < 1e-12 && (a - c).abs() < 1e-12, "{name}: {a} {b} {c}");
        }
    }
}
