//! `odyn hil` and somebody on the other side: what is sent is what was computed, what comes is what drives, and what is late is counted.
#![cfg(all(feature = "cli", unix))]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod support;

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::net::UdpSocket;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use support::{Scratch, root};

/// A wheel of 2 kg m^2 about a fixed axis, driven by a torque from outside.
const WHEEL: &str = r#"
[units]
angle = "deg"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 1
output_step = 0.1
[[input]]
name = "torque"
unit = "N m"
value = 0
[[body]]
name = "wheel"
mass = 1
inertia = [1, 1, 2]
[[joint]]
name = "axle"
type = "revolute"
bodies = ["ground", "wheel"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "wheel"]
axis = [0, 0, 1]
inputs = { signal = "torque" }
[[output]]
name = "speed"
quantity = "coordinate_rate"
of = "axle"
[[output]]
name = "angle"
quantity = "coordinate"
of = "axle"
"#;

struct Running {
    child: Child,
    said: BufReader<std::process::ChildStderr>,
    /// What it says first: where it is.
    head: String,
}

fn start(scratch: &Scratch, line: &str) -> Running {
    let mut command = scratch.command(line);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut head = String::new();
    while !head.contains("signature") {
        head.clear();
        assert!(said.read_line(&mut head).unwrap() > 0, "it ended");
    }
    Running { child, said, head }
}

impl Running {
    fn port(&self) -> u16 {
        let port = self.head.split("127.0.0.1:").nth(1).unwrap().split(':').next().unwrap();
        port.parse().unwrap()
    }

    /// Exit code, standard output, the rest of standard error.
    fn end(mut self) -> (Option<i32>, String, String) {
        let (mut out, mut err) = (String::new(), String::new());
        self.child.stdout.take().unwrap().read_to_string(&mut out).unwrap();
        self.said.read_to_string(&mut err).unwrap();
        (self.child.wait().unwrap().code(), out, err)
    }
}

fn packet(number: u64, signature: u32, values: &[f64]) -> Vec<u8> {
    let mut bytes = b"ODYN\x01\0\x01\0".to_vec();
    bytes.extend(number.to_le_bytes());
    bytes.extend(0.0_f64.to_le_bytes());
    bytes.extend((values.len() as u32).to_le_bytes());
    bytes.extend(signature.to_le_bytes());
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

fn number(bytes: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

fn report(scratch: &Scratch, folder: &str) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(scratch.0.join(folder).join("hil.json")).unwrap()).unwrap()
}

#[test]
fn what_is_sent_is_what_was_computed() {
    let scratch = Scratch::new("hil-udp");
    scratch.file("wheel.toml", WHEEL);
    let running = start(&scratch, "hil wheel.toml --rate 200Hz --udp 0 --wait --for 0.5s -o out");
    let signature =
        u32::from_str_radix(running.head.split("signature ").nth(1).unwrap().split(';').next().unwrap(), 16);
    let signature = signature.unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    socket.connect(("127.0.0.1", running.port())).unwrap();
    // Five that are none: nonsense, another signature, another number of values, not finite, cut short.
    let good = packet(1, signature, &[3.0]);
    for bad in [
        b"hello".to_vec(),
        packet(1, signature ^ 1, &[9.0]),
        packet(1, 0, &[9.0, 9.0]),
        packet(1, 0, &[f64::NAN]),
        good[..36].to_vec(),
    ] {
        socket.send(&bad).unwrap();
    }
    std::thread::sleep(Duration::from_millis(50));
    socket.send(&good).unwrap();
    let mut buffer = [0; 100];
    for tick in 0..=100_u64 {
        let length = socket.recv(&mut buffer).unwrap();
        assert_eq!((length, &buffer[..8]), (32 + 16, &b"ODYN\x01\0\x02\0"[..]));
        assert_eq!(u64::from_le_bytes(buffer[8..16].try_into().unwrap()), tick);
        assert_eq!(u32::from_le_bytes(buffer[28..32].try_into().unwrap()), signature);
        // 3 N m on 2 kg m^2.
        let (time, speed, angle) = (number(&buffer, 16), number(&buffer, 32), number(&buffer, 40));
        assert!((time - tick as f64 * 0.005).abs() < 1e-12, "{time}");
        assert!((speed - (1.5 * time).to_degrees()).abs() < 1e-9, "{speed}");
        assert!((angle - (0.75 * time * time).to_degrees()).abs() < 1e-9, "{angle}");
    }
    let (code, out, err) = running.end();
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("100 ticks of 5000 us") && out.contains("operations each"), "{out}");
    assert_eq!(out, fs::read_to_string(scratch.0.join("out/hil.txt")).unwrap());
    let report = report(&scratch, "out");
    assert_eq!(
        (&report["steps"], &report["packets_received"], &report["packets_refused"]),
        (&100.into(), &6.into(), &5.into())
    );
    // The one that came before the start counts for no tick: all of them held what they had.
    assert_eq!(
        (&report["inputs_held"], &report["packets_sent"], &report["interrupted"]),
        (&100.into(), &101.into(), &false.into())
    );
    assert!(report["compute"]["count"] == 100 && report["compute"]["worst_us"].as_f64().unwrap() > 0.0);
    assert!(report["overruns"].as_u64().unwrap() <= 100);
}

#[test]
fn a_slow_machine_is_told_and_nothing_is_left_out() {
    let scratch = Scratch::new("hil-slow");
    scratch.file("wheel.toml", WHEEL);
    // Ten thousand steps within 100 us: no machine does that.
    let running = start(&scratch, "hil wheel.toml --rate 10kHz --substeps 10000 --udp 0 --for 1ms -o out --json");
    let (code, out, err) = running.end();
    assert_eq!(code, Some(0), "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&report["steps"], &report["overruns"]), (&10.into(), &10.into()), "{report}");
    assert!(report["worst_behind_us"].as_f64().unwrap() > 1000.0);
    assert!((report["reached_s"].as_f64().unwrap() - 1e-3).abs() < 1e-12);
    assert_eq!(report["packets_unsent"], 11);
}

#[test]
fn ctrl_c_ends_it_with_a_report() {
    let scratch = Scratch::new("hil-stop");
    scratch.file("wheel.toml", WHEEL);
    let running = start(&scratch, "hil wheel.toml --udp 0 --endless -o out");
    std::thread::sleep(Duration::from_millis(300));
    let id = running.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let (code, out, _) = running.end();
    assert_eq!(code, Some(130));
    assert!(out.contains("ended by Ctrl-C"), "{out}");
    let report = report(&scratch, "out");
    assert!(report["interrupted"] == true && report["steps"].as_u64().unwrap() > 10);
}

#[test]
fn what_cannot_run_in_time_is_refused() {
    let scratch = Scratch::new("hil-refused");
    scratch.file("wheel.toml", WHEEL);
    for (line, code, word) in [
        ("hil wheel.toml --udp 0 --rate 0Hz", 2, "above zero"),
        ("hil wheel.toml --udp 0 --rate 5m", 2, "expected"),
        ("hil wheel.toml --udp 127.0.0.1:notaport", 3, "ODY0854"),
        ("hil wheel.toml --shm a/b", 3, "ODY0854"),
        ("hil wheel.toml --udp 0 --inputs torqe", 3, "did you mean `torque`?"),
        ("hil wheel.toml", 2, "--udp"),
    ] {
        let output = scratch.command(line).output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line}: {err}");
        assert!(err.contains(word), "{line}: {err}");
    }
    let turning = "--set wheel.angular_velocity=[0,0,90]";
    let described = scratch.command(&format!("hil wheel.toml --describe --rate 500Hz {turning}")).output().unwrap();
    let described: serde_json::Value = serde_json::from_slice(&described.stdout).unwrap();
    assert_eq!((&described["inputs"][0]["name"], &described["inputs"][0]["unit"]), (&"torque".into(), &"N m".into()));
    assert_eq!((&described["outputs"][1]["unit"], &described["period_s"]), (&"deg".into(), &0.002.into()));
    assert!((described["outputs"][0]["start"].as_f64().unwrap() - 90.0).abs() < 1e-9, "{described}");
}

/// The example: a controller in Python holds a pendulum upright, by UDP and by shared memory.
#[test]
fn the_controller_in_python_holds_the_pendulum() {
    let python = "python3";
    if Command::new(python).arg("--version").output().is_err() {
        println!("left out: there is no `{python}`");
        return;
    }
    let (scene, controller) = (root().join("scenes/hil/cart.toml"), root().join("scenes/hil/controller.py"));
    let scratch = Scratch::new("hil-python");
    let name = format!("odyn-hil-{}", std::process::id());
    for link in ["--udp 0".to_string(), format!("--shm {name}")] {
        let line = format!("hil {} --rate 250Hz {link} --wait --for 4s -o out", scene.display());
        let running = start(&scratch, &line);
        let other = match link.starts_with("--udp") {
            true => vec!["--udp".to_string(), running.port().to_string()],
            false => vec!["--shm".to_string(), name.clone()],
        };
        let controller = Command::new(python).arg(&controller).args(other).output().unwrap();
        let said = String::from_utf8_lossy(&controller.stdout);
        assert!(controller.status.success(), "{}", String::from_utf8_lossy(&controller.stderr));
        let (code, out, err) = running.end();
        assert_eq!(code, Some(0), "{err}");
        let report = report(&scratch, "out");
        // How many come in time is up to the machine.
        assert!(report["packets_received"].as_u64().unwrap() > 100 && report["packets_refused"] == 0, "{out}");
        // It began 0.1 rad off.
        let largest: f64 = said.split("was ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        let last: f64 = said.split("is ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(largest < 0.5 && last.abs() < 0.1, "{link}: {said}{out}");
    }
}
