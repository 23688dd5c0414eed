//! [`Part`]: islands of a scene, each integrated as a scene of its own with its own steps, and their results put together.
//!
//! Bodies and elements belong to one island if they are connected: by an element, a signal, a reaction that something depends
//! on, or an output that names both. What is not connected cannot influence each other, so that nothing is lost; results are
//! those of separate runs bit by bit.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::error::SessionError;
use super::open::Session;
use super::restart::Restart;
use super::run::{DEFAULT_TOLERANCE, RunReport, Samplings};
use crate::model::{Axes, Channel, Instance, Model, Quantity, Source};
use crate::plan::Layout;
use crate::results::{Audit, CheckResult, ResultsError, Status, Summary};

/// An island.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Part {
    /// Its bodies, ascending.
    pub(super) bodies: Vec<usize>,
    /// Its elements, ascending.
    pub(super) elements: Vec<usize>,
    /// The channels that it has a share in, ascending: its own, and energies of the whole scene.
    pub(super) channels: Vec<usize>,
}

/// The islands of a model; one or none where it cannot be taken apart.
pub(super) fn parts(model: &Model) -> Vec<Part> {
    let bodies = model.bodies.len();
    // Opaque instances are evaluated together, set by set.
    if bodies == 0 || model.elements.iter().any(|element| element.class.opaque) {
        return Vec::new();
    }
    let mut parent: Vec<usize> = (0..bodies + model.elements.len()).collect();
    for (index, element) in model.elements.iter().enumerate() {
        let mut joined: Vec<usize> = element.markers.iter().filter_map(|marker| marker.body).collect();
        joined.extend(element.joints.iter().map(|joint| bodies + joint));
        for source in &element.inputs {
            let Source::Quantity(quantity) = source else { continue };
            let Some(named) = named(quantity, bodies) else { return Vec::new() };
            joined.extend(named);
        }
        // Whatever hangs on nothing goes with the first body.
        let alone = joined.is_empty() && !is_named(model, index);
        join(&mut parent, bodies + index, if alone { vec![0] } else { joined });
    }
    for channel in &model.channels {
        if let Some(named) = named(&channel.quantity, bodies)
            && let Some((first, others)) = named.split_first()
        {
            join(&mut parent, *first, others.to_vec());
        }
    }
    let mut parts: Vec<Part> = Vec::new();
    let mut part_of = vec![None; parent.len()];
    for node in 0..parent.len() {
        let place = *part_of[root(&parent, node)].get_or_insert_with(|| {
            parts.push(Part::default());
            parts.len() - 1
        });
        if node < bodies {
            parts[place].bodies.push(node);
        } else {
            parts[place].elements.push(node - bodies);
        }
    }
    // Signals among control elements that move nothing.
    if parts.iter().any(|part| part.bodies.is_empty()) {
        return Vec::new();
    }
    for (k, channel) in model.channels.iter().enumerate() {
        match named(&channel.quantity, bodies).and_then(|named| named.first().copied()) {
            Some(node) => {
                let place = part_of[root(&parent, node)].unwrap_or(0);
                parts[place].channels.push(k);
            }
            None => parts.iter_mut().for_each(|part| part.channels.push(k)),
        }
    }
    parts
}

fn root(parent: &[usize], mut node: usize) -> usize {
    while parent[node] != node {
        node = parent[node];
    }
    node
}

fn join(parent: &mut [usize], one: usize, others: Vec<usize>) {
    for other in others {
        let (a, b) = (root(parent, one), root(parent, other));
        parent[a.max(b)] = a.min(b);
    }
}

/// Whether another element takes its signals or reactions.
fn is_named(model: &Model, index: usize) -> bool {
    let bodies = model.bodies.len();
    model.elements.iter().any(|element| {
        let takes = |source: &Source| match source {
            Source::Constant(_) => false,
            Source::Quantity(quantity) => named(quantity, bodies).is_some_and(|list| list.contains(&(bodies + index))),
        };
        element.joints.contains(&index) || element.inputs.iter().any(takes)
    })
}

/// Bodies, and elements behind them, that a quantity names; `None`: it is a sum over the whole scene.
fn named(quantity: &Quantity, bodies: usize) -> Option<Vec<usize>> {
    let with = |node: usize, axes: &Axes| match axes {
        Axes::Ground => vec![node],
        Axes::Body(body) => vec![node, *body],
    };
    Some(match quantity {
        Quantity::Point { body, axes, .. } | Quantity::Angular { body, axes, .. } => with(*body, axes),
        Quantity::EulerParameter { body, .. } | Quantity::Balance { body, .. } => vec![*body],
        Quantity::Coordinate { element, .. } | Quantity::Value { element, .. } => vec![bodies + element],
        Quantity::Load { element, axes, .. } => with(bodies + element, axes),
        Quantity::KineticEnergy | Quantity::PotentialEnergy | Quantity::TotalEnergy => return None,
    })
}

impl Part {
    /// The island as a model. Channels are in SI, so that nothing is converted twice.
    fn model(&self, whole: &Model) -> Model {
        Model {
            bodies: self.bodies.iter().map(|body| whole.bodies[*body].clone()).collect(),
            elements: self.elements.iter().map(|element| self.instance(&whole.elements[*element])).collect(),
            sets: Vec::new(),
            gravity: whole.gravity,
            channels: self
                .channels
                .iter()
                .map(|k| {
                    let channel = &whole.channels[*k];
                    Channel { quantity: self.quantity(&channel.quantity), factor: 1.0, ..channel.clone() }
                })
                .collect(),
        }
    }

    fn body(&self, body: usize) -> usize {
        self.bodies.binary_search(&body).expect("an island has all bodies that it names")
    }

    fn element(&self, element: usize) -> usize {
        self.elements.binary_search(&element).expect("an island has all elements that it names")
    }

    fn instance(&self, of: &Instance) -> Instance {
        let mut own = of.clone();
        own.markers.iter_mut().for_each(|marker| marker.body = marker.body.map(|body| self.body(body)));
        own.joints.iter_mut().for_each(|joint| *joint = self.element(*joint));
        for source in &mut own.inputs {
            if let Source::Quantity(quantity) = source {
                *quantity = self.quantity(quantity);
            }
        }
        own
    }

    fn quantity(&self, of: &Quantity) -> Quantity {
        let mut own = of.clone();
        match &mut own {
            Quantity::Point { body, axes, .. } | Quantity::Angular { body, axes, .. } => {
                *body = self.body(*body);
                self.turn(axes);
            }
            Quantity::EulerParameter { body, .. } | Quantity::Balance { body, .. } => *body = self.body(*body),
            Quantity::Coordinate { element, .. } | Quantity::Value { element, .. } => *element = self.element(*element),
            Quantity::Load { element, axes, .. } => {
                *element = self.element(*element);
                self.turn(axes);
            }
            Quantity::KineticEnergy | Quantity::PotentialEnergy | Quantity::TotalEnergy => {}
        }
        own
    }

    fn turn(&self, axes: &mut Axes) {
        if let Axes::Body(body) = axes {
            *body = self.body(*body);
        }
    }

    /// Its share of the state of the whole scene.
    fn share(&self, own: &Model, whole: &Session) -> Restart {
        let layout = &whole.plan.layout;
        let (assembly, states) = (&whole.assembly, 13 * layout.bodies);
        let mut working: Vec<f64> =
            self.bodies.iter().flat_map(|body| &assembly.working[13 * body..13 * (body + 1)]).copied().collect();
        let (mut references, mut discrete) = (Vec::new(), Vec::new());
        for element in &self.elements {
            let [s, r, d] = slices(layout, *element);
            working.extend(&assembly.working[states + s.start..states + s.end]);
            references.extend(&assembly.references[r]);
            discrete.extend(&assembly.discrete[d]);
        }
        working.push(0.0);
        Restart::new(own, whole.scene.simulation.t_start, working, &references, &discrete)
    }

    /// Writes its end into that of the whole scene.
    fn give_back(&self, end: &Restart, layout: &Layout, whole: &mut Restart) {
        for (k, body) in self.bodies.iter().enumerate() {
            whole.working[13 * body..13 * (body + 1)].copy_from_slice(&end.working[13 * k..13 * (k + 1)]);
        }
        let (mut s, mut r, mut d) = (13 * self.bodies.len(), 0, 0);
        let states = 13 * layout.bodies;
        for element in &self.elements {
            let [own_s, own_r, own_d] = slices(layout, *element);
            let counts = [own_s.len(), own_r.len(), own_d.len()];
            let to = states + own_s.start..states + own_s.end;
            whole.working[to].copy_from_slice(&end.working[s..s + counts[0]]);
            whole.references[own_r].copy_from_slice(&end.references[r..r + counts[1]]);
            whole.discrete[own_d].copy_from_slice(&end.discrete[d..d + counts[2]]);
            (s, r, d) = (s + counts[0], r + counts[1], d + counts[2]);
        }
        if let (Some(work), Some(own)) = (whole.working.last_mut(), end.working.last()) {
            *work += own;
        }
    }
}

/// Continuous states, references and discrete states of an element.
fn slices(layout: &Layout, element: usize) -> [std::ops::Range<usize>; 3] {
    let range = |at: &[usize], end: usize| at[element]..at.get(element + 1).copied().unwrap_or(end);
    [
        range(&layout.state_at, layout.states),
        range(&layout.reference_at, layout.references),
        range(&layout.discrete_at, layout.discrete),
    ]
}

impl Session {
    /// The islands as sessions of their own.
    ///
    /// # Errors
    /// As for [`Session::open`]; whatever is wrong with an island is wrong with the whole scene, and told there first.
    pub(super) fn apart(&self) -> Result<Vec<Session>, SessionError> {
        let mut sessions = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let mut scene = self.scene.clone();
            scene.checks.clear();
            scene.figures.clear();
            let model = part.model(&self.model);
            let libraries = Vec::new();
            let mut own = Session::of_model(scene, model, Vec::new(), libraries, &self.options, self.pruning, 0.0)?;
            if self.goes_on {
                own.go_on_from(part.share(&own.model, self))?;
            }
            sessions.push(own);
        }
        Ok(sessions)
    }

    /// Runs every island as a scene of its own.
    pub(super) fn run_apart(
        self,
        folder: Option<&Path>,
        mut progress: Box<dyn FnMut(f64) + '_>,
        stop: &Arc<AtomicBool>,
    ) -> Result<RunReport, SessionError> {
        let started = Instant::now();
        let sessions = self.apart()?;
        let start = self.summary("", "", self.scene.simulation.tolerance.unwrap_or(DEFAULT_TOLERANCE));
        let mut samplings = self.samplings(folder, &start)?;
        let count = sessions.len() as f64;
        let mut reports = Vec::with_capacity(sessions.len());
        for (k, session) in sessions.into_iter().enumerate() {
            let told = |share: f64| progress((k as f64 + share) / count);
            reports.push(session.run(None, Box::new(told), stop)?);
        }
        let rows = reports.iter().map(|report| report.times.len()).min().unwrap_or(0);
        let mut values = vec![0.0; self.model.channels.len()];
        for row in 0..rows {
            values.fill(0.0);
            for (part, report) in self.parts.iter().zip(&reports) {
                for (channel, column) in part.channels.iter().zip(&report.columns) {
                    values[*channel] += column[row];
                }
            }
            if let Err(error) = samplings.take(row, &values) {
                let cause = samplings.error.take().unwrap_or_else(|| ResultsError::write(Path::new(""), error));
                return Err(self.files_error(&cause));
            }
        }
        let mut summary = self.summary_of_parts(&reports);
        summary.rows = rows as u64;
        summary.figures = self.figures(&samplings);
        let checks = self.checks(&samplings.taken, &samplings.columns);
        summary.checks = checks.iter().map(CheckResult::without_samples).collect();
        summary.wall_time_s = self.load_time + self.compile_time + started.elapsed().as_secs_f64();
        let end = self.end_of_parts(&reports);
        if let Some(open) = samplings.folder.take() {
            open.finish(&summary).map_err(|e| self.files_error(&e))?;
            if let (Some(path), Some(end)) = (folder, &end) {
                end.write(path).map_err(|e| self.files_error(&e))?;
            }
        }
        let Samplings { taken: times, columns, channels, .. } = samplings;
        Ok(RunReport { summary, times, columns, channels, checks, end })
    }

    /// The state at the end, if every island has reached it.
    fn end_of_parts(&self, reports: &[RunReport]) -> Option<Restart> {
        let time = reports.first()?.end.as_ref()?.time;
        let working = vec![0.0; self.assembly.working.len()];
        let mut whole = Restart::new(&self.model, time, working, &self.assembly.references, &self.assembly.discrete);
        for (part, report) in self.parts.iter().zip(reports) {
            let end = report.end.as_ref().filter(|end| end.time == time)?;
            part.give_back(end, &self.plan.layout, &mut whole);
        }
        Some(whole)
    }

    /// Work added up; of the audit the worst; the status of the first island that did not reach its end.
    fn summary_of_parts(&self, reports: &[RunReport]) -> Summary {
        let parts = || reports.iter().map(|report| &report.summary);
        let sum = |of: fn(&Summary) -> u64| parts().map(of).sum::<u64>();
        let time = |of: fn(&Summary) -> f64| parts().map(of).sum::<f64>();
        let first = |of: fn(&Summary) -> Option<f64>| parts().filter_map(of).min_by(f64::total_cmp);
        let words = |of: fn(&Summary) -> &str| {
            let mut list: Vec<&str> = parts().map(of).collect();
            list.dedup();
            list.join(" / ")
        };
        let worst = parts().find(|part| part.status != Status::Completed);
        let islands = self.parts.iter().zip(parts()).map(|(part, own)| {
            let names: Vec<&str> = part.bodies.iter().map(|body| self.model.bodies[*body].name.as_str()).collect();
            format!("{}: {} steps, {} evaluations ({})", names.join(", "), own.steps, own.evaluations, own.engine)
        });
        let tolerance = parts().next().map_or(0.0, |part| part.tolerance);
        Summary {
            status: worst.map_or(Status::Completed, |part| part.status),
            reason: worst.map_or_else(String::new, |part| part.reason.clone()),
            code: worst.and_then(|part| part.code),
            t_end_reached: parts().map(|part| part.t_end_reached).fold(f64::INFINITY, f64::min),
            steps: sum(|part| part.steps),
            rejected: sum(|part| part.rejected),
            evaluations: sum(|part| part.evaluations),
            factorisations: sum(|part| part.factorisations),
            jacobians: sum(|part| part.jacobians),
            newton_factorisations: sum(|part| part.newton_factorisations),
            newton_iterations: sum(|part| part.newton_iterations),
            projections: sum(|part| part.projections),
            rank_safe: sum(|part| part.rank_safe),
            position_corrections: sum(|part| part.position_corrections),
            re_aimed: sum(|part| part.re_aimed),
            coupling_iterations: sum(|part| part.coupling_iterations),
            machine_code_programs: sum(|part| part.machine_code_programs),
            machine_code_bytes: sum(|part| part.machine_code_bytes),
            machine_code_time_s: time(|part| part.machine_code_time_s),
            machine_code_from: first(|part| part.machine_code_from),
            stiff_from: first(|part| part.stiff_from),
            integration_time_s: time(|part| part.integration_time_s),
            compile_time_s: self.compile_time + time(|part| part.compile_time_s),
            audit: Audit::together(parts().map(|part| &part.audit)),
            islands: islands.collect(),
            ..self.summary(&words(|part| &part.method), &words(|part| &part.engine), tolerance)
        }
    }
}
