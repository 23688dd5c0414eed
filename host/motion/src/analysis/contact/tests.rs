use std::cell::Cell;

use nalgebra::{DMatrix, DVector};

use super::decision::{Choice, Decision};
use super::friction::Held;
use super::smallest::{block, blocks, only_one, smallest, smallest_of_many};
use super::{Grip, Meeting};
use crate::tests::Random;

/// A contact of a body in a plane: where it touches from its centre of mass, the direction of the normal, and its friction.
#[derive(Clone)]
struct Point {
    place: [f64; 2],
    angle: f64,
    mu: f64,
}

/// A body of mass 1 that touches at some points, with the Jacobian of the normals, then the tangents.
fn touching(points: &[Point], inertia: f64) -> (Meeting, DMatrix<f64>) {
    let n = points.len();
    let jacobian = DMatrix::from_fn(2 * n, 3, |row, column| {
        let Point { place: [x, y], angle, .. } = points[row % n];
        let angle = if row < n { angle } else { angle + std::f64::consts::FRAC_PI_2 };
        let [u, v] = [angle.cos(), angle.sin()];
        [u, v, x * v - y * u][column]
    });
    let mut meeting = meeting(n, &jacobian, &[1.0, 1.0, 1.0 / inertia]);
    let grip = |(k, point): (usize, &Point)| {
        let mut grip = Grip {
            number: k,
            limit: point.mu,
            contact: Some(k),
            stuck: false,
            rows: vec![n + k],
            only: None,
            moves: false,
            creeps: None,
            fixed: false,
        };
        grip.look(&meeting.geometry, &meeting.sizes);
        grip
    };
    meeting.grips = points.iter().enumerate().map(grip).collect();
    (meeting, jacobian)
}

/// So many contacts, each with its normal first, by the Jacobian of all rows; with what each coordinate gives way.
fn meeting(n: usize, jacobian: &DMatrix<f64>, gives_way: &[f64]) -> Meeting {
    let rows = jacobian.nrows();
    let masses = DMatrix::from_diagonal(&DVector::from_row_slice(gives_way));
    let delassus = jacobian * masses * jacobian.transpose();
    let geometry = jacobian * jacobian.transpose();
    Meeting {
        touching: (0..n).collect(),
        grips: Vec::new(),
        rates: DVector::zeros(rows),
        impulses: DVector::zeros(rows),
        strikes: Vec::new(),
        work: 0.0,
        shared: Vec::new(),
        still: 0.0,
        turns: Cell::new(super::friction::MOST_IN_ALL),
        bearing: Default::default(),
        blocks: vec![(0..rows).collect()],
        around: vec![1.0; rows],
        restitution: vec![0.0; n],
        sizes: (0..rows).map(|row| geometry[(row, row)].sqrt()).collect(),
        unresolved: vec![0.0; rows],
        geometry,
        rows: (0..rows).collect(),
        first: (0..=n).collect(),
        delassus,
        responses: vec![Vec::new(); rows],
        driven: vec![0.0; rows],
        times: vec![0.0; rows],
        jacobian: vec![Vec::new(); rows],
    }
}

/// Contacts of a body at random, jammed against each other or not.
fn at_random(random: &mut Random, most: f64) -> (Meeting, DMatrix<f64>) {
    let points = points_at_random(random, most);
    touching(&points, random.between(0.05, 1.0))
}

fn points_at_random(random: &mut Random, most: f64) -> Vec<Point> {
    let point = |random: &mut Random| Point {
        place: [random.next(), random.next()],
        angle: random.between(-3.0, 3.0),
        mu: random.between(0.0, most),
    };
    (0..1 + random.below(3)).map(|_| point(random)).collect()
}

/// What is off of the law of contact and friction, as a share of what there is.
fn off(meeting: &Meeting, b: &DVector<f64>, p: &DVector<f64>) -> f64 {
    let w = &meeting.delassus * p + b;
    let n = meeting.touching.len();
    let of_contact = |k: usize| {
        let [normal, tangential] = [k, n + k];
        let bound = meeting.grips[k].limit * p[normal].max(0.0);
        let slides = w[tangential].abs() * (bound - p[tangential].abs()).abs().min(1.0);
        let against = (p[tangential] * w[tangential]).max(0.0);
        let parts = [-p[normal], -w[normal], p[normal].min(w[normal]), p[tangential].abs() - bound, slides, against];
        parts.into_iter().fold(0.0, f64::max)
    };
    (0..n).map(of_contact).fold(0.0, f64::max) / (1.0 + p.amax())
}

/// Where all contacts are at rest, there is a choice whatever the friction (Stewart & Trinkle 1996): the matrix is copositive.
#[test]
fn contacts_at_rest_are_always_decided() {
    let mut random = Random(7);
    let mut circled = 0;
    for number in 0..3000 {
        let (meeting, jacobian) = at_random(&mut random, 5.0);
        let b = &jacobian * DVector::from_vec(random.vector(3));
        let candidates = meeting.touching.clone();
        let decision = Decision { meeting: &meeting, b: &b, candidates: &candidates, none: &meeting.none(1e-9) };
        let held = meeting.held(1.0, &b, &meeting.none(1e-9));
        circled += u32::from(decision.pivot(decision.start(held.clone())).is_none());
        let (_, p) = decision.decide(held).unwrap_or_else(|| panic!("{number}: nothing was decided"));
        assert!(off(&meeting, &b, &p) < 1e-7, "{number}: {:.1e}", off(&meeting, &b, &p));
    }
    assert!(circled > 0, "pivoting found them all");
}

/// With little friction there is one motion, and both ways find it.
#[test]
fn pivoting_finds_what_trying_all_choices_finds() {
    let mut random = Random(11);
    for number in 0..1000 {
        let (meeting, jacobian) = at_random(&mut random, 0.05);
        let b = &jacobian * DVector::from_vec(random.vector(3));
        let candidates = meeting.touching.clone();
        let decision = Decision { meeting: &meeting, b: &b, candidates: &candidates, none: &meeting.none(1e-9) };
        let held = meeting.held(1.0, &b, &meeting.none(1e-9));
        let [one, other] =
            [decision.pivot(decision.start(held.clone())), decision.search(&decision.start(held), |_| true)]
                .map(|found| &jacobian.transpose() * found.expect("little friction is decided").1);
        assert!((&one - &other).amax() < 1e-7 * (1.0 + one.amax()), "{number}: {one} {other}");
    }
}

/// Where contacts slide there may be no accelerations; then an impact without an approach ends that, and loses energy.
#[test]
fn sliding_contacts_have_accelerations_or_seize() {
    let mut random = Random(13);
    let mut seized = 0;
    for number in 0..3000 {
        let (mut meeting, jacobian) = at_random(&mut random, 5.0);
        let n = meeting.touching.len();
        // Velocities that no contact approaches or leaves with.
        let normals = jacobian.rows(0, n).into_owned();
        let velocity = DVector::from_vec(random.vector(3));
        let all: Vec<usize> = (0..n).collect();
        meeting.rates = &jacobian * &velocity;
        let force = meeting.stopping(&all, &meeting.rates);
        meeting.rates += meeting.delassus.columns(0, n) * force;
        assert!(meeting.rates.rows(0, n).amax() < 1e-9 * normals.amax(), "{number}");
        let b = &jacobian * DVector::from_vec(random.vector(3));
        let decide = |meeting: &Meeting| {
            let decision = Decision { meeting, b: &b, candidates: &all, none: &meeting.none(1e-9) };
            decision.decide(meeting.held(1e3, &b, &meeting.none(1e-9))).is_some()
        };
        for _ in 0..4 {
            if decide(&meeting) {
                break;
            }
            seized += 1;
            assert!(meeting.seize(1e3), "{number}: neither accelerations nor an impact");
            assert!(meeting.strikes.iter().all(|strike| strike.impulse >= 0.0), "{number}");
            assert!(meeting.strikes.iter().any(|strike| strike.lost > 0.0), "{number}");
            assert!((0..n).all(|k| meeting.rate(k) > -1e-8), "{number}");
        }
        assert!(decide(&meeting), "{number}: undecided");
    }
    assert!(seized > 20, "{seized}");
}

/// A body in a plane gives way in three directions: of many contacts that only push, most follow from others. There is one motion all
/// the same, which both ways find.
#[test]
fn contacts_that_only_push_are_decided_whatever_follows_from_others() {
    let mut random = Random(17);
    for number in 0..1000 {
        let point = |random: &mut Random| Point {
            place: [random.next(), random.next()],
            angle: random.between(-3.0, 3.0),
            mu: 0.0,
        };
        let points: Vec<Point> = (0..1 + random.below(12)).map(|_| point(&mut random)).collect();
        let (mut meeting, jacobian) = touching(&points, random.between(0.05, 1.0));
        meeting.grips.clear();
        let b = &jacobian * DVector::from_vec(random.vector(3));
        let candidates = meeting.touching.clone();
        let decision = Decision { meeting: &meeting, b: &b, candidates: &candidates, none: &meeting.none(1e-9) };
        let (choice, p) = decision.descend().unwrap_or_else(|| panic!("{number}: nothing was decided"));
        let w = &meeting.delassus * &p + &b;
        let n = points.len();
        assert!(
            (0..n).all(|k| w[k] > -1e-8 && p[k] >= 0.0 && p[k] * w[k] < 1e-8 * (1.0 + p.amax())),
            "{number}: {p} {w}"
        );
        assert!(choice.closed.len() <= 3, "{number}: {:?}", choice.closed);
        let (_, other) = decision.pivot(decision.start(Vec::new())).expect("pivoting finds it, too");
        let [one, other] = [p, other].map(|p| &jacobian.transpose() * p);
        assert!((&one - &other).amax() < 1e-7 * (1.0 + one.amax()), "{number}: {one} {other}");
    }
}

/// A ball on the floor that a platform lifts: both hold the same motion, one of them alone is closed, whatever the order and the units
/// of the rows.
#[test]
fn of_contacts_that_move_apart_one_holds() {
    // The size of a row counts the platform, too, which gives way to nothing.
    for (second, size) in [(1.0, 1.0), (1.0, 2.0_f64.sqrt()), (2.0_f64.sqrt(), 1.0), (1e-3, 2.0_f64.sqrt())] {
        for (apart, order) in [2.0, 4.08, 6.0, 1e-3].into_iter().flat_map(|apart| [(apart, [0, 1]), (apart, [1, 0])]) {
            let scales = order.map(|k| [1.0, second][k]);
            let b = DVector::from_vec(order.map(|k| [-9.81, second * (-9.81 - apart)][k]).to_vec());
            let mut meeting = meeting(2, &DMatrix::from_row_slice(2, 1, &scales), &[1.0]);
            let top = order.iter().position(|k| *k == 1).expect("both are there");
            meeting.sizes[top] *= size;
            let found = meeting.at_rest(&b, &[0, 1], Vec::new(), &meeting.none(1e-9)).expect("it is decided");
            assert_eq!(found.closed, [top], "{second} {apart} {order:?}");
            assert!((second * found.forces[top] - 9.81 - apart).abs() < 1e-12, "{second} {apart} {order:?}");
            assert!(found.several.is_empty(), "{second} {apart} {order:?}");
            // The same from all that is closed.
            let decision = Decision { meeting: &meeting, b: &b, candidates: &[0, 1], none: &meeting.none(1e-9) };
            let (choice, _) =
                decision.pivot(Choice { closed: vec![0, 1], ..decision.start(Vec::new()) }).expect("it is decided");
            assert_eq!(choice.closed, [top], "{second} {apart} {order:?}");
        }
    }
}

/// Rows in few directions, some of them along or against each other, that drives move at will. The twin tries all that may be closed.
#[test]
fn contacts_that_drives_move_are_decided_as_trying_all_choices_does() {
    let mut random = Random(37);
    let (mut pressed, mut contradicting, mut pivoted) = (0, 0, 0);
    for number in 0..3000 {
        let (n, free) = (1 + random.below(6), 1 + random.below(3));
        let mut jacobian = DMatrix::from_vec(n, free, random.vector(n * free));
        for row in 1..n {
            if random.below(2) == 0 {
                let scale = random.between(0.3, 3.0) * if random.below(4) == 0 { -1.0 } else { 1.0 };
                let other = jacobian.row(random.below(row)) * scale;
                jacobian.row_mut(row).copy_from(&other);
            }
        }
        let gives_way: Vec<f64> = (0..free).map(|_| random.between(0.3, 3.0)).collect();
        let mut meeting = meeting(n, &jacobian, &gives_way);
        meeting.sizes.iter_mut().for_each(|size| *size *= random.between(1.0, 2.0));
        let b = DVector::from_vec(random.vector(n));
        let is_of_a_kind = |p: &DVector<f64>| {
            let w = &meeting.delassus * p + &b;
            (0..n).all(|k| p[k] > -1e-9 && w[k] > -1e-9 && p[k] * w[k] < 1e-9 * (1.0 + p.amax()))
        };
        let of_subset = |subset: usize| {
            let rows: Vec<usize> = (0..n).filter(|k| subset >> k & 1 == 1).collect();
            let mut p = DVector::zeros(n);
            let found =
                smallest_of_many(&block(&meeting.delassus, &rows), &DVector::from_fn(rows.len(), |i, _| -b[rows[i]]));
            rows.iter().zip(found.iter()).for_each(|(row, value)| p[*row] = *value);
            p
        };
        // Without one, drives press bodies together.
        let Some(twin) = (0..1 << n).map(of_subset).find(is_of_a_kind) else {
            pressed += 1;
            continue;
        };
        let all = of_subset((1 << n) - 1);
        contradicting += u32::from((&meeting.delassus * all + &b).amax() > 1e-6);
        let motion = |p: &DVector<f64>| jacobian.transpose() * p;
        let is_same = |p: &DVector<f64>| (motion(p) - motion(&twin)).amax() < 1e-7 * (1.0 + twin.amax());
        let candidates = meeting.touching.clone();
        let decision = Decision { meeting: &meeting, b: &b, candidates: &candidates, none: &meeting.none(1e-9) };
        let (_, p) = decision.descend().unwrap_or_else(|| panic!("{number}: nothing was decided"));
        assert!(is_of_a_kind(&p) && is_same(&p), "{number}: {p} {twin}");
        let found = meeting.at_rest(&b, &candidates, Vec::new(), &meeting.none(1e-9)).expect("it is decided");
        assert!(is_same(&found.forces) && found.several.is_empty(), "{number}: {:?}", found.several);
        let start = decision.start(Vec::new());
        for closed in [Vec::new(), candidates.clone()] {
            // It may go round in circles.
            if let Some((_, p)) = decision.pivot(Choice { closed, ..start.clone() }) {
                assert!(is_of_a_kind(&p) && is_same(&p), "{number}: {p} {twin}");
                pivoted += 1;
            }
        }
        let (_, p) = decision.search(&start, |_| true).unwrap_or_else(|| panic!("{number}: no choice"));
        assert!(is_same(&p), "{number}: {p} {twin}");
    }
    assert!(pressed > 100 && contradicting > 300, "{pressed} {contradicting}");
    assert!(pivoted > 3000, "{pivoted}");
}

/// Contacts with friction whose other bodies move away at will: there is a choice, and it meets the law.
#[test]
fn contacts_with_friction_that_drives_move_apart_meet_the_law() {
    let mut random = Random(41);
    for number in 0..2000 {
        let (meeting, jacobian) = at_random(&mut random, 1.0);
        let n = meeting.touching.len();
        let mut b = &jacobian * DVector::from_vec(random.vector(3));
        (0..n).for_each(|k| b[k] += random.between(0.0, 1.0));
        let none = meeting.none(1e-9);
        let held = meeting.held(1.0, &b, &none);
        let found = meeting.at_rest(&b, &meeting.touching, held, &none);
        let found = found.unwrap_or_else(|| panic!("{number}: nothing was decided"));
        assert!(off(&meeting, &b, &found.forces) < 1e-7, "{number}: {:.1e}", off(&meeting, &b, &found.forces));
    }
}

#[test]
fn systems_that_are_clearly_not_singular_are_solved_alike_without_singular_values() {
    let mut random = Random(19);
    let (mut one, mut many) = (0, 0);
    for number in 0..500 {
        let n = 1 + random.below(8);
        let rank = n - random.below(2).min(n - 1);
        let [left, right] = [0, 1].map(|_| DMatrix::from_vec(n, rank, random.vector(n * rank)));
        let matrix = &left * right.transpose();
        let b = &matrix * DVector::from_vec(random.vector(n));
        match only_one(&matrix, &b) {
            Some(x) => {
                one += 1;
                let other = smallest_of_many(&matrix, &b);
                assert!((&x - &other).amax() < 1e-8 * other.amax(), "{number}: {x} {other}");
                assert_eq!(rank, n, "{number}");
            }
            None => many += 1,
        }
    }
    assert!(one > 100 && many > 100, "{one} {many}");
}

/// The twin of solving by blocks is the matrix as a whole.
#[test]
fn what_rests_apart_is_decided_by_itself() {
    let mut random = Random(29);
    for number in 0..300 {
        let sizes: Vec<usize> = (0..1 + random.below(5)).map(|_| 1 + random.below(4)).collect();
        let n = sizes.iter().sum();
        let mut apart = DMatrix::zeros(n, n);
        let mut first = 0;
        for size in &sizes {
            // Every other one is singular.
            let rank = if random.below(2) == 0 { *size } else { size.div_ceil(2) };
            let factor = DMatrix::from_fn(*size, rank, |_, _| random.next());
            apart.view_mut((first, first), (*size, *size)).copy_from(&(&factor * factor.transpose()));
            first += size;
        }
        let mut order: Vec<usize> = (0..n).collect();
        (0..n).for_each(|k| order.swap(k, random.below(n)));
        let matrix = apart.select_rows(&order).select_columns(&order);
        let found = blocks(&matrix);
        assert!(found.len() >= sizes.len(), "{number}");
        let b = &matrix * DVector::from_vec(random.vector(n));
        let (by_blocks, whole) = (smallest(&matrix, &b), smallest_of_many(&matrix, &b));
        assert!((&by_blocks - &whole).amax() <= 1e-6 * whole.amax(), "{number}: {by_blocks} {whole}");
        let mut all = found.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..n), "{number}");
    }
}

/// What is at rest stays so if contacts can hold it, also where it could go without them pressing: a bracket that its weight jams on a pole.
#[test]
fn what_can_stay_at_rest_stays() {
    let mut random = Random(23);
    let mut went = 0;
    for number in 0..3000 {
        let (meeting, jacobian) = at_random(&mut random, 5.0);
        let b = &jacobian * DVector::from_vec(random.vector(3));
        let candidates = meeting.touching.clone();
        let all = |mut held: Vec<Held>| {
            held.iter_mut().for_each(|one| one.direction = [0.0; 2]);
            let mut p = meeting.forces(&b, &candidates, &mut held);
            meeting.share(&mut p, &Choice { closed: candidates.clone(), held, wide: false });
            p
        };
        let holds = off(&meeting, &b, &all(meeting.held(1.0, &b, &meeting.none(1e-9)))) < 1e-10;
        let moves = |p: &DVector<f64>| (&meeting.delassus * p + &b).amax() > 1e-6;
        let found = meeting
            .at_rest(&b, &candidates, meeting.held(1.0, &b, &meeting.none(1e-9)), &meeting.none(1e-9))
            .expect("contacts at rest are decided");
        assert!(off(&meeting, &b, &found.forces) < 1e-7, "{number}: {:.1e}", off(&meeting, &b, &found.forces));
        assert!(!holds || !moves(&found.forces), "{number}: it could stay");
        let alone = meeting
            .complementary(&b, &candidates, meeting.held(1.0, &b, &meeting.none(1e-9)), &meeting.none(1e-9))
            .expect("the same");
        went += u32::from(holds && moves(&alone.forces));
    }
    assert!(went > 10, "{went}");
}

/// A body with these feet side by side that falls flat, its velocity after it has struck, and the feet that share the impulse in a way
/// that the motion depends on. Each foot: how far aside, friction, restitution.
fn fallen(feet: &[[f64; 3]], velocity: [f64; 2]) -> (DVector<f64>, usize) {
    let point = |[x, mu, _]: &[f64; 3]| Point { place: [*x, -0.7], angle: std::f64::consts::FRAC_PI_2, mu: *mu };
    let (mut meeting, jacobian) = touching(&feet.iter().map(point).collect::<Vec<_>>(), 0.3);
    meeting.restitution = feet.iter().map(|[_, _, e]| *e).collect();
    let before = DVector::from_vec(vec![velocity[0], velocity[1], 0.0]);
    meeting.rates = &jacobian * &before;
    // Round-off, as it decided on an order.
    for k in 0..feet.len() {
        meeting.rates[k] *= 1.0 + 1e-15 * ((k * 7) % 5) as f64;
    }
    meeting.strike_all(1.0, 1e-9).expect("an impact is decided");
    let masses = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 1.0, 1.0 / 0.3]));
    (before + masses * jacobian.transpose() * &meeting.impulses, meeting.shared.len())
}

/// Feet that strike at once do so in no order.
#[test]
fn feet_that_strike_at_once_do_so_in_no_order() {
    let mut random = Random(29);
    let mut slid = 0;
    for number in 0..500 {
        let (mu, e) = (random.between(0.0, 0.8), [0.0, 0.5, 0.9][random.below(3)]);
        let mut feet: Vec<[f64; 3]> = (0..2 + random.below(4)).map(|_| [random.next(), mu, e]).collect();
        let velocity = [random.next(), -random.between(0.2, 1.0)];
        let (one, shared) = fallen(&feet, velocity);
        assert_eq!(shared, 0, "{number}: friction and restitution are alike");
        slid += u32::from((one[0] - 0.7 * one[2]).abs() > 1e-6);
        feet.reverse();
        let (other, _) = fallen(&feet, velocity);
        assert!((&one - &other).amax() < 1e-9, "{number}: {one} {other}");
        // In a mirror.
        feet.iter_mut().for_each(|foot| foot[0] = -foot[0]);
        let (other, _) = fallen(&feet, [-velocity[0], velocity[1]]);
        let seen = DVector::from_vec(vec![-other[0], other[1], -other[2]]);
        assert!((&one - &seen).amax() < 1e-9, "{number}: {one} {seen}");
    }
    assert!(slid > 100, "{slid}");
}

/// The order in which contacts strike depends on no length that rotations are taken on: that of a scene is another one where it is turned.
#[test]
fn the_order_of_impacts_depends_on_no_size_of_the_scene() {
    let mut random = Random(31);
    let mut several = 0;
    for number in 0..500 {
        let (points, inertia) = (points_at_random(&mut random, 0.6), random.between(0.05, 1.0));
        let before = DVector::from_vec(random.vector(3));
        let mut after = |most: f64| {
            let (mut meeting, jacobian) = touching(&points, inertia);
            meeting.sizes.iter_mut().for_each(|size| *size *= random.between(1.0, most));
            meeting.rates = &jacobian * &before;
            meeting.strike_all(1.0, 1e-9).map(|()| (meeting.strikes.len(), meeting.impulses))
        };
        match (after(1.0), after(2.0)) {
            (Ok((strikes, one)), Ok((_, other))) => {
                several += u32::from(strikes > 1);
                assert!((&one - &other).amax() < 1e-6 * (1.0 + one.amax()), "{number}: {one} {other}");
            }
            (one, other) => assert_eq!(one.is_ok(), other.is_ok(), "{number}"),
        }
    }
    assert!(several > 50, "{several}");
}

/// Three feet of a body in a plane share an impulse as rigid bodies leave open: that is told where the motion depends on it.
#[test]
fn impulses_that_are_shared_are_told_where_the_motion_depends_on_them() {
    let feet = |mu: [f64; 3], e: [f64; 3]| [0, 1, 2].map(|k| [[-0.5, 0.1, 0.5][k], mu[k], e[k]]);
    let shared = |mu: [f64; 3], e: [f64; 3]| fallen(&feet(mu, e), [2.0, -1.0]).1;
    assert_eq!(shared([0.1; 3], [0.0; 3]), 0);
    assert_eq!(shared([0.1; 3], [0.5; 3]), 0);
    assert_eq!(shared([0.1, 0.2, 0.1], [0.0; 3]), 3, "friction that differs");
    assert_eq!(shared([0.0; 3], [0.1, 0.5, 0.1]), 3, "restitution that differs");
    let two = fallen(&feet([0.1, 0.2, 0.1], [0.1, 0.5, 0.3])[..2], [2.0, -1.0]);
    assert_eq!(two.1, 0, "two feet share in one way");
}

/// Where contacts at rest begin to move in one of several ways, that is told, whatever the order in which contacts are looked at.
#[test]
fn several_motions_are_told_in_every_order() {
    let mut random = Random(31);
    let (mut several, mut unseen) = (0, 0);
    for number in 0..3000 {
        let point = |random: &mut Random| Point {
            place: [random.next(), random.next()],
            angle: random.between(-3.0, 3.0),
            mu: random.between(0.0, 5.0),
        };
        let mut points: Vec<Point> = (0..1 + random.below(3)).map(|_| point(&mut random)).collect();
        let (inertia, push) = (random.between(0.05, 1.0), DVector::from_vec(random.vector(3)));
        let motion = |points: &[Point]| {
            let (meeting, jacobian) = touching(points, inertia);
            let b = &jacobian * &push;
            let found = meeting
                .at_rest(&b, &meeting.touching, meeting.held(1.0, &b, &meeting.none(1e-9)), &meeting.none(1e-9))
                .expect("it is decided");
            let masses = DVector::from_vec(vec![1.0, 1.0, 1.0 / inertia]);
            (masses.component_mul(&(jacobian.transpose() * &found.forces)), found.several.len())
        };
        let push_per_mass = push.clone();
        let one = motion(&points);
        points.reverse();
        let other = motion(&points);
        several += u32::from(one.1 > 0);
        let is_same = (&one.0 - &other.0).amax() < 1e-6 * (1.0 + one.0.amax());
        // Rest that friction could hold is found in one order, and in another not: see `what_can_stay_at_rest_stays`.
        let rests = |forces: &DVector<f64>| (forces + &push_per_mass).amax() < 1e-6;
        if !is_same && (rests(&one.0) || rests(&other.0)) {
            unseen += 1;
            continue;
        }
        assert!(is_same || one.1 > 0 && other.1 > 0, "{number}: {} {}", one.0, other.0);
    }
    assert!(unseen < 150, "{unseen}");
    assert!(several > 10, "{several}");
}

/// Two feet on a body that hardly gives way, by round-off: what it gives of one to the other is none, and they are decided apart.
#[test]
fn round_off_couples_no_feet() {
    let jacobian = [vec![(0, 1.0), (2, -1.0)], vec![(1, 1.0), (2, -1.0)]];
    let coupling = |given: f64| {
        let responses = [vec![0.5, 0.0, -given], vec![0.0, 0.25, -given]];
        super::coupled(2, |i, j| super::dot(&jacobian[i], &responses[j]), |_| 1.0)
    };
    for (given, count) in [(1e-17, 2), (1e-9, 1)] {
        let matrix = coupling(given);
        assert_eq!(super::blocks_of([&matrix, &matrix], &[0, 1, 2], &[]).len(), count);
    }
}
