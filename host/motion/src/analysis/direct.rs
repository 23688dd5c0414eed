//! [`Direct`]: the rates of a state by one program that reads the state and writes its rates, with nothing copied in between.

use element_api::ElementSet;

use super::formulation::AnalysisError;
use super::motion::parameter_rates;
use crate::plan::{Coordinates, Layout, Rotation};
use crate::program::{Program, Source, Used, Wired, Workspace};

/// Pivots of rows have to be above what counts as sound by this share of it: round-off of the comparison is far less. Those in
/// between are for the long way, which compares exactly and comes to the same rates.
const CLEARLY: f64 = 1.0 + 1e-9;

/// See the module documentation.
pub(super) struct Direct {
    wired: Wired,
    workspace: Workspace,
    /// Euler parameters, the rates of which are not the program's.
    rotations: Vec<Rotation>,
    /// Number of mass pivots among those that are looked at; those of the rows follow.
    masses: usize,
    /// What each pivot has to be above, for this pivot ratio.
    floors: Vec<f64>,
    least: f64,
}

impl Direct {
    /// From a program of accelerations, multipliers, rates of states, power, then pivots of masses and of `rows` rows. Where there
    /// are none, no pivot is looked at. `None` where the program cannot be wired like that.
    pub(super) fn new(motion: &Program, coordinates: &Coordinates, layout: &Layout, rows: usize) -> Option<Self> {
        let columns = coordinates.columns;
        let mut sources = vec![Source::Nothing; coordinates.motion + layout.states + 1];
        for line in &coordinates.lines {
            sources[line.position] = Source::Entry(line.velocity);
            sources[line.velocity] = Source::Output(line.column);
        }
        for rotation in &coordinates.rotations {
            (0..3).for_each(|k| sources[rotation.velocity + k] = Source::Output(rotation.column + k));
        }
        for (k, source) in sources[coordinates.motion..].iter_mut().enumerate() {
            *source = Source::Output(columns + rows + k);
        }
        let end = motion.output_count();
        let pivots: Vec<usize> = if rows > 0 { (end - columns - rows..end).collect() } else { Vec::new() };
        let wired = Wired::new(motion, |slot| coordinates.entry_of(slot, layout), &sources, &pivots)?;
        Some(Self {
            workspace: wired.workspace(),
            wired,
            rotations: coordinates.rotations.clone(),
            masses: columns,
            floors: vec![0.0; pivots.len()],
            least: f64::NAN,
        })
    }

    /// The rates of a state; `false` where a pivot is not above what counts as sound, of a mass zero, of a row the share `least` of
    /// its square, or where something is not finite. `given` holds the inputs that are no part of the state. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong.
    #[inline(always)]
    pub(super) fn rates(
        &mut self,
        (given, state): (&[f64], &[f64]),
        sets: &[Box<dyn ElementSet>],
        (least, squares): (f64, &[f64]),
        rates: &mut [f64],
    ) -> Result<bool, AnalysisError> {
        let run = self.wired.run((given, state), sets, &mut self.workspace, rates);
        run.map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
        if least != self.least && !self.floors.is_empty() {
            let of_rows = self.floors[self.masses..].iter_mut().zip(squares);
            of_rows.for_each(|(floor, whole)| *floor = least * whole * CLEARLY);
            self.least = least;
        }
        for Rotation { position, velocity, .. } in &self.rotations {
            let (p, w) = (&state[*position..][..4], &state[*velocity..][..3]);
            let turn = parameter_rates([p[0], p[1], p[2], p[3]], [w[0], w[1], w[2]]);
            rates[*position..][..4].copy_from_slice(&turn);
        }
        // Without ways out. What is no number is not above anything, and no product of it with zero is zero.
        let (mut sound, mut floors) = (true, &self.floors[..]);
        for pivots in self.wired.kept(&self.workspace) {
            let (own, rest) = floors.split_at(pivots.len());
            sound &= pivots.iter().zip(own).fold(true, |sound, (pivot, floor)| sound & (pivot > floor));
            floors = rest;
        }
        let (pairs, last) = rates.as_chunks::<2>();
        let zeros = pairs.iter().fold([0.0; 2], |zeros, rates| [zeros[0] + 0.0 * rates[0], zeros[1] + 0.0 * rates[1]]);
        let zero = last.iter().fold(0.0, |zero, rate| zero + 0.0 * rate);
        Ok(sound & (zeros == [0.0; 2]) & (zero == 0.0))
    }

    /// The program, with how often it was run.
    pub(super) fn used(&mut self) -> Used<'_> {
        self.wired.used(&self.workspace, false)
    }
}
