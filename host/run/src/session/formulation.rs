//! Which coordinates the equations of motion are written in.

use std::collections::BTreeMap;

use super::error::{SessionError, start_error};
use super::modes::blind;
use super::opened::Session;
use super::options::FORMULATIONS;
use crate::analysis::{Folding, Formulation, JointForm, JointPlan, ReferenceForm, WorkingForm, WorkingParts};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::plan::SpanningTree;

/// Operations of a body's share in the working form, with its joint and its elimination: what was counted on chains.
const CARTESIAN_BODY: usize = 1000;
/// Operations of a pair of velocities in the mass matrix, or of a body in one of them.
const PAIR: usize = 10;
/// What all that a joint carries takes as one body, in pairs.
const COMPOSITE: usize = 5;
/// Operations per body besides that.
const JOINT_BODY: usize = 150;
/// Operations per velocity where no rows close the tree and bodies are taken one by one, besides those of [`JOINT_BODY`]: both
/// together are 100 in a plane, 514 in space as counted on chains of hinges.
const ARTICULATED: usize = 150;
/// Operations per body for each acceleration or multiplier that forces depend on.
const COUPLED: usize = 150;
/// Operations beyond which nothing is written down as one program.
const LARGEST_PROGRAM: usize = 200_000;
/// The same for trees that no rows close: they need no large graphs on the way, and a chain of 1000 links takes a tenth of the time
/// in this form, although 900 kB of machine code are run through.
const LARGEST_TREE: usize = 5_000_000;

/// A choice, with the reason.
pub(super) struct Choice {
    /// The equations in joint coordinates, if these are used.
    pub(super) joint: Option<JointPlan>,
    /// Why.
    pub(super) why: String,
}

/// Operations per evaluation, without those of elements.
struct Predicted {
    joint: usize,
    bodies: usize,
    /// Whether no rows close the tree.
    open: bool,
    /// Beyond which nothing is written down as one program.
    largest: usize,
}

impl Session {
    /// Chooses coordinates and writes the equations in them.
    ///
    /// # Errors
    /// As for [`Session::choose_tree`]; a model that the linear algebra refuses.
    pub(super) fn choose_formulation(&self) -> Result<Choice, SessionError> {
        let (tree, why) = self.choose_tree()?;
        let Some(tree) = tree else {
            let folded = self.folded()?;
            return Ok(folded.unwrap_or(Choice { joint: None, why }));
        };
        let Predicted { bodies, open, .. } = self.predicted(&tree);
        let joint = self.joint_plan(tree, self.folding())?;
        // What elimination of loops takes is known once it is written.
        let written = joint.as_ref().map_or(0, |plan| plan.program().operations());
        if !open && written > bodies && self.is_free_to_choose() {
            let why = format!(
                "about {bodies} operations per evaluation predicted, {written} written in coordinates of joints"
            );
            return Ok(Choice { joint: None, why });
        }
        let why = match joint {
            Some(_) => why,
            None => self.no_tree(
                "forces or states depend on Euler parameters, or on reactions that are not found along the tree",
            )?,
        };
        Ok(Choice { joint, why })
    }

    /// The equations of a scene that is too large for one program, but not once all that follows something else is written out: a
    /// row of a thousand parallelograms moves like one of them.
    ///
    /// # Errors
    /// A model that the linear algebra refuses.
    fn folded(&self) -> Result<Option<Choice>, SessionError> {
        if !self.is_free_to_choose() || !self.pruning.affine_loops {
            return Ok(None);
        }
        let Some(tree) = JointPlan::tree(&self.equations, &self.model, &self.assembly) else { return Ok(None) };
        let Predicted { joint, bodies, open, .. } = self.predicted(&tree);
        if open || joint > bodies || joint > LARGEST_TREE {
            return Ok(None);
        }
        let plan = self.joint_plan(tree, Folding::Wholly)?;
        let why = "wherever the mechanism is, coordinates of joints make up for all rows that close loops";
        Ok(plan.map(|plan| Choice { joint: Some(plan), why: why.into() }))
    }

    /// Whether the scene asks for no coordinates.
    fn is_free_to_choose(&self) -> bool {
        self.scene.simulation.formulation.as_ref().is_none_or(|written| written.value == "auto")
    }

    /// What a scene lets become of coordinates that follow others.
    pub(super) fn folding(&self) -> Folding {
        if self.pruning.affine_loops { Folding::WherePossible } else { Folding::Never }
    }

    /// The tree, if the coordinates of joints are to be used; and why, or why not.
    ///
    /// # Errors
    /// An unknown name; joint coordinates asked for where they can't be had.
    pub(super) fn choose_tree(&self) -> Result<(Option<SpanningTree>, String), SessionError> {
        let written = self.scene.simulation.formulation.as_ref();
        let name = written.map_or("auto", |word| word.value.as_str());
        if !FORMULATIONS.iter().any(|(known, _)| *known == name) {
            return Err(self.unknown_formulation(name));
        }
        let cartesian = |why: &str| (None, why.to_string());
        if name == "cartesian" {
            return Ok(cartesian("asked for"));
        }
        let tree = JointPlan::tree(&self.equations, &self.model, &self.assembly);
        let Some(tree) = tree else {
            return Ok((None, self.no_tree("something may turn a particle")?));
        };
        if name == "joint" {
            return Ok((Some(tree), "asked for".into()));
        }
        let Predicted { joint, bodies, open, largest } = self.predicted(&tree);
        let joint = joint + if open { 0 } else { self.waiting(&tree) };
        if joint <= bodies.min(largest) {
            let why = format!("about {joint} operations per evaluation predicted, {bodies} in coordinates of bodies");
            return Ok((Some(tree), why));
        }
        Ok(cartesian(&format!("about {bodies} operations per evaluation predicted, {joint} in coordinates of joints")))
    }

    /// What an evaluation takes in the coordinates of a tree, and of bodies.
    fn predicted(&self, tree: &SpanningTree) -> Predicted {
        let open = tree.closes_no_loop(&self.plan.layout);
        let coupled = self.equations.coupling.len();
        // Where elimination is not trusted with the rows, all of them are factored as a dense matrix, at every evaluation.
        let dense = self.plan.always_rank_safe.is_some();
        let factored = if dense { self.plan.layout.velocities() * self.plan.rows.len().pow(2) } else { 0 };
        let bodies = (CARTESIAN_BODY + COUPLED * coupled) * self.model.bodies.len() + factored;
        let of_joints = if self.equations.is_coupling_inertia(&self.plan.layout) { 0 } else { coupled };
        let joint = predicted(tree, self.model.bodies.len(), open) + COUPLED * of_joints * self.model.bodies.len();
        let largest = if open || factored > LARGEST_TREE { LARGEST_TREE } else { LARGEST_PROGRAM };
        Predicted { joint, bodies, open, largest }
    }

    /// Operations that the elimination of rows takes which wait for one coordinate: those of all loops that run through it go behind
    /// it, when each of them has an entry with every other.
    fn waiting(&self, tree: &SpanningTree) -> usize {
        let Self { equations, model, plan, .. } = self;
        let mut rows = vec![0; model.elements.len()];
        equations.enforced().for_each(|row| rows[plan.layout.element_of_row(row).0] += 1);
        tree.joints.iter().filter_map(|joint| joint.element).for_each(|element| rows[element] = 0);
        let mut parents = vec![None; model.bodies.len()];
        tree.joints.iter().for_each(|joint| parents[joint.child] = joint.parent);
        // By the body that each joint of the tree carries, the rows of loops that run through it.
        let mut through = vec![0; model.bodies.len()];
        for (element, rows) in model.elements.iter().zip(&rows).filter(|(_, rows)| **rows > 0) {
            let mut met: BTreeMap<usize, usize> = BTreeMap::new();
            for marker in &element.markers {
                for body in std::iter::successors(marker.body, |body| parents[*body]) {
                    *met.entry(body).or_default() += 1;
                }
            }
            let passed = met.into_iter().filter(|(_, times)| *times < element.markers.len());
            passed.for_each(|(body, _)| through[body] += rows);
        }
        // Only so many of them are independent.
        let columns: usize = tree.joints.iter().map(|joint| joint.coordinates + 3 * usize::from(joint.rotates)).sum();
        let (all, left) = (rows.iter().sum::<usize>().max(1), columns.saturating_sub(plan.mobility));
        let most = through.into_iter().max().unwrap_or(0) * left.min(all) / all;
        most.pow(3) / 3
    }

    /// Why there are no joint coordinates.
    ///
    /// # Errors
    /// Where they were asked for.
    fn no_tree(&self, why: &str) -> Result<String, SessionError> {
        match &self.scene.simulation.formulation {
            Some(written) if written.value == "joint" => {
                let diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("no formulation `joint`: {why}"))
                    .at(written.span.clone(), "asked for here")
                    .help("`auto` chooses what the scene allows");
                Err(SessionError::one(&self.scene.source, diagnostic))
            }
            _ => Ok(why.to_string()),
        }
    }

    /// The equations in the coordinates of a tree; `None` where they can't be had.
    ///
    /// # Errors
    /// A model that the linear algebra refuses.
    pub(super) fn joint_plan(&self, tree: SpanningTree, folding: Folding) -> Result<Option<JointPlan>, SessionError> {
        let (t, place) = self.place_of_ranks();
        let plan = JointPlan::new(&self.equations, &self.model, &self.plan.layout, tree, (place, t), folding);
        let mut plan = plan.map_err(|e| start_error(&self.scene, &self.model, &e))?;
        if let Some(plan) = &mut plan {
            let left_out = (0..plan.rows.len()).filter(|k| plan.independent.binary_search(k).is_err());
            let left_out: Vec<usize> = left_out.map(|k| plan.rows[k]).collect();
            if blind(&self.equations, left_out.into_iter()) || !self.pruning.row_choice {
                plan.use_all_rows();
            }
        }
        Ok(plan)
    }

    /// The equations of motion in the form that the engine's name (see [`super::ENGINES`]) stands for, interpreted.
    ///
    /// # Errors
    /// An unknown name; masses that admit no motion.
    pub fn formulation(&mut self, engine: &str) -> Result<Box<dyn Formulation>, SessionError> {
        let length = self.assembly.scales.length;
        match engine {
            "auto" | "compiled" | "interpreted" => {
                let choice = self.choose_formulation()?;
                let Self { equations, model, plan, scene, .. } = self;
                if choice.joint.is_none() {
                    equations.write_gammas();
                }
                equations.graph.share();
                let Some(joint) = choice.joint else {
                    let form = WorkingForm::new(equations, model, plan, length);
                    let form = form.map_err(|e| start_error(scene, model, &e))?;
                    return Ok(Box::new(form));
                };
                let bodies = WorkingParts::new(equations, model, plan, length);
                let form = JointForm::new(joint, model, &plan.layout, bodies);
                Ok(Box::new(form.map_err(|e| start_error(scene, model, &e))?))
            }
            "reference" => Ok(Box::new(ReferenceForm::new(&mut self.model, &self.plan, length))),
            other => Err(self.unknown_word(other, false)),
        }
    }

    /// The equations of motion in coordinates of joints, whatever takes fewer operations; `None` where they can't be had. The opaque
    /// elements of the model move in.
    ///
    /// # Errors
    /// Masses that admit no motion.
    pub fn joint_form(&mut self, folding: Folding) -> Result<Option<JointForm>, SessionError> {
        let Some(tree) = JointPlan::tree(&self.equations, &self.model, &self.assembly) else { return Ok(None) };
        let Some(joint) = self.joint_plan(tree, folding)? else { return Ok(None) };
        let Self { equations, model, plan, scene, .. } = self;
        let length = self.assembly.scales.length;
        equations.graph.share();
        let bodies = WorkingParts::new(equations, model, plan, length);
        JointForm::new(joint, model, &plan.layout, bodies).map(Some).map_err(|e| start_error(scene, model, &e))
    }

    /// Whether the start is a singular position, or next to one.
    #[must_use]
    pub fn starts_singular(&self) -> bool {
        self.ahead.is_some()
    }

    fn unknown_formulation(&self, word: &str) -> SessionError {
        let mut diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("there is no formulation `{word}`"));
        if let Some(written) = &self.scene.simulation.formulation {
            diagnostic = diagnostic.at(written.span.clone(), "unknown");
        }
        let names = || FORMULATIONS.iter().map(|(name, _)| *name);
        let nearest = suggest(word, names()).map(|nearest| format!("did you mean `{nearest}`?"));
        let known = format!("known are {}", names().collect::<Vec<_>>().join(", "));
        SessionError::one(&self.scene.source, diagnostic.help_if(nearest).help(known))
    }
}

/// Operations per evaluation in the coordinates of a tree, without those of elements: pairs of velocities that meet in a body,
/// or in all that a joint carries, whichever are fewer; or body by body where the tree is open, no rows closing it.
fn predicted(tree: &SpanningTree, bodies: usize, open: bool) -> usize {
    let mut path = vec![0_usize; bodies];
    let mut operations = 0;
    for joint in &tree.joints {
        let own = joint.coordinates + 3 * usize::from(joint.rotates);
        let here = own + joint.parent.map_or(0, |parent| path[parent]);
        path[joint.child] = here;
        let pairs = PAIR * (here * (here + 1) / 2).min(own * (here + COMPOSITE));
        operations += JOINT_BODY + if open { pairs.min(ARTICULATED * own) } else { pairs };
    }
    operations
}
