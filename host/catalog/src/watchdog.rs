//! [`Watchdog`]: reports which call into a library does not return.
//!
//! A call can't be ended from outside: its thread runs foreign code, which may hold anything. So a thread of its own looks
//! now and then whether a call that was under way still is, and reports whom it was made for. What follows is decided by
//! whoever receives the report.
//!
//! The calls themselves pay two atomic numbers, no clock. The thread is started with the first class whose code may run: a start in
//! which all answers of libraries are known from before has none.

use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;
use std::time::{Duration, Instant};

use element_api::descriptor::Descriptor;
use element_api::params::Table;
use element_api::recording::Recording;
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault};

use super::float_control;

/// Looks per patience: a call is reported at most a tenth of it late.
const LOOKS: u32 = 10;
/// Longest time between two looks.
const LONGEST_SLEEP: Duration = Duration::from_millis(500);
/// Shortest one.
const SHORTEST_SLEEP: Duration = Duration::from_millis(1);

/// What a library may be asked for, in words.
const FUNCTIONS: [&str; 10] = [
    "loading the library",
    "new set",
    "create",
    "record",
    "evaluate",
    "accept",
    "save",
    "load",
    "destroy",
    "communicate",
];
const LOADING: usize = 0;
const NEW_SET: usize = 1;
const CREATE: usize = 2;
const RECORD: usize = 3;
const EVALUATE: usize = 4;
const ACCEPT: usize = 5;
const SAVE: usize = 6;
const LOAD: usize = 7;
const DESTROY: usize = 8;
const COMMUNICATE: usize = 9;

/// A set holds what it watches until it is dropped.
const HELD: &str = "held until the end";

/// No instance in particular.
const NONE: usize = u32::MAX as usize;

/// A call that has not come back.
#[derive(Debug, Clone, PartialEq)]
pub struct Late {
    /// Package, or file, of the library.
    pub library: String,
    /// Type of the element; empty while the library is loaded.
    pub element: String,
    /// Name of the element in the scene, where that is known. One of them, where a linked-in library works on several.
    pub instance: Option<String>,
    /// What it was asked for.
    pub function: &'static str,
    /// How long that has taken so far, s.
    pub seconds: f64,
}

impl std::fmt::Display for Late {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (&self.instance, self.element.is_empty()) {
            (_, true) => write!(f, "`{}`", self.library)?,
            (None, _) => write!(f, "`{}/{}`", self.library, self.element)?,
            (Some(name), _) => write!(f, "`{name}` ({}/{})", self.library, self.element)?,
        }
        write!(f, " has not come back from `{}` for {:.1} s", self.function, self.seconds)
    }
}

/// Watches the calls into the libraries of catalogs it is given to, until the last of its copies and of what it watches is
/// dropped.
#[derive(Clone)]
pub struct Watchdog(Arc<Shared>);

#[derive(Default)]
struct Shared {
    posts: Mutex<Vec<Weak<Post>>>,
    /// Starts the thread that looks; `None` once it has been called, and where there is nobody to report to.
    asleep: Mutex<Option<Box<dyn FnOnce() + Send>>>,
}

/// Watchdogs whose threads wait for the first library that is loaded; `None` from then on.
static SLEEPING: Mutex<Option<Vec<Weak<Shared>>>> = Mutex::new(Some(Vec::new()));

/// From now on code of libraries may run in this process.
#[cfg(feature = "abi")]
pub(super) fn wake() {
    let sleeping = lock(&SLEEPING).take();
    sleeping.into_iter().flatten().filter_map(|shared| shared.upgrade()).for_each(|shared| shared.wake());
}

impl Shared {
    fn wake(&self) {
        if let Some(start) = lock(&self.asleep).take() {
            start();
        }
    }
}

impl std::fmt::Debug for Watchdog {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Watchdog")
    }
}

impl Watchdog {
    /// Begins to watch: `told` hears of a call that has taken longer than `patience`, and again each time that has doubled.
    /// It is called from another thread.
    #[must_use]
    pub fn start(patience: Duration, told: impl Fn(&Late) + Send + 'static) -> Self {
        let shared = Arc::new(Shared::default());
        let watched = Arc::downgrade(&shared);
        let sleep = (patience / LOOKS).clamp(SHORTEST_SLEEP, LONGEST_SLEEP);
        let look = move || {
            while let Some(shared) = watched.upgrade() {
                let posts: Vec<Arc<Post>> = lock(&shared.posts).iter().filter_map(Weak::upgrade).collect();
                drop(shared);
                posts.iter().filter_map(|post| post.look(patience)).for_each(|late| told(&late));
                drop(posts);
                thread::sleep(sleep);
            }
        };
        // A system without threads has no watchdog.
        let start = move || drop(thread::Builder::new().name("odyn watchdog".into()).spawn(look));
        *lock(&shared.asleep) = Some(Box::new(start));
        match &mut *lock(&SLEEPING) {
            Some(sleeping) => sleeping.push(Arc::downgrade(&shared)),
            None => shared.wake(),
        }
        Self(shared)
    }

    /// One that nobody reports to: what remains is that calls leave the floating-point control register as it was.
    #[cfg(all(unix, feature = "glass"))]
    pub(super) fn alone() -> Self {
        Self(Arc::default())
    }

    /// A place to note what is under way.
    fn post(&self, library: &str, element: &str, progress: Option<Arc<AtomicU32>>) -> Arc<Post> {
        let post = Arc::new(Post {
            library: library.into(),
            element: element.into(),
            calls: AtomicU64::new(0),
            function: AtomicUsize::new(0),
            instance: AtomicU32::new(0),
            progress,
            names: Mutex::new(Vec::new()),
            seen: Mutex::new(Seen { calls: 0, since: Instant::now(), told: 0 }),
        });
        let mut posts = lock(&self.0.posts);
        posts.retain(|known| known.strong_count() > 0);
        posts.push(Arc::downgrade(&post));
        post
    }

    /// Loads a library under watch.
    pub(super) fn load<T>(&self, file: &str, body: impl FnOnce() -> T) -> T {
        self.post(file, "", None).during(LOADING, 0, body)
    }

    /// The same class, its calls watched. One `at_rest` runs no code of a library before [`wake`] is called.
    pub(super) fn class(&self, library: &str, inner: Arc<dyn ElementClass>, at_rest: bool) -> Arc<dyn ElementClass> {
        if !at_rest {
            self.0.wake();
        }
        Arc::new(WatchedClass { library: library.into(), inner, watchdog: self.clone() })
    }
}

/// What a set is doing.
pub(super) struct Post {
    pub(super) library: String,
    /// Empty while the library is loaded.
    pub(super) element: String,
    /// Calls begun and calls ended, together: odd while one is under way.
    calls: AtomicU64,
    function: AtomicUsize,
    /// The instance it is about; of several, the first.
    instance: AtomicU32,
    /// Where a loaded library writes which of several it is at.
    progress: Option<Arc<AtomicU32>>,
    /// Names of the instances.
    pub(super) names: Mutex<Vec<String>>,
    /// What the watchdog saw last.
    seen: Mutex<Seen>,
}

struct Seen {
    calls: u64,
    since: Instant,
    told: i32,
}

impl Post {
    /// `[hot, no allocation]`
    fn during<T>(&self, function: usize, instance: usize, body: impl FnOnce() -> T) -> T {
        self.function.store(function, Ordering::Relaxed);
        self.instance.store(instance as u32, Ordering::Relaxed);
        let _under_way = UnderWay::begin(&self.calls);
        #[cfg(all(unix, feature = "crashes"))]
        let _here = super::crash::Here::enter(self);
        body()
    }

    /// `[hot]` A call that must leave rounding, denormals and traps as they were; `fault` makes an error of what is said.
    fn call<T, E>(
        &self,
        function: usize,
        instance: usize,
        body: impl FnOnce() -> Result<T, E>,
        fault: impl FnOnce(String) -> E,
    ) -> Result<T, E> {
        let (result, kept) = float_control::kept(|| self.during(function, instance, body));
        if kept {
            return result;
        }
        // In a batch of several instances nobody knows which one it was, so the type is named.
        Err(fault(format!(
            "`{}/{}` changed rounding, denormals or traps of the processor (the floating-point control register) in `{}`; they \
             were restored, but its numbers mean nothing",
            self.library, self.element, FUNCTIONS[function]
        )))
    }

    /// The same, about one instance.
    fn about<T>(&self, function: usize, instance: usize, body: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
        self.call(function, instance, body, |message| Fault { instance, message })
    }

    /// What the call under way is for, in words, and the number of the instance. May be called from the handler of a signal.
    pub(super) fn at(&self) -> (&'static str, usize) {
        let function = self.function.load(Ordering::Relaxed);
        let own = self.progress.as_ref().filter(|_| function == EVALUATE).map(|at| at.load(Ordering::Relaxed));
        let instance = own.unwrap_or_else(|| self.instance.load(Ordering::Relaxed));
        (FUNCTIONS[function], instance as usize)
    }

    /// The call under way, if it has been so for longer than has been reported.
    fn look(&self, patience: Duration) -> Option<Late> {
        let calls = self.calls.load(Ordering::Acquire);
        let mut seen = lock(&self.seen);
        if calls.is_multiple_of(2) || calls != seen.calls {
            *seen = Seen { calls, since: Instant::now(), told: 0 };
            return None;
        }
        let seconds = seen.since.elapsed().as_secs_f64();
        if seconds < patience.as_secs_f64() * f64::from(seen.told).exp2() {
            return None;
        }
        seen.told += 1;
        let (function, instance) = self.at();
        Some(Late {
            library: self.library.clone(),
            element: self.element.clone(),
            instance: lock(&self.names).get(instance).cloned(),
            function,
            seconds,
        })
    }
}

/// Ends the call also when it is left by a panic.
struct UnderWay<'a>(&'a AtomicU64);

impl<'a> UnderWay<'a> {
    fn begin(calls: &'a AtomicU64) -> Self {
        calls.fetch_add(1, Ordering::Release);
        Self(calls)
    }
}

impl Drop for UnderWay<'_> {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::Release);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

struct WatchedClass {
    library: String,
    inner: Arc<dyn ElementClass>,
    watchdog: Watchdog,
}

impl ElementClass for WatchedClass {
    fn descriptor(&self) -> &Descriptor {
        self.inner.descriptor()
    }

    fn new_set(&self) -> Box<dyn ElementSet> {
        let element = &self.descriptor().name;
        let inner = self.watchdog.post(&self.library, element, None).during(NEW_SET, 0, || self.inner.new_set());
        let post = self.watchdog.post(&self.library, element, inner.progress());
        Box::new(WatchedSet { inner: Some(inner), post, count: 0 })
    }
}

struct WatchedSet {
    /// `None` at the end only.
    inner: Option<Box<dyn ElementSet>>,
    post: Arc<Post>,
    /// Instances so far.
    count: usize,
}

impl WatchedSet {
    fn inner(&self) -> &dyn ElementSet {
        self.inner.as_deref().expect(HELD)
    }
    fn parts(&mut self) -> (&mut dyn ElementSet, &Post) {
        (self.inner.as_deref_mut().expect(HELD), &self.post)
    }
}

impl Drop for WatchedSet {
    /// Elements may run code of their own when they end, so that is watched, too.
    fn drop(&mut self) {
        let inner = self.inner.take();
        float_control::kept(|| self.post.during(DESTROY, NONE, || drop(inner)));
    }
}

impl ElementSet for WatchedSet {
    fn announce(&mut self, name: &str) {
        let mut names = lock(&self.post.names);
        names.truncate(self.count);
        // An instance before that nobody announced is called nothing.
        names.resize(self.count, String::new());
        names.push(name.into());
        drop(names);
        self.parts().0.announce(name);
    }
    fn progress(&self) -> Option<Arc<AtomicU32>> {
        self.inner().progress()
    }
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let count = self.count;
        let (inner, post) = self.parts();
        let added = post.call(CREATE, count, || inner.add(params), CreateError::Fault);
        self.count += usize::from(added.is_ok());
        added
    }
    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        self.post.about(RECORD, instance, || self.inner().record(instance))
    }
    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let first = batch.instances.first().map_or(0, |first| *first as usize);
        self.post.about(EVALUATE, first, || self.inner().evaluate(batch, out))
    }
    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        let (inner, post) = self.parts();
        post.about(ACCEPT, instance, || inner.accept(instance, inputs))
    }
    fn communicates(&self) -> bool {
        self.inner().communicates()
    }
    fn communicate(&mut self, instance: usize, t: f64, begins: bool, memory: &mut [f64]) -> Result<(), Fault> {
        let (inner, post) = self.parts();
        post.about(COMMUNICATE, instance, || inner.communicate(instance, t, begins, memory))
    }
    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        self.post.about(SAVE, instance, || self.inner().save(instance))
    }
    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        let (inner, post) = self.parts();
        post.about(LOAD, instance, || inner.load(instance, memory))
    }
}
