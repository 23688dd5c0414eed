//! Elements that are called at run time are called often: after their first call, none of ours allocates.

use element_api::documentation::scenes_of;
use element_api::manifest::Library;
use element_api::set::{Batch, Layout, Wanted};
use element_api::testkit::{Random, Setting};
use element_api::{Kind, Reaction, Vec3};
use odyn::catalog::Catalog;
use odyn::diagnostics::Source;
use odyn::model::Instance;
use odyn::scene::parse;
use odyn::session::{RunOptions, Session};

/// All libraries, linked into this program, where its allocations can be counted.
fn libraries() -> [Library; 4] {
    [odyn_joints::library(), odyn_forces::library(), odyn_controls::library(), odyn_compressor::library()]
}

/// The example on the manual page, made of linked elements.
fn example(page: &str) -> Session {
    let mut catalog = Catalog::new();
    for library in libraries() {
        catalog.add_library(library).unwrap();
    }
    let source = Source::new("example.toml", scenes_of(page).remove(0));
    let (scene, _) = parse(source, &[]).unwrap_or_else(|rejected| panic!("{:#?}", rejected.diagnostics));
    let options = RunOptions::default();
    Session::with_catalog(scene, Vec::new(), &catalog, &options).unwrap_or_else(|error| panic!("{error}"))
}

/// Numbers for one call: frames anywhere, nothing else.
fn inputs(element: &Instance) -> (Vec<f64>, usize) {
    let class = &element.class;
    let mut random = Random::new(1);
    let mut setting = Setting::at_rest(class.frames.iter().map(|_| random.frame()).collect());
    setting.twists = class.frames.iter().map(|_| random.twist()).collect();
    setting.references = vec![0.0; class.angles];
    setting.states = element.recording.initial_states.clone();
    setting.memory = element.recording.initial_discrete.clone();
    setting.signals = vec![0.5; class.inputs.len()];
    setting.reactions = vec![Reaction { force: Vec3::zeros(), torque: Vec3::zeros() }; class.joints.len()];
    let layout = Layout {
        frames: class.frames.len(),
        angles: class.angles,
        states: setting.states.len(),
        memory: setting.memory.len(),
        signals: class.inputs.len(),
        joints: class.joints.len(),
        values: element.value_count(),
    };
    let results = if class.kind == Kind::Joint { layout.joint_results() } else { layout.force_results() };
    (setting.inputs(), results)
}

#[test]
fn calls_after_the_first_one_allocate_nothing() {
    let mut called = 0;
    for class in libraries().iter().flat_map(|library| &library.classes) {
        let session = example(&class.descriptor().doc);
        let element = session.model.elements.iter().find(|e| e.class.name == class.descriptor().name).unwrap();
        // What has internal unknowns or brings mass is recorded, never called while a scene runs.
        if element.recording.unknowns() > 0 || element.brings_kinetic() {
            continue;
        }
        let (numbers, results) = inputs(element);
        let mut found = vec![0.0; results];
        let wanted = Wanted { jacobian: true, second: true };
        let batch = Batch { instances: &[element.index], inputs: &numbers, wanted };
        let set = &session.model.sets[element.set];
        let mut call = || set.evaluate(&batch, &mut found).unwrap_or_else(|fault| panic!("{fault}"));
        call();
        let count = allocation_counter::measure(call).count_total;
        assert_eq!(count, 0, "{} allocates in every call", class.descriptor().name);
        called += 1;
    }
    assert!(called >= 52, "{called} elements");
}

#[test]
fn allocations_are_counted() {
    let count = allocation_counter::measure(|| drop(std::hint::black_box(vec![1.0; 10]))).count_total;
    assert_eq!(count, 1);
}
