//! [`Method`]: explicit Runge-Kutta methods and a Rosenbrock method, with steps of a fixed size.

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
    /// Weights of the stages and of the slope at the end in the difference from the embedded solution; empty where there is none.
    pub error: &'static [f64],
    /// What makes it a method for stiff scenes.
    pub implicit: Option<&'static Implicit>,
}

/// A Rosenbrock method in the form that needs no product with the Jacobian (Hairer & Wanner, "Solving Ordinary Differential Equations
/// II", 1996, eq. IV.7.25): stage s solves `(1 / (h gamma) - J) u_s = f(t + c_s h, y + sum a_sj u_j) + sum c_sj / h u_j + d_s h f_t`,
/// and the step ends at `y + sum b_s u_s`.
#[derive(Debug, PartialEq)]
pub struct Implicit {
    /// Diagonal of its coefficients.
    pub gamma: f64,
    /// What the stages before add to the right side, stage by stage, over the size of the step.
    pub coupling: &'static [&'static [f64]],
    /// Weights of the derivative with respect to time, times the size of the step.
    pub times: &'static [f64],
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
        error: &[],
        implicit: None,
    },
    // Dormand & Prince, "A family of embedded Runge-Kutta formulae", 1980; its solution of order 5. The weights of
    // the errors are those of Hairer, Norsett & Wanner 1993, table II.5.2.
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
        error: &[71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0],
        implicit: None,
    },
    // RODAS of Hairer & Wanner 1996, section IV.10: stiffly accurate, L-stable.
    Method {
        name: "rodas",
        order: 4,
        c: &[0.0, 0.386, 0.21, 0.63, 1.0, 1.0],
        a: &[
            &[],
            &[1.544],
            &[0.9466785280815826, 0.2557011698983284],
            &[3.314825187068521, 2.896124015972201, 0.9986419139977817],
            &[1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895],
            &[1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0],
        ],
        b: &[1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0, 1.0],
        error: &[],
        implicit: Some(&Implicit {
            gamma: 0.25,
            coupling: &[
                &[],
                &[-5.6688],
                &[-2.430093356833875, -0.2063599157091915],
                &[-0.1073529058151375, -9.594562251023355, -20.47028614809616],
                &[7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616],
                &[8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
            ],
            times: &[0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0],
        }),
    },
];

impl Method {
    /// The method of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        METHODS.iter().find(|method| method.name == name)
    }
}
