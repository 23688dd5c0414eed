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
    let original = root().join("tests/fixtures").join(fixture);
    let manifest = fs::read_to_string(original.join("Cargo.toml")).unwrap();
    let manifest = manifest.replace(&format!("name = \"{fixture}\""), &format!("name = \"{package}\""));
    let source = fs::read_to_string(original.join("src/lib.rs")).unwrap();
    build_sources(&manifest, "../../../element-api", &source, folder)
}

/// Builds a fixture after a change of its source, in a folder where nobody else builds it.
pub fn build_changed(fixture: &str, package: &str, folder: &Path, change: &dyn Fn(String) -> String) -> PathBuf {
    let original = root().join("tests/fixtures").join(fixture);
    let manifest = fs::read_to_string(original.join("Cargo.toml")).unwrap();
    let manifest = manifest.replace(&format!("name = \"{fixture}\""), &format!("name = \"{package}\""));
    let source = change(fs::read_to_string(original.join("src/lib.rs")).unwrap());
    let mut built = BUILT.lock().expect("no build has failed");
    built.get_or_insert_with(HashMap::new);
    cargo_build(&with_contract(&manifest, "../../../element-api"), &source, folder, &[])
}

/// The libraries built in this run: where they are, by the folder of their sources.
static BUILT: Mutex<Option<HashMap<PathBuf, PathBuf>>> = Mutex::new(None);

/// Builds a library from the texts of its two files. `contract` is what the manifest gives as the path of `element-api`.
pub fn build_sources(manifest: &str, contract: &str, source: &str, folder: &Path) -> PathBuf {
    // Builds one after the other; they would wait for each other anyway.
    let mut built = BUILT.lock().expect("no build has failed");
    let built = built.get_or_insert_with(HashMap::new);
    let manifest = with_contract(manifest, contract);
    built.entry(folder.to_path_buf()).or_insert_with(|| cargo_build(&manifest, source, folder, &[])).clone()
}

/// The manifest with the path of `element-api` on this machine.
fn with_contract(manifest: &str, contract: &str) -> String {
    depending_on(&root().join("element-api"), contract, manifest)
}

/// Builds the fixture `good-plugin` under another name of its package, against the contract in the given folder, with flags
/// for the compiler.
pub fn build_variant(package: &str, contract: &Path, flags: &[&str]) -> PathBuf {
    let original = root().join("tests/fixtures/good-plugin");
    let manifest = fs::read_to_string(original.join("Cargo.toml")).unwrap();
    let manifest = manifest.replace("name = \"good-plugin\"", &format!("name = \"{package}\""));
    let manifest = depending_on(contract, "../../../element-api", &manifest);
    let source = fs::read_to_string(original.join("src/lib.rs")).unwrap();
    file(&cargo_build(&manifest, &source, &kept("strangers").join(package), flags), package)
}

/// A manifest whose path of `element-api` is exchanged.
fn depending_on(contract: &Path, written: &str, manifest: &str) -> String {
    // A literal text of TOML: backslashes are no escapes in it.
    manifest.replace(&format!("\"{written}\""), &format!("'{}'", contract.display()))
}

fn cargo_build(manifest: &str, source: &str, folder: &Path, compiler: &[&str]) -> PathBuf {
    fs::create_dir_all(folder.join("src")).unwrap();
    write_if_new(&folder.join("Cargo.toml"), manifest);
    write_if_new(&folder.join("src/lib.rs"), source);
    cargo(&["rustc", "--lib"], folder, compiler)
}

/// Runs cargo in the folder of a crate, with flags for what it calls, and gives the folder with the library.
fn cargo(command: &[&str], folder: &Path, more: &[&str]) -> PathBuf {
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    let target = kept("strangers-target");
    let (profile, flags): (_, &[&str]) =
        if cfg!(debug_assertions) { ("debug", &[]) } else { ("release", &["--release"]) };
    let output = Command::new(env!("CARGO"))
        .args(command)
        .args(["--offline", "--quiet"])
        .args(flags)
        .arg("--")
        .args(more)
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", &target)
        .output()
        .expect("cargo can be run");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "cargo {} in {} fails:\n{out}\n{err}", command.join(" "), folder.display());
    target.join(profile)
}

/// Builds a library of several files, and gives the folder with it. Its manifest names `element-api` by a path.
pub fn build_crate(original: &Path) -> PathBuf {
    in_crate(original, "build")
}

/// Runs the tests of a library of several files.
pub fn test_crate(original: &Path) {
    in_crate(original, "test");
}

/// Copies a crate out of the workspace and has cargo do something with it.
fn in_crate(original: &Path, command: &str) -> PathBuf {
    let name = original.file_name().and_then(|name| name.to_str()).unwrap();
    let folder = kept("strangers").join(format!("book-{name}"));
    fs::create_dir_all(folder.join("src")).unwrap();
    let manifest = fs::read_to_string(original.join("Cargo.toml")).unwrap();
    let contract = format!("'{}'", root().join("element-api").display());
    write_if_new(&folder.join("Cargo.toml"), &manifest.replace("\"../../../../element-api\"", &contract));
    for entry in fs::read_dir(original.join("src")).unwrap() {
        let path = entry.unwrap().path();
        let copy = folder.join("src").join(path.file_name().unwrap());
        write_if_new(&copy, &fs::read_to_string(&path).unwrap());
    }
    cargo(&[command], &folder, &[])
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
