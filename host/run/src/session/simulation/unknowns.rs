//! Internal unknowns between steps: their carried values are brought to the conditions, on the branch of solutions that they are on.

use super::{Part, Simulation};
use crate::analysis::{AnalysisError, Formulation, determinant, unknown_name};
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Equations, Node, Used};

/// How often Newton steps are taken before a value counts as lost.
const MOST_ROUNDS: usize = 25;
/// Values that Newton steps change less than this, as a share of their size, are found, and left as they are.
const FOUND: f64 = 1e-11;
/// Changes that are round-off of an unknown that is zero, SI.
const ROUND_OFF: f64 = 1e-15;
/// Changes up to this, SI, that the next Newton step does not make smaller, are round-off too.
const STAGNANT: f64 = 1e-12;
/// Values that a further Newton step changes by more than this share of the tolerance were not found within the step.
const WITHIN: f64 = 0.1;
/// A determinant below this share of the largest so far is reported where a run ends.
const NEARLY_SINGULAR: f64 = 1e-2;

/// The unknowns of one element.
struct Own {
    element: String,
    names: Vec<String>,
    /// Numbers of the states that carry them: the first.
    state: usize,
    /// Determinant of the conditions' derivatives where the branch was begun, and the largest so far.
    begun: Option<f64>,
    largest: f64,
    last: f64,
}

/// See the module documentation.
pub(super) struct Tracked {
    elements: Vec<Own>,
    /// Per element: the unknowns, then the derivatives of its conditions there.
    part: Part,
    /// What was not found since the last accepted state.
    lost: Option<(String, String)>,
}

impl Tracked {
    pub(super) fn new(
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        formulation: &dyn Formulation,
    ) -> Option<Self> {
        let solved = &equations.graph.solved;
        if solved.is_empty() {
            return None;
        }
        let nodes: Vec<Node> = solved.iter().flat_map(|one| one.unknowns.iter().chain(&one.matrix).copied()).collect();
        let own = |one: &crate::program::Solved| {
            let state = one.slot - layout.state_slot();
            let element = &model.elements[layout.element_of_state(state)];
            let names = (0..one.unknowns.len()).map(|k| unknown_name(&element.class, k)).collect();
            Own { element: element.name.clone(), names, state, begun: None, largest: 0.0, last: 0.0 }
        };
        let elements = solved.iter().map(own).collect();
        Some(Self { elements, part: Part::near(formulation, equations, &nodes, layout), lost: None })
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        self.part.used()
    }
}

impl Simulation<'_> {
    /// Brings the carried values to the conditions at the end of a step.
    ///
    /// # Errors
    /// [`AnalysisError::Unsolved`] where they are not found, were not found well enough within the step, or lie on another branch.
    pub(super) fn settle_after_step(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        self.settle_with(t, state, Some((WITHIN * self.tolerance).max(FOUND)))
    }

    /// Brings the carried values to the conditions where something else may have jumped.
    ///
    /// # Errors
    /// [`AnalysisError::Unsolved`] where they are not found.
    pub(in crate::session) fn settle_anew(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        self.settle_with(t, state, None)
    }

    /// `within`: what the second round may change after a step, as a share of the size.
    fn settle_with(&mut self, t: f64, state: &mut [f64], within: Option<f64>) -> Result<(), AnalysisError> {
        let Some(mut tracked) = self.unknowns.take() else { return Ok(()) };
        let result = self.settle_all(&mut tracked, t, state, within);
        tracked.lost = match &result {
            Err(AnalysisError::Unsolved { element, unknown, .. }) => Some((element.clone(), unknown.clone())),
            _ => None,
        };
        self.unknowns = Some(tracked);
        result
    }

    fn settle_all(
        &mut self,
        tracked: &mut Tracked,
        t: f64,
        state: &mut [f64],
        within: Option<f64>,
    ) -> Result<(), AnalysisError> {
        let first = state.len() - self.layout.states - 1;
        let mut before = vec![f64::INFINITY; self.layout.states];
        for round in 0..=MOST_ROUNDS {
            let found = tracked.part.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
            let (mut at, mut worst) = (0, (0.0_f64, None));
            for (number, own) in tracked.elements.iter().enumerate() {
                let n = own.names.len();
                for k in 0..n {
                    let (value, carried) = (found[at + k], &mut state[first + own.state + k]);
                    let size = value.abs().max(self.state_sizes.largest()[own.state + k]);
                    let change = (value - *carried).abs();
                    let last = std::mem::replace(&mut before[own.state + k], change);
                    let round_off = change <= ROUND_OFF || (change <= STAGNANT && change >= 0.25 * last);
                    let share = if round_off { 0.0 } else { change / size };
                    if share.is_nan() || share > worst.0 {
                        worst = (share, Some((number, k)));
                    }
                    if value.is_finite() && share > FOUND {
                        *carried = value;
                    }
                    if worst.0.is_nan() {
                        break;
                    }
                }
                at += n + n * n;
            }
            let (share, place) = worst;
            let why = match within {
                _ if share.is_nan() => "its conditions are not finite numbers there",
                Some(within) if round == 1 && share > within => {
                    "its conditions have no solution near the one before, or it jumps"
                }
                _ if round == MOST_ROUNDS && share > FOUND => "Newton's method does not come to an end",
                _ if round > 0 && share <= FOUND => break,
                _ => continue,
            };
            let (number, k) = place.unwrap_or((0, 0));
            let own = &tracked.elements[number];
            return Err(AnalysisError::Unsolved { element: own.element.clone(), unknown: own.names[k].clone(), why });
        }
        let found = tracked.part.outputs();
        let mut at = 0;
        for own in &mut tracked.elements {
            let n = own.names.len();
            let now = determinant(&found[at + n..at + n + n * n], n);
            at += n + n * n;
            let begun = match (own.begun, within) {
                (Some(begun), Some(_)) => begun,
                // What jumps may begin another branch.
                _ => *own.begun.insert(now),
            };
            if now == 0.0 || now.signum() != begun.signum() {
                return Err(AnalysisError::Unsolved {
                    element: own.element.clone(),
                    unknown: own.names.join(", "),
                    why: "its branch of solutions ends: the derivatives of its conditions become singular",
                });
            }
            (own.largest, own.last) = (own.largest.max(now.abs()), now.abs());
        }
        Ok(())
    }

    /// Which unknown may be why a run does not continue: one that was not found, or nearly was not determined at the last state.
    pub(in crate::session) fn lost_unknown(&self) -> Option<String> {
        let tracked = self.unknowns.as_ref()?;
        let named = |element: &str, unknown: &str| {
            format!(
                "the internal unknown `{unknown}` of `{element}` cannot be followed beyond this time: its conditions have no solution \
                 near the one before, or do not determine it there (their derivatives become singular)"
            )
        };
        if let Some((element, unknown)) = &tracked.lost {
            return Some(named(element, unknown));
        }
        let singular = tracked.elements.iter().find(|own| own.last < NEARLY_SINGULAR * own.largest)?;
        Some(named(&singular.element, &singular.names.join(", ")))
    }
}
