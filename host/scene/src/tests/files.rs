//! Curves and grids from files, and grids written in scenes.

use super::*;
use std::path::PathBuf;

/// A folder that goes when it is done with.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-scene-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> &Self {
        std::fs::write(self.0.join(name), text).unwrap();
        self
    }

    /// A scene in this folder with an element that has this parameter `p`.
    fn scene(&self, p: &str) -> Result<Scene, Box<Rejected>> {
        let text = format!(
            "[units]\nangle = \"deg\"\n{SIMULATION}[parameters]\ns = 3\n[[force]]\nname = \"e\"\ntype = \"t\"\nbodies = [\"a\"]\nparams.p = {p}\n"
        );
        let source = Source::new(self.0.join("scene.toml").display().to_string(), text);
        parse(source, &[]).map(|(scene, _)| scene)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const SPEED: Dimension = Dimension::ANGLE;

fn parameter(scene: &Scene) -> &RawValue {
    scene.elements[0].params.get("p").expect("it is written")
}

fn curve(scene: &Scene) -> toml::Value {
    scene.function(parameter(scene), "x", SPEED, Dimension::TORQUE).unwrap_or_else(|error| panic!("{error:?}"))
}

fn surface(scene: &Scene) -> toml::Value {
    let dimensions = [Some(SPEED), None, Some(Dimension::TORQUE)];
    scene.surface(parameter(scene), "p", dimensions).unwrap_or_else(|error| panic!("{error:?}"))
}

fn numbers(value: &toml::Value) -> Vec<f64> {
    match value {
        toml::Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_float().unwrap()],
    }
}

#[test]
fn a_curve_of_a_file_is_the_curve_that_is_written() {
    let folder = Folder::new("curve");
    // `s` is a parameter of the scene, too, which has no say in a file. A byte order mark, remarks, blanks and quotes are no matter.
    folder.file(
        "c.csv",
        "\u{feff}# a motor\n\"speed [turn]\" ; place [m/s]; torque [mN m]\n\n0; 1; 5000\n 0.5 ;2;2500\n",
    );
    let written = folder
        .scene("{ points = [[0, \"5 N m\"], [180, 2.5]], interpolation = \"linear\", periodic = false }")
        .unwrap();
    let read = folder
        .scene("{ file = \"c.csv\", columns = [\"speed\", \"torque\"], interpolation = \"linear\" }")
        .unwrap_or_else(|rejected| panic!("{}", rejected.rendered()));
    assert_eq!(curve(&read), curve(&written));
    assert_eq!(read.files, ["c.csv"]);
    // Plain numbers are in the scene's units.
    folder.file("plain.csv", "speed, torque\n0, 5\n180, 2.5\n");
    assert_eq!(curve(&folder.scene("{ file = \"plain.csv\", interpolation = \"linear\" }").unwrap()), curve(&written));
    folder.file("units.csv", "speed, torque\n0, 5\n0.5, 2.5\n");
    let given = "{ file = \"units.csv\", units = [\"turn\", \"N m\"], interpolation = \"linear\" }";
    assert_eq!(curve(&folder.scene(given).unwrap()), curve(&written));
}

/// Of a file of more columns without `columns` the first two are a curve; a function of two variables says that it needs three.
#[test]
fn the_first_two_columns_are_a_curve() {
    let folder = Folder::new("first-two");
    let written = folder.scene("{ points = [[0, \"5 N m\"], [180, 2.5]] }").unwrap();
    folder.file("three.csv", "angle,torque [N m],note\n0,5,1\n180,2.5,1\n");
    let three = folder.scene("{ file = \"three.csv\" }").unwrap_or_else(|rejected| panic!("{}", rejected.rendered()));
    assert_eq!(curve(&three), curve(&written));
    let units = folder.scene("{ file = \"three.csv\", units = [\"deg\", \"N m\"] }").unwrap();
    assert_eq!(curve(&units), curve(&written));
    let error = three.surface(parameter(&three), "p", [None; 3]).expect_err("a curve");
    assert!(error.help.iter().any(|help| help.contains("name three columns")), "{error:?}");
}

/// Blanks stand between fields where nothing else does; a unit belongs to the name before it, and one column has names of several words.
#[test]
fn blanks_separate_columns() {
    let folder = Folder::new("blanks");
    let written = folder.scene("{ points = [[0, \"5 N m\"], [180, 2.5]] }").unwrap();
    folder.file("blanks.csv", "# a motor\n  angle [turn]   torque [N m]\n0     5\n 0.5   2.5  \n");
    let blanks = folder.scene("{ file = \"blanks.csv\" }").unwrap_or_else(|rejected| panic!("{}", rejected.rendered()));
    assert_eq!(curve(&blanks), curve(&written));
    folder.file("list.csv", "the force [N]\n5\n2.5\n");
    let list = folder.scene("{ file = \"list.csv\", columns = [\"the force\"] }").unwrap();
    assert_eq!(parameter(&list).as_array().unwrap().len(), 2);
}

#[test]
fn a_grid_of_a_file_is_the_grid_that_is_written() {
    let folder = Folder::new("grid");
    let written =
        folder.scene("{ x = [0, 90, \"1 turn\"], y = [1, \"2 m\"], z = [[1, 2], [3, 4], [5, \"6 J\"]] }").unwrap();
    let expected = surface(&written);
    assert_eq!(numbers(&expected["z"]), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    folder.file("matrix.csv", "x over y, 1, 2\n0, 1, 2\n90, 3, 4\n360, 5, 6\n");
    assert_eq!(surface(&folder.scene("{ file = \"matrix.csv\" }").unwrap()), expected);
    folder
        .file("long.csv", "torque [N m]\tspeed [deg]\tu\n6\t360\t2\n1\t0\t1\n4\t90\t2\n2\t0\t2\n5\t360\t1\n3\t90\t1\n");
    let long = folder.scene("{ file = \"long.csv\", columns = [\"speed\", \"u\", \"torque\"] }").unwrap();
    assert_eq!(surface(&long), expected);
}

#[test]
fn mistakes_point_into_the_file() {
    let folder = Folder::new("mistakes");
    let columns = "{ file = \"f.csv\", columns = [\"a\", \"b\", \"c\"] }";
    for (file, parameter, words, place) in [
        ("a,b\n1,2\n3,x\n", "{ file = \"f.csv\" }", "`x` is no number", "f.csv:3:3"),
        ("a,b\n1,2\n3,\n", "{ file = \"f.csv\" }", "this field is empty", "f.csv:3:3"),
        ("a,b\n1,2\n3,4,5\n", "{ file = \"f.csv\" }", "this line has 3 fields, the first one has 2", "f.csv:3:1"),
        ("a [mm],b [quark]\n1,2\n", "{ file = \"f.csv\" }", "the unit `quark` can't be read", "f.csv:1:8"),
        ("a,b\n", "{ file = \"f.csv\" }", "has no numbers", "f.csv:1:1"),
        // What would be taken for names, or for values.
        ("0,1\n1,2\n2,3\n", "{ file = \"f.csv\" }", "the first line has numbers", "f.csv:1:1"),
        ("force [N],t [s]\n1,0\n2,1\n", "{ file = \"f.csv\" }", "is the second column", "f.csv:1:11"),
        ("a;b\n0;1,5\n", "{ file = \"f.csv\" }", "decimals follow a point", "f.csv:2:3"),
        ("# nothing\n", "{ file = \"f.csv\" }", "no line with the names of its columns", "scene.toml"),
        ("a,b,c\n1,2,3\n1,2,4\n", columns, "the point 1, 2 is there twice", "f.csv:3:1"),
        ("a,b,c\n1,2,3\n2,2,4\n1,3,4\n", columns, "has no value at 2, 3", "scene.toml"),
        ("a,b,d\n1,2,3\n", columns, "has no column `c`", "scene.toml"),
        ("a,1,c\n1,2,3\n", "{ file = \"f.csv\" }", "`c` is no number", "f.csv:1:5"),
        ("a;b;1,5\n1;2;3\n", "{ file = \"f.csv\" }", "`b` is no number", "f.csv:1:3"),
        ("force [N],t [s],x\n1,0,3\n2,1,3\n", "{ file = \"f.csv\" }", "is the second column", "f.csv:1:11"),
        ("a b\n0 1\n1 2 3\n", "{ file = \"f.csv\" }", "this line has 3 fields, the first one has 2", "f.csv:3:1"),
        ("a  b\n0  1\n 1   x\n", "{ file = \"f.csv\" }", "`x` is no number", "f.csv:3:6"),
        (
            "a,b\n1,2\n",
            "{ file = \"f.csv\", points = [[0, 1]] }",
            "`file` and `points` cannot be given together",
            "scene.toml",
        ),
        ("a,b\n1,2\n", "{ file = \"missing.csv\" }", "cannot read", "scene.toml"),
        ("a,b\n1,2\n", "{ file = \"f.csv\", units = [\"m\"] }", "`units` needs 2 units, found 1", "scene.toml"),
    ] {
        let rejected = match folder.file("f.csv", file).scene(parameter) {
            Ok(_) => panic!("{file:?} with {parameter} is accepted"),
            Err(rejected) => rejected,
        };
        let shown = rejected.rendered();
        assert!(shown.contains(words) && shown.contains(place), "{shown}");
        assert_eq!(rejected.diagnostics.len(), 1, "{shown}");
    }
}

#[test]
fn what_a_file_says_is_checked_as_what_a_scene_says() {
    let folder = Folder::new("checked");
    let wrong = |p: &str| {
        let scene = folder.scene(p).unwrap_or_else(|rejected| panic!("{}", rejected.rendered()));
        let error = scene.function(parameter(&scene), "x", SPEED, Dimension::TORQUE).expect_err(p);
        render(&[*error], &scene.source, false)
    };
    folder.file("f.csv", "speed,torque\n1,2\n1,3\n");
    let shown = wrong("{ file = \"f.csv\" }");
    assert!(shown.contains("must increase") && shown.contains("f.csv:3:1"), "{shown}");
    folder.file("f.csv", "speed [m],torque\n1,2\n2,3\n");
    let shown = wrong("{ file = \"f.csv\" }");
    assert!(shown.contains("expected an angle, found a length") && shown.contains("f.csv:2:1"), "{shown}");
    folder.file("f.csv", "speed,torque [1]\n1,2\n2,3\n");
    assert!(wrong("{ file = \"f.csv\" }").contains("expected a torque or energy"));
    folder.file("f.csv", "a,1,2\n1,2,3\n2,3,4\n");
    assert!(wrong("{ file = \"f.csv\" }").contains("a function of one variable cannot be given by a grid"));
}

#[test]
fn grids_are_checked() {
    let folder = Folder::new("grids");
    for (p, words) in [
        ("{ x = [0, 1], y = [0, 1], z = [[0, 1]] }", "`z` needs 2 lists, one per value of x, found 1"),
        (
            "{ x = [0, 1], y = [0, 1], z = [[0, 1], [0]] }",
            "`z` needs 2 values per value of x, one per value of y, found 1",
        ),
        ("{ x = [0, 0], y = [0, 1], z = [[0, 1], [0, 1]] }", "the values of x of a grid must increase"),
        ("{ x = [0], y = [0, 1], z = [[0, 1]] }", "a grid needs at least 2 values of x, found 1"),
        ("{ x = [0, 1], z = [[0, 1]] }", "a function given on a grid needs `y`"),
        ("{ x = [0, 1], y = [0, 1], z = [[0, 1], [0, 1]], interpolation = \"steps\" }", "not joined by steps"),
        ("{ x = [0, 1], y = [0, 1], z = [[0, 1], [0, 1]], outside = 1 }", "unknown key `outside`"),
        ("{ points = [[0, 1], [1, 2]] }", "cannot be given by the points of a curve"),
        ("3", "must be a function of two variables"),
    ] {
        let scene = folder.scene(p).unwrap_or_else(|rejected| panic!("{}", rejected.rendered()));
        let error = scene.surface(parameter(&scene), "p", [None; 3]).expect_err(p);
        assert!(error.message.contains(words), "{p}: {}", error.message);
    }
}

#[test]
fn another_file_makes_another_source() {
    let folder = Folder::new("source");
    let source = |text: &str| folder.file("f.csv", text).scene("{ file = \"f.csv\" }").unwrap().source;
    assert_ne!(source("a,b\n1,2\n2,3\n"), source("a,b\n1,2\n2,4\n"));
    assert_eq!(source("a,b\n1,2\n2,3\n"), source("a,b\n1,2\n2,3\n"));
}

#[test]
fn a_file_in_utf_16_is_no_matter_of_paths() {
    let folder = Folder::new("utf16");
    let bytes: Vec<u8> = [0xff, 0xfe].into_iter().chain("t,a\n0,1\n".bytes().flat_map(|byte| [byte, 0])).collect();
    std::fs::write(folder.0.join("wide.csv"), bytes).unwrap();
    let rejected = folder.scene("{ file = \"wide.csv\" }").unwrap_err().rendered();
    assert!(rejected.contains("is UTF-16, not UTF-8 text") && rejected.contains("iconv -f utf16"), "{rejected}");
    assert!(!rejected.contains("a path is relative"), "{rejected}");
}
