//! Tests of the room, by file.

mod checks;
mod comparisons;
mod figures;
mod glbs;
mod motions;
mod reports;
mod tables;

use super::ChannelInfo;
use std::path::{Path, PathBuf};

/// A folder of its own for each test, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-results-{}-{test}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl std::ops::Deref for Scratch {
    type Target = Path;
    fn deref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn channel(name: &str, unit: &str, factor: f64) -> ChannelInfo {
    ChannelInfo {
        name: name.into(),
        unit: unit.into(),
        quantity: "position".into(),
        place: "origin of `piston`, ground axes".into(),
        factor,
        unique: true,
    }
}
