//! The words of requested outputs.

use element_api::Kind;
use element_api::descriptor::Named;
use nalgebra::Vector3;

use super::bodies::{Bodies, Target, quoted};
use super::elements::Elements;
use super::parameters::dimension_of;
use super::types::{Axes, Channel, Instance, Level, MAGNITUDE, Quantity};
use crate::diagnostics::{Code, Diagnostic, codes, suggest};
use crate::scene::{Dimension, ExternalInput, GROUND, OutputRecord, Scene, Spanned, parse_unit};

/// The words for `quantity`, with what each means.
pub const QUANTITIES: &[(&str, &str)] = &[
    ("position", "of a body's point, ground axes"),
    ("velocity", "of a body's point"),
    ("acceleration", "of a body's point"),
    ("orientation", "Euler parameters of a body, components e0 e1 e2 e3"),
    ("angular_velocity", "of a body"),
    ("angular_acceleration", "of a body"),
    ("coordinate", "of a joint: angle (over many turns) or displacement"),
    ("coordinate_rate", "first derivative of a joint's coordinate"),
    ("coordinate_acceleration", "second derivative of a joint's coordinate"),
    ("reaction_force", "of a joint on a body, at the joint's frame there"),
    ("reaction_torque", "of a joint on a body, at the joint's frame there"),
    ("force", "of a force element on a body"),
    ("torque", "of a force element on a body"),
    ("value", "reported by a force element or a joint, or signal of a control element"),
    ("input", "what an `[[input]]` is at this time"),
    ("balance_force", "of a body: reported forces and weight minus mass times acceleration, zero but for round-off"),
    ("balance_torque", "of a body: reported torques about the centre of mass minus change of angular momentum"),
    ("kinetic_energy", "of the whole scene"),
    ("potential_energy", "of the whole scene"),
    ("total_energy", "of the whole scene"),
];

type Found<T> = Result<T, Box<Diagnostic>>;

/// Everything the words may refer to.
struct Words<'a> {
    scene: &'a Scene,
    bodies: &'a Bodies,
    elements: &'a Elements,
}

pub(super) fn resolve(
    scene: &Scene,
    bodies: &Bodies,
    elements: &Elements,
    found: &mut Vec<Diagnostic>,
) -> Vec<Channel> {
    let words = Words { scene, bodies, elements };
    // Elements that could not be created must not cause a second wave of messages.
    let incomplete = found.iter().any(Diagnostic::is_error);
    let mut channels = Vec::with_capacity(scene.outputs.len());
    for record in &scene.outputs {
        match words.channel(record) {
            Ok(channel) => channels.push(channel),
            Err(diagnostic) if incomplete && diagnostic.code == codes::UNKNOWN_TARGET => {}
            Err(diagnostic) => found.push(*diagnostic),
        }
    }
    check_figures(scene, &channels, found);
    channels
}

/// Figures are made of outputs that there are, and named in units that these have.
fn check_figures(scene: &Scene, channels: &[Channel], found: &mut Vec<Diagnostic>) {
    let known: Vec<&str> = scene.outputs.iter().map(|output| output.name.value.as_str()).collect();
    let channel = |name: &str| channels.iter().find(|channel| channel.name == name);
    for figure in &scene.figures {
        let crossed = figure.at.as_ref().map(|at| &at.channel);
        for name in [Some(&figure.channel), figure.over.as_ref(), crossed].into_iter().flatten() {
            if !known.contains(&name.value.as_str()) {
                let message = format!("there is no output `{}`", name.value);
                let nearest = suggest(&name.value, known.iter().copied()).map(|n| format!("did you mean `{n}`?"));
                found.push(
                    Diagnostic::error(codes::UNKNOWN_CHANNEL, message)
                        .at(name.span.clone(), format!("the figure `{}` is made of it", figure.name.value))
                        .help_if(nearest),
                );
            }
        }
        if let Some((at, channel)) = figure.at.as_ref().and_then(|at| Some((at, channel(&at.channel.value)?))) {
            let values = std::iter::once(&at.equals).chain(&at.period);
            found.extend(values.filter_map(|value| scene.quantity(value, channel.dimension).err()));
        }
        // The numbers of signals have no unit but in the mind of who wrote the scene; a quotient has none.
        if let (Some(channel), None) = (channel(&figure.channel.value), &figure.over)
            && !figure.unit.value.is_empty()
            && channel.dimension != Dimension::DIMENSIONLESS
        {
            let Spanned { value: unit, span } = &figure.unit;
            let diagnostic = match parse_unit(unit) {
                Ok((dimension, factor))
                    if channel.dimension.compatible(dimension) && (factor / channel.factor - 1.0).abs() < 1e-12 =>
                {
                    continue;
                }
                Ok(_) => {
                    let name = &figure.name.value;
                    Diagnostic::error(
                        codes::FIGURE_UNIT,
                        format!("the figure `{name}` is in {}, not in {unit}", channel.unit),
                    )
                }
                Err(error) => Diagnostic::error(error.code, error.message).help_if(error.help),
            };
            found.push(
                diagnostic
                    .at(span.clone(), format!("it has the unit of `{}`", channel.name))
                    .help(format!("unit = \"{}\", or none", channel.unit)),
            );
        }
    }
}

/// The keys that have a meaning with a quantity, besides its name; those of a quantity that is not known.
fn keys_of(quantity: &str) -> &'static [&'static str] {
    match quantity {
        "position" | "velocity" | "acceleration" => &["of", "component", "point", "frame"],
        "angular_velocity" | "angular_acceleration" => &["of", "component", "frame"],
        "reaction_force" | "reaction_torque" | "force" | "torque" => &["of", "component", "on", "frame"],
        "coordinate" | "coordinate_rate" | "coordinate_acceleration" | "value" => &["of", "channel"],
        "orientation" | "balance_force" | "balance_torque" => &["of", "component"],
        "input" => &["of"],
        "kinetic_energy" | "potential_energy" | "total_energy" => &[],
        _ => &["of", "component", "on", "point", "frame", "channel"],
    }
}

/// Refuses a key that would change nothing: the column would not be what the scene asks for.
fn without_meaning(record: &OutputRecord) -> Found<()> {
    let known = keys_of(&record.quantity.value);
    let words = [
        ("of", &record.of),
        ("component", &record.component),
        ("on", &record.on),
        ("frame", &record.frame),
        ("channel", &record.channel),
    ];
    let written = words.into_iter().filter_map(|(key, word)| Some((key, &word.as_ref()?.span)));
    let point = record.point.as_ref().map(|point| ("point", &point.span));
    let Some((key, span)) = written.chain(point).find(|(key, _)| !known.contains(key)) else { return Ok(()) };
    let quantity = &record.quantity.value;
    let message = format!("`{key}` has no meaning for `{quantity}`, output `{}`", record.name.value);
    let help = match (known, quantity.as_str(), key) {
        ([], ..) => format!("`{quantity}` is that of the whole scene"),
        (_, "reaction_torque" | "torque", "point") => "torques are about the origin of the element's frame".into(),
        (_, "orientation", "frame") => "orientations are against the ground; a joint has angles (`coordinate`)".into(),
        _ => format!("with `{quantity}` go {}", quoted(known)),
    };
    Err(Box::new(
        Diagnostic::error(codes::CONFLICTING_KEYS, message).at(span.clone(), "would change nothing").help(help),
    ))
}

impl Words<'_> {
    fn channel(&self, record: &OutputRecord) -> Found<Channel> {
        without_meaning(record)?;
        let (quantity, dimension, place) = match record.quantity.value.as_str() {
            "position" => self.point(record, Level::Position, Dimension::LENGTH)?,
            "velocity" => self.point(record, Level::Velocity, Dimension::VELOCITY)?,
            "acceleration" => self.point(record, Level::Acceleration, Dimension::ACCELERATION)?,
            "orientation" => {
                let (body, name) = self.body(record)?;
                let component = component(record, &["e0", "e1", "e2", "e3"])?;
                let place = format!("Euler parameter of {name}, body to ground");
                (Quantity::EulerParameter { body, component }, Dimension::DIMENSIONLESS, place)
            }
            "angular_velocity" => self.angular(record, Level::Velocity, Dimension::ANGULAR_VELOCITY)?,
            "angular_acceleration" => self.angular(record, Level::Acceleration, Dimension::ANGULAR_ACCELERATION)?,
            "coordinate" => self.coordinate(record, Level::Position)?,
            "coordinate_rate" => self.coordinate(record, Level::Velocity)?,
            "coordinate_acceleration" => self.coordinate(record, Level::Acceleration)?,
            "reaction_force" => self.load(record, Kind::Joint, false)?,
            "reaction_torque" => self.load(record, Kind::Joint, true)?,
            "force" => self.load(record, Kind::Force, false)?,
            "torque" => self.load(record, Kind::Force, true)?,
            "value" => {
                let (element, instance) = self.element_with_values(record)?;
                let channel = named_channel(record, instance, instance.class.reported())?;
                let own = &instance.class.reported()[channel];
                let dimension = dimension_of(&own.unit)?;
                let place = format!("{} of {}", own.doc, instance.name);
                (Quantity::Value { element, channel }, dimension, place)
            }
            "input" => self.given(record)?,
            "balance_force" => self.balance(record, false)?,
            "balance_torque" => self.balance(record, true)?,
            "kinetic_energy" => (Quantity::KineticEnergy, Dimension::ENERGY, "whole scene".into()),
            "potential_energy" => (Quantity::PotentialEnergy, Dimension::ENERGY, "whole scene".into()),
            "total_energy" => (Quantity::TotalEnergy, Dimension::ENERGY, "whole scene".into()),
            other => {
                let names: Vec<&str> = QUANTITIES.iter().map(|(name, _)| *name).collect();
                return Err(unknown_word(
                    codes::UNKNOWN_QUANTITY,
                    &format!("there is no quantity `{other}`"),
                    &record.quantity,
                    &names,
                ));
            }
        };
        let units = &self.scene.units;
        if let Quantity::Given { input } = quantity {
            let ExternalInput { unit, factor, .. } = &self.scene.inputs[input];
            let (name, unit, factor) = (record.name.value.clone(), unit.clone(), *factor);
            return Ok(Channel { name, quantity, dimension, unit, factor, place });
        }
        let unit = match &quantity {
            Quantity::Load { torque: true, .. } | Quantity::Balance { torque: true, .. } => units.torque_label(),
            // A torque has the dimension of an energy; only the element knows which of them it means.
            Quantity::Value { element, channel } => {
                units.label_as(dimension, &self.elements.instances[*element].class.reported()[*channel].unit)
            }
            _ => units.label(dimension),
        };
        Ok(Channel {
            name: record.name.value.clone(),
            quantity,
            dimension,
            unit,
            factor: units.factor(dimension),
            place,
        })
    }

    fn point(&self, record: &OutputRecord, level: Level, dimension: Dimension) -> Found<(Quantity, Dimension, String)> {
        let (body, name) = self.body(record)?;
        let component = component(record, &["x", "y", "z"])?;
        let (axes, axes_name) = self.axes(record)?;
        let local = record.point.as_ref().map_or([0.0; 3], |point| point.value);
        let point = Vector3::from(local) - self.bodies.movable[body].center_of_mass;
        let where_on = if record.point.is_some() { "a point" } else { "the origin" };
        let place = format!("{where_on} of {name}, components along the axes of {axes_name}");
        Ok((Quantity::Point { body, point, level, axes, component }, dimension, place))
    }

    fn angular(
        &self,
        record: &OutputRecord,
        level: Level,
        dimension: Dimension,
    ) -> Found<(Quantity, Dimension, String)> {
        let (body, name) = self.body(record)?;
        let component = component(record, &["x", "y", "z"])?;
        let (axes, axes_name) = self.axes(record)?;
        let place = format!("{name}, components along the axes of {axes_name}");
        Ok((Quantity::Angular { body, level, axes, component }, dimension, place))
    }

    fn coordinate(&self, record: &OutputRecord, level: Level) -> Found<(Quantity, Dimension, String)> {
        let (element, instance) = self.element(record, Kind::Joint)?;
        let coordinate = named_channel(record, instance, &instance.class.channels)?;
        let own = &instance.class.channels[coordinate];
        let mut dimension = dimension_of(&own.unit)?;
        let order = match level {
            Level::Position => 0,
            Level::Velocity => 1,
            Level::Acceleration => 2,
        };
        for _ in 0..order {
            dimension = dimension.over(Dimension::TIME).unwrap_or(dimension);
        }
        let place = format!("{} of {}", own.doc, instance.name);
        Ok((Quantity::Coordinate { element, coordinate, level }, dimension, place))
    }

    fn load(&self, record: &OutputRecord, kind: Kind, torque: bool) -> Found<(Quantity, Dimension, String)> {
        let (element, instance) = self.element(record, kind)?;
        let component = component(record, &["x", "y", "z", "magnitude"])?;
        let (axes, axes_name) = self.axes(record)?;
        let names = self.body_names(instance);
        let frame = match &record.on {
            // Without a word, the load on the body named last.
            None => names.len().saturating_sub(1),
            Some(on) => {
                let index = match self.bodies.find(on).map_err(Box::new)? {
                    Target::Movable(body) => Some(*body),
                    Target::Fixed { .. } => None,
                };
                if index.is_none() && on.value != GROUND {
                    self.apart(instance, on)?;
                }
                instance.markers.iter().position(|marker| marker.body == index).ok_or_else(|| {
                    Box::new(
                        Diagnostic::error(
                            codes::UNKNOWN_TARGET,
                            format!("`{}` does not act on `{}`", instance.name, on.value),
                        )
                        .at(on.span.clone(), "not one of its bodies")
                        .help(format!("it connects {}", quoted(&names))),
                    )
                })?
            }
        };
        let (dimension, what) = if torque { (Dimension::TORQUE, "torque") } else { (Dimension::FORCE, "force") };
        let on = names.get(frame).map_or("?", String::as_str);
        let place = match component {
            MAGNITUDE => format!("magnitude of the {what} of {} on {on} at its frame there", instance.name),
            _ => {
                let name = &instance.name;
                format!("{what} of {name} on {on} at its frame there, components along the axes of {axes_name}")
            }
        };
        Ok((Quantity::Load { element, frame, torque, axes, component }, dimension, place))
    }

    /// Refuses a load on a fixed body that the element does not take hold of, or not of it alone: what it does to the ground is known as
    /// a whole.
    fn apart(&self, instance: &Instance, on: &Spanned<String>) -> Found<()> {
        let record = self.scene.elements.iter().find(|record| record.name.value == instance.name);
        let bodies = record.map_or(&[][..], |record| &record.bodies.value);
        let is_fixed = |name: &&Spanned<String>| matches!(self.bodies.find(name), Ok(Target::Fixed { .. }));
        let fixed: Vec<&str> = bodies.iter().filter(is_fixed).map(|name| name.value.as_str()).collect();
        if fixed.iter().all(|name| *name == on.value) && (!fixed.is_empty() || bodies.is_empty()) {
            return Ok(());
        }
        let name = &instance.name;
        let refuse = |message: String, help: String| {
            let place = "of this fixed body the load is not known";
            Box::new(Diagnostic::error(codes::UNKNOWN_TARGET, message).at(on.span.clone(), place).help(help))
        };
        if !fixed.contains(&on.value.as_str()) {
            let all: Vec<&str> = bodies.iter().map(|name| name.value.as_str()).collect();
            let message = format!("`{name}` does not act on `{}`", on.value);
            return Err(refuse(message, format!("it connects {}", quoted(&all))));
        }
        let message = format!("`{name}` takes hold of `{}` and of other fixed bodies", on.value);
        Err(refuse(message, "`on = \"ground\"` is what it does to all of them together".into()))
    }

    fn body_names(&self, instance: &Instance) -> Vec<String> {
        let name = |body: Option<usize>| body.map_or(GROUND.into(), |b| self.bodies.movable[b].name.clone());
        instance.markers.iter().map(|marker| name(marker.body)).collect()
    }

    /// The moving body that `of` names.
    fn body(&self, record: &OutputRecord) -> Found<(usize, String)> {
        let of = required(record, record.of.as_ref(), "of", "the name of a body")?;
        match self.bodies.find(of).map_err(Box::new)? {
            Target::Movable(body) => Ok((*body, of.value.clone())),
            Target::Fixed { .. } => Err(Box::new(
                Diagnostic::error(codes::UNKNOWN_TARGET, format!("`{}` does not move", of.value))
                    .at(of.span.clone(), "nothing to report")
                    .help("name a body that can move"),
            )),
        }
    }

    /// The element that `of` names.
    fn element(&self, record: &OutputRecord, kind: Kind) -> Found<(usize, &Instance)> {
        let of = required(record, record.of.as_ref(), "of", &format!("the name of a {}", called(kind)))?;
        let instances = &self.elements.instances;
        if let Some(index) = self.elements.find(&of.value, kind) {
            return Ok((index, &instances[index]));
        }
        if let Some(other) = instances.iter().find(|instance| instance.name == of.value) {
            let found = other.class.kind;
            let (article, help) = match found {
                Kind::Joint => {
                    ("a joint", "its loads are `reaction_force` and `reaction_torque`, where it stands is `coordinate`")
                }
                Kind::Force => ("a force", "its loads are `force` and `torque`"),
                Kind::Control => ("a control element", "its signals are `value`"),
            };
            let message = format!("`{}` is {article}, of which there is no `{}`", of.value, record.quantity.value);
            let place = format!("not a {}", called(kind));
            return Err(Box::new(
                Diagnostic::error(codes::UNKNOWN_TARGET, message).at(of.span.clone(), place).help(help),
            ));
        }
        Err(self.no_element(of, &[kind]))
    }

    /// There is no element of these kinds that is called so.
    fn no_element(&self, of: &Spanned<String>, kinds: &[Kind]) -> Box<Diagnostic> {
        if let Some(off) = switched_off(self.scene, of, "nothing to report") {
            return off;
        }
        let among = self.elements.instances.iter().filter(|e| kinds.contains(&e.class.kind));
        let names: Vec<&str> = among.map(|e| e.name.as_str()).collect();
        let what = if let [kind] = kinds { called(*kind) } else { "element" };
        let message = format!("there is no {what} `{}`", of.value);
        unknown_word(codes::UNKNOWN_TARGET, &message, of, &names)
    }

    /// The force or control element that `of` names.
    fn element_with_values(&self, record: &OutputRecord) -> Found<(usize, &Instance)> {
        let named = |of: &Spanned<String>, kind: Kind| self.elements.find(&of.value, kind).is_some();
        let of = required(record, record.of.as_ref(), "of", "the name of a force, a joint or a control element")?;
        let all = [Kind::Control, Kind::Joint, Kind::Force];
        match all.into_iter().find(|kind| named(of, *kind)) {
            Some(kind) => self.element(record, kind),
            None => Err(self.no_element(of, &all)),
        }
    }

    /// The input that `of` names.
    fn given(&self, record: &OutputRecord) -> Found<(Quantity, Dimension, String)> {
        let of = required(record, record.of.as_ref(), "of", "the name of an `[[input]]`")?;
        let inputs = &self.scene.inputs;
        let Some(input) = inputs.iter().position(|input| input.name.value == of.value) else {
            let names: Vec<&str> = inputs.iter().map(|input| input.name.value.as_str()).collect();
            let message = format!("there is no input `{}`", of.value);
            return Err(unknown_word(codes::UNKNOWN_TARGET, &message, of, &names));
        };
        Ok((Quantity::Given { input }, inputs[input].dimension, format!("the input {}", of.value)))
    }

    fn balance(&self, record: &OutputRecord, torque: bool) -> Found<(Quantity, Dimension, String)> {
        let (body, name) = self.body(record)?;
        let component = component(record, &["x", "y", "z"])?;
        let (dimension, place) = match torque {
            false => (Dimension::FORCE, format!("balance of forces on {name}, ground axes")),
            true => (Dimension::TORQUE, format!("balance of torques on {name} about its centre of mass, ground axes")),
        };
        Ok((Quantity::Balance { body, torque, component }, dimension, place))
    }

    fn axes(&self, record: &OutputRecord) -> Found<(Axes, String)> {
        let Some(frame) = &record.frame else { return Ok((Axes::Ground, GROUND.into())) };
        if frame.value == GROUND {
            return Ok((Axes::Ground, GROUND.into()));
        }
        match self.bodies.find(frame).map_err(Box::new)? {
            Target::Movable(body) => Ok((Axes::Body(*body), frame.value.clone())),
            Target::Fixed { .. } => Err(Box::new(
                Diagnostic::error(codes::UNKNOWN_TARGET, format!("`{}` is fixed", frame.value))
                    .at(frame.span.clone(), "its axes are not offered as an output frame")
                    .help("use `ground` or a body that moves"),
            )),
        }
    }
}

/// What elements of this kind are called.
fn called(kind: Kind) -> &'static str {
    match kind {
        Kind::Joint => "joint",
        Kind::Force => "force",
        Kind::Control => "control element",
    }
}

/// An element that is in the scene and switched off.
pub(super) fn switched_off(scene: &Scene, name: &Spanned<String>, place: &str) -> Option<Box<Diagnostic>> {
    let record = scene.elements.iter().find(|record| !record.enabled && record.name.value == name.value)?;
    let line = scene.source.locate(record.name.span.start).line;
    let message = format!("the {} `{}` is switched off", record.kind.key(), name.value);
    let help = format!("it has `enabled = false` (line {line}); leave that away, or what is made of it");
    Some(Box::new(Diagnostic::error(codes::UNKNOWN_TARGET, message).at(name.span.clone(), place).help(help)))
}

fn required<'r>(
    record: &OutputRecord,
    word: Option<&'r Spanned<String>>,
    key: &str,
    what: &str,
) -> Found<&'r Spanned<String>> {
    word.ok_or_else(|| {
        Box::new(
            Diagnostic::error(codes::MISSING_KEY, format!("output `{}` needs `{key}`", record.name.value))
                .at(record.quantity.span.clone(), format!("`{}` is taken of something", record.quantity.value))
                .help(format!("{key} = \"...\"   # {what}")),
        )
    })
}

fn component(record: &OutputRecord, names: &[&str]) -> Found<usize> {
    let word = required(record, record.component.as_ref(), "component", &format!("one of {}", names.join(", ")))?;
    names.iter().position(|name| *name == word.value).ok_or_else(|| {
        unknown_word(codes::UNKNOWN_COMPONENT, &format!("there is no component `{}`", word.value), word, names)
    })
}

/// The coordinate or value that `channel` names; not needed where there is only one.
fn named_channel(record: &OutputRecord, instance: &Instance, channels: &[Named]) -> Found<usize> {
    let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
    match &record.channel {
        None if names.len() == 1 => Ok(0),
        None => {
            let message = if names.is_empty() {
                format!("`{}` ({}) has nothing to report", instance.name, instance.class.name)
            } else {
                format!("output `{}` needs `channel`: {}", record.name.value, quoted(&names))
            };
            Err(Box::new(
                Diagnostic::error(codes::UNKNOWN_CHANNEL, message)
                    .at(record.quantity.span.clone(), "which one is meant?"),
            ))
        }
        Some(word) => names.iter().position(|name| *name == word.value).ok_or_else(|| {
            let message = format!("`{}` ({}) has no channel `{}`", instance.name, instance.class.name, word.value);
            unknown_word(codes::UNKNOWN_CHANNEL, &message, word, &names)
        }),
    }
}

fn unknown_word(code: Code, message: &str, word: &Spanned<String>, known: &[&str]) -> Box<Diagnostic> {
    let diagnostic = Diagnostic::error(code, message).at(word.span.clone(), "unknown");
    Box::new(match suggest(&word.value, known.iter().copied()) {
        Some(nearest) => diagnostic.help(format!("did you mean `{nearest}`?")),
        None if known.is_empty() => diagnostic,
        None => diagnostic.help(format!("known are {}", quoted(known))),
    })
}
