//! [`analysed`]: what is found out about a sparsity pattern, found out once.

use std::cell::RefCell;

use super::{Clusters, KktStructure, LinalgError, SparseLdl};

/// Patterns that are kept per thread: those of one scene and of what it is examined with.
const MOST: usize = 8;
/// Entries of a pattern beyond which it is not kept.
const LARGEST: usize = 4000;

/// A pattern with its clusters, and the factorisation before it has numbers.
struct Known {
    structure: KktStructure,
    clusters: Option<Clusters>,
    factorisation: SparseLdl,
}

thread_local! {
    /// The last ones, the latest in front.
    static KNOWN: RefCell<Vec<Known>> = const { RefCell::new(Vec::new()) };
}

/// The factorisation of a pattern as `analyse` gives it, which depends on the pattern and its clusters alone. Scenes, and more so their
/// variants, ask for the same patterns again and again.
///
/// # Errors
/// That of `analyse`.
pub(super) fn analysed(
    structure: &KktStructure,
    clusters: Option<&Clusters>,
    analyse: impl FnOnce() -> Result<SparseLdl, LinalgError>,
) -> Result<SparseLdl, LinalgError> {
    if structure.mass.len() + structure.jacobian.len() > LARGEST {
        return analyse();
    }
    let found = KNOWN.with_borrow_mut(|list| {
        let same = |known: &Known| known.structure == *structure && known.clusters.as_ref() == clusters;
        let at = list.iter().position(same)?;
        list[..=at].rotate_right(1);
        Some(list[0].factorisation.clone())
    });
    if let Some(found) = found {
        return Ok(found);
    }
    let factorisation = analyse()?;
    let known =
        Known { structure: structure.clone(), clusters: clusters.cloned(), factorisation: factorisation.clone() };
    KNOWN.with_borrow_mut(|list| {
        list.truncate(MOST - 1);
        list.insert(0, known);
    });
    Ok(factorisation)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use super::*;

    fn known() -> usize {
        KNOWN.with_borrow(Vec::len)
    }

    /// A row of bodies on a line, each next to the one before.
    fn chain(bodies: usize) -> KktStructure {
        let mass = (0..bodies).map(|k| (k, k)).collect();
        let jacobian = (1..bodies).flat_map(|k| [(k - 1, k - 1), (k - 1, k)]).collect();
        KktStructure::new(bodies, bodies - 1, mass, jacobian).unwrap()
    }

    #[test]
    fn a_pattern_is_analysed_once_and_gives_what_it_gave_before() {
        let anew = |structure: &KktStructure| {
            let order = crate::linalg::constraint_order(structure, None).unwrap();
            SparseLdl::new(structure, &order).unwrap()
        };
        for bodies in [2, 5, 9, 5] {
            let structure = chain(bodies);
            let first = SparseLdl::with_computed_order(&structure, None).unwrap();
            let again = analysed(&structure, None, || unreachable!("it is known")).unwrap();
            let text = |solver: &SparseLdl| format!("{solver:?}");
            assert_eq!(text(&again), text(&anew(&structure)));
            assert_eq!(text(&first), text(&again));
        }
        // The same pattern in other clusters is another question.
        let clusters = Clusters { velocities: vec![0, 0, 1, 2, 3], rows: vec![0, 0, 1, 2] };
        let mut asked = false;
        let found = analysed(&chain(5), Some(&clusters), || {
            asked = true;
            Ok(anew(&chain(5)))
        });
        assert!(asked && found.is_ok());
    }

    #[test]
    fn what_is_kept_is_bounded() {
        for bodies in 2..40 {
            SparseLdl::with_computed_order(&chain(bodies), None).unwrap();
        }
        assert_eq!(known(), MOST);
        let before = known();
        SparseLdl::with_computed_order(&chain(LARGEST), None).unwrap();
        let front = KNOWN.with_borrow(|list| list[0].structure.n);
        assert!(known() == before && front < LARGEST, "a large pattern is not kept");
    }

    #[test]
    fn factorisations_of_one_pattern_have_their_own_numbers() {
        let structure = chain(3);
        let solve = |solver: &mut SparseLdl, mass: f64| {
            use crate::linalg::KktSolver;
            solver.set_mass(&[mass; 3]).unwrap();
            solver.refactor(&[1.0, -1.0, 1.0, -1.0]).unwrap();
            let (mut x, mut lambda) = ([0.0; 3], [0.0; 2]);
            solver.solve(&[1.0, 2.0, 6.0], &[0.0; 2], &mut x, &mut lambda).unwrap();
            x
        };
        let mut light = SparseLdl::with_computed_order(&structure, None).unwrap();
        let mut heavy = SparseLdl::with_computed_order(&structure, None).unwrap();
        let (first, second) = (solve(&mut light, 1.0), solve(&mut heavy, 2.0));
        assert!((first[0] - 3.0).abs() < 1e-14 && (second[0] - 1.5).abs() < 1e-14, "{first:?} {second:?}");
    }
}
