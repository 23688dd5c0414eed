//! Kinetic energies and flexible coordinates.

use super::*;

/// How an operation grows with the velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Degree {
    /// Zero whatever they are: of every degree.
    Nothing,
    /// With all velocities k times as large, the value is k^n times as large.
    Of(u32),
    /// None of these.
    Other,
}

impl Degree {
    fn sum(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, degree) | (degree, Self::Nothing) => degree,
            (a, b) if a == b => a,
            _ => Self::Other,
        }
    }

    fn product(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, _) | (_, Self::Nothing) => Self::Nothing,
            (Self::Of(a), Self::Of(b)) => Self::Of(a + b),
            _ => Self::Other,
        }
    }

    fn is_of_positions(self) -> bool {
        matches!(self, Self::Nothing | Self::Of(0))
    }
}

impl Recording {
    /// A kinetic energy is a quadratic form of velocities, which depends on positions: of frames, and of flexible coordinates.
    pub(super) fn check_kinetic(&self, given: &impl Fn(Role) -> bool) -> Result<(), String> {
        let flexible = self.flexible() as u32;
        if let Some(k) = (0..flexible).find(|k| !given(Role::FlexibleForce(*k))) {
            return Err(format!("the force on flexible coordinate {k} is not given"));
        }
        if let Some(k) = (flexible..2 * flexible).find(|k| given(Role::StateRate(*k))) {
            return Err(format!(
                "the rate of state {k} is given, which is that of a flexible velocity: the host finds it"
            ));
        }
        let velocity = |k: u32| {
            let op = self.output(Role::StateRate(k)).and_then(|node| Op::decode(self.ops[node as usize]));
            op == Some(Op::Input(Input::State(flexible + k)))
        };
        if let Some(k) = (0..flexible).find(|k| !velocity(*k)) {
            return Err(format!("the rate of state {k} is not state {}, its velocity", flexible + k));
        }
        let Some(kinetic) = self.output(Role::Kinetic) else {
            return match flexible {
                0 => Ok(()),
                _ => Err("flexible coordinates without a kinetic energy have no acceleration".into()),
            };
        };
        let foreign = self.depending_on(|input| match input {
            Input::Position { .. }
            | Input::Rotation { .. }
            | Input::Velocity { .. }
            | Input::AngularVelocity { .. } => false,
            Input::State(k) => k >= 2 * flexible,
            _ => true,
        });
        if foreign[kinetic as usize] {
            return Err(
                "the kinetic energy depends on more than frames and flexible coordinates and how they move".into()
            );
        }
        match self.degrees_in_velocities(flexible)[kinetic as usize] {
            Degree::Nothing | Degree::Of(2) => Ok(()),
            _ => Err("the kinetic energy is not a sum of products of two velocities each".into()),
        }
    }

    fn degrees_in_velocities(&self, flexible: u32) -> Vec<Degree> {
        let mut degrees: Vec<Degree> = Vec::with_capacity(self.ops.len());
        for op in self.ops.iter().map(|raw| Op::decode(*raw)) {
            let of = |k: u32| degrees[k as usize];
            degrees.push(match op {
                Some(Op::Constant(k)) if self.constants[k as usize] == 0.0 => Degree::Nothing,
                Some(Op::Input(Input::Velocity { .. } | Input::AngularVelocity { .. })) => Degree::Of(1),
                Some(Op::Input(Input::State(k))) if (flexible..2 * flexible).contains(&k) => Degree::Of(1),
                Some(Op::Add(a, b) | Op::Sub(a, b)) => of(a).sum(of(b)),
                Some(Op::Mul(a, b)) => of(a).product(of(b)),
                Some(Op::Div(a, b)) if of(b).is_of_positions() => of(a),
                Some(Op::Neg(a)) => of(a),
                Some(Op::Powi(a, 1)) => of(a),
                Some(Op::Powi(a, 2)) => of(a).product(of(a)),
                Some(Op::Select(a, b, x, y)) if of(a).is_of_positions() && of(b).is_of_positions() => of(x).sum(of(y)),
                Some(op) if op.operands().all(|a| of(a).is_of_positions()) => Degree::Of(0),
                _ => Degree::Other,
            });
        }
        degrees
    }
}
