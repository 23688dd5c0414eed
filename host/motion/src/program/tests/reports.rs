//! Requested quantities against what they mean: derivatives along a motion, the balance of every body.

use nalgebra::{Matrix3, Vector3};

use super::{Motion, difference, scene_values};
use crate::model::{Axes, Level, Model, Quantity, rotation};
use crate::plan::Layout;
use crate::program::{Equations, Form, Node};
use crate::tests::{Random, model, scenes};

fn built(text: &str) -> (Model, Layout, Equations) {
    let model = model(text);
    let layout = Layout::new(&model);
    let equations = Equations::build(&model, &layout, Form::Working);
    (model, layout, equations)
}

/// The nodes of three components of a quantity.
fn three(equations: &mut Equations, model: &Model, layout: &Layout, quantity: impl Fn(usize) -> Quantity) -> Vec<Node> {
    (0..3).map(|k| equations.observe(&quantity(k), model, layout)).collect()
}

fn attitude(layout: &Layout, inputs: &[f64], body: usize) -> Matrix3<f64> {
    rotation(&std::array::from_fn(|k| inputs[layout.body_slot(body, 3 + k)]))
}

/// First and second derivative at zero, by central differences.
fn differences(h: f64, of: impl Fn(f64) -> Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let (before, here, after) = (of(-h), of(0.0), of(h));
    let first = before.iter().zip(&after).map(|(b, a)| (a - b) / (2.0 * h)).collect();
    let second = before.iter().zip(&here).zip(&after).map(|((b, f), a)| (a - 2.0 * f + b) / (h * h)).collect();
    (first, second)
}

#[test]
fn velocities_and_accelerations_of_points_are_derivatives_of_positions() {
    let (model, layout, mut equations) = built(&scenes::tangle());
    let mut random = Random(61);
    let at = Vector3::new(0.3, -0.7, 0.2);
    let nodes = [Level::Position, Level::Velocity, Level::Acceleration].map(|level| {
        let axes = Axes::Ground;
        let quantity = |component| Quantity::Point { body: 1, point: at, level, axes, component };
        three(&mut equations, &model, &layout, quantity)
    });
    for _ in 0..5 {
        let motion = Motion::random(&layout, &mut random);
        let of = |nodes: &[Node], h: f64| scene_values(&equations, &model, nodes, &motion.at(h));
        let (first, second) = differences(1e-4, |h| of(&nodes[0], h));
        assert!(difference(&of(&nodes[1], 0.0), &first) < 1e-6);
        assert!(difference(&of(&nodes[2], 0.0), &second) < 1e-5);
    }
}

#[test]
fn angular_quantities_are_those_of_the_rotation() {
    let (model, layout, mut equations) = built(&scenes::tangle());
    let motion = Motion::random(&layout, &mut Random(67));
    let [speed, acceleration] = [Level::Velocity, Level::Acceleration].map(|level| {
        let axes = Axes::Ground;
        three(&mut equations, &model, &layout, |component| Quantity::Angular { body: 0, level, axes, component })
    });
    let of = |nodes: &[Node], h: f64| scene_values(&equations, &model, nodes, &motion.at(h));
    // A' A^T = omega~
    let h = 1e-4;
    let [before, after] = [-h, h].map(|h| attitude(&layout, &motion.at(h), 0));
    let spin = (after - before) / (2.0 * h) * attitude(&layout, &motion.start, 0).transpose();
    assert!(difference(&of(&speed, 0.0), &[spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]]) < 1e-6);
    // Ground components of omega'' are the derivative of the ground components of omega.
    let (first, _) = differences(h, |h| of(&speed, h));
    assert!(difference(&of(&acceleration, 0.0), &first) < 1e-6);
}

#[test]
fn rates_and_accelerations_of_joint_coordinates_are_derivatives() {
    for text in [scenes::tangle(), scenes::opaque_tangle()] {
        let (model, layout, mut equations) = built(&text);
        let mut random = Random(71);
        let nodes = [Level::Position, Level::Velocity, Level::Acceleration].map(|level| {
            let list = [(0, 0), (1, 0), (1, 1)].into_iter();
            list.map(|(element, coordinate)| {
                equations.observe(&Quantity::Coordinate { element, coordinate, level }, &model, &layout)
            })
            .collect::<Vec<Node>>()
        });
        for _ in 0..5 {
            let motion = Motion::random(&layout, &mut random);
            let of = |nodes: &[Node], h: f64| scene_values(&equations, &model, nodes, &motion.at(h));
            let (first, second) = differences(1e-4, |h| of(&nodes[0], h));
            assert!(difference(&of(&nodes[1], 0.0), &first) < 1e-6);
            assert!(difference(&of(&nodes[2], 0.0), &second) < 1e-5);
        }
    }
}

/// A vector quantity by point, level, axes and component.
type VectorQuantity = fn(Vector3<f64>, Level, Axes, usize) -> Quantity;

#[test]
fn components_along_body_axes_are_those_of_the_ground_turned_back() {
    let (model, layout, mut equations) = built(&scenes::tangle());
    let inputs = Motion::random(&layout, &mut Random(73)).start;
    let (point, level) = (Vector3::new(0.1, 0.2, 0.3), Level::Acceleration);
    let quantities: [VectorQuantity; 4] = [
        |point, level, axes, component| Quantity::Point { body: 0, point, level, axes, component },
        |_, level, axes, component| Quantity::Angular { body: 0, level, axes, component },
        |_, _, axes, component| Quantity::Load { element: 1, frame: 1, torque: false, axes, component },
        |_, _, axes, component| Quantity::Load { element: 2, frame: 1, torque: true, axes, component },
    ];
    for quantity in quantities {
        let vectors = [Axes::Ground, Axes::Body(0), Axes::Body(1)].map(|axes| {
            let nodes = three(&mut equations, &model, &layout, |k| quantity(point, level, axes, k));
            Vector3::from_vec(scene_values(&equations, &model, &nodes, &inputs))
        });
        for body in 0..2 {
            let expected = attitude(&layout, &inputs, body).tr_mul(&vectors[0]);
            assert!((vectors[1 + body] - expected).amax() < 1e-13 * (1.0 + expected.amax()));
        }
    }
}

/// Force and torque of an element on the body of a frame, ground axes.
fn load(
    equations: &mut Equations,
    model: &Model,
    layout: &Layout,
    inputs: &[f64],
    [element, frame]: [usize; 2],
) -> (Vector3<f64>, Vector3<f64>) {
    let axes = Axes::Ground;
    let [force, moment] = [false, true].map(|torque| {
        let nodes =
            three(equations, model, layout, |component| Quantity::Load { element, frame, torque, axes, component });
        Vector3::from_vec(scene_values(equations, model, &nodes, inputs))
    });
    (force, moment)
}

/// Any multipliers, and the accelerations M a = Q - Phi_q^T lambda that belong to them.
fn balanced(equations: &Equations, model: &Model, layout: &Layout, mut inputs: Vec<f64>) -> Vec<f64> {
    let mut loads = scene_values(equations, model, &equations.loads, &inputs);
    for (k, row) in equations.rows.iter().enumerate() {
        let lambda = inputs[layout.multiplier_slot() + k];
        for (column, node) in &row.jacobian {
            loads[*column] -= lambda * scene_values(equations, model, &[*node], &inputs)[0];
        }
    }
    for (b, body) in model.bodies.iter().enumerate() {
        let slot = layout.acceleration_slot() + 6 * b;
        (0..3).for_each(|k| inputs[slot + k] = loads[6 * b + k] / body.mass);
        let spin = body.inertia.try_inverse().unwrap() * Vector3::from_column_slice(&loads[6 * b + 3..6 * b + 6]);
        inputs[slot + 3..slot + 6].copy_from_slice(spin.as_slice());
    }
    inputs
}

#[test]
fn reported_loads_balance_every_body() {
    for text in [scenes::tangle(), scenes::opaque_tangle()] {
        let (model, layout, mut equations) = built(&text);
        let mut random = Random(79);
        for _ in 0..3 {
            let start = Motion::random(&layout, &mut random).start;
            let inputs = balanced(&equations, &model, &layout, start);
            for (b, body) in model.bodies.iter().enumerate() {
                let (mut force, mut moment) = (body.mass * model.gravity, Vector3::zeros());
                let a = attitude(&layout, &inputs, b);
                for (element, instance) in model.elements.iter().enumerate() {
                    for (frame, marker) in instance.markers.iter().enumerate() {
                        if marker.body == Some(b) {
                            let (f, t) = load(&mut equations, &model, &layout, &inputs, [element, frame]);
                            force += f;
                            moment += t + (a * marker.position).cross(&f);
                        }
                    }
                }
                // Newton: m r'' = F. Euler, body axes: J' omega'' + omega' x J' omega' = A^T n.
                let slot = layout.acceleration_slot() + 6 * b;
                let (r2, spin) = (
                    Vector3::from_column_slice(&inputs[slot..slot + 3]),
                    Vector3::from_column_slice(&inputs[slot + 3..slot + 6]),
                );
                let w = Vector3::from_column_slice(&inputs[layout.body_slot(b, 10)..layout.body_slot(b, 13)]);
                let inertial = body.inertia * spin + w.cross(&(body.inertia * w));
                assert!((body.mass * r2 - force).amax() < 1e-12 * (1.0 + force.amax()));
                assert!((inertial - a.tr_mul(&moment)).amax() < 1e-12 * (1.0 + moment.amax()));
            }
        }
    }
}

#[test]
fn action_and_reaction_cancel() {
    let (model, layout, mut equations) = built(&scenes::tangle());
    let inputs = Motion::random(&layout, &mut Random(83)).start;
    let place = |body: Option<usize>, local: &Vector3<f64>| match body {
        None => *local,
        Some(body) => {
            let slot = layout.body_slot(body, 0);
            Vector3::from_column_slice(&inputs[slot..slot + 3]) + attitude(&layout, &inputs, body) * local
        }
    };
    for (element, instance) in model.elements.iter().enumerate() {
        // Moments about the origin of the ground.
        let (mut force, mut moment, mut size) = (Vector3::zeros(), Vector3::zeros(), 0.0_f64);
        for (frame, marker) in instance.markers.iter().enumerate() {
            let (f, t) = load(&mut equations, &model, &layout, &inputs, [element, frame]);
            force += f;
            moment += t + place(marker.body, &marker.position).cross(&f);
            size = size.max(f.amax()).max(t.amax());
        }
        assert!(size > 0.0 && force.amax() < 1e-12 * size && moment.amax() < 1e-12 * size, "{}", instance.name);
    }
}

#[test]
fn energies_and_values_are_the_equations_own() {
    let (model, layout, mut equations) = built(&scenes::tangle());
    let inputs = Motion::random(&layout, &mut Random(89)).start;
    let wanted = [
        Quantity::KineticEnergy,
        Quantity::PotentialEnergy,
        Quantity::TotalEnergy,
        Quantity::Value { element: 2, channel: 1 },
        Quantity::EulerParameter { body: 1, component: 2 },
    ];
    let nodes: Vec<Node> = wanted.iter().map(|q| equations.observe(q, &model, &layout)).collect();
    let found = scene_values(&equations, &model, &nodes, &inputs);
    let mut kinetic = 0.0;
    for (b, body) in model.bodies.iter().enumerate() {
        let slot = layout.body_slot(b, 7);
        let v = Vector3::from_column_slice(&inputs[slot..slot + 3]);
        let w = Vector3::from_column_slice(&inputs[slot + 3..slot + 6]);
        kinetic += 0.5 * (body.mass * v.norm_squared() + w.dot(&(body.inertia * w)));
    }
    assert!((found[0] - kinetic).abs() < 1e-14 * kinetic);
    assert_eq!((found[2], found[4]), (found[0] + found[1], inputs[layout.body_slot(1, 5)]));
    // The strut's rate is a velocity between its ends.
    let tension = equations.observe(&Quantity::Value { element: 2, channel: 0 }, &model, &layout);
    let (force, _) = load(&mut equations, &model, &layout, &inputs, [2, 1]);
    let tension = scene_values(&equations, &model, &[tension], &inputs)[0];
    assert!((force.norm() - tension.abs()).abs() < 1e-13 * tension.abs());
}
