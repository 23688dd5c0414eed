//! Identities of a scene's equations: recorded elements against opaque ones, derivatives against differences, the paper's
//! coordinates against the working ones, power against energy. At random poses that meet no joint: identities hold
//! everywhere.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{Motion, difference, scene_values};
use crate::model::{Level, Model, Quantity, skew};
use crate::plan::Layout;
use crate::program::{Equations, Form, Node, Row};
use crate::tests::{Random, model, scenes};

fn built(text: &str, form: Form) -> (Model, Layout, Equations) {
    let model = model(text);
    let layout = Layout::new(&model);
    let mut equations = Equations::build(&model, &layout, form);
    for element in 0..model.elements.len() {
        if !equations.elements[element].coordinates.is_empty() {
            equations.coordinate(element, 0, &model);
        }
    }
    (model, layout, equations)
}

/// Rows of the joints, then their coordinates.
fn functions(equations: &Equations) -> Vec<Row> {
    let coordinates = equations.elements.iter().flat_map(|e| &e.coordinate_rows);
    equations.rows.iter().chain(coordinates).cloned().collect()
}

/// A row's Jacobian with its zeros: one node or nothing per column.
fn dense(row: &Row, columns: usize) -> Vec<Option<Node>> {
    let mut list = vec![None; columns];
    row.jacobian.iter().for_each(|(column, node)| list[*column] = Some(*node));
    list
}

fn jacobian(equations: &Equations, model: &Model, layout: &Layout, inputs: &[f64]) -> Vec<Vec<f64>> {
    let columns = equations.form.columns() * layout.bodies;
    let number = |node: Option<Node>| node.map_or(0.0, |node| scene_values(equations, model, &[node], inputs)[0]);
    functions(equations).iter().map(|row| dense(row, columns).into_iter().map(number).collect()).collect()
}

/// Value, time derivative and gamma of all functions.
fn numbers(equations: &Equations, model: &Model, inputs: &[f64]) -> Vec<f64> {
    let nodes: Vec<Node> = functions(equations).iter().flat_map(|row| [row.value, row.time, row.gamma]).collect();
    scene_values(equations, model, &nodes, inputs)
}

/// G(p) with omega' = 2 G p' (Haug 1989, eq. 9.3.21).
fn g_matrix(p: &[f64]) -> SMatrix<f64, 3, 4> {
    let e = Vector3::new(p[1], p[2], p[3]);
    let right: Matrix3<f64> = Matrix3::identity() * p[0] - skew(&e);
    SMatrix::from_fn(|i, j| if j == 0 { -e[i] } else { right[(i, j - 1)] })
}

/// Once for each joint: most of the graph of a large scene would be derivatives of angles that nobody asks for.
#[test]
fn coordinates_of_joints_are_differentiated_where_their_rates_are_asked_for() {
    let model = model(&scenes::tangle());
    let layout = Layout::new(&model);
    let mut equations = Equations::build(&model, &layout, Form::Working);
    let element = equations.elements.iter().position(|element| !element.coordinates.is_empty()).unwrap();
    let mut observed = |level| {
        let quantity = Quantity::Coordinate { element, coordinate: 0, level };
        (equations.observe(&quantity, &model, &layout), equations.graph.len())
    };
    let [(position, before), (rate, after), again] =
        [Level::Position, Level::Velocity, Level::Velocity].map(&mut observed);
    assert!(rate != position && after > before);
    assert_eq!(again, (rate, after));
    assert_eq!(observed(Level::Position), (position, after));
}

/// Second derivatives of rows are no numbers until they are written, and then those that are written at once.
#[test]
fn second_derivatives_of_rows_may_be_written_later() {
    let mut random = Random(29);
    for text in [scenes::four_bar(1.1), scenes::tangle(), scenes::opaque_tangle()] {
        let (model, layout, whole) = built(&text, Form::Working);
        let mut later = Equations::build_for_tree(&model, &layout);
        let inputs = Motion::random(&layout, &mut random).start;
        let gammas = |equations: &Equations| {
            let nodes: Vec<Node> = equations.rows.iter().map(|row| row.gamma).collect();
            scene_values(equations, &model, &nodes, &inputs)
        };
        let needed_at_once = !later.coupling.is_empty() || layout.states > 0 || !later.graph.calls.is_empty();
        assert_eq!(gammas(&later).iter().all(|gamma| gamma.is_nan()), !needed_at_once);
        later.write_gammas();
        assert_eq!(gammas(&later), gammas(&whole));
    }
}

#[test]
fn recorded_and_opaque_joints_have_the_same_rows() {
    let mut random = Random(23);
    for form in [Form::Working, Form::Reference] {
        let (recorded, layout, traced) = built(&scenes::tangle(), form);
        let (called, _, opaque) = built(&scenes::opaque_tangle(), form);
        assert_eq!((traced.rows.len(), opaque.graph.calls.len()), (10, 3));
        for _ in 0..5 {
            let inputs = Motion::random(&layout, &mut random).start;
            let off = difference(
                &numbers(&opaque, &called, &inputs)[..],
                &in_the_form_of_an_opaque_element(&traced, &recorded, &layout, &inputs),
            );
            assert!(off < 1e-13, "{form:?}: {off:e}");
            let (a, b) = (
                jacobian(&opaque, &called, &layout, &inputs).concat(),
                tangential(form, &jacobian(&traced, &recorded, &layout, &inputs), &layout, &inputs).concat(),
            );
            assert!(difference(&a, &b) < 1e-13, "{form:?} {:e}", difference(&a, &b));
        }
    }
}

/// Derivatives along p itself left out: rotations only. (The paper's rotation matrix is no rotation off p.p = 1, an opaque
/// element sees nothing but rotations; the normalisation row absorbs the difference.)
fn tangential(form: Form, rows: &[Vec<f64>], layout: &Layout, inputs: &[f64]) -> Vec<Vec<f64>> {
    let mut rows = rows.to_vec();
    if form == Form::Reference {
        for body in 0..layout.bodies {
            let p = &inputs[layout.body_slot(body, 3)..layout.body_slot(body, 7)];
            for row in &mut rows {
                let part = &mut row[7 * body + 3..7 * body + 7];
                let along: f64 = part.iter().zip(p).map(|(x, e)| x * e).sum();
                part.iter_mut().zip(p).for_each(|(x, e)| *x -= along * e);
            }
        }
    }
    rows
}

/// Value, time derivative and gamma as an opaque element gives them: its second derivative has omega'' = 0, which by
/// p.p = 1 means p'' = -|omega'|^2 p / 4 and not p'' = 0.
fn in_the_form_of_an_opaque_element(equations: &Equations, model: &Model, layout: &Layout, inputs: &[f64]) -> Vec<f64> {
    let mut list = numbers(equations, model, inputs);
    if equations.form == Form::Reference {
        let rows = jacobian(equations, model, layout, inputs);
        for body in 0..layout.bodies {
            let slot = |k| layout.body_slot(body, k);
            let spin: f64 = inputs[slot(10)..slot(13)].iter().map(|w| w * w).sum();
            for (k, row) in rows.iter().enumerate() {
                let along: f64 =
                    row[7 * body + 3..7 * body + 7].iter().zip(&inputs[slot(3)..slot(7)]).map(|(x, e)| x * e).sum();
                list[3 * k + 2] += 0.25 * spin * along;
            }
        }
    }
    list
}

#[test]
fn recorded_and_opaque_forces_have_the_same_loads() {
    let mut random = Random(29);
    for form in [Form::Working, Form::Reference] {
        let (recorded, layout, traced) = built(&scenes::tangle(), form);
        let (called, _, opaque) = built(&scenes::opaque_tangle(), form);
        let nodes = |e: &Equations| {
            let mut nodes = e.loads.clone();
            nodes.extend([e.kinetic, e.potential, e.power]);
            nodes.extend(e.elements.iter().flat_map(|e| e.channels.clone()));
            nodes.extend(&e.angles);
            nodes
        };
        for _ in 0..5 {
            let inputs = Motion::random(&layout, &mut random).start;
            let a = scene_values(&opaque, &called, &nodes(&opaque), &inputs);
            let b = scene_values(&traced, &recorded, &nodes(&traced), &inputs);
            assert!(difference(&a, &b) < 1e-14, "{form:?}: {:e}", difference(&a, &b));
        }
    }
}

#[test]
fn rows_and_their_rates_are_derivatives_along_any_motion() {
    let mut random = Random(31);
    for text in [scenes::tangle(), scenes::opaque_tangle()] {
        let (model, layout, mut equations) = built(&text, Form::Working);
        let rows = functions(&equations);
        let rates: Vec<Node> = rows.iter().map(|row| equations.row_rate(row)).collect();
        let values: Vec<Node> = rows.iter().map(|row| row.value).collect();
        let gammas: Vec<Node> = rows.iter().map(|row| row.gamma).collect();
        for _ in 0..5 {
            let motion = Motion::random(&layout, &mut random);
            let of = |nodes: &[Node], h: f64| scene_values(&equations, &model, nodes, &motion.at(h));
            let h = 1e-4;
            let (before, here, after) = (of(&values, -h), of(&values, 0.0), of(&values, h));
            let first: Vec<f64> = before.iter().zip(&after).map(|(b, a)| (a - b) / (2.0 * h)).collect();
            assert!(difference(&of(&rates, 0.0), &first) < 1e-6);
            // Phi'' = Phi_q a - gamma
            let second: Vec<f64> =
                before.iter().zip(&here).zip(&after).map(|((b, f), a)| (a - 2.0 * f + b) / (h * h)).collect();
            let a = &motion.start[layout.acceleration_slot()..layout.multiplier_slot()];
            let slopes = jacobian(&equations, &model, &layout, &motion.start);
            let carried = slopes.iter().map(|row| row.iter().zip(a).map(|(x, a)| x * a).sum::<f64>());
            let found: Vec<f64> = carried.zip(of(&gammas, 0.0)).map(|(c, gamma)| c - gamma).collect();
            assert!(difference(&found, &second) < 1e-5, "{:e}", difference(&found, &second));
        }
    }
}

#[test]
fn rotations_of_both_forms_are_one_rotation() {
    let mut random = Random(37);
    let entries = |e: &Equations| -> Vec<Node> { e.bodies.iter().flat_map(|b| b.a.concat()).collect() };
    let (model, layout, working) = built(&scenes::tangle(), Form::Working);
    let (_, _, reference) = built(&scenes::tangle(), Form::Reference);
    for _ in 0..10 {
        let mut inputs = Motion::random(&layout, &mut random).start;
        let a = scene_values(&working, &model, &entries(&working), &inputs);
        let b = scene_values(&reference, &model, &entries(&reference), &inputs);
        assert!(difference(&a, &b) < 1e-15);
        for (k, nine) in a.chunks_exact(9).enumerate() {
            let p = std::array::from_fn(|i| inputs[layout.body_slot(k, 3 + i)]);
            let expected = crate::model::rotation(&p);
            assert!((Matrix3::from_row_slice(nine) - expected).amax() < 1e-15);
            assert!((expected.tr_mul(&expected) - Matrix3::identity()).amax() < 1e-14 && expected.determinant() > 0.0);
        }
        // The working form does not depend on the length of p.
        for body in 0..layout.bodies {
            (3..7).for_each(|k| inputs[layout.body_slot(body, k)] *= 1.7);
        }
        assert!(difference(&scene_values(&working, &model, &entries(&working), &inputs), &a) < 1e-15);
    }
}

#[test]
fn angular_velocity_of_both_forms_is_one() {
    let (model, layout, reference) = built(&scenes::tangle(), Form::Reference);
    let inputs = Motion::random(&layout, &mut Random(39)).start;
    let nodes: Vec<Node> = reference.bodies.iter().flat_map(|b| b.w).collect();
    let given: Vec<f64> = (0..layout.bodies)
        .flat_map(|b| (10..13).map(move |k| (b, k)))
        .map(|(b, k)| inputs[layout.body_slot(b, k)])
        .collect();
    assert!(difference(&scene_values(&reference, &model, &nodes, &inputs), &given) < 1e-15);
}

#[test]
fn the_papers_jacobian_is_the_working_one_times_two_g() {
    let mut random = Random(41);
    let (model, layout, working) = built(&scenes::tangle(), Form::Working);
    let (_, _, reference) = built(&scenes::tangle(), Form::Reference);
    for _ in 0..5 {
        let inputs = Motion::random(&layout, &mut random).start;
        let six = jacobian(&working, &model, &layout, &inputs);
        let seven = jacobian(&reference, &model, &layout, &inputs);
        // dpi' = 2 G dp: Phi_p = 2 Phi_pi' G, up to multiples of p.
        let converted: Vec<Vec<f64>> = six
            .iter()
            .map(|row| {
                let mut list = Vec::new();
                for body in 0..layout.bodies {
                    list.extend(&row[6 * body..6 * body + 3]);
                    let g = g_matrix(&inputs[layout.body_slot(body, 3)..layout.body_slot(body, 7)]);
                    let turning = Vector3::from_column_slice(&row[6 * body + 3..6 * body + 6]);
                    list.extend((2.0 * g.tr_mul(&turning)).iter());
                }
                list
            })
            .collect();
        let tangent = tangential(Form::Reference, &seven, &layout, &inputs);
        assert!(difference(&tangent.concat(), &converted.concat()) < 1e-14);
    }
}

/// p'' for a given omega'': p' = G^T omega' / 2, so p'' = G^T omega'' / 2 - |omega'|^2 p / 4.
fn parameter_accelerations(layout: &Layout, inputs: &[f64], body: usize, spin: &Vector3<f64>) -> SVector<f64, 4> {
    let slot = |k| layout.body_slot(body, k);
    let p = SVector::<f64, 4>::from_column_slice(&inputs[slot(3)..slot(7)]);
    let w = Vector3::from_column_slice(&inputs[slot(10)..slot(13)]);
    0.5 * g_matrix(p.as_slice()).tr_mul(spin) - 0.25 * w.norm_squared() * p
}

#[test]
fn rows_accelerate_alike_in_both_forms() {
    let mut random = Random(43);
    let (model, layout, working) = built(&scenes::tangle(), Form::Working);
    let (_, _, reference) = built(&scenes::tangle(), Form::Reference);
    let gammas = |e: &Equations| functions(e).iter().map(|row| row.gamma).collect::<Vec<_>>();
    for _ in 0..5 {
        let inputs = Motion::random(&layout, &mut random).start;
        let six = &inputs[layout.acceleration_slot()..layout.multiplier_slot()];
        let mut seven = Vec::new();
        for body in 0..layout.bodies {
            seven.extend(&six[6 * body..6 * body + 3]);
            let spin = Vector3::from_column_slice(&six[6 * body + 3..6 * body + 6]);
            seven.extend(parameter_accelerations(&layout, &inputs, body, &spin).iter());
        }
        let second = |e: &Equations, a: &[f64]| -> Vec<f64> {
            let rows = jacobian(e, &model, &layout, &inputs);
            let carried = rows.iter().map(|row| row.iter().zip(a).map(|(x, a)| x * a).sum::<f64>());
            carried.zip(scene_values(e, &model, &gammas(e), &inputs)).map(|(c, gamma)| c - gamma).collect()
        };
        let off = difference(&second(&reference, &seven), &second(&working, six));
        assert!(off < 1e-13, "{off:e}");
    }
}

#[test]
fn the_papers_equations_of_motion_are_the_working_ones() {
    let mut random = Random(47);
    let (model, layout, working) = built(&scenes::tangle(), Form::Working);
    let (_, _, reference) = built(&scenes::tangle(), Form::Reference);
    for _ in 0..5 {
        let inputs = Motion::random(&layout, &mut random).start;
        let six = scene_values(&working, &model, &working.loads, &inputs);
        let seven = scene_values(&reference, &model, &reference.loads, &inputs);
        let mass = scene_values(&reference, &model, &reference.mass_p, &inputs);
        for (b, body) in model.bodies.iter().enumerate() {
            assert!(difference(&seven[7 * b..7 * b + 3], &six[6 * b..6 * b + 3]) < 1e-14);
            // J' omega'' = n'; then 4 G^T J' G p'' - Q_p is a multiple of p.
            let moment = Vector3::from_column_slice(&six[6 * b + 3..6 * b + 6]);
            let spin = body.inertia.try_inverse().unwrap() * moment;
            let p2 = parameter_accelerations(&layout, &inputs, b, &spin);
            let triangle = &mass[10 * b..10 * b + 10];
            let m = SMatrix::<f64, 4, 4>::from_fn(|i, j| triangle[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)]);
            let g = g_matrix(&inputs[layout.body_slot(b, 3)..layout.body_slot(b, 7)]);
            assert!((m - 4.0 * g.tr_mul(&(body.inertia * g))).amax() < 1e-15);
            let rest = m * p2 - SVector::<f64, 4>::from_column_slice(&seven[7 * b + 3..7 * b + 7]);
            // G p = 0, so what is parallel to p vanishes.
            assert!((g * rest).amax() < 1e-13 * seven.iter().fold(1.0, |m: f64, x| m.max(x.abs())));
        }
    }
}

#[test]
fn power_is_the_rate_of_the_energy_of_free_bodies() {
    let mut random = Random(53);
    let (model, layout, equations) = built(&scenes::tangle(), Form::Working);
    for _ in 0..5 {
        let mut motion = Motion::random(&layout, &mut random);
        let loads = scene_values(&equations, &model, &equations.loads, &motion.start);
        for (b, body) in model.bodies.iter().enumerate() {
            let slot = layout.acceleration_slot() + 6 * b;
            (0..3).for_each(|k| motion.start[slot + k] = loads[6 * b + k] / body.mass);
            let moment = Vector3::from_column_slice(&loads[6 * b + 3..6 * b + 6]);
            let spin = body.inertia.try_inverse().unwrap() * moment;
            motion.start[slot + 3..slot + 6].copy_from_slice(spin.as_slice());
        }
        let energy = |h: f64| -> f64 {
            scene_values(&equations, &model, &[equations.kinetic, equations.potential], &motion.at(h)).iter().sum()
        };
        let h = 1e-4;
        let rate = (energy(h) - energy(-h)) / (2.0 * h);
        let power = scene_values(&equations, &model, &[equations.power], &motion.start)[0];
        assert!((rate - power).abs() < 1e-5 * (1.0 + power.abs()), "{rate} is not {power}");
        assert!(power < 0.0, "friction and damping take energy");
    }
}

#[test]
fn a_row_depends_on_the_bodies_of_its_joint_only() {
    let (_, layout, equations) = built(&scenes::tangle(), Form::Working);
    for (k, row) in equations.rows.iter().enumerate() {
        let (element, _) = layout.element_of_row(k);
        let bodies: &[usize] = if element == 0 { &[0] } else { &[0, 1] };
        assert!(row.jacobian.iter().all(|(column, _)| bodies.contains(&(column / 6))));
        assert!(row.jacobian.windows(2).all(|pair| pair[0].0 < pair[1].0), "columns ascend");
    }
}

#[test]
fn instances_of_an_element_differ_in_their_numbers_only() {
    let text = "[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n\
                [[force]]\nname = \"slow\"\ntype = \"lag\"\nbodies = [\"a\"]\nparams = { tau = 4 }\n\
                [[force]]\nname = \"count\"\ntype = \"tally\"\nbodies = [\"a\"]\n\
                [[force]]\nname = \"fast\"\ntype = \"lag\"\nbodies = [\"a\"]\nparams = { tau = 0.5 }\n";
    let (model, layout, equations) = built(text, Form::Working);
    let mut inputs = Motion::random(&layout, &mut Random(59)).start;
    let states = layout.state_slot();
    (inputs[states], inputs[states + 1]) = (3.0, 2.0);
    let memory = layout.discrete_slot();
    (inputs[memory], inputs[memory + 1]) = (5.0, -7.0);
    let y = inputs[layout.body_slot(0, 1)];
    let rates = scene_values(&equations, &model, &equations.state_rates, &inputs);
    assert_eq!(rates, [(1.0 - 3.0) / 4.0, (1.0 - 2.0) / 0.5]);
    assert_eq!(scene_values(&equations, &model, &equations.next_discrete, &inputs), [6.0, y]);
}
