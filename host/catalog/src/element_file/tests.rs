//! Files of elements are read as they are written, give the equations of the same elements in Rust, and are refused with their line.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use std::path::Path;

use element_api::params::Table as Params;
use element_api::prelude::*;
use element_api::recording::{Input, Op};
use element_api::set::ElementClass;
use element_api::{Recording, adapt};

use super::*;

/// Numbers that look random (Knuth's MMIX).
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

const ROD: &str = r#"odyn-element = 1
contract = "1.2.0"
conventions = 1
package = "rod"
version = "0.1.0"

[[element]]
[element.description]
name = "rod"
kind = "joint"
summary = "two points keep their distance"
frames = [{ name = "i" }, { name = "j" }]
rows = ["distance"]
[[element.description.params]]
name = "length"
kind = "number"
unit = "m"
doc = ""
above = 0.0

[element.recording]
equations = '''
v0 = position 1 0
v1 = position 0 0
v2 = sub v0 v1
v3 = position 1 1
v4 = position 0 1
v5 = sub v3 v4
v6 = position 1 2
v7 = position 0 2
v8 = sub v6 v7
v9 = mul v2 v2
v10 = mul v5 v5
v11 = add v9 v10
v12 = mul v8 v8
v13 = add v11 v12
v14 = param length
v15 = powi v14 2
v16 = sub v13 v15
v17 = mul 2 v14
v18 = div v16 v17
residual 0 = v18  # distance
'''
"#;

#[derive(Debug, Clone, Copy, Parameters)]
struct RodParameters {
    /// Length.
    #[param(unit = "m", above = 0.0)]
    length: f64,
}

struct Rod(RodParameters);

impl Element for Rod {
    const NAME: &'static str = "rod";
    const SUMMARY: &'static str = "two points keep their distance";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
    type Parameters = RodParameters;
    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Constraint for Rod {
    const ROWS: &'static [&'static str] = &["distance"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        let d = at.frames()[1].position - at.frames()[0].position;
        rows.push((d.dot(&d) - self.0.length.powi(2)) / (2.0 * self.0.length));
    }
}

fn classes(text: &str) -> Result<Vec<DataClass>, String> {
    read(Path::new("x.odyn-element"), text.as_bytes()).map(|(_, classes)| classes).map_err(|error| error.to_string())
}

fn recording(class: &dyn ElementClass, params: &str) -> Recording {
    let mut set = class.new_set();
    let number = set.add(&params.parse::<Params>().unwrap()).unwrap();
    set.record(number).unwrap()
}

/// The operations that results need, without inputs and constants.
fn operations(recording: &Recording) -> Vec<Op> {
    let mut live = vec![false; recording.ops.len()];
    recording.outputs.iter().for_each(|output| live[output.node as usize] = true);
    let ops: Vec<Op> = recording.ops.iter().map(|raw| Op::decode(*raw).unwrap()).collect();
    for (k, op) in ops.iter().enumerate().rev() {
        if live[k] {
            op.operands().for_each(|operand| live[operand as usize] = true);
        }
    }
    ops.into_iter().zip(live).filter(|(op, live)| *live && !matches!(op, Op::Constant(_))).map(|(op, _)| op).collect()
}

fn some(input: Input, random: &[f64]) -> f64 {
    match input {
        Input::Position { frame, component } => random[(3 * frame + component) as usize],
        _ => 0.0,
    }
}

#[test]
fn an_instance_has_the_equations_of_the_same_element_in_rust_bit_for_bit() {
    let rust = adapt::joint::<Rod>();
    let file = classes(ROD).unwrap().remove(0);
    assert_eq!(file.descriptor().rows, rust.descriptor().rows);
    for length in ["0.3", "1", "1e-3"] {
        let params = format!("length = {length}");
        let (own, other) = (recording(&file, &params), recording(&*rust, &params));
        // Rust writes all inputs down before its equations.
        let codes = |recording: &Recording| {
            let mut codes: Vec<u32> = operations(recording).iter().map(|op| op.encode().code).collect();
            codes.sort_unstable();
            codes
        };
        assert_eq!(codes(&own), codes(&other));
        let mut random = Random(7);
        for _ in 0..100 {
            let numbers: Vec<f64> = (0..6).map(|_| random.between(-2.0, 2.0)).collect();
            let value = |recording: &Recording| recording.evaluate(|input| some(input, &numbers))[0].1;
            assert_eq!(value(&own).to_bits(), value(&other).to_bits());
        }
    }
}

#[test]
fn what_depends_on_parameters_only_is_decided_once() {
    let text =
        ROD.replace("residual 0 = v18", "v19 = sub v14 1\nv20 = select v19 0 v13 v18\nv21 = neg v20\nresidual 0 = v21");
    let class = classes(&text).unwrap().remove(0);
    let count = |length: &str| operations(&recording(&class, &format!("length = {length}"))).len();
    // Six inputs, eight operations as far as v13, two more for v18, one sign.
    assert_eq!(count("0.5"), 6 + 8 + 1);
    assert_eq!(count("2"), 6 + 8 + 2 + 1);
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let cases = [
        ("odyn-element = 1", "odyn-element = 2", "line 1, is no file of elements that can be used: its format is 2"),
        (
            "contract = \"1.2.0\"",
            "contract = \"1.99.0\"",
            "line 2, is no file of elements that can be used: it is written for version 1.99.0",
        ),
        ("conventions = 1", "conventions = 7", "line 3,"),
        ("package = \"rod\"", "package = \"../rod\"", "line 4,"),
        ("version = \"0.1.0\"", "version = \"new\"", "line 5,"),
        ("name = \"rod\"", "name = \"Rod\"", "can't be the name of an element"),
        ("kind = \"joint\"", "kind = \"force\"", "has rows, but is no joint"),
        ("kind = \"number\"", "kind = \"text\"", "the parameter `length` is a text"),
        ("kind = \"number\"", "kind = \"number\"\ndefault = -1.0", "`length` must be > 0"),
        (
            "kind = \"number\"",
            "kind = \"number\"\nexample = true",
            "the example true of the parameter `length` must be a number",
        ),
        ("name = \"length\"", "name = \"A b\"", "`A b` can't be the name of a parameter"),
        ("name = \"length\"", "name = \"use\"", "`use` can't be the name of a parameter"),
        (
            "v2 = sub v0 v1",
            "v2 = sub v0 v2",
            "line 25, is no file of elements that can be used: element `rod`: `v2` is no value that comes before",
        ),
        ("v2 = sub v0 v1", "v3 = sub v0 v1", "expected `v2`, found `v3`"),
        ("v2 = sub v0 v1", "v2 = sub v0", "an operand is missing"),
        ("v2 = sub v0 v1", "v2 = sub v0 v1 v1", "one word too many"),
        ("v2 = sub v0 v1", "v2 = sub v0 inf", "neither a value nor a number"),
        ("v2 = sub v0 v1", "v2 = fma v0 v1 v1", "`fma` is no operation"),
        ("v2 = sub v0 v1", "v2 = powf v0 v1", "must depend on parameters only"),
        ("v2 = sub v0 v1", "v2 = table 0 v1", "there is no table 0; there are 0"),
        (
            "position 1 2",
            "position 2 2",
            "line 29, is no file of elements that can be used: element `rod`: there is no frame 2; there are 2",
        ),
        ("position 1 2", "rotation 1 2 3", "there is no column 3"),
        ("param length", "param width", "there is no parameter `width`"),
        ("residual 0 = v18", "residual 1 = v18", "there is no residual 1; there are 1"),
        ("residual 0 = v18", "", "the row `distance` is not given"),
        ("residual 0 = v18", "residual 0 = v18\nresidual 0 = v17", "Residual(0) is given twice"),
        ("residual 0 = v18", "residual 0 = v18\nunilateral 0 = v13", "`unilateral 0` must depend on parameters only"),
        ("residual 0 = v18", "residual 0 = v18\nwork = v13", "neither a value nor a result"),
        ("residual 0 = v18", "residual 0 = v18\nstart 0 = 1", "there is no state 0"),
        ("residual 0 = v18", "residual 0 = v18\nv19 = memory 0", "takes or gives memory beyond the 0 numbers"),
        ("version = \"0.1.0\"", "version = \"0.1.0\"\nauthor = \"x\"", "unknown field `author`"),
    ];
    for (from, to, expected) in cases {
        assert!(ROD.contains(from), "{from}");
        let found = classes(&ROD.replacen(from, to, 1)).map(|_| ()).unwrap_err();
        assert!(found.contains(expected), "{to}: {found}");
    }
}

#[test]
fn what_only_an_instance_shows_is_said_of_it() {
    let text = ROD.replace("residual 0 = v18", "v19 = velocity 0 0\nresidual 0 = v19");
    let mut set = classes(&text).unwrap().remove(0).new_set();
    let number = set.add(&"length = 1.0".parse().unwrap()).unwrap();
    assert!(set.record(number).unwrap_err().message.contains("row 0 depends on velocities"));
}

#[test]
fn what_somebody_changed_breaks_nothing() {
    let mut random = Random(3);
    let mut below = |bound: usize| (random.between(0.0, bound as f64) as usize).min(bound - 1);
    let bytes = ROD.as_bytes();
    let words =
        ["v0", "v999999999999", "=", "1e999", "powi", "'''", "[", "\n", "-", "param", "\u{0}", "table", "select"];
    for _ in 0..4000 {
        let mut changed = bytes.to_vec();
        for _ in 0..=below(3) {
            match below(4) {
                0 => changed.truncate(below(changed.len().max(1))),
                1 if !changed.is_empty() => {
                    let at = below(changed.len());
                    changed[at] = below(256) as u8;
                }
                2 => {
                    let at = below(changed.len() + 1);
                    let word = words[below(words.len())].bytes();
                    changed.splice(at..at, word);
                }
                _ => {
                    let text = String::from_utf8_lossy(&changed).into_owned();
                    let mut lines: Vec<&str> = text.lines().collect();
                    if lines.len() > 1 {
                        let (a, b) = (below(lines.len()), below(lines.len()));
                        lines.swap(a, b);
                    }
                    changed = lines.join("\n").into_bytes();
                }
            }
        }
        if let Ok((_, classes)) = read(Path::new("x.odyn-element"), &changed) {
            for class in classes {
                let mut set = class.new_set();
                if let Ok(number) = set.add(&"length = 0.5".parse().unwrap()) {
                    let _ = set.record(number);
                }
            }
        }
    }
}
