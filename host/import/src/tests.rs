//! Masses of shapes, and files that are not as they should be.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use odyn_diagnostics::{Diagnostic, Source};

use crate::mechanism::{Form, Shape, Solid};
use crate::solid::of_shape;
use crate::{Imported, Measure, Options};

/// Reads a text.
fn from_text(text: &str, beside: &Path, folder: &Path, options: &Options) -> Result<Imported, Vec<Diagnostic>> {
    let source = Source::new("", text);
    crate::from_source(source, beside, folder, options).map_err(|refused| refused.diagnostics)
}

fn solid(form: Form, pose: Isometry3<f64>) -> Solid {
    of_shape(&Shape { form, pose, color: None }, 2700.0).unwrap()
}

#[track_caller]
fn assert_same(a: &Solid, b: &Solid, tolerance: f64) {
    assert!((a.mass - b.mass).abs() < tolerance * b.mass, "{} {}", a.mass, b.mass);
    assert!((a.com - b.com).amax() < tolerance, "{} {}", a.com, b.com);
    assert!((a.inertia - b.inertia).amax() < tolerance * b.inertia.amax(), "{} {}", a.inertia, b.inertia);
}

/// A box as triangles, as a text of OBJ, corners doubled by a scale.
const BOX: &str = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\nv 1 0 3\nv 1 2 3\nv 0 2 3\n\
                   f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn a_mesh_weighs_what_its_shape_does() {
    let folder = std::env::temp_dir().join(format!("odyn-import-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("box.obj");
    std::fs::write(&file, BOX).unwrap();
    let pose =
        Isometry3::from_parts(Translation3::new(0.3, -1.0, 2.0), UnitQuaternion::from_euler_angles(0.3, 0.5, -1.2));
    let mesh =
        solid(Form::Mesh { path: file.clone(), scale: Matrix3::from_diagonal(&Vector3::new(0.5, 0.25, 0.1)) }, pose);
    let middle = pose * Translation3::new(0.25, 0.25, 0.15);
    assert_same(&mesh, &solid(Form::Box(Vector3::new(0.5, 0.5, 0.3)), middle), 1e-12);
    // Mirrored it is inside out, and weighs the same.
    let mirrored = solid(
        Form::Mesh { path: file.clone(), scale: Matrix3::from_diagonal(&Vector3::new(-0.5, 0.25, 0.1)) },
        Isometry3::identity(),
    );
    let beside = Isometry3::translation(-0.25, 0.25, 0.15);
    assert_same(&mirrored, &solid(Form::Box(Vector3::new(0.5, 0.5, 0.3)), beside), 1e-12);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A capsule is a body of revolution: its mass and moments by sums over thin discs.
#[test]
fn a_capsule_weighs_what_its_discs_do() {
    let (radius, length) = (0.3, 0.8);
    let (mut mass, mut along, mut across) = (0.0, 0.0, 0.0);
    let (count, half) = (200_000, length / 2.0 + radius);
    let step = 2.0 * half / f64::from(count);
    for k in 0..count {
        let z = -half + (f64::from(k) + 0.5) * step;
        let beyond = (z.abs() - length / 2.0).max(0.0);
        let square = radius * radius - beyond * beyond;
        let disc = 2700.0 * std::f64::consts::PI * square * step;
        mass += disc;
        along += disc * square / 2.0;
        across += disc * (square / 4.0 + z * z);
    }
    let capsule = solid(Form::Capsule(radius, length), Isometry3::identity());
    assert!((capsule.mass / mass - 1.0).abs() < 1e-8);
    assert!((capsule.inertia.m33 / along - 1.0).abs() < 1e-8);
    assert!((capsule.inertia.m11 / across - 1.0).abs() < 1e-8);
    assert!(capsule.com.amax() < 1e-15);
}

/// What is said of a text, with the line that it points to.
#[track_caller]
fn refused(text: &str) -> String {
    let found = from_text(text, Path::new(""), Path::new(""), &Options::default()).unwrap_err();
    assert!(found.iter().any(odyn_diagnostics::Diagnostic::is_error));
    found.iter().map(|diagnostic| diagnostic.message.clone()).collect::<Vec<_>>().join("; ")
}

#[test]
fn hostile_xml_is_refused() {
    let laughs = "<!DOCTYPE robot [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;\">]><robot name=\"&b;\"/>";
    assert!(refused(laughs).contains("XML"), "{}", refused(laughs));
    let file = "<!DOCTYPE robot [<!ENTITY a SYSTEM \"file:///etc/hostname\">]><robot name=\"&a;\"/>";
    assert!(refused(file).contains("XML"));
    for depth in [1000, 200_000] {
        let deep =
            format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(depth), "</body>".repeat(depth));
        assert!(refused(&deep).contains("within each other") || refused(&deep).contains("XML"));
    }
    for text in ["", "robot", "<robot", "<robot>", "<robot name='a' name='b'/>", "\u{0}", "<robot>&nbsp;</robot>"] {
        assert!(refused(text).contains("XML"), "{text:?}");
    }
    assert!(refused("<svg/>").contains("<svg>"));
    assert!(refused("<robot name=\"nothing\"/>").contains("no link"));
}

fn robot(inside: &str) -> String {
    let mass = "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>";
    format!("<robot name=\"r\"><link name=\"a\">{mass}</link><link name=\"b\">{mass}</link>{inside}</robot>")
}

#[test]
fn mistakes_are_named() {
    let joint = |inside: &str| robot(&format!("<joint name=\"j\" type=\"revolute\">{inside}</joint>"));
    let ends = "<parent link=\"a\"/><child link=\"b\"/>";
    for (text, says) in [
        (joint("<parent link=\"a\"/>"), "no <child>"),
        (joint("<parent link=\"a\"/><child link=\"c\"/>"), "there is no link `c`"),
        (joint(&format!("{ends}<axis xyz=\"0 0 0\"/>")), "has no direction"),
        (joint(&format!("{ends}<axis xyz=\"0 0\"/>")), "2 numbers, 3 are needed"),
        (joint(&format!("{ends}<origin xyz=\"0 0 nan\"/>")), "not made of numbers"),
        (joint(&format!("{ends}<origin xyz=\"0 0 1e999\"/>")), "not made of numbers"),
        (joint(&format!("{ends}<dynamics damping=\"-1\"/>")), "`damping` is negative"),
        (
            robot("<joint name=\"j\" type=\"wobbly\"><parent link=\"a\"/><child link=\"b\"/></joint>"),
            "unknown type \"wobbly\"",
        ),
        (robot("<link name=\"a\"/>"), "a second link `a`"),
        (
            robot(
                "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
                   <joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint>",
            ),
            "hangs on itself",
        ),
        (
            robot(
                "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
                   <joint name=\"k\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>",
            ),
            "carried by two joints",
        ),
        ("<mujoco><worldbody><replicate/></worldbody></mujoco>".into(), "<replicate> is not expanded"),
        (
            "<mujoco><worldbody><body><joint class=\"none\"/><geom size=\"1\"/></body></worldbody></mujoco>".into(),
            "there is no class `none`",
        ),
        (
            "<mujoco><worldbody><body><joint type=\"odd\"/><geom size=\"1\"/></body></worldbody></mujoco>".into(),
            "unknown type \"odd\"",
        ),
        (
            "<mujoco><worldbody><body><joint/><geom type=\"box\" size=\"1\"/></body></worldbody></mujoco>".into(),
            "needs a `size`",
        ),
        ("<mujoco><default><default/></default></mujoco>".into(), "needs a name"),
        (
            "<mujoco><worldbody><body><joint/><geom size=\"1\"/></body></worldbody>\
             <equality><connect body1=\"none\"/></equality></mujoco>"
                .into(),
            "there is no body `none`",
        ),
    ] {
        assert!(refused(&text).contains(says), "{text}\n{}", refused(&text));
    }
}

#[test]
fn a_pose_of_a_joint_that_is_not_there_is_refused() {
    let text = robot("<joint name=\"elbow\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint>");
    let options = Options { pose: [("elbo".to_owned(), 1.0)].into(), ..Options::default() };
    let found = from_text(&text, Path::new(""), Path::new(""), &options).unwrap_err();
    assert!(found[0].help[0].contains("elbow"), "{found:?}");
}

#[test]
fn an_angle_is_no_coordinate_of_what_slides() {
    let read = |kind: &str, measure: Measure| {
        let ends = "<parent link=\"a\"/><child link=\"b\"/>";
        let text = robot(&format!("<joint name=\"j\" type=\"{kind}\">{ends}</joint>"));
        let pose = [("j".to_owned(), 0.25)].into();
        let options = Options { pose, measures: vec![("j".to_owned(), measure)], limits: false, ..Options::default() };
        from_text(&text, Path::new(""), Path::new(""), &options).map_err(|found| found[0].message.clone())
    };
    assert!(read("continuous", Measure::Angle).is_ok() && read("prismatic", Measure::Length).is_ok());
    assert!(read("continuous", Measure::Length).unwrap_err().contains("`j` turns"));
    assert!(read("prismatic", Measure::Angle).unwrap_err().contains("`j` slides"));
}

#[test]
fn a_joint_that_follows_itself_is_not_coupled() {
    let mimic = "<parent link=\"a\"/><child link=\"b\"/><mimic joint=\"elbow\" offset=\"0.5\"/>";
    let text = robot(&format!("<joint name=\"elbow\" type=\"continuous\">{mimic}</joint>"));
    let imported = from_text(&text, Path::new(""), Path::new(""), &Options::default()).unwrap();
    assert!(!imported.scene.contains("coupler"), "{}", imported.scene);
    assert!(imported.left_out.iter().any(|what| what.contains("`elbow` follows itself")), "{:?}", imported.left_out);
}

/// One that follows another that follows stands where both put it, in whichever order they are in the file.
#[test]
fn what_follows_may_be_followed() {
    let joint = |name: &str, child: &str, mimic: &str| {
        let ends = format!("<parent link=\"base\"/><child link=\"{child}\"/><axis xyz=\"0 1 0\"/>");
        format!("<joint name=\"{name}\" type=\"continuous\">{ends}{mimic}</joint>")
    };
    let link = |name: &str| {
        let inertia = "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>";
        format!("<link name=\"{name}\"><inertial><mass value=\"1\"/>{inertia}</inertial></link>")
    };
    let last = joint("jc", "c", "<mimic joint=\"jb\" multiplier=\"-2\" offset=\"0.1\"/>");
    let middle = joint("jb", "b", "<mimic joint=\"ja\" multiplier=\"1.5\" offset=\"-0.05\"/>");
    let first = joint("ja", "a", "");
    let links: String = ["base", "a", "b", "c"].map(link).concat();
    let options = Options { pose: std::collections::BTreeMap::from([("ja".to_owned(), 0.3)]), ..Options::default() };
    let scene = |joints: [&str; 3]| {
        let text = format!("<robot name=\"r\">{links}{}</robot>", joints.concat());
        from_text(&text, Path::new(""), Path::new(""), &options).unwrap().scene
    };
    let lines = |scene: String| {
        let mut found: Vec<String> = scene.lines().map(str::to_owned).collect();
        found.sort();
        found
    };
    assert_eq!(lines(scene([&first, &middle, &last])), lines(scene([&last, &middle, &first])));
}

/// What is no number is answered with what it probably is.
#[test]
fn numbers_that_are_none_have_a_remedy() {
    let help = |rpy: &str| {
        let joint = format!("<parent link=\"a\"/><child link=\"b\"/><origin rpy=\"{rpy}\"/>");
        let text = robot(&format!("<joint name=\"j\" type=\"continuous\">{joint}</joint>"));
        let found = from_text(&text, Path::new(""), Path::new(""), &Options::default()).unwrap_err();
        found[0].help[0].clone()
    };
    assert!(help("${pi/2} 0 0").contains("xacro"));
    assert!(help("0,1,2").contains("no commas"));
    assert!(help("-2 deg").contains("without units"));
}

#[test]
fn a_mesh_that_is_missing_is_named_with_where_it_was_looked_for() {
    let shape = |file: &str| format!("<collision><geometry><mesh filename=\"{file}\"/></geometry></collision>");
    let listed = |file: &str| {
        let text = format!("<robot name=\"r\"><link name=\"a\">{}</link></robot>", shape(file));
        from_text(&text, Path::new("models/arm"), Path::new(""), &Options::default()).unwrap().left_out.join("\n")
    };
    let beside = listed("parts/b.stl");
    assert!(beside.contains("mass of mesh `b.stl` of link `a`: there is no file models/arm/parts/b.stl"), "{beside}");
    let package = listed("package://robot/parts/b.stl");
    assert!(package.contains("there is neither `robot/parts/b.stl` nor `parts/b.stl` in the folder"), "{package}");
}

#[test]
fn names_of_scenes_are_made_of_letters_and_taken_once() {
    let mass = "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>";
    let text = format!(
        "<robot name=\"a &quot;b&quot;&#10;c\"><link name=\"ground\">{mass}</link><link name=\"le bras\">{mass}</link>\
         <joint name=\"le bras\" type=\"continuous\"><parent link=\"ground\"/><child link=\"le bras\"/></joint></robot>"
    );
    let scene = from_text(&text, Path::new(""), Path::new(""), &Options::default()).unwrap().scene;
    for name in ["title = \"a \\\"b\\\"\\u000Ac\"", "\"ground-2\"", "\"le_bras\"", "\"le_bras-joint\""] {
        assert!(scene.contains(name), "{name}: {scene}");
    }
}

/// A file that includes others is the file with their elements in it; mistakes are reported where they are written.
#[test]
fn included_files_are_part_of_the_file() {
    let folder = std::env::temp_dir().join(format!("odyn-include-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let body = "<body name=\"b\"><joint name=\"j\" class=\"stiff\"/><geom size=\"0.1\"/></body>";
    let defaults =
        "<default><joint damping=\"3\"/><default class=\"stiff\"><joint stiffness=\"7\"/></default></default>";
    let more = "<default><joint damping=\"4\" armature=\"2\"/></default>";
    write("whole.xml", &format!("<mujoco>{defaults}{more}<worldbody>{body}</worldbody></mujoco>"));
    let parts = "<mujoco><include file=\"parts/defaults.xml\"/><worldbody>\n<include file=\"parts/body.xml\"/></worldbody></mujoco>";
    write("main.xml", parts);
    write("parts/defaults.xml", &format!("<x>{defaults}<include file=\"parts/more.xml\"/></x>"));
    write("parts/more.xml", &format!("<!-- more --><mujocoinclude>{more}</mujocoinclude>"));
    write("parts/body.xml", &format!("<mujocoinclude>{body}</mujocoinclude>"));
    let read = |name: &str| crate::read(&folder.join(name), &folder, &Options::default());
    let (whole, main) = (read("whole.xml").unwrap(), read("main.xml").unwrap());
    assert_eq!(whole.scene, main.scene);
    for said in ["damping = 4", "stiffness = 7", "inertance = 2"] {
        assert!(main.scene.contains(said), "{said}: {}", main.scene);
    }
    let place = |name: &str| {
        let refused = read(name).unwrap_err();
        let found = &refused.diagnostics[0];
        let at = refused.source.locate(found.labels[0].span.clone().unwrap().start);
        (found.message.clone(), Path::new(&at.name).file_name().unwrap().to_string_lossy().into_owned(), at.line)
    };
    write("parts/body.xml", "<x>\n<body>\n<joint axis=\"0 0\"/><geom size=\"0.1\"/></body></x>");
    assert_eq!(place("main.xml"), ("`axis` has 2 numbers, 3 are needed".into(), "body.xml".into(), 3));
    write("parts/body.xml", "<x>\n<body></x>");
    assert_eq!(place("main.xml").1, "body.xml");
    write("parts/body.xml", "<x>\n<include file=\"main.xml\"/></x>");
    let (says, file, line) = place("main.xml");
    assert!(says.contains("included twice") && file == "main.xml" && line == 1, "{says} {file} {line}");
    write("main.xml", "<mujoco>\n<include file=\"none.xml\"/></mujoco>");
    assert!(place("main.xml").0.contains("cannot read"), "{:?}", place("main.xml"));
    std::fs::remove_dir_all(&folder).unwrap();
}

/// `settotalmass`, `boundmass` and `boundinertia` change masses as MuJoCo does.
#[test]
fn masses_are_those_that_the_compiler_makes() {
    let text = |compiler: &str| {
        format!(
            "<mujoco><compiler {compiler}/><worldbody><body name=\"a\"><joint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 2 2\"/>\
             <body name=\"b\"><joint/><inertial pos=\"0 0 0\" mass=\"3\" diaginertia=\"4 5 6\"/></body></body></worldbody></mujoco>"
        )
    };
    let scene =
        |compiler: &str| from_text(&text(compiler), Path::new(""), Path::new(""), &Options::default()).unwrap().scene;
    let scaled = scene("settotalmass=\"8\"");
    for said in ["mass = 2\n", "inertia = [2, 4, 4]", "mass = 6\n", "inertia = [8, 10, 12]"] {
        assert!(scaled.contains(said), "{said}: {scaled}");
    }
    let bounded = scene("boundmass=\"2\" boundinertia=\"4.5\"");
    for said in ["mass = 2\n", "inertia = [4.5, 4.5, 4.5]", "mass = 3\n", "inertia = [4.5, 5, 6]"] {
        assert!(bounded.contains(said), "{said}: {bounded}");
    }
    // A body that has no mass, or whose shapes do not count: MuJoCo 4.0 has 2 kg at [1, 2, 3] of its frame.
    for own in ["", "<geom size=\"0.1\" group=\"4\"/>"] {
        let scene = mjcf(&format!(
            "<compiler boundmass=\"2\" boundinertia=\"0.5\" inertiagrouprange=\"0 2\"/><worldbody><frame pos=\"0 0 5\">\
             <body name=\"a\" pos=\"1 2 3\"><joint/>{own}<body name=\"b\"><joint/><geom size=\"0.1\"/></body></body></frame></worldbody>"
        ))
        .scene;
        let said = "mass = 2\ncom = [1, 2, 3]\ninertia = [0.5, 0.5, 0.5]\nposition = [1, 2, 8]";
        assert!(scene.contains(said), "{scene}");
    }
}

/// Parts whose mass a file rounds to zero keep their inertia; those without extent are points.
#[test]
fn small_parts_keep_what_they_have() {
    let link = |name: &str, mass: &str, moment: &str| {
        format!(
            "<link name=\"{name}\"><inertial><mass value=\"{mass}\"/><inertia ixx=\"{moment}\" iyy=\"{moment}\" izz=\"{moment}\" \
             ixz=\"1e-30\"/></inertial></link>"
        )
    };
    let joint = |kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{child}-j\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        )
    };
    let links = [link("base", "9", "1"), link("shank", "2", "0.5"), link("foot", "0", "0.25"), link("point", "3", "0")];
    let joints =
        [joint("continuous", "base", "shank"), joint("fixed", "shank", "foot"), joint("continuous", "shank", "point")];
    let text = format!("<robot name=\"r\">{}{}</robot>", links.concat(), joints.concat());
    let imported = from_text(&text, Path::new(""), Path::new(""), &Options::default()).unwrap();
    let scene = imported.scene;
    assert!(scene.contains("mass = 2\ninertia = [0.75, 0.75, 0.75"), "{scene}");
    assert!(scene.contains("inertia = [0.000000000003, 0.000000000003, 0.000000000003]"), "{scene}");
    assert!(imported.left_out.iter().any(|what| what.starts_with("link `point` has mass and no extent")), "{scene}");
}

/// Hinges that begin further than half a turn from zero, or half a turn below it, read whole turns less, with all that counts on them.
#[test]
fn angles_are_counted_from_the_first_turn() {
    let text = |angle: f64| {
        format!(
            "<mujoco><compiler angle=\"radian\"/><worldbody><body><joint name=\"j\" ref=\"{angle}\" springref=\"{angle}\" stiffness=\"2\" \
             range=\"{} {}\"/><geom size=\"0.1\"/></body></worldbody></mujoco>",
            angle - 0.5,
            angle + 0.5
        )
    };
    let read = |text: &str| from_text(text, Path::new(""), Path::new(""), &Options::default()).unwrap();
    let (near, far) = (read(&text(0.25)), read(&text(0.25 + 2.0 * std::f64::consts::PI)));
    let rounded = |scene: &str| scene.replace("0.249999999999999", "0.25").replace("0.250000000000001", "0.25");
    let scene = |of: &str| rounded(of.split_once("title").unwrap().1);
    assert_eq!(scene(&near.scene), scene(&far.scene));
    assert!(far.left_out[0].contains("6.28318530717959 rad less"), "{:?}", far.left_out);
    let half = |sign: f64| read(&text(sign * std::f64::consts::PI)).scene;
    assert_eq!(scene(&half(-1.0)), scene(&half(1.0)));
}

/// Shapes without a mass that is known are refused where their body has no other, and words that change mechanics are listed.
#[test]
fn what_is_not_read_is_not_passed_over() {
    let text = |compiler: &str, geom: &str, inertial: &str| {
        format!(
            "<mujoco><compiler {compiler}/><asset><mesh name=\"m\" vertex=\"0 0 0 1 0 0 0 1 0 0 0 1\"/></asset><worldbody>\
             <body><joint springdamper=\"1 1\"/>{geom}<geom size=\"0.1\" group=\"1\"/>{inertial}</body></worldbody></mujoco>"
        )
    };
    let read = |text: String| from_text(&text, Path::new(""), Path::new(""), &Options::default());
    let mesh = "<geom type=\"mesh\" mesh=\"m\"/>";
    let refused = read(text("", mesh, "")).unwrap_err();
    assert!(refused[0].message.contains("mass of this shape is not known"), "{refused:?}");
    let inertial = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
    let known = read(text("mystery=\"7\"", mesh, inertial)).unwrap();
    for said in ["`mystery` of <compiler>: 7", "`springdamper`"] {
        assert!(known.left_out.iter().any(|what| what.contains(said)), "{said}: {:?}", known.left_out);
    }
    // A shape outside of the groups has no mass.
    let sphere = "<geom size=\"1\" group=\"3\"/>";
    let (all, some) = (read(text("", "", "")).unwrap(), read(text("inertiagrouprange=\"0 2\"", sphere, "")).unwrap());
    let mass = |scene: &str| scene.lines().find(|line| line.starts_with("mass")).unwrap().to_owned();
    assert_eq!(mass(&all.scene), mass(&some.scene));
}

/// Of a mesh that hides parts from its middle, or whose hull or surface is to weigh, MuJoCo makes another mass.
#[test]
fn meshes_that_weigh_something_else_in_mujoco_are_reported() {
    let folder = std::env::temp_dir().join(format!("odyn-import-mesh-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("box.obj"), BOX).unwrap();
    let foot = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 3 1\nv 0 3 1\n\
                f 3 2 1\nf 4 3 1\nf 5 4 1\nf 6 5 1\nf 7 8 9\nf 7 9 10\nf 7 10 11\nf 7 11 12\n\
                f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
    std::fs::write(folder.join("foot.obj"), foot).unwrap();
    let said = |file: &str, inertia: &str, inertial: &str| {
        let text = format!(
            "<mujoco><asset><mesh name=\"m\" file=\"{file}.obj\" {inertia}/></asset><worldbody><body><joint/>{inertial}\
             <geom type=\"mesh\" mesh=\"m\"/></body></worldbody></mujoco>"
        );
        let read = from_text(&text, &folder, &folder, &Options::default()).unwrap();
        read.left_out.iter().any(|what| what.contains("mass of mesh `m`"))
    };
    assert!(!said("box", "", "") && !said("box", "inertia=\"exact\"", "") && !said("foot", "inertia=\"exact\"", ""));
    assert!(said("foot", "", "") && said("box", "inertia=\"convex\"", "") && said("box", "inertia=\"shell\"", ""));
    let given = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
    assert!(!said("foot", "", given));
    std::fs::remove_dir_all(&folder).unwrap();
}

fn mjcf(inside: &str) -> crate::Imported {
    from_text(&format!("<mujoco>{inside}</mujoco>"), Path::new(""), Path::new(""), &Options::default()).unwrap()
}

/// MuJoCo gives a box or an ellipsoid between two ends the first number as both of its half edges across.
#[test]
fn shapes_between_two_ends_are_square_across() {
    let of = |kind: &str, size: &str| {
        let geom = format!("<geom type=\"{kind}\" fromto=\"0 0 0 0.3 0.4 1.2\" size=\"{size}\"/>");
        mjcf(&format!("<worldbody><body name=\"a\"><joint/>{geom}</body></worldbody>")).scene
    };
    for kind in ["box", "ellipsoid"] {
        assert_eq!(of(kind, "0.1"), of(kind, "0.1 0.3 0.7"), "{kind}");
    }
}

/// `<flag>` takes springs, dampers, friction, limits and equalities away.
#[test]
fn what_a_file_switches_off_is_not_there() {
    let with = |flags: &str| {
        mjcf(&format!(
            "<option><flag {flags}/></option><worldbody><body name=\"a\"><geom size=\"0.1\"/>\
             <joint name=\"j\" stiffness=\"2\" damping=\"3\" frictionloss=\"4\" range=\"-9 9\"/></body></worldbody>\
             <equality><connect body1=\"a\" anchor=\"0 0 1\"/></equality>"
        ))
        .scene
    };
    let words = ["stiffness = 2", "damping = 3", "\"dry-friction\"", "\"rotational-stop\""];
    let there = |scene: &str| words.map(|word| scene.contains(word));
    let all = with("");
    assert_eq!((there(&all), all.contains("enabled = false")), ([true; 4], false));
    for (flag, left) in [
        ("spring", [false, true, true, true]),
        ("damper", [true, false, true, true]),
        ("frictionloss", [true, true, false, true]),
        ("limit", [true, true, true, false]),
        ("constraint", [true, true, false, false]),
    ] {
        let scene = with(&format!("{flag}=\"disable\""));
        assert_eq!(there(&scene), left, "{flag}");
        assert_eq!(scene.contains("enabled = false"), flag == "constraint", "{flag}");
    }
    assert!(with("equality=\"disable\"").contains("enabled = false"));
    assert!(with("gravity=\"disable\"").contains("gravity = [0, 0, 0]"));
}

/// Shapes touch each other in MuJoCo unless the file says that they do not; a free joint may have damping from its class.
#[test]
fn contacts_and_the_resistance_of_free_joints_are_reported() {
    let two = |option: &str, default: &str, free: &str| {
        let body = |name: &str| format!("<body name=\"{name}\">{free}<geom size=\"0.1\"/></body>");
        let bodies = body("a") + &body("b");
        mjcf(&format!("{option}<default>{default}</default><worldbody>{bodies}</worldbody>")).left_out
    };
    let said = |left_out: &[String], word: &str| left_out.iter().filter(|what| what.contains(word)).count();
    let joint = "<joint type=\"free\"/>";
    let plain = two("", "", joint);
    assert_eq!((said(&plain, "contacts of shapes"), said(&plain, "free joint")), (1, 0), "{plain:?}");
    let apart = two("", "<geom contype=\"0\" conaffinity=\"0\"/>", joint);
    let off = two("<option><flag contact=\"disable\"/></option>", "", joint);
    assert_eq!((said(&apart, "contacts of shapes"), said(&off, "contacts of shapes")), (0, 0));
    let slow = "<joint damping=\"1\"/>";
    assert_eq!(said(&two("", slow, joint), "free joint"), 1);
    // MuJoCo's `freejoint` has no defaults.
    assert_eq!(said(&two("", slow, "<freejoint/>"), "free joint"), 0);
}

/// The rotor of a motor turns with its joint, behind the gear; kinds of motors have their defaults in common, the last of them counts.
#[test]
fn armature_and_damping_of_motors_are_with_their_joints() {
    let text = r#"<mujoco><default><motor armature="1"/><position armature="0.2" gear="2"/></default><worldbody>
        <body name="b"><joint name="j" axis="0 1 0" armature="0.05" damping="1"/><geom size="0.1"/>
        <body name="c"><joint name="k" type="ball"/><geom size="0.1" pos="1 0 0"/></body></body></worldbody>
        <actuator><motor joint="j"/><general jointinparent="j" gear="3 0 0 0 0 0" armature="0.1" damping="0.5"/>
        <motor name="tip" joint="k"/></actuator></mujoco>"#;
    let imported = from_text(text, Path::new(""), Path::new(""), &Options::default()).unwrap();
    // 0.05 + 4 * 0.2 + 9 * 0.1; 1 + 9 * 0.5
    for wanted in ["1.75", "5.5"] {
        assert!(imported.scene.contains(wanted), "{wanted}: {}", imported.scene);
    }
    let left_out = imported.left_out.join("\n");
    assert!(left_out.contains("motor `tip`: its armature and damping"), "{left_out}");
}

/// Byte order marks and blanks before the declaration are read, and places stay where they are.
#[test]
fn a_late_declaration_is_read() {
    for before in ["", " ", "\n\t", "\u{feff}", "\u{feff}\n "] {
        let text = format!("{before}<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<robot name=\"r\"><link/></robot>");
        let read = crate::xml::declared_late(text.clone());
        assert_eq!(read.len(), text.len());
        assert_eq!(read.find("<link"), text.find("<link"));
        let document = crate::xml::parse(&read).unwrap();
        assert!(document.root_element().has_tag_name("robot"), "{before:?}");
    }
    // One that stands behind something else is a mistake.
    assert!(crate::xml::parse(&crate::xml::declared_late("<a/><?xml version=\"1.0\"?>".into())).is_err());
}

/// Of joints with several coordinates the format does not say what damping, friction and limits are those of.
#[test]
fn what_resists_planar_and_floating_joints_is_listed() {
    let link = |name: &str| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>"#
        )
    };
    let joint = |name: &str, kind: &str, below: &str, rest: &str| {
        format!(r#"<joint name="{name}" type="{kind}"><parent link="base"/><child link="{below}"/>{rest}</joint>"#)
    };
    let resisted = r#"<dynamics damping="3" friction="0.2"/><limit lower="-1" upper="1"/>"#;
    let text = format!(
        r#"<robot name="r"><link name="base"/>{}{}{}{}{}{}</robot>"#,
        link("a"),
        link("b"),
        link("c"),
        joint("disc", "planar", "a", resisted),
        joint("buoy", "floating", "b", r#"<dynamics damping="3"/>"#),
        joint("puck", "planar", "c", r#"<dynamics damping="0"/><limit effort="1" velocity="1"/>"#),
    );
    let imported = from_text(&text, Path::new(""), Path::new(""), &Options::default()).unwrap();
    let listed = ["planar joint `disc`: its damping and friction and limits", "floating joint `buoy`: its damping"];
    for expected in listed {
        assert!(imported.left_out.iter().any(|what| what == expected), "{expected}: {:?}", imported.left_out);
    }
    assert!(!imported.left_out.iter().any(|what| what.contains("puck")), "{:?}", imported.left_out);
}

/// MuJoCo gives a primitive shape with a mesh the size of the mesh, and reads no `size`: its mass is not known here.
#[test]
fn shapes_fitted_to_meshes_have_no_size_of_their_own() {
    let of = |geom: &str, inertial: &str| {
        let text = format!(
            "<mujoco><asset><mesh name=\"m\" file=\"m.obj\"/></asset><worldbody><body><joint/>{inertial}{geom}</body></worldbody></mujoco>"
        );
        from_text(&text, Path::new(""), Path::new(""), &Options::default())
    };
    let given = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
    for geom in ["<geom type=\"capsule\" mesh=\"m\"/>", "<geom type=\"box\" mesh=\"m\" size=\"1 1 1\"/>"] {
        let refused = of(geom, "").unwrap_err();
        let said: String = refused.iter().map(|one| one.message.as_str()).collect();
        assert!(said.contains("is fitted to a mesh") && !said.contains("`size`"), "{said}");
        let left_out = of(geom, given).unwrap().left_out;
        assert!(left_out.iter().any(|what| what.contains("MuJoCo fits to mesh `m`")), "{left_out:?}");
    }
}

#[test]
fn what_is_left_out_is_said_once() {
    let inside = "<gazebo/><sensor/><gazebo/><sensor/>";
    let text = format!("<robot name=\"r\"><link name=\"a\"/>{inside}</robot>");
    let left_out = from_text(&text, Path::new(""), Path::new(""), &Options::default()).unwrap().left_out;
    assert_eq!(left_out[..2], ["<gazebo>: extensions of other programs", "<sensor>"]);
    assert!(!left_out[2..].iter().any(|what| what.starts_with('<')), "{left_out:?}");
}

/// What a text has beside the words that are read.
fn left_out(text: &str) -> Vec<String> {
    from_text(text, Path::new(""), Path::new(""), &Options::default()).unwrap().left_out
}

/// Misspelt words are listed with their line and the word that is meant, once each; known ones by what they are about.
#[test]
fn unknown_words_are_listed() {
    let mass = "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial>";
    let urdf = |joint: &str| {
        format!(
            "<robot name=\"r\" xmlns:drake=\"d\"><link name=\"a\"/><link name=\"b\">{mass}<drake:x/></link>\n\
             <joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/>\n{joint}</joint></robot>"
        )
    };
    for (wrong, says) in [
        ("<dynamcs damping=\"1\"/>", "unknown element <dynamcs> in <joint> (line 3); did you mean <dynamics>?"),
        ("<axes xyz=\"0 1 0\"/>", "unknown element <axes> in <joint> (line 3); did you mean <axis>?"),
        ("<Origin xyz=\"0 1 0\"/>", "unknown element <Origin> in <joint> (line 3); did you mean <origin>?"),
        ("<origin ryp=\"0 1 0\"/>", "unknown attribute `ryp` of <origin>: 0 1 0 (line 3); did you mean `rpy`?"),
        ("<dynamics dampng=\"1\"/>", "unknown attribute `dampng` of <dynamics>: 1 (line 3); did you mean `damping`?"),
        ("<mass value=\"1\"/>", "unknown element <mass> in <joint> (line 3); it belongs in <inertial>"),
        ("<qqq a=\"1\"/>\n<qqq/><qqq/>", "unknown element <qqq> in <joint> (line 3, and 2 more)"),
    ] {
        assert_eq!(left_out(&urdf(wrong))[0], says);
    }
    let known = left_out(&urdf("<safety_controller k_velocity=\"1\"/><limit velocity=\"1\" jerk=\"3\"/>"));
    assert!(!known.iter().any(|what| what.contains("unknown")), "{known:?}");
    assert!(known.contains(&"for other programs: <x>, <safety_controller>, `jerk`".to_owned()), "{known:?}");

    let text = "<mujoco><option timestep=\"1\"/><visual><anything/></visual><worldbody><light/>\n<body name=\"b1\">\
        <joint name=\"j1\" dampng=\"3\" user=\"1\"/><geom size=\".1\" dens=\"100\" contype=\"0\" conaffinity=\"0\" material=\"m\"/>\n\
        <body name=\"b2\"><jiont name=\"j2\"/><geom size=\".1\" dens=\"2\" solref=\"1 1\" contype=\"0\" conaffinity=\"0\"/></body></body>\
        </worldbody>\n<equalty/><actuator><motor joint=\"j1\" armatur=\"2\"/></actuator></mujoco>";
    let listed = left_out(text);
    for says in [
        "unknown attribute `dampng` of <joint>: 3 (line 2); did you mean `damping`?",
        "unknown attribute `dens` of <geom>: 100 (line 2, and 1 more); did you mean `density`?",
        "unknown element <jiont> in <body> (line 3); did you mean <joint>?",
        "unknown element <equalty> in <mujoco> (line 4); did you mean <equality>?",
        "unknown attribute `armatur` of <motor>: 2 (line 4); did you mean `armature`?",
        "how bodies would touch each other: `solref`",
        "how MuJoCo softens and solves its equations: `timestep`",
        "looks: <visual>, <light>, `material`",
        "for other programs: `user`",
    ] {
        assert!(listed.iter().any(|what| what == says), "{says}: {listed:#?}");
    }
    // Where the file is refused, they may be why.
    let small = "<mujoco><worldbody><body><joint/><geom siz=\"1\"/></body></worldbody></mujoco>";
    assert!(refused(small).contains("needs a `size`") && refused(small).contains("unknown attribute `siz`"));
    assert!(!refused("<mujoco><worldbody><replicate/></worldbody></mujoco>").contains("unknown"));
    // However many there are, the list is no book.
    let many: String = (0..1000).map(|k| format!("<q{k}/>")).collect();
    let many = left_out(&urdf(&many));
    assert!(many.len() < 60 && many.iter().any(|what| what == "unknown words, 960 more of them"), "{many:?}");
}

/// Words of a file that is included are listed with the file that they stand in.
#[test]
fn unknown_words_are_listed_with_their_files() {
    let folder = std::env::temp_dir().join(format!("odyn-words-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let body = "<x>\n<body><joint dampng=\"3\"/><geom size=\".1\"/></body></x>";
    std::fs::write(folder.join("body.xml"), body).unwrap();
    std::fs::write(
        folder.join("main.xml"),
        "<mujoco><worldbody>\n\n\n<include file=\"body.xml\"/></worldbody></mujoco>",
    )
    .unwrap();
    let left_out = crate::read(&folder.join("main.xml"), &folder, &Options::default()).unwrap().left_out;
    let file = folder.join("body.xml").display().to_string();
    let says = format!("unknown attribute `dampng` of <joint>: 3 (line 2 of {file}); did you mean `damping`?");
    assert_eq!(left_out[0], says);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A shape of a mesh without a type is the sphere that MuJoCo fits to the mesh: the mean of the half edges of a box that weighs and turns
/// as the mesh does, about its middle.
#[test]
fn a_shape_of_a_mesh_without_a_type_is_a_sphere() {
    let folder = std::env::temp_dir().join(format!("odyn-import-sphere-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("box.obj"), BOX).unwrap();
    let of = |compiler: &str, class: &str, geom: &str| {
        let text = format!(
            "<mujoco><compiler {compiler}/><default><geom {class}/></default><asset><mesh name=\"m\" file=\"box.obj\"/></asset><worldbody>\
             <body><joint/><geom mesh=\"m\" {geom}/></body></worldbody></mujoco>"
        );
        from_text(&text, &folder, &folder, &Options::default())
    };
    let sphere = of("", "", "").unwrap();
    // MuJoCo 4.0: 4188.79 kg at (0.5, 1, 1.5).
    for said in ["mass = 4188.79020478639\ncom = [0.5, 1, 1.5]\n", "kind = \"sphere\"\nradius = 1\n"] {
        assert!(sphere.scene.contains(said), "{said}: {}", sphere.scene);
    }
    assert!(sphere.left_out.iter().any(|what| what.contains("has no `type`")), "{:?}", sphere.left_out);
    let twice = of("", "type=\"sphere\"", "fitscale=\"2\"").unwrap();
    assert!(twice.scene.contains("radius = 2\n"), "{}", twice.scene);
    assert!(!twice.left_out.iter().any(|what| what.contains("has no `type`")), "{:?}", twice.left_out);
    for mesh in [of("", "type=\"mesh\"", ""), of("", "", "type=\"mesh\"")] {
        assert!(mesh.unwrap().scene.contains("mass = 6000\n"));
    }
    let bounds = of("fitaabb=\"true\"", "", "").unwrap_err();
    assert!(bounds[0].message.contains("is fitted to a mesh"), "{bounds:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Limits that are both zero are none where MuJoCo finds out by itself whether there are any; they are a mistake where they are wanted.
#[test]
fn limits_that_are_both_zero_are_none() {
    let text = |joint: &str| {
        format!(
            "<mujoco><default><default class=\"a\"><joint range=\"-30 60\"/></default></default><worldbody>\
             <body childclass=\"a\" gravcomp=\"0.0\"><joint {joint}/><geom size=\".1\"/></body></worldbody></mujoco>"
        )
    };
    let stops =
        |joint: &str| mjcf(&text(joint).replace("<mujoco>", "").replace("</mujoco>", "")).scene.contains("-stop");
    assert!(stops("") && !stops("range=\"0 0\"") && stops("range=\"0 1\"") && !stops("limited=\"false\""));
    assert!(refused(&text("range=\"0 0\" limited=\"true\"")).contains("0 is not below 0"));
    // No share of the weight is no compensation.
    let said = |text: &str| left_out(text).iter().any(|what| what.contains("compensation of gravity"));
    assert!(!said(&text("")) && said(&text("").replace("0.0", "0.5")));
}

/// Several links may be no joint's child: each is held as the first would be, which is said. So are names that are others in the scene.
#[test]
fn roots_and_new_names_are_listed() {
    let link = |name: &str| {
        format!(
            "<link name=\"{name}\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>"
        )
    };
    let links = ["base", "arm", "table"].map(link).concat();
    let joint = "<joint name=\"arm\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/></joint>";
    let two = format!("<robot name=\"r\">{links}{joint}</robot>");
    let listed = left_out(&two);
    let roots =
        "links that are no joint's child: `base`, `table`; each stands on the ground, where a URDF has one of them";
    assert!(listed.iter().any(|what| what == roots), "{listed:?}");
    let free = Options { base: crate::Base::Free, ..Options::default() };
    let free = from_text(&two, Path::new(""), Path::new(""), &free).unwrap().left_out;
    assert!(free.iter().any(|what| what.contains("`base`, `table`; each moves freely")), "{free:?}");
    let names = |listed: &[String]| listed.iter().find(|what| what.starts_with("names of a scene")).cloned();
    let rule = "names of a scene are of letters, digits, `_` and `-`, each once, and `t` is the time";
    assert_eq!(names(&listed), Some(format!("{rule}: joint `arm` is `arm-joint`")));
    let one = left_out(&two.replace(&link("table"), "").replace("joint name=\"arm\"", "joint name=\"j\""));
    assert!(!one.iter().any(|what| what.contains("no joint's child")) && names(&one).is_none(), "{one:?}");
    let changed = left_out(&two.replace("\"arm\"", "\"a/b c\"").replace("\"base\"", "\"ground\""));
    let said = "body `ground` is `ground-2`, body `a/b c` is `a_b_c`, joint `a/b c` is `a_b_c-joint`";
    assert_eq!(names(&changed), Some(format!("{rule}: {said}")));
    // An output cannot have the name of the column of times; a body can.
    let time = left_out(&two.replace("joint name=\"arm\"", "joint name=\"t\""));
    assert_eq!(names(&time), Some(format!("{rule}: joint `t` is `t-joint`")));
    let body = left_out(&two.replace("\"base\"", "\"t\"").replace("joint name=\"arm\"", "joint name=\"j\""));
    assert_eq!(names(&body), None);
}

/// Numbers for MuJoCo 4.0, which takes the last `<inertial>` of a body and its frames.
#[test]
fn masses_within_frames_are_those_of_the_body() {
    let body = |inside: &str| {
        mjcf(&format!("<worldbody><body name=\"a\"><joint/><geom size=\"0.1\"/>{inside}</body></worldbody>")).scene
    };
    let inertial = |x: &str, mass: u8| format!("<inertial pos=\"{x} 0 0\" mass=\"{mass}\" diaginertia=\"1 1 1.5\"/>");
    let turned = body(&format!(
        "<frame pos=\"1 0 0\" euler=\"90 0 0\"><frame pos=\"1 0 0\">{}</frame></frame>",
        inertial("0.5", 2)
    ));
    assert!(turned.contains("mass = 2\ncom = [2.5, 0, 0]\ninertia = [1, 1.5, 1]"), "{turned}");
    let (own, framed) = (inertial("0", 1), format!("<frame pos=\"1 0 0\">{}</frame>", inertial("0", 2)));
    assert!(body(&format!("{own}{framed}")).contains("mass = 2\ncom = [1, 0, 0]"));
    assert!(body(&format!("{framed}{own}")).contains("mass = 1\ninertia"));
    // A shape whose mass is not known needs none beside it.
    let mesh = "<asset><mesh name=\"m\" vertex=\"0 0 0 1 0 0 0 1 0 0 0 1\"/></asset>";
    let scene =
        mjcf(&format!("{mesh}<worldbody><body><joint/><geom type=\"mesh\" mesh=\"m\"/>{framed}</body></worldbody>"))
            .scene;
    assert!(scene.contains("mass = 2"), "{scene}");
}

/// `inertiafromgeom="true"` replaces the `<inertial>` of a body by what its shapes weigh, if they weigh anything: numbers of MuJoCo 4.0.
#[test]
fn a_body_without_shapes_keeps_its_inertial() {
    let inertial = "<inertial pos=\"0.2 0 0\" mass=\"2\" diaginertia=\"1 1 1.5\"/>";
    let scene = |geom: &str| {
        let body = format!("<body name=\"a\"><joint/>{inertial}{geom}</body>");
        let compiler = "<compiler inertiafromgeom=\"true\" inertiagrouprange=\"0 2\"/>";
        mjcf(&format!("{compiler}<worldbody>{body}</worldbody>")).scene
    };
    for weightless in ["", "<geom size=\"0.1\" mass=\"0\"/>", "<geom size=\"0.1\" group=\"5\"/>"] {
        assert!(scene(weightless).contains("mass = 2\ncom = [0.2, 0, 0]"), "{}", scene(weightless));
    }
    assert!(scene("<geom size=\"0.1\" mass=\"3\"/>").contains("mass = 3\ninertia"));
}

/// With `relpose`, MuJoCo keeps the `anchor` of the second body at the place that `relpose` has in the first.
#[test]
fn the_place_of_a_weld_in_the_first_body_is_that_of_the_anchor() {
    let frames = |more: &str| {
        let body = |name: &str, x: f64| {
            format!("<body name=\"{name}\" pos=\"{x} 0 0\"><freejoint/><geom size=\"0.1\"/></body>")
        };
        let bodies = body("a", 0.0) + &body("b", 1.0);
        let weld = format!("<weld name=\"w\" body1=\"b\" body2=\"a\" {more}/>");
        let scene = mjcf(&format!("<worldbody>{bodies}</worldbody><equality>{weld}</equality>")).scene;
        let (_, frames) = scene.split_once("frames = [\n").unwrap();
        frames.lines().take(2).map(|line| line.trim().to_owned()).collect::<Vec<_>>()
    };
    let at = |x: f64| format!("{{ position = [{x}, 0, 0] }},");
    assert_eq!(frames("relpose=\"-1 0 0 1 0 0 0\" anchor=\"0.25 0 0\""), [at(-1.0), at(0.25)]);
    // Without a quaternion bodies stay as they are at the references.
    for more in ["", "relpose=\"-1 0 0 0 0 0 0\""] {
        assert_eq!(frames(&format!("{more} anchor=\"0.25 0 0\"")), [at(-0.75), at(0.25)], "{more}");
    }
}

/// MuJoCo weighs the rows of a weld that hold the orientation by `torquescale`: with zero there are none.
#[test]
fn a_weld_without_torque_holds_a_point() {
    let body = "<body name=\"a\"><freejoint/><geom size=\"0.1\"/></body>";
    let weld = |more: &str| {
        let weld = format!("<weld name=\"w\" body1=\"a\" anchor=\"0.25 0 0\" {more}/>");
        let imported = mjcf(&format!("<worldbody>{body}</worldbody><equality>{weld}</equality>"));
        let kind = imported.scene.split_once("name = \"w\"\ntype = ").unwrap().1.lines().next().unwrap().to_owned();
        (kind, imported.left_out.iter().any(|what| what.contains("torquescale")))
    };
    assert_eq!(weld(""), ("\"bracket\"".into(), false));
    assert_eq!(weld("torquescale=\"1\""), ("\"bracket\"".into(), false));
    assert_eq!(weld("torquescale=\"0.5\""), ("\"bracket\"".into(), true));
    assert_eq!(weld("torquescale=\"0\""), ("\"spherical\"".into(), false));
}

/// What an element has fewer numbers of than its class goes on with those of the class, as in MuJoCo 4.0: `size`, and polynomials of
/// damping and stiffness.
#[test]
fn further_numbers_are_those_of_the_class() {
    let with = |class: &str, own: &str| {
        mjcf(&format!("<default>{class}</default><worldbody><body name=\"a\"><joint/>{own}</body></worldbody>"))
    };
    let geom = |class: &str, own: &str| {
        with(&format!("<geom type=\"capsule\" size=\"{class}\"/>"), &format!("<geom size=\"{own}\"/>")).scene
    };
    let capsule = geom("0.05 0.15", "0.07");
    assert!(capsule.contains("radius = 0.07\nlength = 0.3") && capsule.contains("mass = 6.054896"), "{capsule}");
    assert_eq!(capsule, geom("0.05", "0.07 0.15"));
    assert_eq!(capsule, geom("0.07 0.15", ""));
    for word in ["damping", "stiffness"] {
        let listed = |class: &str, own: &str| {
            let class = format!("<default><joint {word}=\"{class}\"/></default>");
            let body = format!("<body name=\"a\"><joint {word}=\"{own}\"/><geom size=\"0.1\"/></body>");
            let imported = mjcf(&format!("{class}<worldbody>{body}</worldbody>"));
            assert!(imported.scene.contains(&format!("{word} = 0.25")), "{}", imported.scene);
            imported.left_out.iter().any(|what| what.contains("as a polynomial"))
        };
        assert!(listed("0.125 0.5", "0.25") && !listed("0.125", "0.25") && !listed("0.125 0.5", "0.25 0"), "{word}");
    }
}

/// `balanceinertia`: numbers of MuJoCo 4.0, after `boundinertia` and before `settotalmass`.
#[test]
fn moments_that_no_body_can_have_are_balanced() {
    let inertia = |compiler: &str, given: &str| {
        let inertial = format!("<inertial pos=\"0 0 0\" mass=\"1\" {given}/>");
        let compiler = format!("<compiler balanceinertia=\"true\" {compiler}/>");
        let scene =
            mjcf(&format!("{compiler}<worldbody><body name=\"a\"><freejoint/>{inertial}</body></worldbody>")).scene;
        scene.lines().find(|line| line.starts_with("inertia")).unwrap().to_owned()
    };
    assert_eq!(inertia("", "diaginertia=\"1 1 4\""), "inertia = [2, 2, 2]");
    assert_eq!(inertia("", "diaginertia=\"1 1 2\""), "inertia = [1, 1, 2]");
    assert_eq!(inertia("", "diaginertia=\"0.1 0.1 0.1\""), "inertia = [0.1, 0.1, 0.1]");
    assert_eq!(inertia("boundinertia=\"2\"", "diaginertia=\"1 1 3\""), "inertia = [2, 2, 3]");
    assert_eq!(inertia("settotalmass=\"6\"", "diaginertia=\"1 1 3\""), "inertia = [10, 10, 10]");
    // A flat plate that is turned.
    assert!(inertia("", "fullinertia=\"1.3 1.7 3 0.2 0 0\"").contains("[1.3, 1.7, 3, 0.2"));
}
