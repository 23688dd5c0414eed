//! The other end: the program as a recorder, which loads one library and answers for it.

// Its own files are taken out of the way of the library's.
#![allow(unsafe_code)]

use std::borrow::Cow;
use std::collections::HashMap;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;

use element_api::abi::OpenError;
use element_api::recording::Recording;
use element_api::set::{Batch, CreateError, ElementClass, ElementSet, Fault, Wanted};

use super::message::{BROKEN, Lost, Opening, Request, receive, send};
use super::shut_in::{no_more_files, shut_in};
use crate::offer::Offer;
use crate::watchdog::Watchdog;
use crate::{crash, loader};

/// The only argument of a program that is to be a recorder.
pub(super) const WORD: &str = "--recorder-of-elements";

/// For the first line of `main`: when this program was started as a recorder, it is one, until the host does not need it any
/// more. `None` in all other cases.
#[must_use]
pub fn record_if_asked() -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    let asked = arguments.next().as_deref() == Some(OsStr::new(WORD)) && arguments.next().is_none();
    asked.then(|| match own_pipes().and_then(|(from, to)| serve(from, to)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    })
}

/// The pipes to the host, taken away from standard input and output: a library that reads finds nothing, and what it prints goes
/// to standard error.
fn own_pipes() -> io::Result<(File, File)> {
    let nothing = File::open("/dev/null")?;
    let pipes = (own(libc::STDIN_FILENO)?, own(libc::STDOUT_FILENO)?);
    // SAFETY: plain numbers of open files.
    let moved = unsafe {
        [libc::dup2(nothing.as_raw_fd(), libc::STDIN_FILENO), libc::dup2(libc::STDERR_FILENO, libc::STDOUT_FILENO)]
    };
    if moved.contains(&-1) { Err(io::Error::last_os_error()) } else { Ok(pipes) }
}

fn own(number: RawFd) -> io::Result<File> {
    // SAFETY: a plain number of an open file.
    let copy = unsafe { libc::fcntl(number, libc::F_DUPFD_CLOEXEC, 3) };
    if copy < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: a new number that nobody else has.
    Ok(unsafe { OwnedFd::from_raw_fd(copy) }.into())
}

/// Answers until nobody asks.
fn serve(mut from: File, mut to: File) -> io::Result<()> {
    let mut buffer = Vec::new();
    let (copy, is_fmu) = match receive(&mut from, &mut buffer) {
        Ok(Request::Open { copy }) => (copy, false),
        Ok(Request::OpenFmu { folder }) => (folder, true),
        _ => return Err(io::ErrorKind::InvalidInput.into()),
    };
    crash::report_to(&to, BROKEN);
    let files = shut_in(&copy);
    end_with_the_host(&from)?;
    let (mut library, opening) = if is_fmu { Library::open_fmu(&copy) } else { Library::open(&copy) };
    // An FMU reads its resources when it starts.
    if !files && !is_fmu {
        no_more_files();
    }
    send(&mut to, &opening)?;
    loop {
        match receive(&mut from, &mut buffer) {
            Ok(request) => library.answer(&request, &mut to)?,
            Err(Lost::Closed) => return Ok(()),
            Err(_) => return Err(io::ErrorKind::InvalidData.into()),
        }
        // SAFETY: writes out what the library printed by way of the C library.
        unsafe { libc::fflush(std::ptr::null_mut()) };
    }
}

/// Ends this process when the host has ended, also while the library is at work.
fn end_with_the_host(from: &File) -> io::Result<()> {
    let fd = from.as_raw_fd();
    thread::Builder::new().stack_size(64 << 10).spawn(move || {
        let mut closed = libc::pollfd { fd, events: 0, revents: 0 };
        // SAFETY: one struct, which lives on; `_exit` may be called at any time.
        unsafe {
            while libc::poll(&raw mut closed, 1, -1) < 1 {}
            libc::_exit(0);
        }
    })?;
    Ok(())
}

/// A library, and the sets of its elements.
struct Library {
    /// Looks at the floating-point control register around each call.
    watchdog: Watchdog,
    package: String,
    offers: Vec<Arc<Offer>>,
    classes: HashMap<u32, Arc<dyn ElementClass>>,
    sets: HashMap<u32, Box<dyn ElementSet>>,
    /// Sets so far.
    count: u32,
}

impl Library {
    fn open(copy: &Path) -> (Self, Opening) {
        let (package, offers, kept) = match crate::read_manifest(copy) {
            Ok(manifest) => {
                let (offers, kept) = loader::enter(copy, copy, &manifest);
                (manifest.package, offers, kept)
            }
            Err(error) => (String::new(), Err(OpenError::Root(error.to_string())), true),
        };
        let (offers, opened) = match offers {
            Ok(offers) => (offers, Ok(())),
            Err(error) => (Vec::new(), Err(error)),
        };
        let (classes, sets) = (HashMap::new(), HashMap::new());
        (Self { watchdog: Watchdog::alone(), package, offers, classes, sets, count: 0 }, Opening { opened, kept })
    }

    fn open_fmu(folder: &Path) -> (Self, Opening) {
        let class = odyn_fmu::Fmu::unpacked(folder).and_then(|fmu| fmu.class());
        let (offers, opened) = match class {
            Ok(class) => (vec![Arc::new(Offer::of(class))], Ok(())),
            Err(error) => (Vec::new(), Err(OpenError::Root(error.message))),
        };
        let (classes, sets) = (HashMap::new(), HashMap::new());
        let library = Self { watchdog: Watchdog::alone(), package: "FMU".into(), offers, classes, sets, count: 0 };
        (library, Opening { opened, kept: true })
    }

    fn answer(&mut self, request: &Request<'_>, to: &mut impl Write) -> io::Result<()> {
        match request {
            Request::Open { .. } | Request::OpenFmu { .. } => Err(io::ErrorKind::InvalidInput.into()),
            Request::Describe { class } => send(to, &self.describe(*class)),
            Request::NewSet { class } => {
                let made = self.class(*class).map(|class| class.new_set());
                let made = made.map(|set| {
                    self.count += 1;
                    self.sets.insert(self.count, set);
                    self.count
                });
                send(to, &made)
            }
            Request::DropSet { set } => {
                self.sets.remove(set);
                send(to, &())
            }
            Request::Add { set, params } => send(to, &self.add(*set, params)),
            Request::Record { set, instance } => send(to, &self.record(*set, *instance)),
            Request::Evaluate { set, instances, inputs, jacobian, second, out } => {
                let mut out = Cow::clone(out);
                let wanted = Wanted { jacobian: *jacobian, second: *second };
                let batch = Batch { instances, inputs, wanted };
                let done = self.set(*set, 0).and_then(|set| set.evaluate(&batch, out.to_mut()));
                send(to, &done.map(|()| out))
            }
            Request::Accept { set, instance, inputs } => {
                let instance = *instance as usize;
                send(to, &self.set(*set, instance).and_then(|set| set.accept(instance, inputs)))
            }
            Request::Communicate { set, instance, t, begins, memory } => {
                let (instance, mut memory) = (*instance as usize, Cow::clone(memory));
                let done = self.set(*set, instance);
                let done = done.and_then(|set| set.communicate(instance, *t, *begins, memory.to_mut()));
                send(to, &done.map(|()| memory))
            }
            Request::Save { set, instance } => {
                let instance = *instance as usize;
                send(to, &self.set(*set, instance).and_then(|set| set.save(instance)))
            }
            Request::Load { set, instance, memory } => {
                let instance = *instance as usize;
                send(to, &self.set(*set, instance).and_then(|set| set.load(instance, memory)))
            }
        }
    }

    fn class(&mut self, number: u32) -> Result<Arc<dyn ElementClass>, String> {
        if let Some(class) = self.classes.get(&number) {
            return Ok(Arc::clone(class));
        }
        let offer = self.offers.get(number as usize).ok_or("there is no such class")?;
        let class = Arc::clone(offer.class().map_err(|error| error.to_string())?);
        let class = self.watchdog.class(&self.package, class, false);
        self.classes.insert(number, Arc::clone(&class));
        Ok(class)
    }

    fn describe(&mut self, number: u32) -> Result<String, String> {
        toml::to_string(self.class(number)?.descriptor()).map_err(|error| error.to_string())
    }

    fn set(&mut self, number: u32, instance: usize) -> Result<&mut dyn ElementSet, Fault> {
        match self.sets.get_mut(&number) {
            Some(set) => Ok(&mut **set),
            None => Err(Fault { instance, message: "there is no such set".into() }),
        }
    }

    fn add(&mut self, set: u32, params: &str) -> Result<u32, CreateError> {
        let params = toml::from_str(params).map_err(|error| CreateError::Fault(error.to_string()))?;
        let set = self.set(set, 0).map_err(|fault| CreateError::Fault(fault.message))?;
        set.add(&params).map(|number| number as u32)
    }

    fn record(&mut self, set: u32, instance: u32) -> Result<Recording, Fault> {
        let instance = instance as usize;
        self.set(set, instance)?.record(instance)
    }
}
