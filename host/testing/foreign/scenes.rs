//! Scenes that several rooms test with.

/// Two bodies with everything out of the way: centres of mass off the body frames, skew axes, markers off both. `FORM`
/// chooses between recorded and opaque elements.
pub const TANGLE: &str = r#"
[simulation]
gravity = [0.3, -9.81, 0.5]
t_end = 1
output_step = 0.1
[[body]]
name = "a"
mass = 2
inertia = [0.11, 0.13, 0.17, 0.01, -0.02, 0.015]
com = [0.1, -0.05, 0.02]
position = [0.3, 0.2, -0.1]
orientation = { axis = [1, 2, 3], angle = 0.7 }
angular_velocity = [0.5, "free", "free"]
[[body]]
name = "b"
mass = 0.7
inertia = [0.05, 0.04, 0.06]
com = [-0.02, 0.03, 0.1]
position = [0.9, 0.1, 0.4]
orientation = { axis = [-1, 1, 0.5], angle = 1.9 }
velocity = [0.2, "free", "free"]
[[joint]]
name = "base"
type = "FORMhinge"
bodies = ["ground", "a"]
point = [0.1, 0.1, 0]
axis = [1, 0.3, 0.2]
[[joint]]
name = "between"
type = "FORMscrew"
bodies = ["a", "b"]
point = [0.6, 0.2, 0.1]
axis = [0.2, 1, -0.4]
params = { pitch = 0.2, speed = 0.3 }
[[force]]
name = "stay"
type = "FORMstrut"
bodies = ["ground", "b"]
points = [[0, 1, 0], [0.8, 0.3, 0.5]]
params = { stiffness = 50, damping = 3, free_length = 0.8 }
[[force]]
name = "drag"
type = "friction"
bodies = ["a", "b"]
point = [0.6, 0.2, 0.1]
axis = [0.2, 1, -0.4]
"#;

/// [`TANGLE`] with recorded elements.
pub fn tangle() -> String {
    TANGLE.replace("FORM", "")
}

/// The same with a force that follows an acceleration, friction that follows a reaction, and a state that follows another acceleration.
pub fn coupled_tangle() -> String {
    tangle()
        + r#"
[[output]]
name = "a_x"
quantity = "acceleration"
of = "b"
component = "x"
[[output]]
name = "a_z"
quantity = "acceleration"
of = "b"
component = "z"
[[force]]
name = "added"
type = "push"
bodies = ["a", "b"]
params.factor = -0.4
inputs.signal = "a_x"
[[control]]
name = "slow"
type = "smoother"
params.factor = 0.2
inputs.in = { signal = "a_z", gain = "1 s^2" }
[[force]]
name = "rubbing"
type = "rub"
joints = ["between"]
params.factor = 0.3
"#
}

/// [`TANGLE`] with opaque elements.
pub fn opaque_tangle() -> String {
    TANGLE.replace("FORM", "opaque-")
}

/// A planar four-bar of rods of 1 m with spatial hinges, its cranks at the given angle (rad) to the ground link.
pub fn four_bar(angle: f64) -> String {
    let (s, c) = angle.sin_cos();
    let rod = |name: &str, x: f64, y: f64, angle: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1.5\ninertia = [0.01, 0.1, 0.1]\nposition = [{x:?}, {y:?}, 0]\n\
                 orientation = {{ axis = [0, 0, 1], angle = {angle:?} }}\n"
        )
    };
    let hinge = |name: &str, i: &str, j: &str, at: [f64; 2], local: f64, from: f64| {
        let on_i = if i == "ground" { at } else { [from, 0.0] };
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"hinge\"\nbodies = [\"{i}\", \"{j}\"]\n\
                 frames = [{{ position = [{:?}, {:?}, 0] }}, {{ position = [{local:?}, 0, 0] }}]\n",
            on_i[0], on_i[1]
        )
    };
    [
        "[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1\noutput_step = 0.1\n".to_string(),
        rod("left", 0.5 * c, 0.5 * s, angle),
        rod("right", 1.0 + 0.5 * c, 0.5 * s, angle),
        rod("coupler", 0.5 + c, s, 0.0),
        hinge("A", "ground", "left", [0.0, 0.0], -0.5, 0.0),
        hinge("B", "ground", "right", [1.0, 0.0], -0.5, 0.0),
        hinge("C", "left", "coupler", [0.0, 0.0], -0.5, 0.5),
        hinge("D", "coupler", "right", [0.0, 0.0], 0.5, 0.5),
    ]
    .concat()
}

/// A rod of 1 m that hangs on a hinge in the origin, horizontal at the start; `more` follows.
pub fn pendulum(more: &str) -> String {
    format!(
        "{more}\n[[body]]\nname = \"rod\"\nmass = 1.2\ninertia = [0.01, 0.1, 0.1]\nposition = [0.5, 0, 0]\n\
             [[joint]]\nname = \"pivot\"\ntype = \"hinge\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
             axis = [0, 0, 1]\n"
    )
}
