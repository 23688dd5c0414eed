//! Binaries of an FMU by the compilers that are there.

use std::path::Path;
use std::process::Command;

use super::Fmu;

/// A platform that binaries are built for.
#[derive(Debug, PartialEq, Eq)]
pub struct Target {
    /// Name in version 2.0.
    pub folder_2: &'static str,
    /// Name in version 3.0.
    pub folder_3: &'static str,
    /// What files of libraries end with.
    pub suffix: &'static str,
    /// Compilers, the first that is there builds.
    pub compilers: &'static [&'static str],
    flags: &'static [&'static str],
}

/// All platforms.
pub const TARGETS: &[Target] = &[
    Target {
        folder_2: "linux64",
        folder_3: "x86_64-linux",
        suffix: "so",
        compilers: if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
            &["cc"]
        } else {
            &["x86_64-linux-gnu-gcc"]
        },
        flags: &["-fPIC", "-fvisibility=hidden"],
    },
    Target {
        folder_2: "win64",
        folder_3: "x86_64-windows",
        suffix: "dll",
        compilers: &["x86_64-w64-mingw32-gcc"],
        flags: &["-static-libgcc"],
    },
];

/// A library.
#[derive(Debug, Clone)]
pub struct Binary {
    /// What it runs on.
    pub target: &'static Target,
    /// Its bytes.
    pub content: Vec<u8>,
}

/// Builds the library for a platform in a folder, which must be there; `None` where there is no compiler.
///
/// # Errors
/// Files that cannot be written; what the compiler says.
pub fn build(fmu: &Fmu, target: &'static Target, folder: &Path) -> Result<Option<Binary>, String> {
    let is_there = |compiler: &&&str| Command::new(compiler).arg("--version").output().is_ok();
    let Some(compiler) = target.compilers.iter().find(is_there) else { return Ok(None) };
    for (file, text) in &fmu.sources {
        std::fs::write(folder.join(file), text).map_err(|error| format!("{file}: {error}"))?;
    }
    let library = folder.join(format!("{}.{}", fmu.name, target.suffix));
    let sources = fmu.sources.iter().filter(|(file, _)| file.ends_with(".c")).map(|(file, _)| folder.join(file));
    let output = Command::new(compiler)
        .args(["-std=c99", "-O2", "-ffp-contract=off", "-shared"])
        .args(target.flags)
        .arg("-o")
        .arg(&library)
        .args(sources)
        .arg("-lm")
        .output()
        .map_err(|error| format!("{compiler}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{compiler}: {}", String::from_utf8_lossy(&output.stderr)));
    }
    let content = std::fs::read(&library).map_err(|error| format!("{}: {error}", library.display()))?;
    Ok(Some(Binary { target, content }))
}
