//! Kernels: what an evaluation, a run and the parts around them cost. `cargo bench`; words after `--` choose by
//! name. Figures drift on a shared machine: compare rows of one run.
//!
//! | group | what is measured |
//! |---|---|
//! | `right_side` | one evaluation of the equations of motion of a scene: the paper's form, interpreted, machine code |
//! | `programs` | everything that the equations of a scene contain, interpreted and as machine code |
//! | `runs` | a whole run of an opened scene: programs, start, integration with samples, audit |
//! | `limits` | the same mechanisms by hand: an evaluation, a run at the same tolerance |
//! | `plugin` | the right side with elements from a library that was loaded, and from the same crate linked in |
//! | `start` | opening a scene: reading, libraries, resolving, equations, assembly |

#[path = "../limit/mod.rs"]
mod limit;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use divan::Bencher;
use divan::counter::ItemsCount;
use element_api::manifest::Library;
use odyn::analysis::{Formulation, start_inputs};
use odyn::catalog::Catalog;
use odyn::program::{MachineCode, Maker, Node, Program};
use odyn::scene::{Override, read};
use odyn::session::{RunOptions, Session};

const SCENES: [&str; 6] = ["A01", "A02_N2", "A03", "A04", "A05", "compressor"];

fn main() {
    divan::main();
}

fn path(scene: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a member of the workspace");
    root.join("scenes/benchmarks").join(format!("{scene}.toml"))
}

fn options(sets: &[&str]) -> RunOptions {
    let copies = Path::new(env!("CARGO_TARGET_TMPDIR")).join("library-copies");
    RunOptions {
        overrides: sets.iter().map(|text| Override::new(*text)).collect(),
        library_copies: Some(copies),
        ..RunOptions::default()
    }
}

fn open(scene: &str) -> Session {
    Session::open(&path(scene), &options(&[])).unwrap_or_else(|error| panic!("{error}"))
}

/// The equations of motion of a scene at its start.
struct RightSide {
    formulation: Box<dyn Formulation>,
    state: Vec<f64>,
    rates: Vec<f64>,
    t: f64,
}

impl RightSide {
    fn new(mut session: Session, engine: &str) -> Self {
        let mut formulation = session.formulation(engine).unwrap_or_else(|error| panic!("{error}"));
        formulation.set_discrete(&session.assembly.references, &session.assembly.discrete);
        let mut state = vec![0.0; formulation.groups().len()];
        formulation.state_of(&session.assembly.working, &mut state);
        let t = session.scene.simulation.t_start;
        formulation.next_step(t, &state).expect("a scene that can start");
        Self { formulation, rates: vec![0.0; state.len()], state, t }
    }

    fn compiled(session: Session) -> Self {
        let mut right_side = Self::new(session, "compiled");
        for used in right_side.formulation.programs() {
            let code =
                MachineCode::compile(used.program, Maker::here(), &AtomicBool::new(false)).expect("machine code");
            used.program.install(Arc::new(code));
        }
        right_side
    }

    /// An evaluation a little later than the last one, so that nothing of that one can be used again.
    fn evaluate(&mut self) -> f64 {
        self.t += 1e-12;
        self.formulation.rates(self.t, &self.state, &mut self.rates).expect("regular equations");
        self.rates[0]
    }

    fn bench(mut self, bencher: Bencher<'_, '_>) {
        bencher.bench_local(|| self.evaluate());
    }
}

mod right_side {
    use super::{Bencher, RightSide, SCENES, open};

    #[divan::bench(args = SCENES)]
    fn reference(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::new(open(scene), "reference").bench(bencher);
    }

    #[divan::bench(args = SCENES)]
    fn interpreted(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::new(open(scene), "interpreted").bench(bencher);
    }

    #[divan::bench(args = SCENES)]
    fn compiled(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::compiled(open(scene)).bench(bencher);
    }
}

/// The program of all that the equations contain, and inputs near the start.
fn program(scene: &str) -> (Program, Vec<f64>) {
    let session = open(scene);
    let equations = &session.equations;
    let mut nodes: Vec<Node> = equations.loads.clone();
    nodes.extend([equations.power, equations.kinetic, equations.potential]);
    for row in equations.rows.iter() {
        nodes.extend([row.value, row.time, row.gamma]);
        nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
    }
    let inputs = start_inputs(&session.plan.layout, session.scene.simulation.t_start, &session.assembly);
    (Program::compile(&equations.graph, &nodes), inputs)
}

mod programs {
    use super::{Arc, AtomicBool, Bencher, ItemsCount, MachineCode, Maker, Program, SCENES, program};

    fn alone(bencher: Bencher<'_, '_>, program: &Program, inputs: &[f64]) {
        let (mut workspace, mut outputs) = (program.workspace(), vec![0.0; program.output_count()]);
        bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
            program.run(inputs, &[], &mut workspace, &mut outputs).expect("no opaque elements");
            outputs[0]
        });
    }

    #[divan::bench(args = SCENES)]
    fn interpreted(bencher: Bencher<'_, '_>, scene: &str) {
        let (program, inputs) = program(scene);
        alone(bencher, &program, &inputs);
    }

    #[divan::bench(args = SCENES)]
    fn machine_code(bencher: Bencher<'_, '_>, scene: &str) {
        let (mut program, inputs) = program(scene);
        let code = MachineCode::compile(&program, Maker::here(), &AtomicBool::new(false)).expect("machine code");
        program.install(Arc::new(code));
        alone(bencher, &program, &inputs);
    }
}

mod runs {
    use super::{Bencher, Session, options, path};

    #[divan::bench(args = ["A01", "A02_N2", "A03", "A04", "compressor"], sample_count = 10, sample_size = 1)]
    fn dop853(bencher: Bencher<'_, '_>, scene: &str) {
        let options = options(&["simulation.tolerance=1e-8"]);
        let path = path(scene);
        let open = || Session::open(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        bencher.with_inputs(open).bench_local_values(|session| {
            session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"))
        });
    }
}

mod limits {
    use super::{Bencher, limit};

    const PROBLEMS: [&str; 4] = ["A01", "A02_N2", "A03", "compressor"];

    fn mechanism(problem: &str) -> limit::Mechanism {
        limit::mechanisms().into_iter().find(|own| own.problem == problem).expect("a mechanism of this name")
    }

    #[divan::bench(args = PROBLEMS)]
    fn right_side(bencher: Bencher<'_, '_>, problem: &str) {
        let mechanism = mechanism(problem);
        let [q, rate] = mechanism.start.map(divan::black_box);
        bencher.bench_local(|| (mechanism.acceleration)(divan::black_box(q), rate));
    }

    #[divan::bench(args = PROBLEMS, sample_count = 20)]
    fn dop853(bencher: Bencher<'_, '_>, problem: &str) {
        let mechanism = mechanism(problem);
        let reference = mechanism.reference();
        bencher.bench_local(|| mechanism.run(1e-8, &reference).error);
    }
}

mod plugin {
    use super::{Bencher, Catalog, Library, RightSide, RunOptions, Session, open, options, path, read};

    const SCENES: [&str; 2] = ["A04", "A05"];

    /// The session of a scene whose elements are linked into this program.
    fn linked(scene: &str) -> Session {
        let mut catalog = Catalog::new();
        let libraries: [fn() -> Library; 2] = [odyn_joints::library, odyn_forces::library];
        for library in libraries {
            catalog.add_library(library()).unwrap_or_else(|error| panic!("{error}"));
        }
        let (scene, warnings) =
            read(&path(scene), &options(&[]).overrides).unwrap_or_else(|_| panic!("a readable scene"));
        Session::with_catalog(scene, warnings, &catalog, &RunOptions::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    #[divan::bench(args = SCENES)]
    fn loaded_interpreted(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::new(open(scene), "interpreted").bench(bencher);
    }

    #[divan::bench(args = SCENES)]
    fn linked_interpreted(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::new(linked(scene), "interpreted").bench(bencher);
    }

    #[divan::bench(args = SCENES)]
    fn loaded_compiled(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::compiled(open(scene)).bench(bencher);
    }

    #[divan::bench(args = SCENES)]
    fn linked_compiled(bencher: Bencher<'_, '_>, scene: &str) {
        RightSide::compiled(linked(scene)).bench(bencher);
    }
}

mod start {
    use super::{Bencher, open};

    #[divan::bench(args = ["A04", "compressor"], sample_count = 20, sample_size = 1)]
    fn opened(bencher: Bencher<'_, '_>, scene: &str) {
        bencher.bench_local(|| open(scene));
    }
}
