//! [`Session::open`]: everything before time starts.

use std::path::Path;
use std::time::Instant;

use super::checkpoint::Origin;
use super::checks::missing_tables;
use super::decide::{decide, determinacy};
use super::error::SessionError;
use super::libraries::load_libraries;
use super::modes::blind;
use super::objections::{
    assembly_error, assembly_warnings, crosswise_warnings, distance_warning, locked_warnings, place_of_element,
    reaction_warnings, refuse_solved_limit, time_warning,
};
use super::opened::{Beginning, Session};
use super::options::{ISLANDS, RunOptions, STARTS, one_of};
use super::picture::check_meshes;
use super::prune::{allowed, is_determined};
use super::repeats::refuse_whims;
use crate::analysis::{self, Assembly, AssemblyError, assemble, assemble_from, idle_axes};
use crate::catalog::Catalog;
use crate::diagnostics::{Diagnostic, Source, codes};
use crate::model::{Model, resolve};
use crate::plan::{Determinacy, Layout, SpanningTree};
use crate::program::{Equations, Form};
use crate::scene::{Document, Rejected, Scene, parse, read};

/// Ratio of pivots below which constraints of full rank may be next to a singular position.
const NEAR: f64 = 0.01;
/// They are if the ratio is below this share of what it is where the motion goes.
const NEAR_SHARE: f64 = 0.5;
/// Bodies from which on trees do without equations that only other coordinates than those of joints need.
const MANY: usize = 500;
/// Nodes from which on a graph does not keep the table that nodes are looked up in.
const LARGE: usize = 100_000;
/// Numbers that results may have, all columns together: they stay in memory during the run, 8 bytes each.
const MOST_NUMBERS: usize = 100_000_000;
/// Times that an element may sample in a run.
const MOST_SAMPLINGS: f64 = 1e7;

impl Session {
    /// Reads a scene file and prepares everything.
    ///
    /// # Errors
    /// Mistakes in the scene, missing or broken libraries, joints that cannot be assembled.
    pub fn open(path: &Path, options: &RunOptions) -> Result<Self, SessionError> {
        let started = Instant::now();
        Self::of_file(path, read(path, &options.overrides), options, started)
    }

    /// The same with a text in place of the file's content, as an editor has it: `path` is where the file would be, and what
    /// files and libraries that the text names are looked for from.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn open_text(path: &Path, text: String, options: &RunOptions) -> Result<Self, SessionError> {
        let started = Instant::now();
        let source = Source::new(path.display().to_string(), text);
        Self::of_file(path, parse(source, &options.overrides), options, started)
    }

    /// The same with a file that was read before; `path` is where.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn of_document(path: &Path, document: &Document, options: &RunOptions) -> Result<Self, SessionError> {
        let started = Instant::now();
        Self::of_file(path, document.clone().scene(&options.overrides), options, started)
    }

    fn of_file(
        path: &Path,
        read: Result<(Scene, Vec<Diagnostic>), Box<Rejected>>,
        options: &RunOptions,
        started: Instant,
    ) -> Result<Self, SessionError> {
        let (scene, mut warnings) = read.map_err(|rejected| *rejected)?;
        let catalog = load_libraries(&scene, path, options)?;
        warnings.extend(catalog.warnings().iter().cloned());
        let mut session = Self::of_scene(scene, warnings, &catalog, options, None, started)?;
        session.origin = Some(Origin::new(path, options));
        Ok(session)
    }

    /// Prepares a scene with a catalog at hand.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub fn with_catalog(
        scene: Scene,
        warnings: Vec<Diagnostic>,
        catalog: &Catalog,
        options: &RunOptions,
    ) -> Result<Self, SessionError> {
        Self::of_scene(scene, warnings, catalog, options, None, Instant::now())
    }

    /// Opens a scene; `start` is an assembled state of it and its time, s, where it does not begin at its start.
    pub(super) fn of_scene(
        scene: Scene,
        warnings: Vec<Diagnostic>,
        catalog: &Catalog,
        options: &RunOptions,
        start: Option<(f64, Assembly)>,
        started: Instant,
    ) -> Result<Self, SessionError> {
        let settles = one_of("start", scene.simulation.start.as_ref(), &STARTS, &scene)?;
        if start.is_some() || !settles {
            return Self::of_start(scene, warnings, catalog, options, start, started);
        }
        let looked_at = RunOptions { runs_only: false, ..options.clone() };
        let given = Self::of_start(scene.clone(), Vec::new(), catalog, &looked_at, None, started)?;
        let (found, mut notes) = given.settled()?;
        notes.splice(0..0, warnings);
        Self::of_start(scene, notes, catalog, options, Some((given.begins.time, found)), started)
    }

    /// The equilibrium that is found from the start of the scene, with its velocities, and what must be said about it.
    fn settled(&self) -> Result<(Assembly, Vec<Diagnostic>), SessionError> {
        let Some(find) = self.options.equilibrium else {
            let message = "this program does not look for the equilibrium that the scene starts at";
            let help =
                "remove `start` from `[simulation]`; a program that uses the library gives `RunOptions::equilibrium`";
            let span = self.scene.simulation.start.as_ref().map_or(0..0, |word| word.span.clone());
            let diagnostic = Diagnostic::error(codes::NO_EQUILIBRIUM, message).at(span, "").help(help);
            return Err(SessionError::one(&self.scene.source, diagnostic));
        };
        let (state, notes) = find(self)?;
        let place = Some((state.working.as_slice(), state.references.as_slice()));
        let found = assemble_from(&self.equations, &self.model, &self.plan.layout, self.begins.time, place);
        Ok((found.map_err(|error| assembly_error(&error, &self.scene, &self.model))?, notes))
    }

    /// [`Session::of_scene`] at the start that the scene gives, or at `start`, whatever the scene says of an equilibrium.
    fn of_start(
        scene: Scene,
        mut warnings: Vec<Diagnostic>,
        catalog: &Catalog,
        options: &RunOptions,
        start: Option<(f64, Assembly)>,
        started: Instant,
    ) -> Result<Self, SessionError> {
        let pruning = allowed(&scene)?;
        let apart = apart(&scene)?;
        check_meshes(&scene)?;
        let refused = |diagnostics| SessionError::new(&scene.source, diagnostics);
        let (mut model, notes) = resolve(&scene, catalog, options.thoroughly).map_err(refused)?;
        warnings.extend(notes);
        if let Some(further) = options.further_channels {
            model.channels.extend(further(&model));
        }
        refuse_endless_results(&scene, &model)?;
        refuse_endless_sampling(&scene, &model)?;
        let load_time = started.elapsed().as_secs_f64();
        let compiling = Instant::now();
        let layout = Layout::new(&model);
        let for_tree = options.runs_only
            && model.bodies.len() >= MANY
            && SpanningTree::new(&model, |_| true).closes_no_loop(&layout);
        let mut equations = written(&model, &layout, for_tree);
        refuse_solved_limit(&scene, &model, &equations, &layout)?;
        let refuse = |model: &Model, error: AssemblyError| assembly_error(&error, &scene, model);
        let t = start.as_ref().map_or(scene.simulation.t_start, |(t, _)| *t);
        let assembled = |equations: &Equations, model: &Model| match &start {
            Some((_, start)) => Ok(start.clone()),
            None => assemble(equations, model, &layout, t).map_err(|error| refuse(model, error)),
        };
        let mut assembly = assembled(&equations, &model)?;
        let idle = idle_axes(&equations, &model, &layout, t, &assembly).map_err(|error| refuse(&model, error))?;
        if !idle.is_empty() {
            idle.iter().for_each(|(body, axis)| model.bodies[*body].calm(*axis));
            equations = written(&model, &layout, for_tree);
            assembly = assembled(&equations, &model)?;
        }
        refuse_whims(&scene, &model, &equations.graph, &analysis::start_inputs(&layout, t, &assembly))?;
        warnings.extend(assembly_warnings(&assembly, &scene, &model)?);
        warnings.extend(super::started::warning(&assembly, &scene));
        warnings.extend(distance_warning(&assembly, &scene, &model));
        warnings.extend(time_warning(&scene));
        warnings.extend(missing_tables(&scene));
        let mut at_start = decide(&scene, &model, &equations, &layout, (t, &assembly), pruning.row_choice)?;
        let blind = blind(&equations, at_start.redundant_rows.iter().map(|row| row.row));
        let chooses = pruning.row_choice && !blind;
        if blind {
            at_start = decide(&scene, &model, &equations, &layout, (t, &assembly), false)?;
        }
        let mut ahead = None;
        // Trees whose rows are beyond doubt have no ratio.
        let near = (f64::MIN_POSITIVE..NEAR).contains(&at_start.health.smallest_pivot_ratio);
        if chooses && (near || !at_start.redundant_rows.is_empty()) {
            equations.write_gammas();
            let duration = scene.simulation.t_end - t;
            ahead = analysis::ahead(&equations, &model, &layout, &assembly, t, duration);
        }
        let determinacy_at =
            |(t, place): &(f64, Assembly)| determinacy(&scene, &model, &equations, &layout, (*t, place)).ok();
        let there = ahead.as_ref().and_then(determinacy_at);
        if let Some(there) = &there {
            at_start.join(there);
        }
        // In a singular position more rows depend on each other than where the motion goes; next to one they nearly do.
        let better = |there: &Determinacy| {
            let (here, there) = (at_start.health, there.health);
            let nearly = there.rank == here.rank && here.smallest_pivot_ratio < NEAR_SHARE * there.smallest_pivot_ratio;
            there.rank > here.rank || nearly
        };
        let decide_at =
            |(t, place): &(f64, Assembly)| decide(&scene, &model, &equations, &layout, (*t, place), true).ok();
        let there = ahead.as_ref().filter(|_| there.is_some_and(|there| better(&there))).and_then(decide_at);
        let ahead = ahead.filter(|_| there.is_some());
        let plan = there.unwrap_or(at_start);
        let determined = is_determined(&scene, &model, &equations, &plan, pruning);
        warnings.extend(locked_warnings(&plan, &model, &scene));
        warnings.extend(crosswise_warnings(&plan, &model, &scene));
        warnings.extend(reaction_warnings(&plan, &model, &scene));
        let mut session = Self {
            warnings,
            libraries: catalog.libraries().chain(&model.fmus).cloned().collect(),
            model,
            equations,
            plan,
            assembly,
            ahead,
            pruning,
            determined,
            options: options.clone(),
            catalog: catalog.clone(),
            apart,
            begins: Beginning { time: t, sampled_from: t, state: None, checkpoint: None },
            origin: None,
            shown: None,
            load_time,
            compile_time: 0.0,
            scene,
        };
        // A formulation that the scene does not allow is refused here.
        if for_tree || session.scene.simulation.formulation.is_some() {
            let (tree, _) = session.choose_tree()?;
            if !tree.is_some_and(|tree| tree.closes_no_loop(&session.plan.layout)) {
                session.equations.write_gammas();
            }
        }
        session.compile_time = compiling.elapsed().as_secs_f64();
        Ok(session)
    }
}

/// The equations of a model. Large ones are there with the channels, which is all that most runs ask for: they do without the table
/// of known nodes, before anything is computed. `for_tree`: see [`Equations::build_for_tree`].
fn written(model: &Model, layout: &Layout, for_tree: bool) -> Equations {
    let mut equations = match for_tree {
        true => Equations::build_for_tree(model, layout),
        false => Equations::build(model, layout, Form::Working),
    };
    if equations.graph.len() > LARGE {
        equations.channels(model, layout);
        equations.graph.rest();
    }
    equations
}

/// Whether islands take steps of their own, by `islands` of `[simulation]`; nothing where that is left to the program.
fn apart(scene: &Scene) -> Result<Option<bool>, SessionError> {
    one_of("islands", scene.simulation.islands.as_ref(), &ISLANDS, scene)
}

/// Results that do not fit into memory are refused before anything is computed.
fn refuse_endless_results(scene: &Scene, model: &Model) -> Result<(), SessionError> {
    let (samples, columns) = (scene.simulation.sample_count(), model.channels.len() + 1);
    if samples.saturating_mul(columns) <= MOST_NUMBERS {
        return Ok(());
    }
    let message =
        format!("{samples} samples of {columns} columns are asked for, at most {MOST_NUMBERS:e} numbers are kept");
    let diagnostic =
        Diagnostic::error(codes::OUT_OF_RANGE, message).help("give a longer `output_step`, or fewer outputs");
    Err(SessionError::one(&scene.source, diagnostic))
}

/// Elements that sample more often than any run takes steps: each sample ends one.
fn refuse_endless_sampling(scene: &Scene, model: &Model) -> Result<(), SessionError> {
    let length = scene.simulation.t_end - scene.simulation.t_start;
    for element in &model.elements {
        let Some(number) = element.recording.sample_period().map(|period| length / period) else { continue };
        if number <= MOST_SAMPLINGS {
            continue;
        }
        let message =
            format!("`{}` samples {number:.1e} times, at most {MOST_SAMPLINGS:.0e} are possible", element.name);
        let place = place_of_element(scene, &element.name);
        let diagnostic =
            Diagnostic::error(codes::OUT_OF_RANGE, message).at(place, "its period is too short for the run");
        return Err(SessionError::one(&scene.source, diagnostic.help("give it a longer period; check its unit")));
    }
    Ok(())
}
