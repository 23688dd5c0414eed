//! Whose energy a mode is: of bodies, and of elements that store it or bring mass.

use nalgebra::allocator::Allocator;
use nalgebra::{Complex, DMatrix, DefaultAllocator, Dim, Dyn, Matrix3, OMatrix, Vector3};

use crate::eigen::ComplexVector;
use crate::linear::Linear;
use crate::model::{FramePose, Instance, Model, loads_along, mass_at, rotation};
use crate::modes::{Share, shares};
use crate::plan::Layout;

/// Velocities in a vector, on its largest entry, below which bodies stay where they are.
const STILL: f64 = 1e-12;
/// Share of what elements store below which the potential energy of all is round-off.
const ROUND_OFF: f64 = 1e-9;

/// An element that brings kinetic energy, at an instant: six motions of each frame, ground axes, then its flexible coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    /// Its name.
    pub(crate) element: String,
    /// Number among the elements.
    pub(crate) index: usize,
    /// Its mass matrix.
    mass: DMatrix<f64>,
    /// Displacements by states of the linear model.
    positions: DMatrix<f64>,
    /// Their rates.
    velocities: DMatrix<f64>,
    /// With flexible coordinates: its own loads by states, where it does not move.
    pub(crate) loads: Option<DMatrix<f64>>,
    frames: usize,
}

impl Carried {
    /// Of an element; `flexible`: where its states are among those of the linear model.
    fn of(
        linear: &Linear,
        (index, instance): (usize, &Instance),
        inputs: &[f64],
        layout: &Layout,
        place: impl Fn(usize) -> Option<usize>,
    ) -> Option<Self> {
        let recording = &instance.recording;
        let n = recording.flexible();
        let own = layout.states_of(index);
        let states = &inputs[layout.state_slot()..][own.clone()];
        let poses: Vec<FramePose> = (instance.markers.iter())
            .map(|marker| {
                let Some(body) = marker.body else { return (marker.position, marker.rotation) };
                let at = |k: usize| inputs[layout.body_slot(body, k)];
                let turn = rotation(&std::array::from_fn(|k| at(3 + k)));
                (Vector3::new(at(0), at(1), at(2)) + turn * marker.position, turn * marker.rotation)
            })
            .collect();
        let mass = mass_at(recording, &poses, states)?;
        let (frames, columns) = (poses.len(), linear.positions.ncols());
        let mut moved = [&linear.positions, &linear.velocities].map(|of_bodies| {
            let mut moved = DMatrix::zeros(6 * frames + n, columns);
            for (f, (marker, pose)) in instance.markers.iter().zip(&poses).enumerate() {
                let Some(body) = marker.body else { continue };
                let centre = Vector3::from_fn(|k, _| inputs[layout.body_slot(body, k)]);
                let arm = (pose.0 - centre).cross_matrix();
                let (shift, turn) = (of_bodies.rows(6 * body, 3), of_bodies.rows(6 * body + 3, 3));
                moved.rows_mut(6 * f, 3).copy_from(&(shift - arm * turn));
                moved.rows_mut(6 * f + 3, 3).copy_from(&turn);
            }
            moved
        });
        for (kind, moved) in moved.iter_mut().enumerate() {
            for k in 0..n {
                moved[(6 * frames + k, place(own.start + kind * n + k)?)] = 1.0;
            }
        }
        let [positions, velocities] = moved;
        let loads = (n > 0).then(|| loads_along(recording, &poses, states) * &positions);
        Some(Self { element: instance.name.clone(), index, mass, positions, velocities, loads, frames })
    }

    /// All of a scene at an instant, with the inputs of its equations; `states`: the numbers of the element states in the linear model.
    pub(crate) fn all(linear: &Linear, model: &Model, layout: &Layout, inputs: &[f64], states: &[usize]) -> Vec<Self> {
        let first = linear.positions.ncols() - linear.element_states;
        let place = |state: usize| states.iter().position(|known| *known == state).map(|k| first + k);
        let elements = model.elements.iter().enumerate().filter(|(_, element)| element.brings_kinetic());
        elements.filter_map(|element| Self::of(linear, element, inputs, layout, place)).collect()
    }

    fn kinetic(&self, vector: &ComplexVector) -> f64 {
        form(&self.mass, &complex(&self.velocities, vector))
    }

    /// Potential energy of its flexible coordinates.
    fn bent(&self, vector: &ComplexVector) -> f64 {
        let Some(loads) = &self.loads else { return 0.0 };
        let (x, loads) = (complex(&self.positions, vector), complex(loads, vector));
        -0.5 * (6 * self.frames..x.len()).map(|k| (x[k].conj() * loads[k]).re).sum::<f64>()
    }
}

/// Half of v* M v.
fn form(mass: &DMatrix<f64>, v: &ComplexVector) -> f64 {
    0.5 * v.dotc(&complex(mass, v)).re
}

/// A matrix times a complex vector, or several.
pub(crate) fn complex<C: Dim>(matrix: &DMatrix<f64>, of: &Columns<C>) -> Columns<C>
where
    DefaultAllocator: Allocator<Dyn, C>,
{
    let (re, im) = (of.map(|z| z.re), of.map(|z| z.im));
    (matrix * re).zip_map(&(matrix * im), Complex::new)
}

/// Complex vectors, a column each.
type Columns<C> = OMatrix<Complex<f64>, Dyn, C>;

/// The mass matrix of bodies without what elements lend them, ground axes, one block each.
pub(crate) fn own_masses(model: &Model, layout: &Layout, inputs: &[f64]) -> Vec<DMatrix<f64>> {
    let own = |(b, body): (usize, &crate::model::Body)| {
        let turn: Matrix3<f64> = rotation(&std::array::from_fn(|k| inputs[layout.body_slot(b, 3 + k)]));
        let inertia = body.own_inertia();
        let mut block = DMatrix::zeros(6, 6);
        block.view_mut((0, 0), (3, 3)).fill_diagonal(body.own_mass());
        block.view_mut((3, 3), (3, 3)).copy_from(&(turn * inertia * turn.transpose()));
        block
    };
    model.bodies.iter().enumerate().map(own).collect()
}

/// What vectors of states do, a column or a number each.
pub(crate) struct Moved {
    /// Displacements, velocities, and changes of loads of bodies.
    of_bodies: [Columns<Dyn>; 3],
    potential: Vec<f64>,
}

/// What one of them does.
pub(crate) struct Move {
    /// Displacements of bodies.
    pub(crate) displacements: ComplexVector,
    velocities: ComplexVector,
    /// Changes of loads.
    loads: ComplexVector,
    potential: f64,
}

impl Moved {
    pub(crate) fn of(linear: &Linear, vectors: &Columns<Dyn>) -> Self {
        let of_bodies = [&linear.positions, &linear.velocities, &linear.loads].map(|by| complex(by, vectors));
        Self { of_bodies, potential: potential(linear, vectors) }
    }

    /// That of vector `k`.
    pub(crate) fn by(&self, k: usize) -> Move {
        let [displacements, velocities, loads] = self.of_bodies.each_ref().map(|all| all.column(k).into_owned());
        Move { displacements, velocities, loads, potential: self.potential[k] }
    }
}

/// Potential energies of vectors: half of what their displacements do against the forces that they cause, which are masses times the
/// accelerations by displacements alone. The kinetic energy is as much without damping and gyroscopic forces.
fn potential(linear: &Linear, vectors: &Columns<Dyn>) -> Vec<f64> {
    let first = linear.a.nrows() - linear.element_states;
    let flexible = |of: fn(&Carried) -> &DMatrix<f64>, state: usize| {
        let own =
            |one: &Carried| of(one).view((6 * one.frames, state), (one.mass.nrows() - 6 * one.frames, 1)).amax() > 0.0;
        linear.carried.iter().any(own)
    };
    let places = |k: usize| k < linear.coordinates || k >= first && flexible(|one| &one.positions, k);
    let rates = |k: usize| linear.coordinates <= k && k < first || k >= first && flexible(|one| &one.velocities, k);
    let only = |mut of: Columns<Dyn>, kept: &dyn Fn(usize) -> bool| {
        for (_, mut row) in of.row_iter_mut().enumerate().filter(|(k, _)| !kept(*k)) {
            row.fill(Complex::new(0.0, 0.0));
        }
        of
    };
    let displaced = only(vectors.clone(), &places);
    let accelerated = only(complex(&linear.a, &displaced), &rates);
    let mut energies = vec![0.0; vectors.ncols()];
    let mut add = |mass: &DMatrix<f64>, x: &Columns<Dyn>, a: &Columns<Dyn>| {
        let forces = complex(mass, a);
        for (k, energy) in energies.iter_mut().enumerate() {
            *energy -= 0.5 * x.column(k).dotc(&forces.column(k)).re;
        }
    };
    let (x, a) = (complex(&linear.positions, &displaced), complex(&linear.velocities, &accelerated));
    for (body, mass) in linear.own_masses.iter().enumerate() {
        let [x, a] = [&x, &a].map(|of| of.rows(6 * body, 6).into_owned());
        add(mass, &x, &a);
    }
    for one in &linear.carried {
        add(&one.mass, &complex(&one.positions, &displaced), &complex(&one.velocities, &accelerated));
    }
    energies
}

/// Kinetic energies of bodies and of elements that bring some, and potential energies of elements, as shares of the energy of all, of
/// a vector that does this.
pub(crate) fn energies(
    linear: &Linear,
    vector: &ComplexVector,
    Move { displacements: x, velocities: v, loads, potential }: &Move,
) -> (Vec<Share>, Vec<Share>) {
    let of_bodies = linear.own_masses.iter().enumerate();
    let of_bodies = of_bodies.map(|(body, mass)| form(mass, &v.rows(6 * body, 6).into_owned()));
    let kinetic: Vec<(String, f64)> = (linear.bodies.iter().cloned().zip(of_bodies))
        .chain(linear.carried.iter().map(|carried| (carried.element.clone(), carried.kinetic(vector))))
        .collect();
    let all: f64 = kinetic.iter().map(|(_, energy)| energy).sum();
    let flexible = linear.carried.iter().flat_map(|carried| {
        let coordinates = complex(&carried.velocities, vector);
        (6 * carried.frames..coordinates.len()).map(move |k| coordinates[k].norm()).collect::<Vec<f64>>()
    });
    let moves = v.iter().map(|z| z.norm()).chain(flexible).fold(0.0, f64::max);
    // The largest entry of the vector is one.
    if all.is_nan() || all <= 0.0 || moves < STILL {
        return (Vec::new(), Vec::new());
    }
    let mut stored: Vec<(String, f64)> = Vec::new();
    let mut store = |name: &str, energy: f64| match stored.iter_mut().find(|(known, _)| known == name) {
        Some((_, sum)) => *sum += energy,
        None => stored.push((name.to_owned(), energy)),
    };
    for (k, load) in linear.load_list.iter().enumerate().filter(|(_, load)| !load.follows_signals) {
        let part = |of: &ComplexVector, at: usize| [of[at], of[at + 1], of[at + 2]];
        let (force, torque) = (part(loads, 6 * k), part(loads, 6 * k + 3));
        let (shift, turn) = (part(x, 6 * load.body), part(x, 6 * load.body + 3));
        // The moment about the centre of mass is T + s x F, and s turns with the body.
        let moment = {
            let cross = |a: [Complex<f64>; 3], b: Vector3<f64>| {
                [a[1] * b.z - a[2] * b.y, a[2] * b.x - a[0] * b.z, a[0] * b.y - a[1] * b.x]
            };
            let turned = cross(cross(turn, load.arm), load.force);
            let moved = cross(force, load.arm);
            [0, 1, 2].map(|i| torque[i] + turned[i] - moved[i])
        };
        let work: f64 = (0..3).map(|i| (shift[i].conj() * force[i] + turn[i].conj() * moment[i]).re).sum();
        store(&load.element, -0.5 * work);
    }
    for carried in linear.carried.iter().filter(|carried| carried.loads.is_some()) {
        store(&carried.element, carried.bent(vector));
    }
    let whole = potential.abs();
    // Of what is round-off there are no shares.
    let gross: f64 = stored.iter().map(|(_, energy)| energy.abs()).sum();
    stored.retain(|_| whole > ROUND_OFF * gross);
    let parts = |energies: Vec<(String, f64)>, all: f64| {
        shares(energies.into_iter().map(|(name, energy)| (name, energy / all)))
    };
    (parts(kinetic, all), parts(stored, whole))
}
