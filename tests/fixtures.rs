//! Builds the libraries of `fixtures/` as strangers build theirs: copied out of the workspace, with `element-api` as their
//! only dependency, named by its path. They need what the workspace needs, in the same versions, so nothing is downloaded.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use crate::support::{kept, root};

/// Builds a fixture, once per run, and gives the folder with its library.
pub fn build(name: &str) -> PathBuf {
    build_at(name, name, &kept("strangers").join(name))
}

/// Builds a fixture under another name of its package, in the given folder.
pub fn build_at(fixture: &str, package: &str, folder: &Path) -> PathBuf {
    static BUILT: Mutex<Option<HashMap<PathBuf, PathBuf>>> = Mutex::new(None);
    // Builds one after the other; they would wait for each other anyway.
    let mut built = BUILT.lock().expect("no build has failed");
    let built = built.get_or_insert_with(HashMap::new);
    built.entry(folder.to_path_buf()).or_insert_with(|| cargo_build(fixture, package, folder)).clone()
}

fn cargo_build(fixture: &str, package: &str, folder: &Path) -> PathBuf {
    let original = root().join("tests/fixtures").join(fixture);
    let manifest = fs::read_to_string(original.join("Cargo.toml")).unwrap();
    // A literal text of TOML: backslashes are no escapes in it.
    let contract = format!("'{}'", root().join("element-api").display());
    let manifest = manifest
        .replace("\"../../../element-api\"", &contract)
        .replace(&format!("name = \"{fixture}\""), &format!("name = \"{package}\""));
    fs::create_dir_all(folder.join("src")).unwrap();
    write_if_new(&folder.join("Cargo.toml"), &manifest);
    write_if_new(&folder.join("src/lib.rs"), &fs::read_to_string(original.join("src/lib.rs")).unwrap());
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    let target = kept("strangers-target");
    let (profile, flags): (_, &[&str]) =
        if cfg!(debug_assertions) { ("debug", &[]) } else { ("release", &["--release"]) };
    let output = Command::new(env!("CARGO"))
        .args(["build", "--offline", "--quiet"])
        .args(flags)
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", &target)
        .output()
        .expect("cargo can be run");
    assert!(output.status.success(), "{package} does not build:\n{}", String::from_utf8_lossy(&output.stderr));
    target.join(profile)
}

/// Leaves a file with this content untouched, so that cargo does not build it again.
fn write_if_new(path: &Path, content: &str) {
    if fs::read_to_string(path).ok().as_deref() != Some(content) {
        fs::write(path, content).unwrap();
    }
}

/// The file of a library in a folder.
pub fn file(folder: &Path, package: &str) -> PathBuf {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    folder.join(format!("{DLL_PREFIX}{}{DLL_SUFFIX}", package.replace('-', "_")))
}
