//! [`Machine`]: the programs of a scene with all that a step of a fixed size needs.

use crate::analysis::{Folding, Formulation as _, JointForm, Portable, Quantities};
use crate::choices::Choices;
use crate::diagnostics::Diagnostic;
use crate::method::Method;
use crate::model::{Model, Quantity};
use crate::parameters::Parameters;
use crate::plan::Layout;
use crate::program::{Knots, Node, Seeds, Sharp, Switches, derivatives};
use crate::refused;
use crate::sampled::Sampled;
use crate::session::{Session, SessionError};
use crate::tangents::Tangents;

/// A signal that goes in or comes out.
#[derive(Debug, Clone)]
pub struct Port {
    /// Name in the scene.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// One of these in SI.
    pub factor: f64,
    /// Its dimension.
    pub dimension: odyn_scene::Dimension,
    /// Its value at the start, in its unit; of outputs zero.
    pub start: f64,
    /// What it is, in words.
    pub about: String,
    /// Whether it stays at its value at the start: an input that was not chosen.
    pub is_fixed: bool,
}

/// A body with an axis about which it has no moment of inertia of its own: whether something turns it is judged while the program
/// runs.
#[derive(Debug, Clone, Copy)]
pub struct ThinAxis {
    /// The moment that it is given all the same, kg m^2.
    pub moment: f64,
    /// Share of the kinetic energy that it may hold.
    pub share: f64,
}

/// See the module documentation.
#[derive(Debug, Clone)]
pub struct Machine {
    /// An identifier in C.
    pub name: String,
    /// Name of the scene.
    pub title: String,
    /// The equations of motion and what brings a state to the constraints.
    pub portable: Portable,
    /// Where the inputs of programs lie.
    pub layout: Layout,
    /// The state at the start, SI.
    pub state: Vec<f64>,
    /// Start, s.
    pub t_start: f64,
    /// End, s.
    pub t_end: f64,
    /// One unit of the scene's time, s, and its name.
    pub time_unit: (f64, String),
    /// Size of a step, s.
    pub step: f64,
    /// Method of integration.
    pub method: &'static Method,
    /// Corrections of positions per step.
    pub corrections: usize,
    /// Switches located per step.
    pub located: usize,
    /// Angles that are counted over full turns: which references they are, with their values at the start, rad.
    pub references: Vec<(usize, f64)>,
    /// The angles themselves, then their rates.
    pub angles: Option<Quantities>,
    /// Signals from outside.
    pub inputs: Vec<Port>,
    /// Channels.
    pub outputs: Vec<Port>,
    /// Their values, SI.
    pub quantities: Option<Quantities>,
    /// Functions that change their sign where equations switch.
    pub switches: Option<Quantities>,
    /// Memories of elements that sample.
    pub sampled: Sampled,
    /// The error of a step that is allowed, as a share of the sizes of what moves: the sizes of steps follow from it, and
    /// [`Machine::step`] is the longest. Left out: steps of a fixed size.
    pub tolerance: Option<f64>,
    /// Values of [`Portable::others`]; where there are [`Machine::thin`] axes, kinetic energy and angular velocities about them.
    pub watched: Option<Quantities>,
    /// Axes without moments of inertia.
    pub thin: Vec<ThinAxis>,
    /// Exact derivatives along a direction, where they were asked for or the method takes them.
    pub tangents: Option<Tangents>,
    /// Whether they were asked for.
    pub derivatives: bool,
    /// Parameters of the scene: see [`Machine::with_parameters`].
    pub parameters: Parameters,
}

/// What lies in an input slot of the programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slot {
    Time,
    /// An entry of the state.
    State(usize),
    /// A counted angle.
    Reference(usize),
    /// A memory of an element that samples.
    Memory(usize),
    /// A signal from outside.
    Input(usize),
    /// An output of [`Portable::motion`]: an acceleration or a multiplier.
    Solved(usize),
    /// The direction of derivatives: along time, then states, then inputs.
    Seed(usize),
    /// The derivative of what [`Slot::Solved`] is.
    SolvedTangent(usize),
    /// A number that follows parameters.
    Followed(usize),
    /// A multiplier of a row that is not solved with: zero.
    Unused,
}

/// Corrections of positions per step: the first meets the rows but for its square, the second but for round-off.
const CORRECTIONS: usize = 2;
/// Switches that are located per step; those beyond are stepped over.
const LOCATED: usize = 2;
/// Break points over time at which steps end, of all tables together. Of more only those where a table jumps or has a corner; where
/// these are as many, all are stepped over.
const MOST_KNOTS: usize = 64;

impl Machine {
    /// Writes down the programs of a scene.
    ///
    /// # Errors
    /// What cannot be exported, with its name and the reason: see `refused.rs`.
    pub fn new(session: Session, name: &str, choices: Choices) -> Result<Self, SessionError> {
        let source = session.scene.source.clone();
        Self::of(session, name, choices).map_err(|failed| match failed {
            Refused::Here(diagnostic) => SessionError::one(&source, *diagnostic),
            Refused::Session(error) => error,
        })
    }

    fn of(mut session: Session, name: &str, choices: Choices) -> Result<Self, Refused> {
        choose(&mut session, &choices).map_err(Refused::here)?;
        if let Some(diagnostic) = refused::before(&session).or_else(|| refused::tolerance(&choices)) {
            return Err(Refused::here(diagnostic));
        }
        let first = session.joint_form(Folding::WherePossible).map_err(Refused::Session)?;
        let mut form = first.ok_or_else(|| Refused::here(refused::no_joint_form(&session)))?;
        let nodes: Vec<Node> = observed(&mut session);
        // Reactions are not found where coordinates follow others.
        if !nodes.is_empty() && form.quantities(&session.equations, &nodes).is_none() {
            let again = session.joint_form(Folding::Never).map_err(Refused::Session)?;
            form = again.ok_or_else(|| Refused::here(refused::no_joint_form(&session)))?;
        }
        let portable = form.portable().ok_or_else(|| Refused::here(refused::no_joint_form(&session)))?;
        let layout = session.plan.layout.clone();
        let quantities = outputs(&session, &form, &nodes)?;
        let switches = switches(&mut session, &form, &layout)?;
        let counted = session.equations.counted_angles(&session.model, &layout);
        let turning = turning(&mut session, &counted);
        let angles = some_quantities(&session, &form, &turning, "the counted angles of the scene")?;
        let sampled = sampled(&session, &form, &layout)?;
        let (watched, thin) = watched(&mut session, &form, &portable)?;
        let mut state = vec![0.0; form.groups().len()];
        form.state_of(&session.assembly.working, &mut state);
        let simulation = &session.scene.simulation;
        let units = &session.scene.units;
        let time = odyn_scene::Dimension::TIME;
        let (t_start, t_end) = (simulation.t_start, simulation.t_end);
        let machine = Self {
            name: identifier(name),
            title: name.to_string(),
            state,
            t_start,
            t_end,
            time_unit: (units.factor(time), units.label(time)),
            step: choices.step.or(simulation.fixed_step).unwrap_or((t_end - t_start) / 1000.0),
            method: choices.method,
            corrections: CORRECTIONS,
            located: LOCATED,
            references: counted.iter().map(|k| (*k, session.assembly.references[*k])).collect(),
            angles,
            inputs: inputs(&session.model, choices.inputs.as_deref()).map_err(Refused::here)?,
            outputs: output_ports(&session.model),
            quantities,
            switches,
            sampled,
            tolerance: choices.tolerance,
            watched,
            thin,
            portable,
            layout,
            tangents: None,
            derivatives: choices.derivatives,
            parameters: Parameters::default(),
        };
        machine.differentiated().ok_or_else(opaque)
    }

    /// The same with exact derivatives along directions; `None` where a program calls an opaque element.
    #[must_use]
    pub fn with_derivatives(self) -> Option<Self> {
        Self { derivatives: true, ..self }.differentiated()
    }

    /// The same with the derivatives that are wanted.
    pub(crate) fn differentiated(self) -> Option<Self> {
        let wanted = self.derivatives || self.method.implicit.is_some();
        let tangents = if wanted { Some(Tangents::of(&self)?) } else { None };
        Some(Self { tangents, ..self })
    }

    /// What lies in an input slot.
    pub(crate) fn slot(&self, slot: usize) -> Slot {
        let (layout, coordinates) = (&self.layout, &self.portable.coordinates);
        if let Some(seed) = slot.checked_sub(coordinates.input_count) {
            let (seeds, solved) = (self.seeds(), coordinates.columns + self.portable.rows.len());
            return match seed.checked_sub(seeds) {
                None => Slot::Seed(seed),
                Some(place) if place < solved => Slot::SolvedTangent(place),
                Some(place) => Slot::Followed(place - solved),
            };
        }
        if slot == Layout::TIME {
            return Slot::Time;
        }
        if let Some(entry) = coordinates.entry_of(slot, layout) {
            return Slot::State(entry);
        }
        if let Some(place) = self.references.iter().position(|(number, _)| layout.reference_slot() + number == slot) {
            return Slot::Reference(place);
        }
        if let Some(memory) = slot.checked_sub(layout.discrete_slot()).filter(|k| *k < self.sampled.start.len()) {
            return Slot::Memory(memory);
        }
        let first = layout.given_slot(0);
        if (first..first + self.inputs.len()).contains(&slot) {
            return Slot::Input(slot - first);
        }
        let accelerations = coordinates.acceleration_slot..coordinates.acceleration_slot + coordinates.columns;
        if accelerations.contains(&slot) {
            return Slot::Solved(slot - accelerations.start);
        }
        let row = slot.checked_sub(layout.multiplier_slot());
        let used = row.and_then(|row| self.portable.rows.iter().position(|used| *used == row));
        used.map_or(Slot::Unused, |place| Slot::Solved(coordinates.columns + place))
    }

    /// Number of entries of a direction: time, states, inputs.
    #[must_use]
    pub fn seeds(&self) -> usize {
        1 + self.dim() + self.inputs.len()
    }

    /// Length of the inputs of programs: directions, derivatives and numbers that follow parameters included, which come last.
    pub(crate) fn input_count(&self) -> usize {
        let coordinates = &self.portable.coordinates;
        let solved = coordinates.columns + self.portable.rows.len();
        coordinates.input_count + self.seeds() + solved + self.parameters.followed.len()
    }

    /// Length of the state.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.state.len()
    }

    /// Whether outputs take accelerations or reactions.
    #[must_use]
    pub fn solves_for_outputs(&self) -> bool {
        self.quantities.as_ref().is_some_and(|found| found.solved)
    }

    /// Number of pivots behind the outputs of [`Portable::motion`].
    #[must_use]
    pub fn pivots_from(&self) -> usize {
        self.portable.coordinates.columns + self.portable.rows.len() + self.layout.states + 1
    }
}

/// Leaves only the outputs that were chosen, in the order of the choice.
fn choose(session: &mut Session, choices: &Choices) -> Result<(), Diagnostic> {
    let Some(names) = &choices.outputs else { return Ok(()) };
    let channels = &session.model.channels;
    let known = |name: &String| {
        let found = channels.iter().find(|channel| channel.name == *name);
        let list = || channels.iter().map(|channel| channel.name.as_str());
        found.cloned().ok_or_else(|| refused::unknown("output", name, list()))
    };
    session.model.channels = names.iter().map(known).collect::<Result<_, _>>()?;
    Ok(())
}

enum Refused {
    Here(Box<Diagnostic>),
    Session(SessionError),
}

impl Refused {
    fn here(diagnostic: Diagnostic) -> Self {
        Self::Here(Box::new(diagnostic))
    }
}

/// Elements that are opaque are named before.
fn opaque() -> Refused {
    Refused::here(Diagnostic::error(crate::diagnostics::codes::CANNOT_EXPORT, "a program calls an opaque element"))
}

/// The channels as nodes.
fn observed(session: &mut Session) -> Vec<Node> {
    let Session { equations, model, plan, .. } = session;
    model.channels.iter().map(|channel| equations.observe(&channel.quantity, model, &plan.layout)).collect()
}

fn outputs(session: &Session, form: &JointForm, nodes: &[Node]) -> Result<Option<Quantities>, Refused> {
    if nodes.is_empty() {
        return Ok(None);
    }
    if let Some(found) = form.quantities(&session.equations, nodes) {
        return Ok(Some(found));
    }
    // One of them is to blame.
    let missing = session.model.channels.iter().zip(nodes);
    let name = missing
        .filter(|(_, node)| form.quantities(&session.equations, &[**node]).is_none())
        .map(|(channel, _)| channel.name.clone())
        .next();
    Err(Refused::here(refused::no_output(session, &name.unwrap_or_default(), "the output")))
}

fn some_quantities(
    session: &Session,
    form: &JointForm,
    nodes: &[Node],
    what: &str,
) -> Result<Option<Quantities>, Refused> {
    if nodes.is_empty() {
        return Ok(None);
    }
    let found = form.quantities(&session.equations, nodes);
    found.map(Some).ok_or_else(|| Refused::here(refused::no_output(session, "", what)))
}

/// Counted angles, then their rates: along the velocities of all bodies, with A' = A w~ (Haug 1989, eq. 9.2.40).
fn turning(session: &mut Session, counted: &[usize]) -> Vec<Node> {
    let equations = &mut session.equations;
    let angles: Vec<Node> = counted.iter().map(|angle| equations.angles[*angle]).collect();
    let g = &mut equations.graph;
    let mut seeds = Seeds::default();
    for body in &equations.bodies {
        seeds.extend(body.r.into_iter().zip(body.v));
        for row in body.a {
            for k in 0..3 {
                let (next, last) = ((k + 1) % 3, (k + 2) % 3);
                let (plus, minus) = (g.mul(row[next], body.w[last]), g.mul(row[last], body.w[next]));
                seeds.insert(row[k], g.sub(plus, minus));
            }
        }
    }
    let rates = derivatives(g, &angles, &seeds);
    [angles, rates].concat()
}

/// How close to a smooth function a table is that steps lead across, on its range.
const SMOOTH: f64 = 1e-3;

/// Conditions of selects, and where tables jump, have corners or are bent much.
fn switches(session: &mut Session, form: &JointForm, layout: &Layout) -> Result<Option<Quantities>, Refused> {
    let mut sharp = Sharp::find(&session.equations, layout, SMOOTH);
    let is_crowded = |(_, knots): &(Node, Knots)| knots.breaks.len() > MOST_KNOTS;
    if sharp.knots.iter().any(is_crowded) {
        sharp = Sharp::find(&session.equations, layout, f64::INFINITY);
    }
    let found = Switches::find(&session.equations, layout);
    let g = &mut session.equations.graph;
    let mut nodes: Vec<Node> = found.conditions.iter().map(|(a, b)| g.sub(*a, *b)).collect();
    for (at, sides) in &sharp.corners {
        g.tables.push(sides.clone());
        nodes.push(g.table(g.tables.len() as u32 - 1, 0, *at));
    }
    // Tables over time: those that repeat are stepped over.
    for (at, knots) in sharp.knots.iter().filter(|one| one.1.repeats.is_none() && !is_crowded(one)) {
        for knot in &knots.breaks {
            let knot = g.constant(*knot);
            nodes.push(g.sub(*at, knot));
        }
    }
    some_quantities(session, form, &nodes, "the switches of the scene")
}

fn sampled(session: &Session, form: &JointForm, layout: &Layout) -> Result<Sampled, Refused> {
    // Signals from outside are behind them.
    let memories = layout.given_at;
    let nodes = &session.equations.next_discrete[..memories];
    Ok(Sampled {
        start: session.assembly.discrete[..memories].to_vec(),
        clocks: Sampled::clocks_of(&session.model, layout),
        next: some_quantities(session, form, nodes, "the memories of the scene")?,
    })
}

fn watched(
    session: &mut Session,
    form: &JointForm,
    portable: &Portable,
) -> Result<(Option<Quantities>, Vec<ThinAxis>), Refused> {
    let equations = &mut session.equations;
    let mut nodes: Vec<Node> = portable.others.iter().map(|(row, _)| equations.rows[*row].value).collect();
    let mut thin = Vec::new();
    let mut rates = Vec::new();
    for (number, body) in session.model.bodies.iter().enumerate() {
        let spin = equations.bodies[number].w;
        for axis in body.thin.iter() {
            let g = &mut equations.graph;
            let mut about = g.constant(0.0);
            for (component, w) in axis.axis.iter().zip(spin) {
                let factor = g.constant(*component);
                let part = g.mul(factor, w);
                about = g.add(about, part);
            }
            rates.push(about);
            thin.push(ThinAxis { moment: axis.moment, share: axis.share });
        }
    }
    if !thin.is_empty() {
        nodes.push(equations.kinetic);
        nodes.extend(rates);
    }
    Ok((some_quantities(session, form, &nodes, "the rows of the scene")?, thin))
}

fn inputs(model: &Model, chosen: Option<&[String]>) -> Result<Vec<Port>, Diagnostic> {
    let names = || model.inputs.iter().map(|signal| signal.name.as_str());
    let is_known = |name: &&String| names().any(|known| known == name.as_str());
    if let Some(name) = chosen.into_iter().flatten().find(|name| !is_known(name)) {
        return Err(refused::unknown("input", name, names()));
    }
    let port = |signal: &crate::model::Signal| Port {
        is_fixed: chosen.is_some_and(|chosen| !chosen.contains(&signal.name)),
        name: signal.name.clone(),
        unit: signal.unit.clone(),
        dimension: signal.dimension,
        factor: signal.factor,
        start: signal.value / signal.factor,
        about: "signal from outside".into(),
    };
    Ok(model.inputs.iter().map(port).collect())
}

fn output_ports(model: &Model) -> Vec<Port> {
    let port = |channel: &crate::model::Channel| Port {
        is_fixed: false,
        name: channel.name.clone(),
        unit: channel.unit.clone(),
        dimension: channel.dimension,
        factor: channel.factor,
        start: 0.0,
        about: match &channel.quantity {
            Quantity::Given { .. } => "what the input is".into(),
            _ => channel.place.clone(),
        },
    };
    model.channels.iter().map(port).collect()
}

/// A name that C takes.
pub(crate) fn identifier(name: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(letter).collect();
    let name = name.trim_end_matches('_').to_string();
    match name.chars().next() {
        // `main.c` is the example.
        Some(first) if first.is_ascii_alphabetic() && name != "main" => name,
        _ => format!("m_{name}"),
    }
}
