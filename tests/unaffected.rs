//! Outputs and figures that a number does not change: their derivative is none, and they do not choose the steps of the others.

use odyn::analyses::sensitivity::{Request, Sensitivities};

use crate::support::{Scratch, options};

/// A rod on a hinge, with a mount whose force along the hinge is round-off, and a body that nothing acts on, at a negative place.
const SCENE: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [2, -3, -9]
t_end = 0.6
output_step = 0.1
[[body]]
name = "rod"
mass = 1
inertia = [0.04, 0.03, 0.02]
position = [0.3, 1.2, 0.1]
com = [0.04, -0.05, 0.02]
[[body]]
name = "other"
mass = 1
inertia = [0.04, 0.03, 0.02]
position = [-2, 0, 0]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["ground", "rod"]
point = [0.2, 0.6, 0.3]
axis = [1, 2, 2]
[[force]]
name = "mount"
type = "bushing"
bodies = ["ground", "rod"]
point = [0.2, 0.6, 0.3]
axis = [3, -1, 1]
params = { stiffness = [100, 200, 150], rotational_stiffness = [20, 30, 10] }
[[output]]
name = "y"
quantity = "position"
of = "rod"
component = "y"
[[output]]
name = "mount"
quantity = "force"
of = "mount"
component = "x"
[[figure]]
name = "largest"
channel = "y"
take = "peak"
[[figure]]
name = "last"
channel = "y"
take = "final"
"#;

fn of(outputs: &[&str], to: &str) -> Sensitivities {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", SCENE);
    let of = outputs.iter().map(|name| (*name).to_owned()).collect();
    let request = Request { of, to: vec![to.to_owned()], ..Request::default() };
    Sensitivities::of(&path, &options(&[], &[]), &request, &|_| (), &Default::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_figure_has_no_derivative_by_a_negative_number_that_does_not_change_it() {
    let all = of(&[], "other.position.x");
    assert_eq!(all.status, "certain", "{:?}", all.notes);
    assert!(all.figures.iter().all(|figure| figure.derivative == 0.0 && figure.independent));
}

#[test]
fn what_is_nothing_but_round_off_does_not_choose_the_steps_of_the_others() {
    for key in ["rod.com.x", "simulation.gravity.1"] {
        let (alone, beside) = (of(&["y", "last"], key), of(&[], key));
        assert_eq!(beside.status, "certain", "{:?}", beside.notes);
        assert!(beside.outputs[1].independent && !beside.outputs[0].independent);
        let (one, other) = (&alone.parameters[0], &beside.parameters[0]);
        assert!(one.step == other.step && other.step < 0.1 * other.value.abs(), "{key}: {} {}", one.step, other.step);
        assert_eq!(alone.outputs[0].derivative, beside.outputs[0].derivative);
        assert_eq!(alone.outputs[0].error, beside.outputs[0].error);
    }
}
