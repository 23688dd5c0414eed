//! Which coordinates the equations of motion are written in.

use super::error::{Exit, SessionError, start_error};
use super::opened::Session;
use super::options::FORMULATIONS;
use crate::analysis::{
    AnalysisError, Formulation, JointForm, JointPlan, MergedForm, MergedMotion, PlanarForm, ReferenceForm, WorkingForm,
};
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

impl Session {
    /// Chooses coordinates and writes the equations in them.
    ///
    /// # Errors
    /// As for [`Session::choose_tree`]; a model that the linear algebra refuses.
    pub(super) fn choose_formulation(&self) -> Result<Choice, SessionError> {
        let (tree, why) = self.choose_tree()?;
        Ok(Choice { joint: tree.map(|tree| self.joint_plan(tree)).transpose()?, why })
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
            let why = "forces or states depend on accelerations or on reactions, or forces turn a particle";
            if name == "joint" {
                let mut diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("no formulation `joint`: {why}"));
                if let Some(written) = written {
                    diagnostic = diagnostic.at(written.span.clone(), "asked for here");
                }
                let diagnostic = diagnostic.help("`auto` chooses what the scene allows");
                return Err(SessionError::one(Exit::Scene, &self.scene.source, diagnostic));
            }
            return Ok(cartesian(why));
        };
        if name == "joint" {
            return Ok((Some(tree), "asked for".into()));
        }
        let used = tree.used(self.model.elements.len());
        let layout = &self.plan.layout;
        let open = (0..layout.rows).all(|row| used[layout.element_of_row(row).0]);
        let bodies = CARTESIAN_BODY * self.model.bodies.len();
        let joint = predicted(&tree, self.model.bodies.len(), open);
        if joint <= bodies && joint <= if open { LARGEST_TREE } else { LARGEST_PROGRAM } {
            let why = format!("about {joint} operations per evaluation predicted, {bodies} in coordinates of bodies");
            return Ok((Some(tree), why));
        }
        Ok(cartesian(&format!("about {bodies} operations per evaluation predicted, {joint} in coordinates of joints")))
    }

    fn joint_plan(&self, tree: SpanningTree) -> Result<JointPlan, SessionError> {
        let (t, place) = self.place_of_ranks();
        let plan = JointPlan::new(&self.equations, &self.model, &self.plan.layout, tree, place, t);
        let mut plan = plan.map_err(|e| start_error(&self.scene, &e))?;
        if !self.pruning.row_choice {
            plan.use_all_rows();
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
                let Some(joint) = choice.joint else {
                    return self.in_bodies().map_err(|e| start_error(&self.scene, &e));
                };
                let bodies = WorkingForm::new(&self.equations, &mut self.model, &self.plan, length, self.start_health)
                    .map_err(|e| start_error(&self.scene, &e))?;
                let form = JointForm::new(joint, &self.model, &self.plan.layout, bodies);
                Ok(Box::new(form.map_err(|e| start_error(&self.scene, &e))?))
            }
            "reference" => Ok(Box::new(ReferenceForm::new(&mut self.model, &self.plan, length))),
            other => Err(self.unknown_word(other, false)),
        }
    }

    /// The equations of motion in the coordinates of bodies, with what was found to be saved there.
    fn in_bodies(&mut self) -> Result<Box<dyn Formulation>, AnalysisError> {
        let Self { model, equations, plan, start_health, merged, planar, assembly, .. } = self;
        let length = assembly.scales.length;
        if let Some(case) = merged {
            let scene = &mut case.merging.model;
            scene.sets = std::mem::take(&mut model.sets);
            let motion = match planar {
                Some(flat) => {
                    let form = PlanarForm::new(&flat.planar, scene, &flat.plan, length, flat.start_health)?;
                    MergedMotion::Plane(form)
                }
                None => {
                    let form = WorkingForm::new(&case.equations, scene, &case.plan, length, case.start_health)?;
                    MergedMotion::Space(form)
                }
            };
            let bodies = WorkingForm::new(equations, model, plan, length, *start_health)?;
            return Ok(Box::new(MergedForm::new(motion, bodies, &case.merging)));
        }
        if let Some(flat) = planar {
            let form = PlanarForm::new(&flat.planar, model, &flat.plan, length, flat.start_health)?;
            return Ok(Box::new(form));
        }
        Ok(Box::new(WorkingForm::new(equations, model, plan, length, *start_health)?))
    }

    fn unknown_formulation(&self, word: &str) -> SessionError {
        let mut diagnostic = Diagnostic::error(codes::UNKNOWN_METHOD, format!("there is no formulation `{word}`"));
        if let Some(written) = &self.scene.simulation.formulation {
            diagnostic = diagnostic.at(written.span.clone(), "unknown");
        }
        let names = || FORMULATIONS.iter().map(|(name, _)| *name);
        let nearest = suggest(word, names()).map(|nearest| format!("did you mean `{nearest}`?"));
        let known = format!("known are {}", names().collect::<Vec<_>>().join(", "));
        SessionError::one(Exit::Scene, &self.scene.source, diagnostic.help_if(nearest).help(known))
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
