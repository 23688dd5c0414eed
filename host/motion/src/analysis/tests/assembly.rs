//! The start: positions near the given ones, velocities as given where the joints allow it.

use nalgebra::Vector3;

use super::*;
use crate::analysis::assembly::velocities::as_asked;
use crate::model::rotation;
use crate::program::Form;
use crate::tests::model;

#[track_caller]
fn assembled(text: &str) -> (Model, Result<Assembly, AssemblyError>) {
    let model = model(text);
    let layout = Layout::new(&model);
    let equations = Equations::build(&model, &layout, Form::Working);
    let assembly = assemble(&equations, &model, &layout, 0.0);
    (model, assembly)
}

/// Largest residual of the rows at the start.
fn violation(text: &str, assembly: &Assembly) -> f64 {
    let model = model(text);
    let layout = Layout::new(&model);
    let equations = Equations::build(&model, &layout, Form::Working);
    let all: Vec<usize> = (0..layout.rows).collect();
    let mut rows = Constraints::new(&equations, &all, &[|row| row.value], &[]).unwrap();
    rows.evaluate(&start_inputs(&layout, 0.0, assembly), &model.sets).unwrap();
    amax(rows.function(0))
}

/// The four-bar with its coupler put down elsewhere.
fn dropped_coupler(by: f64) -> String {
    let (s, c) = 1.1_f64.sin_cos();
    let place = |x: f64, y: f64, z: f64| format!("position = [{x:?}, {y:?}, {z:?}]");
    let text = scenes::four_bar(1.1);
    let moved = text
        .replace(&format!("position = [{:?}, {s:?}, 0]", 0.5 + c), &place(0.5 + c + 0.6 * by, s - 0.5 * by, 0.3 * by));
    assert_ne!(moved, text);
    moved
}

#[test]
fn one_program_gives_what_each_choice_of_rows_does() {
    for text in [scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.1)] {
        let (model, assembly) = assembled(&text);
        let layout = Layout::new(&model);
        let equations = Equations::build(&model, &layout, Form::Working);
        let inputs = start_inputs(&layout, 0.3, &assembly.unwrap());
        let mut all = Constraints::of_all(&equations).unwrap();
        all.evaluate(&inputs, &model.sets).unwrap();
        for rows in [(0..layout.rows).collect::<Vec<_>>(), (0..layout.rows).step_by(2).collect()] {
            let mut chosen = Constraints::new(&equations, &rows, &[|row| row.time, |row| row.value], &[]).unwrap();
            chosen.evaluate(&inputs, &model.sets).unwrap();
            let of_all = |found: &[f64]| rows.iter().map(|row| found[*row]).collect::<Vec<_>>();
            assert_eq!(chosen.function(0), of_all(all.rates_in_time()));
            assert_eq!(chosen.function(1), of_all(all.values()));
            let slopes = all.structure.jacobian.iter().zip(all.jacobian());
            let slopes: Vec<f64> = slopes.filter(|((row, _), _)| rows.contains(row)).map(|(_, slope)| *slope).collect();
            assert_eq!(chosen.jacobian(), slopes);
        }
    }
}

#[test]
fn what_is_assembled_stays_where_it_is() {
    for text in [scenes::tangle(), scenes::four_bar(1.1), scenes::four_bar(0.0)] {
        let (model, assembly) = assembled(&text);
        let assembly = assembly.unwrap();
        assert!(assembly.moves.is_empty(), "{:?}", assembly.moves);
        for (b, body) in model.bodies.iter().enumerate() {
            assert!(difference(&assembly.working[13 * b..13 * b + 3], body.position.as_slice()) < 1e-14);
        }
    }
}

#[test]
fn rough_positions_are_brought_together() {
    for by in [1e-6, 1e-3, 0.1, 0.3] {
        let text = dropped_coupler(by);
        let assembly = assembled(&text).1.unwrap();
        assert!(violation(&text, &assembly) < 1e-14, "{by}");
        // All bodies share the move; none goes further than the coupler was put off.
        assert_eq!(assembly.moves.len(), 3);
        assert!(assembly.moves.iter().all(|m| m.distance < 1.5 * by && m.angle < 2.5 * by), "{:?}", assembly.moves);
        assert!(assembly.steps <= 8, "{} steps", assembly.steps);
    }
}

#[test]
fn assembling_again_moves_nothing() {
    let text = dropped_coupler(0.1);
    let first = assembled(&text).1.unwrap();
    let (mut model, _) = assembled(&text);
    for (b, body) in model.bodies.iter_mut().enumerate() {
        let y = &first.working[13 * b..];
        body.position = nalgebra::Vector3::from_column_slice(&y[..3]);
        body.orientation = [y[3], y[4], y[5], y[6]];
    }
    let layout = Layout::new(&model);
    let equations = Equations::build(&model, &layout, Form::Working);
    let second = assemble(&equations, &model, &layout, 0.0).unwrap();
    assert!(second.moves.is_empty());
    assert!(difference(&second.working, &first.working) < 1e-14);
}

#[test]
fn joints_that_cannot_all_hold_are_named_with_what_is_left() {
    // Two points of a rod, 1 m apart, are to be at points of the ground 2 m apart.
    let text = "[[body]]\nname = \"rod\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
                [[joint]]\nname = \"left\"\ntype = \"ball\"\nbodies = [\"ground\", \"rod\"]\n\
           frames = [{ position = [-1, 0, 0] }, { position = [-0.5, 0, 0] }]\n\
           [[joint]]\nname = \"right\"\ntype = \"ball\"\nbodies = [\"ground\", \"rod\"]\n\
           frames = [{ position = [1, 0, 0] }, { position = [0.5, 0, 0] }]\n";
    let gaps = conflict_of(text);
    assert_eq!(names(&gaps), ["left: x", "right: x"]);
    // 1 m is missing; both bear the same.
    assert!(gaps.iter().all(|gap| (gap.size - 0.5).abs() < 1e-6 && !gap.angular), "{gaps:?}");
}

#[track_caller]
fn conflict_of(text: &str) -> Vec<Gap> {
    let AssemblyError::Impossible { rows } = assembled(text).1.unwrap_err() else { panic!("another error") };
    rows
}

/// Joint and row of each gap, in alphabetical order.
fn names(gaps: &[Gap]) -> Vec<String> {
    let mut names: Vec<String> = gaps.iter().map(|gap| format!("{}: {}", gap.joint, gap.row)).collect();
    names.sort();
    names
}

/// A door on hinges at heights on the frame and on the door, about its middle; `more` follows.
fn door(hinges: &[(f64, f64)], more: &str) -> String {
    let mut text = "[[body]]\nname = \"door\"\nmass = 20\ninertia = [4, 5, 1]\nposition = [0.4, 0, 0.8]\n".to_string();
    for (k, (frame, own)) in hinges.iter().enumerate() {
        text += &format!(
            "[[joint]]\nname = \"hinge_{k}\"\ntype = \"hinge\"\nbodies = [\"ground\", \"door\"]\n\
             frames = [{{ position = [0, 0, {frame:?}] }}, {{ position = [-0.4, 0, {own:?}] }}]\n"
        );
    }
    text + more
}

/// A latch on the door, put down roughly: to be assembled, and no part of any conflict.
const LATCH: &str = "[[body]]\nname = \"latch\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [0.9, 0.05, 0.75]\n\
                     [[joint]]\nname = \"pin\"\ntype = \"ball\"\nbodies = [\"door\", \"latch\"]\n\
                     frames = [{ position = [0.4, 0, 0] }, { position = [0, 0, 0] }]\n";

#[test]
fn all_hinges_that_contradict_each_other_are_named_and_no_other_joint() {
    // Redundant rows of which one is 1 mm off: three share two thirds of it and a third each.
    let gaps = conflict_of(&door(&[(0.0, -0.8), (0.8, 0.0), (1.6, 0.801)], LATCH));
    assert_eq!(names(&gaps), ["hinge_0: z", "hinge_1: z", "hinge_2: z"]);
    assert!((gaps[0].size - 2e-3 / 3.0).abs() < 1e-9 && gaps[0].joint == "hinge_2", "{gaps:?}");
    assert!(gaps[1..].iter().all(|gap| (gap.size - 1e-3 / 3.0).abs() < 1e-9), "{gaps:?}");
    // Two, by half each.
    let gaps = conflict_of(&door(&[(0.0, -0.8), (0.8, 0.001)], LATCH));
    assert_eq!(names(&gaps), ["hinge_0: z", "hinge_1: z"]);
    assert!(gaps.iter().all(|gap| (gap.size - 5e-4).abs() < 1e-9), "{gaps:?}");
    // Good ones, with the latch brought to its place.
    let text = door(&[(0.0, -0.8), (0.8, 0.0), (1.6, 0.8)], LATCH);
    let moves = assembled(&text).1.unwrap().moves;
    assert!(moves.iter().any(|moved| moved.body == "latch"), "{moves:?}");
}

#[test]
fn directions_that_contradict_each_other_are_named_with_an_angle() {
    // A second hinge whose axis is turned by some 0.1 rad about y, at the same point.
    let tilted = "[[joint]]\nname = \"tilted\"\ntype = \"hinge\"\nbodies = [\"ground\", \"door\"]\n\
                  frames = [{ position = [0, 0, 0] }, { position = [-0.4, 0, -0.8], axis = [0.1, 0, 1] }]\n";
    let gaps = conflict_of(&door(&[(0.0, -0.8)], &(tilted.to_string() + LATCH)));
    assert!(gaps.iter().all(|gap| gap.angular && gap.row.starts_with("about ")), "{gaps:?}");
    for joint in ["hinge_0", "tilted"] {
        // The door may turn about its hinge meanwhile, and so the direction in which the axes miss.
        let gap = gaps.iter().filter(|gap| gap.joint == joint).map(|gap| gap.size.powi(2)).sum::<f64>().sqrt();
        assert!((gap - 0.05).abs() < 1e-3, "{gaps:?}");
    }
    assert!(gaps.iter().all(|gap| gap.joint != "pin"), "{gaps:?}");
}

#[test]
fn a_loop_that_is_too_long_names_all_its_joints() {
    // The ground link of the four-bar is longer than the three others together, by 1 m.
    let text = scenes::four_bar(1.1).replace("position = [1.0, 0.0, 0]", "position = [4.0, 0.0, 0]")
        + "
[[body]]
name = \"free\"
mass = 1
inertia = [1, 1, 1]
position = [9, 0, 0]
[[joint]]
name = \"aside\"
type = \"ball\"
bodies = [\"ground\", \"free\"]
point = [9, 0.5, 0]
";
    let gaps = conflict_of(&text);
    let mut joints: Vec<&str> = gaps.iter().map(|gap| gap.joint.as_str()).collect();
    joints.sort_unstable();
    joints.dedup();
    assert_eq!(joints, ["A", "B", "C", "D"]);
    let sum: f64 = gaps.iter().map(|gap| gap.size.powi(2)).sum();
    // The links in line, a quarter of the metre at each joint.
    assert!((sum - 0.25).abs() < 1e-3, "{gaps:?}");
}

#[test]
fn prescribed_velocities_are_kept_and_the_rest_has_the_least_energy() {
    // `a` turns about its hinge at 0.5 rad/s in x, `b` moves at 0.2 m/s in x: both can be had.
    let (model, assembly) = assembled(&scenes::tangle());
    let assembly = assembly.unwrap();
    assert_eq!(assembly.velocity_misses, []);
    let body = |b: usize| &assembly.working[13 * b..13 * (b + 1)];
    let a = |b: usize| rotation(&[body(b)[3], body(b)[4], body(b)[5], body(b)[6]]);
    let v = |b: usize| nalgebra::Vector3::from_column_slice(&body(b)[7..10]);
    let w = |b: usize| nalgebra::Vector3::from_column_slice(&body(b)[10..13]);
    assert!(((a(0) * w(0)).x - 0.5).abs() < 1e-14);
    // The velocity given is that of the body frame's origin.
    let origin = v(1) + a(1) * w(1).cross(&-model.bodies[1].center_of_mass);
    assert!((origin.x - 0.2).abs() < 1e-14);
}

#[test]
fn open_velocities_have_the_least_kinetic_energy() {
    // Of the two freedoms of the tangle one is prescribed: omega_x of `a`, ground axes.
    let mut stand = stand(&scenes::tangle().replace("velocity = [0.2, \"free\", \"free\"]", ""));
    let start = stand.state.clone();
    let inputs = stand.form.observe(0.0, &start, true).unwrap().inputs.to_vec();
    let turning = rotation(&[start[3], start[4], start[5], start[6]]).row(0).into_owned();
    let mut rows = stand.jacobian(&inputs).insert_row(0, 0.0);
    rows.view_mut((0, 3), (1, 3)).copy_from(&turning);
    // Whatever motion leaves that alone is orthogonal to the velocities in the metric of the mass.
    let (free, v) = (null_space(&rows), stand.velocities(&start));
    assert_eq!(free.ncols(), 1);
    assert!(v.amax() > 0.1 && (free.transpose() * stand.mass() * v).amax() < 1e-12);
    // Without joints to follow, all that is not prescribed is at rest.
    let text = "[[body]]\nname = \"a\"\nmass = 1\ninertia = [1, 2, 2.5]\nvelocity = [\"free\", 3, \"free\"]\n\
                angular_velocity = [0.1, \"free\", \"free\"]\norientation = { axis = [0, 0, 1], angle = 1 }\n";
    let assembly = assembled(text).1.unwrap();
    assert!(difference(&assembly.working[7..10], &[0.0, 3.0, 0.0]) < 1e-15);
    // Angular velocity: x of the ground is given, and the least energy turns about axes that are light.
    let (j, p) = (nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 2.0, 2.5)), &assembly.working[3..7]);
    let w = nalgebra::Vector3::from_column_slice(&assembly.working[10..13]);
    let a = rotation(&[p[0], p[1], p[2], p[3]]);
    assert!(((a * w).x - 0.1).abs() < 1e-15);
    let momentum = a * j * w;
    assert!(momentum.y.abs() < 1e-15 && momentum.z.abs() < 1e-15);
}

#[test]
fn velocities_that_joints_do_not_allow_are_reported() {
    let text =
        scenes::pendulum("").replace("[[body]]", "[[body]]\nvelocity = [0.7, 1, 0]\nangular_velocity = [0, 0, 2]");
    let assembly = assembled(&text).1.unwrap();
    // The pivot keeps the centre of mass on its circle: 0.5 m at 2 rad/s is 1 m/s in y, nothing in x.
    let [miss] = &assembly.velocity_misses[..] else { panic!("{:?}", assembly.velocity_misses) };
    assert_eq!((miss.body.as_str(), miss.angular, miss.component, miss.given), ("rod", false, 0, 0.7));
    assert!(miss.found.abs() < 1e-12);
    assert!(difference(&assembly.working[7..13], &[0.0, 1.0, 0.0, 0.0, 0.0, 2.0]) < 1e-12);
}

#[test]
fn velocities_follow_a_drive() {
    let text = scenes::pendulum("")
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
           axis = [0, 0, 1]\nparams = { speed = 3 }\n";
    let assembly = assembled(&text).1.unwrap();
    assert!(difference(&assembly.working[7..13], &[0.0, 1.5, 0.0, 0.0, 0.0, 3.0]) < 1e-13);
}

#[test]
fn references_start_at_the_angles() {
    let turned = |angle: f64| {
        scenes::pendulum("").replace(
            "point = [0, 0, 0]\naxis = [0, 0, 1]",
            &format!(
                "frames = [{{ position = [0, 0, 0] }}, {{ position = [-0.5, 0, 0], x_axis = [{:?}, {:?}, 0] }}]",
                angle.cos(),
                angle.sin()
            ),
        )
    };
    for angle in [0.0, 1.0, 3.0, -3.0] {
        let assembly = assembled(&turned(angle)).1.unwrap();
        assert!((assembly.references[0] - angle).abs() < 1e-14);
    }
    // Half a turn is positive, on whichever side round-off or data with six digits leave it.
    for off in [-1e-7, -1e-16, 0.0, 1e-16, 1e-7] {
        let assembly = assembled(&turned(std::f64::consts::PI + off)).1.unwrap();
        assert!((assembly.references[0] - std::f64::consts::PI - off).abs() < 1e-14);
    }
}

#[test]
fn sizes_scale_with_the_scene() {
    let plain = scenes::tangle().replace("[simulation]", "[units]\nlength = \"m\"\n[simulation]");
    let scaled = plain.replace("length = \"m\"", "length = \"mm\"\nmass = \"t\"\ntime = \"ms\"");
    let (one, other) = (stand(&plain), stand(&scaled));
    // Lengths by 1e-3, times by 1e-3: speeds stay, spins grow by 1e3.
    assert!((other.length / one.length - 1e-3).abs() < 1e-15);
    let (a, b) = (assembled(&plain).1.unwrap().scales, assembled(&scaled).1.unwrap().scales);
    assert!((b.speed / a.speed - 1.0).abs() < 1e-12 && (b.spin / a.spin - 1e3).abs() < 1e-9);
    // Accelerations m/s^2 grow by 1e3, angular ones by 1e6.
    let of = |mut stand: Stand| {
        let state = stand.state.clone();
        let inputs = stand.form.observe(0.0, &state, true).unwrap().inputs.to_vec();
        stand.accelerations(&inputs)
    };
    let mut expected = of(one);
    expected.iter_mut().enumerate().for_each(|(k, x)| *x *= if k % 6 < 3 { 1e3 } else { 1e6 });
    assert!(difference(of(other).as_slice(), expected.as_slice()) < 1e-11);
}

#[test]
fn a_scene_may_start_in_a_singular_position() {
    // Flat at the start the four-bar has two motions, both kept: the plan is rank-safe or gains a rank when it leaves.
    let text = scenes::four_bar(0.0).replacen("[[body]]", "[[body]]\nangular_velocity = [0, 0, 2]", 1);
    let mut stand = stand(&text);
    let start = stand.state.clone();
    let mut rates = vec![0.0; start.len()];
    stand.form.next_step(0.0, &start).unwrap();
    stand.form.rates(0.0, &start, &mut rates).unwrap();
    assert!(rates.iter().all(|x| x.is_finite()));
    assert!((start[12] - 2.0).abs() < 1e-13);
}

#[test]
fn velocities_that_fit_are_taken_as_they_are() {
    let text = scenes::four_bar(1.1);
    let mut model = model(&text);
    let layout = Layout::new(&model);
    let equations = Equations::build(&model, &layout, Form::Working);
    // A motion of the mechanism: what assembly makes of the speed of one rod.
    model.bodies[0].angular_velocity = [Some(0.0), Some(0.0), Some(0.7)];
    let solved = assemble(&equations, &model, &layout, 0.0).unwrap();
    let mut rows = Constraints::of_all(&equations).unwrap();
    rows.evaluate(&start_inputs(&layout, 0.0, &solved), &model.sets).unwrap();
    assert!(as_asked(&rows, &model, &solved.working).is_none(), "some velocities are not given");
    for (body, y) in model.bodies.iter_mut().zip(solved.working.chunks_exact(13)) {
        let a = rotation(&[y[3], y[4], y[5], y[6]]);
        let spin = Vector3::from_column_slice(&y[10..13]);
        let origin = Vector3::from_column_slice(&y[7..10]) - a * spin.cross(&body.center_of_mass);
        body.velocity = [0, 1, 2].map(|k| Some(origin[k]));
        body.angular_velocity = [0, 1, 2].map(|k| Some((a * spin)[k]));
    }
    let taken = as_asked(&rows, &model, &solved.working).unwrap();
    for (y, v) in solved.working.chunks_exact(13).zip(taken.chunks_exact(6)) {
        assert!(difference(&y[7..13], v) < 1e-14, "{v:?} instead of {:?}", &y[7..13]);
    }
    assert!(amax(&taken) > 0.1);
    model.bodies[1].velocity[0] = model.bodies[1].velocity[0].map(|v| v + 1e-9);
    assert!(as_asked(&rows, &model, &solved.working).is_none(), "this does not fit the joints");
    // Rest fits, and needs no numbers.
    model.bodies.iter_mut().for_each(|body| (body.velocity, body.angular_velocity) = ([None; 3], [None; 3]));
    assert_eq!(as_asked(&rows, &model, &solved.working), Some(vec![0.0; layout.velocities()]));
}

#[test]
fn velocities_that_contradict_each_other_are_refused_with_their_rows() {
    // A rod of 1 m between two posts, one of which is driven away along the rod.
    let text = "[[body]]\nname = \"rod\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
                [[joint]]\nname = \"left\"\ntype = \"ball\"\nbodies = [\"ground\", \"rod\"]\npoint = [-0.5, 0, 0]\n\
                [[joint]]\nname = \"right\"\ntype = \"screw\"\nbodies = [\"ground\", \"rod\"]\npoint = [0.5, 0, 0]\n\
                axis = [1, 0, 0]\nparams = { pitch = 0, speed = SPEED }\n";
    for speed in ["3", "1e-6"] {
        let Err(AssemblyError::Contradiction { rows }) = assembled(&text.replace("SPEED", speed)).1 else {
            panic!("{speed}: assembled");
        };
        let off: f64 = speed.parse().unwrap();
        let named = rows.iter().any(|gap| gap.joint == "right" && gap.row == "advance" && gap.size > 0.1 * off);
        assert!(named || rows[0].joint == "left" && rows[0].row == "x", "{rows:?}");
        assert!(rows.iter().all(|gap| !gap.angular), "{rows:?}");
    }
    assert!(assembled(&text.replace("SPEED", "0")).1.is_ok());
}
