//! A body that bends: a linear superelement of Craig and Bampton's reduction, carried along by its first frame. It connects frames of
//! bodies (its interfaces, usually light bodies that joints and loads take hold of) by mass and stiffness matrices of their motion and
//! of further modes, read from a file that a finite element program writes.
//!
//! ## Equations
//! With A the rotation of frame 0, X_i the points of the interfaces where nothing is deformed (frames then have the same axes), and q the
//! amplitudes of the modes,
//!
//! ```text
//! e = (u_i, theta_i, q)    u_i = A^T (p_i - p_0) - (X_i - X_0)    theta_i = rotation vector of A^T A_i    i = 1, 2, ...    (1)
//! V = e . K e / 2 - m g . (p_0 + A c)      load = K (e + tau e')                                                        (2)
//! w = (A^T v_i, A^T omega_0 + theta_i', q')  of all frames, 0 too      T = w . M w / 2 + P . (v - P / (2 m))                (3)
//! P = sum over k of omega x m_k e_k - m_k (omega x u)_k      omega = A^T omega_0
//! ```
//!
//! P is the momentum of the deformation as it turns with frame 0, as far as w has it not (modes do not turn in M), m_k the momentum of a
//! unit of e_k', from M, and v the velocity of the centre of mass in axes of frame 0: by Koenig's theorem the whole mass moves as its centre,
//! and what an observer sees does not depend on his velocity. K without the rows of frame 0, which equilibrium gives; m and c, mass and its
//! centre, from M. Loads on the frames and the accelerations q'' follow from (2) and (3) by differentiation: a change of axes of M with
//! frame 0 included, so that energy, momentum and angular momentum are those of (3) exactly. (Craig & Bampton, AIAA Journal 6, 1968;
//! superelements carried by a frame: Cardona & Geradin, International Journal for Numerical Methods in Engineering 32, 1991.)
//!
//! Valid for small deformations: displacements small beside the body's size, rotations below about 0.1 rad; the check `small` warns. What
//! modes between interfaces add to the inertia of rotation is left out (a blade that bends in the plane in which it turns is softened by that). So is stiffening
//! by axial forces, unless `geometric` gives it: a blade becomes stiffer as it turns, since its lines shorten as they bend, against the
//! centrifugal force. With the geometric stiffness G_k of the structure, held at frame 0, in a
//! uniform acceleration of frame 0 of 1 m/s^2 along -k (mass forces along k), and C_ab the part in omega_a omega_b of that in a rotation,
//!
//! ```text
//! S_k = -e . G_k e / 2      T + v . (omega x S + S') - sum of omega_a omega_b e . C_ab e / 2      V - g . A S       (4)
//! ```
//!
//! `radau5` takes small steps with (4); prefer `dop853`.
//! This is the mass of the body itself: forces at the interfaces do not stiffen it. (Geometric stiffness of inertia loads: Przemieniecki, Theory of
//! Matrix Structural Analysis, 1968, ch. 15; Wallrapp & Schwertassek, International Journal for Numerical Methods in Engineering 32, 1991.)
//!
//! The file, as a scene names it:
//! `params.matrices = { file = "beam.csv", columns = ["row", "column", "mass", "stiffness"] }`: a line for each pair of degrees of freedom
//! that has an entry, in one triangle, numbered from 1: displacements x, y, z and rotations x, y, z of each interface in the order
//! of `bodies`, then modes. SI units (kg, m, rad), no units in the file, since the entries of a matrix have different ones. Lines that begin with
//! `#` are remarks. A rigid motion may meet forces of up to a millionth of what the stiffness could add up to, where no entry K_ij counts as less
//! than sqrt(K_ii K_jj): so much of it is taken for the round-off of a reduction, and for that of printing eight digits or more.
//! `geometric` is given likewise, with `columns = ["row", "column", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "zx"]`:
//! G_x, G_y, G_z and C_ab, those of two axes for both orders together. Modes may have any scale. The sources have a program that
//! writes such a file of a beam: `cargo run -p odyn-tests --example craig_bampton`.
//!
//! ## Signs
//! Channels are the element's own: what the bodies that it joins have on top is not counted. Momenta are about the origin of the ground.
//!
//! ## Singular cases
//! The bodies at the interfaces may be as light as they are beside the element; their inertia is on top of it.
//! Interfaces must not turn by half a turn against frame 0. Modes of high frequency make the equations stiff: take as many as the motion
//! needs, or `radau5`.
//!
//! ## Example
//! ```toml
//! title = "A bar that stretches, held at one end"
//!
//! [plugins]
//! libraries = ["odyn-forces", "odyn-joints"]
//!
//! [simulation]
//! t_end = 0.1
//! output_step = 0.001
//!
//! [[body]]
//! name = "tip"
//! mass = 1
//! inertia = [0.01, 0.01, 0.01]
//! position = [1, 0, 0]
//! velocity = [0.1, 0, 0]
//!
//! [[joint]]
//! name = "guide"
//! type = "translational"
//! bodies = ["ground", "tip"]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "bar"
//! type = "modal-body"
//! bodies = ["ground", "tip"]
//! frames = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }]
//! [force.params]
//! points = [0, 0, 0, 1, 0, 0]
//! matrices = [
//!   1, 1, 1, 1e4,
//!   7, 1, 0.5, -1e4,
//!   7, 7, 1, 1e4,
//!   2, 2, 1, 0, 8, 2, 0.5, 0, 8, 8, 1, 0,
//!   3, 3, 1, 0, 9, 3, 0.5, 0, 9, 9, 1, 0,
//! ]
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "tip"
//! component = "x"
//! ```

mod data;

use element_api::prelude::*;

use data::{Data, PRODUCTS, Stiffening};

/// The element.
#[derive(Debug, Clone)]
pub struct ModalBody {
    data: Data,
    damping: f64,
    gravity: [f64; 3],
    amplitudes: Vec<f64>,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct ModalBodyParameters {
    /// Entries of the matrices: row, column, mass, stiffness of each, SI; see the page of the element.
    #[param(example = [
        1.0, 1.0, 1.0, 10000.0,
        7.0, 1.0, 0.5, -10000.0,
        7.0, 7.0, 1.0, 10000.0,
        2.0, 2.0, 1.0, 0.0,
        8.0, 2.0, 0.5, 0.0,
        8.0, 8.0, 1.0, 0.0,
        3.0, 3.0, 1.0, 0.0,
        9.0, 3.0, 0.5, 0.0,
        9.0, 9.0, 1.0, 0.0,
        13.0, 1.0, 0.5, 0.0,
        13.0, 13.0, 1.0, 9.0,
    ])]
    pub matrices: Vec<f64>,
    /// Points of the interfaces where nothing is deformed, three numbers each, in axes of frame 0; only their differences count.
    #[param(unit = "m", example = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0])]
    pub points: Vec<f64>,
    /// Entries of the geometric stiffness: row, column, nine values of each, SI; see the page of the element. None: loads do not stiffen.
    pub geometric: Option<Vec<f64>>,
    /// Damping in proportion to stiffness, tau.
    #[param(unit = "s", min = 0.0, default = 0.0)]
    pub damping: f64,
    /// Gravity, ground axes; that of the scene is not known to elements.
    #[param(unit = "m/s^2", default = [0.0; 3])]
    pub gravity: [f64; 3],
    /// Amplitudes of the modes at the start; none: zero.
    pub amplitudes: Option<Vec<f64>>,
}

impl Element for ModalBody {
    const NAME: &'static str = "modal-body";
    const SUMMARY: &'static str = "a body that bends: mass and stiffness matrices of interfaces and modes, from a file";
    const DOC: &'static str = doc_of(include_str!("modal_body.rs"));
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("0", "the first interface; it carries the axes of the matrices")];
    const MORE_FRAMES: Option<FrameSpec> =
        Some(FrameSpec::new("interface", "a further interface; undeformed, with the axes of frame 0"));
    const EXEMPT: &'static [(&'static str, &'static str)] =
        &[("frame-invariance", "momenta are reported along axes of the ground")];
    type Parameters = ModalBodyParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let mut data = Data::new(&p.matrices, &p.points)?;
        if let Some(geometric) = &p.geometric {
            data.stiffen(geometric)?;
        }
        let amplitudes = p.amplitudes.unwrap_or_else(|| vec![0.0; data.modes()]);
        if amplitudes.len() != data.modes() {
            let message = format!("needs {} numbers, one per mode; found {}", data.modes(), amplitudes.len());
            return Err(ParamError::new("amplitudes", message));
        }
        Ok(Self { data, damping: p.damping, gravity: p.gravity, amplitudes })
    }

    fn with_frames(self, count: usize) -> Result<Self, ParamError> {
        if self.data.points.len() == count {
            return Ok(self);
        }
        let message = format!("are {count}, `points` has {} interfaces", self.data.points.len());
        Err(ParamError::new("bodies", message))
    }
}

/// What the deformation is at an instant.
struct Deformed<S> {
    /// e and e', numbered as the matrices; six zeros for frame 0.
    e: Vec<S>,
    rate: Vec<S>,
}

/// What shortens: (4).
struct Shortened<S> {
    /// S and S'.
    first: Vec3<S>,
    rate: Vec3<S>,
    /// e . C_ab e / 2.
    by_spin: [S; 6],
}

impl<S: Scalar> Shortened<S> {
    /// What v is multiplied with.
    fn momentum(&self, omega: Vec3<S>) -> Vec3<S> {
        omega.cross(&self.first) + self.rate
    }

    /// What it adds to the kinetic energy.
    fn energy(&self, v: Vec3<S>, omega: Vec3<S>) -> S {
        let parts = PRODUCTS.iter().zip(&self.by_spin);
        parts.fold(v.dot(&self.momentum(omega)), |sum, ([a, b], form)| sum - omega[*a] * omega[*b] * *form)
    }

    /// What it adds to the angular momentum about frame 0.
    fn angular(&self, v: Vec3<S>, omega: Vec3<S>) -> Vec3<S> {
        let mut sum = self.first.cross(&v);
        for ([a, b], form) in PRODUCTS.iter().zip(&self.by_spin) {
            sum[*a] -= omega[*b] * *form;
            sum[*b] -= omega[*a] * *form;
        }
        sum
    }
}

impl ModalBody {
    /// (4); nothing where no geometric stiffness is given.
    fn shortened<S: Scalar>(&self, deformed: &Deformed<S>) -> Option<Shortened<S>> {
        let Stiffening { by_acceleration, by_spin } = self.data.stiffening.as_ref()?;
        let (e, rate) = (&deformed.e, &deformed.rate);
        let first = Vec3::from(by_acceleration.each_ref().map(|matrix| matrix.form(e) * -0.5));
        let products = by_acceleration.each_ref().map(|matrix| {
            let products = matrix.product(e);
            products.iter().zip(rate).fold(S::zero(), |sum, (product, rate)| sum - *product * *rate)
        });
        let by_spin = by_spin.each_ref().map(|matrix| matrix.form(e) * 0.5);
        Some(Shortened { first, rate: Vec3::from(products), by_spin })
    }

    /// The kinetic energy, with w of (3).
    fn energy<S: Scalar>(&self, deformed: &Deformed<S>, w: &[S]) -> S {
        let omega = three(w, 3);
        let turned = self.turned(&deformed.e, omega);
        let whole = self.momentum(deformed, w) - turned * S::from(0.5);
        let energy = self.data.mass.form(w) * 0.5 + turned.dot(&whole) * (1.0 / self.data.mass_of_all);
        let shortened = self.shortened(deformed);
        shortened.map_or(energy, |shortened| energy + shortened.energy(three(w, 0), omega))
    }

    /// P of (3).
    fn turned<S: Scalar>(&self, e: &[S], omega: Vec3<S>) -> Vec3<S> {
        let mut momentum = omega.cross(&self.moment(e));
        for i in 1..self.data.points.len() {
            for (carried, turning) in self.data.carried[6 * i..].iter().zip(omega.cross(&three(e, 6 * i)).iter()) {
                momentum -= Vec3::from(carried.map(|carried| *turning * carried));
            }
        }
        momentum
    }

    /// m v of (3).
    fn momentum<S: Scalar>(&self, deformed: &Deformed<S>, w: &[S]) -> Vec3<S> {
        let carrying =
            three(w, 0) * S::from(self.data.mass_of_all) + three(w, 3).cross(&self.whole_moment(&deformed.e));
        carrying + self.moment(&deformed.rate)
    }

    /// What the second term of T in (3) adds to the angular momentum about frame 0.
    fn turned_angular<S: Scalar>(&self, deformed: &Deformed<S>, w: &[S], turned: Vec3<S>) -> Vec3<S> {
        let e = &deformed.e;
        let whole = self.momentum(deformed, w);
        let (mean, without) = (S::from(1.0 / self.data.mass_of_all), whole - turned);
        let mut angular = self.whole_moment(e).cross(&whole) * mean;
        angular -= self.whole_moment(&[]).cross(&without) * mean;
        for i in 1..self.data.points.len() {
            let row = |k: usize| Vec3::from(self.data.carried[6 * i + k].map(S::from)).dot(&without) * mean;
            angular -= three(e, 6 * i).cross(&Vec3::new(row(0), row(1), row(2)));
        }
        angular
    }

    /// Mass times the centre of mass, against frame 0.
    fn whole_moment<S: Scalar>(&self, e: &[S]) -> Vec3<S> {
        Vec3::from(self.data.centre.map(|c| S::from(c * self.data.mass_of_all))) + self.moment(e)
    }

    /// The deformation's part in it; of rates, that in the momentum.
    fn moment<S: Scalar>(&self, e: &[S]) -> Vec3<S> {
        let parts = e.iter().zip(&self.data.carried).skip(6);
        parts.fold(Vec3::from_element(S::zero()), |sum, (e, carried)| {
            sum + Vec3::from(carried.map(|carried| *e * carried))
        })
    }

    /// (1)
    fn deformed<S: Scalar>(&self, at: &Motion<'_, S>) -> Deformed<S> {
        let (frames, twists) = (at.frames(), at.twists);
        let first = &frames[0];
        let (mut e, mut rate) = (vec![S::zero(); 6], vec![S::zero(); 6]);
        for (i, frame) in frames.iter().enumerate().skip(1) {
            let d = frame.position - first.position;
            let u = first.rotation.tr_mul(&d) - Vec3::from(self.data.offset(i).map(S::from));
            let theta = blocks::rotation_vector(first, frame);
            e.extend(u.iter().chain(theta.iter()).copied());
            let carried = twists[0].angular_velocity.cross(&d);
            let u = first.rotation.tr_mul(&(at.relative_velocity(0, i) - carried));
            let spin = first.rotation.tr_mul(&(twists[i].angular_velocity - twists[0].angular_velocity));
            let turning = blocks::rotation_vector_rate(theta, spin);
            rate.extend(u.iter().chain(turning.iter()).copied());
        }
        let (q, speeds) = at.states.split_at(self.data.modes());
        e.extend(q);
        rate.extend(speeds);
        Deformed { e, rate }
    }

    /// What resists e: (2), less the weight's part.
    fn load<S: Scalar>(&self, at: &Motion<'_, S>, deformed: &Deformed<S>) -> Vec<S> {
        let whole: Vec<S> = match self.damping {
            0.0 => deformed.e.clone(),
            tau => deformed.e.iter().zip(&deformed.rate).map(|(e, rate)| *e + *rate * tau).collect(),
        };
        let mut load = self.data.stiffness.product(&whole);
        if self.gravity != [0.0; 3] {
            let weight = at.frames()[0].rotation.tr_mul(&Vec3::from(self.gravity.map(S::from)));
            for (load, carried) in load.iter_mut().zip(&self.data.carried) {
                *load -= weight.x * carried[0] + weight.y * carried[1] + weight.z * carried[2];
            }
            if let Some(stiffening) = &self.data.stiffening {
                for (matrix, weight) in stiffening.by_acceleration.iter().zip(weight.iter()) {
                    let products = matrix.product(&deformed.e);
                    load.iter_mut().zip(products).for_each(|(load, product)| *load += product * *weight);
                }
            }
        }
        load
    }

    /// The centre of mass, ground.
    fn centre<S: Scalar>(&self, at: &Motion<'_, S>, deformed: &Deformed<S>) -> Vec3<S> {
        let first = &at.frames()[0];
        let mut centre = self.whole_moment(&deformed.e) * S::from(1.0 / self.data.mass_of_all);
        if let Some(shortened) = self.shortened(deformed) {
            centre += shortened.first * S::from(1.0 / self.data.mass_of_all);
        }
        first.position + first.rotation * centre
    }

    /// w of (3): the shapes that M was made with move at the rates of rotation vectors.
    fn velocities<S: Scalar>(&self, at: &Motion<'_, S>, deformed: &Deformed<S>) -> Vec<S> {
        let rotation = at.frames()[0].rotation;
        let carrying = rotation.tr_mul(&at.twists[0].angular_velocity);
        let mut w = Vec::new();
        for (i, twist) in at.twists.iter().enumerate() {
            let turning = if i == 0 { carrying } else { carrying + three(&deformed.rate, 6 * i + 3) };
            w.extend(rotation.tr_mul(&twist.velocity).iter().chain(turning.iter()));
        }
        w.extend(&at.states[self.data.modes()..]);
        w
    }
}

fn three<S: Scalar>(list: &[S], at: usize) -> Vec3<S> {
    Vec3::new(list[at], list[at + 1], list[at + 2])
}

impl Force for ModalBody {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("elastic_energy", "J", "energy of the deformation"),
        ChannelSpec::new("kinetic_energy", "J", "kinetic energy"),
        ChannelSpec::new("momentum_x", "kg m/s", "momentum along x of the ground"),
        ChannelSpec::new("momentum_y", "kg m/s", "the same along y"),
        ChannelSpec::new("momentum_z", "kg m/s", "the same along z"),
        ChannelSpec::new("angular_momentum_x", "N m s", "angular momentum about the origin of the ground, x"),
        ChannelSpec::new("angular_momentum_y", "N m s", "the same, y"),
        ChannelSpec::new("angular_momentum_z", "N m s", "the same, z"),
    ];
    const CHECKS: &'static [ChannelSpec] =
        &[ChannelSpec::new("small", "1", "is deformed by more than a tenth of its size, or 0.1 rad: it is linear")];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let deformed = self.deformed(at);
        let load = self.load(at, &deformed);
        let rotation = at.frames()[0].rotation;
        for i in 1..at.frames().len() {
            let torque = blocks::conjugate_torque(three(&deformed.e, 6 * i + 3), three(&load, 6 * i + 3));
            out.force_pair(0, i, -(rotation * three(&load, 6 * i)));
            out.torque_pair(0, i, -(rotation * torque));
        }
        if self.gravity != [0.0; 3] {
            let weight = Vec3::from(self.gravity.map(|g| S::from(g * self.data.mass_of_all)));
            out.force_at(0, self.centre(at, &deformed), weight);
        }
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let deformed = self.deformed(at);
        out.push(self.data.stiffness.form(&deformed.e) * 0.5);
        let w = self.velocities(at, &deformed);
        out.push(self.energy(&deformed, &w));
        let (velocity, omega) = (three(&w, 0), three(&w, 3));
        let mut momenta = self.data.mass.product(&w);
        // What (3) and (4) have beside M is carried by frame 0.
        let mut carry = |linear: Vec3<S>, about: Vec3<S>| {
            momenta.iter_mut().zip(linear.iter().chain(about.iter())).for_each(|(momentum, part)| *momentum += *part);
        };
        let turned = self.turned(&deformed.e, omega);
        carry(turned, self.turned_angular(&deformed, &w, turned));
        if let Some(shortened) = self.shortened(&deformed) {
            carry(shortened.momentum(omega), shortened.angular(velocity, omega));
        }
        let rotation = at.frames()[0].rotation;
        let (mut momentum, mut angular) = (Vec3::from_element(S::zero()), Vec3::from_element(S::zero()));
        for (i, frame) in at.frames().iter().enumerate() {
            let own = rotation * three(&momenta, 6 * i);
            momentum += own;
            angular += frame.position.cross(&own) + rotation * three(&momenta, 6 * i + 3);
        }
        out.push_vector(momentum);
        out.push_vector(angular);
    }

    fn checks<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let e = self.deformed(at).e;
        let mut most = S::zero();
        for i in 1..at.frames().len() {
            let (u, theta) = (three(&e, 6 * i) * S::from(1.0 / self.data.size), three(&e, 6 * i + 3));
            most = most.max(u.dot(&u)).max(theta.dot(&theta));
        }
        out.push(S::from(0.01) - most);
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let deformed = self.deformed(at);
        let elastic = self.data.stiffness.form(&deformed.e) * 0.5;
        if self.gravity == [0.0; 3] {
            return Some(elastic);
        }
        let weight = Vec3::from(self.gravity.map(|g| S::from(g * self.data.mass_of_all)));
        Some(elastic - weight.dot(&self.centre(at, &deformed)))
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        (self.damping > 0.0).then(|| self.data.stiffness.form(&self.deformed(at).rate) * self.damping)
    }

    fn kinetic<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let deformed = self.deformed(at);
        Some(self.energy(&deformed, &self.velocities(at, &deformed)))
    }

    fn flexible(&self) -> usize {
        self.data.modes()
    }

    fn flexible_forces<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let load = self.load(at, &self.deformed(at));
        load[6 * self.data.points.len()..].iter().for_each(|load| out.push(-*load));
    }

    fn initial_states(&self) -> Vec<f64> {
        let mut states = self.amplitudes.clone();
        states.resize(2 * self.data.modes(), 0.0);
        states
    }
}
