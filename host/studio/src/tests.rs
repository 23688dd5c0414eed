//! The studio as a browser, and as whoever is not meant, meets it.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use odyn_desk::Scripts;
use serde_json::Value;

use super::*;

/// Two bodies without any library.
const FALL: &str = "[simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.5\noutput_step = 0.1\n\
    [[body]]\nname = \"ball\"\nmass = 1\ninertia = [1, 1, 1]\n\
    [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"ball\"\ncomponent = \"z\"\n";

/// A studio that serves until it is dropped.
struct Serving {
    address: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    folder: tempfile::TempDir,
}

impl Serving {
    /// `None` where this build has no scripts.
    fn start(text: Option<&str>) -> Option<Self> {
        if Scripts::studio().is_empty() {
            eprintln!("skipped: built without the scripts of the studio");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        if let Some(text) = text {
            fs::write(&path, text).unwrap();
        }
        let studio = Studio::start(Settings { scene: Some(path), ..Settings::default() }).unwrap();
        let address = studio.address();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = Some(std::thread::spawn(move || studio.serve(&flag)));
        Some(Self { address, stop, thread, folder })
    }

    fn port(&self) -> &str {
        self.address.split([':', '/']).nth(4).unwrap()
    }

    fn token(&self) -> &str {
        self.address.split('=').nth(1).unwrap()
    }

    fn scene(&self) -> PathBuf {
        self.folder.path().join("scene.toml")
    }

    /// Sends a request with these headers; gives status and body.
    fn raw(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port().parse().unwrap())).unwrap();
        let mut text = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
        for (name, value) in headers {
            text.push_str(&format!("{name}: {value}\r\n"));
        }
        stream.write_all(format!("{text}\r\n{body}").as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
        (status, answer.split_once("\r\n\r\n").unwrap().1.to_owned())
    }

    /// As the page asks.
    fn ask(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        let host = format!("127.0.0.1:{}", self.port());
        self.raw(method, path, &[("Host", &host), ("X-Odyn-Token", self.token())], body)
    }

    fn json(&self, method: &str, path: &str, body: &str) -> Value {
        let (status, text) = self.ask(method, path, body);
        assert_eq!(status, 200, "{text}");
        serde_json::from_str(&text).unwrap()
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

#[test]
fn only_the_own_page_with_its_token_is_answered() {
    let Some(studio) = Serving::start(Some(FALL)) else { return };
    let (host, token) = (format!("127.0.0.1:{}", studio.port()), studio.token());
    let ask = |headers: &[(&str, &str)], path: &str| studio.raw("GET", path, headers, "").0;
    let own = ("Host", host.as_str());
    let known = ("X-Odyn-Token", token);
    assert_eq!(ask(&[own, known], "/api/scene"), 200);
    assert_eq!(ask(&[own], &format!("/?token={token}")), 200);
    assert_eq!(ask(&[own], "/studio.js"), 200);
    for path in ["/", "/api/scene", "/api/elements", "/?token=", "/api/scene?token=0123456789abcdef0123456789abcdef"] {
        assert_eq!(ask(&[own], path), 403, "{path}");
    }
    assert_eq!(ask(&[own, ("X-Odyn-Token", "0123456789abcdef0123456789abcdef")], "/api/scene"), 403);
    // A page of another origin, even one that got hold of the token; a foreign name that leads to this machine.
    for origin in ["http://example.org", "null", "http://127.0.0.1:1", "https://127.0.0.1"] {
        assert_eq!(ask(&[own, known, ("Origin", origin)], "/api/scene"), 403, "{origin}");
    }
    assert_eq!(ask(&[own, known, ("Origin", &format!("http://{host}"))], "/api/scene"), 200);
    for name in ["example.org", "example.org:80", "127.0.0.1"] {
        assert_eq!(ask(&[("Host", name), known], "/api/scene"), 403, "{name}");
    }
    assert_eq!(ask(&[own, known], "/etc/passwd"), 404);
    // Requests that change something need the same.
    assert_eq!(studio.raw("POST", "/api/save?version=", &[own], "x").0, 403);
    assert_eq!(fs::read_to_string(studio.scene()).unwrap(), FALL);
}

/// What whoever is on the machine may send: the studio takes no more room than it is sent, and stays.
#[test]
fn lengths_that_are_only_announced_cost_nothing() {
    let Some(studio) = Serving::start(Some(FALL)) else { return };
    let host = format!("127.0.0.1:{}", studio.port());
    let send = |text: String| {
        let mut stream = TcpStream::connect(&host).unwrap();
        stream.write_all(text.as_bytes()).unwrap();
        stream
    };
    let token = format!("X-Odyn-Token: {}\r\n", studio.token());
    for (known, length, status) in [
        ("", "999999999999", "403"),
        ("", "18446744073709551615", "403"),
        (token.as_str(), "999999999999", "413"),
        (token.as_str(), "18446744073709551615", "413"),
        (token.as_str(), "18446744073709551616", "400"),
        ("", "-1", "400"),
    ] {
        let request = format!("POST /api/check HTTP/1.1\r\nHost: {host}\r\n{known}Content-Length: {length}\r\n\r\nabc");
        // One that leaves at once, and one that waits for the answer.
        drop(send(request.clone()));
        let mut stream = send(request);
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).unwrap();
        assert_eq!(String::from_utf8_lossy(&answer), format!("HTTP/1.1 {status}"), "{length}");
    }
    let endless = send(format!("GET / HTTP/1.1\r\nX: {}", "x".repeat(70_000)));
    let idle: Vec<TcpStream> = (0..8).map(|_| send(String::new())).collect();
    // A text that fits is taken, and one that is cut short is not.
    assert_eq!(studio.ask("POST", "/api/check", FALL).0, 200);
    let short = send(format!("POST /api/save?version= HTTP/1.1\r\nHost: {host}\r\n{token}Content-Length: 9\r\n\r\nx"));
    short.shutdown(std::net::Shutdown::Write).unwrap();
    let mut answer = String::new();
    (&short).read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 400") && answer.ends_with("shorter than announced"), "{answer}");
    assert_eq!(fs::read_to_string(studio.scene()).unwrap(), FALL);
    drop((endless, idle));
}

#[test]
fn a_mistake_has_its_place_and_a_scene_its_picture() {
    let Some(studio) = Serving::start(Some(FALL)) else { return };
    // Offsets count as browsers do: the letter before it takes two units.
    let wrong = format!("# \u{1F600}\n{}", FALL.replace("mass = 1", "mas = 1"));
    let answer = studio.json("POST", "/api/check", &wrong);
    assert_eq!(answer["ok"], false);
    let message = answer["messages"].as_array().unwrap().iter().find(|m| m["line"] == 8).unwrap();
    let at = wrong.encode_utf16().collect::<Vec<_>>();
    let range = message["from"].as_u64().unwrap() as usize..message["to"].as_u64().unwrap() as usize;
    assert_eq!(String::from_utf16(&at[range]).unwrap(), "mas");
    let answer = studio.json("POST", "/api/check", &FALL.replace("inertia", "position = [1, 2, 3]\ninertia"));
    assert_eq!((&answer["ok"], &answer["mobility"]), (&Value::from(true), &Value::from(6)));
    assert_eq!(answer["picture"]["poses"][0], serde_json::json!([1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]));
    assert!(answer["plan"].as_str().unwrap().contains("ball floats"), "{}", answer["plan"]);
}

#[test]
fn runs_are_made_in_the_background_and_can_be_compared() {
    let Some(studio) = Serving::start(Some(FALL)) else { return };
    let mut last = Value::Null;
    for text in [FALL.to_owned(), FALL.replace("-9.81", "-1.62")] {
        let number = studio.json("POST", "/api/run", &text)["run"].as_u64().unwrap();
        last = loop {
            let state = studio.json("GET", &format!("/api/run/{number}"), "");
            if state["done"] == true {
                break state;
            }
        };
        assert_eq!(last["end"]["status"], "completed", "{last}");
    }
    assert_eq!(last["end"]["sound"], true);
    assert_eq!(studio.ask("GET", "/api/data/2,1", "").0, 200);
    let (status, report) = studio.ask("GET", "/api/report/2,1", "");
    assert!(status == 200 && report.contains("Run 2") && report.contains("Run 1"));
    // It has the texts that were run, which the file has not.
    assert!(report.contains("-1.62") && !report.contains("changed since"), "{report}");
    assert_eq!(studio.ask("GET", "/api/data/77", "").0, 404);
    let refused = studio.json("POST", "/api/run", "nonsense")["run"].as_u64().unwrap();
    let end = loop {
        let state = studio.json("GET", &format!("/api/run/{refused}"), "");
        if state["done"] == true {
            break state["end"].clone();
        }
    };
    assert_eq!((&end["ok"], &end["messages"][0]["line"]), (&Value::from(false), &Value::from(1)));
}

#[test]
fn a_long_run_is_stopped_and_its_rows_are_kept() {
    let Some(studio) = Serving::start(Some(FALL)) else { return };
    let long =
        FALL.replace("t_end = 0.5", "t_end = 1e5\nmax_step = 1e-3").replace("output_step = 0.1", "output_step = 1");
    let number = studio.json("POST", "/api/run", &long)["run"].as_u64().unwrap();
    let state = || studio.json("GET", &format!("/api/run/{number}"), "");
    while state()["share"].as_f64().unwrap() == 0.0 {}
    studio.json("POST", &format!("/api/run/{number}/stop"), "");
    let end = loop {
        let state = state();
        if state["done"] == true {
            break state["end"].clone();
        }
    };
    assert_eq!(end["status"], "stopped early", "{end}");
    assert_eq!(studio.ask("GET", &format!("/api/data/{number}"), "").0, 200);
}

#[test]
fn texts_are_saved_whole_and_never_over_another_s() {
    let Some(studio) = Serving::start(None) else { return };
    let scene = studio.json("GET", "/api/scene", "");
    // A file that does not exist begins as a scene that runs, and is written only when it is saved.
    assert!(!studio.scene().exists());
    assert_eq!(scene["version"], "");
    let save = |version: &str, text: &str| studio.ask("POST", &format!("/api/save?version={version}"), text);
    let (status, answer) = save("", FALL);
    assert_eq!(status, 200, "{answer}");
    let version = serde_json::from_str::<Value>(&answer).unwrap()["version"].as_str().unwrap().to_owned();
    assert_eq!(fs::read_to_string(studio.scene()).unwrap(), FALL);
    // A second tab that read the same version, and one that never read it.
    assert_eq!(save(&version, "second = 1").0, 200);
    let (status, answer) = save(&version, "third = 1");
    assert_eq!(status, 409);
    assert_eq!(serde_json::from_str::<Value>(&answer).unwrap()["text"], "second = 1");
    assert_eq!(save("", "fourth = 1").0, 409);
    assert_eq!(fs::read_to_string(studio.scene()).unwrap(), "second = 1");
    // Nothing is left beside it.
    assert_eq!(fs::read_dir(studio.folder.path()).unwrap().count(), 1);
}

#[test]
fn the_scene_that_a_new_file_begins_with_has_every_key_it_needs() {
    let text = include_str!("new.toml");
    let scene = odyn_run::session::Session::open_text(&PathBuf::from("new.toml"), text.into(), &Default::default());
    // Where its libraries are not found, that is all that is wrong.
    let Err(error) = scene else { return };
    assert!(error.diagnostics.iter().all(|d| d.code.code == "ODY0401"), "{error}");
}
