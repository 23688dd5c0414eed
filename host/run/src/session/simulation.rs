//! [`Simulation`]: the equations of motion as the integrators see them, with samples, audit and memory between steps.

mod contacts;
mod creep;
mod entry_sizes;
mod floor;
mod frictions;
mod indeterminate;
mod latched;
mod levels;
mod margins;
mod memory;
mod part;
mod partners;
mod picture;
mod releases;
mod settle;
mod speeds;
mod state_sizes;
mod system;
mod unknowns;
mod watch;

pub(super) use self::contacts::Mode;
use self::contacts::Touch;
pub(super) use self::creep::Creep;
use self::entry_sizes::EntrySizes;
use self::floor::Floor;
pub(super) use self::latched::Jumped;
use self::latched::Latched;
pub(super) use self::levels::Pressed;
pub(super) use self::margins::Extremes;
use self::margins::Margins;
pub(super) use self::part::Part;
use self::partners::Partner;
use self::picture::Picture;
use self::state_sizes::StateSizes;
use self::unknowns::Tracked;
use self::watch::{RowValues, Turning};
use super::clocks::Clocks;
use super::guards::{Guarded, Watching};
use super::samplings::Rows;
use super::tier::Tier;
use crate::analysis::{AnalysisError, Assembly, Constraints, Counters, Formulation, Scales};
use crate::model::{Model, Thin};
use crate::plan::Layout;
use crate::program::{Equations, MachineError, Node, Used};
use crate::results::Audit;

/// What is known of the part of the work that is turned into heat.
#[derive(Clone, Copy, PartialEq)]
enum Heat {
    /// It is none.
    None,
    /// It is all of the work.
    All,
    /// Its power is integrated along the steps.
    Summed,
}

impl Heat {
    fn of(equations: &Equations) -> Self {
        match (equations.dissipation.is_empty(), equations.supplied.is_empty() && !is_driven(equations)) {
            (true, _) => Self::None,
            (false, true) => Self::All,
            (false, false) => Self::Summed,
        }
    }

    /// The powers that are turned into heat, where they are integrated.
    fn powers(self, formulation: &dyn Formulation, equations: &Equations, layout: &Layout) -> Option<Part> {
        (self == Self::Summed).then(|| Part::near(formulation, equations, &equations.dissipation, layout))
    }
}

/// The energies at accepted states, where the bodies are known anyway: in their coordinates, unless solutions are needed or the
/// formulation's own take fewer operations.
fn energy_of(formulation: &dyn Formulation, equations: &Equations, layout: &Layout) -> Part {
    let nodes = [equations.kinetic, equations.potential];
    let plain = Part::new(equations, &nodes, layout);
    let near = Part::near(formulation, equations, &nodes, layout);
    let operations = |part: &Part| part.evaluator.program().operations();
    if plain.needs_dynamics || operations(&near) < operations(&plain) { near } else { plain }
}

/// The energies of [`energy_of`] and the velocities of all bodies, six each, in the formulation's own coordinates, where these can
/// be had in them.
fn own_view(formulation: &dyn Formulation, equations: &Equations) -> Option<Part> {
    let mut nodes = vec![equations.kinetic, equations.potential];
    nodes.extend(equations.bodies.iter().flat_map(|body| body.v.into_iter().chain(body.w)));
    formulation.own_program(equations, &nodes).map(|evaluator| Part::of(evaluator, true))
}

/// Whether constraints depend on time and do work.
fn is_driven(equations: &Equations) -> bool {
    equations.rows.iter().any(|row| !equations.graph.is_zero(row.time))
}

/// An opaque instance that is notified of accepted steps.
struct Told {
    set: usize,
    instance: usize,
    inputs: Part,
}

/// Speeds at the start, as multiples of the slowest that counts, below which what follows may be round-off.
const NEAR_REST: f64 = 1e3;
/// Work of the forces in a scene at rest along its size, of which less is no motion: an error of a millionth of it, which the audit
/// lets pass, is what they do along 50 times the round-off of that size.
const OF_LOADS: f64 = 1e-8;

/// See the module documentation.
pub(super) struct Simulation<'a> {
    formulation: Box<dyn Formulation>,
    /// What errors of entries of the state before those of elements are compared with.
    sizes: EntrySizes,
    layout: Layout,
    tolerance: f64,
    scales: Scales,
    /// The state at the start, where the way from there counts; empty elsewhere.
    began: Vec<f64>,
    /// What errors of the states of elements are compared with.
    state_sizes: StateSizes,
    /// What of them is round-off.
    floor: Floor,
    references: Vec<f64>,
    /// Those of them that anything depends on ([`Equations::counted_angles`]): only they follow the motion.
    counted: Vec<usize>,
    /// How fast they turn.
    turning: Turning,
    /// Whether the motion depends on any of them.
    turns_act: bool,
    discrete: Vec<f64>,
    accept: Part,
    told: Vec<Told>,
    partners: Vec<Partner>,
    report: Part,
    energy: Part,
    /// What is looked at in every accepted state, where bodies need not be known for it.
    view: Option<Part>,
    /// How far the fastest body has turned since bodies were known last, rad.
    turned: f64,
    heat: Heat,
    /// Powers that are turned into heat, where they are integrated.
    powers: Option<Part>,
    /// Conditions at which the equations switch, where steps are to end there.
    switches: Option<Part>,
    /// Unilateral rows, if there are any.
    touch: Option<Touch>,
    /// Memories that jump at instants, if there are any.
    latched: Option<Latched>,
    /// What elements want looked at, if any do.
    margins: Option<Margins>,
    /// Internal unknowns, if there are any.
    unknowns: Option<Tracked>,
    /// What is watched throughout every step.
    guarded: Option<Guarded>,
    /// The same at a state, where ranges cannot be had: switches and functions, and turns.
    looks: [Option<Part>; 2],
    rows: Constraints,
    /// Their values alone, where rows are left out.
    values: Option<RowValues>,
    /// Whether some of them depend on time: then those left out may contradict the others for a moment.
    is_driven: bool,
    /// Joint and row of each of the rows of the scene.
    row_names: Vec<String>,
    audit: Audit,
    /// Accepted states so far.
    watched: u64,
    /// States refused because rows that were left out do not hold there.
    contradictions: u64,
    /// How often remedies had been called in at the last accepted state.
    remedies: u64,
    /// Share of the largest energy that moved by which a step with remedies may miss the balance of energies.
    energy_limit: f64,
    /// See [`Simulation::bound_corrections`].
    most_off: f64,
    /// Violations are looked at in one of so many.
    period: u64,
    /// Number of quantities that are reported; `report` has the energies behind them, to audit samples. Not where constraints
    /// are driven: error control does not see how their work grows, and between the ends of steps it is not known well enough.
    channels: usize,
    /// Bodies without rotation.
    particles: Vec<(usize, String)>,
    /// Axes of bodies about which nothing may turn them.
    thin: Vec<(usize, String, Thin)>,
    /// Largest kinetic energy so far, J.
    largest_kinetic: f64,
    /// Energies below this are round-off, J.
    least_energy: f64,
    sample_state: Vec<f64>,
    /// What is shown of a state besides, where somebody takes it.
    picture: Option<Picture>,
    /// Room for the inputs of the working form at a state.
    observed: Vec<f64>,
    samples: usize,
    /// Events that were reported so far.
    events: usize,
    /// How many there will be.
    samples_in_all: usize,
    rows_taken: Rows<'a>,
    row_right: Vec<f64>,
    /// The end of a step before it was brought to the constraints.
    before: Vec<f64>,
    /// What violated its rate there, see [`Simulation::project_end`].
    kink: Option<(f64, Option<usize>)>,
    /// Room for the velocities of all bodies.
    velocities: Vec<f64>,
    tier: Tier,
    /// Sizes of the last two steps, s.
    last_steps: [f64; 2],
    /// When elements sample.
    clocks: Clocks,
    /// Discrete states after a step, before they are taken.
    held: Vec<f64>,
    /// The last accepted time, s.
    now: f64,
}

impl<'a> Simulation<'a> {
    /// Prepares samples, audit and memory around a formulation. `channels` are the requested quantities.
    ///
    /// # Errors
    /// When the linear algebra refuses the model.
    pub(super) fn new(
        equations: &mut Equations,
        model: &Model,
        layout: &Layout,
        assembly: &Assembly,
        formulation: Box<dyn Formulation>,
        tolerance: f64,
        mut rows_taken: Rows<'a>,
    ) -> Result<Self, AnalysisError> {
        let mut nodes: Vec<Node> = equations.channels(model, layout);
        let is_driven = is_driven(equations);
        if !is_driven {
            nodes.extend([equations.kinetic, equations.potential]);
        }
        let report = Part::near(formulation.as_ref(), equations, &nodes, layout);
        let picture = rows_taken.sink().takes_pictures();
        let picture = picture.then(|| Picture::new(formulation.as_ref(), equations, model, layout));
        let counted = equations.counted_angles(model, layout);
        let mut after: Vec<Node> = counted.iter().map(|angle| equations.angles[*angle]).collect();
        after.extend(&equations.next_discrete);
        let told = equations.graph.calls.clone();
        let told = told
            .into_iter()
            .map(|call| Told {
                set: call.set,
                instance: call.instance as usize,
                inputs: Part::new(equations, &call.arguments, layout),
            })
            .collect();
        let all: Vec<usize> = (0..layout.rows).collect();
        let rows = Constraints::of_all(equations)?;
        let rows_in_force = rows.rows.len();
        let heat = Heat::of(equations);
        let mut simulation = Self {
            accept: Part::near(formulation.as_ref(), equations, &after, layout),
            energy: energy_of(formulation.as_ref(), equations, layout),
            view: own_view(formulation.as_ref(), equations),
            turned: 0.0,
            before: Vec::with_capacity(formulation.groups().len()),
            powers: heat.powers(formulation.as_ref(), equations, layout),
            heat,
            switches: None,
            touch: Touch::new(equations, model, layout, formulation.as_ref(), assembly.scales.length)?,
            latched: Latched::new(equations, model, layout, formulation.as_ref()),
            margins: Margins::new(equations, model, layout, formulation.as_ref()),
            unknowns: Tracked::new(equations, model, layout, formulation.as_ref()),
            guarded: None,
            looks: [None, None],
            report,
            told,
            partners: Partner::all(model, layout, formulation.as_ref()),
            is_driven,
            rows,
            values: None,
            row_names: all
                .iter()
                .map(|row| layout.element_of_row(*row))
                .map(|(e, k)| model.elements[e].row_name(k))
                .collect(),
            period: formulation.states_per_audit(),
            channels: model.channels.len(),
            sizes: EntrySizes::of(&formulation.groups()[..formulation.groups().len() - layout.states - 1]),
            formulation,
            tolerance,
            scales: assembly.scales,
            began: Vec::new(),
            state_sizes: StateSizes::new(model, layout),
            floor: Floor::new(equations, model, layout),
            references: assembly.references.clone(),
            turns_act: !counted.is_empty() && equations.turns_act(layout),
            counted,
            turning: Turning::default(),
            clocks: Clocks::of(model, layout),
            held: Vec::new(),
            discrete: assembly.discrete.clone(),
            audit: Audit::default(),
            watched: 0,
            contradictions: 0,
            remedies: 0,
            energy_limit: f64::INFINITY,
            most_off: f64::INFINITY,
            particles: particles(model),
            thin: thin(model),
            largest_kinetic: 0.0,
            least_energy: 0.0,
            sample_state: Vec::new(),
            picture,
            observed: Vec::with_capacity(layout.inputs()),
            samples: 0,
            events: 0,
            samples_in_all: 0,
            rows_taken,
            row_right: vec![0.0; rows_in_force],
            kink: None,
            velocities: Vec::with_capacity(layout.velocities()),
            tier: Tier::fixed(),
            last_steps: [0.0; 2],
            now: 0.0,
            layout: layout.clone(),
        };
        simulation.formulation.set_discrete(&assembly.references, &assembly.discrete);
        Ok(simulation)
    }

    /// The state at the start; takes the sizes of first accelerations. [`Simulation::watch`] follows.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn start(&mut self, t: f64, assembly: &Assembly) -> Result<Vec<f64>, AnalysisError> {
        self.now = t;
        let mut state = vec![0.0; self.formulation.groups().len()];
        self.formulation.state_of(&assembly.working, &mut state);
        self.sample_state = state.clone();
        if self.scales.extent < self.scales.length {
            self.began = state.clone();
        }
        self.sample_at_start(t, &state)?;
        let accelerations = match self.formulation.accelerations(t, &state)? {
            Some(found) => found,
            None => {
                let slot = self.layout.acceleration_slot();
                self.formulation.observe(t, &state, true)?.inputs[slot..slot + self.layout.velocities()].to_vec()
            }
        };
        self.scales.anticipate(&accelerations);
        self.formulation.next_step(t, &state)?;
        Ok(state)
    }

    /// When elements sample; set to the start of the run.
    pub(super) fn clocks(&mut self) -> &mut Clocks {
        &mut self.clocks
    }

    /// Sizes typical of what moves here, so far.
    pub(super) fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Takes speeds that move nothing in this duration, s, for round-off, and so their energies, of the lightest body, and what noise of
    /// accelerations makes of velocities within a step ([`Floor::measure`]). Where the state, at the start `t`, is at rest, errors of
    /// velocities count as round-off by the forces that cancel in it ([`Floor::balance`]), and errors of energies by what these do along
    /// round-off of positions.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn anticipate_rest(
        &mut self,
        equations: &Equations,
        model: &Model,
        (t, state): (f64, &[f64]),
        duration: f64,
    ) -> Result<(), AnalysisError> {
        let slowest = self.scales.rest_speed(duration);
        let (mut load, mut shaken) = (0.0, [0.0; 2]);
        let length = self.scales.length_scale();
        let is_slow = |scales: &Scales| scales.speed.max(scales.spin * length) <= NEAR_REST * slowest;
        let rests = is_slow(&self.scales);
        let traces = self.formulation.traces();
        if rests || self.touch.is_some() && is_slow(&self.speeds_at(t, state)?) {
            let whole = (duration, length);
            load = self.floor.largest_load(equations, model, (t, state), whole, self.formulation.as_mut())?;
        }
        if rests {
            // Where there is no answer, the first step will fail, too.
            shaken = self.floor.shaken((t, state), self.formulation.as_mut()).unwrap_or(shaken);
        }
        self.scales.anticipate_rest(duration);
        let sizes = (duration, self.scales.far, self.scales.speed_scale());
        self.floor.measure((t, state), sizes, self.formulation.as_mut());
        self.formulation.forget_since(&traces);
        if rests {
            self.floor.balance(load, shaken, model);
        }
        let lightest = model.bodies.iter().map(|body| body.mass).reduce(f64::min).unwrap_or(0.0);
        self.least_energy = (0.5 * lightest * slowest.powi(2)).max(OF_LOADS * load * length);
        self.audit.count_from(self.least_energy);
        Ok(())
    }

    /// Of the velocities at a state alone: rows that may hold it are open still, and accelerations tell nothing.
    fn speeds_at(&mut self, t: f64, state: &[f64]) -> Result<Scales, AnalysisError> {
        let velocities = self.layout.velocities_in(self.formulation.observe(t, state, false)?.inputs);
        let mut scales = Scales { speed: 0.0, spin: 0.0, ..self.scales };
        scales.grow_to(&velocities);
        Ok(scales)
    }

    /// Judges errors and violations by the sizes of a larger scene.
    pub(super) fn widen_scales(&mut self, whole: &Scales) {
        self.scales.widen(whole);
    }

    /// Offers functions that change their sign where steps had better end.
    pub(super) fn end_steps_at(&mut self, equations: &Equations, conditions: &[Node]) {
        if !conditions.is_empty() {
            self.switches = Some(Part::near(self.formulation.as_ref(), equations, conditions, &self.layout));
        }
    }

    /// Watches what may happen within a step. Gives whether there is something that cannot be watched: what only an opaque element
    /// knows, or what depends on the solution of the equations of motion.
    pub(super) fn guard(&mut self, equations: &mut Equations, watching: &Watching) -> bool {
        let guarded = watching.guard(equations, &self.layout, self.formulation.as_ref());
        let bounded = guarded.is_partial || !equations.graph.calls.is_empty();
        let sets = [(&guarded.guards.within, &guarded.within), (&guarded.guards.turns, &guarded.turns)];
        for (look, (set, bank)) in self.looks.iter_mut().zip(sets) {
            if !set.proved && !bank.nodes.is_empty() {
                *look = Some(Part::near(self.formulation.as_ref(), equations, &bank.nodes, &self.layout));
            }
        }
        self.guarded = Some(guarded);
        bounded
    }

    /// Solves for accelerations and reactions at every sample, asked for or not.
    pub(super) fn solve_at_samples(&mut self) {
        self.report.needs_dynamics = true;
    }

    /// Refuses steps in which remedies acted and that miss the balance of energies by more than this share of what moved.
    pub(super) fn bound_energy_of_steps(&mut self, limit: f64) {
        self.energy_limit = limit;
    }

    /// Takes positions that are off by more than this share of the scene's size for rows that jump, not for errors of steps, and
    /// velocities that are off by more than this share of theirs for rows with a kink.
    pub(super) fn bound_corrections(&mut self, share: f64) {
        self.most_off = share;
        self.formulation.bound_corrections(share);
    }

    /// Looks at all bodies and the violation of all rows in every accepted state.
    pub(super) fn watch_every_state(&mut self) {
        (self.period, self.view) = (1, None);
    }

    /// Lets programs be compiled during the run, of which samples are taken up to this number.
    pub(super) fn set_tier(&mut self, tier: Tier, samples: usize) {
        (self.tier, self.samples_in_all) = (tier, samples);
    }

    /// Compiles what is sure to pay, where nothing has been looked at yet; to be called before steps from time `t`.
    pub(super) fn compile_hot(&mut self, t: f64) {
        let mut tier = std::mem::take(&mut self.tier);
        let samples = self.samples_in_all.saturating_sub(self.samples);
        tier.begin(t, samples, || self.programs());
        self.tier = tier;
    }

    /// Installs the code that other runs share, for a run from time `t`.
    pub(super) fn take_shared_code(&mut self, t: f64) {
        self.with_programs(|tier, programs| tier.take_shared(t, programs));
    }

    /// Leaves code, and how often programs were run, to runs that share it.
    pub(super) fn leave_code(&mut self) {
        if self.tier.shares() {
            self.with_programs(Tier::leave);
        }
    }

    fn with_programs<T>(&mut self, act: impl FnOnce(&mut Tier, Vec<Used<'_>>) -> T) -> T {
        let mut tier = std::mem::take(&mut self.tier);
        let result = act(&mut tier, self.programs());
        self.tier = tier;
        result
    }

    /// Compiles the programs now, for a run from time `t`.
    ///
    /// # Errors
    /// [`MachineError`] when there is no machine code to be had.
    pub(super) fn compile_now(&mut self, t: f64) -> Result<(), MachineError> {
        self.with_programs(|tier, programs| tier.compile_now(t, programs))
    }

    /// The references of the angles that are counted, ascending.
    #[must_use]
    pub(super) fn counted_angles(&self) -> &[usize] {
        &self.counted
    }

    /// The compiling of programs.
    #[must_use]
    pub(super) fn tier(&self) -> &Tier {
        &self.tier
    }

    /// Everything that is run again and again.
    fn programs(&mut self) -> Vec<Used<'_>> {
        let mut list = self.formulation.programs();
        list.push(self.rows.used(false));
        list.extend(self.values.iter_mut().flat_map(RowValues::used).map(Used::by_steps));
        match &mut self.view {
            Some(view) => list.extend(view.used().map(Used::by_steps).chain(self.energy.used())),
            None => list.extend(self.energy.used().map(Used::by_steps)),
        }
        list.extend(self.powers.iter_mut().flat_map(Part::used).map(Used::by_steps));
        list.extend(self.accept.used().map(Used::by_steps));
        list.extend(self.report.used().map(Used::by_samples));
        list.extend(self.picture.iter_mut().flat_map(Picture::used).map(Used::by_samples));
        list.extend(self.told.iter_mut().flat_map(|told| told.inputs.used()));
        list.extend(self.margins.iter_mut().flat_map(Margins::used).map(Used::by_steps));
        list.extend(self.unknowns.iter_mut().flat_map(Tracked::used));
        list.extend(self.touch.iter_mut().flat_map(Touch::used));
        list.extend(self.latched.iter_mut().flat_map(Latched::used));
        list.extend(
            self.switches.iter_mut().chain(self.looks.iter_mut().flatten()).map(|part| part.evaluator.used(true)),
        );
        list
    }

    /// The audit so far.
    #[must_use]
    pub(super) fn audit(&self) -> &Audit {
        &self.audit
    }

    /// Work done so far.
    #[must_use]
    pub(super) fn counters(&self) -> Counters {
        let mut counters = self.formulation.counters();
        if let Some(touch) = &self.touch {
            counters = counters + touch.counters();
        }
        counters.contradictions = self.contradictions;
        counters
    }

    /// The inputs of programs in the working form, accelerations and multipliers left as they are.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn working_inputs(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        Ok(self.formulation.observe(t, state, false)?.inputs.to_vec())
    }

    /// The same with accelerations and multipliers.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn solved_inputs(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        Ok(self.formulation.observe(t, state, true)?.inputs.to_vec())
    }

    /// The formulation, for its name.
    #[must_use]
    pub(super) fn formulation(&self) -> &dyn Formulation {
        self.formulation.as_ref()
    }
}

fn particles(model: &Model) -> Vec<(usize, String)> {
    let bodies = model.bodies.iter().enumerate();
    bodies.filter(|(_, body)| body.particle).map(|(index, body)| (index, body.name.clone())).collect()
}

fn thin(model: &Model) -> Vec<(usize, String, Thin)> {
    let bodies = model.bodies.iter().enumerate();
    bodies.flat_map(|(index, body)| body.thin.iter().map(move |thin| (index, body.name.clone(), *thin))).collect()
}
