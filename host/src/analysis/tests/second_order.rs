//! The equations with constraints on positions, against the working form and against differences.

use super::*;

/// The equations of a scene, and what is put into them.
struct Motion {
    stand: Stand,
    form: SecondOrderForm,
    state: Vec<f64>,
    accelerations: Vec<f64>,
    multipliers: Vec<f64>,
}

impl Motion {
    /// At a random state on the constraints, with the accelerations and multipliers that belong to it.
    #[track_caller]
    fn new(text: &str, random: &mut Random) -> Self {
        let Prepared { model, equations, assembly, plan, .. } = prepared(text);
        let mut form = SecondOrderForm::new(&equations, &model, &plan).unwrap();
        form.set_discrete(&assembly.references, &assembly.discrete);
        let mut stand = stand(text);
        let state = stand.consistent(random, 0.05);
        let inputs = stand.inputs(&state);
        let all = stand.multipliers(&inputs);
        let multipliers = form.rows_in_use().iter().map(|row| all[*row]).collect();
        let accelerations = stand.accelerations(&inputs).as_slice().to_vec();
        Self { stand, form, state, accelerations, multipliers }
    }

    /// Forces and rows left, one after the other; and the rates.
    fn residual(&mut self, state: &[f64], accelerations: &[f64], multipliers: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut left = vec![f64::NAN; accelerations.len() + multipliers.len()];
        let mut rates = vec![f64::NAN; state.len()];
        let parts = left.split_at_mut(accelerations.len());
        let sets = self.stand.form.sets();
        self.form.residual((TIME, state), (accelerations, multipliers), sets, parts, &mut rates).unwrap();
        (left, rates)
    }

    fn here(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (state, accelerations, multipliers) =
            (self.state.clone(), self.accelerations.clone(), self.multipliers.clone());
        self.residual(&state, &accelerations, &multipliers)
    }

    /// The moves and changes that take `left` away, one after the other.
    fn solve(&mut self, left: &[f64]) -> Vec<f64> {
        let n = self.accelerations.len();
        let mut found = vec![f64::NAN; left.len()];
        self.form.solve(left.split_at(n), found.split_at_mut(n)).unwrap();
        found
    }

    /// The derivative of the residual along moves and changes, by central differences.
    fn difference_along(&mut self, direction: &[f64], mass_share: f64, damping_share: f64) -> Vec<f64> {
        let (step, n) = (1e-5, self.accelerations.len());
        let (moves, changes) = direction.split_at(n);
        let mut left = |sign: f64| {
            let add = |values: &[f64], share: f64, along: &[f64]| -> Vec<f64> {
                values.iter().zip(along).map(|(value, d)| value + sign * step * share * d).collect()
            };
            let mut velocities = vec![0.0; n];
            velocities_of(&self.state, &mut velocities);
            let mut state = self.state.clone();
            place(&self.state, &add(&vec![0.0; n], 1.0, moves), &add(&velocities, damping_share, moves), &mut state);
            let accelerations = add(&self.accelerations, mass_share, moves);
            let multipliers = add(&self.multipliers, 1.0, changes);
            self.residual(&state, &accelerations, &multipliers).0
        };
        let (after, before) = (left(1.0), left(-1.0));
        after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect()
    }
}

#[test]
fn the_solution_of_the_working_form_leaves_nothing() {
    let mut random = Random(307);
    for text in [scenes::tangle(), scenes::four_bar(1.1), scenes::opaque_tangle()] {
        let mut motion = Motion::new(&text, &mut random);
        let (left, rates) = motion.here();
        let size = amax(&motion.accelerations).max(amax(&motion.multipliers));
        assert!(amax(&left) < 1e-11 * size, "{:e}", amax(&left));
        let mut known = vec![0.0; rates.len()];
        motion.stand.form.rates(TIME, &motion.state, &mut known).unwrap();
        assert!(difference(&rates, &known) < 1e-12, "{:e}", difference(&rates, &known));
    }
}

#[test]
fn the_matrix_is_what_differences_say() {
    let mut random = Random(311);
    for text in [scenes::tangle(), scenes::four_bar(1.1)] {
        let mut motion = Motion::new(&text, &mut random);
        // Shares of large steps, so that no part of the matrix is small.
        for (mass_share, damping_share) in [(3.0, 1.5), (400.0, 20.0)] {
            motion.here();
            motion.form.factor(mass_share, damping_share, motion.stand.form.sets()).unwrap();
            for _ in 0..5 {
                let wanted: Vec<f64> =
                    (0..motion.accelerations.len() + motion.multipliers.len()).map(|_| random.next()).collect();
                let left: Vec<f64> =
                    motion.difference_along(&wanted, mass_share, damping_share).iter().map(|x| -x).collect();
                let found = motion.solve(&left);
                assert!(difference(&found, &wanted) < 1e-6, "{:e}", difference(&found, &wanted));
            }
        }
    }
}

#[test]
fn without_derivatives_small_steps_have_nearly_the_same_matrix() {
    // The opaque scene is the same one; only its derivatives are not known.
    let mut exact = Motion::new(&scenes::tangle(), &mut Random(313));
    let mut rough = Motion::new(&scenes::opaque_tangle(), &mut Random(313));
    let left: Vec<f64> = exact.here().0.iter().map(|_| 1.0).collect();
    rough.here();
    let mut apart = |mass_share: f64| {
        let damping_share = mass_share.sqrt();
        exact.form.factor(mass_share, damping_share, exact.stand.form.sets()).unwrap();
        rough.form.factor(mass_share, damping_share, rough.stand.form.sets()).unwrap();
        difference(&rough.solve(&left), &exact.solve(&left))
    };
    let (large, small) = (apart(1e6), apart(1e10));
    assert!(large > 1e-6 && small < 2e-2 * large, "{large:e} {small:e}: in proportion to the step");
}

#[test]
fn bodies_turn_by_the_exponential() {
    let start = [1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let turned = |angle: f64| {
        let mut state = [f64::NAN; 13];
        place(&start, &[0.5, 0.0, -1.0, 0.0, 0.0, angle], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &mut state);
        state
    };
    let state = turned(std::f64::consts::PI / 3.0);
    let (sin, cos) = (std::f64::consts::PI / 6.0).sin_cos();
    let wanted = [1.5, 2.0, 2.0, cos, 0.0, 0.0, sin, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    assert!(difference(&state, &wanted) < 1e-15, "{state:?}");
    assert_eq!(turned(0.0)[3..7], [1.0, 0.0, 0.0, 0.0]);
}
