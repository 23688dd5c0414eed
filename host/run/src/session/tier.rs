//! [`Tier`]: when programs turn from interpreted ones into machine code.
//!
//! What every step runs is made at once, where that is quick. The rest starts interpreted: when the work still to come,
//! predicted from the work done so far and known from the samples to be taken, pays for making machine code, it is made, between
//! two steps where that is quick, else by another thread while the run continues. Both give the same results bit for bit, so that
//! nothing depends on when that happens.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Instant;

use crate::program::{MachineCode, MachineError, Maker, Program, SharedCode, Used};

/// Predicted savings over the cost of compiling from which on it is done. Compiling takes a processor that the run itself
/// might have had, the run continues interpreted meanwhile, and predictions err.
const MARGIN: f64 = 2.0;
/// Share of the runs that pay for compiling that must have been done before anything is predicted from them: the first
/// steps are short and say little about those to come, and a wrong guess costs no multiple of what was spent already.
const PROOF: f64 = 0.25;
/// Accepted steps before the first prediction; doubled for each further one.
const FIRST_LOOK: u64 = 8;
/// The same where machine code is made quickly.
const FIRST_QUICK_LOOK: u64 = 1;

/// Machine code of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Made {
    /// Programs that were compiled.
    pub programs: u64,
    /// Size of their code, bytes.
    pub bytes: u64,
    /// Time it took to make it, s: before the first step, or beside the run.
    pub seconds: f64,
    /// Time of the first step that ran it, s.
    pub since: Option<f64>,
}

/// The code of programs, by their ids; and the time that took, s.
type Codes = (Vec<(u64, MachineCode)>, f64);

/// A thread that compiles.
struct Job {
    cancel: Arc<AtomicBool>,
    thread: Option<JoinHandle<Codes>>,
}

impl Job {
    fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What it made; nothing where it failed.
    fn codes(mut self) -> Codes {
        self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or_default()
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        // Nobody waits for it: it ends after the function under way.
        self.cancel.store(true, Ordering::Relaxed);
    }
}

/// See the module documentation.
pub struct Tier {
    maker: Maker,
    /// Start and end of the run, if programs may be compiled during it.
    span: Option<(f64, f64)>,
    begun: bool,
    steps: u64,
    next_look: u64,
    job: Option<Job>,
    made: Made,
    /// What other runs have made code for, if they share it.
    shared: Option<SharedCode>,
}

impl Default for Tier {
    fn default() -> Self {
        Self::fixed()
    }
}

impl Tier {
    /// Programs stay what they are.
    #[must_use]
    pub fn fixed() -> Self {
        Self {
            maker: Maker::here(),
            span: None,
            begun: false,
            steps: 0,
            next_look: 0,
            job: None,
            made: Made::default(),
            shared: None,
        }
    }

    /// Programs are compiled during a run from `start` to `end` (s) when that pays.
    #[must_use]
    pub fn automatic(start: f64, end: f64) -> Self {
        Self::by(Maker::here(), start, end)
    }

    /// The same by a certain maker.
    pub(super) fn by(maker: Maker, start: f64, end: f64) -> Self {
        let next_look = if maker == Maker::Assembler { FIRST_QUICK_LOOK } else { FIRST_LOOK };
        Self { maker, span: Some((start, end)), next_look, ..Self::fixed() }
    }

    /// Has code in common with other runs.
    #[must_use]
    pub fn sharing(self, shared: Option<SharedCode>) -> Self {
        Self { shared, ..self }
    }

    /// Installs what other runs have code for, in a run from time `t` (s).
    pub fn take_shared(&mut self, t: f64, mut programs: Vec<Used<'_>>) {
        let Some(shared) = self.shared.clone() else { return };
        for used in programs.iter_mut().filter(|used| is_open(used)) {
            if let Some(code) = shared.find(used.program) {
                self.install(t, used, code);
            }
        }
    }

    /// Leaves what was made, and how often programs were run, to other runs.
    pub fn leave(&mut self, programs: Vec<Used<'_>>) {
        if let Some(shared) = &self.shared {
            shared.learn(self.maker, programs);
        }
    }

    /// Whether code is had in common with other runs.
    #[must_use]
    pub fn shares(&self) -> bool {
        self.shared.is_some()
    }

    /// Compiles all programs but the spare ones now.
    ///
    /// # Errors
    /// [`MachineError`] when there is no machine code to be had.
    pub fn compile_now(&mut self, t: f64, mut programs: Vec<Used<'_>>) -> Result<(), MachineError> {
        let wanted: Vec<&mut Used<'_>> = programs.iter_mut().filter(|used| is_open(used) && !used.spare).collect();
        self.make_together(t, wanted)
    }

    /// As [`Tier::between_steps`], before steps; decides something only before the first.
    pub fn begin<'p>(&mut self, t: f64, samples: usize, programs: impl FnOnce() -> Vec<Used<'p>>) {
        if self.span.is_some() && self.maker == Maker::Assembler && !std::mem::replace(&mut self.begun, true) {
            self.make(t, 0.0, samples, programs());
        }
    }

    /// Counts a step; gives whether [`Tier::between_steps`] may have something to decide after it.
    pub fn counts_step(&mut self) -> bool {
        self.steps += 1;
        self.span.is_some() && (self.job.is_some() || self.steps >= self.next_look)
    }

    /// To be called between steps, where [`Tier::counts_step`] says so, at time `t` (s) of an accepted state, with so many samples
    /// still to be taken. `programs` are asked for when something is to be decided.
    pub fn between_steps<'p>(&mut self, t: f64, samples: usize, programs: impl FnOnce() -> Vec<Used<'p>>) {
        let Some((start, end)) = self.span else { return };
        if let Some(job) = &self.job {
            if job.is_finished() {
                self.take_over(t, programs());
            }
            return;
        }
        self.next_look = 2 * self.steps;
        self.make(t, (end - t) / (t - start), samples, programs());
    }

    /// Compiles what pays if `to_come` times as many runs follow as there have been.
    fn make(&mut self, t: f64, to_come: f64, samples: usize, mut programs: Vec<Used<'_>>) {
        let maker = self.maker;
        let paying = programs.iter_mut().filter(|used| is_open(used) && pays(maker, used, to_come, samples));
        if maker == Maker::Assembler {
            if self.make_together(t, paying.collect()).is_err() {
                // A reason to continue without.
                self.span = None;
            }
            return;
        }
        let list: Vec<Program> = paying.map(|used| used.program.clone()).collect();
        if !list.is_empty() {
            self.job = begin(maker, list);
            self.span = self.span.filter(|_| self.job.is_some());
        }
    }

    /// Makes and installs code of programs at once.
    fn make_together(&mut self, t: f64, mut wanted: Vec<&mut Used<'_>>) -> Result<(), MachineError> {
        if wanted.is_empty() {
            return Ok(());
        }
        let started = Instant::now();
        let programs: Vec<&Program> = wanted.iter().map(|used| &*used.program).collect();
        let codes = MachineCode::compile_all(&programs, self.maker, &AtomicBool::new(false))?;
        for (used, code) in wanted.iter_mut().zip(codes) {
            self.install(t, used, Arc::new(code));
        }
        self.made.seconds += started.elapsed().as_secs_f64();
        Ok(())
    }

    /// Installs what the thread has made.
    fn take_over(&mut self, t: f64, mut programs: Vec<Used<'_>>) {
        let Some(job) = self.job.take() else { return };
        let (codes, seconds) = job.codes();
        self.made.seconds += seconds;
        if codes.is_empty() {
            // A compiler that fails is a reason to continue without it.
            self.span = None;
        }
        for (id, code) in codes {
            if let Some(used) = programs.iter_mut().find(|used| used.program.id() == id) {
                self.install(t, used, Arc::new(code));
            }
        }
    }

    fn install(&mut self, t: f64, used: &mut Used<'_>, code: Arc<MachineCode>) {
        self.made.programs += 1;
        self.made.bytes += code.bytes() as u64;
        self.made.since.get_or_insert(t);
        used.program.install(code);
    }

    /// Whether a thread is compiling.
    #[must_use]
    pub fn is_compiling(&self) -> bool {
        self.job.is_some()
    }

    /// What was compiled so far.
    #[must_use]
    pub fn made(&self) -> &Made {
        &self.made
    }
}

/// Whether there is something to compile.
fn is_open(used: &Used<'_>) -> bool {
    !used.program.is_machine_code() && used.program.listed() > 0
}

/// Whether compiling a program pays if `to_come` times as many runs follow as it has had, or one with each of the samples to come.
/// What is made quickly pays within a step where every evaluation runs it, and within a few where it is run once per step.
fn pays(maker: Maker, used: &Used<'_>, to_come: f64, samples: usize) -> bool {
    let runs = used.runs as f64;
    let paying = maker.runs_that_pay(used.program.listed());
    let is_known = used.stepped && maker == Maker::Assembler || used.sampled && samples as f64 >= MARGIN * paying;
    is_known || runs >= PROOF * paying && runs * to_come >= MARGIN * paying
}

/// Starts a thread that compiles; none where there are no threads.
fn begin(maker: Maker, list: Vec<Program>) -> Option<Job> {
    let cancel = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&cancel);
    let work = move || {
        let started = Instant::now();
        let codes =
            list.iter().map_while(|program| Some((program.id(), MachineCode::compile(program, maker, &told).ok()?)));
        let codes: Vec<_> = codes.collect();
        (codes, started.elapsed().as_secs_f64())
    };
    let thread = thread::Builder::new().name("compiler".into()).spawn(work).ok()?;
    Some(Job { cancel, thread: Some(thread) })
}
