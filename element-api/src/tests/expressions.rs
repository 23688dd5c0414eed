//! [`Function`]: every operation against plain arithmetic, its derivatives, tables, texts, refusals.

use crate::params::{ParamType, Table as Params};
use crate::recorded::{Recorded, input, record};
use crate::recording::{Input, Role};
use crate::testkit::{Random, Setting, interpret};
use crate::{Function, Interpolation, Jet, Outside, ParamError, Table};

type Plain = fn(f64) -> f64;

/// Operations, and the same in plain arithmetic, for x in (0, 1).
const EXPRESSIONS: &[(&str, Plain)] = &[
    ("[2.5]", |_| 2.5),
    ("['x']", |x| x),
    ("['x', 2, 'add']", |x| x + 2.0),
    ("[2, 'x', 'sub']", |x| 2.0 - x),
    ("['x', 'x', 'mul']", |x| x * x),
    ("[1, 'x', 'div']", |x| 1.0 / x),
    ("['x', 'neg']", |x| -x),
    ("['x', 'sqrt']", f64::sqrt),
    ("['x', 'sin']", f64::sin),
    ("['x', 'cos']", f64::cos),
    ("['x', 'tan']", f64::tan),
    ("['x', 'asin']", f64::asin),
    ("['x', 'acos']", f64::acos),
    ("['x', 'atan']", f64::atan),
    ("['x', 'neg', 'asin']", |x| (-x).asin()),
    ("['x', 'neg', 'acos']", |x| (-x).acos()),
    ("['x', 'neg', 'atan']", |x| (-x).atan()),
    ("['x', 'exp']", f64::exp),
    ("['x', 'ln']", f64::ln),
    ("['x', 'tanh']", f64::tanh),
    ("['x', 0.5, 'sub', 'abs']", |x| (x - 0.5).abs()),
    ("['x', -1, 'atan2']", |x| x.atan2(-1.0)),
    ("['x', 0.5, 'min']", |x| x.min(0.5)),
    ("['x', 0.5, 'max']", |x| x.max(0.5)),
    ("['x', 3, 'pow']", |x| x.powi(3)),
    ("['x', -2, 'pow']", |x| x.powi(-2)),
    ("['x', 0, 'pow']", |_| 1.0),
    ("['x', 1.7, 'pow']", |x| x.powf(1.7)),
    ("['x', 1, 2, 'div', 'pow']", f64::sqrt),
    ("['x', 0.5, 'sub', 3, 'pow']", |x| (x - 0.5).powi(3)),
    ("['x', 'x', 'pow']", |x| x.powf(x)),
    ("[2, 'x', 'pow']", |x| 2.0_f64.powf(x)),
    ("[20, 2, 3.141592653589793, 'mul', 'x', 'mul', 'sin', 'mul']", |x| 20.0 * (std::f64::consts::TAU * x).sin()),
    ("[2, 3, 'pow', 4, 'sqrt', 'sub', 1, 'exp', 'ln', 'mul']", |_| 6.0),
];

fn function(text: &str) -> Result<Function, ParamError> {
    let table: Params = format!("f = {text}").parse().expect("TOML");
    Function::read_named(&table["f"], "f")
}

fn expression(words: &str) -> Function {
    function(&format!("{{ postfix = {words} }}")).expect(words)
}

#[test]
fn operations_compute_what_plain_arithmetic_does() {
    let mut random = Random::new(51);
    for (words, plain) in EXPRESSIONS {
        let f = expression(words);
        for _ in 0..20 {
            let x = random.between(0.02, 0.98);
            let error = (f.at(x) - plain(x)).abs();
            assert!(error <= 4e-15 * (1.0 + plain(x).abs()), "{words} at {x}: {} instead of {}", f.at(x), plain(x));
        }
    }
}

#[test]
fn every_word_is_tried() {
    let words = "add sub mul div pow atan2 min max neg sqrt sin cos tan asin acos atan exp ln tanh abs x";
    for word in words.split(' ') {
        let quoted = format!("'{word}'");
        assert!(EXPRESSIONS.iter().any(|(words, _)| words.contains(&quoted)), "{word}");
    }
}

#[test]
fn jets_carry_the_true_derivatives() {
    let mut random = Random::new(52);
    for (words, plain) in EXPRESSIONS {
        let f = expression(words);
        for _ in 0..20 {
            let (x, h) = (random.between(0.1, 0.9), 1e-4);
            // Away from the switch of abs, min and max.
            let x = if (x - 0.5).abs() < 0.01 { 0.6 } else { x };
            let (first, second) =
                ((plain(x + h) - plain(x - h)) / (2.0 * h), (plain(x + h) - 2.0 * plain(x) + plain(x - h)) / (h * h));
            let jet = f.at(Jet::new(x, 1.0, 0.0));
            assert!((jet.first - first).abs() < 1e-4 * (1.0 + first.abs()), "{words} at {x}: {} {first}", jet.first);
            let error = (jet.second - second).abs();
            assert!(error < 1e-4 * (1.0 + second.abs()), "{words} at {x}: second {} {second}", jet.second);
        }
    }
}

#[test]
fn recordings_of_functions_compute_the_same_bits() {
    let functions: Vec<Function> = EXPRESSIONS.iter().map(|(words, _)| expression(words)).collect();
    let recording = record(|| {
        let x = input(Input::Time);
        functions.iter().enumerate().map(|(k, f)| (Role::Channel(k as u32), f.at(x))).collect()
    });
    let mut random = Random::new(53);
    for _ in 0..20 {
        let setting = Setting { time: random.between(0.02, 0.98), ..Setting::at_rest(Vec::new()) };
        for ((_, value), (f, (words, _))) in
            interpret(&recording, &setting, &[]).into_iter().zip(functions.iter().zip(EXPRESSIONS))
        {
            assert_eq!(value.to_bits(), f.at(setting.time).to_bits(), "{words}");
        }
    }
}

#[test]
fn powers_with_constant_whole_exponents_are_exact_at_zero_and_below() {
    let cube = expression("['x', 3, 'pow']").at(Jet::new(0.0, 1.0, 0.0));
    assert_eq!((cube.value, cube.first, cube.second), (0.0, 0.0, 0.0));
    // The exponent may itself be computed from constants.
    let square = expression("['x', 1, 1, 'add', 'pow']").at(Jet::new(-3.0, 1.0, 0.0));
    assert_eq!((square.value, square.first, square.second), (9.0, -6.0, 2.0));
}

#[test]
fn deep_expressions_are_computed_too() {
    // 1 + (1 + (1 + ... x)): the stack grows with the number of ones.
    let ones = "1, ".repeat(100);
    let sums = ", 'add'".repeat(100);
    assert_eq!(expression(&format!("[{ones}'x'{sums}]")).at(0.5), 100.5);
}

#[test]
fn constants_are_recognised() {
    for (text, constant) in [
        ("3", true),
        ("{ postfix = [2, 3, 'mul'] }", true),
        ("{ postfix = ['x', 0, 'mul'] }", false),
        ("[[0, 1], [1, 1]]", false),
    ] {
        assert_eq!(function(text).expect(text).is_constant(), constant, "{text}");
    }
    assert_eq!(Function::from(2.5), Function::constant(2.5));
    let recorded = record(|| vec![(Role::Channel(0), Function::constant(4.0).at(Recorded::from(1.0)))]);
    assert_eq!(recorded.constants, [4.0]);
}

#[test]
fn points_are_joined_and_held_or_repeated() {
    let points = [[0.0, 1.0], [0.5, 2.0], [0.8, -1.0], [1.0, 1.0]];
    let list = "[[0, 1], [0.5, 2], [0.8, -1], [1, 1]]";
    let (clamped, periodic) = (Table::clamped(&points).expect("sound"), Table::periodic(&points).expect("sound"));
    let monotone = Table::through(&points, Interpolation::Monotone, Outside::Clamped).expect("sound");
    for (text, table) in [
        (list.to_owned(), &monotone),
        (format!("{{ points = {list} }}"), &monotone),
        (format!("{{ points = {list}, interpolation = \"spline\" }}"), &clamped),
        (format!("{{ points = {list}, interpolation = \"spline\", periodic = false }}"), &clamped),
        (format!("{{ points = {list}, interpolation = \"spline\", periodic = true }}"), &periodic),
    ] {
        let f = function(&text).expect(&text);
        for k in -10..20 {
            let x = f64::from(k) * 0.13;
            assert_eq!(f.at(x), table.derivative(x, 0), "{text} at {x}");
            assert_eq!(f.at(Jet::new(x, 1.0, 0.0)).first, table.derivative(x, 1), "{text} at {x}");
        }
    }
}

#[test]
fn functions_survive_being_written_and_read() {
    let texts = EXPRESSIONS.iter().map(|(words, _)| format!("{{ postfix = {words} }}")).chain([
        "-1.5".to_owned(),
        "[[0, 1], [0.5, 2], [0.8, -1], [1, 1]]".to_owned(),
        "{ points = [[0, 1], [0.5, 2], [0.8, -1], [1, 1]], periodic = true }".to_owned(),
    ]);
    for text in texts {
        let f = function(&text).expect(&text);
        let again = Function::read_named(&f.write(), "f").expect(&text);
        for k in 1..20 {
            let x = f64::from(k) * 0.05;
            let (value, expected) = (again.at(x), f.at(x));
            assert!((value - expected).abs() <= 1e-14 * (1.0 + expected.abs()), "{text} at {x}: {value} {expected}");
        }
        assert_eq!(again.is_constant(), f.is_constant(), "{text}");
    }
}

#[test]
fn what_is_no_function_is_refused_in_words() {
    let refused = [
        ("true", "must be a number, a list of [argument, value] pairs"),
        ("'sin t'", "must be a number"),
        ("{ curve = [[0, 1], [1, 2]] }", "must be a number"),
        ("{ points = 3 }", "must be a number"),
        ("{ postfix = [] }", "the operations leave 0 results"),
        ("{ postfix = [1, 2] }", "the operations leave 2 results"),
        ("{ postfix = ['add'] }", "\"add\" lacks operands"),
        ("{ postfix = ['x', 'mul'] }", "\"mul\" lacks operands"),
        ("{ postfix = ['sin'] }", "\"sin\" lacks operands"),
        ("{ postfix = ['y'] }", "\"y\" is no operation"),
        ("{ postfix = [true] }", "true is no operation"),
        ("[[0, 1]]", "needs at least 2 points, found 1"),
        ("[[0, 1], [0, 2]]", "0 is followed by 0"),
        ("{ points = [[0, 1], [1, 2], [2, 0], [3, 5]], periodic = true }", "must end where it began"),
    ];
    for (text, words) in refused {
        let error = function(text).expect_err(text);
        assert_eq!(error.path, "f", "{text}");
        assert!(error.message.contains(words), "{text}: {error}");
    }
}
