//! What the tests that start the program share.
#![allow(dead_code)] // each test program uses a part

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A brick that tumbles freely.
pub const BRICK: &str = r#"
title = "Brick"
[units]
time = "ms"
[simulation]
t_end = 2000
output_step = 100
[[body]]
name = "brick"
mass = 1
inertia = [1, 2, 2.5]
angular_velocity = [0.01, 5, 0.01]
[[output]]
name = "w1"
quantity = "angular_velocity"
of = "brick"
component = "x"
[[figure]]
name = "spin"
channel = "w1"
take = "peak"
published = 3
"#;

/// The root of the source tree.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// A folder below `target` that outlives the tests.
pub fn kept(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A folder of its own for each test, removed at the end.
pub struct Scratch(pub PathBuf);

impl Scratch {
    pub fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-cli-{}-{test}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("brick.toml"), BRICK).unwrap();
        Self(path)
    }

    pub fn file(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).unwrap();
    }

    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_odyn"));
        command.args(line.split_whitespace()).current_dir(&self.0).env_remove("ODYN_PLUGIN_PATH");
        // What this user has installed is of no concern here.
        command.env("XDG_DATA_HOME", self.0.join("data"));
        command
    }

    pub fn odyn(&self, line: &str) -> Ran {
        Ran(self.command(line).output().unwrap())
    }

    pub fn json(&self, path: &str) -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(self.0.join(path)).unwrap()).unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// What a process left.
pub struct Ran(pub Output);

impl Ran {
    #[track_caller]
    pub fn ends_with(self, code: i32) -> Self {
        assert_eq!(self.0.status.code(), Some(code), "stdout: {}\nstderr: {}", self.out(), self.err());
        self
    }

    pub fn out(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).unwrap()
    }

    pub fn err(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).unwrap()
    }

    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.out()).unwrap()
    }
}

pub fn rows(path: &Path) -> usize {
    fs::read_to_string(path).map_or(0, |text| text.lines().count().saturating_sub(1))
}
