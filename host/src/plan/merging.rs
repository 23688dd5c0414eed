//! [`Merging`]: bodies that joints without freedom hold together, as one body.
//!
//! A joint that offers a mobility of no coordinates holds one body in another's frame for good. So all bodies that such joints
//! connect move as one, with the sum of their masses, their common centre of mass and the sum of their inertias about it
//! (Haug 1989, section 11.2: parallel axes); those that hang on the ground do not move. Markers are carried over; the rows of
//! joints whose frames all are on one body hold by themselves and are dropped. Elements stay where they are in the list, with
//! their states, angles and signals.
//!
//! Where an element asks for what the merged scene cannot tell, the bodies in question are not merged: the reaction of a joint
//! within a merged body, a quantity in the axes of a body that is no longer there.

use element_api::Kind;
use nalgebra::{Matrix3, Vector3};

use super::tree::{SpanningTree, TreeJoint};
use crate::model::{Axes, Body, Instance, Level, Marker, Model, Quantity, Source};

/// See the module documentation. Constant.
pub struct Merging {
    /// The joints that hold bodies, parents before children; all of them have an element.
    pub joints: Vec<TreeJoint>,
    /// Per body of the scene: its centroidal frame as a marker on a body of [`Merging::model`], or on the ground.
    pub places: Vec<Marker>,
    /// Per body of [`Merging::model`]: the body of the scene whose axes it has.
    pub heads: Vec<usize>,
    /// The merged scene. It has no channels, and no element sets of its own.
    pub model: Model,
}

/// A joint that could hold bodies but must not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// Which element.
    pub element: usize,
    /// Why, in words.
    pub why: String,
}

/// Why something cannot be told in a merged scene: a joint that is not to hold for it or, where it does not, bodies that are
/// not to be held.
struct Missing {
    why: String,
    joint: Option<usize>,
    bodies: Vec<usize>,
}

impl Merging {
    /// Merges a model; `None` where there is nothing to merge. `timed` tells which elements have rows that depend on time (or
    /// might), `relative` where a joint without freedom holds the centroidal frame of its child: in that of its parent, or in
    /// the ground; `None` where that is not where the child is.
    #[must_use]
    pub fn find(
        model: &Model,
        timed: impl Fn(usize) -> bool,
        relative: impl Fn(&TreeJoint) -> Option<Marker>,
    ) -> (Option<Self>, Vec<Refused>) {
        let mut refused: Vec<Refused> = Vec::new();
        let rigid = |e: usize| is_rigid(&model.elements[e]);
        if !(0..model.elements.len()).any(rigid) {
            return (None, refused);
        }
        loop {
            let usable = |e: usize| rigid(e) && refused.iter().all(|known| known.element != e);
            let mut joints = SpanningTree::new(model, usable).joints;
            joints.retain(|joint| joint.element.is_some());
            if joints.is_empty() {
                return (None, refused);
            }
            match Self::with(model, joints, &timed, &relative) {
                Ok(found) => return (Some(found), refused),
                Err(more) => refused.extend(more),
            }
        }
    }

    /// Merges what these joints hold, or tells which of them must not.
    fn with(
        model: &Model,
        joints: Vec<TreeJoint>,
        timed: impl Fn(usize) -> bool,
        relative: impl Fn(&TreeJoint) -> Option<Marker>,
    ) -> Result<Self, Vec<Refused>> {
        let refusing = |which: &dyn Fn(&TreeJoint) -> bool, why: &str| -> Vec<Refused> {
            let elements = joints.iter().filter(|joint| which(joint)).filter_map(|joint| joint.element);
            elements.map(|element| Refused { element, why: why.into() }).collect()
        };
        let mut held: Vec<Option<Marker>> = vec![None; model.bodies.len()];
        for joint in &joints {
            held[joint.child] = relative(joint);
        }
        let off = |joint: &TreeJoint| held[joint.child].is_none();
        if joints.iter().any(off) {
            return Err(refusing(&off, "its mobility does not tell the position that its rows ask for"));
        }
        let heads: Vec<usize> = (0..held.len()).filter(|body| held[*body].is_none()).collect();
        if heads.is_empty() {
            return Err(refusing(&|joint| joint.parent.is_none(), "nothing would be left that moves"));
        }
        let (bodies, places) = composites(model, &joints, &held, &heads);
        let elements = Carrying { model, places: &places }.elements(timed);
        match elements {
            Ok(elements) => {
                let model = Model {
                    bodies,
                    elements,
                    sets: Vec::new(),
                    gravity: model.gravity,
                    inputs: model.inputs.clone(),
                    channels: Vec::new(),
                };
                Ok(Self { joints, places, heads, model })
            }
            Err(missing) => {
                let by_joint = refusing(&|joint| joint.element == missing.joint, &missing.why);
                let by_body = refusing(&|joint| missing.bodies.contains(&joint.child), &missing.why);
                let all = refusing(&|_| true, &missing.why);
                Err([by_joint, by_body].into_iter().find(|found| !found.is_empty()).unwrap_or(all))
            }
        }
    }
}

/// Whether a joint leaves no freedom, by its mobility.
fn is_rigid(element: &Instance) -> bool {
    element.class.kind == Kind::Joint && element.class.mobility == Some(0) && !element.class.turns_freely
}

/// The merged bodies, and where each body of the scene is on them. `held`: where each is in its parent.
fn composites(
    model: &Model,
    joints: &[TreeJoint],
    held: &[Option<Marker>],
    heads: &[usize],
) -> (Vec<Body>, Vec<Marker>) {
    let still = |body| Marker { body, position: Vector3::zeros(), rotation: Matrix3::identity() };
    let mut places = vec![still(None); held.len()];
    for (k, head) in heads.iter().enumerate() {
        places[*head] = still(Some(k));
    }
    for joint in joints {
        let own = held[joint.child].as_ref().expect("every joint of the list holds its child");
        places[joint.child] = joint.parent.map_or_else(|| on(&still(None), own), |parent| on(&places[parent], own));
    }
    let mut parts: Vec<Vec<usize>> = vec![Vec::new(); heads.len()];
    for (body, place) in places.iter().enumerate() {
        if let Some(k) = place.body {
            parts[k].push(body);
        }
    }
    let mut bodies = Vec::with_capacity(heads.len());
    for (head, parts) in heads.iter().zip(&parts) {
        let mut body = model.bodies[*head].clone();
        if parts.len() > 1 {
            let center = compose(&mut body, parts, model, &places);
            parts.iter().for_each(|part| places[*part].position -= center);
        }
        bodies.push(body);
    }
    (bodies, places)
}

/// Gives a body the mass and inertia of its parts, all of which lie on its centroidal frame; returns the common centre there.
fn compose(body: &mut Body, parts: &[usize], model: &Model, places: &[Marker]) -> Vector3<f64> {
    let masses = || parts.iter().map(|part| (&model.bodies[*part], &places[*part]));
    let mass: f64 = masses().map(|(part, _)| part.mass).sum();
    let center = masses().map(|(part, place)| place.position * part.mass).sum::<Vector3<f64>>() / mass;
    let inertia: Matrix3<f64> = masses()
        .map(|(part, place)| {
            let d = place.position - center;
            let moved = (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * part.mass;
            place.rotation * part.inertia * place.rotation.transpose() + moved
        })
        .sum();
    body.mass = mass;
    body.inertia = 0.5 * (inertia + inertia.transpose());
    body.center_of_mass += center;
    center
}

/// A marker on a body that itself is a marker on another.
fn on(place: &Marker, marker: &Marker) -> Marker {
    Marker {
        body: place.body,
        position: place.position + place.rotation * marker.position,
        rotation: place.rotation * marker.rotation,
    }
}

/// From the scene's bodies to merged ones.
struct Carrying<'a> {
    model: &'a Model,
    places: &'a [Marker],
}

impl Carrying<'_> {
    fn elements(&self, timed: impl Fn(usize) -> bool) -> Result<Vec<Instance>, Missing> {
        let mut elements = Vec::with_capacity(self.model.elements.len());
        for (index, old) in self.model.elements.iter().enumerate() {
            let mut element = old.clone();
            if old.class.kind == Kind::Joint && self.is_within(old) {
                if timed(index) {
                    let why = format!("`{}` drives bodies against each other that they hold", old.name);
                    return Err(Missing { why, joint: None, bodies: bodies(old) });
                }
                element.rows.clear();
            }
            for joint in &old.joints {
                self.reaction(&old.name, *joint)?;
            }
            for marker in &mut element.markers {
                if let Some(body) = marker.body {
                    *marker = on(&self.places[body], marker);
                }
            }
            for input in &mut element.inputs {
                *input = self.source(&old.name, input)?;
            }
            elements.push(element);
        }
        Ok(elements)
    }

    /// The merged body of a marker; the ground is one, too.
    fn body_of(&self, marker: &Marker) -> Option<usize> {
        marker.body.and_then(|body| self.places[body].body)
    }

    /// Whether all frames of an element are on one merged body, but not on one body of the scene.
    fn is_within(&self, element: &Instance) -> bool {
        let same =
            |of: &dyn Fn(&Marker) -> Option<usize>| element.markers.windows(2).all(|pair| of(&pair[0]) == of(&pair[1]));
        same(&|marker| self.body_of(marker)) && !same(&|marker| marker.body)
    }

    /// The reaction of a joint is that of all its rows on a body: it is told where no two of its bodies are one.
    fn reaction(&self, by: &str, joint: usize) -> Result<(), Missing> {
        let instance = &self.model.elements[joint];
        for (k, one) in instance.markers.iter().enumerate() {
            for other in &instance.markers[..k] {
                if one.body != other.body && self.body_of(one) == self.body_of(other) {
                    let why = format!("`{by}` takes the reaction of `{}`", instance.name);
                    return Err(Missing { why, joint: Some(joint), bodies: bodies(instance) });
                }
            }
        }
        Ok(())
    }

    /// What is connected to a signal, in terms of merged bodies.
    fn source(&self, by: &str, source: &Source) -> Result<Source, Missing> {
        let Source::Quantity(quantity) = source else { return Ok(source.clone()) };
        let missing = |body: usize| Missing {
            why: format!("`{by}` takes a quantity in the axes of `{}`", self.model.bodies[body].name),
            joint: None,
            bodies: vec![body],
        };
        let carried = match quantity {
            Quantity::Point { body, point, level, axes, component } => {
                let place = &self.places[*body];
                let point = place.position + place.rotation * point;
                let Some(carrier) = place.body else {
                    return match (axes, level) {
                        (_, Level::Velocity | Level::Acceleration) => Ok(Source::Constant(0.0)),
                        (Axes::Ground, Level::Position) => Ok(Source::Constant(point[*component])),
                        (Axes::Body(_), Level::Position) => Err(missing(*body)),
                    };
                };
                let axes = self.axes(*axes).map_err(missing)?;
                Quantity::Point { body: carrier, point, level: *level, axes, component: *component }
            }
            Quantity::EulerParameter { body, component } => match self.axes(Axes::Body(*body)).map_err(missing)? {
                Axes::Body(body) => Quantity::EulerParameter { body, component: *component },
                Axes::Ground => return Err(missing(*body)),
            },
            Quantity::Angular { body, level, axes, component } => {
                let Some(carrier) = self.places[*body].body else { return Ok(Source::Constant(0.0)) };
                let axes = self.axes(*axes).map_err(missing)?;
                Quantity::Angular { body: carrier, level: *level, axes, component: *component }
            }
            Quantity::Load { element, frame, torque, axes, component } => {
                if self.model.elements[*element].class.kind == Kind::Joint {
                    self.reaction(by, *element)?;
                }
                let axes = self.axes(*axes).map_err(missing)?;
                Quantity::Load { element: *element, frame: *frame, torque: *torque, axes, component: *component }
            }
            Quantity::PotentialEnergy | Quantity::TotalEnergy | Quantity::KineticEnergy => {
                let on_ground = |body: &usize| self.places[*body].body.is_none();
                let still: Vec<usize> = (0..self.places.len()).filter(on_ground).collect();
                if *quantity != Quantity::KineticEnergy && !still.is_empty() {
                    let why = format!("`{by}` takes the potential energy");
                    return Err(Missing { why, joint: None, bodies: still });
                }
                quantity.clone()
            }
            Quantity::Balance { body, .. } => return Err(missing(*body)),
            Quantity::Coordinate { .. } | Quantity::Value { .. } | Quantity::Given { .. } => quantity.clone(),
        };
        Ok(Source::Quantity(carried))
    }

    /// Axes of the ground or of a merged body; the body whose axes are gone otherwise.
    fn axes(&self, axes: Axes) -> Result<Axes, usize> {
        let Axes::Body(body) = axes else { return Ok(axes) };
        let place = &self.places[body];
        match place.body {
            Some(carrier) if place.rotation == Matrix3::identity() => Ok(Axes::Body(carrier)),
            _ => Err(body),
        }
    }
}

/// The bodies of an element.
fn bodies(element: &Instance) -> Vec<usize> {
    element.markers.iter().filter_map(|marker| marker.body).collect()
}
