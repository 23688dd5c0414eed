//! What a recording says: its results for given inputs, and its constants.

use super::*;

impl Recording {
    /// Carries out the operations one by one, in the plainest way, and gives the results with their meaning. With a
    /// [`Jet`](crate::Jet) as scalar it differentiates the equations. Runs make programs instead.
    ///
    /// # Panics
    /// When the recording refers to something that is not there; [`Recording::check`] finds that beforehand.
    #[must_use]
    pub fn evaluate<S: Scalar>(&self, read: impl Fn(Input) -> S) -> Vec<(Role, S)> {
        let mut values: Vec<S> = Vec::with_capacity(self.ops.len());
        for raw in &self.ops {
            let op = Op::decode(*raw).expect("known operation");
            let v = |k: u32| values[k as usize];
            let constant = |k: u32| self.constants[k as usize];
            let value = match op {
                Op::Constant(k) => S::from(constant(k)),
                Op::Input(input) => read(input),
                Op::Add(a, b) => v(a) + v(b),
                Op::Sub(a, b) => v(a) - v(b),
                Op::Mul(a, b) => v(a) * v(b),
                Op::Div(a, b) => v(a) / v(b),
                Op::Neg(a) => -v(a),
                Op::Sqrt(a) => v(a).sqrt(),
                Op::Sin(a) => v(a).sin(),
                Op::Cos(a) => v(a).cos(),
                Op::Atan2(a, b) => v(a).atan2(v(b)),
                Op::Exp(a) => v(a).exp(),
                Op::Ln(a) => v(a).ln(),
                Op::Tanh(a) => v(a).tanh(),
                Op::Powi(a, n) => v(a).powi(n),
                Op::Powf(a, k) => v(a).powf(constant(k)),
                Op::Select(a, b, x, y) => S::select(v(a), v(b), v(x), v(y)),
                Op::Table(table, a) => v(a).lookup(&self.tables[table as usize]),
            };
            values.push(value);
        }
        self.outputs.iter().map(|output| (output.role, values[output.node as usize])).collect()
    }

    /// The period of an element that samples, s.
    #[must_use]
    pub fn sample_period(&self) -> Option<f64> {
        self.constant(Role::SamplePeriod)
    }

    /// The coefficient of restitution of a unilateral row.
    #[must_use]
    pub fn restitution(&self, row: u32) -> Option<f64> {
        self.constant(Role::Unilateral(row))
    }

    /// The unilateral row that a row holds with.
    #[must_use]
    pub fn sticks_with(&self, row: u32) -> Option<u32> {
        self.constant(Role::SticksWith(row)).map(|other| other as u32)
    }

    /// Starting guesses of the internal unknowns, as many as there are.
    #[must_use]
    pub fn guesses(&self) -> Vec<f64> {
        (0..self.unknowns() as u32).map(|k| self.constant(Role::Guess(k)).unwrap_or(f64::NAN)).collect()
    }

    /// The number of internal unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.outputs.iter().filter(|output| matches!(output.role, Role::Guess(_))).count()
    }

    /// The number of flexible coordinates. The states begin with these and their rates.
    #[must_use]
    pub fn flexible(&self) -> usize {
        self.outputs.iter().filter(|output| matches!(output.role, Role::FlexibleForce(_))).count()
    }

    /// The other row of a pair that has one limit.
    #[must_use]
    pub fn slides_with(&self, row: u32) -> Option<u32> {
        self.constant(Role::SlidesWith(row)).map(|other| other as u32)
    }

    /// An output that is a constant.
    fn constant(&self, role: Role) -> Option<f64> {
        let op = self.ops.get(self.output(role)? as usize)?;
        let Some(Op::Constant(k)) = Op::decode(*op) else { return None };
        self.constants.get(k as usize).copied()
    }

    /// The operation behind an output, if the element gives it.
    #[must_use]
    pub fn output(&self, role: Role) -> Option<u32> {
        self.outputs.iter().find(|o| o.role == role).map(|o| o.node)
    }
}
