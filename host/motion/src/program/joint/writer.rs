//! [`Writer`]: bodies written onto their trees, joint by joint.

use super::*;

/// What a joint does by its own coordinates.
struct Motion {
    /// Pose of the second frame in the first, without the free rotation.
    position: V3,
    turn: M3,
    /// The free rotation, after the pose.
    free: Option<M3>,
    /// Columns of the coordinates, and their velocities.
    columns: Vec<usize>,
    velocities: Vec<Node>,
    q: Vec<Node>,
    /// Column of the free rotation, and its angular velocity in the axes of the second frame.
    spin_column: usize,
    spin: V3,
}

/// Writes bodies onto their trees.
pub(super) struct Writer {
    pub(super) g: Graph,
    pub(super) coordinates: Coordinates,
    pub(super) rotations: Vec<M3>,
    pub(super) carried: Vec<Option<Carried>>,
    lines: usize,
    /// Whether partial velocities are written: only accelerations body by body do without.
    partials: bool,
}

impl Writer {
    pub(super) fn new(coordinates: Coordinates, model: &Model, partials: bool) -> Self {
        let carried = vec![None; model.bodies.len()];
        Self { g: Graph::default(), coordinates, rotations: Vec::new(), carried, lines: 0, partials }
    }

    /// The joint's next coordinates.
    fn motion(&mut self, joint: &TreeJoint, model: &Model) -> Motion {
        let g = &mut self.g;
        let lines = &self.coordinates.lines[self.lines..self.lines + joint.coordinates];
        self.lines += joint.coordinates;
        let q: Vec<Node> = lines.iter().map(|line| g.input(self.coordinates.slot_of(line.position))).collect();
        let velocities = lines.iter().map(|line| g.input(self.coordinates.slot_of(line.velocity))).collect();
        let columns = lines.iter().map(|line| line.column).collect();
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        let unit: M3 = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { one } else { zero }));
        let (position, turn) = match joint.element {
            Some(element) => pose_nodes(g, model, element, &q),
            None => ([q[0], q[1], q[2]], unit),
        };
        let (mut free, mut spin, mut spin_column) = (None, [zero; 3], 0);
        if joint.rotates {
            let rotation = self.coordinates.rotations[self.rotations.len()];
            let p = std::array::from_fn(|k| g.input(self.coordinates.slot_of(rotation.position + k)));
            let matrix = rotation_nodes(g, &p, Form::Working);
            self.rotations.push(matrix);
            free = Some(matrix);
            spin = std::array::from_fn(|k| g.input(self.coordinates.slot_of(rotation.velocity + k)));
            spin_column = rotation.column;
        }
        Motion { position, turn, free, columns, velocities, q, spin_column, spin }
    }

    /// Hangs the next body on its joint; `anew`: its quantities are taken at a point of their own.
    pub(super) fn hang(&mut self, joint: &TreeJoint, model: &Model, anew: bool) {
        let motion = self.motion(joint, model);
        let child = joint.child;
        self.carried[child] = Some(match joint.markers(model) {
            None => self.floating(&motion, model, child),
            Some(markers) => self.jointed(joint, &motion, &markers, anew),
        });
    }

    /// A body that floats: its own centre of mass is the reference point.
    fn floating(&mut self, motion: &Motion, model: &Model, child: usize) -> Carried {
        let g = &mut self.g;
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        let nothing = [zero; 3];
        let unit = |k: usize| -> V3 { std::array::from_fn(|i| if i == k { one } else { zero }) };
        let a = motion.free.unwrap_or_else(|| g.matrix(&rotation(&model.bodies[child].orientation)));
        let mut partials: Vec<Partial> = motion
            .columns
            .iter()
            .enumerate()
            .map(|(k, column)| Partial { column: *column, along: unit(k), about: nothing })
            .collect();
        if motion.free.is_some() {
            let about = |k| Partial { column: motion.spin_column + k, along: nothing, about: unit(k) };
            partials.extend((0..3).map(about));
        }
        let v = [motion.velocities[0], motion.velocities[1], motion.velocities[2]];
        let spin = g.apply(&a, motion.spin);
        Carried {
            nodes: BodyNodes { r: motion.position, p: [zero; 4], a, v, w: motion.spin, p_rate: [zero; 4] },
            whole: nothing,
            d: nothing,
            shift: None,
            spin,
            own: partials.clone(),
            partials,
            at_joint: nothing,
            bias: nothing,
            spin_bias: nothing,
            spin_bias_ground: nothing,
            reference: motion.position,
        }
    }

    /// The ground as a body: the reference point is where the joint sits on it.
    pub(super) fn ground(&mut self, reference: V3) -> Carried {
        let g = &mut self.g;
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        let nothing = [zero; 3];
        let a = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { one } else { zero }));
        Carried {
            nodes: BodyNodes { r: reference, p: [zero; 4], a, v: nothing, w: nothing, p_rate: [zero; 4] },
            whole: nothing,
            d: nothing,
            shift: None,
            spin: nothing,
            partials: Vec::new(),
            own: Vec::new(),
            at_joint: nothing,
            bias: nothing,
            spin_bias: nothing,
            spin_bias_ground: nothing,
            reference,
        }
    }

    /// A body on a joint. Suffixes: i and j are the joint's first and second frame, a the parent, b the child.
    fn jointed(&mut self, joint: &TreeJoint, motion: &Motion, markers: &[Marker; 2], anew: bool) -> Carried {
        let (near, far) = if joint.reversed { (&markers[1], &markers[0]) } else { (&markers[0], &markers[1]) };
        let (arm_near, arm_far);
        let parent = match joint.parent {
            Some(parent) => {
                arm_near = self.g.vector(&near.position);
                self.carried[parent].clone().expect("parents come before children")
            }
            None => {
                let reference = self.g.vector(&near.position);
                let zero = self.g.constant(0.0);
                arm_near = [zero; 3];
                self.ground(reference)
            }
        };
        let g = &mut self.g;
        arm_far = g.vector(&far.position);
        let (mount_near, mount_far) = (g.matrix(&near.rotation), g.matrix(&far.rotation));
        // Rotation frame j -> frame i, and child -> parent.
        let turn = match &motion.free {
            Some(free) => g.product(&motion.turn, free),
            None => motion.turn,
        };
        let across = if joint.reversed { transposed(&turn) } else { turn };
        let relative = g.product(&mount_near, &across);
        let relative = g.product(&relative, &transposed(&mount_far));
        let a = g.product(&parent.nodes.a, &relative);
        // The first frame's axes in ground, through the body that carries it.
        let axes_i = match joint.reversed {
            false => g.product(&parent.nodes.a, &mount_near),
            true => g.product(&a, &mount_far),
        };
        let slide = g.apply(&axes_i, motion.position);
        let arm_a = g.apply(&parent.nodes.a, arm_near);
        let arm_b = g.apply(&a, arm_far);
        // From the parent's centre of mass to frame j's origin (z), from there to the child's (y).
        let back = g.neg3(arm_b);
        let (z, y) = match joint.reversed {
            false => (g.add3(arm_a, slide), back),
            true => (arm_a, g.sub3(back, slide)),
        };
        let reached = g.add3(parent.whole, z);
        let whole = g.add3(reached, y);
        let reached = g.add3(parent.d, z);
        let (at_joint, shift) = if anew { ([g.constant(0.0); 3], Some(reached)) } else { (reached, None) };
        let d = g.add3(at_joint, y);
        let own = own_partials(g, motion, &turn, &axes_i, &mount_far, joint.reversed);
        // Angular velocity and its bias, body axes of the child.
        let carried_w = g.apply_transposed(&relative, parent.nodes.w);
        let zero = g.constant(0.0);
        let (mut own_w, mut v_own) = ([zero; 3], [zero; 3]);
        let rates = motion.velocities.iter().chain(if motion.free.is_some() { &motion.spin[..] } else { &[] });
        for (partial, rate) in own.iter().zip(rates) {
            let part = g.scale3(*rate, partial.about);
            own_w = g.add3(own_w, part);
            let part = g.scale3(*rate, partial.along);
            v_own = g.add3(v_own, part);
        }
        let w = g.add3(carried_w, own_w);
        let spin = g.apply(&a, w);
        let seeds = motion_seeds(g, motion);
        let own_bias = derivatives(g, &own_w, &seeds);
        let carried_bias = g.apply_transposed(&relative, parent.spin_bias);
        let crossed = g.cross(carried_w, own_w);
        let spin_bias = g.add3(carried_bias, crossed);
        let spin_bias = g.add3(spin_bias, [own_bias[0], own_bias[1], own_bias[2]]);
        let spin_bias_ground = g.apply(&a, spin_bias);
        // Velocity and acceleration of the child's point at frame j's origin, then of its centre of mass.
        let swept = g.cross(parent.spin, z);
        let v_joint = g.add3(parent.nodes.v, swept);
        let v_joint = g.add3(v_joint, v_own);
        let swept = g.cross(spin, y);
        let v = g.add3(v_joint, swept);
        let slide_bias = slide_bias(g, motion, &seeds, &axes_i, joint.reversed);
        let carrier = if joint.reversed { spin } else { parent.spin };
        let coriolis = g.cross(carrier, v_own);
        let two = g.constant(2.0);
        let coriolis = g.scale3(two, coriolis);
        let swept = swept_acceleration(g, parent.spin_bias_ground, parent.spin, z);
        let bias = g.add3(parent.bias, swept);
        let bias = g.add3(bias, coriolis);
        let bias = g.add3(bias, slide_bias);
        let swept = swept_acceleration(g, spin_bias_ground, spin, y);
        let bias = g.add3(bias, swept);
        // Partial velocities: those of the parent, carried on, and the joint's own.
        let way = g.add3(z, y);
        let mut partials = Vec::new();
        for partial in &parent.partials {
            let axis = g.apply(&parent.nodes.a, partial.about);
            let swept = g.cross(axis, way);
            let along = g.add3(partial.along, swept);
            partials.push(Partial {
                column: partial.column,
                along,
                about: g.apply_transposed(&relative, partial.about),
            });
        }
        for partial in own.iter().filter(|_| self.partials) {
            let axis = g.apply(&a, partial.about);
            let swept = g.cross(axis, y);
            partials.push(Partial { along: g.add3(partial.along, swept), ..*partial });
        }
        let r = g.add3(parent.reference, whole);
        Carried {
            nodes: BodyNodes { r, p: [zero; 4], a, v, w, p_rate: [zero; 4] },
            whole,
            d,
            shift,
            spin,
            partials,
            own,
            at_joint,
            bias,
            spin_bias,
            spin_bias_ground,
            reference: parent.reference,
        }
    }
}

/// The joint's own partial velocities of the child's point at frame j's origin.
fn own_partials(
    g: &mut Graph,
    motion: &Motion,
    turn: &M3,
    axes_i: &M3,
    mount_far: &M3,
    reversed: bool,
) -> Vec<Partial> {
    let one = g.constant(1.0);
    let mut own = Vec::with_capacity(motion.columns.len() + 3);
    for (q, column) in motion.q.iter().zip(&motion.columns) {
        let seeds = Seeds::from_iter([(*q, one)]);
        let slide = derivatives(g, &motion.position, &seeds);
        let flat: Vec<Node> = entries(&motion.turn).collect();
        let slopes = derivatives(g, &flat, &seeds);
        let slopes: M3 = std::array::from_fn(|i| std::array::from_fn(|j| slopes[3 * i + j]));
        // R' R^T is the matrix of the axis, in the axes of frame i.
        let spin = g.product(&slopes, &transposed(&motion.turn));
        let axis = [spin[2][1], spin[0][2], spin[1][0]];
        let along = g.apply(axes_i, [slide[0], slide[1], slide[2]]);
        own.push(match reversed {
            false => {
                let axis = g.apply_transposed(turn, axis);
                Partial { column: *column, along, about: g.apply(mount_far, axis) }
            }
            true => {
                let about = g.apply(mount_far, axis);
                Partial { column: *column, along: g.neg3(along), about: g.neg3(about) }
            }
        });
    }
    if motion.free.is_some() {
        let zero = g.constant(0.0);
        for k in 0..3 {
            let axis: V3 = std::array::from_fn(|i| if i == k { one } else { zero });
            let about = match reversed {
                false => g.apply(mount_far, axis),
                true => {
                    let axis = g.apply(turn, axis);
                    let about = g.apply(mount_far, axis);
                    g.neg3(about)
                }
            };
            own.push(Partial { column: motion.spin_column + k, along: [zero; 3], about });
        }
    }
    own
}

/// The direction of the joint's own motion.
fn motion_seeds(g: &mut Graph, motion: &Motion) -> Seeds {
    let mut seeds: Seeds = motion.q.iter().copied().zip(motion.velocities.iter().copied()).collect();
    if let Some(free) = &motion.free {
        let rate = g.times_skew(free, motion.spin);
        seeds.extend(entries(free).zip(entries(&rate)));
    }
    seeds
}

/// Second derivative of the pose's position along the motion, ground axes, as seen by the child.
fn slide_bias(g: &mut Graph, motion: &Motion, seeds: &Seeds, axes_i: &M3, reversed: bool) -> V3 {
    let rate = derivatives(g, &motion.position, seeds);
    let second = derivatives(g, &rate, seeds);
    let bias = g.apply(axes_i, [second[0], second[1], second[2]]);
    if reversed { g.neg3(bias) } else { bias }
}

/// alpha x s + omega x (omega x s)
fn swept_acceleration(g: &mut Graph, alpha: V3, omega: V3, s: V3) -> V3 {
    let turned = g.cross(alpha, s);
    let swept = g.cross(omega, s);
    let inward = g.cross(omega, swept);
    g.add3(turned, inward)
}

fn transposed(m: &M3) -> M3 {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}
