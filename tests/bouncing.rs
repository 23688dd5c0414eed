//! What bounces or rocks until it lies, while it slides: all in all it is pressed by its impulse and its weight.

use crate::contacts::run;
use crate::support::column;

const HEAD: &str =
    "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = 2.5\noutput_step = 0.5\n";
const VELOCITY: &str = "[[output]]\nname = \"v\"\nquantity = \"velocity\"\nof = \"body\"\ncomponent = \"x\"\n";

/// Falls without a velocity downwards and ends in the plane: friction has taken mu g t of the velocity, however it got there.
#[track_caller]
fn slides_as_pressed(text: &str, speed: f64, mu: f64) {
    for tolerance in [1e-6_f64, 1e-9, 1e-12] {
        for method in ["dop853", "radau5"] {
            let sets = [format!("simulation.tolerance={tolerance:e}"), format!("simulation.method={method:?}")];
            let report = run(text, &sets.each_ref().map(String::as_str));
            let off = column(&report, "v")[5] - (speed - mu * 9.81 * 2.5);
            assert!(off.abs() < 0.1 * tolerance.max(1e-10), "{tolerance:e} {method}: {off:e}");
        }
    }
}

#[test]
fn a_puck_that_bounces_to_rest() {
    // It lies from 1.81 s on.
    let text = format!(
        "{HEAD}[[body]]\nname = \"body\"\nmass = 1\nparticle = true\nposition = [0, 0, 1]\nvelocity = [10, 0, 0]\n\
         [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"body\"]\n\
         frames = [{{ axis = [0, 0, 1] }}, {{}}]\nparams = {{ restitution = 0.6, mu = 0.1 }}\n{VELOCITY}"
    );
    slides_as_pressed(&text, 10.0, 0.1);
}

#[test]
fn a_rod_that_rocks_to_rest() {
    // Lands on one foot, and rocks from one to the other.
    let foot = |name: &str, x: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"body\"]\n\
             frames = [{{ axis = [0, 0, 1] }}, {{ position = [{x:?}, 0, 0] }}]\nparams.mu = 0.2\n"
        )
    };
    let text = format!(
        "{HEAD}[[body]]\nname = \"body\"\nmass = 2\ninertia = [0.01, 1.2, 1.2]\nposition = [0, 0, 0.3]\nvelocity = [10, 0, 0]\n\
         orientation = {{ axis = [0, 1, 0], angle = 0.1 }}\n\
         [[joint]]\nname = \"plane\"\ntype = \"planar\"\nbodies = [\"ground\", \"body\"]\npoint = [0, 0, 0]\naxis = [0, 1, 0]\n\
         {}{}{VELOCITY}",
        foot("left", -0.6),
        foot("right", 0.7)
    );
    slides_as_pressed(&text, 10.0, 0.2);
}

/// Places are known to round-off of their distance from the origin. High up that is more than what counts as zero on the ground: between two
/// places a ball came no nearer to its plane, in half a million steps.
#[test]
fn a_ball_bounces_alike_however_high_the_ground_is() {
    for height in [0.0, 500.0, 2000.0, 3000.0, 1e5] {
        let text = format!(
            "{HEAD}[[body]]\nname = \"body\"\nmass = 1\nparticle = true\nposition = [0, 0, {:?}]\n\
             [[joint]]\nname = \"floor\"\ntype = \"plane-contact\"\nbodies = [\"ground\", \"body\"]\n\
             frames = [{{ position = [0, 0, {height:?}], axis = [0, 0, 1] }}, {{}}]\nparams.restitution = 0.8\n\
             [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"body\"\ncomponent = \"z\"\n",
            height + 1.0
        );
        let report = run(&text, &[]);
        let fall = (2.0_f64 / 9.81).sqrt();
        let impacts: Vec<f64> = report.events.iter().map(|event| event.time).collect();
        for (k, time) in impacts.iter().enumerate() {
            // The first after a fall, each further one after twice as long, less what was lost.
            let expected = fall * (1.0 + 2.0 * (1..=k as i32).map(|bounce| 0.8_f64.powi(bounce)).sum::<f64>());
            assert!((time - expected).abs() < 1e-7, "{height}: {time} in place of {expected}");
        }
        assert!(impacts.len() == 4 && report.summary.steps < 100, "{height}: {} steps", report.summary.steps);
    }
}
