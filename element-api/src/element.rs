//! The traits an author implements. Required items first; everything else has a default.

use crate::geometry::Pose;
pub use crate::motion::{Configuration, Motion, Reaction, Rows, Values, Wrenches};
use crate::params::{ParamError, Parameters};
use crate::scalar::Scalar;
pub use crate::specs::{ChannelSpec, FrameSpec, InputSpec};

/// What every element has. An element is built once from its parameters; it may branch on them freely and should do all
/// work here that does not depend on the motion.
pub trait Element: Sized + Send + Sync + 'static {
    /// The word used in scenes (`type = "revolute"`); lower case, digits and `-`.
    const NAME: &'static str;
    /// One sentence for `odyn elements list`.
    const SUMMARY: &'static str;
    /// The manual page, for `odyn elements describe` and the verification manual: what it is, equations, signs, singular
    /// cases, and a minimal scene in a fenced block marked `toml`. Markdown. Usually the documentation of the file:
    /// `const DOC: &'static str = doc_of(include_str!("revolute.rs"));`
    const DOC: &'static str = "";
    /// How pictures of a mechanism show it: one of [`GLYPHS`](crate::descriptor::GLYPHS); empty: found from its equations.
    const GLYPH: &'static str = "";
    /// The frames it connects: name and meaning, in the order of `bodies` in a scene. Any number.
    const FRAMES: &'static [FrameSpec];
    /// What each further frame is, for an element that takes any number of them after [`Element::FRAMES`] (a rope over pulleys,
    /// planets on a carrier): the scene's `bodies` decide how many. They are called by this name and a number, from 1. Contract 1.2.
    const MORE_FRAMES: Option<FrameSpec> = None;
    /// Largest number of frames in all, where there are [`Element::MORE_FRAMES`]; the smallest is that of [`Element::FRAMES`].
    /// Contract 1.2.
    const MOST_FRAMES: usize = 64;
    /// Number of angles followed over many turns with [`Configuration::angle`].
    const ANGLES: usize = 0;
    /// Pairs of frames, by number, whose z axes the joints of a scene must keep parallel: the element acts on bodies, or measures how they
    /// move, about or along these axes. The host warns where they are not parallel at the start, and where a joint between the two
    /// bodies has another axis. Contract 1.2.
    const PARALLEL_AXES: &'static [[usize; 2]] = &[];
    /// Call this element at run time instead of recording its equations. For equations that depend on something outside
    /// the contract (a library, a co-simulation). Slower, and `odyn plan` says so.
    const OPAQUE: bool = false;
    /// Checks of the test kit that do not apply to it, each with the reason:
    /// `&[("frame-invariance", "a field of the world")]`. `odyn plugin check` calls them exempt and prints the reason. Contract 1.2.
    const EXEMPT: &'static [(&'static str, &'static str)] = &[];
    /// Rows of recommended parameters that a scene picks with `params = { use = "ROW" }`: CSV, usually `include_str!("sizes.csv")`.
    /// The first column names the rows, the others are named in the first line as parameters of type number, whole number, flag or text,
    /// with a unit where they have one: `size,bore [mm],rating [kN]`. Columns of other names are for the reader alone; lines that begin
    /// with `#` are remarks. What the scene itself gives wins over the row, the row over defaults. Contract 1.2.
    const CATALOG: &'static str = "";
    /// What reports say of an instance, Markdown: a section of its own, followed by the extremes of its channels and its checks. Empty:
    /// there is one where the element has checks. Contract 1.2.
    const REPORT: &'static str = "";
    /// Names and units of internal unknowns y (a pressure between two orifices, the place of a contact on a curve), which follow from
    /// as many [`Element::conditions`] at every instant. At most eight. Not for opaque elements. Contract 1.2.
    const UNKNOWNS: &'static [ChannelSpec] = &[];
    /// Its parameters, as a scene gives them.
    type Parameters: Parameters;

    /// `[create]` Builds the element. The parameters are complete, in SI units and inside their ranges.
    ///
    /// # Errors
    /// What a range alone can't say, by parameter name.
    fn new(parameters: Self::Parameters) -> Result<Self, ParamError>;

    /// `[create]` Where the search for the unknowns begins at the start, one per unknown, SI. Of several solutions the one that is
    /// found from there is followed through the run. Their number may depend on the parameters; the first ones have the names of
    /// [`Element::UNKNOWNS`]. Contract 1.2.
    fn initial_unknowns(&self) -> Vec<f64> {
        vec![0.0; Self::UNKNOWNS.len()]
    }
    /// `[record]` The conditions g = 0 that [`Motion::unknowns`] are found from, as many as there are unknowns. They may depend on
    /// frames, time, states, memory, signals and, of force and control elements, velocities; not on reactions or accelerations.
    /// Their matrix of derivatives with respect to the unknowns must be regular: where it becomes singular (a branch of solutions
    /// ends or divides), the run stops and says so.
    ///
    /// The host takes the derivatives of the unknowns from the implicit function theorem, dy = -g_y^-1 (g_q dq + g_t dt), so that
    /// Jacobians and accelerations are exact (Griewank & Walther, Evaluating Derivatives (2008), section 15.1). Contract 1.2.
    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[create]` The element with this number of frames in all, for one with [`Element::MORE_FRAMES`]; the number lies between those
    /// of [`Element::FRAMES`] and [`Element::MOST_FRAMES`]. Contract 1.2.
    ///
    /// # Errors
    /// A number that does not fit the parameters; the name `bodies` points at the scene's list.
    fn with_frames(self, count: usize) -> Result<Self, ParamError> {
        let _ = count;
        Ok(self)
    }

    /// `[between steps]` For opaque elements with a memory of their own: the step that ended here was accepted. The only
    /// place where memory may change; evaluations also happen for steps that are rejected later.
    fn accept(&mut self, at: &Motion<'_, f64>) {
        let _ = at;
    }
    /// `[between steps]` The memory changed by [`Element::accept`], as bytes.
    fn save(&self) -> Vec<u8> {
        Vec::new()
    }
    /// `[between steps]` Restores what [`Element::save`] gave.
    ///
    /// # Errors
    /// When the bytes are not of this element.
    fn load(&mut self, memory: &[u8]) -> Result<(), String> {
        if memory.is_empty() { Ok(()) } else { Err("this element keeps no memory".into()) }
    }
}

/// A joint: rows that are zero. Jacobian, acceleration terms and reactions follow from [`Constraint::residual`].
pub trait Constraint: Element {
    /// Names of the rows, as reports print them (`"x"`, `"about y"`). Any number.
    const ROWS: &'static [&'static str];
    /// Names of the rows on velocities, as reports print them. They are numbered after [`Constraint::ROWS`].
    const VELOCITY_ROWS: &'static [&'static str] = &[];
    /// Names and units of the joint coordinates reported by [`Constraint::coordinates`].
    const COORDINATES: &'static [ChannelSpec] = &[];
    /// Number of joint coordinates of [`Constraint::pose`]; `None`: the joint offers no mobility.
    const MOBILITY: Option<usize> = None;
    /// Whether frame 1 turns freely in all directions on top of [`Constraint::pose`]. The host describes that rotation itself,
    /// without singular positions; the freedoms are the coordinates and three more.
    const TURNS_FREELY: bool = false;
    /// Names and units of continuous states x' = f that rows may depend on (a servo's angle). Contract 1.2.
    const STATES: &'static [ChannelSpec] = &[];
    /// Signals that [`Constraint::rates`], [`Constraint::channels`], [`Constraint::next_memory`] and [`Constraint::limit`] take; in
    /// [`Motion::inputs`]. Contract 1.2.
    const INPUTS: &'static [InputSpec] = &[];
    /// Names and units of the values reported by [`Constraint::channels`], besides the coordinates. Not for opaque joints. Contract 1.2.
    const CHANNELS: &'static [ChannelSpec] = &[];

    /// `[record; hot when opaque]` The constraint equations, one value per row, in m or rad-like units. Rows that
    /// [`Constraint::uses_row`] leaves out are not asked for and must not be set.
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>);

    /// `[record]` The same for a joint with states: the rows may depend on positions, time and [`Motion::states`], which move them as a
    /// driver's time does. A row takes no velocities and no signals: pass a signal through a state. The rate of a state that a row depends
    /// on must not depend on velocities, nor on signals measured from them, nor jump: pass those through one more state.
    /// The joint offers no mobility, is not opaque, and these rows are not unilateral. Give this or [`Constraint::residual`],
    /// which the default calls and which may be left empty then. Contract 1.2.
    ///
    /// With rows Phi(q, s, t) and s' = f the host enforces Phi_q v + Phi_s f + Phi_t = 0 and its derivative; the power of the reactions
    /// along Phi_s f + Phi_t is work from outside (Haug 1989, section 9.5, with states in the place of time).
    fn residual_in_motion<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        self.residual(&at.configuration, rows);
    }

    /// `[create]` Values of the states at the start. Their number may depend on the parameters; the first ones have the
    /// names of [`Constraint::STATES`]. Contract 1.2.
    fn initial_states(&self) -> Vec<f64> {
        vec![0.0; Self::STATES.len()]
    }
    /// `[record]` Rates of the states, one per entry of [`Constraint::initial_states`]. Contract 1.2.
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[record]` Values to report, one per entry of [`Constraint::CHANNELS`]: of positions, velocities, time, states, memory and
    /// signals. Other elements take them by name. Contract 1.2.
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[create]` Discrete states at the start. They change only between steps, so rows, coordinates, limits and conditions do not
    /// depend on them, nor does the rate of a state that a row depends on: what they change goes through a state behind that one.
    /// Not for opaque joints. Contract 1.2.
    fn initial_memory(&self) -> Vec<f64> {
        Vec::new()
    }
    /// `[create]` For a joint that samples: the period T, s; see [`Force::sample_period`]. Contract 1.2.
    fn sample_period(&self) -> Option<f64> {
        None
    }
    /// `[record]` The discrete states after an accepted step, or after a sample, one per entry of [`Constraint::initial_memory`].
    /// Contract 1.2.
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory.iter().for_each(|value| out.push(*value));
    }

    /// `[record]` Constraints on velocities that are not the rate of anything (rolling without slip, a blade), one value per entry of
    /// [`Constraint::VELOCITY_ROWS`], in m/s or rad/s, linear in the twists: a . v + b = 0, where a and b may depend on
    /// positions and time. Positions are left free by them. Not for opaque elements.
    ///
    /// Source: Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems (1989), section 11.6.
    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let _ = (at, rows);
    }

    /// `[create]` Whether this instance has the row; for joints whose parameters choose.
    fn uses_row(&self, row: usize) -> bool {
        let _ = row;
        true
    }

    /// `[create]` For a row that only pushes (a contact, a stop, a freewheel): its coefficient of restitution, 0 to 1. The value of such
    /// a row, of a row on velocities the velocity, is positive while it is open; it never becomes negative. Where it is zero the
    /// row is closed and may push, never pull. A row on positions that closes with a velocity is an impact: it leaves with the
    /// restitution's share of that velocity, or stays closed. `None`: the row always holds. The joint has no mobility. Not for
    /// opaque elements. Contract 1.2.
    ///
    /// Source: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts (1996); Brogliato, Nonsmooth Mechanics (2016).
    fn unilateral(&self, row: usize) -> Option<f64> {
        let _ = row;
        None
    }

    /// `[create]` For a row that holds only while a unilateral row is closed (a contact point that does not slide): that row. Rows are
    /// numbered through [`Constraint::ROWS`] and [`Constraint::VELOCITY_ROWS`]. Contract 1.2.
    fn sticks_with(&self, row: usize) -> Option<usize> {
        let _ = row;
        None
    }

    /// `[record]` For a row on velocities that holds only up to a limit (dry friction, a brake, a clutch): that limit, N or N m, not
    /// negative; positions, velocities, time and signals may go into it. Where it changes, less than zero is
    /// zero; a signal must not be made of accelerations or reactions of the same instant. Of a row that sticks with a
    /// unilateral row it is the share of that row's reaction, the coefficient of friction. While the row sticks, its reaction is what holds
    /// it; where that reaches the limit, it begins to slide: then the reaction is as large as the limit, against the velocity that the row has, until that is zero.
    /// In an impact a share of the unilateral row's impulse is the limit of the row's; no other impulse comes from it. `None`: the
    /// row holds whatever it takes. The joint has no mobility. Not for opaque elements. Contract 1.2.
    ///
    /// Source: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts (1996), ch. 5 and 8.
    fn limit<S: Scalar>(&self, row: usize, at: &Motion<'_, S>) -> Option<S> {
        let _ = (row, at);
        None
    }

    /// `[create]` For a row with a limit: another row, without one of its own, that shares it. Both together hold up to it, as a
    /// vector, and slide against their velocity: friction in a plane. Contract 1.2.
    fn slides_with(&self, row: usize) -> Option<usize> {
        let _ = row;
        None
    }

    /// `[record; hot when opaque]` The joint coordinates, one per entry of [`Constraint::COORDINATES`].
    fn coordinates<S: Scalar>(&self, at: &Configuration<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }

    /// `[record]` Pose of frame 1 in frame 0 for joint coordinates `q`. Velocities follow. Every pose must satisfy
    /// [`Constraint::residual`], and every configuration that satisfies it must be such a pose, with
    /// [`Constraint::TURNS_FREELY`] followed by any rotation of frame 1.
    fn pose<S: Scalar>(&self, q: &[S]) -> Pose<S> {
        let _ = q;
        Pose::identity()
    }
}

/// A force element: what acts on its bodies.
pub trait Force: Element {
    /// Names and units of the values reported by [`Force::channels`].
    const CHANNELS: &'static [ChannelSpec] = &[];
    /// Names and units of continuous states x' = f (a first-order motor, a gas volume).
    const STATES: &'static [ChannelSpec] = &[];
    /// Signals it takes; in [`Motion::inputs`].
    const INPUTS: &'static [InputSpec] = &[];
    /// Joints whose reactions it depends on; in [`Motion::reactions`]. The host solves for reactions and forces together.
    const JOINTS: &'static [FrameSpec] = &[];

    /// `[record; hot when opaque]` Adds forces and torques on the bodies.
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>);

    /// `[record; hot when opaque]` Values to report, one per entry of [`Force::CHANNELS`].
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// Conditions under which it may be used; name, unit of the margin, and what is wrong where it is negative, in words that follow the
    /// name of an instance ("is loaded beyond its static rating"). Not for opaque elements. Contract 1.2.
    const CHECKS: &'static [ChannelSpec] = &[];
    /// `[record]` The margin of each of [`Force::CHECKS`]: positive while all is well. The host looks at it at accepted steps and at samples;
    /// where it was negative the run ends with a warning that has the first time, and the smallest margin with its time. The motion
    /// does not depend on it.
    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[record; hot when opaque]` Potential energy V, J, if the force (or its conservative part) has one.
    ///
    /// An element that gives V or [`Force::dissipation`] D states with them where all power of its wrench goes: along any motion,
    /// with its own states moving at their [`Force::rates`] and time and signals held,
    ///
    /// power of the wrench = -dV/dt - D.
    ///
    /// What V changes by time or signals is work from outside, and counted as such by the host. The rule is that of the test kit
    /// (`power-balance`) and of the energy balance of every run, which is `suspect` where it does not hold. A force to which
    /// that does not apply (its states are driven by a source of its own, its V jumps with its memory, or it is not worth the
    /// trouble) gives neither, and its power is work. So it is for a V that depends on signals measured from the motion.
    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let _ = at;
        None
    }
    /// `[record; hot when opaque]` Power turned into heat, W, not negative. Without this and [`Force::potential`] the host
    /// integrates the power of the wrench as work done on the system.
    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let _ = at;
        None
    }
    /// `[record]` Kinetic energy T, J, of mass that the element brings: a point mass, the rotor of a geared motor, a body that bends. A sum
    /// of products of two velocities each, never negative; it depends on positions, rotations and twists of the frames, and on
    /// flexible coordinates and their rates, on nothing else. Its inertia acts on the bodies by itself: [`Force::wrench`] is
    /// what comes on top, the weight of that mass for instance. The energy balance counts T; impacts, and what
    /// friction holds, feel its mass. Not for opaque elements. Contract 1.2.
    ///
    /// The host differentiates T: with h = dT/d(velocities) of a frame's origin and about it, and the derivatives along
    /// displacements and turns of the frame, the inertia is F = dT/dp - dh_v/dt, M = dT/dtheta + omega x h_w - dh_w/dt, which is linear
    /// in accelerations (Lagrange's equations in quasi-velocities; Meirovitch, Methods of Analytical Dynamics (1970), section 4.12).
    fn kinetic<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let _ = at;
        None
    }
    /// `[create]` Number n of flexible coordinates q of the element itself, which T moves: the states begin with q and q', n numbers
    /// each, and [`Force::rates`] gives those of further states only. T must grow with each q' whatever the frames do. Contract 1.2.
    fn flexible(&self) -> usize {
        0
    }
    /// `[record]` The generalised force on each flexible coordinate, whose power is that force times q': -dV/dq - dR/dq' where
    /// [`Force::potential`] and [`Force::dissipation`] tell of it. Contract 1.2.
    fn flexible_forces<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[create]` Values of the states at the start. Their number may depend on the parameters; the first ones have the
    /// names of [`Force::STATES`].
    fn initial_states(&self) -> Vec<f64> {
        vec![0.0; Self::STATES.len()]
    }
    /// `[record; hot when opaque]` Rates of the states, one per entry of [`Force::initial_states`].
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[create]` Discrete states (a latch, a counter) at the start. They are inputs that change only between steps.
    fn initial_memory(&self) -> Vec<f64> {
        Vec::new()
    }
    /// `[create]` For an element that samples (a digital controller): the period T, s. Its memory then changes at the start and at
    /// whole multiples of T only, where steps end, by what [`Force::next_memory`] gives there; in between it is held. What it takes
    /// from elements that sample at the same time is their memory from before; of functions of time that jump there, what they are
    /// after it. `None`: the memory may change after every accepted step, see [`Force::next_memory`]. Contract 1.2.
    fn sample_period(&self) -> Option<f64> {
        None
    }
    /// `[record; hot when opaque]` The discrete states after an accepted step, one per entry of
    /// [`Force::initial_memory`]. Where one is chosen by `select` among what stays as it is during a step, steps end where its
    /// conditions change, and it jumps there. Not so of opaque elements.
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory.iter().for_each(|value| out.push(*value));
    }
}

/// A control element: signals in, signals out, with states in between. It acts on no body; force elements that take its
/// signals do. It may have frames, of which it sees position and motion.
pub trait Control: Element {
    /// Signals it takes; in [`Motion::inputs`].
    const INPUTS: &'static [InputSpec] = &[];
    /// Signals it gives; other elements take them by name, and outputs report them.
    const OUTPUTS: &'static [ChannelSpec];
    /// Names and units of continuous states x' = f.
    const STATES: &'static [ChannelSpec] = &[];

    /// `[record; hot when opaque]` The signals it gives, one per entry of [`Control::OUTPUTS`].
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>);

    /// Conditions under which it may be used: see [`Force::CHECKS`]. Contract 1.2.
    const CHECKS: &'static [ChannelSpec] = &[];
    /// `[record]` The margin of each of [`Control::CHECKS`]: see [`Force::checks`].
    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }

    /// `[create]` Values of the states at the start. Their number may depend on the parameters; the first ones have the
    /// names of [`Control::STATES`].
    fn initial_states(&self) -> Vec<f64> {
        vec![0.0; Self::STATES.len()]
    }
    /// `[record; hot when opaque]` Rates of the states, one per entry of [`Control::initial_states`].
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (at, out);
    }
    /// `[create]` Discrete states at the start. They are inputs that change only between steps.
    fn initial_memory(&self) -> Vec<f64> {
        Vec::new()
    }
    /// `[create]` For an element that samples (a digital controller): the period T, s. Its memory then changes at the start and at
    /// whole multiples of T only, where steps end, by what [`Control::next_memory`] gives there; in between it is held. What it takes
    /// from elements that sample at the same time is their memory from before; of functions of time that jump there, what they are
    /// after it. `None`: the memory may change after every accepted step, see [`Control::next_memory`]. Contract 1.2.
    fn sample_period(&self) -> Option<f64> {
        None
    }
    /// `[record; hot when opaque]` The discrete states after an accepted step, one per entry of
    /// [`Control::initial_memory`]. Where one is chosen by `select` among what stays as it is during a step, steps end where its
    /// conditions change, and it jumps there. Not so of opaque elements.
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        at.memory.iter().for_each(|value| out.push(*value));
    }
}
