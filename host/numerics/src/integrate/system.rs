//! [`System`]: what is integrated, and what it states about itself.

use std::error::Error;

use crate::interval::Range;

/// Takes the entries of a matrix one by one: row, column, value.
pub type Entries<'a> = &'a mut dyn FnMut(usize, usize, f64);

/// What is integrated, with the hooks that watch it. Only `dim`, `rhs` and `error_norm` are
/// required. The order of calls is in the room's documentation.
pub trait System {
    /// Length of the state vector; constant.
    fn dim(&self) -> usize;

    /// `dy := f(t, y)`, every entry. A function of `t`, `y` and the discrete memory, also for
    /// times of steps that are rejected later. `[hot]`
    ///
    /// # Errors
    /// See [`Failure`].
    fn rhs(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Result<(), Failure>;

    /// A step of size `h` from the accepted state `y` at `t` is about to be tried: the errors asked about from here on are made in
    /// it. `[hot]`
    fn begin_step(&mut self, _t: f64, _y: &[f64], _h: f64) {}

    /// Size of `error`, a small difference of states, such that 1 is the tolerance. `y0` and
    /// `y1` are the states at the ends of the step, for relative tolerances. It has to be a
    /// norm (homogeneous in `error`); the first step size relies on it too. `[hot]`
    fn error_norm(&mut self, y0: &[f64], y1: &[f64], error: &[f64]) -> f64;

    /// Size of a small difference of states at `y`, on any scale of its own, without regard to the step under way: ratios
    /// of two of them tell how fast derivatives change.
    fn size(&mut self, y: &[f64], difference: &[f64]) -> f64 {
        self.error_norm(y, y, difference)
    }

    /// The relative error that 1 in [`System::error_norm`] stands for, if it is known. Methods whose error estimate is of
    /// a much lower order than their result (Radau IIA) need it to aim at the tolerance.
    fn tolerance(&self) -> Option<f64> {
        None
    }

    /// What work costs, roughly, for methods that choose the cheaper of two.
    fn price(&self) -> Price {
        Price { evaluation: 100.0 * self.dim() as f64, jacobian: None, preparation: 0.0 }
    }

    /// The exact derivatives of `rhs` with respect to `y`: calls `found(i, j, value)` for every entry that is not zero, each
    /// once, those of a column one after the other, columns in any order. `false` if there are none; implicit methods then take
    /// differences of `rhs`. Need not be the derivative of what projections inside `rhs` do.
    ///
    /// # Errors
    /// See [`Failure`].
    fn jacobian(&mut self, _t: f64, _y: &[f64], _found: Entries<'_>) -> Result<bool, Failure> {
        Ok(false)
    }

    /// Size of the errors of the sums ([`System::sums_from`]) among those of a step, such that 1 is as much as may be. They are
    /// allowed far more than the tolerance; where all else is found exactly (by polynomials in time, by drivers), they alone limit
    /// the step. `[hot]`
    fn sums_norm(&mut self, _y0: &[f64], _y1: &[f64], _error: &[f64]) -> f64 {
        0.0
    }

    /// Entries of the state from here on are sums that nothing depends on (work done), and that [`System::error_norm`] does not
    /// look at.
    fn sums_from(&self) -> usize {
        self.dim()
    }

    /// Whether a quantity is summed up along the steps that becomes no part of the state: nothing depends on it, and no error control
    /// looks at it. Its rate is then asked for where the method itself evaluates the equations, so that it is known as well as they are,
    /// and nothing of one step is taken for another.
    fn sums_up(&self) -> bool {
        false
    }

    /// The rate of that quantity at a state within a step that is about to become final.
    ///
    /// # Errors
    /// See [`Failure`]; both kinds end the run, a recoverable one with an [`super::Outcome`].
    fn rate_summed(&mut self, _t: f64, _y: &[f64]) -> Result<f64, Failure> {
        Ok(0.0)
    }

    /// Takes the integral of that rate over the step, before [`System::accept`], and by how much it differs from that of a rule of lower
    /// order at the same nodes.
    fn sum_up(&mut self, _integral: f64, _difference: f64) {}

    /// Brings a new state back to its manifold. `[hot]`
    ///
    /// # Errors
    /// See [`Failure`]; recoverable if the state is too far away.
    fn project(&mut self, _t: f64, _y: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// Brings a state to the far side of a place where functions of time are not smooth, beyond which no step has led: it is off by what
    /// they do there, not by a guess.
    ///
    /// # Errors
    /// See [`Failure`].
    fn project_across(&mut self, t: f64, y: &mut [f64]) -> Result<(), Failure> {
        self.project(t, y)
    }

    /// Brings a state inside a step, which is off the manifold by the error of an interpolation, back to it. Nothing is remembered
    /// of it.
    ///
    /// # Errors
    /// See [`Failure`].
    fn bring_back(&mut self, _t: f64, _y: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// Number of conditions at which `f` may switch from one expression to another (contact, friction, limits). Methods with
    /// error control end steps there.
    fn conditions(&self) -> usize {
        0
    }

    /// A number for each condition that changes its sign where `f` switches; negative on one side, not negative on the other.
    /// Asked for where a step was too inaccurate, to find out whether a switch is why.
    ///
    /// # Errors
    /// See [`Failure`].
    fn switching(&mut self, _t: f64, _y: &[f64], _values: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// Number of quantities that must not become negative. Methods with error control end the integration where one does, with
    /// [`super::StopReason::Event`]; other methods do not look.
    fn stops(&self) -> usize {
        0
    }

    /// Their values, as shares of their typical sizes.
    ///
    /// # Errors
    /// See [`Failure`].
    fn stopping(&mut self, _t: f64, _y: &[f64], _values: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// What is to hold throughout a step, beyond what error control judges by. Asked for once, before the first step.
    fn guards(&self) -> Guards {
        Guards::default()
    }

    /// The ranges of the guards of a set that are wanted, by their order, while time and the entries of the state run through ranges on a
    /// stretch; `entry` gives those of [`GuardSet::entries`], by place in that list. The others are left as they are.
    fn enclose(
        &mut self,
        _of: Watched,
        _t: Range,
        _entry: &dyn Fn(usize) -> Range,
        _wanted: &dyn Fn(usize) -> bool,
        _found: &mut [Range],
    ) {
    }

    /// The values of all guards of a set at a point.
    fn values(&mut self, _of: Watched, _t: f64, _entry: &dyn Fn(usize) -> f64, _found: &mut [f64]) {}

    /// How fast counted angles can change at a state, rad/s: no step in which they cannot turn far is looked at closely.
    fn turning(&self, _y: &[f64]) -> f64 {
        0.0
    }

    /// The size that an entry of the state typically has, in its unit; not positive where none is known.
    fn entry_size(&self, _entry: usize) -> f64 {
        1.0
    }

    /// How far an entry of the state may be off within the tolerance.
    fn resolution(&self, _entry: usize) -> f64 {
        0.0
    }

    /// The values of all guards of a set, in their order, at a state: for systems whose guards cannot be enclosed.
    ///
    /// # Errors
    /// See [`Failure`].
    fn look(&mut self, _of: Watched, _t: f64, _y: &[f64], _values: &mut [f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// The next time behind `t` at which a step has to end, however long steps are: something happens there ([`System::accept`]).
    /// Steps with error control hear of it by [`System::guards`]; those of a fixed size ask here.
    fn next_end(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Longest step that is sensible from here, > 0.
    fn max_step_hint(&self, _t: f64, _y: &[f64]) -> f64 {
        f64::INFINITY
    }

    /// Takes the state at a requested time. Interpolated states are off their manifold by the
    /// interpolation error; who needs them on it projects a copy.
    ///
    /// # Errors
    /// See [`Failure`]; both kinds end the run, a recoverable one with an [`super::Outcome`].
    fn sample(&mut self, _t: f64, _y: &[f64]) -> Result<(), Failure> {
        Ok(())
    }

    /// The step to `t` is final: discrete memory may change here, and `y` too (winding of
    /// angles, say), on its manifold.
    ///
    /// # Errors
    /// See [`Failure`]; both kinds end the run, a recoverable one with an [`super::Outcome`].
    fn accept(&mut self, _t: f64, _y: &mut [f64]) -> Result<Accepted, Failure> {
        Ok(Accepted::Unchanged)
    }

    /// A step of length `h` to `t` is over.
    fn step_done(&mut self, _t: f64, _y: &[f64], _h: f64) -> Flow {
        Flow::Continue
    }
}

/// What is watched throughout every step.
#[derive(Debug, Clone, Default)]
pub struct Guards {
    /// Switches and functions that depend on the state.
    pub within: GuardSet,
    /// Counted angles.
    pub turns: GuardSet,
    /// What depends on time alone.
    pub of_time: Vec<Guard>,
}

/// Quantities that are watched together.
#[derive(Debug, Clone, Default)]
pub struct GuardSet {
    /// How each of them is watched.
    pub guards: Vec<Guard>,
    /// Entries of the state that they depend on.
    pub entries: Vec<usize>,
    /// Whether [`System::enclose`] gives ranges; otherwise [`System::look`] is called at many places of each step.
    pub proved: bool,
}

/// One of the sets of [`Guards`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watched {
    /// [`Guards::within`].
    Within,
    /// [`Guards::turns`].
    Turns,
    /// [`Guards::of_time`], which take no entry of the state.
    Time,
}

/// How a quantity is watched.
#[derive(Clone)]
pub enum Guard {
    /// A condition that changes its sign where the equations switch: that is not to happen twice in a step unnoticed.
    Switch,
    /// A function that may be sharp: within a step it is not to leave what the method saw of it.
    Feature,
    /// A quantity that must stay within plus and minus a limit.
    Bound(f64),
    /// An angle less the reference it is counted from, rad: it has to stay within half a turn.
    Turn,
    /// The argument of a table, as a function of time: steps end at the knots. Gives the knots next to an argument, the lower
    /// one included.
    Knots(std::sync::Arc<dyn Fn(f64) -> (f64, f64) + Send + Sync>),
}

impl std::fmt::Debug for Guard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Switch => "Switch",
            Self::Feature => "Feature",
            Self::Bound(_) => "Bound",
            Self::Turn => "Turn",
            Self::Knots(_) => "Knots",
        })
    }
}

/// Cost of a system's work, in operations of dense linear algebra; only ratios matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// Of [`System::rhs`], and about that of [`System::project`].
    pub evaluation: f64,
    /// Of [`System::jacobian`]; without one, differences cost as many evaluations as the state has entries.
    pub jacobian: Option<f64>,
    /// Of what has still to be done before the first of them.
    pub preparation: f64,
}

/// Whether [`System::accept`] changed anything that `rhs` depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accepted {
    /// `y` and `f(t, y)` are what they were; the derivative at hand is used again.
    Unchanged,
    /// `y` or discrete memory changed; `f(t, y)` is evaluated anew.
    Changed,
}

/// Whether to continue after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// On with the next step.
    Continue,
    /// End the run here, with [`super::StopReason::Requested`].
    Stop,
}

/// Why a system could not do what it was asked for; carries the system's own error.
#[derive(Debug)]
pub enum Failure {
    /// A smaller step may help.
    Recoverable(Box<dyn Error + Send + Sync>),
    /// The same, where a number that was asked for is infinite or none.
    NotFinite(Box<dyn Error + Send + Sync>),
    /// A state that cannot be: no step may lead to it, or across it.
    Forbidden(Box<dyn Error + Send + Sync>),
    /// Nothing will help.
    Fatal(Box<dyn Error + Send + Sync>),
}
