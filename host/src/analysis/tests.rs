//! temp
use crate::integrate::{Integrator, Dop853, Span, Options};
use crate::model::*;
use crate::plan::{Layout, Plan, Probe};
use crate::program::{Equations, Form};
use super::*;
use nalgebra::{Matrix3, Vector3};
use element_api::{adapt, ElementClass};

#[path = "/work/lab/tmp/revolute.rs"]
mod revolute;

fn joint(model: &mut Model, class: &dyn ElementClass, name: &str, markers: Vec<Marker>) {
    let mut set = class.new_set();
    let index = set.add(&element_api::params::Table::new()).unwrap();
    let recording = set.record(index).unwrap();
    recording.check(&class.descriptor().limits()).unwrap();
    let rows = (0..class.descriptor().rows.len()).collect();
    model.sets.push(set);
    model.elements.push(Instance { name: name.into(), class: class.descriptor().clone(), library: String::new(), set: model.sets.len()-1, index: index as u32, markers, recording, rows });
}

fn four_bar(n: usize) -> Model {
    let mut model = Model { bodies: vec![], elements: vec![], sets: vec![], gravity: Vector3::new(0.,-9.81,0.), channels: vec![] };
    let rod = |name: &str, x: f64, y: f64, vertical: bool| Body {
        name: name.into(), mass: 1.0, inertia: if vertical { Matrix3::from_diagonal(&Vector3::new(1./12., 1e-4, 1./12.)) } else { Matrix3::from_diagonal(&Vector3::new(1e-4,1./12.,1./12.)) },
        center_of_mass: Vector3::zeros(), position: Vector3::new(x,y,0.), orientation: [1.,0.,0.,0.], velocity: [None;3],
        angular_velocity: if vertical {[Some(0.),Some(0.),Some(-1.)]} else {[None;3]} };
    for i in 0..=n { model.bodies.push(rod(&format!("l{i}"), i as f64, 0.5, true)); }
    for i in 0..n { model.bodies.push(rod(&format!("c{i}"), i as f64+0.5, 1.0, false)); }
    let class = adapt::joint::<revolute::Revolute>();
    let mk = |b: Option<usize>, x: f64, y: f64| Marker { body: b, position: Vector3::new(x,y,0.), rotation: Matrix3::identity() };
    for i in 0..=n { joint(&mut model, &*class, &format!("g{i}"), vec![mk(None, i as f64, 0.), mk(Some(i), 0., -0.5)]); }
    for i in 0..n {
        joint(&mut model, &*class, &format!("a{i}"), vec![mk(Some(i), 0., 0.5), mk(Some(n+1+i), -0.5, 0.)]);
        joint(&mut model, &*class, &format!("b{i}"), vec![mk(Some(i+1), 0., 0.5), mk(Some(n+1+i), 0.5, 0.)]);
    }
    model.channels.push(Channel { name: "B0x".into(), quantity: Quantity::Point { body: 0, point: Vector3::new(0.,0.5,0.), level: Level::Position, axes: Axes::Ground, component: 0 }, unit: "m".into(), factor: 1.0, place: String::new() });
    model
}

fn run(n: usize, tol: f64, reference: bool) -> Vec<f64> {
    let mut model = four_bar(n);
    let layout = Layout::new(&model);
    let mut eq = Equations::build(&model, &layout, Form::Working);
    let asm = assemble(&eq, &model, &layout, 0.0).unwrap();
    let all: Vec<usize> = (0..layout.rows).collect();
    let mut c = Constraints::new(&eq, &model, &all, &[|r| r.value], &[]).unwrap();
    let mut inputs = vec![0.0; layout.inputs()];
    for b in 0..layout.bodies { let s = layout.body_slot(b,0); inputs[s..s+13].copy_from_slice(&asm.working[13*b..13*b+13]); }
    c.evaluate(&inputs, &model.sets).unwrap();
    let rotations: Vec<Matrix3<f64>> = (0..layout.bodies).map(|b| { let y=&asm.working[13*b..]; rotation(&[y[3],y[4],y[5],y[6]]) }).collect();
    let mass = super::constraints::mass_values(&model);
    let jac = c.jacobian().to_vec();
    let mut start = 0.0;
    let plan = Plan::decide(&model, &layout, &Probe { structure: &c.structure, mass: &mass, jacobian: &jac, rotations: &rotations, length: asm.scales.length }, |rows| {
        use crate::linalg::KktSolver;
        let sub = Constraints::new(&eq, &model, rows, &[], &[]).unwrap();
        let mut s = super::working::sparse_engine(&eq, &model, rows, &layout).unwrap();
        s.set_mass(&mass)?;
        let mut sub = sub; sub.evaluate(&inputs, &model.sets).unwrap();
        let h = s.refactor(sub.jacobian())?; start = h.smallest_pivot_ratio; Ok(h)
    }).unwrap();
    println!("mobility {} redundant {:?} engine {:?} health {start:.2e} L {}", plan.mobility, plan.redundant_rows.iter().map(|r| &r.name).collect::<Vec<_>>(), plan.always_rank_safe, asm.scales.length);
    let channels = model.channels.clone();
    let form: Box<dyn Formulation> = if reference { Box::new(ReferenceForm::new(&mut model, &layout, asm.scales.length)) } else {
        let w = WorkingForm::new(&eq, &mut model, &plan, asm.scales.length, start).unwrap();
        println!("ops {} nodes {} requested {}", w.operations(), eq.graph.len(), eq.graph.requested); Box::new(w) };
    let mut out: Vec<f64> = vec![];
    let times: Vec<f64> = (0..=200).map(|k| k as f64 * 0.05).collect();
    {
    let mut sim = crate::session::Simulation::new(&mut eq, &Model{channels, ..model}, &layout, &asm, form, tol, Box::new(|_, v: &[f64]| { out.push(v[0]); Ok(()) }), Box::new(|_| ()), Default::default()).unwrap();
    let mut y = sim.start(0.0, &asm).unwrap();
    let t0 = std::time::Instant::now();
    let o = Dop853::default().integrate(&mut sim, &mut y, &Span{t_start:0., t_end: 10.0, sample_times: &times}, &Options::default()).unwrap();
    println!("{:?} {:?} {:?}\n{:?} {:?}", t0.elapsed(), o.status, o.counters, sim.counters(), sim.audit());
    }
    out
}

#[test]
fn temp_four_bar() {
    for n in [1, 2] {
      let text = std::fs::read_to_string(format!("/work/shared/benchmarks/reference/A02_N{n}.csv")).unwrap();
      let reference: Vec<f64> = text.lines().filter(|l| !l.starts_with('#') && !l.starts_with('t')).map(|l| l.split(',').nth(1).unwrap().parse().unwrap()).collect();
      for tol in [1e-8, 1e-9, 3e-10, 1e-10, 3e-11, 1e-11, 1e-12] {
        let out = run(n, tol, false);
        let err = out.iter().zip(&reference).map(|(a,b)| (a-b).abs()).fold(0.0, f64::max);
        println!("N {n} tol {tol:e} err {err:e} ({} of {})\n", out.len(), reference.len());
      }
      if n == 0 {
      let out = run(n, 1e-9, true);
        let err = out.iter().zip(&reference).map(|(a,b)| (a-b).abs()).fold(0.0, f64::max);
        println!("REF N {n} err {err:e} ({} of {})\n", out.len(), reference.len()); }
    }
}
