//! [`Studio`]: requests and answers.
//!
//! | request | answer |
//! |---|---|
//! | `GET /` | the page |
//! | `GET /studio.js` | its scripts |
//! | `GET /api/scene` | text, path and version of the file |
//! | `GET /api/elements` | what can be inserted; the schema of scenes |
//! | `POST /api/check` | what the solver says of the text sent |
//! | `POST /api/save?version=` | saves the text sent |
//! | `POST /api/run` | begins a run of the text sent |
//! | `GET /api/run/N` | how far it is, or how it ended |
//! | `POST /api/run/N/stop` | ends it after its step |
//! | `GET /api/data/N,M` | tables and motions of runs |
//! | `GET /api/report/N,M` | their report |

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use odyn_catalog::SearchPath;
use odyn_desk::Scripts;
use odyn_desk::page::html::page_under;
use odyn_diagnostics::{Diagnostic, codes};
use odyn_run::session::RunOptions;
use serde_json::{Value, json};

use crate::check::check;
use crate::elements::elements;
use crate::file::{NotSaved, SceneFile};
use crate::guard::{Guard, Refusal};
use crate::http::{Answer, PAUSE, Request};
use crate::runs::Runs;

/// Connections that are open at the same time; browsers open six.
const CONNECTIONS: usize = 64;
/// What the page may load: its own scripts and answers.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'";

/// What a studio is started with.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// The scene file, which need not exist; none: nothing can be saved.
    pub scene: Option<PathBuf>,
    /// The port; 0: any that is free.
    pub port: u16,
    /// How scenes are opened.
    pub options: RunOptions,
}

/// A server that listens already.
pub struct Studio {
    listener: TcpListener,
    guard: Guard,
    file: SceneFile,
    runs: Runs,
    options: RunOptions,
}

impl Answer {
    fn json(value: &Value) -> Self {
        Self { status: 200, kind: "application/json", body: value.to_string() }
    }

    fn html(body: String) -> Self {
        Self { status: 200, kind: "text/html; charset=utf-8", body }
    }
}

impl Studio {
    /// Listens on the loopback address.
    ///
    /// # Errors
    /// No port is free, or that asked for is taken; no folder for results; this copy was built without the scripts of the page.
    pub fn start(settings: Settings) -> Result<Self, Diagnostic> {
        if Scripts::studio().is_empty() {
            let message = "this copy of odyn was built without the scripts of the studio";
            let help = "install Node.js with npm, unset ODYN_DESK, and build again with a connection to the network";
            return Err(Diagnostic::error(codes::NO_STUDIO, message).help(help));
        }
        let cannot = |what: &dyn std::fmt::Display| {
            let help = "name a port that is free with --port, or leave it out";
            Diagnostic::error(codes::NO_STUDIO, format!("the studio cannot be started: {what}")).help(help)
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, settings.port)).map_err(|error| cannot(&error))?;
        let port = listener.local_addr().map_err(|error| cannot(&error))?.port();
        let guard = Guard::new(port).map_err(|error| cannot(&error))?;
        let runs = Runs::new().map_err(|error| cannot(&error))?;
        let studio = Self { listener, guard, file: SceneFile::new(settings.scene), runs, options: settings.options };
        // A file that cannot be read is reported before a page shows something else in its place.
        studio.file.read()?;
        Ok(studio)
    }

    /// The address with the token, to be opened in a browser.
    #[must_use]
    pub fn address(&self) -> String {
        self.guard.address()
    }

    /// Answers until the flag is raised.
    pub fn serve(&self, stop: &AtomicBool) {
        let open = AtomicUsize::new(0);
        thread::scope(|scope| {
            scope.spawn(|| {
                for stream in self.listener.incoming() {
                    if stop.load(Ordering::Relaxed) {
                        break;
                    }
                    let Ok(stream) = stream else {
                        // Such as too many open files: those that are open end.
                        thread::sleep(PAUSE);
                        continue;
                    };
                    if open.load(Ordering::Relaxed) < CONNECTIONS {
                        open.fetch_add(1, Ordering::Relaxed);
                        scope.spawn(|| {
                            self.take(stream, stop);
                            open.fetch_sub(1, Ordering::Relaxed);
                        });
                    }
                }
            });
            while !stop.load(Ordering::Relaxed) {
                thread::sleep(PAUSE);
            }
            // Whoever waits for a connection gets one.
            let _ = self.listener.local_addr().and_then(TcpStream::connect);
        });
        self.runs.stop_all();
    }

    fn take(&self, stream: TcpStream, stop: &AtomicBool) {
        // A defect met in one request leaves the others answered.
        let answer =
            || Request::read(&stream, stop).map_or_else(|refused| refused, |request| Some(self.judged(request)));
        let answer = std::panic::catch_unwind(std::panic::AssertUnwindSafe(answer)).unwrap_or_else(|_| {
            let words = "A defect of the program was met; the terminal of `odyn studio` has more. Please report it.";
            Some(Answer::refused(500, words))
        });
        if let Some(answer) = answer {
            answer.send(&stream, stop);
        }
    }

    fn judged(&self, mut request: Request<'_>) -> Answer {
        let url = request.url.clone();
        let (path, query) = url.split_once('?').unwrap_or((&url, ""));
        match self.guard.judge(&request, query) {
            // The scripts are no secret, and pages load them without a token.
            Err(Refusal::Token) if path == "/studio.js" => self.answer(&mut request, path, query),
            Err(refusal) => Answer::refused(403, refusal.words()),
            Ok(()) => self.answer(&mut request, path, query),
        }
    }

    fn answer(&self, request: &mut Request<'_>, path: &str, query: &str) -> Answer {
        let parts: Vec<&str> = path.trim_matches('/').split('/').collect();
        let found = match (request.method.as_str(), parts.as_slice()) {
            ("GET", [""]) => {
                let body = "<div id=\"studio\"></div>\n<script src=\"/studio.js\"></script>\n";
                Some(Answer::html(page_under(POLICY, "O-DYN studio", body, "studio")))
            }
            ("GET", ["studio.js"]) => {
                Some(Answer { status: 200, kind: "text/javascript; charset=utf-8", body: Scripts::studio().into() })
            }
            ("GET", ["api", "scene"]) => Some(self.scene()),
            ("GET", ["api", "elements"]) => Some(Answer::json(&elements(&self.search(), &self.options))),
            ("GET", ["api", "run", number]) => {
                numbers(number).and_then(|numbers| self.runs.state(*numbers.first()?)).map(|state| Answer::json(&state))
            }
            ("GET", ["api", "data", list]) => numbers(list)
                .and_then(|numbers| self.runs.data(&numbers))
                .map(|body| Answer { status: 200, kind: "text/plain", body }),
            ("GET", ["api", "report", list]) => {
                numbers(list).and_then(|numbers| self.runs.report(&numbers)).map(Answer::html)
            }
            ("POST", ["api", "run", number, "stop"]) => {
                numbers(number).and_then(|numbers| self.runs.stop(*numbers.first()?)).map(|()| Answer::json(&json!({})))
            }
            ("POST", ["api", what @ ("check" | "save" | "run")]) => {
                let what = (*what).to_owned();
                Some(request.text().map_or_else(|refused| refused, |text| self.with_text(&what, text, query)))
            }
            _ => None,
        };
        found.unwrap_or_else(|| Answer::refused(404, "There is nothing here."))
    }

    fn with_text(&self, what: &str, text: String, query: &str) -> Answer {
        match what {
            "check" => Answer::json(&check(self.file.place(), &text, &self.options)),
            "run" => Answer::json(&json!({ "run": self.runs.begin(self.file.place(), text, &self.options) })),
            _ => {
                let version = query.split('&').find_map(|part| part.strip_prefix("version=")).unwrap_or_default();
                match self.file.save(&text, version) {
                    Ok(version) => Answer::json(&json!({ "version": version })),
                    Err(NotSaved::Changed(now)) => {
                        Answer { status: 409, ..Answer::json(&json!({ "text": now.text, "version": now.version })) }
                    }
                    Err(NotSaved::Failed(words)) => Answer::refused(500, words),
                }
            }
        }
    }

    fn scene(&self) -> Answer {
        let path = self.file.path();
        match self.file.read() {
            Ok(content) => Answer::json(&json!({
                "path": path.map(|path| path.display().to_string()),
                "text": content.text,
                "version": content.version,
            })),
            Err(diagnostic) => Answer::refused(500, diagnostic.message),
        }
    }

    fn search(&self) -> SearchPath {
        let folder = self.file.place().parent().unwrap_or(std::path::Path::new(""));
        SearchPath::for_scene(&self.options.plugins, &[], folder)
    }
}

/// Numbers of runs, with commas between them.
fn numbers(list: &str) -> Option<Vec<u64>> {
    list.split(',').map(|number| number.parse().ok()).collect()
}
