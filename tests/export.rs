//! Scenes exported as C: the bits of the interpreter in rates, steps, projection and outputs; the results of runs to the order of
//! the method; what is refused.

mod derivatives;
mod exchange;
mod fmus;
mod harness;
mod jumps;
mod parameters;
mod refused;
mod sampled;
mod stiff;
mod variable;
mod wine;

use std::path::Path;

use odyn::analysis::{Folding, Formulation as _};
use odyn::export::c::{Real, package};
use odyn::export::{Choices, METHODS, Machine, Method, Twin};
use odyn::model::Quantity;
use odyn::session::{RunReport, Session};

use crate::random::checks::{Checks, SHORT};
use crate::random::mechanism::{Mechanism, Place, Style};
use crate::support::{Scratch, column, open};
use harness::Program;

pub fn machine(session: Session, step: Option<f64>, method: &str) -> Machine {
    let method = Method::named(method).unwrap();
    Machine::new(session, "the scene", Choices { step, method, ..Choices::default() })
        .unwrap_or_else(|error| panic!("{error}"))
}

/// A pendulum with a motor that takes a signal from outside, and a spring that counts turns.
const PENDULUM: &str = r#"
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, -9.81, 0]
t_end = 2
output_step = 0.5
[[input]]
name = "torque"
value = "0.3 N m"
[[body]]
name = "bob"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [1, 0, 0]
com = [0.1, 0, 0]
[[body]]
name = "second"
mass = 1
inertia = [0.02, 0.05, 0.04]
position = [2, 0, 0]
[[joint]]
name = "pivot"
type = "revolute"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "ball"
type = "spherical"
bodies = ["bob", "second"]
point = [1.5, 0, 0]
[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "bob"]
point = [0, 0, 0]
axis = [0, 0, 1]
inputs = { signal = "torque" }
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "second"]
points = [[2, 1, 0], [2.1, 0, 0.1]]
params = { stiffness = 40, damping = 0.5, free_length = 0.8 }
[[output]]
name = "angle"
quantity = "coordinate"
of = "pivot"
[[output]]
name = "reaction_x"
quantity = "reaction_force"
of = "pivot"
on = "bob"
component = "x"
[[output]]
name = "x"
quantity = "position"
of = "second"
component = "x"
[[output]]
name = "a"
quantity = "acceleration"
of = "second"
component = "y"
"#;

fn of_text(text: &str) -> Session {
    Checks::new().session(text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// What of two programs differs first, in words.
fn same(what: &str, c: &[f64], twin: &[f64]) {
    assert_eq!(c.len(), twin.len(), "{what}");
    for (k, (a, b)) in c.iter().zip(twin).enumerate() {
        assert!(
            a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
            "{what} {k}: {a:e} in C, {b:e} by the interpreter"
        );
    }
}

/// Numbers between -1 and 1 (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Builds a machine as C and compares all that it does with the interpreter.
fn compare(machine: &Machine, folder: &Path, steps: usize) {
    let Some(mut program) = Program::build(machine, Real::Double, folder, &["-O2"]) else { return };
    let mut twin = Twin::new(machine.clone());
    let mut random = Random(88_172_645_463_325_252);
    same("outputs", &program.outputs(), twin.outputs());
    let ranges: Vec<[f64; 2]> = machine.parameters.settable.iter().map(|parameter| parameter.range).collect();
    if !ranges.is_empty() {
        for share in [0.31, 1.1, 0.83] {
            let values: Vec<f64> = ranges.iter().map(|[low, high]| low + share * (high - low)).collect();
            let failed = twin.set_parameters(&values).err();
            assert_eq!(program.set_parameters(&values), failed.map_or(0, |failed| failed as i32));
            assert_eq!(failed.is_some(), share > 1.0);
        }
    }
    for number in 0..steps {
        if number % 3 == 1 {
            for input in 0..machine.inputs.len() {
                let value = machine.inputs[input].start + random.next();
                twin.set_input(input, value);
                program.set_input(input, value);
            }
        }
        let failed = twin.step(machine.step).err();
        let (status, numbers) = program.step(machine.step);
        assert_eq!(status, failed.map_or(0, |failed| failed as i32), "status of step {number}");
        same("time and state", &numbers, &[&[twin.time()], twin.state()].concat());
        if failed.is_some() {
            break;
        }
        same("outputs", &program.outputs(), twin.outputs());
    }
    let state = twin.state().to_vec();
    for size in [0.0, 1e-9, 1e-6, 1e-3] {
        let mut moved: Vec<f64> = state.iter().map(|x| x + size * random.next() * (1.0 + x.abs())).collect();
        let mut rates = vec![0.0; state.len()];
        let failed = twin.rates(twin.time(), &moved, &mut rates).err();
        let (status, found) = program.rates(&moved);
        assert_eq!(status, failed.map_or(0, |failed| failed as i32), "status of rates");
        if failed.is_none() {
            same("rates", &found, &rates);
        }
        let before = moved.clone();
        let failed = twin.project(twin.time(), &mut moved).err();
        let (status, found) = program.project(&before);
        assert_eq!(status, failed.map_or(0, |failed| failed as i32), "status of projection");
        if failed.is_none() {
            same("projection", &found, &moved);
        }
    }
    if machine.derivatives {
        let seed: Vec<f64> = (0..machine.seeds()).map(|_| random.next()).collect();
        let slopes = twin.derivatives(&seed).unwrap();
        let expected = [slopes.rates, slopes.outputs, slopes.switches].concat();
        same("derivatives", &program.derivatives(&seed), &expected);
    }
}

#[test]
fn programs_in_c_have_the_bits_of_the_interpreter() {
    let folder = Scratch::new();
    let scenes = [
        ("compressor.toml", 40),
        ("compressor-speed-control.toml", 40),
        ("benchmarks/A02_N2.toml", 20),
        ("benchmarks/A03.toml", 20),
        ("benchmarks/A04.toml", 20),
        ("benchmarks/A05.toml", 20),
        ("benchmarks/chain_N10.toml", 10),
        ("verification/bump-stop.toml", 200),
        ("verification/cam-points.toml", 20),
        ("verification/signal-source.toml", 100),
        ("verification/map.toml", 50),
        ("stress/tables.toml", 50),
    ];
    // A stiff scene: far angles are refused by the program, and computed by the interpreter.
    let sets = |scene: &str| if scene.ends_with("A05.toml") { vec!["simulation.fixed_step=1e-5"] } else { Vec::new() };
    for (number, (scene, steps)) in scenes.into_iter().enumerate() {
        let method = METHODS[number % METHODS.len()].name;
        println!("{scene} by {method}");
        let machine = machine(open(scene, &sets(scene)), None, method);
        // Every other one with derivatives.
        let machine = if number % 2 == 0 { machine } else { machine.with_derivatives().unwrap() };
        compare(&machine, folder.path(), steps);
    }
    // Nothing moves, so that no rate follows a state.
    compare(&machine(open("verification/beam.toml", &[]), None, "rodas"), folder.path(), 3);
    for method in ["rk4", "rodas"] {
        let machine = machine(of_text(PENDULUM), Some(1e-3), method).with_derivatives().unwrap();
        compare(&machine, folder.path(), 40);
    }
}

/// A random mechanism as it is exported; `None`, and why, where it cannot be.
fn of_mechanism(checks: &Checks, mechanism: &Mechanism) -> Option<Machine> {
    let settled = checks.settled(mechanism).ok()??;
    let session = checks.session(&settled.text(&Place::as_it_is(), SHORT), &[]).ok()?;
    // Euler parameters are not known in coordinates of joints.
    let channels = session.model.channels.iter();
    let known = channels.filter(|channel| !matches!(channel.quantity, Quantity::EulerParameter { .. }));
    let outputs = Some(known.map(|channel| channel.name.clone()).collect());
    let made = Machine::new(session, "random", Choices { outputs, ..Choices::default() });
    made.map_err(|error| println!("{}", error.diagnostics[0].message)).ok()
}

#[test]
fn random_mechanisms_have_the_bits_of_the_interpreter() {
    let (checks, folder) = (Checks::new(), Scratch::new());
    let mut exported = 0;
    for seed in 1..=5 {
        let style = [Style::Spatial, Style::Planar][seed as usize % 2];
        for mechanism in [Mechanism::new(seed, style), Mechanism::furnished(seed, style)] {
            let Some(machine) = of_mechanism(&checks, &mechanism) else { continue };
            println!("{style:?} {seed}: {} states", machine.dim());
            let machine = machine.with_derivatives().unwrap();
            compare(&machine, folder.path(), 5);
            exported += 1;
        }
    }
    assert!(exported >= 5, "{exported} of 10 mechanisms can be exported");
}

/// The rates are those that a run integrates.
#[test]
fn rates_are_those_of_runs() {
    for scene in ["compressor.toml", "benchmarks/A04.toml", "benchmarks/A05.toml"] {
        let machine = machine(open(scene, &[]), None, "rk4");
        let mut session = open(scene, &[]);
        let mut form = session.joint_form(Folding::WherePossible).unwrap().unwrap();
        form.set_discrete(&session.assembly.references, &session.assembly.discrete);
        let (state, mut expected) = (machine.state.clone(), vec![0.0; machine.dim()]);
        form.rates(machine.t_start, &state, &mut expected).unwrap();
        let mut found = vec![0.0; machine.dim()];
        Twin::new(machine.clone()).rates(machine.t_start, &state, &mut found).unwrap();
        same(scene, &found, &expected);
    }
}

/// The last outputs of a run with tiny errors.
fn exact(session: Session, machine: &Machine) -> Vec<f64> {
    let report: RunReport = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    assert_eq!(report.exit_code(), 0, "{}", report.summary.reason);
    machine.outputs.iter().map(|port| *column(&report, &port.name).last().unwrap()).collect()
}

/// The outputs at the end in so many steps.
fn by_steps(machine: &Machine, steps: usize) -> Vec<f64> {
    let mut twin = Twin::new(machine.clone());
    for _ in 0..steps {
        twin.step((machine.t_end - machine.t_start) / steps as f64).unwrap();
    }
    twin.outputs().to_vec()
}

/// Errors fall with the step as the order of the method says.
fn converges(make: &dyn Fn() -> Session, method: &str, steps: usize, least: f64) {
    errors_fall(&machine(make(), None, method), make(), steps, least);
}

fn errors_fall(machine: &Machine, session: Session, steps: usize, least: f64) {
    let exact = exact(session, machine);
    let scale: Vec<f64> = exact.iter().map(|value| value.abs().max(1e-3)).collect();
    let error = |steps: usize| {
        let found = by_steps(machine, steps);
        let off = found.iter().zip(&exact).zip(&scale).map(|((a, b), scale)| (a - b).abs() / scale);
        off.fold(0.0_f64, f64::max)
    };
    let (coarse, fine) = (error(steps), error(2 * steps));
    let order = (coarse / fine).log2();
    println!("{}: {coarse:.1e} in {steps} steps, {fine:.1e} in twice as many: order {order:.1}", machine.method.name);
    assert!(fine < 1e-4, "{fine:e}");
    assert!(order > least, "order {order}");
}

#[test]
fn errors_fall_as_the_order_of_the_method_says() {
    let precise = ["simulation.tolerance=1e-12", "simulation.audit_tolerance=none"];
    let short = |end: &'static str| [&precise[..], &[end]].concat();
    let compressor = || open("compressor.toml", &short("simulation.t_end=40"));
    converges(&compressor, "rk4", 300, 3.5);
    converges(&compressor, "dopri5", 150, 4.5);
    converges(&compressor, "rodas", 300, 3.5);
    let bricard = || open("benchmarks/A04.toml", &short("simulation.t_end=1"));
    converges(&bricard, "rk4", 100, 3.5);
    converges(&bricard, "dopri5", 60, 4.5);
    converges(&bricard, "rodas", 100, 3.5);
    let pendulum = || Checks::new().session(PENDULUM, &["tolerance=1e-12"]).unwrap();
    converges(&pendulum, "rk4", 200, 3.5);
    converges(&pendulum, "dopri5", 120, 4.5);
    converges(&pendulum, "rodas", 200, 3.5);
}

/// Where equations switch, steps end, so that the order is kept.
#[test]
fn steps_end_where_equations_switch() {
    let make = || open("verification/bump-stop.toml", &["simulation.tolerance=1e-12"]);
    let machine = machine(make(), None, "rk4");
    assert!(machine.switches.is_some());
    let mut twin = Twin::new(machine.clone());
    for _ in 0..1000 {
        twin.step((machine.t_end - machine.t_start) / 1000.0).unwrap();
    }
    assert!(twin.located > 0, "no switch was located");
    assert_eq!(twin.passed, 0);
    // A stop whose force grows with a power of 1.5 is not smooth enough for the order: its channels are left out.
    let outputs = Some(["x", "v", "phi"].map(String::from).to_vec());
    let method = Method::named("rk4").unwrap();
    let machine = Machine::new(make(), "stops", Choices { method, outputs, ..Choices::default() }).unwrap();
    errors_fall(&machine, make(), 400, 3.3);
}

#[test]
fn costs_are_counted_and_the_memory_is_what_is_told() {
    let folder = Scratch::new();
    for (method, real) in [("rk4", Real::Double), ("rk4", Real::Float), ("rodas", Real::Double), ("rodas", Real::Float)]
    {
        let machine = machine(open("compressor.toml", &[]), None, method);
        let cost = package(&machine, real).unwrap().cost;
        assert!(cost.step > 1000 && cost.most == cost.step, "{cost:?}");
        let Some(mut program) = Program::build(&machine, real, folder.path(), &["-O2", "-fstack-usage"]) else {
            return;
        };
        assert_eq!(program.memory(), cost.memory);
        let used = harness::stack_used(folder.path(), &machine.name);
        assert!(used <= cost.stack, "{used} bytes on the stack, {} told", cost.stack);
    }
    for real in [Real::Double, Real::Float] {
        for machine in
            [machine(of_text(sampled::HELD), Some(7e-3), "rk4"), variable::of(of_text(sampled::HELD), Some(0.05), 1e-6)]
        {
            let Some(mut program) = Program::build(&machine, real, folder.path(), &["-O2"]) else { return };
            assert_eq!(program.memory(), package(&machine, real).unwrap().cost.memory);
        }
    }
}

/// In numbers of 32 bits the same motion comes out, to what these can hold.
#[test]
fn numbers_of_32_bits_give_the_same_motion() {
    let folder = Scratch::new();
    for (scene, machine) in [
        ("compressor.toml", machine(open("compressor.toml", &[]), None, "rk4")),
        ("benchmarks/A04.toml", machine(open("benchmarks/A04.toml", &[]), None, "rk4")),
        ("a pendulum that is held", machine(of_text(sampled::HELD), Some(1e-3), "rk4")),
        ("the same by steps of variable size", variable::of(of_text(sampled::HELD), Some(1e-3), 1e-4)),
    ] {
        let Some(mut program) = Program::build(&machine, Real::Float, folder.path(), &["-O2"]) else { return };
        let mut twin = Twin::new(machine.clone());
        for _ in 0..50 {
            twin.step(machine.step).unwrap();
            assert_eq!(program.step(machine.step).0, 0, "{scene}");
        }
        for ((found, exact), port) in program.outputs().iter().zip(twin.outputs()).zip(&machine.outputs) {
            assert!(
                (found - exact).abs() < 2e-3 * exact.abs().max(0.1),
                "{scene} {}: {found} instead of {exact}",
                port.name
            );
        }
    }
}

/// Sanitizers and another compiler have nothing to say, and the bits are the same.
#[test]
fn other_compilers_and_sanitizers_agree() {
    let folder = Scratch::new();
    let ways: [(&str, &[&str]); 4] = [
        ("cc", &["-O1", "-fsanitize=undefined,address", "-fno-sanitize-recover=all"]),
        ("cc", &["-O3", "-march=native"]),
        ("clang", &["-O2"]),
        ("clang", &["-O3", "-march=native"]),
    ];
    for machine in [
        machine(open("compressor.toml", &[]), None, "rodas").with_derivatives().unwrap(),
        variable::of(of_text(sampled::HELD), Some(0.05), 1e-6),
    ] {
        let mut twin = Twin::new(machine.clone());
        for _ in 0..10 {
            twin.step(machine.step).unwrap();
        }
        for (compiler, flags) in ways {
            let found = Program::by(compiler, &machine, Real::Double, folder.path(), flags);
            let Some(mut program) = found else { continue };
            let mut last = Vec::new();
            for _ in 0..10 {
                let (status, numbers) = program.step(machine.step);
                assert_eq!(status, 0);
                last = numbers;
            }
            same(compiler, &last[1..], twin.state());
        }
    }
}

/// On a Cortex-M without floating-point unit, emulated, the digits are those of the interpreter.
#[test]
fn a_microcontroller_computes_the_same_digits() {
    let folder = Scratch::new();
    for machine in [
        machine(open("benchmarks/A04.toml", &[]), None, "rk4"),
        machine(open("benchmarks/A04.toml", &[]), None, "rodas"),
        machine(of_text(sampled::HELD), Some(7e-3), "rk4"),
        variable::of(of_text(sampled::HELD), Some(7e-3), 1e-6),
    ] {
        let library = package(&machine, Real::Double).unwrap().cost.library;
        let Some(text) = harness::on_cortex_m(&machine, folder.path(), 20) else { return };
        let mut twin = Twin::new(machine.clone());
        for _ in 0..20 {
            twin.step(machine.step).unwrap();
        }
        let found: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
        println!("{}, library: {library:?}", machine.method.name);
        same("state on a Cortex-M", &found, twin.state());
    }
}
