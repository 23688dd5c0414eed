//! What `motion.bin` begins with: the bodies with their shapes, the elements with their glyphs, and which loads follow.

use std::path::Path;

use element_api::Kind;
use nalgebra::{Matrix3, Vector3};

use super::error::SessionError;
use super::opened::Session;
use crate::analysis::{Constraints, Evaluator, start_inputs};
use crate::diagnostics::{Diagnostic, codes};
use crate::model::{Place, euler_parameters, movable_records, place_of_shape, rotation};
use crate::plan;
use crate::results::{MOTION_FORMAT, Mesh, MotionHeader, POSE, Shape, ShownBody, ShownElement, ShownFrame, ShownLoad};
use crate::scene::{BodyRecord, Dimension, Scene, ShapeKind, ShapeRecord};

/// Directions that differ by less are the same, as a share of their lengths.
const ALONG: f64 = 1e-6;

/// How far a shape reaches from the origin of its frame, m.
fn reach(shape: &Shape) -> f64 {
    let (radius, half) = (shape.radius.unwrap_or(0.0), 0.5 * shape.length.unwrap_or(0.0));
    let box_or_mesh = match (&shape.size, &shape.mesh) {
        (Some(size), _) => 0.5 * Vector3::from(*size).norm(),
        (_, Some(mesh)) => {
            let corners =
                mesh.vertices.chunks_exact(3).map(|corner| Vector3::new(corner[0], corner[1], corner[2]).norm());
            f64::from(corners.fold(0.0, f32::max))
        }
        _ => 0.0,
    };
    let round = if shape.kind == "capsule" { radius + half } else { radius.hypot(half) };
    box_or_mesh.max(round)
}

/// A mesh that cannot be had.
fn bad_mesh(scene: &Scene, path: &Path, span: std::ops::Range<usize>, reason: &str) -> SessionError {
    let message = format!("the mesh `{}` cannot be read: {reason}", path.display());
    let diagnostic = Diagnostic::error(codes::BAD_MESH, message)
        .at(span, "the file of this shape")
        .help("`file` is an STL file (binary or text) or an OBJ file, its place relative to the scene's folder");
    SessionError::one(&scene.source, diagnostic)
}

/// Refuses a scene with a mesh whose file is not there. What is in the files is read when a picture is wanted.
pub(super) fn check_meshes(scene: &Scene) -> Result<(), SessionError> {
    for shape in scene.bodies.iter().flat_map(|body| &body.shapes) {
        let ShapeKind::Mesh { file, .. } = &shape.kind else { continue };
        let path = scene.source.beside(&file.value);
        let missing = match path.metadata() {
            Ok(found) => found.is_dir().then(|| "it is a folder".to_string()),
            Err(error) => Some(error.to_string()),
        };
        if let Some(reason) = missing {
            return Err(bad_mesh(scene, &path, file.span.clone(), &reason));
        }
    }
    Ok(())
}

impl Session {
    /// What a picture of the mechanism shows where the session begins, and there per body that can move the position of the
    /// origin of its frame, m, and its Euler parameters, body -> ground, scalar first.
    ///
    /// # Errors
    /// A mesh that cannot be read; equations without a value at the start.
    pub fn start_picture(&self) -> Result<(MotionHeader, Vec<[f64; POSE]>), SessionError> {
        Ok((self.picture()?, self.start_poses().collect()))
    }

    /// Where the frames of the bodies are that can move, where the session begins.
    fn start_poses(&self) -> impl Iterator<Item = [f64; POSE]> {
        self.model.bodies.iter().zip(self.assembly.working.chunks_exact(13)).map(|(body, y)| {
            let turn = rotation(&[y[3], y[4], y[5], y[6]]);
            let r = Vector3::from_column_slice(&y[..3]) - turn * body.center_of_mass;
            [r.x, r.y, r.z, y[3], y[4], y[5], y[6]]
        })
    }

    /// What a picture of the motion shows, at the place where the session begins.
    ///
    /// # Errors
    /// A mesh that cannot be read; equations without a value at the start.
    pub(super) fn picture(&self) -> Result<MotionHeader, SessionError> {
        let scene = &self.scene;
        let mut bodies = Vec::with_capacity(scene.bodies.len());
        let mut movable = self.model.bodies.iter();
        for record in &scene.bodies {
            let center = match record.fixed {
                true => Vector3::from(record.position) + rotation(&record.orientation) * Vector3::from(record.com),
                false => movable.next().map_or_else(Vector3::zeros, |body| body.center_of_mass),
            };
            let shapes: Result<_, _> = record.shapes.iter().map(|shape| self.shape(record, shape)).collect();
            let name = record.name.value.clone();
            bodies.push(ShownBody { name, fixed: record.fixed, centre: center.into(), shapes: shapes? });
        }
        let loads = self.model.shown_loads().into_iter().map(|shown| {
            let is_joint = self.model.elements[shown.element].class.kind == Kind::Joint;
            let unique = |torque| self.plan.is_unique(shown.element, shown.frame, torque, None);
            ShownLoad {
                element: shown.element,
                frame: shown.frame,
                kind: if is_joint { "reaction" } else { "force" }.into(),
                unique: !is_joint || unique(false) && unique(true),
            }
        });
        let elements = self.shown_elements()?;
        Ok(MotionHeader {
            format: MOTION_FORMAT.into(),
            title: scene.title.clone(),
            time_unit: scene.units.label(Dimension::TIME),
            length: self.shown_size(&bodies, &elements),
            bodies,
            elements,
            loads: loads.collect(),
            gravity: self.model.gravity.into(),
        })
    }

    /// Diagonal of a box around all that is shown, where the session begins, m; the size of the scene where that is a point.
    fn shown_size(&self, bodies: &[ShownBody], elements: &[ShownElement]) -> f64 {
        let mut movable = self.start_poses();
        let ground = (Vector3::zeros(), Matrix3::identity());
        let mut places = Vec::with_capacity(bodies.len());
        for body in bodies {
            let own = if body.fixed { None } else { movable.next() };
            places.push(own.map_or(ground, |[x, y, z, p @ ..]| (Vector3::new(x, y, z), rotation(&p))));
        }
        let mut range = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        let mut take = |(origin, turn): &(Vector3<f64>, Matrix3<f64>), r: [f64; 3], reach: f64| {
            let at = origin + turn * Vector3::from(r);
            range = [range[0].inf(&at.add_scalar(-reach)), range[1].sup(&at.add_scalar(reach))];
        };
        for (body, place) in bodies.iter().zip(&places) {
            body.shapes.iter().for_each(|shape| take(place, shape.r, reach(shape)));
            if body.shapes.is_empty() {
                take(place, body.centre, 0.0);
            }
        }
        for frame in elements.iter().flat_map(|element| &element.frames) {
            let place = usize::try_from(frame.body).ok().and_then(|body| places.get(body)).unwrap_or(&ground);
            take(place, frame.r, 0.0);
        }
        let size = (range[1] - range[0]).norm();
        if size > 0.0 && size.is_finite() { size } else { self.assembly.scales.length }
    }

    fn shape(&self, body: &BodyRecord, record: &ShapeRecord) -> Result<Shape, SessionError> {
        let Place { origin, rotation } = place_of_shape(body, record);
        let mut shape = Shape {
            kind: String::new(),
            radius: None,
            length: None,
            size: None,
            r: origin.into(),
            p: euler_parameters(&rotation),
            color: record.color.map(|[red, green, blue]| format!("#{red:02x}{green:02x}{blue:02x}")),
            mesh: None,
        };
        let kind = match &record.kind {
            ShapeKind::Box { size } => {
                shape.size = Some(*size);
                "box"
            }
            ShapeKind::Sphere { radius } => {
                shape.radius = Some(*radius);
                "sphere"
            }
            ShapeKind::Cylinder { radius, length } | ShapeKind::Capsule { radius, length } => {
                (shape.radius, shape.length) = (Some(*radius), Some(*length));
                if matches!(record.kind, ShapeKind::Capsule { .. }) { "capsule" } else { "cylinder" }
            }
            ShapeKind::Mesh { file, unit } => {
                let path = self.scene.source.beside(&file.value);
                let mesh = Mesh::read(&path, *unit);
                shape.mesh = Some(mesh.map_err(|reason| bad_mesh(&self.scene, &path, file.span.clone(), &reason))?);
                "mesh"
            }
        };
        shape.kind = kind.into();
        Ok(shape)
    }

    fn shown_elements(&self) -> Result<Vec<ShownElement>, SessionError> {
        let (equations, layout) = (&self.equations, &self.plan.layout);
        let numbers: Vec<usize> = movable_records(&self.scene).map(|(number, _)| number).collect();
        let failed =
            |error: crate::analysis::AnalysisError| super::error::start_error(&self.scene, &self.model, &error);
        let all: Vec<usize> = (0..layout.rows).collect();
        let mut rows = Constraints::new(equations, &all, &[], &[]).map_err(failed)?;
        let inputs = start_inputs(layout, self.begins.time, &self.assembly);
        rows.evaluate(&inputs, &self.model.sets).map_err(failed)?;
        let state = |body: usize| &self.assembly.working[13 * body..13 * (body + 1)];
        let positions: Vec<Vector3<f64>> =
            (0..layout.bodies).map(|body| Vector3::from_column_slice(&state(body)[..3])).collect();
        let rotations: Vec<Matrix3<f64>> =
            (0..layout.bodies).map(state).map(|y| rotation(&[y[3], y[4], y[5], y[6]])).collect();
        let driven: Vec<bool> = equations.rows.iter().map(|row| !equations.graph.is_zero(row.time)).collect();
        let place = plan::Place {
            entries: &rows.structure.jacobian,
            jacobian: rows.jacobian(),
            driven: &driven,
            positions: &positions,
            rotations: &rotations,
            length: self.assembly.scales.length,
        };
        let elements = self.model.elements.iter().enumerate().map(|(number, element)| {
            let glyph = match element.class.kind {
                _ if !element.class.glyph.is_empty() => element.class.glyph.as_str(),
                Kind::Joint => place.glyph(&self.model, layout, number),
                Kind::Force => self.glyph_of_force(number, &inputs, &place),
                Kind::Control => "none",
            };
            let frames = (0..element.markers.len()).map(|frame| {
                let (body, Place { origin, rotation }) = self.model.place_of_frame(number, frame);
                let body = body.and_then(|body| i64::try_from(numbers[body]).ok()).unwrap_or(-1);
                ShownFrame { body, r: origin.into(), p: euler_parameters(&rotation) }
            });
            ShownElement {
                name: element.name.clone(),
                type_name: element.class.name.clone(),
                kind: element.class.kind.word().into(),
                glyph: glyph.into(),
                frames: frames.collect(),
            }
        });
        Ok(elements.collect())
    }

    /// The word for a force element in pictures, by the loads that it can have: between two points, at a point, or turning only.
    fn glyph_of_force(&self, element: usize, inputs: &[f64], place: &plan::Place<'_>) -> &'static str {
        let graph = &self.equations.graph;
        let loads = &self.equations.elements[element].loads;
        let acts = |vector: &[crate::program::Node; 3]| vector.iter().any(|node| !graph.is_zero(*node));
        let (shifts, turns) = (loads.iter().any(|load| acts(&load.force)), loads.iter().any(|load| acts(&load.torque)));
        let [one, other] = self.model.elements[element].markers.as_slice() else {
            return if shifts {
                "arrow"
            } else if turns {
                "torque"
            } else {
                "none"
            };
        };
        match (shifts, turns) {
            (false, false) => return "none",
            (false, true) => return "torque",
            // It holds one frame to another, as a bushing does.
            (true, true) => return "spring",
            (true, false) => {}
        }
        let apart = place.origin(other) - place.origin(one);
        let found = loads.first().and_then(|load| {
            let mut program = Evaluator::new(graph, &load.force);
            program.run(inputs, &self.model.sets).map(Vector3::from_column_slice).ok()
        });
        // Where it does not act at the start, it may act along the line between its frames.
        let across = found
            .map_or(0.0, |force| force.cross(&apart).norm() / (force.norm() * apart.norm()).max(f64::MIN_POSITIVE));
        let is_between = apart.norm() > ALONG * place.length && across < ALONG;
        if is_between { "spring" } else { "arrow" }
    }
}
