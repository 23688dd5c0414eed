//! [`MergedForm`]: the motion of merged bodies, told of the bodies of the scene.
//!
//! The equations of motion are those of the merged scene (see [`Merging`]), in space or in a plane. Where a body of the scene
//! is follows from the one that it is merged into; accelerations of all bodies and reactions of all joints, of those that hold
//! the bodies together too, are solved for in the scene as it is, where they are asked for.

use element_api::ElementSet;
use nalgebra::{Matrix3, Quaternion, Vector3};

use super::assembly::Assembly;
use super::balance::Imbalance;
use super::formulation::{AnalysisError, Counters, Formulation, Group, Observed, Price};
use super::joint::STATES_PER_AUDIT;
use super::joint_start::{JointStart, parameters};
use super::planar::PlanarForm;
use super::working::{BODY_STATES, WorkingForm};
use crate::model::{Marker, Model, rotation};
use crate::plan::{Layout, Merging, Refused, SpanningTree, TreeJoint};
use crate::program::{Equations, JointPose, Used};

/// Entries of a rotation this close to 0, 1 or -1, and positions this close to zero as a share of the scene's length, are so
/// but for round-off. Exact ones fold away.
const ROUND_OFF: f64 = 1e-14;

/// What joints without freedom hold together at the assembled position, with the joints that must not; nothing where none does.
#[must_use]
pub fn merge(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    assembly: &Assembly,
) -> (Option<Merging>, Vec<Refused>) {
    let timed = |element: usize| {
        let moves = equations.rows[layout.rows_of(element)].iter().any(|row| !equations.graph.is_zero(row.time));
        moves || model.elements[element].class.opaque
    };
    Merging::find(model, timed, |joint| relative(joint, model, assembly))
}

/// Where a joint without freedom holds its child's centroidal frame in its parent's, if the child is there.
fn relative(joint: &TreeJoint, model: &Model, assembly: &Assembly) -> Option<Marker> {
    let element = joint.element?;
    let length = assembly.scales.length;
    let single = SpanningTree { joints: vec![joint.clone()] };
    JointStart::new(model, &single, length).find(&assembly.working).pop().flatten()?;
    let mut pose = JointPose::new(model, element, 0);
    let found = pose.at(&[]);
    let (position, turn) = (Vector3::from_column_slice(&found[..3]), Matrix3::from_row_slice(&found[3..12]));
    let markers = &model.elements[element].markers;
    // The pose of the far frame, on the child, in the near one.
    let (near, far, position, turn) = match joint.reversed {
        false => (&markers[0], &markers[1], position, turn),
        true => (&markers[1], &markers[0], -turn.tr_mul(&position), turn.transpose()),
    };
    let rotation = (near.rotation * turn * far.rotation.transpose()).map(|x| exact(x, &[0.0, 1.0, -1.0], ROUND_OFF));
    let position = near.position + near.rotation * position - rotation * far.position;
    let position = position.map(|x| exact(x, &[0.0], ROUND_OFF * length));
    Some(Marker { body: joint.parent, position, rotation })
}

/// The number among `numbers` that `x` is but for round-off, or `x`.
fn exact(x: f64, numbers: &[f64], round_off: f64) -> f64 {
    numbers.iter().copied().find(|number| (x - number).abs() <= round_off).unwrap_or(x)
}

/// The working state of the merged scene for that of the scene as it is.
fn merged_state(heads: &[usize], places: &[Marker], working: &[f64]) -> Vec<f64> {
    let mut state = Vec::with_capacity(working.len());
    for head in heads {
        let y = &working[BODY_STATES * head..BODY_STATES * (head + 1)];
        let a = rotation(&[y[3], y[4], y[5], y[6]]);
        // The body's centre of mass has moved by -s in its own axes; the axes are the same.
        let s = places[*head].position;
        let w = Vector3::from_column_slice(&y[10..13]);
        let (arm, swept) = (a * s, a * w.cross(&s));
        let mut own = y.to_vec();
        for k in 0..3 {
            own[k] -= arm[k];
            own[7 + k] -= swept[k];
        }
        state.extend(own);
    }
    state.extend(&working[BODY_STATES * places.len()..]);
    state
}

impl Assembly {
    /// The same start for the merged bodies.
    #[must_use]
    pub fn merged(&self, merging: &Merging) -> Self {
        Self {
            working: merged_state(&merging.heads, &merging.places, &self.working),
            moves: Vec::new(),
            ..self.clone()
        }
    }
}

/// The equations of motion of a merged scene.
pub enum MergedMotion {
    /// In space.
    Space(WorkingForm),
    /// Parallel to a plane.
    Plane(PlanarForm),
}

/// See the module documentation.
pub struct MergedForm {
    motion: MergedMotion,
    /// The scene as it is, for what is reported.
    bodies: WorkingForm,
    /// Where each body of the scene is, on merged bodies.
    places: Vec<Marker>,
    /// The rotations of the places as Euler parameters.
    turns: Vec<Quaternion<f64>>,
    /// The body of the scene whose axes each merged body has.
    heads: Vec<usize>,
    /// The state of the bodies of the scene.
    body_state: Vec<f64>,
}

impl MergedForm {
    /// Puts forms of the merged scene and of the scene as it is together. The first of them holds the opaque elements.
    #[must_use]
    pub fn new(motion: MergedMotion, bodies: WorkingForm, merging: &Merging) -> Self {
        let places = merging.places.clone();
        let turn = |place: &Marker| {
            let [w, x, y, z] = parameters(&place.rotation);
            Quaternion::new(w, x, y, z)
        };
        Self {
            turns: places.iter().map(turn).collect(),
            body_state: vec![0.0; bodies.groups().len()],
            heads: merging.heads.clone(),
            places,
            motion,
            bodies,
        }
    }

    fn form(&self) -> &dyn Formulation {
        match &self.motion {
            MergedMotion::Space(form) => form,
            MergedMotion::Plane(form) => form,
        }
    }

    fn form_mut(&mut self) -> &mut dyn Formulation {
        match &mut self.motion {
            MergedMotion::Space(form) => form,
            MergedMotion::Plane(form) => form,
        }
    }

    /// The opaque elements change sides.
    fn trade_sets(&mut self) {
        // Motions are known to be planar only where no element is opaque.
        if let MergedMotion::Space(form) = &mut self.motion {
            form.trade_sets(&mut self.bodies);
        }
    }

    /// Where the bodies of the scene are, and how they move.
    fn move_bodies(&mut self, state: &[f64]) {
        for ((place, turn), y) in self.places.iter().zip(&self.turns).zip(self.body_state.chunks_exact_mut(BODY_STATES))
        {
            let (r, q, v, w) = match place.body {
                None => (place.position, *turn, Vector3::zeros(), Vector3::zeros()),
                Some(carrier) => {
                    let own = &state[BODY_STATES * carrier..BODY_STATES * (carrier + 1)];
                    let a = rotation(&[own[3], own[4], own[5], own[6]]);
                    let w = Vector3::from_column_slice(&own[10..13]);
                    let r = Vector3::from_column_slice(&own[..3]) + a * place.position;
                    let v = Vector3::from_column_slice(&own[7..10]) + a * w.cross(&place.position);
                    let q = Quaternion::new(own[3], own[4], own[5], own[6]) * turn;
                    (r, q, v, place.rotation.tr_mul(&w))
                }
            };
            y[..3].copy_from_slice(r.as_slice());
            y[3..7].copy_from_slice(&[q.w, q.i, q.j, q.k]);
            y[7..10].copy_from_slice(v.as_slice());
            y[10..13].copy_from_slice(w.as_slice());
        }
        let (from, merged) = (BODY_STATES * self.places.len(), BODY_STATES * self.heads.len());
        self.body_state[from..].copy_from_slice(&state[merged..]);
    }
}

impl Formulation for MergedForm {
    fn name(&self) -> &'static str {
        match self.form().name() {
            "sparse" => "merged, sparse",
            "rank-safe" => "merged, rank-safe",
            "planar, sparse" => "merged, planar, sparse",
            _ => "merged, planar, rank-safe",
        }
    }

    fn groups(&self) -> &[Group] {
        self.form().groups()
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        let merged = merged_state(&self.heads, &self.places, working);
        self.form_mut().state_of(&merged, state);
        // Of the two sets of Euler parameters of a rotation, those of the scene.
        self.move_bodies(state);
        for (turn, (found, given)) in
            self.turns.iter_mut().zip(self.body_state.chunks_exact(BODY_STATES).zip(working.chunks_exact(BODY_STATES)))
        {
            if (3..7).map(|k| found[k] * given[k]).sum::<f64>() < 0.0 {
                *turn = -*turn;
            }
        }
    }

    fn forget(&mut self, working: &[f64]) {
        let merged = merged_state(&self.heads, &self.places, working);
        self.form_mut().forget(&merged);
        self.bodies.forget(working);
    }

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.form_mut().set_discrete(references, discrete);
        self.bodies.set_discrete(references, discrete);
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        self.form_mut().rates(t, state, rates)
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        self.form_mut().project(t, state)
    }

    fn states_per_audit(&self) -> u64 {
        STATES_PER_AUDIT
    }

    fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.form_mut().certify(t, state)
    }

    fn next_step(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.form_mut().next_step(t, state)
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.move_bodies(state);
        let mut imbalance = Imbalance::default();
        if dynamics {
            self.trade_sets();
            let solved = self.bodies.observe(t, &self.body_state, true).map(|observed| observed.imbalance);
            self.trade_sets();
            imbalance = solved?;
        }
        Ok(Observed { imbalance, ..self.bodies.observe(t, &self.body_state, false)? })
    }

    fn programs(&mut self) -> Vec<Used<'_>> {
        let Self { motion, bodies, .. } = self;
        let mut list = match motion {
            MergedMotion::Space(form) => form.programs(),
            MergedMotion::Plane(form) => form.programs(),
        };
        list.extend(bodies.programs().into_iter().map(|used| Used { spare: true, ..used }));
        list
    }

    fn offer_jacobian(&mut self, equations: &Equations) {
        self.form_mut().offer_jacobian(equations);
    }

    fn jacobian(&mut self, t: f64, state: &[f64], matrix: &mut [f64]) -> Result<bool, AnalysisError> {
        self.form_mut().jacobian(t, state, matrix)
    }

    fn time_derivative(&self, t: f64, slopes: &mut [f64]) -> bool {
        self.form().time_derivative(t, slopes)
    }

    fn price(&self) -> Price {
        self.form().price()
    }

    fn leaves_rows_out(&self) -> bool {
        self.form().leaves_rows_out()
    }

    fn counters(&self) -> Counters {
        self.form().counters() + self.bodies.counters()
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        self.form_mut().sets_mut()
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        self.form().sets()
    }
}
