//! [`Guarded`]: what is watched throughout every step, and its ranges.
//!
//! Conditions, sharp functions and counted angles are nodes of the equations. Where they can be written in the coordinates that
//! are integrated, their ranges over a step are computed; elsewhere they are looked at in many places of it.

use std::sync::Arc;

use crate::analysis::Formulation;
use crate::integrate::{Guard, Guards};
use crate::interval::Range;
use crate::plan::Layout;
use crate::program::{Equations, Node, Ranges, Sharp, Switches};

/// See the module documentation.
pub(super) struct Guarded {
    pub(super) guards: Guards,
    /// Quantities that no range and no cheap look is to be had of: conditions on accelerations or reactions.
    pub(super) unknown: usize,
    /// The nodes of [`Guards::within`] in the equations.
    pub(super) nodes: Vec<Node>,
    ranges: Option<Ranges>,
    /// For each input of the ranges what it is.
    sources: Vec<Source>,
    of_time: Option<Ranges>,
    /// The inputs of these.
    slots_of_time: Vec<usize>,
}

/// Where an input of the ranges comes from.
#[derive(Debug, Clone, Copy)]
enum Source {
    Time,
    /// Place among the entries that are asked for.
    Entry(usize),
    /// Angle reference.
    Reference(usize),
    /// Discrete state.
    Discrete(usize),
}

/// What is to be watched in a scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Watching {
    switches: Switches,
    sharp: Sharp,
    angles: Vec<Node>,
}

impl Watching {
    /// Looks for it in the equations. Without `switches`, conditions are left out.
    pub(super) fn find(equations: &Equations, layout: &Layout) -> Self {
        let sharp = Sharp::find(equations, layout);
        let mut switches = Switches::find(equations, layout);
        // What depends on time alone is known before a step.
        switches.conditions.retain(|(a, b)| !sharp.conditions.contains(&(*a, *b)) && !sharp.conditions.contains(&(*b, *a)));
        Self { switches, sharp, angles: equations.angles.clone() }
    }

    /// The conditions that depend on the motion.
    pub(super) fn switches(&self) -> &Switches {
        &self.switches
    }

    /// What is known of time beforehand, what is enclosed, and whether there is anything.
    pub(super) fn sharp(&self) -> &Sharp {
        &self.sharp
    }

    /// Prepares the ranges in the coordinates of a formulation.
    pub(super) fn guard(
        &self,
        equations: &mut Equations,
        layout: &Layout,
        formulation: &dyn Formulation,
    ) -> Guarded {
        let g = &mut equations.graph;
        let (mut guards, mut nodes) = (Guards::default(), Vec::new());
        for (a, b) in &self.switches.conditions {
            nodes.push(g.sub(*a, *b));
            guards.within.push(Guard::Switch);
        }
        for node in &self.sharp.of_motion {
            nodes.push(*node);
            guards.within.push(Guard::Feature);
        }
        for (k, angle) in self.angles.iter().enumerate() {
            let reference = g.input(layout.reference_slot() + k);
            nodes.push(g.sub(*angle, reference));
            guards.within.push(Guard::Turn);
        }
        let mut of_time = Vec::new();
        for (a, b) in &self.sharp.conditions {
            of_time.push(g.sub(*a, *b));
            guards.of_time.push(Guard::Switch);
        }
        for (at, knots) in &self.sharp.knots {
            of_time.push(*at);
            let knots = knots.clone();
            guards.of_time.push(Guard::Knots(Arc::new(move |x| knots.around(x))));
        }
        for node in &self.sharp.of_time {
            of_time.push(*node);
            guards.of_time.push(Guard::Feature);
        }
        // What depends on the solution of the equations of motion is not known within a step.
        let solved = layout.acceleration_slot()..layout.inputs();
        let foreign = |node: &Node| {
            equations.graph.ancestors(&[*node], |_| false).into_iter().any(|node| match equations.graph.expr(node) {
                crate::program::Expr::Input(slot) => solved.contains(&(slot as usize)),
                crate::program::Expr::Call { .. } => true,
                _ => false,
            })
        };
        let known: Vec<bool> = nodes.iter().map(|node| !foreign(node)).collect();
        let unknown = known.iter().filter(|known| !**known).count();
        let mut place = known.iter();
        guards.within.retain(|_| *place.next().unwrap_or(&true));
        let mut place = known.iter();
        nodes.retain(|_| *place.next().unwrap_or(&true));
        let of_time = (!of_time.is_empty()).then(|| Ranges::new(&equations.graph, &of_time));
        let slots_of_time = of_time.as_ref().map_or_else(Vec::new, |ranges| ranges.inputs().to_vec());
        let mut guarded =
            Guarded { guards, unknown, nodes, ranges: None, sources: Vec::new(), of_time, slots_of_time };
        guarded.write(equations, layout, formulation);
        guarded
    }
}

impl Guarded {
    fn write(&mut self, equations: &Equations, layout: &Layout, formulation: &dyn Formulation) {
        if self.nodes.is_empty() {
            return;
        }
        let Some((graph, nodes)) = formulation.written_in_state(equations, &self.nodes) else { return };
        let ranges = Ranges::new(&graph, &nodes);
        let mut entries = Vec::new();
        let mut sources = Vec::new();
        for slot in ranges.inputs() {
            let (references, discrete) = (layout.reference_slot(), layout.discrete_slot());
            sources.push(match *slot {
                Layout::TIME => Source::Time,
                slot if (references..discrete).contains(&slot) => Source::Reference(slot - references),
                slot if (discrete..layout.acceleration_slot()).contains(&slot) => Source::Discrete(slot - discrete),
                slot => match formulation.entry_of(slot) {
                    Some(entry) => {
                        entries.push(entry);
                        Source::Entry(entries.len() - 1)
                    }
                    None => return,
                },
            });
        }
        self.guards.entries = entries;
        self.guards.proved = true;
        self.sources = sources;
        self.ranges = Some(ranges);
    }

    /// The ranges of everything that depends on the state.
    pub(super) fn enclose(
        &mut self,
        t: Range,
        entry: &dyn Fn(usize) -> Range,
        [references, discrete]: [&[f64]; 2],
        found: &mut [Range],
    ) {
        let Some(ranges) = &mut self.ranges else { return };
        let sources = &self.sources;
        let input = |place: usize| match sources[place] {
            Source::Time => t,
            Source::Entry(k) => entry(k),
            Source::Reference(k) => Range::still(references[k]),
            Source::Discrete(k) => Range::still(discrete[k]),
        };
        found.iter_mut().zip(ranges.evaluate(input)).for_each(|(found, range)| *found = range);
    }

    /// The ranges of everything that depends on time alone.
    pub(super) fn enclose_time(
        &mut self,
        t: Range,
        layout: &Layout,
        [references, discrete]: [&[f64]; 2],
        found: &mut [Range],
    ) {
        let Some(ranges) = &mut self.of_time else { return };
        let slots = &self.slots_of_time;
        let input = |place: usize| match slots[place] {
            Layout::TIME => t,
            slot if slot < layout.discrete_slot() => Range::still(references[slot - layout.reference_slot()]),
            slot => Range::still(discrete[slot - layout.discrete_slot()]),
        };
        found.iter_mut().zip(ranges.evaluate(input)).for_each(|(found, range)| *found = range);
    }
}
