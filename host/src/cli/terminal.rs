//! Colours, printing, the progress bar and what stands in its place before there is progress to show.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use odyn::diagnostics::shown;
use serde::Serialize;

/// Runs that are over sooner show no bar.
const PATIENCE: Duration = Duration::from_millis(300);
/// Parts of a whole bar.
const PARTS: u64 = 1000;

/// Standard output as it was at the start, for what the program promises to write there.
static OUTPUT: OnceLock<File> = OnceLock::new();

/// Keeps standard output to this program: from here on [`print`] alone writes to it, and what anybody else prints, a library
/// above all, goes to standard error. Where that cannot be had (not on Unix, or no descriptors left), all is as before.
pub(super) fn reserve_output() {
    #[cfg(unix)]
    reserve();
}

// Exchanging a file descriptor can't be expressed safely.
#[cfg(unix)]
#[allow(unsafe_code)]
fn reserve() {
    use std::os::fd::{AsFd, AsRawFd};
    let Ok(kept) = io::stdout().as_fd().try_clone_to_owned() else { return };
    // SAFETY: both are descriptors of this process; nothing owns the number of standard output.
    if unsafe { libc::dup2(io::stderr().as_raw_fd(), io::stdout().as_raw_fd()) } >= 0 {
        let _ = OUTPUT.set(File::from(kept));
    }
}

/// Where a text goes.
#[derive(Clone, Copy)]
pub(super) enum Stream {
    /// Results.
    Output,
    /// Everything else.
    Error,
}

/// Whether colours are wanted: on a terminal that has some, unless `NO_COLOR` is set (no-color.org).
pub(super) fn color(stream: Stream) -> bool {
    let terminal = match stream {
        Stream::Output => OUTPUT.get().map_or_else(|| io::stdout().is_terminal(), File::is_terminal),
        Stream::Error => io::stderr().is_terminal(),
    };
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    terminal && !refused && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Writes to standard output. What others have put into the text (scenes, libraries, tables) is shown, not obeyed.
pub(super) fn print(text: &str) -> io::Result<()> {
    print_as_it_is(&shown(text))
}

/// Writes to standard output what is for programs, or is painted and has been made fit for terminals. A reader that has seen
/// enough (`odyn ... | head`) is no error.
pub(super) fn print_as_it_is(text: &str) -> io::Result<()> {
    let written = match OUTPUT.get() {
        Some(mut file) => file.write_all(text.as_bytes()),
        None => {
            let mut out = io::stdout().lock();
            out.write_all(text.as_bytes()).and_then(|()| out.flush())
        }
    };
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// The answer of a command: for programs, for people, or for nobody.
pub(super) fn answer(for_programs: bool, quiet: bool, json: &str, text: impl FnOnce() -> String) -> io::Result<()> {
    match (for_programs, quiet) {
        (true, _) => print_as_it_is(json),
        (false, true) => Ok(()),
        (false, false) => print(&text()),
    }
}

/// Indented JSON with a newline at the end, of plain structs.
pub(super) fn json<T: Serialize>(value: &T) -> String {
    let mut text = serde_json::to_string_pretty(value).expect("plain structs with text keys have a JSON form");
    text.push('\n');
    text
}

/// A line on standard error that says what is being prepared and for how long, until it is dropped; nothing where that is soon, or
/// standard error is no terminal.
pub(super) struct Preparing {
    /// Its end wakes the thread that shows the line.
    end: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Preparing {
    pub(super) fn new(what: &'static str) -> Self {
        if !io::stderr().is_terminal() {
            return Self { end: None };
        }
        let (end, ended) = mpsc::channel();
        let show = move || {
            if ended.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
                return;
            }
            let style = ProgressStyle::with_template("{spinner} {msg}: {elapsed}");
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr())
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
                .with_message(what);
            bar.enable_steady_tick(PATIENCE);
            let _ = ended.recv();
            bar.finish_and_clear();
        };
        Self { end: Some((end, thread::spawn(show))) }
    }
}

impl Drop for Preparing {
    fn drop(&mut self) {
        if let Some((end, thread)) = self.end.take() {
            drop(end);
            let _ = thread.join();
        }
    }
}

/// A bar on standard error, once a run has taken a while; nothing where that is no terminal.
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub(super) fn new() -> Self {
        let style = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(PARTS), ProgressDrawTarget::hidden()).with_style(style);
        Self { bar }
    }

    /// What receives the share of the run that is done, 0 to 1, after each step.
    pub(super) fn listener(&self) -> Box<dyn FnMut(f64) + Send> {
        let bar = self.bar.clone();
        let started = Instant::now();
        let mut shown = false;
        Box::new(move |share: f64| {
            if !shown && started.elapsed() > PATIENCE {
                shown = true;
                bar.set_draw_target(ProgressDrawTarget::stderr());
            }
            if shown {
                bar.set_position((share.clamp(0.0, 1.0) * PARTS as f64) as u64);
            }
        })
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// As a word of a shell.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A path in a command that is shown.
pub(super) fn word_of(path: &Path) -> String {
    quoted(&path.display().to_string())
}
