//! [`Stencil`]: first derivatives of orders 2, 4 and 6 from values at equidistant places (Fornberg 1988, tables 1 and 3).

/// On which sides of a value others are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stencil {
    /// -3 to 3 steps, without 0.
    Central,
    /// 0 to 6 steps.
    Forward,
    /// 0 to -6 steps.
    Backward,
}

/// Weights on the places 0 to 6.
const ONE_SIDED: [[f64; 7]; 3] = [
    [-1.5, 2.0, -0.5, 0.0, 0.0, 0.0, 0.0],
    [-25.0 / 12.0, 4.0, -3.0, 4.0 / 3.0, -0.25, 0.0, 0.0],
    [-2.45, 6.0, -7.5, 20.0 / 3.0, -3.75, 1.2, -1.0 / 6.0],
];
/// Weights on the differences of the values at 1, 2 and 3 steps on both sides.
const CENTRAL: [[f64; 3]; 3] = [[0.5, 0.0, 0.0], [2.0 / 3.0, -1.0 / 12.0, 0.0], [0.75, -0.15, 1.0 / 60.0]];
/// Weights on the means of the values at 1, 2 and 3 steps on both sides, over the value between them: for |x|, and without even powers.
const BENT: [[f64; 3]; 2] = [[2.0, -0.5, 0.0], [2.5, -1.0, 1.0 / 6.0]];

impl Stencil {
    /// The places, in steps; those of the derivative of order 2 come first.
    pub(crate) fn places(self) -> &'static [f64] {
        match self {
            Self::Central => &[-1.0, 1.0, -2.0, 2.0, -3.0, 3.0],
            Self::Forward => &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            Self::Backward => &[0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0],
        }
    }

    /// How many of them the derivative of order 2 takes.
    pub(crate) fn fewest(self) -> usize {
        if self == Self::Central { 2 } else { 3 }
    }

    /// The derivative of order 2, 4 or 6 (`order` 0, 1, 2) of entry `k`, from the values at the places, for a step.
    pub(crate) fn derivative(self, order: usize, values: &[&[f64]], k: usize, step: f64) -> f64 {
        if self == Self::Central {
            let pairs = values.chunks(2).zip(CENTRAL[order]).filter(|(_, weight)| *weight != 0.0);
            return pairs.map(|(pair, weight)| weight * (pair[1][k] - pair[0][k])).sum::<f64>() / step;
        }
        let sign = if self == Self::Forward { 1.0 } else { -1.0 };
        let weighted = values.iter().zip(ONE_SIDED[order]).filter(|(_, weight)| *weight != 0.0);
        // Differences from the first: what all have in common cancels first.
        sign * weighted.map(|(value, weight)| weight * (value[k] - values[0][k])).sum::<f64>() / step
    }

    /// Half of what the slopes on the two sides of a value differ by, to order 3 or 5 (`order` 0, 1): none where entry `k` is smooth. Central
    /// derivatives do not see it at the value itself. `there`: what it is at the value; nothing is known of one side alone.
    pub(crate) fn bend(self, order: usize, there: &[f64], values: &[&[f64]], k: usize, step: f64) -> f64 {
        if self != Self::Central {
            return 0.0;
        }
        let means = values.chunks(2).zip(BENT[order]);
        means.map(|(pair, weight)| 0.5 * weight * ((pair[0][k] - there[k]) + (pair[1][k] - there[k]))).sum::<f64>()
            / step
    }

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Central => "central",
            Self::Forward => "forward",
            Self::Backward => "backward",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_order_is_exact_for_polynomials_of_its_degree_and_no_further() {
        for stencil in [Stencil::Central, Stencil::Forward, Stencil::Backward] {
            for (k, order) in [2_i32, 4, 6].into_iter().enumerate() {
                let error = |degree: i32| {
                    let at = |place: &f64| vec![(1.0 + 0.5 * place).powi(degree)];
                    let values: Vec<Vec<f64>> = stencil.places().iter().map(at).collect();
                    let values: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
                    (stencil.derivative(k, &values, 0, 0.5) / f64::from(degree) - 1.0).abs()
                };
                assert!((1..=order).all(|degree| error(degree) < 1e-13), "{stencil:?} {order}");
                assert!(error(order + 1) > 1e-6, "{stencil:?} {order}: {}", error(order + 1));
            }
        }
    }

    #[test]
    fn slopes_that_differ_at_the_value_itself_are_seen_and_powers_are_none() {
        let places = Stencil::Central.places();
        let bend = |order: usize, of: &dyn Fn(f64) -> f64| {
            let values: Vec<Vec<f64>> = places.iter().map(|place| vec![of(0.5 * place)]).collect();
            let values: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
            Stencil::Central.bend(order, &[of(0.0)], &values, 0, 0.5)
        };
        for (order, degree) in [3, 5].into_iter().enumerate() {
            assert!((bend(order, &|x| (-x).max(3.0 * x)) - 2.0).abs() < 1e-14);
            assert!((1..=degree).all(|power| bend(order, &|x| (1.0 + x).powi(power)).abs() < 1e-13), "{degree}");
            assert!(bend(order, &|x| (1.0 + x).powi(degree + 1)).abs() > 1e-2, "{degree}");
        }
    }

    #[test]
    fn those_of_order_two_come_first() {
        for stencil in [Stencil::Central, Stencil::Forward, Stencil::Backward] {
            let values: Vec<Vec<f64>> = stencil.places().iter().map(|place| vec![place.sin()]).collect();
            let values: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
            let few = stencil.derivative(0, &values[..stencil.fewest()], 0, 1.0);
            assert_eq!(few, stencil.derivative(0, &values, 0, 1.0));
        }
    }
}
