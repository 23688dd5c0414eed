//! What a recording may refer to: a plugin is a stranger.

mod kinetic;

use super::*;

/// Degree of what is no linear function of velocities.
const NOT_LINEAR: u32 = 2;

impl Recording {
    /// Checks that nothing refers to anything that is not there, so that a host can evaluate the recording without
    /// looking again. A plugin is a stranger: the host calls this before it uses a recording.
    ///
    /// # Errors
    /// The first defect, in words.
    pub fn check(&self, limits: &Limits) -> Result<(), String> {
        if self.ops.len() > MOST_OPS {
            return Err(format!("{} operations; at most {MOST_OPS} are accepted", self.ops.len()));
        }
        if let Some(k) = self.constants.iter().position(|c| !c.is_finite()) {
            return Err(format!(
                "constant {k} is {}: a parameter is out of range for this element, or a result is not given",
                self.constants[k]
            ));
        }
        if let Some(x) = self.initial_states.iter().chain(&self.initial_discrete).find(|x| !x.is_finite()) {
            return Err(format!("a state is {x} at the start"));
        }
        if let Some(k) = self.tables.iter().position(|table| !table.is_sound()) {
            return Err(format!("table {k} is inconsistent"));
        }
        for (k, raw) in self.ops.iter().enumerate() {
            let op = Op::decode(*raw).ok_or_else(|| format!("operation {k} has the unknown code {}", raw.code))?;
            self.check_op(k, op, limits)?;
        }
        let unknowns = self.unknowns();
        for output in &self.outputs {
            if output.node as usize >= self.ops.len() {
                return Err(format!("{:?} refers to operation {}, which does not exist", output.role, output.node));
            }
            let (index, count) = match output.role {
                Role::Residual(k)
                | Role::VelocityResidual(k)
                | Role::Unilateral(k)
                | Role::SticksWith(k)
                | Role::Limit(k)
                | Role::SlidesWith(k) => (k, limits.rows),
                Role::Force(k) | Role::Torque(k) => (k, 3 * limits.frames),
                Role::Angle(k) => (k, limits.angles),
                Role::Coordinate(k) => (k, limits.coordinates),
                Role::StateRate(k) => (k, self.initial_states.len()),
                Role::NextDiscrete(k) => (k, self.initial_discrete.len()),
                Role::Channel(k) => (k, limits.channels),
                Role::Check(k) => (k, limits.checks),
                Role::PosePosition(k) => (k, 3),
                Role::PoseRotation(k) => (k, 9),
                Role::Signal(_) => return Err("signals are reserved for a later version".into()),
                Role::Condition(k) | Role::Guess(k) => (k, unknowns),
                Role::FlexibleForce(k) => (k, self.initial_states.len() / 2),
                Role::Potential | Role::Dissipation | Role::Kinetic | Role::SamplePeriod => (0, 1),
            };
            if index as usize >= count {
                return Err(format!("{:?} is outside what the element declares ({count})", output.role));
            }
            if !output.role.is_of(limits.kind) {
                return Err(format!("{:?} is no result of a {} element", output.role, limits.kind.word()));
            }
        }
        let mut roles: Vec<Role> = self.outputs.iter().map(|o| o.role).collect();
        roles.sort_unstable();
        if let Some(pair) = roles.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("{:?} is given twice", pair[0]));
        }
        let given = |role: Role| roles.binary_search(&role).is_ok();
        if let Some(k) =
            (0..limits.rows as u32).find(|k| given(Role::Residual(*k)) && given(Role::VelocityResidual(*k)))
        {
            return Err(format!("row {k} is given both as a row on positions and as one on velocities"));
        }
        self.check_unknowns(limits, &given)?;
        self.check_degrees(limits.kind)?;
        self.check_states_of_rows(limits, &given)?;
        self.check_unilateral(limits, &given)?;
        self.check_limits(limits, &given)?;
        if given(Role::SamplePeriod) && !self.sample_period().is_some_and(|period| period > 0.0) {
            return Err("the sampling period is not a positive constant".into());
        }
        self.check_kinetic(&given)?;
        let flexible = 2 * self.flexible() as u32;
        if let Some(k) = (flexible..self.initial_states.len() as u32).find(|k| !given(Role::StateRate(*k))) {
            return Err(format!("state {k} has no rate"));
        }
        if let Some(k) = (0..self.initial_discrete.len() as u32).find(|k| !given(Role::NextDiscrete(*k))) {
            return Err(format!("discrete state {k} is not given for after a step"));
        }
        Ok(())
    }

    /// Internal unknowns, and the conditions that they are found from.
    fn check_unknowns(&self, limits: &Limits, given: &impl Fn(Role) -> bool) -> Result<(), String> {
        let count = self.unknowns();
        if count > MOST_UNKNOWNS {
            return Err(format!("{count} internal unknowns; at most {MOST_UNKNOWNS} are accepted of one element"));
        }
        if count > 0 && limits.mobility > 0 {
            return Err("a joint with internal unknowns has no coordinates of its own that make up for its rows".into());
        }
        if let Some(k) = (0..count as u32).find(|k| !given(Role::Condition(*k))) {
            return Err(format!("condition {k} on the internal unknowns is not given: there are as many as unknowns"));
        }
        if let Some(k) = self.guesses().iter().position(|guess| !guess.is_finite()) {
            return Err(format!("the starting guess of unknown {k} is not a constant"));
        }
        if count == 0 {
            return Ok(());
        }
        // What depends on a reaction, or on a coordinate that only a mobility has.
        let mut solved: Vec<bool> = Vec::with_capacity(self.ops.len());
        for op in self.ops.iter().filter_map(|raw| Op::decode(*raw)) {
            let of_solution = |input| {
                matches!(input, Input::ReactionForce { .. } | Input::ReactionTorque { .. } | Input::Coordinate(_))
            };
            let is_solved = match op {
                Op::Input(input) => of_solution(input),
                op => op.operands().any(|a| solved[a as usize]),
            };
            solved.push(is_solved);
        }
        match self.outputs.iter().find(|o| matches!(o.role, Role::Condition(_)) && solved[o.node as usize]) {
            Some(output) => {
                Err(format!("{:?} depends on a reaction, which is found only after the unknowns", output.role))
            }
            None => Ok(()),
        }
    }

    /// Unilateral rows, and rows that stick with them.
    fn check_unilateral(&self, limits: &Limits, given: &impl Fn(Role) -> bool) -> Result<(), String> {
        let is_row = |k: u32| given(Role::Residual(k)) || given(Role::VelocityResidual(k));
        let found = |role| self.outputs.iter().any(|output| output.role == role);
        for k in 0..limits.rows as u32 {
            let (unilateral, sticking) = (found(Role::Unilateral(k)), found(Role::SticksWith(k)));
            if (unilateral || sticking) && !is_row(k) {
                return Err(format!("row {k} is unilateral, or sticks with another, but is not given"));
            }
            if (unilateral || sticking) && limits.mobility > 0 {
                return Err(
                    "a joint with unilateral rows has no coordinates of its own that make up for its rows".into()
                );
            }
            if unilateral && !self.restitution(k).is_some_and(|e| (0.0..=1.0).contains(&e)) {
                return Err(format!("the coefficient of restitution of row {k} is not a constant from 0 to 1"));
            }
            if sticking && (unilateral || !self.sticks_with(k).is_some_and(|with| found(Role::Unilateral(with)))) {
                return Err(format!("row {k} does not stick with a unilateral row"));
            }
        }
        Ok(())
    }

    /// Numbers that the host keeps between steps for the rows with a limit: into which direction each slides; of pairs also the
    /// speed below which a direction is none.
    #[must_use]
    pub fn sliding_numbers(&self) -> usize {
        let count = |role: &dyn Fn(Role) -> bool| self.outputs.iter().filter(|output| role(output.role)).count();
        count(&|role| matches!(role, Role::Limit(_))) + 2 * count(&|role| matches!(role, Role::SlidesWith(_)))
    }

    /// Rows that hold up to a limit.
    fn check_limits(&self, limits: &Limits, given: &impl Fn(Role) -> bool) -> Result<(), String> {
        for k in 0..limits.rows as u32 {
            let (limited, paired) = (given(Role::Limit(k)), given(Role::SlidesWith(k)));
            if limited && (!given(Role::VelocityResidual(k)) || given(Role::Unilateral(k))) {
                return Err(format!("row {k} has a limit, but is not a row on velocities that holds both ways"));
            }
            if limited && limits.mobility > 0 {
                return Err("a joint with rows that hold up to a limit has no coordinates of its own".into());
            }
            let with = self.slides_with(k);
            let same = |with: u32| {
                with != k
                    && given(Role::VelocityResidual(with))
                    && !given(Role::Limit(with))
                    && !given(Role::SlidesWith(with))
                    && !given(Role::Unilateral(with))
                    && self.sticks_with(with) == self.sticks_with(k)
            };
            if paired && !(limited && with.is_some_and(same)) {
                return Err(format!(
                    "row {k} slides with another, but has no limit, or the other one is not a row on velocities without a \
                     limit that sticks with the same row"
                ));
            }
            let second = |other: u32| with.is_some() && other != k && self.slides_with(other) == with;
            if (0..limits.rows as u32).any(second) {
                return Err(format!("row {k} slides with a row that slides with another one"));
            }
        }
        Ok(())
    }

    /// Rows may depend on states, not on signals; those that do always hold, and give away no mobility.
    fn check_states_of_rows(&self, limits: &Limits, given: &impl Fn(Role) -> bool) -> Result<(), String> {
        if self.initial_states.is_empty() && self.initial_discrete.is_empty() && limits.inputs == 0 {
            // There is nothing to depend on.
            return Ok(());
        }
        let of_states = self.depending_on(|input| matches!(input, Input::State(_)));
        let of_signals = self.depending_on(|input| matches!(input, Input::Signal(_) | Input::Discrete(_)));
        let of_memory = self.depending_on(|input| matches!(input, Input::Discrete(_)));
        for output in &self.outputs {
            let (states, signals) = (of_states[output.node as usize], of_signals[output.node as usize]);
            match output.role {
                Role::Residual(k) | Role::VelocityResidual(k) if signals => {
                    return Err(format!(
                        "row {k} depends on a signal or on memory: pass it through a state of the joint"
                    ));
                }
                Role::Coordinate(k) if signals || states => {
                    return Err(format!("coordinate {k} depends on a state or a signal: take it from positions"));
                }
                Role::Limit(k) if of_memory[output.node as usize] => {
                    return Err(format!(
                        "the limit of row {k} depends on memory: give that as a channel, and take it as a signal"
                    ));
                }
                Role::Condition(k) if limits.kind == Kind::Joint && (signals || states) => {
                    return Err(format!(
                        "condition {k} on the unknowns of a joint depends on a state, a signal or memory"
                    ));
                }
                Role::VelocityResidual(k) if states => {
                    return Err(format!("velocity row {k} depends on a state: rows on positions may"));
                }
                Role::Residual(k) if states && limits.mobility > 0 => {
                    return Err(format!("row {k} depends on a state: such a joint offers no mobility"));
                }
                Role::Residual(k) if states && given(Role::Unilateral(k)) => {
                    return Err(format!("row {k} depends on a state: such a row is not unilateral"));
                }
                Role::Residual(k) if states && given(Role::SticksWith(k)) => {
                    return Err(format!("row {k} depends on a state: such a row sticks with no other"));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// For each operation, whether it depends on such an input.
    fn depending_on(&self, wanted: impl Fn(Input) -> bool) -> Vec<bool> {
        let mut depends: Vec<bool> = Vec::with_capacity(self.ops.len());
        for raw in &self.ops {
            depends.push(match Op::decode(*raw) {
                Some(Op::Input(input)) => wanted(input),
                Some(op) => op.operands().any(|a| depends[a as usize]),
                None => false,
            });
        }
        depends
    }

    /// Rows on positions, and conditions on unknowns that rows may use, must not depend on velocities; rows on velocities must be
    /// linear in them.
    fn check_degrees(&self, kind: Kind) -> Result<(), String> {
        let rows = || {
            let looked_at = |role| match role {
                Role::Residual(_) | Role::VelocityResidual(_) => true,
                Role::Condition(_) => kind == Kind::Joint,
                _ => false,
            };
            self.outputs.iter().filter(move |o| looked_at(o.role))
        };
        if rows().next().is_none() {
            return Ok(());
        }
        let mut degrees: Vec<u32> = Vec::with_capacity(self.ops.len());
        for raw in &self.ops {
            let Some(op) = Op::decode(*raw) else { return Ok(()) };
            let of = |k: u32| degrees[k as usize];
            degrees.push(
                match op {
                    Op::Input(Input::Velocity { .. } | Input::AngularVelocity { .. }) => 1,
                    Op::Mul(a, b) => of(a) + of(b),
                    Op::Div(a, b) if of(b) == 0 => of(a),
                    Op::Add(..) | Op::Sub(..) | Op::Neg(_) => op.operands().map(of).max().unwrap_or(0),
                    // With constant conditions a choice is one of two linear functions.
                    Op::Select(a, b, x, y) if of(a) + of(b) == 0 => of(x).max(of(y)),
                    _ if op.operands().all(|a| of(a) == 0) => 0,
                    _ => NOT_LINEAR,
                }
                .min(NOT_LINEAR),
            );
        }
        for output in rows() {
            match (output.role, degrees[output.node as usize]) {
                (Role::Residual(k), 1..) => {
                    return Err(format!("row {k} depends on velocities: give it as a velocity row"));
                }
                (Role::Condition(k), 1..) => {
                    return Err(format!("condition {k} on the unknowns of a joint depends on velocities"));
                }
                (Role::VelocityResidual(k), NOT_LINEAR..) => {
                    return Err(format!("velocity row {k} is not linear in velocities"));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn check_op(&self, k: usize, op: Op, limits: &Limits) -> Result<(), String> {
        if let Some(later) = op.operands().find(|a| *a as usize >= k) {
            return Err(format!("operation {k} uses operation {later}, which does not come before it"));
        }
        let inside = |index: u32, count: usize, what: &str| {
            if (index as usize) < count { Ok(()) } else { Err(format!("operation {k} uses {what} {index} of {count}")) }
        };
        match op {
            Op::Constant(c) | Op::Powf(_, c) => inside(c, self.constants.len(), "constant"),
            Op::Table(table, _) => inside(table, self.tables.len(), "table"),
            Op::Input(input) => match input {
                Input::AngleReference(i) => inside(i, limits.angles, "angle"),
                Input::Unknown(i) => inside(i, self.unknowns(), "internal unknown"),
                Input::State(i) => inside(i, self.initial_states.len(), "state"),
                Input::Discrete(i) => inside(i, self.initial_discrete.len(), "discrete state"),
                Input::Coordinate(i) => inside(i, limits.mobility, "joint coordinate"),
                Input::Signal(i) => inside(i, limits.inputs, "signal"),
                Input::ReactionForce { joint, .. } | Input::ReactionTorque { joint, .. } => {
                    inside(joint, limits.joints, "joint")
                }
                Input::Time => Ok(()),
                other => inside(other.frame().unwrap_or(u32::MAX), limits.frames, "frame"),
            },
            _ => Ok(()),
        }
    }
}
