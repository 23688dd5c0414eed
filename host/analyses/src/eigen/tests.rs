//! Matrices whose eigenvalues are known.

use super::*;

/// Numbers between -0.5 and 0.5 in a square.
pub(super) fn random(n: usize, seed: usize) -> DMatrix<f64> {
    let mut state = seed as u64;
    DMatrix::from_fn(n, n, |_, _| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    })
}

fn values(matrix: &DMatrix<f64>) -> Spectrum {
    let found = spectrum(matrix).unwrap();
    for pair in &found.pairs {
        assert!(pair.residual < 1e-13, "{pair:?}");
        let whole = matrix.map(|value| Complex::new(value, 0.0));
        let miss = (&whole * &pair.vector - &pair.vector * pair.value).norm();
        assert!(miss <= 1e-10 * matrix.norm() * pair.vector.norm());
        assert!((pair.left.dotc(&pair.vector) - Complex::new(1.0, 0.0)).norm() < 1e-12, "{pair:?}");
        let miss = (whole.adjoint() * &pair.left - &pair.left * pair.value.conj()).norm();
        assert!(miss <= 1e-10 * matrix.norm() * pair.left.norm(), "{pair:?}");
    }
    found
}

#[test]
fn a_damped_oscillator_has_its_pair() {
    let found = values(&DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -9.0, -0.6]));
    assert_eq!((found.zeros, found.pairs.len()), (0, 1));
    let value = found.pairs[0].value;
    assert!((value - Complex::new(-0.3, (9.0_f64 - 0.09).sqrt())).norm() < 1e-14);
}

#[test]
fn rigid_motions_are_zeros_not_pairs_of_the_size_of_a_root() {
    // Two masses of 1 and 3 on a spring: one rigid motion, w^2 = k (1 + 1/3).
    let k = 4e8;
    let mut a = DMatrix::zeros(4, 4);
    (a[(0, 2)], a[(1, 3)]) = (1.0, 1.0);
    (a[(2, 0)], a[(2, 1)], a[(3, 0)], a[(3, 1)]) = (-k, k, k / 3.0, -k / 3.0);
    let found = values(&a);
    assert_eq!((found.zeros, found.null.ncols(), found.pairs.len()), (2, 1, 1));
    assert!((found.pairs[0].value.im / (k * 4.0 / 3.0).sqrt() - 1.0).abs() < 1e-13);
    assert!((found.null[(0, 0)] / found.null[(1, 0)] - 1.0).abs() < 1e-12);
}

#[test]
fn a_top_that_stands_falls_and_turns_freely_about_itself() {
    // Hessenberg's form of the fall, lambda^2 = g +- i h sqrt(g), and the angle about itself.
    let (g, h) = (64.0, 5.0);
    let mut a = DMatrix::zeros(6, 6);
    (a[(0, 1)], a[(0, 3)], a[(1, 0)], a[(2, 1)], a[(2, 3)], a[(3, 2)]) = (1.0, -h, g, h, g, 1.0);
    a[(4, 5)] = 1.0;
    let found = values(&a);
    assert_eq!((found.zeros, found.null.ncols(), found.pairs.len()), (2, 1, 2));
    let root = Complex::new(g, h * 8.0).sqrt();
    for known in [root, -root.conj()] {
        assert!(found.pairs.iter().any(|pair| (pair.value - known).norm() < 1e-12), "{:?}", found.pairs);
    }
}

#[test]
fn equal_eigenvalues_have_vectors_of_their_own() {
    let mut a = DMatrix::zeros(4, 4);
    for k in 0..2 {
        (a[(k, k + 2)], a[(k + 2, k)]) = (1.0, -25.0);
    }
    let found = values(&a);
    assert_eq!(found.pairs.len(), 2);
    let along = found.pairs[0].vector.dotc(&found.pairs[1].vector).norm();
    assert!(along < 0.9 * found.pairs[0].vector.norm() * found.pairs[1].vector.norm());
}

#[test]
fn a_saddle_beside_a_stiff_mode_is_seen_and_a_doubtful_one_is_left_open() {
    let saddle = |growth: f64, stiff: f64| {
        let mut a = DMatrix::zeros(4, 4);
        (a[(0, 2)], a[(1, 3)]) = (1.0, 1.0);
        // Turned by 30 degrees, so that the parts mix.
        let (c, s) = (0.75_f64.sqrt(), 0.5);
        let (x, y) = (growth * growth, -stiff * stiff);
        (a[(2, 0)], a[(3, 1)]) = (c * c * x + s * s * y, s * s * x + c * c * y);
        a[(2, 1)] = c * s * (x - y);
        a[(3, 0)] = a[(2, 1)];
        spectrum(&a).unwrap()
    };
    let seen = saddle(1e-2, 1e4);
    let grows = seen.pairs.iter().find(|pair| pair.value.re > pair.uncertainty).unwrap();
    assert!((grows.value.re - 1e-2).abs() <= grows.uncertainty, "{grows:?}");
    let open = saddle(1e-9, 1e4);
    assert!(open.pairs.iter().all(|pair| pair.value.re.abs() <= pair.uncertainty));
}

/// What was done before: the whole matrix factored for each eigenvalue.
fn plain_vector(matrix: &DMatrix<f64>, value: Complex<f64>) -> ComplexVector {
    let n = matrix.nrows();
    let shift = value + Complex::new(3e-16, 1e-16) * matrix.norm();
    let factors = (matrix.map(|value| Complex::new(value, 0.0)) - DMatrix::from_diagonal_element(n, n, shift)).lu();
    let mut vector = ComplexVector::from_fn(n, |k, _| Complex::new(1.0 + (k % 7) as f64, 0.0));
    for _ in 0..4 {
        let next = factors.solve(&vector).unwrap();
        vector = &next / Complex::new(next.norm(), 0.0);
    }
    vector
}

#[test]
fn vectors_are_those_of_the_whole_matrix() {
    for n in [1, 2, 3, 10, 37] {
        let a = DMatrix::from_fn(n, n, |row, column| ((1 + row * 31 + column * 17 + row * column) as f64).sin());
        let found = values(&a);
        assert!(!found.pairs.is_empty());
        for pair in &found.pairs {
            let plain = plain_vector(&a, pair.value);
            let along = plain.dotc(&pair.vector).norm() / pair.vector.norm();
            assert!((along - 1.0).abs() < 1e-9, "{n}: {along} of {}", pair.value);
        }
    }
}

#[test]
fn masses_in_a_row_have_their_known_modes() {
    // w = 2 sin(k pi / (2 (n + 1))), and shapes sin(j k pi / (n + 1)), of n masses between walls.
    let n = 60;
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    for k in 0..n {
        (a[(k, n + k)], a[(n + k, k)]) = (1.0, -2.0);
        for beside in [k.wrapping_sub(1), k + 1].into_iter().filter(|beside| *beside < n) {
            a[(n + k, beside)] = 1.0;
        }
    }
    let found = values(&a);
    assert_eq!((found.zeros, found.pairs.len()), (0, n));
    for (k, pair) in (1..).zip(&found.pairs) {
        let angle = k as f64 * std::f64::consts::PI / (n + 1) as f64;
        assert!((pair.value.im - 2.0 * (0.5 * angle).sin()).abs() < 1e-12, "{k}: {}", pair.value);
        let shape = ComplexVector::from_fn(n, |j, _| Complex::new(((j + 1) as f64 * angle).sin(), 0.0));
        let own = pair.vector.rows(0, n);
        assert!((own.dotc(&shape).norm() / own.norm() / shape.norm() - 1.0).abs() < 1e-12, "{k}");
    }
}

#[test]
fn a_double_eigenvalue_with_one_vector_has_it_and_is_left_open() {
    // Two critically damped oscillators beside a lightly damped one.
    for (w, others) in [(20.0, 1), (20.0, 2), (3.0, 2), (1.0, 0), (100.0, 3)] {
        let n = 2 * (2 + others);
        let mut a = DMatrix::zeros(n, n);
        for k in 0..n / 2 {
            let (w, d) = if k < 2 { (w, 2.0 * w) } else { (8.0 + k as f64, 4.8) };
            (a[(2 * k, 2 * k + 1)], a[(2 * k + 1, 2 * k)], a[(2 * k + 1, 2 * k + 1)]) = (1.0, -w * w, -d);
        }
        let found = spectrum(&a).unwrap();
        for pair in &found.pairs {
            assert!(pair.residual < 1e-9, "{w}: {pair:?}");
            let double = (pair.value + w).norm() < 1e-5 * w;
            assert_eq!(double, pair.uncertainty > 1e-7 * w, "{w}: {} {}", pair.value, pair.uncertainty);
        }
    }
}

/// A critically damped oscillator decays, whatever round-off makes of its double eigenvalue; one that grows alike grows.
#[test]
fn a_double_eigenvalue_is_moved_by_the_root_of_round_off_at_most() {
    for d in [20.0, -20.0] {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -100.0, -d]);
        let found = spectrum(&a).unwrap();
        assert!(!found.pairs.is_empty());
        for pair in &found.pairs {
            assert!((pair.value + 0.5 * d).norm() < pair.uncertainty && pair.uncertainty < 1e-3, "{pair:?}");
        }
    }
}

/// Many critically damped oscillators of one frequency, by themselves or seen in other coordinates, beside a lightly damped one: each pair of
/// equal eigenvalues has a vector of its own, however many there are, and round-off moves them by its square root.
#[test]
fn equal_double_eigenvalues_are_moved_as_one_of_them_is() {
    for (count, turned) in [(2, false), (3, false), (3, true), (12, false), (12, true), (25, false)] {
        let (w, n) = (10.0, 2 * count + 2);
        let mut a = DMatrix::zeros(n, n);
        for k in 0..=count {
            let (w, d) = if k < count { (w, 2.0 * w) } else { (8.0, 4.8) };
            (a[(2 * k, 2 * k + 1)], a[(2 * k + 1, 2 * k)], a[(2 * k + 1, 2 * k + 1)]) = (1.0, -w * w, -d);
        }
        if turned {
            let q = random(n, count).qr().q();
            a = &q * a * q.transpose();
        }
        let found = spectrum(&a).unwrap();
        let equal: Vec<&Pair> = found.pairs.iter().filter(|pair| (pair.value + w).norm() < 1e-3 * w).collect();
        let copies: usize = equal.iter().map(|pair| if pair.value.im > 0.0 { 2 } else { 1 }).sum();
        assert_eq!((copies, found.pairs.len()), (2 * count, equal.len() + 1), "{count} {turned}");
        for pair in &equal {
            assert!(
                (pair.value + w).norm() < pair.uncertainty && pair.uncertainty < 1e-3 * w,
                "{count} {turned} {pair:?}"
            );
            assert!(pair.residual < 1e-10, "{count} {turned}: {}", pair.residual);
        }
        if count > 2 {
            let vectors = DMatrix::from_fn(n, equal.len(), |row, k| equal[k].vector[row].re);
            let values = crate::linalg::SingularValues::of(&vectors).unwrap();
            assert_eq!(values.rank(1e-6 * values.largest()), count, "{count} {turned}");
        }
    }
}

/// Masses in a plane row, each tied to the next along it by a spring and across it by a spring that is far softer, with a damper on
/// some; held at one end, or not.
fn row(masses: usize, soft: f64, held: bool) -> DMatrix<f64> {
    let n = 2 * masses;
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    for (k, stiffness) in
        [(0, 1.0), (1, soft)].into_iter().flat_map(|(along, s)| (0..masses).map(move |k| (2 * k + along, s)))
    {
        a[(k, n + k)] = 1.0;
        let mass = 1.0 + (k % 7) as f64;
        for beside in [k.wrapping_sub(2), k + 2] {
            if beside < n || held && beside > n {
                a[(n + k, k)] -= stiffness / mass;
            }
            if beside < n {
                a[(n + k, beside)] += stiffness / mass;
            }
        }
        if k % 5 == 0 {
            a[(n + k, n + k)] = -0.01 * stiffness.sqrt();
        }
    }
    a
}

#[test]
fn large_matrices_have_pairs_that_meet_them_and_are_those_of_the_whole_matrix() {
    for (name, a, zeros) in [
        ("random", random(150, 1), 0),
        ("held", row(50, 1e-4, true), 0),
        ("free", row(40, 1e-4, false), 2),
        ("softer", row(30, 1e-7, true), 0),
        (
            "turned",
            {
                let q = random(120, 5).qr().q();
                &q * row(30, 1e-2, false) * q.transpose()
            },
            2,
        ),
    ] {
        let found = values(&a);
        let all: usize = found.pairs.iter().map(|pair| 1 + usize::from(pair.value.im > 0.0)).sum();
        assert_eq!((found.zeros, all + found.zeros), (zeros, a.nrows()), "{name}");
        let sum: f64 =
            found.pairs.iter().map(|pair| pair.value.re * (1.0 + f64::from(u8::from(pair.value.im > 0.0)))).sum();
        assert!((sum - a.trace()).abs() < 1e-11 * a.norm(), "{name}");
        for pair in found.pairs.iter().step_by(9) {
            let plain = plain_vector(&a, pair.value);
            let along = plain.dotc(&pair.vector).norm() / pair.vector.norm();
            assert!((along - 1.0).abs() < 1e-9, "{name}: {along} of {}", pair.value);
        }
    }
}
