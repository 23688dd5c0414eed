//! A recorder seen from the host: a process that is asked, has a limited time to answer, and may end at any moment.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use super::message::{Lost, Request, receive, send};
use crate::crash;

/// Variables of the surroundings that a recorder gets: where the system's loader looks for what a library needs.
const SURROUNDINGS: [&str; 3] = ["LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "DYLD_FALLBACK_LIBRARY_PATH"];
/// How often a call under way is looked at.
const LOOK: Duration = Duration::from_millis(50);
/// Time for a process to end after it has closed its pipe.
const LAST_MOMENTS: Duration = Duration::from_secs(1);
/// Lines that a library may print, and bytes of each.
const MOST_LINES: usize = 100;
const LONGEST_LINE: u64 = 500;

/// Beginnings of the sentences about a process that is gone, by which they are known where they arrive as text.
pub(super) const CRASHED: &str = "its code crashed";
pub(super) const EXITED: &str = "its code ended its process";
pub(super) const LATE: &str = "its code did not come back";
pub(super) const REACHED: &str = "its code reached out of its process";

/// Why a process can't be asked.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gone {
    /// A sentence without its subject's name.
    pub message: String,
    /// The instance that its library was at, where that is known.
    pub instance: Option<usize>,
}

impl From<String> for Gone {
    fn from(message: String) -> Self {
        Self { message, instance: None }
    }
}

impl From<Gone> for String {
    fn from(gone: Gone) -> Self {
        gone.message
    }
}

/// See the module documentation.
pub(super) struct Process {
    state: Arc<State>,
    pipes: Mutex<Pipes>,
}

struct Pipes {
    to: ChildStdin,
    from: ChildStdout,
    buffer: Vec<u8>,
    /// Why it can't be asked any more.
    gone: Option<Gone>,
}

/// Shared with the thread that ends a process that takes too long.
struct State {
    child: Mutex<Child>,
    born: Instant,
    /// When the call under way began, ms after `born`, plus 1; 0 between calls.
    since: AtomicU64,
    limit: Duration,
    late: AtomicBool,
}

impl State {
    fn now(&self) -> u64 {
        u64::try_from(self.born.elapsed().as_millis()).unwrap_or(u64::MAX - 1)
    }

    /// Ends the process if the call under way takes too long.
    fn look(&self) {
        let since = self.since.load(Ordering::Acquire);
        if since != 0 && u128::from(self.now().saturating_sub(since - 1)) > self.limit.as_millis() {
            self.late.store(true, Ordering::Release);
            kill(&mut lock(&self.child));
        }
    }
}

impl Process {
    /// Starts a process that answers on its standard output. What it prints on standard error is passed on under the name
    /// `library`.
    ///
    /// # Errors
    /// The system starts none.
    pub(super) fn start(command: &mut Command, library: &str, limit: Duration) -> io::Result<Self> {
        let kept = SURROUNDINGS.into_iter().filter_map(|name| Some((name, std::env::var_os(name)?)));
        let mut child = command
            .env_clear()
            .envs(kept)
            .current_dir("/")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C is for the host, which may want to ask once more.
            .process_group(0)
            .spawn()?;
        let (Some(to), Some(from), Some(prints)) = (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(io::Error::other("no pipes"));
        };
        let state = Arc::new(State {
            child: Mutex::new(child),
            born: Instant::now(),
            since: AtomicU64::new(0),
            limit,
            late: AtomicBool::new(false),
        });
        let watched = Arc::downgrade(&state);
        thread::Builder::new().name("odyn glass".into()).spawn(move || watch(&watched))?;
        let library = library.to_string();
        let prints = thread::Builder::new().name("odyn prints".into()).spawn(move || pass_on(&library, prints))?;
        lock(&PRINTS).push((Arc::downgrade(&state), prints));
        Ok(Self { state, pipes: Mutex::new(Pipes { to, from, buffer: Vec::new(), gone: None }) })
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// What became of the process, now or earlier.
    pub(super) fn ask<T: DeserializeOwned>(&self, request: &Request<'_>) -> Result<T, Gone> {
        let mut pipes = lock(&self.pipes);
        if let Some(gone) = &pipes.gone {
            return Err(gone.clone());
        }
        let Pipes { to, from, buffer, .. } = &mut *pipes;
        self.state.since.store(self.state.now() + 1, Ordering::Release);
        // Who broke earlier can't be sent anything, but may have left a word.
        let _ = send(to, request);
        let answer = receive(from, buffer);
        self.state.since.store(0, Ordering::Release);
        answer.map_err(|lost| {
            let instance = if let Lost::Broken(instance) = lost { Some(instance as usize) } else { None };
            let gone = Gone { message: self.end(&lost, request.function()), instance };
            pipes.gone = Some(gone.clone());
            gone
        })
    }

    /// Whether it can't be asked any more.
    pub(super) fn is_gone(&self) -> bool {
        lock(&self.pipes).gone.is_some()
    }

    /// Sees the process off, and says what became of it.
    fn end(&self, lost: &Lost, function: &str) -> String {
        let mut child = lock(&self.state.child);
        let ended = if matches!(lost, Lost::Nonsense) { None } else { last_moments(&mut child) };
        if ended.is_none() {
            kill(&mut child);
            let _ = child.wait();
        }
        if self.state.late.load(Ordering::Acquire) {
            return format!("{LATE} from `{function}` within {} s", self.state.limit.as_secs_f64());
        }
        match ended.map(|status| status.signal()) {
            None => format!("its code answered nonsense in `{function}`"),
            Some(None) => format!("{EXITED} in `{function}`, by `exit`"),
            Some(Some(libc::SIGKILL)) => format!("{EXITED} in `{function}`, or the system did for lack of memory"),
            Some(Some(libc::SIGSYS)) => format!(
                "{REACHED} in `{function}`, for the network, another process, or a file to change: that is for libraries \
                 that are trusted (`[plugins] trust`, --in-process)"
            ),
            Some(Some(signal)) => format!("{CRASHED} in `{function}`, {}", crash::words(signal)),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let mut child = lock(&self.state.child);
        kill(&mut child);
        let _ = child.wait();
    }
}

/// The threads that pass on what processes print, and these.
static PRINTS: Mutex<Vec<(Weak<State>, thread::JoinHandle<()>)>> = Mutex::new(Vec::new());

/// Ends all processes, and waits until what they printed is passed on; to be called where the program ends.
pub fn farewell() {
    let all = std::mem::take(&mut *lock(&PRINTS));
    for (state, _) in &all {
        if let Some(state) = state.upgrade() {
            let mut child = lock(&state.child);
            kill(&mut child);
            let _ = child.wait();
        }
    }
    // Somebody else may hold a pipe, where the system lets a library start processes.
    let begin = Instant::now();
    while all.iter().any(|(_, prints)| !prints.is_finished()) && begin.elapsed() < LAST_MOMENTS {
        thread::sleep(Duration::from_micros(50));
    }
}

/// Ends a process and what it has started, if anything. It may have ended by itself.
#[allow(unsafe_code)]
fn kill(child: &mut Child) {
    if matches!(child.try_wait(), Ok(None)) {
        // SAFETY: plain numbers; nobody has waited for the process, so its number is nobody else's.
        unsafe { libc::kill(-(child.id() as libc::pid_t), libc::SIGKILL) };
    }
}

/// The end of a process that has closed its pipe, or says that it ends; `None` where it does not come.
fn last_moments(child: &mut Child) -> Option<ExitStatus> {
    let begin = Instant::now();
    while begin.elapsed() < LAST_MOMENTS {
        if let Some(status) = child.try_wait().ok()? {
            return Some(status);
        }
        thread::sleep(Duration::from_millis(1));
    }
    None
}

fn watch(state: &Weak<State>) {
    while let Some(state) = state.upgrade() {
        state.look();
        drop(state);
        thread::sleep(LOOK);
    }
}

/// Prints what a library prints, a bounded number of lines without control characters, each with its name.
fn pass_on(library: &str, prints: impl Read) {
    let mut lines = BufReader::new(prints);
    let mut line = Vec::new();
    for count in 0.. {
        line.clear();
        match lines.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) if count > MOST_LINES => {}
            Ok(_) => {
                let text = String::from_utf8_lossy(&line);
                let text: String = text.trim_end().chars().filter(|c| !c.is_control() || *c == '\t').collect();
                let rest = if count == MOST_LINES { "... (the rest is left out)" } else { &*text };
                // Where nobody reads, nothing is lost.
                let _ = writeln!(io::stderr(), "`{library}` prints: {rest}");
            }
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of a shell that does this instead of answering.
    fn after(script: &str) -> String {
        let process = Process::start(Command::new("/bin/sh").args(["-c", script]), "it", Duration::from_millis(300));
        let process = process.expect("a shell");
        let said = process.ask::<()>(&Request::Record { set: 0, instance: 0 }).expect_err("no answer");
        assert!(process.is_gone());
        assert_eq!(process.ask::<()>(&Request::Describe { class: 0 }), Err(said.clone()));
        said.message
    }

    #[test]
    fn a_process_that_does_not_answer_is_named_with_the_reason() {
        assert_eq!(after("head -c 1 >/dev/null; exit 0"), "its code ended its process in `record`, by `exit`");
        assert_eq!(after("head -c 1 >/dev/null; sleep 100"), "its code did not come back from `record` within 0.3 s");
        assert!(after("kill -SEGV $$").starts_with("its code crashed in `record`, SIGSEGV"));
        assert_eq!(after("printf '\\376\\377\\377\\377'; sleep 100"), "its code answered nonsense in `record`");
        assert_eq!(after("printf '\\001\\000\\000\\000xyz'; sleep 100"), "its code answered nonsense in `record`");
        // Who closes the pipe, or says that it ends, but stays, is ended.
        for script in ["exec >&-; sleep 100", "printf '\\377\\377\\377\\377\\007\\000\\000\\000'; sleep 100"] {
            assert_eq!(after(script), "its code answered nonsense in `record`");
        }
    }
}
