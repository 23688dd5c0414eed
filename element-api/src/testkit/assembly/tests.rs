//! Assembly, ranks, free directions.

use nalgebra::DVector;

use super::{free_directions, least_step, rank};
use crate::testkit::{Probe, Random, assembled_setting};
use crate::tests::Screw;

#[test]
fn joints_are_assembled_from_anywhere() {
    let mut random = Random::new(71);
    for params in ["pitch = 0.3", "pitch = -1.0\nspeed = 0.5", "pitch = 0.3\nheld = false"] {
        let probe = Probe::joint::<Screw>(params).expect("accepted");
        for _ in 0..10 {
            let setting = assembled_setting(&probe, &mut random);
            let found = probe.joint_values(&setting);
            assert!(found.residual().iter().all(|row| row.abs() < 1e-11), "{params}: {:?}", found.residual());
            assert!((setting.references[0] - found.angles[0]).abs() < 1e-14);
        }
    }
}

#[test]
fn an_assembled_joint_stays_where_it_is() {
    let probe = Probe::joint::<Screw>("pitch = 0.3").expect("accepted");
    let setting = assembled_setting(&probe, &mut Random::new(72));
    let mut again = setting.clone();
    assert!(probe.assemble(&mut again));
    assert_eq!(again.frames, setting.frames);
}

#[test]
fn ranks_and_free_directions_add_up() {
    let rows = vec![vec![1.0, 2.0, 0.0, 0.0], vec![0.0, 1.0, 1.0, 0.0], vec![1.0, 4.0, 2.0, 0.0]];
    let free = free_directions(&rows, 4);
    assert_eq!((rank(&rows), free.len()), (2, 2));
    for direction in &free {
        assert!((direction.norm() - 1.0).abs() < 1e-12);
        for row in &rows {
            let rate: f64 = row.iter().zip(direction.iter()).map(|(a, b)| a * b).sum();
            assert!(rate.abs() < 1e-12, "{rate}");
        }
    }
    assert!(free[0].dot(&free[1]).abs() < 1e-12);
    assert_eq!((rank(&[]), free_directions(&[], 6).len()), (0, 6));
}

#[test]
fn rows_that_depend_on_each_other_have_their_rank_directions_and_least_step() {
    let mut random = Random::new(73);
    for case in 0..2000 {
        let (m, n, own) = (1 + case % 7, 1 + case % 12, case % 5);
        let mut numbers = |count| -> Vec<f64> { (0..count).map(|_| random.between(-1.0, 1.0)).collect() };
        let own: Vec<Vec<f64>> = (0..own.min(m).min(n)).map(|_| numbers(n)).collect();
        let mixed = |share: Vec<f64>| (0..n).map(|k| own.iter().zip(&share).map(|(row, x)| x * row[k]).sum()).collect();
        let rows: Vec<Vec<f64>> = (0..m).map(|_| mixed(numbers(own.len()))).collect();
        let product = |x: &DVector<f64>| -> DVector<f64> {
            DVector::from_iterator(m, rows.iter().map(|row| DVector::from_column_slice(row).dot(x)))
        };
        let free = free_directions(&rows, n);
        assert_eq!((rank(&rows), free.len()), (own.len(), n - own.len()), "{rows:?}");
        let residual = product(&DVector::from_vec(numbers(n)));
        let step = least_step(&rows, &residual).expect("finite");
        let close = 1e-9 * (1.0 + step.amax());
        assert!((product(&step) + residual).amax() < close, "{rows:?}");
        for direction in &free {
            assert!(product(direction).amax() < 1e-9 && direction.dot(&step).abs() < close, "{rows:?}");
        }
    }
}
