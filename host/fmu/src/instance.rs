//! One instance of an FMU, from its start to its end.

// The pointer of an instance goes to the functions of its own library only.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::description::{Causality, Description, Storage, Variable};
use crate::library::{Functions, Library, Log, Making, Status, limits};

/// A value that a scene gives a parameter, in the unit of the FMU.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Given {
    Number(f64),
    Text(String),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Inputs may be set and outputs asked for; time stands.
    Initialising,
    Stepping,
    /// It failed: it may be freed.
    Failed,
    /// It must not be called any more, not even to be freed.
    Broken,
}

/// See the module documentation.
pub(crate) struct Instance {
    library: Arc<Library>,
    description: Arc<Description>,
    component: *mut c_void,
    phase: Phase,
    /// Up to where it has computed, s.
    pub(crate) time: f64,
    log: Box<Log>,
    /// What the FMU holds a pointer to.
    _held: Box<dyn Send>,
}

// SAFETY: a standard-conforming FMU may be called from any thread, from one at a time; whoever has `&mut` is alone.
unsafe impl Send for Instance {}

type Done = (&'static str, Status);

impl Instance {
    /// Makes an instance at a time, s, in its initialisation.
    ///
    /// # Errors
    /// The function that failed, in words.
    pub(crate) fn start(
        library: &Arc<Library>,
        description: &Arc<Description>,
        (name, resources): (&str, &Path),
        t: f64,
        parameters: &[(usize, Given)],
    ) -> Result<Self, String> {
        let before = library.alive.fetch_add(1, Ordering::SeqCst);
        let log = Box::new(Log::default());
        let once = description.only_once && before > 0;
        let making = Making { description, name, resources, log: std::ptr::from_ref::<Log>(&log).cast() };
        let made = if once {
            Err("it can be instantiated only once per process (canBeInstantiatedOnlyOncePerProcess), and another instance is alive".into())
        } else {
            match &library.functions {
                Functions::Two(functions) => functions.instantiate(&making),
                Functions::Three(functions) => functions.instantiate(&making),
            }
        };
        let (component, held) = made.map_err(|message| {
            library.alive.fetch_sub(1, Ordering::SeqCst);
            message + &log.said()
        })?;
        let mut made = Self {
            library: Arc::clone(library),
            description: Arc::clone(description),
            component,
            phase: Phase::Initialising,
            time: t,
            log,
            _held: held,
        };
        for (place, given) in parameters {
            let variable = &description.variables[*place];
            let about = |done: Done| (done, format!(" of the parameter `{}`", variable.name));
            let (done, what) = match given {
                Given::Number(value) => about(made.set(variable, *value)?),
                Given::Text(text) => about(match &library.functions {
                    Functions::Two(functions) => functions.set_text(component, variable.reference, text)?,
                    Functions::Three(functions) => functions.set_text(component, variable.reference, text)?,
                }),
            };
            made.done(done, &what)?;
        }
        let entered = match &library.functions {
            Functions::Two(functions) => functions.enter(component, t),
            Functions::Three(functions) => functions.enter(component, t),
        };
        made.done(entered, &format!(" at t = {t} s"))?;
        Ok(made)
    }

    /// Sets the inputs and asks for the outputs, while time stands at the start.
    ///
    /// # Errors
    /// The function that failed, in words.
    pub(crate) fn settle(&mut self, inputs: &[f64], outputs: &mut [f64]) -> Result<(), String> {
        if self.phase == Phase::Initialising {
            self.set_inputs(inputs)?;
        }
        self.get_outputs(outputs)
    }

    /// Computes with these inputs from where it is up to a time, s; the interval is `step` if it is about that.
    ///
    /// # Errors
    /// The function that failed, in words.
    pub(crate) fn step(&mut self, to: f64, step: f64, inputs: &[f64], outputs: &mut [f64]) -> Result<(), String> {
        const SAME: f64 = 1e-6;
        let interval = to - self.time;
        let regular = (interval - step).abs() <= SAME * step;
        if interval <= 0.0 {
            return Err(format!("it is at t = {} s and cannot go back to {to} s", self.time));
        }
        if !regular && !self.description.any_step {
            return Err(format!(
                "it takes communication steps of one size only (canHandleVariableCommunicationStepSize), and one from {} s to {to} s \
                 is asked for instead of {step} s: begin at a whole multiple of the period",
                self.time
            ));
        }
        self.begin_to_step()?;
        self.set_inputs(inputs)?;
        let step = if regular { step } else { interval };
        let (name, status, ends) = match &self.library.functions {
            Functions::Two(functions) => functions.step(self.component, self.time, step),
            Functions::Three(functions) => functions.step(self.component, self.time, step),
        };
        let what = format!(" from t = {} s to {to} s", self.time);
        if ends {
            self.phase = Phase::Failed;
            return Err(format!("it ended the simulation ({name}{what}: terminate){}", self.log.said()));
        }
        self.done((name, status), &what)?;
        self.time = to;
        self.get_outputs(outputs)
    }

    /// Ends the initialisation, if it has not ended.
    fn begin_to_step(&mut self) -> Result<(), String> {
        if self.phase == Phase::Initialising {
            let done = match &self.library.functions {
                Functions::Two(functions) => functions.exit(self.component),
                Functions::Three(functions) => functions.exit(self.component),
            };
            self.done(done, "")?;
            self.phase = Phase::Stepping;
        }
        if self.phase == Phase::Stepping { Ok(()) } else { Err("it has failed before".into()) }
    }

    /// Its state as bytes.
    ///
    /// # Errors
    /// It cannot save its state.
    pub(crate) fn save(&mut self) -> Result<Vec<u8>, String> {
        self.begin_to_step()?;
        self.library.states.save(self.component)
    }

    /// Brings it back to a state that another instance has saved at a time, s.
    ///
    /// # Errors
    /// It refuses the bytes.
    pub(crate) fn load(&mut self, t: f64, bytes: &[u8]) -> Result<(), String> {
        self.begin_to_step()?;
        self.library.states.load(self.component, bytes)?;
        self.time = t;
        Ok(())
    }

    fn set(&self, variable: &Variable, value: f64) -> Result<Done, String> {
        let value = if let Some((least, most)) = limits(variable.storage) {
            let whole = value.round();
            if !(least..=most).contains(&whole) {
                return Err(format!("{value} does not fit into `{}`", variable.name));
            }
            whole
        } else {
            value
        };
        Ok(match &self.library.functions {
            Functions::Two(functions) => functions.set(self.component, variable.storage, variable.reference, value),
            Functions::Three(functions) => functions.set(self.component, variable.storage, variable.reference, value),
        })
    }

    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), String> {
        let description = Arc::clone(&self.description);
        for (variable, value) in signals(&description, Causality::Input).zip(inputs) {
            if !value.is_finite() {
                return Err(format!("its input `{}` is not a finite number at t = {} s", variable.name, self.time));
            }
            let done = self.set(variable, variable.unit.of_si(*value))?;
            self.done(done, &format!(" of the input `{}`", variable.name))?;
        }
        Ok(())
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), String> {
        let description = Arc::clone(&self.description);
        for (variable, value) in signals(&description, Causality::Output).zip(outputs) {
            let (storage, reference) = (variable.storage, variable.reference);
            let mut number = 0.0;
            let done = match &self.library.functions {
                Functions::Two(functions) => functions.get(self.component, storage, reference, &mut number),
                Functions::Three(functions) => functions.get(self.component, storage, reference, &mut number),
            };
            self.done(done, &format!(" of the output `{}`", variable.name))?;
            if !number.is_finite() {
                return Err(format!("its output `{}` is not a finite number at t = {} s", variable.name, self.time));
            }
            *value = variable.unit.to_si(number);
        }
        Ok(())
    }

    /// What a function returned; after an error it is not used any more.
    fn done(&mut self, (name, status): Done, what: &str) -> Result<(), String> {
        if status == Status::Fine {
            return Ok(());
        }
        self.phase = if status == Status::Fatal { Phase::Broken } else { Phase::Failed };
        Err(format!("{name}{what} returned {}{}", status.words(), self.log.said()))
    }
}

/// The variables of a causality that are numbers.
pub(crate) fn signals(description: &Description, causality: Causality) -> impl Iterator<Item = &Variable> {
    description.of(causality).filter(|variable| variable.storage != Storage::Text)
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.library.alive.fetch_sub(1, Ordering::SeqCst);
        if self.phase != Phase::Broken {
            let terminate = self.phase == Phase::Stepping;
            match &self.library.functions {
                Functions::Two(functions) => functions.end(self.component, terminate),
                Functions::Three(functions) => functions.end(self.component, terminate),
            }
        }
    }
}
