//! Libraries in C: an [`ElementClass`] over the table of `element-api/include/odyn_element.h`.
//!
//! A library describes its elements in constant structs. An element's equations are taken down by functions that the host
//! passes ([`recorder`]), or it is called with numbers; derivatives that it does not give are differences
//! ([`differences`]). Whatever comes from it is checked like what comes from a library in Rust.

// Calling functions of a library with pointers can't be expressed safely. What each call passes lives until it returns, and
// the pointer of an instance goes to its own library only.
#![allow(unsafe_code)]

mod describe;
mod differences;
mod interpret;
mod parameters;
mod recorder;
mod table;

pub(super) use describe::check_element_name;
/// Evaluation of recorded elements with plain numbers, for whoever has recordings and no code.
pub(super) use interpret::Recorded as Evaluation;

#[cfg(test)]
mod tests;

use std::cell::{OnceCell, RefCell};
use std::ffi::c_void;
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use element_api::abi::OpenError;
use element_api::descriptor::{Descriptor, Kind};
use element_api::params::Table as Params;
use element_api::recording::{Op, Output, Recording, Role};
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault, Layout, Wanted};

/// Largest private memory of an instance, bytes.
const MOST_MEMORY: usize = 1 << 30;

/// The classes of a library, given the address of its entry symbol.
///
/// # Errors
/// See [`OpenError`].
///
/// # Safety
/// `entry` is null or the address of the function that `ODYN_PLUGIN` of the header exports, in a library that is never
/// unloaded.
pub unsafe fn open(entry: *const ()) -> Result<Vec<Box<dyn ElementClass>>, OpenError> {
    if entry.is_null() {
        return Err(OpenError::Header);
    }
    // SAFETY: the type that the header gives the symbol.
    let entry = unsafe { std::mem::transmute::<*const (), extern "C-unwind" fn() -> *const table::Plugin>(entry) };
    // SAFETY: what the entry gave.
    let elements = unsafe { describe::elements(entry()) }?;
    let mut classes: Vec<Box<dyn ElementClass>> = Vec::with_capacity(elements.len());
    for element in elements {
        // SAFETY: one of the structs above.
        let descriptor = unsafe { describe::describe(&element) }.map_err(OpenError::Root)?;
        classes.push(Box::new(CClass(Arc::new(Class { element, descriptor }))));
    }
    Ok(classes)
}

struct Class {
    element: table::Element,
    descriptor: Descriptor,
}

// SAFETY: the pointers lead to constants of a library that stays loaded, and its functions may be called from any thread, as
// the header demands.
unsafe impl Send for Class {}
// SAFETY: as above.
unsafe impl Sync for Class {}

struct CClass(Arc<Class>);

impl ElementClass for CClass {
    fn descriptor(&self) -> &Descriptor {
        &self.0.descriptor
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        let (instances, scratch) = (Vec::new(), RefCell::default());
        Box::new(CSet { class: Arc::clone(&self.0), instances, scratch, progress: Arc::default() })
    }
}

struct Instance {
    /// The library's own.
    pointer: *mut c_void,
    params: Params,
    /// The rows that it has, without those on velocities.
    rows: Vec<usize>,
    /// Its rows on velocities.
    velocity_rows: Vec<usize>,
    layout: Layout,
    states: Vec<f64>,
    memory: Vec<f64>,
    /// Starting guesses of its internal unknowns.
    guesses: Vec<f64>,
    /// Its class, with as many frames as it has.
    descriptor: Descriptor,
    /// Its equations once they were taken down.
    recording: OnceCell<Recording>,
}

struct CSet {
    class: Arc<Class>,
    instances: Vec<Instance>,
    /// Results of one instance.
    scratch: RefCell<Vec<f64>>,
    /// The instance under evaluation.
    progress: Arc<AtomicU32>,
}

// SAFETY: the header lets an instance move between threads, as long as one at a time uses it.
unsafe impl Send for CSet {}

impl Drop for CSet {
    fn drop(&mut self) {
        if let Some(destroy) = self.class.element.destroy {
            self.instances.iter().for_each(|instance| destroy(instance.pointer));
        }
    }
}

impl CSet {
    fn instance(&self, instance: usize) -> Result<&Instance, Fault> {
        let message = || format!("instance {instance} does not exist ({} do)", self.instances.len());
        self.instances.get(instance).ok_or_else(|| Fault { instance, message: message() })
    }

    fn opaque(&self) -> bool {
        self.class.descriptor.opaque
    }

    fn recording(&self, number: usize) -> Result<&Recording, Fault> {
        let instance = self.instance(number)?;
        if let Some(recording) = instance.recording.get() {
            return Ok(recording);
        }
        let recording = if self.opaque() {
            Ok(announced(&self.class, instance))
        } else {
            recorder::take_down(&recorder::Subject {
                element: &self.class.element,
                instance: instance.pointer,
                descriptor: &instance.descriptor,
                params: &instance.params,
                rows: &instance.rows,
                velocity_rows: &instance.velocity_rows,
                states: &instance.states,
                memory: &instance.memory,
                guesses: &instance.guesses,
            })
        };
        let recording = recording.and_then(|recording| {
            recording.check(&instance.descriptor.limits())?;
            Ok(recording)
        });
        let recording = recording.map_err(|message| Fault { instance: number, message })?;
        Ok(instance.recording.get_or_init(|| recording))
    }

    /// One instance with numbers.
    fn evaluate_one(&self, number: usize, inputs: &[f64], wanted: Wanted, results: &mut [f64]) -> Result<(), Fault> {
        let instance = self.instance(number)?;
        let (element, layout) = (&self.class.element, instance.layout);
        results.fill(f64::NAN);
        if self.class.descriptor.kind == Kind::Control {
            // It acts on no body; the places for loads are there all the same.
            results[..6 * layout.frames].fill(0.0);
        }
        let Some(function) = element.evaluate.filter(|_| self.opaque()) else {
            let (recording, rows) = (self.recording(number)?, &instance.rows[..]);
            let kind = self.class.descriptor.kind;
            interpret::Recorded { recording, kind, layout, rows }.evaluate(inputs, wanted, results);
            return Ok(());
        };
        let asked =
            if wanted.jacobian { table::WANT_JACOBIAN } else { 0 } + if wanted.second { table::WANT_SECOND } else { 0 };
        let call = |inputs: &[f64], asked: u32, results: &mut [f64]| {
            let mut error = table::Error::empty();
            let status = function(instance.pointer, inputs.as_ptr(), asked, results.as_mut_ptr(), &raw mut error);
            answer(number, status, &error)
        };
        let joint = self.class.descriptor.kind == Kind::Joint;
        if !joint || element.flags & table::GIVES_DERIVATIVES != 0 {
            return call(inputs, if joint { asked } else { 0 }, results);
        }
        call(inputs, 0, results)?;
        let scales = differences::Scales { length: element.difference_length, time: element.difference_time };
        differences::complete(&layout, scales, inputs, wanted, results, |inputs, found| call(inputs, 0, found))
    }
}

/// What a function returned.
fn answer(instance: usize, status: i32, error: &table::Error) -> Result<(), Fault> {
    if status == table::OK { Ok(()) } else { Err(Fault { instance, message: error.texts().1 }) }
}

/// The recording of an opaque element: which results it gives, all referring to a single dummy operation.
fn announced(class: &Class, instance: &Instance) -> Recording {
    let (d, flags) = (&instance.descriptor, class.element.flags);
    let list = |count: usize, role: fn(u32) -> Role| (0..count as u32).map(role);
    let mut roles: Vec<Role> = instance.rows.iter().map(|row| Role::Residual(*row as u32)).collect();
    if d.kind == Kind::Joint {
        roles.extend(list(d.channels.len(), Role::Coordinate));
    } else {
        let loads = if d.kind == Kind::Force { 3 * d.frames.len() } else { 0 };
        roles.extend(list(loads, Role::Force));
        roles.extend(list(loads, Role::Torque));
        roles.extend(list(instance.states.len(), Role::StateRate));
        roles.extend(list(instance.memory.len(), Role::NextDiscrete));
        roles.extend(list(d.channels.len(), Role::Channel));
        roles.extend((flags & table::GIVES_POTENTIAL != 0).then_some(Role::Potential));
        roles.extend((flags & table::GIVES_DISSIPATION != 0).then_some(Role::Dissipation));
    }
    roles.extend(list(d.angles, Role::Angle));
    Recording {
        ops: vec![Op::Constant(0).encode()],
        constants: vec![0.0],
        tables: Vec::new(),
        outputs: roles.into_iter().map(|role| Output { role, node: 0 }).collect(),
        initial_states: instance.states.clone(),
        initial_discrete: instance.memory.clone(),
    }
}

impl ElementSet for CSet {
    fn progress(&self) -> Option<Arc<AtomicU32>> {
        Some(Arc::clone(&self.progress))
    }

    fn add(&mut self, params: &Params) -> Result<usize, CreateError> {
        let element = &self.class.element;
        let (pointer, frames) = parameters::create(element, &self.class.descriptor, params)?;
        let descriptor = self.class.descriptor.with_frames(frames);
        let d = &descriptor;
        let uses = |row: &usize| element.uses_row.is_none_or(|uses| uses(pointer, *row as u32) != 0);
        let first = d.rows.len() - element.velocity_row_count;
        let rows: Vec<usize> = (0..first).filter(uses).collect();
        let velocity_rows: Vec<usize> = (first..d.rows.len()).filter(uses).collect();
        let mut states = vec![0.0; d.states.len()];
        let mut memory = vec![0.0; element.memory as usize];
        if let Some(start) = element.start {
            start(pointer, states.as_mut_ptr(), memory.as_mut_ptr());
        }
        let mut guesses = vec![0.0; d.unknowns.len()];
        if let Some(guess) = element.guess {
            guess(pointer, guesses.as_mut_ptr());
        }
        let layout = Layout {
            frames: d.frames.len(),
            angles: d.angles,
            states: states.len() + guesses.len(),
            memory: memory.len(),
            signals: d.inputs.len(),
            joints: d.joints.len(),
            values: rows.len() + d.channels.len(),
        };
        self.instances.push(Instance {
            pointer,
            params: params.clone(),
            rows,
            velocity_rows,
            layout,
            states,
            memory,
            guesses,
            descriptor,
            recording: OnceCell::new(),
        });
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        self.recording(instance).cloned()
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let mut given = batch.inputs;
        let mut rest = out;
        let mut scratch = self.scratch.borrow_mut();
        for number in batch.instances.iter().map(|number| *number as usize) {
            self.progress.store(number as u32, Ordering::Relaxed);
            let layout = self.instance(number)?.layout;
            let results = match self.class.descriptor.kind {
                Kind::Joint => layout.joint_results(),
                Kind::Force | Kind::Control => layout.force_results(),
            };
            let (Some((inputs, later)), true) = (given.split_at_checked(layout.inputs()), rest.len() >= results) else {
                let message = format!("needs {} inputs and {results} results, found fewer", layout.inputs());
                return Err(Fault { instance: number, message });
            };
            // Not into `rest` itself: what an element writes before it fails is nobody's business.
            scratch.resize(results, f64::NAN);
            self.evaluate_one(number, inputs, batch.wanted, &mut scratch)?;
            let (own, others) = rest.split_at_mut(results);
            own.copy_from_slice(&scratch);
            (given, rest) = (later, others);
        }
        if given.is_empty() && rest.is_empty() {
            return Ok(());
        }
        let message = format!("{} inputs and {} results are left over", given.len(), rest.len());
        Err(Fault { instance: 0, message })
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        let found = self.instance(instance)?;
        let needed = found.layout.inputs();
        let Some(accept) = self.class.element.accept else { return Ok(()) };
        if inputs.len() != needed {
            let message = format!("needs {needed} inputs, found {}", inputs.len());
            return Err(Fault { instance, message });
        }
        let mut error = table::Error::empty();
        let status = accept(found.pointer, inputs.as_ptr(), &raw mut error);
        answer(instance, status, &error)
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        let pointer = self.instance(instance)?.pointer;
        let Some(save) = self.class.element.save else { return Ok(Vec::new()) };
        let size = save(pointer, ptr::null_mut(), 0);
        if size > MOST_MEMORY {
            let message = format!("its memory has {size} bytes; at most {MOST_MEMORY}");
            return Err(Fault { instance, message });
        }
        let mut bytes = vec![0; size];
        let again = save(pointer, bytes.as_mut_ptr(), size);
        if again == size {
            return Ok(bytes);
        }
        let message = format!("its memory has {size} bytes, and {again} when it is asked again");
        Err(Fault { instance, message })
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        let pointer = self.instance(instance)?.pointer;
        let Some(load) = self.class.element.load else {
            if memory.is_empty() {
                return Ok(());
            }
            return Err(Fault { instance, message: "this element keeps no memory".into() });
        };
        let mut error = table::Error::empty();
        let status = load(pointer, memory.as_ptr(), memory.len(), &raw mut error);
        answer(instance, status, &error)
    }
}
