//! [`Method`]: explicit Runge-Kutta methods with steps of a fixed size.

/// A method by its coefficients (Hairer, Norsett & Wanner, "Solving Ordinary Differential Equations I", 1993, section II.1).
#[derive(Debug, PartialEq)]
pub struct Method {
    /// Its name.
    pub name: &'static str,
    /// The error of a run goes with this power of the step.
    pub order: u32,
    /// Fractions of a step, one per stage.
    pub c: &'static [f64],
    /// Weights of the stages before, stage by stage.
    pub a: &'static [&'static [f64]],
    /// Weights of all stages in the step.
    pub b: &'static [f64],
}

/// All methods that can be exported.
pub const METHODS: &[Method] = &[
    // Kutta's method of 1901.
    Method {
        name: "rk4",
        order: 4,
        c: &[0.0, 0.5, 0.5, 1.0],
        a: &[&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
        b: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
    },
    // Dormand & Prince, "A family of embedded Runge-Kutta formulae", 1980; its solution of order 5, without the estimate of errors.
    Method {
        name: "dopri5",
        order: 5,
        c: &[0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0],
        a: &[
            &[],
            &[1.0 / 5.0],
            &[3.0 / 40.0, 9.0 / 40.0],
            &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
            &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
            &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
        ],
        b: &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    },
];

impl Method {
    /// The method of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        METHODS.iter().find(|method| method.name == name)
    }
}
