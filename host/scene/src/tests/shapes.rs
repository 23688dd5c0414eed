//! Shapes of bodies.

use super::*;

fn with_shape(shape: &str) -> String {
    format!("units.length = \"mm\"\n{SIMULATION}\n[[body]]\nname = \"b\"\nfixed = true\n[[body.shape]]\n{shape}\n")
}

#[track_caller]
fn shape(text: &str) -> ShapeRecord {
    accept(&with_shape(text)).bodies[0].shapes[0].clone()
}

#[test]
fn shapes_are_read_in_si() {
    let cylinder = shape("kind = \"cylinder\"\nradius = 10\nlength = \"2 cm\"\npoint = [1, 2, 3]\naxis = [0, 2, 0]");
    assert!(
        matches!(cylinder.kind, ShapeKind::Cylinder { radius, length } if near(radius, 0.01) && near(length, 0.02))
    );
    let Placement::Global { points, axes, x_axes } = &cylinder.placement.value else { panic!("{cylinder:?}") };
    assert!(near(points[0][2], 0.003) && axes[0] == [0.0, 1.0, 0.0] && x_axes.is_empty());
    let cuboid = shape("kind = \"box\"\nsize = [1, 2, 3]\ncolor = \"#C0392b\"\nframe = { position = [0, 0, 4] }");
    assert!(matches!(cuboid.kind, ShapeKind::Box { size } if near(size[2], 0.003)));
    assert_eq!(cuboid.color, Some([0xc0, 0x39, 0x2b]));
    assert!(matches!(&cuboid.placement.value, Placement::Local(frames) if near(frames[0].position[2], 0.004)));
    let sphere = shape("kind = \"sphere\"\nradius = 1");
    assert_eq!((sphere.placement.value, sphere.color), (Placement::Absent, None));
    let mesh = shape("kind = \"mesh\"\nfile = \"parts/rod.stl\"\nunit = \"in\"");
    assert!(
        matches!(&mesh.kind, ShapeKind::Mesh { file, unit } if file.value.ends_with("rod.stl") && near(*unit, 0.0254))
    );
    assert!(matches!(shape("kind = \"mesh\"\nfile = \"a.obj\"").kind, ShapeKind::Mesh { unit, .. } if unit == 1.0));
}

#[test]
fn several_shapes_of_a_body_stay_in_order() {
    let text = with_shape("kind = \"sphere\"\nradius = 1\n[[body.shape]]\nkind = \"sphere\"\nradius = 2");
    let scene = accept(&text);
    let radii = scene.bodies[0].shapes.iter().map(|shape| match shape.kind {
        ShapeKind::Sphere { radius } => radius,
        _ => 0.0,
    });
    assert_eq!(radii.collect::<Vec<_>>(), [0.001, 0.002]);
}

#[test]
fn a_negative_radius_has_its_place() {
    let expected = "\
error[ODY0111]: `radius` must be above zero
  --> test.toml:11:10
   |
11 | radius = -10
   |          ^^^

";
    assert_eq!(reject(&with_shape("kind = \"sphere\"\nradius = -10")).rendered(), expected);
}

#[test]
fn mistakes_of_shapes_are_told_where_they_are() {
    for (text, code, culprit, told) in [
        ("kind = \"sphere\"\nradius = 1\nradios = 2", codes::UNKNOWN_KEY, "radios", "shape 1 of body `b`"),
        ("kind = \"spere\"", codes::UNKNOWN_WORD, "\"spere\"", "did you mean `sphere`"),
        ("kind = \"box\"\nsize = [1, 0, 1]", codes::OUT_OF_RANGE, "[1, 0, 1]", "above zero"),
        ("kind = \"sphere\"\nradius = 1\nlength = 2", codes::CONFLICTING_KEYS, "length", "a sphere has `radius`"),
        ("kind = \"mesh\"\nfile = \"a.stl\"\nunit = \"kg\"", codes::DIMENSION, "\"kg\"", "a unit of length"),
        ("kind = \"sphere\"\nradius = 1\ncolor = \"red\"", codes::UNKNOWN_WORD, "\"red\"", "hexadecimal"),
        ("kind = \"sphere\"\nradius = 1\naxis = [0, 0, 1]\nx_axis = [0, 0, 2]", codes::NO_DIRECTION, "[0, 0, 2]", ""),
        ("kind = \"sphere\"\nradius = 1\npoint = [0, 0, 1]\nframe = {}", codes::CONFLICTING_KEYS, "frame", "only one"),
    ] {
        let rejected = reject(&with_shape(text));
        assert_eq!((rejected.codes(), rejected.culprit()), (vec![code], culprit), "{text}");
        assert!(rejected.rendered().contains(told), "{}", rejected.rendered());
    }
    assert_eq!(reject(&with_shape("kind = \"cylinder\"\nradius = 1")).codes(), [codes::MISSING_KEY]);
    assert_eq!(reject(&with_shape("radius = 1")).codes(), [codes::MISSING_KEY]);
}

#[test]
fn motion_is_written_only_where_it_is_asked_for() {
    assert!(!accept(SIMULATION).simulation.motion);
    assert!(accept(&format!("{SIMULATION}motion = true")).simulation.motion);
    assert!(accept_with(SIMULATION, &["simulation.motion=true"]).simulation.motion);
    assert_eq!(reject(&format!("{SIMULATION}motion = 1")).codes(), [codes::WRONG_TYPE]);
}
